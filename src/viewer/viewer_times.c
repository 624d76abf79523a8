/* The slider of time steps, below the view: shown where the data have steps. Playing waits for the
 * picture of each step, so that none is passed over. */
#include "viewer_tools.h"

#include <math.h>
#include <string.h>

#define PLAY_MS 100 /* least time of a step */

struct viewer_times {
    GtkWidget *bar, *play, *scale, *label;
    guint timer;
    bool is_filling; /* the slider moves because the scene has */
};

/* ---- steps ---- */

static const tl_source_facts *facts_of(const viewer *v)
{
    return v->source ? tl_source_get_facts(v->source) : NULL;
}

/* Place of the step that the scene shows among those of the source. */
static size_t place_of(const viewer *v)
{
    const tl_source_facts *facts = facts_of(v);
    const double step = tl_scene_real(v->scene, TL_NODE_DATA + 1, "step");
    for (size_t i = 0; i < facts->step_count; i++)
        if ((double)facts->steps[i].number == step) return i;
    return facts->own_step;
}

/* The step that is asked for is on the screen. */
static bool is_shown(const viewer *v)
{
    return v->frame && v->frame->facts && v->frame->scene_version == tl_scene_version(v->scene) &&
           v->frame->facts->step == facts_of(v)->steps[place_of(v)].number;
}

static void go_to(viewer *v, size_t place)
{
    const tl_source_facts *facts = facts_of(v);
    tl_status st = tl_scene_set_real(v->ctx, v->scene, TL_NODE_DATA + 1, "step",
                                     (double)facts->steps[place].number);
    if (viewer_ok(v, st)) viewer_changed(v);
}

bool viewer_times_has_steps(const viewer *v)
{
    return facts_of(v) && facts_of(v)->step_count > 1;
}

/* ---- playing ---- */

static void stop(viewer *v)
{
    struct viewer_times *t = v->tools->times;
    if (!t->timer) return;
    g_source_remove(t->timer);
    t->timer = 0;
    gtk_button_set_icon_name(GTK_BUTTON(t->play), "media-playback-start-symbolic");
    tl_scene_seal(v->scene);
}

static gboolean on_timer(gpointer data)
{
    viewer *v = data;
    if (!viewer_times_has_steps(v)) {
        stop(v);
        return G_SOURCE_REMOVE;
    }
    if (!is_shown(v)) return G_SOURCE_CONTINUE;
    go_to(v, (place_of(v) + 1) % facts_of(v)->step_count);
    return G_SOURCE_CONTINUE;
}

static void toggle_play(viewer *v)
{
    struct viewer_times *t = v->tools->times;
    if (t->timer || !viewer_times_has_steps(v)) {
        stop(v);
        return;
    }
    t->timer = g_timeout_add(PLAY_MS, on_timer, v);
    gtk_button_set_icon_name(GTK_BUTTON(t->play), "media-playback-pause-symbolic");
}

static bool is_playing(const viewer *v)
{
    return v->tools && v->tools->times && v->tools->times->timer;
}

static void step_by(viewer *v, int by)
{
    if (!viewer_times_has_steps(v)) return;
    const size_t count = facts_of(v)->step_count;
    stop(v);
    go_to(v, (place_of(v) + count + (size_t)(by + (int)count)) % count);
}

static void step_on(viewer *v)
{
    step_by(v, 1);
}
static void step_back(viewer *v)
{
    step_by(v, -1);
}

/* ---- the slider ---- */

static void set_label(viewer *v)
{
    const tl_source_facts *facts = facts_of(v);
    const size_t place = place_of(v);
    const tl_source_step *step = &facts->steps[place];
    char *file = step->file ? g_path_get_basename(step->file) : NULL;
    char *what = file                   ? g_strconcat(": ", file, NULL)
                 : isfinite(step->time) ? g_strdup_printf(", time %.6g", step->time)
                                        : g_strdup("");
    char *text = g_strdup_printf("%s %zu of %zu%s%s", file ? "file" : "step", place + 1,
                                 facts->step_count, what, is_shown(v) ? "" : " …");
    GtkLabel *label = GTK_LABEL(v->tools->times->label);
    if (strcmp(gtk_label_get_text(label), text) != 0) gtk_label_set_text(label, text);
    g_free(text);
    g_free(what);
    g_free(file);
}

static void on_frame(viewer *v, void *user)
{
    (void)user;
    if (viewer_times_has_steps(v)) set_label(v);
}

static void refresh(viewer *v, void *user)
{
    (void)user;
    struct viewer_times *t = v->tools->times;
    gtk_widget_set_visible(t->bar, viewer_times_has_steps(v));
    if (!viewer_times_has_steps(v)) {
        stop(v);
        return;
    }
    t->is_filling = true;
    gtk_range_set_range(GTK_RANGE(t->scale), 0, (double)(facts_of(v)->step_count - 1));
    gtk_range_set_value(GTK_RANGE(t->scale), (double)place_of(v));
    t->is_filling = false;
    set_label(v);
}

static void on_slide(GtkRange *range, viewer *v)
{
    if (v->tools->times->is_filling || !viewer_times_has_steps(v)) return;
    const double value = gtk_range_get_value(range);
    stop(v);
    go_to(v, (size_t)(value + 0.5));
}

static void on_play(GtkButton *button, viewer *v)
{
    (void)button;
    toggle_play(v);
}

static const viewer_action ACTIONS[] = {
    {"play", "k", "Time", "Play the steps", toggle_play, is_playing},
    {"step-on", "period", "Time", "Next step", step_on, NULL},
    {"step-back", "comma", "Time", "Step before", step_back, NULL},
};

void viewer_times_attach(viewer *v)
{
    struct viewer_times *t = v->tools->times = g_new0(struct viewer_times, 1);
    t->bar = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 8);
    t->play = gtk_button_new_from_icon_name("media-playback-start-symbolic");
    t->scale = gtk_scale_new_with_range(GTK_ORIENTATION_HORIZONTAL, 0, 1, 1);
    t->label = gtk_label_new("");
    gtk_scale_set_draw_value(GTK_SCALE(t->scale), FALSE);
    gtk_range_set_round_digits(GTK_RANGE(t->scale), 0);
    gtk_widget_set_hexpand(t->scale, TRUE);
    gtk_widget_set_tooltip_text(t->play, "Play the steps (k)");
    gtk_widget_set_margin_start(t->bar, 8);
    gtk_widget_set_margin_end(t->bar, 8);
    gtk_box_append(GTK_BOX(t->bar), t->play);
    gtk_box_append(GTK_BOX(t->bar), t->scale);
    gtk_box_append(GTK_BOX(t->bar), t->label);
    gtk_box_append(GTK_BOX(v->below), t->bar);
    gtk_widget_set_visible(t->bar, FALSE);
    g_signal_connect(t->scale, "value-changed", G_CALLBACK(on_slide), v);
    g_signal_connect(t->play, "clicked", G_CALLBACK(on_play), v);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_listen(v, VIEWER_SOURCE, refresh, NULL);
    viewer_listen(v, VIEWER_SCENE, refresh, NULL);
    viewer_listen(v, VIEWER_FRAME, on_frame, NULL);
}

void viewer_times_destroy(viewer *v)
{
    if (v->tools->times->timer) g_source_remove(v->tools->times->timer);
    g_clear_pointer(&v->tools->times, g_free);
}
