/* Gmsh, Medit, TetGen and Exodus out and in again: positions, tets, regions and labels with their
 * names, channels as far as the format holds them; failing file access. */
#include "check_source.h"
#include "formats/formats_netcdf.h"
#include "formats/formats_netcdf_write.h"

#define VERTS 6
#define TETS 3

static const double xyz[VERTS][3] = {{0, 0, 0},     {1, 0, 0}, {0, 1.0 / 3, 0},
                                     {0, 0, -1e-9}, {1, 1, 1}, {2, 0.1, 1e20}};
static const tl_lidx tets[TETS][4] = {{0, 2, 1, 3}, {0, 1, 2, 4}, {1, 4, 2, 5}};

static tl_mesh *make_mesh(tl_ctx *ctx, const int32_t *regions, int label_low)
{
    static const tl_lidx wall[] = {0, 6, 9}, inner[] = {3, 7}; /* one face, from both sides */
    static double values[VERTS * 6];
    tl_mesh *mesh;
    for (int i = 0; i < VERTS * 6; i++) values[i] = i / 7.0 - 2;
    CHECK_OK(ctx, tl_mesh_create(ctx, &xyz[0][0], VERTS, &tets[0][0], TETS, &mesh));
    const tl_channel channels[] = {
        {"heat", "K", 1, TL_ON_VERTEX, TL_F64, values},
        {"say \"it\"", "", 3, TL_ON_VERTEX, TL_F64, values},
        {"stress", "", 6, TL_ON_VERTEX, TL_F64, values},
        {"cells", "", 2, TL_ON_TET, TL_F64, values},
    };
    for (size_t i = 0; i < 4; i++) CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channels[i]));
    CHECK_OK(ctx, tl_mesh_set_regions(mesh, regions));
    if (regions) CHECK_OK(ctx, tl_mesh_set_region_name(mesh, 5, "solid part"));
    const tl_label labels[] = {{"wall", label_low, 3, wall}, {"", label_low + 7, 2, inner}};
    for (size_t i = 0; i < 2; i++) CHECK_OK(ctx, tl_mesh_add_label(mesh, &labels[i]));
    tl_mesh_set_time(mesh, 2.5);
    return mesh;
}

static void check_geometry(const tl_mesh *mesh)
{
    CHECK_EQ(tl_mesh_vert_count(mesh), VERTS);
    CHECK_EQ(tl_mesh_tet_count(mesh), TETS);
    CHECK(memcmp(tl_mesh_xyz(mesh), xyz, sizeof xyz) == 0);
    CHECK(memcmp(tl_mesh_tets(mesh), tets, sizeof tets) == 0);
}

/* Each label has the faces that it had, seen from one tet or the other. */
static void check_labels(const tl_mesh *mesh, int first_id, const char *first_name)
{
    CHECK_EQ(tl_mesh_label_count(mesh), 2);
    const tl_label *wall = tl_mesh_label(mesh, 0), *inner = tl_mesh_label(mesh, 1);
    CHECK_EQ(wall->id, first_id);
    CHECK_EQ(inner->id, first_id + 7);
    CHECK(strcmp(wall->name, first_name) == 0);
    CHECK_EQ(wall->face_count, 3);
    CHECK_EQ(wall->faces[0], 0);
    CHECK_EQ(wall->faces[1], 6);
    CHECK_EQ(wall->faces[2], 9);
    CHECK(inner->face_count == 2 && inner->faces[0] == 3 && inner->faces[1] == 7);
}

static void check_channel(const tl_mesh *mesh, const tl_mesh *written, const char *name,
                          const char *source)
{
    const tl_channel *in = tl_mesh_channel_by_name(mesh, name);
    const tl_channel *out = tl_mesh_channel_by_name(written, source);
    if (!in) fail_msg("no channel '%s'", name);
    CHECK_EQ(in->components, out->components);
    size_t count = (in->on == TL_ON_TET ? TETS : VERTS) * in->components;
    CHECK(memcmp(in->values, out->values, count * sizeof *in->values) == 0);
}

