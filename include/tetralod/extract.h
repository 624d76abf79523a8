/* tetralod, stage extract: what is drawn of a mesh: slices (isosurfaces, planes), and the fields
 * that are derived of its channels; lines along vector fields.
 *
 * A surface is a slice: where a scalar on vertices, linear in each tet, has a value. The scalar may
 * be a channel, a component or norm of one, the distance of a plane, or time.
 *
 * What returns a status can also fail for TL_ERR_MEMORY and TL_ERR_BUDGET, and runs on the pool
 * unless it says otherwise. Results do not depend on the number of threads. */
#ifndef TETRALOD_EXTRACT_H
#define TETRALOD_EXTRACT_H

#include "tetralod/cut.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Values that one slice can be taken at. */
#define TL_SLICE_VALUES_MAX 254u

/* Least and largest scalar of blocks of tets, so that slices skip the blocks that have no such
 * value. Immutable. */
typedef struct tl_range_index tl_range_index;
/* scalar [vert_count]; not kept. Gives *ranges. */
TL_API tl_status tl_range_index_create(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                                       tl_range_index **ranges);
/* NULL is allowed. */
TL_API void tl_range_index_destroy(tl_ctx *ctx, tl_range_index *ranges);

typedef struct tl_slice_opts {
    size_t struct_bytes;
    const double *values;         /* [value_count] finite, in any order; borrowed during a call */
    size_t value_count;           /* 1 to TL_SLICE_VALUES_MAX; default 0 */
    const double *gradients;      /* [vert_count][3] of the scalar, for normals; NULL (default): no
                                     normals. borrowed */
    const size_t *channels;       /* [channel_count] channels of the mesh that are carried along;
                                     default none. borrowed. One on tets gives each triangle
                                     vertices of its own */
    size_t channel_count;         /* each costs its values on the vertices of the result */
    const tl_range_index *ranges; /* of the same mesh and scalar; NULL (default): none. borrowed */
} tl_slice_opts;
TL_API tl_slice_opts tl_slice_opts_defaults(void);

/* Triangles where a scalar has one of the values, by marching tetrahedra. scalar [vert_count]; a
 * vertex of just the value counts as above it. Front sides (counterclockwise) and normals look to
 * lower values; across inverted tets the front sides are turned. Vertices are shared: one on each
 * edge that is cut, and at the same place to the bit wherever another mesh has that edge with the
 * same values. Tets with a corner that is not finite are left out. Vertices come in the order of
 * the tets that first have them, triangles in the order of their tets. Gives *triangles. TL_ERR_ARG
 * for options out of range, TL_ERR_UNSUPPORTED for more than 2^32 - 2 cut edges.
 * Sondershaus 2007, chapter 7; Cignoni et al. 1997, section V. */
TL_API tl_status tl_slice_mesh(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                               const tl_slice_opts *opts, tl_polydata **triangles);

/* ---- points on isosurfaces ---- */

typedef struct tl_points_opts {
    size_t struct_bytes;
    const double *values; /* [value_count] finite: isosurfaces that points lie on; default none: all
                             values from low to high, as many isosurfaces as points. borrowed */
    size_t value_count;   /* at most TL_SLICE_VALUES_MAX */
    double low, high;     /* without values; default -infinity, infinity */
    uint64_t count;       /* about so many points, 1 to 4,294,967,294; default 200,000 */
    double area;          /* above 0: in place of count, the area of isosurface that has one point,
                             mesh units squared; without values that times the distance of values
                             between isosurfaces that have one point each such area. default 0 */
    uint64_t seed;        /* other points; default 0 */
    const size_t *channels; /* [channel_count] channels of the mesh, on vertices, that are carried
                               along; default none. borrowed */
    size_t channel_count;
} tl_points_opts;
TL_API tl_points_opts tl_points_opts_defaults(void);

/* Points spread evenly over isosurfaces of a scalar [vert_count], without making triangles, with
 * their normals, which look to lower values. The points of a tet follow from the places of its
 * corners, the area and the seed: equal tets of other meshes have the same with the same area. Tets
 * with a corner that is not finite have none. area_used (may be NULL) receives the area of a point,
 * of count if that was given. Points come in the order of their tets. opts may be NULL. Gives
 * *points. TL_ERR_ARG for options out of range, TL_ERR_UNSUPPORTED for more than 2^32 - 2 points.
 * Sondershaus 2007, 7.2. */
