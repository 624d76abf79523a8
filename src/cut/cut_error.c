/* From the errors that a segment stores to one number: the largest ratio of an error to its bound.
 * Ratios of positive floats are above 1 exactly where the error is above the bound. */
#include "cut/cut_error.h"

#include <math.h>
#include <string.h>

tl_cut_bounds tl_cut_bounds_any(void)
{
    return (tl_cut_bounds){NULL, INFINITY, INFINITY, INFINITY};
}

tl_cut_query tl_cut_query_defaults(void)
{
    return (tl_cut_query){.struct_bytes = sizeof(tl_cut_query),
                          .bounds = tl_cut_bounds_any(),
                          .outside = tl_cut_bounds_any(),
                          .pixels = INFINITY,
                          .level = UINT32_MAX,
                          .tets_max = UINT64_MAX,
                          .bytes_max = UINT64_MAX};
}

/* ---- taking over a query ---- */

static tl_status check_bounds(tl_ctx *ctx, const tl_cut_bounds *b, size_t channel_count)
{
    if (!(b->boundary >= 0 && b->space >= 0 && b->classified >= 0))
        return tl_fail(ctx, TL_ERR_ARG,
                       "bounds %g (boundary), %g (space), %g (classified), expected 0 or more",
                       b->boundary, b->space, b->classified);
    for (size_t c = 0; b->channels && c < channel_count; c++)
        if (!(b->channels[c] >= 0))
            return tl_fail(ctx, TL_ERR_ARG, "bound %g of channel %zu, expected 0 or more",
                           b->channels[c], c);
    return TL_OK;
}

static tl_status check_query(tl_ctx *ctx, const tl_cut_query *q, size_t channel_count)
{
    if (q->struct_bytes != sizeof *q)
        return tl_fail(ctx, TL_ERR_ARG, "a query of %zu bytes, expected %zu", q->struct_bytes,
                       sizeof *q);
    if (!(q->pixels > 0)) return tl_fail(ctx, TL_ERR_ARG, "%g pixels, expected more", q->pixels);
    for (int k = 0; q->box && k < 3; k++)
        if (!(q->box[k] <= q->box[k + 3]))
            return tl_fail(ctx, TL_ERR_ARG, "the box runs from %g to %g along axis %d", q->box[k],
                           q->box[k + 3], k);
    for (size_t i = 0; q->opacity && i < channel_count * TL_BINS; i++)
        if (!(q->opacity[i] >= 0 && q->opacity[i] <= 1))
            return tl_fail(ctx, TL_ERR_ARG, "opacity %g, expected 0 to 1", (double)q->opacity[i]);
    for (size_t i = 0; q->unseen && i < channel_count * TL_BINS; i++)
        if (!(q->unseen[i] >= 0))
            return tl_fail(ctx, TL_ERR_ARG, "an error of %g is not seen, expected 0 or more",
                           (double)q->unseen[i]);
    tl_status st = check_bounds(ctx, &q->bounds, channel_count);
    return st || !q->box ? st : check_bounds(ctx, &q->outside, channel_count);
}

static bool same_bounds(const tl_cut_bounds *a, const tl_cut_bounds *b, size_t channel_count)
{
    if (a->boundary != b->boundary || a->space != b->space || a->classified != b->classified ||
        !a->channels != !b->channels)
        return false;
    return !a->channels || !memcmp(a->channels, b->channels, channel_count * sizeof(double));
}

static bool same_floats(const float *a, const float *b, size_t count)
{
    return a && b ? !memcmp(a, b, count * sizeof *a) : a == b;
}

static bool same_query(const tli_asked *a, const tl_cut_query *q)
{
    size_t opacities = a->channel_count * TL_BINS;
    if (a->generation == 0 || a->has_box != (q->box != NULL) || a->level != q->level ||
        !same_bounds(&a->inside, &q->bounds, a->channel_count))
        return false;
    if (q->box && !same_bounds(&a->outside, &q->outside, a->channel_count)) return false;
    return same_floats(a->opacity, q->opacity, opacities) &&
           same_floats(a->unseen, q->unseen, opacities);
}

