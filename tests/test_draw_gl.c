/* OpenGL against closed forms and against the processor: volumes, surfaces, slices and all of them
 * together, by desktop OpenGL, OpenGL ES and in a context of the caller; no OpenGL at all. Skips
 * where there is none. */
#include "check.h"

#include <sys/wait.h>
#include <unistd.h>

#include "tetralod/draw.h"

#include "check_ctx.h"
#include "make_mesh.h"
#include "make_scene.h"

#if TETRALOD_WITH_GL
#include "draw/draw_gl.h"
#endif

enum { SIDE = 160 };
/* Of two pictures of one scene, decibels; of translucent lines, where a joint belongs to the
 * segment whose axis is nearer, on the processor to the one that is nearer to the camera. */
static const double ALIKE = 35, ALIKE_JOINTS = 30;

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

static tl_renderer *open_renderer(tl_ctx *ctx, tl_renderer_kind kind)
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
static bool begin(tl_ctx **ctx)
{
    *ctx = check_ctx_create(2);
    tl_renderer *r = open_renderer(*ctx, TL_RENDERER_GL);
    bool there = r != NULL;
    if (there) CHECK(strncmp(tl_renderer_name(r), "gl: ", 4) == 0);
    tl_renderer_destroy(*ctx, r);
    if (!there) check_ctx_destroy(*ctx);
    return there;
}

static tl_item fill(tl_ctx *ctx, tl_renderer *r, const scene *s)
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

static tl_image *draw_with(tl_ctx *ctx, tl_renderer *r, const tl_camera *camera)
{
    tl_image *image = NULL;
    CHECK_OK(ctx, tl_image_create(ctx, camera->size_px[0], camera->size_px[1], &image));
    CHECK_OK(ctx, tl_renderer_draw(ctx, r, camera, image));
    return image;
}

static tl_image *draw_scene(tl_ctx *ctx, tl_renderer_kind kind, const scene *s,
                            const tl_camera *camera)
{
    tl_renderer *r = open_renderer(ctx, kind);
    fill(ctx, r, s);
    tl_image *image = draw_with(ctx, r, camera);
    tl_renderer_destroy(ctx, r);
    return image;
}

/* Decibels between two pictures, colours and opacity; 200 for equal ones. */
static double psnr(const tl_image *a, const tl_image *b)
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
static size_t depths_apart(const tl_image *a, const tl_image *b)
{
    size_t apart = 0;
    for (size_t i = 0; i < (size_t)a->width * a->height; i++)
        apart += isinf(a->depth[i]) != isinf(b->depth[i]) ||
                 (!isinf(a->depth[i]) && fabsf(a->depth[i] - b->depth[i]) > 1e-3F * a->depth[i]);
    return apart;
}

/* Pictures to be looked at, where TETRALOD_PICTURES names a folder. */
static void keep(tl_ctx *ctx, const char *what, int look, const tl_image *cpu, const tl_image *gl)
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
static void compare(tl_ctx *ctx, const char *what, const scene *s, double alike)
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

/* ---- volumes ---- */

static double hills(const double x[3])
{
    double a = 0, b = 0;
    for (int k = 0; k < 3; k++) {
        a += (x[k] - 0.35) * (x[k] - 0.35);
        b += (x[k] - 0.65 - 0.1 * k) * (x[k] - 0.65 - 0.1 * k);
    }
    return exp(-12 * a) + 0.7 * exp(-20 * b);
}

static double height(const double x[3])
{
    return x[2];
}

static tl_transfer *colored(tl_ctx *ctx, bool sharp)
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

static solid open_solid(tl_ctx *ctx, make_mesh *m, make_field field)
{
    solid s = {.mesh = make_object(ctx, m, field)};
    make_release(m);
    CHECK_OK(ctx, tl_volume_create(ctx, s.mesh, NULL, &s.volume));
    s.scalar = tl_mesh_channel(s.mesh, 0)->values;
    return s;
}

static void close_solid(tl_ctx *ctx, solid *s)
{
    tl_volume_destroy(ctx, s->volume);
    tl_mesh_destroy(s->mesh);
}

