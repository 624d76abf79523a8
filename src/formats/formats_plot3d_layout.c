/* Which variant of PLOT3D a file is, and where its numbers stand. Walatka, Buning, Pierce, Elson:
 * PLOT3D User's Manual, NASA TM 101067, 1990, chapter 8; the Q files of OVERFLOW also carry the
 * number of their variables.
 *
 * Nothing in such a file tells what it is. But each variant (byte order, C or Fortran records, one
 * or several blocks, float32 or float64, iblank, 2 or 3 axes, text) demands one exact size, so the
 * variant whose size is that of the file is the one. */
#include "formats/formats_number.h"
#include "formats/formats_plot3d.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define PADDING_MAX 511         /* zero bytes behind the data: files rounded up to blocks of 512 */
#define TEXT_PROBE 256          /* bytes that are looked at to tell text */
#define CHUNK 512               /* numbers on the stack */
#define GRAIN ((size_t)1 << 16) /* numbers a thread takes at a time */
#define BLOCKS_MAX (1u << 20)
#define LAYOUTS 128 /* variants of a layout, numbered by the bits of find_layout */

/* ---- numbers ---- */

unsigned tli_p3d_int_size(const tli_p3d_layout *as)
{
    return as->text ? 1 : 4;
}

/* The integer at a position, which lies inside the file. A number of a text that is no integer
 * gives -1. */
int64_t tli_p3d_read_int(const tli_p3d_source *from, const tli_p3d_layout *as, uint64_t at)
{
    double value;
    if (as->text) {
        value = from->numbers[at];
        return value == trunc(value) && fabs(value) <= INT32_MAX ? (int64_t)value : -1;
    }
    tli_widen(from->bytes + at, TL_I32, as->big_endian, 1, &value);
    return (int64_t)value;
}

void tli_p3d_read_reals(const tli_p3d_source *from, const tli_p3d_layout *as, uint64_t at,
                        size_t count, double *values)
{
    if (as->text)
        memcpy(values, from->numbers + at, count * sizeof *values);
    else
        tli_widen(from->bytes + at, as->real == 4 ? TL_F32 : TL_F64, as->big_endian, count, values);
}

void tli_p3d_read_blanks(const tli_p3d_source *from, const tli_p3d_layout *as, uint64_t at,
                         size_t count, uint8_t *blanks)
{
    for (size_t i = 0; i < count; i++)
        blanks[i] = tli_p3d_read_int(from, as, at + i * tli_p3d_int_size(as)) != 0;
}

typedef struct gather_job {
    const tli_p3d_source *from;
    const tli_p3d_layout *as;
    uint64_t at;
    double *values;
    unsigned stride;
} gather_job;

static tl_status gather_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const gather_job *job = arg;
    double numbers[CHUNK];
    (void)worker;
    for (size_t i = begin; i < end;) {
        size_t count = end - i < CHUNK ? end - i : CHUNK;
        tli_p3d_read_reals(job->from, job->as, job->at + (uint64_t)i * job->as->real, count,
                           numbers);
        for (size_t k = 0; k < count; k++, i++) job->values[i * job->stride] = numbers[k];
    }
    return TL_OK;
}

tl_status tli_p3d_gather(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                         uint64_t at, size_t count, double *values, unsigned stride)
{
    gather_job job = {from, as, at, values, stride};
    return tli_parallel(ctx, count, GRAIN, gather_piece, &job);
}

/* ---- opening ---- */

bool tli_p3d_is_text(const tli_map *map)
{
    uint64_t count = map->byte_count < TEXT_PROBE ? map->byte_count : TEXT_PROBE;
    for (uint64_t i = 0; i < count; i++) {
        uint8_t c = map->bytes[i];
        if (!(c >= ' ' && c <= '~') && !(c >= '\t' && c <= '\r')) return false;
    }
    return count > 0;
}

static uint64_t count_words(const char *at, const char *end)
{
    uint64_t count = 0;
    for (bool inside = false; at < end; at++) {
        bool space = *at == ' ' || (*at >= '\t' && *at <= '\r');
        count += inside && space;
        inside = !space;
        if (at + 1 == end) count += inside;
    }
    return count;
}

