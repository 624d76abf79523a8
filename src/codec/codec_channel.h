/* Channels: what coder and decoder agree on beside the numbers. */
#ifndef TETRALOD_SRC_CODEC_CHANNEL_H
#define TETRALOD_SRC_CODEC_CHANNEL_H

#include "codec/codec_kin.h"
#include "codec/codec_model.h"

/* Bits of the second byte of a channel's blob. */
#define CHANNEL_CONSTANT 1u  /* one value [components] of 8 bytes each follows, no stream */
#define CHANNEL_NONFINITE 2u /* each value is preceded by what it is */
#define CHANNEL_WIDE 4u      /* raw: 8 bytes a value, else 4 */
#define CHANNEL_HEAD_BYTES 2u

/* What a value is, where some are not finite: 0 finite, else the reserved image less INT64_MIN,
 * plus 1. */
#define VALUE_FINITE 0u
#define VALUE_OTHER_COUNT 3u

static inline uint32_t channel_value_kind(int64_t image)
{
    uint64_t above = (uint64_t)image - (uint64_t)INT64_MIN;
    return above < VALUE_OTHER_COUNT ? (uint32_t)above + 1 : VALUE_FINITE;
}

/* How far the scales of a channel's components are known; more components share the last one. */
#define CHANNEL_SCALES 16u

static inline uint32_t channel_scale(uint32_t component)
{
    return component < CHANNEL_SCALES ? component : CHANNEL_SCALES - 1;
}

/* What is expected of one component, and bits of the extent of what that was made of. */
typedef struct tli_expected {
    int64_t value;
    uint32_t around;
} tli_expected;

/* Elder elements of an element, and how much each says about it: start - slope . x, with x of a
 * vertex where it lies beside the one that is to be told. One may be there several times. */
#define ELDERS_MAX (4 * VALUE_KIN_MAX)
typedef struct tli_elders {
    uint32_t count;
    uint32_t element[ELDERS_MAX];
    double x[ELDERS_MAX][3];
    double start, slope[3];
} tli_elders;

/* Those of a vertex, weighted so that a linear function is met, or of a tet. */
void tli_kin_elders(const tli_kin *kin, const int64_t (*places)[3], uint32_t vertex,
                    tli_elders *elders);
void tli_tet_elders(const tl_patch *patch, uint32_t tet, tli_elders *elders);
/* One component out of values [element][components]; previous is what to expect without elders.
 * finite: all values are. */
tli_expected tli_elders_expect(const tli_elders *elders, const int64_t *values, uint32_t components,
                               uint32_t component, int64_t previous, bool finite);

#endif
