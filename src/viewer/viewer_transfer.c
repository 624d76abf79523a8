/* The panel of colours: control points to drag, exact values of the selected one, the map, the
 * range, files of ParaView. */
#include "viewer_transfer.h"

#include <string.h>

#include "viewer_core.h"
#include "viewer_field.h"
#include "viewer_maps.h"
#include "viewer_points.h"

enum { ROUND_PX = 1000 };
static const char HINT[] = "Double click adds one";
static const char BY_HAND[] = "by hand";

struct viewer_transfer {
    viewer *v;
    viewer_points *points;
    GtkWidget *box, *heading;
    GtkWidget *hint, *value, *opacity, *color, *remove; /* of the selected point */
    GtkWidget *map, *range_by, *low, *high, *logarithmic;
    GtkWidget *more, *rest; /* rarer properties of the node, while there is one */
    tl_node rest_of;
    bool is_filling;
};

/* Words of range_by for people, in the order of the table. */
static const char *const RANGE_WORDS[] = {"Most values", "All values", "Percentiles", "By hand",
                                          NULL};
enum { RANGE_PERCENT = 2, RANGE_VALUES = 3 };

static tl_node node_of(const viewer_transfer *t)
{
    return tl_scene_transfer_of(t->v->scene, t->points->channel);
}

/* Sets a property of the transfer function as a step of its own. */
static void set_text(viewer_transfer *t, const char *prop, const char *text)
{
    viewer *v = t->v;
    tl_scene_seal(v->scene);
    const tl_node node = viewer_points_begin(t->points);
    if (node) viewer_points_end(t->points, tl_scene_set_text(v->ctx, v->scene, node, prop, text));
    tl_scene_seal(v->scene);
}

/* ---- the selected point ---- */

/* As exact as an eye can tell. */
static void opacity_text(double opacity, char text[VIEWER_NUMBER_BYTES])
{
    g_ascii_formatd(text, VIEWER_NUMBER_BYTES, "%.3g", opacity);
}

static void show_opacity(viewer_transfer *t, double opacity)
{
    char text[VIEWER_NUMBER_BYTES];
    opacity_text(opacity, text);
    viewer_entry_show(t->opacity, text);
}

/* What is written, or the point's where nothing was; false: it is no number. */
static bool take_opacity(viewer_transfer *t, double now, double *opacity)
{
    char text[VIEWER_NUMBER_BYTES];
    opacity_text(now, text);
    *opacity = now;
    return strcmp(viewer_entry_text(t->opacity), text) == 0 ||
           viewer_entry_number(t->opacity, opacity);
}

static void point_selected(void *user)
{
    viewer_transfer *t = user;
    double value, numbers[3];
    if (!t->value) return; /* while the panel is made */
    const bool any = viewer_points_get(t->points, &value, numbers);
    const bool is_color = any && t->points->part == VIEWER_PART_COLOR;
    gtk_widget_set_visible(t->hint, !any);
    gtk_widget_set_visible(t->value, any);
    gtk_widget_set_visible(t->opacity, any && !is_color);
    gtk_widget_set_visible(t->color, is_color);
    gtk_widget_set_visible(t->remove, any);
    gtk_widget_set_sensitive(t->remove, viewer_points_is_removable(t->points));
    if (!any) return;
    viewer_entry_show_number(t->value, value);
    if (!is_color) show_opacity(t, numbers[0]);
    if (is_color) {
        const GdkRGBA rgba = {(float)numbers[0], (float)numbers[1], (float)numbers[2], 1};
        gtk_color_chooser_set_rgba(GTK_COLOR_CHOOSER(t->color), &rgba);
    }
}

/* What a double click on a point asks for: its colour, else its value. */
static void point_exact(void *user)
{
    viewer_transfer *t = user;
    if (t->points->part == VIEWER_PART_COLOR && t->points->own_colors)
        g_signal_emit_by_name(t->color, "activate");
    else
        gtk_widget_grab_focus(t->value);
}

static bool commit_point(void *user)
{
    viewer_transfer *t = user;
    double value, opacity, numbers[3];
    if (!viewer_points_get(t->points, &value, numbers)) return false;
    const bool is_opacity = t->points->part == VIEWER_PART_OPACITY;
    if (!viewer_entry_number(t->value, &value)) return false;
    if (is_opacity && !take_opacity(t, numbers[0], &opacity)) return false;
    tl_scene_seal(t->v->scene);
    viewer_points_set(t->points, value, is_opacity ? &opacity : NULL);
    tl_scene_seal(t->v->scene);
    return true;
}

