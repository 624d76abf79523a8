/* VTK XML: the numbers of one array, from text, base64 or bytes, packed or not, straight to where
 * they belong. The work is cut into pieces that depend on nothing but the array, and runs on the
 * pool. */
#include <math.h>
#include <string.h>

#include "formats/formats_number.h"
#include "formats/formats_vtkxml.h"

#define BATCH 1024u         /* numbers that stay in the first cache between two steps */
#define GRAIN_VALUES 65536u /* of plain arrays that one task works on */
#define GRAIN_BLOCKS 4u     /* of packed ones; VTK's blocks have 32 KiB */
#define GRAIN_BYTES 196608u /* of packed data out of base64; a multiple of 3 */

typedef struct read_job {
    const tli_vx_file *file;
    const tli_vx_array *array;
    const tli_vx_target *target;
    uint64_t count;
    uint64_t first;       /* in the array, of the number that is 0 in the target; for messages */
    const uint8_t *bytes; /* plain: the numbers; packed: the blocks; NULL: in base64 */
    const char *base64;   /* clean characters */
    uint32_t skip_bytes;  /* of the first base64 groups */
    uint8_t *decoded;     /* where bytes in base64 go that are no numbers yet */
    tli_vx_unpacker **unpackers; /* [threads] */
    uint8_t **buffers;           /* [threads][block_bytes], or NULL */
} read_job;

static tl_status fail_array(const read_job *job, const char *what, uint64_t where, const char *more)
{
    char label[128];
    tli_vx_label(job->array, label, sizeof label);
    return tl_fail(job->file->ctx, TL_ERR_FORMAT, "array %s: %s %llu: %s", label, what,
                   (unsigned long long)where, more);
}

/* ---- numbers to the target ---- */

static tl_status store_ints(const read_job *job, uint64_t first, const int64_t *ints, size_t count)
{
    const tli_vx_target *target = job->target;
    uint64_t limit = target->limit, add = target->add;
    bool bad = false;
    for (size_t i = 0; i < count; i++) bad |= (uint64_t)ints[i] >= limit;
    if (bad) {
        size_t i = 0;
        while ((uint64_t)ints[i] < limit) i++;
        char label[128];
        tli_vx_label(job->array, label, sizeof label);
        return tl_fail(job->file->ctx, TL_ERR_FORMAT,
                       "array %s: value %llu is %lld, expected at least 0 and below %llu", label,
                       (unsigned long long)(first + i), (long long)ints[i],
                       (unsigned long long)limit);
    }
    if (target->u32)
        for (size_t i = 0; i < count; i++)
            target->u32[first + i] = (uint32_t)((uint64_t)ints[i] + add);
    else if (target->u64)
        for (size_t i = 0; i < count; i++) target->u64[first + i] = (uint64_t)ints[i] + add;
    else
        for (size_t i = 0; i < count; i++)
            target->u8[first + i] = (uint8_t)((uint64_t)ints[i] + add);
    return TL_OK;
}

/* A whole number that fits, else one that no limit lets pass. */
static int64_t int_of(double value)
{
    return value >= 0 && value < 0x1p53 && value == floor(value) ? (int64_t)value : -1;
}

/* The compiler turns each loop over bytes into one load, and a swap where it is needed. */
static inline uint64_t load(const uint8_t *bytes, size_t width, bool big_endian)
{
    uint64_t word = 0;
    for (size_t i = 0; i < width; i++)
        word |= (uint64_t)bytes[i] << 8 * (big_endian ? width - 1 - i : i);
    return word;
}

