/* VTU in pieces: sizes are known before, so that the head says where each array of each piece will
 * stand in the appended section, raw, behind its size in bytes. */
#include "formats/formats_emit.h"
#include "formats/formats_pieces.h"

#include <string.h>

enum {
    VTK_TETRA_TYPE = 10,
    CHUNK = 4096 /* numbers that are put together before they are written */
};

struct tli_pieces {
    tl_ctx *ctx;
    tli_sink *sink;
    const tli_pieces_shape *shape;
    size_t done;
    uint64_t ofs; /* head: of the next array */
};

/* ---- the head ---- */

static tl_status say_array(tli_pieces *p, const char *type, const char *name, uint32_t components,
                           uint64_t bytes)
{
    tl_status st = tli_sink_printf(p->sink, "<DataArray type=\"%s\" Name=\"", type);
    if (!st) st = tli_emit_escaped(p->sink, name);
    if (!st)
        st = tli_sink_printf(p->sink,
                             "\" NumberOfComponents=\"%u\" format=\"appended\" offset=\"%llu\"/>\n",
                             components, (unsigned long long)p->ofs);
    p->ofs += sizeof(uint64_t) + bytes;
    return st;
}

static tl_status say_channels(tli_pieces *p, tl_on on, uint64_t count)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < p->shape->channel_count; i++) {
        const tli_pieces_channel *c = &p->shape->channels[i];
        if (c->on == on)
            st = say_array(p, "Float64", c->name, c->components,
                           count * c->components * sizeof(double));
    }
    return st;
}

/* In the order in which tli_pieces_put writes. */
static tl_status say_piece(tli_pieces *p, const tli_pieces_size *size)
{
    const tli_pieces_shape *shape = p->shape;
    const uint64_t verts = size->verts, tets = size->tets;
    tl_status st =
        tli_sink_printf(p->sink, "<Piece NumberOfPoints=\"%u\" NumberOfCells=\"%u\">\n<Points>\n",
                        size->verts, size->tets);
    if (!st) st = say_array(p, "Float64", "Points", 3, verts * 3 * sizeof(double));
    if (!st) st = tli_sink_printf(p->sink, "</Points>\n<Cells>\n");
    if (!st) st = say_array(p, "UInt32", "connectivity", 1, tets * 4 * sizeof(uint32_t));
    if (!st) st = say_array(p, "UInt32", "offsets", 1, tets * sizeof(uint32_t));
    if (!st) st = say_array(p, "UInt8", "types", 1, tets);
    if (!st) st = tli_sink_printf(p->sink, "</Cells>\n<CellData>\n");
    for (int i = 0; !st && i < TLI_PIECES_LABELS && shape->labels[i]; i++)
        st = say_array(p, "UInt32", shape->labels[i], 1, tets * sizeof(uint32_t));
    if (!st && shape->has_regions) st = say_array(p, "Int32", "region", 1, tets * sizeof(int32_t));
    if (!st) st = say_channels(p, TL_ON_TET, tets);
    if (!st) st = tli_sink_printf(p->sink, "</CellData>\n<PointData>\n");
    if (!st) st = say_channels(p, TL_ON_VERTEX, verts);
    return st ? st : tli_sink_printf(p->sink, "</PointData>\n</Piece>\n");
}

tl_status tli_pieces_open(tl_ctx *ctx, const char *path, const tli_pieces_shape *shape,
                          tli_pieces **pieces)
{
    tl_status st = TL_OK;
    tli_pieces *p = tl_mem_zalloc(ctx, 1, sizeof *p, &st);
    *pieces = NULL;
    if (st) return st;
    p->ctx = ctx;
    p->shape = shape;
    st = tli_sink_open(ctx, path, &p->sink);
    if (!st)
        st = tli_sink_printf(p->sink,
                             "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" "
                             "version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\">\n"
                             "<UnstructuredGrid>\n",
                             tli_big_endian_host() ? "BigEndian" : "LittleEndian");
    for (size_t i = 0; !st && i < shape->piece_count; i++) st = say_piece(p, &shape->sizes[i]);
    if (!st)
        st = tli_sink_printf(p->sink, "</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");
    if (st) return tli_pieces_close(p, st);
    *pieces = p;
    return TL_OK;
}

/* ---- arrays ---- */

