/* The file of segments: head, index, and single segments out of it. A working file of this machine:
 * numbers as the processor has them. Its head says so, and what it can't be is refused by name. */
#include "segment/segment_build.h"

#include <math.h>
#include <string.h>

#define MAGIC                                                                                      \
    0x3230474553544cffu /* "TLSEG02" from the second byte on, where bytes are little-endian */
#define HEAD_BYTES 4096u

/* The head as it is written. */
typedef struct head {
    uint64_t magic, file_bytes, index_ofs, index_bytes;
    uint64_t links_ofs, opposites_ofs, id_end, tet_count, vert_count, neighbour_count;
    double time;
    uint32_t segment_count, channel_count, has_regions, has_adjacency;
    uint64_t index_sum;
} head;

/* A channel of the index; its name follows. */
typedef struct channel_head {
    uint32_t name_bytes, unit_bytes, components, on, scalar, has_step, step, zero;
    double time;
} channel_head;

/* FNV-1a over words: the index is small. */
static uint64_t sum_of(const uint8_t *bytes, size_t byte_count)
{
    uint64_t sum = 0xcbf29ce484222325u;
    for (size_t i = 0; i < byte_count; i++) sum = (sum ^ bytes[i]) * 0x100000001b3u;
    return sum;
}

static size_t padded(size_t bytes)
{
    return (bytes + 7) & ~(size_t)7;
}

tli_body tli_body_of(const tl_segments *s, uint32_t vert_count, uint32_t tet_count)
{
    const size_t verts = vert_count, tets = tet_count;
    tli_body body;
    body.xyz = verts * sizeof(uint64_t);
    body.values = body.xyz + verts * 3 * sizeof(double);
    body.tet_values = body.values + verts * s->components[TL_ON_VERTEX] * sizeof(double);
    body.regions = body.tet_values + tets * s->components[TL_ON_TET] * sizeof(double);
    body.tets = body.regions + (s->has_regions ? padded(tets * sizeof(int32_t)) : 0);
    body.bytes = body.tets + tets * 4 * sizeof(uint16_t);
    return body;
}

uint32_t tli_segment_slot(const tl_segments *s, uint32_t segment, uint32_t other)
{
    const tli_segment_entry *entry = &s->entries[segment];
    const uint32_t *list = s->neighbours + entry->first_neighbour;
    uint32_t low = 0, high = entry->neighbour_count;
    if (segment == other) return 0;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (list[middle] < other)
            low = middle + 1;
        else
            high = middle;
    }
    TL_ASSERT(low < entry->neighbour_count && list[low] == other);
    return low + 1;
}

/* ---- writing ---- */

tl_status tli_segments_write_head(tl_segments *s)
{
    const uint8_t zeros[HEAD_BYTES] = {0};
    return tli_scratch_write(s->ctx, s->file, 0, zeros, sizeof zeros);
}

static size_t index_bytes(const tl_segments *s)
{
    size_t bytes = (size_t)s->count * (sizeof *s->entries + sizeof *s->order) +
                   (size_t)s->neighbour_count * sizeof *s->neighbours;
    for (size_t i = 0; i < s->channel_count; i++)
        bytes += sizeof(channel_head) + strlen(s->channels[i].name) + strlen(s->channels[i].unit);
    return bytes;
}

static uint8_t *put(uint8_t *to, const void *bytes, size_t byte_count)
{
    if (byte_count) memcpy(to, bytes, byte_count);
    return to + byte_count;
}

