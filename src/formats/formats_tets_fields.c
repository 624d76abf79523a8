/* The fields of a grid on their way into a mesh: regions, cell data repeated for each tet of a cell
 * or averaged to the points, point data as they are. */
#include "formats/formats_tets.h"
#include "mesh/mesh.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- regions ---- */

bool tli_is_region_name(const char *name)
{
    static const char *const words[] = {"region", "material", "block"};
    static const char *const endings[] = {"", "id", "ids", "s", "number", "no", "index"};
    for (size_t w = 0; w < sizeof words / sizeof words[0]; w++) {
        const char *at = name;
        while (isspace((unsigned char)*at)) at++;
        size_t length = 0;
        while (words[w][length] && tolower((unsigned char)at[length]) == words[w][length]) length++;
        if (words[w][length]) continue;
        char rest[8]; /* letters of what follows, in lower case */
        size_t letters = 0;
        for (at += length; *at && letters < sizeof rest - 1; at++)
            if (isalnum((unsigned char)*at)) rest[letters++] = (char)tolower((unsigned char)*at);
        rest[letters] = '\0';
        for (size_t e = 0; !*at && e < sizeof endings / sizeof endings[0]; e++)
            if (strcmp(rest, endings[e]) == 0) return true;
    }
    return false;
}

/* All values are ids as they stand. */
static bool holds_ids(const tli_grid_array *array)
{
    for (uint64_t i = 0; i < array->count; i++)
        if (!tl_scalar_holds(TL_I32, array->values[i] + 0.0)) return false; /* -0 is 0 */
    return array->components == 1;
}

tl_status tli_tets_find_region(tli_tets *t, int *index)
{
    const tli_grid *grid = t->grid;
    *index = -1;
    if (grid->regions && !t->opts.region) return TL_OK; /* the file's own */
    for (uint32_t i = 0; i < grid->cell_array_count; i++) {
        const tli_grid_array *array = &grid->cell_arrays[i];
        bool taken = t->opts.region ? strcmp(array->name, t->opts.region) == 0
                                    : tli_is_region_name(array->name) && holds_ids(array);
        if (!taken) continue;
        if (array->components != 1)
            return tl_fail(t->ctx, TL_ERR_DATA,
                           "the cell array '%s' has %u components, a region has 1", array->name,
                           array->components);
        tl_status st = TL_OK;
        t->region_name = tli_strdup(t->ctx, array->name, &st);
        *index = (int)i;
        return st;
    }
    if (t->opts.region)
        return tl_fail(t->ctx, TL_ERR_DATA, "no cell array is called '%s' (%u cell arrays)",
                       t->opts.region, grid->cell_array_count);
    return TL_OK;
}

tl_status tli_tets_make_regions(tli_tets *t, int index)
{
    tl_status st = TL_OK;
    const tli_grid_array *array = &t->grid->cell_arrays[index];
    t->regions = tl_mem_alloc(t->ctx, t->tet_count, sizeof *t->regions, &st);
    if (st) return st;
    size_t tet = 0;
    for (uint64_t cell = 0; cell < t->cell_count; cell++) {
        uint32_t count = tli_cell_tets(t, cell);
        if (!count) continue;
        double id = round(array->values[cell]) + 0.0; /* never -0 */
        if (!tl_scalar_holds(TL_I32, id))
            return tl_fail(
                t->ctx, TL_ERR_DATA, "cell %llu: '%s' is %g, a region is a 32-bit integer",
                (unsigned long long)(t->cell_first + cell), array->name, array->values[cell]);
        for (uint32_t i = 0; i < count; i++) t->regions[tet++] = (int32_t)id;
    }
    return TL_OK;
}

tl_status tli_tets_take_regions(tli_tets *t)
{
    tl_status st = TL_OK;
    t->regions = tl_mem_alloc(t->ctx, t->tet_count, sizeof *t->regions, &st);
    size_t tet = 0;
    for (uint64_t cell = 0; cell < t->cell_count && !st; cell++)
        for (uint32_t i = tli_cell_tets(t, cell); i; i--)
            t->regions[tet++] = t->grid->regions[cell];
    tl_mem_free(t->ctx, t->grid->regions);
    t->grid->regions = NULL;
    return st;
}

/* ---- cell data, a tuple for each tet ---- */

typedef struct repeat_job {
    const tli_tets *t;
    const tli_grid_array *array;
    double *out;
} repeat_job;

