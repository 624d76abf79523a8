/* What the files of the verb render share: what is drawn, from where, in which pictures. */
#ifndef TETRALOD_CLI_SCENE_H
#define TETRALOD_CLI_SCENE_H

#include "cli_volume.h"

enum { CLI_PATH_BYTES = 4096 };

/* ---- what is drawn: cli_scene.c ---- */

/* Words become nodes of a scene. */
typedef struct cli_scene {
    cli_session *session;
    cli_volume volume;          /* whose scene it is */
    char color[CLI_NAME_BYTES]; /* the channel that colours things; "": none */
    bool is_read;               /* the scene is that of a file, on top of which words come */
    bool had_things;            /* before the words came */
} cli_scene;

/* Adds to the scene what the words say is drawn; to one without things, if they say nothing, what a
 * first look shows. The volume is open. Returns an exit status; the message is out already. */
int cli_scene_plan(cli_scene *scene);
/* The channel with a transfer function as the words say, or that of a file (NULL: none); its values
 * (may be NULL), borrowed from the view until the next call. */
int cli_scene_channel(cli_scene *scene, const char *name, const char *file,
                      const tl_values **values);
/* Whether the data set, or a derived channel, has that name. */
bool cli_scene_has(const cli_scene *scene, const char *name);
/* Adds a node; sets a property to a text. */
int cli_scene_add(cli_scene *scene, tl_node_kind kind, tl_node *node);
int cli_scene_text(cli_scene *scene, tl_node node, const char *prop, const char *text);
int cli_scene_real(cli_scene *scene, tl_node node, const char *prop, double value);
int cli_scene_reals(cli_scene *scene, tl_node node, const char *prop, const double *reals,
                    size_t count);
int cli_scene_flag(cli_scene *scene, tl_node node, const char *prop, bool value);
/* The words of points and lines, cli_swarm.c. */
int cli_swarm_points(cli_scene *scene, const char *word);
int cli_swarm_lines(cli_scene *scene, const char *text);
/* Writes the transfer function of a channel for ParaView. */
int cli_scene_write_transfer(cli_scene *scene, const char *channel, const char *path);

/* ---- from where: cli_frames.c ---- */

typedef struct cli_picture {
    uint32_t width, height;
    size_t frame_count;
    bool has_pattern; /* the name of the output has a number */
    tl_camera *keys;  /* [key_count] of --camera */
    size_t key_count;
    tl_camera base;           /* of --view, fitted */
    bool is_scenes;           /* base is the camera of the scene as it is */
    double orbit;             /* degrees from the first frame to behind the last one */
    double pivot[3], axis[3]; /* of the orbit */
} cli_picture;

/* The words of size, background, frames and output. Returns an exit status. */
int cli_picture_words(const cli_session *session, cli_picture *picture);
/* Reads the camera, takes that of the scene (if it has one and the words say no other), or fits it
 * to the box; window as of tl_camera_fit_points. */
int cli_picture_camera(cli_session *session, const tl_scene *scene, const double bounds[6],
                       const double window[4], cli_picture *picture);
/* The camera of a frame, for a picture of the final size. */
tl_camera cli_picture_frame(const cli_picture *picture, size_t frame);
/* The name of a frame's file. */
void cli_picture_name(const cli_session *session, const cli_picture *picture, size_t frame,
                      char name[CLI_PATH_BYTES]);
void cli_picture_close(const cli_session *session, cli_picture *picture);

/* ---- words on the picture: cli_annotate.c ---- */

/* Whether --annotation names parts. Returns an exit status for unknown words. */
int cli_words_check(const cli_session *session);
/* Sets the scene's picture node to what --annotation, --title, --background, --samples and
 * --renderer say, in a picture of that height. */
int cli_words_set(cli_scene *scene, const cli_picture *picture);

#endif
