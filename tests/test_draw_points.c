/* Points on the processor against closed forms: areas of discs, light on them and on spheres, what
 * hides what, how many are left at a distance; points that are none; the same picture for any
 * number of threads. */
#include "check.h"

#include "tetralod/draw.h"

#include "check_ctx.h"
#include "check_picture.h"
#include "fail_alloc.h"
#include "make_mesh.h"
#include "make_scene.h"

enum { SIDE = 257 };

/* Room for points; plain malloc. */
static tl_polydata make_points(size_t count, bool normals)
{
    tl_polydata p = {.kind = TL_POLY_POINTS, .vert_count = count, .cell_count = count};
    p.xyz = calloc(count + 1, 3 * sizeof *p.xyz);
    if (normals) p.normals = calloc(count + 1, 3 * sizeof *p.normals);
    if (!p.xyz || (normals && !p.normals)) abort();
    return p;
}

static void release_points(tl_polydata *p)
{
    free(p->normals);
    free(p->xyz);
}

static tl_camera camera_of(bool parallel)
{
    tl_camera camera = make_camera(parallel);
    camera.size_px[0] = camera.size_px[1] = SIDE;
    return camera;
}

static tl_image *draw_points(tl_ctx *ctx, const tl_polydata *p, const tl_look *look,
                             const tl_point_opts *opts, const tl_camera *camera)
{
    tl_renderer *r = picture_renderer(ctx);
    CHECK_OK(ctx, tl_renderer_add_points(ctx, r, p, look, opts, NULL));
    return picture_of(ctx, r, camera);
}

/* ---- single points ---- */

/* In pixels, and in mesh units from both kinds of camera. */
static void discs_have_their_area(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    const double pi = acos(-1);
    tl_polydata p = make_points(1, true);
    p.xyz[0] = p.xyz[1] = p.xyz[2] = 0.5;
    for (int parallel = 0; parallel < 2; parallel++) {
        tl_camera camera = camera_of(parallel);
        tl_point_opts opts = tl_point_opts_defaults();
        for (opts.radius_px = 1; opts.radius_px < 90; opts.radius_px *= 3) {
            tl_image *image = draw_points(ctx, &p, NULL, &opts, &camera);
            double area = pi * opts.radius_px * opts.radius_px;
            CHECK_NEAR(picture_covered(image) / area, 1, 0.1 / opts.radius_px);
            tl_image_destroy(ctx, image);
        }
        opts.radius = 0.2;
        tl_image *image = draw_points(ctx, &p, NULL, &opts, &camera);
        double radius = parallel ? SIDE / 1.2 * 0.2 : SIDE / (2 * tan(pi / 12)) * 0.2 / 2.5;
        CHECK_NEAR(picture_covered(image) / (pi * radius * radius), 1, 2e-3);
        tl_image_destroy(ctx, image);
    }
    release_points(&p);
    check_ctx_destroy(ctx);
}

static void light_on_points(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_camera camera = camera_of(true);
    tl_look look = tl_look_defaults();
    tl_point_opts opts = tl_point_opts_defaults();
    tl_polydata p = make_points(1, true);
    p.xyz[0] = p.xyz[1] = p.xyz[2] = 0.5;
    opts.radius = 0.3;
    for (int turned = 0; turned < 4; turned++) { /* to the camera, away, aside, no normal */
        static const float normals[4][3] = {{0, 0, -1}, {0, 0.6F, 0.8F}, {1, 0, 0}, {0, 0, 0}};
        static const double cosines[4] = {1, 0.8, 0, 1};
        memcpy(p.normals, normals[turned], sizeof normals[0]);
        tl_image *image = draw_points(ctx, &p, &look, &opts, &camera);
        double expected = look.rgb[0] * (look.ambient + look.diffuse * cosines[turned]) +
                          look.specular * pow(cosines[turned], look.shininess);
        for (size_t x = SIDE / 2 - 50; x <= SIDE / 2 + 50; x += 50)
            CHECK_NEAR((double)picture_pixel(image, x, SIDE / 2)[0], fmin(expected, 1), 1e-5);
        CHECK_NEAR((double)image->depth[SIDE / 2 * SIDE + SIDE / 2], 2.5, 1e-6);
        tl_image_destroy(ctx, image);
    }
    free(p.normals); /* a sphere: half way to its edge the normal is at 30 degrees */
    p.normals = NULL;
    tl_image *image = draw_points(ctx, &p, &look, &opts, &camera);
    double cosine = sqrt(0.75), half = SIDE / 1.2 * 0.15;
    size_t x = SIDE / 2 + (size_t)(half + 0.5);
    CHECK_NEAR((double)picture_pixel(image, x, SIDE / 2)[0],
               look.rgb[0] * (look.ambient + look.diffuse * cosine) +
                   look.specular * pow(cosine, look.shininess),
               0.02);
    CHECK_NEAR((double)image->depth[SIDE / 2 * SIDE + SIDE / 2], 2.5 - 0.3, 1e-4);
    CHECK_NEAR((double)image->depth[SIDE / 2 * SIDE + x], 2.5 - 0.3 * cosine, 2e-3);
    tl_image_destroy(ctx, image);
    release_points(&p);
    check_ctx_destroy(ctx);
}

