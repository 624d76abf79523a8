/* tetralod render: a picture of a model or a file, without a screen. */
#include <math.h>
#include <string.h>

#include "cli_camera.h"
#include "cli_transfer.h"
#include "cli_volume.h"

static const cli_option PICTURE[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_TEXT, "OUT.png", NULL, 0, 0, "the picture; required"},
    {CLI_PICTURE_SIZE, 0, "size", CLI_TYPE_TEXT, "WxH", "1280x960", 0, 0, "pixels"},
    {CLI_SAMPLES, 0, "samples", CLI_TYPE_COUNT, "N", "1", 1, 8,
     "N x N rays a pixel, for smooth edges"},
    {CLI_BACKGROUND, 0, "background", CLI_TYPE_TEXT, "COLOUR", "white", 0, 0,
     "white, black, none (the picture stays transparent) or R,G,B from 0 to 1"},
    {CLI_VIEW, 0, "view", CLI_TYPE_TEXT, "AZ,EL[,ZOOM]", "30,20,1.2", 0, 0,
     "look from an azimuth and an elevation, in degrees; 0,0 looks along y with z up"},
    {CLI_CAMERA, 0, "camera", CLI_TYPE_TEXT, "CAMERA.json", NULL, 0, 0,
     "a camera as VTK names it: position, focal_point, view_up, view_angle or parallel_scale; its "
     "size gives way to --size"},
};
static const cli_option LOOK[] = {
    {CLI_VOLUME, 0, "volume", CLI_TYPE_TEXT, "CHANNEL[:TF.json]", NULL, 0, 0,
     "the channel that is seen, of a vector its length, with a transfer function as ParaView "
     "writes it; without it the first one, with opacities from its histogram"},
    {CLI_COLORMAP, 0, "colormap", CLI_TYPE_TEXT, "NAME", "viridis", 0, 0,
     "viridis, inferno, magma, plasma, cividis, cool-to-warm or grey"},
    {CLI_RANGE, 0, "range", CLI_TYPE_TEXT, "LOW,HIGH", NULL, 0, 0,
     "values at the ends of the colour map; without it where most values are"},
};
static const cli_group PICTURE_GROUP = {"Picture", PICTURE, sizeof PICTURE / sizeof *PICTURE};
static const cli_group LOOK_GROUP = {"Look", LOOK, sizeof LOOK / sizeof *LOOK};

/* Opacities hold for a layer as thick as this part of the diagonal. */
static const double UNIT_DISTANCE = 0.02;

typedef struct request {
    const tl_mesh *mesh;
    uint32_t width, height, samples;
    bool transparent;
    float background[3];
    const tl_channel *channel;
    double *lengths; /* [vert_count] of vectors, else NULL */
    const double *scalar;
    cli_points points;
    double range[2];
    tl_camera camera;
} request;

/* ---- words ---- */

static int set_size(const cli_session *session, request *r)
{
    char rest;
    const char *text = cli_get(session, CLI_PICTURE_SIZE)->text;
    r->samples = (uint32_t)cli_get(session, CLI_SAMPLES)->count;
    if (sscanf(text, "%5ux%5u%c", &r->width, &r->height, &rest) == 2 && r->width && r->height &&
        r->width * r->samples <= 32768 && r->height * r->samples <= 32768)
        return CLI_DONE;
    return cli_misuse(session->args.verb, "--size %s: expected WxH of at most 32768 rays a side",
                      text);
}

static int set_background(const cli_session *session, request *r)
{
    double rgb[3];
    const char *text = cli_get(session, CLI_BACKGROUND)->text;
    r->transparent = strcmp(text, "none") == 0;
    for (int k = 0; k < 3; k++) r->background[k] = strcmp(text, "white") == 0;
    if (r->transparent || strcmp(text, "white") == 0 || strcmp(text, "black") == 0) return CLI_DONE;
    bool known = cli_parse_reals(text, rgb, 3);
    for (int k = 0; known && k < 3; k++) {
        known = rgb[k] >= 0 && rgb[k] <= 1;
        r->background[k] = (float)rgb[k];
    }
    return known ? CLI_DONE
                 : cli_misuse(session->args.verb,
                              "--background %s: expected white, black, none or R,G,B", text);
}

static int check_words(const cli_session *session, request *r)
{
    const char *out = cli_get(session, CLI_OUTPUT)->text;
    size_t length = out ? strlen(out) : 0;
    if (!out) return cli_misuse(session->args.verb, "-o OUT.png is missing");
    if (length < 4 || strcmp(out + length - 4, ".png") != 0)
        return cli_misuse(session->args.verb, "'%s': the name must end in .png", out);
    int failed = set_size(session, r);
    if (!failed) failed = set_background(session, r);
    return failed ? failed : cli_output_folder(out);
}

