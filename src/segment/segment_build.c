/* Builds a file of segments out of a source that does not fit into memory (Sondershaus
 * 2007, 6.1.1). There the vertices are held in memory and a file is written for each segment; here
 * neither is so:
 *
 *   points   pass by a few times: the octree; then each goes to the place of its part in a file
 *   tets     pass by once: each looks its four places up and goes to the lowest part among them, in
 *            an external sort by groups of parts
 *   groups   one after the other, on all threads: segments with their own vertex lists
 *   copies   of vertices meet at the part that the vertex lies in and are linked
 *
 * Which group a part is in depends on the memory, nothing that is written does. */
#include "segment/segment_build.h"

#include <string.h>

#define GRAIN 8192u
/* Points of a window, by the memory that their records take. */
#define POINT_PART 16u
#define WINDOW_POINTS_MIN 4096u
#define WINDOW_POINTS_MAX 1048576u
/* Part of the memory for windows of the source, for counting points, for groups in flight. */
#define SOURCE_PART 2u
#define COUNT_PART 8u
#define GROUP_PART 4u
/* Bytes of lists and sorted copies for each tet of a group, besides records and bodies. */
#define GROUP_TET_BYTES 44u
/* Leaves that make a segment. */
#define LEAVES_A_SEGMENT 24u
#define LEAF_POINTS_MIN 8u
/* Tets for each point in a mesh of tets, about: where the source can't say better. */
#define TETS_A_POINT 5.5

tl_segment_opts tl_segment_opts_defaults(void)
{
    return (tl_segment_opts){.struct_bytes = sizeof(tl_segment_opts),
                             .segment_tets = 20000,
                             .memory_bytes = (uint64_t)256 << 20,
                             .adjacency = true};
}

static tl_status check_options(tl_ctx *ctx, const tl_segment_opts *given, tl_segment_opts *opts)
{
    *opts = tl_segment_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_segment_opts", given, opts, sizeof *opts);
    if (st) return st;
    if (opts->segment_tets < 64 || opts->segment_tets > 40000)
        return tl_fail(ctx, TL_ERR_ARG, "segments of %u tets, expected 64 to 40,000",
                       opts->segment_tets);
    if (opts->memory_bytes < TL_SEGMENT_MEMORY_MIN)
        return tl_fail(
            ctx, TL_ERR_ARG, "segments with %llu bytes of memory, expected at least %llu",
            (unsigned long long)opts->memory_bytes, (unsigned long long)TL_SEGMENT_MEMORY_MIN);
    return TL_OK;
}

/* ---- parts ---- */

static tl_status feed_points(void *user, uint64_t first, size_t count, double *xyz,
                             uint8_t *missing)
{
    return tli_feed_points(user, first, count, xyz, NULL, missing);
}

static tl_status make_parts(tli_build *b)
{
    const uint64_t points = tli_feed_point_count(b->feed);
    const uint64_t tets = tli_feed_tet_estimate(b->feed);
    uint64_t parts = (tets + b->opts.segment_tets / 2) / b->opts.segment_tets;
    if (parts < 1) parts = 1;
    if (parts > INT32_MAX / 64)
        return tl_fail(b->ctx, TL_ERR_UNSUPPORTED, "%llu segments, at most %d can be made",
                       (unsigned long long)parts, INT32_MAX / 64);
    tli_octree_opts opts = {.leaf_points = b->opts.leaf_points,
                            .memory_bytes = b->opts.memory_bytes / COUNT_PART,
                            .rotation = b->rotation,
                            .stage = "octree"};
    if (!opts.leaf_points) opts.leaf_points = points / parts / LEAVES_A_SEGMENT;
    if (opts.leaf_points < LEAF_POINTS_MIN) opts.leaf_points = LEAF_POINTS_MIN;
    tl_status st = tli_octree_build(b->ctx, points, feed_points, b->feed, &opts, &b->octree);
    if (!st) st = tli_octree_merge(&b->octree, (uint32_t)parts);
    if (st) return st;

    b->part_count = b->octree.part_count;
    b->first_places =
        tl_mem_zalloc(b->ctx, (size_t)b->part_count + 1, sizeof *b->first_places, &st);
    for (uint32_t p = 0; !st && p < b->part_count; p++)
        b->first_places[p + 1] = b->first_places[p] + (uint32_t)b->octree.part_points[p];
    if (st) return st;
    uint32_t places = b->first_places[b->part_count];
    size_t hints = (size_t)(places >> TLI_HINT_SHIFT) + 1;
    b->part_hints = tl_mem_alloc(b->ctx, hints, sizeof *b->part_hints, &st);
    for (uint32_t h = 0, part = 0; !st && h < hints; h++) {
        while (part + 1 < b->part_count && (h << TLI_HINT_SHIFT) >= b->first_places[part + 1])
            part++;
        b->part_hints[h] = part;
    }
    return st;
}

