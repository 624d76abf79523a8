/* Numbers that a file gives its points or cells, to indices: a table where they are dense, else a
 * sorted list. */
#include "formats/formats_ids.h"

#include "base/base_sort.h"

/* A table may have that many entries an id. */
#define TABLE_GROWTH_MAX 4u

static tl_status make_table(const uint64_t *ids, uint64_t count, uint64_t high, tli_ids *map)
{
    tl_status st = TL_OK;
    map->table_count = count ? high - map->low + 1 : 0;
    map->indices = tl_mem_alloc(map->ctx, (size_t)map->table_count, sizeof *map->indices, &st);
    if (st) return st;
    for (uint64_t i = 0; i < map->table_count; i++) map->indices[i] = TL_NONE;
    for (uint64_t i = count; i-- > 0;) map->indices[ids[i] - map->low] = (uint32_t)i;
    return TL_OK;
}

tl_status tli_ids_create(tl_ctx *ctx, uint64_t *ids, uint64_t count, tli_ids *map)
{
    tl_status st = TL_OK;
    uint64_t low = UINT64_MAX, high = 0;
    *map = (tli_ids){.ctx = ctx};
    for (uint64_t i = 0; i < count; i++) {
        if (ids[i] < low) low = ids[i];
        if (ids[i] > high) high = ids[i];
    }
    map->low = low;
    if (count >= TL_NONE) {
        st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "%llu points or cells, at most %u",
                     (unsigned long long)count, TL_NONE - 1);
    } else if (count == 0 || high - low < TABLE_GROWTH_MAX * count) {
        st = make_table(ids, count, high, map);
    } else {
        map->indices = tl_mem_alloc(ctx, (size_t)count, sizeof *map->indices, &st);
        for (uint64_t i = 0; !st && i < count; i++) map->indices[i] = (uint32_t)i;
        if (!st) st = tli_sort_u64(ctx, ids, map->indices, (size_t)count);
        map->sorted_count = count;
        if (!st) {
            map->sorted = ids;
            return TL_OK;
        }
    }
    tl_mem_free(ctx, ids);
    if (st) tli_ids_release(map);
    return st;
}

void tli_ids_release(tli_ids *map)
{
    tl_mem_free(map->ctx, map->indices);
    tl_mem_free(map->ctx, map->sorted);
    *map = (tli_ids){.ctx = map->ctx};
}

uint32_t tli_ids_find(const tli_ids *map, uint64_t id)
{
    if (!map->sorted)
        return id - map->low < map->table_count ? map->indices[id - map->low] : TL_NONE;
    uint64_t begin = 0, end = map->sorted_count;
    while (begin < end) { /* the first that is not below id */
        uint64_t middle = begin + (end - begin) / 2;
        if (map->sorted[middle] < id)
            begin = middle + 1;
        else
            end = middle;
    }
    return begin < map->sorted_count && map->sorted[begin] == id ? map->indices[begin] : TL_NONE;
}
