/* Words of segments to their neighbours, in a working file. */
#include "model/model_mail.h"

#include <stdlib.h>
#include <string.h>

tl_status tli_mail_open(tl_ctx *ctx, const char *folder, const tl_segments *segments,
                        tli_mail *mail)
{
    size_t count = tl_segments_count(segments);
    tl_status st = TL_OK;
    *mail = (tli_mail){.segments = segments};
    mail->places = tl_mem_zalloc(ctx, count, sizeof *mail->places, &st);
    mail->counts = tl_mem_zalloc(ctx, count, sizeof *mail->counts, &st);
    return st ? st : tli_depot_create(ctx, folder, &mail->depot);
}

void tli_mail_close(tl_ctx *ctx, tli_mail *mail)
{
    tli_depot_destroy(mail->depot);
    tl_mem_free(ctx, mail->counts);
    tl_mem_free(ctx, mail->places);
    *mail = (tli_mail){0};
}

void tli_mail_clear(tli_mail *mail)
{
    memset(mail->counts, 0, tl_segments_count(mail->segments) * sizeof *mail->counts);
    tli_depot_clear(mail->depot);
}

tl_status tli_mail_put(tl_ctx *ctx, tli_mail *mail, uint32_t segment, const uint64_t *words,
                       size_t count)
{
    mail->counts[segment] = (uint32_t)count;
    if (!count) return TL_OK;
    return tli_depot_put(ctx, mail->depot, words, count * sizeof *words, &mail->places[segment]);
}

static int by_value(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

tl_status tli_mail_gather(tl_ctx *ctx, const tli_mail *mail, uint32_t segment, uint64_t **words,
                          size_t *count)
{
    tl_status st = TL_OK;
    const tl_segment_summary summary = tl_segments_info(mail->segments, segment);
    size_t all = mail->counts[segment], at = 0;
    for (uint32_t i = 0; i < summary.neighbour_count; i++)
        all += mail->counts[summary.neighbours[i]];
    *count = all;
    *words = tl_mem_alloc(ctx, all, sizeof **words, &st);
    for (uint32_t i = 0; !st && i <= summary.neighbour_count; i++) {
        uint32_t from = i ? summary.neighbours[i - 1] : segment;
        if (!mail->counts[from]) continue;
        st = tli_depot_get(ctx, mail->depot, mail->places[from], *words + at,
                           mail->counts[from] * sizeof **words);
        at += mail->counts[from];
    }
    if (!st) qsort(*words, all, sizeof **words, by_value);
    return st;
}

size_t tli_mail_list(const tli_mail *mail, uint8_t *marks, uint32_t *list)
{
    size_t count = tl_segments_count(mail->segments), n = 0;
    memset(marks, 0, count);
    for (uint32_t s = 0; s < count; s++) {
        if (!mail->counts[s]) continue;
        marks[s] = 1;
        tl_segment_summary summary = tl_segments_info(mail->segments, s);
        for (uint32_t i = 0; i < summary.neighbour_count; i++) marks[summary.neighbours[i]] = 1;
    }
    for (uint32_t s = 0; s < count; s++)
        if (marks[s]) list[n++] = s;
    return n;
}
