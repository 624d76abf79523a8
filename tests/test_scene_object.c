/* Scenes: the table, values in and out with what they refuse, nodes that come, go and move, copies,
 * versions, steps that are undone and joined, failing memory. */
#include "check_scene.h"

#include "fail_alloc.h"

/* ---- the table ---- */

static void table_is_sound(void **state)
{
    (void)state;
    for (tl_node_kind kind = 0; kind < TL_NODE_KIND_COUNT; kind++) {
        size_t count;
        const tl_prop_info *props = tl_node_props(kind, &count);
        CHECK(count > 0 && *tl_node_kind_help(kind));
        CHECK_EQ(tl_node_kind_named(tl_node_kind_name(kind)), kind);
        for (size_t i = 0; i < count; i++) {
            CHECK(tl_node_prop(kind, props[i].name) == &props[i]);
            CHECK(*props[i].help && props[i].unit && props[i].preset);
            CHECK_EQ(props[i].choices != NULL, props[i].type == TL_PROP_CHOICE);
            CHECK(props[i].least <= props[i].most);
        }
    }
    CHECK(!tl_node_kind_name(TL_NODE_KIND_COUNT) && !tl_node_kind_help(TL_NODE_KIND_COUNT));
    CHECK_EQ(tl_node_kind_named("nothing"), TL_NODE_KIND_COUNT);
    CHECK(!tl_node_prop(TL_NODE_SURFACE, "nothing"));
}

static void maps_are_those_that_are_drawn(void **state)
{
    (void)state;
    size_t i = 0;
    const char *const *maps = tl_node_prop(TL_NODE_TRANSFER, "map")->choices;
    for (; maps[i]; i++) CHECK(strcmp(maps[i], tl_colormap_name(i)) == 0);
    CHECK(!tl_colormap_name(i));
}

/* Every preset is what a new node has, and is said again by tl_scene_print. */
static void presets_hold(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *scene = check_scene_create(ctx);
    for (tl_node_kind kind = 0; kind < TL_NODE_KIND_COUNT; kind++) {
        size_t count;
        tl_node node = kind + 1;
        const tl_prop_info *props = tl_node_props(kind, &count);
        if (kind > TL_NODE_DETAIL) CHECK_OK(ctx, tl_scene_add(ctx, scene, kind, &node));
        const uint64_t version = tl_scene_version(scene);
        for (size_t i = 0; i < count; i++) {
            char text[TL_SCENE_TEXT_BYTES];
            tl_value value;
            tl_scene_print(scene, node, props[i].name, text, sizeof text);
            CHECK_OK(ctx, tl_scene_get(ctx, scene, node, props[i].name, &value));
            CHECK_OK(ctx, tl_scene_set_text(ctx, scene, node, props[i].name, props[i].preset));
            CHECK_OK(ctx, tl_scene_set_text(ctx, scene, node, props[i].name, text));
            CHECK_OK(ctx, tl_scene_set(ctx, scene, node, props[i].name, &value));
            CHECK(tl_scene_version(scene) == version);
        }
    }
    tl_scene_destroy(ctx, scene);
    check_ctx_destroy(ctx);
}

/* ---- values ---- */

