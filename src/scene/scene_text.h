/* Stage scene, internal: JSON as text. Written by hand: numbers in their fewest digits, the same
 * bytes in any locale and any build. */
#ifndef TETRALOD_SRC_SCENE_TEXT_H
#define TETRALOD_SRC_SCENE_TEXT_H

#include "scene/scene.h"

/* The most bytes that a file may have: no more are read, so no more are written. */
#define TLI_JSON_BYTES_MOST ((size_t)16 << 20)

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
/* The first failure, TL_ERR_UNSUPPORTED for more text than is read again. */
tl_status tli_text_check(const tli_text *t);
/* Writes the file, which appears only when complete, and frees the text. */
tl_status tli_text_save(tli_text *t, const char *path);

#endif
