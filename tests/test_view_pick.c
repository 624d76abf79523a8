/* What a content has at a place and under a pixel: values beside formulas, bounds beside brute
 * force at every original vertex, places beside the planes and surfaces that are seen there. */
#include "check.h"

#include "tetralod/formats.h"
#include "view/view.h"

#include "check_view.h"
#include "fail_alloc.h"

enum { SIDE = 9, MODEL_SIDE = 14 };

typedef struct stand {
    tl_ctx *ctx;
    tl_source *source;
    tl_scene *scene;
    tl_view *view;
    tl_content *content;
} stand;

/* Takes over the source. */
static stand open_stand(tl_ctx *ctx, tl_source *source, const char *const *lines)
{
    stand s = {.ctx = ctx, .source = source, .scene = view_scene(ctx, source, lines)};
    CHECK_OK(ctx, tl_view_create(ctx, source, &s.view));
    s.content = view_build(ctx, s.view, s.scene);
    return s;
}

static void close_stand(stand *s)
{
    tl_content_destroy(s->ctx, s->content);
    tl_view_destroy(s->view);
    tl_scene_destroy(s->ctx, s->scene);
    tl_source_destroy(s->source);
}

static const tl_probe_value *value_of(const tl_probe *probe, const char *name)
{
    for (size_t i = 0; i < probe->value_count; i++)
        if (strcmp(probe->values[i].name, name) == 0) return &probe->values[i];
    fail_msg("the probe has no '%s'", name);
    return NULL;
}

/* ---- probing ---- */

static void probe_of_a_mesh(void **state)
{
    static const char *const LINES[] = {"add derive text=twice=2*u.x", "add boundary",
                                        "add clip plane=0.5,0,0,1,0,0", NULL};
    (void)state;
    tl_probe probe;
    tl_ctx *ctx = check_ctx_create(1);
    stand s = open_stand(ctx, view_source(ctx, SIDE), LINES);
    const double kept[3] = {0.3, 0.4, 0.6}, cut_off[3] = {0.7, 0.4, 0.6};
    CHECK_OK(ctx, tl_content_probe(ctx, s.content, kept, &probe));
    CHECK(probe.is_inside);
    CHECK_EQ(probe.patch, TL_NONE);
    CHECK_EQ(probe.region, 1);
    CHECK_EQ(probe.value_count, 5);
    CHECK_NEAR(value_of(&probe, "u")->values[0], 0.5 - 0.4, 1e-12);
    CHECK_NEAR(value_of(&probe, "twice")->values[0], 2 * (0.5 - 0.4), 1e-12);
    CHECK_NEAR(value_of(&probe, "f")->values[0], view_hill(kept),
               0.05); /* straight between vertices */
    for (size_t i = 0; i < probe.value_count; i++) CHECK(probe.values[i].error == 0);
    tl_probe_release(ctx, &probe);
    CHECK_OK(ctx, tl_content_probe(ctx, s.content, cut_off, &probe));
    CHECK(!probe.is_inside);
    tl_probe_release(ctx, &probe);
    close_stand(&s);
    check_ctx_destroy(ctx);
}

/* At every original vertex that lies in the mesh of the cut the value is within the bound that is
 * told there, and that within the bound of the whole cut. Where planes cut the mesh, too. */
