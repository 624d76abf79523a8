/* Stage draw, internal: OpenGL, for the files draw_gl*.c alone. What is used exists in OpenGL 3.3
 * core and OpenGL ES 3.0 alike: no vertex attributes but what shaders fetch from textures by
 * gl_VertexID, no buffers but indices. Rays and lists need OpenGL 4.3. */
#ifndef TETRALOD_SRC_DRAW_GL_H
#define TETRALOD_SRC_DRAW_GL_H

#include <epoxy/gl.h>

#include "draw/draw_backend.h"

/* ---- the context ---- */

typedef enum tli_gl_kind {
    TLI_GL_ANY,    /* an own context, desktop OpenGL where there is such */
    TLI_GL_ES,     /* an own context of OpenGL ES */
    TLI_GL_CURRENT /* the one of EGL that is current on the thread whenever something is done */
} tli_gl_kind;

typedef struct tli_gl {
    void *display, *context; /* of EGL; NULL: the caller's */
    void *kept[4];           /* display, context and surfaces that were current before */
    GLint kept_target, kept_view[4];
    bool es, software;
    bool modern;       /* has compute shaders and what else rays and lists need */
    bool tells_resets; /* can be asked whether it is lost */
    bool lost;         /* for good: all calls fail for TL_ERR_IO */
    char name[192];    /* "gl: " and GL_RENDERER */
    GLint side_max;    /* of textures */
    size_t block_max;  /* bytes of a buffer that shaders see; where it is modern */
    GLuint nothing;    /* a vertex array without arrays */
    size_t bytes;      /* of textures and buffers */
    char message[256]; /* of the first error that the driver reported */
} tli_gl;

/* TL_ERR_UNSUPPORTED says why there is none. Gives *gl. */
tl_status tli_gl_open(tl_ctx *ctx, tli_gl_kind kind, tli_gl **gl);
/* NULL is allowed. What is left in the context goes with it, unless it is the caller's. */
void tli_gl_close(tl_ctx *ctx, tli_gl *gl);
/* Between these two, on one thread, the context is current and calls of OpenGL are allowed; end
 * puts back what was there, and turns an error of OpenGL into a status. Returns status, or that.
 * TL_ERR_IO for a context that is lost. */
tl_status tli_gl_begin(tl_ctx *ctx, tli_gl *gl);
tl_status tli_gl_end(tl_ctx *ctx, tli_gl *gl, tl_status status);
/* The status of the errors since then, which are forgotten. */
tl_status tli_gl_check(tl_ctx *ctx, tli_gl *gl);

/* ---- programs ---- */

/* Text of the shaders of a program, behind what all share: each in parts, of which the first that
 * is NULL ends it. */
enum { TLI_GL_VERTEX, TLI_GL_FRAGMENT, TLI_GL_COMPUTE, TLI_GL_STAGES };
enum { TLI_GL_PARTS = 4 };
typedef struct tli_gl_source {
    const char *name; /* for messages */
    bool modern;      /* for OpenGL 4.3 */
    const char *text[TLI_GL_STAGES][TLI_GL_PARTS];
} tli_gl_source;
/* Compiles and links; TL_ERR_UNSUPPORTED with the first line of the log. */
tl_status tli_gl_program(tl_ctx *ctx, const tli_gl *gl, const tli_gl_source *source,
                         GLuint *program);
/* Sets numbers of the program in use; what its shaders do not use is passed over. */
void tli_gl_set_int(GLuint program, const char *name, GLint value);
void tli_gl_set_float(GLuint program, const char *name, double value);
void tli_gl_set_vec2(GLuint program, const char *name, double x, double y);
/* Binds a texture to a unit below TLI_GL_UNITS and gives it to a sampler. */
enum { TLI_GL_UNITS = 12 };
void tli_gl_set_texture(GLuint program, const char *name, GLuint unit, GLuint texture);

/* What all things of a picture share. */
typedef struct tli_gl_view {
    const tli_frame *frame;
    uint32_t width, height;
    double depths[2]; /* nothing is nearer or farther, in units of the frame */
} tli_gl_view;

/* Sets what shaders want to know of the view. */
void tli_gl_set_view(GLuint program, const tli_gl_view *view);

/* ---- textures ---- */

/* Shaders find item i of a table at column i mod 4096 of row i / 4096. */
enum { TLI_GL_COLUMNS = 4096 };

/* Numbers for shaders; {0} is empty. */
typedef struct tli_gl_table {
    GLuint texture;
    size_t bytes;
} tli_gl_table;
/* Fills a table anew with items [item_count] of format GL_RGBA32F, GL_R32F, GL_RGBA32UI or
 * GL_R32UI. TL_ERR_UNSUPPORTED for more than textures hold. */
