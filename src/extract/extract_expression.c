/* Reads the text of an expression by recursive descent, straight into operations of a stack. */
#include "extract/extract_expression.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "formats/formats_number.h"

enum {
    DEPTH_MAX = 200,     /* of operands within operands */
    TEXT_MAX = 4096,     /* bytes of an expression */
    TEXT_SHOWN = 120,    /* bytes of the text in messages */
    INDEX_MAX = 1000000, /* of a component */
    ARGUMENTS_MAX = 1000
};

typedef struct parser {
    tl_ctx *ctx;
    tl_expression *out;
    size_t op_room;
    const char *at, *end;
    unsigned depth;
} parser;

static const struct function {
    const char *name;
    tli_op_kind kind;
    size_t index;
    unsigned least, most; /* arguments */
} FUNCTIONS[] = {
    {"abs", TLI_OP_ABS, 0, 1, 1},
    {"sqrt", TLI_OP_SQRT, 0, 1, 1},
    {"exp", TLI_OP_EXP, 0, 1, 1},
    {"log", TLI_OP_LOG, 0, 1, 1},
    {"log10", TLI_OP_LOG10, 0, 1, 1},
    {"sin", TLI_OP_SIN, 0, 1, 1},
    {"cos", TLI_OP_COS, 0, 1, 1},
    {"tan", TLI_OP_TAN, 0, 1, 1},
    {"atan2", TLI_OP_ATAN2, 0, 2, 2},
    {"min", TLI_OP_MIN, 0, 2, ARGUMENTS_MAX},
    {"max", TLI_OP_MAX, 0, 2, ARGUMENTS_MAX},
    {"if", TLI_OP_IF, 0, 3, 3},
    {"vec", TLI_OP_VECTOR, 0, 1, ARGUMENTS_MAX},
    {"mag", TLI_OP_MAGNITUDE, 0, 1, 1},
    {"norm", TLI_OP_NORMALIZE, 0, 1, 1},
    {"dot", TLI_OP_DOT, 0, 2, 2},
    {"cross", TLI_OP_CROSS, 0, 2, 2},
    {"grad", TLI_OP_DERIVE, TL_DERIVED_GRADIENT, 1, 1},
    {"div", TLI_OP_DERIVE, TL_DERIVED_DIVERGENCE, 1, 1},
    {"curl", TLI_OP_DERIVE, TL_DERIVED_VORTICITY, 1, 1},
    {"qcriterion", TLI_OP_DERIVE, TL_DERIVED_Q, 1, 1},
};

/* ---- places and messages ---- */

tl_status tli_expression_fail(tl_ctx *ctx, const tl_expression *expression, size_t column,
                              const char *format, ...)
{
    char what[256];
    va_list args;
    va_start(args, format);
    tli_vprint(what, sizeof what, format, args);
    va_end(args);
    bool whole = strlen(expression->text) <= TEXT_SHOWN;
    return tl_fail(ctx, TL_ERR_ARG, "expression '%.*s%s', column %zu: %s", TEXT_SHOWN,
                   expression->text, whole ? "" : "...", column, what);
}

/* Characters before a place, plus one: bytes that continue a character of UTF-8 don't count. */
static size_t column_of(const parser *p, const char *at)
{
    size_t column = 1;
    for (const char *c = p->out->text; c < at; c++) column += ((unsigned char)*c & 0xc0) != 0x80;
    return column;
}

static tl_status fail_at(const parser *p, const char *at, const char *expected)
{
    return tli_expression_fail(p->ctx, p->out, column_of(p, at), "expected %s%s", expected,
                               at == p->end ? ", not the end" : "");
}

static void skip_space(parser *p)
{
    p->at = tli_number_skip_space(p->at, p->end);
}

/* Takes a sign if it stands here. */
static bool take(parser *p, const char *sign)
{
    skip_space(p);
    size_t length = strlen(sign);
    if ((size_t)(p->end - p->at) < length || memcmp(p->at, sign, length) != 0) return false;
    p->at += length;
    return true;
}

static tl_status need(parser *p, const char *sign, const char *expected)
{
    return take(p, sign) ? TL_OK : fail_at(p, p->at, expected);
}

static bool is_name_char(char c, bool first)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
           (unsigned char)c >= 0x80 || (!first && c >= '0' && c <= '9');
}

static tl_status add(parser *p, tli_op_kind kind, const char *at, tli_op **op)
{
    tl_status st = TL_OK;
    tl_expression *e = p->out;
    if (e->op_count == p->op_room) {
        size_t room = p->op_room ? 2 * p->op_room : 16;
        e->ops = tl_mem_resize(p->ctx, e->ops, room, sizeof *e->ops, &st);
        if (st) return st;
        p->op_room = room;
    }
    e->ops[e->op_count] = (tli_op){.kind = kind, .column = (uint32_t)column_of(p, at)};
    if (op) *op = &e->ops[e->op_count];
    e->op_count++;
    return TL_OK;
}

/* ---- operands ---- */

static tl_status read_any(parser *p);

static const char *skip_digits(const parser *p, const char *at)
{
    while (at < p->end && *at >= '0' && *at <= '9') at++;
    return at;
}

