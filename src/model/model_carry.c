/* Original vertices and centroids in the mesh of a segment: where they lie, and how far the values
 * there are off, in the channel's unit and in space. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "model/model.h"

enum {
    WALK_STEPS = 128,
    SETTLE_STEPS = 16,
    RING_TETS = 256 /* tets around a point that are searched for a value before all are */
};
/* A weight down to this counts as on the face. */
static const double ON_FACE = -1e-10;

/* ---- places ---- */

/* First corner, and rows that give the weights of the other ones; not a number where a tet is flat
 * or turned. */
static void set_frame(const tl_mesh *mesh, tl_lidx tet, double frame[12])
{
    const tl_lidx *q = mesh->tets + 4 * (size_t)tet;
    const double *o = mesh->xyz + 3 * (size_t)q[0];
    double e[3][3], *rows = frame + 3;
    for (int i = 0; i < 3; i++) vec_sub(mesh->xyz + 3 * (size_t)q[i + 1], o, e[i]);
    for (int i = 0; i < 3; i++) vec_cross(e[(i + 1) % 3], e[(i + 2) % 3], rows + 3 * i);
    double det = vec_dot(e[0], rows), inv = det > 0 ? 1 / det : (double)NAN;
    for (int i = 0; i < 3; i++) frame[i] = o[i];
    for (int i = 0; i < 9; i++) rows[i] *= inv;
}

static const double *frame_of(const tli_carrier *c, tl_lidx tet, double room[12])
{
    if (c->frames) return c->frames[tet];
    set_frame(c->mesh, tet, room);
    return room;
}

/* Weights of x in a tet; false for a flat or turned one. */
static bool weigh(const tli_carrier *c, tl_lidx tet, const double x[3], double w[4])
{
    double room[12], d[3];
    const double *f = frame_of(c, tet, room);
    vec_sub(x, f, d);
    for (int i = 1; i < 4; i++) w[i] = vec_dot(d, f + 3 * i);
    w[0] = 1 - w[1] - w[2] - w[3];
    return !isnan(w[0]);
}

tl_status tli_carrier_open(tl_ctx *ctx, const tli_plan *plan, tl_mesh *mesh,
                           const tl_lidx *opposite, tli_errors *errors, tli_carrier *c)
{
    tl_status st = TL_OK;
    *c = (tli_carrier){
        .ctx = ctx, .plan = plan, .mesh = mesh, .opposite = opposite, .errors = errors};
    c->frames = tl_mem_alloc(ctx, mesh->tet_count, sizeof *c->frames, &st);
    for (size_t t = 0; !st && t < mesh->tet_count; t++) set_frame(mesh, (tl_lidx)t, c->frames[t]);
    return st;
}

void tli_carrier_close(tli_carrier *c)
{
    if (!c->ctx) return;
    tl_locator_destroy(c->locator);
    tl_mem_free(c->ctx, c->frames);
    *c = (tli_carrier){0};
}

/* Walks to the tet that holds x; false where the boundary or a flat tet is in the way. */
static bool walk(const tli_carrier *c, const double x[3], tl_lidx *tet, double w[4])
{
    for (int step = 0; step < WALK_STEPS; step++) {
        if (!weigh(c, *tet, x, w)) return false;
        int way = -1, least = 0;
        for (int i = 0; i < 4; i++) {
            if (w[i] < w[least]) least = i;
            if (w[i] < 0 && c->opposite[4 * (size_t)*tet + (size_t)i] != TL_NONE &&
                (way < 0 || w[i] < w[way]))
                way = i;
        }
        if (w[least] > ON_FACE) return true;
        if (way < 0) return false;
        *tet = c->opposite[4 * (size_t)*tet + (size_t)way] / 4;
    }
    return false;
}

static void clamp_weights(double w[4])
{
    double sum = 0;
    for (int i = 0; i < 4; i++) {
        if (w[i] < 0) w[i] = 0;
        sum += w[i];
    }
    for (int i = 0; i < 4; i++) w[i] /= sum;
}

/* Where the walk ended at the boundary: from tet to tet as long as that is nearer. Fine if that
 * ends no farther than what is promised of the boundary anyway. */
static bool settle(const tli_carrier *c, const double x[3], tl_lidx *tet, double w[4],
                   double *distance)
{
    double p[4][3], reach = fmax(c->errors->surface, c->plan->position_error);
    bool nearer = true;
    tli_tet_corners(c->mesh->xyz, c->mesh->tets + 4 * (size_t)*tet, p);
    *distance = tl_tet_nearest(TLI_CORNERS(p), x, w);
    for (int step = 0; step < SETTLE_STEPS && nearer && *distance > 0; step++) {
        tl_lidx at = *tet;
        nearer = false;
        for (size_t f = 0; f < 4; f++) {
            tl_lidx o = c->opposite[4 * (size_t)at + f];
            double v[4];
            if (o == TL_NONE) continue;
            tli_tet_corners(c->mesh->xyz, c->mesh->tets + 4 * (size_t)(o / 4), p);
            double d = tl_tet_nearest(TLI_CORNERS(p), x, v);
            if (!(d < *distance)) continue;
            nearer = true;
            *distance = d;
            *tet = o / 4;
            memcpy(w, v, sizeof v);
        }
    }
    return !nearer && *distance <= reach;
}

