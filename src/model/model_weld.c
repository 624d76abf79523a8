/* From patches to the mesh of a segment, and back. Vertices are welded by their identity, never by
 * their place. */
#include <math.h>
#include <string.h>

#include "model/model.h"

/* ---- a table of identities ---- */

typedef struct id_table {
    uint64_t *ids;
    tl_lidx *verts; /* TL_NONE: free */
    size_t mask;
} id_table;

static tl_status open_table(tl_ctx *ctx, size_t most, id_table *table)
{
    tl_status st = TL_OK;
    size_t slots = 16;
    while (slots < 2 * most) slots *= 2;
    table->mask = slots - 1;
    table->ids = tl_mem_alloc(ctx, slots, sizeof *table->ids, &st);
    table->verts = tl_mem_alloc(ctx, slots, sizeof *table->verts, &st);
    for (size_t i = 0; !st && i < slots; i++) table->verts[i] = TL_NONE;
    return st;
}

static void close_table(tl_ctx *ctx, id_table *table)
{
    tl_mem_free(ctx, table->verts);
    tl_mem_free(ctx, table->ids);
}

/* The slot of an id: its own or a free one. */
static size_t find_slot(const id_table *table, uint64_t id)
{
    uint64_t h = id * 0x9e3779b97f4a7c15u;
    size_t at = (size_t)(h >> 20) & table->mask;
    while (table->verts[at] != TL_NONE && table->ids[at] != id) at = (at + 1) & table->mask;
    return at;
}

/* ---- welding ---- */

typedef struct welder {
    tl_ctx *ctx;
    const tli_plan *plan;
    tli_weld *weld;
    id_table table;
    double *xyz;
    tl_lidx *tets;
    int32_t *regions;
    double **values; /* [field_count] */
    size_t vert_count, tet_count;
    tli_locked_vertex *locked; /* [locked_count] ascending */
    size_t locked_count;
} welder;

/* Segments that hold a vertex; 1 for one that is not locked. */
static unsigned holders(const welder *w, uint64_t id)
{
    size_t at = tli_locked_find(w->locked, w->locked_count, id);
    return at == SIZE_MAX ? 1 : w->locked[at].segments;
}

static void add_quadric(float *to, const float *from, size_t count)
{
    for (size_t i = 0; i < count; i++) to[i] += from[i];
}

/* The welded number of a vertex of a bundle. */
static tl_lidx weld_vertex(welder *w, const tli_bundle *b, size_t v)
{
    tli_weld *to = w->weld;
    size_t floats = w->plan->quadric_floats;
    if (b->shared[v]) {
        size_t slot = find_slot(&w->table, b->ids[v]);
        tl_lidx known = w->table.verts[slot];
        if (known != TL_NONE) {
            if (b->quadrics)
                add_quadric(to->quadrics + known * floats, b->quadrics + v * floats, floats);
            if (b->surface[v] > to->surface[known]) to->surface[known] = b->surface[v];
            return known;
        }
        w->table.ids[slot] = b->ids[v];
        w->table.verts[slot] = (tl_lidx)w->vert_count;
    }
    size_t n = w->vert_count++;
    to->ids[n] = b->ids[v];
    to->steps[n] = b->steps[v];
    to->surface[n] = b->surface[v];
    unsigned segments = b->shared[v] ? holders(w, b->ids[v]) : 1;
    to->twins[n] = b->twins[v];
    to->locked[n] = segments > 1 || b->twins[v];
    if (to->shares) to->shares[n] = 1.0f / (float)segments;
    memcpy(w->xyz + 3 * n, b->xyz + 3 * v, 3 * sizeof *w->xyz);
    if (b->quadrics)
        memcpy(to->quadrics + n * floats, b->quadrics + v * floats, floats * sizeof(float));
    for (size_t i = 0; i < w->plan->field_count; i++) {
        const tli_field *f = &w->plan->fields[i];
        if (f->on == TL_ON_VERTEX)
            memcpy(w->values[i] + n * f->components, b->values + v * w->plan->vert_comps + f->first,
                   f->components * sizeof(double));
    }
    return (tl_lidx)n;
}

