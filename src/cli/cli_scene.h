/* What the files of the verb render share: how channels are shown, what is drawn, from where. */
#ifndef TETRALOD_CLI_SCENE_H
#define TETRALOD_CLI_SCENE_H

#include "cli_transfer.h"
#include "cli_volume.h"

enum { CLI_SHADES_MAX = 16, CLI_PATH_BYTES = 4096 };

/* ---- how a channel is shown: cli_shade.c ---- */

/* A channel as a scalar on vertices, ready for colours: of vectors the length, of values on tets
 * the mean at a vertex, of a logarithmic scale the power of ten; scaled where numbers are too large
 * or too small to be looked at. */
typedef struct cli_shade {
    char name[CLI_NAME_BYTES], title[CLI_NAME_BYTES + 64];
    bool logarithmic;
    double factor;        /* what is drawn is factor * value, or its logarithm */
    double least, most;   /* finite values there are; of a logarithmic scale positive ones */
    double range[2];      /* values at the ends of the colours */
    size_t channel;       /* of the mesh: what is drawn, in a channel of its own if need be */
    const double *scalar; /* [vert_count] of it */
    cli_points points;    /* in what is drawn */
    tl_transfer *transfer;
} cli_shade;

/* What is drawn for a value, and back. */
double cli_shade_shown(const cli_shade *shade, double value);
double cli_shade_value(const cli_shade *shade, double shown);
/* Makes a shade of the channel with that name from a mesh, or of an expression, with the words
 * --range and --colormap; file: a transfer function, or NULL. Gives *shade. Returns an exit status;
 * the message is out already. */
int cli_shade_create(cli_session *session, tl_mesh *mesh, const char *name, const char *file,
                     bool logarithmic, cli_shade **shade);
void cli_shade_destroy(cli_session *session, cli_shade *shade);
/* Shows another mesh with the same channel; colours stay. */
tl_status cli_shade_bind(tl_ctx *ctx, cli_shade *shade, tl_mesh *mesh);
/* Writes what ParaView reads. Returns an exit status. */
int cli_shade_write(const cli_shade *shade, const char *path);

/* ---- what is drawn: cli_scene.c, cli_things.c ---- */

/* An isosurface that was asked for. */
typedef struct cli_iso {
    cli_shade *shade;
    double value, rgb[3], opacity;
    bool has_color;
} cli_iso;

/* Streamlines: how they look and, of the frame, what they are. */
typedef struct cli_lines {
    char name[CLI_NAME_BYTES]; /* the channel; "": none are wanted */
    tl_line_opts shape;        /* pixels of the final picture */
    double opacity;
    bool has_box; /* lines through it are drawn full, others as ghosts */
    double box[6];
    const tl_polydata *parts[2]; /* those, and the ghosts or NULL */
    tl_item items[2];
} cli_lines;

/* What was made for the renderer, and is released when it is done with. */
typedef struct cli_kept {
    tl_polydata *polydata;
    tl_volume *volume;
    void *block;
} cli_kept;

typedef struct cli_scene {
    cli_session *session;
    cli_volume volume;
    tl_mesh *mesh;
    double bounds[6], diagonal;
    tl_renderer *renderer;
    cli_shade *shades[CLI_SHADES_MAX]; /* each channel that is shown, once for each file */
    size_t shade_count;
    /* what the words, or a first look, ask for */
    cli_shade *volume_shade, *color_shade, *points_shade;
    cli_iso isos[CLI_LIST_MAX];
    size_t iso_count;
    double slices[CLI_LIST_MAX][6]; /* planes: point and normal */
    size_t slice_count;
    bool boundary, edges, silhouettes, patches, levels;
    size_t points_wanted;
    uint32_t shell_count; /* isosurfaces that the points lie on; 0: of all values */
    uint32_t samples;     /* samples x samples rays a pixel */
    cli_lines lines;
    /* of the frame */
    cli_kept *kept;
    size_t kept_count;
    tl_edges *edge_cache;
    tl_transfer *mark_transfer; /* colours of patches or levels */
    tl_item silhouette_item;
    double extract_seconds, draw_seconds;
} cli_scene;

/* Reads the words that say what is drawn; without any, chooses what a first look shows. The
 * volume is open. */
int cli_scene_plan(cli_scene *scene);
/* Sets the rays a pixel, of --samples or what is good for what is drawn, of a picture of that size.
 */
void cli_scene_set_samples(cli_scene *scene, uint32_t width, uint32_t height);
/* Takes the mesh of a view out of the model (the first time of a file, too) and makes all that is
 * drawn of it. */
int cli_scene_build(cli_scene *scene, const tl_camera *camera);
/* Draws it; silhouettes are those of the camera; t: 0 to 1 in all frames, by which arrows and
 * dashes have moved. Gives *image. */
tl_status cli_scene_draw(cli_scene *scene, const tl_camera *camera, double t, tl_image **image);
void cli_scene_close(cli_scene *scene);

/* The parts of cli_scene_build in cli_things.c: adds things to the renderer. */
tl_status cli_things_add(cli_scene *scene);
tl_status cli_things_silhouettes(cli_scene *scene, const tl_camera *camera);
/* Points and streamlines, cli_swarm.c: the words of --lines; following them, in the mesh of the
 * view; adding them to the renderer, moved. */
int cli_swarm_lines(cli_scene *scene, const char *text);
int cli_swarm_trace(cli_scene *scene);
tl_status cli_swarm_add_lines(cli_scene *scene, double t);
tl_status cli_swarm_add_points(cli_scene *scene);
/* Keeps what the renderer borrows; takes it over also on failure. */
tl_status cli_scene_keep(cli_scene *scene, cli_kept kept);

/* ---- from where: cli_frames.c ---- */

typedef struct cli_picture {
    uint32_t width, height;
    bool transparent;
    float background[3];
    size_t frame_count;
    bool has_pattern; /* the name of the output has a number */
    tl_camera *keys;  /* [key_count] of --camera */
    size_t key_count;
    tl_camera base;           /* of --view, fitted */
    double orbit;             /* degrees from the first frame to behind the last one */
    double pivot[3], axis[3]; /* of the orbit */
} cli_picture;

/* The words of size, background, frames and output. Returns an exit status. */
int cli_picture_words(const cli_session *session, cli_picture *picture);
/* Reads the camera or fits it to the box; window as of tl_camera_fit_points. */
int cli_picture_camera(cli_session *session, const double bounds[6], const double window[4],
                       cli_picture *picture);
/* The camera of a frame, for a picture of the final size. */
tl_camera cli_picture_frame(const cli_picture *picture, size_t frame);
/* The name of a frame's file. */
void cli_picture_name(const cli_session *session, const cli_picture *picture, size_t frame,
                      char name[CLI_PATH_BYTES]);
void cli_picture_close(const cli_session *session, cli_picture *picture);

/* ---- words on the picture: cli_annotate.c ---- */

/* Text of an annotation, and what it borrows. */
typedef struct cli_words {
    tl_annotation annotation;
    tl_scalar_bar bars[CLI_SHADES_MAX];
    char note[512];
} cli_words;
/* Whether --annotation names a part. Returns an exit status for unknown words. */
int cli_words_check(const cli_session *session);
void cli_words_set(const cli_scene *scene, const cli_picture *picture, cli_words *words);

#endif
