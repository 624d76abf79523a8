/* tetralod bench live: a live view of a model without a window. How long its first picture takes;
 * then, of an isosurface and of a volume, how many frames a second while the camera turns, and how
 * long it takes at rest until the picture is off by a pixel, and until it is all that was asked
 * for. That one is compared with a picture that is drawn at once. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "cli_bench.h"

enum { WIDTH = 1280, HEIGHT = 800, SIDE_MAX = 8192 };
/* A hand moves the camera so often, a second, and by that many degrees. */
static const double MOVES = 60, DEGREES = 0.75;
/* Longest time that anything is waited for, seconds. */
static const double PATIENCE_S = 120;
/* The isosurface's place in the range of the channel. */
static const double VALUE = 0.4;

typedef struct live_row {
    const char *name;
    double turned_s, cpu_s; /* while turning, of all threads */
    tl_live_stats stats;    /* after turning */
    uint64_t turn_tets;
    double turn_px;          /* error on the screen while turning */
    double pixel_s, final_s; /* at rest */
    uint64_t tets;
    bool is_same; /* as the picture that is drawn at once */
} live_row;

typedef struct live_bench {
    bench_state *state;
    const char *path;
    tl_ctx *ctx; /* the shell's */
    tl_live *live;
    tl_scene *scene;
    uint32_t width, height;
    double seconds;
    double first_s, look_s; /* from opening to the first picture, and to the last one of the look */
    double first_cpu_s;
    uint64_t first_tets, first_bytes;
    uint64_t number;    /* of the last frame */
    char failure[1000]; /* an event's; "": none */
} live_bench;

/* ---- waiting ---- */

static void take_events(live_bench *b)
{
    tl_live_event event;
    while (tl_live_next_event(b->live, &event))
        if (event.kind == TL_LIVE_FAILED) snprintf(b->failure, sizeof b->failure, "%s", event.text);
}

/* The next frame, or NULL after some seconds, or when the view has settled. */
static const tl_frame *next_frame(live_bench *b, double seconds)
{
    tl_live_wait(b->live, b->number, seconds);
    take_events(b);
    const tl_frame *frame = tl_live_frame(b->live);
    if (frame) b->number = frame->number;
    return frame;
}

static tl_status set(live_bench *b, const char *format, ...) TL_PRINTF(2, 3);
static tl_status set(live_bench *b, const char *format, ...)
{
    char command[TL_SCENE_TEXT_BYTES];
    va_list args;
    va_start(args, format);
    vsnprintf(command, sizeof command, format, args);
    va_end(args);
    return tl_scene_do(b->ctx, b->scene, command);
}

/* ---- the first picture ---- */

static tl_status open_model(live_bench *b)
{
    const double start = cli_now(), cpu = cli_cpu();
    bool opened = false;
    tl_status st = tl_live_open(b->live, b->path, NULL);
    while (!st && !b->first_s && !b->failure[0] && cli_now() - start < PATIENCE_S) {
        const tl_frame *frame = next_frame(b, 1);
        if (!frame) continue;
        b->first_s = cli_now() - start;
        b->first_cpu_s = cli_cpu() - cpu;
        b->first_tets = frame->facts->tets;
        b->first_bytes = tl_live_get_stats(b->live).bytes_read;
        if (frame->is_final) b->look_s = b->first_s;
        tl_live_release(b->live, frame);
    }
    while (!st && !b->failure[0] && cli_now() - start < PATIENCE_S && !b->look_s) {
        const tl_frame *frame = next_frame(b, 1);
        if (frame && frame->is_final) b->look_s = cli_now() - start;
        tl_live_release(b->live, frame);
    }
    opened = b->look_s > 0;
    if (!st && !opened)
        st = tl_fail(b->ctx, TL_ERR_DATA, "'%s': no picture came: %s", b->path, b->failure);
    return st ? st : tl_live_get_scene(b->live, b->ctx, &b->scene);
}

/* ---- scenes ---- */

