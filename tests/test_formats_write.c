/* Files that are written: read back here and by VTK and meshio, with the same counts and values;
 * full disks, failing files and memory, and every prefix of a file. */
#include "check.h"
#include "check_alloc.h"

#include <sys/stat.h>
#include <unistd.h>

#include "base/base_file.h"
#include "tetralod/formats.h"

#define VERTS_A_SIDE 4
#define TETS (5 * (VERTS_A_SIDE - 1) * (VERTS_A_SIDE - 1) * (VERTS_A_SIDE - 1))
#define VERTS (VERTS_A_SIDE * VERTS_A_SIDE * VERTS_A_SIDE)

static tl_ctx *open_ctx(check_alloc *h, unsigned threads)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = threads;
    opts.resize = check_alloc_resize;
    opts.user = h;
    tl_ctx *ctx = NULL;
    CHECK_EQ(tl_ctx_create(&opts, &ctx), TL_OK);
    return ctx;
}

/* ---- a mesh with everything ---- */

typedef struct field {
    const char *name;
    tl_on on;
    uint32_t components;
    tl_scalar scalar;
    double scale;
    bool holes; /* with NaN and infinity */
} field;

static const field fields[] = {
    {"pressure", TL_ON_VERTEX, 1, TL_F32, 0.5, false},
    {"velocity", TL_ON_VERTEX, 3, TL_F64, 0.1, false},
    {"a <b> & \"c\" 'd' 100%", TL_ON_VERTEX, 1, TL_F64, 1e-300, false},
    {"Temp\xc3\xa9rature", TL_ON_VERTEX, 6, TL_F32, 0.25, false},
    {"i8", TL_ON_TET, 1, TL_I8, -0.5, false},
    {"u8", TL_ON_TET, 1, TL_U8, 1, false},
    {"i16", TL_ON_TET, 2, TL_I16, -100, false},
    {"u16", TL_ON_TET, 1, TL_U16, 100, false},
    {"i32", TL_ON_TET, 1, TL_I32, -1e6, false},
    {"u32", TL_ON_TET, 1, TL_U32, 1e7, false},
    {"i64", TL_ON_TET, 1, TL_I64, -1e13, false},
    {"u64", TL_ON_TET, 1, TL_U64, 1e13, false},
    {"tensor", TL_ON_TET, 9, TL_F32, 2, false},
    {"no longer bytes", TL_ON_TET, 1, TL_U8, 1.5, false},
    {"with holes", TL_ON_VERTEX, 1, TL_F32, 1, true}, /* the last: VTK can't read it from text */
};
#define FIELD_COUNT (sizeof fields / sizeof fields[0])

static double field_value(const field *f, size_t i)
{
    if (f->holes && i % 7 == 3) return i % 2 ? (double)NAN : (double)-INFINITY;
    double value = (double)(i % 251) * f->scale;
    return f->scalar <= TL_U64 && f->scale != 1.5 ? trunc(value) + 0.0 : value;
}

