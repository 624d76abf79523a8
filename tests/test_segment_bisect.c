/* Graphs in parts without a library: short cuts, balance, odd graphs, and METIS beside it where the
 * build has it. */
#include "segment/segment_octree.h"

#include "check.h"
#include "check_ctx.h"

#include "fail_alloc.h"

enum { SIDE = 24 };

/* A grid of SIDE^3 nodes, each joined to its six neighbours; the edges across a plane may be cheap.
 */
static tli_graph make_grid(uint32_t cheap_x, uint32_t heavy)
{
    const uint32_t n = SIDE * SIDE * SIDE, steps[3] = {1, SIDE, SIDE * SIDE};
    tli_graph g = {.node_count = n};
    g.begins = malloc((n + 1) * sizeof *g.begins);
    g.targets = malloc(6 * n * sizeof *g.targets);
    g.weights = malloc(6 * n * sizeof *g.weights);
    g.node_weights = malloc(n * sizeof *g.node_weights);
    g.begins[0] = 0;
    for (uint32_t i = 0, e = 0; i < n; i++) {
        for (int k = 0; k < 6; k++) {
            uint32_t step = steps[k / 2], at = i / step % SIDE;
            if (k % 2 ? at == SIDE - 1 : at == 0) continue;
            bool cheap = k / 2 == 0 && (k % 2 ? at + 1 : at) == cheap_x;
            g.targets[e] = k % 2 ? i + step : i - step;
            g.weights[e++] = cheap ? 1 : heavy;
        }
        g.begins[i + 1] = e;
        g.node_weights[i] = 1;
    }
    return g;
}

static void free_grid(tli_graph *g)
{
    free(g->node_weights);
    free(g->weights);
    free(g->targets);
    free(g->begins);
}

static uint64_t cut_of(const tli_graph *g, const uint32_t *parts)
{
    uint64_t cut = 0;
    for (uint32_t i = 0; i < g->node_count; i++)
        for (uint32_t e = g->begins[i]; e < g->begins[i + 1]; e++)
            if (parts[g->targets[e]] != parts[i]) cut += g->weights[e];
    return cut / 2;
}

/* Weight of the heaviest part over the mean. */
static double balance_of(const tli_graph *g, const uint32_t *parts, uint32_t part_count)
{
    uint64_t *weights = calloc(part_count, sizeof *weights), sum = 0, most = 0;
    for (uint32_t i = 0; i < g->node_count; i++) {
        CHECK(parts[i] < part_count);
        weights[parts[i]] += g->node_weights[i];
        sum += g->node_weights[i];
    }
    for (uint32_t p = 0; p < part_count; p++) most = weights[p] > most ? weights[p] : most;
    free(weights);
    return (double)most * part_count / (double)sum;
}

/* Cubes cut a grid best: 27 of them along six planes. */
static void test_grid(void **state)
{
    const double best[] = {1 * SIDE * SIDE, 3 * SIDE * SIDE, 6 * SIDE * SIDE};
    const uint32_t counts[] = {2, 8, 27};
    tl_ctx *ctx = check_ctx_create(0);
    tli_graph g = make_grid(SIDE, 1);
    uint32_t *parts = malloc(g.node_count * sizeof *parts);
    (void)state;
    for (int i = 0; i < 3; i++) {
        CHECK_OK(ctx, tli_graph_bisect(ctx, &g, counts[i], parts));
        CHECK_BOUND("cut of a grid", (double)cut_of(&g, parts), 1.25 * best[i]);
        CHECK_BOUND("heaviest part over the mean", balance_of(&g, parts, counts[i]), 1.11);
        uint64_t own = cut_of(&g, parts);
        CHECK_OK(ctx, tli_graph_partition(ctx, &g, counts[i], parts));
        CHECK_BOUND("cut over that of the build's partitioner",
                    (double)own / (double)cut_of(&g, parts), 1.2);
    }
    free(parts);
    free_grid(&g);
    tl_ctx_destroy(ctx);
}

/* The cut lies where edges are cheap, off the middle by what the balance allows. */
static void test_weights(void **state)
{
    tl_ctx *ctx = check_ctx_create(0);
    tli_graph g = make_grid(SIDE / 2 - 1, 8);
    uint32_t *parts = malloc(g.node_count * sizeof *parts);
    (void)state;
    CHECK_OK(ctx, tli_graph_bisect(ctx, &g, 2, parts));
    CHECK_EQ(cut_of(&g, parts), SIDE * SIDE);
    for (uint32_t i = 0; i < g.node_count; i++)
        CHECK_EQ(parts[i] == parts[0], i % SIDE < SIDE / 2 - 1);
    free(parts);
    free_grid(&g);
    tl_ctx_destroy(ctx);
}

/* No edges, one node, more parts than nodes, one heavy node. */
static void test_odd(void **state)
{
    enum { NODES = 50 };
    uint32_t begins[NODES + 1] = {0}, weights[NODES], parts[NODES];
    tl_ctx *ctx = check_ctx_create(0);
    (void)state;
    for (int i = 0; i < NODES; i++) weights[i] = 3;
    tli_graph g = {.node_count = NODES, .begins = begins, .node_weights = weights};
    CHECK_OK(ctx, tli_graph_bisect(ctx, &g, 5, parts));
    CHECK_BOUND("heaviest part over the mean", balance_of(&g, parts, 5), 1.11);
    CHECK_OK(ctx, tli_graph_bisect(ctx, &g, 3 * NODES, parts));
    CHECK_BOUND("heaviest part over the mean", balance_of(&g, parts, 3 * NODES), 3.01);
    weights[7] = 1000000000;
    CHECK_OK(ctx, tli_graph_bisect(ctx, &g, 2, parts));
    for (int i = 0; i < NODES; i++) CHECK_EQ(parts[i] == parts[7], i == 7);
    g.node_count = 1;
    CHECK_OK(ctx, tli_graph_bisect(ctx, &g, 4, parts));
    CHECK(parts[0] < 4);
    tl_ctx_destroy(ctx);
}

static tl_status bisect(tl_ctx *ctx, void *arg)
{
    tli_graph *g = arg;
    uint32_t *parts = malloc(g->node_count * sizeof *parts);
    tl_status st = tli_graph_bisect(ctx, g, 3, parts);
    free(parts);
    return st;
}

static void test_failure(void **state)
{
    fail_alloc f;
    tli_graph g = make_grid(SIDE, 1);
    (void)state;
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, bisect, &g) > 50);
    fail_alloc_close(&f);
    free_grid(&g);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grid),
        cmocka_unit_test(test_weights),
        cmocka_unit_test(test_odd),
        cmocka_unit_test(test_failure),
    };
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
