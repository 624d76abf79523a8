/* Distances from a plane, to be sliced at 0. */
#include "base/base_vec.h"
#include "extract/extract.h"

typedef struct job {
    const double *xyz;
    double origin[3], normal[3]; /* one long */
    double *out;
} job;

static tl_status measure_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t v = begin; v < end; v++) {
        double from[3];
        vec_sub(j->xyz + 3 * v, j->origin, from);
        j->out[v] = vec_dot(from, j->normal);
    }
    return TL_OK;
}

tl_status tl_plane_distance(tl_ctx *ctx, const tl_mesh *mesh, const double origin[3],
                            const double normal[3], double *out)
{
    double length = vec_length(normal);
    if (!vec_is_finite(origin) || !isfinite(length) || !(length > 0))
        return tl_fail(ctx, TL_ERR_ARG, "a plane needs a finite origin and a normal with a length");
    job j = {.xyz = tl_mesh_xyz(mesh), .out = out};
    for (int k = 0; k < 3; k++) {
        j.origin[k] = origin[k];
        j.normal[k] = normal[k] / length;
    }
    return tli_parallel(ctx, tl_mesh_vert_count(mesh), 8192, measure_verts, &j);
}
