/* HDF5 through its library. Failures come as numbers without text (the library's own printing is
 * switched off for the time of the call), so each message says what was asked of which path. */
#include "formats/formats_hdf5.h"

#include <hdf5.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>

/* A chunk that never was written takes no storage, and zlib packs at most about 1 : 1030. A data
 * set may claim so many bytes a byte of storage, and so many without. */
#define CLAIM_RATIO 1100
#define CLAIM_FREE ((uint64_t)16 << 20)
/* Values converted at a time, where they go to other memory. */
#define TEXT_MAX 4096

struct tli_h5 {
    tl_ctx *ctx;
    const char *path; /* borrowed */
    hid_t file;
    H5E_auto2_t old_print;
    void *old_data;
};

/* The library keeps all its state in the process, so its lock is the process's, too. */
static pthread_mutex_t hdf5_lock = PTHREAD_MUTEX_INITIALIZER;

static tl_status fail(const tli_h5 *h5, const char *path, const char *what)
{
    return tl_fail(h5->ctx, TL_ERR_FORMAT, "'%s': HDF5: '%s' %s", h5->path, path, what);
}

/* ---- open and close ---- */

/* The superblock says where the file ends; 8 bytes of versions 0 to 3. Only files that begin with
 * it are taken. */
static tl_status check_end(tl_ctx *ctx, const char *path, const tli_map *map)
{
    static const uint8_t signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    const uint8_t *b = map->bytes;
    uint64_t end = 0;
    size_t at;
    if (map->byte_count < 48 || memcmp(b, signature, sizeof signature) != 0)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': no HDF5 file, or one that ends in its head",
                       path);
    unsigned offset_bytes = b[8] < 2 ? b[13] : b[9];
    if (b[8] > 3 || offset_bytes != 8)
        return tl_fail(
            ctx, TL_ERR_UNSUPPORTED,
            "'%s': HDF5 superblock of version %u with offsets of %u bytes; versions 0 to "
            "3 with 8 are read",
            path, b[8], offset_bytes);
    at = b[8] == 0 ? 24 + 16 : b[8] == 1 ? 28 + 16 : 12 + 16;
    for (size_t i = 8; i-- > 0;) end = end << 8 | b[at + i];
    if (end > map->byte_count)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': has %llu bytes, its HDF5 head says %llu", path,
                       (unsigned long long)map->byte_count, (unsigned long long)end);
    return TL_OK;
}

tl_status tli_h5_open(tl_ctx *ctx, const char *path, const tli_map *map, tli_h5 **h5)
{
    *h5 = NULL;
    tl_status st = check_end(ctx, path, map);
    tli_h5 *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    made->ctx = ctx;
    made->path = path;
    pthread_mutex_lock(&hdf5_lock);
    H5Eget_auto2(H5E_DEFAULT, &made->old_print, &made->old_data);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    made->file = H5Fopen(path, H5F_ACC_RDONLY, access);
    H5Pclose(access);
    if (made->file >= 0) {
        *h5 = made;
        return TL_OK;
    }
    H5Eset_auto2(H5E_DEFAULT, made->old_print, made->old_data);
    pthread_mutex_unlock(&hdf5_lock);
    tl_mem_free(ctx, made);
    return tl_fail(ctx, TL_ERR_FORMAT, "'%s': the HDF5 library can't open it", path);
}

void tli_h5_close(tli_h5 *h5)
{
    if (!h5) return;
    H5Fclose(h5->file);
    H5Eset_auto2(H5E_DEFAULT, h5->old_print, h5->old_data);
    pthread_mutex_unlock(&hdf5_lock);
    tl_mem_free(h5->ctx, h5);
}

/* ---- what is there ---- */

/* No part of the path is a link to another file: what a file names elsewhere is not opened. */
static bool stays_inside(tli_h5 *h5, const char *path)
{
    char part[TLI_H5_PATH_MAX];
    size_t length = strlen(path);
    if (length >= sizeof part) return false;
    for (size_t end = 1; end <= length; end++) {
        if (path[end] != '/' && path[end] != '\0') continue;
        if (end > 1 && path[end - 1] == '/') continue;
        memcpy(part, path, end);
        part[end] = '\0';
        if (strcmp(part, "/") == 0) continue;
        H5L_info_t info;
        if (H5Lget_info(h5->file, part, &info, H5P_DEFAULT) < 0) return false;
        if (info.type != H5L_TYPE_HARD && info.type != H5L_TYPE_SOFT) return false;
    }
    return true;
}

