/* Where rays come in: the faces with nothing behind that look at the camera, listed by square tiles
 * of the picture, then tried at each pixel of a tile. Faces behind the camera count as well: rays
 * begin there when the camera stands inside of the mesh. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "draw/draw.h"
#include "mesh/mesh.h"

/* Columns and rows of pixels [low, high] that a face may be seen in; none if low > high. */
typedef struct span {
    int32_t low[2], high[2];
} span;

enum { GRAIN = 8192 }; /* tets */

static void corners(const tli_doors *t, tl_lidx door, const tli_vert *out[3])
{
    const tli_cell *cell = &t->volume->cells[door / 4];
    for (int i = 0; i < 3; i++) out[i] = &t->verts[cell->verts[tli_tet_faces[door % 4][i]]];
}

/* Six times the volume between the camera and a face: the side of the face that it looks at. */
static double side(const tli_vert *const v[3])
{
    double p[3][3], n[3];
    for (int i = 0; i < 3; i++) {
        p[i][0] = (double)v[i]->x;
        p[i][1] = (double)v[i]->y;
        p[i][2] = (double)v[i]->z;
    }
    vec_cross(p[1], p[2], n);
    return vec_dot(p[0], n);
}

/* The box of a face on the picture in pixels from the upper left corner; false if it may be
 * anywhere, since it passes beside the camera. */
static bool box_of(const tli_doors *t, const tli_vert *const v[3], double low[2], double high[2])
{
    int front = 0, back = 0;
    for (int k = 0; k < 2; k++) {
        low[k] = (double)INFINITY;
        high[k] = -(double)INFINITY;
    }
    for (int i = 0; i < 3; i++) {
        double w = t->frame->parallel ? 1 : (double)v[i]->z;
        double at[2] = {t->frame->middle[0] + (double)v[i]->x / w,
                        t->frame->middle[1] - (double)v[i]->y / w};
        front += w > 0;
        back += w < 0;
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], at[k]);
            high[k] = fmax(high[k], at[k]);
        }
    }
    return front == 3 || back == 3;
}

/* True for a face that no ray can come in by: it is not finite or looks away. */
static bool is_shut(const tli_doors *t, const tli_vert *const v[3])
{
    int front = 0, back = 0;
    for (int i = 0; i < 3; i++) {
        if (!isfinite(v[i]->x) || !isfinite(v[i]->y) || !isfinite(v[i]->z)) return true;
        front += v[i]->z > 0;
        back += v[i]->z < 0;
    }
    return !t->frame->parallel && (front == 3 ? side(v) <= 0 : back == 3 && side(v) >= 0);
}

static bool box_of_door(const void *data, size_t i, double low[2], double high[2])
{
    const tli_doors *t = data;
    const tli_vert *v[3];
    corners(t, t->faces[i], v);
    if (is_shut(t, v)) return false;
    if (!box_of(t, v, low, high))
        for (int k = 0; k < 2; k++) {
            low[k] = -(double)INFINITY;
            high[k] = (double)INFINITY;
        }
    return true;
}

/* Columns and rows inside of a tile, which begins at (left, top), that a face may be seen in. */
static span pixels_of(const tli_doors *t, const tli_vert *const v[3], uint32_t left, uint32_t top)
{
    span s = {{0, 0}, {TLI_TILE_PX - 1, TLI_TILE_PX - 1}};
    double low[2], high[2];
    bool known = box_of(t, v, low, high);
    for (int k = 0; k < 2; k++) {
        double from = k ? top : left, rest = (k ? t->height : t->width) - from;
        if (known) {
            s.low[k] = (int32_t)fmin(fmax(floor(low[k] - from - 0.5), 0), TLI_TILE_PX);
            s.high[k] = (int32_t)fmin(fmax(ceil(high[k] - from), -1), TLI_TILE_PX - 1);
        }
        if (s.high[k] >= rest) s.high[k] = (int32_t)rest - 1;
    }
    return s;
}

/* ---- where something is seen ---- */

/* Doors of pieces of the tets, in two passes: how many, then which. */
typedef struct listing {
    const tl_volume *volume;
    const tli_vert *verts;
    const float *clear;
    uint8_t *blank; /* [vert_count] bits: value up to clear[0], from clear[1] on */
    size_t *starts; /* [pieces + 1] */
    tl_lidx *faces; /* NULL: count */
} listing;

static tl_status mark_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    const listing *s = arg;
    (void)worker;
    for (size_t v = begin; v < end; v++)
        s->blank[v] =
            (uint8_t)((s->verts[v].s <= s->clear[0]) + 2 * (s->verts[v].s >= s->clear[1]));
    return TL_OK;
}

static bool is_seen(const listing *s, const tli_cell *cell)
{
    return !(s->blank[cell->verts[0]] & s->blank[cell->verts[1]] & s->blank[cell->verts[2]] &
             s->blank[cell->verts[3]]);
}

static tl_status list_pieces(void *arg, size_t begin, size_t end, unsigned worker)
{
    const listing *s = arg;
    const tli_cell *cells = s->volume->cells;
    size_t count = s->faces ? s->starts[begin / GRAIN] : 0;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        if (!is_seen(s, &cells[t]) || tli_cell_is_flat(&cells[t])) continue;
        for (size_t i = 0; i < 4; i++) {
            tl_lidx other = cells[t].behind[i];
            if (other != TL_NONE && is_seen(s, &cells[other / 4])) continue;
            if (s->faces) s->faces[count] = (tl_lidx)(4 * t + i);
            count++;
        }
    }
    if (!s->faces) s->starts[begin / GRAIN] = count;
    return TL_OK;
}

