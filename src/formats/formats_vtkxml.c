/* Reads VTK's XML files: unstructured grids (.vtu), image data (.vti), rectilinear (.vtr) and
 * structured grids (.vts), as vtkXMLWriter and its like write them. */
#include <string.h>

#include "formats/formats_vtkxml.h"

/* Field data belong to the whole; of them the time value alone is taken. */
tl_status tli_vx_time_read(tli_vx_file *file)
{
    size_t left_out = 0;
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < file->array_count; i++) {
        tli_vx_array *array = &file->arrays[i];
        if (array->section != TLI_VX_FIELD_DATA) continue;
        if (!tli_span_is(array->name, "TimeValue")) {
            left_out++;
            continue;
        }
        tli_vx_target target = {.f64 = &file->time};
        st = tli_vx_open_expecting(file, array, 1);
        if (!st) st = tli_vx_read(file, array, 1, &target);
    }
    if (!st && left_out)
        tl_log(file->ctx, TL_LOG_INFO, "%zu arrays of field data left out", left_out);
    return st;
}

tl_status tli_read_vtk_xml(tl_ctx *ctx, const tli_map *map, const char *path, tli_grid *grid)
{
    tli_vx_file file;
    tl_status st = tli_vx_head_read(ctx, map, &file);
    if (!st) st = tli_vx_time_read(&file);
    if (!st)
        st = file.kind == TLI_VX_UNSTRUCTURED ? tli_vx_read_unstructured(&file, grid)
                                              : tli_vx_read_structured(&file, grid);
    if (!st) grid->time = file.time;
    tli_vx_release(&file);
    return st ? tl_note(ctx, st, "while reading '%s' as VTK XML", path) : TL_OK;
}
