/* tl_mesh_compare: what two meshes are, and how far apart in field, boundary and isosurfaces
 * (Sondershaus 2007, 3.1.1 and 4.2.5). */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "measure/measure.h"

/* Default distance of the samples, relative to the larger diagonal. */
static const double STEP_DEFAULT = 0.0025;
/* Smallest one allowed: a triangle as long as the diagonal then has some 5e7 samples. */
static const double STEP_MIN = 1e-4;

tl_compare_opts tl_compare_opts_defaults(void)
{
    return (tl_compare_opts){.struct_bytes = sizeof(tl_compare_opts)};
}

/* Everything the steps below share. */
typedef struct comparison {
    const tl_mesh *meshes[2]; /* original, copy */
    tl_compare_opts opts;
    double step;
    tl_compare_result *result;
} comparison;

static const char *const MESH_NAMES[2] = {"original", "copy"};

static tl_status read_opts(tl_ctx *ctx, const tl_compare_opts *given, tl_compare_opts *opts)
{
    *opts = tl_compare_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_compare_opts", given, opts, sizeof *opts);
    if (st) return st;
    if (opts->iso_count > 0 && !opts->isos)
        return tl_fail(ctx, TL_ERR_ARG, "%zu isosurfaces, but no list of them", opts->iso_count);
    return TL_OK;
}

/* The first channel of that name on vertices with one component, or NULL. */
static const tl_channel *find_scalar(const tl_mesh *mesh, const char *name)
{
    for (size_t i = 0; i < mesh->channel_count; i++) {
        const tl_channel *channel = &mesh->channels[i];
        if (channel->on == TL_ON_VERTEX && channel->components == 1 &&
            strcmp(channel->name, name) == 0)
            return channel;
    }
    return NULL;
}

static tl_status check_isos(tl_ctx *ctx, const comparison *c)
{
    for (size_t i = 0; i < c->opts.iso_count; i++) {
        const tl_iso_request *iso = &c->opts.isos[i];
        if (!iso->channel || !isfinite(iso->value))
            return tl_fail(ctx, TL_ERR_ARG,
                           "isosurface %zu: a channel and a finite value are needed", i);
        for (int side = 0; side < 2; side++)
            if (!find_scalar(c->meshes[side], iso->channel))
                return tl_fail(ctx, TL_ERR_ARG,
                               "isosurface %zu: the %s has no scalar channel '%s' on vertices", i,
                               MESH_NAMES[side], iso->channel);
    }
    return TL_OK;
}

static tl_status check_vertices(tl_ctx *ctx, const tl_mesh *mesh, const char *name)
{
    if (mesh->tet_count == 0) return tl_fail(ctx, TL_ERR_DATA, "the %s has no tets", name);
    for (size_t i = 0; i < 4 * mesh->tet_count; i++) {
        const double *x = mesh->xyz + 3 * (size_t)mesh->tets[i];
        if (vec_is_finite(x)) continue;
        return tl_fail(ctx, TL_ERR_DATA,
                       "the %s can't be compared: tet %zu has vertex %u at (%g, %g, %g)", name,
                       i / 4, mesh->tets[i], x[0], x[1], x[2]);
    }
    return TL_OK;
}

static tl_status measure_meshes(tl_ctx *ctx, comparison *c)
{
    tl_compare_result *r = c->result;
    double largest = 0;
    for (int side = 0; side < 2; side++) {
        tl_mesh_stats stats;
        tl_status st = check_vertices(ctx, c->meshes[side], MESH_NAMES[side]);
        if (!st) st = tl_progress(ctx, "meshes", (uint64_t)side, 2);
        if (!st) st = tl_mesh_measure(ctx, c->meshes[side], &stats);
        if (st) return tl_note(ctx, st, "while measuring the %s", MESH_NAMES[side]);
        if (side == 0) r->diagonal = stats.diagonal;
        largest = fmax(largest, stats.diagonal);
        r->volume[side] = stats.volume;
        r->area[side] = stats.boundary_area;
        r->inverted[side] = stats.inverted;
        r->degenerate[side] = stats.degenerate;
        r->nonmanifold_faces[side] = stats.nonmanifold_faces;
        r->nonmanifold_edges[side] = stats.nonmanifold_edges;
        r->nonmanifold_verts[side] = stats.nonmanifold_verts;
        r->components[side] = stats.components;
    }
    if (!isfinite(largest))
        return tl_fail(ctx, TL_ERR_DATA,
                       "the meshes are too large: the diagonal of a box overflows");
    c->step = c->opts.sample_step != 0 ? c->opts.sample_step : STEP_DEFAULT * largest;
    if (!isfinite(c->step) || c->step < STEP_MIN * largest || c->opts.sample_step < 0)
        return tl_fail(ctx, TL_ERR_ARG,
                       "a sample step of %g; at least %g (1/%g of the larger diagonal)",
                       c->opts.sample_step, STEP_MIN * largest, 1 / STEP_MIN);
    return tl_progress(ctx, "meshes", 2, 2);
}

