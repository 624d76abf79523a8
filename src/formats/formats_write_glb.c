/* Binary glTF 2.0: one mesh around the middle of the data, which its node moves back, so that
 * float32 is enough; a material with two sides; channels as attributes of the application (_NAME).
 */
#include "formats/formats_write_poly.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "formats/formats_emit.h"

enum {
    HEAD_BYTES = 12,
    CHUNK_HEAD_BYTES = 8,
    VIEWS_MAX = 64, /* channels beyond are left out */
    NAME_BYTES = 64,
    JSON_BYTES = 65536,
    FLOAT_TYPE = 5126,
    UINT_TYPE = 5125
};
static const uint32_t MAGIC = 0x46546c67, JSON_CHUNK = 0x4e4f534a, BINARY_CHUNK = 0x004e4942;

typedef struct view {
    const char *type; /* of its elements */
    uint32_t component_type;
    size_t count, item_bytes;
    tli_make_fn make;
    const void *arg;
    char attribute[NAME_BYTES]; /* "" of indices */
} view;

typedef struct file {
    const tli_poly_out *out;
    view views[VIEWS_MAX];
    size_t view_count;
    double middle[3];
    char json[JSON_BYTES];
    size_t json_bytes;
} file;

/* ---- numbers ---- */

/* glTF allows finite numbers alone: others become 0. */
static uint8_t *put_finite(uint8_t *to, double value)
{
    float f = (float)value;
    return tli_le_f32(to, isfinite(f) ? value : 0);
}

static uint8_t *make_place(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    const double *middle = arg;
    for (size_t k = 0; k < 3; k++) to = put_finite(to, out->poly->xyz[3 * v + k] - middle[k]);
    return to;
}

static uint8_t *make_normal(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)arg;
    return tli_put_normal(out, v, to);
}

static uint8_t *make_value(const tli_poly_out *out, const void *arg, size_t v, uint8_t *to)
{
    (void)out;
    const tl_channel *channel = arg;
    for (size_t n = channel->components, k = 0; k < n; k++)
        to = put_finite(to, channel->values[n * v + k]);
    return to;
}

static uint8_t *make_corner(const tli_poly_out *out, const void *arg, size_t i, uint8_t *to)
{
    (void)arg;
    return tli_le_u32(to, out->poly->corners[i]);
}

/* A segment of a line as a pair; its line is found by halving, since line c begins with segment
 * starts[c] - c. */
static uint8_t *make_segment(const tli_poly_out *out, const void *arg, size_t i, uint8_t *to)
{
    (void)arg;
    const tl_polydata *p = out->poly;
    size_t low = 0, high = p->cell_count;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (p->starts[middle] - middle <= i)
            low = middle;
        else
            high = middle;
    }
    size_t at = i + low;
    return tli_le_u32(tli_le_u32(to, p->corners[at]), p->corners[at + 1]);
}

/* ---- what there is ---- */

static void add_view(file *f, view v)
{
    if (f->view_count < VIEWS_MAX) f->views[f->view_count++] = v;
}

