/* Channels that are added, above the finest level: the meshes of a segment's outputs are as they
 * are; the originals that its inputs carry are located in them, values are fitted to these, rounded
 * and measured, and the originals go on. What other segments hold keeps its value. */
#include <math.h>
#include <stdlib.h>

#include "base/base_sort.h"
#include "model/model_add.h"
#include "model/model_space.h"

enum { BINS = 64, BOX_VERTICES = 1 << 16, SPREAD_MAX = 64 };

/* ---- vertices of several segments ---- */

/* Holders of shared vertices, on their way to bins. */
typedef struct gatherer {
    tli_bins bins;
    tli_locked_vertex *vertices, *sorted;
    uint32_t *keys, *places, *begins;
    size_t count;
} gatherer;

static tl_status flush(gatherer *g)
{
    if (!g->count) return TL_OK;
    tli_deal_alone(g->keys, g->count, BINS, g->begins, g->places);
    for (size_t i = 0; i < g->count; i++) g->sorted[g->places[i]] = g->vertices[i];
    g->count = 0;
    return tli_bins_add(&g->bins, g->sorted, g->begins);
}

static tl_status gather_patch(tli_adder *a, gatherer *g, uint32_t patch)
{
    tli_added_patch p;
    tl_status st = tli_added_patch_load(a->ctx, a, patch, &p);
    for (uint32_t v = 0; !st && v < p.patch->vert_count; v++) {
        if (!p.patch->shared[v]) continue;
        if (g->count == BOX_VERTICES) st = flush(g);
        g->keys[g->count] = (uint32_t)(p.ids[v] >> 32) % BINS;
        g->vertices[g->count++] =
            (tli_locked_vertex){p.ids[v], a->model->patches[patch].consumer, 0};
    }
    if (!st) tli_added_patch_release(a->ctx, &p);
    return st;
}

static int by_id(const void *x, const void *y)
{
    const tli_locked_vertex *a = x, *b = y;
    if (a->id != b->id) return (a->id > b->id) - (a->id < b->id);
    return (a->segments > b->segments) - (a->segments < b->segments);
}

/* Vertices of several segments go to each of them, once. */
static tl_status lock_bin(tli_adder *a, gatherer *g, uint32_t bin, tli_locked *locked)
{
    tl_status st = TL_OK;
    size_t n = (size_t)g->bins.counts[bin], kept = 0;
    tli_locked_vertex *all = tl_mem_alloc(a->ctx, n, sizeof *all, &st);
    uint32_t *segments = tl_mem_alloc(a->ctx, n, sizeof *segments, &st);
    if (!st) st = tli_bins_read(a->ctx, &g->bins, bin, all);
    if (!st) qsort(all, n, sizeof *all, by_id);
    for (size_t i = 0, end; !st && i < n; i = end) {
        for (end = i + 1; end < n && all[end].id == all[i].id; end++) {
        }
        if (all[i].segments == all[end - 1].segments) continue;
        uint64_t id = all[i].id;
        uint32_t before = TL_NONE;
        for (size_t k = i; k < end; k++) {
            uint32_t segment = all[k].segments;
            if (segment == before || segment == TL_NONE) continue;
            before = segments[kept] = segment;
            all[kept++] = (tli_locked_vertex){id, 2, 0};
        }
    }
    if (!st && kept) st = tli_locked_add(a->ctx, locked, all, segments, kept);
    tl_mem_free(a->ctx, segments);
    tl_mem_free(a->ctx, all);
    return st;
}

static tl_status lock_level(tli_adder *a, uint32_t level, tli_locked *locked)
{
    tl_status st = TL_OK;
    gatherer g = {0};
    st = tli_bins_open(a->ctx, a->plan->opts.folder, sizeof(tli_locked_vertex), BINS, &g.bins);
    g.vertices = tl_mem_alloc(a->ctx, BOX_VERTICES, sizeof *g.vertices, &st);
    g.sorted = tl_mem_alloc(a->ctx, BOX_VERTICES, sizeof *g.sorted, &st);
    g.keys = tl_mem_alloc(a->ctx, BOX_VERTICES, sizeof *g.keys, &st);
    g.places = tl_mem_alloc(a->ctx, BOX_VERTICES, sizeof *g.places, &st);
    g.begins = tl_mem_alloc(a->ctx, BINS + 1, sizeof *g.begins, &st);
    for (uint32_t p = 0; !st && p < a->head->patch_count; p++)
        if (a->model->patches[p].level == level) st = gather_patch(a, &g, p);
    if (!st) st = flush(&g);
    for (uint32_t bin = 0; !st && bin < BINS; bin++) st = lock_bin(a, &g, bin, locked);
    void *blocks[] = {g.begins, g.places, g.keys, g.sorted, g.vertices};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(a->ctx, blocks[i]);
    tli_bins_close(&g.bins);
    return st;
}

