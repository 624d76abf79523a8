/* PLOT3D: curvilinear blocks in a grid file, their flow in a solution (Q) file of its own.
 * Walatka, Buning, Pierce, Elson: PLOT3D User's Manual, NASA TM 101067, 1990, chapter 8; the Q
 * files of OVERFLOW also carry the number of their variables.
 *
 * Nothing in such a file tells what it is. But each variant (byte order, C or Fortran records, one
 * or several blocks, float32 or float64, iblank, 2 or 3 axes, text) demands one exact size, so the
 * variant whose size is that of the file is the one. */
#include "formats/formats_grid.h"
#include "formats/formats_number.h"

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

/* A file: bytes, or the numbers of a text. Positions and sizes are counted in bytes or in numbers.
 */
typedef struct source {
    const char *path;
    const uint8_t *bytes; /* NULL for text */
    double *numbers;      /* owned; NULL for bytes */
    uint64_t size;
} source;

typedef struct layout {
    bool text, big_endian, multi;
    bool blank;
    unsigned mark; /* size of the length before and after a Fortran record; 0: no records */
    unsigned real; /* size of a real number */
    unsigned axes; /* 2 or 3 */
    bool overflow; /* solution: the number of variables stands behind the dimensions */
} layout;

typedef struct header {
    uint32_t block_count;
    uint64_t dims_at;       /* of the first dimension */
    uint64_t data_at;       /* behind the dimensions */
    uint64_t points;        /* of all blocks */
    int64_t vars, gas_vars; /* of an OVERFLOW solution */
} header;

/* ---- numbers ---- */

static unsigned int_size(const layout *as)
{
    return as->text ? 1 : 4;
}

/* The integer at a position, which lies inside the file. A number of a text that is no integer
 * gives -1. */
static int64_t read_int(const source *from, const layout *as, uint64_t at)
{
    double value;
    if (as->text) {
        value = from->numbers[at];
        return value == trunc(value) && fabs(value) <= INT32_MAX ? (int64_t)value : -1;
    }
    tli_widen(from->bytes + at, TL_I32, as->big_endian, 1, &value);
    return (int64_t)value;
}

static void read_reals(const source *from, const layout *as, uint64_t at, size_t count,
                       double *values)
{
    if (as->text)
        memcpy(values, from->numbers + at, count * sizeof *values);
    else
        tli_widen(from->bytes + at, as->real == 4 ? TL_F32 : TL_F64, as->big_endian, count, values);
}

typedef struct gather_job {
    const source *from;
    const layout *as;
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
        read_reals(job->from, job->as, job->at + (uint64_t)i * job->as->real, count, numbers);
        for (size_t k = 0; k < count; k++, i++) job->values[i * job->stride] = numbers[k];
    }
    return TL_OK;
}

/* values[i * stride] = number i from a position on. */
static tl_status gather(tl_ctx *ctx, const source *from, const layout *as, uint64_t at,
                        size_t count, double *values, unsigned stride)
{
    gather_job job = {from, as, at, values, stride};
    return tli_parallel(ctx, count, GRAIN, gather_piece, &job);
}

/* ---- opening ---- */

static bool is_text(const tli_map *map)
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

static tl_status parse_text(tl_ctx *ctx, const tli_map *map, source *from)
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

static tl_status open_source(tl_ctx *ctx, const tli_map *map, const char *path, source *from)
{
    *from = (source){.path = path, .bytes = map->bytes, .size = map->byte_count};
    return is_text(map) ? parse_text(ctx, map, from) : TL_OK;
}

/* ---- telling the variant ---- */