/* The end of a number that begins here: what stands behind may be a sign. */
static const char *number_end(const parser *p, const char *at)
{
    at = skip_digits(p, at);
    if (at < p->end && *at == '.') at = skip_digits(p, at + 1);
    const char *power = at + 1;
    if (at == p->end || (*at != 'e' && *at != 'E')) return at;
    if (power < p->end && (*power == '+' || *power == '-')) power++;
    const char *end = skip_digits(p, power);
    return end > power ? end : at;
}

static tl_status read_number(parser *p)
{
    double value;
    tli_op *op;
    const char *at = p->at, *behind = number_end(p, at);
    bool alone = behind == p->end || !is_name_char(*behind, false);
    if (!alone || !tli_number_f64(at, behind, &value))
        return fail_at(p, at, "a number, and an operator behind it");
    tl_status st = add(p, TLI_OP_NUMBER, at, &op);
    if (!st) op->number = value;
    p->at = behind;
    return st;
}

static tl_status add_channel(parser *p, const char *at, const char *name, size_t length)
{
    tli_op *op;
    tl_status st = add(p, TLI_OP_CHANNEL, at, &op);
    char *own = tl_mem_alloc(p->ctx, length + 1, 1, &st);
    if (st) return st;
    memcpy(own, name, length);
    own[length] = 0;
    op->name = own;
    return TL_OK;
}

/* In quotes; one that stands twice is one of the name. */
static tl_status read_quoted(parser *p)
{
    const char *at = p->at, quote = *p->at++;
    tl_status st = add_channel(p, at, p->at, (size_t)(p->end - p->at));
    if (st) return st;
    char *name = p->out->ops[p->out->op_count - 1].name;
    while (p->at < p->end) {
        char c = *p->at++;
        if (c == quote && !(p->at < p->end && *p->at == quote)) {
            *name = 0;
            return TL_OK;
        }
        p->at += c == quote;
        *name++ = c;
    }
    return tli_expression_fail(p->ctx, p->out, column_of(p, at), "a quote without its end");
}

static tl_status add_call(parser *p, const struct function *f, const char *at, size_t arguments)
{
    tli_op *op;
    tl_status st = TL_OK;
    bool folded = f->kind == TLI_OP_MIN || f->kind == TLI_OP_MAX;
    for (size_t i = folded ? 2 : arguments; !st && i <= arguments; i++) {
        st = add(p, f->kind, at, &op);
        if (!st) op->index = f->kind == TLI_OP_VECTOR ? arguments : f->index;
    }
    return st;
}

static tl_status read_call(parser *p, const char *name, size_t length)
{
    const struct function *f = NULL;
    size_t arguments = 0;
    tl_status st = TL_OK;
    for (size_t i = 0; i < sizeof FUNCTIONS / sizeof *FUNCTIONS; i++)
        if (strlen(FUNCTIONS[i].name) == length && memcmp(FUNCTIONS[i].name, name, length) == 0)
            f = &FUNCTIONS[i];
    if (!f)
        return tli_expression_fail(p->ctx, p->out, column_of(p, name),
                                   "there is no function '%.*s'", (int)(length < 60 ? length : 60),
                                   name);
    do {
        st = read_any(p);
        arguments++;
    } while (!st && arguments < ARGUMENTS_MAX && take(p, ","));
    if (!st) st = need(p, ")", "an operator, ',' or ')'");
    if (!st && (arguments < f->least || arguments > f->most))
        return tli_expression_fail(p->ctx, p->out, column_of(p, name),
                                   "%s() takes %u arguments%s, not %zu", f->name, f->least,
                                   f->most > f->least ? " or more" : "", arguments);
    return st ? st : add_call(p, f, name, arguments);
}

static tl_status read_name(parser *p)
{
    tli_op *op;
    tl_status st;
    const char *name = p->at;
    while (p->at < p->end && is_name_char(*p->at, p->at == name)) p->at++;
    size_t length = (size_t)(p->at - name);
    if (take(p, "(")) return read_call(p, name, length);
    if (length == 2 && memcmp(name, "pi", 2) == 0) {
        st = add(p, TLI_OP_NUMBER, name, &op);
        if (!st) op->number = 3.14159265358979323846;
        return st;
    }
    if (length == 1 && *name >= 'x' && *name <= 'z') {
        st = add(p, TLI_OP_POSITION, name, &op);
        if (!st) op->index = (size_t)(*name - 'x');
        return st;
    }
    return add_channel(p, name, name, length);
}

static tl_status read_operand(parser *p)
{
    skip_space(p);
    if (p->at == p->end) return fail_at(p, p->at, "a number, a name or '('");
    char c = *p->at;
    if ((c >= '0' && c <= '9') || c == '.') return read_number(p);
    if (c == '\'' || c == '"') return read_quoted(p);
    if (is_name_char(c, true)) return read_name(p);
    if (!take(p, "(")) return fail_at(p, p->at, "a number, a name or '('");
    tl_status st = read_any(p);
    return st ? st : need(p, ")", "an operator or ')'");
}

