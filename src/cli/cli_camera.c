/* Cameras in JSON, as VTK names them. */
#include "cli_camera.h"

#include <math.h>
#include <string.h>
#include <strings.h>

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

static int wrong(const char *path, const char *what)
{
    fprintf(stderr, "tetralod: '%s': %s\n", path, what);
    return CLI_FAILED;
}

static int fill(const char *path, const json_t *object, tl_camera *camera)
{
    double size[2] = {camera->size_px[0], camera->size_px[1]};
    if (!json_is_object(object)) return wrong(path, "expected a JSON object with a camera");
    const json_t *inner = find(object, "camera");
    if (inner && json_is_object(inner)) object = inner;
    if (!find(object, "position") || !find(object, "focal_point"))
        return wrong(path, "the camera has no position, or no focal_point");
    if (!read_reals(object, "position", camera->position, 3))
        return wrong(path, "position: expected three numbers");
    if (!read_reals(object, "focal_point", camera->focal_point, 3))
        return wrong(path, "focal_point: expected three numbers");
    if (!read_reals(object, "view_up", camera->view_up, 3))
        return wrong(path, "view_up: expected three numbers");
    if (!read_reals(object, "view_angle", &camera->view_angle, 1))
        return wrong(path, "view_angle: expected degrees");
    if (!read_reals(object, "parallel_scale", &camera->parallel_scale, 1))
        return wrong(path, "parallel_scale: expected a length");
    if (!read_reals(object, "size", size, 2) || !(size[0] >= 1 && size[0] <= 65536) ||
        !(size[1] >= 1 && size[1] <= 65536))
        return wrong(path, "size: expected two numbers of pixels, 1 to 65536");
    for (int i = 0; i < 2; i++) camera->size_px[i] = (uint32_t)size[i];
    /* files that give both mean perspective, unless they say otherwise */
    const json_t *parallel = find(object, "parallel_projection");
    bool is_parallel = parallel ? json_is_true(parallel) ||
                                      (json_is_number(parallel) && json_number_value(parallel) != 0)
                                : !find(object, "view_angle");
    if (!is_parallel) camera->parallel_scale = 0;
    return CLI_DONE;
}

int cli_camera_read(tl_ctx *ctx, const char *path, tl_camera *camera)
{
    json_error_t error;
    *camera = tl_camera_defaults();
    json_t *object = json_load_file(path, 0, &error);
    if (!object) {
        fprintf(stderr, "tetralod: can't read '%s' as JSON: line %d: %s\n", path, error.line,
                error.text);
        return CLI_FAILED;
    }
    int exit_status = fill(path, object, camera);
    if (!exit_status && tl_camera_check(ctx, camera))
        exit_status = wrong(path, tl_ctx_message(ctx));
    json_decref(object);
    return exit_status;
}
