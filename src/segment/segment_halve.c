/* A graph in two halves of given weights with a small cut: heavy edges are contracted until few
 * nodes are left, a half grows there from several starts, and on the way back nodes at the cut
 * change sides as long as that pays, through worse states too (Karypis and Kumar 1998; Fiduccia and
 * Mattheyses 1982). No random numbers: equal graphs give equal halves. */
#include "segment/segment_halve.h"

#include <string.h>

/* Contraction ends at so many nodes, or where a step leaves more than this part of them. */
#define COARSEST 80u
#define STALLED 0.95
/* A contracted node has at most that part of the weight of the lighter half. */
#define NODE_SHARE 0.1
/* Starts for the first halves, and rounds of moves on each level. */
#define STARTS 12u
#define ROUNDS 8
/* Moves in a row that may fail to shorten the cut before a round ends. */
#define PATIENCE 60u

/* ---- contraction ---- */

/* A graph and, but for the finest, what it was contracted from. */
typedef struct scale {
    tli_graph graph;
    uint32_t *coarse_of; /* [node_count] node of the next scale */
} scale;

/* A fixed order without a pattern. */
static void shuffle(uint32_t *order, uint32_t count)
{
    uint64_t state = 0x9e3779b97f4a7c15u;
    for (uint32_t i = 0; i < count; i++) order[i] = i;
    for (uint32_t i = count; i > 1; i--) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        uint32_t j = (uint32_t)((state >> 32) * i >> 32), t = order[i - 1];
        order[i - 1] = order[j];
        order[j] = t;
    }
}

/* Pairs each node with the free neighbour of its heaviest edge. Returns the number of coarse nodes,
 * whose first members go to firsts. */
static uint32_t match(const tli_graph *g, uint64_t weight_max, const uint32_t *order,
                      uint32_t *coarse_of, uint32_t *firsts)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < g->node_count; i++) coarse_of[i] = UINT32_MAX;
    for (uint32_t i = 0; i < g->node_count; i++) {
        uint32_t node = order[i], best = node, weight = 0;
        if (coarse_of[node] != UINT32_MAX) continue;
        for (uint32_t e = g->begins[node]; e < g->begins[node + 1]; e++) {
            uint32_t other = g->targets[e];
            uint64_t sum = (uint64_t)g->node_weights[node] + g->node_weights[other];
            if (coarse_of[other] != UINT32_MAX || other == node || sum > weight_max) continue;
            if (g->weights[e] <= weight) continue;
            weight = g->weights[e];
            best = other;
        }
        firsts[count] = node;
        coarse_of[node] = coarse_of[best] = count++;
    }
    return count;
}

/* The second member of the pair of a node, or the node itself. */
static void find_partners(const tli_graph *g, const uint32_t *coarse_of, const uint32_t *firsts,
                          uint32_t *seconds)
{
    for (uint32_t i = 0; i < g->node_count; i++)
        if (firsts[coarse_of[i]] != i) seconds[coarse_of[i]] = i;
}

/* Adds the edges of a node to those of a coarse one, which begin at first. places: of coarse nodes
 * among them, valid where they name an edge at or past first. */
static void add_edges(const tli_graph *g, const uint32_t *coarse_of, uint32_t node, uint32_t self,
                      uint32_t *places, tli_graph *to, uint32_t first, uint32_t *end)
{
    for (uint32_t e = g->begins[node]; e < g->begins[node + 1]; e++) {
        uint32_t other = coarse_of[g->targets[e]], place = places[other];
        if (other == self) continue;
        if (place >= first && place < *end && to->targets[place] == other) {
            to->weights[place] += g->weights[e];
            continue;
        }
        places[other] = *end;
        to->targets[*end] = other;
        to->weights[(*end)++] = g->weights[e];
    }
}

