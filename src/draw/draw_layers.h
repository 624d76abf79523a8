/* Stage draw, internal: triangles, lines and points on the processor. Each thing is a layer of
 * pieces; pieces are listed by the tiles that they may be seen in, and put fragments into a tile at
 * a time, in the order of layers and pieces. */
#ifndef TETRALOD_SRC_DRAW_LAYERS_H
#define TETRALOD_SRC_DRAW_LAYERS_H

#include "draw/draw_backend.h"
#include "draw/draw_cast.h"

enum { TLI_TILE_PIXELS = TLI_TILE_PX * TLI_TILE_PX };

/* A square of the picture while it is drawn, by one thread. */
typedef struct tli_tile {
    tl_ctx *ctx;
    const tli_frame *frame;
    uint32_t left, top, width, height; /* pixels of the picture; those at the edges are smaller */
    double px, py;                     /* place of the first pixel in the frame: the one at (x, y)
                                          of the tile is at px + x, py - y */
    float z[TLI_TILE_PIXELS];          /* of the nearest opaque fragment, units of the frame */
    float rgba[TLI_TILE_PIXELS][4];
    tli_fragment *fragments; /* [fragment_count], as they came */
    size_t fragment_count, fragment_max;
    tli_fragment *sorted;               /* by pixel and depth, nearest first, room for as many */
    size_t starts[TLI_TILE_PIXELS + 1]; /* of the pixels in sorted */
    tli_door_hit *hits;                 /* [hit_max] room for the volume */
    size_t hit_max;
    tl_status status; /* of the first fragment that found no memory */
} tli_tile;

/* A tile of a picture, and back into it. */
void tli_tile_load(tli_tile *tile, const tl_image *image, uint32_t left, uint32_t top);
void tli_tile_store(const tli_tile *tile, tl_image *image);
/* Fills sorted and starts with the fragments that nothing opaque hides. */
tl_status tli_tile_sort(tli_tile *tile);
/* Puts the sorted fragments of a pixel in front of it. */
void tli_tile_blend(tli_tile *tile, uint32_t pixel);

/* Puts a fragment (rgba is times opacity) at a pixel, y * TLI_TILE_PX + x. An opaque one, of
 * opacity 1, hides what is not nearer; others are kept for later. What is behind the camera is not
 * seen. */
void tli_tile_keep(tli_tile *tile, uint32_t pixel, float z, const float rgba[4]);
static inline void tli_tile_put(tli_tile *tile, uint32_t pixel, float z, const float rgba[4])
{
    if (!(z > 0 && z <= tile->z[pixel])) return;
    if (rgba[3] < 1) {
        tli_tile_keep(tile, pixel, z, rgba);
        return;
    }
    tile->z[pixel] = z;
    for (int k = 0; k < 4; k++) tile->rgba[pixel][k] = rgba[k];
}

/* Places of xyz [count][3] in a frame. */
tl_status tli_frame_places(tl_ctx *ctx, const tli_frame *frame, const double *xyz, size_t count,
                           double (*places)[3]);
/* Box of the picture that holds what is seen of the hull of points placed in the frame; false: all
 * is behind the camera, or not finite. As of tli_box_fn. */
bool tli_frame_box(const tli_frame *frame, const double (*places)[3], size_t count, double low[2],
                   double high[2]);

/* A thing ready to be drawn in one view. Functions are called from several threads. */
typedef struct tli_layer {
    void *data;
    size_t piece_count;
    tli_box_fn box; /* of a piece of data */
    /* Puts the fragments of a piece into a tile. */
    void (*draw)(const void *data, size_t piece, tli_tile *tile);
    void (*release)(tl_ctx *ctx, void *data);
} tli_layer;

/* Each makes the layer of a thing in a view, and borrows what it is given; on failure there is
 * nothing to release. */
tl_status tli_layer_surface(tl_ctx *ctx, const tl_polydata *triangles, const tl_look *look,
                            const tli_frame *frame, tli_layer *layer);
tl_status tli_layer_lines(tl_ctx *ctx, const tl_polydata *poly, const tl_look *look,
                          const tl_line_opts *opts, const tli_frame *frame, tli_layer *layer);
tl_status tli_layer_points(tl_ctx *ctx, const tl_polydata *points, const tl_look *look,
                           const tl_point_opts *opts, const tli_frame *frame, tli_layer *layer);

/* In [0, 1), of a point's number: whether it stays where there are fewer. */
double tli_point_die(uint64_t point);
/* Width of an arrow head by that of its line. */
#define TLI_ARROW_WIDTH 4.0

/* ---- the volume ---- */

/* A volume in a view. */
typedef struct tli_volume_view {
    tli_vert *verts;
    float (*gradients)[4]; /* of the vertices, where they are asked for */
    tli_doors doors;
    tli_cast cast;
    tli_cast_fn follow;
} tli_volume_view;
/* Borrows what the item lent; on failure there is nothing to close. */
tl_status tli_volume_view_open(tl_ctx *ctx, const tli_item *item, const tli_frame *frame,
                               const tl_image *image, tli_volume_view *view);
void tli_volume_view_close(tl_ctx *ctx, tli_volume_view *view);
/* True if no ray of a tile comes in. */
bool tli_volume_view_misses(const tli_volume_view *view, size_t tile_index);
/* Puts the volume, and the sorted fragments in it, in front of the pixels of a tile. */
tl_status tli_volume_view_draw(const tli_volume_view *view, size_t tile_index, tli_tile *tile);

/* Draws things on the processor. */
tl_status tli_cpu_draw(tl_ctx *ctx, tli_item *const *items, size_t item_count,
                       const tl_camera *camera, tl_image *image);

/* ---- looks ---- */

/* Colour of a look before light: rgb, or that of the scalar. */
void tli_look_color(const tl_look *look, double scalar, float rgb[3]);
/* Light on a colour, in place: cosine of the angle between normal and view, 0 to 1. */
void tli_look_light(const tl_look *look, double cosine, float rgb[3]);
/* Direction, of any length, from the camera to a pixel's place (px, py) of the frame, in axes of
 * the mesh. */
void tli_frame_view(const tli_frame *frame, double px, double py, double view[3]);
/* Cosine, 0 to 1, of the angle between a normal of any length, in axes of the mesh, and the view at
 * a pixel's place (px, py) of the frame; 1 for a normal without length. */
double tli_frame_cosine(const tli_frame *frame, double px, double py, const double normal[3]);

#endif
