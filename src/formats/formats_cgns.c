/* CGNS: bases, zones, coordinates and steps, by the Standard Interface Data Structures. Each zone
 * becomes a block with the zone as region. The library is not used: the Debian one has indices of
 * 32 bits, reads whole arrays into memory of its own, and takes the numbers of a damaged file for
 * good. */
#include "formats/formats_cgns.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Steps of a file at most. */
#define STEPS_MAX 1000000

/* ---- steps ---- */

static const tli_cg_node *first_base(const tli_cg *cg)
{
    return tli_cg_labelled(cg->root, "CGNSBase_t", NULL);
}

/* Times of the first base; one step without a time where it has none. */
static tl_status list_times(tli_cg *cg, tl_steps *steps)
{
    const tli_cg_node *base = first_base(cg), *iterative = NULL, *times = NULL;
    if (base) iterative = tli_cg_labelled(base, "BaseIterativeData_t", NULL);
    if (iterative) times = tli_cg_child(iterative, "TimeValues");
    uint64_t count = times ? times->count : 0;
    if (count > STEPS_MAX) return tli_cg_fail(cg, times, "has too many steps");
    tl_status st = tli_steps_alloc(cg->ctx, count ? (size_t)count : 1, steps);
    return st || !count ? st : tli_cg_reals(cg, times, 0, count, steps->times, 1);
}

tl_status tli_cg_step_name(tli_cg_zone *zone, const char *pointers, char name[TLI_CG_NAME])
{
    const tli_cg_node *iterative = tli_cg_labelled(zone->node, "ZoneIterativeData_t", NULL);
    const tli_cg_node *list = iterative ? tli_cg_child(iterative, pointers) : NULL;
    name[0] = '\0';
    if (!list || list->rank < 1 || list->dims[0] == 0) return TL_OK;
    return tli_cg_text(zone->cg, list, zone->step * list->dims[0], list->dims[0], name,
                       TLI_CG_NAME);
}

/* The grid moves where zones name several coordinates. */
static tl_status find_motion(tli_cg *cg, tl_steps *steps)
{
    steps->mesh = TL_STEPS_STATIC;
    const tli_cg_node *base = first_base(cg);
    const tli_cg_node *zone = base ? tli_cg_labelled(base, "Zone_t", NULL) : NULL;
    for (; zone; zone = tli_cg_labelled(base, "Zone_t", zone)) {
        const tli_cg_node *first = tli_cg_labelled(zone, "GridCoordinates_t", NULL);
        if (first && tli_cg_labelled(zone, "GridCoordinates_t", first))
            steps->mesh = TL_STEPS_MOVING;
    }
    return TL_OK;
}

/* ---- zones ---- */

static tl_status read_sizes(tli_cg_zone *zone)
{
    tli_cg *cg = zone->cg;
    const tli_cg_node *type = tli_cg_child(zone->node, "ZoneType");
    char text[TLI_CG_NAME];
    int64_t sizes[9];
    tl_status st = tli_cg_text(cg, type, 0, 32, text, sizeof text);
    if (st) return st;
    zone->structured = strcmp(text, "Unstructured") != 0;
    zone->axes = (unsigned)(zone->node->count / 3);
    if (zone->node->count % 3 || zone->axes < 1 || zone->axes > 3 ||
        (!zone->structured && zone->axes != 1))
        return tli_cg_fail(cg, zone->node, "has no sizes of a zone");
    st = tli_cg_ints(cg, zone->node, 0, zone->node->count, sizes);
    uint64_t points = 1;
    for (unsigned axis = 0; axis < 3 && !st; axis++) {
        zone->points[axis] = zone->cells[axis] = 1;
        if (axis >= zone->axes) continue;
        if (sizes[axis] < 0 || sizes[axis] > TL_MESH_VERTS_MAX || sizes[axis + zone->axes] < 0)
            return tli_cg_fail(cg, zone->node, "has sizes that can't be");
        zone->points[axis] = (uint64_t)sizes[axis];
        zone->cells[axis] = (uint64_t)sizes[axis + zone->axes];
        points *= zone->points[axis];
        if (points > TL_MESH_VERTS_MAX) return tli_cg_fail(cg, zone->node, "has too many points");
    }
    zone->grid->point_count = points;
    return st;
}

