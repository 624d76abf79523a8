/* A scene as JSON, one property a line. */
#include "scene/scene_text.h"

static void put_value(tli_text *w, const tl_prop_info *info, const tl_value *value)
{
    if (value->text) {
        tli_text_put_quoted(w, value->text);
    } else if (info->type == TL_PROP_LIST) {
        tli_text_put(w, "[");
        for (size_t i = 0; i < value->count; i += info->count) {
            if (i) tli_text_put(w, ", ");
            tli_text_put_reals(w, value->reals + i, info->count);
        }
        tli_text_put(w, "]");
    } else if (!value->count) {
        tli_text_put(w, "null");
    } else if (info->type == TL_PROP_FLAG) {
        tli_text_put(w, value->reals[0] != 0 ? "true" : "false");
    } else if (value->count == 1) {
        tli_text_put_real(w, value->reals[0]);
    } else {
        tli_text_put_reals(w, value->reals, value->count);
    }
}

/* The properties of a node, a line each. */
static void put_node(tli_text *w, const tli_node *node, const char *indent)
{
    size_t count;
    const tl_prop_info *infos = tl_node_props(node->kind, &count);
    for (size_t i = 0; i < count; i++) {
        tli_text_put(w, indent);
        tli_text_put_quoted(w, infos[i].name);
        tli_text_put(w, ": ");
        put_value(w, &infos[i], &node->values[i]);
        tli_text_put(w, i + 1 < count ? ",\n" : "\n");
    }
}

static void put_scene(tli_text *w, const tl_scene *scene)
{
    tli_text_put(w, "{\n \"tetralod_scene\": 1");
    for (size_t i = 0; i < scene->now->node_count; i++) {
        const tli_node *node = scene->now->nodes[i];
        const bool is_thing = node->kind > TL_NODE_DETAIL;
        if (!is_thing) {
            tli_text_put(w, ",\n ");
            tli_text_put_quoted(w, node->name);
            tli_text_put(w, ": {\n");
            put_node(w, node, "  ");
            tli_text_put(w, " }");
            continue;
        }
        tli_text_put(w, i == TL_NODE_DETAIL + 1 ? ",\n \"things\": [\n  {\n" : ",\n  {\n");
        tli_text_put(w, "   \"kind\": ");
        tli_text_put_quoted(w, tl_node_kind_name(node->kind));
        tli_text_put(w, ",\n   \"name\": ");
        tli_text_put_quoted(w, node->name);
        tli_text_put(w, ",\n");
        put_node(w, node, "   ");
        tli_text_put(w, "  }");
    }
    tli_text_put(w, scene->now->node_count > TL_NODE_DETAIL + 1 ? "\n ]\n}\n" : "\n}\n");
}

tl_status tl_scene_write_text(tl_ctx *ctx, const tl_scene *scene, char **text, size_t *bytes)
{
    tli_text w = {.ctx = ctx};
    put_scene(&w, scene);
    const tl_status st = tli_text_check(&w);
    *text = st ? NULL : w.text;
    *bytes = st ? 0 : w.bytes;
    if (st) tl_mem_free(ctx, w.text);
    return st;
}

tl_status tl_scene_write(tl_ctx *ctx, const tl_scene *scene, const char *path)
{
    tli_text w = {.ctx = ctx};
    put_scene(&w, scene);
    tl_status st = tli_text_save(&w, path);
    return st ? tl_note(ctx, st, "while writing the scene '%s'", path) : TL_OK;
}
