/* Edges of a surface that comes in parts (the cache of Sondershaus 2007, 7.1). A part finds its
 * edges by sorting the sides of its triangles, once. Sides at its rim that have no partner in it
 * are sorted together with those of all other parts when the parts have changed; that is little, as
 * a part has far more edges than it has at its rim. Unlike the work's cache this one holds normals
 * by triangle, so that an edge takes 16 bytes, and looks at each triangle once a camera. */
#include "extract/extract_edges.h"

#include <math.h>
#include <string.h>

#include "base/base_sort.h"
#include "mesh/mesh.h"

enum { GRAIN = 4096 };

/* ---- parts ---- */

static void release_part(tl_ctx *ctx, tli_edge_part *p)
{
    tl_mem_free(ctx, p->rims);
    tl_mem_free(ctx, p->edges);
    tl_mem_free(ctx, p->normals);
    tl_mem_free(ctx, p->regions);
    tl_mem_free(ctx, p->triangles);
    tl_mem_free(ctx, p->shared);
    tl_mem_free(ctx, p->xyz);
}

static void *copy_of(tl_ctx *ctx, const void *from, size_t count, size_t bytes, tl_status *st)
{
    void *to = from || !count ? tl_mem_alloc(ctx, count, bytes, st) : NULL;
    if (!*st && from && count) memcpy(to, from, count * bytes);
    return to;
}

static tl_status copy_part(tl_ctx *ctx, const tl_edges_part *from, tli_edge_part *p)
{
    tl_status st = TL_OK;
    for (size_t i = 0; i < 3 * from->triangle_count; i++)
        if (from->triangles[i] >= from->vert_count)
            return tl_fail(ctx, TL_ERR_DATA, "triangle %zu: corner %zu is vertex %u of %zu", i / 3,
                           i % 3, from->triangles[i], from->vert_count);
    p->vert_count = from->vert_count;
    p->triangle_count = from->triangle_count;
    p->xyz = copy_of(ctx, from->xyz, p->vert_count, 3 * sizeof *p->xyz, &st);
    p->triangles = copy_of(ctx, from->triangles, p->triangle_count, 3 * sizeof *p->triangles, &st);
    if (from->shared) p->shared = copy_of(ctx, from->shared, p->vert_count, sizeof *p->shared, &st);
    if (from->regions)
        p->regions = copy_of(ctx, from->regions, p->triangle_count, sizeof *p->regions, &st);
    p->normals = tl_mem_alloc(ctx, p->triangle_count, sizeof *p->normals, &st);
    return st;
}

static tl_status set_normals(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const tli_edge_part *p = arg;
    for (size_t t = begin; t < end; t++)
        tli_triangle_normal(p->xyz, p->triangles + 3 * t, p->normals[t]);
    return TL_OK;
}

static bool is_rim(const tli_edge_part *p, uint64_t key, size_t side_count)
{
    return side_count == 1 && p->shared && p->shared[key >> 32] != TL_NONE &&
           p->shared[key & UINT32_MAX] != TL_NONE;
}

static tli_edge edge_of(const tli_edge_part *p, uint64_t key, const uint32_t *sides, size_t count)
{
    tli_edge e = {{(tl_lidx)(key >> 32), (tl_lidx)(key & UINT32_MAX)}, {TL_NONE, TL_NONE}};
    bool turned = count == 2 && p->triangles[sides[0]] == p->triangles[sides[1]];
    if (count > 2 || turned) return e;
    for (size_t i = 0; i < count; i++) e.sides[i] = sides[i] / 3;
    return e;
}

/* Edges of one vertex, which triangles that name it twice have, are none. */
static void make_edges(tli_edge_part *p, const uint64_t *keys, const uint32_t *sides)
{
    size_t count = 3 * p->triangle_count;
    for (size_t i = 0, end; i < count; i = end) {
        end = tli_same_keys(keys, i, count);
        if (keys[i] >> 32 == (keys[i] & UINT32_MAX)) continue;
        tli_edge e = edge_of(p, keys[i], sides + i, end - i);
        if (is_rim(p, keys[i], end - i))
            p->rims[p->rim_count++] = e;
        else
            p->edges[p->edge_count++] = e;
    }
}

