/* A live view in trouble: files that are not there, are none, are slow or lose their end, too
 * little memory, no graphics card; work that is cancelled. It says what happened and goes on. */
#include <sys/stat.h>
#include <unistd.h>

#include "check_live.h"

static const char *const MODEL = "trouble.tlod";

/* The view still draws: a turn gives another frame. */
static void check_goes_on(live_fixture *f)
{
    uint64_t frames = tl_live_get_stats(f->live).frames;
    live_turn(f->live, f->ctx, f->scene, 7);
    const double end = live_now() + LIVE_PATIENCE_S;
    while (tl_live_get_stats(f->live).frames == frames && live_now() < end)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    CHECK(tl_live_get_stats(f->live).frames > frames);
}

/* ---- files ---- */

static void test_files_that_are_none(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    tl_live_release(f.live, live_settle(f.live));
    const tl_source *source = tl_live_source(f.live);
    CHECK_STATUS(tl_live_open(f.live, "nowhere.tlod", NULL), TL_OK);
    CHECK(strstr(live_expect_failure(f.live, TL_LIVE_OPEN, TL_ERR_IO).text, "nowhere.tlod"));
    FILE *file = fopen("empty.vtu", "w");
    CHECK(file && !fclose(file));
    CHECK_STATUS(tl_live_open(f.live, "empty.vtu", NULL), TL_OK);
    live_expect_failure(f.live, TL_LIVE_OPEN, TL_ERR_FORMAT);
    CHECK(tl_live_source(f.live) == source);
    check_goes_on(&f);
    live_end(&f);
}

static void copy_file(const char *from, const char *to)
{
    size_t count;
    FILE *in = fopen(from, "rb"), *out = fopen(to, "wb");
    static char bytes[1 << 16];
    CHECK(in && out);
    while ((count = fread(bytes, 1, sizeof bytes, in)))
        CHECK_EQ(fwrite(bytes, 1, count, out), count);
    CHECK(!fclose(in) && !fclose(out));
}

/* What a shell looks at stays until it hears that another file is open, however many were. */
static void test_former_files(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    const tl_source *first = tl_live_source(f.live), *now = first;
    const uint64_t tets = tl_source_get_facts(first)->tets;
    const double end = live_now() + LIVE_PATIENCE_S;
    for (int i = 0; i < 2; i++) {
        const tl_source *before = now;
        CHECK_STATUS(tl_live_open(f.live, MODEL, NULL), TL_OK);
        while ((now = tl_live_source(f.live)) == before && live_now() < end)
            nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
        CHECK(now != before);
    }
    while (!tl_live_settled(f.live) && live_now() < end)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    CHECK_EQ(tl_source_get_facts(first)->tets, tets);
    for (int i = 0; i < 2; i++) live_expect(f.live, TL_LIVE_OPENED);
    CHECK(tl_live_source(f.live) == now);
    live_end(&f);
}

/* A scene that a shell sets before it hears that another file is open was meant for the former one:
 * it is not shown of the new one, however much else there is to hear of. */
static void test_scene_of_the_former_file(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    tl_scene *asked = NULL, *shown = NULL;
    tl_live_release(f.live, live_settle(f.live));
    CHECK_OK(f.ctx, tl_scene_copy(f.ctx, f.scene, &asked));
    CHECK_OK(f.ctx, tl_scene_do(f.ctx, asked, "set picture.title new"));
    const tl_source *before = tl_live_source(f.live);
    const double end = live_now() + LIVE_PATIENCE_S;
    CHECK_STATUS(tl_live_open(f.live, MODEL, asked), TL_OK);
    while (tl_live_source(f.live) == before && live_now() < end)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    live_do(f.live, f.ctx, f.scene, "set picture.title old");
    for (int i = 0; i < 70; i++) { /* each answer is an event, too */
        tl_live_probe(f.live, 80, 50);
        while (!tl_live_get_probe(f.live) && live_now() < end)
            nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
    }
    CHECK_OK(f.ctx, tl_live_get_scene(f.live, f.ctx, &shown));
    assert_string_equal(tl_scene_text(shown, TL_NODE_PICTURE + 1, "title"), "new");
    live_do(f.live, f.ctx, f.scene, "set picture.title older");
    live_expect(f.live, TL_LIVE_OPENED);
    tl_scene_destroy(f.ctx, shown);
    live_do(f.live, f.ctx, asked, "set picture.title newer");
    CHECK_OK(f.ctx, tl_live_get_scene(f.live, f.ctx, &shown));
    assert_string_equal(tl_scene_text(shown, TL_NODE_PICTURE + 1, "title"), "newer");
    tl_scene_destroy(f.ctx, shown);
    tl_scene_destroy(f.ctx, asked);
    live_end(&f);
}

