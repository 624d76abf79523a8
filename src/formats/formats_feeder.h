/* Stage formats, internal to the windowed source: what stands behind a source. A feeder answers for
 * ranges of points and cells of one data set; formats_feed.c makes windows of tets of them. */
#ifndef TETRALOD_SRC_FORMATS_FEEDER_H
#define TETRALOD_SRC_FORMATS_FEEDER_H

#include "formats/formats_feed.h"

/* An array as the file names it. */
typedef struct tli_feeder_array {
    char *name; /* owned */
    uint32_t components;
    tl_scalar scalar;
    tli_feed_step step;
} tli_feeder_array;

struct tli_feeder {
    tl_ctx *ctx;
    uint64_t point_count, cell_count;
    double time;
    tli_feeder_array *arrays[2]; /* by tl_on, owned */
    uint32_t array_counts[2];
    bool is_final; /* cells are the tets of a mesh: not to be turned or counted again */
    const tli_grid_block *blocks; /* structured: the blocks, one after another; else NULL */
    uint32_t block_count;
    const char *path; /* for messages; NULL: none */

    /* xyz [count][3] of points [first, first + count). */
    tl_status (*points)(tli_feeder *feeder, uint64_t first, uint64_t count, double *xyz);
    /* Values [count][components] of an array. */
    tl_status (*values)(tli_feeder *feeder, tl_on on, uint32_t array, uint64_t first,
                        uint64_t count, double *values);
    /* NULL: no point is blanked. blanks [count]: 0 where the point is missing (iblank). */
    tl_status (*blanks)(tli_feeder *feeder, uint64_t first, uint64_t count, uint8_t *blanks);
    /* NULL for structured ones. Fills types, offsets (from 0) and connectivity of window, ids of
     * the whole; types and offsets may stay NULL for tets alone. */
    tl_status (*cells)(tli_feeder *feeder, uint64_t first, uint64_t count, tli_grid *window);
    /* is_final: regions [count], NULL if there are none. */
    tl_status (*regions)(tli_feeder *feeder, uint64_t first, uint64_t count, int32_t *regions);
    /* About how many tets; NULL: a tet a cell. */
    tl_status (*estimate)(tli_feeder *feeder, uint64_t *tets);
    void (*close)(tli_feeder *feeder); /* frees the feeder */
};

/* What is behind a feed. formats_feed.c opens it, formats_feed_window.c makes windows. */
struct tli_feed {
    tl_ctx *ctx;
    tli_feeder *feeder;
    tl_read_opts opts;
    tli_map map;
    bool has_map;
    char *path; /* owned; NULL: a mesh in memory */
    tli_stamp stamp;
    uint64_t memory_bytes, tet_estimate;
    int region_index; /* among the cell arrays, ghosts left out; -1: none */
    bool has_regions;
    bool marks_points; /* hidden points or fill values: points can be missing */
    tl_channel *channels;
    tli_feed_step *steps; /* [channel_count] */
    size_t channel_count;
    uint32_t components[2];

    uint64_t next_cell, next_tet;
    tli_grid grid; /* of the window */
    tli_tets tets;
    bool is_open; /* tets is */
    tl_lidx *ids;
    double *values;

    double *range_xyz; /* points [range_first, range_first + range_count), kept between windows */
    uint64_t range_first, range_count, range_room;
    /* the points of the window as runs of the data set's, unless ids lists them */
    struct {
        uint64_t first, count;
    } runs[2];
    uint32_t run_count;

    /* the report */
    bool has_counted; /* all windows were read once */
    bool has_report;  /* it is there already: the file was read as a whole */
    tl_read_report report;
    tli_tally sum;
    uint64_t vert_count, tet_count;
    uint8_t *used; /* a bit for each point */
};

/* Appends an array; copies name. */
tl_status tli_feeder_add(tli_feeder *feeder, tl_on on, const char *name, uint32_t components,
                         tl_scalar scalar);
/* Of a cell: as many as it is usually cut into, 0 if that can't be told from its type. */
unsigned tli_feeder_usual_tets(uint8_t vtk_type);
/* Frees the arrays, as part of a close. */
void tli_feeder_drop_arrays(tli_feeder *feeder);

/* Feeders of files. Each gives *feeder, or leaves it NULL where the file is not for it, to be read
 * as a whole. map stays open until the feeder is closed; borrowed. */
tl_status tli_feeder_open_vtu(tl_ctx *ctx, const tli_map *map, const char *path,
                              tli_feeder **feeder);
/* A mesh in memory, borrowed, or owned by the feeder. */
tl_status tli_feeder_open_mesh(tl_ctx *ctx, const tl_mesh *mesh, bool owned, tli_feeder **feeder);

/* Whether a file may be VTK XML. */
bool tli_feeder_is_xml(const tli_map *map);
/* A structured file: VTK XML image data, rectilinear or structured grid of one piece. */
tl_status tli_feeder_open_vts(tl_ctx *ctx, const tli_map *map, const char *path,
                              tli_feeder **feeder);
/* A BINARY file of legacy VTK, but for polygons, polyhedra, prisms and blanked points. */
tl_status tli_feeder_open_legacy(tl_ctx *ctx, const tli_map *map, const char *path,
                                 tli_feeder **feeder);
/* A binary PLOT3D grid with the solution of opts; not in a packed file. */
tl_status tli_feeder_open_plot3d(tl_ctx *ctx, const tli_map *map, const char *path,
                                 const tl_read_opts *opts, tli_feeder **feeder);
/* Steps of one mesh, as tli_feed_open_series; fills report (may be NULL) from the first. */
tl_status tli_feeder_open_series(tl_ctx *ctx, const tl_step *steps, size_t step_count,
                                 const tl_read_opts *opts, const char *folder,
                                 tl_read_report *report, tli_feeder **feeder);
/* A raw volume: opts has its dimensions. */
tl_status tli_feeder_open_raw(tl_ctx *ctx, const tli_map *map, const char *path,
                              const tl_read_opts *opts, tli_feeder **feeder);

/* Shared by the two files of the feed: frees what belongs to the window; reads an array of a range
 * into its grid; makes tuples of arrays. */
void tli_feed_close_window(tli_feed *feed);
tl_status tli_feed_read_array(tli_feed *feed, tl_on on, uint32_t index, uint64_t first,
                              uint64_t count);
void tli_feed_interleave(const tli_grid_array *arrays, uint32_t array_count, size_t count,
                         size_t tuple, double *values);

#endif
