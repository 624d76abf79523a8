/* A grid as its file has it becomes a mesh of tets: structured blocks by parity (five tets a cell)
 * or around a diagonal (six), polyhedra and prisms by formats_poly.c, other cells by the
 * smallest-index rule of formats_split.c. A file of tets alone is converted in place. This is the
 * driver; the passes over the cells are in formats_tets_cells.c. */
#include "formats/formats_tets.h"
#include "mesh/mesh.h"

#include <stdatomic.h>
#include <string.h>

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
    uint8_t type; /* of the first cell, and its number of ids */
    uint64_t ids;
    atomic_bool other; /* than the first */
    atomic_bool poly;  /* polyhedra or prisms */
} type_scan;

static tl_status scan_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    type_scan *scan = arg;
    const tli_grid *grid = scan->grid;
    bool same = true;
    for (size_t i = begin; i < end && same; i++)
        same = (!grid->types || grid->types[i] == scan->type) &&
               (!grid->offsets ||
                (grid->offsets[i] == scan->ids * i && grid->offsets[i + 1] == scan->ids * (i + 1)));
    bool poly = false;
    for (size_t i = begin; i < end && grid->types; i++)
        poly |= tli_cell_type_of(grid->types[i]).shape >= TLI_SHAPE_PENTAGONAL_PRISM;
    if (!same) atomic_store(&scan->other, true);
    if (poly) atomic_store(&scan->poly, true);
    return TL_OK;
}

/* A list of cells of one type needs neither types nor offsets; one with polyhedra needs room for
 * counts. */
static tl_status scan_types(tli_tets *t)
{
    tli_grid *grid = t->grid;
    t->type = TLI_VTK_TETRA;
    t->type_ids = 4;
    if (grid->block_count || !t->cell_count) return TL_OK;
    type_scan scan = {.grid = grid,
                      .type = grid->types ? grid->types[0] : TLI_VTK_TETRA,
                      .ids = grid->offsets ? grid->offsets[1] - grid->offsets[0] : 4};
    tl_status st = tli_parallel(t->ctx, (size_t)t->cell_count, TLI_TETS_GRAIN, scan_piece, &scan);
    if (!st && atomic_load(&scan.poly))
        t->cell_counts = tl_mem_alloc(t->ctx, (size_t)t->cell_count, sizeof *t->cell_counts, &st);
    if (st || atomic_load(&scan.other) || scan.ids > UINT32_MAX) return st;
    t->type = scan.type;
    t->type_ids = (uint32_t)scan.ids;
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
    t->piece_centre = tl_mem_zalloc(t->ctx, pieces, sizeof *t->piece_centre, &st);
    t->polys = tl_mem_alloc(t->ctx, tl_ctx_thread_count(t->ctx), sizeof *t->polys, &st);
    for (unsigned w = 0; !st && w < tl_ctx_thread_count(t->ctx); w++)
        tli_poly_open(t->ctx, &t->polys[w]);
    if (blocks)
        t->block_first = tl_mem_alloc(t->ctx, (size_t)blocks + 1, sizeof *t->block_first, &st);
    if (st) return st;
    for (uint32_t b = 0; b <= blocks && blocks; b++) {
        tli_grid before = {.blocks = t->grid->blocks, .block_count = b};
        t->block_first[b] = tli_grid_cell_count(&before);
    }
    return TL_OK;
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
    (*mesh)->regions = t->regions; /* without the copy that tl_mesh_set_regions would make */
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
    for (unsigned w = 0; t->polys && w < tl_ctx_thread_count(t->ctx); w++)
        tli_poly_close(&t->polys[w]);
    tl_mem_free(t->ctx, t->polys);
    tl_mem_free(t->ctx, t->piece_centre);
    tl_mem_free(t->ctx, t->piece_first);
    tl_mem_free(t->ctx, t->cell_counts);
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
    if (!st) st = scan_types(t);
    if (!st) st = tli_tets_count(t);
    return st ? st : tli_tets_build(t);
}

tl_status tli_grid_to_mesh(tli_grid *grid, const tl_read_opts *opts, tl_mesh **mesh,
                           tl_read_report *report)
{
    tli_tets t;
    int region_index = -1;
    tli_label_faces labels = {0};
    *mesh = NULL;
    tl_status st = tli_tets_open(&t, grid, opts);
    if (!st) st = tl_progress(t.ctx, "tets", 0, 3);
    if (!st) st = tli_tets_split(&t);
    if (!st) st = tli_tets_find_labels(&t, &labels);
    if (!st) st = tli_tets_find_region(&t, &region_index);
    if (!st) st = tl_progress(t.ctx, "tets", 1, 3);
    if (!st) st = leave_unused_out(&t);
    if (!st) st = tl_progress(t.ctx, "tets", 2, 3);
    if (!st) st = make_mesh(&t, region_index, mesh);
    if (!st) st = tli_tets_add_labels(&t, &labels, *mesh);
    if (!st) st = tl_progress(t.ctx, "tets", 3, 3);
    if (!st) {
        tli_tets_sum(&t);
        tli_tets_report(&t);
        if (report) *report = t.report;
    } else {
        tl_mesh_destroy(*mesh);
        *mesh = NULL;
    }
    tl_mem_free(t.ctx, labels.faces);
    tl_mem_free(t.ctx, labels.labels);
    tli_tets_release(&t);
    return st;
}
