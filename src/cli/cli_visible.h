/* Which values are visible. */
#ifndef TETRALOD_CLI_VISIBLE_H
#define TETRALOD_CLI_VISIBLE_H

#include "cli_session.h"

/* From --iso CHANNEL=VALUE and --transfer [CHANNEL=]FILE: opacities of the bins of all channels,
 * for a query; the larger one where both say something, 0 where nothing is said. A file is a colour
 * map as ParaView writes it, also with trailing commas. Gives *opacity [channel_count][TL_BINS]
 * (tl_mem_free), NULL if neither option was given. Returns an exit status; the message is out
 * already. */
int cli_visible_read(cli_session *session, const tl_store_head *head, float **opacity);

/* Of isosurfaces of one channel at values [value_count]: every error shows. Gives *opacity. */
tl_status cli_visible_values(tl_ctx *ctx, const tl_store_head *head, uint32_t channel,
                             const double *values, size_t value_count, float **opacity);

#endif
