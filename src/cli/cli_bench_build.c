/* tetralod bench build: speed, memory and size of models by size of their segments; every model is
 * proved in full, with random cuts. */
#include <math.h>
#include <sys/resource.h>
#include <unistd.h>

#include "cli_bench.h"
#include "tetralod/cut.h"
#include "tetralod/model.h"

/* Tets of a segment; 0: the library's own. */
static const uint32_t SIZES[] = {32768, 65536, 0};
enum { SIZE_COUNT = sizeof SIZES / sizeof *SIZES, CUTS = 4 };

typedef struct build_row {
    tl_build_result result;
    double seconds, cpu_s;
    double resident; /* of the process at most so far, bytes */
    bool verified;
} build_row;

/* Proves the file that was built. */
static bool verify(tl_ctx *ctx, const char *path)
{
    tl_store *store = NULL;
    tl_cut_check_opts opts = tl_cut_check_opts_defaults();
    tl_cut_check_result found = {0};
    opts.cuts = CUTS;
    tl_status st = tl_store_open(ctx, path, &store);
    if (!st) st = tl_store_check(ctx, store, TL_CHECK_FULL);
    if (!st) st = tl_cut_check(ctx, store, NULL, &opts, &found);
    tl_cut_check_release(ctx, &found);
    tl_store_close(store);
    return st == TL_OK;
}

static tl_status measure_size(bench_state *state, const bench_data *data, const tl_read_opts *read,
                              uint32_t segment_tets, void *to)
{
    build_row *row = to;
    tl_ctx *ctx = state->session->ctx;
    tl_build_opts opts = tl_build_opts_defaults();
    char path[BENCH_PATH_BYTES + 16];
    struct rusage usage;
    snprintf(path, sizeof path, "%s/build.tlod", state->folder);
    opts.segment_tets = segment_tets;
    opts.folder = state->folder;
    opts.memory_bytes = cli_get(state->session, CLI_MEMORY)->count;
    double cpu = cli_cpu();
    tl_status st = tl_model_build(ctx, data->path, read, path, &opts, &row->result);
    if (st) return st;
    row->seconds = row->result.seconds;
    row->cpu_s = cli_cpu() - cpu;
    getrusage(RUSAGE_SELF, &usage);
    row->resident = (double)usage.ru_maxrss * 1024;
    row->verified = verify(ctx, path);
    state->broken += !row->verified;
    unlink(path);
    return TL_OK;
}

static void print_rows(const build_row *rows)
{
    printf("tets a segment  levels  segments  patches  build    tets/s by the clock, by the "
           "processors  bytes a tet  held      resident  verified\n");
    for (size_t i = 0; i < SIZE_COUNT; i++) {
        const tl_build_result *r = &rows[i].result;
        double tets = (double)r->tets_in;
        printf("%-14s  %-6zu  %-8s  %-7s  %-7s  %-19s  %-18s  %-11.3f  %-8s  %-8s  %s\n",
               SIZES[i] ? cli_count(SIZES[i]).s : "default", r->level_count,
               cli_count(r->segments).s, cli_count(r->patches).s, cli_seconds(rows[i].seconds).s,
               cli_rate(tets / rows[i].seconds).s, cli_rate(tets / rows[i].cpu_s).s,
               (double)r->bytes / tets, cli_bytes((double)r->peak_bytes).s,
               cli_bytes(rows[i].resident).s, rows[i].verified ? "ok" : "BROKEN");
    }
}

static void json_rows(bench_state *state, const bench_data *data, const build_row *rows)
{
    for (size_t i = 0; i < SIZE_COUNT; i++) {
        const tl_build_result *r = &rows[i].result;
        json_t *item = cli_json_item(state->rows);
        cli_json_text(item, "data", data->name);
        cli_json_count(item, "tets", r->tets_in);
        cli_json_count(item, "segment_tets", SIZES[i]);
        cli_json_count(item, "levels", r->level_count);
        cli_json_count(item, "segments", r->segments);
        cli_json_count(item, "patches", r->patches);
        cli_json_count(item, "tets_stored", r->tets_stored);
        cli_json_count(item, "bytes", r->bytes);
        cli_json_real(item, "seconds", rows[i].seconds);
        cli_json_real(item, "cpu_seconds", rows[i].cpu_s);
        cli_json_count(item, "peak_bytes", r->peak_bytes);
        cli_json_real(item, "resident_bytes", rows[i].resident);
        cli_json_flag(item, "verified", rows[i].verified);
    }
}

int bench_build(bench_state *state, const bench_data *data)
{
    build_row rows[SIZE_COUNT] = {0};
    int exit_status = bench_sizes(state, data, measure_size, SIZES, SIZE_COUNT, rows, sizeof *rows);
    if (!exit_status && state->rows)
        json_rows(state, data, rows);
    else if (!exit_status) {
        printf("\ninput       %s: %s tets\n", data->name, cli_count(rows[0].result.tets_in).s);
        print_rows(rows);
    }
    for (size_t i = 0; i < SIZE_COUNT; i++) tl_build_release(state->session->ctx, &rows[i].result);
    return exit_status;
}
