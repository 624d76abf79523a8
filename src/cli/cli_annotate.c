/* What is around the data on a picture: words to properties of the scene's picture. */
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

/* The flags of the picture node that stand for the words of PARTS behind "none". */
static int set_parts(cli_scene *scene, const cli_picture *picture)
{
    static const char *const PROPS[PART_COUNT] = {NULL, "bar", "axes", "box", "triad", "note"};
    const cli_value *value = cli_get(scene->session, CLI_ANNOTATION);
    int failed = CLI_DONE;
    const bool has_room = picture->height >= HEIGHT_LEAST;
    if (!value->given && scene->is_read) return CLI_DONE;
    for (size_t i = 1; !failed && i < PART_COUNT; i++)
        failed = cli_scene_flag(scene, TL_NODE_PICTURE + 1, PROPS[i],
                                (value->given || has_room) && names_part(value->text, PARTS[i]));
    return failed;
}

static int set_background(cli_scene *scene)
{
    double rgb[3] = {1, 1, 1};
    const cli_value *value = cli_get(scene->session, CLI_BACKGROUND);
    const bool is_none = strcmp(value->text, "none") == 0;
    if (!value->given && scene->is_read) return CLI_DONE;
    if (!is_none && !tl_color_read(value->text, rgb))
        return cli_misuse(scene->session->args.verb,
                          "--background %s: expected none or a colour: a name, #RRGGBB or R,G,B",
                          value->text);
    return cli_scene_reals(scene, TL_NODE_PICTURE + 1, "background", rgb, is_none ? 0 : 3);
}

int cli_words_set(cli_scene *scene, const cli_picture *picture)
{
    const cli_session *session = scene->session;
    const cli_value *title = cli_get(session, CLI_TITLE), *samples = cli_get(session, CLI_SAMPLES),
                    *renderer = cli_get(session, CLI_RENDERER);
    static const char *const RENDERERS[] = {"auto", "gl", "cpu"};
    int failed = set_background(scene);
    if (!failed) failed = set_parts(scene, picture);
    if (!failed && title->given)
        failed = cli_scene_text(scene, TL_NODE_PICTURE + 1, "title", title->text);
    if (!failed && samples->given)
        failed = cli_scene_real(scene, TL_NODE_PICTURE + 1, "samples", (double)samples->count);
    if (!failed && renderer->given)
        failed =
            cli_scene_text(scene, TL_NODE_PICTURE + 1, "renderer", RENDERERS[renderer->choice]);
    return failed;
}
