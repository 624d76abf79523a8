/* Builds and releases the working mesh of a simplification. */
#include "simplify/simplify_work.h"

#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "simplify/simplify_carry.h"
#include "simplify/simplify_cost.h"
#include "simplify/simplify_quadric.h"

/* Surface moves below this part of the largest coordinate are rounding. */
static const double ROUNDING = 4e-15;
/* Default bound on the distance of surfaces, in diagonals. */
static const double BOUNDARY_ERROR = 1e-3;

/* Copies places and values in Hilbert order; rank [vert_count] receives the new index. */
typedef struct copy_job {
    tli_work *work;
    const tl_mesh *mesh;
    const tl_lidx *order;
    tl_lidx *rank;
    const tl_simplify_opts *opts;
    const double *channel_scales;
    const tli_piece *piece;
} copy_job;

static tl_status copy_vertices(void *arg, size_t begin, size_t end, unsigned worker)
{
    copy_job *job = arg;
    tli_work *w = job->work;
    const double *xyz = tl_mesh_xyz(job->mesh);
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        size_t o = job->order[v];
        double *to = w->values + v * w->components;
        memcpy(w->verts[v].xyz, xyz + 3 * o, sizeof w->verts[v].xyz);
        w->verts[v].merged = job->rank[o] = (tl_lidx)v;
        w->verts[v].origin = (tl_lidx)o;
        w->verts[v].step = job->piece && job->piece->steps ? job->piece->steps[o] : TLI_STEP_ANY;
        if (job->piece && job->piece->surface_bounds)
            w->verts[v].surface_bound = job->piece->surface_bounds[o];
        for (size_t i = 0; i < job->opts->channel_count; i++) {
            const tl_channel *c = tl_mesh_channel_by_name(job->mesh, job->opts->channels[i].name);
            for (uint32_t j = 0; j < c->components; j++)
                *to++ = c->values[o * c->components + j] * job->channel_scales[i];
        }
    }
    return TL_OK;
}

typedef struct tet_job {
    tli_work *work;
    const tl_mesh *mesh;
    const tl_lidx *rank;
    uint32_t *keys, *order;
} tet_job;

static tl_status key_tets(void *arg, size_t begin, size_t end, unsigned worker)
{
    tet_job *job = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = tl_mesh_tets(job->mesh) + 4 * t;
        tl_lidx least = job->rank[q[0]];
        for (int j = 1; j < 4; j++)
            if (job->rank[q[j]] < least) least = job->rank[q[j]];
        job->keys[t] = least;
        job->order[t] = (uint32_t)t;
    }
    return TL_OK;
}

static tl_status copy_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    tet_job *job = arg;
    tli_work *w = job->work;
    const int32_t *regions = tl_mesh_regions(job->mesh);
    (void)worker;
    for (size_t to = begin; to < end; to++) {
        size_t t = job->order[to];
        const tl_lidx *q = tl_mesh_tets(job->mesh) + 4 * t;
        for (int j = 0; j < 4; j++) w->tets[to][j] = job->rank[q[j]];
        if (w->tet_origin) w->tet_origin[to] = (tl_lidx)t;
        if (regions) w->regions[to] = regions[t];
    }
    return TL_OK;
}

/* Tets with new vertex numbers, ordered by their smallest vertex. */
static tl_status copy_tets(tli_work *w, const tl_mesh *mesh, const tl_lidx *rank)
{
    tl_status st = TL_OK;
    tet_job job = {w, mesh, rank, NULL, NULL};
    job.keys = tl_mem_alloc(w->ctx, w->tet_count, sizeof *job.keys, &st);
    job.order = tl_mem_alloc(w->ctx, w->tet_count, sizeof *job.order, &st);
    if (!st) st = tli_parallel(w->ctx, w->tet_count, 16384, key_tets, &job);
    if (!st) st = tli_sort_u32(w->ctx, job.keys, job.order, w->tet_count);
    if (!st) st = tli_parallel(w->ctx, w->tet_count, 8192, copy_range, &job);
    tl_mem_free(w->ctx, job.order);
    tl_mem_free(w->ctx, job.keys);
    return st;
}

