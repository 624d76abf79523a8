/* The window: a header bar, the view with messages above it and what parts put below it, the panels
 * at its right, a line of figures at the bottom. */
#include "viewer_core.h"
#define SIDE_WIDTH 380 /* at first, of a large window */
#define SIDE_WIDTH_LEAST 300

struct viewer_shell {
    GtkWidget *title, *subtitle;
    GtkWidget *paned;
    bool has_side;               /* panels are wanted, where something is open */
    GtkWidget *welcome, *recent; /* what is there instead of a picture */
};

static const char STYLE[] =
    "tetralod-picture { background-color: #1d1f22; }"
    ".tl-status { padding: 3px 12px; font-size: 0.9em; font-feature-settings: 'tnum'; }"
    ".tl-status label.tl-strong { font-weight: bold; }"
    ".tl-passing { opacity: 0.5; }"
    ".tl-subtitle { font-size: 0.85em; opacity: 0.65; }"
    ".tl-welcome { background-color: @theme_bg_color; }"
    ".tl-welcome .tl-heading { font-size: 1.5em; font-weight: 300; }"
    ".tl-pill { border-radius: 18px; padding: 6px 8px 6px 16px; }"
    ".tl-side { background-color: @theme_bg_color; }";

/* ---- what is there before a picture ---- */

static GtkWidget *make_welcome(viewer *v)
{
    GtkWidget *box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 12);
    GtkWidget *inner = gtk_box_new(GTK_ORIENTATION_VERTICAL, 12);
    GtkWidget *heading = gtk_label_new("Open a model or a mesh");
    GtkWidget *hint = gtk_label_new("Drop a file here, or choose one. Models (.tlod) open at once, "
                                    "whatever their size.");
    GtkWidget *button = gtk_button_new_with_mnemonic("_Open…");
    gtk_widget_add_css_class(heading, "tl-heading");
    gtk_widget_add_css_class(hint, "dim-label");
    gtk_label_set_wrap(GTK_LABEL(hint), TRUE);
    gtk_label_set_justify(GTK_LABEL(hint), GTK_JUSTIFY_CENTER);
    gtk_label_set_max_width_chars(GTK_LABEL(hint), 48);
    gtk_widget_add_css_class(button, "suggested-action");
    gtk_widget_add_css_class(button, "pill");
    gtk_widget_set_halign(button, GTK_ALIGN_CENTER);
    gtk_actionable_set_action_name(GTK_ACTIONABLE(button), "win.open");
    v->shell->recent = gtk_box_new(GTK_ORIENTATION_VERTICAL, 2);
    gtk_widget_set_margin_top(v->shell->recent, 12);
    gtk_widget_set_halign(v->shell->recent, GTK_ALIGN_CENTER);
    gtk_box_append(GTK_BOX(inner), heading);
    gtk_box_append(GTK_BOX(inner), hint);
    gtk_box_append(GTK_BOX(inner), button);
    gtk_box_append(GTK_BOX(inner), v->shell->recent);
    gtk_widget_set_valign(inner, GTK_ALIGN_CENTER);
    gtk_widget_set_vexpand(inner, TRUE);
    gtk_widget_add_css_class(box, "tl-welcome");
    gtk_box_append(GTK_BOX(box), inner);
    v->shell->welcome = box;
    return box;
}

/* Recent files as buttons that open them. */
static void fill_recent(viewer *v)
{
    GtkWidget *child;
    char **paths = viewer_session_recent(v);
    while ((child = gtk_widget_get_first_child(v->shell->recent)))
        gtk_box_remove(GTK_BOX(v->shell->recent), child);
    for (int i = 0; paths[i] && i < 5; i++) {
        char *name = g_path_get_basename(paths[i]);
        GtkWidget *button = gtk_button_new_with_label(name);
        gtk_widget_add_css_class(button, "flat");
        gtk_widget_set_tooltip_text(button, paths[i]);
        gtk_actionable_set_action_name(GTK_ACTIONABLE(button), "win.open-recent");
        gtk_actionable_set_action_target(GTK_ACTIONABLE(button), "s", paths[i]);
        gtk_box_append(GTK_BOX(v->shell->recent), button);
        g_free(name);
    }
    g_strfreev(paths);
}

