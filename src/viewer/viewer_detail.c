/* The panel of the level of detail: the error asked for on top, what the picture promises and costs
 * below it, budgets and focus under "More". */
#include "viewer_detail.h"

#include "viewer_bound.h"
#include "viewer_field.h"
#include "viewer_figures.h"
#include "viewer_things.h"

enum { MARK_NONE = 0 };
/* Height of what is under "More", which is scrolled. */
enum { MORE_HEIGHT = 230 };

static const char *const MORE[] = {"frozen",        "focus",       "focus_box",      "focus_gain",
                                   "tets",          "moving_tets", "frame_s",        "error",
                                   "error_channel", "space_error", "boundary_error", "ram_bytes",
                                   "card_bytes"};

/* What is said of the picture, line by line. */
enum { LINE_COUNT = 4, LINE_FIGURES = 3 };
static const struct {
    size_t count;
    viewer_figure figures[LINE_FIGURES];
} LINES[LINE_COUNT] = {{2, {VIEWER_FIGURE_ERROR, VIEWER_FIGURE_CHANNELS}},
                       {2, {VIEWER_FIGURE_TETS, VIEWER_FIGURE_PATCHES}},
                       {3, {VIEWER_FIGURE_FRAME, VIEWER_FIGURE_MEMORY, VIEWER_FIGURE_READ}},
                       {1, {VIEWER_FIGURE_NOTE}}};

struct viewer_detail {
    viewer *v;
    GtkWidget *box, *first, *rest, *more, *mark_row, *mark;
    viewer_bound *bound;
    GtkWidget *now, *lines[LINE_COUNT], *whole;
    bool is_filling;
};

/* ---- patches and levels in colours ---- */

/* They are painted on the boundary, which is added where there is none. */
static void set_mark(viewer *v, const char *word)
{
    tl_scene_seal(v->scene);
    if (!viewer_ok(v, tl_scene_begin(v->ctx, v->scene, "colour by patch or level"))) return;
    tl_node node = viewer_node_of_kind(v, TL_NODE_BOUNDARY);
    tl_status st = node ? TL_OK : tl_scene_add(v->ctx, v->scene, TL_NODE_BOUNDARY, &node);
    if (!st) st = tl_scene_set_flag(v->ctx, v->scene, node, "visible", true);
    if (!st) st = tl_scene_set_text(v->ctx, v->scene, node, "mark", word);
    const tl_status end = tl_scene_end(v->ctx, v->scene, !st);
    viewer_ok(v, st ? st : end);
    tl_scene_seal(v->scene);
    viewer_changed(v);
}

static void mark_changed(GtkDropDown *drop, GParamSpec *spec, viewer_detail *d)
{
    (void)spec;
    const guint chosen = gtk_drop_down_get_selected(drop);
    if (!d->is_filling && chosen != GTK_INVALID_LIST_POSITION)
        set_mark(d->v, tl_node_prop(TL_NODE_BOUNDARY, "mark")->choices[chosen]);
}

static GtkWidget *mark_row(viewer_detail *d)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    d->mark = viewer_drop_create(tl_node_prop(TL_NODE_BOUNDARY, "mark")->choices);
    gtk_widget_set_tooltip_text(row, "Patches or levels of the model in colours, on the boundary");
    g_signal_connect(d->mark, "notify::selected", G_CALLBACK(mark_changed), d);
    gtk_box_append(GTK_BOX(row), viewer_row_label("In colours"));
    gtk_box_append(GTK_BOX(row), d->mark);
    return row;
}

/* ---- what is on the screen ---- */

static void show_figures(viewer *v, void *user)
{
    viewer_detail *d = user;
    for (int i = 0; i < LINE_COUNT; i++) {
        viewer_figures_show(v, LINES[i].figures, LINES[i].count, d->lines[i]);
        gtk_widget_set_visible(d->lines[i], *gtk_label_get_text(GTK_LABEL(d->lines[i])));
    }
    gtk_label_set_text(GTK_LABEL(d->now), viewer_figures_are_passing(v) ? "Refining …" : "Now");
}

/* ---- the panel ---- */

void viewer_detail_refresh(viewer_detail *d)
{
    const viewer *v = d->v;
    const bool is_model = v->source && tl_source_get_facts(v->source)->is_model;
    const tl_node boundary = viewer_node_of_kind(v, TL_NODE_BOUNDARY);
    gtk_widget_set_visible(d->first, is_model);
    gtk_widget_set_visible(d->mark_row, is_model);
    gtk_widget_set_visible(d->whole, v->source && !is_model);
    viewer_bound_refresh(d->bound);
    viewer_fields_refresh(d->rest);
    d->is_filling = true;
    gtk_drop_down_set_selected(GTK_DROP_DOWN(d->mark),
                               boundary ? (guint)tl_scene_real(v->scene, boundary, "mark")
                                        : MARK_NONE);
    d->is_filling = false;
}