tl_status tli_gl_table_fill(tl_ctx *ctx, tli_gl *gl, tli_gl_table *table, GLenum format,
                            const void *items, size_t item_count);
void tli_gl_table_free(tli_gl *gl, tli_gl_table *table);

/* Bytes for shaders of OpenGL 4.3; {0} is empty. */
typedef struct tli_gl_buffer {
    GLuint name;
    size_t bytes; /* of room */
} tli_gl_buffer;
/* Fills a buffer anew with items [item_count]; NULL: makes room for them, or leaves what is there.
 * TL_ERR_UNSUPPORTED for more than shaders see. */
tl_status tli_gl_buffer_fill(tl_ctx *ctx, tli_gl *gl, tli_gl_buffer *buffer, const void *items,
                             size_t item_count, size_t item_bytes);
void tli_gl_buffer_free(tli_gl *gl, tli_gl_buffer *buffer);
/* Gives it to the block of a binding. */
void tli_gl_buffer_bind(const tli_gl_buffer *buffer, GLuint binding);

/* Depths of a picture beyond all things: of nothing there, for shaders. */
#define TLI_GL_NEAREST (-1e30F)
#define TLI_GL_FARTHEST 1e30F

/* A picture inside of OpenGL, rows from below upwards: {0} is empty. */
enum { TLI_GL_COLOR = 1, TLI_GL_DEPTH = 2 };
typedef struct tli_gl_target {
    GLuint frame;
    GLuint color; /* RGBA32F, times opacity; 0: none */
    GLuint depth; /* R32F along the view in units of the frame; 0: none */
    GLuint order; /* with colour and depth: depth buffer for tests */
    uint32_t width, height;
    size_t bytes;
} tli_gl_target;
/* Makes it, of TLI_GL_COLOR, TLI_GL_DEPTH or both, or makes it anew when the size is another. */
tl_status tli_gl_target_set(tl_ctx *ctx, tli_gl *gl, tli_gl_target *target, uint32_t width,
                            uint32_t height, int parts);
/* What is drawn goes there. */
void tli_gl_target_use(const tli_gl_target *target);
/* Sets rows of the depth, [row_count][width]. */
void tli_gl_target_send_depth(const tli_gl_target *target, uint32_t row, uint32_t row_count,
                              const float *depths);
/* Reads rows of the colour, [row_count][width][4], as GL_FLOAT or, not of OpenGL ES,
 * GL_UNSIGNED_BYTE. */
void tli_gl_target_read(const tli_gl_target *target, GLenum type, uint32_t row, uint32_t row_count,
                        void *values);
/* Reads rows of the depth, [row_count][width]. numbers [row_count][width][4]: room, where the
 * context reads no less; else it may be NULL. */
void tli_gl_target_read_depth(const tli_gl *gl, const tli_gl_target *target, uint32_t row,
                              uint32_t row_count, float *depths, float *numbers);
void tli_gl_target_free(tli_gl *gl, tli_gl_target *target);

/* ---- volumes ---- */

/* Integrals of the transfer function, and gradients: {0} is empty. */
typedef struct tli_gl_fog {
    tli_gl_table sums, bases;
    tli_gl_table gradients; /* with light */
} tli_gl_fog;
tl_status tli_gl_fog_add(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_fog *fog);
void tli_gl_fog_remove(tli_gl *gl, tli_gl_fog *fog);
/* Gives all that pieces of a ray depend on to the program in use; units from first on are used. */
enum { TLI_GL_FOG_UNITS = 3 };
void tli_gl_fog_set(GLuint program, const tli_gl_view *view, const tli_item *item,
                    const tli_gl_fog *fog, GLuint first);

/* True if nothing has changed that places depend on; else notes what they depend on now. */
typedef struct tli_gl_place {
    tli_frame frame;
    uint32_t width, height;
} tli_gl_place;
bool tli_gl_place_is(tli_gl_place *place, const tli_gl_view *view);

/* ---- projected tetrahedra: draw_gl_tets.c ---- */

/* What volumes share: {0} is not open. */
typedef struct tli_gl_projector {
    GLuint one, all; /* programs: of one slab, of all */
    GLuint corners;  /* indices of the faces of a batch of tets */
} tli_gl_projector;
void tli_gl_projector_close(tli_gl *gl, tli_gl_projector *projector);

