/* Stage scene, internal: what stands in JSON. The files *_jansson.c read it; a build without the
 * library has no such files, and what asks for them is refused. */
#ifndef TETRALOD_SRC_SCENE_JSON_H
#define TETRALOD_SRC_SCENE_JSON_H

#include "scene/scene.h"

/* Each reads text [bytes], which it may change; name stands for the file in messages. */
tl_status tli_json_scene(tl_ctx *ctx, const char *name, char *text, size_t bytes, tl_scene **scene);

#endif
