/* Slices of a cut, patch by patch. What a patch adds is kept as long as it is drawn. A shared
 * vertex is one number whatever patch holds it (place and twin), so an edge between two of them is
 * the same edge in all patches, and so is the vertex of the surface on it. Gradients there are sums
 * over patches; a patch that comes or goes has those of its shared vertices summed up anew, in the
 * order of patch numbers, and the normals of its neighbours' rims made again. So nothing depends on
 * the cuts before, nor on the number of threads. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/base_vec.h"
#include "cut/cut_keys.h"
#include "extract/extract_slices.h"

struct tl_slices {
    tl_ctx *ctx;
    tli_slices_job job;
    tli_slices_part **places; /* [patch_count] or NULL */
    tli_slices_part **parts;  /* [part_count] rising by number */
    size_t part_count;
    uint32_t *stamps; /* [patch_count] of the last update that asked for it */
    uint32_t stamp;
    bool is_stale;   /* values have changed: no part will do */
    tli_keys keys;   /* of shared vertices */
    tli_slope *sums; /* [key_room] over all parts */
    uint8_t *touched;
    size_t key_room;
    tl_slices_state state;
};

/* ---- making one ---- */

tl_slices_opts tl_slices_opts_defaults(void)
{
    return (tl_slices_opts){.struct_bytes = sizeof(tl_slices_opts),
                            .channel = TL_NONE,
                            .plane = {0, 0, 0, 0, 0, 1},
                            .normals = true};
}

static tl_status check_channel(const tl_slices *s, uint32_t channel)
{
    const tl_store_head *head = s->job.head;
    if (channel < head->channel_count && head->channels[channel].on == TL_ON_VERTEX) return TL_OK;
    return tl_fail(s->ctx, TL_ERR_ARG,
                   "channel %u can't be sliced or carried: it is none on vertices", channel);
}

static tl_status check_opts(const tl_slices *s)
{
    tl_status st = TL_OK;
    const tl_slices_opts *o = &s->job.opts;
    double length = vec_length(o->plane + 3);
    if (o->channel != TL_NONE) st = check_channel(s, o->channel);
    for (size_t c = 0; !st && c < o->channel_count; c++) st = check_channel(s, o->channels[c]);
    if (!st && (!vec_is_finite(o->plane) || !isfinite(length) || !(length > 0)))
        st =
            tl_fail(s->ctx, TL_ERR_ARG, "a plane needs a finite origin and a normal with a length");
    return st;
}

tl_status tl_slices_create(tl_ctx *ctx, tl_store *store, const tl_slices_opts *opts,
                           tl_slices **slices)
{
    tl_status st = TL_OK;
    tl_slices_opts own = tl_slices_opts_defaults();
    *slices = NULL;
    st = tli_opts_take(ctx, "tl_slices_opts", opts, &own, sizeof own);
    tl_slices *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) return st;
    s->ctx = ctx;
    s->job = (tli_slices_job){.store = store, .head = tl_store_get_head(store), .opts = own};
    s->job.opts.values = NULL;
    s->job.opts.channels = NULL;
    size_t patches = s->job.head->patch_count;
    st = tli_keys_open(ctx, 0, &s->keys);
    s->places = tl_mem_zalloc(ctx, patches, sizeof *s->places, &st);
    s->stamps = tl_mem_zalloc(ctx, patches, sizeof *s->stamps, &st);
    uint32_t *channels = tl_mem_alloc(ctx, own.channel_count, sizeof *channels, &st);
    if (!st && own.channel_count)
        memcpy(channels, own.channels, own.channel_count * sizeof *channels);
    s->job.opts.channels = channels;
    if (!st) st = check_opts(s);
    if (!st) st = tl_slices_set_values(s, own.values, own.value_count);
    if (st)
        tl_slices_destroy(s);
    else
        *slices = s;
    return st;
}

void tl_slices_destroy(tl_slices *s)
{
    if (!s) return;
    for (size_t i = 0; i < s->part_count; i++) tli_slices_part_destroy(s->ctx, s->parts[i]);
    tli_keys_close(&s->keys);
    void *blocks[] = {s->places,
                      s->parts,
                      s->stamps,
                      s->sums,
                      s->touched,
                      (void *)(uintptr_t)s->job.opts.values,
                      (void *)(uintptr_t)s->job.opts.channels,
                      s};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(s->ctx, blocks[i]);
}

