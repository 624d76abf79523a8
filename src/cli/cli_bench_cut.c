/* tetralod bench cut: how fast a model opens, how fast its cut follows a camera, how fast meshes
 * come out of it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_bench.h"

/* Frames of a flight around the middle of the data set, so near that a part of it is out of view,
 * and how far the camera turns in each. */
#define FRAMES 400
#define STEP_DEGREES 0.5
#define DISTANCE_DIAGONALS 0.6
/* Views from anywhere, and errors that are asked for in them. */
#define VIEWS 60

typedef enum frame_kind { SMALL_MOVE, NEW_VIEW, NEW_ERROR } frame_kind;
static const char *const KIND_NAMES[] = {"small move", "new view", "new error"};
/* Tets to extract. */
#define EXTRACT_TETS 1000000u

static const double DEGREE = 3.14159265358979323846 / 180;

typedef struct flight {
    bench_state *state;
    tl_store *store;
    const tl_store_head *head;
    tl_cut *cut;
    double centre[3], distance;
    double pixels;  /* by which a view may be off, so that a cut has many patches */
    double *bounds; /* [channel_count] */
} flight;

/* A camera that looks at the middle from an angle around it and above it. */
static tl_camera camera_at(const flight *f, double turn, double rise, double distance)
{
    tl_camera camera = tl_camera_defaults();
    const double direction[3] = {cos(turn) * cos(rise), sin(turn) * cos(rise), sin(rise)};
    for (int k = 0; k < 3; k++) {
        camera.position[k] = f->centre[k] + distance * direction[k];
        camera.focal_point[k] = f->centre[k];
        camera.view_up[k] = k == 2;
    }
    return camera;
}

static tl_status look(flight *f, const tl_camera *camera, double pixels)
{
    tl_cut_query query = tl_cut_query_defaults();
    query.camera = camera;
    query.pixels = pixels;
    query.bounds.channels = f->bounds;
    return tl_cut_update(f->cut, &query);
}

/* Bounds between the errors of the second level and twice them, or none. */
static void set_bounds(flight *f, frame_kind kind, int frame)
{
    const tl_store_level *level = &f->head->levels[f->head->level_count > 1];
    for (uint32_t c = 0; c < f->head->channel_count; c++)
        f->bounds[c] =
            kind == NEW_ERROR ? level->max_error[c] * (1.5 + 0.5 * sin(frame)) : INFINITY;
}

/* The error at which the first view draws about half of the finest level's patches. */
static tl_status choose_pixels(flight *f)
{
    tl_camera camera = camera_at(f, 0, 0.4, f->distance);
    tl_status st = TL_OK;
    size_t wanted = f->head->levels[0].patch_count / 2;
    double low = 1e-4, high = 1e4;
    for (int i = 0; !st && i < 30; i++) {
        f->pixels = sqrt(low * high);
        st = look(f, &camera, f->pixels);
        if (tl_cut_get_state(f->cut).patches > wanted)
            low = f->pixels;
        else
            high = f->pixels;
    }
    return st;
}

typedef struct frame_times {
    double mean_ms, most_ms, patches, changed;
} frame_times;

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static tl_status sorted_patches(tl_ctx *ctx, const tl_cut *cut, uint32_t **ids, size_t *count)
{
    tl_status st = TL_OK;
    const uint32_t *patches = tl_cut_patches(cut, count);
    *ids = tl_mem_alloc(ctx, *count, sizeof **ids, &st);
    if (st) return st;
    memcpy(*ids, patches, *count * sizeof **ids);
    qsort(*ids, *count, sizeof **ids, by_number);
    return TL_OK;
}

/* A cut that has moved must be the one that a fresh cut gives. */
static tl_status verify(flight *f, const tl_camera *camera)
{
    tl_ctx *ctx = f->state->session->ctx;
    uint32_t *moved = NULL, *fresh = NULL;
    size_t count = 0, fresh_count = 0;
    tl_cut *own = f->cut;
    tl_status st = sorted_patches(ctx, own, &moved, &count);
    if (!st) st = tl_cut_create(ctx, f->store, &f->cut);
    if (!st) st = look(f, camera, f->pixels);
    if (!st) st = sorted_patches(ctx, f->cut, &fresh, &fresh_count);
    if (!st && (count != fresh_count || memcmp(moved, fresh, count * sizeof *moved) != 0))
        f->state->broken++;
    if (f->cut != own) tl_cut_destroy(f->cut);
    f->cut = own;
    tl_mem_free(ctx, fresh);
    tl_mem_free(ctx, moved);
    return st;
}

static tl_status time_frames(flight *f, frame_kind kind, frame_times *times)
{
    tl_status st = TL_OK;
    tl_camera camera = {0};
    const bool small = kind == SMALL_MOVE;
    int count = small ? FRAMES : VIEWS;
    *times = (frame_times){0};
    for (int i = -1; !st && i < count; i++) { /* the first one warms up */
        size_t added, removed;
        camera = small ? camera_at(f, i * STEP_DEGREES * DEGREE, 0.4, f->distance)
                       : camera_at(f, i * 2.4, 1.2 * sin(i * 1.7), f->distance * (1.5 + sin(i)));
        set_bounds(f, kind, i);
        double start = cli_cpu();
        st = look(f, &camera, f->pixels);
        double ms = (cli_cpu() - start) * 1e3;
        tl_cut_added(f->cut, &added);
        tl_cut_removed(f->cut, &removed);
        if (i < 0) continue;
        times->mean_ms += ms / count;
        if (ms > times->most_ms) times->most_ms = ms;
        times->patches += (double)tl_cut_get_state(f->cut).patches / count;
        times->changed += (double)(added + removed) / count;
    }
    return st ? st : verify(f, &camera);
}

