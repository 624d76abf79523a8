/* How a channel is shown: the scalar that is drawn of it, the range of its colours, its transfer
 * function. */
#include <math.h>
#include <string.h>

#include "cli_scene.h"

/* Opacities hold for a layer as thick as this part of the diagonal. */
static const double UNIT_DISTANCE = 0.02;
/* Channels of larger or smaller numbers are scaled before anything is computed with them. */
enum { EXPONENT_MOST = 200 };
/* Values that ranks are taken from; of larger meshes every n-th vertex. */
enum { SAMPLES_MOST = 1 << 18 };

/* ---- the scalar ---- */

static const tl_channel *find_channel(const tl_mesh *mesh, const char *name)
{
    const tl_channel *found = cli_vertex_channel(mesh, name);
    return found ? found : tl_mesh_channel_by_name(mesh, name);
}

static size_t index_of(const tl_mesh *mesh, const tl_channel *channel)
{
    size_t c = 0;
    while (tl_mesh_channel(mesh, c) != channel) c++;
    return c;
}

/* Length of element i. */
static double length_at(const tl_channel *channel, size_t i)
{
    const double *v = channel->values + i * channel->components;
    double scale = 0, sum = 0;
    if (channel->components == 1) return v[0];
    for (uint32_t k = 0; k < channel->components; k++) scale = fmax(scale, fabs(v[k]));
    if (!(scale > 0) || !isfinite(scale)) return scale;
    for (uint32_t k = 0; k < channel->components; k++) sum += v[k] / scale * (v[k] / scale);
    return scale * sqrt(sum);
}

static double volume_at(const tl_mesh *mesh, size_t tet)
{
    double p[4][3];
    const tl_lidx *corners = tl_mesh_tets(mesh) + 4 * tet;
    for (size_t i = 0; i < 4; i++)
        memcpy(p[i], tl_mesh_xyz(mesh) + 3 * (size_t)corners[i], sizeof p[i]);
    const double volume = fabs(tl_tet_volume((const double(*)[3])p));
    return isfinite(volume) ? volume : 0;
}

/* Means of the tets around each vertex, by volume. */
static tl_status mean_of_tets(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                              double *scalar)
{
    tl_status st = TL_OK;
    const size_t count = tl_mesh_vert_count(mesh);
    double *weights = tl_mem_zalloc(ctx, count, sizeof *weights, &st);
    if (st) return st;
    memset(scalar, 0, count * sizeof *scalar);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        const double volume = volume_at(mesh, t), value = length_at(channel, t);
        for (size_t i = 0; i < 4; i++) {
            const size_t v = tl_mesh_tets(mesh)[4 * t + i];
            /* a running mean: sums of large values do not overflow */
            weights[v] += volume;
            if (weights[v] > 0) scalar[v] += (value - scalar[v]) * (volume / weights[v]);
        }
    }
    for (size_t v = 0; v < count; v++)
        if (!(weights[v] > 0)) scalar[v] = (double)NAN;
    tl_mem_free(ctx, weights);
    return TL_OK;
}

double cli_shade_shown(const cli_shade *shade, double value)
{
    if (!shade->logarithmic) return shade->factor * value;
    return value > 0 ? log10(value) : (double)NAN;
}

double cli_shade_value(const cli_shade *shade, double shown)
{
    return shade->logarithmic ? pow(10, shown) : shown / shade->factor;
}

tl_status cli_shade_bind(tl_ctx *ctx, cli_shade *shade, tl_mesh *mesh)
{
    tl_status st = TL_OK;
    const tl_channel *channel = find_channel(mesh, shade->name);
    const size_t count = tl_mesh_vert_count(mesh);
    if (!channel) { /* an expression */
        st = tl_mesh_derive(ctx, mesh, shade->name, shade->name);
        if (st) return st;
        channel = find_channel(mesh, shade->name);
    }
    const bool as_it_is = channel->components == 1 && channel->on == TL_ON_VERTEX &&
                          !shade->logarithmic && shade->factor == 1;
    if (as_it_is) {
        shade->channel = index_of(mesh, channel);
        shade->scalar = channel->values;
        return TL_OK;
    }
    double *scalar = tl_mem_alloc(ctx, count, sizeof *scalar, &st);
    if (!st && channel->on == TL_ON_TET) st = mean_of_tets(ctx, mesh, channel, scalar);
    for (size_t v = 0; !st && v < count; v++)
        scalar[v] =
            cli_shade_shown(shade, channel->on == TL_ON_TET ? scalar[v] : length_at(channel, v));
    const tl_channel shown = {
        .name = "shown", .components = 1, .on = TL_ON_VERTEX, .scalar = TL_F64, .values = scalar};
    if (!st) st = tl_mesh_adopt_channel(mesh, &shown);
    if (st) {
        tl_mem_free(ctx, scalar);
        return st;
    }
    shade->channel = tl_mesh_channel_count(mesh) - 1;
    shade->scalar = scalar;
    return TL_OK;
}

