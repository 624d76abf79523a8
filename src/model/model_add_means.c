/* Values of channels that are added on tets of a coarser level: means of the originals that lie in
 * a tet by their volumes, as a build has them. Integers may be labels, of which no mean can be
 * taken: a tet has that of the original nearest to its middle. */
#include <math.h>

#include "model/model_add.h"

tl_status tli_means_open(tl_ctx *ctx, const tli_plan *plan, const tl_mesh *mesh, double *rows,
                         tli_means *m)
{
    tl_status st = TL_OK;
    const size_t doubles = mesh->tet_count * plan->tet_comps;
    *m = (tli_means){.ctx = ctx, .plan = plan, .mesh = mesh, .rows = rows};
    m->sums = tl_mem_zalloc(ctx, doubles, sizeof *m->sums, &st);
    m->volumes = tl_mem_zalloc(ctx, doubles, sizeof *m->volumes, &st);
    m->nearest = tl_mem_alloc(ctx, mesh->tet_count, sizeof *m->nearest, &st);
    for (size_t t = 0; !st && t < mesh->tet_count; t++) m->nearest[t] = (double)INFINITY;
    return st;
}

void tli_means_close(tli_means *m)
{
    void *blocks[] = {m->nearest, m->volumes, m->sums};
    for (size_t i = 0; m->ctx && i < sizeof blocks / sizeof *blocks; i++)
        tl_mem_free(m->ctx, blocks[i]);
}

void tli_means_add(tli_means *m, tl_lidx tet, const double *record)
{
    const size_t k = m->plan->tet_comps, first = tet * k;
    double p[4][3], d2 = 0;
    tli_tet_corners(m->mesh->xyz, m->mesh->tets + 4 * (size_t)tet, p);
    for (int c = 0; c < 3; c++) {
        const double d = (p[0][c] + p[1][c] + p[2][c] + p[3][c]) / 4 - record[c];
        d2 += d * d;
    }
    if (d2 < m->nearest[tet]) {
        m->nearest[tet] = d2;
        memcpy(m->rows + first, record + 4, k * sizeof *m->rows);
    }
    for (size_t c = 0; c < k; c++) {
        if (!isfinite(record[4 + c])) continue;
        m->sums[first + c] += record[3] * record[4 + c];
        m->volumes[first + c] += record[3];
    }
}

/* Tets without an original have the values of a neighbour, or spare ones. */
static void spread(tli_means *m, const tl_lidx *opposite, const double *spare)
{
    const size_t k = m->plan->tet_comps, n = m->mesh->tet_count;
    for (bool again = true; again;) {
        again = false;
        for (size_t i = 0; i < 4 * n; i++) {
            const size_t to = i / 4, from = opposite[i] == TL_NONE ? to : opposite[i] / 4;
            if (isfinite(m->nearest[to]) || !isfinite(m->nearest[from])) continue;
            memcpy(m->rows + to * k, m->rows + from * k, k * sizeof *m->rows);
            m->nearest[to] = m->nearest[from];
            again = true;
        }
    }
    for (size_t t = 0; t < n; t++)
        if (!isfinite(m->nearest[t])) memcpy(m->rows + t * k, spare, k * sizeof *spare);
}

void tli_means_set(tli_means *m, const tl_lidx *opposite, const double *spare)
{
    const size_t k = m->plan->tet_comps;
    for (size_t f = 0; f < m->plan->field_count; f++) {
        const tli_field *field = &m->plan->fields[f];
        if (field->on != TL_ON_TET || field->scalar < TL_F32) continue;
        for (size_t t = 0; t < m->mesh->tet_count; t++)
            for (size_t c = t * k + field->first; c < t * k + field->first + field->components;
                 c++) {
                const double mean = m->sums[c] / m->volumes[c];
                if (m->volumes[c] > 0 && isfinite(mean)) m->rows[c] = mean;
            }
    }
    spread(m, opposite, spare);
}
