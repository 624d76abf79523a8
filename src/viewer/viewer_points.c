/* A transfer function as control points: what scene and picture say of it, and changes of it. What
 * is automatic in the scene (a map of colours, opacities from the histogram) becomes points of its
 * own at the first change by hand: few of them, that follow it closely. */
#include "viewer_points.h"

#include <math.h>
#include <string.h>

/* How far a curve of few points may be from the automatic one. */
static const double OPACITY_TOLERANCE = 0.015, COLOR_TOLERANCE = 0.03;
/* Ends of the range stay apart by pixels. */
static const double RANGE_LEAST_PX = 2;

/* ---- what scene and picture say ---- */

static const tl_values *values_of(const viewer_points *points)
{
    const tl_frame *frame = points->v->frame;
    return frame && frame->content ? tl_content_values(frame->content, points->channel) : NULL;
}

static tl_node node_of(const viewer_points *points)
{
    return tl_scene_transfer_of(points->v->scene, points->channel);
}

/* A list of the scene; false where it is empty. */
static bool take_list(const viewer_points *points, tl_node node, const char *prop, size_t width,
                      viewer_curve *curve)
{
    tl_value value;
    if (!node || tl_scene_get(points->v->ctx, points->v->scene, node, prop, &value) || !value.count)
        return false;
    viewer_curve_set(curve, width, value.reals, value.count / width);
    return true;
}

static void take_range(viewer_points *points, tl_node node)
{
    tl_value value;
    points->range[0] = 0;
    points->range[1] = 1;
    if (node && strcmp(tl_scene_text(points->v->scene, node, "range_by"), "values") == 0 &&
        !tl_scene_get(points->v->ctx, points->v->scene, node, "range", &value) && value.count == 2)
        memcpy(points->range, value.reals, sizeof points->range);
    else
        viewer_channel_range(points->v, &points->histogram, points->range);
}

static void take_map(viewer_points *points, tl_node node)
{
    const char *name = node ? tl_scene_text(points->v->scene, node, "map")
                            : tl_node_prop(TL_NODE_TRANSFER, "map")->preset;
    const bool reversed = node && tl_scene_flag(points->v->scene, node, "reversed");
    const viewer_axis axis = {{points->range[0], points->range[1]}, points->logarithmic, 0, 1};
    size_t count;
    const tl_color_point *map = tl_colormap(name, &count);
    points->colors.width = 4;
    points->colors.count = 0;
    if (!map || !(axis.range[0] < axis.range[1])) return;
    for (size_t i = 0; i < count && i < VIEWER_CURVE_POINTS_MAX; i++) {
        const tl_color_point *at = &map[reversed ? count - 1 - i : i];
        double *row = viewer_curve_row(&points->colors, points->colors.count++);
        row[0] = viewer_axis_value(&axis, reversed ? 1 - at->value : at->value);
        memcpy(row + 1, at->rgb, sizeof at->rgb);
    }
}

static void take_opacities(viewer_points *points, tl_node node)
{
    const tl_values *values = values_of(points);
    points->own_opacities = take_list(points, node, "opacities", 2, &points->opacities);
    if (!points->own_opacities) {
        points->opacities.width = 2;
        points->opacities.count = 0;
        for (size_t i = 0; values && i < values->opacity_count && i < VIEWER_CURVE_POINTS_MAX;
             i++) {
            double *row = viewer_curve_row(&points->opacities, points->opacities.count++);
            row[0] = values->opacities[i].value;
            row[1] = values->opacities[i].opacity;
        }
    }
    if (!points->has_opacities) points->opacities.count = 0;
    points->handles = points->opacities;
    if (!points->own_opacities)
        viewer_curve_thin(&points->handles, points->logarithmic, OPACITY_TOLERANCE);
}

/* What is seen: also points far from the range. */
static void take_axis(viewer_points *points)
{
    viewer_axis fit = points->axis;
    viewer_histogram_fit(&points->histogram, points->range, &fit);
    if (points->own_opacities && points->has_opacities) {
        const size_t last = points->opacities.count - 1;
        fit.range[0] = fmin(fit.range[0], viewer_curve_row(&points->opacities, 0)[0]);
        fit.range[1] = fmax(fit.range[1], viewer_curve_row(&points->opacities, last)[0]);
    }
    fit.logarithmic = fit.logarithmic && fit.range[0] > 0;
    viewer_zoom_fit(&points->zoom, &fit, &points->histogram);
}