tl_status tl_slices_set_values(tl_slices *s, const double *values, size_t value_count)
{
    tl_status st = tli_slice_values_check(s->ctx, values, value_count);
    double *own = tl_mem_alloc(s->ctx, value_count, sizeof *own, &st);
    if (st) return st;
    tli_slice_values_sort(values, value_count, own);
    tl_mem_free(s->ctx, (void *)(uintptr_t)s->job.opts.values);
    s->job.opts.values = own;
    s->job.opts.value_count = value_count;
    s->is_stale = true;
    return TL_OK;
}

/* ---- parts that come ---- */

typedef struct coming {
    tl_slices *slices;
    uint32_t *numbers;       /* [count] rising */
    tli_slices_part **parts; /* [count] */
    size_t count, with_keys;
    tli_slices_part **all; /* room for these and for those that stay */
} coming;

/* What comes to several slices. */
typedef struct arrival {
    tl_ctx *ctx;
    tl_store *store;
    coming *each; /* [count] */
    size_t count;
    uint32_t *numbers; /* [number_count] of all, each once */
    size_t number_count;
} arrival;

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Lists the patches that need a part; stamps those that are asked for. */
static tl_status list_coming(coming *c, const uint32_t *patches, size_t patch_count)
{
    tl_slices *s = c->slices;
    tl_status st = TL_OK;
    s->stamp++;
    c->numbers = tl_mem_alloc(s->ctx, patch_count, sizeof *c->numbers, &st);
    for (size_t i = 0; !st && i < patch_count; i++) {
        bool may = true;
        if (patches[i] >= s->job.head->patch_count)
            return tl_fail(s->ctx, TL_ERR_ARG, "patch %u of %u", patches[i],
                           s->job.head->patch_count);
        if (s->stamps[patches[i]] == s->stamp)
            return tl_fail(s->ctx, TL_ERR_ARG, "patch %u is there twice", patches[i]);
        s->stamps[patches[i]] = s->stamp;
        if (s->places[patches[i]] && !s->is_stale) continue;
        st = tli_slices_may_cut(s->ctx, &s->job, patches[i], &may);
        if (may) c->numbers[c->count++] = patches[i];
    }
    if (st) return st;
    qsort(c->numbers, c->count, sizeof *c->numbers, by_number);
    c->parts = tl_mem_zalloc(s->ctx, c->count, sizeof *c->parts, &st);
    c->all = tl_mem_alloc(s->ctx, s->part_count + c->count, sizeof *c->all, &st);
    return st;
}

/* Of all slices, which patches; each of these once. */
static tl_status list_arrival(arrival *a, const uint32_t *patches, size_t patch_count)
{
    tl_status st = TL_OK;
    size_t count = 0, kept = 0;
    for (size_t i = 0; !st && i < a->count; i++) {
        st = list_coming(&a->each[i], patches, patch_count);
        count += a->each[i].count;
    }
    a->numbers = tl_mem_alloc(a->ctx, count, sizeof *a->numbers, &st);
    if (st) return st;
    count = 0;
    for (size_t i = 0; i < a->count; i++)
        for (size_t k = 0; k < a->each[i].count; k++) a->numbers[count++] = a->each[i].numbers[k];
    qsort(a->numbers, count, sizeof *a->numbers, by_number);
    for (size_t i = 0; i < count; i++)
        if (!kept || a->numbers[i] != a->numbers[kept - 1]) a->numbers[kept++] = a->numbers[i];
    a->number_count = kept;
    return TL_OK;
}

/* The parts of all slices that a patch comes to. */
static tl_status make_of_patch(tl_ctx *ctx, arrival *a, uint32_t number)
{
    tli_slices_patch patch;
    tl_status st = tli_slices_patch_open(ctx, a->store, number, &patch);
    for (size_t i = 0; !st && i < a->count; i++) {
        coming *c = &a->each[i];
        const uint32_t *at = bsearch(&number, c->numbers, c->count, sizeof number, by_number);
        if (at) st = tli_slices_part_make(ctx, &c->slices->job, &patch, &c->parts[at - c->numbers]);
    }
    tli_slices_patch_release(ctx, &patch);
    return st;
}

static tl_status make_parts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    arrival *a = arg;
    tl_ctx *fork = NULL;
    tl_status st = tli_ctx_fork(a->ctx, &fork);
    for (size_t i = begin; !st && i < end; i++) st = make_of_patch(fork, a, a->numbers[i]);
    return tli_ctx_join(a->ctx, fork, st);
}

