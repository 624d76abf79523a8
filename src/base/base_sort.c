/* Stable radix sort, least significant digit first. A first reading finds the bits in which keys
 * differ; only digits with such bits are sorted by. Each pass counts digits in fixed chunks, turns
 * the counts into starting places (digit first, then chunk, which keeps it stable), and moves the
 * chunks independently. */
#include "base/base_sort.h"

#include <string.h>

#define DIGIT_BITS 8
#define DIGIT_COUNT (1u << DIGIT_BITS)
#define CHUNKS_A_THREAD 4                 /* so that a slow thread holds up little */
#define CHUNK_ITEMS_MIN ((size_t)1 << 14) /* below this a chunk costs more than it brings */
#define INSERTION_MAX 24                  /* counts up to this are sorted in place */

/* keys are uint64_t if wide, else uint32_t. Every function below that takes wide as an argument is
 * inlined with a constant, so that each width gets loops of its own. */
typedef struct sort_job {
    const void *keys_in;
    void *keys_out;
    const uint32_t *values_in; /* NULL: keys only */
    uint32_t *values_out;
    size_t count, chunk_items;
    unsigned shift;        /* of the digit of this pass */
    size_t *places;        /* [chunk_count][DIGIT_COUNT] counts, then starting places */
    uint64_t *differences; /* [chunk_count] bits that differ from the first key */
    bool *ascending;       /* [chunk_count] in itself and from the key before it */
} sort_job;

static inline uint64_t key_at(const void *keys, bool wide, size_t i)
{
    return wide ? ((const uint64_t *)keys)[i] : ((const uint32_t *)keys)[i];
}

static inline void key_set(void *keys, bool wide, size_t i, uint64_t key)
{
    if (wide)
        ((uint64_t *)keys)[i] = key;
    else
        ((uint32_t *)keys)[i] = (uint32_t)key;
}

/* ---- the three steps over a chunk ---- */

static inline void survey(const sort_job *job, bool wide, size_t begin, size_t end)
{
    uint64_t first = key_at(job->keys_in, wide, 0), differences = 0;
    uint64_t before = key_at(job->keys_in, wide, begin ? begin - 1 : 0);
    bool ascending = true;
    for (size_t i = begin; i < end; i++) {
        uint64_t key = key_at(job->keys_in, wide, i);
        differences |= key ^ first;
        ascending &= before <= key;
        before = key;
    }
    job->differences[begin / job->chunk_items] = differences;
    job->ascending[begin / job->chunk_items] = ascending;
}

static inline void count_digits(const sort_job *job, bool wide, size_t begin, size_t end)
{
    size_t *counts = job->places + begin / job->chunk_items * DIGIT_COUNT;
    memset(counts, 0, DIGIT_COUNT * sizeof *counts);
    for (size_t i = begin; i < end; i++)
        counts[key_at(job->keys_in, wide, i) >> job->shift & (DIGIT_COUNT - 1)]++;
}

static inline void move_items(const sort_job *job, bool wide, size_t begin, size_t end)
{
    size_t *places = job->places + begin / job->chunk_items * DIGIT_COUNT;
    for (size_t i = begin; i < end; i++) {
        uint64_t key = key_at(job->keys_in, wide, i);
        size_t place = places[key >> job->shift & (DIGIT_COUNT - 1)]++;
        key_set(job->keys_out, wide, place, key);
        if (job->values_in) job->values_out[place] = job->values_in[i];
    }
}

#define CHUNK_FN(name, step, wide)                                                                 \
    static tl_status name(void *arg, size_t begin, size_t end, unsigned worker)                    \
    {                                                                                              \
        (void)worker;                                                                              \
        step(arg, wide, begin, end);                                                               \
        return TL_OK;                                                                              \
    }
CHUNK_FN(survey_64, survey, true)
CHUNK_FN(survey_32, survey, false)
CHUNK_FN(count_64, count_digits, true)
CHUNK_FN(count_32, count_digits, false)
CHUNK_FN(move_64, move_items, true)
CHUNK_FN(move_32, move_items, false)

/* ---- the passes ---- */

static void counts_to_places(size_t *places, size_t chunk_count)
{
    size_t next = 0;
    for (size_t digit = 0; digit < DIGIT_COUNT; digit++)
        for (size_t chunk = 0; chunk < chunk_count; chunk++) {
            size_t *place = places + chunk * DIGIT_COUNT + digit;
            size_t count = *place;
            *place = next;
            next += count;
        }
}