tl_status tli_segments_write_index(tl_segments *s)
{
    tl_status st = TL_OK;
    size_t bytes = index_bytes(s);
    uint8_t *index = tl_mem_alloc(s->ctx, bytes, 1, &st), *at = index;
    if (st) return st;
    at = put(at, s->entries, s->count * sizeof *s->entries);
    at = put(at, s->order, s->count * sizeof *s->order);
    at = put(at, s->neighbours, (size_t)s->neighbour_count * sizeof *s->neighbours);
    for (size_t i = 0; i < s->channel_count; i++) {
        const tl_segment_channel *channel = &s->channels[i];
        channel_head h = {.name_bytes = (uint32_t)strlen(channel->name),
                          .unit_bytes = (uint32_t)strlen(channel->unit),
                          .components = channel->components,
                          .on = channel->on,
                          .scalar = channel->scalar,
                          .has_step = channel->has_step,
                          .step = channel->step,
                          .time = channel->time};
        at = put(at, &h, sizeof h);
        at = put(at, channel->name, h.name_bytes);
        at = put(at, channel->unit, h.unit_bytes);
    }
    uint64_t ofs = padded(tli_scratch_bytes(s->file));
    head h = {.magic = MAGIC,
              .file_bytes = ofs + bytes,
              .index_ofs = ofs,
              .index_bytes = bytes,
              .links_ofs = s->links_ofs,
              .opposites_ofs = s->opposites_ofs,
              .id_end = s->id_end,
              .tet_count = s->tet_count,
              .vert_count = s->vert_count,
              .neighbour_count = s->neighbour_count,
              .time = s->time,
              .segment_count = s->count,
              .channel_count = (uint32_t)s->channel_count,
              .has_regions = s->has_regions,
              .has_adjacency = s->has_adjacency,
              .index_sum = sum_of(index, bytes)};
    st = tli_scratch_write(s->ctx, s->file, ofs, index, bytes);
    if (!st) st = tli_scratch_write(s->ctx, s->file, 0, &h, sizeof h);
    tl_mem_free(s->ctx, index);
    return st;
}

/* ---- reading ---- */

/* Bytes of an index that is being read. */
typedef struct cursor {
    const uint8_t *at, *end;
} cursor;

static bool take(cursor *c, void *to, size_t bytes)
{
    if ((size_t)(c->end - c->at) < bytes) return false;
    if (bytes) memcpy(to, c->at, bytes);
    c->at += bytes;
    return true;
}

static tl_status take_text(tl_ctx *ctx, cursor *c, uint32_t bytes, const char **text, bool *whole)
{
    tl_status st = TL_OK;
    if ((size_t)(c->end - c->at) < bytes) {
        *whole = false;
        return TL_OK;
    }
    char *own = tl_mem_zalloc(ctx, (size_t)bytes + 1, 1, &st);
    if (!st) *whole = take(c, own, bytes);
    *text = own;
    return st;
}

static tl_status read_channels(tl_segments *s, cursor *c, uint32_t count, bool *whole)
{
    tl_status st = TL_OK;
    if (count > (size_t)(c->end - c->at) / sizeof(channel_head)) *whole = false;
    if (!*whole) return TL_OK;
    s->channels = tl_mem_zalloc(s->ctx, count, sizeof *s->channels, &st);
    for (uint32_t i = 0; !st && *whole && i < count; i++) {
        channel_head h;
        *whole = take(c, &h, sizeof h) && h.on <= 1 && h.scalar <= TL_F64 && h.components >= 1 &&
                 h.components < UINT32_MAX / 64 - s->components[h.on];
        if (!*whole) break;
        tl_segment_channel *channel = &s->channels[s->channel_count++];
        *channel = (tl_segment_channel){.components = h.components,
                                        .on = (tl_on)h.on,
                                        .scalar = (tl_scalar)h.scalar,
                                        .first = s->components[h.on],
                                        .has_step = h.has_step != 0,
                                        .step = h.step,
                                        .time = h.time};
        s->components[h.on] += h.components;
        st = take_text(s->ctx, c, h.name_bytes, &channel->name, whole);
        if (!st && *whole) st = take_text(s->ctx, c, h.unit_bytes, &channel->unit, whole);
    }
    return st;
}

/* Every count and place that loading relies on. */
static bool index_holds(const tl_segments *s)
{
    const uint64_t bytes = tli_scratch_bytes(s->file);
    uint64_t tets = 0, verts = 0;
    for (uint32_t i = 0; i < s->count; i++) {
        if (s->order[i] >= s->count) return false;
        const tli_segment_entry *e = &s->entries[s->order[i]];
        if (e->vert_count > TL_SEGMENT_MAX || e->tet_count > TL_SEGMENT_MAX) return false;
        if (e->first_tet != tets || e->first_vert != verts) return false;
        tli_body body = tli_body_of(s, e->vert_count, e->tet_count);
        if (e->body_ofs > bytes || body.bytes > bytes - e->body_ofs) return false;
        if (e->neighbour_count > TL_SEGMENT_NEIGHBOURS_MAX ||
            e->first_neighbour > s->neighbour_count ||
            e->neighbour_count > s->neighbour_count - e->first_neighbour)
            return false;
        tets += e->tet_count;
        verts += e->vert_count;
    }
    for (uint64_t i = 0; i < s->neighbour_count; i++)
        if (s->neighbours[i] >= s->count) return false;
    return tets == s->tet_count && s->links_ofs <= bytes && verts <= (bytes - s->links_ofs) / 4 &&
           (!s->has_adjacency ||
            (s->opposites_ofs <= bytes && tets <= (bytes - s->opposites_ofs) / 16));
}