TL_API tl_status tl_slice_points(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                                 const tl_points_opts *opts, double *area_used,
                                 tl_polydata **points);

/* ---- slices of a cut, patch by patch ---- */

/* Where a scalar of a model has one of some values: triangles for each patch that is drawn, which
 * stay as long as it is, so that a cut that moves costs what came and went. Patches whose stored
 * range (of a plane: whose sphere) misses all values are never read. Belongs to one thread at a
 * time; it and the store that it borrows use the context it was created with. */
typedef struct tl_slices tl_slices;

/* A scalar made of a value [components] of a carried channel, whose place in
 * tl_slices_opts.channels is given: before it is joined linearly between vertices. Any thread. */
typedef double (*tl_carry_fn)(const void *user, size_t place, const double *value,
                              uint32_t components);

typedef struct tl_slices_opts {
    size_t struct_bytes;
    uint32_t channel;     /* of the store, on vertices, of several components their norm; TL_NONE
                             (default): the distance from the plane */
    double plane[6];      /* a point and a normal; default: z = 0 */
    const double *values; /* [value_count] as of tl_slice_opts; copied */
    size_t value_count;
    bool normals; /* default true: of the gradient over the tets of all patches that are not passed
                     over, the same on both sides of a border */
    const uint32_t *channels; /* [channel_count] of the store, on vertices, to be carried along;
                                 default none; copied */
    size_t channel_count;
    tl_carry_fn carry;      /* what they become; NULL (default): they stay as they are */
    const void *carry_user; /* borrowed */
} tl_slices_opts;
TL_API tl_slices_opts tl_slices_opts_defaults(void);

/* Gives *slices, without a patch. TL_ERR_ARG for options out of range. */
TL_API tl_status tl_slices_create(tl_ctx *ctx, tl_store *store, const tl_slices_opts *opts,
                                  tl_slices **slices);
/* NULL is allowed. */
TL_API void tl_slices_destroy(tl_slices *slices);
/* Other values from the next update on, which decodes what these values cut. Copies. TL_ERR_ARG */
TL_API tl_status tl_slices_set_values(tl_slices *slices, const double *values, size_t value_count);
/* Goes over to these patches of one cut (tl_cut_patches), in any order, each once. Runs on the
 * pool. On failure those before stay. TL_ERR_ARG for a patch that is none, or there
 * twice; TL_ERR_IO and TL_ERR_FORMAT name the patch. */
TL_API tl_status tl_slices_update(tl_slices *slices, const uint32_t *patches, size_t patch_count);
/* The same of several slices [slices_count] of one store and context, each once: a patch that
 * several of them need is read and decoded once. *decoded (may be NULL) tells how many were. On
 * failure all are as they were. Fails as tl_slices_update. */
TL_API tl_status tl_slices_update_all(tl_slices *const *slices, size_t slices_count,
                                      const uint32_t *patches, size_t patch_count, size_t *decoded);

/* What is there, and what the last update took. */
typedef struct tl_slices_state {
    size_t patches;     /* that the values may cut */
    size_t decoded;     /* of them, for the last update */
    uint64_t tets;      /* of the decoded ones */
    size_t triangles;   /* of all */
    size_t passed_over; /* patches that the values miss */
    uint64_t bytes;     /* of memory that is kept */
} tl_slices_state;
TL_API tl_slices_state tl_slices_get_state(const tl_slices *slices);

/* Triangles of one patch, borrowed until the next update; NULL where the values miss it. Vertices
 * at borders are also there in the patches behind, at the same place, with the same values and
 * normals, all to the bit. Order as of tl_slice_mesh. */
TL_API const tl_polydata *tl_slices_patch(const tl_slices *slices, uint32_t patch);
/* All triangles, patch after patch by number, with one vertex where patches share one: closed
 * wherever the mesh of the cut is. Gives *triangles. TL_ERR_UNSUPPORTED for more than 2^32 - 2
 * vertices. */
TL_API tl_status tl_slices_join(const tl_slices *slices, tl_polydata **triangles);

/* ---- boundary: what can be seen of a mesh from outside ---- */

