/* VTU. Numbers stand in one appended section, raw, each array behind its size in bytes; with zlib
 * in blocks of a fixed size, each compressed for itself, on the pool, so that the bytes do not
 * depend on the threads. Text stands inline. */
#include "formats/formats_emit.h"
#include "formats/formats_split.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <zlib.h>

/* Bytes of a block before compression; a multiple of what a tuple takes. */
#define BLOCK_BYTES ((size_t)256 << 10)
/* Blocks that are in memory at once. */
#define BLOCKS_AT_ONCE 16
/* Higher levels take two to three times as long for one or two percent. */
#define ZLIB_LEVEL 5
/* Room for an offset that is known only later. */
#define OFFSET_DIGITS 20

/* Arrays of the file in the order of the appended section. */
typedef struct vtu {
    tli_emit emit;
    const tli_out *out;
    tli_encoding encoding;
    tli_out_array offsets, types; /* of the cells */
    uint64_t next_ofs;            /* raw: where the next array begins in the appended section */
    uint64_t *ofs_places;         /* zlib: places in the file that hold the offsets */
    uint32_t ofs_count;
} vtu;

static const char *type_name(tl_scalar scalar)
{
    static const char *const names[] = {
        [TL_I8] = "Int8",     [TL_U8] = "UInt8",   [TL_I16] = "Int16", [TL_U16] = "UInt16",
        [TL_I32] = "Int32",   [TL_U32] = "UInt32", [TL_I64] = "Int64", [TL_U64] = "UInt64",
        [TL_F32] = "Float32", [TL_F64] = "Float64"};
    return names[scalar];
}

/* ---- XML ---- */

/* ---- elements ---- */

static tl_status write_unit(const vtu *v, const tli_out_array *array)
{
    if (!array->unit || !array->unit[0]) return TL_OK;
    tl_status st = tli_sink_printf(v->emit.sink, "<InformationKey name=\"UNITS_LABEL\" "
                                                 "location=\"vtkDataArray\">");
    if (!st) st = tli_emit_escaped(v->emit.sink, array->unit);
    if (!st) st = tli_sink_printf(v->emit.sink, "</InformationKey>");
    return st;
}

static tl_status write_array(vtu *v, const tli_out_array *array)
{
    tli_sink *sink = v->emit.sink;
    tl_status st =
        tli_sink_printf(sink, "        <DataArray type=\"%s\" Name=\"", type_name(array->scalar));
    if (!st) st = tli_emit_escaped(sink, array->name);
    if (!st && array != &v->out->tets) /* VTK wants connectivity as a plain list */
        st = tli_sink_printf(sink, "\" NumberOfComponents=\"%u", array->components);
    if (!st) st = tli_sink_printf(sink, "\"");
    if (st) return st;
    if (v->encoding == TLI_TEXT) {
        st = tli_sink_printf(sink, " format=\"ascii\">\n");
        if (!st) st = tli_emit_text(&v->emit, array);
    } else if (v->encoding == TLI_RAW) {
        st = tli_sink_printf(sink, " format=\"appended\" offset=\"%llu\">",
                             (unsigned long long)v->next_ofs);
        v->next_ofs += sizeof(uint64_t) + array->count * tli_out_tuple_bytes(array);
    } else {
        st = tli_sink_printf(sink, " format=\"appended\" ");
        v->ofs_places[v->ofs_count++] = tli_sink_tell(sink);
        if (!st) st = tli_sink_printf(sink, "offset=\"0\"%*s>", OFFSET_DIGITS - 1, "");
    }
    if (!st) st = write_unit(v, array);
    if (!st) st = tli_sink_printf(sink, "</DataArray>\n");
    return st;
}

/* Name of the first array with so many components, as the active one. */
static tl_status write_active(const vtu *v, const tli_out_array *arrays, uint32_t count,
                              uint32_t components, const char *attribute)
{
    for (uint32_t i = 0; i < count; i++) {
        if (arrays[i].components != components) continue;
        tl_status st = tli_sink_printf(v->emit.sink, " %s=\"", attribute);
        if (!st) st = tli_emit_escaped(v->emit.sink, arrays[i].name);
        if (!st) st = tli_sink_printf(v->emit.sink, "\"");
        return st;
    }
    return TL_OK;
}

static tl_status write_section(vtu *v, const char *name, const tli_out_array *arrays,
                               uint32_t count)
{
    tl_status st = tli_sink_printf(v->emit.sink, "      <%s", name);
    if (!st) st = write_active(v, arrays, count, 1, "Scalars");
    if (!st) st = write_active(v, arrays, count, 3, "Vectors");
    if (!st) st = tli_sink_printf(v->emit.sink, ">\n");
    for (uint32_t i = 0; i < count && !st; i++) st = write_array(v, &arrays[i]);
    if (!st) st = tli_sink_printf(v->emit.sink, "      </%s>\n", name);
    return st;
}

