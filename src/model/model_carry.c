/* Original vertices and centroids in the mesh of a segment: where they lie, and how far the values
 * there are off, in the channel's unit and in space. */
#include <math.h>
#include <string.h>

#include "model/model_space.h"

enum { WALK_STEPS = 128, SETTLE_STEPS = 16 };
/* A weight down to this counts as on the face. */
static const double ON_FACE = -1e-10;

/* ---- places ---- */

tl_status tli_carrier_open(tl_ctx *ctx, const tli_plan *plan, tl_mesh *mesh,
                           const tl_lidx *opposite, tli_errors *errors, tli_carrier *c)
{
    tl_status st = TL_OK;
    *c = (tli_carrier){
        .ctx = ctx, .plan = plan, .mesh = mesh, .opposite = opposite, .errors = errors};
    c->frames = tl_mem_alloc(ctx, mesh->tet_count, sizeof *c->frames, &st);
    for (size_t t = 0; !st && t < mesh->tet_count; t++)
        tli_frame_set(mesh, (tl_lidx)t, c->frames[t]);
    return st;
}

void tli_carrier_close(tli_carrier *c)
{
    if (!c->ctx) return;
    tl_locator_destroy(c->locator);
    tl_mem_free(c->ctx, c->blocks);
    tl_mem_free(c->ctx, c->frames);
    *c = (tli_carrier){0};
}

/* Walks to the tet that holds x; false where the boundary or a flat tet is in the way. */
static bool walk(const tli_carrier *c, const double x[3], tl_lidx *tet, double w[4])
{
    for (int step = 0; step < WALK_STEPS; step++) {
        if (!tli_frame_weigh(c, *tet, x, w)) return false;
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
    if (tli_frame_weigh(c, tet, x, w) && w[0] > ON_FACE && w[1] > ON_FACE && w[2] > ON_FACE &&
        w[3] > ON_FACE) {
        clamp_weights(w);
        return;
    }
    tli_tet_corners(c->mesh->xyz, c->mesh->tets + 4 * (size_t)tet, p);
    *distance = tl_tet_nearest(TLI_CORNERS(p), x, w);
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

/* What the isosurfaces of a channel are made of: its value or norm, between the corners of a tet as
 * they are joined linearly. */
static double scalar_at(const tl_channel *ch, const tl_lidx *q, const double w[4])
{
    double sum = 0;
    for (int i = 0; i < 4; i++)
        if (w[i] != 0) sum += w[i] * tli_channel_norm(ch, q[i]);
    return sum;
}

/* An original's own value, and those whose isosurfaces pass by it, in the original or the mesh. */
typedef struct values {
    double own, low, high;
} values;

/* Distance to the own value. Where the mesh has lost that, its bin is, and those towards the value
 * at x, up to one the mesh has. */
static double seek_value(const tli_carrier *c, size_t field, const double *x, double own,
                         double error, tl_lidx tet, double offset, double enough)
{
    const tli_field *f = &c->plan->fields[field];
    const double here = own - error, width = (f->range[1] - f->range[0]) / TLI_BINS;
    const unsigned last = tli_field_bin(f, isfinite(here) ? here : own);
    double value = own;
    for (unsigned bin = tli_field_bin(f, own);; bin += error > 0 ? -1u : 1u) {
        double far = tli_space_distance(c, field, x, tet, value, value - here, offset, enough);
        if (isfinite(far)) return far;
        c->errors->space[field * TLI_BINS + bin] = INFINITY;
        if (bin == last) return offset;
        value = f->range[0] + width * (error > 0 ? bin : bin + 1);
    }
}

/* error: what the original at x is above the mesh. */
static void measure_space(const tli_carrier *c, size_t field, const double *x, const values *v,
                          double error, tl_lidx tet, double offset)
{
    const tli_field *f = &c->plan->fields[field];
    float *bins = c->errors->space + field * TLI_BINS, least = INFINITY;
    const unsigned first = tli_field_bin(f, v->low), last = tli_field_bin(f, v->high);
    for (unsigned i = first; i <= last; i++)
        if (bins[i] < least) least = bins[i];
    if (least == INFINITY || (error == 0 && offset <= (double)least)) return;
    float up = round_up(seek_value(c, field, x, v->own, error, tet, offset, (double)least));
    for (unsigned i = first; i <= last; i++)
        if (up > bins[i]) bins[i] = up;
}

/* By the star of a vertex, in the original and moved by the error, as it is in the mesh. */
static void widen(values *v, const double *stars, size_t number, double error)
{
    tli_star star;
    memcpy(&star, stars + number, sizeof star);
    if (!isfinite(error)) error = 0;
    v->low = fmin((double)star.low, (double)star.low - error);
    v->high = fmax((double)star.high, (double)star.high - error);
}

void tli_carrier_measure(tli_carrier *c, int kind, const double *record, tl_lidx tet,
                         const double w[4], double distance, double *squares)
{
    const tl_lidx *q = c->mesh->tets + 4 * (size_t)tet;
    const double *originals = record + (kind == TLI_CELLS ? 4 : 3);
    tl_on on = kind == TLI_CELLS ? TL_ON_TET : TL_ON_VERTEX;
    size_t at = 0;
    if (kind == TLI_POINTS && distance > c->errors->surface) c->errors->surface = distance;
    for (size_t i = 0; i < c->plan->field_count; i++) {
        const tli_field *f = &c->plan->fields[i];
        const tl_channel *ch = &c->mesh->channels[i];
        if (f->on != on) continue;
        const size_t number = at++;
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
        bool scalar = f->components == 1;
        double error = scalar ? fabs(difference) : sqrt(sum);
        if (isnan(error)) error = (double)INFINITY;
        squares[i] += error * error;
        double before = scalar ? original[0] : sqrt(before2);
        double after = scalar ? original[0] - difference : sqrt(after2);
        if (error != 0) count_error(c->errors, f, i, before, after, error);
        values v = {before, before, before};
        if (!scalar) difference = before - (on == TL_ON_TET ? after : scalar_at(ch, q, w));
        if (on == TL_ON_VERTEX) widen(&v, record + 3 + c->plan->vert_comps, number, difference);
        measure_space(c, i, record, &v, difference, tet, distance);
    }
}
