/* What is looked at: a model, as fine as the words and the camera ask for, or any file that can be
 * read. */
#ifndef TETRALOD_CLI_VOLUME_H
#define TETRALOD_CLI_VOLUME_H

#include "cli_derive.h"
#include "cli_model.h"

/* --error, --space-error, --boundary-error, --tets, --full: how fine a model is taken. */
extern const cli_group cli_group_detail;

/* What is seen of a model, beside what the words of cli_group_detail say. */
typedef struct cli_volume_request {
    const tl_camera *camera;  /* NULL: no view. Else --error Npx counts in its picture, 1px if the
                                 words say nothing, and what it does not show may be coarse */
    const float *opacity;     /* [head->channel_count][TL_BINS] visible values; NULL: all */
    const float *unseen;      /* [head->channel_count][TL_BINS] errors that do not show; or NULL */
    uint32_t channel;         /* of the model, whose visible values a surface is made of: errors of
                                 it, or of no channel, are asked of these alone; TL_NONE: none */
    const char *const *names; /* [name_count] of the channels that the mesh is to have, those that
                                 the model lacks are passed over; NULL: all */
    size_t name_count;
} cli_volume_request;
/* No view, all channels. */
cli_volume_request cli_volume_request_defaults(void);

typedef struct cli_volume {
    cli_input input; /* input.mesh: of a model NULL until it is made */
    bool is_model;
    size_t whole_tets; /* before words of cli_group_derive chose some; 0: they did not */
    double bounds[6];  /* of the whole data set: x0, x1, y0, y1, z0, z1 */
    double diagonal;
    double seconds;      /* all of it */
    double open_seconds; /* reading a file, opening a model */

    /* of a model alone */
    tl_store *store;
    const tl_store_head *head;
    cli_model_step step;
    tl_cut *cut;        /* NULL until cli_volume_cut */
    tl_cut_state state; /* pixels: the error on the screen, where there was a camera */
    size_t *channels;   /* [channel_count] of the model that the mesh has */
    size_t channel_count;
    double *errors; /* [channel_count] their bounds */
    bool has_view;
    double cut_seconds, mesh_seconds; /* choosing patches; decoding and joining them */
} cli_volume;

/* Reads a file, or opens a model, of which then no more than the head is there. Refuses a file
 * without tets. Returns an exit status; the message is out already. Released with cli_volume_close,
 * on success. */
int cli_volume_begin(cli_session *session, const char *path, cli_volume *volume);
/* A coarse mesh of a model, of at most some 100,000 tets, with the channels of the step: what is
 * there for a first look at values. Of a file its mesh. Gives *mesh, borrowed from the volume until
 * cli_volume_mesh. */
int cli_volume_look(cli_session *session, cli_volume *volume, const tl_mesh **mesh);
/* Moves the cut of a model to what words and request ask for; may be called anew, for another
 * camera. Nothing of a file. */
int cli_volume_cut(cli_session *session, cli_volume *volume, const cli_volume_request *request);
/* Makes the mesh of the cut, in place of one that was there. Nothing of a file. */
int cli_volume_mesh(cli_session *session, cli_volume *volume);
/* All three without a view: input.mesh is there. */
int cli_volume_open(cli_session *session, const char *path, cli_volume *volume);
void cli_volume_close(cli_session *session, cli_volume *volume);

/* The channel of a model's step with that name, on vertices; TL_NONE if there is none. */
uint32_t cli_volume_channel(const cli_volume *volume, const char *name);
/* What a channel on vertices shows: its values, or the lengths of its vectors, which are then in
 * *lengths (tl_mem_free; else NULL). Gives *scalar [count], borrowed. */
tl_status cli_volume_scalar(tl_ctx *ctx, const tl_channel *channel, size_t count, double **lengths,
                            const double **scalar);

/* Channels of a mesh on vertices that --channels names, all without the word. Gives *carried
 * [*count]. Returns an exit status; the message is out already. */
int cli_carried(cli_session *session, const tl_mesh *mesh, size_t **carried, size_t *count);

/* The line of a summary that says what was read, and of a model how exact it is. */
void cli_print_volume(cli_session *session, const cli_volume *volume);
/* Adds tets, vertices, and of a model patches, bounds_promised, boundary_error, space_error, with a
 * view error_px, and bytes_read. */
void cli_json_volume(json_t *object, const cli_volume *volume);
/* Adds open, cut and mesh to an object of seconds. */
void cli_json_volume_seconds(json_t *object, const cli_volume *volume);

#endif
