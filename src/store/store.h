/* Stage store, internal: writing .tlod files. */
#ifndef TETRALOD_SRC_STORE_H
#define TETRALOD_SRC_STORE_H

#include "base/base.h"
#include "tetralod/store.h"

/* Bytes that a coder made. */
typedef struct tli_blob {
    const uint8_t *bytes;
    size_t byte_count;
} tli_blob;

/* A shared vertex that lies at the place of another one; the rest have twin 0. */
typedef struct tli_twin {
    uint16_t vert; /* of the patch */
    uint8_t twin;  /* >= 1 */
} tli_twin;

/* Writes a file front to back: memory is one page of the index and the blobs of one segment's
 * inputs. Infos need not live longer than the call that takes them. */
typedef struct tli_store_writer tli_store_writer;

/* head: counts of levels, segments, patches, roots and channels, the range and codec_error of the
 * channels, lattice, bounds and diagonal must be final; all else may change until
 * tli_store_finish. codec: the coder's tables, copied. identity 0: a new model; else that of the
 * file whose topology is taken over. TL_ERR_ARG for a head that can't be. Gives *writer. */
tl_status tli_store_begin(tl_ctx *ctx, const char *path, const tl_store_head *head, tli_blob codec,
                          uint64_t identity, tli_store_writer **writer);

/* The next patch, in the order of their numbers. consumer, offsets and sizes of info are not looked
 * at. channels [channel_count]. twins ascending by vertex. TL_ERR_ARG when a number is out of
 * place; errors and ranges are rounded, up and outwards. ranges NaN: no value is finite. */
tl_status tli_store_add_patch(tli_store_writer *writer, const tl_patch_info *info,
                              tli_blob topology, const tli_blob *channels, const tli_twin *twins,
                              size_t twin_count);
/* The next segment, after its input patches. input_tets is not looked at. Rounding keeps order:
 * what is saturated before is saturated as stored. */
tl_status tli_store_add_segment(tli_store_writer *writer, const tl_segment_info *info);

/* Completes the file when commit is true and all was added, else leaves nothing. head: the one of
 * the beginning with its final numbers, or NULL (only if commit is false). Ends the writer. */
tl_status tli_store_finish(tli_store_writer *writer, const tl_store_head *head, bool commit);

/* What added channels bring along, asked for in the order of the file. Arrays are those of the new
 * channels alone, to be filled; blobs need to live until the next call. */
typedef struct tli_store_added {
    void *user;
    tl_status (*patch)(void *user, uint32_t patch, tli_blob *blobs, float *ranges,
                       double *square_error);
    tl_status (*segment)(void *user, uint32_t segment, double *max_error, float *field_bins,
                         float *space_bins);
    /* May be NULL; makes sphere and boundary error larger where new channels need it. */
    void (*place)(void *user, uint32_t segment, double sphere[4], double *boundary_error);
} tli_store_added;

/* Writes a file with the topology, graph and channels of store and further channels. head: that of
 * store with the new channels behind the old ones, and the errors of its levels for all of them.
 * codec: tables that read the old blobs as those of store do. path may be that of store. */
tl_status tli_store_append(tl_ctx *ctx, const tl_store *store, const char *path,
                           const tl_store_head *head, tli_blob codec, const tli_store_added *added);

/* A file from memory, not to be changed before the store is closed; name for messages. */
tl_status tli_store_open_bytes(tl_ctx *ctx, const char *name, const uint8_t *bytes,
                               size_t byte_count, tl_store **store);
/* The twins of a patch, as they were added. Gives *twins (tl_mem_free; NULL without any). */
tl_status tli_store_twins(tl_ctx *ctx, const tl_store *store, uint32_t patch_id, tli_twin **twins,
                          size_t *twin_count);
/* The coder's tables as stored; borrowed. */
tli_blob tli_store_codec_bytes(const tl_store *store);

#endif
