/* What lies behind what across the gaps of a mesh: along a ray through each pixel the tet that it
 * comes in by, after it left the mesh, lies behind the one that it left by (Cook, Max, Silva and
 * Williams 2004, SXMPVO, with the exact hits of boundary faces in the place of a drawn A-buffer).
 * So the order is right at the middle of each pixel, which is where it is seen. */
#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "draw/draw_order.h"
#include "mesh/mesh.h"

/* Most rays; a larger picture has one for several pixels. */
static const double RAYS_MAX = 1 << 22;
/* What is nearer to the camera than this, relative to the far end of its face, is cut off. */
static const double NEAR = 1e-4;
/* A ray comes in again no nearer than this, relative to the depth where it went out. */
static const float SAME_DEPTH = 1e-4F;
enum { HITS_FIRST = 4096 };

/* Hits of rays by ray and depth, to be sorted. */
typedef struct hits {
    uint64_t *keys;  /* ray in the upper half, depth below */
    uint32_t *marks; /* 2 * tet + 1 where the ray goes out */
    size_t count, max;
} hits;

typedef struct scan {
    tl_ctx *ctx;
    const tli_order_view *view;
    uint32_t step; /* pixels between rays */
    uint32_t columns, rows;
    hits hits;
} scan;

/* Order of floats as that of numbers, and back. */
static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits >> 31 ? ~bits : bits | UINT32_C(1) << 31;
}

