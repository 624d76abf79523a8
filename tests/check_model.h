/* Models for tests: built into a file of the folder of the test, opened, and a whole level of it as
 * one mesh, welded by place and twin. */
#ifndef TETRALOD_TESTS_CHECK_MODEL_H
#define TETRALOD_TESTS_CHECK_MODEL_H

#include <unistd.h>

#include "tetralod/model.h"
#include "tetralod/store.h"

#include "make_mesh.h"

/* Options that give several levels of a small mesh. */
static inline tl_build_opts check_model_opts(uint32_t segment_tets, uint32_t patch_tets)
{
    tl_build_opts opts = tl_build_opts_defaults();
    opts.segment_tets = segment_tets;
    opts.patch_tets = patch_tets;
    return opts;
}

/* Where a model of this process lies. */
static inline const char *check_model_path(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "/tmp/test_model_%ld_%s.tlod", (long)getpid(), name);
    return path;
}

/* A vertex of a level while it is welded. */
typedef struct check_model_vert {
    int64_t place[3];
    uint8_t twin, shared;
    uint32_t patch, local;
    tl_lidx number;
} check_model_vert;

static inline int check_model_by_place(const void *a, const void *b)
{
    const check_model_vert *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->place[k] != y->place[k]) return x->place[k] < y->place[k] ? -1 : 1;
    if (x->twin != y->twin) return (int)x->twin - (int)y->twin;
    return (int)x->shared - (int)y->shared;
}

/* The mesh of a level with its channels. A vertex that is not shared is itself alone; values of
 * shared ones must agree. */
static inline tl_mesh *check_model_level(tl_ctx *ctx, const tl_store *store, uint32_t level)
{
    const tl_store_head *head = tl_store_get_head(store);
    make_mesh m = make_room((size_t)head->levels[level].tets, (size_t)head->levels[level].tets);
    check_model_vert *verts = NULL;
    size_t vert_count = 0, tet_count = 0;
    tl_patch **patches = calloc(head->patch_count, sizeof *patches);
    for (uint32_t p = 0; p < head->patch_count; p++) {
        tl_patch_info info;
        CHECK_OK(ctx, tl_store_patch(ctx, store, p, &info));
        if (info.level != level) continue;
        CHECK_OK(ctx, tl_store_topology(ctx, store, p, &patches[p]));
        verts = realloc(verts, (vert_count + info.vert_count) * sizeof *verts);
        for (uint32_t v = 0; v < info.vert_count; v++) {
            check_model_vert *to = &verts[vert_count++];
            memcpy(to->place, patches[p]->places[v], sizeof to->place);
            to->twin = patches[p]->twins ? patches[p]->twins[v] : 0;
            to->shared = patches[p]->shared[v];
            to->patch = p;
            to->local = v;
        }
    }
    qsort(verts, vert_count, sizeof *verts, check_model_by_place);
    size_t n = 0;
    free(m.xyz);
    m.xyz = malloc((vert_count + 1) * 3 * sizeof *m.xyz);
    double **values = calloc(head->channel_count + 1, sizeof *values);
    for (uint32_t c = 0; c < head->channel_count; c++) {
        size_t rows = head->channels[c].on == TL_ON_TET ? m.tet_count : vert_count;
        values[c] = malloc((rows + 1) * head->channels[c].components * sizeof **values);
    }
    for (size_t i = 0; i < vert_count; i++) {
        bool same = i && verts[i].shared && verts[i - 1].shared &&
                    check_model_by_place(&verts[i], &verts[i - 1]) == 0;
        if (!same) tl_lattice_xyz(&head->lattice, verts[i].place, m.xyz + 3 * n++);
        verts[i].number = (tl_lidx)(n - 1);
    }
    m.vert_count = n;
    tl_lidx **numbers = calloc(head->patch_count, sizeof *numbers);
    for (size_t i = 0; i < vert_count; i++) {
        uint32_t p = verts[i].patch;
        if (!numbers[p]) numbers[p] = malloc(patches[p]->vert_count * sizeof **numbers);
        numbers[p][verts[i].local] = verts[i].number;
    }
    bool *known = calloc(n + 1, 1);
    for (uint32_t p = 0; p < head->patch_count; p++) {
        if (!patches[p]) continue;
        for (uint32_t t = 0; t < patches[p]->tet_count; t++, tet_count++)
            for (int i = 0; i < 4; i++)
                m.tets[4 * tet_count + (size_t)i] = numbers[p][patches[p]->tets[t][i]];
        for (uint32_t c = 0; c < head->channel_count; c++) {
            const uint32_t k = head->channels[c].components;
            if (head->channels[c].on == TL_ON_TET) {
                double *to = values[c] + (tet_count - patches[p]->tet_count) * k;
                CHECK_OK(ctx, tl_store_channel_values(ctx, store, p, patches[p], c, to));
                continue;
            }
            double *own = malloc(patches[p]->vert_count * k * sizeof *own);
            CHECK_OK(ctx, tl_store_channel_values(ctx, store, p, patches[p], c, own));
            for (uint32_t v = 0; v < patches[p]->vert_count; v++)
                for (uint32_t j = 0; j < k; j++) {
                    double *to = &values[c][numbers[p][v] * k + j];
                    if (known[numbers[p][v]])
                        CHECK(*to == own[v * k + j] || (isnan(*to) && isnan(own[v * k + j])));
                    *to = own[v * k + j];
                }
            free(own);
        }
        for (uint32_t v = 0; v < patches[p]->vert_count; v++) known[numbers[p][v]] = true;
    }
    m.tet_count = tet_count;
    tl_mesh *mesh = make_object(ctx, &m, NULL);
    for (uint32_t c = 0; c < head->channel_count; c++) {
        const tl_store_channel *from = &head->channels[c];
        tl_channel channel = {from->name, from->unit, from->components,
                              from->on,   TL_F64,     values[c]};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        free(values[c]);
    }
    for (uint32_t p = 0; p < head->patch_count; p++) {
        free(numbers[p]);
        tl_patch_destroy(ctx, patches[p]);
    }
    free(known);
    free(numbers);
    free(values);
    free(verts);
    free(patches);
    make_release(&m);
    return mesh;
}

#endif
