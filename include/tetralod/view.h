/* tetralod, stage view: a scene made visible. A source (a model or a mesh) and a scene give a
 * content, all that is drawn for a camera; a content is drawn by any renderer, on any thread.
 *
 * Threads: building (tl_view) happens on one thread with its context, drawing (tl_shown) may happen
 * on another one with a context of its own at the same time. A content is immutable: several
 * threads may read and draw it at once. It shares meshes, triangles and colours with its view and
 * with other contents of it, so it is destroyed on the building thread, with the context that made
 * it, after every tl_shown has gone over to another one; its view may be gone by then.
 *
 * What returns a status can also fail for TL_ERR_MEMORY and TL_ERR_BUDGET, runs on the pool and can
 * be stopped by the progress hook of its context: TL_ERR_CANCELLED. What failed or was stopped has
 * changed nothing that is seen; the next call begins anew. Results do not depend on the number of
 * threads, nor on what was built before. */
#ifndef TETRALOD_VIEW_H
#define TETRALOD_VIEW_H

#include "tetralod/draw.h"
#include "tetralod/formats.h"
#include "tetralod/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- sources ---- */

/* What is looked at: a model, or a mesh in memory. Its functions may be called by several threads
 * at once, each with a context of its own; what is kept counts on the budget of the context that
 * asked for it first, so all contexts handed in must outlive the source. */
typedef struct tl_source tl_source;

/* A channel. Of a series one for all of its steps. */
typedef struct tl_source_channel {
    const char *name, *unit; /* unit "" when unknown */
    uint32_t components;
    tl_on on;
    double range[2]; /* of the original, of several components that of their norm; of a series over
                        all steps, of one of files that of the step that was read first */
    bool has_steps;
} tl_source_channel;
typedef struct tl_source_step {
    uint32_t number;
    double time;      /* NaN: none */
    const char *file; /* path of its own file, of a series of files; else NULL */
} tl_source_step;
typedef struct tl_source_facts {
    const char *name; /* path of a model, name of a mesh */
    bool is_model;
    uint64_t tets, verts;              /* of the original */
    double bounds[6], diagonal;        /* x0, x1, y0, y1, z0, z1, mesh units */
    const tl_source_channel *channels; /* [channel_count] */
    size_t channel_count;
    const tl_source_step *steps; /* [step_count] of a series, rising; else none. Of a mesh of
                                    memory only that of tl_source_set_step */
    size_t step_count;
    size_t own_step;     /* place of the one that is shown where a scene names none */
    uint64_t file_bytes; /* of a model; else 0 */
} tl_source_facts;

/* Opens a model: reads no more than its head. Gives *source. TL_ERR_IO, TL_ERR_FORMAT,
 * TL_ERR_UNSUPPORTED as of tl_store_open. */
TL_API tl_status tl_source_open(tl_ctx *ctx, const char *path, tl_source **source);
/* Takes over a mesh made with this context, on success only; copies name. Gives *source.
 * TL_ERR_DATA for a mesh without tets. */
TL_API tl_status tl_source_create(tl_ctx *ctx, tl_mesh *mesh, const char *name, tl_source **source);
/* Reads a file that is no model. Where it has steps (tl_series_find), step is the number of the one
 * that is read now, -1: its own; another is read when it is asked for, and the last ones are kept
 * as long as the budget has room for another one. What the facts say of the mesh is that of the
 * step read first. read: as of tl_mesh_read, without step and time, may be NULL; what it borrows
 * must outlive the source. Gives *source. Statuses of tl_series_find and tl_mesh_read; TL_ERR_DATA
 * for a mesh without tets, TL_ERR_ARG for a step that is none (the message lists those there are).
 */
TL_API tl_status tl_source_read(tl_ctx *ctx, const char *path, const tl_read_opts *read,
                                int64_t step, tl_source **source);
/* Lets go of the steps of tl_source_read that nobody looks at; true: there were some. */
TL_API bool tl_source_trim(tl_source *source);
/* Says which step of its series the mesh of a source is, before it is looked at: its one step,
 * which a scene can ask for. TL_ERR_ARG for a model, which knows, or a series. */
