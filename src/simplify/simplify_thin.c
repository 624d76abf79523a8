/* Thinning: before edges are collapsed in order of cost, inner vertices whose loss costs little
 * beside what the last collapses will cost move into a neighbour (half-edge collapses, Kobbelt,
 * Campagna & Seidel 1998). Only the tets around the vertex that goes change, no place is solved
 * for, and no queue is kept: runs over the vertices with a rising limit, in ranges of their Hilbert
 * order that workers thin side by side. Stars keep tets that are gone until their vertex is looked
 * at. */
#include <math.h>

#include "simplify/simplify_order.h"
#include "simplify/simplify_thin.h"

/* Neighbours that a vertex tries to move into, cheapest first. */
enum { TRIES = 4 };
/* Tets around a vertex past which no other one moves into it. */
enum { STAR_MAX = 120 };
/* Vertices whose costs tell what the last collapses will cost, and steps to find it. */
enum { SAMPLES = 4096, BISECTIONS = 40 };
/* How the number of vertices falls with the cost: field errors grow with the square of the edge
 * length, costs with their square and with the number of vertices summed up. */
static const double FALL = 3.0 / 7;
/* Vertices of a range, whose outermost ones stay until the ranges of the next run. A small mesh has
 * some ranges, too, so that threads have work, but of no fewer vertices than the least. */
enum { RANGE_MOST = 32768, RANGE_LEAST = 8192, RANGES = 4 };
/* The limits of the runs as parts of that cost. */
static const double PARTS[] = {0.15, 0.5, 1.0};
/* At least so many times the target stay, for collapses that know better. */
static const double STAY = 1.5;
/* New tets have this mean ratio, cubed, or that of the worst one before; in no case less than
 * float32 can tell from a flat one, with a margin for its rounding. */
static const float QUALITY = 1e-3f, LEAST_QUALITY = 1e-6f, MARGIN = 1.05f;

typedef struct thin_job {
    tli_work *work;
    const tli_thin_kernel *kernel;
    const uint8_t *inner; /* [vert_count] */
    tli_ball *balls;      /* one a worker */
    float *known; /* [vert_count] cost of the best move when it was last looked at; 0: unknown */
    float cost_max;
    float least;         /* mean ratio, cubed, below which no tet falls */
    size_t range, shift; /* range r holds the vertices r * range - shift and on */
    double keep;         /* part of a range's vertices that have to stay */
    struct {
        size_t tets, verts;
    } * gone;      /* by range */
    tli_log *logs; /* by range, NULL without a listener */
} thin_job;

/* Lists what lies around u and drops dead tets from its star; the neighbours are marked with their
 * numbers, counted from 1. False when one is out of the worker's reach, or the tets are not known
 * to be a ball. */
static bool gather(tli_work *w, tl_lidx u, tli_ball *b)
{
    tli_star *s = &w->verts[u].star;
    const tl_lidx(*tets)[4] = (const tl_lidx(*)[4])w->tets, first = b->first, span = b->span;
    uint16_t *marks = w->marks;
    uint32_t n = 0, t = 0, i = 0, count = s->count, *star = s->tets;
    bool fine = true;
    for (; fine && i < count; i++) {
        const tl_lidx *q = tets[star[i]];
        if (q[0] == TL_NONE) continue;
        if (t == TLI_BALL_TETS) break;
        const uint8_t *f = tli_tet_faces[tli_corner_of(q, u)];
        tl_lidx v[3] = {q[f[0]], q[f[1]], q[f[2]]};
        star[t] = b->tets[t] = star[i];
        fine = (v[0] - first < span) & (v[1] - first < span) & (v[2] - first < span);
        for (int j = 0; fine && j < 3; j++) {
            uint32_t m = marks[v[j]]; /* 0 for a new one, which can't be foretold: no branch */
            b->verts[n] = v[j];
            n += m == 0;
            m = m ? m : n;
            marks[v[j]] = (uint16_t)m;
            b->corners[j][t] = (int32_t)m - 1;
        }
        t++;
    }
    fine = fine && i == count && t && t == 2 * n - 4 && n <= TLI_BALL_VERTS;
    b->centre = u;
    b->vert_count = n;
    b->tet_count = t;
    for (; i < count; i++) star[t++] = star[i];
    s->count = t;
    return fine;
}

