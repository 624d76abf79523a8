/* Surfaces and planes of models, made patch by patch, against those of the mesh of the whole cut;
 * what a moved camera costs; what is found at places of contents that have no mesh. */
#include "view/view.h"

#include "check_view.h"
#include "fail_alloc.h"

enum { SIDE = 14, LARGE_SIDE = 20, SETS = 3, SCENES = 10, PICKS = 40 };

/* What a scene needs a whole mesh for, and nothing else. */
static const char *const WHOLE[] = {"add derive text=\"h=f\"", NULL};

/* A model with the channels f and g. */
static tl_source *open_set(tl_ctx *ctx, int set)
{
    if (set == 0) return view_model(ctx, SIDE);
    make_mesh m = set == 1 ? make_grid_cavity(SIDE) : make_grid(SIDE);
    if (set == 2) make_perturb(&m, 0.02, 5);
    if (set == 2) make_shuffle(&m, 6);
    tl_mesh *mesh = make_object(ctx, &m, view_hill);
    double *g = malloc(m.vert_count * sizeof *g);
    if (!g) abort();
    for (size_t v = 0; v < m.vert_count; v++) g[v] = 1 + m.xyz[3 * v] * m.xyz[3 * v + 1];
    const tl_channel channel = {"g", "", 1, TL_ON_VERTEX, TL_F64, g};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    free(g);
    make_release(&m);
    return view_model_of(ctx, mesh);
}

/* ---- sets of triangles ---- */

/* Corners with their value, the least one first. */
typedef struct triangle {
    double corners[3][4];
} triangle;

static int by_bytes(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(triangle));
}

static triangle *take_triangles(const tli_thing *thing)
{
    const tl_polydata *p = thing->polydata;
    triangle *list = calloc(p->cell_count + 1, sizeof *list);
    if (!list) abort();
    for (size_t t = 0; t < p->cell_count; t++) {
        double corners[3][4] = {{0}};
        size_t first = 0;
        for (size_t i = 0; i < 3; i++) {
            const size_t v = p->corners[3 * t + i];
            memcpy(corners[i], p->xyz + 3 * v, 3 * sizeof(double));
            if (thing->look.scalar) corners[i][3] = thing->look.scalar[v];
            if (memcmp(corners[i], corners[first], sizeof corners[i]) < 0) first = i;
        }
        for (size_t i = 0; i < 3; i++)
            memcpy(list[t].corners[i], corners[(first + i) % 3], sizeof corners[i]);
    }
    qsort(list, p->cell_count, sizeof *list, by_bytes);
    return list;
}

/* The same triangles with the same values, to the bit. */
static void same_set(const tli_thing *a, const tli_thing *b)
{
    CHECK_EQ(a->polydata->cell_count, b->polydata->cell_count);
    CHECK_EQ(a->polydata->vert_count, b->polydata->vert_count);
    CHECK(!a->look.scalar == !b->look.scalar);
    triangle *one = take_triangles(a), *two = take_triangles(b);
    CHECK(!memcmp(one, two, a->polydata->cell_count * sizeof *one));
    free(two);
    free(one);
}

/* ---- scenes ---- */

static double between(uint64_t *seed, double low, double high)
{
    return low + (high - low) * make_uniform(seed);
}

static void say(tl_ctx *ctx, tl_scene *scene, const char *format, ...) TL_PRINTF(3, 4);
static void say(tl_ctx *ctx, tl_scene *scene, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, text));
}

/* Two surfaces and a plane, with colours of all kinds, glass and edges around, at a random error.
 */
static tl_scene *random_scene(tl_ctx *ctx, const tl_source *source, uint64_t *seed)
{
    static const char *const LINES[] = {"add boundary", "add edges", NULL};
    tl_scene *scene = view_scene(ctx, source, LINES);
    say(ctx, scene, "add surface channel=f value=%.17g", between(seed, 0.3, 0.95));
    say(ctx, scene, "add surface channel=g value=%.17g color_by=f opacity=0.5",
        between(seed, 1.1, 1.9));
    say(ctx, scene, "add slice plane=%.17g,0.5,0.5,%.17g,1,0.2 color_by=g", between(seed, 0.2, 0.8),
        between(seed, -1, 1));
    say(ctx, scene, "add transfer channel=g logarithmic=%s", make_random(seed) % 2 ? "on" : "off");
    say(ctx, scene, "view %.17g,%.17g", between(seed, 0, 360), between(seed, -60, 60));
    const double error = pow(10, between(seed, -1, 1));
    switch (make_random(seed) % 3) {
    case 0: say(ctx, scene, "set detail.error_px %.17g", error); break;
    case 1: say(ctx, scene, "set detail.errors %.17g%%", error); break;
    default: say(ctx, scene, "set detail.tets %.17g", floor(between(seed, 2000, 9000)));
    }
    return scene;
}

