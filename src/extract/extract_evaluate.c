/* Computes expressions. Names, places and components are settled first (settle): what gradients are
 * taken of is computed over the whole mesh and becomes a field like a channel. Then blocks of
 * elements go through the operations on all threads: values lie component after component, so that
 * the loops over a block are those of plain arrays. */
#include "extract/extract_expression.h"

#include <math.h>
#include <string.h>

#include "mesh/mesh.h"

enum { BLOCK = 256 }; /* elements */

/* An operation with what it works on settled. */
typedef struct step {
    tli_op_kind kind;
    size_t index;
    double number;
    const double *field;           /* of a channel, or computed: [elements][components] */
    uint32_t components;           /* of the result, */
    uint32_t first, second, third; /* and of the operands */
    size_t base;                   /* components on the stack below the first operand */
} step;

typedef struct job {
    tl_ctx *ctx;
    const tl_expression *expression;
    const tl_mesh *mesh;
    tl_on on;
    size_t elem_count;
    step *steps;
    size_t step_count;
    uint32_t *stack; /* [stack_count] steps whose results are not used yet, while settling */
    size_t stack_count;
    double **fields; /* [field_count] that were computed; owned */
    size_t field_count;
    size_t height;  /* components of the stack at its highest */
    size_t begin;   /* first step of what is computed */
    double *blocks; /* [threads][height][BLOCK] */
    double *out;    /* [elem_count][components] */
} job;

/* ---- one block ---- */

#define EACH(value)                                                                                \
    do {                                                                                           \
        for (size_t i = 0; i < n; i++) out[i] = (value);                                           \
    } while (0)

/* a may be out. */
static void by_one(tli_op_kind kind, const double *a, double *out, size_t n)
{
    switch (kind) {
    case TLI_OP_NEGATE: EACH(-a[i]); break;
    case TLI_OP_NOT: EACH(a[i] == 0); break;
    case TLI_OP_ABS: EACH(fabs(a[i])); break;
    case TLI_OP_SQRT: EACH(sqrt(a[i])); break;
    case TLI_OP_EXP: EACH(exp(a[i])); break;
    case TLI_OP_LOG: EACH(log(a[i])); break;
    case TLI_OP_LOG10: EACH(log10(a[i])); break;
    case TLI_OP_SIN: EACH(sin(a[i])); break;
    case TLI_OP_COS: EACH(cos(a[i])); break;
    case TLI_OP_TAN: EACH(tan(a[i])); break;
    default: break;
    }
}

/* out may be a or b. */
static void by_two(tli_op_kind kind, const double *a, const double *b, double *out, size_t n)
{
    switch (kind) {
    case TLI_OP_ADD: EACH(a[i] + b[i]); break;
    case TLI_OP_SUBTRACT: EACH(a[i] - b[i]); break;
    case TLI_OP_MULTIPLY: EACH(a[i] * b[i]); break;
    case TLI_OP_DIVIDE: EACH(a[i] / b[i]); break;
    case TLI_OP_POWER: EACH(b[i] == 2 ? a[i] * a[i] : pow(a[i], b[i])); break;
    case TLI_OP_ATAN2: EACH(atan2(a[i], b[i])); break;
    case TLI_OP_MIN: EACH(fmin(a[i], b[i])); break;
    case TLI_OP_MAX: EACH(fmax(a[i], b[i])); break;
    case TLI_OP_LESS: EACH(a[i] < b[i]); break;
    case TLI_OP_LESS_EQUAL: EACH(a[i] <= b[i]); break;
    case TLI_OP_GREATER: EACH(a[i] > b[i]); break;
    case TLI_OP_GREATER_EQUAL: EACH(a[i] >= b[i]); break;
    case TLI_OP_EQUAL: EACH(a[i] == b[i]); break;
    case TLI_OP_NOT_EQUAL: EACH(a[i] != b[i]); break;
    case TLI_OP_AND: EACH(a[i] != 0 && b[i] != 0); break;
    case TLI_OP_OR: EACH(a[i] != 0 || b[i] != 0); break;
    default: break;
    }
}

/* A scalar at a is kept aside, since the first component of the result takes its place. */
static void by_component(const step *s, double *a, size_t n)
{
    double kept[BLOCK];
    const double *b = a + (size_t)s->first * BLOCK;
    if (s->first == 1 && s->components > 1) memcpy(kept, a, n * sizeof *kept);
    for (size_t k = 0; k < s->components; k++)
        by_two(s->kind,
               s->first > 1        ? a + k * BLOCK
               : s->components > 1 ? kept
                                   : a,
               s->second > 1 ? b + k * BLOCK : b, a + k * BLOCK, n);
}