/* Parts in the order in which the leaves' codes meet them, and cut into groups. */
static tl_status make_groups(tli_build *b)
{
    tl_status st = TL_OK;
    const uint64_t points = b->first_places[b->part_count];
    const size_t tet_bytes = 2 * b->tet_bytes + GROUP_TET_BYTES + b->vert_bytes / 2;
    const uint64_t room = b->opts.memory_bytes / GROUP_PART;
    const unsigned threads = tl_ctx_thread_count(b->ctx);
    uint64_t group_tets = room / threads / tet_bytes;
    if (group_tets < 2 * (uint64_t)b->opts.segment_tets)
        group_tets = 2 * (uint64_t)b->opts.segment_tets;
    uint64_t fits = room / (group_tets * tet_bytes);
    b->in_flight = fits < 1 ? 1 : fits < threads ? (unsigned)fits : threads;
    double tets_a_point =
        points ? (double)tli_feed_tet_estimate(b->feed) / (double)points : TETS_A_POINT;
    double group_points = (double)group_tets / (tets_a_point > 1 ? tets_a_point : 1);

    b->layout = tl_mem_alloc(b->ctx, b->part_count, sizeof *b->layout, &st);
    b->group_of = tl_mem_alloc(b->ctx, b->part_count, sizeof *b->group_of, &st);
    b->group_begins = tl_mem_alloc(b->ctx, (size_t)b->part_count + 1, sizeof *b->group_begins, &st);
    uint8_t *seen = tl_mem_zalloc(b->ctx, b->part_count, 1, &st);
    double held = 0;
    for (size_t leaf = 0, next = 0; !st && leaf < b->octree.leaf_count; leaf++) {
        uint32_t part = b->octree.parts[leaf];
        if (seen[part]) continue;
        seen[part] = 1;
        double here = (double)b->octree.part_points[part];
        if (!next || held + here > group_points) {
            b->group_begins[b->group_count++] = (uint32_t)next;
            held = 0;
        }
        held += here;
        b->group_of[part] = b->group_count - 1;
        b->layout[next++] = part;
    }
    if (!st) b->group_begins[b->group_count] = b->part_count;
    tl_mem_free(b->ctx, seen);
    return st;
}

/* ---- points to their places ---- */

typedef struct point_window {
    tli_build *b;
    uint64_t first;
    double *xyz, *values;
    uint8_t *missing, *records;
    uint32_t *keys, *places, *begins, *next_places;
} point_window;

static tl_status find_parts(void *arg, size_t begin, size_t end, unsigned worker)
{
    const point_window *w = arg;
    (void)worker;
    for (size_t i = begin; i < end; i++)
        w->keys[i] =
            w->missing[i] ? w->b->part_count : tli_octree_find(&w->b->octree, w->xyz + 3 * i);
    return TL_OK;
}

/* Records into the order of the parts; places in the window become places. */
static tl_status make_records(void *arg, size_t begin, size_t end, unsigned worker)
{
    const point_window *w = arg;
    const size_t bytes = w->b->vert_bytes, values = bytes - 4 * sizeof(double);
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        uint8_t *record = w->records + w->places[i] * bytes;
        uint64_t id = w->first + i;
        memcpy(record, &id, sizeof id);
        memcpy(record + 8, w->xyz + 3 * i, 3 * sizeof(double));
        if (values) memcpy(record + 32, (const uint8_t *)w->values + i * values, values);
        uint32_t part = w->keys[i];
        w->places[i] = part == w->b->part_count
                           ? TL_NONE
                           : w->next_places[part] + (w->places[i] - w->begins[part]);
    }
    return TL_OK;
}

static tl_status place_window(point_window *w, size_t count)
{
    tli_build *b = w->b;
    tl_ctx *ctx = b->ctx;
    tl_status st = tli_feed_points(b->feed, w->first, count, w->xyz, w->values, w->missing);
    if (!st) st = tli_parallel(ctx, count, GRAIN, find_parts, w);
    if (!st) st = tli_deal(ctx, w->keys, count, b->part_count + 1, w->begins, w->places);
    if (!st) st = tli_parallel(ctx, count, GRAIN, make_records, w);
    if (!st)
        st = tli_scratch_write(ctx, b->table, w->first * sizeof *w->places, w->places,
                               count * sizeof *w->places);
    for (uint32_t p = 0; !st && p < b->part_count; p++) {
        uint32_t here = w->begins[p + 1] - w->begins[p];
        if (!here) continue;
        st = tli_scratch_write(ctx, b->verts, (uint64_t)w->next_places[p] * b->vert_bytes,
                               w->records + w->begins[p] * b->vert_bytes, here * b->vert_bytes);
        w->next_places[p] += here;
    }
    return st;
}

