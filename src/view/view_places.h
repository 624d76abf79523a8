/* Stage view, internal: what a content that has no mesh of its cut knows of places. */
#ifndef TETRALOD_SRC_VIEW_PLACES_H
#define TETRALOD_SRC_VIEW_PLACES_H

#include "view/view.h"
#include "view/view_ray.h"

/* Of the patches of the view's cut, with the channels that it has. Gives *places. */
tl_status tli_places_create(tl_ctx *ctx, const tl_view *view, double time, tli_places **places);
/* NULL is allowed. */
void tli_places_destroy(tli_places *places);
/* A mesh of all patches that may hold x, or pass a line. Gives *body, used; NULL: there are none.
 * Any thread. */
tl_status tli_places_around(tl_ctx *ctx, tli_places *places, const double x[3], tli_body **body);
tl_status tli_places_along(tl_ctx *ctx, tli_places *places, const tli_sight *sight,
                           tli_body **body);
/* The name of a channel of these meshes; it lives as long as places. */
const char *tli_places_channel(const tli_places *places, size_t channel);
/* Lets the names of a probe be the model's, and lists all channels, without values, where there is
 * no mesh (body NULL). */
tl_status tli_places_name(tl_ctx *ctx, const tli_places *places, tl_probe *probe);

#endif
