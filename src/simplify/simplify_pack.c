/* Turns what is left of the working mesh into a mesh of its own, with all channels, and tells for
 * every original vertex a tet near it. */
#include "simplify/simplify_pack.h"

#include <string.h>

#include "base/base_predicates.h"

/* Vertices or tets of a piece of work. */
enum { PIECE = 16384 };

/* Numbers what is left of vertices or tets, in the order of the working mesh. */
typedef struct number_job {
    const tli_work *work;
    bool tets;
    tl_lidx *numbers;
    tl_lidx *firsts; /* one a piece: counts, then the number of its first one */
} number_job;

static bool is_left(const number_job *job, size_t i)
{
    return job->tets ? job->work->tets[i][0] != TL_NONE : job->work->verts[i].merged == i;
}

static tl_status count_left(void *arg, size_t begin, size_t end, unsigned worker)
{
    number_job *job = arg;
    tl_lidx count = 0;
    (void)worker;
    for (size_t i = begin; i < end; i++) count += is_left(job, i);
    job->firsts[begin / PIECE] = count;
    return TL_OK;
}

static tl_status number_left(void *arg, size_t begin, size_t end, unsigned worker)
{
    number_job *job = arg;
    tl_lidx next = job->firsts[begin / PIECE];
    (void)worker;
    for (size_t i = begin; i < end; i++) job->numbers[i] = is_left(job, i) ? next++ : TL_NONE;
    return TL_OK;
}

static tl_status number(const tli_work *w, bool tets, tl_lidx **numbers, size_t *left)
{
    tl_status st = TL_OK;
    size_t count = tets ? w->tet_count : w->vert_count, pieces = (count + PIECE - 1) / PIECE;
    number_job job = {w, tets, NULL, NULL};
    *numbers = job.numbers = tl_mem_alloc(w->ctx, count, sizeof *job.numbers, &st);
    job.firsts = tl_mem_alloc(w->ctx, pieces, sizeof *job.firsts, &st);
    if (!st) st = tli_parallel(w->ctx, count, PIECE, count_left, &job);
    tl_lidx sum = 0;
    for (size_t i = 0; !st && i < pieces; i++) {
        tl_lidx some = job.firsts[i];
        job.firsts[i] = sum;
        sum += some;
    }
    if (!st) st = tli_parallel(w->ctx, count, PIECE, number_left, &job);
    tl_mem_free(w->ctx, job.firsts);
    *left = sum;
    return st;
}

/* What the passes over vertices or tets fill. */
typedef struct pack_job {
    const tli_work *work;
    tli_packed *packed;
    double *xyz;
    tl_lidx *tets;
    const tl_channel *from;
    size_t column; /* of the channel in the working values, or SIZE_MAX */
    double scale, *values;
    int32_t *regions;
} pack_job;

static tl_status copy_places(void *arg, size_t begin, size_t end, unsigned worker)
{
    pack_job *job = arg;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        tl_lidx to = job->packed->vert_of[v];
        if (to == TL_NONE) continue;
        memcpy(job->xyz + 3 * (size_t)to, job->work->verts[v].xyz, 3 * sizeof *job->xyz);
    }
    return TL_OK;
}

static tl_status copy_corners(void *arg, size_t begin, size_t end, unsigned worker)
{
    pack_job *job = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        size_t to = job->packed->tet_of[t];
        for (size_t j = 0; to != TL_NONE && j < 4; j++)
            job->tets[4 * to + j] = job->packed->vert_of[job->work->tets[t][j]];
    }
    return TL_OK;
}

static tl_status pack_shape(const tli_work *w, tli_packed *p, tl_mesh **mesh)
{
    tl_status st = TL_OK;
    pack_job job = {.work = w, .packed = p};
    job.xyz = tl_mem_alloc(w->ctx, p->vert_count, 3 * sizeof *job.xyz, &st);
    job.tets = tl_mem_alloc(w->ctx, p->tet_count, 4 * sizeof *job.tets, &st);
    if (!st) st = tli_parallel(w->ctx, w->vert_count, PIECE, copy_places, &job);
    if (!st) st = tli_parallel(w->ctx, w->tet_count, PIECE, copy_corners, &job);
    if (!st) st = tl_mesh_adopt(w->ctx, job.xyz, p->vert_count, job.tets, p->tet_count, mesh);
    if (st) {
        tl_mem_free(w->ctx, job.tets);
        tl_mem_free(w->ctx, job.xyz);
    }
    return st;
}

/* Column of a steering channel in the working values, or SIZE_MAX. */
static size_t column_of(const tl_mesh *mesh, const tl_simplify_opts *opts,
                        const tl_channel *channel, double *scale, const double *channel_scales)
{
    size_t column = 0;
    for (size_t i = 0; i < opts->channel_count; i++) {
        const tl_channel *c = tl_mesh_channel_by_name(mesh, opts->channels[i].name);
        *scale = channel_scales[i];
        if (c == channel) return column;
        column += c->components;
    }
    return SIZE_MAX;
}

