/* Fortran binary: the bytes of C binary in records, each between two copies of its length. They are
 * put behind each other again, and read as C binary. */
#include "formats/formats_ensight.h"

#include <string.h>

enum { MARK_BYTES = 4 };

static uint32_t mark_at(const uint8_t *bytes, bool big_endian)
{
    uint32_t mark = 0;
    for (int i = 0; i < MARK_BYTES; i++)
        mark |= (uint32_t)bytes[i] << (big_endian ? 24 - 8 * i : 8 * i);
    return mark;
}

/* Copies what the records hold to joined [room], or counts it (NULL). */
static tl_status join(tl_ctx *ctx, const char *path, const tli_map *map, bool big_endian,
                      uint8_t *joined, uint64_t *count)
{
    *count = 0;
    for (uint64_t at = 0; at < map->byte_count;) {
        uint64_t left = map->byte_count - at, length = 0;
        if (left >= MARK_BYTES) length = mark_at(map->bytes + at, big_endian);
        if (left < 2 * MARK_BYTES || length > left - 2 * MARK_BYTES)
            return tl_fail(ctx, TL_ERR_FORMAT,
                           "'%s': byte %llu: a Fortran record of %llu bytes, %llu are left", path,
                           (unsigned long long)at, (unsigned long long)length,
                           (unsigned long long)left);
        uint32_t behind = mark_at(map->bytes + at + MARK_BYTES + length, big_endian);
        if (behind != length)
            return tl_fail(ctx, TL_ERR_FORMAT,
                           "'%s': byte %llu: a Fortran record of %llu bytes ends with %u", path,
                           (unsigned long long)at, (unsigned long long)length, behind);
        if (joined) memcpy(joined + *count, map->bytes + at + MARK_BYTES, (size_t)length);
        *count += length;
        at += length + (uint64_t)2 * MARK_BYTES;
    }
    return TL_OK;
}

tl_status tli_ensight_join_records(tl_ctx *ctx, const char *path, tli_map *map)
{
    uint64_t count;
    bool big_endian =
        map->byte_count >= MARK_BYTES && mark_at(map->bytes, true) == TLI_ENSIGHT_LINE;
    tl_status st = join(ctx, path, map, big_endian, NULL, &count);
    uint8_t *joined = tl_mem_alloc(ctx, (size_t)count, 1, &st);
    if (st) return st;
    join(ctx, path, map, big_endian, joined, &count);
    tli_map_close(ctx, map);
    *map = (tli_map){joined, count, joined};
    return TL_OK;
}
