/* Words and lines through pango and cairo: shaped text of any script, smooth edges without hinting,
 * so that equal fonts give equal pictures. */
#include "draw/draw_canvas.h"

#include <string.h>

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <pango/pangocairo.h>

#include "base/base_file.h"

/* Of the height of text. */
static const double HALO_WIDTH = 0.22;
static const double HALO_OPACITY = 0.8;

struct tli_canvas {
    tl_ctx *ctx;
    uint32_t width, height;
    double ink[3], halo[3], text_px;
    uint8_t *pixels; /* of the surface: premultiplied, 8 bits a channel; of a page those of the
                        picture */
    tli_sink *sink;  /* of a page */
    tl_status written;
    cairo_surface_t *surface;
    cairo_t *cairo;
    PangoFontMap *fonts;
    PangoContext *context;
};

static void open_fonts(tli_canvas *c)
{
    cairo_font_options_t *options = cairo_font_options_create();
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    c->fonts = pango_cairo_font_map_new();
    c->context = pango_font_map_create_context(c->fonts);
    pango_cairo_context_set_font_options(c->context, options);
    pango_context_set_round_glyph_positions(c->context, FALSE);
    cairo_font_options_destroy(options);
}

static tl_status canvas_create(tl_ctx *ctx, uint32_t width, uint32_t height, const double ink[3],
                               const double halo[3], double text_px, tli_canvas **canvas)
{
    tl_status st = TL_OK;
    *canvas = NULL;
    tli_canvas *c = tl_mem_zalloc(ctx, 1, sizeof *c, &st);
    if (st) return st;
    c->ctx = ctx;
    c->width = width;
    c->height = height;
    c->text_px = text_px;
    memcpy(c->ink, ink, sizeof c->ink);
    memcpy(c->halo, halo, sizeof c->halo);
    *canvas = c;
    return TL_OK;
}

static tl_status check(const tli_canvas *c)
{
    const cairo_status_t status = cairo_status(c->cairo);
    return status ? tl_fail(c->ctx, TL_ERR_MEMORY, "annotation: %s", cairo_status_to_string(status))
                  : TL_OK;
}

/* Pixels as cairo has them, clear. Gives *surface on them. */
static tl_status open_pixels(tli_canvas *c, cairo_surface_t **surface)
{
    tl_status st = TL_OK;
    const int stride = cairo_format_stride_for_width(CAIRO_FORMAT_ARGB32, (int)c->width);
    c->pixels = tl_mem_zalloc(c->ctx, c->height, (size_t)stride, &st);
    if (!st)
        *surface = cairo_image_surface_create_for_data(c->pixels, CAIRO_FORMAT_ARGB32,
                                                       (int)c->width, (int)c->height, stride);
    return st;
}

/* The surface is there. */
static tl_status open_cairo(tli_canvas *c)
{
    c->cairo = cairo_create(c->surface);
    open_fonts(c);
    return check(c);
}

tl_status tli_canvas_open(tl_ctx *ctx, uint32_t width, uint32_t height, const double ink[3],
                          const double halo[3], double text_px, tli_canvas **canvas)
{
    tl_status st = canvas_create(ctx, width, height, ink, halo, text_px, canvas);
    if (!st) st = open_pixels(*canvas, &(*canvas)->surface);
    if (!st) st = open_cairo(*canvas);
    if (!st) return TL_OK;
    tli_canvas_close(*canvas);
    *canvas = NULL;
    return st;
}

void tli_canvas_close(tli_canvas *canvas)
{
    if (!canvas) return;
    if (canvas->context) g_object_unref(canvas->context);
    if (canvas->fonts) g_object_unref(canvas->fonts);
    if (canvas->cairo) cairo_destroy(canvas->cairo);
    if (canvas->surface) cairo_surface_destroy(canvas->surface);
    tl_mem_free(canvas->ctx, canvas->pixels);
    tl_mem_free(canvas->ctx, canvas);
}

/* ---- lines and areas ---- */

static void set_color(tli_canvas *c, const double *rgb, double opacity)
{
    const double *color = rgb ? rgb : c->ink;
    cairo_set_source_rgba(c->cairo, color[0], color[1], color[2], opacity);
}

void tli_canvas_line(tli_canvas *canvas, const double from[2], const double to[2], double width_px,
                     double opacity)
{
    set_color(canvas, NULL, opacity);
    cairo_set_line_width(canvas->cairo, width_px);
    cairo_set_line_cap(canvas->cairo, CAIRO_LINE_CAP_ROUND);
    cairo_move_to(canvas->cairo, from[0], from[1]);
    cairo_line_to(canvas->cairo, to[0], to[1]);
    cairo_stroke(canvas->cairo);
}

