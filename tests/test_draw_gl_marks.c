/* Surfaces, slices, lines and points by OpenGL against closed forms and the processor. Skips where
 * there is no OpenGL. */
#include "check_gl.h"

/* ---- surfaces and slices ---- */

static double distance(const double x[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += (x[k] - CENTER[k]) * (x[k] - CENTER[k]);
    return sqrt(sum);
}

/* Slices are made in the card; the picture knows the radius they were asked for. */
static void slices_have_their_silhouette(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(33, false);
    solid s = open_solid(ctx, &m, distance);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .opacity = 1, .level = 0.1};
    tl_camera camera = make_camera(true);
    camera.size_px[0] = camera.size_px[1] = SIDE;
    tl_renderer *r = open_renderer(ctx, TL_RENDERER_GL);
    tl_item slices = fill(ctx, r, &drawn);
    for (double radius = 0.15; radius < 0.5; radius += 0.1) {
        double edge = SIDE / 1.2 * radius, pi = acos(-1);
        CHECK_OK(ctx, tl_renderer_set_slices(ctx, r, slices, &radius, 1));
        tl_image *image = picture_take(ctx, r, &camera);
        CHECK_NEAR(picture_covered(image) / (pi * edge * edge), 1, 0.03); /* 33 vertices a side */
        /* chords of the tets lie inside of the sphere */
        CHECK_NEAR((double)image->depth[SIDE * (SIDE / 2) + SIDE / 2], 2.5 - radius, 3e-3);
        tl_image_destroy(ctx, image);
    }
    double nowhere = 2;
    CHECK_OK(ctx, tl_renderer_set_slices(ctx, r, slices, &nowhere, 1));
    tl_image *image = picture_take(ctx, r, &camera);
    for (size_t i = 0; i < (size_t)SIDE * SIDE; i++)
        CHECK(image->rgba[4 * i + 3] == 0 && isinf(image->depth[i]));
    tl_image_destroy(ctx, image);
    tl_renderer_destroy(ctx, r);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

static void surfaces_as_by_the_processor(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(13, false);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, false);
    tl_polydata inner = make_sphere(40, CENTER, 0.2), outer = make_sphere(30, CENTER, 0.45);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .opacity = 0.4};
    drawn.opaque = &inner;
    compare(ctx, "an opaque sphere, flat", &drawn, ALIKE);
    drawn.translucent = &outer;
    compare(ctx, "a translucent one around it", &drawn, ALIKE);
    double *values = malloc((inner.vert_count + outer.vert_count) * sizeof *values);
    if (!values) abort();
    for (size_t v = 0; v < inner.vert_count; v++) values[v] = inner.xyz[3 * v];
    values[40] = (double)NAN;
    tl_look look = tl_look_defaults();
    const double red[3] = {1, 0, 0};
    tl_transfer *with_nan = NULL;
    CHECK_OK(ctx, tl_transfer_with_nan(ctx, t, red, &with_nan));
    look.scalar = values;
    look.transfer = with_nan;
    look.lit = false;
    drawn.look = &look;
    drawn.translucent = NULL;
    drawn.level = 0.3;
    compare(ctx, "colours of values, a slice", &drawn, ALIKE);
    free(values);
    drawn.look = NULL;
    drawn.volume = s.volume;
    drawn.transfer = t;
    drawn.translucent = &outer;
    compare(ctx, "with the volume", &drawn, ALIKE);
    make_triangles_release(&inner);
    make_triangles_release(&outer);
    tl_transfer_destroy(ctx, with_nan);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* ---- lines and points ---- */

/* Springs around the middle, with normals and a value that rises; one has a place that is none. */
static tl_polydata make_springs(double *values)
{
    enum { SPRINGS = 6, CORNERS = 90 };
    tl_polydata p = {.kind = TL_POLY_LINES, .cell_count = SPRINGS, .vert_count = SPRINGS * CORNERS};
    p.xyz = calloc(p.vert_count, 3 * sizeof *p.xyz);
    p.normals = calloc(p.vert_count, 3 * sizeof *p.normals);
    p.corners = calloc(p.vert_count, sizeof *p.corners);
    p.starts = calloc(SPRINGS + 1, sizeof *p.starts);
    if (!p.xyz || !p.normals || !p.corners || !p.starts) abort();
    for (size_t v = 0; v < p.vert_count; v++) {
        double t = (double)(v % CORNERS) / CORNERS, spring = (double)(v / CORNERS);
        double around = 14 * t + spring, radius = 0.1 + 0.05 * spring;
        p.xyz[3 * v] = 0.5 + radius * cos(around);
        p.xyz[3 * v + 1] = 0.5 + radius * sin(around);
        p.xyz[3 * v + 2] = t;
        p.normals[3 * v] = (float)cos(around);
        p.normals[3 * v + 1] = (float)sin(around);
        p.corners[v] = (tl_lidx)v;
        values[v] = t;
    }
    for (size_t i = 0; i <= SPRINGS; i++) p.starts[i] = (tl_lidx)(i * CORNERS);
    p.xyz[3 * 40] = (double)NAN;
    return p;
}

