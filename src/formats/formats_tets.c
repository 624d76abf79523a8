/* A grid as its file has it becomes a mesh of tets: structured blocks by parity (five tets a cell)
 * or around a diagonal (six), other cells by the smallest-index rule of formats_split.c. Two passes
 * over the cells, in pieces whose results do not depend on the threads: one counts tets and marks
 * points, one writes them. A file of tets alone is converted in place.
 *
 * A cell is turned as a whole, by the sign of its volume: turning single tets of a folded cell
 * would hide the fold. So a lone negative tet becomes positive, and a hexahedron that is folded
 * keeps the tets that are inverted, counted. */
#include "formats/formats_tets.h"
#include "base/base_predicates.h"

#include <stdatomic.h>
#include <string.h>

/* ---- walking over cells ---- */

/* The corners of one cell after the other, from any cell on. */
typedef struct cell_walk {
    const tli_tets *t;
    uint64_t cell;
    /* structured blocks only */
    uint32_t block;
    uint32_t at[3], cells[3];
    uint64_t step_y, step_z;
} cell_walk;

static void enter_block(cell_walk *walk, uint32_t block)
{
    const tli_grid_block *b = &walk->t->grid->blocks[block];
    walk->block = block;
    for (int axis = 0; axis < 3; axis++)
        walk->cells[axis] = b->dims[axis] > 1 ? b->dims[axis] - 1 : b->dims[axis];
    walk->step_y = b->dims[0];
    walk->step_z = (uint64_t)b->dims[0] * b->dims[1];
}

static void walk_begin(cell_walk *walk, const tli_tets *t, uint64_t cell)
{
    *walk = (cell_walk){.t = t, .cell = cell};
    if (!t->grid->block_count) return;
    uint32_t low = 0, high = t->grid->block_count;
    while (high - low > 1) { /* the last block that starts at or before cell */
        uint32_t middle = low + (high - low) / 2;
        if (t->block_first[middle] <= cell)
            low = middle;
        else
            high = middle;
    }
    while (t->block_first[low + 1] <= cell) low++; /* past blocks without cells */
    enter_block(walk, low);
    uint64_t rest = cell - t->block_first[low];
    walk->at[0] = (uint32_t)(rest % walk->cells[0]);
    walk->at[1] = (uint32_t)(rest / walk->cells[0] % walk->cells[1]);
    walk->at[2] = (uint32_t)(rest / walk->cells[0] / walk->cells[1]);
}

static void walk_next(cell_walk *walk)
{
    walk->cell++;
    if (!walk->t->grid->block_count) return;
    if (++walk->at[0] < walk->cells[0]) return;
    walk->at[0] = 0;
    if (++walk->at[1] < walk->cells[1]) return;
    walk->at[1] = 0;
    if (++walk->at[2] < walk->cells[2]) return;
    walk->at[2] = 0;
    uint32_t next = walk->block + 1;
    while (next < walk->t->grid->block_count && walk->t->block_first[next + 1] <= walk->cell)
        next++;
    if (next < walk->t->grid->block_count) enter_block(walk, next);
}

/* Kind and shape of a cell of a structured block, by how many of its dimensions are 1. */
static tli_cell_type structured_type(const tli_grid_block *block)
{
    static const tl_cell_kind kinds[4] = {TL_CELL_POINT, TL_CELL_LINE, TL_CELL_SURFACE,
                                          TL_CELL_HEXAHEDRON};
    int wide = (block->dims[0] > 1) + (block->dims[1] > 1) + (block->dims[2] > 1);
    return (tli_cell_type){kinds[wide], wide == 3 ? TLI_SHAPE_HEXAHEDRON : TLI_SHAPE_NONE, 0};
}

static tli_cell_type cell_type(const cell_walk *walk)
{
    const tli_grid *grid = walk->t->grid;
    if (grid->block_count) return structured_type(&grid->blocks[walk->block]);
    return tli_cell_type_of(grid->types ? grid->types[walk->cell] : TLI_VTK_TETRA);
}

