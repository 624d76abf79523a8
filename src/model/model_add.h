/* Stage model, internal: further channels for a model that exists. Its patches and segments stand
 * in a tli_model, whose plan has the new channels alone; meshes are read from the file when they
 * are needed. */
#ifndef TETRALOD_SRC_MODEL_ADD_H
#define TETRALOD_SRC_MODEL_ADD_H

#include "model/model.h"
#include "store/store.h"

typedef struct tli_adder {
    tl_ctx *ctx;
    const tl_store *store;
    const tl_store_head *head;
    const tl_segments *segments; /* of the data set with the channels */
    tli_plan *plan;
    tli_model *model; /* segments in reverse: the finest level first. ofs of a patch: its values
                         among the meshes, [vert_count][vert_comps], then [tet_count][tet_comps] */
    uint32_t *finest; /* [finest_count] patches of level 0 */
    uint32_t finest_count;
    tli_bins matches;    /* tli_match, by rank */
    tli_bins cells;      /* tli_cell_match, by rank; of channels on tets */
    double *leaf_errors; /* [finest_count][field_count] */
    double *radii;       /* [segment_count] of the model: of the spheres, as needed now */
} tli_adder;

/* An original vertex of a vertex of a patch; the new values follow, then their stars. */
typedef struct tli_match {
    uint32_t local, carries; /* carries: it is measured by way of this patch */
    double xyz[3];
    double values[];
} tli_match;
static inline size_t tli_match_bytes(const tli_plan *plan)
{
    return sizeof(tli_match) + (plan->vert_comps + plan->vert_fields) * sizeof(double);
}

/* Those of a patch. */
typedef struct tli_matches {
    uint8_t *records; /* [count] tli_match */
    size_t count;
    uint32_t *nearest; /* [vert_count] of the patch: the match of each vertex that is nearest */
} tli_matches;
/* TL_ERR_DATA where none of a vertex is as near as rounding allows. To be released also after a
 * failure. model_add_match.c */
tl_status tli_matches_read(tl_ctx *ctx, const tli_adder *a, uint32_t rank, const tl_patch *patch,
                           tli_matches *matches);
void tli_matches_release(tl_ctx *ctx, tli_matches *matches);
static inline const tli_match *tli_match_at(const tli_plan *plan, const tli_matches *m, size_t i)
{
    return (const tli_match *)(const void *)(m->records + i * tli_match_bytes(plan));
}

/* The original of a tet of a patch: its record (TLI_CELLS). */
typedef struct tli_cell_match {
    uint64_t local;
    double record[];
} tli_cell_match;
static inline size_t tli_cell_match_bytes(const tli_plan *plan)
{
    return sizeof(tli_cell_match) + tli_record_doubles(plan, TLI_CELLS) * sizeof(double);
}

/* Number of a segment of the file among those of the model, and back. */
static inline uint32_t tli_adder_segment(const tli_adder *a, uint32_t segment)
{
    return segment == TL_NONE ? TL_NONE : a->head->segment_count - 1 - segment;
}

/* A patch as it is decoded, with the identities of its vertices. */
typedef struct tli_added_patch {
    tl_patch *patch;
    uint64_t *ids; /* [vert_count] equal where patches share a vertex */
} tli_added_patch;
tl_status tli_added_patch_load(tl_ctx *ctx, const tli_adder *a, uint32_t patch,
                               tli_added_patch *out);
void tli_added_patch_release(tl_ctx *ctx, tli_added_patch *patch);
/* The mesh of vertices and tets (taken over) with room for the new channels. */
tl_status tli_added_mesh(tl_ctx *ctx, const tli_plan *plan, double *xyz, size_t vert_count,
                         tl_lidx *tets, size_t tet_count, tl_mesh **mesh);
/* Doubles of the rows of a mesh: [vert_count][vert_comps], then [tet_count][tet_comps]. */
static inline size_t tli_row_doubles(const tli_plan *plan, size_t vert_count, size_t tet_count)
{
    return vert_count * plan->vert_comps + tet_count * plan->tet_comps;
}
/* Where those of a field are. */
typedef struct tli_rows {
    size_t first, stride, count;
} tli_rows;
static inline tli_rows tli_rows_of(const tli_plan *plan, size_t field, size_t vert_count,
                                   size_t tet_count)
{
    const tli_field *f = &plan->fields[field];
    if (f->on == TL_ON_VERTEX) return (tli_rows){f->first, plan->vert_comps, vert_count};
    return (tli_rows){vert_count * plan->vert_comps + f->first, plan->tet_comps, tet_count};
}
/* Rows as they will be decoded, but for vertices that are fixed [vert_count] (NULL: none). */
void tli_added_round(const tli_plan *plan, const uint8_t *fixed, size_t vert_count,
                     size_t tet_count, double *rows);
/* The rows into the channels of a mesh. */
void tli_added_values(const tli_plan *plan, const double *rows, tl_mesh *mesh);
/* Writes the rows of a patch and notes their ranges. */
tl_status tli_added_put(tl_ctx *ctx, tli_adder *a, uint32_t patch, const tl_patch *topology,
                        const double *rows);

/* Finds the original of every vertex of the finest level. TL_ERR_DATA if there is one without, or
 * an original that is no vertex: another mesh. model_add_match.c */
tl_status tli_adder_match(tli_adder *a);
/* The same of tets, after that, if channels are on them; of vertices at one place, too.
 * model_add_cells.c */
tl_status tli_adder_match_cells(tli_adder *a);
/* Values of the finest level, originals on board. model_add_finest.c */
tl_status tli_adder_begin(tli_adder *a);
/* Values on the tets of a mesh, from the originals that lie in them. */
typedef struct tli_means {
    tl_ctx *ctx;
    const tli_plan *plan;
    const tl_mesh *mesh;
    double *rows;           /* [tet_count][tet_comps] that are made; borrowed */
    double *sums, *volumes; /* the same */
    double *nearest;        /* [tet_count] squared distance of the nearest original */
} tli_means;
/* To be closed also after a failure. model_add_means.c */
tl_status tli_means_open(tl_ctx *ctx, const tli_plan *plan, const tl_mesh *mesh, double *rows,
                         tli_means *means);
void tli_means_close(tli_means *means);
/* A record (TLI_CELLS) that lies in a tet. */
void tli_means_add(tli_means *means, tl_lidx tet, const double *record);
/* Makes the rows; spare [tet_comps] where no original is near. */
void tli_means_set(tli_means *means, const tl_lidx *opposite, const double *spare);
/* Values and errors of the levels above. model_add_level.c */
tl_status tli_adder_grow(tli_adder *a);
/* The file with the new channels beside the old ones. model_add_write.c */
tl_status tli_adder_write(tli_adder *a, const char *path, uint64_t *bytes);

#endif
