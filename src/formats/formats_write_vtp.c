/* VTP: VTK's polydata in XML, numbers raw in one appended section. */
#include "formats/formats_write_poly.h"

#include "formats/formats_emit.h"

enum { INDEX_BYTES = 8 };

/* One array of the appended section. */
typedef struct array {
    size_t count, item_bytes;
    tli_make_fn make;
    const void *arg;
} array;

/* What is behind each array's head of eight bytes. */
static tl_status put_array(const tli_poly_out *out, const array *a)
{
    uint8_t bytes[8];
    tli_le_u64(bytes, (uint64_t)a->count * a->item_bytes);
    tl_status st = tli_sink_write(out->sink, bytes, sizeof bytes);
    return st ? st : tli_write_items(out, a->count, a->item_bytes, a->make, a->arg);
}

static uint8_t *make_place(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)arg;
    return tli_put_place(out, v, to);
}

static uint8_t *make_normal(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)arg;
    return tli_put_normal(out, v, to);
}

static uint8_t *make_value(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)out;
    return tli_put_values(arg, tli_is_single(arg), v, to);
}

static uint8_t *make_corner(const tli_poly_out *out, const void *arg, size_t i, uint8_t *to)
{
    (void)arg;
    return tli_le_u64(to, out->poly->corners ? out->poly->corners[i] : i);
}

static uint8_t *make_end(const tli_poly_out *out, const void *arg, size_t cell, uint8_t *to)
{
    (void)arg;
    const tl_polydata *p = out->poly;
    return tli_le_u64(to, p->kind == TL_POLY_TRIANGLES ? 3 * (cell + 1)
                          : p->kind == TL_POLY_LINES   ? p->starts[cell + 1]
                                                       : cell + 1);
}

/* A DataArray element; *ofs moves behind the array. */
static tl_status put_element(const tli_poly_out *out, const char *type, const char *name,
                             uint32_t components, const array *a, uint64_t *ofs)
{
    tl_status st = tli_sink_printf(out->sink, "        <DataArray type=\"%s\" Name=\"", type);
    if (!st) st = tli_emit_escaped(out->sink, name);
    if (!st)
        st = tli_sink_printf(out->sink,
                             "\" NumberOfComponents=\"%u\" format=\"appended\" offset=\"%llu\"/>\n",
                             components, (unsigned long long)*ofs);
    *ofs += sizeof(uint64_t) + (uint64_t)a->count * a->item_bytes;
    return st;
}

static tl_status put_head(const tli_poly_out *out)
{
    static const char *const COUNTS[] = {"", "NumberOfVerts", "NumberOfLines", "NumberOfPolys"};
    return tli_sink_printf(out->sink,
                           "<?xml version=\"1.0\"?>\n"
                           "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
                           "header_type=\"UInt64\">\n  <PolyData>\n"
                           "    <Piece NumberOfPoints=\"%zu\" %s=\"%zu\">\n",
                           out->poly->vert_count, COUNTS[out->poly->kind], out->poly->cell_count);
}

static tl_status put_fields(const tli_poly_out *out, array *arrays, size_t *count, uint64_t *ofs)
{
    const tl_polydata *p = out->poly;
    tl_status st = tli_sink_printf(out->sink, "      <PointData%s>\n",
                                   p->normals ? " Normals=\"Normals\"" : "");
    if (!st && p->normals) {
        arrays[*count] = (array){p->vert_count, 3 * sizeof(float), make_normal, NULL};
        st = put_element(out, "Float32", "Normals", 3, &arrays[(*count)++], ofs);
    }
    for (size_t c = 0; !st && c < p->channel_count; c++) {
        const tl_channel *channel = &p->channels[c];
        bool single = tli_is_single(channel);
        size_t bytes = channel->components * (single ? sizeof(float) : sizeof(double));
        arrays[*count] = (array){p->vert_count, bytes, make_value, channel};
        st = put_element(out, single ? "Float32" : "Float64", channel->name, channel->components,
                         &arrays[(*count)++], ofs);
    }
    return st ? st : tli_sink_printf(out->sink, "      </PointData>\n");
}

static tl_status put_shape(const tli_poly_out *out, array *arrays, size_t *count, uint64_t *ofs)
{
    static const char *const CELLS[] = {"", "Verts", "Lines", "Polys"};
    const tl_polydata *p = out->poly;
    const char *place = out->float_places ? "Float32" : "Float64";
    size_t place_bytes = 3 * (out->float_places ? sizeof(float) : sizeof(double));
    size_t corners = p->corners ? (size_t)out->corner_count : p->vert_count;
    tl_status st = tli_sink_printf(out->sink, "      <Points>\n");
    arrays[*count] = (array){p->vert_count, place_bytes, make_place, NULL};
    if (!st) st = put_element(out, place, "Points", 3, &arrays[(*count)++], ofs);
    if (!st) st = tli_sink_printf(out->sink, "      </Points>\n      <%s>\n", CELLS[p->kind]);
    arrays[*count] = (array){corners, INDEX_BYTES, make_corner, NULL};
    if (!st) st = put_element(out, "Int64", "connectivity", 1, &arrays[(*count)++], ofs);
    arrays[*count] = (array){p->cell_count, INDEX_BYTES, make_end, NULL};
    if (!st) st = put_element(out, "Int64", "offsets", 1, &arrays[(*count)++], ofs);
    return st ? st : tli_sink_printf(out->sink, "      </%s>\n", CELLS[p->kind]);
}

tl_status tli_write_vtp(const tli_poly_out *out)
{
    tl_status st = TL_OK;
    uint64_t ofs = 0;
    size_t count = 0;
    /* normals and three of the shape besides the channels */
    array *arrays = tl_mem_alloc(out->ctx, out->poly->channel_count + 4, sizeof *arrays, &st);
    if (!st) st = put_head(out);
    if (!st) st = put_fields(out, arrays, &count, &ofs);
    if (!st) st = put_shape(out, arrays, &count, &ofs);
    if (!st)
        st = tli_sink_printf(out->sink, "    </Piece>\n  </PolyData>\n"
                                        "  <AppendedData encoding=\"raw\">\n_");
    for (size_t i = 0; !st && i < count; i++) st = put_array(out, &arrays[i]);
    if (!st) st = tli_sink_printf(out->sink, "\n  </AppendedData>\n</VTKFile>\n");
    tl_mem_free(out->ctx, arrays);
    return st;
}
