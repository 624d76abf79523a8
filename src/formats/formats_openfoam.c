/* OpenFOAM: a case folder with constant/polyMesh and folders of times (openfoam.com, user guide,
 * "File structure of OpenFOAM cases"). Internal fields of volumes are cell data, those of points
 * point data; patches are labels. The pieces of a decomposed case are put together: points at the
 * same place become one. */
#include "formats/formats_openfoam.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define PATH_BYTES 4352

/* ---- the mesh ---- */

static tl_status read_points(const tli_foam_case *c, const char *root, size_t step, tli_grid *grid)
{
    tli_foam file;
    tl_status st = tli_foam_open_mesh_file(c, root, step, "points", &file);
    if (st) return st;
    st = tli_foam_reals(&file, "points", 3, 0, &grid->point_count, &grid->xyz);
    tli_foam_close(&file);
    return st;
}

static tl_status read_faces(const tli_foam_case *c, const char *root, size_t step,
                            tli_foam_mesh *mesh)
{
    tli_foam file;
    tl_status st = tli_foam_open_mesh_file(c, root, step, "faces", &file);
    if (st) return st;
    st = tli_foam_faces(&file, mesh);
    tli_foam_close(&file);
    return st;
}

static tl_status read_cells_of(const tli_foam_case *c, const char *root, size_t step,
                               const char *name, int64_t low, uint64_t most, uint64_t *count,
                               uint32_t **cells)
{
    tli_foam file;
    tl_status st = tli_foam_open_mesh_file(c, root, step, name, &file);
    if (st) return st;
    st = tli_foam_labels(&file, "cells of faces", low, UINT32_MAX - 1, most, count, cells);
    if (!st && *count > most)
        st = tli_scan_fail(&file.scan, "%" PRIu64 " cells of %" PRIu64 " faces before this", *count,
                           most);
    tli_foam_close(&file);
    return st;
}

/* ---- patches ---- */

typedef struct patch {
    char name[128];
    int64_t first, count;
    bool is_processor;
} patch;

static tl_status read_patch(tli_foam *file, patch *p)
{
    tli_span word, value;
    tl_status st = tli_foam_word(file, &word);
    *p = (patch){.first = 0};
    if (!st) tli_span_text(word, p->name, sizeof p->name);
    if (!st) st = tli_foam_take(file, '{');
    while (!st && tli_foam_peek(file) != '}') {
        st = tli_foam_word(file, &word);
        if (!st && (tli_span_is(word, "nFaces") || tli_span_is(word, "startFace"))) {
            st = tli_foam_word(file, &value);
            if (!st &&
                !tli_span_i64s(value, tli_span_is(word, "nFaces") ? &p->count : &p->first, 1))
                st = tli_scan_fail(&file->scan, "expected a number of faces before this");
        } else if (!st && tli_span_is(word, "type")) {
            st = tli_foam_word(file, &value);
            p->is_processor = !st && value.bytes >= 9 && memcmp(value.text, "processor", 9) == 0;
        }
        if (!st) st = tli_foam_skip_entry(file);
    }
    return st ? st : tli_foam_take(file, '}');
}

/* Copies a run of faces to a label. */
static tl_status add_label(const tli_foam_mesh *mesh, const patch *p, int32_t id, tli_grid *grid)
{
    const uint64_t first = (uint64_t)p->first, count = (uint64_t)p->count;
    const uint64_t begin = mesh->face_offsets[first], end = mesh->face_offsets[first + count];
    tl_status st = TL_OK;
    uint64_t *offsets = tl_mem_alloc(mesh->ctx, (size_t)count + 1, sizeof *offsets, &st);
    uint32_t *points = tl_mem_alloc(mesh->ctx, (size_t)(end - begin), sizeof *points, &st);
    if (!st) {
        for (uint64_t i = 0; i <= count; i++) offsets[i] = mesh->face_offsets[first + i] - begin;
        memcpy(points, mesh->face_points + begin, (size_t)(end - begin) * sizeof *points);
        st = tli_grid_add_label(grid, p->name, id, count, offsets, points);
    }
    if (st) {
        tl_mem_free(mesh->ctx, points);
        tl_mem_free(mesh->ctx, offsets);
    }
    return st;
}

