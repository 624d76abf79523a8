/* Proves patches that belong together by decoding them: every blob is read, places lie in the
 * spheres and values in the ranges that the index promises, and a vertex that several of them
 * share has the same values in all. */
#include <math.h>
#include <stdlib.h>

#include "store/store_check.h"

/* Room for the rounding of whoever computed spheres and norms, relative to coordinates and values.
 */
#define ROUNDING 0x1p-40

/* A shared vertex: its identity, and what its values hash to. */
typedef struct shared_vert {
    int64_t place[3];
    uint64_t values;
    uint32_t patch;
    uint8_t twin;
} shared_vert;

typedef struct group_task {
    tl_ctx *ctx;
    const tl_store *store;
    shared_vert *verts;
    size_t vert_count, capacity;
} group_task;

static tl_status fail_patch(const group_task *task, uint32_t id, const char *wrong)
{
    return tl_fail(task->ctx, TL_ERR_DATA, "'%s': patch %u %s", task->store->reader.path, id,
                   wrong);
}

/* ---- places ---- */

static bool holds(const double sphere[4], const double xyz[3])
{
    double squares = 0, size = 0;
    for (int k = 0; k < 3; k++) {
        squares += (xyz[k] - sphere[k]) * (xyz[k] - sphere[k]);
        size = fmax(size, fabs(xyz[k]));
    }
    return !(sqrt(squares) > sphere[3] + ROUNDING * (size + sphere[3]));
}

static tl_status check_places(const group_task *task, uint32_t id, const tl_patch_info *info,
                              const tl_patch *patch)
{
    const uint32_t segments[2] = {info->producer, info->consumer};
    tl_segment_info around[2];
    tl_status st = TL_OK;
    for (int i = 0; !st && i < 2; i++)
        if (segments[i] != TL_NONE)
            st = tl_store_segment(task->ctx, task->store, segments[i], &around[i]);
    for (uint32_t v = 0; !st && v < patch->vert_count; v++) {
        double xyz[3];
        tl_lattice_xyz(&task->store->head.lattice, patch->places[v], xyz);
        if (!holds(info->sphere, xyz))
            st = fail_patch(task, id, "has a vertex outside of its sphere");
        for (int i = 0; !st && i < 2; i++)
            if (segments[i] != TL_NONE && !holds(around[i].sphere, xyz))
                st = fail_patch(task, id, "has a vertex outside of the sphere of its segment");
    }
    return st;
}

/* ---- values ---- */

/* A scalar is its own norm, with sign; NaN where a component is not finite. */
static double norm_of(const double *values, uint32_t components)
{
    double squares = 0;
    if (components == 1) return isfinite(values[0]) ? values[0] : NAN;
    for (uint32_t i = 0; i < components; i++) {
        if (!isfinite(values[i])) return NAN;
        squares += values[i] * values[i];
    }
    return sqrt(squares);
}

static tl_status check_range(const group_task *task, uint32_t id, const tl_store_channel *channel,
                             const float *range, const int64_t *images, size_t elem_count)
{
    tl_status st = TL_OK;
    double *values = tl_mem_alloc(task->ctx, channel->components, sizeof *values, &st);
    for (size_t i = 0; !st && i < elem_count; i++) {
        for (uint32_t k = 0; k < channel->components; k++)
            values[k] = tl_value_of(&channel->code, images[i * channel->components + k]);
        const double norm = norm_of(values, channel->components);
        const double room = ROUNDING * fabs(norm);
        if (!isnan(norm) && !(norm >= (double)range[0] - room && norm <= (double)range[1] + room))
            st =
                tl_fail(task->ctx, TL_ERR_DATA,
                        "'%s': patch %u, channel '%s': value %.9g is not in the range %.9g .. %.9g "
                        "that the index says",
                        task->store->reader.path, id, channel->name, norm, (double)range[0],
                        (double)range[1]);
    }
    tl_mem_free(task->ctx, values);
    return st;
}

/* Adds the values of a channel to what those of each vertex hash to. */
static void add_hashes(uint64_t *hashes, const int64_t *images, uint32_t vert_count,
                       uint32_t components)
{
    for (uint32_t v = 0; v < vert_count; v++)
        for (uint32_t k = 0; k < components; k++) {
            uint8_t bytes[8], *at = bytes;
            tli_put(&at, (uint64_t)images[(size_t)v * components + k], 8);
            hashes[v] = tli_store_hash(hashes[v], bytes, sizeof bytes);
        }
}