static void probe_of_a_model(void **state)
{
    static const char *const LINES[2][5] = {
        {"add boundary", "set detail.error_px 0", "set detail.errors 10%",
         "add derive text=more=f+1", NULL},
        {"add boundary color_by=f", "set detail.error_px 0", "set detail.errors 10%",
         "add clip plane=0.52,0,0,1,0,0", NULL}};
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(MODEL_SIDE);
    for (int clipped = 0; clipped < 2; clipped++) {
        size_t inside = 0, tight = 0;
        double worst = 0;
        stand s = open_stand(ctx, view_model(ctx, MODEL_SIDE), LINES[clipped]);
        const double range = tl_source_get_facts(s.source)->channels[0].range[1] -
                             tl_source_get_facts(s.source)->channels[0].range[0];
        for (size_t v = 0; v < m.vert_count; v++) {
            tl_probe probe;
            const double *x = m.xyz + 3 * v;
            CHECK_OK(ctx, tl_content_probe(ctx, s.content, x, &probe));
            if (clipped && x[0] > 0.53) CHECK(!probe.is_inside);
            if (probe.is_inside) {
                const tl_probe_value *f = value_of(&probe, "f");
                CHECK(probe.patch != TL_NONE && probe.level != TL_NONE);
                CHECK(f->error <= 0.1 * range);
                CHECK(fabs(f->values[0] - view_hill(x)) <= f->error * (1 + 1e-9));
                worst = fmax(worst, fabs(f->values[0] - view_hill(x)) / f->error);
                tight += f->error < 0.05 * range;
                if (!clipped) CHECK(isinf(value_of(&probe, "more")->error));
                inside++;
            }
            for (size_t i = 0; i < probe.value_count; i++)
                CHECK(strcmp(probe.values[i].name, TLI_MARKS) != 0);
            tl_probe_release(ctx, &probe);
        }
        CHECK(inside > m.vert_count / 3);
        CHECK_BOUND("largest error by its bound", worst, 1);
        CHECK(worst > 0.2);
        close_stand(&s);
    }
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Cignoni et al. 1997, V: inside of the focus the finer bound holds, at every vertex of the Blunt
 * Fin; outside the other one, with fewer tets. */
static void focus_on_real_data(void **state)
{
    static const char *const LINES[] = {"add boundary color_by=Density",
                                        "set detail.error_px 0",
                                        "set detail.errors Density=8%",
                                        "set detail.focus on",
                                        "set detail.focus_box -1,0,0,1,1,1",
                                        "set detail.focus_gain 8",
                                        NULL};
    (void)state;
    char path[4096];
    tl_mesh *mesh = NULL;
    tl_source *source = NULL;
    tl_build_result result;
    tl_read_report report;
    const char *data = getenv("TETRALOD_DATA"), *model = check_model_path("focus");
    if (!data) CHECK_SKIP("no real data: TETRALOD_DATA is not set");
    tl_ctx *ctx = check_ctx_create(2);
    const tl_build_opts opts = check_model_opts(4000, 200);
    snprintf(path, sizeof path, "%s/curvilinear/bluntfin.vtk", data);
    CHECK_OK(ctx, tl_mesh_read(ctx, path, NULL, &mesh, &report));
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, model, &opts, &result));
    tl_build_release(ctx, &result);
    CHECK_OK(ctx, tl_source_open(ctx, model, &source));
    CHECK_EQ(remove(model), 0);
    stand s = open_stand(ctx, source, LINES);
    const tl_channel *density = tl_mesh_channel_by_name(mesh, "Density");
    double range[2], box[6], worst[2] = {0, 0};
    size_t counts[2] = {0, 0};
    tl_channel_range(density, tl_mesh_vert_count(mesh), range, NULL);
    tl_scene_box(s.scene, TL_NODE_DETAIL + 1, "focus_box", box);
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
        tl_probe probe;
        bool in_box = true;
        const double *x = tl_mesh_xyz(mesh) + 3 * v;
        for (int k = 0; k < 3; k++) in_box = in_box && x[k] >= box[k] && x[k] <= box[3 + k];
        CHECK_OK(ctx, tl_content_probe(ctx, s.content, x, &probe));
        if (probe.is_inside) {
            const tl_probe_value *here = value_of(&probe, "Density");
            worst[in_box] = fmax(worst[in_box], fabs(here->values[0] - density->values[v]));
            counts[in_box]++;
        }
        tl_probe_release(ctx, &probe);
    }
    const double bound = 0.08 * (range[1] - range[0]);
    printf("%zu vertices in the focus, %zu outside of it, %zu tets of %zu\n", counts[1], counts[0],
           (size_t)tl_content_get_facts(s.content)->tets, tl_mesh_tet_count(mesh));
    CHECK(counts[0] > 1000 && counts[1] > 1000);
    CHECK_BOUND("error in the focus", worst[1], bound / 8);
    CHECK_BOUND("error outside of it", worst[0], bound);
    CHECK(worst[0] > bound / 8); /* coarser there, or the focus has done nothing */
    CHECK_OK(ctx, tl_scene_do(ctx, s.scene, "set detail.focus off"));
    CHECK_OK(ctx, tl_scene_do(ctx, s.scene, "set detail.errors Density=1%"));
    tl_content *fine = view_build(ctx, s.view, s.scene);
    printf("as fine everywhere: %zu tets\n", (size_t)tl_content_get_facts(fine)->tets);
    CHECK(tl_content_get_facts(s.content)->tets < tl_content_get_facts(fine)->tets);
    tl_content_destroy(ctx, fine);
    close_stand(&s);
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
}

/* ---- picking ---- */

static tl_camera side_camera(void)
{
    tl_camera c = tl_camera_defaults();
    const double position[3] = {0.5, -4, 0.5}, focal[3] = {0.5, 0.5, 0.5}, up[3] = {0, 0, 1};
    memcpy(c.position, position, sizeof position);
    memcpy(c.focal_point, focal, sizeof focal);
    memcpy(c.view_up, up, sizeof up);
    c.size_px[0] = c.size_px[1] = 100;
    return c;
}

/* Picks in the middle of the picture, with and without the picture's depth; y of the place, NaN
 * where there is none. */
