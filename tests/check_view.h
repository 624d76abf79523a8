/* Sources for tests of views, a mesh or a model of it with channels of all kinds, and pictures of
 * what a view builds. */
#ifndef TETRALOD_TESTS_CHECK_VIEW_H
#define TETRALOD_TESTS_CHECK_VIEW_H

#include "tetralod/view.h"

#include "check_model.h"
#include "check_picture.h"
#include "check_scene.h"

/* A hill around the middle of the unit cube. */
static inline double view_hill(const double x[3])
{
    double square = 0;
    for (int k = 0; k < 3; k++) square += (x[k] - 0.5) * (x[k] - 0.5);
    return exp(-6 * square);
}

/* n^3 vertices with "f" (a hill), "g" (from 1 to 100 along x) and "u" (a swirl) on vertices, "c" on
 * tets, two regions. */
static inline tl_mesh *view_mesh(tl_ctx *ctx, size_t n)
{
    make_mesh m = make_grid(n);
    make_two_regions(&m);
    tl_mesh *mesh = make_object(ctx, &m, view_hill);
    double *g = malloc(m.vert_count * sizeof *g), *u = malloc(3 * m.vert_count * sizeof *u);
    double *c = malloc(m.tet_count * sizeof *c);
    if (!g || !u || !c) abort();
    for (size_t v = 0; v < m.vert_count; v++) {
        const double *x = m.xyz + 3 * v;
        g[v] = pow(100, x[0]);
        u[3 * v] = 0.5 - x[1];
        u[3 * v + 1] = x[0] - 0.5;
        u[3 * v + 2] = 0.1;
    }
    for (size_t t = 0; t < m.tet_count; t++) c[t] = m.xyz[3 * (size_t)m.tets[4 * t]];
    const tl_channel channels[] = {{"g", "Pa", 1, TL_ON_VERTEX, TL_F64, g},
                                   {"u", "m/s", 3, TL_ON_VERTEX, TL_F64, u},
                                   {"c", "", 1, TL_ON_TET, TL_F64, c}};
    for (size_t i = 0; i < 3; i++) CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channels[i]));
    free(c);
    free(u);
    free(g);
    make_release(&m);
    return mesh;
}

static inline tl_source *view_source(tl_ctx *ctx, size_t n)
{
    tl_source *source = NULL;
    CHECK_OK(ctx, tl_source_create(ctx, view_mesh(ctx, n), "cube", &source));
    return source;
}

/* A model of a mesh, which it takes over; its file is gone when the source is. */
static inline tl_source *view_model_of(tl_ctx *ctx, tl_mesh *mesh)
{
    tl_build_result result;
    tl_source *source = NULL;
    tl_build_opts opts = check_model_opts(2000, 200);
    const char *path = check_model_path("view");
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, path, &opts, &result));
    tl_build_release(ctx, &result);
    tl_mesh_destroy(mesh);
    CHECK_OK(ctx, tl_source_open(ctx, path, &source));
    CHECK_EQ(remove(path), 0);
    return source;
}

static inline tl_source *view_model(tl_ctx *ctx, size_t n)
{
    return view_model_of(ctx, view_mesh(ctx, n));
}

/* A scene with the bounds of a source, and the commands up to a NULL. */
static inline tl_scene *view_scene(tl_ctx *ctx, const tl_source *source, const char *const *lines)
{
    tl_scene *scene = NULL;
    CHECK_OK(ctx, tl_scene_create(ctx, &scene));
    CHECK_OK(ctx, tl_scene_set_bounds(ctx, scene, tl_source_get_facts(source)->bounds));
    check_scene_do(ctx, scene, lines);
    return scene;
}

enum { VIEW_WIDTH = 60, VIEW_HEIGHT = 45 };

static inline tl_camera view_camera(const tl_scene *scene)
{
    tl_camera camera;
    tl_scene_camera(scene, VIEW_WIDTH, VIEW_HEIGHT, &camera);
    return camera;
}

static inline tl_content *view_build(tl_ctx *ctx, tl_view *view, const tl_scene *scene)
{
    tl_content *content = NULL;
    const tl_camera camera = view_camera(scene);
    CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, NULL, &content));
    return content;
}

/* Destroys all that a test has; NULL: there is none. */
static inline void view_close(tl_ctx *ctx, tl_content *content, tl_view *view, tl_scene *scene,
                              tl_source *source)
{
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
    tl_scene_destroy(ctx, scene);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* The picture of what is shown, from the scene's camera. */
static inline tl_image *view_draw(tl_ctx *ctx, tl_shown *shown, const tl_content *content,
                                  const tl_scene *scene)
{
    tl_image *image = NULL;
    const tl_camera camera = view_camera(scene);
    tl_draw_opts opts = tl_draw_opts_defaults();
    opts.samples = tl_content_samples(content, scene, VIEW_WIDTH, VIEW_HEIGHT);
    CHECK_OK(ctx, tl_content_show(ctx, shown, content));
    CHECK_OK(ctx, tl_content_draw(ctx, shown, &camera, &opts, &image));
    CHECK_OK(ctx, tl_content_annotate(ctx, content, scene, &camera, image));
    return image;
}

/* The same with everything made anew. */
static inline tl_image *view_picture(tl_ctx *ctx, tl_source *source, const tl_scene *scene)
{
    tl_view *view = NULL;
    tl_shown *shown = NULL;
    tl_renderer *renderer = picture_renderer(ctx);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
    tl_content *content = view_build(ctx, view, scene);
    tl_view_destroy(view);
    tl_image *image = view_draw(ctx, shown, content, scene);
    tl_shown_destroy(ctx, shown);
    tl_renderer_destroy(ctx, renderer);
    tl_content_destroy(ctx, content);
    return image;
}

#endif
