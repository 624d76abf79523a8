/* Models written and read back: every number of segments and patches, rounded the promised way;
 * blobs, twins, values; adding channels; threads; budget; how much opening reads. */
#include <pthread.h>
#include <unistd.h>

#include "base/base_file.h"

#include "check_ctx.h"
#include "make_store.h"

/* ---- comparing ---- */

static void check_above(double got, double given, double relative)
{
    CHECK(got >= given);
    CHECK(got <= given * (1 + relative));
}

static void check_segment(tl_ctx *ctx, const make_store *m, const tl_store *store, uint32_t id)
{
    make_store_segment made;
    tl_segment_info got;
    make_store_get_segment(m, id, &made);
    CHECK_OK(ctx, tl_store_segment(ctx, store, id, &got));
    CHECK_EQ(got.level, made.info.level);
    CHECK_EQ(got.first_patch, made.info.first_patch);
    CHECK_EQ(got.patch_count, made.info.patch_count);
    CHECK_EQ(got.output_count, made.info.output_count);
    for (uint32_t i = 0; i < got.output_count; i++) CHECK_EQ(got.outputs[i], made.outputs[i]);
    CHECK_EQ(got.input_tets, made.info.input_tets);
    CHECK_EQ(got.output_tets, made.info.output_tets);
    check_above(got.boundary_error, made.info.boundary_error, 0x1p-10);
    check_above(got.sphere[3], made.info.sphere[3], 0x1p-9);
    for (uint32_t c = 0; c < m->channel_count; c++) {
        check_above(got.max_error[c], made.max_error[c], 0x1p-10);
        for (uint32_t b = c * TL_BINS; b < (c + 1) * TL_BINS; b++) {
            check_above((double)got.field_bins[b], (double)made.field_bins[b], 0.125);
            check_above((double)got.space_bins[b], (double)made.space_bins[b], 0.125);
        }
    }
}

static void check_values(tl_ctx *ctx, const make_store *m, const tl_store *store, uint32_t id,
                         const make_store_patch *made, const tl_patch *patch, uint32_t c)
{
    const tl_store_channel *channel = &m->channels[c];
    const size_t count = (size_t)channel->components *
                         (channel->on == TL_ON_TET ? patch->tet_count : patch->vert_count);
    tl_status st = TL_OK;
    int64_t *images = tl_mem_alloc(ctx, count, 8, &st);
    double *values = tl_mem_alloc(ctx, count, 8, &st);
    CHECK_OK(ctx, st);
    CHECK_OK(ctx, tl_store_channel_images(ctx, store, id, patch, c, images));
    CHECK_OK(ctx, tl_store_channel_values(ctx, store, id, patch, c, values));
    for (size_t i = 0; i < count; i++) {
        CHECK(images[i] == made->images[c][i]);
        double value = tl_value_of(&channel->code, images[i]);
        CHECK(values[i] == value || (isnan(values[i]) && isnan(value)));
    }
    tl_mem_free(ctx, values);
    tl_mem_free(ctx, images);
}

