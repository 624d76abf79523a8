/* Stage mesh, internal: tets dealt out to buckets, each a range of vertices, so that what one
 * bucket needs stays in the cache. A counting sort over (bucket, piece of the tets): each piece has
 * its own place in each bucket, so the order in a bucket is that of the tets for any number of
 * threads. */
#ifndef TETRALOD_SRC_MESH_BUCKET_H
#define TETRALOD_SRC_MESH_BUCKET_H

#include "base/base.h"
#include "tetralod/mesh.h"

typedef struct tli_buckets {
    unsigned shift;      /* vertex v belongs to bucket v >> shift */
    size_t bucket_count; /* >= 1 */
    size_t piece_tets;   /* tets of a piece: the grain of tli_parallel */
    size_t piece_count;
    uint32_t *places; /* [piece_count][bucket_count]: counts, then the next place to write to */
    uint32_t *begins; /* [bucket_count + 1] */
} tli_buckets;

/* Chooses ranges of vertices that about bucket_items of item_count items fall into. max_shift
 * bounds the number of vertices of a range. Gives places (zero) and begins. */
tl_status tli_buckets_open(tl_ctx *ctx, size_t tet_count, size_t vert_count, size_t item_count,
                           size_t bucket_items, unsigned max_shift, tli_buckets *buckets);
void tli_buckets_close(tl_ctx *ctx, tli_buckets *buckets);

/* Turns counts into places and fills begins. */
void tli_buckets_place(tli_buckets *buckets);

/* TL_ERR_ARG, naming the tet, if an index of tets [begin, end) is not below vert_count. */
tl_status tli_tets_check(tl_ctx *ctx, const tl_lidx *tets, size_t begin, size_t end,
                         size_t vert_count);

/* The row of a piece that begins at tet begin. */
static inline uint32_t *tli_buckets_row(const tli_buckets *buckets, size_t begin)
{
    return buckets->places + begin / buckets->piece_tets * buckets->bucket_count;
}

#endif