static void gmsh_out_and_in(void **state)
{
    (void)state;
    static const int32_t regions[TETS] = {5, 9, 5}, low[TETS] = {0, -3, 0};
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int variant = 0; variant < 4; variant++) {
        tl_write_opts opts = tl_write_opts_defaults();
        tl_mesh *mesh = make_mesh(ctx, variant < 2 ? regions : low, variant < 2 ? 1 : 0), *again;
        opts.ascii = variant % 2;
        CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "w.msh", &opts));
        CHECK_OK(ctx, tl_mesh_read(ctx, "w.msh", NULL, &again, NULL));
        check_geometry(again);
        check_labels(again, 1, "wall");
        for (int t = 0; t < TETS; t++)
            CHECK_EQ(tl_mesh_regions(again)[t], variant < 2 ? regions[t] : low[t] + 4);
        if (variant < 2) CHECK(strcmp(tl_mesh_region_name(again, 5), "solid part") == 0);
        check_channel(again, mesh, "heat", "heat");
        check_channel(again, mesh, "say 'it'", "say \"it\"");
        check_channel(again, mesh, "stress", "stress");
        check_channel(again, mesh, "cells", "cells");
        CHECK(tl_mesh_time(again) == 2.5);
        tl_mesh_destroy(again);
        tl_mesh_destroy(mesh);
    }
    remove("w.msh");
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void medit_out_and_in(void **state)
{
    (void)state;
    static const int32_t regions[TETS] = {5, 0, -2};
    tl_ctx *ctx = grid_ctx(0, 2);
    tl_mesh *mesh = make_mesh(ctx, regions, 2), *again;
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "w.mesh", NULL));
    CHECK_OK(ctx, tl_mesh_read(ctx, "w.mesh", NULL, &again, NULL));
    check_geometry(again);
    check_labels(again, 2, "");
    CHECK(memcmp(tl_mesh_regions(again), regions, sizeof regions) == 0);
    CHECK_EQ(tl_mesh_channel_count(again), 3);
    check_channel(again, mesh, "solution1", "heat");
    check_channel(again, mesh, "solution2", "say \"it\"");
    check_channel(again, mesh, "solution3", "stress");
    tl_mesh_destroy(again);
    tl_mesh_destroy(mesh);
    remove("w.mesh");
    remove("w.sol");
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void tetgen_out_and_in(void **state)
{
    (void)state;
    static const int32_t regions[TETS] = {5, 0, -2};
    tl_ctx *ctx = grid_ctx(0, 2);
    tl_mesh *mesh = make_mesh(ctx, regions, 2), *again;
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "w.ele", NULL));
    CHECK_OK(ctx, tl_mesh_read(ctx, "w.node", NULL, &again, NULL));
    check_geometry(again);
    check_labels(again, 2, "");
    CHECK(memcmp(tl_mesh_regions(again), regions, sizeof regions) == 0);
    CHECK_EQ(tl_mesh_channel_count(again), 12);
    check_channel(again, mesh, "attribute1", "heat");
    const double *cells = tl_mesh_channel_by_name(mesh, "cells")->values;
    const tl_channel *last = tl_mesh_channel(again, 11);
    CHECK(last->on == TL_ON_TET && last->values[2] == cells[5]);
    tl_mesh_destroy(again);
    tl_mesh_destroy(mesh);
    char head[16] = {0}; /* the face that is there from both sides is written once */
    FILE *file = fopen("w.face", "r");
    CHECK(file && fgets(head, sizeof head, file) && fclose(file) == 0);
    CHECK(strcmp(head, "4 1\n") == 0);
    static const char *const names[] = {"w.node", "w.ele", "w.face"};
    for (int i = 0; i < 3; i++) remove(names[i]);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Tets of one region stand together there: tet t is number placed[t]. */
static void check_exodus(const tl_mesh *mesh, const tl_mesh *again, const int placed[TETS])
{
    CHECK_EQ(tl_mesh_vert_count(again), VERTS);
    CHECK_EQ(tl_mesh_tet_count(again), TETS);
    CHECK(memcmp(tl_mesh_xyz(again), xyz, sizeof xyz) == 0);
    for (int t = 0; t < TETS; t++)
        CHECK(memcmp(tl_mesh_tets(again) + (size_t)placed[t] * 4, tets[t], sizeof tets[t]) == 0);
    check_channel(again, mesh, "heat", "heat");
    check_channel(again, mesh, "say \"it\"", "say \"it\"");
    check_channel(again, mesh, "stress", "stress");
    const double *cells = tl_mesh_channel_by_name(mesh, "cells")->values;
    for (int c = 0; c < 2; c++) {
        const tl_channel *one = tl_mesh_channel_by_name(again, c ? "cells_2" : "cells_1");
        CHECK(one && one->on == TL_ON_TET && one->components == 1);
        for (int t = 0; t < TETS; t++) CHECK(one->values[placed[t]] == cells[2 * t + c]);
    }
    CHECK(tl_mesh_time(again) == 2.5);
}