static tl_status repeat_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const repeat_job *job = arg;
    uint32_t components = job->array->components;
    double *out = job->out + job->t->piece_first[begin / TLI_TETS_GRAIN] * components;
    for (size_t cell = begin; cell < end; cell++)
        for (uint32_t i = tli_cell_tets(job->t, cell); i; i--, out += components)
            memcpy(out, job->array->values + cell * components, components * sizeof *out);
    return TL_OK;
}

tl_status tli_tets_repeat(const tli_tets *t, tli_grid_array *array)
{
    tl_status st = TL_OK;
    if (t->one_to_one) return TL_OK;
    size_t tuple = array->components * sizeof(double);
    repeat_job job = {t, array, tl_mem_alloc(t->ctx, t->tet_count, tuple, &st)};
    if (st) return st;
    st = tli_parallel(t->ctx, (size_t)t->cell_count, TLI_TETS_GRAIN, repeat_piece, &job);
    tl_mem_free(t->ctx, array->values);
    array->values = job.out;
    array->count = t->tet_count;
    return st;
}

/* ---- cell data to points ---- */

static int compare_ids(const void *a, const void *b)
{
    tl_lidx x = *(const tl_lidx *)a, y = *(const tl_lidx *)b;
    return (x > y) - (x < y);
}

/* Distinct vertices of the tets of one cell: verts has room for 4 * tet_count. */
static size_t cell_vertices(const tl_lidx *tets, size_t tet_count, tl_lidx *verts)
{
    size_t count = 0;
    if (tet_count > TLI_SPLIT_MAX) {
        memcpy(verts, tets, 4 * tet_count * sizeof *verts);
        qsort(verts, 4 * tet_count, sizeof *verts, compare_ids);
        for (size_t i = 0; i < 4 * tet_count; i++)
            if (i == 0 || verts[i] != verts[count - 1]) verts[count++] = verts[i];
        return count;
    }
    for (size_t i = 0; i < 4 * tet_count; i++) {
        size_t at = 0;
        while (at < count && verts[at] != tets[i]) at++;
        if (at == count) verts[count++] = tets[i];
    }
    return count;
}

static double cell_volume(const tli_tets *t, const tl_lidx *tets, size_t tet_count)
{
    double sum = 0;
    for (size_t i = 0; i < tet_count; i++) {
        double p[4][3];
        tli_tet_corners(t->grid->xyz, tets + 4 * i, p);
        sum += tl_tet_volume(TLI_CORNERS(p));
    }
    return fabs(sum);
}

/* Room for the vertices of any cell. */
static tl_lidx *cell_room(const tli_tets *t, tl_status *st)
{
    return tl_mem_alloc(t->ctx, t->largest_cell, 4 * sizeof(tl_lidx), st);
}

typedef struct average_job {
    tli_tets *t;
    const double *weights; /* [vert_count] volume of the cells at a vertex */
    tli_grid_array *targets;
} average_job;

/* Weights of vertices, from volumes. A vertex of flat cells alone has weight 0. */
static void add_weights(const tli_tets *t, double *weights, tl_lidx *verts)
{
    const tl_lidx *tets = t->tets;
    for (uint64_t cell = 0; cell < t->cell_count; cell++) {
        size_t count = tli_cell_tets(t, cell);
        size_t vert_count = cell_vertices(tets, count, verts);
        double volume = cell_volume(t, tets, count);
        for (size_t v = 0; v < vert_count; v++) weights[verts[v]] += volume;
        tets += 4 * (size_t)count;
    }
}

/* One array: the sum over the cells at a vertex of weight times value, over the sum of weights. At
 * a vertex of flat cells alone they count alike. */
static void average_array(const average_job *job, const tli_grid_array *source, double *counts,
                          tl_lidx *verts, double *out)
{
    const tli_tets *t = job->t;
    const tl_lidx *tets = t->tets;
    uint32_t components = source->components;
    for (uint64_t cell = 0; cell < t->cell_count; cell++) {
        size_t count = tli_cell_tets(t, cell);
        size_t vert_count = cell_vertices(tets, count, verts);
        double volume = cell_volume(t, tets, count);
        for (size_t v = 0; v < vert_count; v++) {
            bool flat = job->weights[verts[v]] == 0;
            counts[verts[v]] += flat;
            double *sum = out + (size_t)verts[v] * components;
            for (uint32_t c = 0; c < components; c++)
                sum[c] += (flat ? 1 : volume) * source->values[cell * components + c];
        }
        tets += 4 * (size_t)count;
    }
    for (size_t v = 0; v < t->vert_count; v++) {
        double weight = job->weights[v] == 0 ? counts[v] : job->weights[v];
        for (uint32_t c = 0; c < components; c++) out[v * components + c] /= weight;
    }
}

