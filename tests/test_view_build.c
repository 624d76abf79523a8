/* Contents: what a scene of a mesh or a model shows; what is made again when the scene changes, and
 * that pictures do not depend on it. */
#include "check.h"

#include "view/view.h"

#include "check_view.h"

enum { SIDE = 8, MODEL_SIDE = 14 };

/* A thing of every kind. */
static const char *const EVERYTHING[] = {"add transfer channel=g logarithmic=on",
                                         "add volume channel=f lit=on",
                                         "add surface channel=f value=0.5 opacity=0.5",
                                         "add surface channel=g value=10 color=red visible=off",
                                         "add slice plane=x color_by=g",
                                         "add boundary color_by=c visible=off",
                                         "add edges visible=off",
                                         "add silhouettes",
                                         "add points channel=g count=300 visible=off",
                                         "add lines channel=u seeds=grid:4",
                                         NULL};

/* ---- what a content tells ---- */

static void content_of_a_mesh(void **state)
{
    static const char *const LINES[] = {"add surface channel=f value=0.5 color_by=g",
                                        "add volume channel=f", NULL};
    (void)state;
    size_t count;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, SIDE);
    tl_scene *scene = view_scene(ctx, source, LINES);
    const tl_source_facts *data = tl_source_get_facts(source);
    CHECK(!data->is_model);
    CHECK_EQ(data->tets, 5 * (SIDE - 1) * (SIDE - 1) * (SIDE - 1));
    CHECK_EQ(data->channel_count, 4);
    assert_string_equal(data->channels[1].unit, "Pa");
    CHECK_NEAR(data->channels[1].range[1], 100, 1e-9);
    CHECK_EQ(tl_source_bytes_read(source), 0);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *content = view_build(ctx, view, scene);
    const tl_content_facts *facts = tl_content_get_facts(content);
    CHECK_EQ(facts->tets, data->tets);
    CHECK_EQ(facts->whole_tets, data->tets);
    CHECK(facts->is_complete && facts->bounds_kept && !facts->is_moving);
    CHECK(facts->bytes > data->tets * 4 * sizeof(tl_lidx));
    CHECK_EQ(facts->error_count, 0);
    const tl_values *const *values = tl_content_all_values(content, &count);
    CHECK_EQ(count, 2);
    CHECK(values[0] == tl_content_values(content, "f"));
    CHECK(tl_content_values(content, "h") == NULL);
    const tl_values *g = tl_content_values(content, "g");
    assert_string_equal(g->title, "g [Pa]");
    CHECK_NEAR(g->least, 1, 1e-12);
    CHECK_NEAR(g->most, 100, 1e-9);
    CHECK(g->colors[0].value == g->range[0]);
    CHECK(g->range[0] > 0 && g->range[0] < g->range[1]);
    view_close(ctx, content, view, scene, source);
}

/* The colour of NaN is that of the scene's transfer function, and grey without. */
static void values_that_are_none_have_their_colour(void **state)
{
    static const char *const LINES[] = {
        "add derive text=\"h=sqrt(0.5-f)\"", "add transfer channel=h nan_color=#ffff00",
        "add boundary color_by=h", "add slice plane=x color_by=g", NULL};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, SIDE);
    tl_scene *scene = view_scene(ctx, source, LINES);
    float yellow[3], grey[3];
    double extinction;
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *content = view_build(ctx, view, scene);
    tl_transfer_at(tl_content_values(content, "h")->transfer, (double)NAN, yellow, &extinction);
    tl_transfer_at(tl_content_values(content, "g")->transfer, (double)NAN, grey, &extinction);
    CHECK(yellow[0] == 1 && yellow[1] == 1 && yellow[2] == 0);
    for (int k = 0; k < 3; k++) CHECK(grey[k] == 0.5F);
    view_close(ctx, content, view, scene, source);
}

