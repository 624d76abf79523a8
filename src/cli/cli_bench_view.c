/* tetralod bench view: the first picture of a model, from opening it to its pixels, at an error of
 * a pixel and at full resolution, and how far the two are apart. */
#include <math.h>

#include "cli_bench.h"

enum { SIDE_PX = 512 };
static const double PIXELS = 1;

/* One picture and the seconds of its steps; decoding includes the welding. */
typedef struct view_row {
    tl_cut_state state;
    uint64_t bytes_read;
    double open, cut, decode, ready, draw, all, processor;
    tl_image *image;
} view_row;

/* What the transfer function of the bench shows of the first scalar. */
typedef struct view_look {
    uint32_t channel;
    tl_color_point colors[BENCH_COLORS];
    tl_opacity_point opacities[BENCH_OPACITIES];
    float *opacity, *unseen; /* [channel_count][TL_BINS] */
} view_look;

static tl_status look_at(tl_ctx *ctx, const tl_store_head *head, view_look *look)
{
    tl_status st = TL_OK;
    const size_t bins = (size_t)head->channel_count * TL_BINS;
    look->channel = 0;
    while (look->channel < head->channel_count &&
           (head->channels[look->channel].on != TL_ON_VERTEX ||
            head->channels[look->channel].components != 1))
        look->channel++;
    if (look->channel == head->channel_count)
        return tl_fail(ctx, TL_ERR_ARG, "the model has no scalar on vertices");
    const double *range = head->channels[look->channel].range;
    const double width = (range[1] - range[0]) / TL_BINS;
    look->opacity = tl_mem_zalloc(ctx, bins, sizeof *look->opacity, &st);
    look->unseen = tl_mem_zalloc(ctx, bins, sizeof *look->unseen, &st);
    bench_points(range, look->colors, look->opacities);
    const tl_control_points points = {.colors = look->colors,
                                      .color_count = BENCH_COLORS,
                                      .opacities = look->opacities,
                                      .opacity_count = BENCH_OPACITIES};
    for (size_t b = 0; !st && b < TL_BINS; b++) {
        double opacity, unseen, low = range[0] + (double)b * width;
        tl_control_points_visible(&points, low, low + width, &opacity, &unseen);
        look->opacity[look->channel * (size_t)TL_BINS + b] = (float)opacity;
        look->unseen[look->channel * (size_t)TL_BINS + b] = (float)unseen;
    }
    return st;
}

/* The seconds since the last call. */
static double lap(double *last)
{
    double now = cli_now(), passed = now - *last;
    *last = now;
    return passed;
}

static tl_status draw(tl_ctx *ctx, const tl_mesh *mesh, const tl_store_head *head,
                      const view_look *look, const tl_camera *camera, double *last, view_row *row)
{
    static const float black[3] = {0, 0, 0};
    tl_volume *volume = NULL;
    tl_transfer *transfer = NULL;
    tl_status st =
        bench_transfer(ctx, head->channels[look->channel].range, head->stats.diagonal, &transfer);
    if (!st) st = tl_volume_create(ctx, mesh, NULL, &volume);
    row->ready = lap(last);
    if (!st) st = tl_image_create(ctx, SIDE_PX, SIDE_PX, &row->image);
    if (!st)
        st = tl_draw_volume(ctx, volume, tl_mesh_channel(mesh, 0)->values, transfer, camera, NULL,
                            row->image);
    if (!st) tl_image_flatten(row->image, black);
    row->draw = lap(last);
    tl_volume_destroy(ctx, volume);
    tl_transfer_destroy(ctx, transfer);
    return st;
}

