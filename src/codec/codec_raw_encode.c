/* Patches and channels as plain numbers, for comparison and for whoever decodes nothing. */
#include "codec/codec_channel.h"
#include "codec/codec_raw.h"
#include "codec/codec_tell.h"

tl_status tli_raw_append(tli_bytes *out, const int64_t *values, size_t count, unsigned elem_bytes)
{
    size_t byte_count;
    if (!tli_mul_size(count, elem_bytes, &byte_count)) byte_count = SIZE_MAX;
    tl_status st = tli_bytes_reserve(out, byte_count);
    if (st) return st;
    for (size_t i = 0; i < count; i++)
        for (unsigned b = 0; b < elem_bytes; b++)
            out->bytes[out->count++] = (uint8_t)((uint64_t)values[i] >> 8 * b);
    return TL_OK;
}

static bool fits_i32(const int64_t *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (values[i] < INT32_MIN || values[i] > INT32_MAX) return false;
    return true;
}

static tl_status append_tets(const tl_patch *patch, tli_bytes *out)
{
    tl_status st = TL_OK;
    for (uint32_t t = 0; t < patch->tet_count && !st; t++) {
        int64_t tet[4];
        for (int c = 0; c < 4; c++) tet[c] = patch->tets[t][c];
        st = tli_raw_append(out, tet, 4, 2);
    }
    return st;
}

tl_status tli_topology_encode_raw(tl_ctx *ctx, const tl_patch *patch, tli_bytes *out)
{
    uint8_t head[TOPOLOGY_HEAD_BYTES];
    size_t before = out->count, place_count = 3 * (size_t)patch->vert_count;
    tl_status st = tli_patch_verify(ctx, patch);
    if (st) return st;
    bool wide = !fits_i32(*patch->places, place_count);
    unsigned flags = (patch->regions ? TOPOLOGY_REGIONS : 0) | (wide ? TOPOLOGY_WIDE : 0);
    tli_topology_head(patch, BLOB_RAW, (uint8_t)flags, 0, head);
    st = tli_bytes_append(out, head, sizeof head);
    if (!st) st = append_tets(patch, out);
    if (!st) st = tli_raw_append(out, *patch->places, place_count, wide ? 8 : 4);
    if (!st) st = tli_bytes_append(out, patch->shared, patch->vert_count);
    for (uint32_t t = 0; t < patch->tet_count && patch->regions && !st; t++) {
        int64_t region = patch->regions[t];
        st = tli_raw_append(out, &region, 1, 4);
    }
    if (st) out->count = before;
    return st;
}

tl_status tli_channel_encode_raw(const int64_t *values, uint32_t count, uint32_t components,
                                 tli_bytes *out)
{
    size_t before = out->count, value_count = (size_t)count * components;
    bool wide = !fits_i32(values, value_count);
    const uint8_t head[CHANNEL_HEAD_BYTES] = {BLOB_RAW, wide ? CHANNEL_WIDE : 0};
    tl_status st = tli_bytes_append(out, head, sizeof head);
    if (!st) st = tli_raw_append(out, values, value_count, wide ? 8 : 4);
    if (st) out->count = before;
    return st;
}
