/* What a mesh is, in numbers. Sums are taken by pieces of a fixed length and added in their order,
 * so that they do not depend on threads; tets with a corner that is not finite count in the
 * topology only. */
#include <math.h>
#include <string.h>

#include "base/base_predicates.h"
#include "base/base_sort.h"
#include "base/base_vec.h"
#include "mesh/mesh.h"
#include "mesh/mesh_surface.h"

/* Tets of a piece. */
#define PIECE_TETS 16384
/* Digits of the search for a median. */
#define DIGIT_BITS 16
#define DIGIT_COUNT (1 << DIGIT_BITS)

/* ---- topology ---- */

static double triangle_area(const double *xyz, const tl_lidx *triangle)
{
    double a[3], b[3], normal[3];
    const double *p = xyz + 3 * (size_t)triangle[0];
    vec_sub(xyz + 3 * (size_t)triangle[1], p, a);
    vec_sub(xyz + 3 * (size_t)triangle[2], p, b);
    vec_cross(a, b, normal);
    return vec_length(normal) / 2;
}

static size_t count_interfaces(const tl_mesh *mesh, const tl_lidx *opposite)
{
    size_t count = 0;
    for (size_t face = 0; mesh->regions && face < 4 * mesh->tet_count; face++)
        if (opposite[face] != TL_NONE && opposite[face] > face)
            count += mesh->regions[face / 4] != mesh->regions[opposite[face] / 4];
    return count;
}

static tl_status measure_topology(tl_ctx *ctx, const tl_mesh *mesh, tl_mesh_stats *stats)
{
    tl_lidx *opposite = NULL, *triangles = NULL;
    tl_status st = tl_mesh_adjacency(ctx, mesh, &opposite, &stats->nonmanifold_faces);
    if (!st) st = tl_mesh_components(ctx, mesh, opposite, NULL, &stats->components);
    if (!st)
        st = tl_mesh_boundary(ctx, mesh, opposite, &triangles, NULL, &stats->boundary_triangles);
    if (!st) stats->interface_triangles = count_interfaces(mesh, opposite);
    tl_mem_free(ctx, opposite);
    for (size_t i = 0; i < stats->boundary_triangles && !st; i++) {
        double area = triangle_area(mesh->xyz, triangles + 3 * i);
        if (isfinite(area)) stats->boundary_area += area;
    }
    if (!st)
        st = tli_surface_nonmanifold(ctx, triangles, stats->boundary_triangles, mesh->vert_count,
                                     &stats->nonmanifold_edges, &stats->nonmanifold_verts);
    tl_mem_free(ctx, triangles);
    return st;
}

/* ---- vertices ---- */

/* Vertices marked in used that stand where an earlier one does. */
static tl_status count_duplicates(tl_ctx *ctx, const tl_mesh *mesh, const uint8_t *used,
                                  size_t used_count, size_t *duplicates)
{
    size_t slot_count = 16;
    while (slot_count < 2 * used_count) slot_count *= 2;
    tl_status st = TL_OK;
    tl_lidx *slots = tl_mem_alloc(ctx, slot_count, sizeof *slots, &st);
    if (st) return st;
    memset(slots, 0xff, slot_count * sizeof *slots); /* TL_NONE */
    for (size_t v = 0; v < mesh->vert_count; v++) {
        if (!used[v]) continue;
        const double *x = mesh->xyz + 3 * v;
        size_t i = (size_t)(vec_hash(x) * 0xd6e8feb86659fd93u >> 16) & (slot_count - 1);
        for (; slots[i] != TL_NONE; i = (i + 1) & (slot_count - 1)) {
            const double *y = mesh->xyz + 3 * (size_t)slots[i];
            if (x[0] == y[0] && x[1] == y[1] && x[2] == y[2]) break;
        }
        if (slots[i] == TL_NONE)
            slots[i] = (tl_lidx)v;
        else
            ++*duplicates;
    }
    tl_mem_free(ctx, slots);
    return TL_OK;
}

static void find_bounds(const tl_mesh *mesh, const uint8_t *used, tl_mesh_stats *stats)
{
    double *b = stats->bounds, square = 0;
    bool any = false;
    for (size_t v = 0; v < mesh->vert_count; v++) {
        if (!used[v]) continue;
        for (size_t k = 0; k < 3; k++) {
            double x = mesh->xyz[3 * v + k];
            if (!any || x < b[2 * k]) b[2 * k] = x;
            if (!any || x > b[2 * k + 1]) b[2 * k + 1] = x;
        }
        any = true;
    }
    for (int k = 0; k < 3; k++) square += (b[2 * k + 1] - b[2 * k]) * (b[2 * k + 1] - b[2 * k]);
    stats->diagonal = sqrt(square);
}

static tl_status measure_verts(tl_ctx *ctx, const tl_mesh *mesh, tl_mesh_stats *stats)
{
    tl_status st = TL_OK;
    uint8_t *used = tl_mem_zalloc(ctx, mesh->vert_count, sizeof *used, &st);
    if (st) return st;
    for (size_t i = 0; i < 4 * mesh->tet_count; i++) used[mesh->tets[i]] = 1;
    size_t used_count = 0;
    for (size_t v = 0; v < mesh->vert_count; v++) {
        const double *x = mesh->xyz + 3 * v;
        stats->unused_verts += !used[v];
        if (!used[v] || vec_is_finite(x)) {
            used_count += used[v];
            continue;
        }
        stats->nonfinite_verts++;
        used[v] = 0;
    }
    find_bounds(mesh, used, stats);
    st = count_duplicates(ctx, mesh, used, used_count, &stats->duplicate_verts);
    tl_mem_free(ctx, used);
    return st;
}

