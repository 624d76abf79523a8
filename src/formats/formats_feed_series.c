/* Steps of one mesh as one source. Each step is read as a whole, held against the mesh of the first
 * and spooled to a working file, array by array, so that one step at a time is in memory. */
#include "base/base_scratch.h"
#include "base/base_spill.h"
#include "formats/formats_feeder.h"
#include "mesh/mesh.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Vertices or tets that are compared at once. */
#define STEP_ELEMENTS 65536u

typedef struct series_reader {
    tli_feeder feeder;
    tli_scratch *file;
    uint64_t xyz_ofs, tets_ofs, regions_ofs, end;
    uint64_t *ofs[2]; /* of the arrays' values, by tl_on */
} series_reader;

static series_reader *of(tli_feeder *feeder)
{
    return (series_reader *)feeder;
}

/* ---- what the feed asks for ---- */

static tl_status series_points(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz)
{
    const series_reader *r = of(feeder);
    return tli_scratch_read(feeder->ctx, r->file, r->xyz_ofs + first * 3 * sizeof *xyz, xyz,
                            (size_t)count * 3 * sizeof *xyz);
}

static tl_status series_values(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                               uint64_t count, double *values)
{
    const series_reader *r = of(feeder);
    const uint64_t tuple = feeder->arrays[on][array].components * sizeof *values;
    return tli_scratch_read(feeder->ctx, r->file, r->ofs[on][array] + first * tuple, values,
                            (size_t)(count * tuple));
}

static tl_status read_tets(const series_reader *r, uint64_t first, uint64_t count, tl_lidx *tets)
{
    return tli_scratch_read(r->feeder.ctx, r->file, r->tets_ofs + first * 4 * sizeof *tets, tets,
                            (size_t)count * 4 * sizeof *tets);
}

static tl_status series_cells(tli_feeder *feeder, uint64_t first, uint64_t count, tli_grid *window)
{
    tl_status st = TL_OK;
    window->connectivity =
        tl_mem_alloc(feeder->ctx, (size_t)count, 4 * sizeof *window->connectivity, &st);
    return st ? st : read_tets(of(feeder), first, count, window->connectivity);
}

static tl_status series_regions(tli_feeder *feeder, uint64_t first, uint64_t count,
                                int32_t *regions)
{
    const series_reader *r = of(feeder);
    return tli_scratch_read(feeder->ctx, r->file, r->regions_ofs + first * sizeof *regions, regions,
                            (size_t)count * sizeof *regions);
}

static void series_close(tli_feeder *feeder)
{
    tl_ctx *ctx = feeder->ctx;
    series_reader *r = of(feeder);
    tli_feeder_drop_arrays(feeder);
    tl_mem_free(ctx, r->ofs[0]);
    tl_mem_free(ctx, r->ofs[1]);
    tli_scratch_close(r->file);
    tl_mem_free(ctx, r);
}

/* ---- spooling ---- */

static tl_status spool(series_reader *r, const void *bytes, size_t byte_count, uint64_t *ofs)
{
    *ofs = r->end;
    r->end += byte_count;
    return tli_scratch_write(r->feeder.ctx, r->file, *ofs, bytes, byte_count);
}

static tl_status spool_mesh(series_reader *r, const tl_mesh *mesh)
{
    tli_feeder *f = &r->feeder;
    f->point_count = mesh->vert_count;
    f->cell_count = mesh->tet_count;
    f->time = mesh->time;
    f->regions = mesh->regions ? series_regions : NULL;
    tl_status st = spool(r, mesh->xyz, mesh->vert_count * 3 * sizeof *mesh->xyz, &r->xyz_ofs);
    if (!st) st = spool(r, mesh->tets, mesh->tet_count * 4 * sizeof *mesh->tets, &r->tets_ofs);
    if (!st && mesh->regions)
        st = spool(r, mesh->regions, mesh->tet_count * sizeof *mesh->regions, &r->regions_ofs);
    return st;
}

static tl_status spool_channels(series_reader *r, const tl_mesh *mesh, const tl_step *step)
{
    tl_status st = TL_OK;
    tli_feeder *f = &r->feeder;
    for (size_t i = 0; !st && i < mesh->channel_count; i++) {
        const tl_channel *c = &mesh->channels[i];
        const size_t elements = c->on == TL_ON_VERTEX ? mesh->vert_count : mesh->tet_count;
        const uint32_t array = f->array_counts[c->on];
        uint64_t ofs;
        r->ofs[c->on] =
            tl_mem_resize(f->ctx, r->ofs[c->on], (size_t)array + 1, sizeof *r->ofs[c->on], &st);
        if (!st) st = spool(r, c->values, elements * c->components * sizeof *c->values, &ofs);
        if (!st) st = tli_feeder_add(f, c->on, c->name, c->components, c->scalar);
        if (st) break;
        r->ofs[c->on][array] = ofs;
        f->arrays[c->on][array].step = (tli_feed_step){true, step->number, mesh->time};
    }
    return st;
}

/* ---- is it the same mesh? ---- */

static bool is_same_place(const double *a, const double *b)
{
    for (int k = 0; k < 3; k++)
        if (!(a[k] == b[k] || (isnan(a[k]) && isnan(b[k])))) return false;
    return true;
}

static tl_status other_mesh(const series_reader *r, const tl_step *step, const char *change)
{
    return tl_fail(r->feeder.ctx, TL_ERR_DATA,
                   "step %u ('%s', step %llu): %s; a model holds one mesh that stays as it is",
                   step->number, step->path, (unsigned long long)step->step, change);
}