typedef struct tl_boundary_opts {
    size_t struct_bytes;
    const size_t
        *channels; /* [channel_count] channels of the mesh that are carried along; default
                      none. borrowed. One on tets gives each triangle vertices of its own */
    size_t channel_count;
    bool normals;  /* default true. Of a vertex the mean of its triangles by their angles there */
    double crease; /* degrees, 0 to 180, default 30: an edge sharper than that divides normals, and
                      so vertices */
    bool regions;  /* default true: of a mesh with regions those of the tets, as the channel
                      "region"; vertices are divided where they meet */
    bool interfaces; /* default false: also the faces between two regions, each once, behind those
                        of the boundary; "region" is then the smaller one of both, to which the back
                        sides look, and "region behind" the other one, NaN on the boundary */
    bool boundary;   /* default true; false: leaves the faces of the boundary out */
} tl_boundary_opts;
TL_API tl_boundary_opts tl_boundary_opts_defaults(void);

/* The triangles of tl_mesh_boundary, in their order, with channels, and of interfaces, by tet and
 * face, those of the tet of the smaller region; front sides and normals look out of that (positive)
 * tet. All triangles of one region, on either side, close wherever its tets fill it. A vertex is
 * shared by the triangles around it that edges of two triangles join. opposite of
 * tl_mesh_adjacency, borrowed, or NULL. opts may be NULL. Gives *triangles. TL_ERR_ARG for options
 * out of range. */
TL_API tl_status tl_boundary_surface(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                     const tl_boundary_opts *opts, tl_polydata **triangles);

/* ---- edges: features and silhouettes of a surface ---- */

/* Edges of triangles and the triangles beside them, found once and looked at for many cameras; a
 * surface may come and go in parts, for which only what came and went, and the edges at the rims of
 * parts, are looked at anew (Sondershaus 2007, 7.1). One thread at a time. */
typedef struct tl_edges tl_edges;
TL_API tl_status tl_edges_create(tl_ctx *ctx, tl_edges **edges);
/* NULL is allowed. */
TL_API void tl_edges_destroy(tl_ctx *ctx, tl_edges *edges);

/* A part of a surface; copied. Zeroed where not said otherwise. */
typedef struct tl_edges_part {
    const double *xyz; /* [vert_count][3], mesh units */
    size_t vert_count;
    const uint32_t *shared;   /* [vert_count], or NULL: a number that all parts which share the
                                 vertex have, too (tl_seams_verts), TL_NONE for those of its own */
    const tl_lidx *triangles; /* [triangle_count][3] */
    size_t triangle_count;
    const int32_t *regions; /* [triangle_count], or NULL: all of region 0 */
} tl_edges_part;
/* Adds a part under a number. On failure nothing has changed: TL_ERR_ARG if the number is there
 * already, TL_ERR_DATA for a corner that is no vertex, TL_ERR_UNSUPPORTED for too many triangles.
 */
TL_API tl_status tl_edges_add(tl_ctx *ctx, tl_edges *edges, uint32_t number,
                              const tl_edges_part *part);
/* Adds the boundary of a mesh with its regions as a part. opposite as of tl_boundary_surface. */
TL_API tl_status tl_edges_add_mesh(tl_ctx *ctx, tl_edges *edges, uint32_t number,
                                   const tl_mesh *mesh, const tl_lidx *opposite);
/* Adds the boundary of a patch of a cut, under its number: faces with nothing behind them among the
 * patches in seams, where all of the cut are by now. A patch that goes has to go from edges before
 * seams get another one, whose vertices may have its numbers. TL_ERR_ARG if it is not in seams. */
TL_API tl_status tl_edges_add_patch(tl_ctx *ctx, tl_edges *edges, uint32_t number,
                                    const tl_lattice *lattice, const tl_patch *patch,
                                    const tl_seams *seams);
/* TL_ERR_ARG if it is not there. */
TL_API tl_status tl_edges_remove(tl_ctx *ctx, tl_edges *edges, uint32_t number);

/* Which edges, as a set. */
typedef enum tl_edge_kind {
    TL_EDGE_SHARP = 1,       /* the normals of its two triangles are more than an angle apart */
    TL_EDGE_REGION = 2,      /* its two triangles are of different regions */
    TL_EDGE_OPEN = 4,        /* of one triangle */
    TL_EDGE_NONMANIFOLD = 8, /* of more than two, or of two that are turned against each other */
    TL_EDGE_SILHOUETTE = 16  /* one of its two triangles looks at the camera, the other one not */
} tl_edge_kind;

typedef struct tl_edges_opts {
    size_t struct_bytes;
    unsigned kinds;          /* tl_edge_kind; default all but silhouettes */
    double angle;            /* degrees, 0 to 180, default 30: of sharp edges */
    const tl_camera *camera; /* of silhouettes; borrowed during a call */
} tl_edges_opts;
TL_API tl_edges_opts tl_edges_opts_defaults(void);

