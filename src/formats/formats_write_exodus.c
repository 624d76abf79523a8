/* Exodus II, by the names that Sandia's manual (SAND92-2137) gives to dimensions and variables:
 * regions as element blocks, labels as side sets, channels as nodal and element variables of one
 * step. A block is tets in a row, so the tets are put in the order of their regions; elem_num_map
 * keeps where they stood. Vectors and symmetric tensors are scalars whose names end as other
 * programs expect, _x _y _z and _xx _yy _zz _xy _yz _zx; others end in _1, _2 ... */
#include "formats/formats_netcdf_write.h"
#include "formats/formats_write_mesh.h"

#include "mesh/mesh.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Most blocks of a file. */
#define BLOCKS_MAX 65536
/* Bytes of a name in the file, its end included: at least and at most. */
#define NAME_LEAST 33
#define NAME_MOST 256
/* Version of the library whose files are written so. */
#define EXODUS_VERSION 8.03
/* int64_status: connectivity and side sets have 64 bits. */
#define BULK_INT64 0x400
/* Number of the side of an element that lies opposite to a corner. */
static const int32_t side_of_face[4] = {2, 3, 1, 4};

typedef struct block {
    int32_t region;
    uint64_t first, count; /* tets in the order of the file */
} block;

/* Where the numbers of a variable come from. */
typedef struct slice {
    const double *values; /* [..][components] */
    uint32_t components, component;
    uint64_t first;        /* element of the file that is the first of the slice */
    const uint32_t *order; /* element of the file to element of the mesh; NULL: the same */
    tl_scalar scalar;
} slice;

typedef struct connection {
    const tl_lidx *tets;
    uint64_t first;
    const uint32_t *order;
    bool wide;
} connection;

typedef struct side_list {
    const tl_lidx *faces;
    const uint32_t *place; /* tet to element of the file; NULL: the same */
} side_list;

typedef struct writer {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    tli_arena arena;
    block *blocks;
    size_t block_count;
    uint32_t *order, *place; /* [tets] or NULL: they stay in order */
    int64_t region_add, label_add;
    bool renumbered; /* labels are 1, 2 ... */
    tl_scalar real, index;
    size_t name_bytes;
    tli_ncw file;
    size_t dim_room, var_room;
} writer;

/* ---- blocks ---- */