/* Layers beyond the zone at both ends of each axis, of coordinates and values. */
tl_status tli_cg_rind(tli_cg_zone *zone, const tli_cg_node *node, uint64_t rind[6])
{
    const tli_cg_node *planes = tli_cg_child(node, "Rind");
    int64_t values[6] = {0};
    memset(rind, 0, 6 * sizeof *rind);
    if (!planes) return TL_OK;
    if (planes->count != 2 * zone->axes) return tli_cg_fail(zone->cg, planes, "is no Rind");
    tl_status st = tli_cg_ints(zone->cg, planes, 0, planes->count, values);
    for (unsigned i = 0; i < 2 * zone->axes && !st; i++) {
        if (values[i] < 0 || values[i] > UINT16_MAX)
            return tli_cg_fail(zone->cg, planes, "has too many layers");
        rind[i] = (uint64_t)values[i];
    }
    return st;
}

tl_status tli_cg_read_placed(tli_cg_zone *zone, const tli_cg_node *array, const uint64_t sizes[3],
                             const uint64_t rind[6], double *out, size_t stride)
{
    uint64_t all[3], total = 1;
    tl_status st = TL_OK;
    for (unsigned axis = 0; axis < 3; axis++) {
        all[axis] = sizes[axis] + rind[2 * axis] + rind[2 * axis + 1];
        total *= all[axis];
    }
    if (array->count != total)
        return tli_cg_fail(zone->cg, array, "is not of the size of its zone");
    if (total == sizes[0] * sizes[1] * sizes[2])
        return tli_cg_reals(zone->cg, array, 0, total, out, stride);
    for (uint64_t k = 0; k < sizes[2] && !st; k++)
        for (uint64_t j = 0; j < sizes[1] && !st; j++) {
            uint64_t first = rind[0] + all[0] * (j + rind[2] + all[1] * (k + rind[4]));
            st = tli_cg_reals(zone->cg, array, first, sizes[0], out, stride);
            out += sizes[0] * stride;
        }
    return st;
}

static tl_status read_points(tli_cg_zone *zone)
{
    static const char *const names[3] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
    tli_cg *cg = zone->cg;
    tli_grid *grid = zone->grid;
    char name[TLI_CG_NAME];
    uint64_t rind[6];
    tl_status st = tli_cg_step_name(zone, "GridCoordinatesPointers", name);
    const tli_cg_node *group = *name ? tli_cg_child(zone->node, name) : NULL;
    if (!group) group = tli_cg_labelled(zone->node, "GridCoordinates_t", NULL);
    if (st) return st;
    if (!group) return tli_cg_fail(cg, zone->node, "has no coordinates");
    st = tli_cg_rind(zone, group, rind);
    const tli_cg_node *first = tli_cg_child(group, names[0]);
    if (!st && (!first || first->count < grid->point_count))
        return tli_cg_fail(cg, group,
                           "has no CoordinateX for all points: other systems than "
                           "Cartesian ones are not read");
    grid->xyz = tl_mem_zalloc(cg->ctx, (size_t)grid->point_count, 3 * sizeof *grid->xyz, &st);
    for (int k = 0; k < 3 && !st; k++) {
        const tli_cg_node *array = tli_cg_child(group, names[k]);
        if (array) st = tli_cg_read_placed(zone, array, zone->points, rind, grid->xyz + k, 3);
    }
    return st;
}

static tl_status make_block(tli_cg_zone *zone)
{
    tl_status st = TL_OK;
    tli_grid *grid = zone->grid;
    grid->blocks = tl_mem_zalloc(zone->cg->ctx, 1, sizeof *grid->blocks, &st);
    if (st) return st;
    grid->block_count = 1;
    for (int axis = 0; axis < 3; axis++) grid->blocks[0].dims[axis] = (uint32_t)zone->points[axis];
    return TL_OK;
}

