/* Gmsh: values at points, cells and corners of cells. Each section holds one array of one step.
 * Values at corners become their mean at each point. */
#include "formats/formats_gmsh.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TAGS_MAX 1024
#define COMPONENTS_MAX 65536
#define SECTIONS_MAX 100000

/* ---- heads ---- */

static tl_status read_strings(tli_gmsh *g, tli_gmsh_data *data)
{
    int64_t count = 0;
    tl_status st = tli_scan_int(&g->scan, "the number of texts", 0, TAGS_MAX, &count);
    tli_span line = {0};
    if (!st) tli_scan_line(&g->scan, &line);
    for (int64_t i = 0; !st && i < count; i++) {
        if (!tli_scan_line(&g->scan, &line)) return tli_scan_fail(&g->scan, "expected a text");
        if (i > 0) continue;
        while (line.bytes && (line.text[0] == ' ' || line.text[0] == '"'))
            line.text++, line.bytes--;
        while (line.bytes && (line.text[line.bytes - 1] == ' ' || line.text[line.bytes - 1] == '"'))
            line.bytes--;
        data->name = line;
    }
    return st;
}

/* Texts: the name. Reals: the time. Whole numbers: step, components, entities, partition. */
static tl_status read_head(tli_gmsh *g, tli_gmsh_data *data)
{
    int64_t count = 0, numbers[3] = {0, 1, 0}, number = 0;
    double real = 0;
    tli_span rest;
    *data = (tli_gmsh_data){.time = (double)NAN};
    tl_status st = read_strings(g, data);
    if (!st) st = tli_scan_int(&g->scan, "the number of reals", 0, TAGS_MAX, &count);
    for (int64_t i = 0; !st && i < count; i++) {
        st = tli_scan_real(&g->scan, "a real", &real);
        if (i == 0) data->time = real;
    }
    if (!st) st = tli_scan_int(&g->scan, "the number of whole numbers", 3, TAGS_MAX, &count);
    for (int64_t i = 0; !st && i < count; i++) {
        st =
            tli_scan_int(&g->scan, "a step, components or a count", INT32_MIN, UINT32_MAX, &number);
        if (i < 3) numbers[i] = number;
    }
    if (!st && (numbers[1] < 1 || numbers[1] > COMPONENTS_MAX || numbers[2] < 0))
        st = tli_scan_fail(&g->scan, "%" PRId64 " components of %" PRId64 " entities before this",
                           numbers[1], numbers[2]);
    if (st) return st;
    tli_scan_line(&g->scan, &rest);
    data->step = numbers[0];
    data->components = numbers[1];
    data->count = numbers[2];
    data->values = g->scan.at;
    return tli_scan_room(&g->scan, "values", (uint64_t)data->count,
                         (uint64_t)data->components * (g->binary ? 8 : 2));
}

tl_status tli_gmsh_note_data(tli_gmsh *g, tli_gmsh_on on)
{
    tl_status st = TL_OK;
    if (g->data_count == SECTIONS_MAX)
        return tli_scan_fail(&g->scan, "more than %d sections of values", SECTIONS_MAX);
    if ((g->data_count & (g->data_count - 1)) == 0) { /* doubles at powers of two */
        size_t room = g->data_count ? 2 * (size_t)g->data_count : 1;
        g->data = tl_mem_resize(g->ctx, g->data, room, sizeof *g->data, &st);
        g->data_kinds = tl_mem_resize(g->ctx, g->data_kinds, room, 1, &st);
    }
    if (!st) st = read_head(g, &g->data[g->data_count]);
    if (!st) g->data_kinds[g->data_count++] = (uint8_t)on;
    return st;
}

/* ---- steps ---- */

typedef struct step_time {
    int64_t step;
    double time;
} step_time;

static int by_step(const void *a, const void *b)
{
    const step_time *x = a, *y = b;
    return x->step < y->step ? -1 : x->step > y->step;
}

tl_status tli_gmsh_list_steps(const tli_gmsh *g, tl_steps *steps, int64_t **numbers)
{
    tl_status st = TL_OK;
    size_t count = 0;
    if (g->data_count == 0) return tli_steps_alloc(g->ctx, 1, steps);
    step_time *all = tl_mem_alloc(g->ctx, (size_t)g->data_count, sizeof *all, &st);
    *numbers = tl_mem_alloc(g->ctx, (size_t)g->data_count, sizeof **numbers, &st);
    if (!st) {
        for (uint64_t i = 0; i < g->data_count; i++)
            all[i] = (step_time){g->data[i].step, g->data[i].time};
        qsort(all, (size_t)g->data_count, sizeof *all, by_step);
        for (uint64_t i = 0; i < g->data_count; i++)
            if (count == 0 || all[i].step != all[count - 1].step) all[count++] = all[i];
        st = tli_steps_alloc(g->ctx, count, steps);
    }
    for (size_t i = 0; !st && i < count; i++) {
        steps->times[i] = all[i].time;
        (*numbers)[i] = all[i].step;
    }
    tl_mem_free(g->ctx, all);
    return st;
}

/* ---- values ---- */

static tl_status read_tuple(tli_gmsh *g, uint64_t count, double *values)
{
    return tli_gmsh_reals(g, "a value", count, values);
}

