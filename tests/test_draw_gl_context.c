/* Contexts of OpenGL: desktop and ES, one of the caller, none at all, one too old, one that is
 * lost; frames in a row. Skips where there is no OpenGL. */
#include "check_gl.h"

#include <sys/wait.h>
#include <unistd.h>

#if TETRALOD_WITH_GL
#include "draw/draw_gl.h"
#endif

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
            tl_ctx_cancel(ctx, true); /* the next one is as if this one had not been begun */
            CHECK_STATUS(tl_renderer_draw_bytes(ctx, r, &camera, sky, bytes, depth),
                         TL_ERR_CANCELLED);
            tl_ctx_cancel(ctx, false);
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

/* The picture of one item by a back end that was opened; in 8 bits it is the same. */
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
    size_t count = (size_t)image->width * image->height;
    uint8_t *bytes = malloc(4 * count);
    float *depth = malloc(count * sizeof *depth);
    if (!bytes || !depth) abort();
    CHECK_OK(ctx, tli_backend_gl.draw_bytes(ctx, gl, items, 1, camera, NULL, bytes, depth));
    for (size_t i = 0; i < 4 * count; i++)
        CHECK_NEAR((double)image->rgba[i], bytes[i] / 255.0, 0.51 / 255);
    CHECK(memcmp(depth, image->depth, count * sizeof *depth) == 0);
    free(depth);
    free(bytes);
    tli_backend_gl.remove(ctx, gl, &item);
    return image;
}

/* What a frame leaves to a viewer is as in a new context. */
static void check_new_state(const tli_gl *gl)
{
    static const GLenum names[] = {GL_CURRENT_PROGRAM, GL_VERTEX_ARRAY_BINDING, GL_BLEND,
                                   GL_DEPTH_TEST, GL_CULL_FACE};
    GLint value = 0;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        glGetIntegerv(names[i], &value);
        CHECK_EQ(value, 0);
    }
    glGetIntegerv(GL_DEPTH_FUNC, &value);
    CHECK_EQ(value, GL_LESS);
    for (GLuint unit = TLI_GL_UNITS; unit-- > 0;) {
        glActiveTexture(GL_TEXTURE0 + unit);
        glGetIntegerv(GL_TEXTURE_BINDING_2D, &value);
        CHECK_EQ(value, 0);
    }
    for (GLuint binding = 0; gl->modern && binding < 8; binding++) {
        glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, binding, &value);
        CHECK_EQ(value, 0);
    }
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
    check_new_state(host);
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

/* Bands of rays that were begun, and after which of them somebody cancels. */
static PFNGLDISPATCHCOMPUTEPROC true_dispatch;
static size_t bands, last_band;
static tl_ctx *cancelled;
static void count_bands(GLuint x, GLuint y, GLuint z)
{
    if (y > 1 && ++bands == last_band) tl_ctx_cancel(cancelled, true);
    true_dispatch(x, y, z);
}

/* A picture of BANDS bands is that of the processor; cancelled in the middle it ends after the band
 * that is begun, and the next one is as if it had not been. */
enum { BANDS = 4 };
static void check_bands(tl_ctx *ctx, const scene *drawn)
{
    static const double bounds[6] = {0, 1, 0, 1, 0, 1};
    const tl_camera camera = tl_camera_fit(bounds, 30, 25, 1.3, 320, 700);
    tl_image *expected = draw_scene(ctx, TL_RENDERER_CPU, drawn, &camera), *image = NULL;
    tl_renderer *r = open_renderer(ctx, TL_RENDERER_GL);
    fill(ctx, r, drawn);
    tl_image_destroy(ctx, picture_take(ctx, r, &camera)); /* room for lists is known then */
    true_dispatch = epoxy_glDispatchCompute;
    epoxy_glDispatchCompute = count_bands;
    cancelled = ctx;
    for (last_band = 1; last_band < BANDS; last_band++) {
        bands = 0;
        CHECK_STATUS(picture_try(ctx, r, &camera), TL_ERR_CANCELLED);
        CHECK_EQ(bands, last_band);
        tl_ctx_cancel(ctx, false);
        tl_ctx_clear(ctx);
    }
    bands = last_band = 0;
    image = picture_take(ctx, r, &camera);
    CHECK_EQ(bands, BANDS);
    epoxy_glDispatchCompute = true_dispatch;
    printf("%d bands of rays: %.1f dB, %g expected\n", BANDS, psnr(expected, image), ALIKE_RAYS);
    CHECK(psnr(expected, image) >= ALIKE_RAYS);
    tl_image_destroy(ctx, image);
    tl_image_destroy(ctx, expected);
    tl_renderer_destroy(ctx, r);
}

static void rays_are_cancelled(void **state)
{
    (void)state;
    tl_ctx *ctx;
    if (!begin(&ctx)) CHECK_SKIP("there is no OpenGL");
    make_mesh m = perturbed(9, true);
    solid s = open_solid(ctx, &m, hills);
    tl_transfer *t = colored(ctx, false);
    tl_volume_opts opts = tl_volume_opts_defaults();
    opts.method = TL_VOLUME_RAYS;
    const scene drawn = {.mesh = s.mesh,
                         .scalar = s.scalar,
                         .volume = s.volume,
                         .transfer = t,
                         .volume_opts = &opts};
    const bool rays = has_rays(ctx, &drawn);
    if (rays) check_bands(ctx, &drawn);
    tl_transfer_destroy(ctx, t);
    close_solid(ctx, &s);
    check_ctx_destroy(ctx);
    if (!rays) CHECK_SKIP("OpenGL is older than 4.3");
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
        cmocka_unit_test(frames_in_a_row),
        cmocka_unit_test(renderers_side_by_side),
#if TETRALOD_WITH_GL
        cmocka_unit_test(other_contexts),
        cmocka_unit_test(programs_of_lists),
        cmocka_unit_test(rays_are_cancelled),
        cmocka_unit_test(contexts_that_are_lost),
        cmocka_unit_test(renderers_outlive_their_context),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
