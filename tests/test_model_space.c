/* Errors by bin of value, in the channel's unit and in space, of scalars, vectors and tensors on
 * vertices and on cells: what every segment promises holds for every original vertex and centroid,
 * found by trying all tets. */
#include "check_ctx.h"
#include "check_model.h"

enum { CELLS = 8, FIELDS = 5 };

typedef struct field {
    const char *name;
    uint32_t components;
    tl_on on;
} field;
static const field FIELD[FIELDS] = {{"scalar", 1, TL_ON_VERTEX},
                                    {"vector", 3, TL_ON_VERTEX},
                                    {"tensor", 6, TL_ON_VERTEX},
                                    {"cells", 1, TL_ON_TET},
                                    {"flow", 3, TL_ON_TET}};

/* Component k of any field. */
static double formula(const double x[3], uint32_t k)
{
    return sin(4 * x[k % 3] + k) * cos(3 * x[(k + 1) % 3]) + x[(k + 2) % 3] * (1 + 0.3 * k);
}

static void centroid(const tl_mesh *mesh, size_t t, double x[3])
{
    const double *xyz = tl_mesh_xyz(mesh);
    const tl_lidx *q = tl_mesh_tets(mesh) + 4 * t;
    for (int k = 0; k < 3; k++) {
        x[k] = 0;
        for (int i = 0; i < 4; i++) x[k] += xyz[3 * (size_t)q[i] + (size_t)k] / 4;
    }
}

/* Where a value of a channel belongs. */
static void place_of(const tl_mesh *mesh, const field *f, size_t element, double x[3])
{
    if (f->on == TL_ON_TET)
        centroid(mesh, element, x);
    else
        memcpy(x, tl_mesh_xyz(mesh) + 3 * element, 3 * sizeof *x);
}

static size_t element_count(const tl_mesh *mesh, const field *f)
{
    return f->on == TL_ON_TET ? tl_mesh_tet_count(mesh) : tl_mesh_vert_count(mesh);
}

static const tl_channel *channel_named(const tl_mesh *mesh, const char *name)
{
    size_t c = 0;
    while (strcmp(tl_mesh_channel(mesh, c)->name, name) != 0) c++;
    return tl_mesh_channel(mesh, c);
}

static double norm(const double *value, uint32_t components)
{
    double sum = 0;
    for (uint32_t k = 0; k < components; k++) sum += value[k] * value[k];
    return components == 1 ? value[0] : sqrt(sum);
}

static tl_mesh *make_original(tl_ctx *ctx)
{
    make_mesh m = make_grid(CELLS + 1);
    make_perturb(&m, 0.09 / CELLS, 5);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    for (int i = 0; i < FIELDS; i++) {
        const field *f = &FIELD[i];
        size_t n = element_count(mesh, f);
        double *values = malloc(n * f->components * sizeof *values);
        for (size_t e = 0; e < n; e++) {
            double x[3];
            place_of(mesh, f, e, x);
            for (uint32_t k = 0; k < f->components; k++)
                values[e * f->components + k] = formula(x, k);
        }
        tl_channel channel = {f->name, "", f->components, f->on, TL_F64, values};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        free(values);
    }
    make_release(&m);
    return mesh;
}

/* ---- by trying all ---- */

typedef struct level {
    tl_mesh *mesh;
    tl_lidx *opposite;
    double (*norms)[FIELDS]; /* [larger of vert_count and tet_count] */
} level;

static void corners(const level *l, size_t t, double p[4][3])
{
    const double *xyz = tl_mesh_xyz(l->mesh);
    const tl_lidx *q = tl_mesh_tets(l->mesh) + 4 * t;
    for (int i = 0; i < 4; i++) memcpy(p[i], xyz + 3 * (size_t)q[i], sizeof p[i]);
}

static double to_triangle(const double a[3], const double b[3], const double c[3],
                          const double x[3])
{
    double p[4][3], w[4];
    memcpy(p[0], a, sizeof p[0]);
    memcpy(p[1], b, sizeof p[1]);
    memcpy(p[2], c, sizeof p[2]);
    memcpy(p[3], c, sizeof p[3]);
    return tl_tet_nearest((const double(*)[3])p, x, w);
}

/* Distance to the isosurface in a tet: its corners are where edges cross, and every three of them
 * lie in it. */
