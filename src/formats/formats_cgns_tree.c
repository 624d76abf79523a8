/* CGNS: the tree, whichever home it has. */
#include "formats/formats_cgns.h"

#include <stdio.h>
#include <string.h>

/* Values converted at a time. */
#define CHUNK 4096

/* ---- nodes ---- */

tli_cg_node *tli_cg_add(tli_cg *cg, tli_cg_node *parent, tl_status *st)
{
    if (!*st && cg->node_count >= TLI_CG_NODES_MAX)
        *st =
            tl_fail(cg->ctx, TL_ERR_FORMAT, "'%s': more than %d nodes", cg->path, TLI_CG_NODES_MAX);
    tli_cg_node *node = tli_arena_alloc(&cg->arena, 1, sizeof *node, st);
    if (*st) return NULL;
    *node = (tli_cg_node){.parent = parent};
    cg->node_count++;
    if (!parent)
        cg->root = node;
    else if (parent->last_child)
        parent->last_child->next = node;
    else
        parent->first_child = node;
    if (parent) parent->last_child = node;
    return node;
}

bool tli_cg_count(tli_cg_node *node)
{
    node->count = node->rank ? 1 : 0;
    for (uint32_t d = 0; d < node->rank; d++) {
        if (node->dims[d] && node->count > UINT64_MAX / 64 / node->dims[d]) return false;
        node->count *= node->dims[d];
    }
    return true;
}

size_t tli_cg_value_bytes(const tli_cg_node *node, tl_scalar *scalar)
{
    static const struct {
        const char *type;
        tl_scalar scalar;
    } types[] = {{"C1", TL_U8},  {"B1", TL_U8},  {"I4", TL_I32}, {"U4", TL_U32},
                 {"I8", TL_I64}, {"U8", TL_U64}, {"R4", TL_F32}, {"R8", TL_F64}};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (strcmp(node->type, types[i].type) == 0) {
            *scalar = types[i].scalar;
            return tl_scalar_bytes(types[i].scalar);
        }
    return 0;
}

void tli_cg_path(const tli_cg_node *node, char *path, size_t path_bytes)
{
    const tli_cg_node *line[TLI_CG_DEPTH_MAX + 2];
    size_t count = 0, used = 0;
    for (; node && node->parent && count < TLI_CG_DEPTH_MAX + 2; node = node->parent)
        line[count++] = node;
    path[0] = '\0';
    while (count-- > 0 && used + TLI_CG_NAME + 2 < path_bytes)
        used += (size_t)snprintf(path + used, path_bytes - used, "/%s", line[count]->name);
}

tl_status tli_cg_fail(const tli_cg *cg, const tli_cg_node *node, const char *what)
{
    char path[512];
    tli_cg_path(node, path, sizeof path);
    return tl_fail(cg->ctx, TL_ERR_FORMAT, "'%s': CGNS node '%s' %s", cg->path, path, what);
}

const tli_cg_node *tli_cg_child(const tli_cg_node *node, const char *name)
{
    for (const tli_cg_node *child = node->first_child; child; child = child->next)
        if (strcmp(child->name, name) == 0) return child;
    return NULL;
}

const tli_cg_node *tli_cg_labelled(const tli_cg_node *node, const char *label,
                                   const tli_cg_node *after)
{
    const tli_cg_node *child = after ? after->next : node->first_child;
    while (child && strcmp(child->label, label) != 0) child = child->next;
    return child;
}

/* ---- values ---- */

static tl_status check_range(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                             tl_scalar *scalar)
{
    if (tli_cg_value_bytes(node, scalar) == 0) return tli_cg_fail(cg, node, "holds no numbers");
    if (first > node->count || count > node->count - first)
        return tli_cg_fail(cg, node, "holds fewer values than are asked for");
    if (!cg->h5 && !node->bytes && count) return tli_cg_fail(cg, node, "has no data");
    return TL_OK;
}

tl_status tli_cg_reals(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                       double *out, size_t stride)
{
    tl_scalar scalar;
    tl_status st = check_range(cg, node, first, count, &scalar);
    if (st || count == 0) return st;
#if TETRALOD_WITH_HDF5
    if (cg->h5) return tli_cg_hdf5_reals(cg, node, first, count, out, stride);
#endif
    size_t bytes = tl_scalar_bytes(scalar);
    for (uint64_t done = 0; done < count;) {
        double values[CHUNK];
        uint64_t piece = count - done < CHUNK ? count - done : CHUNK;
        tli_widen(node->bytes + (first + done) * bytes, scalar, cg->big_endian, piece, values);
        for (uint64_t i = 0; i < piece; i++) out[(done + i) * stride] = values[i];
        done += piece;
    }
    return TL_OK;
}

/* Whole numbers up to 2^53 pass through float64. */
tl_status tli_cg_ints(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                      int64_t *out)
{
    tl_status st = TL_OK;
    for (uint64_t done = 0; done < count && !st;) {
        double values[CHUNK];
        uint64_t piece = count - done < CHUNK ? count - done : CHUNK;
        st = tli_cg_reals(cg, node, first + done, piece, values, 1);
        for (uint64_t i = 0; i < piece && !st; i++) {
            if (!(values[i] > -0x1p53 && values[i] < 0x1p53))
                st = tli_cg_fail(cg, node, "holds numbers that are no ids");
            else
                out[done + i] = (int64_t)values[i];
        }
        done += piece;
    }
    return st;
}

tl_status tli_cg_text(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                      char *text, size_t text_bytes)
{
    double values[256];
    text[0] = '\0';
    if (!node || strcmp(node->type, "C1") != 0 || first >= node->count) return TL_OK;
    if (count > node->count - first) count = node->count - first;
    if (count > sizeof values / sizeof *values) count = sizeof values / sizeof *values;
    if (count > text_bytes - 1) count = text_bytes - 1;
    tl_status st = tli_cg_reals(cg, node, first, count, values, 1);
    for (uint64_t i = 0; i < count && !st; i++) text[i] = (char)(int)values[i];
    size_t length = st ? 0 : (size_t)count;
    while (length && (text[length - 1] == ' ' || text[length - 1] == '\0')) length--;
    text[length] = '\0';
    return st;
}

/* ---- homes ---- */

tl_status tli_cg_open(tl_ctx *ctx, const tli_source *source, tli_cg *cg)
{
    *cg = (tli_cg){.ctx = ctx, .path = source->path, .map = &source->map};
    tli_arena_open(ctx, &cg->arena);
    if (!tli_head_begins(source, "\x89HDF\r\n\x1a\n")) return tli_adf_open(cg);
#if TETRALOD_WITH_HDF5
    return tli_cg_hdf5_open(cg);
#else
    return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                   "'%s': CGNS in HDF5, which this build can't read: it was made without HDF5 "
                   "(Debian package libhdf5-dev)",
                   source->path);
#endif
}

void tli_cg_close(tli_cg *cg)
{
#if TETRALOD_WITH_HDF5
    if (cg->h5) tli_cg_hdf5_close(cg);
#endif
    tli_arena_close(&cg->arena);
}
