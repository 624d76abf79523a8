/* Gmsh MSH, versions 2.0 to 2.2, 4.0 and 4.1, text and binary (gmsh.info, reference manual, "MSH
 * file format"). Sections stand between lines $Name and $EndName. Physical groups of volumes are
 * regions and those of surfaces labels; where no element of that dimension has one, the entities of
 * the geometry take their place. */
#include "formats/formats_gmsh.h"

#include "formats/formats_number.h"

#include <inttypes.h>
#include <string.h>

/* ---- numbers ---- */

tl_status tli_gmsh_int(tli_gmsh *g, const char *what, unsigned bytes, int64_t low, int64_t high,
                       int64_t *value)
{
    if (g->binary) return tli_scan_binary_int(&g->scan, what, bytes, low, high, value);
    return tli_scan_int(&g->scan, what, low, high, value);
}

tl_status tli_gmsh_reals(tli_gmsh *g, const char *what, uint64_t count, double *values)
{
    if (g->binary) return tli_scan_binary_reals(&g->scan, what, TL_F64, count, values);
    return tli_scan_reals(&g->scan, what, count, values);
}

tl_status tli_gmsh_count(tli_gmsh *g, const char *what, uint64_t ints, uint64_t reals,
                         uint64_t *count)
{
    int64_t value = 0;
    uint64_t bytes = g->binary ? 4 * ints + 8 * reals : 2 * (ints + reals);
    tl_status st = tli_gmsh_int(g, what, g->size_bytes, 0, INT64_MAX, &value);
    if (!st) st = tli_scan_room(&g->scan, what, (uint64_t)value, bytes);
    if (!st) *count = (uint64_t)value;
    return st;
}

/* ---- sections ---- */

/* The next line that is not blank, without white space around it. */
static bool next_line(tli_scan *scan, tli_span *line)
{
    while (tli_scan_line(scan, line)) {
        const char *at = tli_number_skip_space(line->text, line->text + line->bytes);
        line->bytes -= (size_t)(at - line->text);
        line->text = at;
        while (line->bytes && tli_number_skip_space(at + line->bytes - 1, at + line->bytes) !=
                                  at + line->bytes - 1)
            line->bytes--;
        if (line->bytes) return true;
    }
    return false;
}

static tl_status expect_end(tli_gmsh *g, tli_span name)
{
    tli_span line;
    const char *start = g->scan.at;
    if (next_line(&g->scan, &line) && line.bytes == name.bytes + 3 &&
        memcmp(line.text, "$End", 4) == 0 &&
        memcmp(line.text + 4, name.text + 1, name.bytes - 1) == 0)
        return TL_OK;
    g->scan.at = start;
    return tli_scan_fail(&g->scan, "expected $End%.*s", (int)(name.bytes - 1), name.text + 1);
}

/* Leaves a section that is not read: behind the line of its end. */
static tl_status skip_section(tli_gmsh *g, tli_span name)
{
    const char *at = g->scan.at;
    while ((at = memchr(at, '$', (size_t)(g->scan.end - at))) != NULL) {
        size_t left = (size_t)(g->scan.end - at);
        if (left >= name.bytes + 3 && memcmp(at, "$End", 4) == 0 &&
            memcmp(at + 4, name.text + 1, name.bytes - 1) == 0) {
            g->scan.at = at + name.bytes + 3;
            return TL_OK;
        }
        at++;
    }
    return tli_scan_fail(&g->scan, "there is no $End%.*s", (int)(name.bytes - 1), name.text + 1);
}

