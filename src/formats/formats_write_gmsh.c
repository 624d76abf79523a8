/* Gmsh MSH 2.2, binary or text: labels as triangles, then tets, in their order, tagged by physical
 * groups; values of channels behind them. Version 2.2, since any order of elements may stand in it,
 * and every program that reads Gmsh files reads it. */
#include "formats/formats_write_mesh.h"

#include "mesh/mesh.h"

#include <math.h>
#include <string.h>

#define TRIANGLE 2
#define TETRA 4
#define TAGS 2 /* of an element: physical group, entity */

typedef struct writer {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    tli_sink *sink;
    bool ascii;
    tli_written_faces faces;
    int64_t region_add, label_add; /* groups begin with 1 */
} writer;

/* ---- numbers ---- */

static tl_status put_ints(writer *w, const int32_t *values, size_t count)
{
    tl_status st = TL_OK;
    if (!w->ascii) return tli_sink_write(w->sink, values, count * sizeof *values);
    for (size_t i = 0; !st && i < count; i++)
        st = tli_sink_printf(w->sink, i ? " %d" : "%d", values[i]);
    return st;
}

static tl_status put_reals(writer *w, const double *values, size_t count)
{
    tl_status st = TL_OK;
    if (!w->ascii) return tli_sink_write(w->sink, values, count * sizeof *values);
    for (size_t i = 0; !st && i < count; i++) st = tli_put_real(w->sink, ' ', values[i]);
    return st ? st : tli_sink_write(w->sink, "\n", 1);
}

/* ---- groups ---- */

/* What is added to all ids so that the smallest is at least 1. */
static int64_t lift(int64_t smallest)
{
    return smallest < 1 ? 1 - smallest : 0;
}

static tl_status find_groups(writer *w)
{
    const int32_t *regions = tl_mesh_regions(w->mesh);
    const size_t tets = tl_mesh_tet_count(w->mesh), labels = tl_mesh_label_count(w->mesh);
    int64_t low = 1, high = 1, low_label = 1, high_label = 1;
    for (size_t t = 0; regions && t < tets; t++) {
        if (regions[t] < low) low = regions[t];
        if (regions[t] > high) high = regions[t];
    }
    for (size_t i = 0; i < labels; i++) {
        const tl_label *label = tl_mesh_label(w->mesh, i);
        if (label->id < low_label) low_label = label->id;
        if (label->id > high_label) high_label = label->id;
    }
    w->region_add = lift(low);
    w->label_add = lift(low_label);
    if (high + w->region_add > INT32_MAX || high_label + w->label_add > INT32_MAX)
        return tl_fail(w->ctx, TL_ERR_UNSUPPORTED,
                       "regions or labels of more than 31 bits, which Gmsh can't have");
    if (w->region_add || w->label_add)
        tl_log(w->ctx, TL_LOG_INFO,
               "groups of Gmsh begin with 1: %lld added to regions, %lld to labels",
               (long long)w->region_add, (long long)w->label_add);
    if (w->faces.count + tets > INT32_MAX || tl_mesh_vert_count(w->mesh) > INT32_MAX)
        return tl_fail(w->ctx, TL_ERR_UNSUPPORTED,
                       "%zu elements, %zu vertices: MSH 2.2 holds 2^31 - 1", w->faces.count + tets,
                       tl_mesh_vert_count(w->mesh));
    return TL_OK;
}

/* Names stand in quotes, where none may stand. */
static tl_status put_quoted(writer *w, const char *name)
{
    char plain[256];
    size_t n = 0;
    for (; name[n] && n + 1 < sizeof plain; n++)
        plain[n] = name[n] == '"' || name[n] == '\n' || name[n] == '\r' ? '\'' : name[n];
    plain[n] = '\0';
    return tli_sink_printf(w->sink, "\"%s\"\n", plain);
}

static tl_status put_name(writer *w, int dimension, int64_t id, const char *name)
{
    tl_status st = tli_sink_printf(w->sink, "%d %lld ", dimension, (long long)id);
    return st ? st : put_quoted(w, name);
}

static tl_status put_names(writer *w)
{
    const tl_mesh *mesh = w->mesh;
    size_t count = mesh->region_name_count;
    for (size_t i = 0; i < tl_mesh_label_count(mesh); i++)
        count += tl_mesh_label(mesh, i)->name[0] != 0;
    if (count == 0) return TL_OK;
    tl_status st = tli_sink_printf(w->sink, "$PhysicalNames\n%zu\n", count);
    for (size_t i = 0; !st && i < tl_mesh_label_count(mesh); i++) {
        const tl_label *label = tl_mesh_label(mesh, i);
        if (label->name[0]) st = put_name(w, 2, label->id + w->label_add, label->name);
    }
    for (size_t i = 0; !st && i < mesh->region_name_count; i++)
        st = put_name(w, 3, mesh->region_names[i].region + w->region_add,
                      mesh->region_names[i].name);
    return st ? st : tli_sink_printf(w->sink, "$EndPhysicalNames\n");
}

/* ---- mesh ---- */

