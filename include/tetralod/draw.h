/* tetralod, stage draw: pictures without window system, GPU or root. The renderer on the processor
 * is the reference that others are compared with.
 *
 * What returns a status can also fail for TL_ERR_MEMORY and TL_ERR_BUDGET, and runs on the pool.
 * Pictures do not depend on the number of threads. */
#ifndef TETRALOD_DRAW_H
#define TETRALOD_DRAW_H

#include "tetralod/cut.h"
#include "tetralod/extract.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- pictures ---- */

/* Colours and opacity of pixels, row after row from the top; blocks of tl_mem_alloc. Colours are
 * sRGB numbers, 0 to 1, times opacity. */
typedef struct tl_image {
    uint32_t width, height;
    float *rgba;  /* [height][width][4] */
    float *depth; /* [height][width] of the nearest opaque thing: distance from the camera along its
                     view, mesh units; infinity where there is none */
} tl_image;
/* Transparent, with nothing in it. Gives *image. TL_ERR_ARG for a side of 0 or above 32,768. */
TL_API tl_status tl_image_create(tl_ctx *ctx, uint32_t width, uint32_t height, tl_image **image);
/* NULL is allowed. */
TL_API void tl_image_destroy(tl_ctx *ctx, tl_image *image);
/* Means of squares of factor x factor pixels, with their nearest depth; factor divides both sides,
 * else TL_ERR_ARG. Gives *small. */
TL_API tl_status tl_image_reduce(tl_ctx *ctx, const tl_image *image, uint32_t factor,
                                 tl_image **small);
/* Puts the picture in front of a colour (sRGB, 0 to 1); it is opaque then. NULL: white. */
TL_API void tl_image_flatten(tl_image *image, const float background[3]);
/* 8 bits a channel, with opacity where a pixel is not opaque. The file appears only when complete.
 * TL_ERR_IO; TL_ERR_UNSUPPORTED in a build without libpng. */
TL_API tl_status tl_image_write_png(tl_ctx *ctx, const tl_image *image, const char *path);

/* The camera of a first look: all of the box (x0, x1, y0, y1, z0, z1) in view, from an azimuth and
 * elevation in degrees (0, 0: along -y, z up), zoom 1 or another. */
TL_API tl_camera tl_camera_fit(const double bounds[6], double azimuth, double elevation,
                               double zoom, uint32_t width, uint32_t height);

/* ---- transfer functions ---- */

/* Colours and opacities of values, linear between control points, constant beyond them. Immutable.
 */
typedef struct tl_transfer tl_transfer;
typedef struct tl_color_point {
    double value;
    double rgb[3]; /* sRGB, 0 to 1 */
} tl_color_point;
typedef struct tl_opacity_point {
    double value;
    double opacity; /* of a layer as thick as the unit distance, 0 to 1 */
} tl_opacity_point;

/* Copies colors [color_count] and opacities [opacity_count], each at least one, by rising value
 * (equal values: a step). unit_distance: mesh units, above 0. Gives *transfer. TL_ERR_ARG for
 * numbers out of range or order (the message names the point). */
TL_API tl_status tl_transfer_create(tl_ctx *ctx, const tl_color_point *colors, size_t color_count,
                                    const tl_opacity_point *opacities, size_t opacity_count,
                                    double unit_distance, tl_transfer **transfer);
/* NULL is allowed. */
TL_API void tl_transfer_destroy(tl_ctx *ctx, tl_transfer *transfer);
/* The same with another colour of NaN, on surfaces, lines and points (sRGB, 0 to 1). Gives
 * *transfer. TL_ERR_ARG for numbers out of range. */
TL_API tl_status tl_transfer_with_nan(tl_ctx *ctx, const tl_transfer *from, const double rgb[3],
                                      tl_transfer **transfer);
/* Colour of a value, and the extinction there, by mesh unit. Colour of NaN: grey, or as of
 * tl_transfer_with_nan. Any thread. */
TL_API void tl_transfer_at(const tl_transfer *transfer, double value, float rgb[3],
                           double *extinction);