static void choose(const step *s, double *a, size_t n)
{
    double condition[BLOCK], then[BLOCK];
    const double *second = a + BLOCK, *third = second + (size_t)s->second * BLOCK;
    memcpy(condition, a, n * sizeof *condition);
    for (size_t k = 0; k < s->components; k++) {
        const double *b = third + (s->third > 1 ? k * BLOCK : 0);
        double *out = a + k * BLOCK;
        if (k == 0 || s->second > 1)
            memcpy(then, second + (s->second > 1 ? k * BLOCK : 0), n * sizeof *then);
        EACH(condition[i] != 0 ? then[i] : b[i]);
    }
}

/* Sums of products into the first component of a. */
static void dot(double *a, const double *b, size_t components, size_t n)
{
    double sum[BLOCK] = {0};
    for (size_t k = 0; k < components; k++)
        for (size_t i = 0; i < n; i++) sum[i] += a[k * BLOCK + i] * b[k * BLOCK + i];
    memcpy(a, sum, n * sizeof *sum);
}

static void cross(double *a, size_t n)
{
    const double *b = a + 3 * BLOCK;
    for (size_t i = 0; i < n; i++) {
        double x = a[BLOCK + i] * b[2 * BLOCK + i] - a[2 * BLOCK + i] * b[BLOCK + i];
        double y = a[2 * BLOCK + i] * b[i] - a[i] * b[2 * BLOCK + i];
        double z = a[i] * b[BLOCK + i] - a[BLOCK + i] * b[i];
        a[i] = x;
        a[BLOCK + i] = y;
        a[2 * BLOCK + i] = z;
    }
}

static void normalize(double *a, size_t components, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (size_t k = 0; k < components; k++) sum += a[k * BLOCK + i] * a[k * BLOCK + i];
        for (size_t k = 0; k < components && sum != 0; k++) a[k * BLOCK + i] /= sqrt(sum);
    }
}

static void load_field(const step *s, size_t first, double *out, size_t n)
{
    for (size_t k = 0; k < s->components; k++)
        for (size_t i = 0; i < n; i++)
            out[k * BLOCK + i] = s->field[(first + i) * s->components + k];
}

static void load_place(const job *j, size_t axis, size_t first, double *out, size_t n)
{
    const double *xyz = j->mesh->xyz;
    for (size_t i = 0; i < n; i++) {
        if (j->on == TL_ON_VERTEX) {
            out[i] = xyz[3 * (first + i) + axis];
            continue;
        }
        const tl_lidx *q = j->mesh->tets + 4 * (first + i);
        double sum = 0;
        for (int c = 0; c < 4; c++) sum += xyz[3 * (size_t)q[c] + axis];
        out[i] = sum / 4;
    }
}

static void take_step(const job *j, const step *s, size_t first, double *stack, size_t n)
{
    double *out = stack + s->base * BLOCK;
    switch (s->kind) {
    case TLI_OP_NUMBER: EACH(s->number); break;
    case TLI_OP_CHANNEL: load_field(s, first, out, n); break;
    case TLI_OP_POSITION: load_place(j, s->index, first, out, n); break;
    case TLI_OP_IF: choose(s, out, n); break;
    case TLI_OP_VECTOR: break; /* its components lie where they belong */
    case TLI_OP_PICK: memmove(out, out + s->index * BLOCK, n * sizeof *out); break;
    case TLI_OP_MAGNITUDE:
        dot(out, out, s->first, n);
        EACH(sqrt(out[i]));
        break;
    case TLI_OP_NORMALIZE: normalize(out, s->first, n); break;
    case TLI_OP_DOT: dot(out, out + (size_t)s->first * BLOCK, s->first, n); break;
    case TLI_OP_CROSS: cross(out, n); break;
    case TLI_OP_DERIVE: break; /* settled before */
    default:
        if (s->second)
            by_component(s, out, n);
        else
            for (size_t k = 0; k < s->components; k++)
                by_one(s->kind, out + k * BLOCK, out + k * BLOCK, n);
    }
}

static tl_status compute_blocks(void *arg, size_t begin, size_t end, unsigned worker)
{
    const job *j = arg;
    size_t n = end - begin, components = j->steps[j->step_count - 1].components;
    double *stack = j->blocks + worker * j->height * BLOCK;
    const step *last = &j->steps[j->step_count - 1];
    for (const step *s = j->steps + j->begin; s <= last; s++) take_step(j, s, begin, stack, n);
    const double *result = stack + last->base * BLOCK;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < components; k++)
            j->out[(begin + i) * components + k] = result[k * BLOCK + i];
    return TL_OK;
}