/* Whether a thing is made of triangles of the cut: the boundary comes first. */
static bool is_cut(const tl_content *content, size_t i)
{
    return content->things[i].kind == TLI_THING_TRIANGLES && i > 0;
}

static void equals_the_whole(void **state)
{
    (void)state;
    uint64_t seed = 17;
    size_t triangles = 0, whole_tets = 0;
    tl_ctx *ctx = check_ctx_create(2);
    for (int set = 0; set < SETS; set++) {
        tl_view *view = NULL, *other = NULL;
        tl_source *source = open_set(ctx, set);
        CHECK_OK(ctx, tl_view_create(ctx, source, &view));
        CHECK_OK(ctx, tl_view_create(ctx, source, &other));
        for (int i = 0; i < SCENES; i++) {
            tl_scene *scene = random_scene(ctx, source, &seed);
            tl_content *content = view_build(ctx, view, scene);
            check_scene_do(ctx, scene, WHOLE);
            tl_content *whole = view_build(ctx, other, scene);
            CHECK(content->places && !whole->places);
            CHECK_EQ(content->facts.tets, whole->facts.tets);
            CHECK_EQ(content->facts.patches, whole->facts.patches);
            CHECK_EQ(content->thing_count, whole->thing_count);
            for (size_t k = 0; k < content->thing_count; k++) {
                if (!is_cut(content, k)) continue;
                same_set(&content->things[k], &whole->things[k]);
                triangles += content->things[k].polydata->cell_count;
            }
            double pixels;
            const tl_camera camera = view_camera(scene);
            CHECK_OK(ctx, tl_content_error_px(ctx, content, &camera, &pixels));
            CHECK(pixels == content->facts.error_px && pixels >= view->hull->state.pixels);
            /* what stands around needs no more than its own error */
            CHECK(content->body && tl_mesh_tet_count(content->body->mesh) <= whole->facts.tets);
            whole_tets += whole->facts.tets - tl_mesh_tet_count(content->body->mesh);
            tl_content_destroy(ctx, whole);
            tl_content_destroy(ctx, content);
            tl_scene_destroy(ctx, scene);
        }
        tl_view_destroy(other);
        tl_view_destroy(view);
        tl_source_destroy(source);
    }
    printf("%zu triangles\n", triangles);
    CHECK(triangles > 10000 && whole_tets > 0);
    check_ctx_destroy(ctx);
}

/* ---- what a change costs ---- */

/* Patches of the view's cut that hold one of two values of the model's first channel are added to
 * *met, and known [patch count of the model] is set to them; returns how many were not among those
 * before. */
static size_t count_new(tl_ctx *ctx, const tl_view *view, const double values[2], uint8_t *known,
                        size_t *met)
{
    size_t count, fresh = 0;
    const uint32_t *patches = tl_cut_patches(view->cut, &count);
    const uint32_t patch_count = tl_store_get_head(view->source->store)->patch_count;
    uint8_t *now = calloc(patch_count, 1);
    if (!now) abort();
    for (size_t i = 0; i < count; i++) {
        tl_patch_info info;
        CHECK_OK(ctx, tl_store_patch(ctx, view->source->store, patches[i], &info));
        for (int k = 0; k < 2; k++)
            now[patches[i]] |=
                (double)info.ranges[0] <= values[k] && values[k] <= (double)info.ranges[1];
        fresh += now[patches[i]] && !known[patches[i]];
        *met += now[patches[i]];
    }
    memcpy(known, now, patch_count);
    free(now);
    return fresh;
}

/* A camera that moves decodes the patches that come, each once, also those of several surfaces, and
 * also where a coarser content comes between; another colour, opacity or light none. */
