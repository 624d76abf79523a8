/* Textures: tables of numbers that shaders fetch from, and pictures that are drawn into. */
#include "draw/draw_gl.h"

/* ---- tables ---- */

typedef struct layout {
    GLenum format, type;
    size_t bytes; /* of an item */
} layout;

static layout layout_of(GLenum format)
{
    switch (format) {
    case GL_RGBA32F: return (layout){GL_RGBA, GL_FLOAT, 16};
    case GL_RGBA32UI: return (layout){GL_RGBA_INTEGER, GL_UNSIGNED_INT, 16};
    case GL_R32UI: return (layout){GL_RED_INTEGER, GL_UNSIGNED_INT, 4};
    default: TL_ASSERT(format == GL_R32F); return (layout){GL_RED, GL_FLOAT, 4};
    }
}

static void set_nearest(void)
{
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

tl_status tli_gl_table_fill(tl_ctx *ctx, tli_gl *gl, tli_gl_table *table, GLenum format,
                            const void *items, size_t item_count)
{
    layout as = layout_of(format);
    size_t full = item_count / TLI_GL_COLUMNS, rest = item_count % TLI_GL_COLUMNS;
    size_t rows = full + (rest > 0);
    rows = rows ? rows : 1;
    if (gl->side_max < TLI_GL_COLUMNS || rows > (size_t)gl->side_max)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "%s: a table of %zu items, textures of %d x %d hold fewer", gl->name,
                       item_count, TLI_GL_COLUMNS, gl->side_max);
    if (!table->texture) glGenTextures(1, &table->texture);
    glBindTexture(GL_TEXTURE_2D, table->texture);
    if (rows * TLI_GL_COLUMNS * as.bytes > table->bytes) {
        set_nearest();
        glTexImage2D(GL_TEXTURE_2D, 0, (GLint)format, TLI_GL_COLUMNS, (GLsizei)rows, 0, as.format,
                     as.type, NULL);
        gl->bytes += rows * TLI_GL_COLUMNS * as.bytes - table->bytes;
        table->bytes = rows * TLI_GL_COLUMNS * as.bytes;
    }
    if (full)
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, TLI_GL_COLUMNS, (GLsizei)full, as.format, as.type,
                        items);
    if (rest)
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, (GLint)full, (GLsizei)rest, 1, as.format, as.type,
                        (const char *)items + full * TLI_GL_COLUMNS * as.bytes);
    return TL_OK;
}

void tli_gl_table_free(tli_gl *gl, tli_gl_table *table)
{
    if (table->texture) glDeleteTextures(1, &table->texture);
    gl->bytes -= table->bytes;
    *table = (tli_gl_table){0};
}

/* ---- buffers ---- */

tl_status tli_gl_buffer_fill(tl_ctx *ctx, tli_gl *gl, tli_gl_buffer *buffer, const void *items,
                             size_t item_count, size_t item_bytes)
{
    size_t bytes = item_count > 0 ? item_count * item_bytes : item_bytes;
    if (item_count > gl->block_max / item_bytes)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "%s: a buffer of %zu items of %zu bytes, shaders see %zu bytes of one",
                       gl->name, item_count, item_bytes, gl->block_max);
    if (!buffer->name) glGenBuffers(1, &buffer->name);
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffer->name);
    if (bytes > buffer->bytes) {
        glBufferData(GL_SHADER_STORAGE_BUFFER, (GLsizeiptr)bytes, NULL, GL_DYNAMIC_DRAW);
        gl->bytes += bytes - buffer->bytes;
        buffer->bytes = bytes;
    }
    if (items && item_count) glBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, (GLsizeiptr)bytes, items);
    return TL_OK;
}

void tli_gl_buffer_free(tli_gl *gl, tli_gl_buffer *buffer)
{
    glDeleteBuffers(1, &buffer->name);
    gl->bytes -= buffer->bytes;
    *buffer = (tli_gl_buffer){0};
}

void tli_gl_buffer_bind(const tli_gl_buffer *buffer, GLuint binding)
{
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer->name);
}

/* ---- pictures ---- */

static GLuint make_sheet(GLenum format, uint32_t width, uint32_t height)
{
    GLuint texture = 0;
    layout as = layout_of(format);
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    set_nearest();
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)format, (GLsizei)width, (GLsizei)height, 0, as.format,
                 as.type, NULL);
    return texture;
}