static void weld_tets(welder *w, const tli_bundle *b, const tl_lidx *numbers)
{
    for (size_t t = 0; t < b->tet_count; t++) {
        size_t n = w->tet_count++;
        for (size_t i = 0; i < 4; i++) w->tets[4 * n + i] = numbers[b->tets[4 * t + i]];
        w->weld->outer[n] = b->outer[t];
        if (w->regions) w->regions[n] = b->regions[t];
        for (size_t i = 0; i < w->plan->field_count; i++) {
            const tli_field *f = &w->plan->fields[i];
            if (f->on == TL_ON_TET)
                memcpy(w->values[i] + n * f->components,
                       b->tet_values + t * w->plan->tet_comps + f->first,
                       f->components * sizeof(double));
        }
    }
}

static tl_status weld_patch(welder *w, const tli_level *level, const tli_patch_note *note)
{
    tli_bundle b;
    tl_status st =
        tli_bundle_create(w->ctx, w->plan, note->vert_count, note->tet_count, level->level > 0, &b);
    tl_lidx *numbers = tl_mem_alloc(w->ctx, note->vert_count, sizeof *numbers, &st);
    if (!st) st = tli_depot_get(w->ctx, level->model->meshes, note->ofs, b.block, b.bytes);
    if (!st) {
        for (size_t v = 0; v < b.vert_count; v++) numbers[v] = weld_vertex(w, &b, v);
        weld_tets(w, &b, numbers);
    }
    tl_mem_free(w->ctx, numbers);
    tli_bundle_release(w->ctx, &b);
    return st;
}

/* Room for all vertices of all patches. */
static tl_status open_welder(welder *w, const tli_level *level, const tli_segment_note *segment)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = w->ctx;
    tli_weld *to = w->weld;
    size_t verts = 0, tets = 0;
    for (uint32_t i = 0; i < segment->input_count; i++) {
        verts += level->model->patches[segment->inputs[i]].vert_count;
        tets += level->model->patches[segment->inputs[i]].tet_count;
    }
    to->ids = tl_mem_alloc(ctx, verts, sizeof *to->ids, &st);
    to->steps = tl_mem_alloc(ctx, verts, sizeof *to->steps, &st);
    if (level->level > 0)
        to->quadrics =
            tl_mem_alloc(ctx, verts * w->plan->quadric_floats, sizeof *to->quadrics, &st);
    else
        to->shares = tl_mem_alloc(ctx, verts, sizeof *to->shares, &st);
    to->surface = tl_mem_alloc(ctx, verts, sizeof *to->surface, &st);
    to->locked = tl_mem_alloc(ctx, verts, sizeof *to->locked, &st);
    to->twins = tl_mem_alloc(ctx, verts, sizeof *to->twins, &st);
    to->outer = tl_mem_alloc(ctx, tets, sizeof *to->outer, &st);
    to->tet_base = tl_mem_alloc(ctx, segment->input_count, sizeof *to->tet_base, &st);
    w->xyz = tl_mem_alloc(ctx, verts, 3 * sizeof *w->xyz, &st);
    w->tets = tl_mem_alloc(ctx, tets, 4 * sizeof *w->tets, &st);
    if (w->plan->has_regions) w->regions = tl_mem_alloc(ctx, tets, sizeof *w->regions, &st);
    w->values = tl_mem_zalloc(ctx, w->plan->field_count, sizeof *w->values, &st);
    for (size_t i = 0; !st && i < w->plan->field_count; i++) {
        const tli_field *f = &w->plan->fields[i];
        w->values[i] = tl_mem_alloc(ctx, (f->on == TL_ON_VERTEX ? verts : tets) * f->components,
                                    sizeof(double), &st);
    }
    if (!st)
        st = tli_locked_read(ctx, &level->locked,
                             (size_t)(segment - level->model->segments) - level->first_segment,
                             &w->locked, &w->locked_count);
    return st ? st : open_table(ctx, verts, &w->table);
}