static void count_edges(const tli_edge_part *p, const uint64_t *keys, size_t *edges, size_t *rims)
{
    size_t count = 3 * p->triangle_count;
    for (size_t i = 0, end; i < count; i = end) {
        end = tli_same_keys(keys, i, count);
        if (is_rim(p, keys[i], end - i))
            ++*rims;
        else
            ++*edges;
    }
}

static tl_status fill_part(tl_ctx *ctx, const tl_edges_part *from, tli_edge_part *p)
{
    uint64_t *keys = NULL;
    uint32_t *sides = NULL;
    size_t edges = 0, rims = 0;
    tl_status st = copy_part(ctx, from, p);
    if (!st) st = tli_parallel(ctx, p->triangle_count, GRAIN, set_normals, p);
    if (!st) st = tli_sort_sides(ctx, p->triangles, p->triangle_count, &keys, &sides);
    if (!st) count_edges(p, keys, &edges, &rims);
    p->edges = tl_mem_alloc(ctx, edges, sizeof *p->edges, &st);
    p->rims = tl_mem_alloc(ctx, rims, sizeof *p->rims, &st);
    if (!st) make_edges(p, keys, sides);
    tl_mem_free(ctx, sides);
    tl_mem_free(ctx, keys);
    return st;
}

/* ---- edges that parts share ---- */

static void forget_seams(tl_ctx *ctx, tl_edges *e)
{
    tl_mem_free(ctx, e->owners);
    tl_mem_free(ctx, e->first_triangles);
    tl_mem_free(ctx, e->first_verts);
    tl_mem_free(ctx, e->starts);
    tl_mem_free(ctx, e->sides);
    e->owners = NULL;
    e->first_triangles = e->first_verts = e->starts = NULL;
    e->sides = NULL;
    e->joined = false;
}

static tl_status count_parts(tl_ctx *ctx, tl_edges *e, size_t *rims)
{
    tl_status st = TL_OK;
    e->first_verts = tl_mem_zalloc(ctx, e->part_count + 1, sizeof *e->first_verts, &st);
    e->first_triangles = tl_mem_zalloc(ctx, e->part_count + 1, sizeof *e->first_triangles, &st);
    if (st) return st;
    e->owner_count = *rims = 0;
    for (size_t i = 0; i < e->part_count; i++) {
        const tli_edge_part *p = &e->parts[i];
        e->first_verts[i + 1] = e->first_verts[i] + p->vert_count;
        e->first_triangles[i + 1] = e->first_triangles[i] + p->triangle_count;
        *rims += p->rim_count;
        for (size_t v = 0; p->shared && v < p->vert_count; v++)
            if (p->shared[v] != TL_NONE && p->shared[v] >= e->owner_count)
                e->owner_count = (size_t)p->shared[v] + 1;
    }
    if (e->first_verts[e->part_count] >= TL_NONE || *rims >= TL_NONE)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "edges of %zu vertices in parts are too many",
                       e->first_verts[e->part_count]);
    return st;
}

static tl_status find_owners(tl_ctx *ctx, tl_edges *e)
{
    tl_status st = TL_OK;
    e->owners = tl_mem_alloc(ctx, e->owner_count, sizeof *e->owners, &st);
    if (st) return st;
    for (size_t i = e->part_count; i-- > 0;) {
        const tli_edge_part *p = &e->parts[i];
        for (size_t v = p->shared ? p->vert_count : 0; v-- > 0;)
            if (p->shared[v] != TL_NONE)
                e->owners[p->shared[v]] = (uint32_t)(e->first_verts[i] + v);
    }
    return st;
}

