/* Names of regions and named surfaces: what is kept, refused and freed. */
#include "fail_alloc.h"
#include "make_mesh.h"

static void test_region_names(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    make_mesh m = make_grid(2);
    tl_mesh *mesh = make_object(f.ctx, &m, NULL);
    CHECK(!tl_mesh_region_name(mesh, 7));
    CHECK_OK(f.ctx, tl_mesh_set_region_name(mesh, 7, "steel"));
    CHECK_OK(f.ctx, tl_mesh_set_region_name(mesh, -1, "air"));
    CHECK_OK(f.ctx, tl_mesh_set_region_name(mesh, 7, "copper"));
    CHECK(!strcmp(tl_mesh_region_name(mesh, 7), "copper"));
    CHECK(!strcmp(tl_mesh_region_name(mesh, -1), "air"));
    CHECK_OK(f.ctx, tl_mesh_set_region_name(mesh, 7, NULL));
    CHECK_OK(f.ctx, tl_mesh_set_region_name(mesh, 8, ""));
    CHECK(!tl_mesh_region_name(mesh, 7) && !tl_mesh_region_name(mesh, 8));
    CHECK(!strcmp(tl_mesh_region_name(mesh, -1), "air"));
    tl_mesh_destroy(mesh);
    make_release(&m);
    fail_alloc_close(&f);
}

static void test_labels(void **state)
{
    (void)state;
    fail_alloc f;
    fail_alloc_open(&f, 1);
    make_mesh m = make_grid(2); /* five tets */
    tl_mesh *mesh = make_object(f.ctx, &m, NULL);
    const tl_lidx faces[] = {3, 4, 19}, beyond[] = {3, 20}, twice[] = {4, 4};
    CHECK_EQ(tl_mesh_label_count(mesh), 0);
    CHECK_OK(f.ctx, tl_mesh_add_label(mesh, &(tl_label){"inlet", 5, 3, faces}));
    CHECK_OK(f.ctx, tl_mesh_add_label(mesh, &(tl_label){NULL, 6, 0, NULL}));
    CHECK_STATUS(tl_mesh_add_label(mesh, &(tl_label){"x", 1, 2, beyond}), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(f.ctx), "tet 5 of a mesh of 5"));
    CHECK_STATUS(tl_mesh_add_label(mesh, &(tl_label){"x", 1, 2, twice}), TL_ERR_ARG);
    CHECK_STATUS(tl_mesh_add_label(mesh, &(tl_label){"x", 1, 2, NULL}), TL_ERR_ARG);
    CHECK_EQ(tl_mesh_label_count(mesh), 2);
    const tl_label *label = tl_mesh_label(mesh, 0);
    CHECK(!strcmp(label->name, "inlet") && label->id == 5 && label->face_count == 3);
    CHECK(label->faces != faces && !memcmp(label->faces, faces, sizeof faces));
    label = tl_mesh_label(mesh, 1);
    CHECK(!strcmp(label->name, "") && label->id == 6 && label->face_count == 0);
    tl_mesh_destroy(mesh);
    make_release(&m);
    fail_alloc_close(&f);
}

static tl_status add_names(tl_ctx *ctx, void *arg)
{
    const make_mesh *m = arg;
    const tl_lidx faces[] = {0, 1};
    tl_mesh *mesh;
    tl_status st = tl_mesh_create(ctx, m->xyz, m->vert_count, m->tets, m->tet_count, &mesh);
    if (!st) st = tl_mesh_set_region_name(mesh, 1, "one");
    if (!st) st = tl_mesh_set_region_name(mesh, 1, "another");
    if (!st) st = tl_mesh_add_label(mesh, &(tl_label){"wall", 1, 2, faces});
    tl_mesh_destroy(mesh);
    return st;
}

static void test_failing_allocations(void **state)
{
    (void)state;
    fail_alloc f;
    make_mesh m = make_grid(2);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, add_names, &m) > 6);
    fail_alloc_close(&f);
    make_release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_region_names),
        cmocka_unit_test(test_labels),
        cmocka_unit_test(test_failing_allocations),
    };
    return cmocka_run_group_tests_name("mesh_labels", tests, NULL, NULL);
}
