/* Builds that fail or are stopped leave nothing behind, and the next one is as if they had not
 * been; contents that one thread makes are drawn by another one. */
#include <pthread.h>
#include <stdatomic.h>

#include "check.h"

#include "view/view.h"

#include "check_view.h"
#include "fail_alloc.h"

enum { SIDE = 4, MODEL_SIDE = 10 };

static const char *const EVERYTHING[] = {"add transfer channel=g logarithmic=on",
                                         "add derive text=\"h=2*f\"",
                                         "add clip plane=0.9,0,0,1,0,0",
                                         "add volume channel=f lit=on",
                                         "add surface channel=h value=1 color_by=\"f+g\"",
                                         "add slice plane=x color_by=c",
                                         "add boundary",
                                         "add edges",
                                         "add silhouettes",
                                         "add points channel=g count=50",
                                         "add lines channel=u seeds=grid:2 has_box=on",
                                         NULL};

/* ---- memory ---- */

typedef struct job {
    const tl_scene *scene;
    tl_mesh *mesh;
} job;

/* From nothing to the picture without words, whose memory others take. */
static tl_status draw_all(tl_ctx *ctx, tl_view *view, const tl_scene *scene, tl_renderer *renderer)
{
    tl_shown *shown = NULL;
    tl_image *image = NULL;
    tl_content *content = NULL;
    const tl_camera camera = view_camera(scene);
    tl_status st = tl_view_build(ctx, view, scene, &camera, NULL, &content);
    if (!st) st = tl_shown_create(ctx, renderer, &shown);
    if (!st) st = tl_content_show(ctx, shown, content);
    if (!st) st = tl_content_draw(ctx, shown, &camera, NULL, &image);
    tl_image_destroy(ctx, image);
    tl_shown_destroy(ctx, shown);
    tl_content_destroy(ctx, content);
    return st;
}

static tl_status make_all(tl_ctx *ctx, void *arg)
{
    const job *j = arg;
    tl_view *view = NULL;
    tl_source *source = NULL;
    tl_scene *scene = NULL;
    tl_mesh *mesh = NULL;
    tl_renderer *renderer = NULL;
    double bins[4], range[2];
    tl_status st = tl_mesh_create(ctx, tl_mesh_xyz(j->mesh), tl_mesh_vert_count(j->mesh),
                                  tl_mesh_tets(j->mesh), tl_mesh_tet_count(j->mesh), &mesh);
    for (size_t c = 0; !st && c < tl_mesh_channel_count(j->mesh); c++)
        st = tl_mesh_add_channel(mesh, tl_mesh_channel(j->mesh, c));
    if (!st) st = tl_source_create(ctx, mesh, "cube", &source);
    if (!source) tl_mesh_destroy(mesh); /* it is taken over on success only */
    if (!st) st = tl_scene_copy(ctx, j->scene, &scene);
    if (!st) st = tl_source_histogram(ctx, source, scene, "f", false, bins, 4, range);
    if (!st) st = tl_view_create(ctx, source, &view);
    if (!st) st = tl_renderer_create(ctx, TL_RENDERER_NULL, &renderer);
    if (!st) st = draw_all(ctx, view, scene, renderer);
    tl_renderer_destroy(ctx, renderer);
    tl_view_destroy(view);
    tl_scene_destroy(ctx, scene);
    tl_source_destroy(source);
    return st;
}

static void every_allocation(void **state)
{
    (void)state;
    fail_alloc f;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, SIDE);
    tl_scene *scene = view_scene(ctx, source, EVERYTHING);
    job j = {scene, view_mesh(ctx, SIDE)};
    fail_alloc_open(&f, 1);
    const long count = fail_alloc_each(&f, make_all, &j);
    printf("%ld allocations\n", count);
    CHECK(count > 300);
    fail_alloc_close(&f);
    tl_mesh_destroy(j.mesh);
    view_close(ctx, NULL, NULL, scene, source);
}