static void color_chosen(GtkColorButton *button, viewer_transfer *t)
{
    GdkRGBA rgba;
    double value, numbers[3];
    if (!viewer_points_get(t->points, &value, numbers)) return;
    gtk_color_chooser_get_rgba(GTK_COLOR_CHOOSER(button), &rgba);
    const double rgb[3] = {(double)rgba.red, (double)rgba.green, (double)rgba.blue};
    tl_scene_seal(t->v->scene);
    viewer_points_set(t->points, value, rgb);
    tl_scene_seal(t->v->scene);
}

static void remove_point(viewer_transfer *t)
{
    tl_scene_seal(t->v->scene);
    viewer_points_remove(t->points);
    tl_scene_seal(t->v->scene);
}

static GtkWidget *point_row(viewer_transfer *t)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    gtk_widget_add_css_class(row, "point-row");
    t->hint = gtk_label_new(HINT);
    gtk_widget_add_css_class(t->hint, "dim-label");
    gtk_widget_set_hexpand(t->hint, TRUE);
    gtk_label_set_xalign(GTK_LABEL(t->hint), 0);
    t->opacity = viewer_entry_create(6, commit_point, t);
    gtk_widget_set_tooltip_text(t->opacity, "Opacity of the point, 0 to 1");
    t->color = gtk_color_button_new();
    gtk_widget_set_tooltip_text(t->color, "Colour of the point");
    g_signal_connect(t->color, "color-set", G_CALLBACK(color_chosen), t);
    t->remove = viewer_icon_button("user-trash-symbolic", "Remove the point (Delete)");
    g_signal_connect_swapped(t->remove, "clicked", G_CALLBACK(remove_point), t);
    gtk_box_append(GTK_BOX(row), viewer_row_label("Point"));
    gtk_box_append(GTK_BOX(row), t->hint);
    t->value = viewer_entry_create(8, commit_point, t);
    gtk_widget_set_tooltip_text(t->value, "Value of the point");
    gtk_widget_set_hexpand(t->value, TRUE);
    gtk_box_append(GTK_BOX(row), t->value);
    gtk_box_append(GTK_BOX(row), t->opacity);
    gtk_box_append(GTK_BOX(row), t->color);
    gtk_box_append(GTK_BOX(row), t->remove);
    return row;
}

/* ---- maps ---- */

/* Colours by hand go, and the map comes; both are one step. */
static void choose_map(viewer_transfer *t, guint chosen)
{
    viewer *v = t->v;
    const char *const *maps = tl_node_prop(TL_NODE_TRANSFER, "map")->choices;
    tl_scene_seal(v->scene);
    if (!maps[chosen]) {
        viewer_points_own_colors(t->points);
    } else {
        const tl_node node = viewer_points_begin(t->points);
        tl_status st =
            node ? tl_scene_set_text(v->ctx, v->scene, node, "map", maps[chosen]) : TL_OK;
        if (node && !st) st = tl_scene_set_text(v->ctx, v->scene, node, "colors", "auto");
        if (node) viewer_points_end(t->points, st);
    }
    tl_scene_seal(v->scene);
}

static void map_changed(GtkDropDown *drop, GParamSpec *spec, viewer_transfer *t)
{
    (void)spec;
    const guint chosen = gtk_drop_down_get_selected(drop);
    if (!t->is_filling && chosen != GTK_INVALID_LIST_POSITION) choose_map(t, chosen);
}

void viewer_transfer_reverse(viewer_transfer *t)
{
    const tl_node node = node_of(t);
    if (!*t->points->channel) return;
    if (t->points->own_colors) {
        tl_scene_seal(t->v->scene);
        viewer_points_mirror(t->points);
        tl_scene_seal(t->v->scene);
    } else {
        set_text(t, "reversed",
                 node && tl_scene_flag(t->v->scene, node, "reversed") ? "off" : "on");
    }
}

static GtkWidget *map_row(viewer_transfer *t)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    t->map = viewer_maps_create(BY_HAND);
    gtk_widget_set_hexpand(t->map, TRUE);
    gtk_widget_set_name(t->map, "map");
    g_signal_connect(t->map, "notify::selected", G_CALLBACK(map_changed), t);
    GtkWidget *reverse =
        viewer_icon_button("object-flip-horizontal-symbolic", "Reverse the colours");
    g_signal_connect_swapped(reverse, "clicked", G_CALLBACK(viewer_transfer_reverse), t);
    gtk_box_append(GTK_BOX(row), viewer_row_label("Map"));
    gtk_box_append(GTK_BOX(row), t->map);
    gtk_box_append(GTK_BOX(row), reverse);
    return row;
}

