/* The cost kernel, compiled once for each instruction set: TLI_COST_NAME and TLI_SHAPES_NAME name
 * the functions. Eight edges of one vertex at a time, in float32, with the same operations in the
 * same order whatever the width of the registers, so that every build gives the same bytes. */
#include "simplify/simplify_cost.h"
#include "simplify/simplify_quadric.h"

enum { LANES = 8 };
typedef float lanes __attribute__((vector_size(4 * LANES), aligned(4), may_alias));
typedef int32_t lanes_mask __attribute__((vector_size(4 * LANES)));

static inline lanes splat(float x)
{
    return (lanes){x, x, x, x, x, x, x, x};
}

static inline lanes pick(lanes_mask mask, lanes yes, lanes no)
{
    return (lanes)(((lanes_mask)yes & mask) | ((lanes_mask)no & ~mask));
}

/* Rows of eight floats to columns. */
static inline void transpose(const float *const row[LANES], size_t at, lanes out[LANES])
{
    lanes r[LANES], s[LANES];
    for (int i = 0; i < LANES; i++) r[i] = *(const lanes *)(row[i] + at);
    for (int i = 0; i < LANES; i += 2) {
        s[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        s[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int i = 0; i < LANES; i += 4)
        for (int j = 0; j < 2; j++) {
            r[i + j] = __builtin_shufflevector(s[i + j], s[i + j + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            r[i + j + 2] =
                __builtin_shufflevector(s[i + j], s[i + j + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    for (int i = 0; i < 4; i++) {
        out[i] = __builtin_shufflevector(r[i], r[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        out[i + 4] = __builtin_shufflevector(r[i], r[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}

/* The reduced form of the lanes' edges: m (6), r (3), c. */
typedef struct lane_form {
    lanes m[6], r[3], c;
} lane_form;

static inline __attribute__((always_inline)) void add_component(lane_form *f, const float *g_u,
                                                                const lanes g_v[4], lanes h,
                                                                lanes inv, lanes w_v,
                                                                const lanes e[3])
{
    lanes gx = g_v[0], gy = g_v[1], gz = g_v[2];
    lanes d = g_v[3] - (gx * e[0] + gy * e[1] + gz * e[2]);
    f->c += h * (splat(2) * d + w_v * h);
    f->r[0] += h * gx;
    f->r[1] += h * gy;
    f->r[2] += h * gz;
    d += w_v * h + splat(g_u[3]);
    gx += splat(g_u[0]);
    gy += splat(g_u[1]);
    gz += splat(g_u[2]);
    lanes ix = gx * inv, iy = gy * inv, iz = gz * inv;
    f->m[0] -= ix * gx;
    f->m[1] -= ix * gy;
    f->m[2] -= ix * gz;
    f->m[3] -= iy * gy;
    f->m[4] -= iy * gz;
    f->m[5] -= iz * gz;
    f->r[0] -= ix * d;
    f->r[1] -= iy * d;
    f->r[2] -= iz * d;
    f->c -= inv * d * d;
}

static inline lanes form_at(const lane_form *f, const lanes y[3])
{
    lanes mx = f->m[0] * y[0] + f->m[1] * y[1] + f->m[2] * y[2] + f->r[0];
    lanes my = f->m[1] * y[0] + f->m[3] * y[1] + f->m[4] * y[2] + f->r[1];
    lanes mz = f->m[2] * y[0] + f->m[4] * y[1] + f->m[5] * y[2] + f->r[2];
    return y[0] * (mx + f->r[0]) + y[1] * (my + f->r[1]) + y[2] * (mz + f->r[2]) + f->c;
}

/* Best place by LDL' with a pull towards the middle of the edge; the middle where that fails. */
static inline void best_place_of_lanes(const lane_form *f, const lanes e[3], lanes y[3])
{
    const lanes half = splat(0.5f), one = splat(1);
    lanes pull = splat((float)TLI_PULL) * (f->m[0] + f->m[3] + f->m[5]) + splat(1e-36f);
    lanes d0 = f->m[0] + pull, i0 = one / d0;
    lanes l10 = f->m[1] * i0, l20 = f->m[2] * i0;
    lanes d1 = f->m[3] + pull - l10 * f->m[1], i1 = one / d1;
    lanes t21 = f->m[4] - l20 * f->m[1], l21 = t21 * i1;
    lanes d2 = f->m[5] + pull - l20 * f->m[2] - l21 * t21;
    lanes b[3];
    for (int i = 0; i < 3; i++) b[i] = half * pull * e[i] - f->r[i];
    lanes z1 = b[1] - l10 * b[0], z2 = b[2] - l20 * b[0] - l21 * z1;
    y[2] = z2 / d2;
    y[1] = z1 * i1 - l21 * y[2];
    y[0] = b[0] * i0 - l10 * y[1] - l20 * y[2];
    lanes off = splat(0), e2 = splat(0);
    for (int i = 0; i < 3; i++) {
        lanes o = y[i] - half * e[i];
        off += o * o;
        e2 += e[i] * e[i];
    }
    lanes_mask fine = (d0 > splat(0)) & (d1 > splat(0)) & (d2 > splat(0)) &
                      (off <= splat((float)TLI_FAR_AWAY) * e2);
    for (int i = 0; i < 3; i++) y[i] = pick(fine, y[i], half * e[i]);
}

static inline __attribute__((always_inline)) void
cost_of_lanes(const tli_work *w, tl_lidx u, const tl_lidx v[LANES], float cost[LANES], size_t k)
{
    const float *row[LANES], *q_u = w->quadrics + u * w->quadric_floats;
    const tli_vertex *at = &w->verts[u];
    float ef[3][LANES];
    int32_t at_u[LANES], at_v[LANES], never[LANES];
    bool subset = w->placement == TL_PLACE_SUBSET;
    for (int i = 0; i < LANES; i++) {
        const tli_vertex *to = &w->verts[v[i]];
        row[i] = w->quadrics + v[i] * w->quadric_floats;
        for (int j = 0; j < 3; j++) ef[j][i] = (float)((to->xyz[j] - at->xyz[j]) * w->scale);
        bool ends = subset || at->kind == TLI_CURVE;
        at_u[i] = -(at->kind > to->kind || (at->kind == to->kind && ends));
        at_v[i] = -(to->kind > at->kind || (at->kind == to->kind && ends));
        never[i] = -(at->kind == TLI_FROZEN || to->kind == TLI_FROZEN ||
                     (at->kind == TLI_CORNER && to->kind == TLI_CORNER));
    }
    lanes e[3], a[8], b[8], y[3];
    lanes_mask keep_u, keep_v, none;
    memcpy(e, ef, sizeof e);
    memcpy(&keep_u, at_u, sizeof keep_u);
    memcpy(&keep_v, at_v, sizeof keep_v);
    memcpy(&none, never, sizeof none);
    transpose(row, 0, a);
    transpose(row, 8, b);
    lanes ax = a[0] * e[0] + a[1] * e[1] + a[2] * e[2];
    lanes ay = a[1] * e[0] + a[3] * e[1] + a[4] * e[2];
    lanes az = a[2] * e[0] + a[4] * e[1] + a[5] * e[2];
    lanes w_v = b[2], inv = splat(1) / (w_v + splat(q_u[10]) + splat(1e-36f));
    lane_form f;
    f.c = b[1] + splat(q_u[9]) -
          (e[0] * (a[6] + a[6] - ax) + e[1] * (a[7] + a[7] - ay) + e[2] * (b[0] + b[0] - az));
    f.r[0] = a[6] - ax + splat(q_u[6]);
    f.r[1] = a[7] - ay + splat(q_u[7]);
    f.r[2] = b[0] - az + splat(q_u[8]);
    for (int i = 0; i < 6; i++) f.m[i] = a[i] + splat(q_u[i]);
    size_t values = TLI_QUADRIC_HEAD + 4 * k;
    for (size_t c = 0; c < k; c++) {
        lanes g[4], h;
        size_t o = TLI_QUADRIC_HEAD + 4 * c;
        if (k == 1) {
            for (int j = 0; j < 4; j++) g[j] = b[3 + j];
            h = b[7] - splat(q_u[values]);
        } else {
            float columns[5][LANES];
            for (int i = 0; i < LANES; i++) {
                for (size_t j = 0; j < 4; j++) columns[j][i] = row[i][o + j];
                columns[4][i] = row[i][values + c] - q_u[values + c];
            }
            memcpy(g, columns, sizeof g);
            memcpy(&h, columns[4], sizeof h);
        }
        add_component(&f, q_u + o, g, h, inv, w_v, e);
    }
    best_place_of_lanes(&f, e, y);
    for (int i = 0; i < 3; i++) {
        y[i] = pick(keep_v, e[i], y[i]);
        y[i] = pick(keep_u, splat(0), y[i]);
    }
    lanes best = form_at(&f, y), other = form_at(&f, e);
    best = pick(keep_u & keep_v & (other < best), other, best);
    best = pick(best > splat(0), best, splat(0));
    best = pick(none, splat(INFINITY), best);
    memcpy(cost, &best, sizeof best);
}

void TLI_COST_NAME(const tli_work *w, tl_lidx u, const tl_lidx *v, size_t count, float *cost)
{
    for (size_t i = 0; i < count; i += LANES) {
        tl_lidx some[LANES];
        float out[LANES];
        size_t n = count - i < LANES ? count - i : LANES;
        for (size_t j = 0; j < LANES; j++) some[j] = v[i + (j < n ? j : 0)];
        if (w->components == 1)
            cost_of_lanes(w, u, some, out, 1);
        else
            cost_of_lanes(w, u, some, out, w->components);
        memcpy(cost + i, out, n * sizeof *out);
    }
}

/* The mean ratio, cubed, is 432 det |det| / edges^3. In float32 det is off by some 1e-6 of
 * edges^1.5: a tet is surely fine above a ratio well beyond that, and surely turned below its
 * negative. */
static const float SURELY_FINE = 1e-6f, SURELY_TURNED = 1e-8f, MARGIN = 1.05f;

tli_shapes TLI_SHAPES_NAME(const float (*c)[TLI_LOOK], size_t count, float least)
{
    float from = MARGIN * (least > SURELY_FINE ? least : SURELY_FINE);
    int unsure = 0, turned = 0;
    for (size_t i = 0; i < count; i++) {
        float ax = c[0][i], ay = c[1][i], az = c[2][i], bx = c[3][i], by = c[4][i], bz = c[5][i];
        float cx = c[6][i], cy = c[7][i], cz = c[8][i];
        float squares =
            ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz + cx * cx + cy * cy + cz * cz;
        float dots =
            ax * bx + ay * by + az * bz + bx * cx + by * cy + bz * cz + cx * ax + cy * ay + cz * az;
        float edges = 3 * squares - 2 * dots, cube = edges * edges * edges;
        float det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
        float ratio = 432 * det * (det < 0 ? -det : det);
        unsure |= !(ratio >= from * cube);
        turned |= ratio < -SURELY_TURNED * cube;
    }
    return turned ? TLI_SHAPES_TURNED : unsure ? TLI_SHAPES_UNSURE : TLI_SHAPES_FINE;
}
