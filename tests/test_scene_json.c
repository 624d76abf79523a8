/* Scenes in JSON: read again what was written, to the byte; presets for what is left out; wrong
 * files named by place; every prefix and change of a file; files that appear when complete. */
#include "check_scene.h"

#include <locale.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/base_file.h"
#include "fail_alloc.h"
#include "make_mesh.h"

#if TETRALOD_WITH_JANSSON

static tl_status read_text(tl_ctx *ctx, const char *text, tl_scene **scene)
{
    return tl_scene_read_text(ctx, "test.json", text, strlen(text), scene);
}

static void what_is_written_is_read(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx), *again = NULL, *file = NULL;
    size_t count, again_count;
    char *text = check_scene_text(ctx, s);
    CHECK_OK(ctx, read_text(ctx, text, &again));
    CHECK(check_scene_says(ctx, again, text));
    CHECK(tl_scene_version(again) == tl_scene_version(s));
    tl_scene_nodes(s, &count);
    tl_scene_nodes(again, &again_count);
    CHECK_EQ(again_count, count);
    CHECK(!tl_scene_undo_name(again));
    CHECK_OK(ctx, tl_scene_write(ctx, s, "full.json"));
    CHECK_OK(ctx, tl_scene_read(ctx, "full.json", &file));
    unlink("full.json");
    CHECK(check_scene_says(ctx, file, text));
    tl_mem_free(ctx, text);
    tl_scene_destroy(ctx, file);
    tl_scene_destroy(ctx, again);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

