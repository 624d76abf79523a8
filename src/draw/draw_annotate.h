/* What the files of the annotation share. */
#ifndef TETRALOD_SRC_DRAW_ANNOTATE_H
#define TETRALOD_SRC_DRAW_ANNOTATE_H

#include "draw/draw.h"
#include "draw/draw_canvas.h"

/* Height of text in pixels, as asked for or from the size of the picture. */
double tli_text_px(const tl_annotation *annotation, uint32_t width, uint32_t height);

/* The parts, in draw_annotate_pango.c and draw_axes_pango.c. Edges of the box that lie behind what
 * it holds, then those in front, with the numbers along the outer ones. */
void tli_axes_behind(tli_canvas *canvas, const tl_annotation *a, const tli_frame *frame,
                     double text_px);
void tli_axes_front(tli_canvas *canvas, const tl_annotation *a, const tli_frame *frame,
                    double text_px);
void tli_triad(tli_canvas *canvas, const tli_frame *frame, uint32_t height, double text_px);

/* All of it; numbers are proved. */
tl_status tli_annotate(tl_ctx *ctx, const tl_annotation *a, const tli_frame *frame,
                       tl_image *image);
tl_status tli_annotate_page(tl_ctx *ctx, const tl_annotation *a, const tli_frame *frame,
                            const tl_image *image, const char *path);

#endif
