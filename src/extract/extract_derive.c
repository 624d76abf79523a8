/* Fields that are made of one channel: norms, and what follows from gradients at vertices. */
#include "base/base_vec.h"
#include "extract/extract.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192 };

typedef struct job {
    tl_derived derived;
    const tl_channel *channel;
    const double *gradients; /* [vert_count][3][3] of a vector */
    double *out;
} job;

static tl_status set_magnitudes(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    size_t n = j->channel->components;
    for (size_t i = begin; i < end; i++) {
        double sum = 0;
        for (size_t k = 0; k < n; k++)
            sum += j->channel->values[n * i + k] * j->channel->values[n * i + k];
        j->out[i] = sqrt(sum);
    }
    return TL_OK;
}

/* g [3][3]: row i has the derivatives of component i. The squared norms of the two parts of g
 * differ by twice the trace of its square. */
static tl_status combine_gradients(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t v = begin; v < end; v++) {
        const double *g = j->gradients + 9 * v;
        if (j->derived == TL_DERIVED_DIVERGENCE) {
            j->out[v] = g[0] + g[4] + g[8];
        } else if (j->derived == TL_DERIVED_VORTICITY) {
            j->out[3 * v] = g[7] - g[5];
            j->out[3 * v + 1] = g[2] - g[6];
            j->out[3 * v + 2] = g[3] - g[1];
        } else {
            j->out[v] = -(g[0] * g[0] + g[4] * g[4] + g[8] * g[8]) / 2 -
                        (g[1] * g[3] + g[2] * g[6] + g[5] * g[7]);
        }
    }
    return TL_OK;
}

uint32_t tl_derived_components(tl_derived derived, uint32_t components)
{
    switch (derived) {
    case TL_DERIVED_MAGNITUDE: return components ? 1 : 0;
    case TL_DERIVED_GRADIENT: return components <= UINT32_MAX / 3 ? 3 * components : 0;
    case TL_DERIVED_DIVERGENCE:
    case TL_DERIVED_Q: return components == 3 ? 1 : 0;
    case TL_DERIVED_VORTICITY: return components == 3 ? 3 : 0;
    }
    return 0;
}

tl_status tl_derive(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel, tl_derived derived,
                    double *out)
{
    tl_status st = TL_OK;
    job j = {derived, channel, NULL, out};
    if (!tl_derived_components(derived, channel->components))
        return tl_fail(ctx, TL_ERR_ARG, "field %d can't be derived of %u components", (int)derived,
                       channel->components);
    if (derived == TL_DERIVED_MAGNITUDE) {
        size_t count = channel->on == TL_ON_VERTEX ? mesh->vert_count : mesh->tet_count;
        return tli_parallel(ctx, count, GRAIN, set_magnitudes, &j);
    }
    if (derived == TL_DERIVED_GRADIENT) return tl_mesh_gradient(ctx, mesh, channel, out);
    double *gradients = tl_mem_alloc(ctx, mesh->vert_count, 9 * sizeof *gradients, &st);
    if (!st) st = tl_mesh_gradient(ctx, mesh, channel, gradients);
    j.gradients = gradients;
    if (!st) st = tli_parallel(ctx, mesh->vert_count, GRAIN, combine_gradients, &j);
    tl_mem_free(ctx, gradients);
    return st;
}