/* ---- one segment ---- */

typedef struct job {
    tl_ctx *ctx;
    tli_adder *a;
    const tli_plan *plan;
    uint32_t number;
    tli_segment_note *segment;
    tli_locked_vertex *locked; /* [locked_count] ascending */
    size_t locked_count;
    double *locked_rows;      /* [locked_count][vert_comps] */
    tli_added_patch *outputs; /* [output_count] */
    tl_lidx **verts;          /* [output_count][vert_count] of the mesh */
    tl_lidx *tet_base;        /* [output_count + 1] */
    tl_mesh *mesh;
    tl_lidx *opposite;
    uint8_t *fixed;
    double *rows;     /* of the mesh */
    double *weights;  /* [vert_count][vert_comps] */
    tl_lidx *tets[2]; /* of the mesh, by kind and number of the record */
    tl_lidx near;     /* where the last record was */
    tli_means means;
    int kind;
    tli_fit *fit;
    tli_carrier carrier;
    tli_patch_note *notes; /* [output_count] */
    tli_dealer dealer;
    double reach2; /* largest squared distance of a record from the centre of the sphere */
    double centre[3];
} job;

/* Values that the inputs have where other segments hold the vertex, too. */
static tl_status take_locked(job *j)
{
    tl_status st = TL_OK;
    const size_t k = j->plan->vert_comps;
    j->locked_rows = tl_mem_zalloc(j->ctx, j->locked_count * k, sizeof(double), &st);
    for (uint32_t i = 0; !st && j->locked_count && i < j->segment->input_count; i++) {
        const uint32_t id = j->segment->inputs[i];
        tli_added_patch p;
        st = tli_added_patch_load(j->ctx, j->a, id, &p);
        if (st) break;
        size_t n = p.patch->vert_count * k;
        double *rows = tl_mem_alloc(j->ctx, n, sizeof *rows, &st);
        if (!st)
            st = tli_depot_get(j->ctx, j->a->model->meshes, j->a->model->patches[id].ofs, rows,
                               n * sizeof *rows);
        for (uint32_t v = 0; !st && v < p.patch->vert_count; v++) {
            size_t at = p.patch->shared[v] ? tli_locked_find(j->locked, j->locked_count, p.ids[v])
                                           : SIZE_MAX;
            if (at != SIZE_MAX) memcpy(j->locked_rows + at * k, rows + v * k, k * sizeof *rows);
        }
        tl_mem_free(j->ctx, rows);
        tli_added_patch_release(j->ctx, &p);
    }
    return st;
}

/* Numbers the vertices of the outputs; those that several share once. */
static tl_status number_vertices(job *j, size_t *vert_count)
{
    tl_status st = TL_OK;
    const uint32_t outputs = j->segment->output_count;
    size_t shared = 0, n = 0, at = 0;
    for (uint32_t o = 0; o < outputs; o++)
        for (uint32_t v = 0; v < j->outputs[o].patch->vert_count; v++)
            shared += j->outputs[o].patch->shared[v];
    uint64_t *ids = tl_mem_alloc(j->ctx, shared, sizeof *ids, &st);
    uint32_t *order = tl_mem_alloc(j->ctx, shared, sizeof *order, &st);
    tl_lidx *number = tl_mem_alloc(j->ctx, shared, sizeof *number, &st);
    for (uint32_t o = 0; !st && o < outputs; o++)
        for (uint32_t v = 0; v < j->outputs[o].patch->vert_count; v++) {
            if (!j->outputs[o].patch->shared[v]) continue;
            ids[at] = j->outputs[o].ids[v];
            order[at] = (uint32_t)at;
            at++;
        }
    if (!st) st = tli_sort_u64(j->ctx, ids, order, shared);
    for (size_t i = 0; !st && i < shared; i++)
        number[order[i]] = i && ids[i] == ids[i - 1] ? number[order[i - 1]] : (tl_lidx)n++;
    for (uint32_t o = 0, s = 0; !st && o < outputs; o++) {
        const tl_patch *p = j->outputs[o].patch;
        j->verts[o] = tl_mem_alloc(j->ctx, p->vert_count, sizeof *j->verts[o], &st);
        for (uint32_t v = 0; !st && v < p->vert_count; v++)
            j->verts[o][v] = p->shared[v] ? number[s++] : (tl_lidx)n++;
    }
    *vert_count = n;
    tl_mem_free(j->ctx, number);
    tl_mem_free(j->ctx, order);
    tl_mem_free(j->ctx, ids);
    return st;
}

