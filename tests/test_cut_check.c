/* Random cuts of a good model are proved, the same on any number of threads; of models in which one
 * vertex was moved, or has another value, so that levels fit in themselves but not to each other,
 * what is wrong is found. */
#include "codec/codec.h"
#include "store/store.h"
#include "tetralod/cut.h"

#include "check_model.h"
#include "fail_alloc.h"

#define CUTS 300u

typedef enum damage { NONE, MOVE_LEVEL, VALUE_LEVEL, VALUE_ONE, TURN_OVER } damage;

static double bumps(const double x[3])
{
    return sin(5 * x[0]) * cos(4 * x[1]) + x[2] * x[2];
}

typedef struct fixture {
    tl_ctx *ctx;
    tl_store *store;
    const tl_store_head *head;
} fixture;

static void open_model(fixture *f, const char *path)
{
    CHECK_OK(f->ctx, tl_store_open(f->ctx, path, &f->store));
    f->head = tl_store_get_head(f->store);
}

static void build_model(fixture *f, const char *path, int size)
{
    tl_build_result result;
    tl_build_opts opts = check_model_opts(1000, 200);
    tl_ctx_opts ctx_opts = tl_ctx_opts_defaults();
    ctx_opts.thread_count = 2;
    CHECK_STATUS(tl_ctx_create(&ctx_opts, &f->ctx), TL_OK);
    make_mesh m = make_grid(size);
    tl_mesh *mesh = make_object(f->ctx, &m, bumps);
    CHECK_OK(f->ctx, tl_model_build_mesh(f->ctx, mesh, path, &opts, &result));
    tl_build_release(f->ctx, &result);
    tl_mesh_destroy(mesh);
    make_release(&m);
    open_model(f, path);
    CHECK(f->head->level_count > 2);
}

static void close_model(fixture *f, const char *path)
{
    tl_store_close(f->store);
    CHECK_EQ(tl_ctx_current_bytes(f->ctx), 0);
    tl_ctx_destroy(f->ctx);
    CHECK_EQ(remove(path), 0);
}

/* ---- damage ---- */

static tl_patch *decode(const fixture *f, uint32_t id, tl_patch_info *info)
{
    tl_patch *patch;
    CHECK_OK(f->ctx, tl_store_patch(f->ctx, f->store, id, info));
    CHECK_OK(f->ctx, tl_store_topology(f->ctx, f->store, id, &patch));
    return patch;
}

static bool has_place(const fixture *f, uint32_t level, const int64_t place[3])
{
    bool found = false;
    for (uint32_t id = 0; !found && id < f->head->patch_count; id++) {
        tl_patch_info info;
        tl_patch *patch = decode(f, id, &info);
        for (uint32_t v = 0; v < patch->vert_count; v++)
            found = found || (info.level == level && patch->shared[v] &&
                              !memcmp(patch->places[v], place, 3 * sizeof *place));
        tl_patch_destroy(f->ctx, patch);
    }
    return found;
}

/* A vertex of level 1: for most damages one at a border that level 0 has, too; else an inner one.
 * *id: a patch that has it. */
static void choose_vertex(const fixture *f, damage kind, int64_t place[3], uint32_t *id)
{
    for (*id = 0; *id < f->head->patch_count; ++*id) {
        tl_patch_info info;
        bool found = false;
        tl_patch *patch = decode(f, *id, &info);
        for (uint32_t v = 0; !found && v < patch->vert_count; v++) {
            if (info.level != 1 || patch->shared[v] == (kind == TURN_OVER)) continue;
            memcpy(place, patch->places[v], 3 * sizeof *place);
            found = kind == TURN_OVER || has_place(f, 0, place);
        }
        tl_patch_destroy(f->ctx, patch);
        if (found) return;
    }
    fail_msg("no vertex to damage");
}

/* The damage to vertex v of a patch of level 1. */
static void change(damage kind, tl_patch *patch, uint32_t v, int64_t *images)
{
    if (kind == MOVE_LEVEL) patch->places[v][1] += 1;
    if (kind == VALUE_LEVEL || kind == VALUE_ONE) images[v] += 1;
    if (kind != TURN_OVER) return;
    uint32_t farthest = 0;
    double most = 0;
    for (uint32_t w = 0; w < patch->vert_count; w++) {
        double square = 0;
        for (int k = 0; k < 3; k++)
            square += pow((double)(patch->places[w][k] - patch->places[v][k]), 2);
        if (square > most) farthest = w;
        most = fmax(most, square);
    }
    memcpy(patch->places[v], patch->places[farthest], sizeof patch->places[v]);
}

/* Writes a patch of the model anew, with the damage if it has the vertex at place. */
static void copy_patch(const fixture *f, tli_store_writer *w, uint32_t id, damage kind,
                       const int64_t place[3], uint32_t chosen)
{
    tl_patch_info info;
    tli_bytes bytes[2];
    tli_blob blobs[2];
    tl_patch *patch = decode(f, id, &info);
    int64_t *images = malloc(patch->vert_count * sizeof *images);
    CHECK_OK(f->ctx, tl_store_channel_images(f->ctx, f->store, id, patch, 0, images));
    for (uint32_t v = 0; v < patch->vert_count; v++) {
        if (info.level != 1 || memcmp(patch->places[v], place, sizeof patch->places[v]) != 0)
            continue;
        if (id == chosen || kind == MOVE_LEVEL || kind == VALUE_LEVEL) {
            change(kind, patch, v, images);
            break;
        }
    }
    info.class_ = TL_CLASS_RAW;
    for (int i = 0; i < 2; i++) tli_bytes_open(f->ctx, &bytes[i]);
    CHECK_OK(f->ctx, tli_topology_encode(f->ctx, NULL, TL_CLASS_RAW, patch, &bytes[0], NULL));
    CHECK_OK(f->ctx, tli_channel_encode(f->ctx, NULL, TL_CLASS_RAW, patch, 0, TL_ON_VERTEX, 1,
                                        images, &bytes[1]));
    for (int i = 0; i < 2; i++) blobs[i] = (tli_blob){bytes[i].bytes, bytes[i].count};
    CHECK_OK(f->ctx, tli_store_add_patch(w, &info, blobs[0], &blobs[1], NULL, 0));
    for (int i = 0; i < 2; i++) tli_bytes_close(&bytes[i]);
    tl_patch_destroy(f->ctx, patch);
    free(images);
}

