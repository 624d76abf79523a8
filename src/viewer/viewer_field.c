/* Editors of properties, from the scene's table: what they are called, what is set, what a scene
 * refuses; those that are a switch, words, or a colour. */
#include "viewer_field.h"
#include "viewer_histogram.h"

#include <string.h>

static const char DATA_KEY[] = "tetralod-field";

/* What the table does not say, as it is about people and not about scenes. */
static const viewer_field_style STYLES[] = {
    {"error", "Channel error", 0, 0, "no bound"},
    {"error_channel", "… of", 0, 0, "channels shown"},
    {"space_error", "Isosurfaces", 0, 0, "no bound"},
    {"boundary_error", "Boundary", 0, 0, "no bound"},
    {"tets", "Most tets", 1e4, 1e8, "no limit"},
    {"moving_tets", "While moving", 1e4, 1e7, "automatic"},
    {"frame_s", "Frame time", 0.016, 1, NULL},
    {"ram_bytes", "Memory", 1e8, 6.4e10, "automatic"},
    {"card_bytes", "Card memory", 1e8, 2.5e10, "automatic"},
    {"frozen", "Freeze", 0, 0, NULL},
    {"focus", "Finer in a box", 0, 0, NULL},
    {"focus_box", "… the box", 0, 0, "the middle"},
    {"focus_gain", "… by a factor", 1, 64, NULL},
    {"color", "Colour", 0, 0, "automatic"},
    {"color_by", "Colour by", 0, 0, "one colour"},
    {"background", "Background", 0, 0, "transparent"},
    {"nan_color", "No value", 0, 0, "grey"},
    {"unit_distance", "Unit distance", 0, 0, "automatic"},
    {"samples", "Smoothing", 0, 4, "automatic"},
    {"lit", "Light", 0, 0, NULL},
    {"gradient_opacity", "Gradient", 0, 0, "everywhere"},
    {"gradient_percent", "in percent", 0, 0, NULL},
    {"mark", "Show", 0, 0, NULL},
    {"on", "Active", 0, 0, NULL},
    {"low", "From", 0, 0, "any"},
    {"high", "To", 0, 0, "any"},
    {"text", "Formula", 0, 0, NULL},
    {"width_px", "Width", 0.5, 8, NULL},
    {"halo_px", "Halo", 0, 10, "none"},
    {"radius_px", "Radius", 0.5, 8, NULL},
    {"count", "Points", 1e3, 1e7, NULL},
    {"shells", "Shells", 0, 32, NULL},
    {"dash", "Dashes", 0, 10, "none"},
    {"arrows", "Arrows", 0, 20, "none"},
    {"speed", "Speed", -3, 3, "still"},
    {"has_box", "Select by box", 0, 0, NULL},
    {"regions", "Regions", 0, 0, "all"},
    {"hide_regions", "Hide", 0, 0, "none"},
    {"title", "Title", 0, 0, "none"},
    {"bar", "Scalar bars", 0, 0, NULL},
};

/* Properties of one kind of nodes that mean something else there. */
static const struct {
    tl_node_kind kind;
    viewer_field_style style;
} SPECIAL[] = {
    {TL_NODE_BOUNDARY, {"opacity", "Opacity", 0, 1, "automatic"}},
    {TL_NODE_SURFACE, {"color", "Colour", 0, 0, "that of its value"}},
    {TL_NODE_LINES, {"color_by", "Colour by", 0, 0, "their speed"}},
    {TL_NODE_LINES, {"box", "… the box", 0, 0, "the middle"}},
    {TL_NODE_PICTURE, {"box", "Outline", 0, 0, NULL}},
};

/* ---- changes ---- */

bool viewer_field_set_text(viewer_field *field, const char *text)
{
    viewer *v = field->v;
    const tl_status st = tl_scene_set_text(v->ctx, v->scene, field->node, field->info->name, text);
    return viewer_settle(v, st, field->main, field->error);
}

