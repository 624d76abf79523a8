/* Mapped reading and atomic output: sizes over 4 GiB, names, permissions, links, pipes, devices,
 * failures at every file operation and every allocation, full and read-only file systems. Works in
 * the current folder. */
#define _GNU_SOURCE 1 /* unshare */

#include "check.h"
#include "check_ctx.h"

#include "check_alloc.h"

#include "base/base_file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define GIB ((uint64_t)1 << 30)
#define SKIPPED 77

/* Each case works in a folder of its own. */
static int enter_folder(void **state)
{
    char *name = malloc(32);
    strcpy(name, "base_file.XXXXXX");
    *state = name;
    return mkdtemp(name) && chdir(name) == 0 ? 0 : -1;
}

static int leave_folder(void **state)
{
    DIR *folder = opendir(".");
    for (struct dirent *entry; folder && (entry = readdir(folder));) unlink(entry->d_name);
    if (folder) closedir(folder);
    int failed = chdir("..") || rmdir(*state);
    free(*state);
    return failed;
}

/* Files in the current folder, hidden ones too. */
static int file_count(void)
{
    int count = 0;
    DIR *folder = opendir(".");
    for (struct dirent *entry; folder && (entry = readdir(folder));)
        count += strcmp(entry->d_name, ".") && strcmp(entry->d_name, "..");
    if (folder) closedir(folder);
    return count;
}

static void put_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    CHECK(file && fwrite(text, 1, strlen(text), file) == strlen(text) && fclose(file) == 0);
}

static void check_file(const char *path, const char *expected)
{
    char text[256] = "";
    FILE *file = fopen(path, "rb");
    CHECK(file);
    size_t length = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[length] = 0;
    assert_string_equal(text, expected);
}

static mode_t mode_of(const char *path)
{
    struct stat info;
    CHECK_EQ(stat(path, &info), 0);
    return info.st_mode & 07777;
}

static tl_status write_text(tl_ctx *ctx, const char *path, const char *text)
{
    tli_sink *sink = NULL;
    tl_status st = tli_sink_open(ctx, path, &sink);
    if (!st) st = tli_sink_write(sink, text, strlen(text));
    tl_status end = tli_sink_close(sink, !st);
    return st ? st : end;
}

static void check_message(tl_ctx *ctx, const char *path, const char *reason)
{
    if (!strstr(tl_ctx_message(ctx), path) || !strstr(tl_ctx_message(ctx), reason))
        fail_msg("\"%s\" does not name \"%s\" and \"%s\"", tl_ctx_message(ctx), path, reason);
}

/* ---- reading ---- */

static void test_map(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_map map;
    put_file("a", "tetra");
    CHECK_OK(ctx, tli_map_open(ctx, "a", &map));
    CHECK_EQ(map.byte_count, 5);
    CHECK(memcmp(map.bytes, "tetra", 5) == 0);
    CHECK(!map.owned);
    tli_map_forget(&map, 0, 5);
    CHECK(memcmp(map.bytes, "tetra", 5) == 0);
    tli_map_close(ctx, &map);

    put_file("empty", "");
    CHECK_OK(ctx, tli_map_open(ctx, "empty", &map));
    CHECK_EQ(map.byte_count, 0);
    CHECK(map.bytes);
    tli_map_forget(&map, 0, 1);
    tli_map_close(ctx, &map);
    tl_ctx_destroy(ctx);
}

static void test_map_failures(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_map map;
    CHECK_STATUS(tli_map_open(ctx, "missing", &map), TL_ERR_IO);
    check_message(ctx, "'missing'", "No such file");
    tli_map_close(ctx, &map); /* harmless after a failure */
    CHECK_EQ(mkdir("folder", 0777), 0);
    CHECK_STATUS(tli_map_open(ctx, "folder", &map), TL_ERR_IO);
    check_message(ctx, "'folder'", "is a folder");
    CHECK_EQ(rmdir("folder"), 0);
    put_file("file", "x");
    CHECK_STATUS(tli_map_open(ctx, "file/below", &map), TL_ERR_IO);
    check_message(ctx, "'file/below'", "Not a directory");
    tl_ctx_destroy(ctx);
}

