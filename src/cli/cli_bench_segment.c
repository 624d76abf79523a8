/* tetralod bench segment: tables 6.3 to 6.5 of Sondershaus 2007 for a file: the balance of segments
 * of several sizes, the time to make them and to match their faces, what the stream holds at most.
 */
#include <math.h>
#include <sys/resource.h>

#include "cli_bench.h"

/* Tets of a segment; the last is the library's own. */
static const uint32_t SIZES[] = {7500, 15000, 30000, 20000};
enum { SIZE_COUNT = sizeof SIZES / sizeof *SIZES };
#define MEMORY_DEFAULT ((uint64_t)256 << 20)

/* Least, mean and most of something. */
typedef struct spread {
    double least, most, sum;
} spread;

typedef struct segment_row {
    uint32_t segments;
    uint64_t tet_count, file_bytes;
    spread tets, verts;
    double shared; /* part of the vertices of segments that others hold as well */
    double build_s, adjacency_s;
    double cpu_s; /* of all threads, for both */
    uint32_t max_segments;
    uint64_t max_tets;
    size_t peak_bytes;
    bool verified;
} segment_row;

static void add(spread *s, double value, bool first)
{
    s->least = first || value < s->least ? value : s->least;
    s->most = first || value > s->most ? value : s->most;
    s->sum += value;
}

static tl_status measure_stream(tl_ctx *ctx, const tl_segments *segments, segment_row *row)
{
    tl_stream stream;
    tl_status st = tl_segments_stream(ctx, segments, &stream);
    if (st) return st;
    row->max_segments = stream.max_segments;
    row->max_tets = stream.max_tets;
    tl_stream_release(ctx, &stream);
    return TL_OK;
}

static void measure_balance(const tl_segments *segments, segment_row *row)
{
    double shared = 0;
    row->segments = tl_segments_count(segments);
    row->tet_count = tl_segments_tet_count(segments);
    row->file_bytes = tl_segments_bytes(segments);
    for (uint32_t s = 0; s < row->segments; s++) {
        tl_segment_summary info = tl_segments_info(segments, s);
        add(&row->tets, info.tet_count, s == 0);
        add(&row->verts, info.vert_count, s == 0);
        shared += info.shared_count;
    }
    row->shared = row->verts.sum > 0 ? shared / row->verts.sum : 0;
}

/* One build; of two, without and with adjacency, the difference is what the latter takes. */
static tl_status build(bench_state *state, const bench_data *data, const tl_read_opts *read,
                       tl_segment_opts *opts, bool adjacency, segment_row *row, double *seconds)
{
    tl_ctx *ctx = state->session->ctx;
    tl_segments *segments = NULL;
    opts->adjacency = adjacency;
    tl_ctx_reset_peak(ctx);
    double start = cli_now(), cpu = cli_cpu();
    tl_status st = tl_segments_build(ctx, data->path, read, opts, NULL, &segments, NULL);
    *seconds = cli_now() - start;
    if (!st && adjacency) {
        row->cpu_s = cli_cpu() - cpu;
        row->peak_bytes = tl_ctx_peak_bytes(ctx);
        measure_balance(segments, row);
        st = measure_stream(ctx, segments, row);
        if (!st) row->verified = tl_segments_check(ctx, segments, TL_CHECK_FULL) == TL_OK;
    }
    tl_segments_destroy(segments);
    return st;
}

static tl_status measure_size(bench_state *state, const bench_data *data, const tl_read_opts *read,
                              uint32_t size, void *to)
{
    segment_row *row = to;
    tl_segment_opts opts = tl_segment_opts_defaults();
    const cli_value *memory = cli_get(state->session, CLI_MEMORY);
    bench_times plain = {0}, full = {0};
    tl_status st = TL_OK;
    const size_t runs = (size_t)cli_get(state->session, CLI_RUNS)->count;
    opts.segment_tets = size;
    opts.folder = state->folder;
    opts.memory_bytes = memory->given ? memory->count : MEMORY_DEFAULT;
    for (size_t i = 0; !st && i < runs; i++) {
        *row = (segment_row){0};
        st = build(state, data, read, &opts, false, row, &plain.seconds[i]);
        if (!st) st = build(state, data, read, &opts, true, row, &full.seconds[i]);
        plain.count = full.count = i + 1;
    }
    row->build_s = bench_median(&plain);
    row->adjacency_s = bench_median(&full) - row->build_s;
    if (!row->verified) state->broken++;
    return st;
}

