/* Stage model, internal: what a model is while it is being built. All bookkeeping is per patch and
 * segment; the meshes themselves and the carried originals lie in work files. */
#ifndef TETRALOD_SRC_MODEL_H
#define TETRALOD_SRC_MODEL_H

#include <string.h>

#include "base/base.h"
#include "formats/formats_feed.h"
#include "mesh/mesh.h"
#include "model/model_cells.h"
#include "model/model_depot.h"
#include "model/model_need.h"
#include "model/model_seams.h"
#include "model/model_tape.h"
#include "simplify/simplify_piece.h"
#include "tetralod/model.h"
#include "tetralod/segment.h"
#include "tetralod/store.h"

enum { TLI_BINS = TL_BINS };

/* A channel of the model. */
typedef struct tli_field {
    const char *name, *unit;
    const char *key; /* its name in meshes: steps of a series have one name */
    bool has_step, steers;
    uint32_t step;
    double time; /* of the step */
    uint32_t components;
    tl_on on;
    tl_scalar scalar;
    size_t first;        /* its first component among all on the same elements */
    size_t source_first; /* the same among those of the input */
    double range[2];     /* of the values, or of their norms */
    double width;        /* what errors are fractions of */
    double bound;        /* that the codec keeps, in the channel's unit */
    double moved;        /* what a vertex's move may change a value at its original place by */
    double scale;        /* values to cost units */
    tl_value_code code;  /* how values are stored */
    uint64_t nonfinite_count;
    double leaf_error; /* of the finest mesh as it is decoded, at the original vertices */
} tli_field;

/* What all patches and segments of a model have in common. */
typedef struct tli_plan {
    tl_ctx *ctx;
    tl_build_opts opts;
    tli_field *fields; /* [field_count] */
    size_t field_count;
    size_t vert_comps, tet_comps;               /* of all channels on vertices, on tets */
    size_t source_vert_comps, source_tet_comps; /* of the input */
    size_t vert_fields;                         /* channels on vertices */
    bool float32_places;                        /* of the input, all of them */
    size_t quadric_floats;                      /* of the channels that steer */
    bool has_regions;
    double bounds[6], diagonal;
    tl_lattice lattice;
    double position_error; /* largest move of a vertex, mesh units */
    double boundary_error;
    tl_simplify_channel *steering; /* [field_count] of those on vertices, for the pieces */
    double *steering_scales;
    size_t steering_count;
    size_t at_once;     /* segments in memory at the same time */
    uint64_t bin_bytes; /* of memory for a part of what is sorted in files */
} tli_plan;

/* Least and largest value (norm) in the tets around an original vertex, rounded outwards. */
typedef struct tli_star {
    float low, high;
} tli_star;
_Static_assert(sizeof(tli_star) == sizeof(double), "a star takes the room of a double");

/* A record of a carried original vertex or centroid: doubles x y z, [volume,] values ..., of a
 * vertex the stars of its channels, and the tet of its patch that holds it in the last one's bits.
 * Of a piece of the original boundary: three corners, and one that says nothing. */
enum { TLI_POINTS = 0, TLI_CELLS = 1, TLI_FACES = 2, TLI_KINDS = 3, TLI_FACE_DOUBLES = 10 };
static inline size_t tli_record_doubles(const tli_plan *plan, int kind)
{
    if (kind == TLI_FACES) return TLI_FACE_DOUBLES;
    return kind == TLI_POINTS ? 4 + plan->vert_comps + plan->vert_fields : 5 + plan->tet_comps;
}

/* The mesh of a patch while it is being built; arrays are parts of one block. */
typedef struct tli_bundle {
    uint32_t vert_count, tet_count;
    uint64_t *ids;      /* [vert_count] equal in all patches of a level that hold the vertex */
    double *xyz;        /* [vert_count][3], as decoded */
    double *values;     /* [vert_count][vert_comps], as decoded */
    double *tet_values; /* [tet_count][tet_comps], as decoded */
    float *quadrics;    /* [vert_count][quadric_floats]; those of all patches add up. Or NULL */
    tl_lidx *tets;      /* [tet_count][4] */
    int32_t *regions;   /* [tet_count] or NULL */
    float *surface;     /* [vert_count] distance from the original surfaces */
    int16_t *steps;     /* [vert_count] */
    uint8_t *shared;    /* [vert_count] other patches hold it, too */
    uint8_t *twins;     /* [vert_count] not 0: others lie at the same place, and it never moves */
    uint8_t *outer;     /* [tet_count] bit f: face f is boundary of the whole */
    void *block;
    size_t bytes;
} tli_bundle;
/* with_quadrics: not at the finest level, whose segments make them. */
tl_status tli_bundle_create(tl_ctx *ctx, const tli_plan *plan, uint32_t vert_count,
                            uint32_t tet_count, bool with_quadrics, tli_bundle *bundle);
