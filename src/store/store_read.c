/* Opens a .tlod file: one read of 64 KiB, which holds the head of most models. */
#include <math.h>
#include <time.h>

#include "store/store_read.h"

/* ---- reading ---- */

/* Seconds that a slow reader sleeps before it looks whether it is asked to end. */
static const double NAP_S = 0.02;

void tl_store_set_throttle(const tl_store *store, uint64_t bytes_s)
{
    atomic_store(&store->kept->throttle_bytes_s, bytes_s);
}

/* Waits as long as a disk of that speed takes for byte_count, after what others asked for. */
static tl_status sleep_as_disk(tl_ctx *ctx, tli_store_kept *kept, uint64_t bytes_s,
                               size_t byte_count)
{
    const uint64_t takes = (uint64_t)((double)byte_count / (double)bytes_s * 1e9);
    uint64_t now = (uint64_t)(tli_clock_s() * 1e9), end;
    uint64_t free = atomic_load(&kept->throttle_free_ns);
    do end = (free > now ? free : now) + takes;
    while (!atomic_compare_exchange_weak(&kept->throttle_free_ns, &free, end));
    while (now < end) {
        if (tli_ctx_is_cancelled(ctx))
            return tl_fail(ctx, TL_ERR_CANCELLED, "cancelled while reading");
        const double left = fmin((double)(end - now) / 1e9, NAP_S);
        nanosleep(&(struct timespec){.tv_nsec = (long)(left * 1e9)}, NULL);
        now = (uint64_t)(tli_clock_s() * 1e9);
    }
    return TL_OK;
}

tl_status tli_store_read(tl_ctx *ctx, const tl_store *store, uint64_t ofs, void *bytes,
                         size_t byte_count)
{
    const uint64_t throttle = atomic_load(&store->kept->throttle_bytes_s);
    if (throttle) {
        tl_status st = sleep_as_disk(ctx, store->kept, throttle, byte_count);
        if (st) return st;
    }
    atomic_fetch_add_explicit(&store->kept->bytes_read, byte_count, memory_order_relaxed);
    return tli_pread_read(ctx, &store->reader, ofs, bytes, byte_count);
}

/* ---- the head ---- */

/* What must be known before the checksum can be looked at. */
static tl_status examine(tl_ctx *ctx, const tli_pread *reader, const uint8_t *bytes,
                         size_t byte_count, uint64_t *head_bytes, uint64_t *identity)
{
    const char *path = reader->path;
    if (byte_count < TLI_STORE_MAGIC_BYTES ||
        memcmp(bytes, TLI_STORE_MAGIC, TLI_STORE_MAGIC_BYTES) != 0)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': is no .tlod file: its first bytes differ", path);
    const uint8_t *at = bytes + TLI_STORE_MAGIC_BYTES;
    if (byte_count < TLI_HEAD_FIXED_BYTES)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': ends at byte %zu, inside of its head", path,
                       byte_count);
    const uint32_t version = tli_take_u32(&at), flags = tli_take_u32(&at);
    if (version != TL_STORE_VERSION)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "'%s': has format version %u; this library reads version %u", path, version,
                       TL_STORE_VERSION);
    if (flags)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "'%s': has flags 0x%x in its head, which version %u does not know", path,
                       flags, version);
    const uint64_t file_bytes = tli_take(&at, 8);
    *head_bytes = tli_take(&at, 8);
    *identity = tli_take(&at, 8);
    if (file_bytes != reader->byte_count)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': has %llu bytes where its head says %llu", path,
                       (unsigned long long)reader->byte_count, (unsigned long long)file_bytes);
    if (*head_bytes % TLI_STORE_ALIGN ||
        *head_bytes < TLI_HEAD_FIXED_BYTES + TLI_STORE_HASH_BYTES || *head_bytes > file_bytes ||
        *head_bytes > TLI_STORE_HEAD_BYTES_MAX)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': its head has %llu bytes, which can't be", path,
                       (unsigned long long)*head_bytes);
    return TL_OK;
}

static tl_status check_head_hash(tl_ctx *ctx, const tl_store *store, const uint8_t *bytes,
                                 size_t byte_count, uint64_t identity)
{
    const size_t hashed = byte_count - TLI_STORE_HASH_BYTES;
    const uint8_t *at = bytes + hashed;
    uint64_t seed = tli_store_seed(identity, TLI_PART_HEAD, 0, 0);
    if (tli_store_hash(seed, bytes, hashed) == tli_take(&at, TLI_STORE_HASH_BYTES)) return TL_OK;
    return tl_fail(ctx, TL_ERR_FORMAT, "'%s': the checksum of its head is wrong: it is damaged",
                   store->reader.path);
}

