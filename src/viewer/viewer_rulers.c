/* Rulers: distances between places that were clicked, in mesh units. */
#include "viewer_tools.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { RULERS_MAX = 32 };

typedef struct ruler {
    double ends[2][3];
} ruler;

struct viewer_rulers {
    ruler rulers[RULERS_MAX];
    int count;
    bool has_start; /* of the next one, in its ends[0] */
    double start[3];
    double hover[2];
    double next[2]; /* of a script: the second pixel, asked for after the first */
    bool has_next;
};

/* ---- measuring ---- */

static void on_answer(viewer *v, const tl_probe *probe)
{
    struct viewer_rulers *r = v->tools->rulers;
    if (!isfinite(probe->xyz[0])) {
        viewer_say(v, VIEWER_INFO, "There is nothing to measure from at this place.");
        r->has_next = false;
        return;
    }
    if (!r->has_start) {
        memcpy(r->start, probe->xyz, sizeof r->start);
        r->has_start = true;
        if (r->has_next) viewer_tools_ask(v, r->next[0], r->next[1], on_answer);
        r->has_next = false;
    } else {
        if (r->count == RULERS_MAX)
            memmove(r->rulers, r->rulers + 1, (size_t)--r->count * sizeof *r->rulers);
        ruler *to = &r->rulers[r->count++];
        memcpy(to->ends[0], r->start, sizeof r->start);
        memcpy(to->ends[1], probe->xyz, sizeof to->ends[1]);
        r->has_start = false;
    }
    viewer_redraw(v);
}

static bool click(viewer *v, void *user, const viewer_pointer *p)
{
    (void)user;
    if (v->tools->mode != VIEWER_MODE_RULER || p->button != 1) return false;
    viewer_tools_ask(v, p->x, p->y, on_answer);
    return true;
}

static const char *over(viewer *v, void *user, double x, double y)
{
    (void)user;
    if (v->tools->mode != VIEWER_MODE_RULER) return NULL;
    v->tools->rulers->hover[0] = x;
    v->tools->rulers->hover[1] = y;
    if (v->tools->rulers->has_start) viewer_redraw(v);
    return "crosshair";
}

static double length_of(const ruler *r)
{
    const double *a = r->ends[0], *b = r->ends[1];
    return hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
}

/* ---- drawing ---- */

static bool shown(viewer *v, void *user)
{
    (void)user;
    return v->tools->rulers->count || v->tools->rulers->has_start;
}

static void draw_ruler(viewer *v, cairo_t *cr, const ruler *r, double width, double height,
                       bool dark)
{
    double x[2], y[2];
    char text[160];
    for (int i = 0; i < 2; i++)
        if (!viewer_project(v, r->ends[i], &x[i], &y[i])) return;
    viewer_overlay_line(cr, x, y, VIEWER_OVERLAY_ACCENT, 1.8);
    for (int i = 0; i < 2; i++) viewer_overlay_dot(cr, x[i], y[i], 4, VIEWER_OVERLAY_ACCENT, false);
    g_snprintf(text, sizeof text,
               "<b>%.6g</b>\n<span alpha=\"65%%\" size=\"small\">%.4g, %.4g, %.4g</span>",
               length_of(r), r->ends[1][0] - r->ends[0][0], r->ends[1][1] - r->ends[0][1],
               r->ends[1][2] - r->ends[0][2]);
    const double middle[2] = {(x[0] + x[1]) / 2, (y[0] + y[1]) / 2};
    const bool falls = (x[1] - x[0]) * (y[1] - y[0]) > 0;
    viewer_overlay_card(v, cr, text, middle, falls, width, height, dark);
}

static void draw(viewer *v, void *user, cairo_t *cr, double width, double height, bool dark)
{
    (void)user;
    const struct viewer_rulers *r = v->tools->rulers;
    for (int i = 0; i < r->count; i++) draw_ruler(v, cr, &r->rulers[i], width, height, dark);
    if (!r->has_start) return;
    double x[2] = {0, r->hover[0]}, y[2] = {0, r->hover[1]};
    if (!viewer_project(v, r->start, &x[0], &y[0])) return;
    if (v->tools->mode == VIEWER_MODE_RULER)
        viewer_overlay_line(cr, x, y, VIEWER_OVERLAY_ACCENT, 1);
    viewer_overlay_dot(cr, x[0], y[0], 4, VIEWER_OVERLAY_ACCENT, true);
}

/* ---- actions ---- */

static void toggle_ruler(viewer *v)
{
    v->tools->rulers->has_start = false;
    viewer_tools_set_mode(v, v->tools->mode == VIEWER_MODE_RULER ? VIEWER_MODE_NONE
                                                                 : VIEWER_MODE_RULER);
}

static bool is_measuring(const viewer *v)
{
    return v->tools && v->tools->mode == VIEWER_MODE_RULER;
}

void viewer_rulers_forget(viewer *v)
{
    v->tools->rulers->count = 0;
    v->tools->rulers->has_start = v->tools->rulers->has_next = false;
    viewer_redraw(v);
}

static bool run_measure(viewer *v, const char *arguments)
{
    double xy[4];
    struct viewer_rulers *r = v->tools->rulers;
    if (!viewer_tools_numbers(arguments, xy, 4)) {
        viewer_say(v, VIEWER_ERROR, "measure %s: expected X0 Y0 X1 Y1, pixels of the view",
                   arguments);
        return false;
    }
    r->has_start = false;
    r->has_next = true;
    r->next[0] = xy[2];
    r->next[1] = xy[3];
    viewer_tools_ask(v, xy[0], xy[1], on_answer);
    return true;
}

void viewer_rulers_print(const viewer *v)
{
    for (int i = 0; i < v->tools->rulers->count; i++)
        printf("distance\t%.9g\n", length_of(&v->tools->rulers->rulers[i]));
}

static const viewer_action ACTIONS[] = {
    {"ruler", "m", "Tools", "Measure: from click to click", toggle_ruler, is_measuring},
    {"no-rulers", "<Shift>m", "Tools", "Take rulers away", viewer_rulers_forget, NULL},
};
static const viewer_command COMMANDS[] = {
    {"measure", "measure X0 Y0 X1 Y1: between what is under two pixels of the view", run_measure},
};

static void on_source(viewer *v, void *user)
{
    (void)user;
    viewer_rulers_forget(v);
}

void viewer_rulers_attach(viewer *v)
{
    const viewer_tool tool = {.over = over, .click = click, .draw = draw, .shown = shown};
    v->tools->rulers = g_new0(struct viewer_rulers, 1);
    viewer_add_tool(v, &tool);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
    viewer_listen(v, VIEWER_SOURCE, on_source, NULL);
}

void viewer_rulers_destroy(viewer *v)
{
    g_clear_pointer(&v->tools->rulers, g_free);
}