/* ---- stopping ---- */

typedef struct brake {
    uint64_t calls, last; /* progress is stopped at the last call */
} brake;

static bool stop_at(void *user, const char *stage, uint64_t done, uint64_t total)
{
    brake *b = user;
    (void)stage;
    (void)done;
    (void)total;
    return ++b->calls != b->last;
}

/* Stopped at its first, second ... call of the hook, a build says so; what is then built is what is
 * built without. */
static void every_stop(void **state)
{
    (void)state;
    brake b = {0, 0};
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 2;
    opts.progress = stop_at;
    opts.user = &b;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    tl_source *source = view_model(ctx, MODEL_SIDE);
    tl_scene *scene = view_scene(ctx, source, EVERYTHING);
    const tl_camera camera = view_camera(scene);
    tl_image *expected = view_picture(ctx, source, scene);
    for (uint64_t last = 1; last; last++) {
        tl_view *view = NULL;
        tl_shown *shown = NULL;
        tl_content *content = NULL;
        CHECK_OK(ctx, tl_view_create(ctx, source, &view));
        b = (brake){0, last};
        const tl_status st = tl_view_build(ctx, view, scene, &camera, NULL, &content);
        b.last = 0;
        if (!st) {
            printf("%llu places to stop\n", (unsigned long long)last - 1);
            CHECK(last > 10);
            last = UINT64_MAX; /* ends the loop */
        } else {
            CHECK_STATUS(st, TL_ERR_CANCELLED);
            CHECK(content == NULL);
            content = view_build(ctx, view, scene);
        }
        tl_renderer *renderer = picture_renderer(ctx);
        CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
        tl_image *image = view_draw(ctx, shown, content, scene);
        CHECK(picture_same(image, expected));
        tl_image_destroy(ctx, image);
        tl_shown_destroy(ctx, shown);
        tl_renderer_destroy(ctx, renderer);
        tl_content_destroy(ctx, content);
        tl_view_destroy(view);
    }
    tl_image_destroy(ctx, expected);
    view_close(ctx, NULL, NULL, scene, source);
}

/* ---- two threads ---- */

enum { ROUNDS = 12 };

/* A content goes from the builder to the drawer and, when it is not shown any more, back. */
typedef struct desk {
    _Atomic(tl_content *) made, used;
    tl_content *last;      /* when the drawer is done */
    const tl_scene *scene; /* the drawer's copy */
    tl_image *images[ROUNDS];
    tl_ctx *ctx; /* of the drawer */
} desk;

static void *draw_rounds(void *arg)
{
    desk *d = arg;
    tl_shown *shown = NULL;
    tl_renderer *renderer = picture_renderer(d->ctx);
    CHECK_OK(d->ctx, tl_shown_create(d->ctx, renderer, &shown));
    tl_content *last = NULL;
    for (int round = 0; round < ROUNDS; round++) {
        tl_content *content = NULL;
        while (!content) content = atomic_exchange(&d->made, NULL);
        for (int again = 0; again < 2; again++) {
            tl_image_destroy(d->ctx, d->images[round]);
            d->images[round] = view_draw(d->ctx, shown, content, d->scene);
        }
        if (last) atomic_store(&d->used, last);
        last = content;
    }
    tl_shown_destroy(d->ctx, shown);
    tl_renderer_destroy(d->ctx, renderer);
    d->last = last;
    return NULL;
}

