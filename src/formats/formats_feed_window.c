/* Windows of a feed. A window is a run of cells, made to a small grid of its own: its points are
 * numbered in ascending order of the data set's, so that what depends on the order of indices (the
 * cut of cells) comes out as in the whole. Of structured blocks it is some layers of cells or,
 * where a layer is large, some rows of one. */
#include "formats/formats_feeder.h"

#include "base/base_sort.h"

#include <math.h>
#include <string.h>

/* A window has that part of the memory's bytes as its number of cells: 256 Ki of 256 MiB. */
#define MEMORY_A_CELL 1024u
#define WINDOW_CELLS_MIN 4096u
/* Part of the memory that the points of a window may take as long as they are a range. */
#define RANGE_PART 4u
/* Points read at once where only some of a range are needed. */
#define STEP_POINTS 65536u

/* ---- points of a window ---- */

typedef struct range_job {
    tl_lidx *ids;
    tl_lidx first;
} range_job;

static tl_status rebase_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const range_job *job = arg;
    (void)worker;
    for (size_t i = begin; i < end; i++) job->ids[i] -= job->first;
    return TL_OK;
}

static void id_range(const tl_lidx *ids, size_t count, tl_lidx *low, tl_lidx *high)
{
    *low = TL_NONE;
    *high = 0;
    for (size_t i = 0; i < count; i++) {
        *low = ids[i] < *low ? ids[i] : *low;
        *high = ids[i] > *high ? ids[i] : *high;
    }
}

/* xyz of a range of points, kept for the next window. */
static tl_status load_range(tli_feed *feed, uint64_t first, uint64_t count)
{
    tl_status st = TL_OK;
    if (first < feed->range_first || first + count > feed->range_first + feed->range_count) {
        if (count > feed->range_room) {
            tl_mem_free(feed->ctx, feed->range_xyz);
            feed->range_xyz = NULL;
            feed->range_count = feed->range_room = 0;
            feed->range_xyz = tl_mem_alloc(feed->ctx, (size_t)count, 3 * sizeof(double), &st);
            if (st) return st;
            feed->range_room = count;
        }
        feed->range_first = first;
        feed->range_count = 0;
        st = feed->feeder->points(feed->feeder, first, count, feed->range_xyz);
        if (!st) feed->range_count = count;
    }
    return st;
}

/* The points of a window are a range: ids become indices into it. */
static tl_status take_range(tli_feed *feed, tl_lidx low, tl_lidx high, size_t index_count)
{
    tli_grid *grid = &feed->grid;
    tl_status st = load_range(feed, low, (uint64_t)high - low + 1);
    if (st) return st;
    grid->xyz = feed->range_xyz;
    grid->point_count = feed->range_count;
    feed->run_count = 1;
    feed->runs[0].first = feed->range_first;
    feed->runs[0].count = feed->range_count;
    range_job job = {grid->connectivity, (tl_lidx)feed->range_first};
    return tli_parallel(feed->ctx, index_count, TLI_TETS_GRAIN, rebase_piece, &job);
}

/* Every id once, ascending, in feed->ids; the window's indices become places among them. */
static tl_status number_ids(tli_feed *feed, size_t index_count)
{
    tl_ctx *ctx = feed->ctx;
    tl_status st = TL_OK;
    tl_lidx *connectivity = feed->grid.connectivity;
    tl_lidx *keys = tl_mem_alloc(ctx, index_count, sizeof *keys, &st);
    uint32_t *places = tl_mem_alloc(ctx, index_count, sizeof *places, &st);
    if (!st) {
        memcpy(keys, connectivity, index_count * sizeof *keys);
        for (size_t i = 0; i < index_count; i++) places[i] = (uint32_t)i;
        st = tli_sort_u32(ctx, keys, places, index_count);
    }
    if (!st) {
        size_t count = 0;
        for (size_t i = 0; i < index_count; i++) {
            if (!i || keys[i] != keys[count - 1]) keys[count++] = keys[i];
            connectivity[places[i]] = (tl_lidx)(count - 1);
        }
        keys = tl_mem_resize(ctx, keys, count, sizeof *keys, &st);
        feed->grid.point_count = count;
        feed->ids = keys;
        keys = NULL;
    }
    tl_mem_free(ctx, places);
    tl_mem_free(ctx, keys);
    return st;
}

