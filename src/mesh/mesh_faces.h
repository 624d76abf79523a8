/* Stage mesh, internal: which faces of tets are the same. */
#ifndef TETRALOD_SRC_MESH_FACES_H
#define TETRALOD_SRC_MESH_FACES_H

#include "base/base.h"
#include "tetralod/mesh.h"

/* Boundary faces as a set: bit i of word w is face 32 * w + i, numbered 4 * tet + face. The words
 * hold whole tets; tli_face_words of them. */
static inline size_t tli_face_words(size_t tet_count)
{
    return (tet_count + 7) / 8;
}

/* Boundary faces, those of exactly one tet, by matching faces without writing an adjacency. Gives
 * bits [tli_face_words]. */
tl_status tli_faces_boundary(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count, size_t vert_count,
                             uint32_t **bits);

/* The same out of an adjacency, which marks faces of three tets as it does faces of one: they are
 * told apart. Gives bits; nonmanifold_count (may be NULL) receives the number of faces with more
 * than two tets, *first_nonmanifold (may be NULL) the first of them, 4 * tet + face, or TL_NONE. */
tl_status tli_faces_boundary_of(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count,
                                const tl_lidx *opposite, uint32_t **bits, size_t *nonmanifold_count,
                                tl_lidx *first_nonmanifold);

#endif
