/* The head of a topology blob, and what coder and decoder share of the parts that follow the
 * connectivity. */
#ifndef TETRALOD_SRC_CODEC_TOPOLOGY_H
#define TETRALOD_SRC_CODEC_TOPOLOGY_H

#include "codec/codec_model.h"

/* Kind, flags, vertices (2 bytes), tets (3), tets with a vertex twice (3), little endian. */
#define TOPOLOGY_HEAD_BYTES 10u

/* Places have powers of two in common along each axis: index 0 inner, 1 shared vertices. They are
 * counted from the place of vertex 0. */
typedef struct tli_shifts {
    uint8_t by[2][3];
} tli_shifts;

/* value / 2^shift, rounded to the nearest. */
static inline int64_t topology_shifted(int64_t value, uint32_t shift)
{
    if (!shift) return value;
    uint64_t half = (uint64_t)value + (UINT64_C(1) << (shift - 1));
    /* Downwards, also below 0. */
    return (int64_t)(half >> shift | (half >> 63 ? ~(UINT64_MAX >> shift) : 0));
}

/* Bits of a place that is not predicted. */
static inline uint32_t topology_place_bits(const tl_lattice *lattice)
{
    return lattice->kind == TL_PLACE_FLOAT64 ? 64 : 32;
}

/* Image of a place from that many bits. */
static inline int64_t topology_place_of(const tl_lattice *lattice, uint64_t bits)
{
    return lattice->kind == TL_PLACE_FLOAT32 ? (int64_t)(bits ^ 0x80000000u) - 0x80000000
                                             : (int64_t)bits;
}

static inline bool topology_is_outside(const tl_lattice *lattice, int64_t place)
{
    if (lattice->kind == TL_PLACE_FLOAT64) return false;
    return lattice->kind == TL_PLACE_FLOAT32 ? place != (int32_t)(uint32_t)(uint64_t)place
                                             : (uint64_t)place > UINT32_MAX;
}

/* The row of a guess's mode; of a guess without elder there is none. */
static inline uint32_t topology_mode_row(uint32_t kin_count, uint32_t mode_before)
{
    uint32_t kin = kin_count < MODE_KIN ? kin_count - 1 : MODE_KIN - 1;
    return ROW_MODE + kin * RANS_SYMBOLS + mode_before;
}

/* Region ids that were last, the latest first. */
typedef struct tli_regions {
    int32_t recent[REGION_RECENT];
} tli_regions;

/* The region that is expected of a tet: that of its eldest neighbour; row: how sure that is. */
int32_t tli_region_guess(const tl_patch *patch, uint32_t tet, uint32_t *row);
/* Moves region to the front; index is its place or REGION_RECENT. */
static inline void regions_use(tli_regions *regions, uint32_t index, int32_t region)
{
    if (index == REGION_RECENT) index--;
    for (; index > 0; index--) regions->recent[index] = regions->recent[index - 1];
    regions->recent[0] = region;
}

#endif
