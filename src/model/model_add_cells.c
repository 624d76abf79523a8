/* Which original tet each tet of the finest level is: both have corners at the same originals,
 * whose places tell them whatever the numbers of vertices are, on both sides of a baffle, too. They
 * are joined by a hash of these places, in bins that fit into memory. */
#include <math.h>

#include "base/base_predicates.h"
#include "model/model_add_bins.h"
#include "store/store_format.h"

/* A tet of a patch. */
typedef struct cell {
    uint64_t corners; /* hash of them */
    uint32_t rank, local;
} cell;

/* An original, as tli_record_fill has it. */
typedef struct original {
    uint64_t corners;
    double record[];
} original;

typedef struct joiner {
    tli_adder *a;
    tl_ctx *ctx;
    size_t original_bytes;
    tli_bins cells, originals;
} joiner;

static uint64_t hash_corner(const double xyz[3])
{
    uint8_t bytes[24];
    const double positive[3] = {xyz[0] + 0.0, xyz[1] + 0.0, xyz[2] + 0.0}; /* no -0 */
    memcpy(bytes, positive, sizeof bytes);
    return tli_store_hash(0, bytes, sizeof bytes);
}

/* In whatever order the corners [4] come; they are sorted. */
static uint64_t hash_corners(uint64_t *corners)
{
    uint8_t bytes[32];
    for (size_t i = 1; i < 4; i++)
        for (size_t k = i; k > 0 && corners[k] < corners[k - 1]; k--) {
            uint64_t t = corners[k];
            corners[k] = corners[k - 1];
            corners[k - 1] = t;
        }
    memcpy(bytes, corners, sizeof bytes);
    return tli_store_hash(0, bytes, sizeof bytes);
}

/* ---- tets of the file ---- */

static tl_status deal_patch(joiner *j, uint32_t rank, tli_outbox *out)
{
    tl_patch *p = NULL;
    tli_matches m = {0};
    tl_status st = tl_store_topology(j->ctx, j->a->store, j->a->finest[rank], &p);
    if (!st) st = tli_matches_read(j->ctx, j->a, rank, p, &m);
    uint64_t *corners = tl_mem_alloc(j->ctx, st ? 0 : p->vert_count, sizeof *corners, &st);
    for (uint32_t v = 0; !st && v < p->vert_count; v++)
        corners[v] = hash_corner(tli_match_at(j->a->plan, &m, m.nearest[v])->xyz);
    for (uint32_t t = 0; !st && t < p->tet_count; t++) {
        uint64_t own[4];
        for (int c = 0; c < 4; c++) own[c] = corners[p->tets[t][c]];
        const cell record = {hash_corners(own), rank, t};
        cell *to = tli_outbox_next(out, tli_bin_of(record.corners), &st);
        if (to) *to = record;
    }
    tl_mem_free(j->ctx, corners);
    tli_matches_release(j->ctx, &m);
    tl_patch_destroy(j->ctx, p);
    return st;
}

static tl_status deal_cells(joiner *j)
{
    tli_outbox out;
    tl_status st = tli_outbox_open(j->ctx, &j->cells, &out);
    for (uint32_t rank = 0; !st && rank < j->a->finest_count; rank++) {
        st = deal_patch(j, rank, &out);
        if (!st) st = tl_progress(j->ctx, "cells", rank, 2 * (uint64_t)j->a->finest_count);
    }
    return tli_outbox_close(&out, st);
}

/* ---- originals ---- */

static tl_status deal_originals(joiner *j)
{
    tli_outbox out;
    tl_status st = tli_outbox_open(j->ctx, &j->originals, &out);
    for (uint32_t i = 0; !st && i < tl_segments_count(j->a->segments); i++) {
        tl_segment s;
        st = tl_segments_load(j->ctx, j->a->segments, i, &s);
        if (st) break;
        for (size_t t = 0; !st && t < s.tet_count; t++) {
            uint64_t corners[4];
            for (size_t c = 0; c < 4; c++)
                corners[c] = hash_corner(s.xyz + 3 * (size_t)s.tets[4 * t + c]);
            const uint64_t key = hash_corners(corners);
            original *to = tli_outbox_next(&out, tli_bin_of(key), &st);
            if (!to) break;
            to->corners = key;
            tli_record_fill(j->a->plan, &s, TLI_CELLS, t, NULL, to->record);
        }
        tl_segment_release(j->ctx, &s);
    }
    return tli_outbox_close(&out, st);
}

/* ---- both ---- */

static tl_status other_mesh(const joiner *j, const original *from)
{
    return tl_fail(j->ctx, TL_ERR_DATA,
                   "the tet around %.9g %.9g %.9g is none of the model: another mesh",
                   from->record[0], from->record[1], from->record[2]);
}

/* Tets with the same corners, as in meshes that have one twice, are taken one after another. As
 * many tets are in the file as there are originals: if each original finds one, all are found. */
static tl_status join_bin(joiner *j, uint32_t bin, tli_outbox *out)
{
    tli_sorted_bin o = {0}, c = {0};
    tl_status st = tli_bin_sort(j->ctx, &j->originals, bin, &o);
    if (!st) st = tli_bin_sort(j->ctx, &j->cells, bin, &c);
    for (size_t i = 0, k = 0; !st && i < o.count; i++, k++) {
        const original *from = (const void *)(o.records + (size_t)o.order[i] * j->original_bytes);
        while (k < c.count && c.keys[k] < o.keys[i]) k++;
        if (k == c.count || c.keys[k] != o.keys[i]) {
            st = other_mesh(j, from);
            break;
        }
        const cell *found = (const cell *)(const void *)c.records + c.order[k];
        tli_cell_match *to = tli_outbox_next(out, found->rank, &st);
        if (!to) break;
        to->local = found->local;
        memcpy(to->record, from->record, j->original_bytes - sizeof *from);
    }
    tli_bin_release(j->ctx, &c);
    tli_bin_release(j->ctx, &o);
    return st;
}

tl_status tli_adder_match_cells(tli_adder *a)
{
    joiner j = {.a = a,
                .ctx = a->ctx,
                .original_bytes = sizeof(original) + (4 + a->plan->tet_comps) * sizeof(double)};
    tl_status st = TL_OK;
    tli_outbox out;
    const char *folder = a->plan->opts.folder;
    if (!a->plan->tet_comps) return TL_OK;
    st = tli_bins_open(a->ctx, folder, sizeof(cell), TLI_ADD_BINS, &j.cells);
    if (!st) st = tli_bins_open(a->ctx, folder, j.original_bytes, TLI_ADD_BINS, &j.originals);
    if (!st)
        st = tli_bins_open(a->ctx, folder, tli_cell_match_bytes(a->plan), a->finest_count,
                           &a->cells);
    if (!st) st = deal_cells(&j);
    if (!st) st = deal_originals(&j);
    if (!st) {
        st = tli_outbox_open(a->ctx, &a->cells, &out);
        for (uint32_t bin = 0; !st && bin < TLI_ADD_BINS; bin++) {
            st = join_bin(&j, bin, &out);
            if (!st) st = tl_progress(a->ctx, "cells", TLI_ADD_BINS + bin, 2 * TLI_ADD_BINS);
        }
        st = tli_outbox_close(&out, st);
    }
    tli_bins_close(&j.originals);
    tli_bins_close(&j.cells);
    return st;
}
