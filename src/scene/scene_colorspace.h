/* Stage scene, internal: ways from one control point of a transfer function to the next, as
 * ParaView and VTK go them. */
#ifndef TETRALOD_SRC_SCENE_COLORSPACE_H
#define TETRALOD_SRC_SCENE_COLORSPACE_H

#include <stdbool.h>

typedef enum tli_color_space {
    TLI_SPACE_RGB,
    TLI_SPACE_HSV,
    TLI_SPACE_HSV_WRAP, /* the short way around the circle of hues */
    TLI_SPACE_LAB,
    TLI_SPACE_DIVERGING, /* polar Lab; through white between different hues */
    TLI_SPACE_STEP       /* the second colour on all of the way */
} tli_color_space;

/* The space of a name in ParaView's JSON (of CIEDE2000: Lab); false for an unknown one. */
bool tli_color_space_named(const char *name, tli_color_space *space);

/* The colour at a part t, 0 to 1, of the way from a to b; all sRGB, 0 to 1. */
void tli_color_between(tli_color_space space, const double a[3], const double b[3], double t,
                       double rgb[3]);

/* The opacity at a part t of the way from a to b. middle: the part where half of the change is
 * done; sharpness 0 a straight line, 1 a step; both 0 to 1. */
double tli_opacity_between(double a, double b, double middle, double sharpness, double t);

#endif
