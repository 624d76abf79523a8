/* Tiles of a picture, with the fragments of translucent things in lists a pixel (an A-buffer,
 * Carpenter 1984), and what all things have in common: colour, light, boxes. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "draw/draw_layers.h"

/* Boxes are wider by this many pixels, far more than they are rounded. */
static const double BOX_MARGIN = 0.01;

/* Vertices that a worker places at once. */
enum { PLACE_GRAIN = 8192 };

/* ---- tiles ---- */

void tli_tile_load(tli_tile *tile, const tl_image *image, uint32_t left, uint32_t top)
{
    const tli_frame *f = tile->frame;
    tile->left = left;
    tile->top = top;
    tile->width = image->width - left < TLI_TILE_PX ? image->width - left : TLI_TILE_PX;
    tile->height = image->height - top < TLI_TILE_PX ? image->height - top : TLI_TILE_PX;
    tile->px = left + 0.5 - f->middle[0];
    tile->py = f->middle[1] - top - 0.5;
    tile->fragment_count = 0;
    tile->status = TL_OK;
    for (size_t y = 0; y < tile->height; y++) {
        size_t from = (top + y) * (size_t)image->width + left, to = y * TLI_TILE_PX;
        memcpy(tile->rgba[to], image->rgba + 4 * from, tile->width * sizeof *tile->rgba);
        for (size_t x = 0; x < tile->width; x++)
            tile->z[to + x] = (float)((double)image->depth[from + x] / f->unit);
    }
}

void tli_tile_store(const tli_tile *tile, tl_image *image)
{
    for (size_t y = 0; y < tile->height; y++) {
        size_t to = (tile->top + y) * (size_t)image->width + tile->left, from = y * TLI_TILE_PX;
        memcpy(image->rgba + 4 * to, tile->rgba[from], tile->width * sizeof *tile->rgba);
        for (size_t x = 0; x < tile->width; x++)
            image->depth[to + x] = (float)((double)tile->z[from + x] * tile->frame->unit);
    }
}

void tli_tile_keep(tli_tile *tile, uint32_t pixel, float z, const float rgba[4])
{
    if (tile->fragment_count == tile->fragment_max && !tile->status) {
        size_t room = 2 * tile->fragment_max + TLI_TILE_PIXELS;
        tile->fragments =
            tl_mem_resize(tile->ctx, tile->fragments, room, sizeof *tile->fragments, &tile->status);
        tile->sorted =
            tl_mem_resize(tile->ctx, tile->sorted, room, sizeof *tile->sorted, &tile->status);
        if (!tile->status) tile->fragment_max = room;
    }
    if (tile->status) return;
    tile->fragments[tile->fragment_count++] =
        (tli_fragment){pixel, z, {rgba[0], rgba[1], rgba[2], rgba[3]}};
}

/* Sorts by depth, equal ones stay in order; spare has as much room. */
static void sort_depths(tli_fragment *f, tli_fragment *spare, size_t count)
{
    tli_fragment *from = f, *to = spare;
    for (size_t run = 1; run < count; run *= 2) {
        for (size_t begin = 0; begin < count; begin += 2 * run) {
            size_t middle = begin + run < count ? begin + run : count;
            size_t end = begin + 2 * run < count ? begin + 2 * run : count;
            size_t a = begin, b = middle;
            for (size_t i = begin; i < end; i++)
                to[i] = a < middle && (b == end || from[a].z <= from[b].z) ? from[a++] : from[b++];
        }
        tli_fragment *kept = from;
        from = to;
        to = kept;
    }
    if (from != f) memcpy(f, from, count * sizeof *f);
}

tl_status tli_tile_sort(tli_tile *tile)
{
    size_t sum = 0;
    if (tile->status) return tile->status;
    memset(tile->starts, 0, sizeof tile->starts);
    for (size_t i = 0; i < tile->fragment_count; i++) {
        const tli_fragment *f = &tile->fragments[i];
        if (f->z <= tile->z[f->pixel]) tile->starts[f->pixel]++;
    }
    for (size_t p = 0; p <= TLI_TILE_PIXELS; p++) tile->starts[p] = sum += tile->starts[p];
    /* from the first on, into places from the last on: of equal depths the last is in front */
    for (size_t i = 0; i < tile->fragment_count; i++) {
        const tli_fragment *f = &tile->fragments[i];
        if (f->z <= tile->z[f->pixel]) tile->sorted[--tile->starts[f->pixel]] = *f;
    }
    for (size_t p = 0; p < TLI_TILE_PIXELS; p++) {
        size_t begin = tile->starts[p], count = tile->starts[p + 1] - begin;
        /* the unsorted list is room by now */
        if (count > 1) sort_depths(tile->sorted + begin, tile->fragments, count);
    }
    return TL_OK;
}

