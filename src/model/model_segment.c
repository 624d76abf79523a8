/* One segment: its patches are welded and simplified with what others share locked; values are
 * fitted to the originals, rounded as they will be decoded and measured; the result is cut into
 * patches of the next level, to which the originals go. */
#include <math.h>
#include <string.h>

#include "model/model.h"
#include "model/model_boundary.h"
#include "model/model_space.h"

/* Part of its tets that every segment keeps, whatever the costs say: a patch needs a face. */
static const double LEAST_LEFT = 0.1;
/* Part of its volume that a segment may gain or lose: over ten levels less than the 0.5 % that
 * `check` allows. */
static const double VOLUME_PART = 3e-4;

typedef struct job {
    tl_ctx *ctx;
    const tli_level *level;
    const tli_plan *plan;
    const tli_segment_note *segment;
    tli_weld weld;
    tli_piece_result piece;
    tl_lidx *opposite;
    tli_tape tets[TLI_KINDS]; /* of the new mesh that hold the records, one after another */
    double *mesh_values;      /* [vert_count][vert_comps] of the new mesh */
    double *sums, *volumes;   /* [tet_count]: for the means of channels on tets */
    tli_fit *fit;
    uint32_t *part;
    tl_lidx *tet_local;
    tli_carrier carrier;
    tli_errors *errors; /* one a thread */
    tli_boundary boundary;
    tli_dealer dealer;
    tli_product *product;
    int kind;
} job;

/* ---- simplification ---- */

static tl_status simplify(job *j, double cost_max, size_t target)
{
    const tli_plan *plan = j->plan;
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.target_tets = target ? target : 1;
    opts.boundary_error = j->level->boundary_error;
    opts.channels = plan->steering;
    opts.channel_count = plan->steering_count;
    opts.locked = j->weld.locked;
    tli_piece piece = {.mesh = j->weld.mesh,
                       .opts = &opts,
                       .channel_scales = plan->steering_scales,
                       .scale = plan->diagonal > 0 ? 1 / plan->diagonal : 1,
                       .cost_max = cost_max,
                       .volume_part = VOLUME_PART,
                       .steps = j->weld.steps,
                       .quadrics = j->weld.quadrics,
                       .shares = j->weld.shares,
                       .surface_bounds = j->weld.surface};
    return tli_piece_simplify(j->ctx, &piece, &j->piece);
}

tl_status tli_segment_probe(tl_ctx *ctx, const tli_level *level, const tli_segment_note *segment,
                            double costs[TLI_CURVE_POINTS], size_t *tets)
{
    job j = {.ctx = ctx, .level = level, .plan = level->model->plan, .segment = segment};
    tl_status st = tli_weld_create(ctx, level, segment, &j.weld);
    if (!st) {
        *tets = j.weld.mesh->tet_count;
        st = simplify(&j, (double)INFINITY, (size_t)(0.6 * level->ratio * (double)*tets));
    }
    if (!st) memcpy(costs, j.piece.costs, sizeof j.piece.costs);
    tli_piece_release(ctx, &j.piece);
    tli_weld_release(ctx, &j.weld);
    return st;
}

/* ---- the originals, first time: where they are, and what the values should be ---- */

/* In the star of the corner of its tet that is nearest to it, of those that are left; searched from
 * the other corners, too, before it is said not to be near: a search that begins elsewhere may end
 * on the other side of a gap. */
static bool place_near(const job *j, uint32_t input, const double *record, size_t doubles,
                       tl_lidx *tet, double weights[4])
{
    const tl_mesh *old = j->weld.mesh;
    const tl_lidx *q = old->tets + 4 * (j->weld.tet_base[input] + tli_record_tet(record, doubles));
    double d2[4] = {0}, distance;
    for (size_t i = 0; i < 4; i++) {
        const double *x = old->xyz + 3 * (size_t)q[i];
        for (int k = 0; k < 3; k++) d2[i] += (x[k] - record[k]) * (x[k] - record[k]);
        if (j->piece.hints[q[i]] == TL_NONE) d2[i] = (double)INFINITY;
    }
    for (;;) {
        size_t i = 0;
        for (size_t k = 1; k < 4; k++)
            if (d2[k] < d2[i]) i = k;
        if (!(d2[i] < (double)INFINITY)) return false;
        d2[i] = (double)INFINITY;
        if (tli_carrier_near(&j->carrier, record, j->piece.hints[q[i]], tet, weights, &distance))
            return true;
    }
}

