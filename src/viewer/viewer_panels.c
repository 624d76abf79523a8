/* The panels at the side: what is shown, the properties of what is selected, the colours of its
 * channel; and below them, always in sight, the level of detail. */
#include <stdio.h>
#include <string.h>

#include "viewer_detail.h"
#include "viewer_properties.h"
#include "viewer_things.h"
#include "viewer_transfer.h"

/* What the panels need at least to be used, above the level of detail. */
enum { SCROLLED_HEIGHT = 160 };

static const char STYLE[] =
    ".panels { font-size: 0.95em; }"
    ".panels .section { padding: 6px 10px 8px 10px; }"
    ".panels .heading { font-weight: bold; }"
    ".panels entry, .panels button, .panels dropdown > button { min-height: 24px; }"
    ".panels entry { padding: 0 6px; }"
    ".panels button { padding: 0 6px; }"
    ".panels button.image-button { min-width: 20px; padding: 0 3px; }"
    ".panels colorbutton > button { padding: 2px; min-width: 36px; }"
    ".panels scale { padding: 4px 6px; min-height: 12px; }"
    ".panels .caption-small { font-size: 0.78em; opacity: 0.65; margin: -3px 4px 0 4px; }"
    ".panels switch { margin: 1px 0; }"
    ".panels .row-label { opacity: 0.85; }"
    ".panels .figure { font-feature-settings: 'tnum'; }"
    ".panels .field-error { color: #e5484d; font-size: 0.9em; }"
    ".panels .things { background: none; border-radius: 6px; }"
    ".panels .things > row { padding: 0 4px; border-radius: 5px; }"
    ".panels .things > row.drop-above { box-shadow: inset 0 2px @theme_selected_bg_color; }"
    ".panels .things > row.drop-below { box-shadow: inset 0 -2px @theme_selected_bg_color; }"
    ".panels .things > row:selected .dim-label { opacity: 0.9; }"
    ".panels .point-row { min-height: 28px; }"
    ".panels .reset { padding: 0; min-width: 18px; opacity: 0.7; }"
    ".panels .node-name { background: none; border: none; box-shadow: none; opacity: 0.75; }"
    ".panels .detail { border-top: 1px solid alpha(currentColor, 0.15); }"
    ".panels .zoom-reset { min-height: 18px; min-width: 18px; padding: 1px; margin: 2px 8px; }"
    ".panels .swatch { border-radius: 3px; }"
    ".add-menu > button { padding: 4px 10px; }"
    ".add-menu .add-help { font-size: 0.85em; opacity: 0.65; }";

struct viewer_panels {
    viewer_things *things;
    viewer_properties *properties;
    viewer_transfer *transfer;
    viewer_detail *detail;
    const tl_content *content; /* of the frame that was shown last */
};

/* ---- what happens ---- */

static void show_transfer(viewer *v)
{
    char *channel = g_strdup(viewer_node_channel_shown(v)); /* it may be the panel's own */
    viewer_transfer_show(v->panels->transfer, channel);
    g_free(channel);
}

static void refresh(viewer *v, void *user)
{
    (void)user;
    viewer_things_refresh(v->panels->things);
    viewer_properties_refresh(v->panels->properties);
    show_transfer(v);
    viewer_detail_refresh(v->panels->detail);
}

/* What is looked at first: what is in front of the list. */
static tl_node first_thing(const viewer *v)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(v->scene, &count);
    for (size_t i = 0; i < count; i++)
        if (tl_scene_kind(v->scene, nodes[i]) >= TL_NODE_VOLUME) return nodes[i];
    return 0;
}

static void scene_changed(viewer *v, void *user)
{
    if (tl_scene_kind(v->scene, v->selected) == TL_NODE_KIND_COUNT)
        viewer_select(v, first_thing(v));
    refresh(v, user);
}

static void source_changed(viewer *v, void *user)
{
    v->panels->content = NULL;
    viewer_transfer_show(v->panels->transfer, ""); /* nodes are others */
    viewer_select(v, first_thing(v));
    refresh(v, user);
}

