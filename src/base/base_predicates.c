/* Exact orientation and in-sphere signs, after Shewchuk, "Adaptive Precision Floating-Point
 * Arithmetic and Fast Robust Geometric Predicates" (1997): a number is an expansion, a sum of
 * doubles that do not overlap, the largest last and zeros left out; sums and products by a double
 * of expansions are exact. Where we differ: instead of his four stages there are three. A filter;
 * then, if the differences to one point are exact doubles (grids, and points close together far
 * from the origin), the determinant of these; else the larger determinant of the coordinates
 * themselves. Needs round-to-even and no contraction of a * b + c (the build forbids it). */
#include "base/base_predicates.h"

#include <stdbool.h>

/* As TLI_ORIENT3D_FILTER: 17 roundings at most (5 in the square of a length, 8 in a minor, their
 * product, 3 sums), one more for second order. */
#define INSPHERE_FILTER (18 * 0x1p-53)

#define SPLITTER 0x8000001p0 /* 2^27 + 1 cuts 53 bits into 26 and 26 and a sign */

/* Longest results: a product of two coordinates, 2x2, 3x3 and 4x4 minors, one of the last times the
 * square of a length. Arrays have one place more, for a zero that is written and not counted. */
#define PRODUCT_MAX 2
#define MINOR2_MAX (2 * PRODUCT_MAX)
#define MINOR3_MAX (3 * 2 * MINOR2_MAX)
#define MINOR4_MAX (4 * MINOR3_MAX)
#define LIFTED4_MAX (3 * 4 * MINOR4_MAX)

/* ---- two doubles: head rounded, tail what rounding took ---- */

static inline double sum_tail(double a, double b, double head)
{
    double b_part = head - a;
    double a_part = head - b_part;
    return (a - a_part) + (b - b_part);
}

/* For |a| >= |b| or a = 0. */
static inline double fast_sum_tail(double a, double b, double head)
{
    return b - (head - a);
}

static inline double product_tail(double a, double b, double head)
{
    double a_wide = SPLITTER * a, b_wide = SPLITTER * b;
    double a_high = a_wide - (a_wide - a), b_high = b_wide - (b_wide - b);
    double a_low = a - a_high, b_low = b - b_high;
    return a_low * b_low - (((head - a_high * b_high) - a_low * b_high) - a_high * b_low);
}

/* ---- expansions: components in rising magnitude, no zeros; a count of 0 is the number 0 ---- */

/* A component that is no number is left out like a zero: input that is not finite, or overflows,
 * gives some sign, and counts stay what the arrays are made for. */
static inline int append(double *out, int count, double component)
{
    out[count] = component;
    return count + (component < 0 || component > 0);
}

/* out = a * b, at most PRODUCT_MAX components. */
static int product(double a, double b, double *out)
{
    double head = a * b;
    return append(out, append(out, 0, product_tail(a, b, head)), head);
}

/* out [a_count + b_count + 1] = a + b. out must not overlap a or b. */
static int expansion_add(const double *a, int a_count, const double *b, int b_count, double *out)
{
    int ai = 0, bi = 0, count = 0;
    double head = 0;
    while (ai < a_count || bi < b_count) {
        bool from_a = bi == b_count || (ai < a_count && fabs(a[ai]) < fabs(b[bi]));
        double next = from_a ? a[ai++] : b[bi++];
        double sum = head + next;
        count = append(out, count, sum_tail(head, next, sum));
        head = sum;
    }
    return append(out, count, head);
}

/* out [2 * count + 1] = a * factor. out must not overlap a. */
static int expansion_scale(const double *a, int count, double factor, double *out)
{
    double head = 0;
    int n = 0;
    for (int i = 0; i < count; i++) {
        double high = a[i] * factor, low = product_tail(a[i], factor, high);
        double sum = head + low;
        n = append(out, n, sum_tail(head, low, sum));
        head = high + sum;
        n = append(out, n, fast_sum_tail(high, sum, head));
    }
    return append(out, n, head);
}

static void expansion_negate(double *a, int count)
{
    for (int i = 0; i < count; i++) a[i] = -a[i];
}

static int sign_of(const double *a, int count)
{
    if (!count) return 0;
    return a[count - 1] > 0 ? 1 : -1;
}

/* ---- determinants; rows are points ---- */

/* px qy - py qx */
static int minor2(const double p[3], const double q[3], double out[MINOR2_MAX + 1])
{
    double plus[PRODUCT_MAX + 1], minus[PRODUCT_MAX + 1];
    int plus_count = product(p[0], q[1], plus), minus_count = product(p[1], q[0], minus);
    expansion_negate(minus, minus_count);
    return expansion_add(plus, plus_count, minus, minus_count, out);
}

/* | p q r |, by the column z */
static int minor3(const double p[3], const double q[3], const double r[3],
                  double out[MINOR3_MAX + 1])
{
    double qr[MINOR2_MAX + 1], rp[MINOR2_MAX + 1], pq[MINOR2_MAX + 1];
    double zqr[2 * MINOR2_MAX + 1], zrp[2 * MINOR2_MAX + 1], zpq[2 * MINOR2_MAX + 1];
    double two[4 * MINOR2_MAX + 1];
    int zqr_count = expansion_scale(qr, minor2(q, r, qr), p[2], zqr);
    int zrp_count = expansion_scale(rp, minor2(r, p, rp), q[2], zrp);
    int zpq_count = expansion_scale(pq, minor2(p, q, pq), r[2], zpq);
    int two_count = expansion_add(zqr, zqr_count, zrp, zrp_count, two);
    return expansion_add(two, two_count, zpq, zpq_count, out);
}