/* Numbers of all sizes, also where the point of the locale is a comma. */
static void numbers_come_back(void **state)
{
    (void)state;
    uint64_t seed = 5;
    tl_ctx *ctx = check_ctx_create(1);
    const bool comma = setlocale(LC_NUMERIC, "de_DE.UTF-8") || setlocale(LC_NUMERIC, "fr_FR.UTF-8");
    tl_scene *s = check_scene_create(ctx);
    for (int i = 0; i < 2000; i++) {
        double values[3];
        tl_scene *again = NULL;
        tl_value value;
        char print[256];
        for (int k = 0; k < 3; k++) {
            const uint64_t bits = make_random(&seed);
            memcpy(&values[k], &bits, sizeof values[k]);
            if (!isfinite(values[k]) || i % 2) values[k] = floor(2000 * make_uniform(&seed)) / 100;
        }
        CHECK_OK(ctx, tl_scene_set_reals(ctx, s, 2, "position", values, 3));
        char *text = check_scene_text(ctx, s);
        CHECK_OK(ctx, read_text(ctx, text, &again));
        CHECK_OK(ctx, tl_scene_get(ctx, again, 2, "position", &value));
        CHECK(memcmp(value.reals, values, sizeof values) == 0);
        tl_scene_print(s, 2, "position", print, sizeof print);
        CHECK_OK(ctx, tl_scene_set_text(ctx, again, 2, "position", print));
        CHECK(!tl_scene_undo_name(again));
        tl_scene_destroy(ctx, again);
        tl_mem_free(ctx, text);
        tl_scene_forget(ctx, s);
    }
    setlocale(LC_NUMERIC, "C");
    printf("a comma for the point: %s\n", comma ? "yes" : "no such locale here");
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void what_is_left_out_has_its_preset(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = NULL, *empty = check_scene_create(ctx);
    CHECK_OK(ctx, read_text(ctx, "{\"tetralod_scene\": 1}", &s));
    CHECK(tl_scene_version(s) == tl_scene_version(empty));
    tl_scene_destroy(ctx, s);
    CHECK_OK(ctx, read_text(ctx, "\xef\xbb\xbf{\"tetralod_scene\": 1}", &s)); /* as on Windows */
    CHECK(tl_scene_version(s) == tl_scene_version(empty));
    tl_scene_destroy(ctx, s);
    CHECK_OK(ctx, read_text(ctx,
                            "{\"tetralod_scene\": 1, \"things\": [{\"kind\": \"surface\"},"
                            "{\"color\": \"red\", \"kind\": \"surface\", \"value\": null}],"
                            "\"picture\": {\"background\": null, \"samples\": 2}}",
                            &s));
    CHECK_OK(ctx, tl_scene_do(ctx, empty, "add surface"));
    CHECK(tl_scene_node_version(s, 5) == tl_scene_node_version(empty, 5));
    CHECK_EQ(tl_scene_find(s, "surface2"), 6);
    CHECK(tl_scene_real(s, 6, "color") == 0xc8 / 255.0);
    tl_scene_destroy(ctx, s);
    tl_scene_destroy(ctx, empty);
    check_ctx_destroy(ctx);
}

typedef struct told {
    size_t lines;
    char last[512];
} told;

static void tell(void *user, tl_log_level level, const char *text)
{
    told *t = user;
    if (level > TL_LOG_WARNING) return;
    t->lines++;
    snprintf(t->last, sizeof t->last, "%s", text);
}

static void unknown_keys_are_warnings(void **state)
{
    (void)state;
    tl_ctx *ctx;
    told t = {0};
    tl_scene *s = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 1;
    opts.log = tell;
    opts.user = &t;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    CHECK_OK(ctx,
             read_text(ctx,
                       "{\"tetralod_scene\": 1, \"sound\": 3, \"data\": {\"kind\": 1},"
                       "\"things\": [{\"kind\": \"edges\"}, {\"kind\": \"edges\", \"lit\": 1}]}",
                       &s));
    CHECK_EQ(t.lines, 3);
    CHECK(strstr(t.last, "things[1].lit is unknown"));
    tl_scene_destroy(ctx, s);
    char text[4096] = "{\"tetralod_scene\": 1";
    for (int i = 0; i < 100; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), ",\"k%d\":0", i);
    t.lines = 0;
    CHECK_OK(ctx, read_text(ctx, strcat(text, "}"), &s));
    CHECK_EQ(t.lines, 21);
    CHECK(strstr(t.last, "80 more"));
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void wrong_files_are_named_by_place(void **state)
{
#define THING(words) "{\"tetralod_scene\": 1, \"things\": [{\"kind\": \"edges\"}, {" words "}]}"
    static const char *const WRONG[][2] = {
        {"", "can't read 'test.json' as JSON: line 1"},
        {"{\n\n\"tetralod_scene\": }", "line 3"},
        {"[]", "expected an object with \"tetralod_scene\": 1"},
        {"{}", "expected an object with \"tetralod_scene\": 1"},
        {"{\"tetralod_scene\": \"1\"}", "expected an object with"},
        {"{\"tetralod_scene\": 1, \"tetralod_scene\": 1}", "duplicate"},
        {"{\"tetralod_scene\": 1, \"camera\": []}", "camera: expected an object"},
        {"{\"tetralod_scene\": 1, \"camera\": {\"position\": [1, 2]}}",
         "camera.position: expected"},
        {"{\"tetralod_scene\": 1, \"camera\": {\"parallel\": 1}}", "camera.parallel: expected on"},
        {"{\"tetralod_scene\": 1, \"detail\": {\"tets\": 1.5}}", "detail.tets: expected a whole"},
        {"{\"tetralod_scene\": 1, \"detail\": {\"tets\": 1e300}}", "detail.tets: expected a whole"},
        {"{\"tetralod_scene\": 1, \"detail\": {\"tets\": [1]}}", "detail.tets: expected a whole"},
        {"{\"tetralod_scene\": 1, \"detail\": {\"tets\": null}}", "detail.tets: expected a whole"},
        {"{\"tetralod_scene\": 1, \"picture\": {\"title\": null}}",
         "picture.title: expected a line"},
        {"{\"tetralod_scene\": 1, \"picture\": {\"title\": \"\\n\"}}", "picture.title: expected"},
        {"{\"tetralod_scene\": 1, \"picture\": {\"renderer\": 1}}", "expected one of auto"},
        {"{\"tetralod_scene\": 1, \"things\": {}}", "things: expected a list"},
        {"{\"tetralod_scene\": 1, \"things\": [1]}", "things[0]: expected an object"},
        {THING(""), "things[1].kind: expected a kind"},
        {THING("\"kind\": \"camera\""), "things[1].kind: expected a kind"},
        {THING("\"kind\": \"surface\", \"name\": 1"), "things[1].name: expected a text"},
        {THING("\"kind\": \"surface\", \"name\": \"1\""), "things[1].name: expected a name"},
        {THING("\"kind\": \"surface\", \"name\": \"edges1\""), "there is a node 'edges1' already"},
        {THING("\"kind\": \"surface\", \"value\": \"1\""), "things[1].value: expected a number"},
        {THING("\"kind\": \"surface\", \"value\": true"), "things[1].value: expected a number"},
        {THING("\"kind\": \"surface\", \"opacity\": 2"),
         "things[1].opacity: expected a number from"},
        {THING("\"kind\": \"surface\", \"color\": \"sky\""), "things[1].color: expected a colour"},
        {THING("\"kind\": \"surface\", \"color\": [1, 2, {}]"),
         "things[1].color: expected a colour"},
        {THING("\"kind\": \"transfer\", \"colors\": [[0, 0, 0]]"), "things[1].colors: expected"},
        {THING("\"kind\": \"transfer\", \"colors\": [0, 0, 0, 0]"), "things[1].colors: expected"},
        {THING("\"kind\": \"transfer\", \"channel\": \"p\"}, {\"kind\": \"transfer\", \"channel\": "
               "\"p\""),
         "things[2].channel: 'p' is coloured by transfer1 already"},
    };
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = NULL;
    for (size_t i = 0; i < sizeof WRONG / sizeof *WRONG; i++) {
        CHECK_STATUS(read_text(ctx, WRONG[i][0], &s), TL_ERR_FORMAT);
        CHECK(!s);
        CHECK_MESSAGE(ctx, WRONG[i][1]);
        CHECK_MESSAGE(ctx, "test.json");
    }
    CHECK_STATUS(read_text(ctx, "{\"tetralod_scene\": 2}", &s), TL_ERR_UNSUPPORTED);
    CHECK_MESSAGE(ctx, "version 2, this build reads 1");
    CHECK_STATUS(read_text(ctx, "\xff\xfe{", &s), TL_ERR_FORMAT);
    CHECK_MESSAGE(ctx, "UTF-16, expected JSON in UTF-8");
    CHECK_STATUS(tl_scene_read(ctx, "nowhere.json", &s), TL_ERR_IO);
    CHECK_MESSAGE(ctx, "nowhere.json");
    CHECK_STATUS(tl_scene_read(ctx, ".", &s), TL_ERR_IO);
    CHECK_MESSAGE(ctx, "is a folder");
    CHECK_STATUS(tl_scene_read(ctx, "/dev/zero", &s), TL_ERR_FORMAT);
    CHECK_MESSAGE(ctx, "more than the 16777216 bytes");
    CHECK(tl_ctx_peak_bytes(ctx) < (size_t)64 << 20);
    check_ctx_destroy(ctx);
}

/* Too much of anything ends in a message, within the budget. */
static void large_files_are_bounded(void **state)
{
    (void)state;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    tl_ctx *ctx;
    tl_scene *s = NULL;
    opts.thread_count = 1;
    opts.budget_bytes = (size_t)64 << 20;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    const size_t bytes = (size_t)17 << 20;
    char *text = malloc(bytes);
    memset(text, '[', bytes);
    CHECK_STATUS(tl_scene_read_text(ctx, "test.json", text, bytes, &s), TL_ERR_FORMAT);
    CHECK_MESSAGE(ctx, "expected at most");
    CHECK_STATUS(tl_scene_read_text(ctx, "test.json", text, bytes / 17, &s), TL_ERR_BUDGET);
    CHECK_STATUS(tl_scene_read_text(ctx, "test.json", text, 100000, &s), TL_ERR_FORMAT);
    size_t used = (size_t)snprintf(text, bytes, "{\"tetralod_scene\":1,\"things\":[");
    for (int i = 0; i < 1000; i++)
        used += (size_t)snprintf(text + used, bytes - used, "%s{\"kind\":\"edges\"}", i ? "," : "");
    snprintf(text + used, bytes - used, "]}");
    CHECK_STATUS(read_text(ctx, text, &s), TL_ERR_FORMAT);
    CHECK_MESSAGE(ctx, "a list of at most 996 objects");
    used = (size_t)snprintf(
        text, bytes, "{\"tetralod_scene\":1,\"things\":[{\"kind\":\"transfer\",\"opacities\":[");
    for (int i = 0; i <= TL_SCENE_ROWS_MAX; i++)
        used += (size_t)snprintf(text + used, bytes - used, "%s[%d,0]", i ? "," : "", i);
    snprintf(text + used, bytes - used, "]}]}");
    CHECK_STATUS(read_text(ctx, text, &s), TL_ERR_FORMAT);
    CHECK_MESSAGE(ctx, "at most 4096 rows");
    free(text);
    check_ctx_destroy(ctx);
}

/* What would not be read again is not written. */
static void large_scenes_are_not_written(void **state)
{
    enum { NODES = 150 };
    (void)state;
    tl_scene *s = NULL;
    size_t bytes = 1;
    char *text = NULL;
    double *rows = malloc(4 * TL_SCENE_ROWS_MAX * sizeof *rows);
    tl_ctx *ctx = check_ctx_create(1);
    CHECK_OK(ctx, tl_scene_create(ctx, &s));
    for (size_t i = 0; i < 4 * TL_SCENE_ROWS_MAX; i++)
        rows[i] = i % 4 ? 1.0 / 3 : (double)(i / 4) + 1.0 / 3;
    for (int i = 0; i < NODES; i++) {
        tl_node node;
        CHECK_OK(ctx, tl_scene_add(ctx, s, TL_NODE_TRANSFER, &node));
        CHECK_OK(ctx, tl_scene_set_reals(ctx, s, node, "colors", rows, 4 * TL_SCENE_ROWS_MAX));
    }
    CHECK_STATUS(tl_scene_write(ctx, s, "large.json"), TL_ERR_UNSUPPORTED);
    CHECK_MESSAGE(ctx, "files have at most 16777216");
    CHECK(access("large.json", F_OK) != 0);
    CHECK_STATUS(tl_scene_write_text(ctx, s, &text, &bytes), TL_ERR_UNSUPPORTED);
    CHECK(!text && !bytes);
    free(rows);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

/* Every prefix, and every byte changed: a scene that can be written, or a message. */
static void damaged_files_are_survived(void **state)
{
    (void)state;
    uint64_t seed = 11;
    size_t good = 0, cases = 0;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx);
    char *text = check_scene_text(ctx, s);
    const size_t bytes = strlen(text);
    char *damaged = malloc(bytes);
    for (size_t i = 0; i < 2 * bytes; i++) {
        tl_scene *read = NULL;
        memcpy(damaged, text, bytes);
        if (i >= bytes) damaged[i - bytes] = (char)(make_random(&seed) >> 56);
        const size_t length = i < bytes ? i : bytes;
        tl_status st = tl_scene_read_text(ctx, "test.json", damaged, length, &read);
        CHECK(st == TL_OK || st == TL_ERR_FORMAT || st == TL_ERR_UNSUPPORTED);
        CHECK((st == TL_OK) == (read != NULL));
        cases++;
        if (st) {
            CHECK(*tl_ctx_message(ctx));
            continue;
        }
        good++;
        tl_mem_free(ctx, check_scene_text(ctx, read));
        tl_scene_destroy(ctx, read);
    }
    printf("%zu of %zu damaged files are scenes still\n", good, cases);
    free(damaged);
    tl_mem_free(ctx, text);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static tl_status read_again(tl_ctx *ctx, void *arg)
{
    tl_scene *s = NULL;
    tl_status st = read_text(ctx, arg, &s);
    if (!st) st = tl_scene_write(ctx, s, "again.json");
    unlink("again.json");
    tl_scene_destroy(ctx, s);
    return st;
}

static void every_failing_allocation_is_reported(void **state)
{
    (void)state;
    fail_alloc f;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx);
    char *text = check_scene_text(ctx, s);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, read_again, text) > 40);
    fail_alloc_close(&f);
    tl_mem_free(ctx, text);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

