/* Stage cut, internal: what a cut promises on the screen, kept for cameras to come, when the cut
 * has long gone on. */
#ifndef TETRALOD_SRC_CUT_OUTLOOK_H
#define TETRALOD_SRC_CUT_OUTLOOK_H

#include "tetralod/cut.h"

/* A segment with drawn outputs: where it lies, and how far visible isosurfaces and the boundary are
 * off there, mesh units. */
typedef struct tli_outlook_part {
    double sphere[4], error;
} tli_outlook_part;
typedef struct tli_outlook {
    tli_outlook_part *parts; /* [count] of those that are off at all */
    size_t count;
    double diagonal; /* of the data set */
} tli_outlook;

/* Of a cut as it is, for what the last query counts as visible. Gives *outlook. */
tl_status tli_outlook_take(tl_ctx *ctx, const tl_cut *cut, tli_outlook *outlook);
void tli_outlook_release(tl_ctx *ctx, tli_outlook *outlook);
/* Pixels by which what a camera sees is off at most: that of tl_cut_state if the query had it. Any
 * thread. TL_ERR_ARG as of tl_camera_check. */
tl_status tli_outlook_pixels(tl_ctx *ctx, const tli_outlook *outlook, const tl_camera *camera,
                             double *pixels);

#endif
