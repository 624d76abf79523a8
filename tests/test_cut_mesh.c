/* The mesh of a cut against the mesh its patches were made of, gradients across borders, and
 * patches loaded by several threads under a limit. */
#include "check.h"

#include <pthread.h>
#include <time.h>

#include "base/base.h"
#include "codec/codec.h"
#include "store/store.h"
#include "tetralod/cut.h"

#include "fail_alloc.h"
#include "make_pieces.h"

#define MODEL_PATH "cut_mesh.tlod"

enum { SCALAR, OWNER, CHANNELS }; /* a field on vertices, the piece on tets */
static const double STEP = 1e-4;

static double field(const int64_t place[3])
{
    return 1e-3 * (double)(2 * place[0] - 3 * place[1] + 5 * place[2]) + 0.25;
}

/* One level, whose patches are the pieces. */
static void fill_head(tl_store_head *head, tl_store_channel *channels, tl_store_level *level,
                      const pieces *p)
{
    static const double none[CHANNELS] = {0};
    channels[SCALAR] = (tl_store_channel){.name = "field",
                                          .unit = "m/s",
                                          .components = 1,
                                          .scalar = TL_F64,
                                          .code = {TL_VALUE_LATTICE, STEP},
                                          .range = {-3, 8},
                                          .codec_error = STEP / 2,
                                          .time = (double)NAN};
    channels[OWNER] = channels[SCALAR];
    channels[OWNER].name = "owner";
    channels[OWNER].on = TL_ON_TET;
    channels[OWNER].scalar = TL_I32;
    channels[OWNER].code = (tl_value_code){TL_VALUE_INTEGER, 1};
    *level = (tl_store_level){.tets = p->whole.tet_count,
                              .verts = p->whole.vert_count,
                              .patch_count = PIECES,
                              .max_error = none};
    *head = (tl_store_head){.lattice = {TL_PLACE_LATTICE, -10, {0, 0, 0}},
                            .patch_count = PIECES,
                            .root_patch_count = PIECES,
                            .input_tets = p->whole.tet_count,
                            .input_verts = p->whole.vert_count,
                            .time = (double)NAN,
                            .levels = level,
                            .level_count = 1,
                            .channels = channels,
                            .channel_count = CHANNELS};
    for (int k = 0; k < 3; k++) head->stats.bounds[2 * k + 1] = 1;
    head->stats.diagonal = sqrt(3);
}

static void write_piece(tl_ctx *ctx, const tl_store_channel *channels, tli_store_writer *w,
                        tl_patch *patch, uint32_t number)
{
    tl_status st = TL_OK;
    static const float ranges[2 * CHANNELS] = {-3, 8, 0, 9};
    static const double square_error[CHANNELS] = {0};
    tl_patch_info info = {.producer = TL_NONE,
                          .class_ = TL_CLASS_RAW,
                          .tet_count = patch->tet_count,
                          .vert_count = patch->vert_count,
                          .sphere = {0.5, 0.5, 0.5, 1},
                          .ranges = ranges,
                          .square_error = square_error};
    tli_bytes bytes[CHANNELS + 1];
    tli_blob blobs[CHANNELS + 1];
    int64_t *images = malloc((patch->vert_count + (size_t)patch->tet_count) * sizeof *images);
    if (!images) abort();
    for (int i = 0; i <= CHANNELS; i++) tli_bytes_open(ctx, &bytes[i]);
    CHECK_OK(ctx, tli_patch_arrange(ctx, patch, NULL, NULL));
    CHECK_OK(ctx, tli_topology_encode(ctx, NULL, TL_CLASS_RAW, patch, &bytes[CHANNELS], NULL));
    for (uint32_t v = 0; v < patch->vert_count; v++)
        images[v] = tl_value_image(&channels[SCALAR].code, field(patch->places[v]));
    CHECK_OK(ctx, tli_channel_encode(ctx, NULL, TL_CLASS_RAW, patch, SCALAR, TL_ON_VERTEX, 1,
                                     images, &bytes[SCALAR]));
    for (uint32_t t = 0; t < patch->tet_count; t++) images[t] = number;
    CHECK_OK(ctx, tli_channel_encode(ctx, NULL, TL_CLASS_RAW, patch, OWNER, TL_ON_TET, 1, images,
                                     &bytes[OWNER]));
    for (int i = 0; i <= CHANNELS; i++) blobs[i] = (tli_blob){bytes[i].bytes, bytes[i].count};
    st = tli_store_add_patch(w, &info, blobs[CHANNELS], blobs, NULL, 0);
    CHECK_OK(ctx, st);
    for (int i = 0; i <= CHANNELS; i++) tli_bytes_close(&bytes[i]);
    free(images);
}

