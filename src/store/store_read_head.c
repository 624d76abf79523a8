/* The head from bytes. Its checksum is right, so what is wrong here was written wrong, or by a
 * forger: every count is compared with the bytes that are left before it is used. */
#include <math.h>

#include "mesh/mesh_tree.h" /* tli_float_above, tli_float_below */
#include "store/store_read.h"

/* Bytes not yet taken, and the first thing that was wrong. */
typedef struct head_cursor {
    const uint8_t *at, *end;
    const char *wrong;
} head_cursor;

/* True if count records of that size are there. */
static bool has_room(head_cursor *cursor, uint64_t count, uint64_t record_bytes)
{
    const uint64_t left = (uint64_t)(cursor->end - cursor->at);
    if (!cursor->wrong && record_bytes && count > left / record_bytes)
        cursor->wrong = "counts that its bytes do not bear";
    return !cursor->wrong;
}

static void demand(head_cursor *cursor, bool condition, const char *what)
{
    if (!condition && !cursor->wrong) cursor->wrong = what;
}

static bool is_range(const double range[2])
{
    return isfinite(range[0]) && isfinite(range[1]) && range[0] <= range[1];
}

static bool is_unit(int unit)
{
    return unit >= TLI_UNIT_MIN && unit <= TLI_UNIT_MAX + 24;
}

/* ---- the fixed part ---- */

static size_t take_size(const uint8_t **at)
{
    uint64_t count = tli_take(at, 8);
    return count < SIZE_MAX ? (size_t)count : SIZE_MAX;
}

static void take_stats(const uint8_t **at, tl_mesh_stats *s)
{
    for (int i = 0; i < 6; i++) s->bounds[i] = tli_take_f64(at);
    s->diagonal = tli_take_f64(at);
    s->volume = tli_take_f64(at);
    s->boundary_area = tli_take_f64(at);
    s->quality_min = tli_take_f64(at);
    s->quality_median = tli_take_f64(at);
    s->dihedral_min = tli_take_f64(at);
    s->dihedral_max = tli_take_f64(at);
    s->inverted = take_size(at);
    s->degenerate = take_size(at);
    s->nonfinite_verts = take_size(at);
    s->unused_verts = take_size(at);
    s->duplicate_verts = take_size(at);
    s->boundary_triangles = take_size(at);
    s->interface_triangles = take_size(at);
    s->components = take_size(at);
    s->nonmanifold_faces = take_size(at);
    s->nonmanifold_edges = take_size(at);
    s->nonmanifold_verts = take_size(at);
}

static void take_fixed(head_cursor *cursor, tl_store *store, uint32_t *codec_bytes)
{
    tl_store_head *head = &store->head;
    const uint8_t **at = &cursor->at;
    *at += TLI_STORE_MAGIC_BYTES + 8; /* version and flags are known to be right */
    head->file_bytes = tli_take(at, 8);
    store->head_bytes = tli_take(at, 8);
    head->identity = tli_take(at, 8);
    head->level_count = tli_take_u32(at);
    head->segment_count = tli_take_u32(at);
    head->patch_count = tli_take_u32(at);
    head->root_patch_count = tli_take_u32(at);
    head->channel_count = tli_take_u32(at);
    store->page_count = tli_take_u32(at);
    *codec_bytes = tli_take_u32(at);
    head->regions_listed = tli_take_u32(at);
    head->cell_kind_count = tli_take_u32(at);
    demand(cursor, tli_take_u32(at) == 0, "a reserved byte that is not zero");
    const uint32_t kind = tli_take_u32(at);
    demand(cursor, kind <= TL_PLACE_FLOAT64, "a kind of places that is none");
    head->lattice.kind = (tl_place_kind)kind;
    head->lattice.exponent = tli_take_i32(at);
    for (int k = 0; k < 3; k++) head->lattice.origin[k] = tli_take_i64(at);
    head->input_tets = tli_take(at, 8);
    head->input_verts = tli_take(at, 8);
    take_stats(at, &head->stats);
    head->time = tli_take_f64(at);
    head->position_error = tli_take_f64(at);
    head->border_share = tli_take_f64(at);
    head->connectivity_bits = tli_take_f64(at);
    head->place_bits = tli_take_f64(at);
    head->flag_bits = tli_take_f64(at);
    head->region_bits = tli_take_f64(at);
    head->region_count = tli_take(at, 8);
    head->topology_bytes = tli_take(at, 8);
    for (int k = 0; k < 3; k++) store->spheres.lo[k] = tli_take_f64(at);
    store->spheres.step = tli_take_f64(at);
    store->spheres.unit = tli_take_i32(at);
    demand(cursor, tli_take_u32(at) == 0, "a reserved byte that is not zero");
}

