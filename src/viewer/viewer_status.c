/* The line of figures at the bottom: what is on the screen, what it promises and what it costs. */
#include "viewer_core.h"

#include <math.h>

/* While the camera moves figures change at most so often, so that they can be read. */
#define REFRESH_US 150000

typedef enum figure {
    FIGURE_STATE = 0,
    FIGURE_ERROR,
    FIGURE_TETS,
    FIGURE_PATCHES,
    FIGURE_FRAME,
    FIGURE_MEMORY,
    FIGURE_READ,
    FIGURE_COUNT
} figure;

static const struct {
    int chars;
    const char *tip;
} FIGURES[FIGURE_COUNT] = {
    {9, "Whether the picture is all that was asked for"},
    {16, "By how many pixels what is seen may be off, at most. Detail sets what is asked for"},
    {20, "Tets that are drawn, of those of the data set"},
    {14, "Pieces of the model that are drawn"},
    {11, "What the last picture took to draw"},
    {12, "Memory of data and pictures; the tip names the limit"},
    {14, "Read from the file so far"},
};

struct viewer_status {
    GtkWidget *labels[FIGURE_COUNT], *note;
    gint64 refreshed;
    guint later;
};

/* ---- numbers as text ---- */

char *viewer_count_text(double count)
{
    static const char *const UNITS[] = {"", " k", " M", " G"};
    int unit = 0;
    while (count >= 10000 && unit == 0) count /= 1000, unit++;
    while (unit > 0 && count >= 1000 && unit < 3) count /= 1000, unit++;
    const int digits = unit == 0 || count >= 100 ? 0 : count >= 10 ? 1 : 2;
    return g_strdup_printf("%.*f%s", digits, count, UNITS[unit]);
}

char *viewer_bytes_text(double bytes)
{
    static const char *const UNITS[] = {"B", "kB", "MB", "GB", "TB"};
    int unit = 0;
    while (bytes >= 1000 && unit < 4) bytes /= 1000, unit++;
    const int digits = unit == 0 || bytes >= 100 ? 0 : bytes >= 10 ? 1 : 2;
    return g_strdup_printf("%.*f %s", digits, bytes, UNITS[unit]);
}

/* ---- figures ---- */

static void set(struct viewer_status *status, figure f, char *text)
{
    gtk_label_set_text(GTK_LABEL(status->labels[f]), text);
    g_free(text);
}

/* In pixels of this frame; where a value that is visible was lost, so that its surface has no
 * place, the bound of the first channel shown. */
static char *error_text(const tl_frame *frame)
{
    const tl_content_facts *facts = frame->facts;
    const double px = frame->error_px;
    if (!facts->is_model) return g_strdup("exact mesh");
    if (isfinite(px)) return g_strdup_printf("error ≤ %.*f px", px < 10 ? 2 : px < 100 ? 1 : 0, px);
    if (facts->error_count && isfinite(facts->errors[0].error))
        return g_strdup_printf("%s ≤ %.2g", facts->errors[0].channel, facts->errors[0].error);
    return g_strdup("error not bounded");
}

static char *tets_text(const tl_content_facts *facts)
{
    char *drawn = viewer_count_text((double)facts->tets);
    char *all = viewer_count_text((double)facts->source_tets);
    char *text = facts->tets == facts->source_tets ? g_strdup_printf("%s tets", drawn)
                                                   : g_strdup_printf("%s of %s tets", drawn, all);
    g_free(drawn);
    g_free(all);
    return text;
}

