/* The head of a file: what opening tells, and where the pages are. */
#include <math.h>

#include "store/store_write.h"

/* ---- proving ---- */

static const char *name_of(const tl_store_region *region)
{
    return region->name ? region->name : "";
}

static const char *wrong_channel(const tl_store_channel *channel)
{
    if (!channel->name || !*channel->name || !channel->unit) return "has no name or unit";
    if (strlen(channel->name) > TLI_STORE_NAME_BYTES_MAX ||
        strlen(channel->unit) > TLI_STORE_NAME_BYTES_MAX)
        return "has a name or unit that is too long";
    if (!channel->components || channel->components > TLI_STORE_COMPONENTS_MAX)
        return "has too few or too many components";
    if (!isfinite(channel->range[0]) || !(channel->range[0] <= channel->range[1]) ||
        !isfinite(channel->range[1]))
        return "has no range";
    if (channel->has_step && channel->step == TL_NONE) return "has a step that is too late";
    if (!(channel->codec_error >= 0)) return "has a codec error that is none";
    return NULL;
}

static bool has_box(const tl_mesh_stats *stats)
{
    for (int k = 0; k < 3; k++)
        if (!isfinite(stats->bounds[2 * k]) ||
            !(stats->bounds[2 * k] <= stats->bounds[2 * k + 1]) ||
            !isfinite(stats->bounds[2 * k + 1]))
            return false;
    return isfinite(stats->diagonal) && stats->diagonal >= 0;
}

tl_status tli_head_examine(tl_ctx *ctx, const tl_store_head *head)
{
    const char *wrong = NULL;
    uint64_t segments = 0, patches = 0;
    for (uint32_t l = 0; l < head->level_count && l < TL_STORE_LEVELS_MAX; l++) {
        segments += head->levels[l].segment_count;
        patches += head->levels[l].patch_count;
    }
    if (!head->level_count || head->level_count > TL_STORE_LEVELS_MAX)
        wrong = "it has too few or too many levels";
    else if (segments != head->segment_count || patches != head->patch_count)
        wrong = "the counts of its levels do not add up";
    else if (!head->root_patch_count || head->root_patch_count > head->patch_count ||
             head->patch_count == TL_NONE || head->segment_count == TL_NONE)
        wrong = "it has no root patches or too many patches";
    else if (!head->segment_count && head->root_patch_count != head->patch_count)
        wrong = "it has patches that are no roots, and no segments";
    else if (head->channel_count > TL_STORE_CHANNELS_MAX)
        wrong = "it has too many channels";
    else if (head->cell_kind_count > TL_STORE_CELL_KINDS_MAX ||
             head->regions_listed > TLI_STORE_REGIONS_MAX ||
             head->regions_listed > head->region_count)
        wrong = "it lists too many kinds of cells or regions";
    else if (!has_box(&head->stats))
        wrong = "it has no finite bounds";
    for (uint32_t i = 0; !wrong && i < head->regions_listed; i++)
        if (strlen(name_of(&head->regions[i])) > TLI_STORE_NAME_BYTES_MAX)
            wrong = "it has a region with a name that is too long";
    if (wrong) return tl_fail(ctx, TL_ERR_ARG, "the model can't be stored: %s", wrong);
    for (uint32_t c = 0; c < head->channel_count; c++) {
        wrong = wrong_channel(&head->channels[c]);
        if (wrong) return tl_fail(ctx, TL_ERR_ARG, "channel %u can't be stored: it %s", c, wrong);
    }
    return TL_OK;
}

/* ---- packing ---- */

static uint64_t region_bytes(const tl_store_region *region)
{
    return tli_store_align(TLI_HEAD_REGION_BYTES + strlen(name_of(region)));
}

static uint64_t channel_bytes(const tl_store_channel *channel)
{
    return tli_store_align(TLI_HEAD_CHANNEL_BYTES + strlen(channel->name) + strlen(channel->unit));
}

