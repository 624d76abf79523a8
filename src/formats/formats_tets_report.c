/* What a conversion to tets dropped and changed: summed over the threads, and said through the log.
 */
#include "formats/formats_tets.h"

#include <stdio.h>
#include <string.h>

void tli_tets_sum(tli_tets *t)
{
    uint64_t *sum = (uint64_t *)&t->sum;
    for (unsigned w = 0; t->tallies && w < tl_ctx_thread_count(t->ctx); w++) {
        const uint64_t *one = (const uint64_t *)&t->tallies[w];
        for (size_t i = 0; i < sizeof t->sum / sizeof *sum; i++) sum[i] += one[i];
    }
}

static void fill_report(tli_tets *t)
{
    tl_read_report *r = &t->report;
    memcpy(r->cells, t->sum.cells, sizeof r->cells);
    r->ghost_cells = t->sum.ghosts;
    r->blank_cells = t->sum.blanks;
    r->surface_cells = t->sum.faceless;
    for (int k = TL_CELL_SURFACE; k < TL_CELL_KIND_COUNT; k++) r->surface_cells += r->cells[k];
    r->open_cells = t->sum.open;
    r->closed_cells = t->sum.closed;
    r->new_points = t->centre_count;
    r->turned = t->sum.turned;
    r->inverted = t->sum.inverted;
    r->degenerate = t->sum.degenerate;
    r->nonfinite_values = t->sum.nonfinite_values;
}

static void say_left_out(tli_tets *t)
{
    if (!t->report.surface_cells) return;
    char text[256];
    int length = 0;
    for (int k = TL_CELL_SURFACE; k < TL_CELL_KIND_COUNT; k++)
        if (t->report.cells[k])
            length += snprintf(text + length, sizeof text - (size_t)length, " %s %llu",
                               tl_cell_kind_name((tl_cell_kind)k),
                               (unsigned long long)t->report.cells[k]);
    tl_log(t->ctx, TL_LOG_INFO, "%llu cells left out:%s",
           (unsigned long long)t->report.surface_cells, text);
}

static void say_what_changed(tli_tets *t)
{
    const tl_read_report *r = &t->report;
    uint64_t quadratic = 0;
    for (int k = TL_CELL_QUADRATIC_TETRA; k <= TL_CELL_QUADRATIC_PYRAMID; k++)
        quadratic += r->cells[k];
    const struct {
        uint64_t count;
        const char *text;
    } lines[] = {
        {quadratic, "cells of higher order taken by their corners"},
        {t->sum.faceless, "polyhedra without faces left out"},
        {r->open_cells, "polyhedra left out, whose faces do not close"},
        {r->closed_cells, "polyhedra lacked faces, which were added"},
        {r->new_points, "polyhedra split from a new vertex in their middle"},
        {r->ghost_cells, "ghost cells dropped"},
        {r->blank_cells, "cells cut away for missing values"},
        {t->opts.keep_fill ? t->sum.filled : 0, "missing values kept as NaN"},
        {t->sum.repeated, "tets with a repeated vertex dropped"},
        {r->turned, "tets turned"},
        {r->inverted, "tets stay inverted"},
        {r->degenerate, "tets are flat"},
        {t->sum.nonfinite_tets, "tets have a corner that is not finite"},
        {r->unused_points, "points of no tet left out"},
        {r->nonfinite_values, "values are not finite"},
    };
    say_left_out(t);
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        if (lines[i].count)
            tl_log(t->ctx, TL_LOG_INFO, "%llu %s", (unsigned long long)lines[i].count,
                   lines[i].text);
    if (t->region_name)
        tl_log(t->ctx, TL_LOG_INFO, "regions from the cell array '%s'", t->region_name);
    if (t->tet_count == 0)
        tl_log(t->ctx, TL_LOG_INFO, "no volume cells to split; %zu points kept", t->vert_count);
}

void tli_tets_report(tli_tets *t)
{
    fill_report(t);
    say_what_changed(t);
}
