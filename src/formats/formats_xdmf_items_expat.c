/* XDMF: arrays (DataItem), as text in the XML, in HDF5 or in a file of bytes. */
#include "formats/formats_hdf5.h"
#include "formats/formats_number.h"
#include "formats/formats_xdmf.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* References that lead to references ... */
#define REFERENCES_MAX 8
#define DIMENSIONS_MAX 8

tl_status tli_xd_fail(const tli_xdmf *x, const tli_xd_node *node, const char *what)
{
    return tl_fail(x->ctx, TL_ERR_FORMAT, "'%s': %s '%s' %s", x->source->path, node->name,
                   tli_xd_value(node, "Name", ""), what);
}

tl_status tli_xd_real(const tli_xdmf *x, const tli_xd_node *node, const char *name, double *value)
{
    const char *text = node ? tli_xd_value(node, name, "") : "";
    if (!*text || tli_number_f64(text, text + strlen(text), value)) return TL_OK;
    return tl_fail(x->ctx, TL_ERR_FORMAT, "'%s': %s has '%s' for %s, expected a number",
                   x->source->path, node->name, tl_text_name(text).s, name);
}

/* ---- what an item says ---- */

typedef struct item {
    const tli_xd_node *node;
    uint64_t dims[DIMENSIONS_MAX], count;
    unsigned rank;
    tl_scalar scalar;
    const char *format;
} item;

static tl_status take_dimensions(const tli_xdmf *x, item *it)
{
    const char *at = tli_xd_value(it->node, "Dimensions", "");
    it->count = 1;
    for (; *(at += strspn(at, " \t\r\n")); it->rank++) {
        char *end;
        if (*at < '0' || *at > '9' || it->rank == DIMENSIONS_MAX)
            return tli_xd_fail(x, it->node, "has no dimensions that are read");
        it->dims[it->rank] = strtoull(at, &end, 10);
        at = end;
        if (it->dims[it->rank] && it->count > UINT64_MAX / 64 / it->dims[it->rank])
            return tli_xd_fail(x, it->node, "is endless");
        it->count *= it->dims[it->rank];
    }
    return it->rank ? TL_OK : tli_xd_fail(x, it->node, "has no dimensions");
}

static tl_scalar scalar_of(const tli_xd_node *node)
{
    const char *kind = tli_xd_value(node, "NumberType", tli_xd_value(node, "DataType", "Float"));
    unsigned long bytes = strtoul(tli_xd_value(node, "Precision", "4"), NULL, 10);
    if (tli_xd_same(kind, "Char")) return TL_I8;
    if (tli_xd_same(kind, "UChar")) return TL_U8;
    if (tli_xd_same(kind, "Int"))
        return bytes == 8 ? TL_I64 : bytes == 2 ? TL_I16 : bytes == 1 ? TL_I8 : TL_I32;
    if (tli_xd_same(kind, "UInt"))
        return bytes == 8 ? TL_U64 : bytes == 2 ? TL_U16 : bytes == 1 ? TL_U8 : TL_U32;
    return bytes == 8 ? TL_F64 : TL_F32;
}

/* Follows Reference="XML", whose text is a path to another item. */
static tl_status open_item(const tli_xdmf *x, const tli_xd_node *node, item *it)
{
    *it = (item){.node = node};
    for (int i = 0; *tli_xd_value(it->node, "Reference", ""); i++) {
        const char *path = it->node->text ? it->node->text : "";
        const tli_xd_node *other = tli_xd_find(x, path + strspn(path, " \t\r\n"));
        if (!other || i == REFERENCES_MAX)
            return tli_xd_fail(x, node, "refers to what there is none of");
        it->node = other;
    }
    const char *type = tli_xd_value(it->node, "ItemType", "Uniform");
    if (!tli_xd_same(type, "Uniform"))
        return tl_fail(x->ctx, TL_ERR_UNSUPPORTED, "'%s': a DataItem of type '%s'; Uniform is read",
                       x->source->path, type);
    it->format = tli_xd_value(it->node, "Format", "XML");
    it->scalar = scalar_of(it->node);
    return take_dimensions(x, it);
}

/* ---- other files ---- */

void tli_xd_close_data(tli_xdmf *x)
{
#if TETRALOD_WITH_HDF5
    tli_h5_close(x->h5);
#endif
    x->h5 = NULL;
    if (x->data_path) tli_map_close(x->ctx, &x->data_map);
    tl_mem_free(x->ctx, x->data_path);
    x->data_path = NULL;
}

static tl_status open_file(tli_xdmf *x, const char *name, bool hdf5)
{
    tl_status st = TL_OK;
    char *path = tli_path_beside(x->ctx, x->source->path, name, &st);
    if (!st && x->data_path && strcmp(path, x->data_path) == 0 && hdf5 == (x->h5 != NULL)) {
        tl_mem_free(x->ctx, path);
        return TL_OK;
    }
    tli_xd_close_data(x);
    if (!st) st = tli_map_open(x->ctx, path, &x->data_map);
    if (st) {
        tl_mem_free(x->ctx, path);
        return tl_note(x->ctx, st, "named by '%s'", x->source->path);
    }
    x->data_path = path;
#if TETRALOD_WITH_HDF5
    if (hdf5) st = tli_h5_open(x->ctx, path, &x->data_map, &x->h5);
#else
    if (hdf5)
        st = tl_fail(x->ctx, TL_ERR_UNSUPPORTED,
                     "'%s': in HDF5, which this build can't read: it was made without HDF5 (Debian "
                     "package libhdf5-dev)",
                     path);
#endif
    return st ? tl_note(x->ctx, st, "named by '%s'", x->source->path) : TL_OK;
}

