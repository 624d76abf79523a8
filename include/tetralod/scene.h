/* tetralod, stage scene: the document of what is shown and how. Nodes with properties, commands as
 * text, undo, one JSON file; cameras and transfer functions in the files of VTK and ParaView; how a
 * camera moves. No data, no toolkit: shells and batch jobs share it.
 *
 * A scene belongs to one thread at a time. What returns a status can also fail for TL_ERR_MEMORY
 * and TL_ERR_BUDGET, and leaves the scene as it was when it fails. ctx is that with which the scene
 * was made. */
#ifndef TETRALOD_SCENE_H
#define TETRALOD_SCENE_H

#include "tetralod/draw.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- what a scene is made of: one table ---- */

typedef enum tl_node_kind {
    /* one of each, always there, the first four of a scene */
    TL_NODE_DATA = 0,
    TL_NODE_CAMERA = 1,
    TL_NODE_PICTURE = 2,
    TL_NODE_DETAIL = 3,
    /* what the mesh is; any number, as all below */
    TL_NODE_DERIVE = 4,
    TL_NODE_CLIP = 5,
    TL_NODE_THRESHOLD = 6,
    /* how a channel is coloured; no two of one channel */
    TL_NODE_TRANSFER = 7,
    /* things that are drawn */
    TL_NODE_VOLUME = 8,
    TL_NODE_SURFACE = 9,
    TL_NODE_SLICE = 10,
    TL_NODE_BOUNDARY = 11,
    TL_NODE_EDGES = 12,
    TL_NODE_SILHOUETTES = 13,
    TL_NODE_POINTS = 14,
    TL_NODE_LINES = 15,
    TL_NODE_KIND_COUNT = 16
} tl_node_kind;
/* "surface"; NULL for what is no kind. */
TL_API const char *tl_node_kind_name(tl_node_kind kind);
/* The kind of a name; TL_NODE_KIND_COUNT if there is none. */
TL_API tl_node_kind tl_node_kind_named(const char *name);
/* What it is for, a line. */
TL_API const char *tl_node_kind_help(tl_node_kind kind);

/* A node's number in its scene, not used again; 0: none. The four single ones are TL_NODE_DATA + 1
 * to TL_NODE_DETAIL + 1. */
typedef uint32_t tl_node;

/* Values of a property. Colours, lists and texts may be empty, of the others all but flags, counts
 * and choices where the preset is: then it is chosen for the data, as the property's help says. */
typedef enum tl_prop_type {
    TL_PROP_FLAG = 0,    /* 0 or 1; as text: on, off */
    TL_PROP_COUNT = 1,   /* a whole number */
    TL_PROP_REAL = 2,    /* 1 real, or 2: an interval, the first not above the second */
    TL_PROP_CHOICE = 3,  /* the index of a word */
    TL_PROP_TEXT = 4,    /* UTF-8, one line, at most TL_SCENE_TEXT_BYTES - 1 bytes */
    TL_PROP_CHANNEL = 5, /* text: the name of a channel, or a formula of channels */
    TL_PROP_COLOR = 6,   /* 3 reals, sRGB, 0 to 1; as text: as of tl_color_read */
    TL_PROP_POINT = 7,   /* 3 reals: a place or a direction, mesh units */
    TL_PROP_BOX = 8,     /* 6 reals: x0 y0 z0, x1 y1 z1, the first not above the second */
    TL_PROP_PLANE = 9, /* 6 reals: a point and a normal that is not 0; as text also x, -y=V, z=P% of
                          the bounds of the scene */
    TL_PROP_LIST = 10  /* rows of count reals by a first one that does not fall, at most
                          TL_SCENE_ROWS_MAX; as text reals of a row with commas between, spaces
                          between rows */
} tl_prop_type;

enum {
    TL_SCENE_NODES_MAX = 1000, /* nodes of a scene */
    TL_SCENE_NAME_BYTES = 64,  /* name of a node with its end */
    TL_SCENE_TEXT_BYTES = 4096,
    TL_SCENE_ROWS_MAX = 4096,
    TL_SCENE_STEPS_MAX = 500 /* steps that can be undone; older ones are forgotten */
};