static tl_status load_outputs(job *j)
{
    tl_status st = TL_OK;
    const uint32_t count = j->segment->output_count;
    j->outputs = tl_mem_zalloc(j->ctx, count, sizeof *j->outputs, &st);
    j->verts = tl_mem_zalloc(j->ctx, count, sizeof *j->verts, &st);
    j->tet_base = tl_mem_zalloc(j->ctx, (size_t)count + 1, sizeof *j->tet_base, &st);
    for (uint32_t o = 0; !st && o < count; o++) {
        st = tli_added_patch_load(j->ctx, j->a, j->segment->outputs[o], &j->outputs[o]);
        if (!st) j->tet_base[o + 1] = j->tet_base[o] + j->outputs[o].patch->tet_count;
    }
    return st;
}

static tl_status make_mesh(job *j)
{
    size_t n = 0, m;
    const size_t k = j->plan->vert_comps;
    tl_status st = load_outputs(j);
    if (!st) st = number_vertices(j, &n);
    if (st) return st;
    m = j->tet_base[j->segment->output_count];
    double *xyz = tl_mem_alloc(j->ctx, n, 3 * sizeof *xyz, &st);
    tl_lidx *tets = tl_mem_alloc(j->ctx, m, 4 * sizeof *tets, &st);
    j->fixed = tl_mem_zalloc(j->ctx, n, 1, &st);
    j->rows = tl_mem_zalloc(j->ctx, tli_row_doubles(j->plan, n, m), sizeof *j->rows, &st);
    j->weights = tl_mem_zalloc(j->ctx, n * k, sizeof *j->weights, &st);
    for (uint32_t o = 0; !st && o < j->segment->output_count; o++) {
        const tl_patch *p = j->outputs[o].patch;
        for (uint32_t v = 0; v < p->vert_count; v++) {
            const size_t to = j->verts[o][v];
            size_t at = p->shared[v]
                            ? tli_locked_find(j->locked, j->locked_count, j->outputs[o].ids[v])
                            : SIZE_MAX;
            tl_lattice_xyz(&j->a->head->lattice, p->places[v], xyz + 3 * to);
            if (at == SIZE_MAX) continue;
            j->fixed[to] = 1;
            memcpy(j->rows + to * k, j->locked_rows + at * k, k * sizeof *j->rows);
        }
        for (uint32_t t = 0; t < p->tet_count; t++)
            for (int c = 0; c < 4; c++)
                tets[4 * (size_t)(j->tet_base[o] + t) + (size_t)c] = j->verts[o][p->tets[t][c]];
    }
    if (st) {
        tl_mem_free(j->ctx, tets);
        tl_mem_free(j->ctx, xyz);
        return st;
    }
    st = tli_added_mesh(j->ctx, j->plan, xyz, n, tets, m, &j->mesh);
    return st ? st : tl_mesh_adjacency(j->ctx, j->mesh, &j->opposite, NULL);
}

/* Records one after another, by number. A segment has one thread. */
typedef struct record_pass {
    job *j;
    tl_status (*fn)(job *j, size_t number, const double *record);
    size_t number;
} record_pass;

static tl_status nothing(void *user, tli_record_window *window, unsigned worker)
{
    (void)user;
    (void)window;
    (void)worker;
    return TL_OK;
}

