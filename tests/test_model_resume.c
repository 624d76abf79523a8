/* Builds that are kept, ended at every stage and between, and gone on with: the same bytes as of a
 * build that was not interrupted. Folders of other builds, changed inputs and damaged states are
 * refused by name. */
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "check_file.h"
#include "check_model.h"

static const char *const FILES[] = {"state.work",    "segments.work", "meshes.work",
                                    "carried0.work", "carried1.work", "seams0.work",
                                    "seams1.work"};
enum { FILE_COUNT = sizeof FILES / sizeof *FILES };
/* What is left for other programs, and not read again. */
static const char *const VIEWS[] = {"segments.vtu", "level_0.vtu", "level_1.vtu", "level_2.vtu",
                                    "level_3.vtu"};
enum { VIEW_COUNT = sizeof VIEWS / sizeof *VIEWS };

/* An input file, a folder and a model of this process. */
typedef struct place {
    char input[128], folder[128], model[128];
    tl_build_opts opts;
    uint8_t *bytes; /* of the model that was built at once */
    size_t byte_count;
    int reports; /* of progress, of that build */
} place;

static void write_file(const char *path, const uint8_t *bytes, size_t count)
{
    FILE *f = fopen(path, "wb");
    CHECK(f != NULL);
    CHECK_EQ(fwrite(bytes, 1, count, f), count);
    CHECK_EQ(fclose(f), 0);
}

static void clear_folder(const place *p)
{
    for (size_t i = 0; i < FILE_COUNT + VIEW_COUNT; i++) {
        char path[192];
        snprintf(path, sizeof path, "%s/%s", p->folder,
                 i < FILE_COUNT ? FILES[i] : VIEWS[i - FILE_COUNT]);
        remove(path);
    }
    rmdir(p->folder);
    CHECK(access(p->folder, F_OK) != 0); /* nothing else was in it */
}

/* What the progress hook does. */
typedef struct hook {
    int left;          /* reports before it cancels; negative: it never does */
    int seen;          /* reports */
    const char *touch; /* a file that changes at the first report of tets */
} hook;

static bool on_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    hook *h = user;
    CHECK(done <= total);
    if (h->touch && strcmp(stage, "tets") == 0) {
        const struct timespec times[2] = {{1, 0}, {1, 0}};
        CHECK_EQ(utimensat(AT_FDCWD, h->touch, times, 0), 0);
        h->touch = NULL;
    }
    h->seen++;
    return h->left < 0 || h->left-- > 0;
}

static tl_ctx *make_ctx(unsigned threads, hook *h)
{
    tl_ctx *ctx;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = threads;
    opts.progress = h ? on_progress : NULL;
    opts.user = h;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

static void end_ctx(tl_ctx *ctx)
{
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static tl_status build(tl_ctx *ctx, const place *p, const tl_build_opts *opts)
{
    tl_build_result result;
    tl_status st = tl_model_build(ctx, p->input, NULL, p->model, opts, &result);
    if (!st) CHECK_EQ(result.bytes != 0, opts->until == NULL);
    tl_build_release(ctx, &result);
    return st;
}

static double waves(const double x[3])
{
    return sin(7 * x[0]) * x[1] + cos(5 * x[2]);
}

static place open_place(const char *name)
{
    place p = {.opts = check_model_opts(600, 150)};
    long id = (long)getpid();
    snprintf(p.input, sizeof p.input, "/tmp/test_resume_%ld_%s.vtu", id, name);
    snprintf(p.folder, sizeof p.folder, "/tmp/test_resume_%ld_%s.d", id, name);
    snprintf(p.model, sizeof p.model, "/tmp/test_resume_%ld_%s.tlod", id, name);
    hook h = {.left = -1};
    tl_ctx *ctx = make_ctx(2, &h);
    make_mesh m = make_grid(9);
    make_two_regions(&m);
    tl_mesh *mesh = make_object(ctx, &m, waves);
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, p.input, NULL));
    tl_mesh_destroy(mesh);
    make_release(&m);
    h.seen = 0;
    CHECK_OK(ctx, build(ctx, &p, &p.opts));
    p.bytes = check_file_load(p.model, &p.byte_count);
    p.reports = h.seen;
    CHECK_EQ(remove(p.model), 0);
    end_ctx(ctx);
    return p;
}

