/* tetralod bench draw --renderer gl: tets and triangles per second of each way through OpenGL, and
 * how far its pictures are from those of the processor, in the same run. Volumes are compared from
 * outside and inside, in perspective and not, with a smooth and a sharp transfer function. */
#include <math.h>
#include <string.h>

#include "cli_bench.h"

enum { SIDE_PX = 512, LOOK_PX = 256 };
/* Where the isosurface of the bench lies, in parts of the range. */
static const double LEVEL = 0.4;

/* What is drawn. */
enum { PROJECTED, CENTROIDS, RAYS, SURFACE, SLICES, WAY_COUNT };
static const struct {
    const char *key, *about;
} WAYS[WAY_COUNT] = {{"volume", "projected, exact order"},
                     {"volume_by_centroids", "projected, by centroids"},
                     {"volume_by_rays", "rays"},
                     {"surface", "surface, opaque"},
                     {"slices", "slice, made on the card"}};

/* From where volumes are compared, and how. */
typedef struct gl_look {
    bool sharp, parallel, inside;
} gl_look;
static const gl_look LOOKS[] = {{false, false, false},
                                {false, true, false},
                                {true, false, false},
                                {true, true, false},
                                {false, false, true}};
enum { LOOK_COUNT = sizeof LOOKS / sizeof *LOOKS };
/* Values in parts of the range around which a sharp transfer function shows shells, how wide they
 * are, how opaque, in diagonals. */
static const double SHELLS[] = {0.25, 0.5, 0.75}, SHELL_WIDTH = 0.02, SHELL_OPACITY = 0.9,
                    SHELL_UNIT = 1.0 / 100;
/* Angle of the view from inside. */
static const double INSIDE_ANGLE = 80;

typedef struct gl_row {
    char name[200]; /* of the renderer */
    size_t tet_count, triangle_count;
    bench_times frames[WAY_COUNT];
    size_t card_bytes[WAY_COUNT]; /* in the card, the picture included */
    double decibels[WAY_COUNT];   /* the least of all looks */
    char
        no_rays[200]; /* why there are none: an older OpenGL, a mesh too large for it; else empty */
} gl_row;

/* What all ways draw. */
typedef struct gl_scene {
    const tl_mesh *mesh;
    const tl_channel *channel;
    tl_volume *volume;
    tl_transfer *transfer, *sharp;
    tl_polydata *surface;
    double bounds[6], level;
} gl_scene;

static tl_status make_shells(tl_ctx *ctx, const double range[2], double diagonal,
                             tl_transfer **transfer)
{
    enum { SHELL_COUNT = sizeof SHELLS / sizeof *SHELLS };
    tl_color_point colors[BENCH_COLORS];
    tl_opacity_point others[BENCH_OPACITIES], points[4 * SHELL_COUNT];
    const double wide = range[1] - range[0];
    bench_points(range, colors, others);
    for (int i = 0; i < SHELL_COUNT; i++)
        for (int k = 0; k < 4; k++) {
            const double at = SHELLS[i] + (k < 2 ? 0 : SHELL_WIDTH);
            points[4 * i + k] =
                (tl_opacity_point){range[0] + at * wide, k == 1 || k == 2 ? SHELL_OPACITY : 0};
        }
    return tl_transfer_create(ctx, colors, BENCH_COLORS, points, 4 * SHELL_COUNT,
                              SHELL_UNIT * diagonal, transfer);
}

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
    if (!st) st = make_shells(ctx, range, cli_diagonal(mesh), &scene->sharp);
    return st;
}

static void close_scene(tl_ctx *ctx, gl_scene *scene)
{
    tl_transfer_destroy(ctx, scene->sharp);
    tl_transfer_destroy(ctx, scene->transfer);
    tl_volume_destroy(ctx, scene->volume);
    tl_polydata_destroy(ctx, scene->surface);
}

static tl_status add_thing(tl_ctx *ctx, tl_renderer *renderer, const gl_scene *scene, int way,
                           bool sharp)
{
    tl_volume_opts opts = tl_volume_opts_defaults();
    opts.order = way == CENTROIDS ? TL_ORDER_CENTROIDS : TL_ORDER_EXACT;
    opts.method = way == RAYS ? TL_VOLUME_RAYS : TL_VOLUME_PROJECTED;
    switch (way) {
    case SURFACE: return tl_renderer_add_surface(ctx, renderer, scene->surface, NULL, NULL);
    case SLICES:
        return tl_renderer_add_slices(ctx, renderer, scene->mesh, scene->channel->values,
                                      &scene->level, 1, NULL, NULL);
    default:
        return tl_renderer_add_volume(ctx, renderer, scene->volume, scene->channel->values,
                                      sharp ? scene->sharp : scene->transfer, &opts, NULL);
    }
}

