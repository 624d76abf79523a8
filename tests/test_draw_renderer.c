/* The renderer's list of things and the checks of what is added, through the back end that draws
 * nothing; back ends that are not there. */
#include "check.h"

#include "tetralod/draw.h"

#include "check_ctx.h"
#include "make_mesh.h"
#include "make_scene.h"

static tl_renderer *open_null(tl_ctx *ctx)
{
    tl_renderer *r = NULL;
    CHECK_OK(ctx, tl_renderer_create(ctx, TL_RENDERER_NULL, &r));
    return r;
}

static tl_camera camera_of(uint32_t side)
{
    tl_camera c = tl_camera_defaults();
    c.size_px[0] = c.size_px[1] = side;
    return c;
}

static void kinds_of_renderers(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_renderer *r = NULL;
    CHECK_OK(ctx, tl_renderer_create(ctx, TL_RENDERER_CPU, &r));
    assert_string_equal(tl_renderer_name(r), "cpu");
    tl_renderer_destroy(ctx, r);
    CHECK_OK(ctx, tl_renderer_create(ctx, TL_RENDERER_AUTO, &r));
    CHECK_EQ(strlen(tl_ctx_message(ctx)), 0);
    tl_renderer_destroy(ctx, r);
    r = open_null(ctx);
    assert_string_equal(tl_renderer_name(r), "null");
    tl_renderer_destroy(ctx, r);
    CHECK_STATUS(tl_renderer_create(ctx, (tl_renderer_kind)9, &r), TL_ERR_ARG);
    CHECK(r == NULL);
    tl_renderer_destroy(ctx, NULL);
    check_ctx_destroy(ctx);
}

typedef struct triangle {
    double xyz[9];
    tl_lidx corners[3];
    tl_polydata p; /* of these */
} triangle;

static void triangle_make(triangle *t)
{
    *t = (triangle){.xyz = {0, 0, 0, 1, 0, 0, 0, 1, 0}, .corners = {0, 1, 2}};
    t->p = (tl_polydata){TL_POLY_TRIANGLES, 3, t->xyz, NULL, 1, t->corners, NULL, NULL, 0};
}

static void looks_out_of_range(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_renderer *r = open_null(ctx);
    triangle one;
    triangle_make(&one);
    tl_item item = 0;
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, &one.p, NULL, &item));
    CHECK(item != 0);
    for (int wrong = 0; wrong < 6; wrong++) {
        tl_look look = tl_look_defaults();
        if (wrong == 0) look.opacity = 1.5;
        if (wrong == 1) look.rgb[1] = (double)NAN;
        if (wrong == 2) look.scalar = one.xyz;
        if (wrong == 3) look.diffuse = -1;
        if (wrong == 4) look.shininess = 0;
        if (wrong == 5) look.struct_bytes = 0;
        CHECK_STATUS(tl_renderer_add_surface(ctx, r, &one.p, &look, &item), TL_ERR_ARG);
        CHECK_EQ(item, 0);
    }
    tl_renderer_destroy(ctx, r);
    check_ctx_destroy(ctx);
}

