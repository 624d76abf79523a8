/* From the floats of a drawing to the bytes of a window. */
#include <math.h>

#include "draw/draw.h"
#include "live/live.h"

enum { GRAIN_ROWS = 16 };

/* ---- scaling up ---- */

/* Where a pixel of the large picture reads: a pixel, its neighbour, and the part of the latter. */
typedef struct tap {
    uint32_t at, next, nearest;
    float part;
} tap;

typedef struct enlarging {
    const tl_image *small;
    tl_image *large;
    const tap *columns; /* [large->width] */
    double scale;       /* of a pixel of the large picture to the small one */
} enlarging;

static tap tap_of(uint32_t x, uint32_t large, uint32_t small, double scale)
{
    double at = (x + 0.5 - large / 2.0) * scale + small / 2.0 - 0.5;
    double low = floor(fmin(fmax(at, 0), small - 1.0));
    tap t = {.at = (uint32_t)low};
    t.next = t.at + 1 < small ? t.at + 1 : t.at;
    t.part = (float)fmin(fmax(at - low, 0), 1);
    t.nearest = t.part < 0.5F ? t.at : t.next;
    return t;
}

static void enlarge_row(const enlarging *e, uint32_t y)
{
    const tl_image *from = e->small;
    const tap row = tap_of(y, e->large->height, from->height, e->scale);
    const float *above = from->rgba + 4 * (size_t)row.at * from->width;
    const float *below = from->rgba + 4 * (size_t)row.next * from->width;
    const float *depth = from->depth + (size_t)row.nearest * from->width;
    float *out = e->large->rgba + 4 * (size_t)y * e->large->width;
    float *out_depth = e->large->depth + (size_t)y * e->large->width;
    for (uint32_t x = 0; x < e->large->width; x++) {
        const tap t = e->columns[x];
        for (uint32_t k = 0; k < 4; k++) {
            float left =
                above[4 * t.at + k] + row.part * (below[4 * t.at + k] - above[4 * t.at + k]);
            float right =
                above[4 * t.next + k] + row.part * (below[4 * t.next + k] - above[4 * t.next + k]);
            out[4 * x + k] = left + t.part * (right - left);
        }
        out_depth[x] = depth[t.nearest];
    }
}

static tl_status enlarge_rows(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    for (size_t y = begin; y < end; y++) enlarge_row(arg, (uint32_t)y);
    return TL_OK;
}

tl_status tli_live_enlarge(tl_ctx *ctx, const tl_image *small, tl_image *large)
{
    tl_status st = TL_OK;
    enlarging e = {.small = small, .large = large};
    e.scale = (double)small->height / large->height;
    tap *columns = tl_mem_alloc(ctx, large->width, sizeof *columns, &st);
    if (st) return st;
    for (uint32_t x = 0; x < large->width; x++)
        columns[x] = tap_of(x, large->width, small->width, e.scale);
    e.columns = columns;
    st = tli_parallel(ctx, large->height, GRAIN_ROWS, enlarge_rows, &e);
    tl_mem_free(ctx, columns);
    return st;
}

/* ---- bytes ---- */

typedef struct rounding {
    const tl_image *image;
    float background[3];
    bool has_background, is_bgra;
    uint8_t *bytes;
} rounding;

static tl_status round_rows(void *arg, size_t begin, size_t end, unsigned worker)
{
    const rounding *r = arg;
    (void)worker;
    size_t first = begin * r->image->width, behind = end * r->image->width;
    (r->is_bgra ? tli_pixels_pack_bgra
                : tli_pixels_pack)(r->image->rgba + 4 * first, behind - first,
                                   r->has_background ? r->background : NULL, r->bytes + 4 * first);
    return TL_OK;
}

tl_status tli_live_bytes(tl_ctx *ctx, const tl_image *image, const double *background, bool is_bgra,
                         uint8_t *bytes)
{
    rounding r = {
        .image = image, .has_background = background != NULL, .is_bgra = is_bgra, .bytes = bytes};
    for (int k = 0; k < 3 && background; k++) r.background[k] = (float)background[k];
    return tli_parallel(ctx, image->height, GRAIN_ROWS, round_rows, &r);
}
