/* Shaders: compiled behind the head of the language that the context has. */
#include <string.h>

#include "draw/draw_gl.h"
#include "draw/draw_shaders.h"

enum { LOG_BYTES = 400 };

static const char DESKTOP[] = "#version 330 core\n";
static const char MODERN[] = "#version 430 core\n";
static const char EMBEDDED[] = "#version 300 es\n"
                               "precision highp float;\n"
                               "precision highp int;\n"
                               "precision highp sampler2D;\n"
                               "precision highp usampler2D;\n";

static const GLenum STAGES[TLI_GL_STAGES] = {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER,
                                             GL_COMPUTE_SHADER};

/* The first line of a log that tells why name failed. */
static tl_status refuse(tl_ctx *ctx, const tli_gl *gl, const char *verb, const char *name,
                        char *log)
{
    log[strcspn(log, "\n")] = 0;
    return tl_fail(ctx, TL_ERR_UNSUPPORTED, "%s can't %s the shaders of %s: %s", gl->name, verb,
                   name, log);
}

static tl_status compile(tl_ctx *ctx, const tli_gl *gl, const tli_gl_source *source, int stage,
                         GLuint program)
{
    const char *parts[2 + TLI_GL_PARTS] = {gl->es           ? EMBEDDED
                                           : source->modern ? MODERN
                                                            : DESKTOP,
                                           tli_shader_common};
    GLint done = 0, count = 2;
    for (int i = 0; i < TLI_GL_PARTS && source->text[stage][i]; i++)
        parts[count++] = source->text[stage][i];
    GLuint shader = glCreateShader(STAGES[stage]);
    glShaderSource(shader, count, parts, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &done);
    char log[LOG_BYTES] = "";
    if (done)
        glAttachShader(program, shader);
    else
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
    glDeleteShader(shader); /* goes with its program */
    return done ? TL_OK : refuse(ctx, gl, "compile", source->name, log);
}

tl_status tli_gl_program(tl_ctx *ctx, const tli_gl *gl, const tli_gl_source *source,
                         GLuint *program)
{
    tl_status st = TL_OK;
    GLuint made = glCreateProgram();
    GLint done = 0;
    *program = 0;
    for (int stage = 0; stage < TLI_GL_STAGES && !st; stage++)
        if (source->text[stage][0]) st = compile(ctx, gl, source, stage, made);
    if (!st) {
        glLinkProgram(made);
        glGetProgramiv(made, GL_LINK_STATUS, &done);
    }
    if (!st && !done) {
        char log[LOG_BYTES] = "";
        glGetProgramInfoLog(made, sizeof log, NULL, log);
        st = refuse(ctx, gl, "link", source->name, log);
    }
    if (st)
        glDeleteProgram(made);
    else
        *program = made;
    return st;
}

void tli_gl_set_int(GLuint program, const char *name, GLint value)
{
    glUniform1i(glGetUniformLocation(program, name), value);
}

void tli_gl_set_float(GLuint program, const char *name, double value)
{
    glUniform1f(glGetUniformLocation(program, name), (GLfloat)value);
}

void tli_gl_set_vec2(GLuint program, const char *name, double x, double y)
{
    glUniform2f(glGetUniformLocation(program, name), (GLfloat)x, (GLfloat)y);
}

void tli_gl_set_texture(GLuint program, const char *name, GLuint unit, GLuint texture)
{
    TL_ASSERT(unit < TLI_GL_UNITS);
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, texture);
    tli_gl_set_int(program, name, (GLint)unit);
}

void tli_gl_set_view(GLuint program, const tli_gl_view *view)
{
    const tli_frame *f = view->frame;
    double half[2] = {view->width / 2.0, view->height / 2.0};
    tli_gl_set_int(program, "parallel", f->parallel);
    tli_gl_set_vec2(program, "half_size", half[0], half[1]);
    tli_gl_set_vec2(program, "aside", f->middle[0] - half[0], half[1] - f->middle[1]);
    tli_gl_set_vec2(program, "pixel_middle", f->middle[0], view->height - f->middle[1]);
    tli_gl_set_float(program, "scale", f->scale);
    tli_gl_set_float(program, "unit", f->unit);
    tli_gl_set_vec2(program, "depth_range", view->depths[0], view->depths[1]);
}
