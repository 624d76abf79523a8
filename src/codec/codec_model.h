/* What coder and decoder agree on: which rows of the tables there are, by which row a symbol is
 * coded, and how numbers become symbols. A change here is a change of the format. */
#ifndef TETRALOD_SRC_CODEC_MODEL_H
#define TETRALOD_SRC_CODEC_MODEL_H

#include "codec/codec.h"
#include "codec/codec_border.h"
#include "codec/codec_rans.h"

/* First byte of a blob: what follows is plain numbers, or a stream of symbols. */
#define BLOB_RAW 0u
#define BLOB_CODED 1u

/* Bits of the second byte of a topology blob. */
#define TOPOLOGY_REGIONS 1u /* there are regions */
#define TOPOLOGY_REMATCH                                                                           \
    2u                      /* faces are paired that the border can't link: their tets turn alike  \
                             */
#define TOPOLOGY_SHIFTED 4u /* places have common powers of two */
#define TOPOLOGY_WIDE 8u    /* raw: 8 bytes a coordinate, else 4 */
#define TOPOLOGY_FLAGS 15u
#define SHIFT_BITS 6u

/* A blob has no more tets than this a byte: hostile counts end here. The encoder fills up with zero
 * bytes where a mesh is so regular that it takes less. */
#define ITEMS_PER_BYTE 1024u

/* What happens at a gate. OP_GROW + mask: a tet whose free vertex is new (mask 0), or is the apex
 * of the faces over the edges of the mask, with which it is glued. */
#define OP_BORDER 0u
#define OP_GROW 1u
#define OP_JOIN 9u  /* a tet with a vertex that is there, glued to none of the three */
#define OP_GLUE 10u /* the tet beyond is there */

/* Numbers are coded by their length in bits beside an expected one. */
#define NUMBER_ROWS 32u
#define NUMBER_ZERO 0u
#define NUMBER_MIDDLE 8u
#define NUMBER_ESCAPE 15u
#define NUMBER_ESCAPE_BITS 7u

/* Rows of a class. */
#define OP_ROWS 512u
#define REGION_ROWS 3u
#define REGION_RECENT 14u
#define REGION_ESCAPE 15u
#define PLACE_GROUPS 3u
enum {
    ROW_OP = 0,
    ROW_START = ROW_OP + OP_ROWS, /* by corner: is the vertex of a first tet new */
    ROW_SHARED =
        ROW_START + 4, /* by: lies on a border face; was the last one of that kind shared */
    ROW_REGION = ROW_SHARED + 4,
    ROW_PLACE = ROW_REGION + REGION_ROWS,
    ROW_CHANNEL = ROW_PLACE + PLACE_GROUPS * NUMBER_ROWS /* NUMBER_ROWS + 1 a channel */
};
#define CHANNEL_ROWS (NUMBER_ROWS + 1)

struct tl_codec {
    tl_lattice lattice;
    tli_coded_channel *channels;
    size_t channel_count;
    size_t row_count;
    int16_t (*rows[TL_CLASS_COUNT])[RANS_SYMBOLS];
};

static inline const int16_t (*codec_rows(const tl_codec *codec, unsigned class_))[RANS_SYMBOLS]
{
    return (const int16_t(*)[RANS_SYMBOLS])codec->rows[class_];
}

static inline uint32_t codec_channel_row(size_t channel)
{
    return (uint32_t)(ROW_CHANNEL + channel * CHANNEL_ROWS);
}

/* Bytes that a blob of so many tets or values must have at least. */
static inline size_t model_least_bytes(uint64_t item_count)
{
    return (size_t)(item_count / ITEMS_PER_BYTE);
}

/* The bits that tell count values apart. */
static inline uint32_t model_bits_for(uint32_t count)
{
    uint32_t bits = 0;
    while (bits < 32 && (uint64_t)1 << bits < count) bits++;
    return bits;
}

static inline uint32_t model_op_row(const tli_gate *gate)
{
    uint32_t row = gate->open;
    for (int k = 0; k < 3; k++) {
        uint32_t fan = gate->fan[k] < 4 ? gate->fan[k] - 1 : 3;
        row = row * 4 + fan;
    }
    return ROW_OP + row;
}

/* ---- numbers ---- */

/* Bits of a magnitude: 0 for 0, 64 for 2^63. */
static inline uint32_t model_length(uint64_t magnitude)
{
#if defined(__GNUC__)
    return magnitude ? 64 - (uint32_t)__builtin_clzll(magnitude) : 0;
#else
    uint32_t length = 0;
    for (; magnitude; magnitude >>= 1) length++;
    return length;
#endif
}

/* Follows how long the numbers of a kind are beside the scale of what is around them. */
typedef struct tli_scale {
    int32_t mean; /* of length - scale, in 1/64 */
} tli_scale;

#define SCALE_ONE 64
#define SCALE_SPEED 8

/* Expected length in 1/4 bits. */
static inline uint32_t scale_expect(const tli_scale *scale, uint32_t around)
{
    int32_t quarters = ((int32_t)around * SCALE_ONE + scale->mean) / (SCALE_ONE / 4);
    return quarters > 0 ? (uint32_t)quarters : 0;
}

static inline void scale_learn(tli_scale *scale, uint32_t around, uint32_t length)
{
    scale->mean += (((int32_t)length - (int32_t)around) * SCALE_ONE - scale->mean) / SCALE_SPEED;
}

static inline uint32_t number_row(uint32_t first_row, uint32_t quarters)
{
    return first_row + (quarters < NUMBER_ROWS ? quarters : NUMBER_ROWS - 4 + (quarters & 3));
}

#endif