void tli_bundle_release(tl_ctx *ctx, tli_bundle *bundle);

/* Carried records of a patch: where some of them lie in the work file. */
typedef struct tli_extent {
    uint64_t ofs, count;
} tli_extent;
typedef struct tli_extents {
    tli_extent *items;
    size_t count, capacity;
} tli_extents;

/* What is kept of a patch. */
typedef struct tli_patch_note {
    uint32_t level, producer, consumer; /* segments or TL_NONE */
    uint32_t vert_count, tet_count;
    uint64_t ofs; /* of its bundle */
    double box[6];
    uint64_t carried;
    double *squares; /* [field_count] sums of squared errors at the carried originals */
    double *ranges;  /* [field_count][2] */
    double spread;   /* how far what stands for the original boundary is from it, mesh units */
    tli_extents extents[TLI_KINDS];
    uint32_t cell;          /* that it was cut by, or TL_NONE */
    tli_sampling *sampling; /* where patches are cut by cells, until the next level's are known */
} tli_patch_note;

/* Errors of a segment's result against the originals. */
typedef struct tli_errors {
    double *max;  /* [field_count] */
    float *field; /* [field_count][TLI_BINS] */
    float *space; /* [field_count][TLI_BINS] */
    double surface;
} tli_errors;

typedef struct tli_segment_note {
    uint32_t level;
    uint32_t *inputs, *outputs; /* patches */
    uint32_t input_count, output_count;
    uint64_t input_tets, output_tets;
    double box[6];
    tli_errors errors;
} tli_segment_note;

typedef struct tli_model tli_model;
struct tli_model {
    tl_ctx *ctx;
    const tli_plan *plan;
    struct tli_work *work;
    tli_depot *meshes;        /* bundles of all levels */
    tli_depot *carried[2];    /* records: of this level and the next */
    tli_depot *seam_files[2]; /* likewise: vertices that patches share */
    tli_depot *tapes;
    tli_seams seams; /* of the last level */
    tli_patch_note *patches;
    size_t patch_count, patch_capacity;
    tli_segment_note *segments;
    size_t segment_count, segment_capacity;
    uint32_t level_count;
    uint64_t point_count, cell_count; /* originals of finite place */
    double leaf_surface;              /* how far leaves that stand for finer ones may be off */
    double finest_surface;            /* how far the finest boundary is from the original one */
};

/* ---- model_object.c ---- */
/* What hangs on a note. */
void tli_patch_note_release(tl_ctx *ctx, tli_patch_note *note);
void tli_segment_note_release(tl_ctx *ctx, tli_segment_note *note);
struct tli_work;
/* work is borrowed: depots lie in its folder, if it has one. */
tl_status tli_model_create(tl_ctx *ctx, const tli_plan *plan, struct tli_work *work,
                           tli_model **model);
void tli_model_destroy(tli_model *model);
/* Adds count patches (segments) with their arrays, zeroed; the numbers start at *first. */
tl_status tli_model_add_patches(tli_model *model, size_t count, size_t *first);
tl_status tli_model_add_segments(tli_model *model, size_t count, size_t *first);
tl_status tli_extents_add(tl_ctx *ctx, tli_extents *extents, uint64_t ofs, uint64_t count);
tl_status tli_errors_create(tl_ctx *ctx, const tli_plan *plan, tli_errors *errors);
void tli_errors_release(tl_ctx *ctx, tli_errors *errors);
/* The larger of both, each by itself. */
void tli_errors_join(const tli_plan *plan, const tli_errors *from, tli_errors *to);