static tl_status read_patches(const tli_foam_case *c, const char *root, size_t step,
                              const tli_foam_mesh *mesh, tli_grid *grid)
{
    tli_foam file;
    uint64_t count = 0;
    bool one = false;
    tl_status st = tli_foam_open_mesh_file(c, root, step, "boundary", &file);
    if (st) return st;
    st = tli_foam_begin_list(&file, "patches", 4, 0, &count, &one);
    for (uint64_t i = 0; !st && i < count && tli_foam_peek(&file) != ')'; i++) {
        patch p;
        st = read_patch(&file, &p);
        if (st || p.is_processor || p.count == 0) continue;
        if (p.first < 0 || p.count < 0 || (uint64_t)p.first > mesh->face_count ||
            (uint64_t)p.count > mesh->face_count - (uint64_t)p.first)
            st = tli_scan_fail(&file.scan,
                               "patch '%s' has faces %" PRId64 " on, %" PRId64 ", of %" PRIu64,
                               p.name, p.first, p.count, mesh->face_count);
        else
            st = add_label(mesh, &p, i < INT32_MAX ? (int32_t)i : INT32_MAX, grid);
    }
    tli_foam_close(&file);
    return st;
}

static tl_status read_zones(const tli_foam_case *c, const char *root, size_t step, tli_grid *grid)
{
    tli_foam file;
    bool there;
    tl_status st = tli_foam_find_mesh_file(c, root, step, "cellZones", &file, &there);
    if (st || !there) return st;
    st = tli_foam_zones(&file, grid);
    tli_foam_close(&file);
    return st;
}

static tl_status read_mesh(const tli_foam_case *c, const char *root, size_t step, tli_grid *grid)
{
    tli_foam_mesh mesh = {.ctx = c->ctx, .path = root};
    uint64_t owners = 0;
    tl_status st = read_points(c, root, step, grid);
    mesh.point_count = grid->point_count;
    if (!st && grid->point_count > TL_MESH_VERTS_MAX)
        st = tl_fail(c->ctx, TL_ERR_UNSUPPORTED, "'%s': %" PRIu64 " points, at most %u", root,
                     grid->point_count, TL_MESH_VERTS_MAX);
    if (!st) st = read_faces(c, root, step, &mesh);
    if (!st) st = read_cells_of(c, root, step, "owner", 0, mesh.face_count, &owners, &mesh.owner);
    if (!st && owners != mesh.face_count)
        st = tl_fail(c->ctx, TL_ERR_FORMAT, "'%s': %" PRIu64 " faces with %" PRIu64 " owners", root,
                     mesh.face_count, owners);
    if (!st) /* -1, of faces on the boundary, in old files */
        st = read_cells_of(c, root, step, "neighbour", -1, mesh.face_count, &mesh.neighbour_count,
                           &mesh.neighbour);
    if (!st) st = read_patches(c, root, step, &mesh, grid);
    if (!st) st = tli_foam_make_cells(&mesh, grid);
    if (!st) st = read_zones(c, root, step, grid);
    tl_mem_free(c->ctx, mesh.neighbour);
    tl_mem_free(c->ctx, mesh.owner);
    if (!grid->face_offsets) { /* else the grid has taken them over */
        tl_mem_free(c->ctx, mesh.face_points);
        tl_mem_free(c->ctx, mesh.face_offsets);
    }
    return st;
}

/* ---- fields ---- */

