/* Cameras out of JSON, as VTK names them. */
#include <string.h>
#include <strings.h>

#include "scene/scene_load_jansson.h"

/* Pixels of a side that make sense. */
static const double SIDE_MOST = 65536;

/* The value under a name, whose letters may be large and whose underscores may be missing. */
static const json_t *find(const json_t *object, const char *name)
{
    const char *key;
    json_t *value;
    char plain[32];
    json_object_foreach((json_t *)(uintptr_t)object, key, value)
    {
        size_t n = 0;
        if (strcasecmp(key, name) == 0) return value;
        for (const char *c = name; *c; c++)
            if (*c != '_') plain[n++] = *c;
        plain[n] = '\0';
        if (strcasecmp(key, plain) == 0) return value;
    }
    return NULL;
}

/* Numbers under a name; a single one may stand alone. false if there are others. */
static bool read_reals(const json_t *object, const char *name, double *values, size_t count)
{
    const json_t *value = find(object, name);
    if (!value) return true;
    if (count == 1 && json_is_number(value)) {
        *values = json_number_value(value);
        return true;
    }
    if (!json_is_array(value) || json_array_size(value) != count) return false;
    for (size_t i = 0; i < count; i++) {
        const json_t *item = json_array_get(value, i);
        if (!json_is_number(item)) return false;
        values[i] = json_number_value(item);
    }
    return true;
}

static tl_status wrong(tl_ctx *ctx, const char *name, const char *what)
{
    return tl_fail(ctx, TL_ERR_FORMAT, "'%s': %s", name, what);
}

/* Files that give both view angle and scale mean perspective, unless they say otherwise. */
static bool is_parallel(const json_t *object)
{
    const json_t *flag = find(object, "parallel_projection");
    if (!flag) return !find(object, "view_angle");
    return json_is_true(flag) || (json_is_number(flag) && json_number_value(flag) != 0);
}

static tl_status fill(tl_ctx *ctx, const char *name, const json_t *object, tl_camera *camera)
{
    double size[2] = {camera->size_px[0], camera->size_px[1]};
    if (!json_is_object(object)) return wrong(ctx, name, "expected a JSON object with a camera");
    const json_t *inner = find(object, "camera");
    if (inner && json_is_object(inner)) object = inner;
    if (!find(object, "position") || !find(object, "focal_point"))
        return wrong(ctx, name, "the camera has no position, or no focal_point");
    if (!read_reals(object, "position", camera->position, 3))
        return wrong(ctx, name, "position: expected three numbers");
    if (!read_reals(object, "focal_point", camera->focal_point, 3))
        return wrong(ctx, name, "focal_point: expected three numbers");
    if (!read_reals(object, "view_up", camera->view_up, 3))
        return wrong(ctx, name, "view_up: expected three numbers");
    if (!read_reals(object, "view_angle", &camera->view_angle, 1))
        return wrong(ctx, name, "view_angle: expected degrees");
    if (!read_reals(object, "parallel_scale", &camera->parallel_scale, 1))
        return wrong(ctx, name, "parallel_scale: expected a length");
    if (!read_reals(object, "size", size, 2) || !(size[0] >= 1 && size[0] <= SIDE_MOST) ||
        !(size[1] >= 1 && size[1] <= SIDE_MOST))
        return wrong(ctx, name, "size: expected two numbers of pixels, 1 to 65536");
    for (int i = 0; i < 2; i++) camera->size_px[i] = (uint32_t)size[i];
    if (!is_parallel(object)) camera->parallel_scale = 0;
    if (!tl_camera_check(ctx, camera)) return TL_OK;
    /* its line of message stays */
    return tl_note(ctx, TL_ERR_FORMAT, "in the camera file '%s'", name);
}

tl_status tli_json_cameras(tl_ctx *ctx, const char *name, char *text, size_t bytes, bool alone,
                           tl_camera **cameras, size_t *count)
{
    tli_json json;
    tl_status st = tli_json_load(ctx, name, text, bytes, false, &json);
    if (st) return st;
    const json_t *list = json_is_object(json.root) ? find(json.root, "cameras") : json.root;
    const bool is_list = !alone && json_is_array(list);
    const size_t wanted = is_list ? json_array_size(list) : 1;
    if (!wanted) st = wrong(ctx, name, "a list without cameras");
    tl_camera *made = tl_mem_zalloc(ctx, wanted, sizeof *made, &st);
    for (size_t i = 0; !st && i < wanted; i++) {
        made[i] = tl_camera_defaults();
        st = fill(ctx, name, is_list ? json_array_get(list, i) : json.root, &made[i]);
    }
    tli_json_unload(ctx, &json);
    if (st) {
        tl_mem_free(ctx, made);
        return st;
    }
    *cameras = made;
    *count = wanted;
    return TL_OK;
}
