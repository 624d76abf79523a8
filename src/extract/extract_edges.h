/* Stage extract, internal: the edges of a surface in parts, as extract_edges.c keeps them and
 * extract_features.c looks at them. */
#ifndef TETRALOD_SRC_EXTRACT_EDGES_H
#define TETRALOD_SRC_EXTRACT_EDGES_H

#include "extract/extract.h"

/* An edge that lies in one part with all of its triangles, as far as they are known. */
typedef struct tli_edge {
    tl_lidx verts[2];
    uint32_t sides[2]; /* triangles; TL_NONE where there is no second one. With more than two, or
                          two that are turned against each other, both are TL_NONE */
} tli_edge;

typedef struct tli_edge_part {
    uint32_t number;
    size_t vert_count, triangle_count;
    double *xyz;
    uint32_t *shared;   /* [vert_count] or NULL */
    tl_lidx *triangles; /* [triangle_count][3] */
    int32_t *regions;   /* [triangle_count] or NULL */
    double (*normals)[3];
    tli_edge *edges; /* [edge_count], by their vertices */
    size_t edge_count;
    tli_edge *rims; /* [rim_count] of one triangle, whose vertices are both shared */
    size_t rim_count;
} tli_edge_part;

/* A side of an edge that parts share, and its part. */
typedef struct tli_seam_side {
    uint32_t part, rim; /* index of the part, of its rims */
} tli_seam_side;

struct tl_edges {
    tli_edge_part *parts; /* by rising numbers */
    size_t part_count;
    bool joined;          /* what follows is that of the parts as they are */
    tli_seam_side *sides; /* rims of all parts, those of one edge next to each other */
    size_t *starts;       /* [seam_count + 1] of sides */
    size_t seam_count;
    size_t *first_verts;     /* [part_count + 1] vertices before each part, */
    size_t *first_triangles; /* and triangles */
    uint32_t *owners;        /* [owner_count] of a shared number the first vertex that has it */
    size_t owner_count;
};

/* Joins rims of parts, if that is not done. */
tl_status tli_edges_join(tl_ctx *ctx, tl_edges *edges);

#endif
