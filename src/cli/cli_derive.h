/* What is made of a mesh before it is looked at: channels of expressions, and the part of it that
 * thresholds, regions and planes choose. */
#ifndef TETRALOD_CLI_DERIVE_H
#define TETRALOD_CLI_DERIVE_H

#include "cli_session.h"
#include "tetralod/view.h"

/* --derive, --threshold, --regions, --hide-regions, --clip. */
extern const cli_group cli_group_derive;

/* True if there are such words. */
bool cli_derive_given(const cli_session *session);
/* Adds what they say to a scene; view and source: for planes and values in percent. Returns an exit
 * status; the message is out already. */
int cli_derive(cli_session *session, const tl_source *source, tl_view *view, tl_scene *scene);

#endif
