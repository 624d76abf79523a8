/* The tables of a file: how they stand in bytes. A distribution is a mask of the symbols that occur
 * and for each of them -4 log2 of its probability in six bits. A group of rows has one distribution
 * that its rows take unless they have their own. */
#ifndef TETRALOD_SRC_CODEC_TABLES_H
#define TETRALOD_SRC_CODEC_TABLES_H

#include "codec/codec_model.h"

/* Head: version, kind of places, exponent + 32768 (2 bytes), origin (3 of 8), channels (2); then of
 * each channel kind of values, on, components (4), bits of the step (8); then the tables, one bit
 * after the other, the lowest of a byte first. */
#define TABLES_VERSION 1u
#define TABLES_HEAD_BYTES 30u
#define TABLES_CHANNEL_BYTES 14u
#define TABLES_CHANNELS_MAX 1024u
#define LATTICE_EXPONENT_MAX 1000
#define LATTICE_ORIGIN_MAX (INT64_C(1) << 52)

#define DISTRIBUTION_BITS 6u
#define DISTRIBUTION_LAST ((1u << DISTRIBUTION_BITS) - 1)

typedef struct tli_distribution {
    uint16_t mask;               /* bit: the symbol occurs */
    uint8_t level[RANS_SYMBOLS]; /* -4 log2 of its probability */
} tli_distribution;

/* The row of a distribution; one without symbols stands for all of them alike. */
void tli_distribution_row(const tli_distribution *distribution, int16_t row[RANS_SYMBOLS]);

typedef struct tli_row_group {
    uint32_t first, count;
} tli_row_group;
/* Group index of a codec's rows; false past the last. */
bool tli_row_group_at(size_t index, size_t channel_count, tli_row_group *group);

/* A codec without tables. lattice and channels are checked; wrong says what is not right, or is
 * NULL. Gives *codec. */
tl_status tli_codec_create(tl_ctx *ctx, const tl_lattice *lattice,
                           const tli_coded_channel *channels, size_t channel_count,
                           tl_codec **codec, const char **wrong);

#endif