uint64_t tli_head_bytes(const tl_store_head *head, size_t codec_bytes, uint32_t page_count)
{
    uint64_t bytes = TLI_HEAD_FIXED_BYTES + 8 * (uint64_t)head->cell_kind_count;
    for (uint32_t i = 0; i < head->regions_listed; i++) bytes += region_bytes(&head->regions[i]);
    bytes += head->level_count *
             (TLI_HEAD_LEVEL_BYTES + TLI_HEAD_LEVEL_EACH_BYTES * (uint64_t)head->channel_count);
    for (uint32_t c = 0; c < head->channel_count; c++) bytes += channel_bytes(&head->channels[c]);
    return bytes + tli_store_align(codec_bytes) + TLI_HEAD_PAGE_BYTES * (uint64_t)page_count +
           TLI_STORE_HASH_BYTES;
}

/* Counts of the measure are size_t; what is not known stays so. */
static void put_size(uint8_t **at, size_t count)
{
    tli_put(at, count == SIZE_MAX ? TL_STORE_UNKNOWN : count, 8);
}

static void put_stats(uint8_t **at, const tl_mesh_stats *s)
{
    for (int i = 0; i < 6; i++) tli_put_f64(at, s->bounds[i]);
    tli_put_f64(at, s->diagonal);
    tli_put_f64(at, s->volume);
    tli_put_f64(at, s->boundary_area);
    tli_put_f64(at, s->quality_min);
    tli_put_f64(at, s->quality_median);
    tli_put_f64(at, s->dihedral_min);
    tli_put_f64(at, s->dihedral_max);
    put_size(at, s->inverted);
    put_size(at, s->degenerate);
    put_size(at, s->nonfinite_verts);
    put_size(at, s->unused_verts);
    put_size(at, s->duplicate_verts);
    put_size(at, s->boundary_triangles);
    put_size(at, s->interface_triangles);
    put_size(at, s->components);
    put_size(at, s->nonmanifold_faces);
    put_size(at, s->nonmanifold_edges);
    put_size(at, s->nonmanifold_verts);
}

static void put_fixed(uint8_t **at, const tli_store_writer *w, const tl_store_head *head,
                      uint64_t file_bytes)
{
    memcpy(*at, TLI_STORE_MAGIC, TLI_STORE_MAGIC_BYTES);
    *at += TLI_STORE_MAGIC_BYTES;
    tli_put(at, TL_STORE_VERSION, 4);
    tli_put(at, 0, 4); /* flags */
    tli_put(at, file_bytes, 8);
    tli_put(at, tli_head_bytes(head, w->codec.byte_count, w->page_count), 8);
    tli_put(at, w->head.identity, 8);
    tli_put(at, head->level_count, 4);
    tli_put(at, head->segment_count, 4);
    tli_put(at, head->patch_count, 4);
    tli_put(at, head->root_patch_count, 4);
    tli_put(at, head->channel_count, 4);
    tli_put(at, w->page_count, 4);
    tli_put(at, w->codec.byte_count, 4);
    tli_put(at, head->regions_listed, 4);
    tli_put(at, head->cell_kind_count, 4);
    tli_put(at, 0, 4);
    tli_put(at, head->lattice.kind, 4);
    tli_put(at, (uint64_t)(int64_t)head->lattice.exponent, 4);
    for (int k = 0; k < 3; k++) tli_put(at, (uint64_t)head->lattice.origin[k], 8);
    tli_put(at, head->input_tets, 8);
    tli_put(at, head->input_verts, 8);
    put_stats(at, &head->stats);
    tli_put_f64(at, head->time);
    tli_put_f64(at, head->position_error);
    tli_put_f64(at, head->border_share);
    tli_put_f64(at, head->connectivity_bits);
    tli_put_f64(at, head->place_bits);
    tli_put_f64(at, head->flag_bits);
    tli_put_f64(at, head->region_bits);
    tli_put(at, head->region_count, 8);
    tli_put(at, w->topology_bytes, 8);
    for (int k = 0; k < 3; k++) tli_put_f64(at, w->spheres.lo[k]);
    tli_put_f64(at, w->spheres.step);
    tli_put(at, (uint64_t)(int64_t)w->spheres.unit, 4);
    tli_put(at, 0, 4);
}

static void put_text(uint8_t **at, const char *text, size_t byte_count)
{
    memcpy(*at, text, byte_count);
    *at += byte_count;
}

static void put_zeros(uint8_t **at, const uint8_t *end)
{
    while (*at < end) tli_put(at, 0, 1);
}