static tl_status sort_rims(tl_ctx *ctx, tl_edges *e, size_t rims)
{
    tl_status st = TL_OK;
    size_t next = 0;
    uint64_t *keys = tl_mem_alloc(ctx, rims, sizeof *keys, &st);
    uint32_t *order = tl_mem_alloc(ctx, rims, sizeof *order, &st);
    tli_seam_side *all = tl_mem_alloc(ctx, rims, sizeof *all, &st);
    e->sides = tl_mem_alloc(ctx, rims, sizeof *e->sides, &st);
    e->starts = tl_mem_alloc(ctx, rims + 1, sizeof *e->starts, &st);
    for (size_t i = 0; !st && i < e->part_count; i++)
        for (size_t r = 0; r < e->parts[i].rim_count; r++) {
            const tl_lidx *verts = e->parts[i].rims[r].verts;
            uint32_t a = e->parts[i].shared[verts[0]], b = e->parts[i].shared[verts[1]];
            keys[next] = tli_edge_key(a, b);
            all[next] = (tli_seam_side){(uint32_t)i, (uint32_t)r};
            order[next] = (uint32_t)next;
            next++;
        }
    if (!st) st = tli_sort_u64(ctx, keys, order, rims);
    e->seam_count = 0;
    for (size_t i = 0; !st && i < rims; i++) {
        e->sides[i] = all[order[i]];
        if (!i || keys[i] != keys[i - 1]) e->starts[e->seam_count++] = i;
    }
    if (!st) e->starts[e->seam_count] = rims;
    tl_mem_free(ctx, all);
    tl_mem_free(ctx, order);
    tl_mem_free(ctx, keys);
    return st;
}

tl_status tli_edges_join(tl_ctx *ctx, tl_edges *edges)
{
    if (edges->joined) return TL_OK;
    size_t rims;
    forget_seams(ctx, edges);
    tl_status st = count_parts(ctx, edges, &rims);
    if (!st) st = find_owners(ctx, edges);
    if (!st) st = sort_rims(ctx, edges, rims);
    if (st)
        forget_seams(ctx, edges);
    else
        edges->joined = true;
    return st;
}

/* ---- the object ---- */

tl_status tl_edges_create(tl_ctx *ctx, tl_edges **edges)
{
    tl_status st = TL_OK;
    *edges = tl_mem_zalloc(ctx, 1, sizeof **edges, &st);
    return st;
}

void tl_edges_destroy(tl_ctx *ctx, tl_edges *edges)
{
    if (!edges) return;
    forget_seams(ctx, edges);
    for (size_t i = 0; i < edges->part_count; i++) release_part(ctx, &edges->parts[i]);
    tl_mem_free(ctx, edges->parts);
    tl_mem_free(ctx, edges);
}

