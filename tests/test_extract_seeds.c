/* Where streamlines begin and which are chosen: seeds, critical points, lines that cover a box,
 * lines through a box. */
#include "check.h"

#include "tetralod/extract.h"

#include "check_ctx.h"
#include "check_lines.h"
#include "make_mesh.h"

static const double CUBE[6] = {0, 1, 0, 1, 0, 1};

/* The distance of the nearest two points. */
static double nearest_two(const tl_polydata *p)
{
    double nearest = INFINITY;
    for (size_t a = 0; a < p->vert_count; a++)
        for (size_t b = 0; b < a; b++) {
            const double *x = p->xyz + 3 * a, *y = p->xyz + 3 * b;
            nearest = fmin(nearest, hypot(hypot(x[0] - y[0], x[1] - y[1]), x[2] - y[2]));
        }
    return nearest;
}

static void seeds_are_even(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_polydata *p = NULL;
    const double a[3] = {0, 1, 2}, b[3] = {4, 1, -2};
    CHECK_OK(ctx, tl_seeds_line(ctx, a, b, 5, &p));
    CHECK_EQ(p->kind, TL_POLY_POINTS);
    CHECK_EQ(p->vert_count, 5);
    for (size_t i = 0; i < 5; i++) {
        CHECK_NEAR(p->xyz[3 * i], (double)i, 1e-15);
        CHECK_NEAR(p->xyz[3 * i + 2], 2 - (double)i, 1e-15);
    }
    tl_polydata_destroy(ctx, p);
    const double box[6] = {0, 2, 0, 1, 3, 3}; /* flat */
    CHECK_OK(ctx, tl_seeds_box(ctx, box, 50, &p));
    CHECK_EQ(p->vert_count, 50);
    CHECK_NEAR(nearest_two(p), 0.2, 1e-12);
    for (size_t i = 0; i < 50; i++) CHECK_NEAR(p->xyz[3 * i + 2], 3, 0);
    tl_polydata_destroy(ctx, p);
    CHECK_OK(ctx, tl_seeds_box(ctx, CUBE, 1000, &p));
    CHECK_EQ(p->vert_count, 1000);
    CHECK_NEAR(nearest_two(p), 0.1, 1e-12);
    tl_polydata_destroy(ctx, p);
    const double origin[3] = {0.5, 0.5, 0.5}, normal[3] = {2, 2, 2};
    CHECK_OK(ctx, tl_seeds_plane(ctx, origin, normal, CUBE, 200, &p));
    CHECK(p->vert_count > 160 && p->vert_count < 240);
    for (size_t i = 0; i < p->vert_count; i++)
        CHECK_NEAR(p->xyz[3 * i] + p->xyz[3 * i + 1] + p->xyz[3 * i + 2], 1.5, 1e-12);
    /* the area of the hexagon by the points that share it */
    CHECK_NEAR(nearest_two(p), sqrt(sqrt(27.0) / 4 / (double)p->vert_count), 0.01);
    tl_polydata *around = NULL;
    CHECK_OK(ctx, tl_seeds_around(ctx, p, 0.25, 100, &around));
    CHECK_EQ(around->vert_count, 100 * p->vert_count);
    around->vert_count = 100; /* those of the first point */
    CHECK(nearest_two(around) > 0.7 * 0.25 * sqrt(4 * 3.14159 / 100));
    for (size_t i = 0; i < 100; i++) {
        const double *x = around->xyz + 3 * i;
        CHECK_NEAR(hypot(hypot(x[0] - p->xyz[0], x[1] - p->xyz[1]), x[2] - p->xyz[2]), 0.25, 1e-12);
    }
    tl_polydata_destroy(ctx, around);
    tl_polydata_destroy(ctx, p);
    check_ctx_destroy(ctx);
}

