/* What is made of a mesh before it is looked at: channels of expressions, and the part of it that
 * thresholds, regions and planes choose. */
#ifndef TETRALOD_CLI_DERIVE_H
#define TETRALOD_CLI_DERIVE_H

#include "cli_session.h"

/* --derive, --threshold, --regions, --hide-regions, --clip. */
extern const cli_group cli_group_derive;

/* True if there are such words; if they choose a part of the mesh. */
bool cli_derive_given(const cli_session *session);
bool cli_derive_chooses(const cli_session *session);
/* Adds channels to *mesh, and puts the part that is chosen in its place. bounds: of the whole data
 * set (x0, x1, y0, y1, z0, z1), for planes in percent. Returns an exit status; the message is out
 * already, *mesh then is there all the same. */
int cli_derive(cli_session *session, const double bounds[6], tl_mesh **mesh);

#endif
