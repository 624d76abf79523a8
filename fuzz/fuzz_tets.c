/* Fuzz target: any grid that a reader could hand on, turned into tets under any options. The bytes
 * are a recipe: options, points, cells or blocks, arrays. What comes out must keep its promises. */
#include "base/base_predicates.h"
#include "fuzz_grid.h"

#include <math.h>
#include <string.h>

typedef struct recipe {
    const uint8_t *bytes;
    size_t left;
} recipe;

static unsigned next(recipe *r)
{
    if (!r->left) return 0;
    r->left--;
    return *r->bytes++;
}

static double next_number(recipe *r)
{
    static const double odd[] = {(double)NAN, (double)INFINITY, -1e50, 1e-50, 0.1, 3e9, -0.0, 1e20};
    unsigned byte = next(r);
    return byte >= 248 ? odd[byte - 248] : (double)((int)(byte & 15) - 8);
}

static tl_status add_arrays(recipe *r, tli_grid *grid)
{
    static const char *const names[] = {
        "vtkGhostType", "vtkGhostLevels", "region", "Material #", "p", "p", "velocity"};
    tl_status st = TL_OK;
    for (unsigned count = next(r) % 6; count && !st; count--) {
        tli_grid_array *array;
        unsigned name = next(r) % 7, kind = next(r);
        st = tli_grid_add(grid, kind & 1 ? TL_ON_TET : TL_ON_VERTEX, names[name], kind & 2 ? 3 : 1,
                          kind & 4 ? TL_F32 : TL_I32, NULL, &array);
        if (st) break;
        for (uint64_t i = 0; i < array->count * array->components; i++)
            array->values[i] = next_number(r);
    }
    return st;
}

static tl_status make_blocks(recipe *r, tli_grid *grid)
{
    tl_status st = TL_OK;
    grid->block_count = 1 + next(r) % 3;
    grid->blocks = tl_mem_zalloc(grid->ctx, grid->block_count, sizeof *grid->blocks, &st);
    for (uint32_t b = 0; b < grid->block_count && !st; b++) {
        grid->blocks[b].first_point = grid->point_count;
        for (int axis = 0; axis < 3; axis++) grid->blocks[b].dims[axis] = next(r) % 6;
        const uint32_t *dims = grid->blocks[b].dims;
        grid->point_count += (uint64_t)dims[0] * dims[1] * dims[2];
    }
    if (!st && next(r) & 1) {
        grid->blanks = tl_mem_alloc(grid->ctx, (size_t)grid->point_count, 1, &st);
        for (uint64_t i = 0; i < grid->point_count && !st; i++) grid->blanks[i] = next(r) & 3;
    }
    return st;
}

/* The faces of a tet, a cube or a pyramid over eight or fewer corners, with slips. */
static tl_status make_faces(recipe *r, tli_grid *grid, tli_face_list *list, uint32_t *count)
{
    static const uint8_t solids[3][6][4] = {
        {{0, 1, 2, 2}, {0, 1, 3, 3}, {1, 2, 3, 3}, {2, 0, 3, 3}},
        {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}},
        {{0, 1, 2, 3}, {0, 1, 4, 4}, {1, 2, 4, 4}, {2, 3, 4, 4}, {3, 0, 4, 4}}};
    static const uint32_t sizes[3] = {4, 6, 5};
    tl_status st = TL_OK;
    unsigned solid = next(r) % 3, slip = next(r);
    uint32_t ids[8];
    for (int i = 0; i < 8; i++) ids[i] = next(r) % (uint32_t)grid->point_count;
    *count = sizes[solid];
    for (uint32_t f = 0; f < *count && !st; f++) {
        uint32_t face[4];
        for (int i = 0; i < 4; i++) face[i] = ids[solids[solid][f][i]];
        if (f == slip % 16) face[slip >> 6] = ids[7];
        st = tli_face_list_add(list, face, f == slip % 32 ? 2 : 4, 0);
    }
    return st;
}

static tl_status make_polyhedra(recipe *r, tli_grid *grid)
{
    tl_status st = TL_OK;
    tli_face_list list;
    grid->point_count = 1 + next(r) % 20;
    grid->cell_count = next(r) % 20;
    size_t cells = (size_t)grid->cell_count;
    grid->connectivity = tl_mem_alloc(grid->ctx, cells, 6 * sizeof(uint32_t), &st);
    grid->types = tl_mem_alloc(grid->ctx, cells, 1, &st);
    grid->offsets = tl_mem_zalloc(grid->ctx, cells + 1, sizeof *grid->offsets, &st);
    tli_face_list_begin(grid, &list);
    uint64_t used = 0;
    for (size_t c = 0; c < cells && !st; c++) {
        uint32_t count, first = (uint32_t)grid->face_count;
        st = make_faces(r, grid, &list, &count);
        for (uint32_t i = 0; i < count && !st; i++) grid->connectivity[used++] = first + i;
        if (!st) grid->offsets[c + 1] = used;
        if (!st) grid->types[c] = 42;
    }
    return st ? st : tli_face_list_end(&list);
}

