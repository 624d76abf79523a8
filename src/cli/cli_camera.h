/* Cameras: in JSON files, and of views in words. */
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

/* The most rays beside and above each other. */
enum { CLI_SIDE_MAX = 32768 };
/* --size WxH, of at most 32,768 pixels a side when each is samples wide. Returns an exit status. */
int cli_picture_size(const cli_session *session, uint32_t samples, uint32_t size[2]);
/* --view AZ,EL[,ZOOM] or the name of a side: azimuth and elevation in degrees, zoom. */
int cli_view_read(const cli_session *session, double view[3]);
/* What --camera FILE, or else --view of a box (x0, x1, y0, y1, z0, z1), says, for a picture of that
 * size. */
int cli_camera_choose(const cli_session *session, const double bounds[6], const uint32_t size[2],
                      tl_camera *camera);

#endif
