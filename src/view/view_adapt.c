/* A scene that was made for other data: what it names and these data lack is switched off. All that
 * chooses tets is first off, then comes on again, one by one, as far as it can. */
#include <stdarg.h>
#include <stdio.h>

#include "view/view.h"

typedef struct adapter {
    tl_ctx *ctx;
    tl_view *view;
    const tl_scene *from;
    tl_scene *scene; /* a copy, node for node */
    char *text;      /* [bytes] what was switched off */
    size_t bytes, used;
} adapter;

static TL_PRINTF(2, 3) void say(adapter *a, const char *format, ...)
{
    va_list args;
    if (a->used && a->used + 1 < a->bytes) a->text[a->used++] = '\n';
    va_start(args, format);
    const int n = tli_vprint(a->text + a->used, a->bytes - a->used, format, args);
    va_end(args);
    if (n > 0) a->used += (size_t)n;
    if (a->used >= a->bytes) a->used = a->bytes - 1;
}

/* Whether a failure is one of words that the data lack; says so. */
static bool is_lacking(adapter *a, tl_status st, tl_node node, const char *what)
{
    const char *message = tl_ctx_message(a->ctx);
    if (st != TL_ERR_ARG && st != TL_ERR_DATA) return false;
    say(a, "%s %s: %.*s", tl_scene_name(a->scene, node), what, (int)strcspn(message, "\n"),
        message);
    tl_ctx_clear(a->ctx);
    return true;
}

static tl_status try_out(adapter *a)
{
    tli_agenda agenda = {0};
    tl_status st = tli_agenda_begin(a->ctx, a->view, a->scene, &agenda);
    tli_agenda_release(a->ctx, &agenda);
    return st;
}

/* ---- data ---- */

/* What chooses tets, or makes channels that others may choose by. */
static const struct {
    tl_node_kind kind;
    const char *prop;
    const char *off; /* as text */
} CHOICES[] = {{TL_NODE_DERIVE, "text", ""},
               {TL_NODE_DATA, "regions", ""},
               {TL_NODE_DATA, "hide_regions", ""},
               {TL_NODE_THRESHOLD, "on", "off"},
               {TL_NODE_CLIP, "on", "off"}};
enum { CHOICE_COUNT = sizeof CHOICES / sizeof *CHOICES };

static tl_status switch_off(adapter *a, size_t choice, tl_node node)
{
    return tl_scene_set_text(a->ctx, a->scene, node, CHOICES[choice].prop, CHOICES[choice].off);
}

static tl_status switch_on(adapter *a, size_t choice, tl_node node)
{
    tl_value value;
    const char *prop = CHOICES[choice].prop;
    const uint64_t version = tl_scene_version(a->scene);
    tl_status st = tl_scene_get(a->ctx, a->from, node, prop, &value);
    if (!st) st = tl_scene_set(a->ctx, a->scene, node, prop, &value);
    if (st || tl_scene_version(a->scene) == version) return st;
    st = try_out(a);
    char what[40] = "is off";
    if (node == TL_NODE_DATA + 1) snprintf(what, sizeof what, "has no %s", prop);
    return is_lacking(a, st, node, what) ? switch_off(a, choice, node) : st;
}

static tl_status each_choice(adapter *a, tl_status (*act)(adapter *a, size_t choice, tl_node node))
{
    size_t count;
    tl_status st = TL_OK;
    const tl_node *nodes = tl_scene_nodes(a->from, &count);
    for (size_t choice = 0; choice < CHOICE_COUNT; choice++)
        for (size_t i = 0; !st && i < count; i++)
            if (tl_scene_kind(a->from, nodes[i]) == CHOICES[choice].kind)
                st = act(a, choice, nodes[i]);
    return st;
}

static tl_status adapt_step(adapter *a)
{
    int64_t step;
    double time;
    const tl_node data = TL_NODE_DATA + 1;
    tl_status st = tli_scene_step(a->ctx, a->view->source, a->scene, &step, &time);
    return is_lacking(a, st, data, "has another step")
               ? tl_scene_set_real(a->ctx, a->scene, data, "step", -1)
               : st;
}

static tl_status adapt_data(adapter *a)
{
    tl_status st = adapt_step(a);
    if (!st) st = try_out(a);
    if (st != TL_ERR_ARG && st != TL_ERR_DATA) return st;
    st = each_choice(a, switch_off);
    return st ? st : each_choice(a, switch_on);
}

/* ---- things ---- */

/* A thing without its channel is not drawn, one without its colours has its own. */
static tl_status adapt_thing(adapter *a, tli_body *look, tl_node node)
{
    const tl_channel *channel;
    const char *name = tl_scene_text(a->scene, node, "channel");
    const char *color = tl_scene_text(a->scene, node, "color_by");
    tl_status st = *name ? tli_body_channel(a->ctx, look, name, &channel) : TL_OK;
    if (!st && tl_scene_kind(a->scene, node) == TL_NODE_LINES && *name)
        st = tli_flow_check(a->ctx, channel);
    if (is_lacking(a, st, node, "is hidden"))
        return tl_scene_set_flag(a->ctx, a->scene, node, "visible", false);
    if (!st && *color) st = tli_body_channel(a->ctx, look, color, &channel);
    return is_lacking(a, st, node, "has no colours")
               ? tl_scene_set_text(a->ctx, a->scene, node, "color_by", "")
               : st;
}

static tl_status adapt_things(adapter *a)
{
    size_t count;
    tli_agenda agenda = {0};
    tl_status st = tli_agenda_begin(a->ctx, a->view, a->scene, &agenda);
    const tl_node *nodes = tl_scene_nodes(a->from, &count);
    for (size_t i = 0; !st && i < count; i++)
        if (tl_scene_kind(a->from, nodes[i]) >= TL_NODE_VOLUME &&
            tl_scene_flag(a->from, nodes[i], "visible"))
            st = adapt_thing(a, agenda.look, nodes[i]);
    tli_agenda_release(a->ctx, &agenda);
    return st;
}

tl_status tl_view_adapt(tl_ctx *ctx, tl_view *view, const tl_scene *from, tl_scene **scene,
                        char *text, size_t bytes)
{
    adapter a = {.ctx = ctx, .view = view, .from = from, .text = text, .bytes = bytes};
    *text = '\0';
    tl_status st = tl_scene_copy(ctx, from, &a.scene);
    if (!st) st = adapt_data(&a);
    if (!st) st = adapt_things(&a);
    if (st) {
        tl_scene_destroy(ctx, a.scene);
        a.scene = NULL;
    } else {
        tl_scene_forget(ctx, a.scene);
    }
    *scene = a.scene;
    return st;
}