TL_API tl_status tl_source_set_step(tl_ctx *ctx, tl_source *source, uint32_t number);
/* After all views of it; contents do not need it. NULL is allowed. */
TL_API void tl_source_destroy(tl_source *source);
/* Borrowed from the source. */
TL_API const tl_source_facts *tl_source_get_facts(const tl_source *source);
/* Bytes read from the file so far; 0 of a mesh. */
TL_API uint64_t tl_source_bytes_read(const tl_source *source);
/* The model, borrowed; NULL of a mesh. */
TL_API tl_store *tl_source_store(const tl_source *source);

/* How much of the volume has which values: fractions of it [bin_count] over range, which is filled:
 * least and largest finite value, on a logarithmic scale (bins of equal ratios) positive ones. Of
 * all of the data at the scene's step, whatever it clips and chooses; channel as things name it,
 * also one that the scene derives, or an expression. Of a model the values of a coarse mesh, which
 * is made by the first call, over the range of the original, of a series that of all its steps. Of
 * several components the norm, of a channel on tets the mean at each vertex, as they are drawn.
 * TL_ERR_ARG for a channel (the message lists those there are) or step that is none. */
TL_API tl_status tl_source_histogram(tl_ctx *ctx, tl_source *source, const tl_scene *scene,
                                     const char *channel, bool logarithmic, double *bins,
                                     size_t bin_count, double range[2]);

/* Adds to a scene without things what a first look shows: of a room the volume of the most
 * promising channel, of a part its boundary in the colours of it, and its edges. What the scene
 * derives and chooses counts. */
TL_API tl_status tl_first_look(tl_ctx *ctx, tl_source *source, tl_scene *scene);
/* The name of that channel, cut off at bytes with its end; "" where there is none. */
TL_API tl_status tl_first_channel(tl_ctx *ctx, tl_source *source, const tl_scene *scene, char *name,
                                  size_t bytes);

/* ---- how values are shown ---- */

/* A channel that is shown in colours, as it is used: what is automatic in its transfer node is
 * decided here. "shown" is what is drawn of a value: scaled where numbers are too large or small,
 * its power of ten on a logarithmic scale. */
typedef struct tl_values {
    const char *channel; /* or an expression */
    const char *title;   /* with unit, vectors between bars */
    bool logarithmic;
    double least, most; /* finite values of all of the data (of a model those of the original, but
                           of what is derived); of a logarithmic scale positive ones */
    double range[2];    /* at the ends of the colours */
    double shown_range[2];
    const tl_color_point *colors; /* [color_count] by value */
    size_t color_count;
    const tl_opacity_point *opacities; /* [opacity_count] by value */
    size_t opacity_count;
    const tl_transfer *transfer; /* of what is shown */
} tl_values;

/* ---- views ---- */

/* All that is drawn; see below. */
typedef struct tl_content tl_content;

/* Makes contents of one source; keeps the cut, meshes, colours and things, so that a change costs
 * what it changes. One thread at a time, with the context that made it. */
typedef struct tl_view tl_view;
/* Borrows source. Gives *view. */
TL_API tl_status tl_view_create(tl_ctx *ctx, tl_source *source, tl_view **view);
/* Frees what the next build could use again; contents and the cut stay. */
TL_API void tl_view_trim(tl_view *view);
/* Contents stay. NULL is allowed. */
TL_API void tl_view_destroy(tl_view *view);

/* What a build may cost, beside what the scene's detail says: for pictures while the camera moves,
 * and first ones. */
typedef struct tl_view_limits {
    size_t struct_bytes;
    uint64_t tets_max;     /* default UINT64_MAX: what the scene says */
    double error_px_least; /* no finer than this error on the screen, pixels; default 0 */
    bool any_cut;          /* default false; true: things of the cut that is there, whatever the
                              camera, without limits, unless its mesh would have to be made and has
                              more than tets_max: a change of colours is seen at once. What the
                              content promises is that of this cut */
} tl_view_limits;
TL_API tl_view_limits tl_view_limits_defaults(void);

