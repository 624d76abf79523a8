/* Stage formats, internal: the parts of the reader of EnSight 6 and EnSight Gold.
 *   formats_ensight_case.c    the case file: geometry, variables, time sets
 *   formats_ensight_scan.c    lines and numbers of text and C binary files
 *   formats_ensight_geo.c     parts: points and cells
 *   formats_ensight_values.c  values of a variable
 *   formats_ensight.c         the reader, and cases of several servers */
#ifndef TETRALOD_SRC_FORMATS_ENSIGHT_H
#define TETRALOD_SRC_FORMATS_ENSIGHT_H

#include "formats/formats_cells.h"
#include "formats/formats_ids.h"
#include "formats/formats_reader.h"
#include "formats/formats_scan.h"

#define TLI_ENSIGHT_LINE 80

/* ---- the case file ---- */

typedef struct tli_ensight_set {
    int64_t number;
    int64_t count, start, increment; /* file name number of step i: start + i * increment, or */
    int64_t *numbers;                /* [number_count] */
    uint64_t number_count;
    double *times; /* [time_count] */
    uint64_t time_count;
} tli_ensight_set;

typedef struct tli_ensight_variable {
    char name[TLI_ENSIGHT_LINE + 4];
    tli_span file;
    int64_t set; /* time set; 0: none */
    uint32_t components;
    bool on_nodes;
} tli_ensight_variable;

typedef struct tli_ensight_case {
    tl_ctx *ctx;
    const char *path;
    bool gold;
    bool binary, big_endian; /* of its files; as the geometry has it, once it was opened */
    bool fortran;            /* the same: binary files stand in records */
    tli_span geometry;
    int64_t geometry_set;
    bool coords_only; /* of the geometry's steps */
    tli_ensight_variable *variables;
    uint64_t variable_count;
    tli_ensight_set *sets;
    uint64_t set_count;
    double *times; /* [time_count] of all sets, ascending, each once */
    size_t time_count;
} tli_ensight_case;

/* Reads a case file. To be released, on failure too. */
tl_status tli_ensight_case_read(tl_ctx *ctx, const char *path, const tli_map *map,
                                tli_ensight_case *read);
void tli_ensight_case_release(tli_ensight_case *read);
/* Opens the file of a name for a time: asterisks become the number of the set's last step that is
 * not after it; of a file with several steps scan stands at its own. The geometry comes first,
 * since it tells whether all are binary. Gives *path and *map. */
tl_status tli_ensight_open(tli_ensight_case *read, tli_span name, int64_t set, double time,
                           char **path, tli_map *map, tli_scan *scan);

/* Replaces the records of Fortran by the bytes that they hold. formats_ensight_records.c */
tl_status tli_ensight_join_records(tl_ctx *ctx, const char *path, tli_map *map);

/* ---- numbers ---- */

/* The next line without blanks at its ends; "" at the end of the file, where *more is false. */
tl_status tli_ensight_line(tli_scan *scan, char line[TLI_ENSIGHT_LINE + 1], bool *more);
tl_status tli_ensight_int(tli_scan *scan, const char *what, int64_t low, int64_t high,
                          int64_t *value);
/* A count of things that take min_numbers numbers each at least, checked against what is left. */
tl_status tli_ensight_count(tli_scan *scan, const char *what, uint64_t min_numbers,
                            uint64_t *count);
/* Numbers of 12 columns, which need no blank between them, some a line; or float32. */
tl_status tli_ensight_reals(tli_scan *scan, const char *what, uint64_t count, double *values);
/* Skips whole numbers. */
tl_status tli_ensight_skip_ints(tli_scan *scan, const char *what, uint64_t count);

/* ---- geometry ---- */

/* Cells of one kind in one part. */
typedef struct tli_ensight_section {
    char name[TLI_ENSIGHT_LINE + 1];
    uint64_t first_cell, cell_count;
} tli_ensight_section;

typedef struct tli_ensight_part {
    int64_t number;
    uint64_t first_point, point_count;
    uint64_t first_section, section_count;
} tli_ensight_part;

typedef struct tli_ensight_geo {
    tl_ctx *ctx;
    bool gold;
    tli_grid *grid;
    tli_cells cells;
    uint64_t face_point_count;
    tli_ensight_part *parts;
    uint64_t part_count;
    tli_ensight_section *sections;
    uint64_t section_count;
    bool has_node_ids, has_element_ids, has_ghosts;
    bool maps_node_ids; /* EnSight 6, given ids: cells name them */
    tli_ids node_ids;
} tli_ensight_geo;

/* Fills geo's grid; scan learns the byte order. */
tl_status tli_ensight_geo_read(tli_ensight_geo *geo, tli_scan *scan);
void tli_ensight_geo_release(tli_ensight_geo *geo);

/* Reads the values of a variable into a new array; what no part gives is NaN. */
tl_status tli_ensight_values_read(const tli_ensight_geo *geo, tli_scan *scan,
                                  const tli_ensight_variable *variable);

#endif
