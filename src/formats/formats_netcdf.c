/* netCDF classic, by the format specification of Unidata: a head of dimensions, attributes and
 * variables, then the data of the variables without records, then the records, in each of which the
 * record variables follow one another. All numbers are big endian. The head is believed in nothing:
 * sizes are computed from the dimensions and compared with the file. */
#include "formats/formats_netcdf.h"

#include <stdio.h>
#include <string.h>

/* Tags of the lists of a head. */
#define TAG_DIMENSION 10
#define TAG_VARIABLE 11
#define TAG_ATTRIBUTE 12
/* Values converted at a time. */
#define CHUNK 4096

/* The head as it is read: every step checks what is left. */
typedef struct head {
    tli_nc *nc;
    const uint8_t *at, *end;
    uint64_t *dim_ids; /* room for the dimensions of one variable */
} head;

/* Sizes and types by the type number of the format. */
static const struct {
    tl_scalar scalar;
    uint8_t bytes;
} types[] = {{TL_I8, 0},  {TL_I8, 1}, {TL_U8, 1},  {TL_I16, 2}, {TL_I32, 4}, {TL_F32, 4},
             {TL_F64, 8}, {TL_U8, 1}, {TL_U16, 2}, {TL_U32, 4}, {TL_I64, 8}, {TL_U64, 8}};
#define TYPE_CHAR 2
#define TYPE_COUNT (sizeof types / sizeof types[0])

/* ---- the head ---- */

static tl_status bad_head(const head *h, const char *what)
{
    return tl_fail(h->nc->ctx, TL_ERR_FORMAT, "'%s': netCDF head at byte %llu: %s", h->nc->path,
                   (unsigned long long)(h->at - h->nc->map->bytes), what);
}

static uint64_t number_at(const uint8_t *at, unsigned bytes)
{
    uint64_t value = 0;
    for (unsigned i = 0; i < bytes; i++) value = value << 8 | at[i];
    return value;
}

static tl_status take_number(head *h, unsigned bytes, uint64_t *value)
{
    if ((size_t)(h->end - h->at) < bytes) return bad_head(h, "the file ends");
    *value = number_at(h->at, bytes);
    h->at += bytes;
    return TL_OK;
}

/* A count: 8 bytes in CDF-5, else 4. */
static tl_status take_count(head *h, uint64_t *value)
{
    return take_number(h, h->nc->version == 5 ? 8 : 4, value);
}

/* Bytes that are padded to a multiple of four. */
static tl_status take_bytes(head *h, uint64_t count, const uint8_t **bytes)
{
    uint64_t left = (uint64_t)(h->end - h->at);
    if (count > left || (count + 3) / 4 * 4 > left) return bad_head(h, "the file ends");
    *bytes = h->at;
    h->at += (count + 3) / 4 * 4;
    return TL_OK;
}

static tl_status take_name(head *h, char **name)
{
    uint64_t length = 0;
    const uint8_t *bytes = NULL;
    tl_status st = take_count(h, &length);
    if (!st) st = take_bytes(h, length, &bytes);
    if (!st && length >= TLI_NC_NAME_MAX) return bad_head(h, "a name of 256 bytes or more");
    char *text = tl_mem_zalloc(h->nc->ctx, TLI_NC_NAME_MAX, 1, &st);
    if (st) return st;
    memcpy(text, bytes, (size_t)length);
    *name = text;
    return TL_OK;
}

/* The number of items of a list with a tag; an empty list may have tag 0. min_bytes an item at
 * least. */
static tl_status take_list(head *h, uint64_t tag, uint64_t min_bytes, uint64_t *count)
{
    uint64_t found = 0;
    *count = 0;
    tl_status st = take_number(h, 4, &found);
    if (!st) st = take_count(h, count);
    if (st) return st;
    if (found != tag && (found || *count)) return bad_head(h, "the tag of another list");
    if (*count > (uint64_t)(h->end - h->at) / min_bytes)
        return bad_head(h, "more items than the file has room for");
    return TL_OK;
}

static tl_status take_dimensions(head *h)
{
    tli_nc *nc = h->nc;
    uint64_t count;
    tl_status st = take_list(h, TAG_DIMENSION, 8, &count);
    nc->dims = tl_mem_zalloc(nc->ctx, (size_t)(st ? 0 : count), sizeof *nc->dims, &st);
    if (!st) nc->dim_count = (size_t)count;
    for (size_t i = 0; !st && i < nc->dim_count; i++) {
        tli_nc_dim *dim = &nc->dims[i];
        st = take_name(h, &dim->name);
        if (st) break;
        st = take_count(h, &dim->length);
        dim->is_record = dim->length == 0;
        if (dim->is_record) dim->length = nc->record_count;
    }
    return st;
}

