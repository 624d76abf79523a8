/* Synthetic data with known formulas, streamed to a file.
 *
 * marschner-lobb: the test signal of Marschner and Lobb, "An evaluation of reconstruction filters
 * for volume rendering" (1994), f_M = 6, alpha = 0.25. gaussians: the sum of twelve Gaussians;
 * their places, widths and heights are the numbers that numpy's default_rng(7) gives (uniform in
 * [-0.8, 0.8]^3, [0.08, 0.45], [0.3, 1]), kept as a table. sphere-flow: potential flow of speed 1
 * along x past the unit sphere, potential x (1 + 1 / (2 r^3)), and the pressure coefficient 1 -
 * |velocity|^2 of it. */
#include "formats/formats_sample.h"
#include "formats/formats_emit.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
/* Channels and components of one sample at most. */
#define CHANNELS_MAX 2
#define COMPONENTS_MAX 4

typedef struct sample {
    const char *name, *about;
    tli_sample_kind kind;
    uint32_t default_size;
    void (*value)(const double x[3], double *values);
    struct {
        const char *name;
        uint32_t components;
    } channels[CHANNELS_MAX];
} sample;

/* ---- formulas ---- */

static void marschner_lobb(const double x[3], double *values)
{
    const double frequency = 6, alpha = 0.25;
    double r = sqrt(x[0] * x[0] + x[1] * x[1]);
    double rings = cos(2 * PI * frequency * cos(PI * r / 2));
    values[0] = (1 - sin(PI * x[2] / 2) + alpha * (1 + rings)) / (2 * (1 + alpha));
}

static const struct {
    double centre[3], width, height;
} bells[] = {
    {{0.20015274656746707, 0.63554208155132086, 0.44109710439230976},
     0.16332666029651899,
     0.5101163994378578},
    {{0.59768551263401903, -0.79157551269508053, 0.51396546941242605},
     0.37491568863825714,
     0.62755446699060458},
    {{-0.3151481170890984, -0.35451902063876273, -0.39220865975340069},
     0.24467823317657922,
     0.6531837812705672},
    {{0.085595763319187945, 0.79280045349502837, 0.4682590707420049},
     0.3102063148932302,
     0.99227210337731941},
    {{-0.45550608282304172, -0.54366074582744872, 0.1800633668368492},
     0.096258542945711845,
     0.32497619514151727},
    {{0.023822112434192411, -0.054070359479537422, 0.66746843710856374},
     0.31281371416167386,
     0.65988235261965966},
    {{-0.0050025033703932076, -0.4039761247562707, -0.78112955913199067},
     0.15118879327456494,
     0.78442248461728736},
    {{-0.47902924162080773, -0.20874190303646933, -0.79402521271667847},
     0.38711766002664588,
     0.40812275674300791},
    {{-0.37184111269794329, 0.60853144636932588, 0.015665295789477063},
     0.39344559115537164,
     0.74780201685976833},
    {{0.38683351577897129, -0.65360703189912694, 0.065830114202382051},
     0.26787572743112947,
     0.90993756368501644},
    {{-0.22197750557734786, 0.15709450753154086, -0.70519737224719425},
     0.22342376641096962,
     0.52612544238074466},
    {{-0.55968043348727703, 0.50614096611052117, -0.19288612551950002},
     0.44213671723215203,
     0.71299418510742718},
};

static void gaussians(const double x[3], double *values)
{
    values[0] = 0;
    for (size_t i = 0; i < sizeof bells / sizeof bells[0]; i++) {
        double distance = 0; /* squared */
        for (int axis = 0; axis < 3; axis++) {
            double d = x[axis] - bells[i].centre[axis];
            distance += d * d;
        }
        values[0] += bells[i].height * exp(-distance / (2 * bells[i].width * bells[i].width));
    }
}

static void sphere_flow(const double x[3], double *values)
{
    double square = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    double cubed = square * sqrt(square);
    double radial = -1.5 * x[0] / (cubed * square), speed = 0;
    double *velocity = values + 1;
    for (int axis = 0; axis < 3; axis++) {
        velocity[axis] = radial * x[axis] + (axis == 0 ? 1 + 0.5 / cubed : 0);
        speed += velocity[axis] * velocity[axis];
    }
    values[0] = 1 - speed;
}

static const sample samples[] = {
    {"marschner-lobb",
     "the signal of Marschner and Lobb on a regular grid over [-1, 1]^3",
     TLI_SAMPLE_GRID,
     64,
     marschner_lobb,
     {{"value", 1}}},
    {"gaussians",
     "the sum of twelve Gaussians on a regular grid over [-1, 1]^3",
     TLI_SAMPLE_GRID,
     64,
     gaussians,
     {{"value", 1}}},
    {"sphere-flow",
     "potential flow past the unit sphere in the cube [-10, 10]^3, finer towards the sphere: "
     "the smallest cell has 3e-5 of the volume of the largest",
     TLI_SAMPLE_SHELLS,
     55,
     sphere_flow,
     {{"pressure", 1}, {"velocity", 3}}},
};
#define SAMPLE_COUNT (sizeof samples / sizeof samples[0])

