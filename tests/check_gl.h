/* Scenes that are drawn by OpenGL and by the processor, and how far the pictures are apart. */
#ifndef TETRALOD_TESTS_CHECK_GL_H
#define TETRALOD_TESTS_CHECK_GL_H

#include "check.h"

#include "tetralod/draw.h"

#include "check_ctx.h"
#include "check_picture.h"
#include "make_mesh.h"
#include "make_scene.h"

enum { SIDE = 160 };
/* Of what is drawn. */
static const double CENTER[3] = {0.5, 0.5, 0.5};
/* Of two pictures of one scene, decibels; of volumes alone by rays; of translucent lines, where a
 * joint belongs to the segment whose axis is nearer, on the processor to the one that is nearer to
 * the camera. */
static const double ALIKE = 35, ALIKE_RAYS = 50, ALIKE_JOINTS = 30;

/* What is drawn: NULL or 0 is left out. */
typedef struct scene {
    const tl_mesh *mesh;
    const double *scalar; /* of the mesh */
    const tl_volume *volume;
    const tl_transfer *transfer;
    const tl_volume_opts *volume_opts;
    const tl_polydata *opaque, *translucent, *lines, *points;
    const tl_line_opts *line_opts;
    const tl_point_opts *point_opts;
    const tl_look *look; /* of both */
    double opacity;      /* of what is translucent */
    double level;        /* of a translucent slice; 0: none */
} scene;

static inline tl_renderer *open_renderer(tl_ctx *ctx, tl_renderer_kind kind)
{
    tl_renderer *r = NULL;
    tl_status st = tl_renderer_create(ctx, kind, &r);
    if (kind == TL_RENDERER_GL && st == TL_ERR_UNSUPPORTED) {
        CHECK(strstr(tl_ctx_message(ctx), "OpenGL"));
        return NULL;
    }
    CHECK_OK(ctx, st);
    return r;
}

/* The context of a case, and whether there is OpenGL. */
static inline bool begin(tl_ctx **ctx)
{
    *ctx = check_ctx_create(2);
    tl_renderer *r = open_renderer(*ctx, TL_RENDERER_GL);
    bool there = r != NULL;
    if (there) CHECK(strncmp(tl_renderer_name(r), "gl: ", 4) == 0);
    tl_renderer_destroy(*ctx, r);
    if (!there) check_ctx_destroy(*ctx);
    return there;
}

static inline tl_item fill(tl_ctx *ctx, tl_renderer *r, const scene *s)
{
    tl_item slices = 0;
    tl_look look = s->look ? *s->look : tl_look_defaults();
    if (s->opaque) CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, s->opaque, &look, NULL));
    if (s->lines) CHECK_OK(ctx, tl_renderer_add_lines(ctx, r, s->lines, &look, s->line_opts, NULL));
    if (s->points)
        CHECK_OK(ctx, tl_renderer_add_points(ctx, r, s->points, &look, s->point_opts, NULL));
    look.opacity = s->opacity;
    if (s->translucent) CHECK_OK(ctx, tl_renderer_add_surface(ctx, r, s->translucent, &look, NULL));
    look.scalar = s->look && s->look->scalar ? s->scalar : NULL; /* of the mesh */
    if (s->level != 0)
        CHECK_OK(ctx,
                 tl_renderer_add_slices(ctx, r, s->mesh, s->scalar, &s->level, 1, &look, &slices));
    if (s->volume)
        CHECK_OK(ctx, tl_renderer_add_volume(ctx, r, s->volume, s->scalar, s->transfer,
                                             s->volume_opts, NULL));
    return slices;
}

static inline tl_image *draw_scene(tl_ctx *ctx, tl_renderer_kind kind, const scene *s,
                                   const tl_camera *camera)
{
    tl_renderer *r = open_renderer(ctx, kind);
    fill(ctx, r, s);
    return picture_of(ctx, r, camera);
}

/* Decibels between two pictures, colours and opacity; 200 for equal ones. */
static inline double psnr(const tl_image *a, const tl_image *b)
{
    double sum = 0;
    size_t count = 4 * (size_t)a->width * a->height;
    for (size_t i = 0; i < count; i++) {
        double d = (double)a->rgba[i] - (double)b->rgba[i];
        CHECK(isfinite(b->rgba[i]));
        sum += d * d;
    }
    return sum > 0 ? fmin(-10 * log10(sum / (double)count), 200) : 200;
}

/* Pixels where the depths of two pictures are not the same within 0.1 %. */
static inline size_t depths_apart(const tl_image *a, const tl_image *b)
{
    size_t apart = 0;
    for (size_t i = 0; i < (size_t)a->width * a->height; i++)
        apart += isinf(a->depth[i]) != isinf(b->depth[i]) ||
                 (!isinf(a->depth[i]) && fabsf(a->depth[i] - b->depth[i]) > 1e-3F * a->depth[i]);
    return apart;
}

/* Pictures to be looked at, where TETRALOD_PICTURES names a folder. */
static inline void keep(tl_ctx *ctx, const char *what, int look, const tl_image *cpu,
                        const tl_image *gl)
{
    char path[400];
    const char *folder = getenv("TETRALOD_PICTURES");
    if (!folder) return;
    snprintf(path, sizeof path, "%s/%s %d cpu.png", folder, what, look);
    CHECK_OK(ctx, tl_image_write_png(ctx, cpu, path));
    snprintf(path, sizeof path, "%s/%s %d gl.png", folder, what, look);
    CHECK_OK(ctx, tl_image_write_png(ctx, gl, path));
}

