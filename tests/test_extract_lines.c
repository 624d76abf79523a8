/* Streamlines: fields whose lines are known, the flow past a sphere by its stream function, a cut
 * of several levels, rules that end a line, bad tets and numbers, one result for any number of
 * threads.
 */
#include "check.h"

#include "tetralod/extract.h"

#include "check_ctx.h"
#include "check_lines.h"
#include "fail_alloc.h"
#include "make_mesh.h"

typedef void (*flow)(const double x[3], double v[3]);

static void flow_along(const double x[3], double v[3])
{
    (void)x;
    v[0] = 3;
    v[1] = 0;
    v[2] = 4;
}

static void flow_around(const double x[3], double v[3])
{
    v[0] = 0.5 - x[1];
    v[1] = x[0] - 0.5;
    v[2] = 0;
}

/* Into the plane x = 1/2 and out along y: x y stays as it is. */
static void flow_saddle(const double x[3], double v[3])
{
    v[0] = -(x[0] - 0.5);
    v[1] = x[1] - 0.5;
    v[2] = 0;
}

static void flow_sink(const double x[3], double v[3])
{
    for (int k = 0; k < 3; k++) v[k] = 0.4 - x[k];
}

static double *field_of(const make_mesh *m, flow f)
{
    double *v = malloc((3 * m->vert_count + 1) * sizeof *v);
    if (!v) abort();
    for (size_t i = 0; i < m->vert_count; i++) f(m->xyz + 3 * i, v + 3 * i);
    return v;
}

/* A mesh, a field on it. */
typedef struct scene {
    tl_ctx *ctx;
    make_mesh shape;
    tl_mesh *mesh;
    double *vectors;
} scene;

static scene scene_of(make_mesh shape, flow f, unsigned threads)
{
    scene s = {.ctx = check_ctx_create(threads), .shape = shape};
    s.vectors = field_of(&s.shape, f);
    s.mesh = make_object(s.ctx, &s.shape, NULL);
    return s;
}

/* A cube of uneven tets whose outer vertices lie on its sides. */
static scene scene_open(flow f, unsigned threads)
{
    make_mesh m = make_grid(12);
    uint64_t seed = 5;
    for (size_t i = 0; i < 3 * m.vert_count; i++)
        if (m.xyz[i] > 0.01 && m.xyz[i] < 0.99) m.xyz[i] += 0.007 * (2 * make_uniform(&seed) - 1);
    make_shuffle(&m, 9);
    return scene_of(m, f, threads);
}

static void scene_close(scene *s)
{
    tl_mesh_destroy(s->mesh);
    free(s->vectors);
    make_release(&s->shape);
    check_ctx_destroy(s->ctx);
}

static tl_polydata *trace(const scene *s, const double *seeds, size_t seed_count,
                          const tl_stream_opts *opts, tl_stream_report *report)
{
    tl_polydata *lines = NULL;
    CHECK_OK(s->ctx, tl_streamlines(s->ctx, s->mesh, NULL, NULL, s->vectors, seeds, seed_count,
                                    opts, &lines, report));
    return lines;
}