static tl_mesh *make_mesh(tl_ctx *ctx, size_t field_count)
{
    double xyz[VERTS][3];
    tl_lidx tets[TETS][4];
    static const uint8_t split[2][5][4] = {
        {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 1, 4, 7}, {6, 4, 2, 7}},
        {{0, 5, 3, 6}, {1, 3, 0, 5}, {2, 0, 3, 6}, {4, 5, 0, 6}, {7, 3, 5, 6}}};
    size_t n = VERTS_A_SIDE, used = 0;
    for (size_t v = 0; v < VERTS; v++) {
        xyz[v][0] = 0.1 * (double)(v % n); /* no float32 */
        xyz[v][1] = (double)(v / n % n);
        xyz[v][2] = (double)(v / n / n);
    }
    for (size_t v = 0; v < VERTS; v++) {
        size_t i = v % n, j = v / n % n, k = v / n / n;
        if (i + 1 == n || j + 1 == n || k + 1 == n) continue;
        for (size_t t = 0; t < 5; t++, used++)
            for (size_t c = 0; c < 4; c++) {
                unsigned corner = split[(i + j + k) & 1][t][c];
                tets[used][c] =
                    (tl_lidx)(v + (corner & 1) + (corner >> 1 & 1) * n + (corner >> 2) * n * n);
            }
    }
    tl_mesh *mesh = NULL;
    if (tl_mesh_create(ctx, xyz[0], VERTS, tets[0], TETS, &mesh)) return NULL;
    tl_mesh_set_time(mesh, 0.1);
    for (size_t f = 0; f < field_count; f++) {
        size_t count = fields[f].components * (size_t)(fields[f].on == TL_ON_TET ? TETS : VERTS);
        double values[9 * TETS];
        for (size_t i = 0; i < count; i++) values[i] = field_value(&fields[f], i);
        tl_channel channel = {fields[f].name,       f ? "" : "kg/(m s\xc2\xb2) <>",
                              fields[f].components, fields[f].on,
                              fields[f].scalar,     values};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    }
    int32_t regions[TETS];
    for (int t = 0; t < TETS; t++) regions[t] = t % 3 - 1;
    CHECK_OK(ctx, tl_mesh_set_regions(mesh, regions));
    return mesh;
}

static bool same_number(double a, double b)
{
    return a == b || (isnan(a) && isnan(b));
}

/* ---- ways of writing ---- */

typedef struct way {
    const char *path;
    bool zlib, ascii;
} way;
static const way ways[] = {{"raw.vtu", false, false},
                           {"zlib.vtu", true, false},
                           {"text.vtu", false, true},
                           {"binary.vtk", false, false},
                           {"text.vtk", false, true}};
#define WAY_COUNT (sizeof ways / sizeof ways[0])

static tl_status write_way(tl_ctx *ctx, const tl_mesh *mesh, const way *w)
{
    tl_write_opts opts = tl_write_opts_defaults();
    opts.zlib = w->zlib;
    opts.ascii = w->ascii;
    return tl_mesh_write(ctx, mesh, w->path, &opts);
}

static void test_round_trip(void **state)
{
    (void)state;
    for (size_t i = 0; i < WAY_COUNT; i++) {
        check_alloc h = {0};
        tl_ctx *ctx = open_ctx(&h, 2);
        tl_mesh *mesh = make_mesh(ctx, FIELD_COUNT), *back = NULL;
        CHECK_OK(ctx, write_way(ctx, mesh, &ways[i]));
        CHECK_OK(ctx, tl_mesh_read(ctx, ways[i].path, NULL, &back, NULL));
        CHECK_EQ(tl_mesh_vert_count(back), VERTS);
        CHECK_EQ(tl_mesh_tet_count(back), TETS);
        CHECK_EQ(memcmp(tl_mesh_xyz(back), tl_mesh_xyz(mesh), sizeof(double[3]) * VERTS), 0);
        CHECK_EQ(memcmp(tl_mesh_tets(back), tl_mesh_tets(mesh), sizeof(tl_lidx[4]) * TETS), 0);
        CHECK_EQ(memcmp(tl_mesh_regions(back), tl_mesh_regions(mesh), sizeof(int32_t) * TETS), 0);
        CHECK_NEAR(tl_mesh_time(back), 0.1, 0);
        CHECK_EQ(tl_mesh_channel_count(back), FIELD_COUNT + 1); /* and the regions */
        for (size_t f = 0; f < FIELD_COUNT; f++) {
            const tl_channel *channel = tl_mesh_channel_by_name(back, fields[f].name);
            if (!channel) fail_msg("%s: '%s' is missing", ways[i].path, fields[f].name);
            CHECK_EQ(channel->components, fields[f].components);
            CHECK_EQ(channel->on, fields[f].on);
            CHECK_EQ(channel->scalar, fields[f].scale == 1.5 ? TL_F64 : fields[f].scalar);
            size_t count = fields[f].components * (size_t)(channel->on == TL_ON_TET ? TETS : VERTS);
            for (size_t v = 0; v < count; v++)
                if (!same_number(channel->values[v], field_value(&fields[f], v)))
                    fail_msg("%s: %s[%zu] is %.17g, expected %.17g", ways[i].path, fields[f].name,
                             v, channel->values[v], field_value(&fields[f], v));
        }
        tl_mesh_destroy(back);
        tl_mesh_destroy(mesh);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
}

/* Regions that a channel holds already are not written again. */
static void test_regions_are_written_once(void **state)
{
    (void)state;
    check_alloc h = {0};
    tl_ctx *ctx = open_ctx(&h, 1);
    for (int same = 0; same < 2; same++) {
        tl_mesh *mesh = make_mesh(ctx, 0), *back = NULL;
        double ids[TETS];
        for (int t = 0; t < TETS; t++) ids[t] = t % 3 - same;
        tl_channel channel = {"Material #", "", 1, TL_ON_TET, TL_I32, ids};
        CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
        CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "regions.vtu", NULL));
        CHECK_OK(ctx, tl_mesh_read(ctx, "regions.vtu", NULL, &back, NULL));
        CHECK_EQ(tl_mesh_channel_count(back), same ? 1 : 2);
        CHECK_EQ(memcmp(tl_mesh_regions(back), tl_mesh_regions(mesh), sizeof(int32_t) * TETS), 0);
        tl_mesh_destroy(back);
        tl_mesh_destroy(mesh);
    }
    tl_ctx_destroy(ctx);
}