static void content_of_a_model(void **state)
{
    static const char *const LINES[] = {"add surface channel=f value=0.5", "set detail.error_px 0",
                                        "set detail.errors f=5%", NULL};
    (void)state;
    char note[256];
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = view_model(ctx, MODEL_SIDE);
    const tl_source_facts *data = tl_source_get_facts(source);
    tl_scene *scene = view_scene(ctx, source, LINES);
    CHECK(data->is_model && data->file_bytes > 0);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *content = view_build(ctx, view, scene);
    const tl_content_facts *facts = tl_content_get_facts(content);
    CHECK(facts->bounds_kept && facts->is_complete && facts->patches > 0);
    CHECK(facts->tets < data->tets);
    CHECK_EQ(facts->error_count, 1);
    const double range = data->channels[0].range[1] - data->channels[0].range[0];
    CHECK_BOUND("error of f", facts->errors[0].error, 0.05 * range);
    tl_content_note(content, note, sizeof note);
    CHECK(strstr(note, "f within ") != NULL);
    const tl_camera camera = view_camera(scene);
    tl_view_limits limits = tl_view_limits_defaults();
    limits.tets_max = facts->tets / 2;
    tl_content *coarse = NULL;
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, &limits, &coarse));
    CHECK(!tl_content_get_facts(coarse)->is_complete);
    CHECK(tl_content_get_facts(coarse)->tets <= limits.tets_max);
    /* a change is seen at once on the mesh that is there */
    tl_content *quick = NULL;
    limits.any_cut = true;
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set surface1.value 0.3"));
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, &limits, &quick));
    CHECK(quick->body == coarse->body && quick->shapes[0] != coarse->shapes[0]);
    CHECK(!tl_content_get_facts(quick)->is_complete && !tl_content_get_facts(quick)->bounds_kept);
    tl_content_destroy(ctx, quick);
    tl_content_destroy(ctx, coarse);
    /* pixels that are larger make it coarser */
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.errors \"\""));
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.error_px 0.01"));
    tl_content *fine = view_build(ctx, view, scene);
    limits = tl_view_limits_defaults();
    limits.error_px_least = 20;
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, &limits, &coarse));
    CHECK(tl_content_get_facts(coarse)->tets < tl_content_get_facts(fine)->tets);
    CHECK_BOUND("pixels", tl_content_get_facts(coarse)->error_px, 20);
    CHECK(tl_content_get_facts(fine)->is_complete && !tl_content_get_facts(coarse)->is_complete);
    tl_content_destroy(ctx, fine);
    tl_content_destroy(ctx, coarse);
    view_close(ctx, content, view, scene, source);
}

/* A cut that has moved, and whose mesh was not made since somebody cancelled, is no mesh that is
 * there: a change is seen on one that the limits allow. */
static void change_after_a_cancelled_build(void **state)
{
    static const char *const LINES[] = {"add volume channel=f", "set detail.tets 3000", NULL};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = view_model(ctx, MODEL_SIDE);
    tl_scene *scene = view_scene(ctx, source, LINES);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *content = view_build(ctx, view, scene), *quick = NULL;
    const tl_camera camera = view_camera(scene);
    tl_cut_state moved;
    tl_view_request request = tl_view_request_defaults();
    request.camera = &camera;
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.full on"));
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.tets 0"));
    CHECK_OK(ctx, tl_view_cut(ctx, view, scene, &request, &moved));
    tl_view_limits limits = tl_view_limits_defaults();
    limits.any_cut = true;
    limits.tets_max = 4000;
    CHECK(moved.tets > limits.tets_max);
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, &limits, &quick));
    CHECK_BOUND("tets", (double)tl_content_get_facts(quick)->tets, (double)limits.tets_max);
    tl_content_destroy(ctx, quick);
    view_close(ctx, content, view, scene, source);
}

/* What a cut promises from another camera is what it promises when it is made for it; on a cut that
 * stays a content says whether that is enough. */
static void promises_for_other_cameras(void **state)
{
    static const char *const LINES[] = {"add surface channel=f value=0.5", "set detail.error_px 4",
                                        NULL};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = view_model(ctx, MODEL_SIDE);
    tl_scene *scene = view_scene(ctx, source, LINES);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *content = view_build(ctx, view, scene), *there = NULL;
    tl_camera camera = view_camera(scene);
    tl_view_limits limits = tl_view_limits_defaults();
    double pixels = -1, nearest = 0;
    limits.any_cut = true;
    CHECK_OK(ctx, tl_content_error_px(ctx, content, &camera, &pixels));
    CHECK_NEAR(pixels, tl_content_get_facts(content)->error_px, 0);
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 3; k++)
            camera.position[k] += 0.3 * (camera.focal_point[k] - camera.position[k]);
        CHECK_OK(ctx, tl_content_error_px(ctx, content, &camera, &pixels));
        CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, &limits, &there));
        const tl_content_facts *facts = tl_content_get_facts(there);
        CHECK_NEAR(pixels, facts->error_px, 0);
        CHECK_EQ(facts->is_complete, pixels <= 4);
        CHECK(there->body == content->body);
        nearest = fmax(nearest, pixels);
        tl_content_destroy(ctx, there);
    }
    CHECK(nearest > 4);
    /* another scene asks for other errors of the same cut; a frozen one is all that is asked for */
    camera = view_camera(scene);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.error_px 0.01"));
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, &limits, &there));
    CHECK(!tl_content_get_facts(there)->is_complete);
    tl_content_destroy(ctx, there);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.frozen on"));
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, NULL, &there));
    CHECK(tl_content_get_facts(there)->is_complete);
    camera.view_angle = 0;
    CHECK_STATUS(tl_content_error_px(ctx, there, &camera, &pixels), TL_ERR_ARG);
    tl_content_destroy(ctx, there);
    view_close(ctx, content, view, scene, source);
}