static tl_status set_stars(tli_work *w)
{
    tl_lidx *offsets = NULL;
    tl_status st =
        tl_tets_incidence(w->ctx, w->tets[0], w->tet_count, w->vert_count, &offsets, &w->incidence);
    for (size_t v = 0; !st && v < w->vert_count; v++) {
        w->verts[v].star.tets = w->incidence + offsets[v];
        w->verts[v].star.count = w->verts[v].star.capacity = offsets[v + 1] - offsets[v];
        if (offsets[v + 1] == offsets[v] && w->verts[v].merged == v) w->verts[v].merged = TL_NONE;
    }
    tl_mem_free(w->ctx, offsets);
    return st;
}

tl_status tli_work_compact(tli_work *w)
{
    tl_status st = TL_OK;
    size_t n = 0;
    for (size_t t = 0; t < w->tet_count; t++) {
        if (w->tets[t][0] == TL_NONE) continue;
        memcpy(w->tets[n], w->tets[t], sizeof *w->tets);
        w->faces[n] = w->faces[t];
        if (w->regions) w->regions[n] = w->regions[t];
        if (w->tet_origin) w->tet_origin[n] = w->tet_origin[t];
        n++;
    }
    w->tet_count = n;
    w->tets = tl_mem_resize(w->ctx, w->tets, n, sizeof *w->tets, &st);
    w->faces = tl_mem_resize(w->ctx, w->faces, n, sizeof *w->faces, &st);
    if (w->regions) w->regions = tl_mem_resize(w->ctx, w->regions, n, sizeof *w->regions, &st);
    if (w->tet_origin)
        w->tet_origin = tl_mem_resize(w->ctx, w->tet_origin, n, sizeof *w->tet_origin, &st);
    for (unsigned i = 0; i < w->bank_count; i++) {
        tli_arena_close(&w->banks[i].arena);
        w->banks[i] = (tli_star_bank){0};
        tli_arena_open(w->ctx, &w->banks[i].arena);
    }
    tl_mem_free(w->ctx, w->incidence);
    w->incidence = NULL;
    return st ? st : set_stars(w);
}

bool tli_has_tet_channels(const tl_mesh *mesh)
{
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++)
        if (tl_mesh_channel(mesh, i)->on == TL_ON_TET) return true;
    return false;
}

/* Scale, rounding and boundary error from the bounding box of the vertices in use. */
static void set_size(tli_work *w, const tl_simplify_opts *opts)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    double largest = 0, square = 0;
    for (size_t v = 0; v < w->vert_count; v++)
        for (int j = 0; w->verts[v].star.count && j < 3; j++) {
            double x = w->verts[v].xyz[j];
            if (!isfinite(x)) continue;
            if (x < lo[j]) lo[j] = x;
            if (x > hi[j]) hi[j] = x;
            if (fabs(x) > largest) largest = fabs(x);
        }
    for (int j = 0; j < 3; j++) {
        if (hi[j] > lo[j]) square += (hi[j] - lo[j]) * (hi[j] - lo[j]);
        w->centre[j] = hi[j] >= lo[j] ? lo[j] + (hi[j] - lo[j]) / 2 : 0;
    }
    double diagonal = sqrt(square);
    w->scale = diagonal > 0 ? 1 / diagonal : 1;
    w->rounding = ROUNDING * (largest + diagonal);
    w->boundary_error = opts->boundary_error < 0 ? BOUNDARY_ERROR * diagonal : opts->boundary_error;
}

