/* tetralod, stage mesh: tetrahedra and channels in memory; adjacency, boundary, quality, point
 * location and walking, invariant checks.
 *
 * A tet is four vertex indices (v0, v1, v2, v3); it is positive when (v1 - v0) x (v2 - v0) . (v3 -
 * v0) > 0, which is VTK's convention. Face i of a tet is the one opposite its vertex i. A tet that
 * names a vertex twice has no faces: it touches no other tet and adds nothing to the boundary,
 * which is the faces of exactly one tet. Objects are immutable once built, unless a function says
 * otherwise, and may then be read by several threads.
 *
 * What returns a status can also fail for TL_ERR_MEMORY and TL_ERR_BUDGET, and works on the thread
 * of its context. What only reads a mesh, a tet or a locator may be asked by several threads. */
#ifndef TETRALOD_MESH_H
#define TETRALOD_MESH_H

#include "tetralod/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Tets and vertices a mesh in memory can hold: 4 * tet + face must fit a tl_lidx. */
#define TL_MESH_TETS_MAX 0x3fffffffu
#define TL_MESH_VERTS_MAX 0xfffffffeu

/* Number types of files. */
typedef enum tl_scalar {
    TL_I8 = 0,
    TL_U8 = 1,
    TL_I16 = 2,
    TL_U16 = 3,
    TL_I32 = 4,
    TL_U32 = 5,
    TL_I64 = 6,
    TL_U64 = 7,
    TL_F32 = 8,
    TL_F64 = 9
} tl_scalar;
/* Bytes of one number: 1, 2, 4 or 8. */
TL_API size_t tl_scalar_bytes(tl_scalar scalar);
/* True if value is a number of that type, so that writing it as such loses nothing (NaN and
 * infinity: floating-point types only). */
TL_API bool tl_scalar_holds(tl_scalar scalar, double value);

/* Where the values of a channel stand. */
typedef enum tl_on { TL_ON_VERTEX = 0, TL_ON_TET = 1 } tl_on;

/* A named field. name and unit borrow from the mesh; unit is "" when unknown. */
typedef struct tl_channel {
    const char *name;
    const char *unit;
    uint32_t components; /* 1 scalar, 3 vector, 6 symmetric tensor, 9 tensor, or any other, >= 1 */
    tl_on on;
    tl_scalar scalar; /* the type it had in its file; what it is written as when it still fits */
    const double *values; /* [vert_count or tet_count][components] */
} tl_channel;

/* Tets with their channels and regions; holds on to its context, which must outlive it. */
typedef struct tl_mesh tl_mesh;

/* Copies the arrays. xyz [vert_count][3] in mesh units, tets [tet_count][4]. Gives *mesh.
 * TL_ERR_ARG if a count is too large, TL_ERR_DATA if an index is not below vert_count (the message
 * names the tet). Values need not be finite, tets need not be positive: see tl_mesh_check. */
TL_API tl_status tl_mesh_create(tl_ctx *ctx, const double *xyz, size_t vert_count,
                                const tl_lidx *tets, size_t tet_count, tl_mesh **mesh);

/* The same without a copy: takes over two blocks of tl_mem_alloc of this context, on success only.
 */
TL_API tl_status tl_mesh_adopt(tl_ctx *ctx, double *xyz, size_t vert_count, tl_lidx *tets,
                               size_t tet_count, tl_mesh **mesh);

/* NULL is allowed. */
TL_API void tl_mesh_destroy(tl_mesh *mesh);

/* Adds a channel while the mesh is still its builder's alone; copies name, unit and values.
 * A name that is taken on the same kind of element gets the suffix "_2", "_3" ... unit may be NULL
 * (unknown). TL_ERR_ARG for a channel without name, components or values. */
TL_API tl_status tl_mesh_add_channel(tl_mesh *mesh, const tl_channel *channel);
/* The same, taking over channel->values, a block of tl_mem_alloc, on success only. */
TL_API tl_status tl_mesh_adopt_channel(tl_mesh *mesh, const tl_channel *channel);
/* Sets region ids [tet_count] while the mesh is still its builder's alone; copies; NULL takes them
 * away. */
TL_API tl_status tl_mesh_set_regions(tl_mesh *mesh, const int32_t *regions);
/* Names a region, or gives it another name, while the mesh is still its builder's alone; copies. An
 * empty name or NULL takes it away. */
