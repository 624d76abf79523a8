/* Stage simplify, internal: quadrics in R^(3+k) in the form that grows linearly with k (Hoppe 1999;
 * Garland & Zhou 2005; Sondershaus 2007, 3.1.4). A tet contributes the squared difference between a
 * value and its own linear field, summed over k components; geometric terms (boundary faces, sharp
 * edges, vertex distribution) add to the same 3 x 3 form. A quadric is anchored at its vertex,
 * place and value, so that float32 holds it for any unit and position of the mesh: in a boundary
 * layer the absolute form would lose all its digits. */
#ifndef TETRALOD_SRC_SIMPLIFY_QUADRIC_H
#define TETRALOD_SRC_SIMPLIFY_QUADRIC_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/* Layout of a quadric with k components, in floats:
 *   0..5   A: xx xy xz yy yz zz      6..8  b      9  c      10  W, the sum of the field weights
 *   11 + 4 i ..  G_i (3) and D_i of component i
 * Q(y, s) = y'Ay + 2 b.y + c + sum_i (W s_i^2 - 2 s_i (G_i.y + D_i)),
 * y = (x - x_v) / diagonal, s_i = (f_i - f_i(v)) * scale_i. */
enum { TLI_QUADRIC_HEAD = 11 };

static inline size_t tli_quadric_floats(size_t component_count)
{
    return TLI_QUADRIC_HEAD + 4 * component_count;
}

/* The part of a quadric that is left when the values are chosen best: Q(y) = y'My + 2 r.y + c. */
typedef struct tli_form {
    double m[6], r[3], c;
} tli_form;

static inline double tli_form_at(const tli_form *q, const double y[3])
{
    double mx = q->m[0] * y[0] + q->m[1] * y[1] + q->m[2] * y[2];
    double my = q->m[1] * y[0] + q->m[3] * y[1] + q->m[4] * y[2];
    double mz = q->m[2] * y[0] + q->m[4] * y[1] + q->m[5] * y[2];
    return y[0] * (mx + 2 * q->r[0]) + y[1] * (my + 2 * q->r[1]) + y[2] * (mz + 2 * q->r[2]) + q->c;
}

/* Moves the anchor of a quadric by e (places) and h (values, [k]) and adds it to sum [floats]. */
static inline __attribute__((always_inline)) void
tli_quadric_add_moved(double *sum, const float *q, const double e[3], const double *h, size_t k)
{
    double xx = q[0], xy = q[1], xz = q[2], yy = q[3], yz = q[4], zz = q[5];
    double ax = xx * e[0] + xy * e[1] + xz * e[2];
    double ay = xy * e[0] + yy * e[1] + yz * e[2];
    double az = xz * e[0] + yz * e[1] + zz * e[2];
    double bx = q[6] + ax, by = q[7] + ay, bz = q[8] + az, w = q[10];
    double c = q[9] + (q[6] + bx) * e[0] + (q[7] + by) * e[1] + (q[8] + bz) * e[2];
    for (size_t i = 0; i < k; i++) {
        const float *g = q + TLI_QUADRIC_HEAD + 4 * i;
        double *to = sum + TLI_QUADRIC_HEAD + 4 * i;
        double gx = g[0], gy = g[1], gz = g[2];
        double d = g[3] + gx * e[0] + gy * e[1] + gz * e[2];
        c -= h[i] * (2 * d - w * h[i]);
        bx -= h[i] * gx;
        by -= h[i] * gy;
        bz -= h[i] * gz;
        to[0] += gx;
        to[1] += gy;
        to[2] += gz;
        to[3] += d - w * h[i];
    }
    sum[0] += xx;
    sum[1] += xy;
    sum[2] += xz;
    sum[3] += yy;
    sum[4] += yz;
    sum[5] += zz;
    sum[6] += bx;
    sum[7] += by;
    sum[8] += bz;
    sum[9] += c;
    sum[10] += w;
}

/* Eliminates the values. */
static inline __attribute__((always_inline)) void tli_quadric_reduce(const double *q, size_t k,
                                                                     tli_form *form)
{
    double inv = q[10] > 0 ? 1.0 / q[10] : 0.0;
    for (int i = 0; i < 6; i++) form->m[i] = q[i];
    for (int i = 0; i < 3; i++) form->r[i] = q[6 + i];
    form->c = q[9];
    for (size_t i = 0; i < k; i++) {
        const double *g = q + TLI_QUADRIC_HEAD + 4 * i;
        double gx = g[0] * inv, gy = g[1] * inv, gz = g[2] * inv;
        form->m[0] -= gx * g[0];
        form->m[1] -= gx * g[1];
        form->m[2] -= gx * g[2];
        form->m[3] -= gy * g[1];
        form->m[4] -= gy * g[2];
        form->m[5] -= gz * g[2];
        form->r[0] -= gx * g[3];
        form->r[1] -= gy * g[3];
        form->r[2] -= gz * g[3];
        form->c -= inv * g[3] * g[3];
    }
}

/* The best values at y, relative to the anchor. */
static inline void tli_quadric_values(const double *q, size_t k, const double y[3], double *s)
{
    double inv = q[10] > 0 ? 1.0 / q[10] : 0.0;
    for (size_t i = 0; i < k; i++) {
        const double *g = q + TLI_QUADRIC_HEAD + 4 * i;
        s[i] = inv * (g[0] * y[0] + g[1] * y[1] + g[2] * y[2] + g[3]);
    }
}

/* Solves (M + pull I) y = rhs for a positive semidefinite M by LDL'; false when it is singular. */
static inline bool tli_form_solve(const double m[6], double pull, const double rhs[3], double y[3])
{
    double d0 = m[0] + pull;
    if (!(d0 > 0)) return false;
    double i0 = 1 / d0, l10 = m[1] * i0, l20 = m[2] * i0;
    double d1 = m[3] + pull - l10 * m[1];
    if (!(d1 > 0)) return false;
    double i1 = 1 / d1, t21 = m[4] - l20 * m[1], l21 = t21 * i1;
    double d2 = m[5] + pull - l20 * m[2] - l21 * t21;
    if (!(d2 > 0)) return false;
    double z1 = rhs[1] - l10 * rhs[0], z2 = rhs[2] - l20 * rhs[0] - l21 * z1;
    y[2] = z2 / d2;
    y[1] = z1 * i1 - l21 * y[2];
    y[0] = rhs[0] * i0 - l10 * y[1] - l20 * y[2];
    return true;
}

#endif