/* From the file to the picture. pixels 0: full resolution. */
static tl_status make_picture(tl_ctx *ctx, const char *path, double pixels, view_row *row)
{
    tl_store *store = NULL;
    tl_cut *cut = NULL;
    tl_mesh *mesh = NULL;
    view_look look = {0};
    tl_camera camera;
    double start = cli_now(), last = start, used = cli_cpu();
    tl_cut_query query = tl_cut_query_defaults();
    tl_status st = tl_store_open(ctx, path, &store);
    const tl_store_head *head = st ? NULL : tl_store_get_head(store);
    if (!st) st = look_at(ctx, head, &look);
    row->open = lap(&last);
    if (!st) {
        camera = tl_camera_fit(head->stats.bounds, 30, 20, 1.3, SIDE_PX, SIDE_PX);
        query.camera = &camera;
        query.opacity = look.opacity;
        query.unseen = look.unseen;
        if (pixels > 0)
            query.pixels = pixels;
        else
            query.level = 0;
        st = tl_cut_create(ctx, store, &cut);
    }
    if (!st) st = tl_cut_update(cut, &query);
    row->cut = lap(&last);
    const size_t channel = look.channel;
    if (!st) st = tl_cut_mesh(cut, &channel, 1, &mesh);
    row->decode = lap(&last);
    if (!st) st = draw(ctx, mesh, head, &look, &camera, &last, row);
    row->all = cli_now() - start;
    row->processor = cli_cpu() - used;
    if (!st) row->state = tl_cut_get_state(cut);
    if (!st) row->bytes_read = tl_store_bytes_read(store);
    tl_mesh_destroy(mesh);
    tl_cut_destroy(cut);
    tl_mem_free(ctx, look.unseen);
    tl_mem_free(ctx, look.opacity);
    tl_store_close(store);
    return st;
}

static void print_row(const char *name, const view_row *r)
{
    printf("%-11s %s tets in %s patches: opened %s, cut %s, decoded %s, made ready %s, drawn %s: "
           "%s, %s of processor time\n",
           name, cli_count(r->state.tets).s, cli_count(r->state.patches).s, cli_seconds(r->open).s,
           cli_seconds(r->cut).s, cli_seconds(r->decode).s, cli_seconds(r->ready).s,
           cli_seconds(r->draw).s, cli_seconds(r->all).s, cli_seconds(r->processor).s);
}

static void put_row(json_t *list, const char *name, const view_row *r)
{
    json_t *item = cli_json_item(list);
    cli_json_text(item, "what", name);
    cli_json_count(item, "tets", r->state.tets);
    cli_json_count(item, "patches", r->state.patches);
    cli_json_count(item, "bytes_read", r->bytes_read);
    cli_json_real(item, "error_px", r->state.pixels);
    cli_json_real(item, "open_seconds", r->open);
    cli_json_real(item, "cut_seconds", r->cut);
    cli_json_real(item, "decode_seconds", r->decode);
    cli_json_real(item, "ready_seconds", r->ready);
    cli_json_real(item, "draw_seconds", r->draw);
    cli_json_real(item, "seconds", r->all);
    cli_json_real(item, "processor_seconds", r->processor);
}

int bench_view(bench_state *state, const bench_data *data)
{
    tl_ctx *ctx = state->session->ctx;
    view_row seen = {0}, full = {0};
    tl_status st = make_picture(ctx, data->path, PIXELS, &seen);
    if (!st) st = make_picture(ctx, data->path, 0, &full);
    cli_progress_clear(&state->session->progress);
    double decibels = st ? 0 : bench_decibels(seen.image, full.image);
    if (!st && state->rows) {
        put_row(state->rows, "a pixel", &seen);
        put_row(state->rows, "full", &full);
        cli_json_real(json_array_get(state->rows, json_array_size(state->rows) - 2), "decibels",
                      decibels);
    } else if (!st) {
        print_row("a pixel", &seen);
        print_row("full", &full);
        printf(
            "            off by at most %s pixels; the pictures are %.1f dB apart; %.1f times as "
            "fast, %.1f times less processor time\n",
            cli_real(seen.state.pixels).s, decibels, full.all / seen.all,
            full.processor / seen.processor);
    }
    tl_image_destroy(ctx, full.image);
    tl_image_destroy(ctx, seen.image);
    return st ? cli_fail(state->session, ctx, st) : CLI_DONE;
}
