/* Stage formats, internal: the meshes of the samples. Each vertex and tet follows from its number
 * alone, so that a file of any size is made piece by piece. */
#ifndef TETRALOD_SRC_FORMATS_SAMPLE_H
#define TETRALOD_SRC_FORMATS_SAMPLE_H

#include "tetralod/formats.h"

typedef enum tli_sample_kind {
    TLI_SAMPLE_GRID = 0, /* regular over [-1, 1]^3, five tets a cell by parity */
    TLI_SAMPLE_SHELLS    /* from the unit sphere to a cube, six tets a cell */
} tli_sample_kind;

/* The cube that the shells end at is [-this, this]^3. */
#define TLI_SHELLS_HALF_SIDE 10

typedef struct tli_sample_mesh {
    tli_sample_kind kind;
    uint32_t side;   /* grid: vertices along a side; shells: cells along an edge of the cube */
    uint32_t layers; /* of shells */
    uint64_t vert_count, tet_count;
} tli_sample_mesh;

/* The mesh of that kind nearest to size^3 vertices. false: size is too small or too large for it.
 */
bool tli_sample_mesh_init(tli_sample_mesh *mesh, tli_sample_kind kind, uint32_t size);
/* Position of a vertex, as the file holds it. */
void tli_sample_point(const tli_sample_mesh *mesh, uint64_t vert, float xyz[3]);
/* Vertices of tets [begin, end). */
void tli_sample_tets(const tli_sample_mesh *mesh, uint64_t begin, uint64_t end,
                     uint64_t (*tets)[4]);

#endif