/* Straight lines from side to side, with their time and what is carried. */
static void constant_flow_is_straight(void **state)
{
    (void)state;
    scene s = scene_open(flow_along, 2);
    const double seed[3] = {0.3, 0.45, 0.2};
    for (unsigned order = 2; order <= 5; order += 3) {
        size_t carried = 0;
        tl_stream_report report;
        tl_stream_opts opts = tl_stream_opts_defaults();
        double *x = malloc(s.shape.vert_count * sizeof *x);
        for (size_t i = 0; i < s.shape.vert_count; i++) x[i] = 7 * s.shape.xyz[3 * i];
        tl_channel channel = {"time", "K", 1, TL_ON_VERTEX, TL_F64, x};
        if (order == 2) CHECK_OK(s.ctx, tl_mesh_add_channel(s.mesh, &channel));
        free(x);
        opts.order = order;
        opts.channels = &carried;
        opts.channel_count = 1;
        tl_polydata *lines = trace(&s, seed, 1, &opts, &report);
        CHECK_EQ(lines->cell_count, 1);
        CHECK_EQ(report.ends[TL_STREAM_END_BOUNDARY], 2);
        CHECK_EQ(lines->channel_count, 3);
        CHECK(!strcmp(lines->channels[0].name, "time_2"));
        CHECK(!strcmp(lines->channels[1].name, "speed"));
        CHECK(!strcmp(lines->channels[2].name, "time"));
        size_t n = line_verts(lines, 0);
        const double *first = line_vert(lines, 0, 0), *last = line_vert(lines, 0, n - 1);
        CHECK_NEAR(first[2], 0, 1e-9);
        CHECK_NEAR(first[0], 0.15, 1e-9);
        CHECK_NEAR(last[0], 0.9, 1e-9);
        CHECK_NEAR(last[2], 1, 1e-9);
        CHECK_NEAR(lines->channels[0].values[0], -0.05, 1e-9);
        CHECK_NEAR(lines->channels[0].values[n - 1], 0.2, 1e-9);
        CHECK_NEAR(tl_polydata_size(lines), 1.25, 1e-9);
        for (size_t i = 0; i < n; i++) {
            CHECK_NEAR(line_vert(lines, 0, i)[1], 0.45, 1e-12);
            CHECK_NEAR(lines->channels[1].values[i], 5, 1e-9);
            CHECK_NEAR(lines->channels[2].values[i], 7 * line_vert(lines, 0, i)[0], 1e-9);
            if (i) CHECK(lines->channels[0].values[i] > lines->channels[0].values[i - 1]);
        }
        tl_polydata_destroy(s.ctx, lines);
    }
    scene_close(&s);
}

/* Circles, which end as loops; a sink, which ends at a speed; linear fields have no error but that
 * of the steps. */
static void linear_flows_keep_what_they_keep(void **state)
{
    (void)state;
    scene s = scene_open(flow_around, 2);
    const double seeds[6] = {0.8, 0.5, 0.3, 0.5, 0.93, 0.7};
    for (unsigned order = 2; order <= 5; order += 3) {
        tl_stream_report report;
        tl_stream_opts opts = tl_stream_opts_defaults();
        opts.order = order;
        opts.step = order == 2 ? 0.25 : 2;
        tl_polydata *lines = trace(&s, seeds, 2, &opts, &report);
        CHECK_EQ(lines->cell_count, 2);
        CHECK_EQ(report.ends[TL_STREAM_END_LOOP], 2);
        double worst = 0;
        for (size_t line = 0; line < 2; line++) {
            double radius = line ? 0.43 : 0.3;
            for (size_t i = 0; i < line_verts(lines, line); i++) {
                const double *x = line_vert(lines, line, i);
                worst = fmax(worst, fabs(hypot(x[0] - 0.5, x[1] - 0.5) - radius));
                CHECK_NEAR(x[2], seeds[3 * line + 2], 1e-12);
            }
        }
        CHECK_NEAR(tl_polydata_size(lines), 2 * 3.14159265 * 0.73, order == 2 ? 0.1 : 0.2);
        CHECK_BOUND(order == 2 ? "radius, order 2" : "radius, order 5", worst,
                    order == 2 ? 2e-3 : 2e-6);
        tl_polydata_destroy(s.ctx, lines);
    }
    scene_close(&s);
}

static void saddle_keeps_its_product(void **state)
{
    (void)state;
    scene s = scene_open(flow_saddle, 1);
    const double seed[3] = {0.9, 0.55, 0.3};
    double worst[2];
    for (int i = 0; i < 2; i++) {
        tl_stream_opts opts = tl_stream_opts_defaults();
        opts.step = i ? 0.25 : 0.5;
        tl_polydata *lines = trace(&s, seed, 1, &opts, NULL);
        worst[i] = 0;
        for (size_t k = 0; k < line_verts(lines, 0); k++) {
            const double *x = line_vert(lines, 0, k);
            worst[i] = fmax(worst[i], fabs((x[0] - 0.5) * (x[1] - 0.5) - 0.02));
        }
        tl_polydata_destroy(s.ctx, lines);
    }
    CHECK_BOUND("product, step 1/2", worst[0], 3e-4);
    CHECK_BOUND("product, step 1/4: second order", worst[1], worst[0] / 3);
    scene_close(&s);
}