static tl_status place_window(void *user, tli_record_window *w, unsigned worker)
{
    const job *j = user;
    size_t doubles = tli_record_doubles(j->plan, j->kind);
    (void)worker;
    for (size_t r = 0; r < w->count; r++) {
        const double *record = w->records + r * doubles;
        if (place_near(j, w->input, record, doubles, &w->tets[r], w->weights[r])) continue;
        w->tets[r] = TL_NONE;
        w->left++;
    }
    return TL_OK;
}

static tl_status survey(void *user)
{
    return tli_carrier_survey(&((job *)user)->carrier);
}

static tl_status find_left(void *user, tli_record_window *w, unsigned worker)
{
    const job *j = user;
    size_t doubles = tli_record_doubles(j->plan, j->kind);
    tl_status st = TL_OK;
    double distance;
    (void)worker;
    for (size_t r = 0; !st && r < w->count; r++)
        if (w->tets[r] == TL_NONE)
            st = tli_carrier_find(&j->carrier, w->records + r * doubles, &w->tets[r], w->weights[r],
                                  &distance);
    return st;
}

static void add_mean(job *j, tl_lidx tet, double volume, const double *values)
{
    j->volumes[tet] += volume;
    for (size_t k = 0; k < j->plan->tet_comps; k++)
        j->sums[tet * j->plan->tet_comps + k] += volume * values[k];
}

static tl_status add_window(void *user, tli_record_window *w)
{
    job *j = user;
    size_t doubles = tli_record_doubles(j->plan, j->kind);
    tl_status st = TL_OK;
    for (size_t r = 0; !st && r < w->count; r++) {
        const double *record = w->records + r * doubles;
        st = tli_tape_write(&j->tets[j->kind], w->tets[r]);
        if (j->kind == TLI_POINTS)
            tli_fit_add(j->fit, w->tets[r], w->weights[r], record + 3, j->mesh_values);
        else
            add_mean(j, w->tets[r], record[3], record + 4);
    }
    return st;
}

/* Between the channels of the new mesh and rows of values. */
static void copy_values(job *j, bool to_mesh)
{
    tl_mesh *mesh = j->piece.mesh;
    for (size_t i = 0; i < j->plan->field_count; i++) {
        const tli_field *f = &j->plan->fields[i];
        if (f->on != TL_ON_VERTEX) continue;
        double *values = (double *)(uintptr_t)mesh->channels[i].values;
        for (size_t v = 0; v < mesh->vert_count; v++) {
            double *row = j->mesh_values + v * j->plan->vert_comps + f->first;
            double *own = values + v * f->components;
            memcpy(to_mesh ? own : row, to_mesh ? row : own, f->components * sizeof *own);
        }
    }
}

/* Rounds the fitted values; quadrics follow the values that they are anchored at. */
static void round_values(job *j)
{
    const tl_mesh *mesh = j->piece.mesh;
    double shift[256];
    for (size_t v = 0; v < mesh->vert_count; v++) {
        size_t n = 0;
        bool moved = false;
        if (j->piece.fixed[v]) continue;
        for (size_t i = 0; i < j->plan->field_count; i++) {
            const tli_field *f = &j->plan->fields[i];
            if (f->on != TL_ON_VERTEX) continue;
            double *row = j->mesh_values + v * j->plan->vert_comps + f->first;
            for (uint32_t k = 0; k < f->components; k++) {
                double before = mesh->channels[i].values[v * f->components + k];
                row[k] = tli_field_round(f, row[k]);
                if (!f->steers) continue;
                shift[n] = isfinite(row[k] - before) ? (row[k] - before) * f->scale : 0;
                moved |= shift[n++] != 0;
            }
        }
        if (moved) tli_piece_reanchor(j->piece.quadrics + v * j->piece.quadric_floats, shift, n);
    }
}

/* Means of the originals' values; a tet without any keeps that of the tet it was. */
static void set_means(job *j)
{
    const tl_mesh *mesh = j->piece.mesh;
    for (size_t i = 0; i < j->plan->field_count; i++) {
        const tli_field *f = &j->plan->fields[i];
        if (f->on != TL_ON_TET || f->scalar < TL_F32) continue;
        double *values = (double *)(uintptr_t)mesh->channels[i].values;
        for (size_t t = 0; t < mesh->tet_count; t++)
            for (uint32_t k = 0; k < f->components && j->volumes[t] > 0; k++) {
                double mean = j->sums[t * j->plan->tet_comps + f->first + k] / j->volumes[t];
                if (isfinite(mean)) values[t * f->components + k] = tli_field_round(f, mean);
            }
    }
}