static void close_place(place *p)
{
    free(p->bytes);
    CHECK_EQ(remove(p->input), 0);
    CHECK(access(p->model, F_OK) != 0);
}

/* Goes on to the end, and compares. */
static void check_resumed(const place *p, unsigned threads, uint64_t memory)
{
    tl_ctx *ctx = make_ctx(threads, NULL);
    tl_build_opts opts = p->opts;
    size_t count;
    opts.resume = p->folder;
    opts.memory_bytes = memory;
    CHECK_OK(ctx, build(ctx, p, &opts));
    uint8_t *bytes = check_file_load(p->model, &count);
    CHECK_EQ(count, p->byte_count);
    CHECK_EQ(memcmp(bytes, p->bytes, count), 0);
    free(bytes);
    CHECK_EQ(remove(p->model), 0);
    end_ctx(ctx);
}

static void test_stages(void **state)
{
    (void)state;
    static const char *const stages[] = {"segment", "finest", "level 1", "level2", "level 3"};
    place p = open_place("stages");
    tl_build_opts opts = p.opts;
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) {
        tl_ctx *ctx = make_ctx(1 + i % 2, NULL);
        opts.keep = i ? NULL : p.folder; /* each stage goes on with the one before ... */
        opts.resume = i ? p.folder : NULL;
        opts.until = stages[i];
        CHECK_OK(ctx, build(ctx, &p, &opts));
        CHECK(access(p.model, F_OK) != 0);
        end_ctx(ctx);
    }
    check_resumed(&p, 2, 0);
    check_resumed(&p, 1, (uint64_t)64 << 20); /* a build that is done is written again */
    clear_folder(&p);
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) { /* ... and each on its own */
        tl_ctx *ctx = make_ctx(2, NULL);
        opts.keep = p.folder;
        opts.resume = NULL;
        opts.until = stages[i];
        CHECK_OK(ctx, build(ctx, &p, &opts));
        end_ctx(ctx);
        check_resumed(&p, 2, 0);
        clear_folder(&p);
    }
    close_place(&p);
}

/* Cancelled at many moments, and again while it is gone on with. */
static void test_cancelled(void **state)
{
    (void)state;
    place p = open_place("cancelled");
    printf("%d reports\n", p.reports);
    for (int at = 1; at < p.reports; at += 3) {
        hook h = {.left = at};
        tl_ctx *ctx = make_ctx(2, &h);
        tl_build_opts opts = p.opts;
        opts.keep = p.folder;
        CHECK_STATUS(build(ctx, &p, &opts), TL_ERR_CANCELLED);
        CHECK(access(p.model, F_OK) != 0);
        end_ctx(ctx);
        char state_path[192];
        snprintf(state_path, sizeof state_path, "%s/state.work", p.folder);
        if (access(state_path, F_OK) == 0) {
            h = (hook){.left = 0};
            ctx = make_ctx(1, &h);
            opts.keep = NULL;
            opts.resume = p.folder;
            CHECK_STATUS(build(ctx, &p, &opts), TL_ERR_CANCELLED);
            end_ctx(ctx);
            check_resumed(&p, 2, 0);
        }
        clear_folder(&p);
    }
    close_place(&p);
}

static void check_refused(const place *p, const tl_build_opts *opts, tl_status status,
                          const char *text)
{
    tl_ctx *ctx = make_ctx(1, NULL);
    CHECK_STATUS(build(ctx, p, opts), status);
    if (!strstr(tl_ctx_message(ctx), text)) printf("message: %s\n", tl_ctx_message(ctx));
    CHECK(strstr(tl_ctx_message(ctx), text) != NULL);
    CHECK(access(p->model, F_OK) != 0);
    end_ctx(ctx);
}

