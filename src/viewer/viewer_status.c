/* The line of figures at the bottom: what is on the screen, what it promises and what it costs. */
#include "viewer_core.h"
#include "viewer_figures.h"

/* What a narrow window cuts off stands last. */
static const viewer_figure SHOWN[] = {
    VIEWER_FIGURE_STATE, VIEWER_FIGURE_ERROR,  VIEWER_FIGURE_TETS, VIEWER_FIGURE_PATCHES,
    VIEWER_FIGURE_FRAME, VIEWER_FIGURE_MEMORY, VIEWER_FIGURE_READ, VIEWER_FIGURE_NOTE};
enum { SHOWN_COUNT = sizeof SHOWN / sizeof *SHOWN, GAP = 14 };

struct viewer_status {
    GtkWidget *labels[SHOWN_COUNT];
    int chars[SHOWN_COUNT]; /* columns become wider, never narrower: nothing trembles */
};

static void show(viewer *v, void *user)
{
    struct viewer_status *status = user;
    for (int i = 0; i < SHOWN_COUNT; i++) {
        GtkWidget *label = status->labels[i];
        const char *text = viewer_figure_text(v, SHOWN[i]);
        const int length = (int)g_utf8_strlen(text, -1);
        viewer_figures_show(v, &SHOWN[i], 1, label);
        gtk_widget_set_visible(label, *text || SHOWN[i] == VIEWER_FIGURE_NOTE);
        if (SHOWN[i] == VIEWER_FIGURE_NOTE || length <= status->chars[i]) continue;
        status->chars[i] = length;
        gtk_label_set_width_chars(GTK_LABEL(label), length);
    }
}

static void on_source(viewer *v, void *user)
{
    struct viewer_status *status = user;
    (void)v;
    for (int i = 0; i < SHOWN_COUNT; i++) {
        status->chars[i] = 0;
        gtk_label_set_width_chars(GTK_LABEL(status->labels[i]), -1);
    }
}

GtkWidget *viewer_status_create(viewer *v)
{
    struct viewer_status *status = g_new0(struct viewer_status, 1);
    GtkWidget *line = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, GAP);
    GtkWidget *frame = gtk_scrolled_window_new(); /* a narrow window cuts the line off */
    v->status = status;
    for (int i = 0; i < SHOWN_COUNT; i++) {
        GtkWidget *label = gtk_label_new("");
        const bool is_note = SHOWN[i] == VIEWER_FIGURE_NOTE;
        gtk_label_set_xalign(GTK_LABEL(label), is_note ? 1 : 0);
        gtk_label_set_single_line_mode(GTK_LABEL(label), TRUE);
        gtk_label_set_ellipsize(GTK_LABEL(label), PANGO_ELLIPSIZE_END);
        gtk_widget_set_hexpand(label, is_note);
        if (is_note || SHOWN[i] == VIEWER_FIGURE_STATE)
            gtk_widget_add_css_class(label, "dim-label");
        if (SHOWN[i] == VIEWER_FIGURE_ERROR) gtk_widget_add_css_class(label, "tl-strong");
        gtk_box_append(GTK_BOX(line), label);
        status->labels[i] = label;
    }
    gtk_widget_add_css_class(line, "tl-status");
    gtk_scrolled_window_set_policy(GTK_SCROLLED_WINDOW(frame), GTK_POLICY_EXTERNAL,
                                   GTK_POLICY_NEVER);
    gtk_scrolled_window_set_child(GTK_SCROLLED_WINDOW(frame), line);
    viewer_listen(v, VIEWER_SOURCE, on_source, status);
    viewer_listen(v, VIEWER_FIGURES, show, status);
    return frame;
}

void viewer_status_destroy(viewer *v)
{
    g_free(v->status);
}
