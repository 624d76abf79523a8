/* Parses a command line against the option tables, and holds the tables that verbs share. A value
 * that is out of range, or a word that is not known, ends in one line that says what was expected
 * and, for a slip of the finger, what was probably meant. */
#include "cli_options.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* ---- shared tables ---- */

static const cli_option READING[] = {
    {CLI_SOLUTION, 0, "solution", CLI_TYPE_INPUT, "Q", NULL, 0, 0,
     "PLOT3D: the file with the solution that belongs to the grid"},
    {CLI_RAW, 0, "raw", CLI_TYPE_TEXT, "X,Y,Z,TYPE[,be]", NULL, 0, 0,
     "read a raw volume of X * Y * Z values, x fastest; TYPE is i8 u8 i16 u16 i32 u32 i64 u64 f32 "
     "or "
     "f64, ',be' says big endian. Files that end in .vtk or .vt* are read as what they are"},
    {CLI_SPLIT, 0, "split", CLI_TYPE_CHOICE, "5|6", "5", 0, 0,
     "tets a cell of a structured grid is split into"},
    {CLI_CELL_TO_POINT, 0, "cell-to-point", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "turn cell data into point data, by volume-weighted means"},
    {CLI_FILL_VALUE, 0, "fill-value", CLI_TYPE_REAL, "V", NULL, 0, 0,
     "value that marks missing data (a number or nan); cells that touch it are cut away"},
    {CLI_KEEP_FILL, 0, "keep-fill", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "keep the cells of missing data, with NaN as their value"},
    {CLI_REGION, 0, "region", CLI_TYPE_TEXT, "NAME", NULL, 0, 0,
     "cell array that holds the regions, instead of the blocks of the file or the first array "
     "called region, material or block"},
    {CLI_STEP, 0, "step", CLI_TYPE_TEXT, "N|last|all", "0", 0, 0,
     "step of a series, from 0 on; 'tetralod info' lists them, 'all' is for convert alone"},
    {CLI_TIME, 0, "time", CLI_TYPE_REAL, "T", NULL, 0, 0,
     "the step of a series that is nearest to this time"},
    {CLI_WELD, 0, "weld", CLI_TYPE_REAL, "D", NULL, 0, DBL_MAX,
     "make points at most this far apart one (0: at the same place exactly), before cells are "
     "split, so that blocks hang together"},
};
const cli_group cli_group_reading = {"Reading", READING, sizeof READING / sizeof *READING};

static const cli_option WRITING[] = {
    {CLI_ZLIB, 0, "zlib", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "compress a .vtu with zlib: smaller and slower"},
    {CLI_ASCII, 0, "ascii", CLI_TYPE_FLAG, NULL, NULL, 0, 0, "write text instead of bytes"},
};
const cli_group cli_group_writing = {"Writing", WRITING, sizeof WRITING / sizeof *WRITING};

static const cli_option COMMON[] = {
    {CLI_THREADS, 0, "threads", CLI_TYPE_COUNT, "N", "0", 0, TL_THREADS_MAX,
     "threads to use; 0 takes one a processor. Results do not depend on it"},
    {CLI_MEMORY, 0, "memory", CLI_TYPE_BYTES, "SIZE", "0", 0, 0,
     "hard limit of memory, such as 512M or 4G; 0 is none"},
    {CLI_JSON, 0, "json", CLI_TYPE_FLAG, NULL, NULL, 0, 0, "print one JSON object on stdout"},
    {CLI_QUIET, 'q', "quiet", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "no progress, no notes, no summary; errors and --json are still printed"},
    {CLI_HELP, 'h', "help", CLI_TYPE_FLAG, NULL, NULL, 0, 0, "print this help"},
};
const cli_group cli_group_common = {"Common", COMMON, sizeof COMMON / sizeof *COMMON};

const cli_verb *const cli_verbs[] = {
    &cli_verb_sample,
    &cli_verb_info,
    &cli_verb_convert,
    &cli_verb_simplify,
    &cli_verb_build,
    &cli_verb_compare,
    &cli_verb_extract,
    &cli_verb_surface,
    &cli_verb_points,
    &cli_verb_lines,
    &cli_verb_render,
    &cli_verb_view,
    &cli_verb_probe,
    &cli_verb_check,
    &cli_verb_formats,
    &cli_verb_bench,
    NULL,
};

/* ---- messages ---- */