static double to_isosurface(const level *l, int i, size_t t, double value, const double x[3])
{
    const tl_lidx *q = tl_mesh_tets(l->mesh) + 4 * t;
    double p[4][3], at[12][3], best = (double)INFINITY;
    int count = 0;
    corners(l, t, p);
    for (int u = 0; u < 4; u++)
        for (int v = u + 1; v < 4; v++) {
            double a = l->norms[q[u]][i] - value, b = l->norms[q[v]][i] - value;
            if (a * b > 0) continue;
            double s = a == b ? 0 : a / (a - b);
            for (int k = 0; k < 3; k++) at[count][k] = p[u][k] + s * (p[v][k] - p[u][k]);
            count++;
        }
    for (int u = 0; u < count; u++)
        for (int v = u + (count > 2); v < count; v++)
            for (int k = v + (count > 2); k < count; k++)
                best = fmin(best, to_triangle(at[u], at[v], at[k], x));
    return best;
}

/* Distance to a tet that has the value, or a face to one on the other side of it. */
static double to_cells(const level *l, int i, size_t t, double value, const double x[3])
{
    double p[4][3], w[4], own = l->norms[t][i] - value, best = (double)INFINITY;
    corners(l, t, p);
    if (own == 0) best = tl_tet_nearest((const double(*)[3])p, x, w);
    for (size_t f = 0; f < 4; f++) {
        tl_lidx o = l->opposite[4 * t + f];
        if (o == TL_NONE || !(own * (l->norms[o / 4][i] - value) < 0)) continue;
        best = fmin(best, to_triangle(p[(f + 1) % 4], p[(f + 2) % 4], p[(f + 3) % 4], x));
    }
    return best;
}

/* Least and largest value or norm in the tets around each vertex: stars [vert_count]. */
static void find_stars(const tl_mesh *mesh, const field *f, double (*stars)[2])
{
    const double *values = channel_named(mesh, f->name)->values;
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++)
        stars[v][0] = stars[v][1] = norm(values + v * f->components, f->components);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        const tl_lidx *q = tl_mesh_tets(mesh) + 4 * t;
        for (int i = 0; i < 16; i++) {
            double value = norm(values + q[i % 4] * (size_t)f->components, f->components);
            stars[q[i / 4]][0] = fmin(stars[q[i / 4]][0], value);
            stars[q[i / 4]][1] = fmax(stars[q[i / 4]][1], value);
        }
    }
}

/* The error at a place, and the value or norm there; false where no tet holds it or several may. */
static bool error_at(const level *l, int i, const double x[3], const double *original,
                     double *error, double *after)
{
    const field *f = &FIELD[i];
    const tl_channel *c = channel_named(l->mesh, f->name);
    for (size_t t = 0; t < tl_mesh_tet_count(l->mesh); t++) {
        double p[4][3], w[4], value[9], off[9];
        const tl_lidx *q = tl_mesh_tets(l->mesh) + 4 * t;
        corners(l, t, p);
        const double least = f->on == TL_ON_TET ? 1e-9 : 0;
        if (!tl_tet_weights((const double(*)[3])p, x, w)) continue;
        if (!(w[0] >= least && w[1] >= least && w[2] >= least && w[3] >= least)) continue;
        for (uint32_t k = 0; k < f->components; k++) {
            value[k] = f->on == TL_ON_TET ? c->values[t * f->components + k] : 0;
            for (size_t v = 0; f->on == TL_ON_VERTEX && v < 4; v++)
                value[k] += w[v] * c->values[q[v] * (size_t)f->components + k];
            off[k] = original[k] - value[k];
        }
        *error = fabs(norm(off, f->components));
        *after = norm(value, f->components);
        return true;
    }
    return false;
}

static level open_level(tl_ctx *ctx, const tl_store *store, uint32_t number)
{
    level l = {.mesh = check_model_level(ctx, store, number)};
    size_t n = tl_mesh_vert_count(l.mesh) + tl_mesh_tet_count(l.mesh);
    CHECK_OK(ctx, tl_mesh_adjacency(ctx, l.mesh, &l.opposite, NULL));
    l.norms = calloc(n, sizeof *l.norms);
    for (int i = 0; i < FIELDS; i++) {
        const field *f = &FIELD[i];
        const tl_channel *c = channel_named(l.mesh, f->name);
        for (size_t e = 0; e < element_count(l.mesh, f); e++)
            l.norms[e][i] = norm(c->values + e * f->components, f->components);
    }
    return l;
}

static void close_level(tl_ctx *ctx, level *l)
{
    free(l->norms);
    tl_mem_free(ctx, l->opposite);
    tl_mesh_destroy(l->mesh);
}

/* ---- what is promised ---- */

typedef struct promise {
    double field[TL_BINS], space[TL_BINS];
} promise;