static const tl_source_channel *first_scalar(const tl_source_facts *facts)
{
    for (size_t i = 0; i < facts->channel_count; i++)
        if (facts->channels[i].components == 1 && facts->channels[i].on == TL_ON_VERTEX)
            return &facts->channels[i];
    return NULL;
}

static tl_status remove_things(live_bench *b)
{
    size_t count = 0;
    tl_status st = TL_OK;
    const tl_node *nodes = tl_scene_nodes(b->scene, &count);
    while (!st && count > 0 && tl_scene_kind(b->scene, nodes[count - 1]) > TL_NODE_DETAIL) {
        st = tl_scene_remove(b->ctx, b->scene, nodes[count - 1]);
        nodes = tl_scene_nodes(b->scene, &count);
    }
    return st;
}

static tl_status show_surface(live_bench *b, const tl_source_channel *channel)
{
    const double *range = channel->range;
    tl_status st = remove_things(b);
    if (!st)
        st = set(b, "add surface \"channel=%s\" value=%.17g", channel->name,
                 range[0] + VALUE * (range[1] - range[0]));
    return st;
}

static tl_status show_volume(live_bench *b, const tl_source_channel *channel)
{
    tl_status st = remove_things(b);
    return st ? st : set(b, "add volume \"channel=%s\"", channel->name);
}

/* ---- turning, and at rest ---- */

/* As a window does: the camera follows a hand, frames are taken when they come. */
static tl_status turn(live_bench *b, live_row *row)
{
    tl_status st = TL_OK;
    tl_live_set_moving(b->live, true);
    tl_live_reset_stats(b->live);
    double start = cli_now(), cpu = cli_cpu(), moved = start;
    while (!st && !b->failure[0] && cli_now() - start < b->seconds) {
        tl_camera camera;
        tl_scene_camera(b->scene, b->width, b->height, &camera);
        tl_camera_orbit(&camera, NULL, DEGREES * fmax(1, MOVES * (cli_now() - moved)), 0,
                        TL_ORBIT_TURNTABLE, NULL);
        moved = cli_now();
        st = tl_scene_set_camera(b->ctx, b->scene, &camera);
        if (!st) st = tl_live_set_scene(b->live, b->scene);
        const tl_frame *frame = next_frame(b, 1 / MOVES);
        if (frame) {
            row->turn_tets = frame->facts->tets;
            row->turn_px = frame->facts->error_px;
        }
        tl_live_release(b->live, frame);
    }
    row->turned_s = cli_now() - start;
    row->cpu_s = cli_cpu() - cpu;
    row->stats = tl_live_get_stats(b->live);
    return st;
}

/* The picture of the scene, drawn on this thread, against a frame. */
static tl_status draw_at_once(live_bench *b, const tl_frame *frame, bool *is_same)
{
    tl_ctx *ctx = b->ctx;
    tl_source *source = NULL;
    tl_view *view = NULL;
    tl_content *content = NULL;
    tl_renderer *renderer = NULL;
    tl_shown *shown = NULL;
    tl_image *image = NULL;
    tl_draw_opts opts = tl_draw_opts_defaults();
    static const float white[3] = {1, 1, 1}; /* the preset of scenes */
    opts.samples = frame->samples;
    *is_same = true;
    tl_status st = tl_source_open(ctx, b->path, &source);
    if (!st) st = tl_view_create(ctx, source, &view);
    if (!st) st = tl_view_build(ctx, view, b->scene, &frame->camera, NULL, &content);
    if (!st) st = tl_renderer_create(ctx, TL_RENDERER_CPU, &renderer);
    if (!st) st = tl_shown_create(ctx, renderer, &shown);
    if (!st) st = tl_content_show(ctx, shown, content);
    if (!st) st = tl_content_draw(ctx, shown, &frame->camera, &opts, &image);
    if (!st) st = tl_content_annotate(ctx, content, b->scene, &frame->camera, image);
    if (!st) tl_image_flatten(image, white);
    for (size_t i = 0; !st && i < 4 * (size_t)frame->width * frame->height; i++)
        *is_same = *is_same &&
                   (uint8_t)(fminf(fmaxf(image->rgba[i], 0), 1) * 255 + 0.5F) == frame->rgba[i];
    tl_image_destroy(ctx, image);
    tl_shown_destroy(ctx, shown);
    tl_renderer_destroy(ctx, renderer);
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
    tl_source_destroy(source);
    return st;
}