TL_API tl_status tl_mesh_set_region_name(tl_mesh *mesh, int32_t region, const char *name);

/* A named surface: side set, boundary condition, physical group. name and faces borrow from the
 * mesh. Faces may lie inside the mesh, and in several surfaces. */
typedef struct tl_label {
    const char *name; /* "" when the file has none */
    int32_t id;       /* of the file */
    size_t face_count;
    const tl_lidx *faces; /* [face_count] 4 * tet + face, ascending, each once */
} tl_label;

/* Adds a label while the mesh is still its builder's alone; copies. TL_ERR_ARG for a face that is
 * none of the mesh or stands before a smaller one (the message names it). */
TL_API tl_status tl_mesh_add_label(tl_mesh *mesh, const tl_label *label);

/* Sets the time value of the data, in the file's unit; NaN (the default) when there is none. */
TL_API void tl_mesh_set_time(tl_mesh *mesh, double time);

/* The context it was made with. */
TL_API tl_ctx *tl_mesh_ctx(const tl_mesh *mesh);
/* Vertices, those of no tet included, and tets. */
TL_API size_t tl_mesh_vert_count(const tl_mesh *mesh);
TL_API size_t tl_mesh_tet_count(const tl_mesh *mesh);
/* [vert_count][3], borrowed from the mesh. */
TL_API const double *tl_mesh_xyz(const tl_mesh *mesh);
/* [tet_count][4], borrowed. */
TL_API const tl_lidx *tl_mesh_tets(const tl_mesh *mesh);
/* [tet_count] or NULL, borrowed. */
TL_API const int32_t *tl_mesh_regions(const tl_mesh *mesh);
/* Name of a region, NULL if it has none. Borrowed, until another is named. */
TL_API const char *tl_mesh_region_name(const tl_mesh *mesh, int32_t region);
/* Labels in the order in which they were added. */
TL_API size_t tl_mesh_label_count(const tl_mesh *mesh);
/* index < label count. Borrowed from the mesh, until a label is added. */
TL_API const tl_label *tl_mesh_label(const tl_mesh *mesh, size_t index);
/* As set with tl_mesh_set_time. */
TL_API double tl_mesh_time(const tl_mesh *mesh);
/* Channels on vertices and tets together, in the order in which they were added. */
TL_API size_t tl_mesh_channel_count(const tl_mesh *mesh);
/* index < channel count. Borrowed from the mesh, until a channel is added. */
TL_API const tl_channel *tl_mesh_channel(const tl_mesh *mesh, size_t index);
/* First channel of that name, channels on vertices first; NULL if there is none. */
TL_API const tl_channel *tl_mesh_channel_by_name(const tl_mesh *mesh, const char *name);

/* Smallest and largest value of a channel over its first count elements, in its unit; of a channel
 * with several components the range of their Euclidean norm. Values that are not finite are left
 * out and counted (nonfinite_count may be NULL). Without any finite value both are 0. */
TL_API void tl_channel_range(const tl_channel *channel, size_t count, double range[2],
                             size_t *nonfinite_count);

/* What a mesh is, in numbers; lengths in mesh units. Tets with a vertex that is not finite count in
 * the topology only. */
typedef struct tl_mesh_stats {
    double bounds[6];       /* x0, x1, y0, y1, z0, z1 of the vertices that tets use; 0 if none */
    double diagonal;        /* of bounds */
    double volume;          /* sum of signed tet volumes, mesh units cubed */
    size_t inverted;        /* tets with exact negative orientation */
    size_t degenerate;      /* tets that are exactly flat */
    size_t nonfinite_verts; /* used vertices with a coordinate that is not finite */
    size_t unused_verts;    /* vertices of no tet */
    size_t duplicate_verts; /* used vertices at the place of an earlier one */
    size_t boundary_triangles;
    double boundary_area;       /* mesh units squared */
    size_t interface_triangles; /* faces between two regions */
    size_t components;          /* connected over faces */
    size_t nonmanifold_faces;   /* with more than two tets */
    size_t nonmanifold_edges;   /* boundary edges with other than two boundary faces */
    size_t nonmanifold_verts;   /* boundary vertices whose boundary faces are not one fan, none of
                                   whose edges is counted above */
    double quality_min;         /* mean ratio of the tets, 1 regular, 0 flat, below 0 inverted */
    double quality_median;      /* of an even count the mean of the middle two */
    double dihedral_min;        /* radians, over all tets that are not flat */
    double dihedral_max;
} tl_mesh_stats;