static void check_fixed(head_cursor *cursor, const tl_store *store)
{
    const tl_store_head *head = &store->head;
    const tli_sphere_grid *grid = &store->spheres;
    demand(cursor, head->lattice.exponent >= -1000 && head->lattice.exponent <= 1000,
           "a lattice whose unit is out of range");
    for (int k = 0; k < 3; k++) {
        const int64_t origin = head->lattice.origin[k];
        demand(cursor, origin >= -((int64_t)1 << 52) && origin <= (int64_t)1 << 52,
               "a lattice whose origin is out of range");
        demand(cursor, is_range(head->stats.bounds + 2 * k), "bounds that are none");
        demand(cursor, isfinite(grid->lo[k]), "a grid of centres that is none");
    }
    demand(cursor, isfinite(head->stats.diagonal) && head->stats.diagonal >= 0,
           "a diagonal that is none");
    demand(cursor, isfinite(grid->step) && grid->step > 0 && is_unit(grid->unit),
           "a grid of centres that is none");
    demand(cursor, head->level_count >= 1 && head->level_count <= TL_STORE_LEVELS_MAX,
           "too few or too many levels");
    demand(cursor, head->channel_count <= TL_STORE_CHANNELS_MAX, "too many channels");
    demand(cursor, head->cell_kind_count <= TL_STORE_CELL_KINDS_MAX, "too many kinds of cells");
    demand(cursor,
           head->regions_listed <= TLI_STORE_REGIONS_MAX &&
               head->regions_listed <= head->region_count,
           "too many regions");
    demand(cursor,
           head->root_patch_count >= 1 && head->root_patch_count <= head->patch_count &&
               head->patch_count < TL_NONE && head->segment_count < TL_NONE,
           "no root patches or too many patches");
    demand(cursor,
           head->segment_count <= head->patch_count - head->root_patch_count &&
               (head->segment_count || head->root_patch_count == head->patch_count),
           "more segments than patches they could take up");
}

/* ---- the tables ---- */

/* A text of the head with a terminator; NULL and a failure where it holds a zero byte. */
static const char *take_text(head_cursor *cursor, tl_store *store, uint32_t byte_count,
                             tl_status *st)
{
    demand(cursor, !byte_count || !memchr(cursor->at, 0, byte_count), "a name with a zero byte");
    char *text = tli_arena_alloc(&store->arena, (size_t)byte_count + 1, 1, st);
    if (*st) return NULL;
    if (byte_count) memcpy(text, cursor->at, byte_count);
    text[byte_count] = 0;
    cursor->at += byte_count;
    return text;
}

static void take_zeros(head_cursor *cursor, uint64_t byte_count)
{
    for (uint64_t i = 0; i < byte_count; i++)
        demand(cursor, tli_take(&cursor->at, 1) == 0, "padding that is not zero");
}

static tl_status take_region(head_cursor *cursor, tl_store *store, tl_store_region *region)
{
    tl_status st = TL_OK;
    if (!has_room(cursor, 1, TLI_HEAD_REGION_BYTES)) return TL_OK;
    region->id = tli_take_i64(&cursor->at);
    region->tets = tli_take(&cursor->at, 8);
    const uint32_t name_bytes = tli_take_u32(&cursor->at);
    demand(cursor, tli_take_u32(&cursor->at) == 0, "a reserved byte that is not zero");
    demand(cursor, name_bytes <= TLI_STORE_NAME_BYTES_MAX, "a name of a length that can't be");
    const uint64_t padding = tli_store_align(name_bytes) - name_bytes; /* the record is aligned */
    if (!has_room(cursor, name_bytes + padding, 1)) return TL_OK;
    region->name = take_text(cursor, store, name_bytes, &st);
    if (!st) take_zeros(cursor, padding);
    return st;
}