void tli_canvas_triangle(tli_canvas *canvas, const double corners[3][2], const double rgb[3])
{
    set_color(canvas, rgb, 1);
    for (int i = 0; i < 3; i++) cairo_line_to(canvas->cairo, corners[i][0], corners[i][1]);
    cairo_fill(canvas->cairo);
}

void tli_canvas_rectangle(tli_canvas *canvas, double x, double y, double width, double height,
                          const double rgb[3])
{
    set_color(canvas, rgb, 1);
    cairo_rectangle(canvas->cairo, x, y, width, height);
    cairo_fill(canvas->cairo);
}

/* ---- text ---- */

static PangoLayout *lay_out(tli_canvas *c, const tli_words *words)
{
    PangoLayout *layout = pango_layout_new(c->context);
    PangoFontDescription *font = pango_font_description_new();
    char *text = g_utf8_make_valid(words->text, -1);
    for (char *at = text; *at; at++)
        if ((unsigned char)*at < 0x20 || *at == 0x7f) *at = ' ';
    pango_font_description_set_family_static(font, "Sans");
    pango_font_description_set_absolute_size(font, c->text_px * words->scale * PANGO_SCALE);
    pango_font_description_set_weight(font,
                                      words->is_bold ? PANGO_WEIGHT_BOLD : PANGO_WEIGHT_NORMAL);
    pango_layout_set_font_description(layout, font);
    pango_layout_set_single_paragraph_mode(layout, TRUE);
    pango_layout_set_text(layout, text, -1);
    if (words->width_px > 0) {
        int width;
        pango_layout_get_size(layout, &width, NULL);
        if (width > words->width_px * PANGO_SCALE) {
            pango_layout_set_width(layout, (int)(words->width_px * PANGO_SCALE));
            pango_layout_set_ellipsize(layout, PANGO_ELLIPSIZE_MIDDLE);
        }
    }
    g_free(text);
    pango_font_description_free(font);
    return layout;
}

static void size_of(PangoLayout *layout, double size[2])
{
    PangoRectangle box;
    pango_layout_get_extents(layout, NULL, &box);
    size[0] = (double)box.width / PANGO_SCALE;
    size[1] = (double)box.height / PANGO_SCALE;
}

void tli_canvas_measure(tli_canvas *canvas, const tli_words *words, double size[2])
{
    PangoLayout *layout = lay_out(canvas, words);
    size_of(layout, size);
    g_object_unref(layout);
}

void tli_canvas_text(tli_canvas *canvas, const tli_words *words, double x, double y,
                     const double anchor[2])
{
    double size[2];
    PangoLayout *layout = lay_out(canvas, words);
    size_of(layout, size);
    cairo_new_path(canvas->cairo);
    cairo_move_to(canvas->cairo, x - anchor[0] * size[0], y - anchor[1] * size[1]);
    pango_cairo_layout_path(canvas->cairo, layout);
    cairo_set_line_width(canvas->cairo, canvas->text_px * words->scale * HALO_WIDTH);
    cairo_set_line_join(canvas->cairo, CAIRO_LINE_JOIN_ROUND);
    set_color(canvas, canvas->halo, HALO_OPACITY);
    cairo_stroke_preserve(canvas->cairo);
    set_color(canvas, words->rgb, 1);
    if (canvas->sink) { /* a page keeps text as text */
        cairo_new_path(canvas->cairo);
        cairo_move_to(canvas->cairo, x - anchor[0] * size[0], y - anchor[1] * size[1]);
        pango_cairo_show_layout(canvas->cairo, layout);
    } else
        cairo_fill(canvas->cairo);
    g_object_unref(layout);
}

/* ---- onto the picture ---- */

