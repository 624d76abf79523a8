/* The list of colour maps, each with its colours beside its name. */
#include "viewer_maps.h"

#include <math.h>

#include "viewer_points.h"

enum { SWATCH_WIDTH = 72, SWATCH_HEIGHT = 14, NAME_CHARS = 11 };

/* NULL: there is no such map. */
static GdkTexture *swatch_of(const char *name)
{
    size_t count;
    const tl_color_point *map = tl_colormap(name, &count);
    if (!map) return NULL;
    viewer_curve *curve = g_new0(viewer_curve, 1);
    guchar *pixels = g_malloc((gsize)3 * SWATCH_WIDTH * SWATCH_HEIGHT), *p = pixels;
    viewer_colors_take(curve, map, count);
    for (int y = 0; y < SWATCH_HEIGHT; y++)
        for (int x = 0; x < SWATCH_WIDTH; x++) {
            double rgb[3];
            viewer_curve_at(curve, false, (x + 0.5) / SWATCH_WIDTH, rgb);
            for (int k = 0; k < 3; k++) *p++ = (guchar)lround(255 * rgb[k]);
        }
    GBytes *bytes = g_bytes_new_take(pixels, (gsize)3 * SWATCH_WIDTH * SWATCH_HEIGHT);
    GdkTexture *texture = gdk_memory_texture_new(SWATCH_WIDTH, SWATCH_HEIGHT, GDK_MEMORY_R8G8B8,
                                                 bytes, (gsize)3 * SWATCH_WIDTH);
    g_bytes_unref(bytes);
    g_free(curve);
    return texture;
}

static void setup_map(GtkSignalListItemFactory *factory, GtkListItem *item, gpointer user)
{
    (void)factory;
    (void)user;
    GtkWidget *row = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 8), *swatch = gtk_picture_new();
    gtk_widget_set_size_request(swatch, SWATCH_WIDTH, SWATCH_HEIGHT);
    gtk_widget_set_valign(swatch, GTK_ALIGN_CENTER);
    gtk_widget_add_css_class(swatch, "swatch");
    GtkWidget *label = gtk_label_new(NULL); /* one width for all names: the panel stays as wide */
    gtk_label_set_width_chars(GTK_LABEL(label), NAME_CHARS);
    gtk_label_set_max_width_chars(GTK_LABEL(label), NAME_CHARS);
    gtk_label_set_ellipsize(GTK_LABEL(label), PANGO_ELLIPSIZE_END);
    gtk_label_set_xalign(GTK_LABEL(label), 0);
    gtk_box_append(GTK_BOX(row), swatch);
    gtk_box_append(GTK_BOX(row), label);
    gtk_list_item_set_child(item, row);
}

static void bind_map(GtkSignalListItemFactory *factory, GtkListItem *item, gpointer user)
{
    (void)factory;
    (void)user;
    const char *name = gtk_string_object_get_string(gtk_list_item_get_item(item));
    GtkWidget *swatch = gtk_widget_get_first_child(gtk_list_item_get_child(item));
    GdkTexture *texture = swatch_of(name);
    gtk_picture_set_paintable(GTK_PICTURE(swatch), GDK_PAINTABLE(texture));
    gtk_label_set_text(GTK_LABEL(gtk_widget_get_next_sibling(swatch)), name);
    gtk_widget_set_visible(swatch, texture != NULL);
    g_clear_object(&texture);
}

GtkWidget *viewer_maps_create(const char *none)
{
    GtkStringList *names = gtk_string_list_new(tl_node_prop(TL_NODE_TRANSFER, "map")->choices);
    gtk_string_list_append(names, none);
    GtkListItemFactory *factory = gtk_signal_list_item_factory_new();
    g_signal_connect(factory, "setup", G_CALLBACK(setup_map), NULL);
    g_signal_connect(factory, "bind", G_CALLBACK(bind_map), NULL);
    GtkWidget *list = gtk_drop_down_new(G_LIST_MODEL(names), NULL);
    gtk_drop_down_set_factory(GTK_DROP_DOWN(list), factory);
    g_object_unref(factory);
    return list;
}