/* ---- peers ---- */

typedef struct record {
    char kind, name[256];
    uint32_t components;
    uint64_t count;
    double *values;
} record;

static bool next_record(FILE *file, record *r)
{
    uint32_t name_bytes;
    int kind = fgetc(file);
    if (kind == EOF) return false;
    r->kind = (char)kind;
    CHECK_EQ(fread(&name_bytes, 4, 1, file), 1);
    CHECK(name_bytes < sizeof r->name);
    CHECK_EQ(fread(r->name, 1, name_bytes, file), name_bytes);
    r->name[name_bytes] = '\0';
    CHECK_EQ(fread(&r->components, 4, 1, file), 1);
    CHECK_EQ(fread(&r->count, 8, 1, file), 1);
    r->values = malloc(r->components * r->count * sizeof *r->values + 1);
    CHECK_EQ(fread(r->values, sizeof *r->values, r->components * r->count, file),
             r->components * r->count);
    return true;
}

static double expected_value(const tl_mesh *mesh, const record *r, const field *f, size_t i)
{
    if (r->kind == 'P') return tl_mesh_xyz(mesh)[i];
    if (r->kind == 'C') return tl_mesh_tets(mesh)[i];
    if (r->kind == 't') return tl_mesh_time(mesh);
    return f ? field_value(f, i) : tl_mesh_regions(mesh)[i];
}

static void check_record(const tl_mesh *mesh, const record *r, const char *what)
{
    const field *f = NULL;
    uint64_t count = r->kind == 't' ? 1 : r->kind == 'P' || r->kind == 'v' ? VERTS : TETS;
    for (size_t i = 0; i < FIELD_COUNT; i++)
        if ((fields[i].on == TL_ON_TET) == (r->kind == 'c') && !strcmp(fields[i].name, r->name))
            f = &fields[i];
    if ((r->kind == 'v' || r->kind == 'c') && !f && strcmp(r->name, "region"))
        fail_msg("%s: an array '%s' that nobody wrote", what, r->name);
    CHECK_EQ(r->count, count);
    CHECK_EQ(r->components, f ? f->components : r->kind == 'P' ? 3 : r->kind == 'C' ? 4 : 1);
    for (size_t i = 0; i < r->count * r->components; i++)
        if (!same_number(r->values[i], expected_value(mesh, r, f, i)))
            fail_msg("%s: %c '%s'[%zu] is %.17g, expected %.17g", what, r->kind, r->name, i,
                     r->values[i], expected_value(mesh, r, f, i));
}

