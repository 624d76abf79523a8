/* PLOT3D in windows: binary grids of three axes with their solution. Each coordinate and each
 * variable of a block is one run of numbers in the file, so a range of points is one range of each.
 * Text and surfaces are read as a whole. */
#include "formats/formats_feeder.h"
#include "formats/formats_plot3d.h"
#include "formats/formats_reader.h"
#include "formats/formats_scan.h"

#include <math.h>

/* A file and where the numbers of its blocks begin. */
typedef struct part {
    tli_p3d_source source;
    tli_p3d_layout as;
    tli_p3d_header head;
    uint64_t *places; /* [block_count] */
} part;

typedef struct p3d_feeder {
    tli_feeder feeder;
    const tli_map *map;
    tli_map solution_map;
    tli_grid_block *blocks;
    part grid, solution;
} p3d_feeder;

static p3d_feeder *of(tli_feeder *feeder)
{
    return (p3d_feeder *)feeder;
}

/* The block of a point; *count is cut down to what lies in it, *first becomes its place there. */
static uint32_t block_of(const p3d_feeder *f, uint64_t *first, uint64_t *count)
{
    uint32_t low = 0, high = f->feeder.block_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (f->blocks[middle].first_point <= *first)
            low = middle;
        else
            high = middle;
    }
    *first -= f->blocks[low].first_point;
    uint64_t left = tli_p3d_block_points(&f->blocks[low]) - *first;
    if (*count > left) *count = left;
    return low;
}

/* Run number run of a block (a coordinate, a variable), points [first, first + count) of it. */
static tl_status read_run(const p3d_feeder *f, const part *p, const tli_map *map, uint32_t block,
                          uint64_t run, uint64_t first, uint64_t count, double *values,
                          uint32_t stride)
{
    const uint64_t points = tli_p3d_block_points(&f->blocks[block]);
    const uint64_t at = p->places[block] + (run * points + first) * p->as.real;
    tl_status st =
        tli_p3d_gather(f->feeder.ctx, &p->source, &p->as, at, (size_t)count, values, stride);
    tli_map_forget(map, at, at + count * p->as.real);
    return st;
}

static tl_status p3d_points(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz)
{
    const p3d_feeder *f = of(feeder);
    tl_status st = TL_OK;
    while (!st && count) {
        uint64_t at = first, n = count;
        uint32_t b = block_of(f, &at, &n);
        for (uint32_t axis = 0; !st && axis < 3; axis++)
            st = read_run(f, &f->grid, f->map, b, axis, at, n, xyz + axis, 3);
        first += n;
        count -= n;
        xyz += 3 * n;
    }
    return st;
}

static tl_status p3d_values(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                            uint64_t count, double *values)
{
    const p3d_feeder *f = of(feeder);
    const part *p = &f->solution;
    const uint32_t stride = tli_p3d_array_components(array);
    tl_status st = TL_OK;
    (void)on;
    while (!st && count) {
        uint64_t at = first, n = count;
        uint32_t b = block_of(f, &at, &n);
        for (uint64_t var = 0; !st && var < tli_p3d_variable_count(&p->as, &p->head); var++) {
            uint32_t component;
            if (tli_p3d_array_of(&p->as, var, &component) != array) continue;
            st = read_run(f, p, &f->solution_map, b, var, at, n, values + component, stride);
        }
        first += n;
        count -= n;
        values += n * stride;
    }
    return st;
}

static tl_status p3d_blanks(tli_feeder *feeder, uint64_t first, uint64_t count, uint8_t *blanks)
{
    const p3d_feeder *f = of(feeder);
    const tli_p3d_layout *as = &f->grid.as;
    while (count) {
        uint64_t at = first, n = count;
        uint32_t b = block_of(f, &at, &n);
        uint64_t from = f->grid.places[b] + 3 * tli_p3d_block_points(&f->blocks[b]) * as->real +
                        at * tli_p3d_int_size(as);
        tli_p3d_read_blanks(&f->grid.source, as, from, (size_t)n, blanks);
        tli_map_forget(f->map, from, from + n * tli_p3d_int_size(as));
        first += n;
        count -= n;
        blanks += n;
    }
    return TL_OK;
}

static tl_status p3d_estimate(tli_feeder *feeder, uint64_t *tets)
{
    *tets = 5 * feeder->cell_count;
    return TL_OK;
}