static tl_status pass_window(void *user, tli_record_window *window)
{
    record_pass *p = user;
    tl_status st = TL_OK;
    const size_t doubles = tli_record_doubles(p->j->plan, p->j->kind);
    for (size_t r = 0; !st && r < window->count; r++)
        st = p->fn(p->j, p->number++, window->records + r * doubles);
    return st;
}

static tl_status pass_records(job *j, tl_status (*fn)(job *j, size_t number, const double *record))
{
    record_pass records = {j, fn, 0};
    tli_model *m = j->a->model;
    const tli_pass pass = {.work = nothing, .after = pass_window, .user = &records};
    return tli_records_read(j->ctx, m, m->carried[j->segment->level & 1], j->segment, j->kind,
                            &pass);
}

/* First time: where an original is, and its share of the first values. */
static tl_status place_record(job *j, size_t number, const double *record)
{
    double w[4], distance;
    tl_lidx tet;
    const size_t k = j->plan->vert_comps;
    tl_status st = tli_carrier_locate(&j->carrier, record, j->near, &tet, w, &distance);
    if (st) return st;
    j->near = j->tets[j->kind][number] = tet;
    if (j->kind == TLI_CELLS) tli_means_add(&j->means, tet, record);
    for (size_t c = 0; j->kind == TLI_POINTS && c < k; c++)
        for (size_t i = 0; i < 4 && isfinite(record[3 + c]); i++) {
            const size_t v = j->mesh->tets[4 * (size_t)tet + i];
            if (j->fixed[v]) continue;
            j->rows[v * k + c] += w[i] * record[3 + c];
            j->weights[v * k + c] += w[i];
        }
    return TL_OK;
}

/* The first values are means of what is around; vertices without any take those of neighbours. */
static void set_first_values(job *j)
{
    const size_t k = j->plan->vert_comps, n = j->mesh->vert_count;
    bool again = true;
    for (size_t i = 0; i < n * k; i++) {
        if (j->fixed[i / k]) j->weights[i] = 1;
        if (j->fixed[i / k] || !(j->weights[i] > 0)) continue;
        j->rows[i] /= j->weights[i];
    }
    for (int sweep = 0; again && sweep < SPREAD_MAX; sweep++) {
        again = false;
        for (size_t t = 0; t < j->mesh->tet_count; t++) {
            const tl_lidx *q = j->mesh->tets + 4 * t;
            for (size_t i = 0; i < 16; i++) {
                const size_t from = q[i / 4] * k, to = q[i % 4] * k;
                for (size_t c = 0; c < k; c++) {
                    if (j->weights[to + c] > 0 || !(j->weights[from + c] > 0)) continue;
                    j->rows[to + c] = j->rows[from + c];
                    j->weights[to + c] = 1;
                    again = true;
                }
            }
        }
    }
    for (size_t i = 0; i < n * k; i++)
        if (!(j->weights[i] > 0)) j->rows[i] = (double)NAN; /* no value near it is finite */
}

static tl_status fit_record(job *j, size_t number, const double *record)
{
    double w[4], distance;
    const tl_lidx tet = j->tets[TLI_POINTS][number];
    tli_carrier_weigh(&j->carrier, record, tet, w, &distance);
    tli_fit_add(j->fit, tet, w, record + 3, j->rows);
    return TL_OK;
}

/* Where the records of a kind are, and what the first values of vertices (all of tets) are. */
static tl_status place_records(job *j, int kind)
{
    tl_status st = TL_OK;
    uint64_t count = 0;
    for (uint32_t i = 0; i < j->segment->input_count; i++) {
        const tli_extents *e = &j->a->model->patches[j->segment->inputs[i]].extents[kind];
        for (size_t k = 0; k < e->count; k++) count += e->items[k].count;
    }
    j->tets[kind] = tl_mem_alloc(j->ctx, (size_t)count, sizeof *j->tets[kind], &st);
    j->near = TL_NONE;
    j->kind = kind;
    return st ? st : pass_records(j, place_record);
}

