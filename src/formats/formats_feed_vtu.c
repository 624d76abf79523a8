/* Unstructured VTK XML files as a source: arrays that stand in the file as plain bytes, so that any
 * range of them can be read. Pages of the map are given back after each read. */
#include "formats/formats_feeder.h"
#include "formats/formats_vtkxml.h"

#include <string.h>

typedef struct vtu_reader {
    tli_feeder feeder;
    tli_vx_file file;
    tli_vx_field *fields[2]; /* by tl_on, owned */
} vtu_reader;

static vtu_reader *of(tli_feeder *feeder)
{
    return (vtu_reader *)feeder;
}

/* The part of a piece that lies in [first, first + count) of all pieces: begin and end in the
 * piece; false if there is none. */
static bool overlap(uint64_t piece_first, uint64_t piece_count, uint64_t first, uint64_t count,
                    uint64_t *begin, uint64_t *end)
{
    uint64_t low = first > piece_first ? first : piece_first;
    uint64_t high = first + count, piece_end = piece_first + piece_count;
    if (high > piece_end) high = piece_end;
    *begin = low - piece_first;
    *end = high > low ? high - piece_first : *begin;
    return high > low;
}

static tl_status vtu_points(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz)
{
    tli_vx_file *file = &of(feeder)->file;
    tl_status st = TL_OK;
    for (size_t p = 0; !st && p < file->piece_count; p++) {
        const tli_vx_piece *piece = &file->pieces[p];
        uint64_t begin, end;
        if (!overlap(piece->first_point, piece->point_count, first, count, &begin, &end)) continue;
        tli_vx_target target = {.f64 = xyz + 3 * (piece->first_point + begin - first)};
        st = tli_vx_read_part(file, tli_vx_find(file, piece, TLI_VX_POINTS, NULL), 3 * begin,
                              3 * (end - begin), &target);
    }
    return st;
}

static tl_status vtu_values(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                            uint64_t count, double *values)
{
    tli_vx_file *file = &of(feeder)->file;
    const tli_vx_field *field = &of(feeder)->fields[on][array];
    const uint64_t n = field->components;
    tl_status st = TL_OK;
    for (size_t p = 0; !st && p < file->piece_count; p++) {
        const tli_vx_piece *piece = &file->pieces[p];
        const bool points = on == TL_ON_VERTEX;
        uint64_t begin, end, piece_first = points ? piece->first_point : piece->first_cell;
        if (!overlap(piece_first, points ? piece->point_count : piece->cell_count, first, count,
                     &begin, &end))
            continue;
        tli_vx_target target = {.f64 = values + n * (piece_first + begin - first)};
        st = tli_vx_read_part(file, tli_vx_field_in(file, on, field, piece), n * begin,
                              n * (end - begin), &target);
    }
    return st;
}

/* Offsets of cells [begin, end) of a piece go to offsets + 1, counted on from *length. from: where
 * the connectivity of cell begin starts. */
static tl_status read_ends(vtu_reader *r, const tli_vx_piece *piece, uint64_t begin, uint64_t end,
                           uint64_t *offsets, uint64_t *from)
{
    tli_vx_file *file = &r->file;
    const tli_vx_array *ends = tli_vx_find(file, piece, TLI_VX_CELLS, "offsets");
    const tli_vx_array *points = tli_vx_find(file, piece, TLI_VX_CELLS, "connectivity");
    const uint64_t limit = points->value_count + 1, before = offsets[0];
    tl_status st = TL_OK;
    *from = 0;
    if (begin) {
        tli_vx_target first = {.u64 = from, .limit = limit};
        st = tli_vx_read_part(file, ends, begin - 1, 1, &first);
    }
    tli_vx_target target = {.u64 = offsets + 1, .limit = limit};
    if (!st) st = tli_vx_read_part(file, ends, begin, end - begin, &target);
    uint64_t last = *from;
    for (uint64_t i = 0; !st && i < end - begin; i++) {
        if (offsets[i + 1] < last)
            st = tli_vx_fail_offset(file, ends, begin + i, offsets[i + 1], last);
        last = offsets[i + 1];
        offsets[i + 1] += before - *from;
    }
    return st;
}

/* Cells [begin, end) of a piece into places from on. */
static tl_status read_piece_cells(vtu_reader *r, const tli_vx_piece *piece, uint64_t begin,
                                  uint64_t end, uint64_t place, tli_grid *window)
{
    tli_vx_file *file = &r->file;
    tl_status st = TL_OK;
    uint64_t from, before = window->offsets[place];
    st = read_ends(r, piece, begin, end, window->offsets + place, &from);
    if (st) return st;
    uint64_t after = window->offsets[place + end - begin];
    window->connectivity = tl_mem_resize(file->ctx, window->connectivity, (size_t)after,
                                         sizeof *window->connectivity, &st);
    if (st) return st;
    tli_vx_target ids = {.u32 = window->connectivity + before,
                         .limit = piece->point_count,
                         .add = piece->first_point};
    tli_vx_target types = {.u8 = window->types + place, .limit = 256};
    st = tli_vx_read_part(file, tli_vx_find(file, piece, TLI_VX_CELLS, "connectivity"), from,
                          after - before, &ids);
    if (!st)
        st = tli_vx_read_part(file, tli_vx_find(file, piece, TLI_VX_CELLS, "types"), begin,
                              end - begin, &types);
    return st;
}

