/* tetralod bench simplify: speed on one and on all threads, errors, memory, validity, beside VTK's
 * vtkUnstructuredGridQuadricDecimation (one thread). Both results are judged by tl_mesh_compare. */
#include <math.h>
#include <string.h>

#include "cli_bench.h"

/* Volume that a result may lose or gain, relative to the input's: collapses on the boundary keep
 * it. */
#define VOLUME_TOLERANCE 1e-4

typedef struct simplify_row {
    const char *by;
    unsigned threads;
    bench_times times;
    size_t tets_out, peak_bytes;
    double rms, max, range;    /* of the channel; absolute */
    double boundary, diagonal; /* two-sided Hausdorff distance and bound's base */
    double volume[2];
    size_t inverted[2];
    uint64_t hash;
    char remark[64]; /* empty: verified */
} simplify_row;

/* ---- judging ---- */

static void remark(bench_state *state, simplify_row *row, const char *text)
{
    size_t used = strlen(row->remark);
    snprintf(row->remark + used, sizeof row->remark - used, "%s%s", used ? ", " : "", text);
    state->broken++;
}

static tl_status judge(tl_ctx *ctx, const tl_mesh *mesh, const tl_mesh *out, simplify_row *row)
{
    tl_compare_result result = {0};
    tl_status st = tl_mesh_compare(ctx, mesh, out, NULL, &result);
    if (!st && result.field_count == 0)
        st = tl_fail(ctx, TL_ERR_DATA, "the result has lost its channel");
    if (!st) {
        row->rms = result.fields[0].rms;
        row->max = result.fields[0].max;
        row->range = result.fields[0].range[1] - result.fields[0].range[0];
        row->boundary = result.boundary_hausdorff;
        row->diagonal = result.diagonal;
        for (int i = 0; i < 2; i++) {
            row->volume[i] = result.volume[i];
            row->inverted[i] = result.inverted[i];
        }
    }
    tl_compare_release(ctx, &result);
    return st;
}

/* What the library promises of its own result. */
static void verify(bench_state *state, const tl_simplify_result *result, size_t target,
                   simplify_row *row)
{
    double slack = 1e-9 * row->range; /* rounding of two ways to the same number */
    if (result->target_reached && row->tets_out > target) remark(state, row, "too many tets");
    if (row->inverted[1] > row->inverted[0]) remark(state, row, "inverted tets");
    if (!(fabs(row->volume[1] - row->volume[0]) <= VOLUME_TOLERANCE * row->volume[0]))
        remark(state, row, "volume lost");
    if (!(fabs(result->channels[0].max_error - row->max) <= slack) ||
        !(fabs(result->channels[0].rms_error - row->rms) <= slack))
        remark(state, row, "error told wrong");
}

/* ---- measuring ---- */

static tl_simplify_opts options(const bench_state *state)
{
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.ratio = cli_get(state->session, CLI_KEEP)->real;
    opts.method = (tl_simplify_method)cli_get(state->session, CLI_METHOD)->choice;
    return opts;
}

/* Runs, warm-up first; the last result is judged, all must have the same bytes. */
static tl_status measure_mesh(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh, void *arg)
{
    simplify_row *row = arg;
    const tl_simplify_opts opts = options(state);
    size_t runs = (size_t)cli_get(state->session, CLI_RUNS)->count;
    size_t target = (size_t)(opts.ratio * (double)tl_mesh_tet_count(mesh));
    tl_status st = TL_OK;
    for (size_t run = 0; run <= runs && !st; run++) {
        tl_simplify_result result = {0};
        tl_mesh *out = NULL;
        tl_ctx_reset_peak(ctx);
        st = tl_mesh_simplify(ctx, mesh, &opts, &out, &result);
        if (st) break;
        uint64_t hash = bench_hash(out);
        if (run > 0) row->times.seconds[row->times.count++] = result.seconds;
        if (run > 0 && hash != row->hash) remark(state, row, "runs differ");
        row->hash = hash;
        row->tets_out = result.tets_out;
        row->peak_bytes = result.peak_bytes;
        if (run == runs) {
            st = judge(ctx, mesh, out, row);
            if (!st) verify(state, &result, target, row);
        }
        tl_simplify_release(ctx, &result);
        tl_mesh_destroy(out);
    }
    return st;
}

static int measure_threads(bench_state *state, const bench_data *data, unsigned threads,
                           simplify_row *row)
{
    *row = (simplify_row){.by = "tetralod", .threads = threads};
    return bench_on_mesh(state, data, threads, measure_mesh, row);
}

/* ---- the peer ---- */

static tl_status judge_file(tl_ctx *ctx, const bench_data *data, const char *path,
                            simplify_row *row)
{
    tl_mesh *mesh = NULL, *out = NULL;
    tl_status st = tl_mesh_read(ctx, data->path, NULL, &mesh, NULL);
    if (!st) st = tl_mesh_read(ctx, path, NULL, &out, NULL);
    if (!st) st = judge(ctx, mesh, out, row);
    tl_mesh_destroy(out);
    tl_mesh_destroy(mesh);
    return st;
}

