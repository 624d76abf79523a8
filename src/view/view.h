/* Stage view, internal: what the files of this stage share. What a view makes is kept under a
 * recipe, a number of all that it follows from, and shared by counting: bodies (a mesh and what is
 * computed of it), paints (how a channel is coloured), shapes (triangles, lines and points).
 * Builders add to a body what is missing; what a content reads of it never changes. */
#ifndef TETRALOD_SRC_VIEW_H
#define TETRALOD_SRC_VIEW_H

#include <stdatomic.h>
#include <string.h>

#include "base/base.h"
#include "base/base_lock.h"
#include "base/base_random.h"
#include "cut/cut_outlook.h"
#include "mesh/mesh.h"
#include "tetralod/view.h"

/* ---- recipes ---- */

/* Equal ones mean that things are made of the same, but for a chance of 2^-64. */
typedef uint64_t tli_recipe;
static inline tli_recipe tli_recipe_count(tli_recipe recipe, uint64_t number)
{
    return tli_mix_bits(recipe + UINT64_C(0x9e3779b97f4a7c15) + tli_mix_bits(number + 1));
}
static inline tli_recipe tli_recipe_bytes(tli_recipe recipe, const void *bytes, size_t count)
{
    uint64_t word;
    recipe = tli_recipe_count(recipe, count);
    for (size_t at = 0; at < count; at += sizeof word) {
        word = 0;
        memcpy(&word, (const char *)bytes + at,
               count - at < sizeof word ? count - at : sizeof word);
        recipe = tli_recipe_count(recipe, word);
    }
    return recipe;
}
static inline tli_recipe tli_recipe_text(tli_recipe recipe, const char *text)
{
    return tli_recipe_bytes(recipe, text, strlen(text));
}
static inline tli_recipe tli_recipe_real(tli_recipe recipe, double number)
{
    return tli_recipe_bytes(recipe, &number, sizeof number);
}

/* ---- bodies ---- */

/* A channel as a scalar: of vectors the length; factor times it, or its logarithm to the base 10.
 */
typedef struct tli_scalar {
    tli_recipe recipe;
    tl_on on;
    const double *values; /* [vert_count or tet_count] */
    double *own;          /* the same, unless they are those of the mesh */
    double *gradients;    /* [vert_count][3], NULL until they are asked for */
    double *spread; /* [spread_count] finite ones at the spots of the body, rising; likewise */
    size_t spread_count;
} tli_scalar;

/* The tets of a patch in the mesh of a cut, which has the patches one after another. */
typedef struct tli_run {
    uint32_t patch, tets, level;
} tli_run;

typedef struct tli_body {
    tl_ctx *ctx;
    atomic_size_t uses;
    tli_recipe recipe;
    tl_mesh *mesh;
    struct tli_body *base; /* whose arrays the mesh borrows; NULL: its own */
    size_t whole_tets;     /* before parts of it were chosen; 0: none were */
    double bounds[6], diagonal;
    tli_run *runs; /* [run_count] of a model */
    size_t run_count;
    double
        *run_errors; /* [run_count][error_count] bounds in a patch, of the mesh's first channels */
    size_t error_count;
    tl_lidx *spots; /* [spot_count] of looks: tets of places evenly over the volume, rising; its own
                       or those of its base */
    size_t spot_count;
    tli_lock locating;
    tl_locator *locator; /* of its own mesh; NULL until a content is asked, on any thread */
    /* made when they are asked for, by the builder alone */
    tl_channel *
        *formulas; /* [formula_count] channels of expressions; name, unit and values owned */
    size_t formula_count;
    tli_scalar **scalars; /* [scalar_count] */
    size_t scalar_count;
    tl_lidx *opposite;
    tl_volume *volume;
    tl_edges *edges; /* of the boundary, joined: lines of it may be asked for by several threads */
} tli_body;

/* Which patch each tet came from, as a channel on tets: where parts were chosen. */
#define TLI_MARKS "patch of a tet"

/* Box of the vertices with finite coordinates (x0, x1, y0, y1, z0, z1), 0 if there are none. */
void tli_mesh_box(const tl_mesh *mesh, double bounds[6], double *diagonal);
/* Takes over mesh, on success only. Gives *body, used once. view_body.c */
tl_status tli_body_create(tl_ctx *ctx, tl_mesh *mesh, tli_recipe recipe, tli_body **body);
/* A body whose mesh borrows all of another's, and may get channels of its own. Gives *body. */
tl_status tli_body_borrow(tl_ctx *ctx, tli_body *base, tli_recipe recipe, tli_body **body);
tli_body *tli_body_use(tli_body *body);
/* The last one frees it. NULL is allowed. */
void tli_body_release(tli_body *body);
/* The channel of that name or the values of an expression; TL_ERR_ARG lists the channels there are.
 * Borrowed from the body, as long as it is used. */