/* ---- model_split.c ---- */
/* Cuts the tets [tet_count] into parts of about part_tets by planes through their centroids:
 * part [tet_count] receives numbers 0 .. *part_count - 1. */
tl_status tli_split(tl_ctx *ctx, const double *xyz, const tl_lidx *tets, size_t tet_count,
                    size_t part_tets, uint32_t *part, size_t *part_count);
/* The same within cells: cell_of [tet_count] is changed; slivers of cells go with a neighbour.
 * Gives *part_cells [*part_count]: the cell of each part. */
tl_status tli_split_cells(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                          uint32_t *cell_of, size_t part_tets, uint32_t *part, size_t *part_count,
                          uint32_t **part_cells);

/* ---- model_group.c ---- */
/* Groups the patches [first, end) of a level into segments of about segment_tets; gives
 * group_of [end - first], numbers along a Hilbert curve, and the vertices that lie in several of
 * them, which is released also after a failure. The seams are those of the level. */
tl_status tli_group(tli_model *model, uint32_t level, size_t first, size_t end, uint32_t *group_of,
                    size_t *group_count, tli_locked *locked);

/* ---- model_segment.c ---- */
/* What a level's segments share. */
typedef struct tli_level {
    tli_model *model;
    uint32_t level;
    size_t first_segment;
    tli_locked locked;
    double cost_max;
    double boundary_error; /* of this level's result, mesh units */
    double surface_before; /* largest error of the boundary at the level before, mesh units */
    double ratio;          /* of tets that are to be left, where no cost rules */
    tli_cells *cells;      /* that cut what is made, or NULL */
    bool parts_meet; /* parts of one cell, or all if there are no cells, are taken up together */
} tli_level;

/* The result of a segment, to be noted in the order of segments. */
typedef struct tli_product {
    tli_patch_note *patches; /* [patch_count]; producer is not set */
    size_t patch_count;
    tli_shared shared; /* patches count from 0; until they lie in the file of the seams */
    tli_seam seam;
    tli_errors errors;
    double box[6];
    uint64_t input_tets, output_tets;
} tli_product;

/* The mesh of a segment: its patches welded. */
typedef struct tli_weld {
    tl_mesh *mesh;
    uint64_t *ids;
    int16_t *steps;
    float *quadrics, *surface;
    uint8_t *outer;  /* [tet_count] bit f: face f is boundary of the whole */
    uint8_t *locked; /* other segments hold it, too, or others lie at its place */
    uint8_t *twins;
    float *shares;      /* 1 / segments that hold it; at the finest level alone */
    uint32_t *tet_base; /* [input_count] first tet of each patch */
} tli_weld;
tl_status tli_weld_create(tl_ctx *ctx, const tli_level *level, const tli_segment_note *segment,
                          tli_weld *weld);
void tli_weld_release(tl_ctx *ctx, tli_weld *weld);

/* What is simplified to see how the costs of a level lie. */
tl_status tli_segment_probe(tl_ctx *ctx, const tli_level *level, const tli_segment_note *segment,
                            double costs[TLI_CURVE_POINTS], size_t *tets);
tl_status tli_segment_process(tl_ctx *ctx, const tli_level *level, const tli_segment_note *segment,
                              tli_product *product);
void tli_product_release(tl_ctx *ctx, tli_product *product);

/* Writes the parts of a mesh as patches. values of mesh as decoded. ids, steps, quadrics, surface,
 * shared [vert_count]; shared gains what several parts hold. */
typedef struct tli_cut {
    const tl_mesh *mesh;
    const uint64_t *ids;
    const int16_t *steps;
    const float *quadrics, *surface;
    const uint8_t *twins;
    const uint8_t *outside; /* other segments hold it, too; NULL: none */
    const uint8_t *outer;   /* [tet_count] bit f: face f is boundary of the whole */
    const uint32_t *part;   /* [tet_count] */
    size_t part_count;
    tl_lidx *tet_local; /* [tet_count] receives the tet's number in its part */
} tli_cut;
tl_status tli_cut_write(tl_ctx *ctx, tli_model *model, const tli_cut *cut, tli_patch_note *notes,
                        tli_shared *shared);

