/* What a picture shows: the words that say it, or what a first look chooses; the mesh of a view. */
#include "cli_scene.h"
#include "cli_camera.h"
#include "cli_visible.h"

#include <math.h>
#include <string.h>

/* Parts whose volume is less than this part of their box, or of a ball with their surface, are
 * solids rather than rooms: a first look shows them from outside. */
static const double FILL_LEAST = 0.3, ROUND_LEAST = 0.35;
enum { POINTS_WANTED = 200000, SHELLS = 10 };
/* Rays a pixel and side where there are edges to be smoothed; clouds have none. */
enum { SAMPLES = 2 };

/* ---- shades ---- */

/* The shade of a channel with a transfer function, made once. */
static int get_shade(cli_scene *scene, const char *name, const char *file, bool logarithmic,
                     cli_shade **shade)
{
    for (size_t i = 0; i < scene->shade_count; i++)
        if (!file && scene->shades[i]->logarithmic == logarithmic &&
            strcmp(scene->shades[i]->name, name) == 0) {
            *shade = scene->shades[i];
            return CLI_DONE;
        }
    if (scene->shade_count == CLI_SHADES_MAX)
        return cli_misuse(scene->session->args.verb, "more than %d channels in one picture",
                          CLI_SHADES_MAX);
    int failed = cli_shade_create(scene->session, scene->mesh, name, file, logarithmic, shade);
    if (!failed) scene->shades[scene->shade_count++] = *shade;
    return failed;
}

/* CHANNEL[:FILE]; a name may have colons. */
static int get_shade_of_word(cli_scene *scene, const char *text, cli_shade **shade)
{
    char name[CLI_NAME_BYTES];
    const bool logarithmic = cli_get(scene->session, CLI_LOG)->given;
    if (!tl_mesh_channel_by_name(scene->mesh, text))
        for (const char *colon = text; (colon = strchr(colon, ':')) != NULL; colon++) {
            snprintf(name, sizeof name, "%.*s", (int)(colon - text), text);
            if (tl_mesh_channel_by_name(scene->mesh, name) || !strchr(colon + 1, ':'))
                return get_shade(scene, name, colon + 1, logarithmic, shade);
        }
    return get_shade(scene, text, NULL, logarithmic, shade);
}

/* ---- words ---- */

/* CHANNEL=VALUE[%][:COLOUR][:OPACITY] */
static int take_surface(cli_scene *scene, const char *word)
{
    const cli_verb *verb = scene->session->args.verb;
    char name[CLI_NAME_BYTES], part[64];
    const char *text;
    bool percent;
    cli_iso *iso = &scene->isos[scene->iso_count];
    *iso = (cli_iso){.opacity = 1};
    if (!cli_split_named(word, name, sizeof name, &text))
        return cli_misuse(verb, "--surface %s: expected CHANNEL=VALUE[:COLOUR][:OPACITY]", word);
    int failed = get_shade(scene, name, NULL, false, &iso->shade);
    if (failed) return failed;
    for (int i = 0; *text || !i; i++) {
        const size_t length = strcspn(text, ":");
        double number;
        snprintf(part, sizeof part, "%.*s", (int)length, text);
        percent = length && length < sizeof part && part[length - 1] == '%';
        if (percent) part[length - 1] = '\0';
        const bool is_number = cli_parse_real(part, &number) && isfinite(number);
        if (length >= sizeof part || (i == 0 && !is_number) || (i && percent))
            return cli_misuse(verb, "--surface %s: expected CHANNEL=VALUE[:COLOUR][:OPACITY]",
                              word);
        if (i == 0)
            iso->value =
                percent ? iso->shade->least * (1 - number / 100) + iso->shade->most * (number / 100)
                        : number;
        else if (is_number && number >= 0 && number <= 1)
            iso->opacity = number;
        else if (tl_color_read(part, iso->rgb))
            iso->has_color = true;
        else
            return cli_misuse(verb, "--surface %s: '%s' is no colour and no opacity", word, part);
        text += length + (text[length] == ':');
    }
    scene->iso_count++;
    return CLI_DONE;
}