static void check_patch(tl_ctx *ctx, const make_store *m, const tl_store *store, uint32_t id)
{
    make_store_patch made;
    tl_patch_info got;
    tl_patch *patch = NULL;
    make_store_get_patch(ctx, m, id, &made);
    CHECK_OK(ctx, tl_store_patch(ctx, store, id, &got));
    CHECK_EQ(got.producer, made.info.producer);
    CHECK_EQ(got.consumer, made.info.consumer);
    CHECK_EQ(got.level, made.info.level);
    CHECK_EQ(got.class_, made.info.class_);
    CHECK_EQ(got.tet_count, made.info.tet_count);
    CHECK_EQ(got.vert_count, made.info.vert_count);
    CHECK_EQ(got.carried, made.info.carried);
    CHECK_EQ(got.topology_ofs % 8, 0);
    for (uint32_t c = 0; c < m->channel_count; c++) {
        check_above(got.square_error[c], made.square_error[c], 0x1p-8);
        CHECK_EQ(got.channel_bytes[c], made.values[c].count);
        CHECK_EQ(got.channel_ofs[c] % 8, 0);
        if (isnan(made.ranges[2 * c])) {
            CHECK(isnan(got.ranges[2 * c]) && isnan(got.ranges[2 * c + 1]));
            continue;
        }
        CHECK(got.ranges[2 * c] <= made.ranges[2 * c] &&
              got.ranges[2 * c + 1] >= made.ranges[2 * c + 1]);
        CHECK_NEAR(got.ranges[2 * c], made.ranges[2 * c], 2e-4);
        CHECK_NEAR(got.ranges[2 * c + 1], made.ranges[2 * c + 1], 2e-4);
    }
    CHECK_OK(ctx, tl_store_topology(ctx, store, id, &patch));
    CHECK(memcmp(patch->places, made.patch.places, patch->vert_count * sizeof *patch->places) == 0);
    CHECK(memcmp(patch->tets, made.patch.tets, patch->tet_count * sizeof *patch->tets) == 0);
    CHECK(!patch->twins == !made.twin_count);
    for (uint32_t v = 0; patch->twins && v < patch->vert_count; v++)
        CHECK_EQ(patch->twins[v], v == made.twin.vert ? made.twin.twin : 0);
    for (uint32_t c = 0; c < m->channel_count; c++)
        check_values(ctx, m, store, id, &made, patch, c);
    tl_patch_destroy(ctx, patch);
    make_store_release_patch(ctx, &made);
}

static void check_text(const char *got, const char *expected)
{
    assert_string_equal(got, expected);
}

static void check_head(const make_store *m, const tl_store *store)
{
    const tl_store_head *got = tl_store_get_head(store), *made = &m->head;
    CHECK_EQ(got->lattice.kind, made->lattice.kind);
    CHECK_EQ(got->lattice.exponent, made->lattice.exponent);
    for (int k = 0; k < 3; k++) CHECK_EQ(got->lattice.origin[k], made->lattice.origin[k]);
    CHECK_EQ(got->segment_count, made->segment_count);
    CHECK_EQ(got->patch_count, made->patch_count);
    CHECK_EQ(got->root_patch_count, made->root_patch_count);
    CHECK_EQ(got->input_tets, made->input_tets);
    CHECK_EQ(got->input_verts, made->input_verts);
    CHECK(memcmp(&got->stats, &made->stats, sizeof got->stats) == 0);
    CHECK(got->time == made->time && got->position_error == made->position_error);
    CHECK(got->border_share == made->border_share &&
          got->connectivity_bits == made->connectivity_bits);
    CHECK(got->place_bits == made->place_bits && got->flag_bits == made->flag_bits);
    CHECK_EQ(got->cell_kind_count, made->cell_kind_count);
    for (uint32_t i = 0; i < got->cell_kind_count; i++) CHECK_EQ(got->cells[i], made->cells[i]);
    CHECK_EQ(got->regions_listed, made->regions_listed);
    for (uint32_t i = 0; i < got->regions_listed; i++) {
        CHECK_EQ(got->regions[i].id, made->regions[i].id);
        CHECK_EQ(got->regions[i].tets, made->regions[i].tets);
        check_text(got->regions[i].name, made->regions[i].name ? made->regions[i].name : "");
    }
    CHECK_EQ(got->level_count, made->level_count);
    for (uint32_t l = 0; l < got->level_count; l++) {
        CHECK_EQ(got->levels[l].tets, made->levels[l].tets);
        CHECK(got->levels[l].verts == made->levels[l].verts);
        CHECK_EQ(got->levels[l].patch_count, made->levels[l].patch_count);
        CHECK_EQ(got->levels[l].segment_count, made->levels[l].segment_count);
        CHECK(got->levels[l].boundary_error == made->levels[l].boundary_error);
        for (uint32_t c = 0; c < made->channel_count; c++)
            CHECK(got->levels[l].max_error[c] == made->levels[l].max_error[c]);
    }
    CHECK_EQ(got->channel_count, made->channel_count);
    for (uint32_t c = 0; c < got->channel_count; c++) {
        const tl_store_channel *a = &got->channels[c], *b = &made->channels[c];
        check_text(a->name, b->name);
        check_text(a->unit, b->unit);
        CHECK_EQ(a->components, b->components);
        CHECK_EQ(a->on, b->on);
        CHECK_EQ(a->scalar, b->scalar);
        CHECK_EQ(a->code.kind, b->code.kind);
        CHECK(a->code.step == b->code.step && a->codec_error == b->codec_error);
        CHECK(a->range[0] == b->range[0] && a->range[1] == b->range[1]);
        CHECK(a->time == b->time || (isnan(a->time) && isnan(b->time)));
        CHECK_EQ(a->nonfinite_count, b->nonfinite_count);
        CHECK(a->bytes > 0);
    }
}

