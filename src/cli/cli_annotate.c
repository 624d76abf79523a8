/* What is written on a picture: the words of --annotation and --title, and what a model promises.
 */
#include <math.h>
#include <string.h>

#include "cli_scene.h"

/* Pictures that are lower have no annotation unless it is asked for. */
enum { HEIGHT_LEAST = 200 };

static const char *const PARTS[] = {"none", "bar", "axes", "box", "triad", "error"};
enum { PART_COUNT = sizeof PARTS / sizeof *PARTS };

/* Calls for each word between commas; false for a word that is no part. */
static bool names_part(const char *text, const char *part)
{
    const size_t length = strlen(part);
    for (; *text; text += strcspn(text, ","), text += *text == ',')
        if (strcspn(text, ",") == length && strncmp(text, part, length) == 0) return true;
    return false;
}

int cli_words_check(const cli_session *session)
{
    const char *text = cli_get(session, CLI_ANNOTATION)->text;
    size_t known = 0, words = 1;
    for (const char *at = text; *at; at++) words += *at == ',';
    for (size_t i = 0; i < PART_COUNT; i++) known += names_part(text, PARTS[i]);
    if (known == words) return CLI_DONE;
    return cli_misuse(session->args.verb,
                      "--annotation %s: expected none, or some of bar,axes,box,triad,error", text);
}

static bool wants(const cli_scene *scene, const cli_picture *picture, const char *part)
{
    const cli_value *value = cli_get(scene->session, CLI_ANNOTATION);
    return (value->given || picture->height >= HEIGHT_LEAST) && names_part(value->text, part);
}

static void add_bar(const cli_shade *shade, cli_words *words)
{
    for (size_t i = 0; i < words->annotation.bar_count; i++)
        if (words->bars[i].transfer == shade->transfer) return;
    words->bars[words->annotation.bar_count++] = (tl_scalar_bar){
        .title = shade->title,
        .transfer = shade->transfer,
        .shown = {cli_shade_shown(shade, shade->range[0]), cli_shade_shown(shade, shade->range[1])},
        .range = {shade->range[0], shade->range[1]},
        .logarithmic = shade->logarithmic};
}

static void describe(const cli_scene *scene, char *note, size_t bytes)
{
    const cli_volume *volume = &scene->volume;
    size_t n =
        (size_t)snprintf(note, bytes, "%s tets", cli_count(tl_mesh_tet_count(scene->mesh)).s);
    if (!volume->is_model) return;
    n += (size_t)snprintf(note + n, bytes - n, " of %s", cli_count(volume->head->input_tets).s);
    if (volume->has_view && isfinite(volume->state.pixels))
        n += (size_t)snprintf(note + n, bytes - n, ", off by at most %s pixels",
                              cli_real(volume->state.pixels).s);
    for (size_t i = 0; i < volume->channel_count && n < bytes / 2; i++)
        for (size_t s = 0; s < scene->shade_count; s++) {
            const char *name = volume->head->channels[volume->channels[i]].name;
            if (strcmp(name, scene->shades[s]->name) == 0 && isfinite(volume->errors[i])) {
                n += (size_t)snprintf(note + n, bytes - n, ", %s within %s", cli_name(name).s,
                                      cli_real(volume->errors[i]).s);
                break;
            }
        }
}

void cli_words_set(const cli_scene *scene, const cli_picture *picture, cli_words *words)
{
    tl_annotation *a = &words->annotation;
    const cli_shade *shown[] = {scene->volume_shade, scene->color_shade, scene->points_shade};
    *a = tl_annotation_defaults();
    a->title = cli_get(scene->session, CLI_TITLE)->text;
    a->background = picture->transparent ? NULL : picture->background;
    a->outline = wants(scene, picture, "box");
    a->axes = wants(scene, picture, "axes");
    a->triad = wants(scene, picture, "triad");
    if (a->outline || a->axes) a->bounds = scene->bounds;
    for (size_t i = 0; i < sizeof shown / sizeof *shown; i++)
        if (shown[i] && wants(scene, picture, "bar")) add_bar(shown[i], words);
    a->bars = words->bars;
    if (wants(scene, picture, "error")) {
        describe(scene, words->note, sizeof words->note);
        a->note = words->note;
    }
}
