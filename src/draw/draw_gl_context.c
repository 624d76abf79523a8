/* OpenGL without a window: a context through EGL, or the one that a viewer has made current.
 *
 * A graphics card is asked for before the software renderer. The display is not terminated: another
 * renderer, or a viewer, of the same process may use it. */
#include <epoxy/egl.h>
#include <stdio.h>
#include <string.h>

#include "draw/draw_gl.h"

/* Errors of others that are passed over; a lost context has no end of them. */
enum { STALE_MAX = 16 };
enum { DEVICES_MAX = 16, DISPLAYS_MAX = DEVICES_MAX + 2 };
/* Versions that are asked for, 10 * major + minor: what all is drawn with, and the one of rays. */
enum { GL_LEAST = 33, ES_LEAST = 30, MODERN = 43 };
/* Blocks that shaders of rays have. */
enum { VERTEX_BLOCKS = 3, FRAGMENT_BLOCKS = 3, COMPUTE_BLOCKS = 8 };

/* ---- finding a context ---- */

static bool has_word(const char *words, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = words; at && (at = strstr(at, word)); at += length)
        if ((at == words || at[-1] == ' ') && (at[length] == ' ' || !at[length])) return true;
    return false;
}

/* Devices that are cards first, then Mesa without a screen, then what is the default. */
static int list_displays(EGLDisplay displays[DISPLAYS_MAX])
{
    const char *client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    EGLDeviceEXT devices[DEVICES_MAX];
    EGLint device_count = 0;
    int count = 0;
    if (has_word(client, "EGL_EXT_platform_device") && has_word(client, "EGL_EXT_device_query") &&
        has_word(client, "EGL_EXT_device_enumeration") &&
        !eglQueryDevicesEXT(DEVICES_MAX, devices, &device_count))
        device_count = 0;
    for (EGLint i = 0; i < device_count; i++) {
        const char *words = eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS);
        if (has_word(words, "EGL_MESA_device_software")) continue;
        displays[count++] = eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL);
    }
    if (has_word(client, "EGL_MESA_platform_surfaceless"))
        displays[count++] =
            eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    displays[count++] = eglGetDisplay(EGL_DEFAULT_DISPLAY);
    return count;
}

/* A context of a version on a display, and makes it current. robust: one that tells when it is
 * lost.
 */
static bool make_context(tli_gl *gl, EGLDisplay display, bool es, int version, bool robust)
{
    const EGLint core[] = {EGL_CONTEXT_MAJOR_VERSION,
                           version / 10,
                           EGL_CONTEXT_MINOR_VERSION,
                           version % 10,
                           EGL_CONTEXT_OPENGL_PROFILE_MASK,
                           EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                           robust ? EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY : EGL_NONE,
                           EGL_LOSE_CONTEXT_ON_RESET,
                           EGL_NONE};
    const EGLint embedded[] = {EGL_CONTEXT_MAJOR_VERSION, version / 10,
                               robust ? EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY_EXT
                                      : EGL_NONE,
                               EGL_LOSE_CONTEXT_ON_RESET, EGL_NONE};
    const EGLint wanted[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE,
                             es ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_BIT, EGL_NONE};
    const char *words = eglQueryString(display, EGL_EXTENSIONS);
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLint configs = 0;
    if (!has_word(words, "EGL_KHR_surfaceless_context")) return false;
    if (!has_word(words, "EGL_KHR_no_config_context") &&
        (!eglChooseConfig(display, wanted, &config, 1, &configs) || !configs))
        return false;
    if (!eglBindAPI(es ? EGL_OPENGL_ES_API : EGL_OPENGL_API)) return false;
    EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, es ? embedded : core);
    if (context == EGL_NO_CONTEXT) return false;
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        eglDestroyContext(display, context);
        return false;
    }
    gl->display = display;
    gl->context = context;
    return true;
}

static tl_status find_context(tl_ctx *ctx, tli_gl *gl, tli_gl_kind kind)
{
    EGLDisplay displays[DISPLAYS_MAX];
    int count = list_displays(displays);
    for (int i = 0; i < count; i++) {
        if (displays[i] == EGL_NO_DISPLAY || !eglInitialize(displays[i], NULL, NULL)) continue;
        for (int way = kind == TLI_GL_ANY ? 0 : 2; way < 3; way++) {
            static const int versions[] = {MODERN, GL_LEAST, ES_LEAST};
            if (make_context(gl, displays[i], way == 2, versions[way], true) ||
                make_context(gl, displays[i], way == 2, versions[way], false))
                return TL_OK;
        }
    }
    return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                   "no OpenGL: EGL has no display with %s, of %d that were tried",
                   kind == TLI_GL_ES ? "OpenGL ES 3.0" : "OpenGL 3.3 or OpenGL ES 3.0", count);
}

