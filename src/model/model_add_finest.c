/* The finest level of channels that are added: values of the originals, as they will be decoded,
 * and what that is off by. What all levels need of a patch of the file stands here, too. */
#include <math.h>

#include "model/model_add.h"
#include "store/store_format.h"

/* ---- patches of the file ---- */

tl_status tli_added_patch_load(tl_ctx *ctx, const tli_adder *a, uint32_t patch,
                               tli_added_patch *out)
{
    tli_twin *twins = NULL;
    size_t twin_count = 0, twin = 0;
    *out = (tli_added_patch){0};
    tl_status st = tl_store_topology(ctx, a->store, patch, &out->patch);
    if (!st) st = tli_store_twins(ctx, a->store, patch, &twins, &twin_count);
    const size_t count = st ? 0 : out->patch->vert_count;
    out->ids = tl_mem_alloc(ctx, count, sizeof *out->ids, &st);
    for (uint32_t v = 0; !st && v < count; v++) {
        uint8_t bytes[24];
        uint64_t seed = 0;
        memcpy(bytes, out->patch->places[v], sizeof bytes);
        if (twin < twin_count && twins[twin].vert == v) seed = twins[twin++].twin;
        out->ids[v] = tli_store_hash(seed, bytes, sizeof bytes);
    }
    tl_mem_free(ctx, twins);
    if (st) tli_added_patch_release(ctx, out);
    return st;
}

void tli_added_patch_release(tl_ctx *ctx, tli_added_patch *p)
{
    tl_mem_free(ctx, p->ids);
    tl_patch_destroy(ctx, p->patch);
    *p = (tli_added_patch){0};
}

tl_status tli_added_mesh(tl_ctx *ctx, const tli_plan *plan, double *xyz, size_t vert_count,
                         tl_lidx *tets, size_t tet_count, tl_mesh **mesh)
{
    tl_status st = tl_mesh_adopt(ctx, xyz, vert_count, tets, tet_count, mesh);
    if (st) {
        tl_mem_free(ctx, tets);
        tl_mem_free(ctx, xyz);
        return st;
    }
    for (size_t i = 0; !st && i < plan->field_count; i++) {
        const tli_field *f = &plan->fields[i];
        const size_t count = f->on == TL_ON_VERTEX ? vert_count : tet_count;
        double *values = tl_mem_zalloc(ctx, count * f->components, sizeof *values, &st);
        tl_channel channel = {f->key, f->unit, f->components, f->on, TL_F64, values};
        if (!st) st = tl_mesh_adopt_channel(*mesh, &channel);
        if (st) tl_mem_free(ctx, values);
    }
    return st;
}

void tli_added_values(const tli_plan *plan, const double *rows, tl_mesh *mesh)
{
    for (size_t i = 0; i < plan->field_count; i++) {
        const tli_rows from = tli_rows_of(plan, i, mesh->vert_count, mesh->tet_count);
        const uint32_t k = plan->fields[i].components;
        double *values = (double *)(uintptr_t)mesh->channels[i].values;
        for (size_t e = 0; e < from.count; e++)
            memcpy(values + e * k, rows + from.first + e * from.stride, k * sizeof *values);
    }
}

void tli_added_round(const tli_plan *plan, const uint8_t *fixed, size_t vert_count,
                     size_t tet_count, double *rows)
{
    for (size_t i = 0; i < plan->field_count; i++) {
        const tli_field *f = &plan->fields[i];
        const tli_rows of = tli_rows_of(plan, i, vert_count, tet_count);
        for (size_t e = 0; e < of.count; e++) {
            double *row = rows + of.first + e * of.stride;
            if (fixed && f->on == TL_ON_VERTEX && fixed[e]) continue;
            for (uint32_t c = 0; c < f->components; c++) row[c] = tli_field_round(f, row[c]);
        }
    }
}

tl_status tli_added_put(tl_ctx *ctx, tli_adder *a, uint32_t patch, const tl_patch *topology,
                        const double *rows)
{
    tl_status st = TL_OK;
    const tli_plan *plan = a->plan;
    tli_patch_note *note = &a->model->patches[patch];
    note->ranges = tl_mem_alloc(ctx, plan->field_count, 2 * sizeof *note->ranges, &st);
    for (size_t i = 0; !st && i < plan->field_count; i++) {
        const tli_rows of = tli_rows_of(plan, i, topology->vert_count, topology->tet_count);
        const uint32_t components = plan->fields[i].components;
        double *range = note->ranges + 2 * i;
        range[0] = range[1] = (double)NAN;
        for (size_t e = 0; e < of.count; e++) {
            const double *row = rows + of.first + e * of.stride;
            double value = row[0], sum = 0;
            for (uint32_t k = 0; components > 1 && k < components; k++) sum += row[k] * row[k];
            if (components > 1) value = sqrt(sum);
            if (!isfinite(value)) continue;
            range[0] = fmin(range[0], value);
            range[1] = fmax(range[1], value);
        }
    }
    if (!st)
        st = tli_depot_put(ctx, a->model->meshes, rows,
                           tli_row_doubles(plan, topology->vert_count, topology->tet_count) *
                               sizeof *rows,
                           &note->ofs);
    return st;
}