/* Panels have their room from the beginning of opening on, so that pictures have their size. */
static void show_side(viewer *v)
{
    gtk_widget_set_visible(v->side, v->shell->has_side && (v->source || !viewer_files_idle(v)));
}

void viewer_window_retitle(viewer *v)
{
    char *name = v->path ? g_path_get_basename(v->path) : g_strdup("tetralod");
    char *about = g_strdup("");
    if (v->source) {
        const tl_source_facts *facts = tl_source_get_facts(v->source);
        char *tets = viewer_count_text((double)facts->tets);
        g_free(about);
        about = g_strdup_printf("%s tets%s", tets, facts->is_model ? ", model" : "");
        g_free(tets);
    }
    gtk_label_set_text(GTK_LABEL(v->shell->title), name);
    gtk_label_set_text(GTK_LABEL(v->shell->subtitle), about);
    gtk_widget_set_visible(v->shell->subtitle, *about != '\0');
    char *title = v->path ? g_strdup_printf("%s – tetralod", name) : g_strdup(name);
    gtk_window_set_title(v->window, title);
    gtk_widget_set_visible(v->shell->welcome, !v->source && viewer_files_idle(v));
    fill_recent(v);
    show_side(v);
    g_free(title);
    g_free(about);
    g_free(name);
}

/* ---- the header bar ---- */

static GtkWidget *icon_button(const char *icon, const char *action, const char *tip)
{
    GtkWidget *button = gtk_button_new_from_icon_name(icon);
    gtk_actionable_set_action_name(GTK_ACTIONABLE(button), action);
    gtk_widget_set_tooltip_text(button, tip);
    gtk_widget_set_focus_on_click(button, FALSE);
    return button;
}

static GtkWidget *make_title(viewer *v)
{
    GtkWidget *box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    v->shell->title = gtk_label_new("tetralod");
    v->shell->subtitle = gtk_label_new("");
    gtk_label_set_ellipsize(GTK_LABEL(v->shell->title), PANGO_ELLIPSIZE_MIDDLE);
    gtk_widget_add_css_class(v->shell->title, "title");
    gtk_widget_add_css_class(v->shell->subtitle, "tl-subtitle");
    gtk_widget_set_valign(box, GTK_ALIGN_CENTER);
    gtk_box_append(GTK_BOX(box), v->shell->title);
    gtk_box_append(GTK_BOX(box), v->shell->subtitle);
    return box;
}

static GtkWidget *make_header(viewer *v)
{
    GtkWidget *header = gtk_header_bar_new(), *menu = gtk_menu_button_new();
    GtkWidget *open = gtk_button_new_with_mnemonic("_Open");
    GtkWidget *views = gtk_menu_button_new();
    GtkWidget *side = gtk_toggle_button_new();
    GMenuModel *main_menu = viewer_menu_main(v), *view_menu = viewer_menu_views();
    gtk_actionable_set_action_name(GTK_ACTIONABLE(open), "win.open");
    gtk_widget_set_tooltip_text(open, "Open a model or a mesh (Ctrl+O)");
    gtk_header_bar_pack_start(GTK_HEADER_BAR(header), open);
    gtk_header_bar_pack_start(GTK_HEADER_BAR(header),
                              icon_button("edit-undo-symbolic", "win.undo", "Undo (Ctrl+Z)"));
    gtk_header_bar_pack_start(GTK_HEADER_BAR(header),
                              icon_button("edit-redo-symbolic", "win.redo", "Redo (Ctrl+Shift+Z)"));
    gtk_header_bar_set_title_widget(GTK_HEADER_BAR(header), make_title(v));
    gtk_menu_button_set_icon_name(GTK_MENU_BUTTON(menu), "open-menu-symbolic");
    gtk_menu_button_set_menu_model(GTK_MENU_BUTTON(menu), main_menu);
    gtk_menu_button_set_primary(GTK_MENU_BUTTON(menu), TRUE);
    gtk_widget_set_tooltip_text(menu, "Menu (F10)");
    gtk_menu_button_set_label(GTK_MENU_BUTTON(views), "View");
    gtk_menu_button_set_menu_model(GTK_MENU_BUTTON(views), view_menu);
    gtk_widget_set_tooltip_text(views, "Sides to look from");
    gtk_button_set_icon_name(GTK_BUTTON(side), "sidebar-show-right-symbolic");
    gtk_actionable_set_action_name(GTK_ACTIONABLE(side), "win.panel");
    gtk_widget_set_tooltip_text(side, "Panels (F9)");
    gtk_header_bar_pack_end(GTK_HEADER_BAR(header), menu);
    gtk_header_bar_pack_end(GTK_HEADER_BAR(header), side);
    gtk_header_bar_pack_end(
        GTK_HEADER_BAR(header),
        icon_button("camera-photo-symbolic", "win.save-picture", "Save a picture (Ctrl+P)"));
    gtk_header_bar_pack_end(GTK_HEADER_BAR(header), icon_button("zoom-fit-best-symbolic", "win.fit",
                                                                "Fit all into view (F)"));
    gtk_header_bar_pack_end(GTK_HEADER_BAR(header), views);
    g_object_unref(main_menu);
    g_object_unref(view_menu);
    return header;
}