/* A file that is removed while it is open stays readable; one that is cut short is told of once. */
static void test_files_that_change(void **state)
{
    (void)state;
    copy_file(MODEL, "short.tlod");
    live_fixture f = live_begin(NULL, "short.tlod");
    tl_live_release(f.live, live_settle(f.live));
    CHECK_EQ(truncate("short.tlod", 70000), 0);
    live_do(f.live, f.ctx, f.scene, "set detail.full on");
    CHECK(strstr(live_expect_failure(f.live, TL_LIVE_CONTENT, TL_ERR_IO).text, "short.tlod"));
    check_goes_on(&f);
    const tl_frame *frame = live_settle(f.live); /* fails for the second time: not told again */
    CHECK(frame && frame->content && !frame->is_final && strstr(frame->note, "short.tlod"));
    tl_live_release(f.live, frame);
    live_do(f.live, f.ctx, f.scene, "undo");
    CHECK_STATUS(tl_live_open(f.live, MODEL, f.scene), TL_OK);
    live_expect(f.live, TL_LIVE_OPENED);
    frame = live_settle(f.live);
    CHECK(frame->is_final && !frame->note[0]);
    tl_live_release(f.live, frame);
    live_end(&f);

    copy_file(MODEL, "removed.tlod");
    live_fixture g = live_begin(NULL, "removed.tlod");
    CHECK_EQ(unlink("removed.tlod"), 0);
    live_do(g.live, g.ctx, g.scene, "set detail.full on");
    frame = live_settle(g.live);
    CHECK(frame->is_final);
    CHECK(frame->facts->tets == tl_source_get_facts(tl_live_source(g.live))->tets);
    tl_live_release(g.live, frame);
    live_end(&g);
}

/* What another program puts in the place of an open file is another file: the open one is read on,
 * the new one when it is opened. */
static void test_file_that_is_replaced(void **state)
{
    (void)state;
    copy_file(MODEL, "replaced.tlod");
    live_model("small.tlod", 8);
    live_fixture f = live_begin(NULL, "replaced.tlod");
    tl_live_release(f.live, live_settle(f.live));
    const uint64_t tets = tl_source_get_facts(tl_live_source(f.live))->tets;
    CHECK_EQ(rename("small.tlod", "replaced.tlod"), 0);
    live_do(f.live, f.ctx, f.scene, "set detail.full on");
    const tl_frame *frame = live_settle(f.live);
    CHECK(frame && frame->is_final);
    CHECK_EQ(frame->facts->tets, tets);
    tl_live_release(f.live, frame);
    CHECK_STATUS(tl_live_open(f.live, "replaced.tlod", f.scene), TL_OK);
    live_expect(f.live, TL_LIVE_OPENED);
    frame = live_settle(f.live);
    CHECK(frame && frame->is_final);
    CHECK(frame->facts->tets < tets);
    CHECK_EQ(frame->facts->tets, tl_source_get_facts(tl_live_source(f.live))->tets);
    tl_live_release(f.live, frame);
    live_end(&f);
}

/* Bytes that change under an open file, as those of a copy that is not complete. */
static void test_bytes_that_change(void **state)
{
    (void)state;
    enum { FIRST = 1 << 16 }; /* what stands before it is read when the file is opened */
    copy_file(MODEL, "changed.tlod");
    live_fixture f = live_begin(NULL, "changed.tlod");
    tl_live_release(f.live, live_settle(f.live));
    FILE *file = fopen("changed.tlod", "r+b");
    struct stat info;
    CHECK(file && !stat("changed.tlod", &info) && info.st_size > FIRST);
    CHECK_EQ(fseek(file, FIRST, SEEK_SET), 0);
    for (off_t i = FIRST; i < info.st_size; i++) fputc(0, file);
    CHECK(!fclose(file));
    live_do(f.live, f.ctx, f.scene, "set detail.full on");
    const tl_live_event e = live_expect_failure(f.live, TL_LIVE_CONTENT, TL_ERR_FORMAT);
    CHECK(strstr(e.text, "changed.tlod"));
    check_goes_on(&f);
    live_end(&f);
}

