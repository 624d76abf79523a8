/* STL, binary: each triangle with its normal and three places of its own. */
#include "formats/formats_write_poly.h"

#include <string.h>

#include "base/base_vec.h"

enum { HEAD_BYTES = 80, TRIANGLE_BYTES = 50 };

static uint8_t *make_triangle(const tli_poly_out *out, const void *arg, size_t cell, uint8_t *to)
{
    (void)arg;
    const tl_lidx *t = out->poly->corners + 3 * cell;
    const double *xyz = out->poly->xyz;
    double u[3], v[3], n[3];
    vec_sub(xyz + 3 * (size_t)t[1], xyz + 3 * (size_t)t[0], u);
    vec_sub(xyz + 3 * (size_t)t[2], xyz + 3 * (size_t)t[0], v);
    vec_cross(u, v, n);
    double length = vec_length(n);
    for (int k = 0; k < 3; k++) to = tli_le_f32(to, length > 0 ? n[k] / length : 0);
    for (int i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++) to = tli_le_f32(to, xyz[3 * (size_t)t[i] + k]);
    *to++ = 0; /* no attributes */
    *to++ = 0;
    return to;
}

tl_status tli_write_stl(const tli_poly_out *out)
{
    uint8_t head[HEAD_BYTES + 4] = "tetralod"; /* must not begin with "solid" */
    if (out->poly->cell_count > UINT32_MAX)
        return tl_fail(out->ctx, TL_ERR_UNSUPPORTED, "%zu triangles are too many for a .stl",
                       out->poly->cell_count);
    tli_le_u32(head + HEAD_BYTES, (uint32_t)out->poly->cell_count);
    tl_status st = tli_sink_write(out->sink, head, sizeof head);
    return st ? st
              : tli_write_items(out, out->poly->cell_count, TRIANGLE_BYTES, make_triangle, NULL);
}