static tl_status read_format(tli_gmsh *g)
{
    double version = 0;
    int64_t binary = 0, size = 0;
    tli_span rest;
    tl_status st = tli_scan_real(&g->scan, "the version", &version);
    if (!st) st = tli_scan_int(&g->scan, "the kind of file, 0 text or 1 binary", 0, 1, &binary);
    if (!st) st = tli_scan_int(&g->scan, "the size of a number", 4, 8, &size);
    if (st) return st;
    g->version = version > 0 && version < 10 ? (int)(10 * version + 0.5) : 0;
    if (g->version >= 20 && g->version <= 22) g->version = 22;
    if (g->version != 22 && g->version != 40 && g->version != 41)
        return tl_fail(g->ctx, TL_ERR_UNSUPPORTED,
                       "'%s': MSH version %g; 2.0 to 2.2, 4.0 and 4.1 are read", g->scan.path,
                       version);
    /* 4.0: the size of a float64, but counts have 8 bytes */
    g->size_bytes = g->version == 22 ? 4 : g->version == 40 ? 8 : (unsigned)size;
    if (g->size_bytes != 4 && g->size_bytes != 8)
        return tli_scan_fail(&g->scan, "numbers of %u bytes, expected 4 or 8", g->size_bytes);
    tli_scan_line(&g->scan, &rest);
    if (!binary) return TL_OK;
    g->binary = g->scan.binary = true;
    const uint8_t *one = NULL;
    st = tli_scan_take(&g->scan, "the number one", 1, 4, &one);
    if (st) return st;
    g->scan.big_endian = tli_int_at(one, 4, true) == 1;
    if (tli_int_at(one, 4, g->scan.big_endian) == 1) return TL_OK;
    return tli_scan_fail(&g->scan, "expected the number one, which tells the byte order");
}

static tl_status read_names(tli_gmsh *g)
{
    int64_t count = 0;
    if (g->names) return tli_scan_fail(&g->scan, "$PhysicalNames stand twice in the file");
    tl_status st = tli_scan_int(&g->scan, "the number of names", 0, INT32_MAX, &count);
    if (!st) st = tli_scan_room(&g->scan, "names", (uint64_t)count, 7); /* 0 1 "" */
    g->names = tl_mem_alloc(g->ctx, (size_t)count, sizeof *g->names, &st);
    for (int64_t i = 0; !st && i < count; i++) {
        tli_gmsh_name *name = &g->names[i];
        tli_span line = {0};
        st = tli_scan_int(&g->scan, "a dimension", 0, 3, &name->dimension);
        if (!st) st = tli_scan_int(&g->scan, "a tag", INT32_MIN, INT32_MAX, &name->tag);
        if (st) return st;
        tli_scan_line(&g->scan, &line);
        const char *end = line.text + line.bytes;
        const char *open = line.bytes ? memchr(line.text, '"', line.bytes) : NULL;
        while (end > line.text && end[-1] != '"') end--;
        if (!open || end - 1 <= open)
            return tli_scan_fail(&g->scan, "expected a name in quotes in the line before");
        name->name = (tli_span){open + 1, (size_t)(end - 1 - open - 1)};
        g->name_count++;
    }
    return st;
}

/* ---- entities ---- */

static tl_status add_group(tli_gmsh *g, int32_t group)
{
    tl_status st = TL_OK;
    if (g->group_count == g->group_capacity) {
        uint64_t more = 2 * g->group_capacity + 64;
        g->groups = tl_mem_resize(g->ctx, g->groups, (size_t)more, sizeof *g->groups, &st);
        if (st) return st;
        g->group_capacity = more;
    }
    g->groups[g->group_count++] = group;
    return TL_OK;
}

static uint64_t entity_key(int64_t dimension, int64_t tag)
{
    return (uint64_t)dimension << 32 | (uint32_t)tag;
}

static tl_status read_groups(tli_gmsh *g, tli_gmsh_entity *entity)
{
    uint64_t count = 0;
    tl_status st = tli_gmsh_count(g, "physical groups", 1, 0, &count);
    entity->first = g->group_count;
    for (uint64_t i = 0; !st && i < count; i++) {
        int64_t group = 0;
        st = tli_gmsh_int(g, "a physical group", 4, -INT32_MAX, INT32_MAX, &group);
        /* a negative tag is the group with the direction turned */
        if (!st) st = add_group(g, (int32_t)(group < 0 ? -group : group));
    }
    entity->count = g->group_count - entity->first;
    return st;
}

/* Tag, place or box, physical groups, and from curves on what bounds them. */
static tl_status read_entity(tli_gmsh *g, int64_t dimension)
{
    const uint64_t numbers = dimension == 0 && g->version == 41 ? 3 : 6;
    double box[6];
    int64_t tag = 0, bound = 0;
    uint64_t bounds = 0;
    tl_status st = tli_gmsh_int(g, "the tag of an entity", 4, INT32_MIN, INT32_MAX, &tag);
    if (!st) st = tli_gmsh_reals(g, "the box of an entity", numbers, box);
    if (!st) st = read_groups(g, &g->entities[g->entity_count]);
    if (!st && dimension > 0) st = tli_gmsh_count(g, "bounding entities", 1, 0, &bounds);
    for (uint64_t i = 0; !st && i < bounds; i++)
        st = tli_gmsh_int(g, "a bounding entity", 4, INT32_MIN, INT32_MAX, &bound);
    g->entity_keys[g->entity_count++] = entity_key(dimension, tag);
    return st;
}