/* The tets of a volume: {0} is empty. */
typedef struct tli_gl_tets {
    tli_gl_table tets;         /* stay */
    tli_gl_table verts, order; /* of a view */
    size_t tet_count;          /* in order */
    tli_gl_place place;        /* that they were made for */
} tli_gl_tets;
void tli_gl_tets_remove(tli_gl *gl, tli_gl_tets *tets);
/* Opens what is not open, places the vertices and orders the tets for a view. */
tl_status tli_gl_tets_place(tl_ctx *ctx, tli_gl *gl, tli_gl_projector *projector,
                            const tli_gl_view *view, const tli_item *item, tli_gl_tets *tets);
/* Draws what lies between depths, pixel by pixel, over what is in the frame in use, once for all
 * slabs: slab i, between limits[i] and the nearer limits[i + 1], into its attachment i. */
enum { TLI_GL_SLABS = 4 };
void tli_gl_tets_draw(const tli_gl_projector *projector, const tli_gl_view *view,
                      const tli_item *item, const tli_gl_fog *fog, const tli_gl_tets *tets,
                      const GLuint *limits, int slab_count);

/* ---- lists of what lies at each pixel: draw_gl_lists.c ---- */

/* {0} is empty. */
typedef struct tli_gl_lists {
    tli_gl_buffer heads, nodes, colors; /* as list.glsl says; colors by node, where they are kept */
    size_t node_max;
} tli_gl_lists;
enum { TLI_GL_LIST_HEADS = 0, TLI_GL_LIST_NODES = 1, TLI_GL_LIST_COLORS = 2 }; /* bindings */
/* Empties the lists of pixels and binds them to be filled. TL_ERR_UNSUPPORTED for more than shaders
 * see. */
tl_status tli_gl_lists_begin(tl_ctx *ctx, tli_gl *gl, tli_gl_lists *lists, size_t pixel_count,
                             bool colored);
/* Puts them in order, by the program that sorter receives at the first call. */
tl_status tli_gl_lists_sort(tl_ctx *ctx, tli_gl *gl, GLuint *sorter, const tli_gl_lists *lists,
                            size_t pixel_count);
/* Waits for the card, and makes more room where it was short: *again is true then, and all has to
 * be done once more. given_up: what shaders counted there. */
tl_status tli_gl_lists_end(tl_ctx *ctx, tli_gl *gl, tli_gl_lists *lists, bool *again,
                           size_t *given_up);
void tli_gl_lists_free(tli_gl *gl, tli_gl_lists *lists);

/* ---- rays: draw_gl_rays.c ---- */

/* What volumes share: {0} is not open. */
typedef struct tli_gl_caster {
    GLuint placer, doors, rays, sorter; /* programs */
    tli_gl_lists entries, layers; /* where rays come in; what is translucent, with its colour */
} tli_gl_caster;
/* Opens what is not open. */
tl_status tli_gl_caster_open(tl_ctx *ctx, const tli_gl *gl, tli_gl_caster *caster);
void tli_gl_caster_close(tli_gl *gl, tli_gl_caster *caster);

/* The mesh of a volume: {0} is empty. */
typedef struct tli_gl_web {
    tli_gl_buffer tets, behind, places, doors; /* stay */
    tli_gl_buffer verts;                       /* places are of a view */
    size_t vert_count, door_count;
    tli_gl_place place; /* that they were made for */
} tli_gl_web;
tl_status tli_gl_web_add(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_web *web);
void tli_gl_web_remove(tli_gl *gl, tli_gl_web *web);
/* Places the vertices and lists where rays come in, nearer than limit. What is drawn goes to a
 * picture of the view's size, which is not changed. */
tl_status tli_gl_web_enter(tl_ctx *ctx, tli_gl *gl, tli_gl_caster *caster, const tli_gl_view *view,
                           tli_gl_web *web, GLuint limit);
/* What a ray goes through. */
typedef struct tli_gl_scene {
    const tli_item *item; /* the volume; NULL: none */
    const tli_gl_fog *fog;
    const tli_gl_web *web;
    bool has_layers;
    const tli_gl_target *back; /* what is behind, and where rays end */
} tli_gl_scene;
/* Puts all of it in front of the back, into the colour of the target; cancelled between bands of
 * rows. */
tl_status tli_gl_caster_follow(tl_ctx *ctx, const tli_gl_caster *caster, const tli_gl_view *view,
                               const tli_gl_scene *scene, const tli_gl_target *target);

/* ---- surfaces, lines, points and slices: draw_gl_paint.c ---- */

