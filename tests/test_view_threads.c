/* Several views of one source, each on a thread with a context of its own: as of a window that goes
 * on while a picture is saved. */
#include "check.h"

#include "base/base_lock.h"

#include "check_view.h"

enum { SIDE = 9, VIEWS = 2, ROUNDS = 4 };

/* Formulas, scalars, gradients, neighbours, volumes and edges are made when they are asked for. */
static const char *const SCENES[][6] = {
    {"add volume channel=f lit=on", "add surface channel=g value=10 color_by=f*g", NULL},
    {"add transfer channel=g logarithmic=on", "add surface channel=f value=0.5 color_by=mag(u)",
     "add edges", "add silhouettes", NULL}};
enum { SCENE_COUNT = sizeof SCENES / sizeof *SCENES };

typedef struct viewing {
    tl_ctx *ctx;
    tl_source *source;
    tl_scene *scenes[SCENE_COUNT];
    tl_status status;
    uint64_t tets; /* drawn */
    tli_thread thread;
} viewing;

static void view_scenes(void *arg)
{
    viewing *v = arg;
    tl_view *view = NULL;
    tl_status st = tl_view_create(v->ctx, v->source, &view);
    for (int i = 0; !st && i < ROUNDS * SCENE_COUNT; i++) {
        const tl_scene *scene = v->scenes[i % SCENE_COUNT];
        const tl_camera camera = view_camera(scene);
        tl_content *content = NULL;
        st = tl_view_build(v->ctx, view, scene, &camera, NULL, &content);
        if (!st) v->tets = tl_content_get_facts(content)->tets;
        tl_content_destroy(v->ctx, content);
    }
    tl_view_destroy(view);
    v->status = st;
}

static void several_views(tl_ctx *ctx, tl_source *source)
{
    viewing views[VIEWS] = {0};
    for (int i = 0; i < VIEWS; i++) {
        views[i].source = source;
        views[i].ctx = check_ctx_create(1);
        for (int k = 0; k < SCENE_COUNT; k++)
            views[i].scenes[k] = view_scene(views[i].ctx, source, SCENES[k]);
    }
    for (int i = 0; i < VIEWS; i++)
        CHECK_OK(ctx, tli_thread_start(ctx, view_scenes, &views[i], &views[i].thread));
    for (int i = 0; i < VIEWS; i++) {
        tli_thread_join(&views[i].thread);
        CHECK_OK(views[i].ctx, views[i].status);
        CHECK_EQ(views[i].tets, views[0].tets);
        for (int k = 0; k < SCENE_COUNT; k++) tl_scene_destroy(views[i].ctx, views[i].scenes[k]);
    }
    /* what the views made is gone with them: nobody's memory is counted on another's budget */
    const size_t bytes = tl_ctx_current_bytes(ctx);
    tl_source_destroy(source);
    CHECK(tl_ctx_current_bytes(ctx) < bytes);
    for (int i = 0; i < VIEWS; i++) check_ctx_destroy(views[i].ctx);
    check_ctx_destroy(ctx);
}

static void views_of_a_mesh(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    several_views(ctx, view_source(ctx, SIDE));
}

static void views_of_a_model(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    several_views(ctx, view_model(ctx, SIDE));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_of_a_mesh),
        cmocka_unit_test(views_of_a_model),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