bool viewer_field_set_reals(viewer_field *field, const double *reals, size_t count)
{
    viewer *v = field->v;
    const tl_status st =
        tl_scene_set_reals(v->ctx, v->scene, field->node, field->info->name, reals, count);
    return viewer_settle(v, st, field->main, field->error);
}

/* A change that stands for itself: no part of the step before or behind it. */
static void set_alone(viewer_field *field, const char *text)
{
    tl_scene_seal(field->v->scene);
    viewer_field_set_text(field, text);
    tl_scene_seal(field->v->scene);
}

static void reset(viewer_field *field)
{
    set_alone(field, *field->info->preset ? field->info->preset : "auto");
}

/* ---- switches, words, colours ---- */

static void fill_flag(viewer_field *field)
{
    gtk_switch_set_active(GTK_SWITCH(field->main),
                          tl_scene_flag(field->v->scene, field->node, field->info->name));
}

static gboolean flag_changed(GtkSwitch *button, gboolean state, viewer_field *field)
{
    (void)button;
    if (!field->is_filling) set_alone(field, state ? "on" : "off");
    return FALSE;
}

static void add_flag(viewer_field *field, GtkWidget *row)
{
    field->main = gtk_switch_new();
    field->fill = fill_flag;
    gtk_widget_set_valign(field->main, GTK_ALIGN_CENTER);
    gtk_widget_set_halign(field->main, GTK_ALIGN_START);
    gtk_widget_set_hexpand(field->main, TRUE);
    g_signal_connect(field->main, "state-set", G_CALLBACK(flag_changed), field);
    gtk_box_append(GTK_BOX(row), field->main);
}

static void fill_choice(viewer_field *field)
{
    gtk_drop_down_set_selected(
        GTK_DROP_DOWN(field->main),
        (guint)tl_scene_real(field->v->scene, field->node, field->info->name));
}

static void choice_changed(GtkDropDown *drop, GParamSpec *spec, viewer_field *field)
{
    (void)spec;
    const guint chosen = gtk_drop_down_get_selected(drop);
    if (!field->is_filling && chosen != GTK_INVALID_LIST_POSITION)
        set_alone(field, field->info->choices[chosen]);
}

static void add_choice(viewer_field *field, GtkWidget *row)
{
    field->main = viewer_drop_create(field->info->choices);
    field->fill = fill_choice;
    g_signal_connect(field->main, "notify::selected", G_CALLBACK(choice_changed), field);
    gtk_box_append(GTK_BOX(row), field->main);
}

static void fill_text(viewer_field *field)
{
    viewer_entry_show(field->main, tl_scene_text(field->v->scene, field->node, field->info->name));
}

static bool commit_text(void *user)
{
    viewer_field *field = user;
    tl_scene_seal(field->v->scene);
    return viewer_field_set_text(field, viewer_entry_text(field->main));
}

static void add_text(viewer_field *field, GtkWidget *row)
{
    field->main = viewer_entry_create(8, commit_text, field);
    field->fill = fill_text;
    gtk_widget_set_hexpand(field->main, TRUE);
    if (field->style.empty)
        gtk_entry_set_placeholder_text(GTK_ENTRY(field->main), field->style.empty);
    gtk_box_append(GTK_BOX(row), field->main);
}

/* The colour that an isosurface has by its value; false: it is none, or not known yet. */
static bool value_color(const viewer_field *field, double rgb[3])
{
    viewer *v = field->v;
    tl_value value;
    const tl_content *content = v->frame ? v->frame->content : NULL;
    const tl_values *values =
        content ? tl_content_values(content, tl_scene_text(v->scene, field->node, "channel"))
                : NULL;
    if (!values || tl_scene_kind(v->scene, field->node) != TL_NODE_SURFACE ||
        tl_scene_get(v->ctx, v->scene, field->node, "value", &value) || !value.count)
        return false;
    viewer_curve *curve = g_new0(viewer_curve, 1);
    viewer_colors_take(curve, values->colors, values->color_count);
    viewer_curve_at(curve, values->logarithmic, value.reals[0], rgb);
    g_free(curve);
    return values->color_count > 0;
}

