/* Stage store, only for its reading half: an open file, and what of its index is kept. */
#ifndef TETRALOD_SRC_STORE_READ_H
#define TETRALOD_SRC_STORE_READ_H

#include <stdatomic.h>

#include "base/base_file.h"
#include "store/store.h"
#include "store/store_format.h"

/* A page of the index, proved and unpacked; immutable. */
typedef struct tli_store_page {
    tl_ctx *ctx; /* that paid for it */
    tli_arena arena;
    tl_segment_info *segments; /* [segment_count] */
    tl_patch_info *patches;    /* [patch_count] */
    uint8_t *has_twins;        /* [patch_count] */
    uint32_t segment_count, patch_count;
} tli_store_page;

/* The coder's tables with the context that paid for them. */
typedef struct tli_store_tables {
    tl_ctx *ctx;
    tl_codec *codec;
} tli_store_tables;

/* What reading changes: set once, by whoever comes first. */
typedef struct tli_store_kept {
    atomic_uint_least64_t bytes_read;
    atomic_uint_least32_t pages_read;
    atomic_uint_least64_t throttle_bytes_s; /* 0: none */
    atomic_uint_least64_t throttle_free_ns; /* when what was asked for so far has been read */
    _Atomic(tli_store_tables *) tables;
    _Atomic(tli_store_page *) pages[]; /* [page_count] */
} tli_store_kept;

struct tl_store {
    tl_ctx *ctx;
    tli_arena arena;
    tli_pread reader;
    tl_store_head head;
    uint32_t *level_end;      /* [level_count]: first segment after those of the level */
    tli_channel_codes *codes; /* [channel_count] */
    float *error_tables;      /* [channel_count + 1][TLI_CODE8_COUNT]; the last: lengths */
    tli_sphere_grid spheres;
    tli_blob codec;
    tli_page_entry *pages; /* [page_count] */
    uint32_t page_count;
    uint64_t head_bytes;
    tli_store_kept *kept;
};

/* Reads a part of the file and counts it. */
tl_status tli_store_read(tl_ctx *ctx, const tl_store *store, uint64_t ofs, void *bytes,
                         size_t byte_count);
/* Fills the store from a head whose checksum is right. */
tl_status tli_head_unpack(tl_ctx *ctx, tl_store *store, const uint8_t *bytes, size_t byte_count);
/* Offset of the byte behind the payload of a page. */
uint64_t tli_store_payload_end(const tl_store *store, uint32_t page);
/* Level of a segment < segment_count. */
uint32_t tli_store_level_of(const tl_store *store, uint32_t segment);

/* A page, read and proved when it is not there. */
tl_status tli_store_page_get(tl_ctx *ctx, const tl_store *store, uint32_t page_id,
                             const tli_store_page **page);
/* NULL is allowed. */
void tli_store_page_release(tli_store_page *page);
/* Number of the page that holds a patch or segment. */
uint32_t tli_store_page_of_patch(const tl_store *store, uint32_t patch);
uint32_t tli_store_page_of_segment(const tl_store *store, uint32_t segment);

#endif
