/* tetralod bench draw --renderer gl: tets and triangles per second of each way through OpenGL, and
 * how far its pictures are from those of the processor, in the same run. */
#include <math.h>
#include <string.h>

#include "cli_bench.h"

enum { SIDE_PX = 512 };
/* Where the isosurface of the bench lies, in parts of the range. */
static const double LEVEL = 0.4;

/* What is drawn. */
enum { VOLUME, CENTROIDS, SURFACE, SLICES, WAY_COUNT };
static const struct {
    const char *key, *about;
} WAYS[WAY_COUNT] = {{"volume", "tets, exact order"},
                     {"volume_by_centroids", "tets, order of centroids"},
                     {"surface", "surface, opaque"},
                     {"slices", "slice, made on the card"}};

typedef struct gl_row {
    char name[200]; /* of the renderer */
    size_t tet_count, triangle_count;
    bench_times frames[WAY_COUNT];
    size_t card_bytes[WAY_COUNT]; /* in the card, the picture included */
    double decibels[WAY_COUNT];
} gl_row;

/* What all ways draw. */
typedef struct gl_scene {
    const tl_mesh *mesh;
    const tl_channel *channel;
    tl_volume *volume;
    tl_transfer *transfer;
    tl_polydata *surface;
    double bounds[6], level;
} gl_scene;

static tl_status open_scene(tl_ctx *ctx, const tl_mesh *mesh, gl_scene *scene)
{
    double range[2];
    tl_status st = TL_OK;
    tl_slice_opts opts = tl_slice_opts_defaults();
    scene->mesh = mesh;
    scene->channel = tl_mesh_channel(mesh, 0);
    tl_channel_range(scene->channel, tl_mesh_vert_count(mesh), range, NULL);
    scene->level = range[0] + LEVEL * (range[1] - range[0]);
    cli_bounds(mesh, scene->bounds);
    double *gradients = tl_mem_alloc(ctx, tl_mesh_vert_count(mesh), 3 * sizeof *gradients, &st);
    if (!st) st = tl_mesh_gradient(ctx, mesh, scene->channel, gradients);
    opts.values = &scene->level;
    opts.value_count = 1;
    opts.gradients = gradients;
    if (!st) st = tl_slice_mesh(ctx, mesh, scene->channel->values, &opts, &scene->surface);
    tl_mem_free(ctx, gradients);
    if (!st) st = tl_volume_create(ctx, mesh, NULL, &scene->volume);
    if (!st) st = bench_transfer(ctx, range, cli_diagonal(mesh), &scene->transfer);
    return st;
}

static void close_scene(tl_ctx *ctx, gl_scene *scene)
{
    tl_transfer_destroy(ctx, scene->transfer);
    tl_volume_destroy(ctx, scene->volume);
    tl_polydata_destroy(ctx, scene->surface);
}

static tl_status add_thing(tl_ctx *ctx, tl_renderer *renderer, const gl_scene *scene, int way)
{
    tl_volume_opts opts = tl_volume_opts_defaults();
    opts.order = way == CENTROIDS ? TL_ORDER_CENTROIDS : TL_ORDER_EXACT;
    switch (way) {
    case SURFACE: return tl_renderer_add_surface(ctx, renderer, scene->surface, NULL, NULL);
    case SLICES:
        return tl_renderer_add_slices(ctx, renderer, scene->mesh, scene->channel->values,
                                      &scene->level, 1, NULL, NULL);
    default:
        return tl_renderer_add_volume(ctx, renderer, scene->volume, scene->channel->values,
                                      scene->transfer, &opts, NULL);
    }
}

/* A frame, the camera turned with each. Gives *image. */
static tl_status draw_frame(tl_ctx *ctx, tl_renderer *renderer, const gl_scene *scene, size_t frame,
                            tl_image **image)
{
    tl_camera camera =
        tl_camera_fit(scene->bounds, 30 + 5.0 * (double)frame, 20, 1.3, SIDE_PX, SIDE_PX);
    tl_status st = tl_image_create(ctx, SIDE_PX, SIDE_PX, image);
    return st ? st : tl_renderer_draw(ctx, renderer, &camera, *image);
}

double bench_decibels(const tl_image *a, const tl_image *b)
{
    const size_t pixels = (size_t)a->width * a->height;
    double sum = 0;
    for (size_t p = 0; p < pixels; p++)
        for (size_t k = 0; k < 3; k++) {
            double d = (double)a->rgba[4 * p + k] - (double)b->rgba[4 * p + k];
            sum += d * d;
        }
    return -10 * log10(sum / (3.0 * (double)pixels));
}

