/* What the tests of readers that take a source share: reading bytes under a name, and files that
 * stand beside each other. */
#ifndef TETRALOD_TESTS_CHECK_SOURCE_H
#define TETRALOD_TESTS_CHECK_SOURCE_H

#include "check_grid.h"

#include "formats/formats_reader.h"

typedef tli_read_fn *source_reader;

/* Bytes under a name; opts may be NULL. The arg of source_read. */
typedef struct source_case {
    const char *path;
    source_reader read;
    const tl_read_opts *opts;
} source_case;

static inline void source_fill(const char *path, const tli_map *map, tli_source *source)
{
    memset(source, 0, sizeof *source);
    source->path = path;
    source->map = *map;
    source->head_bytes =
        map->byte_count < TLI_HEAD_BYTES ? (size_t)map->byte_count : TLI_HEAD_BYTES;
    for (size_t i = 0; i < source->head_bytes; i++)
        source->head[i] = map->bytes[i] ? (char)map->bytes[i] : ' ';
}

/* A grid_reader. */
static inline tl_status source_read(tl_ctx *ctx, const tli_map *map, void *arg, tli_grid *grid)
{
    const source_case *c = arg;
    tl_read_opts opts = tl_read_opts_defaults();
    tli_source source;
    source_fill(c->path, map, &source);
    return c->read(ctx, &source, c->opts ? c->opts : &opts, grid);
}

static inline void put_file(const char *path, const void *bytes, size_t byte_count)
{
    FILE *file = fopen(path, "wb");
    CHECK(file != NULL);
    if (byte_count) CHECK_EQ(fwrite(bytes, 1, byte_count, file), byte_count);
    CHECK_EQ(fclose(file), 0);
}

/* Expects a text in the message of the last failure. */
static inline void check_says(tl_ctx *ctx, const char *text)
{
    if (!strstr(tl_ctx_message(ctx), text))
        fail_msg("\"%s\", expected \"%s\"", tl_ctx_message(ctx), text);
}

/* Fails each allocation in turn by a budget that grows: an error or a whole grid, nothing left. */
static inline void source_survives_budgets(const source_case *c, const void *bytes,
                                           size_t byte_count, size_t step)
{
    tl_status st = TL_ERR_BUDGET;
    for (size_t budget = step; st == TL_ERR_BUDGET; budget += step) {
        tl_ctx *ctx = grid_ctx(budget, 1);
        tli_grid grid;
        source_case copy = *c;
        st = grid_read(ctx, source_read, &copy, bytes, byte_count, &grid);
        if (st && st != TL_ERR_BUDGET) fail_msg("%s", tl_ctx_message(ctx));
        tli_grid_release(&grid);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
}

#endif
