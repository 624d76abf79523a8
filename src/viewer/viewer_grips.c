/* Planes and boxes that are dragged in the view: of the selected clip or slice its outline with an
 * arrow, of the others a dot in the middle that selects them; the box of selected lines, and that
 * of the focus, while they are on. A drag is one step of undo. */
#include "viewer_handles.h"
#include "viewer_tools.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define ARM_PX 78.0
#define REACH_PX 11.0
#define DOT_PX 5.5
enum { GRIPS_MAX = 64 };

/* A plane or box of the scene. */
typedef struct grip {
    tl_node node;
    const char *prop;
    bool is_box, is_full; /* else no more than its middle */
    viewer_handle_shape shape;
} grip;

struct viewer_grips {
    bool is_hidden;
    grip grips[GRIPS_MAX];
    int count;
    int over; /* grip and part that the pointer is at; below 0: none */
    viewer_handle_part over_part;
    int held;
    viewer_handle_drag drag;
};

/* ---- what there is ---- */

/* The property of a node that is a plane or box to be shown; NULL: none. */
static const char *prop_of(const viewer *v, tl_node node, bool *is_box)
{
    *is_box = false;
    switch (tl_scene_kind(v->scene, node)) {
    case TL_NODE_CLIP: return tl_scene_flag(v->scene, node, "on") ? "plane" : NULL;
    case TL_NODE_SLICE: return tl_scene_flag(v->scene, node, "visible") ? "plane" : NULL;
    case TL_NODE_DETAIL:
        *is_box = true;
        return tl_scene_flag(v->scene, node, "focus") ? "focus_box" : NULL;
    case TL_NODE_LINES:
        *is_box = true;
        return tl_scene_flag(v->scene, node, "visible") && tl_scene_flag(v->scene, node, "has_box")
                   ? "box"
                   : NULL;
    default: return NULL;
    }
}

/* The camera of the picture on the screen, for pixels of the widget. */
static tl_camera screen_camera(const viewer *v)
{
    tl_camera camera = v->frame->camera;
    camera.size_px[0] = (uint32_t)MAX(gtk_widget_get_width(v->picture), 1);
    camera.size_px[1] = (uint32_t)MAX(gtk_widget_get_height(v->picture), 1);
    return camera;
}

static void value_of(const viewer *v, const grip *g, double value[6])
{
    if (g->is_box)
        tl_scene_box(v->scene, g->node, g->prop, value);
    else
        tl_scene_plane(v->scene, g->node, g->prop, value);
}

static void keep_middle(viewer_handle_shape *shape)
{
    shape->line_count = 0;
    shape->dot_count = MIN(shape->dot_count, 1);
}

/* Where all of them are on the screen now. */
static void place_grips(viewer *v)
{
    size_t count;
    double bounds[6];
    struct viewer_grips *grips = v->tools->grips;
    grips->count = 0;
    if (!v->frame || !v->source || grips->is_hidden) return;
    const tl_camera camera = screen_camera(v);
    const tl_node *nodes = tl_scene_nodes(v->scene, &count);
    tl_scene_bounds(v->scene, bounds);
    for (size_t i = 0; i < count && grips->count < GRIPS_MAX; i++) {
        grip g = {.node = nodes[i]};
        double value[6];
        g.prop = prop_of(v, g.node, &g.is_box);
        if (!g.prop) continue;
        g.is_full = g.is_box || v->selected == g.node;
        value_of(v, &g, value);
        if (g.is_box)
            viewer_handle_box(&camera, value, &g.shape);
        else
            viewer_handle_plane(&camera, bounds, value, ARM_PX, &g.shape);
        if (!g.is_full) keep_middle(&g.shape);
        grips->grips[grips->count++] = g;
    }
}

/* The grip under a pixel, full ones first; below 0: none. */
static int grip_at(viewer *v, double x, double y, viewer_handle_part *part)
{
    const struct viewer_grips *grips = v->tools->grips;
    place_grips(v);
    for (int full = 1; full >= 0; full--)
        for (int i = grips->count; i-- > 0;) {
            if (grips->grips[i].is_full != full) continue;
            *part = viewer_handle_at(&grips->grips[i].shape, x, y, REACH_PX);
            if (*part != VIEWER_HANDLE_NONE) return i;
        }
    *part = VIEWER_HANDLE_NONE;
    return -1;
}

/* ---- the pointer ---- */

static const char *over(viewer *v, void *user, double x, double y)
{
    (void)user;
    struct viewer_grips *grips = v->tools->grips;
    viewer_handle_part part;
    const int at = grip_at(v, x, y, &part);
    if (at != grips->over || part != grips->over_part) viewer_redraw(v);
    grips->over = at;
    grips->over_part = part;
    return at < 0 ? NULL : "grab";
}