/* ---- range ---- */

/* Values and how much of the volume has them. */
typedef struct sample {
    double value, weight;
} sample;

static int by_value(const void *a, const void *b)
{
    const sample *x = a, *y = b;
    return (x->value > y->value) - (x->value < y->value);
}

/* Finite values of what is drawn, rising. Gives *samples [*count] (tl_mem_free). */
static tl_status take_samples(tl_ctx *ctx, const tl_mesh *mesh, const double *scalar,
                              sample **samples, size_t *count)
{
    tl_status st = TL_OK;
    const size_t vert_count = tl_mesh_vert_count(mesh);
    const size_t stride = 1 + vert_count / SAMPLES_MOST;
    double *weights = tl_mem_zalloc(ctx, vert_count, sizeof *weights, &st);
    *samples = tl_mem_alloc(ctx, vert_count / stride + 1, sizeof **samples, &st);
    *count = 0;
    for (size_t t = 0; !st && t < tl_mesh_tet_count(mesh); t++) {
        const double volume = volume_at(mesh, t);
        for (size_t i = 0; i < 4; i++) weights[tl_mesh_tets(mesh)[4 * t + i]] += volume;
    }
    for (size_t v = 0; !st && v < vert_count; v += stride)
        if (isfinite(scalar[v]) && weights[v] > 0)
            (*samples)[(*count)++] = (sample){scalar[v], weights[v]};
    tl_mem_free(ctx, weights);
    if (!st && *count) qsort(*samples, *count, sizeof **samples, by_value);
    return st;
}

/* The value that a part (0 to 1) of the volume is below. */
static double rank_value(const sample *samples, size_t count, double part)
{
    double total = 0, below = 0;
    for (size_t i = 0; i < count; i++) total += samples[i].weight;
    for (size_t i = 0; i < count; i++)
        if ((below += samples[i].weight) >= part * total) return samples[i].value;
    return samples[count - 1].value;
}

/* "V" or "P%" of the volume. */
static bool parse_end(const char *text, const cli_shade *shade, const sample *samples, size_t count,
                      double *value)
{
    double number;
    bool percent;
    if (cli_parse_amount(text, &number, &percent) && percent) {
        if (number > 1) return false;
        *value = count ? cli_shade_value(shade, rank_value(samples, count, number)) : 0;
        return true;
    }
    return cli_parse_real(text, value) && isfinite(*value);
}

static int take_range(const cli_session *session, const sample *samples, size_t count,
                      cli_shade *shade)
{
    char low[64];
    const char *text = cli_get(session, CLI_RANGE)->text, *comma = text ? strchr(text, ',') : NULL;
    if (!text) return CLI_DONE;
    snprintf(low, sizeof low, "%.*s", comma ? (int)(comma - text) : 0, text);
    double range[2];
    if (!comma || !parse_end(low, shade, samples, count, &range[0]) ||
        !parse_end(comma + 1, shade, samples, count, &range[1]))
        return cli_misuse(session->args.verb, "--range %s: expected LOW,HIGH, as values or P%%",
                          text);
    const bool ranks = strchr(text, '%') != NULL; /* may meet in a constant channel */
    if (!(range[0] < range[1]) && !(ranks && range[0] == range[1]))
        return cli_misuse(session->args.verb, "--range %s: expected LOW,HIGH with LOW below HIGH",
                          text);
    if (shade->logarithmic && !(range[0] > 0))
        return cli_misuse(session->args.verb, "--range %s: a logarithmic scale begins above 0",
                          text);
    memcpy(shade->range, range, sizeof range);
    return CLI_DONE;
}

