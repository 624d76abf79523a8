/* One edge collapse: where the new vertex goes, whether the mesh allows it, and the change itself.
 * Sondershaus 2007, 3.1.3 and 3.1.4; collapses of surface edges keep the volume (Lindstrom & Turk
 * 1998) and stay within the bound on the distance of the surfaces. */
#include <math.h>

#include "base/base_predicates.h"
#include "simplify/simplify_carry.h"
#include "simplify/simplify_cost.h"
#include "simplify/simplify_hood.h"

/* Above this mean ratio, cubed, a tet is far from flat for any rounding: no exact sign is needed.
 */
static const double SAFE_SHAPE_CUBE = 1e-9;

static void edge_vectors(const tli_work *w, tl_lidx u, tl_lidx v, double e[3], double *h)
{
    const double *fu = w->values + u * w->components, *fv = w->values + v * w->components;
    for (int i = 0; i < 3; i++) e[i] = (w->verts[v].xyz[i] - w->verts[u].xyz[i]) * w->scale;
    for (size_t i = 0; i < w->components; i++) h[i] = fv[i] - fu[i];
}

/* Sum of both quadrics at the anchor u. */
static inline __attribute__((always_inline)) void edge_quadric(const tli_work *w, tl_lidx u,
                                                               tl_lidx v, const double e[3],
                                                               double *h, double *sum, size_t k)
{
    const float *qu = w->quadrics + u * w->quadric_floats,
                *qv = w->quadrics + v * w->quadric_floats;
    double back[3] = {-e[0], -e[1], -e[2]};
    size_t floats = TLI_QUADRIC_HEAD + 4 * k;
    for (size_t i = 0; i < floats; i++) sum[i] = qu[i];
    for (size_t i = 0; i < k; i++) h[i] = -h[i];
    tli_quadric_add_moved(sum, qv, back, h, k);
    for (size_t i = 0; i < k; i++) h[i] = -h[i];
}

/* Best free place near the edge. A second step with what the pull left over takes its error out of
 * directions that the quadric holds, such as across a sharp edge. */
static inline void best_place(const tli_form *form, const double e[3], double y[3])
{
    double pull = TLI_PULL * (form->m[0] + form->m[3] + form->m[5]) + 1e-300;
    double rhs[3], rest[3], d2 = 0, e2 = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    for (int i = 0; i < 3; i++) rhs[i] = 0.5 * pull * e[i] - form->r[i];
    bool solved = tli_form_solve(form->m, pull, rhs, y);
    for (int i = 0; solved && i < 3; i++) rhs[i] = pull * (y[i] - 0.5 * e[i]);
    solved = solved && tli_form_solve(form->m, pull, rhs, rest);
    for (int i = 0; solved && i < 3; i++) {
        y[i] += rest[i];
        d2 += (y[i] - 0.5 * e[i]) * (y[i] - 0.5 * e[i]);
    }
    if (!solved || !(d2 <= TLI_FAR_AWAY * e2))
        for (int i = 0; i < 3; i++) y[i] = 0.5 * e[i];
}

size_t tli_star_neighbours(tli_work *w, tl_lidx u, tl_lidx *out)
{
    const tli_star *s = &w->verts[u].star;
    size_t count = 0;
    if (s->count > TLI_STAR_MAX) return 0;
    w->marks[u] = 1;
    for (uint32_t i = 0; i < s->count; i++) {
        const tl_lidx *q = w->tets[s->tets[i]];
        for (int j = 0; j < 4; j++) {
            uint16_t *mark = &w->marks[q[j]];
            if (*mark) continue;
            *mark = 1;
            out[count++] = q[j];
        }
    }
    w->marks[u] = 0;
    for (size_t i = 0; i < count; i++) w->marks[out[i]] = 0;
    return count;
}

/* Which end stays where it is, if one does: it becomes u. Subset and curves: the cheaper one. */
static void order_ends(const tli_work *w, tl_lidx *u, tl_lidx *v)
{
    uint8_t cu = w->verts[*u].kind, cv = w->verts[*v].kind;
    bool swap = cv > cu;
    if (cu == cv && (w->placement == TL_PLACE_SUBSET || cu == TLI_CURVE)) {
        double e[3], h[TLI_COMPONENTS_MAX], sum[TLI_QUADRIC_HEAD + 4 * TLI_COMPONENTS_MAX];
        static const double ZERO[3] = {0, 0, 0};
        tli_form form;
        edge_vectors(w, *u, *v, e, h);
        edge_quadric(w, *u, *v, e, h, sum, w->components);
        tli_quadric_reduce(sum, w->components, &form);
        swap = tli_form_at(&form, e) < tli_form_at(&form, ZERO);
    }
    if (swap) {
        tl_lidx t = *u;
        *u = *v;
        *v = t;
    }
}

