/* Where the vertices of the finest level may lie: a lattice over the whole data set, of which each
 * vertex has a step, a power of two. Steps are as large as the bound on places allows, and finer
 * where a tet would turn or go flat, or a move would change a value by more than storing it may. A
 * segment is looked at again while vertices of it change; what it wants of a vertex all segments
 * that hold the vertex hear. */
#include <math.h>

#include "base/base_predicates.h"
#include "base/base_vec.h"
#include "model/model_finest.h"
#include "model/model_mail.h"
#include "model/model_turns.h"

enum {
    AXIS_BITS = 31,  /* of the places of a data set along an axis */
    PLACE_BITS = 51, /* of a place from 0 */
    FINER = 2        /* steps of broken tets shrink by 2^FINER at a time */
};

/* ---- the lattice ---- */

/* Exponents of the unit and of the largest step. */
static void choose_steps(const tli_plan *plan, int *unit, int *step)
{
    double largest = 0, from_zero = 0;
    for (int k = 0; k < 3; k++) {
        double lo = plan->bounds[2 * k], hi = plan->bounds[2 * k + 1];
        largest = fmax(largest, hi - lo);
        from_zero = fmax(from_zero, fmax(fabs(lo), fabs(hi)));
    }
    if (!(largest > 0)) largest = from_zero > 0 ? from_zero : 1;
    *unit = ilogb(largest) + 1 - AXIS_BITS;
    if (from_zero > 0 && ilogb(from_zero) + 1 - PLACE_BITS > *unit)
        *unit = ilogb(from_zero) + 1 - PLACE_BITS;
    double move = plan->opts.position_error * plan->diagonal;
    *step = move > 0 ? ilogb(2 * move / sqrt(3.0)) : *unit;
    if (*step < *unit) *step = *unit;
}

/* Half of the box's largest side is left around it for vertices that leave it. */
static void set_lattice(tli_plan *plan, int unit, int step)
{
    plan->lattice = (tl_lattice){.kind = TL_PLACE_LATTICE, .exponent = unit};
    plan->position_error = ldexp(sqrt(3.0) / 2, step);
    for (int k = 0; k < 3; k++)
        plan->lattice.origin[k] =
            (int64_t)floor(ldexp(plan->bounds[2 * k], -unit)) - ((int64_t)1 << (AXIS_BITS - 1));
}

static void keep_places(tli_finest *f, tli_plan *plan)
{
    f->as_is = true;
    plan->lattice =
        (tl_lattice){.kind = plan->float32_places ? TL_PLACE_FLOAT32 : TL_PLACE_FLOAT64};
    plan->position_error = 0;
}

/* ---- marks ---- */

tl_status tli_marks_open(tl_ctx *ctx, const tli_finest *f, tli_marks *marks)
{
    tl_status st = TL_OK;
    marks->has_any = tl_mem_zalloc(ctx, tl_segments_count(f->segments), 1, &st);
    return st ? st : tli_scratch_open(ctx, f->model->plan->opts.folder, &marks->file);
}

void tli_marks_close(tl_ctx *ctx, tli_marks *marks)
{
    tli_scratch_close(marks->file);
    tl_mem_free(ctx, marks->has_any);
    *marks = (tli_marks){0};
}

tl_status tli_marks_read(tl_ctx *ctx, const tli_finest *f, const tli_marks *marks,
                         const tl_segment *s, uint8_t *values)
{
    memset(values, 0, s->vert_count);
    if (!marks->has_any || !marks->has_any[s->id]) return TL_OK;
    return tli_scratch_read(ctx, marks->file, f->segments->entries[s->id].first_vert, values,
                            s->vert_count);
}

tl_status tli_marks_write(tl_ctx *ctx, const tli_finest *f, tli_marks *marks, const tl_segment *s,
                          const uint8_t *values)
{
    marks->has_any[s->id] = 1;
    return tli_scratch_write(ctx, marks->file, f->segments->entries[s->id].first_vert, values,
                             s->vert_count);
}