/* Edges of the kinds asked for, joined to polylines that end where other than two of them meet;
 * those that are hidden are among them. A triangle without area is beside no sharp edge and no
 * silhouette. The order depends on the parts and their numbers alone. Gives *lines. TL_ERR_ARG for
 * options out of range, or silhouettes without a camera. */
TL_API tl_status tl_edges_lines(tl_ctx *ctx, tl_edges *edges, const tl_edges_opts *opts,
                                tl_polydata **lines);

/* ---- scalars to slice, fields to look at ---- */

/* out [vert_count]: distance of each vertex from a plane, mesh units, positive on the side of its
 * normal, which need not be one long. TL_ERR_ARG for a normal of no length. */
TL_API tl_status tl_plane_distance(tl_ctx *ctx, const tl_mesh *mesh, const double origin[3],
                                   const double normal[3], double *out);

/* out [vert_count][components][3]: gradient of each component of a channel on vertices, in its unit
 * by mesh units: at a vertex the mean over its tets by volume. 0 where no tet has a volume or is
 * finite. */
TL_API tl_status tl_mesh_gradient(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                                  double *out);

/* What can be made of a channel. Of vectors u, with the gradients of tl_mesh_gradient. */
typedef enum tl_derived {
    TL_DERIVED_MAGNITUDE = 0,  /* Euclidean norm of any number of components */
    TL_DERIVED_GRADIENT = 1,   /* [components][3] of any number of components */
    TL_DERIVED_DIVERGENCE = 2, /* of 3 components */
    TL_DERIVED_VORTICITY = 3,  /* [3], curl u of 3 components */
    TL_DERIVED_Q = 4 /* of 3 components: half of what the squared norm of the antisymmetric part of
                        grad u has above that of the symmetric one (Hunt 1988) */
} tl_derived;
/* Components of the result; 0 if it can't be made of so many. */
TL_API uint32_t tl_derived_components(tl_derived derived, uint32_t components);
/* out [vert_count or tet_count][tl_derived_components]. TL_ERR_ARG for components it can't be made
 * of, and for all but the magnitude of a channel on tets. */
TL_API tl_status tl_derive(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                           tl_derived derived, double *out);

/* ---- expressions of channels ---- */

/* A formula, read once. Immutable.
 *
 * Operands: numbers, pi, positions x y z, names of channels; a name with other characters than
 * letters, digits and _, or that is one of these words, stands in single or double quotes (a quote
 * in it twice). Components: U.x U.y U.z U[0] U[1] ...
 * Operators, from loose to tight: || && (== != < <= > >=) (+ -) (* /) (- + ! in front) ^. What is
 * not 0 is true; a comparison is 1 or 0. Operators and functions of numbers work by component, a
 * scalar with each component of a vector.
 * Functions: abs sqrt exp log log10 sin cos tan (radians) atan2(y, x) min max (of two or more; NaN
 * only if all are) if(condition, then, else) vec(a, b, ...) mag(v) norm(v) (v made one long; 0
 * stays 0) dot(u, v) cross(u, v), and on vertices grad(s) (3 components for each of s) div(v)
 * curl(v) qcriterion(v), as of tl_derive, of any expression. */
typedef struct tl_expression tl_expression;
/* Gives *expression. TL_ERR_ARG names the column, from 1, and what was expected there; a text has
 * at most 4,096 bytes. */
TL_API tl_status tl_expression_parse(tl_ctx *ctx, const char *text, tl_expression **expression);
/* NULL is allowed. */
TL_API void tl_expression_destroy(tl_ctx *ctx, tl_expression *expression);
/* Values of an expression over a mesh: on vertices if all of its names are channels on vertices,
 * else on tets, whose positions are their centroids. Fills *channel, without a name; gives
 * channel->values (tl_mem_free). TL_ERR_ARG for names that are none, or not on the same kind of
 * element, and for components that don't fit, with the column. */
TL_API tl_status tl_expression_evaluate(tl_ctx *ctx, const tl_expression *expression,
                                        const tl_mesh *mesh, tl_channel *channel);
/* Adds an expression's values as a channel while the mesh is still its builder's alone. TL_ERR_ARG
 * also for a name that is taken. */
TL_API tl_status tl_mesh_derive(tl_ctx *ctx, tl_mesh *mesh, const char *name, const char *text);