/* Automatic ranges and colours come with the picture. */
static void frame_changed(viewer *v, void *user)
{
    (void)user;
    if (!v->frame || v->frame->content == v->panels->content) return;
    v->panels->content = v->frame->content;
    viewer_properties_refresh(v->panels->properties);
    show_transfer(v);
}

static void live_event(viewer *v, void *user)
{
    if (v->event->kind == TL_LIVE_DONE && v->event->job == TL_LIVE_HISTOGRAM) refresh(v, user);
}

/* ---- actions, words of scripts ---- */

static void reset_colors(viewer *v)
{
    viewer_transfer_reset(v->panels->transfer);
}

static void reverse_colors(viewer *v)
{
    viewer_transfer_reverse(v->panels->transfer);
}

static void import_colors(viewer *v)
{
    viewer_transfer_import(v->panels->transfer);
}

static void export_colors(viewer *v)
{
    viewer_transfer_export(v->panels->transfer);
}

static void toggle_counts(viewer *v)
{
    viewer_transfer_toggle_counts(v->panels->transfer);
}

static const viewer_action ACTIONS[] = {
    {"thing-toggle", "h", "Things", "Show or hide what is selected", viewer_node_toggle_selected,
     NULL},
    {"thing-remove", "Delete", "Things", "Remove what is selected", viewer_node_remove_selected,
     NULL},
    {"", "Space", "Things", "Show or hide, in the list", NULL, NULL},
    {"", "Drag, Alt+Up, Alt+Down", "Things", "Order of the list", NULL, NULL},
    {"", "Drag, Left, Right", "Values and colours", "Move a value, with Shift faster", NULL, NULL},
    {"", "Wheel", "Values and colours", "Zoom the histogram", NULL, NULL},
    {"", "Double click", "Values and colours", "A new point; exact value or colour", NULL, NULL},
    {"", "Tab", "Values and colours", "To the next point", NULL, NULL},
    {"", "Arrow keys", "Values and colours", "Move a point, with Shift faster", NULL, NULL},
    {"", "Insert, Delete", "Values and colours", "Add a point behind it, remove it", NULL, NULL},
    {"colours-reset", "", "Colours", "Automatic colours again", reset_colors, NULL},
    {"colours-reverse", "", "Colours", "Reverse the colours", reverse_colors, NULL},
    {"colours-import", "", "Colours", "Import colours of ParaView", import_colors, NULL},
    {"colours-export", "", "Colours", "Export colours for ParaView", export_colors, NULL},
    {"colours-counts", "", "Colours", "Linear or logarithmic counts", toggle_counts, NULL},
};

static bool new_thing(viewer *v, const char *kind)
{
    const tl_node_kind named = tl_node_kind_named(kind);
    if (viewer_node_is_thing(named)) return viewer_node_add(v, named);
    viewer_say(v, VIEWER_ERROR, "new: '%s' is nothing that can be added", kind);
    return false;
}

static bool select_thing(viewer *v, const char *name)
{
    const tl_node node = tl_scene_find(v->scene, name);
    if (!node) viewer_say(v, VIEWER_ERROR, "select: there is no '%s'", name);
    if (node) viewer_select(v, node);
    return node != 0;
}

/* The value of a property, as `set` reads it. */
static bool get_value(viewer *v, const char *place)
{
    const char *dot = strrchr(place, '.');
    char *name = g_strndup(place, dot ? (gsize)(dot - place) : 0);
    char text[TL_SCENE_TEXT_BYTES];
    const tl_node node = tl_scene_find(v->scene, name);
    g_free(name);
    if (!node || !tl_node_prop(tl_scene_kind(v->scene, node), dot + 1)) {
        viewer_say(v, VIEWER_ERROR, "get: there is no '%s'", place);
        return false;
    }
    tl_scene_print(v->scene, node, dot + 1, text, sizeof text);
    printf("get %s %s\n", place, text);
    fflush(stdout);
    return true;
}

