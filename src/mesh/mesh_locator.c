/* Point location: a walk through the adjacency from a tet nearby, and a tree of boxes where the
 * walk ends without an answer. Which tet holds a point is decided by exact signs alone; rounded
 * volumes only choose the way. The walk never turns back at once and has a bounded number of steps,
 * so it ends on every mesh; it is not asked whether a point is outside. */
#include <math.h>

#include "base/base_predicates.h"
#include "base/base_vec.h"
#include "mesh/mesh.h"
#include "mesh/mesh_tree.h"

/* Steps after which the tree is the faster way. */
#define WALK_STEPS 48
/* Relative slack in comparing squared distances, so that of equally near tets none is left out
 * because its box was rounded. */
#define TIE_SLACK 1e-12

struct tl_locator {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const tl_lidx *opposite;
    tl_lidx *own_opposite; /* when the caller had none */
    tli_tree tree;
};

/* Exactly: x lies in a positive tet or on its boundary. The four volumes sum to that of the tet, so
 * a flat one has signs that differ or four zeros, and an inverted one has a negative. */
static bool holds(const double p[4][3], const double x[3])
{
    int sum = 0;
    for (int i = 0; i < 4; i++) {
        const double *c[4] = {p[0], p[1], p[2], p[3]};
        c[i] = x;
        int sign = tli_orient3d(c[0], c[1], c[2], c[3]);
        if (sign < 0) return false;
        sum += sign;
    }
    return sum > 0;
}

/* Weights of a point that the tet holds. Exact ones are not negative; where rounding makes them so,
 * or the tet is so thin that its volume is lost, the nearest point of the tet stands for it. */
static void inner_weights(const double p[4][3], const double x[3], double weights[4])
{
    double sum = 0;
    tli_tet_parts(p, x, weights);
    for (int i = 0; i < 4; i++) {
        weights[i] = weights[i] > 0 ? weights[i] : 0;
        sum += weights[i];
    }
    if (!(sum > 0) || !isfinite(sum)) {
        tl_tet_nearest(p, x, weights);
        return;
    }
    for (int i = 0; i < 4; i++) weights[i] /= sum;
}

static tl_lidx walk(const tl_locator *loc, const double x[3], tl_lidx tet, double weights[4])
{
    int entered = -1;
    for (int step = 0; step < WALK_STEPS; step++) {
        double p[4][3], parts[4];
        tli_tet_corners(loc->mesh->xyz, loc->mesh->tets + 4 * (size_t)tet, p);
        tli_tet_parts(TLI_CORNERS(p), x, parts);
        /* Flat, inverted, or not finite: no way through. */
        if (!(parts[0] + parts[1] + parts[2] + parts[3] > 0)) return TL_NONE;
        const tl_lidx *opposite = loc->opposite + 4 * (size_t)tet;
        int way = -1;
        bool beyond = false;
        for (int i = 0; i < 4; i++) {
            if (i == entered || !(parts[i] < 0)) continue;
            beyond = true;
            if (opposite[i] != TL_NONE && (way < 0 || parts[i] < parts[way])) way = i;
        }
        if (!beyond && holds(TLI_CORNERS(p), x)) {
            if (weights) inner_weights(TLI_CORNERS(p), x, weights);
            return tet;
        }
        if (way < 0) return TL_NONE;
        entered = (int)(opposite[way] & 3);
        tet = opposite[way] / 4;
    }
    return TL_NONE;
}

static const tli_tree_block *children(const tli_tree *tree, tli_tree_node at)
{
    return tree->blocks + tree->level_begins[at.level - 1] + at.node;
}

static tl_lidx find_in_leaf(const tl_locator *loc, const double x[3], size_t leaf,
                            double weights[4])
{
    const tli_tree *tree = &loc->tree;
    size_t begin = leaf * TLI_TREE_WIDTH, end = begin + TLI_TREE_WIDTH;
    if (end > tree->item_count) end = tree->item_count;
    for (size_t i = begin; i < end; i++) {
        double p[4][3];
        tli_tet_corners(loc->mesh->xyz, loc->mesh->tets + 4 * (size_t)tree->order[i], p);
        if (!holds(TLI_CORNERS(p), x)) continue;
        if (weights) inner_weights(TLI_CORNERS(p), x, weights);
        return tree->order[i];
    }
    return TL_NONE;
}