static void release_springs(tl_polydata *p)
{
    free(p->xyz);
    free(p->normals);
    free(p->corners);
    free(p->starts);
}

static void lines_as_by_the_processor(void **state)
{
    (void)state;
    static const char *const names[] = {"lines, flat",
                                        "tubes",
                                        "ribbons",
                                        "tubes, wide, halos",
                                        "dashes and arrows",
                                        "translucent tubes",
                                        "translucent, values"};
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    double values[1000];
    tl_polydata springs = make_springs(values);
    tl_transfer *t = colored(ctx, false);
    for (int kind = 0; kind < 7; kind++) {
        tl_line_opts opts = tl_line_opts_defaults();
        tl_look look = tl_look_defaults();
        scene drawn = {.lines = &springs, .line_opts = &opts, .look = &look};
        opts.width_px = 5;
        if (kind == 0) opts.shape = TL_LINE_FLAT;
        if (kind == 2) opts.shape = TL_LINE_RIBBON;
        if (kind == 3) opts.width = 0.03;
        if (kind == 3) opts.halo_px = 4;
        if (kind == 4) {
            opts.arrow_spacing = 0.3;
            opts.dash = 0.05;
            opts.gap = 0.03;
            opts.phase = 0.02;
            opts.width_px = 3;
        }
        if (kind >= 5) look.opacity = 0.5;
        if (kind == 6) {
            look.scalar = values;
            look.transfer = t;
        }
        compare(ctx, names[kind], &drawn, kind < 5 ? ALIKE : ALIKE_JOINTS);
    }
    tl_transfer_destroy(ctx, t);
    release_springs(&springs);
    check_ctx_destroy(ctx);
}

static void points_as_by_the_processor(void **state)
{
    (void)state;
    static const char *const names[] = {"spheres", "discs", "large spheres, fewer far away",
                                        "translucent discs, values"};
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    enum { POINTS = 1500 };
    uint64_t seed = 4;
    double xyz[3 * POINTS], values[POINTS];
    float normals[3 * POINTS];
    for (size_t i = 0; i < POINTS; i++) {
        double away = 0;
        for (size_t k = 0; k < 3; k++) {
            double d = make_uniform(&seed) - 0.5;
            xyz[3 * i + k] = 0.5 + d;
            normals[3 * i + k] = (float)d;
            away += d * d;
        }
        for (size_t k = 0; k < 3; k++) normals[3 * i + k] /= (float)sqrt(away);
        values[i] = sqrt(away);
    }
    xyz[30] = (double)INFINITY;
    tl_polydata points = {
        .kind = TL_POLY_POINTS, .vert_count = POINTS, .cell_count = POINTS, .xyz = xyz};
    tl_transfer *t = colored(ctx, false);
    for (int kind = 0; kind < 4; kind++) {
        tl_point_opts opts = tl_point_opts_defaults();
        tl_look look = tl_look_defaults();
        scene drawn = {.points = &points, .point_opts = &opts, .look = &look};
        opts.radius_px = 4;
        points.normals = kind & 1 ? normals : NULL;
        if (kind == 2) opts.radius = 0.02;
        opts.scale_depth = kind == 2;
        if (kind == 3) {
            look.opacity = 0.5;
            look.scalar = values;
            look.transfer = t;
        }
        compare(ctx, names[kind], &drawn, ALIKE);
    }
    tl_transfer_destroy(ctx, t);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slices_have_their_silhouette),
        cmocka_unit_test(surfaces_as_by_the_processor),
        cmocka_unit_test(lines_as_by_the_processor),
        cmocka_unit_test(points_as_by_the_processor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