/* Makes all that the scene shows for a camera, whose size is that of the final picture. A model is
 * cut as the scene's detail node says (tl_cut_query): error_px on the screen counted where values
 * are visible, errors of channels, tets; with focus, bounds inside of the box are focus_gain times
 * finer; frozen: the cut stays that of the last build. Nothing of a mesh that did not change is
 * made again: colours, opacities, values of surfaces and what is visible leave cut and mesh as they
 * are where the mesh is fine enough for them. limits may be NULL. Gives *content. TL_ERR_ARG for
 * what the scene names and the source lacks (the message lists what there is), TL_ERR_DATA if
 * nothing is left of the mesh or a thing has nothing to follow. */
TL_API tl_status tl_view_build(tl_ctx *ctx, tl_view *view, const tl_scene *scene,
                               const tl_camera *camera, const tl_view_limits *limits,
                               tl_content **content);

/* The same scene, but for what it names and the source lacks: a step becomes the first one,
 * regions, thresholds, planes and formulas that can't be, or leave nothing, are off, things of
 * channels that are not there are hidden, or lose their colours. Gives *scene, nothing to undo in
 * it, and text [bytes], bytes > 0, with a line for each change; "": there was none. */
TL_API tl_status tl_view_adapt(tl_ctx *ctx, tl_view *view, const tl_scene *from, tl_scene **scene,
                               char *text, size_t bytes);

/* How a channel is shown by a scene, before there is a content. What is automatic follows from all
 * of the data, not from what is chosen of it, nor from the cut.
 * Gives *values, borrowed until the next call with this view. TL_ERR_ARG as of tl_view_build. */
TL_API tl_status tl_view_values(tl_ctx *ctx, tl_view *view, const tl_scene *scene,
                                const char *channel, const tl_values **values);
/* The box of what the scene leaves of the mesh (x0, x1, y0, y1, z0, z1), for cameras. */
TL_API tl_status tl_view_bounds(tl_ctx *ctx, tl_view *view, const tl_scene *scene,
                                double bounds[6]);
/* The part of a picture that the scene's annotation leaves free, as of tl_annotation_window. */
TL_API tl_status tl_view_window(tl_ctx *ctx, tl_view *view, const tl_scene *scene, uint32_t width,
                                uint32_t height, double window[4]);

/* ---- contents ---- */

/* NULL is allowed. ctx as it was made with. */
TL_API void tl_content_destroy(tl_ctx *ctx, tl_content *content);

/* The bound of a channel. */
typedef struct tl_content_error {
    const char *channel; /* of the mesh */
    double error;        /* in its unit, at every original vertex */
} tl_content_error;
typedef struct tl_content_facts {
    bool is_model;
    int64_t step;   /* number of the one that is shown; -1: there are none */
    double time;    /* of it; NaN: none */
    uint64_t tets;  /* of the mesh that things are made of; of a model of which no more is drawn
                       than surfaces and planes, patch by patch, and what stands around them, of its
                       cut */
    uint64_t verts; /* of that mesh; 0: of such a cut */
    uint64_t whole_tets;  /* of it before thresholds, regions and planes chose some, */
    bool is_part;         /* which they did */
    uint64_t source_tets; /* of the original */
    uint64_t patches;     /* of a model */
    uint64_t decoded; /* of such a cut, by this build: other patches were there, or are not met */
    double error_px;  /* of a model: off by so many pixels at most; else 0 */
    double boundary_error, space_error; /* mesh units; of a model, else 0 */
    const tl_content_error *errors; /* [error_count] of a model: of the channels that the mesh has
                                       of it, its first ones */
    size_t error_count;
    bool bounds_kept; /* what was asked for is kept */
    bool is_complete; /* all that the scene asks for: no limit made it coarser */
    double bounds[6]; /* of what is seen: x0, x1, y0, y1, z0, z1 */
    uint64_t bytes;   /* of meshes and things that it keeps, those it shares included */
    double cut_s, mesh_s, extract_s; /* what its build took, in seconds */
    bool is_moving;                  /* lines move with time: pictures of other times differ */
} tl_content_facts;
/* Borrowed from the content, as are all that follow. */
TL_API const tl_content_facts *tl_content_get_facts(const tl_content *content);
/* How far what another camera sees of it is off at most, in pixels of that picture, as
 * facts.error_px is for the camera it was made for: infinite where a visible value was lost, since
 * its isosurface then has no place; 0 of a mesh. TL_ERR_ARG for a camera that is none. */
