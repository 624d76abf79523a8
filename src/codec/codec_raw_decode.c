/* Plain numbers back to patches and channels. */
#include "codec/codec_channel.h"
#include "codec/codec_match.h"
#include "codec/codec_read.h"
#include "codec/codec_topology.h"

#include <string.h>

static size_t raw_bytes(const tl_patch *patch, unsigned flags)
{
    size_t per_vertex = 1 + 3 * (flags & TOPOLOGY_WIDE ? 8 : 4);
    size_t per_tet = 8 + (flags & TOPOLOGY_REGIONS ? 4 : 0);
    return TOPOLOGY_HEAD_BYTES + per_vertex * patch->vert_count + per_tet * patch->tet_count;
}

static const char *fill(const uint8_t *at, unsigned flags, tl_patch *patch)
{
    unsigned place_bytes = flags & TOPOLOGY_WIDE ? 8 : 4;
    uint16_t *tets = *patch->tets;
    int64_t *places = *patch->places;
    for (size_t i = 0; i < 4 * (size_t)patch->tet_count; i++) {
        tets[i] = (uint16_t)((unsigned)at[2 * i] | (unsigned)at[2 * i + 1] << 8);
        if (tets[i] >= patch->vert_count) return "names a vertex that is not there";
    }
    at += 8 * (size_t)patch->tet_count;
    for (size_t i = 0; i < 3 * (size_t)patch->vert_count; i++)
        places[i] = read_raw(at, i, place_bytes);
    at += 3 * (size_t)place_bytes * patch->vert_count;
    for (size_t v = 0; v < patch->vert_count; v++, at++) {
        if (*at > 1) return "has a shared flag that is neither 0 nor 1";
        patch->shared[v] = *at;
    }
    for (size_t t = 0; t < patch->tet_count && patch->regions; t++)
        patch->regions[t] = (int32_t)read_raw(at, t, 4);
    return NULL;
}

tl_status tli_topology_read_raw(tl_ctx *ctx, const uint8_t *bytes, size_t byte_count,
                                unsigned flags, tl_patch *patch, const char **wrong)
{
    tl_status st = TL_OK;
    tl_lidx *opposite = NULL;
    if (byte_count != raw_bytes(patch, flags)) {
        *wrong = "has another size than its head says";
        return TL_OK;
    }
    patch->tets = tl_mem_alloc(ctx, patch->tet_count, sizeof *patch->tets, &st);
    patch->places = tl_mem_alloc(ctx, patch->vert_count, sizeof *patch->places, &st);
    patch->shared = tl_mem_alloc(ctx, patch->vert_count, 1, &st);
    if (flags & TOPOLOGY_REGIONS)
        patch->regions = tl_mem_alloc(ctx, patch->tet_count, sizeof *patch->regions, &st);
    if (!st) *wrong = fill(bytes + TOPOLOGY_HEAD_BYTES, flags, patch);
    if (!st && !*wrong) st = tli_patch_match(ctx, patch, &opposite);
    patch->opposite = (uint32_t(*)[4])(void *)opposite;
    return st;
}

const char *tli_channel_read_raw(const uint8_t *bytes, size_t byte_count, size_t value_count,
                                 int64_t *values)
{
    unsigned value_bytes = bytes[1] == CHANNEL_WIDE ? 8 : 4;
    if (bytes[1] & ~CHANNEL_WIDE) return "has unknown flags";
    if ((byte_count - CHANNEL_HEAD_BYTES) % value_bytes ||
        (byte_count - CHANNEL_HEAD_BYTES) / value_bytes != value_count)
        return "has another size than its values";
    for (size_t i = 0; i < value_count; i++)
        values[i] = read_raw(bytes + CHANNEL_HEAD_BYTES, i, value_bytes);
    return NULL;
}
