/* tetralod bench mesh: topology, quality and location. The peers are vtkDataSetSurfaceFilter (one
 * thread) and vtkUnstructuredGrid::BuildLinks (all threads). */
#include <math.h>
#include <string.h>

#include "cli_bench.h"

/* Points that are looked up. */
#define QUERY_COUNT 200000
/* How far a found point may be from the one asked, relative to the largest coordinate. */
#define LOCATE_TOLERANCE 1e-9

/* What the operations leave behind for the next one and for the verification. */
typedef struct mesh_work {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    tl_lidx *opposite;
    size_t nonmanifold_count;
    tl_lidx *offsets, *tet_ids;
    tl_lidx *triangles;
    size_t triangle_count;
    tl_locator *locator;
    tl_mesh_stats stats;
    double *queries; /* [QUERY_COUNT][3] */
    tl_lidx *found;  /* [QUERY_COUNT] */
    double *weights; /* [QUERY_COUNT][4] */
} mesh_work;

typedef struct mesh_op {
    const char *name;
    const char *unit;
    bool one_thread; /* the call does not use the pool */
    tl_status (*work)(mesh_work *w);
    bool (*verify)(const mesh_work *w);
    const char *peer; /* key in what the peer prints; NULL: none */
} mesh_op;

/* ---- operations ---- */

static tl_status do_adjacency(mesh_work *w)
{
    tl_mem_free(w->ctx, w->opposite);
    w->opposite = NULL;
    return tl_mesh_adjacency(w->ctx, w->mesh, &w->opposite, &w->nonmanifold_count);
}

/* Every face inside is the opposite of its opposite and has the same three vertices. */
static bool verify_adjacency(const mesh_work *w)
{
    const tl_lidx *tets = tl_mesh_tets(w->mesh);
    for (size_t f = 0; f < 4 * tl_mesh_tet_count(w->mesh); f++) {
        tl_lidx other = w->opposite[f];
        if (other == TL_NONE) continue;
        if (other >= 4 * tl_mesh_tet_count(w->mesh) || w->opposite[other] != f) return false;
        for (size_t i = 0; i < 4; i++) {
            tl_lidx v = tets[f / 4 * 4 + i];
            size_t same = 0;
            for (size_t k = 0; k < 4; k++) same += k != other % 4 && tets[other / 4 * 4 + k] == v;
            if (i != f % 4 && same != 1) return false;
        }
    }
    return true;
}

static tl_status do_incidence(mesh_work *w)
{
    tl_mem_free(w->ctx, w->tet_ids);
    tl_mem_free(w->ctx, w->offsets);
    w->tet_ids = w->offsets = NULL;
    return tl_mesh_incidence(w->ctx, w->mesh, &w->offsets, &w->tet_ids);
}

/* Lists are as long as all corners together, ascending, and each tet has the vertex: so they are
 * all. */
static bool verify_incidence(const mesh_work *w)
{
    const tl_lidx *tets = tl_mesh_tets(w->mesh);
    size_t vert_count = tl_mesh_vert_count(w->mesh);
    if (w->offsets[0] != 0 || w->offsets[vert_count] != 4 * tl_mesh_tet_count(w->mesh))
        return false;
    for (size_t v = 0; v < vert_count; v++)
        for (tl_lidx i = w->offsets[v]; i < w->offsets[v + 1]; i++) {
            const tl_lidx *t = tets + 4 * (size_t)w->tet_ids[i];
            if (t[0] != v && t[1] != v && t[2] != v && t[3] != v) return false;
            if (i > w->offsets[v] && w->tet_ids[i] <= w->tet_ids[i - 1]) return false;
        }
    return true;
}

static tl_status do_boundary(mesh_work *w)
{
    tl_mem_free(w->ctx, w->triangles);
    w->triangles = NULL;
    return tl_mesh_boundary(w->ctx, w->mesh, NULL, &w->triangles, NULL, &w->triangle_count);
}

/* As many as faces without an opposite one. */
static bool verify_boundary(const mesh_work *w)
{
    size_t open = 0;
    for (size_t f = 0; f < 4 * tl_mesh_tet_count(w->mesh); f++) open += w->opposite[f] == TL_NONE;
    return w->nonmanifold_count > 0 || open == w->triangle_count;
}

static tl_status do_measure(mesh_work *w)
{
    return tl_mesh_measure(w->ctx, w->mesh, &w->stats);
}

static bool verify_measure(const mesh_work *w)
{
    return w->stats.boundary_triangles == w->triangle_count && w->stats.volume > 0;
}

static tl_status do_locator(mesh_work *w)
{
    tl_locator_destroy(w->locator);
    w->locator = NULL;
    return tl_locator_create(w->ctx, w->mesh, w->opposite, &w->locator);
}