static tl_status place_points(tli_build *b)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = b->ctx;
    const uint64_t points = tli_feed_point_count(b->feed);
    uint64_t step = b->opts.memory_bytes / POINT_PART / b->vert_bytes;
    if (step < WINDOW_POINTS_MIN) step = WINDOW_POINTS_MIN;
    if (step > WINDOW_POINTS_MAX) step = WINDOW_POINTS_MAX;
    if (step > points) step = points;
    const size_t room = (size_t)step, parts = (size_t)b->part_count + 1;
    point_window w = {.b = b};
    w.xyz = tl_mem_alloc(ctx, room, 3 * sizeof *w.xyz, &st);
    w.values = tl_mem_alloc(ctx, room, b->vert_bytes, &st);
    w.missing = tl_mem_alloc(ctx, room, 1, &st);
    w.records = tl_mem_alloc(ctx, room, b->vert_bytes, &st);
    w.keys = tl_mem_alloc(ctx, room, sizeof *w.keys, &st);
    w.places = tl_mem_alloc(ctx, room, sizeof *w.places, &st);
    w.begins = tl_mem_alloc(ctx, parts + 1, sizeof *w.begins, &st);
    w.next_places = tl_mem_alloc(ctx, parts, sizeof *w.next_places, &st);
    if (!st) memcpy(w.next_places, b->first_places, parts * sizeof *w.next_places);
    if (!st) st = tli_scratch_open(ctx, b->opts.folder, &b->table);
    if (!st) st = tli_scratch_open(ctx, b->opts.folder, &b->verts);
    for (; !st && w.first < points; w.first += step) {
        uint64_t left = points - w.first;
        st = place_window(&w, left < step ? (size_t)left : (size_t)step);
        if (!st) st = tl_progress(ctx, "points", w.first + (left < step ? left : step), points);
    }
    tl_mem_free(ctx, w.next_places);
    tl_mem_free(ctx, w.begins);
    tl_mem_free(ctx, w.places);
    tl_mem_free(ctx, w.keys);
    tl_mem_free(ctx, w.records);
    tl_mem_free(ctx, w.missing);
    tl_mem_free(ctx, w.values);
    tl_mem_free(ctx, w.xyz);
    return st;
}

/* ---- tets to groups ---- */

typedef struct tet_window {
    const tli_build *b;
    tli_window in;
    const uint32_t *point_places; /* [points of the window] */
    uint32_t *keys, *places, *begins;
    uint8_t *records;
} tet_window;

static tl_status find_groups(void *arg, size_t begin, size_t end, unsigned worker)
{
    const tet_window *w = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *tet = w->in.tets + 4 * t;
        uint32_t low = TL_NONE;
        for (int i = 0; i < 4; i++)
            low = w->point_places[tet[i]] < low ? w->point_places[tet[i]] : low;
        w->keys[t] = w->b->group_of[tli_part_of(w->b, low)];
    }
    return TL_OK;
}

static tl_status make_tet_records(void *arg, size_t begin, size_t end, unsigned worker)
{
    const tet_window *w = arg;
    const size_t bytes = w->b->tet_bytes, regions = w->in.regions ? sizeof(int32_t) : 0;
    const size_t values = bytes - 16 - regions;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        uint8_t *record = w->records + w->places[t] * bytes;
        const tl_lidx *tet = w->in.tets + 4 * t;
        uint32_t places[4];
        for (int i = 0; i < 4; i++) places[i] = w->point_places[tet[i]];
        memcpy(record, places, sizeof places);
        if (regions) memcpy(record + 16, &w->in.regions[t], regions);
        if (values)
            memcpy(record + 16 + regions, (const uint8_t *)w->in.values + t * values, values);
    }
    return TL_OK;
}