/* A scene that the file can't show is told of; the next one is shown. */
static void test_scene_that_fails(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    tl_live_release(f.live, live_settle(f.live));
    live_do(f.live, f.ctx, f.scene, "add surface channel=\"no such\"");
    CHECK(strstr(live_expect_failure(f.live, TL_LIVE_CONTENT, TL_ERR_ARG).text, "no such"));
    tl_live_release(f.live, live_settle(f.live));
    live_do(f.live, f.ctx, f.scene, "undo");
    const tl_frame *frame = live_settle(f.live);
    CHECK(frame && frame->is_final);
    tl_live_release(f.live, frame);
    live_end(&f);
}

/* ---- a slow disk ---- */

/* Longest frame of a flight that begins when the file is opened; *took: till all was there. */
static double fly(uint64_t throttle_bytes_s, double *took)
{
    tl_live_opts opts = tl_live_opts_defaults();
    opts.throttle_bytes_s = throttle_bytes_s;
    live_fixture f = live_begin(&opts, MODEL);
    double start = live_now();
    while (!tl_live_get_stats(f.live).frames && live_now() < start + LIVE_PATIENCE_S)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    CHECK_OK(f.ctx, tl_scene_do(f.ctx, f.scene, "set detail.full on"));
    CHECK_OK(f.ctx, tl_scene_do(f.ctx, f.scene, "set detail.moving_tets 20000"));
    for (int i = 0; i < 40 || tl_live_get_stats(f.live).moving_frames < 10; i++) {
        CHECK(live_now() < start + LIVE_PATIENCE_S);
        tl_live_set_moving(f.live, i % 10 < 8);
        live_turn(f.live, f.ctx, f.scene, 9);
        nanosleep(&(struct timespec){.tv_nsec = 10000000}, NULL);
        tl_live_release(f.live, tl_live_frame(f.live));
    }
    tl_live_set_moving(f.live, false);
    live_turn(f.live, f.ctx, f.scene, 9); /* whatever was taken: there is one more picture */
    const tl_frame *frame = live_settle(f.live);
    CHECK(frame && frame->is_final);
    tl_live_release(f.live, frame);
    *took = live_now() - start;
    double longest = tl_live_get_stats(f.live).longest_frame_s;
    live_end(&f);
    return longest;
}

static void test_slow_disk(void **state)
{
    (void)state;
    struct stat info;
    double fast_s, slow_s;
    CHECK_EQ(stat(MODEL, &info), 0);
    double fast = fly(0, &fast_s), slow = fly((uint64_t)info.st_size / 2, &slow_s);
    printf("longest frame %.3f s of %.1f s, from a slow disk %.3f s of %.1f s\n", fast, fast_s,
           slow, slow_s);
    CHECK(slow_s > 1);
    CHECK(slow < slow_s / 4); /* no frame waited for what took longest */
}

/* ---- memory ---- */

static void test_little_memory(void **state)
{
    (void)state;
    tl_live_opts opts = tl_live_opts_defaults();
    opts.ram_bytes = 6 << 20;
    live_fixture f = live_begin(&opts, MODEL);
    live_do(f.live, f.ctx, f.scene, "set detail.full on");
    live_expect(f.live, TL_LIVE_NOTICE);
    const tl_frame *frame = live_settle(f.live);
    CHECK(frame && frame->content && frame->is_final);
    CHECK(strstr(frame->note, "memory"));
    CHECK(frame->facts->tets < frame->facts->source_tets);
    tl_live_release(f.live, frame);
    tl_live_stats stats = tl_live_get_stats(f.live);
    CHECK_EQ(stats.ram_limit_bytes, opts.ram_bytes);
    CHECK_BOUND("bytes of memory", (double)stats.ram_peak_bytes, (double)opts.ram_bytes);
    check_goes_on(&f);
    live_do(f.live, f.ctx, f.scene, "set detail.ram_bytes 1000000000");
    frame = live_settle(f.live);
    CHECK(frame && frame->is_final && !frame->note[0]);
    CHECK(frame->facts->tets == frame->facts->source_tets);
    tl_live_release(f.live, frame);
    live_end(&f);
}