static void drop_marks(tli_work *w, const tli_ball *b)
{
    for (uint32_t i = 0; i < b->vert_count; i++) w->marks[b->verts[i]] = 0;
}

/* A move of the centre: places in the ball's tets of those that vanish, and of the others. */
typedef struct move {
    uint32_t to;
    uint32_t gone[TLI_BALL_TETS], gone_count;
    uint32_t kept[TLI_BALL_TETS], kept_count;
} move;

static void plan_move(const tli_ball *b, uint32_t to, move *m)
{
    int32_t t = (int32_t)to;
    m->to = to;
    m->gone_count = m->kept_count = 0;
    for (uint32_t i = 0; i < b->tet_count; i++) {
        bool gone = (b->corners[0][i] == t) | (b->corners[1][i] == t) | (b->corners[2][i] == t);
        m->gone[m->gone_count] = m->kept[m->kept_count] = i;
        m->gone_count += gone;
        m->kept_count += !gone;
    }
}

/* No neighbour of both ends is off the ring of their edge: the new edge to it would be there
 * already. Positive tets leave room for that only in meshes that overlap themselves. The ball must
 * be marked. */
static bool link_fine(const tli_work *w, const tli_ball *b, const move *m)
{
    uint64_t ring = (uint64_t)1 << m->to;
    for (uint32_t i = 0; i < m->gone_count; i++)
        for (int j = 0; j < 3; j++) ring |= (uint64_t)1 << b->corners[j][m->gone[i]];
    uint64_t off = ~(ring << 1 | 1); /* bits of the marks that must not be seen */
    const tli_star *s = &w->verts[b->verts[m->to]].star;
    for (uint32_t i = 0; i < s->count; i++) {
        const tl_lidx *q = w->tets[s->tets[i]];
        if (q[0] == TL_NONE) continue;
        for (int j = 0; j < 4; j++)
            if (q[j] - b->first < b->span && off >> w->marks[q[j]] & 1) return false;
    }
    return true;
}

/* Makes room for more tets in a star. */
static tl_status widen_star(const tli_work *w, tli_star_bank *bank, tli_star *s, uint32_t more)
{
    uint32_t live = 0;
    if (s->count + more <= s->capacity) return TL_OK;
    for (uint32_t i = 0; i < s->count; i++)
        if (w->tets[s->tets[i]][0] != TL_NONE) s->tets[live++] = s->tets[i];
    s->count = live;
    return tli_star_reserve(bank, s, live + more);
}

/* The quadric of u, moved to the anchor v, is added to that of v. */
static void add_quadric(tli_work *w, tl_lidx u, tl_lidx v)
{
    size_t k = w->components, floats = tli_quadric_floats(k);
    double e[3], h[TLI_COMPONENTS_MAX], sum[TLI_QUADRIC_HEAD + 4 * TLI_COMPONENTS_MAX];
    float *q = w->quadrics + v * w->quadric_floats;
    for (size_t i = 0; i < floats; i++) sum[i] = q[i];
    for (int i = 0; i < 3; i++) e[i] = (w->verts[v].xyz[i] - w->verts[u].xyz[i]) * w->scale;
    for (size_t i = 0; i < k; i++) h[i] = w->values[v * k + i] - w->values[u * k + i];
    tli_quadric_add_moved(sum, w->quadrics + u * w->quadric_floats, e, h, k);
    for (size_t i = 0; i < floats; i++) q[i] = (float)sum[i];
    if (q[9] < 0) q[9] = 0;
}