static bool is_any(const tl_cut_bounds *b, size_t channel_count)
{
    for (size_t c = 0; b->channels && c < channel_count; c++)
        if (isfinite(b->channels[c])) return false;
    return !isfinite(b->boundary) && !isfinite(b->space) && !isfinite(b->classified);
}

static void *copy_numbers(tl_ctx *ctx, const void *from, size_t count, size_t bytes, tl_status *st)
{
    if (!from) return NULL;
    void *to = tl_mem_alloc(ctx, count, bytes, st);
    if (to) memcpy(to, from, count * bytes);
    return to;
}

static void drop_copies(const tli_asked *a)
{
    tl_mem_free(a->ctx, (void *)(uintptr_t)a->inside.channels);
    tl_mem_free(a->ctx, (void *)(uintptr_t)a->outside.channels);
    tl_mem_free(a->ctx, a->opacity);
    tl_mem_free(a->ctx, a->unseen);
}

/* Own copies of the arrays of a new query. */
static tl_status copy_query(tli_asked *a, const tl_cut_query *q)
{
    tl_status st = TL_OK;
    tli_asked fresh = *a;
    size_t opacities = a->channel_count * TL_BINS;
    fresh.inside = q->bounds;
    fresh.outside = q->outside;
    fresh.inside.channels =
        copy_numbers(a->ctx, q->bounds.channels, a->channel_count, sizeof(double), &st);
    fresh.outside.channels = copy_numbers(a->ctx, q->box ? q->outside.channels : NULL,
                                          a->channel_count, sizeof(double), &st);
    fresh.opacity = copy_numbers(a->ctx, q->opacity, opacities, sizeof(float), &st);
    fresh.unseen = copy_numbers(a->ctx, q->unseen, opacities, sizeof(float), &st);
    if (st) {
        drop_copies(&fresh);
        return st;
    }
    drop_copies(a);
    *a = fresh;
    a->generation++;
    return TL_OK;
}

tl_status tli_asked_set(tli_asked *a, const tl_store_head *head, const tl_cut_query *q)
{
    tli_view view = a->view;
    tl_status st = check_query(a->ctx, q, a->channel_count);
    if (!st && q->camera) st = tli_view_set(a->ctx, q->camera, head->stats.diagonal, &view);
    if (!st && !same_query(a, q)) st = copy_query(a, q);
    if (st) return st;
    if (q->box) memcpy(a->box, q->box, sizeof a->box);
    a->has_box = q->box != NULL;
    a->has_camera = q->camera != NULL;
    a->view = view;
    a->pixels = q->pixels;
    a->level = q->level;
    a->tets_max = q->tets_max;
    a->bytes_max = q->bytes_max;
    bool pixels = q->camera && isfinite(q->pixels);
    a->spends = is_any(&a->inside, a->channel_count) && !pixels && q->level == UINT32_MAX &&
                (q->tets_max != UINT64_MAX || q->bytes_max != UINT64_MAX);
    return TL_OK;
}

void tli_asked_release(tli_asked *a)
{
    drop_copies(a);
    *a = (tli_asked){0};
}

/* ---- errors of a segment ---- */

/* error / bound, where nothing is not above anything. */
static double ratio(double error, double bound)
{
    return error > 0 ? error / bound : 0;
}

static double largest(double a, double b)
{
    return b > a ? b : a;
}

/* Largest spatial error over the visible bins of all channels whose field error shows; where
 * nothing is said of opacity, of those that have isosurfaces. */
static double visible_space_error(const tli_asked *a, const tl_store_head *head,
                                  const tl_segment_info *s)
{
    double worst = 0;
    for (size_t c = 0; c < a->channel_count; c++) {
        const tl_store_channel *channel = &head->channels[c];
        bool is_seen = channel->components == 1 && channel->on == TL_ON_VERTEX;
        for (size_t b = c * TL_BINS; b < (c + 1) * TL_BINS; b++) {
            bool shows = a->unseen ? s->field_bins[b] > a->unseen[b] : true;
            if (shows && (a->opacity ? a->opacity[b] > 0 : is_seen))
                worst = largest(worst, (double)s->space_bins[b]);
        }
    }
    return worst;
}

