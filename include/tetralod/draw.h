/* tetralod, stage draw: pictures without window system, GPU or root. The renderer here runs on the
 * processor, and is the reference that others are compared with.
 *
 * What returns a status can also fail for TL_ERR_MEMORY and TL_ERR_BUDGET, and runs on the pool.
 * Pictures do not depend on the number of threads. */
#ifndef TETRALOD_DRAW_H
#define TETRALOD_DRAW_H

#include "tetralod/cut.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- pictures ---- */

/* Colours and opacity of pixels, row after row from the top; blocks of tl_mem_alloc. Colours are
 * sRGB numbers, 0 to 1, times opacity. */
typedef struct tl_image {
    uint32_t width, height;
    float *rgba;  /* [height][width][4] */
    float *depth; /* [height][width] of the nearest opaque thing: distance from the camera along its
                     view, mesh units; infinity where there is none */
} tl_image;
/* Transparent, with nothing in it. Gives *image. TL_ERR_ARG for a side of 0 or above 32,768. */
TL_API tl_status tl_image_create(tl_ctx *ctx, uint32_t width, uint32_t height, tl_image **image);
/* NULL is allowed. */
TL_API void tl_image_destroy(tl_ctx *ctx, tl_image *image);
/* Means of squares of factor x factor pixels; factor divides both sides. Gives *small. TL_ERR_ARG
 */
TL_API tl_status tl_image_reduce(tl_ctx *ctx, const tl_image *image, uint32_t factor,
                                 tl_image **small);
/* Puts the picture in front of a colour (sRGB, 0 to 1); it is opaque then. NULL: white. */
TL_API void tl_image_flatten(tl_image *image, const float background[3]);
/* 8 bits a channel, with opacity where a pixel is not opaque. The file appears only when complete.
 * TL_ERR_IO; TL_ERR_UNSUPPORTED in a build without libpng. */
TL_API tl_status tl_image_write_png(tl_ctx *ctx, const tl_image *image, const char *path);

/* The camera of a first look: all of the box (x0, x1, y0, y1, z0, z1) in view, from an azimuth and
 * elevation in degrees (0, 0: along -y, z up), zoom 1 or another. */
TL_API tl_camera tl_camera_fit(const double bounds[6], double azimuth, double elevation,
                               double zoom, uint32_t width, uint32_t height);

/* ---- transfer functions ---- */

/* Colours and opacities of values, linear between control points, constant beyond them. Immutable.
 */
typedef struct tl_transfer tl_transfer;
typedef struct tl_color_point {
    double value;
    double rgb[3]; /* sRGB, 0 to 1 */
} tl_color_point;
typedef struct tl_opacity_point {
    double value;
    double opacity; /* of a layer as thick as the unit distance, 0 to 1 */
} tl_opacity_point;

/* Copies colors [color_count] and opacities [opacity_count], each at least one, by rising value
 * (equal values: a step). unit_distance: mesh units, above 0. Gives *transfer. TL_ERR_ARG for
 * numbers out of range or order (the message names the point). */
TL_API tl_status tl_transfer_create(tl_ctx *ctx, const tl_color_point *colors, size_t color_count,
                                    const tl_opacity_point *opacities, size_t opacity_count,
                                    double unit_distance, tl_transfer **transfer);
/* NULL is allowed. */
TL_API void tl_transfer_destroy(tl_ctx *ctx, tl_transfer *transfer);
/* Colour of a value, and the extinction there, by mesh unit. Colour of NaN: grey. Any thread. */
TL_API void tl_transfer_at(const tl_transfer *transfer, double value, float rgb[3],
                           double *extinction);

/* Name of a colour map, NULL past the last one: perceptual ones first. The colours of map name,
 * over 0 to 1; *count points, which live as long as the library. NULL for an unknown name. */
TL_API const char *tl_colormap_name(size_t index);
TL_API const tl_color_point *tl_colormap(const char *name, size_t *count);

/* ---- volumes ---- */

/* A mesh made ready for rays: who lies behind which face, and where they can come in. Immutable;
 * borrows the mesh. */
typedef struct tl_volume tl_volume;
/* opposite: of tl_mesh_adjacency, or NULL to compute it. Gives *volume. */
TL_API tl_status tl_volume_create(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                  tl_volume **volume);
/* NULL is allowed. */
TL_API void tl_volume_destroy(tl_ctx *ctx, tl_volume *volume);

typedef struct tl_volume_opts {
    size_t struct_bytes;
    double opacity_end; /* a ray ends when it has this opacity, up to 1; default 0.999. Closer to 1
                           costs time */
    double step_depth;  /* optical depth that is integrated as one piece, up to 0.2; default 0.1.
                           The error of a ray falls with its square, the time grows */
} tl_volume_opts;
TL_API tl_volume_opts tl_volume_opts_defaults(void);

/* Direct volume rendering by casting a ray a pixel through the tets: absorption and emission of a
 * scalar that is linear in each tet, integrated over the transfer function's integrals, so that no
 * feature between samples is missed. scalar [vert_count]; a NaN is not seen. The volume stands in
 * front of what is in the picture, up to its depth. The camera may stand inside of the mesh. opts
 * may be NULL. TL_ERR_ARG for a camera of another size than the picture's, or out of range.
 * Sondershaus 2007, chapter 7; Cignoni et al. 1997, section V. */
TL_API tl_status tl_draw_volume(tl_ctx *ctx, const tl_volume *volume, const double *scalar,
                                const tl_transfer *transfer, const tl_camera *camera,
                                const tl_volume_opts *opts, tl_image *image);

#ifdef __cplusplus
}
#endif
#endif
