/* JSON files: their text, and who reads it. */
#include <string.h>

#include "base/base_file.h"
#include "scene/scene_json.h"
#include "scene/scene_text.h"

#if !TETRALOD_WITH_JANSSON
static tl_status refuse(tl_ctx *ctx, const char *name)
{
    return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                   "'%s': this build reads no JSON (Debian package libjansson-dev)", name);
}

tl_status tli_json_scene(tl_ctx *ctx, const char *name, char *text, size_t bytes, tl_scene **scene)
{
    (void)text, (void)bytes, (void)scene;
    return refuse(ctx, name);
}

tl_status tli_json_points(tl_ctx *ctx, const char *name, char *text, size_t bytes, bool logarithmic,
                          tl_control_points **points)
{
    (void)text, (void)bytes, (void)logarithmic, (void)points;
    return refuse(ctx, name);
}

tl_status tli_json_cameras(tl_ctx *ctx, const char *name, char *text, size_t bytes, bool alone,
                           tl_camera **cameras, size_t *count)
{
    (void)text, (void)bytes, (void)alone, (void)cameras, (void)count;
    return refuse(ctx, name);
}
#endif

/* Gives a copy of the bytes, terminated (tl_mem_free). */
static tl_status copy_text(tl_ctx *ctx, const char *name, const void *bytes, uint64_t byte_count,
                           char **text)
{
    tl_status st = TL_OK;
    *text = NULL;
    if (byte_count > TLI_JSON_BYTES_MOST)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': %llu bytes of JSON, expected at most %zu", name,
                       (unsigned long long)byte_count, TLI_JSON_BYTES_MOST);
    *text = tl_mem_alloc(ctx, (size_t)byte_count + 1, 1, &st);
    if (st) return st;
    if (byte_count) memcpy(*text, bytes, (size_t)byte_count);
    (*text)[byte_count] = '\0';
    return TL_OK;
}

/* The same of a file. */
static tl_status read_text(tl_ctx *ctx, const char *path, char **text, size_t *bytes)
{
    tli_map map;
    *text = NULL;
    *bytes = 0;
    tl_status st = tli_map_open_within(ctx, path, TLI_JSON_BYTES_MOST, &map);
    if (st) return st;
    st = copy_text(ctx, path, map.bytes, map.byte_count, text);
    if (!st) *bytes = (size_t)map.byte_count;
    tli_map_close(ctx, &map);
    return st;
}

tl_status tl_scene_read(tl_ctx *ctx, const char *path, tl_scene **scene)
{
    char *text;
    size_t bytes;
    *scene = NULL;
    tl_status st = read_text(ctx, path, &text, &bytes);
    if (!st) st = tli_json_scene(ctx, path, text, bytes, scene);
    tl_mem_free(ctx, text);
    return st ? tl_note(ctx, st, "while reading the scene '%s'", path) : TL_OK;
}

tl_status tl_scene_read_text(tl_ctx *ctx, const char *name, const char *text, size_t bytes,
                             tl_scene **scene)
{
    char *copy;
    *scene = NULL;
    tl_status st = copy_text(ctx, name, text, bytes, &copy);
    if (!st) st = tli_json_scene(ctx, name, copy, bytes, scene);
    tl_mem_free(ctx, copy);
    return st ? tl_note(ctx, st, "while reading the scene '%s'", name) : TL_OK;
}

tl_status tl_control_points_read(tl_ctx *ctx, const char *path, bool logarithmic,
                                 tl_control_points **points)
{
    char *text;
    size_t bytes;
    *points = NULL;
    tl_status st = read_text(ctx, path, &text, &bytes);
    if (!st) st = tli_json_points(ctx, path, text, bytes, logarithmic, points);
    tl_mem_free(ctx, text);
    return st;
}

static tl_status read_cameras(tl_ctx *ctx, const char *path, bool alone, tl_camera **cameras,
                              size_t *count)
{
    char *text;
    size_t bytes;
    *cameras = NULL;
    *count = 0;
    tl_status st = read_text(ctx, path, &text, &bytes);
    if (!st) st = tli_json_cameras(ctx, path, text, bytes, alone, cameras, count);
    tl_mem_free(ctx, text);
    return st;
}

tl_status tl_cameras_read(tl_ctx *ctx, const char *path, tl_camera **cameras, size_t *count)
{
    return read_cameras(ctx, path, false, cameras, count);
}

tl_status tl_camera_read(tl_ctx *ctx, const char *path, tl_camera *camera)
{
    size_t count;
    tl_camera *read;
    tl_status st = read_cameras(ctx, path, true, &read, &count);
    if (!st) *camera = *read;
    tl_mem_free(ctx, read);
    return st;
}
