/* Stage draw, internal: what a renderer is made of: the things in it, and the table of functions
 * that each back end fills. The front (draw_renderer.c) has checked all arguments before a back end
 * sees them. */
#ifndef TETRALOD_SRC_DRAW_BACKEND_H
#define TETRALOD_SRC_DRAW_BACKEND_H

#include "draw/draw.h"

typedef enum tli_item_kind {
    TLI_ITEM_VOLUME,
    TLI_ITEM_SURFACE,
    TLI_ITEM_LINES,
    TLI_ITEM_POINTS,
    TLI_ITEM_SLICES
} tli_item_kind;

/* A thing as its caller gave it. */
typedef struct tli_item {
    tl_item id;
    tli_item_kind kind;
    const tl_volume *volume;
    const tl_mesh *mesh; /* of slices */
    const tl_polydata *polydata;
    const double *scalar;        /* of volumes and slices */
    const tl_transfer *transfer; /* of volumes */
    tl_look look;                /* of all but volumes */
    tl_volume_opts volume_opts;
    tl_line_opts line_opts;
    tl_point_opts point_opts;
    double *values; /* of slices; copied */
    size_t value_count;
    void *own; /* of the back end, from add to remove */
} tli_item;

/* Entries of its corners; 0 of points, which have none. */
static inline size_t tli_corner_count(const tl_polydata *p)
{
    if (p->kind == TL_POLY_TRIANGLES) return 3 * p->cell_count;
    return p->kind == TL_POLY_LINES && p->cell_count ? p->starts[p->cell_count] : 0;
}

/* True if a volume takes gradients: for light, for opacity, or both. */
static inline bool tli_volume_has_light(const tl_volume_opts *opts)
{
    return opts->lit || opts->gradient_opacity > 0;
}

/* The scalar of a volume's vertex in steps of its transfer function. */
static inline float tli_volume_step(const tli_item *item, size_t vert)
{
    const tl_transfer *t = item->transfer;
    return (float)((item->scalar[vert] - t->low) * t->per_value);
}

/* The vertices [vert_count] of a volume in a view: draw_place.c. */
tl_status tli_volume_place(tl_ctx *ctx, const tli_item *item, const tli_frame *frame,
                           tli_vert *verts);
/* out [vert_count]: gradients in lengths of the one from which on opacity is full, or of the
 * longest; 0 for one that is not finite, and in the fourth place. */
void tli_volume_gradients(const tl_volume_opts *opts, size_t vert_count, float (*out)[4]);

/* state is what open gave. */
typedef struct tli_backend {
    /* Gives *state. TL_ERR_UNSUPPORTED where the back end can't work. */
    tl_status (*open)(tl_ctx *ctx, void **state);
    void (*close)(tl_ctx *ctx, void *state);
    const char *(*name)(const void *state);
    /* True if it is faster than the processor. */
    bool (*is_fast)(const void *state);
    /* Bytes in a graphics card; NULL: none. */
    size_t (*card_bytes)(const void *state);
    /* Makes item->own, or fails and leaves nothing behind. */
    tl_status (*add)(tl_ctx *ctx, void *state, tli_item *item);
    /* The values of slices are others; a failure leaves what was there before. */
    tl_status (*change)(tl_ctx *ctx, void *state, tli_item *item);
    void (*remove)(tl_ctx *ctx, void *state, tli_item *item);
    tl_status (*draw)(tl_ctx *ctx, void *state, tli_item *const *items, size_t item_count,
                      const tl_camera *camera, tl_image *image);
    /* As of tl_renderer_draw_bytes; NULL: by draw. */
    tl_status (*draw_bytes)(tl_ctx *ctx, void *state, tli_item *const *items, size_t item_count,
                            const tl_camera *camera, const float *background, uint8_t *rgba,
                            float *depth);
} tli_backend;

extern const tli_backend tli_backend_cpu, tli_backend_null;
/* In builds with OpenGL. */
extern const tli_backend tli_backend_gl, tli_backend_gl_current;

#endif