/* Places of the points of a window: a range of the table, or of ascending ids. */
static tl_status read_places(tli_build *b, const tli_window *in, uint32_t *places)
{
    enum { STEP = 65536 };
    tl_status st = TL_OK;
    const uint64_t points = tli_feed_point_count(b->feed);
    if (!in->ids)
        return tli_scratch_read(b->ctx, b->table, in->first_point * sizeof *places, places,
                                in->point_count * sizeof *places);
    uint32_t *part = tl_mem_alloc(b->ctx, STEP, sizeof *part, &st);
    for (size_t i = 0; !st && i < in->point_count;) {
        uint64_t first = in->ids[i], room = points - first;
        if (room > STEP) room = STEP;
        size_t last = i;
        while (last < in->point_count && in->ids[last] < first + room) last++;
        st = tli_scratch_read(b->ctx, b->table, first * sizeof *part, part,
                              (in->ids[last - 1] - first + 1) * sizeof *part);
        for (; !st && i < last; i++) places[i] = part[in->ids[i] - first];
    }
    tl_mem_free(b->ctx, part);
    return st;
}

static tl_status deal_window(tli_build *b, const tli_window *in)
{
    tl_ctx *ctx = b->ctx;
    tl_status st = TL_OK;
    tet_window w = {.b = b, .in = *in};
    uint32_t *point_places = tl_mem_alloc(ctx, in->point_count, sizeof *point_places, &st);
    w.keys = tl_mem_alloc(ctx, in->tet_count, sizeof *w.keys, &st);
    w.places = tl_mem_alloc(ctx, in->tet_count, sizeof *w.places, &st);
    w.begins = tl_mem_alloc(ctx, (size_t)b->group_count + 1, sizeof *w.begins, &st);
    w.records = tl_mem_alloc(ctx, in->tet_count, b->tet_bytes, &st);
    w.point_places = point_places;
    if (!st) st = read_places(b, in, point_places);
    if (!st) st = tli_parallel(ctx, in->tet_count, GRAIN, find_groups, &w);
    if (!st) st = tli_deal(ctx, w.keys, in->tet_count, b->group_count, w.begins, w.places);
    if (!st) st = tli_parallel(ctx, in->tet_count, GRAIN, make_tet_records, &w);
    if (!st) st = tli_bins_add(&b->tets, w.records, w.begins);
    tl_mem_free(ctx, w.records);
    tl_mem_free(ctx, w.begins);
    tl_mem_free(ctx, w.places);
    tl_mem_free(ctx, w.keys);
    tl_mem_free(ctx, point_places);
    return st;
}

static tl_status deal_tets(tli_build *b)
{
    tl_status st = tli_bins_open(b->ctx, b->opts.folder, b->tet_bytes, b->group_count, &b->tets);
    const uint64_t estimate = tli_feed_tet_estimate(b->feed);
    uint64_t done = 0;
    bool more = true;
    if (!st) tli_feed_rewind(b->feed);
    while (!st && more) {
        tli_window window;
        st = tli_feed_next(b->feed, &window, &more);
        if (!st && more && window.tet_count) st = deal_window(b, &window);
        done += window.tet_count;
        if (!st) st = tl_progress(b->ctx, "tets", done < estimate ? done : estimate, estimate);
    }
    b->segments->tet_count = done;
    return st;
}

/* ---- the driver ---- */

static tl_status begin_segments(tli_build *b, const char *path)
{
    tl_ctx *ctx = b->ctx;
    tl_status st = TL_OK;
    tl_segments *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    b->segments = s;
    s->ctx = ctx;
    s->time = tli_feed_time(b->feed);
    s->id_end = tli_feed_point_count(b->feed);
    s->has_regions = tli_feed_has_regions(b->feed);
    size_t count;
    const tl_channel *channels = tli_feed_channels(b->feed, &count);
    s->channels = tl_mem_zalloc(ctx, count, sizeof *s->channels, &st);
    for (size_t i = 0; !st && i < count; i++) {
        const tl_channel *from = &channels[i];
        const tli_feed_step step = tli_feed_channel_step(b->feed, i);
        s->channels[i] = (tl_segment_channel){.name = tli_strdup(ctx, from->name, &st),
                                              .unit = tli_strdup(ctx, from->unit, &st),
                                              .components = from->components,
                                              .on = from->on,
                                              .scalar = from->scalar,
                                              .first = s->components[from->on],
                                              .has_step = step.is_given,
                                              .step = step.number,
                                              .time = step.is_given ? step.time : s->time};
        s->components[from->on] += from->components;
        s->channel_count++;
    }
    b->vert_bytes = 32 + s->components[TL_ON_VERTEX] * sizeof(double);
    b->tet_bytes =
        16 + (s->has_regions ? sizeof(int32_t) : 0) + s->components[TL_ON_TET] * sizeof(double);
    if (st) return st;
    return path ? tli_scratch_open_beside(ctx, path, &s->file)
                : tli_scratch_open(ctx, b->opts.folder, &s->file);
}