/* Corners: of a structured cell x + 2 y + 4 z, else in VTK's order. */
static void cell_corners(const cell_walk *walk, tli_shape shape, tl_lidx corners[TLI_CORNERS_MAX])
{
    const tli_grid *grid = walk->t->grid;
    if (grid->block_count) {
        uint64_t base = grid->blocks[walk->block].first_point + walk->at[0] +
                        walk->at[1] * walk->step_y + walk->at[2] * walk->step_z;
        for (unsigned c = 0; c < 8; c++)
            corners[c] =
                (tl_lidx)(base + (c & 1) + (c >> 1 & 1) * walk->step_y + (c >> 2) * walk->step_z);
        return;
    }
    uint64_t offset = grid->offsets ? grid->offsets[walk->cell] : 4 * walk->cell;
    memcpy(corners, grid->connectivity + offset, tli_shape_corners(shape) * sizeof *corners);
}

/* Tets of the cell, split by its indices; the number of those left out for a repeated vertex. */
static unsigned cell_tets(const cell_walk *walk, tli_shape shape, const tl_lidx *corners,
                          tl_lidx tets[TLI_SPLIT_MAX][4], unsigned *repeated)
{
    *repeated = 0;
    if (!walk->t->grid->block_count) return tli_split_cell(shape, corners, tets, repeated);
    uint32_t odd = walk->t->grid->odd_blocks;
    unsigned parity = (walk->at[0] + walk->at[1] + walk->at[2] + odd) & 1;
    unsigned count = (unsigned)walk->t->opts.split;
    const uint8_t(*table)[4] = count == 5 ? tli_split_five[parity] : tli_split_six;
    for (unsigned i = 0; i < count; i++)
        for (unsigned v = 0; v < 4; v++) tets[i][v] = corners[table[i][v]];
    return count;
}

/* ---- first pass: count ---- */

static tl_status check_point_count(const cell_walk *walk, tli_cell_type type)
{
    const tli_grid *grid = walk->t->grid;
    if (grid->block_count || !grid->offsets) return TL_OK;
    uint64_t cell = walk->cell, points = grid->offsets[cell + 1] - grid->offsets[cell];
    unsigned expected = type.points ? type.points : tli_shape_corners(type.shape);
    if (type.points ? points == expected : points >= expected) return TL_OK;
    return tl_fail(walk->t->ctx, TL_ERR_FORMAT, "cell %llu (%s): %llu points, expected %s%u",
                   (unsigned long long)(walk->t->cell_first + cell), tl_cell_kind_name(type.kind),
                   (unsigned long long)points, type.points ? "" : "at least ", expected);
}

static void mark_used(uint8_t *marks, tl_lidx point)
{
    /* Neighbouring cells of two threads store the same byte; nobody reads the bit in this pass. */
    _Atomic uint8_t *mark = (_Atomic uint8_t *)&marks[point];
    uint8_t value = atomic_load_explicit(mark, memory_order_relaxed);
    if (!(value & TLI_POINT_USED))
        atomic_store_explicit(mark, value | TLI_POINT_USED, memory_order_relaxed);
}

static tl_status count_cell(tli_tets *t, const cell_walk *walk, tli_tally *tally)
{
    tli_cell_type type = cell_type(walk);
    uint8_t *mark = &t->cell_marks[walk->cell];
    tally->cells[type.kind]++;
    if (type.shape == TLI_SHAPE_NONE) {
        *mark = 0;
        return TL_OK;
    }
    tl_status st = check_point_count(walk, type);
    if (st) return st;
    if (*mark & TLI_CELL_GHOST) {
        tally->ghosts++;
        return TL_OK;
    }
    tl_lidx corners[TLI_CORNERS_MAX], tets[TLI_SPLIT_MAX][4];
    cell_corners(walk, type.shape, corners);
    uint8_t marks = 0;
    for (unsigned i = 0; i < tli_shape_corners(type.shape); i++)
        marks |= atomic_load_explicit((_Atomic uint8_t *)&t->point_marks[corners[i]],
                                      memory_order_relaxed);
    if (marks & TLI_POINT_HIDDEN) {
        *mark = TLI_CELL_GHOST;
        tally->ghosts++;
        return TL_OK;
    }
    if ((*mark & TLI_CELL_BLANK) || (marks & TLI_POINT_MISSING)) {
        *mark = TLI_CELL_BLANK;
        tally->blanks++;
        return TL_OK;
    }
    unsigned repeated, count = cell_tets(walk, type.shape, corners, tets, &repeated);
    *mark = (uint8_t)count;
    tally->repeated += repeated;
    for (unsigned i = 0; i < count; i++)
        for (unsigned v = 0; v < 4; v++) mark_used(t->point_marks, tets[i][v]);
    return TL_OK;
}

