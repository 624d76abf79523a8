/* Surfaces on the processor against closed forms: the silhouette of a sphere, light, each pixel of
 * a sheet just once, order of translucent sheets that cross, a sheet in fog; places and values that
 * are none; the same picture for any number of threads. */
#include "check.h"

#include "tetralod/draw.h"

#include "check_ctx.h"
#include "check_picture.h"
#include "make_mesh.h"
#include "make_scene.h"

static tl_look plain(double red, double green, double blue, double opacity)
{
    tl_look look = tl_look_defaults();
    const double rgb[3] = {red, green, blue};
    memcpy(look.rgb, rgb, sizeof rgb);
    look.opacity = opacity;
    look.lit = false;
    return look;
}

/* Of one surface. */
static tl_image *draw_surface(tl_ctx *ctx, const tl_polydata *p, const tl_look *look,
                              const tl_camera *camera)
{
    tl_renderer *r = picture_renderer(ctx);
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, p, look, NULL));
    return picture_of(ctx, r, camera);
}

static void sphere_silhouette(void **state)
{
    (void)state;
    enum { SIDE = 301 };
    tl_ctx *ctx = check_ctx_create(2);
    const double center[3] = {0.5, 0.5, 0.5}, radius = 0.4, pi = acos(-1);
    tl_polydata sphere = make_sphere(200, center, radius);
    for (int parallel = 0; parallel < 2; parallel++) {
        tl_camera camera = make_camera(parallel);
        camera.size_px[0] = camera.size_px[1] = SIDE;
        tl_image *image = draw_surface(ctx, &sphere, NULL, &camera);
        double tangent = radius / sqrt(2.5 * 2.5 - radius * radius);
        double edge = parallel ? SIDE / 1.2 * radius : SIDE / (2 * tan(pi / 12)) * tangent;
        /* 200 sides have 0.02 % less than a circle */
        CHECK_NEAR(picture_covered(image) / (pi * edge * edge), 1, 2e-3);
        CHECK_NEAR((double)image->depth[SIDE / 2 * SIDE + SIDE / 2], 2.5 - radius, 1e-4);
        CHECK(isinf(image->depth[0]));
        /* the light is in the middle: of the highlight and of the shadow at the edge */
        tl_look look = tl_look_defaults();
        CHECK_NEAR((double)picture_middle(image)[0],
                   fmin(look.rgb[0] * (look.ambient + look.diffuse) + look.specular, 1), 3e-3);
        /* half way to the edge of a parallel view the normal is at 30 degrees */
        if (parallel) {
            double cosine = sqrt(0.75), x = SIDE / 2 + edge / 2;
            CHECK_NEAR((double)picture_pixel(image, (size_t)x, SIDE / 2)[0],
                       look.rgb[0] * (look.ambient + look.diffuse * cosine) +
                           look.specular * pow(cosine, look.shininess),
                       2e-2);
        }
        tl_image_destroy(ctx, image);
    }
    make_triangles_release(&sphere);
    check_ctx_destroy(ctx);
}

/* No pixel falls between two triangles and none belongs to both: not even where edges pass through
 * middles of pixels. */
static void pixels_belong_to_one_triangle(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_look look = plain(1, 1, 1, 0.5);
    for (int parallel = 0; parallel < 2; parallel++)
        for (size_t n = 1; n < 80; n += 13) {
            tl_camera camera = make_camera(parallel);
            const double origin[3] = {-0.5, -0.5, 0.3}, a[3] = {2, 0, 0.3}, b[3] = {0.1, 2, -0.2};
            tl_polydata sheet = make_sheet(n, origin, a, b);
            tl_image *image = draw_surface(ctx, &sheet, &look, &camera);
            for (size_t i = 0; i < (size_t)MAKE_SIDE * MAKE_SIDE; i++) {
                CHECK(image->rgba[4 * i + 3] == 0.5F);
                CHECK(isinf(image->depth[i]));
            }
            tl_image_destroy(ctx, image);
            make_triangles_release(&sheet);
        }
    check_ctx_destroy(ctx);
}