/* ---- catalogue ---- */

static const sample *find_sample(const char *name)
{
    for (size_t i = 0; i < SAMPLE_COUNT; i++)
        if (strcmp(samples[i].name, name) == 0) return &samples[i];
    return NULL;
}

static tl_status fail_name(tl_ctx *ctx, const char *name)
{
    return tl_fail(ctx, TL_ERR_ARG,
                   "no sample is called '%s'; there are marschner-lobb, gaussians "
                   "and sphere-flow",
                   name);
}

const char *tl_sample_name(size_t index)
{
    return index < SAMPLE_COUNT ? samples[index].name : NULL;
}

const char *tl_sample_about(const char *name)
{
    const sample *s = find_sample(name);
    return s ? s->about : NULL;
}

size_t tl_sample_components(const char *name)
{
    const sample *s = find_sample(name);
    size_t sum = 0;
    for (int i = 0; s && i < CHANNELS_MAX; i++) sum += s->channels[i].components;
    return sum;
}

tl_status tl_sample_value(tl_ctx *ctx, const char *name, const double x[3], double *values)
{
    const sample *s = find_sample(name);
    if (!s) return fail_name(ctx, name);
    s->value(x, values);
    return TL_OK;
}

/* ---- streaming ---- */

static void fill_points(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    float *xyz = out;
    for (uint64_t v = begin; v < end; v++, xyz += 3) tli_sample_point(arg, v, xyz);
}

/* Tets whose 64-bit indices are made at once, on the way to 32 bits. */
#define TETS_AT_ONCE 256

static void fill_tets32(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    int32_t *to = out;
    uint64_t tets[TETS_AT_ONCE][4];
    for (uint64_t at = begin; at < end; at += TETS_AT_ONCE) {
        uint64_t stop = end - at < TETS_AT_ONCE ? end : at + TETS_AT_ONCE;
        tli_sample_tets(arg, at, stop, tets);
        for (uint64_t t = 0; t < stop - at; t++)
            for (int v = 0; v < 4; v++) *to++ = (int32_t)tets[t][v];
    }
}

static void fill_tets64(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    tli_sample_tets(arg, begin, end, out);
}

typedef struct value_source {
    const sample *sample;
    const tli_sample_mesh *mesh;
    uint32_t first, components; /* of the channel among all components */
} value_source;

/* Values belong to the positions as the file holds them. */
static void fill_values(const void *arg, uint64_t begin, uint64_t end, void *out)
{
    const value_source *source = arg;
    float *to = out;
    for (uint64_t v = begin; v < end; v++) {
        float xyz[3];
        double x[3], values[COMPONENTS_MAX];
        tli_sample_point(source->mesh, v, xyz);
        for (int axis = 0; axis < 3; axis++) x[axis] = (double)xyz[axis];
        source->sample->value(x, values);
        for (uint32_t c = 0; c < source->components; c++) *to++ = (float)values[source->first + c];
    }
}

tl_status tl_sample_write(tl_ctx *ctx, const char *name, uint32_t size, const char *path)
{
    const sample *s = find_sample(name);
    tli_sample_mesh mesh;
    if (!s) return fail_name(ctx, name);
    if (!tli_path_ends(path, ".vtu"))
        return tl_fail(ctx, TL_ERR_ARG, "'%s': samples are written as .vtu", path);
    if (!tli_sample_mesh_init(&mesh, s->kind, size ? size : s->default_size))
        return tl_fail(ctx, TL_ERR_ARG, "sample %s: a size of %u is out of range, 2 to 32768", name,
                       size);

    tl_scalar index = tli_out_index_type(mesh.vert_count, mesh.tet_count);
    value_source sources[CHANNELS_MAX];
    tli_out_array arrays[CHANNELS_MAX];
    tli_out out = {.points = {"Points", NULL, TL_F32, 3, mesh.vert_count, fill_points, &mesh},
                   .tets = {"connectivity", NULL, index, 4, mesh.tet_count,
                            index == TL_I32 ? fill_tets32 : fill_tets64, &mesh},
                   .point_arrays = arrays,
                   .time = (double)NAN};
    uint32_t first = 0;
    for (int i = 0; i < CHANNELS_MAX && s->channels[i].name; i++) {
        uint32_t components = s->channels[i].components;
        sources[i] = (value_source){s, &mesh, first, components};
        arrays[i] = (tli_out_array){s->channels[i].name, NULL,        TL_F32,     components,
                                    mesh.vert_count,     fill_values, &sources[i]};
        first += components;
        out.point_array_count++;
    }
    return tli_emit_vtu(ctx, path, &out, TLI_RAW);
}
