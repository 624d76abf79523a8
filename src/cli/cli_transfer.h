/* Transfer functions on the command line: ParaView's JSON, colour maps, and a first look. */
#ifndef TETRALOD_CLI_TRANSFER_H
#define TETRALOD_CLI_TRANSFER_H

#include "tetralod/scene.h"

#include "cli_session.h"

enum { CLI_POINTS_MAX = TL_SCENE_ROWS_MAX };

/* Control points on their way to a tl_transfer. */
typedef struct cli_points {
    tl_color_point colors[CLI_POINTS_MAX];
    tl_opacity_point opacities[CLI_POINTS_MAX];
    size_t color_count, opacity_count;
    bool logarithmic; /* the file asks for a logarithmic scale */
} cli_points;

/* As of tl_control_points_read. Fills *points, which are zeros. Returns an exit status; the message
 * is out already. */
int cli_points_read(tl_ctx *ctx, const char *path, bool logarithmic, cli_points *points);

/* The colour map name over a range; false for an unknown name. */
bool cli_points_map(const char *name, const double range[2], cli_points *points);

/* Part of the volume whose values a first look leaves out at either end. */
#define CLI_TAIL 0.002

/* Opacities of a first look at finite values [count] with weights [count], over a range: the most
 * frequent value is clear, the others are the more opaque the farther from it they are. */
void cli_points_look(const double *values, const double *weights, size_t count,
                     const double range[2], cli_points *points);

#endif
