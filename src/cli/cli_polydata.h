/* What verbs share that write points, lines or triangles of a model or a file. */
#ifndef TETRALOD_CLI_POLYDATA_H
#define TETRALOD_CLI_POLYDATA_H

#include "cli_volume.h"

/* Checks -o OUT: it is there, a file of cells of that kind ends so (endings: in words), and its
 * folder is there. Returns an exit status; the message is out already. */
int cli_polydata_output(const cli_session *session, tl_poly_kind kind, const char *endings);
/* Writes it to -o OUT; *seconds receives the time that took. */
tl_status cli_polydata_save(cli_session *session, const tl_polydata *polydata, double *seconds);
/* The end of a summary: notes, and what was written. */
void cli_polydata_print(cli_session *session, double write_seconds);
/* Adds to an object what was read, seconds and facts of the run; prints and releases it. */
void cli_polydata_json(json_t *object, const cli_session *session, const cli_volume *volume,
                       double seconds, double write_seconds);

#endif
