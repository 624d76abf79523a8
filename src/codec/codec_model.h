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
#define TOPOLOGY_CODED_FLAGS (TOPOLOGY_REGIONS | TOPOLOGY_REMATCH | TOPOLOGY_SHIFTED)
#define TOPOLOGY_RAW_FLAGS (TOPOLOGY_REGIONS | TOPOLOGY_WIDE)
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

/* The vertex of OP_JOIN: its place in the umbrella of p, of a or of b, or its number. */
#define JOIN_A 13u
#define JOIN_B 14u
#define JOIN_NUMBER 15u

/* Numbers are coded by their length in bits beside an expected one. */
#define NUMBER_ROWS 32u
#define NUMBER_ZERO 0u
#define NUMBER_MIDDLE 8u
#define NUMBER_ESCAPE 15u
#define NUMBER_ESCAPE_BITS 7u

/* Rows of a class. */
#define OP_STATES 16u
#define OP_STATE_GLUE 15u
#define OP_FANS_AB 4u /* fans of more tets count as this many */
#define OP_FANS_P 6u
#define OP_STATE_ROWS (OP_FANS_AB * OP_FANS_P * OP_FANS_P)
#define OP_ROWS (OP_STATES * OP_STATE_ROWS)
#define JOIN_ROWS 8u
#define REGION_ROWS 3u
#define REGION_RECENT 14u
#define REGION_ESCAPE 15u
#define PLACE_GROUPS 4u /* by how good the guess is; the last: guesses of other modes than 0 */
#define MODE_KIN 4u
#define MODE_ROWS (MODE_KIN * RANS_SYMBOLS)
enum {
    ROW_OP = 0,
    ROW_JOIN = ROW_OP + OP_ROWS, /* around p, then around a or b, by the size of the umbrella */
    ROW_START = ROW_JOIN + 2 * JOIN_ROWS, /* by corner: is the vertex of a first tet new */
    ROW_SHARED =
        ROW_START + 4, /* by: lies on a border face; was the last one of that kind shared */
    ROW_REGION = ROW_SHARED + 4,
    ROW_MODE = ROW_REGION + REGION_ROWS, /* by the number of kin and the mode before */
    ROW_PLACE = ROW_MODE + MODE_ROWS,
    ROW_CHANNEL = ROW_PLACE + PLACE_GROUPS * NUMBER_ROWS /* NUMBER_ROWS + 1 a channel */
};
#define CHANNEL_ROWS (NUMBER_ROWS + 1)

/* [open][same apexes]: the state of a gate. */
extern const uint8_t tli_op_states[8][8];

/* The tables of a class. Most rows are those of their group, so that what is in use stays in the
 * cache: row_of [row] is the place of a row in rows. */
typedef struct tli_table {
    uint16_t *row_of;
    int16_t (*rows)[RANS_SYMBOLS];
} tli_table;

static inline const int16_t *codec_row(const tli_table *table, uint32_t row)
{
    return table->rows[table->row_of[row]];
}

struct tl_codec {
    tl_lattice lattice;
    tli_coded_channel *channels;
    size_t channel_count;
    size_t row_count;
    tli_table tables[TL_CLASS_COUNT];
};

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

/* A symbol's state: where several follow that do not depend on each other, they take turns. */
#define STATE_CONNECTIVITY 0u
#define STATE_MODE 3u /* after those of the three axes */
#define TOPOLOGY_STATES 4u
static inline uint32_t model_state_of_channel(uint32_t component)
{
    return component & (RANS_STATES_MAX - 1);
}
static inline uint32_t model_states_of_channel(uint32_t components)
{
    return components < RANS_STATES_MAX ? components : RANS_STATES_MAX;
}

/* Rows of operations by what the gate sees: which faces over its edges are open and which of their
 * apexes are one vertex (a state), and how many tets the fans have. The state of a gate whose other
 * side may be there already is OP_STATE_GLUE. */
static inline uint32_t model_op_row(const tli_gate *gate)
{
    const uint32_t *apex = gate->apex;
    uint32_t same = (uint32_t)(apex[0] == apex[1]) | (uint32_t)(apex[0] == apex[2]) << 1 |
                    (uint32_t)(apex[1] == apex[2]) << 2;
    uint32_t glue = (uint32_t)(apex[0] == gate->vertex[0]) |
                    (uint32_t)(apex[1] == gate->vertex[1]) << 1 |
                    (uint32_t)(apex[2] == gate->vertex[2]) << 2;
    uint32_t state = glue & gate->open ? OP_STATE_GLUE : (uint32_t)tli_op_states[gate->open][same];
    /* Fans of 0 are those of 512. */
    uint32_t ab = gate_fan(gate, 0) - 1, pb = gate_fan(gate, 1) - 1, pa = gate_fan(gate, 2) - 1;
    ab = ab < OP_FANS_AB ? ab : OP_FANS_AB - 1;
    pb = pb < OP_FANS_P ? pb : OP_FANS_P - 1;
    pa = pa < OP_FANS_P ? pa : OP_FANS_P - 1;
    return ROW_OP + ((state * OP_FANS_AB + ab) * OP_FANS_P + pb) * OP_FANS_P + pa;
}

/* Places in an umbrella count from its two ends in turn, since near ones are more likely. Those
 * from JOIN_A on are not told. */
static inline uint32_t model_join_symbol(uint32_t place, uint32_t count)
{
    uint32_t from_end = count - 1 - place;
    return place <= from_end ? 2 * place : 2 * from_end + 1;
}

/* The inverse; not below count if there is none. */
static inline uint32_t model_join_place(uint32_t symbol, uint32_t count)
{
    return symbol & 1 ? count - 1 - symbol / 2 : symbol / 2;
}

static inline uint32_t model_join_row(uint32_t k, uint32_t count)
{
    uint32_t row = count < JOIN_ROWS ? count : JOIN_ROWS - 1;
    return ROW_JOIN + (k ? JOIN_ROWS : 0) + row;
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
    int32_t expected = (int32_t)around * SCALE_ONE + scale->mean;
    return expected > 0 ? (uint32_t)expected / (SCALE_ONE / 4) : 0;
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
