/* CGNS trees in HDF5: a node is a group with attributes name, label and type; its array is the data
 * set " data", whose dimensions run the other way round. */
#include "formats/formats_cgns.h"
#include "formats/formats_hdf5.h"

#include <stdio.h>
#include <string.h>

/* Values converted at a time. */
#define CHUNK 65536

typedef struct visit {
    tli_cg *cg;
    tli_cg_node *node;
    char path[TLI_H5_PATH_MAX];
    unsigned depth;
} visit;

static tl_status read_group(tli_cg *cg, const char *path, unsigned depth, tli_cg_node *parent);

static tl_status visit_member(void *arg, const char *name)
{
    visit *v = arg;
    char path[TLI_H5_PATH_MAX];
    if (name[0] == ' ') return TL_OK; /* " data", " format" and their like */
    int n = snprintf(path, sizeof path, "%s/%s", v->path, name);
    if (n < 0 || (size_t)n >= sizeof path) return TL_OK;
    if (tli_h5_at(v->cg->h5, path) != TLI_H5_GROUP) return TL_OK;
    return read_group(v->cg, path, v->depth + 1, v->node);
}

static tl_status describe_data(tli_cg *cg, const char *path, tli_cg_node *node)
{
    tli_h5_data data;
    char data_path[TLI_H5_PATH_MAX + 8];
    snprintf(data_path, sizeof data_path, "%s/ data", path);
    if (tli_h5_at(cg->h5, data_path) != TLI_H5_DATA) {
        memcpy(node->type, "MT", 3);
        return TL_OK;
    }
    tl_status st = tli_h5_describe(cg->h5, data_path, &data);
    if (st) return st;
    if (data.is_text || data.is_other) memcpy(node->type, "MT", 3);
    node->rank = data.rank;
    for (uint32_t d = 0; d < data.rank; d++) node->dims[d] = data.dims[data.rank - 1 - d];
    return tli_cg_count(node) ? TL_OK : tli_cg_fail(cg, node, "has dimensions that can't be");
}

static tl_status read_group(tli_cg *cg, const char *path, unsigned depth, tli_cg_node *parent)
{
    tl_status st = TL_OK;
    visit *v = tl_mem_zalloc(cg->ctx, 1, sizeof *v, &st);
    if (!st) *v = (visit){.cg = cg, .depth = depth, .node = tli_cg_add(cg, parent, &st)};
    if (!st && depth > TLI_CG_DEPTH_MAX)
        st = tl_fail(cg->ctx, TL_ERR_FORMAT, "'%s': too many levels at '%s'", cg->path, path);
    if (!st) {
        char text[64];
        snprintf(v->path, sizeof v->path, "%s", strcmp(path, "/") == 0 ? "" : path);
        const char *slash = strrchr(path, '/');
        snprintf(v->node->name, TLI_CG_NAME, "%.32s", slash ? slash + 1 : path);
        if (tli_h5_attribute_text(cg->h5, path, "label", text, sizeof text))
            snprintf(v->node->label, TLI_CG_NAME, "%.32s", text);
        memcpy(v->node->type, "MT", 3);
        if (tli_h5_attribute_text(cg->h5, path, "type", text, sizeof text))
            snprintf(v->node->type, sizeof v->node->type, "%.2s", text);
        if (strcmp(v->node->type, "LK") == 0) cg->links_left_out++;
        st = describe_data(cg, path, v->node);
    }
    if (!st) st = tli_h5_members(cg->h5, path, visit_member, v);
    tl_mem_free(cg->ctx, v);
    return st;
}

tl_status tli_cg_hdf5_open(tli_cg *cg)
{
    tl_status st = tli_h5_open(cg->ctx, cg->path, cg->map, &cg->h5);
    return st ? st : read_group(cg, "/", 0, NULL);
}

void tli_cg_hdf5_close(tli_cg *cg)
{
    tli_h5_close(cg->h5);
    cg->h5 = NULL;
}

/* Row by row of the slowest dimension, long rows piece by piece. */
tl_status tli_cg_hdf5_reals(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                            double *out, size_t stride)
{
    char path[TLI_H5_PATH_MAX + 8];
    uint64_t begin[TLI_CG_RANK_MAX] = {0}, size[TLI_CG_RANK_MAX], row = 1;
    tl_status st = TL_OK;
    tli_cg_path(node, path, TLI_H5_PATH_MAX);
    memcpy(path + strlen(path), "/ data", sizeof "/ data");
    for (uint32_t d = 0; d < node->rank; d++) size[d] = node->dims[node->rank - 1 - d];
    for (uint32_t d = 1; d < node->rank; d++) row *= size[d];
    uint64_t rows_at_once = row ? CHUNK / row + 1 : 1;
    double *values = tl_mem_alloc(cg->ctx, (size_t)(rows_at_once * row), sizeof *values, &st);
    for (uint64_t at = first; at < first + count && !st;) {
        uint64_t rows = size[0] - at / row;
        begin[0] = at / row;
        size[0] = rows < rows_at_once ? rows : rows_at_once;
        st = tli_h5_reals(cg->h5, path, begin, size, values);
        uint64_t end = (begin[0] + size[0]) * row, base = begin[0] * row;
        if (end > first + count) end = first + count;
        for (; at < end && !st; at++) out[(at - first) * stride] = values[at - base];
        size[0] = node->dims[node->rank - 1];
    }
    tl_mem_free(cg->ctx, values);
    return st;
}
