/* tl_mesh_compare: field errors with known values and against brute force, what is left out,
 * refused and cancelled. */
#include "check_ctx.h"

#include "fail_alloc.h"
#include "make_mesh.h"
#include "measure/measure.h"

/* ---- meshes ---- */

static double field_linear(const double x[3])
{
    return 3 * x[0] - 2 * x[1] + 0.5 * x[2] + 7;
}

static double field_square(const double x[3])
{
    return x[0] * x[0];
}

static double field_x(const double x[3])
{
    return x[0];
}

static double field_wavy(const double x[3])
{
    return sin(9 * x[0]) * cos(7 * x[1]) + x[2] * x[2];
}

static void add_values(tl_ctx *ctx, tl_mesh *mesh, const char *name, uint32_t components, tl_on on,
                       const double *values)
{
    tl_channel channel = {name, "", components, on, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
}

/* A vector channel "v" on vertices and channels "t", "w" (1 and 2 components) on tets. */
static void add_channels(tl_ctx *ctx, tl_mesh *mesh)
{
    size_t count = mesh->vert_count > mesh->tet_count ? mesh->vert_count : mesh->tet_count;
    double *values = malloc((3 * count + 1) * sizeof *values);
    if (!values) abort();
    for (size_t v = 0; v < mesh->vert_count; v++) {
        const double *x = mesh->xyz + 3 * v;
        values[3 * v] = field_wavy(x);
        values[3 * v + 1] = field_linear(x);
        values[3 * v + 2] = field_square(x);
    }
    add_values(ctx, mesh, "v", 3, TL_ON_VERTEX, values);
    for (size_t t = 0; t < mesh->tet_count; t++) values[t] = (double)(t % 101);
    add_values(ctx, mesh, "t", 1, TL_ON_TET, values);
    for (size_t t = 0; t < 2 * mesh->tet_count; t++) values[t] = (double)(t % 37);
    add_values(ctx, mesh, "w", 2, TL_ON_TET, values);
    free(values);
}

static void scale(make_mesh *m, double factor, double offset)
{
    for (size_t i = 0; i < 3 * m->vert_count; i++) m->xyz[i] = factor * m->xyz[i] + offset;
}

static tl_compare_result compare(tl_ctx *ctx, const tl_mesh *a, const tl_mesh *b,
                                 const tl_compare_opts *opts)
{
    tl_compare_result r;
    CHECK_OK(ctx, tl_mesh_compare(ctx, a, b, opts, &r));
    return r;
}

static tl_field_error compare_fields(tl_ctx *ctx, make_mesh *a, make_mesh *b, make_field field)
{
    tl_compare_opts opts = tl_compare_opts_defaults();
    opts.skip_boundary = true;
    tl_mesh *ma = make_object(ctx, a, field), *mb = make_object(ctx, b, field);
    tl_compare_result r = compare(ctx, ma, mb, &opts);
    CHECK_EQ(r.field_count, 1);
    tl_field_error f = r.fields[0];
    CHECK(strcmp(f.name, "f") == 0);
    f.name = NULL;
    tl_compare_release(ctx, &r);
    tl_mesh_destroy(ma);
    tl_mesh_destroy(mb);
    return f;
}

/* ---- known errors ---- */

/* Also with flat tets, a second vertex at a place of another, and vertices of no tet. */
static void identical_is_zero(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid_cavity(10);
    (void)state;
    make_perturb(&m, 0.008, 3);
    make_mesh more = make_room(m.vert_count + 1, m.tet_count + 2);
    memcpy(more.xyz, m.xyz, 3 * m.vert_count * sizeof *m.xyz);
    memcpy(more.tets, m.tets, 4 * m.tet_count * sizeof *m.tets);
    memcpy(more.xyz + 3 * m.vert_count, m.xyz, 3 * sizeof *m.xyz); /* vertex 0 once more */
    const tl_lidx flat[8] = {0, 1, 1, 2, (tl_lidx)m.vert_count, 0, 1, 12};
    memcpy(more.tets + 4 * m.tet_count, flat, sizeof flat);
    tl_mesh *mesh = make_object(ctx, &more, field_wavy);
    add_channels(ctx, mesh);
    const tl_iso_request iso = {"f", 0.3};
    tl_compare_opts opts = tl_compare_opts_defaults();
    opts.isos = &iso;
    opts.iso_count = 1;
    tl_compare_result r = compare(ctx, mesh, mesh, &opts);
    CHECK_EQ(r.field_count, 4);
    for (size_t i = 0; i < r.field_count; i++) {
        CHECK(r.fields[i].rms == 0 && r.fields[i].max == 0 && r.fields[i].mean == 0);
        CHECK(r.fields[i].range[1] > r.fields[i].range[0]);
        CHECK_EQ(r.fields[i].nonfinite_count, 0);
    }
    CHECK_EQ(r.outside_vertices, 0);
    CHECK(r.outside_distance == 0);
    CHECK(r.boundary_mean == 0 && r.boundary_hausdorff == 0 && r.boundary_hausdorff_bound == 0);
    CHECK(r.isos[0].mean == 0 && r.isos[0].hausdorff_bound == 0 && r.isos[0].area[0] > 0);
    CHECK(r.volume[0] == r.volume[1] && r.area[0] == r.area[1]);
    CHECK_EQ(r.degenerate[0], 2);
    CHECK_EQ(r.degenerate[1], 2);
    tl_compare_release(ctx, &r);
    tl_mesh_destroy(mesh);
    make_release(&more);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* The same mesh in another order: the same to rounding. */
static void reordered_is_nearly_zero(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(11), other = make_grid(11);
    (void)state;
    make_perturb(&m, 0.008, 3);
    make_perturb(&other, 0.008, 3);
    make_shuffle(&other, 9);
    tl_field_error f = compare_fields(ctx, &m, &other, field_wavy);
    CHECK(f.rms == 0 && f.max == 0); /* every vertex is found again */
    CHECK_BOUND("mean of a reordered mesh", f.mean, 1e-14);
    make_release(&m);
    make_release(&other);
    check_ctx_destroy(ctx);
}

static void linear_fields_survive(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh fine = make_grid(15), coarse = make_grid(6);
    (void)state;
    tl_field_error f = compare_fields(ctx, &fine, &coarse, field_linear);
    CHECK_BOUND("rms of a linear field", f.rms, 1e-14);
    CHECK_BOUND("max of a linear field", f.max, 1e-13);
    CHECK_BOUND("mean of a linear field", f.mean, 1e-14);
    CHECK_NEAR(f.range[0], 5, 1e-14);
    CHECK_NEAR(f.range[1], 10.5, 1e-14);
    make_release(&fine);
    make_release(&coarse);
    check_ctx_destroy(ctx);
}

/* In a cell of the coarse grid all corners have one of two x, so x^2 is interpolated along x alone:
 * the error at the fine grid's middle planes is h^2 / 4, and the mean of the difference of both
 * interpolants, which is linear in each fine tet, h^2 / 8. */
static void square_field_as_computed(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    (void)state;
    for (size_t n = 1; n <= 8; n *= 2) {
        make_mesh fine = make_grid(2 * n + 1), coarse = make_grid(n + 1);
        double h = 1.0 / (double)n;
        tl_field_error f = compare_fields(ctx, &fine, &coarse, field_square);
        CHECK_NEAR(f.max, h * h / 4, 1e-14);
        CHECK_NEAR(f.rms, h * h / 4 * sqrt((double)n / (double)(2 * n + 1)), 1e-14);
        CHECK_NEAR(f.mean, h * h / 8, 1e-14);
        CHECK_NEAR(fmod(fine.xyz[3 * f.max_at], h), h / 2, 1e-14);
        make_release(&fine);
        make_release(&coarse);
    }
    check_ctx_destroy(ctx);
}

static void vectors_by_their_norm(void **state)
{
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(4);
    tl_mesh *a = make_object(ctx, &m, NULL), *b = make_object(ctx, &m, NULL);
    double va[64][3], vb[64][3], ta[135], tb[135];
    (void)state;
    for (int v = 0; v < 64; v++) {
        for (int k = 0; k < 3; k++) va[v][k] = v + k;
        vb[v][0] = va[v][0] + 3;
        vb[v][1] = va[v][1] - 4;
        vb[v][2] = va[v][2];
    }
    for (int t = 0; t < 135; t++) {
        ta[t] = t;
        tb[t] = t + (t == 17 ? 12 : 0);
    }
    CHECK_EQ(m.tet_count, 135);
    add_values(ctx, a, "v", 3, TL_ON_VERTEX, va[0]);
    add_values(ctx, b, "v", 3, TL_ON_VERTEX, vb[0]);
    add_values(ctx, a, "t", 1, TL_ON_TET, ta);
    add_values(ctx, b, "t", 1, TL_ON_TET, tb);
    tl_compare_result r = compare(ctx, a, b, NULL);
    CHECK_EQ(r.field_count, 2);
    CHECK_NEAR(r.fields[0].rms, 5, 1e-14);
    CHECK_NEAR(r.fields[0].max, 5, 1e-14);
    CHECK_NEAR(r.fields[0].mean, 5, 1e-13);
    CHECK_EQ(r.fields[0].components, 3);
    CHECK_NEAR(r.fields[0].range[1], sqrt(63.0 * 63 + 64 * 64 + 65 * 65), 1e-12);
    CHECK(r.fields[1].on == TL_ON_TET);
    CHECK_NEAR(r.fields[1].rms, 12 / sqrt(135), 1e-14);
    CHECK(r.fields[1].max == 12);
    CHECK_EQ(r.fields[1].max_at, 17);
    double p[4][3];
    for (int i = 0; i < 4; i++) memcpy(p[i], m.xyz + 3 * (size_t)m.tets[4 * 17 + i], sizeof p[i]);
    CHECK_NEAR(r.fields[1].mean, 12 * tl_tet_volume((const double(*)[3])p), 1e-14);
    tl_compare_release(ctx, &r);
    tl_mesh_destroy(a);
    tl_mesh_destroy(b);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void fill_halves(tl_ctx *ctx, tl_mesh *mesh)
{
    double *values = malloc(mesh->tet_count * sizeof *values);
    if (!values) abort();
    for (size_t t = 0; t < mesh->tet_count; t++) {
        double x = 0;
        for (size_t i = 0; i < 4; i++) x += mesh->xyz[3 * (size_t)mesh->tets[4 * t + i]] / 4;
        values[t] = x < 0.5 ? 1 : 3;
    }
    add_values(ctx, mesh, "half", 1, TL_ON_TET, values);
    free(values);
}

/* Two halves whose border both grids have, then one that the copy can only have in part. */
static void tet_channels_between_grids(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    static const size_t sizes[2] = {5, 4}; /* 0.5 is a plane of the first alone */
    (void)state;
    for (int n = 0; n < 2; n++) {
        make_mesh fine = make_grid(13), coarse = make_grid(sizes[n]);
        tl_mesh *a = make_object(ctx, &fine, NULL), *b = make_object(ctx, &coarse, NULL);
        fill_halves(ctx, a);
        fill_halves(ctx, b);
        tl_compare_result r = compare(ctx, a, b, NULL);
        if (n == 0) {
            CHECK(r.fields[0].rms == 0 && r.fields[0].max == 0);
            CHECK_NEAR(r.fields[0].mean, 0, 1e-15);
        } else {
            CHECK(r.fields[0].max == 2);
            CHECK(r.fields[0].mean > 0.01 && r.fields[0].mean < 2.0 / 3);
            CHECK(r.fields[0].rms < 2);
        }
        tl_compare_release(ctx, &r);
        tl_mesh_destroy(a);
        tl_mesh_destroy(b);
        make_release(&fine);
        make_release(&coarse);
    }
    check_ctx_destroy(ctx);
}

/* ---- brute force ---- */

static double brute_error(const tl_mesh *a, size_t v, const tl_mesh *b, double *distance)
{
    double best = (double)INFINITY, value = 0;
    for (size_t t = 0; t < b->tet_count; t++) {
        double p[4][3], w[4];
        for (size_t i = 0; i < 4; i++)
            memcpy(p[i], b->xyz + 3 * (size_t)b->tets[4 * t + i], sizeof p[i]);
        double d = tl_tet_nearest((const double(*)[3])p, a->xyz + 3 * v, w);
        if (d >= best) continue;
        best = d;
        value = 0;
        for (size_t i = 0; i < 4; i++) value += w[i] * b->channels[0].values[b->tets[4 * t + i]];
    }
    *distance = best;
    return fabs(a->channels[0].values[v] - value);
}

static void as_brute_force(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    (void)state;
    for (int n = 0; n < 3; n++) {
        make_mesh m = make_grid(9), other = n == 2 ? make_grid_cavity(7) : make_grid(5);
        make_perturb(&m, 0.01, 5);
        make_perturb(&other, 0.015, 6);
        make_shuffle(&other, 7);
        if (n == 1) scale(&other, 0.8, 0.07);
        tl_mesh *a = make_object(ctx, &m, field_wavy), *b = make_object(ctx, &other, field_wavy);
        double squares = 0, max = 0, far = 0;
        size_t outside = 0;
        for (size_t v = 0; v < a->vert_count; v++) {
            double distance, error = brute_error(a, v, b, &distance);
            squares += error * error;
            max = fmax(max, error);
            far = fmax(far, distance);
            outside += distance > 1e-9;
        }
        tl_compare_result r = compare(ctx, a, b, NULL);
        CHECK_NEAR(r.fields[0].rms, sqrt(squares / (double)a->vert_count), 1e-11);
        CHECK_NEAR(r.fields[0].max, max, 1e-11);
        CHECK_EQ(r.outside_vertices, outside);
        CHECK_NEAR(r.outside_distance, far, 1e-13);
        CHECK(outside > 0);
        tl_compare_release(ctx, &r);
        tl_mesh_destroy(a);
        tl_mesh_destroy(b);
        make_release(&m);
        make_release(&other);
    }
    check_ctx_destroy(ctx);
}

static void hints_change_nothing(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(9), other = make_grid(6);
    uint64_t seed = 4;
    (void)state;
    make_perturb(&other, 0.01, 6);
    tl_mesh *a = make_object(ctx, &m, field_wavy), *b = make_object(ctx, &other, field_wavy);
    tl_locator *locator = NULL;
    CHECK_OK(ctx, tl_locator_create(ctx, b, NULL, &locator));
    tl_lidx *hints = malloc(a->vert_count * sizeof *hints);
    tl_lidx *tets = malloc(a->vert_count * sizeof *tets);
    double(*weights)[4] = malloc(a->vert_count * sizeof *weights);
    double *distances = malloc(a->vert_count * sizeof *distances);
    double *errors = malloc(a->vert_count * sizeof *errors);
    if (!hints || !tets || !weights || !distances || !errors) abort();
    for (size_t v = 0; v < a->vert_count; v++)
        hints[v] = v % 3 ? (tl_lidx)(make_random(&seed) % b->tet_count) : (tl_lidx)TL_NONE;
    tl_field_error f[2];
    for (int n = 0; n < 2; n++) {
        CHECK_OK(ctx, tli_measure_vertices(ctx, a, b, locator, n ? hints : NULL, tets, weights,
                                           distances));
        CHECK_OK(ctx, tli_measure_channel(ctx, a, &a->channels[0], b, &b->channels[0], tets,
                                          (const double(*)[4])weights, errors, &f[n]));
        CHECK(errors[f[n].max_at] == f[n].max);
        for (size_t v = 0; v < a->vert_count; v++) {
            double sum = 0, x[3] = {0, 0, 0};
            CHECK(tets[v] < b->tet_count);
            for (size_t i = 0; i < 4; i++) {
                sum += weights[v][i];
                for (size_t k = 0; k < 3; k++)
                    x[k] += weights[v][i] * b->xyz[3 * (size_t)b->tets[4 * tets[v] + i] + k];
            }
            CHECK_NEAR(sum, 1, 1e-14);
            double d = hypot(hypot(x[0] - a->xyz[3 * v], x[1] - a->xyz[3 * v + 1]),
                             x[2] - a->xyz[3 * v + 2]);
            CHECK_NEAR(d, distances[v], 1e-13);
        }
    }
    CHECK_NEAR(f[0].rms, f[1].rms, 1e-13);
    CHECK_NEAR(f[0].max, f[1].max, 1e-13);
    CHECK_OK(ctx, tli_measure_vertices(ctx, a, b, locator, hints, NULL, NULL, NULL));
    free(hints);
    free(tets);
    free(weights);
    free(distances);
    free(errors);
    tl_locator_destroy(locator);
    tl_mesh_destroy(a);
    tl_mesh_destroy(b);
    make_release(&m);
    make_release(&other);
    check_ctx_destroy(ctx);
}

/* ---- outside, moved, in pieces ---- */

static void outside_is_projected(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(9), small = make_grid(5), away = make_grid(5);
    (void)state;
    scale(&small, 0.9, 0.05);
    scale(&away, 1, 10);
    tl_mesh *a = make_object(ctx, &m, field_x), *b = make_object(ctx, &small, field_x);
    tl_compare_result r = compare(ctx, a, b, NULL);
    CHECK_EQ(r.outside_vertices, 9 * 9 * 9 - 7 * 7 * 7);
    CHECK_NEAR(r.outside_distance, 0.05 * sqrt(3.0), 1e-14);
    CHECK_NEAR(r.fields[0].max, 0.05, 1e-14);
    CHECK_NEAR(r.fields[0].rms, 0.05 * sqrt(2.0 / 9), 1e-13);
    CHECK_NEAR(r.boundary_hausdorff, 0.05 * sqrt(3.0), 1e-14);
    CHECK_NEAR(r.boundary_one_sided[1], 0.05, 1e-14);
    CHECK_NEAR(r.volume[1], 0.9 * 0.9 * 0.9, 1e-12);
    CHECK_NEAR(r.area[1], 6 * 0.81, 1e-12);
    tl_compare_release(ctx, &r);
    tl_mesh_destroy(b);
    b = make_object(ctx, &away, field_x);
    r = compare(ctx, a, b, NULL);
    CHECK_EQ(r.outside_vertices, 729);
    CHECK_NEAR(r.outside_distance, 10 * sqrt(3.0), 1e-13);
    CHECK_NEAR(r.fields[0].max, 10, 1e-13); /* all project to x = 10, the nearest corner */
    CHECK_NEAR(r.boundary_hausdorff, 10 * sqrt(3.0), 1e-12);
    tl_compare_release(ctx, &r);
    tl_mesh_destroy(a);
    tl_mesh_destroy(b);
    make_release(&m);
    make_release(&small);
    make_release(&away);
    check_ctx_destroy(ctx);
}

static void moved_by_a_distance(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    static const double moves[] = {0.1, 0.003, 1e-7};
    (void)state;
    for (int n = 0; n < 3; n++) {
        make_mesh m = make_grid(9), moved = make_grid(6);
        for (size_t v = 0; v < moved.vert_count; v++) moved.xyz[3 * v] += moves[n];
        tl_mesh *a = make_object(ctx, &m, NULL), *b = make_object(ctx, &moved, NULL);
        tl_compare_result r = compare(ctx, a, b, NULL);
        CHECK_EQ(r.field_count, 0);
        CHECK_EQ(r.outside_vertices, 81);
        CHECK_NEAR(r.outside_distance, moves[n], 1e-15);
        CHECK_NEAR(r.boundary_hausdorff, moves[n], 1e-14);
        CHECK_BOUND("bound of a move", r.boundary_hausdorff_bound,
                    fmax(moves[n] * 1.01, moves[n] + 0.001 * r.boundary_step));
        /* two faces at the distance, four that slide within themselves but for the rim, which the
         * samples see as wide as half their step */
        double rim = moves[n] * fmax(moves[n], r.boundary_step);
        CHECK_NEAR(r.boundary_mean, moves[n] / 3, rim);
        CHECK(r.boundary_samples > 1000);
        tl_compare_release(ctx, &r);
        tl_mesh_destroy(a);
        tl_mesh_destroy(b);
        make_release(&m);
        make_release(&moved);
    }
    check_ctx_destroy(ctx);
}

/* Two cubes, one with a cavity, side by side. */
static make_mesh make_two(size_t n)
{
    make_mesh a = make_grid(n), b = make_grid_cavity(n);
    make_mesh m = make_room(a.vert_count + b.vert_count, a.tet_count + b.tet_count);
    scale(&b, 1, 0.5);
    for (size_t v = 0; v < b.vert_count; v++) b.xyz[3 * v] += 1.5;
    memcpy(m.xyz, a.xyz, 3 * a.vert_count * sizeof *m.xyz);
    memcpy(m.xyz + 3 * a.vert_count, b.xyz, 3 * b.vert_count * sizeof *m.xyz);
    memcpy(m.tets, a.tets, 4 * a.tet_count * sizeof *m.tets);
    for (size_t i = 0; i < 4 * b.tet_count; i++)
        m.tets[4 * a.tet_count + i] = b.tets[i] + (tl_lidx)a.vert_count;
    make_release(&a);
    make_release(&b);
    return m;
}

/* The cavity's inner vertices, which no tet has, hold values that would spoil the errors. */
static void components_and_cavities(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh fine = make_two(13), coarse = make_two(7);
    (void)state;
    tl_mesh *a = make_object(ctx, &fine, NULL), *b = make_object(ctx, &coarse, NULL);
    tl_mesh *pair[2] = {a, b};
    for (int side = 0; side < 2; side++) {
        double *values = malloc(pair[side]->vert_count * sizeof *values);
        uint8_t *used = calloc(pair[side]->vert_count, 1);
        if (!values || !used) abort();
        for (size_t i = 0; i < 4 * pair[side]->tet_count; i++) used[pair[side]->tets[i]] = 1;
        for (size_t v = 0; v < pair[side]->vert_count; v++)
            values[v] =
                !used[v] ? (v % 2 ? 1e9 : (double)NAN) : field_linear(pair[side]->xyz + 3 * v);
        add_values(ctx, pair[side], "f", 1, TL_ON_VERTEX, values);
        free(values);
        free(used);
    }
    tl_compare_result r = compare(ctx, a, b, NULL);
    for (int side = 0; side < 2; side++) {
        CHECK_EQ(r.components[side], 2);
        CHECK_NEAR(r.volume[side], 2 - 1.0 / 27, 1e-12);
        CHECK_NEAR(r.area[side], 12 + 6.0 / 9, 1e-12);
        CHECK_EQ(r.inverted[side] + r.degenerate[side] + r.nonmanifold_faces[side], 0);
    }
    CHECK_EQ(r.outside_vertices, 0);
    CHECK_EQ(r.fields[0].nonfinite_count, 0);
    CHECK_BOUND("max of a linear field", r.fields[0].max, 1e-13);
    CHECK_BOUND("mean of a linear field", r.fields[0].mean, 1e-13);
    CHECK_BOUND("boundary of equal shapes", r.boundary_hausdorff_bound, 0.001 * r.boundary_step);
    tl_compare_release(ctx, &r);
    tl_mesh_destroy(a);
    tl_mesh_destroy(b);
    make_release(&fine);
    make_release(&coarse);
    check_ctx_destroy(ctx);
}

/* ---- values that are none ---- */

static void values_that_are_not_finite(void **state)
{
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(5);
    double f[125], g[125], *t = malloc(m.tet_count * sizeof *t);
    (void)state;
    if (!t) abort();
    for (size_t v = 0; v < 125; v++) f[v] = g[v] = (double)v;
    for (size_t i = 0; i < m.tet_count; i++) t[i] = 1;
    f[0] = (double)NAN;
    f[77] = (double)INFINITY;
    f[124] = -(double)INFINITY;
    t[3] = (double)NAN;
    tl_mesh *a = make_object(ctx, &m, NULL), *b = make_object(ctx, &m, NULL);
    add_values(ctx, a, "f", 1, TL_ON_VERTEX, f);
    add_values(ctx, b, "f", 1, TL_ON_VERTEX, g);
    add_values(ctx, a, "t", 1, TL_ON_TET, t);
    t[3] = 2;
    t[4] = 2;
    add_values(ctx, b, "t", 1, TL_ON_TET, t);
    tl_compare_result r = compare(ctx, a, b, NULL);
    CHECK_EQ(r.fields[0].nonfinite_count, 3);
    CHECK(r.fields[0].rms == 0 && r.fields[0].max == 0 && r.fields[0].mean == 0);
    CHECK(r.fields[0].range[0] == 1 && r.fields[0].range[1] == 123);
    CHECK_EQ(r.fields[1].nonfinite_count, 1);
    CHECK(r.fields[1].max == 1);
    CHECK_EQ(r.fields[1].max_at, 4);
    CHECK_NEAR(r.fields[1].rms, sqrt(1.0 / (double)(m.tet_count - 1)), 1e-15);
    tl_compare_release(ctx, &r);
    r = compare(ctx, b, a, NULL); /* the copy lacks values: no error is large enough */
    CHECK(isinf(r.fields[0].max) && isinf(r.fields[0].rms) && isinf(r.fields[0].mean));
    CHECK_EQ(r.fields[0].nonfinite_count, 0);
    tl_compare_release(ctx, &r);
    free(t);
    tl_mesh_destroy(a);
    tl_mesh_destroy(b);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Channels count as common by name, place and components. */
static void channels_in_common(void **state)
{
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(3);
    double values[3 * 40] = {0};
    (void)state;
    tl_mesh *a = make_object(ctx, &m, NULL), *b = make_object(ctx, &m, NULL);
    tl_compare_result r = compare(ctx, a, b, NULL);
    CHECK_EQ(r.field_count, 0);
    tl_compare_release(ctx, &r);
    add_values(ctx, a, "p", 1, TL_ON_VERTEX, values);
    add_values(ctx, b, "p", 3, TL_ON_VERTEX, values);
    add_values(ctx, a, "q", 1, TL_ON_VERTEX, values);
    add_values(ctx, b, "q", 1, TL_ON_TET, values);
    add_values(ctx, a, "s", 1, TL_ON_TET, values);
    add_values(ctx, b, "r", 1, TL_ON_TET, values);
    add_values(ctx, b, "s", 1, TL_ON_TET, values);
    r = compare(ctx, a, b, NULL);
    CHECK_EQ(r.field_count, 1);
    CHECK(strcmp(r.fields[0].name, "s") == 0);
    CHECK(r.fields[0].name == a->channels[2].name);
    tl_compare_release(ctx, &r);
    tl_compare_release(ctx, &r); /* harmless */
    tl_compare_release(ctx, NULL);
    tl_mesh_destroy(a);
    tl_mesh_destroy(b);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* ---- refused and ended ---- */

static void check_refused(tl_ctx *ctx, const tl_mesh *a, const tl_mesh *b,
                          const tl_compare_opts *opts, tl_status expected, const char *says)
{
    tl_compare_result r;
    CHECK_STATUS(tl_mesh_compare(ctx, a, b, opts, &r), expected);
    if (!strstr(tl_ctx_message(ctx), says))
        fail_msg("'%s' does not say '%s'", tl_ctx_message(ctx), says);
    CHECK(r.fields == NULL && r.isos == NULL && r.field_count == 0);
}

static void bad_meshes(void **state)
{
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(3), none = make_room(3, 0), broken = make_grid(3);
    (void)state;
    broken.xyz[3 * 26 + 1] = (double)NAN;
    tl_mesh *a = make_object(ctx, &m, field_x), *b = make_object(ctx, &none, field_x);
    tl_mesh *c = make_object(ctx, &broken, field_x);
    check_refused(ctx, a, b, NULL, TL_ERR_DATA, "the copy has no tets");
    check_refused(ctx, b, a, NULL, TL_ERR_DATA, "the original has no tets");
    check_refused(ctx, a, c, NULL, TL_ERR_DATA, "vertex 26");
    check_refused(ctx, c, a, NULL, TL_ERR_DATA, "the original can't be compared");
    for (size_t i = 0; i < 3 * m.vert_count; i++) m.xyz[i] *= 1e200;
    tl_mesh *d = make_object(ctx, &m, field_x);
    check_refused(ctx, a, d, NULL, TL_ERR_DATA, "overflows");
    tl_mesh_destroy(d);
    tl_mesh_destroy(a);
    tl_mesh_destroy(b);
    tl_mesh_destroy(c);
    make_release(&m);
    make_release(&none);
    make_release(&broken);
    check_ctx_destroy(ctx);
}

/* A tet without volume has no part in a mean, whatever the copy's values there. */
static void flat_tets_have_no_mean(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    const double xyz[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0};
    const tl_lidx tets[8] = {0, 1, 2, 3, 1, 4, 2, 0};
    const double ids[2] = {1, 2}, wrong[2] = {1.5, (double)INFINITY};
    tl_mesh *a = NULL, *b = NULL;
    CHECK_STATUS(tl_mesh_create(ctx, xyz, 5, tets, 2, &a), TL_OK);
    CHECK_STATUS(tl_mesh_create(ctx, xyz, 5, tets, 2, &b), TL_OK);
    add_values(ctx, a, "t", 1, TL_ON_TET, ids);
    add_values(ctx, b, "t", 1, TL_ON_TET, wrong);
    tl_compare_result r = compare(ctx, a, b, NULL);
    CHECK(r.fields[0].max == (double)INFINITY);
    CHECK_NEAR(r.fields[0].mean, 0.5, 1e-15);
    tl_compare_release(ctx, &r);
    tl_mesh_destroy(b);
    tl_mesh_destroy(a);
    check_ctx_destroy(ctx);
}

static void bad_options(void **state)
{
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(3);
    (void)state;
    tl_mesh *a = make_object(ctx, &m, field_x);
    add_channels(ctx, a);
    static const double steps[] = {-1, 1e-9, (double)INFINITY};
    static const tl_iso_request isos[] = {{"nope", 1}, {"v", 1}, {"t", 1}, {NULL, 1}};
    tl_compare_opts opts = tl_compare_opts_defaults();
    for (int i = 0; i < 3; i++) {
        opts.sample_step = steps[i];
        check_refused(ctx, a, a, &opts, TL_ERR_ARG, "a sample step of");
    }
    opts = tl_compare_opts_defaults();
    opts.iso_count = 1;
    check_refused(ctx, a, a, &opts, TL_ERR_ARG, "no list");
    for (int i = 0; i < 4; i++) {
        opts.isos = &isos[i];
        check_refused(ctx, a, a, &opts, TL_ERR_ARG, "isosurface 0");
    }
    const tl_iso_request infinite = {"f", (double)INFINITY};
    opts.isos = &infinite;
    check_refused(ctx, a, a, &opts, TL_ERR_ARG, "finite value");
    opts.struct_bytes = 4;
    check_refused(ctx, a, a, &opts, TL_ERR_ARG, "options of 4 bytes");
    opts.struct_bytes = sizeof opts + 8;
    check_refused(ctx, a, a, &opts, TL_ERR_ARG, "options of");
    tl_mesh_destroy(a);
    make_release(&m);
    check_ctx_destroy(ctx);
}

typedef struct pair {
    tl_mesh *a, *b;
    long calls, end_at;
} pair;

static tl_status compare_pair(tl_ctx *ctx, void *arg)
{
    const pair *p = arg;
    const tl_iso_request iso = {"f", 0.4};
    tl_compare_opts opts = tl_compare_opts_defaults();
    tl_compare_result r;
    opts.isos = &iso;
    opts.iso_count = 1;
    opts.sample_step = 0.1; /* many calls, so no more samples than corners */
    tl_status st = tl_mesh_compare(ctx, p->a, p->b, &opts, &r);
    tl_compare_release(ctx, &r);
    return st;
}

static void every_allocation_fails(void **state)
{
    fail_alloc f;
    make_mesh m = make_grid(5), other = make_grid(4);
    (void)state;
    fail_alloc_open(&f, 1);
    pair p = {make_object(f.ctx, &m, field_x), make_object(f.ctx, &other, field_x), 0, 0};
    add_channels(f.ctx, p.a);
    add_channels(f.ctx, p.b);
    CHECK(fail_alloc_each(&f, compare_pair, &p) > 60);
    tl_mesh_destroy(p.a);
    tl_mesh_destroy(p.b);
    fail_alloc_close(&f);
    make_release(&m);
    make_release(&other);
}

static bool end_at(void *user, const char *stage, uint64_t done, uint64_t total)
{
    pair *p = user;
    CHECK(*stage && done <= total);
    return ++p->calls != p->end_at;
}

static void cancelled_anywhere(void **state)
{
    make_mesh m = make_grid(9), other = make_grid(4);
    pair p = {0};
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    tl_ctx *ctx = NULL;
    (void)state;
    opts.thread_count = 2;
    opts.progress = end_at;
    opts.user = &p;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    p.a = make_object(ctx, &m, field_x);
    p.b = make_object(ctx, &other, field_x);
    size_t before = tl_ctx_current_bytes(ctx);
    tl_status st = TL_ERR_CANCELLED;
    for (p.end_at = 1; st; p.end_at++) {
        p.calls = 0;
        st = compare_pair(ctx, &p);
        CHECK(st == TL_OK || st == TL_ERR_CANCELLED);
        CHECK_EQ(tl_ctx_current_bytes(ctx), before);
    }
    CHECK(p.end_at > 40);
    tl_mesh_destroy(p.a);
    tl_mesh_destroy(p.b);
    check_ctx_destroy(ctx);
    make_release(&m);
    make_release(&other);
}

/* ---- threads ---- */

static void threads_change_nothing(void **state)
{
    static const unsigned threads[] = {1, 2, 7};
    make_mesh m = make_grid(24), other = make_grid(10);
    tl_field_error fields[3][4];
    tl_compare_result results[3];
    tl_iso_error isos[3];
    (void)state;
    make_perturb(&m, 0.003, 1);
    make_perturb(&other, 0.008, 2);
    make_shuffle(&m, 3);
    for (int n = 0; n < 3; n++) {
        tl_ctx *ctx = check_ctx_create(threads[n]);
        tl_mesh *a = make_object(ctx, &m, field_wavy), *b = make_object(ctx, &other, field_wavy);
        const tl_iso_request iso = {"f", 0.4};
        tl_compare_opts opts = tl_compare_opts_defaults();
        add_channels(ctx, a);
        add_channels(ctx, b);
        opts.isos = &iso;
        opts.iso_count = 1;
        opts.sample_step = 0.02;
        results[n] = compare(ctx, a, b, &opts);
        CHECK_EQ(results[n].field_count, 4);
        memcpy(fields[n], results[n].fields, sizeof fields[n]);
        isos[n] = results[n].isos[0];
        for (int i = 0; i < 4; i++) fields[n][i].name = NULL;
        isos[n].channel = NULL;
        tl_compare_result kept = results[n];
        tl_compare_release(ctx, &kept);
        results[n].fields = NULL;
        results[n].isos = NULL;
        tl_mesh_destroy(a);
        tl_mesh_destroy(b);
        check_ctx_destroy(ctx);
        CHECK(memcmp(fields[n], fields[0], sizeof fields[0]) == 0);
        CHECK(memcmp(&isos[n], &isos[0], sizeof isos[0]) == 0);
        CHECK(memcmp(&results[n], &results[0], sizeof results[0]) == 0);
    }
    CHECK(fields[0][0].rms > 0 && fields[0][0].mean > 0 && isos[0].mean > 0);
    make_release(&m);
    make_release(&other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(identical_is_zero),
        cmocka_unit_test(reordered_is_nearly_zero),
        cmocka_unit_test(linear_fields_survive),
        cmocka_unit_test(square_field_as_computed),
        cmocka_unit_test(vectors_by_their_norm),
        cmocka_unit_test(tet_channels_between_grids),
        cmocka_unit_test(as_brute_force),
        cmocka_unit_test(hints_change_nothing),
        cmocka_unit_test(outside_is_projected),
        cmocka_unit_test(moved_by_a_distance),
        cmocka_unit_test(components_and_cavities),
        cmocka_unit_test(values_that_are_not_finite),
        cmocka_unit_test(channels_in_common),
        cmocka_unit_test(bad_meshes),
        cmocka_unit_test(flat_tets_have_no_mean),
        cmocka_unit_test(flat_tets_have_no_mean),
        cmocka_unit_test(bad_options),
        cmocka_unit_test(every_allocation_fails),
        cmocka_unit_test(cancelled_anywhere),
        cmocka_unit_test(threads_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
