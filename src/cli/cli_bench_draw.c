/* tetralod bench draw: volume rendering on the processor. The peers are VTK's ray caster and
 * projected tetrahedra, off the screen, with the same camera, transfer function and number of
 * threads; the picture is compared with that of the ray caster. */
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "cli_bench.h"

/* Place of gl in the choices of --renderer. */
enum { BENCH_GL = 1 };
enum { SIDE_PX = 512 };

/* Parts of the range with colours and opacities, as in bench/vtk_peer.py. */
static const tl_color_point COLORS[BENCH_COLORS] = {{0, {.1, .1, .6}},
                                                    {.3, {.1, .7, .8}},
                                                    {.5, {.9, .9, .3}},
                                                    {.75, {.95, .4, .1}},
                                                    {1, {.9, .05, .05}}};
static const tl_opacity_point OPACITIES[BENCH_OPACITIES] = {
    {0, 0}, {.15, 0}, {.3, .05}, {.6, .15}, {1, .8}};
/* Unit distance of the opacities, in diagonals. */
static const double UNIT = 1.0 / 30;

typedef struct draw_row {
    unsigned threads;
    bench_times frames;
    double ready_s; /* adjacency and boundary, once a mesh */
    double range[2], diagonal;
    tl_camera camera;
    char picture[BENCH_PATH_BYTES + 16];
    double ray, projected, decibels, vtk_decibels; /* of VTK; 0: not asked */
} draw_row;

void bench_points(const double range[2], tl_color_point colors[BENCH_COLORS],
                  tl_opacity_point opacities[BENCH_OPACITIES])
{
    const double low = range[0], wide = range[1] - range[0];
    memcpy(colors, COLORS, sizeof COLORS);
    memcpy(opacities, OPACITIES, sizeof OPACITIES);
    for (int i = 0; i < BENCH_COLORS; i++) colors[i].value = low + wide * colors[i].value;
    for (int i = 0; i < BENCH_OPACITIES; i++) opacities[i].value = low + wide * opacities[i].value;
}

tl_status bench_transfer(tl_ctx *ctx, const double range[2], double diagonal,
                         tl_transfer **transfer)
{
    tl_color_point colors[BENCH_COLORS];
    tl_opacity_point opacities[BENCH_OPACITIES];
    bench_points(range, colors, opacities);
    return tl_transfer_create(ctx, colors, BENCH_COLORS, opacities, BENCH_OPACITIES,
                              UNIT * diagonal, transfer);
}

/* Frames, the camera turned a little before each; the first, which is not timed, goes to a file. */
static tl_status draw_frames(bench_state *state, tl_ctx *ctx, const tl_volume *volume,
                             const double *scalar, const double bounds[6], draw_row *row)
{
    tl_transfer *transfer = NULL;
    size_t runs = (size_t)cli_get(state->session, CLI_RUNS)->count;
    static const float black[3] = {0, 0, 0};
    tl_status st = bench_transfer(ctx, row->range, row->diagonal, &transfer);
    row->camera = tl_camera_fit(bounds, 30, 20, 1.3, SIDE_PX, SIDE_PX);
    for (size_t run = 0; run <= runs && !st; run++) {
        tl_image *image = NULL;
        tl_camera camera = tl_camera_fit(bounds, 30 + 5.0 * (double)run, 20, 1.3, SIDE_PX, SIDE_PX);
        double start = cli_now();
        st = tl_image_create(ctx, SIDE_PX, SIDE_PX, &image);
        if (!st) st = tl_draw_volume(ctx, volume, scalar, transfer, &camera, NULL, image);
        if (run > 0) row->frames.seconds[row->frames.count++] = cli_now() - start;
        if (!st && run == 0) {
            tl_image_flatten(image, black);
            st = tl_image_write_png(ctx, image, row->picture);
        }
        tl_image_destroy(ctx, image);
    }
    tl_transfer_destroy(ctx, transfer);
    return st;
}