int cli_misuse(const cli_verb *verb, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fputs(verb ? "tetralod " : "tetralod", stderr);
    if (verb) fputs(verb->name, stderr);
    fputs(": ", stderr);
    vfprintf(stderr, format, args);
    va_end(args);
    if (verb)
        fprintf(stderr, "\n  see 'tetralod %s --help'\n", verb->name);
    else
        fputs("\n  see 'tetralod --help'\n", stderr);
    return CLI_WRONG_USE;
}

/* Edit distance in which a swap of neighbours counts once; words longer than the table are far. */
static size_t edit_distance(const char *a, const char *b)
{
    enum { LONGEST = 31 };
    size_t d[LONGEST + 1][LONGEST + 1];
    size_t na = strlen(a), nb = strlen(b);
    if (na > LONGEST || nb > LONGEST) return SIZE_MAX;
    for (size_t i = 0; i <= na; i++) d[i][0] = i;
    for (size_t j = 0; j <= nb; j++) d[0][j] = j;
    for (size_t i = 1; i <= na; i++) {
        for (size_t j = 1; j <= nb; j++) {
            size_t best = d[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            if (d[i - 1][j] + 1 < best) best = d[i - 1][j] + 1;
            if (d[i][j - 1] + 1 < best) best = d[i][j - 1] + 1;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] &&
                d[i - 2][j - 2] + 1 < best)
                best = d[i - 2][j - 2] + 1;
            d[i][j] = best;
        }
    }
    return d[na][nb];
}

const char *cli_nearest(const char *text, const char *const *words, size_t word_count)
{
    const char *best = NULL;
    size_t best_distance = strlen(text) / 3 + 2; /* more slips than that are another word */
    for (size_t i = 0; i < word_count; i++) {
        bool begins = strlen(text) >= 3 && strncmp(words[i], text, strlen(text)) == 0;
        size_t distance = begins ? 1 : edit_distance(text, words[i]);
        if (distance < best_distance) {
            best = words[i];
            best_distance = distance;
        }
    }
    return best;
}

/* ---- values ---- */

bool cli_parse_real(const char *text, double *value)
{
    char *end = NULL;
    if (!*text || strchr(" \t\n\r\v\f", *text)) return false;
    *value = strtod(text, &end);
    return end != text && *end == '\0';
}

bool cli_parse_amount(const char *text, double *value, bool *percent)
{
    char number[64];
    size_t n = strlen(text);
    *percent = n > 0 && text[n - 1] == '%';
    if (*percent) n--;
    while (n > 0 && text[n - 1] == ' ') n--;
    if (n >= sizeof number) return false;
    memcpy(number, text, n);
    number[n] = '\0';
    if (!cli_parse_real(number, value) || !isfinite(*value) || *value < 0) return false;
    if (*percent) *value /= 100;
    return true;
}

bool cli_parse_reals(const char *text, double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        char number[64];
        size_t length = strcspn(text, ",");
        bool last = i + 1 == count;
        if (length >= sizeof number) return false;
        memcpy(number, text, length);
        number[length] = '\0';
        if (!cli_parse_real(number, &values[i]) || !isfinite(values[i]) ||
            (text[length] == ',') == last)
            return false;
        text += length + !last;
    }
    return true;
}

bool cli_parse_box(const char *text, double bounds[6])
{
    double corners[6];
    if (!cli_parse_reals(text, corners, 6)) return false;
    for (int k = 0; k < 3; k++) {
        bounds[2 * k] = fmin(corners[k], corners[3 + k]);
        bounds[2 * k + 1] = fmax(corners[k], corners[3 + k]);
    }
    return true;
}

bool cli_parse_part(const char *text, size_t length, const double range[2], double *value)
{
    char number[64];
    double parsed;
    if (!length || length >= sizeof number) return false;
    bool percent = text[length - 1] == '%';
    memcpy(number, text, length);
    number[length - percent] = '\0';
    if (!cli_parse_real(number, &parsed) || isnan(parsed)) return false;
    *value = percent ? range[0] + parsed / 100 * (range[1] - range[0]) : parsed;
    return true;
}

bool cli_list_names(const cli_value *list, const char *name)
{
    size_t length = strlen(name);
    for (size_t i = 0; i < list->item_count; i++) {
        const char *at = list->items[i];
        if (strcmp(at, name) == 0) return true;
        for (; *at; at += strcspn(at, ","), at += *at == ',')
            if (strcspn(at, ",") == length && memcmp(at, name, length) == 0) return true;
    }
    return false;
}