/* The scene by both, from four cameras; prints the least agreement. */
static inline void compare_looks(tl_ctx *ctx, const char *what, const scene *s, double alike)
{
    double least = 200;
    static const double bounds[6] = {0, 1, 0, 1, 0, 1};
    for (int look = 0; look < 4; look++) {
        tl_camera camera = tl_camera_fit(bounds, 30 + 80 * look, 25, 1.3, SIDE, SIDE - 37);
        if (look == 1) camera.parallel_scale = 0.6;
        if (look == 3) { /* inside */
            for (int k = 0; k < 3; k++) camera.position[k] = 0.4;
            camera.view_angle = 80;
        }
        tl_image *cpu = draw_scene(ctx, TL_RENDERER_CPU, s, &camera);
        tl_image *gl = draw_scene(ctx, TL_RENDERER_GL, s, &camera);
        least = fmin(least, psnr(cpu, gl));
        keep(ctx, what, look, cpu, gl);
        CHECK(depths_apart(cpu, gl) <= SIDE / 4); /* edges */
        tl_image_destroy(ctx, gl);
        tl_image_destroy(ctx, cpu);
    }
    printf("%s: at least %.1f dB, %g expected\n", what, least, alike);
    CHECK(least >= alike);
}

/* Whether OpenGL draws this volume by rays: it is new enough. */
static inline bool has_rays(tl_ctx *ctx, const scene *s)
{
    tl_volume_opts opts = tl_volume_opts_defaults();
    opts.method = TL_VOLUME_RAYS;
    tl_renderer *r = open_renderer(ctx, TL_RENDERER_GL);
    tl_status st = tl_renderer_add_volume(ctx, r, s->volume, s->scalar, s->transfer, &opts, NULL);
    if (st) {
        CHECK_STATUS(st, TL_ERR_UNSUPPORTED);
        CHECK(strstr(tl_ctx_message(ctx), "OpenGL 4.3"));
        tl_ctx_clear(ctx);
    }
    tl_renderer_destroy(ctx, r);
    return !st;
}

/* The same in each way that there is for volumes. */
static inline void compare(tl_ctx *ctx, const char *what, const scene *s, double alike)
{
    static const char *const names[] = {"", "projected", "rays"};
    if (!s->volume) {
        compare_looks(ctx, what, s, alike);
        return;
    }
    for (int method = TL_VOLUME_PROJECTED; method <= TL_VOLUME_RAYS; method++) {
        char both[100];
        scene own = *s;
        tl_volume_opts opts = s->volume_opts ? *s->volume_opts : tl_volume_opts_defaults();
        bool alone = !s->opaque && !s->translucent && !s->lines && !s->points && s->level == 0;
        if (method == TL_VOLUME_RAYS && !has_rays(ctx, s)) continue;
        opts.method = (tl_volume_method)method;
        own.volume_opts = &opts;
        snprintf(both, sizeof both, "%s, %s", what, names[method]);
        compare_looks(ctx, both, &own,
                      method == TL_VOLUME_RAYS && alone ? fmax(alike, ALIKE_RAYS) : alike);
    }
}

static inline double hills(const double x[3])
{
    double a = 0, b = 0;
    for (int k = 0; k < 3; k++) {
        a += (x[k] - 0.35) * (x[k] - 0.35);
        b += (x[k] - 0.65 - 0.1 * k) * (x[k] - 0.65 - 0.1 * k);
    }
    return exp(-12 * a) + 0.7 * exp(-20 * b);
}

static inline tl_transfer *colored(tl_ctx *ctx, bool sharp)
{
    static const tl_color_point colors[4] = {
        {0, {0.1, 0.1, 0.6}}, {0.3, {0.1, 0.7, 0.8}}, {0.6, {0.9, 0.9, 0.3}}, {1, {0.9, 0, 0}}};
    static const tl_opacity_point smooth[3] = {{0.05, 0}, {0.5, 0.4}, {1, 0.95}};
    static const tl_opacity_point shells[8] = {{0.2, 0}, {0.2, 0.9},  {0.22, 0.9},  {0.22, 0},
                                               {0.6, 0}, {0.6, 0.99}, {0.61, 0.99}, {0.61, 0}};
    tl_transfer *t = NULL;
    CHECK_OK(ctx, tl_transfer_create(ctx, colors, 4, sharp ? shells : smooth, sharp ? 8 : 3,
                                     sharp ? 0.02 : 0.1, &t));
    return t;
}

/* A mesh with a channel, and its volume. */
typedef struct solid {
    tl_mesh *mesh;
    tl_volume *volume;
    const double *scalar;
} solid;

static inline solid open_solid(tl_ctx *ctx, make_mesh *m, make_field field)
{
    solid s = {.mesh = make_object(ctx, m, field)};
    make_release(m);
    CHECK_OK(ctx, tl_volume_create(ctx, s.mesh, NULL, &s.volume));
    s.scalar = tl_mesh_channel(s.mesh, 0)->values;
    return s;
}

static inline void close_solid(tl_ctx *ctx, solid *s)
{
    tl_volume_destroy(ctx, s->volume);
    tl_mesh_destroy(s->mesh);
}

static inline make_mesh perturbed(size_t n, bool cavity)
{
    make_mesh m = make_grid_with(n, cavity);
    make_perturb(&m, 0.08 / (double)n, 5);
    make_shuffle(&m, 9);
    return m;
}

#endif
