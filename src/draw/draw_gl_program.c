/* Shaders: compiled behind the head of the language that the context has. */
#include <string.h>

#include "draw/draw_gl.h"
#include "draw/draw_shaders.h"

enum { LOG_BYTES = 400 };

static const char DESKTOP[] = "#version 330 core\n";
static const char EMBEDDED[] = "#version 300 es\n"
                               "precision highp float;\n"
                               "precision highp int;\n"
                               "precision highp sampler2D;\n"
                               "precision highp usampler2D;\n";

static tl_status compile(tl_ctx *ctx, const tli_gl *gl, const tli_gl_source *source, GLenum kind,
                         GLuint *shader)
{
    bool is_vertex = kind == GL_VERTEX_SHADER;
    const char *const parts[] = {gl->es ? EMBEDDED : DESKTOP, tli_shader_common,
                                 is_vertex ? "" : source->shared,
                                 is_vertex ? source->vertex : source->fragment};
    GLint done = 0;
    *shader = glCreateShader(kind);
    glShaderSource(*shader, sizeof parts / sizeof *parts, parts, NULL);
    glCompileShader(*shader);
    glGetShaderiv(*shader, GL_COMPILE_STATUS, &done);
    if (done) return TL_OK;
    char log[LOG_BYTES] = "";
    glGetShaderInfoLog(*shader, sizeof log, NULL, log);
    log[strcspn(log, "\n")] = 0;
    return tl_fail(ctx, TL_ERR_UNSUPPORTED, "%s can't compile the %s shader of %s: %s", gl->name,
                   is_vertex ? "vertex" : "fragment", source->name, log);
}

tl_status tli_gl_program(tl_ctx *ctx, const tli_gl *gl, const tli_gl_source *source,
                         GLuint *program)
{
    GLuint shaders[2] = {0, 0}, made = glCreateProgram();
    GLint done = 0;
    *program = 0;
    tl_status st = compile(ctx, gl, source, GL_VERTEX_SHADER, &shaders[0]);
    if (!st) st = compile(ctx, gl, source, GL_FRAGMENT_SHADER, &shaders[1]);
    for (int i = 0; i < 2 && !st; i++) glAttachShader(made, shaders[i]);
    if (!st) {
        glLinkProgram(made);
        glGetProgramiv(made, GL_LINK_STATUS, &done);
    }
    if (!st && !done) {
        char log[LOG_BYTES] = "";
        glGetProgramInfoLog(made, sizeof log, NULL, log);
        log[strcspn(log, "\n")] = 0;
        st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "%s can't link the shaders of %s: %s", gl->name,
                     source->name, log);
    }
    for (int i = 0; i < 2; i++)
        if (shaders[i]) glDeleteShader(shaders[i]);
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