void tli_tile_blend(tli_tile *tile, uint32_t pixel)
{
    for (size_t i = tile->starts[pixel + 1]; i > tile->starts[pixel]; i--) {
        const float *front = tile->sorted[i - 1].rgba;
        for (int k = 0; k < 4; k++)
            tile->rgba[pixel][k] = front[k] + (1 - front[3]) * tile->rgba[pixel][k];
    }
}

/* ---- places ---- */

typedef struct placing {
    const tli_frame *frame;
    const double *xyz;
    double (*places)[3];
} placing;

static tl_status place_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    const placing *p = arg;
    (void)worker;
    for (size_t v = begin; v < end; v++) tli_frame_place(p->frame, p->xyz + 3 * v, p->places[v]);
    return TL_OK;
}

tl_status tli_frame_places(tl_ctx *ctx, const tli_frame *frame, const double *xyz, size_t count,
                           double (*places)[3])
{
    placing p = {frame, xyz, places};
    return tli_parallel(ctx, count, PLACE_GRAIN, place_verts, &p);
}

bool tli_frame_box(const tli_frame *frame, const double (*places)[3], size_t count, double low[2],
                   double high[2])
{
    bool seen = false;
    for (int k = 0; k < 2; k++) {
        low[k] = (double)INFINITY;
        high[k] = -(double)INFINITY;
    }
    for (size_t i = 0; i < count; i++) {
        const double *p = places[i];
        if (!vec_is_finite(p)) return false;
        double w = frame->parallel ? 1 : p[2];
        if (!(w > 0)) continue;
        seen = true;
        for (int k = 0; k < 2; k++) {
            double at = k ? frame->middle[1] - p[1] / w : frame->middle[0] + p[0] / w;
            low[k] = fmin(low[k], at - BOX_MARGIN);
            high[k] = fmax(high[k], at + BOX_MARGIN);
        }
        /* an edge to behind the camera leaves the picture on the side where it passes */
        for (size_t j = 0; j < count && !frame->parallel; j++) {
            const double *q = places[j];
            if (q[2] > 0) continue;
            for (int k = 0; k < 2; k++) {
                double beside = (p[k] * -q[2] + q[k] * w) * (k ? -1 : 1);
                if (beside >= 0) high[k] = (double)INFINITY;
                if (beside <= 0) low[k] = -(double)INFINITY;
            }
        }
    }
    return seen;
}

/* ---- looks ---- */

void tli_look_color(const tl_look *look, double scalar, float rgb[3])
{
    double extinction;
    if (look->transfer) {
        tl_transfer_at(look->transfer, scalar, rgb, &extinction);
        return;
    }
    for (int k = 0; k < 3; k++) rgb[k] = (float)look->rgb[k];
}

void tli_look_light(const tl_look *look, double cosine, float rgb[3])
{
    double color = look->ambient + look->diffuse * cosine;
    double white = look->specular > 0 ? look->specular * pow(cosine, look->shininess) : 0;
    for (int k = 0; k < 3; k++) rgb[k] = (float)fmin((double)rgb[k] * color + white, 1);
}

void tli_frame_view(const tli_frame *frame, double px, double py, double view[3])
{
    double x = frame->parallel ? 0 : px / frame->scale, y = frame->parallel ? 0 : py / frame->scale;
    for (int k = 0; k < 3; k++)
        view[k] = frame->forward[k] + x * frame->right[k] + y * frame->up[k];
}

double tli_frame_cosine(const tli_frame *frame, double px, double py, const double normal[3])
{
    double view[3];
    tli_frame_view(frame, px, py, view);
    double cosine = fabs(vec_dot(view, normal)) / (vec_length(view) * vec_length(normal));
    return cosine <= 1 ? cosine : 1;
}