/* A box has about as many seeds as asked for, however thin it is. */
static void thin_boxes_have_their_seeds(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    static const double BOXES[][6] = {{0, 1, 0, 1, 0, 1e-9},      {0, 1, 0, 1e-6, 0, 1e-6},
                                      {0, 1e-3, 0, 1, 0, 1e-300}, {0, 1e-200, 0, 1e-200, 0, 1e-200},
                                      {0, 1e200, 0, 1e200, 0, 1}, {0, 1, 0, 0.5, 0, 0.04}};
    for (size_t i = 0; i < sizeof BOXES / sizeof *BOXES; i++)
        for (size_t wanted = 1; wanted <= 100000; wanted *= 10) {
            tl_polydata *p = NULL;
            CHECK_OK(ctx, tl_seeds_box(ctx, BOXES[i], wanted, &p));
            CHECK(p->vert_count >= wanted / 2 && p->vert_count <= 2 * wanted);
            tl_polydata_destroy(ctx, p);
        }
    check_ctx_destroy(ctx);
}

static void impossible_seeds_are_refused(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_polydata *p = NULL, *one = NULL;
    const double x[3] = {0.5, 0.5, 0.5}, away[3] = {9, 9, 9}, none[3] = {0, 0, 0};
    const double lost[3] = {0, NAN, 0}, turned[6] = {0, 1, 1, 0, 0, 1}, up[3] = {0, 0, 1};
    CHECK_STATUS(tl_seeds_line(ctx, x, lost, 3, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_line(ctx, x, away, 0, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_line(ctx, x, away, SIZE_MAX, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_box(ctx, turned, 9, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_box(ctx, CUBE, 0, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_box(ctx, CUBE, SIZE_MAX, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_plane(ctx, x, none, CUBE, 9, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_plane(ctx, lost, x, CUBE, 9, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_plane(ctx, away, up, CUBE, 9, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_plane(ctx, x, up, CUBE, 0, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_plane(ctx, x, up, CUBE, SIZE_MAX, &p), TL_ERR_ARG);
    const double strip[6] = {0, 1, 0, 2e-2, 0, 1};
    CHECK_STATUS(tl_seeds_plane(ctx, x, up, strip, 16000000, &p), TL_ERR_ARG);
    CHECK_OK(ctx, tl_seeds_line(ctx, x, x, 1, &one));
    CHECK_STATUS(tl_seeds_around(ctx, one, 0, 5, &p), TL_ERR_ARG);
    CHECK_STATUS(tl_seeds_around(ctx, one, 1, SIZE_MAX, &p), TL_ERR_ARG);
    CHECK(!p);
    tl_polydata_destroy(ctx, one);
    check_ctx_destroy(ctx);
}

/* ---- critical points ---- */

/* 0 at (1, 2, 3) / 7 and nowhere else. */
static void one_zero(const double x[3], double v[3])
{
    double d[3] = {x[0] - 1.0 / 7, x[1] - 2.0 / 7, x[2] - 3.0 / 7};
    v[0] = d[0] + 2 * d[1];
    v[1] = d[1] - d[2];
    v[2] = d[0] + 3 * d[2];
}

/* 0 in the middle of the cube, where a vertex of a grid is. */
static void zero_in_the_middle(const double x[3], double v[3])
{
    for (int k = 0; k < 3; k++) v[k] = x[k] - 0.5;
}

/* 0 on a face of two tets of make_grid(2), away from its vertices: the diagonals' crossing. */
static void zero_on_a_face(const double x[3], double v[3])
{
    v[0] = x[0] - 1.0 / 3;
    v[1] = x[1] - 1.0 / 3;
    v[2] = x[2] - 1.0 / 3;
}

/* A wall where nothing flows, and no other zero. */
static void wall(const double x[3], double v[3])
{
    v[0] = x[2];
    v[1] = 2 * x[2];
    v[2] = 0;
}

static void nothing(const double x[3], double v[3])
{
    (void)x;
    v[0] = v[1] = v[2] = 0;
}

static void zeros_are_found_once(void **state)
{
    (void)state;
    static const struct {
        size_t grid;
        void (*flow)(const double x[3], double v[3]);
        size_t count;
        double at[3];
    } CASES[] = {{9, one_zero, 1, {1.0 / 7, 2.0 / 7, 3.0 / 7}},
                 {9, zero_in_the_middle, 1, {0.5, 0.5, 0.5}},
                 {2, zero_on_a_face, 1, {1.0 / 3, 1.0 / 3, 1.0 / 3}},
                 {9, wall, 0, {0}},
                 {9, nothing, 0, {0}}};
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++)
        for (unsigned threads = 1; threads <= 3; threads += 2) {
            tl_ctx *ctx = check_ctx_create(threads);
            make_mesh m = make_grid(CASES[i].grid);
            make_shuffle(&m, 21);
            double *v = malloc(3 * m.vert_count * sizeof *v);
            for (size_t k = 0; k < m.vert_count; k++) CASES[i].flow(m.xyz + 3 * k, v + 3 * k);
            tl_mesh *mesh = make_object(ctx, &m, NULL);
            tl_polydata *points = NULL;
            CHECK_OK(ctx, tl_critical_points(ctx, mesh, v, &points));
            CHECK_EQ(points->vert_count, CASES[i].count);
            CHECK_EQ(points->cell_count, CASES[i].count);
            for (size_t k = 0; CASES[i].count && k < 3; k++)
                CHECK_NEAR(points->xyz[k], CASES[i].at[k], 1e-12);
            tl_polydata_destroy(ctx, points);
            for (size_t k = 0; k < 3 * m.vert_count; k += 5) v[k] = (double)NAN;
            CHECK_OK(ctx, tl_critical_points(ctx, mesh, v, &points));
            tl_polydata_destroy(ctx, points);
            tl_mesh_destroy(mesh);
            free(v);
            make_release(&m);
            check_ctx_destroy(ctx);
        }
}

/* ---- lines that cover a box, lines through a box ---- */

/* Turning around the axis of the cube while it rises. */
static void screw(const double x[3], double v[3])
{
    v[0] = 0.5 - x[1];
    v[1] = x[0] - 0.5;
    v[2] = 0.1;
}

enum { CELLS = 6 };

static size_t cell_of(const double x[3])
{
    size_t cell = 0;
    for (int k = 0; k < 3; k++) {
        size_t at = (size_t)(x[k] * CELLS);
        cell = cell * CELLS + (at < CELLS ? at : CELLS - 1);
    }
    return cell;
}

/* Both parts of the lines, vertex by vertex. */
static void check_picked(tl_ctx *ctx, const tl_polydata *lines, const uint8_t *marks, size_t count)
{
    size_t vert_count = 0;
    for (int wanted = 0; wanted < 2; wanted++) {
        tl_polydata *part = NULL;
        size_t next = 0;
        CHECK_OK(ctx, tl_lines_pick(ctx, lines, marks, wanted, &part));
        CHECK_EQ(part->cell_count, wanted ? count : lines->cell_count - count);
        CHECK_EQ(part->channel_count, lines->channel_count);
        vert_count += part->vert_count;
        for (size_t c = 0; c < lines->cell_count; c++) {
            if (marks[c] != wanted) continue;
            CHECK_EQ(line_verts(part, next), line_verts(lines, c));
            for (size_t i = 0; i < line_verts(lines, c); i++) {
                const double *a = line_vert(lines, c, i), *b = line_vert(part, next, i);
                size_t was = (size_t)(a - lines->xyz) / 3, is = (size_t)(b - part->xyz) / 3;
                CHECK(memcmp(a, b, 3 * sizeof *a) == 0);
                CHECK(part->channels[1].values[is] == lines->channels[1].values[was]);
            }
            next++;
        }
        tl_polydata_destroy(ctx, part);
    }
    CHECK_EQ(vert_count, lines->vert_count);
}

/* Lines through a box against points on them. */
static void check_in_box(tl_ctx *ctx, const tl_polydata *lines)
{
    const double box[6] = {0.45, 0.55, 0.1, 0.2, -1, 2};
    uint8_t *selected = malloc(lines->cell_count);
    size_t count = tl_lines_in_box(lines, box, selected), brute = 0;
    for (size_t c = 0; c < lines->cell_count; c++) {
        bool in = false;
        for (size_t i = lines->starts[c]; i + 1 < lines->starts[c + 1]; i++)
            for (int part = 0; part <= 64; part++) {
                const double *a = lines->xyz + 3 * i;
                double w = part / 64.0, x = a[0] + w * (a[3] - a[0]), y = a[1] + w * (a[4] - a[1]);
                in = in || (x > 0.45 && x < 0.55 && y > 0.1 && y < 0.2);
            }
        CHECK_EQ(selected[c], in);
        brute += in;
    }
    CHECK_EQ(count, brute);
    CHECK(count > 0 && count < lines->cell_count);
    check_picked(ctx, lines, selected, count);
    free(selected);
}

static void lines_cover_every_cell(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(9);
    double *v = malloc(3 * m.vert_count * sizeof *v);
    for (size_t k = 0; k < m.vert_count; k++) screw(m.xyz + 3 * k, v + 3 * k);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    tl_polydata *lines = NULL;
    tl_stream_report report;
    uint8_t covered[CELLS * CELLS * CELLS] = {0};
    CHECK_OK(ctx,
             tl_streamlines_cover(ctx, mesh, NULL, NULL, v, NULL, CELLS, NULL, &lines, &report));
    for (size_t c = 0; c < lines->cell_count; c++) {
        size_t seed = lines->starts[c];
        while (lines->channels[0].values[seed] < 0) seed++;
        CHECK(!covered[cell_of(lines->xyz + 3 * seed)]); /* by none of the lines before */
        for (size_t i = lines->starts[c]; i + 1 < lines->starts[c + 1]; i++)
            for (int part = 0; part <= 16; part++) {
                double x[3];
                for (size_t k = 0; k < 3; k++)
                    x[k] = lines->xyz[3 * i + k] +
                           part / 16.0 * (lines->xyz[3 * i + 3 + k] - lines->xyz[3 * i + k]);
                covered[cell_of(x)] = 1;
            }
    }
    for (size_t i = 0; i < sizeof covered; i++) CHECK_EQ(covered[i], 1);
    CHECK_EQ(lines->cell_count + report.seeds_covered + report.seeds_outside, sizeof covered);
    CHECK(lines->cell_count < sizeof covered / 2);
    check_in_box(ctx, lines);
    tl_polydata_destroy(ctx, lines);
    const double speck[6] = {0.5, 0.5 + 1e-9, 0.5, 0.5 + 1e-9, 0.5, 0.5 + 1e-9};
    CHECK_OK(ctx, tl_streamlines_cover(ctx, mesh, NULL, NULL, v, speck, 8, NULL, &lines, NULL));
    CHECK(lines->cell_count >= 64 / 2); /* about one for each cell across the flow */
    tl_polydata_destroy(ctx, lines);
    const double flat[6] = {0, 0, 0, 0, 0, 0};
    CHECK_STATUS(tl_streamlines_cover(ctx, mesh, NULL, NULL, v, flat, 5, NULL, &lines, NULL),
                 TL_ERR_ARG);
    CHECK_STATUS(tl_streamlines_cover(ctx, mesh, NULL, NULL, v, NULL, 0, NULL, &lines, NULL),
                 TL_ERR_ARG);
    CHECK_STATUS(tl_streamlines_cover(ctx, mesh, NULL, NULL, v, NULL, 5000, NULL, &lines, NULL),
                 TL_ERR_ARG);
    tl_mesh_destroy(mesh);
    free(v);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(seeds_are_even),
        cmocka_unit_test(thin_boxes_have_their_seeds),
        cmocka_unit_test(impossible_seeds_are_refused),
        cmocka_unit_test(zeros_are_found_once),
        cmocka_unit_test(lines_cover_every_cell),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
