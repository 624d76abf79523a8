/* Hilbert order of points. The curve is the one of Hamilton and Rau-Chaplin, "Compact Hilbert
 * indices: space-filling curves for domains with unequal side lengths" (2008): a state is the
 * corner where a cell is entered and the axis along which it is left, a Gray code orders its
 * octants. We turn their recurrences into a table of two levels a step, built anew at each call (24
 * states x 64), and use one scale for all axes, so that cells are cubes whatever the shape of the
 * box. */
#include "base/base_sort.h"
#include "base/base_vec.h"

#include <math.h>
#include <string.h>

#define AXIS_BITS 21
#define STATE_COUNT 24 /* 8 corners x 3 axes */
#define GRAIN ((size_t)1 << 14)
#define KEY_LAST UINT64_MAX /* above every key: points that are not finite */

/* A step: the next state and the place along the curve. */
typedef struct hilbert_step {
    uint8_t state, place;
} hilbert_step;

typedef struct hilbert_job {
    const double *xyz;
    uint64_t *keys;
    uint32_t *order;
    double (*boxes)[6]; /* [worker] lower and upper corner */
    double low[3], cells_a_unit;
    hilbert_step steps[STATE_COUNT]
                      [64]; /* by state and the octants of two levels, high one first */
} hilbert_job;

/* ---- the curve ---- */

static unsigned rotate_left(unsigned bits, unsigned by)
{
    by %= 3;
    return (bits << by | bits >> (3 - by)) & 7;
}

static unsigned gray(unsigned i)
{
    return i ^ i >> 1;
}

/* One level: octant (bit k: upper half of axis k) of a cell in state corner * 3 + axis. */
static hilbert_step step_once(unsigned state, unsigned octant)
{
    unsigned corner = state / 3, axis = state % 3;
    unsigned turned = rotate_left(octant ^ corner, 3 - (axis + 1) % 3);
    unsigned place = turned ^ turned >> 1 ^ turned >> 2; /* inverse Gray code */
    unsigned entry = place ? gray((place - 1) / 2 * 2) : 0;
    /* the axis along which the octant at this place is left: number of trailing ones */
    unsigned odd = place & 1 ? place : place ? place - 1 : 0;
    unsigned leave = 0;
    while (odd >> leave & 1) leave++;
    unsigned next_corner = corner ^ rotate_left(entry, axis + 1);
    unsigned next_axis = (axis + leave + 1) % 3;
    return (hilbert_step){(uint8_t)(next_corner * 3 + next_axis), (uint8_t)place};
}

static void build_steps(hilbert_step steps[STATE_COUNT][64])
{
    for (unsigned state = 0; state < STATE_COUNT; state++)
        for (unsigned octants = 0; octants < 64; octants++) {
            hilbert_step high = step_once(state, octants >> 3);
            hilbert_step low = step_once(high.state, octants & 7);
            steps[state][octants].state = low.state;
            steps[state][octants].place = (uint8_t)(high.place << 3 | low.place);
        }
}

/* Puts two zero bits behind each of the lower 21 bits. */
static inline uint64_t spread(uint64_t bits)
{
    bits = (bits | bits << 32) & 0x001f00000000ffff;
    bits = (bits | bits << 16) & 0x001f0000ff0000ff;
    bits = (bits | bits << 8) & 0x100f00f00f00f00f;
    bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
    bits = (bits | bits << 2) & 0x1249249249249249;
    return bits;
}

/* 21 levels: a first one alone would need another table, so the walk starts one level above the
 * box, in its lower octant. */
static inline uint64_t hilbert_key(hilbert_step (*steps)[64], const uint64_t cell[3])
{
    uint64_t octants = spread(cell[0]) | spread(cell[1]) << 1 | spread(cell[2]) << 2;
    uint64_t key = 0;
    unsigned state = 0;
    for (int shift = 3 * (AXIS_BITS - 1); shift >= 0; shift -= 6) {
        hilbert_step step = steps[state][octants >> shift & 63];
        key = key << 6 | step.place;
        state = step.state;
    }
    return key;
}

/* ---- over the points ---- */

static tl_status measure_box(void *arg, size_t begin, size_t end, unsigned worker)
{
    const hilbert_job *job = arg;
    double box[6];
    memcpy(box, job->boxes[worker], sizeof box);
    for (size_t i = begin; i < end; i++) {
        const double *p = job->xyz + 3 * i;
        if (!vec_is_finite(p)) continue;
        for (int k = 0; k < 3; k++) {
            box[k] = p[k] < box[k] ? p[k] : box[k];
            box[3 + k] = p[k] > box[3 + k] ? p[k] : box[3 + k];
        }
    }
    memcpy(job->boxes[worker], box, sizeof box);
    return TL_OK;
}

/* Half coordinates: the size of the box then can't overflow. */
static void set_scale(hilbert_job *job, unsigned worker_count)
{
    double extent = 0;
    for (int k = 0; k < 3; k++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (unsigned w = 0; w < worker_count; w++) {
            low = fmin(low, job->boxes[w][k]);
            high = fmax(high, job->boxes[w][3 + k]);
        }
        job->low[k] = 0.5 * low;
        extent = fmax(extent, 0.5 * high - 0.5 * low);
    }
    job->cells_a_unit = (double)(1 << AXIS_BITS) / extent;
    if (!isfinite(job->cells_a_unit)) job->cells_a_unit = 0; /* all in one point, or as good as */
}

static tl_status fill_keys(void *arg, size_t begin, size_t end, unsigned worker)
{
    hilbert_job *job = arg;
    const double last = (double)((1 << AXIS_BITS) - 1);
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        const double *p = job->xyz + 3 * i;
        job->order[i] = (uint32_t)i;
        job->keys[i] = KEY_LAST;
        if (!vec_is_finite(p)) continue;
        uint64_t cell[3];
        for (int k = 0; k < 3; k++) {
            double at = (0.5 * p[k] - job->low[k]) * job->cells_a_unit;
            cell[k] = (uint64_t)(at < last ? at : last);
        }
        job->keys[i] = hilbert_key(job->steps, cell);
    }
    return TL_OK;
}

tl_status tli_sort_hilbert(tl_ctx *ctx, const double *xyz, size_t vert_count, uint32_t *order)
{
    if (vert_count > UINT32_MAX)
        return tl_fail(ctx, TL_ERR_ARG, "%zu points do not fit into 32-bit indices", vert_count);
    tl_status st = TL_OK;
    unsigned worker_count = tl_ctx_thread_count(ctx);
    hilbert_job *job = tl_mem_alloc(ctx, 1, sizeof *job, &st);
    double(*boxes)[6] = tl_mem_alloc(ctx, worker_count, sizeof *boxes, &st);
    uint64_t *keys = tl_mem_alloc(ctx, vert_count, sizeof *keys, &st);
    if (!st) {
        *job = (hilbert_job){.xyz = xyz, .keys = keys, .order = order, .boxes = boxes};
        for (unsigned w = 0; w < worker_count; w++)
            for (int k = 0; k < 6; k++) boxes[w][k] = k < 3 ? HUGE_VAL : -HUGE_VAL;
        build_steps(job->steps);
        st = tli_parallel(ctx, vert_count, GRAIN, measure_box, job);
    }
    if (!st) {
        set_scale(job, worker_count);
        st = tli_parallel(ctx, vert_count, GRAIN, fill_keys, job);
    }
    if (!st) st = tli_sort_u64(ctx, keys, order, vert_count);
    tl_mem_free(ctx, keys);
    tl_mem_free(ctx, boxes);
    tl_mem_free(ctx, job);
    return st;
}
