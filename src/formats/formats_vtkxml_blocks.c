/* VTK XML: unpacks one block. Each is a zlib stream, a bare LZ4 block or a whole .xz stream. All
 * memory of the libraries comes from the context. */
#define ZLIB_CONST /* zlib: input by pointers to const */
#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <limits.h>

#include "formats/formats_vtkxml.h"

/* The most that a packed byte can become, from the formats: deflate 1032, LZ4 255. LZMA has no such
 * limit; the one taken here is twice what its cheapest matches reach. */
#define ZLIB_GROWTH 1032u
#define LZ4_GROWTH 255u
#define LZMA_GROWTH 16384u
/* The strongest preset's dictionary is 64 MiB. */
#define LZMA_MEMORY_MAX (96u << 20)

struct tli_vx_unpacker {
    tl_ctx *ctx;
    tli_vx_packing packing;
    tl_status memory; /* of the requests of the libraries, which know no status */
    z_stream zlib;
    lzma_allocator lzma_memory;
};

static void *zlib_alloc(void *unpacker, uInt count, uInt elem_bytes)
{
    tli_vx_unpacker *u = unpacker;
    return tl_mem_alloc(u->ctx, count, elem_bytes, &u->memory);
}

static void *lzma_alloc(void *unpacker, size_t count, size_t elem_bytes)
{
    tli_vx_unpacker *u = unpacker;
    return tl_mem_alloc(u->ctx, count, elem_bytes, &u->memory);
}

static void library_free(void *unpacker, void *block)
{
    tl_mem_free(((tli_vx_unpacker *)unpacker)->ctx, block);
}

tl_status tli_vx_unpacker_create(tl_ctx *ctx, tli_vx_packing packing, tli_vx_unpacker **unpacker)
{
    tl_status st = TL_OK;
    tli_vx_unpacker *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    made->ctx = ctx;
    made->packing = packing;
    made->lzma_memory = (lzma_allocator){lzma_alloc, library_free, made};
    made->zlib.zalloc = zlib_alloc;
    made->zlib.zfree = library_free;
    made->zlib.opaque = made;
    if (packing == TLI_VX_ZLIB && inflateInit(&made->zlib) != Z_OK) {
        st = made->memory ? made->memory : tl_fail(ctx, TL_ERR_MEMORY, "zlib can't be started");
        tl_mem_free(ctx, made);
        return st;
    }
    *unpacker = made;
    return TL_OK;
}

void tli_vx_unpacker_destroy(tl_ctx *ctx, tli_vx_unpacker *unpacker)
{
    if (!unpacker) return;
    if (unpacker->packing == TLI_VX_ZLIB) inflateEnd(&unpacker->zlib);
    tl_mem_free(ctx, unpacker);
}

/* zlib counts in 32 bits, so large blocks go in parts. */
static const char *unpack_zlib(z_stream *z, const uint8_t *packed, size_t packed_bytes,
                               uint8_t *block, size_t block_bytes)
{
    size_t in_left = packed_bytes, out_left = block_bytes;
    int result = inflateReset(z);
    z->next_in = packed;
    z->next_out = block;
    while (result == Z_OK) {
        uInt in_part = in_left < UINT_MAX ? (uInt)in_left : UINT_MAX;
        uInt out_part = out_left < UINT_MAX ? (uInt)out_left : UINT_MAX;
        z->avail_in = in_part;
        z->avail_out = out_part;
        bool is_last = in_part == in_left && out_part == out_left;
        result = inflate(z, is_last ? Z_FINISH : Z_NO_FLUSH);
        in_left -= in_part - z->avail_in;
        out_left -= out_part - z->avail_out;
        if (is_last && result == Z_OK) result = Z_BUF_ERROR;
    }
    if (result != Z_STREAM_END)
        return result == Z_BUF_ERROR ? "its zlib stream is too long or too short"
                                     : "its zlib stream is damaged";
    return out_left ? "its zlib stream ends too early" : NULL;
}

static const char *unpack_lz4(const uint8_t *packed, size_t packed_bytes, uint8_t *block,
                              size_t block_bytes)
{
    if (packed_bytes > INT_MAX || block_bytes > INT_MAX) return "its LZ4 block passes 2 GiB";
    int made = LZ4_decompress_safe((const char *)packed, (char *)block, (int)packed_bytes,
                                   (int)block_bytes);
    if (made < 0) return "its LZ4 block is damaged";
    return (size_t)made == block_bytes ? NULL : "its LZ4 block ends too early";
}

static const char *unpack_lzma(const lzma_allocator *memory, const uint8_t *packed,
                               size_t packed_bytes, uint8_t *block, size_t block_bytes)
{
    uint64_t limit = LZMA_MEMORY_MAX;
    size_t in_at = 0, out_at = 0;
    lzma_ret result = lzma_stream_buffer_decode(&limit, 0, memory, packed, &in_at, packed_bytes,
                                                block, &out_at, block_bytes);
    if (result == LZMA_MEMLIMIT_ERROR) return "its LZMA dictionary passes 96 MiB";
    if (result != LZMA_OK) return "its LZMA stream is damaged";
    return out_at == block_bytes ? NULL : "its LZMA stream ends too early";
}

tl_status tli_vx_unpack(tli_vx_unpacker *unpacker, const uint8_t *packed, size_t packed_bytes,
                        uint8_t *block, size_t block_bytes, const char **wrong)
{
    *wrong = NULL;
    if (block_bytes == 0) return TL_OK;
    switch (unpacker->packing) {
    case TLI_VX_ZLIB:
        *wrong = unpack_zlib(&unpacker->zlib, packed, packed_bytes, block, block_bytes);
        break;
    case TLI_VX_LZ4: *wrong = unpack_lz4(packed, packed_bytes, block, block_bytes); break;
    case TLI_VX_LZMA:
        *wrong = unpack_lzma(&unpacker->lzma_memory, packed, packed_bytes, block, block_bytes);
        break;
    case TLI_VX_PLAIN: TL_ASSERT(!"a packing without blocks");
    }
    return unpacker->memory ? unpacker->memory : *wrong ? TL_ERR_FORMAT : TL_OK;
}

uint64_t tli_vx_unpacked_max(tli_vx_packing packing, uint64_t packed_bytes)
{
    uint64_t growth = packing == TLI_VX_ZLIB  ? ZLIB_GROWTH
                      : packing == TLI_VX_LZ4 ? LZ4_GROWTH
                                              : LZMA_GROWTH;
    return packed_bytes > UINT64_MAX / growth ? UINT64_MAX : packed_bytes * growth;
}