static void set_spread(cli_table *table, size_t row, size_t column, const spread *s, double count)
{
    cli_table_set(table, row, column, cli_count((uint64_t)s->least));
    cli_table_set(table, row, column + 1, cli_count((uint64_t)llround(s->sum / count)));
    cli_table_set(table, row, column + 2, cli_count((uint64_t)s->most));
}

static tl_status print_rows(bench_state *state, const segment_row *rows)
{
    cli_table table;
    struct rusage usage = {0};
    tl_status st = cli_table_create(state->session->ctx, SIZE_COUNT + 1, 14, &table);
    if (st) return st;
    cli_table_head(&table, "tets a segment|segments|vertices least|mean|most|tets least|mean|most|"
                           "shared|build|adjacency|file|stream holds|verified");
    for (size_t i = 0; i < SIZE_COUNT; i++) {
        const segment_row *row = &rows[i];
        cli_table_set(&table, i + 1, 0, cli_count(SIZES[i]));
        cli_table_set(&table, i + 1, 1, cli_count(row->segments));
        set_spread(&table, i + 1, 2, &row->verts, row->segments);
        set_spread(&table, i + 1, 5, &row->tets, row->segments);
        cli_table_set(&table, i + 1, 8, cli_share(row->shared, 1));
        cli_table_set(&table, i + 1, 9, cli_seconds(row->build_s));
        cli_table_set(&table, i + 1, 10, cli_seconds(row->adjacency_s));
        cli_table_set(&table, i + 1, 11, cli_bytes((double)row->file_bytes));
        cli_table_set(&table, i + 1, 12, cli_share(row->max_segments, row->segments));
        cli_table_set(&table, i + 1, 13, cli_name(row->verified ? "ok" : "BROKEN"));
    }
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    const segment_row *last = &rows[SIZE_COUNT - 1];
    getrusage(RUSAGE_SELF, &usage);
    printf("speed       %s tets by the clock, %s by the processors, of all steps at %s a segment\n",
           cli_rate((double)last->tet_count / (last->build_s + last->adjacency_s)).s,
           cli_rate((double)last->tet_count / last->cpu_s).s, cli_count(SIZES[SIZE_COUNT - 1]).s);
    printf("memory      %s at most by the library, %s resident\n",
           cli_bytes((double)last->peak_bytes).s, cli_bytes(1024.0 * (double)usage.ru_maxrss).s);
    return TL_OK;
}

static void json_rows(bench_state *state, const bench_data *data, const segment_row *rows)
{
    for (size_t i = 0; i < SIZE_COUNT; i++) {
        const segment_row *row = &rows[i];
        json_t *item = cli_json_item(state->rows);
        cli_json_text(item, "data", data->name);
        cli_json_count(item, "tets", row->tet_count);
        cli_json_count(item, "segment_tets", SIZES[i]);
        cli_json_count(item, "segments", row->segments);
        cli_json_real(item, "vertices_least", row->verts.least);
        cli_json_real(item, "vertices_most", row->verts.most);
        cli_json_real(item, "tets_least", row->tets.least);
        cli_json_real(item, "tets_most", row->tets.most);
        cli_json_real(item, "shared", row->shared);
        cli_json_real(item, "build_seconds", row->build_s);
        cli_json_real(item, "adjacency_seconds", row->adjacency_s);
        cli_json_real(item, "cpu_seconds", row->cpu_s);
        cli_json_count(item, "file_bytes", row->file_bytes);
        cli_json_count(item, "stream_segments", row->max_segments);
        cli_json_count(item, "stream_tets", row->max_tets);
        cli_json_count(item, "peak_bytes", row->peak_bytes);
        cli_json_flag(item, "verified", row->verified);
    }
}

int bench_segment(bench_state *state, const bench_data *data)
{
    segment_row rows[SIZE_COUNT];
    int exit_status = bench_sizes(state, data, measure_size, SIZES, SIZE_COUNT, rows, sizeof *rows);
    if (!exit_status && state->rows)
        json_rows(state, data, rows);
    else if (!exit_status) {
        printf("\ninput       %s: %s tets\n", data->name, cli_count(rows[0].tet_count).s);
        tl_status st = print_rows(state, rows);
        if (st) exit_status = cli_fail(state->session, state->session->ctx, st);
    }
    return exit_status;
}