static hid_t open_object(tli_h5 *h5, const char *path)
{
    return stays_inside(h5, path) ? H5Oopen(h5->file, path, H5P_DEFAULT) : -1;
}

tli_h5_kind tli_h5_at(tli_h5 *h5, const char *path)
{
    hid_t object = open_object(h5, path);
    if (object < 0) return TLI_H5_NONE;
    H5I_type_t type = H5Iget_type(object);
    H5Oclose(object);
    return type == H5I_GROUP ? TLI_H5_GROUP : type == H5I_DATASET ? TLI_H5_DATA : TLI_H5_NONE;
}

/* Collects names first, so that visits may open what they like. */
typedef struct name_list {
    tli_h5 *h5;
    char **names;
    size_t count, room;
    tl_status status;
} name_list;

static herr_t collect_name(hid_t group, const char *name, const H5L_info_t *info, void *arg)
{
    name_list *list = arg;
    (void)group;
    (void)info;
    if (list->count == list->room) {
        size_t room = list->room ? 2 * list->room : 64;
        list->names =
            tl_mem_resize(list->h5->ctx, list->names, room, sizeof *list->names, &list->status);
        if (list->status) return -1;
        list->room = room;
    }
    char *own = tli_strdup(list->h5->ctx, name, &list->status);
    if (list->status) return -1;
    list->names[list->count++] = own;
    return 0;
}

tl_status tli_h5_members(tli_h5 *h5, const char *path, tli_h5_visit visit, void *arg)
{
    name_list list = {.h5 = h5};
    hsize_t at = 0;
    hid_t group = open_object(h5, path);
    if (group < 0) return fail(h5, path, "can't be opened");
    herr_t done = H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, &at, collect_name, &list);
    H5Oclose(group);
    tl_status st = list.status;
    if (!st && done < 0) st = fail(h5, path, "can't be listed");
    for (size_t i = 0; i < list.count && !st; i++) st = visit(arg, list.names[i]);
    for (size_t i = 0; i < list.count; i++) tl_mem_free(h5->ctx, list.names[i]);
    tl_mem_free(h5->ctx, list.names);
    return st;
}

/* ---- data sets ---- */

static void describe_type(hid_t type, tli_h5_data *data)
{
    H5T_class_t class = H5Tget_class(type);
    size_t bytes = H5Tget_size(type);
    data->is_text = class == H5T_STRING;
    data->is_other = false;
    if (class == H5T_STRING) {
        data->text_bytes = H5Tis_variable_str(type) > 0 ? 0 : bytes;
    } else if (class == H5T_FLOAT) {
        data->scalar = bytes <= 4 ? TL_F32 : TL_F64;
    } else if ((class == H5T_INTEGER || class == H5T_ENUM) && bytes <= 8) {
        bool is_signed = class == H5T_ENUM || H5Tget_sign(type) == H5T_SGN_2;
        tl_scalar wide = bytes <= 1 ? TL_U8 : bytes <= 2 ? TL_U16 : bytes <= 4 ? TL_U32 : TL_U64;
        data->scalar = is_signed ? (tl_scalar)(wide - 1) : wide;
    } else {
        data->is_other = true;
    }
}

/* Fills data from an open data set; the message names path. */
static tl_status describe(tli_h5 *h5, hid_t set, const char *path, tli_h5_data *data)
{
    hsize_t dims[TLI_H5_RANK_MAX] = {0};
    hid_t space = H5Dget_space(set), type = H5Dget_type(set);
    int rank = space >= 0 ? H5Sget_simple_extent_ndims(space) : -1;
    tl_status st = TL_OK;
    *data = (tli_h5_data){.count = 1};
    if (type < 0 || rank < 0 || rank > TLI_H5_RANK_MAX)
        st = fail(h5, path, "has no type or shape that is read");
    if (!st && H5Sget_simple_extent_dims(space, dims, NULL) < 0)
        st = fail(h5, path, "has no shape");
    if (!st) describe_type(type, data);
    size_t bytes = st ? 1 : H5Tget_size(type);
    data->rank = st ? 0 : (uint32_t)rank;
    for (int d = 0; d < rank && !st; d++) {
        data->dims[d] = dims[d];
        if (dims[d] && data->count > UINT64_MAX / 64 / dims[d]) st = fail(h5, path, "is endless");
        data->count *= dims[d];
    }
    uint64_t stored = st ? 0 : H5Dget_storage_size(set);
    if (!st && bytes && data->count > (stored * CLAIM_RATIO + CLAIM_FREE) / bytes)
        st = fail(h5, path, "claims more values than its storage can hold");
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    return st;
}

