/* Wavefront OBJ: text, indices from 1. */
#include "formats/formats_write_poly.h"

#include <stdio.h>

#include "formats/formats_emit.h"

enum { ITEM_BYTES = 128, PLACE_DIGITS = 9, EXACT_DIGITS = 17, NORMAL_DIGITS = 6 };

static uint8_t *put_reals(uint8_t *to, const char *key, const double *values, int digits)
{
    char *text = (char *)to;
    text += sprintf(text, "%s", key);
    for (int k = 0; k < 3; k++) {
        *text++ = ' ';
        text += tli_print_real(text, values[k], digits);
    }
    *text++ = '\n';
    return (uint8_t *)text;
}

static uint8_t *make_vert(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)arg;
    return put_reals(to, "v", out->poly->xyz + 3 * v,
                     out->float_places ? PLACE_DIGITS : EXACT_DIGITS);
}

static uint8_t *make_normal(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)arg;
    double n[3];
    for (size_t k = 0; k < 3; k++) n[k] = (double)out->poly->normals[3 * v + k];
    return put_reals(to, "vn", n, NORMAL_DIGITS);
}

static uint8_t *make_face(const tli_poly_out *out, const void *arg, size_t cell, uint8_t *to)
{
    (void)arg;
    char *text = (char *)to;
    *text++ = 'f';
    for (size_t k = 0; k < 3; k++) {
        size_t v = (size_t)out->poly->corners[3 * cell + k] + 1;
        text += out->poly->normals ? sprintf(text, " %zu//%zu", v, v) : sprintf(text, " %zu", v);
    }
    *text++ = '\n';
    return (uint8_t *)text;
}

static uint8_t *make_point(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)arg;
    (void)out;
    return to + sprintf((char *)to, "p %zu\n", v + 1);
}

static tl_status put_lines(const tli_poly_out *out)
{
    tl_status st = TL_OK;
    const tl_polydata *p = out->poly;
    for (size_t c = 0; !st && c < p->cell_count; c++) {
        st = tli_sink_printf(out->sink, "l");
        for (size_t i = p->starts[c]; !st && i < p->starts[c + 1]; i++)
            st = tli_sink_printf(out->sink, " %zu", (size_t)p->corners[i] + 1);
        if (!st) st = tli_sink_printf(out->sink, "\n");
    }
    return st;
}

tl_status tli_write_obj(const tli_poly_out *out)
{
    const tl_polydata *p = out->poly;
    tl_status st = tli_sink_printf(out->sink, "# tetralod\n");
    if (!st) st = tli_write_items(out, p->vert_count, ITEM_BYTES, make_vert, NULL);
    if (!st && p->normals) st = tli_write_items(out, p->vert_count, ITEM_BYTES, make_normal, NULL);
    if (!st && p->kind == TL_POLY_TRIANGLES)
        st = tli_write_items(out, p->cell_count, ITEM_BYTES, make_face, NULL);
    if (!st && p->kind == TL_POLY_POINTS)
        st = tli_write_items(out, p->vert_count, ITEM_BYTES, make_point, NULL);
    if (!st && p->kind == TL_POLY_LINES) st = put_lines(out);
    return st;
}
