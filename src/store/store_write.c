/* Writes a .tlod file front to back: room for the head, then groups of blobs with a page of the
 * index behind as many of them as fill one, and the head at the end, over the room. What is kept in
 * memory is one page and the channel blobs of one group. */
#include <math.h>

#include "store/store_write.h"

/* A page of the index is closed when it has as much; larger in models that would have too many. */
#define PAGE_BYTES ((uint64_t)64 << 10)
#define PAGES_AIM 256
/* Root patches in one group: their channel blobs are held until the group ends. */
#define ROOT_GROUP_MAX 128
/* Least room for the first page, beside that for one patch. */
#define FIRST_PAGE_BYTES 4096u

/* ---- beginning ---- */

static tl_status make_codes(tli_store_writer *w, const tl_store_head *head)
{
    tl_status st = TL_OK;
    const uint32_t count = head->channel_count;
    w->codes = tli_arena_alloc(&w->arena, count, sizeof *w->codes, &st);
    w->error_tables =
        tli_arena_alloc(&w->arena, ((size_t)count + 1) * TLI_CODE8_COUNT, sizeof(double), &st);
    w->channel_bytes = tli_arena_alloc(&w->arena, count, sizeof *w->channel_bytes, &st);
    w->level_end = tli_arena_alloc(&w->arena, head->level_count, sizeof *w->level_end, &st);
    if (st) return st;
    tli_sphere_grid_make(head->stats.bounds, head->stats.diagonal, &w->spheres);
    for (uint32_t c = 0; c <= count; c++) {
        int unit = w->spheres.unit;
        if (c < count) {
            const tl_store_channel *channel = &head->channels[c];
            const double *range = channel->range;
            /* of vectors both may have the largest norm and point in opposite directions */
            double most = channel->components > 1 ? 2 * range[1] : range[1] - range[0];
            if (!(most + channel->codec_error > 0)) most = fabs(range[1]);
            unit = tli_unit_above(most + channel->codec_error);
            w->codes[c].error_unit = unit;
            tli_range_grid_make(range, channel->codec_error, &w->codes[c].range);
            w->channel_bytes[c] = 0;
        }
        for (unsigned code = 0; code < TLI_CODE8_COUNT; code++)
            w->error_tables[c * TLI_CODE8_COUNT + code] = tli_code8_value(code, unit);
    }
    for (uint32_t l = head->level_count, end = 0; l-- > 0;)
        w->level_end[l] = end += head->levels[l].segment_count;
    return TL_OK;
}

/* How large head, first page and pages become. */
static tl_status plan(tli_store_writer *w, const tl_store_head *head)
{
    tl_status st = TL_OK;
    const uint64_t all =
        tli_page_bound(head->segment_count, head->patch_count, head->channel_count);
    const uint64_t one = tli_page_bound(0, 1, head->channel_count) + TLI_PAGE_HEAD_BYTES;
    const uint64_t whole = tli_store_align(all + TLI_PAGE_HEAD_BYTES);
    w->page_target = (size_t)(all / PAGES_AIM > PAGE_BYTES ? all / PAGES_AIM : PAGE_BYTES);
    uint64_t pages = 3 + all / w->page_target + head->root_patch_count / ROOT_GROUP_MAX;
    uint64_t head_bytes = tli_head_bytes(head, w->codec.byte_count, 1);
    if (head_bytes + whole <= TLI_STORE_FIRST_BYTES && head->root_patch_count <= ROOT_GROUP_MAX)
        pages = 1;
    head_bytes = tli_head_bytes(head, w->codec.byte_count, (uint32_t)pages);
    uint64_t room = tli_store_align(one + FIRST_PAGE_BYTES);
    if (head_bytes + room < TLI_STORE_FIRST_BYTES) room = TLI_STORE_FIRST_BYTES - head_bytes;
    if (room > whole) room = whole;
    if (head_bytes > TLI_STORE_HEAD_BYTES_MAX)
        return tl_fail(w->ctx, TL_ERR_UNSUPPORTED,
                       "the head of the file would have %llu bytes; at most %llu can be read",
                       (unsigned long long)head_bytes,
                       (unsigned long long)TLI_STORE_HEAD_BYTES_MAX);
    w->first_page_room = (size_t)room;
    w->page_max = (uint32_t)pages;
    w->reserved_bytes = head_bytes + room;
    w->pages = tli_arena_alloc(&w->arena, w->page_max, sizeof *w->pages, &st);
    return st;
}

