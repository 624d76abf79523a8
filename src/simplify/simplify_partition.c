/* Blocks of vertices that workers may change side by side: a k-d tree whose planes lie at other
 * places in each round, so that what is a border now is inside later. The tree is made from a
 * sample; all vertices then find their blocks on all threads. */
#include "simplify/simplify_order.h"

/* About as many blocks at most: their number has 16 bits, and tables are its square. */
enum { BLOCKS_MAX = 2000 };
/* One vertex in so many makes the tree. */
enum { SAMPLE = 16 };
/* Places of a histogram that finds where to cut. */
enum { BINS = 512 };
/* How far from the middle a plane may lie, in shares of the vertices: so far that the next round
 * has what is at a border now inside. */
static const double SHIFT = 0.2;
/* Sides of at least this part of the longest one are cut in turns. */
static const float SIDE = 0.5f;

typedef struct place {
    float at[3];
} place;

/* A plane, or (axis 3) a block. */
typedef struct node {
    float at;
    uint32_t axis;
    uint32_t low, high; /* nodes on both sides; low is the block of a leaf */
} node;

typedef struct cutter {
    tli_work *work;
    place *places;
    unsigned round;
    uint64_t state; /* of the generator that moves the planes */
    node *nodes;
    size_t node_count, node_capacity;
    uint16_t block_count;
    const tl_lidx *verts;
} cutter;

static double next_shift(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return SHIFT * ((double)(*state >> 40) / (double)(1 << 23) - 1);
}

static place place_of(const tli_work *w, tl_lidx v)
{
    place p = {{0, 0, 0}};
    for (int j = 0; j < 3; j++) {
        double x = (w->verts[v].xyz[j] - w->centre[j]) * w->scale;
        if (isfinite(x)) p.at[j] = (float)x;
    }
    return p;
}

/* Value that about share of the places lie below, on the axis; by a histogram. */
static float split_at(const place *p, size_t count, unsigned axis, float lo, float hi, double share)
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

/* The first long side from an axis on; lo >= hi when all places are one. */
static unsigned choose_side(const place *p, size_t count, unsigned first, float *lo, float *hi)
{
    float least[3], most[3], longest = 0;
    for (int j = 0; j < 3; j++) least[j] = most[j] = p[0].at[j];
    for (size_t i = 1; i < count; i++)
        for (int j = 0; j < 3; j++) {
            least[j] = p[i].at[j] < least[j] ? p[i].at[j] : least[j];
            most[j] = p[i].at[j] > most[j] ? p[i].at[j] : most[j];
        }
    for (int j = 0; j < 3; j++)
        if (most[j] - least[j] > longest) longest = most[j] - least[j];
    unsigned axis = first % 3;
    while (most[axis] - least[axis] < SIDE * longest) axis = (axis + 1) % 3;
    *lo = least[axis];
    *hi = most[axis];
    return axis;
}

static tl_status add_node(cutter *c, node fresh, uint32_t *number)
{
    tl_status st = TL_OK;
    if (c->node_count == c->node_capacity) {
        c->node_capacity = 2 * c->node_capacity + 64;
        c->nodes = tl_mem_resize(c->work->ctx, c->nodes, c->node_capacity, sizeof *c->nodes, &st);
        if (st) return st;
    }
    *number = (uint32_t)c->node_count;
    c->nodes[c->node_count++] = fresh;
    return TL_OK;
}

/* Cuts [begin, end) of the sample into so many blocks; gives the number of the node. */
static tl_status cut(cutter *c, size_t begin, size_t end, size_t blocks, unsigned depth,
                     uint32_t *number)
{
    size_t count = end - begin, low = begin, high = end, half = blocks / 2;
    float lo = 0, hi = 0;
    unsigned axis = 0;
    if (half && count) axis = choose_side(c->places + begin, count, c->round + depth, &lo, &hi);
    if (!(hi > lo)) return add_node(c, (node){0, 3, ++c->block_count, 0}, number);
    double share = (double)half / (double)blocks + next_shift(&c->state);
    float at = split_at(c->places + begin, count, axis, lo, hi, share);
    while (low < high)
        if (c->places[low].at[axis] < at)
            low++;
        else {
            place p = c->places[--high];
            c->places[high] = c->places[low];
            c->places[low] = p;
        }
    uint32_t below = 0, above = 0;
    tl_status st = add_node(c, (node){at, axis, 0, 0}, number);
    if (!st) st = cut(c, begin, low, half, depth + 1, &below);
    if (!st) st = cut(c, low, end, blocks - half, depth + 1, &above);
    if (!st) c->nodes[*number].low = below, c->nodes[*number].high = above;
    return st;
}

static tl_status make_tree(cutter *c, size_t count, size_t wanted)
{
    tl_status st = TL_OK;
    size_t sampled = (count + SAMPLE - 1) / SAMPLE;
    uint32_t root;
    c->places = tl_mem_alloc(c->work->ctx, sampled, sizeof *c->places, &st);
    for (size_t i = 0; !st && i < sampled; i++)
        c->places[i] = place_of(c->work, c->verts[i * SAMPLE]);
    if (!st) st = cut(c, 0, sampled, wanted, 0, &root);
    tl_mem_free(c->work->ctx, c->places);
    return st;
}

static tl_status find_blocks(void *arg, size_t begin, size_t end, unsigned worker)
{
    const cutter *c = arg;
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        tli_vertex *v = &c->work->verts[c->verts[i]];
        place p = place_of(c->work, c->verts[i]);
        const node *n = c->nodes;
        while (n->axis < 3) n = c->nodes + (p.at[n->axis] < n->at ? n->low : n->high);
        v->block = (uint16_t)n->low;
        v->border = 0;
    }
    return TL_OK;
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

tl_status tli_partition(tli_work *work, const tl_lidx *verts, size_t count, size_t wanted,
                        unsigned round, size_t *block_count)
{
    cutter c = {.work = work, .round = round, .state = round + 1, .verts = verts};
    tl_status st = make_tree(&c, count, wanted < BLOCKS_MAX ? wanted : BLOCKS_MAX);
    if (!st) st = tli_parallel(work->ctx, count, 8192, find_blocks, &c);
    if (!st) st = tli_parallel(work->ctx, work->tet_count, 16384, mark_borders, work);
    tl_mem_free(work->ctx, c.nodes);
    *block_count = c.block_count;
    return st;
}

tl_status tli_sort_by_block(const tli_work *w, const tl_lidx *verts, size_t count,
                            size_t block_count, tl_lidx **sorted, size_t **starts)
{
    tl_status st = TL_OK;
    size_t *at = *starts = tl_mem_zalloc(w->ctx, block_count + 2, sizeof *at, &st);
    tl_lidx *to = *sorted = tl_mem_alloc(w->ctx, count, sizeof *to, &st);
    if (st) return st;
    for (size_t i = 0; i < count; i++) at[w->verts[verts[i]].block + 1]++;
    for (size_t b = 1; b <= block_count; b++) at[b + 1] += at[b];
    for (size_t i = 0; i < count; i++) to[at[w->verts[verts[i]].block]++] = verts[i];
    return TL_OK; /* moved on by one block: starts[b] is now where block b + 1 begins */
}
