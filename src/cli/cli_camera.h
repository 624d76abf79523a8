/* Cameras: of files, and of views in words. */
#ifndef TETRALOD_CLI_CAMERA_H
#define TETRALOD_CLI_CAMERA_H

#include "tetralod/scene.h"

#include "cli_session.h"

/* As of tl_camera_read. Returns an exit status; the message is out already. */
int cli_camera_read(cli_session *session, const char *path, tl_camera *camera);

/* The most rays beside and above each other. */
enum { CLI_SIDE_MAX = 32768 };
/* --size WxH, of at most 32,768 pixels a side when each is samples wide. Returns an exit status. */
int cli_picture_size(const cli_session *session, uint32_t samples, uint32_t size[2]);
/* --view AZ,EL[,ZOOM] or the name of a side: azimuth and elevation in degrees, zoom. */
int cli_view_read(const cli_session *session, double view[3]);
/* What --camera FILE, or else --view of a box (x0, x1, y0, y1, z0, z1), says, for a picture of that
 * size. */
int cli_camera_choose(cli_session *session, const double bounds[6], const uint32_t size[2],
                      tl_camera *camera);

#endif