/* ---- parts of a mesh: regions, thresholds, planes ---- */

/* keep [tet_count], 1 for what is shown, 0 for what is not: sets to 0 the tets at none of whose
 * corners (any) or not at all of whose corners (else) a channel is from low to high, its own value
 * for one on tets; of several components their norm. NaN is never from low to high. */
TL_API tl_status tl_keep_range(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                               double low, double high, bool any, uint8_t *keep);
/* The same for the tets of regions [region_count] (hide), or of any other (else); without regions
 * all are of region 0. */
TL_API tl_status tl_keep_regions(tl_ctx *ctx, const tl_mesh *mesh, const int32_t *regions,
                                 size_t region_count, bool hide, uint8_t *keep);
/* The tets that are kept, in their order, and the vertices they use, in theirs, with channels,
 * regions, labels and time. Gives *subset. */
TL_API tl_status tl_mesh_subset(tl_ctx *ctx, const tl_mesh *mesh, const uint8_t *keep,
                                tl_mesh **subset);

/* A side of space, normal . x <= offset, normal of any length: what lies there is kept. */
typedef struct tl_half_space {
    double normal[3], offset;
} tl_half_space;
/* What lies on all sides [side_count] of a mesh. Tets that a plane cuts are split into tets, so
 * that what is linear in them stays so, and neighbours still fit; those that only touch a plane
 * from outside go. Vertices of the mesh stand before new ones, which are at the same place to the
 * bit wherever another mesh has the edge they are on. With channels, regions, labels and time. Tets
 * with a corner that is not finite go. Gives *clipped. TL_ERR_ARG for a side that is none,
 * TL_ERR_UNSUPPORTED for too large a result. */
TL_API tl_status tl_mesh_clip(tl_ctx *ctx, const tl_mesh *mesh, const tl_half_space *sides,
                              size_t side_count, tl_mesh **clipped);
/* The same of points, lines or triangles; of a cut triangle the rest is one or two. */
TL_API tl_status tl_polydata_clip(tl_ctx *ctx, const tl_polydata *polydata,
                                  const tl_half_space *sides, size_t side_count,
                                  tl_polydata **clipped);

/* ---- streamlines ---- */

typedef enum tl_stream_direction {
    TL_STREAM_FORWARD = 1,
    TL_STREAM_BACKWARD = 2,
    TL_STREAM_BOTH = 3
} tl_stream_direction;

/* Why one direction of a line ended. */
typedef enum tl_stream_end {
    TL_STREAM_END_BOUNDARY = 0, /* left the mesh: the last vertex lies on the boundary */
    TL_STREAM_END_LENGTH = 1,
    TL_STREAM_END_TIME = 2,
    TL_STREAM_END_STEPS = 3,
    TL_STREAM_END_SPEED = 4,
    TL_STREAM_END_LOOP = 5,  /* came back to where it had been, in the same direction */
    TL_STREAM_END_VALUE = 6, /* met a vector that is not finite */
    TL_STREAM_END_COUNT = 7
} tl_stream_end;

typedef struct tl_stream_opts {
    size_t struct_bytes;
    unsigned order;                /* 2 (default): second order, steps of a fixed part of a tet;
                                      5: Dormand & Prince's fifth order, steps by their error */
    tl_stream_direction direction; /* default both; a line's vertices follow the flow */
    double step; /* of order 2 the step, of order 5 the longest one: in parts of the longest chord
                    of the tet along the flow; above 0, at most 64; default 0: 0.5 and 2. The error
                    of order 2 grows with its square, the time falls */
    double tolerance;  /* order 5: error of a step, in parts of the diagonal of the mesh; above 0,
                          default 1e-7 */
    double length_max; /* of each direction, mesh units; default 0: four diagonals */
    double time_max;   /* of each direction, in lengths by speed; default 0: none */
    size_t step_max;   /* of each direction; default 10,000 */
    double speed_min;  /* a slower point ends a line; in parts of the largest speed on vertices, 0
                          to 1; default 1e-6 */
    const size_t *channels; /* [channel_count] channels of the mesh, on vertices, that are carried
                               along; default none. borrowed */
    size_t channel_count;
    bool normals; /* for ribbons (TL_LINE_RIBBON): across each line, turning about it as the flow
                     does, by half of the vorticity along it; the first one is the z axis as far as
                     that lies across. default false */
} tl_stream_opts;
TL_API tl_stream_opts tl_stream_opts_defaults(void);