tl_status tli_body_channel(tl_ctx *ctx, tli_body *body, const char *name,
                           const tl_channel **channel);
/* On vertices; of values on tets the mean there. */
tl_status tli_body_scalar(tl_ctx *ctx, tli_body *body, const char *name, bool logarithmic,
                          double factor, tli_scalar **scalar);
/* On what the channel is on. */
tl_status tli_body_plain(tl_ctx *ctx, tli_body *body, const char *name, bool logarithmic,
                         double factor, tli_scalar **scalar);
tl_status tli_body_gradients(tl_ctx *ctx, tli_body *body, tli_scalar *scalar);
tl_status tli_body_opposite(tl_ctx *ctx, tli_body *body, const tl_lidx **opposite);
tl_status tli_body_volume(tl_ctx *ctx, tli_body *body, const tl_volume **volume);
tl_status tli_body_edges(tl_ctx *ctx, tli_body *body);
/* A mesh that borrows all of the body's and has one channel: the scalar, or none (NULL). */
typedef struct tli_dressed {
    tl_mesh mesh;
    tl_channel channel;
    size_t first; /* 0: to be carried along */
} tli_dressed;
void tli_body_dress(const tli_body *body, const tli_scalar *scalar, tli_dressed *dressed);
/* What is drawn of a value. */
double tli_shown(bool logarithmic, double factor, double value);
/* Length of element i; its own value where there is one component. */
double tli_length_at(const tl_channel *channel, size_t i);
/* Least and largest finite one of these, of a logarithmic scale above 0; both 1 (logarithmic) or 0,
 * and false, if there are none. */
bool tli_extremes(const tl_mesh *mesh, const tl_channel *channel, bool logarithmic,
                  double range[2]);
double tli_volume_at(const tl_mesh *mesh, size_t tet);
/* Says which channels there are. TL_ERR_ARG. */
tl_status tli_unknown_channel(tl_ctx *ctx, const tl_mesh *mesh, const char *name);

/* ---- sources: view_source.c ---- */

/* An open model, which its source shares with contents that read places of it when they are asked.
 */
typedef struct tli_book {
    tl_ctx *ctx;
    atomic_size_t uses;
    tl_store *store;
} tli_book;
tli_book *tli_book_use(tli_book *book);
/* The last one closes it. NULL is allowed. */
void tli_book_release(tli_book *book);

typedef struct tli_look {
    int64_t step;
    bool is_glance; /* a coarser one, for surveys */
    tli_body *body; /* of the context that asked for it first; NULL: not made */
    bool is_making; /* a thread is at it */
} tli_look;

struct tl_source {
    tl_ctx *ctx;
    tl_source_facts facts;
    char *name;
    tli_book *book;  /* NULL: a mesh */
    tl_store *store; /* the book's */
    tli_body *body;  /* of a mesh */
    tli_lock lock;   /* of looks */
    tli_bell made;   /* a look was, or failed; of a series a step was read */
    tli_look
        *looks; /* [look_count]; room for two of all steps and none, of a mesh for one; of a
                   series the steps that are kept, the one that was asked for last at the end */
    size_t look_count;
    tl_series series;  /* of files; empty: a model, or a mesh of memory */
    bool is_reading;   /* a step of it */
    tl_read_opts read; /* how they are read */
    size_t step_bytes; /* of the step that was read last; 0: ? */
};

/* A source of nothing yet. Gives *source, or NULL. */
tl_status tli_source_make(tl_ctx *ctx, const char *name, tl_source **source);
/* Says what there is of a mesh, of a series after its steps. */
tl_status tli_set_mesh_facts(tl_ctx *ctx, tl_source *source, const tli_body *body);
/* A step of a series, read unless it is kept. Gives *body, used. view_steps.c */
tl_status tli_steps_find(tl_ctx *ctx, tl_source *source, int64_t number, tli_body **body);
/* Number of the step that is wanted, -1: the own one, and its time; -1, NaN: there are none.
 * TL_ERR_ARG lists them. */
