/* Gradients of a scalar at vertices. Each patch adds up its own tets; then the sums of vertices
 * that several patches hold are added in the order of the patches, and handed back to all of them,
 * so that shading shows no border. */
#include "cut/cut_gradient.h"

#include "base/base_vec.h"
#include "cut/cut_keys.h"

typedef struct job {
    tl_ctx *ctx;
    const tl_lattice *lattice;
    const tl_patch *const *patches;
    const double *const *values;
    double *const *gradients;
    tli_slope **slopes; /* [patch_count][vert_count] */
} job;

/* Adds 6 times the volume, and that times the gradient, of one tet to its corners. */
static void add_tet(const tl_patch *p, const double *xyz, const double *values, uint32_t t,
                    tli_slope *slopes)
{
    const uint16_t *q = p->tets[t];
    double e[3][3], n[3][3], sum[3] = {0};
    for (int i = 0; i < 3; i++) vec_sub(xyz + 3 * q[i + 1], xyz + 3 * q[0], e[i]);
    vec_cross(e[1], e[2], n[0]);
    vec_cross(e[2], e[0], n[1]);
    vec_cross(e[0], e[1], n[2]);
    double volume = vec_dot(e[0], n[0]);
    /* the gradient is sum of n_i (v_i - v_0) / volume; with the volume's weight it cancels */
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) sum[k] += n[i][k] * (values[q[i + 1]] - values[q[0]]);
    if (!(volume > 0) || !vec_is_finite(sum)) return;
    for (int i = 0; i < 4; i++) {
        tli_slope *s = &slopes[q[i]];
        for (int k = 0; k < 3; k++) s->sum[k] += sum[k];
        s->volume += volume;
    }
}

void tli_slopes_add(const tl_patch *patch, const double *xyz, const double *values,
                    tli_slope *slopes)
{
    for (uint32_t t = 0; t < patch->tet_count; t++) add_tet(patch, xyz, values, t, slopes);
}

void tli_slope_gradient(const tli_slope *slope, double gradient[3])
{
    for (int k = 0; k < 3; k++) gradient[k] = slope->volume > 0 ? slope->sum[k] / slope->volume : 0;
}

static tl_status add_patches(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    job *j = arg;
    tl_status st = TL_OK;
    for (size_t i = begin; !st && i < end; i++) {
        const tl_patch *p = j->patches[i];
        double *xyz = tl_mem_alloc(j->ctx, p->vert_count, 3 * sizeof *xyz, &st);
        j->slopes[i] = tl_mem_zalloc(j->ctx, p->vert_count, sizeof **j->slopes, &st);
        for (uint32_t v = 0; !st && v < p->vert_count; v++)
            tl_lattice_xyz(j->lattice, p->places[v], xyz + 3 * v);
        if (!st) tli_slopes_add(p, xyz, j->values[i], j->slopes[i]);
        tl_mem_free(j->ctx, xyz);
    }
    return st;
}

static tl_status key_of(tli_keys *keys, const tl_patch *p, uint32_t v, uint32_t *key)
{
    return tli_keys_take(keys, p->places[v], p->twins ? p->twins[v] : 0, key);
}

/* Adds up what patches have at shared vertices, and gives each the sum. */
static tl_status join_shared(job *j, size_t patch_count)
{
    tli_keys keys;
    size_t shared = 0;
    for (size_t i = 0; i < patch_count; i++)
        for (uint32_t v = 0; v < j->patches[i]->vert_count; v++) shared += j->patches[i]->shared[v];
    tl_status st = tli_keys_open(j->ctx, shared, &keys);
    tli_slope *sums = tl_mem_zalloc(j->ctx, shared, sizeof *sums, &st);
    for (int pass = 0; pass < 2; pass++)
        for (size_t i = 0; !st && i < patch_count; i++)
            for (uint32_t v = 0; !st && v < j->patches[i]->vert_count; v++) {
                uint32_t key;
                tli_slope *own = &j->slopes[i][v];
                if (!j->patches[i]->shared[v]) continue;
                st = key_of(&keys, j->patches[i], v, &key);
                if (st) break;
                if (pass) *own = sums[key];
                for (int k = 0; !pass && k < 3; k++) sums[key].sum[k] += own->sum[k];
                if (!pass) sums[key].volume += own->volume;
            }
    tl_mem_free(j->ctx, sums);
    tli_keys_close(&keys);
    return st;
}

tl_status tl_patches_gradient(tl_ctx *ctx, const tl_lattice *lattice,
                              const tl_patch *const *patches, size_t patch_count,
                              const double *const *values, double *const *gradients)
{
    tl_status st = TL_OK;
    job j = {ctx, lattice, patches, values, gradients, NULL};
    j.slopes = tl_mem_zalloc(ctx, patch_count, sizeof *j.slopes, &st);
    if (!st) st = tli_parallel(ctx, patch_count, 1, add_patches, &j);
    if (!st) st = join_shared(&j, patch_count);
    for (size_t i = 0; !st && i < patch_count; i++)
        for (uint32_t v = 0; v < patches[i]->vert_count; v++)
            tli_slope_gradient(&j.slopes[i][v], gradients[i] + 3 * (size_t)v);
    for (size_t i = 0; j.slopes && i < patch_count; i++) tl_mem_free(ctx, j.slopes[i]);
    tl_mem_free(ctx, j.slopes);
    return st;
}