/* Of a new model: what its blobs can't be read without. */
static uint64_t make_identity(const tl_store_head *head, tli_blob codec)
{
    uint8_t bytes[64], *at = bytes;
    tli_put(&at, head->lattice.kind, 4);
    tli_put(&at, (uint64_t)(int64_t)head->lattice.exponent, 4);
    for (int k = 0; k < 3; k++) tli_put(&at, (uint64_t)head->lattice.origin[k], 8);
    tli_put(&at, head->segment_count, 4);
    tli_put(&at, head->patch_count, 4);
    tli_put(&at, head->input_tets, 8);
    tli_put(&at, head->input_verts, 8);
    uint64_t hash = tli_store_hash(0, bytes, (size_t)(at - bytes));
    hash = tli_store_hash(hash, codec.bytes, codec.byte_count);
    return hash ? hash : 1;
}

static tl_status write_zeros(tli_sink *sink, uint64_t byte_count)
{
    static const uint8_t zeros[4096];
    tl_status st = TL_OK;
    while (!st && byte_count) {
        size_t piece = byte_count < sizeof zeros ? (size_t)byte_count : sizeof zeros;
        st = tli_sink_write(sink, zeros, piece);
        byte_count -= piece;
    }
    return st;
}

static tl_status begin(tli_store_writer *w, const char *path, const tl_store_head *head,
                       tli_blob codec, uint64_t identity)
{
    tl_status st = tli_head_examine(w->ctx, head);
    if (st) return st;
    w->head = *head;
    w->head.identity = identity ? identity : make_identity(head, codec);
    w->head.levels = NULL; /* the caller's, gone after this call; the counts stay */
    w->head.channels = NULL;
    w->head.regions = NULL;
    w->head.cells = NULL;
    w->group = tli_arena_alloc(&w->arena, head->channel_count, sizeof *w->group, &st);
    for (uint32_t c = 0; !st && c < head->channel_count; c++) tli_bytes_open(w->ctx, &w->group[c]);
    uint8_t *kept = tli_arena_alloc(&w->arena, codec.byte_count, 1, &st);
    if (st) return st;
    if (codec.byte_count) memcpy(kept, codec.bytes, codec.byte_count);
    w->codec = (tli_blob){kept, codec.byte_count};
    st = make_codes(w, head);
    if (!st) st = plan(w, head);
    if (!st) st = tli_sink_open(w->ctx, path, &w->sink);
    if (!st) st = write_zeros(w->sink, w->reserved_bytes);
    w->draft.payload_ofs = w->draft.now.payload_end = w->reserved_bytes;
    return st;
}

static void release(tli_store_writer *w)
{
    tl_ctx *ctx = w->ctx;
    for (uint32_t c = 0; w->group && c < w->head.channel_count; c++) tli_bytes_close(&w->group[c]);
    tli_bytes_close(&w->scratch);
    tli_bytes_close(&w->first_page);
    tli_draft_close(&w->draft);
    tli_arena_close(&w->arena);
    tl_mem_free(ctx, w);
}

tl_status tli_store_begin(tl_ctx *ctx, const char *path, const tl_store_head *head, tli_blob codec,
                          uint64_t identity, tli_store_writer **writer)
{
    tl_status st = TL_OK;
    *writer = NULL;
    tli_store_writer *w = tl_mem_zalloc(ctx, 1, sizeof *w, &st);
    if (st) return st;
    w->ctx = ctx;
    w->group_level = TL_NONE;
    tli_arena_open(ctx, &w->arena);
    tli_bytes_open(ctx, &w->scratch);
    tli_bytes_open(ctx, &w->first_page);
    tli_draft_open(ctx, &w->draft);
    st = begin(w, path, head, codec, identity);
    if (!st) {
        *writer = w;
        return TL_OK;
    }
    (void)tli_sink_close(w->sink, false); /* nothing is lost that was wanted */
    release(w);
    return tl_note(ctx, st, "while beginning '%s'", path);
}

/* ---- pages ---- */

