/* What is looked at: a model, at an error or a number of tets, or any file that can be read. */
#ifndef TETRALOD_CLI_VOLUME_H
#define TETRALOD_CLI_VOLUME_H

#include "cli_session.h"

/* --error, --tets, --full: how fine a model is taken. */
extern const cli_group cli_group_detail;

typedef struct cli_volume {
    cli_input input; /* a file; input.mesh is the mesh in both cases */
    bool is_model;
    tl_cut_state state; /* of a model */
    size_t channel_count;
    double *errors; /* of a model: [channel_count] bounds of the channels of the mesh */
    double seconds; /* opening, reading, cutting */
} cli_volume;

/* Reads a file, or takes a mesh out of a model; refuses what holds no tets. Returns an exit status;
 * the message is out already. Released with cli_volume_close, on success. */
int cli_volume_open(cli_session *session, const char *path, cli_volume *volume);
void cli_volume_close(cli_session *session, cli_volume *volume);

/* The line of a summary that says what was read, and of a model how exact it is. */
void cli_print_volume(cli_session *session, const cli_volume *volume);
/* Adds tets, vertices, and of a model patches, bounds_promised and boundary_error. */
void cli_json_volume(json_t *object, const cli_volume *volume);

#endif