static tl_status set_values(job *j)
{
    tl_status st = TL_OK;
    tl_mesh *mesh = j->piece.mesh;
    const tli_model *model = j->level->model;
    tli_depot *from = model->carried[j->level->level & 1];
    const tli_pass pass = {
        .work = place_window, .look = survey, .again = find_left, .after = add_window, .user = j};
    j->mesh_values =
        tl_mem_alloc(j->ctx, mesh->vert_count * j->plan->vert_comps, sizeof *j->mesh_values, &st);
    j->sums = tl_mem_zalloc(j->ctx, mesh->tet_count * j->plan->tet_comps, sizeof *j->sums, &st);
    j->volumes = tl_mem_zalloc(j->ctx, mesh->tet_count, sizeof *j->volumes, &st);
    if (!st) st = tli_fit_create(j->ctx, mesh, j->plan->vert_comps, &j->fit);
    if (!st) copy_values(j, false);
    for (j->kind = 0; !st && j->kind <= TLI_CELLS; j->kind++) {
        st = tli_tape_open(j->ctx, model->tapes, &j->tets[j->kind]);
        if (!st) st = tli_records_read(j->ctx, model, from, j->segment, j->kind, &pass);
    }
    if (!st) {
        tli_fit_solve(j->fit, j->piece.fixed, j->mesh_values);
        round_values(j);
        copy_values(j, true);
        set_means(j);
    }
    return st;
}

/* ---- second time: what is off, and where they go ---- */

static tl_status take_tets(void *user, tli_record_window *w)
{
    job *j = user;
    tl_status st = TL_OK;
    for (size_t r = 0; !st && r < w->count; r++) st = tli_tape_read(&j->tets[j->kind], &w->tets[r]);
    return st;
}

static tl_status measure_window(void *user, tli_record_window *w, unsigned worker)
{
    const job *j = user;
    size_t doubles = tli_record_doubles(j->plan, j->kind);
    tli_carrier carrier = j->carrier;
    carrier.errors = &j->errors[worker];
    for (size_t r = 0; r < w->count; r++) {
        const double *x = w->records + r * doubles;
        double weights[4], distance;
        tl_lidx tet = w->tets[r];
        tli_carrier_weigh(&carrier, x, tet, weights, &distance);
        tli_carrier_measure(&carrier, j->kind, x, tet, weights, distance,
                            w->sums + j->part[tet] * j->plan->field_count);
        for (int k = 0; k < 3; k++) {
            if (x[k] < w->box[2 * k]) w->box[2 * k] = x[k];
            if (x[k] > w->box[2 * k + 1]) w->box[2 * k + 1] = x[k];
        }
    }
    return TL_OK;
}

static tl_status deal_window(void *user, tli_record_window *w)
{
    job *j = user;
    tli_product *p = j->product;
    tl_status st = TL_OK;
    size_t doubles = tli_record_doubles(j->plan, j->kind), fields = j->plan->field_count;
    for (size_t i = 0; i < p->patch_count * fields; i++)
        p->patches[i / fields].squares[i % fields] += w->sums[i];
    for (int k = 0; k < 3; k++) {
        p->box[2 * k] = fmin(p->box[2 * k], w->box[2 * k]);
        p->box[2 * k + 1] = fmax(p->box[2 * k + 1], w->box[2 * k + 1]);
    }
    for (size_t r = 0; !st && r < w->count; r++)
        st = tli_dealer_add(&j->dealer, j->part[w->tets[r]], w->records + r * doubles,
                            j->tet_local[w->tets[r]]);
    return st;
}

/* What each thread finds, in the end the largest of all. */
static tl_status open_errors(job *j)
{
    tl_status st = TL_OK;
    unsigned count = tl_ctx_thread_count(j->ctx);
    j->errors = tl_mem_zalloc(j->ctx, count, sizeof *j->errors, &st);
    for (unsigned i = 0; !st && i < count; i++)
        st = tli_errors_create(j->ctx, j->plan, &j->errors[i]);
    return st;
}