/* ---- switches ---- */

static void toggle_full(viewer *v)
{
    if (gtk_window_is_fullscreen(v->window))
        gtk_window_unfullscreen(v->window);
    else
        gtk_window_fullscreen(v->window);
}

static bool is_full(const viewer *v)
{
    return gtk_window_is_fullscreen(v->window);
}

static void toggle_panel(viewer *v)
{
    v->shell->has_side = !v->shell->has_side;
    show_side(v);
}

static bool has_panel(const viewer *v)
{
    return v->shell->has_side;
}

bool viewer_window_is_dark(const viewer *v)
{
    (void)v;
    gboolean dark = FALSE;
    g_object_get(gtk_settings_get_default(), "gtk-application-prefer-dark-theme", &dark, NULL);
    return dark;
}

static void set_dark(bool dark)
{
    g_object_set(gtk_settings_get_default(), "gtk-application-prefer-dark-theme", (gboolean)dark,
                 NULL);
}

static void toggle_dark(viewer *v)
{
    set_dark(!viewer_window_is_dark(v));
    viewer_files_restyle(v);
}

static void close_window(viewer *v)
{
    gtk_window_close(v->window);
}

static void show_about(viewer *v)
{
    const int version = tl_version();
    char *text = g_strdup_printf("%d.%d.%d", version / 10000, version / 100 % 100, version % 100);
    gtk_show_about_dialog(v->window, "program-name", "tetralod", "version", text, "comments",
                          "Tetrahedral meshes of any size, at a known error", "logo-icon-name", "",
                          NULL);
    g_free(text);
}

static const viewer_action ACTIONS[] = {
    {"about", "", "Window", "About", show_about, NULL},
    {"full-screen", "F11", "Window", "Full screen", toggle_full, is_full},
    {"panel", "F9", "Window", "Panels", toggle_panel, has_panel},
    {"dark", "<Control>d", "Window", "Dark window", toggle_dark, viewer_window_is_dark},
    {"close", "<Control>q <Control>w", "Window", "Close", close_window, NULL},
};

/* ---- pictures of the window ---- */

GdkTexture *viewer_window_texture(viewer *v)
{
    GtkWidget *widget = GTK_WIDGET(v->window);
    GskRenderer *renderer = gtk_native_get_renderer(GTK_NATIVE(v->window));
    GdkPaintable *paintable = gtk_widget_paintable_new(widget);
    GtkSnapshot *snapshot = gtk_snapshot_new();
    /* with its frame, which the widget's width and height leave out */
    gdk_paintable_snapshot(paintable, snapshot, gdk_paintable_get_intrinsic_width(paintable),
                           gdk_paintable_get_intrinsic_height(paintable));
    GskRenderNode *node = gtk_snapshot_free_to_node(snapshot);
    GdkTexture *texture =
        node && renderer ? gsk_renderer_render_texture(renderer, node, NULL) : NULL;
    if (node) gsk_render_node_unref(node);
    g_object_unref(paintable);
    return texture;
}

