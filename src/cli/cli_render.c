/* tetralod render: pictures of a model or a file, without a screen. */
#include <math.h>
#include <string.h>

#include "cli_camera.h"
#include "cli_flow.h"
#include "cli_scene.h"

static const cli_option PICTURE[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "OUT.png", NULL, 0, 0,
     "the picture; required. Of several frames with their number, as frame_%04d.png"},
    {CLI_PICTURE_SIZE, 0, "size", CLI_TYPE_TEXT, "WxH", "1280x960", 0, 0, "pixels"},
    {CLI_SAMPLES, 0, "samples", CLI_TYPE_COUNT, "N", NULL, 1, 8,
     "N x N rays a pixel, for smooth edges; without it 2, of volumes alone 1"},
    {CLI_BACKGROUND, 0, "background", CLI_TYPE_TEXT, "COLOUR", "white", 0, 0,
     "none (the picture stays transparent) or a colour: a name, #RRGGBB or R,G,B from 0 to 1"},
    {CLI_ANNOTATION, 0, "annotation", CLI_TYPE_TEXT, "PARTS", "bar,axes,box,error", 0, 0,
     "none, or what is written around: bar, axes (with numbers), box, triad, error (of the "
     "picture). Pictures less than 200 pixels high have none unless it is asked for"},
    {CLI_TITLE, 0, "title", CLI_TYPE_TEXT, "TEXT", NULL, 0, 0, "a line above"},
    {CLI_SCENE, 0, "scene", CLI_TYPE_INPUT, "SCENE.json", NULL, 0, 0,
     "draw what a scene says, as --write-scene and the viewer write it; words come on top of it"},
    {CLI_WRITE_SCENE, 0, "write-scene", CLI_TYPE_OUTPUT, "FILE.json", NULL, 0, 0,
     "write the scene: what is drawn, how, and from where"},
    {CLI_RENDERER, 0, "renderer", CLI_TYPE_CHOICE, "auto|gl|cpu", "auto", 0, 0,
     "what draws: OpenGL where there is a GPU, or the processor, which is the reference"},
};
static const cli_option CAMERA[] = {
    {CLI_VIEW, 0, "view", CLI_TYPE_TEXT, "AZ,EL[,ZOOM]", "30,20", 0, 0,
     "look from an azimuth and an elevation, in degrees; 0,0 looks along y with z up. Or from a "
     "side: +x -x +y -y +z -z iso. All of the box is seen at zoom 1"},
    {CLI_PARALLEL, 0, "parallel", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "no perspective: equal lengths are equal wherever they are"},
    {CLI_CAMERA, 0, "camera", CLI_TYPE_INPUT, "CAMERA.json", NULL, 0, 0,
     "a camera as VTK names it: position, focal_point, view_up, view_angle or parallel_scale; its "
     "size gives way to --size. A list of cameras: key frames that --frames go through"},
    {CLI_WRITE_CAMERA, 0, "write-camera", CLI_TYPE_OUTPUT, "FILE.json", NULL, 0, 0,
     "write the camera, of several frames all of them, for --camera and for VTK"},
    {CLI_FRAMES, 0, "frames", CLI_TYPE_COUNT, "N", "1", 1, 100000, "so many pictures"},
    {CLI_ORBIT, 0, "orbit", CLI_TYPE_REAL, "DEG", "0", -36000, 36000,
     "go around by so many degrees in all frames; 360 gives a round that can be repeated"},
};
static const cli_option THINGS[] = {
    {CLI_VOLUME, 0, "volume", CLI_TYPE_INPUT, "CHANNEL[:TF.json]", NULL, 0, 0,
     "a channel as a cloud, with a transfer function as ParaView writes it, or with opacities from "
     "its histogram"},
    {CLI_VOLUME_METHOD, 0, "volume-method", CLI_TYPE_CHOICE, "auto|projected|rays", "auto", 0, 0,
     "how OpenGL draws the volume: tet by tet, or by a ray a pixel, which it does where it can"},
    {CLI_LIT, 0, "lit", CLI_TYPE_FLAG, NULL, NULL, 0, 0, "light on the volume"},
    {CLI_GRADIENT_OPACITY, 0, "gradient-opacity", CLI_TYPE_AMOUNT, "G[%]", NULL, 0, 0,
     "the volume has its opacity where its gradient is G or more (the channel's unit, or powers of "
     "ten with --log, by unit of length; or percent of the largest), and the less the smaller it "
     "is: borders without the inside"},
    {CLI_SURFACE, 0, "surface", CLI_TYPE_LIST, "CHANNEL=V[%][:COLOUR][:OPACITY]", NULL, 0, 0,
     "the isosurface at a value, or at a part of the channel's range"},
    {CLI_POINTS, 0, "points", CLI_TYPE_TEXT, "CHANNEL[=N]", NULL, 0, 0,
     "some N points on isosurfaces of all values, a cloud; without N 200,000 on ten isosurfaces, "
     "evenly over the range"},
    {CLI_LINES, 0, "lines", CLI_TYPE_TEXT, "CHANNEL[:WORDS]", NULL, 0, 0,
     "streamlines of vectors; words between commas: tubes, flat, ribbons, width=PX, halo, arrows, "
     "dash "
     "(these two move along in frames), opacity=O"},
    {CLI_SEEDS, 0, "seeds", CLI_TYPE_INPUT, "SEEDS", "grid", 0, 0,
     "where lines begin: " CLI_SEEDS_WORDS},
    {CLI_BOX, 0, "box", CLI_TYPE_TEXT, "X0,Y0,Z0,X1,Y1,Z1", NULL, 0, 0,
     "lines through this box are drawn full, the others as ghosts"},
    {CLI_SLICE, 0, "slice", CLI_TYPE_LIST, "PLANE", NULL, 0, 0,
     "the values on a plane: X,Y,Z,NX,NY,NZ (a point and a normal), or x, y=V, z=P% of the box"},
    {CLI_BOUNDARY, 0, "boundary", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the boundary of the mesh; as glass where other things lie in it"},
    {CLI_INTERFACES, 0, "interfaces", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the surfaces between regions inside"},
    {CLI_EDGES, 0, "edges", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the sharp edges of the boundary, and those between regions"},
    {CLI_SILHOUETTES, 0, "silhouettes", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the outlines of the boundary as it is seen"},
    {CLI_COLOR_PATCHES, 0, "color-patches", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "of a model: its patches in colours"},
    {CLI_COLOR_LEVELS, 0, "color-levels", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "of a model: its levels of detail in colours, bright is fine"},
};
static const cli_option COLORS[] = {
    {CLI_COLOR_BY, 0, "color-by", CLI_TYPE_INPUT, "CHANNEL[:TF.json]", NULL, 0, 0,
     "the channel that surfaces, planes and the boundary show"},
    {CLI_COLORMAP, 0, "colormap", CLI_TYPE_TEXT, "NAME", "viridis", 0, 0,
     "viridis, inferno, magma, plasma, cividis, cool-to-warm, grey, blue-to-brown or phase"},
    {CLI_RANGE, 0, "range", CLI_TYPE_TEXT, "LOW,HIGH", NULL, 0, 0,
     "values at the ends of the colour map, or parts of the volume that lie below, as 2%,98%; "
     "without it where most values are"},
    {CLI_CENTER, 0, "center", CLI_TYPE_TEXT, "V", NULL, 0, 0,
     "the value in the middle of the colour map, whose ends are as far from it, or none; without "
     "it 0 of cool-to-warm and blue-to-brown where values lie on both sides, unless --range is "
     "given"},
    {CLI_LOG, 0, "log", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "colours by the logarithm; values that are not above 0 are not seen"},
    {CLI_WRITE_TRANSFER, 0, "write-transfer", CLI_TYPE_OUTPUT, "FILE.json", NULL, 0, 0,
     "write the transfer function that was used, for CHANNEL:TF.json and for ParaView"},
};
static const cli_group PICTURE_GROUP = {"Picture", PICTURE, sizeof PICTURE / sizeof *PICTURE};
static const cli_group CAMERA_GROUP = {"Camera", CAMERA, sizeof CAMERA / sizeof *CAMERA};
static const cli_group THINGS_GROUP = {"What is drawn", THINGS, sizeof THINGS / sizeof *THINGS};
static const cli_group COLORS_GROUP = {"Colours", COLORS, sizeof COLORS / sizeof *COLORS};

typedef struct request {
    cli_scene scene;
    cli_picture picture;
    double bounds[6];   /* of what is left of the mesh */
    tl_camera *cameras; /* [frame_count] */
    tl_renderer *renderer;
    tl_shown *shown;
    tl_content *content; /* of the last frame */
    double extract_seconds, draw_seconds, write_seconds;
    bool is_silent; /* the build can't write on pictures, which was said */
} request;

/* Times that dashes and arrows move by their distance in all frames together. */
enum { ROUNDS = 6 };

/* ---- frames ---- */

/* The back end that was asked for; where there is no GL the processor, which is said. */
static tl_status open_renderer(request *r)
{
    tl_ctx *ctx = r->scene.session->ctx;
    static const tl_renderer_kind KINDS[] = {TL_RENDERER_AUTO, TL_RENDERER_GL, TL_RENDERER_CPU};
    const tl_scene *scene = r->scene.volume.scene;
    const tl_renderer_kind kind = KINDS[(int)tl_scene_real(scene, TL_NODE_PICTURE + 1, "renderer")];
    tl_status st = tl_renderer_create(ctx, kind, &r->renderer);
    if (st == TL_ERR_UNSUPPORTED && kind == TL_RENDERER_GL) {
        fprintf(stderr, "tetralod: warning: %s; the processor draws\n", tl_ctx_message(ctx));
        tl_ctx_clear(ctx);
        st = tl_renderer_create(ctx, TL_RENDERER_CPU, &r->renderer);
    }
    return st ? st : tl_shown_create(ctx, r->renderer, &r->shown);
}

/* Without pango pictures come without words. */
static tl_status annotate(request *r, const tl_camera *camera, tl_image *image)
{
    tl_ctx *ctx = r->scene.session->ctx;
    if (r->is_silent) return TL_OK;
    tl_status st = tl_content_annotate(ctx, r->content, r->scene.volume.scene, camera, image);
    if (st != TL_ERR_UNSUPPORTED) return st;
    fprintf(stderr, "tetralod: warning: %s\n", tl_ctx_message(ctx));
    tl_ctx_clear(ctx);
    r->is_silent = true;
    return TL_OK;
}

/* What the scene shows to a camera, in place of what it showed to the last one. */
static tl_status build(request *r, const tl_camera *camera)
{
    tl_content *content = NULL;
    tl_ctx *ctx = r->scene.session->ctx;
    cli_volume *volume = &r->scene.volume;
    tl_status st = tl_view_build(ctx, volume->view, volume->scene, camera, NULL, &content);
    if (!st) st = tl_content_show(ctx, r->shown, content);
    if (st) {
        tl_content_destroy(ctx, content);
        return st;
    }
    tl_content_destroy(ctx, r->content);
    r->content = content;
    r->extract_seconds += tl_content_get_facts(content)->extract_s;
    cli_volume_take(volume, content);
    return TL_OK;
}

static tl_status draw(request *r, const tl_camera *camera, size_t frame, tl_image **image)
{
    const double start = cli_now();
    tl_draw_opts opts = tl_draw_opts_defaults();
    opts.samples =
        tl_content_samples(r->content, r->scene.volume.scene, r->picture.width, r->picture.height);
    opts.time_s = (double)frame / (double)r->picture.frame_count * ROUNDS;
    tl_status st = tl_content_draw(r->scene.session->ctx, r->shown, camera, &opts, image);
    r->draw_seconds += cli_now() - start;
    return st;
}

/* In front of the scene's background, if it has one. */
static tl_status flatten(const request *r, tl_image *image)
{
    tl_value color;
    float background[3];
    tl_status st = tl_scene_get(r->scene.session->ctx, r->scene.volume.scene, TL_NODE_PICTURE + 1,
                                "background", &color);
    if (st || color.count != 3) return st;
    for (int k = 0; k < 3; k++) background[k] = (float)color.reals[k];
    tl_image_flatten(image, background);
    return TL_OK;
}

static tl_status make_frame(request *r, size_t frame)
{
    char name[CLI_PATH_BYTES];
    tl_image *image = NULL;
    const tl_camera *camera = &r->cameras[frame];
    tl_ctx *ctx = r->scene.session->ctx;
    tl_status st = build(r, camera);
    if (!st) st = draw(r, camera, frame, &image);
    const double start = cli_now();
    if (!st) st = annotate(r, camera, image);
    if (!st) st = flatten(r, image);
    cli_picture_name(r->scene.session, &r->picture, frame, name);
    if (!st) st = tl_image_write_png(ctx, image, name);
    if (!st) r->scene.session->written_count++;
    tl_image_destroy(ctx, image);
    r->write_seconds += cli_now() - start;
    if (!st) st = tl_progress(ctx, "frames", frame + 1, r->picture.frame_count);
    return st;
}

static int make_frames(request *r)
{
    cli_session *session = r->scene.session;
    tl_status st = open_renderer(r);
    for (size_t i = 0; !st && i < r->picture.frame_count; i++) st = make_frame(r, i);
    cli_progress_clear(&session->progress);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

static int set_cameras(request *r)
{
    double window[4];
    cli_session *session = r->scene.session;
    tl_ctx *ctx = session->ctx;
    const cli_volume *volume = &r->scene.volume;
    const cli_value *path = cli_get(session, CLI_WRITE_CAMERA);
    tl_status st = tl_view_bounds(ctx, volume->view, volume->scene, r->bounds);
    if (!st)
        st = tl_view_window(ctx, volume->view, volume->scene, r->picture.width, r->picture.height,
                            window);
    if (st) return cli_fail(session, ctx, st);
    int failed = cli_picture_camera(session, volume->scene, r->bounds, window, &r->picture);
    if (failed) return failed;
    r->cameras = tl_mem_alloc(ctx, r->picture.frame_count, sizeof *r->cameras, &st);
    for (size_t i = 0; !st && i < r->picture.frame_count; i++) {
        r->cameras[i] = cli_picture_frame(&r->picture, i);
        st = tl_camera_check(ctx, &r->cameras[i]);
    }
    if (!st && !r->picture.is_scenes) st = tl_scene_set_camera(ctx, volume->scene, &r->cameras[0]);
    if (!st && path->given)
        st = tl_cameras_write(ctx, path->text, r->cameras, r->picture.frame_count);
    return st ? cli_fail(session, ctx, st) : CLI_DONE;
}

/* The channel whose transfer function is written: that of the volume, else the one of colours. */
static int write_transfer(request *r)
{
    size_t count;
    const cli_session *session = r->scene.session;
    const tl_scene *scene = r->scene.volume.scene;
    const cli_value *path = cli_get(session, CLI_WRITE_TRANSFER);
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    const char *volume = "", *color = "";
    if (!path->given) return CLI_DONE;
    for (size_t i = 0; i < count; i++) {
        if (tl_scene_kind(scene, nodes[i]) == TL_NODE_VOLUME && !*volume)
            volume = tl_scene_text(scene, nodes[i], "channel");
        else if (!*color)
            color = tl_scene_text(scene, nodes[i], "color_by");
    }
    if (!*volume && !*color)
        return cli_misuse(session->args.verb, "--write-transfer: no channel is shown in colours");
    return cli_scene_write_transfer(&r->scene, *volume ? volume : color, path->text);
}

static int write_scene(request *r)
{
    cli_session *session = r->scene.session;
    const cli_value *path = cli_get(session, CLI_WRITE_SCENE);
    if (!path->given) return CLI_DONE;
    int failed = cli_scene_text(&r->scene, TL_NODE_DATA + 1, "file", r->scene.volume.input.path);
    if (failed) return failed;
    tl_status st = tl_scene_write(session->ctx, r->scene.volume.scene, path->text);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* ---- summaries ---- */

static void print_json(const request *r)
{
    size_t count;
    const cli_volume *volume = &r->scene.volume;
    const tl_values *const *values = tl_content_all_values(r->content, &count);
    json_t *object = json_object();
    cli_json_text(object, "file", cli_get(r->scene.session, CLI_OUTPUT)->text);
    cli_json_volume(object, volume);
    if (!volume->is_model) {
        cli_json_count(object, "patches", 0);
        cli_json_real(object, "error_px", 0);
    }
    json_t *list = cli_json_list(object, "channels");
    for (size_t i = 0; i < count; i++) {
        json_t *item = cli_json_item(list);
        cli_json_text(item, "channel", values[i]->channel);
        cli_json_reals(item, "range", values[i]->range, 2);
    }
    cli_json_text(object, "renderer", tl_renderer_name(r->renderer));
    cli_json_count(object, "frames", r->picture.frame_count);
    json_t *seconds = cli_json_object(object, "seconds");
    cli_json_volume_seconds(seconds, volume);
    cli_json_real(seconds, "extract", r->extract_seconds);
    cli_json_real(seconds, "draw", r->draw_seconds);
    cli_json_real(seconds, "write", r->write_seconds);
    cli_json_facts(object, r->scene.session->ctx);
    cli_json_print(object);
}

static void print_text(const request *r)
{
    size_t count;
    cli_session *session = r->scene.session;
    char name[CLI_PATH_BYTES];
    const tl_values *const *values = tl_content_all_values(r->content, &count);
    cli_print_volume(session, &r->scene.volume);
    for (size_t i = 0; i < count; i++)
        printf("shows       %s, %s\n", cli_name(values[i]->title).s, cli_range(values[i]->range).s);
    cli_print_notes(session);
    printf("drew        %zu picture%s, %u x %u pixels, by %s (%s and %s)\n", r->picture.frame_count,
           r->picture.frame_count > 1 ? "s" : "", r->picture.width, r->picture.height,
           tl_renderer_name(r->renderer), cli_seconds(r->extract_seconds).s,
           cli_seconds(r->draw_seconds).s);
    cli_picture_name(session, &r->picture, 0, name);
    printf("wrote       %s (%s, %s)\n", cli_get(session, CLI_OUTPUT)->text,
           cli_bytes((double)cli_file_bytes(name)).s, cli_seconds(r->write_seconds).s);
}

/* ---- the verb ---- */

static int render(request *r)
{
    cli_session *session = r->scene.session;
    int failed = cli_words_set(&r->scene, &r->picture);
    if (!failed) failed = cli_scene_plan(&r->scene);
    if (!failed) failed = set_cameras(r);
    if (!failed) failed = write_transfer(r);
    if (!failed) failed = write_scene(r);
    if (!failed) failed = make_frames(r);
    if (failed) return failed;
    if (cli_get(session, CLI_JSON)->given)
        print_json(r);
    else if (cli_loud(session))
        print_text(r);
    return CLI_DONE;
}

static int open_scene(cli_session *session, tl_scene **scene)
{
    const cli_value *path = cli_get(session, CLI_SCENE);
    if (!path->given) return CLI_DONE;
    tl_status st = tl_scene_read(session->ctx, path->text, scene);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* The data set that is said, or that the scene names: beside its own file where the name has no
 * folder to begin with. Borrowed from the words, or put into buffer. */
static int find_data(const cli_session *session, const tl_scene *scene, char buffer[CLI_PATH_BYTES],
                     const char **path)
{
    const char *file = cli_get(session, CLI_SCENE)->text;
    *path = session->args.operand_count ? session->args.operands[0] : buffer;
    if (session->args.operand_count) return CLI_DONE;
    if (!scene)
        return cli_misuse(session->args.verb, "IN is missing: a model, a mesh, or --scene with a "
                                              "scene that names its data set");
    const char *named = tl_scene_text(scene, TL_NODE_DATA + 1, "file");
    const char *slash = *named == '/' ? NULL : strrchr(file, '/');
    if (!*named)
        return cli_misuse(session->args.verb, "IN is missing: '%s' names no data set", file);
    snprintf(buffer, CLI_PATH_BYTES, "%.*s%s", slash ? (int)(slash + 1 - file) : 0, file, named);
    return CLI_DONE;
}

static int run(cli_session *session)
{
    tl_scene *scene = NULL;
    char buffer[CLI_PATH_BYTES];
    const char *path;
    request r = {.scene.session = session};
    int failed = cli_picture_words(session, &r.picture);
    if (!failed) failed = cli_words_check(session);
    if (!failed) failed = open_scene(session, &scene);
    r.scene.is_read = scene != NULL;
    if (!failed) {
        failed = find_data(session, scene, buffer, &path);
        if (failed) tl_scene_destroy(session->ctx, scene);
    }
    if (!failed) failed = cli_volume_begin(session, path, scene, &r.scene.volume);
    if (!failed) {
        failed = render(&r);
        tl_shown_destroy(session->ctx, r.shown);
        tl_renderer_destroy(session->ctx, r.renderer);
        tl_content_destroy(session->ctx, r.content);
        cli_volume_close(session, &r.scene.volume);
    }
    tl_mem_free(session->ctx, r.cameras);
    cli_picture_close(session, &r.picture);
    return failed;
}

static const char *const EXAMPLES[] = {
    "tetralod render flow.tlod -o flow.png",
    "A first look: the volume of a room or the boundary of a part, off by a pixel at most",
    "tetralod render flow.vtu -o flow.png --volume pressure:tf.json --view 120,35",
    "A channel with ParaView's transfer function, from another side",
    "tetralod render flow.tlod -o hybrid.png --volume pressure --surface speed=80%:orange:0.5 "
    "--derive \"speed=mag(velocity)\"",
    "A volume with a translucent surface of another channel in it",
    "tetralod render part.vtu -o part.png --boundary --color-by stress --range 1%,99% --edges",
    "A part with its stress and its edges",
    "tetralod render flow.tlod -o frame_%04d.png --frames 90 --orbit 360 --size 960x720",
    "Once around",
    "tetralod render --scene flow.json -o flow.png",
    "What was saved in the viewer, of the data set that it was saved with",
    NULL};

const cli_verb cli_verb_render = {
    .name = "render",
    .operands = "IN -o OUT.png",
    .operand_least = 0,
    .operand_most = 1,
    .about = "pictures of volumes, surfaces and lines, without a screen",
    .details =
        "IN is a model or any file that 'tetralod formats' lists; with --scene it may be left "
        "out: a scene names its data set. Without a word on what is "
        "drawn, a first look: of a room the volume of its first channel that is not "
        "constant, of a part its boundary with that channel. Of vectors the length is "
        "shown, of channels on tets the value of each, in volumes, isosurfaces of them, "
        "points and lines the mean at each vertex. Colour maps: viridis, "
        "inferno, magma, plasma, cividis (perceptual ones), cool-to-warm, blue-to-brown "
        "(diverging), grey, phase (cyclic); any other "
        "as CHANNEL:TF.json. Colours: white, black, grey, red, orange, yellow, green, teal, "
        "blue, purple, brown, bone, steel, gold, #RRGGBB or R,G,B.",
    .groups = {&PICTURE_GROUP, &CAMERA_GROUP, &THINGS_GROUP, &COLORS_GROUP, &cli_group_detail,
               &cli_group_derive, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