TL_API tl_status tl_content_error_px(tl_ctx *ctx, const tl_content *content,
                                     const tl_camera *camera, double *pixels);
/* The channels shown [*count], in the order in which things name them. */
TL_API const tl_values *const *tl_content_all_values(const tl_content *content, size_t *count);
/* The one of that name; NULL if it is not shown. */
TL_API const tl_values *tl_content_values(const tl_content *content, const char *channel);
/* What the scene's samples come to for this content: rays a pixel and side of a picture of that
 * size. */
TL_API uint32_t tl_content_samples(const tl_content *content, const tl_scene *scene, uint32_t width,
                                   uint32_t height);

/* ---- drawing ---- */

/* What a renderer has of a content. One thread at a time, that of the renderer. */
typedef struct tl_shown tl_shown;
/* Borrows renderer, which has nothing in it. Gives *shown. */
TL_API tl_status tl_shown_create(tl_ctx *ctx, tl_renderer *renderer, tl_shown **shown);
/* Hides what is shown. NULL is allowed. ctx as it was made with, here and below. */
TL_API void tl_shown_destroy(tl_ctx *ctx, tl_shown *shown);
/* Goes over to a content, which is borrowed until the next one is shown, or hidden. Things that
 * both have stay in the renderer. On failure nothing is shown. */
TL_API tl_status tl_content_show(tl_ctx *ctx, tl_shown *shown, const tl_content *content);
/* Takes all out of the renderer. */
TL_API void tl_content_hide(tl_ctx *ctx, tl_shown *shown);

typedef struct tl_draw_opts {
    size_t struct_bytes;
    double time_s;    /* by which dashes and arrows have moved on, at the speed of their node;
                         default 0 */
    uint32_t samples; /* rays a pixel and side, 1 to 8; default 1: see tl_content_samples */
    double scale;     /* of widths of lines and points, that are pixels of the final picture: 0.5
                         for a picture that is shown twice as large; default 1 */
} tl_draw_opts;
TL_API tl_draw_opts tl_draw_opts_defaults(void);
/* Draws what is shown, with the silhouettes of this camera. opts may be NULL. Gives *image, which
 * is transparent where nothing is (tl_image_flatten). TL_ERR_ARG if nothing was shown; statuses of
 * tl_renderer_draw. */
TL_API tl_status tl_content_draw(tl_ctx *ctx, tl_shown *shown, const tl_camera *camera,
                                 const tl_draw_opts *opts, tl_image **image);
/* Writes title, scalar bars, axes, box, triad and note of the scene onto a picture that is not
 * flattened yet. TL_ERR_UNSUPPORTED in a build without pango. */
TL_API tl_status tl_content_annotate(tl_ctx *ctx, const tl_content *content, const tl_scene *scene,
                                     const tl_camera *camera, tl_image *image);
/* The same onto a page at path, .pdf or .svg, as of tl_annotation_write; the picture stays as it
 * is.
 */
TL_API tl_status tl_content_write(tl_ctx *ctx, const tl_content *content, const tl_scene *scene,
                                  const tl_camera *camera, const tl_image *image, const char *path);
/* The note: how many tets of how many, and the promised errors. Gives text [bytes]. */
TL_API void tl_content_note(const tl_content *content, char *text, size_t bytes);

/* ---- what lies at a place ---- */

/* A channel at a place. */
typedef struct tl_probe_value {
    const char *name, *unit; /* borrowed from the mesh, as below */
    uint32_t components;
    const double *values; /* [components], linear between corners, or that of the tet */
    double error; /* at every original vertex around there values are within so much of these; 0 of
                     a mesh, infinite of what is derived of a model's channels */
} tl_probe_value;
typedef struct tl_probe {
    double xyz[3];
    bool is_inside; /* of a tet; false: of what follows only value_count holds */
    tl_lidx tet;
    double tet_size; /* its longest edge, mesh units */
    int32_t region;
    const char *region_name; /* NULL: none */
    uint32_t patch, level;   /* of a model that tet is of; TL_NONE where it is not known */
    tl_probe_value *values;  /* [value_count] all channels; gives: tl_probe_release */
    size_t value_count;
} tl_probe;
/* What is at a place of a mesh. *probe is zeroed before the first call; it may be used for other
 * places of the same mesh, where a place near the last one is found faster. locator: of this mesh.
 * Patches and errors are not known here: TL_NONE, 0. Any thread. */