/* The text of an item without blanks at its ends, into a block of the context. */
static char *trimmed(tli_xdmf *x, const tli_xd_node *node, tl_status *st)
{
    const char *text = node->text ? node->text : "";
    text += strspn(text, " \t\r\n");
    char *own = tli_strdup(x->ctx, text, st);
    size_t length = *st ? 0 : strlen(own);
    while (length && strchr(" \t\r\n", own[length - 1])) own[--length] = '\0';
    return own;
}

/* ---- numbers ---- */

static tl_status read_text(tli_xdmf *x, const item *it, double *out)
{
    const char *at = it->node->text ? it->node->text : "", *end = at + strlen(at);
    for (uint64_t i = 0; i < it->count; i++) {
        at = tli_number_f64(at, end, &out[i]);
        if (!at) return tli_xd_fail(x, it->node, "has fewer numbers than its dimensions say");
    }
    return TL_OK;
}

static tl_status read_binary(tli_xdmf *x, const item *it, double *out)
{
    tl_status st = TL_OK;
    uint64_t seek = strtoull(tli_xd_value(it->node, "Seek", "0"), NULL, 10);
    const char *endian = tli_xd_value(it->node, "Endian", "Native");
    char *name = trimmed(x, it->node, &st);
    if (!st && !tli_xd_same(tli_xd_value(it->node, "Compression", "Raw"), "Raw"))
        st = tl_fail(x->ctx, TL_ERR_UNSUPPORTED, "'%s': packed binary items are not read",
                     x->source->path);
    if (!st) st = open_file(x, name, false);
    uint64_t size = st ? 0 : x->data_map.byte_count, bytes = tl_scalar_bytes(it->scalar);
    if (!st && (seek > size || it->count > (size - seek) / bytes))
        st = tli_xd_fail(x, it->node, "ends behind its file");
    if (!st)
        tli_widen(x->data_map.bytes + seek, it->scalar, tli_xd_same(endian, "Big"), it->count, out);
    tl_mem_free(x->ctx, name);
    return st;
}

/* "file.h5:/path/in/it" */
static tl_status open_hdf(tli_xdmf *x, const item *it, char **name, const char **path)
{
    tl_status st = TL_OK;
    *name = trimmed(x, it->node, &st);
    char *colon = st ? NULL : strrchr(*name, ':');
    if (!st && (!colon || colon == *name)) st = tli_xd_fail(x, it->node, "names no HDF5 data set");
    if (st) return st;
    *colon = '\0';
    *path = colon + 1;
    return open_file(x, *name, true);
}

static tl_status read_hdf(tli_xdmf *x, const item *it, double *out)
{
    char *name = NULL;
    const char *path = NULL;
    tl_status st = open_hdf(x, it, &name, &path);
#if TETRALOD_WITH_HDF5
    tli_h5_data data;
    const uint64_t begin[TLI_H5_RANK_MAX] = {0};
    if (!st) st = tli_h5_describe(x->h5, path, &data);
    if (!st && data.count != it->count)
        st = tli_xd_fail(x, it->node, "has other dimensions than its HDF5 data set");
    if (!st) st = tli_h5_reals(x->h5, path, begin, data.dims, out);
#else
    (void)out;
#endif
    tl_mem_free(x->ctx, name);
    return st;
}

/* ---- doors ---- */

/* Before anything is allocated: is there room for so many numbers where they are said to be? */
static tl_status check_room(tli_xdmf *x, item *it)
{
    char *name = NULL;
    const char *path = NULL;
    tl_status st = TL_OK;
    if (tli_xd_same(it->format, "XML")) {
        if (it->count > it->node->text_bytes / 2 + 1)
            st = tli_xd_fail(x, it->node, "has fewer numbers than its dimensions say");
    } else if (tli_xd_same(it->format, "HDF")) {
        st = open_hdf(x, it, &name, &path);
#if TETRALOD_WITH_HDF5
        tli_h5_data data;
        if (!st) st = tli_h5_describe(x->h5, path, &data);
        if (!st && data.count != it->count)
            st = tli_xd_fail(x, it->node, "has other dimensions than its HDF5 data set");
        if (!st) it->scalar = data.scalar;
#endif
    } else if (tli_xd_same(it->format, "Binary")) {
        char *file = trimmed(x, it->node, &st);
        if (!st) st = open_file(x, file, false);
        if (!st && it->count > x->data_map.byte_count)
            st = tli_xd_fail(x, it->node, "ends behind its file");
        tl_mem_free(x->ctx, file);
    } else {
        st = tl_fail(x->ctx, TL_ERR_UNSUPPORTED, "'%s': a DataItem of format '%s'", x->source->path,
                     it->format);
    }
    tl_mem_free(x->ctx, name);
    return st;
}

tl_status tli_xd_describe(tli_xdmf *x, const tli_xd_node *node, uint64_t *count, tl_scalar *scalar)
{
    item it;
    tl_status st = open_item(x, node, &it);
    if (!st) st = check_room(x, &it);
    if (st) return st;
    *count = it.count;
    *scalar = it.scalar;
    return TL_OK;
}

tl_status tli_xd_reals(tli_xdmf *x, const tli_xd_node *node, uint64_t count, double *out)
{
    item it;
    tl_status st = open_item(x, node, &it);
    if (!st && it.count != count) st = tli_xd_fail(x, node, "has another size than expected");
    if (st) return st;
    if (tli_xd_same(it.format, "XML")) return read_text(x, &it, out);
    return tli_xd_same(it.format, "HDF") ? read_hdf(x, &it, out) : read_binary(x, &it, out);
}
