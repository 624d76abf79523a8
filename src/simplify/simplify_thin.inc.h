/* The kernel of the thinning, compiled once for each instruction set: TLI_THIN_NAME names it. Eight
 * neighbours or faces at a time, in float32, with the same operations in the same order whatever
 * the width of the registers, so that every build gives the same bytes. */
#include <math.h>
#include <string.h>

#include "simplify/simplify_quadric.h"
#include "simplify/simplify_thin.h"

enum { LANES = TLI_BALL_LANES };
typedef float lanes __attribute__((vector_size(4 * LANES), aligned(4), may_alias));
typedef float four __attribute__((vector_size(16), aligned(4), may_alias));
typedef int32_t lanes_mask __attribute__((vector_size(4 * LANES), aligned(4), may_alias));

/* A tet whose volume is below this part of its squared edges times the size of the ball may be flat
 * for all that float32 can tell. */
static const float ROUNDING = 4e-6f;

static inline lanes splat(float x)
{
    return (lanes){x, x, x, x, x, x, x, x};
}

/* Not by memcpy: compilers take two registers for it, and the processor then waits for both. */
static inline lanes load(const float *from)
{
    return *(const lanes *)from;
}

static inline void store(float *to, lanes x)
{
    *(lanes *)to = x;
}

/* Columns x y z of eight places. */
static inline void columns(const float *const at[LANES], lanes out[3])
{
    four low[3], high[3];
    for (int side = 0; side < 2; side++) {
        four p[4], s[4];
        for (int i = 0; i < 4; i++) p[i] = *(const four *)at[4 * side + i];
        s[0] = __builtin_shufflevector(p[0], p[1], 0, 4, 1, 5);
        s[1] = __builtin_shufflevector(p[2], p[3], 0, 4, 1, 5);
        s[2] = __builtin_shufflevector(p[0], p[1], 2, 6, 3, 7);
        s[3] = __builtin_shufflevector(p[2], p[3], 2, 6, 3, 7);
        four *to = side ? high : low;
        to[0] = __builtin_shufflevector(s[0], s[1], 0, 1, 4, 5);
        to[1] = __builtin_shufflevector(s[0], s[1], 2, 3, 6, 7);
        to[2] = __builtin_shufflevector(s[2], s[3], 0, 1, 4, 5);
    }
    for (int a = 0; a < 3; a++)
        out[a] = __builtin_shufflevector(low[a], high[a], 0, 1, 2, 3, 4, 5, 6, 7);
}

static float weigh(const tli_work *w, const uint8_t *inner, tli_ball *b)
{
    const tli_vertex *at = &w->verts[b->centre];
    const float *q = w->quadrics + b->centre * w->quadric_floats;
    size_t k = w->components, values = TLI_QUADRIC_HEAD + 4 * k;
    uint32_t n = b->vert_count;
    float least = INFINITY, size = 0;
    for (uint32_t i = 0; i < n; i += LANES) {
        const float *place[LANES], *row[LANES];
        float own[LANES];
        for (uint32_t j = 0; j < LANES; j++) { /* behind the last one it is repeated */
            tl_lidx v = b->verts[i + j < n ? i + j : n - 1];
            const tli_vertex *to = &w->verts[v];
            for (int a = 0; a < 3; a++)
                b->places[i + j][a] = (float)((to->xyz[a] - at->xyz[a]) * w->scale);
            place[j] = b->places[i + j];
            row[j] = w->quadrics + v * w->quadric_floats;
            own[j] = inner[v] ? row[j][9] : INFINITY;
        }
        lanes y[3], c = load(own) + splat(q[9]), squares;
        columns(place, y);
        squares = y[0] * y[0] + y[1] * y[1] + y[2] * y[2];
        c += y[0] * (splat(q[0]) * y[0] + splat(2 * q[1]) * y[1] + splat(2 * q[2]) * y[2] +
                     splat(2 * q[6]));
        c += y[1] * (splat(q[3]) * y[1] + splat(2 * q[4]) * y[2] + splat(2 * q[7]));
        c += y[2] * (splat(q[5]) * y[2] + splat(2 * q[8]));
        for (size_t m = 0; m < k; m++) {
            const float *g = q + TLI_QUADRIC_HEAD + 4 * m;
            float step[LANES];
            for (uint32_t j = 0; j < LANES; j++) step[j] = row[j][values + m] - q[values + m];
            lanes s = load(step);
            lanes d = splat(g[0]) * y[0] + splat(g[1]) * y[1] + splat(g[2]) * y[2] + splat(g[3]);
            c += s * (splat(q[10]) * s - splat(2) * d);
        }
        float far[LANES];
        store(far, squares);
        store(b->costs + i, c);
        for (uint32_t j = 0; j < LANES; j++) {
            float cost = b->costs[i + j];
            cost = cost > 0 ? cost : cost <= 0 ? 0 : INFINITY;
            b->costs[i + j] = cost;
            least = cost < least ? cost : least;
            size = far[j] > size ? far[j] : size;
        }
    }
    b->inv_size = size > 0 ? 1 / sqrtf(size) : 0;
    return least;
}

