/* Stage base, internal: the signs that decide topology. A floating-point filter, then exact
 * arithmetic (expansions). Finite input only; no overflow while |coordinate| < 1e60 and differences
 * do not underflow. */
#ifndef TETRALOD_SRC_BASE_PREDICATES_H
#define TETRALOD_SRC_BASE_PREDICATES_H

/* Sign of (b - a) x (c - a) . (d - a): +1 for a positively oriented tet a b c d, 0 flat, -1. */
int tli_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]);
/* The same sum in floating point: six times the signed volume, rounded. */
double tli_orient3d_approx(const double a[3], const double b[3], const double c[3],
                           const double d[3]);
/* For a positively oriented a b c d: +1 if e lies inside their sphere, 0 on it, -1 outside. */
int tli_insphere(const double a[3], const double b[3], const double c[3], const double d[3],
                 const double e[3]);

#endif
