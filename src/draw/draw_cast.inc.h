/* Rays through tets, LANES at a time; compiled once for each kind of processor, under the name
 * TLI_CAST_NAME. A lane follows a ray of its own; when that ends it takes the next one, so that all
 * lanes stay at work.
 *
 * The face that a ray passes is kept as its corners, seen from the ray (x and y are 0 on it),
 * counterclockwise, with the double areas of the triangles between the ray and each edge: they are
 * the barycentric weights of the place where it passes. The fourth corner of the tet behind splits
 * the face into three; signs of areas tell which of them the ray leaves by. They are differences of
 * the same two products for both tets at an edge, so that no ray is lost between tets. */
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

/* A ray comes in again no nearer than this, relative to the depth where it went out. */
static const float SAME_DEPTH = 1e-5F;
/* Values nearer than this, in steps of the transfer function, are one. */
static const float SAME_VALUE = 0.05F;
static const int PARTS_MAX = 256;
/* Steps without getting farther, as around a vertex, after which a ray goes in circles: between
 * inverted tets, or where a place is not finite. */
static const int STALLED_MAX = 4096;

/* Rays on their way. */
typedef struct lanes {
    reals x[3], y[3], z[3], s[3]; /* corners of the face that was passed last */
    reals areas[3];               /* [i] opposite to corner i */
    masks verts[3];
    reals px, py;
    reals depth, value;         /* where it was passed, and the value there in steps */
    float end[LANES];           /* depth of the next fragment, or which the ray goes to */
    float length[LANES];        /* of the ray by depth, mesh units */
    tl_lidx at[LANES];          /* face the ray comes in by: 4 * tet + face */
    int stalled[LANES];         /* steps since the ray last got farther */
    sums sums[LANES];           /* of the transfer function at value */
    four light[LANES];          /* gathered colour and opacity */
    const tli_ray *rays[LANES]; /* NULL: the lane rests */
    size_t doors[LANES];        /* next door of the ray */
    size_t fragments[LANES];    /* next fragment of the ray */
} lanes;

static inline reals pick(masks mask, reals yes, reals no)
{
    return (reals)((mask & (masks)yes) | (~mask & (masks)no));
}

