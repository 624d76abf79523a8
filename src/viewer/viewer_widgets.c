/* Rows, entries and lists of the panels. */
#include "viewer_widgets.h"

#include <langinfo.h>
#include <locale.h>
#include <math.h>
#include <string.h>

enum { LABEL_WIDTH = 92 };
static const char SHOWN[] = "tetralod-shown"; /* text that was put into an entry */

/* ---- small widgets ---- */

GtkWidget *viewer_row_label(const char *text)
{
    GtkWidget *label = gtk_label_new(text);
    gtk_label_set_xalign(GTK_LABEL(label), 0);
    gtk_label_set_ellipsize(GTK_LABEL(label), PANGO_ELLIPSIZE_END);
    gtk_widget_set_size_request(label, LABEL_WIDTH, -1);
    gtk_widget_add_css_class(label, "row-label");
    return label;
}

GtkWidget *viewer_icon_button(const char *icon, const char *tooltip)
{
    GtkWidget *button = gtk_button_new_from_icon_name(icon);
    gtk_button_set_has_frame(GTK_BUTTON(button), FALSE);
    gtk_widget_set_tooltip_text(button, tooltip);
    gtk_widget_set_valign(button, GTK_ALIGN_CENTER);
    gtk_accessible_update_property(GTK_ACCESSIBLE(button), GTK_ACCESSIBLE_PROPERTY_LABEL, tooltip,
                                   -1);
    return button;
}

GtkWidget *viewer_heading(const char *text)
{
    GtkWidget *label = gtk_label_new(text);
    gtk_label_set_xalign(GTK_LABEL(label), 0);
    gtk_label_set_ellipsize(GTK_LABEL(label), PANGO_ELLIPSIZE_END);
    gtk_widget_set_hexpand(label, TRUE);
    gtk_widget_add_css_class(label, "heading");
    return label;
}

static void setup_word(GtkSignalListItemFactory *factory, GtkListItem *item, gpointer user)
{
    (void)factory;
    (void)user;
    GtkWidget *label = gtk_label_new(NULL);
    gtk_label_set_xalign(GTK_LABEL(label), 0);
    gtk_label_set_ellipsize(GTK_LABEL(label), PANGO_ELLIPSIZE_END);
    gtk_list_item_set_child(item, label);
}

static void bind_word(GtkSignalListItemFactory *factory, GtkListItem *item, gpointer user)
{
    (void)factory;
    (void)user;
    GtkStringObject *word = gtk_list_item_get_item(item);
    gtk_label_set_text(GTK_LABEL(gtk_list_item_get_child(item)),
                       gtk_string_object_get_string(word));
}

GtkWidget *viewer_drop_create(const char *const *words)
{
    GtkListItemFactory *factory = gtk_signal_list_item_factory_new();
    g_signal_connect(factory, "setup", G_CALLBACK(setup_word), NULL);
    g_signal_connect(factory, "bind", G_CALLBACK(bind_word), NULL);
    GtkWidget *drop = gtk_drop_down_new(G_LIST_MODEL(gtk_string_list_new(words)), NULL);
    gtk_drop_down_set_factory(GTK_DROP_DOWN(drop), factory);
    g_object_unref(factory);
    gtk_widget_set_hexpand(drop, TRUE);
    return drop;
}

void viewer_clear_box(GtkWidget *box)
{
    GtkWidget *child;
    while ((child = gtk_widget_get_first_child(box))) gtk_box_remove(GTK_BOX(box), child);
}

void viewer_mark_wrong(GtkWidget *widget, GtkWidget *line, const char *message)
{
    if (message)
        gtk_widget_add_css_class(widget, "error");
    else
        gtk_widget_remove_css_class(widget, "error");
    gtk_label_set_text(GTK_LABEL(line), message ? message : "");
    gtk_widget_set_visible(line, message != NULL);
}

GtkWidget *viewer_error_line(void)
{
    GtkWidget *line = gtk_label_new(NULL);
    gtk_label_set_wrap(GTK_LABEL(line), TRUE);
    gtk_label_set_xalign(GTK_LABEL(line), 0);
    gtk_widget_add_css_class(line, "field-error");
    gtk_widget_set_visible(line, FALSE);
    return line;
}

bool viewer_settle(viewer *v, tl_status status, GtkWidget *widget, GtkWidget *line)
{
    viewer_mark_wrong(widget, line, status ? tl_ctx_message(v->ctx) : NULL);
    if (status)
        tl_ctx_clear(v->ctx);
    else
        viewer_changed(v);
    return !status;
}

/* ---- gestures ---- */

typedef struct watch {
    viewer *v;
    bool is_down;
} watch;

static gboolean watch_event(GtkEventControllerLegacy *controller, GdkEvent *event, watch *w)
{
    (void)controller;
    const GdkEventType type = gdk_event_get_event_type(event);
    if ((type == GDK_BUTTON_PRESS || type == GDK_TOUCH_BEGIN) && !w->is_down) {
        w->is_down = true;
        viewer_begin_gesture(w->v);
    } else if ((type == GDK_BUTTON_RELEASE || type == GDK_TOUCH_END || type == GDK_TOUCH_CANCEL ||
                type == GDK_GRAB_BROKEN) &&
               w->is_down) {
        w->is_down = false;
        viewer_end_gesture(w->v);
    }
    return FALSE;
}

