/* The box around what is seen, and the numbers along its outer edges. Whatever the box holds lies
 * in front of the edges between faces that look away, and behind those between faces that look at
 * the camera: no depth is needed. */
#include "draw/draw_annotate.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/base_vec.h"

/* In heights of text. */
static const double LINE_WIDTH = 0.07, TICK = 0.35, GAP = 0.35, NUMBER_SCALE = 0.85;
static const double NUMBER_ROOM = 4.5, AXIS_LEAST = 3;
/* Numbers along an axis. */
static const double NUMBERS_MOST = 8;
/* Opacities of ink: edges behind, outer ones, those in front of what is seen. */
static const double BEHIND = 0.35, OUTER = 0.55, FRONT = 0.18;
/* Nearest place along the view that is drawn, as a part of the distance of what is looked at. */
static const double NEAR = 1e-3;
/* Of the triad: length of an arrow and its head in heights of text, place from the corner. */
static const double ARROW = 2.2, HEAD = 0.45, CORNER = 4;
static const char *const NAMES[3] = {"x", "y", "z"};
static const double COLORS[3][3] = {{0.80, 0.20, 0.18}, {0.20, 0.58, 0.22}, {0.22, 0.40, 0.82}};

/* Whether the low and the high face across each axis look at the camera. */
typedef struct sides {
    bool front[3][2];
} sides;

/* An edge: along an axis, at the low or high end of the other two (in the order of axes). */
typedef struct edge {
    int axis, ends[2];
} edge;

static int other_axis(int axis, int i)
{
    return (axis + 1 + i) % 3;
}

static sides look_at_faces(const double *bounds, const tli_frame *frame)
{
    sides s;
    for (int k = 0; k < 3; k++) {
        s.front[k][0] = frame->parallel ? frame->forward[k] > 0 : frame->origin[k] < bounds[2 * k];
        s.front[k][1] =
            frame->parallel ? frame->forward[k] < 0 : frame->origin[k] > bounds[2 * k + 1];
    }
    return s;
}

/* How many of the two faces of an edge look at the camera. */
static int faces_in_front(const sides *s, const edge *e)
{
    int count = 0;
    for (int i = 0; i < 2; i++) count += s->front[other_axis(e->axis, i)][e->ends[i]];
    return count;
}

static edge edge_of(int index)
{
    return (edge){index / 4, {index % 2, index / 2 % 2}};
}

/* The place at t (0 to 1) along an edge. */
static void place_on(const double *bounds, const edge *e, double t, double xyz[3])
{
    xyz[e->axis] = bounds[2 * e->axis] * (1 - t) + bounds[2 * e->axis + 1] * t;
    for (int i = 0; i < 2; i++) {
        const int k = other_axis(e->axis, i);
        xyz[k] = bounds[2 * k + e->ends[i]];
    }
}

static void to_pixels(const tli_frame *frame, const double place[3], double px[2])
{
    const double w = frame->parallel ? 1 : place[2];
    px[0] = frame->middle[0] + place[0] / w;
    px[1] = frame->middle[1] - place[1] / w;
}

/* False for what is not in front of the camera. */
static bool project(const tli_frame *frame, const double xyz[3], double px[2])
{
    double place[3];
    tli_frame_place(frame, xyz, place);
    to_pixels(frame, place, px);
    return frame->parallel || place[2] > NEAR;
}

static void draw_edge(tli_canvas *canvas, const double *bounds, const tli_frame *frame,
                      const edge *e, double width_px, double opacity)
{
    double xyz[2][3], at[2][3], px[2][2];
    for (int i = 0; i < 2; i++) {
        place_on(bounds, e, i, xyz[i]);
        tli_frame_place(frame, xyz[i], at[i]);
    }
    if (!frame->parallel) {
        if (at[0][2] < NEAR && at[1][2] < NEAR) return;
        for (int i = 0; i < 2; i++) {
            if (at[i][2] >= NEAR) continue;
            const double t = (NEAR - at[i][2]) / (at[1 - i][2] - at[i][2]);
            for (int k = 0; k < 3; k++) at[i][k] += t * (at[1 - i][k] - at[i][k]);
        }
    }
    for (int i = 0; i < 2; i++) to_pixels(frame, at[i], px[i]);
    tli_canvas_line(canvas, px[0], px[1], width_px, opacity);
}