/* big is a constant where this is called, so that there is one loop for each type and order. */
static inline void load_ordered(const uint8_t *bytes, tl_scalar scalar, bool big, size_t count,
                                int64_t *ints)
{
    switch (scalar) {
    case TL_I8:
        for (size_t i = 0; i < count; i++) ints[i] = (int8_t)bytes[i];
        break;
    case TL_U8:
        for (size_t i = 0; i < count; i++) ints[i] = bytes[i];
        break;
    case TL_I16:
        for (size_t i = 0; i < count; i++) ints[i] = (int16_t)load(bytes + 2 * i, 2, big);
        break;
    case TL_U16:
        for (size_t i = 0; i < count; i++) ints[i] = (uint16_t)load(bytes + 2 * i, 2, big);
        break;
    case TL_I32:
        for (size_t i = 0; i < count; i++) ints[i] = (int32_t)load(bytes + 4 * i, 4, big);
        break;
    case TL_U32:
        for (size_t i = 0; i < count; i++) ints[i] = (uint32_t)load(bytes + 4 * i, 4, big);
        break;
    default:
        for (size_t i = 0; i < count; i++) ints[i] = (int64_t)load(bytes + 8 * i, 8, big);
    }
}

static void load_ints(const uint8_t *bytes, tl_scalar scalar, bool big, size_t count, int64_t *ints)
{
    if (big)
        load_ordered(bytes, scalar, true, count, ints);
    else
        load_ordered(bytes, scalar, false, count, ints);
}

/* Numbers [first, first + count) of the array, which stand at bytes. */
static tl_status store(const read_job *job, uint64_t first, const uint8_t *bytes, uint64_t count)
{
    tl_scalar scalar = job->array->scalar;
    bool big = job->file->big_endian;
    if (job->target->f64) {
        tli_widen(bytes, scalar, big, count, job->target->f64 + first);
        return TL_OK;
    }
    size_t width = tl_scalar_bytes(scalar);
    tl_status st = TL_OK;
    for (uint64_t i = 0; !st && i < count; i += BATCH) {
        int64_t ints[BATCH];
        double values[BATCH];
        size_t part = count - i < BATCH ? (size_t)(count - i) : BATCH;
        if (scalar == TL_F32 || scalar == TL_F64) {
            tli_widen(bytes + i * width, scalar, big, part, values);
            for (size_t j = 0; j < part; j++) ints[j] = int_of(values[j]);
        } else {
            load_ints(bytes + i * width, scalar, big, part, ints);
        }
        st = store_ints(job, first + i, ints, part);
    }
    return st;
}

/* ---- ascii ---- */

static bool is_space(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* The names that old Microsoft libraries print; NULL if it is none of them. */
static const char *read_odd_number(const char *at, const char *end, double *value)
{
    static const char *const words[] = {"1.#INF", "1.#QNAN", "1.#SNAN", "1.#IND"};
    bool negative = *at == '-';
    if (*at == '-' || *at == '+') at++;
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        size_t length = strlen(words[i]);
        if ((size_t)(end - at) < length || memcmp(at, words[i], length) != 0) continue;
        *value = i ? (double)NAN : negative ? -(double)INFINITY : (double)INFINITY;
        at += length;
        while (at < end && *at == '0') at++; /* padded to a precision */
        return at;
    }
    return NULL;
}

/* One number of the array's type; at stands on its first character. */
static const char *read_f64(const char *at, const char *end, tl_scalar scalar, double *value)
{
    const char *after;
    if (scalar == TL_F32) {
        float narrow;
        if ((after = tli_number_f32(at, end, &narrow))) *value = (double)narrow;
    } else if (scalar == TL_F64) {
        after = tli_number_f64(at, end, value);
    } else {
        int64_t whole;
        if ((after = tli_number_i64(at, end, &whole)))
            *value = (double)whole;
        else
            after = tli_number_f64(at, end, value);
    }
    bool is_odd = !after || (after < end && *after == '#');
    return is_odd ? read_odd_number(at, end, value) : after;
}

static tl_status fail_word(const read_job *job, const char *at, const char *end)
{
    tli_span word = {at, 0};
    while (at + word.bytes < end && word.bytes < 40 && !is_space(at[word.bytes])) word.bytes++;
    char text[128], label[128];
    tli_span_text(word, text, sizeof text);
    tli_vx_label(job->array, label, sizeof label);
    return tl_fail(job->file->ctx, TL_ERR_FORMAT, "array %s: '%s' at byte %llu is no number", label,
                   text, (unsigned long long)(at - (const char *)job->file->map->bytes));
}

