/* The properties of the selected node: its name, its values on a histogram where it has some, a row
 * for each property, the rarer ones below "More". */
#include "viewer_properties.h"

#include <string.h>

#include "viewer_field.h"
#include "viewer_levels.h"
#include "viewer_things.h"
#include "viewer_tools.h"

/* Not in rows: eyes of the list, values on the histogram, the file that is open. */
static const char *const ELSEWHERE[] = {"visible", "on", "value", "low", "high", "file"};
/* What most people change; all else is below "More". */
static const char *const FIRST[] = {"channel",   "color_by", "color", "opacity", "plane",
                                    "shape",     "seeds",    "lit",   "mark",    "width_px",
                                    "radius_px", "count",    "text",  "regions", "background",
                                    "title",     "bar",      "axes",  "box",     "step"};

struct viewer_properties {
    viewer *v;
    GtkWidget *box, *heading, *title, *name, *error;
    viewer_levels *levels;
    GtkWidget *first, *more, *rest;
    tl_node node; /* whose rows are there */
};

static bool is_among(const char *const *words, size_t count, const char *word)
{
    for (size_t i = 0; i < count; i++)
        if (strcmp(words[i], word) == 0) return true;
    return false;
}

/* A box of lines is a property of those that are selected by it, not of the picture. */
static bool is_first(tl_node_kind kind, const char *prop)
{
    if (kind == TL_NODE_LINES && strcmp(prop, "box") == 0) return false;
    return is_among(FIRST, G_N_ELEMENTS(FIRST), prop);
}

static void make_rows(viewer_properties *p)
{
    size_t count;
    viewer *v = p->v;
    const tl_node_kind kind = tl_scene_kind(v->scene, p->node);
    const tl_prop_info *props = tl_node_props(kind, &count);
    viewer_clear_box(p->first);
    viewer_clear_box(p->rest);
    for (size_t i = 0; i < count; i++) {
        if (is_among(ELSEWHERE, G_N_ELEMENTS(ELSEWHERE), props[i].name)) continue;
        if (strcmp(props[i].name, "step") == 0 && !viewer_times_has_steps(v)) continue;
        gtk_box_append(GTK_BOX(is_first(kind, props[i].name) ? p->first : p->rest),
                       viewer_field_create(v, p->node, props[i].name));
    }
    gtk_widget_set_visible(p->more, gtk_widget_get_first_child(p->rest) != NULL);
}

/* ---- name ---- */

static bool commit_name(void *user)
{
    viewer_properties *p = user;
    viewer *v = p->v;
    tl_scene_seal(v->scene);
    const tl_status st = tl_scene_rename(v->ctx, v->scene, p->node, viewer_entry_text(p->name));
    return viewer_settle(v, st, p->name, p->error);
}

static GtkWidget *name_row(viewer_properties *p)
{
    p->heading = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    p->title = viewer_heading("");
    p->name = viewer_entry_create(10, commit_name, p);
    gtk_widget_set_tooltip_text(p->name, "Its name, in scripts and in the list");
    gtk_entry_set_has_frame(GTK_ENTRY(p->name), FALSE);
    gtk_editable_set_alignment(GTK_EDITABLE(p->name), 1);
    gtk_widget_add_css_class(p->name, "node-name");
    gtk_box_append(GTK_BOX(p->heading), p->title);
    gtk_box_append(GTK_BOX(p->heading), p->name);
    return p->heading;
}

/* ---- the panel ---- */

void viewer_properties_refresh(viewer_properties *p)
{
    viewer *v = p->v;
    const tl_node_kind kind = tl_scene_kind(v->scene, v->selected);
    gtk_widget_set_visible(p->box, kind != TL_NODE_KIND_COUNT);
    viewer_levels_show(p->levels, v->selected);
    if (kind == TL_NODE_KIND_COUNT) {
        p->node = 0;
        viewer_clear_box(p->first);
        viewer_clear_box(p->rest);
        return;
    }
    if (p->node != v->selected) {
        p->node = v->selected;
        make_rows(p);
    } else {
        viewer_fields_refresh(p->first);
        viewer_fields_refresh(p->rest);
    }
    gtk_label_set_text(GTK_LABEL(p->title), viewer_node_title(kind));
    viewer_entry_show(p->name, tl_scene_name(v->scene, p->node));
    gtk_widget_set_visible(p->name, viewer_node_is_thing(kind));
    viewer_mark_wrong(p->name, p->error, NULL);
}

/* Another scene may use the number for another node. */
static void source_changed(viewer *v, void *user)
{
    viewer_properties *p = user;
    (void)v;
    p->node = 0;
}

viewer_properties *viewer_properties_create(viewer *v)
{
    viewer_properties *p = g_new0(viewer_properties, 1);
    p->v = v;
    p->box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    gtk_widget_add_css_class(p->box, "section");
    p->levels = viewer_levels_create(v);
    p->first = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    p->rest = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
    p->more = gtk_expander_new("More");
    gtk_expander_set_child(GTK_EXPANDER(p->more), p->rest);
    p->error = viewer_error_line();
    gtk_box_append(GTK_BOX(p->box), name_row(p));
    gtk_box_append(GTK_BOX(p->box), p->error);
    gtk_box_append(GTK_BOX(p->box), viewer_levels_widget(p->levels));
    gtk_box_append(GTK_BOX(p->box), p->first);
    gtk_box_append(GTK_BOX(p->box), p->more);
    g_object_set_data_full(G_OBJECT(p->box), "tetralod-properties", p, g_free);
    viewer_listen(v, VIEWER_SOURCE, source_changed, p);
    return p;
}

GtkWidget *viewer_properties_widget(viewer_properties *p)
{
    return p->box;
}