static tl_status read_index(tl_segments *s, const head *h, const char *path)
{
    tl_status st = TL_OK;
    uint8_t *index = tl_mem_alloc(s->ctx, (size_t)h->index_bytes, 1, &st);
    if (!st) st = tli_scratch_read(s->ctx, s->file, h->index_ofs, index, (size_t)h->index_bytes);
    cursor c = {index, index + h->index_bytes};
    bool whole = !st && sum_of(index, (size_t)h->index_bytes) == h->index_sum &&
                 h->segment_count <= h->index_bytes / sizeof *s->entries &&
                 h->neighbour_count <= h->index_bytes / sizeof *s->neighbours;
    if (whole) {
        s->count = h->segment_count;
        s->neighbour_count = h->neighbour_count;
        s->entries = tl_mem_alloc(s->ctx, s->count, sizeof *s->entries, &st);
        s->order = tl_mem_alloc(s->ctx, s->count, sizeof *s->order, &st);
        s->neighbours =
            tl_mem_alloc(s->ctx, (size_t)s->neighbour_count, sizeof *s->neighbours, &st);
        whole = !st && take(&c, s->entries, s->count * sizeof *s->entries) &&
                take(&c, s->order, s->count * sizeof *s->order) &&
                take(&c, s->neighbours, (size_t)s->neighbour_count * sizeof *s->neighbours);
        if (whole) st = read_channels(s, &c, h->channel_count, &whole);
    }
    tl_mem_free(s->ctx, index);
    if (!st && !(whole && c.at == c.end && index_holds(s)))
        st = tl_fail(s->ctx, TL_ERR_FORMAT, "'%s': the index of the segments is damaged", path);
    return st;
}

tl_status tl_segments_open(tl_ctx *ctx, const char *path, tl_segments **segments)
{
    tl_status st = TL_OK;
    *segments = NULL;
    tl_segments *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    s->ctx = ctx;
    st = tli_scratch_open_file(ctx, path, &s->file);
    head h = {0};
    const uint64_t bytes = st ? 0 : tli_scratch_bytes(s->file);
    if (!st && bytes >= HEAD_BYTES) st = tli_scratch_read(ctx, s->file, 0, &h, sizeof h);
    if (!st && (bytes < HEAD_BYTES || h.magic != MAGIC))
        st = tl_fail(ctx, TL_ERR_FORMAT, "'%s' is no file of segments made on a machine like this",
                     path);
    if (!st &&
        (h.file_bytes != bytes || h.index_ofs > bytes || h.index_bytes > bytes - h.index_ofs))
        st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': %llu bytes, its head says %llu", path,
                     (unsigned long long)bytes, (unsigned long long)h.file_bytes);
    if (!st) {
        s->links_ofs = h.links_ofs;
        s->opposites_ofs = h.opposites_ofs;
        s->id_end = h.id_end;
        s->tet_count = h.tet_count;
        s->vert_count = h.vert_count;
        s->time = h.time;
        s->has_regions = h.has_regions != 0;
        s->has_adjacency = h.has_adjacency != 0;
        st = read_index(s, &h, path);
    }
    if (st)
        tl_segments_destroy(s);
    else
        *segments = s;
    return st;
}

void tl_segments_destroy(tl_segments *s)
{
    if (!s) return;
    tl_ctx *ctx = s->ctx;
    tli_scratch_close(s->file);
    for (size_t i = 0; i < s->channel_count; i++) {
        tl_mem_free(ctx, (char *)(uintptr_t)s->channels[i].name);
        tl_mem_free(ctx, (char *)(uintptr_t)s->channels[i].unit);
    }
    tl_mem_free(ctx, s->channels);
    tl_mem_free(ctx, s->entries);
    tl_mem_free(ctx, s->order);
    tl_mem_free(ctx, s->neighbours);
    tl_mem_free(ctx, s);
}