static void test_refused(void **state)
{
    (void)state;
    place p = open_place("refused");
    tl_build_opts opts = p.opts;
    opts.resume = p.folder;
    check_refused(&p, &opts, TL_ERR_IO, "state.work");
    opts = p.opts;
    opts.until = "finest";
    check_refused(&p, &opts, TL_ERR_ARG, "a folder is needed");
    opts.keep = p.folder;
    opts.until = "level x";
    check_refused(&p, &opts, TL_ERR_ARG, "'level x'");
    opts.until = "finest";
    tl_ctx *ctx = make_ctx(1, NULL);
    CHECK_OK(ctx, build(ctx, &p, &opts));
    check_refused(&p, &opts, TL_ERR_DATA, "holds a build already");
    opts.keep = NULL;
    opts.resume = p.folder;
    opts.position_error = 2e-5;
    check_refused(&p, &opts, TL_ERR_DATA, "position error: 2");
    opts = p.opts;
    opts.resume = p.folder;
    opts.keep = "/tmp/another";
    check_refused(&p, &opts, TL_ERR_ARG, "stays in its folder");
    opts.keep = NULL;
    const struct timespec times[2] = {{1, 0}, {1, 0}};
    CHECK_EQ(utimensat(AT_FDCWD, p.input, times, 0), 0);
    check_refused(&p, &opts, TL_ERR_DATA, "input time: 1.0");
    make_mesh m = make_grid(3);
    tl_mesh *mesh = make_object(ctx, &m, waves);
    tl_build_result result;
    opts.resume = NULL;
    opts.keep = p.folder;
    CHECK_STATUS(tl_model_build_mesh(ctx, mesh, p.model, &opts, &result), TL_ERR_ARG);
    tl_mesh_destroy(mesh);
    make_release(&m);
    end_ctx(ctx);
    clear_folder(&p);
    close_place(&p);
}

/* Every byte of the state in turn, and shorter files of the others. */
static void test_damaged(void **state)
{
    (void)state;
    place p = open_place("damaged");
    tl_build_opts opts = p.opts;
    opts.keep = p.folder;
    opts.until = "level 1";
    tl_ctx *ctx = make_ctx(2, NULL);
    CHECK_OK(ctx, build(ctx, &p, &opts));
    end_ctx(ctx);
    opts.keep = NULL;
    opts.resume = p.folder;
    opts.until = NULL;
    for (size_t i = 0; i < FILE_COUNT; i++) {
        char path[192];
        size_t count;
        snprintf(path, sizeof path, "%s/%s", p.folder, FILES[i]);
        uint8_t *bytes = check_file_load(path, &count);
        for (size_t at = 0; i == 0 && at < count; at += 1 + count / 500) {
            bytes[at] ^= 0x10;
            write_file(path, bytes, count);
            check_refused(&p, &opts, TL_ERR_FORMAT, "state.work");
            bytes[at] ^= 0x10;
        }
        bool is_used =
            strcmp(FILES[i], "carried0.work") != 0 && strcmp(FILES[i], "seams0.work") != 0;
        write_file(path, bytes, count - count / 3 - 1);
        if (is_used) check_refused(&p, &opts, i < 2 ? TL_ERR_FORMAT : TL_ERR_DATA, FILES[i]);
        write_file(path, bytes, count);
        free(bytes);
    }
    check_resumed(&p, 2, 0);
    clear_folder(&p);
    close_place(&p);
}

static void test_changing_input(void **state)
{
    (void)state;
    place p = open_place("changing");
    hook h = {.left = -1, .touch = p.input};
    tl_ctx *ctx = make_ctx(2, &h);
    tl_build_opts opts = p.opts;
    opts.keep = p.folder;
    CHECK_STATUS(build(ctx, &p, &opts), TL_ERR_DATA);
    CHECK(strstr(tl_ctx_message(ctx), "changed while it was read") != NULL);
    end_ctx(ctx);
    clear_folder(&p);
    close_place(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stages),         cmocka_unit_test(test_cancelled),
        cmocka_unit_test(test_refused),        cmocka_unit_test(test_damaged),
        cmocka_unit_test(test_changing_input),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