/* A label has the faces that it had, of the tets where they are now. */
static void check_moved_labels(const tl_mesh *mesh, const tl_mesh *again, const int placed[TETS],
                               int first_id)
{
    CHECK_EQ(tl_mesh_label_count(again), 2);
    for (size_t i = 0; i < 2; i++) {
        const tl_label *was = tl_mesh_label(mesh, i), *is = tl_mesh_label(again, i);
        CHECK(strcmp(was->name, is->name) == 0);
        CHECK_EQ(is->id, first_id + (int)(7 * i));
        CHECK_EQ(is->face_count, was->face_count);
        for (size_t f = 0; f < was->face_count; f++) {
            size_t found = 0;
            tl_lidx face = 4 * (tl_lidx)placed[was->faces[f] / 4] + was->faces[f] % 4;
            for (size_t k = 0; k < is->face_count; k++) found += is->faces[k] == face;
            CHECK_EQ(found, 1);
        }
    }
}

static void exodus_out_and_in(void **state)
{
    (void)state;
    static const struct {
        const char *path;
        int32_t regions[TETS], read[TETS]; /* of tet t, given and read */
        int placed[TETS], label, label_read;
    } cases[] = {{"w.exo", {5, 9, 5}, {5, 9, 5}, {0, 2, 1}, 3, 3},
                 {"w.e", {0, 0, 4}, {0, 0, 4}, {0, 1, 2}, 0, 0},
                 {"w.G", {2, -3, -2}, {5, 0, 1}, {2, 0, 1}, -4, 0}};
    tl_ctx *ctx = grid_ctx(0, 2);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tl_mesh *mesh = make_mesh(ctx, cases[i].regions, cases[i].label), *again;
        CHECK_OK(ctx, tl_mesh_write(ctx, mesh, cases[i].path, NULL));
        CHECK_OK(ctx, tl_mesh_read(ctx, cases[i].path, NULL, &again, NULL));
        check_exodus(mesh, again, cases[i].placed);
        check_moved_labels(mesh, again, cases[i].placed, cases[i].label_read);
        for (int t = 0; t < TETS; t++)
            CHECK_EQ(tl_mesh_regions(again)[cases[i].placed[t]], cases[i].read[t]);
        if (i == 0) CHECK(strcmp(tl_mesh_region_name(again, 5), "solid part") == 0);
        tl_mesh_destroy(again);
        tl_mesh_destroy(mesh);
        remove(cases[i].path);
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Without regions, channels, labels, time; without anything; what can't be written. */
static void exodus_of_little(void **state)
{
    (void)state;
    static const int32_t far[TETS] = {-5, 0, INT32_MAX};
    tl_ctx *ctx = grid_ctx(0, 1);
    for (size_t count = 0; count <= TETS; count += TETS) {
        tl_mesh *mesh, *again;
        CHECK_OK(ctx, tl_mesh_create(ctx, &xyz[0][0], 2 * count, &tets[0][0], count, &mesh));
        CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "w.exo", NULL));
        if (count) { /* without nodes there is nothing that says Exodus */
            CHECK_OK(ctx, tl_mesh_read(ctx, "w.exo", NULL, &again, NULL));
            check_geometry(again);
            CHECK(isnan(tl_mesh_time(again)));
            tl_mesh_destroy(again);
        }
        tl_mesh_destroy(mesh);
    }
    tl_write_opts opts = tl_write_opts_defaults();
    tl_mesh *mesh = make_mesh(ctx, far, 1);
    opts.ascii = true;
    CHECK_STATUS(tl_mesh_write(ctx, mesh, "no.exo", &opts), TL_ERR_ARG);
    CHECK_STATUS(tl_mesh_write(ctx, mesh, "no.exo", NULL), TL_ERR_UNSUPPORTED);
    check_says(ctx, "31 bits");
    CHECK(remove("no.exo") != 0 && remove("w.exo") == 0);
    tl_mesh_destroy(mesh);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Two side sets must not have one id: VTK would show the first twice. */
static void exodus_ids_of_labels(void **state)
{
    (void)state;
    static const tl_lidx face[] = {0, 6};
    tl_ctx *ctx = grid_ctx(0, 1);
    tl_mesh *mesh = make_mesh(ctx, NULL, 3), *again;
    const tl_label third = {"third", 3, 2, face}, none = {"none", 5, 0, face};
    CHECK_OK(ctx, tl_mesh_add_label(mesh, &third));
    CHECK_OK(ctx, tl_mesh_add_label(mesh, &none));
    CHECK_OK(ctx, tl_mesh_write(ctx, mesh, "w.exo", NULL));
    CHECK_OK(ctx, tl_mesh_read(ctx, "w.exo", NULL, &again, NULL));
    CHECK_EQ(tl_mesh_label_count(again), 3);
    for (size_t i = 0; i < 3; i++) CHECK_EQ(tl_mesh_label(again, i)->id, (int)i + 1);
    CHECK(strcmp(tl_mesh_label(again, 2)->name, "third") == 0);
    tl_mesh_destroy(again);
    tl_mesh_destroy(mesh);
    remove("w.exo");
    tl_ctx_destroy(ctx);
}

