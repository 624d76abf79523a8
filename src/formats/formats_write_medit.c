/* Medit: a text .mesh, version 2, with regions and labels as references, and a .sol of the channels
 * on vertices that the format knows: scalars, vectors and symmetric tensors, which go from xx yy zz
 * xy yz xz to its own order xx xy yy xz yz zz. */
#include "formats/formats_write_mesh.h"

#include "formats/formats_scan.h"

#include <string.h>

static const uint8_t tensor_order[6] = {0, 3, 1, 5, 4, 2};

static tl_status put_row(tli_sink *sink, const tl_lidx *verts, int count, int32_t reference)
{
    tl_status st = TL_OK;
    for (int i = 0; !st && i < count; i++) st = tli_sink_printf(sink, "%u ", verts[i] + 1);
    return st ? st : tli_sink_printf(sink, "%d\n", reference);
}

static tl_status put_vertices(tl_ctx *ctx, tli_sink *sink, const tl_mesh *mesh)
{
    const size_t count = tl_mesh_vert_count(mesh);
    tl_status st = tli_sink_printf(sink, "Vertices\n%zu\n", count);
    for (size_t v = 0; !st && v < count; v++) {
        for (int axis = 0; !st && axis < 3; axis++)
            st = tli_put_real(sink, ' ', tl_mesh_xyz(mesh)[3 * v + (size_t)axis]);
        if (!st) st = tli_sink_write(sink, " 0\n", 3);
        if (!st) st = tli_write_progress(ctx, v, count);
    }
    return st;
}

static tl_status put_cells(tl_ctx *ctx, tli_sink *sink, const tl_mesh *mesh)
{
    const size_t tets = tl_mesh_tet_count(mesh);
    const int32_t *regions = tl_mesh_regions(mesh);
    tli_written_faces list;
    tl_status st = tli_written_faces_create(ctx, mesh, &list);
    if (st) return st;
    if (list.count) st = tli_sink_printf(sink, "Triangles\n%zu\n", list.count);
    for (size_t f = 0; !st && f < list.count; f++) {
        tl_lidx verts[3];
        tli_face_verts(mesh, list.faces[f], verts);
        st = put_row(sink, verts, 3, list.ids[f]);
    }
    tli_written_faces_release(ctx, &list);
    if (!st) st = tli_sink_printf(sink, "Tetrahedra\n%zu\n", tets);
    for (size_t t = 0; !st && t < tets; t++) {
        st = put_row(sink, tl_mesh_tets(mesh) + 4 * t, 4, regions ? regions[t] : 0);
        if (!st) st = tli_write_progress(ctx, t, tets);
    }
    return st;
}

/* ---- values ---- */

static bool is_known(const tl_channel *channel)
{
    uint32_t n = channel->components;
    return channel->on == TL_ON_VERTEX && (n == 1 || n == 3 || n == 6);
}

static tl_status put_tuple(tli_sink *sink, const tl_channel *channel, size_t vert)
{
    const double *values = channel->values + vert * channel->components;
    tl_status st = TL_OK;
    for (uint32_t c = 0; !st && c < channel->components; c++)
        st = tli_put_real(sink, ' ', values[channel->components == 6 ? tensor_order[c] : c]);
    return st;
}

static tl_status put_values(tl_ctx *ctx, tli_sink *sink, const tl_mesh *mesh, size_t fields)
{
    const size_t count = tl_mesh_vert_count(mesh), channels = tl_mesh_channel_count(mesh);
    tl_status st = tli_sink_printf(
        sink, "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n%zu\n%zu", count, fields);
    for (size_t i = 0; !st && i < channels; i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        if (!is_known(channel)) continue;
        st = tli_sink_printf(sink, " %d",
                             channel->components == 1   ? 1
                             : channel->components == 3 ? 2
                                                        : 3);
    }
    if (!st) st = tli_sink_write(sink, "\n", 1);
    for (size_t v = 0; !st && v < count; v++) {
        for (size_t i = 0; !st && i < channels; i++)
            if (is_known(tl_mesh_channel(mesh, i)))
                st = put_tuple(sink, tl_mesh_channel(mesh, i), v);
        if (!st) st = tli_sink_write(sink, "\n", 1);
        if (!st) st = tli_write_progress(ctx, v, count);
    }
    return st ? st : tli_sink_printf(sink, "End\n");
}

/* NAME.sol beside NAME.mesh, where there is something for it. */
static tl_status write_values(tl_ctx *ctx, const tl_mesh *mesh, const char *path)
{
    char *name = NULL;
    tli_sink *sink = NULL;
    size_t fields = 0, left_out = 0;
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++) {
        fields += is_known(tl_mesh_channel(mesh, i));
        left_out += !is_known(tl_mesh_channel(mesh, i));
    }
    if (left_out)
        tl_log(ctx, TL_LOG_INFO,
               "'%s': %zu channels left out: Medit holds scalars, vectors and "
               "symmetric tensors on vertices",
               path, left_out);
    if (fields == 0) return TL_OK;
    tl_status st = tli_path_with_ending(ctx, path, strlen(".mesh"), ".sol", &name);
    if (!st) st = tli_sink_open(ctx, name, &sink);
    if (!st) st = put_values(ctx, sink, mesh, fields);
    tl_status end = tli_sink_close(sink, !st);
    if (!st) st = end;
    if (!st) tl_log(ctx, TL_LOG_INFO, "'%s': %zu channels, without their names", name, fields);
    tl_mem_free(ctx, name);
    return st;
}

tl_status tli_write_medit(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii)
{
    tli_sink *sink = NULL;
    (void)ascii; /* it is text in any case */
    tl_status st = tli_sink_open(ctx, path, &sink);
    if (!st) st = tli_sink_printf(sink, "MeshVersionFormatted 2\nDimension 3\n");
    if (!st) st = put_vertices(ctx, sink, mesh);
    if (!st) st = put_cells(ctx, sink, mesh);
    if (!st) st = tli_sink_printf(sink, "End\n");
    tl_status end = tli_sink_close(sink, !st);
    if (!st) st = end;
    if (!st) st = write_values(ctx, mesh, path);
    return st ? tl_note(ctx, st, "while writing '%s'", path) : TL_OK;
}
