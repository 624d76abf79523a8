/* Octrees over points that need not fit into memory: the points stream by a few times. Each time
 * counters below the leaves that are still too full show where they divide, six levels at the first
 * time (Sondershaus 2007, 6.1.1, inserts one point after the other and keeps them all).
 *
 * Cells are numbered by Morton codes of three times 21 bits, so a tree is no more than the sorted
 * codes of its leaves. */
#include "segment/segment_octree.h"

#include "base/base_sort.h"
#include "base/base_vec.h"

#include <stdatomic.h>
#include <string.h>

#define LEVELS TLI_OCTREE_LEVELS
#define TOP_LEVELS 6u /* that octree->top tells apart; counted at the first time */
#define TOP_COUNT ((size_t)1 << 3 * TOP_LEVELS)
#define CODE_END ((uint64_t)1 << 3 * LEVELS)
#define STEP_MAX 6u /* levels counted at a time */
/* Points at a time: 24 bytes each, and one for the mark. */
#define WINDOW_POINTS 131072u
#define GRAIN 4096u

/* ---- codes ---- */

/* Spreads 21 bits over 63, two zeros between each two. */
static uint64_t spread(uint64_t x)
{
    x = (x | x << 32) & 0x1f00000000ffffu;
    x = (x | x << 16) & 0x1f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

static void rotate(const tli_octree *octree, const double in[3], double out[3])
{
    if (!octree->is_rotated)
        memcpy(out, in, 3 * sizeof *out);
    else
        for (int k = 0; k < 3; k++) out[k] = vec_dot(octree->rotation + 3 * k, in);
}

static uint64_t code_of(const tli_octree *octree, const double xyz[3])
{
    double p[3];
    uint64_t code = 0;
    rotate(octree, xyz, p);
    for (int k = 0; k < 3; k++) {
        double x = (p[k] - octree->low[k]) * octree->scale;
        const double most = (1u << LEVELS) - 1;
        if (!vec_is_finite(p)) x = 0;
        x = x > 0 ? x : 0;
        x = x < most ? x : most;
        code |= spread((uint64_t)x) << k;
    }
    return code;
}

/* ---- streaming ---- */

typedef struct stream {
    tl_ctx *ctx;
    uint64_t point_count;
    tli_points_fn points;
    void *user;
    const char *stage;
    double *xyz;
    uint8_t *missing;
    size_t window; /* points in xyz now */
} stream;

static tl_status stream_open(stream *s)
{
    tl_status st = TL_OK;
    size_t room = s->point_count < WINDOW_POINTS ? (size_t)s->point_count : WINDOW_POINTS;
    s->xyz = tl_mem_alloc(s->ctx, room, 3 * sizeof *s->xyz, &st);
    s->missing = tl_mem_alloc(s->ctx, room, 1, &st);
    return st;
}

static void stream_close(stream *s)
{
    tl_mem_free(s->ctx, s->missing);
    tl_mem_free(s->ctx, s->xyz);
}

/* Calls fn for all points, in pieces of a window, on the pool. */
static tl_status stream_all(stream *s, tli_range_fn fn, void *arg)
{
    tl_status st = TL_OK;
    for (uint64_t first = 0; !st && first < s->point_count; first += WINDOW_POINTS) {
        uint64_t left = s->point_count - first;
        s->window = left < WINDOW_POINTS ? (size_t)left : WINDOW_POINTS;
        memset(s->missing, 0, s->window);
        st = s->points(s->user, first, s->window, s->xyz, s->missing);
        if (!st) st = tli_parallel(s->ctx, s->window, GRAIN, fn, arg);
        if (!st) st = tl_progress(s->ctx, s->stage, first + s->window, s->point_count);
    }
    return st;
}

/* ---- the box ---- */

typedef struct box_job {
    const stream *s;
    const tli_octree *octree;
    double (*boxes)[6]; /* [threads] */
} box_job;

static tl_status box_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const box_job *job = arg;
    double *box = job->boxes[worker];
    for (size_t i = begin; i < end; i++) {
        double p[3];
        rotate(job->octree, job->s->xyz + 3 * i, p);
        if (job->s->missing[i] || !vec_is_finite(p)) continue;
        for (int k = 0; k < 3; k++) {
            if (p[k] < box[2 * k]) box[2 * k] = p[k];
            if (p[k] > box[2 * k + 1]) box[2 * k + 1] = p[k];
        }
    }
    return TL_OK;
}