/* A property of all nodes of a kind. The table drives JSON, commands, panels, help and manual. */
typedef struct tl_prop_info {
    const char *name; /* "width_px" */
    tl_prop_type type;
    uint32_t count;             /* reals, or those of a row; 0 of texts */
    double least, most;         /* of every real but the first of a list's row, both included */
    bool logarithmic;           /* a slider has steps of equal ratio */
    const char *const *choices; /* NULL-terminated words of a choice, else NULL */
    const char *unit;           /* "px", "s", "degrees", "tets", "bytes", "mesh units", "channel",
                                   "%" and their like; "": none */
    const char *preset;         /* what a new node has, as text; "": empty */
    const char *help;           /* a line */
} tl_prop_info;
/* [*count]; lives as long as the library. NULL and 0 for what is no kind. */
TL_API const tl_prop_info *tl_node_props(tl_node_kind kind, size_t *count);
/* The property with a name, NULL if there is none. */
TL_API const tl_prop_info *tl_node_prop(tl_node_kind kind, const char *name);

/* A value, borrowed from the scene until its next change. Flags, counts and choices (their index)
 * are reals. */
typedef struct tl_value {
    const double *reals;
    size_t count;     /* of reals: 0 of texts and of what is empty */
    const char *text; /* of texts, channels and choices (the word); else NULL */
} tl_value;

/* ---- scenes ---- */

typedef struct tl_scene tl_scene;
/* The four single nodes with their presets. Gives *scene. */
TL_API tl_status tl_scene_create(tl_ctx *ctx, tl_scene **scene);
/* NULL is allowed. */
TL_API void tl_scene_destroy(tl_ctx *ctx, tl_scene *scene);
/* The same nodes, numbers, versions and frame, nothing to undo; ctx may be another one, which the
 * copy then is of. Gives *scene. */
TL_API tl_status tl_scene_copy(tl_ctx *ctx, const tl_scene *from, tl_scene **scene);

/* Bounds (x0, x1, y0, y1, z0, z1) of the data, and the size of the picture with the part of it that
 * is free for the data (tl_annotation_window; NULL: all of it): what `view`, `fit`, planes in words
 * and empty planes, boxes and cameras are for. No part of the document: neither undone nor written.
 * TL_ERR_ARG for bounds that are not finite or the wrong way around, and sizes of 0. Before: 0 to 1
 * in all directions, 1024 x 1024 pixels. */
TL_API tl_status tl_scene_set_bounds(tl_ctx *ctx, tl_scene *scene, const double bounds[6]);
TL_API tl_status tl_scene_set_frame(tl_ctx *ctx, tl_scene *scene, uint32_t width, uint32_t height,
                                    const double window[4]);
TL_API void tl_scene_bounds(const tl_scene *scene, double bounds[6]);

/* All nodes in the order in which things are drawn, the four single ones first; borrowed until the
 * next change. */
TL_API const tl_node *tl_scene_nodes(const tl_scene *scene, size_t *count);
/* Kind and name ("surface2") of a node; TL_NODE_KIND_COUNT and NULL if there is none. */
TL_API tl_node_kind tl_scene_kind(const tl_scene *scene, tl_node node);
TL_API const char *tl_scene_name(const tl_scene *scene, tl_node node);
/* The node with a name; the transfer function of a channel; 0 if there is none. */
TL_API tl_node tl_scene_find(const tl_scene *scene, const char *name);
TL_API tl_node tl_scene_transfer_of(const tl_scene *scene, const char *channel);

/* Numbers of what the scene, or a node, says: equal numbers mean equal content (names included),
 * also across copies, files and undo. A chance of 2^-64 aside. */
TL_API uint64_t tl_scene_version(const tl_scene *scene);
TL_API uint64_t tl_scene_node_version(const tl_scene *scene, tl_node node);

/* ---- properties ---- */

/* TL_ERR_ARG names the node or property that is not there. */
TL_API tl_status tl_scene_get(tl_ctx *ctx, const tl_scene *scene, tl_node node, const char *prop,
                              tl_value *value);
/* The first real (0 if empty), whether it is not 0, the text ("" if there is none); the same where
 * the property is not there. */
TL_API double tl_scene_real(const tl_scene *scene, tl_node node, const char *prop);
TL_API bool tl_scene_flag(const tl_scene *scene, tl_node node, const char *prop);
TL_API const char *tl_scene_text(const tl_scene *scene, tl_node node, const char *prop);
/* The value as `set` reads it, cut off at max_bytes with its end. Returns the bytes of all of it
 * without its end. */
TL_API size_t tl_scene_print(const tl_scene *scene, tl_node node, const char *prop, char *text,
                             size_t max_bytes);
