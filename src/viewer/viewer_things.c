/* The list of what is shown: one row a node, with an eye that shows and hides it; a menu of what
 * can be added. */
#include "viewer_things.h"

#include <math.h>

#include "viewer_widgets.h"

/* Kinds in the menu, as people look for them; a gap before what chooses parts of the mesh. */
static const tl_node_kind ADDED[] = {TL_NODE_SURFACE,   TL_NODE_VOLUME,      TL_NODE_SLICE,
                                     TL_NODE_LINES,     TL_NODE_POINTS,      TL_NODE_BOUNDARY,
                                     TL_NODE_EDGES,     TL_NODE_SILHOUETTES, TL_NODE_CLIP,
                                     TL_NODE_THRESHOLD, TL_NODE_DERIVE};
enum { ADDED_COUNT = sizeof ADDED / sizeof *ADDED, ADDED_GAP = 8 };

/* Longer lists are scrolled. */
enum { LIST_HEIGHT = 212 };
/* A press that moves no farther is a click. */
static const double DRAG_PX = 6;

struct viewer_things {
    viewer *v;
    GtkWidget *box, *list, *scrolled, *add;
    GtkWidget *remove, *quick[2];
    tl_node dragged;    /* 0: none */
    int gap;            /* before which row it goes */
    bool is_drag_moved; /* far enough to be no click */
    bool is_filling;
};

/* A row, with the data of the node that it shows. */
typedef struct thing {
    viewer_things *things;
    tl_node node;
    GtkWidget *row, *eye, *name, *about;
} thing;
static const char ROW_KEY[] = "tetralod-thing";

static thing *thing_of(GtkListBoxRow *row)
{
    return row ? g_object_get_data(G_OBJECT(row), ROW_KEY) : NULL;
}

/* ---- rows ---- */

static void eye_clicked(thing *row)
{
    viewer *v = row->things->v;
    viewer_select(v, row->node);
    viewer_node_toggle_selected(v);
}

static thing *row_create(viewer_things *things, tl_node node)
{
    thing *row = g_new0(thing, 1);
    GtkWidget *line = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    row->things = things;
    row->node = node;
    row->row = gtk_list_box_row_new();
    row->eye = viewer_icon_button("view-reveal-symbolic", "Show or hide (Space)");
    row->name = gtk_label_new(NULL);
    row->about = gtk_label_new(NULL);
    gtk_widget_set_name(row->row, tl_scene_name(things->v->scene, node));
    gtk_widget_set_focus_on_click(row->eye, FALSE);
    gtk_label_set_ellipsize(GTK_LABEL(row->name), PANGO_ELLIPSIZE_END);
    gtk_label_set_xalign(GTK_LABEL(row->name), 0);
    gtk_label_set_ellipsize(GTK_LABEL(row->about), PANGO_ELLIPSIZE_END);
    gtk_label_set_xalign(GTK_LABEL(row->about), 1);
    gtk_widget_set_hexpand(row->about, TRUE);
    gtk_widget_add_css_class(row->about, "dim-label");
    gtk_box_append(GTK_BOX(line), row->eye);
    gtk_box_append(GTK_BOX(line), row->name);
    gtk_box_append(GTK_BOX(line), row->about);
    gtk_list_box_row_set_child(GTK_LIST_BOX_ROW(row->row), line);
    g_signal_connect_swapped(row->eye, "clicked", G_CALLBACK(eye_clicked), row);
    g_object_set_data_full(G_OBJECT(row->row), ROW_KEY, row, g_free);
    return row;
}

static void row_refresh(thing *row)
{
    const viewer *v = row->things->v;
    const tl_node_kind kind = tl_scene_kind(v->scene, row->node);
    const char *prop = viewer_node_switch(kind);
    const bool shown = !prop || tl_scene_flag(v->scene, row->node, prop);
    const bool is_thing = viewer_node_is_thing(kind);
    char *about = is_thing ? viewer_node_about(v, row->node) : g_strdup("");
    gtk_button_set_icon_name(GTK_BUTTON(row->eye),
                             shown ? "view-reveal-symbolic" : "view-conceal-symbolic");
    /* it keeps its room, so that names stand in one column */
    gtk_widget_set_opacity(row->eye, !prop ? 0 : shown ? 1 : 0.5);
    gtk_widget_set_sensitive(row->eye, prop != NULL);
    gtk_label_set_text(GTK_LABEL(row->name),
                       is_thing ? tl_scene_name(v->scene, row->node) : viewer_node_title(kind));
    gtk_widget_set_opacity(row->name, shown ? 1 : 0.5);
    gtk_label_set_text(GTK_LABEL(row->about), about);
    g_free(about);
}