static tl_status open_data(tli_h5 *h5, const char *path, hid_t *set)
{
    *set = open_object(h5, path);
    if (*set < 0) return fail(h5, path, "is not there");
    if (H5Iget_type(*set) == H5I_DATASET) return TL_OK;
    H5Oclose(*set);
    return fail(h5, path, "is no data set");
}

tl_status tli_h5_describe(tli_h5 *h5, const char *path, tli_h5_data *data)
{
    hid_t set;
    tl_status st = open_data(h5, path, &set);
    if (st) return st;
    st = describe(h5, set, path, data);
    H5Oclose(set);
    return st;
}

/* Reads a box as numbers of a type of memory. */
static tl_status read_box(tli_h5 *h5, const char *path, const uint64_t *begin,
                          const uint64_t *count, hid_t memory_type, void *out)
{
    hid_t set, space = -1, memory = -1;
    tli_h5_data data;
    hsize_t start[TLI_H5_RANK_MAX], size[TLI_H5_RANK_MAX], total = 1;
    tl_status st = open_data(h5, path, &set);
    if (st) return st;
    st = describe(h5, set, path, &data);
    if (!st && (data.is_text || data.is_other)) st = fail(h5, path, "holds no numbers");
    for (uint32_t d = 0; d < data.rank && !st; d++) {
        start[d] = begin[d];
        size[d] = count[d];
        total *= count[d];
        if (begin[d] > data.dims[d] || count[d] > data.dims[d] - begin[d])
            st = fail(h5, path, "has fewer values than are asked for");
    }
    if (!st && total) {
        space = H5Dget_space(set);
        memory = H5Screate_simple(1, &total, NULL);
        bool fine = space >= 0 && memory >= 0 &&
                    (data.rank == 0 ||
                     H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, size, NULL) >= 0) &&
                    H5Dread(set, memory_type, memory, space, H5P_DEFAULT, out) >= 0;
        if (!fine) st = fail(h5, path, "can't be read");
        if (memory >= 0) H5Sclose(memory);
        if (space >= 0) H5Sclose(space);
    }
    H5Oclose(set);
    return st;
}

tl_status tli_h5_reals(tli_h5 *h5, const char *path, const uint64_t *begin, const uint64_t *count,
                       double *out)
{
    return read_box(h5, path, begin, count, H5T_NATIVE_DOUBLE, out);
}

tl_status tli_h5_ints(tli_h5 *h5, const char *path, const uint64_t *begin, const uint64_t *count,
                      int64_t *out)
{
    return read_box(h5, path, begin, count, H5T_NATIVE_INT64, out);
}

/* ---- text ---- */

static void copy_text(const char *from, size_t length, char *text, size_t text_bytes)
{
    if (length > text_bytes - 1) length = text_bytes - 1;
    memcpy(text, from, length);
    text[length] = '\0';
}

/* One string of a fixed size out of a data set. */
static tl_status read_fixed(tli_h5 *h5, hid_t set, const char *path, const tli_h5_data *data,
                            uint64_t index, char *text, size_t text_bytes)
{
    tl_status st = TL_OK;
    hsize_t at[TLI_H5_RANK_MAX], one[TLI_H5_RANK_MAX], single = 1;
    for (uint32_t d = data->rank; d-- > 0;) {
        at[d] = index % data->dims[d];
        index /= data->dims[d];
        one[d] = 1;
    }
    char *bytes = tl_mem_zalloc(h5->ctx, data->text_bytes + 1, 1, &st);
    hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    hid_t memory = H5Screate_simple(1, &single, NULL);
    bool fine =
        !st && type >= 0 && space >= 0 && memory >= 0 &&
        (data->rank == 0 || H5Sselect_hyperslab(space, H5S_SELECT_SET, at, NULL, one, NULL) >= 0) &&
        H5Dread(set, type, memory, space, H5P_DEFAULT, bytes) >= 0;
    if (fine) copy_text(bytes, strlen(bytes), text, text_bytes);
    if (!fine && !st) st = fail(h5, path, "can't be read");
    if (memory >= 0) H5Sclose(memory);
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    tl_mem_free(h5->ctx, bytes);
    return st;
}