/* Index of the first block whose region is not below. */
static size_t find_block(const writer *w, int32_t region)
{
    size_t low = 0, high = w->block_count;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (w->blocks[middle].region < region)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static tl_status count_blocks(writer *w)
{
    const int32_t *regions = tl_mesh_regions(w->mesh);
    const size_t tets = tl_mesh_tet_count(w->mesh);
    size_t at = 0;
    for (size_t t = 0; t < tets; t++) {
        int32_t region = regions ? regions[t] : 1;
        if (at >= w->block_count || w->blocks[at].region != region) at = find_block(w, region);
        if (at == w->block_count || w->blocks[at].region != region) {
            if (w->block_count == BLOCKS_MAX)
                return tl_fail(w->ctx, TL_ERR_UNSUPPORTED,
                               "more than %d regions, each of which would be a block of Exodus",
                               BLOCKS_MAX);
            memmove(w->blocks + at + 1, w->blocks + at,
                    (w->block_count++ - at) * sizeof *w->blocks);
            w->blocks[at] = (block){.region = region};
        }
        w->blocks[at].count++;
    }
    for (size_t b = 1; b < w->block_count; b++)
        w->blocks[b].first = w->blocks[b - 1].first + w->blocks[b - 1].count;
    return TL_OK;
}

/* Puts the tets in the order of their regions, those of a region in their own. */
static tl_status order_tets(writer *w)
{
    const int32_t *regions = tl_mesh_regions(w->mesh);
    const size_t tets = tl_mesh_tet_count(w->mesh);
    tl_status st = TL_OK;
    bool sorted = true;
    for (size_t t = 1; regions && t < tets && sorted; t++) sorted = regions[t - 1] <= regions[t];
    if (!regions || sorted) return TL_OK;
    w->order = tl_mem_alloc(w->ctx, tets, sizeof *w->order, &st);
    if (tl_mesh_label_count(w->mesh)) w->place = tl_mem_alloc(w->ctx, tets, sizeof *w->place, &st);
    uint64_t *next = tli_arena_alloc(&w->arena, w->block_count, sizeof *next, &st);
    for (size_t b = 0; b < w->block_count && !st; b++) next[b] = w->blocks[b].first;
    size_t at = 0;
    for (size_t t = 0; t < tets && !st; t++) {
        if (w->blocks[at].region != regions[t]) at = find_block(w, regions[t]);
        if (w->place) w->place[t] = (uint32_t)next[at];
        w->order[next[at]++] = (uint32_t)t;
    }
    return st;
}

/* ---- numbers and names that suit ---- */

/* Ids are not negative there, and each side set has one of its own. */
static tl_status choose_ids(writer *w)
{
    const size_t labels = tl_mesh_label_count(w->mesh);
    int64_t low = w->block_count ? w->blocks[0].region : 0, low_label = 0;
    int64_t high = w->block_count ? w->blocks[w->block_count - 1].region : 0, high_label = 0;
    for (size_t i = 0; i < labels; i++) {
        const tl_label *label = tl_mesh_label(w->mesh, i);
        if (label->id < low_label) low_label = label->id;
        if (label->id > high_label) high_label = label->id;
        for (size_t k = 0; k < i && !w->renumbered; k++)
            w->renumbered = tl_mesh_label(w->mesh, k)->id == label->id;
    }
    w->region_add = low < 0 ? -low : 0;
    w->label_add = low_label < 0 ? -low_label : 0;
    w->renumbered = w->renumbered || high_label + w->label_add > INT32_MAX;
    if (high + w->region_add > INT32_MAX)
        return tl_fail(w->ctx, TL_ERR_UNSUPPORTED,
                       "regions from %lld to %lld, more than 31 bits, which Exodus can't have",
                       (long long)low, (long long)high);
    if (w->region_add)
        tl_log(w->ctx, TL_LOG_INFO, "blocks of Exodus have no negative ids: %lld added to regions",
               (long long)w->region_add);
    if (w->renumbered)
        tl_log(w->ctx, TL_LOG_INFO, "two labels have one id: side sets are numbered from 1 on");
    else if (w->label_add)
        tl_log(w->ctx, TL_LOG_INFO, "side sets have no negative ids: %lld added to labels",
               (long long)w->label_add);
    return TL_OK;
}

/* Numbers of one file have one size there: float32 if it holds all positions and values. */
static tl_status choose_types(writer *w)
{
    const tl_mesh *mesh = w->mesh;
    const size_t verts = tl_mesh_vert_count(mesh), tets = tl_mesh_tet_count(mesh);
    tl_status st = tli_narrowest(w->ctx, tl_mesh_xyz(mesh), 3 * verts, TL_F32, &w->real);
    for (size_t i = 0; i < tl_mesh_channel_count(mesh) && !st && w->real == TL_F32; i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        size_t count = (channel->on == TL_ON_TET ? tets : verts) * channel->components;
        st = tli_narrowest(w->ctx, channel->values, count, TL_F32, &w->real);
    }
    w->index = verts > INT32_MAX || tets > INT32_MAX ? TL_I64 : TL_I32;
    return st;
}

/* What stands behind the name of a component; "" for a scalar. */
static void suffix_of(uint32_t components, uint32_t component, char text[16])
{
    static const char *const vector[] = {"_x", "_y", "_z"};
    static const char *const tensor[] = {"_xx", "_yy", "_zz", "_xy", "_yz", "_zx"};
    if (components == 1)
        text[0] = '\0';
    else if (components == 3)
        snprintf(text, 16, "%s", vector[component]);
    else if (components == 6)
        snprintf(text, 16, "%s", tensor[component]);
    else
        snprintf(text, 16, "_%u", component + 1);
}

static void choose_name_bytes(writer *w)
{
    const tl_mesh *mesh = w->mesh;
    size_t longest = NAME_LEAST - 1;
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++) {
        char suffix[16];
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        suffix_of(channel->components, channel->components - 1, suffix);
        size_t length = strlen(channel->name) + strlen(suffix);
        if (length > longest) longest = length;
    }
    for (size_t i = 0; i < tl_mesh_label_count(mesh); i++)
        if (strlen(tl_mesh_label(mesh, i)->name) > longest)
            longest = strlen(tl_mesh_label(mesh, i)->name);
    for (size_t i = 0; i < mesh->region_name_count; i++)
        if (strlen(mesh->region_names[i].name) > longest)
            longest = strlen(mesh->region_names[i].name);
    w->name_bytes = longest + 1 < NAME_MOST ? longest + 1 : NAME_MOST;
}