static tl_status take_lists(head_cursor *cursor, tl_store *store)
{
    tl_store_head *head = &store->head;
    tl_status st = TL_OK;
    if (!has_room(cursor, head->cell_kind_count, 8)) return TL_OK;
    uint64_t *cells = tli_arena_alloc(&store->arena, head->cell_kind_count, sizeof *cells, &st);
    for (uint32_t i = 0; !st && i < head->cell_kind_count; i++) cells[i] = tli_take(&cursor->at, 8);
    if (st || !has_room(cursor, head->regions_listed, TLI_HEAD_REGION_BYTES)) return st;
    tl_store_region *regions =
        tli_arena_alloc(&store->arena, head->regions_listed, sizeof *regions, &st);
    for (uint32_t i = 0; !st && !cursor->wrong && i < head->regions_listed; i++)
        st = take_region(cursor, store, &regions[i]);
    head->cells = cells;
    head->regions = regions;
    return st;
}

static tl_status take_levels(head_cursor *cursor, tl_store *store)
{
    tl_store_head *head = &store->head;
    const uint32_t channels = head->channel_count, count = head->level_count;
    const uint64_t each = TLI_HEAD_LEVEL_BYTES + TLI_HEAD_LEVEL_EACH_BYTES * (uint64_t)channels;
    uint64_t patches = 0, segments = 0;
    tl_status st = TL_OK;
    if (!has_room(cursor, count, each)) return TL_OK;
    tl_store_level *levels = tli_arena_alloc(&store->arena, count, sizeof *levels, &st);
    double *errors = tli_arena_alloc(&store->arena, (size_t)count * channels, sizeof *errors, &st);
    store->level_end = tli_arena_alloc(&store->arena, count, sizeof *store->level_end, &st);
    if (st) return st;
    for (uint32_t l = 0; l < count; l++) {
        tl_store_level *level = &levels[l];
        level->tets = tli_take(&cursor->at, 8);
        level->verts = tli_take(&cursor->at, 8);
        level->patch_count = tli_take_u32(&cursor->at);
        level->segment_count = tli_take_u32(&cursor->at);
        level->boundary_error = tli_take_f64(&cursor->at);
        level->max_error = errors;
        for (uint32_t c = 0; c < channels; c++) *errors++ = tli_take_f64(&cursor->at);
        patches += level->patch_count;
        segments += level->segment_count;
    }
    demand(cursor, patches == head->patch_count && segments == head->segment_count,
           "levels whose counts do not add up");
    for (uint32_t l = count, end = 0; !cursor->wrong && l-- > 0;)
        store->level_end[l] = end += levels[l].segment_count;
    head->levels = levels;
    return TL_OK;
}

static tl_status take_names(head_cursor *cursor, tl_store *store, tl_store_channel *channel,
                            uint32_t name_bytes, uint32_t unit_bytes)
{
    tl_status st = TL_OK;
    const uint64_t text_bytes = (uint64_t)name_bytes + unit_bytes;
    const uint64_t padding =
        tli_store_align(TLI_HEAD_CHANNEL_BYTES + text_bytes) - TLI_HEAD_CHANNEL_BYTES - text_bytes;
    demand(cursor,
           name_bytes >= 1 && name_bytes <= TLI_STORE_NAME_BYTES_MAX &&
               unit_bytes <= TLI_STORE_NAME_BYTES_MAX,
           "a name of a length that can't be");
    if (!has_room(cursor, text_bytes + padding, 1)) return TL_OK;
    channel->name = take_text(cursor, store, name_bytes, &st);
    if (!st) channel->unit = take_text(cursor, store, unit_bytes, &st);
    if (!st) take_zeros(cursor, padding);
    return st;
}