/* | q-p r-p s-p | out of the coordinates: |q r s| - |p r s| + |p q s| - |p q r| */
static int minor4(const double p[3], const double q[3], const double r[3], const double s[3],
                  double out[MINOR4_MAX + 1])
{
    double one[MINOR3_MAX + 1], other[MINOR3_MAX + 1];
    double first[2 * MINOR3_MAX + 1], second[2 * MINOR3_MAX + 1];
    int one_count = minor3(q, r, s, one), other_count = minor3(r, p, s, other);
    int first_count = expansion_add(one, one_count, other, other_count, first);
    one_count = minor3(p, q, s, one);
    other_count = minor3(q, p, r, other);
    int second_count = expansion_add(one, one_count, other, other_count, second);
    return expansion_add(first, first_count, second, second_count, out);
}

/* ---- from differences, where they are exact ---- */

/* True if no difference was rounded. */
static bool subtract(const double p[3], const double origin[3], double out[3])
{
    bool exact = true;
    for (int k = 0; k < 3; k++) {
        out[k] = p[k] - origin[k];
        exact &= sum_tail(p[k], -origin[k], out[k]) == 0;
    }
    return exact;
}

int tli_orient3d_exact(const double a[3], const double b[3], const double c[3], const double d[3])
{
    double ab[3], ac[3], ad[3], sum[MINOR4_MAX + 1];
    bool exact = subtract(b, a, ab) && subtract(c, a, ac) && subtract(d, a, ad);
    int count = exact ? minor3(ab, ac, ad, sum) : minor4(a, b, c, d, sum);
    return sign_of(sum, count);
}

/* A sum that grows, in one of two arrays in turn. */
typedef struct total {
    double sums[2][5 * LIFTED4_MAX + 1];
    int count, now;
} total;

/* Adds minor * |p|^2. */
static void add_lifted(total *t, const double *minor, int count, const double p[3])
{
    double once[2 * MINOR4_MAX + 1], square[4 * MINOR4_MAX + 1];
    for (int k = 0; k < 3; k++) {
        int n = expansion_scale(minor, count, p[k], once);
        n = expansion_scale(once, n, p[k], square);
        t->count = expansion_add(t->sums[t->now], t->count, square, n, t->sums[!t->now]);
        t->now = !t->now;
    }
}

static int insphere_exact(const double a[3], const double b[3], const double c[3],
                          const double d[3], const double e[3])
{
    double ea[3], eb[3], ec[3], ed[3], minor[MINOR4_MAX + 1];
    bool exact =
        subtract(a, e, ea) && subtract(b, e, eb) && subtract(c, e, ec) && subtract(d, e, ed);
    total t;
    t.count = t.now = 0;
    if (exact) {
        add_lifted(&t, minor, minor3(eb, ec, ed, minor), ea);
        add_lifted(&t, minor, minor3(ec, ea, ed, minor), eb);
        add_lifted(&t, minor, minor3(ea, eb, ed, minor), ec);
        add_lifted(&t, minor, minor3(eb, ea, ec, minor), ed);
    } else {
        add_lifted(&t, minor, minor4(c, b, d, e, minor), a);
        add_lifted(&t, minor, minor4(a, c, d, e, minor), b);
        add_lifted(&t, minor, minor4(b, a, d, e, minor), c);
        add_lifted(&t, minor, minor4(a, b, c, e, minor), d);
        add_lifted(&t, minor, minor4(b, a, c, d, minor), e);
    }
    return sign_of(t.sums[t.now], t.count);
}

/* ---- the filter of tli_insphere ---- */

/* | p q r | rounded; *size receives the sum of the magnitudes of its products. */
static inline double minor3_rounded(const double p[3], const double q[3], const double r[3],
                                    double *size)
{
    double yz = p[1] * q[2], zy = p[2] * q[1], zx = p[2] * q[0], xz = p[0] * q[2];
    double xy = p[0] * q[1], yx = p[1] * q[0];
    *size = (fabs(yz) + fabs(zy)) * fabs(r[0]) + (fabs(zx) + fabs(xz)) * fabs(r[1]) +
            (fabs(xy) + fabs(yx)) * fabs(r[2]);
    return (yz - zy) * r[0] + (zx - xz) * r[1] + (xy - yx) * r[2];
}

static inline double square_length(const double p[3])
{
    return p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
}

int tli_insphere(const double a[3], const double b[3], const double c[3], const double d[3],
                 const double e[3])
{
    double ea[3], eb[3], ec[3], ed[3], size_a, size_b, size_c, size_d;
    for (int k = 0; k < 3; k++) {
        ea[k] = a[k] - e[k];
        eb[k] = b[k] - e[k];
        ec[k] = c[k] - e[k];
        ed[k] = d[k] - e[k];
    }
    double lift_a = square_length(ea), lift_b = square_length(eb);
    double lift_c = square_length(ec), lift_d = square_length(ed);
    double sum = (lift_a * minor3_rounded(eb, ec, ed, &size_a) +
                  lift_b * minor3_rounded(ec, ea, ed, &size_b)) +
                 (lift_c * minor3_rounded(ea, eb, ed, &size_c) +
                  lift_d * minor3_rounded(eb, ea, ec, &size_d));
    double bound = INSPHERE_FILTER *
                   ((lift_a * size_a + lift_b * size_b) + (lift_c * size_c + lift_d * size_d));
    if (sum > bound) return 1;
    if (sum < -bound) return -1;
    return insphere_exact(a, b, c, d, e);
}
