/* Single tets: volume, shape, angles, barycentric weights, nearest point. Nothing here decides
 * topology; whether a tet is flat is asked of the exact predicate. */
#include "base/base_predicates.h"
#include "base/base_vec.h"
#include "mesh/mesh.h"

#include <math.h>

double tl_tet_volume(const double p[4][3])
{
    return tli_orient3d_approx(p[0], p[1], p[2], p[3]) / 6;
}

/* By its six edges: the faces i and j meet in the edge between the other two corners, and the cross
 * product of their normals is that edge times six volumes. */
void tli_tet_measure(const double p[4][3], tli_tet_shape *shape)
{
    double normals[4][3], squares = 0;
    shape->volume = tl_tet_volume(p);
    for (int i = 0; i < 4; i++) {
        const uint8_t *face = tli_tet_faces[i];
        double a[3], b[3];
        vec_sub(p[face[1]], p[face[0]], a);
        vec_sub(p[face[2]], p[face[0]], b);
        vec_cross(a, b, normals[i]);
    }
    for (int i = 0; i < 3; i++) {
        for (int j = i + 1; j < 4; j++) {
            double edge[3];
            int k = i == 0 ? (j == 1 ? 2 : 1) : 0, l = 6 - i - j - k;
            vec_sub(p[l], p[k], edge);
            double square = vec_dot(edge, edge);
            squares += square;
            tli_angle angle = {6 * fabs(shape->volume) * sqrt(square),
                               -vec_dot(normals[i], normals[j])};
            bool is_first = i == 0 && j == 1;
            if (is_first || tli_angle_less(angle, shape->smallest)) shape->smallest = angle;
            if (is_first || tli_angle_less(shape->largest, angle)) shape->largest = angle;
        }
    }
    double root = cbrt(3 * fabs(shape->volume));
    shape->quality = squares > 0 ? copysign(12 * root * root / squares, shape->volume) : 0;
}

double tl_tet_quality(const double p[4][3])
{
    tli_tet_shape shape;
    tli_tet_measure(p, &shape);
    return shape.quality;
}

void tl_tet_dihedral(const double p[4][3], double *smallest, double *largest)
{
    tli_tet_shape shape;
    tli_tet_measure(p, &shape);
    *smallest = atan2(shape.smallest.sine, shape.smallest.cosine);
    *largest = atan2(shape.largest.sine, shape.largest.cosine);
}

bool tl_tet_weights(const double p[4][3], const double x[3], double weights[4])
{
    if (tli_orient3d(p[0], p[1], p[2], p[3]) == 0) return false;
    /* Differences are taken to x, so that a point in the tet has weights of full relative accuracy
     * wherever the origin is. */
    tli_tet_parts(p, x, weights);
    double sum = weights[0] + weights[1] + weights[2] + weights[3];
    if (sum == 0 || !isfinite(sum)) return false;
    for (int i = 0; i < 4; i++) weights[i] /= sum;
    return true;
}

/* Takes the point with these weights as the nearest if it is nearer than *best (squared). */
static void offer(const double p[4][3], const double x[3], const double candidate[4], double *best,
                  double weights[4])
{
    double d[3];
    for (int k = 0; k < 3; k++) {
        d[k] = candidate[0] * (p[0][k] - x[k]) + candidate[1] * (p[1][k] - x[k]) +
               candidate[2] * (p[2][k] - x[k]) + candidate[3] * (p[3][k] - x[k]);
    }
    double square = vec_dot(d, d);
    if (!(square < *best)) return;
    *best = square;
    for (int i = 0; i < 4; i++) weights[i] = candidate[i];
}

/* Nearest point of the segment between corners i and j; covers the corners too. */
static void offer_edge(const double p[4][3], const double x[3], int i, int j, double *best,
                       double weights[4])
{
    double edge[3], to_x[3], candidate[4] = {0, 0, 0, 0};
    vec_sub(p[j], p[i], edge);
    vec_sub(x, p[i], to_x);
    double length = vec_dot(edge, edge);
    double t = length > 0 ? vec_dot(edge, to_x) / length : 0;
    t = t > 0 ? (t < 1 ? t : 1) : 0;
    candidate[i] = 1 - t;
    candidate[j] = t;
    offer(p, x, candidate, best, weights);
}

/* The foot of x on the plane of the face, if it lies inside. A face without area has none: its
 * edges hold the nearest point. */
static void offer_face(const double p[4][3], const double x[3], int corner, double *best,
                       double weights[4])
{
    const uint8_t *face = tli_tet_faces[corner];
    double a[3], b[3], normal[3], to_x[3], part[3], candidate[4] = {0, 0, 0, 0};
    vec_sub(p[face[1]], p[face[0]], a);
    vec_sub(p[face[2]], p[face[0]], b);
    vec_sub(x, p[face[0]], to_x);
    vec_cross(a, b, normal);
    double area = vec_dot(normal, normal);
    if (!(area > 0)) return;
    vec_cross(to_x, b, part);
    double u = vec_dot(part, normal) / area;
    vec_cross(a, to_x, part);
    double v = vec_dot(part, normal) / area;
    double rest = 1 - u - v;
    if (!(u >= 0 && v >= 0 && rest >= 0)) return;
    candidate[face[0]] = rest;
    candidate[face[1]] = u;
    candidate[face[2]] = v;
    offer(p, x, candidate, best, weights);
}

double tl_tet_nearest(const double p[4][3], const double x[3], double weights[4])
{
    if (tl_tet_weights(p, x, weights) && weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0 &&
        weights[3] >= 0)
        return 0;
    double best = INFINITY;
    for (int i = 0; i < 4; i++) weights[i] = i == 0;
    for (int i = 0; i < 3; i++)
        for (int j = i + 1; j < 4; j++) offer_edge(p, x, i, j, &best, weights);
    for (int i = 0; i < 4; i++) offer_face(p, x, i, &best, weights);
    return sqrt(best);
}