static tl_status vtu_cells(tli_feeder *feeder, uint64_t first, uint64_t count, tli_grid *window)
{
    vtu_reader *r = of(feeder);
    tl_status st = TL_OK;
    window->offsets = tl_mem_alloc(feeder->ctx, (size_t)count + 1, sizeof *window->offsets, &st);
    window->types = tl_mem_alloc(feeder->ctx, (size_t)count, 1, &st);
    if (!st) window->offsets[0] = 0;
    for (size_t p = 0; !st && p < r->file.piece_count; p++) {
        const tli_vx_piece *piece = &r->file.pieces[p];
        uint64_t begin, end;
        if (overlap(piece->first_cell, piece->cell_count, first, count, &begin, &end))
            st = read_piece_cells(r, piece, begin, end, piece->first_cell + begin - first, window);
    }
    return st;
}

/* Counts by the types alone, each as its usual number of tets. */
static tl_status vtu_estimate(tli_feeder *feeder, uint64_t *tets)
{
    enum { STEP = 65536 };
    tli_vx_file *file = &of(feeder)->file;
    uint8_t types[STEP];
    tl_status st = TL_OK;
    *tets = 0;
    for (size_t p = 0; p < file->piece_count; p++) {
        const tli_vx_piece *piece = &file->pieces[p];
        for (uint64_t first = 0; first < piece->cell_count; first += STEP) {
            uint64_t left = piece->cell_count - first, count = left < STEP ? left : STEP;
            tli_vx_target target = {.u8 = types, .limit = 256};
            st = tli_vx_read_part(file, tli_vx_find(file, piece, TLI_VX_CELLS, "types"), first,
                                  count, &target);
            if (st) return st;
            for (uint64_t i = 0; i < count; i++) *tets += tli_feeder_usual_tets(types[i]);
        }
    }
    return TL_OK;
}

static void vtu_close(tli_feeder *feeder)
{
    tl_ctx *ctx = feeder->ctx;
    vtu_reader *r = of(feeder);
    tli_feeder_drop_arrays(feeder);
    tl_mem_free(ctx, r->fields[0]);
    tl_mem_free(ctx, r->fields[1]);
    tli_vx_release(&r->file);
    tl_mem_free(ctx, r);
}

/* Whether all arrays that will be read can be read in parts, and no cell needs more than its
 * corners. */
static bool is_plain(const tli_vx_file *file)
{
    if (file->kind != TLI_VX_UNSTRUCTURED) return false;
    for (size_t i = 0; i < file->array_count; i++) {
        const tli_vx_array *array = &file->arrays[i];
        if (array->section == TLI_VX_FIELD_DATA) continue;
        if (!tli_vx_has_parts(file, array)) return false;
        if (array->section == TLI_VX_CELLS && !tli_span_is(array->name, "connectivity") &&
            !tli_span_is(array->name, "offsets") && !tli_span_is(array->name, "types"))
            return false; /* faces of polyhedra */
    }
    return true;
}

static tl_status find_fields(vtu_reader *r, tl_on on)
{
    size_t count = 0;
    char name[256];
    tl_status st = tli_vx_fields_find(&r->file, on, &r->fields[on], &count);
    for (size_t i = 0; !st && i < count; i++) {
        const tli_vx_field *field = &r->fields[on][i];
        tli_vx_field_name(field, name, sizeof name);
        st = tli_feeder_add(&r->feeder, on, name, field->components, field->scalar);
    }
    return st;
}

bool tli_feeder_is_xml(const tli_map *map)
{
    static const char start[] = "<?xml", root[] = "<VTKFile";
    return map->byte_count >= sizeof root && (memcmp(map->bytes, start, sizeof start - 1) == 0 ||
                                              memcmp(map->bytes, root, sizeof root - 1) == 0);
}

tl_status tli_feeder_open_vtu(tl_ctx *ctx, const tli_map *map, const char *path,
                              tli_feeder **feeder)
{
    tl_status st = TL_OK;
    *feeder = NULL;
    if (!tli_feeder_is_xml(map)) return TL_OK;
    vtu_reader *r = tl_mem_zalloc(ctx, 1, sizeof *r, &st);
    if (st) return st;
    r->feeder = (tli_feeder){.ctx = ctx,
                             .points = vtu_points,
                             .values = vtu_values,
                             .cells = vtu_cells,
                             .estimate = vtu_estimate,
                             .close = vtu_close};
    st = tli_vx_head_read(ctx, map, &r->file);
    if (st || !is_plain(&r->file)) {
        /* what is wrong is said, with the place, when the file is read as a whole */
        vtu_close(&r->feeder);
        return st == TL_ERR_FORMAT || st == TL_ERR_UNSUPPORTED ? TL_OK : st;
    }
    tli_grid counts;
    tli_grid_init(ctx, &counts);
    st = tli_vx_unstructured_open(&r->file, &counts);
    if (!st) st = tli_vx_time_read(&r->file);
    if (!st) st = find_fields(r, TL_ON_VERTEX);
    if (!st) st = find_fields(r, TL_ON_TET);
    if (st) {
        vtu_close(&r->feeder);
        return tl_note(ctx, st, "while reading '%s' as VTK XML", path);
    }
    r->feeder.point_count = counts.point_count;
    r->feeder.cell_count = counts.cell_count;
    r->feeder.time = r->file.time;
    *feeder = &r->feeder;
    return TL_OK;
}