/* Passes over a list of attributes. */
static tl_status skip_attributes(head *h)
{
    uint64_t count = 0, type = 0, length = 0;
    tl_status st = take_list(h, TAG_ATTRIBUTE, 12, &count);
    for (uint64_t i = 0; !st && i < count; i++) {
        const uint8_t *bytes;
        st = take_count(h, &length);
        if (!st) st = take_bytes(h, length, &bytes);
        if (!st) st = take_number(h, 4, &type);
        if (!st) st = take_count(h, &length);
        if (!st && (type == 0 || type >= TYPE_COUNT)) return bad_head(h, "an unknown type");
        if (!st && length > UINT64_MAX / 16) return bad_head(h, "an attribute of endless length");
        if (!st) st = take_bytes(h, length * types[type].bytes, &bytes);
    }
    return st;
}

/* Bytes of one record, or of all; false where no file could hold them. */
static bool var_bytes(const tli_nc_var *var, uint64_t type_bytes, uint64_t *bytes)
{
    *bytes = type_bytes;
    for (uint32_t d = var->is_record; d < var->rank; d++) {
        if (var->dims[d] && *bytes > UINT64_MAX / 8 / var->dims[d]) return false;
        *bytes *= var->dims[d];
    }
    return true;
}

static tl_status take_shape(head *h, tli_nc_var *var)
{
    tli_nc *nc = h->nc;
    uint64_t rank = 0, id = 0;
    tl_status st = take_count(h, &rank);
    if (!st && rank > (uint64_t)(h->end - h->at) / 4)
        return bad_head(h, "more dimensions than the file has room for");
    var->rank = rank > TLI_NC_RANK_MAX ? TLI_NC_RANK_MAX + 1 : (uint32_t)rank;
    for (uint64_t d = 0; !st && d < rank; d++) {
        st = take_count(h, &id);
        if (st) break;
        if (id >= nc->dim_count) return bad_head(h, "a dimension that there is none of");
        if (d == 0) var->is_record = nc->dims[id].is_record;
        if (d && nc->dims[id].is_record) return bad_head(h, "records within records");
        if (d < TLI_NC_RANK_MAX) var->dims[d] = nc->dims[id].length;
    }
    return st;
}

static tl_status take_variable(head *h, tli_nc_var *var)
{
    tli_nc *nc = h->nc;
    uint64_t type = 0, size = 0;
    tl_status st = take_name(h, &var->name);
    if (!st) st = take_shape(h, var);
    if (st) return st;
    var->attributes_ofs = (uint64_t)(h->at - nc->map->bytes);
    st = skip_attributes(h);
    if (!st) st = take_number(h, 4, &type);
    if (!st) st = take_count(h, &size); /* not used: it may overflow in large files */
    if (!st) st = take_number(h, nc->version == 1 ? 4 : 8, &var->ofs);
    if (st) return st;
    if (type == 0 || type >= TYPE_COUNT) return bad_head(h, "a variable of an unknown type");
    var->scalar = types[type].scalar;
    var->is_text = type == TYPE_CHAR;
    if (var->rank <= TLI_NC_RANK_MAX && !var_bytes(var, types[type].bytes, &var->record_bytes))
        return bad_head(h, "a variable that no file could hold");
    return TL_OK;
}

static tl_status take_variables(head *h)
{
    tli_nc *nc = h->nc;
    uint64_t count;
    tl_status st = take_list(h, TAG_VARIABLE, 24, &count);
    nc->vars = tl_mem_zalloc(nc->ctx, (size_t)(st ? 0 : count), sizeof *nc->vars, &st);
    if (!st) nc->var_count = (size_t)count;
    for (size_t i = 0; !st && i < nc->var_count; i++) st = take_variable(h, &nc->vars[i]);
    return st;
}

/* Records lie behind one another, each variable padded to four bytes; a lone one is not. */
static void find_record_step(tli_nc *nc)
{
    uint64_t records = 0, last = 0;
    for (size_t i = 0; i < nc->var_count; i++) {
        const tli_nc_var *var = &nc->vars[i];
        if (!var->is_record) continue;
        records++;
        last = var->record_bytes;
        nc->record_step += (var->record_bytes + 3) / 4 * 4;
    }
    if (records == 1) nc->record_step = last;
}

static tl_status check_places(const tli_nc *nc)
{
    uint64_t size = nc->map->byte_count;
    for (size_t i = 0; i < nc->var_count; i++) {
        const tli_nc_var *var = &nc->vars[i];
        if (var->rank > TLI_NC_RANK_MAX) continue; /* never read */
        uint64_t records = var->is_record ? nc->record_count : 1;
        bool fits = records == 0 || var->record_bytes == 0 ||
                    (var->ofs <= size && var->record_bytes <= size - var->ofs &&
                     (records == 1 ||
                      (records - 1) <= (size - var->ofs - var->record_bytes) / nc->record_step));
        if (!fits)
            return tl_fail(nc->ctx, TL_ERR_FORMAT,
                           "'%s': the variable '%s' (%llu bytes from byte %llu on, %llu records) "
                           "ends behind the file of %llu bytes",
                           nc->path, var->name, (unsigned long long)var->record_bytes,
                           (unsigned long long)var->ofs, (unsigned long long)records,
                           (unsigned long long)size);
    }
    return TL_OK;
}

