/* Proving the invariants of a mesh. Each search runs on the pool and finds the first offender,
 * whatever the number of threads. */
#include <stdatomic.h>

#include "base/base_predicates.h"
#include "base/base_vec.h"
#include "mesh/mesh.h"
#include "mesh/mesh_faces.h"

/* Elements of a piece. */
#define PIECE 16384

typedef struct search search;
typedef bool (*offends_fn)(const search *s, size_t item);

struct search {
    const tl_mesh *mesh;
    const tl_lidx *opposite;
    offends_fn offends;
    atomic_size_t first; /* the first offender found so far, or SIZE_MAX */
};

static bool index_too_large(const search *s, size_t tet)
{
    const tl_lidx *v = s->mesh->tets + 4 * tet;
    size_t end = s->mesh->vert_count;
    return v[0] >= end || v[1] >= end || v[2] >= end || v[3] >= end;
}

static bool not_finite(const search *s, size_t vert)
{
    return !vec_is_finite(s->mesh->xyz + 3 * vert);
}

static bool vertex_twice(const search *s, size_t tet)
{
    const tl_lidx *v = s->mesh->tets + 4 * tet;
    return v[0] == v[1] || v[0] == v[2] || v[0] == v[3] || v[1] == v[2] || v[1] == v[3] ||
           v[2] == v[3];
}

/* Where faces have at most two tets: behind two faces of the tet stands the same one. */
static bool given_twice(const search *s, size_t tet)
{
    const tl_lidx *o = s->opposite + 4 * tet;
    for (int i = 0; i < 3; i++)
        for (int j = i + 1; j < 4; j++)
            if (o[i] != TL_NONE && o[j] != TL_NONE && o[i] / 4 == o[j] / 4) return true;
    return false;
}

static bool not_positive(const search *s, size_t tet)
{
    double p[4][3];
    tli_tet_corners(s->mesh->xyz, s->mesh->tets + 4 * tet, p);
    return tli_orient3d(p[0], p[1], p[2], p[3]) <= 0;
}

static tl_status search_piece(void *arg, size_t begin, size_t end, unsigned worker)
{
    search *s = arg;
    (void)worker;
    for (size_t item = begin;
         item < end && item < atomic_load_explicit(&s->first, memory_order_relaxed); item++) {
        if (!s->offends(s, item)) continue;
        size_t first = atomic_load(&s->first);
        while (item < first && !atomic_compare_exchange_weak(&s->first, &first, item)) {
        }
        break;
    }
    return TL_OK;
}

/* *first: the first of item_count items that offends, or SIZE_MAX. */
static tl_status find_first(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                            offends_fn offends, size_t item_count, size_t *first)
{
    search s = {.mesh = mesh, .opposite = opposite, .offends = offends};
    atomic_init(&s.first, SIZE_MAX);
    tl_status st = tli_parallel(ctx, item_count, PIECE, search_piece, &s);
    *first = atomic_load(&s.first);
    return st;
}

static tl_status check_arrays(tl_ctx *ctx, const tl_mesh *mesh)
{
    if (mesh->vert_count > TL_MESH_VERTS_MAX || mesh->tet_count > TL_MESH_TETS_MAX)
        return tl_fail(ctx, TL_ERR_DATA, "%zu vertices and %zu tets are more than a mesh holds",
                       mesh->vert_count, mesh->tet_count);
    for (size_t i = 0; i < mesh->channel_count; i++) {
        const tl_channel *c = &mesh->channels[i];
        size_t count = c->on == TL_ON_VERTEX ? mesh->vert_count : mesh->tet_count;
        if (!c->name || !c->unit || !c->components || (count && !c->values))
            return tl_fail(ctx, TL_ERR_DATA, "channel %zu '%s': no unit, components or values", i,
                           c->name ? c->name : "");
    }
    size_t first = SIZE_MAX;
    tl_status st = find_first(ctx, mesh, NULL, index_too_large, mesh->tet_count, &first);
    if (!st && first != SIZE_MAX)
        st = tl_fail(ctx, TL_ERR_DATA, "tet %zu has a vertex that is not below %zu", first,
                     mesh->vert_count);
    return st;
}

static tl_status check_places(tl_ctx *ctx, const tl_mesh *mesh)
{
    size_t first = SIZE_MAX;
    tl_status st = find_first(ctx, mesh, NULL, not_finite, mesh->vert_count, &first);
    if (!st && first != SIZE_MAX)
        st = tl_fail(ctx, TL_ERR_DATA, "vertex %zu at (%g, %g, %g) is not finite", first,
                     mesh->xyz[3 * first], mesh->xyz[3 * first + 1], mesh->xyz[3 * first + 2]);
    if (!st) st = find_first(ctx, mesh, NULL, vertex_twice, mesh->tet_count, &first);
    if (!st && first != SIZE_MAX)
        st = tl_fail(ctx, TL_ERR_DATA, "tet %zu has a vertex twice", first);
    return st;
}

static tl_status check_faces(tl_ctx *ctx, const tl_mesh *mesh)
{
    tl_lidx *opposite = NULL, face = TL_NONE;
    uint32_t *boundary = NULL;
    size_t nonmanifold = 0, first = SIZE_MAX;
    tl_status st = tl_mesh_adjacency(ctx, mesh, &opposite, &nonmanifold);
    if (!st && nonmanifold) {
        st = tli_faces_boundary_of(ctx, mesh->tets, mesh->tet_count, opposite, &boundary, NULL,
                                   &face);
        if (!st)
            st =
                tl_fail(ctx, TL_ERR_DATA, "face %u of tet %u has more than two tets (%zu faces do)",
                        face & 3, face / 4, nonmanifold);
    }
    if (!st) st = find_first(ctx, mesh, opposite, given_twice, mesh->tet_count, &first);
    if (!st && first != SIZE_MAX) st = tl_fail(ctx, TL_ERR_DATA, "tet %zu is there twice", first);
    tl_mem_free(ctx, boundary);
    tl_mem_free(ctx, opposite);
    return st;
}

static tl_status check_signs(tl_ctx *ctx, const tl_mesh *mesh)
{
    size_t first = SIZE_MAX;
    tl_status st = find_first(ctx, mesh, NULL, not_positive, mesh->tet_count, &first);
    if (!st && first != SIZE_MAX) {
        double p[4][3];
        tli_tet_corners(mesh->xyz, mesh->tets + 4 * first, p);
        bool is_flat = tli_orient3d(p[0], p[1], p[2], p[3]) == 0;
        st = tl_fail(ctx, TL_ERR_DATA, "tet %zu is %s", first, is_flat ? "flat" : "inverted");
    }
    return st;
}

tl_status tl_mesh_check(tl_ctx *ctx, const tl_mesh *mesh, tl_check_level level)
{
    tl_status st = check_arrays(ctx, mesh);
    if (st || level == TL_CHECK_FAST) return st;
    st = check_places(ctx, mesh);
    if (!st) st = check_faces(ctx, mesh);
    if (!st) st = check_signs(ctx, mesh);
    return st;
}