static GtkWidget *figures(viewer_detail *d)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    GtkWidget *column = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    d->now = viewer_row_label("Now");
    gtk_widget_set_valign(d->now, GTK_ALIGN_START);
    for (int i = 0; i < LINE_COUNT; i++) {
        GtkWidget *label = d->lines[i] = gtk_label_new(NULL);
        gtk_label_set_xalign(GTK_LABEL(label), 0);
        gtk_label_set_wrap(GTK_LABEL(label), TRUE);
        gtk_label_set_wrap_mode(GTK_LABEL(label), PANGO_WRAP_WORD_CHAR);
        gtk_widget_add_css_class(label, "figure");
        gtk_box_append(GTK_BOX(column), label);
    }
    gtk_widget_set_hexpand(column, TRUE);
    gtk_box_append(GTK_BOX(row), d->now);
    gtk_box_append(GTK_BOX(row), column);
    return row;
}

/* Of a mesh that is no model. */
static GtkWidget *whole_row(void)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    GtkWidget *label =
        gtk_label_new("All of the mesh is drawn. A model of it has levels of detail.");
    GtkWidget *build = gtk_button_new_with_label("Build…");
    gtk_label_set_wrap(GTK_LABEL(label), TRUE);
    gtk_label_set_xalign(GTK_LABEL(label), 0);
    gtk_widget_set_hexpand(label, TRUE);
    gtk_widget_add_css_class(label, "dim-label");
    gtk_widget_set_valign(build, GTK_ALIGN_CENTER);
    gtk_widget_set_tooltip_text(build, "Build a model of this mesh (Ctrl+B)");
    gtk_actionable_set_action_name(GTK_ACTIONABLE(build), "win.build-model");
    gtk_box_append(GTK_BOX(row), label);
    gtk_box_append(GTK_BOX(row), build);
    return row;
}

viewer_detail *viewer_detail_create(viewer *v)
{
    const tl_node node = TL_NODE_DETAIL + 1;
    viewer_detail *d = g_new0(viewer_detail, 1);
    GtkWidget *scrolled = gtk_scrolled_window_new();
    d->v = v;
    d->box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    gtk_widget_add_css_class(d->box, "section");
    gtk_widget_add_css_class(d->box, "detail");
    d->first = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    d->rest = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    d->more = gtk_expander_new("More");
    gtk_widget_set_name(d->more, "detail-more");
    d->mark_row = mark_row(d);
    gtk_box_append(GTK_BOX(d->rest), d->mark_row);
    gtk_scrolled_window_set_policy(GTK_SCROLLED_WINDOW(scrolled), GTK_POLICY_NEVER,
                                   GTK_POLICY_AUTOMATIC);
    gtk_scrolled_window_set_min_content_height(GTK_SCROLLED_WINDOW(scrolled), MORE_HEIGHT);
    gtk_scrolled_window_set_child(GTK_SCROLLED_WINDOW(scrolled), d->rest);
    d->whole = whole_row();
    d->bound = viewer_bound_create(v);
    gtk_box_append(GTK_BOX(d->first), viewer_bound_widget(d->bound));
    gtk_box_append(GTK_BOX(d->rest), viewer_bound_switch(d->bound));
    for (size_t i = 0; i < G_N_ELEMENTS(MORE); i++)
        gtk_box_append(GTK_BOX(d->rest), viewer_field_create(v, node, MORE[i]));
    gtk_expander_set_child(GTK_EXPANDER(d->more), scrolled);
    gtk_box_append(GTK_BOX(d->box), viewer_heading("Level of detail"));
    gtk_box_append(GTK_BOX(d->box), d->whole);
    gtk_box_append(GTK_BOX(d->box), d->first);
    gtk_box_append(GTK_BOX(d->box), figures(d));
    gtk_box_append(GTK_BOX(d->box), d->more);
    g_object_set_data_full(G_OBJECT(d->box), "tetralod-detail", d, g_free);
    viewer_listen(v, VIEWER_FIGURES, show_figures, d);
    return d;
}

GtkWidget *viewer_detail_widget(viewer_detail *d)
{
    return d->box;
}
