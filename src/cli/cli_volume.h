/* What is looked at: a model, as fine as the words and the camera ask for, or any file that can be
 * read. */
#ifndef TETRALOD_CLI_VOLUME_H
#define TETRALOD_CLI_VOLUME_H

#include "cli_derive.h"
#include "cli_model.h"

/* --error, --space-error, --boundary-error, --tets, --full: how fine a model is taken. */
extern const cli_group cli_group_detail;

typedef struct cli_volume {
    cli_input input;  /* of a file: how it was read; the source has its mesh */
    tl_series series; /* of a file whose step the scene says */
    bool is_model;
    tl_source *source;
    tl_scene *scene; /* step, detail, and what is derived and chosen, as the words say */
    tl_view *view;
    const tl_mesh *mesh;  /* NULL until it is made; borrowed from the view */
    uint64_t tets, verts; /* of it, or of what pictures are made of; verts 0: of no mesh */
    size_t whole_tets;    /* before words of cli_group_derive chose some; 0: they did not */
    double bounds[6];     /* of the whole data set: x0, x1, y0, y1, z0, z1 */
    double diagonal;
    double seconds;      /* all of it */
    double open_seconds; /* reading a file, opening a model */

    /* of a model alone */
    tl_store *store;
    const tl_store_head *head;
    cli_model_step step;
    tl_cut *cut;              /* NULL until cli_volume_cut */
    tl_cut_state state;       /* pixels: the error on the screen, where there was a camera */
    tl_content_error *errors; /* [error_count] of the channels that the mesh has */
    size_t error_count;
    bool has_view;
    double cut_seconds, mesh_seconds; /* choosing patches; decoding and joining them */
} cli_volume;

/* Reads a file, or opens a model, of which then no more than the head is there. Refuses a file
 * without tets. scene: on top of which the words come, taken over also on failure; NULL: none.
 * Returns an exit status; the message is out already. Released with cli_volume_close, on success.
 */
int cli_volume_begin(cli_session *session, const char *path, tl_scene *scene, cli_volume *volume);
/* Moves the cut of a model to what words and request ask for; may be called anew, for another
 * camera. Nothing of a file. */
int cli_volume_cut(cli_session *session, cli_volume *volume, const tl_view_request *request);
/* Makes the mesh: that of the cut, derived and chosen. */
int cli_volume_mesh(cli_session *session, cli_volume *volume);
/* What a content of the volume's view was made of, for the summaries below. */
void cli_volume_take(cli_volume *volume, const tl_content *content);
/* All three without a view: mesh is there. */
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