static tl_lidx find_in_tree(const tl_locator *loc, const double x[3], double weights[4])
{
    const tli_tree *tree = &loc->tree;
    tli_tree_node stack[TLI_TREE_STACK];
    unsigned depth = 0;
    bool has_walked = false;
    float below[3], above[3];
    for (int k = 0; k < 3; k++) {
        below[k] = tli_float_below(x[k] - tree->center[k]);
        above[k] = tli_float_above(x[k] - tree->center[k]);
    }
    if (tree->level_count) stack[depth++] = (tli_tree_node){0, tree->level_count, 0};
    while (depth) {
        tli_tree_node at = stack[--depth];
        if (at.level == 0) {
            /* The first leaf is near: a few steps from there are less than the other leaves. */
            tl_lidx tet = TL_NONE;
            if (!has_walked) tet = walk(loc, x, tree->order[at.node * TLI_TREE_WIDTH], weights);
            has_walked = true;
            if (tet == TL_NONE) tet = find_in_leaf(loc, x, at.node, weights);
            if (tet != TL_NONE) return tet;
            continue;
        }
        const tli_tree_block *block = children(tree, at);
        for (int c = 0; c < TLI_TREE_WIDTH; c++) {
            bool inside = true;
            for (int k = 0; k < 3; k++)
                inside = inside & (block->low[k][c] <= below[k]) & (block->high[k][c] >= above[k]);
            if (inside)
                stack[depth++] =
                    (tli_tree_node){at.node * TLI_TREE_WIDTH + (tl_lidx)c, at.level - 1, 0};
        }
    }
    return TL_NONE;
}

tl_lidx tl_locator_find(const tl_locator *locator, const double x[3], tl_lidx hint,
                        double weights[4])
{
    if (!vec_is_finite(x)) return TL_NONE;
    tl_lidx tet = TL_NONE;
    if (hint < locator->mesh->tet_count) tet = walk(locator, x, hint, weights);
    return tet != TL_NONE ? tet : find_in_tree(locator, x, weights);
}

/* ---- all tets of a box ---- */

static bool visit_leaf(const tli_tree *tree, size_t leaf, bool (*fn)(void *user, tl_lidx tet),
                       void *user)
{
    size_t begin = leaf * TLI_TREE_WIDTH, end = begin + TLI_TREE_WIDTH;
    if (end > tree->item_count) end = tree->item_count;
    for (size_t i = begin; i < end; i++)
        if (!fn(user, tree->order[i])) return false;
    return true;
}

void tli_locator_box(const tl_locator *locator, const double low[3], const double high[3],
                     bool (*fn)(void *user, tl_lidx tet), void *user)
{
    const tli_tree *tree = &locator->tree;
    tli_tree_node stack[TLI_TREE_STACK];
    unsigned depth = 0;
    float from[3], to[3];
    for (int k = 0; k < 3; k++) {
        from[k] = tli_float_below(low[k] - tree->center[k]);
        to[k] = tli_float_above(high[k] - tree->center[k]);
    }
    if (tree->level_count) stack[depth++] = (tli_tree_node){0, tree->level_count, 0};
    while (depth) {
        tli_tree_node at = stack[--depth];
        if (at.level == 0) {
            if (!visit_leaf(tree, at.node, fn, user)) return;
            continue;
        }
        const tli_tree_block *block = children(tree, at);
        for (int c = 0; c < TLI_TREE_WIDTH; c++) {
            bool touches = true;
            for (int k = 0; k < 3; k++)
                touches = touches & (block->low[k][c] <= to[k]) & (block->high[k][c] >= from[k]);
            if (touches)
                stack[depth++] =
                    (tli_tree_node){at.node * TLI_TREE_WIDTH + (tl_lidx)c, at.level - 1, 0};
        }
    }
}

/* ---- the nearest tet ---- */

typedef struct nearest {
    tl_lidx tet;
    double distance, weights[4];
} nearest;

/* Squared distance to the box of the corners. */
static double corner_box_square(const double p[4][3], const double x[3])
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        double low = p[0][k], high = p[0][k];
        for (int i = 1; i < 4; i++) {
            low = p[i][k] < low ? p[i][k] : low;
            high = p[i][k] > high ? p[i][k] : high;
        }
        double under = low - x[k], over = x[k] - high, away = under > over ? under : over;
        if (away > 0) square += away * away;
    }
    return square;
}

