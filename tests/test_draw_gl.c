/* Volumes by OpenGL against closed forms and against the processor, alone and together with
 * surfaces, projected and by rays. Skips where there is no OpenGL. */
#include "check_gl.h"

/* ---- volumes ---- */

static void volumes_as_by_rays(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    for (int kind = 0; kind < 4; kind++) {
        static const char *const names[4] = {"smooth", "sharp", "smooth, a cavity",
                                             "sharp, a cavity"};
        make_mesh m = perturbed(17, kind / 2);
        solid s = open_solid(ctx, &m, hills);
        tl_transfer *t = colored(ctx, kind & 1);
        scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
        compare(ctx, names[kind], &drawn, ALIKE);
        tl_transfer_destroy(ctx, t);
        close_solid(ctx, &s);
    }
    check_ctx_destroy(ctx);
}

static void lit_volumes_as_by_rays(void **state)
{
    (void)state;
    static const char *const names[3] = {"lit", "gradient opacity", "both, a surface inside"};
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(17, true);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, false);
    double *gradients = malloc(tl_mesh_vert_count(s.mesh) * 3 * sizeof *gradients);
    static const double center[3] = {0.6, 0.5, 0.4};
    tl_polydata sphere = make_sphere(40, center, 0.25);
    if (!gradients) abort();
    CHECK_OK(ctx, tl_mesh_gradient(ctx, s.mesh, tl_mesh_channel(s.mesh, 0), gradients));
    for (int kind = 0; kind < 3; kind++) {
        tl_volume_opts opts = tl_volume_opts_defaults();
        opts.gradients = gradients;
        opts.lit = kind != 1;
        opts.gradient_opacity = kind ? 2.5 : 0;
        scene drawn = {.mesh = s.mesh,
                       .scalar = s.scalar,
                       .volume = s.volume,
                       .transfer = t,
                       .volume_opts = &opts,
                       .opacity = 0.5};
        drawn.translucent = kind == 2 ? &sphere : NULL;
        compare(ctx, names[kind], &drawn, ALIKE);
    }
    make_triangles_release(&sphere);
    free(gradients);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* Wrong here and there where tets differ in size, which those of a grid hardly do. */
static void order_by_centroids(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(13, false);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, true);
    tl_volume_opts opts = tl_volume_opts_defaults();
    opts.order = TL_ORDER_CENTROIDS;
    scene drawn = {.mesh = s.mesh,
                   .scalar = s.scalar,
                   .volume = s.volume,
                   .transfer = t,
                   .volume_opts = &opts};
    compare(ctx, "order by centroids", &drawn, ALIKE);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* Extinction 0.2 + 3 z, white: the middle of the picture. */
