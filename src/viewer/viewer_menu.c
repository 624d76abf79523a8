/* The menus. Actions stand in the tables of the parts. */
#include "viewer_core.h"

static GMenu *section(GMenu *menu, const char *const *rows)
{
    GMenu *part = g_menu_new();
    for (; *rows; rows += 2) g_menu_append(part, rows[0], rows[1]);
    g_menu_append_section(menu, NULL, G_MENU_MODEL(part));
    g_object_unref(part);
    return part;
}

GMenuModel *viewer_menu_views(void)
{
    static const char *const FIT[] = {"_Fit all", "win.fit", "_Isometric", "win.view-iso", NULL};
    static const char *const SIDES[] = {"From the front (−y)",
                                        "win.view-front",
                                        "From the back (+y)",
                                        "win.view-back",
                                        "From the left (−x)",
                                        "win.view-left",
                                        "From the right (+x)",
                                        "win.view-right",
                                        "From above (+z)",
                                        "win.view-top",
                                        "From below (−z)",
                                        "win.view-bottom",
                                        NULL};
    static const char *const WAYS[] = {"_Parallel, no perspective", "win.parallel", "_Spin",
                                       "win.spin", NULL};
    GMenu *menu = g_menu_new();
    section(menu, FIT);
    section(menu, SIDES);
    section(menu, WAYS);
    return G_MENU_MODEL(menu);
}

GMenuModel *viewer_menu_main(viewer *v)
{
    static const char *const OPEN[] = {"_Open…", "win.open", "Build a _model…", "win.build-model",
                                       NULL};
    static const char *const SCENES[] = {"Open s_cene…", "win.open-scene", "_Save scene…",
                                         "win.save-scene", NULL};
    static const char *const PICTURES[] = {"Save _picture…", "win.save-picture", "Save f_rames…",
                                           "win.save-frames", NULL};
    static const char *const WINDOW[] = {
        "_Panels",  "win.panel", "_Full screen", "win.full-screen", "_Dark window",
        "win.dark", NULL};
    static const char *const HELP[] = {"_Keys and gestures", "win.keys", "_About", "win.about",
                                       NULL};
    GMenu *menu = g_menu_new();
    GMenu *first = section(menu, OPEN);
    g_menu_insert_submenu(first, 1, "Open _recent", G_MENU_MODEL(viewer_files_recent_menu(v)));
    section(menu, SCENES);
    section(menu, PICTURES);
    section(menu, WINDOW);
    section(menu, HELP);
    return G_MENU_MODEL(menu);
}
