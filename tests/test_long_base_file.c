/* A real file of more than 4 GiB, written, patched on both sides of the border, and read back. */
#include "check.h"

#include "base/base_file.h"

#include <sys/statvfs.h>
#include <unistd.h>

#define GIB ((uint64_t)1 << 30)
#define PIECE_WORDS ((size_t)1 << 20)

static uint64_t word_at(uint64_t i)
{
    return i * 0x9e3779b97f4a7c15u;
}

static void test_sink_over_4_gib(void **state)
{
    (void)state;
    const uint64_t bytes = 4 * GIB + GIB / 8;
    struct statvfs disk;
    if (statvfs(".", &disk) || (uint64_t)disk.f_bavail * disk.f_frsize < 2 * bytes)
        CHECK_SKIP("less than 8.25 GiB of disk are free");
    tl_ctx *ctx = NULL;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    tli_sink *sink = NULL;
    tl_status st = TL_OK;
    uint64_t *piece = tl_mem_alloc(ctx, PIECE_WORDS, sizeof *piece, &st);
    CHECK_OK(ctx, st);
    CHECK_OK(ctx, tli_sink_open(ctx, "large", &sink));
    for (uint64_t i = 0; i < bytes / 8; i += PIECE_WORDS) {
        for (size_t k = 0; k < PIECE_WORDS; k++) piece[k] = word_at(i + k);
        CHECK_OK(ctx, tli_sink_write(sink, piece, PIECE_WORDS * 8));
    }
    CHECK_EQ(tli_sink_tell(sink), bytes);
    CHECK_OK(ctx, tli_sink_patch(sink, 4 * GIB - 8, "across the border", 16));
    CHECK_OK(ctx, tli_sink_patch(sink, 8, "low word", 8));
    CHECK_OK(ctx, tli_sink_close(sink, true));

    tli_map map;
    CHECK_OK(ctx, tli_map_open(ctx, "large", &map));
    CHECK_EQ(map.byte_count, bytes);
    CHECK(memcmp(map.bytes + 4 * GIB - 8, "across the borde", 16) == 0);
    CHECK(memcmp(map.bytes + 8, "low word", 8) == 0);
    uint64_t wrong = 0;
    for (uint64_t i = 0; i < bytes / 8; i++) {
        uint64_t word;
        memcpy(&word, map.bytes + i * 8, 8);
        wrong += word != word_at(i);
        if (i % PIECE_WORDS == 0) tli_map_forget(&map, 0, i * 8);
    }
    CHECK_EQ(wrong, 3); /* the patched words alone */
    tli_map_close(ctx, &map);
    unlink("large");
    tl_mem_free(ctx, piece);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sink_over_4_gib)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