tl_status tli_source_step(tl_ctx *ctx, const tl_source *source, int64_t wanted, int64_t *step,
                          double *time);
/* The same of the step that a scene asks for. */
tl_status tli_scene_step(tl_ctx *ctx, const tl_source *source, const tl_scene *scene, int64_t *step,
                         double *time);
/* Whether a channel of the model is there at a step. */
bool tli_in_step(const tl_store_channel *channel, int64_t step);
/* The channel of a model on vertices; TL_NONE. */
uint32_t tli_source_channel(const tl_source *source, int64_t step, const char *name);
/* A coarse mesh of a model at a step, with all channels, or the mesh of a source, with spots, which
 * are shared with other views. Gives *body, used: one of the caller's own, that borrows them. */
tl_status tli_source_look(tl_ctx *ctx, tl_source *source, int64_t step, tli_body **body);
/* The same of a model with an eighth of the tets and spots. */
tl_status tli_source_glance(tl_ctx *ctx, tl_source *source, int64_t step, tli_body **body);
/* Patches of a cut, rising. Gives *numbers [*count] (tl_mem_free). */
tl_status tli_cut_list(tl_ctx *ctx, const tl_cut *cut, uint32_t **numbers, size_t *count);
/* The mesh of a cut as it is drawn. channels [channel_count] of the model. */
tl_status tli_source_mesh(tl_ctx *ctx, const tl_source *source, const tl_cut *cut,
                          const size_t *channels, size_t channel_count, double time,
                          tli_recipe recipe, tli_body **body);
/* The same of some of its patches [patch_count], rising. */
tl_status tli_book_mesh(tl_ctx *ctx, const tli_book *book, const uint32_t *patches,
                        size_t patch_count, const size_t *channels, size_t channel_count,
                        double time, tli_recipe recipe, tli_body **body);

/* ---- what a scene derives and chooses: view_derive.c ---- */

bool tli_derives(const tl_scene *scene);
bool tli_chooses(const tl_scene *scene);
/* Of the channels that are derived, of what chooses a part, and of both. */
tli_recipe tli_formula_recipe(tli_recipe recipe, const tl_scene *scene);
tli_recipe tli_choice_recipe(tli_recipe recipe, const tl_scene *scene);
tli_recipe tli_derive_recipe(tli_recipe recipe, const tl_scene *scene);
/* A body of its own that borrows all of another one, with the channels that a scene derives. Gives
 * *whole, used. */
tl_status tli_derive_channels(tl_ctx *ctx, const tl_scene *scene, tli_body *from, tli_body **whole);
/* The part of it that the scene asks for. Gives *part, used: itself where it asks for all.
 * TL_ERR_DATA where nothing is left. */
tl_status tli_choose(tl_ctx *ctx, const tl_scene *scene, tli_body *whole, tli_body **part);
/* Both. Gives *derived, used: from itself where nothing is asked for. */
tl_status tli_derive(tl_ctx *ctx, const tl_scene *scene, tli_body *from, tli_body **derived);

/* ---- paints: view_paint.c ---- */

typedef struct tli_paint {
    tl_ctx *ctx;
    atomic_size_t uses;
    tli_recipe recipe;
    tl_values values;
    char *channel, *title;
    double factor;
    tl_color_point *colors;       /* [values.color_count] of what is shown, */
    tl_opacity_point *opacities;  /* [values.opacity_count] */
    tl_color_point *value_colors; /* and of values */
    tl_opacity_point *value_opacities;
    tl_transfer *transfer;
} tli_paint;

tli_recipe tli_paint_recipe(const tli_body *whole, const tl_scene *scene, const char *channel);
/* From the values of a source's whole look at a step. Gives *paint, used once. TL_ERR_ARG:
 * tli_body_channel, and a transfer node that makes no sense. */
tl_status tli_paint_create(tl_ctx *ctx, tl_source *source, const tl_scene *scene, int64_t step,
                           tli_body *whole, const char *channel, tli_paint **paint);
tli_paint *tli_paint_use(tli_paint *paint);
void tli_paint_release(tli_paint *paint);
/* What values between these extremes are scaled by. */
double tli_factor(bool logarithmic, const double range[2]);
/* What is drawn for a value, and back. */
double tli_paint_shown(const tli_paint *paint, double value);
double tli_paint_value(const tli_paint *paint, double shown);

/* ---- what colours of a channel follow from: view_survey.c ---- */

