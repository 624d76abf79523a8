/* JSON as text. */
#include "scene/scene_text.h"

#include <string.h>

#include "base/base_file.h"

static void put_bytes(tli_text *t, const char *bytes, size_t count)
{
    while (!t->st && t->room - t->bytes <= count) {
        const size_t room = t->room ? 2 * t->room : 4096;
        t->text = tl_mem_resize(t->ctx, t->text, room, 1, &t->st);
        if (!t->st) t->room = room;
    }
    if (t->st) return;
    memcpy(t->text + t->bytes, bytes, count);
    t->bytes += count;
    t->text[t->bytes] = '\0';
}

void tli_text_put(tli_text *t, const char *text)
{
    put_bytes(t, text, strlen(text));
}

void tli_text_put_quoted(tli_text *t, const char *text)
{
    const char *end = text + strlen(text);
    tli_text_put(t, "\"");
    while (text < end) {
        const unsigned char c = (unsigned char)*text;
        const size_t bytes = c < 0x80 ? 1 : tli_utf8_bytes(text, end);
        if (c == '"' || c == '\\') tli_text_put(t, "\\");
        if (c < 0x20 || c == 0x7f || !bytes)
            tli_text_put(t, "?");
        else
            put_bytes(t, text, bytes);
        text += bytes ? bytes : 1;
    }
    tli_text_put(t, "\"");
}

void tli_text_put_real(tli_text *t, double real)
{
    char text[TLI_REAL_BYTES];
    tli_real_print(real, text);
    tli_text_put(t, text);
}

void tli_text_put_reals(tli_text *t, const double *reals, size_t count)
{
    tli_text_put(t, "[");
    for (size_t i = 0; i < count; i++) {
        if (i) tli_text_put(t, ", ");
        tli_text_put_real(t, reals[i]);
    }
    tli_text_put(t, "]");
}

tl_status tli_text_check(const tli_text *t)
{
    if (t->st || t->bytes <= TLI_JSON_BYTES_MOST) return t->st;
    return tl_fail(t->ctx, TL_ERR_UNSUPPORTED, "%zu bytes of JSON, files have at most %zu",
                   t->bytes, TLI_JSON_BYTES_MOST);
}

tl_status tli_text_save(tli_text *t, const char *path)
{
    tli_sink *sink = NULL;
    tl_status st = tli_text_check(t);
    if (!st) st = tli_sink_open(t->ctx, path, &sink);
    if (!st) st = tli_sink_write(sink, t->text, t->bytes);
    const tl_status ended = tli_sink_close(sink, !st);
    tl_mem_free(t->ctx, t->text);
    return st ? st : ended;
}
