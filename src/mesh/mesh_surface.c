/* Manifold test of a closed surface: edges are sorted, so that those of one pair of vertices stand
 * together; where two triangles meet in an edge, their corners at its ends are joined. Each vertex
 * then has as many fans as sets of joined corners. */
#include "mesh/mesh_surface.h"

#include "base/base_sort.h"
#include "mesh/mesh_edge.h"

/* State of a vertex: fans seen, up to two, and whether one of its edges is counted. */
#define FANS 3
#define ON_BAD_EDGE 4

typedef struct surface {
    const tl_lidx *triangles;
    size_t corner_count;
    uint64_t *edges;     /* [corner_count] both vertices, the smaller above; sorted */
    uint32_t *corners;   /* [corner_count] where the edge begins */
    uint32_t *parents;   /* [corner_count] */
    uint8_t *vert_state; /* [vert_count] */
} surface;

static size_t next_corner(size_t corner)
{
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}

static uint32_t root_of(uint32_t *parents, uint32_t corner)
{
    while (parents[corner] != corner) {
        parents[corner] = parents[parents[corner]];
        corner = parents[corner];
    }
    return corner;
}

static void join(uint32_t *parents, size_t a, size_t b)
{
    uint32_t root_a = root_of(parents, (uint32_t)a), root_b = root_of(parents, (uint32_t)b);
    if (root_a < root_b)
        parents[root_b] = root_a;
    else
        parents[root_a] = root_b;
}

/* Two triangles that share an edge: corners at the same end belong together. */
static void join_across(surface *s, size_t a, size_t b)
{
    size_t a_end = next_corner(a), b_end = next_corner(b);
    bool same_way = s->triangles[a] == s->triangles[b];
    join(s->parents, a, same_way ? b : b_end);
    join(s->parents, a_end, same_way ? b_end : b);
}

static tl_status list_edges(tl_ctx *ctx, surface *s)
{
    for (size_t i = 0; i < s->corner_count; i++) {
        tl_lidx a = s->triangles[i], b = s->triangles[next_corner(i)];
        s->edges[i] = tli_edge_key(a, b);
        s->corners[i] = s->parents[i] = (uint32_t)i;
    }
    return tli_sort_u64(ctx, s->edges, s->corners, s->corner_count);
}

static size_t count_edges(surface *s)
{
    size_t count = 0;
    for (size_t begin = 0, end; begin < s->corner_count; begin = end) {
        for (end = begin + 1; end < s->corner_count && s->edges[end] == s->edges[begin];) end++;
        if (end - begin == 2) {
            join_across(s, s->corners[begin], s->corners[begin + 1]);
            continue;
        }
        count++;
        s->vert_state[s->edges[begin] >> 32] |= ON_BAD_EDGE;
        s->vert_state[s->edges[begin] & UINT32_MAX] |= ON_BAD_EDGE;
    }
    return count;
}

static size_t count_verts(surface *s)
{
    size_t count = 0;
    for (size_t i = 0; i < s->corner_count; i++) {
        uint8_t *state = &s->vert_state[s->triangles[i]];
        if (s->parents[i] != i || (*state & ON_BAD_EDGE) || (*state & FANS) == 2) continue;
        *state = (uint8_t)(*state + 1);
        count += (*state & FANS) == 2;
    }
    return count;
}

tl_status tli_surface_nonmanifold(tl_ctx *ctx, const tl_lidx *triangles, size_t triangle_count,
                                  size_t vert_count, size_t *edge_count, size_t *nonmanifold_verts)
{
    if (triangle_count > UINT32_MAX / 3)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "a surface of %zu triangles: at most %u can be tested", triangle_count,
                       UINT32_MAX / 3);
    surface s = {.triangles = triangles, .corner_count = 3 * triangle_count};
    tl_status st = TL_OK;
    s.edges = tl_mem_alloc(ctx, s.corner_count, sizeof *s.edges, &st);
    s.corners = tl_mem_alloc(ctx, s.corner_count, sizeof *s.corners, &st);
    s.parents = tl_mem_alloc(ctx, s.corner_count, sizeof *s.parents, &st);
    s.vert_state = tl_mem_zalloc(ctx, vert_count, sizeof *s.vert_state, &st);
    if (!st) st = list_edges(ctx, &s);
    if (!st) {
        *edge_count = count_edges(&s);
        *nonmanifold_verts = count_verts(&s);
    }
    tl_mem_free(ctx, s.vert_state);
    tl_mem_free(ctx, s.parents);
    tl_mem_free(ctx, s.corners);
    tl_mem_free(ctx, s.edges);
    return st;
}