static inline masks pick_verts(masks mask, masks yes, masks no)
{
    return (mask & yes) | (~mask & no);
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

/* ---- light ---- */

static inline sums sums_at(const tl_transfer *t, float value)
{
    float at = value + 1; /* one step before the first */
    unsigned step =
        at >= 0 ? at < TLI_TRANSFER_STEPS + 1 ? (unsigned)(int)at : TLI_TRANSFER_STEPS + 1 : 0;
    const float *entry = t->sums[step + step / TLI_SUM_STEPS];
    four a = load_four(entry), b = load_four(entry + 4);
    return (sums){load_four(t->bases[step / TLI_SUM_STEPS]),
                  a + spread(at - (float)step) * (b - a)};
}

static inline four difference(sums b, sums a)
{
    return (b.base - a.base) + (b.rest - a.rest);
}

/* 1 - exp(-x), to 1e-7 for thin layers as they are. */
static inline float absorbed(float x)
{
    return x * (1 - x * (1.F / 2 - x * (1.F / 6 - x * (1.F / 24 - x * (1.F / 120)))));
}

static inline void add_layer(four *light, four change, float depth)
{
    float weight = (1 - (*light)[3]) * absorbed(depth);
    four add = change * spread(weight / change[3]);
    add[3] = weight;
    *light += add;
}

/* A thick piece between two values, in parts that are thin. around: the change of the integrals
 * around equal values, which have none between them. */
static void add_parts(const tli_cast *cast, four *light, float a, float b, four around, float depth,
                      float length)
{
    float parts = ceilf(depth / cast->step_depth);
    int count = parts < (float)PARTS_MAX ? (int)parts : PARTS_MAX;
    sums before = sums_at(cast->transfer, a);
    for (int i = 1; i <= count && (*light)[3] < cast->opacity_end; i++) {
        float next = i == count ? b : a + (b - a) * ((float)i / (float)count);
        sums now = sums_at(cast->transfer, next);
        four change = difference(now, before);
        float part = fabsf(b - a) > SAME_VALUE
                         ? change[3] / ((b - a) / (float)count) * length / (float)count
                         : depth / (float)count;
        before = now;
        if (fabsf(b - a) <= SAME_VALUE) change = around;
        if (!(part > 0)) continue;
        /* more parts than there may be: what is left of the layer hides all behind it */
        add_layer(light, change[3] != 0 ? change : spread(1), part < 1 ? part : 1);
    }
}

/* The piece of a lane's ray up to a depth and a value; at: the integrals there. */
static inline void add_piece(const tli_cast *cast, lanes *l, int i, float value, sums at,
                             float length)
{
    four change = difference(at, l->sums[i]);
    float rise = value - l->value[i];
    if (fabsf(rise) <= SAME_VALUE) { /* the mean of the step around it */
        rise = 1;
        change = difference(sums_at(cast->transfer, value + 0.5F),
                            sums_at(cast->transfer, value - 0.5F));
    }
    float depth = change[3] / rise * length;
    if (!(depth > 0)) return;
    if (depth <= cast->step_depth)
        add_layer(&l->light[i], change, depth);
    else
        add_parts(cast, &l->light[i], l->value[i], value, change, depth, length);
}

/* Puts the next fragment of a lane's ray behind what it has seen. */
static void add_fragment(lanes *l, int i)
{
    const tli_ray *ray = l->rays[i];
    const tli_fragment *f = &ray->fragments[l->fragments[i]++];
    l->light[i] += spread(1 - l->light[i][3]) * load_four(f->rgba);
    l->end[i] =
        l->fragments[i] < ray->fragment_count ? ray->fragments[l->fragments[i]].z : ray->depth;
}

/* The same as see for a piece with fragments in it, or the end of the ray. */
static void see_stops(const tli_cast *cast, lanes *l, int i, float from, float to, float value,
                      float slope)
{
    float first = l->value[i], begin = from;
    bool ends = false;
    while (!ends && l->end[i] <= to && l->light[i][3] < cast->opacity_end) {
        float last = first + slope * (l->end[i] - from);
        sums at = sums_at(cast->transfer, last);
        if (l->end[i] > begin) add_piece(cast, l, i, last, at, (l->end[i] - begin) * l->length[i]);
        begin = l->end[i] > begin ? l->end[i] : begin;
        l->value[i] = last;
        l->sums[i] = at;
        ends = l->fragments[i] == l->rays[i]->fragment_count;
        if (!ends) add_fragment(l, i);
    }
    if (!ends && to > begin)
        add_piece(cast, l, i, value, sums_at(cast->transfer, value), (to - begin) * l->length[i]);
}

/* Between two passes; what is nearer than the camera or beyond the end is cut off. */
static inline void see(const tli_cast *cast, lanes *l, int i, float depth, float value)
{
    float from = l->depth[i];
    sums next = sums_at(cast->transfer, value);
    if (depth > from && depth > 0) {
        if (from < 0 || depth >= l->end[i]) {
            float slope = (value - l->value[i]) / (depth - from);
            if (from < 0) {
                l->value[i] -= slope * from;
                l->sums[i] = sums_at(cast->transfer, l->value[i]);
                from = 0;
            }
            see_stops(cast, l, i, from, depth, value, slope);
        } else
            add_piece(cast, l, i, value, next, (depth - from) * l->length[i]);
    }
    l->sums[i] = next;
}

/* ---- coming in, going out ---- */

static void finish(lanes *l, int i)
{
    const tli_ray *ray = l->rays[i];
    while (l->fragments[i] < ray->fragment_count && l->light[i][3] < 1) add_fragment(l, i);
    float left = 1 - l->light[i][3];
    for (int k = 0; k < 4; k++) ray->rgba[k] = l->light[i][k] + left * ray->rgba[k];
    l->rays[i] = NULL;
}

static void load_corner(const tli_cast *cast, lanes *l, int i, int corner, tl_lidx vert)
{
    const tli_vert *v = &cast->verts[vert];
    float w = cast->parallel ? 1 : v->z;
    l->x[corner][i] = v->x - l->px[i] * w;
    l->y[corner][i] = v->y - l->py[i] * w;
    l->z[corner][i] = v->z;
    l->s[corner][i] = v->s;
    l->verts[corner][i] = (int32_t)vert;
}

/* Puts the lane at a door; false if the ray only touches it. */
static bool enter(const tli_cast *cast, lanes *l, int i, tl_lidx door)
{
    float sum = 0, depth = 0, value = 0;
    for (int k = 0; k < 3; k++)
        load_corner(cast, l, i, k, cast->cells[door / 4].verts[tli_tet_faces[door % 4][k]]);
    for (int k = 0; k < 3; k++) {
        int a = (k + 1) % 3, b = (k + 2) % 3;
        float area = l->x[a][i] * l->y[b][i] - l->x[b][i] * l->y[a][i];
        l->areas[k][i] = area;
        area = area > 0 ? area : 0;
        sum += area;
        depth += area * l->z[k][i];
        value += area * l->s[k][i];
    }
    if (!(sum > 0)) return false;
    l->depth[i] = depth / sum;
    l->value[i] = value / sum;
    l->sums[i] = sums_at(cast->transfer, l->value[i]);
    l->at[i] = door;
    l->stalled[i] = 0;
    return true;
}

/* The next door of the lane's ray that is not nearer than where it is; false: there is none. */
static bool go_on(const tli_cast *cast, lanes *l, int i)
{
    const tli_ray *ray = l->rays[i];
    float out = l->depth[i] - SAME_DEPTH * fabsf(l->depth[i]);
    while (l->doors[i] < ray->door_count) {
        const tli_door_hit *hit = &ray->doors[l->doors[i]++];
        if ((float)hit->z >= ray->depth) return false;
        if ((float)hit->z >= out && enter(cast, l, i, hit->door)) {
            while (l->fragments[i] < ray->fragment_count && l->end[i] <= l->depth[i])
                add_fragment(l, i);
            return true;
        }
    }
    return false;
}

/* Gives the lane the next ray that meets the mesh; it rests if there is none. */
static void take_ray(const tli_cast *cast, lanes *l, int i, const tli_ray **next,
                     const tli_ray *end)
{
    l->rays[i] = NULL;
    while (*next < end) {
        const tli_ray *ray = (*next)++;
        float x = ray->px / (float)cast->scale, y = ray->py / (float)cast->scale;
        l->rays[i] = ray;
        l->doors[i] = 0;
        l->px[i] = ray->px;
        l->py[i] = ray->py;
        l->fragments[i] = 0;
        l->end[i] = ray->fragment_count ? ray->fragments[0].z : ray->depth;
        l->length[i] = (float)cast->unit * (cast->parallel ? 1 : sqrtf(1 + x * x + y * y));
        l->light[i] = spread(0);
        l->depth[i] = -INFINITY;
        if (go_on(cast, l, i)) return;
        finish(l, i);
    }
    l->at[i] = 0;
}

/* ---- a step of all lanes ---- */

typedef struct fourth {
    reals x, y, z, s;
    masks vert;
} fourth;

#define ALL_LANES(of)                                                                              \
    {                                                                                              \
        of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)                                     \
    }

