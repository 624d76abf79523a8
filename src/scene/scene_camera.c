/* The scene's camera, and the frame that it stands in; cameras to files. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "scene/scene_text.h"

enum { CAMERA = TL_NODE_CAMERA + 1 };
/* The view of a camera without a position. */
static const double FIRST_VIEW[3] = {30, 20, 1};

tl_status tl_scene_set_bounds(tl_ctx *ctx, tl_scene *scene, const double bounds[6])
{
    for (int k = 0; k < 3; k++)
        if (!isfinite(bounds[2 * k]) || !isfinite(bounds[2 * k + 1]) ||
            !(bounds[2 * k] <= bounds[2 * k + 1]))
            return tl_fail(ctx, TL_ERR_ARG, "bounds of %c from %g to %g", 'x' + k, bounds[2 * k],
                           bounds[2 * k + 1]);
    memcpy(scene->bounds, bounds, sizeof scene->bounds);
    return TL_OK;
}

tl_status tl_scene_set_frame(tl_ctx *ctx, tl_scene *scene, uint32_t width, uint32_t height,
                             const double window[4])
{
    static const double ALL[4] = {-1, 1, -1, 1};
    const double *w = window ? window : ALL;
    if (!width || !height)
        return tl_fail(ctx, TL_ERR_ARG, "a picture of %u x %u pixels", width, height);
    if (!(w[0] < w[1]) || !(w[2] < w[3]))
        return tl_fail(ctx, TL_ERR_ARG, "a window from %g, %g to %g, %g", w[0], w[2], w[1], w[3]);
    scene->size_px[0] = width;
    scene->size_px[1] = height;
    memcpy(scene->window, w, sizeof scene->window);
    return TL_OK;
}

void tl_scene_bounds(const tl_scene *scene, double bounds[6])
{
    memcpy(bounds, scene->bounds, sizeof scene->bounds);
}

static void get(const tl_scene *scene, const char *prop, double reals[3])
{
    const tl_value *value = tli_scene_value(scene, CAMERA, prop);
    if (value->count == 3) memcpy(reals, value->reals, 3 * sizeof *reals);
}

void tl_scene_camera(const tl_scene *scene, uint32_t width, uint32_t height, tl_camera *camera)
{
    const bool parallel = tl_scene_flag(scene, CAMERA, "parallel");
    const double scale = tl_scene_real(scene, CAMERA, "parallel_scale");
    tl_camera c = tl_camera_defaults();
    c.size_px[0] = width;
    c.size_px[1] = height;
    if (!tli_scene_value(scene, CAMERA, "position")->count) {
        c.parallel_scale = parallel ? 1 : 0;
        tl_camera_stand(&c, FIRST_VIEW, scene->bounds, scene->window);
        *camera = c;
        return;
    }
    get(scene, "position", c.position);
    get(scene, "focal_point", c.focal_point);
    get(scene, "view_up", c.view_up);
    c.view_angle = tl_scene_real(scene, CAMERA, "view_angle");
    if (parallel && scale > 0)
        c.parallel_scale = scale;
    else if (parallel)
        tl_camera_set_parallel(&c, true);
    *camera = c;
}

/* Puts reals into the value of a property, checked. */
static tl_status put(tl_ctx *ctx, tl_value values[TLI_PROPS_MAX], const char *prop,
                     const double *reals, size_t count)
{
    char where[TLI_STEP_BYTES];
    tl_value *value = &values[tli_prop_index(TL_NODE_CAMERA, prop)];
    *value = (tl_value){.reals = reals, .count = count};
    snprintf(where, sizeof where, "camera.%s", prop);
    return tli_value_check(ctx, TL_ERR_ARG, tl_node_prop(TL_NODE_CAMERA, prop), where, value);
}

tl_status tl_scene_set_camera(tl_ctx *ctx, tl_scene *scene, const tl_camera *camera)
{
    tl_value values[TLI_PROPS_MAX];
    const double parallel = camera->parallel_scale > 0;
    tl_status st = tl_camera_check(ctx, camera);
    if (!st) st = put(ctx, values, "position", camera->position, 3);
    if (!st) st = put(ctx, values, "focal_point", camera->focal_point, 3);
    if (!st) st = put(ctx, values, "view_up", camera->view_up, 3);
    if (!st) st = put(ctx, values, "view_angle", &camera->view_angle, 1);
    if (!st) st = put(ctx, values, "parallel", &parallel, 1);
    if (!st) st = put(ctx, values, "parallel_scale", &camera->parallel_scale, 1);
    return st ? st : tli_scene_put(ctx, scene, CAMERA, values, "set camera");
}

/* ---- files ---- */

static void put_camera(tli_text *t, const tl_camera *camera)
{
    const double size[2] = {camera->size_px[0], camera->size_px[1]};
    const bool parallel = camera->parallel_scale > 0;
    tli_text_put(t, "{\n  \"position\": ");
    tli_text_put_reals(t, camera->position, 3);
    tli_text_put(t, ",\n  \"focal_point\": ");
    tli_text_put_reals(t, camera->focal_point, 3);
    tli_text_put(t, ",\n  \"view_up\": ");
    tli_text_put_reals(t, camera->view_up, 3);
    tli_text_put(t, ",\n  \"view_angle\": ");
    tli_text_put_real(t, camera->view_angle);
    if (parallel) {
        tli_text_put(t, ",\n  \"parallel_scale\": ");
        tli_text_put_real(t, camera->parallel_scale);
    }
    tli_text_put(t, ",\n  \"parallel_projection\": ");
    tli_text_put(t, parallel ? "true" : "false");
    tli_text_put(t, ",\n  \"size\": ");
    tli_text_put_reals(t, size, 2);
    tli_text_put(t, "\n }");
}

tl_status tl_cameras_write(tl_ctx *ctx, const char *path, const tl_camera *cameras, size_t count)
{
    tli_text t = {.ctx = ctx};
    if (count != 1) tli_text_put(&t, "[\n ");
    for (size_t i = 0; i < count; i++) {
        if (i) tli_text_put(&t, ",\n ");
        put_camera(&t, &cameras[i]);
    }
    tli_text_put(&t, count != 1 ? "\n]\n" : "\n");
    tl_status st = tli_text_save(&t, path);
    return st ? tl_note(ctx, st, "while writing the camera '%s'", path) : TL_OK;
}