/* Writes, reads back, compares all, proves all. */
static void round_trip(const make_store *m)
{
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = NULL;
    CHECK_OK(ctx, make_store_write(ctx, ctx, m, "m.tlod"));
    CHECK(tl_store_is(ctx, "m.tlod"));
    CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store));
    check_head(m, store);
    for (uint32_t s = 0; s < m->head.segment_count; s++) check_segment(ctx, m, store, s);
    for (uint32_t p = 0; p < m->head.patch_count; p++) check_patch(ctx, m, store, p);
    CHECK_OK(ctx, tl_store_check(ctx, store, TL_CHECK_FAST));
    CHECK_OK(ctx, tl_store_check(ctx, store, TL_CHECK_FULL));
    tl_store_close(store);
    check_ctx_destroy(ctx);
}

/* ---- round trips ---- */

static void test_small(void **state)
{
    (void)state;
    make_store m;
    make_store_small(&m);
    round_trip(&m);
}

static void test_sizes(void **state)
{
    (void)state;
    for (uint32_t levels = 1; levels <= 5; levels++)
        for (uint32_t channels = 0; channels <= 6; channels += 3) {
            make_store m = {.level_count = levels,
                            .coarse_segments = 3,
                            .channel_count = channels,
                            .vert_count = 4 + levels,
                            .with_twins = channels == 3,
                            .codec = {(const uint8_t *)"", 0}};
            make_store_open(&m);
            round_trip(&m);
        }
}

/* Several pages, also among the roots. */
static void test_many_pages(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = NULL;
    make_store m = {.level_count = 5, .coarse_segments = 300, .channel_count = 3, .vert_count = 6};
    make_store_open(&m);
    round_trip(&m);
    CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store));
    CHECK_EQ(tl_store_pages_read(store), 0);
    CHECK(tl_store_bytes_read(store) <= 65536);
    tl_patch_info info;
    CHECK_OK(ctx, tl_store_patch(ctx, store, 0, &info));
    CHECK_EQ(tl_store_pages_read(store), 1);
    CHECK(tl_store_bytes_read(store) <= 2 * 65536);
    CHECK_OK(ctx, tl_store_patch(ctx, store, m.head.patch_count - 1, &info));
    CHECK_EQ(tl_store_pages_read(store), 2);
    tl_store_close(store);
    check_ctx_destroy(ctx);
}

/* A head that one read of 64 KiB does not hold. */
static void test_large_head(void **state)
{
    (void)state;
    enum { REGIONS = 5000 };
    static tl_store_region regions[REGIONS];
    make_store m;
    make_store_small(&m);
    for (int i = 0; i < REGIONS; i++)
        regions[i] = (tl_store_region){i - 3, (uint64_t)i, i % 2 ? "rock" : ""};
    m.head.regions = regions;
    m.head.regions_listed = REGIONS;
    m.head.region_count = REGIONS + 7;
    round_trip(&m);
}

/* One refinement is one range of the file: topologies, then channel by channel. */
static void test_groups_are_contiguous(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = NULL;
    make_store m = {.level_count = 3, .coarse_segments = 2, .channel_count = 3, .vert_count = 9};
    make_store_open(&m);
    CHECK_OK(ctx, make_store_write(ctx, ctx, &m, "m.tlod"));
    CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store));
    for (uint32_t s = 0; s < m.head.segment_count; s++) {
        tl_segment_info segment;
        uint64_t end = 0;
        CHECK_OK(ctx, tl_store_segment(ctx, store, s, &segment));
        for (uint32_t c = 0; c <= m.channel_count; c++)
            for (uint32_t i = 0; i < segment.patch_count; i++) {
                tl_patch_info info;
                CHECK_OK(ctx, tl_store_patch(ctx, store, segment.first_patch + i, &info));
                uint64_t ofs = c ? info.channel_ofs[c - 1] : info.topology_ofs;
                uint64_t bytes = c ? info.channel_bytes[c - 1] : info.topology_bytes;
                if (end) CHECK_EQ(ofs, end);
                end = ofs + (bytes + 7) / 8 * 8 + 8;
            }
    }
    tl_store_close(store);
    check_ctx_destroy(ctx);
}