/* Bits in which keys differ; 0 also when the keys are in order already. */
static tl_status find_differences(tl_ctx *ctx, sort_job *job, bool wide, size_t chunk_count,
                                  uint64_t *differences)
{
    tl_status st =
        tli_parallel(ctx, job->count, job->chunk_items, wide ? survey_64 : survey_32, job);
    bool ascending = true;
    *differences = 0;
    for (size_t i = 0; !st && i < chunk_count; i++) {
        *differences |= job->differences[i];
        ascending &= job->ascending[i];
    }
    if (ascending) *differences = 0;
    return st;
}

/* Sorts by the digits that differ, from the caller's arrays to spare ones and back. */
static tl_status sort_passes(tl_ctx *ctx, sort_job *job, bool wide, size_t chunk_count, void *keys,
                             uint32_t *values, void *spare_keys, uint32_t *spare_values)
{
    uint64_t differences;
    tl_status st = find_differences(ctx, job, wide, chunk_count, &differences);
    job->keys_out = spare_keys;
    job->values_out = spare_values;
    for (job->shift = 0; !st && differences >> job->shift; job->shift += DIGIT_BITS) {
        while (!(differences >> job->shift & 1)) job->shift++;
        st = tli_parallel(ctx, job->count, job->chunk_items, wide ? count_64 : count_32, job);
        if (st) break;
        counts_to_places(job->places, chunk_count);
        st = tli_parallel(ctx, job->count, job->chunk_items, wide ? move_64 : move_32, job);
        bool home = job->keys_out == keys;
        job->keys_in = job->keys_out;
        job->values_in = job->values_out;
        job->keys_out = home ? spare_keys : keys;
        job->values_out = home ? spare_values : values;
        if (job->shift + DIGIT_BITS >= 64) break;
    }
    if (!st && job->keys_in != keys) {
        memcpy(keys, job->keys_in, job->count * (wide ? sizeof(uint64_t) : sizeof(uint32_t)));
        if (values) memcpy(values, job->values_in, job->count * sizeof *values);
    }
    return st;
}

static inline void insertion_sort(void *keys, bool wide, uint32_t *values, size_t count)
{
    for (size_t i = 1; i < count; i++) {
        uint64_t key = key_at(keys, wide, i);
        uint32_t value = values ? values[i] : 0;
        size_t j = i;
        for (; j > 0 && key_at(keys, wide, j - 1) > key; j--) {
            key_set(keys, wide, j, key_at(keys, wide, j - 1));
            if (values) values[j] = values[j - 1];
        }
        key_set(keys, wide, j, key);
        if (values) values[j] = value;
    }
}

static tl_status sort_large(tl_ctx *ctx, void *keys, bool wide, uint32_t *values, size_t count)
{
    size_t chunk_count = (size_t)tl_ctx_thread_count(ctx) * CHUNKS_A_THREAD;
    if (tl_ctx_thread_count(ctx) == 1) chunk_count = 1;
    size_t chunk_items = count / chunk_count + (count % chunk_count != 0);
    if (chunk_items < CHUNK_ITEMS_MIN) chunk_items = CHUNK_ITEMS_MIN;
    chunk_count = count / chunk_items + (count % chunk_items != 0);

    tl_status st = TL_OK;
    void *spare_keys = tl_mem_alloc(ctx, count, wide ? sizeof(uint64_t) : sizeof(uint32_t), &st);
    uint32_t *spare_values = values ? tl_mem_alloc(ctx, count, sizeof *values, &st) : NULL;
    sort_job job = {
        .keys_in = keys,
        .values_in = values,
        .count = count,
        .chunk_items = chunk_items,
        .places = tl_mem_alloc(ctx, chunk_count, DIGIT_COUNT * sizeof *job.places, &st),
        .differences = tl_mem_alloc(ctx, chunk_count, sizeof *job.differences, &st),
        .ascending = tl_mem_alloc(ctx, chunk_count, sizeof *job.ascending, &st),
    };
    if (!st) st = sort_passes(ctx, &job, wide, chunk_count, keys, values, spare_keys, spare_values);
    tl_mem_free(ctx, job.ascending);
    tl_mem_free(ctx, job.differences);
    tl_mem_free(ctx, job.places);
    tl_mem_free(ctx, spare_values);
    tl_mem_free(ctx, spare_keys);
    return st;
}

tl_status tli_sort_u64(tl_ctx *ctx, uint64_t *keys, uint32_t *values, size_t count)
{
    if (count > INSERTION_MAX) return sort_large(ctx, keys, true, values, count);
    insertion_sort(keys, true, values, count);
    return TL_OK;
}

tl_status tli_sort_u32(tl_ctx *ctx, uint32_t *keys, uint32_t *values, size_t count)
{
    if (count > INSERTION_MAX) return sort_large(ctx, keys, false, values, count);
    insertion_sort(keys, false, values, count);
    return TL_OK;
}