static tl_status read_entities(tli_gmsh *g)
{
    uint64_t counts[4] = {0}, total = 0;
    tl_status st = TL_OK;
    if (g->entities) return tli_scan_fail(&g->scan, "$Entities stand twice in the file");
    for (int d = 0; !st && d < 4; d++) {
        st = tli_gmsh_count(g, "entities", 1, 3, &counts[d]);
        total += counts[d];
    }
    g->entities = tl_mem_alloc(g->ctx, (size_t)total, sizeof *g->entities, &st);
    g->entity_keys = tl_mem_alloc(g->ctx, (size_t)total, sizeof *g->entity_keys, &st);
    for (int64_t d = 0; !st && d < 4; d++)
        for (uint64_t i = 0; !st && i < counts[d]; i++) st = read_entity(g, d);
    if (st) return st;
    uint64_t *keys = g->entity_keys;
    g->entity_keys = NULL;
    return tli_ids_create(g->ctx, keys, g->entity_count, &g->entity_map);
}

const int32_t *tli_gmsh_groups(const tli_gmsh *g, int64_t dimension, int64_t tag, uint64_t *count)
{
    uint32_t index = tli_ids_find(&g->entity_map, entity_key(dimension, tag));
    *count = index == TL_NONE ? 0 : g->entities[index].count;
    return *count ? g->groups + g->entities[index].first : NULL;
}

/* ---- regions and labels ---- */

/* What the cells of a dimension are told apart by. */
typedef struct namer {
    const tli_gmsh *g;
    int64_t dimension;
    char name[128];
} namer;

static const char *name_of(const void *arg, int32_t id)
{
    namer *n = (namer *)(uintptr_t)arg;
    for (uint64_t i = 0; i < n->g->name_count; i++) {
        const tli_gmsh_name *name = &n->g->names[i];
        if (name->dimension != n->dimension || name->tag != id) continue;
        tli_span_text(name->name, n->name, sizeof n->name);
        return n->name;
    }
    return NULL;
}

/* True if a cell of the kind that is asked for has a physical group. */
static bool has_groups(const tli_gmsh *g, bool (*is_kind)(uint8_t type))
{
    for (uint64_t i = 0; i < g->cells.count; i++)
        if (g->cells.regions[i] != 0 && is_kind(g->cells.types[i])) return true;
    return false;
}

static tl_status make_labels(tli_gmsh *g)
{
    const bool by_group = has_groups(g, tli_cell_is_surface);
    const tli_cells *cells = &g->cells;
    namer n = {.g = g, .dimension = 2};
    tl_status st = TL_OK;
    for (uint64_t i = 0; !st && i < cells->count; i++) {
        int32_t id = by_group ? cells->regions[i] : g->cell_entities[i];
        if (id == 0 || !tli_cell_is_surface(cells->types[i])) continue;
        st = tli_faces_add(&g->faces, id, cells->connectivity + cells->offsets[i],
                           tli_surface_corners(cells->types[i]));
    }
    return st ? st : tli_faces_to_labels(&g->faces, g->grid, by_group ? name_of : NULL, &n);
}

static tl_status make_regions(tli_gmsh *g)
{
    const bool by_group = has_groups(g, tli_cell_is_volume);
    namer n = {.g = g, .dimension = 3};
    tl_status st = TL_OK;
    for (uint64_t i = 0; !by_group && i < g->cells.count; i++)
        g->cells.regions[i] = g->cell_entities[i];
    for (uint64_t i = 0; !st && by_group && i < g->name_count; i++)
        if (g->names[i].dimension == 3)
            st = tli_grid_name_region(g->grid, (int32_t)g->names[i].tag,
                                      name_of(&n, (int32_t)g->names[i].tag));
    return st;
}

/* A region only where some volume has one. */
static tl_status finish_cells(tli_gmsh *g)
{
    bool any = false;
    tl_status st = make_labels(g);
    if (!st) st = make_regions(g);
    for (uint64_t i = 0; i < g->cells.count && !any; i++)
        any = g->cells.regions[i] != 0 && tli_cell_is_volume(g->cells.types[i]);
    return st ? st : tli_cells_to_grid(&g->cells, g->scan.path, any, g->grid);
}

