/* The two passes of a conversion over the cells of a grid: one counts tets and marks points, one
 * writes them; in pieces whose results do not depend on the threads. Polyhedra and prisms are split
 * in both passes alike; those that need a new vertex in the middle get it between them.
 *
 * A cell is turned as a whole, by the sign of its volume: turning single tets of a folded cell
 * would hide the fold. So a lone negative tet becomes positive, and a hexahedron that is folded
 * keeps the tets that are inverted, counted. */
#include "base/base_predicates.h"
#include "formats/formats_tets.h"

#include <stdatomic.h>
#include <string.h>

/* Pieces whose ids are copied at once. */
#define WINDOW_PIECES 16

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
    return tli_cell_type_of(grid->types ? grid->types[walk->cell] : walk->t->type);
}

/* Where the ids of a cell of a list begin; of the number of cells: where they all end. */
static uint64_t ids_begin(const tli_tets *t, uint64_t cell)
{
    return t->grid->offsets ? t->grid->offsets[cell] : cell * t->type_ids;
}

static const uint32_t *cell_ids(const cell_walk *walk)
{
    return walk->t->grid->connectivity + (ids_begin(walk->t, walk->cell) - walk->t->ids_left_out);
}

static uint64_t cell_id_count(const cell_walk *walk)
{
    return ids_begin(walk->t, walk->cell + 1) - ids_begin(walk->t, walk->cell);
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
    memcpy(corners, cell_ids(walk), tli_shape_corners(shape) * sizeof *corners);
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

/* ---- polyhedra and prisms ---- */

static bool is_poly(tli_shape shape)
{
    return shape >= TLI_SHAPE_PENTAGONAL_PRISM;
}

/* The faces of a prism over a polygon of count corners: corners [2 * count]. */
static tl_status prism_faces(tli_poly *poly, const tl_lidx *corners, unsigned count)
{
    tl_status st = tli_poly_face(poly, corners, count);
    if (!st) st = tli_poly_face(poly, corners + count, count);
    for (unsigned i = 0; i < count && !st; i++) {
        unsigned next = (i + 1) % count;
        const tl_lidx side[4] = {corners[i], corners[next], corners[next + count],
                                 corners[i + count]};
        st = tli_poly_face(poly, side, 4);
    }
    return st;
}

/* Hands the faces of the cell to the scratch polyhedron. */
static tl_status poly_faces(const cell_walk *walk, tli_shape shape, tli_poly *poly)
{
    const tli_grid *grid = walk->t->grid;
    const uint32_t *ids = cell_ids(walk);
    uint64_t count = cell_id_count(walk);
    tl_status st = TL_OK;
    tli_poly_begin(poly);
    if (shape != TLI_SHAPE_POLYHEDRON) return prism_faces(poly, ids, tli_shape_corners(shape) / 2);
    for (uint64_t i = 0; i < count && !st; i++) {
        uint64_t begin = grid->face_offsets[ids[i]], end = grid->face_offsets[ids[i] + 1];
        st = tli_poly_face(poly, grid->face_points + begin, (size_t)(end - begin));
    }
    return st;
}

/* The new vertex of a polyhedron, with values from its corners. */
static void place_centre(tli_tets *t, const tli_poly *poly, uint64_t id)
{
    tli_grid *grid = t->grid;
    memcpy(grid->xyz + 3 * id, poly->centre, sizeof poly->centre);
    for (uint32_t a = 0; a < grid->point_array_count; a++) {
        const tli_grid_array *array = &grid->point_arrays[a];
        for (uint32_t c = 0; c < array->components; c++) {
            double sum = 0;
            for (size_t i = 0; i < poly->vert_count; i++)
                sum += poly->weights[i] *
                       array->values[(size_t)poly->verts[i] * array->components + c];
            array->values[id * array->components + c] = sum;
        }
    }
}

/* ---- first pass: count ---- */

static tl_status check_point_count(const cell_walk *walk, tli_cell_type type)
{
    if (walk->t->grid->block_count) return TL_OK;
    uint64_t cell = walk->cell, points = cell_id_count(walk);
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

/* False for a cell whose corners are hidden or missing, or that is missing itself. */
static bool is_there(tli_tets *t, uint8_t *mark, const tl_lidx *corners, size_t corner_count,
                     tli_tally *tally)
{
    uint8_t marks = 0;
    for (size_t i = 0; i < corner_count; i++)
        marks |= atomic_load_explicit((_Atomic uint8_t *)&t->point_marks[corners[i]],
                                      memory_order_relaxed);
    if (marks & TLI_POINT_HIDDEN) {
        *mark = TLI_CELL_GHOST;
        tally->ghosts++;
        return false;
    }
    if ((*mark & TLI_CELL_BLANK) || (marks & TLI_POINT_MISSING)) {
        *mark = TLI_CELL_BLANK;
        tally->blanks++;
        return false;
    }
    return true;
}

static tl_status count_poly(tli_tets *t, const cell_walk *walk, tli_shape shape, tli_poly *poly,
                            tli_tally *tally)
{
    uint8_t *mark = &t->cell_marks[walk->cell];
    tli_poly_kind kind;
    if (shape == TLI_SHAPE_POLYHEDRON && !t->grid->face_count) {
        *mark = 0;
        tally->faceless++;
        return TL_OK;
    }
    tl_status st = poly_faces(walk, shape, poly);
    if (st || !is_there(t, mark, poly->ids, poly->id_count, tally)) return st;
    st = tli_poly_split(poly, t->grid->xyz, TL_NONE, &kind);
    if (st) return st;
    *mark = 0;
    if (kind == TLI_POLY_NONE) {
        tally->open++;
        return TL_OK;
    }
    if (poly->tet_count > TL_MESH_TETS_MAX)
        return tl_fail(t->ctx, TL_ERR_UNSUPPORTED, "cell %llu becomes %zu tets",
                       (unsigned long long)walk->cell, poly->tet_count);
    tally->closed += poly->closed;
    *mark = TLI_CELL_COUNT | (kind == TLI_POLY_CENTRE ? TLI_CELL_CENTRE : 0);
    t->cell_counts[walk->cell] = (uint32_t)poly->tet_count;
    for (size_t i = 0; i < poly->tet_count; i++)
        for (unsigned v = kind == TLI_POLY_CENTRE; v < 4; v++)
            mark_used(t->point_marks, poly->tets[i][v]);
    return TL_OK;
}

static tl_status count_cell(tli_tets *t, const cell_walk *walk, tli_poly *poly, tli_tally *tally)
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
    if (is_poly(type.shape)) return count_poly(t, walk, type.shape, poly, tally);
    tl_lidx corners[TLI_CORNERS_MAX], tets[TLI_SPLIT_MAX][4];
    cell_corners(walk, type.shape, corners);
    if (!is_there(t, mark, corners, tli_shape_corners(type.shape), tally)) return TL_OK;
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
    uint64_t sum = 0, centres = 0;
    walk_begin(&walk, t, begin);
    for (; walk.cell < end; walk_next(&walk)) {
        tl_status st = count_cell(t, &walk, &t->polys[worker], &t->tallies[worker]);
        if (st) return st;
        sum += tli_cell_tets(t, walk.cell);
        centres += (t->cell_marks[walk.cell] & TLI_CELL_CENTRE) != 0;
    }
    t->piece_first[begin / TLI_TETS_GRAIN + 1] = sum;
    t->piece_centre[begin / TLI_TETS_GRAIN + 1] = centres;
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
static void orient_cell(const double *xyz, tl_lidx (*tets)[4], size_t count, tli_tally *tally)
{
    size_t positive = 0, negative = 0, flat = 0;
    double volume = 0;
    for (size_t i = 0; i < count; i++) {
        if (!tet_is_finite(xyz, tets[i])) {
            tally->nonfinite_tets += count;
            return;
        }
        const double *p[4];
        for (unsigned v = 0; v < 4; v++) p[v] = xyz + 3 * (size_t)tets[i][v];
        int sign = tli_orient3d(p[0], p[1], p[2], p[3]);
        if (count > 1) volume += tli_orient3d_approx(p[0], p[1], p[2], p[3]);
        positive += sign > 0, negative += sign < 0, flat += sign == 0;
    }
    tally->degenerate += flat;
    bool turn = negative && (positive == 0 || volume < 0);
    if (!turn) {
        tally->inverted += negative;
        return;
    }
    tally->turned += negative;
    tally->inverted += positive;
    for (size_t i = 0; i < count; i++) {
        tl_lidx swap = tets[i][2];
        tets[i][2] = tets[i][3];
        tets[i][3] = swap;
    }
}

/* The tets of a polyhedron, split as in the first pass. */
static tl_status build_poly(tli_tets *t, const cell_walk *walk, tli_shape shape, uint64_t *centre,
                            tli_poly *poly)
{
    tli_poly_kind kind;
    tl_status st = poly_faces(walk, shape, poly);
    if (!st) st = tli_poly_split(poly, t->grid->xyz, (tl_lidx)*centre, &kind);
    if (!st && kind == TLI_POLY_CENTRE) place_centre(t, poly, (*centre)++);
    return st;
}

/* Cells that are built at once, beginning with a piece. */
typedef struct build_window {
    tli_tets *t;
    uint64_t first;
} build_window;

static tl_status build_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const build_window *window = arg;
    tli_tets *t = window->t;
    begin += (size_t)window->first;
    end += (size_t)window->first;
    size_t piece = begin / TLI_TETS_GRAIN;
    tl_lidx(*out)[4] = (tl_lidx(*)[4])t->tets + t->piece_first[piece];
    uint64_t centre = t->first_centre + t->piece_centre[piece];
    tli_poly *poly = &t->polys[worker];
    cell_walk walk;
    walk_begin(&walk, t, begin);
    for (; walk.cell < end; walk_next(&walk)) {
        if (!(t->cell_marks[walk.cell] & TLI_CELL_COUNT)) continue;
        tl_lidx corners[TLI_CORNERS_MAX], tets[TLI_SPLIT_MAX][4];
        tli_shape shape = cell_type(&walk).shape;
        size_t count;
        if (is_poly(shape)) {
            tl_status st = build_poly(t, &walk, shape, &centre, poly);
            if (st) return st;
            count = poly->tet_count;
            memcpy(out, poly->tets, count * sizeof *out);
        } else {
            unsigned repeated;
            cell_corners(&walk, shape, corners);
            count = cell_tets(&walk, shape, corners, tets, &repeated);
            memcpy(out, tets, count * sizeof *out);
        }
        orient_cell(t->grid->xyz, out, count, &t->tallies[worker]);
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

/* ---- the passes ---- */

/* Room for the new vertices behind the points. */
static tl_status add_centres(tli_tets *t)
{
    tli_grid *grid = t->grid;
    tl_status st = TL_OK;
    uint64_t points = grid->point_count, all = points + t->centre_count;
    if (all > TL_MESH_VERTS_MAX)
        return tl_fail(t->ctx, TL_ERR_UNSUPPORTED,
                       "%llu points, with one in the middle of each of %llu polyhedra; a mesh in "
                       "memory holds at most %u",
                       (unsigned long long)points, (unsigned long long)t->centre_count,
                       TL_MESH_VERTS_MAX);
    grid->xyz = tl_mem_resize(t->ctx, grid->xyz, (size_t)all, 3 * sizeof *grid->xyz, &st);
    t->point_marks = tl_mem_resize(t->ctx, t->point_marks, (size_t)all, 1, &st);
    for (uint32_t a = 0; a < grid->point_array_count; a++) {
        tli_grid_array *array = &grid->point_arrays[a];
        array->values = tl_mem_resize(t->ctx, array->values, (size_t)all,
                                      array->components * sizeof *array->values, &st);
        if (!st) array->count = all;
    }
    if (st) return st;
    memset(t->point_marks + points, TLI_POINT_USED, (size_t)t->centre_count);
    t->first_centre = points;
    grid->point_count = all;
    return TL_OK;
}

tl_status tli_tets_count(tli_tets *t)
{
    tl_status st = tli_parallel(t->ctx, (size_t)t->cell_count, TLI_TETS_GRAIN, count_piece, t);
    if (st) return st;
    size_t pieces = (size_t)((t->cell_count + TLI_TETS_GRAIN - 1) / TLI_TETS_GRAIN);
    for (size_t p = 0; p < pieces; p++) {
        t->piece_first[p + 1] += t->piece_first[p];
        t->piece_centre[p + 1] += t->piece_centre[p];
    }
    t->centre_count = t->piece_centre[pieces];
    t->largest_cell = TLI_SPLIT_MAX;
    for (uint64_t cell = 0; t->cell_counts && cell < t->cell_count; cell++)
        if (tli_cell_tets(t, cell) > t->largest_cell) t->largest_cell = tli_cell_tets(t, cell);
    uint64_t total = t->piece_first[pieces];
    if (total > TL_MESH_TETS_MAX)
        return tl_fail(t->ctx, TL_ERR_UNSUPPORTED,
                       "%llu cells become %llu tets; a mesh in memory holds at most %u",
                       (unsigned long long)t->cell_count, (unsigned long long)total,
                       TL_MESH_TETS_MAX);
    t->tet_count = (size_t)total;
    return t->centre_count ? add_centres(t) : TL_OK;
}

/* Closes the gaps of the tets that were dropped. */
static void close_gaps(tli_tets *t)
{
    tl_lidx(*tets)[4] = (tl_lidx(*)[4])t->tets;
    size_t kept = 0;
    for (size_t i = 0; i < t->cell_count; i++)
        if (t->cell_marks[i] & TLI_CELL_COUNT) memmove(tets[kept++], tets[i], sizeof *tets);
}

/* ---- lists of cells, in the memory of their ids ---- */

/* First cell of a window of pieces. */
static uint64_t window_begin(const tli_tets *t, uint64_t window)
{
    uint64_t cell = window * WINDOW_PIECES * TLI_TETS_GRAIN;
    return cell < t->cell_count ? cell : t->cell_count;
}

static uint64_t tets_before(const tli_tets *t, uint64_t cell)
{
    return t->piece_first[(cell + TLI_TETS_GRAIN - 1) / TLI_TETS_GRAIN];
}

/* How large the block must be that holds the tets of all windows up to one at its beginning and, at
 * its end, the ids of the others; and the ids of the largest window. */
static void measure_windows(const tli_tets *t, uint64_t *room, uint64_t *largest)
{
    uint64_t ids = ids_begin(t, t->cell_count);
    *room = ids;
    *largest = 0;
    for (uint64_t w = 0; window_begin(t, w) < t->cell_count; w++) {
        uint64_t end = window_begin(t, w + 1), from = ids_begin(t, window_begin(t, w));
        uint64_t wanted = 4 * tets_before(t, end) + (ids - ids_begin(t, end));
        if (wanted > *room) *room = wanted;
        if (ids_begin(t, end) - from > *largest) *largest = ids_begin(t, end) - from;
    }
}

/* Tets need more room than the ids of their cells, and both together would be most of the memory of
 * a conversion. So the ids go to the end of a block that holds the tets, a window of them at a time
 * into a copy, and its tets to where they belong: never over ids that are still needed. */
static tl_status build_list(tli_tets *t)
{
    tli_grid *grid = t->grid;
    tl_status st = TL_OK;
    uint64_t room, largest, ids = ids_begin(t, t->cell_count);
    measure_windows(t, &room, &largest);
    uint32_t *copy = tl_mem_alloc(t->ctx, (size_t)largest, sizeof *copy, &st);
    grid->connectivity =
        tl_mem_resize(t->ctx, grid->connectivity, (size_t)room, sizeof *t->tets, &st);
    if (!st) {
        t->tets = grid->connectivity;
        grid->connectivity = copy;
        memmove(t->tets + (room - ids), t->tets, (size_t)ids * sizeof *t->tets);
    }
    for (uint64_t w = 0; !st && window_begin(t, w) < t->cell_count; w++) {
        build_window window = {t, window_begin(t, w)};
        uint64_t end = window_begin(t, w + 1);
        t->ids_left_out = ids_begin(t, window.first);
        memcpy(copy, t->tets + (room - ids) + t->ids_left_out,
               (size_t)(ids_begin(t, end) - t->ids_left_out) * sizeof *copy);
        st = tli_parallel(t->ctx, (size_t)(end - window.first), TLI_TETS_GRAIN, build_piece,
                          &window);
    }
    if (t->tets) {
        grid->connectivity = NULL;
        t->tets = tl_mem_resize(t->ctx, t->tets, t->tet_count, 4 * sizeof *t->tets, &st);
    }
    tl_mem_free(t->ctx, copy);
    t->ids_left_out = 0;
    return st;
}

tl_status tli_tets_build(tli_tets *t)
{
    tli_grid *grid = t->grid;
    tl_status st = TL_OK;
    if (!grid->block_count && !grid->types && !grid->offsets && t->type == TLI_VTK_TETRA) {
        t->one_to_one = t->tet_count == t->cell_count;
        t->tets = grid->connectivity;
        grid->connectivity = NULL;
        if (!t->one_to_one) close_gaps(t);
        t->tets = tl_mem_resize(t->ctx, t->tets, t->tet_count, 4 * sizeof *t->tets, &st);
        if (!st) st = tli_parallel(t->ctx, t->tet_count, TLI_TETS_GRAIN, turn_piece, t);
    } else if (!grid->block_count) {
        st = build_list(t);
    } else {
        build_window all = {t, 0};
        t->tets = tl_mem_alloc(t->ctx, t->tet_count, 4 * sizeof *t->tets, &st);
        if (!st)
            st = tli_parallel(t->ctx, (size_t)t->cell_count, TLI_TETS_GRAIN, build_piece, &all);
    }
    tl_mem_free(t->ctx, grid->connectivity);
    tl_mem_free(t->ctx, grid->offsets);
    tl_mem_free(t->ctx, grid->types);
    tl_mem_free(t->ctx, grid->face_points);
    tl_mem_free(t->ctx, grid->face_offsets);
    grid->connectivity = NULL;
    grid->offsets = NULL;
    grid->types = NULL;
    grid->face_points = NULL;
    grid->face_offsets = NULL;
    return st;
}
