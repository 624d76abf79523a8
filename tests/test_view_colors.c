/* Automatic colours and opacities follow from all of the data: known distributions by brute force,
 * and the same to the byte whatever is clipped, chosen, near or coarse. */
#include <float.h>
#include <stdlib.h>

#include "check.h"

#include "view/view.h"

#include "check_view.h"
#include "make_series.h"

/* The cube as a mesh and as a model of more tets than a look has. */
enum { SIDE = 40, MODEL_SIDE = 32 };
/* Samples of the unit cube along an edge. */
enum { FINE = 100 };

typedef struct stand {
    tl_ctx *ctx;
    tl_source *sources[2];
} stand;

static int set_up(void **state)
{
    static stand s;
    s.ctx = check_ctx_create(2);
    s.sources[0] = view_source(s.ctx, SIDE);
    s.sources[1] = view_model(s.ctx, MODEL_SIDE);
    *state = &s;
    return 0;
}

static int tear_down(void **state)
{
    stand *s = *state;
    for (int i = 0; i < 2; i++) tl_source_destroy(s->sources[i]);
    check_ctx_destroy(s->ctx);
    return 0;
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Values of the hill, rising, of places evenly in the cube: free. */
static double *hill_values(void)
{
    double *values = malloc(sizeof *values * FINE * FINE * FINE), *to = values;
    if (!values) abort();
    for (int i = 0; i < FINE; i++)
        for (int j = 0; j < FINE; j++)
            for (int k = 0; k < FINE; k++)
                *to++ = view_hill(
                    (const double[]){(i + 0.5) / FINE, (j + 0.5) / FINE, (k + 0.5) / FINE});
    qsort(values, (size_t)(to - values), sizeof *values, by_value);
    return values;
}

static const tl_values *values_of(tl_ctx *ctx, tl_view *view, const tl_scene *scene,
                                  const char *channel)
{
    const tl_values *values = NULL;
    CHECK_OK(ctx, tl_view_values(ctx, view, scene, channel, &values));
    return values;
}

/* Sets range_by of the one transfer node to a percentile, and returns the value there. */
static double percentile(tl_ctx *ctx, tl_view *view, tl_scene *scene, const char *channel,
                         double percent)
{
    char line[96];
    snprintf(line, sizeof line, "set transfer1.percent %.17g %.17g", percent, percent);
    check_scene_do(ctx, scene, (const char *[]){line, NULL});
    return values_of(ctx, view, scene, channel)->range[0];
}

/* ---- the distribution ---- */

static const double PERCENT[] = {0.1, 1, 5, 25, 50, 75, 95, 99, 99.9};
enum { PERCENT_COUNT = sizeof PERCENT / sizeof *PERCENT };
/* Parts of the range: spots stand for a part of 2^-16 each, and tets are linear. */
static const double MESH_ERROR = 0.004, MODEL_ERROR = 0.008;

static void ranks_of_known_fields(void **state)
{
    const stand *s = *state;
    tl_ctx *ctx = s->ctx;
    double *hill = hill_values();
    for (int is_model = 0; is_model < 2; is_model++) {
        tl_view *view = NULL;
        double hill_error = 0, slope_error = 0;
        tl_source *source = s->sources[is_model];
        CHECK_OK(ctx, tl_view_create(ctx, source, &view));
        tl_scene *scene = view_scene(
            ctx, source, (const char *[]){"add transfer channel=f range_by=percent", NULL});
        for (int i = 0; i < PERCENT_COUNT; i++) {
            const size_t rank = (size_t)(PERCENT[i] / 100 * FINE * FINE * FINE);
            const double value = percentile(ctx, view, scene, "f", PERCENT[i]);
            hill_error = fmax(hill_error, fabs(value - hill[rank]));
        }
        /* 100^x: even on a logarithmic scale */
        check_scene_do(
            ctx, scene,
            (const char *[]){"set transfer1.channel g", "set transfer1.logarithmic on", NULL});
        for (int i = 0; i < PERCENT_COUNT; i++) {
            const double value = percentile(ctx, view, scene, "g", PERCENT[i]);
            slope_error = fmax(slope_error, fabs(log10(value) / 2 - PERCENT[i] / 100));
        }
        const double error = is_model ? MODEL_ERROR : MESH_ERROR;
        CHECK_BOUND("percentiles of a hill", hill_error, error);
        CHECK_BOUND("percentiles of a slope", slope_error, error);
        tl_scene_destroy(ctx, scene);
        tl_view_destroy(view);
    }
    free(hill);
}

/* Opacity of the unit layer at a value. */
static double opacity_at(const tl_values *values, double value)
{
    size_t i = 0;
    const tl_opacity_point *p = values->opacities;
    while (i + 1 < values->opacity_count && p[i + 1].value < value) i++;
    if (value <= p[0].value || i + 1 == values->opacity_count) return p[i].opacity;
    const double at = (value - p[i].value) / (p[i + 1].value - p[i].value);
    return p[i].opacity + at * (p[i + 1].opacity - p[i].opacity);
}

/* Automatic opacities are about the same of a mesh and of its model, whose look has other values:
 * they do not hang on chance. */
static void opacities_of_mesh_and_model(void **state)
{
    static const char *const CHANNELS[] = {"f", "g", "c", "u"};
    const stand *s = *state;
    tl_ctx *ctx = s->ctx;
    tl_view *views[2] = {NULL, NULL};
    tl_scene *scene = view_scene(ctx, s->sources[0], (const char *[]){NULL});
    for (int i = 0; i < 2; i++) CHECK_OK(ctx, tl_view_create(ctx, s->sources[i], &views[i]));
    for (size_t c = 0; c < sizeof CHANNELS / sizeof *CHANNELS; c++) {
        double difference = 0;
        const tl_values *mesh = values_of(ctx, views[0], scene, CHANNELS[c]);
        const tl_values *model = values_of(ctx, views[1], scene, CHANNELS[c]);
        for (int i = 0; i <= 100; i++) {
            const double at = mesh->range[0] + i / 100.0 * (mesh->range[1] - mesh->range[0]);
            difference = fmax(difference, fabs(opacity_at(mesh, at) - opacity_at(model, at)));
        }
        CHECK_BOUND(CHANNELS[c], difference, 0.03);
    }
    for (int i = 0; i < 2; i++) tl_view_destroy(views[i]);
    tl_scene_destroy(ctx, scene);
}

/* Spots stand evenly in the volume, however the tets divide it. */
static void spots_by_volume(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = view_source(ctx, 9);
    tli_body *look;
    CHECK_OK(ctx, tli_source_look(ctx, source, -1, &look));
    const size_t tets = tl_mesh_tet_count(look->mesh);
    size_t at = 0;
    double whole = 0, worst = 0;
    for (size_t t = 0; t < tets; t++) whole += tli_volume_at(look->mesh, t);
    CHECK_NEAR(whole, 1, 1e-12);
    for (size_t t = 0; t < tets; t++) {
        size_t count = 0;
        for (; at < look->spot_count && look->spots[at] == t; at++) count++;
        const double due = tli_volume_at(look->mesh, t) * (double)look->spot_count;
        worst = fmax(worst, fabs((double)count - due));
    }
    CHECK_EQ(at, look->spot_count);
    CHECK_BOUND("spots of a tet beside those that are due", worst, 1 + 1e-6);
    tli_body_release(look);
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* Extremes are those of the original, though no mesh of a cut may have them. */
static void extremes_of_the_original(void **state)
{
    const stand *s = *state;
    tl_ctx *ctx = s->ctx;
    tl_view *view = NULL;
    tl_source *source = s->sources[1];
    const tl_source_facts *data = tl_source_get_facts(source);
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    for (size_t c = 0; c < data->channel_count; c++) {
        char line[96];
        snprintf(line, sizeof line, "add transfer channel=%s range_by=data",
                 data->channels[c].name);
        tl_scene *scene = view_scene(ctx, source, (const char *[]){line, NULL});
        const tl_values *values = values_of(ctx, view, scene, data->channels[c].name);
        for (int i = 0; i < 2; i++) CHECK(values->range[i] == data->channels[c].range[i]);
        CHECK(values->least == values->range[0] && values->most == values->range[1]);
        tl_scene_destroy(ctx, scene);
    }
    tl_view_destroy(view);
}

/* ---- symmetric ranges ---- */

/* The middle of a diverging map is 0 where values lie on both sides, or the value that is asked
 * for; a range by hand and a logarithmic scale stay. */
static void ranges_about_a_value(void **state)
{
    static const struct {
        const char *formula, *words;
        double low, high;
    } CASES[] = {
        {"4*g/99-4/99-1", "range_by=data map=cool-to-warm", -3, 3}, /* from -1 to 3 */
        {"4*g/99-4/99-1", "map=cool-to-warm", -3, 3},
        {"4*g/99-4/99-1", "range_by=data map=cool-to-warm reversed=on", -3, 3},
        {"4*g/99-4/99-1", "range_by=data map=cool-to-warm symmetric=off", -1, 3},
        {"4*g/99-4/99-1", "range_by=data", -1, 3},
        {"4*g/99-4/99-1", "range_by=data symmetric=on", -3, 3},
        {"4*g/99-4/99-1", "range_by=data map=cool-to-warm center=2", -1, 5},
        {"4*g/99-4/99-1", "range_by=data map=cool-to-warm center=4", -1, 3}, /* none above it */
        {"4*g/99-4/99-1", "range_by=data symmetric=on center=4", -1, 9},
        {"4*g/99-4/99-1", "range_by=percent percent=0,100 map=cool-to-warm", -1, 3},
        {"4*g/99-4/99-1", "range_by=values range=-1,2 map=cool-to-warm symmetric=on", -1, 2},
        {"g-2", "range_by=data map=cool-to-warm", -1, 98}, /* hardly any below */
        {"g", "range_by=data map=cool-to-warm logarithmic=on center=10 symmetric=on", 1, 100},
        {"1-g", "range_by=data map=cool-to-warm", -99, 0},
        {"(g-50.5)/49.5*1.7e308", "range_by=data symmetric=on center=1e308", -1.7e308, DBL_MAX},
        {"g*0", "map=cool-to-warm symmetric=on", 0, 0},
        {"g*0+2", "map=cool-to-warm", 2, 2},
        {"g*0+2", "map=cool-to-warm symmetric=on", -2, 2}};
    const stand *s = *state;
    tl_ctx *ctx = s->ctx;
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        char derive[96], transfer[128];
        tl_view *view = NULL;
        snprintf(derive, sizeof derive, "add derive text=\"h=%s\"", CASES[i].formula);
        snprintf(transfer, sizeof transfer, "add transfer channel=h %s", CASES[i].words);
        tl_scene *scene = view_scene(ctx, s->sources[0], (const char *[]){derive, transfer, NULL});
        CHECK_OK(ctx, tl_view_create(ctx, s->sources[0], &view));
        const tl_values *values = values_of(ctx, view, scene, "h");
        const double size = fmax(fabs(CASES[i].low), fabs(CASES[i].high));
        CHECK_NEAR(values->range[0] / fmax(size, 1), CASES[i].low / fmax(size, 1), 1e-6);
        CHECK_NEAR(values->range[1] / fmax(size, 1), CASES[i].high / fmax(size, 1), 1e-6);
        tl_view_destroy(view);
        tl_scene_destroy(ctx, scene);
    }
}

/* One value has the colour of a map's middle: neither cold nor warm. */
static void one_value(void **state)
{
    const stand *s = *state;
    tl_ctx *ctx = s->ctx;
    tl_view *view = NULL;
    float rgb[3];
    double extinction;
    tl_scene *scene = view_scene(ctx, s->sources[0],
                                 (const char *[]){"add derive text=h=7+0*f",
                                                  "add transfer channel=h map=cool-to-warm", NULL});
    CHECK_OK(ctx, tl_view_create(ctx, s->sources[0], &view));
    tl_transfer_at(values_of(ctx, view, scene, "h")->transfer, 7, rgb, &extinction);
    for (int k = 0; k < 3; k++) CHECK_NEAR((double)rgb[k], 0.865, 1e-3);
    tl_view_destroy(view);
    tl_scene_destroy(ctx, scene);
}

/* ---- the same colours ---- */

static bool is_same(const tl_values *a, const tl_values *b)
{
    bool same = a->least == b->least && a->most == b->most &&
                memcmp(a->range, b->range, sizeof a->range) == 0 &&
                a->color_count == b->color_count && a->opacity_count == b->opacity_count &&
                memcmp(a->colors, b->colors, a->color_count * sizeof *a->colors) == 0 &&
                memcmp(a->opacities, b->opacities, a->opacity_count * sizeof *a->opacities) == 0;
    for (int i = 0; same && i <= 64; i++) {
        float rgb[2][3];
        double extinction[2];
        const double at = a->shown_range[0] + i / 64.0 * (a->shown_range[1] - a->shown_range[0]);
        tl_transfer_at(a->transfer, at, rgb[0], &extinction[0]);
        tl_transfer_at(b->transfer, at, rgb[1], &extinction[1]);
        same = memcmp(rgb[0], rgb[1], sizeof rgb[0]) == 0 && extinction[0] == extinction[1];
    }
    return same;
}

static const char *const COLORED[] = {"add derive text=h=f*g",
                                      "add transfer channel=f",
                                      "add transfer channel=g logarithmic=on",
                                      "add transfer channel=c range_by=data",
                                      "add transfer channel=h range_by=percent",
                                      "add volume channel=f",
                                      "add slice plane=x color_by=h",
                                      "add slice plane=y color_by=g",
                                      "add slice plane=z color_by=c",
                                      "add surface channel=f value=0.6 color_by=mag(u)*2",
                                      NULL};
static const char *const SHOWN[] = {"f", "g", "c", "h", "mag(u)*2"};
/* What chooses a part, comes near, or makes it coarser. */
static const char *const CHANGES[] = {"add clip plane=x=40%",
                                      "set clip1.plane 0.5,0.5,0.7,1,2,3",
                                      "add threshold channel=f low=0.5",
                                      "set data.regions 1",
                                      "set data.hide_regions 1",
                                      "view 80,40,5",
                                      "set detail.error_px 20",
                                      "set detail.tets 3000",
                                      "undo",
                                      "set data.hide_regions \"\"",
                                      "set data.regions \"\"",
                                      "remove clip1"};

static void colours_stay(void **state)
{
    const stand *s = *state;
    tl_ctx *ctx = s->ctx;
    for (int is_model = 0; is_model < 2; is_model++) {
        tl_view *view = NULL, *other = NULL;
        tl_source *source = s->sources[is_model];
        tl_scene *scene = view_scene(ctx, source, COLORED);
        tl_view_limits limits = tl_view_limits_defaults();
        CHECK_OK(ctx, tl_view_create(ctx, source, &view));
        CHECK_OK(ctx, tl_view_create(ctx, source, &other));
        tl_content *first = view_build(ctx, view, scene);
        for (size_t i = 0; i < sizeof CHANGES / sizeof *CHANGES; i++) {
            tl_content *content = NULL;
            if (strstr(CHANGES[i], "hide")) /* all of them would be hidden */
                check_scene_do(ctx, scene, (const char *[]){"set data.regions \"\"", NULL});
            check_scene_do(ctx, scene, (const char *[]){CHANGES[i], NULL});
            limits.tets_max = i % 2 ? 2000 : UINT64_MAX; /* while it moves, and at rest */
            tl_camera camera = view_camera(scene);
            camera.size_px[0] <<= i % 3;
            CHECK_OK(ctx,
                     tl_view_build(ctx, i % 4 ? view : other, scene, &camera, &limits, &content));
            for (size_t c = 0; c < sizeof SHOWN / sizeof *SHOWN; c++)
                if (!is_same(tl_content_values(first, SHOWN[c]),
                             tl_content_values(content, SHOWN[c])))
                    fail_msg("'%s' has other colours after '%s'", SHOWN[c], CHANGES[i]);
            tl_content_destroy(ctx, content);
        }
        tl_content_destroy(ctx, first);
        tl_view_destroy(other);
        tl_view_destroy(view);
        tl_scene_destroy(ctx, scene);
    }
}

/* ---- series ---- */

/* More steps than a survey looks at. */
enum { STEPS = 11, STEP_SIDE = 9 };

static tl_source *series_source(tl_ctx *ctx)
{
    unsigned numbers[STEPS];
    tl_step steps[STEPS] = {0};
    static char paths[STEPS][200];
    tl_build_result result;
    tl_source *source = NULL;
    const tl_build_opts opts = check_model_opts(2000, 200);
    const char *path = check_model_path("series");
    for (unsigned i = 0; i < STEPS; i++) numbers[i] = i;
    series_write("view_colors", STEP_SIDE, numbers, STEPS);
    for (unsigned i = 0; i < STEPS; i++) {
        snprintf(paths[i], sizeof paths[i], "%s", series_path("view_colors", i));
        steps[i] = (tl_step){.path = paths[i], .number = i};
    }
    CHECK_OK(ctx, tl_model_build_series(ctx, steps, STEPS, NULL, path, &opts, &result));
    tl_build_release(ctx, &result);
    for (unsigned i = 0; i < STEPS; i++) CHECK_EQ(remove(paths[i]), 0);
    CHECK_OK(ctx, tl_source_open(ctx, path, &source));
    CHECK_EQ(remove(path), 0);
    return source;
}

static tl_content *build_step(tl_ctx *ctx, tl_view *view, tl_scene *scene, unsigned step)
{
    CHECK_OK(ctx, tl_scene_set_real(ctx, scene, TL_NODE_DATA + 1, "step", step));
    return view_build(ctx, view, scene);
}

/* Scalar bars, axes and box without what is drawn. */
static tl_image *words_of(tl_ctx *ctx, const tl_content *content, const tl_scene *scene)
{
    tl_image *image = NULL;
    tl_camera camera = view_camera(scene);
    camera.size_px[0] = 400;
    camera.size_px[1] = 300;
    CHECK_OK(ctx, tl_image_create(ctx, 400, 300, &image));
    CHECK_OK(ctx, tl_content_annotate(ctx, content, scene, &camera, image));
    return image;
}

/* A series has one scale, whichever step is shown and came first, and a histogram one range. */
static void series_have_one_scale(void **state)
{
    static const char *const LINES[] = {"set picture.note off",
                                        "add derive text=h=T*T",
                                        "add transfer channel=T range_by=data",
                                        "add transfer channel=T+1 logarithmic=on",
                                        "add transfer channel=h",
                                        "add volume channel=h",
                                        "add slice plane=x color_by=T",
                                        "add slice plane=y color_by=T+1",
                                        NULL};
    static const char *const CHANNELS[] = {"T", "h", "T+1"};
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = series_source(ctx);
    const double *range = tl_source_get_facts(source)->channels[0].range;
    tl_scene *scene = view_scene(ctx, source, LINES);
    tl_view *view = NULL, *other = NULL;
    CHECK_OK(ctx, tl_view_create(ctx, source, &view));
    CHECK_OK(ctx, tl_view_create(ctx, source, &other));
    tl_content *first = build_step(ctx, view, scene, 0);
    tl_image *words = words_of(ctx, first, scene);
    for (int i = 0; i < 2; i++) CHECK(tl_content_values(first, "T")->range[i] == range[i]);
    for (unsigned step = STEPS - 1; step; step--) {
        double bins[8], ends[2];
        tl_content *content = build_step(ctx, step % 2 ? view : other, scene, step);
        for (size_t c = 0; c < sizeof CHANNELS / sizeof *CHANNELS; c++)
            if (!is_same(tl_content_values(first, CHANNELS[c]),
                         tl_content_values(content, CHANNELS[c])))
                fail_msg("'%s' has other colours at step %u", CHANNELS[c], step);
        tl_image *own = words_of(ctx, content, scene);
        CHECK(picture_same(words, own));
        CHECK_OK(ctx, tl_source_histogram(ctx, source, scene, "T", false, bins, 8, ends));
        CHECK(ends[0] == range[0] && ends[1] == range[1]);
        tl_image_destroy(ctx, own);
        tl_content_destroy(ctx, content);
    }
    tl_image_destroy(ctx, words);
    tl_view_destroy(other);
    view_close(ctx, first, view, scene, source);
}

/* The picture of a scene seen along y, x to the right. */
static tl_image *picture(tl_ctx *ctx, tl_source *source, const char *const *lines,
                         const char *const *more)
{
    static const char *const CAMERA[] = {"set camera.position 0.5 -4 0.5",
                                         "set camera.focal_point 0.5 0.5 0.5",
                                         "set camera.parallel on",
                                         "set camera.parallel_scale 0.6",
                                         "set picture.bar off",
                                         "set picture.axes off",
                                         "set picture.box off",
                                         "set picture.note off",
                                         NULL};
    tl_scene *scene = view_scene(ctx, source, CAMERA);
    check_scene_do(ctx, scene, lines);
    check_scene_do(ctx, scene, more);
    tl_image *image = view_picture(ctx, source, scene);
    tl_scene_destroy(ctx, scene);
    return image;
}

/* A plane at x = 0.5 cuts off the right half, where the steepest gradients of h and its largest
 * values are: the left half stays to the byte. */
static void pixels_beside_a_cut(void **state)
{
    static const char *const THINGS[][3] = {
        {"add boundary color_by=h", NULL},
        {"add volume channel=h", NULL},
        {"add volume channel=h gradient_opacity=5 gradient_percent=on", NULL}};
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_source *source = view_source(ctx, 9); /* vertices at x = 0.5 */
    for (size_t i = 0; i < sizeof THINGS / sizeof *THINGS; i++) {
        size_t equal = 0, seen = 0;
        const char *const lines[] = {"add derive text=h=g*f", THINGS[i][0], NULL};
        tl_image *whole = picture(ctx, source, lines, (const char *[]){NULL});
        tl_image *half =
            picture(ctx, source, lines, (const char *[]){"add clip plane=x=50%", NULL});
        for (size_t y = 0; y < whole->height; y++)
            for (size_t x = 0; x < whole->width / 2 - 1; x++) {
                const float *a = picture_pixel(whole, x, y), *b = picture_pixel(half, x, y);
                seen += a[3] > 0;
                equal += memcmp(a, b, 4 * sizeof *a) == 0;
            }
        CHECK(seen > 200);
        CHECK_EQ(equal, whole->height * (size_t)(whole->width / 2 - 1));
        CHECK(picture_opacity(half, whole->width - 15, whole->height / 2) <
              picture_opacity(whole, whole->width - 15, whole->height / 2));
        tl_image_destroy(ctx, half);
        tl_image_destroy(ctx, whole);
    }
    tl_source_destroy(source);
    check_ctx_destroy(ctx);
}

/* ---- histograms ---- */

static void histograms_of_all(void **state)
{
    enum { BINS = 32 };
    static const char *const PART[] = {"add clip plane=x=20%", "add threshold channel=f low=0.7",
                                       "set data.regions 1", NULL};
    static const char *const CHANNELS[] = {"f", "h", "f+1"};
    const stand *s = *state;
    tl_ctx *ctx = s->ctx;
    for (int is_model = 0; is_model < 2; is_model++) {
        tl_source *source = s->sources[is_model];
        tl_scene *scene =
            view_scene(ctx, source, (const char *[]){"add derive text=h=log10(g)", NULL});
        for (size_t c = 0; c < sizeof CHANNELS / sizeof *CHANNELS; c++) {
            double whole[BINS], part[BINS], range[2][2], sum = 0;
            tl_scene *chosen = NULL;
            CHECK_OK(ctx, tl_scene_copy(ctx, scene, &chosen));
            check_scene_do(ctx, chosen, PART);
            CHECK_OK(ctx, tl_source_histogram(ctx, source, scene, CHANNELS[c], false, whole, BINS,
                                              range[0]));
            CHECK_OK(ctx, tl_source_histogram(ctx, source, chosen, CHANNELS[c], false, part, BINS,
                                              range[1]));
            CHECK_EQ(memcmp(whole, part, sizeof whole), 0);
            CHECK_EQ(memcmp(range[0], range[1], sizeof range[0]), 0);
            for (int i = 0; i < BINS; i++) sum += whole[i];
            CHECK_NEAR(sum, 1, 1e-12);
            for (int i = 0; i < BINS && c == 1 && !is_model; i++)
                CHECK_NEAR(whole[i], 1.0 / BINS, 0.1 / BINS);
            tl_scene_destroy(ctx, chosen);
        }
        tl_scene_destroy(ctx, scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ranks_of_known_fields), cmocka_unit_test(opacities_of_mesh_and_model),
        cmocka_unit_test(spots_by_volume),       cmocka_unit_test(extremes_of_the_original),
        cmocka_unit_test(ranges_about_a_value),  cmocka_unit_test(one_value),
        cmocka_unit_test(colours_stay),          cmocka_unit_test(pixels_beside_a_cut),
        cmocka_unit_test(histograms_of_all),     cmocka_unit_test(series_have_one_scale)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
