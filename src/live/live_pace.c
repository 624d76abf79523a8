/* The pace of frames. Pixels come first, since they can be had again in the next frame; tets follow
 * only where the fewest pixels are too many, or all of them leave time. Going up takes frames in a
 * row, and a prediction well under the goal, so that it does not go up and down. */
#include <math.h>

#include "live/live_pace.h"

static const double GOAL_S = 0.1;
static const double GOAL_LEAST_S = 0.005;
/* Parts of the goal: aimed at; from here on fewer pixels; up to here, predicted, more. */
static const double AIM = 0.85, TOO_LONG = 1.0, ROOMY = 0.65;
/* Part of the goal that a mesh of more tets may take and be kept while something moves: motion that
 * is smooth is worth more than triangles that are smaller than the pixels of its frames. */
static const double KEPT = 0.5;
/* Weight of the newest frame. */
static const double NEWEST = 0.4;
/* Frames in a row before there are more pixels, and before there are other tets. */
enum { FRAMES_UP = 4, FRAMES_TETS = 4 };
enum { REDUCTION_FIRST = 2 };
enum { TETS_FIRST = 200000, TETS_LEAST = 20000, TETS_MOST = 4000000 };
/* Part of the goal that a frame of all pixels leaves before there are more tets. */
static const double IDLE = 0.35;
/* Part of a frame's time that may not become less with fewer pixels: what is done for each vertex.
 */
static const double STAYS = 0.5;

tli_pace tli_pace_start(void)
{
    return (tli_pace){.goal_s = GOAL_S, .reduction = REDUCTION_FIRST, .tets = TETS_FIRST};
}

void tli_pace_ask(tli_pace *pace, double goal_s, uint64_t tets)
{
    pace->goal_s = goal_s > GOAL_LEAST_S ? goal_s : GOAL_LEAST_S;
    if (tets)
        pace->tets = tets;
    else if (pace->tets_asked)
        pace->tets = TETS_FIRST;
    pace->tets_asked = tets;
}

static void go_to(tli_pace *pace, uint32_t reduction, double frame_s)
{
    pace->reduction = reduction;
    pace->frame_s = frame_s;
    pace->light = pace->heavy = 0;
}

/* What a frame of another reduction takes if all of it went into pixels, which is the most when
 * there are more of them, and the least when there are fewer. */
static double predict(const tli_pace *pace, uint32_t reduction)
{
    double ratio = (double)pace->reduction / reduction;
    return pace->frame_s * ratio * ratio;
}

static void change_tets(tli_pace *pace, uint64_t drawn)
{
    if (pace->tets_asked) return;
    uint64_t tets = pace->tets;
    if (pace->heavy >= FRAMES_TETS) {
        /* of what was drawn, which may be less than what was allowed */
        tets = (drawn < tets ? drawn : tets) / 2;
    } else if (pace->light >= FRAMES_TETS && drawn > tets / 2) {
        tets *= 2;
    } else {
        return;
    }
    pace->tets = tets < TETS_LEAST ? TETS_LEAST : tets > TETS_MOST ? TETS_MOST : tets;
    pace->light = pace->heavy = 0;
}

/* What a picture takes that has so many times the rays. */
static double by_rays(double rays)
{
    return STAYS + (1 - STAYS) * rays;
}

bool tli_pace_holds(const tli_pace *pace, double rest_s)
{
    const double fewer = 1.0 / (REDUCTION_FIRST * REDUCTION_FIRST);
    return rest_s > 0 && rest_s * by_rays(fewer) <= KEPT * pace->goal_s;
}

double tli_pace_unsampled(double seconds, uint32_t samples)
{
    return seconds / by_rays((double)samples * samples);
}

void tli_pace_rest(tli_pace *pace, uint64_t tets, double seconds)
{
    /* a ray meets tets by their cube root */
    double fewer = tets > pace->tets ? cbrt((double)pace->tets / (double)tets) : 1;
    uint32_t next = 1;
    while (next < TLI_PACE_REDUCTION_MAX && seconds * fewer / (next * next) > AIM * pace->goal_s)
        next++;
    if (next > pace->reduction) go_to(pace, next, 0);
}

void tli_pace_add(tli_pace *pace, uint32_t reduction, uint64_t tets, double seconds)
{
    if (reduction != pace->reduction) return; /* begun before the last change */
    pace->frame_s =
        pace->frame_s > 0 ? pace->frame_s + NEWEST * (seconds - pace->frame_s) : seconds;
    if (pace->frame_s > TOO_LONG * pace->goal_s) {
        uint32_t next = pace->reduction;
        while (next < TLI_PACE_REDUCTION_MAX && predict(pace, next) > AIM * pace->goal_s) next++;
        pace->light = 0;
        if (next > pace->reduction)
            go_to(pace, next, 0);
        else
            pace->heavy++;
    } else if (pace->reduction > 1) {
        pace->heavy = 0;
        bool more = predict(pace, pace->reduction - 1) < ROOMY * pace->goal_s;
        pace->light = more ? pace->light + 1 : 0;
        if (pace->light >= FRAMES_UP) go_to(pace, pace->reduction - 1, 0);
    } else {
        pace->heavy = 0;
        pace->light = pace->frame_s < IDLE * pace->goal_s ? pace->light + 1 : 0;
    }
    change_tets(pace, tets);
}
