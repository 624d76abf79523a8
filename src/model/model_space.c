/* How far from an original vertex or centroid a mesh has its value (the spatial error of
 * Sondershaus 2007, 3.1.1): an upper bound, by a place that certainly has it. */
#include "model/model_space.h"

#include "measure/measure.h"

enum {
    RING_TETS = 64, /* tets around a point that are searched for a value before all are */
    BLOCK_TETS = 32,
    CLIMB_STEPS = 32
};

/* Norms on both sides of a value are compared without their roots: relative to it. */
static const double RANGE_SLACK = 1e-12;

typedef struct seeker {
    const tli_carrier *carrier;
    const tl_channel *channel;
    const double *x;
    double value, best2, enough2;
} seeker;

static void take(seeker *s, double d2)
{
    if (d2 < s->best2) s->best2 = d2;
}

/* Whether corners of a tet are on both sides of the value; of norms without their roots, give or
 * take rounding. */
static bool encloses(const seeker *s, const tl_lidx *q)
{
    const tl_channel *ch = s->channel;
    const uint32_t n = ch->components;
    const double value = n == 1 ? s->value : s->value * s->value;
    bool below = false, above = false;
    for (int i = 0; i < 4; i++) {
        const double *at = ch->values + q[i] * (size_t)n;
        double own = n == 1 ? at[0] : 0;
        for (uint32_t k = 0; n > 1 && k < n; k++) own += at[k] * at[k];
        below |= own <= value;
        above |= own >= value;
    }
    return below && above;
}

/* The nearest point with the value on the edges of a tet. */
static void seek_edges(seeker *s, tl_lidx tet)
{
    const tl_mesh *mesh = s->carrier->mesh;
    const tl_lidx *q = mesh->tets + 4 * (size_t)tet;
    double f[4];
    if (!encloses(s, q)) return;
    for (int i = 0; i < 4; i++) f[i] = tli_channel_norm(s->channel, q[i]) - s->value;
    for (int i = 0; i < 4; i++)
        for (int j = i + 1; j < 4; j++) {
            if (f[i] * f[j] > 0 || !isfinite(f[i]) || !isfinite(f[j])) continue;
            double span = f[j] - f[i], at = span != 0 ? -f[i] / span : 0, d2 = 0;
            const double *a = mesh->xyz + 3 * (size_t)q[i], *b = mesh->xyz + 3 * (size_t)q[j];
            for (int k = 0; k < 3; k++) {
                double d = a[k] + at * (b[k] - a[k]) - s->x[k];
                d2 += d * d;
            }
            take(s, d2);
        }
}

/* A tet of the value, and its faces to tets on the other side of it. */
static void seek_faces(seeker *s, tl_lidx tet)
{
    const tl_mesh *mesh = s->carrier->mesh;
    const double own = tli_channel_norm(s->channel, tet) - s->value;
    double p[4][3], w[4];
    tli_tet_corners(mesh->xyz, mesh->tets + 4 * (size_t)tet, p);
    if (own == 0) {
        double d = tl_tet_nearest(TLI_CORNERS(p), s->x, w);
        take(s, d * d);
    }
    for (size_t f = 0; f < 4 && s->best2 > s->enough2; f++) {
        tl_lidx o = s->carrier->opposite[4 * (size_t)tet + f];
        const uint8_t *face = tli_tet_faces[f];
        if (o == TL_NONE) continue;
        double other = tli_channel_norm(s->channel, o / 4) - s->value;
        if ((own < 0 && other > 0) || (own > 0 && other < 0))
            take(s, tli_triangle_distance2(p[face[0]], p[face[1]], p[face[2]], s->x));
    }
}

static void seek_in_tet(seeker *s, tl_lidx tet)
{
    if (s->channel->on == TL_ON_TET)
        seek_faces(s, tet);
    else
        seek_edges(s, tet);
}

/* Along the gradient, if that ends inside of the tet. */
static bool seek_along(seeker *s, tl_lidx tet, double error)
{
    const tl_lidx *q = s->carrier->mesh->tets + 4 * (size_t)tet;
    double room[12], g[3] = {0, 0, 0}, y[3], w[4];
    const double *rows = tli_frame_of(s->carrier, tet, room) + 3;
    const double base = tli_channel_norm(s->channel, q[0]);
    for (int i = 0; i < 3; i++) {
        double df = tli_channel_norm(s->channel, q[i + 1]) - base;
        for (int k = 0; k < 3; k++) g[k] += df * rows[3 * i + k];
    }
    double g2 = vec_dot(g, g);
    if (!(g2 > 0)) return false;
    for (int k = 0; k < 3; k++) y[k] = s->x[k] + g[k] * (error / g2);
    if (!tli_frame_weigh(s->carrier, tet, y, w)) return false;
    for (int i = 0; i < 4; i++)
        if (w[i] < 0) return false;
    s->best2 = error * error / g2;
    return true;
}

/* From tet to tet, always to the one whose value is nearest, up to a face with the value on both
 * its sides: mostly near enough, and less work than rings. */
static void climb(seeker *s, tl_lidx tet)
{
    for (int step = 0; step < CLIMB_STEPS; step++) {
        const double own = fabs(tli_channel_norm(s->channel, tet) - s->value);
        double least = own;
        tl_lidx next = TL_NONE;
        seek_faces(s, tet);
        if (isfinite(s->best2)) return;
        for (size_t f = 0; f < 4; f++) {
            tl_lidx o = s->carrier->opposite[4 * (size_t)tet + f];
            if (o == TL_NONE) continue;
            double off = fabs(tli_channel_norm(s->channel, o / 4) - s->value);
            if (!(off < least)) continue;
            least = off;
            next = o / 4;
        }
        if (next == TL_NONE) return;
        tet = next;
    }
}