/* Hands the arrays over to a mesh. */
static tl_status make_mesh(welder *w)
{
    tl_status st =
        tl_mesh_adopt(w->ctx, w->xyz, w->vert_count, w->tets, w->tet_count, &w->weld->mesh);
    if (st) return st;
    w->xyz = NULL;
    w->tets = NULL;
    for (size_t i = 0; !st && i < w->plan->field_count; i++) {
        const tli_field *f = &w->plan->fields[i];
        tl_channel c = {f->key, f->unit, f->components, f->on, TL_F64, w->values[i]};
        st = tl_mesh_adopt_channel(w->weld->mesh, &c);
        if (!st) w->values[i] = NULL;
    }
    if (!st && w->regions) st = tl_mesh_set_regions(w->weld->mesh, w->regions);
    return st;
}

tl_status tli_weld_create(tl_ctx *ctx, const tli_level *level, const tli_segment_note *segment,
                          tli_weld *weld)
{
    welder w = {.ctx = ctx, .plan = level->model->plan, .weld = weld};
    *weld = (tli_weld){0};
    tl_status st = open_welder(&w, level, segment);
    for (uint32_t i = 0; !st && i < segment->input_count; i++) {
        weld->tet_base[i] = (uint32_t)w.tet_count;
        st = weld_patch(&w, level, &level->model->patches[segment->inputs[i]]);
    }
    if (!st) st = make_mesh(&w);
    close_table(ctx, &w.table);
    tl_mem_free(ctx, w.locked);
    for (size_t i = 0; w.values && i < w.plan->field_count; i++) tl_mem_free(ctx, w.values[i]);
    tl_mem_free(ctx, w.values);
    tl_mem_free(ctx, w.regions);
    tl_mem_free(ctx, w.tets);
    tl_mem_free(ctx, w.xyz);
    if (st) tli_weld_release(ctx, weld);
    return st;
}

void tli_weld_release(tl_ctx *ctx, tli_weld *weld)
{
    tl_mesh_destroy(weld->mesh);
    void *blocks[] = {weld->ids,   weld->steps,  weld->quadrics, weld->surface, weld->locked,
                      weld->twins, weld->shares, weld->tet_base, weld->outer};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    *weld = (tli_weld){0};
}

/* ---- cutting ---- */

/* Tets by part, and which vertices several parts hold. */
typedef struct cutter {
    tl_ctx *ctx;
    tli_model *model;
    const tli_cut *cut;
    uint32_t *starts;   /* [part_count + 1] */
    tl_lidx *tets;      /* by part */
    uint32_t *part_of;  /* [vert_count] a part that holds it */
    uint8_t *several;   /* [vert_count] */
    uint8_t *has_owner; /* [vert_count] its quadric has been given away */
    tl_lidx *local;     /* [vert_count] */
} cutter;