/* Tuples of the points of feed->ids: array TL_NONE for xyz. */
static tl_status gather(tli_feed *feed, uint32_t array, uint32_t components, double *values)
{
    tli_feeder *feeder = feed->feeder;
    tl_status st = TL_OK;
    size_t count = (size_t)feed->grid.point_count, tuple = components * sizeof *values;
    double *part = tl_mem_alloc(feed->ctx, STEP_POINTS, tuple, &st);
    for (size_t i = 0; !st && i < count;) {
        uint64_t first = feed->ids[i], room = feeder->point_count - first;
        if (room > STEP_POINTS) room = STEP_POINTS;
        size_t last = i;
        while (last < count && feed->ids[last] < first + room) last++;
        uint64_t needed = feed->ids[last - 1] - first + 1;
        st = array == TL_NONE ? feeder->points(feeder, first, needed, part)
                              : feeder->values(feeder, TL_ON_VERTEX, array, first, needed, part);
        for (; !st && i < last; i++)
            memcpy(values + i * components, part + (feed->ids[i] - first) * components, tuple);
    }
    tl_mem_free(feed->ctx, part);
    return st;
}

/* The same of the points of the runs. */
static tl_status read_runs(tli_feed *feed, uint32_t array, uint32_t components, double *values)
{
    tli_feeder *feeder = feed->feeder;
    tl_status st = TL_OK;
    for (uint32_t r = 0; !st && r < feed->run_count; r++) {
        const uint64_t first = feed->runs[r].first, count = feed->runs[r].count;
        st = array == TL_NONE ? feeder->points(feeder, first, count, values)
                              : feeder->values(feeder, TL_ON_VERTEX, array, first, count, values);
        values += count * components;
    }
    return st;
}

/* What marks points as missing, for the points of a window. */
static tl_status read_point_arrays(tli_feed *feed)
{
    tli_feeder *feeder = feed->feeder;
    tli_grid *grid = &feed->grid;
    tl_status st = TL_OK;
    for (uint32_t a = 0; !st && a < feeder->array_counts[TL_ON_VERTEX]; a++) {
        const tli_feeder_array *array = &feeder->arrays[TL_ON_VERTEX][a];
        tli_grid_array *added;
        st = tli_grid_add(grid, TL_ON_VERTEX, array->name, array->components, array->scalar, NULL,
                          &added);
        if (st) break;
        st = feed->run_count ? read_runs(feed, a, array->components, added->values)
                             : gather(feed, a, array->components, added->values);
    }
    if (!feeder->blanks) return st;
    uint8_t *blanks = grid->blanks = tl_mem_alloc(feed->ctx, (size_t)grid->point_count, 1, &st);
    for (uint32_t r = 0; !st && r < feed->run_count; blanks += feed->runs[r++].count)
        st = feeder->blanks(feeder, feed->runs[r].first, feed->runs[r].count, blanks);
    return st;
}

static tl_status localise(tli_feed *feed)
{
    tli_grid *grid = &feed->grid;
    tl_status st = TL_OK;
    size_t index_count =
        grid->offsets ? (size_t)grid->offsets[grid->cell_count] : 4 * (size_t)grid->cell_count;
    uint64_t room = feed->memory_bytes / RANGE_PART / (3 * sizeof(double));
    tl_lidx low = 0, high = 0;
    if (index_count) id_range(grid->connectivity, index_count, &low, &high);
    bool is_kept = low >= feed->range_first && high < feed->range_first + feed->range_count;
    if (!index_count) {
        grid->point_count = 0;
    } else if (is_kept || (uint64_t)high - low < room) {
        st = take_range(feed, low, high, index_count);
    } else {
        st = number_ids(feed, index_count);
        if (!st)
            grid->xyz = tl_mem_alloc(feed->ctx, (size_t)grid->point_count, 3 * sizeof(double), &st);
        if (!st) st = gather(feed, TL_NONE, 3, grid->xyz);
    }
    if (!st && feed->marks_points && grid->point_count) st = read_point_arrays(feed);
    return st;
}

/* ---- windows ---- */

/* Where a part of a structured block lies: from row j of layer k on. */
typedef struct part {
    const tli_grid_block *block;
    uint64_t cells[3], j, k;
    uint64_t rows, layers; /* of cells; several layers only of all rows */
} part;

