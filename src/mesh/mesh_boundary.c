/* Boundary triangles: the set of boundary faces (mesh_faces.c), counted and written by pieces in
 * the order of the tets. */
#include "mesh/mesh.h"
#include "mesh/mesh_faces.h"

/* Words of the set that a piece holds. */
#define PIECE_WORDS 4096

typedef struct writing {
    const tl_lidx *tets;
    const uint32_t *bits;
    size_t *begins; /* [piece_count]: faces of the piece, then its first place */
    tl_lidx *triangles, *faces;
} writing;

static uint32_t bit_count(uint32_t w)
{
    w -= w >> 1 & 0x55555555u;
    w = (w & 0x33333333u) + (w >> 2 & 0x33333333u);
    return ((w + (w >> 4)) & 0x0f0f0f0fu) * 0x01010101u >> 24;
}

static tl_status count_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    writing *out = arg;
    (void)worker;
    size_t count = 0;
    for (size_t w = begin; w < end; w++) count += bit_count(out->bits[w]);
    out->begins[begin / PIECE_WORDS] = count;
    return TL_OK;
}

static tl_status write_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    writing *out = arg;
    (void)worker;
    size_t place = out->begins[begin / PIECE_WORDS];
    for (size_t w = begin; w < end; w++) {
        uint32_t left = out->bits[w];
        for (size_t face = 32 * w; left; left >>= 1, face++) {
            if (!(left & 1)) continue;
            const tl_lidx *tet = out->tets + (face & ~(size_t)3);
            for (size_t k = 0; k < 3; k++)
                out->triangles[3 * place + k] = tet[tli_tet_faces[face & 3][k]];
            if (out->faces) out->faces[place] = (tl_lidx)face;
            place++;
        }
    }
    return TL_OK;
}

static tl_status write_triangles(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count,
                                 const uint32_t *bits, tl_lidx **triangles, tl_lidx **faces,
                                 size_t *triangle_count)
{
    writing out = {.tets = tets, .bits = bits};
    size_t word_count = tli_face_words(tet_count);
    size_t piece_count = (word_count + PIECE_WORDS - 1) / PIECE_WORDS, count = 0;
    tl_status st = TL_OK;
    out.begins = tl_mem_alloc(ctx, piece_count, sizeof *out.begins, &st);
    if (!st) st = tli_parallel(ctx, word_count, PIECE_WORDS, count_piece, &out);
    for (size_t p = 0; p < piece_count && !st; p++) {
        size_t piece = out.begins[p];
        out.begins[p] = count;
        count += piece;
    }
    out.triangles = tl_mem_alloc(ctx, count, 3 * sizeof *out.triangles, &st);
    if (faces) out.faces = tl_mem_alloc(ctx, count, sizeof *out.faces, &st);
    if (!st) st = tli_parallel(ctx, word_count, PIECE_WORDS, write_piece, &out);
    tl_mem_free(ctx, out.begins);
    if (st) {
        tl_mem_free(ctx, out.faces);
        tl_mem_free(ctx, out.triangles);
        return st;
    }
    *triangles = out.triangles;
    if (faces) *faces = out.faces;
    *triangle_count = count;
    return TL_OK;
}

tl_status tl_mesh_boundary(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                           tl_lidx **triangles, tl_lidx **faces, size_t *triangle_count)
{
    *triangles = NULL;
    if (faces) *faces = NULL;
    *triangle_count = 0;
    uint32_t *bits = NULL;
    tl_status st =
        opposite
            ? tli_faces_boundary_of(ctx, mesh->tets, mesh->tet_count, opposite, &bits, NULL, NULL)
            : tli_faces_boundary(ctx, mesh->tets, mesh->tet_count, mesh->vert_count, &bits);
    if (!st)
        st = write_triangles(ctx, mesh->tets, mesh->tet_count, bits, triangles, faces,
                             triangle_count);
    tl_mem_free(ctx, bits);
    return st;
}