/* "X,Y,Z,NX,NY,NZ", or "x", "y=3", "z=20%" */
static bool parse_plane(const cli_scene *scene, const char *text, double plane[6])
{
    if (cli_parse_reals(text, plane, 6)) return plane[3] != 0 || plane[4] != 0 || plane[5] != 0;
    const bool down = *text == '-';
    const int axis = text[down] - 'x';
    if (axis < 0 || axis > 2 || (text[down + 1] && text[down + 1] != '=')) return false;
    const double low = scene->bounds[2 * axis], high = scene->bounds[2 * axis + 1];
    double at = low / 2 + high / 2;
    if (text[down + 1]) {
        char number[64];
        snprintf(number, sizeof number, "%s", text + down + 2);
        const size_t length = strlen(number);
        const bool percent = length && number[length - 1] == '%';
        if (percent) number[length - 1] = '\0';
        if (!cli_parse_real(number, &at) || !isfinite(at)) return false;
        if (percent) at = low * (1 - at / 100) + high * (at / 100);
    }
    for (int k = 0; k < 6; k++) plane[k] = 0;
    plane[axis] = at;
    plane[3 + axis] = down ? -1 : 1;
    return true;
}

static int take_slices(cli_scene *scene)
{
    const cli_value *list = cli_get(scene->session, CLI_SLICE);
    for (size_t i = 0; i < list->item_count; i++)
        if (!parse_plane(scene, list->items[i], scene->slices[scene->slice_count++]))
            return cli_misuse(scene->session->args.verb,
                              "--slice %s: expected X,Y,Z,NX,NY,NZ, or x, y=V, z=P%%",
                              list->items[i]);
    return CLI_DONE;
}

/* CHANNEL[=N] */
static int take_points(cli_scene *scene, const char *word)
{
    char name[CLI_NAME_BYTES];
    const char *text;
    double number = POINTS_WANTED;
    const bool logarithmic = cli_get(scene->session, CLI_LOG)->given;
    const bool has_number = !tl_mesh_channel_by_name(scene->mesh, word) &&
                            cli_split_named(word, name, sizeof name, &text);
    if (!has_number)
        snprintf(name, sizeof name, "%s", word);
    else if (!cli_parse_real(text, &number) || !(number >= 1 && number <= 1e8))
        return cli_misuse(scene->session->args.verb, "--points %s: expected CHANNEL=NUMBER", word);
    scene->points_wanted = (size_t)number;
    scene->shell_count = has_number ? 0 : SHELLS;
    return get_shade(scene, name, NULL, logarithmic, &scene->points_shade);
}

/* ---- a first look ---- */

/* How much a channel promises to show: 0 nothing (one value, numbers of elements, places). */
static int interest(const tl_mesh *mesh, const tl_channel *channel)
{
    static const char *const PLAIN[] = {"id",         "ids",         "material", "region",
                                        "coordinate", "coordinates", "block",    "rank"};
    double range[2];
    size_t nonfinite;
    char name[64] = "";
    const bool on_verts = channel->on == TL_ON_VERTEX;
    const size_t count = on_verts ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh);
    tl_channel_range(channel, count, range, &nonfinite);
    for (size_t i = 0; channel->name[i] && i + 1 < sizeof name; i++)
        name[i] = (char)(channel->name[i] >= 'A' && channel->name[i] <= 'Z' ? channel->name[i] + 32
                                                                            : channel->name[i]);
    for (size_t i = 0; i < sizeof PLAIN / sizeof *PLAIN; i++) {
        const size_t tail = strlen(name) < strlen(PLAIN[i]) ? 0 : strlen(name) - strlen(PLAIN[i]);
        if (strcmp(name, PLAIN[i]) == 0 || (i < 2 && tail && strcmp(name + tail, PLAIN[i]) == 0) ||
            (i == 2 && strncmp(name, "material", 8) == 0))
            return 1;
    }
    if (!(range[0] < range[1])) return 0;
    return 2 + 2 * on_verts + (channel->components == 1);
}

static const tl_channel *most_interesting(const tl_mesh *mesh)
{
    const tl_channel *found = NULL;
    int most = -1;
    for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
        const int now = interest(mesh, tl_mesh_channel(mesh, c));
        if (now <= most) continue;
        most = now;
        found = tl_mesh_channel(mesh, c);
    }
    return found;
}

/* Whether the mesh is a part rather than a room. */
static tl_status is_solid(tl_ctx *ctx, const cli_scene *scene, bool *solid)
{
    tl_mesh_stats stats;
    double box = 1;
    const double pi = acos(-1);
    tl_status st = tl_mesh_measure(ctx, scene->mesh, &stats);
    if (st) return st;
    for (int k = 0; k < 3; k++) box *= stats.bounds[2 * k + 1] - stats.bounds[2 * k];
    const double ball = cbrt(pi) * pow(6 * fabs(stats.volume), 2.0 / 3);
    *solid = fabs(stats.volume) < FILL_LEAST * box || ball < ROUND_LEAST * stats.boundary_area;
    return TL_OK;
}

