/* Stars of original vertices: the values that the original has in the tets around one. Isosurfaces
 * of all of them pass there, so that where the vertex is off, so are they. A segment finds those of
 * its own tets; what it finds at vertices whose home is elsewhere lies in a working file. */
#include "model/model_stars.h"

#include <math.h>

#include "base/base_sort.h"
#include "model/model_turns.h"

static void grow(tli_star *star, tli_star by)
{
    if (by.low < star->low) star->low = by.low;
    if (by.high > star->high) star->high = by.high;
}

/* A value, rounded outwards; nothing for one that is not finite. */
static tli_star star_of(double value)
{
    float near = (float)value;
    tli_star star = {INFINITY, -INFINITY};
    if (!isfinite(value)) return star;
    star.low = (double)near > value ? nextafterf(near, -INFINITY) : near;
    star.high = (double)near < value ? nextafterf(near, INFINITY) : near;
    return star;
}

/* The value or norm of a field at a vertex. */
static double value_of(const tli_plan *plan, const tli_field *f, const tl_segment *s, size_t vert)
{
    const double *at = s->values + vert * plan->source_vert_comps + f->source_first;
    double sum = 0;
    if (f->components == 1) return at[0];
    for (uint32_t k = 0; k < f->components; k++) sum += at[k] * at[k];
    return sqrt(sum);
}

/* One field of all vertices, over the tets of the segment. */
static void set_field(const tli_plan *plan, const tli_field *f, const tl_segment *s,
                      tli_star *stars)
{
    const size_t stride = plan->vert_fields;
    for (size_t v = 0; v < s->vert_count; v++) stars[v * stride] = star_of((double)NAN);
    for (size_t t = 0; t < s->tet_count; t++) {
        const uint16_t *q = s->tets + 4 * t;
        tli_star all = star_of(value_of(plan, f, s, q[0]));
        for (int i = 1; i < 4; i++) grow(&all, star_of(value_of(plan, f, s, q[i])));
        for (int i = 0; i < 4; i++) grow(&stars[q[i] * stride], all);
    }
}

static tl_status make(tl_ctx *ctx, const tli_plan *plan, const tl_segment *s, tli_star **stars)
{
    tl_status st = TL_OK;
    size_t at = 0;
    *stars = tl_mem_alloc(ctx, s->vert_count, plan->vert_fields * sizeof **stars, &st);
    for (size_t i = 0; !st && i < plan->field_count; i++)
        if (plan->fields[i].on == TL_ON_VERTEX) set_field(plan, &plan->fields[i], s, *stars + at++);
    return st;
}

/* ---- across segments ---- */

/* Of a vertex: its id, then its stars. */
static size_t word_count(const tli_plan *plan)
{
    return 1 + plan->vert_fields;
}

/* Writes what a segment has of vertices whose home is elsewhere. */
static tl_status tell(tl_ctx *ctx, tli_stars *all, uint32_t segment)
{
    const size_t n = word_count(all->plan);
    tl_segment s;
    tli_star *stars = NULL;
    uint64_t *words = NULL;
    size_t count = 0;
    tl_status st = tl_segments_load(ctx, all->segments, segment, &s);
    if (st) return st;
    st = make(ctx, all->plan, &s, &stars);
    words = tl_mem_alloc(ctx, s.vert_count, n * sizeof *words, &st);
    for (size_t v = 0; !st && v < s.vert_count; v++) {
        if (!(s.links[v] & TL_LINK_COPY)) continue;
        words[count * n] = s.vert_ids[v];
        memcpy(words + count++ * n + 1, stars + v * (n - 1), (n - 1) * sizeof *stars);
    }
    all->counts[segment] = (uint32_t)count;
    if (!st && count)
        st =
            tli_depot_put(ctx, all->depot, words, count * n * sizeof *words, &all->places[segment]);
    tl_mem_free(ctx, words);
    tl_mem_free(ctx, stars);
    tl_segment_release(ctx, &s);
    return st;
}