/* Moves the best place onto the plane that keeps the volume; false when there is none. */
static bool keep_volume(const tli_work *w, const tli_hood *hood, const tli_form *form,
                        const double e[3], double y[3])
{
    double n[3], offset, z[3], d2 = 0, e2 = 0;
    double pull = TLI_PULL * (form->m[0] + form->m[3] + form->m[5]) + 1e-300;
    if (!tli_fan_volume_plane(w, hood, n, &offset)) return false;
    double along = n[0] * y[0] + n[1] * y[1] + n[2] * y[2];
    if (!tli_form_solve(form->m, pull, n, z)) return false;
    double nz = n[0] * z[0] + n[1] * z[1] + n[2] * z[2];
    if (!(nz > 0)) return false;
    double step = (offset * w->scale - along) / nz;
    for (int i = 0; i < 3; i++) {
        y[i] += step * z[i];
        d2 += (y[i] - 0.5 * e[i]) * (y[i] - 0.5 * e[i]);
        e2 += e[i] * e[i];
    }
    return d2 <= TLI_FAR_AWAY * e2;
}

/* Rounds the hood's place to the coarser step of both ends; y follows. */
static void round_place(const tli_work *w, tli_hood *hood, double y[3])
{
    const tli_vertex *u = &w->verts[hood->ends[0]], *v = &w->verts[hood->ends[1]];
    hood->step = u->step > v->step ? u->step : v->step;
    if (hood->step == TLI_STEP_ANY) return;
    for (int i = 0; i < 3; i++) {
        double x = hood->place[i];
        if (hood->step == TLI_STEP_FLOAT32) {
            /* volatile: gcc 12 takes two coordinates at once and then leaves the rounding out */
            volatile float narrow = (float)x;
            hood->place[i] = (double)narrow;
        } else
            hood->place[i] = ldexp(rint(ldexp(x, -hood->step)), hood->step);
        y[i] = (hood->place[i] - u->xyz[i]) * w->scale;
    }
}

/* Places the new vertex and sets the hood's place, values and summed quadric (at anchor u). */
static bool place_vertex(const tli_work *w, tli_hood *hood)
{
    tl_lidx u = hood->ends[0], v = hood->ends[1];
    uint8_t cu = w->verts[u].kind, cv = w->verts[v].kind;
    double e[3], h[TLI_COMPONENTS_MAX], y[3] = {0, 0, 0};
    size_t k = w->components;
    tli_form form;
    edge_vectors(w, u, v, e, h);
    edge_quadric(w, u, v, e, h, hood->sum, k);
    memcpy(hood->place, w->verts[u].xyz, sizeof hood->place);
    hood->step = w->verts[u].step;
    memcpy(hood->values, w->values + u * k, k * sizeof *hood->values);
    if (w->placement == TL_PLACE_SUBSET || cu == TLI_CORNER) return true;
    if (cu == cv && cu != TLI_CURVE) {
        tli_quadric_reduce(hood->sum, k, &form);
        best_place(&form, e, y);
        if (cu == TLI_SURFACE && !keep_volume(w, hood, &form, e, y)) return false;
        for (int i = 0; i < 3; i++) hood->place[i] += y[i] / w->scale;
        round_place(w, hood, y);
    }
    tli_quadric_values(hood->sum, k, y, h);
    for (size_t i = 0; i < k; i++) hood->values[i] += h[i];
    return true;
}