/* A floor below the camera, which reaches behind it: it is seen up to the horizon. */
static void floors_reach_behind_the_camera(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_look look = plain(1, 0, 0, 1);
    tl_polydata floor_of_three = make_triangles(3, 1);
    const double xyz[9] = {-1e4, 0, -1e4, 1e4, 0, -1e4, 0, 0, 3e4};
    const tl_lidx corners[3] = {0, 1, 2};
    memcpy(floor_of_three.xyz, xyz, sizeof xyz);
    memcpy(floor_of_three.corners, corners, sizeof corners);
    tl_camera camera = make_camera(false);
    camera.focal_point[1] = camera.position[1] = 0.5;
    camera.view_angle = 90;
    tl_image *image = draw_surface(ctx, &floor_of_three, &look, &camera);
    for (size_t y = 0; y < MAKE_SIDE; y++)
        for (size_t x = 0; x < MAKE_SIDE; x++) {
            CHECK(picture_pixel(image, x, y)[3] == (y > MAKE_SIDE / 2 ? 1.F : 0.F));
            /* half a unit below, tan of the angle a row's share of half the picture */
            if (y > MAKE_SIDE / 2)
                CHECK_NEAR((double)image->depth[y * MAKE_SIDE + x] * ((double)y - MAKE_SIDE / 2) /
                               (MAKE_SIDE / 2.0),
                           0.5, 2e-3);
        }
    tl_image_destroy(ctx, image);
    make_triangles_release(&floor_of_three);
    check_ctx_destroy(ctx);
}

/* A red sheet and a blue one that cross in the middle column: left of it red is in front. */
static void sheets_that_cross(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_camera camera = make_camera(true);
    const double red_at[3] = {-1, -1, 0}, red_a[3] = {3, 0, 1}, up[3] = {0, 3, 0};
    const double blue_at[3] = {-1, -1, 1}, blue_a[3] = {3, 0, -1};
    const double white_at[3] = {-1, -1, 2}, white_a[3] = {3, 0, 0};
    tl_polydata red = make_sheet(3, red_at, red_a, up), blue = make_sheet(2, blue_at, blue_a, up);
    tl_polydata white = make_sheet(1, white_at, white_a, up);
    const tl_look looks[3] = {plain(1, 0, 0, 0.5), plain(0, 0, 1, 0.25), plain(1, 1, 1, 1)};
    tl_renderer *r = picture_renderer(ctx);
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, &blue, &looks[1], NULL));
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, &red, &looks[0], NULL));
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, &white, &looks[2], NULL));
    tl_image *image = picture_of(ctx, r, &camera);
    for (size_t x = 0; x < MAKE_SIDE; x++) {
        if (x == MAKE_SIDE / 2) continue;
        /* view-up and view make x run to the left on the picture */
        bool red_first = x > MAKE_SIDE / 2;
        const float *c = picture_pixel(image, x, 5);
        CHECK_NEAR((double)c[0], red_first ? 0.5 + 0.5 * 0.75 : 0.75 * (0.5 + 0.5), 1e-6);
        CHECK_NEAR((double)c[1], 0.5 * 0.75, 1e-6);
        CHECK_NEAR((double)c[2], red_first ? 0.5 * (0.25 + 0.75) : 0.25 + 0.75 * 0.5, 1e-6);
        CHECK_NEAR((double)c[3], 1, 1e-6);
        CHECK_NEAR((double)image->depth[5 * MAKE_SIDE + x], 4, 1e-5);
    }
    tl_image_destroy(ctx, image);
    make_triangles_release(&red);
    make_triangles_release(&blue);
    make_triangles_release(&white);
    check_ctx_destroy(ctx);
}

/* A cube of white fog with sheets in it, across it, and one behind, opaque. */
typedef struct scene {
    tl_ctx *ctx;
    make_mesh grid;
    tl_mesh *mesh;
    tl_volume *volume;
    tl_transfer *fog;
    tl_polydata sheets[3];
    tl_renderer *renderer;
} scene;

/* Sheets at depths (z), in colours red, green and blue, of these opacities; 0: none. */
static void open_scene(scene *s, unsigned threads, double extinction, const double depths[3],
                       const double opacities[3])
{
    *s = (scene){.ctx = check_ctx_create(threads), .grid = make_grid(9)};
    const double a[3] = {3, 0, 0}, b[3] = {0, 3, 0};
    tl_volume_opts opts = tl_volume_opts_defaults();
    opts.opacity_end = 1;
    make_shuffle(&s->grid, 5);
    s->mesh = make_object(s->ctx, &s->grid, make_quarter);
    s->fog = make_fog(s->ctx, 0, extinction, 1, extinction);
    s->renderer = picture_renderer(s->ctx);
    CHECK_OK(s->ctx, tl_volume_create(s->ctx, s->mesh, NULL, &s->volume));
    CHECK_OK(s->ctx,
             tl_renderer_add_volume(s->ctx, s->renderer, s->volume,
                                    tl_mesh_channel(s->mesh, 0)->values, s->fog, &opts, NULL));
    for (int i = 0; i < 3; i++) {
        const double origin[3] = {-1, -1, depths[i]};
        tl_look look = plain(i == 0, i == 1, i == 2, opacities[i]);
        s->sheets[i] = make_sheet(2, origin, a, b);
        CHECK_OK(s->ctx, tl_renderer_add_surface(s->ctx, s->renderer, &s->sheets[i], &look, NULL));
    }
}