/* tli_patch_arrange works on blocks of the context. */
static tl_patch *copy_patch(tl_ctx *ctx, const tl_patch *from)
{
    tl_status st = TL_OK;
    tl_patch *to = tl_mem_zalloc(ctx, 1, sizeof *to, &st);
    size_t places = from->vert_count * sizeof *to->places,
           tets = from->tet_count * sizeof *to->tets;
    CHECK_OK(ctx, st);
    to->vert_count = from->vert_count;
    to->tet_count = from->tet_count;
    to->places = tl_mem_alloc(ctx, places, 1, &st);
    to->shared = tl_mem_alloc(ctx, from->vert_count, 1, &st);
    to->tets = tl_mem_alloc(ctx, tets, 1, &st);
    CHECK_OK(ctx, st);
    memcpy(to->places, from->places, places);
    memcpy(to->shared, from->shared, from->vert_count);
    memcpy(to->tets, from->tets, tets);
    return to;
}

static void write_model(tl_ctx *ctx, const pieces *p)
{
    tl_store_channel channels[CHANNELS];
    tl_store_level level;
    tl_store_head head;
    tli_store_writer *w = NULL;
    fill_head(&head, channels, &level, p);
    CHECK_OK(ctx, tli_store_begin(ctx, MODEL_PATH, &head, (tli_blob){NULL, 0}, 0, &w));
    for (uint32_t i = 0; i < PIECES; i++) {
        tl_patch *copy = copy_patch(ctx, &p->list[i].patch);
        write_piece(ctx, channels, w, copy, i);
        tl_patch_destroy(ctx, copy);
    }
    CHECK_OK(ctx, tli_store_finish(w, &head, true));
}

static void test_welded(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    tl_store *store = NULL;
    tl_cut *cut = NULL;
    tl_mesh *mesh = NULL, *slim = NULL;
    pieces p;
    size_t boundary = 0, expected = 0, owners[PIECES] = {0};
    tl_lidx *faces = NULL;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    make_pieces(ctx, &p);
    write_model(ctx, &p);
    CHECK_OK(ctx, tl_store_open(ctx, MODEL_PATH, &store));
    CHECK_OK(ctx, tl_cut_create(ctx, store, &cut));
    CHECK_OK(ctx, tl_cut_mesh(cut, NULL, 0, &mesh));
    CHECK_EQ(tl_mesh_vert_count(mesh), p.whole.vert_count);
    CHECK_EQ(tl_mesh_tet_count(mesh), p.whole.tet_count);
    CHECK_OK(ctx, tl_mesh_check(ctx, mesh, TL_CHECK_FULL));
    for (size_t i = 0; i < 4 * p.whole.tet_count; i++) expected += p.opposite[i] == TL_NONE;
    CHECK_OK(ctx, tl_mesh_boundary(ctx, mesh, NULL, &faces, NULL, &boundary));
    CHECK_EQ(boundary, expected);
    const tl_channel *values = tl_mesh_channel_by_name(mesh, "field");
    const tl_channel *owner = tl_mesh_channel_by_name(mesh, "owner");
    CHECK(values && owner && !strcmp(values->unit, "m/s") && owner->on == TL_ON_TET);
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
        int64_t place[3];
        for (size_t k = 0; k < 3; k++)
            place[k] = (int64_t)llround(tl_mesh_xyz(mesh)[3 * v + k] * 1024);
        CHECK_NEAR(values->values[v], field(place), STEP / 2 * 1.0001);
    }
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) owners[(size_t)owner->values[t]]++;
    for (int i = 0; i < PIECES; i++) CHECK_EQ(owners[i], p.list[i].patch.tet_count);
    const size_t only = OWNER, none = CHANNELS;
    CHECK_OK(ctx, tl_cut_mesh(cut, &only, 1, &slim));
    CHECK_EQ(tl_mesh_channel_count(slim), 1);
    tl_mesh_destroy(slim);
    CHECK_STATUS(tl_cut_mesh(cut, &none, 1, &slim), TL_ERR_ARG);
    CHECK(!slim);
    tl_mem_free(ctx, faces);
    tl_mesh_destroy(mesh);
    tl_cut_destroy(cut);
    tl_store_close(store);
    drop_pieces(ctx, &p);
    tl_ctx_destroy(ctx);
    remove(MODEL_PATH);
}