static void look(tli_ball *b)
{
    uint32_t n = b->tet_count;
    for (uint32_t i = n; i % LANES; i++) /* a face more than once does no harm */
        for (int c = 0; c < 3; c++) b->corners[c][i] = b->corners[c][n - 1];
    lanes worst = splat(1);
    for (uint32_t i = 0; i < n; i += LANES) {
        lanes p[3][3], normal[3], e[3], f[3], sum[3], d = splat(0), squares = splat(0);
        for (int c = 0; c < 3; c++) {
            const float *at[LANES];
            for (uint32_t j = 0; j < LANES; j++) at[j] = b->places[b->corners[c][i + j]];
            columns(at, p[c]);
            for (int a = 0; a < 3; a++) p[c][a] *= splat(b->inv_size);
        }
        for (int a = 0; a < 3; a++) {
            lanes g = p[2][a] - p[1][a];
            e[a] = p[1][a] - p[0][a];
            f[a] = p[2][a] - p[0][a];
            sum[a] = splat(2) * (p[0][a] + p[1][a] + p[2][a]);
            squares += e[a] * e[a] + f[a] * f[a] + g * g + p[0][a] * p[0][a] + p[1][a] * p[1][a] +
                       p[2][a] * p[2][a];
        }
        normal[0] = e[1] * f[2] - e[2] * f[1];
        normal[1] = e[2] * f[0] - e[0] * f[2];
        normal[2] = e[0] * f[1] - e[1] * f[0];
        for (int a = 0; a < 3; a++) d += normal[a] * p[0][a];
        lanes ratio = splat(432) * d * d / (squares * squares * squares);
        lanes_mask less = ratio < worst;
        worst = (lanes)(((lanes_mask)ratio & less) | ((lanes_mask)worst & ~less));
        for (int a = 0; a < 3; a++) store(b->planes[a] + i, normal[a]);
        store(b->planes[3] + i, d);
        for (int a = 0; a < 3; a++) store(b->planes[4 + a] + i, sum[a]);
        store(b->planes[7] + i, squares);
    }
    b->worst = worst[0];
    for (int i = 1; i < LANES; i++) b->worst = worst[i] < b->worst ? worst[i] : b->worst;
}

/* The mean ratio, cubed, is 432 det^2 / edges^3. */
static bool fits(const tli_ball *b, uint32_t to, float quality)
{
    float at[3];
    for (int a = 0; a < 3; a++) at[a] = b->places[to][a] * b->inv_size;
    lanes x = splat(at[0]), y = splat(at[1]), z = splat(at[2]);
    lanes square = splat(3 * (at[0] * at[0] + at[1] * at[1] + at[2] * at[2]));
    int32_t t = (int32_t)to;
    lanes_mask end = {t, t, t, t, t, t, t, t}, bad = {0};
    for (uint32_t i = 0; i < b->tet_count; i += LANES) {
        lanes_mask c[3];
        for (int k = 0; k < 3; k++) c[k] = *(const lanes_mask *)(b->corners[k] + i);
        lanes det =
            load(b->planes[3] + i) -
            (load(b->planes[0] + i) * x + load(b->planes[1] + i) * y + load(b->planes[2] + i) * z);
        lanes edges =
            load(b->planes[7] + i) + square -
            (load(b->planes[4] + i) * x + load(b->planes[5] + i) * y + load(b->planes[6] + i) * z);
        lanes_mask fine = (splat(432) * det * det >= splat(quality) * edges * edges * edges) &
                          (det >= splat(ROUNDING) * edges);
        bad |= ~(fine | (c[0] == end) | (c[1] == end) | (c[2] == end));
    }
    uint64_t words[LANES / 2];
    memcpy(words, &bad, sizeof words);
    return !(words[0] | words[1] | words[2] | words[3]);
}

const tli_thin_kernel TLI_THIN_NAME = {weigh, look, fits};