static void rules_end_lines(void **state)
{
    (void)state;
    scene s = scene_open(flow_sink, 1);
    const double seed[3] = {0.9, 0.8, 0.7};
    double way = sqrt(0.25 + 0.16 + 0.09);
    tl_stream_report report;
    tl_stream_opts opts = tl_stream_opts_defaults();
    opts.direction = TL_STREAM_FORWARD;
    tl_polydata *lines = trace(&s, seed, 1, &opts, &report);
    CHECK_EQ(report.ends[TL_STREAM_END_SPEED], 1);
    CHECK_NEAR(tl_polydata_size(lines), way, 1e-4);
    tl_polydata_destroy(s.ctx, lines);
    for (unsigned order = 2; order <= 5; order += 3) {
        opts.order = order;
        opts.length_max = 0.125;
        lines = trace(&s, seed, 1, &opts, &report);
        CHECK_EQ(report.ends[TL_STREAM_END_LENGTH], 1);
        CHECK_NEAR(tl_polydata_size(lines), 0.125, 1e-6);
        tl_polydata_destroy(s.ctx, lines);
        opts.length_max = 0;
        opts.time_max = 1;
        lines = trace(&s, seed, 1, &opts, &report);
        CHECK_EQ(report.ends[TL_STREAM_END_TIME], 1);
        CHECK_NEAR(tl_polydata_size(lines), way * (1 - exp(-1.0)), order == 2 ? 5e-3 : 1e-6);
        tl_polydata_destroy(s.ctx, lines);
        opts.time_max = 0;
    }
    opts.step_max = 3;
    lines = trace(&s, seed, 1, &opts, &report);
    CHECK_EQ(report.ends[TL_STREAM_END_STEPS], 1);
    CHECK_EQ(report.steps, 3);
    CHECK_EQ(lines->vert_count, 4);
    tl_polydata_destroy(s.ctx, lines);
    opts.step_max = 10000;
    opts.direction = TL_STREAM_BACKWARD;
    lines = trace(&s, seed, 1, &opts, &report);
    CHECK_EQ(report.ends[TL_STREAM_END_BOUNDARY], 1);
    CHECK_NEAR(line_vert(lines, 0, 0)[0], 1, 1e-9);
    CHECK_NEAR(lines->channels[0].values[lines->vert_count - 1], 0, 0);
    tl_polydata_destroy(s.ctx, lines);
    scene_close(&s);
}

/* ---- bad input ---- */

static void seeds_lie_anywhere(void **state)
{
    (void)state;
    scene s = scene_of(make_grid(5), flow_along, 1);
    /* vertices, edges, faces of the grid, its corners; outside; no numbers */
    const double seeds[] = {0.5, 0.5, 0.5,  0.25, 0.3, 0.5, 0.25, 0.3,      0.1, 0,    0,
                            0,   1,   1,    1,    0,   0.5, 0.5,  -0.1,     0.5, 0.5,  2,
                            2,   2,   0.25, 0.5,  0,   0.5, NAN,  INFINITY, 0.5, 0.25, 0.75};
    size_t count = sizeof seeds / sizeof *seeds / 3;
    tl_stream_report report;
    tl_polydata *lines = trace(&s, seeds, count, NULL, &report);
    CHECK_EQ(report.seeds_outside, 3);
    CHECK_EQ(lines->cell_count, count - 3);
    CHECK_EQ(report.ends[TL_STREAM_END_BOUNDARY], 2 * (count - 3));
    for (size_t c = 0; c < lines->cell_count; c++)
        for (size_t i = 1; i < line_verts(lines, c); i++) {
            const double *a = line_vert(lines, c, i - 1), *b = line_vert(lines, c, i);
            CHECK_NEAR((b[0] - a[0]) * 4, (b[2] - a[2]) * 3, 1e-9);
            CHECK(b[2] >= a[2]);
        }
    tl_polydata_destroy(s.ctx, lines);
    scene_close(&s);
}

