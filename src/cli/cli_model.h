/* Models (.tlod) on the command line, and what they share with meshes. */
#ifndef TETRALOD_CLI_MODEL_H
#define TETRALOD_CLI_MODEL_H

#include "cli_session.h"

/* What 'info' says of a model. Returns an exit status. */
int cli_info_store(cli_session *session, const char *path);

/* The keys of a mesh's measures; null where one is not known. */
void cli_json_stats(json_t *object, const tl_mesh_stats *stats);
/* The lines of a mesh's measures; time may be NaN. */
void cli_print_shape(const tl_mesh_stats *stats, double time, uint64_t tet_count);

#endif