/* One value an entity: at points or cells. Entities that are not there are passed over, counted. */
static tl_status read_plain(tli_gmsh *g, const tli_gmsh_data *data, const tli_ids *ids,
                            tli_grid_array *array, double *tuple, uint64_t *unknown)
{
    tl_status st = TL_OK;
    for (int64_t i = 0; !st && i < data->count; i++) {
        int64_t tag = 0;
        st = tli_gmsh_int(g, "a tag", 4, 0, INT32_MAX, &tag);
        if (!st) st = read_tuple(g, array->components, tuple);
        if (st) return st;
        uint32_t index = tli_ids_find(ids, (uint64_t)tag);
        if (index == TL_NONE)
            ++*unknown;
        else
            memcpy(array->values + (size_t)index * array->components, tuple,
                   array->components * sizeof *tuple);
    }
    return st;
}

/* Values at the corners of cells: sums and counts at points. */
static tl_status read_corners(tli_gmsh *g, const tli_gmsh_data *data, tli_grid_array *array,
                              double *tuple, uint32_t *counts, uint64_t *unknown)
{
    const tli_grid *grid = g->grid;
    tl_status st = TL_OK;
    for (int64_t i = 0; !st && i < data->count; i++) {
        int64_t tag = 0, nodes = 0;
        st = tli_gmsh_int(g, "a tag", 4, 0, INT32_MAX, &tag);
        if (!st) st = tli_gmsh_int(g, "a number of nodes", 4, 0, INT32_MAX, &nodes);
        uint32_t cell = st ? TL_NONE : tli_ids_find(&g->elements, (uint64_t)tag);
        uint64_t corners = cell == TL_NONE ? 0 : grid->offsets[cell + 1] - grid->offsets[cell];
        *unknown += cell == TL_NONE;
        for (int64_t n = 0; !st && n < nodes; n++) {
            st = read_tuple(g, array->components, tuple);
            if (st || (uint64_t)n >= corners) continue;
            uint32_t point = grid->connectivity[grid->offsets[cell] + (uint64_t)n];
            counts[point]++;
            for (uint32_t c = 0; c < array->components; c++)
                array->values[(size_t)point * array->components + c] += tuple[c];
        }
    }
    return st;
}

static tl_status read_section(tli_gmsh *g, const tli_gmsh_data *data, tli_gmsh_on on)
{
    char name[256];
    tli_grid_array *array = NULL;
    uint64_t unknown = 0;
    tli_span_text(data->name, name, sizeof name);
    const bool cells = on == TLI_GMSH_ON_ELEMENTS, corners = on == TLI_GMSH_ON_CORNERS;
    const uint32_t components = (uint32_t)data->components;
    tl_status st = tli_grid_add(g->grid, cells ? TL_ON_TET : TL_ON_VERTEX, name, components, TL_F64,
                                NULL, &array);
    if (st) return st;
    for (uint64_t i = 0; i < array->count * components; i++)
        array->values[i] = corners ? 0 : (double)NAN;
    double *tuple = tl_mem_alloc(g->ctx, components, sizeof *tuple, &st);
    uint32_t *counts =
        corners ? tl_mem_zalloc(g->ctx, (size_t)array->count, sizeof *counts, &st) : NULL;
    g->scan.at = data->values;
    if (!st && corners)
        st = read_corners(g, data, array, tuple, counts, &unknown);
    else if (!st)
        st = read_plain(g, data, cells ? &g->elements : &g->points, array, tuple, &unknown);
    for (uint64_t i = 0; !st && corners && i < array->count; i++)
        for (uint32_t c = 0; c < components; c++)
            array->values[i * components + c] /= counts[i]; /* 0 / 0 where there is no value */
    if (!st && corners)
        tl_log(g->ctx, TL_LOG_INFO,
               "'%s': values of '%s' at corners of cells; their mean at each point "
               "is taken",
               g->scan.path, name);
    if (!st && unknown)
        tl_log(g->ctx, TL_LOG_INFO,
               "'%s': %" PRIu64 " values of '%s' of nodes or elements that are "
               "not there; left out",
               g->scan.path, unknown, name);
    tl_mem_free(g->ctx, counts);
    tl_mem_free(g->ctx, tuple);
    return st;
}

/* True if another section holds the same array at another step. */
static bool has_other_step(const tli_gmsh *g, uint64_t index)
{
    const tli_gmsh_data *data = &g->data[index];
    for (uint64_t i = 0; i < g->data_count; i++)
        if (g->data[i].step != data->step && g->data_kinds[i] == g->data_kinds[index] &&
            g->data[i].name.bytes == data->name.bytes &&
            memcmp(g->data[i].name.text, data->name.text, data->name.bytes) == 0)
            return true;
    return false;
}

tl_status tli_gmsh_read_data(tli_gmsh *g, const tl_read_opts *opts)
{
    tl_steps steps = {0};
    int64_t *numbers = NULL;
    size_t step = 0;
    tl_status st = tli_gmsh_list_steps(g, &steps, &numbers);
    if (!st) st = tli_steps_pick(g->ctx, opts, steps.times, steps.count, &step);
    if (!st) g->grid->time = steps.times[step];
    if (!st && g->element_tags) {
        uint64_t *tags = g->element_tags;
        g->element_tags = NULL;
        st = tli_ids_create(g->ctx, tags, g->grid->cell_count, &g->elements);
    }
    for (uint64_t i = 0; !st && i < g->data_count; i++)
        if (g->data[i].step == numbers[step] || !has_other_step(g, i))
            st = read_section(g, &g->data[i], (tli_gmsh_on)g->data_kinds[i]);
    tl_mem_free(g->ctx, numbers);
    tl_steps_release(g->ctx, &steps);
    return st;
}