static void polydata_that_is_none(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_renderer *r = open_null(ctx);
    triangle one;
    triangle_make(&one);
    tl_lidx beyond[3] = {0, 1, 3}, starts[2] = {0, 3}, back[3] = {0, 3, 1};
    tl_polydata triangles = one.p;
    tl_polydata lines = {TL_POLY_LINES, 3, one.xyz, NULL, 1, one.corners, starts, NULL, 0};
    tl_polydata points = {TL_POLY_POINTS, 3, one.xyz, NULL, 3, NULL, NULL, NULL, 0};
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, &triangles, NULL, NULL));
    CHECK_OK(ctx, tl_renderer_add_lines(ctx, r, &lines, NULL, NULL, NULL));
    CHECK_OK(ctx, tl_renderer_add_points(ctx, r, &points, NULL, NULL, NULL));
    CHECK_STATUS(tl_renderer_add_surface(ctx, r, &lines, NULL, NULL), TL_ERR_ARG);
    CHECK_STATUS(tl_renderer_add_lines(ctx, r, &points, NULL, NULL, NULL), TL_ERR_ARG);
    CHECK_STATUS(tl_renderer_add_points(ctx, r, &triangles, NULL, NULL, NULL), TL_ERR_ARG);
    triangles.corners = lines.corners = beyond;
    CHECK_STATUS(tl_renderer_add_surface(ctx, r, &triangles, NULL, NULL), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "corner 2 of the triangles is vertex 3 of 3"));
    CHECK_STATUS(tl_renderer_add_lines(ctx, r, &lines, NULL, NULL, NULL), TL_ERR_ARG);
    lines.corners = one.corners;
    lines.starts = back;
    lines.cell_count = 2;
    CHECK_STATUS(tl_renderer_add_lines(ctx, r, &lines, NULL, NULL, NULL), TL_ERR_ARG);
    lines.cell_count = 0;
    CHECK_OK(ctx, tl_renderer_add_lines(ctx, r, &lines, NULL, NULL, NULL));
    tl_renderer_destroy(ctx, r);
    check_ctx_destroy(ctx);
}

static void options_out_of_range(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_renderer *r = open_null(ctx);
    tl_polydata lines = {.kind = TL_POLY_LINES}, points = {.kind = TL_POLY_POINTS};
    tl_line_opts l = tl_line_opts_defaults();
    tl_point_opts p = tl_point_opts_defaults();
    CHECK_OK(ctx, tl_renderer_add_lines(ctx, r, &lines, NULL, &l, NULL));
    CHECK_OK(ctx, tl_renderer_add_points(ctx, r, &points, NULL, &p, NULL));
    l.halo_px = (double)NAN;
    CHECK_STATUS(tl_renderer_add_lines(ctx, r, &lines, NULL, &l, NULL), TL_ERR_ARG);
    l = tl_line_opts_defaults();
    l.shape = (tl_line_shape)7;
    CHECK_STATUS(tl_renderer_add_lines(ctx, r, &lines, NULL, &l, NULL), TL_ERR_ARG);
    l = tl_line_opts_defaults();
    l.width_px = 0;
    CHECK_STATUS(tl_renderer_add_lines(ctx, r, &lines, NULL, &l, NULL), TL_ERR_ARG);
    p.radius = -1;
    CHECK_STATUS(tl_renderer_add_points(ctx, r, &points, NULL, &p, NULL), TL_ERR_ARG);
    tl_renderer_destroy(ctx, r);
    check_ctx_destroy(ctx);
}

static void slices_and_volumes(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_renderer *r = open_null(ctx);
    make_mesh m = make_grid(3);
    tl_mesh *mesh = make_object(ctx, &m, make_height);
    const double *scalar = tl_mesh_channel(mesh, 0)->values;
    double values[2] = {0.25, 0.5}, wrong[2] = {0.5, (double)NAN};
    static const tl_color_point color = {0, {1, 1, 1}};
    static const tl_opacity_point opacity = {0, 0.5};
    tl_item slices = 0, volume_item = 0;
    tl_volume *volume = NULL;
    tl_transfer *t = NULL;
    tl_volume_opts opts = tl_volume_opts_defaults();
    CHECK_OK(ctx, tl_transfer_create(ctx, &color, 1, &opacity, 1, 1, &t));
    CHECK_OK(ctx, tl_volume_create(ctx, mesh, NULL, &volume));
    CHECK_STATUS(tl_renderer_add_slices(ctx, r, mesh, scalar, wrong, 2, NULL, NULL), TL_ERR_ARG);
    CHECK_STATUS(tl_renderer_add_slices(ctx, r, mesh, scalar, values, 0, NULL, NULL), TL_ERR_ARG);
    CHECK_OK(ctx, tl_renderer_add_slices(ctx, r, mesh, scalar, values, 2, NULL, &slices));
    CHECK_OK(ctx, tl_renderer_set_slices(ctx, r, slices, values + 1, 1));
    CHECK_STATUS(tl_renderer_set_slices(ctx, r, slices, wrong, 2), TL_ERR_ARG);
    CHECK_STATUS(tl_renderer_set_slices(ctx, r, slices + 1, values, 2), TL_ERR_ARG);
    opts.lit = true;
    CHECK_STATUS(tl_renderer_add_volume(ctx, r, volume, scalar, t, &opts, NULL), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "without gradients"));
    CHECK_OK(ctx, tl_renderer_add_volume(ctx, r, volume, scalar, t, NULL, &volume_item));
    CHECK_STATUS(tl_renderer_set_slices(ctx, r, volume_item, values, 1), TL_ERR_ARG);
    CHECK_STATUS(tl_renderer_add_volume(ctx, r, volume, scalar, t, NULL, NULL), TL_ERR_UNSUPPORTED);
    tl_renderer_remove(ctx, r, volume_item);
    CHECK_OK(ctx, tl_renderer_add_volume(ctx, r, volume, scalar, t, NULL, NULL));
    tl_renderer_destroy(ctx, r);
    tl_volume_destroy(ctx, volume);
    tl_transfer_destroy(ctx, t);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* What is lent stays as it is; numbers are not used again. */
