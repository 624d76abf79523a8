/* tetralod bench lines: streamlines of second order through the middle of a mesh, alone and with
 * adjacency and locator. The peer is vtkStreamTracer with the same order, seeds and step. Both are
 * measured in processor time: steps by second and core. */
#include <math.h>

#include "cli_bench.h"
#include "tetralod/extract.h"

enum { SEEDS = 1000 };
/* Part of each side of the mesh's box, around its middle, that seeds fill. */
static const double SEEDED = 0.9;
/* Both lengths of all lines together are the same within this, relative, and this many mean steps
 * an end: VTK's lines end a step before the boundary, where steps may be longer. */
static const double LENGTH_TOLERANCE = 0.01, STEPS_MISSING = 3;

typedef struct lines_row {
    unsigned threads;
    bench_times trace, whole; /* with adjacency and locator there, and without; processor time */
    char seed_path[BENCH_PATH_BYTES + 16];
    size_t lines;
    uint64_t steps;
    double length;
    double vtk_s, vtk_length, vtk_steps; /* 0: not asked */
} lines_row;

static tl_status write_seeds(tl_ctx *ctx, const lines_row *row, const tl_polydata *seeds)
{
    FILE *file = fopen(row->seed_path, "w");
    if (!file) return tl_fail(ctx, TL_ERR_IO, "can't write '%s'", row->seed_path);
    for (size_t i = 0; i < seeds->vert_count; i++)
        fprintf(file, "%.17g,%.17g,%.17g\n", seeds->xyz[3 * i], seeds->xyz[3 * i + 1],
                seeds->xyz[3 * i + 2]);
    bool good = !ferror(file);
    good = fclose(file) == 0 && good;
    return good ? TL_OK : tl_fail(ctx, TL_ERR_IO, "can't write '%s'", row->seed_path);
}

static tl_status run_lines(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh,
                           const tl_lidx *opposite, const tl_locator *locator,
                           const tl_polydata *seeds, bench_times *times, lines_row *row)
{
    tl_status st = TL_OK;
    size_t runs = (size_t)cli_get(state->session, CLI_RUNS)->count;
    for (size_t run = 0; run <= runs && !st; run++) {
        tl_polydata *lines = NULL;
        tl_stream_report report;
        double start = cli_cpu();
        st = tl_streamlines(ctx, mesh, opposite, locator, tl_mesh_channel(mesh, 0)->values,
                            seeds->xyz, seeds->vert_count, NULL, &lines, &report);
        if (run > 0) times->seconds[times->count++] = cli_cpu() - start;
        if (st) return st;
        row->lines = lines->cell_count;
        row->steps = report.steps;
        row->length = tl_polydata_size(lines);
        tl_polydata_destroy(ctx, lines);
    }
    return st;
}

static tl_status measure(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh, void *arg)
{
    lines_row *row = arg;
    double bounds[6];
    tl_lidx *opposite = NULL;
    tl_locator *locator = NULL;
    tl_polydata *seeds = NULL;
    row->threads = tl_ctx_thread_count(ctx);
    snprintf(row->seed_path, sizeof row->seed_path, "%s/seeds.csv", state->folder);
    cli_bounds(mesh, bounds);
    for (int k = 0; k < 3; k++) {
        double middle = (bounds[2 * k] + bounds[2 * k + 1]) / 2;
        for (int i = 2 * k; i < 2 * k + 2; i++) bounds[i] = middle + SEEDED * (bounds[i] - middle);
    }
    tl_status st = tl_seeds_box(ctx, bounds, SEEDS, &seeds);
    if (!st) st = write_seeds(ctx, row, seeds);
    if (!st) st = run_lines(state, ctx, mesh, NULL, NULL, seeds, &row->whole, row);
    uint64_t steps = row->steps;
    if (!st) st = tl_mesh_adjacency(ctx, mesh, &opposite, NULL);
    if (!st) st = tl_locator_create(ctx, mesh, opposite, &locator);
    if (!st) st = run_lines(state, ctx, mesh, opposite, locator, seeds, &row->trace, row);
    state->broken += !st && row->steps != steps;
    tl_locator_destroy(locator);
    tl_mem_free(ctx, opposite);
    tl_polydata_destroy(ctx, seeds);
    return st;
}

static int ask_peer(bench_state *state, const bench_data *data, void *arg)
{
    lines_row *row = arg;
    char runs[24];
    snprintf(runs, sizeof runs, "%llu",
             (unsigned long long)cli_get(state->session, CLI_RUNS)->count);
    const char *const args[] = {"lines",  data->path, "--seeds", row->seed_path,
                                "--runs", runs,       NULL};
    json_t *object = bench_peer(state, args);
    if (!object) return CLI_FAILED;
    row->vtk_s = json_number_value(json_object_get(object, "seconds"));
    row->vtk_steps = json_number_value(json_object_get(object, "steps"));
    row->vtk_length = json_number_value(json_object_get(object, "length"));
    json_decref(object);
    double step = row->length / (double)row->steps, ends = 2 * (double)row->lines;
    state->broken += !(fabs(row->vtk_length - row->length) <=
                       LENGTH_TOLERANCE * row->length + STEPS_MISSING * step * ends);
    return CLI_DONE;
}

static void add_json(json_t *item, const bench_data *data, const void *arg)
{
    const lines_row *row = arg;
    double steps = (double)row->steps;
    (void)data;
    cli_json_count(item, "threads", row->threads);
    cli_json_count(item, "lines", row->lines);
    cli_json_count(item, "steps", row->steps);
    cli_json_real(item, "length", row->length);
    cli_json_real(item, "steps_per_core_second", steps / bench_median(&row->trace));
    cli_json_real(item, "whole_steps_per_core_second", steps / bench_median(&row->whole));
    cli_json_real(item, "vtk_steps_per_core_second",
                  row->vtk_s > 0 ? row->vtk_steps / row->vtk_s : (double)NAN);
    cli_json_real(item, "vtk_length", row->vtk_s > 0 ? row->vtk_length : (double)NAN);
}

static void print_text(const bench_data *data, const void *arg)
{
    const lines_row *row = arg;
    double steps = (double)row->steps, trace = steps / bench_median(&row->trace);
    (void)data;
    printf("%u threads   %s lines, %s steps of second order, length %s\n", row->threads,
           cli_count(row->lines).s, cli_count(row->steps).s, cli_real(row->length).s);
    printf("            %s steps a core; %s with adjacency and locator\n", cli_rate(trace).s,
           cli_rate(steps / bench_median(&row->whole)).s);
    if (row->vtk_s > 0)
        printf("            VTK %s steps a core (here %.1f x), length %s\n",
               cli_rate(row->vtk_steps / row->vtk_s).s, trace / (row->vtk_steps / row->vtk_s),
               cli_real(row->vtk_length).s);
}

int bench_lines(bench_state *state, const bench_data *data)
{
    static const bench_steps STEPS = {measure, ask_peer, add_json, print_text};
    lines_row row = {0};
    int exit_status = bench_each_threads(state, data, &STEPS, &row, sizeof row);
    remove(row.seed_path);
    return exit_status;
}
