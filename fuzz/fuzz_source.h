/* What the fuzz targets of readers that take a source share. */
#ifndef TETRALOD_FUZZ_SOURCE_H
#define TETRALOD_FUZZ_SOURCE_H

#include "fuzz_grid.h"

#include "formats/formats_reader.h"

static inline void fuzz_source_fill(tli_source *source, const char *path, const uint8_t *bytes,
                                    size_t byte_count)
{
    *source = (tli_source){.path = path, .map = {.bytes = bytes, .byte_count = byte_count}};
    source->head_bytes = byte_count < TLI_HEAD_BYTES ? byte_count : TLI_HEAD_BYTES;
    for (size_t i = 0; i < source->head_bytes; i++)
        source->head[i] = bytes[i] ? (char)bytes[i] : ' ';
}

/* Reads bytes under a name with a reader. */
static inline void fuzz_read(tli_read_fn *read, const char *path, const uint8_t *bytes,
                             size_t byte_count)
{
    tl_ctx *ctx = fuzz_ctx_create();
    tl_read_opts opts = tl_read_opts_defaults();
    tli_source source;
    fuzz_source_fill(&source, path, bytes, byte_count);
    tli_grid grid;
    tli_grid_init(ctx, &grid);
    fuzz_finish(ctx, read(ctx, &source, &opts, &grid), &grid);
}

/* Lists the steps of bytes under a name. */
static inline void fuzz_steps(tli_steps_fn *list, const char *path, const uint8_t *bytes,
                              size_t byte_count)
{
    tl_ctx *ctx = fuzz_ctx_create();
    tl_read_opts opts = tl_read_opts_defaults();
    tli_source source;
    tl_steps steps = {0};
    fuzz_source_fill(&source, path, bytes, byte_count);
    tl_status st = list(ctx, &source, &opts, &steps);
    FUZZ_CHECK(st ? tl_ctx_message(ctx)[0] != 0 : steps.count >= 1);
    tl_steps_release(ctx, &steps);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
}

#endif