/* Values of the steps from first on over all elements. Gives *values. */
static tl_status compute(job *j, size_t first, double **values)
{
    tl_status st = TL_OK;
    size_t components = j->steps[j->step_count - 1].components;
    j->begin = first;
    j->blocks = tl_mem_alloc(j->ctx, tl_ctx_thread_count(j->ctx) * j->height,
                             BLOCK * sizeof *j->blocks, &st);
    j->out = tl_mem_alloc(j->ctx, j->elem_count, components * sizeof *j->out, &st);
    if (!st) st = tli_parallel(j->ctx, j->elem_count, BLOCK, compute_blocks, j);
    tl_mem_free(j->ctx, j->blocks);
    if (st)
        tl_mem_free(j->ctx, j->out);
    else
        *values = j->out;
    return st;
}

/* ---- names, places, components ---- */

static const tl_channel *find_channel(const tl_mesh *mesh, const char *name, tl_on on)
{
    for (size_t c = 0; c < mesh->channel_count; c++)
        if (mesh->channels[c].on == on && strcmp(mesh->channels[c].name, name) == 0)
            return &mesh->channels[c];
    return NULL;
}

/* On vertices if all names are there, else on tets. */
static tl_status settle_place(job *j)
{
    const tl_expression *e = j->expression;
    const tli_op *missing = NULL, *missing_on_tets = NULL;
    for (size_t i = 0; i < e->op_count; i++) {
        const tli_op *op = &e->ops[i];
        if (op->kind != TLI_OP_CHANNEL) continue;
        bool on_verts = find_channel(j->mesh, op->name, TL_ON_VERTEX);
        bool on_tets = find_channel(j->mesh, op->name, TL_ON_TET);
        if (!on_verts && !on_tets)
            return tli_expression_fail(j->ctx, e, op->column, "there is no channel '%.100s'",
                                       op->name);
        if (!on_verts && !missing) missing = op;
        if (!on_tets && !missing_on_tets) missing_on_tets = op;
    }
    if (missing && missing_on_tets)
        return tli_expression_fail(j->ctx, e, missing->column,
                                   "'%.60s' stands on tets, '%.60s' on vertices", missing->name,
                                   missing_on_tets->name);
    j->on = missing ? TL_ON_TET : TL_ON_VERTEX;
    j->elem_count = missing ? j->mesh->tet_count : j->mesh->vert_count;
    return TL_OK;
}

/* Steps whose results an operation takes. */
static size_t operand_count(const tli_op *op)
{
    if (op->kind == TLI_OP_VECTOR) return op->index;
    if (op->kind <= TLI_OP_POSITION) return 0;
    if (op->kind >= TLI_OP_ADD && op->kind <= TLI_OP_OR) return 2;
    if (op->kind == TLI_OP_IF) return 3;
    return op->kind == TLI_OP_DOT || op->kind == TLI_OP_CROSS ? 2 : 1;
}

/* Components that an operation by component makes of some and others; 0 if they don't fit. */
static uint32_t joint_components(uint32_t a, uint32_t b)
{
    if (a == b || b == 1) return a;
    return a == 1 ? b : 0;
}

static tl_status settle_components(job *j, const tli_op *op, step *s)
{
    const char *fail = NULL;
    switch (op->kind) {
    case TLI_OP_NUMBER:
    case TLI_OP_POSITION: s->components = 1; break;
    case TLI_OP_CHANNEL: break;
    case TLI_OP_IF:
        if (s->first != 1) fail = "the condition of if() is no scalar";
        s->components = joint_components(s->second, s->third);
        break;
    case TLI_OP_VECTOR: s->components = (uint32_t)op->index; break;
    case TLI_OP_PICK:
        if (op->index >= s->first)
            return tli_expression_fail(j->ctx, j->expression, op->column,
                                       "component %zu of %u, counted from 0", op->index, s->first);
        s->components = 1;
        break;
    case TLI_OP_MAGNITUDE: s->components = 1; break;
    case TLI_OP_DOT:
        if (s->first != s->second) fail = "dot() takes vectors of equally many components";
        s->components = 1;
        break;
    case TLI_OP_CROSS:
        if (s->first != 3 || s->second != 3) fail = "cross() takes vectors of 3 components";
        s->components = 3;
        break;
    case TLI_OP_DERIVE:
        s->components = tl_derived_components((tl_derived)op->index, s->first);
        if (j->on == TL_ON_TET) fail = "gradients are taken on vertices, not on tets";
        break;
    default: s->components = s->second ? joint_components(s->first, s->second) : s->first;
    }
    if (!fail && s->components) return TL_OK;
    if (fail) return tli_expression_fail(j->ctx, j->expression, op->column, "%s", fail);
    if (op->kind == TLI_OP_DERIVE)
        return tli_expression_fail(j->ctx, j->expression, op->column,
                                   "takes a vector of 3 components, not of %u", s->first);
    return tli_expression_fail(
        j->ctx, j->expression, op->column, "%u and %u components don't fit each other",
        op->kind == TLI_OP_IF ? s->second : s->first, op->kind == TLI_OP_IF ? s->third : s->second);
}

/* A derived field in the place of the steps that compute what it is derived of: the last one and
 * those before it, from first on. */