/* What became of the seeds. */
typedef struct tl_stream_report {
    size_t seeds_outside; /* of the mesh, or where nothing flows: no line */
    size_t
        seeds_covered; /* tl_streamlines_cover: cells that a line ran through before their turn */
    uint64_t steps;    /* of the lines that were given */
    size_t ends[TL_STREAM_END_COUNT]; /* by tl_stream_end, one for each direction of each line */
} tl_stream_report;

/* Lines along a field of vectors, linear in each tet, from seeds, by walking from tet to tet. Where
 * a step would leave the mesh it is halved, so that a line follows a wall and never jumps over one;
 * where the mesh has flat or inverted tets the locator is asked. A line is closed by a last vertex
 * near its first one if it is a loop.
 * opposite  of tl_mesh_adjacency, or NULL to compute it
 * locator   of this mesh, or NULL to make one
 * vectors   [vert_count][3]; of a vertex where it is not finite nothing is followed
 * seeds     [seed_count][3]; a line for each one in the mesh, in this order
 * opts      may be NULL
 * report    may be NULL
 * Gives *lines, with the channels "time" (from the seed, negative before it) and "speed", then
 * those carried along; a name that is taken gets "_2". TL_ERR_ARG for options out of range,
 * TL_ERR_UNSUPPORTED for more than 2^32 - 2 vertices, TL_ERR_CANCELLED. Sondershaus 2007, 7.3.1. */
TL_API tl_status tl_streamlines(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                const tl_locator *locator, const double *vectors,
                                const double *seeds, size_t seed_count, const tl_stream_opts *opts,
                                tl_polydata **lines, tl_stream_report *report);

/* The same with seeds that cover a box evenly: a grid of cubic cells, cells along its longest side,
 * 1 to 1,024; a line begins in each cell that no earlier one ran through. bounds (x0, x1, y0, y1,
 * z0, z1) may be NULL: that of the mesh. */
TL_API tl_status tl_streamlines_cover(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                      const tl_locator *locator, const double *vectors,
                                      const double bounds[6], uint32_t cells,
                                      const tl_stream_opts *opts, tl_polydata **lines,
                                      tl_stream_report *report);

/* Which lines run through a box, for those that are drawn full while the others are ghosts
 * (Sondershaus 2007, 7.3.2). bounds as above; selected [cell_count] 1 or 0; returns how many are.
 * One thread. */
TL_API size_t tl_lines_in_box(const tl_polydata *lines, const double bounds[6], uint8_t *selected);
/* The lines whose mark [cell_count] is not 0 (wanted) or is 0 (else), in their order, with the
 * vertices they use, their channels and normals. Gives *picked. */
TL_API tl_status tl_lines_pick(tl_ctx *ctx, const tl_polydata *lines, const uint8_t *marks,
                               bool wanted, tl_polydata **picked);

/* Points where a field of vectors, linear in each tet, is 0: inside of tets, and vertices none of
 * whose neighbours is 0, so that a wall where nothing flows is none. Gives *points in the order of
 * their tets, each once. TL_ERR_UNSUPPORTED for more than 2^32 - 2. */
TL_API tl_status tl_critical_points(tl_ctx *ctx, const tl_mesh *mesh, const double *vectors,
                                    tl_polydata **points);

/* Seeds, evenly spread; one thread. Each gives *seeds as points, count above 0 and at most 2^24,
 * TL_ERR_ARG for what has no extent or is not finite. From a to b, both included; one alone stands
 * in the middle. */
TL_API tl_status tl_seeds_line(tl_ctx *ctx, const double a[3], const double b[3], size_t count,
                               tl_polydata **seeds);
/* Of a box, flat ones too: the centres of about count cubes (or squares). */
TL_API tl_status tl_seeds_box(tl_ctx *ctx, const double bounds[6], size_t count,
                              tl_polydata **seeds);
/* Of a plane, as far as it lies in a box: the centres of about count squares. */
TL_API tl_status tl_seeds_plane(tl_ctx *ctx, const double origin[3], const double normal[3],
                                const double bounds[6], size_t count, tl_polydata **seeds);
/* On a sphere around each point, count of them: along a spiral of equal area. */
TL_API tl_status tl_seeds_around(tl_ctx *ctx, const tl_polydata *points, double radius,
                                 size_t count, tl_polydata **seeds);

#ifdef __cplusplus
}
#endif
#endif
