/* Commands: a line of text is a change. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "formats/formats_number.h"
#include "scene/scene.h"

/* Words of a line, each cut off when it is asked for. */
typedef struct words {
    tl_ctx *ctx;
    tl_scene *scene;
    const char *line;
    char *word; /* [bytes] the last one */
    size_t bytes;
} words;

typedef tl_status (*command_fn)(words *w);

/* The next word; TL_ERR_ARG says what is missing. */
static tl_status next(words *w, const char *what)
{
    bool found;
    tl_status st = tl_scene_word(w->ctx, &w->line, w->word, w->bytes, &found);
    if (!st && !found) st = tl_fail(w->ctx, TL_ERR_ARG, "expected %s", what);
    return st;
}

static tl_status end(words *w)
{
    bool found;
    tl_status st = tl_scene_word(w->ctx, &w->line, w->word, w->bytes, &found);
    if (!st && found) st = tl_fail(w->ctx, TL_ERR_ARG, "'%.64s' is more than expected", w->word);
    return st;
}

static tl_status find_node(words *w, const char *name, tl_node *node)
{
    *node = tl_scene_find(w->scene, name);
    return *node ? TL_OK : tl_fail(w->ctx, TL_ERR_ARG, "there is no node '%.64s'", name);
}

static tl_status next_node(words *w, tl_node *node)
{
    tl_status st = next(w, "the name of a node");
    return st ? st : find_node(w, w->word, node);
}

/* All words that are left, with a space between. */
static tl_status join(words *w)
{
    size_t used = 0;
    bool found = true;
    tl_status st = TL_OK;
    while (!st && found) {
        const size_t gap = used ? 1 : 0;
        st = tl_scene_word(w->ctx, &w->line, w->word + used + gap, w->bytes - used - gap, &found);
        if (st || !found) continue;
        if (gap) w->word[used] = ' ';
        used += gap + strlen(w->word + used + gap);
    }
    w->word[used] = '\0';
    return st;
}

static tl_status do_set(words *w)
{
    tl_node node;
    char prop[TL_SCENE_NAME_BYTES];
    tl_status st = next(w, "NODE.PROP");
    if (st) return st;
    char *dot = strchr(w->word, '.');
    if (!dot || strlen(dot + 1) >= sizeof prop)
        return tl_fail(w->ctx, TL_ERR_ARG, "'%.64s': expected NODE.PROP", w->word);
    *dot = '\0';
    snprintf(prop, sizeof prop, "%.*s", (int)sizeof prop - 1, dot + 1);
    st = find_node(w, w->word, &node);
    const char *values = w->line;
    bool found = false;
    if (!st) st = tl_scene_word(w->ctx, &w->line, w->word, w->bytes, &found);
    if (!st && !found) st = tl_fail(w->ctx, TL_ERR_ARG, "expected a value of '%.64s'", prop);
    w->line = values;
    if (!st) st = join(w);
    return st ? st : tl_scene_set_text(w->ctx, w->scene, node, prop, w->word);
}

/* PROP=VALUE */
static tl_status set_word(words *w, tl_node node)
{
    char *equals = strchr(w->word, '=');
    if (!equals) return tl_fail(w->ctx, TL_ERR_ARG, "'%.64s': expected PROP=VALUE", w->word);
    *equals = '\0';
    return tl_scene_set_text(w->ctx, w->scene, node, w->word, equals + 1);
}

static tl_status do_add(words *w)
{
    tl_node node = 0;
    bool found = true;
    tl_status st = next(w, "a kind of nodes");
    if (st) return st;
    const tl_node_kind kind = tl_node_kind_named(w->word);
    if (kind == TL_NODE_KIND_COUNT)
        return tl_fail(w->ctx, TL_ERR_ARG, "there is no kind of nodes '%.64s'", w->word);
    st = tl_scene_begin(w->ctx, w->scene, "add");
    if (st) return st;
    st = tl_scene_add(w->ctx, w->scene, kind, &node);
    if (!st && w->scene->depth == 1)
        snprintf(w->scene->group, sizeof w->scene->group, "add %s", tl_scene_name(w->scene, node));
    while (!st && found) {
        st = tl_scene_word(w->ctx, &w->line, w->word, w->bytes, &found);
        if (!st && found) st = set_word(w, node);
    }
    const tl_status ended = tl_scene_end(w->ctx, w->scene, !st);
    return st ? st : ended;
}

static tl_status do_remove(words *w)
{
    tl_node node;
    tl_status st = next_node(w, &node);
    if (!st) st = end(w);
    return st ? st : tl_scene_remove(w->ctx, w->scene, node);
}

