/* What is to be told: events in the order in which they came, of progress the newest. */
#include <stdio.h>
#include <string.h>

#include "live/live.h"

/* Progress is told of work that has lasted for so long, and again after so long; seconds. */
static const double TELL_AFTER_S = 0.15, TELL_AGAIN_S = 0.05;

static tl_live_event *event_at(tl_live *live, size_t i)
{
    return &live->events[(live->event_first + i) % TLI_LIVE_EVENTS];
}

/* The oldest event goes, but none that tells of another file as long as there are others. */
static void make_place(tl_live *live)
{
    size_t gone = 0;
    while (gone < live->event_count && event_at(live, gone)->kind == TL_LIVE_OPENED) gone++;
    if (gone == live->event_count) gone = 0;
    for (; gone > 0; gone--) *event_at(live, gone) = *event_at(live, gone - 1);
    live->event_first = (live->event_first + 1) % TLI_LIVE_EVENTS;
    live->event_count--;
}

bool tli_live_has_gone_over(tl_live *live)
{
    bool found = false;
    for (size_t i = 0; i < live->event_count; i++)
        found |= event_at(live, i)->kind == TL_LIVE_OPENED;
    return found;
}

void tli_live_forget(tl_live *live, tl_live_job job)
{
    size_t kept = 0;
    for (size_t i = 0; i < live->event_count; i++)
        if (event_at(live, i)->job != job) *event_at(live, kept++) = *event_at(live, i);
    live->event_count = kept;
}

void tli_live_event(tl_live *live, tl_live_event_kind kind, tl_live_job job, const char *text)
{
    if (live->event_count == TLI_LIVE_EVENTS) make_place(live);
    tl_live_event *e = event_at(live, live->event_count++);
    *e = (tl_live_event){.kind = kind, .job = job};
    snprintf(e->text, sizeof e->text, "%s", text);
    live->has_progress[job] = false;
    if (kind == TL_LIVE_OPENED) live->last_failure[TL_LIVE_CONTENT][0] = 0;
    tli_live_tell(live);
}

void tli_live_failed(tl_live *live, tl_live_job job, tl_status status, const char *text)
{
    char *last = live->last_failure[job];
    bool repeats = job == TL_LIVE_CONTENT || job == TL_LIVE_DRAWING;
    if (repeats && strncmp(last, text, sizeof live->last_failure[job] - 1) == 0) return;
    snprintf(last, sizeof live->last_failure[job], "%s", text);
    tli_live_event(live, TL_LIVE_FAILED, job, text);
    event_at(live, live->event_count - 1)->status = status;
}

bool tli_live_progress(void *arg, const char *stage, uint64_t done, uint64_t total)
{
    tli_live_worker *worker = arg;
    tl_live *live = worker->live;
    double now = tli_clock_s();
    if (now - worker->started_s < TELL_AFTER_S || now - worker->told_s < TELL_AGAIN_S) return true;
    worker->told_s = now;
    tli_live_lock(live);
    tl_live_event *e = &live->progress[worker->job];
    *e =
        (tl_live_event){.kind = TL_LIVE_PROGRESS, .job = worker->job, .done = done, .total = total};
    snprintf(e->stage, sizeof e->stage, "%s", stage);
    live->has_progress[worker->job] = true;
    tli_live_tell(live);
    tli_live_unlock(live);
    return true;
}

bool tl_live_next_event(tl_live *live, tl_live_event *event)
{
    bool found = false;
    tli_live_lock(live);
    for (int job = 0; job < TL_LIVE_JOB_COUNT && !found; job++) {
        found = live->has_progress[job];
        if (found) *event = live->progress[job];
        live->has_progress[job] = false;
    }
    if (!found && live->event_count) {
        found = true;
        *event = live->events[live->event_first];
        live->event_first = (live->event_first + 1) % TLI_LIVE_EVENTS;
        live->event_count--;
        if (event->kind == TL_LIVE_OPENED) tli_live_drop_former(live);
    }
    tli_live_unlock(live);
    return found;
}
