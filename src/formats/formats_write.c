/* The door out: a mesh in memory, described for the writers. Numbers are narrowed to the type that
 * loses nothing: positions to float32 if all of them are, channels to the type that they had in
 * their file if all values fit it. */
#include "formats/formats_emit.h"
#include "formats/formats_tets.h"
#include "formats/formats_write_mesh.h"

#include <stdatomic.h>
#include <string.h>

/* Values that a thread looks at at once. */
#define SCAN_GRAIN 65536

tl_write_opts tl_write_opts_defaults(void)
{
    return (tl_write_opts){.struct_bytes = sizeof(tl_write_opts)};
}

/* ---- narrowing ---- */

typedef struct scan_job {
    const double *values;
    tl_scalar scalar;
    atomic_bool wider;
} scan_job;

static tl_status scan_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    scan_job *job = arg;
    bool fits = true;
    if (atomic_load_explicit(&job->wider, memory_order_relaxed)) return TL_OK;
    for (size_t i = begin; i < end && fits; i++)
        fits = tl_scalar_holds(job->scalar, job->values[i]);
    if (!fits) atomic_store_explicit(&job->wider, true, memory_order_relaxed);
    return TL_OK;
}

tl_status tli_narrowest(tl_ctx *ctx, const double *values, size_t count, tl_scalar scalar,
                        tl_scalar *narrow)
{
    scan_job job = {.values = values, .scalar = scalar};
    *narrow = scalar;
    if (scalar == TL_F64) return TL_OK;
    tl_status st = tli_parallel(ctx, count, SCAN_GRAIN, scan_piece, &job);
    if (atomic_load(&job.wider)) *narrow = TL_F64;
    return st;
}

/* ---- numbers of a mesh ---- */

/* Values of a channel or positions, on their way to a type. */
typedef struct real_source {
    const double *values;
    uint32_t components;
    tl_scalar scalar;
} real_source;

void tli_narrow(const double *values, size_t count, tl_scalar scalar, void *out)
{
#define NARROW(type)                                                                               \
    {                                                                                              \
        type *to = out;                                                                            \
        for (size_t i = 0; i < count; i++) to[i] = (type)values[i];                                \
        break;                                                                                     \
    }
    switch (scalar) {
    case TL_I8: NARROW(int8_t)
    case TL_U8: NARROW(uint8_t)
    case TL_I16: NARROW(int16_t)
    case TL_U16: NARROW(uint16_t)
    case TL_I32: NARROW(int32_t)
    case TL_U32: NARROW(uint32_t)
    case TL_I64: NARROW(int64_t)
    case TL_U64: NARROW(uint64_t)
    case TL_F32: NARROW(float)
    case TL_F64: memcpy(out, values, count * sizeof *values); break;
    }
#undef NARROW
}

static void fill_reals(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const real_source *source = arg;
    tli_narrow(source->values + begin * source->components,
               (size_t)(end - begin) * source->components, source->scalar, out);
}

static void fill_indices32(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const tl_lidx *tets = arg;
    memcpy(out, tets + 4 * begin, (size_t)(end - begin) * 4 * sizeof *tets);
}

static void fill_indices64(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const tl_lidx *tets = arg;
    int64_t *to = out;
    for (uint64_t i = 4 * begin; i < 4 * end; i++) *to++ = tets[i];
}

static void fill_regions(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const int32_t *regions = arg;
    memcpy(out, regions + begin, (size_t)(end - begin) * sizeof *regions);
}

/* ---- a mesh as arrays ---- */

typedef struct description {
    tli_out out;
    tli_out_array *arrays; /* [channels + 1] those on vertices, then those on tets */
    real_source *sources;  /* [channels + 1] the last one is the positions */
} description;

static bool holds_regions(const tl_mesh *mesh, const tl_channel *channel)
{
    const int32_t *regions = tl_mesh_regions(mesh);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++)
        if (channel->values[t] != regions[t]) return false;
    return true;
}

/* True if a reader would not find the regions in the channels: the first one with such a name holds
 * other ids, or there is none. A channel called region stays as it is. */
static bool needs_region_array(const tl_mesh *mesh)
{
    const tl_channel *first = NULL;
    if (!tl_mesh_regions(mesh)) return false;
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        if (channel->on != TL_ON_TET) continue;
        if (strcmp(channel->name, TLI_REGION_NAME) == 0) return false;
        if (!first && channel->components == 1 && tli_is_region_name(channel->name))
            first = channel;
    }
    return !first || !holds_regions(mesh, first);
}

static tl_status describe_channels(tl_ctx *ctx, const tl_mesh *mesh, tl_on on, description *d,
                                   uint32_t *used)
{
    tl_status st = TL_OK;
    size_t tuples = on == TL_ON_TET ? tl_mesh_tet_count(mesh) : tl_mesh_vert_count(mesh);
    for (size_t i = 0; i < tl_mesh_channel_count(mesh) && !st; i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        if (channel->on != on) continue;
        real_source *source = &d->sources[i];
        *source = (real_source){channel->values, channel->components, TL_F64};
        st = tli_narrowest(ctx, channel->values, tuples * channel->components, channel->scalar,
                           &source->scalar);
        d->arrays[(*used)++] = (tli_out_array){.name = channel->name,
                                               .unit = channel->unit,
                                               .scalar = source->scalar,
                                               .components = channel->components,
                                               .count = tuples,
                                               .fill = fill_reals,
                                               .arg = source};
    }
    return st;
}

