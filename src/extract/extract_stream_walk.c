/* The walk of streamlines through the tets (Sondershaus 2007, 7.3.1): straight from a point to the
 * next, over the face that the way crosses first. Weights are rounded, so a way through an edge or
 * a vertex may take any of the tets around it; the number of faces is bounded, and where it is used
 * up, or a tet has no positive volume, the locator finds the end of the way. */
#include <math.h>

#include "base/base_vec.h"
#include "extract/extract_stream.h"
#include "mesh/mesh.h"

/* Faces that one way may cross; a way is about a tet long. */
enum { CROSSINGS_MAX = 256 };
/* A weight may be this much below 0 in the cell that holds a point: without it, rounding would take
 * lines along a flat boundary out of the mesh. */
static const double SLACK = 1e-9;
/* Six times the volume by the product of the lengths of three edges; of a flatter tet the weights
 * are rounding. */
static const double FLAT = 1e-12;

bool tli_stream_enter(const tli_stream_field *field, tl_lidx tet, tli_stream_cell *cell)
{
    const tl_lidx *q = field->mesh->tets + 4 * (size_t)tet;
    const double *p[4], *last = field->mesh->xyz + 3 * (size_t)q[3];
    double edges[3][3], normals[3][3];
    for (int i = 0; i < 3; i++) {
        p[i] = field->mesh->xyz + 3 * (size_t)q[i];
        vec_sub(p[i], last, edges[i]);
    }
    vec_cross(edges[1], edges[2], normals[0]);
    vec_cross(edges[2], edges[0], normals[1]);
    vec_cross(edges[0], edges[1], normals[2]);
    /* the last corner is opposite to a positive face: the sign turns */
    double six = vec_dot(edges[0], normals[0]);
    double size =
        vec_dot(edges[0], edges[0]) * vec_dot(edges[1], edges[1]) * vec_dot(edges[2], edges[2]);
    if (!(-six > 0 && six * six > FLAT * FLAT * size && isfinite(size))) return false;
    double scale = 1 / six;
    cell->tet = tet;
    for (int k = 0; k < 3; k++) {
        cell->origin[k] = last[k];
        for (int i = 0; i < 3; i++) cell->slopes[i][k] = normals[i][k] * scale;
        cell->slopes[3][k] = -(cell->slopes[0][k] + cell->slopes[1][k] + cell->slopes[2][k]);
    }
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++)
            cell->vectors[i][k] = field->vectors[3 * (size_t)q[i] + (size_t)k];
    return true;
}

/* The face that the way from a point with weights a to one with weights b crosses first, -1 if the
 * cell holds the end; part: of the way. The face it came in by is no way out. */
static int exit_face(const double a[4], const double b[4], int entered, double *part)
{
    int face = -1;
    *part = INFINITY;
    for (int i = 0; i < 4; i++) {
        if (i == entered || !(b[i] < -SLACK)) continue;
        /* begins beyond the face: rounding, or a way along an edge */
        double at = a[i] > 0 ? a[i] / (a[i] - b[i]) : 0;
        if (at < *part) {
            *part = at;
            face = i;
        }
    }
    return face;
}

static tli_stream_way ask_locator(const tli_stream_field *field, tli_stream_cell *cell,
                                  const double to[3], double weights[4])
{
    tl_lidx tet = tl_locator_find(field->locator, to, TL_NONE, NULL);
    if (tet == TL_NONE || !tli_stream_enter(field, tet, cell)) return TLI_WAY_OUT;
    tli_stream_weights(cell, to, weights);
    return TLI_WAY_IN;
}

tli_stream_way tli_stream_walk(const tli_stream_field *field, tli_stream_cell *cell,
                               const double from[3], const double to[3], double weights[4],
                               double *reached)
{
    int entered = -1;
    *reached = 0;
    if (!vec_is_finite(to)) return TLI_WAY_LOST;
    for (int crossing = 0; crossing < CROSSINGS_MAX; crossing++) {
        double begin[4], part;
        tli_stream_weights(cell, to, weights);
        if (weights[0] >= -SLACK && weights[1] >= -SLACK && weights[2] >= -SLACK &&
            weights[3] >= -SLACK)
            return TLI_WAY_IN;
        tli_stream_weights(cell, from, begin);
        int face = exit_face(begin, weights, entered, &part);
        if (face < 0) return TLI_WAY_IN;
        *reached = part > *reached ? part : *reached;
        tl_lidx next = field->opposite[4 * (size_t)cell->tet + (size_t)face];
        if (next == TL_NONE) return TLI_WAY_OUT;
        if (!tli_stream_enter(field, next / 4, cell)) break;
        entered = (int)(next & 3);
    }
    return ask_locator(field, cell, to, weights);
}
