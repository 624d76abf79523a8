/* A model as it is built, several levels of coded patches, with every byte changed and cut off
 * after every byte: opening it, or taking a mesh out of it, is an error or gives the very mesh that
 * was there; the check finds all of it. */
#include "check_ctx.h"

#include "store/store.h"
#include "tetralod/cut.h"

#include "check_file.h"
#include "check_model.h"

typedef struct fixture {
    tl_ctx *ctx;
    uint8_t *bytes;
    size_t byte_count;
    uint64_t meshes[3]; /* what those of the whole file hash to */
} fixture;

static double bumps(const double x[3])
{
    return sin(5 * x[0]) * cos(4 * x[1]) + x[2] * x[2];
}

static void build_model(fixture *f)
{
    const char *path = check_model_path("damage");
    tl_build_result result;
    tl_build_opts opts = check_model_opts(300, 80);
    f->ctx = check_ctx_create(1);
    make_mesh m = make_grid(6);
    tl_mesh *mesh = make_object(f->ctx, &m, bumps);
    CHECK_OK(f->ctx, tl_model_build_mesh(f->ctx, mesh, path, &opts, &result));
    CHECK(result.level_count > 2);
    tl_build_release(f->ctx, &result);
    tl_mesh_destroy(mesh);
    make_release(&m);
    f->bytes = check_file_load(path, &f->byte_count);
    CHECK_EQ(remove(path), 0);
    printf("%zu bytes\n", f->byte_count);
}

static uint64_t hash(uint64_t seed, const void *data, size_t byte_count)
{
    const uint8_t *bytes = data;
    for (size_t i = 0; i < byte_count; i++) seed = (seed ^ bytes[i]) * 0x100000001b3u;
    return seed;
}

static uint64_t hash_mesh(const tl_mesh *mesh)
{
    const size_t verts = tl_mesh_vert_count(mesh);
    uint64_t h = hash(1, tl_mesh_xyz(mesh), verts * 3 * sizeof(double));
    h = hash(h, tl_mesh_tets(mesh), tl_mesh_tet_count(mesh) * 4 * sizeof(tl_lidx));
    return hash(h, tl_mesh_channel(mesh, 0)->values, verts * sizeof(double));
}

/* The finest mesh, the coarsest one, one in between; 0 in the place of an error. */
static void take_meshes(const fixture *f, tl_store *store, uint64_t meshes[3])
{
    const uint32_t levels[3] = {0, UINT32_MAX, 1};
    tl_cut *cut = NULL;
    memset(meshes, 0, 3 * sizeof *meshes);
    if (tl_cut_create(f->ctx, store, &cut)) return;
    for (int i = 0; i < 3; i++) {
        tl_mesh *mesh = NULL;
        tl_cut_query query = tl_cut_query_defaults();
        query.level = levels[i];
        if (!tl_cut_update(cut, &query) && !tl_cut_mesh(cut, NULL, 0, &mesh))
            meshes[i] = hash_mesh(mesh);
        tl_mesh_destroy(mesh);
    }
    tl_cut_destroy(cut);
}

/* The first byte_count bytes; returns how many meshes were still there, as they should be. */
static size_t check_refused(const fixture *f, size_t byte_count, const char *what, size_t place)
{
    tl_store *store = NULL;
    uint64_t meshes[3];
    size_t good = 0;
    tl_status st = tli_store_open_bytes(f->ctx, "m.tlod", f->bytes, byte_count, &store);
    if (!st) {
        take_meshes(f, store, meshes);
        for (int i = 0; i < 3; i++) {
            if (meshes[i] && meshes[i] != f->meshes[i])
                fail_msg("%s at %zu gave another mesh", what, place);
            good += meshes[i] != 0;
        }
        st = tl_store_check(f->ctx, store, TL_CHECK_FULL);
    }
    if (st != TL_ERR_FORMAT && st != TL_ERR_UNSUPPORTED)
        fail_msg("%s at %zu gave \"%s\"", what, place, tl_status_name(st));
    CHECK(strstr(tl_ctx_message(f->ctx), "m.tlod"));
    tl_store_close(store);
    return good;
}

static void test_every_byte(void **state)
{
    (void)state;
    fixture f;
    tl_store *store = NULL;
    uint64_t seed = 11;
    size_t good = 0;
    build_model(&f);
    CHECK_OK(f.ctx, tli_store_open_bytes(f.ctx, "m.tlod", f.bytes, f.byte_count, &store));
    CHECK_OK(f.ctx, tl_store_check(f.ctx, store, TL_CHECK_FULL));
    take_meshes(&f, store, f.meshes);
    CHECK(f.meshes[0] && f.meshes[1] && f.meshes[2]);
    tl_store_close(store);
    for (size_t i = 0; i < f.byte_count; i++) {
        const uint8_t bit = (uint8_t)(1u << make_random(&seed) % 8);
        f.bytes[i] ^= bit;
        good += check_refused(&f, f.byte_count, "a change", i);
        f.bytes[i] ^= bit;
    }
    CHECK(good > 0); /* what is damaged in one level does not take the others along */
    for (size_t i = 0; i < f.byte_count; i += 1 + make_random(&seed) % 8)
        CHECK_EQ(check_refused(&f, i, "a cut", i), 0);
    free(f.bytes);
    check_ctx_destroy(f.ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_byte)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