/* The largest of all segments that made patches of a level. */
static promise promise_of(tl_ctx *ctx, const tl_store *store, uint32_t number, uint32_t channel)
{
    const tl_store_head *head = tl_store_get_head(store);
    promise p = {{0}, {0}};
    for (uint32_t i = 0; i < head->patch_count; i++) {
        tl_patch_info patch;
        tl_segment_info s;
        CHECK_OK(ctx, tl_store_patch(ctx, store, i, &patch));
        if (patch.level != number || patch.producer == TL_NONE) continue;
        CHECK_OK(ctx, tl_store_segment(ctx, store, patch.producer, &s));
        for (int b = 0; b < TL_BINS; b++) {
            p.field[b] = fmax(p.field[b], (double)s.field_bins[channel * TL_BINS + (uint32_t)b]);
            p.space[b] = fmax(p.space[b], (double)s.space_bins[channel * TL_BINS + (uint32_t)b]);
        }
    }
    return p;
}

static uint32_t channel_of(const tl_store_head *head, const char *name)
{
    uint32_t c = 0;
    while (strcmp(head->channels[c].name, name) != 0) c++;
    return c;
}

static void check_field(tl_ctx *ctx, const tl_mesh *original, const tl_store *store, const level *l,
                        uint32_t number, int i)
{
    const tl_store_head *head = tl_store_get_head(store);
    const field *f = &FIELD[i];
    const uint32_t channel = channel_of(head, f->name);
    const double *range = head->channels[channel].range;
    const promise p = promise_of(ctx, store, number, channel);
    const double *values = channel_named(original, f->name)->values;
    double far = 0, said = 0;
    size_t finite = 0, field_checks = 0, n = element_count(original, f);
    double(*stars)[2] = calloc(n, sizeof *stars);
    if (f->on == TL_ON_VERTEX) find_stars(original, f, stars);
    for (size_t e = 0; e < n; e++) {
        const double *own = values + e * f->components;
        double x[3], error, after, before = norm(own, f->components), d = (double)INFINITY;
        uint32_t b = tl_bin_of(range, before);
        place_of(original, f, e, x);
        for (size_t t = 0; t < tl_mesh_tet_count(l->mesh); t++)
            d = fmin(d, f->on == TL_ON_TET ? to_cells(l, i, t, before, x)
                                           : to_isosurface(l, i, t, before, x));
        if (isfinite(p.space[b])) {
            if (!(d <= p.space[b] + 1e-12))
                fail_msg("%s, element %zu: %g away, %g promised", f->name, e, d, p.space[b]);
            finite++;
            far = fmax(far, d);
            said = fmax(said, p.space[b]);
        }
        for (uint32_t k = tl_bin_of(range, stars[e][0]);
             f->on == TL_ON_VERTEX && isfinite(p.space[b]) && k <= tl_bin_of(range, stars[e][1]);
             k++)
            if (!(d <= p.space[k] + 1e-12))
                fail_msg("%s, vertex %zu: %g away, %g promised in bin %u beside", f->name, e, d,
                         p.space[k], k);
        if (!error_at(l, i, x, own, &error, &after)) continue;
        field_checks++;
        uint32_t other = tl_bin_of(range, after);
        for (uint32_t k = b < other ? b : other; k <= (b < other ? other : b); k++)
            if (!(error <= p.field[k] + 1e-9 * (range[1] - range[0])))
                fail_msg("%s, element %zu: off by %g, %g promised in bin %u", f->name, e, error,
                         p.field[k], k);
    }
    free(stars);
    printf("level %u, %s: %zu of %zu values promised, ", number, f->name, finite, n);
    CHECK_BOUND("in space", far, said);
    CHECK(far > 0);
    CHECK(field_checks > n / 2);
    CHECK(finite > (number > 2 ? n / 2 : n - n / 8));
    CHECK(said < 10 * far); /* a promise that says something */
}

static void test_bins(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_mesh *original = make_original(ctx);
    tl_build_opts opts = check_model_opts(700, 150);
    tl_store *store;
    tl_build_result result;
    CHECK_OK(ctx, tl_model_build_mesh(ctx, original, check_model_path("space"), &opts, &result));
    CHECK(result.level_count >= 4);
    CHECK_OK(ctx, tl_store_open(ctx, check_model_path("space"), &store));
    for (uint32_t number = 1; number < 4; number++) {
        level l = open_level(ctx, store, number);
        for (int i = 0; i < FIELDS; i++) check_field(ctx, original, store, &l, number, i);
        close_level(ctx, &l);
    }
    tl_build_release(ctx, &result);
    tl_store_close(store);
    CHECK_EQ(remove(check_model_path("space")), 0);
    tl_mesh_destroy(original);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bins)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