/* A pipe can't be mapped and does not tell its size. */
static void test_map_reads_pipes(void **state)
{
    (void)state;
    enum { BYTES = 300000 };
    int ends[2];
    CHECK_EQ(pipe(ends), 0);
    pid_t writer = fork();
    if (!writer) {
        static uint8_t bytes[BYTES];
        for (size_t i = 0; i < BYTES; i++) bytes[i] = (uint8_t)(i * 31);
        close(ends[0]);
        for (size_t done = 0; done < BYTES;) {
            ssize_t n = write(ends[1], bytes + done, BYTES - done);
            if (n < 0) _exit(1);
            done += (size_t)n;
        }
        _exit(0);
    }
    close(ends[1]);
    char path[40];
    snprintf(path, sizeof path, "/dev/fd/%d", ends[0]);
    tl_ctx *ctx = check_ctx_create(1);
    tli_map map;
    CHECK_OK(ctx, tli_map_open(ctx, path, &map));
    CHECK_EQ(map.byte_count, BYTES);
    CHECK(map.owned);
    for (size_t i = 0; i < BYTES; i++) CHECK_EQ(map.bytes[i], (uint8_t)(i * 31));
    tli_map_forget(&map, 0, BYTES);
    CHECK_EQ(map.bytes[BYTES - 1], (uint8_t)((BYTES - 1) * 31));
    tli_map_close(ctx, &map);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
    close(ends[0]);
    int status;
    CHECK(waitpid(writer, &status, 0) == writer && status == 0);
}

/* Files of /proc say that they are empty and are not. */
static void test_map_reads_proc(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_map map;
    if (access("/proc/self/status", R_OK)) {
        tl_ctx_destroy(ctx);
        CHECK_SKIP("there is no /proc");
    }
    CHECK_OK(ctx, tli_map_open(ctx, "/proc/self/status", &map));
    CHECK(map.byte_count > 10 && memcmp(map.bytes, "Name:", 5) == 0);
    tli_map_close(ctx, &map);
    tl_ctx_destroy(ctx);
}

