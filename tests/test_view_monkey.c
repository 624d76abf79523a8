/* A monkey at the commands of scenes: whatever it sets, adds, moves and undoes, from the table of
 * properties and from a fixed seed, a command changes all or nothing, steps lead back and forth,
 * what is written is read again, and what is shown of it is a content or a message. */
#include "check_view.h"

#include <time.h>

enum { COMMANDS = 4000, COMMANDS_A_LOOK = 8, LINE_BYTES = 512 };
static const double PATIENCE_S = 20;

static uint64_t seed = 20261122;

static size_t pick(size_t count)
{
    return (size_t)(make_random(&seed) >> 11) % count;
}

/* A number of any size, more often a plain one. */
static double any_real(const tl_prop_info *info)
{
    static const double REALS[] = {0, 1, -1, 0.5, 2, 50, 1e-300, -1e300, 1e300, 0.3, -0.7, 1e9};
    switch (pick(4)) {
    case 0: return info->least;
    case 1: return info->most;
    case 2: return REALS[pick(sizeof REALS / sizeof *REALS)];
    default: return 2 * make_uniform(&seed) - 0.5;
    }
}

/* A value of a property, now and then one of another type. */
static void any_value(const tl_prop_info *info, char *text, size_t bytes)
{
    static const char *const CHANNELS[] = {"f", "g", "u", "c", "f*g", "h", "\"\"", "grad(f)"};
    static const char *const TEXTS[] = {"auto", "none",   "h=2*f", "0",
                                        "1,2",  "grid:3", "x=40%", "\"\""};
    size_t used = 0, count = 0;
    const bool is_list = info->type == TL_PROP_LIST;
    const size_t rows = is_list ? pick(4) : 1;
    if (!pick(12)) {
        snprintf(text, bytes, "%s", TEXTS[pick(sizeof TEXTS / sizeof *TEXTS)]);
        return;
    }
    switch (info->type) {
    case TL_PROP_FLAG: snprintf(text, bytes, "%s", pick(2) ? "on" : "off"); return;
    case TL_PROP_CHOICE:
        while (info->choices[count]) count++;
        snprintf(text, bytes, "%s", info->choices[pick(count)]);
        return;
    case TL_PROP_TEXT:
        snprintf(text, bytes, "%s", TEXTS[pick(sizeof TEXTS / sizeof *TEXTS)]);
        return;
    case TL_PROP_CHANNEL:
        snprintf(text, bytes, "%s", CHANNELS[pick(sizeof CHANNELS / sizeof *CHANNELS)]);
        return;
    case TL_PROP_COUNT: snprintf(text, bytes, "%.0f", any_real(info)); return;
    default: break;
    }
    *text = '\0';
    for (size_t i = 0; i < rows * info->count; i++)
        used += (size_t)snprintf(text + used, bytes - used, "%s%.17g",
                                 !i                           ? ""
                                 : is_list && i % info->count ? ","
                                                              : " ",
                                 is_list && i % info->count == 0 ? (double)i : any_real(info));
}

static void any_command(const tl_scene *scene, char *line)
{
    size_t count, prop_count;
    char value[LINE_BYTES / 2];
    const tl_node *nodes = tl_scene_nodes(scene, &count), node = nodes[pick(count)];
    const tl_prop_info *props = tl_node_props(tl_scene_kind(scene, node), &prop_count);
    const tl_prop_info *prop = &props[pick(prop_count)];
    const char *name = tl_scene_name(scene, node);
    any_value(prop, value, sizeof value);
    switch (pick(12)) {
    case 0: snprintf(line, LINE_BYTES, "remove %s", name); break;
    case 1: snprintf(line, LINE_BYTES, "undo"); break;
    case 2: snprintf(line, LINE_BYTES, "redo"); break;
    case 3:
        snprintf(line, LINE_BYTES, "add %s",
                 tl_node_kind_name((tl_node_kind)pick(TL_NODE_KIND_COUNT)));
        break;
    case 4: snprintf(line, LINE_BYTES, "move %s %zu", name, pick(9)); break;
    case 5: snprintf(line, LINE_BYTES, "view %s", pick(2) ? "iso" : "400,-80,0.3"); break;
    case 6: snprintf(line, LINE_BYTES, "%s", pick(2) ? "seal" : "fit"); break;
    default: snprintf(line, LINE_BYTES, "set %s.%s %s", name, prop->name, value);
    }
}