tl_status tli_h5_text(tli_h5 *h5, const char *path, uint64_t index, char *text, size_t text_bytes)
{
    hid_t set;
    tli_h5_data data;
    text[0] = '\0';
    tl_status st = open_data(h5, path, &set);
    if (st) return st;
    st = describe(h5, set, path, &data);
    bool bytes = !data.is_text && !data.is_other && data.rank == 2 && data.scalar <= TL_U8;
    uint64_t rows = bytes ? data.dims[0] : data.count;
    if (!st && index >= rows) st = fail(h5, path, "has fewer texts than are asked for");
    if (!st && data.is_text && data.text_bytes && data.text_bytes <= TEXT_MAX)
        st = read_fixed(h5, set, path, &data, index, text, text_bytes);
    else if (!st && !bytes)
        st = fail(h5, path, "holds no texts of a fixed size");
    H5Oclose(set);
    if (st || !bytes) return st;
    double values[TEXT_MAX];
    uint64_t width = data.dims[1] < TEXT_MAX ? data.dims[1] : TEXT_MAX;
    const uint64_t begin[2] = {index, 0}, count[2] = {1, width};
    st = tli_h5_reals(h5, path, begin, count, values);
    for (uint64_t i = 0; !st && i < width && i + 1 < text_bytes; i++) {
        text[i] = (char)(int)values[i];
        text[i + 1] = '\0';
    }
    return st;
}

/* ---- attributes ---- */

static hid_t open_attribute(tli_h5 *h5, const char *path, const char *name, hid_t *object)
{
    *object = open_object(h5, path);
    if (*object < 0) return -1;
    hid_t attribute =
        H5Aexists(*object, name) > 0 ? H5Aopen(*object, name, H5P_DEFAULT) : (hid_t)-1;
    if (attribute < 0) H5Oclose(*object);
    return attribute;
}

bool tli_h5_attribute_text(tli_h5 *h5, const char *path, const char *name, char *text,
                           size_t text_bytes)
{
    hid_t object, attribute = open_attribute(h5, path, name, &object);
    text[0] = '\0';
    if (attribute < 0) return false;
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    bool one = type >= 0 && space >= 0 && H5Tget_class(type) == H5T_STRING &&
               H5Sget_simple_extent_npoints(space) == 1;
    bool found = false;
    if (one && H5Tis_variable_str(type) > 0) {
        char *value = NULL;
        hid_t memory = H5Tcopy(H5T_C_S1);
        H5Tset_size(memory, H5T_VARIABLE);
        H5Tset_cset(memory, H5Tget_cset(type));
        found = H5Aread(attribute, memory, &value) >= 0 && value;
        if (found) copy_text(value, strlen(value), text, text_bytes);
        if (value) H5free_memory(value);
        H5Tclose(memory);
    } else if (one && H5Tget_size(type) <= TEXT_MAX) {
        char bytes[TEXT_MAX + 1] = "";
        found = H5Aread(attribute, type, bytes) >= 0;
        if (found) copy_text(bytes, strlen(bytes), text, text_bytes);
    }
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    H5Aclose(attribute);
    H5Oclose(object);
    return found;
}

bool tli_h5_attribute_reals(tli_h5 *h5, const char *path, const char *name, double *values,
                            size_t count)
{
    hid_t object, attribute = open_attribute(h5, path, name, &object);
    if (attribute < 0) return false;
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    H5T_class_t class = type >= 0 ? H5Tget_class(type) : H5T_NO_CLASS;
    bool found = space >= 0 && (class == H5T_INTEGER || class == H5T_FLOAT) &&
                 H5Sget_simple_extent_npoints(space) == (hssize_t)count &&
                 H5Aread(attribute, H5T_NATIVE_DOUBLE, values) >= 0;
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    H5Aclose(attribute);
    H5Oclose(object);
    return found;
}