static void order_of_calls(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_renderer *r = open_null(ctx);
    triangle one;
    triangle_make(&one);
    tl_camera camera = camera_of(8);
    tl_image *image = NULL;
    tl_item first = 0, second = 0;
    CHECK_OK(ctx, tl_image_create(ctx, 8, 8, &image));
    CHECK_OK(ctx, tl_renderer_draw(ctx, r, &camera, image));
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, &one.p, NULL, &first));
    CHECK_OK(ctx, tl_renderer_draw(ctx, r, &camera, image));
    one.xyz[4] = 2;
    CHECK_STATUS(tl_renderer_draw(ctx, r, &camera, image), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "thing 1 "));
    tl_renderer_remove(ctx, r, first);
    tl_renderer_remove(ctx, r, first);
    tl_renderer_remove(ctx, r, 0);
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, &one.p, NULL, &second));
    CHECK(second > first);
    CHECK_OK(ctx, tl_renderer_draw(ctx, r, &camera, image));
    camera.size_px[0] = 9;
    CHECK_STATUS(tl_renderer_draw(ctx, r, &camera, image), TL_ERR_ARG);
    tl_image_destroy(ctx, image);
    tl_renderer_destroy(ctx, r);
    check_ctx_destroy(ctx);
}

static void pictures_are_reduced(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_image *image = NULL, *small = NULL;
    CHECK_OK(ctx, tl_image_create(ctx, 4, 2, &image));
    for (size_t i = 0; i < 8; i++) {
        for (size_t k = 0; k < 4; k++) image->rgba[4 * i + k] = (float)(i + 10 * k);
        image->depth[i] = i == 6 ? 3 : INFINITY;
    }
    CHECK_OK(ctx, tl_image_reduce(ctx, image, 2, &small));
    CHECK_EQ(small->width, 2);
    CHECK_EQ(small->height, 1);
    for (size_t x = 0; x < 2; x++) /* of pixels 0 1 4 5, and 2 3 6 7 */
        for (size_t k = 0; k < 4; k++)
            CHECK_NEAR(small->rgba[4 * x + k], 2.5 + 2 * (double)x + 10 * (double)k, 1e-6);
    CHECK(isinf(small->depth[0]) && small->depth[1] == 3);
    tl_image_destroy(ctx, small);
    CHECK_STATUS(tl_image_reduce(ctx, image, 3, &small), TL_ERR_ARG);
    CHECK_STATUS(tl_image_reduce(ctx, image, 0, &small), TL_ERR_ARG);
    tl_image_destroy(ctx, image);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kinds_of_renderers),    cmocka_unit_test(looks_out_of_range),
        cmocka_unit_test(polydata_that_is_none), cmocka_unit_test(pictures_are_reduced),
        cmocka_unit_test(options_out_of_range),  cmocka_unit_test(slices_and_volumes),
        cmocka_unit_test(order_of_calls),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
