/* The bound of the error in pixels. At the fine end of its slider stands what people look for
 * there, the exact mesh (`detail.full`). No bound at all, `detail.error_px` 0, is no place of the
 * slider: it has a switch with its name. */
#include "viewer_bound.h"

#include <math.h>

#include "viewer_curve.h"
#include "viewer_widgets.h"

/* Places of the slider: 0 exact, a gap, then pixels from FINEST to COARSEST. */
enum { PLACES = 200, GAP = 24, KEY_STEP = 15 };
enum { WORD_TOP = 4 };
static const double FINEST = 0.25, COARSEST = 64;
static const char EXACT[] = "exact";

struct viewer_bound {
    viewer *v;
    GtkWidget *box, *slider, *entry, *unit, *error, *none_row, *none;
    bool is_filling;
};

static const tl_node NODE = TL_NODE_DETAIL + 1;

static viewer_axis axis(void)
{
    return (viewer_axis){{FINEST, COARSEST}, true, GAP, PLACES - GAP};
}

/* ---- changes ---- */

/* Both properties in one step: pixels 0 and not full: no bound. */
static bool set_bound(viewer_bound *b, bool full, double pixels)
{
    viewer *v = b->v;
    tl_status st = tl_scene_begin(v->ctx, v->scene, "level of detail");
    if (st) return viewer_settle(v, st, b->entry, b->error);
    st = tl_scene_set_flag(v->ctx, v->scene, NODE, "full", full);
    if (!st && !full) st = tl_scene_set_real(v->ctx, v->scene, NODE, "error_px", pixels);
    /* a refusal is said at the entry, and its words are the context's until then */
    const bool taken = viewer_settle(v, st, b->entry, b->error);
    viewer_ok(v, tl_scene_end(v->ctx, v->scene, taken));
    return taken;
}

static void set_alone(viewer_bound *b, bool full, double pixels)
{
    tl_scene_seal(b->v->scene);
    set_bound(b, full, pixels);
    tl_scene_seal(b->v->scene);
}

static gboolean slid(GtkRange *slider, GtkScrollType scroll, double at, viewer_bound *b)
{
    const viewer_axis pixels = axis();
    const double place = fmin(fmax(at, GAP), PLACES);
    (void)slider;
    (void)scroll;
    set_bound(b, at < GAP / 2.0, viewer_axis_round(&pixels, viewer_axis_value(&pixels, place)));
    viewer_bound_refresh(b);
    return TRUE; /* the slider stands where the value is */
}

/* Pixels, or a word; nothing is no bound. */
static bool commit(void *user)
{
    viewer_bound *b = user;
    double pixels;
    char *text = g_strstrip(g_ascii_strdown(viewer_entry_text(b->entry), -1));
    tl_scene_seal(b->v->scene);
    bool taken = false;
    if (viewer_entry_number(b->entry, &pixels))
        taken = set_bound(b, pixels == 0, pixels);
    else if (g_str_equal(text, EXACT))
        taken = set_bound(b, true, 0);
    else
        viewer_mark_wrong(b->entry, b->error, "expected pixels, as 0.5, or exact");
    tl_scene_seal(b->v->scene);
    g_free(text);
    return taken;
}

static gboolean none_set(GtkSwitch *button, gboolean state, viewer_bound *b)
{
    (void)button;
    if (!b->is_filling) set_alone(b, false, state ? 0 : 1);
    return FALSE;
}

/* ---- what the scene says ---- */

void viewer_bound_refresh(viewer_bound *b)
{
    const viewer_axis pixels = axis();
    const bool full = tl_scene_flag(b->v->scene, NODE, "full");
    const double px = tl_scene_real(b->v->scene, NODE, "error_px");
    const bool none = !full && px == 0;
    const double place = viewer_axis_px(&pixels, px);
    b->is_filling = true;
    gtk_switch_set_active(GTK_SWITCH(b->none), none);
    gtk_range_set_value(GTK_RANGE(b->slider), full   ? 0
                                              : none ? PLACES
                                                     : fmin(fmax(place, GAP), PLACES));
    b->is_filling = false;
    gtk_widget_set_opacity(b->slider, none ? 0.4 : 1);
    gtk_widget_set_opacity(b->unit, full || none ? 0 : 1);
    if (full || none)
        viewer_entry_show(b->entry, full ? EXACT : "no bound");
    else
        viewer_entry_show_number(b->entry, px);
    viewer_mark_wrong(b->entry, b->error, NULL);
}

