/* VTK XML: the sizes of one array. Opening an array reads its header and compares every count with
 * what the file can hold, so that whoever allocates afterwards knows that the numbers are there.
 *
 * Layout of binary data, each word 4 or 8 bytes, in the byte order of the file:
 *   plain   [bytes] data
 *   packed  [blocks] [bytes a block] [bytes of a smaller last block, or 0] [packed bytes] * blocks
 *           block block ...
 * In base64 the header and data of a plain array are one run of characters (a few writers end the
 * header with '='), those of a packed one two. */
#include <string.h>

#include "formats/formats_vtkxml.h"

#define CHUNK_CHARS ((size_t)1 << 17) /* of ascii text that one task works on */
/* Arrays of several time steps may share their bytes; more than this is no honest file. */
#define CLAIMS_MAX 4u

static uint64_t load_word(const uint8_t *bytes, bool wide, bool big_endian)
{
    uint64_t word = 0;
    int count = wide ? 8 : 4;
    for (int i = 0; i < count; i++)
        word |= (uint64_t)bytes[i] << 8 * (big_endian ? count - 1 - i : i);
    return word;
}

static tl_status fail_array(const tli_vx_file *file, const tli_vx_array *array, const char *what)
{
    char label[128];
    tli_vx_label(array, label, sizeof label);
    return tl_fail(file->ctx, TL_ERR_FORMAT, "array %s: %s", label, what);
}

static tl_status claim(tli_vx_file *file, const tli_vx_array *array, uint64_t bytes)
{
    uint64_t most = file->map->byte_count * CLAIMS_MAX;
    if (bytes > most - file->claimed_bytes)
        return fail_array(file, array, "with those before it, it claims the file many times over");
    file->claimed_bytes += bytes;
    return TL_OK;
}

/* ---- ascii ---- */

typedef struct count_job {
    const char *text;
    size_t bytes;
    uint64_t *counts; /* of chunk i at i + 1 */
} count_job;

static bool is_space(char c)
{
    return c == ' ' || (unsigned char)(c - '\t') <= '\r' - '\t';
}

/* Counts the words that begin in each chunk. */
static tl_status count_words(void *arg, size_t begin, size_t end, unsigned worker)
{
    const count_job *job = arg;
    (void)worker;
    for (size_t chunk = begin; chunk < end; chunk++) {
        size_t first = chunk * CHUNK_CHARS, last = first + CHUNK_CHARS;
        if (last > job->bytes) last = job->bytes;
        uint64_t count = !is_space(job->text[first]) && (!first || is_space(job->text[first - 1]));
        for (size_t i = first + 1; i < last;) {
            size_t part = last - i < 255 ? last - i : 255; /* sums of bytes do not overflow */
            uint8_t words = 0;
            for (size_t j = 0; j < part; j++)
                words = (uint8_t)(words +
                                  (is_space(job->text[i + j - 1]) & !is_space(job->text[i + j])));
            count += words;
            i += part;
        }
        job->counts[chunk + 1] = count;
    }
    return TL_OK;
}

static tl_status open_ascii(tli_vx_file *file, tli_vx_array *array)
{
    tl_status st = claim(file, array, array->run.bytes);
    if (st) return st;
    size_t chunk_count = (array->run.bytes + CHUNK_CHARS - 1) / CHUNK_CHARS;
    array->marks = tl_mem_zalloc(file->ctx, chunk_count + 1, sizeof *array->marks, &st);
    if (st) return st;
    array->mark_count = chunk_count + 1;
    array->block_bytes = CHUNK_CHARS;
    count_job job = {array->run.text, array->run.bytes, array->marks};
    st = tli_parallel(file->ctx, chunk_count, 1, count_words, &job);
    for (size_t i = 0; i < chunk_count; i++) array->marks[i + 1] += array->marks[i];
    array->value_count = array->marks[chunk_count];
    return st;
}

/* ---- binary headers ---- */

/* Reads byte_count bytes from the head of the run, which is raw or base64. *after: characters or
 * bytes that they take, without padding. */
static tl_status read_head(const tli_vx_file *file, const tli_vx_array *array, size_t byte_count,
                           uint8_t *bytes, uint64_t *after)
{
    if (array->coding == TLI_VX_RAW) {
        if (array->run.bytes < byte_count)
            return fail_array(file, array, "its header runs past the end of the file");
        memcpy(bytes, array->run.text, byte_count);
        *after = byte_count;
        return TL_OK;
    }
    const char *clean;
    char *owned;
    uint64_t chars = tli_base64_chars(byte_count);
    tl_status st = tli_base64_strip(file->ctx, array->run, chars, &clean, &owned);
    if (st)
        return tl_note(file->ctx, st, "in the header of the array at byte %llu",
                       (unsigned long long)array->ofs);
    if (!tli_base64_decode(clean, byte_count, bytes))
        st = fail_array(file, array, "its header is not base64");
    tl_mem_free(file->ctx, owned);
    /* with blanks inside, the characters are counted again in the text itself */
    size_t at = 0;
    for (uint64_t left = chars; left; at++) left -= (unsigned char)array->run.text[at] > ' ';
    *after = at;
    return st;
}

/* Skips blanks and up to two '=' behind a header in base64. */
static uint64_t skip_padding(const tli_vx_array *array, uint64_t at)
{
    while (at < array->run.bytes &&
           (array->run.text[at] == '=' || (unsigned char)array->run.text[at] <= ' '))
        at++;
    return at;
}

/* Bytes that the run can hold from a place on. */
static uint64_t bytes_left(const tli_vx_array *array, uint64_t at)
{
    uint64_t left = array->run.bytes - at;
    return array->coding == TLI_VX_RAW ? left : left / 4 * 3 + (left % 4 * 3) / 4;
}