static tl_status open_classic(tli_nc *nc)
{
    head h = {.nc = nc, .at = nc->map->bytes + 4, .end = nc->map->bytes + nc->map->byte_count};
    nc->version = nc->map->bytes[3];
    tl_status st = take_count(&h, &nc->record_count);
    uint64_t streaming = nc->version == 5 ? UINT64_MAX : UINT32_MAX;
    if (!st && nc->record_count == streaming)
        return tl_fail(nc->ctx, TL_ERR_UNSUPPORTED,
                       "'%s': a netCDF file that was never closed: its records are not counted",
                       nc->path);
    if (!st) st = take_dimensions(&h);
    if (!st) st = skip_attributes(&h);
    if (!st) st = take_variables(&h);
    if (st) return st;
    find_record_step(nc);
    return check_places(nc);
}

tl_status tli_nc_open(tl_ctx *ctx, const tli_source *source, tli_nc *nc)
{
    *nc = (tli_nc){.ctx = ctx, .path = source->path, .map = &source->map};
    if (source->map.byte_count >= 8 && memcmp(source->map.bytes, "CDF", 3) == 0)
        return open_classic(nc);
    nc->version = 4;
#if TETRALOD_WITH_HDF5
    return tli_nc4_open(nc);
#else
    return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                   "'%s': netCDF-4, which this build can't read: it was made without HDF5 (Debian "
                   "package libhdf5-dev)",
                   source->path);
#endif
}

void tli_nc_close(tli_nc *nc)
{
#if TETRALOD_WITH_HDF5
    if (nc->h5) tli_nc4_close(nc);
#endif
    for (size_t i = 0; nc->vars && i < nc->var_count; i++) tl_mem_free(nc->ctx, nc->vars[i].name);
    for (size_t i = 0; nc->dims && i < nc->dim_count; i++) tl_mem_free(nc->ctx, nc->dims[i].name);
    tl_mem_free(nc->ctx, nc->vars);
    tl_mem_free(nc->ctx, nc->dims);
    *nc = (tli_nc){0};
}

/* ---- looking up ---- */

const tli_nc_var *tli_nc_find(const tli_nc *nc, const char *name)
{
    for (size_t i = 0; i < nc->var_count; i++)
        if (strcmp(nc->vars[i].name, name) == 0)
            return nc->vars[i].rank <= TLI_NC_RANK_MAX ? &nc->vars[i] : NULL;
    return NULL;
}

const tli_nc_var *tli_nc_find_numbered(const tli_nc *nc, const char *name, uint64_t number)
{
    char text[64];
    snprintf(text, sizeof text, "%s%llu", name, (unsigned long long)number);
    return tli_nc_find(nc, text);
}

bool tli_nc_length(const tli_nc *nc, const char *name, uint64_t *length)
{
    for (size_t i = 0; i < nc->dim_count; i++)
        if (strcmp(nc->dims[i].name, name) == 0) {
            *length = nc->dims[i].length;
            return true;
        }
    return false;
}

uint64_t tli_nc_count(const tli_nc_var *var)
{
    uint64_t count = 1;
    for (uint32_t d = var->is_record; d < var->rank; d++) count *= var->dims[d];
    return count;
}

/* ---- values ---- */

static tl_status check_range(const tli_nc *nc, const tli_nc_var *var, uint64_t record,
                             uint64_t first, uint64_t count)
{
    uint64_t all = tli_nc_count(var);
    if (var->is_text)
        return tl_fail(nc->ctx, TL_ERR_FORMAT, "'%s': '%s' is text, expected numbers", nc->path,
                       var->name);
    if ((var->is_record ? record < var->dims[0] : record == 0) && first <= all &&
        count <= all - first)
        return TL_OK;
    return tl_fail(nc->ctx, TL_ERR_FORMAT,
                   "'%s': '%s' has %llu values%s, expected %llu from %llu on", nc->path, var->name,
                   (unsigned long long)all, var->is_record ? " a record" : "",
                   (unsigned long long)count, (unsigned long long)first);
}

static const uint8_t *record_bytes(const tli_nc *nc, const tli_nc_var *var, uint64_t record)
{
    return nc->map->bytes + var->ofs + record * nc->record_step;
}