static bool verify_locator(const mesh_work *w)
{
    return w->locator != NULL;
}

/* Points in the box of the mesh, from a fixed seed. */
static tl_status make_queries(mesh_work *w)
{
    double b[6];
    uint64_t state = 42;
    tl_status st = TL_OK;
    w->queries = tl_mem_alloc(w->ctx, QUERY_COUNT, 3 * sizeof(double), &st);
    w->found = tl_mem_alloc(w->ctx, QUERY_COUNT, sizeof(tl_lidx), &st);
    w->weights = tl_mem_alloc(w->ctx, QUERY_COUNT, 4 * sizeof(double), &st);
    if (st) return st;
    cli_bounds(w->mesh, b);
    for (size_t i = 0; i < 3 * (size_t)QUERY_COUNT; i++) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        double u = (double)(state >> 11) * 0x1p-53;
        w->queries[i] = b[2 * (i % 3)] + u * (b[2 * (i % 3) + 1] - b[2 * (i % 3)]);
    }
    return TL_OK;
}

static tl_status do_locate(mesh_work *w)
{
    for (size_t q = 0; q < QUERY_COUNT; q++)
        w->found[q] = tl_locator_find(w->locator, w->queries + 3 * q, TL_NONE, w->weights + 4 * q);
    return TL_OK;
}

/* The weights are those of a point inside and give back the point. */
static bool verify_locate(const mesh_work *w)
{
    const double *xyz = tl_mesh_xyz(w->mesh);
    size_t inside = 0;
    double size = 0;
    for (int k = 0; k < 6; k++) size = fmax(size, fabs(w->stats.bounds[k]));
    for (size_t q = 0; q < QUERY_COUNT; q++) {
        if (w->found[q] == TL_NONE) continue;
        inside++;
        for (size_t k = 0; k < 3; k++) {
            double x = 0;
            for (size_t c = 0; c < 4; c++) {
                size_t v = tl_mesh_tets(w->mesh)[4 * (size_t)w->found[q] + c];
                x += w->weights[4 * q + c] * xyz[3 * v + k];
            }
            if (!(fabs(x - w->queries[3 * q + k]) <= LOCATE_TOLERANCE * size)) return false;
        }
    }
    return inside > 0;
}

static const mesh_op OPS[] = {
    {"adjacency", "tets", false, do_adjacency, verify_adjacency, NULL},
    {"vertex to tets", "tets", false, do_incidence, verify_incidence, "links"},
    {"boundary", "tets", false, do_boundary, verify_boundary, "surface"},
    {"statistics", "tets", false, do_measure, verify_measure, NULL},
    {"locator", "tets", false, do_locator, verify_locator, NULL},
    {"find points", "points", true, do_locate, verify_locate, NULL},
};
#define OP_COUNT (sizeof OPS / sizeof *OPS)

/* ---- measuring ---- */

typedef struct mesh_row {
    const mesh_op *op;
    unsigned threads;
    bench_times times;
    double peer_s;       /* 0: none */
    size_t growth_bytes; /* of the context's memory during the operation, result included */
    size_t units;
    bool verified;
} mesh_row;

static tl_status measure_op(bench_state *state, mesh_work *w, const mesh_op *op, mesh_row *row)
{
    size_t runs = (size_t)cli_get(state->session, CLI_RUNS)->count;
    tl_status st = TL_OK;
    *row = (mesh_row){.op = op, .threads = tl_ctx_thread_count(w->ctx)};
    row->units = op->one_thread ? QUERY_COUNT : tl_mesh_tet_count(w->mesh);
    tl_ctx_reset_peak(w->ctx);
    size_t before = tl_ctx_current_bytes(w->ctx);
    for (size_t run = 0; run <= runs && !st; run++) {
        double start = cli_now();
        st = op->work(w);
        if (run > 0) row->times.seconds[row->times.count++] = cli_now() - start;
    }
    row->growth_bytes = tl_ctx_peak_bytes(w->ctx) - before;
    row->verified = !st && op->verify(w);
    if (!st && !row->verified) state->broken++;
    return st;
}

typedef struct mesh_rows {
    mesh_row rows[2 * OP_COUNT];
    size_t count;
} mesh_rows;

/* All operations on one number of threads; adds to the rows. */
static tl_status measure_ops(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh, void *arg)
{
    tl_status st = TL_OK;
    mesh_rows *rows = arg;
    mesh_work w = {.ctx = ctx, .mesh = mesh};
    for (size_t i = 0; i < OP_COUNT && !st; i++) {
        if (OPS[i].one_thread && tl_ctx_thread_count(ctx) != 1) continue;
        if (OPS[i].work == do_locate) st = make_queries(&w);
        if (!st) st = measure_op(state, &w, &OPS[i], &rows->rows[rows->count++]);
    }
    tl_locator_destroy(w.locator);
    void *const blocks[] = {w.opposite, w.offsets, w.tet_ids, w.triangles,
                            w.queries,  w.found,   w.weights};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    return st;
}