static tl_status commit(tli_work *w, tli_star_bank *bank, const tli_ball *b, const move *m)
{
    tl_lidx u = b->centre, v = b->verts[m->to];
    tli_star *s = &w->verts[v].star;
    for (uint32_t i = 0; i < m->gone_count; i++) w->tets[b->tets[m->gone[i]]][0] = TL_NONE;
    tl_status st = widen_star(w, bank, s, m->kept_count);
    if (st) return st;
    uint32_t *to = s->tets + s->count;
    for (uint32_t i = 0; i < m->kept_count; i++) {
        tl_lidx t = b->tets[m->kept[i]], *q = w->tets[t];
        q[tli_corner_of(q, u)] = v;
        to[i] = t;
    }
    s->count += m->kept_count;
    tli_star_release(bank, &w->verts[u].star);
    add_quadric(w, u, v);
    w->verts[u].merged = v;
    w->verts[u].version++;
    w->verts[v].version++;
    return TL_OK;
}

/* Numbers of the cheapest moves within the limit, cheapest first; returns how many. */
static uint32_t pick_moves(const tli_ball *b, float cost_max, uint32_t moves[TRIES])
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < b->vert_count; i++) {
        if (!(b->costs[i] <= cost_max)) continue;
        uint32_t at = count < TRIES ? count++ : TRIES;
        if (at == TRIES) {
            if (!(b->costs[i] < b->costs[moves[TRIES - 1]])) continue;
            at = TRIES - 1;
        }
        for (; at > 0 && b->costs[i] < b->costs[moves[at - 1]]; at--) moves[at] = moves[at - 1];
        moves[at] = i;
    }
    return count;
}

/* Moves the centre of the ball, which is weighed, into a neighbour if one is fine. */
static tl_status move_centre(thin_job *job, tli_star_bank *bank, size_t range, tli_ball *b)
{
    tli_work *w = job->work;
    tl_status st = TL_OK;
    uint32_t moves[TRIES], count = pick_moves(b, job->cost_max, moves);
    move m;
    job->kernel->look(b);
    float quality = b->worst < QUALITY ? b->worst : QUALITY;
    if (!(quality > job->least)) quality = job->least;
    for (uint32_t i = 0; i < count; i++) {
        tl_lidx v = b->verts[moves[i]];
        if (w->verts[v].star.count + b->tet_count > STAR_MAX) continue;
        if (!job->kernel->fits(b, moves[i], quality)) continue;
        plan_move(b, moves[i], &m);
        if (!link_fine(w, b, &m)) continue;
        double cost = (double)b->costs[moves[i]];
        st = commit(w, bank, b, &m);
        if (st) return st;
        job->gone[range].tets += m.gone_count;
        job->gone[range].verts++;
        job->known[v] = 0;
        return job->logs ? tli_log_add(&job->logs[range], w, v, b->centre, cost) : TL_OK;
    }
    return TL_OK;
}

static bool may_go(const thin_job *job, size_t u)
{
    return job->inner[u] && !(job->known[u] > job->cost_max) && job->work->verts[u].merged == u;
}

static tl_status thin_range(thin_job *job, size_t range, unsigned worker)
{
    tli_work *w = job->work;
    tli_ball *b = &job->balls[worker];
    tl_status st = TL_OK;
    size_t begin = range * job->range, end = begin + job->range, live = 0;
    begin = begin > job->shift ? begin - job->shift : 0;
    end = end - job->shift < w->vert_count ? end - job->shift : w->vert_count;
    for (size_t u = begin; u < end; u++) live += w->verts[u].merged == u;
    b->first = (tl_lidx)begin;
    b->span = (tl_lidx)(end - begin);
    size_t most = live - (size_t)(job->keep * (double)live);
    for (size_t u = begin; !st && u < end && job->gone[range].verts < most; u++) {
        if (u + 8 < end) __builtin_prefetch(w->verts[u + 8].star.tets);
        if (u + 3 < end && may_go(job, u + 3)) {
            const tli_star *s = &w->verts[u + 3].star;
            for (uint32_t i = 0; i < s->count; i++) __builtin_prefetch(w->tets[s->tets[i]]);
        }
        if (!may_go(job, u)) continue;
        if (gather(w, (tl_lidx)u, b)) {
            job->known[u] = job->kernel->weigh(w, job->inner, b);
            if (job->known[u] <= job->cost_max) st = move_centre(job, &w->banks[worker], range, b);
        }
        drop_marks(w, b);
    }
    return st;
}