/* Rings of tets around one until a place with the value is found and the ring is done. */
static void seek_around(seeker *s, tl_lidx tet)
{
    tl_lidx list[RING_TETS];
    uint64_t listed[RING_TETS / 16] = {0}; /* a bit for a tet's last digits: not set, not listed */
    const tl_lidx *opposite = s->carrier->opposite;
    size_t count = 0, ring_end = 1;
    list[count++] = tet;
    listed[tet / 64 % (RING_TETS / 16)] |= UINT64_C(1) << tet % 64;
    for (size_t at = 0; at < count; at++) {
        if (at == ring_end) {
            if (isfinite(s->best2)) return;
            ring_end = count;
        }
        seek_in_tet(s, list[at]);
        if (s->best2 <= s->enough2) return;
        for (size_t f = 0; f < 4 && count < RING_TETS; f++) {
            tl_lidx o = opposite[4 * (size_t)list[at] + f];
            size_t i = 0;
            if (o == TL_NONE) continue;
            uint64_t *word = &listed[o / 256 % (RING_TETS / 16)], bit = UINT64_C(1) << o / 4 % 64;
            while (*word & bit && i < count && list[i] != o / 4) i++;
            if (*word & bit && i < count) continue;
            *word |= bit;
            list[count++] = o / 4;
        }
    }
}

/* ---- all tets ---- */

static void grow(double range[2], double value)
{
    if (value < range[0]) range[0] = value;
    if (value > range[1]) range[1] = value;
}

static void add_tet(const tli_carrier *c, const tl_channel *ch, tl_lidx tet, tli_space_block *b)
{
    const tl_lidx *q = c->mesh->tets + 4 * (size_t)tet;
    if (ch->on == TL_ON_TET) grow(b->range, tli_channel_norm(ch, tet));
    for (int i = 0; i < 4; i++) {
        tl_lidx o = c->opposite[4 * (size_t)tet + (size_t)i];
        if (ch->on == TL_ON_VERTEX)
            grow(b->range, tli_channel_norm(ch, q[i]));
        else if (o != TL_NONE)
            grow(b->range, tli_channel_norm(ch, o / 4));
        for (int k = 0; k < 3; k++) grow(b->box[k], c->mesh->xyz[3 * (size_t)q[i] + (size_t)k]);
    }
}

static void fill_block(const tli_carrier *c, const tl_channel *ch, size_t number,
                       tli_space_block *block)
{
    const size_t first = number * BLOCK_TETS, left = c->mesh->tet_count - first;
    for (int k = 0; k < 4; k++) {
        double *range = k < 3 ? block->box[k] : block->range;
        range[0] = (double)INFINITY;
        range[1] = (double)-INFINITY;
    }
    for (size_t t = 0; t < BLOCK_TETS && t < left; t++) add_tet(c, ch, (tl_lidx)(first + t), block);
}

tl_status tli_space_open(tli_carrier *c)
{
    tl_status st = TL_OK;
    const size_t count = (c->mesh->tet_count + BLOCK_TETS - 1) / BLOCK_TETS;
    const size_t fields = c->plan->field_count;
    c->blocks = tl_mem_alloc(c->ctx, count * fields, sizeof *c->blocks, &st);
    for (size_t i = 0; !st && i < fields; i++)
        for (size_t b = 0; b < count; b++)
            fill_block(c, &c->mesh->channels[i], b, &c->blocks[i * count + b]);
    return st;
}

/* Whether a block can have the value nearer than what is known. */
static bool promises(const seeker *s, const tli_space_block *b)
{
    double d2 = 0, slack = RANGE_SLACK * fabs(s->value);
    if (s->value < b->range[0] - slack || s->value > b->range[1] + slack) return false;
    for (int k = 0; k < 3; k++) {
        double d = fmax(fmax(b->box[k][0] - s->x[k], s->x[k] - b->box[k][1]), 0);
        d2 += d * d;
    }
    return d2 < s->best2;
}

static void seek_everywhere(seeker *s, size_t channel)
{
    const size_t count = s->carrier->mesh->tet_count;
    const tli_space_block *blocks = s->carrier->blocks;
    if (blocks) blocks += channel * ((count + BLOCK_TETS - 1) / BLOCK_TETS);
    for (size_t t = 0; t < count && !(s->best2 <= s->enough2); t++) {
        if (blocks && t % BLOCK_TETS == 0 && !promises(s, &blocks[t / BLOCK_TETS]))
            t += BLOCK_TETS - 1;
        else
            seek_in_tet(s, (tl_lidx)t);
    }
}

double tli_space_distance(const tli_carrier *c, size_t channel, const double x[3], tl_lidx tet,
                          double value, double error, double offset, double enough)
{
    const tl_channel *ch = &c->mesh->channels[channel];
    seeker s = {c, ch, x, value, (double)INFINITY, enough * enough};
    if (error == 0) return offset;
    if (offset == 0 && ch->on == TL_ON_VERTEX && seek_along(&s, tet, error)) return sqrt(s.best2);
    if (ch->on == TL_ON_TET) climb(&s, tet);
    if (s.best2 <= s.enough2) return sqrt(s.best2);
    double climbed2 = s.best2;
    s.best2 = (double)INFINITY;
    seek_around(&s, tet);
    take(&s, climbed2);
    if (!isfinite(s.best2)) seek_everywhere(&s, channel);
    return sqrt(s.best2);
}