/* VTK's seconds for the operations it has. Its surface filter runs on one thread, its links on all.
 */
static int ask_peer(bench_state *state, const bench_data *data, mesh_row *rows, size_t row_count)
{
    char runs[24];
    snprintf(runs, sizeof runs, "%llu",
             (unsigned long long)cli_get(state->session, CLI_RUNS)->count);
    const char *const args[] = {"mesh", data->path, "--runs", runs, NULL};
    json_t *object = bench_peer(state, args);
    if (!object) return CLI_FAILED;
    for (size_t i = 0; i < row_count; i++)
        if (rows[i].op->peer)
            rows[i].peer_s = json_number_value(json_object_get(object, rows[i].op->peer));
    json_decref(object);
    return CLI_DONE;
}

/* ---- printing ---- */

static tl_status print_rows(tl_ctx *ctx, const bench_data *data, const mesh_row *rows, size_t count)
{
    cli_table table;
    tl_status st = cli_table_create(ctx, count + 1, 9, &table);
    if (st) return st;
    cli_table_head(&table,
                   "operation|threads|median|least|of|per second|growth B/tet|VTK|verified");
    for (size_t i = 0; i < count; i++) {
        const mesh_row *row = &rows[i];
        double median = bench_median(&row->times);
        cli_text milli, least, peer = {"-"};
        snprintf(milli.s, sizeof milli.s, "%.1f ms", 1e3 * median);
        snprintf(least.s, sizeof least.s, "%.1f ms", 1e3 * bench_least(&row->times));
        if (row->peer_s > 0)
            snprintf(peer.s, sizeof peer.s, "%.1f ms, %.1f x", 1e3 * row->peer_s,
                     row->peer_s / median);
        cli_table_set(&table, i + 1, 0, cli_name(row->op->name));
        cli_table_set(&table, i + 1, 1, cli_count(row->threads));
        cli_table_set(&table, i + 1, 2, milli);
        cli_table_set(&table, i + 1, 3, least);
        cli_table_set(&table, i + 1, 4, cli_name(row->op->unit));
        cli_table_set(&table, i + 1, 5, cli_rate((double)row->units / median));
        cli_table_set(&table, i + 1, 6, cli_count(row->growth_bytes / data->tet_count));
        cli_table_set(&table, i + 1, 7, peer);
        cli_table_set(&table, i + 1, 8, cli_name(row->verified ? "ok" : "BROKEN"));
    }
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    return TL_OK;
}

static void json_rows(bench_state *state, const bench_data *data, const mesh_row *rows,
                      size_t count)
{
    char hash[24];
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)data->hash);
    for (size_t i = 0; i < count; i++) {
        const mesh_row *row = &rows[i];
        json_t *item = cli_json_item(state->rows);
        cli_json_text(item, "data", data->name);
        cli_json_text(item, "hash", hash);
        cli_json_count(item, "tets", data->tet_count);
        cli_json_text(item, "operation", row->op->name);
        cli_json_count(item, "threads", row->threads);
        cli_json_real(item, "seconds_median", bench_median(&row->times));
        cli_json_real(item, "seconds_least", bench_least(&row->times));
        cli_json_real(item, "per_second", (double)row->units / bench_median(&row->times));
        cli_json_count(item, "growth_bytes", row->growth_bytes);
        cli_json_real(item, "vtk_seconds", row->peer_s > 0 ? row->peer_s : (double)NAN);
        cli_json_flag(item, "verified", row->verified);
    }
}

int bench_mesh(bench_state *state, const bench_data *data)
{
    mesh_rows rows = {.count = 0};
    unsigned threads[2];
    int exit_status = CLI_DONE;
    for (size_t i = 0; i < bench_threads(state, threads) && !exit_status; i++)
        exit_status = bench_on_mesh(state, data, threads[i], measure_ops, &rows);
    if (!exit_status && cli_get(state->session, CLI_AGAINST_VTK)->given)
        exit_status = ask_peer(state, data, rows.rows, rows.count);
    if (exit_status) return exit_status;
    cli_progress_clear(&state->session->progress);
    if (state->rows) {
        json_rows(state, data, rows.rows, rows.count);
        return CLI_DONE;
    }
    tl_status st = print_rows(state->session->ctx, data, rows.rows, rows.count);
    return st ? cli_fail(state->session, state->session->ctx, st) : CLI_DONE;
}