/* Limits below what anything takes: the view says so and lives, and all of it is there once the
 * limit is gone. Files that were too large to open are opened then. */
static void test_no_memory(void **state)
{
    (void)state;
    size_t opened = 0, failed = 0;
    for (uint64_t ram = 1 << 12; ram < 8 << 20; ram *= 2) {
        tl_live_opts opts = tl_live_opts_defaults();
        opts.ram_bytes = ram;
        live_fixture f = {.ctx = check_ctx_create(1), .live = live_create(&opts)};
        CHECK_STATUS(tl_live_open(f.live, MODEL, NULL), TL_OK);
        tl_live_event e = {0};
        const double end = live_now() + LIVE_PATIENCE_S;
        while (e.kind != TL_LIVE_OPENED && e.kind != TL_LIVE_FAILED && live_now() < end)
            if (!tl_live_next_event(f.live, &e)) tl_live_wait(f.live, UINT64_MAX, 0.01);
        if (e.kind == TL_LIVE_FAILED) {
            CHECK_STATUS(e.status, TL_ERR_BUDGET);
            CHECK(strstr(e.text, "memory is too low"));
            failed++;
            CHECK_OK(f.ctx, tl_scene_create(f.ctx, &f.scene));
        } else {
            CHECK_EQ(e.kind, TL_LIVE_OPENED);
            CHECK_OK(f.ctx, tl_live_get_scene(f.live, f.ctx, &f.scene));
            for (int i = 0; i < 5; i++) live_turn(f.live, f.ctx, f.scene, 7);
            while (!tl_live_settled(f.live) && live_now() < end) {
                while (tl_live_next_event(f.live, &e))
                    if (e.kind == TL_LIVE_FAILED) CHECK(strstr(e.text, "memory is too low"));
                tl_live_wait(f.live, UINT64_MAX, 0.1);
            }
            CHECK(tl_live_settled(f.live));
            tl_live_release(f.live, tl_live_frame(f.live));
            opened++;
        }
        printf("%llu bytes: %s\n", (unsigned long long)ram, e.text);
        live_do(f.live, f.ctx, f.scene, "set detail.ram_bytes 1000000000");
        if (e.kind == TL_LIVE_FAILED && !tl_live_source(f.live)) {
            CHECK_STATUS(tl_live_open(f.live, MODEL, f.scene), TL_OK);
            live_expect(f.live, TL_LIVE_OPENED);
        }
        const tl_frame *frame = live_settle(f.live);
        CHECK(frame && frame->is_final && !frame->note[0]);
        tl_live_release(f.live, frame);
        live_end(&f);
    }
    CHECK(opened && failed);
}

/* What came of a limit of memory: a picture, or a message in text that names a limit that will do.
 * Returns that limit, 0: there is a picture. */
static uint64_t settle_within(uint64_t ram_bytes)
{
    uint64_t named = 0;
    tl_live_opts opts = tl_live_opts_defaults();
    opts.ram_bytes = ram_bytes;
    tl_ctx *ctx = check_ctx_create(1);
    tl_live *live = live_create(&opts);
    tl_scene *scene = NULL;
    const double end = live_now() + LIVE_PATIENCE_S;
    CHECK_STATUS(tl_live_open(live, MODEL, NULL), TL_OK);
    while (!named && live_now() < end) {
        tl_live_event e;
        const bool is_told = tl_live_next_event(live, &e);
        if (is_told && e.kind == TL_LIVE_FAILED) {
            const char *mib = strstr(e.text, ": ");
            printf("%.1f MiB: %s\n", (double)ram_bytes / (1 << 20), e.text);
            CHECK(strstr(e.text, "will do") && mib);
            named = strtoull(mib + 2, NULL, 10) << 20;
        } else if (is_told && e.kind == TL_LIVE_OPENED) {
            CHECK_OK(ctx, tl_live_get_scene(live, ctx, &scene));
            CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.full on"));
            CHECK_OK(ctx, tl_scene_do(ctx, scene, "add surface value=0.2"));
            CHECK_STATUS(tl_live_set_scene(live, scene), TL_OK);
        } else if (!is_told && scene && tl_live_settled(live)) {
            break;
        } else if (!is_told) {
            nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
        }
    }
    const tl_frame *frame = tl_live_frame(live);
    CHECK(named || (frame && frame->content));
    tl_live_release(live, frame);
    CHECK_BOUND("bytes of memory", (double)tl_live_get_stats(live).ram_peak_bytes,
                (double)ram_bytes);
    tl_live_destroy(live);
    tl_scene_destroy(ctx, scene);
    check_ctx_destroy(ctx);
    return named;
}

