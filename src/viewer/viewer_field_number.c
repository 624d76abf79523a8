/* Numbers: a slider over what people use, and an entry for any value that the scene takes. */
#include "viewer_field.h"
#include "viewer_things.h"

#include <math.h>
#include <string.h>

/* Pixels that a slider's steps are for, and how far from its low end a logarithmic one without a
 * smallest value begins. */
enum { SLIDER_PX = 200 };
static const double DECADES = 1e-4;

/* ---- the slider's ends ---- */

/* Of a channel, or what is shown of a formula. */
static bool channel_range(const viewer_field *field, const char *name, double range[2])
{
    const tl_source_channel *channel = viewer_channel_named(field->v, name);
    const tl_values *values = field->v->frame && field->v->frame->content
                                  ? tl_content_values(field->v->frame->content, name)
                                  : NULL;
    if (channel)
        memcpy(range, channel->range, sizeof channel->range);
    else if (values) {
        range[0] = values->least;
        range[1] = values->most;
    }
    return channel || values;
}

bool viewer_field_range(const viewer_field *field, double range[2])
{
    const bool is_error = strstr(field->info->name, "error") != NULL;
    const char *prop = is_error ? "error_channel" : "channel";
    if (!field->v->source) return false;
    const tl_source_facts *facts = tl_source_get_facts(field->v->source);
    if (strcmp(field->info->unit, "mesh units") == 0) {
        range[0] = 0;
        range[1] = facts->diagonal / 10;
    } else if (strcmp(field->info->unit, "channel") == 0) {
        const char *name = tl_scene_text(field->v->scene, field->node, prop);
        if (is_error && !*name && facts->channel_count) name = facts->channels[0].name;
        if (!channel_range(field, name, range)) return false;
        if (is_error) {
            range[1] -= range[0];
            range[0] = 0;
        }
    } else {
        return false;
    }
    return range[0] < range[1];
}

/* false: no slider. */
static bool axis_of(const viewer_field *field, viewer_axis *axis)
{
    const tl_prop_info *info = field->info;
    double range[2] = {info->least, info->most};
    if (field->style.low < field->style.high) {
        range[0] = field->style.low;
        range[1] = field->style.high;
    } else if (!(info->most - info->least <= 1000) && !viewer_field_range(field, range)) {
        return false;
    }
    if (info->logarithmic && !(range[0] > 0)) range[0] = range[1] * DECADES;
    *axis = (viewer_axis){{range[0], range[1]}, info->logarithmic, 0, SLIDER_PX};
    return range[0] < range[1];
}

/* ---- values ---- */

/* The number that stands for a word. */
static double word_value(const viewer_field *field)
{
    return field->info->least < 0 && strcmp(field->info->name, "opacity") == 0 ? -1 : 0;
}

static bool is_word(const viewer_field *field, const tl_value *value)
{
    return !value->count || (field->style.empty && value->reals[0] == word_value(field));
}

static void fill_number(viewer_field *field)
{
    tl_value value;
    viewer_axis axis;
    if (tl_scene_get(field->v->ctx, field->v->scene, field->node, field->info->name, &value))
        return;
    const bool word = is_word(field, &value);
    if (word)
        viewer_entry_show(field->main, "");
    else
        viewer_entry_show_number(field->main, value.reals[0]);
    const bool has_axis = axis_of(field, &axis);
    gtk_widget_set_visible(field->slider, has_axis);
    gtk_widget_set_hexpand(field->main, !has_axis);
    if (!has_axis) return;
    /* "no limit" is beyond all limits; other words stand for what is low */
    const bool at_end =
        word && g_str_has_prefix(field->style.empty ? field->style.empty : "", "no l");
    double at = word ? at_end ? SLIDER_PX : 0 : viewer_axis_px(&axis, value.reals[0]);
    gtk_range_set_value(GTK_RANGE(field->slider), fmin(fmax(at, 0), SLIDER_PX));
    gtk_widget_set_opacity(field->slider, word ? 0.5 : 1);
}

static gboolean slid(GtkRange *slider, GtkScrollType scroll, double at, viewer_field *field)
{
    viewer_axis axis;
    (void)slider;
    (void)scroll;
    if (!axis_of(field, &axis)) return TRUE;
    double value = viewer_axis_round(&axis, viewer_axis_value(&axis, fmin(fmax(at, 0), SLIDER_PX)));
    if (field->info->type == TL_PROP_COUNT) value = round(value);
    if (viewer_field_set_reals(field, &value, 1)) fill_number(field);
    return TRUE; /* the slider stands where the value is */
}

/* ".5 M" and "2 GB" are understood: a factor of thousands, then the unit. */
static char *without_prefix(const char *text)
{
    static const char PREFIX[] = "kMGT";
    char *end;
    double value = g_ascii_strtod(text, &end);
    while (g_ascii_isspace(*end)) end++;
    const char *prefix = *end ? strchr(PREFIX, *end) : NULL;
    if (end == text || !prefix) return g_strdup(text);
    for (const char *p = PREFIX; p <= prefix; p++) value *= 1000;
    return g_strdup_printf("%.17g", value);
}

static bool commit_number(void *user)
{
    viewer_field *field = user;
    char *text = viewer_entry_numbers(field->main);
    char *plain = field->info->type == TL_PROP_COUNT ? without_prefix(text) : g_strdup(text);
    tl_scene_seal(field->v->scene);
    const double word = word_value(field);
    const bool taken = *plain                ? viewer_field_set_text(field, plain)
                       : !field->style.empty ? viewer_field_set_text(field, "auto")
                                             : viewer_field_set_reals(field, &word, 1);
    g_free(plain);
    g_free(text);
    return taken;
}

void viewer_field_add_number(viewer_field *field, GtkWidget *row)
{
    GtkAdjustment *places =
        gtk_adjustment_new(0, 0, SLIDER_PX, SLIDER_PX / 100.0, SLIDER_PX / 10.0, 0);
    field->slider = gtk_scale_new(GTK_ORIENTATION_HORIZONTAL, places);
    gtk_scale_set_draw_value(GTK_SCALE(field->slider), FALSE);
    gtk_widget_set_hexpand(field->slider, TRUE);
    g_signal_connect(field->slider, "change-value", G_CALLBACK(slid), field);
    viewer_watch_gesture(field->v, field->slider);
    field->main = viewer_entry_create(7, commit_number, field);
    field->fill = fill_number;
    if (field->style.empty)
        gtk_entry_set_placeholder_text(GTK_ENTRY(field->main), field->style.empty);
    gtk_box_append(GTK_BOX(row), field->slider);
    gtk_box_append(GTK_BOX(row), field->main);
    static const char *const SHORT_UNITS[] = {"px", "s", "%", "1/s", "degrees"};
    for (size_t i = 0; i < G_N_ELEMENTS(SHORT_UNITS); i++)
        if (strcmp(field->info->unit, SHORT_UNITS[i]) == 0) {
            GtkWidget *unit = gtk_label_new(i == 4 ? "°" : SHORT_UNITS[i]);
            gtk_widget_add_css_class(unit, "dim-label");
            gtk_box_append(GTK_BOX(row), unit);
        }
}