static void close_scene(scene *s)
{
    tl_renderer_destroy(s->ctx, s->renderer);
    for (int i = 0; i < 3; i++) make_triangles_release(&s->sheets[i]);
    tl_volume_destroy(s->ctx, s->volume);
    tl_transfer_destroy(s->ctx, s->fog);
    tl_mesh_destroy(s->mesh);
    make_release(&s->grid);
    check_ctx_destroy(s->ctx);
}

/* What a ray along z sees, layer by layer: fog between 0 and 1, sheets at their depths. */
static void expect(double extinction, const double depths[3], const double opacities[3],
                   double begin, double rgba[4])
{
    int order[3] = {0, 1, 2};
    double at = begin;
    memset(rgba, 0, 4 * sizeof *rgba);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++)
            if (depths[order[k]] > depths[order[k + 1]]) {
                int kept = order[k];
                order[k] = order[k + 1];
                order[k + 1] = kept;
            }
    for (int i = 0; i < 4; i++) {
        double to = i < 3 ? depths[order[i]] : 10, inside = fmin(to, 1) - fmax(at, 0);
        double fog = inside > 0 ? -expm1(-extinction * inside) : 0;
        for (int k = 0; k < 4; k++) rgba[k] += (1 - rgba[3]) * (k < 3 ? fog : 0);
        rgba[3] += (1 - rgba[3]) * fog;
        if (i == 3 || to < begin) continue;
        double left = (1 - rgba[3]) * opacities[order[i]];
        rgba[order[i]] += left;
        rgba[3] += left;
        at = to;
    }
}

static void check_scene(double extinction, const double depths[3], const double opacities[3],
                        double begin, bool parallel)
{
    scene s;
    open_scene(&s, 2, extinction, depths, opacities);
    tl_camera camera = make_camera(parallel);
    double rgba[4];
    camera.position[2] = begin;
    camera.focal_point[2] = begin + 1;
    expect(extinction, depths, opacities, begin, rgba);
    tl_image *image = picture_take(s.ctx, s.renderer, &camera);
    const float *c = picture_middle(image);
    for (int k = 0; k < 4; k++) CHECK_NEAR((double)c[k], rgba[k], 3e-5);
    tl_image_destroy(s.ctx, image);
    close_scene(&s);
}

/* Sheets before, in and behind fog, and all of them in it; from outside and from inside. */
static void sheets_in_fog(void **state)
{
    (void)state;
    static const double depths[][3] = {
        {0.37, -0.5, 1.5}, {0.71, 0.2, 0.55}, {1.25, 1.5, 0.05}, {-1, -0.5, -0.2}};
    static const double opacities[][3] = {{0.4, 0.5, 1}, {0.3, 0.6, 0.2}, {1, 0.7, 0.9}};
    for (size_t i = 0; i < sizeof depths / sizeof *depths; i++)
        for (size_t k = 0; k < sizeof opacities / sizeof *opacities; k++)
            for (int parallel = 0; parallel < 2; parallel++) {
                check_scene(0.8, depths[i], opacities[k], -2, parallel);
                check_scene(6, depths[i], opacities[k], 0.47, parallel);
            }
}

static void same_for_all_threads(void **state)
{
    (void)state;
    static const double depths[3] = {0.3, 0.3, 0.8}, opacities[3] = {0.4, 0.3, 1};
    tl_image *first = NULL;
    scene one;
    open_scene(&one, 1, 1, depths, opacities);
    for (unsigned threads = 1; threads <= 4; threads++) {
        scene s;
        open_scene(&s, threads, 1, depths, opacities);
        tl_camera camera = make_camera(false);
        camera.position[0] = 1.5;
        camera.position[1] = -1;
        tl_image *image = picture_take(s.ctx, s.renderer, &camera);
        if (!first) first = picture_take(one.ctx, one.renderer, &camera);
        CHECK(picture_same(first, image));
        tl_image_destroy(s.ctx, image);
        close_scene(&s);
    }
    tl_image_destroy(one.ctx, first);
    close_scene(&one);
}