static float value_of(uint32_t bits)
{
    float value;
    bits = bits >> 31 ? bits ^ UINT32_C(1) << 31 : ~bits;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static tl_status add_hit(scan *s, uint64_t ray, float depth, uint32_t mark)
{
    tl_status st = TL_OK;
    hits *h = &s->hits;
    if (h->count == h->max) {
        size_t max = 2 * h->max + HITS_FIRST;
        h->keys = tl_mem_resize(s->ctx, h->keys, max, sizeof *h->keys, &st);
        h->marks = tl_mem_resize(s->ctx, h->marks, max, sizeof *h->marks, &st);
        if (st) return st;
        h->max = max;
    }
    h->keys[h->count] = ray << 32 | bits_of(depth);
    h->marks[h->count++] = mark;
    return TL_OK;
}

static void widen(double low[2], double high[2], double x, double y)
{
    low[0] = fmin(low[0], x);
    high[0] = fmax(high[0], x);
    low[1] = fmin(low[1], y);
    high[1] = fmax(high[1], y);
}

/* The box of a face on the picture, of what is not behind the camera or too near to it; false if
 * there is nothing, or a place is not finite. */
static bool box_of(const scan *s, const tli_vert *const v[3], double low[2], double high[2])
{
    const tli_frame *f = s->view->frame;
    double far = fmax(fmax((double)v[0]->z, (double)v[1]->z), (double)v[2]->z), near = NEAR * far;
    low[0] = low[1] = (double)INFINITY;
    high[0] = high[1] = -(double)INFINITY;
    if (!isfinite(v[0]->x + v[0]->y + v[0]->z + v[1]->x + v[1]->y + v[1]->z + v[2]->x + v[2]->y +
                  v[2]->z))
        return false;
    if (!f->parallel && !(far > 0)) return false;
    for (int i = 0; i < 3; i++) {
        const tli_vert *a = v[i], *b = v[(i + 1) % 3];
        double za = (double)a->z, zb = (double)b->z;
        if (f->parallel || za >= near)
            widen(low, high, (double)a->x / (f->parallel ? 1 : za),
                  (double)a->y / (f->parallel ? 1 : za));
        if (f->parallel || (za < near) == (zb < near)) continue;
        double w = (near - za) / (zb - za);
        widen(low, high, ((double)a->x + w * ((double)b->x - (double)a->x)) / near,
              ((double)a->y + w * ((double)b->y - (double)a->y)) / near);
    }
    return low[0] <= high[0];
}

/* Rays first to last of count that may lie between two places, in pixels from the first side. */
static bool rays_between(const scan *s, double low, double high, uint32_t count, uint32_t *first,
                         uint32_t *last)
{
    double from = ceil((low - 0.5) / s->step), to = floor((high - 0.5) / s->step);
    if (!(to >= 0) || !(from < count) || to < from) return false;
    *first = from > 0 ? (uint32_t)from : 0;
    *last = to < count - 1 ? (uint32_t)to : count - 1;
    return true;
}

static tl_status scan_face(scan *s, tl_lidx door)
{
    const tli_frame *f = s->view->frame;
    const tli_cell *cell = &s->view->volume->cells[door / 4];
    const tli_vert *v[3];
    double low[2], high[2];
    uint32_t left, right, top, bottom;
    tl_status st = TL_OK;
    for (int i = 0; i < 3; i++) v[i] = &s->view->verts[cell->verts[tli_tet_faces[door % 4][i]]];
    if (!box_of(s, v, low, high) ||
        !rays_between(s, f->middle[0] + low[0], f->middle[0] + high[0], s->columns, &left,
                      &right) ||
        !rays_between(s, f->middle[1] - high[1], f->middle[1] - low[1], s->rows, &top, &bottom))
        return TL_OK;
    for (uint32_t row = top; row <= bottom && !st; row++)
        for (uint32_t column = left; column <= right && !st; column++) {
            double px = (double)column * s->step + 0.5 - f->middle[0];
            double py = f->middle[1] - (double)row * s->step - 0.5;
            const tli_crossing c = tli_frame_cross(f, v, px, py);
            const double *e = c.areas, z = c.depths / c.sum;
            bool in = e[0] >= 0 && e[1] >= 0 && e[2] >= 0,
                 out = e[0] <= 0 && e[1] <= 0 && e[2] <= 0;
            if (c.sum == 0 || (!in && !out) || (!f->parallel && !(z > 0))) continue;
            st = add_hit(s, (uint64_t)row * s->columns + column, (float)z, 2 * (door / 4) + !in);
        }
    return st;
}

/* Pairs of what the hits [count] of one ray pass, nearest first; marks are left sorted into those
 * where it comes in and those where it goes out. A ray that met an edge, so that one of them is
 * missing, says nothing. Returns the number of pairs written to pairs. */
static size_t pair_ray(const uint64_t *keys, const uint32_t *marks, size_t count, uint64_t *pairs)
{
    size_t outs = 0, ins = 0, written = 0;
    for (size_t i = 0; i < count; i++) outs += marks[i] & 1;
    ins = count - outs;
    if (outs != ins && outs != ins + 1) return 0; /* one more: the camera stands inside */
    size_t out = 0, in = 0;
    if (outs == ins)
        while (in < count && marks[in] & 1) in++;
    in += outs == ins;
    for (; out < count && in < count; out++, in++) {
        while (out < count && !(marks[out] & 1)) out++;
        while (in < count && marks[in] & 1) in++;
        if (out == count || in == count) break;
        float left = value_of((uint32_t)keys[out]), entered = value_of((uint32_t)keys[in]);
        if (entered < left - SAME_DEPTH * fabsf(left) || marks[in] / 2 == marks[out] / 2) continue;
        pairs[written++] = (uint64_t)(marks[in] / 2) << 32 | marks[out] / 2;
    }
    return written;
}

/* Pairs take the place of the keys, of which there are no fewer. */
static size_t pair_rays(hits *h)
{
    size_t written = 0;
    for (size_t i = 0, end; i < h->count; i = end) {
        for (end = i + 1; end < h->count && h->keys[end] >> 32 == h->keys[i] >> 32;) end++;
        written += pair_ray(h->keys + i, h->marks + i, end - i, h->keys + written);
    }
    return written;
}

tl_status tli_order_gaps(tl_ctx *ctx, const tli_order_view *view, uint64_t **pairs, size_t *count)
{
    scan s = {.ctx = ctx, .view = view};
    double pixels = (double)view->width * view->height;
    *pairs = NULL;
    *count = 0;
    s.step = pixels > RAYS_MAX ? (uint32_t)ceil(sqrt(pixels / RAYS_MAX)) : 1;
    s.columns = (view->width + s.step - 1) / s.step;
    s.rows = (view->height + s.step - 1) / s.step;
    tl_status st = TL_OK;
    for (size_t d = 0; d < view->volume->door_count && !st; d++)
        st = scan_face(&s, view->volume->doors[d]);
    if (!st) st = tli_sort_u64(ctx, s.hits.keys, s.hits.marks, s.hits.count);
    size_t found = st ? 0 : pair_rays(&s.hits);
    if (!st) st = tli_sort_u64(ctx, s.hits.keys, NULL, found);
    tl_mem_free(ctx, s.hits.marks);
    if (st || !found) {
        tl_mem_free(ctx, s.hits.keys);
        return st;
    }
    for (size_t i = 0; i < found; i++)
        if (!*count || s.hits.keys[i] != s.hits.keys[*count - 1])
            s.hits.keys[(*count)++] = s.hits.keys[i];
    *pairs = s.hits.keys;
    return TL_OK;
}
