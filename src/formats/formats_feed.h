/* Stage formats, internal: a data set of any size as windows of points and of tets, in memory that
 * does not grow with it. What comes out is what tl_mesh_read makes of the same file, but that
 * points keep the indices of the file: points that no tet uses are there, too. */
#ifndef TETRALOD_SRC_FORMATS_FEED_H
#define TETRALOD_SRC_FORMATS_FEED_H

#include "formats/formats_tets.h"

typedef struct tli_feed tli_feed;

/* Tets of a run of cells. Arrays live until the next window or the end of the feed. */
typedef struct tli_window {
    uint64_t first_tet;
    size_t tet_count;
    const tl_lidx *tets;    /* [tet_count][4] indices into the points of the window, positive */
    const int32_t *regions; /* [tet_count] or NULL */
    const double *values;   /* [tet_count][components on tets] */
    size_t point_count;     /* of the window */
    uint64_t first_point;   /* point p of the window is point first_point + p of the feed ... */
    const tl_lidx *ids;     /* ... or, where not NULL, ids[p]; ascending */
    const double *xyz;      /* [point_count][3] */
} tli_window;

/* path: any known file. memory_bytes: about what windows may take; what must be read as a whole is
 * held in working files in folder, if the context has a budget. opts as of tl_mesh_read. Gives
 * *feed. */
tl_status tli_feed_open(tl_ctx *ctx, const char *path, const tl_read_opts *opts, const char *folder,
                        uint64_t memory_bytes, tli_feed **feed);
/* A mesh in memory, borrowed. */
tl_status tli_feed_of_mesh(tl_ctx *ctx, const tl_mesh *mesh, uint64_t memory_bytes,
                           tli_feed **feed);
/* Several steps of one mesh, steps [step_count] at least 1: the channels of all of them, on the
 * mesh of the first. opts: step and time are not looked at. One step at a time is in memory; they
 * are kept in a working file in folder. TL_ERR_DATA if the mesh of a step is another one. */
tl_status tli_feed_open_series(tl_ctx *ctx, const tl_step *steps, size_t step_count,
                               const tl_read_opts *opts, const char *folder, uint64_t memory_bytes,
                               tli_feed **feed);
/* What a feeder (formats_feeder.h) gives; takes it over, also on failure. */
typedef struct tli_feeder tli_feeder;
tl_status tli_feed_of(tl_ctx *ctx, tli_feeder *feeder, uint64_t memory_bytes, tli_feed **feed);
/* NULL is allowed. */
void tli_feed_close(tli_feed *feed);

uint64_t tli_feed_point_count(const tli_feed *feed);
/* About; exact when the file has tets alone. */
uint64_t tli_feed_tet_estimate(const tli_feed *feed);
double tli_feed_time(const tli_feed *feed);
bool tli_feed_has_regions(const tli_feed *feed);
/* Channels in the order of tl_mesh_read; values are NULL. Borrowed. */
const tl_channel *tli_feed_channels(const tli_feed *feed, size_t *count);
/* The step of a series that a channel belongs to. */
typedef struct tli_feed_step {
    bool is_given; /* false: the source is no series */
    uint32_t number;
    double time; /* NaN: none */
} tli_feed_step;
tli_feed_step tli_feed_channel_step(const tli_feed *feed, size_t channel);

/* Points [first, first + count): xyz [count][3]; values [count][components on vertices], NULL to
 * leave them out. missing [count] (may be NULL): 1 where the file says that there is no point. */
tl_status tli_feed_points(tli_feed *feed, uint64_t first, size_t count, double *xyz, double *values,
                          uint8_t *missing);

/* The next window of tets, cells in the order of the file; *more false behind the last one. */
tl_status tli_feed_next(tli_feed *feed, tli_window *window, bool *more);
/* Back to the first window. */
void tli_feed_rewind(tli_feed *feed);

/* After all windows were read once: proves that the file did not change meanwhile (TL_ERR_DATA),
 * says in the log what was dropped and changed, and fills report (may be NULL) as tl_mesh_read
 * does. Reads the points once more. */
tl_status tli_feed_report(tli_feed *feed, tl_read_report *report);

#endif
