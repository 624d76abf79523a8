/* A scene out of JSON: every value is checked as a command's is, and named by its place. */
#include <stdio.h>
#include <string.h>

#include "scene/scene_load_jansson.h"

/* Unknown keys that are named one by one. */
enum { WARNINGS_MOST = 20, VERSION = 1 };

typedef struct reader {
    tl_ctx *ctx;
    const char *name; /* of the file */
    tl_scene *scene;
    tli_arena arena; /* values of a node */
    size_t warnings;
} reader;

static void warn(reader *r, const char *where, const char *key)
{
    if (r->warnings++ < WARNINGS_MOST)
        tl_log(r->ctx, TL_LOG_WARNING, "'%s': %s%s%.64s is unknown and left out", r->name, where,
               *where ? "." : "", key);
}

/* ---- values ---- */

/* Numbers of a list, or of its rows, to reals; false if there are others. */
static bool take_numbers(const json_t *list, double *reals, size_t *count)
{
    size_t i;
    json_t *item;
    json_array_foreach((json_t *)(uintptr_t)list, i, item)
    {
        if (!json_is_number(item)) return false;
        reals[(*count)++] = json_number_value(item);
    }
    return true;
}

/* Rows of a list, all of one length. */
static bool take_rows(const json_t *list, size_t row, double *reals, size_t *count)
{
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *item = json_array_get(list, i);
        if (!json_is_array(item) || json_array_size(item) != row) return false;
        if (!take_numbers(item, reals, count)) return false;
    }
    return true;
}

/* Values of another type stay empty, which the check then finds. */
static tl_status take_value(reader *r, const tl_prop_info *info, const char *where,
                            const json_t *json, tl_value *value)
{
    bool good = true;
    tl_status st = TL_OK;
    const bool is_list = info->type == TL_PROP_LIST;
    const size_t length = json_array_size(json), rows = is_list ? length : 1;
    const bool is_text =
        info->type == TL_PROP_TEXT || info->type == TL_PROP_CHANNEL || info->type == TL_PROP_CHOICE;
    *value = (tl_value){0};
    if (length > (size_t)TL_SCENE_ROWS_MAX)
        return tli_value_fail(r->ctx, TL_ERR_FORMAT, info, where);
    double *reals =
        tli_arena_alloc(&r->arena, is_list ? rows * info->count : length + 3, sizeof *reals, &st);
    if (st) return st;
    value->reals = reals;
    if (is_text) {
        value->text = json_string_value(json);
        value->reals = NULL;
        good = value->text != NULL;
    } else if (info->type == TL_PROP_FLAG) {
        good = json_is_boolean(json);
        reals[value->count++] = json_is_true(json) ? 1 : 0;
    } else if (json_is_number(json)) {
        good = info->count == 1;
        reals[value->count++] = json_number_value(json);
    } else if (info->type == TL_PROP_COLOR && json_is_string(json)) {
        good = tl_color_read(json_string_value(json), reals);
        value->count = 3;
    } else if (json_is_array(json)) {
        good = is_list ? take_rows(json, info->count, reals, &value->count)
                       : info->count > 1 && take_numbers(json, reals, &value->count);
    } else {
        good = json_is_null(json);
    }
    if (!good) return tli_value_fail(r->ctx, TL_ERR_FORMAT, info, where);
    return tli_value_check(r->ctx, TL_ERR_FORMAT, info, where, value);
}

/* ---- nodes ---- */

/* The values of a node: presets, and what the object says. */
static tl_status take_props(reader *r, tl_node_kind kind, const char *where, const json_t *object,
                            tl_value values[TLI_PROPS_MAX])
{
    const char *key;
    json_t *json;
    char place[TLI_WHERE_BYTES];
    tl_status st = tli_node_presets(&r->arena, kind, values);
    json_object_foreach((json_t *)(uintptr_t)object, key, json)
    {
        const tl_prop_info *info = tl_node_prop(kind, key);
        if (st) break;
        if (!info) {
            if (kind <= TL_NODE_DETAIL || (strcmp(key, "kind") != 0 && strcmp(key, "name") != 0))
                warn(r, where, key);
            continue;
        }
        snprintf(place, sizeof place, "%s.%s", where, key);
        st = take_value(r, info, place, json, &values[tli_prop_index(kind, key)]);
    }
    return st;
}

static tl_status take_single(reader *r, tl_node_kind kind, const json_t *object)
{
    tl_value values[TLI_PROPS_MAX];
    const char *where = tl_node_kind_name(kind);
    if (!json_is_object(object))
        return tl_fail(r->ctx, TL_ERR_FORMAT, "%s: expected an object", where);
    tl_status st = take_props(r, kind, where, object, values);
    return st ? st : tli_scene_put(r->ctx, r->scene, (tl_node)kind + 1, values, "read");
}

