/* Stage formats, internal: the writers that take a mesh as it is: Gmsh, Medit, TetGen, Exodus. Each
 * file appears under its name only when complete. Statuses as of tl_mesh_write. */
#ifndef TETRALOD_SRC_FORMATS_WRITE_MESH_H
#define TETRALOD_SRC_FORMATS_WRITE_MESH_H

#include "base/base_file.h"
#include "tetralod/formats.h"

/* MSH 2.2: regions and labels as physical groups with names, channels as values of one step. */
tl_status tli_write_gmsh(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii);
/* Text; regions and labels as references; channels on vertices of 1, 3 or 6 components beside it as
 * .sol. */
tl_status tli_write_medit(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii);
/* Text, .node and .ele and, where there are labels, .face, whichever is named. Channels become
 * attributes without names; the region is the first one of the cells. */
tl_status tli_write_tetgen(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii);

/* netCDF classic, one step; regions as blocks, labels as side sets, with names; components of
 * vectors and tensors as variables of their own. */
tl_status tli_write_exodus(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii);

/* ---- what they share: formats_write_mesh.c ---- */

/* A number as text that reads back the same, with a character before it. */
tl_status tli_put_real(tli_sink *sink, char before, double value);
/* Vertices of a face of a tet, 4 * tet + face, counterclockwise from outside. */
void tli_face_verts(const tl_mesh *mesh, tl_lidx face, tl_lidx verts[3]);
/* The faces of all labels, one label after the other; of a face inside of the mesh, which a label
 * holds from both sides, the one of the smaller tet. */
typedef struct tli_written_faces {
    size_t count;
    tl_lidx *faces; /* [count] 4 * tet + face */
    int32_t *ids;   /* [count] of the labels */
} tli_written_faces;
tl_status tli_written_faces_create(tl_ctx *ctx, const tl_mesh *mesh, tli_written_faces *list);
void tli_written_faces_release(tl_ctx *ctx, tli_written_faces *list);
/* Reports progress every so many items; TL_ERR_CANCELLED. */
tl_status tli_write_progress(tl_ctx *ctx, size_t done, size_t total);

#endif
