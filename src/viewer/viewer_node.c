/* Nodes as people see them: what they are called, what a new one has, so that it shows something.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "viewer_things.h"

static const char *const TITLES[TL_NODE_KIND_COUNT] = {
    [TL_NODE_DATA] = "Data set",
    [TL_NODE_CAMERA] = "Camera",
    [TL_NODE_PICTURE] = "Picture",
    [TL_NODE_DETAIL] = "Level of detail",
    [TL_NODE_DERIVE] = "Derived channel",
    [TL_NODE_CLIP] = "Clip plane",
    [TL_NODE_THRESHOLD] = "Threshold",
    [TL_NODE_TRANSFER] = "Colours",
    [TL_NODE_VOLUME] = "Volume",
    [TL_NODE_SURFACE] = "Isosurface",
    [TL_NODE_SLICE] = "Slice",
    [TL_NODE_BOUNDARY] = "Boundary",
    [TL_NODE_EDGES] = "Edges",
    [TL_NODE_SILHOUETTES] = "Silhouettes",
    [TL_NODE_POINTS] = "Points",
    [TL_NODE_LINES] = "Streamlines",
};

const char *viewer_node_title(tl_node_kind kind)
{
    return TITLES[kind];
}

bool viewer_node_is_thing(tl_node_kind kind)
{
    return kind >= TL_NODE_DERIVE && kind < TL_NODE_KIND_COUNT && kind != TL_NODE_TRANSFER;
}

const char *viewer_node_switch(tl_node_kind kind)
{
    if (tl_node_prop(kind, "visible")) return "visible";
    return tl_node_prop(kind, "on") ? "on" : NULL;
}

tl_node viewer_node_of_kind(const viewer *v, tl_node_kind kind)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(v->scene, &count);
    for (size_t i = 0; i < count; i++)
        if (tl_scene_kind(v->scene, nodes[i]) == kind) return nodes[i];
    return 0;
}

/* ---- channels ---- */

/* Lines have the colours of the vectors that they follow, surfaces those of their values. */
const char *viewer_node_channel(const viewer *v, tl_node node)
{
    const tl_node_kind kind = tl_scene_kind(v->scene, node);
    const char *color_by = tl_scene_text(v->scene, node, "color_by");
    tl_value color;
    if (*color_by || kind == TL_NODE_POINTS) return color_by;
    if (kind == TL_NODE_SURFACE && !tl_scene_get(v->ctx, v->scene, node, "color", &color) &&
        color.count)
        return "";
    return kind == TL_NODE_THRESHOLD ? "" : tl_scene_text(v->scene, node, "channel");
}

static const char *channel_with(const viewer *v, bool vectors)
{
    if (!v->source) return "";
    const tl_source_facts *facts = tl_source_get_facts(v->source);
    for (size_t i = 0; i < facts->channel_count; i++)
        if ((facts->channels[i].components == 3) == vectors) return facts->channels[i].name;
    return !vectors && facts->channel_count ? facts->channels[0].name : "";
}

const tl_source_channel *viewer_channel_named(const viewer *v, const char *name)
{
    if (!v->source) return NULL;
    const tl_source_facts *facts = tl_source_get_facts(v->source);
    for (size_t i = 0; i < facts->channel_count; i++)
        if (strcmp(facts->channels[i].name, name) == 0) return &facts->channels[i];
    return NULL;
}

static bool is_vector(const viewer *v, const char *name)
{
    const tl_source_channel *channel = viewer_channel_named(v, name);
    return channel && channel->components == 3;
}

const char *viewer_node_channel_shown(const viewer *v)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(v->scene, &count);
    const char *name = v->selected ? viewer_node_channel(v, v->selected) : "";
    for (size_t i = 0; i < count && !*name; i++)
        if (viewer_node_is_thing(tl_scene_kind(v->scene, nodes[i])))
            name = viewer_node_channel(v, nodes[i]);
    return *name ? name : channel_with(v, false);
}

/* ---- new nodes ---- */

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The middle of the widest gap that isosurfaces leave in the range of the colours; false: there is
 * no picture of the channel yet. */