/* ---- tets ---- */

typedef struct piece_stats {
    double volume, quality_min;
    size_t inverted, degenerate, finite_count;
    bool has_angles;
    tli_angle smallest, largest;
} piece_stats;

typedef struct tet_job {
    const tl_mesh *mesh;
    piece_stats *pieces;
    double *qualities; /* [tet_count]; NaN where a corner is not finite */
} tet_job;

static void add_angles(piece_stats *to, tli_angle smallest, tli_angle largest)
{
    if (!to->has_angles || tli_angle_less(smallest, to->smallest)) to->smallest = smallest;
    if (!to->has_angles || tli_angle_less(to->largest, largest)) to->largest = largest;
    to->has_angles = true;
}

static tl_status measure_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    tet_job *job = arg;
    (void)worker;
    piece_stats s = {.quality_min = INFINITY};
    for (size_t t = begin; t < end; t++) {
        double p[4][3];
        tli_tet_shape shape;
        tli_tet_corners(job->mesh->xyz, job->mesh->tets + 4 * t, p);
        tli_tet_measure(TLI_CORNERS(p), &shape);
        job->qualities[t] = (double)NAN;
        if (!isfinite(shape.volume) || !isfinite(shape.quality)) continue;
        int sign = tli_orient3d(p[0], p[1], p[2], p[3]);
        s.inverted += sign < 0;
        s.degenerate += sign == 0;
        s.finite_count++;
        s.volume += shape.volume;
        job->qualities[t] = shape.quality;
        if (shape.quality < s.quality_min) s.quality_min = shape.quality;
        if (sign != 0) add_angles(&s, shape.smallest, shape.largest);
    }
    job->pieces[begin / PIECE_TETS] = s;
    return TL_OK;
}

static void add_pieces(const piece_stats *pieces, size_t piece_count, tl_mesh_stats *stats,
                       piece_stats *sum)
{
    for (size_t i = 0; i < piece_count; i++) {
        const piece_stats *s = &pieces[i];
        stats->volume += s->volume;
        stats->inverted += s->inverted;
        stats->degenerate += s->degenerate;
        sum->finite_count += s->finite_count;
        if (s->quality_min < sum->quality_min) sum->quality_min = s->quality_min;
        if (s->has_angles) add_angles(sum, s->smallest, s->largest);
    }
    stats->quality_min = sum->finite_count ? sum->quality_min : 0;
    if (!sum->has_angles) return;
    stats->dihedral_min = atan2(sum->smallest.sine, sum->smallest.cosine);
    stats->dihedral_max = atan2(sum->largest.sine, sum->largest.cosine);
}

/* The value of that rank among those that are not NaN, digit by digit from above. counts
 * [DIGIT_COUNT] is scratch. */
static double select_rank(const double *values, size_t value_count, size_t rank, size_t *counts)
{
    uint64_t prefix = 0;
    for (int shift = 64 - DIGIT_BITS; shift >= 0; shift -= DIGIT_BITS) {
        memset(counts, 0, DIGIT_COUNT * sizeof *counts);
        for (size_t i = 0; i < value_count; i++) {
            uint64_t bits = tli_sort_key(values[i]);
            bool is_in = shift + DIGIT_BITS == 64 || bits >> (shift + DIGIT_BITS) == prefix;
            if (is_in && !isnan(values[i])) counts[bits >> shift & (DIGIT_COUNT - 1)]++;
        }
        uint64_t digit = 0;
        for (; counts[digit] <= rank; digit++) rank -= counts[digit];
        prefix = prefix << DIGIT_BITS | digit;
    }
    return tli_sort_value(prefix);
}

static tl_status measure_tets(tl_ctx *ctx, const tl_mesh *mesh, tl_mesh_stats *stats)
{
    size_t piece_count = (mesh->tet_count + PIECE_TETS - 1) / PIECE_TETS;
    tet_job job = {.mesh = mesh};
    piece_stats sum = {.quality_min = INFINITY};
    tl_status st = TL_OK;
    job.pieces = tl_mem_zalloc(ctx, piece_count, sizeof *job.pieces, &st);
    job.qualities = tl_mem_alloc(ctx, mesh->tet_count, sizeof *job.qualities, &st);
    size_t *counts = tl_mem_alloc(ctx, DIGIT_COUNT, sizeof *counts, &st);
    if (!st) st = tli_parallel(ctx, mesh->tet_count, PIECE_TETS, measure_piece, &job);
    if (!st) add_pieces(job.pieces, piece_count, stats, &sum);
    if (!st && sum.finite_count) {
        size_t middle = sum.finite_count / 2;
        double upper = select_rank(job.qualities, mesh->tet_count, middle, counts), lower = upper;
        if (sum.finite_count % 2 == 0)
            lower = select_rank(job.qualities, mesh->tet_count, middle - 1, counts);
        stats->quality_median = lower / 2 + upper / 2;
    }
    tl_mem_free(ctx, counts);
    tl_mem_free(ctx, job.qualities);
    tl_mem_free(ctx, job.pieces);
    return st;
}

tl_status tl_mesh_measure(tl_ctx *ctx, const tl_mesh *mesh, tl_mesh_stats *stats)
{
    tl_mesh_stats made = {0};
    tl_status st = measure_topology(ctx, mesh, &made);
    if (!st) st = measure_verts(ctx, mesh, &made);
    if (!st) st = measure_tets(ctx, mesh, &made);
    if (!st) *stats = made;
    return st;
}