static bool has_volume(const viewer_points *points)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(points->v->scene, &count);
    for (size_t i = 0; i < count; i++)
        if (tl_scene_kind(points->v->scene, nodes[i]) == TL_NODE_VOLUME &&
            strcmp(tl_scene_text(points->v->scene, nodes[i], "channel"), points->channel) == 0)
            return true;
    return false;
}

void viewer_points_show(viewer_points *points, const char *channel)
{
    if (strcmp(points->channel, channel) != 0) {
        g_strlcpy(points->channel, channel, sizeof points->channel);
        points->part = VIEWER_PART_NONE;
        points->is_dragging = false;
        points->zoom.is_on = false;
    }
    const tl_node node = node_of(points);
    points->logarithmic = node && tl_scene_flag(points->v->scene, node, "logarithmic");
    points->has_opacities = has_volume(points);
    viewer_histogram_take(points->v, &points->histogram, points->channel, points->logarithmic);
    take_range(points, node);
    points->own_colors = take_list(points, node, "colors", 4, &points->colors);
    if (points->own_colors) {
        points->range[0] = viewer_curve_row(&points->colors, 0)[0];
        points->range[1] = viewer_curve_row(&points->colors, points->colors.count - 1)[0];
    }
    if (points->logarithmic && !(points->range[0] > 0)) points->logarithmic = false;
    if (!points->own_colors) take_map(points, node);
    take_opacities(points, node);
    if (!points->is_dragging) take_axis(points); /* the scale stays under the pointer */
    const size_t count =
        points->part == VIEWER_PART_OPACITY ? points->handles.count : points->colors.count;
    if (points->part && points->point >= count) points->part = VIEWER_PART_NONE;
    gtk_widget_queue_draw(points->area);
    points->selected(points->user);
}

/* ---- changes ---- */

tl_node viewer_points_begin(viewer_points *points)
{
    viewer *v = points->v;
    char name[TL_SCENE_NAME_BYTES];
    tl_node node = node_of(points);
    g_snprintf(name, sizeof name, "colours of %.40s", points->channel);
    if (!viewer_ok(v, tl_scene_begin(v->ctx, v->scene, name))) return 0;
    tl_status st = node ? TL_OK : tl_scene_add(v->ctx, v->scene, TL_NODE_TRANSFER, &node);
    if (!st && !node_of(points))
        st = tl_scene_set_text(v->ctx, v->scene, node, "channel", points->channel);
    if (!st) return node;
    viewer_points_end(points, st);
    return 0;
}

void viewer_points_end(viewer_points *points, tl_status status)
{
    viewer *v = points->v;
    viewer_ok(v, status);
    viewer_ok(v, tl_scene_end(v->ctx, v->scene, !status));
    viewer_changed(v);
    viewer_points_show(points, points->channel);
}

static void write_list(viewer_points *points, const char *prop, const viewer_curve *curve)
{
    viewer *v = points->v;
    const tl_node node = viewer_points_begin(points);
    if (!node) return;
    viewer_points_end(points, tl_scene_set_reals(v->ctx, v->scene, node, prop, curve->rows,
                                                 curve->count * curve->width));
}

void viewer_points_set_range(viewer_points *points, const double range[2])
{
    viewer *v = points->v;
    const tl_node node = viewer_points_begin(points);
    if (!node) return;
    tl_status st = tl_scene_set_text(v->ctx, v->scene, node, "range_by", "values");
    if (!st) st = tl_scene_set_reals(v->ctx, v->scene, node, "range", range, 2);
    if (!st && points->own_colors) {
        viewer_curve_stretch(&points->colors, points->logarithmic, points->range, range);
        st = tl_scene_set_reals(v->ctx, v->scene, node, "colors", points->colors.rows,
                                points->colors.count * points->colors.width);
    }
    viewer_points_end(points, st);
}

/* The points that a hand changes, of the line or the strip. */
static viewer_curve editable(const viewer_points *points, viewer_part part)
{
    viewer_curve curve = part == VIEWER_PART_OPACITY ? points->handles : points->colors;
    if (part == VIEWER_PART_COLOR && !points->own_colors)
        viewer_curve_thin(&curve, points->logarithmic, COLOR_TOLERANCE);
    return curve;
}

static const char *prop_of(viewer_part part)
{
    return part == VIEWER_PART_OPACITY ? "opacities" : "colors";
}

bool viewer_points_get(const viewer_points *points, double *value, double *numbers)
{
    const viewer_curve *curve =
        points->part == VIEWER_PART_OPACITY ? &points->handles : &points->colors;
    if (!points->part || points->point >= curve->count) return false;
    const double *row = viewer_curve_row_const(curve, points->point);
    *value = row[0];
    memcpy(numbers, row + 1, (curve->width - 1) * sizeof *numbers);
    return true;
}

