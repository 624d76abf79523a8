/* What the window says over the picture: messages above, how far a job is below. */
#include "viewer_core.h"

#include <stdarg.h>

#define INFO_SECONDS 6

struct viewer_messages {
    GtkWidget *bar, *bar_text, *bar_button;
    viewer_tone bar_tone;
    void (*bar_fn)(viewer *v), (*bar_refuse)(viewer *v);
    guint bar_timeout;
    GtkWidget *progress, *progress_text, *progress_bar;
    void (*cancel)(viewer *v);
    guint pulse;
};

/* ---- messages ---- */

static void hide_bar(viewer *v)
{
    struct viewer_messages *m = v->messages;
    if (m->bar_timeout) g_source_remove(m->bar_timeout);
    m->bar_timeout = 0;
    m->bar_fn = m->bar_refuse = NULL;
    gtk_info_bar_set_revealed(GTK_INFO_BAR(m->bar), FALSE);
}

static gboolean on_bar_timeout(gpointer data)
{
    viewer *v = data;
    v->messages->bar_timeout = 0;
    hide_bar(v);
    return G_SOURCE_REMOVE;
}

static void on_bar_response(GtkInfoBar *bar, int response, viewer *v)
{
    (void)bar;
    void (*fn)(viewer *) =
        response == GTK_RESPONSE_OK ? v->messages->bar_fn : v->messages->bar_refuse;
    hide_bar(v);
    if (fn) fn(v);
}

static void show_bar(viewer *v, viewer_tone tone, const char *text, const char *button,
                     void (*fn)(viewer *v), void (*refuse)(viewer *v))
{
    static const GtkMessageType TYPES[] = {GTK_MESSAGE_INFO, GTK_MESSAGE_WARNING,
                                           GTK_MESSAGE_ERROR};
    struct viewer_messages *m = v->messages;
    if (viewer_core_is_ended(v)) return;
    viewer_script_said(v, tone, text);
    hide_bar(v);
    char *shown = g_utf8_make_valid(text, -1); /* names of files may be anything */
    gtk_info_bar_set_message_type(GTK_INFO_BAR(m->bar), TYPES[tone]);
    gtk_label_set_text(GTK_LABEL(m->bar_text), shown);
    g_free(shown);
    gtk_widget_set_visible(m->bar_button, button != NULL);
    if (button) gtk_button_set_label(GTK_BUTTON(m->bar_button), button);
    m->bar_tone = tone;
    m->bar_fn = fn;
    m->bar_refuse = refuse;
    gtk_info_bar_set_revealed(GTK_INFO_BAR(m->bar), TRUE);
    if (tone == VIEWER_INFO && !button)
        m->bar_timeout = g_timeout_add_seconds(INFO_SECONDS, on_bar_timeout, v);
}

void viewer_say(viewer *v, viewer_tone tone, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *text = g_strdup_vprintf(format, arguments);
    va_end(arguments);
    show_bar(v, tone, text, NULL, NULL, NULL);
    g_free(text);
}

void viewer_unsay(viewer *v)
{
    if (v->messages->bar_tone == VIEWER_ERROR && !v->messages->bar_fn) hide_bar(v);
}

void viewer_offer(viewer *v, const char *button, void (*fn)(viewer *v), void (*refuse)(viewer *v),
                  const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *text = g_strdup_vprintf(format, arguments);
    va_end(arguments);
    show_bar(v, VIEWER_INFO, text, button, fn, refuse);
    g_free(text);
}