static void decodes_what_is_new(void **state)
{
    static const double VALUES[2] = {0.5, 0.52};
    static const char *const LINES[] = {
        "add surface channel=f value=0.5", "add surface channel=f value=0.52 color_by=f",
        "set detail.error_px 0.1", "set camera.view_angle 10", NULL};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = view_model(ctx, LARGE_SIDE);
    tl_scene *scene = view_scene(ctx, source, LINES);
    uint8_t *known = calloc(tl_store_get_head(source->store)->patch_count, 1);
    if (!known) abort();
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    size_t fresh = 0, met = 0, rounds = 0;
    for (int i = 0; i < 20; i++) {
        say(ctx, scene, "set camera.position 0.5,%g,0.5", -20 * pow(0.8, i));
        tl_content *content = view_build(ctx, view, scene), *coarse = NULL;
        CHECK_EQ(content->facts.decoded, count_new(ctx, view, VALUES, known, &met));
        fresh += content->facts.decoded;
        rounds += content->facts.decoded > 0;
        tl_content *same = view_build(ctx, view, scene);
        CHECK_EQ(same->facts.decoded, 0);
        for (int k = 0; k < 2; k++) CHECK(same->things[k].polydata == content->things[k].polydata);
        tl_content_destroy(ctx, same);
        const tl_camera camera = view_camera(scene);
        tl_view_limits limits = tl_view_limits_defaults();
        limits.tets_max = 2000;
        CHECK_OK(ctx, tl_view_build(ctx, view, scene, &camera, &limits, &coarse));
        CHECK(coarse->facts.tets <= 2000);
        tl_content_destroy(ctx, coarse);
        tl_content_destroy(ctx, content);
    }
    printf("%zu patches in 20 cuts, %zu decoded by %zu of them\n", met, fresh, rounds);
    CHECK(rounds > 4 && fresh < met / 2);
    free(known);
    tl_view_destroy(view);
    tl_scene_destroy(ctx, scene);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* What is kept is what the scene can go on with; it counts as memory of the content. */
static void keeps_what_is_shown(void **state)
{
    static const char *const LINES[] = {"add surface channel=f value=0.5",
                                        "add surface channel=f value=0.7", NULL};
    (void)state;
    tl_view *view = NULL;
    tl_ctx *ctx = check_ctx_create(1);
    tl_source *source = view_model(ctx, SIDE);
    tl_scene *scene = view_scene(ctx, source, LINES);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    const size_t before = tl_ctx_current_bytes(ctx);
    tl_content *content = view_build(ctx, view, scene);
    CHECK_EQ(view->strip_count, 2);
    const uint64_t two = tli_strips_bytes(view), held = tl_ctx_current_bytes(ctx) - before;
    printf("%llu bytes of %llu are told\n", (unsigned long long)content->facts.bytes,
           (unsigned long long)held);
    CHECK(content->facts.bytes > two && content->facts.bytes <= held);
    tl_content_destroy(ctx, content);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set surface2.visible off"));
    content = view_build(ctx, view, scene);
    CHECK_EQ(view->strip_count, 1);
    CHECK(tli_strips_bytes(view) < two);
    tl_content_destroy(ctx, content);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "add volume channel=f"));
    content = view_build(ctx, view, scene);
    CHECK(view->strip_count == 0 && !content->places && view->body);
    tl_content_destroy(ctx, content);
    CHECK_OK(ctx, tl_scene_do(ctx, scene, "set volume1.visible off"));
    content = view_build(ctx, view, scene);
    CHECK(view->strip_count == 1 && content->places && !view->body);
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
    tl_scene_destroy(ctx, scene);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* ---- places ---- */

static void same_probe(const tl_probe *a, const tl_probe *b)
{
    CHECK_EQ(a->is_inside, b->is_inside);
    CHECK_EQ(a->value_count, b->value_count);
    if (!a->is_inside) return;
    for (size_t c = 0; c < a->value_count; c++) {
        CHECK(strcmp(a->values[c].name, b->values[c].name) == 0);
        for (uint32_t k = 0; k < a->values[c].components; k++)
            CHECK_NEAR(a->values[c].values[k], b->values[c].values[k], 1e-9);
    }
    if (a->patch != b->patch) return; /* on a border */
    CHECK_EQ(a->level, b->level);
    for (size_t c = 0; c < a->value_count; c++) CHECK(a->values[c].error == b->values[c].error);
}

/* Under any pixel lies what lies there in the whole mesh; the source may have gone. */
static void finds_what_the_whole_has(void **state)
{
    static const char *const LINES[] = {"add surface channel=f value=0.6 opacity=0.4",
                                        "add slice plane=0.3,0.5,0.5,1,0.2,0 color_by=g",
                                        "set detail.errors 2%", NULL};
    /* the same, of a mesh with all that it needs */
    static const char *const POINTS[] = {"add points channel=g count=1", NULL};
    (void)state;
    uint64_t seed = 3;
    tl_view *view = NULL;
    size_t inside = 0, empty = 0;
    tl_ctx *ctx = check_ctx_create(1), *other = check_ctx_create(1);
    tl_source *source = view_model(ctx, SIDE);
    tl_scene *scene = view_scene(ctx, source, LINES);
    const tl_camera camera = view_camera(scene);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    tl_content *content = view_build(ctx, view, scene);
    check_scene_do(ctx, scene, POINTS);
    tl_content *whole = view_build(ctx, view, scene);
    CHECK(content->places && !whole->places);
    CHECK_EQ(content->facts.tets, whole->facts.tets);
    tl_view_destroy(view);
    tl_source_destroy(source);
    for (int i = 0; i < PICKS; i++) {
        double a[3], b[3];
        bool hit[2];
        tl_probe one, two;
        const double x = between(&seed, 0, VIEW_WIDTH), y = between(&seed, 0, VIEW_HEIGHT);
        CHECK_OK(other, tl_content_pick(other, content, &camera, x, y, NULL, a, &hit[0]));
        CHECK_OK(other, tl_content_pick(other, whole, &camera, x, y, NULL, b, &hit[1]));
        CHECK_EQ(hit[0], hit[1]);
        for (int k = 0; k < 3 && hit[0]; k++) CHECK_NEAR(a[k], b[k], 1e-9);
        for (int k = 0; k < 3; k++) a[k] = between(&seed, -0.1, 1.1);
        CHECK_OK(other, tl_content_probe(other, content, a, &one));
        CHECK_OK(other, tl_content_probe(other, whole, a, &two));
        same_probe(&one, &two);
        inside += one.is_inside;
        empty += !hit[0];
        tl_probe_release(other, &one);
        tl_probe_release(other, &two);
    }
    CHECK(inside > PICKS / 4 && inside < PICKS && empty > 0 && empty < PICKS);
    tl_content_destroy(ctx, whole);
    tl_content_destroy(ctx, content);
    tl_scene_destroy(ctx, scene);
    check_ctx_destroy(ctx);
    check_ctx_destroy(other);
}