static tl_status take_channel(head_cursor *cursor, tl_store *store, tl_store_channel *channel,
                              tli_channel_codes *codes)
{
    const uint8_t **at = &cursor->at;
    if (!has_room(cursor, 1, TLI_HEAD_CHANNEL_BYTES)) return TL_OK;
    const uint32_t name_bytes = tli_take_u32(at), unit_bytes = tli_take_u32(at);
    channel->components = tli_take_u32(at);
    const unsigned on = (unsigned)tli_take(at, 1), scalar = (unsigned)tli_take(at, 1);
    const unsigned kind = (unsigned)tli_take(at, 1);
    demand(cursor, tli_take(at, 1) == 0, "a reserved byte that is not zero");
    channel->on = (tl_on)on;
    channel->scalar = (tl_scalar)scalar;
    channel->code.kind = (tl_value_kind)kind;
    channel->code.step = tli_take_f64(at);
    channel->range[0] = tli_take_f64(at);
    channel->range[1] = tli_take_f64(at);
    channel->codec_error = tli_take_f64(at);
    channel->time = tli_take_f64(at);
    channel->nonfinite_count = tli_take(at, 8);
    channel->bytes = tli_take(at, 8);
    codes->error_unit = tli_take_i32(at);
    const uint32_t step = tli_take_u32(at);
    channel->has_step = step > 0;
    channel->step = step > 0 ? step - 1 : 0;
    codes->range.lo = tli_take_f64(at);
    codes->range.step = tli_take_f64(at);
    demand(cursor, channel->components >= 1 && channel->components <= TLI_STORE_COMPONENTS_MAX,
           "a channel with too few or too many components");
    demand(cursor, on <= TL_ON_TET && scalar <= TL_F64 && kind <= TL_VALUE_INTEGER,
           "a channel of a kind that is none");
    demand(cursor,
           kind != TL_VALUE_LATTICE || (isfinite(channel->code.step) && channel->code.step > 0),
           "a channel with a step that is none");
    demand(cursor, is_range(channel->range) && channel->codec_error >= 0,
           "a channel with a range or codec error that is none");
    demand(cursor,
           isfinite(codes->range.lo) && isfinite(codes->range.step) && codes->range.step > 0 &&
               is_unit(codes->error_unit),
           "a channel with a grid that is none");
    return take_names(cursor, store, channel, name_bytes, unit_bytes);
}

static tl_status take_channels(head_cursor *cursor, tl_store *store)
{
    tl_status st = TL_OK;
    const uint32_t count = store->head.channel_count;
    if (!has_room(cursor, count, TLI_HEAD_CHANNEL_BYTES)) return TL_OK;
    tl_store_channel *channels = tli_arena_alloc(&store->arena, count, sizeof *channels, &st);
    store->codes = tli_arena_alloc(&store->arena, count, sizeof *store->codes, &st);
    float *tables =
        tli_arena_alloc(&store->arena, ((size_t)count + 1) * TLI_CODE8_COUNT, sizeof *tables, &st);
    for (uint32_t c = 0; !st && !cursor->wrong && c < count; c++)
        st = take_channel(cursor, store, &channels[c], &store->codes[c]);
    if (st || cursor->wrong) return st;
    store->head.channels = channels;
    store->error_tables = tables;
    for (uint32_t c = 0; c <= count; c++) {
        const int unit = c < count ? store->codes[c].error_unit : store->spheres.unit;
        for (unsigned code = 0; code < TLI_CODE8_COUNT; code++)
            *tables++ = tli_float_above(tli_code8_value(code, unit));
    }
    return TL_OK;
}

static tl_status take_codec(head_cursor *cursor, tl_store *store, uint32_t byte_count)
{
    tl_status st = TL_OK;
    if (!has_room(cursor, tli_store_align(byte_count), 1)) return TL_OK;
    uint8_t *bytes = tli_arena_alloc(&store->arena, byte_count, 1, &st);
    if (st) return st;
    if (byte_count) memcpy(bytes, cursor->at, byte_count);
    cursor->at += byte_count;
    take_zeros(cursor, tli_store_align(byte_count) - byte_count);
    store->codec = (tli_blob){bytes, byte_count};
    return TL_OK;
}

