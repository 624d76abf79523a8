/* Points on isosurfaces (Sondershaus 2007, 7.2), without their triangles: a tet meets an isosurface
 * of a field that is linear in it in one flat polygon, and gets one point for each area A of it, on
 * average: its share of a point is decided by a die. (In the work a point is kept if the die shows
 * more than area / A; it is meant the other way round.)
 *
 * A dense set of isosurfaces has, by the coarea formula, an area in a tet of its volume times the
 * length of its gradient for each unit of values, and in a tet both the gradient and so that area
 * are spread evenly. Points that are spread evenly in each tet, as many as volume times length of
 * the gradient tells, therefore are those of infinitely many isosurfaces.
 *
 * Dice are hashes of the places of the corners, so that neither the numbers of a mesh nor threads
 * change a point. */
#include <math.h>
#include <string.h>

#include "base/base_random.h"
#include "base/base_vec.h"
#include "extract/extract.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192, SUM_BITS = 30 };

/* Half the distance of the two nodes of Gauss' rule, in the length of the interval. */
static const double NODE = 0.28867513459481287;

typedef struct job {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const double *scalar;
    const tl_points_opts *opts;
    double values[TL_SLICE_VALUES_MAX]; /* rising */
    uint64_t *hashes;                   /* [vert_count] of places */
    float *areas;                       /* [tet_count] */
    double *sums;                       /* [piece_count] of them */
    size_t *starts;                     /* [piece_count + 1] of points */
    double area;                        /* of a point */
    tl_polydata *out;
    double **carried; /* [channel_count] */
} job;

/* A tet whose corners come in an order that follows from their places. */
typedef struct corners {
    size_t verts[4];
    double x[4][3], s[4];
    double low, high; /* of s */
    double slope[3];  /* gradient times six volumes */
    double volume;    /* six of them, with its sign */
} corners;

/* Where the next point of a piece goes. */
typedef struct taker {
    const job *j;
    size_t next;
} taker;

/* ---- dice ---- */

static uint64_t bits_of(double value)
{
    uint64_t bits;
    value += 0.0; /* -0 is 0 */
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static tl_status hash_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    for (size_t v = begin; v < end; v++) {
        uint64_t row = j->opts->seed;
        for (size_t k = 0; k < 3; k++) {
            row ^= bits_of(j->mesh->xyz[3 * v + k]);
            row = tli_random(&row);
        }
        j->hashes[v] = row;
    }
    return TL_OK;
}

/* ---- a tet ---- */

static void swap_if_later(const job *j, size_t verts[4], int a, int b)
{
    if (j->hashes[verts[a]] <= j->hashes[verts[b]]) return;
    size_t kept = verts[a];
    verts[a] = verts[b];
    verts[b] = kept;
}

/* False for a tet without points. */
static bool load_tet(const job *j, size_t t, corners *c)
{
    const tl_lidx *q = j->mesh->tets + 4 * t;
    double low = (double)INFINITY, high = -(double)INFINITY;
    for (int i = 0; i < 4; i++) {
        double s = j->scalar[q[i]];
        if (!isfinite(s)) return false;
        low = s < low ? s : low;
        high = s > high ? s : high;
    }
    bool inside =
        low < high &&
        (j->opts->value_count ? j->values[0] <= high && j->values[j->opts->value_count - 1] >= low
                              : j->opts->low <= high && j->opts->high >= low);
    if (!inside) return false;
    for (int i = 0; i < 4; i++) c->verts[i] = q[i];
    swap_if_later(j, c->verts, 0, 1);
    swap_if_later(j, c->verts, 2, 3);
    swap_if_later(j, c->verts, 0, 2);
    swap_if_later(j, c->verts, 1, 3);
    swap_if_later(j, c->verts, 1, 2);
    c->low = low;
    c->high = high;
    for (int i = 0; i < 4; i++) {
        memcpy(c->x[i], j->mesh->xyz + 3 * c->verts[i], sizeof c->x[i]);
        c->s[i] = j->scalar[c->verts[i]];
    }
    double e[3][3], n[3][3];
    for (int i = 0; i < 3; i++) vec_sub(c->x[i + 1], c->x[0], e[i]);
    for (int i = 0; i < 3; i++) vec_cross(e[(i + 1) % 3], e[(i + 2) % 3], n[i]);
    for (int k = 0; k < 3; k++)
        c->slope[k] = n[0][k] * (c->s[1] - c->s[0]) + n[1][k] * (c->s[2] - c->s[0]) +
                      n[2][k] * (c->s[3] - c->s[0]);
    c->volume = vec_dot(e[0], n[0]);
    return isfinite(c->volume) && vec_is_finite(c->slope) && c->volume != 0;
}

