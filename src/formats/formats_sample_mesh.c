/* Meshes of the samples. The shells lie between the unit sphere and a cube around it: the rays
 * through the lattice of the cube's surface, equal in angle (Ronchi, Iacono and Paolucci 1996),
 * carry one vertex a layer, from the sphere to the cube, so vertices are shared without a table and
 * every layer has the same cells. Radii grow geometrically along a ray, as the distances between
 * the rays do, and thinner layers lie near the sphere.
 *
 * A layer numbers its vertices as the one below it, so a hexahedron is cut by its smallest index
 * into six tets, alike in all layers: the far corner is cut towards, since the upper face is cut
 * like the lower one. */
#include "formats/formats_sample.h"
#include "formats/formats_split.h"

#include <math.h>

#define QUARTER_PI 0.78539816339744830962
/* Layers for each cell along an edge of the cube: cells about as high as wide. */
#define LAYERS_PER_CELL 2
/* Thickness of the layers at the sphere against their mean, on the scale of the logarithm of r. */
#define FIRST_LAYERS 0.25
/* Vertices of two layers have 32-bit numbers; float32 positions stay apart. */
#define SHELLS_SIDE_MAX 16384
/* Floats in [-1, 1] stay well apart. */
#define GRID_SIDE_MAX 32768

bool tli_sample_mesh_init(tli_sample_mesh *mesh, tli_sample_kind kind, uint32_t size)
{
    *mesh = (tli_sample_mesh){.kind = kind, .side = size};
    if (kind == TLI_SAMPLE_GRID) {
        if (size < 2 || size > GRID_SIDE_MAX) return false;
        uint64_t cells = size - 1;
        mesh->vert_count = (uint64_t)size * size * size;
        mesh->tet_count = 5 * cells * cells * cells;
        return true;
    }
    if (size < 2 || size > 2 * SHELLS_SIDE_MAX) return false;
    mesh->side = (uint32_t)lround(size / cbrt(6 * LAYERS_PER_CELL));
    if (mesh->side < 1) mesh->side = 1;
    if (mesh->side > SHELLS_SIDE_MAX) return false;
    mesh->layers = LAYERS_PER_CELL * mesh->side;
    uint64_t quads = 6 * (uint64_t)mesh->side * mesh->side;
    mesh->vert_count = (quads + 2) * (mesh->layers + 1);
    mesh->tet_count = 6 * quads * mesh->layers;
    return true;
}

/* ---- grid ---- */

static void grid_point(const tli_sample_mesh *mesh, uint64_t vert, float xyz[3])
{
    int64_t last = (int64_t)mesh->side - 1;
    for (int axis = 0; axis < 3; axis++, vert /= mesh->side) {
        int64_t at = (int64_t)(vert % mesh->side);
        xyz[axis] = (float)((double)(2 * at - last) / (double)last);
    }
}

static void grid_tets(const tli_sample_mesh *mesh, uint64_t begin, uint64_t end,
                      uint64_t (*tets)[4])
{
    uint64_t side = mesh->side, cells = side - 1, cell = UINT64_MAX, base = 0;
    unsigned parity = 0;
    for (uint64_t t = begin; t < end; t++, tets++) {
        if (t / 5 != cell) {
            cell = t / 5;
            uint64_t i = cell % cells, j = cell / cells % cells, k = cell / cells / cells;
            base = i + side * (j + side * k);
            parity = (i + j + k) & 1;
        }
        const uint8_t *corners = tli_split_five[parity][t % 5];
        for (int v = 0; v < 4; v++) {
            unsigned c = corners[v];
            (*tets)[v] = base + (c & 1) + side * ((c >> 1 & 1) + side * (c >> 2));
        }
    }
}

/* ---- the surface of a lattice cube ---- */

/* Number of a vertex of the surface: the layer z = 0, the rims of the layers between, z = side. */
static uint32_t surface_vertex(uint32_t side, const uint32_t at[3])
{
    uint32_t plane = (side + 1) * (side + 1), x = at[0], y = at[1], z = at[2];
    if (z == 0) return x + (side + 1) * y;
    if (z == side) return plane + 4 * side * (side - 1) + x + (side + 1) * y;
    uint32_t rim = y == 0 && x < side      ? x
                   : x == side && y < side ? side + y
                   : y == side && x > 0    ? 2 * side + (side - x)
                                           : 3 * side + (side - y);
    return plane + 4 * side * (z - 1) + rim;
}