static tl_status take_thing(reader *r, size_t i, const json_t *object)
{
    char where[TLI_WHERE_BYTES / 2], place[TLI_WHERE_BYTES];
    tl_value values[TLI_PROPS_MAX];
    snprintf(where, sizeof where, "things[%zu]", i);
    if (!json_is_object(object))
        return tl_fail(r->ctx, TL_ERR_FORMAT, "%s: expected an object", where);
    const char *word = json_string_value(json_object_get(object, "kind"));
    const tl_node_kind kind = word ? tl_node_kind_named(word) : TL_NODE_KIND_COUNT;
    if (kind <= TL_NODE_DETAIL || kind == TL_NODE_KIND_COUNT)
        return tl_fail(r->ctx, TL_ERR_FORMAT,
                       "%s.kind: expected a kind of things, as surface, not '%.40s'", where,
                       word ? word : "");
    const json_t *named = json_object_get(object, "name");
    const char *name = json_string_value(named);
    snprintf(place, sizeof place, "%s.name", where);
    if (named && !name) return tl_fail(r->ctx, TL_ERR_FORMAT, "%s: expected a text", place);
    tl_status st = name ? tli_name_check(r->ctx, r->scene, TL_ERR_FORMAT, place, name) : TL_OK;
    if (!st) st = take_props(r, kind, where, object, values);
    if (!st && kind == TL_NODE_TRANSFER) {
        snprintf(place, sizeof place, "%s.channel", where);
        st = tli_transfer_check(r->ctx, r->scene, TL_ERR_FORMAT, place, SIZE_MAX,
                                values[tli_prop_index(kind, "channel")].text);
    }
    return st ? st : tli_scene_put_new(r->ctx, r->scene, kind, name, values, NULL);
}

static tl_status take_things(reader *r, const json_t *list)
{
    tl_status st = TL_OK;
    const size_t count = json_array_size(list), most = TL_SCENE_NODES_MAX - TL_NODE_DETAIL - 1;
    if (!json_is_array(list) || count > most)
        return tl_fail(r->ctx, TL_ERR_FORMAT, "things: expected a list of at most %zu objects",
                       most);
    for (size_t i = 0; !st && i < count; i++) {
        tli_arena_open(r->ctx, &r->arena);
        st = take_thing(r, i, json_array_get(list, i));
        tli_arena_close(&r->arena);
    }
    return st;
}

/* ---- the file ---- */

static tl_status take_version(reader *r, const json_t *root)
{
    const json_t *version = json_object_get(root, "tetralod_scene");
    if (!json_is_integer(version))
        return tl_fail(r->ctx, TL_ERR_FORMAT, "expected an object with \"tetralod_scene\": %d",
                       VERSION);
    if (json_integer_value(version) != VERSION)
        return tl_fail(r->ctx, TL_ERR_UNSUPPORTED,
                       "tetralod_scene: version %lld, this build reads %d",
                       (long long)json_integer_value(version), VERSION);
    return TL_OK;
}

static tl_status take_root(reader *r, const json_t *root)
{
    const char *key;
    json_t *json;
    tl_status st = take_version(r, root);
    json_object_foreach((json_t *)(uintptr_t)root, key, json)
    {
        const tl_node_kind kind = tl_node_kind_named(key);
        if (st) break;
        if (strcmp(key, "tetralod_scene") == 0) continue;
        tli_arena_open(r->ctx, &r->arena);
        if (kind <= TL_NODE_DETAIL)
            st = take_single(r, kind, json);
        else if (strcmp(key, "things") != 0)
            warn(r, "", key);
        tli_arena_close(&r->arena);
    }
    json = json_object_get(root, "things");
    return st || !json ? st : take_things(r, json);
}

tl_status tli_json_scene(tl_ctx *ctx, const char *name, char *text, size_t bytes, tl_scene **scene)
{
    tli_json json;
    reader r = {.ctx = ctx, .name = name};
    tl_status st = tli_json_load(ctx, name, text, bytes, false, &json);
    if (st) return st;
    st = tl_scene_create(ctx, &r.scene);
    if (!st) st = tl_scene_begin(ctx, r.scene, "read");
    if (!st) st = take_root(&r, json.root);
    if (!st) st = tl_scene_end(ctx, r.scene, true);
    tli_json_unload(ctx, &json);
    if (st) {
        tl_scene_destroy(ctx, r.scene);
        return st;
    }
    if (r.warnings > WARNINGS_MOST)
        tl_log(ctx, TL_LOG_WARNING, "'%s': %zu more unknown keys", name,
               r.warnings - WARNINGS_MOST);
    tl_scene_forget(ctx, r.scene);
    *scene = r.scene;
    return TL_OK;
}