/* The next scale; coarse->graph.node_count is 0 where that would not be smaller. */
static tl_status contract(tl_ctx *ctx, scale *fine, uint64_t weight_max, scale *coarse)
{
    tl_status st = TL_OK;
    const tli_graph *g = &fine->graph;
    uint32_t n = g->node_count, edges = g->begins[n];
    tli_graph *to = &coarse->graph;
    *coarse = (scale){0};
    uint32_t *order = tl_mem_alloc(ctx, n, sizeof *order, &st);
    uint32_t *firsts = tl_mem_alloc(ctx, n, sizeof *firsts, &st);
    fine->coarse_of = tl_mem_alloc(ctx, n, sizeof *fine->coarse_of, &st);
    if (!st) {
        shuffle(order, n);
        to->node_count = match(g, weight_max, order, fine->coarse_of, firsts);
        if (to->node_count > STALLED * n) to->node_count = 0;
    }
    if (!st && to->node_count) {
        uint32_t *seconds = order, end = 0;
        uint32_t *places = tl_mem_zalloc(ctx, to->node_count, sizeof *places, &st);
        to->begins = tl_mem_alloc(ctx, (size_t)to->node_count + 1, sizeof *to->begins, &st);
        to->targets = tl_mem_alloc(ctx, edges, sizeof *to->targets, &st);
        to->weights = tl_mem_alloc(ctx, edges, sizeof *to->weights, &st);
        to->node_weights = tl_mem_alloc(ctx, to->node_count, sizeof *to->node_weights, &st);
        for (uint32_t c = 0; !st && c < to->node_count; c++) seconds[c] = firsts[c];
        if (!st) find_partners(g, fine->coarse_of, firsts, seconds);
        for (uint32_t c = 0; !st && c < to->node_count; c++) {
            uint32_t first = end;
            to->begins[c] = first;
            to->node_weights[c] = g->node_weights[firsts[c]];
            add_edges(g, fine->coarse_of, firsts[c], c, places, to, first, &end);
            if (seconds[c] == firsts[c]) continue;
            to->node_weights[c] += g->node_weights[seconds[c]];
            add_edges(g, fine->coarse_of, seconds[c], c, places, to, first, &end);
        }
        if (!st) to->begins[to->node_count] = end;
        tl_mem_free(ctx, places);
    }
    tl_mem_free(ctx, firsts);
    tl_mem_free(ctx, order);
    if (st) tli_graph_close(ctx, to);
    return st;
}

/* ---- nodes by what moving them gains, largest first ---- */

typedef struct heap {
    uint32_t *nodes, count;
} heap;

/* The work on one scale. */
typedef struct halver {
    const tli_graph *graph;
    uint8_t *side;    /* [node_count] */
    uint64_t left;    /* weight of side 0 */
    uint64_t wanted;  /* that it should have */
    uint64_t slack;   /* that it may be off by */
    int64_t *gains;   /* [node_count] what the cut gets shorter by if a node moves */
    heap heaps[2];    /* nodes of each side that may move */
    uint32_t *places; /* [node_count] in the heap of its side, or UINT32_MAX */
    uint8_t *moved;   /* [node_count] in this round */
    uint32_t *trail;  /* [node_count] nodes in the order they moved */
} halver;

static bool before(const halver *h, uint32_t a, uint32_t b)
{
    return h->gains[a] > h->gains[b] || (h->gains[a] == h->gains[b] && a < b);
}

static void put(halver *h, heap *q, uint32_t at, uint32_t node)
{
    q->nodes[at] = node;
    h->places[node] = at;
}

static void sift(halver *h, heap *q, uint32_t at)
{
    uint32_t node = q->nodes[at];
    for (; at && before(h, node, q->nodes[(at - 1) / 2]); at = (at - 1) / 2)
        put(h, q, at, q->nodes[(at - 1) / 2]);
    for (;;) {
        uint32_t child = 2 * at + 1;
        if (child >= q->count) break;
        if (child + 1 < q->count && before(h, q->nodes[child + 1], q->nodes[child])) child++;
        if (!before(h, q->nodes[child], node)) break;
        put(h, q, at, q->nodes[child]);
        at = child;
    }
    put(h, q, at, node);
}

static void heap_add(halver *h, uint32_t node)
{
    heap *q = &h->heaps[h->side[node]];
    if (h->places[node] == UINT32_MAX) put(h, q, q->count++, node);
    sift(h, q, h->places[node]);
}

static void heap_remove(halver *h, uint32_t node)
{
    heap *q = &h->heaps[h->side[node]];
    uint32_t at = h->places[node], last = q->nodes[--q->count];
    h->places[node] = UINT32_MAX;
    if (last == node) return;
    put(h, q, at, last);
    sift(h, q, at);
}

/* ---- moves ---- */

static uint64_t off_by(const halver *h, uint64_t left)
{
    return left > h->wanted ? left - h->wanted : h->wanted - left;
}

