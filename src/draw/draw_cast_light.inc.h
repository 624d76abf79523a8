/* What rays see between two passes: lanes as vectors, integrals of the transfer function, layers of
 * fog, fragments. Part of draw_cast.inc.h. */
#include <math.h>
#include <string.h>

#include "draw/draw_cast.h"
#include "mesh/mesh.h"

enum { LANES = 8 };
typedef float reals __attribute__((vector_size(LANES * sizeof(float))));
typedef int32_t masks __attribute__((vector_size(LANES * sizeof(int32_t))));
typedef float four __attribute__((vector_size(4 * sizeof(float))));

/* Integrals of the transfer function up to a value, in two parts, so that what near values have in
 * common falls out of their difference exactly. */
typedef struct sums {
    four base, rest;
} sums;

/* Values nearer than this, in steps of the transfer function, are one. */
static const float SAME_VALUE = 0.05F;
static const int PARTS_MAX = 256;

/* Rays on their way. */
typedef struct lanes {
    reals x[3], y[3], z[3], s[3]; /* corners of the face that was passed last */
    reals areas[3];               /* [i] opposite to corner i */
    masks verts[3];
    reals px, py;
    reals depth, value;         /* where it was passed, and the value there in steps */
    reals end;                  /* depth of the next fragment, or which the ray goes to */
    reals length;               /* of the ray by depth, mesh units */
    reals light[4];             /* gathered colour and opacity */
    masks stalled;              /* steps since the ray last got farther */
    masks busy;                 /* all bits; 0: the lane rests */
    sums sums[LANES];           /* of the transfer function at value */
    tl_lidx at[LANES];          /* face the ray comes in by: 4 * tet + face */
    const tli_ray *rays[LANES]; /* of busy lanes */
    size_t doors[LANES];        /* next door of the ray */
    size_t fragments[LANES];    /* next fragment of the ray */
    /* with light */
    reals slopes[3][3]; /* gradients of the corners */
    reals slope[3];     /* gradient where the face was passed */
    reals view[3];      /* direction of the ray */
} lanes;

/* What light does to a piece: factors of extinction and of colour, white that is added. */
typedef struct shades {
    reals dim, color, white;
} shades;

/* ---- vectors ---- */

static inline reals pick(masks mask, reals yes, reals no)
{
    return (reals)((mask & (masks)yes) | (~mask & (masks)no));
}

static inline masks pick_verts(masks mask, masks yes, masks no)
{
    return (mask & yes) | (~mask & no);
}

static inline bool any(masks mask)
{
    uint64_t parts[LANES / 2], all = 0;
    memcpy(parts, &mask, sizeof parts);
    for (int i = 0; i < LANES / 2; i++) all |= parts[i];
    return all != 0;
}

static inline reals spread_lanes(float value)
{
    return (reals){value, value, value, value, value, value, value, value};
}

static inline four spread(float value)
{
    return (four){value, value, value, value};
}

static inline four load_four(const float *from)
{
    four out;
    memcpy(&out, from, sizeof out);
    return out;
}

/* Four numbers of each lane as four vectors of all lanes. */
static inline void transpose(const four rows[LANES], reals columns[4])
{
    reals pairs[4], low[2], high[2];
    for (int i = 0; i < 4; i++)
        pairs[i] = __builtin_shufflevector(rows[i], rows[i + 4], 0, 1, 2, 3, 4, 5, 6, 7);
    for (int i = 0; i < 2; i++) {
        reals a = pairs[2 * i], b = pairs[2 * i + 1];
        low[i] = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
        high[i] = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
    }
    columns[0] = __builtin_shufflevector(low[0], low[1], 0, 1, 8, 9, 4, 5, 12, 13);
    columns[1] = __builtin_shufflevector(low[0], low[1], 2, 3, 10, 11, 6, 7, 14, 15);
    columns[2] = __builtin_shufflevector(high[0], high[1], 0, 1, 8, 9, 4, 5, 12, 13);
    columns[3] = __builtin_shufflevector(high[0], high[1], 2, 3, 10, 11, 6, 7, 14, 15);
}

/* ---- the transfer function ---- */

/* step: the one that value + 1 is in, or the first or last. */
static inline sums sums_in(const tl_transfer *t, uint32_t step, float weight)
{
    const float *entry = t->sums[step + step / TLI_SUM_STEPS];
    four a = load_four(entry), b = load_four(entry + 4);
    return (sums){load_four(t->bases[step / TLI_SUM_STEPS]), a + spread(weight) * (b - a)};
}

