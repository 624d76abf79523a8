/* Cameras that words of the command line ask for. */
#include "cli_camera.h"

#include <stdio.h>

int cli_picture_size(const cli_session *session, uint32_t samples, uint32_t size[2])
{
    char rest;
    const char *text = cli_get(session, CLI_PICTURE_SIZE)->text;
    if (sscanf(text, "%5ux%5u%c", &size[0], &size[1], &rest) == 2 && size[0] && size[1] &&
        size[0] * samples <= CLI_SIDE_MAX && size[1] * samples <= CLI_SIDE_MAX)
        return CLI_DONE;
    return cli_misuse(session->args.verb, "--size %s: expected WxH of at most %u rays a side", text,
                      CLI_SIDE_MAX);
}

int cli_view_read(const cli_session *session, double view[3])
{
    const char *text = cli_get(session, CLI_VIEW)->text;
    if (tl_view_read(text, view)) return CLI_DONE;
    return cli_misuse(session->args.verb,
                      "--view %s: expected AZ,EL or AZ,EL,ZOOM with a zoom above 0, or +x -x +y -y "
                      "+z -z iso",
                      text);
}

int cli_camera_read(cli_session *session, const char *path, tl_camera *camera)
{
    tl_status st = tl_camera_read(session->ctx, path, camera);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

int cli_camera_choose(cli_session *session, const double bounds[6], const uint32_t size[2],
                      tl_camera *camera)
{
    double view[3];
    const cli_value *file = cli_get(session, CLI_CAMERA);
    int failed = cli_view_read(session, view);
    if (failed) return failed;
    *camera = tl_camera_fit(bounds, view[0], view[1], view[2], size[0], size[1]);
    if (file->given) failed = cli_camera_read(session, file->text, camera);
    for (int i = 0; i < 2; i++) camera->size_px[i] = size[i];
    return failed;
}
