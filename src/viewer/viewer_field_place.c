/* Places: points and boxes by their numbers, planes by words ("x=50%", as of the command line), by
 * axis, and by a slider along their normal. */
#include "viewer_field.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { PLACE_PX = 200, WORDS_BYTES = 256 };
/* Cosine beside 1 from which on a plane is called one across an axis. */
static const double ALONG_AXIS = 1e-9;

/* ---- numbers in a row ---- */

static void numbers_text(const double *reals, size_t count, char text[WORDS_BYTES])
{
    size_t used = 0;
    *text = '\0';
    for (size_t i = 0; i < count && used < WORDS_BYTES; i++) {
        char number[VIEWER_NUMBER_BYTES];
        viewer_number_text(reals[i], number);
        used += (size_t)snprintf(text + used, WORDS_BYTES - used, "%s%s", i ? " " : "", number);
    }
}

static void fill_place(viewer_field *field)
{
    tl_value value;
    char text[WORDS_BYTES];
    if (tl_scene_get(field->v->ctx, field->v->scene, field->node, field->info->name, &value))
        return;
    numbers_text(value.reals, value.count, text);
    viewer_entry_show(field->main, text);
}

static bool commit_place(void *user)
{
    viewer_field *field = user;
    char *text = viewer_entry_numbers(field->main);
    tl_scene_seal(field->v->scene);
    const bool taken = viewer_field_set_text(field, *text ? text : "auto");
    g_free(text);
    return taken;
}

void viewer_field_add_place(viewer_field *field, GtkWidget *row)
{
    field->main = viewer_entry_create(10, commit_place, field);
    field->fill = fill_place;
    gtk_widget_set_hexpand(field->main, TRUE);
    gtk_entry_set_placeholder_text(GTK_ENTRY(field->main),
                                   field->style.empty ? field->style.empty : "automatic");
    gtk_box_append(GTK_BOX(row), field->main);
}

/* ---- planes ---- */

typedef struct plane {
    double point[3], normal[3]; /* of length 1 */
    double at, least, most;     /* along the normal: the plane, and the ends of the bounds */
} plane;

static plane plane_of(const viewer_field *field)
{
    plane p = {.least = INFINITY, .most = -(double)INFINITY};
    double reals[6], bounds[6];
    tl_scene_plane(field->v->scene, field->node, field->info->name, reals);
    tl_scene_bounds(field->v->scene, bounds);
    const double length = sqrt(reals[3] * reals[3] + reals[4] * reals[4] + reals[5] * reals[5]);
    for (int k = 0; k < 3; k++) {
        p.point[k] = reals[k];
        p.normal[k] = reals[3 + k] / length;
        p.at += p.point[k] * p.normal[k];
    }
    for (int corner = 0; corner < 8; corner++) {
        double along = 0;
        for (int k = 0; k < 3; k++) along += bounds[2 * k + (corner >> k & 1)] * p.normal[k];
        p.least = fmin(p.least, along);
        p.most = fmax(p.most, along);
    }
    return p;
}

static void set_plane(viewer_field *field, const plane *p)
{
    double reals[6];
    memcpy(reals, p->point, sizeof p->point);
    memcpy(reals + 3, p->normal, sizeof p->normal);
    viewer_field_set_reals(field, reals, 6);
}

/* "x=0.5", "-z=3", or all six numbers. */
static void plane_text(const plane *p, char text[WORDS_BYTES])
{
    double reals[6];
    for (int k = 0; k < 3; k++) {
        if (fabs(p->normal[k]) < 1 - ALONG_AXIS) continue;
        char number[VIEWER_NUMBER_BYTES];
        viewer_number_text(p->point[k], number);
        snprintf(text, WORDS_BYTES, "%s%c=%s", p->normal[k] < 0 ? "-" : "", 'x' + k, number);
        return;
    }
    memcpy(reals, p->point, sizeof p->point);
    memcpy(reals + 3, p->normal, sizeof p->normal);
    numbers_text(reals, 6, text);
}

