/* Stage extract, internal: a mesh made of tets of another one, whole or cut. */
#ifndef TETRALOD_SRC_EXTRACT_PART_H
#define TETRALOD_SRC_EXTRACT_PART_H

#include "extract/extract.h"

/* Vertices of what is left: old ones in use, in their order, then those on cut edges. */
typedef struct tli_cut_verts {
    size_t count, old_count;
    tl_lidx *olds;        /* [old_count] */
    tli_cut_edge *unique; /* [count - old_count] */
} tli_cut_verts;
/* refs [ref_count]: below old_count vertices, from there on places in edges. corners [ref_count],
 * may be refs: receives vertices of the result. Release *verts also after a failure. */
tl_status tli_cut_verts_make(tl_ctx *ctx, const tl_lidx *refs, size_t ref_count, size_t old_count,
                             const tli_cut_edges *edges, tl_lidx *corners, tli_cut_verts *verts);
void tli_cut_verts_release(tl_ctx *ctx, tli_cut_verts *verts);
/* The old vertices between which a vertex lies, and the weight of the second one. scalar is cut at
 * 0. */
double tli_cut_ends(const tli_cut_verts *verts, const double *xyz, const double *scalar,
                    size_t vert, size_t ends[2]);
/* Gives values [count][components]: those of old vertices, or between two. */
tl_status tli_cut_verts_carry(tl_ctx *ctx, const tli_cut_verts *verts, const double *xyz,
                              const double *scalar, const double *from, size_t components,
                              double **values);
/* Makes them the vertices of a polydata, with places and channels of the one they were in; scalar
 * may be NULL where nothing is cut. */
tl_status tli_cut_verts_polydata(tl_ctx *ctx, const tli_cut_verts *verts, const tl_polydata *from,
                                 const double *scalar, tl_polydata *to);

/* Tets by references: below the vertex count of the mesh they are its vertices, from there on cut
 * edges, vertex count + place of the edge. */
typedef struct tli_part {
    const tl_mesh *mesh;
    tl_lidx *refs;    /* [tet_count][4] */
    tl_lidx *parents; /* [tet_count] tets of the mesh, rising */
    size_t tet_count;
    tli_cut_edges edges;  /* all of level 0 */
    const double *scalar; /* [vert_count], cut at 0; NULL where nothing is cut */
} tli_part;

/* The mesh of a part, with channels, regions, labels and time. Gives *mesh. */
tl_status tli_part_mesh(tl_ctx *ctx, const tli_part *part, tl_mesh **mesh);
/* Frees what the part owns. */
void tli_part_release(tl_ctx *ctx, tli_part *part);

/* out [vert_count]: normal . x - offset; of a side that is one, see tli_side_check. */
tl_status tli_side_values(tl_ctx *ctx, const double *xyz, size_t vert_count,
                          const tl_half_space *side, double *out);
tl_status tli_side_check(tl_ctx *ctx, const tl_half_space *sides, size_t side_count);

#endif