/* Ends the page at a mark. The first one waits for the head; the others are written at once. */
static tl_status close_page(tli_store_writer *w, const tli_page_mark *mark)
{
    tl_status st = TL_OK;
    TL_ASSERT(w->page_count < w->page_max);
    tli_page_entry *entry = &w->pages[w->page_count];
    tli_bytes *page = w->page_count ? &w->scratch : &w->first_page;
    *entry = (tli_page_entry){.payload_ofs = w->draft.payload_ofs,
                              .first_segment = w->draft.first_segment,
                              .first_patch = w->draft.first_patch};
    if (tli_draft_bytes(mark) > TLI_STORE_PAGE_BYTES_MAX)
        return tl_fail(w->ctx, TL_ERR_UNSUPPORTED,
                       "segment %u: its patches take %llu bytes of the index, at most %llu can be "
                       "read",
                       w->next_segment, (unsigned long long)tli_draft_bytes(mark),
                       (unsigned long long)TLI_STORE_PAGE_BYTES_MAX);
    st = tli_draft_pack(&w->draft, mark, page);
    if (st) return st;
    entry->page_bytes = (uint32_t)page->count;
    entry->hash = tli_store_hash(tli_store_seed(w->head.identity, TLI_PART_PAGE, w->page_count, 0),
                                 page->bytes, page->count);
    if (w->page_count++) {
        entry->page_ofs = tli_sink_tell(w->sink);
        st = tli_sink_write(w->sink, page->bytes, page->count);
        w->draft.payload_ofs = w->draft.now.payload_end = tli_sink_tell(w->sink);
    }
    return st;
}

/* A group is complete: closes the page before it, or with it, when that has become full. */
static tl_status group_done(tli_store_writer *w)
{
    tli_page_draft *draft = &w->draft;
    tl_status st = TL_OK;
    if (!w->page_count && tli_draft_bytes(&draft->now) > w->first_page_room)
        st = close_page(w, &draft->whole);
    draft->whole = draft->now;
    if (!st && w->page_count && tli_draft_bytes(&draft->now) >= w->page_target)
        st = close_page(w, &draft->whole);
    return st;
}

/* ---- blobs ---- */

/* Appends padding and checksum to what stands in buffer behind begin. */
static tl_status seal(tli_store_writer *w, tli_bytes *buffer, size_t begin, uint32_t channel)
{
    const size_t byte_count = buffer->count - begin;
    const size_t padding = (size_t)tli_store_align(byte_count) - byte_count;
    tl_status st = tli_bytes_reserve(buffer, padding + TLI_STORE_HASH_BYTES);
    if (st) return st;
    uint64_t seed = tli_store_seed(w->head.identity, TLI_PART_BLOB, w->next_patch, channel);
    uint64_t hash = tli_store_hash(seed, buffer->bytes + begin, byte_count);
    uint8_t *at = buffer->bytes + buffer->count;
    memset(at, 0, padding);
    at += padding;
    tli_put(&at, hash, TLI_STORE_HASH_BYTES);
    buffer->count += padding + TLI_STORE_HASH_BYTES;
    return TL_OK;
}

static tl_status append_twins(tli_bytes *buffer, const tli_twin *twins, size_t twin_count)
{
    tl_status st = tli_bytes_reserve(buffer, twin_count * TLI_TWIN_BYTES + 2);
    if (st) return st;
    uint8_t *at = buffer->bytes + buffer->count;
    for (size_t i = 0; i < twin_count; i++) {
        tli_put(&at, twins[i].vert, 2);
        tli_put(&at, twins[i].twin, 1);
    }
    tli_put(&at, twin_count, 2);
    buffer->count += twin_count * TLI_TWIN_BYTES + 2;
    return TL_OK;
}

static tl_status write_topology(tli_store_writer *w, tli_blob topology, const tli_twin *twins,
                                size_t twin_count, uint32_t *byte_count)
{
    w->scratch.count = 0;
    tl_status st = tli_bytes_append(&w->scratch, topology.bytes, topology.byte_count);
    if (!st && twin_count) st = append_twins(&w->scratch, twins, twin_count);
    *byte_count = (uint32_t)w->scratch.count;
    w->topology_bytes += w->scratch.count;
    if (!st) st = seal(w, &w->scratch, 0, TL_TOPOLOGY);
    if (!st) st = tli_sink_write(w->sink, w->scratch.bytes, w->scratch.count);
    return st;
}

/* Writes the channel blobs that the group has gathered. */
static tl_status write_channels(tli_store_writer *w)
{
    tl_status st = TL_OK;
    for (uint32_t c = 0; !st && c < w->head.channel_count; c++) {
        st = tli_sink_write(w->sink, w->group[c].bytes, w->group[c].count);
        w->group[c].count = 0;
    }
    w->draft.now.payload_end = tli_sink_tell(w->sink);
    w->group_first = w->next_patch;
    w->group_level = TL_NONE;
    return st;
}

/* ---- patches ---- */