/* Points of a tet: the whole ones that its area has, and one more with the chance of the rest. The
 * row of dice follows from its corners in any order. */
static uint64_t points_of(const job *j, size_t t, uint64_t *row)
{
    uint64_t sum = 0;
    if (!(j->areas[t] > 0)) return 0;
    for (size_t i = 0; i < 4; i++) sum += j->hashes[j->mesh->tets[4 * t + i]];
    *row = tli_mix_bits(sum);
    return (uint64_t)floor((double)j->areas[t] / j->area + tli_uniform(row));
}

/* ---- polygons of an isosurface ---- */

/* Where an edge has the value, as weights of the corners. */
static void cut_edge(const corners *c, double value, int a, int b, double weights[4])
{
    double w = (value / 2 - c->s[a] / 2) / (c->s[b] / 2 - c->s[a] / 2);
    for (int i = 0; i < 4; i++) weights[i] = 0;
    weights[a] = 1 - w;
    weights[b] = w;
}

/* Three or four corners around, each as weights; none at all if the value is not in the tet. */
static int cut_tet(const corners *c, double value, double polygon[4][4])
{
    int above[4], below[4], above_count = 0, below_count = 0;
    for (int i = 0; i < 4; i++)
        if (c->s[i] >= value)
            above[above_count++] = i;
        else
            below[below_count++] = i;
    if (!above_count || !below_count) return 0;
    if (above_count == 2) {
        cut_edge(c, value, above[0], below[0], polygon[0]);
        cut_edge(c, value, above[0], below[1], polygon[1]);
        cut_edge(c, value, above[1], below[1], polygon[2]);
        cut_edge(c, value, above[1], below[0], polygon[3]);
        return 4;
    }
    const int *many = above_count == 3 ? above : below;
    int one = above_count == 3 ? below[0] : above[0];
    for (int i = 0; i < 3; i++) cut_edge(c, value, one, many[i], polygon[i]);
    return 3;
}

static void place_of(const corners *c, const double weights[4], double x[3])
{
    for (int k = 0; k < 3; k++)
        x[k] = weights[0] * c->x[0][k] + weights[1] * c->x[1][k] + weights[2] * c->x[2][k] +
               weights[3] * c->x[3][k];
}

/* Areas of the one or two triangles of a polygon. */
static double measure_polygon(const corners *c, int count, double polygon[4][4], double areas[2])
{
    double x[4][3], u[3], v[3], n[3];
    areas[1] = 0;
    for (int i = 0; i < count; i++) place_of(c, polygon[i], x[i]);
    for (int i = 0; i + 2 < count; i++) {
        vec_sub(x[i + 1], x[0], u);
        vec_sub(x[i + 2], x[0], v);
        vec_cross(u, v, n);
        areas[i] = vec_length(n) / 2;
    }
    return areas[0] + areas[1];
}

/* The first of the values that is not below. */
static size_t first_value(const job *j, double value)
{
    size_t first = 0, last = j->opts->value_count;
    while (first < last) {
        size_t middle = (first + last) / 2;
        if (j->values[middle] < value)
            first = middle + 1;
        else
            last = middle;
    }
    return first;
}

/* ---- values between two ends in a tet ---- */

/* Between two values of corners the area is quadratic: area + slope u + bend u^2, u from -1/2 to
 * 1/2. */
typedef struct layer {
    double low, high, area, slope, bend;
    double integral; /* over the values */
} layer;

static double area_at(const corners *c, double value)
{
    double polygon[4][4], areas[2];
    int count = cut_tet(c, value, polygon);
    return count ? measure_polygon(c, count, polygon, areas) : 0;
}

static void set_layer(const corners *c, double low, double high, layer *l)
{
    double step = high - low, middle = low + step / 2;
    double before = area_at(c, middle - NODE * step), behind = area_at(c, middle + NODE * step);
    l->low = low;
    l->high = high;
    l->area = area_at(c, middle);
    l->slope = (behind - before) / (2 * NODE);
    l->bend = (behind + before - 2 * l->area) / (2 * NODE * NODE);
    l->integral = (behind + before) / 2 * step;
}

