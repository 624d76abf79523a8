/* The panel of the level of detail: the error asked for on top, what the picture promises and costs
 * below it, budgets and focus under "More". */
#include "viewer_detail.h"

#include <math.h>
#include <string.h>

#include "viewer_field.h"
#include "viewer_things.h"

/* Figures change at most so often, so that they can be read. */
enum { REFRESH_MS = 150 };
enum { MARK_NONE = 0 };
/* Height of what is under "More", which is scrolled. */
enum { MORE_HEIGHT = 230 };

static const char *const MORE[] = {"frozen",    "focus",         "focus_box",   "focus_gain",
                                   "full",      "tets",          "moving_tets", "frame_s",
                                   "error",     "error_channel", "space_error", "boundary_error",
                                   "ram_bytes", "card_bytes"};

struct viewer_detail {
    viewer *v;
    GtkWidget *box, *first, *rest, *more, *mark_row, *mark;
    GtkWidget *promise, *amount, *cost, *whole;
    guint later;
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

static void show_promise(viewer_detail *d, const tl_frame *frame)
{
    const tl_content_facts *facts = frame->facts;
    GString *text = g_string_new(NULL);
    if (!facts->is_model)
        g_string_append(text, "the mesh as it is");
    else if (facts->whole_tets == facts->source_tets)
        g_string_append(text, "all of the model");
    else if (isfinite(frame->error_px))
        g_string_append_printf(text, "≤ %.*f px",
                               frame->error_px > 0 && frame->error_px < 10 ? 2 : 0,
                               frame->error_px);
    else
        g_string_append(text, "places not bounded: values are missing");
    for (size_t i = 0; i < facts->error_count; i++)
        g_string_append_printf(text, "%s%s ± %.2g", text->len ? " · " : "",
                               facts->errors[i].channel, facts->errors[i].error);
    gtk_label_set_text(GTK_LABEL(d->promise), text->str);
    gtk_widget_set_tooltip_text(d->promise, text->str);
    g_string_free(text, TRUE);
}

static void show_amount(viewer_detail *d, const tl_content_facts *facts)
{
    char *drawn = viewer_count_text((double)facts->tets);
    char *all = viewer_count_text((double)facts->source_tets);
    char *text = facts->is_model ? g_strdup_printf("%s of %s tets, %" G_GUINT64_FORMAT " patches",
                                                   drawn, all, facts->patches)
                                 : g_strdup_printf("%s tets", drawn);
    gtk_label_set_text(GTK_LABEL(d->amount), text);
    g_free(text);
    g_free(all);
    g_free(drawn);
}

static void show_cost(viewer_detail *d, const tl_frame *frame)
{
    const tl_live_stats stats = tl_live_get_stats(d->v->live);
    char *ram = viewer_bytes_text((double)stats.ram_bytes);
    char *limit = viewer_bytes_text((double)stats.ram_limit_bytes);
    char *card = viewer_bytes_text((double)stats.card_bytes);
    char *read = viewer_bytes_text((double)stats.bytes_read);
    const double seconds = frame->is_moving && stats.frame_s > 0 ? stats.frame_s : frame->draw_s;
    char *text = g_strdup_printf("%.0f ms, %s", 1e3 * seconds, ram);
    char *tip = g_strdup_printf("Drawn in %.1f ms by %s\n%s of %s memory\n%s on the card\n%s read",
                                1e3 * seconds, frame->renderer, ram, limit, card, read);
    gtk_label_set_text(GTK_LABEL(d->cost), text);
    gtk_widget_set_tooltip_text(d->cost, tip);
    g_free(tip);
    g_free(text);
    g_free(read);
    g_free(card);
    g_free(limit);
    g_free(ram);
}

static gboolean show_frame(gpointer user)
{
    viewer_detail *d = user;
    const tl_frame *frame = d->v->frame;
    d->later = 0;
    if (!frame || !frame->facts) return G_SOURCE_REMOVE;
    show_promise(d, frame);
    show_amount(d, frame->facts);
    show_cost(d, frame);
    return G_SOURCE_REMOVE;
}

void viewer_detail_frame(viewer_detail *d)
{
    if (d->v->frame && d->v->frame->is_final) {
        if (d->later) g_source_remove(d->later);
        show_frame(d);
    } else if (!d->later) {
        d->later = g_timeout_add(REFRESH_MS, show_frame, d);
    }
}

static void end(viewer *v, void *user)
{
    viewer_detail *d = user;
    (void)v;
    if (d->later) g_source_remove(d->later);
    d->later = 0;
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
    viewer_fields_refresh(d->first);
    viewer_fields_refresh(d->rest);
    d->is_filling = true;
    gtk_drop_down_set_selected(GTK_DROP_DOWN(d->mark),
                               boundary ? (guint)tl_scene_real(v->scene, boundary, "mark")
                                        : MARK_NONE);
    d->is_filling = false;
}

static GtkWidget *figure(const char *tooltip)
{
    GtkWidget *label = gtk_label_new(NULL);
    gtk_label_set_xalign(GTK_LABEL(label), 0);
    gtk_label_set_wrap(GTK_LABEL(label), TRUE);
    gtk_label_set_wrap_mode(GTK_LABEL(label), PANGO_WRAP_WORD_CHAR);
    gtk_widget_set_tooltip_text(label, tooltip);
    gtk_widget_add_css_class(label, "figure");
    return label;
}

static GtkWidget *figures(viewer_detail *d)
{
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    GtkWidget *column = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    GtkWidget *label = viewer_row_label("Now");
    gtk_widget_set_valign(label, GTK_ALIGN_START);
    d->promise = figure("How far the picture may be from that of the original");
    d->amount = figure("Tets that are drawn, of those of the data set");
    d->cost = figure(NULL);
    gtk_widget_set_hexpand(column, TRUE);
    gtk_box_append(GTK_BOX(column), d->promise);
    gtk_box_append(GTK_BOX(column), d->amount);
    gtk_box_append(GTK_BOX(column), d->cost);
    gtk_box_append(GTK_BOX(row), label);
    gtk_box_append(GTK_BOX(row), column);
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
    d->whole = gtk_label_new("This is a mesh: all of it is drawn. Models have levels of detail.");
    gtk_label_set_wrap(GTK_LABEL(d->whole), TRUE);
    gtk_label_set_xalign(GTK_LABEL(d->whole), 0);
    gtk_widget_add_css_class(d->whole, "dim-label");
    gtk_box_append(GTK_BOX(d->first), viewer_field_create(v, node, "error_px"));
    for (size_t i = 0; i < G_N_ELEMENTS(MORE); i++)
        gtk_box_append(GTK_BOX(d->rest), viewer_field_create(v, node, MORE[i]));
    gtk_expander_set_child(GTK_EXPANDER(d->more), scrolled);
    gtk_box_append(GTK_BOX(d->box), viewer_heading("Level of detail"));
    gtk_box_append(GTK_BOX(d->box), d->whole);
    gtk_box_append(GTK_BOX(d->box), d->first);
    gtk_box_append(GTK_BOX(d->box), figures(d));
    gtk_box_append(GTK_BOX(d->box), d->more);
    g_object_set_data_full(G_OBJECT(d->box), "tetralod-detail", d, g_free);
    viewer_listen(v, VIEWER_END, end, d);
    return d;
}

GtkWidget *viewer_detail_widget(viewer_detail *d)
{
    return d->box;
}
