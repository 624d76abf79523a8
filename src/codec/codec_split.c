/* Cutting a mesh into patches by planes through the medians of their tets' centroids. */
#include "codec/codec_split.h"
#include "mesh/mesh.h"

#include <math.h>
#include <string.h>

typedef struct splitter {
    tl_ctx *ctx;
    const tl_mesh *mesh;
    const tl_lattice *lattice;
    uint32_t patch_tets;
    uint32_t *tets;   /* [tet_count] in the order of the patches */
    float *centroids; /* [tet_count][3] */
    uint32_t *owner;  /* [vert_count] a patch that has it, or TL_NONE, or MANY */
    uint32_t *local;  /* [vert_count] its number in the patch at hand */
    tli_split *split;
} splitter;

#define MANY (TL_NONE - 1)

static float along(const splitter *s, size_t at, int axis)
{
    return s->centroids[3 * (size_t)s->tets[at] + (size_t)axis];
}

/* Orders tets [begin, end) so that the one at middle has no greater before it, no smaller behind.
 */
static void select_middle(splitter *s, size_t begin, size_t end, size_t middle, int axis)
{
    while (end - begin > 1) {
        float pivot = along(s, begin + (end - begin) / 2, axis);
        size_t low = begin, high = end - 1;
        while (low <= high) {
            while (along(s, low, axis) < pivot) low++;
            while (along(s, high, axis) > pivot) high--;
            if (low > high) break;
            uint32_t kept = s->tets[low];
            s->tets[low++] = s->tets[high];
            s->tets[high] = kept;
            if (high == 0) break;
            high--;
        }
        if (middle <= high && high < end - 1)
            end = high + 1;
        else if (middle >= low)
            begin = low;
        else
            return;
    }
}

static int longest_axis(const splitter *s, size_t begin, size_t end)
{
    float longest = -1;
    int axis = 0;
    for (int a = 0; a < 3; a++) {
        float low = along(s, begin, a), high = low;
        for (size_t i = begin; i < end; i++) {
            low = fminf(low, along(s, i, a));
            high = fmaxf(high, along(s, i, a));
        }
        if (high - low > longest) {
            longest = high - low;
            axis = a;
        }
    }
    return axis;
}

/* Fills a patch whose arrays have room, from tets [begin, end). */
static void fill_patch(splitter *s, size_t begin, tl_patch *patch, uint32_t *vert_old)
{
    for (uint32_t t = 0; t < patch->tet_count; t++) {
        size_t old = s->tets[begin + t];
        for (size_t c = 0; c < 4; c++) {
            uint32_t v = s->mesh->tets[4 * old + c];
            if (s->local[v] == TL_NONE) {
                vert_old[patch->vert_count] = v;
                s->local[v] = patch->vert_count++;
            }
            patch->tets[t][c] = (uint16_t)s->local[v];
        }
        if (patch->regions) patch->regions[t] = s->mesh->regions[old];
    }
    uint32_t id = (uint32_t)s->split->patch_count;
    for (uint32_t v = 0; v < patch->vert_count; v++) {
        uint32_t old = vert_old[v];
        s->local[old] = TL_NONE;
        s->owner[old] = s->owner[old] == TL_NONE ? id : MANY;
        tl_lattice_nearest(s->lattice, s->mesh->xyz + 3 * (size_t)old, patch->places[v]);
    }
}

static tl_status add_patch(splitter *s, size_t begin, size_t end)
{
    tl_status st = TL_OK;
    tli_split *split = s->split;
    uint32_t count = (uint32_t)(end - begin);
    size_t most = 4 * (size_t)count < s->mesh->vert_count ? 4 * (size_t)count : s->mesh->vert_count;
    tl_patch *patch = tl_mem_zalloc(s->ctx, 1, sizeof *patch, &st);
    uint32_t *vert_old = tl_mem_alloc(s->ctx, most, sizeof *vert_old, &st);
    uint32_t *tet_old = tl_mem_alloc(s->ctx, count, sizeof *tet_old, &st);
    if (!st) {
        patch->tets = tl_mem_alloc(s->ctx, count, sizeof *patch->tets, &st);
        patch->places = tl_mem_alloc(s->ctx, most, sizeof *patch->places, &st);
        patch->shared = tl_mem_zalloc(s->ctx, most, 1, &st);
        if (s->mesh->regions)
            patch->regions = tl_mem_alloc(s->ctx, count, sizeof *patch->regions, &st);
    }
    if (!st) {
        patch->tet_count = count;
        memcpy(tet_old, s->tets + begin, count * sizeof *tet_old);
        fill_patch(s, begin, patch, vert_old);
        split->patches[split->patch_count] = patch;
        split->vert_old[split->patch_count] = vert_old;
        split->tet_old[split->patch_count++] = tet_old;
        return TL_OK;
    }
    tl_patch_destroy(s->ctx, patch);
    tl_mem_free(s->ctx, vert_old);
    tl_mem_free(s->ctx, tet_old);
    return st;
}

