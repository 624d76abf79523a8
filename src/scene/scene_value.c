/* Values of properties: what a property takes, and what a message says it takes. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "formats/formats_number.h"
#include "scene/scene.h"

/* Significant digits that no two reals share, and that every one is given back by. */
enum { DIGITS_LEAST = 15, DIGITS_MOST = 17 };
/* The values of choices. */
static const double INDICES[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

void tli_real_print(double real, char text[TLI_REAL_BYTES])
{
    for (int digits = DIGITS_LEAST; digits <= DIGITS_MOST; digits++) {
        double again = (double)NAN;
        tli_print(text, TLI_REAL_BYTES, "%.*g", digits, real);
        if (strcmp(text, "-0") == 0) strcat(text, ".0"); /* JSON's -0 is a count */
        if (tli_number_f64(text, text + strlen(text), &again) && again == real) return;
    }
}

/* ---- what is expected ---- */

static void print_range(const tl_prop_info *info, char text[96])
{
    if (info->least > -DBL_MAX && info->most < DBL_MAX)
        tli_print(text, 96, " from %g to %g", info->least, info->most);
    else if (info->least > -DBL_MAX)
        tli_print(text, 96, " of %g or more", info->least);
    else
        *text = '\0';
}

tl_status tli_value_fail(tl_ctx *ctx, tl_status failure, const tl_prop_info *info,
                         const char *where)
{
    static const char *const NUMBERS[] = {"no", "a number", "two numbers that do not fall,",
                                          "three numbers"};
    char range[96], words[256] = "";
    const char *empty = tli_prop_may_be_empty(info) ? ", or auto" : "";
    size_t used = 0;
    print_range(info, range);
    switch (info->type) {
    case TL_PROP_FLAG: return tl_fail(ctx, failure, "%s: expected on or off", where);
    case TL_PROP_COUNT: return tl_fail(ctx, failure, "%s: expected a whole number%s", where, range);
    case TL_PROP_REAL:
    case TL_PROP_POINT:
        return tl_fail(ctx, failure, "%s: expected %s%s%s", where, NUMBERS[info->count], range,
                       empty);
    case TL_PROP_CHOICE:
        for (const char *const *word = info->choices; *word; word++)
            used += (size_t)snprintf(words + used, sizeof words - used, " %s", *word);
        return tl_fail(ctx, failure, "%s: expected one of%s", where, words);
    case TL_PROP_TEXT:
    case TL_PROP_CHANNEL:
        return tl_fail(ctx, failure, "%s: expected a line of UTF-8, less than %d bytes", where,
                       TL_SCENE_TEXT_BYTES);
    case TL_PROP_COLOR:
        return tl_fail(ctx, failure,
                       "%s: expected a colour (a name, #RRGGBB or three numbers from 0 to 1)%s",
                       where, empty);
    case TL_PROP_BOX:
        return tl_fail(ctx, failure,
                       "%s: expected six numbers, x0 y0 z0 and x1 y1 z1 not below them%s", where,
                       empty);
    case TL_PROP_PLANE:
        return tl_fail(ctx, failure,
                       "%s: expected six numbers, a point and a normal that is not 0%s", where,
                       empty);
    case TL_PROP_LIST:
        return tl_fail(ctx, failure,
                       "%s: expected at most %d rows of %u numbers, by the first one that does not "
                       "fall, the others%s%s",
                       where, TL_SCENE_ROWS_MAX, info->count, range, empty);
    }
    return tl_fail(ctx, failure, "%s: no such type", where);
}

/* ---- checking ---- */

static bool is_text(const char *text)
{
    const size_t bytes = strlen(text);
    if (bytes >= TL_SCENE_TEXT_BYTES) return false;
    for (const char *at = text; *at;) {
        const unsigned char c = (unsigned char)*at;
        const size_t more = c < 0x80 ? 1 : tli_utf8_bytes(at, text + bytes);
        if (c < 0x20 || c == 0x7f || !more) return false;
        at += more;
    }
    return true;
}

static bool complete_choice(const tl_prop_info *info, tl_value *value)
{
    size_t count = 0, index = 0;
    while (info->choices[count]) count++;
    if (value->text) {
        while (index < count && strcmp(info->choices[index], value->text) != 0) index++;
    } else {
        if (value->count != 1 || !value->reals || !(value->reals[0] >= 0) ||
            !(value->reals[0] < (double)count))
            return false;
        index = (size_t)value->reals[0];
        if ((double)index != value->reals[0]) return false;
    }
    if (index >= count || index >= sizeof INDICES / sizeof *INDICES) return false;
    value->reals = &INDICES[index];
    value->count = 1;
    value->text = info->choices[index];
    return true;
}

static bool all_within(const tl_prop_info *info, const tl_value *value)
{
    const bool is_list = info->type == TL_PROP_LIST;
    for (size_t i = 0; i < value->count; i++) {
        const double real = value->reals[i];
        const bool is_key = is_list && i % info->count == 0;
        if (!isfinite(real)) return false;
        if (!is_key && !(real >= info->least && real <= info->most)) return false;
        if (is_key && i && real < value->reals[i - info->count]) return false;
    }
    return true;
}

/* What holds beyond the range of every number. */
static bool makes_sense(const tl_prop_info *info, const tl_value *value)
{
    const double *r = value->reals;
    switch (info->type) {
    case TL_PROP_FLAG:
    case TL_PROP_COUNT: return r[0] == floor(r[0]);
    case TL_PROP_REAL: return info->count != 2 || r[0] <= r[1];
    case TL_PROP_BOX: return r[0] <= r[3] && r[1] <= r[4] && r[2] <= r[5];
    case TL_PROP_PLANE: return r[3] != 0 || r[4] != 0 || r[5] != 0;
    default: return true;
    }
}

tl_status tli_value_check(tl_ctx *ctx, tl_status failure, const tl_prop_info *info,
                          const char *where, tl_value *value)
{
    bool good;
    if (info->type == TL_PROP_CHOICE) {
        good = complete_choice(info, value);
    } else if (info->type == TL_PROP_TEXT || info->type == TL_PROP_CHANNEL) {
        good = value->text && !value->count && is_text(value->text);
        value->reals = NULL;
    } else if (!value->count) {
        good = tli_prop_may_be_empty(info) && !value->text;
    } else {
        good = !value->text && value->reals;
        good = good &&
               (info->type == TL_PROP_LIST ? value->count % info->count == 0 &&
                                                 value->count / info->count <= TL_SCENE_ROWS_MAX
                                           : value->count == info->count);
        good = good && all_within(info, value) && makes_sense(info, value);
    }
    return good ? TL_OK : tli_value_fail(ctx, failure, info, where);
}
