/* Collects the tets around an edge and decides whether its collapse keeps the topology: the link
 * condition of Dey, Edelsbrunner, Guha & Nekhayev 1999 with a dummy vertex behind the boundary
 * (Sondershaus 2007, 3.1.3), and the same condition in the complex of surface faces, whose sheets
 * are boundary and interfaces and whose curves are where sheets meet. */
#include "simplify/simplify_hood.h"
#include "simplify/simplify_carry.h"

/* Flags of local vertices. */
enum {
    AT_U = 1,      /* a neighbour of u */
    ON_RING = 2,   /* of both, in a tet with both */
    SURFACE_U = 4, /* the edge to u lies on a surface */
    SURFACE_V = 8,
    SURFACE_UV = 16, /* the face with u and v lies on a surface */
    IN_FAN = 32
};

tl_status tli_hood_create(tl_ctx *ctx, const tli_work *work, tli_hood **hood)
{
    tl_status st = TL_OK;
    tli_hood *h = tl_mem_zalloc(ctx, 1, sizeof *h, &st);
    if (!st) h->values = tl_mem_alloc(ctx, work->components, sizeof *h->values, &st);
    if (!st) h->sum = tl_mem_alloc(ctx, work->quadric_floats, sizeof *h->sum, &st);
    if (!st && work->carry) st = tli_carried_create(ctx, &h->carried);
    if (st) tli_hood_destroy(ctx, h);
    *hood = st ? NULL : h;
    return st;
}

void tli_hood_destroy(tl_ctx *ctx, tli_hood *hood)
{
    if (!hood) return;
    tli_carried_destroy(ctx, hood->carried);
    tl_mem_free(ctx, hood->sum);
    tl_mem_free(ctx, hood->values);
    tl_mem_free(ctx, hood);
}

/* Local number of a vertex, given out on first sight. */
static inline uint16_t local(tli_work *w, tli_hood *h, tl_lidx v)
{
    uint16_t m = w->marks[v];
    if (m) return (uint16_t)(m - 1);
    h->verts[h->vert_count] = v;
    h->flags[h->vert_count] = 0;
    w->marks[v] = (uint16_t)(h->vert_count + 1);
    return h->vert_count++;
}

/* The star of u: tets with v to gone, the others to sides[0]. */
static tli_verdict gather_u(tli_work *w, tli_hood *h, tl_lidx u, tl_lidx v)
{
    const tli_star *s = &w->verts[u].star;
    for (uint32_t i = 0; i < s->count; i++) {
        tl_lidx t = s->tets[i];
        const tl_lidx *q = w->tets[t];
        const uint8_t *f = tli_tet_faces[tli_corner_of(q, u)];
        uint16_t l[3] = {local(w, h, q[f[0]]), local(w, h, q[f[1]]), local(w, h, q[f[2]])};
        h->flags[l[0]] |= AT_U;
        h->flags[l[1]] |= AT_U;
        h->flags[l[2]] |= AT_U;
        if (q[f[0]] != v && q[f[1]] != v && q[f[2]] != v) {
            tli_hood_tet *to = &h->sides[0][h->side_counts[0]++];
            to->tet = t;
            for (int j = 0; j < 3; j++) to->verts[j] = l[j];
            continue;
        }
        if (h->gone_count == TLI_RING_MAX) return TLI_NO_ROOM;
        unsigned n = 0;
        for (int j = 0; j < 3; j++)
            if (l[j] != 1) h->gone_ring[h->gone_count][n++] = l[j];
        h->flags[h->gone_ring[h->gone_count][0]] |= ON_RING;
        h->flags[h->gone_ring[h->gone_count][1]] |= ON_RING;
        h->gone[h->gone_count++] = t;
    }
    return h->gone_count ? TLI_DONE : TLI_NO_TOPOLOGY;
}

/* The star of v without the tets of u; no vertex may be shared that is not on the ring. */
static tli_verdict gather_v(tli_work *w, tli_hood *h, tl_lidx u, tl_lidx v)
{
    const tli_star *s = &w->verts[v].star;
    for (uint32_t i = 0; i < s->count; i++) {
        tl_lidx t = s->tets[i];
        const tl_lidx *q = w->tets[t];
        if (q[0] == u || q[1] == u || q[2] == u || q[3] == u) continue;
        const uint8_t *f = tli_tet_faces[tli_corner_of(q, v)];
        tli_hood_tet *to = &h->sides[1][h->side_counts[1]++];
        to->tet = t;
        for (int j = 0; j < 3; j++) {
            uint16_t l = local(w, h, q[f[j]]);
            if ((h->flags[l] & (AT_U | ON_RING)) == AT_U) return TLI_NO_TOPOLOGY;
            to->verts[j] = l;
        }
    }
    return TLI_DONE;
}

static bool same_triple(const uint16_t a[3], const uint16_t b[3])
{
    unsigned equal = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) equal += a[i] == b[j];
    return equal == 3;
}