/* ---- what is known ---- */

uint32_t tl_segments_count(const tl_segments *segments)
{
    return segments->count;
}

uint64_t tl_segments_tet_count(const tl_segments *segments)
{
    return segments->tet_count;
}

uint64_t tl_segments_vert_count(const tl_segments *segments)
{
    return segments->vert_count;
}

uint64_t tl_segments_id_end(const tl_segments *segments)
{
    return segments->id_end;
}

double tl_segments_time(const tl_segments *segments)
{
    return segments->time;
}

bool tl_segments_has_regions(const tl_segments *segments)
{
    return segments->has_regions;
}

bool tl_segments_has_adjacency(const tl_segments *segments)
{
    return segments->has_adjacency;
}

uint64_t tl_segments_bytes(const tl_segments *segments)
{
    return tli_scratch_bytes(segments->file);
}

size_t tl_segments_channel_count(const tl_segments *segments)
{
    return segments->channel_count;
}

const tl_segment_channel *tl_segments_channel(const tl_segments *segments, size_t index)
{
    return &segments->channels[index];
}

uint32_t tl_segments_components(const tl_segments *segments, tl_on on)
{
    return segments->components[on];
}

tl_segment_summary tl_segments_info(const tl_segments *segments, uint32_t segment)
{
    const tli_segment_entry *entry = &segments->entries[segment];
    tl_segment_summary info = {.tet_count = entry->tet_count,
                               .vert_count = entry->vert_count,
                               .shared_count = entry->shared_count,
                               .neighbours = segments->neighbours + entry->first_neighbour,
                               .neighbour_count = entry->neighbour_count};
    memcpy(info.bounds, entry->bounds, sizeof info.bounds);
    return info;
}

/* ---- one segment ---- */

tl_status tl_segments_load(tl_ctx *ctx, const tl_segments *s, uint32_t segment, tl_segment *out)
{
    tl_status st = TL_OK;
    *out = (tl_segment){.id = segment};
    if (segment >= s->count) return tl_fail(ctx, TL_ERR_ARG, "segment %u of %u", segment, s->count);
    const tli_segment_entry *entry = &s->entries[segment];
    const tli_body at = tli_body_of(s, entry->vert_count, entry->tet_count);
    const size_t links = (size_t)entry->vert_count * sizeof(uint32_t);
    const size_t opposites = s->has_adjacency ? (size_t)entry->tet_count * 4 * sizeof(uint32_t) : 0;
    uint8_t *block = tl_mem_alloc(ctx, at.bytes + opposites + links, 1, &st);
    if (st) return st;
    st = tli_scratch_read(ctx, s->file, entry->body_ofs, block, at.bytes);
    if (!st && opposites)
        st = tli_scratch_read(ctx, s->file, s->opposites_ofs + entry->first_tet * 16,
                              block + at.bytes, opposites);
    if (!st)
        st = tli_scratch_read(ctx, s->file, s->links_ofs + entry->first_vert * 4,
                              block + at.bytes + opposites, links);
    if (st) {
        tl_mem_free(ctx, block);
        return tl_note(ctx, st, "while loading segment %u", segment);
    }
    out->vert_count = entry->vert_count;
    out->tet_count = entry->tet_count;
    out->block = block;
    /* the arrays stand at multiples of 8 in a block of tl_mem_alloc */
    out->vert_ids = (const void *)block;
    out->xyz = (const void *)(block + at.xyz);
    out->values = (const void *)(block + at.values);
    out->tet_values = (const void *)(block + at.tet_values);
    if (s->has_regions) out->regions = (const void *)(block + at.regions);
    out->tets = (const void *)(block + at.tets);
    if (opposites) out->opposites = (const void *)(block + at.bytes);
    out->links = (const void *)(block + at.bytes + opposites);
    out->neighbours = s->neighbours + entry->first_neighbour;
    out->neighbour_count = entry->neighbour_count;
    return TL_OK;
}

void tl_segment_release(tl_ctx *ctx, tl_segment *segment)
{
    tl_mem_free(ctx, segment->block);
    *segment = (tl_segment){0};
}
