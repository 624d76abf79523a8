/* tetralod, stage cut: which patches of a model make up the mesh now, for an error, a view or a
 * budget; and that mesh.
 *
 * The rule (docs/FORMAT.md says what a model is): a set R of segments is refined, with every
 * segment also those that consume what it produced. A patch is drawn if its consumer is in R (or it
 * has none) and its producer is not. Of all such sets the smallest is taken in which every segment
 * with a drawn output keeps the errors asked for (Sondershaus 2007, 6.3.1 and 6.3.4, with top-down
 * closure instead of queues; DESIGN.md, section 4). The result does not depend on the cuts before.
 *
 * A tl_cut belongs to one thread at a time; it and the store it borrows use the context it was
 * created with. What returns a status can also fail for TL_ERR_MEMORY and TL_ERR_BUDGET, and, since
 * pages of the index are read when they are needed, for TL_ERR_IO and TL_ERR_FORMAT. */
#ifndef TETRALOD_CUT_H
#define TETRALOD_CUT_H

#include "tetralod/store.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A camera in the terms of VTK. */
typedef struct tl_camera {
    double position[3], focal_point[3], view_up[3]; /* mesh units */
    double view_angle; /* degrees from the lower to the upper edge, 0 to 180, both excluded */
    double
        parallel_scale;  /* 0: perspective; above: half the height of a parallel view, mesh units */
    uint32_t size_px[2]; /* width and height of the picture */
} tl_camera;
/* Looks along -z at the origin from a distance of 1, with 30 degrees, at 1024 x 1024 pixels. */
TL_API tl_camera tl_camera_defaults(void);
/* TL_ERR_ARG names what is out of range, or that the camera looks nowhere. */
TL_API tl_status tl_camera_check(tl_ctx *ctx, const tl_camera *camera);

/* Errors that a cut must keep. Infinity: any error will do. A bound below what the finest patches
 * keep gives the finest patches. */
typedef struct tl_cut_bounds {
    const double *channels; /* [channel_count] at every original vertex, in the channel's unit;
                               NULL: any. borrowed during a call */
    double boundary;        /* distance of the boundary, mesh units */
    double space;      /* distance of an isosurface from its place, mesh units, of the values that
                          are visible; tl_cut_state says what is promised */
    double classified; /* sum over the bins of all channels of field error, as a fraction of the
                          channel's range, times opacity (Sondershaus 2007, 6.3.4) */
} tl_cut_bounds;
TL_API tl_cut_bounds tl_cut_bounds_any(void);

typedef struct tl_cut_query {
    size_t struct_bytes;
    tl_cut_bounds bounds;    /* default: any */
    const float *opacity;    /* [channel_count][TL_BINS], 0 to 1: which values are visible, for
                                bounds.space, bounds.classified and pixels; NULL: all, fully, in space
                                those of scalars on vertices. borrowed during a call */
    const float *unseen;     /* [channel_count][TL_BINS] field error at values of a bin, in the
                                channel's unit, 0 or more, that does not show: a bin counts in
                                bounds.space and pixels only where its error is above; NULL
                                (default): all count. borrowed during a call */
    const tl_camera *camera; /* NULL (default): no view. Else segments outside of its frustum may
                                have any error. borrowed during a call */
    double pixels;           /* with a camera: most pixels by which a visible isosurface or the
                                boundary is off; default infinity */
    const double *box;       /* [6] x0 y0 z0 x1 y1 z1, mesh units: where bounds hold. borrowed */
    tl_cut_bounds outside;   /* with a box: what holds elsewhere; default: any */
    uint32_t level;    /* refines every segment of this level and above; default UINT32_MAX: none.
                          0 gives the finest mesh */
    uint64_t tets_max; /* budgets: at most so many tets, and bytes of the patches as stored;
                          default UINT64_MAX. A coarsest mesh above it is given as it is */
    uint64_t bytes_max;
} tl_cut_query;
/* Coarsest mesh: no bound, no budget. */
TL_API tl_cut_query tl_cut_query_defaults(void);