bool cli_list_unknown(const cli_value *list, bool (*is_known)(const void *arg, const char *name),
                      const void *arg, char name[CLI_NAME_BYTES])
{
    for (size_t i = 0; i < list->item_count; i++)
        for (const char *at = list->items[i]; *at;) {
            size_t length = strcspn(at, ",");
            snprintf(name, CLI_NAME_BYTES, "%.*s", (int)length, at);
            if (!is_known(arg, name) && !is_known(arg, list->items[i])) return true;
            at += length + (at[length] == ',');
        }
    return false;
}

bool cli_split_named(const char *text, char *name, size_t name_bytes, const char **value)
{
    const char *equals = strrchr(text, '=');
    if (!equals || equals == text || (size_t)(equals - text) >= name_bytes) return false;
    memcpy(name, text, (size_t)(equals - text));
    name[equals - text] = '\0';
    *value = equals + 1;
    return true;
}

bool cli_parse_bound(const char *text, char name[CLI_NAME_BYTES], double *value, bool *percent)
{
    const char *amount = text;
    *name = '\0';
    if (strchr(text, '=') && !cli_split_named(text, name, CLI_NAME_BYTES, &amount)) return false;
    return cli_parse_amount(amount, value, percent) && *value > 0;
}

static bool parse_count(const char *text, uint64_t *count)
{
    char *end = NULL;
    if (*text < '0' || *text > '9' || strlen(text) > 19) return false;
    *count = strtoull(text, &end, 10);
    return *end == '\0';
}

static bool parse_bytes(const char *text, uint64_t *bytes)
{
    static const char UNITS[] = "KMGT";
    char *end = NULL;
    double value = 0;
    if ((*text < '0' || *text > '9') && *text != '.') return false;
    value = strtod(text, &end);
    const char *unit = *end >= 'A' ? strchr(UNITS, *end & ~0x20) : NULL; /* in any case */
    if (unit) {
        for (ptrdiff_t i = 0; i <= unit - UNITS; i++) value *= 1024;
        end++;
        if (*end == 'i') end++;
    }
    if (*end == 'B') end++;
    if (*end || !(value < 0x1p63)) return false;
    *bytes = (uint64_t)value;
    return true;
}

static int word_index(const char *words, const char *text)
{
    size_t n = strlen(text);
    int index = 0;
    for (const char *word = words; word; index++) {
        const char *bar = strchr(word, '|');
        size_t length = bar ? (size_t)(bar - word) : strlen(word);
        if (length == n && memcmp(word, text, n) == 0) return index;
        word = bar ? bar + 1 : NULL;
    }
    return -1;
}

static bool in_range(const cli_option *option, double value)
{
    return (option->least == 0 && option->most == 0) ||
           (value >= option->least && value <= option->most);
}

/* Stores text as the value of an option; NULL, or what was expected instead. */
static const char *store(const cli_option *option, const char *text, cli_value *value)
{
    switch (option->type) {
    case CLI_TYPE_FLAG: return NULL;
    case CLI_TYPE_COUNT:
        if (!parse_count(text, &value->count) || !in_range(option, (double)value->count))
            return "a whole number";
        return NULL;
    case CLI_TYPE_REAL:
        if (!cli_parse_real(text, &value->real) || !in_range(option, value->real))
            return "a number";
        return NULL;
    case CLI_TYPE_AMOUNT:
        if (!cli_parse_amount(text, &value->real, &value->percent) ||
            !in_range(option, value->real))
            return "a number or a percentage";
        return NULL;
    case CLI_TYPE_BYTES:
        return parse_bytes(text, &value->count) ? NULL : "a size such as 512M or 4G";
    case CLI_TYPE_CHOICE:
        value->choice = word_index(option->meta, text);
        return value->choice >= 0 ? NULL : option->meta;
    case CLI_TYPE_INPUT:
    case CLI_TYPE_OUTPUT:
    case CLI_TYPE_TEXT: value->text = text; return *text ? NULL : "a text that is not empty";
    case CLI_TYPE_INPUTS:
    case CLI_TYPE_LIST:
        if (value->item_count == CLI_LIST_MAX) return "at most 64 of them";
        value->items[value->item_count++] = text;
        return *text ? NULL : "a text that is not empty";
    }
    return "another value";
}

/* ---- the command line ---- */