/* ---- pages ---- */

/* Pages and payloads follow one another to the end of the file, without gap. */
static void check_pages(head_cursor *cursor, const tl_store *store)
{
    const uint64_t file_bytes = store->head.file_bytes;
    const tli_page_entry *pages = store->pages;
    uint64_t end = store->head_bytes; /* of what was looked at */
    for (uint32_t p = 0; !cursor->wrong && p < store->page_count; p++) {
        const tli_page_entry *page = &pages[p];
        const uint64_t begin = p ? page->payload_ofs : page->page_ofs;
        demand(cursor, p == 1 ? begin >= pages[0].payload_ofs : begin == end,
               "pages that overlap or leave a gap");
        demand(cursor,
               page->payload_ofs % TLI_STORE_ALIGN == 0 && page->page_ofs % TLI_STORE_ALIGN == 0 &&
                   page->page_bytes % TLI_STORE_ALIGN == 0,
               "pages that are not aligned");
        demand(cursor,
               page->page_bytes >= TLI_PAGE_HEAD_BYTES &&
                   page->page_bytes <= TLI_STORE_PAGE_BYTES_MAX && page->page_ofs <= file_bytes &&
                   page->page_bytes <= file_bytes - page->page_ofs &&
                   page->payload_ofs <= file_bytes,
               "a page outside of the file");
        end = page->page_ofs + page->page_bytes;
        demand(cursor, p ? page->payload_ofs <= page->page_ofs : page->payload_ofs >= end,
               "a page in the place of its payload");
        if (p)
            demand(cursor,
                   page->first_patch > page[-1].first_patch &&
                       page->first_segment >= page[-1].first_segment,
                   "pages that are not in order");
        else
            demand(cursor, !page->first_patch && !page->first_segment,
                   "no page for its first patch");
        demand(cursor,
               page->first_patch < store->head.patch_count &&
                   page->first_segment <= store->head.segment_count,
               "a page for patches that are none");
    }
    demand(cursor, store->page_count == 1 || end == file_bytes, "bytes behind its last page");
}

static tl_status take_pages(head_cursor *cursor, tl_store *store)
{
    tl_status st = TL_OK;
    demand(cursor, store->page_count >= 1, "no pages");
    if (!has_room(cursor, store->page_count, TLI_HEAD_PAGE_BYTES)) return TL_OK;
    store->pages = tli_arena_alloc(&store->arena, store->page_count, sizeof *store->pages, &st);
    if (st) return st;
    for (uint32_t p = 0; p < store->page_count; p++) {
        tli_page_entry *page = &store->pages[p];
        page->payload_ofs = tli_take(&cursor->at, 8);
        page->page_ofs = tli_take(&cursor->at, 8);
        page->hash = tli_take(&cursor->at, 8);
        page->page_bytes = tli_take_u32(&cursor->at);
        page->first_segment = tli_take_u32(&cursor->at);
        page->first_patch = tli_take_u32(&cursor->at);
        demand(cursor, tli_take_u32(&cursor->at) == 0, "a reserved byte that is not zero");
    }
    check_pages(cursor, store);
    return TL_OK;
}

tl_status tli_head_unpack(tl_ctx *ctx, tl_store *store, const uint8_t *bytes, size_t byte_count)
{
    head_cursor cursor = {.at = bytes, .end = bytes + byte_count};
    uint32_t codec_bytes = 0;
    tl_status st = TL_OK;
    take_fixed(&cursor, store, &codec_bytes);
    check_fixed(&cursor, store);
    if (!cursor.wrong) st = take_lists(&cursor, store);
    if (!st && !cursor.wrong) st = take_levels(&cursor, store);
    if (!st && !cursor.wrong) st = take_channels(&cursor, store);
    if (!st && !cursor.wrong) st = take_codec(&cursor, store, codec_bytes);
    if (!st && !cursor.wrong) st = take_pages(&cursor, store);
    demand(&cursor, st || cursor.at == cursor.end, "bytes behind its last page entry");
    if (!st && cursor.wrong)
        st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': its head has %s", store->reader.path, cursor.wrong);
    return st;
}
