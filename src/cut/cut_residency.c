/* Decoded patches under a limit. One lock guards a small amount of bookkeeping; reading and
 * decoding happen outside of it; a bell wakes those that serve. Entries are chained from the most
 * to the least recently used. */
#include <string.h>

#include "base/base_lock.h"
#include "tetralod/cut.h"

typedef struct entry {
    tl_resident shown; /* first, so that what is handed out is the entry */
    tl_ctx *ctx;       /* whose memory it is */
    double **values;
    uint64_t bytes;
    unsigned holds;
    struct entry *newer, *older;
} entry;

typedef enum flag { FLAG_ABSENT = 0, FLAG_LOADING, FLAG_FAILED } flag;

struct tl_residency {
    tl_ctx *ctx;
    tl_store *store;
    const tl_store_head *head;
    size_t *channels;
    size_t channel_count;
    uint64_t bytes, bytes_max;
    tli_lock lock;
    tli_bell bell;   /* rings when something is wanted, or serving ends */
    bool is_over;    /* serving */
    entry **entries; /* [patch count] or NULL */
    uint8_t *flags;  /* [patch count] flag, of patches that are not there */
    entry *newest, *oldest;
    size_t entry_count;
    uint32_t *wanted; /* [patch count] room; [wanted_count] from wanted_next on */
    size_t wanted_count, wanted_next;
};

tl_status tl_residency_create(tl_ctx *ctx, tl_store *store, uint64_t bytes_max,
                              const size_t *channels, size_t channel_count,
                              tl_residency **residency)
{
    tl_status st = TL_OK;
    const tl_store_head *head = tl_store_get_head(store);
    *residency = NULL;
    if (!channels) channel_count = head->channel_count;
    for (size_t i = 0; channels && i < channel_count; i++)
        if (channels[i] >= head->channel_count)
            return tl_fail(ctx, TL_ERR_ARG, "channel %zu of %u", channels[i], head->channel_count);
    tl_residency *r = tl_mem_zalloc(ctx, 1, sizeof *r, &st);
    if (st) return st;
    *r = (tl_residency){.ctx = ctx, .store = store, .head = head, .bytes_max = bytes_max};
    r->channel_count = channel_count;
    r->channels = tl_mem_alloc(ctx, channel_count, sizeof *r->channels, &st);
    r->entries = tl_mem_zalloc(ctx, head->patch_count, sizeof *r->entries, &st);
    r->flags = tl_mem_zalloc(ctx, head->patch_count, 1, &st);
    r->wanted = tl_mem_alloc(ctx, head->patch_count, sizeof *r->wanted, &st);
    for (size_t i = 0; !st && i < channel_count; i++) r->channels[i] = channels ? channels[i] : i;
    if (!st) st = tli_lock_create(ctx, &r->lock);
    if (!st) {
        st = tli_bell_create(ctx, &r->bell);
        if (st) tli_lock_destroy(&r->lock);
    }
    if (!st) {
        *residency = r;
        return TL_OK;
    }
    tl_mem_free(ctx, r->wanted);
    tl_mem_free(ctx, r->flags);
    tl_mem_free(ctx, r->entries);
    tl_mem_free(ctx, r->channels);
    tl_mem_free(ctx, r);
    return st;
}

/* ---- entries ---- */

static void drop_entry(size_t channel_count, entry *e)
{
    if (!e) return;
    for (size_t c = 0; e->values && c < channel_count; c++) tl_mem_free(e->ctx, e->values[c]);
    tl_mem_free(e->ctx, e->values);
    tl_patch_destroy(e->ctx, (tl_patch *)(uintptr_t)e->shown.patch);
    tl_mem_free(e->ctx, e);
}

void tl_residency_destroy(tl_residency *r)
{
    if (!r) return;
    while (r->oldest) {
        entry *e = r->oldest;
        TL_ASSERT(!e->holds);
        r->oldest = e->newer;
        drop_entry(r->channel_count, e);
    }
    tli_bell_destroy(&r->bell);
    tli_lock_destroy(&r->lock);
    tl_mem_free(r->ctx, r->wanted);
    tl_mem_free(r->ctx, r->flags);
    tl_mem_free(r->ctx, r->entries);
    tl_mem_free(r->ctx, r->channels);
    tl_mem_free(r->ctx, r);
}

