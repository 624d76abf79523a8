/* Actions: one table of names, keys and functions, to which the parts add rows. Menus name them,
 * keys run them, the page of keys lists them. */
#include "viewer_core.h"

#include <stdio.h>
#include <string.h>

#define COLUMNS 3
enum { KEY_CHARS = 18, LABEL_CHARS = 26 };       /* of the columns of the page */
static const char ROW_KEY[] = "tetralod-action"; /* what a row of the page is about */

typedef struct row {
    const viewer_action *action;
    GSimpleAction *simple; /* NULL of a gesture */
} row;

struct viewer_keys {
    GArray *rows;
    const viewer_action *ran; /* last; NULL: none yet */
};

/* ---- running ---- */

static void refresh(viewer *v, void *user)
{
    (void)user;
    for (guint i = 0; i < v->keys->rows->len; i++) {
        const row r = g_array_index(v->keys->rows, row, i);
        if (!r.simple || !r.action->is_on) continue;
        GVariant *state = g_variant_new_boolean(r.action->is_on(v));
        g_simple_action_set_state(r.simple, state);
    }
    GAction *undo = g_action_map_lookup_action(G_ACTION_MAP(v->window), "undo");
    GAction *redo = g_action_map_lookup_action(G_ACTION_MAP(v->window), "redo");
    if (undo)
        g_simple_action_set_enabled(G_SIMPLE_ACTION(undo), tl_scene_undo_name(v->scene) != NULL);
    if (redo)
        g_simple_action_set_enabled(G_SIMPLE_ACTION(redo), tl_scene_redo_name(v->scene) != NULL);
}

static void on_activate(GSimpleAction *simple, GVariant *parameter, gpointer data)
{
    (void)parameter;
    viewer *v = data;
    for (guint i = 0; i < v->keys->rows->len; i++) {
        const row r = g_array_index(v->keys->rows, row, i);
        if (r.simple != simple) continue;
        v->keys->ran = r.action;
        r.action->run(v);
        break;
    }
    refresh(v, NULL);
}

static bool same_key(const char *a, guint key, GdkModifierType modifiers)
{
    guint of_a;
    GdkModifierType with_a;
    return gtk_accelerator_parse(a, &of_a, &with_a) && of_a == gdk_keyval_to_lower(key) &&
           with_a == modifiers;
}

/* The action with one of its keys; NULL if there is none. */
static const viewer_action *find_key(viewer *v, guint key, GdkModifierType modifiers)
{
    const viewer_action *found = NULL;
    for (guint i = 0; i < v->keys->rows->len && !found; i++) {
        const viewer_action *action = g_array_index(v->keys->rows, row, i).action;
        if (!action->run) continue;
        char **keys = g_strsplit(action->keys, " ", -1);
        for (int k = 0; keys[k]; k++)
            if (*keys[k] && same_key(keys[k], key, modifiers)) found = action;
        g_strfreev(keys);
    }
    return found;
}

static void run(viewer *v, const viewer_action *action)
{
    g_action_group_activate_action(G_ACTION_GROUP(v->window), action->name, NULL);
}

bool viewer_keys_run(viewer *v, const char *key)
{
    guint keyval;
    GdkModifierType modifiers;
    const viewer_action *action = NULL;
    for (guint i = 0; i < v->keys->rows->len; i++) {
        const row r = g_array_index(v->keys->rows, row, i);
        if (r.simple && strcmp(r.action->name, key) == 0) action = r.action;
    }
    if (!action && gtk_accelerator_parse(key, &keyval, &modifiers))
        action = find_key(v, keyval, modifiers);
    if (action) run(v, action);
    return action != NULL;
}

/* Keys without a modifier come here after all widgets, so that text can be typed. */
static gboolean on_key(GtkEventControllerKey *controller, guint key, guint code,
                       GdkModifierType state, viewer *v)
{
    (void)controller, (void)code;
    const GdkModifierType all = gtk_accelerator_get_default_mod_mask();
    GdkModifierType modifiers = state & all;
    const viewer_action *action = find_key(v, key, modifiers);
    if (!action && modifiers == GDK_SHIFT_MASK) action = find_key(v, key, 0);
    if (!action) return GDK_EVENT_PROPAGATE;
    run(v, action);
    return GDK_EVENT_STOP;
}

/* Function keys and keys with a modifier are the window's wherever the focus is; menus show them.
 */
static bool is_global(const char *key)
{
    guint keyval;
    GdkModifierType modifiers;
    return gtk_accelerator_parse(key, &keyval, &modifiers) &&
           ((modifiers & ~(guint)GDK_SHIFT_MASK) ||
            (keyval >= GDK_KEY_F1 && keyval <= GDK_KEY_F35));
}

