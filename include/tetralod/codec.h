/* tetralod, stage codec: connectivity, places and channels of a patch to few bits and back. This
 * header holds what a reader of files needs; what encodes is internal.
 *
 * Numbers of a file are 64-bit integers, the images of places and values. Two vertices are at one
 * place exactly if their images are equal; a value shared by patches has one image. */
#ifndef TETRALOD_CODEC_H
#define TETRALOD_CODEC_H

#include "tetralod/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How images stand for places. */
typedef enum tl_place_kind {
    TL_PLACE_LATTICE = 0, /* x = 2^exponent * (origin + k), exact in float64 */
    TL_PLACE_FLOAT32 = 1, /* k is the ordered image of a float32 (lossless) */
    TL_PLACE_FLOAT64 = 2  /* the same of a float64 */
} tl_place_kind;

/* The lattice of a whole data set. exponent and origin count for TL_PLACE_LATTICE alone:
 * |exponent| <= 1000, |origin| <= 2^52, and 0 <= k < 2^32 along each axis. */
typedef struct tl_lattice {
    tl_place_kind kind;
    int exponent;      /* the unit is 2^exponent mesh units */
    int64_t origin[3]; /* in units */
} tl_lattice;

/* The place of image k, in mesh units; exact. */
TL_API void tl_lattice_xyz(const tl_lattice *lattice, const int64_t k[3], double xyz[3]);
/* The image nearest to a place; outside of the lattice the nearest corner or side. A coordinate
 * that is not a number takes the image of 0; infinities have images in the float kinds alone. */
TL_API void tl_lattice_nearest(const tl_lattice *lattice, const double xyz[3], int64_t k[3]);

/* Ordered images: a < b as numbers exactly if image(a) < image(b); -0 lies below +0. The inverse is
 * exact for every pattern of bits that is not NaN. */
TL_API int64_t tl_image_of_float32(float value);
TL_API int64_t tl_image_of_float64(double value);
/* image as made above; of others some number. */
TL_API float tl_float32_of_image(int64_t image);
TL_API double tl_float64_of_image(int64_t image);

/* How images stand for values of a channel, every component alike. */
typedef enum tl_value_kind {
    TL_VALUE_LATTICE = 0, /* value = step * k, |k| <= 2^53 */
    TL_VALUE_FLOAT32 = 1, /* ordered images, lossless */
    TL_VALUE_FLOAT64 = 2,
    TL_VALUE_INTEGER = 3 /* k itself, |k| <= 2^53 */
} tl_value_kind;

typedef struct tl_value_code {
    tl_value_kind kind;
    double step; /* > 0, in the channel's unit; of TL_VALUE_LATTICE alone */
} tl_value_code;

/* Images of what is no finite number, the same in every kind. NaN loses its sign and payload. */
#define TL_IMAGE_NAN INT64_MIN
#define TL_IMAGE_NINF (INT64_MIN + 1)
#define TL_IMAGE_PINF (INT64_MIN + 2)

/* The nearest image of a value; finite values beyond the kind's range take the last one in it. */
TL_API int64_t tl_value_image(const tl_value_code *code, double value);
/* The value of an image; for any image. */
TL_API double tl_value_of(const tl_value_code *code, int64_t image);

/* Most vertices and tets of a patch. */
#define TL_PATCH_VERTS_MAX 65535u
#define TL_PATCH_TETS_MAX 524287u

/* A patch in memory. Arrays are [vert_count] or [tet_count], blocks of tl_mem_alloc. */
typedef struct tl_patch {
    uint32_t vert_count, tet_count;
    int64_t (*places)[3]; /* images of the lattice */
    uint16_t (*tets)[4];  /* local vertices; flat, inverted and doubled tets of the input may be
                             there, and tets that name a vertex twice */
    uint8_t *shared;      /* vertex: 1 if another patch may hold it, too, else 0 */
    uint8_t *twins;   /* vertex, or NULL (all 0): tells shared vertices at one place apart. A shared
                         vertex is (place, twin), equal in all patches that hold it. Not coded */
    int32_t *regions; /* tet, or NULL */
    uint32_t (*opposite)[4]; /* tet: 4 * tet + face inside the patch, TL_NONE at its border, at
                                faces of more than two tets and of tets with a vertex twice.
                                Decoding makes it; NULL otherwise */
} tl_patch;