/* Computes them; runs on the pool. *stats is untouched on failure. TL_ERR_UNSUPPORTED for more than
 * 1,431,655,765 boundary triangles. */
TL_API tl_status tl_mesh_measure(tl_ctx *ctx, const tl_mesh *mesh, tl_mesh_stats *stats);

/* How much is proved: what is cheap, or all. */
typedef enum tl_check_level { TL_CHECK_FAST = 0, TL_CHECK_FULL = 1 } tl_check_level;

/* Proves the invariants of a mesh: indices in range, channels sized, (fast); finite coordinates,
 * four different vertices a tet, faces with at most two tets, no tet twice, exactly positive tets
 * (full). TL_ERR_DATA names the first tet, face or vertex that breaks one. */
TL_API tl_status tl_mesh_check(tl_ctx *ctx, const tl_mesh *mesh, tl_check_level level);

/* ---- topology ---- */

/* Opposite faces. Gives opposite [tet_count][4] (a block of tl_mem_alloc): 4 * tet + face of the
 * face on the other side, or TL_NONE on the boundary. A face with more than two tets is left
 * TL_NONE on all of its sides and counted once in nonmanifold_count (may be NULL). Of a tet with a
 * vertex twice all four are TL_NONE. Runs on the pool. */
TL_API tl_status tl_mesh_adjacency(tl_ctx *ctx, const tl_mesh *mesh, tl_lidx **opposite,
                                   size_t *nonmanifold_count);
/* The same over plain arrays: tets [tet_count][4]. TL_ERR_ARG if a count is too large or an index
 * not below vert_count (the message names the tet). */
TL_API tl_status tl_tets_adjacency(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count,
                                   size_t vert_count, tl_lidx **opposite,
                                   size_t *nonmanifold_count);

/* Vertex-to-tet incidence: the tets of vertex v are tet_ids[offsets[v]] .. tet_ids[offsets[v + 1] -
 * 1], ascending; a tet that names it twice is there twice. Gives offsets [vert_count + 1] and
 * tet_ids [4 * tet_count], blocks of tl_mem_alloc. Runs on the pool. */
TL_API tl_status tl_mesh_incidence(tl_ctx *ctx, const tl_mesh *mesh, tl_lidx **offsets,
                                   tl_lidx **tet_ids);
/* The same over plain arrays; TL_ERR_ARG as of tl_tets_adjacency. */
TL_API tl_status tl_tets_incidence(tl_ctx *ctx, const tl_lidx *tets, size_t tet_count,
                                   size_t vert_count, tl_lidx **offsets, tl_lidx **tet_ids);

/* Boundary triangles: the faces of exactly one tet, oriented outwards for positive tets; those of
 * more than two tets are none. Gives triangles [*triangle_count][3] and, if faces is not NULL,
 * faces
 * [*triangle_count] = 4 * tet + face, blocks of tl_mem_alloc. opposite is the result of
 * tl_mesh_adjacency, borrowed, or NULL to compute what is needed. Order: by tet, then face. Runs on
 * the pool. */
TL_API tl_status tl_mesh_boundary(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                  tl_lidx **triangles, tl_lidx **faces, size_t *triangle_count);

/* Numbers the components (connected over faces) 0 .. *component_count - 1 in order of their first
 * tet. Gives component [tet_count], a block of tl_mem_alloc; pass NULL to only count. opposite as
 * in tl_mesh_boundary. One thread. */
TL_API tl_status tl_mesh_components(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                    tl_lidx **component, size_t *component_count);

/* ---- single tets: finite corners; of others the results are some numbers ---- */

/* Corner positions p [4][3]. Signed volume in mesh units cubed. */
TL_API double tl_tet_volume(const double p[4][3]);
/* Mean ratio, 12 (3 |V|)^(2/3) / sum of squared edges, with the sign of V: 1 regular, 0 flat. */
TL_API double tl_tet_quality(const double p[4][3]);
/* Smallest and largest dihedral angle in radians, 0 to pi. */
TL_API void tl_tet_dihedral(const double p[4][3], double *smallest, double *largest);
/* Barycentric weights of x in a tet that is not flat: they sum to 1, and are negative beyond a
 * face. false for a flat one, or one whose volume a double can't hold; the weights are then
 * undefined. */
