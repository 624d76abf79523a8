/* Stage view, internal: the frustum of a camera that a cut was frozen for, as lines. */
#ifndef TETRALOD_SRC_VIEW_FRUSTUM_H
#define TETRALOD_SRC_VIEW_FRUSTUM_H

#include "view/view.h"

/* The edges of what a camera sees, as far back as the box reaches (x0, x1, y0, y1, z0, z1): four
 * from the eye, or of a parallel view from the front of the box, a frame where the box begins if
 * that is before the eye, and one where it ends. Gives *lines. TL_ERR_ARG as of tl_camera_check. */
tl_status tli_frustum_lines(tl_ctx *ctx, const tl_camera *camera, const double bounds[6],
                            tl_polydata **lines);

/* Adds these lines to a content made for a camera while the scene's cut is frozen for another one;
 * else nothing. */
tl_status tli_make_frustum(tli_maker *maker, const tl_camera *camera);

#endif
