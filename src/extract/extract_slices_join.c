/* One surface of the slices of all patches: the vertices at edges between shared vertices are
 * welded as the kernel welds those of its pieces, with shared vertices by their numbers; they come
 * first, then all others, patch after patch. */
#include <string.h>

#include "extract/extract_slices.h"

typedef struct join {
    tl_ctx *ctx;
    tli_slices_part *const *parts;
    size_t part_count;
    tli_cut_edges seams;
    uint32_t *numbers;   /* of the seams' edges */
    size_t *vert_starts; /* [part_count + 1] vertices of its own, in the whole */
    size_t *cell_starts; /* [part_count + 1] */
    double **values;     /* [channel_count] */
    tl_polydata *out;
} join;

/* True if other patches have the edge, too: both of its ends are shared. */
static bool is_seam(const tli_slices_part *part, const tli_rim_vert *v)
{
    return v->ends[0] < part->shared_count && v->ends[1] < part->shared_count;
}

static void list_seams(join *j, size_t i)
{
    const tli_slices_part *part = j->parts[i];
    size_t at = j->seams.starts[i];
    for (size_t r = 0; r < part->rim_count; r++) {
        const tli_rim_vert *v = &part->rim[r];
        if (!is_seam(part, v)) continue;
        uint64_t verts = tli_edge_key(part->keys[v->ends[0]], part->keys[v->ends[1]]);
        j->seams.edges[at++] = (tli_cut_edge){verts, v->level};
    }
    j->seams.counts[i] = at - j->seams.starts[i];
}

static tl_status weld_seams(join *j)
{
    tl_status st = TL_OK;
    size_t rims = 0;
    tli_cut_edge *unique = NULL;
    j->seams.piece_count = j->part_count;
    j->seams.starts = tl_mem_alloc(j->ctx, j->part_count + 1, sizeof *j->seams.starts, &st);
    j->seams.counts = tl_mem_alloc(j->ctx, j->part_count, sizeof *j->seams.counts, &st);
    for (size_t i = 0; !st && i < j->part_count; i++) {
        j->seams.starts[i] = rims;
        rims += j->parts[i]->rim_count;
    }
    if (st) return st;
    j->seams.starts[j->part_count] = rims;
    if (rims >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED, "a surface of %zu vertices at borders", rims);
    j->seams.edges = tl_mem_alloc(j->ctx, rims, sizeof *j->seams.edges, &st);
    j->numbers = tl_mem_alloc(j->ctx, rims, sizeof *j->numbers, &st);
    for (size_t i = 0; !st && i < j->part_count; i++) list_seams(j, i);
    if (!st) st = tli_weld_edges(j->ctx, &j->seams, j->numbers, &unique, &j->vert_starts[0]);
    tl_mem_free(j->ctx, unique);
    return st;
}

static tl_status make_arrays(join *j)
{
    tl_status st = TL_OK;
    tl_polydata *out = j->out;
    for (size_t i = 0; i < j->part_count; i++) {
        const tl_polydata *own = j->parts[i]->surface;
        j->vert_starts[i + 1] = j->vert_starts[i] + own->vert_count - j->seams.counts[i];
        j->cell_starts[i + 1] = j->cell_starts[i] + own->cell_count;
    }
    out->kind = TL_POLY_TRIANGLES;
    out->vert_count = j->vert_starts[j->part_count];
    out->cell_count = j->cell_starts[j->part_count];
    if (out->vert_count >= TL_NONE)
        return tl_fail(j->ctx, TL_ERR_UNSUPPORTED, "a surface of %zu vertices is too large",
                       out->vert_count);
    out->xyz = tl_mem_alloc(j->ctx, out->vert_count, 3 * sizeof *out->xyz, &st);
    out->corners = tl_mem_alloc(j->ctx, out->cell_count, 3 * sizeof *out->corners, &st);
    return st;
}