static void show_frame(viewer *v, struct viewer_status *status)
{
    const tl_frame *frame = v->frame;
    const tl_live_stats stats = tl_live_get_stats(v->live);
    char *ram = viewer_bytes_text((double)stats.ram_bytes);
    char *limit = viewer_bytes_text((double)stats.ram_limit_bytes);
    char *read = viewer_bytes_text((double)stats.bytes_read);
    set(status, FIGURE_STATE,
        g_strdup(frame->is_moving  ? "moving"
                 : frame->is_final ? "at rest"
                                   : "refining"));
    set(status, FIGURE_FRAME,
        g_strdup_printf("%.0f ms", 1e3 * (frame->is_moving && stats.frame_s > 0 ? stats.frame_s
                                                                                : frame->draw_s)));
    set(status, FIGURE_MEMORY, g_strdup(ram));
    set(status, FIGURE_READ, stats.bytes_read ? g_strdup_printf("%s read", read) : g_strdup(""));
    if (frame->facts) {
        set(status, FIGURE_ERROR, error_text(frame));
        set(status, FIGURE_TETS, tets_text(frame->facts));
        set(status, FIGURE_PATCHES,
            frame->facts->is_model
                ? g_strdup_printf("%" G_GUINT64_FORMAT " patches", frame->facts->patches)
                : g_strdup(""));
    }
    char *tip = g_strdup_printf("%s of data and pictures, %s at most (Detail: ram_bytes)\n%s", ram,
                                limit, frame->renderer);
    gtk_widget_set_tooltip_text(status->labels[FIGURE_MEMORY], tip);
    gtk_label_set_text(GTK_LABEL(status->note), frame->note);
    gtk_widget_set_tooltip_text(status->note, *frame->note ? frame->note : NULL);
    g_free(tip);
    g_free(ram);
    g_free(limit);
    g_free(read);
    status->refreshed = g_get_monotonic_time();
}

static gboolean on_later(gpointer data)
{
    viewer *v = data;
    v->status->later = 0;
    if (v->frame) show_frame(v, v->status);
    return G_SOURCE_REMOVE;
}

static void on_frame(viewer *v, void *user)
{
    struct viewer_status *status = user;
    if (v->frame->is_final || g_get_monotonic_time() - status->refreshed > REFRESH_US) {
        show_frame(v, status);
    } else if (!status->later) {
        status->later = g_timeout_add(REFRESH_US / 1000, on_later, v);
    }
}

static void on_source(viewer *v, void *user)
{
    struct viewer_status *status = user;
    (void)v;
    for (int f = 0; f < FIGURE_COUNT; f++) gtk_label_set_text(GTK_LABEL(status->labels[f]), "");
    gtk_label_set_text(GTK_LABEL(status->note), "");
}

/* ---- the part ---- */

GtkWidget *viewer_status_create(viewer *v)
{
    struct viewer_status *status = g_new0(struct viewer_status, 1);
    GtkWidget *line = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 14);
    GtkWidget *frame = gtk_scrolled_window_new(); /* a narrow window cuts the line off */
    v->status = status;
    for (int f = 0; f < FIGURE_COUNT; f++) {
        GtkWidget *label = gtk_label_new("");
        gtk_label_set_xalign(GTK_LABEL(label), 0);
        gtk_label_set_width_chars(GTK_LABEL(label), FIGURES[f].chars);
        gtk_label_set_single_line_mode(GTK_LABEL(label), TRUE);
        gtk_label_set_ellipsize(GTK_LABEL(label), PANGO_ELLIPSIZE_END);
        gtk_widget_set_tooltip_text(label, FIGURES[f].tip);
        gtk_box_append(GTK_BOX(line), label);
        status->labels[f] = label;
    }
    gtk_widget_add_css_class(status->labels[FIGURE_STATE], "dim-label");
    gtk_widget_add_css_class(status->labels[FIGURE_ERROR], "tl-strong");
    status->note = gtk_label_new("");
    gtk_label_set_xalign(GTK_LABEL(status->note), 1);
    gtk_label_set_ellipsize(GTK_LABEL(status->note), PANGO_ELLIPSIZE_END);
    gtk_widget_set_hexpand(status->note, TRUE);
    gtk_widget_add_css_class(status->note, "dim-label");
    gtk_box_append(GTK_BOX(line), status->note);
    gtk_widget_add_css_class(line, "tl-status");
    gtk_scrolled_window_set_policy(GTK_SCROLLED_WINDOW(frame), GTK_POLICY_EXTERNAL,
                                   GTK_POLICY_NEVER);
    gtk_scrolled_window_set_child(GTK_SCROLLED_WINDOW(frame), line);
    viewer_listen(v, VIEWER_FRAME, on_frame, status);
    viewer_listen(v, VIEWER_SOURCE, on_source, status);
    return frame;
}

void viewer_status_destroy(viewer *v)
{
    if (v->status->later) g_source_remove(v->status->later);
    g_free(v->status);
}