/* Without effect where a channel colours. */
static void fill_color(viewer_field *field)
{
    viewer *v = field->v;
    tl_value value;
    double rgb[3] = {0.5, 0.5, 0.5};
    const bool set =
        !tl_scene_get(v->ctx, v->scene, field->node, field->info->name, &value) && value.count == 3;
    if (set) memcpy(rgb, value.reals, sizeof rgb);
    const bool known = set || value_color(field, rgb);
    const GdkRGBA rgba = {(float)rgb[0], (float)rgb[1], (float)rgb[2], 1};
    const bool by_channel = strcmp(field->info->name, "color") == 0 &&
                            *tl_scene_text(v->scene, field->node, "color_by");
    gtk_color_chooser_set_rgba(GTK_COLOR_CHOOSER(field->main), &rgba);
    gtk_widget_set_opacity(field->main, known ? 1 : 0.5);
    gtk_widget_set_sensitive(field->main, !by_channel);
    GtkWidget *word = gtk_widget_get_next_sibling(field->main);
    gtk_label_set_text(GTK_LABEL(word), by_channel                   ? "those of the channel"
                                        : set || !field->style.empty ? ""
                                                                     : field->style.empty);
}

static void color_changed(GtkColorButton *button, viewer_field *field)
{
    GdkRGBA rgba;
    gtk_color_chooser_get_rgba(GTK_COLOR_CHOOSER(button), &rgba);
    const double reals[3] = {(double)rgba.red, (double)rgba.green, (double)rgba.blue};
    tl_scene_seal(field->v->scene);
    viewer_field_set_reals(field, reals, 3);
}

static void add_color(viewer_field *field, GtkWidget *row)
{
    field->main = gtk_color_button_new();
    field->fill = fill_color;
    GtkWidget *word = gtk_label_new(NULL);
    gtk_widget_add_css_class(word, "dim-label");
    gtk_label_set_xalign(GTK_LABEL(word), 0);
    gtk_widget_set_hexpand(word, TRUE);
    g_signal_connect(field->main, "color-set", G_CALLBACK(color_changed), field);
    gtk_box_append(GTK_BOX(row), field->main);
    gtk_box_append(GTK_BOX(row), word);
}

/* ---- rows ---- */

static void add_editor(viewer_field *field, GtkWidget *row)
{
    switch (field->info->type) {
    case TL_PROP_FLAG: add_flag(field, row); break;
    case TL_PROP_CHOICE: add_choice(field, row); break;
    case TL_PROP_COLOR: add_color(field, row); break;
    case TL_PROP_CHANNEL: viewer_field_add_channel(field, row); break;
    case TL_PROP_COUNT: viewer_field_add_number(field, row); break;
    case TL_PROP_REAL: /* one, or several beside each other */
        if (field->info->count == 1)
            viewer_field_add_number(field, row);
        else
            viewer_field_add_place(field, row);
        break;
    case TL_PROP_POINT:
    case TL_PROP_BOX: viewer_field_add_place(field, row); break;
    case TL_PROP_PLANE: viewer_field_add_plane(field, row); break;
    case TL_PROP_TEXT:
    case TL_PROP_LIST: add_text(field, row); break;
    }
}

static viewer_field_style style_of(tl_node_kind kind, const char *prop)
{
    for (size_t i = 0; i < sizeof SPECIAL / sizeof *SPECIAL; i++)
        if (SPECIAL[i].kind == kind && strcmp(SPECIAL[i].style.prop, prop) == 0)
            return SPECIAL[i].style;
    for (size_t i = 0; i < sizeof STYLES / sizeof *STYLES; i++)
        if (strcmp(STYLES[i].prop, prop) == 0) return STYLES[i];
    return (viewer_field_style){.prop = prop};
}

