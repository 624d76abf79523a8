/* Normals of streamlines against flows whose turning is known. */
#include "check.h"
#include "check_ctx.h"

#include "check_lines.h"
#include "make_mesh.h"
#include "tetralod/extract.h"

/* A cube whose corner values are linear in space, so that the curl is the same everywhere. */
static tl_mesh *make_cube(tl_ctx *ctx, void (*flow)(const double x[3], double v[3]),
                          double **vectors)
{
    make_mesh m = make_grid(9);
    for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] -= 0.5;
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    *vectors = malloc(3 * m.vert_count * sizeof **vectors);
    for (size_t v = 0; v < m.vert_count; v++) flow(m.xyz + 3 * v, *vectors + 3 * v);
    make_release(&m);
    return mesh;
}

static tl_polydata *trace(tl_ctx *ctx, const tl_mesh *mesh, const double *vectors,
                          const double *seeds, size_t seed_count, unsigned order)
{
    tl_polydata *lines = NULL;
    tl_stream_opts opts = tl_stream_opts_defaults();
    opts.normals = true;
    opts.order = order;
    CHECK_OK(ctx, tl_streamlines(ctx, mesh, NULL, NULL, vectors, seeds, seed_count, &opts, &lines,
                                 NULL));
    CHECK(lines->normals != NULL);
    return lines;
}

static const float *normal_of(const tl_polydata *lines, size_t line, size_t i)
{
    return lines->normals + 3 * (size_t)lines->corners[lines->starts[line] + i];
}

/* One long, and across the line. */
static void check_across(const tl_polydata *lines)
{
    for (size_t line = 0; line < lines->cell_count; line++)
        for (size_t i = 0; i < line_verts(lines, line); i++) {
            const size_t last = line_verts(lines, line) - 1;
            const double *a = line_vert(lines, line, i ? i - 1 : 0);
            const double *b = line_vert(lines, line, i < last ? i + 1 : last);
            const float *n = normal_of(lines, line, i);
            double length2 = 0, along = 0, way2 = 0;
            for (int k = 0; k < 3; k++) {
                length2 += (double)n[k] * (double)n[k];
                along += (double)n[k] * (b[k] - a[k]);
                way2 += (b[k] - a[k]) * (b[k] - a[k]);
            }
            CHECK_NEAR(length2, 1, 1e-5);
            CHECK(fabs(along) <= 1e-5 * sqrt(way2));
        }
}

static const double SPIN = 3, RISE = 0.7;

/* Turns about z while it rises: what flows turns by SPIN a time. */
static void screw(const double x[3], double v[3])
{
    v[0] = -SPIN * x[1];
    v[1] = SPIN * x[0];
    v[2] = RISE;
}

/* On the axis the line is straight, and its normal turns with the flow. */
static void turns_with_the_flow(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    double *vectors;
    tl_mesh *mesh = make_cube(ctx, screw, &vectors);
    const double seed[3] = {0, 0, 0};
    for (unsigned order = 2; order <= 5; order += 3) {
        tl_polydata *lines = trace(ctx, mesh, vectors, seed, 1, order);
        const size_t last = line_verts(lines, 0) - 1;
        CHECK_EQ(lines->cell_count, 1);
        CHECK_NEAR(line_vert(lines, 0, last)[2], 0.5, 1e-9);
        for (size_t i = 0; i <= last; i++) {
            const double angle = SPIN / RISE * (line_vert(lines, 0, i)[2] + 0.5);
            const float *n = normal_of(lines, 0, i);
            CHECK_NEAR((double)n[0], cos(angle), 1e-5);
            CHECK_NEAR((double)n[1], sin(angle), 1e-5);
            CHECK_NEAR((double)n[2], 0, 1e-5);
        }
        check_across(lines);
        tl_polydata_destroy(ctx, lines);
    }
    free(vectors);
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
}

/* Around a point, in planes: no vorticity, lines bend, and normals stay upright. */
static void stagnation(const double x[3], double v[3])
{
    v[0] = x[0];
    v[1] = -x[1];
    v[2] = 0;
}

