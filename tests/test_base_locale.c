/* A host program whose numbers have commas (LC_NUMERIC of de_DE): the same files are written, the
 * same numbers read, the same words drawn as by one whose numbers have points. */
#include "check.h"

#include <locale.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/base.h"
#include "check_source.h"
#include "check_view.h"
#include "make_scene.h"

#define LOCALE "de_DE.UTF-8"

/* ---- the locale ---- */

/* Makes the locale in the folder of this test, so that it need not be installed. state: of all
 * cases, NULL where there is none. */
static int make_commas(void **state)
{
    static bool commas;
    commas = !system("localedef -i de_DE -f UTF-8 ./" LOCALE " >localedef.log 2>&1") &&
             !setenv("LOCPATH", ".", 1) && setlocale(LC_NUMERIC, LOCALE) &&
             strcmp(localeconv()->decimal_point, ",") == 0;
    *state = commas ? &commas : NULL;
    return 0;
}

static void use_points(void)
{
    CHECK(setlocale(LC_NUMERIC, "C") != NULL);
}

static void use_commas(void)
{
    CHECK(setlocale(LC_NUMERIC, LOCALE) != NULL);
}

#define NEED_COMMAS(state)                                                                         \
    if (!*(state)) CHECK_SKIP("localedef makes no " LOCALE " here (Debian package locales)")

/* ---- files ---- */

/* Cairo counts its images and surfaces over the life of a program. */
static size_t without_counts(uint8_t *bytes, size_t count)
{
    static const char *const WORDS[] = {"image", "surface"};
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        bytes[kept++] = bytes[i];
        for (size_t w = 0; w < 2; w++) {
            const size_t length = strlen(WORDS[w]);
            if (kept >= length && memcmp(bytes + kept - length, WORDS[w], length) == 0)
                while (i + 1 < count && bytes[i + 1] >= '0' && bytes[i + 1] <= '9') i++;
        }
    }
    return kept;
}

static bool same_file(const char *name)
{
    static uint8_t bytes[2][1 << 20];
    size_t count[2];
    for (int i = 0; i < 2; i++) {
        char path[128];
        snprintf(path, sizeof path, "%s/%s", i ? "commas" : "points", name);
        FILE *file = fopen(path, "rb");
        if (!file) fail_msg("there is no '%s'", path);
        count[i] = fread(bytes[i], 1, sizeof bytes[i], file);
        fclose(file);
        CHECK(count[i] > 0 && count[i] < sizeof bytes[i]);
        if (strstr(name, ".svg")) count[i] = without_counts(bytes[i], count[i]);
    }
    if (count[0] == count[1] && memcmp(bytes[0], bytes[1], count[0]) == 0) return true;
    printf("'%s' depends on the locale\n", name);
    return false;
}

static const char *const MESHES[] = {"m.vtu", "m.vtk", "m.msh", "m.mesh", "m.node"};
static const char *const OTHERS[] = {"m.sol", "m.ele", "s.pvd",      "t.obj",
                                     "t.vtp", "t.glb", "scene.json", "cams.json"};

static const char *in(const char *folder, const char *name)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void write_files(tl_ctx *ctx, const tl_mesh *mesh, const char *folder)
{
    static const char *const STEPS[] = {"a.vtu", "b.vtu"};
    static const double TIMES[] = {0.125, 1e-3 / 3};
    tl_write_opts opts = tl_write_opts_defaults();
    mkdir(folder, 0777);
    for (size_t i = 0; i < sizeof MESHES / sizeof *MESHES; i++) {
        const char *ending = strrchr(MESHES[i], '.');
        opts.ascii = strcmp(ending, ".vtu") == 0 || strcmp(ending, ".vtk") == 0;
        CHECK_OK(ctx, tl_mesh_write(ctx, mesh, in(folder, MESHES[i]), &opts));
    }
    CHECK_OK(ctx, tl_series_write(ctx, in(folder, "s.pvd"), STEPS, TIMES, 2));
    tl_polydata sheet = make_sphere(4, (double[3]){0.5, 0.1, 1e-5}, 0.25);
    for (size_t i = 3; i < 6; i++)
        CHECK_OK(ctx, tl_polydata_write(ctx, &sheet, in(folder, OTHERS[i])));
    make_triangles_release(&sheet);
}