static inline void load_fourth(const tli_cast *cast, const lanes *l, fourth *d)
{
    const tli_vert *v[LANES];
    tl_lidx verts[LANES];
    for (int i = 0; i < LANES; i++) {
        verts[i] = cast->cells[l->at[i] / 4].verts[l->at[i] % 4];
        v[i] = &cast->verts[verts[i]];
    }
#define X_OF(i) v[i]->x
#define Y_OF(i) v[i]->y
#define Z_OF(i) v[i]->z
#define S_OF(i) v[i]->s
#define VERT_OF(i) (int32_t) verts[i]
    *d = (fourth){ALL_LANES(X_OF), ALL_LANES(Y_OF), ALL_LANES(Z_OF), ALL_LANES(S_OF),
                  ALL_LANES(VERT_OF)};
    reals w = cast->parallel ? (reals){1, 1, 1, 1, 1, 1, 1, 1} : d->z;
    d->x -= l->px * w;
    d->y -= l->py * w;
}

/* Moves each lane to the face of its tet by which the ray leaves; lost receives the corner that is
 * not on it. */
static inline void leave(lanes *l, const fourth *d, masks *lost)
{
    reals area[3], zero = {0};
    for (int k = 0; k < 3; k++) area[k] = d->x * l->y[k] - l->x[k] * d->y;
    masks out[3]; /* which corner is replaced */
    out[2] = (area[0] >= zero) & (area[1] < zero);
    out[0] = ~out[2] & (area[1] >= zero) & (area[2] < zero);
    out[1] = ~(out[2] | out[0]);
    *lost = pick_verts(out[2], l->verts[2], pick_verts(out[0], l->verts[0], l->verts[1]));
    l->areas[0] = pick(out[0], l->areas[0], pick(out[2], -area[1], area[2]));
    l->areas[1] = pick(out[1], l->areas[1], pick(out[2], area[0], -area[2]));
    l->areas[2] = pick(out[2], l->areas[2], pick(out[0], area[1], -area[0]));
    for (int k = 0; k < 3; k++) {
        l->x[k] = pick(out[k], d->x, l->x[k]);
        l->y[k] = pick(out[k], d->y, l->y[k]);
        l->z[k] = pick(out[k], d->z, l->z[k]);
        l->s[k] = pick(out[k], d->s, l->s[k]);
        l->verts[k] = pick_verts(out[k], d->vert, l->verts[k]);
    }
}