/* ---- numbers on their way ---- */

static void fill_slice(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const slice *s = arg;
    float *narrow = out;
    double *wide = out;
    for (uint64_t i = begin; i < end; i++) {
        uint64_t at = s->order ? s->order[s->first + i] : s->first + i;
        double value = s->values[at * s->components + s->component];
        if (s->scalar == TL_F32)
            *narrow++ = (float)value;
        else
            *wide++ = value;
    }
}

static void put_index(void *out, uint64_t at, uint64_t value, bool wide)
{
    if (wide)
        ((int64_t *)out)[at] = (int64_t)value;
    else
        ((int32_t *)out)[at] = (int32_t)value;
}

static void fill_connection(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const connection *c = arg;
    for (uint64_t i = begin; i < end; i++) {
        uint64_t at = c->order ? c->order[c->first + i] : c->first + i;
        for (unsigned k = 0; k < 4; k++)
            put_index(out, 4 * (i - begin) + k, c->tets[4 * at + k] + (uint64_t)1, c->wide);
    }
}

static void fill_elements(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const side_list *list = arg;
    int32_t *to = out; /* tets are at most 2^30 */
    for (uint64_t i = begin; i < end; i++) {
        tl_lidx tet = list->faces[i] / 4;
        *to++ = (int32_t)((list->place ? list->place[tet] : tet) + 1);
    }
}

static void fill_sides(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const side_list *list = arg;
    int32_t *to = out;
    for (uint64_t i = begin; i < end; i++) *to++ = side_of_face[list->faces[i] % 4];
}

static void fill_map(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const uint32_t *order = arg;
    int32_t *to = out;
    for (uint64_t i = begin; i < end; i++) *to++ = (int32_t)(order[i] + 1);
}

static void fill_ints(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    memcpy(out, (const int32_t *)arg + begin, (size_t)(end - begin) * sizeof(int32_t));
}

/* ---- the description ---- */

static tl_status make_room(writer *w, size_t dims, size_t vars)
{
    tl_status st = TL_OK;
    w->file.dims = tli_arena_alloc(&w->arena, dims, sizeof *w->file.dims, &st);
    w->file.vars = tli_arena_alloc(&w->arena, vars, sizeof *w->file.vars, &st);
    w->dim_room = dims;
    w->var_room = vars;
    return st;
}

/* A name with up to two numbers in it: format has as many %zu. */
static const char *numbered(writer *w, const char *format, size_t a, size_t b, tl_status *st)
{
    char *text = tli_arena_alloc(&w->arena, 64, 1, st);
    if (!*st) snprintf(text, 64, format, a, b);
    return text;
}

static uint32_t add_dim(writer *w, const char *name, uint64_t length)
{
    TL_ASSERT(w->file.dim_count < w->dim_room);
    w->file.dims[w->file.dim_count] = (tli_ncw_dim){name, length};
    return (uint32_t)w->file.dim_count++;
}

/* Two dimensions where second is one. */
#define ONE_DIM UINT32_MAX
static tli_ncw_var *add_var(writer *w, tli_out_array data, uint32_t first, uint32_t second)
{
    TL_ASSERT(w->file.var_count < w->var_room);
    tli_ncw_var *var = &w->file.vars[w->file.var_count++];
    *var = (tli_ncw_var){.data = data, .rank = second == ONE_DIM ? 1 : 2, .dims = {first, second}};
    return var;
}

/* A table of names: text [count][name_bytes], zero behind each. */
typedef struct name_table {
    char *text;
    uint32_t width;
} name_table;

static void fill_names(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const name_table *table = arg;
    memcpy(out, table->text + begin * table->width, (size_t)(end - begin) * table->width);
}

