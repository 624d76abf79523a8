/* Stage cut, internal: a camera made ready to ask where a sphere lies and how large a length in it
 * may look. */
#ifndef TETRALOD_SRC_CUT_CAMERA_H
#define TETRALOD_SRC_CUT_CAMERA_H

#include "tetralod/cut.h"

typedef struct tli_view {
    double position[3], forward[3];
    double planes[4][4]; /* inward normal and offset of the sides of the frustum */
    double near;         /* mesh units: what is nearer is not looked at */
    double scale;        /* pixels of a unit length at distance 1, at the edge of the picture; of a
                            parallel view at any distance */
    bool parallel;
} tli_view;

/* diagonal: of the data set, mesh units. TL_ERR_ARG names what is out of range. */
tl_status tli_view_set(tl_ctx *ctx, const tl_camera *camera, double diagonal, tli_view *view);
/* Pixels that a unit length inside of the sphere (centre, radius) covers at most; 0 if the sphere
 * lies outside of the frustum. */
double tli_view_pixels(const tli_view *view, const double sphere[4]);

/* Whether two cameras see the same, but for the sizes of their pictures. */
bool tli_camera_is_same(const tl_camera *a, const tl_camera *b);

#endif
