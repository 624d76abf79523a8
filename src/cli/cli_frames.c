/* The picture and where it is taken from: its size, cameras of single pictures, orbits and key
 * frames. */
#include <math.h>
#include <string.h>

#include "cli_camera.h"
#include "cli_scene.h"

static const double PI = 3.14159265358979323846;
enum { FRAMES_MAX = 100000, ORBIT_POINTS = 72 };

/* ---- words ---- */

/* The place of "%d" or "%0Nd" in a name; NULL if there is none. *length is its own. */
static const char *find_pattern(const char *name, size_t *length)
{
    for (const char *at = name; (at = strchr(at, '%')) != NULL; at++) {
        const size_t digits = strspn(at + 1, "0123456789");
        *length = digits + 2;
        if (at[digits + 1] == 'd' && digits <= 2) return at;
    }
    return NULL;
}

static int set_frames(const cli_session *session, cli_picture *p)
{
    size_t length;
    const char *out = cli_get(session, CLI_OUTPUT)->text;
    p->frame_count = (size_t)cli_get(session, CLI_FRAMES)->count;
    p->orbit = cli_get(session, CLI_ORBIT)->real;
    p->has_pattern = find_pattern(out, &length) != NULL;
    if (p->frame_count > 1 && !p->has_pattern)
        return cli_misuse(session->args.verb,
                          "'%s': the name of several frames needs a number, as frame_%%04d.png",
                          out);
    return CLI_DONE;
}

int cli_picture_words(const cli_session *session, cli_picture *picture)
{
    const char *out = cli_get(session, CLI_OUTPUT)->text;
    const size_t length = out ? strlen(out) : 0;
    if (!out) return cli_misuse(session->args.verb, "-o OUT.png is missing");
    if (length < 4 || length >= CLI_PATH_BYTES - 32 || strcmp(out + length - 4, ".png") != 0)
        return cli_misuse(session->args.verb, "'%s': the name must end in .png", out);
    uint32_t size[2] = {0};
    const cli_value *samples = cli_get(session, CLI_SAMPLES);
    int failed = cli_picture_size(session, samples->given ? (uint32_t)samples->count : 1, size);
    picture->width = size[0];
    picture->height = size[1];
    if (!failed) failed = set_frames(session, picture);
    return failed ? failed : cli_output_folder(out);
}

void cli_picture_name(const cli_session *session, const cli_picture *picture, size_t frame,
                      char name[CLI_PATH_BYTES])
{
    size_t length;
    const char *out = cli_get(session, CLI_OUTPUT)->text;
    const char *at = picture->has_pattern ? find_pattern(out, &length) : NULL;
    if (!at) {
        snprintf(name, CLI_PATH_BYTES, "%s", out);
        return;
    }
    int digits = 0;
    sscanf(at + 1, "%2d", &digits);
    snprintf(name, CLI_PATH_BYTES, "%.*s%0*zu%s", (int)(at - out), out, digits, frame, at + length);
}

/* ---- cameras ---- */

/* Turns a vector around an axis of length 1 (Rodrigues). */
static void turn(const double axis[3], double degrees, const double v[3], double out[3])
{
    const double c = cos(degrees * PI / 180), s = sin(degrees * PI / 180);
    const double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        out[k] = v[k] * c + (axis[i] * v[j] - axis[j] * v[i]) * s + axis[k] * along * (1 - c);
    }
}

/* The corners of the box; for an orbit from all of its sides. Returns their number. */
static size_t corners_of(const double bounds[6], const cli_picture *p, double (*points)[3])
{
    const size_t turns = p->orbit != 0 && p->frame_count > 1 ? ORBIT_POINTS : 1;
    for (size_t i = 0; i < 8 * turns; i++) {
        double from[3], turned[3];
        for (size_t k = 0; k < 3; k++) from[k] = bounds[2 * k + ((i & 7) >> k & 1)] - p->pivot[k];
        turn(p->axis, p->orbit * (double)(i / 8) / (double)turns, from, turned);
        for (size_t k = 0; k < 3; k++) points[i][k] = p->pivot[k] + turned[k];
    }
    return 8 * turns;
}

/* Whether a scene has a camera of its own that the words leave as it is. */
static bool has_camera(const cli_session *session, const tl_scene *scene)
{
    tl_value position;
    return !cli_get(session, CLI_VIEW)->given && !cli_get(session, CLI_CAMERA)->given &&
           !tl_scene_get(session->ctx, scene, TL_NODE_CAMERA + 1, "position", &position) &&
           position.count == 3;
}