/* Name of a colour map, NULL past the last one: perceptual ones first. The colours of map name,
 * over 0 to 1; *count points, which live as long as the library. NULL for an unknown name. */
TL_API const char *tl_colormap_name(size_t index);
TL_API const tl_color_point *tl_colormap(const char *name, size_t *count);
/* Whether it has two arms that part at its middle, which stands for a value that matters, most
 * often 0. False for an unknown name. */
TL_API bool tl_colormap_is_diverging(const char *name);

/* ---- volumes ---- */

/* A mesh made ready for rays: who lies behind which face, and where they can come in. Immutable;
 * borrows the mesh. */
typedef struct tl_volume tl_volume;
/* opposite: of tl_mesh_adjacency, or NULL to compute it. Gives *volume. */
TL_API tl_status tl_volume_create(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                                  tl_volume **volume);
/* NULL is allowed. */
TL_API void tl_volume_destroy(tl_ctx *ctx, tl_volume *volume);

/* How OpenGL draws a volume; the processor always follows rays. Both methods blend volume and
 * translucent things in exact order. */
typedef enum tl_volume_method {
    TL_VOLUME_AUTOMATIC = 0, /* rays where they can be, else projected tets */
    TL_VOLUME_PROJECTED = 1, /* tet by tet, by TL_ORDER: on any driver. The order is found by the
                                processor whenever the camera moves; every 4 translucent layers take
                                a pass */
    TL_VOLUME_RAYS = 2 /* a ray a pixel, all on the card: OpenGL 4.3, and buffers that hold the
                          mesh; else TL_ERR_UNSUPPORTED */
} tl_volume_method;
/* How renderers that draw tet by tet find out which lies behind which; rays always know. */
typedef enum tl_volume_order {
    TL_ORDER_EXACT = 0,    /* by their faces and, across gaps, by a ray a pixel */
    TL_ORDER_CENTROIDS = 1 /* by their distance: faster, with errors where sizes differ */
} tl_volume_order;
typedef struct tl_volume_opts {
    size_t struct_bytes;
    double opacity_end; /* a ray ends when it has this opacity, up to 1; default 0.999. Closer to 1
                           costs time */
    double step_depth;  /* optical depth that is integrated as one piece, up to 0.2; default 0.1.
                           The error of a ray falls with its square, the time grows */
    /* light and gradient opacity take twice the time */
    const double *gradients; /* [vert_count][3] of the scalar, by mesh unit; default NULL, which lit
                                and gradient_opacity do not allow. borrowed as the scalar is */
    bool lit;                /* light from the camera, gradients as normals; default false */
    double ambient, diffuse, specular, shininess; /* as of tl_look; default 0.4, 0.6, 0.2, 20 */
    double gradient_opacity; /* length of the gradient, in units of the scalar by mesh unit, from
                                which on opacity is full; below, extinction falls in proportion, so
                                that only where values change is seen. 0 (default): opacity is that
                                of the transfer function */
    tl_volume_order order;   /* default TL_ORDER_EXACT */
    tl_volume_method method; /* default TL_VOLUME_AUTOMATIC */
} tl_volume_opts;
TL_API tl_volume_opts tl_volume_opts_defaults(void);

/* Direct volume rendering by casting a ray a pixel through the tets: absorption and emission of a
 * scalar that is linear in each tet, integrated over the transfer function's integrals, so that no
 * feature between samples is missed. scalar [vert_count]; a NaN is not seen. The volume stands in
 * front of what is in the picture, up to its depth. The camera may stand inside of the mesh. opts
 * may be NULL. TL_ERR_ARG for a camera of another size than the picture's, or out of range.
 * Sondershaus 2007, chapter 7; Cignoni et al. 1997, section V. */
TL_API tl_status tl_draw_volume(tl_ctx *ctx, const tl_volume *volume, const double *scalar,
                                const tl_transfer *transfer, const tl_camera *camera,
                                const tl_volume_opts *opts, tl_image *image);

/* ---- the renderer: things that are added once and drawn many times ---- */