static void unchain(tl_residency *r, entry *e)
{
    *(e->newer ? &e->newer->older : &r->newest) = e->older;
    *(e->older ? &e->older->newer : &r->oldest) = e->newer;
}

static void chain(tl_residency *r, entry *e)
{
    e->newer = NULL;
    e->older = r->newest;
    *(r->newest ? &r->newest->newer : &r->oldest) = e;
    r->newest = e;
}

/* Takes out what was not used for longest until the limit is kept; returns it as a chain. */
static entry *make_space(tl_residency *r)
{
    entry *gone = NULL;
    for (entry *e = r->oldest, *newer; e && r->bytes > r->bytes_max; e = newer) {
        newer = e->newer;
        if (e->holds || e == r->newest) continue;
        unchain(r, e);
        r->entries[e->shown.number] = NULL;
        r->bytes -= e->bytes;
        r->entry_count--;
        e->older = gone;
        gone = e;
    }
    return gone;
}

static void drop_chain(tl_residency *r, entry *gone)
{
    while (gone) {
        entry *next = gone->older;
        drop_entry(r->channel_count, gone);
        gone = next;
    }
}

/* ---- use ---- */

static entry *use(tl_residency *r, uint32_t patch, unsigned holds)
{
    entry *e = patch < r->head->patch_count ? r->entries[patch] : NULL;
    if (!e) return NULL;
    unchain(r, e);
    chain(r, e);
    e->holds += holds;
    return e;
}

bool tl_residency_has(void *residency, uint32_t patch)
{
    tl_residency *r = residency;
    tli_lock_take(&r->lock);
    bool there = use(r, patch, 0) != NULL;
    tli_lock_give(&r->lock);
    return there;
}

const tl_resident *tl_residency_get(tl_residency *r, uint32_t patch)
{
    tli_lock_take(&r->lock);
    entry *e = use(r, patch, 1);
    tli_lock_give(&r->lock);
    return e ? &e->shown : NULL;
}

void tl_residency_release(tl_residency *r, const tl_resident *resident)
{
    entry *e = (entry *)(uintptr_t)resident;
    tli_lock_take(&r->lock);
    TL_ASSERT(e->holds);
    e->holds--;
    entry *gone = make_space(r);
    tli_lock_give(&r->lock);
    drop_chain(r, gone);
}

uint64_t tl_residency_bytes(tl_residency *r, size_t *patch_count)
{
    tli_lock_take(&r->lock);
    uint64_t bytes = r->bytes;
    *patch_count = r->entry_count;
    tli_lock_give(&r->lock);
    return bytes;
}

/* ---- loading ---- */

tl_status tl_residency_want(tl_ctx *ctx, tl_residency *r, const uint32_t *patches,
                            size_t patch_count)
{
    if (patch_count > r->head->patch_count)
        return tl_fail(ctx, TL_ERR_ARG, "%zu patches wanted of %u", patch_count,
                       r->head->patch_count);
    for (size_t i = 0; i < patch_count; i++)
        if (patches[i] >= r->head->patch_count)
            return tl_fail(ctx, TL_ERR_ARG, "patch %u of %u", patches[i], r->head->patch_count);
    tli_lock_take(&r->lock);
    if (patch_count) memcpy(r->wanted, patches, patch_count * sizeof *patches);
    r->wanted_count = patch_count;
    r->wanted_next = 0;
    for (size_t i = 0; i < patch_count; i++)
        if (r->flags[patches[i]] == FLAG_FAILED) r->flags[patches[i]] = FLAG_ABSENT;
    if (patch_count) tli_bell_ring(&r->bell);
    tli_lock_give(&r->lock);
    return TL_OK;
}

/* The next patch to load, marked as being loaded; TL_NONE if there is none, or serving has ended
 * while it was waited for. */
static uint32_t take_wanted(tl_residency *r, bool waits)
{
    uint32_t patch = TL_NONE;
    tli_lock_take(&r->lock);
    while (patch == TL_NONE && !(waits && r->is_over)) {
        if (r->wanted_next == r->wanted_count) {
            if (!waits) break;
            tli_bell_wait(&r->bell, &r->lock);
            continue;
        }
        uint32_t next = r->wanted[r->wanted_next++];
        if (!r->entries[next] && r->flags[next] == FLAG_ABSENT) patch = next;
    }
    if (patch != TL_NONE) r->flags[patch] = FLAG_LOADING;
    tli_lock_give(&r->lock);
    return patch;
}