/* Channels and normals, as the first part has them. */
static tl_status make_fields(join *j, const tli_slices_job *job)
{
    tl_status st = TL_OK;
    tl_polydata *out = j->out;
    if (job->opts.normals)
        out->normals = tl_mem_alloc(j->ctx, out->vert_count, 3 * sizeof *out->normals, &st);
    j->values = tl_mem_zalloc(j->ctx, job->opts.channel_count, sizeof *j->values, &st);
    for (size_t c = 0; !st && c < job->opts.channel_count; c++) {
        tl_channel to = tli_slices_carried(job, c);
        double *values = tl_mem_alloc(j->ctx, out->vert_count, to.components * sizeof *values, &st);
        to.values = values;
        if (!st) st = tl_polydata_adopt_channel(j->ctx, out, &to);
        if (st) tl_mem_free(j->ctx, values);
        j->values[c] = values;
    }
    return st;
}

static void copy_vert(const join *j, const tl_polydata *from, size_t v, size_t to)
{
    memcpy(j->out->xyz + 3 * to, from->xyz + 3 * v, 3 * sizeof *from->xyz);
    if (from->normals)
        memcpy(j->out->normals + 3 * to, from->normals + 3 * v, 3 * sizeof *from->normals);
    for (size_t c = 0; c < from->channel_count; c++) {
        size_t n = from->channels[c].components;
        memcpy(j->values[c] + n * to, from->channels[c].values + n * v, n * sizeof(double));
    }
}

/* Vertices of a part, those at seams too if it is the first part that has them, and triangles. */
static tl_status copy_part(const join *j, size_t i)
{
    tl_status st = TL_OK;
    const tli_slices_part *part = j->parts[i];
    const tl_polydata *from = part->surface;
    size_t next = j->vert_starts[i], seam = j->seams.starts[i];
    tl_lidx *numbers = tl_mem_alloc(j->ctx, from->vert_count, sizeof *numbers, &st);
    if (st) return st;
    for (size_t v = 0; v < from->vert_count; v++) numbers[v] = TL_NONE;
    for (size_t r = 0; r < part->rim_count; r++)
        if (is_seam(part, &part->rim[r])) numbers[part->rim[r].vert] = j->numbers[seam++];
    for (size_t v = 0; v < from->vert_count; v++) {
        if (numbers[v] == TL_NONE) numbers[v] = (tl_lidx)next++;
        if (numbers[v] >= j->vert_starts[0]) copy_vert(j, from, v, numbers[v]);
    }
    for (size_t k = 0; k < 3 * from->cell_count; k++)
        j->out->corners[3 * j->cell_starts[i] + k] = numbers[from->corners[k]];
    tl_mem_free(j->ctx, numbers);
    return TL_OK;
}

static tl_status copy_parts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    tl_status st = TL_OK;
    for (size_t i = begin; !st && i < end; i++) st = copy_part(arg, i);
    return st;
}

/* Vertices that several parts have are the same in all, and would be written by several threads. */
static void copy_seams(const join *j)
{
    for (size_t i = 0; i < j->part_count; i++) {
        const tli_slices_part *part = j->parts[i];
        size_t seam = j->seams.starts[i];
        for (size_t r = 0; r < part->rim_count; r++)
            if (is_seam(part, &part->rim[r]))
                copy_vert(j, part->surface, part->rim[r].vert, j->numbers[seam++]);
    }
}

tl_status tli_slices_join(tl_ctx *ctx, const tli_slices_job *job, tli_slices_part *const *parts,
                          size_t part_count, tl_polydata **triangles)
{
    tl_status st = TL_OK;
    join j = {.ctx = ctx, .parts = parts, .part_count = part_count};
    *triangles = NULL;
    j.out = tl_mem_zalloc(ctx, 1, sizeof *j.out, &st);
    j.vert_starts = tl_mem_zalloc(ctx, part_count + 1, sizeof *j.vert_starts, &st);
    j.cell_starts = tl_mem_zalloc(ctx, part_count + 1, sizeof *j.cell_starts, &st);
    if (!st) st = weld_seams(&j);
    if (!st) st = make_arrays(&j);
    if (!st) st = make_fields(&j, job);
    if (!st) st = tli_parallel(ctx, part_count, 1, copy_parts, &j);
    if (!st) copy_seams(&j);
    void *blocks[] = {j.values,      j.cell_starts,  j.vert_starts, j.numbers,
                      j.seams.edges, j.seams.counts, j.seams.starts};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    if (st)
        tl_polydata_destroy(ctx, j.out);
    else
        *triangles = j.out;
    return st;
}
