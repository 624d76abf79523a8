/* Scenes and their nodes: made, copied, changed. */
#include <stdio.h>
#include <string.h>

#include "scene/scene.h"
#include "store/store_format.h"

/* ---- nodes ---- */

static void node_release(tl_ctx *ctx, tli_node *node)
{
    if (node && !--node->refs) tl_mem_free(ctx, node);
}

/* What it says, as a number. */
static uint64_t node_hash(const tli_node *node, const uint8_t *pool, size_t pool_bytes)
{
    uint64_t lengths[TLI_PROPS_MAX] = {0};
    uint64_t hash = tli_store_hash(node->kind, (const uint8_t *)node->name, strlen(node->name));
    for (size_t i = 0; i < node->prop_count; i++)
        lengths[i] = node->values[i].text ? strlen(node->values[i].text) : node->values[i].count;
    hash = tli_store_hash(hash, (const uint8_t *)lengths, sizeof lengths);
    return tli_store_hash(hash, pool, pool_bytes);
}

/* Copies name and values, which are checked. Gives *made. */
static tl_status node_make(tl_ctx *ctx, tl_node_kind kind, tl_node number, const char *name,
                           const tl_value *values, tli_node **made)
{
    tl_status st = TL_OK;
    size_t prop_count, reals = 0, bytes = 0;
    const tl_prop_info *infos = tl_node_props(kind, &prop_count);
    for (size_t i = 0; i < prop_count; i++) {
        const bool is_own = values[i].text && infos[i].type != TL_PROP_CHOICE;
        reals += values[i].count;
        bytes += is_own ? strlen(values[i].text) + 1 : 0;
    }
    const size_t head = sizeof(tli_node) + prop_count * sizeof(tl_value);
    tli_node *node = tl_mem_alloc(ctx, head + reals * sizeof(double) + bytes, 1, &st);
    *made = NULL;
    if (st) return st;
    *node = (tli_node){.refs = 1, .number = number, .kind = kind, .prop_count = prop_count};
    snprintf(node->name, sizeof node->name, "%s", name);
    double *real = (double *)(node->values + prop_count);
    char *text = (char *)(real + reals);
    const uint8_t *pool = (const uint8_t *)real;
    for (size_t i = 0; i < prop_count; i++) {
        tl_value *value = &node->values[i];
        *value = values[i];
        value->reals =
            value->count ? memcpy(real, value->reals, value->count * sizeof *real) : NULL;
        real += value->count;
        if (!value->text || infos[i].type == TL_PROP_CHOICE) continue;
        value->text = memcpy(text, value->text, strlen(value->text) + 1);
        text += strlen(text) + 1;
    }
    node->version = node_hash(node, pool, (size_t)((const uint8_t *)text - pool));
    *made = node;
    return TL_OK;
}

tl_status tli_node_presets(tli_arena *arena, tl_node_kind kind, tl_value values[TLI_PROPS_MAX])
{
    static const double BOUNDS[6] = {0, 1, 0, 1, 0, 1};
    size_t count;
    tl_status st = TL_OK;
    const tl_prop_info *infos = tl_node_props(kind, &count);
    for (size_t i = 0; !st && i < count; i++) {
        st = tli_value_parse(arena, BOUNDS, &infos[i], infos[i].name, infos[i].preset, &values[i]);
        if (!st) st = tli_value_check(arena->ctx, TL_ERR_ARG, &infos[i], infos[i].name, &values[i]);
    }
    return st;
}

size_t tli_prop_index(tl_node_kind kind, const char *prop)
{
    size_t count;
    const tl_prop_info *infos = tl_node_props(kind, &count), *info = tl_node_prop(kind, prop);
    return info ? (size_t)(info - infos) : SIZE_MAX;
}

/* ---- states ---- */

void tli_state_release(tl_ctx *ctx, tli_state *state)
{
    if (!state || --state->refs) return;
    for (size_t i = 0; i < state->node_count; i++) node_release(ctx, state->nodes[i]);
    tl_mem_free(ctx, state);
}

/* With count nodes that are still to come. Gives *made. */
static tl_status state_make(tl_ctx *ctx, size_t count, tli_state **made)
{
    tl_status st = TL_OK;
    *made = tl_mem_zalloc(ctx, sizeof(tli_state) + count * sizeof(tli_node *), 1, &st);
    if (!st) (*made)->refs = 1;
    return st;
}

