/* Simplification of real data, looked at through tl_mesh_compare, which shares nothing with it but
 * the mesh. Used by a short and a long test. */
#ifndef TETRALOD_TESTS_CHECK_SIMPLIFY_REAL_H
#define TETRALOD_TESTS_CHECK_SIMPLIFY_REAL_H

#include "tetralod/formats.h"

#include "check_ctx.h"
#include "check_grid.h"
#include "check_simplify.h"

typedef struct real_file {
    const char *name, *solution; /* solution: of PLOT3D, or NULL */
    uint32_t dims[3];            /* of a raw volume of bytes */
} real_file;

static inline tl_mesh *real_read(tl_ctx *ctx, const real_file *file)
{
    char path[4096], solution[4096];
    tl_mesh *mesh = NULL;
    tl_read_opts opts = tl_read_opts_defaults();
    if (!data_path(file->name, path, sizeof path)) return NULL;
    if (file->solution) {
        CHECK(data_path(file->solution, solution, sizeof solution));
        opts.solution = solution;
    }
    memcpy(opts.raw_dims, file->dims, sizeof opts.raw_dims);
    opts.raw_scalar = TL_U8;
    CHECK_OK(ctx, tl_mesh_read(ctx, path, &opts, &mesh, NULL));
    return mesh;
}

/* Calls look for each of the files that there are, with its number from 1 on; skips without any. */
static inline void real_each(const real_file *files, size_t count,
                             void (*look)(tl_ctx *ctx, tl_mesh *mesh, const char *name,
                                          uint64_t number))
{
    size_t found = 0;
    tl_ctx *ctx = check_ctx_create(2);
    for (size_t i = 0; i < count; i++) {
        tl_mesh *mesh = real_read(ctx, &files[i]);
        if (!mesh) continue;
        look(ctx, mesh, files[i].name, i + 1);
        found++;
    }
    tl_ctx_destroy(ctx);
    if (!found) CHECK_SKIP("no data: set TETRALOD_DATA to the folder of data sets");
    CHECK_EQ(found, count);
}

/* Bad tets do not grow in number, topology and volume stay, the boundary is where it was said to
 * be, every error is as small as it was said to be and as was asked. */
static inline void real_check(const tl_mesh *mesh, const shrunk *s, const tl_simplify_opts *opts)
{
    tl_ctx *ctx = tl_mesh_ctx(mesh);
    tl_compare_result c;
    CHECK_OK(ctx, tl_mesh_compare(ctx, mesh, s->mesh, NULL, &c));
    CHECK(c.inverted[1] <= c.inverted[0] && c.degenerate[1] <= c.degenerate[0]);
    CHECK_EQ(s->result.inverted, c.inverted[1]);
    CHECK_EQ(s->result.degenerate, c.degenerate[1]);
    CHECK_EQ(c.components[1], c.components[0]);
    CHECK_EQ(c.nonmanifold_faces[1], c.nonmanifold_faces[0]);
    CHECK_EQ(c.nonmanifold_edges[1], c.nonmanifold_edges[0]);
    CHECK_EQ(c.nonmanifold_verts[1], c.nonmanifold_verts[0]);
    check_same_topology(mesh, s->mesh, false);
    if (tl_mesh_regions(mesh)) check_same_topology(mesh, s->mesh, true);
    CHECK_BOUND("volume", fabs(c.volume[1] / c.volume[0] - 1), 1e-4);
    CHECK_BOUND("boundary", c.boundary_hausdorff, s->result.boundary_error + 1e-12 * c.diagonal);
    CHECK_BOUND("boundary said", s->result.boundary_error, 1e-3 * c.diagonal);
    tl_mesh_stats stats;
    CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats));
    for (size_t i = 0; i < c.field_count; i++) {
        const tl_field_error *f = &c.fields[i];
        double width = f->range[1] - f->range[0];
        if (f->on != TL_ON_VERTEX || !(width > 0)) continue;
        if (opts->error > 0) CHECK(result_error(s, f->name) <= opts->error * width);
        /* where a mesh lies on itself compare takes any of its places */
        if (stats.components > 1 || stats.inverted) continue;
        if (i > 3 && f->max <= result_error(s, f->name) * (1 + 1e-6)) continue;
        printf("%s: rms %.3f %%, mean %.3f %%, largest %.3f %%; ", f->name, 100 * f->rms / width,
               100 * f->mean / width, 100 * f->max / width);
        if (opts->error > 0)
            CHECK_BOUND("error", f->max, opts->error * width);
        else
            CHECK_BOUND("error", f->max, result_error(s, f->name) * (1 + 1e-6) + 1e-12 * width);
    }
    print_quality(s->mesh);
    tl_compare_release(ctx, &c);
}

/* To a ratio and to an error. */
static inline void real_simplify(const tl_mesh *mesh, double ratio, double error)
{
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.ratio = ratio;
    opts.error = error;
    shrunk s = shrink(mesh, &opts);
    printf("%zu tets to %zu by %s %g (%s), %.3g s and %.3g s of measuring\n", s.result.tets_in,
           s.result.tets_out, error > 0 ? "error" : "ratio", error > 0 ? error : ratio,
           s.result.stopped_by, s.result.seconds, s.result.measure_seconds);
    CHECK(s.result.tets_out < s.result.tets_in);
    if (s.result.target_reached && ratio > 0)
        CHECK(s.result.tets_out <= (size_t)(ratio * (double)s.result.tets_in));
    real_check(mesh, &s, &opts);
    shrink_release(&s);
}

#endif
