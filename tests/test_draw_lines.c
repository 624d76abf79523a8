/* Lines on the processor: widths, light across them, depth, bends without holes or doubled pixels,
 * halos, gaps and arrows at their places, bad vertices; the same picture for any number of threads.
 */
#include "check.h"

#include "tetralod/draw.h"

#include "check_ctx.h"
#include "check_picture.h"
#include "fail_alloc.h"
#include "make_mesh.h"

enum { SIDE = 200, VERTS_MAX = 400 };

/* Up to two lines of vertices, in one block. */
typedef struct drawing {
    tl_polydata lines;
    double xyz[3 * VERTS_MAX];
    tl_lidx corners[VERTS_MAX], starts[3];
} drawing;

static drawing *make_drawing(void)
{
    drawing *d = calloc(1, sizeof *d);
    if (!d) abort();
    d->lines.kind = TL_POLY_LINES;
    d->lines.xyz = d->xyz;
    d->lines.corners = d->corners;
    d->lines.starts = d->starts;
    for (tl_lidx v = 0; v < VERTS_MAX; v++) d->corners[v] = v;
    return d;
}

static void add_vert(drawing *d, double x, double y, double z)
{
    double *to = d->xyz + 3 * d->lines.vert_count++;
    to[0] = x;
    to[1] = y;
    to[2] = z;
}

static void end_line(drawing *d)
{
    d->starts[++d->lines.cell_count] = (tl_lidx)d->lines.vert_count;
}

static drawing *make_straight(double z)
{
    drawing *d = make_drawing();
    for (int i = 0; i <= 20; i++) add_vert(d, -0.8 + 0.08 * i, 0, z);
    end_line(d);
    return d;
}

static tl_look flat_look(double opacity)
{
    tl_look look = tl_look_defaults();
    look.rgb[0] = 1;
    look.rgb[1] = 0.5;
    look.rgb[2] = 0.25;
    look.lit = false;
    look.opacity = opacity;
    return look;
}

static tl_line_opts wide(double width_px)
{
    tl_line_opts opts = tl_line_opts_defaults();
    opts.shape = TL_LINE_FLAT;
    opts.width_px = width_px;
    return opts;
}

/* Rows of a column that are covered, parts of them at the edges. */
static double rows_of(const tl_image *image, size_t column)
{
    double rows = 0;
    for (size_t y = 0; y < image->height; y++) rows += picture_opacity(image, column, y);
    return rows;
}

static void widths_are_as_asked(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    drawing *d = make_straight(0);
    tl_look look = flat_look(1);
    for (int parallel = 0; parallel < 2; parallel++)
        for (int i = 0; i < 6; i++) {
            tl_camera camera = picture_camera(SIDE, parallel);
            bool far = i == 5;
            if (far) camera.position[2] = 20;
            double scale = parallel ? 100 : SIDE / 2 / tan(acos(-1) / 12) / (far ? 20 : 10);
            tl_line_opts opts = wide(2 + 2 * i);
            if (i > 3) opts.width = 0.08;
            tl_image *image = picture_of_lines(ctx, &d->lines, &look, &opts, &camera);
            double pixels = i > 3 ? 0.08 * scale : opts.width_px;
            for (size_t x = 90; x < 110; x++) CHECK_NEAR(rows_of(image, x), pixels, 0.02);
            if (pixels > 2.1)
                CHECK_NEAR((double)image->depth[100 * SIDE + 100], far ? 20 : 10, 1e-5);
            if (pixels > 2.1) CHECK_NEAR((double)picture_pixel(image, 100, 100)[1], 0.5, 1e-6);
            size_t end = (size_t)(100 + 0.8 * scale + pixels / 2);
            CHECK(end >= SIDE - 2 || rows_of(image, end + 2) == 0);
            tl_image_destroy(ctx, image);
        }
    free(d);
    check_ctx_destroy(ctx);
}

/* The light is that of a cylinder. */
static void tubes_are_lit_across(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_camera camera = picture_camera(SIDE, true);
    tl_look look = flat_look(1);
    tl_line_opts opts = wide(40);
    look.lit = true;
    opts.shape = TL_LINE_TUBE;
    for (int slanted = 0; slanted < 2; slanted++) {
        drawing *d = make_drawing();
        double slope = slanted ? 1 : 0;
        add_vert(d, -0.8, 0, -0.8 * slope);
        add_vert(d, 0.8, 0, 0.8 * slope);
        end_line(d);
        tl_image *image = picture_of_lines(ctx, &d->lines, &look, &opts, &camera);
        for (size_t y = 82; y < 118; y++) {
            double across = ((double)y + 0.5 - 100) / 20;
            double cosine = sqrt(1 - across * across) * (slanted ? sqrt(0.5) : 1);
            double light = look.ambient + look.diffuse * cosine;
            double white = look.specular * pow(cosine, look.shininess);
            CHECK_NEAR((double)picture_pixel(image, 60, y)[2], 0.25 * light + white, 1e-4);
            double axis = 10 - slope * ((60.5 - 100) / 100);
            CHECK_NEAR((double)image->depth[y * SIDE + 60], axis - 0.2 * sqrt(1 - across * across),
                       1e-4);
        }
        tl_image_destroy(ctx, image);
        free(d);
    }
    check_ctx_destroy(ctx);
}