/* Changes the side of a node; gains follow. */
static void flip(halver *h, uint32_t node)
{
    const tli_graph *g = h->graph;
    uint8_t from = h->side[node];
    h->left += from ? g->node_weights[node] : 0;
    h->left -= from ? 0 : g->node_weights[node];
    h->side[node] = !from;
    h->gains[node] = -h->gains[node];
    for (uint32_t e = g->begins[node]; e < g->begins[node + 1]; e++) {
        uint32_t other = g->targets[e];
        int64_t weight = 2 * (int64_t)g->weights[e];
        h->gains[other] += h->side[other] == from ? weight : -weight;
    }
}

/* Gains of all nodes; returns the cut. */
static int64_t set_gains(halver *h)
{
    const tli_graph *g = h->graph;
    int64_t cut = 0;
    h->left = 0;
    for (uint32_t i = 0; i < g->node_count; i++) {
        h->gains[i] = 0;
        h->left += h->side[i] ? 0 : g->node_weights[i];
        for (uint32_t e = g->begins[i]; e < g->begins[i + 1]; e++) {
            bool crosses = h->side[g->targets[e]] != h->side[i];
            h->gains[i] += crosses ? (int64_t)g->weights[e] : -(int64_t)g->weights[e];
            cut += crosses ? g->weights[e] : 0;
        }
    }
    return cut / 2;
}

/* The best node whose move keeps the balance, or betters it; UINT32_MAX: none. */
static uint32_t choose(const halver *h)
{
    uint32_t best = UINT32_MAX;
    uint64_t off = off_by(h, h->left);
    for (int s = 0; s < 2; s++) {
        if (!h->heaps[s].count) continue;
        uint32_t node = h->heaps[s].nodes[0];
        uint64_t weight = h->graph->node_weights[node];
        uint64_t after = off_by(h, s ? h->left + weight : h->left - weight);
        if (after > h->slack && after >= off) continue;
        if (best == UINT32_MAX || off > h->slack || before(h, node, best)) best = node;
    }
    return best;
}

static bool at_cut(const halver *h, uint32_t node)
{
    const tli_graph *g = h->graph;
    for (uint32_t e = g->begins[node]; e < g->begins[node + 1]; e++)
        if (h->side[g->targets[e]] != h->side[node]) return true;
    return false;
}

/* One round of moves, back to the best state on its way; true if that is better than the first. */
static bool move_round(halver *h)
{
    const tli_graph *g = h->graph;
    int64_t gained = 0, best = 0;
    uint64_t best_off = off_by(h, h->left);
    uint32_t count = 0, kept = 0;
    bool forced = best_off > h->slack;
    h->heaps[0].count = h->heaps[1].count = 0;
    for (uint32_t i = 0; i < g->node_count; i++) {
        h->moved[i] = 0;
        h->places[i] = UINT32_MAX;
        if (forced || at_cut(h, i)) heap_add(h, i);
    }
    while (count - kept < PATIENCE) {
        uint32_t node = choose(h);
        if (node == UINT32_MAX) break;
        heap_remove(h, node);
        gained += h->gains[node];
        h->moved[node] = 1;
        h->trail[count++] = node;
        flip(h, node);
        for (uint32_t e = g->begins[node]; e < g->begins[node + 1]; e++)
            if (!h->moved[g->targets[e]]) heap_add(h, g->targets[e]);
        uint64_t off = off_by(h, h->left);
        bool fits = off <= h->slack, fitted = best_off <= h->slack;
        bool better =
            fits && fitted ? gained > best || (gained == best && off < best_off) : off < best_off;
        if (!better) continue;
        best = gained;
        best_off = off;
        kept = count;
    }
    while (count > kept) flip(h, h->trail[--count]);
    return kept > 0;
}

/* Betters the sides as they are; returns the cut. */
static int64_t refine(halver *h)
{
    set_gains(h);
    for (int i = 0; i < ROUNDS && move_round(h); i++) {
    }
    return set_gains(h);
}