/* ---- what the context can do ---- */

static void GLAPIENTRY note_message(GLenum source, GLenum type, GLuint id, GLenum severity,
                                    GLsizei length, const GLchar *text, const void *user)
{
    tli_gl *gl = (tli_gl *)(uintptr_t)user;
    (void)source, (void)id, (void)severity, (void)length;
    if (type == GL_DEBUG_TYPE_ERROR && !gl->message[0])
        snprintf(gl->message, sizeof gl->message, "%s", text);
}

static bool is_software(const char *renderer)
{
    static const char *const names[] = {"llvmpipe", "softpipe", "swrast", "SwiftShader",
                                        "Software"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strstr(renderer, names[i])) return true;
    return false;
}

/* Rays take compute shaders, buffers in all kinds of shaders, and numbers of 64 bits. */
static bool is_modern(tli_gl *gl)
{
    GLint blocks[3] = {0, 0, 0};
    GLint64 bytes = 0;
    if (gl->es || epoxy_gl_version() < MODERN) return false;
    glGetIntegerv(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, &blocks[0]);
    glGetIntegerv(GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS, &blocks[1]);
    glGetIntegerv(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &blocks[2]);
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &bytes);
    gl->block_max = bytes > 0 ? (size_t)bytes : 0;
    return blocks[0] >= VERTEX_BLOCKS && blocks[1] >= FRAGMENT_BLOCKS &&
           blocks[2] >= COMPUTE_BLOCKS;
}

static tl_status look_at_context(tl_ctx *ctx, tli_gl *gl)
{
    gl->es = !epoxy_is_desktop_gl();
    int version = epoxy_gl_version();
    if (version < (gl->es ? ES_LEAST : GL_LEAST))
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "OpenGL%s %d.%d, expected %d.%d at least",
                       gl->es ? " ES" : "", version / 10, version % 10,
                       (gl->es ? ES_LEAST : GL_LEAST) / 10, (gl->es ? ES_LEAST : GL_LEAST) % 10);
    if (gl->es && (!epoxy_has_gl_extension("GL_EXT_color_buffer_float") ||
                   !epoxy_has_gl_extension("GL_EXT_float_blend")))
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "this OpenGL ES does not blend pictures of 32-bit floats");
    const char *renderer = (const char *)glGetString(GL_RENDERER);
    snprintf(gl->name, sizeof gl->name, "gl: %s", renderer ? renderer : "of no name");
    gl->software = is_software(gl->name);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &gl->side_max);
    gl->modern = is_modern(gl);
    gl->tells_resets = gl->es ? epoxy_gl_version() >= 32 : epoxy_gl_version() >= 45;
    glGenVertexArrays(1, &gl->nothing);
    return TL_OK;
}

/* ---- making it current ---- */

static void keep_current(tli_gl *gl)
{
    gl->kept[0] = eglGetCurrentDisplay();
    gl->kept[1] = eglGetCurrentContext();
    gl->kept[2] = eglGetCurrentSurface(EGL_DRAW);
    gl->kept[3] = eglGetCurrentSurface(EGL_READ);
}

