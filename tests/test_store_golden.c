/* The golden file of format version 1, tests/golden/store_v1.tlod: one segment that makes one tet
 * out of two, with a scalar and a twin; raw blobs, so that it hangs on no coder. It must be read
 * for good; what is written today has the same bytes. docs/FORMAT.md explains it byte by byte. */
#include "codec/codec.h"

#include "check_ctx.h"
#include "make_store.h"

#define GOLDEN TETRALOD_SOURCE_DIR "/tests/golden/store_v1.tlod"

/* The patches: the coarse one, then the fine ones, which share a face. */
static const int64_t PLACES[3][4][3] = {
    {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 4}},
    {{0, 0, 0}, {2, 0, 0}, {0, 4, 0}, {0, 0, 4}},
    {{4, 0, 0}, {2, 0, 0}, {0, 0, 4}, {0, 4, 0}},
};
static const int64_t VALUES[3][4] = {{0, 100, 0, 0}, {0, 48, 0, 0}, {100, 48, 0, 0}};

static tl_store_head golden_head(void)
{
    static const double errors[2][1] = {{0.0078125}, {0.046875}};
    static const tl_store_level levels[2] = {
        {.tets = 2, .verts = 5, .patch_count = 2, .segment_count = 1, .max_error = errors[0]},
        {.tets = 1, .verts = 4, .patch_count = 1, .boundary_error = 0.25, .max_error = errors[1]}};
    static const tl_store_channel channel = {.name = "heat",
                                             .unit = "K",
                                             .components = 1,
                                             .on = TL_ON_VERTEX,
                                             .scalar = TL_F32,
                                             .code = {TL_VALUE_LATTICE, 0x1p-6},
                                             .range = {0, 1.5625},
                                             .codec_error = 0x1p-7,
                                             .time = NAN};
    static const uint64_t cells[1] = {2};
    static const tl_store_region regions[1] = {{7, 2, "steel"}};
    return (tl_store_head){.lattice = {TL_PLACE_LATTICE, -1, {-2, 0, 0}},
                           .segment_count = 1,
                           .patch_count = 3,
                           .root_patch_count = 1,
                           .input_tets = 2,
                           .input_verts = 5,
                           .stats = {.bounds = {-1, 1, 0, 2, 0, 2},
                                     .diagonal = sqrt(12),
                                     .volume = 4.0 / 3,
                                     .boundary_triangles = 6,
                                     .components = 1,
                                     .quality_min = 0.5,
                                     .quality_median = 0.5},
                           .time = NAN,
                           .position_error = 0.25,
                           .border_share = 0.6,
                           .connectivity_bits = 24,
                           .place_bits = 1152,
                           .flag_bits = 96,
                           .cells = cells,
                           .cell_kind_count = 1,
                           .regions = regions,
                           .regions_listed = 1,
                           .region_count = 1,
                           .levels = levels,
                           .level_count = 2,
                           .channels = &channel,
                           .channel_count = 1};
}

static void add_patch(tl_ctx *ctx, tli_store_writer *writer, uint32_t id)
{
    static const float ranges[3][2] = {{0, 1.5625f}, {0, 0.75f}, {0, 1.5625f}};
    static const double squares[3] = {0.002, 0, 0};
    static const uint64_t carried[3] = {5, 4, 1};
    const tli_twin twin = {.vert = 2, .twin = 1};
    int64_t places[4][3];
    uint16_t tets[1][4] = {{0, 1, 2, 3}};
    uint8_t shared[4] = {id == 0, 1, 1, 1};
    tl_patch patch = {
        .vert_count = 4, .tet_count = 1, .places = places, .tets = tets, .shared = shared};
    tl_patch_info info = {.producer = id ? TL_NONE : 0,
                          .level = id ? 0 : 1,
                          .class_ = TL_CLASS_RAW,
                          .tet_count = 1,
                          .vert_count = 4,
                          .sphere = {0, 1, 1, 1.75},
                          .ranges = ranges[id],
                          .square_error = &squares[id],
                          .carried = carried[id]};
    tli_bytes topology, values;
    memcpy(places, PLACES[id], sizeof places);
    tli_bytes_open(ctx, &topology);
    tli_bytes_open(ctx, &values);
    CHECK_OK(ctx, tli_topology_encode(ctx, NULL, TL_CLASS_RAW, &patch, &topology, NULL));
    CHECK_OK(ctx, tli_channel_encode(ctx, NULL, TL_CLASS_RAW, &patch, 0, TL_ON_VERTEX, 1,
                                     VALUES[id], &values));
    tli_blob blob = {values.bytes, values.count};
    CHECK_OK(ctx, tli_store_add_patch(writer, &info, (tli_blob){topology.bytes, topology.count},
                                      &blob, &twin, id == 1));
    tli_bytes_close(&values);
    tli_bytes_close(&topology);
    tl_mem_free(ctx, patch.opposite);
}