/* ---- the list ---- */

/* Node of row i of the list: what comes and goes, then what is around it; 0 past the last. */
static tl_node listed(const viewer *v, size_t i)
{
    static const tl_node LAST[] = {TL_NODE_DATA + 1, TL_NODE_PICTURE + 1};
    size_t count, at = 0;
    const tl_node *nodes = tl_scene_nodes(v->scene, &count);
    for (size_t n = 0; n < count; n++)
        if (viewer_node_is_thing(tl_scene_kind(v->scene, nodes[n])) && at++ == i) return nodes[n];
    return i - at < sizeof LAST / sizeof *LAST ? LAST[i - at] : 0;
}

static bool is_same(const viewer_things *things)
{
    for (int i = 0;; i++) {
        const thing *row = thing_of(gtk_list_box_get_row_at_index(GTK_LIST_BOX(things->list), i));
        const tl_node node = listed(things->v, (size_t)i);
        if (!row && !node) return true;
        if (!row || row->node != node) return false;
    }
}

static void make_rows(viewer_things *things)
{
    GtkListBoxRow *row;
    tl_node node;
    while ((row = gtk_list_box_get_row_at_index(GTK_LIST_BOX(things->list), 0)))
        gtk_list_box_remove(GTK_LIST_BOX(things->list), GTK_WIDGET(row));
    for (size_t i = 0; (node = listed(things->v, i)); i++)
        gtk_list_box_append(GTK_LIST_BOX(things->list), row_create(things, node)->row);
}

/* Scrolls to a row, which has its place once the list was laid out. */
static void show_row(viewer_things *things, GtkWidget *row)
{
    double x, y;
    if (!gtk_widget_translate_coordinates(row, things->list, 0, 0, &x, &y)) return;
    gtk_adjustment_clamp_page(
        gtk_scrolled_window_get_vadjustment(GTK_SCROLLED_WINDOW(things->scrolled)), y,
        y + gtk_widget_get_height(row));
}

static void show_selected(viewer_things *things)
{
    GtkListBoxRow *row;
    GtkListBox *list = GTK_LIST_BOX(things->list);
    const viewer *v = things->v;
    const bool is_thing = viewer_node_is_thing(tl_scene_kind(v->scene, v->selected));
    gtk_list_box_unselect_all(list);
    for (int i = 0; (row = gtk_list_box_get_row_at_index(list, i)); i++)
        if (thing_of(row)->node == v->selected) {
            gtk_list_box_select_row(list, row);
            show_row(things, GTK_WIDGET(row));
        }
    gtk_widget_set_sensitive(things->remove, is_thing);
}

void viewer_things_refresh(viewer_things *things)
{
    GtkListBoxRow *row;
    things->is_filling = true;
    if (!is_same(things)) make_rows(things);
    for (int i = 0; (row = gtk_list_box_get_row_at_index(GTK_LIST_BOX(things->list), i)); i++)
        row_refresh(thing_of(row));
    show_selected(things);
    gtk_widget_set_sensitive(things->add, things->v->source != NULL);
    for (size_t i = 0; i < G_N_ELEMENTS(things->quick); i++)
        gtk_widget_set_sensitive(things->quick[i], things->v->source != NULL);
    things->is_filling = false;
}

static void row_selected(GtkListBox *list, GtkListBoxRow *row, viewer_things *things)
{
    (void)list;
    const thing *chosen = thing_of(row);
    if (!things->is_filling && chosen && chosen->node != things->v->selected)
        viewer_select(things->v, chosen->node);
}

static gboolean key_pressed(GtkEventControllerKey *keys, guint key, guint code,
                            GdkModifierType state, viewer_things *things)
{
    (void)keys;
    (void)code;
    const bool alt = state & GDK_ALT_MASK;
    if (key == GDK_KEY_Delete || key == GDK_KEY_BackSpace)
        viewer_node_remove_selected(things->v);
    else if (key == GDK_KEY_space)
        viewer_node_toggle_selected(things->v);
    else if (alt && (key == GDK_KEY_Up || key == GDK_KEY_Down))
        viewer_node_move_selected(things->v, key == GDK_KEY_Up ? -1 : 1);
    else
        return FALSE;
    return TRUE;
}

/* ---- dragging rows ---- */

static int thing_count(const viewer_things *things)
{
    int count = 0;
    while (viewer_node_is_thing(tl_scene_kind(things->v->scene, listed(things->v, (size_t)count))))
        count++;
    return count;
}