static tl_status find_box(stream *s, tli_octree *octree)
{
    tl_status st = TL_OK;
    unsigned threads = tl_ctx_thread_count(s->ctx);
    box_job job = {s, octree, tl_mem_alloc(s->ctx, threads, sizeof *job.boxes, &st)};
    if (st) return st;
    for (unsigned t = 0; t < threads; t++)
        for (int k = 0; k < 3; k++)
            job.boxes[t][2 * k] = HUGE_VAL, job.boxes[t][2 * k + 1] = -HUGE_VAL;
    st = stream_all(s, box_piece, &job);
    double side = 0;
    for (int k = 0; k < 3; k++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (unsigned t = 0; t < threads; t++) {
            low = fmin(low, job.boxes[t][2 * k]);
            high = fmax(high, job.boxes[t][2 * k + 1]);
        }
        octree->low[k] = low <= high ? low : 0;
        if (low < high) side = fmax(side, high - low);
    }
    /* a box whose sides a double can't hold is cut off, a point is a cell */
    octree->scale = side > 0 && isfinite(side) ? (double)(1u << LEVELS) / side : 0;
    if (!isfinite(octree->scale)) octree->scale = 0;
    tl_mem_free(s->ctx, job.boxes);
    return st;
}

/* ---- counting ---- */

/* Nodes of one level that have too many points, by ascending codes, and what is found below. */
typedef struct pass {
    const stream *s;
    const tli_octree *octree;
    uint64_t leaf_points;
    uint64_t *open; /* [open_count] first codes */
    size_t open_count;
    unsigned level, step;
    _Atomic uint32_t *counters; /* [open_count][8^step] */
    uint64_t *next;             /* nodes of level + step that are too full */
    size_t next_count;
} pass;

/* Index of the last value that is not above x; count if there is none. */
static size_t find_last(const uint64_t *values, size_t count, uint64_t x)
{
    size_t low = 0, high = count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (values[middle] <= x)
            low = middle + 1;
        else
            high = middle;
    }
    return low ? low - 1 : count;
}

static tl_status count_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const pass *r = arg;
    (void)worker;
    const unsigned low_bits = 3 * (LEVELS - r->level - r->step);
    const uint64_t mask = ((uint64_t)1 << 3 * r->step) - 1;
    const uint64_t node_codes = (uint64_t)1 << 3 * (LEVELS - r->level);
    for (size_t i = begin; i < end; i++) {
        if (r->s->missing[i]) continue;
        uint64_t code = code_of(r->octree, r->s->xyz + 3 * i);
        size_t node = r->level ? find_last(r->open, r->open_count, code) : 0;
        if (node == r->open_count || code - r->open[node] >= node_codes) continue;
        size_t at = (node << 3 * r->step) + (size_t)(code >> low_bits & mask);
        atomic_fetch_add_explicit(&r->counters[at], 1, memory_order_relaxed);
    }
    return TL_OK;
}

/* Appends to an array that doubles. */
static void *grow(tl_ctx *ctx, void *array, size_t count, size_t elem_bytes, tl_status *st)
{
    if (count & (count - 1)) return array; /* room is the next power of 2 */
    return tl_mem_resize(ctx, array, count ? 2 * count : 1, elem_bytes, st);
}

static tl_status add_leaf(tli_octree *octree, uint64_t code, unsigned level, uint64_t points)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = octree->ctx;
    size_t n = octree->leaf_count;
    octree->codes = grow(ctx, octree->codes, n, sizeof *octree->codes, &st);
    octree->levels = grow(ctx, octree->levels, n, sizeof *octree->levels, &st);
    octree->counts = grow(ctx, octree->counts, n, sizeof *octree->counts, &st);
    if (st) return st;
    octree->codes[n] = code;
    octree->levels[n] = (uint8_t)level;
    octree->counts[n] = points;
    octree->leaf_count++;
    return TL_OK;
}

/* What lies below a cell: counters [cells] of it, a level down an eighth of them. */
static tl_status divide(pass *r, tli_octree *octree, const _Atomic uint32_t *counters, size_t cells,
                        uint64_t code, unsigned level)
{
    uint64_t sum = 0;
    tl_status st = TL_OK;
    for (size_t i = 0; i < cells; i++)
        sum += atomic_load_explicit(&counters[i], memory_order_relaxed);
    if (!sum) return TL_OK;
    if (sum <= r->leaf_points || level == LEVELS) return add_leaf(octree, code, level, sum);
    if (cells == 1) {
        r->next = grow(octree->ctx, r->next, r->next_count, sizeof *r->next, &st);
        if (!st) r->next[r->next_count++] = code;
        return st;
    }
    for (size_t child = 0; !st && child < 8; child++)
        st = divide(r, octree, counters + child * (cells / 8), cells / 8,
                    code + ((uint64_t)child << 3 * (LEVELS - level - 1)), level + 1);
    return st;
}

/* One time over the points: open nodes become leaves, or nodes below. */
static tl_status count_pass(stream *s, tli_octree *octree, const tli_octree_opts *opts, pass *r)
{
    tl_status st = TL_OK;
    r->step = STEP_MAX;
    while (r->step > 1 && ((r->open_count << 3 * r->step) * sizeof *r->counters >
                               opts->memory_bytes + (TOP_COUNT << 2) ||
                           r->level + r->step > LEVELS))
        r->step--;
    size_t cells = (size_t)1 << 3 * r->step;
    r->counters = tl_mem_zalloc(s->ctx, r->open_count, cells * sizeof *r->counters, &st);
    if (!st) st = stream_all(s, count_piece, r);
    for (size_t i = 0; !st && i < r->open_count; i++)
        st = divide(r, octree, r->counters + i * cells, cells, r->open[i], r->level);
    tl_mem_free(s->ctx, (void *)(uintptr_t)r->counters);
    tl_mem_free(s->ctx, r->open);
    r->open = r->next;
    r->open_count = r->next_count;
    r->next = NULL;
    r->next_count = 0;
    r->level += r->step;
    return st;
}

