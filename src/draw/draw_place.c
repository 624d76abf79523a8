/* What of a volume every renderer makes ready for a view: its vertices on the picture, and its
 * gradients in float32. */
#include <math.h>

#include "base/base_vec.h"
#include "draw/draw_backend.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192 };
/* Gradients are cut off at as many times the unit they are measured in: their squares are numbers.
 */
static const double GRADIENT_MAX = 1e15;

typedef struct placing {
    const tli_item *item;
    const tli_frame *frame;
    tli_vert *verts;
} placing;

static tl_status place_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const placing *p = arg;
    for (size_t v = begin; v < end; v++) {
        double at[3];
        tli_frame_place(p->frame, p->item->volume->mesh->xyz + 3 * v, at);
        p->verts[v] =
            (tli_vert){(float)at[0], (float)at[1], (float)at[2], tli_volume_step(p->item, v)};
    }
    return TL_OK;
}

tl_status tli_volume_place(tl_ctx *ctx, const tli_item *item, const tli_frame *frame,
                           tli_vert *verts)
{
    placing p = {item, frame, verts};
    return tli_parallel(ctx, item->volume->vert_count, GRAIN, place_verts, &p);
}

void tli_volume_gradients(const tl_volume_opts *opts, size_t vert_count, float (*out)[4])
{
    double unit = opts->gradient_opacity;
    for (size_t v = 0; v < vert_count && !(opts->gradient_opacity > 0); v++)
        if (vec_is_finite(opts->gradients + 3 * v))
            for (size_t k = 0; k < 3; k++) unit = fmax(unit, fabs(opts->gradients[3 * v + k]));
    for (size_t v = 0; v < vert_count; v++)
        for (size_t k = 0; k < 4; k++) {
            double g = 0;
            if (k < 3 && unit > 0 && vec_is_finite(opts->gradients + 3 * v))
                g = opts->gradients[3 * v + k] / unit;
            out[v][k] = (float)fmax(-GRADIENT_MAX, fmin(g, GRADIENT_MAX));
        }
}