static tl_status read_zone(tli_cg_zone *zone)
{
    tl_status st = read_sizes(zone);
    if (!st) st = read_points(zone);
    if (!st) st = zone->structured ? make_block(zone) : tli_cg_read_sections(zone);
    if (!st) st = tli_cg_read_fields(zone);
    if (!st) st = tli_cg_read_bcs(zone);
    for (size_t s = 0; s < zone->section_count; s++)
        tl_mem_free(zone->cg->ctx, zone->sections[s].places);
    tl_mem_free(zone->cg->ctx, zone->sections);
    return st;
}

/* ---- doors ---- */

/* All zones of all bases; number counts them from 1. */
static tl_status read_base(tli_cg *cg, const tli_cg_node *base, size_t step, int32_t *number,
                           tli_grid *grid)
{
    int64_t dims[2] = {3, 3};
    tl_status st = base->count == 2 ? tli_cg_ints(cg, base, 0, 2, dims)
                                    : tli_cg_fail(cg, base, "has no dimensions of a base");
    if (!st && (dims[0] < 1 || dims[0] > 3)) st = tli_cg_fail(cg, base, "is of no dimension");
    const tli_cg_node *node = tli_cg_labelled(base, "Zone_t", NULL);
    for (; node && !st; node = tli_cg_labelled(base, "Zone_t", node)) {
        tli_grid part;
        tli_cg_zone zone = {.cg = cg,
                            .node = node,
                            .grid = &part,
                            .whole = grid,
                            .cell_dim = (unsigned)dims[0],
                            .step = step};
        tli_grid_init(cg->ctx, &part);
        st = read_zone(&zone);
        if (!st && zone.surface_elements)
            tl_log(cg->ctx, TL_LOG_INFO, "zone '%s': %llu elements on its surface kept as labels",
                   node->name, (unsigned long long)zone.surface_elements);
        const tli_join how = {true, ++*number, node->name};
        if (!st) st = tli_grid_join(grid, &part, &how);
        tli_grid_release(&part);
    }
    return st;
}

tli_match tli_match_cgns(const tli_source *source)
{
    if (strncmp(source->head + 4, "ADF Database Version", 20) == 0) return TLI_MATCH_BYTES;
    bool hdf5 = tli_head_begins(source, "\x89HDF\r\n\x1a\n");
    return hdf5 && tli_source_holds(source, "CGNSLibraryVersion") ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

tl_status tli_steps_cgns(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                         tl_steps *steps)
{
    tli_cg cg;
    (void)opts;
    tl_status st = tli_cg_open(ctx, source, &cg);
    if (!st) st = list_times(&cg, steps);
    if (!st) st = find_motion(&cg, steps);
    tli_cg_close(&cg);
    return st;
}

tl_status tli_read_cgns(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                        tli_grid *grid)
{
    tli_cg cg;
    tl_steps steps = {0};
    size_t step = 0;
    int32_t number = 0;
    tl_status st = tli_cg_open(ctx, source, &cg);
    if (!st) st = list_times(&cg, &steps);
    if (!st) st = tli_steps_pick(ctx, opts, steps.times, steps.count, &step);
    const tli_cg_node *base = st ? NULL : first_base(&cg);
    if (!st && !base)
        st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': a CGNS file without a base", source->path);
    for (; base && !st; base = tli_cg_labelled(cg.root, "CGNSBase_t", base))
        st = read_base(&cg, base, step, &number, grid);
    if (!st) grid->time = steps.times[step];
    if (!st && cg.links_left_out)
        tl_log(ctx, TL_LOG_INFO, "%llu links left out", (unsigned long long)cg.links_left_out);
    tl_steps_release(ctx, &steps);
    tli_cg_close(&cg);
    return st;
}