static tl_status read_component(parser *p, const char *at, bool bracket)
{
    int64_t index = -1;
    tli_op *op;
    skip_space(p);
    if (bracket) {
        const char *behind = tli_number_i64(p->at, p->end, &index);
        if (!behind || index < 0 || index > INDEX_MAX)
            return fail_at(p, p->at, "the number of a component, from 0");
        p->at = behind;
        tl_status st = need(p, "]", "']'");
        if (st) return st;
    } else {
        bool alone = p->end - p->at == 1 || (p->at < p->end && !is_name_char(p->at[1], false));
        if (alone && *p->at >= 'x' && *p->at <= 'z') index = *p->at++ - 'x';
        if (index < 0)
            return fail_at(p, p->at, ".x, .y or .z (a name with a point stands in quotes)");
    }
    tl_status st = add(p, TLI_OP_PICK, at, &op);
    if (!st) op->index = (size_t)index;
    return st;
}

static tl_status read_components(parser *p)
{
    tl_status st = read_operand(p);
    while (!st) {
        skip_space(p);
        const char *at = p->at;
        bool bracket = take(p, "[");
        if (!bracket && !take(p, ".")) break;
        st = read_component(p, at, bracket);
    }
    return st;
}

/* ---- operators, from tight to loose ---- */

static tl_status read_signed(parser *p)
{
    tl_status st;
    skip_space(p);
    const char *at = p->at;
    if (++p->depth > DEPTH_MAX)
        return tli_expression_fail(p->ctx, p->out, column_of(p, at),
                                   "more than %d operands within each other", DEPTH_MAX);
    bool minus = take(p, "-"), invert = !minus && take(p, "!");
    if (minus || invert || take(p, "+")) {
        st = read_signed(p);
        if (!st && (minus || invert)) st = add(p, minus ? TLI_OP_NEGATE : TLI_OP_NOT, at, NULL);
    } else {
        st = read_components(p);
        skip_space(p);
        at = p->at;
        if (!st && take(p, "^")) {
            st = read_signed(p);
            if (!st) st = add(p, TLI_OP_POWER, at, NULL);
        }
    }
    p->depth--;
    return st;
}

typedef struct binary {
    const char *sign;
    tli_op_kind kind;
} binary;

/* Signs that begin with another one stand before it. */
static const binary LEVELS[][7] = {
    {{"||", TLI_OP_OR}},
    {{"&&", TLI_OP_AND}},
    {{"==", TLI_OP_EQUAL},
     {"!=", TLI_OP_NOT_EQUAL},
     {"<=", TLI_OP_LESS_EQUAL},
     {">=", TLI_OP_GREATER_EQUAL},
     {"<", TLI_OP_LESS},
     {">", TLI_OP_GREATER}},
    {{"+", TLI_OP_ADD}, {"-", TLI_OP_SUBTRACT}},
    {{"*", TLI_OP_MULTIPLY}, {"/", TLI_OP_DIVIDE}},
};
enum { LEVEL_COUNT = sizeof LEVELS / sizeof *LEVELS, COMPARISONS = 2 };

static const binary *take_binary(parser *p, size_t level)
{
    for (const binary *o = LEVELS[level]; o->sign; o++)
        if (take(p, o->sign)) return o;
    return NULL;
}

static tl_status read_level(parser *p, size_t level)
{
    if (level == LEVEL_COUNT) return read_signed(p);
    tl_status st = read_level(p, level + 1);
    for (unsigned count = 0; !st; count++) {
        skip_space(p);
        const char *at = p->at;
        const binary *o = take_binary(p, level);
        if (!o) break;
        if (level == COMPARISONS && count)
            return tli_expression_fail(p->ctx, p->out, column_of(p, at),
                                       "comparisons of comparisons need parentheses, or &&");
        st = read_level(p, level + 1);
        if (!st) st = add(p, o->kind, at, NULL);
    }
    return st;
}

static tl_status read_any(parser *p)
{
    return read_level(p, 0);
}

/* ---- the object ---- */

tl_status tl_expression_parse(tl_ctx *ctx, const char *text, tl_expression **expression)
{
    tl_status st = TL_OK;
    *expression = NULL;
    parser p = {.ctx = ctx};
    if (strlen(text) > TEXT_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "an expression of %zu bytes, expected at most %d",
                       strlen(text), TEXT_MAX);
    p.out = tl_mem_zalloc(ctx, 1, sizeof *p.out, &st);
    if (st) return st;
    p.out->text = tli_strdup(ctx, text, &st);
    p.at = p.out->text;
    if (!st) {
        p.end = p.at + strlen(p.at);
        st = read_any(&p);
    }
    if (!st && p.at != p.end) st = fail_at(&p, p.at, "an operator or the end");
    if (st)
        tl_expression_destroy(ctx, p.out);
    else
        *expression = p.out;
    return st;
}

void tl_expression_destroy(tl_ctx *ctx, tl_expression *expression)
{
    if (!expression) return;
    for (size_t i = 0; i < expression->op_count; i++) tl_mem_free(ctx, expression->ops[i].name);
    tl_mem_free(ctx, expression->ops);
    tl_mem_free(ctx, expression->text);
    tl_mem_free(ctx, expression);
}
