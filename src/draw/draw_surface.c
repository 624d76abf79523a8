/* Triangles on the processor. Edges are planes through the camera (Olano & Greer 1997, homogeneous
 * rasterization), so that triangles that reach behind the camera need no clipping and weights are
 * right under perspective. Both triangles at an edge compute the same plane but for its sign: each
 * pixel between them belongs to just one. */
#include <math.h>

#include "base/base_vec.h"
#include "draw/draw_layers.h"

typedef struct surface {
    const tl_polydata *triangles;
    const tl_look *look;
    const tli_frame *frame;
    double (*places)[3]; /* of vertices in the frame */
} surface;

/* A triangle on its way into a tile. */
typedef struct triangle {
    const tl_lidx *corners;
    double z[3];
    double planes[3][3]; /* [i] of the edge opposite to corner i; positive inside */
    bool owns[3];        /* pixels just on the edge belong to this triangle */
    double normal[3];    /* of the plane, of any length */
} triangle;

static bool box(const void *data, size_t piece, double low[2], double high[2])
{
    const surface *s = data;
    double places[3][3];
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++)
            places[i][k] = s->places[s->triangles->corners[3 * piece + i]][k];
    return tli_frame_box(s->frame, (const double(*)[3])places, 3, low, high);
}

static bool set_up(const surface *s, size_t piece, triangle *t)
{
    double p[3][3], det;
    t->corners = s->triangles->corners + 3 * piece;
    for (int i = 0; i < 3; i++) {
        const double *place = s->places[t->corners[i]];
        p[i][0] = place[0];
        p[i][1] = place[1];
        p[i][2] = s->frame->parallel ? 1 : place[2];
        t->z[i] = place[2];
    }
    for (int i = 0; i < 3; i++) vec_cross(p[(i + 1) % 3], p[(i + 2) % 3], t->planes[i]);
    det = vec_dot(p[0], t->planes[0]);
    if (det == 0 || !isfinite(det)) return false;
    for (int i = 0; i < 3; i++) {
        double *e = t->planes[i];
        for (int k = 0; k < 3; k++) e[k] = det < 0 ? -e[k] : e[k];
        t->owns[i] = e[0] > 0 || (e[0] == 0 && e[1] > 0);
    }
    return true;
}

static void set_normal(const surface *s, triangle *t)
{
    double a[3], b[3];
    const double *xyz = s->triangles->xyz, *from = xyz + 3 * (size_t)t->corners[0];
    vec_sub(xyz + 3 * (size_t)t->corners[1], from, a);
    vec_sub(xyz + 3 * (size_t)t->corners[2], from, b);
    for (int k = 0; k < 3; k++) {
        a[k] /= s->frame->unit;
        b[k] /= s->frame->unit;
    }
    vec_cross(a, b, t->normal);
}

/* Colour and opacity at a pixel; weights of the corners. */
static void shade(const surface *s, const triangle *t, double px, double py,
                  const double weights[3], float rgba[4])
{
    const tl_look *look = s->look;
    double scalar = 0, normal[3] = {0, 0, 0};
    for (int i = 0; i < 3 && look->scalar; i++) scalar += weights[i] * look->scalar[t->corners[i]];
    tli_look_color(look, scalar, rgba);
    if (look->lit) {
        const float *normals = s->triangles->normals;
        for (int i = 0; i < 3 && normals; i++)
            for (int k = 0; k < 3; k++)
                normal[k] += weights[i] * (double)normals[3 * (size_t)t->corners[i] + (size_t)k];
        bool flat = !(vec_length(normal) > 0);
        tli_look_light(look, tli_frame_cosine(s->frame, px, py, flat ? t->normal : normal), rgba);
    }
    for (int k = 0; k < 3; k++) rgba[k] *= (float)look->opacity;
    rgba[3] = (float)look->opacity;
}

/* Columns and rows of a tile, [low, high), that a piece may be seen in; false: none. */
static bool clip_box(const surface *s, size_t piece, const tli_tile *tile, uint32_t low[2],
                     uint32_t high[2])
{
    double from[2], to[2];
    if (!box(s, piece, from, to)) return false;
    for (int k = 0; k < 2; k++) {
        double first = k ? tile->top : tile->left, side = k ? tile->height : tile->width;
        low[k] = (uint32_t)fmin(fmax(floor(from[k] - first - 0.5), 0), side);
        high[k] = (uint32_t)fmin(fmax(ceil(to[k] - first + 0.5), 0), side);
    }
    return low[0] < high[0] && low[1] < high[1];
}

/* True if the whole of a box lies outside of an edge. */
static bool misses(const triangle *t, const tli_tile *tile, const uint32_t low[2],
                   const uint32_t high[2])
{
    for (int i = 0; i < 3; i++) {
        const double *e = t->planes[i];
        double px = tile->px + (e[0] > 0 ? high[0] - 1 : low[0]);
        double py = tile->py - (e[1] > 0 ? low[1] : high[1] - 1);
        if (e[0] * px + e[1] * py + e[2] < 0) return true;
    }
    return false;
}

static void draw(const void *data, size_t piece, tli_tile *tile)
{
    const surface *s = data;
    triangle t;
    uint32_t low[2], high[2];
    if (!clip_box(s, piece, tile, low, high) || !set_up(s, piece, &t)) return;
    if (misses(&t, tile, low, high)) return;
    if (s->look->lit) set_normal(s, &t);
    for (uint32_t y = low[1]; y < high[1]; y++)
        for (uint32_t x = low[0]; x < high[0]; x++) {
            double e[3], px = tile->px + x, py = tile->py - y, sum = 0, z = 0;
            bool inside = true;
            for (int i = 0; i < 3; i++) {
                e[i] = t.planes[i][0] * px + t.planes[i][1] * py + t.planes[i][2];
                inside = inside && (e[i] > 0 || (e[i] == 0 && t.owns[i]));
                sum += e[i];
                z += e[i] * t.z[i];
            }
            z /= sum;
            uint32_t pixel = y * TLI_TILE_PX + x;
            if (!inside || !(z > 0 && (float)z <= tile->z[pixel])) continue;
            float rgba[4];
            for (int i = 0; i < 3; i++) e[i] /= sum;
            shade(s, &t, px, py, e, rgba);
            tli_tile_put(tile, pixel, (float)z, rgba);
        }
}

static void release(tl_ctx *ctx, void *data)
{
    surface *s = data;
    tl_mem_free(ctx, s->places);
    tl_mem_free(ctx, s);
}

tl_status tli_layer_surface(tl_ctx *ctx, const tl_polydata *triangles, const tl_look *look,
                            const tli_frame *frame, tli_layer *layer)
{
    tl_status st = TL_OK;
    surface *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    *s = (surface){.triangles = triangles, .look = look, .frame = frame};
    *layer = (tli_layer){s, look->opacity > 0 ? triangles->cell_count : 0, box, draw, release};
    s->places = tl_mem_alloc(ctx, triangles->vert_count, sizeof *s->places, &st);
    if (!st) st = tli_frame_places(ctx, frame, triangles->xyz, triangles->vert_count, s->places);
    if (st) release(ctx, s);
    return st;
}
