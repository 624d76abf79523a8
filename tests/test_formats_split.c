/* Cells to tets: every order of the indices of every shape, by brute force. */
#include "check.h"

#include "base/base_predicates.h"
#include "formats/formats_split.h"

/* Convex cells in VTK's order, with corners in general position on their planes: no symmetry hides
 * a mistake, and faces with four corners are flat, so that any cut of them is right. */
static const double cube[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                  {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
static const double voxel[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                   {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
static const double frustum[8][3] = {{-4, -3, 0},   {4, -3, 0},   {4, 3, 0},   {-4, 3, 0},
                                     {-2, -1.5, 2}, {2, -1.5, 2}, {2, 1.5, 2}, {-2, 1.5, 2}};
static const double wedge[6][3] = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0},
                                   {0, 0, 2}, {0, 1, 2}, {1, 0, 2}};
static const double pyramid[5][3] = {{0, 0, 0}, {2, 0, 0}, {3, 2, 0}, {0, 1, 0}, {1, 1, 3}};
static const double tetra[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/* Faces for the check, written apart from those of the code; sets of corners, in cyclic order. */
static const int cube_faces[6][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                     {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
static const int voxel_faces[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                      {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
static const int wedge_faces[5][4] = {
    {0, 1, 2, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}};
static const int pyramid_faces[5][4] = {
    {0, 1, 2, 3}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}};
static const int tetra_faces[4][4] = {{0, 1, 2, -1}, {0, 1, 3, -1}, {0, 2, 3, -1}, {1, 2, 3, -1}};

typedef struct solid {
    tli_shape shape;
    int corner_count, face_count;
    const double (*at)[3];
    const int (*faces)[4];
    double volume;
} solid;
static const solid solids[] = {
    {TLI_SHAPE_HEXAHEDRON, 8, 6, cube, cube_faces, 1},
    {TLI_SHAPE_HEXAHEDRON, 8, 6, frustum, cube_faces, 56},
    {TLI_SHAPE_VOXEL, 8, 6, voxel, voxel_faces, 1},
    {TLI_SHAPE_WEDGE, 6, 5, wedge, wedge_faces, 1},
    {TLI_SHAPE_PYRAMID, 5, 5, pyramid, pyramid_faces, 3.5},
    {TLI_SHAPE_TETRA, 4, 4, tetra, tetra_faces, 1.0 / 6},
};

typedef struct triangle_set {
    tl_lidx verts[24][3]; /* ascending */
    int times[24];
    int count;
} triangle_set;

static void sort3(tl_lidx v[3])
{
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 2; i++)
            if (v[i] > v[i + 1]) {
                tl_lidx swap = v[i];
                v[i] = v[i + 1];
                v[i + 1] = swap;
            }
}

static int find(const triangle_set *set, tl_lidx a, tl_lidx b, tl_lidx c)
{
    tl_lidx v[3] = {a, b, c};
    sort3(v);
    for (int i = 0; i < set->count; i++)
        if (memcmp(set->verts[i], v, sizeof v) == 0) return i;
    return -1;
}

static void add(triangle_set *set, tl_lidx a, tl_lidx b, tl_lidx c)
{
    int at = find(set, a, b, c);
    if (at < 0) {
        at = set->count++;
        tl_lidx v[3] = {a, b, c};
        sort3(v);
        memcpy(set->verts[at], v, sizeof v);
        set->times[at] = 0;
    }
    set->times[at]++;
}

/* The triangles that the faces of the solid must be cut into, each once. */
static void add_faces(const solid *s, const tl_lidx *ids, triangle_set *set)
{
    for (int f = 0; f < s->face_count; f++) {
        const int *face = s->faces[f];
        if (face[3] < 0) {
            add(set, ids[face[0]], ids[face[1]], ids[face[2]]);
            continue;
        }
        int low = 0;
        for (int i = 1; i < 4; i++)
            if (ids[face[i]] < ids[face[low]]) low = i;
        add(set, ids[face[low]], ids[face[(low + 1) % 4]], ids[face[(low + 2) % 4]]);
        add(set, ids[face[low]], ids[face[(low + 2) % 4]], ids[face[(low + 3) % 4]]);
    }
}

static void check_split(const solid *s, const tl_lidx *ids, unsigned *five)
{
    tl_lidx tets[TLI_SPLIT_MAX][4];
    unsigned repeated = 7, count = tli_split_cell(s->shape, ids, tets, &repeated);
    CHECK_EQ(repeated, 0);
    CHECK(count >= 1 && count <= TLI_SPLIT_MAX);
    *five += count == 5;
    int corner_of[8] = {0};
    for (int i = 0; i < s->corner_count; i++) corner_of[ids[i]] = i;
    double volume = 0;
    triangle_set inside = {.count = 0}, outside = {.count = 0};
    for (unsigned i = 0; i < count; i++) {
        const double *p[4];
        for (int v = 0; v < 4; v++) p[v] = s->at[corner_of[tets[i][v]]];
        CHECK_EQ(tli_orient3d(p[0], p[1], p[2], p[3]), 1);
        volume += tli_orient3d_approx(p[0], p[1], p[2], p[3]) / 6;
        for (int f = 0; f < 4; f++)
            add(&inside, tets[i][(f + 1) & 3], tets[i][(f + 2) & 3], tets[i][(f + 3) & 3]);
    }
    CHECK_NEAR(volume, s->volume, 1e-12 * s->volume);
    add_faces(s, ids, &outside);
    for (int i = 0; i < outside.count; i++) { /* the cut of each face is the one of the rule */
        int at = find(&inside, outside.verts[i][0], outside.verts[i][1], outside.verts[i][2]);
        CHECK(at >= 0);
        CHECK_EQ(inside.times[at], 1);
    }
    int alone = 0;
    for (int i = 0; i < inside.count; i++) {
        CHECK(inside.times[i] <= 2);
        alone += inside.times[i] == 1;
    }
    CHECK_EQ(alone, outside.count); /* every other face of a tet has a tet on both sides */
}

/* All orders of 0 .. count - 1, by Heap's exchanges. */
static unsigned check_all_orders(const solid *s, unsigned *five)
{
    tl_lidx ids[8];
    int used[8] = {0};
    unsigned orders = 0;
    for (int i = 0; i < s->corner_count; i++) ids[i] = (tl_lidx)i;
    check_split(s, ids, five);
    orders++;
    for (int i = 0; i < s->corner_count;) {
        if (used[i] >= i) {
            used[i++] = 0;
            continue;
        }
        int with = i & 1 ? used[i] : 0;
        tl_lidx swap = ids[with];
        ids[with] = ids[i];
        ids[i] = swap;
        check_split(s, ids, five);
        orders++;
        used[i]++;
        i = 0;
    }
    return orders;
}

static void test_every_order_of_indices(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof solids / sizeof solids[0]; i++) {
        unsigned five = 0, orders = check_all_orders(&solids[i], &five), factorial = 1;
        for (unsigned f = 2; f <= (unsigned)solids[i].corner_count; f++) factorial *= f;
        CHECK_EQ(orders, factorial);
        if (solids[i].corner_count == 8) {
            printf("hexahedron: %u of %u orders give five tets\n", five, orders);
            CHECK(five > 0 && five < orders);
        } else {
            CHECK_EQ(five, 0);
        }
    }
}

/* A hexahedron whose corners are one and the same where the map says so. */
typedef struct collapse {
    const char *what;
    int map[8];
    double volume;
} collapse;
static const collapse collapses[] = {
    {"two edges: a wedge", {0, 1, 2, 3, 4, 4, 7, 7}, 1.0 / 2},
    {"upright edges: a wedge", {0, 1, 2, 0, 4, 5, 6, 4}, 1.0 / 2},
    {"top to a point: a pyramid", {0, 1, 2, 3, 4, 4, 4, 4}, 1.0 / 3},
    {"a tetrahedron", {0, 1, 2, 2, 4, 4, 4, 4}, 1.0 / 6},
    {"all one point", {0, 0, 0, 0, 0, 0, 0, 0}, 0},
};

static void test_collapsed_hexahedra(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof collapses / sizeof collapses[0]; k++) {
        const collapse *c = &collapses[k];
        for (unsigned shift = 0; shift < 8; shift++) { /* another corner is the smallest */
            tl_lidx ids[8], tets[TLI_SPLIT_MAX][4];
            for (int i = 0; i < 8; i++) ids[i] = ((tl_lidx)c->map[i] + shift) % 8;
            unsigned repeated, count = tli_split_cell(TLI_SHAPE_HEXAHEDRON, ids, tets, &repeated);
            CHECK(count + repeated <= TLI_SPLIT_MAX);
            double volume = 0;
            for (unsigned i = 0; i < count; i++) {
                const double *p[4];
                for (int v = 0; v < 4; v++) p[v] = cube[(tets[i][v] + 8 - shift) % 8];
                CHECK_EQ(tli_orient3d(p[0], p[1], p[2], p[3]), 1);
                volume += tli_orient3d_approx(p[0], p[1], p[2], p[3]) / 6;
            }
            if (fabs(volume - c->volume) > 1e-12)
                fail_msg("%s, shift %u: volume %g, expected %g", c->what, shift, volume, c->volume);
        }
    }
}

static void corner_at(unsigned c, double p[3])
{
    p[0] = c & 1, p[1] = c >> 1 & 1, p[2] = c >> 2;
}

static double structured_volume(const uint8_t (*table)[4], unsigned count)
{
    double sum = 0;
    for (unsigned i = 0; i < count; i++) {
        double p[4][3];
        for (int v = 0; v < 4; v++) corner_at(table[i][v], p[v]);
        CHECK_EQ(tli_orient3d(p[0], p[1], p[2], p[3]), 1);
        sum += tli_orient3d_approx(p[0], p[1], p[2], p[3]) / 6;
    }
    return sum;
}

/* True when two tets of the table together hold the edge a - b of a face. */
static bool has_edge(const uint8_t (*table)[4], unsigned count, unsigned a, unsigned b)
{
    for (unsigned i = 0; i < count; i++) {
        bool has_a = false, has_b = false;
        for (int v = 0; v < 4; v++) has_a |= table[i][v] == a, has_b |= table[i][v] == b;
        if (has_a && has_b) return true;
    }
    return false;
}

static void test_structured_tables(void **state)
{
    (void)state;
    CHECK_NEAR(structured_volume(tli_split_five[0], 5), 1, 1e-15);
    CHECK_NEAR(structured_volume(tli_split_five[1], 5), 1, 1e-15);
    CHECK_NEAR(structured_volume(tli_split_six, 6), 1, 1e-15);
    for (unsigned axis = 0; axis < 3;
         axis++) { /* the cut of a far face is that of the next near one */
        unsigned far = 1u << axis, u = 1u << ((axis + 1) % 3), v = 1u << ((axis + 2) % 3);
        for (int parity = 0; parity < 2; parity++) {
            CHECK_EQ(has_edge(tli_split_five[parity], 5, far, far + u + v),
                     has_edge(tli_split_five[1 - parity], 5, 0, u + v));
            CHECK_EQ(has_edge(tli_split_five[parity], 5, far + u, far + v),
                     has_edge(tli_split_five[1 - parity], 5, u, v));
            CHECK_EQ(has_edge(tli_split_five[parity], 5, 0, u + v) +
                         has_edge(tli_split_five[parity], 5, u, v),
                     1);
        }
        CHECK_EQ(has_edge(tli_split_six, 6, far, far + u + v), 1);
        CHECK_EQ(has_edge(tli_split_six, 6, 0, u + v), 1);
    }
}

static void test_kinds(void **state)
{
    (void)state;
    unsigned with_shape = 0;
    for (unsigned type = 0; type < 256; type++) {
        tli_cell_type cell = tli_cell_type_of((uint8_t)type);
        CHECK((unsigned)cell.kind < TL_CELL_KIND_COUNT);
        CHECK((cell.shape == TLI_SHAPE_NONE) == (cell.kind >= TL_CELL_SURFACE));
        if (cell.points) CHECK(cell.points >= tli_shape_corners(cell.shape));
        with_shape += cell.shape != TLI_SHAPE_NONE;
    }
    CHECK_EQ(with_shape, 29);
    CHECK_EQ(tli_cell_type_of(11).shape, TLI_SHAPE_VOXEL);
    CHECK_EQ(tli_cell_type_of(24).points, 10);
    for (int kind = 0; kind < TL_CELL_KIND_COUNT; kind++)
        CHECK(strcmp(tl_cell_kind_name((tl_cell_kind)kind), "unknown") != 0);
    assert_string_equal(tl_cell_kind_name(TL_CELL_KIND_COUNT), "unknown");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_order_of_indices),
        cmocka_unit_test(test_collapsed_hexahedra),
        cmocka_unit_test(test_structured_tables),
        cmocka_unit_test(test_kinds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
