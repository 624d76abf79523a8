/* What the writers of Gmsh, Medit and TetGen files share. */
#include "formats/formats_write_mesh.h"

#include <string.h>

#include "base/base_sort.h"
#include "formats/formats_emit.h"
#include "mesh/mesh.h"

#define PROGRESS_ITEMS 65536

tl_status tli_put_real(tli_sink *sink, char before, double value)
{
    char text[TLI_NUMBER_BYTES + 1] = {before};
    bool narrow = tl_scalar_holds(TL_F32, value);
    int length = tli_print_real(text + 1, value, narrow ? 9 : 17);
    return tli_sink_write(sink, text, (size_t)length + 1);
}

void tli_face_verts(const tl_mesh *mesh, tl_lidx face, tl_lidx verts[3])
{
    const tl_lidx *tet = tl_mesh_tets(mesh) + 4 * (size_t)(face / 4);
    for (int i = 0; i < 3; i++) verts[i] = tet[tli_tet_faces[face % 4][i]];
}

/* ---- faces of labels ---- */

/* Sorted vertices of a face. */
static void sorted_verts(const tl_mesh *mesh, tl_lidx face, tl_lidx verts[3])
{
    tli_face_verts(mesh, face, verts);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 2; i++)
            if (verts[i] > verts[i + 1]) {
                tl_lidx swap = verts[i];
                verts[i] = verts[i + 1];
                verts[i + 1] = swap;
            }
}

static bool same_face(const tl_mesh *mesh, tl_lidx a, tl_lidx b)
{
    tl_lidx va[3], vb[3];
    sorted_verts(mesh, a, va);
    sorted_verts(mesh, b, vb);
    return memcmp(va, vb, sizeof va) == 0;
}

/* Marks the faces of a label that another of it, with a smaller index, is already. */
static tl_status mark_doubles(tl_ctx *ctx, const tl_mesh *mesh, const tl_label *label,
                              uint8_t *doubles)
{
    const size_t count = label->face_count;
    tl_status st = TL_OK;
    if (count > TL_NONE)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "label '%s' has %zu faces", label->name, count);
    uint64_t *keys = tl_mem_alloc(ctx, count, sizeof *keys, &st);
    uint32_t *order = tl_mem_alloc(ctx, count, sizeof *order, &st);
    for (size_t i = 0; !st && i < count; i++) {
        tl_lidx verts[3];
        sorted_verts(mesh, label->faces[i], verts);
        keys[i] = (uint64_t)verts[0] << 32 | verts[1];
        order[i] = (uint32_t)i;
    }
    if (!st) st = tli_sort_u64(ctx, keys, order, count); /* stable: ascending within a run */
    for (size_t first = 0, end; !st && first < count; first = end) {
        for (end = first + 1; end < count && keys[end] == keys[first]; end++)
            for (size_t other = first; other < end && !doubles[order[end]]; other++)
                doubles[order[end]] =
                    same_face(mesh, label->faces[order[other]], label->faces[order[end]]);
    }
    tl_mem_free(ctx, order);
    tl_mem_free(ctx, keys);
    return st;
}

tl_status tli_written_faces_create(tl_ctx *ctx, const tl_mesh *mesh, tli_written_faces *list)
{
    size_t total = 0, most = 0;
    tl_status st = TL_OK;
    for (size_t i = 0; i < tl_mesh_label_count(mesh); i++) {
        const size_t count = tl_mesh_label(mesh, i)->face_count;
        total += count;
        if (count > most) most = count;
    }
    *list = (tli_written_faces){.faces = tl_mem_alloc(ctx, total, sizeof *list->faces, &st)};
    list->ids = tl_mem_alloc(ctx, total, sizeof *list->ids, &st);
    uint8_t *doubles = tl_mem_alloc(ctx, most, 1, &st);
    for (size_t i = 0; !st && i < tl_mesh_label_count(mesh); i++) {
        const tl_label *label = tl_mesh_label(mesh, i);
        memset(doubles, 0, label->face_count);
        st = mark_doubles(ctx, mesh, label, doubles);
        for (size_t f = 0; !st && f < label->face_count; f++) {
            if (doubles[f]) continue;
            list->faces[list->count] = label->faces[f];
            list->ids[list->count++] = label->id;
        }
    }
    tl_mem_free(ctx, doubles);
    if (st) tli_written_faces_release(ctx, list);
    return st;
}

void tli_written_faces_release(tl_ctx *ctx, tli_written_faces *list)
{
    tl_mem_free(ctx, list->faces);
    tl_mem_free(ctx, list->ids);
    *list = (tli_written_faces){0};
}

tl_status tli_write_progress(tl_ctx *ctx, size_t done, size_t total)
{
    if (done % PROGRESS_ITEMS != 0) return TL_OK;
    return tl_progress(ctx, "write", done, total);
}