tl_status tli_doors_list(tl_ctx *ctx, const tl_volume *volume, const tli_vert *verts,
                         const float clear[2], tl_lidx **faces, size_t *face_count)
{
    tl_status st = TL_OK;
    size_t pieces = volume->cell_count / GRAIN + 1, sum = 0;
    listing s = {.volume = volume, .verts = verts, .clear = clear};
    *faces = NULL;
    *face_count = volume->door_count;
    if (clear[0] < 0 && clear[1] > TLI_TRANSFER_STEPS) return TL_OK;
    s.blank = tl_mem_alloc(ctx, volume->vert_count, sizeof *s.blank, &st);
    s.starts = tl_mem_zalloc(ctx, pieces, sizeof *s.starts, &st);
    if (!st) st = tli_parallel(ctx, volume->vert_count, GRAIN, mark_verts, &s);
    if (!st) st = tli_parallel(ctx, volume->cell_count, GRAIN, list_pieces, &s);
    for (size_t i = 0; i < pieces && !st; i++) {
        size_t own = s.starts[i];
        s.starts[i] = sum;
        sum += own;
    }
    s.faces = tl_mem_alloc(ctx, sum, sizeof *s.faces, &st);
    if (!st) st = tli_parallel(ctx, volume->cell_count, GRAIN, list_pieces, &s);
    *faces = s.faces;
    *face_count = sum;
    tl_mem_free(ctx, s.starts);
    tl_mem_free(ctx, s.blank);
    return st;
}

tl_status tli_doors_open(tl_ctx *ctx, const tl_volume *volume, const tli_frame *frame,
                         const tli_vert *verts, const float clear[2], const tl_image *image,
                         tli_doors *doors)
{
    tl_status st = TL_OK;
    *doors = (tli_doors){.ctx = ctx,
                         .volume = volume,
                         .frame = frame,
                         .verts = verts,
                         .width = image->width,
                         .height = image->height};
    st = tli_doors_list(ctx, volume, verts, clear, &doors->own, &doors->face_count);
    doors->faces = doors->own ? doors->own : volume->doors;
    if (!st)
        st = tli_tiling_open(ctx, image, doors->face_count, box_of_door, doors, &doors->tiling);
    if (st) tli_doors_close(doors);
    return st;
}

void tli_doors_close(tli_doors *doors)
{
    tli_tiling_close(doors->ctx, &doors->tiling);
    tl_mem_free(doors->ctx, doors->own);
    doors->own = NULL;
}

/* ---- one tile ---- */

/* Whether a ray comes in by a face, and how deep. */
static bool hit_pixel(const tli_doors *t, const tli_vert *const v[3], double px, double py,
                      double *depth)
{
    const tli_crossing c = tli_frame_cross(t->frame, v, px, py);
    *depth = c.depths / c.sum;
    return c.areas[0] >= 0 && c.areas[1] >= 0 && c.areas[2] >= 0 && c.sum > 0;
}

/* Hits of a face at the pixels of a tile, which begin at (left, top). */
static tl_status hit_door(const tli_doors *t, tl_lidx door, uint32_t left, uint32_t top,
                          tli_door_hit **hits, size_t *hit_max, size_t *count)
{
    tl_status st = TL_OK;
    const tli_vert *v[3];
    corners(t, door, v);
    span s = pixels_of(t, v, left, top);
    if (*hit_max - *count < TLI_TILE_PX * TLI_TILE_PX) {
        *hit_max = 2 * *hit_max + TLI_TILE_PX * TLI_TILE_PX;
        *hits = tl_mem_resize(t->ctx, *hits, *hit_max, sizeof **hits, &st);
        if (st) return st;
    }
    for (int32_t row = s.low[1]; row <= s.high[1]; row++)
        for (int32_t column = s.low[0]; column <= s.high[0]; column++) {
            double px = left + (uint32_t)column + 0.5 - t->frame->middle[0];
            double py = t->frame->middle[1] - (top + (uint32_t)row) - 0.5, z;
            if (!hit_pixel(t, v, px, py, &z)) continue;
            (*hits)[(*count)++] = (tli_door_hit){(uint32_t)(row * TLI_TILE_PX + column), door, z};
        }
    return TL_OK;
}

static bool before(const tli_door_hit *a, const tli_door_hit *b)
{
    return a->pixel != b->pixel ? a->pixel < b->pixel : a->z < b->z;
}

/* Shell sort: lists are short and nearly in order, since doors are listed by tet. */
static void sort_hits(tli_door_hit *hits, size_t count)
{
    size_t gap = 1;
    while (gap < count / 3) gap = 3 * gap + 1;
    for (; gap; gap /= 3)
        for (size_t i = gap; i < count; i++) {
            tli_door_hit hit = hits[i];
            size_t k = i;
            for (; k >= gap && before(&hit, &hits[k - gap]); k -= gap) hits[k] = hits[k - gap];
            hits[k] = hit;
        }
}

tl_status tli_doors_hits(const tli_doors *doors, size_t tile, tli_door_hit **hits, size_t *hit_max,
                         size_t *count)
{
    tl_status st = TL_OK;
    uint32_t left = (uint32_t)(tile % doors->tiling.columns) * TLI_TILE_PX;
    uint32_t top = (uint32_t)(tile / doors->tiling.columns) * TLI_TILE_PX;
    *count = 0;
    for (size_t i = doors->tiling.starts[tile]; !st && i < doors->tiling.starts[tile + 1]; i++)
        st = hit_door(doors, doors->faces[doors->tiling.entries[i]], left, top, hits, hit_max,
                      count);
    if (!st) sort_hits(*hits, *count);
    return st;
}
