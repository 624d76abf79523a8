/* Cameras in JSON files. */
#ifndef TETRALOD_CLI_CAMERA_H
#define TETRALOD_CLI_CAMERA_H

#include "cli_session.h"

/* Reads a camera: an object with position, focal_point, view_up (three numbers each), view_angle
 * (degrees) or parallel_scale, and size (two numbers, pixels); names as VTK writes them (Position,
 * FocalPoint ...) will do, and what is missing takes its default. Returns an exit status; the
 * message is out already. */
int cli_camera_read(tl_ctx *ctx, const char *path, tl_camera *camera);
/* The same of a list of such objects, alone or under "cameras", or of a single one. Gives *cameras
 * [*count] (tl_mem_free). */
int cli_cameras_read(tl_ctx *ctx, const char *path, tl_camera **cameras, size_t *count);
/* Writes what both read: an object, or a list of several. */
int cli_cameras_write(const char *path, const tl_camera *cameras, size_t count);

#endif