TL_API bool tl_tet_weights(const double p[4][3], const double x[3], double weights[4]);
/* Nearest point of a tet (flat ones too) to x, as barycentric weights, never negative; returns the
 * distance in mesh units, 0 inside. */
TL_API double tl_tet_nearest(const double p[4][3], const double x[3], double weights[4]);

/* ---- point location ---- */

/* Finds tets by place. */
typedef struct tl_locator tl_locator;
/* Borrows mesh. opposite as in tl_mesh_adjacency, borrowed; NULL computes it. Flat and inverted
 * tets hold no point, but are reached by tl_locator_nearest; tets with a vertex that is not finite
 * are never found. Gives *locator. Runs on the pool. */
TL_API tl_status tl_locator_create(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                   tl_locator **locator);
/* NULL is allowed. */
TL_API void tl_locator_destroy(tl_locator *locator);

/* The tet that holds x (its boundary included), TL_NONE if none does. Walks straight from hint (a
 * tet near x, or TL_NONE); where the walk leaves the mesh or meets a flat tet the tree is asked, so
 * the answer does not depend on convexity; where several tets hold x it is any of them. weights [4]
 * receives the barycentric weights, never negative (may be NULL; undefined for TL_NONE). TL_NONE
 * for an x that is not finite. Several threads may ask at once. */
TL_API tl_lidx tl_locator_find(const tl_locator *locator, const double x[3], tl_lidx hint,
                               double weights[4]);
/* The tet nearest to x; distance (mesh units, may be NULL) 0 if one holds it. For x outside the
 * mesh the nearest point lies on the boundary. weights [4] (may be NULL) are those of the nearest
 * point, never negative. TL_NONE, with an infinite distance, for an x that is not finite and for a
 * mesh without finite tets. Several threads may ask at once. */
TL_API tl_lidx tl_locator_nearest(const tl_locator *locator, const double x[3], tl_lidx hint,
                                  double weights[4], double *distance);

/* ---- points, lines, triangles: what is taken out of a mesh and drawn ---- */

typedef enum tl_poly_kind {
    TL_POLY_POINTS = 1,
    TL_POLY_LINES = 2, /* polylines */
    TL_POLY_TRIANGLES = 3
} tl_poly_kind;

/* Vertices with channels, and cells of one kind between them. Arrays are blocks of tl_mem_alloc. */
typedef struct tl_polydata {
    tl_poly_kind kind;
    size_t vert_count;
    double *xyz;    /* [vert_count][3], mesh units */
    float *normals; /* [vert_count][3], one long, 0 where there is none; NULL: no normals */
    size_t cell_count;
    tl_lidx *corners;     /* triangles: [cell_count][3]; lines: their vertices, one line behind the
                             other, [starts[cell_count]]; points: NULL, each vertex is a cell */
    tl_lidx *starts;      /* lines: [cell_count + 1]; else NULL */
    tl_channel *channels; /* [channel_count], on vertices; name, unit and values owned */
    size_t channel_count;
} tl_polydata;

/* Frees the arrays and itself. ctx as it was made with; NULL is allowed. */
TL_API void tl_polydata_destroy(tl_ctx *ctx, tl_polydata *polydata);
/* Adds a channel on vertices; copies name and unit, takes over channel->values, a block of
 * tl_mem_alloc [vert_count][components], on success only. */
TL_API tl_status tl_polydata_adopt_channel(tl_ctx *ctx, tl_polydata *polydata,
                                           const tl_channel *channel);
/* Area of the triangles, or length of the lines, in mesh units (squared); 0 of points. */
TL_API double tl_polydata_size(const tl_polydata *polydata);
/* True for triangles each of whose edges belongs to exactly two of them, in opposite directions, by
 * the numbers of its vertices. Triangles with a vertex twice count. */
TL_API tl_status tl_polydata_closed(tl_ctx *ctx, const tl_polydata *polydata, bool *closed);

#ifdef __cplusplus
}
#endif
#endif