/* Lines along a flat side stay on it, whatever rounding says. */
static void sides_are_followed(void **state)
{
    (void)state;
    scene s = scene_open(flow_around, 1);
    const double seeds[6] = {0.7, 0.5, 0, 0.5, 0.8, 1};
    tl_stream_report report;
    tl_polydata *lines = trace(&s, seeds, 2, NULL, &report);
    CHECK_EQ(lines->cell_count, 2);
    CHECK_EQ(report.ends[TL_STREAM_END_BOUNDARY], 0);
    CHECK_EQ(report.ends[TL_STREAM_END_LOOP], 2);
    tl_polydata_destroy(s.ctx, lines);
    scene_close(&s);
}

/* Some tets flat, some inverted, some vertices and vectors no numbers: lines end, and are finite.
 */
static void bad_tets_end_no_program(void **state)
{
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        make_mesh m = kind == 3 ? make_soup(60, 400, 3) : make_grid(7);
        uint64_t seed = 11;
        for (size_t t = 0; kind == 1 && t < m.tet_count; t += 7) { /* turns a tet over */
            tl_lidx kept = m.tets[4 * t];
            m.tets[4 * t] = m.tets[4 * t + 1];
            m.tets[4 * t + 1] = kept;
        }
        if (kind == 2) make_perturb(&m, 0.12, 17); /* flat and folded ones */
        scene s = scene_of(m, kind == 3 ? flow_sink : flow_around, 2);
        for (size_t v = 0; kind == 0 && v < s.shape.vert_count; v += 13)
            s.vectors[3 * v] = v % 2 ? (double)NAN : (double)INFINITY;
        double seeds[3 * 200];
        for (int i = 0; i < 3 * 200; i++) seeds[i] = make_uniform(&seed);
        for (unsigned order = 2; order <= 5; order += 3) {
            tl_stream_report report;
            tl_stream_opts opts = tl_stream_opts_defaults();
            opts.order = order;
            tl_polydata *lines = trace(&s, seeds, 200, &opts, &report);
            CHECK(lines->cell_count > 50);
            CHECK_EQ(lines->cell_count + report.seeds_outside, 200);
            CHECK(kind || report.ends[TL_STREAM_END_VALUE] > 0);
            for (size_t i = 0; i < 3 * lines->vert_count; i++) CHECK(isfinite(lines->xyz[i]));
            tl_polydata_destroy(s.ctx, lines);
        }
        scene_close(&s);
    }
}

static void empty_and_lost_meshes_have_no_lines(void **state)
{
    (void)state;
    const double seed[3] = {0.5, 0.5, 0.5};
    for (int kind = 0; kind < 2; kind++) {
        make_mesh m = kind ? make_grid(3) : make_room(0, 0);
        for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] = (double)NAN;
        scene s = scene_of(m, flow_along, 1);
        tl_stream_report report;
        tl_polydata *lines = trace(&s, seed, 1, NULL, &report);
        CHECK_EQ(lines->cell_count, 0);
        CHECK_EQ(lines->vert_count, 0);
        CHECK_EQ(lines->starts[0], 0);
        CHECK_EQ(report.seeds_outside, 1);
        tl_polydata_destroy(s.ctx, lines);
        lines = trace(&s, seed, 0, NULL, &report);
        CHECK_EQ(lines->cell_count, 0);
        tl_polydata_destroy(s.ctx, lines);
        scene_close(&s);
    }
}

static void options_are_checked(void **state)
{
    (void)state;
    scene s = scene_open(flow_along, 1);
    const double seed[3] = {0.5, 0.5, 0.5};
    size_t none = 3;
    for (int kind = 0; kind < 10; kind++) {
        tl_polydata *lines = NULL;
        tl_stream_opts o = tl_stream_opts_defaults();
        if (kind == 0) o.order = 4;
        if (kind == 1) o.direction = 0;
        if (kind == 2) o.step = -1;
        if (kind == 3) o.step = (double)NAN;
        if (kind == 4) o.tolerance = 0;
        if (kind == 5) o.length_max = (double)NAN;
        if (kind == 6) o.time_max = -1;
        if (kind == 7) o.step_max = 0;
        if (kind == 8) o.speed_min = 2;
        if (kind == 9) o.channels = &none;
        if (kind == 9) o.channel_count = 1;
        CHECK_STATUS(
            tl_streamlines(s.ctx, s.mesh, NULL, NULL, s.vectors, seed, 1, &o, &lines, NULL),
            TL_ERR_ARG);
        CHECK(!lines && *tl_ctx_message(s.ctx));
    }
    scene_close(&s);
}

