/* Stage live, internal: how many pixels and tets a frame may have while something moves, from what
 * frames took. */
#ifndef TETRALOD_SRC_LIVE_PACE_H
#define TETRALOD_SRC_LIVE_PACE_H

#include <stdbool.h>
#include <stdint.h>

/* A pixel of the drawing is at most so many wide and high in the frame. */
#define TLI_PACE_REDUCTION_MAX 3u

typedef struct tli_pace {
    double goal_s;         /* of a frame */
    uint64_t tets_asked;   /* by the scene; 0: as it goes */
    uint32_t reduction;    /* 1 to TLI_PACE_REDUCTION_MAX */
    uint64_t tets;         /* most tets of a content that moves */
    double frame_s;        /* smoothed, at this reduction; 0: not known */
    unsigned light, heavy; /* frames in a row that would hold the goal with more; that do not hold
                              it with the fewest pixels */
} tli_pace;

tli_pace tli_pace_start(void);
/* What the scene asks for: seconds of a frame, tets or 0. */
void tli_pace_ask(tli_pace *pace, double goal_s, uint64_t tets);
/* A frame at rest, of all pixels and that many tets, took so long: what is to be expected when
 * something moves again. */
void tli_pace_rest(tli_pace *pace, uint64_t tets, double seconds);
/* Whether a content that takes so long at rest, all pixels (0: nobody knows), is drawn in time
 * while something moves. */
bool tli_pace_holds(const tli_pace *pace, double rest_s);
/* What a picture of all pixels took at rest with so many rays a pixel and side, of one ray. */
double tli_pace_unsampled(double seconds, uint32_t samples);
/* A frame took so long, with that reduction, of a content of so many tets. */
void tli_pace_add(tli_pace *pace, uint32_t reduction, uint64_t tets, double seconds);

#endif
