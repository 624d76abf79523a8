/* The tools in the view: handles, probe, rulers, time. They share the questions to the live view,
 * of which the newest alone is answered. */
#include "viewer_tools.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void take_answer(viewer *v, void *user)
{
    (void)user;
    struct viewer_tools *t = v->tools;
    if (v->event->job != TL_LIVE_PROBE || !t->answer) return;
    const tl_probe nothing = {.xyz = {(double)NAN, (double)NAN, (double)NAN}};
    const tl_probe *probe = v->event->kind == TL_LIVE_DONE ? tl_live_get_probe(v->live) : NULL;
    const viewer_answer answer = t->answer;
    if (v->event->kind != TL_LIVE_DONE && v->event->kind != TL_LIVE_FAILED) return;
    t->answer = NULL;
    answer(v, probe ? probe : &nothing);
}

void viewer_tools_ask(viewer *v, double x, double y, viewer_answer answer)
{
    double px[2];
    if (!v->frame || !v->frame->content) return; /* no answer would come */
    viewer_frame_px(v, x, y, px);
    v->tools->answer = answer;
    tl_live_probe(v->live, px[0], px[1]);
}

bool viewer_tools_asks(const viewer *v)
{
    return v->tools && v->tools->answer;
}

bool viewer_tools_numbers(const char *text, double *numbers, int count)
{
    for (int i = 0; i < count; i++) {
        char *end;
        numbers[i] = g_ascii_strtod(text, &end);
        if (end == text || !isfinite(numbers[i])) return false;
        text = end;
    }
    return *text == '\0';
}

void viewer_tools_set_mode(viewer *v, viewer_mode mode)
{
    v->tools->mode = mode;
    gtk_widget_set_cursor_from_name(v->picture, mode == VIEWER_MODE_NONE ? NULL : "crosshair");
    if (mode != VIEWER_MODE_PROBE) viewer_inquiry_forget(v);
    viewer_redraw(v);
}

/* What the mode is for, in the corner of the view. */
static bool has_hint(viewer *v, void *user)
{
    (void)user;
    return v->tools->mode != VIEWER_MODE_NONE;
}

static void draw_hint(viewer *v, void *user, cairo_t *cr, double width, double height, bool dark)
{
    (void)user;
    static const char *const HINTS[] = {
        [VIEWER_MODE_PROBE] =
            "<b>Probe</b>  a click keeps the values, Ctrl+C copies them, Esc ends",
        [VIEWER_MODE_RULER] =
            "<b>Measure</b>  click two places; Esc ends, Shift+M takes rulers away"};
    static const double CORNER[2] = {-6, -6};
    viewer_overlay_card(v, cr, HINTS[v->tools->mode], CORNER, false, width, height, dark);
}

static void end_mode(viewer *v)
{
    viewer_tools_set_mode(v, VIEWER_MODE_NONE);
}

static bool run_print(viewer *v, const char *arguments)
{
    (void)arguments;
    graphene_rect_t box, frame;
    GtkWidget *window = GTK_WIDGET(v->window);
    if (gtk_widget_compute_bounds(v->picture, window, &box) &&
        gtk_widget_compute_bounds(window, window, &frame))
        printf("view\t%g %g %g %g\n", (double)(box.origin.x - frame.origin.x),
               (double)(box.origin.y - frame.origin.y), (double)box.size.width,
               (double)box.size.height);
    viewer_grips_print(v);
    viewer_inquiry_print(v);
    viewer_rulers_print(v);
    fflush(stdout);
    return true;
}

static const viewer_command COMMANDS[] = {
    {"print-tools", "print-tools: where the view is in the window, what the probe and rulers say",
     run_print},
};
static const viewer_action ACTIONS[] = {
    {"no-tool", "Escape", "Tools", "End probing or measuring", end_mode, NULL},
};

static void end(viewer *v, void *user)
{
    (void)user;
    viewer_times_destroy(v);
    viewer_grips_destroy(v);
    viewer_inquiry_destroy(v);
    viewer_rulers_destroy(v);
    g_clear_pointer(&v->tools, g_free);
}

void viewer_tools_attach(viewer *v)
{
    const viewer_tool hint = {.draw = draw_hint, .shown = has_hint};
    v->tools = g_new0(struct viewer_tools, 1);
    viewer_add_tool(v, &hint);
    viewer_rulers_attach(v);
    viewer_inquiry_attach(v);
    viewer_grips_attach(v);
    viewer_times_attach(v);
    viewer_toolbar_attach(v);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
    viewer_listen(v, VIEWER_LIVE, take_answer, NULL);
    viewer_listen(v, VIEWER_END, end, NULL);
}