static make_mesh perturbed(size_t n, bool cavity)
{
    make_mesh m = make_grid_with(n, cavity);
    make_perturb(&m, 0.08 / (double)n, 5);
    make_shuffle(&m, 9);
    return m;
}

static void volumes_as_by_rays(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    for (int kind = 0; kind < 4; kind++) {
        static const char *const names[4] = {"smooth", "sharp", "smooth, a cavity",
                                             "sharp, a cavity"};
        make_mesh m = perturbed(17, kind / 2);
        solid s = open_solid(ctx, &m, hills);
        tl_transfer *t = colored(ctx, kind & 1);
        scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
        compare(ctx, names[kind], &drawn, ALIKE);
        tl_transfer_destroy(ctx, t);
        close_solid(ctx, &s);
    }
    check_ctx_destroy(ctx);
}

static void lit_volumes_as_by_rays(void **state)
{
    (void)state;
    static const char *const names[3] = {"lit", "gradient opacity", "both, a surface inside"};
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(17, true);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, false);
    double *gradients = malloc(tl_mesh_vert_count(s.mesh) * 3 * sizeof *gradients);
    static const double center[3] = {0.6, 0.5, 0.4};
    tl_polydata sphere = make_sphere(40, center, 0.25);
    if (!gradients) abort();
    CHECK_OK(ctx, tl_mesh_gradient(ctx, s.mesh, tl_mesh_channel(s.mesh, 0), gradients));
    for (int kind = 0; kind < 3; kind++) {
        tl_volume_opts opts = tl_volume_opts_defaults();
        opts.gradients = gradients;
        opts.lit = kind != 1;
        opts.gradient_opacity = kind ? 2.5 : 0;
        scene drawn = {.mesh = s.mesh,
                       .scalar = s.scalar,
                       .volume = s.volume,
                       .transfer = t,
                       .volume_opts = &opts,
                       .opacity = 0.5};
        drawn.translucent = kind == 2 ? &sphere : NULL;
        compare(ctx, names[kind], &drawn, ALIKE);
    }
    make_triangles_release(&sphere);
    free(gradients);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* Wrong here and there where tets differ in size, which those of a grid hardly do. */
static void order_by_centroids(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(13, false);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, true);
    tl_volume_opts opts = tl_volume_opts_defaults();
    opts.order = TL_ORDER_CENTROIDS;
    scene drawn = {.mesh = s.mesh,
                   .scalar = s.scalar,
                   .volume = s.volume,
                   .transfer = t,
                   .volume_opts = &opts};
    compare(ctx, "order by centroids", &drawn, ALIKE);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* Extinction 0.2 + 3 z, white: the middle of the picture. */