static void values_come_back(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx);
    tl_value value;
    char text[64];
    double six[6];
    const tl_node surface = tl_scene_find(s, "surface1"), clip = tl_scene_find(s, "clip1"),
                  slice = tl_scene_find(s, "slice1");
    CHECK_EQ(tl_scene_kind(s, surface), TL_NODE_SURFACE);
    CHECK(tl_scene_real(s, surface, "value") == 0.1);
    CHECK_OK(ctx, tl_scene_get(ctx, s, surface, "color", &value));
    CHECK_EQ(value.count, 3);
    CHECK(value.reals[1] == 0x6f / 255.0);
    CHECK(strcmp(tl_scene_text(s, TL_NODE_DATA + 1, "regions"), "steel, \"air\" \\ 3") == 0);
    CHECK(strcmp(tl_scene_text(s, tl_scene_find(s, "boundary1"), "mark"), "patches") == 0);
    CHECK(tl_scene_real(s, tl_scene_find(s, "boundary1"), "mark") == 1);
    CHECK(tl_scene_flag(s, tl_scene_find(s, "volume1"), "lit"));
    CHECK(!tl_scene_flag(s, surface, "nothing") && !*tl_scene_text(s, 999, "value"));
    /* -y at 30 % of 10 to 20 */
    tl_scene_plane(s, clip, "plane", six);
    CHECK(six[1] == 13 && six[4] == -1 && six[0] == 0 && six[3] == 0);
    CHECK_OK(ctx, tl_scene_set_text(ctx, s, slice, "plane", "auto"));
    tl_scene_plane(s, slice, "plane", six);
    CHECK(six[0] == 1 && six[1] == 15 && six[2] == -4.5 && six[3] == 1);
    tl_scene_box(s, TL_NODE_DETAIL + 1, "focus_box", six);
    CHECK(six[0] == 0 && six[3] == 2 && six[1] == 12.5 && six[4] == 17.5);
    /* as many bytes as it takes, cut off where there is no room */
    CHECK_EQ(tl_scene_print(s, surface, "channel", text, 1), 1);
    CHECK(!*text);
    CHECK_EQ(tl_scene_print(s, surface, "opacity", text, sizeof text), 4);
    CHECK(strcmp(text, "0.25") == 0);
    CHECK_EQ(tl_scene_transfer_of(s, "p"), tl_scene_find(s, "transfer1"));
    CHECK_EQ(tl_scene_transfer_of(s, "q"), 0);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void wrong_values_are_refused(void **state)
{
    static const struct {
        const char *node, *prop, *text, *message;
    } WRONG[] = {
        {"surface1", "opacity", "1.1", "surface1.opacity: expected a number from 0 to 1"},
        {"surface1", "opacity", "-0.1", "from 0 to 1"},
        {"surface1", "opacity", "auto", "surface1.opacity"},
        {"surface1", "value", "nan", "expected a number, or auto"},
        {"surface1", "value", "1e999", "expected a number"},
        {"surface1", "value", "1 2", "expected a number"},
        {"surface1", "value", "1x", "expected a number"},
        {"surface1", "visible", "maybe", "expected on or off"},
        {"surface1", "visible", "0.5", "expected on or off"},
        {"surface1", "color", "pinkish", "expected a colour"},
        {"surface1", "color", "#12345", "expected a colour"},
        {"surface1", "color", "0,0,2", "expected a colour"},
        {"surface1", "channel", "a\tb", "expected a line of UTF-8"},
        {"surface1", "channel", "\xc3", "expected a line of UTF-8"},
        {"surface1", "channel", "\xed\xa0\x80", "expected a line of UTF-8"},
        {"slice1", "plane", "0 0 0 0 0 0", "a normal that is not 0"},
        {"slice1", "plane", "w", "expected six numbers"},
        {"slice1", "plane", "y=", "expected six numbers"},
        {"slice1", "plane", "y=1%%", "expected six numbers"},
        {"lines1", "box", "1 0 0 0 1 1", "expected six numbers"},
        {"lines1", "box", "0 0 0 1 1", "expected six numbers"},
        {"camera", "position", "1 2", "expected three numbers"},
        {"camera", "position", "1,,2", "expected three numbers"},
        {"camera", "position", "1 2 3,", "expected three numbers"},
        {"picture", "renderer", "vulkan", "expected one of auto gl cpu"},
        {"picture", "samples", "1.5", "a whole number from 0 to 8"},
        {"detail", "tets", "-1", "a whole number from 0"},
        {"detail", "frame_s", "0", "from 0.001 to 10"},
        {"transfer1", "range", "2 1", "two numbers that do not fall"},
        {"transfer1", "colors", "0,0,0", "rows of 4 numbers"},
        {"transfer1", "colors", "0,0,0,0,1,0,0,0", "rows of 4 numbers"},
        {"transfer1", "colors", "0,0,0,0 1,0,0 0,1", "rows of 4 numbers"},
        {"transfer1", "colors", "1,0,0,0 0,0,0,0", "that does not fall"},
        {"transfer1", "opacities", "0,1.5", "from 0 to 1"},
        {"surface1", "nothing", "1", "surface1 has no property 'nothing'"},
    };
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *scene = check_scene_full(ctx);
    const uint64_t version = tl_scene_version(scene);
    for (size_t i = 0; i < sizeof WRONG / sizeof *WRONG; i++) {
        CHECK_STATUS(tl_scene_set_text(ctx, scene, tl_scene_find(scene, WRONG[i].node),
                                       WRONG[i].prop, WRONG[i].text),
                     TL_ERR_ARG);
        CHECK_MESSAGE(ctx, WRONG[i].message);
    }
    CHECK_STATUS(tl_scene_set_text(ctx, scene, 999, "value", "1"), TL_ERR_ARG);
    CHECK_MESSAGE(ctx, "no node 999");
    const double infinite[3] = {0, 0, (double)INFINITY};
    CHECK_STATUS(tl_scene_set_reals(ctx, scene, 2, "position", infinite, 3), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_set_reals(ctx, scene, 2, "position", NULL, 0), TL_OK);
    CHECK_STATUS(tl_scene_set_real(ctx, scene, 3, "renderer", 3), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_set_real(ctx, scene, 3, "renderer", 0.5), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_set_real(ctx, scene, 3, "title", 1), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_set(ctx, scene, 3, "samples", &(tl_value){.text = "1"}), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_set_flag(ctx, scene, 3, "nothing", true), TL_ERR_ARG);
    char *text = malloc(TL_SCENE_TEXT_BYTES + 1);
    memset(text, 'a', TL_SCENE_TEXT_BYTES);
    text[TL_SCENE_TEXT_BYTES] = '\0';
    CHECK_STATUS(tl_scene_set_text(ctx, scene, 3, "title", text), TL_ERR_ARG);
    CHECK_OK(ctx, tl_scene_set_text(ctx, scene, 3, "title", text + 1));
    CHECK_OK(ctx, tl_scene_undo(ctx, scene));
    free(text);
    /* the camera that was emptied is there again */
    CHECK_OK(ctx, tl_scene_undo(ctx, scene));
    CHECK(tl_scene_version(scene) == version);
    tl_scene_destroy(ctx, scene);
    check_ctx_destroy(ctx);
}

