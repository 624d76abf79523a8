/* ADF, the older home of CGNS trees: nodes of fixed size that name their children and data by block
 * and offset. Version A writes numbers as hexadecimal text, version B places and dimensions as
 * bytes. Read out of the mapped bytes, so that arrays need no copy; every place is compared with
 * the size of the file. */
#include "formats/formats_cgns.h"

#include <string.h>

/* Sizes of the format. */
#define BLOCK_BYTES 4096
#define NODE_BYTES 246
#define ROOT_PLACE 266
#define PLACE_BYTES 12
#define CHILD_BYTES (32 + PLACE_BYTES)
#define TABLE_HEAD (4 + PLACE_BYTES)
#define FORMAT_AT 100 /* 'L' or 'B' in the head of the file */
#define VERSION_AT 25 /* 'A' or 'B' */

typedef struct adf {
    tli_cg *cg;
    bool binary;     /* version B */
    uint64_t joined; /* bytes of data put together so far: no more than the file has */
} adf;

static tl_status bad(const adf *a, uint64_t place, const char *what)
{
    return tl_fail(a->cg->ctx, TL_ERR_FORMAT, "'%s': ADF node at byte %llu: %s", a->cg->path,
                   (unsigned long long)place, what);
}

static bool inside(const adf *a, uint64_t place, uint64_t bytes)
{
    uint64_t size = a->cg->map->byte_count;
    return place <= size && bytes <= size - place;
}

/* A number in hexadecimal text; UINT64_MAX if it is none. */
static uint64_t hex(const uint8_t *at, unsigned digits)
{
    uint64_t value = 0;
    for (unsigned i = 0; i < digits; i++) {
        uint8_t c = at[i];
        int digit = c >= '0' && c <= '9'   ? c - '0'
                    : c >= 'A' && c <= 'F' ? c - 'A' + 10
                    : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                           : 99;
        if (digit > 15) return UINT64_MAX;
        value = value << 4 | (unsigned)digit;
    }
    return value;
}

static uint64_t bytes_number(const adf *a, const uint8_t *at, unsigned bytes)
{
    uint64_t value = 0;
    for (unsigned i = 0; i < bytes; i++)
        value = value << 8 | at[a->cg->big_endian ? i : bytes - 1 - i];
    return value;
}

/* Byte in the file that a place of block and offset means; UINT64_MAX if there is none. */
static uint64_t place_at(const adf *a, const uint8_t *at)
{
    uint64_t block = a->binary ? bytes_number(a, at, 8) : hex(at, 8);
    uint64_t offset = a->binary ? bytes_number(a, at + 8, 4) : hex(at + 8, 4);
    if (block > UINT64_MAX / BLOCK_BYTES - 1 || offset > BLOCK_BYTES) return UINT64_MAX;
    return block * BLOCK_BYTES + offset;
}

static void copy_name(char name[TLI_CG_NAME], const uint8_t *bytes)
{
    size_t length = 32;
    while (length && (bytes[length - 1] == ' ' || bytes[length - 1] == '\0')) length--;
    memcpy(name, bytes, length);
    name[length] = '\0';
}

/* ---- data ---- */

/* One chunk: its values begin behind its head and end where its head says. */
static bool chunk_at(const adf *a, uint64_t place, const uint8_t **bytes, uint64_t *count)
{
    if (!inside(a, place, TABLE_HEAD)) return false;
    const uint8_t *at = a->cg->map->bytes + place;
    uint64_t end = place_at(a, at + 4);
    if (memcmp(at, "DaTa", 4) != 0 || end < place + TABLE_HEAD || !inside(a, end, 4)) return false;
    *bytes = at + TABLE_HEAD;
    *count = end - (place + TABLE_HEAD);
    return true;
}

/* Several chunks are put together. */
static tl_status join_chunks(adf *a, uint64_t place, uint64_t table, uint64_t chunks,
                             uint64_t wanted, tli_cg_node *node)
{
    tl_status st = TL_OK;
    uint64_t used = 0;
    if (!inside(a, table, TABLE_HEAD) || memcmp(a->cg->map->bytes + table, "DCtb", 4) != 0 ||
        !inside(a, table + TABLE_HEAD, chunks * 2 * PLACE_BYTES))
        return bad(a, place, "its table of data is not in the file");
    if (wanted > a->cg->map->byte_count - a->joined)
        return bad(a, place, "its data are those of other nodes, too");
    a->joined += wanted;
    uint8_t *all = tli_arena_alloc(&a->cg->arena, (size_t)wanted, 1, &st);
    if (st) return st;
    for (uint64_t c = 0; c < chunks && used < wanted; c++) {
        const uint8_t *bytes;
        uint64_t count,
            at = place_at(a, a->cg->map->bytes + table + TABLE_HEAD + c * 2 * PLACE_BYTES);
        if (!chunk_at(a, at, &bytes, &count)) return bad(a, place, "a part of its data is broken");
        if (count > wanted - used) count = wanted - used;
        memcpy(all + used, bytes, (size_t)count);
        used += count;
    }
    if (used < wanted) return bad(a, place, "its data are shorter than its dimensions say");
    node->bytes = all;
    return TL_OK;
}

