/* OpenFOAM: zones of cells become regions, 1 and so on in the order of their file; cells of no zone
 * are region 0. Of several zones of a cell the first counts. */
#include "formats/formats_openfoam.h"

/* Most zones of a mesh. */
#define ZONES_MAX 65536

/* The list of cells, whose type may stand before it. */
static tl_status read_labels(tli_foam *file, uint64_t cells, uint64_t *count, uint32_t **labels)
{
    tli_span word;
    char c = tli_foam_peek(file);
    tl_status st = TL_OK;
    if (!(c >= '0' && c <= '9')) st = tli_foam_word(file, &word); /* List<label> */
    return st ? st
              : tli_foam_labels(file, "cells of a zone", 0, (int64_t)cells - 1, cells, count,
                                labels);
}

static tl_status read_zone(tli_foam *file, int32_t region, uint64_t *doubled, tli_grid *grid)
{
    tli_span word;
    char name[256];
    uint64_t count = 0;
    uint32_t *labels = NULL;
    tl_status st = tli_foam_word(file, &word);
    if (st) return st;
    tli_span_text(word, name, sizeof name);
    st = tli_foam_take(file, '{');
    while (!st && tli_foam_peek(file) != '}') {
        st = tli_foam_word(file, &word);
        if (!st && !labels && tli_span_is(word, "cellLabels"))
            st = read_labels(file, grid->cell_count, &count, &labels);
        if (!st) st = tli_foam_skip_entry(file);
    }
    if (!st) st = tli_foam_take(file, '}');
    for (uint64_t i = 0; !st && i < count; i++) {
        *doubled += grid->regions[labels[i]] != 0;
        if (grid->regions[labels[i]] == 0) grid->regions[labels[i]] = region;
    }
    tl_mem_free(file->ctx, labels);
    return st ? st : tli_grid_name_region(grid, region, name);
}

tl_status tli_foam_zones(tli_foam *file, tli_grid *grid)
{
    uint64_t count = 0, doubled = 0;
    bool one = false;
    tl_status st = tli_foam_begin_list(file, "zones", 4, 0, &count, &one);
    if (!st && count > ZONES_MAX)
        st = tli_scan_fail(&file->scan, "%llu zones, expected at most %d",
                           (unsigned long long)count, ZONES_MAX);
    if (st || count == 0) return st;
    grid->regions = tl_mem_zalloc(file->ctx, (size_t)grid->cell_count, sizeof *grid->regions, &st);
    for (uint64_t i = 0; !st && i < count; i++)
        st = read_zone(file, (int32_t)i + 1, &doubled, grid);
    if (!st && doubled)
        tl_log(file->ctx, TL_LOG_INFO, "'%s': %llu cells are in several zones: the first is taken",
               file->path, (unsigned long long)doubled);
    return st;
}
