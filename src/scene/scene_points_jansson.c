/* Transfer functions out of ParaView's JSON. */
#include <math.h>
#include <string.h>

#include "scene/scene_load_jansson.h"
#include "scene/scene_ways.h"

typedef struct reader {
    tl_ctx *ctx;
    const char *name; /* of the file */
    double *numbers;  /* [TLI_FILE_POINTS_MAX][TLI_POINT_NUMBERS] */
    tli_points *points;
    bool logarithmic, has_nan;
    double nan_rgb[3];
} reader;

static tl_status wrong(const reader *r, const char *what)
{
    return tl_fail(r->ctx, TL_ERR_FORMAT, "'%s': %s", r->name, what);
}

/* Number i of a list; NaN if it is none. */
static double number_of(const json_t *list, size_t i)
{
    const json_t *number = json_array_get(list, i);
    return json_is_number(number) ? json_number_value(number) : (double)NAN;
}

/* Control points under a key, by values that do not fall, the other numbers from 0 to 1; false for
 * a list of anything else. */
static bool take_groups(const json_t *list, double *numbers, size_t *count)
{
    const size_t length = json_array_size(list);
    *count = length / TLI_POINT_NUMBERS;
    if (list &&
        (!json_is_array(list) || length % TLI_POINT_NUMBERS || *count > TLI_FILE_POINTS_MAX))
        return false;
    for (size_t i = 0; i < length; i++) {
        const double x = numbers[i] = number_of(list, i);
        const bool is_value = i % TLI_POINT_NUMBERS == 0;
        if (!isfinite(x) || (!is_value && !(x >= 0 && x <= 1))) return false;
        if (is_value && i && x < numbers[i - TLI_POINT_NUMBERS]) return false;
    }
    return true;
}

/* Whether a key says yes: true, or a number but 0. */
static bool is_on(const json_t *map, const char *key)
{
    const json_t *word = json_object_get(map, key);
    return json_is_true(word) || (json_is_number(word) && json_number_value(word) != 0);
}

/* The colour of NaN, where it is given. */
static tl_status take_nan(reader *r, const json_t *map)
{
    const json_t *color = json_object_get(map, "NanColor");
    r->has_nan = color != NULL;
    for (size_t k = 0; color && k < 3; k++) {
        r->nan_rgb[k] = number_of(color, k);
        if (json_array_size(color) != 3 || !(r->nan_rgb[k] >= 0 && r->nan_rgb[k] <= 1))
            return wrong(r, "NanColor: expected red, green, blue from 0 to 1");
    }
    return TL_OK;
}

static tl_status take_map(reader *r, const json_t *map, bool logarithmic)
{
    size_t count;
    tli_way color = {.is_color = true}, opacity = {.is_color = false};
    const json_t *space = json_object_get(map, "ColorSpace");
    if (!json_is_object(map))
        return wrong(r, "expected a list of colour maps, as ParaView writes it");
    if (space &&
        (!json_is_string(space) || !tli_color_space_named(json_string_value(space), &color.space)))
        return wrong(r, "ColorSpace: expected RGB, HSV, Lab, Lab/CIEDE2000, Diverging or Step");
    if (color.space == TLI_SPACE_HSV && is_on(map, "HSVWrap")) color.space = TLI_SPACE_HSV_WRAP;
    const json_t *colors = json_object_get(map, "RGBPoints");
    const bool has_colors = colors || !json_array_size(json_object_get(map, "Points"));
    if (!take_groups(colors, r->numbers, &count) || (has_colors && !count))
        return wrong(r, "RGBPoints: expected up to 1024 groups of value, red, green, blue, by "
                        "value, colours from 0 to 1");
    r->logarithmic = count && is_on(map, "UseLogScale") && r->numbers[0] > 0;
    color.logarithmic = opacity.logarithmic = logarithmic || r->logarithmic;
    tli_ways_follow(r->numbers, count, color, r->points);
    if (!take_groups(json_object_get(map, "Points"), r->numbers, &count))
        return wrong(r, "Points: expected up to 1024 groups of value, opacity, middle, "
                        "sharpness, by value, the others from 0 to 1");
    tli_ways_follow(r->numbers, count, opacity, r->points);
    return take_nan(r, map);
}

/* Gives a copy in one block. */
static tl_status pack(const reader *r, tl_control_points **packed)
{
    tl_status st = TL_OK;
    const tli_points *from = r->points;
    const size_t color_bytes = from->color_count * sizeof *from->colors;
    const size_t opacity_bytes = from->opacity_count * sizeof *from->opacities;
    tl_control_points *p = tl_mem_zalloc(r->ctx, sizeof *p + color_bytes + opacity_bytes, 1, &st);
    if (st) return st;
    p->colors = (tl_color_point *)(p + 1);
    p->color_count = from->color_count;
    p->opacities = (tl_opacity_point *)(p->colors + p->color_count);
    p->opacity_count = from->opacity_count;
    memcpy(p->colors, from->colors, color_bytes);
    memcpy(p->opacities, from->opacities, opacity_bytes);
    p->logarithmic = r->logarithmic;
    p->has_nan = r->has_nan;
    memcpy(p->nan_rgb, r->nan_rgb, sizeof p->nan_rgb);
    *packed = p;
    return TL_OK;
}

tl_status tli_json_points(tl_ctx *ctx, const char *name, char *text, size_t bytes, bool logarithmic,
                          tl_control_points **points)
{
    tli_json json;
    reader r = {.ctx = ctx, .name = name};
    tl_status st = tli_json_load(ctx, name, text, bytes, true, &json);
    if (st) return st;
    r.numbers = tl_mem_alloc(ctx, TLI_FILE_POINTS_MAX, TLI_POINT_NUMBERS * sizeof(double), &st);
    r.points = tl_mem_zalloc(ctx, 1, sizeof *r.points, &st);
    const json_t *map = json_is_array(json.root) ? json_array_get(json.root, 0) : json.root;
    if (!st) st = take_map(&r, map, logarithmic);
    if (!st) st = pack(&r, points);
    tl_mem_free(ctx, r.points);
    tl_mem_free(ctx, r.numbers);
    tli_json_unload(ctx, &json);
    return st;
}