static tl_status average_task(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const average_job *job = arg;
    tl_status st = TL_OK;
    for (size_t i = begin; i < end && !st; i++) {
        const tli_grid_array *source = &job->t->grid->cell_arrays[i];
        tli_grid_array *target = &job->targets[i];
        if (!target->name) continue; /* the regions */
        double *counts = tl_mem_zalloc(job->t->ctx, job->t->vert_count, sizeof *counts, &st);
        tl_lidx *verts = cell_room(job->t, &st);
        if (!st) average_array(job, source, counts, verts, target->values);
        tl_mem_free(job->t->ctx, verts);
        tl_mem_free(job->t->ctx, counts);
    }
    return st;
}

/* Makes the point arrays that the averages go into; targets [cell_array_count] point to the same
 * values. */
static tl_status add_targets(tli_tets *t, int region_index, tli_grid_array *targets)
{
    tl_status st = TL_OK;
    uint64_t points = t->grid->point_count;
    t->grid->point_count = t->vert_count; /* the unused ones are gone */
    for (uint32_t i = 0; i < t->grid->cell_array_count && !st; i++) {
        if ((int)i == region_index) continue;
        const tli_grid_array *source = &t->grid->cell_arrays[i];
        tli_grid_array *added = NULL;
        double *zeros =
            tl_mem_zalloc(t->ctx, t->vert_count, source->components * sizeof *zeros, &st);
        if (!st)
            st = tli_grid_add(t->grid, TL_ON_VERTEX, source->name, source->components,
                              source->scalar, zeros, &added);
        if (st)
            tl_mem_free(t->ctx, zeros);
        else
            targets[i] = *added;
    }
    t->grid->point_count = points;
    return st;
}

tl_status tli_tets_average_cells(tli_tets *t, int region_index)
{
    tl_status st = TL_OK;
    uint32_t arrays = t->grid->cell_array_count;
    double *weights = tl_mem_zalloc(t->ctx, t->vert_count, sizeof *weights, &st);
    tli_grid_array *targets = tl_mem_zalloc(t->ctx, arrays, sizeof *targets, &st);
    tl_lidx *verts = cell_room(t, &st);
    if (!st) st = add_targets(t, region_index, targets);
    if (!st) {
        average_job job = {t, weights, targets};
        add_weights(t, weights, verts);
        st = tli_parallel(t->ctx, arrays, 1, average_task, &job);
    }
    tl_mem_free(t->ctx, verts);
    tl_mem_free(t->ctx, targets);
    tl_mem_free(t->ctx, weights);
    for (uint32_t i = arrays; i-- > 0 && !st;)
        if ((int)i != region_index) tli_grid_drop_array(t->grid, TL_ON_TET, i);
    return st;
}

/* ---- into the mesh ---- */

typedef struct finite_job {
    tli_tets *t;
    const double *values;
} finite_job;

static tl_status finite_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const finite_job *job = arg;
    uint64_t count = 0;
    for (size_t i = begin; i < end; i++) count += !isfinite(job->values[i]);
    job->t->tallies[worker].nonfinite_values += count;
    return TL_OK;
}

static tl_status hand_array(tli_tets *t, tl_mesh *mesh, tl_on on, tli_grid_array *array)
{
    size_t tuples = on == TL_ON_TET ? t->tet_count : t->vert_count;
    finite_job job = {t, array->values};
    tl_status st =
        tli_parallel(t->ctx, tuples * array->components, TLI_TETS_GRAIN, finite_piece, &job);
    tl_channel channel = {.name = array->name,
                          .unit = "",
                          .components = array->components,
                          .on = on,
                          .scalar = array->scalar,
                          .values = array->values};
    if (!st) st = tl_mesh_adopt_channel(mesh, &channel);
    if (!st) array->values = NULL;
    return st;
}

tl_status tli_tets_hand_over(tli_tets *t, tl_mesh *mesh)
{
    tli_grid *grid = t->grid;
    tl_status st = TL_OK;
    for (uint32_t i = 0; i < grid->point_array_count && !st; i++)
        st = hand_array(t, mesh, TL_ON_VERTEX, &grid->point_arrays[i]);
    for (uint32_t i = 0; i < grid->cell_array_count && !st; i++) {
        st = tli_tets_repeat(t, &grid->cell_arrays[i]);
        if (!st) st = hand_array(t, mesh, TL_ON_TET, &grid->cell_arrays[i]);
    }
    return st;
}
