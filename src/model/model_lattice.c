/* Where the vertices of the finest level may lie: a lattice over the whole data set, of which each
 * vertex has a step, a power of two. Steps are as large as the bound on places allows, and finer
 * where a tet would turn or go flat. A segment is looked at again while vertices of it change. */
#include <math.h>

#include "base/base_predicates.h"
#include "base/base_sort.h"
#include "model/model_finest.h"

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

int16_t tli_finest_step(const tli_finest *f, uint64_t id)
{
    if (f->as_is) return f->model->plan->float32_places ? TLI_STEP_FLOAT32 : TLI_STEP_ANY;
    int step = f->largest - f->finer[id];
    return (int16_t)(step > f->unit ? step : f->unit);
}

void tli_finest_snap(const tli_finest *f, const tl_segment *s, double *xyz)
{
    for (size_t v = 0; v < s->vert_count; v++) {
        int step = tli_finest_step(f, s->vert_ids[v]);
        for (size_t i = 3 * v; i < 3 * v + 3; i++)
            xyz[i] = f->as_is ? s->xyz[i] : ldexp(rint(ldexp(s->xyz[i], -step)), step);
    }
}

/* ---- steps ---- */

static int sign_of(const double *xyz, const uint16_t *q)
{
    return tli_orient3d(xyz + 3 * (size_t)q[0], xyz + 3 * (size_t)q[1], xyz + 3 * (size_t)q[2],
                        xyz + 3 * (size_t)q[3]);
}

typedef struct agree_job {
    tli_finest *finest;
    const uint32_t *list; /* segments to look at */
    uint8_t *broken;      /* [segments] some tet turns */
} agree_job;

static bool check_tets(tli_finest *f, const tl_segment *s, const double *xyz)
{
    bool broken = false;
    for (size_t t = 0; t < s->tet_count; t++) {
        const uint16_t *q = s->tets + 4 * t;
        int after = sign_of(xyz, q);
        if (after > 0) continue;
        int before = sign_of(s->xyz, q);
        if (before == after || (before < 0 && after <= 0)) continue;
        /* several threads may want the same of a vertex that they share */
        for (int i = 0; i < 4; i++)
            __atomic_store_n(&f->wanted[s->vert_ids[q[i]]], 1, __ATOMIC_RELAXED);
        broken = true;
    }
    return broken;
}

static tl_status check_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    agree_job *j = arg;
    tl_ctx *ctx = NULL, *root = j->finest->model->ctx;
    tl_status st = tli_ctx_fork(root, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_segment s;
        st = tl_segments_load(ctx, j->finest->segments, j->list[i], &s);
        if (st) break;
        double *xyz = tl_mem_alloc(ctx, s.vert_count, 3 * sizeof *xyz, &st);
        if (!st) {
            tli_finest_snap(j->finest, &s, xyz);
            j->broken[j->list[i]] = check_tets(j->finest, &s, xyz);
        }
        tl_mem_free(ctx, xyz);
        tl_segment_release(ctx, &s);
    }
    return tli_ctx_join(root, ctx, st);
}

/* Segments that hold vertices of broken tets: those themselves and their neighbours. Returns their
 * number; list [segments] receives them. */
static size_t list_again(const tli_finest *f, const uint8_t *broken, uint8_t *again, uint32_t *list)
{
    size_t count = tl_segments_count(f->segments), n = 0;
    memset(again, 0, count);
    for (uint32_t s = 0; s < count; s++) {
        if (!broken[s]) continue;
        again[s] = 1;
        tl_segment_summary summary = tl_segments_info(f->segments, s);
        for (uint32_t i = 0; i < summary.neighbour_count; i++) again[summary.neighbours[i]] = 1;
    }
    for (uint32_t s = 0; s < count; s++)
        if (again[s]) list[n++] = s;
    return n;
}

/* Makes wanted steps finer; false where the unit is too coarse. */
static bool refine(tli_finest *f)
{
    uint64_t end = tl_segments_id_end(f->segments);
    for (uint64_t v = 0; v < end; v++) {
        if (!f->wanted[v]) continue;
        f->wanted[v] = 0;
        if (f->largest - f->finer[v] <= f->unit - FINER) return false;
        f->finer[v] = (uint8_t)(f->finer[v] + FINER);
    }
    return true;
}