static bool is_range_end(const viewer_points *points)
{
    return points->part == VIEWER_PART_COLOR && !points->own_colors;
}

static void move_range_end(viewer_points *points, double value)
{
    double range[2] = {points->range[0], points->range[1]};
    const bool low = points->point == 0;
    if (low)
        range[0] = fmin(value, viewer_axis_beside(&points->axis, range[1], -RANGE_LEAST_PX));
    else
        range[1] = fmax(value, viewer_axis_beside(&points->axis, range[0], RANGE_LEAST_PX));
    if (!(range[0] < range[1]) || (points->logarithmic && !(range[0] > 0))) return;
    viewer_points_set_range(points, range);
    points->point = low ? 0 : points->colors.count - 1;
}

void viewer_points_set(viewer_points *points, double value, const double *numbers)
{
    if (!points->part) return;
    if (is_range_end(points) && !numbers) {
        move_range_end(points, value);
        return;
    }
    viewer_curve curve = editable(points, points->part);
    if (is_range_end(points) && points->point) points->point = curve.count - 1;
    viewer_curve_move(&curve, points->point, value);
    double *row = viewer_curve_row(&curve, points->point);
    for (size_t k = 1; numbers && k < curve.width; k++) row[k] = fmin(fmax(numbers[k - 1], 0), 1);
    write_list(points, prop_of(points->part), &curve);
}

bool viewer_points_is_removable(const viewer_points *points)
{
    if (!points->part || is_range_end(points)) return false;
    return (points->part == VIEWER_PART_OPACITY ? points->handles.count : points->colors.count) > 1;
}

void viewer_points_remove(viewer_points *points)
{
    if (!viewer_points_is_removable(points)) return;
    const viewer_part part = points->part;
    viewer_curve curve = editable(points, part);
    viewer_curve_remove(&curve, points->point);
    points->part = VIEWER_PART_NONE;
    write_list(points, prop_of(part), &curve);
}

void viewer_points_add(viewer_points *points, viewer_part part, double value)
{
    viewer_curve curve = editable(points, part);
    const size_t at = viewer_curve_add(&curve, points->logarithmic, value);
    if (at == VIEWER_CURVE_NONE) return;
    points->part = part;
    points->point = at;
    write_list(points, prop_of(part), &curve);
}

void viewer_points_own_colors(viewer_points *points)
{
    const viewer_curve curve = editable(points, VIEWER_PART_COLOR);
    if (curve.count) write_list(points, prop_of(VIEWER_PART_COLOR), &curve);
}

void viewer_points_mirror(viewer_points *points)
{
    const viewer_axis axis = {{points->range[0], points->range[1]}, points->logarithmic, 0, 1};
    const viewer_curve old = points->colors;
    viewer_curve curve = old;
    for (size_t i = 0; i < old.count; i++) {
        const double *from = viewer_curve_row_const(&old, old.count - 1 - i);
        double *to = viewer_curve_row(&curve, i);
        memcpy(to, from, old.width * sizeof *to);
        if (axis.range[0] < axis.range[1])
            to[0] = viewer_axis_value(&axis, 1 - viewer_axis_px(&axis, from[0]));
    }
    if (curve.count) write_list(points, prop_of(VIEWER_PART_COLOR), &curve);
}

/* ---- the area ---- */

static void paint(GtkDrawingArea *area, cairo_t *cr, int width, int height, gpointer user)
{
    (void)area;
    (void)height;
    viewer_points_paint(user, cr, width);
}

viewer_points *viewer_points_create(viewer *v, void (*selected)(void *user),
                                    void (*exact)(void *user), void *user)
{
    viewer_points *points = g_new0(viewer_points, 1);
    points->v = v;
    points->selected = selected;
    points->exact = exact;
    points->user = user;
    points->logarithmic_counts = true;
    points->area = gtk_drawing_area_new();
    gtk_drawing_area_set_content_height(GTK_DRAWING_AREA(points->area), VIEWER_POINTS_HEIGHT);
    gtk_widget_set_hexpand(points->area, TRUE);
    gtk_drawing_area_set_draw_func(GTK_DRAWING_AREA(points->area), paint, points, NULL);
    g_object_set_data_full(G_OBJECT(points->area), "tetralod-points", points, g_free);
    gtk_widget_set_name(points->area, "points");
    viewer_zoom_create(&points->zoom, points->area, &points->axis, VIEWER_NUMBERS_TOP);
    viewer_points_add_hands(points);
    return points;
}
