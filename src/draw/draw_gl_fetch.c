/* Between pictures in memory and in OpenGL: depths there, colours and depths back. In floats they
 * are put in front of what the picture holds; in 8 bits they leave OpenGL as they are shown. */
#include <math.h>
#include <string.h>

#include "draw/draw_gl.h"

/* Rows of a picture that are sent or read at once. */
enum { BAND_ROWS = 64 };

/* ---- there ---- */

static bool is_empty(const tl_image *image)
{
    const size_t count = (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++)
        if (image->depth[i] < INFINITY) return false;
    return true;
}

static void clear_depth(const tli_gl_target *target)
{
    static const float farthest[4] = {TLI_GL_FARTHEST, 0, 0, 1};
    tli_gl_target_use(target);
    glClearBufferfv(GL_COLOR, 1, farthest);
}

tl_status tli_gl_send_depth(tl_ctx *ctx, tli_gl_state *s, const tl_image *image, double unit)
{
    tl_status st = TL_OK;
    if (!image || is_empty(image)) {
        clear_depth(&s->before);
        clear_depth(&s->opaque);
        return TL_OK;
    }
    size_t width = image->width;
    float *rows = tl_mem_alloc(ctx, width * BAND_ROWS, sizeof *rows, &st);
    for (uint32_t done = 0; done < image->height && !st; done += BAND_ROWS) {
        uint32_t count = image->height - done < BAND_ROWS ? image->height - done : BAND_ROWS;
        for (uint32_t row = 0; row < count; row++)
            for (size_t x = 0; x < width; x++) {
                double z = (double)image->depth[(image->height - 1 - done - row) * width + x];
                rows[row * width + x] =
                    (float)fmin(fmax(z / unit, (double)TLI_GL_NEAREST), (double)TLI_GL_FARTHEST);
            }
        tli_gl_target_send_depth(&s->before, done, count, rows);
        tli_gl_target_send_depth(&s->opaque, done, count, rows);
    }
    tl_mem_free(ctx, rows);
    return st;
}

/* ---- back, in floats ---- */

/* Puts rows [count] from row first below upwards, as they were read, into the picture. */
static void keep_rows(tl_image *image, double unit, uint32_t first, uint32_t count,
                      const float *colors, const float *depths)
{
    size_t width = image->width;
    for (uint32_t row = 0; row < count; row++)
        for (size_t x = 0; x < width; x++) {
            size_t to = (image->height - 1 - first - row) * width + x, from = row * width + x;
            float left = 1 - colors[4 * from + 3], z = depths[from];
            for (size_t k = 0; k < 4; k++)
                image->rgba[4 * to + k] = colors[4 * from + k] + left * image->rgba[4 * to + k];
            if (z < TLI_GL_FARTHEST)
                image->depth[to] = fminf(image->depth[to], (float)((double)z * unit));
        }
}

tl_status tli_gl_fetch(tl_ctx *ctx, const tli_gl_state *s, const tli_gl_target *drawn, double unit,
                       tl_image *image)
{
    tl_status st = TL_OK;
    size_t width = image->width;
    float *colors = tl_mem_alloc(ctx, width * BAND_ROWS, 4 * sizeof *colors, &st);
    float *depths = tl_mem_alloc(ctx, width * BAND_ROWS, sizeof *depths, &st);
    float *numbers =
        s->gl->es ? tl_mem_alloc(ctx, width * BAND_ROWS, 4 * sizeof *numbers, &st) : NULL;
    for (uint32_t done = 0; done < image->height && !st; done += BAND_ROWS) {
        uint32_t count = image->height - done < BAND_ROWS ? image->height - done : BAND_ROWS;
        tli_gl_target_read(drawn, GL_FLOAT, done, count, colors);
        tli_gl_target_read_depth(s->gl, &s->opaque, done, count, depths, numbers);
        keep_rows(image, unit, done, count, colors, depths);
    }
    tl_mem_free(ctx, numbers);
    tl_mem_free(ctx, depths);
    tl_mem_free(ctx, colors);
    return st;
}

/* ---- back, in bytes ---- */

/* Puts rows of some bytes into the opposite order. */
static tl_status turn_rows(tl_ctx *ctx, void *rows, uint32_t row_count, size_t row_bytes)
{
    tl_status st = TL_OK;
    char *kept = tl_mem_alloc(ctx, row_bytes, 1, &st), *at = rows;
    for (uint32_t i = 0; i < row_count / 2 && !st; i++) {
        char *low = at + i * row_bytes, *high = at + (row_count - 1 - i) * row_bytes;
        memcpy(kept, low, row_bytes);
        memcpy(low, high, row_bytes);
        memcpy(high, kept, row_bytes);
    }
    tl_mem_free(ctx, kept);
    return st;
}

/* Rows from below upwards. OpenGL ES reads floats from pictures of floats alone. */
static tl_status read_bytes(tl_ctx *ctx, const tli_gl *gl, const tli_gl_target *drawn,
                            uint8_t *rgba)
{
    tl_status st = TL_OK;
    const size_t width = drawn->width;
    if (!gl->es) {
        tli_gl_target_read(drawn, GL_UNSIGNED_BYTE, 0, drawn->height, rgba);
        return TL_OK;
    }
    float *rows = tl_mem_alloc(ctx, width * BAND_ROWS, 4 * sizeof *rows, &st);
    for (uint32_t done = 0; done < drawn->height && !st; done += BAND_ROWS) {
        uint32_t count = drawn->height - done < BAND_ROWS ? drawn->height - done : BAND_ROWS;
        tli_gl_target_read(drawn, GL_FLOAT, done, count, rows);
        tli_pixels_pack(rows, width * count, NULL, rgba + 4 * width * done);
    }
    tl_mem_free(ctx, rows);
    return st;
}

static tl_status read_depth(tl_ctx *ctx, const tli_gl_state *s, double unit, float *depth)
{
    tl_status st = TL_OK;
    const size_t count = (size_t)s->opaque.width * s->opaque.height;
    float *numbers = s->gl->es ? tl_mem_alloc(ctx, count, 4 * sizeof *numbers, &st) : NULL;
    if (st) return st;
    tli_gl_target_read_depth(s->gl, &s->opaque, 0, s->opaque.height, depth, numbers);
    for (size_t i = 0; i < count; i++)
        depth[i] = depth[i] < TLI_GL_FARTHEST ? (float)((double)depth[i] * unit) : INFINITY;
    tl_mem_free(ctx, numbers);
    return turn_rows(ctx, depth, s->opaque.height, s->opaque.width * sizeof *depth);
}

tl_status tli_gl_fetch_bytes(tl_ctx *ctx, const tli_gl_state *s, const tli_gl_target *drawn,
                             double unit, uint8_t *rgba, float *depth)
{
    tl_status st = read_bytes(ctx, s->gl, drawn, rgba);
    if (!st) st = turn_rows(ctx, rgba, drawn->height, 4 * (size_t)drawn->width);
    return st || !depth ? st : read_depth(ctx, s, unit, depth);
}