enum { TLI_SURVEY_STEPS = 8 };
typedef struct tli_survey {
    tl_ctx *ctx;
    const tl_source *source;
    int64_t step;
    bool is_series;                     /* of a channel that changes with time: of some steps */
    tli_body *bodies[TLI_SURVEY_STEPS]; /* [count] used, with the channel; at least one */
    size_t count;
    tli_scalar joined; /* its spread alone */
} tli_survey;
/* Of a channel or expression: of the whole look at the step, or, where a model has it at several
 * ones, of glances at steps that stand evenly among these. */
tl_status tli_survey_begin(tl_ctx *ctx, tl_source *source, const tl_scene *scene, int64_t step,
                           tli_body *whole, const char *name, tli_survey *survey);
void tli_survey_end(tli_survey *survey);
/* Least and largest finite value, on a logarithmic scale above 0: those of the original, of a
 * series at any step, where the model says them. */
tl_status tli_survey_extremes(tl_ctx *ctx, const tli_survey *survey, const char *name,
                              bool logarithmic, double range[2]);
/* A scalar with the spread of all. *scalar lives as long as the survey. */
tl_status tli_survey_spread(tl_ctx *ctx, tli_survey *survey, const char *name, bool logarithmic,
                            double factor, const tli_scalar **scalar);

/* ---- how values are spread over the volume: view_spread.c ---- */

/* Spots of a look: a part of it of 0.002 has 131. */
enum { TLI_SPOTS = 1 << 16 };
/* Places the spots of a look; nothing if they are there. */
tl_status tli_body_spots(tl_ctx *ctx, tli_body *body, size_t count);
/* Takes the values of a scalar of the body at its spots; nothing if they are taken. */
tl_status tli_body_spread(tl_ctx *ctx, const tli_body *body, tli_scalar *scalar);
/* The values of all scalars [scalar_count] that have a spread as the spread of one. */
tl_status tli_spread_join(tl_ctx *ctx, tli_scalar *const *scalars, size_t scalar_count,
                          tli_scalar *joined);
/* The value that a part (0 to 1) of the volume is below; of a scalar with a spread, not empty. */
double tli_rank_value(const tli_scalar *scalar, double part);
/* Fills bins [bin_count] of the range with parts of the volume in it; returns the number of spots
 * that they come from. */
size_t tli_spread_bins(const tli_scalar *scalar, const double range[2], double *bins,
                       size_t bin_count);
/* Opacities of a first look over a range: the most frequent value is clear, the others are the more
 * opaque the farther from it they are. points [TLI_LOOK_POINTS]; returns their number. */
enum { TLI_LOOK_POINTS = 256 };
size_t tli_look_opacities(const tli_scalar *scalar, const double range[2],
                          tl_opacity_point *points);

/* ---- agendas: what a scene asks for, node by node: view_agenda.c ---- */

typedef struct tli_entry {
    tl_node node;
    tl_node_kind kind;
    tli_paint *own, *color; /* of the channel that it is made of, and that it shows; or NULL */
} tli_entry;

typedef struct tli_agenda {
    const tl_scene *scene;
    int64_t step; /* -1: there are none */
    double time;
    tli_body *whole;   /* the look with derived channels: colours come from it; and the part */
    tli_body *look;    /* that is chosen of it; both used by the agenda, as are the paints */
    tli_entry *things; /* [thing_count] visible ones, in their order */
    size_t thing_count;
    tli_paint **paints; /* [paint_count] each once: those with a transfer node first, in the order
                           of these */
    size_t paint_count;
    bool has_glass; /* something lies inside of the boundary */
    bool has_lines;
    bool by_patch; /* surfaces and planes of a model, made patch by patch, and what stands around
                      them (TLI_HULL), of a mesh of its own */
} tli_agenda;
/* Step and look alone; all of it. Released also after tli_agenda_begin failed. */
tl_status tli_agenda_begin(tl_ctx *ctx, tl_view *view, const tl_scene *scene, tli_agenda *agenda);
tl_status tli_agenda_create(tl_ctx *ctx, tl_view *view, const tl_scene *scene, tli_agenda *agenda);
void tli_agenda_release(tl_ctx *ctx, tli_agenda *agenda);
/* Adds the paint of a channel to an agenda that has begun. */
tl_status tli_agenda_paint(tl_ctx *ctx, tl_view *view, tli_agenda *agenda, const char *channel);
/* Those that colours are explained of: of the volume, of colours, of points. Gives bars [at most
 * paint_count], returns their number. view_build.c */