static void alloc_arrays(tli_work *w, bool with_regions, bool with_origins, tl_status *st)
{
    tl_ctx *ctx = w->ctx;
    size_t n = w->vert_count, m = w->tet_count;
    w->tets = tl_mem_alloc(ctx, m, sizeof *w->tets, st);
    w->faces = tl_mem_zalloc(ctx, m, sizeof *w->faces, st);
    if (with_origins) w->tet_origin = tl_mem_alloc(ctx, m, sizeof *w->tet_origin, st);
    if (with_regions) w->regions = tl_mem_alloc(ctx, m, sizeof *w->regions, st);
    w->verts = tl_mem_zalloc(ctx, n, sizeof *w->verts, st);
    w->marks = tl_mem_zalloc(ctx, n, sizeof *w->marks, st);
    w->values = tl_mem_alloc(ctx, n * w->components, sizeof *w->values, st);
    w->banks = tl_mem_zalloc(ctx, w->bank_count, sizeof *w->banks, st);
    for (unsigned i = 0; !*st && i < w->bank_count; i++) tli_arena_open(ctx, &w->banks[i].arena);
}

static tl_status fill(tli_work *w, const tl_mesh *mesh, const tl_simplify_opts *opts,
                      const double *channel_scales, size_t thin_target, const tli_piece *piece)
{
    tl_status st = TL_OK;
    uint8_t *inner = NULL;
    bool known = piece && piece->quadrics;
    tl_lidx *rank = tl_mem_alloc(w->ctx, w->vert_count, sizeof *rank, &st), *opposite = NULL;
    size_t nonmanifold = 0;
    tl_lidx *order = tl_mem_alloc(w->ctx, w->vert_count, sizeof *order, &st);
    if (!st) st = tli_sort_hilbert(w->ctx, tl_mesh_xyz(mesh), w->vert_count, order);
    copy_job job = {w, mesh, order, rank, opts, channel_scales, piece};
    if (!st) st = tli_parallel(w->ctx, w->vert_count, 4096, copy_vertices, &job);
    tl_mem_free(w->ctx, order);
    if (!st) st = copy_tets(w, mesh, rank);
    tl_mem_free(w->ctx, rank);
    if (!st) st = set_stars(w);
    for (size_t v = 0; !st && v < w->vert_count; v++) w->verts_live += w->verts[v].star.count > 0;
    if (!st) set_size(w, opts);
    if (piece) w->scale = piece->scale;
    w->quadrics = tl_mem_alloc(w->ctx, w->vert_count * w->quadric_floats, sizeof *w->quadrics, &st);
    if (thin_target != SIZE_MAX) inner = tl_mem_alloc(w->ctx, w->vert_count, 1, &st);
    if (!st && known)
        tli_work_take_quadrics(w, piece->quadrics);
    else if (!st)
        st = tli_work_set_quadrics(w, inner);
    for (size_t v = 0; !st && inner && opts->locked && v < w->vert_count; v++)
        if (opts->locked[w->verts[v].origin]) inner[v] = 0;
    if (!st && inner) st = tli_work_thin(w, inner, thin_target);
    tl_mem_free(w->ctx, inner);
    if (!st)
        st = tl_tets_adjacency(w->ctx, w->tets[0], w->tet_count, w->vert_count, &opposite,
                               &nonmanifold);
    if (!st) st = tli_work_find_surfaces(w, opposite, nonmanifold, opts->locked, piece != NULL);
    tl_mem_free(w->ctx, opposite);
    if (!st) tli_work_add_surface_quadrics(w, known);
    if (!st && piece && piece->shares) tli_work_share_quadrics(w, piece->shares);
    return st;
}

