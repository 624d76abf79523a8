/* Stage model, internal: what segments tell their neighbours about vertices that they share. A
 * vertex's segments are neighbours of each other, so whoever holds it hears all. */
#ifndef TETRALOD_SRC_MODEL_MAIL_H
#define TETRALOD_SRC_MODEL_MAIL_H

#include "model/model_depot.h"
#include "tetralod/segment.h"

typedef struct tli_mail {
    tli_depot *depot;
    const tl_segments *segments;
    uint64_t *places; /* [segments] in the depot */
    uint32_t *counts; /* [segments] words */
} tli_mail;

tl_status tli_mail_open(tl_ctx *ctx, const char *folder, const tl_segments *segments,
                        tli_mail *mail);
void tli_mail_close(tl_ctx *ctx, tli_mail *mail);
/* Forgets all words. */
void tli_mail_clear(tli_mail *mail);

/* What a segment says. Several threads may put, each for other segments. */
tl_status tli_mail_put(tl_ctx *ctx, tli_mail *mail, uint32_t segment, const uint64_t *words,
                       size_t count);
/* What the segment and its neighbours said, ascending, repetitions included. Gives *words. */
tl_status tli_mail_gather(tl_ctx *ctx, const tli_mail *mail, uint32_t segment, uint64_t **words,
                          size_t *count);
/* Marks the segments that said something and their neighbours: list [segments] receives them,
 * ascending. Returns their number. */
size_t tli_mail_list(const tli_mail *mail, uint8_t *marks, uint32_t *list);

#endif