/* ---- range ---- */

static void range_by_changed(GtkDropDown *drop, GParamSpec *spec, viewer_transfer *t)
{
    (void)spec;
    const guint chosen = gtk_drop_down_get_selected(drop);
    if (t->is_filling || chosen == GTK_INVALID_LIST_POSITION) return;
    if (chosen == RANGE_VALUES) { /* those that are shown now */
        const double range[2] = {t->points->range[0], t->points->range[1]};
        tl_scene_seal(t->v->scene);
        viewer_points_set_range(t->points, range);
        tl_scene_seal(t->v->scene);
    } else {
        set_text(t, "range_by", tl_node_prop(TL_NODE_TRANSFER, "range_by")->choices[chosen]);
    }
}

static bool is_percent(const viewer_transfer *t)
{
    return gtk_drop_down_get_selected(GTK_DROP_DOWN(t->range_by)) == RANGE_PERCENT;
}

static bool commit_range(void *user)
{
    viewer_transfer *t = user;
    viewer *v = t->v;
    double ends[2];
    GtkWidget *const entries[2] = {t->low, t->high};
    bool good = true;
    for (int i = 0; i < 2; i++) {
        const bool number = viewer_entry_number(entries[i], &ends[i]);
        good = good && number;
    }
    good =
        good && ends[0] < ends[1] && !(t->points->logarithmic && !is_percent(t) && !(ends[0] > 0));
    for (int i = 0; i < 2; i++)
        if (good)
            gtk_widget_remove_css_class(entries[i], "error");
        else
            gtk_widget_add_css_class(entries[i], "error");
    if (!good) return false;
    tl_scene_seal(v->scene);
    if (is_percent(t)) {
        const tl_node node = viewer_points_begin(t->points);
        if (node)
            viewer_points_end(t->points,
                              tl_scene_set_reals(v->ctx, v->scene, node, "percent", ends, 2));
    } else {
        viewer_points_set_range(t->points, ends);
    }
    tl_scene_seal(v->scene);
    return true;
}

static void logarithmic_changed(GtkCheckButton *button, viewer_transfer *t)
{
    if (!t->is_filling)
        set_text(t, "logarithmic", gtk_check_button_get_active(button) ? "on" : "off");
}

static GtkWidget *range_row(viewer_transfer *t)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    t->range_by = viewer_drop_create(RANGE_WORDS);
    g_signal_connect(t->range_by, "notify::selected", G_CALLBACK(range_by_changed), t);
    t->logarithmic = gtk_check_button_new_with_label("log");
    gtk_widget_set_tooltip_text(t->logarithmic, "Colours by the logarithm of the value");
    g_signal_connect(t->logarithmic, "toggled", G_CALLBACK(logarithmic_changed), t);
    gtk_box_append(GTK_BOX(row), viewer_row_label("Range"));
    gtk_box_append(GTK_BOX(row), t->range_by);
    gtk_box_append(GTK_BOX(row), t->logarithmic);
    return row;
}

static GtkWidget *ends_row(viewer_transfer *t)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    t->low = viewer_entry_create(8, commit_range, t);
    gtk_widget_set_name(t->low, "low");
    t->high = viewer_entry_create(8, commit_range, t);
    gtk_widget_set_hexpand(t->low, TRUE);
    gtk_widget_set_hexpand(t->high, TRUE);
    gtk_box_append(GTK_BOX(row), viewer_row_label(""));
    gtk_box_append(GTK_BOX(row), t->low);
    gtk_box_append(GTK_BOX(row), gtk_label_new("–"));
    gtk_box_append(GTK_BOX(row), t->high);
    return row;
}

/* ---- files, reset ---- */

void viewer_transfer_reset(viewer_transfer *t)
{
    viewer *v = t->v;
    const tl_node node = node_of(t);
    if (!node) return;
    tl_scene_seal(v->scene);
    viewer_ok(v, tl_scene_remove(v->ctx, v->scene, node));
    viewer_changed(v);
}

void viewer_transfer_toggle_counts(viewer_transfer *t)
{
    t->points->logarithmic_counts = !t->points->logarithmic_counts;
    gtk_widget_queue_draw(t->points->area);
}

