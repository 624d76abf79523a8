/* What can go wrong while a data set is cut into segments, and what is left behind: nothing. And
 * what the check finds in a file that was changed. */
#include "check.h"

#include "fail_alloc.h"
#include "make_mesh.h"

#include <dirent.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/base_file.h"
#include "segment/segment.h"
#include "tetralod/segment.h"

static double slope(const double x[3])
{
    return x[0] + 10 * x[1] - 3 * x[2];
}

static tl_ctx *make_ctx(unsigned threads, size_t budget, tl_progress_fn progress, void *user)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = threads;
    opts.budget_bytes = budget;
    opts.progress = progress;
    opts.user = user;
    tl_ctx *ctx = NULL;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

static size_t count_entries(const char *folder)
{
    size_t count = 0;
    DIR *dir = opendir(folder);
    CHECK(dir != NULL);
    while (readdir(dir)) count++;
    closedir(dir);
    return count - 2; /* . and .. */
}

static tl_segment_opts small_opts(const char *folder)
{
    tl_segment_opts opts = tl_segment_opts_defaults();
    opts.segment_tets = 200;
    opts.memory_bytes = TL_SEGMENT_MEMORY_MIN;
    opts.folder = folder;
    return opts;
}

/* ---- memory and files ---- */

static tl_status build_small(tl_ctx *ctx, void *arg)
{
    tl_segments *segments = NULL;
    tl_segment_opts opts = small_opts("work");
    tl_status st = tl_segments_build(ctx, arg, NULL, &opts, "kept.seg", &segments, NULL);
    CHECK((segments != NULL) == (st == TL_OK));
    tl_segments_destroy(segments);
    return st;
}

static void test_every_allocation(void **state)
{
    (void)state;
    mkdir("work", 0777);
    tl_ctx *ctx = make_ctx(1, 0, NULL, NULL);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 7, "small.vtu"));
    tl_ctx_destroy(ctx);
    fail_alloc f;
    fail_alloc_open(&f, 1);
    long calls = fail_alloc_each(&f, build_small, (void *)(uintptr_t) "small.vtu");
    printf("%ld allocations\n", calls);
    CHECK(calls > 50);
    fail_alloc_close(&f);
    CHECK_EQ(count_entries("work"), 0);
}

static void test_every_file_operation(void **state)
{
    (void)state;
    mkdir("work", 0777);
    tl_ctx *ctx = make_ctx(2, 0, NULL, NULL);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 9, "files.vtu"));
    tl_status st = TL_ERR_IO;
    size_t n = 0;
    while (st) {
        unlink("kept.seg");
        tli_file_fail_at(ctx, ++n);
        st = build_small(ctx, (void *)(uintptr_t) "files.vtu");
        tli_file_fail_at(ctx, 0);
        CHECK(st == TL_OK || st == TL_ERR_IO);
        CHECK(st == TL_OK || strlen(tl_ctx_message(ctx)) > 0);
        CHECK((access("kept.seg", F_OK) == 0) == (st == TL_OK));
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        CHECK_EQ(count_entries("work"), 0);
    }
    printf("%zu file operations\n", n - 1);
    CHECK(n > 20);
    tl_ctx_destroy(ctx);
}

/* A folder that is not there, and one whose disk is full: no file may grow. */
static void test_folders(void **state)
{
    (void)state;
    tl_ctx *ctx = make_ctx(2, 0, NULL, NULL);
    mkdir("work", 0777);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 20, "full.vtu"));
    tl_segments *segments = NULL;
    tl_segment_opts opts = small_opts("nowhere");
    CHECK_STATUS(tl_segments_build(ctx, "full.vtu", NULL, &opts, NULL, &segments, NULL), TL_ERR_IO);
    CHECK(strstr(tl_ctx_message(ctx), "nowhere") != NULL);

    struct rlimit old, few;
    getrlimit(RLIMIT_FSIZE, &old);
    few = old;
    few.rlim_cur = 65536;
    signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &few);
    opts.folder = "work";
    tl_status st = tl_segments_build(ctx, "full.vtu", NULL, &opts, NULL, &segments, NULL);
    setrlimit(RLIMIT_FSIZE, &old);
    CHECK_STATUS(st, TL_ERR_IO);
    CHECK(segments == NULL);
    CHECK_EQ(count_entries("work"), 0);
    tl_ctx_destroy(ctx);
}

