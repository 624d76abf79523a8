/* Level 0 of a mesh in memory: places and values as they will be decoded, cut into patches, with
 * the originals on board. */
#include <math.h>

#include "base/base_sort.h"
#include "model/model.h"

typedef struct finest {
    tl_ctx *ctx;
    tli_model *model;
    const tl_mesh *original;
    const size_t *channels; /* [field_count] of the original */
    tl_mesh *mesh;          /* as decoded */
    int16_t *steps;
    uint64_t *ids;
    float *surface;
    uint8_t *twins;
    uint32_t *part;
    tl_lidx *tet_local, *tet_of, *opposite;
    tli_errors errors;
} finest;

static tl_status add_fields(finest *f)
{
    const tli_plan *plan = f->model->plan;
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < plan->field_count; i++) {
        const tli_field *field = &plan->fields[i];
        const tl_channel *from = &f->original->channels[f->channels[i]];
        size_t count = (from->on == TL_ON_VERTEX ? f->mesh->vert_count : f->mesh->tet_count) *
                       from->components;
        double *values = tl_mem_alloc(f->ctx, count, sizeof *values, &st);
        for (size_t v = 0; !st && v < count; v++)
            values[v] = tli_field_round(field, from->values[v]);
        tl_channel c = {field->name, field->unit, field->components, field->on, TL_F64, values};
        if (!st) st = tl_mesh_adopt_channel(f->mesh, &c);
        if (st) tl_mem_free(f->ctx, values);
    }
    if (!st && f->original->regions) st = tl_mesh_set_regions(f->mesh, f->original->regions);
    return st;
}

static tl_status make_mesh(finest *f, tli_plan *plan)
{
    tl_status st = TL_OK;
    const tl_mesh *o = f->original;
    double *xyz = tl_mem_alloc(f->ctx, o->vert_count, 3 * sizeof *xyz, &st);
    tl_lidx *tets = tl_mem_alloc(f->ctx, o->tet_count, 4 * sizeof *tets, &st);
    f->steps = tl_mem_alloc(f->ctx, o->vert_count, sizeof *f->steps, &st);
    if (!st) st = tli_lattice_snap(plan, o, xyz, f->steps);
    if (!st) {
        memcpy(tets, o->tets, 4 * o->tet_count * sizeof *tets);
        st = tl_mesh_adopt(f->ctx, xyz, o->vert_count, tets, o->tet_count, &f->mesh);
    }
    if (st) {
        tl_mem_free(f->ctx, tets);
        tl_mem_free(f->ctx, xyz);
        return st;
    }
    return add_fields(f);
}

static uint64_t hash_place(const double x[3])
{
    uint64_t h = 0, bits;
    for (int k = 0; k < 3; k++) {
        double positive = x[k] + 0.0; /* no -0 */
        memcpy(&bits, &positive, sizeof bits);
        h = (h ^ bits) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
    }
    return h;
}