size_t tli_agenda_bars(const tli_agenda *agenda, const tl_values **bars);
/* Which things of a scene. */
typedef enum tli_share {
    TLI_ALL,
    TLI_CUTS, /* surfaces and planes */
    TLI_HULL  /* what stands around: boundary, edges, silhouettes */
} tli_share;
bool tli_shares(tli_share share, const tli_entry *thing);
/* Whether a boundary is glass: around other things, without colours. */
bool tli_is_glass(const tli_agenda *agenda, const tli_entry *thing);
/* Whether a thing of that share is of a paint's channel, or shows its colours. */
bool tli_is_used(const tli_agenda *agenda, tli_share share, const tli_paint *paint);
/* The value of a surface. */
double tli_surface_value(const tl_scene *scene, const tli_entry *thing);

/* ---- which values are visible: view_visible.c ---- */

/* What is seen of a model's channels: bins [channel_count][TL_BINS], zeros before. */
typedef struct tli_seen {
    float *opacity, *unseen;
} tli_seen;
/* Of some things. False: what is drawn depends on the channels in other ways, all of them count. */
bool tli_see(const tl_source *source, const tli_agenda *agenda, tli_share share,
             const tli_seen *seen);

/* ---- views ---- */

/* Polydata under a recipe: triangles, lines, points, or the two parts of lines that a box divides.
 */
typedef struct tli_shape {
    tl_ctx *ctx;
    atomic_size_t uses;
    tli_recipe recipe;
    tl_polydata *parts[2]; /* the second one may be NULL */
} tli_shape;

enum { TLI_RECENT_PAINTS = 8 };

/* Triangles of the patches of a cut, for one surface or plane: view_strips.c */
typedef struct tli_strip {
    tli_recipe recipe; /* of all but the cut */
    bool is_draft;     /* of cuts that limits made coarser; else of others */
    bool logarithmic;  /* of what is carried */
    double factor;
    tl_slices *slices;
} tli_strip;

struct tl_view {
    tl_ctx *ctx;
    tl_source *source;
    tl_cut *cut;
    tl_cut_state state;
    bool has_cut, has_view; /* it was moved; with a camera: */
    tl_camera camera;
    bool is_limited;  /* by limits to less than the scene asks for */
    bool is_draft;    /* the cut was asked for with limits */
    size_t *channels; /* [channel_count] of the model that the mesh has */
    size_t channel_count;
    tli_body *whole, *look; /* of the last agenda that began */
    tli_body *body;
    bool is_ahead; /* the cut has moved, and its mesh was not made */
    /* of the last build, used by the view */
    tli_paint **paints;
    size_t paint_count;
    tli_shape **shapes;
    size_t shape_count;
    tli_paint *recent[TLI_RECENT_PAINTS]; /* the last that were made; before a build, too */
    size_t recent_next;
    double cut_s, mesh_s;
    tli_strip **strips; /* [strip_count] that the next build can go on with */
    size_t strip_count;
    tl_view *hull; /* of what stands around surfaces, with a cut of its own; NULL: none yet */
};

/* Moves the cut; makes view->body of it. view_cut.c */
tl_status tli_view_move(tl_ctx *ctx, tl_view *view, const tl_scene *scene, int64_t step,
                        const tl_view_request *request, const tl_view_limits *limits);
tl_status tli_view_body(tl_ctx *ctx, tl_view *view, const tl_scene *scene, int64_t step,
                        double time);
/* Of the cut's patches, in any order. */
tli_recipe tli_cut_recipe(const tl_cut *cut, int64_t step);
/* tl_seeds_follow with the neighbours of the tets, where they are known. TL_ERR_ARG for a channel
 * that lines can't follow. view_seeds.c */
tl_status tli_flow_check(tl_ctx *ctx, const tl_channel *channel);
tl_status tli_seeds_follow(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                           const tl_channel *channel, const char *seeds, const tl_stream_opts *opts,
                           tl_polydata **lines, tl_stream_report *report);

/* ---- contents ---- */

typedef enum tli_thing_kind {
    TLI_THING_VOLUME,
    TLI_THING_TRIANGLES,
    TLI_THING_LINES,
    TLI_THING_POINTS,
    TLI_THING_SILHOUETTES /* lines of the edges for each camera */
} tli_thing_kind;