static void slices_are_surfaces(void **state)
{
    (void)state;
    static const double depths[3] = {0.3, 0.6, 0.8}, opacities[3] = {0, 0, 0};
    static const double origin[3] = {0.5, 0.5, 0.5}, normal[3] = {0.2, 0.1, 1}, shift = 0.21;
    scene s;
    open_scene(&s, 2, 1e-9, depths, opacities);
    tl_camera camera = make_camera(false);
    tl_slice_opts opts = tl_slice_opts_defaults();
    tl_look look = tl_look_defaults();
    tl_polydata *cut = NULL;
    tl_item item = 0;
    tl_renderer *r = picture_renderer(s.ctx);
    double *distance = malloc(s.grid.vert_count * sizeof *distance), zero = 0;
    CHECK_OK(s.ctx, tl_plane_distance(s.ctx, s.mesh, origin, normal, distance));
    opts.values = &shift;
    opts.value_count = 1;
    look.scalar = distance;
    look.transfer = s.fog;
    CHECK_OK(s.ctx, tl_slice_mesh(s.ctx, s.mesh, distance, &opts, &cut));
    look.scalar = malloc((cut->vert_count + 1) * sizeof(double));
    for (size_t v = 0; v < cut->vert_count; v++) ((double *)(uintptr_t)look.scalar)[v] = shift;
    tl_image *a = draw_surface(s.ctx, cut, &look, &camera);
    free((void *)(uintptr_t)look.scalar);
    look.scalar = distance;
    CHECK_OK(s.ctx, tl_renderer_add_slices(s.ctx, r, s.mesh, distance, &zero, 1, &look, &item));
    tl_image *b = picture_take(s.ctx, r, &camera);
    CHECK(!picture_same(a, b));
    CHECK_OK(s.ctx, tl_renderer_set_slices(s.ctx, r, item, &shift, 1));
    tl_image_destroy(s.ctx, b);
    b = picture_take(s.ctx, r, &camera);
    /* gradients instead of flat normals: equal to rounding */
    double seen = 0;
    for (size_t i = 0; i < (size_t)4 * MAKE_SIDE * MAKE_SIDE; i++) {
        CHECK_NEAR((double)a->rgba[i], (double)b->rgba[i], 1e-5);
        seen += (double)a->rgba[i];
    }
    CHECK(seen > 100);
    tl_image_destroy(s.ctx, a);
    tl_image_destroy(s.ctx, b);
    tl_polydata_destroy(s.ctx, cut);
    tl_renderer_destroy(s.ctx, r);
    free(distance);
    close_scene(&s);
}

/* What has no area or no place is not there; nor do the others suffer. */
static void degenerate_triangles(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_look look = plain(1, 1, 1, 0.5);
    tl_camera camera = make_camera(false);
    const double origin[3] = {-1, -1, 0.5}, a[3] = {3, 0, 0}, b[3] = {0, 3, 0};
    tl_polydata sheet = make_sheet(4, origin, a, b), more = make_sheet(4, origin, a, b);
    more.cell_count = sheet.cell_count;
    size_t extra = 0;
    for (size_t t = 0; t < sheet.cell_count; t += 5, extra++)
        more.corners[3 * t] = more.corners[3 * t + 1];
    tl_image *full = draw_surface(ctx, &sheet, &look, &camera);
    tl_image *holes = draw_surface(ctx, &more, &look, &camera);
    double sums[2] = {0};
    for (size_t i = 0; i < (size_t)MAKE_SIDE * MAKE_SIDE; i++) {
        sums[0] += (double)full->rgba[4 * i + 3];
        sums[1] += (double)holes->rgba[4 * i + 3];
        CHECK(holes->rgba[4 * i + 3] == 0 || holes->rgba[4 * i + 3] == 0.5F);
    }
    CHECK(sums[1] < sums[0] && sums[1] > 0.5 * sums[0]);
    static const double wrong[4] = {(double)NAN, (double)INFINITY, -1e300, 1e-320};
    for (int i = 0; i < 4; i++) {
        tl_image_destroy(ctx, holes);
        more.xyz[3 * 12 + i % 3] = wrong[i];
        look.lit = true;
        holes = draw_surface(ctx, &more, &look, &camera);
        for (size_t k = 0; k < (size_t)4 * MAKE_SIDE * MAKE_SIDE; k++)
            CHECK(holes->rgba[k] >= 0 && holes->rgba[k] <= 1);
    }
    tl_image_destroy(ctx, full);
    tl_image_destroy(ctx, holes);
    make_triangles_release(&sheet);
    make_triangles_release(&more);
    check_ctx_destroy(ctx);
}