/* Depth and value where the lanes leave; a ray along an edge stays where it was. */
static inline void pass(const lanes *l, reals *depth, reals *value)
{
    reals zero = {0}, sum = {0}, z = {0}, s = {0};
    for (int k = 0; k < 3; k++) {
        reals w = pick(l->areas[k] > zero, l->areas[k], zero);
        sum += w;
        z += w * l->z[k];
        s += w * l->s[k];
    }
    masks usable = sum > zero;
    *depth = pick(usable, z / sum, l->depth);
    *value = pick(usable, s / sum, l->value);
}

static inline tl_lidx behind(const tli_cell *cell, tl_lidx lost)
{
    unsigned face = (unsigned)(cell->verts[1] == lost) + 2 * (unsigned)(cell->verts[2] == lost) +
                    3 * (unsigned)(cell->verts[3] == lost);
    return cell->behind[face & 3];
}

void TLI_CAST_NAME(const tli_cast *cast, const tli_ray *rays, size_t ray_count)
{
    lanes l;
    const tli_ray *next = rays, *end = rays + ray_count;
    memset(&l, 0, sizeof l);
    for (int i = 0; i < LANES; i++) take_ray(cast, &l, i, &next, end);
    for (;;) {
        fourth d;
        masks lost;
        reals depth, value;
        bool busy = false;
        load_fourth(cast, &l, &d);
        leave(&l, &d, &lost);
        pass(&l, &depth, &value);
        for (int i = 0; i < LANES; i++) {
            if (!l.rays[i]) continue;
            see(cast, &l, i, depth[i], value[i]);
            l.stalled[i] = depth[i] > l.depth[i] ? 0 : l.stalled[i] + 1;
            l.depth[i] = depth[i] > l.depth[i] ? depth[i] : l.depth[i];
            l.value[i] = value[i];
            l.at[i] = behind(&cast->cells[l.at[i] / 4], (tl_lidx)lost[i]);
            bool done = l.depth[i] >= l.end[i] || l.light[i][3] >= cast->opacity_end ||
                        l.stalled[i] > STALLED_MAX;
            if (done || (l.at[i] == TL_NONE && !go_on(cast, &l, i))) {
                finish(&l, i);
                take_ray(cast, &l, i, &next, end);
            }
            busy = busy || l.rays[i];
        }
        if (!busy) return;
    }
}