/* ---- the part ---- */

static GtkWidget *make_view(viewer *v)
{
    GtkWidget *column = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0), *overlay = gtk_overlay_new();
    v->picture = viewer_picture_create(v);
    v->below = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    gtk_widget_set_size_request(v->picture, 240, 180);
    gtk_overlay_set_child(GTK_OVERLAY(overlay), v->picture);
    gtk_overlay_add_overlay(GTK_OVERLAY(overlay), make_welcome(v));
    gtk_overlay_add_overlay(GTK_OVERLAY(overlay), viewer_messages_progress(v));
    gtk_overlay_add_overlay(GTK_OVERLAY(overlay), viewer_messages_bar(v));
    gtk_widget_set_vexpand(overlay, TRUE);
    gtk_box_append(GTK_BOX(column), overlay);
    gtk_box_append(GTK_BOX(column), v->below);
    return column;
}

static GtkWidget *make_side(viewer *v)
{
    v->side = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    gtk_widget_set_size_request(v->side, SIDE_WIDTH_LEAST, -1);
    gtk_widget_add_css_class(v->side, "tl-side");
    return v->side;
}

static void on_signal(viewer *v, void *user)
{
    (void)user;
    viewer_window_retitle(v);
}

void viewer_window_attach(viewer *v)
{
    GtkWidget *column = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
    GtkCssProvider *style = gtk_css_provider_new();
    int width = 1280, height = 860;
    bool dark = true;
    viewer_session_window(v, &width, &height, &dark);
    if (v->words->width) width = v->words->width, height = v->words->height;
    set_dark(dark);
    v->shell = g_new0(struct viewer_shell, 1);
    gtk_css_provider_load_from_data(style, STYLE, -1);
    gtk_style_context_add_provider_for_display(gdk_display_get_default(), GTK_STYLE_PROVIDER(style),
                                               GTK_STYLE_PROVIDER_PRIORITY_APPLICATION);
    g_object_unref(style);
    v->window = GTK_WINDOW(gtk_application_window_new(v->app));
    gtk_window_set_default_size(v->window, width, height);
    viewer_messages_attach(v);
    viewer_keys_attach(v);
    v->shell->paned = gtk_paned_new(GTK_ORIENTATION_HORIZONTAL);
    gtk_paned_set_start_child(GTK_PANED(v->shell->paned), make_view(v));
    gtk_paned_set_end_child(GTK_PANED(v->shell->paned), make_side(v));
    gtk_paned_set_resize_end_child(GTK_PANED(v->shell->paned), FALSE);
    gtk_paned_set_shrink_start_child(GTK_PANED(v->shell->paned), FALSE);
    gtk_paned_set_shrink_end_child(GTK_PANED(v->shell->paned), FALSE);
    gtk_paned_set_position(GTK_PANED(v->shell->paned),
                           width - CLAMP(width * 3 / 10, SIDE_WIDTH_LEAST, SIDE_WIDTH));
    gtk_widget_set_vexpand(v->shell->paned, TRUE);
    v->shell->has_side = true;
    show_side(v);
    gtk_box_append(GTK_BOX(column), v->shell->paned);
    gtk_box_append(GTK_BOX(column), gtk_separator_new(GTK_ORIENTATION_HORIZONTAL));
    gtk_box_append(GTK_BOX(column), viewer_status_create(v));
    gtk_window_set_child(v->window, column);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    gtk_window_set_titlebar(v->window, make_header(v));
    viewer_listen(v, VIEWER_SOURCE, on_signal, NULL);
}

void viewer_window_destroy(viewer *v)
{
    viewer_messages_end(v);
    gtk_window_destroy(v->window);
    g_free(v->shell);
}
