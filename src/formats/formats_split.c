/* Cells to tets, by indices alone. A cell is cut from its smallest vertex: each triangle of the
 * faces that do not hold it becomes a tet with it. A face with four corners is cut from its own
 * smallest vertex, which for the faces at the smallest vertex of the cell follows by itself. So the
 * cut of a face depends on its ids alone, and neighbours agree.
 *
 * For wedges, pyramids and hexahedra this gives the subdivisions of Dompierre, Labbe, Vallet and
 * Camarero, "How to subdivide pyramids, prisms and hexahedra into tetrahedra" (1999), with one rule
 * in place of their tables. As there, a hexahedron none of whose three far diagonals ends at the
 * corner opposite the smallest one is cut into five tets, else into six. */
#include "formats/formats_split.h"

/* ---- kinds ---- */

const char *tl_cell_kind_name(tl_cell_kind kind)
{
    static const char *const names[TL_CELL_KIND_COUNT] = {
        [TL_CELL_TETRA] = "tetra",
        [TL_CELL_HEXAHEDRON] = "hexahedron",
        [TL_CELL_VOXEL] = "voxel",
        [TL_CELL_WEDGE] = "wedge",
        [TL_CELL_PYRAMID] = "pyramid",
        [TL_CELL_QUADRATIC_TETRA] = "quadratic_tetra",
        [TL_CELL_QUADRATIC_HEXAHEDRON] = "quadratic_hexahedron",
        [TL_CELL_TRIQUADRATIC_HEXAHEDRON] = "triquadratic_hexahedron",
        [TL_CELL_QUADRATIC_WEDGE] = "quadratic_wedge",
        [TL_CELL_QUADRATIC_PYRAMID] = "quadratic_pyramid",
        [TL_CELL_POLYHEDRON] = "polyhedron",
        [TL_CELL_PRISM] = "prism",
        [TL_CELL_SURFACE] = "surface",
        [TL_CELL_LINE] = "line",
        [TL_CELL_POINT] = "point",
        [TL_CELL_OTHER] = "other",
    };
    return (unsigned)kind < TL_CELL_KIND_COUNT ? names[kind] : "unknown";
}