static tl_status fill_vertex_channel(void *arg, size_t begin, size_t end, unsigned worker)
{
    const pack_job *job = arg;
    const tli_work *w = job->work;
    uint32_t k = job->from->components;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        if (job->packed->vert_of[v] == TL_NONE) continue;
        double *to = job->values + (size_t)job->packed->vert_of[v] * k;
        const double *original = job->from->values + (size_t)w->verts[v].origin * k;
        bool changed = w->verts[v].version != 0 && w->placement != TL_PLACE_SUBSET &&
                       w->verts[v].kind < TLI_CORNER;
        for (uint32_t j = 0; j < k; j++)
            to[j] = changed && job->column != SIZE_MAX && job->scale > 0
                        ? w->values[v * w->components + job->column + j] / job->scale
                        : original[j];
    }
    return TL_OK;
}

/* Tet channels start with the value of the tet that each new one was. */
static tl_status fill_tet_channel(void *arg, size_t begin, size_t end, unsigned worker)
{
    const pack_job *job = arg;
    uint32_t k = job->from->components;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        size_t to = job->packed->tet_of[t], origin = job->work->tet_origin[t];
        if (to != TL_NONE)
            memcpy(job->values + to * k, job->from->values + origin * k, k * sizeof *job->values);
    }
    return TL_OK;
}

static tl_status pack_channels(const tli_work *w, tli_packed *p, const tl_mesh *mesh,
                               const tl_simplify_opts *opts, const double *channel_scales,
                               tl_mesh *out)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < tl_mesh_channel_count(mesh); i++) {
        pack_job job = {.work = w, .packed = p, .from = tl_mesh_channel(mesh, i)};
        bool on_verts = job.from->on == TL_ON_VERTEX;
        size_t count = on_verts ? p->vert_count : p->tet_count;
        job.values = tl_mem_alloc(w->ctx, count, job.from->components * sizeof *job.values, &st);
        if (st) return st;
        if (on_verts) {
            job.column = column_of(mesh, opts, job.from, &job.scale, channel_scales);
            st = tli_parallel(w->ctx, w->vert_count, PIECE, fill_vertex_channel, &job);
        } else
            st = tli_parallel(w->ctx, w->tet_count, PIECE, fill_tet_channel, &job);
        tl_channel to = *job.from;
        to.values = job.values;
        if (!st) st = tl_mesh_adopt_channel(out, &to);
        if (st) tl_mem_free(w->ctx, job.values);
    }
    return st;
}

static tl_status copy_regions(void *arg, size_t begin, size_t end, unsigned worker)
{
    pack_job *job = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++)
        if (job->packed->tet_of[t] != TL_NONE)
            job->regions[job->packed->tet_of[t]] = job->work->regions[t];
    return TL_OK;
}

static tl_status pack_regions(const tli_work *w, tli_packed *p, tl_mesh *out)
{
    tl_status st = TL_OK;
    pack_job job = {.work = w, .packed = p};
    if (!w->regions) return TL_OK;
    job.regions = tl_mem_alloc(w->ctx, p->tet_count, sizeof *job.regions, &st);
    if (!st) st = tli_parallel(w->ctx, w->tet_count, PIECE, copy_regions, &job);
    if (!st) st = tl_mesh_set_regions(out, job.regions);
    tl_mem_free(w->ctx, job.regions);
    return st;
}

/* A tet of the star that is not flat, so that a walk can start there, or any. */
static tl_lidx solid_tet(const tli_work *w, const tli_star *star)
{
    for (uint32_t i = 0; i < star->count; i++) {
        const tl_lidx *q = w->tets[star->tets[i]];
        if (tli_orient3d_approx(w->verts[q[0]].xyz, w->verts[q[1]].xyz, w->verts[q[2]].xyz,
                                w->verts[q[3]].xyz) > 0)
            return star->tets[i];
    }
    return star->tets[0];
}

/* A tet at the vertex that an original vertex went into. */
static tl_status set_hints(void *arg, size_t begin, size_t end, unsigned worker)
{
    pack_job *job = arg;
    const tli_work *w = job->work;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        tl_lidx to = w->verts[v].merged;
        while (to != TL_NONE && w->verts[to].merged != to) to = w->verts[to].merged;
        bool gone = to == TL_NONE || w->verts[to].star.count == 0;
        job->packed->hints[w->verts[v].origin] =
            gone ? TL_NONE : job->packed->tet_of[solid_tet(w, &w->verts[to].star)];
    }
    return TL_OK;
}

tl_status tli_pack(const tli_work *w, const tl_mesh *mesh, const tl_simplify_opts *opts,
                   const double *channel_scales, tl_mesh **out, tl_lidx **hints)
{
    tli_packed p = {0};
    *out = NULL;
    tl_status st = number(w, false, &p.vert_of, &p.vert_count);
    if (!st) st = number(w, true, &p.tet_of, &p.tet_count);
    if (!st) st = pack_shape(w, &p, out);
    if (!st) st = pack_channels(w, &p, mesh, opts, channel_scales, *out);
    if (!st) st = pack_regions(w, &p, *out);
    p.hints = tl_mem_alloc(w->ctx, w->vert_count, sizeof *p.hints, &st);
    pack_job job = {.work = w, .packed = &p};
    if (!st) st = tli_parallel(w->ctx, w->vert_count, PIECE, set_hints, &job);
    if (!st) tl_mesh_set_time(*out, tl_mesh_time(mesh));
    tl_mem_free(w->ctx, p.tet_of);
    tl_mem_free(w->ctx, p.vert_of);
    if (st) {
        tl_mem_free(w->ctx, p.hints);
        tl_mesh_destroy(*out);
        *out = NULL;
    } else
        *hints = p.hints;
    return st;
}
