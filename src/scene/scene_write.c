/* A scene as JSON. Written by hand: numbers in their fewest digits, one property a line, the same
 * bytes in any locale. */
#include <stdio.h>
#include <string.h>

#include "base/base_file.h"
#include "scene/scene.h"

/* Text that grows; after a failure nothing is done any more. */
typedef struct writer {
    tl_ctx *ctx;
    tl_status st;
    char *text;
    size_t bytes, room;
} writer;

static void put_bytes(writer *w, const char *bytes, size_t count)
{
    while (!w->st && w->room - w->bytes <= count) {
        const size_t room = w->room ? 2 * w->room : 4096;
        w->text = tl_mem_resize(w->ctx, w->text, room, 1, &w->st);
        if (!w->st) w->room = room;
    }
    if (w->st) return;
    memcpy(w->text + w->bytes, bytes, count);
    w->bytes += count;
    w->text[w->bytes] = '\0';
}

static void put(writer *w, const char *text)
{
    put_bytes(w, text, strlen(text));
}

static void put_text(writer *w, const char *text)
{
    put(w, "\"");
    for (; *text; text++) {
        if (*text == '"' || *text == '\\') put(w, "\\");
        put_bytes(w, text, 1);
    }
    put(w, "\"");
}

static void put_real(writer *w, double real)
{
    char text[TLI_REAL_BYTES];
    tli_real_print(real, text);
    put(w, text);
}

static void put_reals(writer *w, const double *reals, size_t count)
{
    put(w, "[");
    for (size_t i = 0; i < count; i++) {
        if (i) put(w, ", ");
        put_real(w, reals[i]);
    }
    put(w, "]");
}

static void put_value(writer *w, const tl_prop_info *info, const tl_value *value)
{
    if (value->text) {
        put_text(w, value->text);
    } else if (info->type == TL_PROP_LIST) {
        put(w, "[");
        for (size_t i = 0; i < value->count; i += info->count) {
            if (i) put(w, ", ");
            put_reals(w, value->reals + i, info->count);
        }
        put(w, "]");
    } else if (!value->count) {
        put(w, "null");
    } else if (info->type == TL_PROP_FLAG) {
        put(w, value->reals[0] != 0 ? "true" : "false");
    } else if (value->count == 1) {
        put_real(w, value->reals[0]);
    } else {
        put_reals(w, value->reals, value->count);
    }
}

/* The properties of a node, a line each. */
static void put_node(writer *w, const tli_node *node, const char *indent)
{
    size_t count;
    const tl_prop_info *infos = tl_node_props(node->kind, &count);
    for (size_t i = 0; i < count; i++) {
        put(w, indent);
        put_text(w, infos[i].name);
        put(w, ": ");
        put_value(w, &infos[i], &node->values[i]);
        put(w, i + 1 < count ? ",\n" : "\n");
    }
}

static void put_scene(writer *w, const tl_scene *scene)
{
    put(w, "{\n \"tetralod_scene\": 1");
    for (size_t i = 0; i < scene->now->node_count; i++) {
        const tli_node *node = scene->now->nodes[i];
        const bool is_thing = node->kind > TL_NODE_DETAIL;
        if (!is_thing) {
            put(w, ",\n ");
            put_text(w, node->name);
            put(w, ": {\n");
            put_node(w, node, "  ");
            put(w, " }");
            continue;
        }
        put(w, i == TL_NODE_DETAIL + 1 ? ",\n \"things\": [\n  {\n" : ",\n  {\n");
        put(w, "   \"kind\": ");
        put_text(w, tl_node_kind_name(node->kind));
        put(w, ",\n   \"name\": ");
        put_text(w, node->name);
        put(w, ",\n");
        put_node(w, node, "   ");
        put(w, "  }");
    }
    put(w, scene->now->node_count > TL_NODE_DETAIL + 1 ? "\n ]\n}\n" : "\n}\n");
}

tl_status tl_scene_write_text(tl_ctx *ctx, const tl_scene *scene, char **text, size_t *bytes)
{
    writer w = {.ctx = ctx};
    put_scene(&w, scene);
    *text = w.st ? NULL : w.text;
    *bytes = w.st ? 0 : w.bytes;
    if (w.st) tl_mem_free(ctx, w.text);
    return w.st;
}

tl_status tl_scene_write(tl_ctx *ctx, const tl_scene *scene, const char *path)
{
    char *text;
    size_t bytes;
    tli_sink *sink = NULL;
    tl_status st = tl_scene_write_text(ctx, scene, &text, &bytes);
    if (!st) st = tli_sink_open(ctx, path, &sink);
    if (!st) st = tli_sink_write(sink, text, bytes);
    const tl_status ended = tli_sink_close(sink, !st);
    tl_mem_free(ctx, text);
    if (!st) st = ended;
    return st ? tl_note(ctx, st, "while writing the scene '%s'", path) : TL_OK;
}
