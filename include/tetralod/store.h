/* tetralod, stage store: the .tlod container, reading half. docs/FORMAT.md has it byte by byte.
 *
 * A model is a graph. Levels count from 0, the finest mesh. A segment of level l takes up
 * (consumes) patches of level l and hands on (produces) patches of higher levels. Segments are
 * numbered coarse levels first, inside a level along a space-filling curve. Patches are numbered by
 * their consumer: first the root patches, which have none, then the input patches of segment 0, of
 * segment 1 ... A patch without producer is a leaf. With an error f of segments that does not fall
 * towards the coarse side, the patches drawn at a threshold t are those with
 * f(producer) <= t < f(consumer), where leaves have f = 0 and roots are never consumed.
 *
 * The file is read at places, never mapped: a file that is cut short while it is open gives an
 * error. Opening reads the head, up to 64 KiB of most models; pages of the index are read, proved
 * and kept when first asked for.
 *
 * Threads: a store may be used by several threads at once, each with a context of its own. What is
 * kept counts on the budget of the context that asked for it first, so every context that was
 * handed in must outlive the store. All functions that return a status may fail for
 * TL_ERR_MEMORY, TL_ERR_BUDGET, TL_ERR_IO and, naming the place, TL_ERR_FORMAT. */
#ifndef TETRALOD_STORE_H
#define TETRALOD_STORE_H

#include "tetralod/codec.h"
#include "tetralod/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Version of the format that is written; the only one that is read. */
#define TL_STORE_VERSION 1
/* Bins of a channel's range (of several components: of the range of their norm). */
#define TL_BINS 64
/* The bin of a value, or of a norm; what lies outside of the range is in the first or the last. */
static inline uint32_t tl_bin_of(const double range[2], double value)
{
    const double width = range[1] - range[0];
    const double at = width > 0 ? (value - range[0]) / width * TL_BINS : 0;
    return at >= TL_BINS - 1 ? TL_BINS - 1 : at > 0 ? (uint32_t)at : 0;
}

/* Most levels, channels and kinds of cells of a file. */
#define TL_STORE_LEVELS_MAX 64
#define TL_STORE_CHANNELS_MAX 4096
#define TL_STORE_CELL_KINDS_MAX 64
/* A count or number that the builder did not find out: UINT64_MAX, SIZE_MAX or NaN. */
#define TL_STORE_UNKNOWN UINT64_MAX
/* In place of a channel: the topology. */
#define TL_TOPOLOGY TL_NONE

/* A segment. Pointers live as long as the store. Errors are those of its outputs against the
 * original mesh, codec included; what is stored is rounded up, what is read is what is stored;
 * INFINITY means that nothing is promised. */
typedef struct tl_segment_info {
    uint32_t level;
    uint32_t first_patch, patch_count; /* input patches, the refined side */
    const uint32_t *outputs;           /* patches it produced, ascending: the coarse side */
    uint32_t output_count;
    uint64_t input_tets, output_tets;
    double sphere[4];        /* centre, radius: holds inputs, outputs and the original vertices
                                carried to them */
    double boundary_error;   /* mesh units; saturated */
    const double *max_error; /* [channel_count] in the channel's unit; saturated */
    const float *field_bins; /* [channel_count][TL_BINS] the same by bin of the value; saturated */
    const float *space_bins; /* [channel_count][TL_BINS] mesh units; saturated: how far from an
                                original vertex (centroid) the mesh has its value; in the bins of
                                all values in the original tets around it, and of these moved by the
                                error at the vertex (of a centroid: in that of its own value).
                                Of vectors and tensors the norm, joined linearly between vertices;
                                of channels on tets inside of a tet, or at a face between a smaller
                                and a larger one, where a threshold passes */
} tl_segment_info;

/* A patch. Pointers live as long as the store. */
typedef struct tl_patch_info {
    uint32_t producer, consumer; /* segments, or TL_NONE */
    uint32_t level, class_;      /* class_: of the codec's tables */
    uint32_t tet_count, vert_count;
    double sphere[4];           /* centre, radius: holds its vertices */
    const float *ranges;        /* [channel_count][2] smallest and largest value (norm), rounded
                                   outwards; infinite where not known; NaN where no value is finite */
    const double *square_error; /* [channel_count] sum of the squared errors of the original
                                   vertices (tets) that lie in it, rounded up */
    uint64_t carried;           /* how many original vertices lie in it */
    uint64_t topology_ofs;      /* in the file */
    uint32_t topology_bytes;
    const uint64_t *channel_ofs;   /* [channel_count] */
    const uint32_t *channel_bytes; /* [channel_count] */
} tl_patch_info;

/* A channel. A series has one for each of its time steps, with the same name. Channels without a
 * step hold at all times. */
typedef struct tl_store_channel {
    const char *name, *unit; /* unit "" when unknown */
    uint32_t components;     /* >= 1 */
    tl_on on;
    tl_scalar scalar;         /* the type it had in its file */
    tl_value_code code;       /* how images stand for values */
    double range[2];          /* of the input: smallest and largest value (norm); bins divide it */
    double codec_error;       /* most that coding changes a value (norm), >= 0 */
    bool has_step;            /* false: it is of no series */
    uint32_t step;            /* its number in the series, below TL_NONE */
    double time;              /* of its step, in the file's unit; NaN: none */
    uint64_t nonfinite_count; /* values of the input that are NaN or infinite */
    uint64_t bytes;           /* of all its blobs */
} tl_store_channel;