static int measure_peer(bench_state *state, const bench_data *data, simplify_row *row)
{
    cli_session *session = state->session;
    char path[BENCH_PATH_BYTES], keep[32], runs[24], scale[32];
    *row = (simplify_row){.by = "VTK", .threads = 1};
    snprintf(path, sizeof path, "%.4000s/vtk.vtu", state->folder);
    snprintf(keep, sizeof keep, "%.17g", cli_get(session, CLI_KEEP)->real);
    snprintf(runs, sizeof runs, "%llu", (unsigned long long)cli_get(session, CLI_RUNS)->count);
    snprintf(scale, sizeof scale, "%.17g", cli_get(session, CLI_VTK_SCALE)->real);
    const char *const args[] = {"simplify", data->path, path,      "--keep", keep,
                                "--runs",   runs,       "--scale", scale,    NULL};
    json_t *object = bench_peer(state, args);
    if (!object) return CLI_FAILED;
    json_t *seconds = json_object_get(object, "seconds");
    for (size_t i = 0; i < json_array_size(seconds) && i < BENCH_RUNS_MAX; i++)
        row->times.seconds[row->times.count++] = json_number_value(json_array_get(seconds, i));
    row->tets_out = (size_t)json_integer_value(json_object_get(object, "tets_out"));
    row->peak_bytes = (size_t)json_integer_value(json_object_get(object, "peak_bytes"));
    double scaled = json_number_value(json_object_get(object, "scale"));
    if (scaled != 1) snprintf(row->remark, sizeof row->remark, "coordinates x %g", scaled);
    json_decref(object);
    tl_status st = judge_file(session->ctx, data, path, row);
    remove(path);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* ---- printing ---- */

static tl_status print_rows(tl_ctx *ctx, const bench_data *data, const simplify_row *rows,
                            size_t count)
{
    cli_table table;
    tl_status st = cli_table_create(ctx, count + 1, 12, &table);
    if (st) return st;
    cli_table_head(
        &table,
        "by|threads|median|least|tets in|tets out|rms|max|volume|boundary|peak B/tet|verified");
    for (size_t i = 0; i < count; i++) {
        const simplify_row *row = &rows[i];
        double median = bench_median(&row->times);
        cli_table_set(&table, i + 1, 0, cli_name(row->by));
        cli_table_set(&table, i + 1, 1, cli_count(row->threads));
        cli_table_set(&table, i + 1, 2, cli_seconds(median));
        cli_table_set(&table, i + 1, 3, cli_seconds(bench_least(&row->times)));
        cli_table_set(&table, i + 1, 4, cli_rate((double)data->tet_count / median));
        cli_table_set(&table, i + 1, 5, cli_count(row->tets_out));
        cli_table_set(&table, i + 1, 6, cli_share(row->rms, row->range));
        cli_table_set(&table, i + 1, 7, cli_share(row->max, row->range));
        cli_table_set(&table, i + 1, 8, cli_share(row->volume[1] - row->volume[0], row->volume[0]));
        cli_table_set(&table, i + 1, 9, cli_share(row->boundary, row->diagonal));
        cli_table_set(&table, i + 1, 10, cli_count(row->peak_bytes / data->tet_count));
        cli_table_set(&table, i + 1, 11, cli_name(*row->remark ? row->remark : "ok"));
    }
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    return TL_OK;
}

static void print_ratios(const simplify_row *rows, size_t own_count, bool peer)
{
    double one = bench_least(&rows[0].times); /* what others do on the machine only adds to it */
    if (own_count > 1)
        printf("%u threads are %.2f times as fast as one\n", rows[1].threads,
               one / bench_least(&rows[1].times));
    if (!peer) return;
    const simplify_row *vtk = &rows[own_count];
    printf("one thread is %.1f times as fast as VTK; rms %.2f, max %.2f times VTK's\n",
           bench_least(&vtk->times) / one, rows[0].rms / vtk->rms, rows[0].max / vtk->max);
}

static void json_rows(bench_state *state, const bench_data *data, const simplify_row *rows,
                      size_t count)
{
    char hash[24];
    for (size_t i = 0; i < count; i++) {
        const simplify_row *row = &rows[i];
        json_t *item = cli_json_item(state->rows);
        snprintf(hash, sizeof hash, "%016llx", (unsigned long long)data->hash);
        cli_json_text(item, "data", data->name);
        cli_json_text(item, "hash", hash);
        cli_json_text(item, "by", row->by);
        cli_json_count(item, "threads", row->threads);
        cli_json_count(item, "tets_in", data->tet_count);
        cli_json_count(item, "tets_out", row->tets_out);
        cli_json_real(item, "seconds_median", bench_median(&row->times));
        cli_json_real(item, "seconds_least", bench_least(&row->times));
        cli_json_real(item, "tets_per_second", (double)data->tet_count / bench_median(&row->times));
        cli_json_real(item, "rms_percent", 100 * row->rms / row->range);
        cli_json_real(item, "max_percent", 100 * row->max / row->range);
        cli_json_real(item, "volume_change_percent",
                      100 * (row->volume[1] - row->volume[0]) / row->volume[0]);
        cli_json_real(item, "boundary_percent", 100 * row->boundary / row->diagonal);
        cli_json_counts(item, "inverted", row->inverted, 2);
        cli_json_count(item, "peak_bytes", row->peak_bytes);
        cli_json_text(item, "remark", row->remark);
    }
}

int bench_simplify(bench_state *state, const bench_data *data)
{
    simplify_row rows[3];
    unsigned threads[2];
    size_t own_count = bench_threads(state, threads), count = 0;
    const bool peer = cli_get(state->session, CLI_AGAINST_VTK)->given;
    int exit_status = CLI_DONE;
    for (; count < own_count && !exit_status; count++)
        exit_status = measure_threads(state, data, threads[count], &rows[count]);
    if (!exit_status && own_count > 1 && rows[0].hash != rows[1].hash)
        remark(state, &rows[1], "threads differ");
    if (!exit_status && peer) exit_status = measure_peer(state, data, &rows[count++]);
    if (exit_status) return exit_status;
    cli_progress_clear(&state->session->progress);
    if (state->rows) {
        json_rows(state, data, rows, count);
        return CLI_DONE;
    }
    tl_status st = print_rows(state->session->ctx, data, rows, count);
    print_ratios(rows, own_count, peer);
    return st ? cli_fail(state->session, state->session->ctx, st) : CLI_DONE;
}
