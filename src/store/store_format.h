/* Stage store, only for files of this stage: sizes and limits of format version 1 (docs/FORMAT.md),
 * little-endian numbers, the codes of errors, ranges and spheres, and the checksum. */
#ifndef TETRALOD_SRC_STORE_FORMAT_H
#define TETRALOD_SRC_STORE_FORMAT_H

#include <string.h>

#include "base/base.h"
#include "tetralod/store.h"

#define TLI_STORE_MAGIC "\x89TLOD\r\n\x1a"
#define TLI_STORE_MAGIC_BYTES 8
/* What a reader asks for first; the head of most models is within it. */
#define TLI_STORE_FIRST_BYTES ((size_t)64 << 10)
/* Everything starts at multiples of it. */
#define TLI_STORE_ALIGN 8u
#define TLI_STORE_HASH_BYTES 8u

/* Sizes of records; those "each" are added once a channel. */
#define TLI_HEAD_FIXED_BYTES 432u
#define TLI_HEAD_REGION_BYTES 24u
#define TLI_HEAD_LEVEL_BYTES 32u
#define TLI_HEAD_LEVEL_EACH_BYTES 8u
#define TLI_HEAD_CHANNEL_BYTES 96u
#define TLI_HEAD_PAGE_BYTES 40u
#define TLI_PAGE_HEAD_BYTES 16u
#define TLI_SEGMENT_BYTES 32u
#define TLI_SEGMENT_EACH_BYTES 2u
#define TLI_OUTPUT_BYTES 4u
#define TLI_PATCH_BYTES 40u
#define TLI_PATCH_EACH_BYTES 10u
#define TLI_BINS_LEAST_BYTES 2u /* of one histogram: all zero */
#define TLI_BINS_MOST_BYTES (2u + TL_BINS)
#define TLI_TWIN_BYTES 3u

#define TLI_PATCH_HAS_TWINS 1u
/* Limits that keep a hostile file from asking for much; no writer comes near. */
#define TLI_STORE_HEAD_BYTES_MAX ((uint64_t)64 << 20)
#define TLI_STORE_PAGE_BYTES_MAX ((uint64_t)64 << 20)
#define TLI_STORE_BLOB_BYTES_MAX ((uint32_t)1 << 30)
#define TLI_STORE_NAME_BYTES_MAX 65535u
#define TLI_STORE_REGIONS_MAX 65536u
#define TLI_STORE_COMPONENTS_MAX 65536u

/* Kinds of things a checksum is made for; part of its seed. */
typedef enum tli_store_part {
    TLI_PART_HEAD = 1,
    TLI_PART_PAGE = 2,
    TLI_PART_BLOB = 3
} tli_store_part;

/* The checksum of docs/FORMAT.md. A change inside of eight aligned bytes always changes it. */
uint64_t tli_store_hash(uint64_t seed, const uint8_t *bytes, size_t byte_count);
/* Seed for a part of a file: a is the page or patch, b the channel (TL_TOPOLOGY: the topology). */
uint64_t tli_store_seed(uint64_t identity, tli_store_part part, uint32_t a, uint32_t b);

/* An entry of the page directory. */
typedef struct tli_page_entry {
    uint64_t payload_ofs, page_ofs, hash;
    uint32_t page_bytes, first_segment, first_patch;
} tli_page_entry;

/* ---- codes ---- */

/* Units of errors and lengths are 2^unit. */
#define TLI_UNIT_MIN (-1000)
#define TLI_UNIT_MAX 1000

/* Errors: floating-point numbers of 8 or 16 bits, not negative, in units of 2^unit. All ones:
 * infinite. */
#define TLI_CODE8_COUNT 256u
#define TLI_CODE16_INFINITE 0xffffu
/* Square errors are coded as roots in units that are larger by this exponent. */
#define TLI_SQUARE_EXPONENT 24
double tli_code8_value(unsigned code, int unit);
double tli_code16_value(unsigned code, int unit);
/* Ranges: code k stands for lo + (k - 1) * step, 0 for -infinity, 65535 for +infinity. No finite
 * value: 65535 .. 0. */
typedef struct tli_range_grid {
    double lo, step;
} tli_range_grid;
double tli_range_value(const tli_range_grid *grid, unsigned code);

/* Spheres: the centre on a grid, then a 16-bit radius in units of 2^unit. */
typedef struct tli_sphere_grid {
    double lo[3], step;
    int unit;
} tli_sphere_grid;
void tli_sphere_value(const tli_sphere_grid *grid, const uint32_t centre[3], unsigned radius,
                      double sphere[4]);
/* What a file says about a channel and only this stage needs. */
typedef struct tli_channel_codes {
    int error_unit;
    tli_range_grid range;
} tli_channel_codes;

static inline uint64_t tli_store_align(uint64_t bytes)
{
    return (bytes + TLI_STORE_ALIGN - 1) / TLI_STORE_ALIGN * TLI_STORE_ALIGN;
}

/* Bytes that a blob takes in the file: padding and checksum included. */
static inline uint64_t tli_store_blob_bytes(uint32_t byte_count)
{
    return tli_store_align(byte_count) + TLI_STORE_HASH_BYTES;
}

/* ---- little-endian numbers ---- */

static inline void tli_put(uint8_t **at, uint64_t value, unsigned byte_count)
{
    for (unsigned i = 0; i < byte_count; i++) *(*at)++ = (uint8_t)(value >> 8 * i);
}

static inline void tli_put_f64(uint8_t **at, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    tli_put(at, bits, 8);
}

static inline uint64_t tli_take(const uint8_t **at, unsigned byte_count)
{
    uint64_t value = 0;
    for (unsigned i = 0; i < byte_count; i++) value |= (uint64_t) * (*at)++ << 8 * i;
    return value;
}

static inline uint32_t tli_take_u32(const uint8_t **at)
{
    return (uint32_t)tli_take(at, 4);
}

static inline int64_t tli_take_i64(const uint8_t **at)
{
    uint64_t bits = tli_take(at, 8);
    int64_t value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline int32_t tli_take_i32(const uint8_t **at)
{
    uint32_t bits = tli_take_u32(at);
    int32_t value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline double tli_take_f64(const uint8_t **at)
{
    uint64_t bits = tli_take(at, 8);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

#endif