/* ---- model_carry.c: the originals of a segment ---- */
typedef struct tli_carrier {
    tl_ctx *ctx;
    const tli_plan *plan;
    tl_mesh *mesh; /* the new one */
    const tl_lidx *opposite;
    tl_locator *locator; /* made when it is needed */
    tli_errors *errors;
    double (*frames)[12];           /* [tet_count] what weights are computed from; or NULL */
    struct tli_space_block *blocks; /* of model_space.c; or NULL */
} tli_carrier;
/* Makes the frames; tli_carrier_close. */
tl_status tli_carrier_open(tl_ctx *ctx, const tli_plan *plan, tl_mesh *mesh,
                           const tl_lidx *opposite, tli_errors *errors, tli_carrier *carrier);
void tli_carrier_close(tli_carrier *carrier);
/* The tet that holds x, or the nearest one; weights of the nearest point; distance to it. */
tl_status tli_carrier_locate(tli_carrier *carrier, const double x[3], tl_lidx hint, tl_lidx *tet,
                             double weights[4], double *distance);
/* The same by steps from the hint (TL_NONE: none); false where it is not found so. */
bool tli_carrier_near(const tli_carrier *carrier, const double x[3], tl_lidx hint, tl_lidx *tet,
                      double weights[4], double *distance);
/* The same with the locator, which must be there: tli_carrier_survey. */
tl_status tli_carrier_find(const tli_carrier *carrier, const double x[3], tl_lidx *tet,
                           double weights[4], double *distance);
tl_status tli_carrier_survey(tli_carrier *carrier);
/* The same in a tet that is known. */
void tli_carrier_weigh(const tli_carrier *carrier, const double x[3], tl_lidx tet,
                       double weights[4], double *distance);
/* Adds the errors of a record at its place; squares [field_count] gain. */
void tli_carrier_measure(tli_carrier *carrier, int kind, const double *record, tl_lidx tet,
                         const double weights[4], double distance, double *squares);

/* ---- model_fit.c: least squares over samples that are seen once ---- */
typedef struct tli_fit tli_fit;
tl_status tli_fit_create(tl_ctx *ctx, const tl_mesh *mesh, size_t components, tli_fit **fit);
void tli_fit_destroy(tli_fit *fit);
/* values [components] at the point with those weights in a tet; current ones from mesh_values
 * [vert_count][components]. */
void tli_fit_add(tli_fit *fit, tl_lidx tet, const double weights[4], const double *values,
                 const double *mesh_values);
/* Changes mesh_values but where fixed. */
void tli_fit_solve(tli_fit *fit, const uint8_t *fixed, double *mesh_values);

/* ---- model_write.c ---- */
/* What a file says of the input beside what the plan holds. */
typedef struct tli_input {
    tl_mesh_stats stats;
    double time;
    uint64_t tets, verts;
} tli_input;
/* Writes the file; *bytes receives its size. */
tl_status tli_model_write(const tli_model *model, const char *path, const tli_input *input,
                          uint64_t *bytes);

/* ---- model_build.c ---- */
void tli_model_saturate(tli_model *model);
/* The options with all defaults, and those of the segments that follow. */
tl_status tli_build_opts_take(tl_ctx *ctx, const tl_build_opts *given, tl_build_opts *opts,
                              tl_segment_opts *segment);

/* ---- model_prune.c ---- */
/* After saturation. Errors of leaves in plan follow. */
tl_status tli_model_prune(tli_model *model, tli_plan *plan);

/* ---- model_survey.c ---- */
typedef struct tli_channel_survey {
    double range[2];  /* of the values, or of their norms */
    double extent[2]; /* of all components */
    uint64_t nonfinite;
} tli_channel_survey;
/* What one pass over the input finds. */
typedef struct tli_survey {
    tli_channel_survey *channels; /* [channel_count] those of the segments */
    size_t channel_count;
    double bounds[6], volume;
    uint64_t inverted, degenerate;
    bool is_finite, is_float32; /* all places */
} tli_survey;
tl_status tli_survey_make(tl_ctx *ctx, const tl_segments *segments, tli_survey *survey);
void tli_survey_release(tl_ctx *ctx, tli_survey *survey);

