/* Stage model, internal: partitions of space. The patches of a level are its segments cut by the
 * cells that its consumers will be, so a cell has to be known before the mesh it will hold: cells
 * are made of samples of the level below, which is denser by about the same factor everywhere. */
#ifndef TETRALOD_SRC_MODEL_CELLS_H
#define TETRALOD_SRC_MODEL_CELLS_H

#include "mesh/mesh.h"

/* Where some tets of a patch lie, evenly through it, and the mean shape of these: the sum of the
 * products of an edge's components, xx yy zz xy xz yz, by the tet's size. */
enum { TLI_SAMPLES = 16 };
typedef struct tli_sampling {
    double at[TLI_SAMPLES][3], shape[6];
} tli_sampling;
/* Of the tets [count] named in list. */
void tli_sampling_set(const double *xyz, const tl_lidx *tets, const tl_lidx *list, size_t count,
                      tli_sampling *sampling);

struct tli_model;
typedef struct tli_cells tli_cells;
/* The cells that cut what the segments of a level make of its patches [first, end); ratio of their
 * tets will be left. Gives *cells: NULL where one cell is all, or where patches are not cut by
 * cells. */
tl_status tli_cells_create(const struct tli_model *model, uint32_t level, size_t first, size_t end,
                           double ratio, tli_cells **cells);
void tli_cells_destroy(tli_cells *cells);
/* The cell of each tet of a mesh, by its centroid: cell_of [tet_count]. Any thread. */
tl_status tli_cells_find(tl_ctx *ctx, const tli_cells *cells, const tl_mesh *mesh,
                         uint32_t *cell_of);

/* ---- model_voronoi.c ---- */
/* Cells around seeds, each with a distance of its own. */
typedef struct tli_seed {
    double at[3];
    double metric[6]; /* of squared distances: xx yy zz xy xz yz */
} tli_seed;
/* Seeds [count] so that all hold about the same number of samples; weights [patch_count] of a
 * patch's samples. Gives *seeds. */
tl_status tli_voronoi_create(tl_ctx *ctx, const tli_sampling *const *samplings,
                             const double *weights, size_t patch_count, size_t count,
                             tli_seed **seeds);
/* The nearest seed of each of the points [point_count]; near: room for count numbers. */
void tli_voronoi_find(const tli_seed *seeds, size_t count, const double (*points)[3],
                      size_t point_count, uint32_t *near, uint32_t *cell_of);

#endif
