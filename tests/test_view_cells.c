/* Channels on tets are drawn as they are: on boundaries, planes, what planes cut off and surfaces
 * each triangle has the value of its tet, by both renderers. */
#include "check.h"

#include "view/view.h"

#include "check_view.h"

/* Labels of the tets, in turns: no mean of several is one of them. */
static const double LABELS[] = {1, 2, 4};
enum { LABEL_COUNT = 3, SIDE = 6 };

static tl_source *labels_source(tl_ctx *ctx)
{
    tl_source *source = NULL;
    tl_mesh *mesh = view_mesh(ctx, SIDE);
    const size_t count = tl_mesh_tet_count(mesh);
    double *labels = malloc(count * sizeof *labels);
    if (!labels) abort();
    for (size_t t = 0; t < count; t++) labels[t] = LABELS[tli_mix_bits(t) % LABEL_COUNT];
    const tl_channel channel = {"label", "", 1, TL_ON_TET, TL_I32, labels};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    free(labels);
    CHECK_OK(ctx, tl_source_create(ctx, mesh, "labels", &source));
    return source;
}

/* Whether a pixel has the colour of a value, with the light that comes back from a surface that
 * looks at the camera. */
static bool has_color(const tl_values *values, double value, const float *pixel, float shine)
{
    float rgb[3];
    double extinction;
    bool same = true;
    tl_transfer_at(values->transfer, value, rgb, &extinction);
    for (int k = 0; k < 3; k++) same &= fabsf(fminf(rgb[k] + shine, 1) - pixel[k]) < 0.006f;
    return same;
}

static const struct {
    const char *thing, *more;
    float shine;
} SHOWN[] = {{"add boundary color_by=label", "", 0.05f},
             {"add boundary color_by=label", "add clip plane=0.5,0.43,0.5,0,-1,0", 0.05f},
             {"add slice plane=y color_by=label", "", 0},
             {"add slice plane=0.5,0.43,0.5,0,1,0 color_by=label", "", 0},
             {"add slice plane=0.5,0.43,0.5,0,1,0 color_by=label*3-2*label", "", 0}};

static void colours_are_those_of_tets(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = labels_source(ctx);
    for (int gl = 0; gl < 2; gl++)
        for (size_t i = 0; i < sizeof SHOWN / sizeof *SHOWN; i++) {
            size_t counts[LABEL_COUNT] = {0}, others = 0;
            tl_renderer *renderer = NULL;
            tl_view *view = NULL;
            tl_shown *shown = NULL;
            tl_image *image = NULL;
            if (tl_renderer_create(ctx, gl ? TL_RENDERER_GL : TL_RENDERER_CPU, &renderer)) {
                CHECK(gl);
                continue;
            }
            tl_scene *scene = view_scene(
                ctx, source,
                (const char *[]){"add transfer channel=label range_by=data",
                                 "set camera.position 0.5 -4 0.5",
                                 "set camera.focal_point 0.5 0.5 0.5", "set camera.parallel on",
                                 "set camera.parallel_scale 0.6", SHOWN[i].thing, NULL});
            if (*SHOWN[i].more) check_scene_do(ctx, scene, (const char *[]){SHOWN[i].more, NULL});
            CHECK_OK(ctx, tl_view_create(ctx, source, &view));
            CHECK_OK(ctx, tl_shown_create(ctx, renderer, &shown));
            tl_content *content = view_build(ctx, view, scene);
            const tl_camera camera = view_camera(scene);
            CHECK_OK(ctx, tl_content_show(ctx, shown, content));
            CHECK_OK(ctx, tl_content_draw(ctx, shown, &camera, NULL, &image));
            const tl_values *values = content->values[0];
            for (size_t p = 0; p < (size_t)image->width * image->height; p++) {
                const float *pixel = image->rgba + 4 * p;
                size_t label = 0;
                if (pixel[3] < 1) continue;
                while (label < LABEL_COUNT &&
                       !has_color(values, LABELS[label], pixel, SHOWN[i].shine))
                    label++;
                if (label < LABEL_COUNT)
                    counts[label]++;
                else
                    others++;
            }
            CHECK_EQ(others, 0);
            for (size_t label = 0; label < LABEL_COUNT; label++) CHECK(counts[label] > 50);
            tl_image_destroy(ctx, image);
            tl_shown_destroy(ctx, shown);
            tl_content_destroy(ctx, content);
            tl_view_destroy(view);
            tl_renderer_destroy(ctx, renderer);
            tl_scene_destroy(ctx, scene);
        }
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* A plane with values of tets has the triangles of one without, and beside them the values of
 * vertices as they were. */
static void slices_of_both(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_mesh *mesh = view_mesh(ctx, SIDE);
    tl_polydata *shared = NULL, *own = NULL;
    const double value = 0.41;
    const size_t count = tl_mesh_vert_count(mesh), channels[] = {0, 3};
    double *scalar = malloc(count * sizeof *scalar),
           *gradients = malloc(3 * count * sizeof *scalar);
    if (!scalar || !gradients) abort();
    for (size_t v = 0; v < count; v++) scalar[v] = tl_mesh_xyz(mesh)[3 * v];
    for (size_t i = 0; i < 3 * count; i++) gradients[i] = i % 3 == 0;
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = &value;
    opts.value_count = 1;
    opts.gradients = gradients;
    opts.channels = channels;
    opts.channel_count = 1;
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, scalar, &opts, &shared));
    opts.channel_count = 2;
    CHECK_OK(ctx, tl_slice_mesh(ctx, mesh, scalar, &opts, &own));
    CHECK(shared->cell_count > 50);
    CHECK_EQ(own->cell_count, shared->cell_count);
    CHECK_EQ(own->vert_count, 3 * own->cell_count);
    const tl_channel *cells = &own->channels[1];
    CHECK(cells->on == TL_ON_VERTEX && strcmp(cells->name, "c") == 0);
    for (size_t i = 0; i < own->vert_count; i++) {
        const size_t v = shared->corners[i];
        CHECK_EQ(own->corners[i], i);
        CHECK_EQ(memcmp(own->xyz + 3 * i, shared->xyz + 3 * v, 3 * sizeof *own->xyz), 0);
        CHECK_EQ(memcmp(own->normals + 3 * i, shared->normals + 3 * v, 3 * sizeof *own->normals),
                 0);
        CHECK(own->channels[0].values[i] == shared->channels[0].values[v]);
        CHECK(cells->values[i] == cells->values[i / 3 * 3]);
        /* x of the first corner, and the cells are 0.2 wide */
        CHECK(fabs(cells->values[i] - value) <= 1.0 / (SIDE - 1) + 1e-9);
    }
    tl_polydata_destroy(ctx, own);
    tl_polydata_destroy(ctx, shared);
    free(gradients);
    free(scalar);
    tl_mesh_destroy(mesh);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(colours_are_those_of_tets),
                                       cmocka_unit_test(slices_of_both)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