tli_cell_type tli_cell_type_of(uint8_t vtk_type)
{
#define CELL(kind, shape, points)                                                                  \
    (tli_cell_type)                                                                                \
    {                                                                                              \
        TL_CELL_##kind, TLI_SHAPE_##shape, points                                                  \
    }
    switch (vtk_type) {
    case 1: /* vertex */
    case 2: /* poly vertex */ return CELL(POINT, NONE, 0);
    case 3:  /* line */
    case 4:  /* poly line */
    case 21: /* quadratic edge */
    case 35: /* cubic line */
    case 51: /* parametric curve */
    case 60: /* edge of higher order */
    case 68: /* Lagrange curve */
    case 75: /* Bezier curve */ return CELL(LINE, NONE, 0);
    case 5:  /* triangle */
    case 6:  /* triangle strip */
    case 7:  /* polygon */
    case 8:  /* pixel */
    case 9:  /* quad */
    case 22: /* quadratic triangle */
    case 23: /* quadratic quad */
    case 28: /* biquadratic quad */
    case 30: /* quadratic linear quad */
    case 34: /* biquadratic triangle */
    case 36: /* quadratic polygon */
    case 52: /* parametric surfaces */
    case 53:
    case 54:
    case 61: /* triangle, quad, polygon of higher order */
    case 62:
    case 63:
    case 69: /* Lagrange triangle, quad */
    case 70:
    case 76: /* Bezier triangle, quad */
    case 77: return CELL(SURFACE, NONE, 0);
    case TLI_VTK_TETRA: return CELL(TETRA, TETRA, 4);
    case 11: return CELL(VOXEL, VOXEL, 8);
    case 12: return CELL(HEXAHEDRON, HEXAHEDRON, 8);
    case 13: return CELL(WEDGE, WEDGE, 6);
    case 14: return CELL(PYRAMID, PYRAMID, 5);
    case 15: return CELL(PRISM, PENTAGONAL_PRISM, 10);
    case 16: return CELL(PRISM, HEXAGONAL_PRISM, 12);
    case 24: return CELL(QUADRATIC_TETRA, TETRA, 10);
    case 25: return CELL(QUADRATIC_HEXAHEDRON, HEXAHEDRON, 20);
    case 26: return CELL(QUADRATIC_WEDGE, WEDGE, 15);
    case 27: return CELL(QUADRATIC_PYRAMID, PYRAMID, 13);
    case 29: return CELL(TRIQUADRATIC_HEXAHEDRON, HEXAHEDRON, 27);
    case 31: return CELL(QUADRATIC_WEDGE, WEDGE, 12);           /* quadratic along two axes */
    case 32: return CELL(QUADRATIC_WEDGE, WEDGE, 18);           /* with centres of quads */
    case 33: return CELL(QUADRATIC_HEXAHEDRON, HEXAHEDRON, 24); /* with centres of four quads */
    case 37: return CELL(QUADRATIC_PYRAMID, PYRAMID, 19);
    case TLI_VTK_POLYHEDRON: return CELL(POLYHEDRON, POLYHEDRON, 0);
    case 64: /* of higher order, Lagrange, Bezier: the corners come first in all of them */
    case 71:
    case 78: return CELL(QUADRATIC_TETRA, TETRA, 0);
    case 65:
    case 73:
    case 80: return CELL(QUADRATIC_WEDGE, WEDGE, 0);
    case 66:
    case 74:
    case 81: return CELL(QUADRATIC_PYRAMID, PYRAMID, 0);
    case 67:
    case 72:
    case 79: return CELL(QUADRATIC_HEXAHEDRON, HEXAHEDRON, 0);
    default: return CELL(OTHER, NONE, 0);
    }
#undef CELL
}

/* ---- structured cells ---- */

const uint8_t tli_split_five[2][5][4] = {
    {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 1, 4, 7}, {6, 4, 2, 7}},
    {{0, 5, 3, 6}, {1, 3, 0, 5}, {2, 0, 3, 6}, {4, 5, 0, 6}, {7, 3, 5, 6}},
};
const uint8_t tli_split_six[6][4] = {
    {0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7},
};

/* ---- shapes ---- */

#define NO 0xff /* fourth corner of a triangle */

/* Faces run counterclockwise seen from outside. */
typedef struct shape_faces {
    uint8_t corner_count, face_count;
    uint8_t faces[6][4];
} shape_faces;

static const shape_faces shapes[] = {
    [TLI_SHAPE_TETRA] = {4, 4, {{0, 2, 1, NO}, {0, 1, 3, NO}, {1, 2, 3, NO}, {2, 0, 3, NO}}},
    [TLI_SHAPE_PYRAMID] =
        {5, 5, {{0, 3, 2, 1}, {0, 1, 4, NO}, {1, 2, 4, NO}, {2, 3, 4, NO}, {3, 0, 4, NO}}},
    [TLI_SHAPE_WEDGE] = {6,
                         5,
                         {{0, 1, 2, NO}, {3, 5, 4, NO}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}}},
    [TLI_SHAPE_HEXAHEDRON] =
        {8,
         6,
         {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}},
};

/* Hexahedron: the corner across, and the three neighbours of a corner, such that (corner, first,
 * second) and so on run counterclockwise seen from outside. */
static const uint8_t hex_across[8] = {6, 7, 4, 5, 2, 3, 0, 1};
static const uint8_t hex_neighbours[8][3] = {{3, 1, 4}, {0, 2, 5}, {1, 3, 6}, {2, 0, 7},
                                             {5, 7, 0}, {6, 4, 1}, {7, 5, 2}, {4, 6, 3}};

