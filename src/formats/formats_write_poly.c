/* The door out for points, lines and triangles: which file, which precision, and the loop that all
 * writers of binary files share. */
#include "formats/formats_write_poly.h"

#include <math.h>
#include <string.h>

#include "formats/formats_emit.h"

/* Positions are float32 if that moves none by more than this part of the diagonal. */
static const double FLOAT_ERROR = 1e-6;
/* Half the distance of neighbouring float32 numbers, relative. */
static const double FLOAT_ROUNDING = 0x1p-24;

enum { ITEMS_AT_ONCE = 4096 };

typedef struct writer {
    const char *ending;
    tl_status (*write)(const tli_poly_out *out);
    bool kinds[4];           /* by tl_poly_kind */
    uint32_t components_max; /* of a channel; 0: no channels */
    bool normals;
} writer;

static const writer WRITERS[] = {
    {".ply", tli_write_ply, {false, true, true, true}, UINT32_MAX, true},
    {".vtp", tli_write_vtp, {false, true, true, true}, UINT32_MAX, true},
    {".stl", tli_write_stl, {false, false, false, true}, 0, false},
    {".obj", tli_write_obj, {false, true, true, true}, 0, true},
    {".glb", tli_write_glb, {false, true, true, true}, 4, true},
};

/* ---- bytes ---- */

static uint8_t *put(uint8_t *to, const void *from, size_t bytes)
{
    const uint8_t *b = from;
    bool turn = tli_big_endian_host();
    for (size_t i = 0; i < bytes; i++) to[i] = b[turn ? bytes - 1 - i : i];
    return to + bytes;
}

uint8_t *tli_le_f32(uint8_t *to, double value)
{
    float f = (float)value;
    return put(to, &f, sizeof f);
}

uint8_t *tli_le_f64(uint8_t *to, double value)
{
    return put(to, &value, sizeof value);
}

uint8_t *tli_le_u32(uint8_t *to, uint32_t value)
{
    return put(to, &value, sizeof value);
}

uint8_t *tli_le_u64(uint8_t *to, uint64_t value)
{
    return put(to, &value, sizeof value);
}

uint8_t *tli_put_place(const tli_poly_out *out, size_t vert, uint8_t *to)
{
    const double *x = out->poly->xyz + 3 * vert;
    for (int k = 0; k < 3; k++)
        to = out->float_places ? tli_le_f32(to, x[k]) : tli_le_f64(to, x[k]);
    return to;
}

uint8_t *tli_put_normal(const tli_poly_out *out, size_t vert, uint8_t *to)
{
    for (size_t k = 0; k < 3; k++) to = tli_le_f32(to, (double)out->poly->normals[3 * vert + k]);
    return to;
}

uint8_t *tli_put_values(const tl_channel *channel, bool single, size_t vert, uint8_t *to)
{
    const double *values = channel->values + vert * channel->components;
    for (uint32_t k = 0; k < channel->components; k++)
        to = single ? tli_le_f32(to, values[k]) : tli_le_f64(to, values[k]);
    return to;
}

tl_status tli_write_items(const tli_poly_out *out, size_t count, size_t item_bytes,
                          tli_make_fn make, const void *arg)
{
    tl_status st = TL_OK;
    uint8_t *bytes = tl_mem_alloc(out->ctx, ITEMS_AT_ONCE, item_bytes, &st);
    for (size_t begin = 0; !st && begin < count; begin += ITEMS_AT_ONCE) {
        size_t end = begin + ITEMS_AT_ONCE < count ? begin + ITEMS_AT_ONCE : count;
        uint8_t *to = bytes;
        for (size_t i = begin; i < end; i++) to = make(out, arg, i, to);
        st = tli_sink_write(out->sink, bytes, (size_t)(to - bytes));
        if (!st) st = tl_progress(out->ctx, "write", end, count);
    }
    tl_mem_free(out->ctx, bytes);
    return st;
}

/* ---- what the writers ask ---- */

