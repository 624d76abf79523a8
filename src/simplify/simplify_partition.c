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
/* Deeper than this only coinciding places get. */
enum { DEPTH_MAX = 40 };

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
    size_t leaf_max; /* sampled places in a block */
    uint64_t state;  /* of the generator that moves the planes */
    node *nodes;
    size_t node_count, node_capacity;
    uint16_t block_count;
    const tl_lidx *verts;
} cutter;

static double next_share(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return 0.35 + 0.3 * (double)(*state >> 40) / (double)(1 << 24);
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

static unsigned longest_side(const place *p, size_t count, float *lo, float *hi)
{
    float least[3], most[3];
    unsigned axis = 0;
    for (int j = 0; j < 3; j++) least[j] = most[j] = p[0].at[j];
    for (size_t i = 1; i < count; i++)
        for (int j = 0; j < 3; j++) {
            least[j] = p[i].at[j] < least[j] ? p[i].at[j] : least[j];
            most[j] = p[i].at[j] > most[j] ? p[i].at[j] : most[j];
        }
    for (unsigned j = 1; j < 3; j++)
        if (most[j] - least[j] > most[axis] - least[axis]) axis = j;
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

/* Cuts [begin, end) of the sample along its longest side; gives the number of the node. */
static tl_status cut(cutter *c, size_t begin, size_t end, int depth, uint32_t *number)
{
    size_t count = end - begin, low = begin, high = end;
    float lo = 0, hi = 0;
    unsigned axis = count > c->leaf_max ? longest_side(c->places + begin, count, &lo, &hi) : 0;
    if (count <= c->leaf_max || depth == DEPTH_MAX || !(hi > lo))
        return add_node(c, (node){0, 3, ++c->block_count, 0}, number);
    float at = split_at(c->places + begin, count, axis, lo, hi, next_share(&c->state));
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
    if (!st) st = cut(c, begin, low, depth + 1, &below);
    if (!st) st = cut(c, low, end, depth + 1, &above);
    if (!st) c->nodes[*number].low = below, c->nodes[*number].high = above;
    return st;
}

static tl_status make_tree(cutter *c, size_t count)
{
    tl_status st = TL_OK;
    size_t sampled = (count + SAMPLE - 1) / SAMPLE;
    uint32_t root;
    c->places = tl_mem_alloc(c->work->ctx, sampled, sizeof *c->places, &st);
    for (size_t i = 0; !st && i < sampled; i++)
        c->places[i] = place_of(c->work, c->verts[i * SAMPLE]);
    if (!st) st = cut(c, 0, sampled, 0, &root);
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

/* A counting sort of the vertices by block. */
static tl_status sort_by_block(cutter *c, tl_lidx *verts, size_t count, size_t **starts)
{
    tl_status st = TL_OK;
    const tli_work *w = c->work;
    size_t blocks = c->block_count;
    size_t *at = tl_mem_zalloc(w->ctx, blocks + 2, sizeof *at, &st);
    tl_lidx *sorted = tl_mem_alloc(w->ctx, count, sizeof *sorted, &st);
    if (!st) {
        for (size_t i = 0; i < count; i++) at[w->verts[verts[i]].block + 1]++;
        for (size_t b = 1; b <= blocks; b++) at[b + 1] += at[b];
        for (size_t i = 0; i < count; i++) sorted[at[w->verts[verts[i]].block]++] = verts[i];
        memcpy(verts, sorted, count * sizeof *verts);
    }
    tl_mem_free(w->ctx, sorted);
    *starts = at; /* moved on by one block: starts[b] is now where block b + 1 begins */
    return st;
}

tl_status tli_partition(tli_work *work, tl_lidx *verts, size_t count, size_t block_max,
                        unsigned round, size_t **starts, size_t *block_count)
{
    if (count / block_max > BLOCKS_MAX) block_max = count / BLOCKS_MAX;
    cutter c = {.work = work, .leaf_max = block_max / SAMPLE, .state = round + 1, .verts = verts};
    tl_status st = make_tree(&c, count);
    if (!st) st = tli_parallel(work->ctx, count, 8192, find_blocks, &c);
    if (!st) st = sort_by_block(&c, verts, count, starts);
    if (!st) st = tli_parallel(work->ctx, work->tet_count, 65536, mark_borders, work);
    tl_mem_free(work->ctx, c.nodes);
    *block_count = c.block_count;
    return st;
}
