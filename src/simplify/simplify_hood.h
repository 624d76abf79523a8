/* Stage simplify, internal: what lies around an edge, in local numbers. One for each worker. */
#ifndef TETRALOD_SRC_SIMPLIFY_HOOD_H
#define TETRALOD_SRC_SIMPLIFY_HOOD_H

#include "simplify/simplify_quadric.h"
#include "simplify/simplify_work.h"

enum { TLI_HOOD_VERTS = 3 * 1024 + 2, TLI_FAN_MAX = 256 };

/* A tet that keeps only one end of the edge: its other three vertices, so that the end and they are
 * a positive tet. */
typedef struct tli_hood_tet {
    tl_lidx tet;
    uint16_t verts[3];
} tli_hood_tet;

/* A surface face at the edge, in local numbers; group tells sheets apart. */
typedef struct tli_fan_face {
    uint16_t verts[3];
    int64_t group;
} tli_fan_face;

/* Local vertices 0 and 1 are the ends u and v of the edge. */
struct tli_hood {
    tl_lidx ends[2];
    tl_lidx verts[TLI_HOOD_VERTS];
    uint8_t flags[TLI_HOOD_VERTS];
    uint16_t vert_count;

    tli_hood_tet sides[2][TLI_STAR_MAX]; /* tets of u alone, of v alone */
    uint32_t side_counts[2];
    tl_lidx gone[TLI_RING_MAX];          /* tets of both */
    uint16_t gone_ring[TLI_RING_MAX][2]; /* their other two vertices */
    uint32_t gone_count;

    tli_fan_face fan[TLI_FAN_MAX]; /* surface faces at u or v, each once */
    uint32_t fan_count;

    float corners[9][TLI_LOOK];    /* of the changed tets, from place, in edge lengths */
    double place[3];               /* of the new vertex, mesh units */
    int16_t step;                  /* of that place */
    double rel[TLI_HOOD_VERTS][3]; /* of the neighbours, from place */
    double rel2[TLI_HOOD_VERTS];
    double *values;       /* [components] of the new vertex */
    double *sum;          /* [quadric_floats] quadric of the edge at anchor u */
    float surface_bound;  /* of the new vertex */
    double volume_change; /* by the collapse, where the work watches it */
    tli_carried *carried; /* NULL without an error bound */
};

/* Empties the hood for the edge u v; says whether such an edge may be collapsed at all. */
tli_verdict tli_hood_begin(const tli_work *work, tli_hood *hood, tl_lidx u, tl_lidx v);
/* Fills the hood and checks the topology (link condition with the boundary's dummy vertex,
 * Sondershaus 2007, 3.1.3; the same in the surface complex). shapes_fine: all tets of the collapse,
 * which has a free end, are known to be positive. */
tli_verdict tli_hood_gather(tli_work *work, tli_hood *hood, bool shapes_fine);
/* Lists the surface faces at both ends; false when there are too many. */
bool tli_hood_list_fan(const tli_work *work, tli_hood *hood);

/* simplify_fan.c: bound on the two-sided distance between the old fan and the fan around place; any
 * number above most where it is above. */
double tli_fan_distance(const tli_work *work, const tli_hood *hood, const double place[3],
                        double most);
/* What the volume under the boundary changes by when the fan is one around place. */
double tli_fan_volume_change(const tli_work *work, const tli_hood *hood, const double place[3]);
/* Plane on which place keeps the volume under the fan: normal . (x - u) = offset, mesh units; false
 * when the fan has no such plane (it folds back on itself). */
bool tli_fan_volume_plane(const tli_work *work, const tli_hood *hood, double normal[3],
                          double *offset);

#endif