static tl_status count_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    tli_tets *t = arg;
    cell_walk walk;
    uint64_t sum = 0;
    walk_begin(&walk, t, begin);
    for (; walk.cell < end; walk_next(&walk)) {
        tl_status st = count_cell(t, &walk, &t->tallies[worker]);
        if (st) return st;
        sum += t->cell_marks[walk.cell] & TLI_CELL_COUNT;
    }
    t->piece_first[begin / TLI_TETS_GRAIN + 1] = sum;
    return TL_OK;
}

/* ---- second pass: write and turn ---- */

static bool tet_is_finite(const double *xyz, const tl_lidx *tet)
{
    double sum = 0;
    for (unsigned v = 0; v < 4; v++)
        for (unsigned axis = 0; axis < 3; axis++) sum += 0 * xyz[3 * (size_t)tet[v] + axis];
    return sum == 0; /* infinity and NaN times 0 are NaN */
}

/* Turns the tets of one cell and counts what stays at or below zero. */
static void orient_cell(const double *xyz, tl_lidx (*tets)[4], unsigned count, tli_tally *tally)
{
    int signs[TLI_SPLIT_MAX];
    unsigned positive = 0, negative = 0, flat = 0;
    double volume = 0;
    for (unsigned i = 0; i < count; i++) {
        if (!tet_is_finite(xyz, tets[i])) {
            tally->nonfinite_tets += count;
            return;
        }
        const double *p[4];
        for (unsigned v = 0; v < 4; v++) p[v] = xyz + 3 * (size_t)tets[i][v];
        signs[i] = tli_orient3d(p[0], p[1], p[2], p[3]);
        if (count > 1) volume += tli_orient3d_approx(p[0], p[1], p[2], p[3]);
        positive += signs[i] > 0, negative += signs[i] < 0, flat += signs[i] == 0;
    }
    tally->degenerate += flat;
    bool turn = negative && (positive == 0 || volume < 0);
    if (!turn) {
        tally->inverted += negative;
        return;
    }
    tally->turned += negative;
    tally->inverted += positive;
    for (unsigned i = 0; i < count; i++) {
        tl_lidx swap = tets[i][2];
        tets[i][2] = tets[i][3];
        tets[i][3] = swap;
    }
}

static tl_status build_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    tli_tets *t = arg;
    tl_lidx(*out)[4] = (tl_lidx(*)[4])t->tets + t->piece_first[begin / TLI_TETS_GRAIN];
    cell_walk walk;
    walk_begin(&walk, t, begin);
    for (; walk.cell < end; walk_next(&walk)) {
        if (!(t->cell_marks[walk.cell] & TLI_CELL_COUNT)) continue;
        tl_lidx corners[TLI_CORNERS_MAX], tets[TLI_SPLIT_MAX][4];
        tli_shape shape = cell_type(&walk).shape;
        cell_corners(&walk, shape, corners);
        unsigned repeated, count = cell_tets(&walk, shape, corners, tets, &repeated);
        orient_cell(t->grid->xyz, tets, count, &t->tallies[worker]);
        memcpy(out, tets, count * sizeof *tets);
        out += count;
    }
    return TL_OK;
}

/* In place: tets are where they will be already. */
static tl_status turn_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    tli_tets *t = arg;
    for (size_t i = begin; i < end; i++)
        orient_cell(t->grid->xyz, (tl_lidx(*)[4])t->tets + i, 1, &t->tallies[worker]);
    return TL_OK;
}

/* ---- steps of the driver ---- */

tl_read_opts tl_read_opts_defaults(void)
{
    return (tl_read_opts){.struct_bytes = sizeof(tl_read_opts), .raw_scalar = TL_U8, .split = 5};
}