/* Frees the arrays and the patch itself. NULL is allowed. */
TL_API void tl_patch_destroy(tl_ctx *ctx, tl_patch *patch);

/* Classes of patches with tables of their own: finest level, second, coarser, and one that is free
 * for the writer. TL_CLASS_RAW needs no tables: its blobs are plain numbers. */
#define TL_CLASS_COUNT 4u
#define TL_CLASS_RAW 255u

/* The tables of a file, immutable, to be shared by threads. */
typedef struct tl_codec tl_codec;

/* Reads tables as they stand in the head of a file. Gives *codec. TL_ERR_FORMAT for other bytes. */
TL_API tl_status tl_codec_read(tl_ctx *ctx, const uint8_t *bytes, size_t byte_count,
                               tl_codec **codec);
/* The lattice of the places; borrowed. */
TL_API const tl_lattice *tl_codec_lattice(const tl_codec *codec);
/* NULL is allowed. */
TL_API void tl_codec_destroy(tl_ctx *ctx, tl_codec *codec);

/* Decodes the topology of a patch: tets and their opposite faces, places, shared flags, regions.
 * class_ < TL_CLASS_COUNT or TL_CLASS_RAW, as it was encoded; codec may be NULL for the latter.
 * Gives *patch. TL_ERR_FORMAT for bytes that are none; time and memory are bounded by byte_count:
 * a byte stands for 1,024 tets at most. TL_ERR_ARG for a class that is none. */
TL_API tl_status tl_topology_decode(tl_ctx *ctx, const tl_codec *codec, unsigned class_,
                                    const uint8_t *bytes, size_t byte_count, tl_patch **patch);

/* Decodes one channel of a patch whose topology is there. channel, on and components as they were
 * encoded. values [vert_count or tet_count][components], the caller's, receives images; undefined
 * on failure. TL_ERR_FORMAT; TL_ERR_ARG for a class or channel that is none. */
TL_API tl_status tl_channel_decode(tl_ctx *ctx, const tl_codec *codec, unsigned class_,
                                   const tl_patch *patch, size_t channel, tl_on on,
                                   uint32_t components, const uint8_t *bytes, size_t byte_count,
                                   int64_t *values);

/* What coding a mesh in patches costs. Bits are sums over all patches. */
typedef struct tl_codec_report {
    size_t patch_count, tet_count;
    size_t vert_count;        /* of all patches together: shared ones count in each */
    size_t border_face_count; /* of all patches together */
    size_t table_bytes;
    double connectivity_bits, place_bits, flag_bits, region_bits, channel_bits;
    double topology_bytes, channel_bytes; /* blobs as they are stored */
    double encode_s, topology_decode_s,
        channel_decode_s; /* CPU time of one run, the least of all */
} tl_codec_report;

/* Cuts a mesh into patches of at most patch_tets tets by planes, codes and decodes them with
 * tables trained on all of them, and compares what comes back. Places are taken to a lattice of the
 * largest power of two not above position_error * diagonal, values to steps of channel_error *
 * range or, for 0, without loss; for tables and timing. Runs on the thread of the context.
 * TL_ERR_ARG for options out of range, TL_ERR_DATA if something comes back changed. */
TL_API tl_status tl_codec_measure(tl_ctx *ctx, const tl_mesh *mesh, uint32_t patch_tets,
                                  double position_error, double channel_error, unsigned runs,
                                  tl_codec_report *report);

#ifdef __cplusplus
}
#endif
#endif
