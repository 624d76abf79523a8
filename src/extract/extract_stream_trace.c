/* One streamline: steps of second order (midpoint) or of Dormand & Prince's pair of orders 5 and 4
 * with its error held, and the rules that end it. A step is a part of the longest chord of the tet
 * along the flow, and shorter where the vector turns or grows faster than that: near a critical
 * point a tet is no measure. A step that leaves the mesh is taken again at half its size until it
 * is short; then the line ends where it leaves. Loops are found as cycles of sequences are: a step
 * that passes the seed, or a vertex remembered at every power of two of steps, in the same
 * direction. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "extract/extract_stream.h"
#include "mesh/mesh.h"

/* A step at the boundary is halved until it is this part of the longest. */
static const double STEP_LEAVING = 1.0 / 256;
/* A step that passes a remembered vertex closer than this part of its length closes a loop, if its
 * direction differs by less than about 25 degrees, and the line has gone at least so many steps. */
static const double LOOP_NEAR = 0.02, LOOP_COSINE = 0.9;
enum { LOOP_STEPS = 6 };
/* The change of the vector in a step, in its length, that is allowed: lines look smooth, and are
 * right in tets that hold a critical point. */
static const double TURN_MAX = 0.35;
/* What is left of a length or time, relative to all of it, that is as good as none. */
static const double LEFT = 1e-9;
/* Order 5: how a step may change at once, and the part of the step that the error allows. */
static const double GROWTH_MAX = 4, GROWTH_MIN = 0.2, SAFETY = 0.9;
/* Order 5: steps are not shorter than this part of the longest, whatever their error: where the
 * gradient jumps from tet to tet it falls slowly. */
static const double STEP_LEAST = 1.0 / 1024;

typedef struct anchor {
    double x[3], v[3];
    size_t step;
} anchor;

/* The end of a line that moves; sign: with the flow or against it. */
typedef struct walker {
    tli_stream_cell cell;
    double x[3], weights[4], v[3];
    double time, length, sign;
    double step; /* order 5: the next one, in time */
    size_t steps;
    anchor seed, later;
} walker;

static void set_anchor(anchor *a, const walker *w)
{
    memcpy(a->x, w->x, sizeof a->x);
    memcpy(a->v, w->v, sizeof a->v);
    a->step = w->steps;
}

/* ---- rows ---- */

static tl_status push_row(const tli_stream_job *job, const walker *w, tli_stream_line *line)
{
    tl_status st = TL_OK;
    size_t width = job->row_doubles;
    if (line->count == line->room) {
        size_t room = line->room ? 2 * line->room : 64;
        line->rows = tl_mem_resize(job->ctx, line->rows, room, width * sizeof *line->rows, &st);
        if (st) return st;
        line->room = room;
    }
    double *row = line->rows + width * line->count++, *to = row + TLI_ROW_CARRIED;
    const tl_mesh *mesh = job->field.mesh;
    const tl_lidx *q = mesh->tets + 4 * (size_t)w->cell.tet;
    memcpy(row, w->x, sizeof w->x);
    row[TLI_ROW_TIME] = w->sign * w->time;
    row[TLI_ROW_SPEED] = vec_length(w->v);
    for (size_t c = 0; c < job->opts.channel_count; c++) {
        const tl_channel *channel = &mesh->channels[job->opts.channels[c]];
        size_t n = channel->components;
        for (size_t k = 0; k < n; k++, to++) {
            *to = 0;
            for (int i = 0; i < 4; i++) *to += w->weights[i] * channel->values[n * q[i] + k];
        }
    }
    if (job->opts.normals) *to = w->sign * tli_stream_spin(&w->cell, w->v);
    return st;
}

/* Turns the order of the rows. */
static void turn_rows(const tli_stream_job *job, tli_stream_line *line)
{
    size_t width = job->row_doubles;
    for (size_t i = 0, j = line->count; i + 1 < j; i++) {
        double *a = line->rows + width * i, *b = line->rows + width * --j;
        for (size_t k = 0; k < width; k++) {
            double kept = a[k];
            a[k] = b[k];
            b[k] = kept;
        }
    }
}