static void test_map_over_4_gib(void **state)
{
    (void)state;
    const uint64_t places[] = {0, GIB * 2 - 2, GIB * 4 - 2, GIB * 4 + 12345, GIB * 5 - 4};
    int fd = open("sparse", O_CREAT | O_WRONLY, 0666);
    CHECK(fd >= 0);
    if (ftruncate(fd, (off_t)(GIB * 5))) {
        close(fd);
        CHECK_SKIP("no sparse file of 5 GiB: %s", strerror(errno));
    }
    for (size_t i = 0; i < 5; i++) CHECK_EQ(pwrite(fd, "tlod", 4, (off_t)places[i]), 4);
    close(fd);
    tl_ctx *ctx = check_ctx_create(1);
    tli_map map;
    CHECK_OK(ctx, tli_map_open(ctx, "sparse", &map));
    CHECK_EQ(map.byte_count, GIB * 5);
    for (size_t i = 0; i < 5; i++) {
        CHECK(memcmp(map.bytes + places[i], "tlod", 4) == 0);
        tli_map_forget(&map, 1, map.byte_count);
        CHECK(memcmp(map.bytes + places[i], "tlod", 4) == 0);
    }
    CHECK_EQ(map.bytes[GIB * 3], 0);
    tli_map_close(ctx, &map);
    CHECK_EQ(tl_ctx_peak_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- writing ---- */

static void test_sink_appears_when_committed(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_sink *sink = NULL;
    CHECK_OK(ctx, tli_sink_open(ctx, "out", &sink));
    CHECK_OK(ctx, tli_sink_printf(sink, "%d-%s", 12, "ab"));
    CHECK_OK(ctx, tli_sink_write(sink, "XYZ", 3));
    CHECK_EQ(tli_sink_tell(sink), 8);
    CHECK_OK(ctx, tli_sink_patch(sink, 1, "9", 1));
    CHECK_STATUS(tli_sink_patch(sink, 7, "12", 2), TL_ERR_ARG);
    CHECK_STATUS(tli_sink_patch(sink, UINT64_MAX, "1", 1), TL_ERR_ARG);
    CHECK(access("out", F_OK) != 0);
    CHECK_OK(ctx, tli_sink_close(sink, true));
    check_file("out", "19-abXYZ");
    CHECK_EQ(file_count(), 1);

    mode_t mask = umask(0);
    umask(mask);
    CHECK_EQ(mode_of("out"), 0666 & ~mask);
    CHECK_OK(ctx, tli_sink_close(NULL, true));
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void test_sink_dropped_leaves_nothing(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_sink *sink = NULL;
    static const char zeros[1000000];
    put_file("old", "old content");
    CHECK_OK(ctx, tli_sink_open(ctx, "old", &sink));
    CHECK_OK(ctx, tli_sink_write(sink, zeros, sizeof zeros));
    CHECK_OK(ctx, tli_sink_close(sink, false));
    CHECK_OK(ctx, tli_sink_open(ctx, "new", &sink));
    CHECK_OK(ctx, tli_sink_close(sink, false));
    check_file("old", "old content");
    CHECK_EQ(file_count(), 1);
    tl_ctx_destroy(ctx);
}

static void test_sink_keeps_permissions(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    put_file("out", "old");
    CHECK_EQ(chmod("out", 0640), 0);
    CHECK_OK(ctx, write_text(ctx, "out", "new"));
    check_file("out", "new");
    CHECK_EQ(mode_of("out"), 0640);
    tl_ctx_destroy(ctx);
}

static void test_sink_follows_links(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    struct stat info;
    put_file("target", "old");
    CHECK_EQ(symlink("target", "link"), 0);
    CHECK_OK(ctx, write_text(ctx, "link", "new"));
    check_file("target", "new");
    CHECK(lstat("link", &info) == 0 && S_ISLNK(info.st_mode));
    CHECK_EQ(unlink("target"), 0);
    CHECK_STATUS(write_text(ctx, "link", "new"), TL_ERR_IO);
    check_message(ctx, "'link'", "link to a file that does not exist");
    CHECK_EQ(file_count(), 1);
    tl_ctx_destroy(ctx);
}

/* Against a copy in memory: writes and patches of all sizes around the buffer's. */
static void test_sink_patches(void **state)
{
    (void)state;
    enum { BYTES = 3000000 };
    tl_ctx *ctx = check_ctx_create(1);
    tli_sink *sink = NULL;
    tli_map map;
    uint8_t *expected = malloc(BYTES + 700000), *piece = malloc(700000);
    uint32_t random = 12345;
    size_t used = 0;
    CHECK_OK(ctx, tli_sink_open(ctx, "out", &sink));
    for (int round = 0; used < BYTES; round++) {
        random = random * 1664525 + 1013904223;
        size_t bytes = random >> 8 & (round % 9 ? 0x3fff : 0x7ffff);
        memset(piece, round, bytes);
        memset(expected + used, round, bytes);
        CHECK_OK(ctx, tli_sink_write(sink, piece, bytes));
        used += bytes;
        CHECK_EQ(tli_sink_tell(sink), used);
        random = random * 1664525 + 1013904223;
        size_t at = random % (used + 1), room = used - at < 5000 ? used - at : 5000;
        memset(piece, ~round, room);
        memset(expected + at, ~round, room);
        CHECK_OK(ctx, tli_sink_patch(sink, at, piece, room));
    }
    CHECK_OK(ctx, tli_sink_close(sink, true));
    CHECK_OK(ctx, tli_map_open(ctx, "out", &map));
    CHECK_EQ(map.byte_count, used);
    CHECK(memcmp(map.bytes, expected, used) == 0);
    tli_map_close(ctx, &map);
    free(piece), free(expected);
    tl_ctx_destroy(ctx);
}

static void test_sink_prints_long_texts(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_sink *sink = NULL;
    tli_map map;
    CHECK_OK(ctx, tli_sink_open(ctx, "out", &sink));
    for (int width = 1; width < 2000000; width *= 3)
        CHECK_OK(ctx, tli_sink_printf(sink, "%0*d", width, 7));
    uint64_t bytes = tli_sink_tell(sink);
    CHECK_OK(ctx, tli_sink_close(sink, true));
    CHECK_OK(ctx, tli_map_open(ctx, "out", &map));
    CHECK_EQ(map.byte_count, bytes);
    size_t end = 0;
    for (int width = 1; width < 2000000; width *= 3)
        for (int i = 0; i < width; i++, end++) CHECK_EQ(map.bytes[end], i == width - 1 ? '7' : '0');
    CHECK_EQ(end, bytes);
    tli_map_close(ctx, &map);
    tl_ctx_destroy(ctx);
}

static void test_sink_refusals(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    CHECK_EQ(mkdir("folder", 0777), 0);
    CHECK_STATUS(write_text(ctx, "folder", "x"), TL_ERR_IO);
    check_message(ctx, "'folder'", "is a folder");
    CHECK_EQ(rmdir("folder"), 0);
    CHECK_STATUS(write_text(ctx, "missing/out", "x"), TL_ERR_IO);
    check_message(ctx, "'missing/out'", "No such file");
    CHECK_EQ(file_count(), 0);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* ---- what is no regular file is written in place ---- */

static void test_sink_into_a_pipe(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_sink *sink = NULL;
    int ends[2];
    char path[40], text[16] = "";
    CHECK_EQ(pipe(ends), 0);
    snprintf(path, sizeof path, "/dev/fd/%d", ends[1]);
    CHECK_OK(ctx, tli_sink_open(ctx, path, &sink));
    CHECK_OK(ctx, tli_sink_write(sink, "tetra", 5));
    CHECK_OK(ctx, tli_sink_patch(sink, 0, "T", 1)); /* still in the buffer */
    CHECK_OK(ctx, tli_sink_close(sink, true));
    CHECK_EQ(read(ends[0], text, sizeof text), 5);
    assert_string_equal(text, "Tetra");
    close(ends[0]);
    close(ends[1]);
    CHECK_EQ(file_count(), 0);
    tl_ctx_destroy(ctx);
}

static void test_sink_into_a_full_device(void **state)
{
    (void)state;
    if (access("/dev/full", W_OK)) CHECK_SKIP("there is no /dev/full");
    tl_ctx *ctx = check_ctx_create(1);
    tli_sink *sink = NULL;
    static const char zeros[1000000];
    CHECK_OK(ctx, tli_sink_open(ctx, "/dev/full", &sink));
    CHECK_STATUS(tli_sink_write(sink, zeros, sizeof zeros), TL_ERR_IO);
    check_message(ctx, "'/dev/full'", "No space left");
    tl_ctx_clear(ctx);
    CHECK_STATUS(tli_sink_write(sink, "x", 1), TL_ERR_IO); /* the same again, whoever asks */
    check_message(ctx, "'/dev/full'", "No space left");
    CHECK_STATUS(tli_sink_printf(sink, "x"), TL_ERR_IO);
    CHECK_STATUS(tli_sink_patch(sink, 0, "x", 0), TL_ERR_IO);
    CHECK_STATUS(tli_sink_close(sink, true), TL_ERR_IO);
    check_message(ctx, "'/dev/full'", "No space left");
    struct stat info;
    CHECK(stat("/dev/full", &info) == 0 && S_ISCHR(info.st_mode));
    tl_ctx_destroy(ctx);
}

/* Offsets over 4 GiB, without the disk for it. */
static void test_sink_counts_over_4_gib(void **state)
{
    (void)state;
    enum { PIECE = 64 << 20 };
    tl_ctx *ctx = check_ctx_create(1);
    tli_sink *sink = NULL;
    char *piece = calloc(PIECE, 1);
    CHECK_OK(ctx, tli_sink_open(ctx, "/dev/null", &sink));
    for (uint64_t i = 0; i < 5 * GIB / PIECE; i++)
        CHECK_OK(ctx, tli_sink_write(sink, piece, PIECE));
    CHECK_OK(ctx, tli_sink_write(sink, "end", 3));
    CHECK_EQ(tli_sink_tell(sink), 5 * GIB + 3);
    CHECK_OK(ctx, tli_sink_patch(sink, 4 * GIB + 1, "x", 1));
    CHECK_OK(ctx, tli_sink_patch(sink, 5 * GIB - 1, "xyz", 3));
    CHECK_OK(ctx, tli_sink_close(sink, true));
    free(piece);
    tl_ctx_destroy(ctx);
}

/* ---- failures at every place ---- */

static tl_status write_and_patch(tl_ctx *ctx, const char *path)
{
    static const char zeros[300000];
    tli_sink *sink = NULL;
    tl_status st = tli_sink_open(ctx, path, &sink);
    for (int i = 0; !st && i < 3; i++) st = tli_sink_printf(sink, "%d", i);
    if (!st) st = tli_sink_write(sink, zeros, sizeof zeros);
    if (!st) st = tli_sink_printf(sink, "%0300000d", 1);
    if (!st) st = tli_sink_patch(sink, 0, "x", 1);
    tl_status end = tli_sink_close(sink, !st);
    return st ? st : end;
}

static void test_each_file_operation_fails(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_status st = TL_ERR_IO;
    int n = 0;
    while (st) {
        put_file("out", "old");
        tli_file_fail_at(ctx, (uint64_t)++n);
        st = write_and_patch(ctx, "out");
        CHECK_EQ(file_count(), 1);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        if (!st) break;
        CHECK_STATUS(st, TL_ERR_IO);
        check_message(ctx, "'out'", "Input/output error");
        check_file("out", "old");
    }
    CHECK(n >= 6); /* open, writes, a patch, sync, rename: all were hit */
    tli_file_fail_at(ctx, 0);
    CHECK_OK(ctx, write_text(ctx, "out", "text"));
    for (n = 1, st = TL_ERR_IO; st; n++) {
        tli_map map;
        tli_file_fail_at(ctx, (uint64_t)n);
        st = tli_map_open(ctx, "out", &map);
        if (st) check_message(ctx, "'out'", "Input/output error");
        tli_map_close(ctx, &map);
    }
    CHECK_EQ(n, 4); /* opening and mapping fail, the third time is good */
    for (n = 1, st = TL_ERR_IO; st; n++) {
        tli_map map;
        tli_file_fail_at(ctx, (uint64_t)n);
        st = tli_map_open(ctx, "/proc/self/status", &map);
        tli_map_close(ctx, &map);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    }
    CHECK(n >= 4);
    tl_ctx_destroy(ctx);
}

static void test_each_allocation_fails(void **state)
{
    (void)state;
    tl_status st = TL_ERR_MEMORY;
    unsigned long long n = 0;
    while (st) {
        check_alloc alloc = {0};
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        opts.thread_count = 1;
        opts.resize = check_alloc_resize;
        opts.user = &alloc;
        tl_ctx *ctx = NULL;
        CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
        put_file("out", "old");
        alloc.fail_at = alloc.requests + ++n;
        st = write_and_patch(ctx, "out");
        CHECK_EQ(file_count(), 1);
        if (st) {
            CHECK_STATUS(st, TL_ERR_MEMORY);
            check_file("out", "old");
        }
        tl_ctx_destroy(ctx);
        CHECK_EQ(alloc.live_blocks, 0);
    }
    CHECK(n >= 6);
}

/* ---- file systems of their own, where they can be had ---- */

/* Runs fn in a child inside a fresh tmpfs. Returns its exit status; SKIPPED when there is none. */
static int in_tmpfs(const char *options, unsigned long flags, int (*fn)(void))
{
    fflush(NULL);
    pid_t child = fork();
    if (!child) {
        bool root = geteuid() == 0;
        if (unshare(CLONE_NEWNS | (root ? 0 : CLONE_NEWUSER))) _exit(SKIPPED);
        if (mount(NULL, "/", NULL, MS_REC | MS_PRIVATE, NULL)) _exit(SKIPPED);
        if (mkdir("disk", 0777) || mount("none", "disk", "tmpfs", flags, options)) _exit(SKIPPED);
        if (chdir("disk")) _exit(SKIPPED);
        int result = fn();
        fflush(NULL);
        _exit(result);
    }
    int status = 0;
    CHECK(child > 0 && waitpid(child, &status, 0) == child);
    rmdir("disk");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static tl_ctx *ctx_in_child(void)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 1;
    tl_ctx *ctx = NULL;
    if (tl_ctx_create(&opts, &ctx)) _exit(10);
    return ctx;
}

static int message_lacks(tl_ctx *ctx, const char *path, const char *reason)
{
    if (strstr(tl_ctx_message(ctx), path) && strstr(tl_ctx_message(ctx), reason)) return 0;
    printf("message: %s\n", tl_ctx_message(ctx));
    return 1;
}

/* 64 KiB of disk for 600 KB: the file that was there stays, nothing is left. */
static int fill_disk(void)
{
    tl_ctx *ctx = ctx_in_child();
    if (write_text(ctx, "out", "old")) return 1;
    if (write_and_patch(ctx, "out") != TL_ERR_IO) return 2;
    if (message_lacks(ctx, "'out'", "No space left on device")) return 3;
    if (file_count() != 1) return 4;
    tli_map map;
    if (tli_map_open(ctx, "out", &map) || map.byte_count != 3 || memcmp(map.bytes, "old", 3))
        return 5;
    tli_map_close(ctx, &map);
    if (write_text(ctx, "out", "new")) return 6; /* the space was given back */
    tl_ctx_destroy(ctx);
    return 0;
}

static void test_full_disk(void **state)
{
    (void)state;
    int result = in_tmpfs("size=64k", 0, fill_disk);
    if (result == SKIPPED) CHECK_SKIP("mounting a small tmpfs is not permitted here");
    CHECK_EQ(result, 0);
}

static int write_read_only(void)
{
    tl_ctx *ctx = ctx_in_child();
    if (write_text(ctx, "out", "x") != TL_ERR_IO) return 2;
    if (message_lacks(ctx, "'out'", "Read-only file system")) return 3;
    tl_ctx_destroy(ctx);
    return 0;
}

static void test_read_only_file_system(void **state)
{
    (void)state;
    int result = in_tmpfs("size=64k", MS_RDONLY, write_read_only);
    if (result == SKIPPED) CHECK_SKIP("mounting a tmpfs is not permitted here");
    CHECK_EQ(result, 0);
}

/* Root gives its rights up for a while. Its /proc is then closed to it, so that the sink has to
 * take the way over a temporary name, which is checked here, too. */
static void test_permissions_are_respected(void **state)
{
    (void)state;
    bool root = geteuid() == 0;
    if (root) CHECK(chmod(".", 0777) == 0 && seteuid(65534) == 0);
    tl_ctx *ctx = check_ctx_create(1);
    CHECK_EQ(mkdir("closed", 0555), 0);
    tl_status in_closed = write_text(ctx, "closed/out", "x");
    check_message(ctx, "'closed/out'", "Permission denied");
    put_file("fixed", "old");
    CHECK_EQ(chmod("fixed", 0444), 0);
    tl_status over_fixed = write_text(ctx, "fixed", "new");
    check_message(ctx, "'fixed'", "Permission denied");
    CHECK_OK(ctx, write_text(ctx, "free", "new"));
    tli_sink *dropped = NULL;
    CHECK_OK(ctx, tli_sink_open(ctx, "dropped", &dropped));
    CHECK_OK(ctx, tli_sink_close(dropped, false));
    if (root) CHECK_EQ(seteuid(0), 0);
    CHECK_STATUS(in_closed, TL_ERR_IO);
    CHECK_STATUS(over_fixed, TL_ERR_IO);
    check_file("fixed", "old");
    check_file("free", "new");
    CHECK_EQ(rmdir("closed"), 0);
    CHECK_EQ(file_count(), 2);
    tl_ctx_destroy(ctx);
}

#define CASE(test) cmocka_unit_test_setup_teardown(test, enter_folder, leave_folder)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(test_map),
        CASE(test_map_failures),
        CASE(test_map_reads_pipes),
        CASE(test_map_reads_proc),
        CASE(test_map_over_4_gib),
        CASE(test_sink_appears_when_committed),
        CASE(test_sink_dropped_leaves_nothing),
        CASE(test_sink_keeps_permissions),
        CASE(test_sink_follows_links),
        CASE(test_sink_patches),
        CASE(test_sink_prints_long_texts),
        CASE(test_sink_refusals),
        CASE(test_sink_into_a_pipe),
        CASE(test_sink_into_a_full_device),
        CASE(test_sink_counts_over_4_gib),
        CASE(test_each_file_operation_fails),
        CASE(test_each_allocation_fails),
        CASE(test_full_disk),
        CASE(test_read_only_file_system),
        CASE(test_permissions_are_respected),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