static void colors_are_read(void **state)
{
    (void)state;
    double rgb[3] = {9, 9, 9};
    for (size_t i = 0; tl_color_name(i); i++) CHECK(tl_color_read(tl_color_name(i), rgb));
    CHECK(tl_color_read("#FFff00", rgb) && rgb[0] == 1 && rgb[1] == 1 && rgb[2] == 0);
    CHECK(tl_color_read("0.25,0.5,1", rgb) && rgb[0] == 0.25 && rgb[1] == 0.5 && rgb[2] == 1);
    CHECK(!tl_color_read("", rgb) && !tl_color_read("#ff", rgb) && !tl_color_read("1,1", rgb) &&
          !tl_color_read("1,1,1,1", rgb) && !tl_color_read("1,nan,1", rgb));
    CHECK(rgb[0] == 0.25);
}

/* ---- nodes ---- */

static void nodes_come_go_and_move(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    tl_node a, b, c, d;
    size_t count;
    CHECK_OK(ctx, tl_scene_add(ctx, s, TL_NODE_SURFACE, &a));
    CHECK_OK(ctx, tl_scene_add(ctx, s, TL_NODE_SURFACE, &b));
    CHECK_OK(ctx, tl_scene_add(ctx, s, TL_NODE_SLICE, &c));
    CHECK(strcmp(tl_scene_name(s, b), "surface2") == 0);
    for (size_t to = 0; to < 5; to++) { /* everywhere, from everywhere */
        for (size_t from = 0; from < 3; from++) {
            const tl_node *nodes = tl_scene_nodes(s, &count);
            const tl_node moved = nodes[4 + from];
            CHECK_EQ(count, 7);
            CHECK_OK(ctx, tl_scene_move(ctx, s, moved, to));
            nodes = tl_scene_nodes(s, &count);
            CHECK_EQ(nodes[4 + (to < 3 ? to : 2)], moved);
            for (size_t i = 0; i < 4; i++) CHECK_EQ(nodes[i], i + 1);
            CHECK_EQ(nodes[4] + nodes[5] + nodes[6], a + b + c);
        }
    }
    CHECK_OK(ctx, tl_scene_rename(ctx, s, a, "skin"));
    CHECK_OK(ctx, tl_scene_rename(ctx, s, a, "skin"));
    CHECK_EQ(tl_scene_find(s, "skin"), a);
    CHECK_STATUS(tl_scene_rename(ctx, s, b, "skin"), TL_ERR_ARG);
    CHECK_MESSAGE(ctx, "there is a node 'skin' already");
    static const char *const NAMES[] = {
        "",    "1a",       "a.b",
        "a b", "\xc3\xa4", "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"};
    for (size_t i = 0; i < sizeof NAMES / sizeof *NAMES; i++)
        CHECK_STATUS(tl_scene_rename(ctx, s, b, NAMES[i]), TL_ERR_ARG);
    /* numbers are not used again, names are */
    CHECK_OK(ctx, tl_scene_remove(ctx, s, b));
    CHECK_OK(ctx, tl_scene_add(ctx, s, TL_NODE_SURFACE, &d));
    CHECK(d != b && strcmp(tl_scene_name(s, d), "surface1") == 0);
    CHECK_EQ(tl_scene_kind(s, b), TL_NODE_KIND_COUNT);
    CHECK(!tl_scene_name(s, b));
    CHECK_STATUS(tl_scene_remove(ctx, s, b), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_remove(ctx, s, TL_NODE_CAMERA + 1), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_move(ctx, s, TL_NODE_CAMERA + 1, 0), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_rename(ctx, s, TL_NODE_CAMERA + 1, "eye"), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_add(ctx, s, TL_NODE_CAMERA, &d), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_add(ctx, s, TL_NODE_KIND_COUNT, &d), TL_ERR_ARG);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void a_channel_has_one_transfer(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    CHECK_OK(ctx, tl_scene_do(ctx, s, "add transfer channel=p"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "set transfer1.channel p"));
    CHECK_STATUS(tl_scene_do(ctx, s, "add transfer channel=p"), TL_ERR_ARG);
    CHECK_MESSAGE(ctx, "transfer2.channel: 'p' is coloured by transfer1 already");
    CHECK_EQ(tl_scene_find(s, "transfer2"), 0); /* all of it or nothing */
    CHECK_OK(ctx, tl_scene_do(ctx, s, "add transfer"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "add transfer channel=q"));
    CHECK_STATUS(tl_scene_do(ctx, s, "set transfer3.channel p"), TL_ERR_ARG);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void a_scene_is_bounded(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    size_t count;
    CHECK_OK(ctx, tl_scene_begin(ctx, s, "many"));
    for (int i = 4; i < TL_SCENE_NODES_MAX; i++)
        CHECK_OK(ctx, tl_scene_add(ctx, s, TL_NODE_EDGES, NULL));
    CHECK_STATUS(tl_scene_add(ctx, s, TL_NODE_EDGES, NULL), TL_ERR_ARG);
    CHECK_OK(ctx, tl_scene_end(ctx, s, true));
    tl_scene_nodes(s, &count);
    CHECK_EQ(count, TL_SCENE_NODES_MAX);
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    tl_scene_nodes(s, &count);
    CHECK_EQ(count, 4);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

/* ---- copies and versions ---- */

static void copies_say_the_same(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1), *other = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx), *copy = NULL;
    size_t count, copied;
    CHECK_OK(other, tl_scene_copy(other, s, &copy));
    char *text = check_scene_text(ctx, s);
    CHECK(check_scene_says(other, copy, text));
    CHECK(tl_scene_version(copy) == tl_scene_version(s));
    const tl_node *nodes = tl_scene_nodes(s, &count), *twins = tl_scene_nodes(copy, &copied);
    CHECK_EQ(copied, count);
    for (size_t i = 0; i < count; i++) {
        CHECK_EQ(twins[i], nodes[i]);
        CHECK(tl_scene_node_version(copy, nodes[i]) == tl_scene_node_version(s, nodes[i]));
    }
    double bounds[6];
    tl_scene_bounds(copy, bounds);
    CHECK(memcmp(bounds, CHECK_SCENE_BOUNDS, sizeof bounds) == 0);
    CHECK(!tl_scene_undo_name(copy));
    tl_scene_destroy(ctx, s); /* the copy stands alone */
    CHECK(check_scene_says(other, copy, text));
    tl_mem_free(ctx, text);
    tl_scene_destroy(other, copy);
    check_ctx_destroy(other);
    check_ctx_destroy(ctx);
}

static void versions_tell_what_changed(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx);
    const tl_node surface = tl_scene_find(s, "surface1"), slice = tl_scene_find(s, "slice1");
    const uint64_t all = tl_scene_version(s), one = tl_scene_node_version(s, surface),
                   other = tl_scene_node_version(s, slice);
    CHECK_OK(ctx, tl_scene_set_real(ctx, s, surface, "value", 0.2));
    CHECK(tl_scene_version(s) != all && tl_scene_node_version(s, surface) != one);
    CHECK(tl_scene_node_version(s, slice) == other);
    CHECK_OK(ctx, tl_scene_set_real(ctx, s, surface, "value", 0.1));
    CHECK(tl_scene_version(s) == all && tl_scene_node_version(s, surface) == one);
    CHECK_OK(ctx, tl_scene_move(ctx, s, slice, 0));
    CHECK(tl_scene_version(s) != all && tl_scene_node_version(s, slice) == other);
    CHECK_EQ(tl_scene_node_version(s, 999), 0);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

/* ---- failing memory ---- */

/* Whatever fails leaves the scene as it was; all is freed. */
static tl_status change_all(tl_ctx *ctx, void *arg)
{
    static const char *const LINES[] = {"add surface channel=p value=1",
                                        "set surface1.value 2",
                                        "seal",
                                        "set surface1.value 3",
                                        "add transfer channel=p colors=\"0,0,0,0 1,1,1,1\"",
                                        "move transfer1 0",
                                        "rename transfer1 t",
                                        "view iso",
                                        "remove surface1",
                                        "undo",
                                        "redo"};
    tl_scene *s = NULL, *copy = NULL;
    (void)arg;
    tl_status st = tl_scene_create(ctx, &s);
    for (size_t i = 0; !st && i < sizeof LINES / sizeof *LINES; i++) {
        const uint64_t before = tl_scene_version(s);
        st = tl_scene_do(ctx, s, LINES[i]);
        if (st) CHECK(tl_scene_version(s) == before);
    }
    if (!st) st = tl_scene_copy(ctx, s, &copy);
    tl_scene_destroy(ctx, copy);
    tl_scene_destroy(ctx, s);
    return st;
}

static void every_failing_allocation_is_reported(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, change_all, NULL) > 40);
    fail_alloc_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(table_is_sound),
        cmocka_unit_test(maps_are_those_that_are_drawn),
        cmocka_unit_test(presets_hold),
        cmocka_unit_test(values_come_back),
        cmocka_unit_test(wrong_values_are_refused),
        cmocka_unit_test(colors_are_read),
        cmocka_unit_test(nodes_come_go_and_move),
        cmocka_unit_test(a_channel_has_one_transfer),
        cmocka_unit_test(a_scene_is_bounded),
        cmocka_unit_test(copies_say_the_same),
        cmocka_unit_test(versions_tell_what_changed),
        cmocka_unit_test(every_failing_allocation_is_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