static void check_peer(const tl_mesh *mesh, const char *peer, const char *path)
{
    size_t channels = tl_mesh_channel_count(mesh);
    char command[1024], what[256];
    snprintf(what, sizeof what, "%s reads %s", peer, path);
    snprintf(command, sizeof command, "/usr/bin/python3 '%s/tests/peer_dump.py' %s %s peer.bin",
             TETRALOD_SOURCE_DIR, peer, path);
    if (system(command) != 0) fail_msg("%s: it failed", what);
    FILE *file = fopen("peer.bin", "rb");
    CHECK(file != NULL);
    size_t records = 0, times = 0;
    for (record r; next_record(file, &r); records++) {
        check_record(mesh, &r, what);
        times += r.kind == 't';
        free(r.values);
    }
    fclose(file);
    if (strcmp(peer, "vtk") == 0) CHECK_EQ(times, 1);
    CHECK_EQ(records - times, 2 + channels + 1); /* points, tets; regions */
    printf("%s: %zu arrays alike\n", what, records);
}

static void test_peers(void **state)
{
    (void)state;
    if (system("/usr/bin/python3 -c 'import vtk, meshio' 2>/dev/null") != 0)
        CHECK_SKIP("python3-vtk9 and python3-meshio are not installed");
    check_alloc h = {0};
    tl_ctx *ctx = open_ctx(&h, 2);
    for (size_t i = 0; i < WAY_COUNT; i++) {
        tl_mesh *mesh = make_mesh(ctx, ways[i].ascii ? FIELD_COUNT - 1 : FIELD_COUNT);
        CHECK_OK(ctx, write_way(ctx, mesh, &ways[i]));
        check_peer(mesh, "vtk", ways[i].path);
        check_peer(mesh, "meshio", ways[i].path);
        tl_mesh_destroy(mesh);
    }
    tl_ctx_destroy(ctx);
}

/* ---- what goes wrong ---- */

static void test_wrong_use(void **state)
{
    (void)state;
    check_alloc h = {0};
    tl_ctx *ctx = open_ctx(&h, 1);
    tl_mesh *mesh = make_mesh(ctx, 0);
    tl_write_opts opts = tl_write_opts_defaults();
    CHECK_STATUS(tl_mesh_write(ctx, mesh, "a.obj", NULL), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "a.obj"));
    CHECK_STATUS(tl_mesh_write(ctx, mesh, "vtu", NULL), TL_ERR_ARG);
    opts.zlib = true;
    CHECK_STATUS(tl_mesh_write(ctx, mesh, "a.vtk", &opts), TL_ERR_ARG);
    opts.ascii = true;
    CHECK_STATUS(tl_mesh_write(ctx, mesh, "a.vtu", &opts), TL_ERR_ARG);
    CHECK_STATUS(tl_mesh_write(ctx, mesh, "no/such/folder.vtu", NULL), TL_ERR_IO);
    CHECK(access("a.vtk", F_OK) != 0 && access("a.vtu", F_OK) != 0);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

static void test_empty_mesh(void **state)
{
    (void)state;
    for (size_t i = 0; i < WAY_COUNT; i++) {
        check_alloc h = {0};
        tl_ctx *ctx = open_ctx(&h, 1);
        tl_mesh *mesh = NULL, *back = NULL;
        double nothing[3] = {0};
        tl_lidx none[4] = {0};
        CHECK_OK(ctx, tl_mesh_create(ctx, nothing, 0, none, 0, &mesh));
        CHECK_OK(ctx, write_way(ctx, mesh, &ways[i]));
        CHECK_OK(ctx, tl_mesh_read(ctx, ways[i].path, NULL, &back, NULL));
        CHECK_EQ(tl_mesh_vert_count(back) + tl_mesh_tet_count(back), 0);
        CHECK(isnan(tl_mesh_time(back)));
        tl_mesh_destroy(back);
        tl_mesh_destroy(mesh);
        tl_ctx_destroy(ctx);
    }
}

