/* Structs of options: the first field of each is its own size, so that they can grow. */
#include "base/base.h"

#include <string.h>

tl_status tli_opts_take(tl_ctx *ctx, const char *type, const void *given, void *opts,
                        size_t opts_bytes)
{
    size_t bytes;
    if (!given) return TL_OK;
    memcpy(&bytes, given, sizeof bytes);
    if (bytes < sizeof bytes || bytes > opts_bytes)
        return tl_fail(ctx, TL_ERR_ARG, "%s: options of %zu bytes, expected %zu to %zu", type,
                       bytes, sizeof bytes, opts_bytes);
    memcpy(opts, given, bytes);
    return TL_OK;
}