/* ---- colours ---- */

static int unknown_map(const cli_session *session, const char *map)
{
    cli_misuse(session->args.verb, "--colormap %s is unknown", map);
    fputs("  colour maps:", stderr);
    for (size_t i = 0; tl_colormap_name(i); i++) fprintf(stderr, " %s", tl_colormap_name(i));
    fputs("\n", stderr);
    return CLI_WRONG_USE;
}

/* From values to what is drawn; below 0 on a logarithmic scale: the least value there is. */
static void show_points(cli_shade *shade)
{
    for (size_t i = 0; i < shade->points.color_count; i++) {
        double *value = &shade->points.colors[i].value;
        *value =
            cli_shade_shown(shade, shade->logarithmic && !(*value > 0) ? shade->least : *value);
    }
    for (size_t i = 0; i < shade->points.opacity_count; i++) {
        double *value = &shade->points.opacities[i].value;
        *value =
            cli_shade_shown(shade, shade->logarithmic && !(*value > 0) ? shade->least : *value);
    }
}

/* The points of a file are read already. */
static int take_colors(cli_session *session, const char *file, const sample *samples, size_t count,
                       cli_shade *shade)
{
    cli_points *points = &shade->points;
    const char *map = cli_get(session, CLI_COLORMAP)->text;
    if (file) {
        shade->range[0] = points->colors[0].value;
        shade->range[1] = points->colors[points->color_count - 1].value;
        if (shade->logarithmic && !(shade->range[0] > 0)) shade->range[0] = shade->least;
        show_points(shade);
    }
    const double shown[2] = {cli_shade_shown(shade, shade->range[0]),
                             cli_shade_shown(shade, shade->range[1])};
    if (!file && !cli_points_map(map, shown, points)) return unknown_map(session, map);
    if (points->opacity_count) return CLI_DONE;
    double *values = NULL, *weights = NULL;
    tl_status st = TL_OK;
    values = tl_mem_alloc(session->ctx, count, sizeof *values, &st);
    weights = tl_mem_alloc(session->ctx, count, sizeof *weights, &st);
    for (size_t i = 0; !st && i < count; i++) {
        values[i] = samples[i].value;
        weights[i] = samples[i].weight;
    }
    if (!st) cli_points_look(values, weights, count, shown, points);
    tl_mem_free(session->ctx, weights);
    tl_mem_free(session->ctx, values);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* ---- all of it ---- */

static int unknown_channel(const cli_session *session, const tl_mesh *mesh, const char *name)
{
    cli_misuse(session->args.verb, "there is no channel '%s'", cli_name(name).s);
    fputs("  channels:", stderr);
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++)
        fprintf(stderr, " '%s'", cli_name(tl_mesh_channel(mesh, i)->name).s);
    fputs(tl_mesh_channel_count(mesh) ? "\n" : " none\n", stderr);
    return CLI_WRONG_USE;
}

/* Extremes of the values, and what they have to be scaled by. */
static void measure(cli_shade *shade, const tl_mesh *mesh, const tl_channel *channel)
{
    const size_t count =
        channel->on == TL_ON_VERTEX ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh);
    int exponent = 0;
    shade->least = (double)INFINITY;
    shade->most = -(double)INFINITY;
    for (size_t i = 0; i < count; i++) {
        const double value = length_at(channel, i);
        if (!isfinite(value) || (shade->logarithmic && !(value > 0))) continue;
        shade->least = fmin(shade->least, value);
        shade->most = fmax(shade->most, value);
    }
    if (!(shade->least <= shade->most)) shade->least = shade->most = shade->logarithmic ? 1 : 0;
    const double largest = fmax(fabs(shade->least), fabs(shade->most));
    if (largest > 0) frexp(largest, &exponent);
    shade->factor = !shade->logarithmic && abs(exponent) > EXPONENT_MOST ? ldexp(1, -exponent) : 1;
    if (exponent < -1000) shade->factor = ldexp(1, 1000);
}