/* What a cut holds and promises. */
typedef struct tl_cut_state {
    uint64_t tets;
    uint64_t vertices; /* those that several patches share count in each */
    uint64_t bytes;    /* of the patches as stored, all channels */
    size_t patches;
    size_t segments;       /* refined ones */
    bool bounds_kept;      /* false: a budget, or what is resident, kept a bound from being kept, or
                              the coarsest mesh is above a budget */
    double boundary_error; /* mesh units */
    double space_error;    /* how far isosurfaces of the visible values of the last query are from
                              their places, mesh units; of what is in view where it had a camera.
                              Without what coding adds. Measured at the corners of all original tets
                              that an isosurface passes: each has its own value that near in the
                              mesh. So an original isosurface has the one of the mesh that near, or
                              within an original edge more, which is hardly ever needed
                              (docs/notes/2026-11-22-space.md). The mesh may have more of it where
                              the value is that of an extremum within the field error */
    double pixels;         /* with a camera: the larger one of both, in pixels of its picture */
} tl_cut_state;

typedef struct tl_cut tl_cut;

/* Borrows store. Gives *cut: the coarsest mesh. */
TL_API tl_status tl_cut_create(tl_ctx *ctx, tl_store *store, tl_cut **cut);
/* NULL is allowed. */
TL_API void tl_cut_destroy(tl_cut *cut);

/* Moves the cut to what query asks for. Without a bound, a camera with pixels or a level, a budget
 * alone is spent where it lowers the root mean square error most (of all channels on vertices,
 * relative to their ranges); else where the bounds are exceeded most. On failure the cut is as it
 * was. TL_ERR_ARG for values out of range. */
TL_API tl_status tl_cut_update(tl_cut *cut, const tl_cut_query *query);

/* The cut stays; its state is then what it holds and promises for this query: bounds_kept tells
 * whether all that is asked for is there. Fails as tl_cut_update. */
TL_API tl_status tl_cut_assess(tl_cut *cut, const tl_cut_query *query);

/* Only refines segments whose input patches may be used: called once for each patch that would be
 * drawn anew; false keeps the coarser patches in its place. NULL (the default) takes all. What was
 * wanted is then in tl_cut_wanted. */
typedef bool (*tl_cut_resident_fn)(void *user, uint32_t patch);
TL_API void tl_cut_set_resident(tl_cut *cut, tl_cut_resident_fn resident, void *user);

/* Patches that another query would draw and that are neither drawn now nor resident, those that
 * serve most first: for loading what is on the camera's way. The cut stays where it is. Gives
 * *patches [*count], borrowed until the next call that is not a get. Fails as tl_cut_update. */
TL_API tl_status tl_cut_foresee(tl_cut *cut, const tl_cut_query *query, const uint32_t **patches,
                                size_t *count);

TL_API tl_cut_state tl_cut_get_state(const tl_cut *cut);
/* Bound of the error of a channel on vertices or tets at every original vertex, or centroid of an
 * original cell, in its unit; channel < channel count of the store. */
TL_API double tl_cut_channel_error(const tl_cut *cut, size_t channel);
/* Patches drawn now, in no order; those that came and went with the last update; those that were
 * not resident, most wanted first. Borrowed until the next update. */
TL_API const uint32_t *tl_cut_patches(const tl_cut *cut, size_t *count);
TL_API const uint32_t *tl_cut_added(const tl_cut *cut, size_t *count);
TL_API const uint32_t *tl_cut_removed(const tl_cut *cut, size_t *count);
TL_API const uint32_t *tl_cut_wanted(const tl_cut *cut, size_t *count);

/* The mesh of a cut: shared vertices welded, channels and regions as decoded, in an order that only
 * depends on which patches are drawn. channels [channel_count] are indices of channels of the
 * store; NULL: all. Gives *mesh. Runs on the pool. TL_ERR_UNSUPPORTED when it does not fit a mesh
 * in memory. */