/* Reads the dimensions as a layout has them; false when they make no sense or do not fit. */
static bool read_header(const source *from, const layout *as, header *head)
{
    const unsigned word = int_size(as);
    uint64_t at = as->mark;
    *head = (header){.block_count = 1};
    if (as->multi) {
        if (from->size < at + word + 2 * as->mark) return false;
        int64_t count = read_int(from, as, at);
        if (count < 1 || count > BLOCKS_MAX) return false;
        if (as->mark && read_int(from, as, 0) != word) return false;
        head->block_count = (uint32_t)count;
        at += word + 2 * as->mark;
    }
    uint64_t bytes = ((uint64_t)head->block_count * as->axes + (as->overflow ? 2 : 0)) * word;
    if (from->size < at || from->size - at < bytes + as->mark) return false;
    if (as->mark && read_int(from, as, at - as->mark) != (int64_t)bytes) return false;
    head->dims_at = at;
    head->data_at = at + bytes + as->mark;
    for (uint32_t b = 0; b < head->block_count; b++) {
        uint64_t points = 1;
        for (unsigned axis = 0; axis < as->axes; axis++, at += word) {
            int64_t dim = read_int(from, as, at);
            if (dim < 1 || (uint64_t)dim > from->size / points) return false;
            points *= (uint64_t)dim;
        }
        if ((head->points += points) > from->size) return false;
    }
    if (as->overflow) {
        head->vars = read_int(from, as, at);
        head->gas_vars = read_int(from, as, at + word);
        if (head->vars < 5 || head->vars > INT16_MAX || head->gas_vars < 0 ||
            head->gas_vars > head->vars)
            return false;
    }
    return true;
}

/* Numbers before the variables of a block of a solution. */
static uint64_t params_size(const layout *as, const header *head)
{
    if (!as->overflow) return 4 * (uint64_t)as->real;
    int64_t constants = head->gas_vars > 2 ? head->gas_vars : 2;
    return (13 + (uint64_t)constants) * as->real + int_size(as);
}

static uint64_t variable_count(const layout *as, const header *head)
{
    return as->overflow ? (uint64_t)head->vars : as->axes + 2;
}

static uint64_t grid_size(const layout *as, const header *head)
{
    uint64_t point = (uint64_t)as->axes * as->real + (as->blank ? int_size(as) : 0);
    return head->data_at + (uint64_t)head->block_count * 2 * as->mark + head->points * point;
}

static uint64_t solution_size(const layout *as, const header *head)
{
    uint64_t block = 4 * (uint64_t)as->mark + params_size(as, head);
    return head->data_at + head->block_count * block +
           head->points * variable_count(as, head) * as->real;
}

/* True if the file has that size, or padded: that size and fewer than 512 zero bytes. */
static bool has_size(const source *from, uint64_t expected, bool padded)
{
    if (from->size == expected) return true;
    if (!padded || !from->bytes || from->size < expected || from->size - expected > PADDING_MAX)
        return false;
    for (uint64_t i = expected; i < from->size; i++)
        if (from->bytes[i]) return false;
    return true;
}

typedef bool (*fits_fn)(const source *from, const layout *as, const header *head, bool padded,
                        const void *arg);

/* Finds the first layout of a grid or of a solution that fits. Three axes go before two, and what
 * fits exactly before what is padded. */
