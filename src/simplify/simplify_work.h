/* Stage simplify, internal: the mesh while it shrinks. Vertices and tets are renumbered along a
 * Hilbert curve, every vertex knows its tets (its star), every tet knows which of its faces lie on
 * a surface (boundary or interface) that has to be kept. No opposite faces are maintained: a
 * collapse needs the two stars only. */
#ifndef TETRALOD_SRC_SIMPLIFY_WORK_H
#define TETRALOD_SRC_SIMPLIFY_WORK_H

#include "base/base.h"
#include "mesh/mesh.h"
#include "simplify/simplify_piece.h"
#include "tetralod/simplify.h"

/* Tets of two stars together past which an edge is not collapsed: scratch space is bounded by it.
 */
#define TLI_STAR_MAX 1024u
/* Vertices of an edge's ring past which it is not collapsed: rows of a bit matrix. */
#define TLI_RING_MAX 64u

/* Components of all steering channels together, at most. */
#define TLI_COMPONENTS_MAX 256u

/* How free a vertex is. The order matters: an edge collapses towards the higher class. */
typedef enum tli_class {
    TLI_FREE = 0,    /* inside */
    TLI_SURFACE = 1, /* on one sheet of boundary or interface */
    TLI_CURVE = 2,   /* on a curve where sheets meet */
    TLI_CORNER = 3,  /* where curves meet, or locked by the caller: place and values stay */
    TLI_FROZEN = 4   /* its tets must not change: non-manifold, flat, inverted, not finite */
} tli_class;

/* Which corner of a tet is v; one of them has to be. */
static inline unsigned tli_corner_of(const tl_lidx q[4], tl_lidx v)
{
    return (unsigned)((q[1] == v) | (q[2] == v) << 1 | (q[3] == v) * 3u);
}

/* What an attempt left undone. */
typedef enum tli_verdict {
    TLI_DONE = 0,
    TLI_NO_TOPOLOGY, /* would change the topology */
    TLI_NO_SHAPE,    /* would turn or flatten a tet */
    TLI_NO_BOUNDARY, /* would move a surface too far */
    TLI_NO_ERROR,    /* would break the error bound at an original vertex */
    TLI_NO_ROOM,     /* too many tets around the edge */
    TLI_VERDICT_COUNT
} tli_verdict;

/* A first look at the shapes of count tets that share a vertex at 0, with their other corners in
 * columns x y z of three: how sure is it that all are positive and not badly shaped?
 * simplify_cost.inc.h */
typedef enum tli_shapes { TLI_SHAPES_FINE, TLI_SHAPES_UNSURE, TLI_SHAPES_TURNED } tli_shapes;
/* Tets looked at at a time. */
enum { TLI_LOOK = 16 };
typedef tli_shapes (*tli_shapes_fn)(const float (*corners)[TLI_LOOK], size_t count, float least);

/* The tets around a vertex. The array belongs to a star bank (or is part of the first incidence).
 */
typedef struct tli_star {
    uint32_t *tets;
    uint32_t count, capacity;
} tli_star;

/* Where new star arrays come from: one bank a worker, so that workers need no lock. */
enum { TLI_BANK_CLASSES = 64, TLI_BANK_STEP = 8 };
typedef struct tli_star_bank {
    tli_arena arena;
    uint32_t *room; /* rest of the newest chunk */
    size_t room_count;
    uint32_t *free_lists[TLI_BANK_CLASSES]; /* by capacity / TLI_BANK_STEP; first bytes: next */
} tli_star_bank;

/* Everything a collapse touches of a neighbour, in one cache line. */
typedef struct tli_vertex {
    double xyz[3]; /* mesh units */
    tli_star star;
    uint32_t version; /* counts the collapses into the vertex, so that old queue entries show */
    uint16_t block;   /* block that may change the vertex; with 4.1.1: not 0 once it took part */
    tl_lidx origin;   /* index in the input */
    tl_lidx merged;   /* vertex this one went into; itself while it lives; TL_NONE if of no tet */
    float surface_bound; /* distance between the faces at this vertex and the input's, mesh units */
    uint8_t kind;        /* tli_class */
    uint8_t border;      /* in its block, with a neighbour outside */
    int16_t step;        /* of its place: simplify_piece.h */
} tli_vertex;