TL_API tl_status tl_cut_mesh(tl_cut *cut, const size_t *channels, size_t channel_count,
                             tl_mesh **mesh);

/* ---- proving ---- */

/* How many cuts are tried: errors, levels, errors in a box, budgets and views in turn, drawn at
 * random. The same seed gives the same cuts, with any number of threads. */
typedef struct tl_cut_check_opts {
    size_t struct_bytes;
    uint32_t cuts; /* default 12 */
    uint32_t
        meshes;    /* so many of them, the first ones, as whole meshes, which takes the memory and
                      the time of making them; default UINT32_MAX: with an original all, else 12 */
    uint64_t seed; /* default 1 */
    bool has_step; /* default false: meshes have all channels; true: those of the step, which the
                      original has, too, and those of none */
    uint32_t step;
} tl_cut_check_opts;
TL_API tl_cut_check_opts tl_cut_check_opts_defaults(void);

/* Of one channel, in its unit: promise and measurement of the cut in which they were
 * nearest to each other. */
typedef struct tl_cut_check_channel {
    const char *name; /* borrows from the store */
    double promised, measured;
    double looseness; /* largest promise by measurement among whole levels; 0: none was tried */
} tl_cut_check_channel;

typedef struct tl_cut_check_result {
    uint32_t cuts_tried, meshes_made;
    tl_cut_check_channel *channels; /* [channel_count], gives: tl_cut_check_release */
    size_t channel_count;
    double boundary_promised, boundary_measured; /* as of a channel, mesh units */
    double boundary_looseness;
    double outside;    /* farthest that an original vertex was outside of a cut, mesh units */
    double volume_off; /* largest part of the volume that was missing or too much, at errors up to
                          10 % */
} tl_cut_check_result;

/* Draws cuts and proves that each is a mesh that fits together: every face at the border of a patch
 * has the tets on its sides, with the same values at its corners, that it has in a level as a
 * whole; no more tets are inverted and flat than in the finest mesh; the volume is within 0.5
 * % at errors up to 10 % of the ranges. Meshes are measured as wholes, too: no more faces of more
 * than two tets and no more open edges than the finest one has. With the original (may be NULL)
 * also, at every one of its vertices, that a point of the mesh within the promised boundary
 * distance has a value within the promised error (of channels on tets at the centroids of its
 * tets), and the distance of the boundaries, by brute force. TL_ERR_DATA names what does not hold.
 * Runs on the pool, reports progress. opts may be NULL. Gives *result, empty on failure. */
TL_API tl_status tl_cut_check(tl_ctx *ctx, tl_store *store, const tl_mesh *original,
                              const tl_cut_check_opts *opts, tl_cut_check_result *result);
TL_API void tl_cut_check_release(tl_ctx *ctx, tl_cut_check_result *result);

/* ---- decoded patches, as many as memory allows ---- */

/* Patches kept decoded under a limit of bytes, the ones used longest ago going first. Several
 * threads may use it at once, each with a context of its own; all contexts handed in must outlive
 * it. Typically one thread draws (has, get, release, want: what tl_cut_wanted says, then what
 * tl_cut_foresee says) while another one serves, or several load. */
typedef struct tl_residency tl_residency;

/* A decoded patch: its topology and the channels that the residency was made for. */
typedef struct tl_resident {
    uint32_t number;
    const tl_patch *patch;
    double *const *values; /* [channel_count] each [vert_count or tet_count][components] */
} tl_resident;

/* Borrows store; copies channels [channel_count] (indices of the store's; NULL: all). bytes_max:
 * limit of what is kept decoded; what is held by get counts, and may pass it alone. Gives
 * *residency. */
TL_API tl_status tl_residency_create(tl_ctx *ctx, tl_store *store, uint64_t bytes_max,
                                     const size_t *channels, size_t channel_count,
                                     tl_residency **residency);
