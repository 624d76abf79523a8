/* A buffer of bytes that grows. */
#include "codec/codec.h"

#include <string.h>

void tli_bytes_open(tl_ctx *ctx, tli_bytes *buffer)
{
    *buffer = (tli_bytes){.ctx = ctx};
}

void tli_bytes_close(tli_bytes *buffer)
{
    tl_mem_free(buffer->ctx, buffer->bytes);
    *buffer = (tli_bytes){.ctx = buffer->ctx};
}

tl_status tli_bytes_reserve(tli_bytes *buffer, size_t more)
{
    tl_status st = TL_OK;
    size_t needed, doubled;
    if (more <= buffer->capacity - buffer->count) return TL_OK;
    if (!tli_add_size(buffer->count, more, &needed))
        return tl_fail(buffer->ctx, TL_ERR_MEMORY, "a buffer of more bytes than can be addressed");
    if (tli_mul_size(buffer->capacity, 2, &doubled) && doubled > needed) needed = doubled;
    buffer->bytes = tl_mem_resize(buffer->ctx, buffer->bytes, needed, 1, &st);
    if (!st) buffer->capacity = needed;
    return st;
}

tl_status tli_bytes_append(tli_bytes *buffer, const void *bytes, size_t byte_count)
{
    tl_status st = tli_bytes_reserve(buffer, byte_count);
    if (st || !byte_count) return st;
    memcpy(buffer->bytes + buffer->count, bytes, byte_count);
    buffer->count += byte_count;
    return TL_OK;
}