static GtkWidget *find_named(GtkWidget *widget, const char *name)
{
    if (strcmp(gtk_widget_get_name(widget), name) == 0 && gtk_widget_get_mapped(widget))
        return widget;
    GtkWidget *found = NULL;
    for (GtkWidget *child = gtk_widget_get_first_child(widget); child && !found;
         child = gtk_widget_get_next_sibling(child))
        found = find_named(child, name);
    return found;
}

/* Where a control is, for those who drive the pointer: its left upper corner in the window with its
 * shadow, width and height. */
static bool say_where(viewer *v, const char *name)
{
    double x, y, shadow_x, shadow_y;
    GtkWidget *widget = find_named(GTK_WIDGET(v->window), name);
    if (!widget || !gtk_widget_translate_coordinates(widget, GTK_WIDGET(v->window), 0, 0, &x, &y)) {
        viewer_say(v, VIEWER_ERROR, "where: nothing seen is called '%s'", name);
        return false;
    }
    gtk_native_get_surface_transform(GTK_NATIVE(v->window), &shadow_x, &shadow_y);
    printf("where %s %.0f %.0f %d %d\n", name, x + shadow_x, y + shadow_y,
           gtk_widget_get_width(widget), gtk_widget_get_height(widget));
    fflush(stdout);
    return true;
}

static const viewer_command COMMANDS[] = {
    {"new", "new KIND", new_thing},
    {"select", "select NODE", select_thing},
    {"get", "get NODE.PROPERTY", get_value},
    {"where", "where CONTROL", say_where},
};

/* ---- the part ---- */

static void end(viewer *v, void *user)
{
    (void)user;
    g_free(v->panels);
    v->panels = NULL;
}

void viewer_panels_attach(viewer *v)
{
    GtkCssProvider *style = gtk_css_provider_new();
    GtkWidget *column = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    GtkWidget *scrolled = gtk_scrolled_window_new();
    v->panels = g_new0(struct viewer_panels, 1);
    gtk_css_provider_load_from_data(style, STYLE, -1);
    gtk_style_context_add_provider_for_display(gdk_display_get_default(), GTK_STYLE_PROVIDER(style),
                                               GTK_STYLE_PROVIDER_PRIORITY_APPLICATION);
    g_object_unref(style);
    v->panels->things = viewer_things_create(v);
    v->panels->properties = viewer_properties_create(v);
    v->panels->transfer = viewer_transfer_create(v);
    v->panels->detail = viewer_detail_create(v);
    gtk_box_append(GTK_BOX(column), viewer_things_widget(v->panels->things));
    gtk_box_append(GTK_BOX(column), viewer_properties_widget(v->panels->properties));
    gtk_box_append(GTK_BOX(column), viewer_transfer_widget(v->panels->transfer));
    gtk_scrolled_window_set_policy(GTK_SCROLLED_WINDOW(scrolled), GTK_POLICY_NEVER,
                                   GTK_POLICY_AUTOMATIC);
    gtk_scrolled_window_set_min_content_height(GTK_SCROLLED_WINDOW(scrolled), SCROLLED_HEIGHT);
    gtk_scrolled_window_set_child(GTK_SCROLLED_WINDOW(scrolled), column);
    /* lists in it are as high as they want to be */
    gtk_scrollable_set_vscroll_policy(
        GTK_SCROLLABLE(gtk_scrolled_window_get_child(GTK_SCROLLED_WINDOW(scrolled))),
        GTK_SCROLL_NATURAL);
    gtk_widget_set_vexpand(scrolled, TRUE);
    gtk_widget_add_css_class(v->side, "panels");
    gtk_box_append(GTK_BOX(v->side), scrolled);
    gtk_box_append(GTK_BOX(v->side), viewer_detail_widget(v->panels->detail));
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
    viewer_listen(v, VIEWER_SOURCE, source_changed, NULL);
    viewer_listen(v, VIEWER_SCENE, scene_changed, NULL);
    viewer_listen(v, VIEWER_SELECTED, refresh, NULL);
    viewer_listen(v, VIEWER_FRAME, frame_changed, NULL);
    viewer_listen(v, VIEWER_LIVE, live_event, NULL);
    viewer_listen(v, VIEWER_END, end, NULL);
    refresh(v, NULL);
}