static void fill_plane(viewer_field *field)
{
    char text[WORDS_BYTES];
    const plane p = plane_of(field);
    plane_text(&p, text);
    viewer_entry_show(field->main, text);
    const viewer_axis axis = {{p.least, p.most}, false, 0, PLACE_PX};
    if (p.least < p.most)
        gtk_range_set_value(GTK_RANGE(field->slider),
                            fmin(fmax(viewer_axis_px(&axis, p.at), 0), PLACE_PX));
}

static gboolean slid_plane(GtkRange *slider, GtkScrollType scroll, double at, viewer_field *field)
{
    (void)slider;
    (void)scroll;
    plane p = plane_of(field);
    const viewer_axis axis = {{p.least, p.most}, false, 0, PLACE_PX};
    const double to =
        viewer_axis_round(&axis, viewer_axis_value(&axis, fmin(fmax(at, 0), PLACE_PX)));
    for (int k = 0; k < 3; k++) p.point[k] += (to - p.at) * p.normal[k];
    set_plane(field, &p);
    fill_plane(field);
    return TRUE;
}

/* Through the same point, across an axis. */
static void face_axis(GtkButton *button, viewer_field *field)
{
    plane p = plane_of(field);
    const int axis = *gtk_button_get_label(button) - 'X';
    for (int k = 0; k < 3; k++) p.normal[k] = k == axis;
    tl_scene_seal(field->v->scene);
    set_plane(field, &p);
}

static void flip(viewer_field *field)
{
    plane p = plane_of(field);
    for (int k = 0; k < 3; k++) p.normal[k] = -p.normal[k];
    tl_scene_seal(field->v->scene);
    set_plane(field, &p);
}

static GtkWidget *axis_buttons(viewer_field *field)
{
    static const char *const NAMES[] = {"X", "Y", "Z"};
    GtkWidget *buttons = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 0);
    gtk_widget_add_css_class(buttons, "linked");
    for (int k = 0; k < 3; k++) {
        GtkWidget *button = gtk_button_new_with_label(NAMES[k]);
        gtk_widget_set_tooltip_text(button, "Across this axis");
        g_signal_connect(button, "clicked", G_CALLBACK(face_axis), field);
        gtk_box_append(GTK_BOX(buttons), button);
    }
    GtkWidget *turn = gtk_button_new_from_icon_name("object-flip-horizontal-symbolic");
    gtk_widget_set_tooltip_text(turn, "The other way around");
    g_signal_connect_swapped(turn, "clicked", G_CALLBACK(flip), field);
    gtk_box_append(GTK_BOX(buttons), turn);
    return buttons;
}

void viewer_field_add_plane(viewer_field *field, GtkWidget *row)
{
    GtkWidget *both = gtk_box_new(GTK_ORIENTATION_VERTICAL, 2);
    GtkWidget *along = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 6);
    field->main = viewer_entry_create(6, commit_place, field);
    field->fill = fill_plane;
    gtk_widget_set_hexpand(field->main, TRUE);
    field->slider = gtk_scale_new_with_range(GTK_ORIENTATION_HORIZONTAL, 0, PLACE_PX, 1);
    gtk_scale_set_draw_value(GTK_SCALE(field->slider), FALSE);
    g_signal_connect(field->slider, "change-value", G_CALLBACK(slid_plane), field);
    viewer_watch_gesture(field->v, field->slider);
    gtk_widget_set_hexpand(field->slider, TRUE);
    gtk_box_append(GTK_BOX(along), field->slider);
    gtk_box_append(GTK_BOX(along), axis_buttons(field));
    gtk_box_append(GTK_BOX(both), along);
    gtk_box_append(GTK_BOX(both), field->main); /* six numbers need the room */
    gtk_widget_set_hexpand(both, TRUE);
    gtk_box_append(GTK_BOX(row), both);
}