static tl_status parse_text(tl_ctx *ctx, const tli_map *map, tli_p3d_source *from)
{
    const char *begin = (const char *)map->bytes, *end = begin + map->byte_count, *at = begin;
    tl_status st = TL_OK;
    from->bytes = NULL;
    from->size = count_words(begin, end);
    from->numbers = tl_mem_alloc(ctx, (size_t)from->size, sizeof *from->numbers, &st);
    for (uint64_t i = 0; !st && i < from->size; i++) {
        const char *after = tli_number_f64(at, end, &from->numbers[i]);
        if (!after) {
            size_t line = 1;
            for (const char *p = begin; p < tli_number_skip_space(at, end); p++) line += *p == '\n';
            return tl_fail(ctx, TL_ERR_FORMAT, "'%s': line %zu: expected a number", from->path,
                           line);
        }
        at = after;
    }
    return st;
}

tl_status tli_p3d_open(tl_ctx *ctx, const tli_map *map, const char *path, tli_p3d_source *from)
{
    *from = (tli_p3d_source){.path = path, .bytes = map->bytes, .size = map->byte_count};
    return tli_p3d_is_text(map) ? parse_text(ctx, map, from) : TL_OK;
}

/* ---- telling the variant ---- */

/* Reads the dimensions as a layout has them; false when they make no sense or do not fit. */
static bool read_header(const tli_p3d_source *from, const tli_p3d_layout *as, tli_p3d_header *head)
{
    const unsigned word = tli_p3d_int_size(as);
    uint64_t at = as->mark;
    *head = (tli_p3d_header){.block_count = 1};
    if (as->multi) {
        if (from->size < at + word + 2 * as->mark) return false;
        int64_t count = tli_p3d_read_int(from, as, at);
        if (count < 1 || count > BLOCKS_MAX) return false;
        if (as->mark && tli_p3d_read_int(from, as, 0) != word) return false;
        head->block_count = (uint32_t)count;
        at += word + 2 * as->mark;
    }
    uint64_t bytes = ((uint64_t)head->block_count * as->axes + (as->overflow ? 2 : 0)) * word;
    if (from->size < at || from->size - at < bytes + as->mark) return false;
    if (as->mark && tli_p3d_read_int(from, as, at - as->mark) != (int64_t)bytes) return false;
    head->dims_at = at;
    head->data_at = at + bytes + as->mark;
    for (uint32_t b = 0; b < head->block_count; b++) {
        uint64_t points = 1;
        for (unsigned axis = 0; axis < as->axes; axis++, at += word) {
            int64_t dim = tli_p3d_read_int(from, as, at);
            if (dim < 1 || (uint64_t)dim > from->size / points) return false;
            points *= (uint64_t)dim;
        }
        if ((head->points += points) > from->size) return false;
    }
    if (as->overflow) {
        head->vars = tli_p3d_read_int(from, as, at);
        head->gas_vars = tli_p3d_read_int(from, as, at + word);
        if (head->vars < 5 || head->vars > INT16_MAX || head->gas_vars < 0 ||
            head->gas_vars > head->vars)
            return false;
    }
    return true;
}

/* Numbers before the variables of a block of a solution. */
static uint64_t params_size(const tli_p3d_layout *as, const tli_p3d_header *head)
{
    if (!as->overflow) return 4 * (uint64_t)as->real;
    int64_t constants = head->gas_vars > 2 ? head->gas_vars : 2;
    return (13 + (uint64_t)constants) * as->real + tli_p3d_int_size(as);
}

uint64_t tli_p3d_variable_count(const tli_p3d_layout *as, const tli_p3d_header *head)
{
    return as->overflow ? (uint64_t)head->vars : as->axes + 2;
}

static uint64_t grid_size(const tli_p3d_layout *as, const tli_p3d_header *head)
{
    uint64_t point = (uint64_t)as->axes * as->real + (as->blank ? tli_p3d_int_size(as) : 0);
    return head->data_at + (uint64_t)head->block_count * 2 * as->mark + head->points * point;
}

static uint64_t solution_size(const tli_p3d_layout *as, const tli_p3d_header *head)
{
    uint64_t block = 4 * (uint64_t)as->mark + params_size(as, head);
    return head->data_at + head->block_count * block +
           head->points * tli_p3d_variable_count(as, head) * as->real;
}

/* True if the file has that size, or padded: that size and fewer than 512 zero bytes. */
static bool has_size(const tli_p3d_source *from, uint64_t expected, bool padded)
{
    if (from->size == expected) return true;
    if (!padded || !from->bytes || from->size < expected || from->size - expected > PADDING_MAX)
        return false;
    for (uint64_t i = expected; i < from->size; i++)
        if (from->bytes[i]) return false;
    return true;
}