/* ---- threads, memory ---- */

static tl_polydata *trace_many(const scene *s, bool cover)
{
    double seeds[3 * 300];
    uint64_t seed = 3;
    tl_polydata *lines = NULL;
    for (int i = 0; i < 3 * 300; i++) seeds[i] = make_uniform(&seed);
    if (!cover) return trace(s, seeds, 300, NULL, NULL);
    CHECK_OK(s->ctx, tl_streamlines_cover(s->ctx, s->mesh, NULL, NULL, s->vectors, NULL, 12, NULL,
                                          &lines, NULL));
    return lines;
}

static void threads_change_nothing(void **state)
{
    (void)state;
    for (int cover = 0; cover < 2; cover++) {
        scene one = scene_open(flow_saddle, 1), three = scene_open(flow_saddle, 3);
        tl_polydata *a = trace_many(&one, cover), *b = trace_many(&three, cover);
        CHECK(a->cell_count > 30);
        CHECK_EQ(a->vert_count, b->vert_count);
        CHECK_EQ(a->cell_count, b->cell_count);
        CHECK(memcmp(a->xyz, b->xyz, 3 * a->vert_count * sizeof *a->xyz) == 0);
        CHECK(memcmp(a->starts, b->starts, (a->cell_count + 1) * sizeof *a->starts) == 0);
        for (size_t c = 0; c < 2; c++)
            CHECK(memcmp(a->channels[c].values, b->channels[c].values,
                         a->vert_count * sizeof(double)) == 0);
        tl_polydata_destroy(one.ctx, a);
        tl_polydata_destroy(three.ctx, b);
        scene_close(&one);
        scene_close(&three);
    }
}

typedef struct alloc_case {
    const make_mesh *shape;
    const double *vectors;
    bool cover;
} alloc_case;

static tl_status trace_in(tl_ctx *ctx, void *arg)
{
    const alloc_case *c = arg;
    const double seeds[6] = {0.5, 0.5, 0.5, 0.2, 0.3, 0.4};
    tl_mesh *mesh = NULL;
    tl_polydata *lines = NULL;
    tl_status st = tl_mesh_create(ctx, c->shape->xyz, c->shape->vert_count, c->shape->tets,
                                  c->shape->tet_count, &mesh);
    if (!st && c->cover)
        st = tl_streamlines_cover(ctx, mesh, NULL, NULL, c->vectors, NULL, 3, NULL, &lines, NULL);
    else if (!st)
        st = tl_streamlines(ctx, mesh, NULL, NULL, c->vectors, seeds, 2, NULL, &lines, NULL);
    CHECK(!st == !!lines);
    tl_polydata_destroy(ctx, lines);
    tl_mesh_destroy(mesh);
    return st;
}

static void failed_allocations_leave_nothing(void **state)
{
    (void)state;
    make_mesh m = make_grid(4);
    double *v = field_of(&m, flow_along);
    for (int cover = 0; cover < 2; cover++) {
        fail_alloc f;
        alloc_case c = {&m, v, cover};
        fail_alloc_open(&f, 1);
        CHECK(fail_alloc_each(&f, trace_in, &c) > 15);
        fail_alloc_close(&f);
    }
    free(v);
    make_release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(constant_flow_is_straight),
        cmocka_unit_test(linear_flows_keep_what_they_keep),
        cmocka_unit_test(saddle_keeps_its_product),
        cmocka_unit_test(rules_end_lines),
        cmocka_unit_test(seeds_lie_anywhere),
        cmocka_unit_test(sides_are_followed),
        cmocka_unit_test(bad_tets_end_no_program),
        cmocka_unit_test(empty_and_lost_meshes_have_no_lines),
        cmocka_unit_test(options_are_checked),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(failed_allocations_leave_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