/* ---- steps ---- */

/* The vector at the walker's point, along its direction. */
static void look(walker *w)
{
    tli_stream_vector(&w->cell, w->weights, w->v);
    for (int k = 0; k < 3; k++) w->v[k] *= w->sign;
}

/* The longest step in time: a part of the chord of the cell along the vector; less where the vector
 * turns or grows faster than that. */
static double longest_step(const tli_stream_job *job, const walker *w)
{
    double chords = 0, change[3] = {0, 0, 0};
    for (int i = 0; i < 4; i++) {
        double along = vec_dot(w->cell.slopes[i], w->v);
        chords += fabs(along) / 2;
        for (int k = 0; k < 3; k++) change[k] += along * w->cell.vectors[i][k];
    }
    double step = job->opts.step / chords;
    double turn = vec_dot(change, change) * step * step, square = vec_dot(w->v, w->v);
    return turn > TURN_MAX * TURN_MAX * square ? step * TURN_MAX * sqrt(square / turn) : step;
}

/* Cuts a step so that time and length are not passed. */
static double clip_step(const tli_stream_job *job, const walker *w, double h)
{
    double speed = vec_length(w->v);
    double time = job->time_max - w->time, length = (job->length_max - w->length) / speed;
    h = h < time ? h : time;
    return h < length ? h : length;
}

/* x + h v, and the way there; the vector at its end. */
static tli_stream_way go(const tli_stream_job *job, walker *w, const double at[3],
                         const double to[3], double v[3], double *reached)
{
    tli_stream_way way = tli_stream_walk(&job->field, &w->cell, at, to, w->weights, reached);
    if (way != TLI_WAY_IN) return way;
    tli_stream_vector(&w->cell, w->weights, v);
    for (int k = 0; k < 3; k++) v[k] *= w->sign;
    return vec_is_finite(v) ? TLI_WAY_IN : TLI_WAY_LOST;
}

static tli_stream_way step_second(const tli_stream_job *job, walker *w, double h, double to[3],
                                  double v[3])
{
    double middle[3], slope[3], reached;
    for (int k = 0; k < 3; k++) middle[k] = w->x[k] + h / 2 * w->v[k];
    tli_stream_way way = go(job, w, w->x, middle, slope, &reached);
    if (way != TLI_WAY_IN) return way;
    for (int k = 0; k < 3; k++) to[k] = w->x[k] + h * slope[k];
    return go(job, w, middle, to, v, &reached);
}