static name_table *add_names(writer *w, const char *name, uint32_t rows, uint64_t count,
                             uint32_t width_dim, tl_status *st)
{
    name_table *table = tli_arena_alloc(&w->arena, 1, sizeof *table, st);
    char *text = tli_arena_alloc(&w->arena, (size_t)count, w->name_bytes, st);
    if (*st) return NULL;
    memset(text, 0, (size_t)count * w->name_bytes);
    *table = (name_table){text, (uint32_t)w->name_bytes};
    add_var(w, (tli_out_array){name, NULL, TL_U8, table->width, count, fill_names, table}, rows,
            width_dim);
    return table;
}

static void set_name(name_table *table, size_t row, const char *name, const char *suffix)
{
    size_t room = table->width - 1 - strlen(suffix), length = strlen(name);
    if (length > room) length = room;
    memcpy(table->text + row * table->width, name, length);
    memcpy(table->text + row * table->width + length, suffix, strlen(suffix));
}

/* Ids of blocks or side sets, and that each is there. */
static int32_t *add_ids(writer *w, const char *status, const char *ids, uint32_t dim,
                        uint64_t count, tl_status *st)
{
    int32_t *numbers = tli_arena_alloc(&w->arena, 2 * (size_t)count, sizeof *numbers, st);
    if (*st) return NULL;
    for (size_t i = 0; i < count; i++) numbers[i] = 1;
    add_var(w, (tli_out_array){status, NULL, TL_I32, 1, count, fill_ints, numbers}, dim, ONE_DIM);
    tli_ncw_var *var = add_var(
        w, (tli_out_array){ids, NULL, TL_I32, 1, count, fill_ints, numbers + count}, dim, ONE_DIM);
    var->attribute = "name";
    var->text = "ID";
    return numbers + count;
}

/* The dimensions that all parts use. */
typedef struct dimensions {
    uint32_t step, name, nodes, elements, block_count, space;
} dimensions;

static tl_status describe_mesh(writer *w, dimensions *dims)
{
    static const char *const axes[3] = {"coordx", "coordy", "coordz"};
    const tl_mesh *mesh = w->mesh;
    const uint64_t verts = tl_mesh_vert_count(mesh);
    tl_status st = TL_OK;
    dims->name = add_dim(w, "len_name", w->name_bytes);
    dims->step = add_dim(w, "time_step", 0);
    dims->space = add_dim(w, "num_dim", 3);
    if (verts) dims->nodes = add_dim(w, "num_nodes", verts);
    if (w->block_count) {
        dims->elements = add_dim(w, "num_elem", tl_mesh_tet_count(mesh));
        dims->block_count = add_dim(w, "num_el_blk", w->block_count);
    }
    name_table *names = add_names(w, "coor_names", dims->space, 3, dims->name, &st);
    slice *slices = tli_arena_alloc(&w->arena, 3, sizeof *slices, &st);
    for (uint32_t a = 0; a < 3 && !st; a++) {
        static const char *const letters[3] = {"x", "y", "z"};
        set_name(names, a, letters[a], "");
        slices[a] = (slice){tl_mesh_xyz(mesh), 3, a, 0, NULL, w->real};
        if (verts)
            add_var(w, (tli_out_array){axes[a], NULL, w->real, 1, verts, fill_slice, &slices[a]},
                    dims->nodes, ONE_DIM);
    }
    if (!st && w->order)
        add_var(w,
                (tli_out_array){"elem_num_map", NULL, TL_I32, 1, tl_mesh_tet_count(mesh), fill_map,
                                w->order},
                dims->elements, ONE_DIM);
    return st;
}

static tl_status describe_blocks(writer *w, dimensions *dims, uint32_t *block_dims)
{
    tl_status st = TL_OK;
    if (!w->block_count) return TL_OK;
    int32_t *ids = add_ids(w, "eb_status", "eb_prop1", dims->block_count, w->block_count, &st);
    name_table *names =
        add_names(w, "eb_names", dims->block_count, w->block_count, dims->name, &st);
    connection *lists = tli_arena_alloc(&w->arena, w->block_count, sizeof *lists, &st);
    for (size_t b = 0; b < w->block_count && !st; b++) {
        const block *from = &w->blocks[b];
        const char *name = tl_mesh_region_name(w->mesh, from->region);
        ids[b] = (int32_t)(from->region + w->region_add);
        set_name(names, b, name ? name : "", "");
        lists[b] = (connection){tl_mesh_tets(w->mesh), from->first, w->order, w->index == TL_I64};
        const char *dim = numbered(w, "num_el_in_blk%zu", b + 1, 0, &st);
        const char *nodes = numbered(w, "num_nod_per_el%zu", b + 1, 0, &st);
        const char *var = numbered(w, "connect%zu", b + 1, 0, &st);
        if (st) break;
        block_dims[b] = add_dim(w, dim, from->count);
        tli_ncw_var *connect = add_var(
            w, (tli_out_array){var, NULL, w->index, 4, from->count, fill_connection, &lists[b]},
            block_dims[b], add_dim(w, nodes, 4));
        connect->attribute = "elem_type";
        connect->text = "TETRA";
    }
    return st;
}