static tl_status check_options(tl_ctx *ctx, const tl_read_opts *given, tl_read_opts *opts)
{
    *opts = tl_read_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_read_opts", given, opts, sizeof *opts);
    if (st) return st;
    if (opts->split != 5 && opts->split != 6)
        return tl_fail(ctx, TL_ERR_ARG, "a structured cell is split into 5 or 6 tets, not %d",
                       opts->split);
    return TL_OK;
}

static tl_status check_grid(tli_tets *t)
{
    tli_grid *grid = t->grid;
    t->cell_count = tli_grid_cell_count(grid);
    t->report.points = grid->point_count;
    if (grid->point_count > TL_MESH_VERTS_MAX)
        return tl_fail(t->ctx, TL_ERR_UNSUPPORTED, "%llu points; a mesh in memory holds at most %u",
                       (unsigned long long)grid->point_count, TL_MESH_VERTS_MAX);
    for (uint32_t b = 0; b < grid->block_count; b++) {
        const uint32_t *dims = grid->blocks[b].dims;
        uint64_t plane = (uint64_t)dims[0] * dims[1], first = grid->blocks[b].first_point;
        if (first > grid->point_count || (plane && dims[2] > (grid->point_count - first) / plane))
            return tl_fail(t->ctx, TL_ERR_FORMAT,
                           "block %u: %u x %u x %u points from %llu on, but there are %llu", b,
                           dims[0], dims[1], dims[2], (unsigned long long)first,
                           (unsigned long long)grid->point_count);
    }
    return TL_OK;
}

typedef struct type_scan {
    const tli_grid *grid;
    atomic_bool other;
} type_scan;

static tl_status scan_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    type_scan *scan = arg;
    const tli_grid *grid = scan->grid;
    bool same = true;
    for (size_t i = begin; i < end && same; i++)
        same = (!grid->types || grid->types[i] == TLI_VTK_TETRA) &&
               (!grid->offsets || (grid->offsets[i] == 4 * i && grid->offsets[i + 1] == 4 * i + 4));
    if (!same) atomic_store(&scan->other, true);
    return TL_OK;
}

/* A list of tets alone needs neither types nor offsets. */
static tl_status forget_plain_types(tli_tets *t)
{
    tli_grid *grid = t->grid;
    if (grid->block_count) return TL_OK;
    type_scan scan = {.grid = grid};
    tl_status st = tli_parallel(t->ctx, (size_t)t->cell_count, TLI_TETS_GRAIN, scan_piece, &scan);
    if (st || atomic_load(&scan.other)) return st;
    tl_mem_free(t->ctx, grid->types);
    tl_mem_free(t->ctx, grid->offsets);
    grid->types = NULL;
    grid->offsets = NULL;
    return TL_OK;
}

tl_status tli_tets_prepare(tli_tets *t)
{
    tl_status st = TL_OK;
    size_t pieces = (size_t)(t->cell_count / TLI_TETS_GRAIN + 2);
    uint32_t blocks = t->grid->block_count;
    t->tallies = tl_mem_zalloc(t->ctx, tl_ctx_thread_count(t->ctx), sizeof *t->tallies, &st);
    t->point_marks = tl_mem_zalloc(t->ctx, (size_t)t->grid->point_count, 1, &st);
    t->cell_marks = tl_mem_zalloc(t->ctx, (size_t)t->cell_count, 1, &st);
    t->piece_first = tl_mem_zalloc(t->ctx, pieces, sizeof *t->piece_first, &st);
    if (blocks)
        t->block_first = tl_mem_alloc(t->ctx, (size_t)blocks + 1, sizeof *t->block_first, &st);
    if (st) return st;
    for (uint32_t b = 0; b <= blocks && blocks; b++) {
        tli_grid before = {.blocks = t->grid->blocks, .block_count = b};
        t->block_first[b] = tli_grid_cell_count(&before);
    }
    return TL_OK;
}