/* Field errors weighed with opacity, each relative to the range of its channel. */
static double classified_error(const tli_asked *a, const tl_store_head *head,
                               const tl_segment_info *s)
{
    double sum = 0;
    for (size_t c = 0; c < a->channel_count; c++) {
        double width = head->channels[c].range[1] - head->channels[c].range[0], part = 0;
        for (size_t b = c * TL_BINS; b < (c + 1) * TL_BINS; b++)
            part += (double)s->field_bins[b] * (a->opacity ? (double)a->opacity[b] : 1);
        sum += ratio(part, width);
    }
    return sum;
}

static double severity_of(const tli_asked *a, const tl_store_head *head, const tl_segment_info *s,
                          const tl_cut_bounds *bounds, double space)
{
    double worst = ratio(s->boundary_error, bounds->boundary);
    for (size_t c = 0; bounds->channels && c < a->channel_count; c++)
        worst = largest(worst, ratio(s->max_error[c], bounds->channels[c]));
    worst = largest(worst, ratio(space, bounds->space));
    if (isfinite(bounds->classified))
        worst = largest(worst, ratio(classified_error(a, head, s), bounds->classified));
    return worst;
}

/* What does not depend on the camera. */
static tl_status assess(const tli_asked *a, tli_dag *graph, uint32_t segment, tli_node *node)
{
    tl_segment_info s;
    tl_status st = tl_store_segment(graph->ctx, graph->store, segment, &s);
    if (st) return st;
    double space = visible_space_error(a, graph->head, &s);
    node->severity = severity_of(a, graph->head, &s, &a->inside, space);
    node->severity_outside =
        a->has_box ? severity_of(a, graph->head, &s, &a->outside, space) : node->severity;
    if (a->level != UINT32_MAX && node->level >= a->level)
        node->severity = node->severity_outside = INFINITY;
    node->space_error = space;
    node->seen_error = largest(space, s.boundary_error);
    node->generation = a->generation;
    return TL_OK;
}

static bool meets_box(const double sphere[4], const double box[6])
{
    double d2 = 0;
    for (int k = 0; k < 3; k++) {
        double d = largest(largest(box[k] - sphere[k], sphere[k] - box[k + 3]), 0);
        d2 += d * d;
    }
    return d2 <= sphere[3] * sphere[3];
}

tl_status tli_severity(const tli_asked *a, tli_dag *graph, uint32_t segment, double *severity)
{
    tli_node *node;
    tl_status st = tli_dag_node(graph, segment, &node);
    if (!st && node->generation != a->generation) st = assess(a, graph, segment, node);
    if (st) return st;
    double worst = node->severity;
    if (a->has_box && !meets_box(node->sphere, a->box)) worst = node->severity_outside;
    if (a->has_camera) {
        double pixels = tli_view_pixels(&a->view, node->sphere);
        if (pixels == 0 && a->level == UINT32_MAX)
            worst = 0;
        else
            worst = largest(worst, ratio(node->seen_error * pixels, a->pixels));
    }
    *severity = worst;
    return TL_OK;
}

void tli_seen_error(const tli_asked *a, const tli_dag *graph, uint32_t segment, double *space,
                    double *pixels)
{
    const tli_node *node = &graph->nodes[segment];
    const double scale = a->has_camera ? tli_view_pixels(&a->view, node->sphere) : 0;
    *space = a->has_camera && scale == 0 ? 0 : node->space_error;
    *pixels = scale > 0 && node->seen_error > 0 ? scale * node->seen_error : 0;
}

bool tli_leaves_keep(const tli_asked *a, const tl_store_head *head)
{
    if (a->has_box) return true;
    for (size_t c = 0; a->inside.channels && c < a->channel_count; c++)
        if (head->levels[0].max_error[c] > a->inside.channels[c]) return false;
    return head->levels[0].boundary_error <= a->inside.boundary;
}
