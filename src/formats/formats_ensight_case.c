/* EnSight: the case file, and which file a time means (EnSight User Manual, "EnSight Gold Case File
 * Format"). */
#include "formats/formats_ensight.h"

#include "formats/formats_number.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LIST_MAX 16777216u /* sets, variables, times */

typedef enum section { NO_SECTION, FORMAT, GEOMETRY, VARIABLE, TIME, OTHER } section;

/* ---- lines ---- */

static bool next_word(tli_span *rest, tli_span *word)
{
    const char *at = rest->text, *end = at + rest->bytes;
    at = tli_number_skip_space(at, end);
    const char *stop = at;
    while (stop < end && tli_number_skip_space(stop, end) == stop) stop++;
    *word = (tli_span){at, (size_t)(stop - at)};
    *rest = (tli_span){stop, (size_t)(end - stop)};
    return word->bytes > 0;
}

static bool take_int(tli_span *rest, int64_t *value)
{
    tli_span word, after = *rest;
    if (!next_word(&after, &word) || !tli_span_i64s(word, value, 1)) return false;
    *rest = after;
    return true;
}

/* Words of "key: value" agree, whatever is between them. */
static bool key_is(tli_span key, const char *words)
{
    tli_span word, rest = key;
    while (next_word(&rest, &word)) {
        size_t length = strcspn(words, " ");
        char expected[24];
        if (length == 0 || length >= sizeof expected) return false;
        memcpy(expected, words, length);
        expected[length] = '\0';
        if (!tli_span_is(word, expected)) return false;
        words += length;
        words += strspn(words, " ");
    }
    return *words == '\0';
}