static void close_errors(job *j)
{
    for (unsigned i = 0; j->errors && i < tl_ctx_thread_count(j->ctx); i++) {
        if (j->errors[i].space) tli_errors_join(j->plan, &j->errors[i], &j->product->errors);
        tli_errors_release(j->ctx, &j->errors[i]);
    }
    tl_mem_free(j->ctx, j->errors);
}

static tl_status deal(job *j)
{
    tl_status st = TL_OK;
    tli_model *model = j->level->model;
    tli_depot *from = model->carried[j->level->level & 1],
              *to = model->carried[(j->level->level + 1) & 1];
    const tli_pass pass = {.before = take_tets,
                           .work = measure_window,
                           .after = deal_window,
                           .user = j,
                           .sum_count = j->product->patch_count * j->plan->field_count};
    st = tli_space_open(&j->carrier);
    if (!st) st = open_errors(j);
    for (j->kind = 0; !st && j->kind <= TLI_CELLS; j->kind++) {
        st = tli_tape_rewind(&j->tets[j->kind]);
        if (st) break;
        st = tli_dealer_open(j->ctx, model, to, j->product->patches, j->product->patch_count,
                             j->kind, &j->dealer);
        if (!st) st = tli_records_read(j->ctx, model, from, j->segment, j->kind, &pass);
        st = tli_dealer_close(&j->dealer, st);
    }
    close_errors(j);
    return st;
}

/* What stands for the original boundary goes to the new patches. Those of one cell come together
 * again in the next level, so that pieces need no cuts between them. */
static tl_status deal_boundary(job *j)
{
    tl_status st = TL_OK;
    tli_model *model = j->level->model;
    size_t count = j->product->patch_count;
    uint32_t *label = tl_mem_alloc(j->ctx, count, sizeof *label, &st);
    for (size_t p = 0; !st && p < count; p++) {
        j->product->patches[p].spread = j->boundary.spread_after;
        label[p] = j->level->parts_meet ? j->product->patches[p].cell : (uint32_t)p;
    }
    if (!st) {
        st = tli_dealer_open(j->ctx, model, model->carried[(j->level->level + 1) & 1],
                             j->product->patches, count, TLI_FACES, &j->dealer);
        if (!st) st = tli_boundary_deal(&j->boundary, j->part, label, &j->dealer);
        st = tli_dealer_close(&j->dealer, st);
    }
    tl_mem_free(j->ctx, label);
    return st;
}

/* How far the boundary is off: what was measured or what the collapses say, whichever is less.
 * Interfaces are not measured, so that at their vertices the collapses have the say. */
static tl_status measure_boundary(job *j)
{
    double says = 0;
    size_t n = j->piece.mesh->vert_count;
    tl_status st = tli_boundary_measure(j->ctx, j->level, j->segment, &j->weld, &j->piece,
                                        j->opposite, &j->boundary);
    if (st) return st;
    for (size_t v = 0; v < n; v++) says = fmax(says, (double)j->piece.surface_bounds[v]);
    if (says < j->boundary.error) j->boundary.error = says;
    j->product->errors.surface = j->boundary.error;
    float most = nextafterf((float)j->boundary.error, INFINITY);
    for (size_t v = 0; !j->plan->has_regions && v < n; v++)
        if (most < j->piece.surface_bounds[v]) j->piece.surface_bounds[v] = most;
    return TL_OK;
}

/* Parts of the new mesh: pieces of the cells of the next partition, or of itself. */
static tl_status cut_parts(job *j, uint32_t **part_cells)
{
    tl_status st = TL_OK;
    const tl_mesh *mesh = j->piece.mesh;
    const tli_cells *cells = j->level->cells;
    size_t part_tets = j->plan->opts.patch_tets, *count = &j->product->patch_count;
    *part_cells = NULL;
    if (!cells)
        return tli_split(j->ctx, mesh->xyz, mesh->tets, mesh->tet_count, part_tets, j->part, count);
    uint32_t *cell_of = tl_mem_alloc(j->ctx, mesh->tet_count, sizeof *cell_of, &st);
    if (!st) st = tli_cells_find(j->ctx, cells, mesh, cell_of);
    if (!st)
        st = tli_split_cells(j->ctx, mesh, j->opposite, cell_of, part_tets, j->part, count,
                             part_cells);
    tl_mem_free(j->ctx, cell_of);
    return st;
}

