/* PNG, 8 bits a channel, through libpng. */
#include <math.h>

#include "base/base_file.h"
#include "draw/draw.h"

#if TETRALOD_WITH_PNG

#include <png.h>

/* Strong compression takes many times as long for some percent. */
enum { ZLIB_LEVEL = 6 };

typedef struct writer {
    tl_ctx *ctx;
    tli_sink *sink;
    tl_status st;
    png_structp png;
    png_infop info;
    uint8_t *row;
    bool opaque;
} writer;

static void put(png_structp png, png_bytep bytes, png_size_t count)
{
    writer *w = png_get_io_ptr(png);
    if (!w->st) w->st = tli_sink_write(w->sink, bytes, count);
    if (w->st) png_error(png, "write");
}

static void flush(png_structp png)
{
    (void)png;
}

/* Does not return, as libpng wants it; the message of a failed write is out already. */
static void fail(png_structp png, png_const_charp text)
{
    writer *w = png_get_error_ptr(png);
    if (!w->st) w->st = tl_fail(w->ctx, TL_ERR_MEMORY, "PNG: %s", text);
    png_longjmp(png, 1);
}

static void ignore(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

static uint8_t to_byte(double value)
{
    return (uint8_t)(value <= 0 || isnan(value) ? 0 : value >= 1 ? 255 : value * 255 + 0.5);
}

static void fill_row(const tl_image *image, size_t y, bool opaque, uint8_t *row)
{
    for (size_t x = 0; x < image->width; x++) {
        const float *c = image->rgba + 4 * (y * image->width + x);
        double opacity = (double)c[3];
        for (int k = 0; k < 3; k++) *row++ = to_byte(opacity > 0 ? (double)c[k] / opacity : 0);
        if (!opaque) *row++ = to_byte(opacity);
    }
}

static bool is_opaque(const tl_image *image)
{
    for (size_t p = 0; p < (size_t)image->width * image->height; p++)
        if (image->rgba[4 * p + 3] < 1) return false;
    return true;
}

static void write_rows(writer *w, const tl_image *image)
{
    if (setjmp(png_jmpbuf(w->png))) return;
    png_set_write_fn(w->png, w, put, flush);
    png_set_compression_level(w->png, ZLIB_LEVEL);
    png_set_IHDR(w->png, w->info, image->width, image->height, 8,
                 w->opaque ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(w->png, w->info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(w->png, w->info);
    for (size_t y = 0; y < image->height; y++) {
        fill_row(image, y, w->opaque, w->row);
        png_write_row(w->png, w->row);
    }
    png_write_end(w->png, NULL);
}

tl_status tl_image_write_png(tl_ctx *ctx, const tl_image *image, const char *path)
{
    tl_status st = TL_OK;
    writer w = {.ctx = ctx, .opaque = is_opaque(image)};
    w.row = tl_mem_alloc(ctx, image->width, 4, &st);
    if (!st) st = tli_sink_open(ctx, path, &w.sink);
    if (!st) {
        w.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &w, fail, ignore);
        w.info = w.png ? png_create_info_struct(w.png) : NULL;
        if (!w.info) st = tl_fail(ctx, TL_ERR_MEMORY, "PNG: no memory");
    }
    if (!st) {
        write_rows(&w, image);
        st = w.st;
    }
    if (w.png) png_destroy_write_struct(&w.png, &w.info);
    tl_status end = tli_sink_close(w.sink, !st);
    if (!st) st = end;
    tl_mem_free(ctx, w.row);
    return st ? tl_note(ctx, st, "while writing '%s'", path) : TL_OK;
}

#else

tl_status tl_image_write_png(tl_ctx *ctx, const tl_image *image, const char *path)
{
    (void)image;
    return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                   "'%s': this build writes no PNG (Debian package libpng-dev)", path);
}

#endif
