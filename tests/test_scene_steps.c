/* Steps and commands: what is joined to one step, groups, limits; lines that are refused; random
 * sessions that are undone and redone to the byte. */
#include "check_scene.h"

#include "make_mesh.h"

static bool undoes(const tl_scene *s, const char *name)
{
    const char *step = tl_scene_undo_name(s);
    return name ? step && strcmp(step, name) == 0 : !step;
}

static bool redoes(const tl_scene *s, const char *name)
{
    const char *step = tl_scene_redo_name(s);
    return name ? step && strcmp(step, name) == 0 : !step;
}

static void a_drag_is_one_step(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    tl_node node;
    CHECK_OK(ctx, tl_scene_add(ctx, s, TL_NODE_SURFACE, &node));
    for (int i = 1; i < 100; i++) CHECK_OK(ctx, tl_scene_set_real(ctx, s, node, "value", i));
    tl_scene_seal(s);
    CHECK_OK(ctx, tl_scene_set_real(ctx, s, node, "value", 1000));
    CHECK(undoes(s, "set surface1.value") && redoes(s, NULL));
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(tl_scene_real(s, node, "value") == 99);
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(undoes(s, "add surface1") && redoes(s, "set surface1.value"));
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(undoes(s, NULL) && redoes(s, "add surface1"));
    CHECK_EQ(tl_scene_find(s, "surface1"), 0);
    CHECK_STATUS(tl_scene_undo(ctx, s), TL_ERR_ARG);
    for (int i = 0; i < 3; i++) CHECK_OK(ctx, tl_scene_redo(ctx, s));
    CHECK_STATUS(tl_scene_redo(ctx, s), TL_ERR_ARG);
    CHECK_EQ(tl_scene_find(s, "surface1"), node);
    CHECK(tl_scene_real(s, node, "value") == 1000);
    /* after undo and redo nothing is joined; what is new takes the place of what was undone */
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK_OK(ctx, tl_scene_set_real(ctx, s, node, "value", 5));
    CHECK(redoes(s, NULL));
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(tl_scene_real(s, node, "value") == 99);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void other_properties_are_other_steps(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    static const char *const LINES[] = {"add surface",
                                        "set surface1.value 1",
                                        "set surface1.opacity 0.5",
                                        "set surface1.value 2",
                                        "set camera.position 1 1 1",
                                        "set camera.view_angle 40",
                                        "set camera.position 2 2 2",
                                        NULL};
    check_scene_do(ctx, s, LINES);
    CHECK(undoes(s, "set camera")); /* a gesture moves all of it */
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(undoes(s, "set surface1.value"));
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(undoes(s, "set surface1.opacity"));
    CHECK(tl_scene_real(s, tl_scene_find(s, "surface1"), "value") == 1);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void a_drag_that_comes_back_is_none(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    tl_node node;
    CHECK_OK(ctx, tl_scene_add(ctx, s, TL_NODE_SURFACE, &node));
    CHECK_OK(ctx, tl_scene_set_real(ctx, s, node, "value", 1));
    tl_scene_seal(s);
    CHECK_OK(ctx, tl_scene_set_real(ctx, s, node, "value", 2));
    CHECK_OK(ctx, tl_scene_set_real(ctx, s, node, "value", 1));
    CHECK_OK(ctx, tl_scene_set_real(ctx, s, node, "value", 3)); /* not joined to what was sealed */
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(tl_scene_real(s, node, "value") == 1);
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(undoes(s, "add surface1"));
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void groups_are_one_step(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    const uint64_t empty = tl_scene_version(s);
    CHECK_OK(ctx, tl_scene_begin(ctx, s, "look"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "add volume channel=p"));
    CHECK_STATUS(tl_scene_undo(ctx, s), TL_ERR_ARG);
    CHECK_OK(ctx, tl_scene_begin(ctx, s, "inner"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "add edges"));
    CHECK_OK(ctx, tl_scene_end(ctx, s, false));
    CHECK(!tl_scene_find(s, "edges1") && tl_scene_find(s, "volume1"));
    CHECK_OK(ctx, tl_scene_end(ctx, s, true));
    CHECK(undoes(s, "look"));
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(tl_scene_version(s) == empty && undoes(s, NULL));
    /* what is dropped leaves nothing, not even the loss of what can be redone */
    CHECK_OK(ctx, tl_scene_begin(ctx, s, "dropped"));
    CHECK_OK(ctx, tl_scene_do(ctx, s, "add slice"));
    CHECK_OK(ctx, tl_scene_end(ctx, s, false));
    CHECK(tl_scene_version(s) == empty && redoes(s, "look"));
    CHECK_OK(ctx, tl_scene_begin(ctx, s, "nothing"));
    CHECK_OK(ctx, tl_scene_end(ctx, s, true));
    CHECK(redoes(s, "look"));
    CHECK_OK(ctx, tl_scene_redo(ctx, s));
    /* two of a name are one step, unless sealed */
    for (int i = 0; i < 4; i++) {
        CHECK_OK(ctx, tl_scene_begin(ctx, s, "drag"));
        CHECK_OK(ctx, tl_scene_set_real(ctx, s, TL_NODE_DETAIL + 1, "tets", 6 + i));
        CHECK_OK(ctx, tl_scene_do(ctx, s, i % 2 ? "set picture.bar on" : "set picture.bar off"));
        CHECK_OK(ctx, tl_scene_end(ctx, s, true));
        if (i == 1) tl_scene_seal(s);
    }
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(undoes(s, "drag") && tl_scene_real(s, TL_NODE_DETAIL + 1, "tets") == 7);
    CHECK_OK(ctx, tl_scene_undo(ctx, s));
    CHECK(undoes(s, "look"));
    CHECK_STATUS(tl_scene_end(ctx, s, true), TL_ERR_ARG);
    CHECK_STATUS(tl_scene_begin(ctx, s, ""), TL_ERR_ARG);
    for (int i = 0; i < 8; i++) CHECK_OK(ctx, tl_scene_begin(ctx, s, "deep"));
    CHECK_STATUS(tl_scene_begin(ctx, s, "too deep"), TL_ERR_ARG);
    tl_scene_destroy(ctx, s); /* with groups that are open */
    check_ctx_destroy(ctx);
}

static void old_steps_are_forgotten(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    int undone = 0;
    for (int i = 1; i <= TL_SCENE_STEPS_MAX + 10; i++) {
        CHECK_OK(ctx, tl_scene_set_real(ctx, s, TL_NODE_DETAIL + 1, "tets", i));
        tl_scene_seal(s);
    }
    while (!tl_scene_undo(ctx, s)) undone++;
    CHECK_EQ(undone, TL_SCENE_STEPS_MAX);
    CHECK(tl_scene_real(s, TL_NODE_DETAIL + 1, "tets") == 10);
    for (int i = 0; i < 3; i++) CHECK_OK(ctx, tl_scene_redo(ctx, s));
    tl_scene_forget(ctx, s);
    CHECK(undoes(s, NULL) && redoes(s, NULL));
    CHECK(tl_scene_real(s, TL_NODE_DETAIL + 1, "tets") == 13);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

/* ---- commands ---- */

static void lines_are_read(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_create(ctx);
    static const char *const LINES[] = {"",
                                        "   # nothing",
                                        "#nothing",
                                        "add surface value=1 color=#00ff00 # green",
                                        "  set\tsurface1.value  2  ",
                                        "set picture.background #ff0000",
                                        "set picture.title Two   words # and a comment",
                                        "set data.regions \"a  #b\"",
                                        "set camera.position 1, 2 ,3",
                                        "rename surface1 skin",
                                        "add slice\r\n",
                                        "move skin 1",
                                        NULL};
    check_scene_do(ctx, s, LINES);
    size_t count;
    const tl_node *nodes = tl_scene_nodes(s, &count);
    CHECK_EQ(count, 6);
    CHECK_EQ(nodes[5], tl_scene_find(s, "skin"));
    CHECK(tl_scene_real(s, nodes[5], "value") == 2);
    CHECK(strcmp(tl_scene_text(s, TL_NODE_PICTURE + 1, "title"), "Two words") == 0);
    CHECK(strcmp(tl_scene_text(s, TL_NODE_DATA + 1, "regions"), "a  #b") == 0);
    CHECK(tl_scene_real(s, TL_NODE_CAMERA + 1, "position") == 1);
    CHECK_OK(ctx, tl_scene_do(ctx, s, "set picture.title \"\""));
    CHECK(!*tl_scene_text(s, TL_NODE_PICTURE + 1, "title"));
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void wrong_lines_change_nothing(void **state)
{
    static const char *const LINES[][2] = {
        {"fly away", "there is no command 'fly'"},
        {"set", "expected NODE.PROP"},
        {"set surface1", "expected NODE.PROP"},
        {"set surface9.value 1", "there is no node 'surface9'"},
        {"set surface1.value", "expected a value of 'value'"},
        {"set surface1.value # 1", "expected a value of 'value'"},
        {"set surface1.value one", "surface1.value: expected a number"},
        {"set picture.title \"open", "expected a closing quote"},
        {"add", "expected a kind"},
        {"add cube", "no kind of nodes 'cube'"},
        {"add camera", "a scene has one camera"},
        {"add surface value", "expected PROP=VALUE"},
        {"add surface value=1 value=x", "surface3.value: expected a number"},
        {"remove", "expected the name of a node"},
        {"remove camera", "camera can't be removed"},
        {"remove surface1 surface2", "'surface2' is more than expected"},
        {"rename surface1", "expected a name"},
        {"rename surface1 9", "expected a name of letters"},
        {"move surface1 -1", "expected a place"},
        {"move surface1 1.5", "expected a place"},
        {"view", "expected AZ,EL"},
        {"view up", "expected AZ,EL"},
        {"view 1,2,0", "expected AZ,EL"},
        {"fit all", "more than expected"},
        {"undo 2", "more than expected"},
        {"redo", "nothing to redo"},
    };
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_scene *s = check_scene_full(ctx);
    char *text = check_scene_text(ctx, s);
    for (size_t i = 0; i < sizeof LINES / sizeof *LINES; i++) {
        CHECK_STATUS(tl_scene_do(ctx, s, LINES[i][0]), TL_ERR_ARG);
        CHECK_MESSAGE(ctx, LINES[i][1]);
        CHECK_MESSAGE(ctx, "in the command");
        CHECK(check_scene_says(ctx, s, text));
    }
    CHECK(undoes(s, "add lines1"));
    tl_mem_free(ctx, text);
    tl_scene_destroy(ctx, s);
    check_ctx_destroy(ctx);
}

static void words_are_cut_off(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    static const char *const WORDS[] = {"open", "a b.tlod", "", "x\"y\\z", "#00ff00"};
    const char *line = "open \"a b.tlod\" \"\" \"x\\\"y\\\\z\" #00ff00 #rest";
    char word[16];
    bool found;
    for (size_t i = 0; i < sizeof WORDS / sizeof *WORDS; i++) {
        CHECK_OK(ctx, tl_scene_word(ctx, &line, word, sizeof word, &found));
        CHECK(found && strcmp(word, WORDS[i]) == 0);
    }
    CHECK_OK(ctx, tl_scene_word(ctx, &line, word, sizeof word, &found));
    CHECK(!found);
    line = "0123456789abcdef";
    CHECK_STATUS(tl_scene_word(ctx, &line, word, sizeof word, &found), TL_ERR_ARG);
    const char *help = NULL;
    size_t count = 0;
    for (; tl_scene_command(count, &help); count++) CHECK(*help);
    CHECK_EQ(count, 10);
    check_ctx_destroy(ctx);
}

/* ---- random sessions ---- */

enum { SESSIONS = 20, LINES_MAX = 120 };

static unsigned draw(uint64_t *seed, unsigned count)
{
    return (unsigned)(make_uniform(seed) * count) % count;
}

/* A line that may be wrong. */
static void random_line(uint64_t *seed, const tl_scene *s, char *line, size_t bytes)
{
    size_t count, prop_count;
    const tl_node *nodes = tl_scene_nodes(s, &count);
    const tl_node node = nodes[draw(seed, (unsigned)count)];
    const char *name = tl_scene_name(s, node);
    const tl_prop_info *props = tl_node_props(tl_scene_kind(s, node), &prop_count);
    const tl_prop_info *prop = &props[draw(seed, (unsigned)prop_count)];
    const double number = floor(make_uniform(seed) * 8) / 4;
    switch (draw(seed, 12)) {
    case 0:
    case 1:
        snprintf(line, bytes, "add %s", tl_node_kind_name(draw(seed, TL_NODE_KIND_COUNT)));
        break;
    case 2: snprintf(line, bytes, "remove %s", name); break;
    case 3: snprintf(line, bytes, "move %s %u", name, draw(seed, 6)); break;
    case 4: snprintf(line, bytes, "rename %s n%u", name, draw(seed, 9)); break;
    case 5: snprintf(line, bytes, "view %g,%g", 100 * number, 10 * number); break;
    case 6: snprintf(line, bytes, "seal"); break;
    case 7: snprintf(line, bytes, "set %s.%s auto", name, prop->name); break;
    case 8: snprintf(line, bytes, "set %s.%s 0,0,0,%g,1,1", name, prop->name, number); break;
    default: snprintf(line, bytes, "set %s.%s %g", name, prop->name, number); break;
    }
}

/* What is undone is as it was, to the byte, and so is what is redone; what is read again, too. */
static void sessions_are_undone_and_redone(void **state)
{
    (void)state;
    uint64_t seed = 77;
    size_t steps = 0, refused = 0;
    tl_ctx *ctx = check_ctx_create(1);
    for (int session = 0; session < SESSIONS; session++) {
        tl_scene *s = check_scene_create(ctx);
        char line[200], *texts[LINES_MAX + 1];
        const uint64_t empty = tl_scene_version(s);
        size_t count = 1;
        for (int i = 0; i < LINES_MAX; i++) {
            random_line(&seed, s, line, sizeof line);
            refused += tl_scene_do(ctx, s, line) != TL_OK;
            if (draw(&seed, 3) == 0) tl_scene_seal(s);
            if (draw(&seed, 8) == 0 && tl_scene_undo_name(s)) CHECK_OK(ctx, tl_scene_undo(ctx, s));
        }
        while (tl_scene_redo_name(s)) CHECK_OK(ctx, tl_scene_redo(ctx, s));
        texts[0] = check_scene_text(ctx, s);
        while (!tl_scene_undo(ctx, s)) texts[count++] = check_scene_text(ctx, s);
        CHECK(tl_scene_version(s) == empty);
        steps += count - 1;
        for (size_t i = count - 1; i-- > 0;) {
            CHECK_OK(ctx, tl_scene_redo(ctx, s));
            CHECK(check_scene_says(ctx, s, texts[i]));
        }
        CHECK(!tl_scene_redo_name(s));
        for (size_t i = 0; i < count; i++) tl_mem_free(ctx, texts[i]);
        tl_scene_destroy(ctx, s);
    }
    printf("%d sessions, %zu steps, %zu lines refused\n", SESSIONS, steps, refused);
    CHECK(steps > 20 * SESSIONS);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_drag_is_one_step),
        cmocka_unit_test(other_properties_are_other_steps),
        cmocka_unit_test(a_drag_that_comes_back_is_none),
        cmocka_unit_test(groups_are_one_step),
        cmocka_unit_test(old_steps_are_forgotten),
        cmocka_unit_test(lines_are_read),
        cmocka_unit_test(wrong_lines_change_nothing),
        cmocka_unit_test(words_are_cut_off),
        cmocka_unit_test(sessions_are_undone_and_redone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