static tl_status describe_labels(writer *w, const dimensions *dims)
{
    const size_t count = tl_mesh_label_count(w->mesh);
    tl_status st = TL_OK;
    if (!count) return TL_OK;
    uint32_t sets = add_dim(w, "num_side_sets", count);
    int32_t *ids = add_ids(w, "ss_status", "ss_prop1", sets, count, &st);
    name_table *names = add_names(w, "ss_names", sets, count, dims->name, &st);
    side_list *lists = tli_arena_alloc(&w->arena, count, sizeof *lists, &st);
    for (size_t i = 0; i < count && !st; i++) {
        const tl_label *label = tl_mesh_label(w->mesh, i);
        ids[i] = w->renumbered ? (int32_t)i + 1 : (int32_t)(label->id + w->label_add);
        set_name(names, i, label->name, "");
        lists[i] = (side_list){label->faces, w->place};
        if (label->face_count == 0) continue; /* a dimension of 0 would be that of the records */
        const char *dim = numbered(w, "num_side_ss%zu", i + 1, 0, &st);
        const char *elements = numbered(w, "elem_ss%zu", i + 1, 0, &st);
        const char *sides = numbered(w, "side_ss%zu", i + 1, 0, &st);
        if (st) break;
        uint32_t faces = add_dim(w, dim, label->face_count);
        tli_out_array data = {elements,          NULL,          TL_I32,   1,
                              label->face_count, fill_elements, &lists[i]};
        add_var(w, data, faces, ONE_DIM);
        data.name = sides;
        data.fill = fill_sides;
        add_var(w, data, faces, ONE_DIM);
    }
    return st;
}

/* ---- variables ---- */

static size_t component_count(const tl_mesh *mesh, tl_on on)
{
    size_t count = 0;
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++)
        if (tl_mesh_channel(mesh, i)->on == on) count += tl_mesh_channel(mesh, i)->components;
    return count;
}

/* One component as nodal variable number, or as element variable of each block. */
static tl_status describe_component(writer *w, const dimensions *dims, const uint32_t *block_dims,
                                    const slice *of, tl_on on, size_t number)
{
    tl_status st = TL_OK;
    size_t tables = on == TL_ON_VERTEX ? 1 : w->block_count;
    slice *slices = tli_arena_alloc(&w->arena, tables, sizeof *slices, &st);
    for (size_t b = 0; b < tables && !st; b++) {
        bool nodal = on == TL_ON_VERTEX;
        const char *name = nodal ? numbered(w, "vals_nod_var%zu", number, 0, &st)
                                 : numbered(w, "vals_elem_var%zueb%zu", number, b + 1, &st);
        if (st) break;
        uint64_t count = nodal ? tl_mesh_vert_count(w->mesh) : w->blocks[b].count;
        slices[b] = *of;
        slices[b].first = nodal ? 0 : w->blocks[b].first;
        slices[b].order = nodal ? NULL : w->order;
        add_var(w, (tli_out_array){name, NULL, w->real, 1, count, fill_slice, &slices[b]},
                dims->step, nodal ? dims->nodes : block_dims[b]);
    }
    return st;
}