/* A focus makes the box finer than the rest; a frozen cut stays where it is. */
static void focus_and_frozen_cuts(void **state)
{
    static const char *const LINES[] = {
        "add surface channel=f value=0.5", "set detail.error_px 0",
        "set detail.errors 20%",           "set detail.focus_box 0,0,0,0.5,0.5,0.5",
        "set detail.focus_gain 50",        NULL};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = view_model(ctx, MODEL_SIDE);
    tl_scene *scene = view_scene(ctx, source, LINES);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *coarse = view_build(ctx, view, scene);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.focus on"));
    tl_content *focused = view_build(ctx, view, scene);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.frozen on"));
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.focus off"));
    tl_content *frozen = view_build(ctx, view, scene);
    CHECK(tl_content_get_facts(focused)->tets > tl_content_get_facts(coarse)->tets);
    CHECK(frozen->body == focused->body);
    tl_content_destroy(ctx, frozen);
    tl_content_destroy(ctx, focused);
    view_close(ctx, coarse, view, scene, source);
}

static void nothing_to_show(void **state)
{
    static const char *const LINES[] = {"add volume", "add surface",           "add points",
                                        "add lines",  "add slice visible=off", NULL};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, 3);
    tl_scene *scene = view_scene(ctx, source, LINES);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *content = view_build(ctx, view, scene);
    CHECK_EQ(content->thing_count, 0);
    tl_content_destroy(ctx, content);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set picture.box off"));
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set picture.axes off"));
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set picture.note off"));
    tl_image *image = view_picture(ctx, source, scene);
    CHECK_EQ(picture_covered(image), 0);
    tl_image_destroy(ctx, image);
    view_close(ctx, NULL, view, scene, source);
}

/* ---- what is not there ---- */

static void wrong_scenes(void **state)
{
    static const struct {
        const char *line, *message;
        tl_status status;
    } CASES[] = {
        {"add volume channel=heat", "there is no channel 'heat'", TL_ERR_ARG},
        {"add volume channel=heat", "'f' 'g' 'u' 'c' (on tets)", TL_ERR_ARG},
        {"add slice color_by=\"f +\"", "there is no channel 'f +'", TL_ERR_ARG},
        {"add threshold channel=heat low=1", "there is no channel 'heat'", TL_ERR_ARG},
        {"add threshold channel=f low=5", "nothing is left", TL_ERR_DATA},
        {"add lines channel=f", "a flow has 3", TL_ERR_ARG},
        {"add lines channel=u seeds=box:1", "expected grid", TL_ERR_ARG},
        {"add lines channel=u seeds=/no/such/file", "no words of --seeds and no file", TL_ERR_IO},
        {"add derive text=\"h=2*heat\"", "no channel 'heat'", TL_ERR_ARG},
        {"add derive text=h", "expected NAME=EXPRESSION", TL_ERR_ARG},
        {"add boundary mark=levels", "is no model", TL_ERR_ARG},
        {"set data.regions 7", "there is no region '7'", TL_ERR_ARG},
        {"set data.regions \" 7 , 1\"", "there is no region '7'", TL_ERR_ARG},
        {"set data.step 3", "no time steps", TL_ERR_ARG},
    };
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, 4);
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        const char *const lines[] = {"add boundary", CASES[i].line, NULL};
        tl_view *view = NULL;
        tl_content *content = NULL;
        tl_scene *scene = view_scene(ctx, source, lines);
        const tl_camera camera = view_camera(scene);
        CHECK_OK(ctx, tl_view_create(ctx, source, &view));
        CHECK_STATUS(tl_view_build(ctx, view, scene, &camera, NULL, &content), CASES[i].status);
        CHECK_MESSAGE(ctx, CASES[i].message);
        CHECK(content == NULL);
        tl_view_destroy(view);
        tl_scene_destroy(ctx, scene);
    }
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* ---- reuse ---- */