/* Two spheres at one depth meet in the middle; a farther disc is behind; what shines through. */
static void nearer_points_hide(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    static const tl_color_point colors[2] = {{0, {1, 0, 0}}, {1, {0, 0, 1}}};
    static const tl_opacity_point opaque = {0, 1};
    const double scalar[2] = {0, 1};
    tl_camera camera = camera_of(true);
    tl_transfer *transfer = NULL;
    CHECK_OK(ctx, tl_transfer_create(ctx, colors, 2, &opaque, 1, 1, &transfer));
    tl_look look = tl_look_defaults();
    look.scalar = scalar;
    look.transfer = transfer;
    look.lit = false;
    tl_point_opts opts = tl_point_opts_defaults();
    opts.radius = 0.25;
    tl_polydata p = make_points(2, false);
    for (int k = 0; k < 6; k++) p.xyz[k] = 0.5;
    p.xyz[0] = 0.4;
    p.xyz[3] = 0.6;
    tl_image *image = draw_points(ctx, &p, &look, &opts, &camera);
    for (size_t y = SIDE / 2 - 30; y < SIDE / 2 + 30; y++) {
        /* looking along z with y up, x grows to the left */
        CHECK(picture_pixel(image, SIDE / 2 - 3, y)[0] < 0.1F &&
              picture_pixel(image, SIDE / 2 - 3, y)[2] > 0.9F);
        CHECK(picture_pixel(image, SIDE / 2 + 3, y)[0] > 0.9F &&
              picture_pixel(image, SIDE / 2 + 3, y)[2] < 0.1F);
    }
    tl_image_destroy(ctx, image);
    p.xyz[3] = p.xyz[0] = 0.5;
    p.xyz[5] = 0.9; /* behind the first, as large */
    for (int through = 0; through < 2; through++) {
        look.opacity = through ? 0.5 : 1;
        image = draw_points(ctx, &p, &look, &opts, &camera);
        const float *middle = picture_pixel(image, SIDE / 2, SIDE / 2);
        CHECK_NEAR((double)middle[0], through ? 0.5 : 1, 1e-5);
        CHECK_NEAR((double)middle[2], through ? 0.25 : 0, 1e-5);
        CHECK_NEAR((double)middle[3], through ? 0.75 : 1, 1e-5);
        tl_image_destroy(ctx, image);
    }
    tl_transfer_destroy(ctx, transfer);
    release_points(&p);
    check_ctx_destroy(ctx);
}

/* ---- many points ---- */

/* Points side by side on the picture, at one distance and at twice that: all of the near ones stay,
 * a quarter of the far ones, and a tenth of those that are very far. */
static void fewer_at_a_distance(void **state)
{
    (void)state;
    enum { ROW = 60, COUNT = ROW * ROW };
    tl_ctx *ctx = check_ctx_create(2);
    tl_camera camera = camera_of(false);
    tl_look look = tl_look_defaults();
    tl_point_opts opts = tl_point_opts_defaults();
    look.lit = false;
    opts.radius_px = 1;
    opts.scale_depth = true;
    tl_polydata p = make_points(2 * COUNT, false);
    static const double distances[3] = {1, 2, 6}, shares[3] = {1, 0.25, 0.1};
    tl_polydata one = make_points(1, false);
    one.xyz[0] = one.xyz[1] = 0.5;
    tl_image *image = draw_points(ctx, &one, &look, &opts, &camera);
    double single = picture_covered(image);
    tl_image_destroy(ctx, image);
    for (int far = 0; far < 3; far++) {
        for (size_t i = 0; i < 2 * COUNT; i++) {
            double z = i < COUNT ? 1 : distances[far], step = 2 * tan(acos(-1) / 12) / 64 * z;
            double column = (double)(i % ROW) - ROW / 2 + 0.5;
            double row = (double)(i / ROW % ROW) - ROW / 2 + 0.5;
            /* the first half is put beside the picture, but for the one that is nearest */
            p.xyz[3 * i] = 0.5 + (i && i < COUNT ? 50 : column * step);
            p.xyz[3 * i + 1] = 0.5 + row * step;
            p.xyz[3 * i + 2] = z - 2;
        }
        image = draw_points(ctx, &p, &look, &opts, &camera);
        double count = picture_covered(image) / single;
        CHECK_NEAR(count, shares[far] * COUNT, far ? 5 * sqrt(shares[far] * COUNT) : 0.02 * COUNT);
        tl_image_destroy(ctx, image);
    }
    release_points(&one);
    release_points(&p);
    check_ctx_destroy(ctx);
}