static tl_status describe_variables(writer *w, const dimensions *dims, const uint32_t *block_dims,
                                    tl_on on)
{
    const bool nodal = on == TL_ON_VERTEX;
    const size_t count = component_count(w->mesh, on);
    tl_status st = TL_OK;
    if (!count || (nodal ? !tl_mesh_vert_count(w->mesh) : !w->block_count)) return TL_OK;
    uint32_t rows = add_dim(w, nodal ? "num_nod_var" : "num_elem_var", count);
    name_table *names =
        add_names(w, nodal ? "name_nod_var" : "name_elem_var", rows, count, dims->name, &st);
    size_t number = 0;
    for (size_t i = 0; i < tl_mesh_channel_count(w->mesh) && !st; i++) {
        const tl_channel *channel = tl_mesh_channel(w->mesh, i);
        if (channel->on != on) continue;
        for (uint32_t c = 0; c < channel->components && !st; c++) {
            char suffix[16];
            slice of = {channel->values, channel->components, c, 0, NULL, w->real};
            suffix_of(channel->components, c, suffix);
            set_name(names, number, channel->name, suffix);
            st = describe_component(w, dims, block_dims, &of, on, ++number);
        }
    }
    return st;
}

static tl_status describe_time(writer *w, const dimensions *dims)
{
    tl_status st = TL_OK;
    double time = tl_mesh_time(w->mesh);
    if (isnan(time) && tl_mesh_channel_count(w->mesh) == 0) return TL_OK;
    double *value = tli_arena_alloc(&w->arena, 1, sizeof *value, &st);
    if (st) return st;
    *value = isnan(time) ? 0 : time;
    add_var(w, (tli_out_array){"time_whole", NULL, TL_F64, 1, 1, tli_fill_number, value},
            dims->step, ONE_DIM);
    return TL_OK;
}

static tl_status describe(writer *w)
{
    const size_t labels = tl_mesh_label_count(w->mesh);
    const size_t nodal = component_count(w->mesh, TL_ON_VERTEX);
    const size_t element = component_count(w->mesh, TL_ON_TET) * w->block_count;
    dimensions dims = {0};
    tl_status st = make_room(w, 9 + 2 * w->block_count + labels,
                             16 + w->block_count + 2 * labels + nodal + element);
    uint32_t *block_dims = tli_arena_alloc(&w->arena, w->block_count, sizeof *block_dims, &st);
    if (!st) st = describe_mesh(w, &dims);
    if (!st) st = describe_time(w, &dims);
    if (!st) st = describe_blocks(w, &dims, block_dims);
    if (!st) st = describe_labels(w, &dims);
    if (!st) st = describe_variables(w, &dims, block_dims, TL_ON_VERTEX);
    return st ? st : describe_variables(w, &dims, block_dims, TL_ON_TET);
}

/* ---- the door ---- */

static tl_status emit(writer *w, const char *path)
{
    tli_ncw_attribute attributes[] = {
        {"api_version", NULL, TL_F32, EXODUS_VERSION},
        {"version", NULL, TL_F32, EXODUS_VERSION},
        {"floating_point_word_size", NULL, TL_I32, w->real == TL_F32 ? 4 : 8},
        {"file_size", NULL, TL_I32, 1},
        {"int64_status", NULL, TL_I32, w->index == TL_I64 ? BULK_INT64 : 0},
        {"maximum_name_length", NULL, TL_I32, (double)w->name_bytes - 1},
        {"title", "tetralod", TL_U8, 0},
    };
    w->file.attributes = attributes;
    w->file.attribute_count = sizeof attributes / sizeof *attributes;
    tli_emit out = {.ctx = w->ctx, .total = tli_ncw_bytes(&w->file)};
    tl_status st = tli_sink_open(w->ctx, path, &out.sink);
    if (!st) st = tli_ncw_emit(&out, &w->file, tli_ncw_version(&w->file));
    return tli_emit_close(&out, path, st);
}

tl_status tli_write_exodus(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii)
{
    writer w = {.ctx = ctx, .mesh = mesh};
    tl_status st = TL_OK;
    (void)ascii; /* refused before */
    tli_arena_open(ctx, &w.arena);
    w.blocks = tl_mem_alloc(ctx, BLOCKS_MAX + 1, sizeof *w.blocks, &st);
    if (!st) st = count_blocks(&w);
    if (!st) st = order_tets(&w);
    if (!st) st = choose_types(&w);
    if (!st) st = choose_ids(&w);
    if (!st) choose_name_bytes(&w);
    if (!st) st = describe(&w);
    if (st)
        tl_note(ctx, st, "while writing '%s'", path);
    else
        st = emit(&w, path);
    tl_mem_free(ctx, w.blocks);
    tl_mem_free(ctx, w.order);
    tl_mem_free(ctx, w.place);
    tli_arena_close(&w.arena);
    return st;
}