static void build_release(tli_build *b)
{
    tl_ctx *ctx = b->ctx;
    tli_bins_close(&b->links);
    tli_bins_close(&b->guests);
    tli_bins_close(&b->tets);
    tl_mem_free(ctx, b->group_segments);
    tl_mem_free(ctx, b->part_bases);
    tl_mem_free(ctx, b->group_of);
    tl_mem_free(ctx, b->group_begins);
    tl_mem_free(ctx, b->layout);
    tli_scratch_unmap(b->vert_map, b->vert_map_bytes);
    tli_scratch_close(b->verts);
    tli_scratch_close(b->table);
    tl_mem_free(ctx, b->part_hints);
    tl_mem_free(ctx, b->first_places);
    tli_octree_close(&b->octree);
    tl_segments_destroy(b->segments);
    tli_feed_close(b->feed);
}

/* The steps; b->feed is set. */
static tl_status build(tli_build *b, const char *path, tl_segments **segments)
{
    tl_status st = begin_segments(b, path);
    if (!st) st = make_parts(b);
    if (!st) st = make_groups(b);
    if (!st) st = place_points(b);
    if (!st) st = deal_tets(b);
    if (!st) st = tli_build_cut(b);
    if (!st) st = tli_build_link(b);
    if (!st && b->opts.adjacency) st = tli_segments_match_faces(b->segments);
    if (!st) st = tli_segments_write_index(b->segments);
    if (!st && b->report) st = tli_feed_report(b->feed, b->report);
    if (!st && path) st = tli_scratch_keep(b->segments->file, path);
    if (st) return st;
    *segments = b->segments;
    b->segments = NULL;
    return TL_OK;
}

tl_status tli_segments_build_feed(tl_ctx *ctx, tli_feed *feed, const tl_segment_opts *opts,
                                  const double *rotation, tl_segments **segments)
{
    tli_build b = {.ctx = ctx, .feed = feed, .rotation = rotation};
    *segments = NULL;
    tl_status st = check_options(ctx, opts, &b.opts);
    if (!st) st = build(&b, NULL, segments);
    build_release(&b);
    return st;
}

tl_status tl_segments_build_mesh(tl_ctx *ctx, const tl_mesh *mesh, const tl_segment_opts *opts,
                                 const char *path, tl_segments **segments)
{
    tli_build b = {.ctx = ctx};
    *segments = NULL;
    tl_status st = check_options(ctx, opts, &b.opts);
    if (!st) st = tli_feed_of_mesh(ctx, mesh, b.opts.memory_bytes / SOURCE_PART, &b.feed);
    if (!st) st = build(&b, path, segments);
    build_release(&b);
    return st ? tl_note(ctx, st, "while cutting a mesh into segments") : TL_OK;
}

/* Of a source that was opened, or that could not be: st says so. */
static tl_status build_read(tli_build *b, tl_status st, const char *input, const char *path,
                            tl_segments **segments, tl_read_report *report)
{
    tl_read_report unread;
    b->report = report ? report : &unread;
    if (!st) st = build(b, path, segments);
    build_release(b);
    return st ? tl_note(b->ctx, st, "while cutting '%s' into segments", input) : TL_OK;
}

tl_status tl_segments_build(tl_ctx *ctx, const char *input, const tl_read_opts *read,
                            const tl_segment_opts *opts, const char *path, tl_segments **segments,
                            tl_read_report *report)
{
    tli_build b = {.ctx = ctx};
    *segments = NULL;
    if (report) *report = (tl_read_report){0};
    tl_status st = check_options(ctx, opts, &b.opts);
    if (!st)
        st = tli_feed_open(ctx, input, read, b.opts.folder, b.opts.memory_bytes / SOURCE_PART,
                           &b.feed);
    return build_read(&b, st, input, path, segments, report);
}

tl_status tl_segments_build_series(tl_ctx *ctx, const tl_step *steps, size_t step_count,
                                   const tl_read_opts *read, const tl_segment_opts *opts,
                                   const char *path, tl_segments **segments, tl_read_report *report)
{
    tli_build b = {.ctx = ctx};
    *segments = NULL;
    if (report) *report = (tl_read_report){0};
    if (!step_count) return tl_fail(ctx, TL_ERR_ARG, "a series without steps");
    tl_status st = check_options(ctx, opts, &b.opts);
    if (!st)
        st = tli_feed_open_series(ctx, steps, step_count, read, b.opts.folder,
                                  b.opts.memory_bytes / SOURCE_PART, &b.feed);
    return build_read(&b, st, steps->path, path, segments, report);
}
