/* What may be seen in which tile of a picture: a counting sort of things by the tiles that their
 * boxes touch, on all threads, in the order of the things. */
#include <math.h>

#include "draw/draw.h"

/* Things are counted in this many parts, whatever the number of threads. */
enum { PARTS = 16 };

/* Columns and rows of tiles [low, high] that a thing may be seen in; none if low > high. */
typedef struct span {
    uint16_t low[2], high[2];
} span;

static const span NOWHERE = {{1, 1}, {0, 0}};

typedef struct sorting {
    tli_tiling *tiling;
    uint32_t width, height;
    tli_box_fn box;
    const void *data;
    size_t count;
    span *spans;
    size_t *next; /* [PARTS][tiles] things, then places in entries */
} sorting;

static uint16_t tile_of(double at, uint32_t count)
{
    double tile = floor(at / TLI_TILE_PX);
    return tile < 0 ? 0 : tile >= count ? (uint16_t)(count - 1) : (uint16_t)tile;
}

static span span_of(const sorting *s, size_t i)
{
    double low[2], high[2];
    span out;
    if (!s->box(s->data, i, low, high)) return NOWHERE;
    if (!(high[0] >= 0 && high[1] >= 0 && low[0] <= s->width && low[1] <= s->height))
        return NOWHERE;
    for (int k = 0; k < 2; k++) {
        uint32_t count = k ? s->tiling->rows : s->tiling->columns;
        out.low[k] = tile_of(low[k], count);
        out.high[k] = tile_of(high[k], count);
    }
    return out;
}

/* Counts things by tile, or lists them. */
static void walk_part(const sorting *s, size_t part, tl_lidx *entries)
{
    size_t tiles = (size_t)s->tiling->columns * s->tiling->rows, *next = s->next + part * tiles;
    size_t begin = s->count * part / PARTS, end = s->count * (part + 1) / PARTS;
    for (size_t i = begin; i < end; i++) {
        if (!entries) s->spans[i] = span_of(s, i);
        span at = s->spans[i];
        for (size_t row = at.low[1]; row <= at.high[1]; row++)
            for (size_t column = at.low[0]; column <= at.high[0]; column++) {
                size_t *place = &next[row * s->tiling->columns + column];
                if (entries) entries[*place] = (tl_lidx)i;
                (*place)++;
            }
    }
}

static tl_status count_parts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    for (size_t part = begin; part < end; part++) walk_part(arg, part, NULL);
    return TL_OK;
}

static tl_status list_parts(void *arg, size_t begin, size_t end, unsigned worker)
{
    const sorting *s = arg;
    (void)worker;
    for (size_t part = begin; part < end; part++) walk_part(s, part, s->tiling->entries);
    return TL_OK;
}

/* Counts become places: tile after tile, in each part after part. Returns the number of entries. */
static size_t place(const sorting *s, size_t tiles)
{
    size_t sum = 0;
    for (size_t tile = 0; tile < tiles; tile++) {
        s->tiling->starts[tile] = sum;
        for (size_t part = 0; part < PARTS; part++) {
            size_t own = s->next[part * tiles + tile];
            s->next[part * tiles + tile] = sum;
            sum += own;
        }
    }
    s->tiling->starts[tiles] = sum;
    return sum;
}

tl_status tli_tiling_open(tl_ctx *ctx, const tl_image *image, size_t count, tli_box_fn box,
                          const void *data, tli_tiling *tiling)
{
    tl_status st = TL_OK;
    *tiling = (tli_tiling){.columns = (image->width + TLI_TILE_PX - 1) / TLI_TILE_PX,
                           .rows = (image->height + TLI_TILE_PX - 1) / TLI_TILE_PX};
    size_t tiles = (size_t)tiling->columns * tiling->rows;
    sorting s = {.tiling = tiling,
                 .width = image->width,
                 .height = image->height,
                 .box = box,
                 .data = data,
                 .count = count};
    s.spans = tl_mem_alloc(ctx, count, sizeof *s.spans, &st);
    s.next = tl_mem_zalloc(ctx, PARTS * tiles, sizeof *s.next, &st);
    tiling->starts = tl_mem_alloc(ctx, tiles + 1, sizeof *tiling->starts, &st);
    if (!st) st = tli_parallel(ctx, PARTS, 1, count_parts, &s);
    if (!st) tiling->entries = tl_mem_alloc(ctx, place(&s, tiles), sizeof *tiling->entries, &st);
    if (!st) st = tli_parallel(ctx, PARTS, 1, list_parts, &s);
    tl_mem_free(ctx, s.next);
    tl_mem_free(ctx, s.spans);
    if (st) tli_tiling_close(ctx, tiling);
    return st;
}

void tli_tiling_close(tl_ctx *ctx, tli_tiling *tiling)
{
    tl_mem_free(ctx, tiling->entries);
    tl_mem_free(ctx, tiling->starts);
    *tiling = (tli_tiling){0};
}
