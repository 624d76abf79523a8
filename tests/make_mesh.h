/* Meshes for tests, made from a size and a seed: a regular grid of five tets a cell by parity,
 * perturbed, shuffled, with two regions, with a cavity, a soup. Plain malloc, so that a test's own
 * memory never disturbs the counts of the context it tests. */
#ifndef TETRALOD_TESTS_MAKE_MESH_H
#define TETRALOD_TESTS_MAKE_MESH_H

#include "tetralod/mesh.h"

#include "check.h"

typedef struct make_mesh {
    double *xyz; /* [vert_count][3] */
    size_t vert_count;
    tl_lidx *tets; /* [tet_count][4] */
    size_t tet_count;
    int32_t *regions; /* [tet_count] or NULL */
} make_mesh;

typedef double (*make_field)(const double x[3]);

/* splitmix64 */
static inline uint64_t make_random(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* In [0, 1). */
static inline double make_uniform(uint64_t *state)
{
    return (double)(make_random(state) >> 11) * 0x1p-53;
}

static inline void make_release(make_mesh *m)
{
    free(m->xyz);
    free(m->tets);
    free(m->regions);
    memset(m, 0, sizeof *m);
}

/* Room for the given counts, at least one each. */
static inline make_mesh make_room(size_t vert_count, size_t tet_count)
{
    make_mesh m = {0};
    m.xyz = calloc(vert_count + 1, 3 * sizeof *m.xyz);
    m.tets = calloc(tet_count + 1, 4 * sizeof *m.tets);
    m.vert_count = vert_count;
    m.tet_count = tet_count;
    if (!m.xyz || !m.tets) abort();
    return m;
}

/* n^3 vertices (n >= 2) over the unit cube, x fastest; five positive tets a cell, mirrored from
 * cell to cell so that they conform. With cavity, the cells of the middle third (each axis) are
 * missing; their inner vertices stay and are then of no tet. */
static inline make_mesh make_grid_with(size_t n, bool cavity)
{
    static const uint8_t split[2][5][4] = {
        {{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}},
        {{1, 3, 0, 5}, {2, 0, 3, 6}, {4, 6, 5, 0}, {7, 5, 6, 3}, {0, 5, 3, 6}}};
    size_t cells = n - 1;
    make_mesh m = make_room(n * n * n, 5 * cells * cells * cells);
    for (size_t v = 0; v < m.vert_count; v++) {
        m.xyz[3 * v] = (double)(v % n) / (double)cells;
        m.xyz[3 * v + 1] = (double)(v / n % n) / (double)cells;
        m.xyz[3 * v + 2] = (double)(v / n / n) / (double)cells;
    }
    size_t low = cells / 3, high = cells - low, tet = 0;
    for (size_t cell = 0; cell < cells * cells * cells; cell++) {
        size_t i = cell % cells, j = cell / cells % cells, k = cell / cells / cells;
        if (cavity && i >= low && i < high && j >= low && j < high && k >= low && k < high)
            continue;
        for (int s = 0; s < 5; s++, tet++) {
            for (int c = 0; c < 4; c++) {
                size_t corner = split[(i + j + k) & 1][s][c];
                m.tets[4 * tet + (size_t)c] =
                    (tl_lidx)((i + (corner & 1)) +
                              n * ((j + (corner >> 1 & 1)) + n * (k + (corner >> 2))));
            }
        }
    }
    m.tet_count = tet;
    return m;
}

static inline make_mesh make_grid(size_t n)
{
    return make_grid_with(n, false);
}

static inline make_mesh make_grid_cavity(size_t n)
{
    return make_grid_with(n, true);
}

/* Region 1 for tets whose centroid has x < 1/2, else 2. */
static inline void make_two_regions(make_mesh *m)
{
    m->regions = calloc(m->tet_count + 1, sizeof *m->regions);
    if (!m->regions) abort();
    for (size_t t = 0; t < m->tet_count; t++) {
        double sum = 0;
        for (size_t c = 0; c < 4; c++) sum += m->xyz[3 * (size_t)m->tets[4 * t + c]];
        m->regions[t] = sum / 4 < 0.5 ? 1 : 2;
    }
}

/* Moves every coordinate by up to amount in both directions. Below 0.1 of a cell's edge the tets of
 * make_grid stay positive. */
static inline void make_perturb(make_mesh *m, double amount, uint64_t seed)
{
    for (size_t i = 0; i < 3 * m->vert_count; i++)
        m->xyz[i] += amount * (2 * make_uniform(&seed) - 1);
}

/* Random order of the vertices, of the tets, and of the corners in a tet (even permutations). */
static inline void make_shuffle(make_mesh *m, uint64_t seed)
{
    tl_lidx *place = malloc((m->vert_count + 1) * sizeof *place);
    double *xyz = malloc((3 * m->vert_count + 1) * sizeof *xyz);
    if (!place || !xyz) abort();
    for (size_t v = 0; v < m->vert_count; v++) place[v] = (tl_lidx)v;
    for (size_t v = m->vert_count; v > 1; v--) {
        size_t other = (size_t)(make_random(&seed) % v);
        tl_lidx kept = place[v - 1];
        place[v - 1] = place[other];
        place[other] = kept;
    }
    for (size_t v = 0; v < m->vert_count; v++)
        for (size_t k = 0; k < 3; k++) xyz[3 * (size_t)place[v] + k] = m->xyz[3 * v + k];
    free(m->xyz);
    m->xyz = xyz;
    for (size_t i = 0; i < 4 * m->tet_count; i++) m->tets[i] = place[m->tets[i]];
    free(place);
    for (size_t t = m->tet_count; t > 0; t--) {
        size_t other = (size_t)(make_random(&seed) % t), turn = (size_t)(make_random(&seed) % 3);
        tl_lidx kept[4], *a = m->tets + 4 * (t - 1), *b = m->tets + 4 * other;
        memcpy(kept, a, sizeof kept);
        memmove(a, b, sizeof kept);
        memcpy(b, kept, sizeof kept);
        memcpy(kept, a, sizeof kept);
        for (size_t c = 0; c < 3; c++) a[c] = kept[(c + turn) % 3];
        if (m->regions) {
            int32_t region = m->regions[t - 1];
            m->regions[t - 1] = m->regions[other];
            m->regions[other] = region;
        }
    }
}

/* tet_count tets of four different random vertices (vert_count >= 4): everything is non-manifold.
 */
static inline make_mesh make_soup(size_t vert_count, size_t tet_count, uint64_t seed)
{
    make_mesh m = make_room(vert_count, tet_count);
    for (size_t i = 0; i < 3 * vert_count; i++) m.xyz[i] = make_uniform(&seed);
    for (size_t t = 0; t < tet_count; t++) {
        tl_lidx *tet = m.tets + 4 * t;
        for (size_t c = 0; c < 4; c++) {
            bool used = true;
            while (used) {
                tet[c] = (tl_lidx)(make_random(&seed) % vert_count);
                used = false;
                for (size_t d = 0; d < c; d++) used = used || tet[d] == tet[c];
            }
        }
    }
    return m;
}

/* A soup in which every seventh tet names a vertex twice and a place is no number. */
static inline make_mesh make_wreck(size_t vert_count, size_t tet_count, uint64_t seed)
{
    make_mesh m = make_soup(vert_count, tet_count, seed);
    for (size_t t = 0; t < m.tet_count; t += 7) m.tets[4 * t + 1] = m.tets[4 * t];
    m.xyz[30] = (double)NAN;
    return m;
}

/* The mesh object, with the field as channel "f" on the vertices if it is not NULL. */
static inline tl_mesh *make_object(tl_ctx *ctx, const make_mesh *m, make_field field)
{
    tl_mesh *mesh = NULL;
    CHECK_OK(ctx, tl_mesh_create(ctx, m->xyz, m->vert_count, m->tets, m->tet_count, &mesh));
    if (m->regions) CHECK_OK(ctx, tl_mesh_set_regions(mesh, m->regions));
    if (field) {
        double *values = malloc((m->vert_count + 1) * sizeof *values);
        if (!values) abort();
        for (size_t v = 0; v < m->vert_count; v++) values[v] = field(m->xyz + 3 * v);
        tl_channel channel = {"f", "", 1, TL_ON_VERTEX, TL_F64, values};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        free(values);
    }
    return mesh;
}

#endif