static tl_status agree_on_steps(tli_finest *f, tli_plan *plan)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = f->model->ctx;
    size_t count = tl_segments_count(f->segments), left = count;
    uint32_t *list = tl_mem_alloc(ctx, count, sizeof *list, &st);
    uint8_t *broken = tl_mem_zalloc(ctx, count, 1, &st), *again = tl_mem_alloc(ctx, count, 1, &st);
    agree_job job = {f, list, broken};
    for (uint32_t s = 0; !st && s < count; s++) list[s] = s;
    while (!st && left) {
        st = tli_parallel(ctx, left, 1, check_range, &job);
        if (!st) left = list_again(f, broken, again, list);
        if (!st && left && !refine(f)) {
            keep_places(f, plan); /* thinner than the lattice can tell */
            break;
        }
        memset(broken, 0, count);
    }
    tl_mem_free(ctx, again);
    tl_mem_free(ctx, broken);
    tl_mem_free(ctx, list);
    return st;
}

/* ---- twins ---- */

static uint64_t hash_place(const double x[3])
{
    uint64_t h = 0, bits;
    for (int k = 0; k < 3; k++) {
        double positive = x[k] + 0.0; /* no -0 */
        memcpy(&bits, &positive, sizeof bits);
        h = (h ^ bits) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
    }
    return h;
}

static bool same_place(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Vertices of one place have one home: numbers from 1 on for those that are not alone. */
static tl_status number_twins(tl_ctx *ctx, tli_finest *f, const tl_segment *s, const double *xyz)
{
    tl_status st = TL_OK;
    size_t n = s->vert_count;
    uint64_t *keys = tl_mem_alloc(ctx, n, sizeof *keys, &st);
    uint32_t *verts = tl_mem_alloc(ctx, n, sizeof *verts, &st);
    for (size_t v = 0; !st && v < n; v++) {
        keys[v] = hash_place(xyz + 3 * v);
        verts[v] = (uint32_t)v;
    }
    if (!st) st = tli_sort_u64(ctx, keys, verts, n);
    for (size_t i = 0, end; !st && i < n; i = end) {
        for (end = i + 1; end < n && keys[end] == keys[i]; end++) {
        }
        for (size_t a = i; a < end && end - i > 1; a++) {
            unsigned same = 0, before = 0;
            const double *x = xyz + 3 * (size_t)verts[a];
            if (s->links[verts[a]] & TL_LINK_COPY) continue;
            for (size_t b = i; b < end; b++)
                if (same_place(x, xyz + 3 * (size_t)verts[b])) {
                    same++;
                    before += s->vert_ids[verts[b]] < s->vert_ids[verts[a]];
                }
            if (same < 2) continue;
            if (before + 1 > UINT8_MAX)
                st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "more than %d vertices at one place",
                             UINT8_MAX);
            f->twins[s->vert_ids[verts[a]]] = (uint8_t)(before + 1);
        }
    }
    tl_mem_free(ctx, verts);
    tl_mem_free(ctx, keys);
    return st;
}

static tl_status twin_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    tli_finest *f = arg;
    tl_ctx *ctx = NULL, *root = f->model->ctx;
    tl_status st = tli_ctx_fork(root, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        tl_segment s;
        st = tl_segments_load(ctx, f->segments, (uint32_t)i, &s);
        if (st) break;
        double *xyz = tl_mem_alloc(ctx, s.vert_count, 3 * sizeof *xyz, &st);
        if (!st) tli_finest_snap(f, &s, xyz);
        if (!st) st = number_twins(ctx, f, &s, xyz);
        tl_mem_free(ctx, xyz);
        tl_segment_release(ctx, &s);
    }
    return tli_ctx_join(root, ctx, st);
}

tl_status tli_finest_agree(tli_finest *f, tli_plan *plan)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = f->model->ctx;
    uint64_t end = tl_segments_id_end(f->segments);
    if (plan->opts.lossless) {
        keep_places(f, plan);
    } else {
        choose_steps(plan, &f->unit, &f->largest);
        set_lattice(plan, f->unit, f->largest);
        f->finer = tl_mem_zalloc(ctx, (size_t)end, 1, &st);
        f->wanted = tl_mem_zalloc(ctx, (size_t)end, 1, &st);
        if (!st) st = agree_on_steps(f, plan);
        tl_mem_free(ctx, f->wanted);
        f->wanted = NULL;
    }
    f->twins = tl_mem_zalloc(ctx, (size_t)end, 1, &st);
    if (!st) st = tli_parallel(ctx, tl_segments_count(f->segments), 1, twin_range, f);
    return st;
}

void tli_finest_release(tli_finest *f)
{
    tl_mem_free(f->model->ctx, f->twins);
    tl_mem_free(f->model->ctx, f->wanted);
    tl_mem_free(f->model->ctx, f->finer);
}
