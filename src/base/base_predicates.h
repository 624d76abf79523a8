/* Stage base, internal: the signs that decide topology. A floating-point filter, then exact
 * arithmetic (expansions). Finite input only. Exact while each coordinate is 0 or has a magnitude
 * from 1e-80 to 1e100 (tli_orient3d) or from 1e-45 to 1e60 (tli_insphere): beyond, products of
 * coordinates leave the range of a double. */
#ifndef TETRALOD_SRC_BASE_PREDICATES_H
#define TETRALOD_SRC_BASE_PREDICATES_H

#include <math.h>

/* Relative to the sum of the magnitudes of the six products: each carries at most 8 roundings of
 * 2^-53 (3 differences, 2 products, a difference, 2 sums); the ninth pays for the roundings of that
 * sum and for terms of second order. docs/notes/2026-11-22-predicates.md */
#define TLI_ORIENT3D_FILTER (9 * 0x1p-53)

/* The slow end of tli_orient3d, by expansions. */
int tli_orient3d_exact(const double a[3], const double b[3], const double c[3], const double d[3]);

/* (b - a) x (c - a) . (d - a) in floating point: six times the signed volume, rounded. */
static inline double tli_orient3d_approx(const double a[3], const double b[3], const double c[3],
                                         const double d[3])
{
    double bx = b[0] - a[0], by = b[1] - a[1], bz = b[2] - a[2];
    double cx = c[0] - a[0], cy = c[1] - a[1], cz = c[2] - a[2];
    double dx = d[0] - a[0], dy = d[1] - a[1], dz = d[2] - a[2];
    return (by * cz - bz * cy) * dx + (bz * cx - bx * cz) * dy + (bx * cy - by * cx) * dz;
}

/* Sign of (b - a) x (c - a) . (d - a): +1 for a positively oriented tet a b c d, 0 flat, -1. */
static inline int tli_orient3d(const double a[3], const double b[3], const double c[3],
                               const double d[3])
{
    double bx = b[0] - a[0], by = b[1] - a[1], bz = b[2] - a[2];
    double cx = c[0] - a[0], cy = c[1] - a[1], cz = c[2] - a[2];
    double dx = d[0] - a[0], dy = d[1] - a[1], dz = d[2] - a[2];
    double yz = by * cz, zy = bz * cy, zx = bz * cx, xz = bx * cz, xy = bx * cy, yx = by * cx;
    double sum = (yz - zy) * dx + (zx - xz) * dy + (xy - yx) * dz;
    double size = (fabs(yz) + fabs(zy)) * fabs(dx) + (fabs(zx) + fabs(xz)) * fabs(dy) +
                  (fabs(xy) + fabs(yx)) * fabs(dz);
    double bound = TLI_ORIENT3D_FILTER * size;
    if (sum > bound) return 1;
    if (sum < -bound) return -1;
    return tli_orient3d_exact(a, b, c, d);
}

/* For a positively oriented a b c d: +1 if e lies inside their sphere, 0 on it, -1 outside. */
int tli_insphere(const double a[3], const double b[3], const double c[3], const double d[3],
                 const double e[3]);

#endif