static const cli_option *find_option(const cli_verb *verb, const char *name, size_t name_length,
                                     char letter)
{
    for (size_t g = 0; g < CLI_GROUPS_MAX && verb->groups[g]; g++) {
        const cli_group *group = verb->groups[g];
        for (size_t i = 0; i < group->option_count; i++) {
            const cli_option *option = &group->options[i];
            if (letter ? option->letter == letter
                       : strlen(option->name) == name_length &&
                             memcmp(option->name, name, name_length) == 0)
                return option;
        }
    }
    return NULL;
}

static int unknown_option(const cli_verb *verb, const char *word)
{
    const char *words[CLI_ID_COUNT];
    size_t count = 0;
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(word + 2, "="), word + 2);
    for (size_t g = 0; g < CLI_GROUPS_MAX && verb->groups[g]; g++)
        for (size_t i = 0; i < verb->groups[g]->option_count && count < CLI_ID_COUNT; i++)
            words[count++] = verb->groups[g]->options[i].name;
    const char *near = cli_nearest(name, words, count);
    if (near) return cli_misuse(verb, "unknown option '--%s'; did you mean '--%s'?", name, near);
    return cli_misuse(verb, "unknown option '--%s'", name);
}

static int parse_value(const cli_verb *verb, const cli_option *option, const char *text,
                       cli_args *args)
{
    cli_value *value = &args->values[option->id];
    const char *expected = store(option, text, value);
    value->given = true;
    if (!expected) return CLI_DONE;
    if (option->least == DBL_MIN)
        return cli_misuse(verb, "--%s %s: expected %s above 0, at most %.10g", option->name, text,
                          expected, option->most);
    if (option->least != 0 || option->most != 0)
        return cli_misuse(verb, "--%s %s: expected %s from %.10g to %.10g", option->name, text,
                          expected, option->least, option->most);
    return cli_misuse(verb, "--%s %s: expected %s", option->name, text, expected);
}

/* Takes one option, argv[*at], and its value if it has one. */
static int parse_option(const cli_verb *verb, int argc, char **argv, int *at, cli_args *args)
{
    const char *word = argv[*at];
    const bool is_long = word[1] == '-';
    const char *equals = is_long ? strchr(word, '=') : NULL;
    size_t length = is_long ? (equals ? (size_t)(equals - word - 2) : strlen(word + 2)) : 0;
    const cli_option *option =
        is_long ? find_option(verb, word + 2, length, 0) : find_option(verb, NULL, 0, word[1]);
    if (!option && is_long) return unknown_option(verb, word);
    if (!option) return cli_misuse(verb, "unknown option '%s'", word);
    const char *inlined = equals ? equals + 1 : (!is_long && word[2] ? word + 2 : NULL);
    if (option->type == CLI_TYPE_FLAG) {
        if (inlined) return cli_misuse(verb, "--%s takes no value", option->name);
        args->values[option->id].given = true;
        return CLI_DONE;
    }
    if (inlined) return parse_value(verb, option, inlined, args);
    if (*at + 1 >= argc)
        return cli_misuse(verb, "--%s needs a value, %s", option->name, option->meta);
    return parse_value(verb, option, argv[++*at], args);
}

static void set_defaults(const cli_verb *verb, cli_args *args)
{
    *args = (cli_args){.verb = verb};
    for (size_t g = 0; g < CLI_GROUPS_MAX && verb->groups[g]; g++)
        for (size_t i = 0; i < verb->groups[g]->option_count; i++) {
            const cli_option *option = &verb->groups[g]->options[i];
            if (option->initial) store(option, option->initial, &args->values[option->id]);
        }
}

int cli_parse(const cli_verb *verb, int argc, char **argv, cli_args *args)
{
    bool only_operands = false;
    set_defaults(verb, args);
    for (int i = 0; i < argc; i++) {
        if (!only_operands && strcmp(argv[i], "--") == 0) {
            only_operands = true;
        } else if (!only_operands && argv[i][0] == '-' && argv[i][1]) {
            int failed = parse_option(verb, argc, argv, &i, args);
            if (failed) return failed;
        } else if (args->operand_count == verb->operand_most) {
            return cli_misuse(verb, "'%s' is one too many; usage: tetralod %s %s", argv[i],
                              verb->name, verb->operands);
        } else {
            args->operands[args->operand_count++] = argv[i];
        }
    }
    if (args->values[CLI_HELP].given) return CLI_DONE;
    if (args->operand_count < verb->operand_least)
        return cli_misuse(verb, "something is missing; usage: tetralod %s %s", verb->name,
                          verb->operands);
    return CLI_DONE;
}