static tl_status rest(live_bench *b, live_row *row)
{
    tl_status st = TL_OK;
    const double start = cli_now();
    tl_live_set_moving(b->live, false);
    while (!st && !row->final_s && !b->failure[0] && cli_now() - start < PATIENCE_S) {
        const tl_frame *frame = next_frame(b, 1);
        if (!frame) continue;
        if (frame->is_complete && !row->pixel_s) row->pixel_s = cli_now() - start;
        if (frame->is_final) {
            row->final_s = cli_now() - start;
            row->tets = frame->facts->tets;
            st = draw_at_once(b, frame, &row->is_same);
        }
        tl_live_release(b->live, frame);
    }
    if (!st && !row->final_s)
        st = tl_fail(b->ctx, TL_ERR_DATA, "%s: the picture never became whole: %s", row->name,
                     b->failure);
    return st;
}

static tl_status fly(live_bench *b, live_row *row)
{
    tl_status st = tl_live_set_scene(b->live, b->scene);
    const double start = cli_now();
    bool is_final = false; /* of the new scene: what is turned is there */
    while (!st && !is_final && !b->failure[0] && cli_now() - start < PATIENCE_S) {
        const tl_frame *frame = next_frame(b, 1);
        is_final = frame && frame->is_final && frame->scene_version == tl_scene_version(b->scene);
        tl_live_release(b->live, frame);
    }
    if (!st) st = turn(b, row);
    return st ? st : rest(b, row);
}

/* ---- figures ---- */

static double frames_a_second(const live_row *r)
{
    return (double)r->stats.moving_frames / r->turned_s;
}

static void print_row(const live_bench *b, const live_row *r)
{
    printf(
        "%-11s turning %.1f frames/s (1/%u of the pixels a side, %s tets, off by %s px), longest "
        "frame %s, from a move to its frame %s at most\n",
        r->name, frames_a_second(r), r->stats.reduction, cli_count(r->turn_tets).s,
        cli_real(r->turn_px).s, cli_seconds(r->stats.longest_frame_s).s,
        cli_seconds(r->stats.longest_wait_s).s);
    printf("            %s of processor time a frame, with building; at rest off by a pixel after "
           "%s (%s tets), last picture after %s, %s drawn at once\n",
           cli_seconds(r->cpu_s / (double)(r->stats.moving_frames ? r->stats.moving_frames : 1)).s,
           cli_seconds(r->pixel_s).s, cli_count(r->tets).s, cli_seconds(r->final_s).s,
           r->is_same ? "that which is" : "NOT THAT WHICH IS");
    (void)b;
}

static void put_row(const live_bench *b, const live_row *r)
{
    json_t *item = cli_json_item(b->state->rows);
    cli_json_text(item, "what", r->name);
    cli_json_count(item, "width", b->width);
    cli_json_count(item, "height", b->height);
    cli_json_real(item, "first_seconds", b->first_s);
    cli_json_real(item, "first_processor_seconds", b->first_cpu_s);
    cli_json_real(item, "frames_per_second", frames_a_second(r));
    cli_json_real(item, "processor_seconds_per_frame", r->cpu_s / (double)r->stats.moving_frames);
    cli_json_real(item, "longest_frame_seconds", r->stats.longest_frame_s);
    cli_json_real(item, "longest_wait_seconds", r->stats.longest_wait_s);
    cli_json_count(item, "reduction", r->stats.reduction);
    cli_json_count(item, "moving_tets", r->turn_tets);
    cli_json_real(item, "moving_error_px", r->turn_px);
    cli_json_real(item, "pixel_seconds", r->pixel_s);
    cli_json_real(item, "final_seconds", r->final_s);
    cli_json_count(item, "tets", r->tets);
    cli_json_count(item, "bytes_read", r->stats.bytes_read);
    cli_json_count(item, "ram_peak_bytes", r->stats.ram_peak_bytes);
}