/* Side 0 grows from a node by what is nearest to it until it has its weight. */
static void grow(halver *h, uint32_t start)
{
    const tli_graph *g = h->graph;
    uint32_t next = 0;
    for (uint32_t i = 0; i < g->node_count; i++) {
        h->side[i] = 1;
        h->places[i] = UINT32_MAX;
    }
    h->heaps[0].count = h->heaps[1].count = 0;
    set_gains(h);
    heap_add(h, start);
    while (h->left < h->wanted) {
        heap *q = &h->heaps[1];
        while (!q->count && next < g->node_count) { /* a part that hangs together otherwise */
            if (h->side[next]) heap_add(h, next);
            next++;
        }
        if (!q->count) return;
        uint32_t node = q->nodes[0];
        uint64_t after = h->left + g->node_weights[node];
        if (off_by(h, after) > off_by(h, h->left)) return;
        heap_remove(h, node);
        flip(h, node);
        for (uint32_t e = g->begins[node]; e < g->begins[node + 1]; e++)
            if (h->side[g->targets[e]]) heap_add(h, g->targets[e]);
    }
}

/* The best of several starts. best [node_count] is scratch. */
static void halve_coarsest(halver *h, uint8_t *best)
{
    uint32_t n = h->graph->node_count, starts = n < STARTS ? n : STARTS;
    int64_t best_cut = INT64_MAX;
    uint64_t best_over = UINT64_MAX;
    for (uint32_t i = 0; i < starts; i++) {
        grow(h, (uint32_t)((uint64_t)i * n / starts));
        int64_t cut = refine(h);
        uint64_t off = off_by(h, h->left), over = off > h->slack ? off - h->slack : 0;
        if (over > best_over || (over == best_over && cut >= best_cut)) continue;
        best_over = over;
        best_cut = cut;
        memcpy(best, h->side, n);
    }
    memcpy(h->side, best, n);
}

/* ---- all scales ---- */

enum { SCALES_MAX = 48 };

static tl_status halve_scales(tl_ctx *ctx, scale *scales, int count, uint64_t wanted,
                              uint64_t slack, uint8_t *side)
{
    tl_status st = TL_OK;
    size_t n = scales[0].graph.node_count;
    halver h = {.side = side, .wanted = wanted, .slack = slack};
    h.gains = tl_mem_alloc(ctx, n, sizeof *h.gains, &st);
    h.heaps[0].nodes = tl_mem_alloc(ctx, n, sizeof(uint32_t), &st);
    h.heaps[1].nodes = tl_mem_alloc(ctx, n, sizeof(uint32_t), &st);
    h.places = tl_mem_alloc(ctx, n, sizeof *h.places, &st);
    h.moved = tl_mem_alloc(ctx, n, sizeof *h.moved, &st);
    h.trail = tl_mem_alloc(ctx, n, sizeof *h.trail, &st);
    uint8_t *scratch = tl_mem_alloc(ctx, n, sizeof *scratch, &st);
    for (int i = count; !st && i-- > 0;) {
        const scale *s = &scales[i];
        h.graph = &s->graph;
        if (i == count - 1) {
            halve_coarsest(&h, scratch);
            continue;
        }
        for (uint32_t k = 0; k < s->graph.node_count; k++) scratch[k] = side[s->coarse_of[k]];
        memcpy(side, scratch, s->graph.node_count);
        refine(&h);
    }
    void *blocks[] = {scratch,          h.trail,          h.moved, h.places,
                      h.heaps[1].nodes, h.heaps[0].nodes, h.gains};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    return st;
}

tl_status tli_graph_halve(tl_ctx *ctx, const tli_graph *graph, uint64_t wanted, uint64_t slack,
                          uint8_t *side)
{
    tl_status st = TL_OK;
    scale scales[SCALES_MAX] = {{*graph, NULL}};
    int count = 1;
    uint64_t sum = 0;
    for (uint32_t i = 0; i < graph->node_count; i++) sum += graph->node_weights[i];
    uint64_t lighter = wanted < sum - wanted ? wanted : sum - wanted;
    uint64_t weight_max = (uint64_t)(NODE_SHARE * (double)lighter) + 1;
    while (!st && count < SCALES_MAX && scales[count - 1].graph.node_count > COARSEST) {
        st = contract(ctx, &scales[count - 1], weight_max, &scales[count]);
        if (st || !scales[count].graph.node_count) break;
        count++;
    }
    if (!st) st = halve_scales(ctx, scales, count, wanted, slack, side);
    for (int i = 0; i < count; i++) {
        tl_mem_free(ctx, scales[i].coarse_of);
        if (i) tli_graph_close(ctx, &scales[i].graph);
    }
    return st;
}