static void show_frames(const flight *f, const char *what, const frame_times *times)
{
    if (f->state->rows) {
        json_t *row = cli_json_item(f->state->rows);
        cli_json_text(row, "what", what);
        cli_json_real(row, "mean_ms", times->mean_ms);
        cli_json_real(row, "most_ms", times->most_ms);
        cli_json_real(row, "patches", times->patches);
        cli_json_real(row, "changed", times->changed);
        return;
    }
    printf(
        "%-11s %.3f ms of processor on average, %.3f ms at most; %s patches drawn, %.0f change\n",
        what, times->mean_ms, times->most_ms, cli_count((uint64_t)times->patches).s,
        times->changed);
}

/* Opening, and the coarsest mesh decoded. */
static tl_status time_opening(bench_state *state, const char *path)
{
    tl_ctx *ctx = state->session->ctx;
    tl_store *store = NULL;
    tl_cut *cut = NULL;
    tl_mesh *mesh = NULL;
    uint64_t bytes = 0;
    double least = INFINITY;
    tl_status st = TL_OK;
    for (uint64_t i = 0; !st && i <= cli_get(state->session, CLI_RUNS)->count; i++) {
        double start = cli_now();
        st = tl_store_open(ctx, path, &store);
        if (!st) st = tl_cut_create(ctx, store, &cut);
        if (!st) st = tl_cut_mesh(cut, NULL, 0, &mesh);
        double seconds = cli_now() - start;
        if (i && seconds < least) least = seconds;
        bytes = st ? 0 : tl_store_bytes_read(store);
        tl_mesh_destroy(mesh);
        tl_cut_destroy(cut);
        tl_store_close(store);
        mesh = NULL;
        cut = NULL;
        store = NULL;
    }
    if (st) return st;
    if (state->rows) {
        json_t *row = cli_json_item(state->rows);
        cli_json_text(row, "what", "open");
        cli_json_real(row, "ms", least * 1e3);
        cli_json_count(row, "bytes_read", bytes);
    } else
        printf("open        coarsest mesh decoded after %.2f ms, %s read\n", least * 1e3,
               cli_bytes((double)bytes).s);
    return TL_OK;
}

static tl_status time_extraction(flight *f)
{
    tl_ctx *ctx = f->state->session->ctx;
    tl_cut_query query = tl_cut_query_defaults();
    tl_mesh *mesh = NULL;
    uint64_t tets = 0;
    double least = INFINITY;
    tl_status st = TL_OK;
    query.tets_max = EXTRACT_TETS;
    for (uint64_t i = 0; !st && i <= cli_get(f->state->session, CLI_RUNS)->count; i++) {
        double start = cli_now();
        st = tl_cut_update(f->cut, &query);
        if (!st) st = tl_cut_mesh(f->cut, NULL, 0, &mesh);
        double seconds = cli_now() - start;
        if (i && seconds < least) least = seconds;
        if (!st) tets = tl_mesh_tet_count(mesh);
        if (!st && i == 0) st = tl_mesh_check(ctx, mesh, TL_CHECK_FAST);
        tl_mesh_destroy(mesh);
        mesh = NULL;
    }
    if (st) return st;
    if (f->state->rows) {
        json_t *row = cli_json_item(f->state->rows);
        cli_json_text(row, "what", "extract");
        cli_json_count(row, "tets", tets);
        cli_json_real(row, "seconds", least);
    } else
        printf("extract     %s tets in %s (%s tets)\n", cli_count(tets).s, cli_seconds(least).s,
               cli_rate((double)tets / least).s);
    return TL_OK;
}

static tl_status fly(flight *f)
{
    frame_times times;
    const double *b = f->head->stats.bounds;
    for (int k = 0; k < 3; k++) f->centre[k] = (b[2 * k] + b[2 * k + 1]) / 2;
    f->distance = DISTANCE_DIAGONALS * f->head->stats.diagonal;
    tl_status st = choose_pixels(f);
    for (frame_kind kind = SMALL_MOVE; !st && kind <= NEW_ERROR; kind++) {
        st = time_frames(f, kind, &times);
        if (!st) show_frames(f, KIND_NAMES[kind], &times);
    }
    return st;
}

int bench_cut(bench_state *state, const bench_data *data)
{
    tl_ctx *ctx = state->session->ctx;
    flight f = {.state = state};
    tl_status st = time_opening(state, data->path);
    if (!st) st = tl_store_open(ctx, data->path, &f.store);
    if (!st) f.head = tl_store_get_head(f.store);
    if (!st) st = tl_cut_create(ctx, f.store, &f.cut);
    f.bounds = st ? NULL : tl_mem_alloc(ctx, f.head->channel_count, sizeof *f.bounds, &st);
    if (!st) set_bounds(&f, SMALL_MOVE, 0);
    if (!st) st = fly(&f);
    if (!st) st = time_extraction(&f);
    tl_mem_free(ctx, f.bounds);
    tl_cut_destroy(f.cut);
    tl_store_close(f.store);
    return st ? cli_fail(state->session, ctx, st) : CLI_DONE;
}