/* Level of a segment, from the counts of the head. */
static uint32_t level_of(const tli_store_writer *w, uint32_t segment)
{
    uint32_t level = w->head.level_count - 1;
    while (level && segment >= w->level_end[level]) level--;
    return level;
}

static tl_status examine_patch(const tli_store_writer *w, const tl_patch_info *info,
                               tli_blob topology, const tli_blob *channels, const tli_twin *twins,
                               size_t twin_count)
{
    const uint32_t id = w->next_patch, producer = info->producer;
    const bool root = id < w->head.root_patch_count;
    const char *wrong = NULL;
    if (id >= w->head.patch_count)
        wrong = "is one too many";
    else if (!root && w->next_segment >= w->head.segment_count)
        wrong = "has no segment to follow it";
    else if (info->level >= w->head.level_count)
        wrong = "has a level that is none";
    else if (!info->tet_count || info->tet_count > TL_PATCH_TETS_MAX)
        wrong = "has too few or too many tets";
    else if (!info->vert_count || info->vert_count > TL_PATCH_VERTS_MAX)
        wrong = "has too few or too many vertices";
    else if (info->class_ > UINT8_MAX)
        wrong = "has a class that is none";
    else if (producer != TL_NONE && producer >= w->head.segment_count)
        wrong = "has a producer that is none";
    else if (producer != TL_NONE && !root && producer <= w->next_segment)
        wrong = "has a producer that is not finer than its consumer";
    else if (producer != TL_NONE && level_of(w, producer) >= info->level)
        wrong = "is not coarser than its producer";
    else if (w->group_level != TL_NONE && !root && info->level != w->group_level)
        wrong = "has another level than the one before it";
    else if (topology.byte_count > TLI_STORE_BLOB_BYTES_MAX - TLI_TWIN_BYTES * UINT16_MAX)
        wrong = "has a topology blob that is too large";
    else if (twin_count > info->vert_count)
        wrong = "has more twins than vertices";
    for (uint32_t c = 0; !wrong && c < w->head.channel_count; c++)
        if (channels[c].byte_count > TLI_STORE_BLOB_BYTES_MAX)
            wrong = "has a channel blob that is too large";
    for (size_t i = 0; !wrong && i < twin_count; i++)
        if (!twins[i].twin || twins[i].vert >= info->vert_count ||
            (i && twins[i].vert <= twins[i - 1].vert))
            wrong = "has twins that are zero, out of range or not ascending";
    return wrong ? tl_fail(w->ctx, TL_ERR_ARG, "patch %u %s", id, wrong) : TL_OK;
}

/* Before a root patch: ends the group and the page where they are full. */
static tl_status make_room_for_root(tli_store_writer *w)
{
    const uint64_t more = tli_page_bound(0, 1, w->head.channel_count);
    const uint64_t room = w->page_count ? w->page_target : w->first_page_room;
    if (!w->draft.now.patch_count) return TL_OK;
    if (tli_draft_bytes(&w->draft.now) + more <= room && w->draft.now.patch_count < ROOT_GROUP_MAX)
        return TL_OK;
    tl_status st = write_channels(w);
    return st ? st : close_page(w, &w->draft.now);
}

static tl_status add_patch(tli_store_writer *w, const tl_patch_info *info, tli_blob topology,
                           const tli_blob *channels, const tli_twin *twins, size_t twin_count)
{
    const bool root = w->next_patch < w->head.root_patch_count;
    uint32_t topology_bytes = 0;
    tl_status st = examine_patch(w, info, topology, channels, twins, twin_count);
    if (!st && root) st = make_room_for_root(w);
    if (!st) st = write_topology(w, topology, twins, twin_count, &topology_bytes);
    for (uint32_t c = 0; !st && c < w->head.channel_count; c++) {
        tli_bytes *group = &w->group[c];
        const size_t begin = group->count;
        st = tli_bytes_append(group, channels[c].bytes, channels[c].byte_count);
        if (!st) st = seal(w, group, begin, c);
        w->channel_bytes[c] += channels[c].byte_count;
    }
    if (!st)
        st = tli_draft_patch(w, info, twin_count ? TLI_PATCH_HAS_TWINS : 0, topology_bytes,
                             channels);
    if (st) return st;
    w->group_level = info->level;
    if (++w->next_patch != w->head.root_patch_count) return TL_OK;
    st = write_channels(w);
    return st ? st : group_done(w);
}

tl_status tli_store_add_patch(tli_store_writer *writer, const tl_patch_info *info,
                              tli_blob topology, const tli_blob *channels, const tli_twin *twins,
                              size_t twin_count)
{
    if (writer->status)
        return tl_fail(writer->ctx, writer->status, "an earlier part could not be written");
    writer->status = add_patch(writer, info, topology, channels, twins, twin_count);
    return writer->status;
}

