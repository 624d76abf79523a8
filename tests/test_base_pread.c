/* Files read at places: what can't be read so is refused by name, and an end that comes too early
 * is an error. */
#include <sys/stat.h>
#include <unistd.h>

#include "base/base_file.h"

#include "check_ctx.h"

static void put_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    CHECK(file && fputs(text, file) >= 0);
    CHECK_EQ(fclose(file), 0);
}

static void test_reads_at_places(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_pread file;
    char text[8] = "";
    put_file("a", "0123456789");
    CHECK_OK(ctx, tli_pread_open(ctx, "a", &file));
    CHECK_EQ(file.byte_count, 10);
    CHECK_OK(ctx, tli_pread_read(ctx, &file, 7, text, 3));
    CHECK(memcmp(text, "789", 3) == 0);
    CHECK_OK(ctx, tli_pread_read(ctx, &file, 0, text, 2));
    CHECK(memcmp(text, "01", 2) == 0);
    CHECK_OK(ctx, tli_pread_read(ctx, &file, 10, text, 0));
    CHECK_STATUS(tli_pread_read(ctx, &file, 7, text, 4), TL_ERR_IO);
    CHECK_STATUS(tli_pread_read(ctx, &file, 11, text, 0), TL_ERR_IO);
    CHECK_STATUS(tli_pread_read(ctx, &file, UINT64_MAX, text, 2), TL_ERR_IO);
    CHECK_EQ(truncate("a", 4), 0); /* by another program */
    CHECK_OK(ctx, tli_pread_read(ctx, &file, 2, text, 2));
    CHECK_STATUS(tli_pread_read(ctx, &file, 2, text, 3), TL_ERR_IO);
    CHECK(strstr(tl_ctx_message(ctx), "'a': ends at byte 4"));
    tli_pread_close(ctx, &file);
    tli_pread_close(ctx, &file); /* a closed one is allowed */
    check_ctx_destroy(ctx);
}

static void test_reads_memory(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    const uint8_t bytes[4] = {1, 2, 3, 4};
    uint8_t got[2] = {0};
    tli_pread file = {.path = "four", .bytes = bytes, .byte_count = sizeof bytes, .fd = -1};
    CHECK_OK(ctx, tli_pread_read(ctx, &file, 1, got, 2));
    CHECK_EQ(got[0], 2);
    CHECK_EQ(got[1], 3);
    CHECK_STATUS(tli_pread_read(ctx, &file, 3, got, 2), TL_ERR_IO);
    CHECK(strstr(tl_ctx_message(ctx), "'four'"));
    tli_pread_close(ctx, &file);
    check_ctx_destroy(ctx);
}

static void check_refused(tl_ctx *ctx, const char *path, const char *words)
{
    tli_pread file;
    CHECK_STATUS(tli_pread_open(ctx, path, &file), TL_ERR_IO);
    if (!strstr(tl_ctx_message(ctx), path) || !strstr(tl_ctx_message(ctx), words))
        fail_msg("\"%s\" does not name \"%s\" and \"%s\"", tl_ctx_message(ctx), path, words);
}

static void test_refuses(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    CHECK_EQ(mkfifo("pipe", 0600), 0);
    check_refused(ctx, "nothing", "can't be opened");
    check_refused(ctx, ".", "is a folder");
    check_refused(ctx, "pipe", "is no regular file"); /* and does not wait for a writer */
    check_refused(ctx, "/dev/null", "is no regular file");
    check_ctx_destroy(ctx);
}

static void test_failures(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tli_pread file;
    char text[4];
    put_file("a", "0123");
    tli_file_fail_at(ctx, 1);
    CHECK_STATUS(tli_pread_open(ctx, "a", &file), TL_ERR_IO);
    tli_file_fail_at(ctx, 2);
    CHECK_OK(ctx, tli_pread_open(ctx, "a", &file));
    CHECK_STATUS(tli_pread_read(ctx, &file, 0, text, 4), TL_ERR_IO);
    CHECK_OK(ctx, tli_pread_read(ctx, &file, 0, text, 4));
    tli_pread_close(ctx, &file);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reads_at_places),
        cmocka_unit_test(test_reads_memory),
        cmocka_unit_test(test_refuses),
        cmocka_unit_test(test_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