static void write_scene(tl_ctx *ctx, const char *folder)
{
    tl_scene *scene = check_scene_full(ctx);
    const tl_camera camera = view_camera(scene);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set surface1.opacity 0.375"));
    CHECK_OK(ctx, tl_scene_write(ctx, scene, in(folder, "scene.json")));
    CHECK_OK(ctx, tl_cameras_write(ctx, in(folder, "cams.json"), &camera, 1));
    tl_scene_destroy(ctx, scene);
}

static void files_are_the_same(void **state)
{
    NEED_COMMAS(state);
    tl_ctx *ctx = check_ctx_create(2);
    tl_mesh *mesh = view_mesh(ctx, 4);
    bool same = true;
    use_points();
    write_files(ctx, mesh, "points");
    write_scene(ctx, "points");
    use_commas();
    write_files(ctx, mesh, "commas");
    write_scene(ctx, "commas");
    for (size_t i = 0; i < sizeof MESHES / sizeof *MESHES; i++) same &= same_file(MESHES[i]);
    for (size_t i = 0; i < sizeof OTHERS / sizeof *OTHERS; i++) same &= same_file(OTHERS[i]);
    CHECK(same);
    for (size_t i = 0; i < sizeof MESHES / sizeof *MESHES; i++) {
        tl_mesh *again = NULL;
        CHECK_OK(ctx, tl_mesh_read(ctx, in("points", MESHES[i]), NULL, &again, NULL));
        CHECK_EQ(tl_mesh_tet_count(again), tl_mesh_tet_count(mesh));
        CHECK(memcmp(tl_mesh_xyz(again), tl_mesh_xyz(mesh),
                     3 * tl_mesh_vert_count(mesh) * sizeof(double)) == 0);
        tl_mesh_destroy(again);
    }
    tl_scene *scene = NULL;
    CHECK_OK(ctx, tl_scene_read(ctx, in("points", "scene.json"), &scene));
    CHECK(tl_scene_real(scene, tl_scene_find(scene, "surface1"), "opacity") == 0.375);
    tl_scene_destroy(ctx, scene);
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
}

/* Numbers of an XDMF stand in attributes and between them. */
static void xdmf_is_read(void **state)
{
    static const char TEXT[] =
        "<?xml version='1.0'?><Xdmf Version='2.0'><Domain>\n"
        "<Grid GridType='Collection' CollectionType='Temporal'>\n"
        "<Grid><Time Value='1.5'/><Topology TopologyType='Tetrahedron' NumberOfElements='1'\n"
        "BaseOffset='1.0'><DataItem Dimensions='4' NumberType='Int'>1 2 3 4</DataItem></Topology>\n"
        "<Geometry GeometryType='XYZ'><DataItem Dimensions='12'>0.25 0 0 1.75 0 0 0 1.5e-1 0 0 0\n"
        ".5</DataItem></Geometry></Grid></Grid></Domain></Xdmf>\n";
    static const double XYZ[12] = {0.25, 0, 0, 1.75, 0, 0, 0, 0.15, 0, 0, 0, 0.5};
    tl_mesh *mesh = NULL;
    NEED_COMMAS(state);
    tl_ctx *ctx = check_ctx_create(1);
    use_commas();
    put_file("made.xdmf", TEXT, sizeof TEXT - 1);
    const tl_status st = tl_mesh_read(ctx, "made.xdmf", NULL, &mesh, NULL);
    if (st == TL_ERR_UNSUPPORTED) {
        check_ctx_destroy(ctx);
        CHECK_SKIP("built without expat");
    }
    CHECK_OK(ctx, st);
    CHECK_NEAR(tl_mesh_time(mesh), 1.5, 0);
    CHECK(memcmp(tl_mesh_xyz(mesh), XYZ, sizeof XYZ) == 0);
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
}

/* ---- words ---- */