static void write_damaged(const fixture *f, damage kind, const char *path)
{
    tli_store_writer *w = NULL;
    int64_t place[3] = {0};
    uint32_t chosen = TL_NONE, patch = 0;
    if (kind != NONE) choose_vertex(f, kind, place, &chosen);
    CHECK_OK(f->ctx,
             tli_store_begin(f->ctx, path, f->head, tli_store_codec_bytes(f->store), 0, &w));
    for (; patch < f->head->root_patch_count; patch++) copy_patch(f, w, patch, kind, place, chosen);
    for (uint32_t s = 0; s < f->head->segment_count; s++) {
        tl_segment_info info;
        CHECK_OK(f->ctx, tl_store_segment(f->ctx, f->store, s, &info));
        for (; patch < info.first_patch + info.patch_count; patch++)
            copy_patch(f, w, patch, kind, place, chosen);
        CHECK_OK(f->ctx, tli_store_add_segment(w, &info));
    }
    CHECK_OK(f->ctx, tli_store_finish(w, f->head, true));
}

/* ---- tests ---- */

static tl_cut_check_opts many_cuts(uint32_t meshes)
{
    tl_cut_check_opts opts = tl_cut_check_opts_defaults();
    opts.cuts = CUTS;
    opts.meshes = meshes;
    return opts;
}

static void test_damage_is_found(void **state)
{
    (void)state;
    const char *const words[] = {NULL, "does not fit to what is drawn around it",
                                 "does not fit to what is drawn around it", "different values",
                                 " inverted and "};
    fixture f;
    build_model(&f, "cut_check.tlod", 12);
    for (damage kind = NONE; kind <= TURN_OVER; kind++) {
        tl_cut_check_result found;
        tl_cut_check_opts opts = many_cuts(0);
        fixture d = {.ctx = f.ctx};
        write_damaged(&f, kind, "cut_check_damaged.tlod");
        open_model(&d, "cut_check_damaged.tlod");
        tl_status st = tl_cut_check(d.ctx, d.store, NULL, &opts, &found);
        CHECK_STATUS(st, kind == NONE ? TL_OK : TL_ERR_DATA);
        if (kind == NONE)
            CHECK_EQ(found.cuts_tried, CUTS);
        else {
            printf("%s\n", tl_ctx_message(d.ctx));
            CHECK(strstr(tl_ctx_message(d.ctx), words[kind]));
            CHECK(!found.cuts_tried && !found.channels);
        }
        tl_cut_check_release(d.ctx, &found);
        tl_store_close(d.store);
        CHECK_EQ(remove("cut_check_damaged.tlod"), 0);
    }
    close_model(&f, "cut_check.tlod");
}

static void test_any_number_of_threads(void **state)
{
    (void)state;
    fixture f;
    double volume_off[3];
    build_model(&f, "cut_check_threads.tlod", 12);
    for (unsigned threads = 1; threads <= 3; threads++) {
        tl_ctx_opts ctx_opts = tl_ctx_opts_defaults();
        tl_cut_check_opts opts = many_cuts(UINT32_MAX);
        tl_cut_check_result found;
        fixture own;
        ctx_opts.thread_count = threads;
        CHECK_STATUS(tl_ctx_create(&ctx_opts, &own.ctx), TL_OK);
        open_model(&own, "cut_check_threads.tlod");
        CHECK_OK(own.ctx, tl_cut_check(own.ctx, own.store, NULL, &opts, &found));
        CHECK_EQ(found.cuts_tried, CUTS);
        CHECK_EQ(found.meshes_made, 12);
        CHECK(found.volume_off < 0.005);
        volume_off[threads - 1] = found.volume_off;
        CHECK(found.volume_off == volume_off[0]);
        tl_cut_check_release(own.ctx, &found);
        tl_store_close(own.store);
        CHECK_EQ(tl_ctx_current_bytes(own.ctx), 0);
        tl_ctx_destroy(own.ctx);
    }
    close_model(&f, "cut_check_threads.tlod");
}

static tl_status open_and_check(tl_ctx *ctx, void *arg)
{
    tl_store *store = NULL;
    tl_cut_check_result found = {0};
    tl_cut_check_opts opts = tl_cut_check_opts_defaults();
    opts.cuts = 3;
    opts.meshes = 1;
    tl_status st = tl_store_open(ctx, arg, &store);
    if (!st) st = tl_cut_check(ctx, store, NULL, &opts, &found);
    tl_cut_check_release(ctx, &found);
    tl_store_close(store);
    return st;
}

static void test_failing_memory(void **state)
{
    (void)state;
    fixture f;
    fail_alloc each;
    char path[] = "cut_check_memory.tlod";
    build_model(&f, path, 7);
    fail_alloc_open(&each, 1);
    CHECK(fail_alloc_each(&each, open_and_check, path) > 100);
    fail_alloc_close(&each);
    close_model(&f, path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_damage_is_found),
        cmocka_unit_test(test_any_number_of_threads),
        cmocka_unit_test(test_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