bool tli_carrier_near(const tli_carrier *c, const double x[3], tl_lidx hint, tl_lidx *tet,
                      double w[4], double *distance)
{
    *tet = hint;
    *distance = 0;
    if (hint == TL_NONE) return false;
    if (!walk(c, x, tet, w)) return settle(c, x, tet, w, distance);
    clamp_weights(w);
    return true;
}

tl_status tli_carrier_survey(tli_carrier *c)
{
    return c->locator ? TL_OK : tl_locator_create(c->ctx, c->mesh, c->opposite, &c->locator);
}

tl_status tli_carrier_find(const tli_carrier *c, const double x[3], tl_lidx *tet, double w[4],
                           double *distance)
{
    *tet = tl_locator_nearest(c->locator, x, TL_NONE, w, distance);
    if (*tet != TL_NONE) return TL_OK;
    return tl_fail(c->ctx, TL_ERR_DATA, "no tet holds the place %g %g %g", x[0], x[1], x[2]);
}

tl_status tli_carrier_locate(tli_carrier *c, const double x[3], tl_lidx hint, tl_lidx *tet,
                             double w[4], double *distance)
{
    if (tli_carrier_near(c, x, hint, tet, w, distance)) return TL_OK;
    tl_status st = tli_carrier_survey(c);
    return st ? st : tli_carrier_find(c, x, tet, w, distance);
}

void tli_carrier_weigh(const tli_carrier *c, const double x[3], tl_lidx tet, double w[4],
                       double *distance)
{
    double p[4][3];
    *distance = 0;
    if (weigh(c, tet, x, w) && w[0] > ON_FACE && w[1] > ON_FACE && w[2] > ON_FACE &&
        w[3] > ON_FACE) {
        clamp_weights(w);
        return;
    }
    tli_tet_corners(c->mesh->xyz, c->mesh->tets + 4 * (size_t)tet, p);
    *distance = tl_tet_nearest(TLI_CORNERS(p), x, w);
}

/* ---- distance to a value ---- */

typedef struct seeker {
    const tli_carrier *carrier;
    const double *values; /* of a scalar channel */
    const double *x;
    double value, best2;
} seeker;

/* The nearest point with the value on the edges of a tet: an upper bound of the distance. */
static void seek_in_tet(seeker *s, tl_lidx tet)
{
    const tl_mesh *mesh = s->carrier->mesh;
    const tl_lidx *q = mesh->tets + 4 * (size_t)tet;
    double f[4];
    bool below = false, above = false;
    for (int i = 0; i < 4; i++) {
        f[i] = s->values[q[i]] - s->value;
        below |= f[i] <= 0;
        above |= f[i] >= 0;
    }
    if (!below || !above) return;
    for (int i = 0; i < 4; i++)
        for (int j = i + 1; j < 4; j++) {
            if (f[i] * f[j] > 0 || !isfinite(f[i]) || !isfinite(f[j])) continue;
            double span = f[j] - f[i], at = span != 0 ? -f[i] / span : 0, d2 = 0;
            const double *a = mesh->xyz + 3 * (size_t)q[i], *b = mesh->xyz + 3 * (size_t)q[j];
            for (int k = 0; k < 3; k++) {
                double d = a[k] + at * (b[k] - a[k]) - s->x[k];
                d2 += d * d;
            }
            if (d2 < s->best2) s->best2 = d2;
        }
}

/* Along the gradient, if that ends inside of the tet. */
static bool seek_along(seeker *s, tl_lidx tet, double error)
{
    const tl_lidx *q = s->carrier->mesh->tets + 4 * (size_t)tet;
    double room[12], g[3] = {0, 0, 0}, y[3], w[4];
    const double *rows = frame_of(s->carrier, tet, room) + 3;
    for (int i = 0; i < 3; i++) {
        double df = s->values[q[i + 1]] - s->values[q[0]];
        for (int k = 0; k < 3; k++) g[k] += df * rows[3 * i + k];
    }
    double g2 = vec_dot(g, g);
    if (!(g2 > 0)) return false;
    for (int k = 0; k < 3; k++) y[k] = s->x[k] + g[k] * (error / g2);
    if (!weigh(s->carrier, tet, y, w)) return false;
    for (int i = 0; i < 4; i++)
        if (w[i] < 0) return false;
    s->best2 = error * error / g2;
    return true;
}

/* Rings of tets around one until a place with the value is found and the ring is done. */
static void seek_around(seeker *s, tl_lidx tet)
{
    tl_lidx list[RING_TETS];
    const tl_lidx *opposite = s->carrier->opposite;
    size_t count = 0, ring_end = 1;
    list[count++] = tet;
    for (size_t at = 0; at < count; at++) {
        if (at == ring_end) {
            if (isfinite(s->best2)) return;
            ring_end = count;
        }
        seek_in_tet(s, list[at]);
        for (size_t f = 0; f < 4 && count < RING_TETS; f++) {
            tl_lidx o = opposite[4 * (size_t)list[at] + f];
            size_t i = 0;
            if (o == TL_NONE) continue;
            while (i < count && list[i] != o / 4) i++;
            if (i == count) list[count++] = o / 4;
        }
    }
}

