/* Stage draw, internal: what the files of this stage share. */
#ifndef TETRALOD_SRC_DRAW_H
#define TETRALOD_SRC_DRAW_H

#include "base/base.h"
#include "tetralod/draw.h"

/* ---- the camera ---- */

/* Places on the picture: x grows to the right, y upwards, both in pixels from its middle and, of a
 * perspective view, times z; z is the distance along the view. Lengths are in units of the frame,
 * so that products of two stay in the range of float32 however large or small the mesh is. */
typedef struct tli_frame {
    double origin[3], right[3], up[3], forward[3];
    double unit;      /* mesh units, a power of two: about the distance of what is looked at */
    double scale;     /* pixels of a unit length (perspective: at z = 1) */
    bool parallel;    /* x and y are pixels for any z */
    double middle[2]; /* pixel coordinates, from the upper left corner, of x = y = 0 */
} tli_frame;

/* TL_ERR_ARG names what is out of range. */
tl_status tli_frame_set(tl_ctx *ctx, const tl_camera *camera, const tl_image *image,
                        tli_frame *frame);
void tli_frame_place(const tli_frame *frame, const double xyz[3], double out[3]);

/* ---- pictures ---- */

/* TL_ERR_ARG for a side that is none of a picture's. */
tl_status tli_image_check(tl_ctx *ctx, uint32_t width, uint32_t height);
/* Colours times opacity [count][4] in 8 bits, in front of a background [3]; NULL: of nothing. */
void tli_pixels_pack(const float *colors, size_t count, const float *background, uint8_t *rgba);
/* The same with blue first. */
void tli_pixels_pack_bgra(const float *colors, size_t count, const float *background,
                          uint8_t *bgra);

/* ---- transfer functions ---- */

enum { TLI_TRANSFER_STEPS = 4096, TLI_SUM_STEPS = 64 };

/* Tables over [low, high] in steps. The integrals have one step more at either end, with what holds
 * beyond, and are kept in float32 as differences from every 64th, so that those of near values are
 * exact; the last of 64 is there twice: entry k of step i is i + i / 64. */
struct tl_transfer {
    double low, high;
    double per_value;                    /* steps by unit of the channel; 0 if low == high */
    float at[TLI_TRANSFER_STEPS + 1][4]; /* colour, extinction */
    /* integrals by steps of extinction times colour, and of extinction */
    float sums[TLI_TRANSFER_STEPS + TLI_TRANSFER_STEPS / TLI_SUM_STEPS + 5][4];
    float bases[TLI_TRANSFER_STEPS / TLI_SUM_STEPS + 2][4];
    float nan[3];    /* colour of NaN */
    double clear[2]; /* steps: of values up to the first and from the second on, and around them as
                        much as a step, nothing is seen */
};

/* ---- volumes ---- */

/* A tet: its vertices, then what lies behind the faces opposite to them (4 * tet + face). */
typedef struct tli_cell {
    tl_lidx verts[4], behind[4];
} tli_cell;

/* A tet that names a vertex twice has no faces. */
static inline bool tli_cell_is_flat(const tli_cell *cell)
{
    const tl_lidx *q = cell->verts;
    return q[0] == q[1] || q[0] == q[2] || q[0] == q[3] || q[1] == q[2] || q[1] == q[3] ||
           q[2] == q[3];
}

struct tl_volume {
    const tl_mesh *mesh;
    tli_cell *cells;
    size_t cell_count, vert_count;
    tl_lidx *doors; /* [door_count] faces with nothing behind: 4 * tet + face */
    size_t door_count;
};

/* A vertex on its way through a picture: place, and scalar in steps of the transfer function. */
typedef struct tli_vert {
    float x, y, z, s;
} tli_vert;

/* Where the ray of a pixel (px, py) of the frame passes a face: double areas [3] of the triangles
 * between the ray and the edge opposite to each corner, their sum, and that of the corners' depths
 * by area. It passes inside where no two areas have opposite signs. */
typedef struct tli_crossing {
    double areas[3], sum, depths;
} tli_crossing;
static inline tli_crossing tli_frame_cross(const tli_frame *frame, const tli_vert *const face[3],
                                           double px, double py)
{
    double x[3], y[3];
    tli_crossing c = {.sum = 0};
    for (int i = 0; i < 3; i++) {
        double w = frame->parallel ? 1 : (double)face[i]->z;
        x[i] = (double)face[i]->x - px * w;
        y[i] = (double)face[i]->y - py * w;
    }
    for (int i = 0; i < 3; i++) {
        int a = (i + 1) % 3, b = (i + 2) % 3;
        c.areas[i] = x[a] * y[b] - x[b] * y[a];
        c.sum += c.areas[i];
        c.depths += c.areas[i] * (double)face[i]->z;
    }
    return c;
}

/* Options over the defaults, checked. */
tl_status tli_volume_opts_take(tl_ctx *ctx, const tl_volume_opts *given, tl_volume_opts *opts);
/* TL_ERR_ARG for numbers of light that are out of range. */
tl_status tli_light_check(tl_ctx *ctx, double ambient, double diffuse, double specular,
                          double shininess);

/* ---- tiles ---- */

enum { TLI_TILE_PX = 16 };

/* Things that may be seen in each tile, ascending: entries[starts[tile]] to
 * entries[starts[tile + 1] - 1]. Tiles are numbered row after row. */
typedef struct tli_tiling {
    uint32_t columns, rows;
    size_t *starts;
    tl_lidx *entries;
} tli_tiling;
/* Box of the pixels that thing i of data may be seen in: x and y from the upper left corner of the
 * picture, low and high, infinities allowed; false: it is not seen. From several threads. */
typedef bool (*tli_box_fn)(const void *data, size_t i, double low[2], double high[2]);
tl_status tli_tiling_open(tl_ctx *ctx, const tl_image *image, size_t count, tli_box_fn box,
                          const void *data, tli_tiling *tiling);
void tli_tiling_close(tl_ctx *ctx, tli_tiling *tiling);

/* Where a ray comes in. */
typedef struct tli_door_hit {
    uint32_t pixel; /* inside of the tile, row after row */
    tl_lidx door;   /* 4 * tet + face */
    double z;
} tli_door_hit;

/* Doors of a volume in a view. */
typedef struct tli_doors {
    tl_ctx *ctx;
    const tl_volume *volume;
    const tli_frame *frame;
    const tli_vert *verts;
    uint32_t width, height;
    const tl_lidx *faces; /* [face_count] doors */
    size_t face_count;
    tl_lidx *own;      /* faces, where they are not those of the volume */
    tli_tiling tiling; /* of faces */
} tli_doors;
/* clear: rays come in where something is seen for the first time, not at tets with all values up to
 * clear[0] or from clear[1] on. *faces [*face_count], a block of tl_mem_alloc; NULL: they are those
 * of the volume. Of the vertices only the scalar is used. */
tl_status tli_doors_list(tl_ctx *ctx, const tl_volume *volume, const tli_vert *verts,
                         const float clear[2], tl_lidx **faces, size_t *face_count);
tl_status tli_doors_open(tl_ctx *ctx, const tl_volume *volume, const tli_frame *frame,
                         const tli_vert *verts, const float clear[2], const tl_image *image,
                         tli_doors *doors);
void tli_doors_close(tli_doors *doors);
/* Hits of a tile, by pixel and depth: *hits [*hit_max] grows as it must, *count are there. */
tl_status tli_doors_hits(const tli_doors *doors, size_t tile, tli_door_hit **hits, size_t *hit_max,
                         size_t *count);

#endif