static void test_gradients_agree(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    pieces p;
    const tl_lattice lattice = {TL_PLACE_LATTICE, -10, {0, 0, 0}};
    const tl_patch *patches[PIECES];
    double *values[PIECES], *gradients[PIECES];
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    make_pieces(ctx, &p);
    for (int i = 0; i < PIECES; i++) {
        patches[i] = &p.list[i].patch;
        values[i] = malloc(patches[i]->vert_count * sizeof(double));
        gradients[i] = malloc(patches[i]->vert_count * 3 * sizeof(double));
        if (!values[i] || !gradients[i]) abort();
        for (uint32_t v = 0; v < patches[i]->vert_count; v++)
            values[i][v] = field(patches[i]->places[v]) + (double)(patches[i]->places[v][0] % 3);
    }
    CHECK_OK(ctx, tl_patches_gradient(ctx, &lattice, patches, PIECES, (const double *const *)values,
                                      gradients));
    size_t pairs = 0;
    for (int i = 0; i < PIECES; i++)
        for (int j = 0; j < i; j++)
            for (uint32_t v = 0; v < patches[i]->vert_count; v++)
                for (uint32_t w = 0; w < patches[j]->vert_count; w++) {
                    if (memcmp(patches[i]->places[v], patches[j]->places[w], 24)) continue;
                    CHECK(!memcmp(gradients[i] + 3 * v, gradients[j] + 3 * w, 24));
                    pairs++;
                }
    CHECK(pairs > 100);
    for (int i = 0; i < PIECES; i++) { /* of a linear field it is exact */
        for (uint32_t v = 0; v < patches[i]->vert_count; v++)
            values[i][v] = field(patches[i]->places[v]);
    }
    CHECK_OK(ctx, tl_patches_gradient(ctx, &lattice, patches, PIECES, (const double *const *)values,
                                      gradients));
    for (int i = 0; i < PIECES; i++)
        for (uint32_t v = 0; v < patches[i]->vert_count; v++) {
            CHECK_NEAR(gradients[i][3 * v], 2 * 1.024, 1e-9);
            CHECK_NEAR(gradients[i][3 * v + 1], -3 * 1.024, 1e-9);
            CHECK_NEAR(gradients[i][3 * v + 2], 5 * 1.024, 1e-9);
        }
    for (int i = 0; i < PIECES; i++) {
        free(values[i]);
        free(gradients[i]);
    }
    drop_pieces(ctx, &p);
    tl_ctx_destroy(ctx);
}

typedef struct loading {
    tl_ctx *ctx;
    tl_residency *residency;
    const pieces *pieces;
} loading;

/* Workers load what is wanted, hold patches and look at them, many times. */
static tl_status load_and_look(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    loading *l = arg;
    tl_ctx *fork = NULL;
    tl_status st = tli_ctx_fork(l->ctx, &fork);
    uint64_t seed = begin + 1;
    for (size_t i = begin; !st && i < end; i++) {
        bool idle = false;
        uint32_t wanted[3];
        for (uint32_t k = 0; k < 3; k++)
            wanted[k] = ((uint32_t)(make_random(&seed) % 3) + 3 * k) % PIECES;
        st = tl_residency_want(fork, l->residency, wanted, 3);
        while (!st && !idle) st = tl_residency_load(fork, l->residency, &idle);
        const tl_resident *r = st ? NULL : tl_residency_get(l->residency, wanted[i % 3]);
        if (!r) continue;
        if (r->patch->tet_count != l->pieces->list[r->number].patch.tet_count ||
            r->values[OWNER][0] != r->number)
            st = tl_fail(fork, TL_ERR_DATA, "patch %u is not the one", r->number);
        tl_residency_release(l->residency, r);
    }
    return tli_ctx_join(l->ctx, fork, st);
}

static void test_residency(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    tl_store *store = NULL;
    pieces p;
    loading l = {0};
    size_t count;
    opts.thread_count = 4;
    CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
    make_pieces(ctx, &p);
    write_model(ctx, &p);
    CHECK_OK(ctx, tl_store_open(ctx, MODEL_PATH, &store));
    const uint64_t limit = 60000;
    CHECK_OK(ctx, tl_residency_create(ctx, store, limit, NULL, 0, &l.residency));
    l.ctx = ctx;
    l.pieces = &p;
    CHECK_OK(ctx, tli_parallel(ctx, 400, 10, load_and_look, &l));
    CHECK(tl_residency_bytes(l.residency, &count) <= limit);
    CHECK(count > 0 && count < PIECES);
    const uint32_t all[] = {0, 1, 2, 3, 4, 5, 6, 7, 8}, beyond = PIECES;
    const tl_resident *held[PIECES];
    bool idle = false;
    for (uint32_t i = 0; i < PIECES; i++) { /* what is held stays, whatever the limit */
        CHECK_OK(ctx, tl_residency_want(ctx, l.residency, all + i, 1));
        CHECK_OK(ctx, tl_residency_load(ctx, l.residency, &idle));
        held[i] = tl_residency_get(l.residency, i);
        CHECK(held[i]);
    }
    CHECK(tl_residency_bytes(l.residency, &count) > limit);
    CHECK_EQ(count, PIECES);
    for (uint32_t i = 0; i < PIECES; i++) tl_residency_release(l.residency, held[i]);
    CHECK(tl_residency_bytes(l.residency, &count) <= limit);
    CHECK(tl_residency_has(l.residency, PIECES - 1) && !tl_residency_has(l.residency, 0));
    CHECK_STATUS(tl_residency_want(ctx, l.residency, &beyond, 1), TL_ERR_ARG);
    tl_residency_destroy(l.residency);
    tl_store_close(store);
    drop_pieces(ctx, &p);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
    remove(MODEL_PATH);
}