static tl_status thin_ranges(void *arg, size_t begin, size_t end, unsigned worker)
{
    tl_status st = TL_OK;
    for (size_t r = begin; !st && r < end; r++) st = thin_range(arg, r, worker);
    return st;
}

/* What the last collapses on the way to a part of the vertices will cost, about. Vertices that cost
 * more stay, of the others a part that falls with the cost. */
static double last_cost(thin_job *job, double part)
{
    tli_work *w = job->work;
    float costs[SAMPLES];
    job->balls[0].first = 0;
    job->balls[0].span = (tl_lidx)w->vert_count;
    size_t count = 0;
    for (uint64_t i = 0; i < SAMPLES;
         i++) { /* scattered: a regular mesh answers to regular steps */
        size_t u = (size_t)((i * 0x9e3779b97f4a7c15u >> 32) * w->vert_count >> 32);
        if (w->verts[u].merged != u || !job->inner[u]) continue;
        if (gather(w, (tl_lidx)u, &job->balls[0]))
            costs[count++] = job->kernel->weigh(w, job->inner, &job->balls[0]);
        drop_marks(w, &job->balls[0]);
    }
    double low = log2((double)FLT_MIN), high = log2((double)FLT_MAX);
    for (int i = 0; i < BISECTIONS; i++) {
        double middle = (low + high) / 2, sum = 0, cost = exp2(middle);
        for (size_t j = 0; j < count; j++)
            sum += (double)costs[j] < cost ? pow((double)costs[j] / cost, FALL) : 1;
        if (sum > part * (double)count)
            low = middle;
        else
            high = middle;
    }
    return count ? exp2(low) : 0;
}

static tl_status one_run(thin_job *job)
{
    tli_work *w = job->work;
    tl_status st = TL_OK;
    size_t ranges = (w->vert_count + job->shift + job->range - 1) / job->range;
    job->gone = tl_mem_zalloc(w->ctx, ranges, sizeof *job->gone, &st);
    if (w->listener) job->logs = tl_mem_zalloc(w->ctx, ranges, sizeof *job->logs, &st);
    if (!st) st = tli_parallel(w->ctx, ranges, 1, thin_ranges, job);
    for (size_t r = 0; job->gone && r < ranges; r++) {
        w->tets_live -= job->gone[r].tets;
        w->verts_live -= job->gone[r].verts;
        if (!job->logs) continue;
        if (!st) st = tli_log_tell(&job->logs[r], w);
        tli_log_release(w->ctx, &job->logs[r]);
    }
    tl_mem_free(w->ctx, job->logs);
    tl_mem_free(w->ctx, job->gone);
    job->logs = NULL;
    job->gone = NULL;
    return st;
}

tl_status tli_work_thin(tli_work *w, const uint8_t *inner, size_t target)
{
    tl_status st = TL_OK;
    thin_job job = {.work = w, .kernel = tli_thin_best(), .inner = inner};
    job.known = tl_mem_zalloc(w->ctx, w->vert_count, sizeof *job.known, &st);
    job.balls = tl_mem_zalloc(w->ctx, w->bank_count, sizeof *job.balls, &st);
    job.range = w->vert_count / RANGES;
    if (job.range < RANGE_LEAST) job.range = RANGE_LEAST;
    if (job.range > RANGE_MOST) job.range = RANGE_MOST;
    job.least = (float)fmax(w->shape_cube, (double)LEAST_QUALITY) * MARGIN;
    if (!st) w->last_cost = last_cost(&job, (double)target / (double)w->tets_live);
    for (size_t run = 0; !st && run < sizeof PARTS / sizeof *PARTS; run++) {
        job.cost_max = (float)(PARTS[run] * w->last_cost);
        job.keep = fmin(1, STAY * (double)target / (double)w->tets_live);
        job.shift = run % 2 ? job.range / 2 : 0;
        st = one_run(&job);
        if (!st) st = tli_order_report(w, w->tets_live, target);
    }
    tl_mem_free(w->ctx, job.balls);
    tl_mem_free(w->ctx, job.known);
    return st ? st : tli_work_compact(w);
}