/* ---- adding channels ---- */

typedef struct added_source {
    tl_ctx *ctx;
    const make_store *m;
    uint32_t old;
    make_store_patch patch;
    bool open;
} added_source;

static tl_status added_patch(void *user, uint32_t id, tli_blob *blobs, float *ranges,
                             double *squares)
{
    added_source *source = user;
    if (source->open) make_store_release_patch(source->ctx, &source->patch);
    make_store_get_patch(source->ctx, source->m, id, &source->patch);
    source->open = true;
    for (uint32_t c = source->old; c < source->m->channel_count; c++) {
        blobs[c - source->old] = source->patch.blobs[c];
        memcpy(ranges + 2 * (size_t)(c - source->old), source->patch.ranges + 2 * (size_t)c,
               2 * sizeof *ranges);
        squares[c - source->old] = source->patch.square_error[c];
    }
    return TL_OK;
}

static tl_status added_segment(void *user, uint32_t id, double *max_error, float *field_bins,
                               float *space_bins)
{
    const added_source *source = user;
    const uint32_t old = source->old, count = source->m->channel_count - old;
    make_store_segment s;
    make_store_get_segment(source->m, id, &s);
    memcpy(max_error, s.max_error + old, count * sizeof *max_error);
    memcpy(field_bins, s.field_bins + old * TL_BINS, count * TL_BINS * sizeof *field_bins);
    memcpy(space_bins, s.space_bins + old * TL_BINS, count * TL_BINS * sizeof *space_bins);
    return TL_OK;
}

/* The file is the same as one built with all channels, but for rounding twice nothing. */
static void test_append(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = NULL;
    make_store few = {.level_count = 4,
                      .coarse_segments = 40,
                      .channel_count = 1,
                      .vert_count = 7,
                      .with_twins = true};
    make_store all = few;
    all.channel_count = 4;
    make_store_open(&few);
    make_store_open(&all);
    CHECK_OK(ctx, make_store_write(ctx, ctx, &few, "few.tlod"));
    CHECK_OK(ctx, make_store_write(ctx, ctx, &all, "all.tlod"));
    CHECK_OK(ctx, tl_store_open(ctx, "few.tlod", &store));
    added_source source = {.ctx = ctx, .m = &all, .old = 1};
    tli_store_added added = {&source, added_patch, added_segment, NULL};
    CHECK_OK(ctx, tli_store_append(ctx, store, "few.tlod", &all.head, tli_store_codec_bytes(store),
                                   &added));
    make_store_release_patch(ctx, &source.patch);
    CHECK_STATUS(tli_store_append(ctx, store, "no.tlod", &(tl_store_head){.level_count = 1},
                                  (tli_blob){0}, &added),
                 TL_ERR_ARG);
    CHECK(access("no.tlod", F_OK) != 0);
    tl_store_close(store);

    size_t appended_bytes, built_bytes;
    uint8_t *appended = check_file_load("few.tlod", &appended_bytes);
    uint8_t *built = check_file_load("all.tlod", &built_bytes);
    CHECK_EQ(appended_bytes, built_bytes);
    CHECK(memcmp(appended, built, built_bytes) == 0);
    free(appended);
    free(built);
    check_ctx_destroy(ctx);
}

/* ---- wrong use ---- */