typedef bool (*fits_fn)(const tli_p3d_source *from, const tli_p3d_layout *as,
                        const tli_p3d_header *head, bool padded, const void *arg);

/* Finds the first layout of a grid or of a solution that fits. Three axes go before two, and what
 * fits exactly before what is padded. */
static bool find_layout(const tli_p3d_source *from, bool solution, fits_fn fits, const void *arg,
                        tli_p3d_layout *as, tli_p3d_header *head)
{
    for (unsigned variant = 0; variant < LAYOUTS; variant++) {
        *as = (tli_p3d_layout){.text = !from->bytes,
                               .big_endian = variant & 1,
                               .multi = variant >> 1 & 1,
                               .mark = variant & 4 ? 4 : 0,
                               .real = variant & 8 ? 8 : 4,
                               .blank = variant >> 4 & 1,
                               .overflow = variant >> 4 & 1,
                               .axes = variant & 32 ? 2 : 3};
        bool padded = variant & 64;
        if (solution) as->blank = false;
        if (!solution) as->overflow = false;
        if (as->text) {
            if (as->big_endian || as->mark || as->real == 8) continue;
            as->real = 1;
        }
        if (read_header(from, as, head) && fits(from, as, head, padded, arg)) return true;
    }
    return false;
}

static bool fits_grid(const tli_p3d_source *from, const tli_p3d_layout *as,
                      const tli_p3d_header *head, bool padded, const void *arg)
{
    (void)arg;
    return has_size(from, grid_size(as, head), padded);
}

/* A solution must have the blocks of its grid. */
typedef struct grid_blocks {
    const tli_grid_block *blocks;
    uint32_t block_count;
    unsigned axes;
} grid_blocks;

static bool fits_solution(const tli_p3d_source *from, const tli_p3d_layout *as,
                          const tli_p3d_header *head, bool padded, const void *arg)
{
    const grid_blocks *grid = arg;
    if (as->axes != grid->axes || head->block_count != grid->block_count) return false;
    if (!has_size(from, solution_size(as, head), padded)) return false;
    uint64_t at = head->dims_at;
    for (uint32_t b = 0; b < head->block_count; b++)
        for (unsigned axis = 0; axis < as->axes; axis++, at += tli_p3d_int_size(as))
            if (tli_p3d_read_int(from, as, at) != (int64_t)grid->blocks[b].dims[axis]) return false;
    return true;
}

bool tli_p3d_find_grid(const tli_p3d_source *from, tli_p3d_layout *as, tli_p3d_header *head)
{
    return find_layout(from, false, fits_grid, NULL, as, head);
}

bool tli_p3d_find_solution(const tli_p3d_source *from, const tli_grid_block *blocks,
                           uint32_t block_count, unsigned axes, tli_p3d_layout *as,
                           tli_p3d_header *head)
{
    const grid_blocks grid = {blocks, block_count, axes};
    return find_layout(from, true, fits_solution, &grid, as, head);
}

/* Moves over the length of a Fortran record, which must be the one expected. */
static tl_status take_mark(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                           uint64_t expected, uint64_t *at)
{
    if (!as->mark) return TL_OK;
    int64_t length = tli_p3d_read_int(from, as, *at);
    if (length != (int64_t)expected)
        return tl_fail(ctx, TL_ERR_FORMAT,
                       "'%s': byte %" PRIu64 ": record of %" PRId64 " bytes, expected %" PRIu64,
                       from->path, *at, length, expected);
    *at += as->mark;
    return TL_OK;
}

tl_status tli_p3d_place_grid(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                             const tli_p3d_header *head, const tli_grid_block *blocks,
                             uint64_t *places)
{
    tl_status st = TL_OK;
    uint64_t at = head->data_at;
    for (uint32_t b = 0; !st && b < head->block_count; b++) {
        uint64_t point = as->axes * as->real + (as->blank ? tli_p3d_int_size(as) : 0);
        uint64_t record = tli_p3d_block_points(&blocks[b]) * point;
        st = take_mark(ctx, from, as, record, &at);
        places[b] = at;
        at += record;
        if (!st) st = take_mark(ctx, from, as, record, &at);
    }
    return st;
}

