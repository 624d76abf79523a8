/* Points and streamlines of a picture: the words that say how they look. */
#include <math.h>
#include <string.h>

#include "cli_flow.h"
#include "cli_scene.h"

/* Spacing of arrows and length of dashes, in percent of the diagonal. */
static const double ARROWS = 8, DASHES = 2;
enum { POINTS_WANTED = 200000 };

/* ---- lines ---- */

/* "NAME=NUMBER" or, where initial is not NaN, "NAME". */
static bool take_number(const char *word, const char *name, double initial, double *value)
{
    const size_t length = strlen(name);
    if (strncmp(word, name, length) != 0) return false;
    if (!word[length] && !isnan(initial)) {
        *value = initial;
        return true;
    }
    return word[length] == '=' && cli_parse_real(word + length + 1, value) && *value > 0 &&
           isfinite(*value);
}

/* A word of --lines; *known tells if it is one. */
static int take_word(cli_scene *scene, tl_node node, const char *word, bool *known)
{
    const double none = (double)NAN;
    double number = 0;
    *known = true;
    if (strcmp(word, "tubes") == 0) return cli_scene_text(scene, node, "shape", "tube");
    if (strcmp(word, "flat") == 0) return cli_scene_text(scene, node, "shape", "flat");
    if (strcmp(word, "ribbons") == 0) return cli_scene_text(scene, node, "shape", "ribbon");
    if (take_number(word, "width", none, &number))
        return cli_scene_real(scene, node, "width_px", number);
    if (take_number(word, "halo", 1.5, &number))
        return cli_scene_real(scene, node, "halo_px", number);
    if (take_number(word, "opacity", none, &number) && number <= 1)
        return cli_scene_real(scene, node, "opacity", number);
    const bool arrows = take_number(word, "arrows", ARROWS, &number);
    *known = arrows || take_number(word, "dash", DASHES, &number);
    if (!*known) return CLI_DONE;
    /* they move along in frames */
    int failed = cli_scene_real(scene, node, "speed", 1);
    return failed ? failed : cli_scene_real(scene, node, arrows ? "arrows" : "dash", number);
}

static int take_words(cli_scene *scene, tl_node node, const char *text, const char *words)
{
    int failed = CLI_DONE;
    for (; !failed && *words; words += strcspn(words, ","), words += *words == ',') {
        char word[64];
        bool known;
        snprintf(word, sizeof word, "%.*s", (int)strcspn(words, ","), words);
        failed = take_word(scene, node, word, &known);
        if (!failed && !known)
            return cli_misuse(scene->session->args.verb,
                              "--lines %s: '%s' is none of tubes, flat, ribbons, width=PX, halo, "
                              "arrows, dash, opacity=O",
                              text, word);
    }
    return failed;
}

static int take_box(cli_scene *scene, tl_node node)
{
    double b[6];
    const cli_value *box = cli_get(scene->session, CLI_BOX);
    if (!box->given) return CLI_DONE;
    if (!cli_parse_box(box->text, b))
        return cli_misuse(scene->session->args.verb, "--box %s: expected X0,Y0,Z0,X1,Y1,Z1",
                          box->text);
    const double corners[6] = {b[0], b[2], b[4], b[1], b[3], b[5]};
    int failed = cli_scene_flag(scene, node, "has_box", true);
    return failed ? failed : cli_scene_reals(scene, node, "box", corners, 6);
}

/* CHANNEL[:WORD,WORD ...], --seeds, --box */
int cli_swarm_lines(cli_scene *scene, const char *text)
{
    tl_node node;
    char name[CLI_NAME_BYTES];
    const char *words = "", *seeds = cli_get(scene->session, CLI_SEEDS)->text;
    snprintf(name, sizeof name, "%s", text);
    if (!cli_scene_has(scene, text)) {
        char *colon = strrchr(name, ':');
        if (colon) {
            *colon = '\0';
            words = text + (colon - name) + 1;
        }
    }
    int failed = cli_scene_add(scene, TL_NODE_LINES, &node);
    if (!failed) failed = take_words(scene, node, text, words);
    if (!failed && !tl_seeds_are_words(seeds))
        return cli_misuse(scene->session->args.verb, "--seeds %s: expected " CLI_SEEDS_WORDS,
                          seeds);
    if (!failed) failed = take_box(scene, node);
    if (!failed) failed = cli_scene_text(scene, node, "seeds", seeds);
    return failed ? failed : cli_scene_text(scene, node, "channel", name);
}

/* ---- points ---- */

/* CHANNEL[=N] */
int cli_swarm_points(cli_scene *scene, const char *word)
{
    tl_node node;
    char name[CLI_NAME_BYTES];
    const char *text;
    double number = POINTS_WANTED;
    const bool has_number =
        !cli_scene_has(scene, word) && cli_split_named(word, name, sizeof name, &text);
    if (!has_number)
        snprintf(name, sizeof name, "%s", word);
    else if (!cli_parse_real(text, &number) || !(number >= 1 && number <= 1e8))
        return cli_misuse(scene->session->args.verb, "--points %s: expected CHANNEL=NUMBER", word);
    int failed = cli_scene_channel(scene, name, NULL, NULL);
    if (!failed) failed = cli_scene_add(scene, TL_NODE_POINTS, &node);
    if (!failed) failed = cli_scene_text(scene, node, "channel", name);
    if (!failed) failed = cli_scene_real(scene, node, "count", floor(number));
    return failed || !has_number ? failed : cli_scene_real(scene, node, "shells", 0);
}