/* A scene of few nodes, so that each of them is met often. */
static void thin(tl_ctx *ctx, tl_scene *scene)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    while (count > 14) {
        CHECK_OK(ctx, tl_scene_remove(ctx, scene, nodes[4 + pick(count - 4)]));
        nodes = tl_scene_nodes(scene, &count);
    }
}

/* Whether there is something to see. */
static bool look(tl_ctx *ctx, tl_view *view, const tl_scene *scene)
{
    tl_content *content = NULL;
    tl_camera camera;
    tl_scene_camera(scene, 64, 48, &camera);
    tl_status st = tl_view_build(ctx, view, scene, &camera, NULL, &content);
    CHECK(st == TL_OK || st == TL_ERR_ARG || st == TL_ERR_DATA || st == TL_ERR_IO ||
          st == TL_ERR_BUDGET);
    CHECK((st == TL_OK) == (content != NULL));
    CHECK(st == TL_OK || *tl_ctx_message(ctx));
    tl_content_destroy(ctx, content);
    tl_ctx_clear(ctx);
    return st == TL_OK;
}

/* As it is, and without what it asks for in vain. */
static bool look_twice(tl_ctx *ctx, tl_view *view, const tl_scene *scene)
{
    char text[1000];
    tl_scene *adapted = NULL;
    look(ctx, view, scene);
    tl_status st = tl_view_adapt(ctx, view, scene, &adapted, text, sizeof text);
    CHECK(st == TL_OK || st == TL_ERR_BUDGET);
    const bool is_shown = adapted && look(ctx, view, adapted);
    tl_scene_destroy(ctx, adapted);
    return is_shown;
}

static void check_steps(tl_ctx *ctx, tl_scene *scene)
{
    size_t steps = 0;
    const uint64_t now = tl_scene_version(scene);
    for (; tl_scene_undo_name(scene); steps++) CHECK_OK(ctx, tl_scene_undo(ctx, scene));
    for (; steps; steps--) CHECK_OK(ctx, tl_scene_redo(ctx, scene));
    CHECK(tl_scene_version(scene) == now);
}

/* Where the build reads JSON. */
static void check_file(tl_ctx *ctx, const tl_scene *scene)
{
    tl_scene *again = NULL;
    char *text = check_scene_text(ctx, scene);
    const tl_status st = tl_scene_read_text(ctx, "monkey", text, strlen(text), &again);
    CHECK(st == TL_ERR_UNSUPPORTED || tl_scene_version(again) == tl_scene_version(scene));
    tl_scene_destroy(ctx, again);
    tl_mem_free(ctx, text);
    tl_ctx_clear(ctx);
}

static void a_monkey_breaks_nothing(void **state)
{
    (void)state;
    char line[LINE_BYTES];
    size_t done = 0, good = 0, looks = 0, shown = 0;
    const clock_t begin = clock();
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, 4);
    tl_view *view = NULL;
    tl_scene *scene = view_scene(ctx, source, (const char *const[]){"add boundary", NULL});
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_ctx_set_budget(ctx, (size_t)256 << 20);
    for (; done < COMMANDS && (double)(clock() - begin) / CLOCKS_PER_SEC < PATIENCE_S; done++) {
        const uint64_t before = tl_scene_version(scene);
        any_command(scene, line);
        const tl_status st = tl_scene_do(ctx, scene, line);
        CHECK(st == TL_OK || (st == TL_ERR_ARG && *tl_ctx_message(ctx)));
        CHECK(st == TL_OK || tl_scene_version(scene) == before);
        good += st == TL_OK;
        tl_ctx_clear(ctx);
        thin(ctx, scene);
        if (done % COMMANDS_A_LOOK) continue;
        looks++;
        shown += look_twice(ctx, view, scene);
        check_steps(ctx, scene);
        check_file(ctx, scene);
    }
    printf("%zu commands, %zu of them good; %zu looks, %zu with something to see\n", done, good,
           looks, shown);
    CHECK(done > 100 && good > done / 4 && shown > looks / 4);
    tl_scene_destroy(ctx, scene);
    tl_view_destroy(view);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_monkey_breaks_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
