/* The clerk: what lies under a pixel, and how much of the volume has which values. */
#include <math.h>
#include <string.h>

#include "live/live.h"

/* ---- probes ---- */

static tl_status probe(tl_live *live, const tli_live_slot *slot, const double px[2],
                       tl_probe *answer)
{
    tl_ctx *ctx = live->clerk.ctx;
    const tl_frame *f = &slot->frame;
    const tl_image image = {f->width, f->height, NULL, slot->depth};
    double xyz[3];
    bool is_hit = false;
    *answer = (tl_probe){.xyz = {(double)NAN, (double)NAN, (double)NAN}};
    tl_status st = tl_content_pick(ctx, f->content, &f->camera, px[0], px[1], &image, xyz, &is_hit);
    if (!st && is_hit) st = tl_content_probe(ctx, f->content, xyz, answer);
    return st;
}

/* An answer that was not taken. */
static void drop_answer(tl_live *live)
{
    if (!live->has_answered) return;
    tl_probe_release(live->clerk.ctx, &live->answered);
    tli_live_drop_content(live, live->answered_content);
    live->answered_content = NULL;
    live->has_answered = false;
}

/* With the lock; gives it for the work. */
static void answer_probe(tl_live *live)
{
    tli_live_slot *slot = live->probe_slot;
    const double px[2] = {live->probe_px[0], live->probe_px[1]};
    tl_probe answer = {0};
    live->probe_slot = NULL;
    live->clerk.job = TL_LIVE_PROBE;
    tli_live_unlock(live);
    tl_status st = probe(live, slot, px, &answer);
    tli_live_lock(live);
    if (live->probe_slot) { /* there is another question: nobody waits for this answer */
        tl_probe_release(live->clerk.ctx, &answer);
    } else if (st) {
        tli_live_failed(live, TL_LIVE_PROBE, st, tl_ctx_message(live->clerk.ctx));
    } else {
        live->answered = answer;
        live->answered_content = slot->content;
        slot->content->holds++;
        live->has_answered = true;
        tli_live_event(live, TL_LIVE_DONE, TL_LIVE_PROBE, "");
    }
    tli_live_drop_slot(live, slot);
}

void tl_live_probe(tl_live *live, double x_px, double y_px)
{
    tli_live_lock(live);
    if (live->last && live->last->content) {
        drop_answer(live);
        tli_live_forget(live, TL_LIVE_PROBE);
        tli_live_drop_slot(live, live->probe_slot);
        live->probe_slot = live->last;
        live->probe_slot->holds++;
        live->probe_px[0] = x_px;
        live->probe_px[1] = y_px;
        tli_bell_ring(&live->clerk.bell);
    }
    tli_live_unlock(live);
}

const tl_probe *tl_live_get_probe(tl_live *live)
{
    const tl_probe *probe = NULL;
    tli_live_lock(live);
    if (live->has_answered) {
        if (live->has_given) {
            tl_probe_release(live->clerk.ctx, &live->given);
            tli_live_drop_content(live, live->given_content);
        }
        live->given = live->answered;
        live->given_content = live->answered_content;
        live->has_given = true;
        live->has_answered = false;
        live->answered_content = NULL;
        probe = &live->given;
    }
    tli_live_unlock(live);
    return probe;
}

/* ---- histograms ---- */

static bool is_same(const tli_live_question *a, const tli_live_question *b)
{
    return a->values_stamp == b->values_stamp && a->logarithmic == b->logarithmic &&
           strcmp(a->channel, b->channel) == 0;
}

static void answer_histogram(tl_live *live)
{
    tli_live_source *source = live->source;
    tli_live_scene *scene = live->scene;
    tli_live_answer answer = {.question = live->question};
    answer.question.values_stamp = scene->values_stamp; /* another one by now: it is asked again */
    live->has_question = false;
    live->clerk.job = TL_LIVE_HISTOGRAM;
    source->holds++;
    scene->holds++;
    tli_live_unlock(live);
    answer.status = tl_source_histogram(live->clerk.ctx, source->source, scene->scene,
                                        answer.question.channel, answer.question.logarithmic,
                                        answer.counts.counts, TL_LIVE_BINS, answer.counts.range);
    tli_live_lock(live);
    if (source == live->source) {
        live->answers[live->next_answer] = answer;
        live->next_answer = (live->next_answer + 1) % TLI_LIVE_ANSWERS;
        if (live->answer_count < TLI_LIVE_ANSWERS) live->answer_count++;
        if (answer.status)
            tli_live_failed(live, TL_LIVE_HISTOGRAM, answer.status,
                            tl_ctx_message(live->clerk.ctx));
        else
            tli_live_event(live, TL_LIVE_DONE, TL_LIVE_HISTOGRAM, answer.question.channel);
    }
    tli_live_drop_scene(live, scene);
    tli_live_drop_source(live, source);
}

bool tl_live_histogram(tl_live *live, const char *channel, bool logarithmic, tl_live_counts *counts)
{
    tli_live_question question = {.logarithmic = logarithmic};
    bool found = false, failed = false;
    if (strlen(channel) >= sizeof question.channel) return false;
    strcpy(question.channel, channel);
    tli_live_lock(live);
    if (live->scene) question.values_stamp = live->scene->values_stamp;
    for (size_t i = 0; i < live->answer_count && !found && !failed; i++) {
        if (!is_same(&live->answers[i].question, &question)) continue;
        failed = live->answers[i].status != TL_OK;
        found = !failed;
        if (found) *counts = live->answers[i].counts;
    }
    if (!found && !failed && live->source && live->scene) {
        live->question = question;
        live->has_question = true;
        tli_bell_ring(&live->clerk.bell);
    }
    tli_live_unlock(live);
    return found;
}

/* ---- the thread ---- */

void tli_live_answer_all(void *arg)
{
    tli_live_worker *worker = arg;
    tl_live *live = worker->live;
    tli_live_lock(live);
    while (!live->is_ending) {
        worker->started_s = tli_clock_s();
        if (live->probe_slot)
            answer_probe(live);
        else if (live->has_question && live->source && live->scene)
            answer_histogram(live);
        else
            tli_live_sleep(live, &worker->bell, INFINITY);
    }
    tli_live_unlock(live);
}

void tli_live_answer_end(tl_live *live)
{
    drop_answer(live);
    if (live->has_given) tl_probe_release(live->clerk.ctx, &live->given);
    tli_live_drop_content(live, live->given_content);
    tli_live_drop_slot(live, live->probe_slot);
}