static tl_status count_tets(tli_tets *t)
{
    tl_status st = tli_parallel(t->ctx, (size_t)t->cell_count, TLI_TETS_GRAIN, count_piece, t);
    if (st) return st;
    size_t pieces = (size_t)((t->cell_count + TLI_TETS_GRAIN - 1) / TLI_TETS_GRAIN);
    for (size_t p = 0; p < pieces; p++) t->piece_first[p + 1] += t->piece_first[p];
    uint64_t total = t->piece_first[pieces];
    if (total > TL_MESH_TETS_MAX)
        return tl_fail(t->ctx, TL_ERR_UNSUPPORTED,
                       "%llu cells become %llu tets; a mesh in memory holds at most %u",
                       (unsigned long long)t->cell_count, (unsigned long long)total,
                       TL_MESH_TETS_MAX);
    t->tet_count = (size_t)total;
    return TL_OK;
}

/* Closes the gaps of the tets that were dropped. */
static void close_gaps(tli_tets *t)
{
    tl_lidx(*tets)[4] = (tl_lidx(*)[4])t->tets;
    size_t kept = 0;
    for (size_t i = 0; i < t->cell_count; i++)
        if (t->cell_marks[i] & TLI_CELL_COUNT) memmove(tets[kept++], tets[i], sizeof *tets);
}

static tl_status build_tets(tli_tets *t)
{
    tli_grid *grid = t->grid;
    tl_status st = TL_OK;
    if (!grid->block_count && !grid->types && !grid->offsets) {
        t->one_to_one = t->tet_count == t->cell_count;
        t->tets = grid->connectivity;
        grid->connectivity = NULL;
        if (!t->one_to_one) close_gaps(t);
        t->tets = tl_mem_resize(t->ctx, t->tets, t->tet_count, 4 * sizeof *t->tets, &st);
        if (!st) st = tli_parallel(t->ctx, t->tet_count, TLI_TETS_GRAIN, turn_piece, t);
    } else {
        t->tets = tl_mem_alloc(t->ctx, t->tet_count, 4 * sizeof *t->tets, &st);
        if (!st) st = tli_parallel(t->ctx, (size_t)t->cell_count, TLI_TETS_GRAIN, build_piece, t);
    }
    tl_mem_free(t->ctx, grid->connectivity);
    tl_mem_free(t->ctx, grid->offsets);
    tl_mem_free(t->ctx, grid->types);
    grid->connectivity = NULL;
    grid->offsets = NULL;
    grid->types = NULL;
    return st;
}

/* ---- points that no tet uses ---- */

typedef struct compaction {
    tli_tets *t;
    tl_lidx *new_ids; /* [point_count] */
} compaction;

static tl_status renumber_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const compaction *c = arg;
    for (size_t i = 4 * begin; i < 4 * end; i++) c->t->tets[i] = c->new_ids[c->t->tets[i]];
    return TL_OK;
}

static void compact(const tli_tets *t, double *values, uint32_t components)
{
    size_t kept = 0, tuple = components * sizeof *values;
    for (size_t i = 0; i < t->grid->point_count; i++) {
        if (!(t->point_marks[i] & TLI_POINT_USED)) continue;
        if (kept != i) memcpy(values + kept * components, values + i * components, tuple);
        kept++;
    }
}

/* Item 0 is xyz, the others are the point arrays; each is one task. */
static tl_status compact_array(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const compaction *c = arg;
    tli_grid *grid = c->t->grid;
    for (size_t i = begin; i < end; i++) {
        tl_status st = TL_OK;
        double **values = i ? &grid->point_arrays[i - 1].values : &grid->xyz;
        uint32_t components = i ? grid->point_arrays[i - 1].components : 3;
        compact(c->t, *values, components);
        *values =
            tl_mem_resize(c->t->ctx, *values, c->t->vert_count, components * sizeof **values, &st);
        if (st) return st;
    }
    return TL_OK;
}

