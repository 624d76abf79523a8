/* Names that a mesh carries beside its numbers: named surfaces and names of regions. */
#include "mesh/mesh.h"

#include <string.h>

/* ---- regions ---- */

tl_status tl_mesh_set_region_name(tl_mesh *mesh, int32_t region, const char *name)
{
    tl_status st = TL_OK;
    size_t at = 0;
    while (at < mesh->region_name_count && mesh->region_names[at].region != region) at++;
    if (!name || !*name) {
        if (at == mesh->region_name_count) return TL_OK;
        tl_mem_free(mesh->ctx, mesh->region_names[at].name);
        mesh->region_names[at] = mesh->region_names[--mesh->region_name_count];
        return TL_OK;
    }
    char *own = tli_strdup(mesh->ctx, name, &st);
    if (at == mesh->region_name_count)
        mesh->region_names =
            tl_mem_resize(mesh->ctx, mesh->region_names, at + 1, sizeof *mesh->region_names, &st);
    if (st) {
        tl_mem_free(mesh->ctx, own);
        return st;
    }
    if (at == mesh->region_name_count)
        mesh->region_names[mesh->region_name_count++] = (tli_region_name){region, NULL};
    tl_mem_free(mesh->ctx, mesh->region_names[at].name);
    mesh->region_names[at].name = own;
    return TL_OK;
}

const char *tl_mesh_region_name(const tl_mesh *mesh, int32_t region)
{
    for (size_t i = 0; i < mesh->region_name_count; i++)
        if (mesh->region_names[i].region == region) return mesh->region_names[i].name;
    return NULL;
}

/* ---- labels ---- */

static tl_status check_faces(const tl_mesh *mesh, const tl_label *label)
{
    const char *name = label->name ? label->name : "";
    if (label->face_count && !label->faces)
        return tl_fail(mesh->ctx, TL_ERR_ARG, "label '%s': %zu faces need an array", name,
                       label->face_count);
    for (size_t i = 0; i < label->face_count; i++) {
        if (label->faces[i] / 4 >= mesh->tet_count)
            return tl_fail(mesh->ctx, TL_ERR_ARG,
                           "label '%s': face %zu is one of tet %u of a mesh of %zu tets", name, i,
                           label->faces[i] / 4, mesh->tet_count);
        if (i && label->faces[i] <= label->faces[i - 1])
            return tl_fail(mesh->ctx, TL_ERR_ARG,
                           "label '%s': face %zu (%u) is not above the one before it (%u)", name, i,
                           label->faces[i], label->faces[i - 1]);
    }
    return TL_OK;
}

tl_status tl_mesh_add_label(tl_mesh *mesh, const tl_label *label)
{
    tl_ctx *ctx = mesh->ctx;
    tl_status st = check_faces(mesh, label);
    if (st) return st;
    char *name = tli_strdup(ctx, label->name ? label->name : "", &st);
    tl_lidx *faces = tl_mem_alloc(ctx, label->face_count, sizeof *faces, &st);
    mesh->labels =
        tl_mem_resize(ctx, mesh->labels, mesh->label_count + 1, sizeof *mesh->labels, &st);
    if (st) {
        tl_mem_free(ctx, faces);
        tl_mem_free(ctx, name);
        return st;
    }
    if (label->face_count) memcpy(faces, label->faces, label->face_count * sizeof *faces);
    mesh->labels[mesh->label_count++] = (tl_label){name, label->id, label->face_count, faces};
    return TL_OK;
}

size_t tl_mesh_label_count(const tl_mesh *mesh)
{
    return mesh->label_count;
}

const tl_label *tl_mesh_label(const tl_mesh *mesh, size_t index)
{
    return &mesh->labels[index];
}

void tli_mesh_release_labels(tl_mesh *mesh)
{
    for (size_t i = 0; i < mesh->label_count; i++) {
        tl_label *label = &mesh->labels[i];
        tli_free_const(mesh->ctx, label->name);
        tli_free_const(mesh->ctx, label->faces);
    }
    for (size_t i = 0; i < mesh->region_name_count; i++)
        tl_mem_free(mesh->ctx, mesh->region_names[i].name);
    tl_mem_free(mesh->ctx, mesh->labels);
    tl_mem_free(mesh->ctx, mesh->region_names);
}