/* ---- one patch of the finest level ---- */

typedef struct job {
    tl_ctx *ctx;
    tli_adder *a;
    const tli_plan *plan;
    uint32_t rank, id;
    tl_patch *patch;
    tli_matches matches;
    uint8_t *cells; /* [cell_count] tli_cell_match */
    size_t cell_count;
    double *rows;    /* of the patch */
    tl_lidx *tet_of; /* [vert_count] */
    tl_mesh *mesh;
    tli_errors errors;
} job;

static const tli_cell_match *cell_at(const job *j, size_t i)
{
    return (const void *)(j->cells + i * tli_cell_match_bytes(j->plan));
}

/* Each vertex takes the nearest of its originals, each tet its own, rounded. */
static void take_values(job *j)
{
    const tli_plan *plan = j->plan;
    double *row = j->rows, *tet_rows = j->rows + j->patch->vert_count * plan->vert_comps;
    for (size_t v = 0; v < j->patch->vert_count; v++, row += plan->vert_comps)
        memcpy(row, tli_match_at(plan, &j->matches, j->matches.nearest[v])->values,
               plan->vert_comps * sizeof *row);
    for (size_t i = 0; i < j->cell_count; i++) {
        const tli_cell_match *m = cell_at(j, i);
        memcpy(tet_rows + m->local * plan->tet_comps, m->record + 4, plan->tet_comps * sizeof *row);
    }
    tli_added_round(plan, NULL, j->patch->vert_count, j->patch->tet_count, j->rows);
}

static tl_status make_mesh(job *j)
{
    tl_status st = TL_OK;
    const tl_patch *p = j->patch;
    double *xyz = tl_mem_alloc(j->ctx, p->vert_count, 3 * sizeof *xyz, &st);
    tl_lidx *tets = tl_mem_alloc(j->ctx, p->tet_count, 4 * sizeof *tets, &st);
    for (size_t v = 0; !st && v < p->vert_count; v++)
        tl_lattice_xyz(&j->a->head->lattice, p->places[v], xyz + 3 * v);
    for (size_t t = 0; !st && t < p->tet_count; t++)
        for (size_t c = 0; c < 4; c++) {
            tets[4 * t + c] = p->tets[t][c];
            j->tet_of[p->tets[t][c]] = (tl_lidx)t;
        }
    if (st) {
        tl_mem_free(j->ctx, tets);
        tl_mem_free(j->ctx, xyz);
        return st;
    }
    st = tli_added_mesh(j->ctx, j->plan, xyz, p->vert_count, tets, p->tet_count, &j->mesh);
    if (!st) tli_added_values(j->plan, j->rows, j->mesh);
    return st;
}

static tl_status carry_point(job *j, tli_carrier *carrier, const tli_match *m, double *record,
                             tli_dealer *dealer)
{
    double w[4], distance;
    tl_lidx tet;
    if (!m->carries) return TL_OK;
    memcpy(record, m->xyz, sizeof m->xyz);
    memcpy(record + 3, m->values, tli_match_bytes(j->plan) - sizeof *m);
    tl_status st = tli_carrier_locate(carrier, record, j->tet_of[m->local], &tet, w, &distance);
    if (st) return st;
    tli_carrier_measure(carrier, TLI_POINTS, record, tet, w, distance,
                        j->a->model->patches[j->id].squares);
    return tli_dealer_add(dealer, 0, record, tet);
}

/* A centroid without a place is not measured, as in a build. */
static tl_status carry_cell(job *j, tli_carrier *carrier, const tli_cell_match *m,
                            tli_dealer *dealer)
{
    double w[4], distance;
    tl_lidx tet;
    if (!isfinite(m->record[0] + m->record[1] + m->record[2])) return TL_OK;
    tl_status st = tli_carrier_locate(carrier, m->record, (tl_lidx)m->local, &tet, w, &distance);
    if (st) return st;
    tli_carrier_measure(carrier, TLI_CELLS, m->record, tet, w, distance,
                        j->a->model->patches[j->id].squares);
    return tli_dealer_add(dealer, 0, m->record, tet);
}