static inline sums sums_at(const tl_transfer *t, float value)
{
    float at = value + 1; /* one step before the first */
    unsigned step =
        at >= 0 ? at < TLI_TRANSFER_STEPS + 1 ? (unsigned)(int)at : TLI_TRANSFER_STEPS + 1 : 0;
    return sums_in(t, step, at - (float)step);
}

static inline four difference(sums b, sums a)
{
    return (b.base - a.base) + (b.rest - a.rest);
}

/* Moves the integrals of all lanes to values; change receives the differences. */
static inline void move_sums(const tl_transfer *t, reals value, sums now[LANES], four change[LANES])
{
    reals at = value + 1, zero = {0}, last = spread_lanes(TLI_TRANSFER_STEPS + 1);
    reals inside = pick(at >= zero, pick(at < last, at, last), zero);
    masks step = __builtin_convertvector(inside, masks);
    reals weight = at - __builtin_convertvector(step, reals);
    for (int i = 0; i < LANES; i++) {
        sums next = sums_in(t, (uint32_t)step[i], weight[i]);
        change[i] = difference(next, now[i]);
        now[i] = next;
    }
}

/* The mean of a step around a value. */
static inline four slope_at(const tl_transfer *t, float value)
{
    return difference(sums_at(t, value + 0.5F), sums_at(t, value - 0.5F));
}

/* ---- layers ---- */

/* 1 - exp(-x), to 1e-7 for thin layers as they are. */
#define ABSORBED(x)                                                                                \
    ((x) * (1 - (x) * (1.F / 2 - (x) * (1.F / 6 - (x) * (1.F / 24 - (x) * (1.F / 120))))))

/* A layer behind what a lane has seen; change: colour times extinction, extinction; light may be
 * NULL. */
static inline void add_layer(lanes *l, int i, const shades *light, four change, float depth)
{
    float weight = (1 - l->light[3][i]) * ABSORBED(depth);
    for (int k = 0; k < 3; k++)
        if (light) {
            float lit = change[k] / change[3] * light->color[i] + light->white[i];
            l->light[k][i] += (lit < 1 ? lit : 1) * weight;
        } else
            l->light[k][i] += change[k] * (weight / change[3]);
    l->light[3][i] += weight;
}

/* A thick piece between two values, in parts that are thin. around: the change of the integrals
 * around equal values, which have none between them. */
static void add_parts(const tli_cast *cast, lanes *l, int i, const shades *light, float a, float b,
                      four around, float depth, float length)
{
    float parts = ceilf(depth / cast->step_depth);
    int count = parts < (float)PARTS_MAX ? (int)parts : PARTS_MAX;
    sums before = sums_at(cast->transfer, a);
    for (int p = 1; p <= count && l->light[3][i] < cast->opacity_end; p++) {
        float next = p == count ? b : a + (b - a) * ((float)p / (float)count);
        sums now = sums_at(cast->transfer, next);
        four change = difference(now, before);
        float part = fabsf(b - a) > SAME_VALUE
                         ? change[3] / ((b - a) / (float)count) * length / (float)count
                         : depth / (float)count;
        before = now;
        if (fabsf(b - a) <= SAME_VALUE) change = around;
        if (!(part > 0)) continue;
        /* more parts than there may be: what is left of the layer hides all behind it */
        add_layer(l, i, light, change[3] != 0 ? change : spread(1), part < 1 ? part : 1);
    }
}

/* The piece of a lane's ray between two values. */
static void add_piece(const tli_cast *cast, lanes *l, int i, const shades *light, float a, float b,
                      float length)
{
    if (light) length *= light->dim[i];
    four change = difference(sums_at(cast->transfer, b), sums_at(cast->transfer, a));
    float rise = b - a;
    if (fabsf(rise) <= SAME_VALUE) {
        rise = 1;
        change = slope_at(cast->transfer, b);
    }
    float depth = change[3] / rise * length;
    if (!(depth > 0)) return;
    if (depth <= cast->step_depth)
        add_layer(l, i, light, change, depth);
    else
        add_parts(cast, l, i, light, a, b, change, depth, length);
}

