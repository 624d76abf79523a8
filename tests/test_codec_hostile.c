/* Bytes that are no blob, and allocations that fail: an error, nothing read or written elsewhere,
 * nothing lost. */
#include "check.h"

#include "fail_alloc.h"
#include "make_patch.h"

/* A patch with regions and odd tets, a channel on its vertices, and the blobs of both. */
typedef struct blobs {
    tl_patch *patch;
    tl_codec *codec;
    int64_t *values;
    tli_bytes tables, topology, channel, raw_topology, raw_channel;
} blobs;

static const tli_coded_channel CHANNEL = {{TL_VALUE_LATTICE, 0.5}, TL_ON_VERTEX, 2};

static void open_blobs(tl_ctx *ctx, blobs *b)
{
    make_mesh m = make_grid(4);
    make_perturb(&m, 0.01, 4);
    make_two_regions(&m);
    m.tets[4 * 7] = m.tets[4 * 7 + 1]; /* a vertex twice */
    b->patch = make_patch(ctx, &make_lattice, &m);
    make_release(&m);
    CHECK_OK(ctx, tli_patch_arrange(ctx, b->patch, NULL, NULL));
    b->values = calloc(2 * b->patch->vert_count, sizeof *b->values);
    for (uint32_t i = 0; i < 2 * b->patch->vert_count; i++)
        b->values[i] = i % 11 ? (int64_t)(i * i % 57) : TL_IMAGE_NAN;
    const int64_t *values[1] = {b->values};
    b->codec = make_codec(ctx, &make_lattice, b->patch, &CHANNEL, 1, values);
    tli_bytes *all[] = {&b->tables, &b->topology, &b->channel, &b->raw_topology, &b->raw_channel};
    for (int i = 0; i < 5; i++) tli_bytes_open(ctx, all[i]);
    tli_trainer *trainer = NULL;
    CHECK_OK(ctx, tli_trainer_create(ctx, &make_lattice, &CHANNEL, 1, &trainer));
    CHECK_OK(ctx, tli_trainer_add(ctx, trainer, 2, b->patch, values));
    CHECK_OK(ctx, tli_trainer_write(trainer, &b->tables));
    tli_trainer_destroy(ctx, trainer);
    CHECK_OK(ctx, tli_topology_encode(ctx, b->codec, 0, b->patch, &b->topology, NULL));
    CHECK_OK(ctx, tli_topology_encode(ctx, NULL, TL_CLASS_RAW, b->patch, &b->raw_topology, NULL));
    CHECK_OK(ctx, tli_channel_encode(ctx, b->codec, 0, b->patch, 0, TL_ON_VERTEX, 2, b->values,
                                     &b->channel));
    CHECK_OK(ctx, tli_channel_encode(ctx, NULL, TL_CLASS_RAW, b->patch, 0, TL_ON_VERTEX, 2,
                                     b->values, &b->raw_channel));
}

static void close_blobs(tl_ctx *ctx, blobs *b)
{
    tl_patch_destroy(ctx, b->patch);
    tl_codec_destroy(ctx, b->codec);
    free(b->values);
    tli_bytes *all[] = {&b->tables, &b->topology, &b->channel, &b->raw_topology, &b->raw_channel};
    for (int i = 0; i < 5; i++) tli_bytes_close(all[i]);
}

/* What a decoder may say of bytes: fine, or none. */
typedef tl_status (*decode_fn)(tl_ctx *ctx, const blobs *b, const uint8_t *bytes, size_t count);

static tl_status decode_tables(tl_ctx *ctx, const blobs *b, const uint8_t *bytes, size_t count)
{
    tl_codec *codec = NULL;
    (void)b;
    tl_status st = tl_codec_read(ctx, bytes, count, &codec);
    CHECK((st == TL_OK) == (codec != NULL));
    tl_codec_destroy(ctx, codec);
    return st;
}

/* What comes out of a decoder may be used without a look at it. */
static void check_patch(const tl_patch *patch)
{
    for (uint32_t face = 0; face < 4 * patch->tet_count; face++) {
        uint32_t across = patch->opposite[face / 4][face % 4];
        CHECK(patch->tets[face / 4][face % 4] < patch->vert_count);
        CHECK(across == TL_NONE || (across < 4 * patch->tet_count && across != face &&
                                    patch->opposite[across / 4][across % 4] == face));
    }
    for (uint32_t v = 0; v < patch->vert_count; v++) CHECK(patch->shared[v] <= 1);
}

static tl_status decode_topology(tl_ctx *ctx, const blobs *b, const uint8_t *bytes, size_t count)
{
    tl_patch *patch = NULL;
    tl_status st = tl_topology_decode(ctx, b->codec, 0, bytes, count, &patch);
    CHECK((st == TL_OK) == (patch != NULL));
    if (patch) check_patch(patch);
    tl_patch_destroy(ctx, patch);
    return st;
}