/* The originals of a kind that go by way of this patch. */
static tl_status carry(job *j, int kind)
{
    tl_status st = TL_OK;
    tli_patch_note *note = &j->a->model->patches[j->id];
    tli_carrier carrier = {.ctx = j->ctx,
                           .plan = j->plan,
                           .mesh = j->mesh,
                           .opposite = &j->patch->opposite[0][0],
                           .errors = &j->errors};
    tli_dealer dealer = {0};
    const bool is_point = kind == TLI_POINTS;
    const size_t count = is_point ? j->matches.count : j->cell_count;
    if (!is_point && !j->plan->tet_comps) return TL_OK;
    double *record = tl_mem_alloc(j->ctx, tli_record_doubles(j->plan, kind), sizeof *record, &st);
    if (!st)
        st = tli_dealer_open(j->ctx, j->a->model, j->a->model->carried[0], note, 1, kind, &dealer);
    for (size_t i = 0; !st && i < count; i++)
        st = is_point
                 ? carry_point(j, &carrier, tli_match_at(j->plan, &j->matches, i), record, &dealer)
                 : carry_cell(j, &carrier, cell_at(j, i), &dealer);
    st = tli_dealer_close(&dealer, st);
    tl_locator_destroy(carrier.locator);
    tl_mem_free(j->ctx, record);
    return st;
}

static tl_status process(tl_ctx *ctx, tli_adder *a, uint32_t rank)
{
    job j = {.ctx = ctx, .a = a, .plan = a->plan, .rank = rank, .id = a->finest[rank]};
    tl_status st = tl_store_topology(ctx, a->store, j.id, &j.patch);
    if (st) return st;
    const size_t verts = j.patch->vert_count;
    tli_patch_note *note = &a->model->patches[j.id];
    if (a->plan->tet_comps) j.cell_count = (size_t)a->cells.counts[rank];
    j.cells = tl_mem_alloc(ctx, j.cell_count, tli_cell_match_bytes(a->plan), &st);
    j.rows =
        tl_mem_alloc(ctx, tli_row_doubles(a->plan, verts, j.patch->tet_count), sizeof *j.rows, &st);
    j.tet_of = tl_mem_alloc(ctx, verts, sizeof *j.tet_of, &st);
    note->squares = tl_mem_zalloc(ctx, a->plan->field_count, sizeof *note->squares, &st);
    if (!st) st = tli_matches_read(ctx, a, rank, j.patch, &j.matches);
    if (!st && j.cell_count) st = tli_bins_read(ctx, &a->cells, rank, j.cells);
    if (!st) st = tli_errors_create(ctx, a->plan, &j.errors);
    if (!st) take_values(&j);
    if (!st) st = make_mesh(&j);
    for (int kind = 0; !st && kind <= TLI_CELLS; kind++) st = carry(&j, kind);
    if (!st) st = tli_added_put(ctx, a, j.id, j.patch, j.rows);
    if (!st)
        memcpy(a->leaf_errors + rank * a->plan->field_count, j.errors.max,
               a->plan->field_count * sizeof *j.errors.max);
    tli_errors_release(ctx, &j.errors);
    tli_matches_release(ctx, &j.matches);
    tl_mesh_destroy(j.mesh);
    void *blocks[] = {j.tet_of, j.rows, j.cells};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    tl_patch_destroy(ctx, j.patch);
    return st;
}

static tl_status process_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    tli_adder *a = arg;
    tl_ctx *ctx = NULL;
    tl_status st = tli_ctx_fork(a->ctx, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) st = process(ctx, a, (uint32_t)i);
    return tli_ctx_join(a->ctx, ctx, st);
}

tl_status tli_adder_begin(tli_adder *a)
{
    tl_status st = TL_OK;
    const size_t fields = a->plan->field_count;
    a->leaf_errors = tl_mem_zalloc(a->ctx, a->finest_count * fields, sizeof *a->leaf_errors, &st);
    if (!st) st = tli_parallel(a->ctx, a->finest_count, 1, process_range, a);
    for (size_t r = 0; !st && r < a->finest_count; r++)
        for (size_t f = 0; f < fields; f++)
            a->plan->fields[f].leaf_error =
                fmax(a->plan->fields[f].leaf_error, a->leaf_errors[r * fields + f]);
    return st;
}