static tl_status set_means(job *j)
{
    const tli_plan *plan = j->plan;
    tl_status st = TL_OK;
    tl_patch_info info;
    const uint32_t input = j->segment->inputs[0];
    double *rows = j->rows + j->mesh->vert_count * plan->vert_comps;
    if (!plan->tet_comps) return TL_OK;
    double *spare = tl_mem_alloc(j->ctx, plan->tet_comps, sizeof *spare, &st);
    if (!st) st = tl_store_patch(j->ctx, j->a->store, input, &info);
    if (!st)
        st = tli_depot_get(j->ctx, j->a->model->meshes,
                           j->a->model->patches[input].ofs +
                               info.vert_count * plan->vert_comps * sizeof *spare,
                           spare, plan->tet_comps * sizeof *spare);
    if (!st) st = tli_means_open(j->ctx, plan, j->mesh, rows, &j->means);
    if (!st) st = place_records(j, TLI_CELLS);
    if (!st) tli_means_set(&j->means, j->opposite, spare);
    tli_means_close(&j->means);
    tl_mem_free(j->ctx, spare);
    return st;
}

static tl_status set_values(job *j)
{
    tl_status st = place_records(j, TLI_POINTS);
    if (!st) set_first_values(j);
    if (!st) st = tli_fit_create(j->ctx, j->mesh, j->plan->vert_comps, &j->fit);
    if (!st) st = pass_records(j, fit_record);
    if (!st) tli_fit_solve(j->fit, j->fixed, j->rows);
    if (!st) st = set_means(j);
    if (st) return st;
    tli_added_round(j->plan, j->fixed, j->mesh->vert_count, j->mesh->tet_count, j->rows);
    tli_added_values(j->plan, j->rows, j->mesh);
    return TL_OK;
}

/* Last: what is off, and where they go. */
static tl_status deal_record(job *j, size_t number, const double *record)
{
    double w[4], distance, d2 = 0;
    tl_lidx tet = j->tets[j->kind][number];
    uint32_t low = 0, high = j->segment->output_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (tet < j->tet_base[middle])
            high = middle;
        else
            low = middle;
    }
    tli_carrier_weigh(&j->carrier, record, tet, w, &distance);
    tli_carrier_measure(&j->carrier, j->kind, record, tet, w, distance, j->notes[low].squares);
    for (int k = 0; k < 3; k++) d2 += (record[k] - j->centre[k]) * (record[k] - j->centre[k]);
    j->reach2 = fmax(j->reach2, d2);
    return tli_dealer_add(&j->dealer, low, record, tet - j->tet_base[low]);
}

/* The rows of an output. */
static tl_status put_rows(job *j, uint32_t output)
{
    tl_status st = TL_OK;
    const tli_plan *plan = j->plan;
    const tl_patch *p = j->outputs[output].patch;
    const size_t k = plan->vert_comps, n = p->vert_count;
    const double *tet_rows = j->rows + j->mesh->vert_count * k;
    double *rows = tl_mem_alloc(j->ctx, tli_row_doubles(plan, n, p->tet_count), sizeof *rows, &st);
    for (size_t v = 0; !st && v < n; v++)
        memcpy(rows + v * k, j->rows + j->verts[output][v] * k, k * sizeof *rows);
    if (!st)
        memcpy(rows + n * k, tet_rows + j->tet_base[output] * plan->tet_comps,
               p->tet_count * plan->tet_comps * sizeof *rows);
    if (!st) st = tli_added_put(j->ctx, j->a, j->segment->outputs[output], p, rows);
    tl_mem_free(j->ctx, rows);
    return st;
}

/* What the outputs carry and what it is off by; their values. */
static tl_status put_outputs(job *j)
{
    tl_status st = TL_OK;
    for (uint32_t o = 0; !st && o < j->segment->output_count; o++) {
        tli_patch_note *to = &j->a->model->patches[j->segment->outputs[o]], *from = &j->notes[o];
        to->squares = from->squares;
        to->carried = from->carried;
        memcpy(to->extents, from->extents, sizeof to->extents);
        *from = (tli_patch_note){0};
        st = put_rows(j, o);
    }
    return st;
}