static void print_all(const live_bench *b, const tl_live_stats *end)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    printf("%ux%u    first picture after %s, %s of processor time (%s tets, %s read), the first "
           "look whole after %s\n",
           b->width, b->height, cli_seconds(b->first_s).s, cli_seconds(b->first_cpu_s).s,
           cli_count(b->first_tets).s, cli_bytes((double)b->first_bytes).s,
           cli_seconds(b->look_s).s);
    printf(
        "memory      %s at most since the last flight began, of %s allowed; resident at most %s; "
        "%s read\n",
        cli_bytes((double)end->ram_peak_bytes).s, cli_bytes((double)end->ram_limit_bytes).s,
        cli_bytes(1024.0 * (double)usage.ru_maxrss).s, cli_bytes((double)end->bytes_read).s);
}

/* ---- the bench ---- */

static int read_size(live_bench *b)
{
    const cli_value *size = cli_get(b->state->session, CLI_SIZES);
    char *end = NULL;
    b->width = WIDTH;
    b->height = HEIGHT;
    if (!size->given) return CLI_DONE;
    unsigned long width = strtoul(size->items[0], &end, 10), height = 0;
    if (*end == 'x') height = strtoul(end + 1, &end, 10);
    if (*end || width < 16 || height < 16 || width > SIDE_MAX || height > SIDE_MAX)
        return cli_misuse(b->state->session->args.verb,
                          "--size %s: expected WxH of 16 to %d pixels a side", size->items[0],
                          SIDE_MAX);
    b->width = (uint32_t)width;
    b->height = (uint32_t)height;
    return CLI_DONE;
}

static tl_status create_live(live_bench *b)
{
    const cli_session *session = b->state->session;
    tl_live_opts opts = tl_live_opts_defaults();
    opts.thread_count = tl_ctx_thread_count(b->ctx);
    opts.renderer = cli_get(session, CLI_RENDERER)->choice ? TL_RENDERER_GL : TL_RENDERER_CPU;
    opts.ram_bytes = cli_get(session, CLI_MEMORY)->count;
    opts.throttle_bytes_s = (uint64_t)(cli_get(session, CLI_THROTTLE)->real * 1e6);
    b->seconds = cli_get(session, CLI_SECONDS)->real;
    tl_status st = tl_live_create(&opts, &b->live);
    if (!st) tl_live_set_size(b->live, b->width, b->height);
    return st ? tl_fail(b->ctx, st, "the live view can't be started") : TL_OK;
}

int bench_live(bench_state *state, const bench_data *data)
{
    live_bench b = {.state = state, .path = data->path, .ctx = state->session->ctx};
    live_row rows[2] = {{.name = "isosurface"}, {.name = "volume"}};
    int exit_status = read_size(&b);
    if (exit_status) return exit_status;
    tl_status st = create_live(&b);
    if (!st) st = open_model(&b);
    const tl_source_channel *channel =
        st ? NULL : first_scalar(tl_source_get_facts(tl_live_source(b.live)));
    if (!st && !channel) st = tl_fail(b.ctx, TL_ERR_ARG, "the model has no scalar on vertices");
    if (!st) st = show_surface(&b, channel);
    if (!st) st = fly(&b, &rows[0]);
    if (!st) st = show_volume(&b, channel);
    if (!st) st = fly(&b, &rows[1]);
    if (!st) {
        const tl_live_stats end = tl_live_get_stats(b.live);
        if (!state->rows) print_all(&b, &end);
        for (int i = 0; i < 2; i++) {
            (state->rows ? put_row : print_row)(&b, &rows[i]);
            state->broken += !rows[i].is_same;
        }
    }
    tl_scene_destroy(b.ctx, b.scene);
    tl_live_destroy(b.live);
    return st ? cli_fail(state->session, b.ctx, st) : CLI_DONE;
}