/* A plane or box as it is meant: where it is empty the plane through the middle of the bounds
 * across x, or the middle half of the bounds. */
TL_API void tl_scene_plane(const tl_scene *scene, tl_node node, const char *prop, double plane[6]);
TL_API void tl_scene_box(const tl_scene *scene, tl_node node, const char *prop, double box[6]);

/* Sets a property; the value is copied. Texts and choices come as text, choices also as an index.
 * TL_ERR_ARG names node, property and what is expected of it. Equal values change nothing. */
TL_API tl_status tl_scene_set(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                              const tl_value *value);
TL_API tl_status tl_scene_set_reals(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                                    const double *reals, size_t count);
TL_API tl_status tl_scene_set_real(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                                   double value);
TL_API tl_status tl_scene_set_flag(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                                   bool value);
/* Of any type, as `set` reads it (without quotes); "auto" and "none" are empty. */
TL_API tl_status tl_scene_set_text(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *prop,
                                   const char *text);

/* Adds a node with its presets behind the others. Gives its number, *node, which may be NULL.
 * TL_ERR_ARG for a kind of which there is one, or too many nodes. */
TL_API tl_status tl_scene_add(tl_ctx *ctx, tl_scene *scene, tl_node_kind kind, tl_node *node);
/* TL_ERR_ARG for a node that is not there or is a single one, here and below. */
TL_API tl_status tl_scene_remove(tl_ctx *ctx, tl_scene *scene, tl_node node);
/* Letters of ASCII, digits, _ and -, a letter first; no other node has the name. */
TL_API tl_status tl_scene_rename(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *name);
/* To a place among the nodes that are not single, 0 the first; beyond the last: the last. */
TL_API tl_status tl_scene_move(tl_ctx *ctx, tl_scene *scene, tl_node node, size_t place);

/* ---- steps ---- */

/* Each change is a step. Successive sets of one property are one step until the scene is sealed (a
 * drag is one step), those of the camera all together. */
TL_API void tl_scene_seal(tl_scene *scene);
/* Changes between begin and end are one step of a name (copied; less than TL_SCENE_NAME_BYTES); of
 * groups in each other, at most 8, the outermost one. Successive groups of one name are one step
 * until the scene is sealed. end with keep false takes back what came after its begin. Neither undo
 * nor redo in between. */
TL_API tl_status tl_scene_begin(tl_ctx *ctx, tl_scene *scene, const char *name);
TL_API tl_status tl_scene_end(tl_ctx *ctx, tl_scene *scene, bool keep);
/* TL_ERR_ARG where there is nothing to undo or redo. */
TL_API tl_status tl_scene_undo(tl_ctx *ctx, tl_scene *scene);
TL_API tl_status tl_scene_redo(tl_ctx *ctx, tl_scene *scene);
/* What would be undone or redone, "set surface1.value"; NULL: nothing. Borrowed until the next
 * change. */
TL_API const char *tl_scene_undo_name(const tl_scene *scene);
TL_API const char *tl_scene_redo_name(const tl_scene *scene);
/* Forgets all steps: after a file was opened. */
TL_API void tl_scene_forget(tl_ctx *ctx, tl_scene *scene);

/* ---- commands ---- */

/* Carries out one line:
 *     set NODE.PROP VALUE        the value to the end of the line
 *     add KIND [PROP=VALUE]...   one step
 *     remove NODE
 *     rename NODE NAME
 *     move NODE PLACE
 *     view AZ,EL[,ZOOM]          as of tl_view_read, all of the bounds in view
 *     fit                        all of the bounds in view, seen from where they are
 *     undo | redo | seal
 * Words in double quotes keep spaces, \" and \\ stand for " and \ in them; # before a word begins a
 * comment, unless the word is a colour, #RRGGBB. An empty line does nothing. NODE is a name.
 * TL_ERR_ARG says what was expected. */
TL_API tl_status tl_scene_do(tl_ctx *ctx, tl_scene *scene, const char *line);
/* Word of command i and its line of help ("set NODE.PROP VALUE", "..."); NULL past the last. */
TL_API const char *tl_scene_command(size_t index, const char **help);
/* Cuts off and unquotes the first word of a command line, for commands of shells. *line moves
 * behind it; word receives at most max_bytes with its end. false: there is none; TL_ERR_ARG: its
 * quotes don't close, or it does not fit. */