/* At most this far from x the mesh has the value; INFINITY where it does not. */
static double value_distance(const tli_carrier *c, const double *values, const double x[3],
                             tl_lidx tet, double value, double error, double offset)
{
    seeker s = {c, values, x, value, (double)INFINITY};
    if (offset == 0 && seek_along(&s, tet, error)) return sqrt(s.best2);
    seek_around(&s, tet);
    if (!isfinite(s.best2))
        for (size_t t = 0; t < c->mesh->tet_count; t++) seek_in_tet(&s, (tl_lidx)t);
    return sqrt(s.best2);
}

/* ---- errors ---- */

static float round_up(double value)
{
    float f = (float)value;
    return (double)f < value ? nextafterf(f, INFINITY) : f;
}

/* Value of a component at a point of a tet; a corner of weight 0 has no say. */
static double value_at(const tl_channel *c, const tl_lidx *q, const double w[4], uint32_t k)
{
    int base = 0;
    for (int i = 1; i < 4; i++)
        if (w[i] > w[base]) base = i;
    double at = c->values[q[base] * (size_t)c->components + k], sum = at;
    for (int i = 0; i < 4; i++)
        if (i != base && w[i] != 0)
            sum += w[i] * (c->values[q[i] * (size_t)c->components + k] - at);
    return sum;
}

/* A point near a corner without a finite value takes that of its nearest finite one. */
static double finite_near(const tl_channel *c, const tl_lidx *q, const double w[4], uint32_t k)
{
    double best = -1, value = (double)NAN;
    for (int i = 0; i < 4; i++) {
        double at = c->values[q[i] * (size_t)c->components + k];
        if (isfinite(at) && w[i] > best) {
            best = w[i];
            value = at;
        }
    }
    return value;
}

static void count_error(tli_errors *e, const tli_field *f, size_t field, double before,
                        double after, double error)
{
    unsigned a = tli_field_bin(f, before), b = tli_field_bin(f, after);
    unsigned lo = a < b ? a : b, hi = a < b ? b : a;
    float up = round_up(error);
    if (error > e->max[field]) e->max[field] = error;
    for (unsigned i = lo; i <= hi; i++)
        if (up > e->field[field * TLI_BINS + i]) e->field[field * TLI_BINS + i] = up;
}

static void measure_space(tli_carrier *c, size_t field, const double *x, double before,
                          double error, tl_lidx tet, double offset)
{
    const tli_field *f = &c->plan->fields[field];
    float *bin = &c->errors->space[field * TLI_BINS + tli_field_bin(f, before)];
    if (*bin == INFINITY) return;
    double d = value_distance(c, c->mesh->channels[field].values, x, tet, before, error, offset);
    float up = round_up(d);
    if (up > *bin) *bin = up;
}

void tli_carrier_measure(tli_carrier *c, int kind, const double *record, tl_lidx tet,
                         const double w[4], double distance, double *squares)
{
    const tl_lidx *q = c->mesh->tets + 4 * (size_t)tet;
    const double *originals = record + (kind == TLI_CELLS ? 4 : 3);
    tl_on on = kind == TLI_CELLS ? TL_ON_TET : TL_ON_VERTEX;
    if (kind == TLI_POINTS && distance > c->errors->surface) c->errors->surface = distance;
    for (size_t i = 0; i < c->plan->field_count; i++) {
        const tli_field *f = &c->plan->fields[i];
        const tl_channel *ch = &c->mesh->channels[i];
        if (f->on != on) continue;
        double sum = 0, before2 = 0, after2 = 0, difference = 0;
        const double *original = originals + f->first;
        for (uint32_t k = 0; k < f->components; k++) {
            double value = on == TL_ON_TET ? ch->values[tet * (size_t)f->components + k]
                                           : value_at(ch, q, w, k);
            if (!isfinite(value) && on == TL_ON_VERTEX) value = finite_near(ch, q, w, k);
            difference = original[k] - value;
            sum += difference * difference;
            before2 += original[k] * original[k];
            after2 += value * value;
        }
        if (!isfinite(before2)) continue;
        double error = f->components == 1 ? fabs(difference) : sqrt(sum);
        if (isnan(error)) error = (double)INFINITY;
        squares[i] += error * error;
        if (error == 0) continue;
        bool scalar = f->components == 1;
        double before = scalar ? original[0] : sqrt(before2);
        double after = scalar ? original[0] - difference : sqrt(after2);
        count_error(c->errors, f, i, before, after, error);
        if (scalar && on == TL_ON_VERTEX)
            measure_space(c, i, record, before, difference, tet, distance);
        else /* the value between the vertices is not linear: no place is promised */
            c->errors->space[i * TLI_BINS + tli_field_bin(f, before)] = INFINITY;
    }
}