static tl_status do_rename(words *w)
{
    tl_node node;
    char name[TL_SCENE_NAME_BYTES + 1];
    tl_status st = next_node(w, &node);
    if (!st) st = next(w, "a name");
    if (st) return st;
    snprintf(name, sizeof name, "%.*s", TL_SCENE_NAME_BYTES, w->word);
    st = end(w);
    return st ? st : tl_scene_rename(w->ctx, w->scene, node, name);
}

static tl_status do_move(words *w)
{
    tl_node node;
    int64_t place;
    tl_status st = next_node(w, &node);
    if (!st) st = next(w, "a place");
    if (st) return st;
    const char *stop = w->word + strlen(w->word);
    if (tli_number_i64(w->word, stop, &place) != stop || place < 0)
        return tl_fail(w->ctx, TL_ERR_ARG, "'%.64s': expected a place, 0 the first", w->word);
    st = end(w);
    return st ? st : tl_scene_move(w->ctx, w->scene, node, (size_t)place);
}

static tl_status do_view(words *w)
{
    double view[3];
    tl_camera camera;
    const tl_scene *s = w->scene;
    tl_status st = next(w, "AZ,EL or AZ,EL,ZOOM");
    if (st) return st;
    if (!tl_view_read(w->word, view))
        return tl_fail(w->ctx, TL_ERR_ARG,
                       "'%.64s': expected AZ,EL or AZ,EL,ZOOM, or +x -x +y -y +z -z iso", w->word);
    st = end(w);
    if (st) return st;
    tl_scene_camera(s, s->size_px[0], s->size_px[1], &camera);
    tl_camera_stand(&camera, view, s->bounds, s->window);
    return tl_scene_set_camera(w->ctx, w->scene, &camera);
}

static tl_status do_fit(words *w)
{
    tl_camera camera;
    const tl_scene *s = w->scene;
    tl_status st = end(w);
    if (st) return st;
    tl_scene_camera(s, s->size_px[0], s->size_px[1], &camera);
    tl_camera_fit_box(&camera, s->bounds, s->window, 1);
    return tl_scene_set_camera(w->ctx, w->scene, &camera);
}

static tl_status do_undo(words *w)
{
    tl_status st = end(w);
    return st ? st : tl_scene_undo(w->ctx, w->scene);
}

static tl_status do_redo(words *w)
{
    tl_status st = end(w);
    return st ? st : tl_scene_redo(w->ctx, w->scene);
}

static tl_status do_seal(words *w)
{
    tl_status st = end(w);
    if (!st) tl_scene_seal(w->scene);
    return st;
}

static const struct {
    const char *name, *use, *help;
    command_fn run;
} COMMANDS[] = {
    {"set", "set NODE.PROP VALUE", "sets a property; the value goes to the end of the line",
     do_set},
    {"add", "add KIND [PROP=VALUE]...", "adds a node behind the others", do_add},
    {"remove", "remove NODE", "removes a node", do_remove},
    {"rename", "rename NODE NAME", "gives a node another name", do_rename},
    {"move", "move NODE PLACE", "draws a node in another turn, 0 the first", do_move},
    {"view", "view AZ,EL[,ZOOM]",
     "looks from there, or from +x -x +y -y +z -z iso, at all of the data", do_view},
    {"fit", "fit", "looks at all of the data, the way the camera looks", do_fit},
    {"undo", "undo", "takes the last step back", do_undo},
    {"redo", "redo", "takes the step that was undone again", do_redo},
    {"seal", "seal", "what is set next is a step of its own", do_seal},
};
enum { COMMAND_COUNT = sizeof COMMANDS / sizeof *COMMANDS };

const char *tl_scene_command(size_t index, const char **help)
{
    if (index >= COMMAND_COUNT) return NULL;
    if (help) *help = COMMANDS[index].help;
    return COMMANDS[index].use;
}

tl_status tl_scene_do(tl_ctx *ctx, tl_scene *scene, const char *line)
{
    bool found;
    size_t i = 0;
    tl_status st = TL_OK;
    words w = {.ctx = ctx, .scene = scene, .line = line, .bytes = strlen(line) + 2};
    w.word = tl_mem_alloc(ctx, w.bytes, 1, &st);
    if (st) return st;
    st = tl_scene_word(ctx, &w.line, w.word, w.bytes, &found);
    while (!st && found && i < COMMAND_COUNT && strcmp(COMMANDS[i].name, w.word) != 0) i++;
    if (!st && found)
        st = i < COMMAND_COUNT ? COMMANDS[i].run(&w)
                               : tl_fail(ctx, TL_ERR_ARG, "there is no command '%.64s'", w.word);
    tl_mem_free(ctx, w.word);
    return st ? tl_note(ctx, st, "in the command '%.200s'", line) : st;
}