/* Pixels lie this much beside their places, mesh units, so that no edge passes through them. */
static const double OFF_PIXELS = 3e-5;

static double distance_to(const drawing *d, double x, double y)
{
    double least = INFINITY;
    for (size_t i = 1; i < d->lines.vert_count; i++) {
        const double *a = d->xyz + 3 * (i - 1), *b = d->xyz + 3 * i;
        double way[2] = {b[0] - a[0], b[1] - a[1]}, to[2] = {x - a[0], y - a[1]};
        double t = (to[0] * way[0] + to[1] * way[1]) / (way[0] * way[0] + way[1] * way[1]);
        t = t < 0 ? 0 : t > 1 ? 1 : t;
        least = fmin(least, hypot(to[0] - t * way[0], to[1] - t * way[1]));
    }
    return least;
}

/* Bends have no holes, and a translucent line covers each pixel once: pixels are those within half
 * the width, with the one opacity, also where runs of segments meet. */
static void bends_are_whole(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_camera camera = picture_camera(SIDE, true);
    for (int kind = 0; kind < 2; kind++)
        for (int opaque = 0; opaque < 2; opaque++) {
            drawing *d = make_drawing();
            for (int i = 0; i <= 60; i++) {
                double turn = 0.1 * i;
                if (kind)
                    add_vert(d, 0.15 * turn * cos(turn), 0.15 * turn * sin(turn), 0.001 * i);
                else
                    add_vert(d, -0.9 + 0.03 * i, i % 2 ? 0.1 : -0.1, 0);
            }
            end_line(d);
            tl_look look = flat_look(opaque ? 1 : 0.5);
            tl_line_opts opts = wide(kind ? 10 : 3);
            tl_image *image = picture_of_lines(ctx, &d->lines, &look, &opts, &camera);
            size_t doubled = 0, covered = 0;
            for (size_t y = 0; y < SIDE; y++)
                for (size_t x = 0; x < SIDE; x++) {
                    double opacity = picture_opacity(image, x, y);
                    double off = distance_to(d, ((double)x - 99.5) / 100, (99.5 - (double)y) / 100);
                    double half = opts.width_px / 200;
                    double inside = half - off; /* the edge is a pixel wide */
                    if (inside > 0.005 + OFF_PIXELS) CHECK(opacity >= look.opacity);
                    if (inside < -0.005 - OFF_PIXELS) CHECK_NEAR(opacity, 0, 0);
                    covered += opacity > 0;
                    doubled += opacity > look.opacity;
                }
            CHECK(covered > 1000);
            CHECK_EQ(doubled, 0);
            tl_image_destroy(ctx, image);
            free(d);
        }
    check_ctx_destroy(ctx);
}

/* A line before another: beside it the other is not seen, far from it it is; not so for one at its
 * depth. */
static void halos_set_lines_apart(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_camera camera = picture_camera(SIDE, true);
    tl_look look = flat_look(1);
    tl_line_opts opts = wide(6);
    opts.halo_px = 5;
    for (int behind = 0; behind < 2; behind++) {
        drawing *d = make_drawing();
        add_vert(d, -0.8, 0, 0.5);
        add_vert(d, 0.8, 0, 0.5);
        end_line(d);
        add_vert(d, 0, -0.8, behind ? -0.5 : 0.5);
        add_vert(d, 0, 0.8, behind ? -0.5 : 0.5);
        end_line(d);
        tl_image *image = picture_of_lines(ctx, &d->lines, &look, &opts, &camera);
        for (size_t y = 20; y < 180; y++) {
            double off = fabs((double)y + 0.5 - 100);
            double expected = behind && off > 3 && off < 8 ? 0 : 1;
            if (behind && (fabs(off - 3) < 0.6 || fabs(off - 8) < 0.6)) continue;
            CHECK_NEAR(picture_opacity(image, 100, y), expected, 0);
        }
        tl_image_destroy(ctx, image);
        free(d);
    }
    check_ctx_destroy(ctx);
}