/* A sheet of nothing but values that are none is grey, or of the colour of NaN; a picture of
 * nothing stays as it was. */
static void values_and_scenes_of_nothing(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_camera camera = make_camera(false);
    const double origin[3] = {-1, -1, 0.5}, a[3] = {3, 0, 0}, b[3] = {0, 3, 0};
    double values[4] = {(double)NAN, (double)NAN, (double)NAN, (double)NAN};
    tl_polydata sheet = make_sheet(1, origin, a, b), empty = {.kind = TL_POLY_TRIANGLES};
    tl_transfer *t = make_fog(ctx, 0, 1, 1, 1);
    tl_look look = plain(0, 0, 0, 1);
    look.scalar = values;
    look.transfer = t;
    tl_image *image = draw_surface(ctx, &sheet, &look, &camera);
    for (int k = 0; k < 3; k++) CHECK(picture_pixel(image, 3, 4)[k] == 0.5F);
    tl_image_destroy(ctx, image);
    const double yellow[3] = {1, 0.75, 0}, wrong[3] = {0, 0, (double)NAN};
    tl_transfer *colored = NULL;
    CHECK_STATUS(tl_transfer_with_nan(ctx, t, wrong, &colored), TL_ERR_ARG);
    CHECK_OK(ctx, tl_transfer_with_nan(ctx, t, yellow, &colored));
    look.transfer = colored;
    image = draw_surface(ctx, &sheet, &look, &camera);
    for (int k = 0; k < 3; k++) CHECK(picture_pixel(image, 3, 4)[k] == (float)yellow[k]);
    tl_transfer_destroy(ctx, colored);
    tl_image *before = picture_empty(ctx, &camera),
             *after = draw_surface(ctx, &empty, NULL, &camera);
    CHECK(picture_same(before, after));
    look = plain(1, 1, 1, 0);
    tl_image_destroy(ctx, after);
    after = draw_surface(ctx, &sheet, &look, &camera);
    CHECK(picture_same(before, after));
    tl_renderer *r = picture_renderer(ctx);
    CHECK_OK(ctx, tl_renderer_draw(ctx, r, &camera, after));
    CHECK(picture_same(before, after));
    tl_renderer_destroy(ctx, r);
    tl_image_destroy(ctx, before);
    tl_image_destroy(ctx, after);
    tl_image_destroy(ctx, image);
    tl_transfer_destroy(ctx, t);
    make_triangles_release(&sheet);
    check_ctx_destroy(ctx);
}

/* Powers of two of the unit: the same bits. */
static void surfaces_of_any_size(void **state)
{
    (void)state;
    static const double sizes[] = {1, 0x1p-80, 0x1p-30, 0x1p40, 0x1p80};
    tl_ctx *ctx = check_ctx_create(1);
    tl_image *first = NULL;
    const double center[3] = {0.5, 0.5, 0.5};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        tl_camera camera = make_camera(false);
        tl_polydata sphere = make_sphere(20, center, 0.4);
        for (size_t k = 0; k < 3 * sphere.vert_count; k++) sphere.xyz[k] *= sizes[i];
        for (int k = 0; k < 3; k++) camera.position[k] *= sizes[i];
        for (int k = 0; k < 3; k++) camera.focal_point[k] *= sizes[i];
        tl_image *image = draw_surface(ctx, &sphere, NULL, &camera);
        if (!first) first = image;
        CHECK(memcmp(first->rgba, image->rgba, (size_t)4 * MAKE_SIDE * MAKE_SIDE * sizeof(float)) ==
              0); /* depths are in mesh units */
        CHECK(picture_middle(image)[0] > 0);
        if (image != first) tl_image_destroy(ctx, image);
        make_triangles_release(&sphere);
    }
    tl_image_destroy(ctx, first);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_silhouette),
        cmocka_unit_test(pixels_belong_to_one_triangle),
        cmocka_unit_test(floors_reach_behind_the_camera),
        cmocka_unit_test(sheets_that_cross),
        cmocka_unit_test(sheets_in_fog),
        cmocka_unit_test(same_for_all_threads),
        cmocka_unit_test(slices_are_surfaces),
        cmocka_unit_test(degenerate_triangles),
        cmocka_unit_test(values_and_scenes_of_nothing),
        cmocka_unit_test(surfaces_of_any_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