static tl_status describe_mesh(tl_ctx *ctx, const tl_mesh *mesh, description *d)
{
    size_t verts = tl_mesh_vert_count(mesh), tets = tl_mesh_tet_count(mesh);
    size_t channels = tl_mesh_channel_count(mesh);
    real_source *positions = &d->sources[channels];
    *positions = (real_source){tl_mesh_xyz(mesh), 3, TL_F64};
    tl_status st = tli_narrowest(ctx, positions->values, 3 * verts, TL_F32, &positions->scalar);
    if (st) return st;

    tli_out *out = &d->out;
    tl_scalar index = tli_out_index_type(verts, tets);
    out->time = tl_mesh_time(mesh);
    out->points =
        (tli_out_array){"Points", NULL, positions->scalar, 3, verts, fill_reals, positions};
    out->tets = (tli_out_array){
        "connectivity",    NULL, index, 4, tets, index == TL_I32 ? fill_indices32 : fill_indices64,
        tl_mesh_tets(mesh)};
    uint32_t used = 0;
    st = describe_channels(ctx, mesh, TL_ON_VERTEX, d, &used);
    out->point_arrays = d->arrays;
    out->point_array_count = used;
    if (!st && needs_region_array(mesh)) /* first, so that a reader finds it first */
        d->arrays[used++] = (tli_out_array){
            TLI_REGION_NAME, NULL, TL_I32, 1, tets, fill_regions, tl_mesh_regions(mesh)};
    if (!st) st = describe_channels(ctx, mesh, TL_ON_TET, d, &used);
    out->cell_arrays = d->arrays + out->point_array_count;
    out->cell_array_count = used - out->point_array_count;
    return st;
}

/* ---- the door ---- */

/* Writers that take the mesh as it is, by the endings of names. */
static const struct {
    const char *ending;
    tl_status (*write)(tl_ctx *ctx, const tl_mesh *mesh, const char *path, bool ascii);
} mesh_writers[] = {
    {".msh", tli_write_gmsh},   {".mesh", tli_write_medit},  {".node", tli_write_tetgen},
    {".ele", tli_write_tetgen}, {".exo", tli_write_exodus},  {".exodus", tli_write_exodus},
    {".ex2", tli_write_exodus}, {".exii", tli_write_exodus}, {".gen", tli_write_exodus},
    {".e", tli_write_exodus},   {".g", tli_write_exodus},
};

tl_status tl_mesh_write(tl_ctx *ctx, const tl_mesh *mesh, const char *path,
                        const tl_write_opts *opts)
{
    tl_write_opts o = tl_write_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_write_opts", opts, &o, sizeof o);
    if (st) return st;
    bool vtk = tli_path_ends(path, ".vtk"), vtu = tli_path_ends(path, ".vtu");
    if (o.zlib && (!vtu || o.ascii))
        return tl_fail(ctx, TL_ERR_ARG, "'%s': only a binary .vtu can be compressed", path);
    for (size_t i = 0; i < sizeof mesh_writers / sizeof *mesh_writers; i++) {
        if (!tli_path_ends(path, mesh_writers[i].ending)) continue;
        if (o.ascii && mesh_writers[i].write == tli_write_exodus)
            return tl_fail(ctx, TL_ERR_ARG, "'%s': Exodus is no text", path);
        return mesh_writers[i].write(ctx, mesh, path, o.ascii);
    }
    if (!vtk && !vtu)
        return tl_fail(ctx, TL_ERR_ARG,
                       "'%s': the ending says as what to write, .vtu, .vtk, .msh, .mesh, .exo, "
                       ".node or .ele",
                       path);

    if (tl_mesh_label_count(mesh))
        tl_log(
            ctx, TL_LOG_INFO,
            "'%s': %zu named surfaces left out: VTK's files of tets have no place for them; .exo, "
            ".msh, .mesh and .node have",
            path, tl_mesh_label_count(mesh));
    size_t channels = tl_mesh_channel_count(mesh);
    description d = {.arrays = tl_mem_alloc(ctx, channels + 1, sizeof *d.arrays, &st)};
    d.sources = tl_mem_alloc(ctx, channels + 1, sizeof *d.sources, &st);
    if (!st) st = describe_mesh(ctx, mesh, &d);
    tli_encoding encoding = o.ascii ? TLI_TEXT : o.zlib ? TLI_ZLIB : TLI_RAW;
    if (!st)
        st = vtk ? tli_emit_vtk(ctx, path, &d.out, encoding)
                 : tli_emit_vtu(ctx, path, &d.out, encoding);
    tl_mem_free(ctx, d.sources);
    tl_mem_free(ctx, d.arrays);
    return st;
}