static void test_options(void **state)
{
    (void)state;
    tl_ctx *ctx = make_ctx(1, 0, NULL, NULL);
    make_mesh m = make_grid(3);
    tl_mesh *mesh = make_object(ctx, &m, slope);
    tl_segments *segments = NULL;
    tl_segment_opts opts = tl_segment_opts_defaults();
    opts.segment_tets = 10;
    CHECK_STATUS(tl_segments_build_mesh(ctx, mesh, &opts, NULL, &segments), TL_ERR_ARG);
    opts = tl_segment_opts_defaults();
    opts.memory_bytes = TL_SEGMENT_MEMORY_MIN - 1;
    CHECK_STATUS(tl_segments_build_mesh(ctx, mesh, &opts, NULL, &segments), TL_ERR_ARG);
    tl_segment seg;
    opts = tl_segment_opts_defaults();
    CHECK_OK(ctx, tl_segments_build_mesh(ctx, mesh, &opts, NULL, &segments));
    CHECK_STATUS(tl_segments_load(ctx, segments, 1, &seg), TL_ERR_ARG);
    tl_segments_destroy(segments);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

static void test_budget(void **state)
{
    (void)state;
    tl_ctx *ctx = make_ctx(1, 0, NULL, NULL);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 30, "budget.vtu"));
    tl_ctx_destroy(ctx);
    ctx = make_ctx(2, (size_t)1 << 20, NULL, NULL);
    tl_segments *segments = NULL;
    tl_segment_opts opts = small_opts(NULL);
    CHECK_STATUS(tl_segments_build(ctx, "budget.vtu", NULL, &opts, NULL, &segments, NULL),
                 TL_ERR_BUDGET);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- cancelling ---- */

static bool count_down(void *user, const char *stage, uint64_t done, uint64_t total)
{
    (void)stage, (void)done, (void)total;
    return --*(int *)user != 0;
}

static void test_cancel(void **state)
{
    (void)state;
    int left = 0;
    mkdir("work", 0777);
    tl_ctx *ctx = make_ctx(2, 0, count_down, &left);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 20, "cancel.vtu"));
    int stops = 0;
    for (int at = 1;; at++) {
        left = at;
        tl_status st = build_small(ctx, (void *)(uintptr_t) "cancel.vtu");
        CHECK_EQ(count_entries("work"), 0);
        if (!st) break;
        CHECK_STATUS(st, TL_ERR_CANCELLED);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        stops++;
    }
    printf("%d places to stop\n", stops);
    CHECK(stops > 8);
    tl_ctx_destroy(ctx);
}

/* ---- damage ---- */

/* Changes byte ofs of the file. */
static void flip(const char *path, uint64_t ofs)
{
    FILE *file = fopen(path, "r+b");
    CHECK(file != NULL);
    fseek(file, (long)ofs, SEEK_SET);
    int byte = fgetc(file);
    fseek(file, (long)ofs, SEEK_SET);
    fputc(byte ^ 1, file);
    fclose(file);
}

/* Opens and checks a kept file after one of its bytes was changed; the byte is put back. */
static tl_status check_flipped(tl_ctx *ctx, uint64_t ofs)
{
    tl_segments *segments = NULL;
    flip("kept.seg", ofs);
    tl_status st = tl_segments_open(ctx, "kept.seg", &segments);
    if (!st) st = tl_segments_check(ctx, segments, TL_CHECK_FULL);
    tl_segments_destroy(segments);
    flip("kept.seg", ofs);
    return st;
}

static void test_damage(void **state)
{
    (void)state;
    mkdir("work", 0777);
    tl_ctx *ctx = make_ctx(2, 0, NULL, NULL);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 12, "damage.vtu"));
    tl_segments *segments = NULL;
    tl_segment_opts opts = small_opts("work");
    CHECK_OK(ctx, tl_segments_build(ctx, "damage.vtu", NULL, &opts, "kept.seg", &segments, NULL));
    const tli_segment_entry entry = segments->entries[1];
    const tli_body body = tli_body_of(segments, entry.vert_count, entry.tet_count);
    const uint64_t links = segments->links_ofs + 4 * entry.first_vert;
    const uint64_t opposites = segments->opposites_ofs + 16 * entry.first_tet;
    const uint64_t bytes = tl_segments_bytes(segments);
    tl_segments_destroy(segments);

    CHECK_STATUS(check_flipped(ctx, 1), TL_ERR_FORMAT);            /* magic */
    CHECK_STATUS(check_flipped(ctx, bytes - 3), TL_ERR_FORMAT);    /* index */
    CHECK_STATUS(check_flipped(ctx, entry.body_ofs), TL_ERR_DATA); /* an id */
    CHECK_STATUS(check_flipped(ctx, entry.body_ofs + body.tets), TL_ERR_DATA);
    CHECK_STATUS(check_flipped(ctx, links), TL_ERR_DATA);
    CHECK_STATUS(check_flipped(ctx, opposites), TL_ERR_DATA);
    CHECK_OK(ctx, tl_segments_open(ctx, "kept.seg", &segments));
    CHECK_OK(ctx, tl_segments_check(ctx, segments, TL_CHECK_FULL));
    tl_segments_destroy(segments);
    CHECK_EQ(truncate("kept.seg", (off_t)bytes - 1), 0);
    CHECK_STATUS(tl_segments_open(ctx, "kept.seg", &segments), TL_ERR_FORMAT);
    CHECK_STATUS(tl_segments_open(ctx, "damage.vtu", &segments), TL_ERR_FORMAT);
    CHECK_STATUS(tl_segments_open(ctx, "none.seg", &segments), TL_ERR_IO);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_allocation), cmocka_unit_test(test_every_file_operation),
        cmocka_unit_test(test_folders),          cmocka_unit_test(test_options),
        cmocka_unit_test(test_budget),           cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_damage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