TL_API tl_status tl_scene_word(tl_ctx *ctx, const char **line, char *word, size_t max_bytes,
                               bool *found);

/* ---- files ---- */

/* {"tetralod_scene": 1, "data": {...}, "camera": {...}, "picture": {...}, "detail": {...},
 *  "things": [{"kind": "surface", "name": "surface1", ...}]}; what is not there has its preset.
 * Unknown keys are a warning in the log. Gives *scene. TL_ERR_IO; TL_ERR_FORMAT names line or place
 * (things[2].value) and what is expected; TL_ERR_UNSUPPORTED in a build without jansson. */
TL_API tl_status tl_scene_read(tl_ctx *ctx, const char *path, tl_scene **scene);
/* The same from memory; name stands for the path in messages. */
TL_API tl_status tl_scene_read_text(tl_ctx *ctx, const char *name, const char *text, size_t bytes,
                                    tl_scene **scene);
/* All of it: equal scenes give equal bytes, and what is read again is equal. The file appears only
 * when complete. TL_ERR_UNSUPPORTED for more than 16 MiB, which are not read again. */
TL_API tl_status tl_scene_write(tl_ctx *ctx, const tl_scene *scene, const char *path);
/* Gives *text, *bytes long and 0 behind it (tl_mem_free). */
TL_API tl_status tl_scene_write_text(tl_ctx *ctx, const tl_scene *scene, char **text,
                                     size_t *bytes);

/* ---- cameras ---- */

/* The camera for a picture of that size. One without a position is fitted to the bounds (from 30
 * degrees of azimuth and 20 of elevation). A parallel one without a scale shows at the focal point
 * what perspective does. */
TL_API void tl_scene_camera(const tl_scene *scene, uint32_t width, uint32_t height,
                            tl_camera *camera);
/* Sets all of the camera, as one step. TL_ERR_ARG as of tl_camera_check. */
TL_API tl_status tl_scene_set_camera(tl_ctx *ctx, tl_scene *scene, const tl_camera *camera);

/* "AZ,EL", "AZ,EL,ZOOM", or a side that is looked from, +x -x +y -y +z -z iso, also with ,ZOOM:
 * degrees, degrees, and 1 or a zoom above 0. false for anything else. */
TL_API bool tl_view_read(const char *text, double view[3]);

/* A camera in JSON: an object with position, focal_point, view_up (three numbers each), view_angle
 * (degrees), parallel_scale, parallel_projection, size (two numbers, pixels); names as VTK writes
 * them (Position, FocalPoint ...) will do, what is missing has its default. Also one under
 * "camera". TL_ERR_IO, TL_ERR_FORMAT; TL_ERR_UNSUPPORTED in a build without jansson. */
TL_API tl_status tl_camera_read(tl_ctx *ctx, const char *path, tl_camera *camera);
/* The same of a list of such objects, alone or under "cameras", or of a single one. Gives *cameras
 * [*count] (tl_mem_free). */
TL_API tl_status tl_cameras_read(tl_ctx *ctx, const char *path, tl_camera **cameras, size_t *count);
/* Writes what both read: an object, or a list of several. The file appears only when complete. */
TL_API tl_status tl_cameras_write(tl_ctx *ctx, const char *path, const tl_camera *cameras,
                                  size_t count);

/* ---- how a camera moves ----
 * Pixels are those of the camera's picture, from its upper left corner. Angles are degrees. A
 * camera that looks nowhere (tl_camera_check) stays as it is. */

typedef enum tl_orbit_style {
    TL_ORBIT_TURNTABLE =
        0, /* sideways around an axis of space; over its ends the camera does not go */
    TL_ORBIT_TRACKBALL = 1 /* around the picture's own directions: any attitude */
} tl_orbit_style;
/* Goes around a pivot (NULL: the focal point), whose distance it keeps: to the right by the first
 * angle, upwards by the second one. axis: of the turntable; NULL: z. */
TL_API void tl_camera_orbit(tl_camera *camera, const double pivot[3], double right, double up,
                            tl_orbit_style style, const double axis[3]);
/* Turns the camera as a whole around an axis through a pivot. */
TL_API void tl_camera_spin(tl_camera *camera, const double pivot[3], const double axis[3],
                           double angle);
/* Turns the picture clockwise. */
TL_API void tl_camera_roll(tl_camera *camera, double angle);
/* Moves across so that what is at a distance along the view (0: that of the focal point) follows
 * the pointer, which went right and down by pixels. */
