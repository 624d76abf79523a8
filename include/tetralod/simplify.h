/* tetralod, stage simplify: fewer tets at a known error. Edge collapses ordered by quadrics in
 * R^(3+k) (Sondershaus 2007, 3.1.3, 3.1.4, 4.1; Garland & Zhou 2005; Hoppe 1999). */
#ifndef TETRALOD_SIMPLIFY_H
#define TETRALOD_SIMPLIFY_H

#include "tetralod/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The order of the collapses. */
typedef enum tl_simplify_method {
    TL_SIMPLIFY_AUTO = 0,        /* the best by measurement: docs/notes says which and why */
    TL_SIMPLIFY_QUEUE = 1,       /* always the cheapest edge; one thread */
    TL_SIMPLIFY_INDEPENDENT = 2, /* rounds of independent edges below a rising threshold (4.1.1);
                                    one thread */
    TL_SIMPLIFY_RANDOMIZED = 3,  /* the cheapest of a few random edges; one thread */
    TL_SIMPLIFY_BLOCKS = 4       /* queues in blocks of the mesh, all threads; borders move */
} tl_simplify_method;

/* Where a collapse puts the vertex that stays. */
typedef enum tl_placement {
    TL_PLACE_OPTIMAL = 0, /* where the quadric is smallest */
    TL_PLACE_SUBSET = 1   /* at one of the two vertices; the result's vertices are original ones */
} tl_placement;

/* A channel that steers and is held. */
typedef struct tl_simplify_channel {
    const char *name; /* of a channel on vertices */
    double weight;    /* > 0; with equal weights the ranges of channels count equally */
    double error;     /* absolute bound at every original vertex in the channel's unit; 0: none */
} tl_simplify_channel;

/* One collapse: vertex gone moves into vertex kept, which is then at xyz. Indices are those of the
 * input mesh. Called on the caller's thread in an order in which the collapses can be repeated. */
typedef struct tl_collapse {
    tl_lidx kept, gone;
    double xyz[3];        /* position of kept after the collapse */
    const double *values; /* values of kept after it, the steering channels' components one after
                             the other; valid during the call */
    double cost;          /* quadric error, relative to squared ranges */
} tl_collapse;
/* Any status but TL_OK ends the simplification, which returns it. */
typedef tl_status (*tl_collapse_fn)(void *user, const tl_collapse *collapse);

typedef struct tl_simplify_opts {
    size_t struct_bytes;
    size_t target_tets; /* stop at or below that many tets; default 0: no target */
    double ratio;       /* the same as a fraction of the input's; default 0: no target */
    double error;       /* bound of every channel at every original vertex, as a fraction of its
                           range (where vectors are equally long, of the widest range of a
                           component); default 0: none. Without a target, simplifies as far as it
                           allows */
    double
        boundary_error; /* distance in mesh units between old and new boundary and interfaces that
                           must not be passed; default -1: 0.1 % of the diagonal. 0 keeps them */
    tl_simplify_method method;           /* default TL_SIMPLIFY_AUTO */
    tl_placement placement;              /* default TL_PLACE_OPTIMAL */
    const tl_simplify_channel *channels; /* borrowed; NULL: every channel on vertices, weight 1 */
    size_t channel_count;
    const uint8_t *locked; /* [vert_count] or NULL: vertices not 0 keep place and values and stay */
    double min_quality;    /* mean ratio that no new tet falls below, unless one before was worse;
                              default 0.01 */
    uint64_t seed;         /* of the randomized order; default 1 */
    tl_collapse_fn listener; /* default NULL. With an error bound it is called at the end, when
                                the bound is known to hold */
    void *listener_user;
} tl_simplify_opts;
TL_API tl_simplify_opts tl_simplify_opts_defaults(void);

/* What was reached. Errors are measured at every original vertex after the fact, in the channel's
 * unit; of a vector or tensor the norm of the difference. */
typedef struct tl_simplify_channel_result {
    const char *name; /* borrows from the input mesh */
    double max_error;
    double rms_error;
    double range[2];
} tl_simplify_channel_result;

typedef struct tl_simplify_result {
    size_t tets_in, tets_out, vertices_in, vertices_out;
    size_t inverted;       /* tets of the result that are negative; never more than in the input */
    size_t degenerate;     /* tets that are flat; never more than in the input */
    double boundary_error; /* bound on the two-sided distance of the boundaries and interfaces */
    size_t outside_vertices;
    double seconds;         /* simplification without measuring */
    double measure_seconds; /* locating and measuring every original vertex */
    size_t peak_bytes;      /* of the context during the call, input included */
    bool target_reached;    /* false: a bound or the shape of the mesh kept it from being reached */
    const char *stopped_by; /* "target", "error", "boundary error", "shape" */
    tl_simplify_channel_result *channels; /* [channel_count], gives: tl_simplify_release */
    size_t channel_count;
} tl_simplify_result;

/* Simplifies mesh, which stays as it is. Gives *out: positions, all channels on vertices and tets
 * (volume-weighted means), regions and time. Deterministic for any number of threads. opts may be
 * NULL only to be told so. Tets that are flat, inverted, doubled or non-manifold, and vertices
 * whose place or values are not finite are kept as they are and simplified around. TL_ERR_ARG for
 * options out of range; TL_ERR_DATA for a mesh without tets or an unknown channel. */
TL_API tl_status tl_mesh_simplify(tl_ctx *ctx, const tl_mesh *mesh, const tl_simplify_opts *opts,
                                  tl_mesh **out, tl_simplify_result *result);
TL_API void tl_simplify_release(tl_ctx *ctx, tl_simplify_result *result);

#ifdef __cplusplus
}
#endif
#endif
