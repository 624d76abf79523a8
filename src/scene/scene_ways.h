/* Stage scene, internal: control points of a file, and the straight pieces that follow the ways
 * between them. */
#ifndef TETRALOD_SRC_SCENE_WAYS_H
#define TETRALOD_SRC_SCENE_WAYS_H

#include "scene/scene.h"
#include "scene/scene_colorspace.h"

/* Numbers of a control point: a value, then red, green, blue or opacity, middle, sharpness. */
enum { TLI_POINT_NUMBERS = 4, TLI_FILE_POINTS_MAX = 1024 };

/* Points on their way to tl_control_points. */
typedef struct tli_points {
    tl_color_point colors[TL_SCENE_ROWS_MAX];
    tl_opacity_point opacities[TL_SCENE_ROWS_MAX];
    size_t color_count, opacity_count;
} tli_points;

typedef struct tli_way {
    const double *a, *b; /* [TLI_POINT_NUMBERS] set while ways are followed */
    bool is_color, logarithmic;
    tli_color_space space;
} tli_way;

/* Adds the points of all ways between control points [count][TLI_POINT_NUMBERS]. A way may begin or
 * end beside its control point: a step. */
void tli_ways_follow(const double *numbers, size_t count, tli_way w, tli_points *points);

#endif