/* ---- threads, and what fails ---- */

static void same_for_any_threads(void **state)
{
    (void)state;
    tl_image *images[2];
    tl_ctx *ctxs[2];
    for (unsigned i = 0; i < 2; i++) {
        uint64_t seed = 5;
        ctxs[i] = check_ctx_create(i + 1);
        tl_source *source = open_set(ctxs[i], 2);
        tl_scene *scene = random_scene(ctxs[i], source, &seed);
        images[i] = view_picture(ctxs[i], source, scene);
        tl_scene_destroy(ctxs[i], scene);
        tl_source_destroy(source);
    }
    CHECK(!memcmp(images[0]->rgba, images[1]->rgba, 4 * sizeof(float) * VIEW_WIDTH * VIEW_HEIGHT));
    for (unsigned i = 0; i < 2; i++) {
        tl_image_destroy(ctxs[i], images[i]);
        check_ctx_destroy(ctxs[i]);
    }
}

typedef struct job {
    const tl_scene *scene;
    const char *path;
} job;

/* A content, once more for a camera beside, and what is there. */
static tl_status make_all(tl_ctx *ctx, void *arg)
{
    const job *j = arg;
    static const double MIDDLE[3] = {0.5, 0.5, 0.5};
    tl_view *view = NULL;
    tl_source *source = NULL;
    tl_content *content = NULL;
    tl_probe probe = {0};
    double xyz[3];
    bool is_hit;
    tl_camera camera = view_camera(j->scene);
    tl_status st = tl_source_open(ctx, j->path, &source);
    if (!st) st = tl_view_create(ctx, source, &view);
    for (int i = 0; !st && i < 2; i++) {
        tl_content_destroy(ctx, content);
        content = NULL;
        camera.position[0] += i;
        st = tl_view_build(ctx, view, j->scene, &camera, NULL, &content);
    }
    if (!st) st = tl_content_pick(ctx, content, &camera, 1, 1, NULL, xyz, &is_hit);
    if (!st) st = tl_content_probe(ctx, content, MIDDLE, &probe);
    tl_probe_release(ctx, &probe);
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
    tl_source_destroy(source);
    return st;
}

static void every_allocation(void **state)
{
    static const char *const LINES[] = {"add surface channel=f value=0.5 color_by=g",
                                        "add boundary", "set detail.errors 20%", NULL};
    (void)state;
    fail_alloc f;
    tl_build_result result;
    tl_ctx *ctx = check_ctx_create(1);
    tl_mesh *mesh = view_mesh(ctx, 6);
    const char *path = check_model_path("patches");
    const tl_build_opts opts = check_model_opts(400, 100);
    CHECK_OK(ctx, tl_model_build_mesh(ctx, mesh, path, &opts, &result));
    tl_build_release(ctx, &result);
    tl_source *source = NULL;
    CHECK_OK(ctx, tl_source_open(ctx, path, &source));
    tl_scene *scene = view_scene(ctx, source, LINES);
    job j = {scene, path};
    fail_alloc_open(&f, 1);
    const long count = fail_alloc_each(&f, make_all, &j);
    printf("%ld allocations\n", count);
    CHECK(count > 300);
    fail_alloc_close(&f);
    tl_scene_destroy(ctx, scene);
    tl_source_destroy(source);
    tl_mesh_destroy(mesh);
    CHECK_EQ(remove(path), 0);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equals_the_whole),     cmocka_unit_test(decodes_what_is_new),
        cmocka_unit_test(keeps_what_is_shown),  cmocka_unit_test(finds_what_the_whole_has),
        cmocka_unit_test(same_for_any_threads), cmocka_unit_test(every_allocation)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
