/* Stage model, internal: the file that says how far a build got. */
#ifndef TETRALOD_SRC_MODEL_STATE_H
#define TETRALOD_SRC_MODEL_STATE_H

#include "model/model_work.h"

#define TLI_STATE_NAME "state.work"

/* Proves the mapped state, sets the stage, gives what the build was asked. TL_ERR_FORMAT. */
tl_status tli_state_begin(tli_work *work, const char *path, char **asked);

#endif