typedef enum tl_renderer_kind {
    TL_RENDERER_AUTO = 0, /* GL where it is a real GPU, else the processor */
    TL_RENDERER_CPU = 1,
    TL_RENDERER_GL = 2,
    TL_RENDERER_NULL = 3, /* checks calls and data, draws nothing */
    /* GL in the caller's context of EGL, which is current whenever the renderer is called; what it
       draws into and its viewport stay, other state is that of a new context */
    TL_RENDERER_GL_CURRENT = 4
} tl_renderer_kind;

/* Things and what draws them. One thread at a time. */
typedef struct tl_renderer tl_renderer;
/* A thing in a renderer; 0: none. Numbers are not used again. */
typedef uint32_t tl_item;

/* Gives *renderer. TL_ERR_UNSUPPORTED for TL_RENDERER_GL where there is none; TL_ERR_ARG for
 * TL_RENDERER_GL_CURRENT without a current context, and for a kind that is none. */
TL_API tl_status tl_renderer_create(tl_ctx *ctx, tl_renderer_kind kind, tl_renderer **renderer);
/* Removes what is in it. NULL is allowed. ctx as it was made with, here and below. */
TL_API void tl_renderer_destroy(tl_ctx *ctx, tl_renderer *renderer);
/* "cpu", "gl: NAME OF THE DEVICE", "null"; lives as long as the renderer. */
TL_API const char *tl_renderer_name(const tl_renderer *renderer);
/* Bytes that it holds in a graphics card, beside the memory of the context; those of pictures from
 * the first one on. */
TL_API size_t tl_renderer_card_bytes(const tl_renderer *renderer);

/* How a thing looks. Light comes from the camera to both sides of a surface: with c the cosine of
 * the angle between normal and view, a colour is color * (ambient + diffuse * c) + specular *
 * c^shininess, at most 1. */
typedef struct tl_look {
    size_t struct_bytes;
    double rgb[3];               /* sRGB, 0 to 1; default a light grey */
    const double *scalar;        /* [vert_count] colours by value; default NULL: rgb. borrowed */
    const tl_transfer *transfer; /* colours of the scalar, which it comes with. borrowed */
    double opacity;              /* 0 to 1, default 1 */
    bool lit;                    /* default true; false: the colour as it is */
    double ambient, diffuse, specular; /* 0 to 1; default 0.3, 0.7, 0.15 */
    double shininess;                  /* 1 to 1,000; default 30 */
} tl_look;
TL_API tl_look tl_look_defaults(void);

typedef enum tl_line_shape {
    TL_LINE_FLAT = 0,  /* a band of one brightness */
    TL_LINE_TUBE = 1,  /* lit as a cylinder */
    TL_LINE_RIBBON = 2 /* lit as a band that lies in the surface of the normals of the lines */
} tl_line_shape;
typedef struct tl_line_opts {
    size_t struct_bytes;
    tl_line_shape shape;  /* default TL_LINE_TUBE */
    double width_px;      /* pixels, above 0; default 2 */
    double width;         /* mesh units; above 0: instead of width_px, near lines are wider */
    double halo_px;       /* pixels beside a line where it hides what is behind it; default 0 */
    double dash, gap;     /* mesh units along the line that are drawn and left out; default 0: no
                             gaps */
    double phase;         /* mesh units by which dashes and arrows are moved along; default 0 */
    double arrow_spacing; /* mesh units from one arrow to the next; default 0: no arrows */
} tl_line_opts;
TL_API tl_line_opts tl_line_opts_defaults(void);

typedef struct tl_point_opts {
    size_t struct_bytes;
    double radius_px; /* pixels, above 0; default 1.5 */
    double radius;    /* mesh units; above 0: instead of radius_px, near points are larger */
    bool scale_depth; /* fewer points where they are far, so that they stay as dense on the picture
                         (Sondershaus 2007, 7.2); default false */
} tl_point_opts;
TL_API tl_point_opts tl_point_opts_defaults(void);