/* What a class of fields is here; false for others. */
static bool field_of(const char *class_name, tl_on *on, uint32_t *components)
{
    static const struct {
        const char *name;
        uint32_t components;
    } kinds[] = {{"ScalarField", 1},
                 {"VectorField", 3},
                 {"SphericalTensorField", 1},
                 {"SymmTensorField", 6},
                 {"TensorField", 9}};
    bool cells = strncmp(class_name, "vol", 3) == 0, points = strncmp(class_name, "point", 5) == 0;
    if (!cells && !points) return false;
    const char *kind = class_name + (cells ? 3 : 5);
    size_t length = strcspn(kind, ":"); /* volScalarField::Internal */
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strlen(kinds[i].name) == length && strncmp(kind, kinds[i].name, length) == 0) {
            *on = cells ? TL_ON_TET : TL_ON_VERTEX;
            *components = kinds[i].components;
            return true;
        }
    return false;
}

/* xx xy xz yy yz zz to xx yy zz xy yz xz. */
static void order_tensors(tli_grid_array *array)
{
    static const uint8_t from[6] = {0, 3, 5, 1, 4, 2};
    for (uint64_t i = 0; i < array->count; i++) {
        double tuple[6];
        memcpy(tuple, array->values + 6 * i, sizeof tuple);
        for (int c = 0; c < 6; c++) array->values[6 * i + (uint64_t)c] = tuple[from[c]];
    }
}

/* Entries up to the one with the values; *found says whether there is one. */
static tl_status read_values(tli_foam *file, uint32_t components, uint64_t count, double *values,
                             bool *found)
{
    tli_span key;
    tl_status st = TL_OK;
    *found = false;
    while (!st && tli_foam_peek(file)) {
        if (tli_foam_peek(file) == '#') { /* a directive: a line */
            tli_scan_line(&file->scan, &key);
            continue;
        }
        st = tli_foam_word(file, &key);
        *found = !st && (tli_span_is(key, "internalField") || tli_span_is(key, "value"));
        if (*found) return tli_foam_field(file, components, count, values);
        if (!st) st = tli_foam_skip_entry(file);
    }
    return st;
}

static tl_status read_field(tli_foam *file, const char *name, tli_grid *grid)
{
    tl_on on = TL_ON_TET;
    uint32_t components = 0;
    tli_grid_array *array = NULL;
    bool found = false;
    if (!field_of(file->class_name, &on, &components)) {
        tl_log(file->ctx, TL_LOG_INFO, "'%s': of class %s, left out", file->path, file->class_name);
        return TL_OK;
    }
    tl_status st =
        tli_grid_add(grid, on, name, components,
                     file->binary && file->scalar_bytes == 4 ? TL_F32 : TL_F64, NULL, &array);
    if (st) return st;
    st = read_values(file, components, array->count, array->values, &found);
    if (st) return st;
    if (!found) {
        tl_log(file->ctx, TL_LOG_INFO, "'%s': no internalField, left out", file->path);
        tli_grid_drop_array(
            grid, on, (on == TL_ON_TET ? grid->cell_array_count : grid->point_array_count) - 1);
        return TL_OK;
    }
    if (components == 6) order_tensors(array);
    return TL_OK;
}

/* A file without a head is none of the case's. */
static bool is_foam(const char *path)
{
    char head[2048];
    size_t length = strlen(path);
    if (length > 3 && strcmp(path + length - 3, ".gz") == 0) return true;
    FILE *file = fopen(path, "rb");
    if (!file) return false;
    size_t got = fread(head, 1, sizeof head - 1, file);
    fclose(file);
    for (size_t i = 0; i < got; i++) head[i] = head[i] ? head[i] : ' ';
    head[got] = '\0';
    return strstr(head, "FoamFile") != NULL;
}

static tl_status read_fields(const tli_foam_case *c, const char *root, size_t step, tli_grid *grid)
{
    char folder[PATH_BYTES], path[PATH_BYTES + 260];
    char **names = NULL;
    size_t count = 0;
    if (c->time_count == 0) return TL_OK;
    snprintf(folder, sizeof folder, "%s/%s", root, c->times[step].name);
    if (!tli_file_exists(folder)) return TL_OK;
    tl_status st = tli_folder_list(c->ctx, folder, &names, &count);
    for (size_t i = 0; !st && i < count; i++) {
        tli_foam file;
        bool there = false;
        size_t length = strlen(names[i]);
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        if (!is_foam(path)) continue;
        if (length > 3 && strcmp(names[i] + length - 3, ".gz") == 0) {
            names[i][length - 3] = '\0';
            path[strlen(path) - 3] = '\0';
            if (tli_file_exists(path)) continue;
        }
        st = tli_foam_open(c->ctx, path, &file, &there);
        if (st || !there) continue;
        st = read_field(&file, names[i], grid);
        tli_foam_close(&file);
    }
    tli_folder_release(c->ctx, names, count);
    return st;
}