/* Numbers for the shared vertices of a part, and room for what is known of them. */
static tl_status take_keys(tl_slices *s, tli_slices_part *part)
{
    tl_status st = TL_OK;
    uint32_t taken = 0;
    for (; taken < part->shared_count; taken++) {
        st = tli_keys_take(&s->keys, part->places[taken], part->twins[taken], &part->keys[taken]);
        if (st) break;
    }
    if (!st && s->keys.count > s->key_room) {
        size_t room = s->keys.count + s->keys.count / 2;
        s->sums = tl_mem_resize(s->ctx, s->sums, room, sizeof *s->sums, &st);
        s->touched = tl_mem_resize(s->ctx, s->touched, room, 1, &st);
        if (!st) memset(s->touched + s->key_room, 0, room - s->key_room);
        if (!st) s->key_room = room;
    }
    if (st)
        while (taken) tli_keys_drop(&s->keys, part->keys[--taken]);
    return st;
}

static void drop_keys(tl_slices *s, tli_slices_part *part)
{
    for (uint32_t i = 0; i < part->shared_count; i++) tli_keys_drop(&s->keys, part->keys[i]);
}

/* All that can fail; afterwards the parts are there, but nobody knows of them. */
static tl_status prepare(arrival *a, const uint32_t *patches, size_t patch_count)
{
    tl_status st = list_arrival(a, patches, patch_count);
    if (!st) st = tli_parallel(a->ctx, a->number_count, 1, make_parts, a);
    for (size_t i = 0; !st && i < a->count; i++) {
        coming *c = &a->each[i];
        for (; !st && c->with_keys < c->count; c->with_keys++) {
            st = take_keys(c->slices, c->parts[c->with_keys]);
            if (st) break;
        }
    }
    return st;
}

static void give_up(coming *c)
{
    for (size_t i = 0; i < c->with_keys; i++) drop_keys(c->slices, c->parts[i]);
    for (size_t i = 0; c->parts && i < c->count; i++)
        tli_slices_part_destroy(c->slices->ctx, c->parts[i]);
    tl_mem_free(c->slices->ctx, c->all);
}

/* ---- going over ---- */

static void touch(tl_slices *s, const tli_slices_part *part)
{
    for (uint32_t i = 0; i < part->shared_count; i++) s->touched[part->keys[i]] = 1;
}

/* Merges the parts that stay with those that come, and destroys those that go. */
static void exchange(tl_slices *s, coming *c)
{
    size_t count = 0, next = 0;
    tli_slices_part **parts = c->all;
    for (size_t i = 0; i < s->part_count; i++) {
        tli_slices_part *part = s->parts[i];
        if (s->stamps[part->number] == s->stamp && !s->is_stale) continue;
        touch(s, part);
        drop_keys(s, part);
        s->places[part->number] = NULL;
        tli_slices_part_destroy(s->ctx, part);
        s->parts[i] = NULL;
    }
    for (size_t i = 0; i < s->part_count; i++) {
        if (!s->parts[i]) continue;
        while (next < c->count && c->numbers[next] < s->parts[i]->number)
            parts[count++] = c->parts[next++];
        parts[count++] = s->parts[i];
    }
    while (next < c->count) parts[count++] = c->parts[next++];
    for (size_t i = 0; i < c->count; i++) {
        touch(s, c->parts[i]);
        s->places[c->numbers[i]] = c->parts[i];
    }
    tl_mem_free(s->ctx, s->parts);
    s->parts = parts;
    s->part_count = count;
    s->is_stale = false;
}

/* Sums of the vertices that patches which came or went share. Numbers that an update took before it
 * failed may lie beyond the room: nobody has them. */
static void sum_touched(tl_slices *s)
{
    for (size_t k = 0; k < s->key_room; k++)
        if (s->touched[k]) s->sums[k] = (tli_slope){0};
    for (size_t i = 0; i < s->part_count; i++) {
        tli_slices_part *part = s->parts[i];
        part->is_touched = false;
        for (uint32_t v = 0; v < part->shared_count; v++) {
            if (!s->touched[part->keys[v]]) continue;
            tli_slope *sum = &s->sums[part->keys[v]];
            part->is_touched = true;
            if (!part->slopes) continue;
            for (int k = 0; k < 3; k++) sum->sum[k] += part->slopes[v].sum[k];
            sum->volume += part->slopes[v].volume;
        }
    }
    if (s->key_room) memset(s->touched, 0, s->key_room);
}

static void gradient_at(const tl_slices *s, const tli_slices_part *part, uint32_t slot,
                        double gradient[3])
{
    bool shared = slot < part->shared_count;
    tli_slope_gradient(shared ? &s->sums[part->keys[slot]] : &part->slopes[slot], gradient);
}

