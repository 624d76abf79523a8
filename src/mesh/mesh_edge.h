/* Stage mesh, internal: edges as numbers that can be sorted and hashed. */
#ifndef TETRALOD_SRC_MESH_EDGE_H
#define TETRALOD_SRC_MESH_EDGE_H

#include <stdint.h>

/* Both vertices of an edge, the smaller one in the upper half. */
static inline uint64_t tli_edge_key(uint32_t a, uint32_t b)
{
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

#endif