static tl_status open_plain(tli_vx_file *file, tli_vx_array *array)
{
    uint8_t head[8];
    size_t word = file->wide_header ? 8 : 4;
    uint64_t after;
    tl_status st = read_head(file, array, word, head, &after);
    if (st) return st;
    array->byte_count = load_word(head, file->wide_header, file->big_endian);
    array->data_chars = after;
    array->skip_bytes = 0;
    if (array->coding == TLI_VX_BASE64) {
        bool has_own_run = after < array->run.bytes && array->run.text[after] == '=';
        array->data_chars = has_own_run ? skip_padding(array, after) : 0;
        array->skip_bytes = has_own_run ? 0 : (uint32_t)word;
    }
    uint64_t left = bytes_left(array, array->data_chars) - array->skip_bytes;
    if (array->byte_count > left) {
        char label[128];
        tli_vx_label(array, label, sizeof label);
        return tl_fail(file->ctx, TL_ERR_FORMAT,
                       "array %s: its header says %llu bytes, the file has %llu behind it", label,
                       (unsigned long long)array->byte_count, (unsigned long long)left);
    }
    return claim(file, array, array->byte_count);
}

/* Fills marks with the places of the blocks and checks that what they hold can come out of them. */
static tl_status mark_blocks(tli_vx_file *file, tli_vx_array *array, const uint8_t *sizes,
                             uint64_t block_count, uint64_t last_bytes)
{
    size_t word = file->wide_header ? 8 : 4;
    uint64_t left = bytes_left(array, array->data_chars), place = 0;
    char label[128];
    tli_vx_label(array, label, sizeof label);
    for (uint64_t b = 0; b < block_count; b++) {
        uint64_t packed = load_word(sizes + b * word, file->wide_header, file->big_endian);
        uint64_t unpacked = b + 1 < block_count ? array->block_bytes : last_bytes;
        array->marks[b] = place;
        if (packed > left - place)
            return tl_fail(file->ctx, TL_ERR_FORMAT,
                           "array %s: block %llu has %llu bytes, the file has %llu behind it",
                           label, (unsigned long long)b, (unsigned long long)packed,
                           (unsigned long long)(left - place));
        if (unpacked > tli_vx_unpacked_max(file->packing, packed))
            return tl_fail(file->ctx, TL_ERR_FORMAT,
                           "array %s: block %llu says that %llu bytes unpack to %llu", label,
                           (unsigned long long)b, (unsigned long long)packed,
                           (unsigned long long)unpacked);
        place += packed;
        array->byte_count += unpacked;
    }
    array->marks[block_count] = place;
    return claim(file, array, place);
}

static tl_status open_packed(tli_vx_file *file, tli_vx_array *array)
{
    uint8_t head[24];
    size_t word = file->wide_header ? 8 : 4;
    uint64_t words[3] = {0, 0, 0}, after = 0;
    tl_status st = read_head(file, array, word, head, &after);
    if (!st && load_word(head, file->wide_header, file->big_endian) == 0) return TL_OK; /* empty */
    if (!st) st = read_head(file, array, 3 * word, head, &after);
    if (st) return st;
    for (int i = 0; i < 3; i++)
        words[i] = load_word(head + (size_t)i * word, file->wide_header, file->big_endian);
    uint64_t block_count = words[0], last_bytes = words[2] ? words[2] : words[1];
    if (block_count > array->run.bytes / word)
        return fail_array(file, array, "its header names more blocks than the file can hold");
    if (last_bytes > words[1])
        return fail_array(file, array, "its last block is larger than the others");

    size_t head_bytes = (3 + (size_t)block_count) * word;
    uint8_t *sizes = tl_mem_alloc(file->ctx, head_bytes, 1, &st);
    array->marks = tl_mem_alloc(file->ctx, (size_t)block_count + 1, sizeof *array->marks, &st);
    array->mark_count = block_count + 1;
    array->block_bytes = words[1];
    if (!st) st = read_head(file, array, head_bytes, sizes, &after);
    if (!st) {
        array->data_chars = array->coding == TLI_VX_RAW ? after : skip_padding(array, after);
        st = mark_blocks(file, array, sizes + 3 * word, block_count, last_bytes);
    }
    tl_mem_free(file->ctx, sizes);
    return st;
}

tl_status tli_vx_open(tli_vx_file *file, tli_vx_array *array)
{
    if (array->is_open) return TL_OK;
    tl_status st = TL_OK;
    if (array->coding == TLI_VX_ASCII) {
        if (array->run.bytes) st = open_ascii(file, array);
    } else if (array->run.bytes) {
        st = file->packing == TLI_VX_PLAIN ? open_plain(file, array) : open_packed(file, array);
        uint64_t width = tl_scalar_bytes(array->scalar);
        array->value_count = array->byte_count / width;
        if (!st && array->byte_count % width)
            st = fail_array(file, array, "its bytes are no whole number of values");
    }
    array->is_open = !st;
    return st;
}

tl_status tli_vx_open_expecting(tli_vx_file *file, tli_vx_array *array, uint64_t count)
{
    char label[128];
    if (count == 0) return TL_OK; /* some writers leave the data of empty arrays out */
    tl_status st = tli_vx_open(file, array);
    if (st || array->value_count == count) return st;
    tli_vx_label(array, label, sizeof label);
    if (array->value_count < count)
        return tl_fail(file->ctx, TL_ERR_FORMAT, "array %s has %llu values, expected %llu", label,
                       (unsigned long long)array->value_count, (unsigned long long)count);
    tl_log(file->ctx, TL_LOG_WARNING, "array %s has %llu values, only the first %llu are read",
           label, (unsigned long long)array->value_count, (unsigned long long)count);
    return TL_OK;
}
