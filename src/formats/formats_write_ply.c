/* PLY, binary, little-endian: vertices with normals and channels as properties, triangles as faces,
 * lines as edges. */
#include "formats/formats_write_poly.h"

#include <stdio.h>
#include <string.h>

enum { NAME_BYTES = 64, COUNT_BYTES = 1 };

/* True if name is that of a component of a vector called vector. */
static bool is_component(const char *name, const char *vector)
{
    size_t length = strlen(vector);
    return strncmp(name, vector, length) == 0 && name[length] == '_' && name[length + 1] &&
           strspn(name + length + 1, "0123456789") == strlen(name + length + 1);
}

/* The properties of a channel are called like it, unless something before them is. */
static void name_channel(const tl_polydata *p, size_t c, char name[NAME_BYTES])
{
    static const char *const FIXED[] = {"", "x", "y", "z", "nx", "ny", "nz"};
    const tl_channel *channels = p->channels;
    bool taken = false;
    tli_plain_name(channels[c].name, name, NAME_BYTES);
    for (size_t i = 0; i < sizeof FIXED / sizeof *FIXED; i++)
        taken = taken || strcmp(name, FIXED[i]) == 0;
    for (size_t i = 0; i < c && !taken; i++) {
        char other[NAME_BYTES];
        tli_plain_name(channels[i].name, other, sizeof other);
        taken = strcmp(name, other) == 0 ||
                (channels[i].components > 1 && is_component(name, other)) ||
                (channels[c].components > 1 && is_component(other, name));
    }
    if (taken) snprintf(name, NAME_BYTES, "channel%zu", c);
}

static tl_status put_head(const tli_poly_out *out)
{
    const tl_polydata *p = out->poly;
    const char *place = out->float_places ? "float" : "double";
    tl_status st = tli_sink_printf(out->sink,
                                   "ply\nformat binary_little_endian 1.0\ncomment tetralod\n"
                                   "element vertex %zu\nproperty %s x\nproperty %s y\n"
                                   "property %s z\n",
                                   p->vert_count, place, place, place);
    if (!st && p->normals)
        st =
            tli_sink_printf(out->sink, "property float nx\nproperty float ny\nproperty float nz\n");
    for (size_t c = 0; c < p->channel_count; c++) {
        char name[NAME_BYTES];
        const tl_channel *channel = &p->channels[c];
        const char *type = tli_is_single(channel) ? "float" : "double";
        name_channel(p, c, name);
        for (uint32_t k = 0; !st && k < channel->components; k++)
            st = channel->components == 1
                     ? tli_sink_printf(out->sink, "property %s %s\n", type, name)
                     : tli_sink_printf(out->sink, "property %s %s_%u\n", type, name, k);
    }
    if (!st && p->kind == TL_POLY_TRIANGLES)
        st = tli_sink_printf(out->sink,
                             "element face %zu\nproperty list uchar uint vertex_indices\n",
                             p->cell_count);
    if (!st && p->kind == TL_POLY_LINES)
        st = tli_sink_printf(out->sink,
                             "element edge %llu\nproperty uint vertex1\nproperty uint vertex2\n",
                             (unsigned long long)(out->corner_count - p->cell_count));
    return st ? st : tli_sink_printf(out->sink, "end_header\n");
}

static uint8_t *make_vert(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)arg;
    const tl_polydata *p = out->poly;
    to = tli_put_place(out, v, to);
    if (p->normals) to = tli_put_normal(out, v, to);
    for (size_t c = 0; c < p->channel_count; c++)
        to = tli_put_values(&p->channels[c], tli_is_single(&p->channels[c]), v, to);
    return to;
}

static uint8_t *make_face(const tli_poly_out *out, const void *arg, size_t cell, uint8_t *to)
{
    (void)arg;
    *to++ = 3;
    for (size_t k = 0; k < 3; k++) to = tli_le_u32(to, out->poly->corners[3 * cell + k]);
    return to;
}

/* The edges of the lines, one line after another. */
static tl_status put_edges(const tli_poly_out *out)
{
    tl_status st = TL_OK;
    const tl_polydata *p = out->poly;
    for (size_t c = 0; c < p->cell_count; c++)
        for (size_t i = p->starts[c] + 1; !st && i < p->starts[c + 1]; i++) {
            uint8_t bytes[8];
            tli_le_u32(tli_le_u32(bytes, p->corners[i - 1]), p->corners[i]);
            st = tli_sink_write(out->sink, bytes, sizeof bytes);
        }
    return st;
}

tl_status tli_write_ply(const tli_poly_out *out)
{
    const tl_polydata *p = out->poly;
    size_t bytes = 3 * sizeof(double) + 3 * sizeof(float);
    for (size_t c = 0; c < p->channel_count; c++)
        bytes += p->channels[c].components * sizeof(double);
    tl_status st = put_head(out);
    if (!st) st = tli_write_items(out, p->vert_count, bytes, make_vert, NULL);
    if (!st && p->kind == TL_POLY_TRIANGLES)
        st = tli_write_items(out, p->cell_count, COUNT_BYTES + 3 * sizeof(uint32_t), make_face,
                             NULL);
    if (!st && p->kind == TL_POLY_LINES) st = put_edges(out);
    return st;
}