static tl_status write_patches(job *j)
{
    uint32_t *part_cells = NULL;
    const tl_mesh *mesh = j->piece.mesh;
    tli_product *p = j->product;
    tl_status st = TL_OK;
    uint64_t *ids = tl_mem_alloc(j->ctx, mesh->vert_count, sizeof *ids, &st);
    uint8_t *outside = tl_mem_alloc(j->ctx, mesh->vert_count, sizeof *outside, &st);
    uint8_t *twins = tl_mem_alloc(j->ctx, mesh->vert_count, sizeof *twins, &st);
    j->part = tl_mem_alloc(j->ctx, mesh->tet_count, sizeof *j->part, &st);
    j->tet_local = tl_mem_alloc(j->ctx, mesh->tet_count, sizeof *j->tet_local, &st);
    for (size_t v = 0; !st && v < mesh->vert_count; v++) {
        ids[v] = j->weld.ids[j->piece.origins[v]];
        outside[v] = j->weld.locked[j->piece.origins[v]];
        twins[v] = j->weld.twins[j->piece.origins[v]];
    }
    if (!st) st = cut_parts(j, &part_cells);
    p->patches = tl_mem_zalloc(j->ctx, p->patch_count, sizeof *p->patches, &st);
    if (st) p->patch_count = 0;
    tli_cut cut = {.mesh = mesh,
                   .ids = ids,
                   .steps = j->piece.steps,
                   .quadrics = j->piece.quadrics,
                   .surface = j->piece.surface_bounds,
                   .twins = twins,
                   .outside = outside,
                   .outer = j->boundary.outer,
                   .part = j->part,
                   .part_count = p->patch_count,
                   .tet_local = j->tet_local};
    if (!st) st = tli_cut_write(j->ctx, j->level->model, &cut, p->patches, &p->shared);
    for (size_t i = 0; !st && i < p->patch_count; i++)
        p->patches[i].cell = part_cells ? part_cells[i] : TL_NONE;
    tl_mem_free(j->ctx, part_cells);
    tl_mem_free(j->ctx, twins);
    tl_mem_free(j->ctx, outside);
    tl_mem_free(j->ctx, ids);
    return st;
}

static void release_job(job *j)
{
    tl_ctx *ctx = j->ctx;
    tli_carrier_close(&j->carrier);
    tli_fit_destroy(j->fit);
    void *blocks[] = {j->tet_local, j->part, j->volumes, j->sums, j->mesh_values, j->opposite};
    for (int k = 0; k < TLI_KINDS; k++) tli_tape_close(&j->tets[k]);
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    tli_boundary_release(&j->boundary);
    tli_piece_release(ctx, &j->piece);
    tli_weld_release(ctx, &j->weld);
}

tl_status tli_segment_process(tl_ctx *ctx, const tli_level *level, const tli_segment_note *segment,
                              tli_product *product)
{
    job j = {.ctx = ctx,
             .level = level,
             .plan = level->model->plan,
             .segment = segment,
             .product = product};
    *product = (tli_product){0};
    tl_status st = tli_errors_create(ctx, j.plan, &product->errors);
    for (int k = 0; k < 3; k++) {
        product->box[2 * k] = (double)INFINITY;
        product->box[2 * k + 1] = (double)-INFINITY;
    }
    if (!st) st = tli_weld_create(ctx, level, segment, &j.weld);
    if (!st) {
        product->input_tets = j.weld.mesh->tet_count;
        bool by_cost = isfinite(level->cost_max);
        double least = by_cost ? LEAST_LEFT : level->ratio;
        st = simplify(&j, level->cost_max, (size_t)(least * (double)product->input_tets));
    }
    if (!st) st = tl_mesh_adjacency(ctx, j.piece.mesh, &j.opposite, NULL);
    if (!st)
        st = tli_carrier_open(ctx, j.plan, j.piece.mesh, j.opposite, &product->errors, &j.carrier);
    if (!st) st = measure_boundary(&j);
    if (!st) st = set_values(&j);
    if (!st) st = write_patches(&j);
    if (!st)
        st = tli_seam_put(ctx, level->model->seam_files[(level->level + 1) & 1], &product->shared,
                          &product->seam);
    if (!st) st = deal_boundary(&j);
    if (!st) st = deal(&j);
    if (!st) product->output_tets = j.piece.mesh->tet_count;
    release_job(&j);
    if (st) tli_product_release(ctx, product);
    return st;
}
