/* What a stage has made, as a VTU that other programs open: a piece for each segment of the input
 * or for each patch of a level, with its number and, above the finest level, that of the segment
 * that made it. */
#include <stdio.h>

#include "formats/formats_pieces.h"
#include "model/model_work.h"

static tl_status close_view(tl_ctx *ctx, tli_pieces *pieces, tl_status st, char *path)
{
    st = tli_pieces_close(pieces, st);
    if (st && path) st = tl_note(ctx, st, "while writing '%s'", path);
    tl_mem_free(ctx, path);
    return st;
}

/* ---- segments of the input ---- */

static tl_status put_segment(tl_ctx *ctx, const tl_segments *segments, uint32_t number,
                             tli_pieces *pieces)
{
    tl_segment s;
    tl_status st = tl_segments_load(ctx, segments, number, &s);
    if (st) return st;
    tl_lidx *tets = tl_mem_alloc(ctx, s.tet_count, 4 * sizeof *tets, &st);
    for (size_t i = 0; !st && i < 4 * (size_t)s.tet_count; i++) tets[i] = s.tets[i];
    const tli_pieces_mesh mesh = {.xyz = s.xyz,
                                  .tets = tets,
                                  .vert_rows = s.values,
                                  .tet_rows = s.tet_values,
                                  .regions = s.regions,
                                  .labels = {number}};
    if (!st) st = tli_pieces_put(pieces, &mesh);
    tl_mem_free(ctx, tets);
    tl_segment_release(ctx, &s);
    return st;
}

tl_status tli_view_segments(const tli_work *work, const tl_segments *segments)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = work->ctx;
    tli_pieces *pieces = NULL;
    const uint32_t count = tl_segments_count(segments);
    const size_t channel_count = tl_segments_channel_count(segments);
    char *path = tli_work_path(work, "segments.vtu", &st);
    tli_pieces_size *sizes = tl_mem_alloc(ctx, count, sizeof *sizes, &st);
    tli_pieces_channel *channels = tl_mem_alloc(ctx, channel_count, sizeof *channels, &st);
    for (uint32_t i = 0; !st && i < count; i++) {
        const tl_segment_summary s = tl_segments_info(segments, i);
        sizes[i] = (tli_pieces_size){s.vert_count, s.tet_count};
    }
    for (size_t c = 0; !st && c < channel_count; c++) {
        const tl_segment_channel *from = tl_segments_channel(segments, c);
        channels[c] = (tli_pieces_channel){from->name, from->components, from->on};
    }
    const tli_pieces_shape shape = {.sizes = sizes,
                                    .piece_count = count,
                                    .channels = channels,
                                    .channel_count = channel_count,
                                    .labels = {"segment"},
                                    .has_regions = tl_segments_has_regions(segments)};
    if (!st) st = tli_pieces_open(ctx, path, &shape, &pieces);
    for (uint32_t i = 0; !st && i < count; i++) st = put_segment(ctx, segments, i, pieces);
    st = close_view(ctx, pieces, st, path);
    tl_mem_free(ctx, channels);
    tl_mem_free(ctx, sizes);
    return st;
}

/* ---- patches of a level ---- */

static tl_status put_patch(const tli_model *m, size_t number, tli_pieces *pieces)
{
    const tli_patch_note *note = &m->patches[number];
    tli_bundle b = {0};
    tl_status st =
        tli_bundle_create(m->ctx, m->plan, note->vert_count, note->tet_count, note->level > 0, &b);
    if (!st) st = tli_depot_get(m->ctx, m->meshes, note->ofs, b.block, b.bytes);
    const tli_pieces_mesh mesh = {.xyz = b.xyz,
                                  .tets = b.tets,
                                  .vert_rows = b.values,
                                  .tet_rows = b.tet_values,
                                  .regions = b.regions,
                                  .labels = {(uint32_t)number, note->producer}};
    if (!st) st = tli_pieces_put(pieces, &mesh);
    tli_bundle_release(m->ctx, &b);
    return st;
}

/* Channels in the order of their components among all on the same elements. */
static void list_fields(const tli_plan *plan, tli_pieces_channel *channels)
{
    for (size_t i = 0; i < plan->field_count; i++) {
        const tli_field *f = &plan->fields[i];
        channels[i] = (tli_pieces_channel){f->key, f->components, f->on};
    }
}

tl_status tli_view_level(const tli_model *m, uint32_t level)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = m->ctx;
    tli_pieces *pieces = NULL;
    char name[32];
    size_t first = 0, end;
    while (first < m->patch_count && m->patches[first].level < level) first++;
    for (end = first; end < m->patch_count && m->patches[end].level == level;) end++;
    snprintf(name, sizeof name, "level_%u.vtu", level);
    char *path = tli_work_path(m->work, name, &st);
    tli_pieces_size *sizes = tl_mem_alloc(ctx, end - first, sizeof *sizes, &st);
    tli_pieces_channel *channels = tl_mem_alloc(ctx, m->plan->field_count, sizeof *channels, &st);
    for (size_t p = first; !st && p < end; p++)
        sizes[p - first] = (tli_pieces_size){m->patches[p].vert_count, m->patches[p].tet_count};
    if (!st) list_fields(m->plan, channels);
    const tli_pieces_shape shape = {.sizes = sizes,
                                    .piece_count = end - first,
                                    .channels = channels,
                                    .channel_count = m->plan->field_count,
                                    .labels = {"patch", level ? "segment" : NULL},
                                    .has_regions = m->plan->has_regions};
    if (!st) st = tli_pieces_open(ctx, path, &shape, &pieces);
    for (size_t p = first; !st && p < end; p++) st = put_patch(m, p, pieces);
    st = close_view(ctx, pieces, st, path);
    tl_mem_free(ctx, channels);
    tl_mem_free(ctx, sizes);
    return st;
}