typedef struct server {
    tl_ctx *ctx;
    tl_residency *residency;
    tl_status status;
} server;

static void *serve(void *arg)
{
    server *s = arg;
    s->status = tl_residency_serve(s->ctx, s->residency);
    return NULL;
}

/* Polls until a patch is there; a minute is more than any machine takes. */
static bool comes(tl_residency *r, uint32_t patch)
{
    for (int i = 0; i < 60000; i++) {
        if (tl_residency_has(r, patch)) return true;
        const struct timespec pause = {0, 1000000};
        nanosleep(&pause, NULL);
    }
    return false;
}

/* Threads that serve load what is wanted, what can't be read left out, until they are stopped. */
static void test_serving(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    tl_store *store = NULL;
    pieces p;
    pthread_t thread;
    server s = {0};
    uint64_t seed = 3;
    opts.thread_count = 3;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    CHECK_STATUS(tl_ctx_create(&opts, &s.ctx), TL_OK);
    make_pieces(ctx, &p);
    write_model(ctx, &p);
    for (int damaged = 0; damaged < 2; damaged++) {
        tl_patch_info info;
        CHECK_OK(ctx, tl_store_open(ctx, MODEL_PATH, &store));
        CHECK_OK(ctx, tl_store_patch(ctx, store, 4, &info));
        if (damaged) {
            FILE *file = fopen(MODEL_PATH, "r+b");
            CHECK(file && !fseek(file, (long)info.topology_ofs + 5, SEEK_SET));
            CHECK(fputc(0xee, file) == 0xee && !fclose(file));
        }
        CHECK_OK(ctx, tl_residency_create(ctx, store, 1 << 20, NULL, 0, &s.residency));
        CHECK_EQ(pthread_create(&thread, NULL, serve, &s), 0);
        for (int round = 0; round < 20; round++) {
            uint32_t wanted[4];
            for (uint32_t k = 0; k < 4; k++)
                wanted[k] = (uint32_t)(make_random(&seed) % 2) + 2 * k; /* 0 to 7 */
            CHECK_OK(ctx, tl_residency_want(ctx, s.residency, wanted, 4));
            for (int k = 0; k < 4; k++)
                if (!damaged || wanted[k] != 4) CHECK(comes(s.residency, wanted[k]));
            const tl_resident *r = tl_residency_get(s.residency, wanted[0]);
            CHECK(r && r->values[OWNER][0] == wanted[0]);
            tl_residency_release(s.residency, r);
        }
        tl_residency_stop(s.residency);
        CHECK_EQ(pthread_join(thread, NULL), 0);
        CHECK_STATUS(s.status, damaged ? TL_ERR_FORMAT : TL_OK);
        if (damaged) CHECK(strstr(tl_ctx_message(s.ctx), "while loading patch 4"));
        CHECK(!damaged || !tl_residency_has(s.residency, 4));
        tl_residency_destroy(s.residency);
        tl_store_close(store);
    }
    drop_pieces(ctx, &p);
    CHECK_EQ(tl_ctx_current_bytes(s.ctx), 0);
    tl_ctx_destroy(s.ctx);
    tl_ctx_destroy(ctx);
    remove(MODEL_PATH);
}

static tl_status open_and_weld(tl_ctx *ctx, void *arg)
{
    (void)arg;
    tl_store *store = NULL;
    tl_cut *cut = NULL;
    tl_mesh *mesh = NULL;
    tl_cut_query query = tl_cut_query_defaults();
    query.bounds.boundary = 1;
    tl_status st = tl_store_open(ctx, MODEL_PATH, &store);
    if (!st) st = tl_cut_create(ctx, store, &cut);
    if (!st) st = tl_cut_update(cut, &query);
    if (!st) st = tl_cut_mesh(cut, NULL, 0, &mesh);
    tl_mesh_destroy(mesh);
    tl_cut_destroy(cut);
    tl_store_close(store);
    return st;
}

static void test_failing_memory(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    fail_alloc f;
    pieces p;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    make_pieces(ctx, &p);
    write_model(ctx, &p);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, open_and_weld, NULL) > 50);
    fail_alloc_close(&f);
    drop_pieces(ctx, &p);
    tl_ctx_destroy(ctx);
    remove(MODEL_PATH);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_welded),         cmocka_unit_test(test_gradients_agree),
        cmocka_unit_test(test_residency),      cmocka_unit_test(test_serving),
        cmocka_unit_test(test_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