static void watch_end(GtkWidget *widget, watch *w)
{
    (void)widget;
    if (w->is_down) viewer_end_gesture(w->v); /* goes away in the middle of a drag */
    g_free(w);
}

void viewer_watch_gesture(viewer *v, GtkWidget *widget)
{
    watch *w = g_new0(watch, 1);
    GtkEventController *events = gtk_event_controller_legacy_new();
    w->v = v;
    gtk_event_controller_set_propagation_phase(events, GTK_PHASE_CAPTURE);
    g_signal_connect(events, "event", G_CALLBACK(watch_event), w);
    gtk_widget_add_controller(widget, events);
    g_signal_connect(widget, "destroy", G_CALLBACK(watch_end), w);
}

/* ---- entries ---- */

typedef struct entry_watch {
    GtkWidget *entry;
    viewer_commit commit;
    void *user;
} entry_watch;

static const char *shown_of(GtkWidget *entry)
{
    const char *shown = g_object_get_data(G_OBJECT(entry), SHOWN);
    return shown ? shown : "";
}

static void set_shown(GtkWidget *entry, const char *text)
{
    g_object_set_data_full(G_OBJECT(entry), SHOWN, g_strdup(text), g_free);
}

static void commit_entry(entry_watch *w)
{
    if (strcmp(viewer_entry_text(w->entry), shown_of(w->entry)) == 0) return;
    if (w->commit(w->user)) set_shown(w->entry, viewer_entry_text(w->entry));
}

static gboolean entry_key(GtkEventControllerKey *keys, guint key, guint code, GdkModifierType state,
                          entry_watch *w)
{
    (void)keys;
    (void)code;
    (void)state;
    if (key != GDK_KEY_Escape) return FALSE;
    gtk_editable_set_text(GTK_EDITABLE(w->entry), shown_of(w->entry));
    gtk_editable_select_region(GTK_EDITABLE(w->entry), 0, -1);
    return TRUE;
}

GtkWidget *viewer_entry_create(int width_chars, viewer_commit commit, void *user)
{
    entry_watch *w = g_new0(entry_watch, 1);
    *w = (entry_watch){gtk_entry_new(), commit, user};
    gtk_editable_set_width_chars(GTK_EDITABLE(w->entry), width_chars);
    gtk_editable_set_max_width_chars(GTK_EDITABLE(w->entry), width_chars);
    g_object_set_data_full(G_OBJECT(w->entry), "tetralod-watch", w, g_free);
    g_signal_connect_swapped(w->entry, "activate", G_CALLBACK(commit_entry), w);
    GtkEventController *focus = gtk_event_controller_focus_new();
    g_signal_connect_swapped(focus, "leave", G_CALLBACK(commit_entry), w);
    gtk_widget_add_controller(w->entry, focus);
    GtkEventController *keys = gtk_event_controller_key_new();
    gtk_event_controller_set_propagation_phase(keys, GTK_PHASE_CAPTURE);
    g_signal_connect(keys, "key-pressed", G_CALLBACK(entry_key), w);
    gtk_widget_add_controller(w->entry, keys);
    return w->entry;
}

const char *viewer_entry_text(GtkWidget *entry)
{
    return gtk_editable_get_text(GTK_EDITABLE(entry));
}

void viewer_entry_show(GtkWidget *entry, const char *text)
{
    const bool is_written = strcmp(viewer_entry_text(entry), shown_of(entry)) != 0;
    const bool has_keys = gtk_widget_get_state_flags(entry) & GTK_STATE_FLAG_FOCUS_WITHIN;
    if (is_written && has_keys) return;
    set_shown(entry, text);
    if (strcmp(viewer_entry_text(entry), text) != 0)
        gtk_editable_set_text(GTK_EDITABLE(entry), text);
}

void viewer_entry_show_number(GtkWidget *entry, double value)
{
    char text[VIEWER_NUMBER_BYTES];
    viewer_number_text(value, text);
    viewer_entry_show(entry, text);
}

/* LC_NUMERIC of the program is "C": this asks what it would be. */
static bool user_has_commas(void)
{
    const locale_t own = newlocale(LC_NUMERIC_MASK, "", (locale_t)0);
    const bool commas = own && strcmp(nl_langinfo_l(RADIXCHAR, own), ",") == 0;
    if (own) freelocale(own);
    return commas;
}

char *viewer_entry_numbers(GtkWidget *entry)
{
    char *text = g_strstrip(g_strdup(viewer_entry_text(entry)));
    if (!user_has_commas()) return text;
    for (char *word = text; *word;) {
        const size_t length = strcspn(word, " \t");
        char *comma = memchr(word, ',', length);
        const size_t left = comma ? (size_t)(word + length - comma) - 1 : 0;
        if (left && g_ascii_isdigit(comma[1]) && !memchr(comma + 1, ',', left) &&
            !memchr(word, '.', length))
            *comma = '.';
        word += length;
        word += strspn(word, " \t");
    }
    return text;
}

bool viewer_entry_number(GtkWidget *entry, double *value)
{
    char *text = viewer_entry_numbers(entry), *end;
    *value = g_ascii_strtod(text, &end);
    const bool is_number = *text && !*end && isfinite(*value);
    g_free(text);
    return is_number;
}

/* ---- numbers ---- */

void viewer_number_text(double value, char text[VIEWER_NUMBER_BYTES])
{
    g_ascii_formatd(text, VIEWER_NUMBER_BYTES, "%.6g", value);
}