/* The mean ratio, cubed, of the tet place + three neighbours is 432 det |det| / edges^3. */
static inline double tet_measures(const tli_hood *h, const uint16_t l[3], double *edges)
{
    const double *a = h->rel[l[0]], *b = h->rel[l[1]], *c = h->rel[l[2]];
    double ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    double bc = b[0] * c[0] + b[1] * c[1] + b[2] * c[2];
    double ca = c[0] * a[0] + c[1] * a[1] + c[2] * a[2];
    *edges = 3 * (h->rel2[l[0]] + h->rel2[l[1]] + h->rel2[l[2]]) - 2 * (ab + bc + ca);
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* Is one of the tets that the collapse changes or takes away no better shaped than that already? */
static bool was_as_bad(const tli_work *w, tli_hood *h, double cube)
{
    for (int side = 0; side < 3; side++)
        for (uint32_t i = 0; i < (side < 2 ? h->side_counts[side] : h->gone_count); i++) {
            const tl_lidx *q = w->tets[side < 2 ? h->sides[side][i].tet : h->gone[i]];
            double p[3][3], edges = 0, d[6];
            for (int j = 0; j < 3; j++)
                for (int k = 0; k < 3; k++)
                    p[j][k] = w->verts[q[j + 1]].xyz[k] - w->verts[q[0]].xyz[k];
            for (int j = 0; j < 3; j++) {
                d[j] = d[j + 3] = 0;
                for (int k = 0; k < 3; k++) {
                    double e = p[(j + 1) % 3][k] - p[j][k];
                    d[j] += p[j][k] * p[j][k];
                    d[j + 3] += e * e;
                }
            }
            for (int j = 0; j < 6; j++) edges += d[j];
            double det = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                         p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                         p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
            if (432 * det * fabs(det) <= cube * edges * edges * edges) return true;
        }
    return false;
}

/* Some new tet is badly shaped: fine only if one was before, and if all are exactly positive. */
static bool bad_shapes_fine(const tli_work *w, tli_hood *h)
{
    double worst = 1;
    for (int side = 0; side < 2; side++)
        for (uint32_t i = 0; i < h->side_counts[side]; i++) {
            const uint16_t *l = h->sides[side][i].verts;
            double edges, det = tet_measures(h, l, &edges);
            double cube = 432 * det * det / (edges * edges * edges);
            if (cube < worst) worst = cube;
            if (cube < SAFE_SHAPE_CUBE &&
                tli_orient3d(h->place, w->verts[h->verts[l[0]]].xyz, w->verts[h->verts[l[1]]].xyz,
                             w->verts[h->verts[l[2]]].xyz) <= 0)
                return false;
        }
    return worst >= w->shape_cube || was_as_bad(w, h, worst);
}

/* Every changed tet stays positive and well-shaped enough. */
static bool shapes_fine(const tli_work *w, tli_hood *h)
{
    bool bad = false;
    double least = w->shape_cube > SAFE_SHAPE_CUBE ? w->shape_cube : SAFE_SHAPE_CUBE;
    for (uint16_t l = 2; l < h->vert_count; l++) {
        const double *x = w->verts[h->verts[l]].xyz;
        double *d = h->rel[l];
        for (int i = 0; i < 3; i++) d[i] = x[i] - h->place[i];
        h->rel2[l] = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    }
    for (int side = 0; side < 2; side++)
        for (uint32_t i = 0; i < h->side_counts[side]; i++) {
            double edges, det = tet_measures(h, h->sides[side][i].verts, &edges);
            if (!(det > 0)) return false;
            bad |= 432 * det * det < least * edges * edges * edges;
        }
    return !bad || bad_shapes_fine(w, h);
}

/* Ends that stay where they are, such as those on the border of a piece, leave no place that keeps
 * the volume: what they change adds up and may go back. Two free ends change what rounding does.
 * Sets the hood's change. */
static bool volume_fine(const tli_work *w, tli_hood *h)
{
    h->volume_change = 0;
    if (isinf(w->volume_room)) return true;
    h->volume_change = tli_fan_volume_change(w, h, h->place);
    double after = fabs(w->volume_change + h->volume_change);
    return w->verts[h->ends[0]].kind == TLI_SURFACE || after <= w->volume_room ||
           after <= fabs(w->volume_change);
}

/* A surface face of three vertices that stay could be one of the next piece, too: both halves of a
 * cavity on the border would close to it. Pieces make none. */
static bool border_fine(const tli_work *w, const tli_hood *h)
{
    if (isinf(w->volume_room) || w->verts[h->ends[0]].kind < TLI_CORNER) return true;
    for (uint32_t i = 0; i < h->fan_count; i++) {
        bool has_u = false;
        unsigned stay = 0;
        for (int j = 0; j < 3; j++) {
            uint16_t l = h->fan[i].verts[j];
            has_u = has_u || l == 0;
            stay += w->verts[h->verts[l]].kind >= TLI_CORNER;
        }
        if (!has_u && stay == 2) return false;
    }
    return true;
}

/* The surface stays within its bound; sets the hood's bound. */
static bool surface_fine(const tli_work *w, tli_hood *h)
{
    float bound = w->verts[h->ends[0]].surface_bound;
    if (w->verts[h->ends[1]].kind != TLI_FREE) {
        for (uint32_t i = 0; i < h->fan_count; i++)
            for (int j = 0; j < 3; j++) {
                float other = w->verts[h->verts[h->fan[i].verts[j]]].surface_bound;
                bound = other > bound ? other : bound;
            }
        double d = tli_fan_distance(w, h, h->place, w->boundary_error - (double)bound);
        bound = nextafterf((float)(bound + d), d > 0 ? INFINITY : bound);
        if (bound > w->boundary_error) return false;
    }
    h->surface_bound = bound;
    return true;
}

/* The star of u becomes what is left of both. */
static tl_status join_stars(tli_work *w, tli_hood *h, tli_star_bank *bank)
{
    tli_star *su = &w->verts[h->ends[0]].star;
    uint32_t count = h->side_counts[0] + h->side_counts[1];
    su->count = 0; /* all are listed in the hood */
    tl_status st = tli_star_reserve(bank, su, count);
    if (st) return st;
    tli_star_release(bank, &w->verts[h->ends[1]].star);
    uint32_t n = 0;
    for (int side = 0; side < 2; side++)
        for (uint32_t i = 0; i < h->side_counts[side]; i++) su->tets[n++] = h->sides[side][i].tet;
    su->count = n;
    return TL_OK;
}

/* Copies the surface bits of a vanishing tet's face to the tet behind its other face. */
static void pass_face(tli_work *w, tli_hood *h, uint32_t gone, unsigned side)
{
    tl_lidx t = h->gone[gone];
    const tl_lidx *q = w->tets[t];
    tl_lidx a = h->verts[h->gone_ring[gone][0]], b = h->verts[h->gone_ring[gone][1]];
    unsigned f = 0;
    while (q[f] != h->ends[side]) f++; /* the face without the end, with the other end */
    unsigned bits = (w->faces[t] >> f & 1u) | (w->faces[t] >> f & 16u);
    if (!bits) return;
    for (uint32_t i = 0; i < h->side_counts[side]; i++) {
        const uint16_t *l = h->sides[side][i].verts;
        tl_lidx s = h->sides[side][i].tet;
        unsigned hits = 0, other = 0;
        for (unsigned j = 0; j < 3; j++)
            if (h->verts[l[j]] == a || h->verts[l[j]] == b)
                hits++;
            else
                other = j;
        if (hits < 2) continue;
        for (unsigned j = 0; j < 4; j++)
            if (w->tets[s][j] == h->verts[l[other]]) w->faces[s] |= (uint8_t)(bits << j);
        return;
    }
}

static void leave_star(tli_work *w, tl_lidx v, tl_lidx tet)
{
    tli_star *s = &w->verts[v].star;
    for (uint32_t i = 0; i < s->count; i++)
        if (s->tets[i] == tet) {
            s->tets[i] = s->tets[--s->count];
            return;
        }
}

/* The change itself; nothing fails after the stars are joined. */
static tl_status commit(tli_work *w, tli_hood *h, tli_star_bank *bank)
{
    tl_lidx u = h->ends[0], v = h->ends[1];
    size_t k = w->components;
    tl_status st = join_stars(w, h, bank);
    if (st) return st;
    for (uint32_t i = 0; i < h->gone_count; i++) {
        if (w->faces[h->gone[i]]) {
            pass_face(w, h, i, 0);
            pass_face(w, h, i, 1);
        }
        leave_star(w, h->verts[h->gone_ring[i][0]], h->gone[i]);
        leave_star(w, h->verts[h->gone_ring[i][1]], h->gone[i]);
        w->tets[h->gone[i]][0] = TL_NONE;
    }
    for (uint32_t i = 0; i < h->side_counts[1]; i++) {
        tl_lidx *q = w->tets[h->sides[1][i].tet];
        for (int j = 0; j < 4; j++)
            if (q[j] == v) q[j] = u;
    }
    double e[3], shift[TLI_COMPONENTS_MAX], sum[TLI_QUADRIC_HEAD + 4 * TLI_COMPONENTS_MAX];
    float *q = w->quadrics + u * w->quadric_floats;
    for (size_t i = 0; i < tli_quadric_floats(k); i++) {
        q[i] = (float)h->sum[i];
        sum[i] = 0;
    }
    for (int i = 0; i < 3; i++) e[i] = (h->place[i] - w->verts[u].xyz[i]) * w->scale;
    for (size_t i = 0; i < k; i++) shift[i] = h->values[i] - w->values[u * k + i];
    tli_quadric_add_moved(sum, q, e, shift, k);
    for (size_t i = 0; i < tli_quadric_floats(k); i++) q[i] = (float)sum[i];
    if (q[9] < 0) q[9] = 0;
    tli_work_round_values(w, u, h->values);
    memcpy(w->verts[u].xyz, h->place, sizeof h->place);
    w->verts[u].step = h->step;
    memcpy(w->values + u * k, h->values, k * sizeof *h->values);
    w->verts[u].surface_bound = h->surface_bound;
    if (w->verts[v].kind != TLI_FREE) w->volume_change += h->volume_change;
    if (w->carry) tli_carry_commit(w, h);
    w->verts[v].merged = u;
    w->verts[u].version++;
    w->verts[v].version++;
    return TL_OK;
}

/* A look at the shapes of the tets of one end that do not hold the other, a few at a time: most
 * collapses that fail end at one of the first. */
static tli_shapes look_at_end(const tli_work *w, tli_hood *h, unsigned end, double scale)
{
    tl_lidx at = h->ends[end], other = h->ends[1 - end];
    const tli_star *star = &w->verts[at].star;
    tli_shapes worst = TLI_SHAPES_FINE;
    for (uint32_t i = 0; i < star->count;) {
        size_t count = 0;
        for (; i < star->count && count < TLI_LOOK; i++) {
            const tl_lidx *q = w->tets[star->tets[i]];
            if (q[0] == other || q[1] == other || q[2] == other || q[3] == other) continue;
            const uint8_t *f = tli_tet_faces[tli_corner_of(q, at)];
            for (int j = 0; j < 3; j++) {
                const double *x = w->verts[q[f[j]]].xyz;
                h->corners[3 * j][count] = (float)((x[0] - h->place[0]) * scale);
                h->corners[3 * j + 1][count] = (float)((x[1] - h->place[1]) * scale);
                h->corners[3 * j + 2][count] = (float)((x[2] - h->place[2]) * scale);
            }
            count++;
        }
        tli_shapes some =
            w->shapes((const float(*)[TLI_LOOK])h->corners, count, (float)w->shape_cube);
        if (some > worst) worst = some;
        if (worst == TLI_SHAPES_TURNED) break;
    }
    return worst;
}

/* A cheap look at the shapes before anything else is gathered. */
static tli_shapes look_at_shapes(const tli_work *w, tli_hood *h)
{
    const double *a = w->verts[h->ends[0]].xyz, *b = w->verts[h->ends[1]].xyz;
    double square = 0;
    for (int i = 0; i < 3; i++) square += (a[i] - b[i]) * (a[i] - b[i]);
    if (!(square > 0)) return TLI_SHAPES_UNSURE;
    double scale = 1 / sqrt(square);
    tli_shapes u = look_at_end(w, h, 0, scale);
    if (u == TLI_SHAPES_TURNED) return u;
    tli_shapes v = look_at_end(w, h, 1, scale);
    return v > u ? v : u;
}

/* Everything short of the change. */
static tli_verdict try_edge(tli_work *w, tli_hood *hood, tl_lidx u, tl_lidx v)
{
    tli_shapes shapes = TLI_SHAPES_UNSURE;
    bool on_surface = w->verts[v].kind != TLI_FREE;
    tli_verdict verdict = tli_hood_begin(w, hood, u, v);
    if (verdict) return verdict;
    if (!on_surface) {
        place_vertex(w, hood);
        shapes = look_at_shapes(w, hood);
        if (shapes == TLI_SHAPES_TURNED) return TLI_NO_SHAPE;
    }
    verdict = tli_hood_gather(w, hood, shapes == TLI_SHAPES_FINE);
    if (verdict) return verdict;
    if (on_surface && !place_vertex(w, hood)) return TLI_NO_BOUNDARY;
    if ((shapes != TLI_SHAPES_FINE || w->carry) && !shapes_fine(w, hood)) return TLI_NO_SHAPE;
    if (on_surface && !(border_fine(w, hood) && volume_fine(w, hood))) return TLI_NO_BOUNDARY;
    return surface_fine(w, hood) ? TLI_DONE : TLI_NO_BOUNDARY;
}

tl_status tli_collapse_edge(tli_work *w, tli_hood *hood, tli_star_bank *bank, tl_lidx u, tl_lidx v,
                            tli_verdict *verdict, tl_lidx *kept, uint32_t *tets_gone)
{
    tl_status st = TL_OK;
    order_ends(w, &u, &v);
    *verdict = try_edge(w, hood, u, v);
    if (!*verdict && w->carry) {
        bool fine;
        st = tli_carry_test(w, hood, &fine);
        if (!fine) *verdict = TLI_NO_ERROR;
    }
    for (uint16_t l = 0; l < hood->vert_count; l++) w->marks[hood->verts[l]] = 0;
    if (!st && !*verdict) st = commit(w, hood, bank);
    *kept = u;
    *tets_gone = hood->gone_count;
    return st;
}
