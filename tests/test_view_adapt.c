/* Scenes made for other data: what these lack is off and said, all else is shown as it was. */
#include "check_view.h"

static tl_view *view_of(tl_ctx *ctx, tl_source *source)
{
    tl_view *view = NULL;
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    return view;
}

/* It can be built. */
static void check_builds(tl_ctx *ctx, tl_view *view, const tl_scene *scene)
{
    tl_content *content = NULL;
    const tl_camera camera = view_camera(scene);
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, NULL, &content));
    tl_content_destroy(ctx, content);
}

static void what_fits_stays(void **state)
{
    static const char *const LINES[] = {"add derive text=\"h=2*f\"",
                                        "set data.regions 1",
                                        "add threshold channel=h low=1",
                                        "add clip plane=x=70%",
                                        "add surface channel=h color_by=g",
                                        "add slice color_by=\"f * g\"",
                                        "add volume channel=nothing visible=off",
                                        NULL};
    (void)state;
    char text[200] = "before";
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, 6);
    tl_view *view = view_of(ctx, source);
    tl_scene *from = view_scene(ctx, source, LINES), *scene = NULL;
    CHECK_OK(ctx, tl_view_adapt(ctx, view, from, &scene, text, sizeof text));
    CHECK(!*text);
    CHECK(tl_scene_version(scene) == tl_scene_version(from));
    check_builds(ctx, view, scene);
    tl_scene_destroy(ctx, scene);
    tl_scene_destroy(ctx, from);
    tl_view_destroy(view);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* Each line that the data lack, what is said of it, and what is left of it. */
static void what_is_lacking_is_off(void **state)
{
    static const struct {
        const char *line, *said, *name, *prop, *left;
    } CASES[] = {
        {"set data.step 3", "data has another step: ", "data", "step", "-1"},
        {"set data.regions 7", "data has no regions: there is no region '7'", "data", "regions",
         ""},
        {"set data.hide_regions steel", "data has no hide_regions: there is no region 'steel'",
         "data", "hide_regions", ""},
        {"add derive text=\"h=2*heat\"", "derive1 is off: ", "derive1", "text", ""},
        {"add threshold channel=heat low=1", "threshold1 is off: there is no channel 'heat'",
         "threshold1", "on", "off"},
        {"add threshold channel=f low=5", "threshold1 is off: nothing is left", "threshold1", "on",
         "off"},
        {"add clip plane=x=-900%", "clip1 is off: nothing is left", "clip1", "on", "off"},
        {"add surface channel=heat", "surface1 is hidden: there is no channel 'heat'", "surface1",
         "visible", "off"},
        {"add lines channel=f", "lines1 is hidden: channel 'f' has 1 components on vertices",
         "lines1", "visible", "off"},
        {"add slice color_by=\"f +\"", "slice1 has no colours: there is no channel 'f +'", "slice1",
         "color_by", ""},
    };
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, 6);
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        char text[1000], print[200];
        const char *const lines[] = {"add derive text=\"k=f+1\"",
                                     "add threshold channel=k low=1.1",
                                     "rename derive1 own",
                                     "rename threshold1 part",
                                     "add boundary color_by=k",
                                     CASES[i].line,
                                     NULL};
        tl_view *view = view_of(ctx, source);
        tl_scene *from = view_scene(ctx, source, lines), *scene = NULL;
        CHECK_OK(ctx, tl_view_adapt(ctx, view, from, &scene, text, sizeof text));
        printf("%s\n", text);
        CHECK(strstr(text, CASES[i].said) && !strchr(text, '\n'));
        tl_scene_print(scene, tl_scene_find(scene, CASES[i].name), CASES[i].prop, print,
                       sizeof print);
        CHECK(strcmp(print, CASES[i].left) == 0);
        CHECK(tl_scene_flag(scene, tl_scene_find(scene, "part"), "on"));
        CHECK(!tl_scene_undo_name(scene));
        check_builds(ctx, view, scene);
        tl_scene_destroy(ctx, scene);
        tl_scene_destroy(ctx, from);
        tl_view_destroy(view);
    }
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* All at once, in less room than it takes to say it. */
static void much_is_lacking(void **state)
{
    static const char *const LINES[] = {"set data.step 9",
                                        "set data.regions 7",
                                        "add threshold channel=a",
                                        "add threshold channel=f low=9",
                                        "add volume channel=b",
                                        "add lines channel=e",
                                        "add boundary color_by=d",
                                        "add slice color_by=f",
                                        NULL};
    (void)state;
    char text[1000], small[20];
    size_t lines = 1;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_model(ctx, 8);
    tl_view *view = view_of(ctx, source);
    tl_scene *from = view_scene(ctx, source, LINES), *scene = NULL;
    CHECK_OK(ctx, tl_view_adapt(ctx, view, from, &scene, text, sizeof text));
    printf("%s\n", text);
    for (const char *at = text; (at = strchr(at, '\n')) != NULL; at++) lines++;
    CHECK_EQ(lines, 7);
    check_builds(ctx, view, scene);
    tl_scene_destroy(ctx, scene);
    CHECK_OK(ctx, tl_view_adapt(ctx, view, from, &scene, small, sizeof small));
    CHECK_EQ(strlen(small), sizeof small - 1);
    tl_scene_destroy(ctx, scene);
    tl_scene_destroy(ctx, from);
    tl_view_destroy(view);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_fits_stays),
        cmocka_unit_test(what_is_lacking_is_off),
        cmocka_unit_test(much_is_lacking),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