static tl_status put_nodes(writer *w)
{
    const size_t count = tl_mesh_vert_count(w->mesh);
    tl_status st = tli_sink_printf(w->sink, "$Nodes\n%zu\n", count);
    for (size_t v = 0; !st && v < count; v++) {
        const int32_t tag = (int32_t)(v + 1);
        st = put_ints(w, &tag, 1);
        if (!st) st = put_reals(w, tl_mesh_xyz(w->mesh) + 3 * v, 3);
        if (!st) st = tli_write_progress(w->ctx, v, count + tl_mesh_tet_count(w->mesh));
    }
    return st ? st : tli_sink_printf(w->sink, "%s$EndNodes\n", w->ascii ? "" : "\n");
}

/* Binary: a head before all elements of a kind; text: kind and number of tags in each line. */
static tl_status begin_kind(writer *w, int32_t kind, size_t count)
{
    const int32_t head[3] = {kind, (int32_t)count, TAGS};
    return w->ascii || count == 0 ? TL_OK : put_ints(w, head, 3);
}

static tl_status put_element(writer *w, size_t number, int32_t kind, int32_t group,
                             const tl_lidx *verts, int count)
{
    int32_t row[9] = {(int32_t)number};
    int used = 1;
    if (w->ascii) {
        row[used++] = kind;
        row[used++] = TAGS;
    }
    row[used++] = group;
    row[used++] = group;
    for (int i = 0; i < count; i++) row[used++] = (int32_t)(verts[i] + 1);
    tl_status st = put_ints(w, row, (size_t)used);
    return !st && w->ascii ? tli_sink_write(w->sink, "\n", 1) : st;
}

static tl_status put_elements(writer *w)
{
    const tl_mesh *mesh = w->mesh;
    const size_t tets = tl_mesh_tet_count(mesh), verts = tl_mesh_vert_count(mesh);
    const int32_t *regions = tl_mesh_regions(mesh);
    size_t number = 0;
    tl_status st = tli_sink_printf(w->sink, "$Elements\n%zu\n", w->faces.count + tets);
    if (!st) st = begin_kind(w, TRIANGLE, w->faces.count);
    for (size_t f = 0; !st && f < w->faces.count; f++) {
        tl_lidx corners[3];
        tli_face_verts(mesh, w->faces.faces[f], corners);
        st = put_element(w, ++number, TRIANGLE, (int32_t)(w->faces.ids[f] + w->label_add), corners,
                         3);
    }
    if (!st) st = begin_kind(w, TETRA, tets);
    for (size_t t = 0; !st && t < tets; t++) {
        int32_t group = regions ? (int32_t)(regions[t] + w->region_add) : 0;
        st = put_element(w, ++number, TETRA, group, tl_mesh_tets(mesh) + 4 * t, 4);
        if (!st) st = tli_write_progress(w->ctx, verts + t, verts + tets);
    }
    return st ? st : tli_sink_printf(w->sink, "%s$EndElements\n", w->ascii ? "" : "\n");
}

/* ---- values ---- */

static tl_status put_channel(writer *w, const tl_channel *channel)
{
    const bool nodes = channel->on == TL_ON_VERTEX;
    const size_t count = nodes ? tl_mesh_vert_count(w->mesh) : tl_mesh_tet_count(w->mesh);
    const size_t first = nodes ? 1 : w->faces.count + 1;
    const char *section = nodes ? "NodeData" : "ElementData";
    double time = tl_mesh_time(w->mesh);
    tl_status st = tli_sink_printf(w->sink, "$%s\n1\n", section);
    if (!st) st = put_quoted(w, channel->name);
    if (!st) st = tli_sink_write(w->sink, "1\n", 2);
    if (!st) st = tli_put_real(w->sink, ' ', isfinite(time) ? time : 0);
    if (!st) st = tli_sink_printf(w->sink, "\n3\n0\n%u\n%zu\n", channel->components, count);
    for (size_t i = 0; !st && i < count; i++) {
        const int32_t tag = (int32_t)(first + i);
        st = put_ints(w, &tag, 1);
        if (!st) st = put_reals(w, channel->values + i * channel->components, channel->components);
        if (!st) st = tli_write_progress(w->ctx, i, count);
    }
    return st ? st : tli_sink_printf(w->sink, "%s$End%s\n", w->ascii ? "" : "\n", section);
}

tl_status tli_write_gmsh(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii)
{
    const int32_t one = 1;
    writer w = {.ctx = ctx, .mesh = mesh, .ascii = ascii};
    tl_status st = tli_written_faces_create(ctx, mesh, &w.faces);
    if (!st) st = find_groups(&w);
    if (!st) st = tli_sink_open(ctx, path, &w.sink);
    if (st) {
        tli_written_faces_release(ctx, &w.faces);
        return tl_note(ctx, st, "while writing '%s'", path);
    }
    st = tli_sink_printf(w.sink, "$MeshFormat\n2.2 %d 8\n", !ascii);
    if (!st && !ascii) st = tli_sink_write(w.sink, &one, sizeof one);
    if (!st) st = tli_sink_printf(w.sink, "%s$EndMeshFormat\n", ascii ? "" : "\n");
    if (!st) st = put_names(&w);
    if (!st) st = put_nodes(&w);
    if (!st) st = put_elements(&w);
    for (size_t i = 0; !st && i < tl_mesh_channel_count(mesh); i++)
        st = put_channel(&w, tl_mesh_channel(mesh, i));
    tli_written_faces_release(ctx, &w.faces);
    tl_status end = tli_sink_close(w.sink, !st);
    if (!st) st = end;
    return st ? tl_note(ctx, st, "while writing '%s'", path) : TL_OK;
}
