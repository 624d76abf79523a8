/* One vertex for each edge that is cut, however many pieces of work have found it: the edges are
 * dealt out to parts by hash, each part finds equal ones in a table that stays in the cache, and
 * the first of equal ones, in the order of the edges, gets the next number. No step depends on the
 * number of threads. */
#include <string.h>

#include "extract/extract.h"

enum {
    CHUNK_PIECES = 16, /* pieces that are dealt out as one */
    PART_EDGES = 8192, /* in a part, about */
    PART_BITS_MAX = 12
};

typedef struct job {
    tl_ctx *ctx;
    const tli_cut_edges *edges;
    uint32_t *numbers;
    unsigned part_bits;
    size_t chunk_count;
    uint32_t *places;     /* [chunk_count][parts] counts, then where the next one goes */
    uint32_t *begins;     /* [parts + 1] */
    uint32_t *order;      /* edges, part after part, rising in each */
    uint32_t *firsts;     /* [piece_count] edges of a piece that are the first, then their start */
    tli_cut_edge *unique; /* those edges */
} job;

static size_t part_of(const job *j, const tli_cut_edge *e)
{
    return tli_edge_hash(e->verts, e->level) >> (64 - j->part_bits);
}

/* Calls nothing for pieces that are not there. */
static size_t chunk_end(const job *j, size_t chunk)
{
    size_t end = (chunk + 1) * CHUNK_PIECES;
    return end < j->edges->piece_count ? end : j->edges->piece_count;
}

static tl_status count_chunks(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t c = begin; c < end; c++) {
        uint32_t *row = j->places + (c << j->part_bits);
        for (size_t p = c * CHUNK_PIECES; p < chunk_end(j, c); p++)
            for (size_t i = 0; i < j->edges->counts[p]; i++)
                row[part_of(j, &j->edges->edges[j->edges->starts[p] + i])]++;
    }
    return TL_OK;
}

static void place_parts(job *j)
{
    size_t parts = (size_t)1 << j->part_bits;
    uint32_t next = 0;
    for (size_t part = 0; part < parts; part++) {
        j->begins[part] = next;
        for (size_t c = 0; c < j->chunk_count; c++) {
            uint32_t count = j->places[(c << j->part_bits) + part];
            j->places[(c << j->part_bits) + part] = next;
            next += count;
        }
    }
    j->begins[parts] = next;
}

static tl_status deal_chunks(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t c = begin; c < end; c++) {
        uint32_t *row = j->places + (c << j->part_bits);
        for (size_t p = c * CHUNK_PIECES; p < chunk_end(j, c); p++)
            for (size_t i = 0; i < j->edges->counts[p]; i++) {
                size_t e = j->edges->starts[p] + i;
                j->order[row[part_of(j, &j->edges->edges[e])]++] = (uint32_t)e;
            }
    }
    return TL_OK;
}

/* numbers of each edge of a part: the first edge that is equal to it. */
static tl_status join_part(const job *j, size_t part)
{
    tl_status st = TL_OK;
    const tli_cut_edge *edges = j->edges->edges;
    size_t begin = j->begins[part], count = j->begins[part + 1] - begin, mask = 15;
    while (mask < 2 * count) mask = 2 * mask + 1;
    uint32_t *slots = tl_mem_alloc(j->ctx, mask + 1, sizeof *slots, &st);
    if (st) return st;
    memset(slots, 0xff, (mask + 1) * sizeof *slots);
    for (size_t i = begin; i < begin + count; i++) {
        uint32_t e = j->order[i];
        size_t at = tli_edge_hash(edges[e].verts, edges[e].level) & mask;
        while (slots[at] != TL_NONE && (edges[slots[at]].verts != edges[e].verts ||
                                        edges[slots[at]].level != edges[e].level))
            at = (at + 1) & mask;
        if (slots[at] == TL_NONE) slots[at] = e;
        j->numbers[e] = slots[at];
    }
    tl_mem_free(j->ctx, slots);
    return TL_OK;
}

