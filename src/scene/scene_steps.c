/* Steps that can be undone: whole states, which share their nodes. */
#include <stdio.h>
#include <string.h>

#include "scene/scene.h"

/* Makes a state the current one; it is referred to once more. */
static void show(tl_ctx *ctx, tl_scene *scene, tli_state *state)
{
    state->refs++;
    tli_state_release(ctx, scene->now);
    scene->now = state;
    for (size_t i = 0; i < state->node_count; i++) scene->numbers[i] = state->nodes[i]->number;
}

/* Drops the last states, but for so many. */
static void keep_states(tl_ctx *ctx, tl_scene *scene, size_t count)
{
    while (scene->state_count > count) tli_state_release(ctx, scene->states[--scene->state_count]);
}

/* Whether two states say the same of the same nodes. */
static bool is_same(const tli_state *a, const tli_state *b)
{
    if (a->version != b->version || a->node_count != b->node_count) return false;
    for (size_t i = 0; i < a->node_count; i++)
        if (a->nodes[i]->number != b->nodes[i]->number) return false;
    return true;
}

/* The state that is now becomes a step: a new one, or what the last one has become. */
static void record(tl_ctx *ctx, tl_scene *scene)
{
    tli_state *now = scene->now, **states = scene->states;
    const tli_state *last = scene->state_count ? states[scene->at] : NULL;
    const bool merges = scene->at && !scene->sealed && last->merges && now->merges &&
                        strcmp(last->step, now->step) == 0;
    keep_states(ctx, scene, scene->at + (last && !merges));
    scene->sealed = merges && is_same(now, states[scene->at - 1]);
    if (scene->sealed) { /* a drag that came back is no step */
        scene->at--;
        show(ctx, scene, states[scene->at]);
        return;
    }
    if (scene->state_count == TL_SCENE_STEPS_MAX + 1) {
        tli_state_release(ctx, states[0]);
        memmove(states, states + 1, --scene->state_count * sizeof *states);
    }
    now->refs++;
    scene->at = scene->state_count;
    states[scene->state_count++] = now;
}

void tli_scene_commit(tl_ctx *ctx, tl_scene *scene, tli_state *state)
{
    show(ctx, scene, state);
    tli_state_release(ctx, state);
    if (!scene->depth) record(ctx, scene);
}

void tl_scene_seal(tl_scene *scene)
{
    scene->sealed = true;
}

tl_status tl_scene_begin(tl_ctx *ctx, tl_scene *scene, const char *name)
{
    if (!name || !*name || strlen(name) >= TL_SCENE_NAME_BYTES)
        return tl_fail(ctx, TL_ERR_ARG, "a group of changes needs a name of less than %d bytes",
                       TL_SCENE_NAME_BYTES);
    if (scene->depth == TLI_GROUPS_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "more than %d groups of changes in each other",
                       TLI_GROUPS_MAX);
    if (!scene->depth) snprintf(scene->group, sizeof scene->group, "%s", name);
    scene->before[scene->depth++] = scene->now;
    scene->now->refs++;
    return TL_OK;
}

tl_status tl_scene_end(tl_ctx *ctx, tl_scene *scene, bool keep)
{
    if (!scene->depth) return tl_fail(ctx, TL_ERR_ARG, "there is no group of changes to end");
    tli_state *before = scene->before[--scene->depth];
    if (!keep || is_same(before, scene->now)) {
        show(ctx, scene, before);
    } else if (!scene->depth) {
        snprintf(scene->now->step, sizeof scene->now->step, "%s", scene->group);
        scene->now->merges = true;
        record(ctx, scene);
    }
    tli_state_release(ctx, before);
    return TL_OK;
}

/* Goes to the state of another step. */
static tl_status go(tl_ctx *ctx, tl_scene *scene, bool can, size_t to, const char *what)
{
    if (scene->depth) return tl_fail(ctx, TL_ERR_ARG, "no %s inside of a group of changes", what);
    if (!can) return tl_fail(ctx, TL_ERR_ARG, "there is nothing to %s", what);
    scene->at = to;
    show(ctx, scene, scene->states[to]);
    scene->sealed = true;
    return TL_OK;
}

tl_status tl_scene_undo(tl_ctx *ctx, tl_scene *scene)
{
    return go(ctx, scene, scene->at > 0, scene->at - 1, "undo");
}

tl_status tl_scene_redo(tl_ctx *ctx, tl_scene *scene)
{
    return go(ctx, scene, scene->at + 1 < scene->state_count, scene->at + 1, "redo");
}

const char *tl_scene_undo_name(const tl_scene *scene)
{
    return scene->at ? scene->states[scene->at]->step : NULL;
}

const char *tl_scene_redo_name(const tl_scene *scene)
{
    return scene->at + 1 < scene->state_count ? scene->states[scene->at + 1]->step : NULL;
}

void tl_scene_forget(tl_ctx *ctx, tl_scene *scene)
{
    if (scene->depth) return;
    tli_state **states = scene->states, *last = states[scene->at];
    last->refs++;
    keep_states(ctx, scene, 0);
    states[0] = last;
    *last->step = '\0';
    scene->state_count = 1;
    scene->at = 0;
    scene->sealed = true;
}