/* ---- places ---- */

/* The step of a vertex that is so much finer than the largest. */
static int16_t step_of(const tli_finest *f, uint8_t finer)
{
    int step = f->largest - finer;
    return (int16_t)(step > f->unit ? step : f->unit);
}

tl_status tli_finest_steps(tl_ctx *ctx, const tli_finest *f, const tl_segment *s, int16_t *steps)
{
    tl_status st = TL_OK;
    int16_t kept = f->model->plan->float32_places ? TLI_STEP_FLOAT32 : TLI_STEP_ANY;
    uint8_t *finer = tl_mem_alloc(ctx, s->vert_count, 1, &st);
    if (!st) st = tli_marks_read(ctx, f, &f->finer, s, finer);
    for (size_t v = 0; !st && v < s->vert_count; v++)
        steps[v] = f->as_is ? kept : step_of(f, finer[v]);
    tl_mem_free(ctx, finer);
    return st;
}

void tli_finest_snap(const tli_finest *f, const tl_segment *s, const int16_t *steps, double *xyz)
{
    for (size_t v = 0; v < s->vert_count; v++)
        for (size_t i = 3 * v; i < 3 * v + 3; i++)
            xyz[i] = f->as_is ? s->xyz[i] : ldexp(rint(ldexp(s->xyz[i], -steps[v])), steps[v]);
}

/* ---- steps ---- */

static int sign_of(const double *xyz, const uint16_t *q)
{
    return tli_orient3d(xyz + 3 * (size_t)q[0], xyz + 3 * (size_t)q[1], xyz + 3 * (size_t)q[2],
                        xyz + 3 * (size_t)q[3]);
}

typedef struct agree_job {
    tli_finest *finest;
    const uint32_t *list;  /* segments to look at */
    const tli_mail *heard; /* ids whose steps are to be finer, of the round before */
    tli_mail *said;        /* of this one */
    uint8_t *too_coarse;   /* [segments] the unit is */
} agree_job;

/* A segment while it is looked at. */
typedef struct look {
    tl_segment segment;
    uint8_t *finer, *wanted; /* [vert_count] */
    int16_t *steps;
    double *xyz;
    uint64_t *words; /* [vert_count] */
} look;

/* Makes finer what was wanted of its vertices. */
static tl_status listen(tl_ctx *ctx, const agree_job *j, look *l)
{
    tli_finest *f = j->finest;
    const tl_segment *s = &l->segment;
    uint64_t *ids = NULL;
    size_t count = 0;
    bool changed = false;
    tl_status st = tli_mail_gather(ctx, j->heard, s->id, &ids, &count);
    for (size_t v = 0; !st && v < s->vert_count; v++) {
        size_t lo = 0, hi = count;
        while (lo < hi) {
            size_t mid = lo + (hi - lo) / 2;
            if (ids[mid] < s->vert_ids[v])
                lo = mid + 1;
            else
                hi = mid;
        }
        if (lo == count || ids[lo] != s->vert_ids[v]) continue;
        j->too_coarse[s->id] |= f->largest - l->finer[v] <= f->unit - FINER;
        l->finer[v] = (uint8_t)(l->finer[v] + FINER);
        changed = true;
    }
    tl_mem_free(ctx, ids);
    return !st && changed ? tli_marks_write(ctx, f, &f->finer, s, l->finer) : st;
}

/* Marks the vertices of tets that turn: those of the largest step, so that vertices at one place
 * come to have one step. */
static void check_tets(const look *l)
{
    const tl_segment *s = &l->segment;
    for (size_t t = 0; t < s->tet_count; t++) {
        const uint16_t *q = s->tets + 4 * t;
        int after = sign_of(l->xyz, q), largest = INT16_MIN;
        if (after > 0) continue;
        int before = sign_of(s->xyz, q);
        if (before == after || (before < 0 && after <= 0)) continue;
        for (int i = 0; i < 4; i++)
            if (l->steps[q[i]] > largest) largest = l->steps[q[i]];
        for (int i = 0; i < 4; i++)
            if (l->steps[q[i]] == largest) l->wanted[q[i]] = 1;
    }
}