/* "view_angle" to "View angle". */
static char *label_of(const viewer_field *field)
{
    char *text = g_strdup(field->style.label ? field->style.label : field->info->name);
    if (!field->style.label) text[0] = g_ascii_toupper(text[0]);
    for (char *c = text; *c; c++)
        if (*c == '_') *c = ' ';
    return text;
}

/* Switches and words are as easily set by themselves. */
static bool has_reset(tl_prop_type type)
{
    return type != TL_PROP_FLAG && type != TL_PROP_CHOICE && type != TL_PROP_CHANNEL &&
           type != TL_PROP_TEXT;
}

static void field_free(viewer_field *field)
{
    if (field->names) g_ptr_array_unref(field->names);
    g_free(field);
}

GtkWidget *viewer_field_create(viewer *v, tl_node node, const char *prop)
{
    viewer_field *field = g_new0(viewer_field, 1);
    char slider[64];
    g_snprintf(slider, sizeof slider, "%s-slider", prop);
    field->v = v;
    field->node = node;
    field->info = tl_node_prop(tl_scene_kind(v->scene, node), prop);
    g_assert(field->info);
    field->style = style_of(tl_scene_kind(v->scene, node), prop);
    field->box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    char *label = label_of(field);
    GtkWidget *word = viewer_row_label(label);
    g_free(label);
    gtk_widget_set_tooltip_text(word, field->info->help); /* not over what one works on */
    gtk_box_append(GTK_BOX(row), word);
    add_editor(field, row);
    field->reset = viewer_icon_button("edit-undo-symbolic", "As it was at first");
    gtk_widget_add_css_class(field->reset, "reset");
    g_signal_connect_swapped(field->reset, "clicked", G_CALLBACK(reset), field);
    gtk_box_append(GTK_BOX(row), field->reset);
    gtk_widget_set_visible(field->reset, has_reset(field->info->type));
    field->error = viewer_error_line();
    gtk_box_append(GTK_BOX(field->box), row);
    gtk_box_append(GTK_BOX(field->box), field->error);
    gtk_widget_set_name(field->main, prop);
    if (field->slider) gtk_widget_set_name(field->slider, slider);
    g_object_set_data_full(G_OBJECT(field->box), DATA_KEY, field, (GDestroyNotify)field_free);
    viewer_field_refresh(field->box);
    return field->box;
}

/* ---- what the scene says ---- */

static bool is_preset(const viewer_field *field)
{
    char text[TL_SCENE_TEXT_BYTES];
    tl_value value;
    if (tl_scene_get(field->v->ctx, field->v->scene, field->node, field->info->name, &value))
        return true;
    if (!*field->info->preset) return value.text ? !*value.text : value.count == 0;
    tl_scene_print(field->v->scene, field->node, field->info->name, text, sizeof text);
    return strcmp(text, field->info->preset) == 0;
}

void viewer_field_refresh(GtkWidget *box)
{
    viewer_field *field = g_object_get_data(G_OBJECT(box), DATA_KEY);
    if (!field || tl_scene_kind(field->v->scene, field->node) == TL_NODE_KIND_COUNT) return;
    const bool preset = is_preset(field);
    field->is_filling = true;
    field->fill(field);
    field->is_filling = false;
    viewer_mark_wrong(field->main, field->error, NULL);
    /* it keeps its room, so that nothing moves */
    gtk_widget_set_opacity(field->reset, preset ? 0 : 1);
    gtk_widget_set_sensitive(field->reset, !preset);
}

void viewer_fields_refresh(GtkWidget *box)
{
    for (GtkWidget *child = gtk_widget_get_first_child(box); child;
         child = gtk_widget_get_next_sibling(child))
        if (g_object_get_data(G_OBJECT(child), DATA_KEY)) viewer_field_refresh(child);
}