/* The place of the part with that number, or where it would stand. */
static size_t place_of(const tl_edges *edges, uint32_t number)
{
    size_t low = 0, high = edges->part_count;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (edges->parts[middle].number < number)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static bool is_there(const tl_edges *edges, size_t place, uint32_t number)
{
    return place < edges->part_count && edges->parts[place].number == number;
}

tl_status tl_edges_add(tl_ctx *ctx, tl_edges *edges, uint32_t number, const tl_edges_part *part)
{
    size_t place = place_of(edges, number);
    if (is_there(edges, place, number))
        return tl_fail(ctx, TL_ERR_ARG, "part %u of a surface is there already", number);
    tli_edge_part made = {.number = number};
    tl_status st = fill_part(ctx, part, &made);
    edges->parts =
        tl_mem_resize(ctx, edges->parts, edges->part_count + 1, sizeof *edges->parts, &st);
    if (st) {
        release_part(ctx, &made);
        return st;
    }
    memmove(edges->parts + place + 1, edges->parts + place,
            (edges->part_count++ - place) * sizeof *edges->parts);
    edges->parts[place] = made;
    edges->joined = false;
    return TL_OK;
}

tl_status tl_edges_remove(tl_ctx *ctx, tl_edges *edges, uint32_t number)
{
    size_t place = place_of(edges, number);
    if (!is_there(edges, place, number))
        return tl_fail(ctx, TL_ERR_ARG, "part %u of a surface is not there", number);
    release_part(ctx, &edges->parts[place]);
    memmove(edges->parts + place, edges->parts + place + 1,
            (--edges->part_count - place) * sizeof *edges->parts);
    edges->joined = false;
    return TL_OK;
}

/* Places of the vertices that triangles use, in the order in which they do; the triangles name them
 * then. Gives *xyz [*vert_count][3]. */
static tl_status take_used(tl_ctx *ctx, const tl_mesh *mesh, tl_lidx *triangles,
                           size_t triangle_count, double **xyz, size_t *vert_count)
{
    tl_status st = TL_OK;
    size_t count = 0, room = 3 * triangle_count;
    if (room > mesh->vert_count) room = mesh->vert_count;
    uint32_t *numbers = tl_mem_alloc(ctx, mesh->vert_count, sizeof *numbers, &st);
    double *to = tl_mem_alloc(ctx, room, 3 * sizeof *to, &st);
    if (!st && mesh->vert_count) memset(numbers, 0xff, mesh->vert_count * sizeof *numbers);
    for (size_t i = 0; !st && i < 3 * triangle_count; i++) {
        uint32_t *number = &numbers[triangles[i]];
        if (*number == TL_NONE) {
            memcpy(to + 3 * count, mesh->xyz + 3 * (size_t)triangles[i], 3 * sizeof *to);
            *number = (uint32_t)count++;
        }
        triangles[i] = *number;
    }
    tl_mem_free(ctx, numbers);
    *xyz = to;
    *vert_count = count;
    return st;
}

tl_status tl_edges_add_mesh(tl_ctx *ctx, tl_edges *edges, uint32_t number, const tl_mesh *mesh,
                            const tl_lidx *opposite)
{
    tl_lidx *triangles = NULL, *faces = NULL;
    int32_t *regions = NULL;
    double *xyz = NULL;
    tl_edges_part part = {.shared = NULL};
    size_t count = 0;
    tl_status st = tl_mesh_boundary(ctx, mesh, opposite, &triangles, &faces, &count);
    if (mesh->regions) regions = tl_mem_alloc(ctx, count, sizeof *regions, &st);
    for (size_t t = 0; !st && mesh->regions && t < count; t++)
        regions[t] = mesh->regions[faces[t] / 4];
    if (!st) st = take_used(ctx, mesh, triangles, count, &xyz, &part.vert_count);
    part.xyz = xyz;
    part.triangles = triangles;
    part.triangle_count = count;
    part.regions = regions;
    if (!st) st = tl_edges_add(ctx, edges, number, &part);
    tl_mem_free(ctx, xyz);
    tl_mem_free(ctx, regions);
    tl_mem_free(ctx, faces);
    tl_mem_free(ctx, triangles);
    return st;
}

/* Boundary faces of a patch as triangles [*count], with their regions if there are any. */
static void list_boundary(const tl_patch *patch, uint32_t number, const tl_seams *seams,
                          tl_lidx *triangles, int32_t *regions, size_t *count)
{
    uint32_t behind, face;
    *count = 0;
    for (uint32_t f = 0; f < 4 * patch->tet_count; f++) {
        const uint16_t *tet = patch->tets[f / 4];
        if (patch->opposite && patch->opposite[f / 4][f % 4] != TL_NONE) continue;
        if (tl_seams_behind(seams, number, f, &behind, &face)) continue;
        for (size_t k = 0; k < 3; k++) triangles[3 * *count + k] = tet[tli_tet_faces[f % 4][k]];
        if (patch->regions) regions[*count] = patch->regions[f / 4];
        ++*count;
    }
}

tl_status tl_edges_add_patch(tl_ctx *ctx, tl_edges *edges, uint32_t number,
                             const tl_lattice *lattice, const tl_patch *patch,
                             const tl_seams *seams)
{
    tl_status st = TL_OK;
    uint32_t number_end;
    size_t room = 4 * (size_t)patch->tet_count;
    tl_edges_part part = {.vert_count = patch->vert_count,
                          .shared = tl_seams_verts(seams, number, &number_end)};
    if (!part.shared) return tl_fail(ctx, TL_ERR_ARG, "patch %u is not among the seams", number);
    double *xyz = tl_mem_alloc(ctx, patch->vert_count, 3 * sizeof *xyz, &st);
    tl_lidx *triangles = tl_mem_alloc(ctx, room, 3 * sizeof *triangles, &st);
    int32_t *regions = patch->regions ? tl_mem_alloc(ctx, room, sizeof *regions, &st) : NULL;
    if (!st) {
        list_boundary(patch, number, seams, triangles, regions, &part.triangle_count);
        for (size_t v = 0; v < patch->vert_count; v++)
            tl_lattice_xyz(lattice, patch->places[v], xyz + 3 * v);
        part.xyz = xyz;
        part.triangles = triangles;
        part.regions = regions;
        st = tl_edges_add(ctx, edges, number, &part);
    }
    tl_mem_free(ctx, regions);
    tl_mem_free(ctx, triangles);
    tl_mem_free(ctx, xyz);
    return st;
}