typedef struct tli_work {
    tl_ctx *ctx;
    size_t vert_count, tet_count; /* in the arrays; the input's, but for tets that are dropped */
    size_t input_tets;
    size_t tets_live, verts_live;

    /* per tet */
    tl_lidx (*tets)[4];  /* tets[t][0] is TL_NONE when the tet is gone */
    uint8_t *faces;      /* bit f: face f lies on a surface; bit 4 + f: on the boundary */
    int32_t *regions;    /* or NULL */
    tl_lidx *tet_origin; /* index in the input; NULL when no channel on tets asks for it */

    tli_vertex *verts;
    uint16_t *marks; /* [vert_count] local numbers and the like; 0 outside of an attempt */
    double *values;  /* [vert_count][components], scaled: the largest range is 1 times the weight */
    float *quadrics; /* [vert_count][quadric_floats]; behind the quadric the values, rounded */

    tl_lidx *incidence; /* the first stars point into it */
    tli_star_bank *banks;
    unsigned bank_count;

    /* surface faces of the input, an interface face once; freed with the quadrics */
    tl_lidx (*surface)[3];
    size_t surface_count;
    tl_lidx (*sharp)[2]; /* sharp edges of the boundary (4.1.2) */
    size_t sharp_count;

    size_t components;     /* of all steering channels together */
    size_t quadric_floats; /* stride of quadrics, a multiple of 16: whole cache lines */
    double last_cost;      /* what the last collapses may cost, about; 0: not known */
    double scale;          /* 1 / diagonal */
    double centre[3];      /* of the bounding box, mesh units */
    double rounding;       /* mesh units: surface moves below it are rounding of coordinates */
    double boundary_error; /* mesh units */
    double volume_room;    /* mesh units, cubed: how far the volume may go; INFINITY: not watched */
    double volume_change;  /* so far, where it is watched (one thread) */
    double shape_cube;     /* least mean ratio, cubed */
    tli_shapes_fn shapes;
    tl_placement placement;
    struct {
        uint32_t components;
        double scale;
    } * channels; /* [channel_count] the steering channels */
    size_t channel_count;
    size_t verdicts[TLI_VERDICT_COUNT];
    tl_collapse_fn listener;
    void *listener_user;
    struct tli_carry *carry;  /* NULL without an error bound */
    bool has_surfaces_inside; /* interfaces: faces of two tets carry bits */
} tli_work;

typedef struct tli_carry tli_carry;     /* simplify_carry.c */
typedef struct tli_carried tli_carried; /* what a worker keeps of it */
/* Scratch space of one worker and what it found around an edge. */
typedef struct tli_hood tli_hood;

/* simplify_work.c */
/* thin_target: tets on the way to which the mesh may be thinned at once; SIZE_MAX: not at all.
 * opts: complete, every channel named; channel_scales [channel_count] turn values into cost units.
 */
tl_status tli_work_create(tl_ctx *ctx, const tl_mesh *mesh, const tl_simplify_opts *opts,
                          const double *channel_scales, size_t thin_target, tli_work **work);
/* The same for a piece of a larger mesh, which is not thinned. */
tl_status tli_work_create_piece(tl_ctx *ctx, const tli_piece *piece, tli_work **work);
void tli_work_destroy(tli_work *work);
/* Frees all but the vertices, and their stars with it. */
void tli_work_drop_tets(tli_work *work);
/* Drops tets that are gone from the arrays and from all stars. */
tl_status tli_work_compact(tli_work *work);
bool tli_has_tet_channels(const tl_mesh *mesh);
/* verts [verts_live] receives the vertices that are left, ascending; returns their number. */
size_t tli_work_list_live(const tli_work *work, tl_lidx *verts);
/* The largest distance that a surface may have moved, mesh units. */
double tli_work_surface_bound(const tli_work *work);

/* simplify_surface.c: marks surface faces, classes and frozen vertices. opposite as in
 * tl_tets_adjacency. is_piece: faces between locked vertices are where it was cut out. */
tl_status tli_work_find_surfaces(tli_work *work, const tl_lidx *opposite, size_t nonmanifold_faces,
                                 const uint8_t *locked, bool is_piece);

/* simplify_quadric.c: the quadrics of the field at all vertices. inner [vert_count], or NULL, tells
 * of which ones it is sure that they lie on no surface and that all their tets are solid. */
tl_status tli_work_set_quadrics(tli_work *work, uint8_t *inner);
/* Takes given ones instead: quadrics [input vertices][tli_quadric_floats]. */
void tli_work_take_quadrics(tli_work *work, const float *quadrics);
/* Multiplies them: shares [input vertices]. */
void tli_work_share_quadrics(tli_work *work, const float *shares);
/* Adds those of surfaces and sharp edges, unless they are known to be in already; releases the
 * lists of both. */
void tli_work_add_surface_quadrics(tli_work *work, bool known);

/* simplify_thin.c: takes inner vertices away whose loss costs little, before surfaces are known;
 * not below target tets. */
tl_status tli_work_thin(tli_work *work, const uint8_t *inner, size_t target);

/* Writes values [components] behind the quadric of v, where the cost kernel reads them. */
static inline void tli_work_round_values(tli_work *work, tl_lidx v, const double *values)
{
    float *to = work->quadrics + v * work->quadric_floats + 11 + 4 * work->components;
    for (size_t i = 0; i < work->components; i++) to[i] = (float)values[i];
}

/* simplify_star.c */
/* Room for count tets in a star, which keeps those that it has. */
tl_status tli_star_reserve(tli_star_bank *bank, tli_star *star, uint32_t count);
/* Empties a star; its memory serves others of the bank. */
void tli_star_release(tli_star_bank *bank, tli_star *star);

/* simplify_collapse.c */
tl_status tli_hood_create(tl_ctx *ctx, const tli_work *work, tli_hood **hood);
void tli_hood_destroy(tl_ctx *ctx, tli_hood *hood);
/* Collapses the edge u v if all is well; bank gives star memory.
 * *tets_gone receives the number of tets that vanished. On TLI_DONE *kept is the vertex that stays.
 */
tl_status tli_collapse_edge(tli_work *work, tli_hood *hood, tli_star_bank *bank, tl_lidx u,
                            tl_lidx v, tli_verdict *verdict, tl_lidx *kept, uint32_t *tets_gone);
/* Neighbours of u, each once, into out [3 * TLI_STAR_MAX]; returns their number, 0 when the star is
 * too large. */
size_t tli_star_neighbours(tli_work *work, tl_lidx u, tl_lidx *out);

#endif
