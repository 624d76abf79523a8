/* tetralod, stage model: from a data set to one multi-resolution file. Segments that are simplified
 * on their own, level upon level (Sondershaus 2007, chapter 6; Ponchio & Hormann 2008). */
#ifndef TETRALOD_MODEL_H
#define TETRALOD_MODEL_H

#include "tetralod/formats.h"
#include "tetralod/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A bound on what the codec may add to the error of a channel. */
typedef struct tl_build_channel {
    const char *name;
    double error; /* fraction of the channel's range if relative, else in its unit; >= 0 */
    bool relative;
    bool lossless; /* values stay as they are at the finest level */
} tl_build_channel;

/* What cuts a level into segments. */
typedef enum tl_partition {
    TL_PARTITION_CLUSTER, /* patches of a few thousand tets, gathered so that borders come inside */
    TL_PARTITION_OCTREE,  /* cells of octrees that are turned from level to level */
    TL_PARTITION_VORONOI  /* Voronoi cells, each with a distance that fits its tets */
} tl_partition;

/* What a model is made like. */
typedef struct tl_build_opts {
    size_t struct_bytes;
    const char *const *channels; /* [channel_count] names of those that are taken, borrowed;
                                    NULL: all */
    size_t channel_count;
    const tl_build_channel *errors; /* [error_count], borrowed: for single channels */
    size_t error_count;
    double channel_error;  /* of all others, fraction of the range; default 1e-4 */
    double position_error; /* largest move of a vertex by the lattice, fraction of the diagonal;
                              default 1e-5 */
    double boundary_error; /* largest distance of the boundary from the original one that any level
                              may reach, fraction of the diagonal; default 0.05 */
    bool lossless;         /* default false: places and values stay as they are */
    bool exact_places;     /* default false: places stay as they are */
    bool raw;              /* default false: no entropy coding, for comparison */
    uint32_t segment_tets; /* default 0: the best by measurement, docs/notes */
    uint32_t patch_tets;   /* default 0: likewise */
    double reduction; /* part of the tets that a level leaves, 0.25 to 0.75; default 0: the best
                         by measurement */
    /* what cuts levels into segments; default: the best by measurement, docs/notes */
    tl_partition partition;
    /* default false: patches whose refinement stays within channel_error and position_error are
     * left out, so that the finest mesh has the values of the input but not all of its tets. Not
     * with lossless */
    bool prune;
    uint64_t memory_bytes; /* what the work should take, beside a budget of the context; default 0:
                              256 MiB for the input, and segments for each thread */
    const char *folder;    /* for work files, borrowed; default NULL: that of keep or resume, else
                              /tmp. They have no names where the file system allows it */
    const char *keep;      /* folder, made if it is not there, in which the work stays after each
                              stage, so that a build that ends early can be gone on with. borrowed;
                              default NULL: nothing stays. Not for a mesh in memory */
    const char *resume;    /* folder of such a build, which is gone on with; input and options must
                              be those of before but for memory and folder. borrowed; default NULL */
    const char *until;     /* with keep or resume: the stage it ends after, without a file:
                              "segment", "finest" or "level N". What it made stays in the folder as
                              segments.vtu or level_N.vtu (the finest is 0), in pieces whose numbers
                              are channels on tets. borrowed; default NULL */
    const uint32_t *steer; /* [steer_count] of a series: numbers of the steps whose channels say
                              which tets go; the others' follow. Default NULL: all. borrowed */
    size_t steer_count;
} tl_build_opts;
TL_API tl_build_opts tl_build_opts_defaults(void);

/* A level of the model. */
typedef struct tl_build_level {
    uint64_t tets, vertices; /* a vertex that patches share counts once for each */
    uint64_t segments, patches;
    double boundary_error; /* mesh units */
} tl_build_level;

typedef struct tl_build_result {
    uint64_t tets_in, tets_stored;
    uint64_t segments, patches;
    uint64_t bytes; /* of the file; 0: it was to end after a stage */
    double seconds;
    size_t peak_bytes;      /* of the context */
    tl_build_level *levels; /* [level_count], finest first, gives: tl_build_release */
    size_t level_count;
} tl_build_result;

/* Builds the model of the data set in a file. read and opts may be NULL (defaults). The file at
 * path appears only when it is complete. The bytes do not depend on the number of threads, on
 * memory_bytes, nor on whether a build was interrupted and resumed. TL_ERR_DATA for a folder to
 * resume of another input or with other options. As
 * tl_mesh_read, and TL_ERR_ARG for options out of range, TL_ERR_DATA for a data set without tets or
 * a channel that is not there, TL_ERR_UNSUPPORTED for more than 255 vertices at one place. */
TL_API tl_status tl_model_build(tl_ctx *ctx, const char *input, const tl_read_opts *read,
                                const char *path, const tl_build_opts *opts,
                                tl_build_result *result);
/* The same of several steps of one mesh that does not move, [step_count], at least 1: topology
 * once, the channels of each step beside it with its number and time. Errors of a channel are
 * fractions of its range over all steps. read says nothing of steps. TL_ERR_DATA if the mesh of a
 * step is not that of the first, TL_ERR_UNSUPPORTED for more than 1,024 channels or 256 steering
 * components. */
TL_API tl_status tl_model_build_series(tl_ctx *ctx, const tl_step *steps, size_t step_count,
                                       const tl_read_opts *read, const char *path,
                                       const tl_build_opts *opts, tl_build_result *result);
/* The same of a mesh in memory, borrowed during the call. */
TL_API tl_status tl_model_build_mesh(tl_ctx *ctx, const tl_mesh *mesh, const char *path,
                                     const tl_build_opts *opts, tl_build_result *result);
/* Adds channels to the model at path, from a file of the same data set (input), or from
 * steps of one ([step_count], then input is NULL): a further field, or further time steps. Topology
 * and all that is there stay; values of coarser levels are fitted to the original vertices, and
 * their errors measured, as by a build; those of cells are means by volume, of integers the
 * nearest. Of opts those of channels, errors, memory and folder count. The file is replaced when
 * the new one is complete. As tl_model_build; TL_ERR_DATA too for another mesh and for a channel
 * that is there, TL_ERR_UNSUPPORTED for vertices at one place with different values. result: levels
 * stay empty. */
TL_API tl_status tl_model_add_channels(tl_ctx *ctx, const char *path, const tl_step *steps,
                                       size_t step_count, const char *input,
                                       const tl_read_opts *read, const tl_build_opts *opts,
                                       tl_build_result *result);
TL_API void tl_build_release(tl_ctx *ctx, tl_build_result *result);

#ifdef __cplusplus
}
#endif
#endif
