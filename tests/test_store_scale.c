/* A model of 100,000 patches, as many as some 100 million tets have: what opening it and drawing
 * its coarsest mesh read and take, how large the index is, and that writing needs little memory.
 * The patches are small, since only the index counts here. */
#include <time.h>

#include "check_ctx.h"
#include "make_store.h"

/* Aims of the format. */
#define OPEN_BYTES_MAX 1e6
#define OPEN_MS_MAX 10.0
#define FIRST_MESH_MS_MAX 50.0
#define PATCH_BYTES_AIM 64.0
#define CHANNEL_BYTES_AIM 16.0
/* A page, its draft and the blobs of a group; sink and codec included. */
#define WRITER_BYTES_MAX 2e6

static double cpu_ms(void)
{
    struct timespec now;
    CHECK_EQ(clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now), 0);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

/* Segments take up twelve patches and hand on six. */
static void make_large(make_store *m, uint32_t channel_count)
{
    memset(m, 0, sizeof *m);
    m->level_count = 9;
    m->coarse_segments = 33;
    m->channel_count = channel_count;
    m->vert_count = 5;
    m->outputs = 6;
    make_store_open(m);
}

static void decode_roots(tl_ctx *ctx, const tl_store *store)
{
    const tl_store_head *head = tl_store_get_head(store);
    for (uint32_t p = 0; p < head->root_patch_count; p++) {
        tl_patch *patch = NULL;
        double values[3 * 8];
        CHECK_OK(ctx, tl_store_topology(ctx, store, p, &patch));
        for (uint32_t c = 0; c < head->channel_count; c++)
            CHECK_OK(ctx, tl_store_channel_values(ctx, store, p, patch, c, values));
        tl_patch_destroy(ctx, patch);
    }
}

static void test_opening(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1), *content = check_ctx_create(1);
    make_store m;
    tl_store *store = NULL;
    make_large(&m, 1);
    CHECK_OK(ctx, make_store_write(ctx, content, &m, "m.tlod"));
    CHECK_BOUND("bytes of memory while writing", (double)tl_ctx_peak_bytes(ctx), WRITER_BYTES_MAX);
    CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store)); /* warms the file up */
    tl_store_close(store);

    tl_ctx_reset_peak(ctx);
    double start = cpu_ms();
    CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store));
    const double opened = cpu_ms();
    decode_roots(ctx, store);
    const double drawn = cpu_ms();
    printf("%u patches, %u roots, %.1f MB; %u pages read\n", m.head.patch_count,
           m.head.root_patch_count, (double)tl_store_get_head(store)->file_bytes * 1e-6,
           tl_store_pages_read(store));
    CHECK_BOUND("ms of CPU to open", opened - start, OPEN_MS_MAX);
    CHECK_BOUND("ms of CPU to the first mesh", drawn - start, FIRST_MESH_MS_MAX);
    CHECK_BOUND("bytes read for it", (double)tl_store_bytes_read(store), OPEN_BYTES_MAX);

    start = cpu_ms();
    CHECK_OK(ctx, tl_store_check(ctx, store, TL_CHECK_FAST));
    printf("whole index proved in %.1f ms of CPU, %u pages, %.1f MB of memory\n", cpu_ms() - start,
           tl_store_pages_read(store), (double)tl_ctx_peak_bytes(ctx) * 1e-6);
    tl_store_close(store);
    tl_ctx_destroy(content);
    tl_ctx_destroy(ctx);
}

/* All of the file that is neither blob nor its padding and checksum. */
static double index_bytes(tl_ctx *ctx, const tl_store *store)
{
    const tl_store_head *head = tl_store_get_head(store);
    uint64_t payload = 0;
    for (uint32_t p = 0; p < head->patch_count; p++) {
        tl_patch_info info;
        CHECK_OK(ctx, tl_store_patch(ctx, store, p, &info));
        payload += (info.topology_bytes + 7) / 8 * 8 + 8;
        for (uint32_t c = 0; c < head->channel_count; c++)
            payload += (info.channel_bytes[c] + 7) / 8 * 8 + 8;
    }
    return (double)(head->file_bytes - payload);
}

static void test_index_size(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    for (uint32_t channels = 1; channels <= 7; channels += 3) {
        make_store m;
        tl_store *store = NULL;
        make_large(&m, channels);
        m.level_count = 6;
        make_store_open(&m);
        CHECK_OK(ctx, make_store_write(ctx, ctx, &m, "m.tlod"));
        CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store));
        printf("%u channels, %u patches: ", channels, m.head.patch_count);
        CHECK_BOUND("bytes of index a patch", index_bytes(ctx, store) / m.head.patch_count,
                    PATCH_BYTES_AIM + CHANNEL_BYTES_AIM * channels);
        tl_store_close(store);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_opening),
        cmocka_unit_test(test_index_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