static int fill(cli_session *session, tl_mesh *mesh, const char *file, cli_shade *shade)
{
    sample *samples = NULL;
    size_t count = 0;
    const tl_channel *channel = find_channel(mesh, shade->name);
    measure(shade, mesh, channel);
    snprintf(shade->title, sizeof shade->title, "%s%s%s%s%s", channel->components > 1 ? "|" : "",
             shade->name, channel->components > 1 ? "|" : "", *channel->unit ? " [" : "",
             channel->unit);
    if (*channel->unit) strncat(shade->title, "]", sizeof shade->title - strlen(shade->title) - 1);
    tl_status st = cli_shade_bind(session->ctx, shade, mesh);
    if (!st) st = take_samples(session->ctx, mesh, shade->scalar, &samples, &count);
    int failed = st ? cli_fail(session, session->ctx, st) : CLI_DONE;
    if (!failed) {
        double look[2] = {cli_shade_shown(shade, shade->least),
                          cli_shade_shown(shade, shade->most)};
        if (count) {
            const double tails[2] = {rank_value(samples, count, CLI_TAIL),
                                     rank_value(samples, count, 1 - CLI_TAIL)};
            if (tails[0] < tails[1]) memcpy(look, tails, sizeof look);
        }
        for (int i = 0; i < 2; i++) shade->range[i] = cli_shade_value(shade, look[i]);
        failed = take_range(session, samples, count, shade);
    }
    if (!failed) failed = take_colors(session, file, samples, count, shade);
    tl_mem_free(session->ctx, samples);
    return failed;
}

int cli_shade_create(cli_session *session, tl_mesh *mesh, const char *name, const char *file,
                     bool logarithmic, cli_shade **shade)
{
    tl_status st = TL_OK;
    int failed = CLI_DONE;
    *shade = NULL;
    if (!find_channel(mesh, name)) { /* an expression? */
        st = tl_mesh_derive(session->ctx, mesh, name, name);
        if (st == TL_ERR_ARG) {
            tl_ctx_clear(session->ctx);
            return unknown_channel(session, mesh, name);
        }
    }
    cli_shade *s = tl_mem_zalloc(session->ctx, 1, sizeof *s, &st);
    if (st) return cli_fail(session, session->ctx, st);
    snprintf(s->name, sizeof s->name, "%s", name);
    s->logarithmic = logarithmic;
    if (file) failed = cli_points_read(session->ctx, file, logarithmic, &s->points);
    s->logarithmic |= s->points.logarithmic;
    if (!failed) failed = fill(session, mesh, file, s);
    if (!failed) {
        st = tl_transfer_create(session->ctx, s->points.colors, s->points.color_count,
                                s->points.opacities, s->points.opacity_count,
                                UNIT_DISTANCE * fmax(cli_diagonal(mesh), 1e-300), &s->transfer);
        if (st) failed = cli_fail(session, session->ctx, st);
    }
    if (failed)
        cli_shade_destroy(session, s);
    else
        *shade = s;
    return failed;
}

void cli_shade_destroy(cli_session *session, cli_shade *shade)
{
    if (!shade) return;
    tl_transfer_destroy(session->ctx, shade->transfer);
    tl_mem_free(session->ctx, shade);
}

int cli_shade_write(const cli_shade *shade, const char *path)
{
    json_t *list = json_array(), *map = cli_json_item(list);
    cli_json_text(map, "ColorSpace", "RGB");
    cli_json_text(map, "Name", shade->name);
    if (shade->logarithmic) cli_json_count(map, "UseLogScale", 1);
    json_t *points = cli_json_list(map, "Points");
    for (size_t i = 0; i < shade->points.opacity_count; i++) {
        const tl_opacity_point *p = &shade->points.opacities[i];
        const double numbers[4] = {cli_shade_value(shade, p->value), p->opacity, 0.5, 0};
        for (int k = 0; k < 4; k++) json_array_append_new(points, json_real(numbers[k]));
    }
    json_t *colors = cli_json_list(map, "RGBPoints");
    for (size_t i = 0; i < shade->points.color_count; i++) {
        const tl_color_point *p = &shade->points.colors[i];
        json_array_append_new(colors, json_real(cli_shade_value(shade, p->value)));
        for (int k = 0; k < 3; k++) json_array_append_new(colors, json_real(p->rgb[k]));
    }
    return cli_json_write(list, path);
}