/* A piece is not thinned, so that thinning never meets quadrics that came in. */
static tl_status create(tl_ctx *ctx, const tl_mesh *mesh, const tl_simplify_opts *opts,
                        const double *channel_scales, size_t thin_target, const tli_piece *piece,
                        tli_work **work)
{
    tl_status st = TL_OK;
    tli_work *w = tl_mem_zalloc(ctx, 1, sizeof *w, &st);
    *work = NULL;
    if (st) return st;
    w->ctx = ctx;
    w->vert_count = tl_mesh_vert_count(mesh);
    w->tet_count = w->input_tets = w->tets_live = tl_mesh_tet_count(mesh);
    w->bank_count = tl_ctx_thread_count(ctx);
    w->channel_count = opts->channel_count;
    w->channels = tl_mem_alloc(ctx, w->channel_count, sizeof *w->channels, &st);
    for (size_t i = 0; !st && i < opts->channel_count; i++) {
        w->channels[i].components =
            tl_mesh_channel_by_name(mesh, opts->channels[i].name)->components;
        w->channels[i].scale = channel_scales[i];
        w->components += w->channels[i].components;
    }
    w->quadric_floats = (tli_quadric_floats(w->components) + w->components + 15) / 16 * 16;
    w->volume_room = (double)INFINITY;
    w->shape_cube = opts->min_quality * opts->min_quality * opts->min_quality;
    w->shapes = tli_shapes_best();
    w->placement = opts->placement;
    w->listener = opts->listener;
    w->listener_user = opts->listener_user;
    alloc_arrays(w, tl_mesh_regions(mesh) != NULL, tli_has_tet_channels(mesh), &st);
    if (!st) st = fill(w, mesh, opts, channel_scales, thin_target, piece);
    if (st) {
        tli_work_destroy(w);
        return tl_note(ctx, st, "while preparing %zu tets for simplification",
                       tl_mesh_tet_count(mesh));
    }
    *work = w;
    return TL_OK;
}

tl_status tli_work_create(tl_ctx *ctx, const tl_mesh *mesh, const tl_simplify_opts *opts,
                          const double *channel_scales, size_t thin_target, tli_work **work)
{
    return create(ctx, mesh, opts, channel_scales, thin_target, NULL, work);
}

static double sum_volumes(const tli_work *w)
{
    double sum = 0, p[4][3];
    for (size_t t = 0; t < w->tet_count; t++) {
        for (int i = 0; i < 4; i++) memcpy(p[i], w->verts[w->tets[t][i]].xyz, sizeof p[i]);
        double volume = fabs(tl_tet_volume((const double(*)[3])p));
        if (isfinite(volume)) sum += volume;
    }
    return sum;
}

tl_status tli_work_create_piece(tl_ctx *ctx, const tli_piece *piece, tli_work **work)
{
    tl_status st =
        create(ctx, piece->mesh, piece->opts, piece->channel_scales, SIZE_MAX, piece, work);
    if (!st && isfinite(piece->volume_part))
        (*work)->volume_room = piece->volume_part * sum_volumes(*work);
    return st;
}

void tli_work_drop_tets(tli_work *w)
{
    tl_ctx *ctx = w->ctx;
    tli_carry_destroy(ctx, w->carry);
    for (unsigned i = 0; w->banks && i < w->bank_count; i++)
        if (w->banks[i].arena.ctx) tli_arena_close(&w->banks[i].arena);
    void *blocks[] = {w->banks, w->marks,      w->values,   w->regions,  w->faces,
                      w->tets,  w->tet_origin, w->quadrics, w->incidence};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    w->carry = NULL;
    w->banks = NULL;
    w->marks = NULL;
    w->values = NULL;
    w->regions = NULL;
    w->faces = NULL;
    w->tets = NULL;
    w->tet_origin = NULL;
    w->quadrics = NULL;
    w->incidence = NULL;
}

void tli_work_destroy(tli_work *w)
{
    if (!w) return;
    tl_ctx *ctx = w->ctx;
    tli_work_drop_tets(w);
    void *blocks[] = {w->verts, w->surface, w->sharp, w->channels, w};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
}

size_t tli_work_list_live(const tli_work *w, tl_lidx *verts)
{
    size_t n = 0;
    for (size_t v = 0; v < w->vert_count; v++)
        if (w->verts[v].merged == v) verts[n++] = (tl_lidx)v;
    return n;
}

double tli_work_surface_bound(const tli_work *w)
{
    double largest = 0;
    for (size_t v = 0; v < w->vert_count; v++)
        if (w->verts[v].merged == v && (double)w->verts[v].surface_bound > largest)
            largest = (double)w->verts[v].surface_bound;
    return largest;
}