static void add_channels(file *f)
{
    static const char *const TYPES[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const tl_polydata *p = f->out->poly;
    for (size_t c = 0; c < p->channel_count; c++) {
        const tl_channel *channel = &p->channels[c];
        view v = {.component_type = FLOAT_TYPE,
                  .count = p->vert_count,
                  .make = make_value,
                  .arg = channel,
                  .attribute = "_"};
        if (channel->components > 4) continue;
        v.type = TYPES[channel->components];
        v.item_bytes = channel->components * sizeof(float);
        tli_plain_name(channel->name, v.attribute + 1, sizeof v.attribute - 1);
        for (char *at = v.attribute; *at; at++) *at = (char)toupper((unsigned char)*at);
        for (size_t i = 0; i < f->view_count; i++)
            if (strcmp(f->views[i].attribute, v.attribute) == 0) /* names are keys */
                snprintf(v.attribute, sizeof v.attribute, "_CHANNEL_%zu", c);
        add_view(f, v);
    }
}

static void list_views(file *f)
{
    const tl_polydata *p = f->out->poly;
    for (int k = 0; k < 3; k++)
        f->middle[k] = f->out->bounds[2 * k] / 2 + f->out->bounds[2 * k + 1] / 2;
    if (p->kind == TL_POLY_TRIANGLES)
        add_view(f, (view){"SCALAR", UINT_TYPE, 3 * p->cell_count, sizeof(uint32_t), make_corner,
                           NULL, ""});
    if (p->kind == TL_POLY_LINES)
        add_view(f, (view){"SCALAR", UINT_TYPE, (size_t)f->out->corner_count - p->cell_count,
                           2 * sizeof(uint32_t), make_segment, NULL, ""});
    add_view(f, (view){"VEC3", FLOAT_TYPE, p->vert_count, 3 * sizeof(float), make_place, f->middle,
                       "POSITION"});
    if (p->normals)
        add_view(f, (view){"VEC3", FLOAT_TYPE, p->vert_count, 3 * sizeof(float), make_normal, NULL,
                           "NORMAL"});
    add_channels(f);
}

/* ---- JSON ---- */

static void say(file *f, const char *format, ...) TL_PRINTF(2, 3);
static void say(file *f, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int n = tli_vprint(f->json + f->json_bytes, JSON_BYTES - f->json_bytes, format, args);
    va_end(args);
    if (n > 0) f->json_bytes += (size_t)n;
}

static void say_three(file *f, const double values[3])
{
    char text[3][TLI_NUMBER_BYTES];
    for (int k = 0; k < 3; k++) tli_print_real(text[k], values[k], 17);
    say(f, "[%s,%s,%s]", text[0], text[1], text[2]);
}

/* Bounds of the positions as they are written: glTF asks for them to the bit. */
static void say_bounds(file *f)
{
    double low[3], high[3];
    for (int k = 0; k < 3; k++) {
        low[k] = (double)(float)(f->out->bounds[2 * k] - f->middle[k]);
        high[k] = (double)(float)(f->out->bounds[2 * k + 1] - f->middle[k]);
    }
    say(f, ",\"min\":");
    say_three(f, low);
    say(f, ",\"max\":");
    say_three(f, high);
}

static size_t view_bytes(const view *v)
{
    return v->count * v->item_bytes;
}

static void say_accessors(file *f)
{
    for (size_t i = 0; i < f->view_count; i++) {
        const view *v = &f->views[i];
        size_t numbers = view_bytes(v) / sizeof(uint32_t);
        say(f, "%s{\"bufferView\":%zu,\"componentType\":%u,\"count\":%zu,\"type\":\"%s\"",
            i ? "," : "", i, v->component_type, v->component_type == UINT_TYPE ? numbers : v->count,
            v->type);
        if (strcmp(v->attribute, "POSITION") == 0) say_bounds(f);
        say(f, "}");
    }
}

static size_t say_views(file *f)
{
    size_t ofs = 0;
    for (size_t i = 0; i < f->view_count; i++) {
        const view *v = &f->views[i];
        say(f, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"target\":%d}", i ? "," : "",
            ofs, view_bytes(v), v->component_type == UINT_TYPE ? 34963 : 34962);
        ofs += view_bytes(v);
    }
    return ofs;
}

static void say_primitive(file *f)
{
    static const int MODES[] = {0, 0, 1, 4};
    bool first = true;
    say(f, "{\"mode\":%d,\"material\":0,\"attributes\":{", MODES[f->out->poly->kind]);
    for (size_t i = 0; i < f->view_count; i++)
        if (f->views[i].attribute[0]) {
            say(f, "%s\"%s\":%zu", first ? "" : ",", f->views[i].attribute, i);
            first = false;
        }
    say(f, "}");
    if (!f->views[0].attribute[0]) say(f, ",\"indices\":0");
    say(f, "}");
}

/* Returns the bytes of the binary chunk. */
static size_t say_all(file *f)
{
    say(f, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"tetralod\"},\"scene\":0,"
           "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"translation\":");
    say_three(f, f->middle);
    say(f, "}],\"materials\":[{\"doubleSided\":true,\"pbrMetallicRoughness\":"
           "{\"baseColorFactor\":[0.8,0.8,0.8,1],\"metallicFactor\":0,\"roughnessFactor\":0.6}}],"
           "\"meshes\":[{\"primitives\":[");
    say_primitive(f);
    say(f, "]}],\"accessors\":[");
    say_accessors(f);
    say(f, "],\"bufferViews\":[");
    size_t bytes = say_views(f);
    say(f, "],\"buffers\":[{\"byteLength\":%zu}]}", bytes);
    while (f->json_bytes % 4) say(f, " ");
    return bytes;
}

static tl_status put_words(const tli_poly_out *out, const uint32_t *words, size_t count)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < count; i++) {
        uint8_t bytes[4];
        tli_le_u32(bytes, words[i]);
        st = tli_sink_write(out->sink, bytes, sizeof bytes);
    }
    return st;
}

/* An empty mesh: glTF knows no buffer of 0 bytes. */
static tl_status put_nothing(file *f)
{
    say(f, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"tetralod\"},\"scenes\":[{}],"
           "\"scene\":0}");
    while (f->json_bytes % 4) say(f, " ");
    uint32_t head[5] = {MAGIC, 2, (uint32_t)(HEAD_BYTES + CHUNK_HEAD_BYTES + f->json_bytes),
                        (uint32_t)f->json_bytes, JSON_CHUNK};
    tl_status st = put_words(f->out, head, 5);
    return st ? st : tli_sink_write(f->out->sink, f->json, f->json_bytes);
}

static tl_status put_file(file *f)
{
    list_views(f);
    uint64_t binary = say_all(f);
    uint64_t total = HEAD_BYTES + 2 * CHUNK_HEAD_BYTES + f->json_bytes + binary;
    if (total > UINT32_MAX)
        return tl_fail(f->out->ctx, TL_ERR_UNSUPPORTED,
                       "%llu bytes are too many for a .glb, which has 2^32 at most",
                       (unsigned long long)total);
    uint32_t head[5] = {MAGIC, 2, (uint32_t)total, (uint32_t)f->json_bytes, JSON_CHUNK};
    uint32_t chunk[2] = {(uint32_t)binary, BINARY_CHUNK};
    tl_status st = put_words(f->out, head, 5);
    if (!st) st = tli_sink_write(f->out->sink, f->json, f->json_bytes);
    if (!st) st = put_words(f->out, chunk, 2);
    for (size_t i = 0; !st && i < f->view_count; i++) {
        const view *v = &f->views[i];
        st = tli_write_items(f->out, v->count, v->item_bytes, v->make, v->arg);
    }
    return st;
}

tl_status tli_write_glb(const tli_poly_out *out)
{
    tl_status st = TL_OK;
    file *f = tl_mem_zalloc(out->ctx, 1, sizeof *f, &st);
    if (st) return st;
    f->out = out;
    st = out->poly->cell_count ? put_file(f) : put_nothing(f);
    tl_mem_free(out->ctx, f);
    return st;
}