/* A line where the row would go; gap -1: none. */
static void mark_gap(viewer_things *things, int gap)
{
    const int last = thing_count(things) - 1;
    GtkListBoxRow *row;
    things->gap = gap;
    for (int i = 0; (row = gtk_list_box_get_row_at_index(GTK_LIST_BOX(things->list), i)); i++) {
        gtk_widget_remove_css_class(GTK_WIDGET(row), "drop-above");
        gtk_widget_remove_css_class(GTK_WIDGET(row), "drop-below");
        if (i == gap && i <= last) gtk_widget_add_css_class(GTK_WIDGET(row), "drop-above");
        if (i == last && gap == last + 1) gtk_widget_add_css_class(GTK_WIDGET(row), "drop-below");
    }
}

static void row_drag_begin(GtkGestureDrag *drag, double x, double y, viewer_things *things)
{
    (void)drag;
    (void)x;
    const thing *row = thing_of(gtk_list_box_get_row_at_y(GTK_LIST_BOX(things->list), (int)y));
    const bool is_thing = row && viewer_node_is_thing(tl_scene_kind(things->v->scene, row->node));
    things->dragged = is_thing ? row->node : 0;
    things->is_drag_moved = false;
    things->gap = -1;
}

/* The row that the pointer is in the upper half of. */
static void row_drag_update(GtkGestureDrag *drag, double dx, double dy, viewer_things *things)
{
    double x, y;
    GtkListBox *list = GTK_LIST_BOX(things->list);
    if (!things->dragged || !gtk_gesture_drag_get_start_point(drag, &x, &y)) return;
    if (!things->is_drag_moved && hypot(dx, dy) < DRAG_PX) return;
    things->is_drag_moved = true;
    gtk_gesture_set_state(GTK_GESTURE(drag), GTK_EVENT_SEQUENCE_CLAIMED);
    const int count = thing_count(things);
    int gap = 0;
    for (int i = 0; i < count; i++) {
        GtkWidget *row = GTK_WIDGET(gtk_list_box_get_row_at_index(list, i));
        double row_x, row_y;
        gtk_widget_translate_coordinates(row, things->list, 0, 0, &row_x, &row_y);
        if (y + dy > row_y + gtk_widget_get_height(row) / 2.0) gap = i + 1;
    }
    mark_gap(things, gap);
}

static void row_drag_end(GtkGestureDrag *drag, double dx, double dy, viewer_things *things)
{
    (void)drag;
    (void)dx;
    (void)dy;
    const tl_node node = things->dragged;
    const int gap = things->gap, count = thing_count(things);
    int from = 0;
    things->dragged = 0;
    if (!node || gap < 0) return;
    mark_gap(things, -1);
    while (from < count && listed(things->v, (size_t)from) != node) from++;
    if (from == count) return; /* it went away meanwhile */
    viewer_select(things->v, node);
    if (gap < from) viewer_node_move(things->v, node, listed(things->v, (size_t)gap));
    if (gap > from + 1) viewer_node_move(things->v, node, listed(things->v, (size_t)gap - 1));
}

static void add_hands(viewer_things *things)
{
    GtkGesture *drag = gtk_gesture_drag_new();
    GtkEventController *keys = gtk_event_controller_key_new();
    gtk_event_controller_set_propagation_phase(GTK_EVENT_CONTROLLER(drag), GTK_PHASE_CAPTURE);
    g_signal_connect(drag, "drag-begin", G_CALLBACK(row_drag_begin), things);
    g_signal_connect(drag, "drag-update", G_CALLBACK(row_drag_update), things);
    g_signal_connect(drag, "drag-end", G_CALLBACK(row_drag_end), things);
    g_signal_connect(keys, "key-pressed", G_CALLBACK(key_pressed), things);
    gtk_widget_add_controller(things->list, GTK_EVENT_CONTROLLER(drag));
    gtk_widget_add_controller(things->list, keys);
}

/* ---- what can be added ---- */

static void add_clicked(GtkButton *button, viewer_things *things)
{
    const tl_node_kind *kind = g_object_get_data(G_OBJECT(button), ROW_KEY);
    gtk_menu_button_popdown(GTK_MENU_BUTTON(things->add));
    viewer_node_add(things->v, *kind);
}

static GtkWidget *add_button(viewer_things *things, const tl_node_kind *kind)
{
    GtkWidget *button = gtk_button_new(), *lines = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    GtkWidget *title = gtk_label_new(viewer_node_title(*kind));
    GtkWidget *help = gtk_label_new(tl_node_kind_help(*kind));
    gtk_label_set_xalign(GTK_LABEL(title), 0);
    gtk_label_set_xalign(GTK_LABEL(help), 0);
    gtk_widget_add_css_class(help, "add-help");
    gtk_box_append(GTK_BOX(lines), title);
    gtk_box_append(GTK_BOX(lines), help);
    gtk_button_set_child(GTK_BUTTON(button), lines);
    gtk_button_set_has_frame(GTK_BUTTON(button), FALSE);
    gtk_widget_set_name(button, tl_node_kind_name(*kind));
    g_object_set_data(G_OBJECT(button), ROW_KEY, (void *)(uintptr_t)kind);
    g_signal_connect(button, "clicked", G_CALLBACK(add_clicked), things);
    return button;
}

