/* What the benches share: data sets, times, facts about machine and input, the peer. */
#ifndef TETRALOD_CLI_BENCH_H
#define TETRALOD_CLI_BENCH_H

#include "cli_visible.h"

#define BENCH_RUNS_MAX 64
#define BENCH_PATH_BYTES 4200

typedef struct bench_times {
    double seconds[BENCH_RUNS_MAX];
    size_t count;
} bench_times;
double bench_least(const bench_times *times);
double bench_median(const bench_times *times);

/* One data set: a mesh of one channel, as it lies in a file that the peer reads, too. */
typedef struct bench_data {
    char name[80];
    char path[BENCH_PATH_BYTES];
    size_t tet_count, vert_count;
    uint64_t hash;
} bench_data;

typedef struct bench_state {
    cli_session *session;
    char folder[BENCH_PATH_BYTES]; /* for the files of the bench; removed at its end */
    json_t *rows;                  /* list; NULL without --json */
    uint32_t components;           /* of the channel that takes part */
    const char *sample;            /* if none is named; NULL: all */
    size_t broken;                 /* results that failed their verification */
} bench_state;

/* A bench of one data set; returns an exit status. */
typedef int (*bench_fn)(bench_state *state, const bench_data *data);
int bench_mesh(bench_state *state, const bench_data *data);
int bench_simplify(bench_state *state, const bench_data *data);
/* Of the file as it is: only name and path of data are set. */
int bench_segment(bench_state *state, const bench_data *data);
/* Of the file as it is, too. */
int bench_build(bench_state *state, const bench_data *data);
int bench_codec(bench_state *state, const bench_data *data);
int bench_surface(bench_state *state, const bench_data *data);
/* The channel of data has three components. */
int bench_lines(bench_state *state, const bench_data *data);
int bench_draw(bench_state *state, const bench_data *data);
/* The same with --renderer gl. */
int bench_gl(bench_state *state, const bench_data *data);
/* The transfer function of both over a range, of a mesh with that diagonal. Gives *transfer. */
tl_status bench_transfer(tl_ctx *ctx, const double range[2], double diagonal,
                         tl_transfer **transfer);
/* Its control points. */
enum { BENCH_COLORS = 5, BENCH_OPACITIES = 5 };
void bench_points(const double range[2], tl_color_point colors[BENCH_COLORS],
                  tl_opacity_point opacities[BENCH_OPACITIES]);
/* How far two pictures of one size are apart. */
double bench_decibels(const tl_image *a, const tl_image *b);
/* data->path is a model. */
int bench_cut(bench_state *state, const bench_data *data);
int bench_view(bench_state *state, const bench_data *data);
int bench_live(bench_state *state, const bench_data *data);

/* Makes a context of that many threads, reads the mesh and hands both to work with arg. Returns an
 * exit status; the message is out already. */
typedef tl_status (*bench_work_fn)(bench_state *state, tl_ctx *ctx, const tl_mesh *mesh, void *arg);
int bench_on_mesh(bench_state *state, const bench_data *data, unsigned threads, bench_work_fn work,
                  void *arg);

/* A bench of a mesh in memory that has a row for each number of threads. */
typedef struct bench_steps {
    bench_work_fn measure; /* into the row, which is all 0 before */
    /* With --against-vtk; returns an exit status. */
    int (*ask_peer)(bench_state *state, const bench_data *data, void *row);
    void (*add_json)(json_t *item, const bench_data *data, const void *row);
    void (*print_text)(const bench_data *data, const void *row);
} bench_steps;
/* row: room for one, row_bytes long. Returns an exit status. */
int bench_each_threads(bench_state *state, const bench_data *data, const bench_steps *steps,
                       void *row, size_t row_bytes);

/* Measures one size of something into its row. */
typedef tl_status (*bench_size_fn)(bench_state *state, const bench_data *data,
                                   const tl_read_opts *read, uint32_t size, void *row);
/* Measures sizes [size_count], the i-th into the row at rows + i * row_bytes. Returns an exit
 * status; the message is out already. */
int bench_sizes(bench_state *state, const bench_data *data, bench_size_fn measure,
                const uint32_t *sizes, size_t size_count, void *rows, size_t row_bytes);

/* Order-dependent 64-bit hash of positions, tets and channels. */
uint64_t bench_hash(const tl_mesh *mesh);

/* The thread counts to measure: 1 and, where there are more, all; returns how many (1 or 2). */
size_t bench_threads(const bench_state *state, unsigned counts[2]);

/* Runs the peer script with args (NULL ends) and gives the JSON object that it prints. NULL where
 * it fails; the message is out already. */
json_t *bench_peer(const bench_state *state, const char *const *args);

#endif