static tl_status halve(splitter *s, size_t begin, size_t end)
{
    if (end - begin <= s->patch_tets) return add_patch(s, begin, end);
    size_t middle = begin + (end - begin) / 2;
    select_middle(s, begin, end, middle, longest_axis(s, begin, end));
    tl_status st = halve(s, begin, middle);
    return st ? st : halve(s, middle, end);
}

/* Flags of the vertices that several patches have, then the order of arrival. */
static tl_status finish_patch(splitter *s, size_t p)
{
    tl_status st = TL_OK;
    tl_patch *patch = s->split->patches[p];
    uint32_t *vert_old = s->split->vert_old[p], *tet_old = s->split->tet_old[p];
    uint32_t *vert_order = tl_mem_alloc(s->ctx, patch->vert_count, sizeof *vert_order, &st);
    uint32_t *tet_order = tl_mem_alloc(s->ctx, patch->tet_count, sizeof *tet_order, &st);
    for (uint32_t v = 0; v < patch->vert_count; v++)
        patch->shared[v] = s->owner[vert_old[v]] == MANY;
    if (!st) st = tli_patch_arrange(s->ctx, patch, vert_order, tet_order);
    if (!st) {
        for (uint32_t v = 0; v < patch->vert_count; v++) vert_order[v] = vert_old[vert_order[v]];
        for (uint32_t t = 0; t < patch->tet_count; t++) tet_order[t] = tet_old[tet_order[t]];
        memcpy(vert_old, vert_order, patch->vert_count * sizeof *vert_old);
        memcpy(tet_old, tet_order, patch->tet_count * sizeof *tet_old);
    }
    tl_mem_free(s->ctx, vert_order);
    tl_mem_free(s->ctx, tet_order);
    return st;
}

static tl_status open_splitter(splitter *s)
{
    tl_status st = TL_OK;
    size_t tet_count = s->mesh->tet_count, vert_count = s->mesh->vert_count;
    s->tets = tl_mem_alloc(s->ctx, tet_count, sizeof *s->tets, &st);
    s->centroids = tl_mem_alloc(s->ctx, tet_count, 3 * sizeof *s->centroids, &st);
    s->owner = tl_mem_alloc(s->ctx, vert_count, sizeof *s->owner, &st);
    s->local = tl_mem_alloc(s->ctx, vert_count, sizeof *s->local, &st);
    size_t room = 2 * tet_count / s->patch_tets + 2;
    s->split->patches = tl_mem_zalloc(s->ctx, room, sizeof *s->split->patches, &st);
    s->split->vert_old = tl_mem_zalloc(s->ctx, room, sizeof *s->split->vert_old, &st);
    s->split->tet_old = tl_mem_zalloc(s->ctx, room, sizeof *s->split->tet_old, &st);
    if (st) return st;
    for (size_t t = 0; t < tet_count; t++) {
        double p[4][3];
        tli_tet_corners(s->mesh->xyz, s->mesh->tets + 4 * t, p);
        s->tets[t] = (uint32_t)t;
        for (size_t a = 0; a < 3; a++) {
            float x = (float)((p[0][a] + p[1][a] + p[2][a] + p[3][a]) / 4);
            s->centroids[3 * t + a] = isnan(x) ? 0 : x;
        }
    }
    for (size_t v = 0; v < vert_count; v++) s->owner[v] = s->local[v] = TL_NONE;
    return TL_OK;
}

tl_status tli_split_open(tl_ctx *ctx, const tl_mesh *mesh, const tl_lattice *lattice,
                         uint32_t patch_tets, tli_split *split)
{
    splitter s = {
        .ctx = ctx, .mesh = mesh, .lattice = lattice, .patch_tets = patch_tets, .split = split};
    *split = (tli_split){0};
    tl_status st = open_splitter(&s);
    if (!st && mesh->tet_count) st = halve(&s, 0, mesh->tet_count);
    for (size_t p = 0; p < split->patch_count && !st; p++) st = finish_patch(&s, p);
    tl_mem_free(ctx, s.tets);
    tl_mem_free(ctx, s.centroids);
    tl_mem_free(ctx, s.owner);
    tl_mem_free(ctx, s.local);
    return st;
}

void tli_split_close(tl_ctx *ctx, tli_split *split)
{
    for (size_t p = 0; p < split->patch_count; p++) {
        tl_patch_destroy(ctx, split->patches[p]);
        tl_mem_free(ctx, split->vert_old[p]);
        tl_mem_free(ctx, split->tet_old[p]);
    }
    tl_mem_free(ctx, split->patches);
    tl_mem_free(ctx, split->vert_old);
    tl_mem_free(ctx, split->tet_old);
}