/* The numbers that begin in one chunk of text. */
static tl_status read_chunk(const read_job *job, uint64_t chunk)
{
    const tli_vx_array *array = job->array;
    const char *text = array->run.text, *end = text + array->run.bytes;
    const char *at = text + chunk * array->block_bytes;
    uint64_t index = array->marks[chunk], stop = array->marks[chunk + 1];
    if (stop > job->count) stop = job->count;
    if (chunk && !is_space(at[-1]))
        while (at < end && !is_space(*at)) at++; /* the rest of a number of the chunk before */
    int64_t ints[BATCH];
    size_t waiting = 0;
    for (; index < stop; index++) {
        double value;
        int64_t whole = -1;
        at = tli_number_skip_space(at, end);
        const char *after = NULL;
        if (!job->target->f64) after = tli_number_i64(at, end, &whole);
        if (!after) {
            after = read_f64(at, end, array->scalar, &value);
            if (after) whole = int_of(value);
        } else {
            value = 0;
        }
        if (!after || (after < end && !is_space(*after))) return fail_word(job, at, end);
        at = after;
        if (job->target->f64) {
            job->target->f64[index] = value;
            continue;
        }
        ints[waiting++] = whole;
        if (waiting < BATCH && index + 1 < stop) continue;
        tl_status st = store_ints(job, index + 1 - waiting, ints, waiting);
        if (st) return st;
        waiting = 0;
    }
    return TL_OK;
}

static tl_status read_chunks(void *arg, size_t begin, size_t end, unsigned worker)
{
    const read_job *job = arg;
    tl_status st = TL_OK;
    (void)worker;
    for (size_t chunk = begin; !st && chunk < end; chunk++) st = read_chunk(job, chunk);
    return st;
}

static tl_status read_ascii(read_job *job)
{
    return tli_parallel(job->file->ctx, (size_t)job->array->mark_count - 1, 1, read_chunks, job);
}

/* ---- plain ---- */

static tl_status read_plain_values(void *arg, size_t begin, size_t end, unsigned worker)
{
    const read_job *job = arg;
    size_t width = tl_scalar_bytes(job->array->scalar);
    tl_status st = TL_OK;
    (void)worker;
    if (job->bytes) return store(job, begin, job->bytes + begin * width, end - begin);
    for (size_t i = begin; !st && i < end; i += BATCH) {
        uint8_t group[BATCH * 8 + 3];
        size_t part = end - i < BATCH ? end - i : BATCH;
        uint64_t from = job->skip_bytes + (uint64_t)i * width; /* in bytes of the run */
        size_t lead = (size_t)(from % 3);
        if (!tli_base64_decode(job->base64 + from / 3 * 4, lead + part * width, group))
            return fail_array(job, "value", i, "it or one of the next is not base64");
        st = store(job, i, group + lead, part);
    }
    return st;
}

static tl_status read_plain(read_job *job)
{
    const tli_vx_array *array = job->array;
    const char *data = array->run.text + array->data_chars;
    tl_ctx *ctx = job->file->ctx;
    char *owned = NULL;
    tl_status st = TL_OK;
    if (array->coding == TLI_VX_RAW) {
        job->bytes = (const uint8_t *)data;
    } else {
        tli_span text = {data, array->run.bytes - (size_t)array->data_chars};
        uint64_t bytes = array->skip_bytes + job->count * tl_scalar_bytes(array->scalar);
        job->skip_bytes = array->skip_bytes;
        st = tli_base64_strip(ctx, text, tli_base64_chars(bytes), &job->base64, &owned);
        if (st) st = tl_note(ctx, st, "in the array at byte %llu", (unsigned long long)array->ofs);
    }
    if (!st) st = tli_parallel(ctx, (size_t)job->count, GRAIN_VALUES, read_plain_values, job);
    tl_mem_free(ctx, owned);
    return st;
}

/* ---- packed ---- */