static section section_of(tli_span line, section before)
{
    static const struct {
        const char *name;
        section is;
    } names[] = {{"FORMAT", FORMAT},     {"GEOMETRY", GEOMETRY},
                 {"VARIABLE", VARIABLE}, {"TIME", TIME},
                 {"FILE", OTHER},        {"MATERIAL", OTHER},
                 {"SCRIPTS", OTHER},     {"BLOCK_CONTINUATION", OTHER}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (tli_span_is(line, names[i].name)) return names[i].is;
    return before;
}

/* ---- geometry, variables ---- */

/* Numbers of a time set and a file set may stand before the name. */
static void take_sets(tli_span *rest, int64_t *set)
{
    int64_t file_set;
    *set = 0;
    if (take_int(rest, set)) (void)take_int(rest, &file_set);
}

static void read_geometry(tli_ensight_case *c, tli_span key, tli_span value)
{
    tli_span word;
    if (!key_is(key, "model")) {
        tl_log(c->ctx, TL_LOG_INFO, "'%s': %.*s of the geometry left out", c->path,
               (int)(key.bytes < 40 ? key.bytes : 40), key.text);
        return;
    }
    take_sets(&value, &c->geometry_set);
    next_word(&value, &c->geometry);
    while (next_word(&value, &word)) c->coords_only |= tli_span_is(word, "change_coords_only");
}

static tl_status add_variable(tli_ensight_case *c, const tli_ensight_variable *variable)
{
    tl_status st = TL_OK;
    c->variables = tl_mem_resize(c->ctx, c->variables, (size_t)c->variable_count + 1,
                                 sizeof *c->variables, &st);
    if (!st) c->variables[c->variable_count++] = *variable;
    return st;
}

/* The kinds of variables; complex ones are two. */
static bool kind_of(tli_span key, tli_ensight_variable *v, bool *is_complex)
{
    static const struct {
        const char *name;
        uint32_t components;
        bool is_complex;
    } kinds[] = {{"scalar", 1, false},        {"vector", 3, false},
                 {"tensor symm", 6, false},   {"tensor asym", 9, false},
                 {"complex scalar", 1, true}, {"complex vector", 3, true}};
    char words[48];
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        for (int nodes = 0; nodes < 2; nodes++) {
            snprintf(words, sizeof words, "%s per %s", kinds[i].name, nodes ? "node" : "element");
            if (!key_is(key, words)) continue;
            v->components = kinds[i].components;
            v->on_nodes = nodes;
            *is_complex = kinds[i].is_complex;
            return true;
        }
    return false;
}

static tl_status read_variable(tli_ensight_case *c, tli_span key, tli_span value)
{
    tli_ensight_variable v = {0};
    tli_span name = {0}, second;
    bool is_complex = false;
    if (!kind_of(key, &v, &is_complex)) {
        tl_log(c->ctx, TL_LOG_INFO, "'%s': a %.*s left out", c->path,
               (int)(key.bytes < 40 ? key.bytes : 40), key.text);
        return TL_OK;
    }
    take_sets(&value, &v.set);
    if (!next_word(&value, &name) || !next_word(&value, &v.file))
        return tl_fail(c->ctx, TL_ERR_FORMAT, "'%s': a variable without a name or a file", c->path);
    tli_span_text(name, v.name, TLI_ENSIGHT_LINE);
    size_t length = strlen(v.name);
    if (is_complex) strcpy(v.name + length, "_r");
    tl_status st = add_variable(c, &v);
    if (st || !is_complex) return st;
    if (!next_word(&value, &second))
        return tl_fail(c->ctx, TL_ERR_FORMAT, "'%s': variable '%s' without an imaginary part",
                       c->path, v.name);
    v.file = second;
    strcpy(v.name + length, "_i");
    return add_variable(c, &v);
}

/* ---- time ---- */

static tl_status add_set(tli_ensight_case *c, tli_span value)
{
    tl_status st = TL_OK;
    int64_t number = 0;
    if (!take_int(&value, &number))
        return tl_fail(c->ctx, TL_ERR_FORMAT, "'%s': a time set without a number", c->path);
    c->sets = tl_mem_resize(c->ctx, c->sets, (size_t)c->set_count + 1, sizeof *c->sets, &st);
    if (!st)
        c->sets[c->set_count++] = (tli_ensight_set){.number = number, .count = 1, .increment = 1};
    return st;
}

/* Numbers of a value, which may go on in the lines that follow; at least one list is wanted. */
static tl_status take_list(tli_ensight_case *c, tli_span value, tli_ensight_set *set, bool times)
{
    double number;
    tl_status st = TL_OK;
    const char *at = value.text, *end = at + value.bytes;
    while (!st) {
        const char *after = tli_number_f64(at, end, &number);
        if (!after) break;
        at = after;
        uint64_t *count = times ? &set->time_count : &set->number_count;
        if (*count >= LIST_MAX)
            return tl_fail(c->ctx, TL_ERR_FORMAT, "'%s': more than %u times", c->path, LIST_MAX);
        if ((*count & (*count - 1)) == 0) { /* doubles at powers of two */
            size_t room = *count ? 2 * (size_t)*count : 1;
            if (times)
                set->times = tl_mem_resize(c->ctx, set->times, room, sizeof *set->times, &st);
            else
                set->numbers = tl_mem_resize(c->ctx, set->numbers, room, sizeof *set->numbers, &st);
        }
        if (st) break;
        if (times)
            set->times[(*count)++] = number;
        else
            set->numbers[(*count)++] = fabs(number) < 1e15 ? (int64_t)number : 0;
    }
    return st;
}

/* list: what a line without a key goes on with. */
static tl_status read_time(tli_ensight_case *c, tli_span key, tli_span value, int *list)
{
    tli_ensight_set *set = c->set_count ? &c->sets[c->set_count - 1] : NULL;
    *list = 0;
    if (key_is(key, "time set")) return add_set(c, value);
    if (!set) return tl_fail(c->ctx, TL_ERR_FORMAT, "'%s': times without a time set", c->path);
    if (key_is(key, "number of steps") && !take_int(&value, &set->count))
        return tl_fail(c->ctx, TL_ERR_FORMAT, "'%s': number of steps without a number", c->path);
    if (key_is(key, "filename start number")) (void)take_int(&value, &set->start);
    if (key_is(key, "filename increment")) (void)take_int(&value, &set->increment);
    if (key_is(key, "filename numbers")) *list = 1;
    if (key_is(key, "time values")) *list = 2;
    if (key_is(key, "filename numbers file") || key_is(key, "time values file"))
        return tl_fail(c->ctx, TL_ERR_UNSUPPORTED, "'%s': times in a file of their own", c->path);
    return *list ? take_list(c, value, set, *list == 2) : TL_OK;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Sets without times count their steps. All times together, each once, ascending. */
static tl_status merge_times(tli_ensight_case *c)
{
    tl_status st = TL_OK;
    size_t total = 0, used = 0;
    for (uint64_t s = 0; s < c->set_count; s++) total += (size_t)c->sets[s].time_count;
    c->times = tl_mem_alloc(c->ctx, total, sizeof *c->times, &st);
    for (uint64_t s = 0; !st && s < c->set_count; s++)
        for (uint64_t i = 0; i < c->sets[s].time_count; i++) c->times[used++] = c->sets[s].times[i];
    if (st || !used) return st;
    qsort(c->times, used, sizeof *c->times, by_value);
    for (size_t i = 0; i < used; i++)
        if (c->time_count == 0 || c->times[i] != c->times[c->time_count - 1])
            c->times[c->time_count++] = c->times[i];
    return st;
}

/* ---- the file ---- */

static tl_status read_pair(tli_ensight_case *c, section now, tli_span key, tli_span value,
                           int *list)
{
    if (now == FORMAT && key_is(key, "type")) {
        tli_span rest = value, word;
        while (next_word(&rest, &word)) c->gold |= tli_span_is(word, "gold");
    }
    if (now == GEOMETRY) read_geometry(c, key, value);
    if (now == VARIABLE) return read_variable(c, key, value);
    if (now == TIME) return read_time(c, key, value, list);
    return TL_OK;
}

tl_status tli_ensight_case_read(tl_ctx *ctx, const char *path, const tli_map *map,
                                tli_ensight_case *read)
{
    tli_scan scan;
    tli_span line;
    section now = NO_SECTION;
    int list = 0;
    tl_status st = TL_OK;
    *read = (tli_ensight_case){.ctx = ctx, .path = path};
    tli_scan_open(ctx, path, map->bytes, map->byte_count, &scan);
    while (!st && tli_scan_line(&scan, &line)) {
        const char *at = tli_number_skip_space(line.text, line.text + line.bytes);
        if (at == line.text + line.bytes || *at == '#') continue;
        const char *colon = memchr(line.text, ':', line.bytes);
        if (!colon && now == TIME && list) {
            st = take_list(read, line, &read->sets[read->set_count - 1], list == 2);
            continue;
        }
        if (!colon) {
            now = section_of(line, now);
            list = 0;
            continue;
        }
        tli_span key = {line.text, (size_t)(colon - line.text)};
        tli_span value = {colon + 1, (size_t)(line.text + line.bytes - colon - 1)};
        st = read_pair(read, now, key, value, &list);
    }
    if (!st && !read->geometry.bytes)
        st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': no model in its section GEOMETRY", path);
    return st ? st : merge_times(read);
}

void tli_ensight_case_release(tli_ensight_case *read)
{
    for (uint64_t s = 0; s < read->set_count; s++) {
        tl_mem_free(read->ctx, read->sets[s].numbers);
        tl_mem_free(read->ctx, read->sets[s].times);
    }
    tl_mem_free(read->ctx, read->times);
    tl_mem_free(read->ctx, read->sets);
    tl_mem_free(read->ctx, read->variables);
    *read = (tli_ensight_case){.ctx = read->ctx};
}

/* ---- files of a time ---- */

/* The last step of a set that is not after a time, else the first. */
static int64_t step_of(const tli_ensight_set *set, double time)
{
    int64_t step = 0;
    for (uint64_t i = 0; i < set->time_count; i++)
        if (set->times[i] <= time) step = (int64_t)i;
    return step;
}

/* Asterisks become a number with as many digits. */
static tl_status fill_in(tl_ctx *ctx, tli_span name, int64_t number, char **filled)
{
    tl_status st = TL_OK;
    const char *star = memchr(name.text, '*', name.bytes);
    size_t head = star ? (size_t)(star - name.text) : name.bytes, stars = 0;
    while (head + stars < name.bytes && name.text[head + stars] == '*') stars++;
    size_t room = name.bytes + 32;
    char *text = tl_mem_alloc(ctx, room, 1, &st);
    if (st) return st;
    memcpy(text, name.text, head);
    int digits =
        stars ? snprintf(text + head, 32, "%0*" PRId64, (int)(stars < 20 ? stars : 20), number) : 0;
    size_t tail = name.bytes - head - stars;
    memcpy(text + head + digits, name.text + head + stars, tail);
    text[head + (size_t)digits + tail] = '\0';
    *filled = text;
    return TL_OK;
}

static const char *find_text(const char *at, const char *end, const char *text)
{
    size_t length = strlen(text);
    while ((size_t)(end - at) >= length && (at = memchr(at, text[0], (size_t)(end - at))) != NULL) {
        if ((size_t)(end - at) >= length && memcmp(at, text, length) == 0) return at;
        at++;
    }
    return NULL;
}

/* A file with several steps: each stands between two lines. */
static tl_status enter_step(tli_scan *scan, int64_t step)
{
    static const char begin[] = "BEGIN TIME STEP", end[] = "END TIME STEP";
    const char *at =
        find_text(scan->at, scan->end - scan->at > 240 ? scan->at + 240 : scan->end, begin);
    if (!at) return TL_OK;
    for (int64_t i = 0; at && i < step; i++) at = find_text(at + 1, scan->end, begin);
    if (!at) return tli_scan_fail(scan, "no step %" PRId64 " in the file", step);
    const char *stop = find_text(at, scan->end, end);
    scan->at = at;
    if (stop) scan->end = stop;
    if (scan->binary) {
        scan->at += scan->end - at < TLI_ENSIGHT_LINE ? scan->end - at : TLI_ENSIGHT_LINE;
    } else {
        tli_span line;
        tli_scan_line(scan, &line);
    }
    return TL_OK;
}

/* True if the head of a geometry says that its bytes stand in records. */
static bool is_fortran(const tli_map *map)
{
    const char *head = (const char *)map->bytes;
    return find_text(head, head + (map->byte_count < 84 ? map->byte_count : 84), "Fortran Binary");
}

/* The geometry says what kind of files the case has. */
static tl_status enter_file(tli_ensight_case *c, bool geometry, tli_scan *scan)
{
    const char *head_end = scan->end - scan->at > 84 ? scan->at + 84 : scan->end;
    if (geometry) {
        c->binary = c->fortran || find_text(scan->at, head_end, "C Binary") != NULL;
        if (c->binary) scan->at = head_end - (head_end - scan->at > TLI_ENSIGHT_LINE ? 4 : 0);
    }
    scan->binary = c->binary;
    scan->big_endian = c->big_endian;
    return TL_OK;
}

tl_status tli_ensight_open(tli_ensight_case *read, tli_span name, int64_t set, double time,
                           char **path, tli_map *map, tli_scan *scan)
{
    char *filled = NULL;
    int64_t step = 0, number = 0;
    for (uint64_t s = 0; s < read->set_count; s++) {
        const tli_ensight_set *known = &read->sets[s];
        /* a name with asterisks and no set belongs to the first one */
        if (known->number != set && !(set == 0 && s == 0)) continue;
        step = step_of(known, time);
        number = (uint64_t)step < known->number_count ? known->numbers[step]
                                                      : known->start + step * known->increment;
    }
    tl_status st = fill_in(read->ctx, name, number, &filled);
    if (!st)
        st = tli_open_named(read->ctx, read->path, (tli_span){filled, strlen(filled)}, path, map);
    tl_mem_free(read->ctx, filled);
    if (st) return st;
    bool geometry = name.text == read->geometry.text;
    if (geometry) read->fortran = is_fortran(map);
    if (read->fortran) st = tli_ensight_join_records(read->ctx, *path, map);
    tli_scan_open(read->ctx, *path, map->bytes, map->byte_count, scan);
    if (!st) st = enter_file(read, geometry, scan);
    if (!st) st = enter_step(scan, step);
    if (!st) return TL_OK;
    tli_map_close(read->ctx, map);
    tl_mem_free(read->ctx, *path);
    *path = NULL;
    return st;
}