static void import_chosen(GtkNativeDialog *dialog, int response, viewer_transfer *t)
{
    viewer *v = t->v;
    char *path = response == GTK_RESPONSE_ACCEPT ? viewer_dialog_path(dialog) : NULL;
    if (path) {
        tl_scene_seal(v->scene);
        const tl_node node = viewer_points_begin(t->points);
        if (node) viewer_points_end(t->points, tl_transfer_read(v->ctx, v->scene, node, path));
        tl_scene_seal(v->scene);
    }
    g_free(path);
    g_object_unref(dialog);
}

/* What is used now, as the picture has it. */
static tl_status write_points(viewer_transfer *t, const char *path)
{
    const viewer_points *points = t->points;
    tl_status st = TL_OK;
    tl_control_points out = {.color_count = points->colors.count,
                             .opacity_count = points->opacities.count,
                             .logarithmic = points->logarithmic};
    out.colors = tl_mem_alloc(t->v->ctx, out.color_count, sizeof *out.colors, &st);
    out.opacities = tl_mem_alloc(t->v->ctx, out.opacity_count, sizeof *out.opacities, &st);
    for (size_t i = 0; !st && i < out.color_count; i++) {
        const double *row = viewer_curve_row_const(&points->colors, i);
        out.colors[i] = (tl_color_point){row[0], {row[1], row[2], row[3]}};
    }
    for (size_t i = 0; !st && i < out.opacity_count; i++) {
        const double *row = viewer_curve_row_const(&points->opacities, i);
        out.opacities[i] = (tl_opacity_point){row[0], row[1]};
    }
    if (!st) st = tl_control_points_write(t->v->ctx, path, points->channel, &out);
    tl_mem_free(t->v->ctx, out.opacities);
    tl_mem_free(t->v->ctx, out.colors);
    return st;
}

static void export_chosen(GtkNativeDialog *dialog, int response, viewer_transfer *t)
{
    char *path = response == GTK_RESPONSE_ACCEPT ? viewer_dialog_path(dialog) : NULL;
    if (path && viewer_ok(t->v, write_points(t, path)))
        viewer_say(t->v, VIEWER_INFO, "The colours of %s are in %s", t->points->channel, path);
    g_free(path);
    g_object_unref(dialog);
}

static void ask_file(viewer_transfer *t, GtkFileChooserAction action, const char *title,
                     const char *accept, const char *name, GCallback chosen)
{
    if (!*t->points->channel) return;
    GtkFileChooserNative *dialog = viewer_dialog(t->v, title, accept, action, name, NULL);
    GtkFileFilter *filter = gtk_file_filter_new();
    gtk_file_filter_set_name(filter, "Colour maps of ParaView (*.json)");
    gtk_file_filter_add_pattern(filter, "*.json");
    gtk_file_chooser_add_filter(GTK_FILE_CHOOSER(dialog), filter);
    g_object_unref(filter);
    g_signal_connect(dialog, "response", chosen, t);
    gtk_native_dialog_show(GTK_NATIVE_DIALOG(dialog));
}

void viewer_transfer_import(viewer_transfer *t)
{
    ask_file(t, GTK_FILE_CHOOSER_ACTION_OPEN, "Import colours", "_Import", NULL,
             G_CALLBACK(import_chosen));
}

void viewer_transfer_export(viewer_transfer *t)
{
    ask_file(t, GTK_FILE_CHOOSER_ACTION_SAVE, "Export colours", "_Export", "colours.json",
             G_CALLBACK(export_chosen));
}

/* ---- the panel ---- */

static void show_heading(viewer_transfer *t)
{
    const tl_frame *frame = t->v->frame;
    const tl_values *values =
        frame && frame->content ? tl_content_values(frame->content, t->points->channel) : NULL;
    char *text = g_strdup_printf("Colours of %s", values ? values->title : t->points->channel);
    gtk_label_set_text(GTK_LABEL(t->heading), text);
    g_free(text);
}

static void show_range(viewer_transfer *t, tl_node node)
{
    const guint by = node ? (guint)tl_scene_real(t->v->scene, node, "range_by") : 0;
    tl_value percent;
    const double *ends = t->points->range;
    gtk_drop_down_set_selected(GTK_DROP_DOWN(t->range_by),
                               t->points->own_colors ? RANGE_VALUES : by);
    if (!t->points->own_colors && by == RANGE_PERCENT &&
        !tl_scene_get(t->v->ctx, t->v->scene, node, "percent", &percent))
        ends = percent.reals;
    /* automatic ends are said as roughly as their place can be told */
    const viewer_axis axis = {{t->points->range[0], t->points->range[1]}, false, 0, ROUND_PX};
    const bool rough = ends == t->points->range && by != RANGE_VALUES && ends[0] < ends[1];
    viewer_entry_show_number(t->low, rough ? viewer_axis_round(&axis, ends[0]) : ends[0]);
    viewer_entry_show_number(t->high, rough ? viewer_axis_round(&axis, ends[1]) : ends[1]);
    gtk_widget_remove_css_class(t->low, "error");
    gtk_widget_remove_css_class(t->high, "error");
}

