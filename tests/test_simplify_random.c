/* Random meshes and random options: grids with moved vertices and with tets taken away, so that the
 * boundary is wild and touches itself in vertices and edges; every promise is checked. */
#include "check.h"
#include "check_simplify.h"

typedef struct dice {
    uint64_t state;
} dice;

static size_t roll(dice *d, size_t sides)
{
    return (size_t)(make_random(&d->state) % sides);
}

/* Takes away tets: some at random, or all of some balls. */
static void punch(make_mesh *m, dice *d)
{
    double share = (double)roll(d, 4) * 0.15, at[3][4];
    size_t balls = roll(d, 4), kept = 0;
    for (size_t b = 0; b < balls; b++)
        for (int k = 0; k < 4; k++) at[b][k] = make_uniform(&d->state) * (k == 3 ? 0.4 : 1);
    for (size_t t = 0; t < m->tet_count; t++) {
        bool gone = make_uniform(&d->state) < share;
        for (size_t b = 0; b < balls; b++) {
            const double *x = m->xyz + 3 * (size_t)m->tets[4 * t];
            double d2 = 0;
            for (int k = 0; k < 3; k++) d2 += (x[k] - at[b][k]) * (x[k] - at[b][k]);
            gone = gone || d2 < at[b][3] * at[b][3];
        }
        if (gone && t + 1 < m->tet_count) continue; /* the last one stays */
        memmove(m->tets + 4 * kept, m->tets + 4 * t, 4 * sizeof *m->tets);
        kept++;
    }
    m->tet_count = kept;
}

static tl_mesh *random_mesh(tl_ctx *ctx, dice *d)
{
    size_t n = 3 + roll(d, 6);
    make_mesh m = n < 4 || roll(d, 4) ? make_grid(n) : make_grid_cavity(n);
    double amount = 0.09 / (double)(n - 1);
    if (roll(d, 3))
        make_perturb(&m, amount, d->state);
    else
        perturb_inner(&m, amount, d->state);
    if (roll(d, 3)) punch(&m, d);
    if (roll(d, 2)) make_two_regions(&m);
    for (size_t t = 0; m.regions && roll(d, 2) && t < m.tet_count; t += 1 + roll(d, 20))
        m.regions[t] = 3; /* single tets of a region of their own */
    make_shuffle(&m, d->state);
    static const make_field fields[] = {NULL, field_bumps, field_linear};
    tl_mesh *mesh = make_object(ctx, &m, fields[roll(d, 3)]);
    make_release(&m);
    return mesh;
}

static tl_simplify_opts random_opts(dice *d, double diagonal)
{
    static const double bounds[] = {-1, 0, 1e-4, 1e-3, 1e-2, 0.1},
                        qualities[] = {0.01, 0, 0.1, 0.3};
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.method = (tl_simplify_method)roll(d, 5);
    opts.placement = (tl_placement)roll(d, 2);
    opts.boundary_error = bounds[roll(d, 6)] * (roll(d, 2) ? 1 : diagonal);
    if (opts.boundary_error < 0) opts.boundary_error = -1;
    opts.min_quality = qualities[roll(d, 4)];
    opts.seed = d->state;
    if (roll(d, 2)) opts.error = 0.1 * make_uniform(&d->state) + 1e-4;
    if (opts.error == 0 || roll(d, 2)) opts.ratio = make_uniform(&d->state) * 0.9 + 0.05;
    return opts;
}

static double least_quality(const tl_mesh *mesh)
{
    double p[4][3], least = 1;
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        tet_points(mesh, t, p);
        least = fmin(least, tl_tet_quality((const double(*)[3])p));
    }
    return least;
}

/* What the largest of a kind was, as a part of what was promised. */
typedef struct worst {
    double boundary, interface, field, volume;
    size_t targets, stopped;
} worst;

static void check_surfaces(const tl_mesh *mesh, const shrunk *s, double asked, double area,
                           worst *w)
{
    double said = s->result.boundary_error, rounding = 1e-12 * mesh_diagonal(mesh);
    double found = brute_surface_distance(mesh, s->mesh, false);
    CHECK(said <= asked);
    if (!(found <= said + rounding)) CHECK_BOUND("boundary", found, said + rounding);
    if (said > 0) w->boundary = fmax(w->boundary, found / said);
    check_same_topology(mesh, s->mesh, false);
    if (tl_mesh_regions(mesh)) {
        found = brute_surface_distance(mesh, s->mesh, true);
        if (!(found <= said + rounding)) CHECK_BOUND("interface", found, said + rounding);
        if (said > 0) w->interface = fmax(w->interface, found / said);
        check_same_topology(mesh, s->mesh, true);
    }
    double change = fabs(region_volume(s->mesh, 0, true) - region_volume(mesh, 0, true));
    double allowed = area * said + 1e-12;
    if (!(change <= allowed)) CHECK_BOUND("volume", change, allowed);
    w->volume = fmax(w->volume, change / allowed);
}