static tl_status decode_raw_topology(tl_ctx *ctx, const blobs *b, const uint8_t *bytes,
                                     size_t count)
{
    tl_patch *patch = NULL;
    (void)b;
    tl_status st = tl_topology_decode(ctx, NULL, TL_CLASS_RAW, bytes, count, &patch);
    CHECK((st == TL_OK) == (patch != NULL));
    if (patch) check_patch(patch);
    tl_patch_destroy(ctx, patch);
    return st;
}

static tl_status decode_channel_as(tl_ctx *ctx, const blobs *b, unsigned class_,
                                   const uint8_t *bytes, size_t count)
{
    int64_t *values = malloc(2 * b->patch->vert_count * sizeof *values);
    tl_status st = tl_channel_decode(ctx, b->codec, class_, b->patch, 0, TL_ON_VERTEX, 2, bytes,
                                     count, values);
    free(values);
    return st;
}

static tl_status decode_channel(tl_ctx *ctx, const blobs *b, const uint8_t *bytes, size_t count)
{
    return decode_channel_as(ctx, b, 0, bytes, count);
}

static tl_status decode_raw_channel(tl_ctx *ctx, const blobs *b, const uint8_t *bytes, size_t count)
{
    return decode_channel_as(ctx, b, TL_CLASS_RAW, bytes, count);
}

/* Every prefix and a few changes of every byte; damaged bytes stand in a block of their size. A
 * change may give another patch, which then is a good one: bits that are not modelled leave no
 * trace behind. */
static void damage(tl_ctx *ctx, const blobs *b, const tli_bytes *good, decode_fn decode)
{
    static const uint8_t changes[] = {1, 2, 16, 0x80, 0xff, 0x55};
    size_t before = tl_ctx_current_bytes(ctx);
    CHECK_OK(ctx, decode(ctx, b, good->bytes, good->count));
    for (size_t count = 0; count < good->count; count++) {
        uint8_t *bytes = malloc(count + !count);
        memcpy(bytes, good->bytes, count);
        CHECK_STATUS(decode(ctx, b, bytes, count), TL_ERR_FORMAT);
        CHECK(*tl_ctx_message(ctx));
        free(bytes);
    }
    uint8_t *bytes = malloc(good->count + 1);
    memcpy(bytes, good->bytes, good->count);
    bytes[good->count] = 0;
    CHECK_STATUS(decode(ctx, b, bytes, good->count + 1), TL_ERR_FORMAT);
    for (size_t i = 0; i < good->count; i++)
        for (size_t c = 0; c < sizeof changes; c++) {
            bytes[i] = good->bytes[i] ^ changes[c];
            tl_status st = decode(ctx, b, bytes, good->count);
            if (st) CHECK_STATUS(st, TL_ERR_FORMAT);
            bytes[i] = good->bytes[i];
        }
    free(bytes);
    CHECK_EQ(tl_ctx_current_bytes(ctx), before);
}

static void damaged_bytes_are_refused(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    blobs b = {0};
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    open_blobs(ctx, &b);
    damage(ctx, &b, &b.tables, decode_tables);
    damage(ctx, &b, &b.topology, decode_topology);
    damage(ctx, &b, &b.channel, decode_channel);
    damage(ctx, &b, &b.raw_topology, decode_raw_topology);
    damage(ctx, &b, &b.raw_channel, decode_raw_channel);
    close_blobs(ctx, &b);
    tl_ctx_destroy(ctx);
}

static void random_bytes_are_refused(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    blobs b = {0};
    uint64_t seed = 77;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    open_blobs(ctx, &b);
    for (int i = 0; i < 4000; i++) {
        uint8_t bytes[200];
        size_t count = make_random(&seed) % sizeof bytes;
        for (size_t k = 0; k < count; k++) bytes[k] = (uint8_t)make_random(&seed);
        /* A plausible head in front, so that the stream is reached. */
        if (i & 1) memcpy(bytes, b.topology.bytes, 10);
        if (i & 2) bytes[1] &= 7;
        if ((i & 12) == 12) bytes[8] = bytes[9] = 0;
        CHECK_STATUS(decode_topology(ctx, &b, bytes, count), TL_ERR_FORMAT);
        bytes[0] = 1;
        bytes[1] = (uint8_t)(i & 2);
        CHECK_STATUS(decode_channel(ctx, &b, bytes, count), TL_ERR_FORMAT);
    }
    close_blobs(ctx, &b);
    tl_ctx_destroy(ctx);
}

