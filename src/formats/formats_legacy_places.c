/* Legacy VTK files whose large arrays stay in the file: where they are, and any range of the cells.
 * A row of cells of varying length is passed once, and the places of a few are kept. */
#include "formats/formats_legacy.h"
#include "formats/formats_split.h"

#include <inttypes.h>
#include <string.h>

#define ROW_STEP 4096u /* cells between two places that are kept */
#define CHUNK 4096u    /* integers read at a time */

void tli_legacy_forget(const tli_legacy_places *places, const tli_legacy_block *block,
                       uint64_t first, uint64_t count)
{
    const uint64_t begin = (uint64_t)(block->bytes - (const char *)places->map->bytes);
    const uint64_t width =
        block->type->family == TLI_LEGACY_BIT ? 0 : tl_scalar_bytes(block->type->stored);
    tli_map_forget(places->map, begin + first * width, begin + (first + count) * width);
}

void tli_legacy_drop_places(tl_ctx *ctx, tli_legacy_places *places)
{
    for (int on = 0; on < 2; on++) {
        for (uint32_t i = 0; i < places->array_counts[on]; i++)
            tl_mem_free(ctx, places->arrays[on][i].name);
        tl_mem_free(ctx, places->arrays[on]);
    }
    tl_mem_free(ctx, places->row_starts);
}

/* ---- finding ---- */

/* The number of indices of the cell at a place of the row; false if they do not end in it. */
static bool row_length(const tli_legacy_block *row, uint64_t place, uint64_t *length)
{
    int64_t value;
    if (place >= row->count) return false;
    tli_legacy_block_integers(row, place, 1, &value);
    *length = (uint64_t)value;
    return value >= 0 && *length < row->count - place;
}

tl_status tli_legacy_locate_row(tli_legacy *reader, uint64_t cells, uint64_t size)
{
    tli_legacy_places *places = reader->places;
    tli_legacy_block *row = &places->row;
    if (cells > size) return TL_ERR_FORMAT;
    tl_status st = tli_legacy_locate_integers(reader, "cells", tli_legacy_int(), size, row);
    if (st) return st;
    places->row_starts =
        tl_mem_alloc(reader->ctx, (size_t)(cells / ROW_STEP + 1), sizeof *places->row_starts, &st);
    if (st) return st;
    uint64_t place = 0, length, forgotten = 0;
    for (uint64_t cell = 0; cell < cells; cell++) {
        if (cell % ROW_STEP == 0) {
            places->row_starts[cell / ROW_STEP] = place;
            tli_legacy_forget(places, row, forgotten, place - forgotten);
            forgotten = place;
        }
        if (!row_length(row, place, &length)) return TL_ERR_FORMAT;
        place += 1 + length;
    }
    return place == size ? TL_OK : TL_ERR_FORMAT;
}

tl_status tli_legacy_locate_lists(tli_legacy *reader, uint64_t offset_count, uint64_t indices,
                                  uint64_t *cells)
{
    tli_legacy_places *places = reader->places;
    const tli_legacy_type *type;
    if (!offset_count) return TL_ERR_FORMAT;
    tl_status st = tli_legacy_read_type(reader, &type);
    if (!st)
        st = tli_legacy_locate_integers(reader, "OFFSETS", type, offset_count, &places->offsets);
    if (!st && tli_legacy_take(reader, "METADATA")) tli_legacy_skip_metadata(reader);
    if (!st && !tli_legacy_take(reader, "CONNECTIVITY")) st = TL_ERR_FORMAT;
    if (!st) st = tli_legacy_read_type(reader, &type);
    if (!st)
        st = tli_legacy_locate_integers(reader, "CONNECTIVITY", type, indices,
                                        &places->connectivity);
    if (st) return st;
    int64_t first, last;
    tli_legacy_block_integers(&places->offsets, 0, 1, &first);
    tli_legacy_block_integers(&places->offsets, offset_count - 1, 1, &last);
    *cells = offset_count - 1;
    return first == 0 && (uint64_t)last == indices ? TL_OK : TL_ERR_FORMAT;
}

tl_status tli_legacy_locate_array(tli_legacy *reader, const char *name, const tli_legacy_type *type,
                                  uint32_t components, uint64_t count)
{
    tli_legacy_places *places = reader->places;
    const tl_on on = reader->on;
    tli_legacy_array array = {.components = components};
    tl_status st = tli_legacy_locate(reader, name, type, count, components, &array.block);
    if (st) return st;
    array.is_level = components == 1 && strcmp(name, "vtkGhostLevels") == 0;
    array.name = tli_strdup(reader->ctx, array.is_level ? "vtkGhostType" : name, &st);
    places->arrays[on] =
        tl_mem_resize(reader->ctx, places->arrays[on], (size_t)places->array_counts[on] + 1,
                      sizeof *places->arrays[on], &st);
    if (st)
        tl_mem_free(reader->ctx, array.name);
    else
        places->arrays[on][places->array_counts[on]++] = array;
    return st;
}

/* ---- reading ---- */

/* Where a cell begins in the row. */
static bool find_in_row(const tli_legacy_places *places, uint64_t cell, uint64_t *place)
{
    uint64_t length;
    *place = places->row_starts[cell / ROW_STEP];
    for (uint64_t i = cell % ROW_STEP; i; i--) {
        if (!row_length(&places->row, *place, &length)) return false;
        *place += 1 + length;
    }
    return true;
}