static void write_golden(tl_ctx *ctx, const char *path)
{
    const tl_store_head head = golden_head();
    tli_store_writer *writer = NULL;
    const uint32_t output = 0;
    const double max_error = 0.046875;
    float field_bins[TL_BINS] = {0}, space_bins[TL_BINS] = {0};
    field_bins[30] = 0.03125f;
    field_bins[31] = 0.046875f;
    space_bins[31] = 0.125f;
    const tl_segment_info segment = {.level = 0,
                                     .first_patch = 1,
                                     .patch_count = 2,
                                     .outputs = &output,
                                     .output_count = 1,
                                     .output_tets = 1,
                                     .sphere = {0, 1, 1, 1.75},
                                     .boundary_error = 0.25,
                                     .max_error = &max_error,
                                     .field_bins = field_bins,
                                     .space_bins = space_bins};
    CHECK_OK(ctx, tli_store_begin(ctx, path, &head, (tli_blob){NULL, 0}, 0, &writer));
    for (uint32_t id = 0; id < 3; id++) add_patch(ctx, writer, id);
    CHECK_OK(ctx, tli_store_add_segment(writer, &segment));
    CHECK_OK(ctx, tli_store_finish(writer, &head, true));
}

static void test_is_read(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = NULL;
    tl_segment_info segment;
    tl_patch_info patch;
    CHECK_OK(ctx, tl_store_open(ctx, GOLDEN, &store));
    CHECK_OK(ctx, tl_store_check(ctx, store, TL_CHECK_FULL));
    CHECK_OK(ctx, tl_store_segment(ctx, store, 0, &segment));
    CHECK(segment.max_error[0] == 0.046875 && segment.boundary_error == 0.25);
    CHECK(segment.field_bins[30] == 0.03125f && segment.space_bins[31] == 0.125f);
    CHECK(segment.field_bins[29] == 0 && segment.space_bins[30] == 0);
    CHECK_OK(ctx, tl_store_patch(ctx, store, 0, &patch));
    CHECK_EQ(patch.carried, 5);
    CHECK(patch.square_error[0] >= 0.002 && patch.square_error[0] < 0.00201);
    for (uint32_t id = 0; id < 3; id++) {
        tl_patch *topology = NULL;
        double values[4];
        CHECK_OK(ctx, tl_store_topology(ctx, store, id, &topology));
        CHECK_OK(ctx, tl_store_channel_values(ctx, store, id, topology, 0, values));
        for (int v = 0; v < 4; v++) {
            CHECK(values[v] == VALUES[id][v] * 0x1p-6);
            for (int k = 0; k < 3; k++) CHECK_EQ(topology->places[v][k], PLACES[id][v][k]);
        }
        CHECK_EQ(topology->twins ? topology->twins[2] : 0, id == 1);
        tl_patch_destroy(ctx, topology);
    }
    tl_store_close(store);
    tl_ctx_destroy(ctx);
}

static void test_is_written(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    size_t golden_bytes, bytes;
    write_golden(ctx, "store_v1.tlod");
    uint8_t *golden = check_file_load(GOLDEN, &golden_bytes);
    uint8_t *now = check_file_load("store_v1.tlod", &bytes);
    CHECK_EQ(bytes, golden_bytes);
    for (size_t i = 0; i < bytes; i++)
        if (now[i] != golden[i])
            fail_msg("byte %zu is 0x%02x, expected 0x%02x", i, now[i], golden[i]);
    free(now);
    free(golden);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_is_read),
                                       cmocka_unit_test(test_is_written)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