/* The channel that varies most promisingly: inside of a room as a volume, of a part on its
 * boundary; a mesh without channels as it is. */
static int first_look(cli_scene *scene)
{
    cli_shade *shade = NULL;
    const tl_channel *channel = most_interesting(scene->mesh);
    const bool logarithmic = cli_get(scene->session, CLI_LOG)->given;
    bool solid = true;
    int failed = CLI_DONE;
    if (channel) failed = get_shade(scene, channel->name, NULL, logarithmic, &shade);
    tl_status st = failed || !channel ? TL_OK : is_solid(scene->session->ctx, scene, &solid);
    if (st) return cli_fail(scene->session, scene->session->ctx, st);
    scene->boundary = scene->edges = solid;
    *(solid ? &scene->color_shade : &scene->volume_shade) = shade;
    return failed;
}

/* ---- all ---- */

static int take_words(cli_scene *scene)
{
    const cli_session *session = scene->session;
    const cli_value *volume = cli_get(session, CLI_VOLUME), *color = cli_get(session, CLI_COLOR_BY);
    const cli_value *surfaces = cli_get(session, CLI_SURFACE),
                    *points = cli_get(session, CLI_POINTS);
    const cli_value *lines = cli_get(session, CLI_LINES);
    int failed = CLI_DONE;
    scene->boundary = cli_get(session, CLI_BOUNDARY)->given;
    scene->edges = cli_get(session, CLI_EDGES)->given;
    scene->silhouettes = cli_get(session, CLI_SILHOUETTES)->given;
    scene->patches = cli_get(session, CLI_COLOR_PATCHES)->given;
    scene->levels = cli_get(session, CLI_COLOR_LEVELS)->given;
    if ((scene->patches || scene->levels) && !scene->volume.is_model)
        return cli_misuse(session->args.verb, "--color-patches, --color-levels: '%s' is no model",
                          scene->volume.input.path);
    if (volume->given) failed = get_shade_of_word(scene, volume->text, &scene->volume_shade);
    if (!failed && color->given)
        failed = get_shade_of_word(scene, color->text, &scene->color_shade);
    for (size_t i = 0; !failed && i < surfaces->item_count; i++)
        failed = take_surface(scene, surfaces->items[i]);
    if (!failed && points->given) failed = take_points(scene, points->text);
    if (!failed && lines->given) failed = cli_swarm_lines(scene, lines->text);
    if (!failed) failed = take_slices(scene);
    return failed;
}

/* Something that has edges itself. */
static bool shows_shapes(const cli_scene *scene)
{
    return scene->iso_count || scene->slice_count || scene->boundary || scene->patches ||
           scene->levels || scene->points_shade || scene->lines.name[0];
}

void cli_scene_set_samples(cli_scene *scene, uint32_t width, uint32_t height)
{
    const cli_value *samples = cli_get(scene->session, CLI_SAMPLES);
    const bool has_edges = shows_shapes(scene) || scene->edges || scene->silhouettes;
    const bool fits = width <= CLI_SIDE_MAX / SAMPLES && height <= CLI_SIDE_MAX / SAMPLES;
    scene->samples = samples->given ? (uint32_t)samples->count : has_edges && fits ? SAMPLES : 1;
}

int cli_scene_plan(cli_scene *scene)
{
    const tl_mesh *mesh;
    cli_shade *shade = NULL;
    int failed = cli_volume_look(scene->session, &scene->volume, &mesh);
    scene->mesh = scene->volume.input.mesh;
    if (failed) return failed;
    memcpy(scene->bounds, scene->volume.bounds, sizeof scene->bounds);
    if (cli_derive_chooses(scene->session)) cli_bounds(scene->mesh, scene->bounds);
    scene->diagonal = scene->volume.diagonal;
    failed = take_words(scene);
    if (failed) return failed;
    if (!scene->volume_shade && !shows_shapes(scene)) {
        const bool colors = scene->color_shade != NULL, lines = scene->edges || scene->silhouettes;
        if (!colors && !lines) return first_look(scene);
        scene->boundary = colors;
    }
    if (scene->color_shade || (!scene->slice_count && !scene->lines.name[0])) return CLI_DONE;
    /* planes show a channel, lines their speed */
    const tl_channel *channel = most_interesting(scene->mesh);
    const char *name = scene->lines.name[0] ? scene->lines.name : channel ? channel->name : NULL;
    if (name)
        failed = get_shade(scene, name, NULL, cli_get(scene->session, CLI_LOG)->given, &shade);
    scene->color_shade = shade;
    return failed;
}

