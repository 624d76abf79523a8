/* Blobs of a patch: read at their place, checksum proved, twins taken off, decoded. */
#include "store/store_read.h"

/* ---- bytes ---- */

static tl_status fail_blob(tl_ctx *ctx, const tl_store *store, uint32_t patch, uint32_t channel,
                           uint64_t ofs, const char *wrong)
{
    if (channel == TL_TOPOLOGY)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': patch %u, topology at byte %llu: %s",
                       store->reader.path, patch, (unsigned long long)ofs, wrong);
    return tl_fail(ctx, TL_ERR_FORMAT, "'%s': patch %u, channel '%s' at byte %llu: %s",
                   store->reader.path, patch, store->head.channels[channel].name,
                   (unsigned long long)ofs, wrong);
}

/* Reads a blob with its padding and checksum and proves both. Gives *bytes. */
static tl_status read_blob(tl_ctx *ctx, const tl_store *store, uint32_t patch, uint32_t channel,
                           uint64_t ofs, uint32_t byte_count, uint8_t **bytes)
{
    const size_t all = (size_t)tli_store_blob_bytes(byte_count);
    const uint64_t seed = tli_store_seed(store->head.identity, TLI_PART_BLOB, patch, channel);
    const char *wrong = NULL;
    tl_status st = TL_OK;
    uint8_t *b = tl_mem_alloc(ctx, all, 1, &st);
    if (!st) st = tli_store_read(ctx, store, ofs, b, all);
    if (!st) {
        const uint8_t *at = b + all - TLI_STORE_HASH_BYTES;
        for (const uint8_t *padding = b + byte_count; padding < at; padding++)
            if (*padding) wrong = "padding that is not zero";
        if (tli_store_hash(seed, b, byte_count) != tli_take(&at, TLI_STORE_HASH_BYTES))
            wrong = "its checksum is wrong: it is damaged";
    }
    if (wrong) st = fail_blob(ctx, store, patch, channel, ofs, wrong);
    if (st)
        tl_mem_free(ctx, b);
    else
        *bytes = b;
    return st;
}

static tl_status find_patch(tl_ctx *ctx, const tl_store *store, uint32_t id,
                            const tl_patch_info **info, bool *has_twins)
{
    const tli_store_page *page = NULL;
    if (id >= store->head.patch_count)
        return tl_fail(ctx, TL_ERR_ARG, "'%s': there is no patch %u; there are %u",
                       store->reader.path, id, store->head.patch_count);
    const uint32_t page_id = tli_store_page_of_patch(store, id);
    tl_status st = tli_store_page_get(ctx, store, page_id, &page);
    if (st) return st;
    const uint32_t index = id - store->pages[page_id].first_patch;
    *info = &page->patches[index];
    *has_twins = page->has_twins[index];
    return TL_OK;
}

/* ---- twins ---- */

/* The twins behind a topology blob; *byte_count becomes that of the blob alone. */
static const uint8_t *find_twins(const uint8_t *bytes, size_t *byte_count, size_t *twin_count)
{
    if (*byte_count < 2) return NULL;
    const uint8_t *at = bytes + *byte_count - 2;
    *twin_count = (size_t)tli_take(&at, 2);
    if (!*twin_count || *byte_count - 2 < *twin_count * TLI_TWIN_BYTES) return NULL;
    *byte_count -= 2 + *twin_count * TLI_TWIN_BYTES;
    return bytes + *byte_count;
}

/* False where twins are zero, out of range, or not ascending. */
static bool take_twins(const uint8_t *at, size_t twin_count, uint32_t vert_count, tli_twin *twins)
{
    for (size_t i = 0; i < twin_count; i++) {
        twins[i].vert = (uint16_t)tli_take(&at, 2);
        twins[i].twin = (uint8_t)tli_take(&at, 1);
        if (!twins[i].twin || twins[i].vert >= vert_count) return false;
        if (i && twins[i].vert <= twins[i - 1].vert) return false;
    }
    return true;
}