static tl_status compare_places(series_reader *r, const tl_mesh *mesh, const tl_step *step)
{
    tl_status st = TL_OK;
    char change[256];
    double *xyz = tl_mem_alloc(r->feeder.ctx, STEP_ELEMENTS, 3 * sizeof *xyz, &st);
    for (size_t first = 0; !st && first < mesh->vert_count; first += STEP_ELEMENTS) {
        size_t left = mesh->vert_count - first, n = left < STEP_ELEMENTS ? left : STEP_ELEMENTS;
        st = series_points(&r->feeder, first, n, xyz);
        for (size_t i = 0; !st && i < n; i++) {
            const double *now = mesh->xyz + 3 * (first + i), *before = xyz + 3 * i;
            if (is_same_place(now, before)) continue;
            tli_print(change, sizeof change,
                      "the mesh moves: vertex %zu is at %.9g %.9g %.9g, it was at %.9g %.9g %.9g",
                      first + i, now[0], now[1], now[2], before[0], before[1], before[2]);
            st = other_mesh(r, step, change);
        }
    }
    tl_mem_free(r->feeder.ctx, xyz);
    return st;
}

static tl_status compare_tets(series_reader *r, const tl_mesh *mesh, const tl_step *step)
{
    tl_status st = TL_OK;
    char change[128];
    tl_ctx *ctx = r->feeder.ctx;
    tl_lidx *tets = tl_mem_alloc(ctx, STEP_ELEMENTS, 4 * sizeof *tets, &st);
    int32_t *regions = tl_mem_alloc(ctx, STEP_ELEMENTS, sizeof *regions, &st);
    for (size_t first = 0; !st && first < mesh->tet_count; first += STEP_ELEMENTS) {
        size_t left = mesh->tet_count - first, n = left < STEP_ELEMENTS ? left : STEP_ELEMENTS;
        st = read_tets(r, first, n, tets);
        if (!st && mesh->regions) st = series_regions(&r->feeder, first, n, regions);
        for (size_t i = 0; !st && i < n; i++) {
            bool corners = memcmp(mesh->tets + 4 * (first + i), tets + 4 * i, 4 * sizeof *tets);
            if (!corners && !(mesh->regions && mesh->regions[first + i] != regions[i])) continue;
            snprintf(change, sizeof change, "the mesh changes: tet %zu has other %s than before",
                     first + i, corners ? "vertices" : "regions");
            st = other_mesh(r, step, change);
        }
    }
    tl_mem_free(ctx, regions);
    tl_mem_free(ctx, tets);
    return st;
}

static tl_status compare_mesh(series_reader *r, const tl_mesh *mesh, const tl_step *step)
{
    const tli_feeder *f = &r->feeder;
    char change[160];
    if (mesh->vert_count != f->point_count || mesh->tet_count != f->cell_count) {
        snprintf(change, sizeof change,
                 "the mesh changes: %zu vertices and %zu tets, before it had %llu and %llu",
                 mesh->vert_count, mesh->tet_count, (unsigned long long)f->point_count,
                 (unsigned long long)f->cell_count);
        return other_mesh(r, step, change);
    }
    if ((mesh->regions != NULL) != (f->regions != NULL))
        return other_mesh(r, step, "the mesh changes: regions come or go");
    tl_status st = compare_places(r, mesh, step);
    return st ? st : compare_tets(r, mesh, step);
}

/* ---- opening ---- */

static tl_status take_step(series_reader *r, const tl_step *step, const tl_read_opts *read,
                           const char *folder, bool is_first, tl_read_report *report)
{
    tl_read_opts opts = *read;
    tl_mesh *mesh = NULL;
    opts.step = step->step;
    opts.has_time = false;
    bool quiet = tli_ctx_quiet(r->feeder.ctx, !is_first); /* what holds of one holds of all */
    tli_spill_begin(r->feeder.ctx, folder);
    tl_status st = tl_mesh_read(r->feeder.ctx, step->path, &opts, &mesh, is_first ? report : NULL);
    tli_spill_end(r->feeder.ctx);
    tli_ctx_quiet(r->feeder.ctx, quiet);
    if (!st) st = is_first ? spool_mesh(r, mesh) : compare_mesh(r, mesh, step);
    if (!st) st = spool_channels(r, mesh, step);
    tl_mesh_destroy(mesh);
    return st;
}

tl_status tli_feeder_open_series(tl_ctx *ctx, const tl_step *steps, size_t step_count,
                                 const tl_read_opts *opts, const char *folder,
                                 tl_read_report *report, tli_feeder **feeder)
{
    tl_status st = TL_OK;
    series_reader *r = tl_mem_zalloc(ctx, 1, sizeof *r, &st);
    *feeder = NULL;
    if (st) return st;
    r->feeder = (tli_feeder){.ctx = ctx,
                             .is_final = true,
                             .points = series_points,
                             .values = series_values,
                             .cells = series_cells,
                             .close = series_close};
    st = tli_scratch_open(ctx, folder, &r->file);
    for (size_t i = 0; !st && i < step_count; i++) {
        if (i && steps[i].number <= steps[i - 1].number)
            st = tl_fail(ctx, TL_ERR_ARG, "step %u stands behind step %u", steps[i].number,
                         steps[i - 1].number);
        if (!st) st = take_step(r, &steps[i], opts, folder, i == 0, report);
        if (!st) st = tl_progress(ctx, "steps", i + 1, step_count);
    }
    if (st)
        series_close(&r->feeder);
    else
        *feeder = &r->feeder;
    return st;
}
