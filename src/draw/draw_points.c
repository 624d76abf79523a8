/* Points on the processor (Sondershaus 2007, 7.2): discs of one brightness where the points have
 * normals, spheres where they have none. Edges are smooth: a pixel is covered as far as the disc
 * reaches into it. What is thrown away at a distance is decided by a die for each point: the work
 * keeps shares by distance over extent, here it is the share that keeps as many points a pixel as
 * the nearest ones have. */
#include <math.h>

#include "base/base_random.h"
#include "draw/draw_layers.h"

/* Least share of points that stays at any distance, as in the work. */
static const double SHARE_MIN = 0.1;

typedef struct cloud {
    const tl_polydata *points;
    const tl_look *look;
    const tli_frame *frame;
    double (*places)[3]; /* of points in the frame; z is NaN of those that are not seen */
    double radius_px;
    double radius; /* units of the frame; 0: that in pixels counts */
} cloud;

/* A point on the picture. */
typedef struct disc {
    double x, y, z;   /* pixels from the middle, depth */
    double radius_px; /* and how deep a sphere of that is, by radius */
    double depth;
} disc;

static bool set_disc(const cloud *c, size_t point, disc *d)
{
    const double *place = c->places[point];
    double w = c->frame->parallel ? 1 : place[2];
    if (!(place[2] > 0)) return false;
    d->x = place[0] / w;
    d->y = place[1] / w;
    d->z = place[2];
    d->radius_px = c->radius > 0 ? c->radius * c->frame->scale / w : c->radius_px;
    d->depth = d->radius_px * w / c->frame->scale;
    return isfinite(d->x) && isfinite(d->y) && isfinite(d->radius_px);
}

static bool box(const void *data, size_t piece, double low[2], double high[2])
{
    disc d;
    const cloud *c = data;
    if (!set_disc(c, piece, &d)) return false;
    double reach = d.radius_px + 0.5;
    low[0] = c->frame->middle[0] + d.x - reach;
    high[0] = c->frame->middle[0] + d.x + reach;
    low[1] = c->frame->middle[1] - d.y - reach;
    high[1] = c->frame->middle[1] - d.y + reach;
    return true;
}

/* First and one past the last of the pixels of a side whose middles are from low to high; first is
 * the place of the one at 0. */
static void clip(double low, double high, double first, uint32_t side, uint32_t range[2])
{
    range[0] = (uint32_t)fmin(fmax(ceil(low - first), 0), side);
    range[1] = (uint32_t)fmin(fmax(floor(high - first) + 1, 0), side);
}

static void put(const cloud *c, const disc *d, const float color[3], tli_tile *tile, uint32_t x,
                uint32_t y)
{
    double px = tile->px + x - d->x, py = tile->py - y - d->y, away = sqrt(px * px + py * py);
    double covered = d->radius_px + 0.5 - away, share = away / d->radius_px;
    if (!(covered > 0)) return;
    double inward = share < 1 ? sqrt(1 - share * share) : 0, z = d->z;
    float rgba[4] = {color[0], color[1], color[2], 1};
    if (!c->points->normals) {
        z -= d->depth * inward;
        if (c->look->lit) tli_look_light(c->look, inward, rgba);
    }
    float opacity = (float)(c->look->opacity * fmin(covered, 1));
    for (int k = 0; k < 3; k++) rgba[k] *= opacity;
    rgba[3] = opacity;
    tli_tile_put(tile, y * TLI_TILE_PX + x, (float)z, rgba);
}

static void draw(const void *data, size_t piece, tli_tile *tile)
{
    disc d;
    uint32_t columns[2], rows[2];
    float color[3];
    const cloud *c = data;
    const float *normals = c->points->normals;
    if (!set_disc(c, piece, &d)) return;
    double reach = d.radius_px + 0.5;
    clip(d.x - reach, d.x + reach, tile->px, tile->width, columns);
    clip(-d.y - reach, -d.y + reach, -tile->py, tile->height, rows);
    if (columns[0] >= columns[1] || rows[0] >= rows[1]) return;
    tli_look_color(c->look, c->look->scalar ? c->look->scalar[piece] : 0, color);
    if (c->look->lit && normals) {
        double normal[3];
        for (size_t k = 0; k < 3; k++) normal[k] = (double)normals[3 * piece + k];
        tli_look_light(c->look, tli_frame_cosine(c->frame, d.x, d.y, normal), color);
    }
    for (uint32_t y = rows[0]; y < rows[1]; y++)
        for (uint32_t x = columns[0]; x < columns[1]; x++) put(c, &d, color, tile, x, y);
}

/* ---- fewer at a distance ---- */

double tli_point_die(uint64_t point)
{
    uint64_t row = point * UINT64_C(0x9e3779b97f4a7c15);
    return tli_uniform(&row);
}

/* A surface at twice the distance has its points on a quarter of the pixels. */
static void thin_out(cloud *c)
{
    double nearest = (double)INFINITY;
    size_t count = c->points->vert_count;
    for (size_t i = 0; i < count; i++)
        if (c->places[i][2] > 0 && c->places[i][2] < nearest) nearest = c->places[i][2];
    for (size_t i = 0; i < count; i++) {
        double share = nearest / c->places[i][2];
        if (tli_point_die(i) >= fmax(share * share, SHARE_MIN)) c->places[i][2] = (double)NAN;
    }
}

static void release(tl_ctx *ctx, void *data)
{
    cloud *c = data;
    tl_mem_free(ctx, c->places);
    tl_mem_free(ctx, c);
}

tl_status tli_layer_points(tl_ctx *ctx, const tl_polydata *points, const tl_look *look,
                           const tl_point_opts *opts, const tli_frame *frame, tli_layer *layer)
{
    tl_status st = TL_OK;
    cloud *c = tl_mem_zalloc(ctx, 1, sizeof *c, &st);
    if (st) return st;
    *c = (cloud){.points = points,
                 .look = look,
                 .frame = frame,
                 .radius_px = opts->radius_px,
                 .radius = opts->radius / frame->unit};
    *layer = (tli_layer){c, look->opacity > 0 ? points->vert_count : 0, box, draw, release};
    c->places = tl_mem_alloc(ctx, points->vert_count, sizeof *c->places, &st);
    if (!st) st = tli_frame_places(ctx, frame, points->xyz, points->vert_count, c->places);
    if (st) {
        release(ctx, c);
        return st;
    }
    if (opts->scale_depth && !frame->parallel) thin_out(c);
    return TL_OK;
}