/* Reads a topology blob; *byte_count without twins, which are given (NULL: none). */
static tl_status read_topology(tl_ctx *ctx, const tl_store *store, uint32_t id,
                               const tl_patch_info *info, bool has_twins, uint8_t **bytes,
                               size_t *byte_count, tli_twin **twins, size_t *twin_count)
{
    tl_status st = TL_OK;
    uint8_t *b = NULL;
    tli_twin *list = NULL;
    *twin_count = 0;
    *byte_count = info->topology_bytes;
    st = read_blob(ctx, store, id, TL_TOPOLOGY, info->topology_ofs, info->topology_bytes, &b);
    if (!st && has_twins) {
        const uint8_t *at = find_twins(b, byte_count, twin_count);
        if (at) list = tl_mem_alloc(ctx, *twin_count, sizeof *list, &st);
        if (!st && (!at || !take_twins(at, *twin_count, info->vert_count, list)))
            st = fail_blob(ctx, store, id, TL_TOPOLOGY, info->topology_ofs,
                           "twins that are zero, out of range or not ascending");
    }
    if (st) {
        tl_mem_free(ctx, list);
        tl_mem_free(ctx, b);
        return st;
    }
    *bytes = b;
    *twins = list;
    return TL_OK;
}

static tl_status apply_twins(tl_ctx *ctx, tl_patch *patch, const tli_twin *twins, size_t twin_count)
{
    tl_status st = TL_OK;
    if (!twin_count) return TL_OK;
    patch->twins = tl_mem_zalloc(ctx, patch->vert_count, 1, &st);
    for (size_t i = 0; !st && i < twin_count; i++) patch->twins[twins[i].vert] = twins[i].twin;
    return st;
}

/* ---- tables ---- */

tl_status tl_store_codec(tl_ctx *ctx, const tl_store *store, const tl_codec **codec)
{
    tl_status st = TL_OK;
    tli_store_tables *there = atomic_load_explicit(&store->kept->tables, memory_order_acquire);
    *codec = NULL;
    if (!store->codec.byte_count) return TL_OK; /* raw patches need none */
    if (!there) {
        tli_store_tables *made = tl_mem_alloc(ctx, 1, sizeof *made, &st);
        if (st) return st;
        *made = (tli_store_tables){.ctx = tli_ctx_owner(ctx)};
        st = tl_codec_read(ctx, store->codec.bytes, store->codec.byte_count, &made->codec);
        if (st) {
            tl_mem_free(ctx, made);
            return tl_note(ctx, st, "'%s': the coder's tables in its head", store->reader.path);
        }
        if (atomic_compare_exchange_strong(&store->kept->tables, &there, made)) {
            there = made;
        } else { /* another thread was first */
            tl_codec_destroy(ctx, made->codec);
            tl_mem_free(ctx, made);
        }
    }
    *codec = there->codec;
    return TL_OK;
}

/* ---- patches and values ---- */

tl_status tl_store_blob(tl_ctx *ctx, const tl_store *store, uint32_t patch_id, uint32_t channel,
                        uint8_t **bytes, size_t *byte_count)
{
    const tl_patch_info *info = NULL;
    bool has_twins = false;
    tli_twin *twins = NULL;
    size_t twin_count = 0;
    if (channel != TL_TOPOLOGY && channel >= store->head.channel_count)
        return tl_fail(ctx, TL_ERR_ARG, "'%s': there is no channel %u", store->reader.path,
                       channel);
    tl_status st = find_patch(ctx, store, patch_id, &info, &has_twins);
    if (st) return st;
    if (channel == TL_TOPOLOGY) {
        st = read_topology(ctx, store, patch_id, info, has_twins, bytes, byte_count, &twins,
                           &twin_count);
        if (!st) tl_mem_free(ctx, twins);
        return st;
    }
    *byte_count = info->channel_bytes[channel];
    return read_blob(ctx, store, patch_id, channel, info->channel_ofs[channel],
                     info->channel_bytes[channel], bytes);
}

tl_status tli_store_twins(tl_ctx *ctx, const tl_store *store, uint32_t patch_id, tli_twin **twins,
                          size_t *twin_count)
{
    const tl_patch_info *info = NULL;
    bool has_twins = false;
    uint8_t *bytes = NULL;
    size_t byte_count = 0;
    *twins = NULL;
    *twin_count = 0;
    tl_status st = find_patch(ctx, store, patch_id, &info, &has_twins);
    if (st || !has_twins) return st;
    st = read_topology(ctx, store, patch_id, info, has_twins, &bytes, &byte_count, twins,
                       twin_count);
    if (!st) tl_mem_free(ctx, bytes);
    return st;
}

