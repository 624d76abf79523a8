/* Cameras in JSON, as VTK names them, and views in words. */
#include "cli_camera.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* Most rays along a side of a picture. */

/* Views by name: the side that is looked from. */
static const struct {
    const char *name;
    double azimuth, elevation;
} VIEWS[] = {{"+x", 90, 0},
             {"-x", 270, 0},
             {"+y", 180, 0},
             {"-y", 0, 0},
             {"+z", 0, 90},
             {"-z", 180, -90},
             {"iso", 45, 35.264389682754654}};

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

static int fill_checked(tl_ctx *ctx, const char *path, const json_t *object, tl_camera *camera)
{
    *camera = tl_camera_defaults();
    int exit_status = fill(path, object, camera);
    if (!exit_status && tl_camera_check(ctx, camera))
        exit_status = wrong(path, tl_ctx_message(ctx));
    return exit_status;
}

int cli_camera_read(tl_ctx *ctx, const char *path, tl_camera *camera)
{
    json_t *root;
    int exit_status = cli_json_read(ctx, path, false, &root);
    if (exit_status) return exit_status;
    exit_status = fill_checked(ctx, path, root, camera);
    json_decref(root);
    return exit_status;
}

int cli_cameras_read(tl_ctx *ctx, const char *path, tl_camera **cameras, size_t *count)
{
    json_t *root;
    tl_status st = TL_OK;
    *cameras = NULL;
    *count = 0;
    int exit_status = cli_json_read(ctx, path, false, &root);
    if (exit_status) return exit_status;
    const json_t *list = json_is_object(root) ? find(root, "cameras") : root;
    const size_t wanted = json_is_array(list) ? json_array_size(list) : 1;
    if (!wanted) exit_status = wrong(path, "a list without cameras");
    if (!exit_status) *cameras = tl_mem_zalloc(ctx, wanted, sizeof **cameras, &st);
    if (st) exit_status = wrong(path, tl_ctx_message(ctx));
    for (size_t i = 0; !exit_status && i < wanted; i++)
        exit_status = fill_checked(ctx, path, json_is_array(list) ? json_array_get(list, i) : root,
                                   &(*cameras)[i]);
    json_decref(root);
    *count = exit_status ? 0 : wanted;
    if (!exit_status) return exit_status;
    tl_mem_free(ctx, *cameras);
    *cameras = NULL;
    return exit_status;
}

static void put_camera(json_t *object, const tl_camera *camera)
{
    const double size[2] = {camera->size_px[0], camera->size_px[1]};
    cli_json_reals(object, "position", camera->position, 3);
    cli_json_reals(object, "focal_point", camera->focal_point, 3);
    cli_json_reals(object, "view_up", camera->view_up, 3);
    cli_json_real(object, "view_angle", camera->view_angle);
    if (camera->parallel_scale > 0) cli_json_real(object, "parallel_scale", camera->parallel_scale);
    cli_json_flag(object, "parallel_projection", camera->parallel_scale > 0);
    cli_json_reals(object, "size", size, 2);
}

int cli_cameras_write(const char *path, const tl_camera *cameras, size_t count)
{
    json_t *root = count == 1 ? json_object() : json_array();
    for (size_t i = 0; i < count; i++)
        put_camera(count == 1 ? root : cli_json_item(root), &cameras[i]);
    return cli_json_write(root, path);
}

int cli_picture_size(const cli_session *session, uint32_t samples, uint32_t size[2])
{
    char rest;
    const char *text = cli_get(session, CLI_PICTURE_SIZE)->text;
    if (sscanf(text, "%5ux%5u%c", &size[0], &size[1], &rest) == 2 && size[0] && size[1] &&
        size[0] * samples <= CLI_SIDE_MAX && size[1] * samples <= CLI_SIDE_MAX)
        return CLI_DONE;
    return cli_misuse(session->args.verb, "--size %s: expected WxH of at most %u rays a side", text,
                      CLI_SIDE_MAX);
}

int cli_view_read(const cli_session *session, double view[3])
{
    const char *text = cli_get(session, CLI_VIEW)->text;
    view[2] = 1;
    for (size_t i = 0; i < sizeof VIEWS / sizeof *VIEWS; i++) {
        const size_t length = strlen(VIEWS[i].name);
        if (strncmp(text, VIEWS[i].name, length) != 0 || (text[length] && text[length] != ','))
            continue;
        view[0] = VIEWS[i].azimuth;
        view[1] = VIEWS[i].elevation;
        if (!text[length]) return CLI_DONE;
        if (cli_parse_reals(text + length + 1, &view[2], 1) && view[2] > 0) return CLI_DONE;
    }
    if (!cli_parse_reals(text, view, 3) && !cli_parse_reals(text, view, 2))
        return cli_misuse(session->args.verb,
                          "--view %s: expected AZ,EL or AZ,EL,ZOOM, or +x -x +y -y +z -z iso",
                          text);
    if (!(view[2] > 0)) return cli_misuse(session->args.verb, "--view %s: a zoom is above 0", text);
    return CLI_DONE;
}

int cli_camera_choose(const cli_session *session, const double bounds[6], const uint32_t size[2],
                      tl_camera *camera)
{
    double view[3];
    const cli_value *file = cli_get(session, CLI_CAMERA);
    int failed = cli_view_read(session, view);
    if (failed) return failed;
    *camera = tl_camera_fit(bounds, view[0], view[1], view[2], size[0], size[1]);
    if (file->given) failed = cli_camera_read(session->ctx, file->text, camera);
    for (int i = 0; i < 2; i++) camera->size_px[i] = size[i];
    return failed;
}