static tl_status find_data(adf *a, uint64_t place, const uint8_t *head, tli_cg_node *node)
{
    tl_scalar scalar;
    uint64_t chunks = hex(head + 226, 4), at = place_at(a, head + 230), have = 0;
    size_t bytes = tli_cg_value_bytes(node, &scalar);
    if (!chunks || !bytes || !node->count) return TL_OK;
    if (chunks > UINT16_MAX || !inside(a, 0, node->count * bytes))
        return bad(a, place, "more data than the file has room for");
    uint64_t wanted = node->count * bytes;
    if (chunks > 1) return join_chunks(a, place, at, chunks, wanted, node);
    if (!chunk_at(a, at, &node->bytes, &have) || have < wanted) {
        node->bytes = NULL;
        return bad(a, place, "its data are not all in the file");
    }
    return TL_OK;
}

/* ---- nodes ---- */

static tl_status read_head(adf *a, uint64_t place, tli_cg_node *node)
{
    if (!inside(a, place, NODE_BYTES)) return bad(a, place, "lies behind the end of the file");
    const uint8_t *head = a->cg->map->bytes + place;
    if (memcmp(head, "NoDe", 4) != 0 || memcmp(head + 242, "TaiL", 4) != 0)
        return bad(a, place, "there is none");
    copy_name(node->name, head + 4);
    copy_name(node->label, head + 36);
    memcpy(node->type, head + 96, 2);
    uint64_t rank = hex(head + 128, 2);
    if (rank > TLI_CG_RANK_MAX) return bad(a, place, "more than twelve dimensions");
    node->rank = (uint32_t)rank;
    for (uint32_t d = 0; d < node->rank; d++)
        node->dims[d] =
            a->binary ? bytes_number(a, head + 130 + 8 * d, 8) : hex(head + 130 + 8 * d, 8);
    if (!tli_cg_count(node)) return bad(a, place, "dimensions that can't be");
    return find_data(a, place, head, node);
}

static tl_status read_node(adf *a, uint64_t place, unsigned depth, tli_cg_node *parent)
{
    tl_status st = TL_OK;
    tli_cg_node *node = tli_cg_add(a->cg, parent, &st);
    if (!st && depth > TLI_CG_DEPTH_MAX) return bad(a, place, "too many levels below one another");
    if (!st) st = read_head(a, place, node);
    if (st) return st;
    const uint8_t *head = a->cg->map->bytes + place;
    uint64_t children = hex(head + 68, 8), table = place_at(a, head + 84);
    if (strcmp(node->type, "LK") == 0) {
        a->cg->links_left_out++;
        return TL_OK;
    }
    if (children == 0) return TL_OK;
    if (children > TLI_CG_NODES_MAX || !inside(a, table, TABLE_HEAD) ||
        memcmp(a->cg->map->bytes + table, "SNTb", 4) != 0 ||
        !inside(a, table + TABLE_HEAD, children * CHILD_BYTES))
        return bad(a, place, "its table of children is not in the file");
    for (uint64_t c = 0; c < children && !st; c++) {
        const uint8_t *entry = a->cg->map->bytes + table + TABLE_HEAD + c * CHILD_BYTES;
        st = read_node(a, place_at(a, entry + 32), depth + 1, node);
    }
    return st;
}

tl_status tli_adf_open(tli_cg *cg)
{
    adf a = {.cg = cg};
    if (cg->map->byte_count < ROOT_PLACE + NODE_BYTES)
        return tl_fail(cg->ctx, TL_ERR_FORMAT, "'%s': ADF that ends in its head", cg->path);
    const uint8_t *head = cg->map->bytes;
    a.binary = head[VERSION_AT] == 'B';
    cg->big_endian = head[FORMAT_AT] == 'B';
    if ((head[VERSION_AT] != 'A' && !a.binary) ||
        (head[FORMAT_AT] != 'L' && head[FORMAT_AT] != 'B'))
        return tl_fail(cg->ctx, TL_ERR_UNSUPPORTED,
                       "'%s': ADF version '%c' with numbers of kind '%c'; A and B with L and B are "
                       "read",
                       cg->path, head[VERSION_AT], head[FORMAT_AT]);
    return read_node(&a, ROOT_PLACE, 0, NULL);
}