/* A head that promises the most tets in a few bytes. */
static void counts_are_checked_before_they_cost(void **state)
{
    (void)state;
    const uint8_t bytes[64] = {1, 0, 0xff, 0xff, 0xff, 0xff, 0x07};
    tl_ctx *ctx = NULL;
    blobs b = {0};
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    open_blobs(ctx, &b);
    tl_ctx_reset_peak(ctx);
    size_t before = tl_ctx_current_bytes(ctx);
    CHECK_STATUS(decode_topology(ctx, &b, bytes, sizeof bytes), TL_ERR_FORMAT);
    CHECK_BOUND("bytes for a head that lies", (double)(tl_ctx_peak_bytes(ctx) - before), 1000);
    tl_patch *none = NULL;
    CHECK_STATUS(tl_topology_decode(ctx, b.codec, TL_CLASS_COUNT, bytes, sizeof bytes, &none),
                 TL_ERR_ARG);
    close_blobs(ctx, &b);
    tl_ctx_destroy(ctx);
}

/* ---- allocations that fail ---- */

static tl_status encode_and_decode(tl_ctx *ctx, void *arg)
{
    const make_mesh *m = arg;
    int64_t values[64];
    const int64_t *channels[1] = {values};
    tl_patch patch = {.vert_count = (uint32_t)m->vert_count, .tet_count = (uint32_t)m->tet_count};
    tl_patch *back = NULL;
    tli_trainer *trainer = NULL;
    tl_codec *codec = NULL;
    tli_bytes bytes, channel;
    tl_status st = TL_OK;
    tli_bytes_open(ctx, &bytes);
    tli_bytes_open(ctx, &channel);
    patch.places = tl_mem_zalloc(ctx, m->vert_count, sizeof *patch.places, &st);
    patch.shared = tl_mem_zalloc(ctx, m->vert_count, 1, &st);
    patch.tets = tl_mem_alloc(ctx, m->tet_count, sizeof *patch.tets, &st);
    for (size_t i = 0; i < 64; i++) values[i] = (int64_t)(i * i);
    for (size_t i = 0; i < 4 * m->tet_count && !st; i++)
        patch.tets[i / 4][i % 4] = (uint16_t)m->tets[i];
    if (!st) st = tli_patch_arrange(ctx, &patch, NULL, NULL);
    if (!st) st = tli_trainer_create(ctx, &make_lattice, &CHANNEL, 1, &trainer);
    if (!st) st = tli_trainer_add(ctx, trainer, 1, &patch, channels);
    if (!st) st = tli_trainer_write(trainer, &bytes);
    if (!st) st = tl_codec_read(ctx, bytes.bytes, bytes.count, &codec);
    bytes.count = 0;
    if (!st) st = tli_topology_encode(ctx, codec, 1, &patch, &bytes, NULL);
    if (!st) st = tli_channel_encode(ctx, codec, 1, &patch, 0, TL_ON_VERTEX, 2, values, &channel);
    if (!st) st = tl_topology_decode(ctx, codec, 1, bytes.bytes, bytes.count, &back);
    if (!st)
        st = tl_channel_decode(ctx, codec, 1, back, 0, TL_ON_VERTEX, 2, channel.bytes,
                               channel.count, values);
    tl_mem_free(ctx, patch.places);
    tl_mem_free(ctx, patch.shared);
    tl_mem_free(ctx, patch.tets);
    tl_mem_free(ctx, patch.opposite);
    tl_patch_destroy(ctx, back);
    tl_codec_destroy(ctx, codec);
    tli_trainer_destroy(ctx, trainer);
    tli_bytes_close(&bytes);
    tli_bytes_close(&channel);
    return st;
}

static tl_status measure(tl_ctx *ctx, void *arg)
{
    const make_mesh *m = arg;
    tl_codec_report report;
    tl_mesh *mesh = NULL;
    tl_status st = tl_mesh_create(ctx, m->xyz, m->vert_count, m->tets, m->tet_count, &mesh);
    if (!st) st = tl_codec_measure(ctx, mesh, 20, 1e-5, 1e-4, 1, &report);
    tl_mesh_destroy(mesh);
    return st;
}

static void failed_allocations_lose_nothing(void **state)
{
    (void)state;
    make_mesh m = make_grid(3);
    fail_alloc f;
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, encode_and_decode, &m) > 40);
    CHECK(fail_alloc_each(&f, measure, &m) > 60);
    fail_alloc_close(&f);
    make_release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(damaged_bytes_are_refused),
                                       cmocka_unit_test(random_bytes_are_refused),
                                       cmocka_unit_test(counts_are_checked_before_they_cost),
                                       cmocka_unit_test(failed_allocations_lose_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