static int set_camera(const cli_session *session, request *r)
{
    double bounds[6], view[3] = {0, 0, 1};
    const cli_value *camera = cli_get(session, CLI_CAMERA);
    const char *text = cli_get(session, CLI_VIEW)->text;
    cli_bounds(r->mesh, bounds);
    if (!cli_parse_reals(text, view, 3) && !cli_parse_reals(text, view, 2))
        return cli_misuse(session->args.verb, "--view %s: expected AZ,EL or AZ,EL,ZOOM", text);
    if (!(view[2] > 0)) return cli_misuse(session->args.verb, "--view %s: a zoom is above 0", text);
    r->camera = tl_camera_fit(bounds, view[0], view[1], view[2], r->width, r->height);
    int failed = camera->given ? cli_camera_read(session->ctx, camera->text, &r->camera) : CLI_DONE;
    r->camera.size_px[0] = r->width * r->samples;
    r->camera.size_px[1] = r->height * r->samples;
    return failed;
}

/* ---- what is seen ---- */

static const tl_channel *first_channel(const tl_mesh *mesh)
{
    const tl_channel *found = NULL;
    for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
        const tl_channel *channel = tl_mesh_channel(mesh, c);
        if (channel->on != TL_ON_VERTEX) continue;
        if (channel->components == 1) return channel;
        if (!found) found = channel;
    }
    return found;
}

/* CHANNEL[:FILE]; a name may have colons. */
static int set_channel(const cli_session *session, request *r, const char **file)
{
    char name[CLI_NAME_BYTES];
    const char *text = cli_get(session, CLI_VOLUME)->text;
    *file = NULL;
    if (!text) {
        r->channel = first_channel(r->mesh);
        if (r->channel) return CLI_DONE;
        fprintf(stderr, "tetralod: there is no channel on vertices to look at; "
                        "--cell-to-point makes some of those on cells\n");
        return CLI_FAILED;
    }
    r->channel = cli_vertex_channel(r->mesh, text);
    for (const char *colon = text; !r->channel && (colon = strchr(colon, ':')); colon++) {
        snprintf(name, sizeof name, "%.*s", (int)(colon - text), text);
        r->channel = cli_vertex_channel(r->mesh, name);
        if (r->channel) *file = colon + 1;
    }
    return r->channel ? CLI_DONE : cli_unknown_channel(session, r->mesh, text);
}

/* Opacities from the histogram by volume: each vertex stands for a quarter of its tets. */
static tl_status look_at_values(tl_ctx *ctx, request *r)
{
    tl_status st = TL_OK;
    size_t count = tl_mesh_vert_count(r->mesh);
    const tl_lidx *tets = tl_mesh_tets(r->mesh);
    const double *xyz = tl_mesh_xyz(r->mesh);
    double *weights = tl_mem_zalloc(ctx, count, sizeof *weights, &st);
    for (size_t t = 0; !st && t < tl_mesh_tet_count(r->mesh); t++) {
        double p[4][3];
        for (size_t i = 0; i < 4; i++) memcpy(p[i], xyz + 3 * (size_t)tets[4 * t + i], sizeof p[i]);
        double volume = fabs(tl_tet_volume((const double(*)[3])p));
        for (size_t i = 0; i < 4 && isfinite(volume); i++) weights[tets[4 * t + i]] += volume;
    }
    if (!st) cli_points_look(r->scalar, weights, count, r->range, &r->points);
    tl_mem_free(ctx, weights);
    return st;
}

static int unknown_map(const cli_session *session, const char *map)
{
    cli_misuse(session->args.verb, "--colormap %s is unknown", map);
    fputs("  colour maps:", stderr);
    for (size_t i = 0; tl_colormap_name(i); i++) fprintf(stderr, " %s", tl_colormap_name(i));
    fputs("\n", stderr);
    return CLI_WRONG_USE;
}

static int set_look(cli_session *session, request *r)
{
    const char *file, *map = cli_get(session, CLI_COLORMAP)->text;
    const cli_value *range = cli_get(session, CLI_RANGE);
    int failed = set_channel(session, r, &file);
    tl_status st = failed ? TL_OK
                          : cli_volume_scalar(session->ctx, r->channel, tl_mesh_vert_count(r->mesh),
                                              &r->lengths, &r->scalar);
    if (failed || st) return failed ? failed : cli_fail(session, session->ctx, st);
    if (file) failed = cli_points_read(session->ctx, file, &r->points);
    if (!failed && !r->points.opacity_count) st = look_at_values(session->ctx, r);
    if (st) return cli_fail(session, session->ctx, st);
    if (range->given &&
        (!cli_parse_reals(range->text, r->range, 2) || !(r->range[0] < r->range[1])))
        return cli_misuse(session->args.verb, "--range %s: expected LOW,HIGH", range->text);
    if (!failed && !file && !cli_points_map(map, r->range, &r->points))
        return unknown_map(session, map);
    return failed;
}

/* ---- the picture ---- */

typedef struct outcome {
    double draw_seconds, write_seconds;
} outcome;