TL_API void tl_camera_pan(tl_camera *camera, double right_px, double down_px, double distance);
/* What lies around a point becomes factor times as large, the point stays where it is on the
 * picture. NULL: the point at the focal point's distance under a pixel. A factor that is not above
 * 0 changes nothing. */
TL_API void tl_camera_zoom(tl_camera *camera, double factor, const double point[3]);
TL_API void tl_camera_zoom_px(tl_camera *camera, double factor, double x_px, double y_px);
/* Flies: turns the view right and up where it stands (around an axis of space as the turntable
 * does; NULL: z), then moves by mesh units along the view, right and up. The focal point moves
 * along. */
TL_API void tl_camera_fly(tl_camera *camera, const double axis[3], double right, double up,
                          const double forward_right_up[3]);
/* Makes a camera parallel or perspective; at the focal point sizes stay. */
TL_API void tl_camera_set_parallel(tl_camera *camera, bool parallel);
/* Looks along its direction at all of the bounds (tl_camera_fit_points); window NULL: all of the
 * picture. */
TL_API void tl_camera_fit_box(tl_camera *camera, const double bounds[6], const double window[4],
                              double zoom);
/* Looks from a view of tl_view_read at all of the bounds, with a view angle of 30 degrees, smaller
 * for a zoom above 1. Size and parallel or not stay. */
TL_API void tl_camera_stand(tl_camera *camera, const double view[3], const double bounds[6],
                            const double window[4]);
/* The ray of a pixel: where it begins (the position; of a parallel view a place beside it) and its
 * direction of length 1. Both 0 of a camera that looks nowhere. */
TL_API void tl_camera_ray(const tl_camera *camera, double x_px, double y_px, double origin[3],
                          double direction[3]);
/* Where a point is on the picture, pixels, and its distance along the view; false behind the camera
 * of a perspective view. */
TL_API bool tl_camera_project(const tl_camera *camera, const double xyz[3], double px[2],
                              double *distance);

/* ---- colours and transfer functions ---- */

/* A colour as text: a name (white black grey red orange yellow green teal blue purple brown bone
 * steel gold), #RRGGBB or R,G,B from 0 to 1, to sRGB; false for anything else. */
TL_API bool tl_color_read(const char *text, double rgb[3]);
/* Name of colour i; NULL past the last one. */
TL_API const char *tl_color_name(size_t index);

/* Control points of a transfer function: straight between each other in the value, or its
 * logarithm. A block of its own (tl_mem_free). */
typedef struct tl_control_points {
    tl_color_point *colors; /* [color_count], by values that do not fall; none: there were none */
    tl_opacity_point *opacities; /* [opacity_count], the same; none: there were none */
    size_t color_count, opacity_count;
    bool logarithmic; /* the file asks for a logarithmic scale */
    bool has_nan;     /* the colour of NaN is given */
    double nan_rgb[3];
} tl_control_points;
/* Reads ParaView's JSON (a list of colour maps, of which the first is taken; commas before a
 * closing bracket are forgiven): ColorSpace and RGBPoints; Points with midpoint and sharpness;
 * UseLogScale, HSVWrap, NanColor. Ways that are not straight become many points;
 * logarithmic: in the logarithm, also if the file does not ask for it. Gives *points. TL_ERR_IO,
 * TL_ERR_FORMAT; TL_ERR_UNSUPPORTED in a build without jansson. */
TL_API tl_status tl_control_points_read(tl_ctx *ctx, const char *path, bool logarithmic,
                                        tl_control_points **points);
/* Writes what ParaView reads as a preset of a name. The file appears only when complete. */
TL_API tl_status tl_control_points_write(tl_ctx *ctx, const char *path, const char *name,
                                         const tl_control_points *points);
/* How opaque points make values from low to high at most (those without opacities: 1), and the
 * largest error of such values that changes opacity, and colour times opacity, by no more than
 * TL_UNSEEN; it looks no farther than some times high - low. Values are straight, logarithmic or
 * not.
 */
#define TL_UNSEEN (1.0 / 64) /* a change that is not seen in a picture of 8 bits */
TL_API void tl_control_points_visible(const tl_control_points *points, double low, double high,
                                      double *opacity, double *unseen);
/* The same into a transfer node, as one step: colors, opacities and nan_color, and
 * logarithmic if the file asks for it. */
TL_API tl_status tl_transfer_read(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *path);

#ifdef __cplusplus
}
#endif
#endif
