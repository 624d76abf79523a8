/* Files in windows for tests: the same tets and values as a whole read has. */
#ifndef TETRALOD_TESTS_CHECK_FEED_H
#define TETRALOD_TESTS_CHECK_FEED_H

#include "check.h"

#include "formats/formats_feeder.h"

typedef struct check_feed_tets {
    uint64_t tets, windows;
    uint64_t *ids;
    int32_t *regions;
    double *values; /* [tets][components on tets] */
    size_t tuple;
} check_feed_tets;

static inline tl_status check_feed_gather(tli_feed *feed, check_feed_tets *all)
{
    for (bool more = true; more;) {
        tli_window window;
        tl_status st = tli_feed_next(feed, &window, &more);
        if (st || !more) return st;
        CHECK_EQ(window.first_tet, all->tets);
        const size_t count = window.tet_count, sum = (size_t)all->tets + count;
        all->ids = realloc(all->ids, (sum + 1) * 4 * sizeof *all->ids);
        all->regions = realloc(all->regions, (sum + 1) * sizeof *all->regions);
        all->values = realloc(all->values, (sum * all->tuple + 1) * sizeof *all->values);
        for (size_t i = 0; i < 4 * count; i++) {
            const tl_lidx p = window.tets[i];
            CHECK(p < window.point_count);
            all->ids[4 * all->tets + i] = window.ids ? window.ids[p] : window.first_point + p;
        }
        if (window.regions)
            memcpy(all->regions + all->tets, window.regions, count * sizeof *window.regions);
        if (all->tuple && count)
            memcpy(all->values + all->tets * all->tuple, window.values,
                   count * all->tuple * sizeof *window.values);
        all->tets += count;
        all->windows++;
    }
    return TL_OK;
}

static inline void check_feed_drop(check_feed_tets *all)
{
    free(all->ids);
    free(all->regions);
    free(all->values);
}

static inline size_t check_feed_components(const tli_feed *feed, tl_on on)
{
    size_t channels, sum = 0;
    const tl_channel *list = tli_feed_channels(feed, &channels);
    for (size_t c = 0; c < channels; c++)
        if (list[c].on == on) sum += list[c].components;
    return sum;
}

/* All values of one side, tuple by tuple, beside those of the mesh; to_mesh [tuples]: SIZE_MAX for
 * those that it left out. */
static inline void check_feed_values(const tli_feed *feed, const tl_mesh *mesh, tl_on on,
                                     const double *values, const size_t *to_mesh, size_t tuples)
{
    const size_t tuple = check_feed_components(feed, on);
    size_t channels, place = 0;
    const tl_channel *list = tli_feed_channels(feed, &channels);
    CHECK_EQ(channels, tl_mesh_channel_count(mesh));
    for (size_t c = 0; c < channels; c++) {
        const tl_channel *other = tl_mesh_channel(mesh, c);
        CHECK(strcmp(list[c].name, other->name) == 0);
        CHECK_EQ(list[c].components, other->components);
        CHECK_EQ(list[c].scalar, other->scalar);
        CHECK_EQ(list[c].on, other->on);
        if (list[c].on != on) continue;
        const size_t bytes = other->components * sizeof *values;
        for (size_t i = 0; i < tuples; i++)
            if (to_mesh[i] != SIZE_MAX)
                CHECK(memcmp(values + i * tuple + place,
                             other->values + to_mesh[i] * other->components, bytes) == 0);
        place += other->components;
    }
}

static inline void check_feed_points(tl_ctx *ctx, tli_feed *feed, const tl_mesh *mesh,
                                     const check_feed_tets *all, size_t *to_mesh)
{
    const size_t points = (size_t)tli_feed_point_count(feed);
    const size_t tuple = check_feed_components(feed, TL_ON_VERTEX);
    double *xyz = malloc((points + 1) * 3 * sizeof *xyz);
    double *values = malloc((points * tuple + 1) * sizeof *values);
    for (size_t i = 0; i < points; i++) to_mesh[i] = SIZE_MAX;
    for (size_t i = 0; i < 4 * all->tets; i++) to_mesh[all->ids[i]] = 0;
    size_t used = 0;
    for (size_t i = 0; i < points; i++)
        if (to_mesh[i] != SIZE_MAX) to_mesh[i] = used++;
    CHECK_EQ(used, tl_mesh_vert_count(mesh));
    /* in two parts: the border is anywhere */
    const size_t half = points / 3;
    CHECK_OK(ctx, tli_feed_points(feed, 0, half, xyz, values, NULL));
    CHECK_OK(ctx, tli_feed_points(feed, half, points - half, xyz + 3 * half, values + tuple * half,
                                  NULL));
    for (size_t i = 0; i < points; i++)
        if (to_mesh[i] != SIZE_MAX)
            CHECK(memcmp(xyz + 3 * i, tl_mesh_xyz(mesh) + 3 * to_mesh[i], 3 * sizeof *xyz) == 0);
    check_feed_values(feed, mesh, TL_ON_VERTEX, values, to_mesh, points);
    free(values);
    free(xyz);
}

/* How many windows it took; 0: it was read as a whole. */
static inline uint64_t check_feed_file(tl_ctx *ctx, const char *path, const tl_read_opts *opts)
{
    tl_mesh *mesh = NULL;
    tli_feed *feed = NULL;
    tl_read_report whole, windowed;
    CHECK_OK(ctx, tl_mesh_read(ctx, path, opts, &mesh, &whole));
    CHECK_OK(ctx, tli_feed_open(ctx, path, opts, ".", 1, &feed)); /* the smallest windows */
    check_feed_tets all = {.tuple = check_feed_components(feed, TL_ON_TET)};
    CHECK_OK(ctx, check_feed_gather(feed, &all));
    if (feed->feeder->is_final) {
        all.windows = 0;
    } else {
        CHECK_EQ(all.tets, tl_mesh_tet_count(mesh));
        CHECK_EQ(tli_feed_has_regions(feed), tl_mesh_regions(mesh) != NULL);
        double time = tli_feed_time(feed), other = tl_mesh_time(mesh);
        CHECK(memcmp(&time, &other, sizeof time) == 0);
        size_t *to_mesh =
            malloc(((size_t)tli_feed_point_count(feed) + all.tets + 1) * sizeof *to_mesh);
        check_feed_points(ctx, feed, mesh, &all, to_mesh);
        for (size_t i = 0; i < 4 * all.tets; i++)
            CHECK_EQ(to_mesh[all.ids[i]], tl_mesh_tets(mesh)[i]);
        for (size_t i = 0; tl_mesh_regions(mesh) && i < all.tets; i++)
            CHECK_EQ(all.regions[i], tl_mesh_regions(mesh)[i]);
        for (size_t i = 0; i < all.tets; i++) to_mesh[i] = i;
        check_feed_values(feed, mesh, TL_ON_TET, all.values, to_mesh, (size_t)all.tets);
        free(to_mesh);
        CHECK_OK(ctx, tli_feed_report(feed, &windowed));
        CHECK(memcmp(&whole, &windowed, sizeof whole) == 0);
    }
    check_feed_drop(&all);
    tli_feed_close(feed);
    tl_mesh_destroy(mesh);
    return all.windows;
}

#endif