/* Dormand & Prince 1980; the last stage is the first of the next step. error: mesh units. */
static tli_stream_way step_fifth(const tli_stream_job *job, walker *w, double h, double to[3],
                                 double v[3], double *error)
{
    static const double A[6][6] = {
        {1.0 / 5},
        {3.0 / 40, 9.0 / 40},
        {44.0 / 45, -56.0 / 15, 32.0 / 9},
        {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
        {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
        {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
    static const double E[7] = {71.0 / 57600,      0,          -71.0 / 16695, 71.0 / 1920,
                                -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
    double slopes[7][3], at[3], reached;
    memcpy(slopes[0], w->v, sizeof slopes[0]);
    memcpy(at, w->x, sizeof at);
    for (int stage = 0; stage < 6; stage++) {
        double sum[3] = {0, 0, 0};
        for (int i = 0; i <= stage; i++)
            for (int k = 0; k < 3; k++) sum[k] += A[stage][i] * slopes[i][k];
        for (int k = 0; k < 3; k++) to[k] = w->x[k] + h * sum[k];
        tli_stream_way way = go(job, w, at, to, slopes[stage + 1], &reached);
        if (way != TLI_WAY_IN) return way;
        memcpy(at, to, sizeof at);
    }
    double off[3] = {0, 0, 0};
    for (int i = 0; i < 7; i++)
        for (int k = 0; k < 3; k++) off[k] += h * E[i] * slopes[i][k];
    *error = vec_length(off);
    memcpy(v, slopes[6], sizeof slopes[6]);
    return TLI_WAY_IN;
}

/* Moves the walker to the end of a step of h. */
static void arrive(walker *w, double h, const double to[3], const double v[3])
{
    double way[3];
    vec_sub(to, w->x, way);
    w->length += vec_length(way);
    w->time += h;
    w->steps++;
    memcpy(w->x, to, sizeof w->x);
    memcpy(w->v, v, sizeof w->v);
}

/* Straight on to the boundary: what is left is a small part of a tet. */
static void leave(const tli_stream_job *job, walker *w, double h)
{
    double to[3], reached;
    for (int k = 0; k < 3; k++) to[k] = w->x[k] + h * w->v[k];
    tli_stream_way way = tli_stream_walk(&job->field, &w->cell, w->x, to, w->weights, &reached);
    if (way == TLI_WAY_LOST) return;
    if (way == TLI_WAY_OUT) {
        double sum = 0;
        for (int k = 0; k < 3; k++) to[k] = w->x[k] + reached * (to[k] - w->x[k]);
        tli_stream_weights(&w->cell, to, w->weights);
        for (int i = 0; i < 4; i++) {
            w->weights[i] = w->weights[i] > 0 ? w->weights[i] : 0;
            sum += w->weights[i];
        }
        for (int i = 0; i < 4; i++) w->weights[i] /= sum;
        h *= reached;
    }
    double v[3];
    tli_stream_vector(&w->cell, w->weights, v);
    arrive(w, h, to, v);
}

/* Order 5: the step after one of h with that error. */
static double next_step(const tli_stream_job *job, double h, double error)
{
    double grow = error > 0 ? SAFETY * pow(job->tolerance / error, 0.2) : GROWTH_MAX;
    grow = grow < GROWTH_MAX ? grow : GROWTH_MAX;
    return h * (grow > GROWTH_MIN ? grow : GROWTH_MIN);
}

/* One step of either order; TLI_WAY_OUT: the boundary is reached. */
static tli_stream_way advance(const tli_stream_job *job, walker *w)
{
    const tli_stream_cell start = w->cell;
    bool fifth = job->opts.order == 5;
    double to[3], v[3], error = 0, longest = longest_step(job, w);
    double h = clip_step(job, w, fifth && w->step < longest ? w->step : longest);
    for (;; w->cell = start) {
        if (!(h > 0 && isfinite(h))) return TLI_WAY_LOST;
        tli_stream_way way =
            fifth ? step_fifth(job, w, h, to, v, &error) : step_second(job, w, h, to, v);
        if (way == TLI_WAY_LOST) return way;
        if (way == TLI_WAY_OUT) {
            if (h <= STEP_LEAVING * longest) {
                w->cell = start;
                leave(job, w, h);
                return way;
            }
            h /= 2;
            continue;
        }
        if (!fifth) break;
        w->step = next_step(job, h, error);
        if (error <= job->tolerance || h <= STEP_LEAST * longest) break;
        h = w->step;
    }
    arrive(w, h, to, v);
    return TLI_WAY_IN;
}

/* ---- a line ---- */

/* True if the step from x, where the vector was v, to the walker's point passes an anchor, going
 * where it went. A step is an arc: off its chord by an eighth of its turn. */
static bool passes(const anchor *a, const double x[3], const double v[3], const walker *w)
{
    double way[3], to[3], bend[3];
    if (w->steps - a->step < LOOP_STEPS) return false;
    vec_sub(w->x, x, way);
    vec_sub(a->x, x, to);
    double square = vec_dot(way, way), part = vec_dot(to, way) / square;
    if (!(part >= 0 && part <= 1)) return false;
    vec_sub(w->v, v, bend);
    double near = LOOP_NEAR + vec_length(bend) / vec_length(v) / 8;
    double off = vec_dot(to, to) - part * part * square;
    double along = vec_dot(way, a->v);
    return off < near * near * square && along > 0 &&
           along * along > LOOP_COSINE * LOOP_COSINE * square * vec_dot(a->v, a->v);
}

/* The rule that ends the line now, TL_STREAM_END_COUNT for none; x, v: where the last step began.
 */
static tl_stream_end ends_here(const tli_stream_job *job, walker *w, const double x[3],
                               const double v[3])
{
    double square = vec_dot(w->v, w->v);
    if (!isfinite(square)) return TL_STREAM_END_VALUE;
    if (square <= job->speed_min * job->speed_min) return TL_STREAM_END_SPEED;
    if (w->length >= job->length_max * (1 - LEFT)) return TL_STREAM_END_LENGTH;
    if (w->time >= job->time_max * (1 - LEFT)) return TL_STREAM_END_TIME;
    if (w->steps >= job->opts.step_max) return TL_STREAM_END_STEPS;
    if (passes(&w->seed, x, v, w) || passes(&w->later, x, v, w)) return TL_STREAM_END_LOOP;
    if ((w->steps & (w->steps - 1)) == 0) set_anchor(&w->later, w);
    return TL_STREAM_END_COUNT;
}

/* From the seed in one direction; the rows of the line go on after what is there. */
static tl_status trace_one(const tli_stream_job *job, const walker *seed, double sign,
                           tli_stream_line *line, tl_stream_end *end)
{
    tl_status st = TL_OK;
    walker w = *seed;
    w.sign = sign;
    look(&w);
    w.step = INFINITY;
    set_anchor(&w.seed, &w);
    set_anchor(&w.later, &w);
    *end = ends_here(job, &w, w.x, w.v);
    while (!st && *end == TL_STREAM_END_COUNT) {
        const double x[3] = {w.x[0], w.x[1], w.x[2]}, v[3] = {w.v[0], w.v[1], w.v[2]};
        size_t steps = w.steps;
        tli_stream_way way = advance(job, &w);
        if (way == TLI_WAY_LOST)
            *end = TL_STREAM_END_VALUE;
        else if (way == TLI_WAY_OUT)
            *end = TL_STREAM_END_BOUNDARY;
        else
            *end = ends_here(job, &w, x, v);
        if (*end != TL_STREAM_END_VALUE && w.steps > steps) st = push_row(job, &w, line);
    }
    if (!st) line->ends[*end]++;
    line->steps += w.steps;
    return st;
}

tl_status tli_stream_trace(const tli_stream_job *job, const double seed[3], tli_stream_line *line)
{
    walker w = {0};
    tl_status st = TL_OK;
    tl_stream_end end = TL_STREAM_END_COUNT;
    tl_lidx tet = tl_locator_find(job->field.locator, seed, TL_NONE, NULL);
    line->count = 0;
    line->steps = 0;
    memset(line->ends, 0, sizeof line->ends);
    if (tet == TL_NONE || !tli_stream_enter(&job->field, tet, &w.cell)) return TL_OK;
    memcpy(w.x, seed, sizeof w.x);
    tli_stream_weights(&w.cell, seed, w.weights);
    w.sign = 1;
    look(&w);
    double square = vec_dot(w.v, w.v);
    if (!isfinite(square) || square <= job->speed_min * job->speed_min) return TL_OK;
    if (job->opts.direction & TL_STREAM_BACKWARD) st = trace_one(job, &w, -1, line, &end);
    turn_rows(job, line);
    if (!st) st = push_row(job, &w, line);
    if (!st && end != TL_STREAM_END_LOOP && (job->opts.direction & TL_STREAM_FORWARD))
        st = trace_one(job, &w, 1, line, &end);
    return st;
}