bool tli_is_single(const tl_channel *channel)
{
    return channel->scalar != TL_F64 && channel->scalar != TL_I64 && channel->scalar != TL_U64;
}

void tli_plain_name(const char *name, char *plain, size_t length)
{
    size_t n = 0;
    for (; name[n] && n + 1 < length; n++) {
        char c = name[n];
        bool keep = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        plain[n] = keep ? c : '_';
    }
    plain[n] = '\0';
}

static void measure(tli_poly_out *out)
{
    const tl_polydata *p = out->poly;
    double square = 0;
    bool any = false;
    for (int k = 0; k < 6; k++) out->bounds[k] = 0;
    for (size_t v = 0; v < p->vert_count; v++) {
        const double *x = p->xyz + 3 * v;
        if (!isfinite(x[0]) || !isfinite(x[1]) || !isfinite(x[2])) continue;
        for (int k = 0; k < 3; k++) {
            if (!any || x[k] < out->bounds[2 * k]) out->bounds[2 * k] = x[k];
            if (!any || x[k] > out->bounds[2 * k + 1]) out->bounds[2 * k + 1] = x[k];
        }
        any = true;
    }
    for (int k = 0; k < 6; k++) out->largest = fmax(out->largest, fabs(out->bounds[k]));
    for (int k = 0; k < 3; k++) square += pow(out->bounds[2 * k + 1] - out->bounds[2 * k], 2);
    out->float_places = out->largest * FLOAT_ROUNDING <= FLOAT_ERROR * sqrt(square);
    out->corner_count = p->kind == TL_POLY_TRIANGLES ? 3 * (uint64_t)p->cell_count
                        : p->kind == TL_POLY_LINES   ? p->starts[p->cell_count]
                                                     : 0;
}

/* Says what this kind of file has no place for. */
static void say_left_out(const tli_poly_out *out, const writer *w, const char *path)
{
    const tl_polydata *p = out->poly;
    for (size_t c = 0; c < p->channel_count; c++)
        if (p->channels[c].components > w->components_max)
            tl_log(out->ctx, TL_LOG_INFO,
                   "'%s': channel '%s' is left out, a %s has no place for it", path,
                   p->channels[c].name, w->ending);
    if (p->normals && !w->normals)
        tl_log(out->ctx, TL_LOG_INFO, "'%s': normals are left out, a %s has no place for them",
               path, w->ending);
    if (!out->float_places && w->write == tli_write_stl)
        tl_log(out->ctx, TL_LOG_INFO, "'%s': positions are rounded by up to %.3g", path,
               FLOAT_ROUNDING * out->largest);
}

static const writer *find_writer(const char *path)
{
    for (size_t i = 0; i < sizeof WRITERS / sizeof *WRITERS; i++)
        if (tli_path_ends(path, WRITERS[i].ending)) return &WRITERS[i];
    return NULL;
}

bool tl_polydata_writes(tl_poly_kind kind, const char *path)
{
    const writer *w = find_writer(path);
    return w && w->kinds[kind];
}

tl_status tl_polydata_write(tl_ctx *ctx, const tl_polydata *polydata, const char *path)
{
    static const char *const kinds[] = {"", "points", "lines", "triangles"};
    const writer *w = find_writer(path);
    tli_poly_out out = {.ctx = ctx, .poly = polydata};
    if (!w)
        return tl_fail(ctx, TL_ERR_ARG, "'%s': the name must end in .ply, .vtp, .stl, .obj or .glb",
                       path);
    if (!w->kinds[polydata->kind])
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': a %s holds no %s", path, w->ending,
                       kinds[polydata->kind]);
    measure(&out);
    say_left_out(&out, w, path);
    tl_status st = tli_sink_open(ctx, path, &out.sink);
    if (!st) st = w->write(&out);
    tl_status end = tli_sink_close(out.sink, !st);
    if (!st) st = end;
    return st ? tl_note(ctx, st, "while writing '%s'", path) : TL_OK;
}
