/* Channels of the data set and those that the scene derives, with their units, to choose from. */
#include <string.h>

#include "viewer_field.h"

/* Streamlines follow vectors. */
static bool wants_vectors(const viewer_field *field)
{
    return tl_scene_kind(field->v->scene, field->node) == TL_NODE_LINES &&
           strcmp(field->info->name, "channel") == 0;
}

static void add_name(viewer_field *field, GtkStringList *words, const char *name, const char *unit)
{
    char *word = unit && *unit ? g_strdup_printf("%s [%s]", name, unit) : g_strdup(name);
    gtk_string_list_append(words, word);
    g_ptr_array_add(field->names, g_strdup(name));
    g_free(word);
}

static bool has_name(const viewer_field *field, const char *name)
{
    for (guint i = 0; i < field->names->len; i++)
        if (strcmp(field->names->pdata[i], name) == 0) return true;
    return false;
}

/* "speed" of "speed=mag(velocity)". */
static void add_derived(viewer_field *field, GtkStringList *words)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(field->v->scene, &count);
    for (size_t i = 0; i < count; i++) {
        if (tl_scene_kind(field->v->scene, nodes[i]) != TL_NODE_DERIVE) continue;
        const char *text = tl_scene_text(field->v->scene, nodes[i], "text");
        const char *sign = strchr(text, '=');
        if (!sign) continue;
        char *name = g_strstrip(g_strndup(text, (gsize)(sign - text)));
        if (*name && !has_name(field, name)) add_name(field, words, name, NULL);
        g_free(name);
    }
}

static GtkStringList *list_names(viewer_field *field, const char *now)
{
    const bool vectors = wants_vectors(field);
    GtkStringList *words = gtk_string_list_new(NULL);
    g_ptr_array_set_size(field->names, 0);
    gtk_string_list_append(words, field->style.empty ? field->style.empty : "none");
    g_ptr_array_add(field->names, g_strdup(""));
    if (field->v->source) {
        const tl_source_facts *facts = tl_source_get_facts(field->v->source);
        for (size_t i = 0; i < facts->channel_count; i++)
            if (!vectors || facts->channels[i].components == 3)
                add_name(field, words, facts->channels[i].name, facts->channels[i].unit);
    }
    add_derived(field, words);
    if (!has_name(field, now)) add_name(field, words, now, NULL); /* a formula */
    return words;
}

/* Other words are put there only if they are others: an open list would close. */
static void take_words(GtkDropDown *drop, GtkStringList *words)
{
    GtkStringList *old = GTK_STRING_LIST(gtk_drop_down_get_model(drop));
    const guint count = g_list_model_get_n_items(G_LIST_MODEL(words));
    bool same = old && g_list_model_get_n_items(G_LIST_MODEL(old)) == count;
    for (guint i = 0; same && i < count; i++)
        same =
            strcmp(gtk_string_list_get_string(old, i), gtk_string_list_get_string(words, i)) == 0;
    if (!same) gtk_drop_down_set_model(drop, G_LIST_MODEL(words));
}

static void fill_channel(viewer_field *field)
{
    const char *now = tl_scene_text(field->v->scene, field->node, field->info->name);
    GtkStringList *words = list_names(field, now);
    take_words(GTK_DROP_DOWN(field->main), words);
    g_object_unref(words);
    guint at = 0;
    while (at + 1 < field->names->len && strcmp(field->names->pdata[at], now) != 0) at++;
    gtk_drop_down_set_selected(GTK_DROP_DOWN(field->main), at);
}

/* Values of the channel before mean nothing in the next one, where they may be nowhere. */
static tl_status forget_values(viewer_field *field)
{
    static const char *const VALUES[2][2] = {{"value", NULL}, {"low", "high"}};
    viewer *v = field->v;
    tl_value value;
    tl_status st = TL_OK;
    const tl_node_kind kind = tl_scene_kind(v->scene, field->node);
    const char *const *names = VALUES[kind == TL_NODE_THRESHOLD];
    const bool has_values = kind == TL_NODE_SURFACE || kind == TL_NODE_THRESHOLD;
    if (!has_values || strcmp(field->info->name, "channel") != 0) return TL_OK;
    for (int i = 0; !st && i < 2 && names[i]; i++) {
        st = tl_scene_get(v->ctx, v->scene, field->node, names[i], &value);
        if (!st && value.count)
            st = tl_scene_set_text(v->ctx, v->scene, field->node, names[i], "auto");
    }
    return st;
}

static void channel_changed(GtkDropDown *drop, GParamSpec *spec, viewer_field *field)
{
    (void)spec;
    viewer *v = field->v;
    const guint chosen = gtk_drop_down_get_selected(drop);
    if (field->is_filling || chosen >= field->names->len) return;
    tl_scene_seal(v->scene);
    tl_status st = tl_scene_begin(v->ctx, v->scene, "channel");
    if (!st) {
        st = tl_scene_set_text(v->ctx, v->scene, field->node, field->info->name,
                               chosen ? field->names->pdata[chosen] : "none");
        if (!st) st = forget_values(field);
        const tl_status end = tl_scene_end(v->ctx, v->scene, !st);
        if (!st) st = end;
    }
    viewer_settle(v, st, field->main, field->error);
    tl_scene_seal(v->scene);
}

void viewer_field_add_channel(viewer_field *field, GtkWidget *row)
{
    static const char *const NOTHING[] = {NULL};
    field->names = g_ptr_array_new_with_free_func(g_free);
    field->main = viewer_drop_create(NOTHING);
    field->fill = fill_channel;
    g_signal_connect(field->main, "notify::selected", G_CALLBACK(channel_changed), field);
    gtk_box_append(GTK_BOX(row), field->main);
}