static void linear_fields(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = make_grid(12);
    solid s = open_solid(ctx, &m, make_height);
    tl_transfer *t = make_fog(ctx, 0, 0.2, 1, 3.2);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
    for (int look = 0; look < 4; look++) { /* parallel and not, outside and half way inside */
        tl_camera camera = make_camera(look & 1);
        if (look & 2) camera.position[2] = 0.4999;
        tl_image *image = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
        const float *c = picture_middle(image);
        CHECK_NEAR((double)c[3], -expm1(look & 2 ? -1.225 : -1.7), 3e-4);
        CHECK_NEAR((double)c[0], (double)c[3], 1e-5);
        if (look == 1) CHECK(image->rgba[3] == 0); /* the corner sees nothing */
        tl_image_destroy(ctx, image);
    }
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

static void fog_has_its_depth(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = make_grid(9);
    solid s = open_solid(ctx, &m, make_quarter);
    for (double extinction = 0.01; extinction < 20; extinction *= 3) {
        tl_transfer *t = make_fog(ctx, 0, extinction, 1, extinction);
        scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
        tl_camera camera = make_camera(true);
        tl_image *image = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
        CHECK_NEAR((double)picture_middle(image)[3], -expm1(-extinction), 3e-5);
        tl_image_destroy(ctx, image);
        tl_transfer_destroy(ctx, t);
    }
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* A picture that holds something: in front of it, and cut off at its depth. */
static void pictures_keep_what_they_hold(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = make_grid(9);
    solid s = open_solid(ctx, &m, make_height);
    tl_transfer *t = make_fog(ctx, 0, 0.2, 1, 3.2);
    tl_polydata sphere = make_sphere(40, CENTER, 0.3);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
    drawn.opaque = &sphere;
    tl_camera camera = make_camera(true);
    tl_image *images[2];
    for (int kind = 0; kind < 2; kind++) {
        tl_renderer *r = open_renderer(ctx, kind ? TL_RENDERER_GL : TL_RENDERER_CPU);
        CHECK_OK(ctx, tl_image_create(ctx, MAKE_SIDE, MAKE_SIDE, &images[kind]));
        for (size_t p = 0; p < MAKE_SIDE * MAKE_SIDE; p++) {
            images[kind]->depth[p] = p % MAKE_SIDE < 16 ? 2.3F : INFINITY;
            images[kind]->rgba[4 * p] = images[kind]->rgba[4 * p + 3] = 0.5F;
        }
        fill(ctx, r, &drawn);
        CHECK_OK(ctx, tl_renderer_draw(ctx, r, &camera, images[kind]));
        tl_renderer_destroy(ctx, r);
    }
    CHECK(psnr(images[0], images[1]) >= ALIKE);
    CHECK(depths_apart(images[0], images[1]) <= 4);
    tl_image_destroy(ctx, images[0]);
    tl_image_destroy(ctx, images[1]);
    make_triangles_release(&sphere);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

static void values_that_are_none(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(13, true);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, false);
    size_t count = tl_mesh_vert_count(s.mesh);
    double *scalar = malloc(count * sizeof *scalar);
    if (!scalar) abort();
    for (size_t v = 0; v < count; v++) scalar[v] = v % 61 ? s.scalar[v] : (double)NAN;
    scene drawn = {.mesh = s.mesh, .scalar = scalar, .volume = s.volume, .transfer = t};
    compare(ctx, "values that are NaN", &drawn, ALIKE);
    free(scalar);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* Places that are none, tets that are no manifold and lie inside out: a picture comes out all the
 * same. */
static void hostile_meshes(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    tl_transfer *t = make_fog(ctx, 0, 1, 1, 1);
    for (uint64_t seed = 0; seed < 8; seed++) {
        make_mesh m = make_soup(20 + 5 * seed, 300, seed);
        if (seed & 1) m.xyz[5] = (double)NAN;
        if (seed & 1) m.xyz[9] = (double)INFINITY;
        tl_camera camera = make_camera(seed & 2);
        if (seed & 4) camera.position[2] = 0.5 - 1e-3;
        solid s = open_solid(ctx, &m, make_height);
        for (int method = TL_VOLUME_PROJECTED; method <= TL_VOLUME_RAYS; method++) {
            tl_volume_opts o = tl_volume_opts_defaults();
            scene drawn = {.scalar = s.scalar, .volume = s.volume, .transfer = t};
            o.method = (tl_volume_method)method;
            drawn.volume_opts = &o;
            if (method == TL_VOLUME_RAYS && !has_rays(ctx, &drawn)) continue;
            tl_image *image = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
            for (size_t i = 0; i < (size_t)MAKE_SIDE * MAKE_SIDE * 4; i++)
                CHECK(image->rgba[i] >= 0 && image->rgba[i] <= 1.001F);
            tl_image_destroy(ctx, image);
        }
        close_solid(ctx, &s);
    }
    tl_transfer_destroy(ctx, t);
    check_ctx_destroy(ctx);
}

static void count_warnings(void *user, tl_log_level level, const char *text)
{
    if (level <= TL_LOG_WARNING && strstr(text, "went in circles")) ++*(int *)user;
}

/* Two tets in one place, each behind all faces of the other: rays that are in them end all the
 * same, which is reported. */
static void rays_in_circles(void **state)
{
    (void)state;
    static const double xyz[5][3] = {
        {.5, .4, .8}, {.1, .1, .4}, {.9, .1, .4}, {.5, .9, .4}, {.5, .4, 0}};
    static const tl_lidx tets[3][4] = {{1, 2, 3, 0}, {1, 2, 3, 0}, {1, 3, 2, 4}};
    static const tl_lidx behind[3][4] = {
        {4, 5, 6, 11}, {0, 1, 2, 3}, {TL_NONE, TL_NONE, TL_NONE, 3}};
    int warnings = 0;
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.log = count_warnings;
    opts.user = &warnings;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    make_mesh m = make_room(5, 3);
    memcpy(m.xyz, xyz, sizeof xyz);
    memcpy(m.tets, tets, sizeof tets);
    solid s = {.mesh = make_object(ctx, &m, make_height)};
    make_release(&m);
    s.scalar = tl_mesh_channel(s.mesh, 0)->values;
    CHECK_OK(ctx, tl_volume_create(ctx, s.mesh, behind[0], &s.volume));
    tl_transfer *t = make_fog(ctx, 0, 1, 1, 1);
    tl_camera camera = make_camera(true);
    scene drawn = {.scalar = s.scalar, .volume = s.volume, .transfer = t};
    tl_renderer *r = open_renderer(ctx, TL_RENDERER_GL);
    if (r && has_rays(ctx, &drawn)) {
        fill(ctx, r, &drawn);
        tl_image *image = picture_take(ctx, r, &camera);
        CHECK_EQ(warnings, 1);
        CHECK_NEAR((double)picture_middle(image)[3], -expm1(-0.7), 0.05); /* long, about */
        tl_image_destroy(ctx, image);
    }
    tl_renderer_destroy(ctx, r);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(volumes_as_by_rays),   cmocka_unit_test(lit_volumes_as_by_rays),
        cmocka_unit_test(order_by_centroids),   cmocka_unit_test(linear_fields),
        cmocka_unit_test(fog_has_its_depth),    cmocka_unit_test(pictures_keep_what_they_hold),
        cmocka_unit_test(values_that_are_none), cmocka_unit_test(hostile_meshes),
        cmocka_unit_test(rays_in_circles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