tl_status tli_nc_reals(const tli_nc *nc, const tli_nc_var *var, uint64_t record, uint64_t first,
                       uint64_t count, double *out, size_t stride)
{
    tl_status st = check_range(nc, var, record, first, count);
    if (st) return st;
#if TETRALOD_WITH_HDF5
    if (nc->h5) return tli_nc4_reals(nc, var, record, first, count, out, stride);
#endif
    size_t bytes = tl_scalar_bytes(var->scalar);
    const uint8_t *at = record_bytes(nc, var, record) + first * bytes;
    for (uint64_t done = 0; done < count;) {
        double values[CHUNK];
        uint64_t piece = count - done < CHUNK ? count - done : CHUNK;
        if (stride == 1) {
            tli_widen(at, var->scalar, true, piece, out + done);
        } else {
            tli_widen(at, var->scalar, true, piece, values);
            for (uint64_t i = 0; i < piece; i++) out[(done + i) * stride] = values[i];
        }
        at += piece * bytes;
        done += piece;
    }
    return TL_OK;
}

tl_status tli_nc_ids(const tli_nc *nc, const tli_nc_var *var, uint64_t first, uint64_t count,
                     int64_t low, int64_t high, uint32_t *out)
{
    tl_status st = TL_OK;
    for (uint64_t done = 0; done < count && !st;) {
        double values[CHUNK];
        uint64_t piece = count - done < CHUNK ? count - done : CHUNK;
        st = tli_nc_reals(nc, var, 0, first + done, piece, values, 1);
        for (uint64_t i = 0; i < piece && !st; i++) {
            if (!(values[i] >= (double)low && values[i] <= (double)high))
                return tl_fail(nc->ctx, TL_ERR_FORMAT,
                               "'%s': '%s': value %llu is %.17g, expected %lld to %lld", nc->path,
                               var->name, (unsigned long long)(first + done + i), values[i],
                               (long long)low, (long long)high);
            out[done + i] = (uint32_t)((int64_t)values[i] - low);
        }
        done += piece;
    }
    return st;
}

/* ---- text ---- */

static void trim(char *text, size_t length)
{
    while (length && (text[length - 1] == ' ' || text[length - 1] == '\0')) length--;
    text[length] = '\0';
}

tl_status tli_nc_text(const tli_nc *nc, const tli_nc_var *var, uint64_t row,
                      char text[TLI_NC_NAME_MAX])
{
    text[0] = '\0';
    if (!var->is_text || var->rank != 2 || row >= var->dims[0])
        return tl_fail(nc->ctx, TL_ERR_FORMAT, "'%s': '%s' has no row %llu of text", nc->path,
                       var->name, (unsigned long long)row);
#if TETRALOD_WITH_HDF5
    if (nc->h5) {
        tl_status st = tli_nc4_text(nc, var, row, text);
        if (!st) trim(text, strlen(text));
        return st;
    }
#endif
    uint64_t width = var->dims[1];
    const uint8_t *at =
        var->is_record ? record_bytes(nc, var, row) : record_bytes(nc, var, 0) + row * width;
    size_t length = width < TLI_NC_NAME_MAX - 1 ? (size_t)width : TLI_NC_NAME_MAX - 1;
    memcpy(text, at, length);
    text[length] = '\0';
    trim(text, strlen(text));
    return TL_OK;
}

tl_status tli_nc_attribute(const tli_nc *nc, const tli_nc_var *var, const char *name,
                           char text[TLI_NC_NAME_MAX])
{
    text[0] = '\0';
#if TETRALOD_WITH_HDF5
    if (nc->h5) return tli_nc4_attribute(nc, var, name, text);
#endif
    tli_nc own = *nc; /* skip_attributes passed over all of this before: it can't fail */
    head h = {.nc = &own,
              .at = nc->map->bytes + var->attributes_ofs,
              .end = nc->map->bytes + nc->map->byte_count};
    uint64_t count = 0, length = 0, type = 0, values = 0;
    tl_status st = take_list(&h, TAG_ATTRIBUTE, 12, &count);
    for (uint64_t i = 0; !st && i < count; i++) {
        const uint8_t *key = NULL, *bytes = NULL;
        st = take_count(&h, &length);
        if (!st) st = take_bytes(&h, length, &key);
        if (!st) st = take_number(&h, 4, &type);
        if (!st) st = take_count(&h, &values);
        if (!st) st = take_bytes(&h, values * types[type].bytes, &bytes);
        if (st || type != TYPE_CHAR || length != strlen(name) || memcmp(key, name, length) != 0)
            continue;
        size_t kept = values < TLI_NC_NAME_MAX - 1 ? (size_t)values : TLI_NC_NAME_MAX - 1;
        memcpy(text, bytes, kept);
        text[kept] = '\0';
        trim(text, strlen(text));
        break;
    }
    return st;
}
