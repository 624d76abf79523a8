/* Stage model, internal: weights of a tet that a carrier keeps, and how far a place of its mesh is
 * that has a value. */
#ifndef TETRALOD_SRC_MODEL_SPACE_H
#define TETRALOD_SRC_MODEL_SPACE_H

#include "base/base_vec.h"
#include "model/model.h"

/* First corner, and rows that give the weights of the other ones; not a number where a tet is flat
 * or turned. */
static inline void tli_frame_set(const tl_mesh *mesh, tl_lidx tet, double frame[12])
{
    const tl_lidx *q = mesh->tets + 4 * (size_t)tet;
    const double *o = mesh->xyz + 3 * (size_t)q[0];
    double e[3][3], *rows = frame + 3;
    for (int i = 0; i < 3; i++) vec_sub(mesh->xyz + 3 * (size_t)q[i + 1], o, e[i]);
    for (int i = 0; i < 3; i++) vec_cross(e[(i + 1) % 3], e[(i + 2) % 3], rows + 3 * i);
    double det = vec_dot(e[0], rows), inv = det > 0 ? 1 / det : (double)NAN;
    for (int i = 0; i < 3; i++) frame[i] = o[i];
    for (int i = 0; i < 9; i++) rows[i] *= inv;
}

static inline const double *tli_frame_of(const tli_carrier *c, tl_lidx tet, double room[12])
{
    if (c->frames) return c->frames[tet];
    tli_frame_set(c->mesh, tet, room);
    return room;
}

/* Weights of x in a tet; false for a flat or turned one. */
static inline bool tli_frame_weigh(const tli_carrier *c, tl_lidx tet, const double x[3],
                                   double w[4])
{
    double room[12], d[3];
    const double *f = tli_frame_of(c, tet, room);
    vec_sub(x, f, d);
    for (int i = 1; i < 4; i++) w[i] = vec_dot(d, f + 3 * i);
    w[0] = 1 - w[1] - w[2] - w[3];
    return !isnan(w[0]);
}

/* The value of a scalar at a vertex (in a tet), the norm of a vector or tensor. */
static inline double tli_channel_norm(const tl_channel *ch, tl_lidx element)
{
    const double *at = ch->values + element * (size_t)ch->components;
    double sum = 0;
    if (ch->components == 1) return at[0];
    for (uint32_t k = 0; k < ch->components; k++) sum += at[k] * at[k];
    return sqrt(sum);
}

/* Tets that follow each other: which values (norms) they have, and where they lie. */
typedef struct tli_space_block {
    double range[2], box[3][2];
} tli_space_block;
/* Makes the blocks of a carrier's mesh, whose values are final; without them, what is not found
 * nearby takes a look at all tets. tli_carrier_close frees them. */
tl_status tli_space_open(tli_carrier *carrier);

/* The mesh has the value of a channel, or that norm, at most this far from x; INFINITY where it has
 * not. On vertices values (norms) are joined linearly inside of tets, as `surface` slices them; on
 * tets each has its own, and a face between two has all those between theirs: a threshold at one of
 * these passes there.
 * tet    that holds x or is nearest to it, offset from it
 * error  value minus that of the mesh at (nearest to) x
 * enough a distance that need not be undercut */
double tli_space_distance(const tli_carrier *carrier, size_t channel, const double x[3],
                          tl_lidx tet, double value, double error, double offset, double enough);

#endif
