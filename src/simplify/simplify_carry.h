/* Stage simplify, internal: the original vertices, each kept with the tet that holds it, so that a
 * bound on the field error is tested at every one of them before a collapse is made. */
#ifndef TETRALOD_SRC_SIMPLIFY_CARRY_H
#define TETRALOD_SRC_SIMPLIFY_CARRY_H

#include "simplify/simplify_hood.h"

/* bounds [opts->channel_count] in the channels' units, INFINITY for none; channel_scales as in
 * tli_work_create. Sets work->carry. */
tl_status tli_carry_create(tli_work *work, const tl_mesh *mesh, const tl_simplify_opts *opts,
                           const double *channel_scales, const double *bounds);
void tli_carry_destroy(tl_ctx *ctx, tli_carry *carry);

/* What a hood needs for it. */
tl_status tli_carried_create(tl_ctx *ctx, tli_carried **carried);
void tli_carried_destroy(tl_ctx *ctx, tli_carried *carried);

/* Relocates the vertices around the edge in the tets that the collapse would leave; *fine tells
 * whether each stays within its bounds. */
tl_status tli_carry_test(tli_work *work, tli_hood *hood, bool *fine);
/* Makes the result of the last test true. */
void tli_carry_commit(tli_work *work, tli_hood *hood);

#endif