/* ---- the mesh of a view ---- */

/* What is seen of a model's channels: bins [channel_count][TL_BINS]. */
typedef struct seen {
    float *opacity, *unseen;
} seen;

/* The error of values from low to high that changes what is drawn for them by no more than shown;
 * of a logarithmic scale small values count. */
static double error_of(const cli_shade *shade, double low, double high, double shown)
{
    const double below = low - cli_shade_value(shade, cli_shade_shown(shade, low) - shown);
    const double above = cli_shade_value(shade, cli_shade_shown(shade, high) + shown) - high;
    const double error = fmin(below, above);
    return error > 0 ? error : 0; /* NaN: no logarithm */
}

/* Values of a volume, by its opacities, or of colours on something else. */
static void see_shade(const cli_scene *scene, const cli_shade *shade, uint32_t c, const seen *s)
{
    const double *range = scene->volume.head->channels[c].range;
    const double width = (range[1] - range[0]) / TL_BINS;
    for (uint32_t b = 0; b < TL_BINS; b++) {
        const double low = range[0] + b * width, high = low + width;
        double opacity = 1, shown = CLI_UNSEEN * (cli_shade_shown(shade, shade->range[1]) -
                                                  cli_shade_shown(shade, shade->range[0]));
        if (shade == scene->volume_shade)
            cli_visible_points(&shade->points, cli_shade_shown(shade, low),
                               cli_shade_shown(shade, high), &opacity, &shown);
        const float error = (float)error_of(shade, low, high, shown);
        const size_t at = c * (size_t)TL_BINS + b;
        s->unseen[at] = s->opacity[at] > 0 ? fminf(s->unseen[at], error) : error;
        s->opacity[at] = fmaxf(s->opacity[at], (float)opacity);
    }
}

/* false: what is drawn depends on the channels in other ways, all of them count. */
static bool see(const cli_scene *scene, const seen *s)
{
    const cli_volume *volume = &scene->volume;
    if (scene->lines.name[0]) return false;
    for (size_t i = 0; i < scene->shade_count; i++) {
        const cli_shade *shade = scene->shades[i];
        const uint32_t c = cli_volume_channel(volume, shade->name);
        if (c == TL_NONE || !(shade->range[0] < shade->range[1])) return false;
        if (shade == scene->volume_shade || shade == scene->color_shade ||
            shade == scene->points_shade)
            see_shade(scene, shade, c, s);
    }
    for (size_t i = 0; i < scene->iso_count; i++) { /* every error shows */
        const uint32_t c = cli_volume_channel(volume, scene->isos[i].shade->name);
        const size_t at =
            c * (size_t)TL_BINS + tl_bin_of(volume->head->channels[c].range, scene->isos[i].value);
        s->opacity[at] = 1;
        s->unseen[at] = 0;
    }
    return true;
}

/* Names of the channels that are drawn; 0: all are needed, as for an expression. */
static size_t needed_names(const cli_scene *scene, const char **names)
{
    const tl_store_head *head = scene->volume.head;
    if (scene->lines.name[0]) return 0;
    for (size_t i = 0; i < scene->shade_count; i++) {
        uint32_t c = 0;
        while (c < head->channel_count &&
               strcmp(head->channels[c].name, scene->shades[i]->name) != 0)
            c++;
        if (c == head->channel_count) return 0;
        names[i] = scene->shades[i]->name;
    }
    return scene->shade_count;
}

static int take_mesh(cli_scene *scene, const tl_camera *camera)
{
    tl_status st = TL_OK;
    const char *names[CLI_SHADES_MAX];
    cli_volume_request request = cli_volume_request_defaults();
    if (!scene->volume.is_model) return CLI_DONE;
    const size_t bins = (size_t)scene->volume.head->channel_count * TL_BINS;
    seen what = {tl_mem_zalloc(scene->session->ctx, bins, sizeof(float), &st), NULL};
    what.unseen = tl_mem_zalloc(scene->session->ctx, bins, sizeof(float), &st);
    if (st) tl_mem_free(scene->session->ctx, what.opacity);
    if (st) return cli_fail(scene->session, scene->session->ctx, st);
    request.camera = camera;
    request.name_count = needed_names(scene, names);
    request.names = request.name_count ? names : NULL;
    if (see(scene, &what)) {
        request.opacity = what.opacity;
        request.unseen = what.unseen;
    }
    int failed = cli_volume_cut(scene->session, &scene->volume, &request);
    if (!failed) failed = cli_volume_mesh(scene->session, &scene->volume);
    scene->mesh = scene->volume.input.mesh;
    tl_mem_free(scene->session->ctx, what.unseen);
    tl_mem_free(scene->session->ctx, what.opacity);
    for (size_t i = 0; !failed && !st && i < scene->shade_count; i++)
        st = cli_shade_bind(scene->session->ctx, scene->shades[i], scene->mesh);
    return st ? cli_fail(scene->session, scene->session->ctx, st) : failed;
}