int cli_picture_camera(cli_session *session, const tl_scene *scene, const double bounds[6],
                       const double window[4], cli_picture *picture)
{
    double view[3], points[8 * ORBIT_POINTS][3];
    const cli_value *file = cli_get(session, CLI_CAMERA);
    const bool is_own = picture->is_scenes = has_camera(session, scene);
    int failed = cli_view_read(session, view);
    if (!failed && file->given) {
        tl_status st =
            tl_cameras_read(session->ctx, file->text, &picture->keys, &picture->key_count);
        if (st) failed = cli_fail(session, session->ctx, st);
    }
    if (failed) return failed;
    if (picture->key_count || is_own) { /* around what it looks at */
        double length = 0;
        if (is_own)
            tl_scene_camera(scene, picture->width, picture->height, &picture->base);
        else
            picture->base = *picture->keys;
        const tl_camera *base = &picture->base;
        for (int k = 0; k < 3; k++) length += base->view_up[k] * base->view_up[k];
        for (int k = 0; k < 3; k++) {
            picture->pivot[k] = base->focal_point[k];
            picture->axis[k] = base->view_up[k] / sqrt(length);
        }
    } else { /* around the box, z up */
        for (int k = 0; k < 3; k++) {
            picture->pivot[k] = bounds[2 * k] / 2 + bounds[2 * k + 1] / 2;
            picture->axis[k] = k == 2;
        }
        picture->base = tl_camera_fit(bounds, view[0], view[1], 1, picture->width, picture->height);
        if (cli_get(session, CLI_PARALLEL)->given) picture->base.parallel_scale = 1;
        const size_t count = corners_of(bounds, picture, points);
        tl_camera_fit_points(&picture->base, points[0], count, window, view[2]);
    }
    return CLI_DONE;
}

/* Catmull and Rom's spline through four numbers, between the middle two. */
static double spline(const double p[4], double t)
{
    return p[1] + t / 2 *
                      (p[2] - p[0] +
                       t * (2 * p[0] - 5 * p[1] + 4 * p[2] - p[3] +
                            t * (3 * (p[1] - p[2]) + p[3] - p[0])));
}

/* The numbers of a camera that change between key frames stand in front of its size. */
enum { CAMERA_REALS = offsetof(tl_camera, size_px) / sizeof(double) };

/* Between key frames; at the first one for t = 0, the last one for 1. */
static tl_camera between_keys(const cli_picture *p, double t)
{
    const size_t last = p->key_count - 1;
    const double at = t * (double)last;
    const size_t key = at < (double)last ? (size_t)at : last - 1;
    const tl_camera *near[4];
    for (size_t i = 0; i < 4; i++) {
        const size_t number = key + i < 1 ? 0 : key + i - 1;
        near[i] = &p->keys[number > last ? last : number];
    }
    double numbers[4][CAMERA_REALS], between[CAMERA_REALS];
    for (size_t i = 0; i < 4; i++) memcpy(numbers[i], near[i], sizeof numbers[i]);
    for (size_t k = 0; k < CAMERA_REALS; k++)
        between[k] = spline((double[4]){numbers[0][k], numbers[1][k], numbers[2][k], numbers[3][k]},
                            at - (double)key);
    tl_camera camera = *near[1];
    memcpy(&camera, between, sizeof between);
    camera.view_angle = fmin(fmax(camera.view_angle, 0.01), 179);
    camera.parallel_scale = fmax(camera.parallel_scale, 0);
    return camera;
}

tl_camera cli_picture_frame(const cli_picture *picture, size_t frame)
{
    tl_camera camera = picture->base;
    const double frames = (double)picture->frame_count;
    if (picture->key_count > 1)
        camera = between_keys(picture, frames > 1 ? (double)frame / (frames - 1) : 0);
    const double degrees = picture->orbit * (double)frame / frames;
    if (degrees != 0) {
        double from[3], turned[3];
        for (int end = 0; end < 2; end++) {
            double *place = end ? camera.focal_point : camera.position;
            for (int k = 0; k < 3; k++) from[k] = place[k] - picture->pivot[k];
            turn(picture->axis, degrees, from, turned);
            for (int k = 0; k < 3; k++) place[k] = picture->pivot[k] + turned[k];
        }
        turn(picture->axis, degrees, camera.view_up, turned);
        memcpy(camera.view_up, turned, sizeof turned);
    }
    camera.size_px[0] = picture->width;
    camera.size_px[1] = picture->height;
    return camera;
}

void cli_picture_close(const cli_session *session, cli_picture *picture)
{
    tl_mem_free(session->ctx, picture->keys);
    picture->keys = NULL;
}