/* Layers of a tet within the ends; returns their number, at most three. */
static int cut_layers(const job *j, const corners *c, layer layers[3])
{
    double s[4], low = fmax(c->low, j->opts->low), high = fmin(c->high, j->opts->high);
    int count = 0;
    memcpy(s, c->s, sizeof s);
    for (int i = 1; i < 4; i++)
        for (int k = i; k > 0 && s[k] < s[k - 1]; k--) {
            double kept = s[k];
            s[k] = s[k - 1];
            s[k - 1] = kept;
        }
    for (int i = 0; i < 3; i++) {
        double from = fmax(s[i], low), to = fmin(s[i + 1], high);
        if (from < to) set_layer(c, from, to, &layers[count++]);
    }
    return count;
}

/* The value below which a layer has a share of its integral, by bisection. */
static double value_at(const layer *l, double share)
{
    double low = -0.5, high = 0.5;
    double all = l->area + l->bend / 12;
    for (int i = 0; i < 53; i++) {
        double u = (low + high) / 2;
        double part =
            l->area * (u + 0.5) + l->slope / 2 * (u * u - 0.25) + l->bend / 3 * (u * u * u + 0.125);
        if (part < share * all)
            low = u;
        else
            high = u;
    }
    return l->low + (low + 0.5) * (l->high - l->low);
}

static bool is_within(const job *j, const corners *c)
{
    return c->low >= j->opts->low && c->high <= j->opts->high;
}

/* ---- first pass: how much area there is ---- */

static double measure_tet(const job *j, const corners *c)
{
    double sum = 0;
    if (j->opts->value_count) {
        for (size_t k = first_value(j, c->low); k < j->opts->value_count && j->values[k] <= c->high;
             k++)
            sum += area_at(c, j->values[k]);
    } else if (is_within(j, c)) {
        sum = vec_length(c->slope) / 6;
    } else {
        layer layers[3];
        int count = cut_layers(j, c, layers);
        for (int i = 0; i < count; i++) sum += layers[i].integral;
    }
    return sum;
}

static tl_status measure_pieces(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    corners c;
    double sum = 0;
    for (size_t t = begin; t < end; t++) {
        j->areas[t] = load_tet(j, t, &c) ? (float)measure_tet(j, &c) : 0;
        sum += (double)j->areas[t];
    }
    j->sums[begin / TLI_SLICE_TETS] = sum;
    return TL_OK;
}

/* Of the fewest bits that count: the order in which it was summed up rarely shows. */
static double rounded(double value)
{
    int exponent;
    double part = frexp(value, &exponent);
    return ldexp(round(ldexp(part, SUM_BITS)), exponent - SUM_BITS);
}

/* ---- second and third pass: points ---- */

static void put(taker *to, const corners *c, const double weights[4])
{
    const job *j = to->j;
    size_t at = to->next++;
    double length = vec_length(c->slope), out = c->volume > 0 ? -1 : 1;
    place_of(c, weights, j->out->xyz + 3 * at);
    for (size_t k = 0; k < 3; k++)
        j->out->normals[3 * at + k] = length > 0 ? (float)(out * c->slope[k] / length) : 0;
    for (size_t i = 0; i < j->opts->channel_count; i++) {
        const tl_channel *channel = &j->mesh->channels[j->opts->channels[i]];
        size_t n = channel->components;
        for (size_t k = 0; k < n; k++) {
            double sum = 0;
            for (int v = 0; v < 4; v++) sum += weights[v] * channel->values[n * c->verts[v] + k];
            j->carried[i][n * at + k] = sum;
        }
    }
}

/* Evenly spread in the polygon of a value; of the least or largest one at its corner. */
static void put_on_value(taker *to, const corners *c, double value, uint64_t *row)
{
    double polygon[4][4], areas[2], weights[4] = {0};
    int count = cut_tet(c, value, polygon);
    if (!count) {
        int at = 0;
        while (at < 3 && c->s[at] != (value > c->low ? c->high : c->low)) at++;
        weights[at] = 1;
        put(to, c, weights);
        return;
    }
    double area = measure_polygon(c, count, polygon, areas);
    double a = tli_uniform(row), b = tli_uniform(row);
    int first = tli_uniform(row) * area < areas[0] || count < 4 ? 1 : 2;
    if (a + b > 1) {
        a = 1 - a;
        b = 1 - b;
    }
    for (int i = 0; i < 4; i++)
        weights[i] =
            (1 - a - b) * polygon[0][i] + a * polygon[first][i] + b * polygon[first + 1][i];
    put(to, c, weights);
}