/* Has widgets of its own above. */
static bool is_above(const char *prop)
{
    static const char *const ABOVE[] = {"channel", "map",     "reversed", "logarithmic", "range_by",
                                        "range",   "percent", "colors",   "opacities"};
    for (size_t i = 0; i < G_N_ELEMENTS(ABOVE); i++)
        if (strcmp(ABOVE[i], prop) == 0) return true;
    return false;
}

static void show_rest(viewer_transfer *t, tl_node node)
{
    size_t count;
    const tl_prop_info *props = tl_node_props(TL_NODE_TRANSFER, &count);
    gtk_widget_set_visible(t->more, node != 0);
    if (node == t->rest_of) {
        viewer_fields_refresh(t->rest);
        return;
    }
    t->rest_of = node;
    viewer_clear_box(t->rest);
    for (size_t i = 0; node && i < count; i++)
        if (!is_above(props[i].name))
            gtk_box_append(GTK_BOX(t->rest), viewer_field_create(t->v, node, props[i].name));
}

void viewer_transfer_show(viewer_transfer *t, const char *channel)
{
    gtk_widget_set_visible(t->box, *channel != '\0');
    viewer_points_show(t->points, channel);
    if (!*channel) {
        show_rest(t, 0);
        return;
    }
    const tl_node node = node_of(t);
    const char *const *maps = tl_node_prop(TL_NODE_TRANSFER, "map")->choices;
    guint own = 0;
    while (maps[own]) own++;
    t->is_filling = true;
    gtk_drop_down_set_selected(GTK_DROP_DOWN(t->map),
                               t->points->own_colors ? own
                               : node ? (guint)tl_scene_real(t->v->scene, node, "map")
                                      : 0);
    gtk_check_button_set_active(GTK_CHECK_BUTTON(t->logarithmic),
                                node && tl_scene_flag(t->v->scene, node, "logarithmic"));
    show_range(t, node);
    show_heading(t);
    show_rest(t, node);
    t->is_filling = false;
}

static GtkWidget *heading_row(viewer_transfer *t)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6), *menu = gtk_menu_button_new();
    GMenu *entries = g_menu_new();
    g_menu_append(entries, "Automatic Again", "win.colours-reset");
    g_menu_append(entries, "Linear or Logarithmic Counts", "win.colours-counts");
    g_menu_append(entries, "Import…", "win.colours-import");
    g_menu_append(entries, "Export…", "win.colours-export");
    gtk_menu_button_set_menu_model(GTK_MENU_BUTTON(menu), G_MENU_MODEL(entries));
    g_object_unref(entries);
    gtk_menu_button_set_icon_name(GTK_MENU_BUTTON(menu), "view-more-symbolic");
    gtk_menu_button_set_has_frame(GTK_MENU_BUTTON(menu), FALSE);
    gtk_widget_set_tooltip_text(menu, "Reset, import, export");
    t->heading = viewer_heading("Colours");
    gtk_box_append(GTK_BOX(row), t->heading);
    gtk_box_append(GTK_BOX(row), menu);
    return row;
}

viewer_transfer *viewer_transfer_create(viewer *v)
{
    viewer_transfer *t = g_new0(viewer_transfer, 1);
    t->v = v;
    t->box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    gtk_widget_add_css_class(t->box, "section");
    t->points = viewer_points_create(v, point_selected, point_exact, t);
    gtk_box_append(GTK_BOX(t->box), heading_row(t));
    gtk_box_append(GTK_BOX(t->box), t->points->zoom.box);
    gtk_box_append(GTK_BOX(t->box), point_row(t));
    gtk_box_append(GTK_BOX(t->box), map_row(t));
    gtk_box_append(GTK_BOX(t->box), range_row(t));
    gtk_box_append(GTK_BOX(t->box), ends_row(t));
    t->rest = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    t->more = gtk_expander_new("More");
    gtk_expander_set_child(GTK_EXPANDER(t->more), t->rest);
    gtk_box_append(GTK_BOX(t->box), t->more);
    g_object_set_data_full(G_OBJECT(t->box), "tetralod-transfer", t, g_free);
    return t;
}

GtkWidget *viewer_transfer_widget(viewer_transfer *t)
{
    return t->box;
}