static tl_status put_array(tli_pieces *p, const void *values, uint64_t bytes)
{
    tl_status st = tli_sink_write(p->sink, &bytes, sizeof bytes);
    return st ? st : tli_sink_write(p->sink, values, (size_t)bytes);
}

/* start + i * step for i = 0, 1 ... */
static tl_status put_count(tli_pieces *p, uint32_t start, uint32_t step, uint64_t count)
{
    uint32_t numbers[CHUNK];
    uint64_t bytes = count * sizeof *numbers;
    tl_status st = tli_sink_write(p->sink, &bytes, sizeof bytes);
    for (uint64_t i = 0; !st && i < count;) {
        size_t n = 0;
        for (; n < CHUNK && i < count; n++, i++) numbers[n] = start + (uint32_t)i * step;
        st = tli_sink_write(p->sink, numbers, n * sizeof *numbers);
    }
    return st;
}

static tl_status put_types(tli_pieces *p, uint64_t count)
{
    uint8_t types[CHUNK];
    memset(types, VTK_TETRA_TYPE, sizeof types);
    tl_status st = tli_sink_write(p->sink, &count, sizeof count);
    for (uint64_t i = 0; !st && i < count; i += CHUNK)
        st = tli_sink_write(p->sink, types, count - i < CHUNK ? (size_t)(count - i) : CHUNK);
    return st;
}

/* One channel out of rows. */
static tl_status put_column(tli_pieces *p, const double *rows, size_t row, uint32_t components,
                            uint64_t count)
{
    double values[CHUNK];
    uint64_t bytes = count * components * sizeof *values;
    size_t n = 0;
    tl_status st = tli_sink_write(p->sink, &bytes, sizeof bytes);
    for (uint64_t i = 0; !st && i < count; i++)
        for (uint32_t k = 0; !st && k < components; k++) {
            values[n++] = rows[i * row + k];
            if (n < CHUNK) continue;
            st = tli_sink_write(p->sink, values, sizeof values);
            n = 0;
        }
    return st ? st : tli_sink_write(p->sink, values, n * sizeof *values);
}

static tl_status put_channels(tli_pieces *p, tl_on on, const double *rows, uint64_t count)
{
    tl_status st = TL_OK;
    size_t row = 0;
    for (size_t i = 0; i < p->shape->channel_count; i++)
        if (p->shape->channels[i].on == on) row += p->shape->channels[i].components;
    for (size_t i = 0; !st && i < p->shape->channel_count; i++) {
        const tli_pieces_channel *c = &p->shape->channels[i];
        if (c->on != on) continue;
        st = put_column(p, rows, row, c->components, count);
        rows += c->components;
    }
    return st;
}

tl_status tli_pieces_put(tli_pieces *p, const tli_pieces_mesh *mesh)
{
    const tli_pieces_shape *shape = p->shape;
    TL_ASSERT(p->done < shape->piece_count);
    const uint64_t verts = shape->sizes[p->done].verts, tets = shape->sizes[p->done].tets;
    tl_status st = put_array(p, mesh->xyz, verts * 3 * sizeof *mesh->xyz);
    if (!st) st = put_array(p, mesh->tets, tets * 4 * sizeof *mesh->tets);
    if (!st) st = put_count(p, 4, 4, tets);
    if (!st) st = put_types(p, tets);
    for (int i = 0; !st && i < TLI_PIECES_LABELS && shape->labels[i]; i++)
        st = put_count(p, mesh->labels[i], 0, tets);
    if (!st && shape->has_regions) st = put_array(p, mesh->regions, tets * sizeof *mesh->regions);
    if (!st) st = put_channels(p, TL_ON_TET, mesh->tet_rows, tets);
    if (!st) st = put_channels(p, TL_ON_VERTEX, mesh->vert_rows, verts);
    p->done++;
    return st ? st : tl_progress(p->ctx, "write", p->done, shape->piece_count);
}

tl_status tli_pieces_close(tli_pieces *p, tl_status st)
{
    if (!p) return st;
    TL_ASSERT(st || p->done == p->shape->piece_count);
    if (!st) st = tli_sink_printf(p->sink, "\n</AppendedData>\n</VTKFile>\n");
    if (p->sink) {
        tl_status end = tli_sink_close(p->sink, !st);
        st = st ? st : end;
    }
    tl_mem_free(p->ctx, p);
    return st;
}