/* Puts a node behind the others; takes it over. */
static void state_push(tli_state *state, tli_node *node)
{
    const uint64_t version = node->version;
    state->nodes[state->node_count++] = node;
    state->version = tli_store_hash(state->version, (const uint8_t *)&version, sizeof version);
}

/* The state that is now without the node at a place (behind the last: with all), but with node,
 * unless it is NULL, at a place of the new list. Takes node over, whatever comes. */
static tl_status change(tl_ctx *ctx, tl_scene *scene, size_t place, tli_node *node, size_t to,
                        const char *step, bool merges)
{
    const tli_state *now = scene->now;
    tli_state *next;
    tl_status st = state_make(ctx, now->node_count + 1, &next);
    if (st) {
        node_release(ctx, node);
        return st;
    }
    for (size_t i = 0; i <= now->node_count; i++) {
        if (node && next->node_count == to) state_push(next, node);
        if (i == place || i == now->node_count) continue;
        now->nodes[i]->refs++;
        state_push(next, now->nodes[i]);
    }
    snprintf(next->step, sizeof next->step, "%s", step);
    next->merges = merges;
    tli_scene_commit(ctx, scene, next);
    return TL_OK;
}

/* ---- looking ---- */

size_t tli_scene_place(const tl_scene *scene, tl_node node)
{
    for (size_t i = 0; i < scene->now->node_count; i++)
        if (scene->now->nodes[i]->number == node) return i;
    return SIZE_MAX;
}

static const tli_node *find(const tl_scene *scene, tl_node node)
{
    const size_t place = tli_scene_place(scene, node);
    return place == SIZE_MAX ? NULL : scene->now->nodes[place];
}

const tl_value *tli_scene_value(const tl_scene *scene, tl_node node, const char *prop)
{
    const tli_node *n = find(scene, node);
    const size_t index = n ? tli_prop_index(n->kind, prop) : SIZE_MAX;
    return index == SIZE_MAX ? NULL : &n->values[index];
}

const tl_node *tl_scene_nodes(const tl_scene *scene, size_t *count)
{
    *count = scene->now->node_count;
    return scene->numbers;
}

tl_node_kind tl_scene_kind(const tl_scene *scene, tl_node node)
{
    const tli_node *n = find(scene, node);
    return n ? n->kind : TL_NODE_KIND_COUNT;
}

const char *tl_scene_name(const tl_scene *scene, tl_node node)
{
    const tli_node *n = find(scene, node);
    return n ? n->name : NULL;
}

tl_node tl_scene_find(const tl_scene *scene, const char *name)
{
    for (size_t i = 0; i < scene->now->node_count; i++)
        if (strcmp(scene->now->nodes[i]->name, name) == 0) return scene->now->nodes[i]->number;
    return 0;
}

tl_node tl_scene_transfer_of(const tl_scene *scene, const char *channel)
{
    const size_t index = tli_prop_index(TL_NODE_TRANSFER, "channel");
    for (size_t i = 0; i < scene->now->node_count; i++) {
        const tli_node *node = scene->now->nodes[i];
        if (node->kind == TL_NODE_TRANSFER && strcmp(node->values[index].text, channel) == 0)
            return node->number;
    }
    return 0;
}

uint64_t tl_scene_version(const tl_scene *scene)
{
    return scene->now->version;
}

uint64_t tl_scene_node_version(const tl_scene *scene, tl_node node)
{
    const tli_node *n = find(scene, node);
    return n ? n->version : 0;
}

tl_status tl_scene_get(tl_ctx *ctx, const tl_scene *scene, tl_node node, const char *prop,
                       tl_value *value)
{
    const tli_node *n = find(scene, node);
    const tl_value *found = tli_scene_value(scene, node, prop);
    if (found) {
        *value = *found;
        return TL_OK;
    }
    if (!n) return tl_fail(ctx, TL_ERR_ARG, "the scene has no node %u", node);
    return tl_fail(ctx, TL_ERR_ARG, "%s has no property '%.64s'", n->name, prop);
}

double tl_scene_real(const tl_scene *scene, tl_node node, const char *prop)
{
    const tl_value *value = tli_scene_value(scene, node, prop);
    return value && value->count ? value->reals[0] : 0;
}