static long file_bytes(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 ? (long)info.st_size : -1;
}

/* A failed write leaves the old file as it was. */
static void test_every_file_operation_fails_once(void **state)
{
    (void)state;
    for (size_t i = 0; i < 3; i++)
        for (uint64_t n = 1;; n++) {
            check_alloc h = {0};
            tl_ctx *ctx = open_ctx(&h, 1);
            tl_mesh *mesh = make_mesh(ctx, FIELD_COUNT);
            FILE *old = fopen(ways[i].path, "wb");
            fputs("old", old);
            fclose(old);
            tli_file_fail_at(ctx, n);
            tl_status st = write_way(ctx, mesh, &ways[i]);
            tli_file_fail_at(ctx, 0);
            if (st) {
                CHECK_EQ(st, TL_ERR_IO);
                CHECK(strstr(tl_ctx_message(ctx), ways[i].path));
                CHECK_EQ(file_bytes(ways[i].path), 3);
            }
            tl_mesh_destroy(mesh);
            CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
            tl_ctx_destroy(ctx);
            if (!st) {
                printf("%s: %lu operations failed in turn\n", ways[i].path, (unsigned long)n - 1);
                CHECK(file_bytes(ways[i].path) > 3);
                CHECK(n > 2);
                break;
            }
        }
}

static void test_every_allocation_fails_once(void **state)
{
    (void)state;
    for (size_t i = 0; i < WAY_COUNT; i++)
        for (unsigned long n = 1;; n++) {
            check_alloc h = {0};
            tl_ctx *ctx = open_ctx(&h, 2);
            tl_mesh *mesh = make_mesh(ctx, FIELD_COUNT);
            h.requests = 0;
            h.fail_at = n;
            remove(ways[i].path);
            tl_status st = write_way(ctx, mesh, &ways[i]);
            bool failed = h.requests >= n;
            if (st) CHECK_EQ(st, TL_ERR_MEMORY);
            if (st) CHECK(file_bytes(ways[i].path) < 0);
            tl_mesh_destroy(mesh);
            CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
            tl_ctx_destroy(ctx);
            if (!failed) {
                CHECK_EQ(st, TL_OK);
                CHECK(n > 5);
                break;
            }
        }
}

