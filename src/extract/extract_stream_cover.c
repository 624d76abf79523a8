/* Streamlines that cover a box evenly (Sondershaus 2007, 7.3.1): a line begins in each cell of a
 * grid that no line ran through before. One after the other by definition; here the next empty
 * cells are traced together, and a line whose cell was covered meanwhile is dropped, so that the
 * result is that of one after the other, with any number of threads. Cells come in an order that
 * strides over the whole grid, so that the first lines are far apart. */
#include <math.h>

#include "extract/extract_stream.h"
#include "mesh/mesh.h"

enum { CELLS_MAX = 1024, AT_ONCE = 128, CORNERS = 8 };
/* The stride of the order of cells, as a part of their number: the golden section. */
static const double GOLDEN = 0.6180339887498949;

typedef struct cover {
    const tli_stream_job *job;
    double low[3], edge;
    size_t counts[3], count;
    uint8_t *covered; /* [count] */
    size_t stride;
} cover;

static size_t common_divisor(size_t a, size_t b)
{
    while (b) {
        size_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

static tl_status open_cover(const tli_stream_job *job, const double given[6], uint32_t cells,
                            cover *c)
{
    tl_status st = TL_OK;
    const double *bounds = given ? given : job->bounds;
    double longest = 0;
    *c = (cover){.job = job, .count = 1};
    for (int k = 0; k < 3; k++) longest = fmax(longest, bounds[2 * k + 1] - bounds[2 * k]);
    if (!cells || cells > CELLS_MAX)
        return tl_fail(job->ctx, TL_ERR_ARG, "a grid has 1 to %d cells along a side, not %u",
                       CELLS_MAX, cells);
    if (!(longest > 0 && isfinite(longest)))
        return tl_fail(job->ctx, TL_ERR_ARG, "the box that lines should cover is empty");
    c->edge = longest / cells;
    for (int k = 0; k < 3; k++) {
        double wanted = ceil((bounds[2 * k + 1] - bounds[2 * k]) / c->edge - 0.5);
        c->counts[k] = wanted > 1 ? (size_t)wanted : 1;
        double middle = (bounds[2 * k] + bounds[2 * k + 1]) / 2;
        c->low[k] = middle - (double)c->counts[k] * c->edge / 2;
        c->count *= c->counts[k];
    }
    c->stride = (size_t)(GOLDEN * (double)c->count) | 1;
    while (common_divisor(c->stride, c->count) != 1) c->stride += 2;
    c->covered = tl_mem_zalloc(job->ctx, c->count, 1, &st);
    return st;
}

/* A point of the cell that the mesh holds: the centre, or that of one of eight parts. */
static bool seed_of(const cover *c, size_t cell, double seed[3])
{
    size_t at[3] = {cell % c->counts[0], cell / c->counts[0] % c->counts[1],
                    cell / c->counts[0] / c->counts[1]};
    for (unsigned part = 0; part <= CORNERS; part++) {
        for (unsigned k = 0; k < 3; k++) {
            double inside = !part ? 0.5 : (part - 1) >> k & 1 ? 0.75 : 0.25;
            seed[k] = c->low[k] + ((double)at[k] + inside) * c->edge;
        }
        if (tl_locator_find(c->job->field.locator, seed, TL_NONE, NULL) != TL_NONE) return true;
    }
    return false;
}

/* Marks the cell with these numbers, if it is one. */
static void mark_cell(cover *c, const double at[3])
{
    size_t cell = 0;
    for (int k = 3; k-- > 0;) {
        if (!(at[k] >= 0 && at[k] < (double)c->counts[k])) return;
        cell = cell * c->counts[k] + (size_t)at[k];
    }
    c->covered[cell] = 1;
}

/* Cuts a step, in cells, to what lies in the grid; false: nothing. */
static bool cut_step(const cover *c, double from[3], double to[3])
{
    double first = 0, last = 1, way[3];
    for (int k = 0; k < 3; k++) {
        double low = -from[k], high = (double)c->counts[k] - from[k];
        way[k] = to[k] - from[k];
        if (way[k] == 0) {
            if (low > 0 || high < 0) return false;
            continue;
        }
        first = fmax(first, (way[k] > 0 ? low : high) / way[k]);
        last = fmin(last, (way[k] > 0 ? high : low) / way[k]);
    }
    for (int k = 0; k < 3; k++) {
        to[k] = last < 1 ? from[k] + last * way[k] : to[k];
        from[k] += first * way[k];
    }
    return first <= last;
}

/* Marks the cells that a step runs through, from wall to wall. */
static void mark_step(cover *c, const double a[3], const double b[3])
{
    double from[3], to[3], at[3], next[3], apart[3], walls = 0;
    for (int k = 0; k < 3; k++) {
        from[k] = (a[k] - c->low[k]) / c->edge;
        to[k] = (b[k] - c->low[k]) / c->edge;
    }
    if (!cut_step(c, from, to)) return;
    for (int k = 0; k < 3; k++) {
        double way = to[k] - from[k], ahead = way > 0 ? 1 : 0;
        at[k] = floor(from[k]);
        walls += fabs(floor(to[k]) - at[k]);
        apart[k] = way == 0 ? INFINITY : 1 / fabs(way);
        next[k] = way == 0 ? INFINITY : fabs(at[k] + ahead - from[k]) * apart[k];
    }
    mark_cell(c, at);
    for (; walls > 0; walls--) {
        int k = next[0] <= next[1] ? 0 : 1;
        k = next[2] < next[k] ? 2 : k;
        at[k] += to[k] > from[k] ? 1 : -1;
        next[k] += apart[k];
        mark_cell(c, at);
    }
}

static void mark_line(cover *c, const tli_stream_line *line)
{
    size_t width = c->job->row_doubles;
    for (size_t i = 1; i < line->count; i++)
        mark_step(c, line->rows + width * (i - 1), line->rows + width * i);
}

/* The next cells that are empty, at most AT_ONCE, and their seeds; place: in the order of cells. */
static size_t choose_cells(cover *c, size_t *place, size_t *cell, size_t *cells, double *seeds,
                           tli_stream_sum *sum)
{
    size_t found = 0;
    for (; *place < c->count && found < AT_ONCE; ++*place) {
        *cell = (*cell + c->stride) % c->count;
        if (c->covered[*cell]) {
            sum->report.seeds_covered++;
        } else if (!seed_of(c, *cell, seeds + 3 * found)) {
            sum->report.seeds_outside++;
        } else {
            cells[found++] = *cell;
        }
    }
    return found;
}

static tl_status run_cover(cover *c, tli_stream_line *lines, tli_stream_sum *sum)
{
    tl_status st = TL_OK;
    size_t cells[AT_ONCE], place = 0, cell = 0;
    double seeds[3 * AT_ONCE];
    while (!st) {
        size_t found = choose_cells(c, &place, &cell, cells, seeds, sum);
        if (!found) break;
        st = tli_stream_batch(c->job, seeds, found, lines);
        for (size_t i = 0; i < found && !st; i++) {
            if (c->covered[cells[i]]) {
                sum->report.seeds_covered++;
            } else if (lines[i].count > 1) {
                mark_line(c, &lines[i]);
                st = tli_stream_keep(c->job, &lines[i], sum);
            } else {
                sum->report.seeds_outside++;
            }
        }
        if (!st) st = tl_progress(c->job->ctx, "lines", place, c->count);
    }
    return st;
}

tl_status tl_streamlines_cover(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                               const tl_locator *locator, const double *vectors,
                               const double bounds[6], uint32_t cells, const tl_stream_opts *opts,
                               tl_polydata **lines, tl_stream_report *report)
{
    tli_stream_job job;
    cover c = {0};
    tli_stream_sum sum = {0};
    const tli_stream_field field = {mesh, opposite, locator, vectors};
    *lines = NULL;
    tl_status st = tli_stream_open(ctx, &field, opts, &job);
    tli_stream_line *traced = tl_mem_zalloc(ctx, AT_ONCE, sizeof *traced, &st);
    if (!st) st = open_cover(&job, bounds, cells, &c);
    if (!st) st = run_cover(&c, traced, &sum);
    if (!st) st = tli_stream_finish(&job, &sum, lines);
    if (!st && report) *report = sum.report;
    for (size_t i = 0; traced && i < AT_ONCE; i++) tl_mem_free(ctx, traced[i].rows);
    tl_mem_free(ctx, traced);
    tl_mem_free(ctx, c.covered);
    tli_stream_sum_release(&job, &sum);
    tli_stream_close(&job);
    return st;
}