static tl_status find_leaves(stream *s, tli_octree *octree, const tli_octree_opts *opts)
{
    tl_status st = TL_OK;
    pass r = {.s = s, .octree = octree, .leaf_points = opts->leaf_points};
    r.open = tl_mem_zalloc(s->ctx, 1, sizeof *r.open, &st);
    r.open_count = 1;
    while (!st && r.open_count) st = count_pass(s, octree, opts, &r);
    tl_mem_free(s->ctx, r.open);
    tl_mem_free(s->ctx, r.next);
    if (!st && octree->leaf_count == 0) st = add_leaf(octree, 0, 0, 0);
    return st;
}

/* ---- the finished tree ---- */

/* Leaves of later rounds come behind: all into the order of their codes. */
static tl_status sort_leaves(tli_octree *octree)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = octree->ctx;
    size_t n = octree->leaf_count;
    uint32_t *order = tl_mem_alloc(ctx, n, sizeof *order, &st);
    uint8_t *levels = tl_mem_alloc(ctx, n, sizeof *levels, &st);
    uint64_t *counts = tl_mem_alloc(ctx, n, sizeof *counts, &st);
    octree->codes = tl_mem_resize(ctx, octree->codes, n, sizeof *octree->codes, &st);
    for (size_t i = 0; !st && i < n; i++) order[i] = (uint32_t)i;
    if (!st) st = tli_sort_u64(ctx, octree->codes, order, n);
    if (!st) {
        for (size_t i = 0; i < n; i++) {
            levels[i] = octree->levels[order[i]];
            counts[i] = octree->counts[order[i]];
        }
        tl_mem_free(ctx, octree->levels);
        tl_mem_free(ctx, octree->counts);
        octree->levels = levels;
        octree->counts = counts;
        levels = NULL;
        counts = NULL;
    }
    tl_mem_free(ctx, counts);
    tl_mem_free(ctx, levels);
    tl_mem_free(ctx, order);
    return st;
}

static tl_status index_top(tli_octree *octree)
{
    tl_status st = TL_OK;
    octree->top = tl_mem_alloc(octree->ctx, TOP_COUNT + 1, sizeof *octree->top, &st);
    octree->parts = tl_mem_zalloc(octree->ctx, octree->leaf_count, sizeof *octree->parts, &st);
    if (st) return st;
    size_t leaf = 0;
    for (size_t t = 0; t <= TOP_COUNT; t++) {
        uint64_t code = (uint64_t)t << 3 * (LEVELS - TOP_LEVELS);
        while (leaf < octree->leaf_count && octree->codes[leaf] < code) leaf++;
        octree->top[t] = (uint32_t)leaf;
    }
    return TL_OK;
}

size_t tli_octree_leaf(const tli_octree *octree, const double xyz[3])
{
    uint64_t code = code_of(octree, xyz);
    size_t top = (size_t)(code >> 3 * (LEVELS - TOP_LEVELS));
    /* the last leaf that begins at or before code; the first one where none does */
    size_t low = octree->top[top], high = octree->top[top + 1];
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (octree->codes[middle] <= code)
            low = middle + 1;
        else
            high = middle;
    }
    return low ? low - 1 : 0;
}

tl_status tli_octree_build(tl_ctx *ctx, uint64_t point_count, tli_points_fn points, void *user,
                           const tli_octree_opts *opts, tli_octree *octree)
{
    *octree = (tli_octree){.ctx = ctx, .is_rotated = opts->rotation != NULL};
    if (opts->rotation) memcpy(octree->rotation, opts->rotation, sizeof octree->rotation);
    stream s = {.ctx = ctx,
                .point_count = point_count,
                .points = points,
                .user = user,
                .stage = opts->stage};
    tl_status st = stream_open(&s);
    if (!st) st = find_box(&s, octree);
    if (!st) st = find_leaves(&s, octree, opts);
    stream_close(&s);
    if (!st) st = sort_leaves(octree);
    if (!st) st = index_top(octree);
    if (st) tli_octree_close(octree);
    return st;
}

void tli_octree_close(tli_octree *octree)
{
    tl_ctx *ctx = octree->ctx;
    if (!ctx) return;
    tl_mem_free(ctx, octree->part_points);
    tl_mem_free(ctx, octree->parts);
    tl_mem_free(ctx, octree->top);
    tl_mem_free(ctx, octree->counts);
    tl_mem_free(ctx, octree->levels);
    tl_mem_free(ctx, octree->codes);
    *octree = (tli_octree){0};
}