static bool find_layout(const source *from, bool solution, fits_fn fits, const void *arg,
                        layout *as, header *head)
{
    for (unsigned variant = 0; variant < LAYOUTS; variant++) {
        *as = (layout){.text = !from->bytes,
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

static bool fits_grid(const source *from, const layout *as, const header *head, bool padded,
                      const void *arg)
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

static bool fits_solution(const source *from, const layout *as, const header *head, bool padded,
                          const void *arg)
{
    const grid_blocks *grid = arg;
    if (as->axes != grid->axes || head->block_count != grid->block_count) return false;
    if (!has_size(from, solution_size(as, head), padded)) return false;
    uint64_t at = head->dims_at;
    for (uint32_t b = 0; b < head->block_count; b++)
        for (unsigned axis = 0; axis < as->axes; axis++, at += int_size(as))
            if (read_int(from, as, at) != (int64_t)grid->blocks[b].dims[axis]) return false;
    return true;
}

/* Moves over the length of a Fortran record, which must be the one expected. */
static tl_status take_mark(tl_ctx *ctx, const source *from, const layout *as, uint64_t expected,
                           uint64_t *at)
{
    if (!as->mark) return TL_OK;
    int64_t length = read_int(from, as, *at);
    if (length != (int64_t)expected)
        return tl_fail(ctx, TL_ERR_FORMAT,
                       "'%s': byte %" PRIu64 ": record of %" PRId64 " bytes, expected %" PRIu64,
                       from->path, *at, length, expected);
    *at += as->mark;
    return TL_OK;
}

/* ---- the grid ---- */

static tl_status make_blocks(tl_ctx *ctx, const source *from, const layout *as, const header *head,
                             tli_grid *grid)
{
    tl_status st = TL_OK;
    if (head->points > TL_MESH_VERTS_MAX)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': %" PRIu64 " points, at most %u can be held",
                       from->path, head->points, TL_MESH_VERTS_MAX);
    grid->blocks = tl_mem_alloc(ctx, head->block_count, sizeof *grid->blocks, &st);
    if (st) return st;
    uint64_t at = head->dims_at, first = 0;
    for (uint32_t b = 0; b < head->block_count; b++) {
        tli_grid_block *block = &grid->blocks[b];
        *block = (tli_grid_block){.first_point = first, .dims = {1, 1, 1}};
        uint64_t points = 1;
        for (unsigned axis = 0; axis < as->axes; axis++, at += int_size(as)) {
            block->dims[axis] = (uint32_t)read_int(from, as, at);
            points *= block->dims[axis];
        }
        first += points;
    }
    grid->block_count = head->block_count;
    grid->point_count = first;
    grid->xyz = tl_mem_zalloc(ctx, (size_t)first, 3 * sizeof *grid->xyz, &st);
    if (as->blank) grid->blanks = tl_mem_alloc(ctx, (size_t)first, 1, &st);
    return st;
}

static size_t block_points(const tli_grid_block *block)
{
    return (size_t)block->dims[0] * block->dims[1] * block->dims[2];
}

/* iblank: 0 for holes; others are points, also those that another block overlaps (< 0). */
static void read_blanks(const source *from, const layout *as, uint64_t at, size_t count,
                        uint8_t *blanks)
{
    for (size_t i = 0; i < count; i++) blanks[i] = read_int(from, as, at + i * int_size(as)) != 0;
}

static tl_status read_points(tl_ctx *ctx, const source *from, const layout *as, uint64_t at,
                             tli_grid *grid)
{
    tl_status st = TL_OK;
    for (uint32_t b = 0; !st && b < grid->block_count; b++) {
        const tli_grid_block *block = &grid->blocks[b];
        const size_t count = block_points(block);
        uint64_t record = (uint64_t)count * (as->axes * as->real + (as->blank ? int_size(as) : 0));
        st = take_mark(ctx, from, as, record, &at);
        for (unsigned axis = 0; !st && axis < as->axes; axis++, at += (uint64_t)count * as->real)
            st = gather(ctx, from, as, at, count, grid->xyz + 3 * block->first_point + axis, 3);
        if (!st && as->blank) {
            read_blanks(from, as, at, count, grid->blanks + block->first_point);
            at += (uint64_t)count * int_size(as);
        }
        if (!st) st = take_mark(ctx, from, as, record, &at);
        if (!st) st = tl_progress(ctx, "reading", b + 1, grid->block_count);
    }
    return st;
}

/* ---- the solution ---- */

/* Adds the arrays that the variables go to; the first of three is the momentum's. */
static tl_status add_arrays(const layout *as, const header *head, tli_grid *grid)
{
    static const char *const names[] = {"Density", "Momentum", "StagnationEnergy", "Gamma"};
    const tl_scalar scalar = as->real == 4 ? TL_F32 : TL_F64;
    const uint64_t count = variable_count(as, head) - as->axes + 1;
    tl_status st = TL_OK;
    for (uint64_t i = 0; !st && i < count; i++) {
        char name[48];
        uint64_t species = i - 3; /* numbered from 1 where i is past the names */
        if (i < sizeof names / sizeof *names)
            snprintf(name, sizeof name, "%s", names[i]);
        else if (species <= (uint64_t)head->gas_vars)
            snprintf(name, sizeof name, "Species Density #%" PRIu64, species);
        else
            snprintf(name, sizeof name, "Turb Field Quantity #%" PRIu64,
                     species - (uint64_t)head->gas_vars);
        tli_grid_array *array = NULL;
        st = tli_grid_add(grid, TL_ON_VERTEX, name, i == 1 ? 3 : 1, scalar, NULL, &array);
        if (!st && i == 1) memset(array->values, 0, (size_t)array->count * 3 * sizeof(double));
    }
    return st;
}

/* Variable number var of a block: which array, which of its components. */
static double *variable_place(const layout *as, const tli_grid *grid, uint32_t first_array,
                              uint64_t var, uint64_t first_point, unsigned *stride)
{
    bool momentum = var >= 1 && var <= as->axes;
    uint64_t index = momentum ? 1 : var == 0 ? 0 : var - as->axes + 1;
    double *values = grid->point_arrays[first_array + index].values;
    *stride = momentum ? 3 : 1;
    return values + first_point * *stride + (momentum ? var - 1 : 0);
}

static tl_status read_variables(tl_ctx *ctx, const source *from, const layout *as,
                                const header *head, tli_grid *grid, uint32_t first_array)
{
    const uint64_t vars = variable_count(as, head), params = params_size(as, head);
    uint64_t at = head->data_at;
    tl_status st = TL_OK;
    for (uint32_t b = 0; !st && b < grid->block_count; b++) {
        const tli_grid_block *block = &grid->blocks[b];
        const size_t count = block_points(block);
        double flow[4]; /* Mach number, angle of attack, Reynolds number, time */
        st = take_mark(ctx, from, as, params, &at);
        if (st) return st;
        read_reals(from, as, at, 4, flow);
        if (b == 0 && isfinite(flow[3])) grid->time = flow[3];
        at += params;
        st = take_mark(ctx, from, as, params, &at);
        if (!st) st = take_mark(ctx, from, as, vars * count * as->real, &at);
        for (uint64_t var = 0; !st && var < vars; var++, at += (uint64_t)count * as->real) {
            unsigned stride;
            double *values =
                variable_place(as, grid, first_array, var, block->first_point, &stride);
            st = gather(ctx, from, as, at, count, values, stride);
        }
        if (!st) st = take_mark(ctx, from, as, vars * count * as->real, &at);
        if (!st) st = tl_progress(ctx, "reading", b + 1, grid->block_count);
    }
    return st;
}

static void log_layout(tl_ctx *ctx, const source *from, const layout *as, const char *what,
                       uint64_t expected)
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

static tl_status read_solution(tl_ctx *ctx, const char *path, unsigned axes, tli_grid *grid)
{
    tli_map map;
    source from = {.path = path};
    layout as = {0};
    header head = {0};
    tl_status st = tli_map_open(ctx, path, &map);
    if (st) return st;
    st = open_source(ctx, &map, path, &from);
    const grid_blocks blocks = {grid->blocks, grid->block_count, axes};
    if (!st && !find_layout(&from, true, fits_solution, &blocks, &as, &head))
        st = tl_fail(ctx, TL_ERR_FORMAT,
                     "'%s': %" PRIu64 " %s fit no PLOT3D solution for %u blocks, the first of "
                     "%u x %u x %u points",
                     path, from.size, from.bytes ? "bytes" : "numbers", grid->block_count,
                     grid->blocks->dims[0], grid->blocks->dims[1], grid->blocks->dims[2]);
    if (!st) log_layout(ctx, &from, &as, "solution", solution_size(&as, &head));
    const uint32_t first_array = grid->point_array_count;
    if (!st) st = add_arrays(&as, &head, grid);
    if (!st) st = read_variables(ctx, &from, &as, &head, grid, first_array);
    tl_mem_free(ctx, from.numbers);
    tli_map_close(ctx, &map);
    return st;
}

tl_status tli_read_plot3d(tl_ctx *ctx, const tli_map *map, const char *path,
                          const tl_read_opts *opts, tli_grid *grid)
{
    source from;
    layout as = {0};
    header head = {0};
    tl_status st = open_source(ctx, map, path, &from);
    if (!st && !find_layout(&from, false, fits_grid, NULL, &as, &head))
        st = tl_fail(ctx, TL_ERR_FORMAT,
                     "'%s': %" PRIu64 " %s fit no PLOT3D grid, expected the exact size that its "
                     "dimensions demand",
                     path, from.size, from.bytes ? "bytes" : "numbers");
    if (!st) log_layout(ctx, &from, &as, "grid", grid_size(&as, &head));
    if (!st && as.axes == 2)
        tl_log(ctx, TL_LOG_INFO, "'%s': has two axes, so all its cells are surface cells", path);
    if (!st) st = make_blocks(ctx, &from, &as, &head, grid);
    if (!st) st = read_points(ctx, &from, &as, head.data_at, grid);
    tl_mem_free(ctx, from.numbers);
    if (!st && opts->solution) st = read_solution(ctx, opts->solution, as.axes, grid);
    return st;
}
