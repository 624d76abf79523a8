/* Stage draw, internal: the rays of a tile. */
#ifndef TETRALOD_SRC_DRAW_CAST_H
#define TETRALOD_SRC_DRAW_CAST_H

#include "draw/draw.h"

/* What rays of a picture share. */
typedef struct tli_cast {
    const tli_cell *cells;
    const tli_vert *verts;
    const tl_transfer *transfer;
    double scale, unit; /* of the frame */
    bool parallel;
    float opacity_end, step_depth;
    float clear[2]; /* as of the transfer function */
    /* light and gradient opacity; NULL: none */
    const float (*gradients)[4]; /* of the vertices, in axes of the mesh; opacity falls below a
                                    length of 1, if dims; the fourth number is not used */
    bool dims;
    float axes[3][3]; /* right, up, forward of the frame */
    float ambient, diffuse, specular, shininess;
} tli_cast;

/* What a translucent piece does to a pixel of a tile. */
typedef struct tli_fragment {
    uint32_t pixel; /* row after row */
    float z;        /* distance along the view, units of the frame */
    float rgba[4];  /* colour times opacity, opacity */
} tli_fragment;

/* A ray: its pixel, from the middle, y upwards; the depth it goes to, in units of the frame; the
 * doors that it comes in by and the fragments on it, nearest first, none behind depth; what it has
 * seen is put in front of rgba. */
typedef struct tli_ray {
    float px, py, depth;
    const tli_door_hit *doors;
    size_t door_count;
    const tli_fragment *fragments;
    size_t fragment_count;
    float *rgba;
} tli_ray;

/* Follows all rays. Results do not depend on their order. */
typedef void (*tli_cast_fn)(const tli_cast *cast, const tli_ray *rays, size_t ray_count);
void tli_cast_base(const tli_cast *cast, const tli_ray *rays, size_t ray_count);
void tli_cast_avx2(const tli_cast *cast, const tli_ray *rays, size_t ray_count);
/* The fastest that this processor can run. All give the same bytes. */
tli_cast_fn tli_cast_best(void);

#endif