static bool free_value(const viewer *v, const char *channel, double *value)
{
    double ends[TL_SCENE_NODES_MAX + 2], widest = -1;
    size_t count = 0, node_count;
    const tl_node *nodes = tl_scene_nodes(v->scene, &node_count);
    const tl_values *values =
        v->frame && v->frame->content ? tl_content_values(v->frame->content, channel) : NULL;
    if (!values || !(values->range[0] < values->range[1])) return false;
    const bool logarithmic = values->logarithmic && values->range[0] > 0;
    ends[count++] = values->range[0];
    ends[count++] = values->range[1];
    for (size_t i = 0; i < node_count; i++) {
        const double at = tl_scene_real(v->scene, nodes[i], "value");
        if (tl_scene_kind(v->scene, nodes[i]) == TL_NODE_SURFACE &&
            strcmp(tl_scene_text(v->scene, nodes[i], "channel"), channel) == 0 &&
            at > values->range[0] && at < values->range[1])
            ends[count++] = at;
    }
    qsort(ends, count, sizeof *ends, by_size);
    for (size_t i = 0; i + 1 < count; i++) {
        const double width =
            logarithmic ? log(ends[i + 1] / ends[i]) : ends[i + 1] / 2 - ends[i] / 2;
        if (width <= widest) continue;
        widest = width;
        *value = logarithmic ? sqrt(ends[i]) * sqrt(ends[i + 1]) : ends[i] / 2 + ends[i + 1] / 2;
    }
    return true;
}

/* Opacity of isosurfaces that come after a first one, which may be inside. */
static const double GLASS = 0.5;

static tl_status fill_surface(viewer *v, tl_node node, const char *channel)
{
    char text[32];
    double value;
    const bool has_other = viewer_node_of_kind(v, TL_NODE_SURFACE) != node; /* seen through it */
    tl_status st = tl_scene_set_text(v->ctx, v->scene, node, "channel", channel);
    if (!st && free_value(v, channel, &value)) {
        g_ascii_formatd(text, sizeof text, "%.4g", value);
        st = tl_scene_set_text(v->ctx, v->scene, node, "value", text);
    }
    if (!st && has_other) st = tl_scene_set_real(v->ctx, v->scene, node, "opacity", GLASS);
    return st;
}

static tl_status fill_derived(viewer *v, tl_node node, const char *channel)
{
    const char *vectors = channel_with(v, true);
    char *text = *vectors ? g_strdup_printf("magnitude=mag(\"%s\")", vectors)
                          : g_strdup_printf("gradient=mag(grad(\"%s\"))", channel);
    const tl_status st = tl_scene_set_text(v->ctx, v->scene, node, "text", text);
    g_free(text);
    return st;
}

static tl_status fill(viewer *v, tl_node node, const char *channel)
{
    switch (tl_scene_kind(v->scene, node)) {
    case TL_NODE_SURFACE: return fill_surface(v, node, channel);
    case TL_NODE_DERIVE: return fill_derived(v, node, channel);
    case TL_NODE_VOLUME:
    case TL_NODE_THRESHOLD: return tl_scene_set_text(v->ctx, v->scene, node, "channel", channel);
    case TL_NODE_POINTS: {
        const tl_status st = tl_scene_set_text(v->ctx, v->scene, node, "channel", channel);
        return st ? st : tl_scene_set_text(v->ctx, v->scene, node, "color_by", channel);
    }
    case TL_NODE_SLICE: return tl_scene_set_text(v->ctx, v->scene, node, "color_by", channel);
    case TL_NODE_LINES:
        return tl_scene_set_text(v->ctx, v->scene, node, "channel",
                                 is_vector(v, channel) ? channel : channel_with(v, true));
    default: return TL_OK;
    }
}