/* What a renderer gets; all of it lives as long as the content. */
typedef struct tli_thing {
    tli_thing_kind kind;
    tli_recipe recipe; /* of all that a renderer is given, but widths */
    const tl_polydata *polydata;
    tl_look look;
    tl_line_opts line;   /* pixels of the final picture */
    tl_point_opts point; /* likewise */
    double period;       /* mesh units from one dash or arrow to the next */
    double speed;        /* so many in a second; 0: they stand */
    const tl_volume *volume;
    const double *scalar;
    const tl_transfer *transfer;
    tl_volume_opts volume_opts;
} tli_thing;

/* The patches of a cut for one who asks what is at a place, of which a few are made meshes then:
 * view_places.c */
typedef struct tli_places tli_places;

struct tl_content {
    tl_ctx *ctx;
    tl_content_facts facts;
    tl_content_error *errors; /* [facts.error_count] of the first channels of the mesh */
    tli_outlook outlook;      /* of a model: what is promised from other cameras */
    tli_outlook hull_outlook; /* with places: of what stands around */
    tli_body *body;           /* of all things; with places of the hull's, or NULL */
    tli_places *places;       /* of surfaces made patch by patch; else NULL */
    tli_paint **paints;       /* [paint_count] */
    const tl_values **values; /* [paint_count] of them */
    size_t paint_count;
    const tl_values **bars; /* [bar_count] those that colours are explained of */
    size_t bar_count;
    tli_shape **shapes; /* [shape_count] */
    size_t shape_count;
    tl_transfer *marks[2]; /* colours of patches, of levels; or NULL */
    tli_thing *things;     /* [thing_count] in their order, those that do not change with camera and
                              time first */
    size_t thing_count;
};

/* What makes the things of a content. */
typedef struct tli_maker {
    tl_ctx *ctx;
    tl_view *view;
    const tli_agenda *agenda;
    tli_body *body; /* by_patch: of the hull, or NULL */
    tl_content *content;
    double diagonal;   /* of the source */
    bool by_patch;     /* surfaces and planes are made so */
    tli_recipe recipe; /* by_patch: of the cut */
} tli_maker;
/* Slices the patches of the cut for surfaces and planes [entry_count]; then the triangles of one of
 * them. Gives *triangles. view_strips.c */
tl_status tli_strips_update(tli_maker *maker, const tli_entry *const *entries, size_t entry_count);
tl_status tli_strip_join(const tli_maker *maker, const tli_entry *entry, tl_polydata **triangles);
/* Keeps what the agenda, which may be NULL, can go on with. */
void tli_strips_tidy(tl_view *view, const tli_agenda *agenda);
/* Memory that they take. */
uint64_t tli_strips_bytes(const tl_view *view);
/* Things of a node. view_things.c, view_marks.c, view_swarm.c */
tl_status tli_make_thing(tli_maker *maker, const tli_entry *entry);
/* Before those of maker->by_patch: what all surfaces and planes are made of that are not there. */
tl_status tli_make_strips(tli_maker *maker);
tl_status tli_make_marks(tli_maker *maker, const tli_entry *entry);
tl_status tli_make_points(tli_maker *maker, const tli_entry *entry);
tl_status tli_make_lines(tli_maker *maker, const tli_entry *entry);
/* Helpers of these. The colour of edges; a property of a node; a recipe to begin with: of the body
 * and a kind. */
extern const double tli_ink[3];
double tli_maker_real(const tli_maker *maker, const tli_entry *entry, const char *prop);
tli_recipe tli_maker_recipe(const tli_maker *maker, const tli_entry *entry);
/* The shape of a recipe, from the view or the content; NULL: it has to be made. */
const tli_shape *tli_maker_find(tli_maker *maker, tli_recipe recipe, tl_status *st);
/* Takes over parts, also on failure. */
tl_status tli_maker_keep(tli_maker *maker, tli_recipe recipe, tl_polydata *first,
                         tl_polydata *second, const tli_shape **shape);
tl_status tli_maker_add(tli_maker *maker, const tli_thing *thing);
/* The scalar of a paint on the vertices of the maker's body; linear: not its logarithm. */
tl_status tli_maker_scalar(tli_maker *maker, const tli_paint *paint, bool linear,
                           tli_scalar **scalar);
/* Lines of one colour without light; the recipe is left to the caller. */
tli_thing tli_flat_lines(const tl_polydata *lines, const double rgb[3], double width_px);
void tli_shape_release(tli_shape *shape);

#endif