/* Unpacks block b to bytes. */
static tl_status unpack_block(const read_job *job, uint64_t b, uint8_t *bytes, unsigned worker)
{
    const tli_vx_array *array = job->array;
    uint64_t place = array->marks[b], block_bytes = array->block_bytes;
    if (b + 2 == array->mark_count) block_bytes = array->byte_count - b * array->block_bytes;
    const char *wrong;
    tl_status st =
        tli_vx_unpack(job->unpackers[worker], job->bytes + place,
                      (size_t)(array->marks[b + 1] - place), bytes, (size_t)block_bytes, &wrong);
    return st == TL_ERR_FORMAT ? fail_array(job, "block", b, wrong) : st;
}

/* Blocks that hold whole numbers: each goes its way without waiting for the others. */
static tl_status read_blocks(void *arg, size_t begin, size_t end, unsigned worker)
{
    const read_job *job = arg;
    size_t width = tl_scalar_bytes(job->array->scalar);
    tl_status st = TL_OK;
    for (size_t b = begin; !st && b < end; b++) {
        uint64_t first = b * (job->array->block_bytes / width);
        uint64_t count = job->array->block_bytes / width;
        if (count > job->count - first) count = job->count - first;
        st = unpack_block(job, b, job->buffers[worker], worker);
        if (!st) st = store(job, first, job->buffers[worker], count);
    }
    return st;
}

/* Blocks that cut numbers in two: first all bytes, then the numbers. */
static tl_status gather_blocks(void *arg, size_t begin, size_t end, unsigned worker)
{
    const read_job *job = arg;
    tl_status st = TL_OK;
    for (size_t b = begin; !st && b < end; b++)
        st = unpack_block(job, b, job->decoded + b * job->array->block_bytes, worker);
    return st;
}

static tl_status decode_packed_base64(void *arg, size_t begin, size_t end, unsigned worker)
{
    const read_job *job = arg;
    (void)worker;
    if (tli_base64_decode(job->base64 + begin / 3 * 4, end - begin, job->decoded + begin))
        return TL_OK;
    return fail_array(job, "packed byte", begin, "it or one of the next is not base64");
}

/* The packed bytes: those of the file, or decoded from base64 into *owned. */
static tl_status find_packed(read_job *job, uint8_t **owned)
{
    const tli_vx_array *array = job->array;
    const char *data = array->run.text + array->data_chars;
    tl_ctx *ctx = job->file->ctx;
    if (array->coding == TLI_VX_RAW) {
        job->bytes = (const uint8_t *)data;
        return TL_OK;
    }
    tli_span text = {data, array->run.bytes - (size_t)array->data_chars};
    uint64_t bytes = array->marks[array->mark_count - 1];
    char *clean;
    tl_status st = tli_base64_strip(ctx, text, tli_base64_chars(bytes), &job->base64, &clean);
    if (st) return tl_note(ctx, st, "in the array at byte %llu", (unsigned long long)array->ofs);
    *owned = tl_mem_alloc(ctx, (size_t)bytes, 1, &st);
    job->decoded = *owned;
    if (!st) st = tli_parallel(ctx, (size_t)bytes, GRAIN_BYTES, decode_packed_base64, job);
    job->bytes = *owned;
    tl_mem_free(ctx, clean);
    return st;
}

static tl_status read_through_buffers(read_job *job, uint64_t block_count, unsigned thread_count)
{
    tl_ctx *ctx = job->file->ctx;
    tl_status st = TL_OK;
    uint64_t bytes = job->array->block_bytes; /* one small block may call itself larger */
    if (bytes > job->array->byte_count) bytes = job->array->byte_count;
    job->buffers = tl_mem_zalloc(ctx, thread_count, sizeof *job->buffers, &st);
    for (unsigned t = 0; !st && t < thread_count && t < block_count; t++)
        job->buffers[t] = tl_mem_alloc(ctx, (size_t)bytes, 1, &st);
    size_t grain = block_count / GRAIN_BLOCKS >= thread_count ? GRAIN_BLOCKS : 1;
    if (!st) st = tli_parallel(ctx, (size_t)block_count, grain, read_blocks, job);
    for (unsigned t = 0; job->buffers && t < thread_count; t++) tl_mem_free(ctx, job->buffers[t]);
    tl_mem_free(ctx, job->buffers);
    return st;
}