static tl_polydata make_cloud(bool normals)
{
    uint64_t seed = 3;
    tl_polydata p = make_points(4000, normals);
    for (size_t i = 0; i < 3 * p.vert_count; i++) {
        p.xyz[i] = make_uniform(&seed);
        if (normals) p.normals[i] = (float)(p.xyz[i] - 0.5);
    }
    return p;
}

static void threads_change_nothing(void **state)
{
    (void)state;
    tl_polydata p = make_cloud(true);
    tl_camera camera = camera_of(false);
    tl_point_opts opts = tl_point_opts_defaults();
    tl_look look = tl_look_defaults();
    look.opacity = 0.7;
    opts.scale_depth = true;
    tl_ctx *ctx = check_ctx_create(1);
    tl_image *first = draw_points(ctx, &p, &look, &opts, &camera);
    CHECK(picture_covered(first) > 1000);
    for (unsigned threads = 2; threads <= 3; threads++) {
        tl_ctx *own = check_ctx_create(threads);
        tl_image *image = draw_points(own, &p, &look, &opts, &camera);
        CHECK(picture_same(first, image));
        tl_image_destroy(own, image);
        check_ctx_destroy(own);
    }
    tl_image_destroy(ctx, first);
    release_points(&p);
    check_ctx_destroy(ctx);
}

/* Places that are none, behind the camera, at it, far away; radii of all sizes. */
static void points_that_are_not_seen(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_polydata p = make_points(6, true);
    static const double places[6][3] = {{0.5, 0.5, -3},     {0.5, 0.5, -2},     {NAN, 0.5, 0},
                                        {0.5, INFINITY, 0}, {1e300, -1e300, 1}, {50, 0.5, 0}};
    memcpy(p.xyz, places, sizeof places);
    p.normals[7] = NAN;
    for (int parallel = 0; parallel < 2; parallel++)
        for (double radius = 1e-300; radius < 1; radius = radius < 1e-10 ? 1e-10 : radius * 1e5) {
            tl_camera camera = camera_of(parallel);
            tl_point_opts opts = tl_point_opts_defaults();
            opts.radius = radius;
            opts.scale_depth = true;
            tl_image *image = draw_points(ctx, &p, NULL, &opts, &camera);
            CHECK(picture_covered(image) == 0);
            tl_image_destroy(ctx, image);
        }
    memcpy(p.xyz, p.xyz + 15, 3 * sizeof *p.xyz); /* so large that it fills the picture */
    tl_point_opts opts = tl_point_opts_defaults();
    tl_camera camera = camera_of(false);
    opts.radius = 1e6;
    tl_image *image = draw_points(ctx, &p, NULL, &opts, &camera);
    CHECK(picture_covered(image) == SIDE * SIDE);
    tl_image_destroy(ctx, image);
    release_points(&p);
    check_ctx_destroy(ctx);
}

static tl_status draw_cloud(tl_ctx *ctx, void *arg)
{
    tl_renderer *r = NULL;
    tl_camera camera = camera_of(false);
    tl_point_opts opts = tl_point_opts_defaults();
    opts.scale_depth = true;
    tl_status st = tl_renderer_create(ctx, TL_RENDERER_CPU, &r);
    if (!st) st = tl_renderer_add_points(ctx, r, arg, NULL, &opts, NULL);
    if (!st) st = picture_try(ctx, r, &camera);
    tl_renderer_destroy(ctx, r);
    return st;
}

static void failing_memory_leaks_nothing(void **state)
{
    (void)state;
    fail_alloc f;
    tl_polydata p = make_cloud(false);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, draw_cloud, &p) > 8);
    fail_alloc_close(&f);
    release_points(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(discs_have_their_area),        cmocka_unit_test(light_on_points),
        cmocka_unit_test(nearer_points_hide),           cmocka_unit_test(fewer_at_a_distance),
        cmocka_unit_test(threads_change_nothing),       cmocka_unit_test(points_that_are_not_seen),
        cmocka_unit_test(failing_memory_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
