/* OpenGL against closed forms and against the processor: volumes, alone and together with surfaces,
 * by desktop OpenGL, OpenGL ES and in a context of the caller; no OpenGL at all. Skips where there
 * is none. */
#include "check_gl.h"

#include <sys/wait.h>
#include <unistd.h>

#if TETRALOD_WITH_GL
#include "draw/draw_gl.h"
#endif

/* ---- volumes ---- */

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
    solid s = open_solid(ctx, &m, make_height);
    tl_transfer *t = make_fog(ctx, 0, 0.2, 1, 3.2);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
    for (int look = 0; look < 4; look++) { /* parallel and not, outside and half way inside */
        tl_camera camera = make_camera(look & 1);
        if (look & 2) camera.position[2] = 0.4999;
        tl_image *image = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
        const float *c = picture_middle(image);
        CHECK_NEAR((double)c[3], -expm1(look & 2 ? -1.225 : -1.7), 3e-4);
        CHECK_NEAR((double)c[0], (double)c[3], 1e-5);
        if (look == 1) CHECK(image->rgba[3] == 0); /* the corner sees nothing */
        tl_image_destroy(ctx, image);
    }
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

static void fog_has_its_depth(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = make_grid(9);
    solid s = open_solid(ctx, &m, make_quarter);
    for (double extinction = 0.01; extinction < 20; extinction *= 3) {
        tl_transfer *t = make_fog(ctx, 0, extinction, 1, extinction);
        scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
        tl_camera camera = make_camera(true);
        tl_image *image = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
        CHECK_NEAR((double)picture_middle(image)[3], -expm1(-extinction), 3e-5);
        tl_image_destroy(ctx, image);
        tl_transfer_destroy(ctx, t);
    }
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* A picture that holds something: in front of it, and cut off at its depth. */
static void pictures_keep_what_they_hold(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = make_grid(9);
    solid s = open_solid(ctx, &m, make_height);
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

static void values_that_are_none(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(13, true);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, false);
    size_t count = tl_mesh_vert_count(s.mesh);
    double *scalar = malloc(count * sizeof *scalar);
    if (!scalar) abort();
    for (size_t v = 0; v < count; v++) scalar[v] = v % 61 ? s.scalar[v] : (double)NAN;
    scene drawn = {.mesh = s.mesh, .scalar = scalar, .volume = s.volume, .transfer = t};
    compare(ctx, "values that are NaN", &drawn, ALIKE);
    free(scalar);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* Places that are none, tets that are no manifold and lie inside out: a picture comes out all the
 * same. */
static void hostile_meshes(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    tl_transfer *t = make_fog(ctx, 0, 1, 1, 1);
    for (uint64_t seed = 0; seed < 8; seed++) {
        make_mesh m = make_soup(20 + 5 * seed, 300, seed);
        if (seed & 1) m.xyz[5] = (double)NAN;
        if (seed & 1) m.xyz[9] = (double)INFINITY;
        tl_camera camera = make_camera(seed & 2);
        if (seed & 4) camera.position[2] = 0.5 - 1e-3;
        solid s = open_solid(ctx, &m, make_height);
        for (int method = TL_VOLUME_PROJECTED; method <= TL_VOLUME_RAYS; method++) {
            tl_volume_opts o = tl_volume_opts_defaults();
            scene drawn = {.scalar = s.scalar, .volume = s.volume, .transfer = t};
            o.method = (tl_volume_method)method;
            drawn.volume_opts = &o;
            if (method == TL_VOLUME_RAYS && !has_rays(ctx, &drawn)) continue;
            tl_image *image = draw_scene(ctx, TL_RENDERER_GL, &drawn, &camera);
            for (size_t i = 0; i < (size_t)MAKE_SIDE * MAKE_SIDE * 4; i++)
                CHECK(image->rgba[i] >= 0 && image->rgba[i] <= 1.001F);
            tl_image_destroy(ctx, image);
        }
        close_solid(ctx, &s);
    }
    tl_transfer_destroy(ctx, t);
    check_ctx_destroy(ctx);
}

static void count_warnings(void *user, tl_log_level level, const char *text)
{
    if (level <= TL_LOG_WARNING && strstr(text, "went in circles")) ++*(int *)user;
}

/* Two tets in one place, each behind all faces of the other: rays that are in them end all the
 * same, which is reported. */
static void rays_in_circles(void **state)
{
    (void)state;
    static const double xyz[5][3] = {
        {.5, .4, .8}, {.1, .1, .4}, {.9, .1, .4}, {.5, .9, .4}, {.5, .4, 0}};
    static const tl_lidx tets[3][4] = {{1, 2, 3, 0}, {1, 2, 3, 0}, {1, 3, 2, 4}};
    static const tl_lidx behind[3][4] = {
        {4, 5, 6, 11}, {0, 1, 2, 3}, {TL_NONE, TL_NONE, TL_NONE, 3}};
    int warnings = 0;
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.log = count_warnings;
    opts.user = &warnings;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    make_mesh m = make_room(5, 3);
    memcpy(m.xyz, xyz, sizeof xyz);
    memcpy(m.tets, tets, sizeof tets);
    solid s = {.mesh = make_object(ctx, &m, make_height)};
    make_release(&m);
    s.scalar = tl_mesh_channel(s.mesh, 0)->values;
    CHECK_OK(ctx, tl_volume_create(ctx, s.mesh, behind[0], &s.volume));
    tl_transfer *t = make_fog(ctx, 0, 1, 1, 1);
    tl_camera camera = make_camera(true);
    scene drawn = {.scalar = s.scalar, .volume = s.volume, .transfer = t};
    tl_renderer *r = open_renderer(ctx, TL_RENDERER_GL);
    if (r && has_rays(ctx, &drawn)) {
        fill(ctx, r, &drawn);
        tl_image *image = picture_take(ctx, r, &camera);
        CHECK_EQ(warnings, 1);
        CHECK_NEAR((double)picture_middle(image)[3], -expm1(-0.7), 0.05); /* long, about */
        tl_image_destroy(ctx, image);
    }
    tl_renderer_destroy(ctx, r);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* ---- contexts ---- */

enum { OTHER_DRIVER = 7 };
/* What a child finds with variables of the environment set, in pairs, NULL at the end: 0 if OpenGL
 * is refused with a message that says expected, and the processor is taken in its place.
 * OTHER_DRIVER: it is not, by a driver that takes no such variables. */
static int refused(const char *const *pairs, const char *expected)
{
    fflush(NULL);
    pid_t child = fork();
    CHECK(child >= 0);
    if (child == 0) {
        tl_ctx *ctx = NULL;
        tl_renderer *r = NULL;
        for (; *pairs; pairs += 2) setenv(pairs[0], pairs[1], 1);
        if (tl_ctx_create(NULL, &ctx)) _exit(1);
        tl_status st = tl_renderer_create(ctx, TL_RENDERER_GL, &r);
        if (!st) _exit(strstr(tl_renderer_name(r), "llvmpipe") ? 2 : OTHER_DRIVER);
        if (st != TL_ERR_UNSUPPORTED || r || !strstr(tl_ctx_message(ctx), expected)) _exit(3);
        tl_ctx_clear(ctx);
        if (tl_ctx_current_bytes(ctx)) _exit(4);
        if (tl_renderer_create(ctx, TL_RENDERER_AUTO, &r)) _exit(5);
        _exit(strcmp(tl_renderer_name(r), "cpu") == 0 ? 0 : 6);
    }
    int status = 0;
    CHECK(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static void the_processor_where_there_is_no_opengl(void **state)
{
    (void)state;
    static const char *const pairs[] = {"__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere/none.json",
                                        NULL};
    CHECK_EQ(refused(pairs, "OpenGL"), 0);
}

static void the_processor_where_opengl_is_too_old(void **state)
{
    (void)state;
    static const char *const pairs[] = {"MESA_GL_VERSION_OVERRIDE", "3.0",
                                        "MESA_GLES_VERSION_OVERRIDE", "2.0", NULL};
    int found = refused(pairs, "OpenGL 3.3 or OpenGL ES 3.0"); /* before Mesa has read others */
    if (found == OTHER_DRIVER) CHECK_SKIP("the driver is not Mesa's, which can say it is older");
    CHECK_EQ(found, 0);
}

/* Frame after frame of one size: the card holds no more than after the first, and pictures in 8
 * bits are those in floats. */
static void frames_in_a_row(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    static const float sky[3] = {0.2F, 0.5F, 1};
    make_mesh m = perturbed(9, true);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, false);
    tl_polydata inner = make_sphere(20, CENTER, 0.1), outer = make_sphere(20, CENTER, 0.4);
    for (int kind = 0; kind < 4; kind++) { /* by the processor and by OpenGL, a surface and all */
        scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .opacity = 0.4, .opaque = &inner};
        tl_renderer *r = open_renderer(ctx, kind & 1 ? TL_RENDERER_GL : TL_RENDERER_CPU);
        if (kind & 2) {
            drawn.volume = s.volume;
            drawn.transfer = t;
            drawn.translucent = &outer;
        }
        fill(ctx, r, &drawn);
        size_t held = 0;
        for (int frame = 0; frame < 3; frame++) {
            enum { PIXELS = SIDE * (SIDE - 37) };
            static const double bounds[6] = {0, 1, 0, 1, 0, 1};
            static uint8_t bytes[4 * PIXELS];
            static float depth[PIXELS];
            tl_camera camera = tl_camera_fit(bounds, 30 * frame, 25, 1.3, SIDE, SIDE - 37);
            tl_image *image = picture_take(ctx, r, &camera);
            CHECK_OK(ctx,
                     tl_renderer_draw_bytes(ctx, r, &camera, frame ? sky : NULL, bytes, depth));
            if (frame) tl_image_flatten(image, sky);
            for (size_t i = 0; i < 4 * PIXELS; i++)
                CHECK_NEAR((double)image->rgba[i], bytes[i] / 255.0, 0.51 / 255);
            CHECK(memcmp(depth, image->depth, sizeof depth) == 0);
            CHECK(!frame || tl_renderer_card_bytes(r) == held);
            held = tl_renderer_card_bytes(r);
            tl_image_destroy(ctx, image);
        }
        tl_camera none = tl_camera_defaults();
        none.size_px[0] = 0;
        uint8_t byte[4];
        CHECK_STATUS(tl_renderer_draw_bytes(ctx, r, &none, NULL, byte, NULL), TL_ERR_ARG);
        tl_ctx_clear(ctx);
        tl_renderer_destroy(ctx, r);
    }
    make_triangles_release(&inner);
    make_triangles_release(&outer);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
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
        tl_image *image = picture_take(ctx, r[frame & 1], &camera);
        bool shown = picture_middle(image)[3] == 1;
        CHECK_EQ(shown, frame == 0);
        tl_image_destroy(ctx, image);
        if (frame == 0) tl_renderer_remove(ctx, r[0], item);
    }
    /* what is left is the picture: colours and depths of five, another size than before */
    CHECK(tl_renderer_card_bytes(r[0]) <= empty + (size_t)5 * 24 * MAKE_SIDE * MAKE_SIDE);
    camera.size_px[0] = 2 * MAKE_SIDE;
    tl_image_destroy(ctx, picture_take(ctx, r[0], &camera));
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
    tl_image *image = picture_take(ctx, guest, &camera);
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

/* Where rays can be, all that goes with them can, too: it is not only passed over. */
static void programs_of_lists(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    tli_gl *gl = NULL;
    tli_gl_painter painter = {0};
    tli_gl_caster caster = {0};
    CHECK_OK(ctx, tli_gl_open(ctx, TLI_GL_ANY, &gl));
    CHECK_OK(ctx, tli_gl_begin(ctx, gl));
    if (gl->modern) {
        CHECK_OK(ctx, tli_gl_painter_open(ctx, gl, true, &painter));
        CHECK_OK(ctx, tli_gl_caster_open(ctx, gl, &caster));
    }
    tli_gl_painter_close(&painter);
    tli_gl_caster_close(gl, &caster);
    CHECK_OK(ctx, tli_gl_end(ctx, gl, TL_OK));
    tli_gl_close(ctx, gl);
    check_ctx_destroy(ctx);
}

static PFNGLGETERRORPROC true_error;
static GLenum lost_error(void)
{
    return GL_CONTEXT_LOST;
}

/* A context that is reset in the middle of a frame, or gone before one: each call from then on
 * fails for the same reason, and what the renderer has in memory is given back. */
static void contexts_that_are_lost(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(9, false);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, true);
    tl_polydata sphere = make_sphere(20, CENTER, 0.3);
    scene drawn = {.mesh = s.mesh, .scalar = s.scalar, .volume = s.volume, .transfer = t};
    drawn.translucent = &sphere;
    drawn.opacity = 0.5;
    drawn.level = 0.4;
    const tl_camera camera = make_camera(true);
    tl_image *image = picture_empty(ctx, &camera);
    for (int way = 0; way < 2; way++) {
        tl_renderer *r = open_renderer(ctx, TL_RENDERER_GL);
        fill(ctx, r, &drawn);
        CHECK_OK(ctx, tl_renderer_draw(ctx, r, &camera, image));
        true_error = epoxy_glGetError;
        epoxy_glGetError = lost_error;
        if (way == 0) CHECK_STATUS(tl_renderer_draw(ctx, r, &camera, image), TL_ERR_IO);
        if (way == 1) CHECK_STATUS(tl_renderer_add_surface(ctx, r, &sphere, NULL, NULL), TL_ERR_IO);
        epoxy_glGetError = true_error;
        CHECK(strstr(tl_ctx_message(ctx), "the context is lost"));
        tl_ctx_clear(ctx);
        CHECK_STATUS(tl_renderer_draw(ctx, r, &camera, image), TL_ERR_IO);
        tl_ctx_clear(ctx);
        tl_renderer_destroy(ctx, r);
    }
    tl_image_destroy(ctx, image);
    make_triangles_release(&sphere);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

/* What a renderer has in memory is given back also when the viewer's context is gone. */
static void renderers_outlive_their_context(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(9, false);
    solid s = open_solid(ctx, &m, hills);
    const double level = 0.5;
    tli_gl *host = NULL;
    tl_renderer *guest = NULL;
    CHECK_OK(ctx, tli_gl_open(ctx, TLI_GL_ANY, &host));
    CHECK_OK(ctx, tli_gl_begin(ctx, host));
    CHECK_OK(ctx, tl_renderer_create(ctx, TL_RENDERER_GL_CURRENT, &guest));
    CHECK_OK(ctx, tl_renderer_add_slices(ctx, guest, s.mesh, s.scalar, &level, 1, NULL, NULL));
    CHECK_OK(ctx, tli_gl_end(ctx, host, TL_OK));
    tli_gl_close(ctx, host);
    tl_renderer_destroy(ctx, guest);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
}

#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_processor_where_there_is_no_opengl),
        cmocka_unit_test(the_processor_where_opengl_is_too_old),
        cmocka_unit_test(volumes_as_by_rays),
        cmocka_unit_test(lit_volumes_as_by_rays),
        cmocka_unit_test(order_by_centroids),
        cmocka_unit_test(linear_fields),
        cmocka_unit_test(fog_has_its_depth),
        cmocka_unit_test(pictures_keep_what_they_hold),
        cmocka_unit_test(values_that_are_none),
        cmocka_unit_test(hostile_meshes),
        cmocka_unit_test(rays_in_circles),
        cmocka_unit_test(frames_in_a_row),
        cmocka_unit_test(renderers_side_by_side),
#if TETRALOD_WITH_GL
        cmocka_unit_test(other_contexts),
        cmocka_unit_test(programs_of_lists),
        cmocka_unit_test(contexts_that_are_lost),
        cmocka_unit_test(renderers_outlive_their_context),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
