/* Stage formats, internal: a VTU whose mesh comes piece by piece, so that it need not fit into
 * memory. */
#ifndef TETRALOD_SRC_FORMATS_PIECES_H
#define TETRALOD_SRC_FORMATS_PIECES_H

#include "base/base.h"
#include "tetralod/mesh.h"

enum { TLI_PIECES_LABELS = 2 };

/* A channel of all pieces. */
typedef struct tli_pieces_channel {
    const char *name;
    uint32_t components;
    tl_on on;
} tli_pieces_channel;

typedef struct tli_pieces_size {
    uint32_t verts, tets;
} tli_pieces_size;

/* What all pieces have in common; borrowed until the file is closed. */
typedef struct tli_pieces_shape {
    const tli_pieces_size *sizes; /* [piece_count] */
    size_t piece_count;
    const tli_pieces_channel *channels; /* [channel_count] */
    size_t channel_count;
    const char
        *labels[TLI_PIECES_LABELS]; /* channels on tets with one number a piece; NULL: none */
    bool has_regions;
} tli_pieces_shape;

/* A piece. Rows have the components of all channels on vertices (tets), in their order. */
typedef struct tli_pieces_mesh {
    const double *xyz;       /* [verts][3] */
    const tl_lidx *tets;     /* [tets][4], numbers of the piece */
    const double *vert_rows; /* [verts][components on vertices] */
    const double *tet_rows;  /* [tets][components on tets] */
    const int32_t *regions;  /* [tets], has_regions */
    uint32_t labels[TLI_PIECES_LABELS];
} tli_pieces_mesh;

typedef struct tli_pieces tli_pieces;
/* Gives *pieces. TL_ERR_IO. */
tl_status tli_pieces_open(tl_ctx *ctx, const char *path, const tli_pieces_shape *shape,
                          tli_pieces **pieces);
/* The next piece. */
tl_status tli_pieces_put(tli_pieces *pieces, const tli_pieces_mesh *mesh);
/* The file appears if status is fine and all pieces are there. NULL is allowed. Returns the first
 * failure. */
tl_status tli_pieces_close(tli_pieces *pieces, tl_status status);

#endif