bool tl_scene_flag(const tl_scene *scene, tl_node node, const char *prop)
{
    return tl_scene_real(scene, node, prop) != 0;
}

const char *tl_scene_text(const tl_scene *scene, tl_node node, const char *prop)
{
    const tl_value *value = tli_scene_value(scene, node, prop);
    return value && value->text ? value->text : "";
}

void tl_scene_plane(const tl_scene *scene, tl_node node, const char *prop, double plane[6])
{
    const double *b = scene->bounds;
    const tl_value *value = tli_scene_value(scene, node, prop);
    const double middle[6] = {
        b[0] / 2 + b[1] / 2, b[2] / 2 + b[3] / 2, b[4] / 2 + b[5] / 2, 1, 0, 0};
    memcpy(plane, value && value->count == 6 ? value->reals : middle, sizeof middle);
}

void tl_scene_box(const tl_scene *scene, tl_node node, const char *prop, double box[6])
{
    const tl_value *value = tli_scene_value(scene, node, prop);
    for (int k = 0; k < 3; k++) {
        const double low = scene->bounds[2 * k], high = scene->bounds[2 * k + 1];
        box[k] = low * 0.75 + high * 0.25;
        box[3 + k] = low * 0.25 + high * 0.75;
    }
    if (value && value->count == 6) memcpy(box, value->reals, 6 * sizeof *box);
}

/* ---- changing ---- */

tl_status tli_transfer_check(tl_ctx *ctx, const tl_scene *scene, tl_status failure,
                             const char *where, size_t place, const char *channel)
{
    const tl_node other = *channel ? tl_scene_transfer_of(scene, channel) : 0;
    if (!other || tli_scene_place(scene, other) == place) return TL_OK;
    return tl_fail(ctx, failure, "%s: '%.200s' is coloured by %s already", where, channel,
                   tl_scene_name(scene, other));
}

tl_status tli_scene_put(tl_ctx *ctx, tl_scene *scene, tl_node node, const tl_value *values,
                        const char *step)
{
    tli_node *made;
    const size_t place = tli_scene_place(scene, node);
    const tli_node *old = scene->now->nodes[place];
    tl_status st = node_make(ctx, old->kind, node, old->name, values, &made);
    if (!st && made->version == old->version) {
        node_release(ctx, made);
        return TL_OK;
    }
    return st ? st : change(ctx, scene, place, made, place, step, true);
}

tl_status tl_scene_set(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                       const tl_value *value)
{
    tl_value old, now = *value, values[TLI_PROPS_MAX];
    char where[TLI_STEP_BYTES];
    tl_status st = tl_scene_get(ctx, scene, node, prop, &old);
    if (st) return st;
    const size_t place = tli_scene_place(scene, node);
    const tli_node *n = scene->now->nodes[place];
    const tl_prop_info *info = tl_node_prop(n->kind, prop);
    snprintf(where, sizeof where, "set %s.%s", n->name, prop);
    st = tli_value_check(ctx, TL_ERR_ARG, info, where + strlen("set "), &now);
    if (!st && n->kind == TL_NODE_TRANSFER && strcmp(prop, "channel") == 0)
        st = tli_transfer_check(ctx, scene, TL_ERR_ARG, where + strlen("set "), place, now.text);
    if (st) return st;
    memcpy(values, n->values, n->prop_count * sizeof *values);
    values[tli_prop_index(n->kind, prop)] = now;
    return tli_scene_put(ctx, scene, node, values,
                         n->kind == TL_NODE_CAMERA ? "set camera" : where);
}

tl_status tl_scene_set_reals(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                             const double *reals, size_t count)
{
    return tl_scene_set(ctx, scene, node, prop, &(tl_value){.reals = reals, .count = count});
}

tl_status tl_scene_set_real(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                            double value)
{
    return tl_scene_set_reals(ctx, scene, node, prop, &value, 1);
}

tl_status tl_scene_set_flag(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                            bool value)
{
    return tl_scene_set_real(ctx, scene, node, prop, value ? 1 : 0);
}