static void p3d_close(tli_feeder *feeder)
{
    p3d_feeder *f = of(feeder);
    tl_ctx *ctx = feeder->ctx;
    tli_feeder_drop_arrays(feeder);
    tl_mem_free(ctx, f->grid.places);
    tl_mem_free(ctx, f->solution.places);
    tl_mem_free(ctx, f->blocks);
    tli_map_close(ctx, &f->solution_map);
    tl_mem_free(ctx, f);
}

static tl_status open_solution(p3d_feeder *f, const char *path, bool *fits)
{
    tl_ctx *ctx = f->feeder.ctx;
    part *p = &f->solution;
    const uint32_t blocks = f->feeder.block_count;
    tl_status st = tli_map_open(ctx, path, &f->solution_map);
    if (st) return st;
    *fits = !f->solution_map.owned && !tli_p3d_is_text(&f->solution_map);
    if (!*fits) return TL_OK;
    st = tli_p3d_open(ctx, &f->solution_map, path, &p->source);
    if (!st && !tli_p3d_find_solution(&p->source, f->blocks, blocks, 3, &p->as, &p->head))
        st = tli_p3d_fail_solution(ctx, &p->source, f->blocks, blocks);
    p->places = tl_mem_alloc(ctx, blocks, sizeof *p->places, &st);
    if (!st)
        st = tli_p3d_place_solution(ctx, &p->source, &p->as, &p->head, f->blocks, p->places,
                                    &f->feeder.time);
    if (!st) tli_p3d_log_solution(ctx, &p->source, &p->as, &p->head);
    const uint64_t arrays = st ? 0 : tli_p3d_array_count(&p->as, &p->head);
    for (uint64_t a = 0; !st && a < arrays; a++) {
        char name[48];
        st = tli_feeder_add(&f->feeder, TL_ON_VERTEX, tli_p3d_array_name(&p->head, a, name),
                            tli_p3d_array_components(a), p->as.real == 4 ? TL_F32 : TL_F64);
    }
    return st;
}

/* fits: false where the file is to be read as a whole, which also says what is wrong with it. */
static tl_status open_grid(p3d_feeder *f, const char *path, bool *fits)
{
    tl_ctx *ctx = f->feeder.ctx;
    part *p = &f->grid;
    tl_status st = tli_p3d_open(ctx, f->map, path, &p->source);
    *fits = !st && tli_p3d_find_grid(&p->source, &p->as, &p->head) && p->as.axes == 3;
    if (st || !*fits) return st;
    f->feeder.point_count = p->head.points;
    f->feeder.block_count = p->head.block_count;
    st = tli_p3d_blocks(ctx, &p->source, &p->as, &p->head, &f->blocks);
    p->places = tl_mem_alloc(ctx, p->head.block_count, sizeof *p->places, &st);
    if (!st) st = tli_p3d_place_grid(ctx, &p->source, &p->as, &p->head, f->blocks, p->places);
    if (!st) tli_p3d_log_grid(ctx, &p->source, &p->as, &p->head);
    if (p->as.blank) f->feeder.blanks = p3d_blanks;
    const tli_grid all = {.blocks = f->blocks, .block_count = p->head.block_count};
    f->feeder.blocks = f->blocks;
    if (!st) f->feeder.cell_count = tli_grid_cell_count(&all);
    return st;
}

tl_status tli_feeder_open_plot3d(tl_ctx *ctx, const tli_map *map, const char *path,
                                 const tl_read_opts *opts, tli_feeder **feeder)
{
    tl_status st = TL_OK;
    bool fits = !tli_p3d_is_text(map) && !tli_is_gzip(map->bytes, map->byte_count) &&
                tli_reader_is(ctx, path, opts, "PLOT3D");
    *feeder = NULL;
    if (!fits) return TL_OK;
    p3d_feeder *f = tl_mem_zalloc(ctx, 1, sizeof *f, &st);
    if (st) return st;
    f->map = map;
    f->feeder = (tli_feeder){.ctx = ctx,
                             .time = (double)NAN,
                             .points = p3d_points,
                             .values = p3d_values,
                             .estimate = p3d_estimate,
                             .close = p3d_close};
    st = open_grid(f, path, &fits);
    if (!st && fits && opts->solution) st = open_solution(f, opts->solution, &fits);
    if (st || !fits)
        p3d_close(&f->feeder);
    else
        *feeder = &f->feeder;
    return st;
}