/* Colours, opacity, values and what is visible leave the mesh as it is, and what is not theirs. */
static void changes_make_what_they_change(void **state)
{
    static const char *const CHANGES[] = {"set surface1.opacity 0.3", "set surface1.color blue",
                                          "set surface2.visible on",  "set surface1.value 0.51",
                                          "set transfer1.map magma",  "set edges1.visible on",
                                          "set volume1.lit off"};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    for (int is_model = 0; is_model < 2; is_model++) {
        tl_source *source = is_model ? view_model(ctx, MODEL_SIDE) : view_source(ctx, SIDE);
        tl_scene *scene = view_scene(ctx, source, EVERYTHING);
        CHECK_OK(ctx, tl_scene_do(ctx, scene, "set detail.full on"));
        CHECK_OK(ctx, tl_view_create(ctx, source, &view));
        tl_content *content = view_build(ctx, view, scene);
        for (size_t i = 0; i < sizeof CHANGES / sizeof *CHANGES; i++) {
            const uint64_t read = tl_source_bytes_read(source);
            CHECK_OK(ctx, tl_scene_do(ctx, scene, CHANGES[i]));
            tl_content *next = view_build(ctx, view, scene);
            CHECK(next->body == content->body);
            CHECK_EQ(tl_source_bytes_read(source), read);
            size_t made = 0;
            for (size_t s = 0; s < next->shape_count; s++) {
                bool is_old = false;
                for (size_t k = 0; k < content->shape_count; k++)
                    is_old |= next->shapes[s] == content->shapes[k];
                made += !is_old;
            }
            CHECK(made <= 1);
            CHECK_EQ(made, i >= 2 && i != 4 && i != 6);
            tl_content_destroy(ctx, content);
            content = next;
        }
        tl_content_destroy(ctx, content);
        tl_view_destroy(view);
        tl_scene_destroy(ctx, scene);
        tl_source_destroy(source);
    }
    check_ctx_destroy(ctx);
}

/* Random changes, each shown in the renderer that has the things of the one before: every picture
 * is that of a view and a renderer that are new. */
static void reuse_gives_the_same_pictures(void **state)
{
    static const char *const NODES[] = {"volume1",   "surface1", "surface2", "slice1",
                                        "boundary1", "edges1",   "points1",  "silhouettes1"};
    static const char *const LINES[] = {"set surface1.value 0.3",
                                        "set surface1.value 0.6",
                                        "set surface1.opacity 1",
                                        "set surface1.color_by g",
                                        "set surface1.color_by \"\"",
                                        "set transfer1.map plasma",
                                        "set transfer1.logarithmic off",
                                        "set transfer1.logarithmic on",
                                        "set slice1.plane y",
                                        "set slice1.plane 0.3,0.3,0.3,1,1,0",
                                        "set volume1.gradient_opacity 1",
                                        "set boundary1.opacity 0.5",
                                        "set detail.tets 3000",
                                        "set detail.tets 0",
                                        "set detail.error_px 3",
                                        "set detail.error_px 1",
                                        "view 200,10",
                                        "view 40,30",
                                        "add clip plane=0.7,0,0,1,0,0",
                                        "remove clip1",
                                        "add threshold channel=f low=0.2",
                                        "remove threshold1",
                                        "set lines1.has_box on",
                                        "set lines1.arrows 8",
                                        "set picture.title one",
                                        "undo",
                                        "undo",
                                        "redo"};
    (void)state;
    uint64_t seed = 7;
    tl_view *view = NULL;
    tl_shown *shown = NULL;
    tl_ctx *ctx = check_ctx_create(2);
    for (int is_model = 0; is_model < 2; is_model++) {
        tl_source *source = is_model ? view_model(ctx, MODEL_SIDE) : view_source(ctx, SIDE);
        tl_scene *scene = view_scene(ctx, source, EVERYTHING);
        tl_renderer *renderer = picture_renderer(ctx);
        tl_content *content = NULL;
        CHECK_OK(ctx, tl_view_create(ctx, source, &view));
        CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
        for (int step = 0; step < 40; step++) {
            char line[64];
            if (make_uniform(&seed) < 0.4)
                snprintf(line, sizeof line, "set %s.visible %s",
                         NODES[make_random(&seed) % (sizeof NODES / sizeof *NODES)],
                         make_uniform(&seed) < 0.5 ? "on" : "off");
            else
                snprintf(line, sizeof line, "%s",
                         LINES[make_random(&seed) % (sizeof LINES / sizeof *LINES)]);
            if (tl_scene_do(ctx, scene, line)) continue; /* nothing to undo or remove */
            tl_content *next = view_build(ctx, view, scene);
            tl_image *image = view_draw(ctx, shown, next, scene);
            tl_image *fresh = view_picture(ctx, source, scene);
            if (!picture_same(image, fresh)) fail_msg("step %d: '%s'", step, line);
            tl_image_destroy(ctx, fresh);
            tl_image_destroy(ctx, image);
            tl_content_destroy(ctx, content);
            content = next;
        }
        tl_shown_destroy(ctx, shown);
        tl_renderer_destroy(ctx, renderer);
        tl_view_destroy(view);
        tl_source_destroy(source); /* contents do not need it */
        CHECK(tl_content_get_facts(content)->tets > 0);
        tl_content_destroy(ctx, content);
        tl_scene_destroy(ctx, scene);
    }
    check_ctx_destroy(ctx);
}

