/* Values and command lines as text. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "formats/formats_number.h"
#include "scene/scene.h"

static const struct {
    const char *name;
    uint32_t rgb;
} COLORS[] = {{"white", 0xffffff},  {"black", 0x000000},  {"grey", 0x999999},  {"red", 0xc83232},
              {"orange", 0xe8862e}, {"yellow", 0xecc94b}, {"green", 0x4a9a4a}, {"teal", 0x2f9c95},
              {"blue", 0x3c6fb8},   {"purple", 0x8559a5}, {"brown", 0x8a5a3c}, {"bone", 0xe8dfc8},
              {"steel", 0x8fa3b5},  {"gold", 0xd4a83a}};
enum { COLOR_COUNT = sizeof COLORS / sizeof *COLORS };

/* ---- numbers ---- */

static bool is_space(char c)
{
    return c == ' ' || c == '\t';
}

/* Numbers between commas and spaces. A row ends where there is no comma. Counts them; fills reals
 * unless it is NULL. false for anything else, and for rows of another length than row (0: any). */
static bool scan_reals(const char *text, size_t row, double *reals, size_t *count)
{
    const char *end = text + strlen(text);
    *count = 0;
    while (text < end && is_space(*text)) text++;
    while (text < end) {
        double real;
        text = tli_number_f64(text, end, &real);
        if (!text) return false;
        if (reals) reals[*count] = real;
        ++*count;
        while (text < end && is_space(*text)) text++;
        const bool comma = text < end && *text == ',';
        if (row && comma == (*count % row == 0)) return false;
        if (!comma) continue;
        text++;
        while (text < end && is_space(*text)) text++;
        if (text == end) return false;
    }
    return true;
}

static void set_rgb(uint32_t code, double rgb[3])
{
    for (int k = 0; k < 3; k++) rgb[k] = (code >> (16 - 8 * k) & 255) / 255.0;
}

/* #RRGGBB */
static bool read_code(const char *text, double rgb[3])
{
    uint32_t code = 0;
    if (*text != '#' || strlen(text) != 7) return false;
    for (const char *c = text + 1; *c; c++) {
        const uint32_t digit = *c >= '0' && *c <= '9'   ? (uint32_t)(*c - '0')
                               : *c >= 'a' && *c <= 'f' ? (uint32_t)(*c - 'a') + 10
                               : *c >= 'A' && *c <= 'F' ? (uint32_t)(*c - 'A') + 10
                                                        : 16;
        if (digit == 16) return false;
        code = code << 4 | digit;
    }
    set_rgb(code, rgb);
    return true;
}

bool tl_color_read(const char *text, double rgb[3])
{
    size_t count;
    double read[3];
    for (size_t i = 0; i < COLOR_COUNT; i++)
        if (strcmp(text, COLORS[i].name) == 0) {
            set_rgb(COLORS[i].rgb, rgb);
            return true;
        }
    if (read_code(text, rgb)) return true;
    if (!scan_reals(text, 0, NULL, &count) || count != 3) return false;
    scan_reals(text, 0, read, &count);
    for (int k = 0; k < 3; k++)
        if (!(read[k] >= 0 && read[k] <= 1)) return false;
    memcpy(rgb, read, sizeof read);
    return true;
}

const char *tl_color_name(size_t index)
{
    return index < COLOR_COUNT ? COLORS[index].name : NULL;
}

/* "x", "-y=V", "z=P%" of the bounds. */
static bool read_plane(const char *text, const double bounds[6], double plane[6])
{
    const bool down = *text == '-';
    const char *name = text + down, *end = text + strlen(text);
    const int axis = *name - 'x';
    if (axis < 0 || axis > 2 || (name[1] && name[1] != '=')) return false;
    double at = bounds[2 * axis] / 2 + bounds[2 * axis + 1] / 2;
    if (name[1]) {
        const bool percent = end[-1] == '%';
        const char *after = tli_number_f64(name + 2, end - percent, &at);
        if (!after || after != end - percent || !isfinite(at)) return false;
        if (percent) at = bounds[2 * axis] * (1 - at / 100) + bounds[2 * axis + 1] * (at / 100);
    }
    memset(plane, 0, 6 * sizeof *plane);
    plane[axis] = at;
    plane[3 + axis] = down ? -1 : 1;
    return true;
}

bool tl_view_read(const char *text, double view[3])
{
    /* the side that is looked from */
    static const struct {
        const char *name;
        double azimuth, elevation;
    } SIDES[] = {{"+x", 90, 0},
                 {"-x", 270, 0},
                 {"+y", 180, 0},
                 {"-y", 0, 0},
                 {"+z", 0, 90},
                 {"-z", 180, -90},
                 {"iso", 45, 35.264389682754654}};
    double reals[3] = {0, 0, 1}, zoom;
    size_t count;
    for (size_t i = 0; i < sizeof SIDES / sizeof *SIDES; i++) {
        const size_t length = strlen(SIDES[i].name);
        if (strncmp(text, SIDES[i].name, length) != 0) continue;
        reals[0] = SIDES[i].azimuth;
        reals[1] = SIDES[i].elevation;
        text += length;
        if (*text) {
            if (*text != ',' || !scan_reals(text + 1, 0, NULL, &count) || count != 1) return false;
            scan_reals(text + 1, 0, &zoom, &count);
            reals[2] = zoom;
        }
        text = NULL;
        break;
    }
    if (text) {
        if (!scan_reals(text, 0, NULL, &count) || count < 2 || count > 3) return false;
        scan_reals(text, 0, reals, &count);
    }
    for (int k = 0; k < 3; k++)
        if (!isfinite(reals[k])) return false;
    if (!(reals[2] > 0)) return false;
    memcpy(view, reals, sizeof reals);
    return true;
}