static void check_field(const tl_mesh *mesh, const shrunk *s, const tl_simplify_opts *opts,
                        const tl_mesh_stats *stats, worst *w)
{
    double range[2];
    if (!tl_mesh_channel_count(mesh)) return;
    tl_channel_range(tl_mesh_channel(mesh, 0), tl_mesh_vert_count(mesh), range, NULL);
    double said = s->result.channels[0].max_error, bound = opts->error * (range[1] - range[0]);
    double found = brute_error(mesh, s->mesh, "f", NULL);
    if (opts->error > 0) CHECK(said <= bound);
    /* a vertex outside may have several nearest points, with other values each */
    if (!(stats->components > 1) && s->result.outside_vertices == 0 &&
        !(found <= said * (1 + 1e-6) + 1e-9))
        CHECK_BOUND("field", found, said);
    if (opts->error > 0) w->field = fmax(w->field, found / bound);
}

static void one_case(tl_ctx *ctx, uint64_t seed, worst *w)
{
    dice d = {seed};
    tl_mesh_stats stats[2];
    tl_mesh *mesh = random_mesh(ctx, &d);
    CHECK_OK(ctx, tl_mesh_measure(ctx, mesh, &stats[0]));
    tl_simplify_opts opts = random_opts(&d, stats[0].diagonal);
    printf("seed %llu: %zu tets, %s, %s, ratio %.3g, error %.3g, boundary %.3g\n",
           (unsigned long long)seed, tl_mesh_tet_count(mesh), method_names[opts.method],
           opts.placement ? "subset" : "optimal", opts.ratio, opts.error, opts.boundary_error);
    shrunk s = shrink(mesh, &opts);
    CHECK_OK(ctx, tl_mesh_check(ctx, s.mesh, TL_CHECK_FULL));
    CHECK_OK(ctx, tl_mesh_measure(ctx, s.mesh, &stats[1]));
    CHECK_EQ(s.result.inverted + s.result.degenerate, 0);
    CHECK_EQ(stats[1].components, stats[0].components);
    CHECK_EQ(stats[1].nonmanifold_faces, 0);
    CHECK_EQ(stats[1].nonmanifold_edges, stats[0].nonmanifold_edges);
    CHECK_EQ(stats[1].nonmanifold_verts, stats[0].nonmanifold_verts);
    double least = least_quality(mesh);
    CHECK(stats[1].quality_min >= fmin(least, opts.min_quality) * (1 - 1e-9));
    size_t target = (size_t)(opts.ratio * (double)s.result.tets_in);
    if (s.result.target_reached && opts.ratio > 0)
        CHECK(s.result.tets_out <= (target ? target : 1));
    w->targets += s.result.target_reached;
    w->stopped += !s.result.target_reached;
    double asked = opts.boundary_error < 0 ? 1e-3 * stats[0].diagonal : opts.boundary_error;
    check_surfaces(mesh, &s, asked, 4 * stats[0].boundary_area, w);
    check_field(mesh, &s, &opts, &stats[0], w);
    shrink_release(&s);
    tl_mesh_destroy(mesh);
}

static void test_random(void **state)
{
    tl_ctx *ctx = shrink_ctx(2);
    worst w = {0};
    const char *only = getenv("TETRALOD_SEED");
    (void)state;
    for (uint64_t seed = 1; seed <= 150; seed++)
        if (!only || seed == strtoull(only, NULL, 10)) one_case(ctx, seed, &w);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    printf("targets reached %zu, not %zu\n", w.targets, w.stopped);
    CHECK_BOUND("boundary, of the promise", w.boundary, 1);
    CHECK_BOUND("interface, of the promise", w.interface, 1);
    CHECK_BOUND("field, of the promise", w.field, 1 + 1e-6);
    CHECK_BOUND("volume, of area times distance", w.volume, 1);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