/* Evenly spread in the tet: weights are the differences of three sorted numbers. */
static void put_in_volume(taker *to, const corners *c, uint64_t *row)
{
    double x = tli_uniform(row), y = tli_uniform(row), z = tli_uniform(row);
    double least = fmin(fmin(x, y), z), most = fmax(fmax(x, y), z);
    double middle = fmax(fmin(x, y), fmin(fmax(x, y), z));
    double weights[4] = {least, middle - least, most - middle, 1 - most};
    put(to, c, weights);
}

/* Which of the parts a die shows; those behind the last one with a share are left out. */
static int pick(const double *shares, int count, double die)
{
    int found = 0;
    double sum = 0, below = 0;
    for (int i = 0; i < count; i++) sum += shares[i];
    for (int i = 0; i < count && below <= die * sum; below += shares[i++])
        if (shares[i] > 0) found = i;
    return found;
}

static void sample_layers(taker *to, const corners *c, uint64_t points, uint64_t *row)
{
    layer layers[3];
    double shares[3];
    int count = cut_layers(to->j, c, layers);
    for (int i = 0; i < count; i++) shares[i] = layers[i].integral;
    for (uint64_t i = 0; i < points; i++) {
        const layer *l = &layers[pick(shares, count, tli_uniform(row))];
        put_on_value(to, c, value_at(l, tli_uniform(row)), row);
    }
}

static void sample_values(taker *to, const corners *c, uint64_t points, uint64_t *row)
{
    double shares[TL_SLICE_VALUES_MAX];
    const job *j = to->j;
    const double *values = j->values + first_value(j, c->low),
                 *end = j->values + j->opts->value_count;
    int count = 0;
    for (; values + count < end && values[count] <= c->high; count++)
        shares[count] = area_at(c, values[count]);
    for (uint64_t i = 0; i < points; i++)
        put_on_value(to, c, values[pick(shares, count, tli_uniform(row))], row);
}

static tl_status count_pieces(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    uint64_t row, sum = 0;
    for (size_t t = begin; t < end; t++) sum += points_of(j, t, &row);
    j->starts[begin / TLI_SLICE_TETS] = (size_t)sum;
    return TL_OK;
}

static tl_status write_pieces(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const job *j = arg;
    corners c;
    taker to = {j, j->starts[begin / TLI_SLICE_TETS]};
    for (size_t t = begin; t < end; t++) {
        uint64_t row, points = points_of(j, t, &row);
        if (!points || !load_tet(j, t, &c)) continue;
        if (j->opts->value_count)
            sample_values(&to, &c, points, &row);
        else if (!is_within(j, &c))
            sample_layers(&to, &c, points, &row);
        else
            for (uint64_t i = 0; i < points; i++) put_in_volume(&to, &c, &row);
    }
    return TL_OK;
}

/* ---- all of it ---- */

static tl_status take_opts(tl_ctx *ctx, const tl_mesh *mesh, const tl_points_opts *o)
{
    if (o->value_count > TL_SLICE_VALUES_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "points on at most %u isosurfaces, not %zu",
                       TL_SLICE_VALUES_MAX, o->value_count);
    for (size_t k = 0; k < o->value_count; k++)
        if (!isfinite(o->values[k]))
            return tl_fail(ctx, TL_ERR_ARG, "value %zu of points is not finite", k);
    if (!o->value_count && !(o->low < o->high))
        return tl_fail(ctx, TL_ERR_ARG, "values of points from %g to %g", o->low, o->high);
    if (!(o->area >= 0) || !isfinite(o->area))
        return tl_fail(ctx, TL_ERR_ARG, "a point on an area of %g, expected above 0", o->area);
    if (o->area == 0 && (!o->count || o->count >= TL_NONE))
        return tl_fail(ctx, TL_ERR_ARG, "%llu points, expected 1 to %u",
                       (unsigned long long)o->count, TL_NONE - 1);
    return tli_carried_check(ctx, mesh, o->channels, o->channel_count);
}

