/* Stage scene, internal: JSON text to jansson's values. */
#ifndef TETRALOD_SRC_SCENE_LOAD_JANSSON_H
#define TETRALOD_SRC_SCENE_LOAD_JANSSON_H

#include <jansson.h>

#include "scene/scene_json.h"

/* Values, and what is taken from the budget for them: the library's memory is its own. */
typedef struct tli_json {
    json_t *root;
    void *reserve;
} tli_json;

/* Parses text [bytes]. commas: those before a closing bracket are forgiven, as in ParaView's files;
 * without, keys that come twice are refused. TL_ERR_FORMAT names the line. */
tl_status tli_json_load(tl_ctx *ctx, const char *name, char *text, size_t bytes, bool commas,
                        tli_json *json);
void tli_json_unload(tl_ctx *ctx, tli_json *json);

#endif
