/* Stage store, only for its writing half: a file while it grows. */
#ifndef TETRALOD_SRC_STORE_WRITE_H
#define TETRALOD_SRC_STORE_WRITE_H

#include "base/base_file.h"
#include "codec/codec.h"
#include "store/store.h"
#include "store/store_round.h"

/* How much of the index is in the page that is being filled. */
typedef struct tli_page_mark {
    size_t segment_bytes, output_bytes, bin_bytes, patch_bytes; /* in the four buffers */
    uint32_t segment_count, patch_count, output_count;
    uint64_t payload_end; /* offset in the file */
} tli_page_mark;

/* A page that is being filled: its four parts apart, since they follow one another in the file. */
typedef struct tli_page_draft {
    tli_bytes segments, outputs, bins, patches;
    tli_page_mark now;   /* all of it */
    tli_page_mark whole; /* up to the last group that is complete */
    uint64_t payload_ofs;
    uint32_t first_segment, first_patch;
} tli_page_draft;

struct tli_store_writer {
    tl_ctx *ctx;
    tli_sink *sink;
    tl_status status;         /* of the first failure */
    tli_arena arena;          /* of what lives as long as the writer */
    tl_store_head head;       /* counts as they were at the beginning; no pointers */
    uint32_t *level_end;      /* [level_count]: first segment after those of the level */
    tli_channel_codes *codes; /* [channel_count] */
    double *error_tables;     /* [channel_count + 1][TLI_CODE8_COUNT]; the last: lengths */
    tli_sphere_grid spheres;
    tli_blob codec;
    tli_page_draft draft;
    tli_bytes scratch;    /* a blob with padding and checksum */
    tli_bytes *group;     /* [channel_count] blobs of the patches of one consumer */
    uint32_t group_first; /* first patch of the group */
    uint32_t group_level; /* of its patches; TL_NONE: none yet */
    uint32_t next_segment, next_patch;
    tli_page_entry *pages; /* [page_max] */
    uint32_t page_count, page_max;
    tli_bytes first_page;    /* the page that lies behind the head */
    uint64_t reserved_bytes; /* for head, first page and padding */
    size_t first_page_room, page_target;
    uint64_t topology_bytes, *channel_bytes; /* of all blobs */
};

/* Refuses a head that can't be written; message in the context. */
tl_status tli_head_examine(tl_ctx *ctx, const tl_store_head *head);
/* Bytes of the head with that many pages. */
uint64_t tli_head_bytes(const tl_store_head *head, size_t codec_bytes, uint32_t page_count);
/* The whole head, checksum included, over [tli_head_bytes]. */
void tli_head_pack(const tli_store_writer *writer, const tl_store_head *head, uint64_t file_bytes,
                   uint8_t *bytes);

/* Most bytes that so many segments and patches can take in pages, those of the page itself apart.
 */
uint64_t tli_page_bound(uint64_t segment_count, uint64_t patch_count, uint32_t channel_count);
void tli_draft_open(tl_ctx *ctx, tli_page_draft *draft);
void tli_draft_close(tli_page_draft *draft);
tl_status tli_draft_patch(tli_store_writer *writer, const tl_patch_info *info, uint32_t flags,
                          uint32_t topology_bytes, const tli_blob *channels);
tl_status tli_draft_segment(tli_store_writer *writer, const tl_segment_info *info);
/* Bytes of the page up to a mark. */
uint64_t tli_draft_bytes(const tli_page_mark *mark);
/* Packs the page up to the mark, with padding; what is behind it begins the next page. */
tl_status tli_draft_pack(tli_page_draft *draft, const tli_page_mark *mark, tli_bytes *page);

#endif
