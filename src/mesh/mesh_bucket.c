/* Dealing tets out to buckets of vertices: the plan, the places, the check of foreign indices. */
#include "mesh/mesh_bucket.h"

/* A piece has at least this many tets, and there are at most PIECES_MAX pieces, so that the table
 * of places stays small beside the tets. */
#define PIECE_TETS_MIN 16384
#define PIECES_MAX 256
/* More streams than this are no longer written from the cache and the TLB of current processors. */
#define BUCKETS_MAX 2048

tl_status tli_buckets_open(tl_ctx *ctx, size_t tet_count, size_t vert_count, size_t item_count,
                           size_t bucket_items, unsigned max_shift, tli_buckets *buckets)
{
    size_t wanted = item_count / bucket_items + 1;
    if (wanted > BUCKETS_MAX) wanted = BUCKETS_MAX;
    unsigned shift = 0;
    while (shift < max_shift && (uint64_t)wanted << shift < vert_count) shift++;
    buckets->shift = shift;
    buckets->bucket_count = (vert_count >> shift) + 1;
    buckets->piece_tets = tet_count / PIECES_MAX + 1;
    if (buckets->piece_tets < PIECE_TETS_MIN) buckets->piece_tets = PIECE_TETS_MIN;
    buckets->piece_count = (tet_count + buckets->piece_tets - 1) / buckets->piece_tets;
    tl_status st = TL_OK;
    buckets->places = tl_mem_zalloc(ctx, buckets->piece_count * buckets->bucket_count,
                                    sizeof *buckets->places, &st);
    buckets->begins = tl_mem_alloc(ctx, buckets->bucket_count + 1, sizeof *buckets->begins, &st);
    return st;
}

void tli_buckets_close(tl_ctx *ctx, tli_buckets *buckets)
{
    tl_mem_free(ctx, buckets->begins);
    tl_mem_free(ctx, buckets->places);
    buckets->begins = buckets->places = NULL;
}

void tli_buckets_place(tli_buckets *buckets)
{
    uint32_t place = 0;
    for (size_t b = 0; b < buckets->bucket_count; b++) {
        buckets->begins[b] = place;
        for (size_t p = 0; p < buckets->piece_count; p++) {
            uint32_t *slot = &buckets->places[p * buckets->bucket_count + b];
            uint32_t count = *slot;
            *slot = place;
            place += count;
        }
    }
    buckets->begins[buckets->bucket_count] = place;
}

tl_status tli_tets_check(tl_ctx *ctx, const tl_lidx *tets, size_t begin, size_t end,
                         size_t vert_count)
{
    tl_lidx largest = 0;
    for (size_t i = 4 * begin; i < 4 * end; i++) largest = tets[i] > largest ? tets[i] : largest;
    if (begin == end || largest < vert_count) return TL_OK;
    size_t i = 4 * begin;
    while (tets[i] < vert_count) i++;
    return tl_fail(ctx, TL_ERR_ARG, "tet %zu: corner %zu is vertex %u of %zu vertices", i / 4,
                   i % 4, tets[i], vert_count);
}