/* Programs by the kind of the thing; {0} is not open. */
typedef struct tli_gl_painter {
    bool lists; /* fragments go into lists, not into the picture */
    GLuint programs[TLI_ITEM_SLICES + 1];
} tli_gl_painter;
/* Opens what is not open. */
tl_status tli_gl_painter_open(tl_ctx *ctx, const tli_gl *gl, bool lists, tli_gl_painter *painter);
void tli_gl_painter_close(tli_gl_painter *painter);

/* A thing in OpenGL, its places relative to an anchor: {0} is empty. */
typedef struct tli_gl_thing {
    tli_gl_table verts;     /* place, and of slices the scalar from 0 to 1, of lines the way along
                               them, of points a die */
    tli_gl_table normals;   /* and value in steps of the look's transfer function */
    tli_gl_table corners;   /* vertices of triangles or tets; where segments of lines begin */
    tli_gl_table colors;    /* of the look's transfer function */
    double low[3], high[3]; /* box of all places that are finite */
    double anchor[3];
    size_t count;    /* of triangles, tets, segments or points */
    double range[2]; /* of the scalar of slices */
    tl_range_index *ranges;
} tli_gl_thing;
tl_status tli_gl_thing_add(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_thing *thing);
void tli_gl_thing_remove(tl_ctx *ctx, tli_gl *gl, tli_gl_thing *thing);
/* Draws what is nearer than limit, the translucent fragments or the others, into the target in use,
 * or into lists; *tag is that of the first piece there, and receives that of the next. */
void tli_gl_thing_draw(const tli_gl_painter *painter, const tli_gl_view *view, const tli_item *item,
                       const tli_gl_thing *thing, bool translucent, GLuint limit, GLint *tag);

/* ---- a picture: draw_gl_frame.c ---- */

/* What a back end has open, {0} is nothing: programs and rooms are made when they are needed first,
 * and stay. */
typedef struct tli_gl_state {
    tli_gl *gl;
    tli_gl_projector projector;
    tli_gl_caster caster;
    tli_gl_painter painter, lister;         /* into pictures, into lists */
    GLuint cover;                           /* program: a picture over another */
    GLuint query;                           /* whether a layer has anything */
    tli_gl_target before;                   /* depth alone is used: of what the picture holds */
    tli_gl_target opaque, sum;              /* opaque things; all */
    tli_gl_target layers[TLI_GL_SLABS + 1]; /* the farthest layers that are left, in turns */
    tli_gl_target slabs[TLI_GL_SLABS - 1];  /* of the volume, before layers of a pass */
    GLuint slab_frame;                      /* the sum and the slabs */
} tli_gl_state;

/* A thing in OpenGL. */
typedef struct tli_gl_item {
    tli_gl_thing thing;
    /* of a volume */
    tli_gl_fog fog;
    tli_gl_web web;   /* for rays; empty: it is projected */
    tli_gl_tets tets; /* for projection, from the first picture on that needs them */
} tli_gl_item;

/* Between parts of a picture, of which a card or a processor in its place has done some:
 * TL_ERR_CANCELLED where nobody wants the rest. */
tl_status tli_gl_go_on(tl_ctx *ctx);
/* Draws all things in front of a colour [4], times opacity, as far as the depth of a picture, NULL:
 * of none. *drawn receives where they are; their depths are in s->opaque. */
tl_status tli_gl_frame_draw(tl_ctx *ctx, tli_gl_state *s, tli_gl_view *view, tli_item *const *items,
                            size_t item_count, const float background[4], const tl_image *behind,
                            const tli_gl_target **drawn);
void tli_gl_frame_free(tli_gl_state *s);

/* ---- between pictures in memory and in OpenGL: draw_gl_fetch.c ---- */

/* Gives the depth of a picture, or of none (NULL), in units of the frame to two targets. */
tl_status tli_gl_send_depth(tl_ctx *ctx, tli_gl_state *s, const tl_image *image, double unit);
/* Puts what was drawn in front of a picture. */
tl_status tli_gl_fetch(tl_ctx *ctx, const tli_gl_state *s, const tli_gl_target *drawn, double unit,
                       tl_image *image);
/* Reads it in 8 bits, and where depth is not NULL that; as of tl_renderer_draw_bytes. */
tl_status tli_gl_fetch_bytes(tl_ctx *ctx, const tli_gl_state *s, const tli_gl_target *drawn,
                             double unit, uint8_t *rgba, float *depth);

/* ---- the back end: draw_gl_renderer.c ---- */

/* Opens it with any kind of context. */
tl_status tli_gl_backend_open(tl_ctx *ctx, tli_gl_kind kind, void **state);

#endif
