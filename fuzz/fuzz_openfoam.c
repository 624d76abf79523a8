/* The lists of OpenFOAM files: faces, owners, neighbours and a field, each a file behind its size
 * in two bytes, for a mesh of 16 points. What begins as a file itself is zones of 16 cells. */
#include "fuzz_source.h"

#include "formats/formats_openfoam.h"

#include <string.h>

#define POINTS 16

/* The next piece as a file of its own. */
static bool next_piece(tl_ctx *ctx, const uint8_t **at, const uint8_t *end, tli_foam *file)
{
    if (end - *at < 2) return false;
    size_t size = (*at)[0] | (size_t)(*at)[1] << 8;
    *at += 2;
    if (size > (size_t)(end - *at)) size = (size_t)(end - *at);
    tl_status st = TL_OK;
    uint8_t *copy = tl_mem_alloc(ctx, size, 1, &st);
    if (st) return false;
    memcpy(copy, *at, size);
    *at += size;
    tli_map map = {.bytes = copy, .byte_count = size, .owned = copy};
    return tli_foam_attach(ctx, "input", map, file) == TL_OK;
}

static tl_status read_mesh(tl_ctx *ctx, const uint8_t *at, const uint8_t *end, tli_foam_mesh *mesh)
{
    tli_foam file;
    uint64_t owners = 0;
    if (!next_piece(ctx, &at, end, &file)) return tl_fail(ctx, TL_ERR_FORMAT, "no faces");
    tl_status st = tli_foam_faces(&file, mesh);
    tli_foam_close(&file);
    if (st) return st;
    if (!next_piece(ctx, &at, end, &file)) return tl_fail(ctx, TL_ERR_FORMAT, "no owners");
    st = tli_foam_labels(&file, "owners", 0, UINT32_MAX - 1, POINTS, &owners, &mesh->owner);
    tli_foam_close(&file);
    if (!st && owners != mesh->face_count) st = tl_fail(ctx, TL_ERR_FORMAT, "other owners");
    if (st) return st;
    if (!next_piece(ctx, &at, end, &file)) return tl_fail(ctx, TL_ERR_FORMAT, "no neighbours");
    st = tli_foam_labels(&file, "neighbours", -1, UINT32_MAX - 1, POINTS, &mesh->neighbour_count,
                         &mesh->neighbour);
    tli_foam_close(&file);
    if (!st && mesh->neighbour_count > mesh->face_count)
        st = tl_fail(ctx, TL_ERR_FORMAT, "other neighbours");
    double values[3 * POINTS];
    if (!st && next_piece(ctx, &at, end, &file)) {
        (void)tli_foam_field(&file, 3, POINTS, values);
        tli_foam_close(&file);
    }
    return st;
}

static tl_status read_zones(tl_ctx *ctx, const uint8_t *bytes, size_t byte_count, tli_grid *grid)
{
    tl_status st = TL_OK;
    tli_foam file;
    uint8_t *copy = tl_mem_alloc(ctx, byte_count, 1, &st);
    if (st) return st;
    memcpy(copy, bytes, byte_count);
    grid->cell_count = POINTS;
    grid->connectivity = tl_mem_zalloc(ctx, 4 * POINTS, sizeof *grid->connectivity, &st);
    tli_map map = {.bytes = copy, .byte_count = byte_count, .owned = copy};
    tl_status opened = tli_foam_attach(ctx, "input", map, &file);
    if (opened) return opened;
    if (!st) st = tli_foam_zones(&file, grid);
    tli_foam_close(&file);
    return st;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    tl_ctx *ctx = fuzz_ctx_create();
    tli_grid grid;
    tl_status st = TL_OK;
    tli_grid_init(ctx, &grid);
    grid.point_count = POINTS;
    grid.xyz = tl_mem_zalloc(ctx, POINTS, 3 * sizeof *grid.xyz, &st);
    tli_foam_mesh mesh = {.ctx = ctx, .path = "input", .point_count = POINTS};
    bool zones = byte_count > 8 && memcmp(bytes, "FoamFile", 8) == 0;
    st = zones ? read_zones(ctx, bytes, byte_count, &grid)
               : read_mesh(ctx, bytes, bytes + byte_count, &mesh);
    if (!st && !zones) st = tli_foam_make_cells(&mesh, &grid);
    tl_mem_free(ctx, mesh.neighbour);
    tl_mem_free(ctx, mesh.owner);
    if (!grid.face_offsets) {
        tl_mem_free(ctx, mesh.face_points);
        tl_mem_free(ctx, mesh.face_offsets);
    }
    fuzz_finish(ctx, st, &grid);
    return 0;
}