static void test_full_disk(void **state)
{
    (void)state;
    if (access("/dev/full", W_OK) != 0) CHECK_SKIP("no /dev/full");
    check_alloc h = {0};
    tl_ctx *ctx = open_ctx(&h, 1);
    tl_mesh *mesh = make_mesh(ctx, FIELD_COUNT);
    for (size_t i = 0; i < WAY_COUNT; i++) {
        remove(ways[i].path);
        CHECK_EQ(symlink("/dev/full", ways[i].path), 0);
        CHECK_STATUS(write_way(ctx, mesh, &ways[i]), TL_ERR_IO);
        CHECK(strstr(tl_ctx_message(ctx), ways[i].path));
        CHECK_EQ(remove(ways[i].path), 0);
    }
    tl_mesh_destroy(mesh);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static bool stop_at_once(void *user, const char *stage, uint64_t done, uint64_t total)
{
    (void)user, (void)stage;
    CHECK(done <= total);
    return false;
}

static bool go_on(void *user, const char *stage, uint64_t done, uint64_t total)
{
    (void)stage;
    uint64_t *last = user;
    CHECK(done >= last[0] && done <= total);
    last[0] = done;
    last[1] = total;
    return true;
}

static void test_progress_and_cancel(void **state)
{
    (void)state;
    for (size_t i = 0; i < WAY_COUNT; i++) {
        uint64_t last[2] = {0, 1};
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        tl_ctx *ctx = NULL;
        remove(ways[i].path);
        opts.progress = stop_at_once;
        CHECK_EQ(tl_ctx_create(&opts, &ctx), TL_OK);
        tl_mesh *mesh = make_mesh(ctx, FIELD_COUNT);
        CHECK_STATUS(write_way(ctx, mesh, &ways[i]), TL_ERR_CANCELLED);
        CHECK(file_bytes(ways[i].path) < 0);
        tl_mesh_destroy(mesh);
        tl_ctx_destroy(ctx);
        opts.progress = go_on;
        opts.user = last;
        CHECK_EQ(tl_ctx_create(&opts, &ctx), TL_OK);
        mesh = make_mesh(ctx, FIELD_COUNT);
        CHECK_OK(ctx, write_way(ctx, mesh, &ways[i]));
        CHECK_EQ(last[0], last[1]);
        tl_mesh_destroy(mesh);
        tl_ctx_destroy(ctx);
    }
}

/* Same bytes with any number of threads. */
static void test_bytes_do_not_depend_on_threads(void **state)
{
    (void)state;
    for (size_t i = 0; i < WAY_COUNT; i++) {
        static char first[1 << 16], second[1 << 16];
        size_t lengths[2];
        for (unsigned threads = 1; threads <= 2; threads++) {
            check_alloc h = {0};
            tl_ctx *ctx = open_ctx(&h, 3 * threads - 2);
            tl_mesh *mesh = make_mesh(ctx, FIELD_COUNT);
            CHECK_OK(ctx, write_way(ctx, mesh, &ways[i]));
            FILE *file = fopen(ways[i].path, "rb");
            lengths[threads - 1] = fread(threads == 1 ? first : second, 1, sizeof first, file);
            fclose(file);
            tl_mesh_destroy(mesh);
            tl_ctx_destroy(ctx);
        }
        CHECK(lengths[0] > 1000 && lengths[0] < sizeof first);
        CHECK_EQ(lengths[0], lengths[1]);
        CHECK_EQ(memcmp(first, second, lengths[0]), 0);
    }
}

/* A file that is cut off is refused, or whole but for white space at its end. */
static void test_every_prefix(void **state)
{
    (void)state;
    check_alloc h = {0};
    tl_ctx *ctx = open_ctx(&h, 1);
    for (size_t i = 0; i < WAY_COUNT; i++) {
        static char bytes[1 << 16];
        const char *cut = i < 3 ? "cut.vtu" : "cut.vtk";
        tl_mesh *mesh = make_mesh(ctx, 2);
        CHECK_OK(ctx, write_way(ctx, mesh, &ways[i]));
        tl_mesh_destroy(mesh);
        FILE *file = fopen(ways[i].path, "rb");
        size_t length = fread(bytes, 1, sizeof bytes, file), step = length > 8000 ? 7 : 1, read = 0;
        fclose(file);
        for (size_t keep = 0; keep < length; keep += keep + 400 < length ? step : 1) {
            remove(cut); /* a file that is overwritten is flushed by some file systems */
            file = fopen(cut, "wb");
            CHECK_EQ(fwrite(bytes, 1, keep, file), keep);
            fclose(file);
            tl_mesh *back = NULL;
            tl_status st = tl_mesh_read(ctx, cut, NULL, &back, NULL);
            CHECK((st == TL_OK) == (back != NULL));
            if (st) CHECK(strstr(tl_ctx_message(ctx), cut));
            read += st == TL_OK;
            if (back && keep + 400 < length) CHECK(tl_mesh_channel_count(back) < 3);
            tl_mesh_destroy(back);
        }
        printf("%s: %zu prefixes of %zu bytes were read\n", ways[i].path, read, length);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_regions_are_written_once),
        cmocka_unit_test(test_peers),
        cmocka_unit_test(test_wrong_use),
        cmocka_unit_test(test_empty_mesh),
        cmocka_unit_test(test_every_file_operation_fails_once),
        cmocka_unit_test(test_every_allocation_fails_once),
        cmocka_unit_test(test_full_disk),
        cmocka_unit_test(test_progress_and_cancel),
        cmocka_unit_test(test_bytes_do_not_depend_on_threads),
        cmocka_unit_test(test_every_prefix),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