static tl_status draw(cli_session *session, request *r, tl_image **image, outcome *o)
{
    tl_ctx *ctx = session->ctx;
    tl_transfer *transfer = NULL;
    tl_volume *volume = NULL;
    tl_image *fine = NULL;
    double start = cli_now();
    tl_status st = tl_transfer_create(
        ctx, r->points.colors, r->points.color_count, r->points.opacities, r->points.opacity_count,
        UNIT_DISTANCE * fmax(cli_diagonal(r->mesh), 1e-300), &transfer);
    if (!st) st = tl_volume_create(ctx, r->mesh, NULL, &volume);
    if (!st) st = tl_image_create(ctx, r->camera.size_px[0], r->camera.size_px[1], &fine);
    if (!st) st = tl_draw_volume(ctx, volume, r->scalar, transfer, &r->camera, NULL, fine);
    if (!st) st = tl_image_reduce(ctx, fine, r->samples, image);
    if (!st && !r->transparent) tl_image_flatten(*image, r->background);
    tl_image_destroy(ctx, fine);
    tl_volume_destroy(ctx, volume);
    tl_transfer_destroy(ctx, transfer);
    o->draw_seconds = cli_now() - start;
    return st;
}

static void print_json(const cli_session *session, const cli_volume *volume, const request *r,
                       const outcome *o)
{
    json_t *object = json_object();
    cli_json_text(object, "file", cli_get(session, CLI_OUTPUT)->text);
    cli_json_volume(object, volume);
    cli_json_text(object, "channel", r->channel->name);
    cli_json_reals(object, "range", r->range, 2);
    cli_json_text(object, "renderer", "cpu");
    json_t *seconds = cli_json_object(object, "seconds");
    cli_json_real(seconds, "open", volume->seconds);
    cli_json_real(seconds, "draw", o->draw_seconds);
    cli_json_real(seconds, "write", o->write_seconds);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

static void print_text(cli_session *session, const cli_volume *volume, const request *r,
                       const outcome *o)
{
    const char *path = cli_get(session, CLI_OUTPUT)->text;
    cli_print_volume(session, volume);
    printf("drew        %s, %s to %s, %u x %u pixels (%s)\n", cli_name(r->channel->name).s,
           cli_real(r->range[0]).s, cli_real(r->range[1]).s, r->width, r->height,
           cli_seconds(o->draw_seconds).s);
    printf("wrote       %s (%s, %s)\n", path, cli_bytes((double)cli_file_bytes(path)).s,
           cli_seconds(o->write_seconds).s);
}

static int render(cli_session *session, const cli_volume *volume, request *r)
{
    outcome o = {0};
    tl_image *image = NULL;
    int failed = set_camera(session, r);
    if (!failed) failed = set_look(session, r);
    if (failed) return failed;
    tl_status st = draw(session, r, &image, &o);
    double start = cli_now();
    if (!st) st = tl_image_write_png(session->ctx, image, cli_get(session, CLI_OUTPUT)->text);
    o.write_seconds = cli_now() - start;
    tl_image_destroy(session->ctx, image);
    cli_progress_clear(&session->progress);
    if (st) return cli_fail(session, session->ctx, st);
    if (cli_get(session, CLI_JSON)->given)
        print_json(session, volume, r, &o);
    else if (cli_loud(session))
        print_text(session, volume, r, &o);
    return CLI_DONE;
}

static int render_file(cli_session *session, request *r)
{
    cli_volume volume;
    int exit_status = check_words(session, r);
    if (!exit_status) exit_status = cli_volume_open(session, session->args.operands[0], &volume);
    if (exit_status) return exit_status;
    r->mesh = volume.input.mesh;
    exit_status = render(session, &volume, r);
    tl_mem_free(session->ctx, r->lengths);
    cli_volume_close(session, &volume);
    return exit_status;
}

static int run(cli_session *session)
{
    tl_status st = TL_OK;
    request *r = tl_mem_zalloc(session->ctx, 1, sizeof *r, &st); /* too large for a stack */
    int exit_status = st ? cli_fail(session, session->ctx, st) : render_file(session, r);
    tl_mem_free(session->ctx, r);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod render flow.tlod -o flow.png",
    "A first look: the first channel, opacities from its histogram",
    "tetralod render flow.vtu -o flow.png --volume pressure:tf.json --view 120,35 --samples 2",
    "Another channel with ParaView's transfer function, from another side, smooth",
    "tetralod render flow.tlod -o small.png --error 2% --size 640x480 --background black",
    "As coarse as an error of 2 % allows",
    NULL};

const cli_verb cli_verb_render = {
    .name = "render",
    .operands = "IN -o OUT.png",
    .operand_least = 1,
    .operand_most = 1,
    .about = "a picture by volume rendering, without a screen",
    .details =
        "IN is a model or any file that 'tetralod formats' lists. A ray a pixel goes through "
        "the tets and integrates the linear field in each.",
    .groups = {&PICTURE_GROUP, &LOOK_GROUP, &cli_group_detail, &cli_group_derive,
               &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
