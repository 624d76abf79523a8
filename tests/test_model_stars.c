/* Values around original vertices, across the segments that hold them, against the whole mesh. */
#include "check.h"
#include "check_ctx.h"

#include "make_mesh.h"
#include "model/model_stars.h"

enum { FIELDS = 2 };

/* A scalar and a vector, as one row. */
static void values_at(const double x[3], double row[4])
{
    row[0] = sin(5 * x[0]) + x[1] * x[2];
    for (int k = 0; k < 3; k++) row[1 + k] = cos(4 * x[k]) * x[(k + 1) % 3];
}

static double value_of(const double row[4], int field)
{
    return field ? sqrt(row[1] * row[1] + row[2] * row[2] + row[3] * row[3]) : row[0];
}

static void add_channels(tl_ctx *ctx, tl_mesh *mesh)
{
    const size_t n = tl_mesh_vert_count(mesh);
    double *scalar = malloc(n * sizeof *scalar), *vector = malloc(3 * n * sizeof *vector);
    for (size_t v = 0; v < n; v++) {
        double row[4];
        values_at(tl_mesh_xyz(mesh) + 3 * v, row);
        scalar[v] = row[0];
        memcpy(vector + 3 * v, row + 1, 3 * sizeof *row);
    }
    scalar[n / 2] = (double)NAN;
    tl_channel channels[] = {{"s", "", 1, TL_ON_VERTEX, TL_F64, scalar},
                             {"v", "", 3, TL_ON_VERTEX, TL_F64, vector}};
    for (int i = 0; i < FIELDS; i++) CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channels[i]));
    free(vector);
    free(scalar);
}

/* stars [vert_count][FIELDS][2] by all tets. */
static void find_all(const tl_mesh *mesh, double (*stars)[FIELDS][2])
{
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++)
        for (int f = 0; f < FIELDS; f++) {
            stars[v][f][0] = (double)INFINITY;
            stars[v][f][1] = -(double)INFINITY;
        }
    for (size_t i = 0; i < 16 * tl_mesh_tet_count(mesh); i++) {
        const tl_lidx *q = tl_mesh_tets(mesh) + i / 16 * 4;
        const tl_lidx v = q[i % 4], other = q[i / 4 % 4];
        double row[4];
        row[0] = tl_mesh_channel(mesh, 0)->values[other];
        memcpy(row + 1, tl_mesh_channel(mesh, 1)->values + 3 * (size_t)other, 3 * sizeof *row);
        for (int f = 0; f < FIELDS; f++) {
            stars[v][f][0] = fmin(stars[v][f][0], value_of(row, f));
            stars[v][f][1] = fmax(stars[v][f][1], value_of(row, f));
        }
    }
}

static bool is_near(double outer, double inner, double side)
{
    return (outer - inner) * side >= 0 && fabs(outer - inner) <= 1e-6;
}

static void stars_across_segments(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(13);
    make_shuffle(&m, 7);
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    add_channels(ctx, mesh);
    double(*expected)[FIELDS][2] = calloc(m.vert_count, sizeof *expected);
    find_all(mesh, expected);
    tl_segments *segments = NULL;
    tl_segment_opts opts = tl_segment_opts_defaults();
    opts.segment_tets = 600;
    CHECK_OK(ctx, tl_segments_build_mesh(ctx, mesh, &opts, NULL, &segments));
    tli_field fields[FIELDS] = {{.on = TL_ON_VERTEX, .components = 1},
                                {.on = TL_ON_VERTEX, .components = 3, .source_first = 1}};
    const tli_plan plan = {.ctx = ctx,
                           .fields = fields,
                           .field_count = FIELDS,
                           .vert_fields = FIELDS,
                           .source_vert_comps = 4,
                           .at_once = 2};
    tli_stars all;
    size_t homes = 0, told = 0;
    CHECK_OK(ctx, tli_stars_open(ctx, &plan, segments, &all));
    for (uint32_t i = 0; i < tl_segments_count(segments); i++) {
        tl_segment s;
        tli_star *stars = NULL;
        CHECK_OK(ctx, tl_segments_load(ctx, segments, i, &s));
        CHECK_OK(ctx, tli_stars_create(ctx, &all, &s, &stars));
        for (size_t v = 0; v < s.vert_count; v++) {
            if (s.links[v] & TL_LINK_COPY) continue;
            homes++;
            told += TL_LINK_SLOT(s.links[v]) != 0;
            for (int f = 0; f < FIELDS; f++) {
                const tli_star *star = &stars[v * FIELDS + (size_t)f];
                CHECK(is_near((double)star->low, expected[s.vert_ids[v]][f][0], -1));
                CHECK(is_near((double)star->high, expected[s.vert_ids[v]][f][1], 1));
            }
        }
        tl_mem_free(ctx, stars);
        tl_segment_release(ctx, &s);
    }
    CHECK_EQ(homes, m.vert_count);
    CHECK(told > 100);
    tli_stars_close(&all);
    tl_segments_destroy(segments);
    free(expected);
    tl_mesh_destroy(mesh);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(stars_across_segments)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