/* Makes what target is to have, with its frame bound. */
static void make_parts(tli_gl_target *target, int parts)
{
    static const GLenum places[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    uint32_t width = target->width, height = target->height;
    size_t pixels = (size_t)width * height;
    if (parts & TLI_GL_COLOR) {
        target->color = make_sheet(GL_RGBA32F, width, height);
        glFramebufferTexture2D(GL_FRAMEBUFFER, places[0], GL_TEXTURE_2D, target->color, 0);
        target->bytes += layout_of(GL_RGBA32F).bytes * pixels;
    }
    if (parts & TLI_GL_DEPTH) {
        target->depth = make_sheet(GL_R32F, width, height);
        glFramebufferTexture2D(GL_FRAMEBUFFER, places[1], GL_TEXTURE_2D, target->depth, 0);
        target->bytes += layout_of(GL_R32F).bytes * pixels;
    }
    if (parts == (TLI_GL_COLOR | TLI_GL_DEPTH)) {
        glGenRenderbuffers(1, &target->order);
        glBindRenderbuffer(GL_RENDERBUFFER, target->order);
        glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, (GLsizei)width,
                              (GLsizei)height);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                                  target->order);
        target->bytes += sizeof(float) * pixels;
    }
    const GLenum drawn[] = {target->color ? places[0] : GL_NONE,
                            target->depth ? places[1] : GL_NONE};
    glDrawBuffers(2, drawn);
}

tl_status tli_gl_target_set(tl_ctx *ctx, tli_gl *gl, tli_gl_target *target, uint32_t width,
                            uint32_t height, int parts)
{
    if (target->frame && target->width == width && target->height == height) return TL_OK;
    tli_gl_target_free(gl, target);
    if (width > (uint32_t)gl->side_max || height > (uint32_t)gl->side_max)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "%s draws pictures of at most %d x %d pixels",
                       gl->name, gl->side_max, gl->side_max);
    *target = (tli_gl_target){.width = width, .height = height};
    glGenFramebuffers(1, &target->frame);
    glBindFramebuffer(GL_FRAMEBUFFER, target->frame);
    make_parts(target, parts);
    gl->bytes += target->bytes;
    GLenum state = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    tl_status st = tli_gl_check(ctx, gl);
    if (!st && state != GL_FRAMEBUFFER_COMPLETE)
        st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "%s can't draw into a picture of floats (0x%04x)",
                     gl->name, state);
    if (st) tli_gl_target_free(gl, target);
    return st;
}

void tli_gl_target_use(const tli_gl_target *target)
{
    glBindFramebuffer(GL_FRAMEBUFFER, target->frame);
    glViewport(0, 0, (GLsizei)target->width, (GLsizei)target->height);
}

void tli_gl_target_send_depth(const tli_gl_target *target, uint32_t row, uint32_t row_count,
                              const float *depths)
{
    glBindTexture(GL_TEXTURE_2D, target->depth);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, (GLint)row, (GLsizei)target->width, (GLsizei)row_count,
                    GL_RED, GL_FLOAT, depths);
}

void tli_gl_target_read(const tli_gl_target *target, GLenum type, uint32_t row, uint32_t row_count,
                        void *values)
{
    glBindFramebuffer(GL_FRAMEBUFFER, target->frame);
    glReadBuffer(GL_COLOR_ATTACHMENT0);
    glReadPixels(0, (GLint)row, (GLsizei)target->width, (GLsizei)row_count, GL_RGBA, type, values);
}

void tli_gl_target_read_depth(const tli_gl *gl, const tli_gl_target *target, uint32_t row,
                              uint32_t row_count, float *depths, float *numbers)
{
    size_t count = (size_t)target->width * row_count;
    glBindFramebuffer(GL_FRAMEBUFFER, target->frame);
    glReadBuffer(GL_COLOR_ATTACHMENT1);
    glReadPixels(0, (GLint)row, (GLsizei)target->width, (GLsizei)row_count,
                 gl->es ? GL_RGBA : GL_RED, GL_FLOAT, gl->es ? numbers : depths);
    for (size_t i = 0; gl->es && i < count; i++) depths[i] = numbers[4 * i];
}

void tli_gl_target_free(tli_gl *gl, tli_gl_target *target)
{
    glDeleteFramebuffers(1, &target->frame);
    glDeleteTextures(1, &target->color);
    glDeleteTextures(1, &target->depth);
    glDeleteRenderbuffers(1, &target->order);
    gl->bytes -= target->bytes;
    *target = (tli_gl_target){0};
}