tl_status tl_scene_set_text(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                            const char *text)
{
    tl_value value;
    tli_arena arena;
    char where[TLI_STEP_BYTES];
    tl_status st = tl_scene_get(ctx, scene, node, prop, &value);
    if (st) return st;
    snprintf(where, sizeof where, "%s.%s", tl_scene_name(scene, node), prop);
    tli_arena_open(ctx, &arena);
    st = tli_value_parse(&arena, scene->bounds, tl_node_prop(tl_scene_kind(scene, node), prop),
                         where, text, &value);
    if (!st) st = tl_scene_set(ctx, scene, node, prop, &value);
    tli_arena_close(&arena);
    return st;
}

tl_status tli_name_check(tl_ctx *ctx, const tl_scene *scene, tl_status failure, const char *where,
                         const char *name)
{
    static const char LETTERS[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    static const char OTHERS[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
    const size_t length = strspn(name, OTHERS);
    if (!length || name[length] || length >= TL_SCENE_NAME_BYTES || !strspn(name, LETTERS))
        return tl_fail(ctx, failure,
                       "%s: expected a name of letters, digits, _ and -, a letter first, less than "
                       "%d bytes",
                       where, TL_SCENE_NAME_BYTES);
    if (tl_scene_find(scene, name))
        return tl_fail(ctx, failure, "%s: there is a node '%s' already", where, name);
    return TL_OK;
}

tl_status tli_scene_put_new(tl_ctx *ctx, tl_scene *scene, tl_node_kind kind, const char *name,
                            const tl_value *values, tl_node *node)
{
    tli_node *made;
    char free_name[TL_SCENE_NAME_BYTES], step[TLI_STEP_BYTES];
    for (unsigned i = 1; !name; i++) {
        snprintf(free_name, sizeof free_name, "%s%u", tl_node_kind_name(kind), i);
        if (!tl_scene_find(scene, free_name)) name = free_name;
    }
    const tl_node number = scene->next;
    const size_t count = scene->now->node_count;
    if (count == TL_SCENE_NODES_MAX || number == UINT32_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "a scene has at most %d nodes", TL_SCENE_NODES_MAX);
    snprintf(step, sizeof step, "add %s", name);
    tl_status st = node_make(ctx, kind, number, name, values, &made);
    if (!st) st = change(ctx, scene, count, made, count, step, false);
    if (st) return st;
    scene->next++;
    if (node) *node = number;
    return TL_OK;
}

/* Whether there is one of the kind, always. */
static bool is_single(tl_node_kind kind)
{
    return kind <= TL_NODE_DETAIL;
}

tl_status tl_scene_add(tl_ctx *ctx, tl_scene *scene, tl_node_kind kind, tl_node *node)
{
    tli_arena arena;
    tl_value values[TLI_PROPS_MAX];
    if (!tl_node_kind_name(kind)) return tl_fail(ctx, TL_ERR_ARG, "no kind of nodes: %u", kind);
    if (is_single(kind))
        return tl_fail(ctx, TL_ERR_ARG, "a scene has one %s", tl_node_kind_name(kind));
    tli_arena_open(ctx, &arena);
    tl_status st = tli_node_presets(&arena, kind, values);
    if (!st) st = tli_scene_put_new(ctx, scene, kind, NULL, values, node);
    tli_arena_close(&arena);
    return st;
}

/* The place of a node that is not single; says what is done to it. */
static tl_status find_place(tl_ctx *ctx, const tl_scene *scene, tl_node node, const char *what,
                            size_t *place)
{
    *place = tli_scene_place(scene, node);
    if (*place == SIZE_MAX) return tl_fail(ctx, TL_ERR_ARG, "the scene has no node %u", node);
    if (is_single(scene->now->nodes[*place]->kind))
        return tl_fail(ctx, TL_ERR_ARG, "%s can't be %s", tl_scene_name(scene, node), what);
    return TL_OK;
}

tl_status tl_scene_remove(tl_ctx *ctx, tl_scene *scene, tl_node node)
{
    size_t place;
    char step[TLI_STEP_BYTES];
    tl_status st = find_place(ctx, scene, node, "removed", &place);
    if (st) return st;
    snprintf(step, sizeof step, "remove %s", tl_scene_name(scene, node));
    return change(ctx, scene, place, NULL, 0, step, false);
}

tl_status tl_scene_rename(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *name)
{
    size_t place;
    tli_node *made;
    char step[TLI_STEP_BYTES];
    tl_status st = find_place(ctx, scene, node, "renamed", &place);
    if (st || strcmp(name, tl_scene_name(scene, node)) == 0) return st;
    st = tli_name_check(ctx, scene, TL_ERR_ARG, "rename", name);
    if (st) return st;
    const tli_node *old = scene->now->nodes[place];
    snprintf(step, sizeof step, "rename %s", old->name);
    st = node_make(ctx, old->kind, node, name, old->values, &made);
    return st ? st : change(ctx, scene, place, made, place, step, false);
}

tl_status tl_scene_move(tl_ctx *ctx, tl_scene *scene, tl_node node, size_t to)
{
    size_t place;
    char step[TLI_STEP_BYTES];
    const size_t single = TL_NODE_DETAIL + 1, last = scene->now->node_count - 1;
    tl_status st = find_place(ctx, scene, node, "moved", &place);
    if (st) return st;
    to = to < last - single ? to + single : last;
    if (to == place) return TL_OK;
    tli_node *moved = scene->now->nodes[place];
    snprintf(step, sizeof step, "move %s", moved->name);
    moved->refs++;
    return change(ctx, scene, place, moved, to, step, false);
}

/* ---- whole scenes ---- */

/* A scene without a state. */
static tl_status scene_make(tl_ctx *ctx, tl_scene **scene)
{
    tl_status st = TL_OK;
    tl_scene *s = *scene = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    for (int k = 0; k < 3; k++) s->bounds[2 * k + 1] = 1;
    for (int k = 0; k < 4; k++) s->window[k] = k % 2 ? 1 : -1;
    s->size_px[0] = s->size_px[1] = 1024;
    s->next = 1;
    return TL_OK;
}

tl_status tl_scene_create(tl_ctx *ctx, tl_scene **scene)
{
    tli_arena arena;
    tl_scene *made;
    tli_state *first;
    tl_value values[TLI_PROPS_MAX];
    *scene = NULL;
    tl_status st = scene_make(ctx, &made);
    if (st) return st;
    tli_arena_open(ctx, &arena);
    st = state_make(ctx, TL_NODE_DETAIL + 1, &first);
    for (tl_node_kind kind = TL_NODE_DATA; !st && kind <= TL_NODE_DETAIL; kind++) {
        tli_node *node;
        st = tli_node_presets(&arena, kind, values);
        if (!st) st = node_make(ctx, kind, made->next, tl_node_kind_name(kind), values, &node);
        if (st) break;
        made->next++;
        state_push(first, node);
    }
    tli_arena_close(&arena);
    if (st) {
        tli_state_release(ctx, first);
        tl_scene_destroy(ctx, made);
        return st;
    }
    tli_scene_commit(ctx, made, first);
    *scene = made;
    return TL_OK;
}

void tl_scene_destroy(tl_ctx *ctx, tl_scene *scene)
{
    if (!scene) return;
    for (size_t i = 0; i < scene->depth; i++) tli_state_release(ctx, scene->before[i]);
    for (size_t i = 0; i < scene->state_count; i++) tli_state_release(ctx, scene->states[i]);
    tli_state_release(ctx, scene->now);
    tl_mem_free(ctx, scene);
}

tl_status tl_scene_copy(tl_ctx *ctx, const tl_scene *from, tl_scene **scene)
{
    tl_scene *made;
    tli_state *first = NULL;
    *scene = NULL;
    tl_status st = scene_make(ctx, &made);
    if (st) return st;
    st = state_make(ctx, from->now->node_count, &first);
    for (size_t i = 0; !st && i < from->now->node_count; i++) {
        const tli_node *n = from->now->nodes[i];
        tli_node *node;
        st = node_make(ctx, n->kind, n->number, n->name, n->values, &node);
        if (!st) state_push(first, node);
    }
    if (st) {
        tli_state_release(ctx, first);
        tl_scene_destroy(ctx, made);
        return st;
    }
    memcpy(made->bounds, from->bounds, sizeof made->bounds);
    memcpy(made->window, from->window, sizeof made->window);
    memcpy(made->size_px, from->size_px, sizeof made->size_px);
    made->next = from->next;
    tli_scene_commit(ctx, made, first);
    *scene = made;
    return TL_OK;
}