/* Edges of both links have to be edges of the ring: a tet with u and v holds them. */
static bool ring_edges_fine(tli_hood *h)
{
    uint64_t at_u[TLI_RING_MAX], ring[TLI_RING_MAX];
    uint16_t slot[TLI_HOOD_VERTS];
    unsigned ring_count = 0;
    for (uint16_t l = 2; l < h->vert_count; l++) {
        if (!(h->flags[l] & ON_RING)) continue;
        if (ring_count == TLI_RING_MAX) return false;
        at_u[ring_count] = ring[ring_count] = 0;
        slot[l] = (uint16_t)ring_count++;
    }
    for (uint32_t i = 0; i < h->gone_count; i++) {
        unsigned a = slot[h->gone_ring[i][0]], b = slot[h->gone_ring[i][1]];
        ring[a] |= (uint64_t)1 << b;
        ring[b] |= (uint64_t)1 << a;
    }
    for (int side = 0; side < 2; side++)
        for (uint32_t i = 0; i < h->side_counts[side]; i++) {
            const uint16_t *l = h->sides[side][i].verts;
            unsigned on =
                (h->flags[l[0]] >> 1 & 1) + (h->flags[l[1]] >> 1 & 1) + (h->flags[l[2]] >> 1 & 1);
            if (on < 2) continue;
            for (int j = 0; j < 3; j++) {
                uint16_t a = l[j], b = l[(j + 1) % 3];
                if (!(h->flags[a] & h->flags[b] & ON_RING)) continue;
                uint64_t bit = (uint64_t)1 << slot[b];
                if (side == 0) {
                    at_u[slot[a]] |= bit;
                    at_u[slot[b]] |= (uint64_t)1 << slot[a];
                } else if (at_u[slot[a]] & bit && !(ring[slot[a]] & bit))
                    return false;
            }
            if (side == 0 || on < 3 || ring_count != 3) continue;
            for (uint32_t k = 0; k < h->side_counts[0]; k++)
                if (same_triple(h->sides[0][k].verts, l)) return false;
        }
    return true;
}

/* Calls for each surface face of a tet that holds the end: flags of its two other vertices. */
static void flag_surface(const tli_work *w, tli_hood *h, tl_lidx tet, tl_lidx end, uint8_t flag)
{
    const tl_lidx *q = w->tets[tet];
    for (unsigned f = 0; f < 4; f++) {
        if (!(w->faces[tet] & 1u << f) || q[f] == end) continue;
        for (unsigned j = 0; j < 4; j++)
            if (j != f && q[j] != end) h->flags[w->marks[q[j]] - 1] |= flag;
    }
}

/* Both ends on surfaces: the edge has to lie on one, and whatever both reach along surfaces has to
 * be a surface face with both. A tet between two surfaces must not vanish. */
static bool surface_link_fine(const tli_work *w, tli_hood *h)
{
    for (int side = 0; side < 2; side++)
        for (uint32_t i = 0; i < h->side_counts[side]; i++)
            if (w->faces[h->sides[side][i].tet])
                flag_surface(w, h, h->sides[side][i].tet, h->ends[side],
                             side ? SURFACE_V : SURFACE_U);
    bool on_surface = false;
    for (uint32_t i = 0; i < h->gone_count; i++) {
        tl_lidx t = h->gone[i];
        const tl_lidx *q = w->tets[t];
        if (!w->faces[t]) continue;
        flag_surface(w, h, t, h->ends[0], SURFACE_U);
        flag_surface(w, h, t, h->ends[1], SURFACE_V);
        unsigned cu = tli_corner_of(q, h->ends[0]), cv = tli_corner_of(q, h->ends[1]);
        if (w->faces[t] >> cu & w->faces[t] >> cv & 1) return false;
        for (unsigned f = 0; f < 4; f++) {
            if (f == cu || f == cv || !(w->faces[t] & 1u << f)) continue;
            h->flags[w->marks[q[6 - f - cu - cv]] - 1] |= SURFACE_UV;
            on_surface = true;
        }
    }
    for (uint16_t l = 2; l < h->vert_count; l++)
        if ((h->flags[l] & (SURFACE_U | SURFACE_V | SURFACE_UV)) == (SURFACE_U | SURFACE_V))
            return false;
    return on_surface;
}

/* One end on a surface, one free: only a tet with a surface face at both sides could do harm. */
static bool gone_between_surfaces(const tli_work *w, const tli_hood *h)
{
    for (uint32_t i = 0; i < h->gone_count; i++) {
        tl_lidx t = h->gone[i];
        if (!w->faces[t]) continue;
        unsigned cu = tli_corner_of(w->tets[t], h->ends[0]),
                 cv = tli_corner_of(w->tets[t], h->ends[1]);
        if (w->faces[t] >> cu & w->faces[t] >> cv & 1) return true;
    }
    return false;
}

static void add_fan_faces(const tli_work *w, tli_hood *h, tl_lidx t, tl_lidx end, bool *room)
{
    const tl_lidx *q = w->tets[t];
    for (unsigned f = 0; f < 4; f++) {
        if (!(w->faces[t] & 1u << f) || q[f] == end) continue;
        if (h->fan_count == TLI_FAN_MAX) {
            *room = false;
            return;
        }
        tli_fan_face *to = &h->fan[h->fan_count++];
        for (int j = 0; j < 3; j++) to->verts[j] = (uint16_t)(w->marks[q[tli_tet_faces[f][j]]] - 1);
        to->group = (w->regions ? (int64_t)w->regions[t] * 2 : 0) + (w->faces[t] >> (4 + f) & 1);
    }
}