static bool press(viewer *v, void *user, const viewer_pointer *p)
{
    (void)user;
    struct viewer_grips *grips = v->tools->grips;
    viewer_handle_part part;
    const int at = p->button == 1 && p->presses < 2 ? grip_at(v, p->x, p->y, &part) : -1;
    if (at < 0) return false;
    const tl_node node = grips->grips[at].node;
    viewer_handle_drag *drag = &grips->drag;
    *drag = (viewer_handle_drag){
        .camera = screen_camera(v), .arm_px = ARM_PX, .part = part, .from = {p->x, p->y}};
    value_of(v, &grips->grips[at], drag->value);
    tl_scene_bounds(v->scene, drag->bounds);
    tl_scene_seal(v->scene);
    grips->held = at;
    viewer_select(v, node);
    gtk_widget_set_cursor_from_name(v->picture, "grabbing");
    return true;
}

/* The grip that is held stands where place_grips puts it, as long as no node comes or goes. */
static void drag_to(viewer *v, void *user, const viewer_pointer *p)
{
    (void)user;
    double value[6];
    struct viewer_grips *grips = v->tools->grips;
    if (grips->held < 0) return;
    const grip *held = &grips->grips[grips->held];
    if (held->is_box)
        viewer_handle_drag_box(&grips->drag, p->x, p->y, value);
    else
        viewer_handle_drag_plane(&grips->drag, p->x, p->y, value);
    tl_status st = tl_scene_set_reals(v->ctx, v->scene, held->node, held->prop, value, 6);
    if (viewer_ok(v, st)) viewer_changed(v);
    viewer_redraw(v);
}

static void release(viewer *v, void *user, const viewer_pointer *p)
{
    (void)user, (void)p;
    v->tools->grips->held = -1;
    gtk_widget_set_cursor_from_name(v->picture, NULL);
    viewer_redraw(v);
}

/* ---- drawing ---- */

static bool shown(viewer *v, void *user)
{
    (void)user;
    place_grips(v);
    return v->tools->grips->count > 0;
}

static void draw(viewer *v, void *user, cairo_t *cr, double width, double height, bool dark)
{
    (void)user, (void)width, (void)height, (void)dark;
    const struct viewer_grips *grips = v->tools->grips;
    for (int i = 0; i < grips->count; i++) {
        const grip *g = &grips->grips[i];
        const double *rgb = g->is_box ? VIEWER_OVERLAY_SECOND : VIEWER_OVERLAY_ACCENT;
        for (int l = 0; l < g->shape.line_count; l++)
            viewer_overlay_line(cr, g->shape.lines[l].x, g->shape.lines[l].y, rgb, 1.4);
        for (int d = 0; d < g->shape.dot_count; d++) {
            const viewer_handle_dot *dot = &g->shape.dots[d];
            const bool is_over = grips->over == i && grips->over_part == dot->part;
            viewer_overlay_dot(cr, dot->x, dot->y, is_over ? DOT_PX + 2 : DOT_PX, rgb, is_over);
        }
    }
}

/* ---- the part ---- */

static void on_change(viewer *v, void *user)
{
    (void)user;
    viewer_redraw(v);
}

static void toggle_handles(viewer *v)
{
    v->tools->grips->is_hidden = !v->tools->grips->is_hidden;
    viewer_redraw(v);
}

static bool has_handles(const viewer *v)
{
    return v->tools && v->tools->grips && !v->tools->grips->is_hidden;
}

void viewer_grips_print(viewer *v)
{
    const struct viewer_grips *grips = v->tools->grips;
    place_grips(v);
    for (int i = 0; i < grips->count; i++)
        for (int d = 0; d < grips->grips[i].shape.dot_count; d++)
            printf("handle\t%s %d %g %g\n", tl_scene_name(v->scene, grips->grips[i].node),
                   (int)grips->grips[i].shape.dots[d].part, grips->grips[i].shape.dots[d].x,
                   grips->grips[i].shape.dots[d].y);
}

static const viewer_action ACTIONS[] = {
    {"", "Drag a handle", "Tools", "Move, turn a plane; a side of a box", NULL, NULL},
    {"handles", "g", "Tools", "Handles of planes and boxes", toggle_handles, has_handles},
};

void viewer_grips_attach(viewer *v)
{
    const viewer_tool tool = {.over = over,
                              .press = press,
                              .drag = drag_to,
                              .release = release,
                              .draw = draw,
                              .shown = shown};
    v->tools->grips = g_new0(struct viewer_grips, 1);
    v->tools->grips->over = v->tools->grips->held = -1;
    viewer_add_tool(v, &tool);
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_listen(v, VIEWER_SCENE, on_change, NULL);
    viewer_listen(v, VIEWER_SELECTED, on_change, NULL);
}

void viewer_grips_destroy(viewer *v)
{
    g_clear_pointer(&v->tools->grips, g_free);
}