static void stays_without_vorticity(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    double *vectors;
    tl_mesh *mesh = make_cube(ctx, stagnation, &vectors);
    const double seeds[6] = {0.2, 0.21, 0.1, -0.1, -0.3, 0.27};
    tl_polydata *lines = trace(ctx, mesh, vectors, seeds, 2, 2);
    CHECK_EQ(lines->cell_count, 2);
    for (size_t v = 0; v < lines->vert_count; v++)
        CHECK_NEAR((double)lines->normals[3 * v + 2], 1, 1e-6);
    check_across(lines);
    tl_polydata_destroy(ctx, lines);
    free(vectors);
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
}

/* Off the axis lines are helices. A normal is carried without twist, which for a helix is a turn by
 * its torsion against the normal of its curve, and turned by the part of the spin along it. */
static void on_a_helix(void **state)
{
    (void)state;
    const double radius = 0.3;
    tl_ctx *ctx = check_ctx_create(2);
    double *vectors;
    tl_mesh *mesh = make_cube(ctx, screw, &vectors);
    const double seed[3] = {0.3, 0, 0};
    tl_polydata *lines = trace(ctx, mesh, vectors, seed, 1, 5);
    const double speed = sqrt(SPIN * radius * SPIN * radius + RISE * RISE);
    const double torsion = SPIN * RISE / (speed * speed), along = SPIN * RISE / speed;
    const double *time = lines->channels[0].values;
    const size_t last = line_verts(lines, 0) - 1;
    double begin = 0;
    check_across(lines);
    for (size_t i = 2; i + 2 <= last; i++) {
        const double *x = line_vert(lines, 0, i);
        const size_t v = lines->corners[lines->starts[0] + i];
        const float *n = normal_of(lines, 0, i);
        double out[3] = {-x[0] / radius, -x[1] / radius, 0}, t[3], b[3];
        screw(x, t);
        for (int k = 0; k < 3; k++) t[k] /= speed;
        b[0] = t[1] * out[2] - t[2] * out[1];
        b[1] = t[2] * out[0] - t[0] * out[2];
        b[2] = t[0] * out[1] - t[1] * out[0];
        double u = 0, w = 0;
        for (int k = 0; k < 3; k++) {
            u += (double)n[k] * out[k];
            w += (double)n[k] * b[k];
        }
        /* the angle against the normal of the curve grows by spin less torsion */
        double angle = atan2(w, u) - time[v] * (along - torsion * speed);
        if (i == 2) begin = angle;
        CHECK_NEAR(remainder(angle - begin, 2 * acos(-1)), 0, 0.02);
    }
    CHECK(last > 10);
    tl_polydata_destroy(ctx, lines);
    free(vectors);
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
}

/* Lines are the same as without normals, and with any number of threads. */
static void changes_nothing_else(void **state)
{
    (void)state;
    tl_polydata *all[3];
    tl_ctx *ctxs[3];
    for (unsigned i = 0; i < 3; i++) {
        double *vectors;
        ctxs[i] = check_ctx_create(i + 1);
        tl_mesh *mesh = make_cube(ctxs[i], screw, &vectors);
        tl_stream_opts opts = tl_stream_opts_defaults();
        opts.normals = i > 0;
        CHECK_OK(ctxs[i], tl_streamlines_cover(ctxs[i], mesh, NULL, NULL, vectors, NULL, 5, &opts,
                                               &all[i], NULL));
        free(vectors);
        tl_mesh_destroy(mesh);
    }
    CHECK(all[0]->normals == NULL && all[0]->cell_count > 10);
    for (int i = 1; i < 3; i++) {
        CHECK_EQ(all[i]->vert_count, all[0]->vert_count);
        CHECK(!memcmp(all[i]->xyz, all[0]->xyz, 3 * all[0]->vert_count * sizeof *all[0]->xyz));
        CHECK_EQ(all[i]->channel_count, all[0]->channel_count);
    }
    CHECK(!memcmp(all[1]->normals, all[2]->normals,
                  3 * all[1]->vert_count * sizeof *all[1]->normals));
    for (int i = 0; i < 3; i++) {
        tl_polydata_destroy(ctxs[i], all[i]);
        check_ctx_destroy(ctxs[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(turns_with_the_flow), cmocka_unit_test(stays_without_vorticity),
        cmocka_unit_test(on_a_helix), cmocka_unit_test(changes_nothing_else)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
