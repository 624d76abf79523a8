/* Stage mesh, internal: the struct behind tl_mesh, for the stages below that build and read it
 * fast. */
#ifndef TETRALOD_SRC_MESH_H
#define TETRALOD_SRC_MESH_H

#include "base/base.h"
#include "tetralod/mesh.h"

/* The name of a region. */
typedef struct tli_region_name {
    int32_t region;
    char *name; /* owned */
} tli_region_name;

struct tl_mesh {
    tl_ctx *ctx;
    size_t vert_count, tet_count;
    double *xyz;          /* [vert_count][3] */
    tl_lidx *tets;        /* [tet_count][4] */
    int32_t *regions;     /* [tet_count] or NULL */
    tl_channel *channels; /* name, unit and values owned */
    size_t channel_count;
    tl_label *labels; /* name and faces owned */
    size_t label_count;
    tli_region_name *region_names;
    size_t region_name_count;
    double time;
};

/* Channels and labels hold pointers to const for their readers; the mesh that owns them frees them.
 */
void tli_free_const(tl_ctx *ctx, const void *block);
/* Frees labels and names of regions. mesh_labels.c */
void tli_mesh_release_labels(tl_mesh *mesh);

/* Corners of the face opposite to corner i, in the order that turns its normal out of a positive
 * tet. */
extern const uint8_t tli_tet_faces[4][3];

/* Copies the corner positions of a tet into p [4][3]. */
static inline void tli_tet_corners(const double *xyz, const tl_lidx *tet, double p[4][3])
{
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) p[i][k] = xyz[3 * (size_t)tet[i] + (size_t)k];
}

/* Six times the volumes with x in the place of corner i, rounded. Their signs are hints only. */
static inline void tli_tet_parts(const double p[4][3], const double x[3], double parts[4])
{
    double q[4][3], c01[3], c23[3];
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) q[i][k] = p[i][k] - x[k];
    for (int k = 0; k < 3; k++) {
        int l = (k + 1) % 3, m = (k + 2) % 3;
        c01[k] = q[0][l] * q[1][m] - q[0][m] * q[1][l];
        c23[k] = q[2][l] * q[3][m] - q[2][m] * q[3][l];
    }
    parts[0] = q[1][0] * c23[0] + q[1][1] * c23[1] + q[1][2] * c23[2];
    parts[1] = -(q[0][0] * c23[0] + q[0][1] * c23[1] + q[0][2] * c23[2]);
    parts[2] = q[3][0] * c01[0] + q[3][1] * c01[1] + q[3][2] * c01[2];
    parts[3] = -(q[2][0] * c01[0] + q[2][1] * c01[1] + q[2][2] * c01[2]);
}

/* An angle in [0, pi] by a positive multiple of its sine and cosine: compared without a call. */
typedef struct tli_angle {
    double sine, cosine;
} tli_angle;

static inline bool tli_angle_less(tli_angle a, tli_angle b)
{
    return a.sine * b.cosine < b.sine * a.cosine;
}

/* Volume, mean ratio and extreme dihedral angles of a tet at once. */
typedef struct tli_tet_shape {
    double volume, quality;
    tli_angle smallest, largest;
} tli_tet_shape;
void tli_tet_measure(const double p[4][3], tli_tet_shape *shape);

/* Calls fn for every tet whose box may touch the box low .. high, until it returns false. Flat and
 * inverted tets are among them. mesh_locator.c */
void tli_locator_box(const tl_locator *locator, const double low[3], const double high[3],
                     bool (*fn)(void *user, tl_lidx tet), void *user);

/* Adds the qualifier that ISO C before C23 does not add to an array of arrays by itself. */
#define TLI_CORNERS(p) ((const double(*)[3])(p))

/* Memory that points, lines or triangles take. */
uint64_t tli_polydata_bytes(const tl_polydata *polydata);

#endif