TL_API tl_status tl_mesh_probe(tl_ctx *ctx, const tl_mesh *mesh, const tl_locator *locator,
                               const double xyz[3], tl_probe *probe);
/* Empties it. NULL is allowed. */
TL_API void tl_probe_release(tl_ctx *ctx, tl_probe *probe);

/* What is at a place of a content, with patch, level and errors as of tl_mesh_probe. The first call
 * makes what finds tets, which stays with the content. Gives *probe (tl_probe_release). Any thread.
 */
TL_API tl_status tl_content_probe(tl_ctx *ctx, const tl_content *content, const double xyz[3],
                                  tl_probe *probe);
/* The place under a pixel (x_px to the right, y_px down, of the camera's picture; the middle of the
 * first pixel is 0.5, 0.5): where the line of sight has gathered half of the opacity that it
 * gathers, from volumes and surfaces that can be seen through, up to what is opaque there (by the
 * depth of image, which may be NULL and of another size); else where it enters the mesh. *is_hit
 * false: there is nothing. Any thread. */
TL_API tl_status tl_content_pick(tl_ctx *ctx, const tl_content *content, const tl_camera *camera,
                                 double x_px, double y_px, const tl_image *image, double xyz[3],
                                 bool *is_hit);

/* ---- for those who make other things of a cut than pictures ---- */

typedef struct tl_view_request {
    size_t struct_bytes;
    const tl_camera *camera; /* NULL (default): no view; error_px of the scene counts in its picture
                                else */
    const float *opacity, *unseen; /* of tl_cut_query; default NULL */
    uint32_t channel;              /* of the model, whose visible values a surface is made of:
                                      errors of it, or of no channel, are asked of these alone;
                                      default TL_NONE */
    const char *const *names;      /* [name_count] of the channels that the mesh is to have, those
                                      that the source lacks are passed over; default NULL: all */
    size_t name_count;
} tl_view_request;
TL_API tl_view_request tl_view_request_defaults(void);
/* Moves the cut to what the scene's data and detail nodes and a request, which may be NULL, ask
 * for: without any bound and camera to the finest mesh. Nothing of a mesh. Gives the cut's state in
 * *state (may be NULL). */
TL_API tl_status tl_view_cut(tl_ctx *ctx, tl_view *view, const tl_scene *scene,
                             const tl_view_request *request, tl_cut_state *state);
/* The cut, borrowed; NULL before tl_view_cut and of a mesh. */
TL_API tl_cut *tl_view_get_cut(const tl_view *view);
/* The mesh of the cut after tl_view_cut, with what the scene derives and chooses. whole_tets (may
 * be NULL): before it chose. Borrowed until the next call with this view. */
TL_API tl_status tl_view_mesh(tl_ctx *ctx, tl_view *view, const tl_scene *scene,
                              const tl_mesh **mesh, size_t *whole_tets);

/* Seeds of streamlines as words: grid[:N], critical[:N], box:X0,Y0,Z0,X1,Y1,Z1[:N],
 * line:X0,Y0,Z0,X1,Y1,Z1[:N], plane:X,Y,Z,NX,NY,NZ[:N], or a file of lines of three numbers. False
 * for words that are none; a file is looked at later. */
TL_API bool tl_seeds_are_words(const char *text);
/* Lines of a vector channel of the mesh, on vertices, from seeds as words. opts and report as of
 * tl_streamlines. Gives *lines. TL_ERR_ARG for words that are no seeds or a channel without three
 * components, TL_ERR_IO and TL_ERR_FORMAT of a file, TL_ERR_DATA where nothing is critical. */
TL_API tl_status tl_seeds_follow(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                                 const char *seeds, const tl_stream_opts *opts, tl_polydata **lines,
                                 tl_stream_report *report);

#ifdef __cplusplus
}
#endif
#endif