/* Where the originals of a tet's corners are in it: parts[i][j] of the change from corner 0 to
 * corner j + 1 lie between corner i and its original. False: no corner has moved, or the tet is
 * flat. */
static bool find_moves(const tl_segment *s, const double *xyz, const uint16_t *q,
                       double parts[4][3])
{
    double e[3][3], normal[3][3];
    const double *x0 = xyz + 3 * (size_t)q[0];
    bool has_moved = false;
    for (int i = 0; i < 3; i++) vec_sub(xyz + 3 * (size_t)q[i + 1], x0, e[i]);
    for (int i = 0; i < 3; i++) vec_cross(e[(i + 1) % 3], e[(i + 2) % 3], normal[i]);
    double six = vec_dot(e[0], normal[0]);
    for (int i = 0; i < 4; i++) {
        double move[3];
        vec_sub(s->xyz + 3 * (size_t)q[i], xyz + 3 * (size_t)q[i], move);
        has_moved |= move[0] != 0 || move[1] != 0 || move[2] != 0;
        for (int j = 0; j < 3; j++) parts[i][j] = vec_dot(normal[j], move) / six;
    }
    return has_moved && six > 0;
}

/* Marks the vertices whose moves change a value at their original places by more than is left for
 * them (set_code in model_plan.c), unless the lattice has no finer step. */
static void check_values(const agree_job *j, const look *l)
{
    const tli_plan *plan = j->finest->model->plan;
    const tl_segment *s = &l->segment;
    for (size_t t = 0; t < s->tet_count; t++) {
        const uint16_t *q = s->tets + 4 * t;
        double parts[4][3];
        if (!find_moves(s, l->xyz, q, parts)) continue;
        for (size_t i = 0; i < plan->field_count; i++) {
            const tli_field *f = &plan->fields[i];
            const double *from = s->values + f->source_first;
            double change[4] = {0};
            if (f->on != TL_ON_VERTEX) continue;
            for (size_t c = 0; c < f->components; c++) {
                const double first = from[plan->source_vert_comps * q[0] + c];
                double d[3];
                for (int k = 0; k < 3; k++)
                    d[k] = from[plan->source_vert_comps * q[k + 1] + c] - first;
                for (int k = 0; k < 4; k++) {
                    double by = parts[k][0] * d[0] + parts[k][1] * d[1] + parts[k][2] * d[2];
                    change[k] += by * by;
                }
            }
            for (int k = 0; k < 4; k++)
                if (change[k] > f->moved * f->moved && l->steps[q[k]] > j->finest->unit)
                    l->wanted[q[k]] = 1;
        }
    }
}

static tl_status look_at(tl_ctx *ctx, const agree_job *j, look *l)
{
    tl_status st = TL_OK;
    const tl_segment *s = &l->segment;
    size_t n = s->vert_count, count = 0;
    l->finer = tl_mem_alloc(ctx, n, 1, &st);
    l->wanted = tl_mem_zalloc(ctx, n, 1, &st);
    l->steps = tl_mem_alloc(ctx, n, sizeof *l->steps, &st);
    l->xyz = tl_mem_alloc(ctx, n, 3 * sizeof *l->xyz, &st);
    l->words = tl_mem_alloc(ctx, n, sizeof *l->words, &st);
    if (!st) st = tli_marks_read(ctx, j->finest, &j->finest->finer, s, l->finer);
    if (!st) st = listen(ctx, j, l);
    if (st) return st;
    bool is_even = true;
    for (size_t v = 0; v < n; v++) {
        l->steps[v] = step_of(j->finest, l->finer[v]);
        is_even &= l->finer[v] == 0;
    }
    tli_finest_snap(j->finest, s, l->steps, l->xyz);
    check_tets(l);
    check_values(j, l);
    if (!is_even) st = tli_finest_even_twins(ctx, s, l->steps, l->wanted);
    for (size_t v = 0; v < n; v++)
        if (l->wanted[v]) l->words[count++] = s->vert_ids[v];
    if (st || count == 0) return st;
    return tli_mail_put(ctx, j->said, s->id, l->words, count);
}