static tl_status has_changed(const tli_legacy *reader, uint64_t cell)
{
    return tli_legacy_fail(reader, reader->cells_at, TL_ERR_DATA,
                           "cell %" PRIu64 " changed while the file was read", cell);
}

/* count ids of a block, from first on; stops at one that is no point. Gives how many were read. */
static uint64_t read_ids(const tli_legacy_block *block, uint64_t first, uint64_t count,
                         uint64_t point_count, uint32_t *ids)
{
    for (uint64_t done = 0; done < count;) {
        int64_t values[CHUNK];
        const size_t piece = count - done < CHUNK ? (size_t)(count - done) : CHUNK;
        tli_legacy_block_integers(block, first + done, piece, values);
        for (size_t i = 0; i < piece; i++, done++) {
            if (values[i] < 0 || (uint64_t)values[i] >= point_count) return done;
            ids[done] = (uint32_t)values[i];
        }
    }
    return count;
}

static tl_status bad_id(const tli_legacy *reader, const tli_legacy_block *block, uint64_t place,
                        uint64_t cell)
{
    int64_t value;
    tli_legacy_block_integers(block, place, 1, &value);
    return tli_legacy_fail(reader, reader->cells_at, TL_ERR_FORMAT,
                           "cell %" PRIu64 " names point %" PRId64 ", expected below %" PRIu64,
                           cell, value, reader->grid->point_count);
}

static tl_status read_row_part(const tli_legacy *reader, uint64_t first, uint64_t count,
                               tli_grid *part)
{
    const tli_legacy_places *places = reader->places;
    tl_status st = TL_OK;
    uint64_t begin, length;
    if (!find_in_row(places, first, &begin)) return has_changed(reader, first);
    uint64_t place = begin;
    for (uint64_t i = 0; i < count; i++, place += 1 + length) {
        if (!row_length(&places->row, place, &length)) return has_changed(reader, first + i);
        part->offsets[i + 1] = part->offsets[i] + length;
    }
    part->connectivity =
        tl_mem_alloc(reader->ctx, (size_t)part->offsets[count], sizeof *part->connectivity, &st);
    place = begin;
    for (uint64_t i = 0; !st && i < count; i++) {
        const uint64_t from = part->offsets[i];
        length = part->offsets[i + 1] - from;
        uint64_t done = read_ids(&places->row, place + 1, length, reader->grid->point_count,
                                 part->connectivity + from);
        if (done < length) st = bad_id(reader, &places->row, place + 1 + done, first + i);
        place += 1 + length;
    }
    tli_legacy_forget(places, &places->row, begin, place - begin);
    return st;
}

static tl_status read_lists_part(const tli_legacy *reader, uint64_t first, uint64_t count,
                                 tli_grid *part)
{
    const tli_legacy_places *places = reader->places;
    const uint64_t indices = places->connectivity.count;
    tl_status st = TL_OK;
    uint64_t begin = 0, last = 0;
    for (uint64_t done = 0; done <= count;) {
        int64_t values[CHUNK];
        const size_t piece = count + 1 - done < CHUNK ? (size_t)(count + 1 - done) : CHUNK;
        tli_legacy_block_integers(&places->offsets, first + done, piece, values);
        for (size_t i = 0; i < piece; i++, done++) {
            const uint64_t value = (uint64_t)values[i];
            if (value < last || value > indices)
                return tli_legacy_fail(reader, reader->cells_at, TL_ERR_FORMAT,
                                       "offset %" PRIu64 " is %" PRId64 ", expected %" PRIu64
                                       " to %" PRIu64,
                                       first + done, values[i], last, indices);
            if (!done) begin = value;
            part->offsets[done] = value - begin;
            last = value;
        }
    }
    part->connectivity =
        tl_mem_alloc(reader->ctx, (size_t)part->offsets[count], sizeof *part->connectivity, &st);
    if (st) return st;
    const uint64_t done = read_ids(&places->connectivity, begin, last - begin,
                                   reader->grid->point_count, part->connectivity);
    if (done < last - begin) {
        uint64_t i = 0;
        while (part->offsets[i + 1] <= done) i++;
        return bad_id(reader, &places->connectivity, begin + done, first + i);
    }
    tli_legacy_forget(places, &places->offsets, first, count);
    tli_legacy_forget(places, &places->connectivity, begin, last - begin);
    return TL_OK;
}

tl_status tli_legacy_read_part(const tli_legacy *reader, uint64_t first, uint64_t count,
                               tli_grid *part)
{
    const tli_legacy_places *places = reader->places;
    tl_status st = TL_OK;
    part->offsets = tl_mem_alloc(reader->ctx, (size_t)count + 1, sizeof *part->offsets, &st);
    part->types = tl_mem_alloc(reader->ctx, (size_t)count, 1, &st);
    if (st) return st;
    part->offsets[0] = 0;
    st = places->row_starts ? read_row_part(reader, first, count, part)
                            : read_lists_part(reader, first, count, part);
    for (uint64_t done = 0; !st && done < count;) {
        int64_t values[CHUNK];
        const size_t piece = count - done < CHUNK ? (size_t)(count - done) : CHUNK;
        tli_legacy_block_integers(&places->types, first + done, piece, values);
        for (size_t i = 0; i < piece; i++) part->types[done++] = (uint8_t)values[i];
    }
    tli_legacy_forget(places, &places->types, first, count);
    return st;
}
