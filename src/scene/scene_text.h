/* Stage scene, internal: JSON as text. Written by hand: numbers in their fewest digits, the same
 * bytes in any locale and any build. */
#ifndef TETRALOD_SRC_SCENE_TEXT_H
#define TETRALOD_SRC_SCENE_TEXT_H

#include "scene/scene.h"

/* Text that grows; after a failure nothing is done any more. */
typedef struct tli_text {
    tl_ctx *ctx;
    tl_status st;
    char *text; /* [bytes] and a 0 */
    size_t bytes, room;
} tli_text;
void tli_text_put(tli_text *t, const char *text);
void tli_text_put_real(tli_text *t, double real);
/* Between quotes; control characters and bytes that are no UTF-8 become "?". */
void tli_text_put_quoted(tli_text *t, const char *text);
/* Between brackets. */
void tli_text_put_reals(tli_text *t, const double *reals, size_t count);
/* Writes the file, which appears only when complete, and frees the text. Gives the first failure.
 */
tl_status tli_text_save(tli_text *t, const char *path);

#endif
