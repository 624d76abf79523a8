/* tetralod bench surface: an isosurface of a mesh in memory. The peer is vtkContour3DLinearGrid
 * with as many threads: with points of their own for each triangle, with merged ones as here, and
 * with a scalar tree that was made before. */
#include <math.h>

#include "cli_bench.h"

/* Where in the range the surface is taken, as in shared tables of peers. */
static const double PART = 0.4;
/* Areas are the same within this, relative: VTK's points are float32. */
static const double AREA_TOLERANCE = 1e-4;

typedef struct surface_row {
    unsigned threads;
    bench_times plain, indexed; /* without and with a range index */
    double index_s;
    size_t triangles, vertices;
    double area;
    double vtk_plain, vtk_merged, vtk_tree, vtk_area; /* 0: not asked */
    size_t vtk_triangles;
    double value;
} surface_row;

static tl_status run_slices(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh,
                            const double *scalar, const tl_slice_opts *opts, bench_times *times,
                            surface_row *row)
{
    tl_status st = TL_OK;
    size_t runs = (size_t)cli_get(state->session, CLI_RUNS)->count;
    for (size_t run = 0; run <= runs && !st; run++) {
        tl_polydata *surface = NULL;
        double start = cli_now();
        st = tl_slice_mesh(ctx, mesh, scalar, opts, &surface);
        if (run > 0) times->seconds[times->count++] = cli_now() - start;
        if (st) return st;
        row->triangles = surface->cell_count;
        row->vertices = surface->vert_count;
        row->area = tl_polydata_size(surface);
        tl_polydata_destroy(ctx, surface);
    }
    return st;
}

static tl_status measure(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh, void *arg)
{
    surface_row *row = arg;
    row->threads = tl_ctx_thread_count(ctx);
    double range[2];
    tl_range_index *ranges = NULL;
    const tl_channel *channel = tl_mesh_channel(mesh, 0);
    tl_slice_opts opts = tl_slice_opts_defaults();
    tl_channel_range(channel, tl_mesh_vert_count(mesh), range, NULL);
    row->value = range[0] + PART * (range[1] - range[0]);
    opts.values = &row->value;
    opts.value_count = 1;
    tl_status st = run_slices(state, ctx, mesh, channel->values, &opts, &row->plain, row);
    double start = cli_now();
    if (!st) st = tl_range_index_create(ctx, mesh, channel->values, &ranges);
    row->index_s = cli_now() - start;
    opts.ranges = ranges;
    size_t triangles = row->triangles, vertices = row->vertices;
    if (!st) st = run_slices(state, ctx, mesh, channel->values, &opts, &row->indexed, row);
    state->broken += !st && (row->triangles != triangles || row->vertices != vertices);
    tl_range_index_destroy(ctx, ranges);
    return st;
}

static int ask_peer(bench_state *state, const bench_data *data, void *arg)
{
    surface_row *row = arg;
    char runs[24], threads[24], value[40];
    snprintf(runs, sizeof runs, "%llu",
             (unsigned long long)cli_get(state->session, CLI_RUNS)->count);
    snprintf(threads, sizeof threads, "%u", row->threads);
    snprintf(value, sizeof value, "%.17g", row->value);
    const char *const args[] = {"surface", data->path, "--value", value, "--threads",
                                threads,   "--runs",   runs,      NULL};
    json_t *object = bench_peer(state, args);
    if (!object) return CLI_FAILED;
    row->vtk_plain = json_number_value(json_object_get(object, "plain"));
    row->vtk_merged = json_number_value(json_object_get(object, "merged"));
    row->vtk_tree = json_number_value(json_object_get(object, "tree"));
    row->vtk_area = json_number_value(json_object_get(object, "merged_area"));
    row->vtk_triangles = (size_t)json_integer_value(json_object_get(object, "merged_triangles"));
    json_decref(object);
    state->broken += row->vtk_triangles != row->triangles ||
                     !(fabs(row->vtk_area - row->area) <= AREA_TOLERANCE * row->area);
    return CLI_DONE;
}

static void add_json(json_t *item, const bench_data *data, const void *arg)
{
    const surface_row *row = arg;
    cli_json_count(item, "threads", row->threads);
    cli_json_count(item, "triangles", row->triangles);
    cli_json_real(item, "area", row->area);
    cli_json_real(item, "tets_per_second", (double)data->tet_count / bench_median(&row->plain));
    cli_json_real(item, "indexed_tets_per_second",
                  (double)data->tet_count / bench_median(&row->indexed));
    cli_json_real(item, "index_seconds", row->index_s);
    cli_json_real(item, "vtk_plain_seconds", row->vtk_plain > 0 ? row->vtk_plain : (double)NAN);
    cli_json_real(item, "vtk_merged_seconds", row->vtk_merged > 0 ? row->vtk_merged : (double)NAN);
    cli_json_real(item, "vtk_tree_seconds", row->vtk_tree > 0 ? row->vtk_tree : (double)NAN);
    cli_json_count(item, "vtk_triangles", row->vtk_triangles);
}

static void print_text(const bench_data *data, const void *arg)
{
    const surface_row *row = arg;
    double tets = (double)data->tet_count, plain = bench_median(&row->plain);
    double indexed = bench_median(&row->indexed);
    printf("%u threads   %s triangles, %s vertices, area %s\n", row->threads,
           cli_count(row->triangles).s, cli_count(row->vertices).s, cli_real(row->area).s);
    printf("            %s tets, merged; %s with a range index, made in %s\n",
           cli_rate(tets / plain).s, cli_rate(tets / indexed).s, cli_seconds(row->index_s).s);
    if (row->vtk_plain > 0)
        printf("            VTK %s, merged %s (here %.1f x), with a tree %s (here %.1f x); %s "
               "triangles, "
               "area %s\n",
               cli_rate(tets / row->vtk_plain).s, cli_rate(tets / row->vtk_merged).s,
               row->vtk_merged / plain, cli_rate(tets / row->vtk_tree).s, row->vtk_tree / indexed,
               cli_count(row->vtk_triangles).s, cli_real(row->vtk_area).s);
}

int bench_surface(bench_state *state, const bench_data *data)
{
    static const bench_steps STEPS = {measure, ask_peer, add_json, print_text};
    surface_row row;
    return bench_each_threads(state, data, &STEPS, &row, sizeof row);
}