/* Takes everything out of the renderer. */
static void clear(cli_scene *scene)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_renderer_destroy(ctx, scene->renderer);
    scene->renderer = NULL;
    scene->silhouette_item = scene->lines.items[0] = scene->lines.items[1] = 0;
    tl_edges_destroy(ctx, scene->edge_cache);
    scene->edge_cache = NULL;
    for (size_t i = 0; i < scene->kept_count; i++) {
        tl_polydata_destroy(ctx, scene->kept[i].polydata);
        tl_volume_destroy(ctx, scene->kept[i].volume);
        tl_mem_free(ctx, scene->kept[i].block);
    }
    scene->kept_count = 0;
}

/* The back end that was asked for; where there is no GL the processor, which is said. */
static tl_status open_renderer(cli_scene *scene)
{
    tl_ctx *ctx = scene->session->ctx;
    static const tl_renderer_kind KINDS[] = {TL_RENDERER_AUTO, TL_RENDERER_GL, TL_RENDERER_CPU};
    const tl_renderer_kind kind = KINDS[cli_get(scene->session, CLI_RENDERER)->choice];
    tl_status st = tl_renderer_create(ctx, kind, &scene->renderer);
    if (st != TL_ERR_UNSUPPORTED || kind != TL_RENDERER_GL) return st;
    fprintf(stderr, "tetralod: warning: %s; the processor draws\n", tl_ctx_message(ctx));
    tl_ctx_clear(ctx);
    return tl_renderer_create(ctx, TL_RENDERER_CPU, &scene->renderer);
}

tl_status cli_scene_keep(cli_scene *scene, cli_kept kept)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = scene->session->ctx;
    cli_kept *grown =
        tl_mem_resize(ctx, scene->kept, scene->kept_count + 1, sizeof *scene->kept, &st);
    if (st) {
        tl_polydata_destroy(ctx, kept.polydata);
        tl_volume_destroy(ctx, kept.volume);
        tl_mem_free(ctx, kept.block);
        return st;
    }
    scene->kept = grown;
    scene->kept[scene->kept_count++] = kept;
    return TL_OK;
}

int cli_scene_build(cli_scene *scene, const tl_camera *camera)
{
    clear(scene);
    int failed = take_mesh(scene, camera);
    if (failed) return failed;
    const double start = cli_now();
    tl_status st = open_renderer(scene);
    if (!st) st = cli_things_add(scene);
    if (!st && scene->lines.name[0]) failed = cli_swarm_trace(scene);
    scene->extract_seconds += cli_now() - start;
    if (failed) return failed;
    return st ? cli_fail(scene->session, scene->session->ctx, st) : CLI_DONE;
}

tl_status cli_scene_draw(cli_scene *scene, const tl_camera *camera, double t, tl_image **image)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_image *fine = NULL;
    tl_camera large = *camera;
    const double start = cli_now();
    for (int k = 0; k < 2; k++) large.size_px[k] *= scene->samples;
    *image = NULL;
    tl_status st = scene->silhouettes ? cli_things_silhouettes(scene, camera) : TL_OK;
    if (!st && scene->lines.name[0]) st = cli_swarm_add_lines(scene, t);
    if (!st) st = tl_image_create(ctx, large.size_px[0], large.size_px[1], &fine);
    if (!st) st = tl_renderer_draw(ctx, scene->renderer, &large, fine);
    if (!st) st = tl_image_reduce(ctx, fine, scene->samples, image);
    tl_image_destroy(ctx, fine);
    scene->draw_seconds += cli_now() - start;
    return st;
}

void cli_scene_close(cli_scene *scene)
{
    clear(scene);
    tl_mem_free(scene->session->ctx, scene->kept);
    tl_transfer_destroy(scene->session->ctx, scene->mark_transfer);
    for (size_t i = 0; i < scene->shade_count; i++)
        cli_shade_destroy(scene->session, scene->shades[i]);
    cli_volume_close(scene->session, &scene->volume);
}