static tl_status open_cutter(cutter *c)
{
    tl_status st = TL_OK;
    const tl_mesh *mesh = c->cut->mesh;
    size_t n = mesh->vert_count, m = mesh->tet_count;
    c->starts = tl_mem_zalloc(c->ctx, c->cut->part_count + 1, sizeof *c->starts, &st);
    c->tets = tl_mem_alloc(c->ctx, m, sizeof *c->tets, &st);
    c->part_of = tl_mem_alloc(c->ctx, n, sizeof *c->part_of, &st);
    c->several = tl_mem_zalloc(c->ctx, n, 1, &st);
    c->has_owner = tl_mem_zalloc(c->ctx, n, 1, &st);
    c->local = tl_mem_alloc(c->ctx, n, sizeof *c->local, &st);
    if (st) return st;
    for (size_t v = 0; v < n; v++) c->part_of[v] = c->local[v] = TL_NONE;
    for (size_t t = 0; t < m; t++) {
        uint32_t p = c->cut->part[t];
        c->starts[p + 1]++;
        for (size_t i = 0; i < 4; i++) {
            tl_lidx v = mesh->tets[4 * t + i];
            c->several[v] |= c->part_of[v] != TL_NONE && c->part_of[v] != p;
            c->part_of[v] = p;
        }
    }
    for (size_t p = 0; p < c->cut->part_count; p++) c->starts[p + 1] += c->starts[p];
    for (size_t t = m; t-- > 0;) c->tets[--c->starts[c->cut->part[t] + 1]] = (tl_lidx)t;
    /* starts[p + 1] is now the beginning of part p */
    for (size_t p = 0; p < c->cut->part_count; p++) c->starts[p] = c->starts[p + 1];
    c->starts[c->cut->part_count] = (uint32_t)m;
    return st;
}

static void close_cutter(cutter *c)
{
    void *blocks[] = {c->local, c->has_owner, c->several, c->part_of, c->tets, c->starts};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(c->ctx, blocks[i]);
}

static void copy_vertex(cutter *c, tl_lidx v, tli_bundle *b, size_t n)
{
    const tli_plan *plan = c->model->plan;
    const tli_cut *cut = c->cut;
    size_t floats = plan->quadric_floats;
    b->ids[n] = cut->ids[v];
    b->steps[n] = cut->steps[v];
    b->surface[n] = cut->surface[v];
    b->twins[n] = cut->twins[v];
    b->shared[n] = c->several[v] || (cut->outside && cut->outside[v]);
    memcpy(b->xyz + 3 * n, cut->mesh->xyz + 3 * (size_t)v, 3 * sizeof(double));
    if (!b->quadrics)
        c->has_owner[v] = 1;
    else if (c->has_owner[v])
        memset(b->quadrics + n * floats, 0, floats * sizeof(float));
    else
        memcpy(b->quadrics + n * floats, cut->quadrics + v * floats, floats * sizeof(float));
    c->has_owner[v] = 1;
    for (size_t i = 0; i < plan->field_count; i++) {
        const tli_field *f = &plan->fields[i];
        if (f->on == TL_ON_VERTEX)
            memcpy(b->values + n * plan->vert_comps + f->first,
                   cut->mesh->channels[i].values + v * f->components,
                   f->components * sizeof(double));
    }
}

static void copy_tets(const cutter *c, size_t part, tli_bundle *b)
{
    const tli_plan *plan = c->model->plan;
    const tl_mesh *mesh = c->cut->mesh;
    for (size_t t = 0; t < b->tet_count; t++) {
        size_t from = c->tets[c->starts[part] + t];
        c->cut->tet_local[from] = (tl_lidx)t;
        b->outer[t] = c->cut->outer[from];
        for (size_t i = 0; i < 4; i++) b->tets[4 * t + i] = c->local[mesh->tets[4 * from + i]];
        if (b->regions) b->regions[t] = mesh->regions[from];
        for (size_t i = 0; i < plan->field_count; i++) {
            const tli_field *f = &plan->fields[i];
            if (f->on == TL_ON_TET)
                memcpy(b->tet_values + t * plan->tet_comps + f->first,
                       mesh->channels[i].values + from * f->components,
                       f->components * sizeof(double));
        }
    }
}