static tl_status read_through_bytes(read_job *job, uint64_t block_count)
{
    const tli_vx_array *array = job->array;
    tl_ctx *ctx = job->file->ctx;
    tl_status st = TL_OK;
    uint8_t *all = tl_mem_alloc(ctx, (size_t)array->byte_count, 1, &st);
    job->decoded = all;
    if (!st) st = tli_parallel(ctx, (size_t)block_count, 1, gather_blocks, job);
    job->bytes = all;
    if (!st) st = tli_parallel(ctx, (size_t)job->count, GRAIN_VALUES, read_plain_values, job);
    tl_mem_free(ctx, all);
    return st;
}

static tl_status read_packed(read_job *job)
{
    const tli_vx_array *array = job->array;
    tl_ctx *ctx = job->file->ctx;
    unsigned thread_count = tl_ctx_thread_count(ctx);
    size_t width = tl_scalar_bytes(array->scalar);
    uint64_t block_count = array->mark_count - 1;
    bool is_whole = array->block_bytes % width == 0 || block_count == 1;
    if (is_whole && block_count > 1) { /* those after the last number asked for stay packed */
        uint64_t block_values = array->block_bytes / width;
        uint64_t needed = job->count / block_values + (job->count % block_values != 0);
        if (needed < block_count) block_count = needed;
    }
    uint8_t *packed = NULL;
    tl_status st = find_packed(job, &packed);
    job->unpackers = tl_mem_zalloc(ctx, thread_count, sizeof(tli_vx_unpacker *), &st);
    for (unsigned t = 0; !st && t < thread_count; t++)
        st = tli_vx_unpacker_create(ctx, job->file->packing, &job->unpackers[t]);
    if (!st)
        st = is_whole ? read_through_buffers(job, block_count, thread_count)
                      : read_through_bytes(job, block_count);
    for (unsigned t = 0; job->unpackers && t < thread_count; t++)
        tli_vx_unpacker_destroy(ctx, job->unpackers[t]);
    tl_mem_free(ctx, job->unpackers);
    tl_mem_free(ctx, packed);
    return st;
}

/* ---- all kinds ---- */

tl_status tli_vx_read(tli_vx_file *file, const tli_vx_array *array, uint64_t count,
                      const tli_vx_target *target)
{
    if (count == 0) return TL_OK;
    TL_ASSERT(array->is_open && count <= array->value_count);
    /* an array that goes with two of another piece is read twice */
    size_t done = file->read_count < file->array_count ? file->read_count++ : file->array_count;
    tl_status st = tl_progress(file->ctx, "read", done, file->array_count);
    if (st) return st;
    read_job job = {.file = file, .array = array, .target = target, .count = count};
    if (array->coding == TLI_VX_ASCII) return read_ascii(&job);
    return file->packing == TLI_VX_PLAIN ? read_plain(&job) : read_packed(&job);
}

tl_status tli_vx_read_part(tli_vx_file *file, const tli_vx_array *array, uint64_t first,
                           uint64_t count, const tli_vx_target *target)
{
    if (count == 0) return TL_OK;
    TL_ASSERT(array->is_open && tli_vx_has_parts(file, array));
    TL_ASSERT(count <= array->value_count && first <= array->value_count - count);
    const uint64_t width = tl_scalar_bytes(array->scalar);
    const uint8_t *data = (const uint8_t *)array->run.text + array->data_chars + first * width;
    read_job job = {.file = file, .array = array, .target = target, .count = count};
    job.first = first;
    job.bytes = data;
    tl_status st = tli_parallel(file->ctx, (size_t)count, GRAIN_VALUES, read_plain_values, &job);
    const uint64_t ofs = (uint64_t)(data - file->map->bytes);
    tli_map_forget(file->map, ofs, ofs + count * width);
    return st;
}