/* Under any limit there is a picture, coarser where it must be, or a message; the limit that it
 * names is enough. */
static void test_limits_of_memory(void **state)
{
    (void)state;
    for (uint64_t kib = 1024; kib <= 16384; kib += kib < 6144 ? 512 : 2048) {
        const uint64_t named = settle_within(kib << 10);
        CHECK(kib < 6144 || !named);
        if (named) CHECK_EQ(settle_within(named), 0);
    }
}

/* ---- graphics cards ---- */

/* One that can't be had: the processor draws, and it is said. */
static void test_no_card(void **state)
{
    (void)state;
    tl_live_opts opts = tl_live_opts_defaults();
    opts.renderer = TL_RENDERER_GL_CURRENT; /* of which there is none on the drawer's thread */
    live_fixture f = {.ctx = check_ctx_create(1), .live = live_create(&opts)};
    CHECK_STATUS(tl_live_open(f.live, MODEL, NULL), TL_OK);
    tl_live_event e = live_expect(f.live, TL_LIVE_NOTICE);
    CHECK(strstr(e.text, "the processor draws"));
    const tl_frame *frame = live_settle(f.live);
    CHECK(frame && frame->is_final);
    assert_string_equal(frame->renderer, "cpu");
    CHECK(strstr(frame->note, "processor"));
    tl_live_release(f.live, frame);
    live_end(&f);
}

/* ---- asking ---- */

static void test_probe(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    live_do(f.live, f.ctx, f.scene, "set picture.box off");
    const tl_frame *frame = live_settle(f.live);
    double px[2], distance;
    CHECK(tl_camera_project(&frame->camera, (const double[3]){0.5, 0.5, 0.5}, px, &distance));
    tl_live_probe(f.live, px[0], px[1]);
    CHECK_EQ(live_expect(f.live, TL_LIVE_DONE).job, TL_LIVE_PROBE);
    const tl_probe *probe = tl_live_get_probe(f.live);
    CHECK(probe && !tl_live_get_probe(f.live));
    CHECK(probe->is_inside && probe->value_count > 0);
    const tl_probe_value *value = &probe->values[0];
    /* the mesh is linear in its tets, the formula is not */
    CHECK_NEAR(value->values[0], live_bumps(probe->xyz), value->error + 0.02);
    tl_live_release(f.live, frame);
    live_turn(f.live, f.ctx, f.scene, 5);
    tl_live_release(f.live, live_settle(f.live)); /* the answer outlives what it was asked of */
    CHECK(value->name[0] != 0);
    tl_live_probe(f.live, 0.5, 0.5);
    live_expect(f.live, TL_LIVE_DONE);
    probe = tl_live_get_probe(f.live);
    CHECK(probe && !probe->is_inside && isnan(probe->xyz[0]));
    for (int i = 0; i < 20; i++) tl_live_probe(f.live, 4 * i, 50);
    live_end(&f);
}

/* Whatever the clerk was at when the newest question came: it alone is answered, once. */
static void test_newest_question(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    const tl_frame *frame = live_settle(f.live);
    for (int i = 0; i < 60; i++) {
        tl_live_event e;
        tl_live_probe(f.live, frame->width / 2.0, frame->height / 2.0);
        nanosleep(&(struct timespec){.tv_nsec = 40000 * i}, NULL); /* before, in, after its work */
        tl_live_probe(f.live, 0.5, 0.5);
        CHECK_EQ(live_expect(f.live, TL_LIVE_DONE).job, TL_LIVE_PROBE);
        const tl_probe *probe = tl_live_get_probe(f.live);
        CHECK(probe && isnan(probe->xyz[0]));
        while (tl_live_next_event(f.live, &e)) CHECK_EQ(e.kind, TL_LIVE_PROGRESS);
        CHECK(!tl_live_get_probe(f.live));
    }
    tl_live_release(f.live, frame);
    live_end(&f);
}