static tl_status leave_unused_out(tli_tets *t)
{
    tl_status st = TL_OK;
    size_t points = (size_t)t->grid->point_count, used = 0;
    t->vert_count = points;
    if (t->tet_count == 0) return TL_OK; /* then the points are all there is */
    for (size_t i = 0; i < points; i++) used += t->point_marks[i] & TLI_POINT_USED;
    if (used == points) return TL_OK;
    t->report.unused_points = points - used;
    t->vert_count = used;

    compaction c = {t, tl_mem_alloc(t->ctx, points, sizeof *c.new_ids, &st)};
    if (st) return st;
    tl_lidx next = 0;
    for (size_t i = 0; i < points; i++) {
        c.new_ids[i] = next;
        next += t->point_marks[i] & TLI_POINT_USED;
    }
    st = tli_parallel(t->ctx, t->tet_count, TLI_TETS_GRAIN, renumber_piece, &c);
    tl_mem_free(t->ctx, c.new_ids);
    c.new_ids = NULL;
    if (!st)
        st = tli_parallel(t->ctx, (size_t)t->grid->point_array_count + 1, 1, compact_array, &c);
    return st;
}

/* ---- driver ---- */

static tl_status make_mesh(tli_tets *t, int region_index, tl_mesh **mesh)
{
    tl_status st = TL_OK;
    bool own_regions = region_index < 0 && t->grid->regions;
    if (region_index >= 0) st = tli_tets_make_regions(t, region_index);
    if (own_regions) st = tli_tets_take_regions(t);
    if (!st && t->opts.cell_to_point && t->tet_count) st = tli_tets_average_cells(t, region_index);
    if (!st) st = tl_mesh_adopt(t->ctx, t->grid->xyz, t->vert_count, t->tets, t->tet_count, mesh);
    if (st) return st;
    t->grid->xyz = NULL;
    t->tets = NULL;
    tl_mesh_set_time(*mesh, t->grid->time);
    if (t->regions) st = tl_mesh_set_regions(*mesh, t->regions);
    tl_mem_free(t->ctx, t->regions);
    t->regions = NULL;
    for (uint32_t i = 0; own_regions && i < t->grid->region_name_count && !st; i++)
        st = tl_mesh_set_region_name(*mesh, t->grid->region_names[i].id,
                                     t->grid->region_names[i].name);
    if (!st) st = tli_tets_hand_over(t, *mesh);
    return st;
}

void tli_tets_release(tli_tets *t)
{
    tl_mem_free(t->ctx, t->region_name);
    tl_mem_free(t->ctx, t->regions);
    tl_mem_free(t->ctx, t->tets);
    tl_mem_free(t->ctx, t->piece_first);
    tl_mem_free(t->ctx, t->cell_marks);
    tl_mem_free(t->ctx, t->point_marks);
    tl_mem_free(t->ctx, t->block_first);
    tl_mem_free(t->ctx, t->tallies);
    tli_grid_release(t->grid);
}

tl_status tli_tets_open(tli_tets *t, tli_grid *grid, const tl_read_opts *opts)
{
    *t = (tli_tets){.ctx = grid->ctx, .grid = grid};
    tl_status st = check_options(t->ctx, opts, &t->opts);
    return st ? st : check_grid(t);
}

tl_status tli_tets_split(tli_tets *t)
{
    tl_status st = tli_tets_prepare(t);
    if (!st) st = tli_tets_mark_missing(t);
    if (!st) st = forget_plain_types(t);
    if (!st) st = count_tets(t);
    return st ? st : build_tets(t);
}

tl_status tli_grid_to_mesh(tli_grid *grid, const tl_read_opts *opts, tl_mesh **mesh,
                           tl_read_report *report)
{
    tli_tets t;
    int region_index = -1;
    *mesh = NULL;
    tl_status st = tli_tets_open(&t, grid, opts);
    if (!st) st = tl_progress(t.ctx, "tets", 0, 3);
    if (!st) st = tli_tets_split(&t);
    if (!st) st = tli_tets_find_region(&t, &region_index);
    if (!st) st = tl_progress(t.ctx, "tets", 1, 3);
    if (!st) st = leave_unused_out(&t);
    if (!st) st = tl_progress(t.ctx, "tets", 2, 3);
    if (!st) st = make_mesh(&t, region_index, mesh);
    if (!st) st = tl_progress(t.ctx, "tets", 3, 3);
    if (!st) {
        tli_tets_sum(&t);
        tli_tets_report(&t);
        if (report) *report = t.report;
    } else {
        tl_mesh_destroy(*mesh);
        *mesh = NULL;
    }
    tli_tets_release(&t);
    return st;
}
