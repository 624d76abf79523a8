/* Stage scene, internal: what stands in JSON. The files *_jansson.c read it; a build without the
 * library has no such files, and what asks for them is refused. */
#ifndef TETRALOD_SRC_SCENE_JSON_H
#define TETRALOD_SRC_SCENE_JSON_H

#include "scene/scene.h"

/* Each reads text [bytes], which it may change; name stands for the file in messages. */
tl_status tli_json_scene(tl_ctx *ctx, const char *name, char *text, size_t bytes, tl_scene **scene);
tl_status tli_json_points(tl_ctx *ctx, const char *name, char *text, size_t bytes, bool logarithmic,
                          tl_control_points **points);
/* cameras [*count] (tl_mem_free); alone: the first object alone. */
tl_status tli_json_cameras(tl_ctx *ctx, const char *name, char *text, size_t bytes, bool alone,
                           tl_camera **cameras, size_t *count);

#endif
