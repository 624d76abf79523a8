/* Rays through tets, LANES at a time; compiled once for each kind of processor, under the name
 * TLI_CAST_NAME. A lane follows a ray of its own; when that ends it takes the next one, so that all
 * lanes stay at work.
 *
 * The face that a ray passes is kept as its corners, seen from the ray (x and y are 0 on it),
 * counterclockwise, with the double areas of the triangles between the ray and each edge: they are
 * the barycentric weights of the place where it passes. The fourth corner of the tet behind splits
 * the face into three; signs of areas tell which of them the ray leaves by. They are differences of
 * the same two products for both tets at an edge, so that no ray is lost between tets. */
#include "draw/draw_cast_light.inc.h"

/* A ray comes in again no nearer than this, relative to the depth where it went out. */
static const float SAME_DEPTH = 1e-5F;
/* Steps without getting farther, as around a vertex, after which a ray goes in circles: between
 * inverted tets, or where a place is not finite. */
static const int STALLED_MAX = 4096;

/* ---- coming in, going out ---- */

static void finish(lanes *l, int i)
{
    const tli_ray *ray = l->rays[i];
    while (l->fragments[i] < ray->fragment_count && l->light[3][i] < 1) add_fragment(l, i);
    float left = 1 - l->light[3][i];
    for (int k = 0; k < 4; k++) ray->rgba[k] = l->light[k][i] + left * ray->rgba[k];
    l->busy[i] = 0;
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
    for (int k = 0; k < 3 && cast->gradients; k++)
        l->slopes[corner][k][i] = cast->gradients[vert][k];
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
    for (int k = 0; k < 3 && cast->gradients; k++) {
        l->slope[k][i] = 0;
        for (int c = 0; c < 3; c++)
            l->slope[k][i] += fmaxf(l->areas[c][i], 0) / sum * l->slopes[c][k][i];
    }
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

/* Component k of the direction of a ray. */
static float direction(const tli_cast *cast, float x, float y, int k)
{
    if (cast->parallel) return cast->axes[2][k];
    return (x * cast->axes[0][k] + y * cast->axes[1][k] + cast->axes[2][k]) /
           sqrtf(1 + x * x + y * y);
}

/* Gives the lane the next ray that meets the mesh; it rests if there is none. */
static void take_ray(const tli_cast *cast, lanes *l, int i, const tli_ray **next,
                     const tli_ray *end)
{
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
        for (int k = 0; k < 4; k++) l->light[k][i] = 0;
        for (int k = 0; k < 3 && cast->gradients; k++) l->view[k][i] = direction(cast, x, y, k);
        l->depth[i] = -INFINITY;
        l->busy[i] = -1;
        if (go_on(cast, l, i)) return;
        finish(l, i);
    }
    l->at[i] = 0;
}

/* ---- a step of all lanes ---- */

/* The tets that the lanes are in, and their corners that are not on the face passed last. */
typedef struct fourth {
    masks tets[4];
    reals x, y, z, s;
    masks vert;
    reals slope[4]; /* with light: gradient, and a number that is not used */
} fourth;

static inline void load_fourth(const tli_cast *cast, const lanes *l, fourth *d, bool lit)
{
    four rows[LANES];
    reals columns[4];
    for (int i = 0; i < LANES; i++) memcpy(&rows[i], cast->cells[l->at[i] / 4].verts, sizeof *rows);
    transpose(rows, columns);
    for (int k = 0; k < 4; k++) d->tets[k] = (masks)columns[k];
    d->vert = d->tets[0] ^ d->tets[1] ^ d->tets[2] ^ d->tets[3];
    d->vert = (d->vert ^ l->verts[0] ^ l->verts[1] ^ l->verts[2]) & l->busy;
    for (int i = 0; i < LANES; i++) rows[i] = load_four(&cast->verts[(tl_lidx)d->vert[i]].x);
    transpose(rows, columns);
    reals w = cast->parallel ? spread_lanes(1) : columns[2];
    d->x = columns[0] - l->px * w;
    d->y = columns[1] - l->py * w;
    d->z = columns[2];
    d->s = columns[3];
    if (!lit) return;
    for (int i = 0; i < LANES; i++) rows[i] = load_four(cast->gradients[(tl_lidx)d->vert[i]]);
    transpose(rows, d->slope);
}

/* Moves each lane to the face of its tet by which the ray leaves; lost receives the corner that is
 * not on it. */