static void built_here_drawn_there(void **state)
{
    (void)state;
    pthread_t thread;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(2), *drawer = check_ctx_create(2);
    tl_source *source = view_model(ctx, MODEL_SIDE);
    tl_scene *scene = view_scene(ctx, source, EVERYTHING);
    tl_scene *copy = NULL;
    CHECK_OK(ctx, tl_scene_copy(drawer, scene, &copy));
    desk d = {.scene = copy, .ctx = drawer};
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    CHECK_EQ(pthread_create(&thread, NULL, draw_rounds, &d), 0);
    tl_image *expected[ROUNDS];
    for (int round = 0; round < ROUNDS; round++) {
        char line[64];
        snprintf(line, sizeof line, "set surface1.value %g", 0.6 + 0.05 * round);
        CHECK_OK(ctx, tl_scene_do(ctx, scene, line));
        if (round % 3 == 2) CHECK_OK(ctx, tl_scene_do(ctx, scene, "set transfer1.map magma"));
        tl_content *content = view_build(ctx, view, scene), *used = NULL;
        expected[round] = view_picture(ctx, source, scene);
        atomic_store(&d.made, content);
        /* the first one comes back when the second one is shown */
        while (round && !used) used = atomic_exchange(&d.used, NULL);
        tl_content_destroy(ctx, used);
    }
    tl_view_destroy(view);
    CHECK_EQ(pthread_join(thread, NULL), 0);
    tl_content_destroy(ctx, d.last);
    for (int round = 0; round < ROUNDS; round++) {
        CHECK(picture_same(d.images[round], expected[round]));
        tl_image_destroy(drawer, d.images[round]);
        tl_image_destroy(ctx, expected[round]);
    }
    tl_scene_destroy(drawer, copy);
    tl_scene_destroy(ctx, scene);
    tl_source_destroy(source);
    check_ctx_destroy(drawer);
    check_ctx_destroy(ctx);
}

/* ---- looks of several threads ---- */

enum { ASKERS = 4 };

typedef struct asker {
    tl_ctx *ctx;
    tl_source *source;
    const tl_scene *scene;
    double bins[8], range[2];
    pthread_t thread;
} asker;

static void *ask(void *arg)
{
    asker *a = arg;
    CHECK_OK(a->ctx,
             tl_source_histogram(a->ctx, a->source, a->scene, "f", false, a->bins, 8, a->range));
    return NULL;
}

/* One of them makes the look, in its own memory: the context of the source, which is another
 * thread's, is not touched; what fails there is said to who asked. */
static void looks_of_threads(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    asker askers[ASKERS];
    for (int round = 0; round < 8; round++) {
        tl_source *source = view_model(ctx, MODEL_SIDE);
        tl_scene *scene = view_scene(ctx, source, (const char *[]){NULL});
        const uint64_t before = tl_ctx_current_bytes(ctx);
        tl_ctx *poor = check_ctx_create(1);
        double bins[8], range[2];
        tl_ctx_set_budget(poor, 10000);
        tl_fail(ctx, TL_ERR_ARG, "an older message");
        CHECK_STATUS(tl_source_histogram(poor, source, scene, "f", false, bins, 8, range),
                     TL_ERR_BUDGET);
        CHECK(tl_ctx_message(poor)[0] != 0);
        assert_string_equal(tl_ctx_message(ctx), "an older message");
        for (int i = 0; i < ASKERS; i++)
            askers[i] = (asker){.ctx = check_ctx_create(1), .source = source, .scene = scene};
        for (int i = 0; i < ASKERS; i++)
            CHECK_EQ(pthread_create(&askers[i].thread, NULL, ask, &askers[i]), 0);
        for (int i = 0; i < ASKERS; i++) CHECK_EQ(pthread_join(askers[i].thread, NULL), 0);
        CHECK_EQ(source->look_count, 1);
        CHECK_EQ(tl_ctx_current_bytes(ctx), before);
        for (int i = 1; i < ASKERS; i++)
            CHECK_EQ(memcmp(askers[0].bins, askers[i].bins, sizeof askers[0].bins), 0);
        tl_scene_destroy(ctx, scene);
        tl_source_destroy(source);
        for (int i = 0; i < ASKERS; i++) check_ctx_destroy(askers[i].ctx);
        check_ctx_destroy(poor);
    }
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_allocation), cmocka_unit_test(every_stop),
        cmocka_unit_test(looks_of_threads), cmocka_unit_test(built_here_drawn_there)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