static void test_wrong_use(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_store m;
    tli_store_writer *writer = NULL;
    tl_store *store = NULL;
    make_store_patch p;
    make_store_small(&m);
    tl_store_head head = m.head;
    head.root_patch_count = 0;
    CHECK_STATUS(tli_store_begin(ctx, "w.tlod", &head, m.codec, 0, &writer), TL_ERR_ARG);
    head = m.head;
    head.patch_count++;
    CHECK_STATUS(tli_store_begin(ctx, "w.tlod", &head, m.codec, 0, &writer), TL_ERR_ARG);
    head = m.head;
    head.stats.bounds[0] = NAN;
    CHECK_STATUS(tli_store_begin(ctx, "w.tlod", &head, m.codec, 0, &writer), TL_ERR_ARG);
    CHECK(!writer);

    CHECK_OK(ctx, tli_store_begin(ctx, "w.tlod", &m.head, m.codec, 0, &writer));
    make_store_get_patch(ctx, &m, 0, &p);
    p.info.producer = 99;
    CHECK_STATUS(tli_store_add_patch(writer, &p.info, (tli_blob){0}, p.blobs, NULL, 0), TL_ERR_ARG);
    p.info.producer = TL_NONE; /* after a failure nothing goes on */
    CHECK_STATUS(tli_store_add_patch(writer, &p.info, (tli_blob){0}, p.blobs, NULL, 0), TL_ERR_ARG);
    CHECK_STATUS(tli_store_finish(writer, &m.head, true), TL_ERR_ARG);
    CHECK_OK(ctx, tli_store_begin(ctx, "w.tlod", &m.head, m.codec, 0, &writer));
    CHECK_STATUS(tli_store_finish(writer, &m.head, true), TL_ERR_ARG); /* nothing was added */
    make_store_release_patch(ctx, &p);
    CHECK(access("w.tlod", F_OK) != 0);

    CHECK_OK(ctx, make_store_write(ctx, ctx, &m, "m.tlod"));
    CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store));
    tl_patch_info patch;
    tl_segment_info segment;
    uint8_t *bytes;
    size_t byte_count;
    CHECK_STATUS(tl_store_patch(ctx, store, m.head.patch_count, &patch), TL_ERR_ARG);
    CHECK_STATUS(tl_store_segment(ctx, store, m.head.segment_count, &segment), TL_ERR_ARG);
    CHECK_STATUS(tl_store_blob(ctx, store, 0, 5, &bytes, &byte_count), TL_ERR_ARG);
    tl_store_close(store);
    tl_store_close(NULL);
    CHECK(!tl_store_is(ctx, "nothing"));
    CHECK(!tl_store_is(ctx, "."));
    check_ctx_destroy(ctx);
}

/* ---- threads ---- */

typedef struct thread_task {
    const make_store *m;
    const tl_store *store;
    tl_ctx *ctx;
} thread_task;

static void *read_all(void *arg)
{
    const thread_task *task = arg;
    for (uint32_t p = 0; p < task->m->head.patch_count; p++)
        check_patch(task->ctx, task->m, task->store, p);
    for (uint32_t s = 0; s < task->m->head.segment_count; s++)
        check_segment(task->ctx, task->m, task->store, s);
    return NULL;
}

static void test_threads(void **state)
{
    (void)state;
    enum { THREADS = 4 };
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = NULL;
    thread_task tasks[THREADS];
    pthread_t threads[THREADS];
    make_store m = {.level_count = 4, .coarse_segments = 60, .channel_count = 2, .vert_count = 6};
    make_store_open(&m);
    CHECK_OK(ctx, make_store_write(ctx, ctx, &m, "m.tlod"));
    CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store));
    for (int i = 0; i < THREADS; i++) {
        tasks[i] = (thread_task){&m, store, check_ctx_create(1)};
        CHECK_EQ(pthread_create(&threads[i], NULL, read_all, &tasks[i]), 0);
    }
    for (int i = 0; i < THREADS; i++) CHECK_EQ(pthread_join(threads[i], NULL), 0);
    tl_store_close(store);
    for (int i = 0; i < THREADS; i++) check_ctx_destroy(tasks[i].ctx);
    check_ctx_destroy(ctx);
}

/* Gives the message of the check of a damaged file. */
static void check_damaged(const uint8_t *bytes, size_t byte_count, unsigned thread_count,
                          char *text, size_t text_bytes)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    tl_ctx *ctx = NULL;
    tl_store *store = NULL;
    opts.thread_count = thread_count;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    CHECK_OK(ctx, tli_store_open_bytes(ctx, "m.tlod", bytes, byte_count, &store));
    CHECK_STATUS(tl_store_check(ctx, store, TL_CHECK_FULL), TL_ERR_FORMAT);
    snprintf(text, text_bytes, "%s", tl_ctx_message(ctx));
    tl_store_close(store);
    check_ctx_destroy(ctx);
}