static void surface_place(uint32_t side, uint32_t vert, uint32_t at[3])
{
    uint32_t plane = (side + 1) * (side + 1), rims = 4 * side * (side - 1);
    if (vert < plane || vert >= plane + rims) {
        at[2] = vert < plane ? 0 : side;
        if (vert >= plane) vert -= plane + rims;
        at[0] = vert % (side + 1);
        at[1] = vert / (side + 1);
        return;
    }
    vert -= plane;
    at[2] = 1 + vert / (4 * side);
    uint32_t rim = vert % (4 * side), along = rim % side;
    switch (rim / side) {
    case 0: at[0] = along, at[1] = 0; break;
    case 1: at[0] = side, at[1] = along; break;
    case 2: at[0] = side - along, at[1] = side; break;
    default: at[0] = 0, at[1] = side - along; break;
    }
}

/* Corners of a square of the surface, counterclockwise seen from outside. */
static void surface_square(uint32_t side, uint32_t square, uint32_t corners[4])
{
    static const uint8_t order[2][4][2] = {{{0, 0}, {0, 1}, {1, 1}, {1, 0}},
                                           {{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    uint32_t face = square / (side * side), rest = square % (side * side);
    uint32_t axis = face / 2, high = face % 2;
    for (int c = 0; c < 4; c++) {
        uint32_t at[3];
        at[axis] = high ? side : 0;
        at[(axis + 1) % 3] = rest % side + order[high][c][0];
        at[(axis + 2) % 3] = rest / side + order[high][c][1];
        corners[c] = surface_vertex(side, at);
    }
}

/* ---- shells ---- */

static void shells_point(const tli_sample_mesh *mesh, uint64_t vert, float xyz[3])
{
    uint64_t surface = 6 * (uint64_t)mesh->side * mesh->side + 2;
    uint32_t at[3], layer = (uint32_t)(vert / surface);
    surface_place(mesh->side, (uint32_t)(vert % surface), at);
    double ray[3], length = 0;
    for (int axis = 0; axis < 3; axis++) { /* to the surface of [-1, 1]^3 */
        double angle = (2.0 * at[axis] - mesh->side) / mesh->side;
        ray[axis] = at[axis] == 0 ? -1 : at[axis] == mesh->side ? 1 : tan(QUARTER_PI * angle);
        length += ray[axis] * ray[axis];
    }
    length = sqrt(length);
    double s = (double)layer / mesh->layers;
    double t = s * (FIRST_LAYERS + (1 - FIRST_LAYERS) * s);
    double scale = layer == mesh->layers ? TLI_SHELLS_HALF_SIDE
                                         : exp(t * log(TLI_SHELLS_HALF_SIDE * length)) / length;
    for (int axis = 0; axis < 3; axis++) xyz[axis] = (float)(scale * ray[axis]);
}

static void shells_tets(const tli_sample_mesh *mesh, uint64_t begin, uint64_t end,
                        uint64_t (*tets)[4])
{
    uint32_t squares = 6 * mesh->side * mesh->side;
    uint64_t cell = UINT64_MAX, first = 0;
    tl_lidx local[TLI_SPLIT_MAX][4];
    for (uint64_t t = begin; t < end; t++, tets++) {
        if (t / 6 != cell) {
            cell = t / 6;
            tl_lidx corners[8]; /* numbers in the layers below and above */
            surface_square(mesh->side, (uint32_t)(cell % squares), corners);
            for (int c = 0; c < 4; c++) corners[4 + c] = corners[c] + squares + 2;
            tli_split_cell(TLI_SHAPE_HEXAHEDRON, corners, local, NULL);
            first = cell / squares * (squares + 2);
        }
        for (int v = 0; v < 4; v++) (*tets)[v] = first + local[t % 6][v];
    }
}

/* ---- both ---- */

void tli_sample_point(const tli_sample_mesh *mesh, uint64_t vert, float xyz[3])
{
    if (mesh->kind == TLI_SAMPLE_GRID)
        grid_point(mesh, vert, xyz);
    else
        shells_point(mesh, vert, xyz);
}

void tli_sample_tets(const tli_sample_mesh *mesh, uint64_t begin, uint64_t end, uint64_t (*tets)[4])
{
    if (mesh->kind == TLI_SAMPLE_GRID)
        grid_tets(mesh, begin, end, tets);
    else
        shells_tets(mesh, begin, end, tets);
}