/* The block of a cell that begins a row; as much of it as room cells and the memory allow. */
static part find_part(const tli_feed *feed, uint64_t cell, uint64_t room)
{
    part p = {.block = feed->feeder->blocks};
    const uint64_t points = feed->memory_bytes / RANGE_PART / (3 * sizeof(double));
    for (;; p.block++) {
        uint64_t all = 1;
        for (int axis = 0; axis < 3; axis++) {
            uint32_t dim = p.block->dims[axis];
            p.cells[axis] = dim > 1 ? dim - 1 : dim;
            all *= p.cells[axis];
        }
        if (cell < all) break;
        cell -= all;
    }
    const uint64_t row = p.block->dims[0], plane = row * p.block->dims[1];
    const uint64_t layer = p.cells[0] * p.cells[1];
    p.j = cell / p.cells[0] % p.cells[1];
    p.k = cell / layer;
    uint64_t layers = room / layer, rows = room / p.cells[0];
    if (plane * (layers + 1) > points) layers = points / plane ? points / plane - 1 : 0;
    if (p.j == 0 && layers) {
        p.layers = layers < p.cells[2] - p.k ? layers : p.cells[2] - p.k;
        p.rows = p.cells[1];
        return p;
    }
    if (2 * row * (rows + 1) > points) rows = points / (2 * row) ? points / (2 * row) - 1 : 0;
    if (rows < 1) rows = 1;
    p.layers = 1;
    p.rows = rows < p.cells[1] - p.j ? rows : p.cells[1] - p.j;
    return p;
}

/* The points of a part as runs, and as ids where they are two of them. */
static tl_status list_points(tli_feed *feed, const part *p, const uint32_t dims[3])
{
    tl_status st = TL_OK;
    const uint64_t row = p->block->dims[0], plane = row * p->block->dims[1];
    const uint64_t first = p->block->first_point + p->k * plane + p->j * row;
    const uint64_t in_plane = (uint64_t)dims[0] * dims[1];
    bool is_one = in_plane == plane || dims[2] == 1;
    feed->run_count = is_one ? 1 : 2;
    feed->runs[0].first = first;
    feed->runs[0].count = is_one ? in_plane * dims[2] : in_plane;
    feed->runs[1].first = first + plane;
    feed->runs[1].count = in_plane;
    feed->grid.point_count = in_plane * dims[2];
    if (is_one) return TL_OK;
    feed->ids = tl_mem_alloc(feed->ctx, (size_t)feed->grid.point_count, sizeof *feed->ids, &st);
    for (uint64_t i = 0; !st && i < feed->grid.point_count; i++)
        feed->ids[i] = (tl_lidx)(i < in_plane ? first + i : first + plane + (i - in_plane));
    return st;
}

/* Part of a structured block as a grid of its own. *count: of its cells. */
static tl_status read_part(tli_feed *feed, uint64_t cell, uint64_t room, uint64_t *count)
{
    tli_grid *grid = &feed->grid;
    tl_status st = TL_OK;
    const part p = find_part(feed, cell, room);
    grid->blocks = tl_mem_zalloc(feed->ctx, 1, sizeof *grid->blocks, &st);
    if (st) return st;
    uint32_t *dims = grid->blocks->dims;
    dims[0] = p.block->dims[0];
    dims[1] = p.block->dims[1] > 1 ? (uint32_t)p.rows + 1 : 1;
    dims[2] = p.block->dims[2] > 1 ? (uint32_t)p.layers + 1 : 1;
    grid->block_count = 1;
    grid->odd_blocks = (uint32_t)((p.j + p.k) & 1);
    *count = p.cells[0] * p.rows * p.layers;
    st = list_points(feed, &p, dims);
    grid->xyz = tl_mem_alloc(feed->ctx, (size_t)grid->point_count, 3 * sizeof *grid->xyz, &st);
    if (!st) st = read_runs(feed, TL_NONE, 3, grid->xyz);
    if (!st && feed->marks_points) st = read_point_arrays(feed);
    return st;
}

/* Cells from first on, at most *room of them; *room becomes their number. */
static tl_status read_cells(tli_feed *feed, uint64_t first, uint64_t *room)
{
    tli_feeder *feeder = feed->feeder;
    tli_grid *grid = &feed->grid;
    tl_status st;
    feed->run_count = 0;
    if (feeder->blocks) {
        st = read_part(feed, first, *room, room);
    } else {
        grid->cell_count = *room;
        st = feeder->cells(feeder, first, *room, grid);
        if (!st) st = localise(feed);
    }
    const uint64_t count = *room;
    for (uint32_t a = 0; !st && a < feeder->array_counts[TL_ON_TET]; a++)
        st = tli_feed_read_array(feed, TL_ON_TET, a, first, count);
    return st;
}