unsigned tli_shape_corners(tli_shape shape)
{
    switch (shape) {
    case TLI_SHAPE_NONE:
    case TLI_SHAPE_POLYHEDRON: return 0;
    case TLI_SHAPE_PENTAGONAL_PRISM: return 10;
    case TLI_SHAPE_HEXAGONAL_PRISM: return 12;
    case TLI_SHAPE_VOXEL: return 8;
    default: return shapes[shape].corner_count;
    }
}

/* ---- the cut ---- */

typedef struct cut {
    const tl_lidx *ids;
    tl_lidx (*tets)[4];
    unsigned count, repeated;
} cut;

static void cut_add(cut *c, unsigned a, unsigned b, unsigned d, unsigned e)
{
    tl_lidx i = c->ids[a], j = c->ids[b], k = c->ids[d], l = c->ids[e];
    if (i == j || i == k || i == l || j == k || j == l || k == l) {
        c->repeated++;
        return;
    }
    tl_lidx *tet = c->tets[c->count++];
    tet[0] = i, tet[1] = j, tet[2] = k, tet[3] = l;
}

/* Position of the smallest id among corners [count]. */
static unsigned smallest_of(const tl_lidx *ids, const uint8_t *corners, unsigned count)
{
    unsigned low = 0;
    for (unsigned i = 1; i < count; i++)
        if (ids[corners[i]] < ids[corners[low]]) low = i;
    return low;
}

/* True when none of the three faces around corner far is cut from far or towards it. */
static bool hex_far_corner_is_free(const tl_lidx *ids, unsigned far)
{
    for (unsigned f = 0; f < 6; f++) {
        const uint8_t *face = shapes[TLI_SHAPE_HEXAHEDRON].faces[f];
        unsigned at = 0;
        while (at < 4 && face[at] != far) at++;
        if (at == 4) continue;
        unsigned low = smallest_of(ids, face, 4);
        if (((low + 4 - at) & 1) == 0) return false;
    }
    return true;
}

unsigned tli_split_cell(tli_shape shape, const tl_lidx *ids, tl_lidx tets[TLI_SPLIT_MAX][4],
                        unsigned *repeated)
{
    tl_lidx turned[8];
    if (shape == TLI_SHAPE_VOXEL) {
        static const uint8_t as_hex[8] = {0, 1, 3, 2, 4, 5, 7, 6};
        for (unsigned i = 0; i < 8; i++) turned[i] = ids[as_hex[i]];
        ids = turned;
        shape = TLI_SHAPE_HEXAHEDRON;
    }
    cut c = {.ids = ids, .tets = tets};
    if (repeated) *repeated = 0;
    if (shape == TLI_SHAPE_NONE || shape > TLI_SHAPE_HEXAHEDRON) return 0;
    if (shape == TLI_SHAPE_TETRA) { /* in the order of the file */
        cut_add(&c, 0, 1, 2, 3);
        if (repeated) *repeated = c.repeated;
        return c.count;
    }

    const shape_faces *s = &shapes[shape];
    unsigned apex = 0, far = NO;
    for (unsigned i = 1; i < s->corner_count; i++)
        if (ids[i] < ids[apex]) apex = i;
    if (shape == TLI_SHAPE_HEXAHEDRON && hex_far_corner_is_free(ids, hex_across[apex])) {
        far = hex_across[apex];
        const uint8_t *n = hex_neighbours[far];
        cut_add(&c, apex, n[0], n[1], n[2]);
        cut_add(&c, far, n[0], n[2], n[1]);
    }
    for (unsigned f = 0; f < s->face_count; f++) {
        const uint8_t *face = s->faces[f];
        unsigned size = face[3] == NO ? 3 : 4;
        unsigned first = smallest_of(ids, face, size);
        if (ids[face[first]] == ids[apex]) continue;
        for (unsigned i = 1; i + 1 < size; i++) {
            unsigned a = face[first], b = face[(first + i) % size],
                     d = face[(first + i + 1) % size];
            if (a == far || b == far || d == far) continue; /* already cut off */
            cut_add(&c, apex, a, b, d);
        }
    }
    if (repeated) *repeated = c.repeated;
    return c.count;
}