static void set_keys(viewer *v, const viewer_action *action)
{
    char *name = g_strconcat("win.", action->name, NULL);
    char **keys = g_strsplit(action->keys, " ", -1);
    const char *global[8] = {NULL};
    int count = 0;
    for (int k = 0; keys[k]; k++)
        if (count < 7 && is_global(keys[k])) global[count++] = keys[k];
    if (count) gtk_application_set_accels_for_action(v->app, name, global);
    g_strfreev(keys);
    g_free(name);
}

void viewer_add_actions(viewer *v, const viewer_action *actions, size_t action_count)
{
    for (size_t i = 0; i < action_count; i++) {
        row r = {.action = &actions[i]};
        if (r.action->run) {
            r.simple = r.action->is_on ? g_simple_action_new_stateful(r.action->name, NULL,
                                                                      g_variant_new_boolean(FALSE))
                                       : g_simple_action_new(r.action->name, NULL);
            g_signal_connect(r.simple, "activate", G_CALLBACK(on_activate), v);
            g_action_map_add_action(G_ACTION_MAP(v->window), G_ACTION(r.simple));
            set_keys(v, r.action);
        }
        g_array_append_val(v->keys->rows, r);
    }
    refresh(v, NULL);
}

/* ---- the page of keys ---- */

/* "F, Home"; of a gesture its name. */
static char *keys_text(const viewer_action *action)
{
    GString *text = g_string_new(action->run ? NULL : action->keys);
    char **names = g_strsplit(action->keys, " ", -1);
    for (int i = 0; action->run && names[i]; i++) {
        guint key;
        GdkModifierType modifiers;
        if (!gtk_accelerator_parse(names[i], &key, &modifiers)) continue;
        char *label = gtk_accelerator_get_label(key, modifiers);
        g_string_append_printf(text, "%s%s", i ? ", " : "", label);
        g_free(label);
    }
    g_strfreev(names);
    return g_string_free(text, FALSE);
}

static GtkWidget *make_row(const viewer_action *action)
{
    GtkWidget *box = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 12);
    GtkWidget *words[2];
    char *text = keys_text(action);
    for (int i = 0; i < 2; i++) {
        words[i] = gtk_label_new(i ? action->label : text);
        gtk_label_set_xalign(GTK_LABEL(words[i]), 0);
        gtk_label_set_yalign(GTK_LABEL(words[i]), 0);
        gtk_label_set_wrap(GTK_LABEL(words[i]), TRUE);
        gtk_label_set_width_chars(GTK_LABEL(words[i]), i ? LABEL_CHARS : KEY_CHARS);
        gtk_label_set_max_width_chars(GTK_LABEL(words[i]), i ? LABEL_CHARS : KEY_CHARS);
        gtk_box_append(GTK_BOX(box), words[i]);
    }
    g_free(text);
    gtk_widget_add_css_class(words[1], "dim-label");
    g_object_set_data(G_OBJECT(box), ROW_KEY, (void *)(uintptr_t)action);
    return box;
}

static GtkWidget *make_group(viewer *v, const char *group)
{
    GtkWidget *box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 3);
    GtkWidget *title = gtk_label_new(group);
    gtk_label_set_xalign(GTK_LABEL(title), 0);
    gtk_widget_add_css_class(title, "heading");
    gtk_box_append(GTK_BOX(box), title);
    for (guint i = 0; i < v->keys->rows->len; i++) {
        const viewer_action *action = g_array_index(v->keys->rows, row, i).action;
        if (*action->keys && strcmp(action->group, group) == 0)
            gtk_box_append(GTK_BOX(box), make_row(action));
    }
    gtk_widget_set_margin_bottom(box, 12);
    return box;
}

/* Groups in the order of their first rows, each into the column that is shortest. */
static GtkWidget *make_groups(viewer *v)
{
    GtkWidget *columns = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 36), *column[COLUMNS];
    int length[COLUMNS] = {0};
    GPtrArray *seen = g_ptr_array_new();
    for (int c = 0; c < COLUMNS; c++) {
        column[c] = gtk_box_new(GTK_ORIENTATION_VERTICAL, 6);
        gtk_box_append(GTK_BOX(columns), column[c]);
    }
    for (guint i = 0; i < v->keys->rows->len; i++) {
        const viewer_action *action = g_array_index(v->keys->rows, row, i).action;
        int rows = 2, best = 0;
        if (!*action->keys || !*action->group ||
            g_ptr_array_find_with_equal_func(seen, action->group, g_str_equal, NULL))
            continue;
        g_ptr_array_add(seen, (void *)(uintptr_t)action->group);
        for (guint k = 0; k < v->keys->rows->len; k++)
            rows += strcmp(g_array_index(v->keys->rows, row, k).action->group, action->group) == 0;
        for (int c = 1; c < COLUMNS; c++)
            if (length[c] < length[best]) best = c;
        length[best] += rows;
        gtk_box_append(GTK_BOX(column[best]), make_group(v, action->group));
    }
    g_ptr_array_free(seen, TRUE);
    return columns;
}