static void linear_fields(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = make_grid(12);
    solid s = open_solid(ctx, &m, height);
    tl_transfer *t = make_fog(ctx, 0, 0.2, 1, 3.2);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
    for (int look = 0; look < 4; look++) { /* parallel and not, outside and half way inside */
        tl_camera camera = make_camera(look & 1);
        if (look & 2) camera.position[2] = 0.4999;
        tl_image *image = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
        const float *c = image->rgba + 4 * (MAKE_SIDE * (MAKE_SIDE / 2) + MAKE_SIDE / 2);
        CHECK_NEAR((double)c[3], -expm1(look & 2 ? -1.225 : -1.7), 3e-4);
        CHECK_NEAR((double)c[0], (double)c[3], 1e-5);
        if (look == 1) CHECK(image->rgba[3] == 0); /* the corner sees nothing */
        tl_image_destroy(ctx, image);
    }
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

static double constant(const double x[3])
{
    (void)x;
    return 0.25;
}

static void fog_has_its_depth(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = make_grid(9);
    solid s = open_solid(ctx, &m, constant);
    for (double extinction = 0.01; extinction < 20; extinction *= 3) {
        tl_transfer *t = make_fog(ctx, 0, extinction, 1, extinction);
        scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
        tl_camera camera = make_camera(true);
        tl_image *image = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
        size_t middle = MAKE_SIDE * (MAKE_SIDE / 2) + MAKE_SIDE / 2;
        CHECK_NEAR((double)image->rgba[4 * middle + 3], -expm1(-extinction), 3e-5);
        tl_image_destroy(ctx, image);
        tl_transfer_destroy(ctx, t);
    }
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* ---- surfaces ---- */

static const double CENTER[3] = {0.5, 0.5, 0.5};

static double distance(const double x[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += (x[k] - CENTER[k]) * (x[k] - CENTER[k]);
    return sqrt(sum);
}

/* Slices are made in the card; the picture knows the radius they were asked for. */
static void slices_have_their_silhouette(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(33, false);
    solid s = open_solid(ctx, &m, distance);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .opacity = 1, .level = 0.1};
    tl_camera camera = make_camera(true);
    camera.size_px[0] = camera.size_px[1] = SIDE;
    tl_renderer *r = open_renderer(ctx, TL_RENDERER_GL);
    tl_item slices = fill(ctx, r, &drawn);
    for (double radius = 0.15; radius < 0.5; radius += 0.1) {
        double count = 0, edge = SIDE / 1.2 * radius, pi = acos(-1);
        CHECK_OK(ctx, tl_renderer_set_slices(ctx, r, slices, &radius, 1));
        tl_image *image = draw_with(ctx, r, &camera);
        for (size_t i = 0; i < (size_t)SIDE * SIDE; i++) count += (double)image->rgba[4 * i + 3];
        CHECK_NEAR(count / (pi * edge * edge), 1, 0.03); /* 33 vertices a side */
        /* chords of the tets lie inside of the sphere */
        CHECK_NEAR((double)image->depth[SIDE * (SIDE / 2) + SIDE / 2], 2.5 - radius, 3e-3);
        tl_image_destroy(ctx, image);
    }
    double nowhere = 2;
    CHECK_OK(ctx, tl_renderer_set_slices(ctx, r, slices, &nowhere, 1));
    tl_image *image = draw_with(ctx, r, &camera);
    for (size_t i = 0; i < (size_t)SIDE * SIDE; i++)
        CHECK(image->rgba[4 * i + 3] == 0 && isinf(image->depth[i]));
    tl_image_destroy(ctx, image);
    tl_renderer_destroy(ctx, r);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

static void surfaces_as_by_the_processor(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(13, false);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, false);
    tl_polydata inner = make_sphere(40, CENTER, 0.2), outer = make_sphere(30, CENTER, 0.45);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .opacity = 0.4};
    drawn.opaque = &inner;
    compare(ctx, "an opaque sphere, flat", &drawn, ALIKE);
    drawn.translucent = &outer;
    compare(ctx, "a translucent one around it", &drawn, ALIKE);
    double *values = malloc((inner.vert_count + outer.vert_count) * sizeof *values);
    if (!values) abort();
    for (size_t v = 0; v < inner.vert_count; v++) values[v] = inner.xyz[3 * v];
    values[40] = (double)NAN;
    tl_look look = tl_look_defaults();
    look.scalar = values;
    look.transfer = t;
    look.lit = false;
    drawn.look = &look;
    drawn.translucent = NULL;
    drawn.level = 0.3;
    compare(ctx, "colours of values, a slice", &drawn, ALIKE);
    free(values);
    drawn.look = NULL;
    drawn.volume = s.volume;
    drawn.transfer = t;
    drawn.translucent = &outer;
    compare(ctx, "with the volume", &drawn, ALIKE);
    make_triangles_release(&inner);
    make_triangles_release(&outer);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* ---- lines and points ---- */

/* Springs around the middle, with normals and a value that rises; one has a place that is none. */
static tl_polydata make_springs(double *values)
{
    enum { SPRINGS = 6, CORNERS = 90 };
    tl_polydata p = {.kind = TL_POLY_LINES, .cell_count = SPRINGS, .vert_count = SPRINGS * CORNERS};
    p.xyz = calloc(p.vert_count, 3 * sizeof *p.xyz);
    p.normals = calloc(p.vert_count, 3 * sizeof *p.normals);
    p.corners = calloc(p.vert_count, sizeof *p.corners);
    p.starts = calloc(SPRINGS + 1, sizeof *p.starts);
    if (!p.xyz || !p.normals || !p.corners || !p.starts) abort();
    for (size_t v = 0; v < p.vert_count; v++) {
        double t = (double)(v % CORNERS) / CORNERS, spring = (double)(v / CORNERS);
        double around = 14 * t + spring, radius = 0.1 + 0.05 * spring;
        p.xyz[3 * v] = 0.5 + radius * cos(around);
        p.xyz[3 * v + 1] = 0.5 + radius * sin(around);
        p.xyz[3 * v + 2] = t;
        p.normals[3 * v] = (float)cos(around);
        p.normals[3 * v + 1] = (float)sin(around);
        p.corners[v] = (tl_lidx)v;
        values[v] = t;
    }
    for (size_t i = 0; i <= SPRINGS; i++) p.starts[i] = (tl_lidx)(i * CORNERS);
    p.xyz[3 * 40] = (double)NAN;
    return p;
}

static void release_springs(tl_polydata *p)
{
    free(p->xyz);
    free(p->normals);
    free(p->corners);
    free(p->starts);
}

static void lines_as_by_the_processor(void **state)
{
    (void)state;
    static const char *const names[] = {"lines, flat",
                                        "tubes",
                                        "ribbons",
                                        "tubes, wide, halos",
                                        "dashes and arrows",
                                        "translucent tubes",
                                        "translucent, values"};
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    double values[1000];
    tl_polydata springs = make_springs(values);
    tl_transfer *t = colored(ctx, false);
    for (int kind = 0; kind < 7; kind++) {
        tl_line_opts opts = tl_line_opts_defaults();
        tl_look look = tl_look_defaults();
        scene drawn = {.lines = &springs, .line_opts = &opts, .look = &look};
        opts.width_px = 5;
        if (kind == 0) opts.shape = TL_LINE_FLAT;
        if (kind == 2) opts.shape = TL_LINE_RIBBON;
        if (kind == 3) opts.width = 0.03;
        if (kind == 3) opts.halo_px = 4;
        if (kind == 4) {
            opts.arrow_spacing = 0.3;
            opts.dash = 0.05;
            opts.gap = 0.03;
            opts.phase = 0.02;
            opts.width_px = 3;
        }
        if (kind >= 5) look.opacity = 0.5;
        if (kind == 6) {
            look.scalar = values;
            look.transfer = t;
        }
        compare(ctx, names[kind], &drawn, kind < 5 ? ALIKE : ALIKE_JOINTS);
    }
    tl_transfer_destroy(ctx, t);
    release_springs(&springs);
    check_ctx_destroy(ctx);
}

static void points_as_by_the_processor(void **state)
{
    (void)state;
    static const char *const names[] = {"spheres", "discs", "large spheres, fewer far away",
                                        "translucent discs, values"};
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    enum { POINTS = 1500 };
    uint64_t seed = 4;
    double xyz[3 * POINTS], values[POINTS];
    float normals[3 * POINTS];
    for (size_t i = 0; i < POINTS; i++) {
        double away = 0;
        for (size_t k = 0; k < 3; k++) {
            double d = make_uniform(&seed) - 0.5;
            xyz[3 * i + k] = 0.5 + d;
            normals[3 * i + k] = (float)d;
            away += d * d;
        }
        for (size_t k = 0; k < 3; k++) normals[3 * i + k] /= (float)sqrt(away);
        values[i] = sqrt(away);
    }
    xyz[30] = (double)INFINITY;
    tl_polydata points = {
        .kind = TL_POLY_POINTS, .vert_count = POINTS, .cell_count = POINTS, .xyz = xyz};
    tl_transfer *t = colored(ctx, false);
    for (int kind = 0; kind < 4; kind++) {
        tl_point_opts opts = tl_point_opts_defaults();
        tl_look look = tl_look_defaults();
        scene drawn = {.points = &points, .point_opts = &opts, .look = &look};
        opts.radius_px = 4;
        points.normals = kind & 1 ? normals : NULL;
        if (kind == 2) opts.radius = 0.02;
        opts.scale_depth = kind == 2;
        if (kind == 3) {
            look.opacity = 0.5;
            look.scalar = values;
            look.transfer = t;
        }
        compare(ctx, names[kind], &drawn, ALIKE);
    }
    tl_transfer_destroy(ctx, t);
    check_ctx_destroy(ctx);
}

/* A picture that holds something: in front of it, and cut off at its depth. */
static void pictures_keep_what_they_hold(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = make_grid(9);
    solid s = open_solid(ctx, &m, height);
    tl_transfer *t = make_fog(ctx, 0, 0.2, 1, 3.2);
    tl_polydata sphere = make_sphere(40, CENTER, 0.3);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
    drawn.opaque = &sphere;
    tl_camera camera = make_camera(true);
    tl_image *images[2];
    for (int kind = 0; kind < 2; kind++) {
        tl_renderer *r = open_renderer(ctx, kind ? TL_RENDERER_GL : TL_RENDERER_CPU);
        CHECK_OK(ctx, tl_image_create(ctx, MAKE_SIDE, MAKE_SIDE, &images[kind]));
        for (size_t p = 0; p < MAKE_SIDE * MAKE_SIDE; p++) {
            images[kind]->depth[p] = p % MAKE_SIDE < 16 ? 2.3F : INFINITY;
            images[kind]->rgba[4 * p] = images[kind]->rgba[4 * p + 3] = 0.5F;
        }
        fill(ctx, r, &drawn);
        CHECK_OK(ctx, tl_renderer_draw(ctx, r, &camera, images[kind]));
        tl_renderer_destroy(ctx, r);
    }
    CHECK(psnr(images[0], images[1]) >= ALIKE);
    CHECK(depths_apart(images[0], images[1]) <= 4);
    tl_image_destroy(ctx, images[0]);
    tl_image_destroy(ctx, images[1]);
    make_triangles_release(&sphere);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* ---- contexts ---- */

/* A child sees no driver at all. */
static void the_processor_where_there_is_no_opengl(void **state)
{
    (void)state;
    fflush(NULL);
    pid_t child = fork();
    CHECK(child >= 0);
    if (child == 0) {
        tl_ctx *ctx = NULL;
        tl_renderer *r = NULL;
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere/none.json", 1);
        if (tl_ctx_create(NULL, &ctx)) _exit(1);
        if (tl_renderer_create(ctx, TL_RENDERER_GL, &r) != TL_ERR_UNSUPPORTED || r) _exit(2);
        if (!strstr(tl_ctx_message(ctx), "OpenGL")) _exit(3);
        if (tl_renderer_create(ctx, TL_RENDERER_AUTO, &r)) _exit(4);
        _exit(strcmp(tl_renderer_name(r), "cpu") == 0 ? 0 : 5);
    }
    int status = 0;
    CHECK(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK_EQ(WEXITSTATUS(status), 0);
}

/* Two renderers in turns, one frame after the other: each keeps its own things. */
static void renderers_side_by_side(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    tl_renderer *r[2] = {open_renderer(ctx, TL_RENDERER_GL), open_renderer(ctx, TL_RENDERER_GL)};
    tl_polydata sphere = make_sphere(20, CENTER, 0.3);
    tl_camera camera = make_camera(false);
    tl_item item = 0;
    size_t empty = tl_renderer_card_bytes(r[0]);
    CHECK_OK(ctx, tl_renderer_add_surface(ctx, r[0], &sphere, NULL, &item));
    CHECK(tl_renderer_card_bytes(r[0]) >= empty + sphere.vert_count * 32);
    for (int frame = 0; frame < 4; frame++) {
        tl_image *image = draw_with(ctx, r[frame & 1], &camera);
        bool shown = image->rgba[4 * (MAKE_SIDE * (MAKE_SIDE / 2) + MAKE_SIDE / 2) + 3] == 1;
        CHECK_EQ(shown, frame == 0);
        tl_image_destroy(ctx, image);
        if (frame == 0) tl_renderer_remove(ctx, r[0], item);
    }
    /* what is left is the picture: colours and depths of five, another size than before */
    CHECK(tl_renderer_card_bytes(r[0]) <= empty + (size_t)5 * 24 * MAKE_SIDE * MAKE_SIDE);
    camera.size_px[0] = 2 * MAKE_SIDE;
    tl_image_destroy(ctx, draw_with(ctx, r[0], &camera));
    make_triangles_release(&sphere);
    tl_renderer_destroy(ctx, r[0]);
    tl_renderer_destroy(ctx, r[1]);
    check_ctx_destroy(ctx);
}

#if TETRALOD_WITH_GL

/* The picture of one item by a back end that was opened. */
static tl_image *draw_item(tl_ctx *ctx, void *gl, const tl_volume *volume, const double *scalar,
                           const tl_transfer *t, const tl_camera *camera)
{
    tl_image *image = NULL;
    tli_item item = {.id = 1,
                     .kind = TLI_ITEM_VOLUME,
                     .volume = volume,
                     .scalar = scalar,
                     .transfer = t,
                     .volume_opts = tl_volume_opts_defaults()};
    tli_item *items[1] = {&item};
    CHECK_OK(ctx, tl_image_create(ctx, camera->size_px[0], camera->size_px[1], &image));
    CHECK_OK(ctx, tli_backend_gl.add(ctx, gl, &item));
    CHECK_OK(ctx, tli_backend_gl.draw(ctx, gl, items, 1, camera, image));
    tli_backend_gl.remove(ctx, gl, &item);
    return image;
}

static void other_contexts(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(9, true);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, true);
    tl_camera camera = make_camera(false);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
    tl_image *first = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
    void *es = NULL;
    tl_renderer *guest = NULL;
    if (!tli_gl_backend_open(ctx, TLI_GL_ES, &es)) {
        tl_image *image = draw_item(ctx, es, s.volume, s.scalar, t, &camera);
        CHECK(psnr(first, image) >= 2 * ALIKE);
        tl_image_destroy(ctx, image);
        tli_backend_gl.close(ctx, es);
    }
    /* as in a viewer, whose context is current */
    tli_gl *host = NULL;
    CHECK_OK(ctx, tli_gl_open(ctx, TLI_GL_ANY, &host));
    CHECK_STATUS(tl_renderer_create(ctx, TL_RENDERER_GL_CURRENT, &guest), TL_ERR_ARG);
    CHECK_OK(ctx, tli_gl_begin(ctx, host));
    CHECK_OK(ctx, tl_renderer_create(ctx, TL_RENDERER_GL_CURRENT, &guest));
    glViewport(1, 2, 3, 4);
    fill(ctx, guest, &drawn);
    tl_image *image = draw_with(ctx, guest, &camera);
    GLint view[4];
    glGetIntegerv(GL_VIEWPORT, view);
    CHECK(view[0] == 1 && view[1] == 2 && view[2] == 3 && view[3] == 4);
    CHECK(psnr(first, image) >= 2 * ALIKE);
    tl_renderer_destroy(ctx, guest);
    CHECK_OK(ctx, tli_gl_end(ctx, host, TL_OK));
    tli_gl_close(ctx, host);
    tl_image_destroy(ctx, image);
    tl_image_destroy(ctx, first);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_processor_where_there_is_no_opengl),
        cmocka_unit_test(volumes_as_by_rays),
        cmocka_unit_test(lit_volumes_as_by_rays),
        cmocka_unit_test(order_by_centroids),
        cmocka_unit_test(linear_fields),
        cmocka_unit_test(fog_has_its_depth),
        cmocka_unit_test(slices_have_their_silhouette),
        cmocka_unit_test(surfaces_as_by_the_processor),
        cmocka_unit_test(lines_as_by_the_processor),
        cmocka_unit_test(points_as_by_the_processor),
        cmocka_unit_test(pictures_keep_what_they_hold),
        cmocka_unit_test(renderers_side_by_side),
#if TETRALOD_WITH_GL
        cmocka_unit_test(other_contexts),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