void tli_axes_behind(tli_canvas *canvas, const tl_annotation *a, const tli_frame *frame,
                     double text_px)
{
    const sides s = look_at_faces(a->bounds, frame);
    for (int i = 0; i < 12 && a->outline; i++) {
        const edge e = edge_of(i);
        if (faces_in_front(&s, &e) == 0)
            draw_edge(canvas, a->bounds, frame, &e, LINE_WIDTH * text_px, BEHIND);
    }
}

/* ---- numbers ---- */

/* The ends of an edge on the picture; false if one is not in front of the camera. */
static bool project_edge(const double *bounds, const tli_frame *frame, const edge *e,
                         double from[2], double to[2])
{
    double xyz[3];
    place_on(bounds, e, 0, xyz);
    const bool seen = project(frame, xyz, from);
    place_on(bounds, e, 1, xyz);
    return project(frame, xyz, to) && seen;
}

/* The lowest of the outer edges along an axis, of an axis that goes up the one at the left. false:
 * none is outer, or it is too short for numbers. */
static bool pick_edge(const double *bounds, const tli_frame *frame, const sides *s, int axis,
                      double least_px, edge *picked)
{
    double best = -INFINITY, length = 0, from[2], to[2], across = 0, up = 0;
    for (int i = 4 * axis; i < 4 * axis + 4; i++) {
        const edge e = edge_of(i);
        if (!project_edge(bounds, frame, &e, from, to)) continue;
        across += fabs(to[0] - from[0]);
        up += fabs(to[1] - from[1]);
    }
    for (int i = 4 * axis; i < 4 * axis + 4; i++) {
        const edge e = edge_of(i);
        if (faces_in_front(s, &e) != 1 || !project_edge(bounds, frame, &e, from, to)) continue;
        const double score = up > 2 * across ? -(from[0] + to[0]) : from[1] + to[1];
        if (score <= best) continue;
        best = score;
        length = hypot(to[0] - from[0], to[1] - from[1]);
        *picked = e;
    }
    return length >= least_px;
}

/* The direction across an edge on the picture, away from the middle of the box. */
static bool away_from_box(const double *bounds, const tli_frame *frame, const edge *e,
                          double out[2])
{
    double from[2], to[2], middle[2], center[3];
    for (int k = 0; k < 3; k++) center[k] = bounds[2 * k] / 2 + bounds[2 * k + 1] / 2;
    if (!project_edge(bounds, frame, e, from, to) || !project(frame, center, middle)) return false;
    const double along[2] = {to[0] - from[0], to[1] - from[1]}, length = hypot(along[0], along[1]);
    out[0] = -along[1] / length;
    out[1] = along[0] / length;
    if (out[0] * (middle[0] - from[0]) + out[1] * (middle[1] - from[1]) > 0) {
        out[0] = -out[0];
        out[1] = -out[1];
    }
    return true;
}

/* Where words stand already: left, right, upper and lower edges. */
typedef struct taken {
    double boxes[3 * TL_TICKS_MAX][4];
    size_t count;
} taken;

/* Takes the room of a box; false if some of it is taken. */
static bool take_room(taken *t, const double box[4])
{
    for (size_t i = 0; i < t->count; i++)
        if (box[0] < t->boxes[i][1] && box[1] > t->boxes[i][0] && box[2] < t->boxes[i][3] &&
            box[3] > t->boxes[i][2])
            return false;
    if (t->count < sizeof t->boxes / sizeof *t->boxes)
        memcpy(t->boxes[t->count++], box, sizeof *t->boxes);
    return true;
}

/* Writes words whose box touches a place from the side that out points to, unless other words stand
 * there (room may be NULL); returns how far the box reaches. */
static double write_beside(tli_canvas *canvas, taken *room, const tli_words *words,
                           const double place[2], const double out[2], double gap)
{
    double size[2];
    tli_canvas_measure(canvas, words, size);
    const double reach = fabs(out[0]) * size[0] / 2 + fabs(out[1]) * size[1] / 2;
    const double x = place[0] + out[0] * (gap + reach), y = place[1] + out[1] * (gap + reach);
    const double apart = size[1] / 6;
    const double box[4] = {x - size[0] / 2 - apart, x + size[0] / 2 + apart, y - size[1] / 2,
                           y + size[1] / 2};
    if (!room || take_room(room, box)) tli_canvas_text(canvas, words, x, y, (double[]){0.5, 0.5});
    return gap + 2 * reach;
}