/* ---- values ---- */

static bool read_flag(const char *text, double *flag)
{
    static const char *const WORDS[2][4] = {{"off", "no", "false", "0"},
                                            {"on", "yes", "true", "1"}};
    for (int is = 0; is < 2; is++)
        for (int i = 0; i < 4; i++)
            if (strcasecmp(text, WORDS[is][i]) == 0) {
                *flag = is;
                return true;
            }
    return false;
}

tl_status tli_value_parse(tli_arena *arena, const double bounds[6], const tl_prop_info *info,
                          const char *where, const char *text, tl_value *value)
{
    size_t count = 0;
    tl_status st = TL_OK;
    const bool is_list = info->type == TL_PROP_LIST;
    *value = (tl_value){.text = text};
    if (info->type == TL_PROP_TEXT || info->type == TL_PROP_CHANNEL || info->type == TL_PROP_CHOICE)
        return TL_OK;
    value->text = NULL;
    if (tli_prop_may_be_empty(info) &&
        (!*text || strcmp(text, "auto") == 0 || strcmp(text, "none") == 0))
        return TL_OK;
    const bool are_reals = scan_reals(text, is_list ? info->count : 0, NULL, &count);
    if (are_reals && is_list && count / info->count > TL_SCENE_ROWS_MAX)
        return tli_value_fail(arena->ctx, TL_ERR_ARG, info, where);
    /* colours and planes in words have no more */
    double *reals = tli_arena_alloc(arena, are_reals && count > 6 ? count : 6, sizeof *reals, &st);
    if (st) return st;
    value->reals = reals;
    value->count = info->count;
    if (info->type == TL_PROP_FLAG && read_flag(text, reals)) return TL_OK;
    if (info->type == TL_PROP_COLOR && tl_color_read(text, reals)) return TL_OK;
    if (info->type == TL_PROP_PLANE && read_plane(text, bounds, reals)) return TL_OK;
    if (!are_reals || !count) return tli_value_fail(arena->ctx, TL_ERR_ARG, info, where);
    scan_reals(text, is_list ? info->count : 0, reals, &value->count);
    return TL_OK;
}

/* Puts bytes behind text [*used] as far as there is room. */
static void put(char *text, size_t max_bytes, size_t *used, const char *bytes)
{
    for (; *bytes; bytes++, ++*used)
        if (*used + 1 < max_bytes) text[*used] = *bytes;
}

size_t tl_scene_print(const tl_scene *scene, tl_node node, const char *prop, char *text,
                      size_t max_bytes)
{
    size_t used = 0;
    char number[TLI_REAL_BYTES];
    const tl_prop_info *info = tl_node_prop(tl_scene_kind(scene, node), prop);
    const tl_value *value = tli_scene_value(scene, node, prop);
    if (!value) {
        used = 0;
    } else if (value->text) {
        put(text, max_bytes, &used, value->text);
    } else if (info->type == TL_PROP_FLAG) {
        put(text, max_bytes, &used, value->reals[0] != 0 ? "on" : "off");
    } else if (!value->count) {
        put(text, max_bytes, &used, "auto");
    } else {
        for (size_t i = 0; i < value->count; i++) {
            const bool row_goes_on = info->type == TL_PROP_LIST && i % info->count;
            if (i) put(text, max_bytes, &used, row_goes_on ? "," : " ");
            tli_real_print(value->reals[i], number);
            put(text, max_bytes, &used, number);
        }
    }
    if (max_bytes) text[used < max_bytes ? used : max_bytes - 1] = '\0';
    return used;
}

/* ---- command lines ---- */

static bool ends_word(char c)
{
    return !c || is_space(c) || c == '\n' || c == '\r';
}

/* Whether a word is a comment rather than a colour. */
static bool is_comment(const char *word)
{
    double rgb[3];
    char code[8] = "";
    for (size_t i = 0; i + 1 < sizeof code && !ends_word(word[i]); i++) code[i] = word[i];
    return *word == '#' && !(read_code(code, rgb) && ends_word(word[7]));
}

tl_status tl_scene_word(tl_ctx *ctx, const char **line, char *word, size_t max_bytes, bool *found)
{
    const char *at = *line;
    size_t used = 0;
    bool quoted = false;
    while (*at && ends_word(*at)) at++;
    *found = *at && !is_comment(at);
    if (!*found) return TL_OK;
    for (; *at && (quoted || !ends_word(*at)); at++) {
        char c = *at;
        if (c == '"') {
            quoted = !quoted;
            continue;
        }
        if (quoted && c == '\\' && (at[1] == '"' || at[1] == '\\')) c = *++at;
        if (used + 1 < max_bytes) word[used] = c;
        used++;
    }
    if (quoted) return tl_fail(ctx, TL_ERR_ARG, "expected a closing quote: %.200s", *line);
    if (used >= max_bytes)
        return tl_fail(ctx, TL_ERR_ARG, "a word of %zu bytes, expected less than %zu", used,
                       max_bytes);
    word[used] = '\0';
    *line = at;
    return TL_OK;
}