static tl_status turn_normals(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const tl_slices *s = arg;
    for (size_t i = begin; i < end; i++) {
        tli_slices_part *part = s->parts[i];
        for (size_t r = 0; part->is_touched && r < part->rim_count; r++) {
            const tli_rim_vert *v = &part->rim[r];
            double a[3], b[3];
            gradient_at(s, part, v->ends[0], a);
            gradient_at(s, part, v->ends[1], b);
            tli_slice_normal(a, b, v->weight, part->surface->normals + 3 * (size_t)v->vert);
        }
    }
    return TL_OK;
}

static void count_up(tl_slices *s, const coming *c, size_t patch_count)
{
    s->state = (tl_slices_state){
        .patches = s->part_count, .decoded = c->count, .passed_over = patch_count - s->part_count};
    for (size_t i = 0; i < c->count; i++) s->state.tets += c->parts[i]->tet_count;
    s->state.bytes = s->job.head->patch_count * (sizeof *s->places + sizeof *s->stamps) +
                     s->key_room * (sizeof *s->sums + sizeof *s->touched) +
                     s->keys.capacity * sizeof *s->keys.keys +
                     (s->keys.slot_mask + 1) * sizeof *s->keys.slots;
    for (size_t i = 0; i < s->part_count; i++) {
        s->state.triangles += s->parts[i]->surface->cell_count;
        s->state.bytes += tli_slices_part_bytes(s->parts[i]);
    }
}

static tl_status check_slices(tl_slices *const *slices, size_t count)
{
    if (!count) return TL_OK;
    tl_ctx *ctx = slices[0]->ctx;
    for (size_t i = 1; i < count; i++) {
        if (slices[i]->ctx != ctx || slices[i]->job.store != slices[0]->job.store)
            return tl_fail(ctx, TL_ERR_ARG, "slices %zu are of another store or context", i);
        for (size_t k = 0; k < i; k++)
            if (slices[i] == slices[k])
                return tl_fail(ctx, TL_ERR_ARG, "slices %zu are there twice", i);
    }
    return TL_OK;
}

/* Goes over to what has come. */
static tl_status take_over(coming *c, size_t patch_count)
{
    tl_slices *s = c->slices;
    exchange(s, c);
    sum_touched(s);
    count_up(s, c, patch_count);
    return s->job.opts.normals ? tli_parallel(s->ctx, s->part_count, 1, turn_normals, s) : TL_OK;
}

tl_status tl_slices_update_all(tl_slices *const *slices, size_t slices_count,
                               const uint32_t *patches, size_t patch_count, size_t *decoded)
{
    tl_status st = check_slices(slices, slices_count);
    if (decoded) *decoded = 0;
    if (st || !slices_count) return st;
    arrival a = {.ctx = slices[0]->ctx, .store = slices[0]->job.store};
    a.each = tl_mem_zalloc(a.ctx, slices_count, sizeof *a.each, &st);
    for (; !st && a.count < slices_count; a.count++) a.each[a.count].slices = slices[a.count];
    if (!st) st = prepare(&a, patches, patch_count);
    if (st) tl_note(a.ctx, st, "while slicing %zu patches", patch_count);
    if (!st && decoded) *decoded = a.number_count;
    const bool is_ready = !st; /* from here on only normals can be given up */
    for (size_t i = 0; i < a.count; i++) {
        tl_status end = TL_OK;
        if (is_ready)
            end = take_over(&a.each[i], patch_count);
        else
            give_up(&a.each[i]);
        if (!st) st = end;
        tl_mem_free(a.ctx, a.each[i].parts);
        tl_mem_free(a.ctx, a.each[i].numbers);
    }
    tl_mem_free(a.ctx, a.numbers);
    tl_mem_free(a.ctx, a.each);
    return st;
}

tl_status tl_slices_update(tl_slices *slices, const uint32_t *patches, size_t patch_count)
{
    return tl_slices_update_all(&slices, 1, patches, patch_count, NULL);
}

tl_slices_state tl_slices_get_state(const tl_slices *s)
{
    return s->state;
}

const tl_polydata *tl_slices_patch(const tl_slices *s, uint32_t patch)
{
    const tli_slices_part *part = patch < s->job.head->patch_count ? s->places[patch] : NULL;
    return part ? part->surface : NULL;
}

tl_status tl_slices_join(const tl_slices *s, tl_polydata **triangles)
{
    return tli_slices_join(s->ctx, &s->job, s->parts, s->part_count, triangles);
}