/* Of equally near tets the first one counts, so that the result does not depend on the way. */
static void offer_tet(const tl_locator *loc, const double x[3], tl_lidx tet, nearest *best)
{
    double p[4][3], weights[4];
    tli_tet_corners(loc->mesh->xyz, loc->mesh->tets + 4 * (size_t)tet, p);
    double limit = best->distance * best->distance * (1 + TIE_SLACK);
    if (corner_box_square(TLI_CORNERS(p), x) > limit) return;
    double distance = tl_tet_nearest(TLI_CORNERS(p), x, weights);
    if (!isfinite(distance)) return;
    if (!(distance < best->distance || (distance == best->distance && tet < best->tet))) return;
    best->tet = tet;
    best->distance = distance;
    for (int i = 0; i < 4; i++) best->weights[i] = weights[i];
}

static double box_square(const tli_tree_block *block, int child, const double x[3])
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        double under = (double)block->low[k][child] - x[k],
               over = x[k] - (double)block->high[k][child];
        double away = under > over ? under : over;
        if (away > 0) square += away * away;
    }
    return square;
}

/* Puts the children on the stack, the nearest on top. */
static unsigned push_children(const tli_tree_block *block, tli_tree_node at, const double x[3],
                              double limit, tli_tree_node *stack, unsigned depth)
{
    unsigned bottom = depth;
    for (int c = 0; c < TLI_TREE_WIDTH; c++) {
        tli_tree_node child = {at.node * TLI_TREE_WIDTH + (tl_lidx)c, at.level - 1, 0};
        child.square = box_square(block, c, x);
        bool is_there = block->low[0][c] <= block->high[0][c];
        if (!is_there || !(child.square <= limit)) continue;
        unsigned place = depth++;
        for (; place > bottom && stack[place - 1].square < child.square; place--)
            stack[place] = stack[place - 1];
        stack[place] = child;
    }
    return depth;
}

static void search_nearest(const tl_locator *loc, const double x[3], nearest *best)
{
    const tli_tree *tree = &loc->tree;
    tli_tree_node stack[TLI_TREE_STACK];
    unsigned depth = 0;
    double local[3];
    for (int k = 0; k < 3; k++) local[k] = x[k] - tree->center[k];
    if (tree->level_count) stack[depth++] = (tli_tree_node){0, tree->level_count, 0};
    while (depth) {
        tli_tree_node at = stack[--depth];
        double limit = best->distance * best->distance * (1 + TIE_SLACK);
        if (!(at.square <= limit)) continue;
        if (at.level) {
            depth = push_children(children(tree, at), at, local, limit, stack, depth);
            continue;
        }
        size_t begin = (size_t)at.node * TLI_TREE_WIDTH, end = begin + TLI_TREE_WIDTH;
        if (end > tree->item_count) end = tree->item_count;
        for (size_t i = begin; i < end; i++) offer_tet(loc, x, tree->order[i], best);
    }
}

tl_lidx tl_locator_nearest(const tl_locator *locator, const double x[3], tl_lidx hint,
                           double weights[4], double *distance)
{
    double found[4];
    tl_lidx tet = tl_locator_find(locator, x, hint, weights ? weights : found);
    if (tet != TL_NONE) {
        if (distance) *distance = 0;
        return tet;
    }
    nearest best = {.tet = TL_NONE, .distance = INFINITY};
    if (vec_is_finite(x)) {
        if (hint < locator->mesh->tet_count) offer_tet(locator, x, hint, &best);
        search_nearest(locator, x, &best);
    }
    for (int i = 0; weights && i < 4; i++) weights[i] = best.weights[i];
    if (distance) *distance = best.distance;
    return best.tet;
}

/* ---- life ---- */

tl_status tl_locator_create(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                            tl_locator **locator)
{
    *locator = NULL;
    tl_status st = TL_OK;
    tl_locator *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    made->ctx = ctx;
    made->mesh = mesh;
    st = tli_tree_open(ctx, mesh, &made->tree);
    if (!st && !opposite) st = tl_mesh_adjacency(ctx, mesh, &made->own_opposite, NULL);
    made->opposite = opposite ? opposite : made->own_opposite;
    if (st) {
        tl_locator_destroy(made);
        return st;
    }
    *locator = made;
    return TL_OK;
}

void tl_locator_destroy(tl_locator *locator)
{
    if (!locator) return;
    tl_mem_free(locator->ctx, locator->own_opposite);
    tli_tree_close(locator->ctx, &locator->tree);
    tl_mem_free(locator->ctx, locator);
}