static tl_status settle_derived(job *j, const tli_op *op, size_t first, const step *s)
{
    double *values = NULL;
    tl_status st = compute(j, first, &values);
    double *out = tl_mem_alloc(j->ctx, j->elem_count, s->components * sizeof *out, &st);
    tl_channel of = {op->name, "", s->first, TL_ON_VERTEX, TL_F64, values};
    if (!st) st = tl_derive(j->ctx, j->mesh, &of, (tl_derived)op->index, out);
    tl_mem_free(j->ctx, values);
    j->fields = tl_mem_resize(j->ctx, j->fields, j->field_count + 1, sizeof *j->fields, &st);
    if (st) {
        tl_mem_free(j->ctx, out);
        return st;
    }
    j->fields[j->field_count++] = out;
    j->step_count = first;
    j->steps[j->step_count++] =
        (step){.kind = TLI_OP_CHANNEL, .field = out, .components = s->components, .base = s->base};
    return TL_OK;
}

/* First step of the last result on the stack: behind the result below it. */
static size_t first_step(const job *j)
{
    return j->stack_count > 1 ? j->stack[j->stack_count - 2] + (size_t)1 : 0;
}

static tl_status settle_op(job *j, const tli_op *op)
{
    step s = {.kind = op->kind, .index = op->index, .number = op->number};
    size_t operands = operand_count(op);
    TL_ASSERT(operands <= j->stack_count);
    uint32_t *taken = j->stack + j->stack_count - operands,
             *parts[] = {&s.first, &s.second, &s.third};
    for (size_t i = 0; i < operands; i++) {
        uint32_t components = j->steps[taken[i]].components;
        if (op->kind == TLI_OP_VECTOR && components != 1)
            return tli_expression_fail(j->ctx, j->expression, op->column,
                                       "vec() takes scalars, not %u components", components);
        if (op->kind != TLI_OP_VECTOR) *parts[i] = components;
    }
    if (op->kind == TLI_OP_CHANNEL) {
        const tl_channel *channel = find_channel(j->mesh, op->name, j->on);
        s.field = channel->values;
        s.components = channel->components;
    }
    tl_status st = settle_components(j, op, &s);
    if (st) return st;
    const step *below = j->stack_count > operands ? &j->steps[taken[-1]] : NULL;
    s.base = below ? below->base + below->components : 0;
    if (op->kind == TLI_OP_DERIVE) {
        st = settle_derived(j, op, first_step(j), &s);
    } else {
        j->steps[j->step_count++] = s;
    }
    if (s.base + s.components > j->height) j->height = s.base + s.components;
    j->stack_count -= operands;
    j->stack[j->stack_count++] = (uint32_t)(j->step_count - 1);
    return st;
}

static tl_status settle(job *j)
{
    tl_status st = settle_place(j);
    j->steps = tl_mem_alloc(j->ctx, j->expression->op_count, sizeof *j->steps, &st);
    j->stack = tl_mem_alloc(j->ctx, j->expression->op_count, sizeof *j->stack, &st);
    for (size_t i = 0; !st && i < j->expression->op_count; i++)
        st = settle_op(j, &j->expression->ops[i]);
    return st;
}

/* ---- asking ---- */

tl_status tl_expression_evaluate(tl_ctx *ctx, const tl_expression *expression, const tl_mesh *mesh,
                                 tl_channel *channel)
{
    double *values = NULL;
    job j = {.ctx = ctx, .expression = expression, .mesh = mesh};
    *channel = (tl_channel){.scalar = TL_F64};
    tl_status st = settle(&j);
    if (!st) st = compute(&j, 0, &values);
    if (!st)
        *channel = (tl_channel){.unit = "",
                                .components = j.steps[j.step_count - 1].components,
                                .on = j.on,
                                .scalar = TL_F64,
                                .values = values};
    for (size_t i = 0; i < j.field_count; i++) tl_mem_free(ctx, j.fields[i]);
    tl_mem_free(ctx, j.fields);
    tl_mem_free(ctx, j.stack);
    tl_mem_free(ctx, j.steps);
    return st;
}

tl_status tl_mesh_derive(tl_ctx *ctx, tl_mesh *mesh, const char *name, const char *text)
{
    tl_expression *expression = NULL;
    tl_channel channel = {.values = NULL};
    if (tl_mesh_channel_by_name(mesh, name))
        return tl_fail(ctx, TL_ERR_ARG, "there is a channel '%s' already", name);
    tl_status st = tl_expression_parse(ctx, text, &expression);
    if (!st) st = tl_expression_evaluate(ctx, expression, mesh, &channel);
    channel.name = name;
    if (!st) st = tl_mesh_adopt_channel(mesh, &channel);
    if (st) tli_free_const(ctx, channel.values);
    tl_expression_destroy(ctx, expression);
    return st;
}
