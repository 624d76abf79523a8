/* Stage extract, internal: what the files of this stage share. */
#ifndef TETRALOD_SRC_EXTRACT_H
#define TETRALOD_SRC_EXTRACT_H

#include "base/base.h"
#include "mesh/mesh_edge.h"
#include "tetralod/extract.h"

/* Tets of a block of the range index, and of a piece of work. */
enum { TLI_RANGE_TETS = 256, TLI_SLICE_TETS = 16 * TLI_RANGE_TETS };

struct tl_range_index {
    size_t tet_count;
    double (*ranges)[2]; /* [blocks]; of finite values; least above largest where there is none */
};

/* An edge that is cut, and by which value. */
typedef struct tli_cut_edge {
    uint64_t verts; /* tli_edge_key */
    uint32_t level;
} tli_cut_edge;

/* Where a vertex of a slice is on its edge. */
typedef struct tli_slice_end {
    tl_lidx
        ends[2]; /* vertices of the mesh, in an order that other meshes with the edge find, too */
    uint32_t level; /* which of the values, by their size */
    double weight;  /* of the second end */
} tli_slice_end;
/* As tl_slice_mesh; gives also *ends [vert_count] of the result (tl_mem_free), which takes channels
 * on vertices alone; NULL: not asked. */
tl_status tli_slice_mesh(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                         const tl_slice_opts *opts, tl_polydata **triangles, tli_slice_end **ends);
/* TL_ERR_ARG where values are too few, too many or not finite; and in rising order. */
tl_status tli_slice_values_check(tl_ctx *ctx, const double *values, size_t value_count);
void tli_slice_values_sort(const double *values, size_t value_count, double *sorted);
/* TL_ERR_ARG for a channel that can't be carried along: one that is none on vertices. */
tl_status tli_carried_check(tl_ctx *ctx, const tl_mesh *mesh, const size_t *channels,
                            size_t channel_count);
/* The normal at a weight between ends with these gradients; 0 where there is none. */
void tli_slice_normal(const double a[3], const double b[3], double w, float normal[3]);

/* Cut edges as pieces found them, in places of their own: piece p has edges [starts[p], starts[p] +
 * counts[p]); an edge may be there several times. */
typedef struct tli_cut_edges {
    tli_cut_edge *edges;
    size_t *starts; /* [piece_count + 1] */
    size_t *counts; /* [piece_count] */
    size_t piece_count;
} tli_cut_edges;

/* numbers [starts[piece_count]]: the vertex of each edge, counted in the order of the edges. Gives
 * the edge of each vertex, unique [*vert_count]. */
tl_status tli_weld_edges(tl_ctx *ctx, const tli_cut_edges *edges, uint32_t *numbers,
                         tli_cut_edge **unique, size_t *vert_count);

/* Counts [count] to starts [count + 1]; returns the sum. */
static inline size_t tli_make_starts(size_t *counts, size_t count)
{
    size_t next = 0;
    for (size_t i = 0; i < count; i++) {
        size_t own = counts[i];
        counts[i] = next;
        next += own;
    }
    return counts[count] = next;
}

/* True if a stands before b, whatever mesh they are numbered in. */
static inline bool tli_stands_before(const double *a, const double *b)
{
    for (int k = 0; k < 3; k++)
        if (a[k] != b[k]) return a[k] < b[k];
    return false;
}

/* Where the edge of ends, between which a scalar has the value, is cut: the weight of the second
 * one. Puts the ends into an order that other meshes with that edge find, too. */
static inline double tli_cut_weight(const double *xyz, const double *scalar, double value,
                                    size_t ends[2])
{
    const double *a = xyz + 3 * ends[0], *b = xyz + 3 * ends[1];
    if (tli_stands_before(b, a) ||
        (!tli_stands_before(a, b) && scalar[ends[1]] < scalar[ends[0]])) {
        size_t other = ends[0];
        ends[0] = ends[1];
        ends[1] = other;
    }
    /* halves, since the difference of two numbers may be none */
    double low = scalar[ends[0]] / 2, high = scalar[ends[1]] / 2;
    double w = (value / 2 - low) / (high - low);
    return w < 0 ? 0 : w > 1 ? 1 : w;
}

/* Between a and b, equal to each where w is 0 or 1. */
static inline double tli_mix(double a, double b, double w)
{
    return a * (1 - w) + b * w;
}

/* Sides of triangles by their edges: keys [3 * triangle_count] of tli_edge_key, rising, and sides
 * [3 * triangle_count], 3 * triangle + the corner where the side begins, rising for equal keys.
 * Gives both. TL_ERR_UNSUPPORTED for more than 1,431,655,765 triangles. */
tl_status tli_sort_sides(tl_ctx *ctx, const tl_lidx *triangles, size_t triangle_count,
                         uint64_t **keys, uint32_t **sides);

/* One past the last of equal keys from begin on. */
static inline size_t tli_same_keys(const uint64_t *keys, size_t begin, size_t count)
{
    size_t end = begin + 1;
    while (end < count && keys[end] == keys[begin]) end++;
    return end;
}

/* The corner behind, around the triangle. */
static inline size_t tli_next_corner(size_t corner)
{
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}

/* out: normal of a triangle, one long; false, and 0, if it has none. */
bool tli_triangle_normal(const double *xyz, const tl_lidx *corners, double out[3]);

/* Spreads the bits of an edge. */
static inline uint64_t tli_edge_hash(uint64_t verts, uint32_t level)
{
    uint64_t h = (verts ^ (uint64_t)level << 56) * UINT64_C(0x9e3779b97f4a7c15);
    return h ^ h >> 29;
}

#endif