/* ---- the control ---- */

static GtkWidget *caption(const char *text, GtkAlign align)
{
    GtkWidget *label = gtk_label_new(text);
    gtk_widget_set_halign(label, align);
    gtk_widget_set_hexpand(label, TRUE);
    gtk_widget_add_css_class(label, "caption-small");
    return label;
}

/* What its ends are stands below it: marks of GTK's own would draw the knob to them. */
static GtkWidget *make_slider(viewer_bound *b)
{
    GtkAdjustment *places = gtk_adjustment_new(0, 0, PLACES, KEY_STEP, KEY_STEP, 0);
    GtkWidget *column = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    GtkWidget *ends = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 0);
    b->slider = gtk_scale_new(GTK_ORIENTATION_HORIZONTAL, places);
    gtk_scale_set_draw_value(GTK_SCALE(b->slider), FALSE);
    gtk_widget_set_hexpand(b->slider, TRUE);
    gtk_widget_set_name(b->slider, "error_px-slider");
    gtk_accessible_update_property(GTK_ACCESSIBLE(b->slider), GTK_ACCESSIBLE_PROPERTY_LABEL,
                                   "Error in pixels", -1);
    g_signal_connect(b->slider, "change-value", G_CALLBACK(slid), b);
    viewer_watch_gesture(b->v, b->slider);
    gtk_box_append(GTK_BOX(ends), caption(EXACT, GTK_ALIGN_START));
    gtk_box_append(GTK_BOX(ends), caption("coarse, fast", GTK_ALIGN_END));
    gtk_box_append(GTK_BOX(column), b->slider);
    gtk_box_append(GTK_BOX(column), ends);
    return column;
}

static GtkWidget *make_switch(viewer_bound *b)
{
    b->none_row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    b->none = gtk_switch_new();
    gtk_widget_set_name(b->none, "no-bound");
    gtk_widget_set_halign(b->none, GTK_ALIGN_START);
    gtk_widget_set_valign(b->none, GTK_ALIGN_CENTER);
    g_signal_connect(b->none, "state-set", G_CALLBACK(none_set), b);
    GtkWidget *label = viewer_row_label("No pixel bound");
    gtk_widget_set_tooltip_text(label, "The other bounds and budgets alone say how fine it is");
    gtk_box_append(GTK_BOX(b->none_row), label);
    gtk_box_append(GTK_BOX(b->none_row), b->none);
    return b->none_row;
}

viewer_bound *viewer_bound_create(viewer *v)
{
    viewer_bound *b = g_new0(viewer_bound, 1);
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    GtkWidget *label = viewer_row_label("Error");
    b->v = v;
    b->box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    gtk_widget_set_name(label, "error_px-word");
    gtk_widget_set_tooltip_text(label, "By how many pixels what is seen may be off");
    gtk_box_append(GTK_BOX(row), label);
    gtk_box_append(GTK_BOX(row), make_slider(b));
    b->entry = viewer_entry_create(7, commit, b);
    gtk_widget_set_name(b->entry, "error_px");
    b->unit = gtk_label_new("px");
    gtk_widget_add_css_class(b->unit, "dim-label");
    gtk_box_append(GTK_BOX(row), b->entry);
    gtk_box_append(GTK_BOX(row), b->unit);
    /* at the height of the entry, not of slider and words */
    gtk_widget_set_valign(b->entry, GTK_ALIGN_START);
    gtk_widget_set_valign(label, GTK_ALIGN_START);
    gtk_widget_set_valign(b->unit, GTK_ALIGN_START);
    gtk_widget_set_margin_top(label, WORD_TOP);
    gtk_widget_set_margin_top(b->unit, WORD_TOP);
    b->error = viewer_error_line();
    gtk_box_append(GTK_BOX(b->box), row);
    gtk_box_append(GTK_BOX(b->box), b->error);
    make_switch(b);
    g_object_set_data_full(G_OBJECT(b->box), "tetralod-bound", b, g_free);
    return b;
}

GtkWidget *viewer_bound_widget(viewer_bound *b)
{
    return b->box;
}

GtkWidget *viewer_bound_switch(viewer_bound *b)
{
    return b->none_row;
}
