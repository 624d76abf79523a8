/* Gradients at vertices: the tets' own ones, then their means, each vertex in the order of its
 * tets. */
#include "base/base_vec.h"
#include "extract/extract.h"

enum { GRAIN = 4096 };

typedef struct job {
    const tl_lidx *tets;
    const double *xyz;
    const double *values;
    size_t components, component;
    double (*slopes)[4]; /* [tet_count] volume times gradient, volume; times 6 */
    const tl_lidx *offsets, *tet_ids;
    double *out;
} job;

static void measure_tet(const job *j, size_t t)
{
    const tl_lidx *q = j->tets + 4 * t;
    double *slope = j->slopes[t];
    double e[3][3], n[3][3], sum[3] = {0}, base = j->values[q[0] * j->components + j->component];
    for (int i = 0; i < 3; i++)
        vec_sub(j->xyz + 3 * (size_t)q[i + 1], j->xyz + 3 * (size_t)q[0], e[i]);
    vec_cross(e[1], e[2], n[0]);
    vec_cross(e[2], e[0], n[1]);
    vec_cross(e[0], e[1], n[2]);
    double volume = vec_dot(e[0], n[0]);
    for (int i = 0; i < 3; i++) {
        double rise = j->values[q[i + 1] * j->components + j->component] - base;
        for (int k = 0; k < 3; k++) sum[k] += n[i][k] * rise;
    }
    bool usable = volume > 0 && isfinite(volume) && vec_is_finite(sum);
    for (int k = 0; k < 3; k++) slope[k] = usable ? sum[k] : 0;
    slope[3] = usable ? volume : 0;
}

static tl_status measure_tets(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    for (size_t t = begin; t < end; t++) measure_tet(arg, t);
    return TL_OK;
}

static tl_status average_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t v = begin; v < end; v++) {
        double sum[4] = {0}, *out = j->out + 3 * (v * j->components + j->component);
        for (tl_lidx i = j->offsets[v]; i < j->offsets[v + 1]; i++)
            for (int k = 0; k < 4; k++) sum[k] += j->slopes[j->tet_ids[i]][k];
        for (int k = 0; k < 3; k++) out[k] = sum[3] > 0 ? sum[k] / sum[3] : 0;
    }
    return TL_OK;
}

tl_status tl_mesh_gradient(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel, double *out)
{
    tl_lidx *offsets = NULL, *tet_ids = NULL;
    size_t tet_count = tl_mesh_tet_count(mesh);
    if (channel->on != TL_ON_VERTEX)
        return tl_fail(ctx, TL_ERR_ARG, "channel '%s' has no gradient: it stands on tets",
                       channel->name);
    tl_status st = tl_mesh_incidence(ctx, mesh, &offsets, &tet_ids);
    job j = {.tets = tl_mesh_tets(mesh),
             .xyz = tl_mesh_xyz(mesh),
             .values = channel->values,
             .components = channel->components,
             .offsets = offsets,
             .tet_ids = tet_ids,
             .out = out};
    j.slopes = tl_mem_alloc(ctx, tet_count, sizeof *j.slopes, &st);
    for (j.component = 0; !st && j.component < j.components; j.component++) {
        st = tli_parallel(ctx, tet_count, GRAIN, measure_tets, &j);
        if (!st) st = tli_parallel(ctx, tl_mesh_vert_count(mesh), GRAIN, average_verts, &j);
    }
    tl_mem_free(ctx, j.slopes);
    tl_mem_free(ctx, tet_ids);
    tl_mem_free(ctx, offsets);
    return st;
}