/* The area of a point. */
static tl_status set_area(job *j, size_t pieces)
{
    double sum = 0;
    tl_status st = tli_parallel(j->ctx, j->mesh->tet_count, TLI_SLICE_TETS, measure_pieces, j);
    for (size_t p = 0; !st && p < pieces; p++) sum += j->sums[p];
    j->area = j->opts->area > 0 ? j->opts->area : rounded(sum / (double)j->opts->count);
    if (!st && !(sum < TL_NONE * j->area) && sum > 0)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED,
                       "an area of %g, with one point for each %g of it, has too many points", sum,
                       j->area);
    return st;
}

static tl_status make_room(job *j)
{
    tl_status st = TL_OK;
    size_t count = j->out->vert_count;
    j->out->xyz = tl_mem_alloc(j->ctx, count, 3 * sizeof *j->out->xyz, &st);
    j->out->normals = tl_mem_alloc(j->ctx, count, 3 * sizeof *j->out->normals, &st);
    j->carried = tl_mem_zalloc(j->ctx, j->opts->channel_count, sizeof *j->carried, &st);
    for (size_t c = 0; !st && c < j->opts->channel_count; c++) {
        tl_channel own = j->mesh->channels[j->opts->channels[c]];
        own.values = j->carried[c] =
            tl_mem_alloc(j->ctx, count, own.components * sizeof(double), &st);
        if (!st) st = tl_polydata_adopt_channel(j->ctx, j->out, &own);
        if (st) tl_mem_free(j->ctx, j->carried[c]);
    }
    return st;
}

/* Nothing to be on has no area, and gets no points. */
static tl_status sample(job *j)
{
    tl_status st = TL_OK;
    size_t tets = j->mesh->tet_count, pieces = (tets + TLI_SLICE_TETS - 1) / TLI_SLICE_TETS;
    j->hashes = tl_mem_alloc(j->ctx, j->mesh->vert_count, sizeof *j->hashes, &st);
    j->areas = tl_mem_alloc(j->ctx, tets, sizeof *j->areas, &st);
    j->sums = tl_mem_alloc(j->ctx, pieces, sizeof *j->sums, &st);
    j->starts = tl_mem_zalloc(j->ctx, pieces + 1, sizeof *j->starts, &st);
    if (!st) st = tli_parallel(j->ctx, j->mesh->vert_count, GRAIN, hash_verts, j);
    if (!st) st = set_area(j, pieces);
    if (!st && j->area > 0) st = tli_parallel(j->ctx, tets, TLI_SLICE_TETS, count_pieces, j);
    if (st) return st;
    size_t count = tli_make_starts(j->starts, pieces);
    if (count >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED, "%zu points are too many", count);
    j->out->vert_count = j->out->cell_count = count;
    st = make_room(j);
    if (!st && count) st = tli_parallel(j->ctx, tets, TLI_SLICE_TETS, write_pieces, j);
    return st;
}

tl_points_opts tl_points_opts_defaults(void)
{
    return (tl_points_opts){.struct_bytes = sizeof(tl_points_opts),
                            .low = -(double)INFINITY,
                            .high = (double)INFINITY,
                            .count = 200000};
}

tl_status tl_slice_points(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                          const tl_points_opts *opts, double *area_used, tl_polydata **points)
{
    tl_points_opts own = tl_points_opts_defaults();
    *points = NULL;
    tl_status st = tli_opts_take(ctx, "tl_points_opts", opts, &own, sizeof own);
    if (!st) st = take_opts(ctx, mesh, &own);
    if (st) return st;
    job j = {.ctx = ctx, .mesh = mesh, .scalar = scalar, .opts = &own};
    if (own.value_count) tli_slice_values_sort(own.values, own.value_count, j.values);
    j.out = tl_mem_zalloc(ctx, 1, sizeof *j.out, &st);
    if (!st) {
        j.out->kind = TL_POLY_POINTS;
        st = sample(&j);
    }
    tl_mem_free(ctx, j.carried);
    tl_mem_free(ctx, j.starts);
    tl_mem_free(ctx, j.sums);
    tl_mem_free(ctx, j.areas);
    tl_mem_free(ctx, j.hashes);
    if (st) {
        tl_polydata_destroy(ctx, j.out);
        return st;
    }
    if (area_used) *area_used = j.area;
    *points = j.out;
    return TL_OK;
}
