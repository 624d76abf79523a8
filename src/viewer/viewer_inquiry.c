/* The probe: what is under the pointer, with the values of all channels and their bounds, as a card
 * beside it; a click keeps the place, and its text goes to the clipboard. */
#include "viewer_tools.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { COMPONENTS_SHOWN = 9 };

struct viewer_inquiry {
    char *markup, *text; /* of the last answer; NULL: nothing */
    double xyz[3];
    bool is_kept; /* by a click: the card stays there */
    bool keep_next;
    double hover[2]; /* where the pointer is; asked when the former answer has come */
    bool is_hovering;
};

/* ---- words ---- */

static void add_row(GString *markup, GString *text, const char *name, const char *value)
{
    char *name_safe = g_markup_escape_text(name, -1), *value_safe = g_markup_escape_text(value, -1);
    g_string_append_printf(markup, "%s<span alpha=\"65%%\">%s</span>\t%s", markup->len ? "\n" : "",
                           name_safe, value_safe);
    g_string_append_printf(text, "%s\t%s\n", name, value);
    g_free(name_safe);
    g_free(value_safe);
}

static void add_numbers(GString *out, const double *values, uint32_t count)
{
    double square = 0;
    for (uint32_t i = 0; i < count; i++) {
        square += values[i] * values[i];
        if (i < COMPONENTS_SHOWN) g_string_append_printf(out, "%s%.6g", i ? ", " : "", values[i]);
    }
    if (count > COMPONENTS_SHOWN) g_string_append(out, ", …");
    if (count == 3) g_string_append_printf(out, "  |%.6g|", sqrt(square));
}

static void add_value(GString *markup, GString *text, const tl_probe_value *value)
{
    GString *line = g_string_new(NULL);
    add_numbers(line, value->values, value->components);
    if (value->unit && *value->unit) g_string_append_printf(line, " %s", value->unit);
    if (isfinite(value->error) && value->error > 0)
        g_string_append_printf(line, "  ± %.3g", value->error);
    add_row(markup, text, value->name, line->str);
    g_string_free(line, TRUE);
}

static void add_place(GString *markup, GString *text, const tl_probe *probe)
{
    char line[128];
    g_snprintf(line, sizeof line, "%.6g, %.6g, %.6g", probe->xyz[0], probe->xyz[1], probe->xyz[2]);
    add_row(markup, text, "position", line);
    if (!probe->is_inside) return;
    g_snprintf(line, sizeof line, "%.4g", probe->tet_size);
    add_row(markup, text, "tet size", line);
    if (probe->region_name || probe->region) {
        g_snprintf(line, sizeof line, "%d %s", (int)probe->region,
                   probe->region_name ? probe->region_name : "");
        add_row(markup, text, "region", g_strchomp(line));
    }
    if (probe->patch == TL_NONE) return;
    g_snprintf(line, sizeof line, "%lu of level %lu", (unsigned long)probe->patch,
               (unsigned long)probe->level);
    add_row(markup, text, "patch", line);
}

static void set_answer(viewer *v, const tl_probe *probe)
{
    struct viewer_inquiry *q = v->tools->inquiry;
    GString *markup = g_string_new(NULL), *text = g_string_new(NULL);
    g_clear_pointer(&q->markup, g_free);
    g_clear_pointer(&q->text, g_free);
    if (isfinite(probe->xyz[0])) {
        add_place(markup, text, probe);
        for (size_t i = 0; probe->is_inside && i < probe->value_count; i++)
            add_value(markup, text, &probe->values[i]);
        memcpy(q->xyz, probe->xyz, sizeof q->xyz);
        q->markup = g_strdup(markup->str);
        q->text = g_strdup(text->str);
    }
    g_string_free(markup, TRUE);
    g_string_free(text, TRUE);
    viewer_redraw(v);
}

/* ---- asking ---- */

static void on_answer(viewer *v, const tl_probe *probe)
{
    struct viewer_inquiry *q = v->tools->inquiry;
    set_answer(v, probe);
    q->is_kept = q->keep_next && q->markup;
    q->keep_next = false;
    /* the pointer has gone on meanwhile */
    if (!q->is_kept && q->is_hovering && v->tools->mode == VIEWER_MODE_PROBE)
        viewer_tools_ask(v, q->hover[0], q->hover[1], on_answer);
    q->is_hovering = false;
}