/* The first frame beside that of the processor, then those that are timed. */
static tl_status measure_way(tl_ctx *ctx, const gl_scene *scene, size_t runs, int way, gl_row *row)
{
    tl_renderer *gl = NULL, *cpu = NULL;
    tl_image *drawn = NULL, *expected = NULL;
    tl_status st = tl_renderer_create(ctx, TL_RENDERER_CPU, &cpu);
    if (!st) st = tl_renderer_create(ctx, TL_RENDERER_GL, &gl);
    if (!st) st = add_thing(ctx, cpu, scene, way);
    if (!st) st = add_thing(ctx, gl, scene, way);
    if (!st) st = draw_frame(ctx, cpu, scene, 0, &expected);
    if (!st) st = draw_frame(ctx, gl, scene, 0, &drawn);
    if (!st) {
        snprintf(row->name, sizeof row->name, "%s", tl_renderer_name(gl));
        row->decibels[way] = bench_decibels(drawn, expected);
    }
    for (size_t run = 1; run <= runs && !st; run++) {
        double start = cli_now();
        tl_image_destroy(ctx, drawn);
        drawn = NULL;
        st = draw_frame(ctx, gl, scene, run, &drawn);
        row->frames[way].seconds[row->frames[way].count++] = cli_now() - start;
    }
    if (!st) row->card_bytes[way] = tl_renderer_card_bytes(gl);
    tl_image_destroy(ctx, drawn);
    tl_image_destroy(ctx, expected);
    tl_renderer_destroy(ctx, gl);
    tl_renderer_destroy(ctx, cpu);
    return st;
}

static tl_status measure(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh, void *arg)
{
    gl_row *row = arg;
    gl_scene scene = {0};
    tl_status st = open_scene(ctx, mesh, &scene);
    if (!st) row->tet_count = tl_mesh_tet_count(mesh);
    if (!st) row->triangle_count = scene.surface->cell_count;
    for (int way = 0; way < WAY_COUNT && !st; way++)
        st = measure_way(ctx, &scene, (size_t)cli_get(state->session, CLI_RUNS)->count, way, row);
    close_scene(ctx, &scene);
    return st;
}

/* What a way draws: a slice is made of all tets, what is seen of it are its triangles. */
static double count_of(const gl_row *row, int way)
{
    return (double)(way == SURFACE ? row->triangle_count : row->tet_count);
}

static void add_json(bench_state *state, const bench_data *data, const gl_row *row)
{
    json_t *item = cli_json_item(state->rows);
    cli_json_text(item, "data", data->name);
    cli_json_count(item, "tets", row->tet_count);
    cli_json_count(item, "triangles", row->triangle_count);
    cli_json_text(item, "renderer", row->name);
    json_t *ways = cli_json_object(item, "frames");
    for (int way = 0; way < WAY_COUNT; way++) {
        json_t *one = cli_json_object(ways, WAYS[way].key);
        cli_json_real(one, "seconds", bench_median(&row->frames[way]));
        cli_json_real(one, "seconds_least", bench_least(&row->frames[way]));
        cli_json_real(one, "decibels", row->decibels[way]);
        cli_json_count(one, "card_bytes", row->card_bytes[way]);
    }
}

static void print_text(const gl_row *row)
{
    printf("%s, %d x %d pixels, %zu tets, %zu triangles of a surface\n", row->name, SIDE_PX,
           SIDE_PX, row->tet_count, row->triangle_count);
    for (int way = 0; way < WAY_COUNT; way++) {
        double seconds = bench_median(&row->frames[way]);
        printf(
            "            %-26s a frame in %s (least %s), %.2f M %s/s, %.1f dB from the processor\n",
            WAYS[way].about, cli_seconds(seconds).s, cli_seconds(bench_least(&row->frames[way])).s,
            count_of(row, way) / seconds * 1e-6, way == SURFACE ? "triangles" : "tets",
            row->decibels[way]);
    }
}

int bench_gl(bench_state *state, const bench_data *data)
{
    gl_row row = {0};
    unsigned threads[2];
    size_t last = bench_threads(state, threads) - 1;
    int exit_status = bench_on_mesh(state, data, threads[last], measure, &row);
    cli_progress_clear(&state->session->progress);
    if (exit_status) return exit_status;
    if (state->rows)
        add_json(state, data, &row);
    else
        print_text(&row);
    return CLI_DONE;
}