tl_status tl_store_topology(tl_ctx *ctx, const tl_store *store, uint32_t patch_id, tl_patch **patch)
{
    const tl_patch_info *info = NULL;
    const tl_codec *codec = NULL;
    bool has_twins = false;
    uint8_t *bytes = NULL;
    size_t byte_count = 0, twin_count = 0;
    tli_twin *twins = NULL;
    tl_patch *p = NULL;
    *patch = NULL;
    tl_status st = find_patch(ctx, store, patch_id, &info, &has_twins);
    if (!st) st = tl_store_codec(ctx, store, &codec);
    if (st) return st;
    st = read_topology(ctx, store, patch_id, info, has_twins, &bytes, &byte_count, &twins,
                       &twin_count);
    if (st) return st;
    st = tl_topology_decode(ctx, codec, info->class_, bytes, byte_count, &p);
    if (st == TL_ERR_ARG) st = TL_ERR_FORMAT; /* a class that this file has no tables for */
    if (!st && (p->vert_count != info->vert_count || p->tet_count != info->tet_count))
        st = tl_fail(ctx, TL_ERR_FORMAT, "it has %u tets and %u vertices, the index says %u and %u",
                     p->tet_count, p->vert_count, info->tet_count, info->vert_count);
    if (!st) st = apply_twins(ctx, p, twins, twin_count);
    tl_mem_free(ctx, twins);
    tl_mem_free(ctx, bytes);
    if (st) {
        tl_patch_destroy(ctx, p);
        return tl_note(ctx, st, "'%s': patch %u, topology at byte %llu", store->reader.path,
                       patch_id, (unsigned long long)info->topology_ofs);
    }
    *patch = p;
    return TL_OK;
}

tl_status tl_store_channel_images(tl_ctx *ctx, const tl_store *store, uint32_t patch_id,
                                  const tl_patch *patch, uint32_t channel, int64_t *images)
{
    const tl_patch_info *info = NULL;
    const tl_codec *codec = NULL;
    bool has_twins = false;
    uint8_t *bytes = NULL;
    size_t byte_count = 0;
    tl_status st = find_patch(ctx, store, patch_id, &info, &has_twins);
    if (!st) st = tl_store_codec(ctx, store, &codec);
    if (st) return st;
    if (patch->vert_count != info->vert_count || patch->tet_count != info->tet_count)
        return tl_fail(ctx, TL_ERR_ARG, "'%s': this is not the topology of patch %u",
                       store->reader.path, patch_id);
    st = tl_store_blob(ctx, store, patch_id, channel, &bytes, &byte_count);
    if (st) return st;
    const tl_store_channel *c = &store->head.channels[channel];
    st = tl_channel_decode(ctx, codec, info->class_, patch, channel, c->on, c->components, bytes,
                           byte_count, images);
    tl_mem_free(ctx, bytes);
    if (st == TL_ERR_ARG) st = TL_ERR_FORMAT; /* tables that do not know this class or channel */
    if (st)
        return tl_note(ctx, st, "'%s': patch %u, channel '%s' at byte %llu", store->reader.path,
                       patch_id, c->name, (unsigned long long)info->channel_ofs[channel]);
    return TL_OK;
}

tl_status tl_store_channel_values(tl_ctx *ctx, const tl_store *store, uint32_t patch_id,
                                  const tl_patch *patch, uint32_t channel, double *values)
{
    tl_status st = TL_OK;
    if (channel >= store->head.channel_count)
        return tl_fail(ctx, TL_ERR_ARG, "'%s': there is no channel %u", store->reader.path,
                       channel);
    const tl_store_channel *c = &store->head.channels[channel];
    const size_t elems = c->on == TL_ON_VERTEX ? patch->vert_count : patch->tet_count;
    int64_t *images = tl_mem_alloc(ctx, elems * c->components, sizeof *images, &st);
    if (st) return st;
    st = tl_store_channel_images(ctx, store, patch_id, patch, channel, images);
    for (size_t i = 0; !st && i < elems * c->components; i++)
        values[i] = tl_value_of(&c->code, images[i]);
    tl_mem_free(ctx, images);
    return st;
}