static const char *over(viewer *v, void *user, double x, double y)
{
    (void)user;
    struct viewer_inquiry *q = v->tools->inquiry;
    if (v->tools->mode != VIEWER_MODE_PROBE) return NULL;
    if (q->is_kept) return "crosshair";
    q->hover[0] = x;
    q->hover[1] = y;
    q->is_hovering = viewer_tools_asks(v);
    if (!q->is_hovering) viewer_tools_ask(v, x, y, on_answer);
    return "crosshair";
}

static bool click(viewer *v, void *user, const viewer_pointer *p)
{
    (void)user;
    struct viewer_inquiry *q = v->tools->inquiry;
    if (v->tools->mode != VIEWER_MODE_PROBE || p->button != 1) return false;
    q->keep_next = true;
    q->is_hovering = false;
    viewer_tools_ask(v, p->x, p->y, on_answer);
    return true;
}

/* ---- drawing ---- */

static bool shown(viewer *v, void *user)
{
    (void)user;
    return v->tools->inquiry->markup != NULL;
}

static void draw(viewer *v, void *user, cairo_t *cr, double width, double height, bool dark)
{
    (void)user;
    double at[2];
    const struct viewer_inquiry *q = v->tools->inquiry;
    if (!viewer_project(v, q->xyz, &at[0], &at[1])) return;
    viewer_overlay_dot(cr, at[0], at[1], 4.5, VIEWER_OVERLAY_ACCENT, q->is_kept);
    viewer_overlay_card(v, cr, q->markup, at, false, width, height, dark);
}

/* ---- actions ---- */

static void toggle_probe(viewer *v)
{
    viewer_tools_set_mode(v, v->tools->mode == VIEWER_MODE_PROBE ? VIEWER_MODE_NONE
                                                                 : VIEWER_MODE_PROBE);
}

static bool is_probing(const viewer *v)
{
    return v->tools && v->tools->mode == VIEWER_MODE_PROBE;
}

static void copy_probe(viewer *v)
{
    if (!v->tools->inquiry->text) {
        viewer_say(v, VIEWER_INFO, "There is nothing to copy: probe a place first (key i).");
        return;
    }
    gdk_clipboard_set_text(gtk_widget_get_clipboard(v->picture), v->tools->inquiry->text);
    viewer_say(v, VIEWER_INFO, "Position and values are in the clipboard.");
}

static bool run_probe(viewer *v, const char *arguments)
{
    double xy[2];
    if (!viewer_tools_numbers(arguments, xy, 2)) {
        viewer_say(v, VIEWER_ERROR, "probe %s: expected X Y, pixels of the view", arguments);
        return false;
    }
    v->tools->inquiry->keep_next = true;
    viewer_tools_ask(v, xy[0], xy[1], on_answer);
    return true;
}

static const viewer_action ACTIONS[] = {
    {"probe", "i", "Tools", "Probe: values under the pointer; a click keeps them", toggle_probe,
     is_probing},
    {"copy-probe", "<Control>c", "Tools", "Copy the values of the probe", copy_probe, NULL},
};
static const viewer_command COMMANDS[] = {
    {"probe", "probe X Y: what is under a pixel of the view", run_probe},
};

static void on_source(viewer *v, void *user)
{
    (void)user;
    struct viewer_inquiry *q = v->tools->inquiry;
    g_clear_pointer(&q->markup, g_free);
    g_clear_pointer(&q->text, g_free);
    q->is_kept = false;
}

void viewer_inquiry_forget(viewer *v)
{
    on_source(v, NULL);
    viewer_redraw(v);
}

void viewer_inquiry_print(const viewer *v)
{
    if (v->tools->inquiry->text) fputs(v->tools->inquiry->text, stdout);
}

void viewer_inquiry_attach(viewer *v)
{
    const viewer_tool tool = {.over = over, .click = click, .draw = draw, .shown = shown};
    v->tools->inquiry = g_new0(struct viewer_inquiry, 1);
    viewer_add_tool(v, &tool);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
    viewer_listen(v, VIEWER_SOURCE, on_source, NULL);
}

void viewer_inquiry_destroy(viewer *v)
{
    g_free(v->tools->inquiry->markup);
    g_free(v->tools->inquiry->text);
    g_clear_pointer(&v->tools->inquiry, g_free);
}