static bool same_place(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Vertices at one place, such as the two sides of a baffle, get numbers from 1 on. */
static tl_status find_twins(finest *f)
{
    tl_status st = TL_OK;
    size_t n = f->mesh->vert_count;
    const double *xyz = f->mesh->xyz;
    uint64_t *keys = tl_mem_alloc(f->ctx, n, sizeof *keys, &st);
    uint32_t *verts = tl_mem_alloc(f->ctx, n, sizeof *verts, &st);
    for (size_t v = 0; !st && v < n; v++) {
        keys[v] = hash_place(xyz + 3 * v);
        verts[v] = (uint32_t)v;
    }
    if (!st) st = tli_sort_u64(f->ctx, keys, verts, n);
    for (size_t i = 0, end; !st && i < n; i = end) {
        for (end = i + 1; end < n && keys[end] == keys[i]; end++) {
        }
        for (size_t a = i; a < end; a++) {
            unsigned same = 0, before = 0;
            for (size_t b = i; b < end && end - i > 1; b++)
                if (same_place(xyz + 3 * (size_t)verts[a], xyz + 3 * (size_t)verts[b])) {
                    same++;
                    before += b < a;
                }
            if (same < 2) continue;
            if (before + 1 > UINT8_MAX)
                st = tl_fail(f->ctx, TL_ERR_UNSUPPORTED, "more than %d vertices at one place",
                             UINT8_MAX);
            f->twins[verts[a]] = (uint8_t)(before + 1);
        }
    }
    tl_mem_free(f->ctx, verts);
    tl_mem_free(f->ctx, keys);
    return st;
}

static tl_status write_patches(finest *f, tli_shared *shared)
{
    tl_status st = TL_OK;
    tl_mesh *m = f->mesh;
    const tli_plan *plan = f->model->plan;
    size_t parts = 0, first;
    f->ids = tl_mem_alloc(f->ctx, m->vert_count, sizeof *f->ids, &st);
    f->surface = tl_mem_zalloc(f->ctx, m->vert_count, sizeof *f->surface, &st);
    f->twins = tl_mem_zalloc(f->ctx, m->vert_count, sizeof *f->twins, &st);
    if (!st) st = find_twins(f);
    f->part = tl_mem_alloc(f->ctx, m->tet_count, sizeof *f->part, &st);
    f->tet_local = tl_mem_alloc(f->ctx, m->tet_count, sizeof *f->tet_local, &st);
    for (size_t v = 0; !st && v < m->vert_count; v++) f->ids[v] = v;
    if (!st)
        st = tli_split(f->ctx, m->xyz, m->tets, m->tet_count, plan->opts.patch_tets, f->part,
                       &parts);
    if (!st) st = tli_model_add_patches(f->model, parts, &first);
    tli_cut cut = {.mesh = m,
                   .ids = f->ids,
                   .steps = f->steps,
                   .surface = f->surface,
                   .twins = f->twins,
                   .part = f->part,
                   .part_count = parts,
                   .tet_local = f->tet_local};
    return st ? st : tli_cut_write(f->ctx, f->model, &cut, f->model->patches, shared);
}

/* The record of an original vertex or of a tet's centroid; false for one without a place. */
static bool fill_record(const finest *f, int kind, size_t i, double *record)
{
    const tl_mesh *o = f->original;
    double *to = record + 3;
    if (kind == TLI_POINTS)
        memcpy(record, o->xyz + 3 * i, 3 * sizeof *record);
    else {
        double p[4][3];
        tli_tet_corners(o->xyz, o->tets + 4 * i, p);
        for (int k = 0; k < 3; k++) record[k] = (p[0][k] + p[1][k] + p[2][k] + p[3][k]) / 4;
        double volume = fabs(tl_tet_volume(TLI_CORNERS(p)));
        *to++ = isfinite(volume) ? volume : 0;
    }
    for (size_t j = 0; j < f->model->plan->field_count; j++) {
        const tl_channel *c = &o->channels[f->channels[j]];
        if (c->on != (kind == TLI_POINTS ? TL_ON_VERTEX : TL_ON_TET)) continue;
        memcpy(to, c->values + i * c->components, c->components * sizeof *to);
        to += c->components;
    }
    return isfinite(record[0] + record[1] + record[2]);
}

static tl_status carry(finest *f, int kind)
{
    tl_status st = TL_OK;
    const tl_mesh *o = f->original;
    const tli_plan *plan = f->model->plan;
    size_t count = kind == TLI_POINTS ? o->vert_count : o->tet_count;
    size_t doubles = tli_record_doubles(plan, kind);
    tli_carrier carrier = {f->ctx, plan, f->mesh, f->opposite, NULL, &f->errors};
    tli_dealer dealer = {0};
    if (kind == TLI_CELLS && !plan->tet_comps) return TL_OK;
    double *record = tl_mem_alloc(f->ctx, doubles, sizeof *record, &st);
    if (!st)
        st = tli_dealer_open(f->ctx, f->model, f->model->carried[0], f->model->patches,
                             f->model->patch_count, kind, &dealer);
    for (size_t i = 0; !st && i < count; i++) {
        double w[4], distance;
        tl_lidx tet = kind == TLI_POINTS ? f->tet_of[i] : (tl_lidx)i;
        if (tet == TL_NONE || !fill_record(f, kind, i, record)) continue;
        st = tli_carrier_locate(&carrier, record, tet, &tet, w, &distance);
        if (st) break;
        uint32_t part = f->part[tet];
        tli_carrier_measure(&carrier, kind, record, tet, w, distance,
                            f->model->patches[part].squares);
        st = tli_dealer_add(&dealer, part, record, f->tet_local[tet]);
        *(kind == TLI_POINTS ? &f->model->point_count : &f->model->cell_count) += 1;
    }
    st = tli_dealer_close(&dealer, st);
    tl_locator_destroy(carrier.locator);
    tl_mem_free(f->ctx, record);
    return st;
}

tl_status tli_model_begin(tli_model *model, tli_plan *plan, const tl_mesh *mesh,
                          const size_t *channels, tli_shared *shared)
{
    finest f = {.ctx = model->ctx, .model = model, .original = mesh, .channels = channels};
    tl_status st = make_mesh(&f, plan);
    if (!st) st = write_patches(&f, shared);
    if (!st) st = tli_errors_create(f.ctx, plan, &f.errors);
    if (!st) st = tl_mesh_adjacency(f.ctx, f.mesh, &f.opposite, NULL);
    f.tet_of = tl_mem_alloc(f.ctx, mesh->vert_count, sizeof *f.tet_of, &st);
    for (size_t v = 0; !st && v < mesh->vert_count; v++) f.tet_of[v] = TL_NONE;
    for (size_t i = 0; !st && i < 4 * mesh->tet_count; i++)
        f.tet_of[mesh->tets[i]] = (tl_lidx)(i / 4);
    for (int kind = 0; !st && kind < TLI_KINDS; kind++) st = carry(&f, kind);
    for (size_t i = 0; !st && i < plan->field_count; i++)
        plan->fields[i].leaf_error = f.errors.max[i];
    tli_errors_release(f.ctx, &f.errors);
    void *blocks[] = {f.steps, f.ids,       f.surface, f.twins,
                      f.part,  f.tet_local, f.tet_of,  f.opposite};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(f.ctx, blocks[i]);
    tl_mesh_destroy(f.mesh);
    return st;
}
