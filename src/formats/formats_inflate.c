/* Whole files and runs packed by gzip or zlib (RFC 1950, 1952), unpacked into memory of the
 * context. The most that comes out is bounded by what deflate can make of the bytes that are there,
 * so that a file's word is not taken for it. */
#define ZLIB_CONST /* zlib: input by pointers to const */
#include <zlib.h>

#include <inttypes.h>
#include <limits.h>

#include "formats/formats_scan.h"

/* The most that a packed byte can become. */
#define DEFLATE_GROWTH 1032u
/* Bytes that are allocated at first where the size is not known, as a multiple of the packed ones.
 */
#define FIRST_GROWTH 4u
#define FIRST_BYTES ((size_t)64 << 10)
#define WINDOW_BITS_AUTO (15 + 32) /* zlib: tells gzip and zlib heads by itself */

typedef struct unpacking {
    tl_ctx *ctx;
    const char *path;
    tl_status memory; /* of zlib's requests */
    z_stream z;
    uint8_t *out;
    size_t used, room, most;
    bool at_member_end;
} unpacking;

static void *zlib_alloc(void *user, uInt count, uInt elem_bytes)
{
    unpacking *u = user;
    return tl_mem_alloc(u->ctx, count, elem_bytes, &u->memory);
}

static void zlib_free(void *user, void *block)
{
    tl_mem_free(((unpacking *)user)->ctx, block);
}

bool tli_is_gzip(const uint8_t *bytes, uint64_t byte_count)
{
    return byte_count >= 2 && bytes[0] == 0x1f && bytes[1] == 0x8b;
}

static tl_status grow(unpacking *u)
{
    tl_status st = TL_OK;
    size_t room = u->room > u->most / 2 ? u->most : 2 * u->room;
    u->out = tl_mem_resize(u->ctx, u->out, room, 1, &st);
    if (!st) u->room = room;
    return st;
}

/* One call of zlib, whose counts have 32 bits. *done: the streams are at an end. */
static tl_status step(unpacking *u, const uint8_t *packed, uint64_t packed_bytes, uint64_t *taken,
                      bool *done)
{
    uint64_t left = packed_bytes - *taken;
    size_t space = u->room - u->used;
    if (u->at_member_end && (left == 0 || !tli_is_gzip(packed + *taken, left))) {
        *done = true; /* what follows the last member is padding */
        return TL_OK;
    }
    if (u->at_member_end && inflateReset(&u->z) != Z_OK)
        return tl_fail(u->ctx, TL_ERR_MEMORY, "zlib can't be started");
    u->at_member_end = false;
    u->z.next_in = packed + *taken;
    u->z.avail_in = left < UINT_MAX ? (uInt)left : UINT_MAX;
    u->z.next_out = u->out + u->used;
    u->z.avail_out = space < UINT_MAX ? (uInt)space : UINT_MAX;
    const uInt in_before = u->z.avail_in, out_before = u->z.avail_out;
    int result = inflate(&u->z, Z_NO_FLUSH);
    *taken += in_before - u->z.avail_in;
    u->used += out_before - u->z.avail_out;
    if (u->memory) return u->memory;
    u->at_member_end = result == Z_STREAM_END;
    if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
        return tl_fail(u->ctx, TL_ERR_FORMAT, "'%s': packed byte %" PRIu64 ": damaged: %s", u->path,
                       *taken, u->z.msg ? u->z.msg : "not what zlib or gzip writes");
    if (u->at_member_end || u->z.avail_out > 0) {
        if (!u->at_member_end && *taken == packed_bytes)
            return tl_fail(u->ctx, TL_ERR_FORMAT,
                           "'%s': the packed data end after %" PRIu64 " bytes, inside a stream",
                           u->path, packed_bytes);
        return TL_OK;
    }
    if (u->used < u->room) return TL_OK;
    if (u->room < u->most) return grow(u);
    return tl_fail(u->ctx, TL_ERR_FORMAT, "'%s': more than %zu bytes are packed, which none may be",
                   u->path, u->most);
}

/* With room for one byte more than is expected, the end of the stream is seen. */
static size_t limit_of(uint64_t packed_bytes, uint64_t byte_count_max)
{
    uint64_t most = packed_bytes > (SIZE_MAX - 1) / DEFLATE_GROWTH ? SIZE_MAX - 1
                                                                   : packed_bytes * DEFLATE_GROWTH;
    if (byte_count_max < most) most = byte_count_max;
    return (size_t)most + 1;
}

tl_status tli_inflate(tl_ctx *ctx, const char *path, const uint8_t *packed, uint64_t packed_bytes,
                      uint64_t byte_count_max, bool exact, tli_map *map)
{
    unpacking u = {.ctx = ctx, .path = path, .most = limit_of(packed_bytes, byte_count_max)};
    tl_status st = TL_OK;
    if (exact && u.most - 1 < byte_count_max)
        return tl_fail(ctx, TL_ERR_FORMAT,
                       "'%s': %" PRIu64 " packed bytes can't become the %" PRIu64 " expected", path,
                       packed_bytes, byte_count_max);
    u.room = exact || packed_bytes > u.most / FIRST_GROWTH ? u.most
                                                           : (size_t)packed_bytes * FIRST_GROWTH;
    if (!exact && u.room < FIRST_BYTES) u.room = u.most < FIRST_BYTES ? u.most : FIRST_BYTES;
    u.out = tl_mem_alloc(ctx, u.room, 1, &st);
    u.z = (z_stream){.zalloc = zlib_alloc, .zfree = zlib_free, .opaque = &u};
    if (!st && inflateInit2(&u.z, WINDOW_BITS_AUTO) != Z_OK)
        st = u.memory ? u.memory : tl_fail(ctx, TL_ERR_MEMORY, "zlib can't be started");
    uint64_t taken = 0;
    for (bool done = false; !st && !done;) st = step(&u, packed, packed_bytes, &taken, &done);
    inflateEnd(&u.z);
    if (!st && exact && u.used != byte_count_max)
        st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': %zu bytes are packed, expected %" PRIu64, path,
                     u.used, byte_count_max);
    if (st) {
        tl_mem_free(ctx, u.out);
        return st;
    }
    *map = (tli_map){.bytes = u.out, .byte_count = u.used, .owned = u.out};
    return TL_OK;
}