/* Gives *image. */
static tl_status draw_picture(tl_ctx *ctx, tl_renderer *renderer, const tl_camera *camera,
                              tl_image **image)
{
    tl_status st = tl_image_create(ctx, camera->size_px[0], camera->size_px[1], image);
    return st ? st : tl_renderer_draw(ctx, renderer, camera, *image);
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

static tl_camera camera_of(const gl_scene *scene, const gl_look *look)
{
    tl_camera camera = tl_camera_fit(scene->bounds, 30, 20, 1.3, LOOK_PX, LOOK_PX);
    double away = 0;
    for (int k = 0; k < 3; k++) away += pow(camera.position[k] - camera.focal_point[k], 2);
    if (look->parallel)
        camera.parallel_scale = sqrt(away) * tan(camera.view_angle * acos(-1) / 360);
    if (look->inside) { /* a little beside the middle, towards where it stood */
        for (int k = 0; k < 3; k++)
            camera.position[k] =
                camera.focal_point[k] + 0.05 * (camera.position[k] - camera.focal_point[k]);
        camera.view_angle = INSIDE_ANGLE;
    }
    return camera;
}

/* One look by both. */
static tl_status compare_look(tl_ctx *ctx, const gl_scene *scene, const gl_look *look, int way,
                              gl_row *row)
{
    static const tl_renderer_kind KINDS[2] = {TL_RENDERER_CPU, TL_RENDERER_GL};
    const tl_camera camera = camera_of(scene, look);
    tl_image *images[2] = {NULL, NULL};
    tl_status st = TL_OK;
    for (int i = 0; i < 2 && !st; i++) {
        tl_renderer *r = NULL;
        st = tl_renderer_create(ctx, KINDS[i], &r);
        if (!st) st = add_thing(ctx, r, scene, way, look->sharp);
        if (!st) st = draw_picture(ctx, r, &camera, &images[i]);
        tl_renderer_destroy(ctx, r);
    }
    if (!st) row->decibels[way] = fmin(row->decibels[way], bench_decibels(images[0], images[1]));
    tl_image_destroy(ctx, images[1]);
    tl_image_destroy(ctx, images[0]);
    return st;
}

/* Looks beside those of the processor; then frames, the camera turned with each, of which the first
 * is not timed. */
static tl_status measure_way(tl_ctx *ctx, const gl_scene *scene, size_t runs, int way, gl_row *row)
{
    tl_renderer *gl = NULL;
    tl_status st = tl_renderer_create(ctx, TL_RENDERER_GL, &gl);
    if (!st) snprintf(row->name, sizeof row->name, "%s", tl_renderer_name(gl));
    if (!st) st = add_thing(ctx, gl, scene, way, false);
    row->decibels[way] = (double)INFINITY;
    for (int i = 0; i < (way <= RAYS ? LOOK_COUNT : 1) && !st; i++)
        st = compare_look(ctx, scene, &LOOKS[i], way, row);
    for (size_t run = 0; run <= runs && !st; run++) {
        tl_image *image = NULL;
        const tl_camera camera =
            tl_camera_fit(scene->bounds, 30 + 5.0 * (double)run, 20, 1.3, SIDE_PX, SIDE_PX);
        double start = cli_now();
        st = draw_picture(ctx, gl, &camera, &image);
        if (run > 0) row->frames[way].seconds[row->frames[way].count++] = cli_now() - start;
        tl_image_destroy(ctx, image);
    }
    if (!st) row->card_bytes[way] = tl_renderer_card_bytes(gl);
    tl_renderer_destroy(ctx, gl);
    return st;
}

static tl_status measure(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh, void *arg)
{
    gl_row *row = arg;
    gl_scene scene = {0};
    tl_status st = open_scene(ctx, mesh, &scene);
    if (!st) row->tet_count = tl_mesh_tet_count(mesh);
    if (!st) row->triangle_count = scene.surface->cell_count;
    for (int way = 0; way < WAY_COUNT && !st; way++) {
        st = measure_way(ctx, &scene, (size_t)cli_get(state->session, CLI_RUNS)->count, way, row);
        if (st != TL_ERR_UNSUPPORTED || way != RAYS) continue;
        snprintf(row->no_rays, sizeof row->no_rays, "%s", tl_ctx_message(ctx));
        tl_ctx_clear(ctx);
        st = TL_OK;
    }
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
    if (row->no_rays[0]) cli_json_text(item, "no_rays", row->no_rays);
    for (int way = 0; way < WAY_COUNT; way++) {
        if (!row->frames[way].count) continue;
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
        if (!row->frames[way].count) {
            printf("            %-26s %s\n", WAYS[way].about, row->no_rays);
            continue;
        }
        printf("            %-26s a frame in %s (least %s), %.2f M %s/s, at least %.1f dB from the "
               "processor\n",
               WAYS[way].about, cli_seconds(seconds).s,
               cli_seconds(bench_least(&row->frames[way])).s, count_of(row, way) / seconds * 1e-6,
               way == SURFACE ? "triangles" : "tets", row->decibels[way]);
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