static inline void leave(lanes *l, const fourth *d, masks *lost, bool lit)
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
        for (int c = 0; c < 3 && lit; c++)
            l->slopes[k][c] = pick(out[k], d->slope[c], l->slopes[k][c]);
    }
}

/* Depth, value and gradient where the lanes leave; a ray along an edge stays where it was. */
static inline void pass(const lanes *l, reals *depth, reals *value, reals slope[3], bool lit)
{
    reals zero = {0}, sum = {0}, z = {0}, s = {0}, g[3] = {{0}, {0}, {0}};
    for (int k = 0; k < 3; k++) {
        reals w = pick(l->areas[k] > zero, l->areas[k], zero);
        sum += w;
        z += w * l->z[k];
        s += w * l->s[k];
        for (int c = 0; c < 3 && lit; c++) g[c] += w * l->slopes[k][c];
    }
    masks usable = sum > zero;
    *depth = pick(usable, z / sum, l->depth);
    *value = pick(usable, s / sum, l->value);
    for (int c = 0; c < 3 && lit; c++) slope[c] = pick(usable, g[c] / sum, l->slope[c]);
}

/* Moves the lanes through the faces opposite to the lost corners; resting ones stay in the first
 * tet. */
static inline void move(const tli_cast *cast, lanes *l, const fourth *d, masks lost)
{
    masks face =
        ((lost == d->tets[1]) & 1) | ((lost == d->tets[2]) & 2) | ((lost == d->tets[3]) & 3);
    for (int i = 0; i < LANES; i++) {
        l->at[i] = cast->cells[l->at[i] / 4].behind[face[i]] & (tl_lidx)l->busy[i];
        __builtin_prefetch(&cast->cells[l->at[i] != TL_NONE ? l->at[i] / 4 : 0]);
    }
}

/* Lanes that have left the mesh. */
static inline masks outside(const lanes *l)
{
    masks at;
    memcpy(&at, l->at, sizeof at);
    return at == (int32_t)TL_NONE;
}

/* Lanes in tets of which nothing is seen. */
static inline masks unseen(const tli_cast *cast, const lanes *l, const fourth *d)
{
    masks low = d->s <= cast->clear[0], high = d->s >= cast->clear[1];
    for (int k = 0; k < 3; k++) {
        low &= l->s[k] <= cast->clear[0];
        high &= l->s[k] >= cast->clear[1];
    }
    return l->busy & (low | high);
}

/* Lanes that are done, or left what is seen of the mesh, get on with their rays or take others. */
static void turn(const tli_cast *cast, lanes *l, masks out, masks done, const tli_ray **next,
                 const tli_ray *end)
{
    for (int i = 0; i < LANES; i++)
        if (done[i] || (out[i] && !go_on(cast, l, i))) {
            finish(l, i);
            take_ray(cast, l, i, next, end);
        }
}

/* lit is known when this is compiled. */
static inline __attribute__((always_inline)) void follow(const tli_cast *cast, const tli_ray *rays,
                                                         size_t ray_count, bool lit)
{
    lanes l;
    const tli_ray *next = rays, *end = rays + ray_count;
    memset(&l, 0, sizeof l);
    for (int i = 0; i < LANES; i++) take_ray(cast, &l, i, &next, end);
    while (any(l.busy)) {
        fourth d;
        masks lost;
        reals depth, value, slope[3] = {{0}, {0}, {0}};
        load_fourth(cast, &l, &d, lit);
        masks gap = unseen(cast, &l, &d);
        if (any(gap)) {
            turn(cast, &l, gap, (masks){0}, &next, end);
            continue;
        }
        leave(&l, &d, &lost, lit);
        pass(&l, &depth, &value, slope, lit);
        move(cast, &l, &d, lost);
        see(cast, &l, depth, value, slope, lit);
        masks farther = depth > l.depth;
        l.stalled = ~farther & (l.stalled + 1);
        l.depth = pick(farther, depth, l.depth);
        l.value = value;
        for (int k = 0; k < 3 && lit; k++) l.slope[k] = slope[k];
        masks out = outside(&l);
        masks done =
            l.busy & ((l.depth >= l.end) | (l.light[3] >= spread_lanes(cast->opacity_end)) |
                      (l.stalled > STALLED_MAX));
        if (any(out | done)) turn(cast, &l, out, done, &next, end);
    }
}

void TLI_CAST_NAME(const tli_cast *cast, const tli_ray *rays, size_t ray_count)
{
    if (cast->gradients)
        follow(cast, rays, ray_count, true);
    else
        follow(cast, rays, ray_count, false);
}
