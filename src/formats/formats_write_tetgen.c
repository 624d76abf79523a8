/* TetGen: text .node, .ele and .face, whose indices begin with 1. */
#include "formats/formats_write_mesh.h"

#include "formats/formats_scan.h"

#include <string.h>

/* Numbers of all channels of a kind at an element. */
static uint32_t attribute_count(const tl_mesh *mesh, tl_on on)
{
    uint32_t count = 0;
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++)
        if (tl_mesh_channel(mesh, i)->on == on) count += tl_mesh_channel(mesh, i)->components;
    return count;
}

static tl_status put_attributes(tli_sink *sink, const tl_mesh *mesh, tl_on on, size_t index)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < tl_mesh_channel_count(mesh); i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        if (channel->on != on) continue;
        for (uint32_t c = 0; !st && c < channel->components; c++)
            st = tli_put_real(sink, ' ', channel->values[index * channel->components + c]);
    }
    return st ? st : tli_sink_write(sink, "\n", 1);
}

static tl_status put_nodes(tl_ctx *ctx, tli_sink *sink, const tl_mesh *mesh)
{
    const size_t count = tl_mesh_vert_count(mesh);
    tl_status st =
        tli_sink_printf(sink, "%zu 3 %u 0\n", count, attribute_count(mesh, TL_ON_VERTEX));
    for (size_t v = 0; !st && v < count; v++) {
        st = tli_sink_printf(sink, "%zu", v + 1);
        for (int axis = 0; !st && axis < 3; axis++)
            st = tli_put_real(sink, ' ', tl_mesh_xyz(mesh)[3 * v + (size_t)axis]);
        if (!st) st = put_attributes(sink, mesh, TL_ON_VERTEX, v);
        if (!st) st = tli_write_progress(ctx, v, count);
    }
    return st;
}

static tl_status put_tets(tl_ctx *ctx, tli_sink *sink, const tl_mesh *mesh)
{
    const size_t count = tl_mesh_tet_count(mesh);
    const int32_t *regions = tl_mesh_regions(mesh);
    uint32_t attributes = attribute_count(mesh, TL_ON_TET) + (regions != NULL);
    tl_status st = tli_sink_printf(sink, "%zu 4 %u\n", count, attributes);
    for (size_t t = 0; !st && t < count; t++) {
        const tl_lidx *tet = tl_mesh_tets(mesh) + 4 * t;
        st = tli_sink_printf(sink, "%zu %u %u %u %u", t + 1, tet[0] + 1, tet[1] + 1, tet[2] + 1,
                             tet[3] + 1);
        if (!st && regions) st = tli_sink_printf(sink, " %d", regions[t]);
        if (!st) st = put_attributes(sink, mesh, TL_ON_TET, t);
        if (!st) st = tli_write_progress(ctx, t, count);
    }
    return st;
}

static tl_status put_faces(tl_ctx *ctx, tli_sink *sink, const tl_mesh *mesh)
{
    tli_written_faces list;
    tl_status st = tli_written_faces_create(ctx, mesh, &list);
    if (st) return st;
    st = tli_sink_printf(sink, "%zu 1\n", list.count);
    for (size_t f = 0; !st && f < list.count; f++) {
        tl_lidx v[3];
        tli_face_verts(mesh, list.faces[f], v);
        st = tli_sink_printf(sink, "%zu %u %u %u %d\n", f + 1, v[0] + 1, v[1] + 1, v[2] + 1,
                             list.ids[f]);
    }
    tli_written_faces_release(ctx, &list);
    return st;
}

static tl_status write_part(tl_ctx *ctx, const tl_mesh *mesh, const char *path, const char *ending,
                            tl_status (*put)(tl_ctx *ctx, tli_sink *sink, const tl_mesh *mesh))
{
    char *name = NULL;
    tli_sink *sink = NULL;
    tl_status st = tli_path_with_ending(ctx, path, strlen(strrchr(path, '.')), ending, &name);
    if (!st) st = tli_sink_open(ctx, name, &sink);
    if (!st) st = put(ctx, sink, mesh);
    tl_status end = tli_sink_close(sink, !st);
    if (!st) st = end;
    if (st) tl_note(ctx, st, "while writing '%s'", name ? name : path);
    tl_mem_free(ctx, name);
    return st;
}

tl_status tli_write_tetgen(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii)
{
    (void)ascii; /* it is text in any case */
    tl_status st = write_part(ctx, mesh, path, ".node", put_nodes);
    if (!st) st = write_part(ctx, mesh, path, ".ele", put_tets);
    if (!st && tl_mesh_label_count(mesh)) st = write_part(ctx, mesh, path, ".face", put_faces);
    if (!st && tl_mesh_channel_count(mesh))
        tl_log(ctx, TL_LOG_INFO, "'%s': channels are attributes, without their names", path);
    return st;
}