static tl_status read_head(tl_ctx *ctx, tl_store *store)
{
    tl_status st = TL_OK;
    uint64_t head_bytes = 0, identity = 0, file_bytes = store->reader.byte_count;
    size_t first = file_bytes < TLI_STORE_FIRST_BYTES ? (size_t)file_bytes : TLI_STORE_FIRST_BYTES;
    atomic_uint_least64_t bytes_read = first;
    uint8_t *bytes = tl_mem_alloc(ctx, first, 1, &st);
    if (!st) st = tli_pread_read(ctx, &store->reader, 0, bytes, first);
    if (!st) st = examine(ctx, &store->reader, bytes, first, &head_bytes, &identity);
    if (!st && head_bytes > first) {
        bytes = tl_mem_resize(ctx, bytes, (size_t)head_bytes, 1, &st);
        if (!st)
            st = tli_pread_read(ctx, &store->reader, first, bytes + first,
                                (size_t)head_bytes - first);
        bytes_read = head_bytes;
    }
    if (!st) st = check_head_hash(ctx, store, bytes, (size_t)head_bytes, identity);
    if (!st) st = tli_head_unpack(ctx, store, bytes, (size_t)head_bytes - TLI_STORE_HASH_BYTES);
    if (!st) {
        size_t room = sizeof *store->kept + store->page_count * sizeof store->kept->pages[0];
        store->kept = tli_arena_alloc(&store->arena, room, 1, &st);
        if (!st) {
            memset(store->kept, 0, room);
            atomic_store(&store->kept->bytes_read, bytes_read);
        }
    }
    tl_mem_free(ctx, bytes);
    return st;
}

/* ---- opening and closing ---- */

/* Takes over the reader. */
static tl_status open_reader(tl_ctx *ctx, tli_pread *reader, tl_store **store)
{
    tl_status st = TL_OK;
    tl_store *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    if (st) {
        tli_pread_close(ctx, reader);
        return st;
    }
    s->ctx = ctx;
    s->reader = *reader;
    tli_arena_open(ctx, &s->arena);
    st = read_head(ctx, s);
    if (st)
        tl_store_close(s);
    else
        *store = s;
    return st;
}

tl_status tl_store_open(tl_ctx *ctx, const char *path, tl_store **store)
{
    tli_pread reader;
    *store = NULL;
    tl_status st = tli_pread_open(ctx, path, &reader);
    return st ? st : open_reader(ctx, &reader, store);
}

tl_status tli_store_open_bytes(tl_ctx *ctx, const char *name, const uint8_t *bytes,
                               size_t byte_count, tl_store **store)
{
    tli_pread reader = {.path = name, .bytes = bytes, .byte_count = byte_count, .fd = -1};
    *store = NULL;
    return open_reader(ctx, &reader, store);
}

void tl_store_close(tl_store *store)
{
    if (!store) return;
    tl_ctx *ctx = store->ctx;
    for (uint32_t p = 0; store->kept && p < store->page_count; p++)
        tli_store_page_release(atomic_load(&store->kept->pages[p]));
    tli_store_tables *tables = store->kept ? atomic_load(&store->kept->tables) : NULL;
    if (tables) {
        tl_codec_destroy(tables->ctx, tables->codec);
        tl_mem_free(tables->ctx, tables);
    }
    tli_pread_close(ctx, &store->reader);
    tli_arena_close(&store->arena);
    tl_mem_free(ctx, store);
}

bool tl_store_is(tl_ctx *ctx, const char *path)
{
    tli_pread reader;
    uint8_t bytes[TLI_STORE_MAGIC_BYTES];
    tl_status st = tli_pread_open(ctx, path, &reader);
    if (!st) {
        st = tli_pread_read(ctx, &reader, 0, bytes, sizeof bytes);
        tli_pread_close(ctx, &reader);
    }
    if (st) tl_ctx_clear(ctx);
    return !st && memcmp(bytes, TLI_STORE_MAGIC, sizeof bytes) == 0;
}

/* ---- looking ---- */

const tl_store_head *tl_store_get_head(const tl_store *store)
{
    return &store->head;
}

uint64_t tl_store_bytes_read(const tl_store *store)
{
    return atomic_load(&store->kept->bytes_read);
}

uint32_t tl_store_pages_read(const tl_store *store)
{
    return atomic_load(&store->kept->pages_read);
}

tli_blob tli_store_codec_bytes(const tl_store *store)
{
    return store->codec;
}

uint64_t tli_store_payload_end(const tl_store *store, uint32_t page)
{
    if (page) return store->pages[page].page_ofs;
    return store->page_count > 1 ? store->pages[1].payload_ofs : store->head.file_bytes;
}

uint32_t tli_store_level_of(const tl_store *store, uint32_t segment)
{
    uint32_t level = store->head.level_count - 1;
    while (level && segment >= store->level_end[level]) level--;
    return level;
}