static tl_status add_labels(recipe *r, tli_grid *grid)
{
    tl_status st = TL_OK;
    for (unsigned count = next(r) % 3; count && grid->point_count && !st; count--) {
        uint64_t faces = next(r) % 8, used = 0;
        uint64_t *offsets = tl_mem_zalloc(grid->ctx, (size_t)faces + 1, sizeof *offsets, &st);
        uint32_t *points = tl_mem_alloc(grid->ctx, (size_t)faces, 7 * sizeof *points, &st);
        for (uint64_t f = 0; f < faces && !st; f++) {
            for (unsigned i = next(r) % 8; i; i--)
                points[used++] = next(r) % (uint32_t)grid->point_count;
            offsets[f + 1] = used;
        }
        if (!st) st = tli_grid_add_label(grid, "label", (int32_t)count, faces, offsets, points);
        if (st) tl_mem_free(grid->ctx, points);
        if (st) tl_mem_free(grid->ctx, offsets);
    }
    return st;
}

static tl_status make_cells(recipe *r, tli_grid *grid)
{
    tl_status st = TL_OK;
    bool typed = next(r) & 1;
    grid->point_count = 1 + next(r) % 40;
    grid->cell_count = next(r) % 40;
    size_t cells = (size_t)grid->cell_count;
    grid->connectivity = tl_mem_alloc(grid->ctx, cells, 32 * sizeof(uint32_t), &st);
    if (typed) {
        grid->types = tl_mem_alloc(grid->ctx, cells, 1, &st);
        grid->offsets = tl_mem_zalloc(grid->ctx, cells + 1, sizeof *grid->offsets, &st);
    }
    uint64_t used = 0;
    for (size_t c = 0; c < cells && !st; c++) {
        static const uint8_t types[] = {10, 12, 13, 14, 11, 24, 15, 16, 5, 72};
        static const uint8_t sizes[] = {4, 8, 6, 5, 8, 10, 10, 12, 3, 27};
        unsigned kind = next(r), size = typed ? sizes[kind % 10] : 4;
        if (typed && kind >= 240) size = next(r) % 32; /* not what the type asks for */
        for (unsigned i = 0; i < size; i++)
            grid->connectivity[used++] = next(r) % (uint32_t)grid->point_count;
        if (typed) grid->types[c] = types[kind % 10];
        if (typed) grid->offsets[c + 1] = used;
    }
    return st;
}

static void check_mesh(const tl_mesh *mesh, const tl_read_report *report)
{
    const tl_lidx *tets = tl_mesh_tets(mesh);
    const double *xyz = tl_mesh_xyz(mesh);
    size_t tet_count = tl_mesh_tet_count(mesh), vert_count = tl_mesh_vert_count(mesh);
    uint64_t inverted = 0, flat = 0;
    for (size_t t = 0; t < tet_count; t++) {
        const double *p[4];
        double sum = 0;
        for (size_t v = 0; v < 4; v++) {
            FUZZ_CHECK(tets[4 * t + v] < vert_count);
            for (size_t w = 0; w < v; w++) FUZZ_CHECK(tets[4 * t + v] != tets[4 * t + w]);
            p[v] = xyz + 3 * (size_t)tets[4 * t + v];
            for (int axis = 0; axis < 3; axis++) sum += 0 * p[v][axis];
        }
        if (isnan(sum)) return; /* such cells are left as they are */
        int sign = tli_orient3d(p[0], p[1], p[2], p[3]);
        inverted += sign < 0;
        flat += sign == 0;
    }
    FUZZ_CHECK(inverted == report->inverted && flat == report->degenerate);
}

static void check_channels(const tl_mesh *mesh)
{
    double sum = 0;
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        size_t count =
            channel->on == TL_ON_TET ? tl_mesh_tet_count(mesh) : tl_mesh_vert_count(mesh);
        sum += fuzz_sum(channel->values, count * channel->components);
    }
    for (size_t t = 0; tl_mesh_regions(mesh) && t < tl_mesh_tet_count(mesh); t++)
        sum += tl_mesh_regions(mesh)[t];
    static volatile double sink;
    sink = sum;
    (void)sink;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    recipe r = {bytes, byte_count};
    tl_ctx *ctx = fuzz_ctx_create();
    tl_read_opts opts = tl_read_opts_defaults();
    unsigned flags = next(&r);
    opts.split = flags & 1 ? 6 : 5;
    opts.cell_to_point = flags & 2;
    opts.has_fill_value = flags & 4;
    opts.keep_fill = flags & 8;
    opts.region = flags & 16 ? "p" : NULL;
    opts.fill_value = next_number(&r);
    tli_grid grid;
    tli_grid_init(ctx, &grid);
    tl_status st = flags & 32   ? make_blocks(&r, &grid)
                   : flags & 64 ? make_polyhedra(&r, &grid)
                                : make_cells(&r, &grid);
    grid.xyz = tl_mem_alloc(ctx, (size_t)grid.point_count, 3 * sizeof *grid.xyz, &st);
    for (uint64_t i = 0; i < 3 * grid.point_count && !st; i++) grid.xyz[i] = next_number(&r);
    if (!st) st = add_arrays(&r, &grid);
    if (!st) st = add_labels(&r, &grid);
    uint64_t welded;
    if (!st && flags & 128) st = tli_grid_weld(&grid, next(&r), &welded);
    if (!st) fuzz_check_cells(&grid);
    tl_mesh *mesh = NULL;
    tl_read_report report;
    if (!st) st = tli_grid_to_mesh(&grid, &opts, &mesh, &report);
    FUZZ_CHECK(!st == (mesh != NULL));
    FUZZ_CHECK(!st || tl_ctx_message(ctx)[0]);
    if (mesh) {
        check_mesh(mesh, &report);
        check_channels(mesh);
    }
    tl_mesh_destroy(mesh);
    tli_grid_release(&grid);
    FUZZ_CHECK(tl_ctx_current_bytes(ctx) == 0);
    tl_ctx_destroy(ctx);
    return 0;
}
