/* What the fuzz targets of the container share. A checksum keeps mutations out, so the targets make
 * it right again, as far as they want to get in, and then read all there is. */
#ifndef TETRALOD_FUZZ_STORE_H
#define TETRALOD_FUZZ_STORE_H

#include "store/store_format.h"
#include "store/store_read.h"

#include "fuzz_grid.h"

/* Where the fields are that must fit before anything else is looked at; see docs/FORMAT.md. */
enum { FUZZ_FILE_BYTES = 16, FUZZ_HEAD_BYTES = 24, FUZZ_IDENTITY = 32, FUZZ_PAGES = 60 };

static inline uint64_t fuzz_get(const uint8_t *bytes, unsigned byte_count)
{
    return tli_take(&bytes, byte_count);
}

static inline void fuzz_put(uint8_t *bytes, uint64_t value, unsigned byte_count)
{
    tli_put(&bytes, value, byte_count);
}

/* Bytes of the head, of those that are there; 0: too few for one. */
static inline size_t fuzz_head_bytes(const uint8_t *bytes, size_t byte_count)
{
    if (byte_count < TLI_HEAD_FIXED_BYTES + TLI_STORE_HASH_BYTES) return 0;
    const uint64_t head_bytes = fuzz_get(bytes + FUZZ_HEAD_BYTES, 8);
    if (head_bytes > byte_count || head_bytes < TLI_HEAD_FIXED_BYTES + TLI_STORE_HASH_BYTES)
        return 0;
    return (size_t)head_bytes;
}

/* Makes size and checksum of the head right. */
static inline void fuzz_forge_head(uint8_t *bytes, size_t byte_count)
{
    const size_t head_bytes = fuzz_head_bytes(bytes, byte_count);
    if (!head_bytes) return;
    fuzz_put(bytes + FUZZ_FILE_BYTES, byte_count, 8);
    const uint64_t identity = fuzz_get(bytes + FUZZ_IDENTITY, 8);
    const size_t hashed = head_bytes - TLI_STORE_HASH_BYTES;
    const uint64_t seed = tli_store_seed(identity, TLI_PART_HEAD, 0, 0);
    fuzz_put(bytes + hashed, tli_store_hash(seed, bytes, hashed), 8);
}

/* Makes the checksums of all pages right that lie in the file; the directory ends the head. */
static inline void fuzz_forge_pages(uint8_t *bytes, size_t byte_count)
{
    const size_t head_bytes = fuzz_head_bytes(bytes, byte_count);
    if (!head_bytes) return;
    const uint64_t identity = fuzz_get(bytes + FUZZ_IDENTITY, 8);
    const uint64_t pages = fuzz_get(bytes + FUZZ_PAGES, 4);
    const size_t room = head_bytes - TLI_HEAD_FIXED_BYTES - TLI_STORE_HASH_BYTES;
    if (pages > room / TLI_HEAD_PAGE_BYTES) return;
    uint8_t *entry =
        bytes + head_bytes - TLI_STORE_HASH_BYTES - (size_t)pages * TLI_HEAD_PAGE_BYTES;
    for (uint32_t p = 0; p < pages; p++, entry += TLI_HEAD_PAGE_BYTES) {
        const uint64_t ofs = fuzz_get(entry + 8, 8), size = fuzz_get(entry + 24, 4);
        if (ofs > byte_count || size > byte_count - ofs) continue;
        const uint64_t seed = tli_store_seed(identity, TLI_PART_PAGE, p, 0);
        fuzz_put(entry + 16, tli_store_hash(seed, bytes + ofs, (size_t)size), 8);
    }
}

/* Makes the checksum of a blob right; what a page says of it has been proved. */
static inline void fuzz_forge_blob(const tl_store *store, uint8_t *bytes, uint32_t patch,
                                   uint32_t channel, uint64_t ofs, uint32_t blob_bytes)
{
    const uint64_t seed = tli_store_seed(store->head.identity, TLI_PART_BLOB, patch, channel);
    const uint64_t hash_ofs = ofs + tli_store_blob_bytes(blob_bytes) - TLI_STORE_HASH_BYTES;
    FUZZ_CHECK(hash_ofs + TLI_STORE_HASH_BYTES <= store->head.file_bytes);
    fuzz_put(bytes + hash_ofs, tli_store_hash(seed, bytes + ofs, blob_bytes), 8);
}

/* Makes the checksums of all blobs right whose page can be read. */
static inline void fuzz_forge_blobs(tl_ctx *ctx, const tl_store *store, uint8_t *bytes)
{
    for (uint32_t p = 0; p < store->head.patch_count; p++) {
        tl_patch_info info;
        if (tl_store_patch(ctx, store, p, &info)) return; /* what follows fails the same way */
        fuzz_forge_blob(store, bytes, p, TL_TOPOLOGY, info.topology_ofs, info.topology_bytes);
        for (uint32_t c = 0; c < store->head.channel_count; c++)
            fuzz_forge_blob(store, bytes, p, c, info.channel_ofs[c], info.channel_bytes[c]);
    }
}

/* A failure must have said why. */
static inline void fuzz_told(tl_ctx *ctx, tl_status status)
{
    if (status) FUZZ_CHECK(tl_ctx_message(ctx)[0]);
}

/* Opens a copy of the bytes, forged or not, and reads all that can be read. */
static inline void fuzz_read_store(const uint8_t *bytes, size_t byte_count, bool head, bool pages,
                                   bool blobs)
{
    tl_ctx *ctx = fuzz_ctx_create();
    tl_store *store = NULL;
    uint8_t *copy = malloc(byte_count ? byte_count : 1);
    FUZZ_CHECK(copy);
    if (byte_count) memcpy(copy, bytes, byte_count);
    if (pages) fuzz_forge_pages(copy, byte_count);
    if (head) fuzz_forge_head(copy, byte_count);
    tl_status st = tli_store_open_bytes(ctx, "input", copy, byte_count, &store);
    fuzz_told(ctx, st);
    if (!st) {
        if (blobs) fuzz_forge_blobs(ctx, store, copy);
        fuzz_told(ctx, tl_store_check(ctx, store, TL_CHECK_FULL));
        for (uint32_t p = 0; p < store->head.patch_count && !st; p++) {
            tl_patch *patch = NULL;
            st = tl_store_topology(ctx, store, p, &patch);
            fuzz_told(ctx, st);
            tl_patch_destroy(ctx, patch);
        }
    }
    tl_store_close(store);
    free(copy);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
}

#endif