static tl_status measure(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh, void *arg)
{
    draw_row *row = arg;
    row->threads = tl_ctx_thread_count(ctx);
    double bounds[6], start = cli_now();
    tl_volume *volume = NULL;
    const tl_channel *channel = tl_mesh_channel(mesh, 0);
    tl_channel_range(channel, tl_mesh_vert_count(mesh), row->range, NULL);
    row->diagonal = cli_diagonal(mesh);
    cli_bounds(mesh, bounds);
    snprintf(row->picture, sizeof row->picture, "%s/draw.png", state->folder);
    tl_status st = tl_volume_create(ctx, mesh, NULL, &volume);
    row->ready_s = cli_now() - start;
    if (!st) st = draw_frames(state, ctx, volume, channel->values, bounds, row);
    tl_volume_destroy(ctx, volume);
    return st;
}

static int ask_peer(bench_state *state, const bench_data *data, void *arg)
{
    draw_row *row = arg;
    char runs[24], threads[24], camera[400], range[80], unit[40];
    const tl_camera *c = &row->camera;
    snprintf(runs, sizeof runs, "%llu",
             (unsigned long long)cli_get(state->session, CLI_RUNS)->count);
    snprintf(threads, sizeof threads, "%u", row->threads);
    snprintf(range, sizeof range, "--range=%.17g,%.17g", row->range[0], row->range[1]);
    snprintf(unit, sizeof unit, "%.17g", UNIT * row->diagonal);
    snprintf(camera, sizeof camera,
             "--camera=%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g", c->position[0],
             c->position[1], c->position[2], c->focal_point[0], c->focal_point[1],
             c->focal_point[2], c->view_up[0], c->view_up[1], c->view_up[2], c->view_angle);
    const char *const args[] = {"draw",      data->path,   camera,  range,    "--unit",
                                unit,        "--threads",  threads, "--runs", runs,
                                "--against", row->picture, NULL};
    json_t *object = bench_peer(state, args);
    if (!object) return CLI_FAILED;
    row->ray = json_number_value(json_object_get(object, "ray"));
    row->projected = json_number_value(json_object_get(object, "projected"));
    row->decibels = json_number_value(json_object_get(object, "decibels"));
    row->vtk_decibels = json_number_value(json_object_get(object, "vtk_decibels"));
    json_decref(object);
    return CLI_DONE;
}

static void add_json(json_t *item, const bench_data *data, const void *arg)
{
    (void)data;
    const draw_row *row = arg;
    cli_json_count(item, "threads", row->threads);
    cli_json_real(item, "frame_seconds", bench_median(&row->frames));
    cli_json_real(item, "frame_seconds_least", bench_least(&row->frames));
    cli_json_real(item, "ready_seconds", row->ready_s);
    cli_json_real(item, "vtk_ray_seconds", row->ray > 0 ? row->ray : (double)NAN);
    cli_json_real(item, "vtk_projected_seconds", row->projected > 0 ? row->projected : (double)NAN);
    cli_json_real(item, "decibels", row->ray > 0 ? row->decibels : (double)NAN);
    cli_json_real(item, "vtk_decibels", row->ray > 0 ? row->vtk_decibels : (double)NAN);
}

static void print_text(const bench_data *data, const void *arg)
{
    (void)data;
    const draw_row *row = arg;
    double frame = bench_median(&row->frames);
    printf("%u threads   a frame of %d x %d in %s (least %s), the mesh made ready in %s\n",
           row->threads, SIDE_PX, SIDE_PX, cli_seconds(frame).s,
           cli_seconds(bench_least(&row->frames)).s, cli_seconds(row->ready_s).s);
    if (row->ray > 0)
        printf("            VTK: rays %s (here %.1f x), projected tets %s (here %.1f x); from the "
               "former "
               "%.1f dB here, %.1f dB there\n",
               cli_seconds(row->ray).s, row->ray / frame, cli_seconds(row->projected).s,
               row->projected / frame, row->decibels, row->vtk_decibels);
}

int bench_draw(bench_state *state, const bench_data *data)
{
    static const bench_steps STEPS = {measure, ask_peer, add_json, print_text};
    draw_row row;
    if (cli_get(state->session, CLI_RENDERER)->choice == BENCH_GL) return bench_gl(state, data);
    int exit_status = bench_each_threads(state, data, &STEPS, &row, sizeof row);
    unlink(row.picture);
    return exit_status;
}
