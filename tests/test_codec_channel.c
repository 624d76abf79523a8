/* Channels to bytes and back. */
#include "check.h"
#include "check_ctx.h"

#include "make_patch.h"

typedef struct sample {
    tl_patch *patch;
    int64_t *values;
    uint32_t count, components;
    tl_on on;
} sample;

/* A grid with a smooth field as of a code. */
static sample make_sample(tl_ctx *ctx, const tl_value_code *code, tl_on on, uint32_t components)
{
    make_mesh m = make_grid(9);
    make_perturb(&m, 0.01, 4);
    make_shuffle(&m, 9);
    sample s = {.patch = make_patch(ctx, &make_lattice, &m), .components = components, .on = on};
    make_release(&m);
    CHECK_OK(ctx, tli_patch_arrange(ctx, s.patch, NULL, NULL));
    s.count = on == TL_ON_VERTEX ? s.patch->vert_count : s.patch->tet_count;
    s.values = calloc((size_t)s.count * components + 1, sizeof *s.values);
    CHECK(s.values != NULL);
    for (uint32_t e = 0; e < s.count; e++)
        for (uint32_t c = 0; c < components; c++) {
            uint32_t v = on == TL_ON_VERTEX ? e : s.patch->tets[e][0];
            double x[3];
            tl_lattice_xyz(&make_lattice, s.patch->places[v], x);
            s.values[(size_t)e * components + c] =
                tl_value_image(code, sin(3 * x[0] + c) * cos(2 * x[1]) + x[2]);
        }
    return s;
}

static void release(tl_ctx *ctx, sample *s)
{
    tl_patch_destroy(ctx, s->patch);
    free(s->values);
}

/* Encodes and decodes with tables of the sample itself; returns bits a value. */
static double round_trip(tl_ctx *ctx, const sample *s, const tl_value_code *code)
{
    tli_coded_channel channel = {*code, s->on, s->components};
    const int64_t *values[1] = {s->values};
    int64_t *back = calloc((size_t)s->count * s->components + 1, sizeof *back);
    tl_codec *codec = make_codec(ctx, &make_lattice, s->patch, &channel, 1, values);
    tli_bytes bytes;
    double per_value = 0;
    for (unsigned raw = 0; raw < 2; raw++) {
        unsigned class_ = raw ? TL_CLASS_RAW : 0;
        tli_bytes_open(ctx, &bytes);
        CHECK_OK(ctx, tli_channel_encode(ctx, codec, class_, s->patch, 0, s->on, s->components,
                                         s->values, &bytes));
        if (!raw) per_value = 8.0 * (double)bytes.count / s->count / s->components;
        memset(back, 0x55, (size_t)s->count * s->components * sizeof *back);
        CHECK_OK(ctx, tl_channel_decode(ctx, codec, class_, s->patch, 0, s->on, s->components,
                                        bytes.bytes, bytes.count, back));
        CHECK(memcmp(back, s->values, (size_t)s->count * s->components * sizeof *back) == 0);
        tli_bytes_close(&bytes);
    }
    free(back);
    tl_codec_destroy(ctx, codec);
    return per_value;
}

static void fields_return(void **state)
{
    (void)state;
    static const tl_value_code codes[] = {{TL_VALUE_LATTICE, 1e-4},
                                          {TL_VALUE_FLOAT32, 0},
                                          {TL_VALUE_FLOAT64, 0},
                                          {TL_VALUE_INTEGER, 0}};
    static const double most_bits[] = {12, 28, 58, 6};
    tl_ctx *ctx = check_ctx_create(0);
    for (int c = 0; c < 4; c++)
        for (int on = 0; on < 2; on++)
            for (uint32_t components = 1; components < 20; components += 9) {
                sample s = make_sample(ctx, &codes[c], on ? TL_ON_TET : TL_ON_VERTEX, components);
                double bits = round_trip(ctx, &s, &codes[c]);
                if (!on && components == 1)
                    CHECK_BOUND("bits a value of a smooth field", bits, most_bits[c]);
                release(ctx, &s);
            }
    tl_ctx_destroy(ctx);
}

static void what_is_not_finite_returns(void **state)
{
    (void)state;
    const tl_value_code code = {TL_VALUE_FLOAT64, 0};
    tl_ctx *ctx = check_ctx_create(0);
    sample s = make_sample(ctx, &code, TL_ON_VERTEX, 2);
    for (uint32_t i = 0; i < 2 * s.count; i += 5)
        s.values[i] = i % 3 == 0 ? TL_IMAGE_NAN : i % 3 == 1 ? TL_IMAGE_NINF : TL_IMAGE_PINF;
    s.values[1] = INT64_MAX;
    s.values[3] = INT64_MIN + 3;
    (void)round_trip(ctx, &s, &code);
    for (uint32_t i = 0; i < 2 * s.count; i++) s.values[i] = TL_IMAGE_NAN;
    CHECK(round_trip(ctx, &s, &code) < 1);
    release(ctx, &s);
    tl_ctx_destroy(ctx);
}

static void constant_channels_cost_their_head(void **state)
{
    (void)state;
    const tl_value_code code = {TL_VALUE_LATTICE, 1};
    tl_ctx *ctx = check_ctx_create(0);
    sample s = make_sample(ctx, &code, TL_ON_TET, 3);
    for (uint32_t i = 0; i < 3 * s.count; i++) s.values[i] = -5 + i % 3;
    CHECK_BOUND("bits of a constant channel", round_trip(ctx, &s, &code) * 3 * s.count,
                8 * (2 + 3 * 8.0));
    release(ctx, &s);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(fields_return),
                                       cmocka_unit_test(what_is_not_finite_returns),
                                       cmocka_unit_test(constant_channels_cost_their_head)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