tl_status tli_canvas_merge(tli_canvas *canvas, bool behind, tl_image *image)
{
    tl_status st = check(canvas);
    if (st) return st;
    cairo_surface_flush(canvas->surface);
    const size_t stride = (size_t)cairo_image_surface_get_stride(canvas->surface);
    for (size_t y = 0; y < image->height; y++)
        for (size_t x = 0; x < image->width; x++) {
            uint32_t pixel; /* alpha in the highest byte, in the order of the machine */
            float *c = image->rgba + 4 * (y * image->width + x), layer[4];
            memcpy(&pixel, canvas->pixels + y * stride + 4 * x, sizeof pixel);
            if (!pixel) continue;
            for (int k = 0; k < 3; k++) layer[k] = (float)(pixel >> (16 - 8 * k) & 255) / 255;
            layer[3] = (float)(pixel >> 24) / 255;
            const float keep = behind ? 1 : 1 - layer[3], add = behind ? 1 - c[3] : 1;
            for (int k = 0; k < 4; k++) c[k] = c[k] * keep + layer[k] * add;
        }
    memset(canvas->pixels, 0, stride * canvas->height);
    cairo_surface_mark_dirty(canvas->surface);
    return TL_OK;
}

/* ---- pages ---- */

static cairo_status_t on_bytes(void *user, const unsigned char *bytes, unsigned count)
{
    tli_canvas *c = user;
    if (!c->written) c->written = tli_sink_write(c->sink, bytes, count);
    return c->written ? CAIRO_STATUS_WRITE_ERROR : CAIRO_STATUS_SUCCESS;
}

static bool has_ending(const char *path, const char *ending)
{
    const size_t length = strlen(path), end = strlen(ending);
    return length > end && strcmp(path + length - end, ending) == 0;
}

tl_status tli_canvas_open_page(tl_ctx *ctx, const char *path, uint32_t width, uint32_t height,
                               const float *background, const double ink[3], const double halo[3],
                               double text_px, tli_canvas **canvas)
{
    const bool is_pdf = has_ending(path, ".pdf");
    *canvas = NULL;
    if (!is_pdf && !has_ending(path, ".svg"))
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': pages are .pdf or .svg", path);
    tl_status st = canvas_create(ctx, width, height, ink, halo, text_px, canvas);
    if (!st) st = tli_sink_open(ctx, path, &(*canvas)->sink);
    if (!st) {
        tli_canvas *c = *canvas;
        c->surface = is_pdf ? cairo_pdf_surface_create_for_stream(on_bytes, c, width, height)
                            : cairo_svg_surface_create_for_stream(on_bytes, c, width, height);
        /* equal pictures give equal files */
        if (is_pdf) cairo_pdf_surface_set_metadata(c->surface, CAIRO_PDF_METADATA_CREATE_DATE, "");
        st = open_cairo(c);
    }
    if (st) {
        tli_canvas_close_page(*canvas, false);
        *canvas = NULL;
    } else if (background) {
        cairo_set_source_rgb((*canvas)->cairo, (double)background[0], (double)background[1],
                             (double)background[2]);
        cairo_paint((*canvas)->cairo);
    }
    return st;
}

static uint32_t to_pixel(const float c[4])
{
    uint32_t pixel = 0;
    for (int k = 0; k < 4; k++) {
        const float most = k < 3 ? c[3] : 1, value = c[k] > 0 ? (c[k] < most ? c[k] : most) : 0;
        const uint32_t byte = (uint32_t)(value * 255 + 0.5F);
        pixel |= k < 3 ? byte << (16 - 8 * k) : byte << 24;
    }
    return pixel;
}

tl_status tli_canvas_paint(tli_canvas *canvas, const tl_image *image)
{
    cairo_surface_t *picture = NULL;
    tl_status st = open_pixels(canvas, &picture);
    if (st) return st;
    const size_t stride = (size_t)cairo_image_surface_get_stride(picture);
    for (size_t y = 0; y < image->height; y++)
        for (size_t x = 0; x < image->width; x++) {
            const uint32_t pixel = to_pixel(image->rgba + 4 * (y * image->width + x));
            memcpy(canvas->pixels + y * stride + 4 * x, &pixel, sizeof pixel);
        }
    cairo_surface_mark_dirty(picture);
    cairo_set_source_surface(canvas->cairo, picture, 0, 0);
    cairo_paint(canvas->cairo);
    cairo_set_source_rgb(canvas->cairo, 0, 0, 0); /* lets go of the picture */
    cairo_surface_destroy(picture);
    return check(canvas);
}

tl_status tli_canvas_close_page(tli_canvas *canvas, bool keep)
{
    if (!canvas) return TL_OK;
    tl_status st = TL_OK;
    if (canvas->surface) {
        cairo_surface_finish(canvas->surface);
        st = canvas->written;
        if (!st && keep) st = check(canvas);
    }
    tl_status end = tli_sink_close(canvas->sink, keep && !st);
    tli_canvas_close(canvas);
    return st ? st : end;
}
