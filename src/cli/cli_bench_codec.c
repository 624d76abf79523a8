/* tetralod bench codec: bits and speed of the codec by size of the patches, at the default errors.
 * Everything is decoded and compared in the same run. */
#include "cli_bench.h"

/* Of the diagonal and of a channel's range: the defaults of a model. */
#define POSITION_ERROR 1e-5
#define CHANNEL_ERROR 1e-4

static const uint32_t PATCH_TETS[] = {2000, 4000, 8000, 16000};
enum { SIZE_COUNT = sizeof PATCH_TETS / sizeof *PATCH_TETS };

static tl_status measure_sizes(bench_state *state, const bench_data *data,
                               tl_codec_report reports[SIZE_COUNT])
{
    tl_ctx *ctx = state->session->ctx;
    unsigned runs = (unsigned)cli_get(state->session, CLI_RUNS)->count + 1; /* and a warm-up */
    tl_mesh *mesh = NULL;
    tl_status st = tl_mesh_read(ctx, data->path, NULL, &mesh, NULL);
    for (int i = 0; i < SIZE_COUNT && !st; i++)
        st = tl_codec_measure(ctx, mesh, PATCH_TETS[i], POSITION_ERROR, CHANNEL_ERROR, runs,
                              &reports[i]);
    tl_mesh_destroy(mesh);
    return st;
}

/* A quantity with three digits behind the point. */
static cli_text fixed(double value)
{
    cli_text text;
    snprintf(text.s, sizeof text.s, "%.3f", value);
    return text;
}

static double decode_s(const tl_codec_report *r)
{
    return r->topology_decode_s + r->channel_decode_s;
}

static double all_bytes(const tl_codec_report *r)
{
    return r->topology_bytes + r->channel_bytes + (double)r->table_bytes;
}

static tl_status print_reports(tl_ctx *ctx, const tl_codec_report *reports)
{
    cli_table table;
    tl_status st = cli_table_create(ctx, SIZE_COUNT + 1, 12, &table);
    if (st) return st;
    cli_table_head(&table, "tets a patch|patches|border faces/tet|connectivity b/tet|places b/tet|"
                           "flags b/tet|channel b/tet|bytes/tet|tables|encode|decode topology|"
                           "decode");
    for (size_t i = 0; i < SIZE_COUNT; i++) {
        const tl_codec_report *r = &reports[i];
        double tets = (double)r->tet_count;
        cli_table_set(&table, i + 1, 0, cli_count(PATCH_TETS[i]));
        cli_table_set(&table, i + 1, 1, cli_count(r->patch_count));
        cli_table_set(&table, i + 1, 2, fixed((double)r->border_face_count / tets));
        cli_table_set(&table, i + 1, 3, fixed(r->connectivity_bits / tets));
        cli_table_set(&table, i + 1, 4, fixed(r->place_bits / tets));
        cli_table_set(&table, i + 1, 5, fixed((r->flag_bits + r->region_bits) / tets));
        cli_table_set(&table, i + 1, 6, fixed(r->channel_bits / tets));
        cli_table_set(&table, i + 1, 7, fixed(all_bytes(r) / tets));
        cli_table_set(&table, i + 1, 8, cli_bytes((double)r->table_bytes));
        cli_table_set(&table, i + 1, 9, cli_rate(tets / r->encode_s));
        cli_table_set(&table, i + 1, 10, cli_rate(tets / r->topology_decode_s));
        cli_table_set(&table, i + 1, 11, cli_rate(tets / decode_s(r)));
    }
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    return TL_OK;
}

static void json_reports(bench_state *state, const bench_data *data, const tl_codec_report *reports)
{
    char hash[24];
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)data->hash);
    for (size_t i = 0; i < SIZE_COUNT; i++) {
        const tl_codec_report *r = &reports[i];
        double tets = (double)r->tet_count;
        json_t *item = cli_json_item(state->rows);
        cli_json_text(item, "data", data->name);
        cli_json_text(item, "hash", hash);
        cli_json_count(item, "tets", r->tet_count);
        cli_json_count(item, "patch_tets", PATCH_TETS[i]);
        cli_json_count(item, "patches", r->patch_count);
        cli_json_real(item, "border_faces_per_tet", (double)r->border_face_count / tets);
        cli_json_real(item, "connectivity_bits", r->connectivity_bits / tets);
        cli_json_real(item, "place_bits", r->place_bits / tets);
        cli_json_real(item, "flag_bits", r->flag_bits / tets);
        cli_json_real(item, "region_bits", r->region_bits / tets);
        cli_json_real(item, "channel_bits", r->channel_bits / tets);
        cli_json_real(item, "bytes_per_tet", all_bytes(r) / tets);
        cli_json_count(item, "table_bytes", r->table_bytes);
        cli_json_real(item, "encode_per_second", tets / r->encode_s);
        cli_json_real(item, "topology_decode_per_second", tets / r->topology_decode_s);
        cli_json_real(item, "decode_per_second", tets / decode_s(r));
        cli_json_flag(item, "verified", true);
    }
}

int bench_codec(bench_state *state, const bench_data *data)
{
    tl_codec_report reports[SIZE_COUNT];
    tl_status st = measure_sizes(state, data, reports);
    cli_progress_clear(&state->session->progress);
    if (!st && state->rows)
        json_reports(state, data, reports);
    else if (!st)
        st = print_reports(state->session->ctx, reports);
    return st ? cli_fail(state->session, state->session->ctx, st) : CLI_DONE;
}