/* Each adds a thing and gives its number, which may be NULL. Looks and options may be NULL
 * (defaults) and are copied; all that they point to and the other things given are borrowed until
 * the thing is removed, and do not change meanwhile. TL_ERR_ARG for numbers out of range, another
 * kind of polydata, corners that are none; TL_ERR_UNSUPPORTED for what the back end does not draw;
 * TL_ERR_IO of a context of OpenGL that is lost. */

/* As of tl_draw_volume. A renderer draws one volume: TL_ERR_UNSUPPORTED for a second one. */
TL_API tl_status tl_renderer_add_volume(tl_ctx *ctx, tl_renderer *renderer, const tl_volume *volume,
                                        const double *scalar, const tl_transfer *transfer,
                                        const tl_volume_opts *opts, tl_item *item);
/* Triangles, lit by their normals where there are, else flat. Triangles without area or with a
 * corner that is not finite are not seen. */
TL_API tl_status tl_renderer_add_surface(tl_ctx *ctx, tl_renderer *renderer,
                                         const tl_polydata *triangles, const tl_look *look,
                                         tl_item *item);
TL_API tl_status tl_renderer_add_lines(tl_ctx *ctx, tl_renderer *renderer, const tl_polydata *lines,
                                       const tl_look *look, const tl_line_opts *opts,
                                       tl_item *item);
TL_API tl_status tl_renderer_add_points(tl_ctx *ctx, tl_renderer *renderer,
                                        const tl_polydata *points, const tl_look *look,
                                        const tl_point_opts *opts, tl_item *item);
/* The slices of tl_slice_mesh, made where they are drawn, with the gradient of the scalar as
 * normals. scalar [vert_count] of the mesh, as is the scalar of the look; values [value_count] are
 * copied. */
TL_API tl_status tl_renderer_add_slices(tl_ctx *ctx, tl_renderer *renderer, const tl_mesh *mesh,
                                        const double *scalar, const double *values,
                                        size_t value_count, const tl_look *look, tl_item *item);
/* Moves slices to other values [value_count], which are copied. TL_ERR_ARG for an item that is none
 * of slices, or values that are not finite, none, or too many; the old ones stay then. */
TL_API tl_status tl_renderer_set_slices(tl_ctx *ctx, tl_renderer *renderer, tl_item item,
                                        const double *values, size_t value_count);
/* 0 and numbers of things that were removed are allowed. */
TL_API void tl_renderer_remove(tl_ctx *ctx, tl_renderer *renderer, tl_item item);

/* Draws all things in front of what the picture holds, up to its depth: the nearest opaque ones,
 * before them translucent ones in order of depth, with what the volume has in between (Cignoni et
 * al. 1997, V). At equal depth the thing added last is in front, and translucent ones are before
 * opaque ones. Depth becomes that of the nearest opaque thing. TL_ERR_ARG as of tl_draw_volume, and
 * of TL_RENDERER_NULL for a thing that changed; of GL TL_ERR_UNSUPPORTED for more than the card
 * draws, TL_ERR_IO for a context that is lost, from then on at each call: another renderer is to be
 * made. */
TL_API tl_status tl_renderer_draw(tl_ctx *ctx, tl_renderer *renderer, const tl_camera *camera,
                                  tl_image *image);
/* The same for a window: a picture of the camera's size in 8 bits a channel, in front of a colour
 * (sRGB, 0 to 1) or of nothing (NULL: it stays transparent). OpenGL reads no more than these back.
 * rgba  [height][width][4] receives colours times opacity, rows from the top
 * depth [height][width] receives that of tl_image; NULL: not asked for
 * Statuses as of tl_renderer_draw; the outputs may be written in part where it fails. */
TL_API tl_status tl_renderer_draw_bytes(tl_ctx *ctx, tl_renderer *renderer, const tl_camera *camera,
                                        const float background[3], uint8_t *rgba, float *depth);

/* ---- numbers along an axis ---- */