/* ---- first looks, histograms ---- */

static void first_looks(void **state)
{
    static const char *const NONE[] = {NULL};
    (void)state;
    char name[16];
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, 5);
    tl_scene *scene = view_scene(ctx, source, NONE);
    CHECK_OK(ctx, tl_first_look(ctx, source, scene));
    const tl_node node = tl_scene_find(scene, "volume1");
    CHECK(node != 0);
    assert_string_equal(tl_scene_text(scene, node, "channel"), "f");
    assert_string_equal(tl_scene_undo_name(scene), "first look");
    CHECK_OK(ctx, tl_first_channel(ctx, source, scene, name, sizeof name));
    assert_string_equal(name, "f");
    view_close(ctx, NULL, NULL, scene, source);
}

static void histograms(void **state)
{
    (void)state;
    double bins[10], range[2], sum = 0;
    tl_ctx *ctx = check_ctx_create(1);
    for (int is_model = 0; is_model < 2; is_model++) {
        tl_source *source = is_model ? view_model(ctx, MODEL_SIDE) : view_source(ctx, 21);
        tl_scene *scene = view_scene(ctx, source, (const char *[]){NULL});
        /* powers of 100 along x: even on a logarithmic scale */
        CHECK_OK(ctx, tl_source_histogram(ctx, source, scene, "g", true, bins, 10, range));
        CHECK_NEAR(range[0], 1, 1e-3);
        CHECK_NEAR(range[1], 100, 0.1);
        for (int i = 0; i < 10; i++) CHECK_NEAR(bins[i], 0.1, 0.06);
        CHECK_OK(ctx, tl_source_histogram(ctx, source, scene, "f", false, bins, 10, range));
        for (int i = 0; i < 10; i++) sum += bins[i];
        CHECK_NEAR(sum, is_model + 1, 1e-9);
        CHECK_STATUS(tl_source_histogram(ctx, source, scene, "heat", false, bins, 10, range),
                     TL_ERR_ARG);
        CHECK_MESSAGE(ctx, "'f' 'g' 'u' 'c'");
        check_scene_do(ctx, scene, (const char *[]){"set data.step 2", NULL});
        CHECK_STATUS(tl_source_histogram(ctx, source, scene, "f", false, bins, 10, range),
                     TL_ERR_ARG);
        tl_scene_destroy(ctx, scene);
        tl_source_destroy(source);
    }
    check_ctx_destroy(ctx);
}

/* What is hidden is out of the renderer; shown again it is the same picture. A page leaves the
 * picture as it is, and a failure no page. */
