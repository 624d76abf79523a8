/* Stage formats, internal: polyhedra to tets. */
#ifndef TETRALOD_SRC_FORMATS_POLY_H
#define TETRALOD_SRC_FORMATS_POLY_H

#include "base/base.h"

/* How a polyhedron was split. */
typedef enum tli_poly_kind {
    TLI_POLY_NONE = 0, /* its faces are not closed: no tets */
    TLI_POLY_APEX,     /* from one of its corners */
    TLI_POLY_CENTRE    /* from a new vertex within */
} tli_poly_kind;

/* One polyhedron after the other: add the faces, split, look at the results. All memory is scratch
 * that stays until tli_poly_close. */
typedef struct tli_poly {
    tl_ctx *ctx;
    tl_lidx *ids; /* corners of the faces one after the other */
    size_t id_count, id_room;
    size_t *ends; /* [face_count] end of each face in ids */
    size_t face_count, face_room;

    tl_lidx (*triangles)[3]; /* of the faces, outward once split */
    size_t *triangle_faces;  /* [triangle_count] the face of each */
    size_t triangle_count, triangle_room;

    /* results of tli_poly_split */
    bool closed; /* faces were added that it lacked */
    tl_lidx (*tets)[4];
    size_t tet_count, tet_room;
    tl_lidx *verts; /* distinct corners, ascending */
    size_t vert_count, vert_room;
    double centre[3]; /* mean of the corners or, where that does not see all faces, a point that
                         does */
    double *weights;  /* [vert_count] of the corners, sum 1: for the values at the centre */
    size_t weight_room;

    struct tli_poly_edge *edges;
    size_t edge_room;
    struct tli_poly_half *halves; /* of edges that one face has alone */
    size_t half_room;
    uint8_t *turns; /* [face_count] 0: not reached, 1: as it is, 2: turned */
    size_t *queue;
    size_t turn_room;
} tli_poly;

void tli_poly_open(tl_ctx *ctx, tli_poly *poly);
void tli_poly_close(tli_poly *poly);

/* Forgets the faces of the polyhedron before. */
void tli_poly_begin(tli_poly *poly);
/* Adds a face: ids [count] of its corners in turn, in either direction. Corners that repeat are
 * left out; what then has fewer than three is no face. */
tl_status tli_poly_face(tli_poly *poly, const uint32_t *ids, size_t count);

/* Splits. Each face is cut into triangles by its own corners alone, so that two cells that share it
 * cut it alike: from the corner of the smallest id or, where it has more than four corners and that
 * gives flat or turned triangles, from the first that does not. The tets are then positive if that
 * can be had from a corner, else from the centre, whose index is centre_id. Where the edges that
 * one face has alone run around holes, each hole gets the face that is missing; neighbours that
 * lack the same one make the same. xyz: of all points. */
tl_status tli_poly_split(tli_poly *poly, const double *xyz, tl_lidx centre_id, tli_poly_kind *kind);

/* The cut of one face of three or more different corners into triangles [count - 2]: for labels. */
void tli_poly_cut_face(const double *xyz, const tl_lidx *ids, size_t count,
                       tl_lidx (*triangles)[3]);

#endif
