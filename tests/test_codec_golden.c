/* Golden bytes of the codec's first version: tables, a topology and two channels of one patch. The
 * encoder must still write them, the decoder must still read them, on every machine. Where the file
 * is missing the test leaves one in its folder and fails. */
#include "check.h"

#include "make_patch.h"

#define GOLDEN TETRALOD_SOURCE_DIR "/tests/golden/codec_v1.bin"
#define PART_COUNT 4

static const tli_coded_channel CHANNELS[2] = {{{TL_VALUE_LATTICE, 1e-3}, TL_ON_VERTEX, 1},
                                              {{TL_VALUE_FLOAT64, 0}, TL_ON_TET, 2}};

/* The patch and its values: no function of the mathematics library takes part. */
typedef struct subject {
    tl_patch *patch;
    int64_t *values[2];
} subject;

static subject make_subject(tl_ctx *ctx)
{
    subject s;
    make_mesh m = make_grid(7);
    make_perturb(&m, 0.01, 11);
    make_shuffle(&m, 12);
    make_two_regions(&m);
    s.patch = make_patch(ctx, &make_lattice, &m);
    make_release(&m);
    CHECK_OK(ctx, tli_patch_arrange(ctx, s.patch, NULL, NULL));
    s.values[0] = calloc(s.patch->vert_count, sizeof *s.values[0]);
    s.values[1] = calloc(2 * s.patch->tet_count, sizeof *s.values[1]);
    for (uint32_t v = 0; v < s.patch->vert_count; v++) {
        const int64_t *k = s.patch->places[v];
        s.values[0][v] = k[0] * k[0] / 4194304 - k[1] / 64 + k[2] * k[0] / 8388608;
    }
    for (uint32_t i = 0; i < 2 * s.patch->tet_count; i++)
        s.values[1][i] = tl_image_of_float64(i % 19 ? i / 8.0 : -(double)i);
    s.values[1][4] = TL_IMAGE_NAN;
    return s;
}

/* Topology and channels behind the tables, which are part 0. */
static void make_parts(tl_ctx *ctx, const subject *s, const tl_codec *codec, tli_bytes *parts)
{
    for (int c = 0; c < 2; c++)
        CHECK_OK(ctx, tli_channel_encode(ctx, codec, 0, s->patch, (size_t)c, CHANNELS[c].on,
                                         CHANNELS[c].components, s->values[c], &parts[2 + c]));
    CHECK_OK(ctx, tli_topology_encode(ctx, codec, 0, s->patch, &parts[1], NULL));
}

static void write_golden(tl_ctx *ctx, const subject *s)
{
    const int64_t *values[2] = {s->values[0], s->values[1]};
    tli_bytes parts[PART_COUNT];
    tli_trainer *trainer = NULL;
    tl_codec *codec = NULL;
    FILE *file = fopen("codec_v1.bin", "wb");
    CHECK(file != NULL);
    for (int p = 0; p < PART_COUNT; p++) tli_bytes_open(ctx, &parts[p]);
    CHECK_OK(ctx, tli_trainer_create(ctx, &make_lattice, CHANNELS, 2, &trainer));
    CHECK_OK(ctx, tli_trainer_add(ctx, trainer, 0, s->patch, values));
    CHECK_OK(ctx, tli_trainer_write(trainer, &parts[0]));
    CHECK_OK(ctx, tl_codec_read(ctx, parts[0].bytes, parts[0].count, &codec));
    make_parts(ctx, s, codec, parts);
    for (int p = 0; p < PART_COUNT; p++) {
        for (int i = 0; i < 4; i++) fputc((int)(parts[p].count >> 8 * i & 255), file);
        fwrite(parts[p].bytes, 1, parts[p].count, file);
        tli_bytes_close(&parts[p]);
    }
    fclose(file);
    tli_trainer_destroy(ctx, trainer);
    tl_codec_destroy(ctx, codec);
}

/* The next part of the golden file, appended to part. */
static bool read_part(FILE *file, tli_bytes *part)
{
    size_t count = 0;
    for (int i = 0; i < 4; i++) {
        int byte = fgetc(file);
        if (byte < 0) return false;
        count |= (size_t)byte << 8 * i;
    }
    if (tli_bytes_reserve(part, count)) return false;
    part->count = fread(part->bytes, 1, count, file);
    return part->count == count;
}

static void check_decoding(tl_ctx *ctx, const subject *s, const tl_codec *codec,
                           const tli_bytes *golden)
{
    tl_patch *back = NULL;
    CHECK_OK(ctx, tl_topology_decode(ctx, codec, 0, golden[1].bytes, golden[1].count, &back));
    CHECK_EQ(back->tet_count, s->patch->tet_count);
    CHECK(memcmp(back->tets, s->patch->tets, back->tet_count * sizeof *back->tets) == 0);
    CHECK(memcmp(back->places, s->patch->places, back->vert_count * sizeof *back->places) == 0);
    CHECK(memcmp(back->shared, s->patch->shared, back->vert_count) == 0);
    CHECK(memcmp(back->regions, s->patch->regions, back->tet_count * sizeof *back->regions) == 0);
    for (int c = 0; c < 2; c++) {
        size_t count = c ? 2 * (size_t)back->tet_count : back->vert_count;
        int64_t *values = calloc(count, sizeof *values);
        CHECK_OK(ctx, tl_channel_decode(ctx, codec, 0, back, (size_t)c, CHANNELS[c].on,
                                        CHANNELS[c].components, golden[2 + c].bytes,
                                        golden[2 + c].count, values));
        CHECK(memcmp(values, s->values[c], count * sizeof *values) == 0);
        free(values);
    }
    tl_patch_destroy(ctx, back);
}

static void the_first_version_stays(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    tl_codec *codec = NULL;
    tli_bytes golden[PART_COUNT], parts[PART_COUNT];
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    subject s = make_subject(ctx);
    FILE *file = fopen(GOLDEN, "rb");
    if (!file) write_golden(ctx, &s);
    CHECK(file != NULL);
    for (int p = 0; p < PART_COUNT; p++) {
        tli_bytes_open(ctx, &golden[p]);
        tli_bytes_open(ctx, &parts[p]);
        CHECK(read_part(file, &golden[p]));
    }
    CHECK(fgetc(file) == EOF);
    fclose(file);
    CHECK_OK(ctx, tl_codec_read(ctx, golden[0].bytes, golden[0].count, &codec));
    make_parts(ctx, &s, codec, parts);
    for (int p = 1; p < PART_COUNT; p++) {
        CHECK_EQ(parts[p].count, golden[p].count);
        CHECK(memcmp(parts[p].bytes, golden[p].bytes, golden[p].count) == 0);
    }
    check_decoding(ctx, &s, codec, golden);
    for (int p = 0; p < PART_COUNT; p++) {
        tli_bytes_close(&golden[p]);
        tli_bytes_close(&parts[p]);
    }
    tl_codec_destroy(ctx, codec);
    tl_patch_destroy(ctx, s.patch);
    free(s.values[0]);
    free(s.values[1]);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_first_version_stays)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