static GtkWidget *add_menu(viewer_things *things)
{
    GtkWidget *menu = gtk_menu_button_new(), *popover = gtk_popover_new();
    GtkWidget *column = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    for (int i = 0; i < ADDED_COUNT; i++) {
        if (i == ADDED_GAP)
            gtk_box_append(GTK_BOX(column), gtk_separator_new(GTK_ORIENTATION_HORIZONTAL));
        gtk_box_append(GTK_BOX(column), add_button(things, &ADDED[i]));
    }
    gtk_widget_add_css_class(column, "add-menu");
    gtk_popover_set_child(GTK_POPOVER(popover), column);
    gtk_menu_button_set_popover(GTK_MENU_BUTTON(menu), popover);
    gtk_menu_button_set_label(GTK_MENU_BUTTON(menu), "Add");
    gtk_widget_set_tooltip_text(menu, "Add an isosurface, a slice, streamlines …");
    return menu;
}

/* ---- the panel ---- */

static void remove_clicked(viewer_things *things)
{
    viewer_node_remove_selected(things->v);
}

/* What is added most often, without the menu. */
static void add_quick(viewer_things *things, GtkWidget *row)
{
    static const tl_node_kind QUICK[] = {TL_NODE_SURFACE, TL_NODE_SLICE};
    static const char *const NAMES[] = {"add-surface", "add-slice"};
    for (size_t i = 0; i < G_N_ELEMENTS(QUICK); i++) {
        char *label = g_strdup_printf("+ %s", viewer_node_title(QUICK[i]));
        GtkWidget *button = things->quick[i] = gtk_button_new_with_label(label);
        g_free(label);
        gtk_widget_set_name(button, NAMES[i]);
        g_object_set_data(G_OBJECT(button), ROW_KEY, (void *)(uintptr_t)&QUICK[i]);
        g_signal_connect(button, "clicked", G_CALLBACK(add_clicked), things);
        gtk_box_append(GTK_BOX(row), button);
    }
}

viewer_things *viewer_things_create(viewer *v)
{
    viewer_things *things = g_new0(viewer_things, 1);
    GtkWidget *tools = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 2);
    things->v = v;
    things->box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    things->list = gtk_list_box_new();
    gtk_widget_add_css_class(things->box, "section");
    gtk_widget_add_css_class(things->list, "things");
    gtk_box_append(GTK_BOX(tools), viewer_heading("Shown"));
    things->remove = viewer_icon_button("user-trash-symbolic", "Remove (Delete)");
    g_signal_connect_swapped(things->remove, "clicked", G_CALLBACK(remove_clicked), things);
    gtk_box_append(GTK_BOX(tools), things->remove);
    add_quick(things, tools);
    things->add = add_menu(things);
    gtk_box_append(GTK_BOX(tools), things->add);
    gtk_widget_set_name(things->add, "add");
    gtk_widget_set_name(things->remove, "remove");
    gtk_list_box_set_selection_mode(GTK_LIST_BOX(things->list), GTK_SELECTION_SINGLE);
    g_signal_connect(things->list, "row-selected", G_CALLBACK(row_selected), things);
    add_hands(things);
    gtk_box_append(GTK_BOX(things->box), tools);
    things->scrolled = gtk_scrolled_window_new();
    gtk_scrolled_window_set_policy(GTK_SCROLLED_WINDOW(things->scrolled), GTK_POLICY_NEVER,
                                   GTK_POLICY_AUTOMATIC);
    gtk_scrolled_window_set_propagate_natural_height(GTK_SCROLLED_WINDOW(things->scrolled), TRUE);
    gtk_scrolled_window_set_max_content_height(GTK_SCROLLED_WINDOW(things->scrolled), LIST_HEIGHT);
    gtk_scrolled_window_set_child(GTK_SCROLLED_WINDOW(things->scrolled), things->list);
    gtk_box_append(GTK_BOX(things->box), things->scrolled);
    g_object_set_data_full(G_OBJECT(things->box), "tetralod-things", things, g_free);
    return things;
}

GtkWidget *viewer_things_widget(viewer_things *things)
{
    return things->box;
}