static tl_status tell_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    tli_stars *all = arg;
    tl_ctx *ctx = NULL;
    tl_status st = tli_ctx_fork(all->ctx, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) st = tell(ctx, all, (uint32_t)i);
    return tli_ctx_join(all->ctx, ctx, st);
}

/* The vertices of a segment that others hold, too, and whose home it is. */
typedef struct homes {
    uint64_t *ids; /* [count] ascending */
    uint32_t *verts;
    size_t count;
} homes;

/* To be released also after a failure. */
static tl_status list_homes(tl_ctx *ctx, const tl_segment *s, homes *h)
{
    tl_status st = TL_OK;
    *h = (homes){0};
    h->ids = tl_mem_alloc(ctx, s->vert_count, sizeof *h->ids, &st);
    h->verts = tl_mem_alloc(ctx, s->vert_count, sizeof *h->verts, &st);
    for (uint32_t v = 0; !st && v < s->vert_count; v++) {
        if (s->links[v] & TL_LINK_COPY || !TL_LINK_SLOT(s->links[v])) continue;
        h->ids[h->count] = s->vert_ids[v];
        h->verts[h->count++] = v;
    }
    return st ? st : tli_sort_u64(ctx, h->ids, h->verts, h->count);
}

static size_t find_home(const homes *h, uint64_t id)
{
    size_t lo = 0, hi = h->count;
    while (lo < hi) {
        size_t mid = lo + (hi - lo) / 2;
        if (h->ids[mid] < id)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo < h->count && h->ids[lo] == id ? h->verts[lo] : SIZE_MAX;
}

/* Adds what a neighbour has of them. */
static tl_status hear(tl_ctx *ctx, const tli_stars *all, uint32_t from, const homes *h,
                      tli_star *stars)
{
    tl_status st = TL_OK;
    const size_t n = word_count(all->plan), count = all->counts[from];
    uint64_t *words = tl_mem_alloc(ctx, count, n * sizeof *words, &st);
    if (!st && count)
        st = tli_depot_get(ctx, all->depot, all->places[from], words, count * n * sizeof *words);
    for (size_t i = 0; !st && i < count; i++) {
        const uint64_t *word = words + i * n;
        size_t v = find_home(h, word[0]);
        for (size_t f = 0; v != SIZE_MAX && f + 1 < n; f++) {
            tli_star star;
            memcpy(&star, word + 1 + f, sizeof star);
            grow(&stars[v * (n - 1) + f], star);
        }
    }
    tl_mem_free(ctx, words);
    return st;
}

tl_status tli_stars_open(tl_ctx *ctx, const tli_plan *plan, const tl_segments *segments,
                         tli_stars *all)
{
    const size_t count = tl_segments_count(segments);
    tl_status st = TL_OK;
    *all = (tli_stars){.ctx = ctx, .plan = plan, .segments = segments};
    if (!plan->vert_fields) return TL_OK;
    all->places = tl_mem_zalloc(ctx, count, sizeof *all->places, &st);
    all->counts = tl_mem_zalloc(ctx, count, sizeof *all->counts, &st);
    if (!st) st = tli_depot_create(ctx, plan->opts.folder, &all->depot);
    return st ? st : tli_turns(ctx, "stars", count, plan->at_once, tell_range, all);
}

void tli_stars_close(tli_stars *all)
{
    tli_depot_destroy(all->depot);
    tl_mem_free(all->ctx, all->counts);
    tl_mem_free(all->ctx, all->places);
    *all = (tli_stars){0};
}

tl_status tli_stars_create(tl_ctx *ctx, const tli_stars *all, const tl_segment *s, tli_star **stars)
{
    homes h = {0};
    tl_status st = make(ctx, all->plan, s, stars);
    if (!st && all->depot) st = list_homes(ctx, s, &h);
    for (uint32_t i = 0; !st && all->depot && i < s->neighbour_count; i++)
        st = hear(ctx, all, s->neighbours[i], &h, *stars);
    tl_mem_free(ctx, h.verts);
    tl_mem_free(ctx, h.ids);
    if (!st) return TL_OK;
    tl_mem_free(ctx, *stars);
    *stars = NULL;
    return st;
}