/* The tets of a mesh: no cell is split, turned or left out. */
static tl_status take_final(tli_feed *feed, uint64_t first)
{
    tli_tets *t = &feed->tets;
    tl_status st = TL_OK;
    t->tets = feed->grid.connectivity;
    feed->grid.connectivity = NULL;
    t->tet_count = (size_t)feed->grid.cell_count;
    t->one_to_one = true;
    if (feed->feeder->regions) {
        t->regions = tl_mem_alloc(feed->ctx, t->tet_count, sizeof *t->regions, &st);
        if (!st) st = feed->feeder->regions(feed->feeder, first, t->tet_count, t->regions);
    }
    return st;
}

/* After mark_missing dropped ghosts, the array of the regions may stand elsewhere. */
static int region_in_window(const tli_feed *feed)
{
    if (feed->region_index < 0) return -1;
    const char *name = feed->feeder->arrays[TL_ON_TET][feed->region_index].name;
    for (uint32_t i = 0; i < feed->grid.cell_array_count; i++)
        if (strcmp(feed->grid.cell_arrays[i].name, name) == 0) return (int)i;
    return -1;
}

static tl_status split_window(tli_feed *feed)
{
    tli_tets *t = &feed->tets;
    tl_status st = tli_tets_split(t);
    if (!st && t->cell_counts)
        st = tl_fail(feed->ctx, TL_ERR_UNSUPPORTED,
                     "polyhedra and prisms can't be read in windows: convert the file first");
    int region = region_in_window(feed);
    if (!st && region >= 0) st = tli_tets_make_regions(t, region);
    if (st || feed->has_counted) return st;
    memset(&t->sum, 0, sizeof t->sum);
    tli_tets_sum(t);
    uint64_t *sum = (uint64_t *)&feed->sum;
    const uint64_t *one = (const uint64_t *)&t->sum;
    for (size_t i = 0; i < sizeof t->sum / sizeof *sum; i++) sum[i] += one[i];
    for (size_t i = 0; feed->used && i < t->grid->point_count; i++) {
        uint64_t id = feed->ids ? feed->ids[i] : feed->runs[0].first + i;
        if (t->point_marks[i] & TLI_POINT_USED) feed->used[id / 8] |= (uint8_t)(1u << id % 8);
    }
    return st;
}

static tl_status tet_values(tli_feed *feed)
{
    tli_tets *t = &feed->tets;
    tl_status st = TL_OK;
    uint32_t components = feed->components[TL_ON_TET];
    if (!components) return TL_OK;
    for (uint32_t a = 0; !st && a < t->grid->cell_array_count; a++)
        st = tli_tets_repeat(t, &t->grid->cell_arrays[a]);
    size_t tuple = components * sizeof(double);
    feed->values = tl_mem_alloc(feed->ctx, t->tet_count, tuple, &st);
    if (st) return st;
    tli_feed_interleave(t->grid->cell_arrays, t->grid->cell_array_count, t->tet_count, components,
                        feed->values);
    if (feed->has_counted) return TL_OK;
    for (size_t i = 0; i < t->tet_count * components; i++)
        feed->sum.nonfinite_values += !isfinite(feed->values[i]);
    return TL_OK;
}

void tli_feed_rewind(tli_feed *feed)
{
    tli_feed_close_window(feed);
    feed->next_cell = 0;
    feed->next_tet = 0;
}

tl_status tli_feed_next(tli_feed *feed, tli_window *window, bool *more)
{
    tli_feeder *feeder = feed->feeder;
    uint64_t step = feed->memory_bytes / MEMORY_A_CELL, first = feed->next_cell;
    tli_feed_close_window(feed);
    *window = (tli_window){.first_tet = feed->next_tet};
    *more = first < feeder->cell_count;
    if (!*more) {
        feed->has_counted = true;
        feed->tet_count = feed->next_tet;
        return TL_OK;
    }
    if (step < WINDOW_CELLS_MIN) step = WINDOW_CELLS_MIN;
    if (step > feeder->cell_count - first) step = feeder->cell_count - first;
    tl_status st = read_cells(feed, first, &step);
    if (st) return st;
    st = tli_tets_open(&feed->tets, &feed->grid, &feed->opts);
    feed->is_open = true;
    feed->tets.cell_first = first;
    if (!st) st = feeder->is_final ? take_final(feed, first) : split_window(feed);
    if (!st) st = tet_values(feed);
    if (st) return st;
    window->tet_count = feed->tets.tet_count;
    window->tets = feed->tets.tets;
    window->regions = feed->tets.regions;
    window->values = feed->values;
    window->point_count = (size_t)feed->grid.point_count;
    window->first_point = feed->run_count ? feed->runs[0].first : 0;
    window->ids = feed->ids;
    window->xyz = feed->grid.xyz;
    feed->next_cell += step;
    feed->next_tet += feed->tets.tet_count;
    return TL_OK;
}