static void test_histogram(void **state)
{
    (void)state;
    live_fixture f = live_begin(NULL, MODEL);
    tl_live_counts counts;
    const char *channel = tl_source_get_facts(tl_live_source(f.live))->channels[0].name;
    tl_live_release(f.live, live_settle(f.live));
    CHECK(!tl_live_histogram(f.live, channel, false, &counts));
    CHECK_EQ(live_expect(f.live, TL_LIVE_DONE).job, TL_LIVE_HISTOGRAM);
    CHECK(tl_live_histogram(f.live, channel, false, &counts));
    double sum = 0;
    for (int i = 0; i < TL_LIVE_BINS; i++) sum += counts.counts[i];
    CHECK_NEAR(sum, 1, 1e-6);
    CHECK(counts.range[0] < counts.range[1]);
    CHECK(!tl_live_histogram(f.live, "no such", false, &counts));
    live_expect_failure(f.live, TL_LIVE_HISTOGRAM, TL_ERR_ARG);
    CHECK(!tl_live_histogram(f.live, "no such", false, &counts)); /* not asked again */
    CHECK(tl_live_settled(f.live));
    live_end(&f);
}

/* ---- models ---- */

static void test_build_model(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_live *live = live_create(NULL);
    tl_live_event e;
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 20, "made.vtu"));
    CHECK_STATUS(tl_live_build_model(live, "made.vtu", NULL, false, "made.tlod", NULL), TL_OK);
    CHECK_STATUS(tl_live_build_model(live, "made.vtu", NULL, false, "two.tlod", NULL), TL_ERR_ARG);
    e = live_expect(live, TL_LIVE_DONE);
    CHECK_EQ(e.job, TL_LIVE_MODEL);
    assert_string_equal(e.text, "made.tlod");
    tl_scene *scene = live_open(live, ctx, "made.tlod");
    tl_live_release(live, live_settle(live));
    tl_scene_destroy(ctx, scene);
    CHECK_STATUS(tl_live_build_model(live, "made.vtu", NULL, false, "none.tlod", NULL), TL_OK);
    tl_live_cancel(live, TL_LIVE_MODEL);
    live_expect_failure(live, TL_LIVE_MODEL, TL_ERR_CANCELLED);
    CHECK(access("none.tlod", F_OK) != 0);
    CHECK_STATUS(tl_live_build_model(live, "no.vtu", NULL, false, "none.tlod", NULL), TL_OK);
    live_expect_failure(live, TL_LIVE_MODEL, TL_ERR_IO);
    /* a mesh is shown as it is */
    scene = live_open(live, ctx, "made.vtu");
    const tl_frame *frame = live_settle(live);
    CHECK(frame && frame->is_final && !frame->facts->is_model);
    tl_live_release(live, frame);
    tl_scene_destroy(ctx, scene);
    tl_live_destroy(live);
    check_ctx_destroy(ctx);
}

static int make_data(void **state)
{
    (void)state;
    live_model(MODEL, 22);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_files_that_are_none),
                                       cmocka_unit_test(test_former_files),
                                       cmocka_unit_test(test_scene_of_the_former_file),
                                       cmocka_unit_test(test_files_that_change),
                                       cmocka_unit_test(test_file_that_is_replaced),
                                       cmocka_unit_test(test_bytes_that_change),
                                       cmocka_unit_test(test_scene_that_fails),
                                       cmocka_unit_test(test_slow_disk),
                                       cmocka_unit_test(test_little_memory),
                                       cmocka_unit_test(test_no_memory),
                                       cmocka_unit_test(test_limits_of_memory),
                                       cmocka_unit_test(test_no_card),
                                       cmocka_unit_test(test_probe),
                                       cmocka_unit_test(test_newest_question),
                                       cmocka_unit_test(test_histogram),
                                       cmocka_unit_test(test_build_model)};
    return cmocka_run_group_tests(tests, make_data, NULL);
}