/* A level as a whole: what has it, and the errors of its mesh against the original. */
typedef struct tl_store_level {
    uint64_t tets;                       /* of its patches */
    uint64_t verts;                      /* of its mesh; may be TL_STORE_UNKNOWN */
    uint32_t patch_count, segment_count; /* that have this level */
    double boundary_error;               /* mesh units */
    const double *max_error;             /* [channel_count] */
} tl_store_level;

/* A material and how many tets of the input have it. */
typedef struct tl_store_region {
    int64_t id;
    uint64_t tets;
    const char *name; /* "" when the file has none; a builder may leave it NULL */
} tl_store_region;

/* What opening a file tells. Pointers live as long as the store. */
typedef struct tl_store_head {
    tl_lattice lattice;
    uint32_t segment_count, patch_count, root_patch_count;
    uint64_t input_tets, input_verts;
    tl_mesh_stats stats;   /* of the input; numbers may be unknown, bounds and diagonal not */
    double time;           /* of the input; NaN: none */
    double position_error; /* most that coding moves a vertex, mesh units */
    double border_share;   /* vertices on borders of patches, as a part of all; finest level */
    /* bits of all topology blobs together, by what they are spent on */
    double connectivity_bits, place_bits, flag_bits, region_bits;
    const uint64_t *cells; /* [cell_kind_count] of the input's file, by tl_cell_kind */
    uint32_t cell_kind_count;
    const tl_store_region *regions; /* the first of them, by id */
    uint32_t regions_listed;
    uint64_t region_count; /* all of them; 0: no regions */
    const tl_store_level *levels;
    uint32_t level_count;
    const tl_store_channel *channels;
    uint32_t channel_count;
    /* set by reading; a builder leaves them 0 */
    uint64_t file_bytes, topology_bytes;
    uint64_t identity; /* of the topology; kept when channels are added */
} tl_store_head;

/* An open file. */
typedef struct tl_store tl_store;

/* Reads and proves the head. Gives *store. TL_ERR_UNSUPPORTED names a version that is not known. */
TL_API tl_status tl_store_open(tl_ctx *ctx, const char *path, tl_store **store);
/* NULL is allowed. */
TL_API void tl_store_close(tl_store *store);

/* True if a file begins like a .tlod file, whatever its version; false also when it can't be read.
 */
TL_API bool tl_store_is(tl_ctx *ctx, const char *path);

/* Borrowed from the store. */
TL_API const tl_store_head *tl_store_get_head(const tl_store *store);
/* Bytes that were read from the file so far, and pages of the index among them. */
TL_API uint64_t tl_store_bytes_read(const tl_store *store);
TL_API uint32_t tl_store_pages_read(const tl_store *store);

/* Reads no faster than this from now on, whatever the number of threads, to see what a slow disk
 * does; 0 (default): as fast as it goes. Any thread. */
TL_API void tl_store_set_throttle(const tl_store *store, uint64_t bytes_s);

/* segment < segment_count, patch < patch_count; TL_ERR_ARG. */
TL_API tl_status tl_store_segment(tl_ctx *ctx, const tl_store *store, uint32_t segment,
                                  tl_segment_info *info);
TL_API tl_status tl_store_patch(tl_ctx *ctx, const tl_store *store, uint32_t patch,
                                tl_patch_info *info);

/* The coder's tables, read when first asked for; borrowed from the store. */
TL_API tl_status tl_store_codec(tl_ctx *ctx, const tl_store *store, const tl_codec **codec);
/* Reads and decodes a patch. Gives *patch (tl_patch_destroy). */
TL_API tl_status tl_store_topology(tl_ctx *ctx, const tl_store *store, uint32_t patch_id,
                                   tl_patch **patch);
/* Images of a channel's values, [vert_count or tet_count][components]. patch is that of
 * tl_store_topology. */
TL_API tl_status tl_store_channel_images(tl_ctx *ctx, const tl_store *store, uint32_t patch_id,
                                         const tl_patch *patch, uint32_t channel, int64_t *images);
/* The values themselves. */
TL_API tl_status tl_store_channel_values(tl_ctx *ctx, const tl_store *store, uint32_t patch_id,
                                         const tl_patch *patch, uint32_t channel, double *values);
/* The bytes of a blob as they are stored, checksum proved: channel < channel_count, or TL_TOPOLOGY.
 * Gives *bytes (tl_mem_free). */
TL_API tl_status tl_store_blob(tl_ctx *ctx, const tl_store *store, uint32_t patch_id,
                               uint32_t channel, uint8_t **bytes, size_t *byte_count);

/* Proves a file. Fast: the whole index: checksums, counts, offsets, sums, the graph (each patch is
 * output of its producer once, nothing leads back, original vertices are handed on, errors do not
 * fall towards the coarse side).
 * Full: also every byte of the rest: checksums and padding; every patch decodes to what the index
 * says, its places and values lie in sphere and range, and vertices shared inside a segment's
 * inputs have the same values. TL_ERR_FORMAT or TL_ERR_DATA name the place. Runs on the
 * pool, reports progress. */
TL_API tl_status tl_store_check(tl_ctx *ctx, const tl_store *store, tl_check_level level);

#ifdef __cplusplus
}
#endif
#endif