GtkWidget *viewer_messages_bar(viewer *v)
{
    struct viewer_messages *m = v->messages;
    m->bar = gtk_info_bar_new();
    m->bar_text = gtk_label_new(NULL);
    gtk_label_set_wrap(GTK_LABEL(m->bar_text), TRUE);
    gtk_label_set_wrap_mode(GTK_LABEL(m->bar_text), PANGO_WRAP_WORD_CHAR);
    gtk_label_set_lines(GTK_LABEL(m->bar_text), 4);
    gtk_label_set_ellipsize(GTK_LABEL(m->bar_text), PANGO_ELLIPSIZE_END);
    gtk_label_set_selectable(GTK_LABEL(m->bar_text), TRUE);
    gtk_label_set_xalign(GTK_LABEL(m->bar_text), 0);
    gtk_widget_set_hexpand(m->bar_text, TRUE);
    gtk_info_bar_add_child(GTK_INFO_BAR(m->bar), m->bar_text);
    m->bar_button = gtk_info_bar_add_button(GTK_INFO_BAR(m->bar), "", GTK_RESPONSE_OK);
    gtk_info_bar_set_show_close_button(GTK_INFO_BAR(m->bar), TRUE);
    gtk_info_bar_set_revealed(GTK_INFO_BAR(m->bar), FALSE);
    gtk_widget_set_valign(m->bar, GTK_ALIGN_START); /* over the picture, which keeps its size */
    g_signal_connect(m->bar, "response", G_CALLBACK(on_bar_response), v);
    return m->bar;
}

/* ---- progress ---- */

static gboolean on_pulse(gpointer data)
{
    gtk_progress_bar_pulse(GTK_PROGRESS_BAR(data));
    return G_SOURCE_CONTINUE;
}

static void stop_pulse(struct viewer_messages *m)
{
    if (m->pulse) g_source_remove(m->pulse);
    m->pulse = 0;
}

void viewer_window_progress(viewer *v, const char *text, double part, void (*cancel)(viewer *v))
{
    struct viewer_messages *m = v->messages;
    gtk_widget_set_visible(m->progress, text != NULL);
    m->cancel = cancel;
    if (!text || part >= 0) stop_pulse(m);
    if (!text) return;
    gtk_label_set_text(GTK_LABEL(m->progress_text), text);
    if (part >= 0)
        gtk_progress_bar_set_fraction(GTK_PROGRESS_BAR(m->progress_bar), CLAMP(part, 0, 1));
    else if (!m->pulse)
        m->pulse = g_timeout_add(120, on_pulse, m->progress_bar);
}

void viewer_window_job(viewer *v, const char *text, const tl_live_event *event,
                       void (*cancel)(viewer *v))
{
    char *line = g_strdup_printf("%s: %s", text, event->stage);
    const double part = event->total ? (double)event->done / (double)event->total : -1;
    viewer_window_progress(v, line, part, cancel);
    g_free(line);
}

static void on_cancel(GtkButton *button, viewer *v)
{
    (void)button;
    if (v->messages->cancel) v->messages->cancel(v);
}

GtkWidget *viewer_messages_progress(viewer *v)
{
    struct viewer_messages *m = v->messages;
    GtkWidget *cancel = gtk_button_new_from_icon_name("window-close-symbolic");
    m->progress = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 12);
    m->progress_text = gtk_label_new(NULL);
    m->progress_bar = gtk_progress_bar_new();
    gtk_widget_set_size_request(m->progress_bar, 160, -1);
    gtk_widget_set_valign(m->progress_bar, GTK_ALIGN_CENTER);
    gtk_widget_add_css_class(m->progress, "osd");
    gtk_widget_add_css_class(m->progress, "tl-pill");
    gtk_widget_add_css_class(cancel, "flat");
    gtk_widget_add_css_class(cancel, "circular");
    gtk_widget_set_tooltip_text(cancel, "Cancel");
    gtk_box_append(GTK_BOX(m->progress), m->progress_text);
    gtk_box_append(GTK_BOX(m->progress), m->progress_bar);
    gtk_box_append(GTK_BOX(m->progress), cancel);
    gtk_widget_set_halign(m->progress, GTK_ALIGN_CENTER);
    gtk_widget_set_valign(m->progress, GTK_ALIGN_END);
    gtk_widget_set_margin_bottom(m->progress, 24);
    gtk_widget_set_visible(m->progress, FALSE);
    g_signal_connect(cancel, "clicked", G_CALLBACK(on_cancel), v);
    return m->progress;
}

/* ---- the part ---- */

void viewer_messages_attach(viewer *v)
{
    v->messages = g_new0(struct viewer_messages, 1);
    g_object_set_data_full(G_OBJECT(v->window), "tetralod-messages", v->messages, g_free);
}

void viewer_messages_end(viewer *v)
{
    hide_bar(v);
    stop_pulse(v->messages);
}
