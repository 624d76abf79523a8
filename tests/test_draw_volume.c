/* Volume rendering against closed forms: fog of a known depth, a linear field, cavities, an end of
 * rays, a camera inside; the same picture for any kernel and any number of threads. */
#include "check.h"

#include "draw/draw_layers.h"

#include "check_ctx.h"
#include "check_picture.h"
#include "make_mesh.h"
#include "make_scene.h"

static tl_image *draw_with(tl_ctx *ctx, const make_mesh *m, make_field field,
                           const tl_transfer *transfer, const tl_camera *camera, float depth,
                           tl_volume_opts opts)
{
    tl_volume *volume = NULL;
    tl_image *image = NULL;
    opts.opacity_end = 1;
    tl_mesh *mesh = make_object(ctx, m, field);
    CHECK_OK(ctx, tl_volume_create(ctx, mesh, NULL, &volume));
    CHECK_OK(ctx, tl_image_create(ctx, MAKE_SIDE, MAKE_SIDE, &image));
    for (size_t p = 0; p < MAKE_SIDE * MAKE_SIDE; p++) image->depth[p] = depth;
    CHECK_OK(ctx, tl_draw_volume(ctx, volume, tl_mesh_channel(mesh, 0)->values, transfer, camera,
                                 &opts, image));
    tl_volume_destroy(ctx, volume);
    tl_mesh_destroy(mesh);
    return image;
}

static tl_image *draw(tl_ctx *ctx, const make_mesh *m, make_field field,
                      const tl_transfer *transfer, const tl_camera *camera, float depth)
{
    return draw_with(ctx, m, field, transfer, camera, depth, tl_volume_opts_defaults());
}

static double middle(const tl_image *image)
{
    const float *c = picture_middle(image);
    CHECK_NEAR((double)c[0], (double)c[3], 1e-6); /* white, times opacity */
    return (double)c[3];
}