static tl_status deal(job *j)
{
    tl_status st = TL_OK;
    tli_model *m = j->a->model;
    const uint32_t outputs = j->segment->output_count;
    j->notes = tl_mem_zalloc(j->ctx, outputs, sizeof *j->notes, &st);
    for (uint32_t o = 0; !st && o < outputs; o++)
        j->notes[o].squares = tl_mem_zalloc(j->ctx, j->plan->field_count, sizeof(double), &st);
    if (!st) st = tli_space_open(&j->carrier);
    for (j->kind = 0; !st && j->kind <= TLI_CELLS; j->kind++) {
        if (j->kind == TLI_CELLS && !j->plan->tet_comps) break;
        st = tli_dealer_open(j->ctx, m, m->carried[(j->segment->level + 1) & 1], j->notes, outputs,
                             j->kind, &j->dealer);
        if (!st) st = pass_records(j, deal_record);
        st = tli_dealer_close(&j->dealer, st);
    }
    return st ? st : put_outputs(j);
}

static void release_job(job *j)
{
    tl_ctx *ctx = j->ctx;
    const uint32_t outputs = j->segment->output_count;
    for (uint32_t o = 0; o < outputs; o++) {
        if (j->outputs) tli_added_patch_release(ctx, &j->outputs[o]);
        if (j->verts) tl_mem_free(ctx, j->verts[o]);
        if (j->notes) tl_mem_free(ctx, j->notes[o].squares);
        for (int kind = 0; j->notes && kind < TLI_KINDS; kind++)
            tl_mem_free(ctx, j->notes[o].extents[kind].items);
    }
    tli_carrier_close(&j->carrier);
    tli_fit_destroy(j->fit);
    tl_mesh_destroy(j->mesh);
    void *blocks[] = {j->notes, j->tets[TLI_CELLS], j->tets[TLI_POINTS], j->weights,
                      j->rows,  j->fixed,           j->opposite,         j->tet_base,
                      j->verts, j->outputs,         j->locked_rows,      j->locked};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
}

typedef struct level_job {
    tli_adder *a;
    uint32_t first; /* segment of the model */
    tli_locked locked;
} level_job;

static tl_status process(tl_ctx *ctx, const level_job *l, uint32_t index)
{
    const uint32_t number = l->first + index;
    tl_segment_info info;
    job j = {.ctx = ctx,
             .a = l->a,
             .plan = l->a->plan,
             .number = number,
             .segment = &l->a->model->segments[number]};
    tl_status st = tl_store_segment(ctx, l->a->store, tli_adder_segment(l->a, number), &info);
    if (!st) st = tli_locked_read(ctx, &l->locked, number, &j.locked, &j.locked_count);
    if (!st) st = take_locked(&j);
    if (!st) st = make_mesh(&j);
    if (st) goto done;
    memcpy(j.centre, info.sphere, sizeof j.centre);
    j.segment->errors.surface = info.boundary_error;
    st = tli_carrier_open(ctx, j.plan, j.mesh, j.opposite, &j.segment->errors, &j.carrier);
    if (!st) st = set_values(&j);
    if (!st) st = deal(&j);
    l->a->radii[number] = fmax(info.sphere[3], sqrt(j.reach2) * (1 + 1e-12));
done:
    release_job(&j);
    return st;
}

static tl_status process_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    const level_job *l = arg;
    tl_ctx *ctx = NULL;
    tl_status st = tli_ctx_fork(l->a->ctx, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) st = process(ctx, l, (uint32_t)i);
    return tli_ctx_join(l->a->ctx, ctx, st);
}

tl_status tli_adder_grow(tli_adder *a)
{
    tl_status st = TL_OK;
    level_job l = {.a = a};
    for (uint32_t level = 0; !st && level < a->head->level_count; level++) {
        const uint32_t count = a->head->levels[level].segment_count;
        if (!count) continue;
        st = tli_locked_open(a->ctx, a->plan->opts.folder, (size_t)l.first + count, &l.locked);
        if (!st) st = lock_level(a, level, &l.locked);
        if (!st) st = tli_parallel(a->ctx, count, 1, process_range, &l);
        tli_locked_release(&l.locked);
        tli_depot_clear(a->model->carried[level & 1]);
        l.first += count;
        if (!st) st = tl_progress(a->ctx, "levels", level + 1, a->head->level_count);
    }
    return st;
}