/* ---- segments ---- */

static tl_status examine_segment(const tli_store_writer *w, const tl_segment_info *info)
{
    const uint32_t id = w->next_segment;
    const char *wrong = NULL;
    if (id >= w->head.segment_count)
        wrong = "is one too many";
    else if (w->next_patch < w->head.root_patch_count)
        wrong = "comes before the root patches";
    else if (info->level != level_of(w, id))
        wrong = "has another level than the counts of the head say";
    else if (info->first_patch != w->group_first || !info->patch_count ||
             info->patch_count != w->next_patch - w->group_first)
        wrong = "has other input patches than were added";
    else if (w->group_level != info->level)
        wrong = "has input patches of another level";
    else if (!info->output_count)
        wrong = "has no output";
    for (uint32_t i = 0; !wrong && i < info->output_count; i++)
        if (info->outputs[i] >= w->group_first || (i && info->outputs[i] <= info->outputs[i - 1]))
            wrong = "has outputs that are not coarser or not ascending";
    return wrong ? tl_fail(w->ctx, TL_ERR_ARG, "segment %u %s", id, wrong) : TL_OK;
}

static tl_status add_segment(tli_store_writer *w, const tl_segment_info *info)
{
    tl_status st = examine_segment(w, info);
    if (!st) st = write_channels(w);
    if (!st) st = tli_draft_segment(w, info);
    if (st) return st;
    w->next_segment++;
    return group_done(w);
}

tl_status tli_store_add_segment(tli_store_writer *writer, const tl_segment_info *info)
{
    if (writer->status)
        return tl_fail(writer->ctx, writer->status, "an earlier part could not be written");
    writer->status = add_segment(writer, info);
    return writer->status;
}

/* ---- the end ---- */

static bool same_plan(const tl_store_head *a, const tl_store_head *b)
{
    return a->level_count == b->level_count && a->segment_count == b->segment_count &&
           a->patch_count == b->patch_count && a->root_patch_count == b->root_patch_count &&
           a->channel_count == b->channel_count && a->cell_kind_count == b->cell_kind_count &&
           a->regions_listed == b->regions_listed;
}

/* Head and first page over the room that was left for them. */
static tl_status write_head(tli_store_writer *w, const tl_store_head *head)
{
    tl_status st = tli_head_examine(w->ctx, head);
    if (st) return st;
    const uint64_t bytes = tli_head_bytes(head, w->codec.byte_count, w->page_count);
    if (!same_plan(head, &w->head) || bytes + w->first_page.count > w->reserved_bytes)
        return tl_fail(w->ctx, TL_ERR_ARG,
                       "counts or names of the head have changed since the file was begun");
    w->pages[0].page_ofs = bytes;
    w->scratch.count = 0;
    st = tli_bytes_reserve(&w->scratch, (size_t)bytes);
    if (st) return st;
    tli_head_pack(w, head, tli_sink_tell(w->sink), w->scratch.bytes);
    st = tli_sink_patch(w->sink, 0, w->scratch.bytes, (size_t)bytes);
    if (!st) st = tli_sink_patch(w->sink, bytes, w->first_page.bytes, w->first_page.count);
    return st;
}

static tl_status complete(tli_store_writer *w, const tl_store_head *head)
{
    tl_status st = TL_OK;
    if (w->next_patch != w->head.patch_count || w->next_segment != w->head.segment_count)
        return tl_fail(w->ctx, TL_ERR_ARG, "%u of %u patches and %u of %u segments were added",
                       w->next_patch, w->head.patch_count, w->next_segment, w->head.segment_count);
    if (w->draft.now.patch_count) st = close_page(w, &w->draft.now);
    return st ? st : write_head(w, head);
}

tl_status tli_store_finish(tli_store_writer *writer, const tl_store_head *head, bool commit)
{
    if (!writer) return TL_OK;
    tl_ctx *ctx = writer->ctx;
    tl_status st = TL_OK;
    if (commit && writer->status)
        st = tl_fail(ctx, writer->status, "an earlier part could not be written");
    if (commit && !head) st = tl_fail(ctx, TL_ERR_ARG, "a file can't be completed without a head");
    if (commit && !st) st = complete(writer, head);
    tl_status end = tli_sink_close(writer->sink, commit && !st);
    release(writer);
    return st ? st : end;
}