/* ---- reader ---- */

static tl_status read_section(tli_gmsh *g, tli_span name)
{
    static const struct {
        const char *name;
        tl_status (*read)(tli_gmsh *g);
        int on; /* of values */
    } sections[] = {
        {"$PhysicalNames", read_names, -1},
        {"$Entities", read_entities, -1},
        {"$Nodes", tli_gmsh_read_nodes, -1},
        {"$Elements", tli_gmsh_read_elements, -1},
        {"$NodeData", NULL, TLI_GMSH_ON_NODES},
        {"$ElementData", NULL, TLI_GMSH_ON_ELEMENTS},
        {"$ElementNodeData", NULL, TLI_GMSH_ON_CORNERS},
    };
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++) {
        if (!tli_span_is(name, sections[i].name)) continue;
        if (sections[i].on >= 0) {
            tl_status st = tli_gmsh_note_data(g, (tli_gmsh_on)sections[i].on);
            return st ? st : skip_section(g, name);
        }
        tl_status st = sections[i].read(g);
        return st ? st : expect_end(g, name);
    }
    return skip_section(g, name);
}

/* with_mesh false: only the heads of sections of values. */
static tl_status read_sections(tli_gmsh *g, bool with_mesh)
{
    tli_span line;
    bool has_format = false;
    tl_status st = TL_OK;
    while (!st) {
        if (!next_line(&g->scan, &line)) break;
        if (line.text[0] != '$' || line.bytes < 2)
            return tli_scan_fail(&g->scan, "expected a line that begins with $ before this");
        bool data = line.bytes > 4 && memcmp(line.text + line.bytes - 4, "Data", 4) == 0;
        if (!has_format) {
            if (!tli_span_is(line, "$MeshFormat"))
                return tli_scan_fail(&g->scan, "expected $MeshFormat first");
            has_format = true;
            st = read_format(g);
            if (!st) st = expect_end(g, line);
        } else {
            st = with_mesh || data ? read_section(g, line) : skip_section(g, line);
        }
    }
    return st;
}

static void release(tli_gmsh *g)
{
    tl_mem_free(g->ctx, g->data_kinds);
    tl_mem_free(g->ctx, g->data);
    tli_faces_release(&g->faces);
    tl_mem_free(g->ctx, g->cell_entities);
    tli_cells_release(&g->cells);
    tl_mem_free(g->ctx, g->element_tags);
    tli_ids_release(&g->elements);
    tli_ids_release(&g->points);
    tli_ids_release(&g->entity_map);
    tl_mem_free(g->ctx, g->groups);
    tl_mem_free(g->ctx, g->entity_keys);
    tl_mem_free(g->ctx, g->entities);
    tl_mem_free(g->ctx, g->names);
}

static void begin(tl_ctx *ctx, const tli_source *source, tli_grid *grid, tli_gmsh *g)
{
    *g = (tli_gmsh){.ctx = ctx, .grid = grid, .size_bytes = 8};
    g->points.ctx = g->elements.ctx = g->entity_map.ctx = ctx;
    tli_cells_init(ctx, &g->cells);
    tli_faces_init(ctx, &g->faces);
    tli_scan_open(ctx, source->path, source->map.bytes, source->map.byte_count, &g->scan);
}

tli_match tli_match_gmsh(const tli_source *source)
{
    return tli_head_begins(source, "$MeshFormat") ? TLI_MATCH_BYTES : TLI_MATCH_NO;
}

tl_status tli_read_gmsh(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                        tli_grid *grid)
{
    tli_gmsh g;
    begin(ctx, source, grid, &g);
    tl_status st = read_sections(&g, true);
    if (!st && !grid->xyz) st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': no $Nodes", source->path);
    if (!st) st = finish_cells(&g);
    if (!st) st = tli_gmsh_read_data(&g, opts);
    release(&g);
    return st;
}

tl_status tli_steps_gmsh(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                         tl_steps *steps)
{
    tli_gmsh g;
    int64_t *numbers = NULL;
    (void)opts;
    begin(ctx, source, NULL, &g);
    tl_status st = read_sections(&g, false);
    if (!st) st = tli_gmsh_list_steps(&g, steps, &numbers);
    tl_mem_free(ctx, numbers);
    release(&g);
    return st;
}
