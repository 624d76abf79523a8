/* Transfer functions: from files into a scene, and to files. */
#include <string.h>

#include "scene/scene_text.h"

/* The list of rows, each of row reals that are given. */
static void put_rows(tli_text *t, const char *key, const double *reals, size_t count, size_t row,
                     const char *rest)
{
    tli_text_put(t, key);
    for (size_t i = 0; i < count; i++) {
        tli_text_put(t, i ? ",\n   " : "\n   ");
        for (size_t k = 0; k < row; k++) {
            if (k) tli_text_put(t, ", ");
            tli_text_put_real(t, reals[i * row + k]);
        }
        tli_text_put(t, rest);
    }
    tli_text_put(t, "\n  ]");
}

tl_status tl_control_points_write(tl_ctx *ctx, const char *path, const char *name,
                                  const tl_control_points *points)
{
    tli_text t = {.ctx = ctx};
    tli_text_put(&t, "[\n {\n  \"ColorSpace\": \"RGB\",\n  \"Name\": ");
    tli_text_put_quoted(&t, name);
    if (points->logarithmic) tli_text_put(&t, ",\n  \"UseLogScale\": 1");
    if (points->has_nan) {
        tli_text_put(&t, ",\n  \"NanColor\": ");
        tli_text_put_reals(&t, points->nan_rgb, 3);
    }
    /* of which middle and sharpness make straight ways */
    if (points->opacity_count)
        put_rows(&t, ",\n  \"Points\": [", &points->opacities->value, points->opacity_count, 2,
                 ", 0.5, 0");
    put_rows(&t, ",\n  \"RGBPoints\": [", &points->colors->value, points->color_count, 4, "");
    tli_text_put(&t, "\n }\n]\n");
    tl_status st = tli_text_save(&t, path);
    return st ? tl_note(ctx, st, "while writing the transfer function '%s'", path) : TL_OK;
}

/* Puts reals into the value of a property. */
static tl_status put(tl_ctx *ctx, tl_value values[TLI_PROPS_MAX], const char *prop,
                     const double *reals, size_t count)
{
    tl_value *value = &values[tli_prop_index(TL_NODE_TRANSFER, prop)];
    *value = (tl_value){.reals = reals, .count = count};
    return tli_value_check(ctx, TL_ERR_FORMAT, tl_node_prop(TL_NODE_TRANSFER, prop), prop, value);
}

static tl_status put_points(tl_ctx *ctx, tl_scene *scene, tl_node node, const tl_control_points *p)
{
    static const double ON = 1;
    tl_value values[TLI_PROPS_MAX];
    const tli_node *old = scene->now->nodes[tli_scene_place(scene, node)];
    memcpy(values, old->values, old->prop_count * sizeof *values);
    tl_status st = put(ctx, values, "colors", &p->colors->value, 4 * p->color_count);
    if (!st) st = put(ctx, values, "opacities", &p->opacities->value, 2 * p->opacity_count);
    if (!st) st = put(ctx, values, "nan_color", p->nan_rgb, p->has_nan ? 3 : 0);
    if (!st && p->logarithmic) st = put(ctx, values, "logarithmic", &ON, 1);
    return st ? st : tli_scene_put(ctx, scene, node, values, "read transfer function");
}

tl_status tl_transfer_read(tl_ctx *ctx, tl_scene *scene, tl_node node, const char *path)
{
    tl_control_points *points = NULL;
    if (tl_scene_kind(scene, node) != TL_NODE_TRANSFER)
        return tl_fail(ctx, TL_ERR_ARG, "node %u is no transfer function", node);
    tl_status st =
        tl_control_points_read(ctx, path, tl_scene_flag(scene, node, "logarithmic"), &points);
    if (!st) st = put_points(ctx, scene, node, points);
    tl_mem_free(ctx, points);
    return st;
}