/* ---- model_level.c ---- */
/* Makes all levels above the last one that is in the model, and notes
 * each of them in the work folder; *ended: the build was to stop behind the last one. */
tl_status tli_model_grow(tli_model *model, const tli_survey *survey, bool *ended);

/* ---- model_finest.c ---- */
/* Level 0. Sets the plan's lattice and the leaf errors. */
tl_status tli_model_begin(tli_model *model, tli_plan *plan, const tl_segments *segments);

/* ---- model_plan.c ---- */
tl_status tli_build_opts_check(tl_ctx *ctx, const tl_build_opts *opts);
tl_status tli_plan_create(tl_ctx *ctx, const tl_segments *segments, const tli_survey *survey,
                          const tl_build_opts *opts, tli_plan *plan);
/* Part of a level's tets that is to be left. */
double tli_plan_ratio(const tli_plan *plan, uint32_t level);
void tli_plan_release(tli_plan *plan);
/* What the build of a data set will need. */
tli_need tli_plan_need(const tl_build_opts *opts, const tl_segments *segments);
tli_need tli_plan_need_of_feed(const tl_build_opts *opts, const tli_feed *feed);
/* A value as it will be decoded. */
double tli_field_round(const tli_field *field, double value);
/* The bin of a value, or of a norm. */
static inline unsigned tli_field_bin(const tli_field *field, double value)
{
    return tl_bin_of(field->range, value);
}

/* ---- model_records.c: streams of records ---- */
/* Fills the record of a vertex of a segment, or of a tet's centroid, all but its last number. stars
 * [vert_count][vert_fields] for vertices. */
void tli_record_fill(const tli_plan *plan, const tl_segment *segment, int kind, size_t element,
                     const tli_star *stars, double *record);
/* Records of one input that lie behind each other, and what is found of them. */
typedef struct tli_record_window {
    uint32_t input;
    size_t count;
    double *records;      /* [count][doubles] */
    tl_lidx *tets;        /* [count] */
    double (*weights)[4]; /* [count] */
    double *sums;         /* [sum_count], 0 at first */
    double box[6];        /* of the places */
    size_t left;          /* records that take another look */
} tli_record_window;
/* What is done with a window: in the order of windows, by any thread in any order, by the latter
 * again where records are left (after look, once), in order again. NULL: nothing. */
typedef struct tli_pass {
    tl_status (*before)(void *user, tli_record_window *window);
    tl_status (*work)(void *user, tli_record_window *window, unsigned worker);
    tl_status (*look)(void *user);
    tl_status (*again)(void *user, tli_record_window *window, unsigned worker);
    tl_status (*after)(void *user, tli_record_window *window);
    void *user;
    size_t sum_count;
} tli_pass;
/* Reads the records of one kind of all inputs, in windows that do not depend on threads. */
tl_status tli_records_read(tl_ctx *ctx, const tli_model *model, tli_depot *from,
                           const tli_segment_note *segment, int kind, const tli_pass *pass);
static inline tl_lidx tli_record_tet(const double *record, size_t doubles)
{
    uint64_t bits;
    memcpy(&bits, record + doubles - 1, sizeof bits);
    return (tl_lidx)bits;
}
static inline void tli_record_set_tet(double *record, size_t doubles, tl_lidx tet)
{
    uint64_t bits = tet;
    memcpy(record + doubles - 1, &bits, sizeof bits);
}
/* Deals records to patches, through a buffer each. */
typedef struct tli_dealer {
    tl_ctx *ctx;
    tli_depot *to;
    tli_patch_note *notes; /* [count] */
    size_t count, doubles;
    int kind;
    double *rooms;  /* [count][DEALER_RECORDS][doubles] */
    size_t *filled; /* [count] */
} tli_dealer;
tl_status tli_dealer_open(tl_ctx *ctx, const tli_model *model, tli_depot *to, tli_patch_note *notes,
                          size_t count, int kind, tli_dealer *dealer);
tl_status tli_dealer_add(tli_dealer *dealer, size_t patch, const double *record, tl_lidx tet);
/* Writes what is left if status is fine; releases all. Returns the first failure. */
tl_status tli_dealer_close(tli_dealer *dealer, tl_status status);

#endif