static void gaps_and_arrows_move_along(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    drawing *d = make_straight(0);
    tl_camera camera = picture_camera(SIDE, true);
    tl_look look = flat_look(1);
    for (int moved = 0; moved < 3; moved++) {
        tl_line_opts opts = wide(4);
        opts.dash = 0.3;
        opts.gap = 0.1;
        opts.phase = 0.15 * moved;
        tl_image *image = picture_of_lines(ctx, &d->lines, &look, &opts, &camera);
        for (size_t x = 24; x < 176; x++) {
            double at = ((double)x + 0.5 - 20) / 100 - opts.phase,
                   part = at - floor(at / 0.4) * 0.4;
            if (fabs(part - 0.3) < 0.011 || part < 0.011 || part > 0.389) continue;
            CHECK_NEAR(rows_of(image, x), part < 0.3 ? 4 : 0, 0.02);
        }
        tl_image_destroy(ctx, image);
        opts = wide(4);
        opts.arrow_spacing = 0.8;
        opts.phase = 0.1 * moved;
        image = picture_of_lines(ctx, &d->lines, &look, &opts, &camera);
        for (int tip = 0; tip < 2; tip++) {
            /* 28 pixels long, 16 wide at its end, as thin as the line at its tip, which comes last
             */
            size_t at = 20 + 40 + (size_t)(80 * tip + 10 * moved);
            CHECK_NEAR(rows_of(image, at - 29), 4, 0.02);
            CHECK_NEAR(rows_of(image, at - 27), 16, 1);
            CHECK_NEAR(rows_of(image, at - 14), 8, 1);
            CHECK_NEAR(rows_of(image, at - 2), 4, 0.02);
            CHECK_NEAR(rows_of(image, at + 2), 4, 0.02);
        }
        tl_image_destroy(ctx, image);
    }
    free(d);
    check_ctx_destroy(ctx);
}

/* ---- bad vertices, threads, memory ---- */

static drawing *make_scribble(bool bad)
{
    drawing *d = make_drawing();
    uint64_t seed = 4;
    for (int i = 0; i < VERTS_MAX; i++) {
        double x[3];
        for (int k = 0; k < 3; k++) x[k] = 2 * make_uniform(&seed) - 1;
        /* behind the camera, too */
        add_vert(d, x[0], x[1], bad ? 30 * x[2] : x[2]);
        if (i == VERTS_MAX / 2) end_line(d);
    }
    end_line(d);
    for (size_t i = 0; bad && i < 3 * VERTS_MAX; i += 17)
        d->xyz[i] = i % 2 ? (double)NAN : i % 3 ? (double)INFINITY : 1e300;
    for (size_t i = 5; bad && i < 9; i++) d->corners[i] = d->corners[4]; /* no length */
    return d;
}

static void bad_vertices_are_left_out(void **state)
{
    (void)state;
    for (int kind = 0; kind < 8; kind++) {
        tl_ctx *ctx = check_ctx_create(2);
        drawing *d = make_scribble(true);
        tl_camera camera = picture_camera(SIDE, kind & 1);
        tl_look look = flat_look(kind & 2 ? 1 : 0.4);
        tl_line_opts opts = wide(3);
        opts.arrow_spacing = 0.5;
        opts.halo_px = 2;
        if (kind & 4) opts.width = 0.05;
        look.lit = true;
        opts.shape = TL_LINE_TUBE;
        tl_image *image = picture_of_lines(ctx, &d->lines, &look, &opts, &camera);
        size_t seen = 0;
        for (size_t i = 0; i < (size_t)4 * SIDE * SIDE; i++) {
            CHECK(image->rgba[i] >= 0 && image->rgba[i] <= 1);
            seen += image->rgba[i] > 0;
        }
        CHECK(seen > 1000);
        tl_image_destroy(ctx, image);
        free(d);
        check_ctx_destroy(ctx);
    }
}

static void threads_change_nothing(void **state)
{
    (void)state;
    tl_ctx *one = check_ctx_create(1), *three = check_ctx_create(3);
    drawing *d = make_scribble(false);
    for (int kind = 0; kind < 2; kind++) {
        tl_camera camera = picture_camera(SIDE, false);
        tl_look look = flat_look(kind ? 1 : 0.4);
        tl_line_opts opts = wide(3);
        opts.halo_px = 2;
        tl_image *a = picture_of_lines(one, &d->lines, &look, &opts, &camera);
        tl_image *b = picture_of_lines(three, &d->lines, &look, &opts, &camera);
        CHECK(picture_same(a, b));
        tl_image_destroy(one, a);
        tl_image_destroy(three, b);
    }
    free(d);
    check_ctx_destroy(one);
    check_ctx_destroy(three);
}

static tl_status draw_in(tl_ctx *ctx, void *arg)
{
    const drawing *d = arg;
    tl_camera camera = picture_camera(64, true);
    tl_look look = flat_look(0.5);
    tl_renderer *r = NULL;
    tl_status st = tl_renderer_create(ctx, TL_RENDERER_CPU, &r);
    if (!st) st = tl_renderer_add_lines(ctx, r, &d->lines, &look, NULL, NULL);
    if (!st) st = picture_try(ctx, r, &camera);
    tl_renderer_destroy(ctx, r);
    return st;
}

static void failed_allocations_leave_nothing(void **state)
{
    (void)state;
    fail_alloc f;
    drawing *d = make_straight(0);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, draw_in, d) > 8);
    fail_alloc_close(&f);
    free(d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(widths_are_as_asked),
        cmocka_unit_test(tubes_are_lit_across),
        cmocka_unit_test(bends_are_whole),
        cmocka_unit_test(halos_set_lines_apart),
        cmocka_unit_test(gaps_and_arrows_move_along),
        cmocka_unit_test(bad_vertices_are_left_out),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(failed_allocations_leave_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
