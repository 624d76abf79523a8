/* What words and lines are drawn on: a layer as large as the picture, put behind it or in front of
 * it at the end. Places in pixels from the upper left corner, y downwards. */
#ifndef TETRALOD_SRC_DRAW_CANVAS_H
#define TETRALOD_SRC_DRAW_CANVAS_H

#include "tetralod/draw.h"

typedef struct tli_canvas tli_canvas;

/* ink: of lines and text; halo: around text, so that it can be read on anything. text_px: height of
 * a line of text. Gives *canvas, clear. */
tl_status tli_canvas_open(tl_ctx *ctx, uint32_t width, uint32_t height, const double ink[3],
                          const double halo[3], double text_px, tli_canvas **canvas);
/* NULL is allowed. */
void tli_canvas_close(tli_canvas *canvas);

/* The same on a page of a file, .pdf or .svg, of one point a pixel: nothing is merged, what is
 * drawn later is in front. background: of all of it; NULL: none. TL_ERR_UNSUPPORTED for another
 * ending. */
tl_status tli_canvas_open_page(tl_ctx *ctx, const char *path, uint32_t width, uint32_t height,
                               const float *background, const double ink[3], const double halo[3],
                               double text_px, tli_canvas **canvas);
/* Puts a picture of its size onto a page. */
tl_status tli_canvas_paint(tli_canvas *canvas, const tl_image *image);
/* Completes the file if keep, else removes it; the canvas is closed. NULL is allowed. */
tl_status tli_canvas_close_page(tli_canvas *canvas, bool keep);

/* opacity of ink, 0 to 1 */
void tli_canvas_line(tli_canvas *canvas, const double from[2], const double to[2], double width_px,
                     double opacity);
/* rgb NULL: ink */
void tli_canvas_triangle(tli_canvas *canvas, const double corners[3][2], const double rgb[3]);
void tli_canvas_rectangle(tli_canvas *canvas, double x, double y, double width, double height,
                          const double rgb[3]);

/* A line of text. anchor: which place of its box lies at x, y: 0, 0 the upper left corner, 1, 1 the
 * lower right one. scale: of the height. rgb NULL: ink. What is wider than width_px ends in dots;
 * 0: any width. Bytes that are no UTF-8 and control characters are replaced. */
typedef struct tli_words {
    const char *text;
    double scale, width_px;
    bool is_bold;
    const double *rgb;
} tli_words;
void tli_canvas_text(tli_canvas *canvas, const tli_words *words, double x, double y,
                     const double anchor[2]);
void tli_canvas_measure(tli_canvas *canvas, const tli_words *words, double size[2]);

/* Puts what was drawn in front of the picture, or behind it, and clears the canvas. TL_ERR_MEMORY
 * if drawing failed. */
tl_status tli_canvas_merge(tli_canvas *canvas, bool behind, tl_image *image);

#endif
