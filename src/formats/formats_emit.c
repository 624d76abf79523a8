/* Arrays to bytes or text: pieces are filled on the pool into one buffer of fixed size, which then
 * goes to the file in order, so memory does not grow with the file and bytes do not depend on the
 * threads. */
#include "formats/formats_emit.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Size of the buffer; an array with larger tuples gets one tuple at a time. */
#define BUFFER_BYTES ((size_t)4 << 20)
/* Pieces that the buffer is filled in. */
#define BUFFER_PIECES 16

size_t tli_out_tuple_bytes(const tli_out_array *array)
{
    return array->components * tl_scalar_bytes(array->scalar);
}

uint64_t tli_out_bytes(const tli_out *out)
{
    uint64_t sum = out->points.count * tli_out_tuple_bytes(&out->points) +
                   out->tets.count * tli_out_tuple_bytes(&out->tets);
    for (uint32_t i = 0; i < out->point_array_count; i++)
        sum += out->point_arrays[i].count * tli_out_tuple_bytes(&out->point_arrays[i]);
    for (uint32_t i = 0; i < out->cell_array_count; i++)
        sum += out->cell_arrays[i].count * tli_out_tuple_bytes(&out->cell_arrays[i]);
    return sum;
}

tl_scalar tli_out_index_type(uint64_t point_count, uint64_t tet_count)
{
    return point_count <= INT32_MAX && tet_count <= INT32_MAX / 4 ? TL_I32 : TL_I64;
}

bool tli_big_endian_host(void)
{
    const uint16_t one = 1;
    uint8_t first;
    memcpy(&first, &one, 1);
    return first == 0;
}

void tli_fill_number(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    if (end > begin) memcpy(out, arg, sizeof(double));
}

/* ---- pieces ---- */

static void swap_bytes(uint8_t *bytes, size_t number_bytes, size_t count)
{
    for (size_t i = 0; i < count; i++, bytes += number_bytes)
        for (size_t low = 0, high = number_bytes - 1; low < high; low++, high--) {
            uint8_t byte = bytes[low];
            bytes[low] = bytes[high];
            bytes[high] = byte;
        }
}

typedef struct fill_job {
    const tli_out_array *array;
    uint64_t first; /* tuple at the start of the buffer */
    uint8_t *buffer;
    bool swap;
} fill_job;

static tl_status fill_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const fill_job *job = arg;
    const tli_out_array *array = job->array;
    uint8_t *out = job->buffer + begin * tli_out_tuple_bytes(array);
    array->fill(array->arg, job->first + begin, job->first + end, out);
    if (job->swap)
        swap_bytes(out, tl_scalar_bytes(array->scalar), (end - begin) * array->components);
    return TL_OK;
}

typedef tl_status (*take_fn)(tli_emit *emit, const tli_out_array *array, const void *tuples,
                             size_t count);

static tl_status stream(tli_emit *emit, const tli_out_array *array, bool swap, take_fn take)
{
    tl_status st = TL_OK;
    size_t tuple = tli_out_tuple_bytes(array);
    size_t batch = tuple < BUFFER_BYTES ? BUFFER_BYTES / tuple : 1;
    if (batch > array->count) batch = (size_t)array->count;
    size_t grain = batch / BUFFER_PIECES + 1;
    fill_job job = {array, 0, tl_mem_alloc(emit->ctx, batch, tuple, &st), swap};
    for (; job.first < array->count && !st; job.first += batch) {
        uint64_t rest = array->count - job.first;
        size_t count = rest < batch ? (size_t)rest : batch;
        st = tli_parallel(emit->ctx, count, grain, fill_piece, &job);
        if (!st) st = take(emit, array, job.buffer, count);
        emit->done += count * tuple;
        if (!st) st = tl_progress(emit->ctx, "write", emit->done, emit->total);
    }
    tl_mem_free(emit->ctx, job.buffer);
    return st;
}

/* ---- raw ---- */

static tl_status take_raw(tli_emit *emit, const tli_out_array *array, const void *tuples,
                          size_t count)
{
    return tli_sink_write(emit->sink, tuples, count * tli_out_tuple_bytes(array));
}

tl_status tli_emit_raw(tli_emit *emit, const tli_out_array *array, bool swap)
{
    return stream(emit, array, swap, take_raw);
}

/* ---- text ---- */

int tli_print_real(char *text, double value, int digits)
{
    if (isnan(value)) return snprintf(text, TLI_NUMBER_BYTES, "nan");
    if (isinf(value)) return snprintf(text, TLI_NUMBER_BYTES, value < 0 ? "-inf" : "inf");
    return tli_print(text, TLI_NUMBER_BYTES, "%.*g", digits, value);
}

static int print_number(char *text, tl_scalar scalar, const uint8_t *at)
{
#define AS(type, name)                                                                             \
    type name;                                                                                     \
    memcpy(&name, at, sizeof name)
    switch (scalar) {
    case TL_I8: return snprintf(text, TLI_NUMBER_BYTES, "%d", *(const int8_t *)at);
    case TL_U8: return snprintf(text, TLI_NUMBER_BYTES, "%d", *at);
    case TL_I16: {
        AS(int16_t, value);
        return snprintf(text, TLI_NUMBER_BYTES, "%d", value);
    }
    case TL_U16: {
        AS(uint16_t, value);
        return snprintf(text, TLI_NUMBER_BYTES, "%d", value);
    }
    case TL_I32: {
        AS(int32_t, value);
        return snprintf(text, TLI_NUMBER_BYTES, "%" PRId32, value);
    }
    case TL_U32: {
        AS(uint32_t, value);
        return snprintf(text, TLI_NUMBER_BYTES, "%" PRIu32, value);
    }
    case TL_I64: {
        AS(int64_t, value);
        return snprintf(text, TLI_NUMBER_BYTES, "%" PRId64, value);
    }
    case TL_U64: {
        AS(uint64_t, value);
        return snprintf(text, TLI_NUMBER_BYTES, "%" PRIu64, value);
    }
    case TL_F32: {
        AS(float, value);
        return tli_print_real(text, (double)value, 9);
    }
    case TL_F64: {
        AS(double, value);
        return tli_print_real(text, value, 17);
    }
    }
#undef AS
    return 0;
}

static tl_status take_text(tli_emit *emit, const tli_out_array *array, const void *tuples,
                           size_t count)
{
    const uint8_t *at = tuples;
    size_t bytes = tl_scalar_bytes(array->scalar);
    tl_status st = TL_OK;
    for (size_t i = 0; i < count && !st; i++)
        for (uint32_t c = 0; c < array->components && !st; c++, at += bytes) {
            char text[TLI_NUMBER_BYTES];
            int length = print_number(text, array->scalar, at);
            emit->nonfinite += strchr("ni", text[text[0] == '-']) != NULL;
            text[length] = c + 1 == array->components ? '\n' : ' ';
            st = tli_sink_write(emit->sink, text, (size_t)length + 1);
        }
    return st;
}

tl_status tli_emit_text(tli_emit *emit, const tli_out_array *array)
{
    return stream(emit, array, false, take_text);
}

tl_status tli_emit_close(tli_emit *emit, const char *path, tl_status st)
{
    tl_status end = tli_sink_close(emit->sink, !st);
    if (!st) st = end;
    if (st) return tl_note(emit->ctx, st, "while writing '%s'", path);
    if (emit->nonfinite)
        tl_log(emit->ctx, TL_LOG_INFO,
               "%llu numbers are not finite; VTK reads such text wrongly or not at all",
               (unsigned long long)emit->nonfinite);
    return TL_OK;
}