static void draw_axis(tli_canvas *canvas, const double *bounds, const tli_frame *frame,
                      const edge *e, double text_px, taken *room)
{
    tl_tick ticks[TL_TICKS_MAX];
    double out[2], xyz[3], from[2], to[2], px[2], reach = 0;
    char title[2 * TL_TICK_BYTES], factor[TL_TICK_BYTES];
    int exponent;
    if (!away_from_box(bounds, frame, e, out)) return;
    project_edge(bounds, frame, e, from, to);
    const double length = hypot(to[0] - from[0], to[1] - from[1]) / text_px;
    const size_t most = (size_t)fmin(fmax(2, length / NUMBER_ROOM), NUMBERS_MOST);
    const size_t count =
        tl_ticks(bounds[2 * e->axis], bounds[2 * e->axis + 1], most, ticks, &exponent);
    for (size_t i = 0; i < count; i++) {
        const tli_words words = {.text = ticks[i].label, .scale = NUMBER_SCALE};
        place_on(bounds, e, ticks[i].at, xyz);
        project(frame, xyz, px);
        const double end[2] = {px[0] + out[0] * TICK * text_px, px[1] + out[1] * TICK * text_px};
        tli_canvas_line(canvas, px, end, LINE_WIDTH * text_px, OUTER);
        reach = fmax(reach, write_beside(canvas, room, &words, end, out, GAP * text_px));
    }
    tl_exponent_text(exponent, factor);
    snprintf(title, sizeof title, "%s%s%s", NAMES[e->axis], exponent ? " " : "", factor);
    const tli_words words = {.text = title, .scale = 1};
    place_on(bounds, e, 0.5, xyz);
    project(frame, xyz, px);
    write_beside(canvas, room, &words, px, out, reach + (TICK + GAP) * text_px);
}

void tli_axes_front(tli_canvas *canvas, const tl_annotation *a, const tli_frame *frame,
                    double text_px)
{
    const sides s = look_at_faces(a->bounds, frame);
    for (int i = 0; i < 12 && a->outline; i++) {
        const edge e = edge_of(i);
        const int front = faces_in_front(&s, &e);
        if (front)
            draw_edge(canvas, a->bounds, frame, &e, LINE_WIDTH * text_px,
                      front == 1 ? OUTER : FRONT);
    }
    taken room = {.count = 0};
    for (int axis = 0; axis < 3 && a->axes; axis++) {
        edge e = {axis, {0, 0}};
        if (a->bounds[2 * axis] < a->bounds[2 * axis + 1] &&
            pick_edge(a->bounds, frame, &s, axis, AXIS_LEAST * text_px, &e))
            draw_axis(canvas, a->bounds, frame, &e, text_px, &room);
    }
}

/* ---- directions ---- */

void tli_triad(tli_canvas *canvas, const tli_frame *frame, uint32_t height, double text_px)
{
    const double from[2] = {CORNER * text_px, height - CORNER * text_px};
    int order[3] = {0, 1, 2}; /* those that point away first */
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2 - i; j++)
            if (frame->forward[order[j]] < frame->forward[order[j + 1]]) {
                const int swapped = order[j];
                order[j] = order[j + 1];
                order[j + 1] = swapped;
            }
    for (int i = 0; i < 3; i++) {
        const int k = order[i];
        const double along[2] = {frame->right[k] * ARROW * text_px,
                                 -frame->up[k] * ARROW * text_px};
        const double length = hypot(along[0], along[1]), head = HEAD * text_px;
        const double tip[2] = {from[0] + along[0], from[1] + along[1]};
        const tli_words words = {.text = NAMES[k], .scale = NUMBER_SCALE, .rgb = COLORS[k]};
        if (length < head) continue;
        const double u[2] = {along[0] / length, along[1] / length};
        const double neck[2] = {tip[0] - u[0] * head, tip[1] - u[1] * head};
        const double corners[3][2] = {{tip[0] + u[0] * head, tip[1] + u[1] * head},
                                      {neck[0] - u[1] * head / 2, neck[1] + u[0] * head / 2},
                                      {neck[0] + u[1] * head / 2, neck[1] - u[0] * head / 2}};
        tli_canvas_line(canvas, from, neck, 2 * LINE_WIDTH * text_px, 1);
        tli_canvas_triangle(canvas, corners, COLORS[k]);
        write_beside(canvas, NULL, &words, corners[0], u, GAP * text_px / 2);
    }
}