static tl_status look_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    agree_job *j = arg;
    tl_ctx *ctx = NULL, *root = j->finest->model->ctx;
    tl_status st = tli_ctx_fork(root, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        look l = {0};
        st = tl_segments_load(ctx, j->finest->segments, j->list[i], &l.segment);
        if (!st) st = look_at(ctx, j, &l);
        void *blocks[] = {l.words, l.xyz, l.steps, l.wanted, l.finer};
        for (size_t b = 0; b < sizeof blocks / sizeof *blocks; b++) tl_mem_free(ctx, blocks[b]);
        tl_segment_release(ctx, &l.segment);
    }
    return tli_ctx_join(root, ctx, st);
}

/* Rounds over the segments that changed, until none wants more; lists [segments]. */
static tl_status agree_rounds(tli_finest *f, tli_plan *plan, tli_mail mail[2], uint8_t *too_coarse,
                              uint8_t *marks, uint32_t *list)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = f->model->ctx;
    size_t count = tl_segments_count(f->segments), left = count;
    bool is_coarse = false;
    for (uint32_t s = 0; s < count; s++) list[s] = s;
    for (unsigned round = 0; !st && left && !is_coarse; round++) {
        tli_mail *said = &mail[round & 1];
        agree_job job = {f, list, &mail[(round + 1) & 1], said, too_coarse};
        tli_mail_clear(said);
        st = tli_turns(ctx, "lattice", left, plan->at_once, look_range, &job);
        left = tli_mail_list(said, marks, list);
        for (uint32_t s = 0; s < count; s++) is_coarse |= too_coarse[s];
    }
    if (!st && is_coarse) keep_places(f, plan); /* thinner than the lattice can tell */
    return st;
}

static tl_status agree_on_steps(tli_finest *f, tli_plan *plan)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = f->model->ctx;
    size_t count = tl_segments_count(f->segments);
    tli_mail mail[2] = {{0}, {0}};
    uint32_t *list = tl_mem_alloc(ctx, count, sizeof *list, &st);
    uint8_t *marks = tl_mem_alloc(ctx, count, 1, &st);
    uint8_t *too_coarse = tl_mem_zalloc(ctx, count, 1, &st);
    for (int i = 0; !st && i < 2; i++)
        st = tli_mail_open(ctx, plan->opts.folder, f->segments, &mail[i]);
    if (!st) st = tli_marks_open(ctx, f, &f->finer);
    if (!st) st = agree_rounds(f, plan, mail, too_coarse, marks, list);
    for (int i = 0; i < 2; i++) tli_mail_close(ctx, &mail[i]);
    tl_mem_free(ctx, too_coarse);
    tl_mem_free(ctx, marks);
    tl_mem_free(ctx, list);
    return st;
}

tl_status tli_finest_agree(tli_finest *f, tli_plan *plan)
{
    tl_status st = TL_OK;
    if (plan->opts.lossless || plan->opts.exact_places) {
        keep_places(f, plan);
    } else {
        choose_steps(plan, &f->unit, &f->largest);
        set_lattice(plan, f->unit, f->largest);
        st = agree_on_steps(f, plan);
    }
    return st ? st : tli_finest_number_twins(f);
}

void tli_finest_release(tli_finest *f)
{
    tli_stars_close(&f->stars);
    tli_marks_close(f->model->ctx, &f->twins);
    tli_marks_close(f->model->ctx, &f->finer);
}