static void test_check_with_threads(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_store *store = NULL;
    tl_patch_info info;
    make_store m = {.level_count = 4, .coarse_segments = 60, .channel_count = 2, .vert_count = 6};
    make_store_open(&m);
    CHECK_OK(ctx, make_store_write(ctx, ctx, &m, "m.tlod"));
    CHECK_OK(ctx, tl_store_open(ctx, "m.tlod", &store));
    size_t byte_count;
    uint8_t *bytes = check_file_load("m.tlod", &byte_count);
    for (uint32_t p = 700; p < 1400; p += 100) {
        CHECK_OK(ctx, tl_store_patch(ctx, store, p, &info));
        bytes[info.topology_ofs + 3] ^= 1;
    }
    char one[512], many[512];
    check_damaged(bytes, byte_count, 1, one, sizeof one);
    for (int i = 0; i < 5; i++) {
        check_damaged(bytes, byte_count, 4, many, sizeof many);
        assert_string_equal(many, one);
    }
    CHECK(strstr(one, "patch 700"));
    free(bytes);
    tl_store_close(store);
    check_ctx_destroy(ctx);
}

/* ---- ending early ---- */

static bool stop_at_third(void *user, const char *stage, uint64_t done, uint64_t total)
{
    int *calls = user;
    (void)stage;
    CHECK(done <= total);
    return ++*calls < 3;
}

static void test_cancel(void **state)
{
    (void)state;
    int calls = 0;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    tl_ctx *ctx = check_ctx_create(1), *impatient = NULL;
    tl_store *store = NULL;
    make_store few = {.level_count = 4, .coarse_segments = 60, .channel_count = 1, .vert_count = 6};
    make_store all = few;
    all.channel_count = 2;
    make_store_open(&few);
    make_store_open(&all);
    CHECK_OK(ctx, make_store_write(ctx, ctx, &few, "m.tlod"));
    opts.progress = stop_at_third;
    opts.user = &calls;
    CHECK_STATUS(tl_ctx_create(&opts, &impatient), TL_OK);
    CHECK_OK(impatient, tl_store_open(impatient, "m.tlod", &store));
    CHECK_STATUS(tl_store_check(impatient, store, TL_CHECK_FULL), TL_ERR_CANCELLED);
    calls = 0;
    added_source source = {.ctx = ctx, .m = &all, .old = 1};
    tli_store_added added = {&source, added_patch, added_segment, NULL};
    CHECK_STATUS(tli_store_append(impatient, store, "c.tlod", &all.head,
                                  tli_store_codec_bytes(store), &added),
                 TL_ERR_CANCELLED);
    make_store_release_patch(ctx, &source.patch);
    CHECK(access("c.tlod", F_OK) != 0);
    tl_store_close(store);
    check_ctx_destroy(impatient);
    check_ctx_destroy(ctx);
}

/* ---- memory ---- */

static void test_budget(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_store m = {.level_count = 4, .coarse_segments = 60, .channel_count = 2, .vert_count = 6};
    make_store_open(&m);
    CHECK_OK(ctx, make_store_write(ctx, ctx, &m, "m.tlod"));
    bool opened = false, checked = false;
    for (size_t budget = 1024; !checked; budget *= 2) {
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        tl_ctx *small = NULL;
        tl_store *store = NULL;
        opts.budget_bytes = budget;
        opts.thread_count = 1;
        CHECK_STATUS(tl_ctx_create(&opts, &small), TL_OK);
        tl_status st = tl_store_open(small, "m.tlod", &store);
        if (st) CHECK_STATUS(st, TL_ERR_BUDGET);
        opened = opened || !st;
        if (!st) st = tl_store_check(small, store, TL_CHECK_FULL);
        if (st) CHECK_STATUS(st, TL_ERR_BUDGET);
        checked = !st;
        CHECK(tl_ctx_peak_bytes(small) <= budget);
        tl_store_close(store);
        check_ctx_destroy(small);
    }
    CHECK(opened);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_small),      cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_many_pages), cmocka_unit_test(test_groups_are_contiguous),
        cmocka_unit_test(test_large_head), cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_append),     cmocka_unit_test(test_wrong_use),
        cmocka_unit_test(test_threads),    cmocka_unit_test(test_check_with_threads),
        cmocka_unit_test(test_budget),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