/* ---- reader ---- */

tli_match tli_match_openfoam(const tli_source *source)
{
    char folder[PATH_BYTES - 256], path[PATH_BYTES];
    if (!tli_foam_case_of(source, folder, sizeof folder)) return TLI_MATCH_NO;
    if (!source->folder)
        return tli_ends_in(source->path, ".foam .openfoam") ? TLI_MATCH_NAME : TLI_MATCH_BYTES;
    snprintf(path, sizeof path, "%s/constant/polyMesh", folder);
    if (tli_file_exists(path)) return TLI_MATCH_BYTES;
    snprintf(path, sizeof path, "%s/processor0", folder);
    return tli_file_exists(path) ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

static tl_status read_processors(const tli_foam_case *c, size_t step, tli_grid *grid)
{
    tl_status st = TL_OK;
    uint64_t welded = 0;
    for (uint32_t p = 0; !st && p < c->processors; p++) {
        char root[PATH_BYTES];
        tli_grid piece;
        tli_grid_init(c->ctx, &piece);
        snprintf(root, sizeof root, "%s/processor%u", c->folder, p);
        st = read_mesh(c, root, step, &piece);
        if (!st) st = read_fields(c, root, step, &piece);
        if (!st) st = tli_grid_join(grid, &piece, NULL);
        tli_grid_release(&piece);
    }
    if (!st) st = tli_grid_weld(grid, 0, &welded);
    if (!st)
        tl_log(c->ctx, TL_LOG_INFO, "'%s': %u processors, %" PRIu64 " points of several welded",
               c->folder, c->processors, welded);
    return st;
}

tl_status tli_read_openfoam(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                            tli_grid *grid)
{
    tli_foam_case c;
    size_t step = 0;
    tl_status st = tli_foam_case_open(ctx, source, &c);
    if (st) return st;
    double *times = tl_mem_alloc(ctx, c.time_count, sizeof *times, &st);
    for (size_t i = 0; !st && i < c.time_count; i++) times[i] = c.times[i].value;
    if (!st)
        st = tli_steps_pick(ctx, opts, c.time_count ? times : NULL, c.time_count ? c.time_count : 1,
                            &step);
    tl_mem_free(ctx, times);
    if (!st && c.processors)
        st = read_processors(&c, step, grid);
    else if (!st)
        st = read_mesh(&c, c.folder, step, grid);
    if (!st && !c.processors) st = read_fields(&c, c.folder, step, grid);
    if (!st && c.time_count) grid->time = c.times[step].value;
    tli_foam_case_close(&c);
    return st ? tl_note(ctx, st, "while reading the case '%s'", source->path) : TL_OK;
}

tl_status tli_steps_openfoam(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                             tl_steps *steps)
{
    tli_foam_case c;
    char root[PATH_BYTES];
    (void)opts;
    tl_status st = tli_foam_case_open(ctx, source, &c);
    if (st) return st;
    st = tli_steps_alloc(ctx, c.time_count ? c.time_count : 1, steps);
    for (size_t i = 0; !st && i < c.time_count; i++) steps->times[i] = c.times[i].value;
    snprintf(root, sizeof root, c.processors ? "%s/processor0" : "%s", c.folder);
    if (!st && tli_foam_has_mesh_file(&c, root, "faces"))
        steps->mesh = TL_STEPS_CHANGING;
    else if (!st && tli_foam_has_mesh_file(&c, root, "points"))
        steps->mesh = TL_STEPS_MOVING;
    tli_foam_case_close(&c);
    return st;
}