static tl_status check_channel(const group_task *task, uint32_t id, const tl_patch_info *info,
                               const tl_patch *patch, uint32_t channel, uint64_t *hashes)
{
    const tl_store_channel *c = &task->store->head.channels[channel];
    const size_t elems = c->on == TL_ON_VERTEX ? patch->vert_count : patch->tet_count;
    tl_status st = TL_OK;
    int64_t *images = tl_mem_alloc(task->ctx, elems * c->components, sizeof *images, &st);
    if (st) return st;
    st = tl_store_channel_images(task->ctx, task->store, id, patch, channel, images);
    if (!st) st = check_range(task, id, c, info->ranges + 2 * (size_t)channel, images, elems);
    if (!st && c->on == TL_ON_VERTEX) add_hashes(hashes, images, patch->vert_count, c->components);
    tl_mem_free(task->ctx, images);
    return st;
}

/* ---- shared vertices ---- */

static tl_status gather_shared(group_task *task, uint32_t id, const tl_patch *patch,
                               const uint64_t *hashes)
{
    tl_status st = TL_OK;
    if (task->capacity - task->vert_count < patch->vert_count) {
        size_t more = task->vert_count + patch->vert_count;
        if (more < 2 * task->capacity) more = 2 * task->capacity;
        task->verts = tl_mem_resize(task->ctx, task->verts, more, sizeof *task->verts, &st);
        if (st) return st;
        task->capacity = more;
    }
    for (uint32_t v = 0; v < patch->vert_count; v++) {
        if (!patch->shared[v]) continue;
        shared_vert *vert = &task->verts[task->vert_count++];
        memcpy(vert->place, patch->places[v], sizeof vert->place);
        vert->twin = patch->twins ? patch->twins[v] : 0;
        vert->patch = id;
        vert->values = hashes[v];
    }
    return st;
}

static int compare_identity(const shared_vert *a, const shared_vert *b)
{
    for (int k = 0; k < 3; k++)
        if (a->place[k] != b->place[k]) return a->place[k] < b->place[k] ? -1 : 1;
    return (a->twin > b->twin) - (a->twin < b->twin);
}

static int compare_verts(const void *a, const void *b)
{
    const shared_vert *x = a, *y = b;
    int order = compare_identity(x, y);
    return order ? order : (x->patch > y->patch) - (x->patch < y->patch);
}

static tl_status check_shared(const group_task *task)
{
    if (task->vert_count) qsort(task->verts, task->vert_count, sizeof *task->verts, compare_verts);
    for (size_t i = 1; i < task->vert_count; i++) {
        const shared_vert *a = &task->verts[i - 1], *b = &task->verts[i];
        if (compare_identity(a, b) != 0) continue;
        if (a->patch == b->patch)
            return fail_patch(task, a->patch, "has two shared vertices that can't be told apart");
        if (a->values != b->values)
            return tl_fail(task->ctx, TL_ERR_DATA,
                           "'%s': patches %u and %u share a vertex with different values",
                           task->store->reader.path, a->patch, b->patch);
    }
    return TL_OK;
}

/* ---- patches ---- */

static tl_status check_patch(group_task *task, uint32_t id)
{
    tl_patch_info info;
    tl_patch *patch = NULL;
    tl_status st = tl_store_patch(task->ctx, task->store, id, &info);
    if (!st) st = tl_store_topology(task->ctx, task->store, id, &patch);
    if (st) return st;
    uint64_t *hashes = tl_mem_zalloc(task->ctx, patch->vert_count, sizeof *hashes, &st);
    if (!st) st = check_places(task, id, &info, patch);
    for (uint32_t c = 0; !st && c < task->store->head.channel_count; c++)
        st = check_channel(task, id, &info, patch, c, hashes);
    if (!st) st = gather_shared(task, id, patch, hashes);
    tl_mem_free(task->ctx, hashes);
    tl_patch_destroy(task->ctx, patch);
    return st;
}

tl_status tli_store_check_group(tl_ctx *ctx, const tl_store *store, uint32_t first, uint32_t count)
{
    group_task task = {.ctx = ctx, .store = store};
    tl_status st = TL_OK;
    for (uint32_t i = 0; !st && i < count; i++) st = check_patch(&task, first + i);
    if (!st) st = check_shared(&task);
    tl_mem_free(ctx, task.verts);
    return st;
}