bool viewer_node_add(viewer *v, tl_node_kind kind)
{
    char name[TL_SCENE_NAME_BYTES];
    tl_node node = 0;
    if (!v->source) return false;
    if (kind == TL_NODE_LINES && !*channel_with(v, true)) {
        viewer_say(v, VIEWER_WARNING,
                   "Streamlines follow vectors, and there is no channel of them");
        return false;
    }
    tl_scene_seal(v->scene);
    /* one is drawn */
    const tl_node volume = kind == TL_NODE_VOLUME ? viewer_node_of_kind(v, kind) : 0;
    if (volume) {
        viewer_ok(v, tl_scene_set_flag(v->ctx, v->scene, volume, "visible", true));
        viewer_changed(v);
        viewer_select(v, volume);
        return true;
    }
    char *channel = g_strdup(viewer_node_channel_shown(v)); /* a change ends what is borrowed */
    g_snprintf(name, sizeof name, "add %s", tl_node_kind_name(kind));
    tl_status st = tl_scene_begin(v->ctx, v->scene, name);
    if (!st) {
        st = tl_scene_add(v->ctx, v->scene, kind, &node);
        if (!st) st = fill(v, node, channel);
        const tl_status end = tl_scene_end(v->ctx, v->scene, !st);
        if (!st) st = end;
    }
    g_free(channel);
    tl_scene_seal(v->scene);
    if (!viewer_ok(v, st)) return false;
    viewer_changed(v);
    viewer_select(v, node);
    return true;
}

/* ---- the selected node ---- */

/* Place among the nodes that are not single. */
static size_t place_of(const viewer *v, tl_node node)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(v->scene, &count);
    size_t at = TL_NODE_DERIVE;
    while (at < count && nodes[at] != node) at++;
    return at - TL_NODE_DERIVE;
}

/* The nearest one that the list shows, before or behind; 0: none. */
static tl_node neighbour(const viewer *v, tl_node node, int by)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(v->scene, &count);
    size_t at = 0;
    while (at < count && nodes[at] != node) at++;
    for (at += (size_t)by; at < count; at += (size_t)by)
        if (viewer_node_is_thing(tl_scene_kind(v->scene, nodes[at]))) return nodes[at];
    return 0;
}

void viewer_node_remove_selected(viewer *v)
{
    const tl_node node = v->selected;
    if (!viewer_node_is_thing(tl_scene_kind(v->scene, node))) return;
    const tl_node behind = neighbour(v, node, 1), before = neighbour(v, node, -1);
    tl_scene_seal(v->scene);
    if (!viewer_ok(v, tl_scene_remove(v->ctx, v->scene, node))) return;
    viewer_changed(v);
    viewer_select(v, behind ? behind : before);
}

void viewer_node_move(viewer *v, tl_node node, tl_node other)
{
    tl_scene_seal(v->scene);
    if (viewer_ok(v, tl_scene_move(v->ctx, v->scene, node, place_of(v, other)))) viewer_changed(v);
}

void viewer_node_move_selected(viewer *v, int by)
{
    const tl_node other = neighbour(v, v->selected, by);
    if (viewer_node_is_thing(tl_scene_kind(v->scene, v->selected)) && other)
        viewer_node_move(v, v->selected, other);
}

void viewer_node_toggle_selected(viewer *v)
{
    const tl_node_kind kind = tl_scene_kind(v->scene, v->selected);
    const char *prop = kind < TL_NODE_KIND_COUNT ? viewer_node_switch(kind) : NULL;
    if (!prop) return;
    const bool now = tl_scene_flag(v->scene, v->selected, prop);
    tl_scene_seal(v->scene);
    if (viewer_ok(v, tl_scene_set_flag(v->ctx, v->scene, v->selected, prop, !now)))
        viewer_changed(v);
}

/* ---- rows of the list ---- */

char *viewer_node_about(const viewer *v, tl_node node)
{
    const char *channel = tl_scene_text(v->scene, node, "channel");
    const char *color_by = tl_scene_text(v->scene, node, "color_by");
    const char *mark = tl_scene_text(v->scene, node, "mark");
    char text[32];
    tl_value value;
    switch (tl_scene_kind(v->scene, node)) {
    case TL_NODE_SURFACE:
        if (tl_scene_get(v->ctx, v->scene, node, "value", &value) || !value.count)
            return g_strdup(channel);
        g_ascii_formatd(text, sizeof text, "%.4g", value.reals[0]);
        return g_strdup_printf("%s = %s", channel, text);
    case TL_NODE_DERIVE: return g_strdup(tl_scene_text(v->scene, node, "text"));
    case TL_NODE_BOUNDARY: return g_strdup(*mark && strcmp(mark, "none") != 0 ? mark : color_by);
    default: return g_strdup(*channel ? channel : color_by);
    }
}