/* Everything held must have been released. NULL is allowed. */
TL_API void tl_residency_destroy(tl_residency *residency);
/* True if the patch is there; counts as a use. residency is a tl_residency, so that this can be
 * given to tl_cut_set_resident. */
TL_API bool tl_residency_has(void *residency, uint32_t patch);
/* Holds a patch that is there, until it is released; NULL if it is not there. */
TL_API const tl_resident *tl_residency_get(tl_residency *residency, uint32_t patch);
TL_API void tl_residency_release(tl_residency *residency, const tl_resident *resident);
/* Replaces the list of patches to load, most wanted first, each at most once; copies. What is
 * there already is left out. TL_ERR_ARG for a number that is none. */
TL_API tl_status tl_residency_want(tl_ctx *ctx, tl_residency *residency, const uint32_t *patches,
                                   size_t patch_count);
/* Loads the most wanted patch that no other thread is loading; *idle tells that there was none.
 * What can't be read is not asked for again until it is wanted anew. */
TL_API tl_status tl_residency_load(tl_ctx *ctx, tl_residency *residency, bool *idle);
/* Loads what is wanted, now and later, on all threads of the context's pool, until
 * tl_residency_stop: for a thread of the caller that does nothing else, with a context that nothing
 * else uses. Waits where nothing is wanted. What can't be read does not end it; returned is the
 * first failure of a thread. */
TL_API tl_status tl_residency_serve(tl_ctx *ctx, tl_residency *residency);
/* Ends serving for good. Any thread. */
TL_API void tl_residency_stop(tl_residency *residency);
/* Bytes that are kept now, and patches. */
TL_API uint64_t tl_residency_bytes(tl_residency *residency, size_t *patch_count);

/* ---- gradients that agree across borders ---- */

/* Gradient of a scalar at every vertex: the mean of the gradients of its tets in all of the
 * patches, by volume; patches that share a vertex get the same. patches [patch_count], values
 * [patch_count][vert_count], gradients [patch_count][vert_count][3] (the caller's, in units of the
 * channel by mesh units; 0 where no tet has a volume). Normals of isosurfaces are these, made one
 * long. Runs on the pool. */
TL_API tl_status tl_patches_gradient(tl_ctx *ctx, const tl_lattice *lattice,
                                     const tl_patch *const *patches, size_t patch_count,
                                     const double *const *values, double *const *gradients);

/* ---- neighbours across the borders of patches (the part of the 0-segment, Sondershaus
 * 2007, 6.2.3)
 * ---- */

/* Which face of which patch lies behind a face at the border of a patch, kept up to date while
 * patches come and go. */
typedef struct tl_seams tl_seams;
TL_API tl_status tl_seams_create(tl_ctx *ctx, tl_seams **seams);
/* NULL is allowed. */
TL_API void tl_seams_destroy(tl_seams *seams);
/* Adds the border faces of a decoded patch under its number, borrowing it until it is removed.
 * TL_ERR_ARG if that number is there already. On failure nothing has changed. */
TL_API tl_status tl_seams_add(tl_seams *seams, uint32_t number, const tl_patch *patch);
/* TL_ERR_ARG if it is not there. */
TL_API tl_status tl_seams_remove(tl_seams *seams, uint32_t number);
/* The face behind face (4 * tet + face) of patch number, inside of it or in another patch. false:
 * it lies on the boundary, on a non-manifold face, or at a patch that is not there. */
TL_API bool tl_seams_behind(const tl_seams *seams, uint32_t number, uint32_t face,
                            uint32_t *other_number, uint32_t *other_face);
/* One numbering of vertices over all patches that are there: for each vertex of a patch
 * [vert_count] a number below *number_end that all patches which share it have, too, as long as one
 * of them is there; TL_NONE for those of its own. NULL if the patch is not there. Borrowed until it
 * is removed.
 */
TL_API const uint32_t *tl_seams_verts(const tl_seams *seams, uint32_t number, uint32_t *number_end);

#ifdef __cplusplus
}
#endif
#endif