static tl_status write_head(vtu *v)
{
    tli_sink *sink = v->emit.sink;
    const tli_out *out = v->out;
    tl_status st =
        tli_sink_printf(sink,
                        "<?xml version=\"1.0\"?>\n"
                        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\" "
                        "header_type=\"UInt64\"%s>\n  <UnstructuredGrid>\n",
                        tli_big_endian_host() ? "BigEndian" : "LittleEndian",
                        v->encoding == TLI_ZLIB ? " compressor=\"vtkZLibDataCompressor\"" : "");
    if (!st && !isnan(out->time)) {
        tli_out_array time = {"TimeValue", NULL, TL_F64, 1, 1, tli_fill_number, &out->time};
        st = tli_sink_printf(sink, "    <FieldData>\n      <DataArray type=\"Float64\" "
                                   "Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">\n");
        if (!st) st = tli_emit_text(&v->emit, &time);
        if (!st) st = tli_sink_printf(sink, "      </DataArray>\n    </FieldData>\n");
    }
    if (!st)
        st = tli_sink_printf(sink, "    <Piece NumberOfPoints=\"%llu\" NumberOfCells=\"%llu\">\n",
                             (unsigned long long)out->points.count,
                             (unsigned long long)out->tets.count);
    return st;
}

static tl_status write_elements(vtu *v)
{
    tli_sink *sink = v->emit.sink;
    const tli_out *out = v->out;
    tl_status st = write_head(v);
    if (!st) st = write_section(v, "PointData", out->point_arrays, out->point_array_count);
    if (!st) st = write_section(v, "CellData", out->cell_arrays, out->cell_array_count);
    if (!st) st = tli_sink_printf(sink, "      <Points>\n");
    if (!st) st = write_array(v, &out->points);
    if (!st) st = tli_sink_printf(sink, "      </Points>\n      <Cells>\n");
    if (!st) st = write_array(v, &out->tets);
    if (!st) st = write_array(v, &v->offsets);
    if (!st) st = write_array(v, &v->types);
    if (!st) st = tli_sink_printf(sink, "      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n");
    return st;
}

/* ---- zlib ---- */

typedef struct block_job {
    const tli_out_array *array;
    uint64_t first_block;
    size_t block_tuples;
    size_t room;       /* for one compressed block */
    uint8_t *plain;    /* [BLOCKS_AT_ONCE][block bytes] */
    uint8_t *packed;   /* [BLOCKS_AT_ONCE][room] */
    uint64_t *lengths; /* [all blocks] of the compressed ones */
    tl_ctx *ctx;
} block_job;

static tl_status pack_blocks(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const block_job *job = arg;
    size_t tuple = tli_out_tuple_bytes(job->array);
    for (size_t b = begin; b < end; b++) {
        uint64_t first = (job->first_block + b) * job->block_tuples;
        uint64_t rest = job->array->count - first;
        size_t count = rest < job->block_tuples ? (size_t)rest : job->block_tuples;
        uint8_t *plain = job->plain + b * job->block_tuples * tuple;
        uLongf length = (uLongf)job->room;
        job->array->fill(job->array->arg, first, first + count, plain);
        int result = compress2(job->packed + b * job->room, &length, plain, (uLong)(count * tuple),
                               ZLIB_LEVEL);
        if (result != Z_OK)
            return tl_fail(job->ctx, TL_ERR_MEMORY, "zlib can't compress a block of %zu bytes",
                           count * tuple);
        job->lengths[job->first_block + b] = length;
    }
    return TL_OK;
}

static tl_status write_blocks(tli_emit *emit, block_job *job, uint64_t block_count)
{
    tl_status st = TL_OK;
    for (; job->first_block < block_count && !st; job->first_block += BLOCKS_AT_ONCE) {
        uint64_t rest = block_count - job->first_block;
        size_t blocks = rest < BLOCKS_AT_ONCE ? (size_t)rest : BLOCKS_AT_ONCE;
        st = tli_parallel(emit->ctx, blocks, 1, pack_blocks, job);
        for (size_t b = 0; b < blocks && !st; b++)
            st = tli_sink_write(emit->sink, job->packed + b * job->room,
                                (size_t)job->lengths[job->first_block + b]);
        uint64_t tuples = (job->first_block + blocks) * job->block_tuples;
        if (tuples > job->array->count) tuples = job->array->count;
        uint64_t done = emit->done + tuples * tli_out_tuple_bytes(job->array);
        if (!st) st = tl_progress(emit->ctx, "write", done, emit->total);
    }
    return st;
}

/* Head: number of blocks, bytes of one, bytes of the last if it is shorter (else 0), and the length
 * of each compressed block; then the blocks. */
static tl_status write_packed(tli_emit *emit, const tli_out_array *array)
{
    tl_status st = TL_OK;
    size_t tuple = tli_out_tuple_bytes(array);
    block_job job = {.array = array, .ctx = emit->ctx};
    job.block_tuples = tuple < BLOCK_BYTES ? BLOCK_BYTES / tuple : 1;
    size_t block_bytes = job.block_tuples * tuple;
    uint64_t block_count = (array->count + job.block_tuples - 1) / job.block_tuples;
    uint64_t last = array->count % job.block_tuples * tuple;
    uint64_t head[3] = {block_count, block_bytes, last};
    uint64_t head_ofs = tli_sink_tell(emit->sink);
    size_t at_once = block_count < BLOCKS_AT_ONCE ? (size_t)block_count : BLOCKS_AT_ONCE;
    job.room = (size_t)compressBound((uLong)block_bytes);
    job.plain = tl_mem_alloc(emit->ctx, at_once, block_bytes, &st);
    job.packed = tl_mem_alloc(emit->ctx, at_once, job.room, &st);
    job.lengths = tl_mem_zalloc(emit->ctx, (size_t)block_count, sizeof *job.lengths, &st);
    size_t lengths_bytes = (size_t)block_count * sizeof *job.lengths;
    if (!st) st = tli_sink_write(emit->sink, head, sizeof head);
    if (!st) st = tli_sink_write(emit->sink, job.lengths, lengths_bytes);
    if (!st) st = write_blocks(emit, &job, block_count);
    if (!st && lengths_bytes)
        st = tli_sink_patch(emit->sink, head_ofs + sizeof head, job.lengths, lengths_bytes);
    emit->done += array->count * tuple;
    tl_mem_free(emit->ctx, job.lengths);
    tl_mem_free(emit->ctx, job.packed);
    tl_mem_free(emit->ctx, job.plain);
    return st;
}

/* ---- appended section ---- */

static tl_status append_array(vtu *v, uint32_t index, uint64_t section_ofs,
                              const tli_out_array *array)
{
    tli_sink *sink = v->emit.sink;
    if (v->encoding == TLI_RAW) {
        uint64_t bytes = array->count * tli_out_tuple_bytes(array);
        tl_status st = tli_sink_write(sink, &bytes, sizeof bytes);
        return st ? st : tli_emit_raw(&v->emit, array, false);
    }
    char text[64];
    int length = snprintf(text, sizeof text, "offset=\"%llu\"",
                          (unsigned long long)(tli_sink_tell(sink) - section_ofs));
    tl_status st = tli_sink_patch(sink, v->ofs_places[index], text, (size_t)length);
    return st ? st : write_packed(&v->emit, array);
}

static tl_status write_appended(vtu *v)
{
    const tli_out *out = v->out;
    tl_status st = tli_sink_printf(v->emit.sink, "  <AppendedData encoding=\"raw\">\n   _");
    uint64_t section_ofs = tli_sink_tell(v->emit.sink);
    uint32_t index = 0;
    for (uint32_t i = 0; i < out->point_array_count && !st; i++)
        st = append_array(v, index++, section_ofs, &out->point_arrays[i]);
    for (uint32_t i = 0; i < out->cell_array_count && !st; i++)
        st = append_array(v, index++, section_ofs, &out->cell_arrays[i]);
    const tli_out_array *mesh[] = {&out->points, &out->tets, &v->offsets, &v->types};
    for (size_t i = 0; i < sizeof mesh / sizeof mesh[0] && !st; i++)
        st = append_array(v, index++, section_ofs, mesh[i]);
    if (!st) st = tli_sink_printf(v->emit.sink, "\n  </AppendedData>\n");
    return st;
}

/* ---- cells ---- */

static void fill_offsets32(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    (void)arg;
    int32_t *at = out;
    for (uint64_t t = begin; t < end; t++) *at++ = (int32_t)(4 * (t + 1));
}

static void fill_offsets64(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    (void)arg;
    int64_t *at = out;
    for (uint64_t t = begin; t < end; t++) *at++ = (int64_t)(4 * (t + 1));
}

static void fill_types(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    (void)arg;
    memset(out, TLI_VTK_TETRA, (size_t)(end - begin));
}

tl_status tli_emit_vtu(tl_ctx *ctx, const char *path, const tli_out *out, tli_encoding encoding)
{
    bool narrow = out->tets.scalar == TL_I32;
    vtu v = {.emit = {.ctx = ctx, .total = tli_out_bytes(out)}, .out = out, .encoding = encoding};
    v.offsets = (tli_out_array){"offsets",
                                NULL,
                                out->tets.scalar,
                                1,
                                out->tets.count,
                                narrow ? fill_offsets32 : fill_offsets64,
                                NULL};
    v.types = (tli_out_array){"types", NULL, TL_U8, 1, out->tets.count, fill_types, NULL};
    v.emit.total += sizeof out->time + out->tets.count * (tl_scalar_bytes(v.offsets.scalar) + 1);
    tl_status st = TL_OK;
    v.ofs_places = tl_mem_alloc(ctx, (size_t)out->point_array_count + out->cell_array_count + 4,
                                sizeof *v.ofs_places, &st);
    if (!st) st = tli_sink_open(ctx, path, &v.emit.sink);
    if (!st) st = write_elements(&v);
    if (!st && encoding != TLI_TEXT) st = write_appended(&v);
    if (!st) st = tli_sink_printf(v.emit.sink, "</VTKFile>\n");
    tl_mem_free(ctx, v.ofs_places);
    return tli_emit_close(&v.emit, path, st);
}