static void hidden_and_on_a_page(void **state)
{
    static const char *const LINES[] = {"add boundary", "set picture.title page", NULL};
    static const struct {
        const char *path;
        tl_status status;
        const char *begin; /* NULL: there is no file */
    } PAGES[] = {{"page.pdf", TL_OK, "%PDF-"},
                 {"page.svg", TL_OK, "<?xml"},
                 {"page.png", TL_ERR_UNSUPPORTED, NULL},
                 {"none/page.pdf", TL_ERR_IO, NULL}};
    (void)state;
    tl_view *view = NULL;
    tl_shown *shown = NULL;
    tl_image *drawn = NULL, *kept = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_source(ctx, 6);
    tl_scene *scene = view_scene(ctx, source, LINES);
    tl_renderer *renderer = picture_renderer(ctx);
    const tl_camera camera = view_camera(scene);
    const tl_draw_opts opts = tl_draw_opts_defaults();
    const size_t floats = (size_t)4 * VIEW_WIDTH * VIEW_HEIGHT;
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
    tl_content *content = view_build(ctx, view, scene);
    for (int i = 0; i < 2; i++) {
        CHECK_OK(ctx, tl_content_show(ctx, shown, content));
        CHECK_OK(ctx, tl_content_draw(ctx, shown, &camera, &opts, i ? &drawn : &kept));
        tl_content_hide(ctx, shown);
        tl_image *empty = picture_take(ctx, renderer, &camera);
        for (size_t k = 0; k < floats; k++) CHECK(empty->rgba[k] == 0);
        tl_image_destroy(ctx, empty);
    }
    CHECK(memcmp(drawn->rgba, kept->rgba, floats * sizeof(float)) == 0);
    for (size_t i = 0; i < sizeof PAGES / sizeof *PAGES; i++) {
        const tl_status st = tl_content_write(ctx, content, scene, &camera, drawn, PAGES[i].path);
        if (!i && st == TL_ERR_UNSUPPORTED) break; /* a build without words */
        CHECK_EQ(st, PAGES[i].status);
        FILE *file = fopen(PAGES[i].path, "rb");
        CHECK((file != NULL) == (PAGES[i].begin != NULL));
        if (!file) continue;
        char begin[5] = "";
        CHECK_EQ(fread(begin, 1, sizeof begin, file), sizeof begin);
        CHECK(memcmp(begin, PAGES[i].begin, sizeof begin) == 0);
        fclose(file);
        CHECK_EQ(remove(PAGES[i].path), 0);
    }
    CHECK(memcmp(drawn->rgba, kept->rgba, floats * sizeof(float)) == 0);
    tl_image_destroy(ctx, drawn);
    tl_image_destroy(ctx, kept);
    tl_shown_destroy(ctx, shown);
    tl_renderer_destroy(ctx, renderer);
    view_close(ctx, content, view, scene, source);
}

/* What a body gave stays where it is while it makes more. */
static void formulas_of_a_body_stay(void **state)
{
    (void)state;
    enum { COUNT = 200 };
    const tl_channel *given[COUNT], *again = NULL;
    char text[32];
    tli_body *body = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    CHECK_OK(ctx, tli_body_create(ctx, view_mesh(ctx, 3), 0, &body));
    for (int i = 0; i < COUNT; i++) {
        snprintf(text, sizeof text, "f + %d", i);
        CHECK_OK(ctx, tli_body_channel(ctx, body, text, &given[i]));
    }
    for (int i = 0; i < COUNT; i++) {
        snprintf(text, sizeof text, "f + %d", i);
        CHECK_OK(ctx, tli_body_channel(ctx, body, text, &again));
        CHECK(again == given[i]);
        CHECK(given[i]->values[0] == tl_mesh_channel(body->mesh, 0)->values[0] + i);
    }
    CHECK_STATUS(tli_body_channel(ctx, body, "nothing + 1", &again), TL_ERR_ARG);
    tli_body_release(body);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(content_of_a_mesh),
                                       cmocka_unit_test(formulas_of_a_body_stay),
                                       cmocka_unit_test(values_that_are_none_have_their_colour),
                                       cmocka_unit_test(content_of_a_model),
                                       cmocka_unit_test(change_after_a_cancelled_build),
                                       cmocka_unit_test(promises_for_other_cameras),
                                       cmocka_unit_test(focus_and_frozen_cuts),
                                       cmocka_unit_test(nothing_to_show),
                                       cmocka_unit_test(wrong_scenes),
                                       cmocka_unit_test(changes_make_what_they_change),
                                       cmocka_unit_test(reuse_gives_the_same_pictures),
                                       cmocka_unit_test(first_looks),
                                       cmocka_unit_test(hidden_and_on_a_page),
                                       cmocka_unit_test(histograms)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
