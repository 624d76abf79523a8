/* Streamlines on the command line: of which channel, from which seeds. */
#ifndef TETRALOD_CLI_FLOW_H
#define TETRALOD_CLI_FLOW_H

#include "cli_session.h"
#include "tetralod/view.h"

/* What stands for SEEDS in help. */
#define CLI_SEEDS_WORDS                                                                            \
    "grid[:N], critical[:N], box:X0,Y0,Z0,X1,Y1,Z1[:N], line:X0,Y0,Z0,X1,Y1,Z1[:N], "              \
    "plane:X,Y,Z,NX,NY,NZ[:N], or a file of lines of three numbers"

/* The channel of three components on vertices with that name, or the first one for NULL. Returns an
 * exit status; the message is out already. */
int cli_flow_channel(const cli_session *session, const tl_mesh *mesh, const char *name,
                     const tl_channel **channel);
/* Gives the lines of a channel from seeds as words. report may be NULL. Returns an exit status; the
 * message is out already. */
int cli_flow_trace(cli_session *session, const tl_mesh *mesh, const tl_channel *channel,
                   const char *seeds, const tl_stream_opts *opts, tl_polydata **lines,
                   tl_stream_report *report);

#endif
