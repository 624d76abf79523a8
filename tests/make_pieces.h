/* A grid in nine pieces, as patches of a cut, beside the whole. Plain malloc. */
#ifndef TETRALOD_TESTS_MAKE_PIECES_H
#define TETRALOD_TESTS_MAKE_PIECES_H

#include "tetralod/codec.h"

#include "check.h"
#include "make_mesh.h"

enum { PIECES = 9, GRID = 9 };

typedef struct piece {
    tl_patch patch;
    tl_lidx *tet_of; /* [tet_count] tet of the whole mesh */
} piece;

typedef struct pieces {
    make_mesh whole;
    tl_lidx *opposite;          /* of the whole mesh */
    uint32_t *piece_of, *local; /* [tet_count] */
    piece list[PIECES];
} pieces;

/* Piece number of a tet, in clumps. */
static inline uint32_t choose_piece(const make_mesh *m, size_t t)
{
    const double *x = m->xyz + 3 * (size_t)m->tets[4 * t];
    return (uint32_t)(x[0] * 2.99) * 3 + (uint32_t)(x[1] * 2.99);
}

static inline void fill_piece(tl_ctx *ctx, pieces *p, uint32_t number, const uint8_t *shared)
{
    const make_mesh *m = &p->whole;
    tl_patch *patch = &p->list[number].patch;
    uint16_t *verts = calloc(m->vert_count, sizeof *verts); /* local number + 1 */
    size_t room = m->tet_count;
    tl_lidx *tets = malloc(room * 4 * sizeof *tets), *opposite = NULL;
    p->list[number].tet_of = malloc(room * sizeof(tl_lidx));
    patch->places = malloc(m->vert_count * sizeof *patch->places);
    patch->shared = malloc(m->vert_count);
    patch->tets = malloc(room * sizeof *patch->tets);
    if (!verts || !tets || !p->list[number].tet_of || !patch->places || !patch->shared ||
        !patch->tets)
        abort();
    for (size_t t = 0; t < m->tet_count; t++) {
        if (p->piece_of[t] != number) continue;
        for (int j = 0; j < 4; j++) {
            tl_lidx v = m->tets[4 * t + (size_t)j];
            if (!verts[v]) {
                for (int k = 0; k < 3; k++)
                    patch->places[patch->vert_count][k] =
                        (int64_t)(m->xyz[3 * (size_t)v + (size_t)k] * 1000);
                patch->shared[patch->vert_count] = shared[v];
                verts[v] = (uint16_t)++patch->vert_count;
            }
            patch->tets[patch->tet_count][j] = (uint16_t)(verts[v] - 1);
            tets[4 * (size_t)patch->tet_count + (size_t)j] = verts[v] - 1u;
        }
        p->list[number].tet_of[patch->tet_count] = (tl_lidx)t;
        p->local[t] = patch->tet_count++;
    }
    CHECK_OK(ctx,
             tl_tets_adjacency(ctx, tets, patch->tet_count, patch->vert_count, &opposite, NULL));
    patch->opposite = malloc(((size_t)patch->tet_count + 1) * sizeof *patch->opposite);
    if (!patch->opposite) abort();
    memcpy(patch->opposite, opposite, patch->tet_count * sizeof *patch->opposite);
    tl_mem_free(ctx, opposite);
    free(tets);
    free(verts);
}

static inline void make_pieces(tl_ctx *ctx, pieces *p)
{
    memset(p, 0, sizeof *p);
    p->whole = make_grid(GRID);
    const make_mesh *m = &p->whole;
    CHECK_OK(ctx, tl_tets_adjacency(ctx, m->tets, m->tet_count, m->vert_count, &p->opposite, NULL));
    p->piece_of = malloc(m->tet_count * sizeof *p->piece_of);
    p->local = malloc(m->tet_count * sizeof *p->local);
    uint32_t *seen = malloc(m->vert_count * sizeof *seen);
    uint8_t *shared = calloc(m->vert_count, 1);
    if (!p->piece_of || !p->local || !seen || !shared) abort();
    memset(seen, 0xff, m->vert_count * sizeof *seen);
    for (size_t t = 0; t < m->tet_count; t++) {
        p->piece_of[t] = choose_piece(m, t);
        for (size_t j = 0; j < 4; j++) {
            tl_lidx v = m->tets[4 * t + j];
            if (seen[v] != TL_NONE && seen[v] != p->piece_of[t]) shared[v] = 1;
            seen[v] = p->piece_of[t];
        }
    }
    for (uint32_t i = 0; i < PIECES; i++) fill_piece(ctx, p, i, shared);
    free(shared);
    free(seen);
}

static inline void drop_pieces(tl_ctx *ctx, pieces *p)
{
    for (int i = 0; i < PIECES; i++) {
        tl_patch *patch = &p->list[i].patch;
        free(patch->places);
        free(patch->tets);
        free(patch->shared);
        free(patch->opposite);
        free(p->list[i].tet_of);
    }
    free(p->piece_of);
    free(p->local);
    tl_mem_free(ctx, p->opposite);
    make_release(&p->whole);
}

#endif