static tl_status boundary_surface(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                  tli_surface *surface)
{
    tl_lidx *triangles = NULL;
    size_t triangle_count = 0;
    tl_status st = tl_mesh_boundary(ctx, mesh, opposite, &triangles, NULL, &triangle_count);
    if (!st)
        st = tli_surface_create(ctx, mesh->xyz, mesh->vert_count, triangles, triangle_count,
                                surface);
    tl_mem_free(ctx, triangles);
    return st;
}

static tl_status compare_boundaries(tl_ctx *ctx, comparison *c, const tl_lidx *copy_opposite)
{
    tli_surface surfaces[2] = {{0}, {0}};
    tli_surface_error error;
    tl_compare_result *r = c->result;
    tl_status st = boundary_surface(ctx, c->meshes[0], NULL, &surfaces[0]);
    if (!st) st = boundary_surface(ctx, c->meshes[1], copy_opposite, &surfaces[1]);
    if (!st) st = tli_surface_compare(ctx, "boundary", &surfaces[0], &surfaces[1], c->step, &error);
    if (!st) {
        r->boundary_mean = error.mean;
        r->boundary_hausdorff = fmax(error.one_sided[0], error.one_sided[1]);
        r->boundary_hausdorff_bound = fmax(error.bound[0], error.bound[1]);
        memcpy(r->boundary_one_sided, error.one_sided, sizeof error.one_sided);
        r->boundary_step = c->step;
        r->boundary_samples = error.samples;
    }
    tli_surface_release(&surfaces[1]);
    tli_surface_release(&surfaces[0]);
    return st ? tl_note(ctx, st, "while comparing the boundaries") : TL_OK;
}

static tl_status compare_isosurface(tl_ctx *ctx, const comparison *c, const tl_iso_request *request,
                                    tl_iso_error *iso)
{
    tli_surface surfaces[2] = {{0}, {0}};
    tli_surface_error error;
    tl_status st = TL_OK;
    for (int side = 0; !st && side < 2; side++)
        st = tli_iso_surface(ctx, c->meshes[side], find_scalar(c->meshes[side], request->channel),
                             request->value, &surfaces[side]);
    if (!st)
        st = tli_surface_compare(ctx, "isosurface", &surfaces[0], &surfaces[1], c->step, &error);
    if (!st)
        *iso = (tl_iso_error){.channel = find_scalar(c->meshes[0], request->channel)->name,
                              .value = request->value,
                              .mean = error.mean,
                              .hausdorff = fmax(error.one_sided[0], error.one_sided[1]),
                              .hausdorff_bound = fmax(error.bound[0], error.bound[1]),
                              .one_sided = {error.one_sided[0], error.one_sided[1]},
                              .area = {surfaces[0].area, surfaces[1].area},
                              .samples = error.samples};
    tli_surface_release(&surfaces[1]);
    tli_surface_release(&surfaces[0]);
    return st ? tl_note(ctx, st, "while comparing the isosurfaces %g of '%s'", request->value,
                        request->channel)
              : TL_OK;
}

static tl_status compare_isosurfaces(tl_ctx *ctx, comparison *c)
{
    tl_status st = TL_OK;
    tl_compare_result *r = c->result;
    if (c->opts.iso_count == 0) return TL_OK;
    r->isos = tl_mem_zalloc(ctx, c->opts.iso_count, sizeof *r->isos, &st);
    for (size_t i = 0; !st && i < c->opts.iso_count; i++)
        st = compare_isosurface(ctx, c, &c->opts.isos[i], &r->isos[i]);
    if (!st) r->iso_count = c->opts.iso_count;
    return st;
}

tl_status tl_mesh_compare(tl_ctx *ctx, const tl_mesh *original, const tl_mesh *copy,
                          const tl_compare_opts *opts, tl_compare_result *result)
{
    comparison c = {.meshes = {original, copy}, .result = result};
    tl_lidx *opposite = NULL; /* of the copy */
    memset(result, 0, sizeof *result);
    tl_status st = read_opts(ctx, opts, &c.opts);
    if (!st) st = check_isos(ctx, &c);
    if (!st) st = measure_meshes(ctx, &c);
    if (!st) st = tl_mesh_adjacency(ctx, copy, &opposite, NULL);
    if (!st) st = tli_measure_fields(ctx, original, copy, opposite, result->diagonal, result);
    if (!st && !c.opts.skip_boundary) st = compare_boundaries(ctx, &c, opposite);
    if (!st) st = compare_isosurfaces(ctx, &c);
    tl_mem_free(ctx, opposite);
    if (st) tl_compare_release(ctx, result);
    return st;
}

void tl_compare_release(tl_ctx *ctx, tl_compare_result *result)
{
    if (!result) return;
    tl_mem_free(ctx, result->isos);
    tl_mem_free(ctx, result->fields);
    memset(result, 0, sizeof *result);
}