static void fill_count(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    (void)arg;
    for (uint64_t i = begin; i < end; i++) ((int64_t *)out)[i - begin] = (int64_t)i - (1ll << 40);
}

/* The form for large files, of a small one. */
static void netcdf_of_64_bits(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 1);
    tli_ncw_dim dims[] = {{"n", 5}, {"step", 0}};
    tli_ncw_attribute title = {"title", "odd", TL_U8, 0};
    tli_ncw_var vars[] = {{{"wide", NULL, TL_I64, 1, 5, fill_count, NULL}, 1, {0}, NULL, NULL},
                          {{"later", NULL, TL_I64, 1, 5, fill_count, NULL}, 2, {1, 0}, "a", "bc"}};
    tli_ncw file = {dims, 2, &title, 1, vars, 2};
    CHECK_EQ(tli_ncw_version(&file), 5);
    tli_emit emit = {.ctx = ctx, .total = tli_ncw_bytes(&file)};
    CHECK_OK(ctx, tli_sink_open(ctx, "w.nc", &emit.sink));
    CHECK_OK(ctx, tli_ncw_emit(&emit, &file, 5));
    CHECK_OK(ctx, tli_emit_close(&emit, "w.nc", TL_OK));
    tli_source source = {.path = "w.nc"};
    tli_nc nc;
    CHECK_OK(ctx, tli_map_open(ctx, "w.nc", &source.map));
    CHECK_OK(ctx, tli_nc_open(ctx, &source, &nc));
    for (size_t v = 0; v < 2; v++) {
        double values[5];
        const tli_nc_var *var = tli_nc_find(&nc, vars[v].data.name);
        CHECK(var && var->is_record == (v == 1));
        CHECK_OK(ctx, tli_nc_reals(&nc, var, 0, 0, 5, values, 1));
        for (int i = 0; i < 5; i++) CHECK(values[i] == (double)(i - (1ll << 40)));
    }
    char text[TLI_NC_NAME_MAX];
    CHECK_OK(ctx, tli_nc_attribute(&nc, tli_nc_find(&nc, "later"), "a", text));
    CHECK(strcmp(text, "bc") == 0);
    tli_nc_close(&nc);
    tli_map_close(ctx, &source.map);
    tli_ncw_dim huge = {"n", 1ull << 32};
    file = (tli_ncw){.dims = &huge, .dim_count = 1};
    CHECK_EQ(tli_ncw_version(&file), 5);
    remove("w.nc");
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* Fails each file access in turn: a message, no file half done, nothing left behind. */
static void failing_files(void **state)
{
    (void)state;
    static const char *const names[] = {"f.msh", "f.mesh", "f.node", "f.exo"};
    static const int32_t regions[TETS] = {1, 2, 3};
    for (int i = 0; i < 4; i++) {
        tl_status st = TL_ERR_IO;
        size_t failures = 0;
        for (uint64_t n = 1; st; n++) {
            tl_ctx *ctx = grid_ctx(0, 1);
            tl_mesh *mesh = make_mesh(ctx, regions, 1);
            tli_file_fail_at(ctx, n);
            st = tl_mesh_write(ctx, mesh, names[i], NULL);
            tli_file_fail_at(ctx, 0);
            CHECK(st == TL_OK || st == TL_ERR_IO);
            if (st) check_says(ctx, "f.");
            failures += st != TL_OK;
            tl_mesh_destroy(mesh);
            CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
            tl_ctx_destroy(ctx);
        }
        printf("%s: %zu failures\n", names[i], failures);
        CHECK(failures >= 3);
    }
    static const char *const written[] = {"f.msh", "f.mesh", "f.sol", "f.node",
                                          "f.ele", "f.face", "f.exo"};
    for (int i = 0; i < 7; i++) CHECK_EQ(remove(written[i]), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gmsh_out_and_in),   cmocka_unit_test(medit_out_and_in),
        cmocka_unit_test(tetgen_out_and_in), cmocka_unit_test(exodus_out_and_in),
        cmocka_unit_test(exodus_of_little),  cmocka_unit_test(exodus_ids_of_labels),
        cmocka_unit_test(netcdf_of_64_bits), cmocka_unit_test(failing_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