/* Puts the next fragment of a lane's ray behind what it has seen. */
static void add_fragment(lanes *l, int i)
{
    const tli_ray *ray = l->rays[i];
    const float *rgba = ray->fragments[l->fragments[i]++].rgba;
    float left = 1 - l->light[3][i];
    for (int k = 0; k < 4; k++) l->light[k][i] += left * rgba[k];
    l->end[i] =
        l->fragments[i] < ray->fragment_count ? ray->fragments[l->fragments[i]].z : ray->depth;
}

/* A piece of a lane that is thick, begins behind the camera, or has fragments or the end of the ray
 * in it. */
static void see_slowly(const tli_cast *cast, lanes *l, int i, const shades *light, float depth,
                       float value)
{
    float from = l->depth[i], at = l->value[i], slope = (value - at) / (depth - from);
    if (from < 0) {
        at -= slope * from;
        from = 0;
    }
    while (l->end[i] <= depth && l->light[3][i] < cast->opacity_end) {
        float stop = l->end[i], last = at + slope * (stop - from);
        if (stop > from) {
            add_piece(cast, l, i, light, at, last, (stop - from) * l->length[i]);
            from = stop;
            at = last;
        }
        if (l->fragments[i] == l->rays[i]->fragment_count) return;
        add_fragment(l, i);
    }
    if (depth > from) add_piece(cast, l, i, light, at, value, (depth - from) * l->length[i]);
}

/* Light on the pieces of lanes up to a gradient: that of the mean of the gradients of both ends. */
static void shade(const tli_cast *cast, const lanes *l, const reals slope[3], masks seen,
                  shades *out)
{
    reals n[3], squares = {0}, along = {0};
    for (int k = 0; k < 3; k++) {
        n[k] = (l->slope[k] + slope[k]) * 0.5F;
        squares += n[k] * n[k];
        along += n[k] * l->view[k];
    }
    *out = (shades){{0}, {0}, {0}};
    for (int i = 0; i < LANES; i++) {
        if (!seen[i]) continue;
        float length = sqrtf(squares[i]);
        float cosine = length > 0 ? fabsf(along[i]) / length : 1;
        cosine = cosine < 1 ? cosine : 1;
        out->dim[i] = cast->dims && length < 1 ? length : 1;
        out->color[i] = cast->ambient + cast->diffuse * cosine;
        if (cast->specular > 0) out->white[i] = cast->specular * powf(cosine, cast->shininess);
    }
}

/* What the lanes see up to a depth and a value; slope: with light, the gradient there. */
static inline void see(const tli_cast *cast, lanes *l, reals depth, reals value,
                       const reals slope[3], bool lit)
{
    shades light;
    four change[LANES];
    reals c[4], zero = {0}, rise = value - l->value;
    masks seen = l->busy & (depth > l->depth) & (depth > zero);
    /* the integrals of low values that are not seen are all zero: they need not be moved */
    masks clear = (value <= cast->clear[0]) & (l->value <= cast->clear[0]) & (depth < l->end);
    if (!any(l->busy & ~clear)) return;
    move_sums(cast->transfer, value, l->sums, change);
    masks flat = seen & (rise <= SAME_VALUE) & (rise >= -SAME_VALUE);
    if (any(flat)) {
        for (int i = 0; i < LANES; i++)
            if (flat[i]) change[i] = slope_at(cast->transfer, value[i]);
        rise = pick(flat, spread_lanes(1), rise);
    }
    transpose(change, c);
    reals layer = c[3] / rise * ((depth - l->depth) * l->length);
    if (lit) {
        shade(cast, l, slope, seen & (layer > zero), &light);
        layer *= light.dim;
    }
    masks slow = seen & ((l->depth < zero) | (depth >= l->end) | (layer > cast->step_depth));
    if (any(slow))
        for (int i = 0; i < LANES; i++)
            if (slow[i]) see_slowly(cast, l, i, lit ? &light : NULL, depth[i], value[i]);
    masks thin = seen & ~slow & (layer > zero);
    reals weight = (1 - l->light[3]) * ABSORBED(layer), by = weight / c[3];
    for (int k = 0; k < 3; k++) {
        reals add = c[k] * by;
        if (lit) {
            reals tone = c[k] / c[3] * light.color + light.white;
            add = pick(tone < 1, tone, spread_lanes(1)) * weight;
        }
        l->light[k] += pick(thin, add, zero);
    }
    l->light[3] += pick(thin, weight, zero);
}