static void show_page(viewer *v)
{
    GtkWindow *window = viewer_dialog_window(v, "Keys and gestures");
    GtkWidget *scrolled = gtk_scrolled_window_new(), *groups = make_groups(v);
    gtk_scrolled_window_set_propagate_natural_height(GTK_SCROLLED_WINDOW(scrolled), TRUE);
    gtk_scrolled_window_set_propagate_natural_width(GTK_SCROLLED_WINDOW(scrolled), TRUE);
    gtk_scrolled_window_set_max_content_height(GTK_SCROLLED_WINDOW(scrolled), 640);
    gtk_widget_set_margin_start(groups, 24);
    gtk_widget_set_margin_end(groups, 24);
    gtk_widget_set_margin_top(groups, 18);
    gtk_widget_set_margin_bottom(groups, 18);
    gtk_scrolled_window_set_child(GTK_SCROLLED_WINDOW(scrolled), groups);
    gtk_window_set_child(window, scrolled);
    gtk_window_present(window);
}

GtkWindow *viewer_dialog_window(viewer *v, const char *title)
{
    GtkWindow *window = GTK_WINDOW(gtk_window_new());
    GtkEventController *controller = gtk_shortcut_controller_new();
    GtkShortcut *shortcut = gtk_shortcut_new(gtk_keyval_trigger_new(GDK_KEY_Escape, 0),
                                             gtk_named_action_new("window.close"));
    gtk_window_set_titlebar(window, gtk_header_bar_new());
    gtk_window_set_title(window, title);
    gtk_window_set_transient_for(window, v->window);
    gtk_window_set_destroy_with_parent(window, TRUE);
    gtk_window_set_modal(window, TRUE);
    gtk_shortcut_controller_add_shortcut(GTK_SHORTCUT_CONTROLLER(controller), shortcut);
    gtk_widget_add_controller(GTK_WIDGET(window), controller);
    return window;
}

static void print_action(const char *where, const viewer_action *action)
{
    printf("%s\t%s\t%s\t%s\t%s\n", where, action->name, action->keys, action->group, action->label);
}

static void print_page(GtkWidget *widget)
{
    const viewer_action *action = g_object_get_data(G_OBJECT(widget), ROW_KEY);
    if (action) print_action("page", action);
    for (GtkWidget *child = gtk_widget_get_first_child(widget); child;
         child = gtk_widget_get_next_sibling(child))
        print_page(child);
}

/* The table and what the page shows of it, or what ran last. */
static bool print_keys(viewer *v, const char *arguments)
{
    if (g_str_equal(arguments, "ran")) {
        if (v->keys->ran) print_action("ran", v->keys->ran);
        fflush(stdout);
        return true;
    }
    GtkWidget *page = g_object_ref_sink(make_groups(v));
    for (guint i = 0; i < v->keys->rows->len; i++)
        print_action("table", g_array_index(v->keys->rows, row, i).action);
    print_page(page);
    fflush(stdout);
    g_object_unref(page);
    return true;
}

static const viewer_command COMMANDS[] = {{"print-keys", "print-keys [ran]", print_keys}};
static const viewer_action ACTIONS[] = {
    {"keys", "F1 question <Control>question", "Window", "Keys and gestures", show_page, NULL},
};

/* ---- the part ---- */

void viewer_keys_attach(viewer *v)
{
    GtkEventController *keys = gtk_event_controller_key_new();
    v->keys = g_new0(struct viewer_keys, 1);
    v->keys->rows = g_array_new(FALSE, FALSE, sizeof(row));
    g_signal_connect(keys, "key-pressed", G_CALLBACK(on_key), v);
    gtk_widget_add_controller(GTK_WIDGET(v->window), keys);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_listen(v, VIEWER_SCENE, refresh, NULL);
    viewer_listen(v, VIEWER_CAMERA, refresh, NULL);
    viewer_listen(v, VIEWER_SOURCE, refresh, NULL);
}

void viewer_keys_commands(viewer *v)
{
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
}

void viewer_keys_destroy(viewer *v)
{
    for (guint i = 0; i < v->keys->rows->len; i++)
        g_clear_object(&g_array_index(v->keys->rows, row, i).simple);
    g_array_free(v->keys->rows, TRUE);
    g_free(v->keys);
}