/* What a picture of a source says, all in one text. */
static void gather(tl_ctx *ctx, tl_source *source, const tl_scene *scene, char words[1024])
{
    tl_tick ticks[TL_TICKS_MAX];
    tl_view *view = NULL;
    int exponent;
    size_t used = 0, count = tl_ticks(0, 1.25, 5, ticks, &exponent);
    for (size_t i = 0; i < count; i++)
        used += (size_t)snprintf(words + used, 1024 - used, "%s ", ticks[i].label);
    count = tl_ticks_log(0.05, 0.07, 5, ticks);
    for (size_t i = 0; i < count; i++)
        used += (size_t)snprintf(words + used, 1024 - used, "%s ", ticks[i].label);
    count = tl_ticks_log(0.01, 10, 5, ticks);
    for (size_t i = 0; i < count; i++)
        used += (size_t)snprintf(words + used, 1024 - used, "%s ", ticks[i].label);
    tl_ticks(0.5, 0.5, 5, ticks, &exponent);
    used += (size_t)snprintf(words + used, 1024 - used, "%s\n", ticks[0].label);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *content = view_build(ctx, view, scene);
    tl_content_note(content, words + used, 1024 - used);
    used = strlen(words);
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
    tl_fail(ctx, TL_ERR_DATA, "%g is not %.3f", 0.5, 1.25);
    snprintf(words + used, 1024 - used, "\n%s", tl_ctx_message(ctx));
    tl_ctx_clear(ctx);
}

static void write_page(tl_ctx *ctx, tl_source *source, const tl_scene *scene, const char *path)
{
    tl_view *view = NULL;
    tl_shown *shown = NULL;
    tl_image *image = NULL;
    const tl_camera camera = view_camera(scene);
    tl_renderer *renderer = picture_renderer(ctx);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
    tl_content *content = view_build(ctx, view, scene);
    CHECK_OK(ctx, tl_content_show(ctx, shown, content));
    CHECK_OK(ctx, tl_content_draw(ctx, shown, &camera, NULL, &image));
    CHECK_OK(ctx, tl_content_write(ctx, content, scene, &camera, image, path));
    tl_image_destroy(ctx, image);
    tl_shown_destroy(ctx, shown);
    tl_renderer_destroy(ctx, renderer);
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
}

static void words_are_the_same(void **state)
{
    static const char *const LINES[] = {
        "add surface channel=f value=0.5 opacity=0.75",
        "add transfer channel=f range_by=values range=\"0.125 0.9\"",
        "set picture.bar on",
        "set picture.axes on",
        "set picture.note on",
        "set detail.error 0.01",
        NULL};
    char words[2][1024];
    NEED_COMMAS(state);
    tl_ctx *ctx = check_ctx_create(1);
    for (int i = 0; i < 2; i++) {
        if (i)
            use_commas();
        else
            use_points();
        tl_source *source = view_model(ctx, 9);
        tl_scene *scene = view_scene(ctx, source, LINES);
        gather(ctx, source, scene, words[i]);
#if TETRALOD_WITH_PANGO
        write_page(ctx, source, scene, in(i ? "commas" : "points", "page.svg"));
        tl_image *image = view_picture(ctx, source, scene);
        CHECK_OK(ctx, tl_image_write_png(ctx, image, in(i ? "commas" : "points", "picture.png")));
        tl_image_destroy(ctx, image);
#else
        (void)write_page;
#endif
        tl_scene_destroy(ctx, scene);
        tl_source_destroy(source);
    }
    printf("%s\n", words[1]);
    assert_string_equal(words[1], words[0]);
    CHECK(!strchr(words[1], ',') == !strchr(words[0], ','));
    CHECK(strstr(words[1], "0.5 is not 1.250") != NULL);
#if TETRALOD_WITH_PANGO
    CHECK(same_file("page.svg"));
    CHECK(same_file("picture.png"));
#endif
    check_ctx_destroy(ctx);
}

/* The host's own numbers stay as they were. */
static void locale_of_the_host_stays(void **state)
{
    char text[32];
    NEED_COMMAS(state);
    use_commas();
    CHECK_EQ(tli_print(text, sizeof text, "%.2f", 0.25), 4);
    assert_string_equal(text, "0.25");
    snprintf(text, sizeof text, "%.2f", 0.25);
    assert_string_equal(text, "0,25");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(files_are_the_same),
        cmocka_unit_test(xdmf_is_read),
        cmocka_unit_test(words_are_the_same),
        cmocka_unit_test(locale_of_the_host_stays),
    };
    return cmocka_run_group_tests_name("base_locale", tests, make_commas, NULL);
}