enum { TL_TICKS_MAX = 64, TL_TICK_BYTES = 32 };
typedef struct tl_tick {
    double value;
    double at;                 /* 0 to 1 along the axis */
    char label[TL_TICK_BYTES]; /* UTF-8; "": a small tick without number */
} tl_tick;
/* Round numbers along an axis from low to high, finite, low <= high; most: numbers that have room,
 * at least 2. *exponent: the labels times 10^exponent are the values; 0 for numbers that read well
 * as they are. One value gives one tick in the middle. Returns the number of ticks. Any thread. */
TL_API size_t tl_ticks(double low, double high, size_t most, tl_tick ticks[TL_TICKS_MAX],
                       int *exponent);
/* Of a logarithmic axis, 0 < low <= high: labels are the values. */
TL_API size_t tl_ticks_log(double low, double high, size_t most, tl_tick ticks[TL_TICKS_MAX]);
/* "×10⁵"; "" for 0. */
TL_API void tl_exponent_text(int exponent, char text[TL_TICK_BYTES]);

/* ---- words and lines on a picture ---- */

/* Colours and what they mean. */
typedef struct tl_scalar_bar {
    const char *title;           /* name and unit */
    const tl_transfer *transfer; /* whose colours are shown, */
    double shown[2];             /* between these two arguments of it, */
    double range[2];             /* which stand for these values */
    bool logarithmic;            /* equal steps are equal ratios; range is above 0 then */
} tl_scalar_bar;

/* All of it is borrowed during a call. Texts are UTF-8; other bytes are replaced. */
typedef struct tl_annotation {
    size_t struct_bytes;
    const char *title; /* above; NULL (default): none */
    const char *note;  /* small, below: what the picture promises; NULL (default): none */
    const tl_scalar_bar *bars;
    size_t bar_count;        /* one above the other at the right; default 0 */
    const double *bounds;    /* [6] x0, x1, y0, y1, z0, z1 of what is seen; NULL (default): neither
                                outline nor axes */
    bool outline;            /* the edges of that box; default false */
    bool axes;               /* numbers along its outer edges; default false */
    bool triad;              /* the directions of x, y and z in a corner; default false */
    const float *background; /* [3] what the picture will stand in front of; NULL (default): not
                                known, text gets a bright rim */
    double text_px;          /* height of text; 0 (default): from the size of the picture */
} tl_annotation;
TL_API tl_annotation tl_annotation_defaults(void);

/* Draws words and lines onto a picture that is not flattened yet: edges of the box that lie behind
 * what is seen are put behind it. camera: of the picture. Fonts are the system's, family Sans; the
 * memory of text is not counted. TL_ERR_ARG for numbers that are not finite, TL_ERR_UNSUPPORTED in
 * a build without pango. */
TL_API tl_status tl_draw_annotation(tl_ctx *ctx, const tl_annotation *annotation,
                                    const tl_camera *camera, tl_image *image);
/* Writes a page instead, .pdf or .svg by the ending of path, of a point (of 72 an inch) a pixel:
 * the picture, which is as for tl_draw_annotation and stays as it is, as pixels, words and lines as
 * such. The file appears only when complete. TL_ERR_IO; TL_ERR_UNSUPPORTED for another ending and
 * in a build without pango; else as of tl_draw_annotation. */
TL_API tl_status tl_annotation_write(tl_ctx *ctx, const tl_annotation *annotation,
                                     const tl_camera *camera, const tl_image *image,
                                     const char *path);
/* The part of a picture of width x height pixels, above 0, that annotation leaves free: left,
 * right, bottom, top, from -1 to 1. */
TL_API void tl_annotation_window(const tl_annotation *annotation, uint32_t width, uint32_t height,
                                 double window[4]);

/* Moves a camera, whose directions stay, so that points [point_count][3] fill a window of its
 * picture (left < right, bottom < top, -1 to 1) as far as possible; of a parallel view the scale
 * changes, too. zoom above 0: above 1 only their middle is seen, by a smaller view angle. The focal
 * point moves along. A camera without directions stays where it is, as does one for no points or
 * points that are not finite. */
TL_API void tl_camera_fit_points(tl_camera *camera, const double *points, size_t point_count,
                                 const double window[4], double zoom);

#ifdef __cplusplus
}
#endif
#endif
