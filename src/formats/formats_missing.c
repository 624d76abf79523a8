/* What a file marks as not there: ghosts of a partition (vtkGhostType), blanked points of a
 * structured block (iblank) and fill values. Marks points and cells; the conversion then passes
 * them over. */
#include "formats/formats_tets.h"

#include <math.h>
#include <string.h>

/* Bits of vtkGhostType. */
#define GHOST_CELL_DUPLICATE 1u
#define GHOST_CELL_REFINED 8u
#define GHOST_CELL_HIDDEN 32u
#define GHOST_POINT_HIDDEN 2u

static int find_array(const tli_grid_array *arrays, uint32_t count, const char *name)
{
    for (uint32_t i = 0; i < count; i++)
        if (arrays[i].components == 1 && strcmp(arrays[i].name, name) == 0) return (int)i;
    return -1;
}

/* ---- ghosts ---- */

typedef struct flag_job {
    const double *values;
    unsigned mask; /* 0: anything above zero counts */
    uint8_t *marks, mark;
} flag_job;

static tl_status flag_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const flag_job *job = arg;
    for (size_t i = begin; i < end; i++) {
        double value = job->values[i];
        if (!(value > 0 && value < 256)) continue;
        if (job->mask == 0 || ((unsigned)value & job->mask)) job->marks[i] |= job->mark;
    }
    return TL_OK;
}

/* Older files hold levels (vtkGhostLevels): every cell above level 0 is a copy. */
static tl_status mark_ghosts(tli_tets *t)
{
    tli_grid *grid = t->grid;
    static const struct {
        const char *name;
        tl_on on;
        unsigned mask;
        uint8_t mark;
    } kinds[] = {
        {"vtkGhostType", TL_ON_TET, GHOST_CELL_DUPLICATE | GHOST_CELL_REFINED | GHOST_CELL_HIDDEN,
         TLI_CELL_GHOST},
        {"vtkGhostLevels", TL_ON_TET, 0, TLI_CELL_GHOST},
        {"vtkGhostType", TL_ON_VERTEX, GHOST_POINT_HIDDEN, TLI_POINT_HIDDEN},
    };
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        bool cells = kinds[k].on == TL_ON_TET;
        const tli_grid_array *arrays = cells ? grid->cell_arrays : grid->point_arrays;
        int index = find_array(arrays, cells ? grid->cell_array_count : grid->point_array_count,
                               kinds[k].name);
        if (index < 0) continue;
        flag_job job = {arrays[index].values, kinds[k].mask, cells ? t->cell_marks : t->point_marks,
                        kinds[k].mark};
        tl_status st =
            tli_parallel(t->ctx, (size_t)arrays[index].count, TLI_TETS_GRAIN, flag_piece, &job);
        if (st) return st;
        tli_grid_drop_array(t->grid, kinds[k].on, (uint32_t)index);
    }
    return TL_OK;
}

/* ---- fill values ---- */

typedef struct fill_job {
    tli_tets *t;
    tli_grid_array *array;
    double fill, fill_narrow; /* the value, and as a float32 of the file has it */
    const uint8_t *blanks;    /* points that are missing altogether, or NULL */
    uint8_t *marks, mark;
} fill_job;

static bool is_fill(const fill_job *job, double value)
{
    return value == job->fill || value == job->fill_narrow || (isnan(value) && isnan(job->fill));
}

static tl_status fill_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    const fill_job *job = arg;
    uint32_t components = job->array->components;
    bool keep = job->t->opts.keep_fill, has_fill = job->t->opts.has_fill_value;
    uint64_t filled = 0;
    for (size_t i = begin; i < end; i++) {
        double *values = job->array->values + i * components;
        bool blank = job->blanks && job->blanks[i] == 0;
        for (uint32_t c = 0; c < components; c++) {
            if (!blank && !(has_fill && is_fill(job, values[c]))) continue;
            filled++;
            if (keep)
                values[c] = (double)NAN;
            else
                job->marks[i] |= job->mark;
        }
    }
    job->t->tallies[worker].filled += filled;
    return TL_OK;
}

static tl_status mark_filled(tli_tets *t, tl_on on, tli_grid_array *array)
{
    double fill = t->opts.fill_value;
    bool narrow = array->scalar == TL_F32 && fabs(fill) < 3e38;
    fill_job job = {.t = t,
                    .array = array,
                    .fill = fill,
                    .fill_narrow = narrow ? (double)(float)fill : fill,
                    .blanks = on == TL_ON_VERTEX && t->opts.keep_fill ? t->grid->blanks : NULL,
                    .marks = on == TL_ON_VERTEX ? t->point_marks : t->cell_marks,
                    .mark = on == TL_ON_VERTEX ? TLI_POINT_MISSING : TLI_CELL_BLANK};
    return tli_parallel(t->ctx, (size_t)array->count, TLI_TETS_GRAIN, fill_piece, &job);
}

static tl_status blank_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    tli_tets *t = arg;
    for (size_t i = begin; i < end; i++)
        if (t->grid->blanks[i] == 0) t->point_marks[i] |= TLI_POINT_MISSING;
    return TL_OK;
}

/* Ids of regions are no measured values: a fill value of 0 does not mean region 0. */
static bool names_region(const tli_tets *t, const char *name)
{
    return t->opts.region ? strcmp(name, t->opts.region) == 0 : tli_is_region_name(name);
}

tl_status tli_tets_mark_missing(tli_tets *t)
{
    tli_grid *grid = t->grid;
    tl_status st = mark_ghosts(t);
    if (!st && grid->blanks && !t->opts.keep_fill)
        st = tli_parallel(t->ctx, (size_t)grid->point_count, TLI_TETS_GRAIN, blank_piece, t);
    if (t->opts.has_fill_value || (grid->blanks && t->opts.keep_fill))
        for (uint32_t i = 0; !st && i < grid->point_array_count; i++)
            st = mark_filled(t, TL_ON_VERTEX, &grid->point_arrays[i]);
    if (t->opts.has_fill_value)
        for (uint32_t i = 0; !st && i < grid->cell_array_count; i++)
            if (!names_region(t, grid->cell_arrays[i].name))
                st = mark_filled(t, TL_ON_TET, &grid->cell_arrays[i]);
    tl_mem_free(t->ctx, grid->blanks);
    grid->blanks = NULL;
    return st;
}