static double pick_middle(const char *const *lines, double x_px)
{
    tl_ctx *ctx = check_ctx_create(1);
    stand s = open_stand(ctx, view_source(ctx, SIDE), lines);
    const tl_camera camera = side_camera();
    double found[2];
    tl_image *image = NULL;
    tl_shown *shown = NULL;
    tl_renderer *renderer = picture_renderer(ctx);
    CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
    CHECK_OK(ctx, tl_content_show(ctx, shown, s.content));
    CHECK_OK(ctx, tl_content_draw(ctx, shown, &camera, NULL, &image));
    for (int with = 0; with < 2; with++) {
        double xyz[3];
        bool is_hit;
        CHECK_OK(ctx, tl_content_pick(ctx, s.content, &camera, x_px, 50, with ? image : NULL, xyz,
                                      &is_hit));
        found[with] = is_hit ? xyz[1] : (double)NAN;
        if (!is_hit) continue;
        double px[2], distance; /* it is seen where it was picked */
        CHECK(tl_camera_project(&camera, xyz, px, &distance));
        CHECK_NEAR(px[0], x_px, 1e-6);
        CHECK_NEAR(px[1], 50, 1e-6);
    }
    CHECK(isnan(found[0]) == isnan(found[1]));
    if (!isnan(found[0])) CHECK_NEAR(found[0], found[1], 0.02); /* depth is that of a pixel */
    tl_image_destroy(ctx, image);
    tl_shown_destroy(ctx, shown);
    tl_renderer_destroy(ctx, renderer);
    close_stand(&s);
    check_ctx_destroy(ctx);
    return found[1];
}

static void what_is_picked(void **state)
{
    (void)state;
    static const char *const SLICE[] = {"add slice plane=0,0.3,0,0,1,0", NULL};
    static const char *const BEHIND_GLASS[] = {"add boundary opacity=0.15",
                                               "add slice plane=0,0.3,0,0,1,0", NULL};
    static const char *const VEILED[] = {"add slice plane=0,0.3,0,0,1,0",
                                         "add slice plane=0,0.2,0,0,1,0 opacity=0.7", NULL};
    static const char *const GLASS[] = {"add boundary opacity=0.15", NULL};
    static const char *const SHELL[] = {"add boundary opacity=1", NULL};
    static const char *const FOG[] = {
        "add transfer channel=g range_by=values range=0,1000 opacities=0,0.5 unit_distance=1",
        "set transfer1.opacities 0,0.5 1000,0.5", "add volume channel=g", NULL};
    CHECK_NEAR(pick_middle(SLICE, 50), 0.3, 0.02);
    CHECK_NEAR(pick_middle(BEHIND_GLASS, 50), 0.3, 0.02);
    CHECK_NEAR(pick_middle(VEILED, 50), 0.2, 0.02);
    CHECK_NEAR(pick_middle(GLASS, 50), 0, 1e-6);
    CHECK_NEAR(pick_middle(SHELL, 50), 0, 0.02);
    CHECK_NEAR(pick_middle(FOG, 50), 0.415, 0.002); /* 1 - 2^-x = 1 / 4 */
    CHECK(isnan(pick_middle(SHELL, 1)));
}

/* ---- failures ---- */

typedef struct asked {
    tl_source *source;
    tl_scene *scene;
} asked;

static tl_status try_asking(tl_ctx *ctx, void *arg)
{
    const asked *a = arg;
    double xyz[3] = {0};
    bool is_hit;
    tl_probe probe = {0};
    tl_view *view = NULL;
    tl_content *content = NULL;
    const tl_camera camera = view_camera(a->scene), side = side_camera();
    tl_status st = tl_view_create(ctx, a->source, &view);
    if (!st) st = tl_view_build(ctx, view, a->scene, &camera, NULL, &content);
    if (!st) st = tl_content_pick(ctx, content, &side, 50, 50, NULL, xyz, &is_hit);
    if (!st) st = tl_content_probe(ctx, content, xyz, &probe);
    tl_probe_release(ctx, &probe);
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
    return st;
}

/* What was made for the first question goes with the content. */
static void allocation_failures(void **state)
{
    static const char *const LINES[] = {"add clip plane=0.5,0,0,1,0,0", "add volume channel=f",
                                        "add boundary opacity=0.2", NULL};
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    asked a = {view_source(f.ctx, 4), NULL};
    a.scene = view_scene(f.ctx, a.source, LINES);
    CHECK_OK(f.ctx, try_asking(f.ctx, &a));
    CHECK(fail_alloc_each(&f, try_asking, &a) > 10);
    tl_scene_destroy(f.ctx, a.scene);
    tl_source_destroy(a.source);
    fail_alloc_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(probe_of_a_mesh),     cmocka_unit_test(probe_of_a_model),
        cmocka_unit_test(focus_on_real_data),  cmocka_unit_test(what_is_picked),
        cmocka_unit_test(allocation_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
