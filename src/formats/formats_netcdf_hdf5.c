/* netCDF-4: variables are data sets of the root group; dimensions are data sets, too, whose length
 * is theirs, marked as scales. Groups are passed over. */
#include "formats/formats_hdf5.h"
#include "formats/formats_netcdf.h"

#include <stdio.h>
#include <string.h>

/* Values converted at a time. */
#define CHUNK 65536

typedef struct collector {
    tli_nc *nc;
    size_t room;
} collector;

static void root_path(const char *name, char path[TLI_NC_NAME_MAX + 2])
{
    snprintf(path, TLI_NC_NAME_MAX + 2, "/%s", name);
}

/* The unlimited dimension of Exodus is the only one that is looked for. */
static bool is_record_name(const char *name)
{
    return strcmp(name, "time_whole") == 0 || strncmp(name, "vals_", 5) == 0;
}

static void fill_var(const tli_h5_data *data, tli_nc_var *var)
{
    var->is_text = data->is_text;
    var->scalar = data->scalar;
    var->rank = data->rank;
    if (data->is_text && data->text_bytes == 1 && data->rank == 2) var->is_text = true;
    for (uint32_t d = 0; d < data->rank && d < TLI_NC_RANK_MAX; d++) var->dims[d] = data->dims[d];
    if (data->rank > TLI_NC_RANK_MAX || data->is_other) var->rank = TLI_NC_RANK_MAX + 1;
}

static tl_status collect(void *arg, const char *name)
{
    collector *c = arg;
    tli_nc *nc = c->nc;
    tli_h5_data data;
    char path[TLI_NC_NAME_MAX + 2], class[64];
    tl_status st = TL_OK;
    root_path(name, path);
    if (strlen(name) >= TLI_NC_NAME_MAX || tli_h5_at(nc->h5, path) != TLI_H5_DATA) return TL_OK;
    st = tli_h5_describe(nc->h5, path, &data);
    if (st) return st;
    if (nc->var_count == c->room) {
        size_t room = c->room ? 2 * c->room : 64;
        nc->vars = tl_mem_resize(nc->ctx, nc->vars, room, sizeof *nc->vars, &st);
        nc->dims = tl_mem_resize(nc->ctx, nc->dims, room, sizeof *nc->dims, &st);
        if (st) return st;
        c->room = room;
    }
    if (tli_h5_attribute_text(nc->h5, path, "CLASS", class, sizeof class) &&
        strcmp(class, "DIMENSION_SCALE") == 0 && data.rank == 1) {
        char *own = tli_strdup(nc->ctx, name, &st);
        if (st) return st;
        nc->dims[nc->dim_count++] = (tli_nc_dim){own, data.dims[0], strcmp(name, "time_step") == 0};
    }
    char *own = tli_strdup(nc->ctx, name, &st);
    if (st) return st;
    tli_nc_var *var = &nc->vars[nc->var_count++];
    *var = (tli_nc_var){.name = own, .is_record = is_record_name(name) && data.rank > 0};
    fill_var(&data, var);
    return TL_OK;
}

tl_status tli_nc4_open(tli_nc *nc)
{
    collector c = {.nc = nc};
    tl_status st = tli_h5_open(nc->ctx, nc->path, nc->map, &nc->h5);
    return st ? st : tli_h5_members(nc->h5, "/", collect, &c);
}

void tli_nc4_close(tli_nc *nc)
{
    tli_h5_close(nc->h5);
    nc->h5 = NULL;
}

/* The box of a range of values that begins and ends at whole rows, or lies within one. */
static bool box_of(const tli_nc_var *var, uint64_t record, uint64_t first, uint64_t count,
                   uint64_t begin[TLI_NC_RANK_MAX], uint64_t size[TLI_NC_RANK_MAX])
{
    uint64_t row = 1;
    uint32_t d = var->rank;
    for (uint32_t i = 0; i < var->rank; i++) begin[i] = 0, size[i] = 1;
    if (var->is_record) begin[0] = record;
    if (count == 0 || var->rank == (uint32_t)var->is_record) return true;
    while (d > (uint32_t)var->is_record) { /* full dimensions from the last on */
        d--;
        if (first % row == 0 && count % row == 0 &&
            first / row % var->dims[d] + count / row <= var->dims[d]) {
            uint64_t at = first / row;
            begin[d] = at % var->dims[d];
            size[d] = count / row;
            at /= var->dims[d];
            while (d-- > (uint32_t)var->is_record) {
                begin[d] = at % var->dims[d];
                at /= var->dims[d];
            }
            return true;
        }
        size[d] = var->dims[d];
        row *= var->dims[d];
    }
    return false;
}

tl_status tli_nc4_reals(const tli_nc *nc, const tli_nc_var *var, uint64_t record, uint64_t first,
                        uint64_t count, double *out, size_t stride)
{
    char path[TLI_NC_NAME_MAX + 2];
    uint64_t begin[TLI_NC_RANK_MAX], size[TLI_NC_RANK_MAX];
    tl_status st = TL_OK;
    root_path(var->name, path);
    double *values = stride == 1 ? NULL : tl_mem_alloc(nc->ctx, CHUNK, sizeof *values, &st);
    for (uint64_t done = 0; done < count && !st;) {
        uint64_t piece = count - done;
        if (stride != 1 && piece > CHUNK) piece = CHUNK;
        while (!box_of(var, record, first + done, piece, begin, size)) piece = (piece + 1) / 2;
        st = tli_h5_reals(nc->h5, path, begin, size, stride == 1 ? out + done : values);
        for (uint64_t i = 0; i < piece && stride != 1 && !st; i++)
            out[(done + i) * stride] = values[i];
        done += piece;
    }
    tl_mem_free(nc->ctx, values);
    return st;
}

/* netCDF-4 keeps characters as strings of one byte. */
tl_status tli_nc4_text(const tli_nc *nc, const tli_nc_var *var, uint64_t row,
                       char text[TLI_NC_NAME_MAX])
{
    char path[TLI_NC_NAME_MAX + 2];
    tl_status st = TL_OK;
    root_path(var->name, path);
    uint64_t width = var->dims[1] < TLI_NC_NAME_MAX - 1 ? var->dims[1] : TLI_NC_NAME_MAX - 1;
    for (uint64_t i = 0; i < width && !st; i++) {
        char one[8];
        st = tli_h5_text(nc->h5, path, row * var->dims[1] + i, one, sizeof one);
        text[i] = one[0];
        text[i + 1] = '\0';
        if (!one[0]) break;
    }
    return st;
}

tl_status tli_nc4_attribute(const tli_nc *nc, const tli_nc_var *var, const char *name,
                            char text[TLI_NC_NAME_MAX])
{
    char path[TLI_NC_NAME_MAX + 2];
    root_path(var->name, path);
    tli_h5_attribute_text(nc->h5, path, name, text, TLI_NC_NAME_MAX);
    return TL_OK;
}
