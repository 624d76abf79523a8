/* Blocks of vertices that workers may change side by side: a k-d tree whose planes lie at other
 * places in each round, so that what is a border now is inside later. */
#include "simplify/simplify_order.h"

/* About as many blocks at most: their number has 16 bits, and tables are its square. */
enum { BINS = 512, BLOCKS_MAX = 2000 };

typedef struct place {
    float at[3];
    tl_lidx vert;
} place;

typedef struct cutter {
    tli_work *work;
    place *places, *spare;
    size_t block_max;
    uint64_t state; /* of the generator that moves the planes */
    size_t *starts;
    size_t block_count, block_capacity;
} cutter;

static double next_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 40) / (double)(1 << 24);
}

/* Value that about share of the places lie below, on the axis; by a histogram. */
static float split_at(const place *p, size_t count, int axis, float lo, float hi, double share)
{
    size_t bins[BINS] = {0}, below = 0, b = 0;
    float scale = BINS / (hi - lo);
    for (size_t i = 0; i < count; i++) {
        int bin = (int)((p[i].at[axis] - lo) * scale);
        bins[bin < 0 ? 0 : bin >= BINS ? BINS - 1 : bin]++;
    }
    while (b < BINS - 1 && (double)(below + bins[b]) < share * (double)count) below += bins[b++];
    return lo + (float)(b + 1) / scale;
}

static void set_block(tli_vertex *v, uint16_t block)
{
    v->block = block;
    v->border = 0;
}

static tl_status add_block(cutter *c, size_t begin, size_t end)
{
    tl_status st = TL_OK;
    if (c->block_count + 2 > c->block_capacity) {
        c->block_capacity = 2 * c->block_capacity + 16;
        c->starts =
            tl_mem_resize(c->work->ctx, c->starts, c->block_capacity, sizeof *c->starts, &st);
        if (st) return st;
    }
    c->starts[c->block_count++] = begin;
    c->starts[c->block_count] = end;
    for (size_t i = begin; i < end; i++)
        set_block(&c->work->verts[c->places[i].vert], (uint16_t)c->block_count);
    return TL_OK;
}

/* Cuts [begin, end) along its longest side; depth bounds the recursion for coinciding places. */
static tl_status cut(cutter *c, size_t begin, size_t end, int depth)
{
    size_t count = end - begin, low = begin, high = 0;
    if (count <= c->block_max || depth == 40) return add_block(c, begin, end);
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = begin; i < end; i++)
        for (int j = 0; j < 3; j++) {
            lo[j] = c->places[i].at[j] < lo[j] ? c->places[i].at[j] : lo[j];
            hi[j] = c->places[i].at[j] > hi[j] ? c->places[i].at[j] : hi[j];
        }
    int axis = 0;
    for (int j = 1; j < 3; j++)
        if (hi[j] - lo[j] > hi[axis] - lo[axis]) axis = j;
    double share = 0.35 + 0.3 * next_random(&c->state);
    if (!(hi[axis] > lo[axis])) return add_block(c, begin, end);
    float at = split_at(c->places + begin, count, axis, lo[axis], hi[axis], share);
    for (size_t i = begin; i < end; i++)
        if (c->places[i].at[axis] < at)
            c->places[low++] = c->places[i];
        else
            c->spare[high++] = c->places[i];
    memcpy(c->places + low, c->spare, high * sizeof *c->spare);
    tl_status st = cut(c, begin, low, depth + 1);
    return st ? st : cut(c, low, end, depth + 1);
}

/* A tet with vertices of several blocks makes all of them border vertices. */
static tl_status mark_borders(void *arg, size_t begin, size_t end, unsigned worker)
{
    tli_work *w = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = w->tets[t];
        if (q[0] == TL_NONE) continue;
        uint16_t b = w->verts[q[0]].block;
        if (w->verts[q[1]].block == b && w->verts[q[2]].block == b && w->verts[q[3]].block == b)
            continue;
        for (int j = 0; j < 4; j++) __atomic_store_n(&w->verts[q[j]].border, 1, __ATOMIC_RELAXED);
    }
    return TL_OK;
}

tl_status tli_partition(tli_work *work, tl_lidx *verts, size_t count, size_t block_max,
                        unsigned round, size_t **starts, size_t *block_count)
{
    tl_status st = TL_OK;
    cutter c = {.work = work, .block_max = block_max, .state = round + 1};
    if (count / block_max > BLOCKS_MAX) c.block_max = count / BLOCKS_MAX;
    c.places = tl_mem_alloc(work->ctx, count, sizeof *c.places, &st);
    c.spare = tl_mem_alloc(work->ctx, count, sizeof *c.spare, &st);
    for (size_t i = 0; !st && i < count; i++) {
        const double *x = work->verts[verts[i]].xyz;
        for (int j = 0; j < 3; j++)
            c.places[i].at[j] = (float)((x[j] - work->verts[0].xyz[j]) * work->scale);
        c.places[i].vert = verts[i];
    }
    if (!st) st = cut(&c, 0, count, 0);
    for (size_t i = 0; !st && i < count; i++) verts[i] = c.places[i].vert;
    tl_mem_free(work->ctx, c.spare);
    tl_mem_free(work->ctx, c.places);
    if (!st) st = tli_parallel(work->ctx, work->tet_count, 65536, mark_borders, work);
    *starts = c.starts;
    *block_count = c.block_count;
    return st;
}