static void put_back(tli_gl *gl)
{
    if (!gl->context) return;
    if (gl->kept[1] != EGL_NO_CONTEXT)
        eglMakeCurrent(gl->kept[0], gl->kept[2], gl->kept[3], gl->kept[1]);
    else
        eglMakeCurrent(gl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

static void set_hook(tli_gl *gl, bool on)
{
    bool has = gl->es ? epoxy_gl_version() >= 32 || epoxy_has_gl_extension("GL_KHR_debug")
                      : epoxy_gl_version() >= 43 || epoxy_has_gl_extension("GL_KHR_debug");
    if (!has || !gl->context) return; /* the hook of a viewer stays */
    if (on) glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(on ? note_message : NULL, gl);
}

/* The context is gone for good: nothing is asked of it any more. */
static tl_status lose(tl_ctx *ctx, tli_gl *gl)
{
    gl->lost = true;
    return tl_fail(ctx, TL_ERR_IO, "%s: the context is lost", gl->name);
}

static tl_status make_current(tl_ctx *ctx, tli_gl *gl)
{
    if (gl->lost) return lose(ctx, gl);
    if (!gl->context)
        return eglGetCurrentContext() != EGL_NO_CONTEXT
                   ? TL_OK
                   : tl_fail(ctx, TL_ERR_ARG, "%s: no context of EGL is current on this thread",
                             gl->name);
    keep_current(gl);
    if (eglMakeCurrent(gl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, gl->context)) return TL_OK;
    EGLint error = eglGetError();
    if (error == EGL_CONTEXT_LOST || error == EGL_BAD_CONTEXT || error == EGL_NOT_INITIALIZED)
        return lose(ctx, gl);
    return tl_fail(ctx, TL_ERR_UNSUPPORTED, "%s: the context can't be made current (EGL 0x%04x)",
                   gl->name, (unsigned)error);
}

tl_status tli_gl_begin(tl_ctx *ctx, tli_gl *gl)
{
    tl_status st = make_current(ctx, gl);
    if (st) return st;
    GLenum error = glGetError(); /* of others */
    for (int i = 0; i < STALE_MAX && error && error != GL_CONTEXT_LOST; i++) error = glGetError();
    if (error == GL_CONTEXT_LOST) {
        put_back(gl);
        return lose(ctx, gl);
    }
    glGetIntegerv(GL_FRAMEBUFFER_BINDING, &gl->kept_target);
    glGetIntegerv(GL_VIEWPORT, gl->kept_view);
    gl->message[0] = 0;
    glBindVertexArray(gl->nothing);
    return TL_OK;
}

static tl_status status_of(tl_ctx *ctx, tli_gl *gl, GLenum error)
{
    switch (error) {
    case GL_NO_ERROR: return TL_OK;
    case GL_OUT_OF_MEMORY: return tl_fail(ctx, TL_ERR_MEMORY, "%s is out of memory", gl->name);
    case GL_CONTEXT_LOST: return lose(ctx, gl);
    default:
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "%s reports error 0x%04x%s%s", gl->name, error,
                       gl->message[0] ? ": " : "", gl->message);
    }
}

tl_status tli_gl_check(tl_ctx *ctx, tli_gl *gl)
{
    GLenum error = glGetError();
    if (gl->tells_resets && glGetGraphicsResetStatus() != GL_NO_ERROR) error = GL_CONTEXT_LOST;
    tl_status st = status_of(ctx, gl, error);
    for (int i = 0; i < STALE_MAX && error; i++) error = glGetError();
    gl->message[0] = 0;
    return st;
}

/* As in a new context, for the viewer whose context it is. */
static void reset_state(const tli_gl *gl)
{
    glUseProgram(0);
    glBindVertexArray(0);
    for (GLuint unit = TLI_GL_UNITS; unit-- > 0;) {
        glActiveTexture(GL_TEXTURE0 + unit);
        glBindTexture(GL_TEXTURE_2D, 0);
    }
    for (GLuint binding = 0; gl->modern && binding < COMPUTE_BLOCKS; binding++)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, 0);
    if (gl->modern) glBindImageTexture(0, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_R8);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glBlendFunc(GL_ONE, GL_ZERO);
    glDepthFunc(GL_LESS);
    glCullFace(GL_BACK);
}

tl_status tli_gl_end(tl_ctx *ctx, tli_gl *gl, tl_status status)
{
    if (!status) status = tli_gl_check(ctx, gl);
    reset_state(gl);
    glBindFramebuffer(GL_FRAMEBUFFER, (GLuint)gl->kept_target);
    glViewport(gl->kept_view[0], gl->kept_view[1], gl->kept_view[2], gl->kept_view[3]);
    put_back(gl);
    return status;
}

tl_status tli_gl_open(tl_ctx *ctx, tli_gl_kind kind, tli_gl **gl)
{
    tl_status st = TL_OK;
    *gl = NULL;
    tli_gl *g = tl_mem_zalloc(ctx, 1, sizeof *g, &st);
    if (st) return st;
    snprintf(g->name, sizeof g->name, "gl");
    if (kind == TLI_GL_CURRENT) {
        st = tli_gl_begin(ctx, g);
        if (!st) st = tli_gl_end(ctx, g, look_at_context(ctx, g));
    } else {
        keep_current(g);
        st = find_context(ctx, g, kind);
        if (!st) st = look_at_context(ctx, g);
        if (!st) set_hook(g, true);
        put_back(g);
    }
    if (st)
        tli_gl_close(ctx, g);
    else
        *gl = g;
    return st;
}

void tli_gl_close(tl_ctx *ctx, tli_gl *gl)
{
    if (!gl) return;
    if (gl->context)
        eglDestroyContext(gl->display, gl->context);
    else if (gl->nothing && eglGetCurrentContext() != EGL_NO_CONTEXT)
        glDeleteVertexArrays(1, &gl->nothing);
    tl_mem_free(ctx, gl);
}
