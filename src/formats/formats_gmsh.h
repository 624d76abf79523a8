/* Stage formats, internal: the parts of the reader of Gmsh files.
 *   formats_gmsh.c       sections, names, entities, what becomes region or label
 *   formats_gmsh_mesh.c  points and cells
 *   formats_gmsh_data.c  values and their steps */
#ifndef TETRALOD_SRC_FORMATS_GMSH_H
#define TETRALOD_SRC_FORMATS_GMSH_H

#include "formats/formats_cells.h"
#include "formats/formats_ids.h"
#include "formats/formats_label.h"
#include "formats/formats_reader.h"
#include "formats/formats_scan.h"

/* Kinds of cells in Gmsh's numbers. */
typedef struct tli_gmsh_kind {
    uint8_t vtk_type, dimension;
    uint16_t nodes; /* 0: not known */
} tli_gmsh_kind;
tli_gmsh_kind tli_gmsh_kind_of(int64_t type);

typedef struct tli_gmsh_name {
    int64_t dimension, tag;
    tli_span name;
} tli_gmsh_name;

/* A geometric entity and its physical groups. */
typedef struct tli_gmsh_entity {
    uint64_t first, count; /* into groups */
} tli_gmsh_entity;

/* A section of values, its head read. */
typedef struct tli_gmsh_data {
    tli_span name;
    double time;
    int64_t step, components, count;
    const char *values; /* where they begin */
} tli_gmsh_data;

typedef struct tli_gmsh {
    tl_ctx *ctx;
    tli_scan scan;
    int version; /* 22, 40 or 41 */
    bool binary;
    unsigned size_bytes; /* of a size_t, in binary files */
    tli_grid *grid;

    tli_gmsh_name *names;
    uint64_t name_count;
    tli_gmsh_entity *entities;
    uint64_t *entity_keys; /* dimension and tag; until the map is made */
    uint64_t entity_count;
    int32_t *groups; /* of all entities */
    uint64_t group_count, group_capacity;
    tli_ids entity_map;

    tli_ids points, elements;
    uint64_t *element_tags; /* [cells.count], until the map is made */
    tli_cells cells;        /* regions: the first physical group, 0 where there is none */
    int32_t *cell_entities; /* [cells.capacity] */
    tli_faces faces;        /* of second and further groups */

    tli_gmsh_data *data; /* of values at points, cells, corners, in the order of the file */
    uint8_t *data_kinds;
    uint64_t data_count;
} tli_gmsh;

/* A whole number: of text, or of so many bytes; a size_t takes g->size_bytes. */
tl_status tli_gmsh_int(tli_gmsh *g, const char *what, unsigned bytes, int64_t low, int64_t high,
                       int64_t *value);
tl_status tli_gmsh_reals(tli_gmsh *g, const char *what, uint64_t count, double *values);
/* A number of things that take so many whole numbers and float64 each at least. */
tl_status tli_gmsh_count(tli_gmsh *g, const char *what, uint64_t ints, uint64_t reals,
                         uint64_t *count);

/* Physical groups of an entity [*count], NULL if it has none. */
const int32_t *tli_gmsh_groups(const tli_gmsh *g, int64_t dimension, int64_t tag, uint64_t *count);

/* The sections; the scan stands behind their first line and is left before the line of their end.
 */
tl_status tli_gmsh_read_nodes(tli_gmsh *g);
tl_status tli_gmsh_read_elements(tli_gmsh *g);

typedef enum tli_gmsh_on {
    TLI_GMSH_ON_NODES,
    TLI_GMSH_ON_ELEMENTS,
    TLI_GMSH_ON_CORNERS
} tli_gmsh_on;
/* Takes note of a section of values without reading them. */
tl_status tli_gmsh_note_data(tli_gmsh *g, tli_gmsh_on on);
/* The steps of all sections, by ascending numbers. */
tl_status tli_gmsh_list_steps(const tli_gmsh *g, tl_steps *steps, int64_t **numbers);
/* Reads the sections of a step, and those that have one step only, to arrays. */
tl_status tli_gmsh_read_data(tli_gmsh *g, const tl_read_opts *opts);

#endif