tl_status tli_p3d_place_solution(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                                 const tli_p3d_header *head, const tli_grid_block *blocks,
                                 uint64_t *places, double *time)
{
    const uint64_t params = params_size(as, head);
    uint64_t at = head->data_at;
    tl_status st = TL_OK;
    for (uint32_t b = 0; !st && b < head->block_count; b++) {
        uint64_t record =
            tli_p3d_block_points(&blocks[b]) * tli_p3d_variable_count(as, head) * as->real;
        double flow[4]; /* Mach number, angle of attack, Reynolds number, time */
        st = take_mark(ctx, from, as, params, &at);
        if (st) return st;
        tli_p3d_read_reals(from, as, at, 4, flow);
        if (b == 0 && isfinite(flow[3])) *time = flow[3];
        at += params;
        st = take_mark(ctx, from, as, params, &at);
        if (!st) st = take_mark(ctx, from, as, record, &at);
        places[b] = at;
        at += record;
        if (!st) st = take_mark(ctx, from, as, record, &at);
    }
    return st;
}

const char *tli_p3d_array_name(const tli_p3d_header *head, uint64_t array, char name[48])
{
    static const char *const names[] = {"Density", "Momentum", "StagnationEnergy", "Gamma"};
    const uint64_t species = array - 3; /* numbered from 1 where array is past the names */
    if (array < sizeof names / sizeof *names)
        snprintf(name, 48, "%s", names[array]);
    else if (species <= (uint64_t)head->gas_vars)
        snprintf(name, 48, "Species Density #%" PRIu64, species);
    else
        snprintf(name, 48, "Turb Field Quantity #%" PRIu64, species - (uint64_t)head->gas_vars);
    return name;
}

static void log_layout(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                       const char *what, uint64_t expected)
{
    tl_log(ctx, TL_LOG_INFO, "'%s': PLOT3D %s, %s%s%s%s", from->path, what,
           as->text   ? "text"
           : as->mark ? "Fortran records"
                      : "C binary",
           as->text         ? ""
           : as->big_endian ? ", big-endian"
                            : ", little-endian",
           as->text        ? ""
           : as->real == 4 ? ", float32"
                           : ", float64",
           as->blank ? ", iblank" : "");
    if (from->size != expected)
        tl_log(ctx, TL_LOG_INFO, "'%s': %" PRIu64 " zero bytes of padding at the end", from->path,
               from->size - expected);
}

void tli_p3d_log_grid(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                      const tli_p3d_header *head)
{
    log_layout(ctx, from, as, "grid", grid_size(as, head));
    if (as->axes == 2)
        tl_log(ctx, TL_LOG_INFO, "'%s': has two axes, so all its cells are surface cells",
               from->path);
}

void tli_p3d_log_solution(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                          const tli_p3d_header *head)
{
    log_layout(ctx, from, as, "solution", solution_size(as, head));
}

tl_status tli_p3d_fail_grid(tl_ctx *ctx, const tli_p3d_source *from)
{
    return tl_fail(ctx, TL_ERR_FORMAT,
                   "'%s': %" PRIu64 " %s fit no PLOT3D grid, expected the exact size that its "
                   "dimensions demand",
                   from->path, from->size, from->bytes ? "bytes" : "numbers");
}

tl_status tli_p3d_fail_solution(tl_ctx *ctx, const tli_p3d_source *from,
                                const tli_grid_block *blocks, uint32_t block_count)
{
    return tl_fail(ctx, TL_ERR_FORMAT,
                   "'%s': %" PRIu64 " %s fit no PLOT3D solution for %u blocks, the first of "
                   "%u x %u x %u points",
                   from->path, from->size, from->bytes ? "bytes" : "numbers", block_count,
                   blocks->dims[0], blocks->dims[1], blocks->dims[2]);
}

tl_status tli_p3d_blocks(tl_ctx *ctx, const tli_p3d_source *from, const tli_p3d_layout *as,
                         const tli_p3d_header *head, tli_grid_block **blocks)
{
    tl_status st = TL_OK;
    *blocks = tl_mem_alloc(ctx, head->block_count, sizeof **blocks, &st);
    uint64_t at = head->dims_at, first = 0;
    for (uint32_t b = 0; !st && b < head->block_count; b++) {
        tli_grid_block *block = &(*blocks)[b];
        *block = (tli_grid_block){.first_point = first, .dims = {1, 1, 1}};
        for (unsigned axis = 0; axis < as->axes; axis++, at += tli_p3d_int_size(as))
            block->dims[axis] = (uint32_t)tli_p3d_read_int(from, as, at);
        first += tli_p3d_block_points(block);
    }
    return st;
}