#else

static void json_is_refused_by_name(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = NULL;
    CHECK_STATUS(tl_scene_read_text(ctx, "test.json", "{}", 2, &s), TL_ERR_UNSUPPORTED);
    CHECK_MESSAGE(ctx, "libjansson-dev");
    check_ctx_destroy(ctx);
}

#endif

/* A file that can't be finished does not replace the one that is there. */
static void files_appear_when_complete(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx);
    struct stat before, after;
    int failures = 0;
    CHECK_OK(ctx, tl_scene_write(ctx, s, "kept.json"));
    CHECK_EQ(stat("kept.json", &before), 0);
    CHECK_OK(ctx, tl_scene_do(ctx, s, "remove lines1"));
    for (uint64_t n = 1;; n++) {
        tli_file_fail_at(ctx, n);
        tl_status st = tl_scene_write(ctx, s, "kept.json");
        tli_file_fail_at(ctx, 0);
        if (!st) break;
        failures++;
        CHECK_STATUS(st, TL_ERR_IO);
        CHECK_MESSAGE(ctx, "kept.json");
        CHECK_EQ(stat("kept.json", &after), 0);
        CHECK_EQ(after.st_size, before.st_size);
    }
    CHECK(failures >= 3);
    CHECK_EQ(stat("kept.json", &after), 0);
    CHECK(after.st_size < before.st_size);
    CHECK_STATUS(tl_scene_write(ctx, s, "no/such/folder.json"), TL_ERR_IO);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
#if TETRALOD_WITH_JANSSON
        cmocka_unit_test(what_is_written_is_read),
        cmocka_unit_test(numbers_come_back),
        cmocka_unit_test(what_is_left_out_has_its_preset),
        cmocka_unit_test(unknown_keys_are_warnings),
        cmocka_unit_test(wrong_files_are_named_by_place),
        cmocka_unit_test(large_files_are_bounded),
        cmocka_unit_test(large_scenes_are_not_written),
        cmocka_unit_test(damaged_files_are_survived),
        cmocka_unit_test(every_failing_allocation_is_reported),
#else
        cmocka_unit_test(json_is_refused_by_name),
#endif
        cmocka_unit_test(files_appear_when_complete),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