/* An interface face shows from both of its tets, with opposite orientation: the one of the lower
 * region stays. */
static void drop_twins(tli_hood *h)
{
    for (uint32_t i = 0; i < h->fan_count; i++)
        for (uint32_t j = i + 1; j < h->fan_count; j++)
            if (same_triple(h->fan[i].verts, h->fan[j].verts)) {
                if (h->fan[j].group < h->fan[i].group) h->fan[i] = h->fan[j];
                h->fan[j--] = h->fan[--h->fan_count];
            }
}

bool tli_hood_list_fan(const tli_work *w, tli_hood *h)
{
    bool room = true;
    h->fan_count = 0;
    for (int side = 0; room && side < 2; side++)
        for (uint32_t i = 0; room && i < h->side_counts[side]; i++)
            if (w->faces[h->sides[side][i].tet])
                add_fan_faces(w, h, h->sides[side][i].tet, h->ends[side], &room);
    for (uint32_t i = 0; room && i < h->gone_count; i++) {
        tl_lidx t = h->gone[i];
        if (!w->faces[t]) continue;
        uint32_t first = h->fan_count;
        add_fan_faces(w, h, t, h->ends[0], &room);
        add_fan_faces(w, h, t, h->ends[1], &room);
        for (uint32_t a = first; a < h->fan_count; a++) /* faces with both ends came twice */
            for (uint32_t b = a + 1; b < h->fan_count; b++)
                if (same_triple(h->fan[a].verts, h->fan[b].verts))
                    h->fan[b--] = h->fan[--h->fan_count];
    }
    if (room && w->has_surfaces_inside) drop_twins(h);
    return room;
}

/* Curve vertices: the edge has to be a curve edge, and no other vertex may be reached along curves
 * from both. The fan must be listed. */
static bool curve_link_fine(const tli_hood *h)
{
    uint8_t degree[2][TLI_HOOD_VERTS];
    memset(degree[0], 0, h->vert_count);
    memset(degree[1], 0, h->vert_count);
    for (uint32_t i = 0; i < h->fan_count; i++)
        for (int e = 0; e < 2; e++) {
            const uint16_t *l = h->fan[i].verts;
            if (l[0] != e && l[1] != e && l[2] != e) continue;
            for (int j = 0; j < 3; j++) degree[e][l[j]] += l[j] != e;
        }
    if (degree[0][1] == 0 || degree[0][1] == 2) return false;
    for (uint16_t l = 2; l < h->vert_count; l++)
        if (degree[0][l] != 0 && degree[0][l] != 2 && degree[1][l] != 0 && degree[1][l] != 2)
            return false;
    return true;
}

tli_verdict tli_hood_begin(const tli_work *w, tli_hood *h, tl_lidx u, tl_lidx v)
{
    uint8_t cu = w->verts[u].kind, cv = w->verts[v].kind;
    h->ends[0] = u;
    h->ends[1] = v;
    h->vert_count = 0;
    h->side_counts[0] = h->side_counts[1] = h->gone_count = h->fan_count = 0;
    if (cu == TLI_FROZEN || cv == TLI_FROZEN || (cu == TLI_CORNER && cv == TLI_CORNER))
        return TLI_NO_TOPOLOGY;
    return w->verts[u].star.count + w->verts[v].star.count > TLI_STAR_MAX ? TLI_NO_ROOM : TLI_DONE;
}

/* Where an end is free and all new tets are positive, seen from the new place the rim of both stars
 * is hit once in every direction: it is a sphere (half of one on a surface), no edge or vertex of
 * it occurs twice, and no edge of the ring can be missing. So the ring is looked at only where that
 * is not known. */
tli_verdict tli_hood_gather(tli_work *w, tli_hood *h, bool shapes_fine)
{
    tl_lidx u = h->ends[0], v = h->ends[1];
    uint8_t cu = w->verts[u].kind, cv = w->verts[v].kind;
    local(w, h, u);
    local(w, h, v);
    tli_verdict verdict = gather_u(w, h, u, v);
    if (!verdict) verdict = gather_v(w, h, u, v);
    if (verdict) return verdict;
    if (!shapes_fine && !ring_edges_fine(h)) return TLI_NO_TOPOLOGY;
    if (cu == TLI_FREE || cv == TLI_FREE)
        return gone_between_surfaces(w, h) ? TLI_NO_TOPOLOGY : TLI_DONE;
    if (!surface_link_fine(w, h)) return TLI_NO_TOPOLOGY;
    if (!tli_hood_list_fan(w, h)) return TLI_NO_ROOM;
    if (cu >= TLI_CURVE && cv >= TLI_CURVE && !curve_link_fine(h)) return TLI_NO_TOPOLOGY;
    return TLI_DONE;
}