static uint64_t patch_bytes(const tl_patch *p)
{
    uint64_t vert = sizeof *p->places + 1 + (p->twins != NULL);
    uint64_t tet = sizeof *p->tets + (p->regions ? sizeof *p->regions : 0) + sizeof *p->opposite;
    return sizeof *p + p->vert_count * vert + p->tet_count * tet;
}

static tl_status decode(tl_ctx *ctx, const tl_residency *r, uint32_t patch, entry **made)
{
    tl_status st = TL_OK;
    tl_patch *p = NULL;
    entry *e = tl_mem_zalloc(ctx, 1, sizeof *e, &st);
    *made = NULL;
    if (st) return st;
    e->ctx = tli_ctx_owner(ctx);
    e->values = tl_mem_zalloc(ctx, r->channel_count, sizeof *e->values, &st);
    if (!st) st = tl_store_topology(ctx, r->store, patch, &p);
    e->shown = (tl_resident){patch, p, e->values};
    e->bytes = sizeof *e + (p ? patch_bytes(p) : 0);
    for (size_t c = 0; !st && c < r->channel_count; c++) {
        const tl_store_channel *channel = &r->head->channels[r->channels[c]];
        size_t elems = channel->on == TL_ON_VERTEX ? p->vert_count : p->tet_count;
        e->values[c] = tl_mem_alloc(ctx, elems, channel->components * sizeof(double), &st);
        e->bytes += elems * channel->components * sizeof(double);
        if (!st)
            st = tl_store_channel_values(ctx, r->store, patch, p, (uint32_t)r->channels[c],
                                         e->values[c]);
    }
    if (st)
        drop_entry(r->channel_count, e);
    else
        *made = e;
    return st;
}

/* Loads a patch that take_wanted has marked. */
static tl_status load(tl_ctx *ctx, tl_residency *r, uint32_t patch)
{
    entry *e = NULL, *gone = NULL;
    tl_status st = decode(ctx, r, patch, &e);
    tli_lock_take(&r->lock);
    r->flags[patch] = st ? FLAG_FAILED : FLAG_ABSENT;
    if (e) {
        r->entries[patch] = e;
        r->bytes += e->bytes;
        r->entry_count++;
        chain(r, e);
        gone = make_space(r);
    }
    tli_lock_give(&r->lock);
    drop_chain(r, gone);
    return st ? tl_note(ctx, st, "while loading patch %u", patch) : TL_OK;
}

tl_status tl_residency_load(tl_ctx *ctx, tl_residency *r, bool *idle)
{
    uint32_t patch = take_wanted(r, false);
    *idle = patch == TL_NONE;
    return *idle ? TL_OK : load(ctx, r, patch);
}

/* ---- serving ---- */

typedef struct service {
    tl_ctx *ctx;
    tl_residency *residency;
} service;

/* One thread: a patch that can't be loaded is not the end for the others. */
static tl_status serve(void *arg, size_t begin, size_t end, unsigned worker)
{
    const service *s = arg;
    tl_ctx *fork = NULL, *failed = NULL;
    tl_status st = TL_OK, first = TL_OK;
    (void)begin, (void)end, (void)worker;
    for (uint32_t patch = 0; !st && patch != TL_NONE;) {
        if (!fork) st = tli_ctx_fork(s->ctx, &fork);
        patch = st ? TL_NONE : take_wanted(s->residency, true);
        tl_status loaded = patch == TL_NONE ? TL_OK : load(fork, s->residency, patch);
        if (!loaded || first) continue;
        first = loaded;
        failed = fork; /* keeps its message */
        fork = NULL;
    }
    tli_ctx_join(s->ctx, fork, TL_OK);
    return first ? tli_ctx_join(s->ctx, failed, first) : st;
}

tl_status tl_residency_serve(tl_ctx *ctx, tl_residency *r)
{
    service s = {ctx, r};
    return tli_parallel(ctx, tl_ctx_thread_count(ctx), 1, serve, &s);
}

void tl_residency_stop(tl_residency *r)
{
    tli_lock_take(&r->lock);
    r->is_over = true;
    tli_bell_ring(&r->bell);
    tli_lock_give(&r->lock);
}