static tl_status join_parts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    tl_status st = TL_OK;
    for (size_t part = begin; !st && part < end; part++) st = join_part(arg, part);
    return st;
}

static tl_status count_firsts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t p = begin; p < end; p++) {
        uint32_t firsts = 0;
        for (size_t i = 0; i < j->edges->counts[p]; i++) {
            size_t e = j->edges->starts[p] + i;
            firsts += j->numbers[e] == e;
        }
        j->firsts[p] = firsts;
    }
    return TL_OK;
}

/* Puts the vertices of first edges into order, for number_others to read. */
static tl_status number_firsts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t p = begin; p < end; p++) {
        uint32_t next = j->firsts[p];
        for (size_t i = 0; i < j->edges->counts[p]; i++) {
            size_t e = j->edges->starts[p] + i;
            if (j->numbers[e] != e) continue;
            j->unique[next] = j->edges->edges[e];
            j->order[e] = next++;
        }
    }
    return TL_OK;
}

static tl_status number_others(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t p = begin; p < end; p++)
        for (size_t i = 0; i < j->edges->counts[p]; i++) {
            size_t e = j->edges->starts[p] + i;
            j->numbers[e] = j->order[j->numbers[e]];
        }
    return TL_OK;
}

static size_t number_all(job *j)
{
    uint32_t next = 0;
    for (size_t p = 0; p < j->edges->piece_count; p++) {
        uint32_t firsts = j->firsts[p];
        j->firsts[p] = next;
        next += firsts;
    }
    return next;
}

tl_status tli_weld_edges(tl_ctx *ctx, const tli_cut_edges *edges, uint32_t *numbers,
                         tli_cut_edge **unique, size_t *vert_count)
{
    tl_status st = TL_OK;
    size_t room = edges->starts[edges->piece_count], total = 0;
    for (size_t p = 0; p < edges->piece_count; p++) total += edges->counts[p];
    job j = {.ctx = ctx,
             .edges = edges,
             .numbers = numbers,
             .part_bits = 1,
             .chunk_count = (edges->piece_count + CHUNK_PIECES - 1) / CHUNK_PIECES};
    while (j.part_bits < PART_BITS_MAX && total >> j.part_bits > PART_EDGES) j.part_bits++;
    size_t parts = (size_t)1 << j.part_bits, piece_count = edges->piece_count;
    j.places = tl_mem_zalloc(ctx, j.chunk_count << j.part_bits, sizeof *j.places, &st);
    j.begins = tl_mem_alloc(ctx, parts + 1, sizeof *j.begins, &st);
    j.order = tl_mem_alloc(ctx, room, sizeof *j.order, &st);
    j.firsts = tl_mem_alloc(ctx, piece_count, sizeof *j.firsts, &st);
    if (!st) st = tli_parallel(ctx, j.chunk_count, 1, count_chunks, &j);
    if (!st) place_parts(&j);
    if (!st) st = tli_parallel(ctx, j.chunk_count, 1, deal_chunks, &j);
    if (!st) st = tli_parallel(ctx, parts, 1, join_parts, &j);
    if (!st) st = tli_parallel(ctx, piece_count, CHUNK_PIECES, count_firsts, &j);
    size_t verts = st ? 0 : number_all(&j);
    j.unique = tl_mem_alloc(ctx, verts, sizeof *j.unique, &st);
    if (!st) st = tli_parallel(ctx, piece_count, CHUNK_PIECES, number_firsts, &j);
    if (!st) st = tli_parallel(ctx, piece_count, CHUNK_PIECES, number_others, &j);
    if (st) {
        tl_mem_free(ctx, j.unique);
    } else {
        *unique = j.unique;
        *vert_count = verts;
    }
    tl_mem_free(ctx, j.firsts);
    tl_mem_free(ctx, j.order);
    tl_mem_free(ctx, j.begins);
    tl_mem_free(ctx, j.places);
    return st;
}