static void fog_has_its_depth(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(9);
    make_shuffle(&m, 3);
    for (int parallel = 0; parallel < 2; parallel++) {
        tl_camera camera = make_camera(parallel);
        for (double extinction = 0.01; extinction < 20; extinction *= 3) {
            tl_transfer *t = make_fog(ctx, 0, extinction, 1, extinction);
            tl_image *image = draw(ctx, &m, make_quarter, t, &camera, INFINITY);
            CHECK_NEAR(middle(image), -expm1(-extinction), 3e-5);
            CHECK(image->rgba[3] == 0); /* the corner sees nothing */
            tl_image_destroy(ctx, image);
            tl_transfer_destroy(ctx, t);
        }
    }
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Extinction 0.2 + 3 z: its integral through the cube is 1.7. */
static void linear_fields_are_exact(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(12);
    make_perturb(&m, 0.002, 5);
    for (size_t v = 0; v < m.vert_count; v++) /* the sides stay where they are */
        for (int k = 0; k < 3; k++)
            m.xyz[3 * v + (size_t)k] = fmin(fmax(m.xyz[3 * v + (size_t)k], 0), 1);
    tl_camera camera = make_camera(true);
    tl_transfer *t = make_fog(ctx, 0, 0.2, 1, 3.2);
    tl_image *image = draw(ctx, &m, make_height, t, &camera, INFINITY);
    CHECK_NEAR(middle(image), -expm1(-1.7), 2e-3 * 1.7); /* the sides moved inwards by 0.002 */
    tl_image_destroy(ctx, image);
    make_release(&m);
    m = make_grid(12);
    image = draw(ctx, &m, make_height, t, &camera, INFINITY);
    CHECK_NEAR(middle(image), -expm1(-1.7), 3e-5);
    tl_image_destroy(ctx, image);
    /* half way: 0.2 / 2 + 3 / 8 */
    image = draw(ctx, &m, make_height, t, &camera, 2.5F);
    CHECK_NEAR(middle(image), -expm1(-0.475), 3e-5);
    tl_image_destroy(ctx, image);
    /* from inside, at half way: the rest */
    camera.position[2] = 0.5;
    camera.focal_point[2] = 1;
    image = draw(ctx, &m, make_height, t, &camera, INFINITY);
    CHECK_NEAR(middle(image), -expm1(-1.225), 3e-5);
    camera.parallel_scale = 0;
    tl_image_destroy(ctx, image);
    image = draw(ctx, &m, make_height, t, &camera, INFINITY);
    CHECK_NEAR(middle(image), -expm1(-1.225), 3e-5);
    CHECK(image->rgba[3] > 0); /* fog all around */
    tl_image_destroy(ctx, image);
    tl_transfer_destroy(ctx, t);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Rays go out into a cavity and come in again. */
static void cavities_are_empty(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh full = make_grid(10), hollow = make_grid_cavity(10);
    tl_camera camera = make_camera(true);
    camera.parallel_scale = MAKE_SIDE / (2.0 * (MAKE_SIDE - 2)); /* the cube covers whole pixels */
    tl_transfer *t = make_fog(ctx, 0, 1, 1, 1);
    tl_image *a = draw(ctx, &full, make_quarter, t, &camera, INFINITY);
    tl_image *b = draw(ctx, &hollow, make_quarter, t, &camera, INFINITY);
    double volumes[2] = {0}, depths[2] = {0};
    const make_mesh *meshes[2] = {&full, &hollow};
    const tl_image *images[2] = {a, b};
    double pixel = 1.0 / (MAKE_SIDE - 2);
    for (int i = 0; i < 2; i++) {
        for (size_t k = 0; k < meshes[i]->tet_count; k++) {
            double p[4][3];
            for (int c = 0; c < 4; c++)
                memcpy(p[c], meshes[i]->xyz + 3 * (size_t)meshes[i]->tets[4 * k + (size_t)c],
                       sizeof p[c]);
            volumes[i] += tl_tet_volume((const double(*)[3])p);
        }
        for (size_t k = 0; k < MAKE_SIDE * MAKE_SIDE; k++)
            depths[i] -= log1p(-(double)images[i]->rgba[4 * k + 3]) * pixel * pixel;
    }
    CHECK(volumes[1] < volumes[0]);
    /* optical depths add up to the volume, but for pixels that the side of the cavity cuts */
    CHECK_NEAR(depths[0], volumes[0], 3e-5);
    CHECK_NEAR(depths[0] - depths[1], volumes[0] - volumes[1], 0.2 * (volumes[0] - volumes[1]));
    tl_image_destroy(ctx, b);
    tl_image_destroy(ctx, a);
    tl_transfer_destroy(ctx, t);
    make_release(&hollow);
    make_release(&full);
    check_ctx_destroy(ctx);
}

static void same_for_all_threads(void **state)
{
    (void)state;
    make_mesh m = make_grid(14);
    make_perturb(&m, 0.004, 9);
    tl_camera camera = make_camera(false);
    camera.position[0] = 2;
    camera.position[1] = -1;
    tl_image *first = NULL;
    tl_ctx *one = check_ctx_create(1);
    for (unsigned threads = 1; threads <= 4; threads++) {
        tl_ctx *ctx = check_ctx_create(threads);
        tl_transfer *t = make_fog(ctx, 0, 0, 1, 8);
        tl_image *image = draw(ctx, &m, make_height, t, &camera, INFINITY);
        if (!first) first = draw(one, &m, make_height, t, &camera, INFINITY);
        CHECK(picture_same(first, image));
        tl_image_destroy(ctx, image);
        tl_transfer_destroy(ctx, t);
        check_ctx_destroy(ctx);
    }
    tl_image_destroy(one, first);
    check_ctx_destroy(one);
    make_release(&m);
}

/* White fog in a cube of a size, a power of two. */
static tl_image *draw_cube(tl_ctx *ctx, double size, bool parallel)
{
    static const tl_color_point white = {0, {1, 1, 1}};
    static const tl_opacity_point opacities[] = {{0, 0.1}, {1, 0.9}};
    make_mesh m = make_grid(9);
    tl_camera camera = make_camera(parallel);
    tl_transfer *t = NULL;
    double *values = malloc(m.vert_count * sizeof *values);
    tl_volume *volume = NULL;
    tl_image *image = NULL;
    tl_mesh *mesh = NULL;
    for (size_t v = 0; v < m.vert_count; v++) values[v] = m.xyz[3 * v + 2];
    for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] *= size;
    for (int k = 0; k < 3; k++) camera.position[k] *= size;
    for (int k = 0; k < 3; k++) camera.focal_point[k] *= size;
    camera.parallel_scale *= size;
    CHECK_OK(ctx, tl_transfer_create(ctx, &white, 1, opacities, 2, size, &t));
    CHECK_OK(ctx, tl_mesh_create(ctx, m.xyz, m.vert_count, m.tets, m.tet_count, &mesh));
    CHECK_OK(ctx, tl_volume_create(ctx, mesh, NULL, &volume));
    CHECK_OK(ctx, tl_image_create(ctx, MAKE_SIDE, MAKE_SIDE, &image));
    for (size_t p = 0; p < MAKE_SIDE * MAKE_SIDE; p++) image->depth[p] = (float)(2.7 * size);
    CHECK_OK(ctx, tl_draw_volume(ctx, volume, values, t, &camera, NULL, image));
    tl_volume_destroy(ctx, volume);
    tl_mesh_destroy(mesh);
    tl_transfer_destroy(ctx, t);
    free(values);
    make_release(&m);
    return image;
}

/* White fog in low, middle or high values of the height; what is clear is passed over, with the
 * rest of the table as it is. */
static void clear_values_change_nothing(void **state)
{
    (void)state;
    static const double peaks[][4] = {{0.3, 0.4, 0.6, 0.7}, {-1, -0.5, 0.2, 0.4}, {0.5, 0.8, 3, 4}};
    static const tl_color_point white = {0, {1, 1, 1}};
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(14);
    tl_camera camera = make_camera(true);
    make_shuffle(&m, 11);
    for (int i = 0; i < 3; i++) {
        const double *p = peaks[i], top = -expm1(-3);
        tl_opacity_point o[6] = {{p[0], 0}, {p[1], top}, {p[2], top}, {p[3], 0}};
        tl_transfer *t = NULL;
        CHECK_OK(ctx, tl_transfer_create(ctx, &white, 1, o, 4, 1, &t));
        double sum = 0, step = 1e-4;
        for (double at = step / 2; at < 1; at += step) {
            float rgb[3];
            double extinction;
            tl_transfer_at(t, at, rgb, &extinction);
            sum += step * extinction;
        }
        tl_image *image = draw(ctx, &m, make_height, t, &camera, INFINITY);
        CHECK_NEAR(middle(image), -expm1(-sum), 1e-4);
        tl_image_destroy(ctx, image);
        tl_transfer_destroy(ctx, t);
    }
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* The kernel for any processor, and the one for this. */
static void same_for_all_kernels(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(14);
    make_perturb(&m, 0.004, 9);
    tl_mesh *mesh = make_object(ctx, &m, make_height);
    tl_camera camera = make_camera(false);
    tl_transfer *t = make_fog(ctx, 0.2, 0, 0.9, 30);
    tli_item item = {.scalar = tl_mesh_channel(mesh, 0)->values, .transfer = t};
    const tli_cast_fn kernels[2] = {tli_cast_base, tli_cast_best()};
    tli_tile tiles[2];
    tl_image *image = NULL;
    tl_volume *volume = NULL;
    tli_volume_view view;
    tli_frame frame;
    CHECK_OK(ctx, tl_volume_create(ctx, mesh, NULL, &volume));
    CHECK_OK(ctx, tli_volume_opts_take(ctx, NULL, &item.volume_opts));
    item.volume = volume;
    CHECK_OK(ctx, tl_image_create(ctx, MAKE_SIDE, MAKE_SIDE, &image));
    CHECK_OK(ctx, tli_frame_set(ctx, &camera, image, &frame));
    for (int lit = 0; lit < 2; lit++) {
        item.volume_opts.lit = lit;
        item.volume_opts.gradients = m.xyz; /* some directions */
        CHECK_OK(ctx, tli_volume_view_open(ctx, &item, &frame, image, &view));
        for (int i = 0; i < 2; i++) {
            tiles[i] = (tli_tile){.ctx = ctx, .frame = &frame};
            tli_tile_load(&tiles[i], image, 0, 0);
            CHECK_OK(ctx, tli_tile_sort(&tiles[i]));
            view.follow = kernels[i];
            CHECK_OK(ctx, tli_volume_view_draw(&view, 0, &tiles[i]));
            tl_mem_free(ctx, tiles[i].hits);
        }
        CHECK(tiles[0].rgba[TLI_TILE_PIXELS - 1][3] > 0);
        CHECK(memcmp(tiles[0].rgba, tiles[1].rgba, sizeof tiles[0].rgba) == 0);
        tli_volume_view_close(ctx, &view);
    }
    tl_image_destroy(ctx, image);
    tl_volume_destroy(ctx, volume);
    tl_transfer_destroy(ctx, t);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Gradients at an angle to the view: the closed form of light on white fog, and of opacity. */
static void light_on_fog(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(9);
    make_shuffle(&m, 2);
    tl_transfer *t = make_fog(ctx, 0, 1.5, 1, 1.5);
    double *gradients = malloc(3 * m.vert_count * sizeof *gradients);
    for (int turn = 0; turn < 4; turn++)
        for (int parallel = 0; parallel < 2; parallel++) {
            double angle = turn * 0.4, cosine = fabs(cos(angle));
            tl_camera camera = make_camera(parallel);
            tl_volume_opts opts = tl_volume_opts_defaults();
            for (size_t v = 0; v < m.vert_count; v++) {
                gradients[3 * v] = 1e-20 * sin(angle);
                gradients[3 * v + 1] = 0;
                gradients[3 * v + 2] = -1e-20 * cos(angle);
            }
            opts.gradients = gradients;
            opts.lit = true;
            opts.specular = 0.1;
            opts.shininess = 5;
            double expected = opts.ambient + opts.diffuse * cosine + 0.1 * pow(cosine, 5);
            tl_image *image = draw_with(ctx, &m, make_height, t, &camera, INFINITY, opts);
            const float *c = picture_middle(image);
            CHECK_NEAR((double)c[3], -expm1(-1.5), 3e-5);
            CHECK_NEAR((double)c[0] / (double)c[3], fmin(expected, 1), 3e-4);
            tl_image_destroy(ctx, image);
            /* a third of the extinction */
            opts.lit = false;
            opts.gradient_opacity = 3e-20;
            image = draw_with(ctx, &m, make_height, t, &camera, INFINITY, opts);
            CHECK_NEAR(middle(image), -expm1(-0.5), 3e-5);
            tl_image_destroy(ctx, image);
            opts.gradient_opacity = 1e-21; /* full */
            image = draw_with(ctx, &m, make_height, t, &camera, INFINITY, opts);
            CHECK_NEAR(middle(image), -expm1(-1.5), 3e-5);
            tl_image_destroy(ctx, image);
        }
    free(gradients);
    tl_transfer_destroy(ctx, t);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Nothing is seen there. */
static void gradients_that_are_none(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(9);
    tl_transfer *t = make_fog(ctx, 0, 1.5, 1, 1.5);
    double *gradients = malloc(3 * m.vert_count * sizeof *gradients);
    if (!gradients) abort();
    for (size_t i = 0; i < 3 * m.vert_count; i++) gradients[i] = (double)(i % 2 ? NAN : INFINITY);
    tl_camera camera = make_camera(false);
    tl_volume_opts opts = tl_volume_opts_defaults();
    opts.gradients = gradients;
    opts.lit = true;
    opts.gradient_opacity = 1;
    tl_image *image = draw_with(ctx, &m, make_height, t, &camera, INFINITY, opts);
    for (size_t i = 0; i < (size_t)MAKE_SIDE * MAKE_SIDE * 4; i++) CHECK(image->rgba[i] == 0);
    tl_image_destroy(ctx, image);
    free(gradients);
    tl_transfer_destroy(ctx, t);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* From nanometres to galaxies: products of two lengths leave the range of float32. */
static void meshes_of_any_size(void **state)
{
    (void)state;
    static const double sizes[] = {0x1p-80, 0x1p-30, 0x1p40, 0x1p80};
    tl_ctx *ctx = check_ctx_create(2);
    for (int parallel = 0; parallel < 2; parallel++) {
        tl_image *unit = draw_cube(ctx, 1, parallel);
        CHECK(middle(unit) > 0.1);
        for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
            tl_image *image = draw_cube(ctx, sizes[i], parallel);
            CHECK(memcmp(image->rgba, unit->rgba, sizeof(float) * 4 * MAKE_SIDE * MAKE_SIDE) == 0);
            tl_image_destroy(ctx, image);
        }
        tl_image_destroy(ctx, unit);
    }
    check_ctx_destroy(ctx);
}

static void empty_meshes_show_nothing(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_room(3, 0);
    tl_camera camera = make_camera(false);
    tl_transfer *t = make_fog(ctx, 0, 1, 1, 1);
    tl_image *image = draw(ctx, &m, make_height, t, &camera, INFINITY);
    for (size_t i = 0; i < (size_t)MAKE_SIDE * MAKE_SIDE * 4; i++) CHECK(image->rgba[i] == 0);
    tl_image_destroy(ctx, image);
    tl_transfer_destroy(ctx, t);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Values and places that are none, tets that are no manifold: a picture comes out all the same. */
static void hostile_meshes(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_soup(40, 300, 4);
    m.xyz[5] = (double)NAN;
    m.xyz[9] = (double)INFINITY;
    tl_camera camera = make_camera(false);
    tl_transfer *t = make_fog(ctx, 0, 1, 1, 1);
    tl_image *image = draw(ctx, &m, make_height, t, &camera, INFINITY);
    for (size_t i = 0; i < (size_t)MAKE_SIDE * MAKE_SIDE * 4; i++) CHECK(image->rgba[i] >= 0);
    tl_image_destroy(ctx, image);
    camera.size_px[0] = 7;
    tl_mesh *mesh = make_object(ctx, &m, make_height);
    tl_volume *volume = NULL;
    CHECK_OK(ctx, tl_volume_create(ctx, mesh, NULL, &volume));
    CHECK_OK(ctx, tl_image_create(ctx, MAKE_SIDE, MAKE_SIDE, &image));
    CHECK_STATUS(tl_draw_volume(ctx, volume, m.xyz, t, &camera, NULL, image), TL_ERR_ARG);
    tl_image_destroy(ctx, image);
    CHECK_STATUS(tl_image_create(ctx, 0, 5, &image), TL_ERR_ARG);
    tl_volume_destroy(ctx, volume);
    tl_mesh_destroy(mesh);
    tl_transfer_destroy(ctx, t);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void transfer_functions(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_transfer *t = NULL;
    float rgb[3];
    double extinction;
    static const tl_color_point colors[2] = {{1, {0, 0.5, 1}}, {3, {1, 0.5, 0}}};
    static const tl_opacity_point opacities[3] = {{0, 0}, {2, 0.5}, {4, 0}};
    static const tl_color_point falling[2] = {{3, {0, 0, 0}}, {1, {0, 0, 0}}};
    static const tl_opacity_point heavy[1] = {{0, 1.5}};
    CHECK_OK(ctx, tl_transfer_create(ctx, colors, 2, opacities, 3, 0.5, &t));
    tl_transfer_at(t, 2, rgb, &extinction);
    CHECK_NEAR((double)rgb[0], 0.5, 1e-3);
    CHECK_NEAR(extinction, 2 * log(2), 1e-3);
    tl_transfer_at(t, -5, rgb, &extinction);
    CHECK_NEAR((double)rgb[2], 1, 1e-6);
    CHECK_NEAR(extinction, 0, 1e-6);
    tl_transfer_at(t, (double)NAN, rgb, &extinction);
    CHECK_NEAR(extinction, 0, 0);
    tl_transfer_destroy(ctx, t);
    CHECK_STATUS(tl_transfer_create(ctx, falling, 2, opacities, 3, 1, &t), TL_ERR_ARG);
    CHECK_STATUS(tl_transfer_create(ctx, colors, 2, heavy, 1, 1, &t), TL_ERR_ARG);
    CHECK_STATUS(tl_transfer_create(ctx, colors, 0, opacities, 3, 1, &t), TL_ERR_ARG);
    CHECK_STATUS(tl_transfer_create(ctx, colors, 2, opacities, 3, 0, &t), TL_ERR_ARG);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fog_has_its_depth),
        cmocka_unit_test(linear_fields_are_exact),
        cmocka_unit_test(cavities_are_empty),
        cmocka_unit_test(same_for_all_threads),
        cmocka_unit_test(hostile_meshes),
        cmocka_unit_test(transfer_functions),
        cmocka_unit_test(meshes_of_any_size),
        cmocka_unit_test(empty_meshes_show_nothing),
        cmocka_unit_test(clear_values_change_nothing),
        cmocka_unit_test(same_for_all_kernels),
        cmocka_unit_test(light_on_fog),
        cmocka_unit_test(gradients_that_are_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