static void put_region(uint8_t **at, const tl_store_region *region)
{
    const uint8_t *end = *at + region_bytes(region);
    const size_t name_bytes = strlen(name_of(region));
    tli_put(at, (uint64_t)region->id, 8);
    tli_put(at, region->tets, 8);
    tli_put(at, name_bytes, 4);
    tli_put(at, 0, 4);
    put_text(at, name_of(region), name_bytes);
    put_zeros(at, end);
}

static void put_level(uint8_t **at, const tl_store_level *level, uint32_t channel_count)
{
    tli_put(at, level->tets, 8);
    tli_put(at, level->verts, 8);
    tli_put(at, level->patch_count, 4);
    tli_put(at, level->segment_count, 4);
    tli_put_f64(at, level->boundary_error);
    for (uint32_t c = 0; c < channel_count; c++) tli_put_f64(at, level->max_error[c]);
}

static void put_channel(uint8_t **at, const tl_store_channel *channel,
                        const tli_channel_codes *codes, uint64_t byte_count)
{
    const size_t name_bytes = strlen(channel->name), unit_bytes = strlen(channel->unit);
    const uint8_t *end = *at + channel_bytes(channel);
    tli_put(at, name_bytes, 4);
    tli_put(at, unit_bytes, 4);
    tli_put(at, channel->components, 4);
    tli_put(at, channel->on, 1);
    tli_put(at, channel->scalar, 1);
    tli_put(at, channel->code.kind, 1);
    tli_put(at, 0, 1);
    tli_put_f64(at, channel->code.step);
    tli_put_f64(at, channel->range[0]);
    tli_put_f64(at, channel->range[1]);
    tli_put_f64(at, channel->codec_error);
    tli_put_f64(at, channel->time);
    tli_put(at, channel->nonfinite_count, 8);
    tli_put(at, byte_count, 8);
    tli_put(at, (uint64_t)(int64_t)codes->error_unit, 4);
    tli_put(at, channel->has_step ? (uint64_t)channel->step + 1 : 0, 4);
    tli_put_f64(at, codes->range.lo);
    tli_put_f64(at, codes->range.step);
    put_text(at, channel->name, name_bytes);
    put_text(at, channel->unit, unit_bytes);
    put_zeros(at, end);
}

void tli_head_pack(const tli_store_writer *writer, const tl_store_head *head, uint64_t file_bytes,
                   uint8_t *bytes)
{
    uint8_t *at = bytes;
    put_fixed(&at, writer, head, file_bytes);
    TL_ASSERT(at - bytes == TLI_HEAD_FIXED_BYTES);
    for (uint32_t i = 0; i < head->cell_kind_count; i++) tli_put(&at, head->cells[i], 8);
    for (uint32_t i = 0; i < head->regions_listed; i++) put_region(&at, &head->regions[i]);
    for (uint32_t l = 0; l < head->level_count; l++)
        put_level(&at, &head->levels[l], head->channel_count);
    for (uint32_t c = 0; c < head->channel_count; c++)
        put_channel(&at, &head->channels[c], &writer->codes[c], writer->channel_bytes[c]);
    const size_t codec_bytes = writer->codec.byte_count;
    const uint8_t *codec_end = at + tli_store_align(codec_bytes);
    if (codec_bytes) memcpy(at, writer->codec.bytes, codec_bytes);
    at += codec_bytes;
    put_zeros(&at, codec_end);
    for (uint32_t p = 0; p < writer->page_count; p++) {
        const tli_page_entry *entry = &writer->pages[p];
        tli_put(&at, entry->payload_ofs, 8);
        tli_put(&at, entry->page_ofs, 8);
        tli_put(&at, entry->hash, 8);
        tli_put(&at, entry->page_bytes, 4);
        tli_put(&at, entry->first_segment, 4);
        tli_put(&at, entry->first_patch, 4);
        tli_put(&at, 0, 4);
    }
    const size_t hashed = (size_t)(at - bytes);
    uint64_t seed = tli_store_seed(writer->head.identity, TLI_PART_HEAD, 0, 0);
    tli_put(&at, tli_store_hash(seed, bytes, hashed), TLI_STORE_HASH_BYTES);
    TL_ASSERT((uint64_t)(at - bytes) == tli_head_bytes(head, codec_bytes, writer->page_count));
}
