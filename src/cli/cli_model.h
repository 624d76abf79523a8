/* Models (.tlod) on the command line, and what they share with meshes. */
#ifndef TETRALOD_CLI_MODEL_H
#define TETRALOD_CLI_MODEL_H

#include "cli_session.h"
#include "tetralod/formats.h"
#include "tetralod/store.h"

/* The steps that a model is made of; without any the input is no series, or one step is chosen. */
typedef struct cli_steps {
    tl_step *items; /* [count] */
    size_t count;
    uint32_t *steer; /* [steer_count]; none: all */
    size_t steer_count;
} cli_steps;
/* What --steps, --steer and the operands say. Returns an exit status. */
int cli_steps_choose(cli_session *session, const tl_read_opts *read, cli_steps *steps);
void cli_steps_release(cli_session *session, cli_steps *steps);

/* A time step of a model. */
typedef struct cli_model_step {
    bool is_chosen; /* false: the model has none */
    uint32_t number;
    double time; /* NaN: none */
} cli_model_step;
/* From one that is not chosen to the first, from a step to the next; false behind the last. */
bool cli_next_step(const tl_store_head *head, cli_model_step *step);
/* The step that --step and --time ask for; the first if they say nothing. Returns an exit status.
 */
int cli_choose_step(const cli_session *session, const tl_store_head *head, cli_model_step *chosen);
/* Whether a channel is there at that step: it is of it, or of none. */
bool cli_in_step(const tl_store_channel *channel, const cli_model_step *step);
/* Says that a model's step has no channel of that name and which it has; returns CLI_WRONG_USE. */
int cli_unknown_in_model(const cli_session *session, const tl_store_head *head,
                         const cli_model_step *step, const char *name);

/* What 'info' says of a model. Returns an exit status. */
int cli_info_store(cli_session *session, const char *path);

/* What is drawn, and how many segments are refined for it. */
typedef struct cli_graph_view {
    uint64_t tets, patches, segments;
} cli_graph_view;
/* What the whole index of a model tells. */
typedef struct cli_graph {
    cli_graph_view mean, worst; /* where the mesh is finest at one point */
    double *rms;     /* [level_count][channel_count] of whole levels, in the channel's unit */
    double *carried; /* [level_count] original vertices */
} cli_graph;
/* Reads the whole index. */
tl_status cli_graph_create(tl_ctx *ctx, const tl_store *store, cli_graph *graph);
void cli_graph_destroy(tl_ctx *ctx, cli_graph *graph);

/* The keys of a mesh's measures; null where one is not known. */
void cli_json_stats(json_t *object, const tl_mesh_stats *stats);
/* The lines of a mesh's measures; time may be NaN. */
void cli_print_shape(const tl_mesh_stats *stats, double time, uint64_t tet_count);

#endif