/* Box of the vertices and ranges of the values. */
static void note_extent(const cutter *c, const tli_bundle *b, tli_patch_note *note)
{
    const tli_plan *plan = c->model->plan;
    for (int k = 0; k < 3; k++) {
        note->box[2 * k] = (double)INFINITY;
        note->box[2 * k + 1] = (double)-INFINITY;
    }
    for (size_t v = 0; v < b->vert_count; v++)
        for (int k = 0; k < 3; k++) {
            double x = b->xyz[3 * v + (size_t)k];
            note->box[2 * k] = fmin(note->box[2 * k], x);
            note->box[2 * k + 1] = fmax(note->box[2 * k + 1], x);
        }
    for (size_t i = 0; i < plan->field_count; i++) {
        const tli_field *f = &plan->fields[i];
        bool on_vertex = f->on == TL_ON_VERTEX;
        size_t count = on_vertex ? b->vert_count : b->tet_count;
        size_t stride = on_vertex ? plan->vert_comps : plan->tet_comps;
        const double *values = (on_vertex ? b->values : b->tet_values) + f->first;
        double *range = note->ranges + 2 * i;
        range[0] = range[1] = (double)NAN;
        for (size_t e = 0; e < count; e++, values += stride) {
            double value = values[0], sum = 0;
            for (size_t j = 0; f->components > 1 && j < f->components; j++)
                sum += values[j] * values[j];
            if (f->components > 1) value = sqrt(sum);
            if (!isfinite(value)) continue;
            range[0] = fmin(range[0], value);
            range[1] = fmax(range[1], value);
        }
    }
}

static tl_status write_part(cutter *c, size_t part, tli_patch_note *note, tli_shared *shared)
{
    const tl_mesh *mesh = c->cut->mesh;
    tl_status st = TL_OK;
    tli_bundle b = {0};
    size_t begin = c->starts[part], end = c->starts[part + 1], n = 0;
    tl_lidx *verts = tl_mem_alloc(c->ctx, 4 * (end - begin), sizeof *verts, &st);
    if (st) return st;
    for (size_t i = begin; i < end; i++)
        for (size_t j = 0; j < 4; j++) {
            tl_lidx v = mesh->tets[4 * (size_t)c->tets[i] + j];
            if (c->local[v] != TL_NONE) continue;
            c->local[v] = (tl_lidx)n;
            verts[n++] = v;
        }
    size_t fields = c->model->plan->field_count;
    note->squares = tl_mem_zalloc(c->ctx, fields, sizeof *note->squares, &st);
    note->ranges = tl_mem_zalloc(c->ctx, 2 * fields, sizeof *note->ranges, &st);
    if (c->model->plan->opts.partition != TL_PARTITION_CLUSTER) {
        note->sampling = tl_mem_alloc(c->ctx, 1, sizeof *note->sampling, &st);
        if (!st)
            tli_sampling_set(mesh->xyz, mesh->tets, c->tets + begin, end - begin, note->sampling);
    }
    if (!st)
        st = tli_bundle_create(c->ctx, c->model->plan, (uint32_t)n, (uint32_t)(end - begin),
                               c->cut->quadrics != NULL, &b);
    if (!st) {
        for (size_t i = 0; i < n; i++) copy_vertex(c, verts[i], &b, i);
        copy_tets(c, part, &b);
        note_extent(c, &b, note);
        note->vert_count = b.vert_count;
        note->tet_count = b.tet_count;
        st = tli_depot_put(c->ctx, c->model->meshes, b.block, b.bytes, &note->ofs);
    }
    for (size_t i = 0; !st && i < n; i++)
        if (b.shared[i]) st = tli_shared_add(c->ctx, shared, b.ids[i], (uint32_t)part);
    for (size_t i = 0; i < n; i++) c->local[verts[i]] = TL_NONE;
    tli_bundle_release(c->ctx, &b);
    tl_mem_free(c->ctx, verts);
    return st;
}

tl_status tli_cut_write(tl_ctx *ctx, tli_model *model, const tli_cut *cut, tli_patch_note *notes,
                        tli_shared *shared)
{
    cutter c = {.ctx = ctx, .model = model, .cut = cut};
    tl_status st = open_cutter(&c);
    for (size_t p = 0; !st && p < cut->part_count; p++) st = write_part(&c, p, &notes[p], shared);
    close_cutter(&c);
    return st;
}
