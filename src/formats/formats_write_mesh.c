/* What the writers of Gmsh, Medit and TetGen files share. */
#include "formats/formats_write_mesh.h"

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

tl_status tli_write_progress(tl_ctx *ctx, size_t done, size_t total)
{
    if (done % PROGRESS_ITEMS != 0) return TL_OK;
    return tl_progress(ctx, "write", done, total);
}
