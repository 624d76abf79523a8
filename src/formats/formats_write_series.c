/* Collections: a .pvd file that names the files of a series; and text in XML. */
#include "formats/formats_emit.h"

#include <math.h>
#include <string.h>

/* ---- text ---- */

/* Bytes of the character of two or more bytes at the start of text, or 0: XML has no U+FFFE and
 * U+FFFF. */
static size_t utf8_bytes(const char *text, const char *end)
{
    const size_t count = tli_utf8_bytes(text, end);
    return count == 3 && memcmp(text, "\xef\xbf", 2) == 0 && (text[2] & 0x3f) >= 0x3e ? 0 : count;
}

/* Text as it may stand in an attribute or element. Bytes that are no UTF-8 are taken for Latin-1,
 * control characters, which XML can't hold, become '?'. */
tl_status tli_emit_escaped(tli_sink *sink, const char *text)
{
    tl_status st = TL_OK;
    const char *const end = text + strlen(text);
    for (const char *next = text; next < end && !st;) {
        const unsigned char *at = (const unsigned char *)next;
        size_t bytes = *at >= 0x80 ? utf8_bytes(next, end) : 1;
        if (bytes == 0)
            st = tli_sink_printf(sink, "&#%u;", *at < 0xa0 ? '?' : *at);
        else if (bytes == 1 && (strchr("&<>\"'\t\n\r", *at)))
            st = tli_sink_printf(sink, "&#%u;", *at);
        else if (bytes == 1 && *at < 32)
            st = tli_sink_write(sink, "?", 1);
        else
            st = tli_sink_write(sink, at, bytes);
        next += bytes ? bytes : 1;
    }
    return st;
}

/* ---- collections ---- */

tl_status tl_series_write(tl_ctx *ctx, const char *path, const char *const *files,
                          const double *times, size_t count)
{
    tli_sink *sink = NULL;
    if (!tli_path_ends(path, ".pvd"))
        return tl_fail(ctx, TL_ERR_ARG, "'%s': a series is written as .pvd", path);
    tl_status st = tli_sink_open(ctx, path, &sink);
    if (!st)
        st = tli_sink_printf(sink, "<?xml version=\"1.0\"?>\n"
                                   "<VTKFile type=\"Collection\" version=\"0.1\">\n"
                                   "  <Collection>\n");
    for (size_t i = 0; i < count && !st; i++) {
        double time = isnan(times[i]) ? (double)i : times[i];
        st = tli_sink_printf(sink, "    <DataSet timestep=\"%.17g\" part=\"0\" file=\"", time);
        if (!st) st = tli_emit_escaped(sink, files[i]);
        if (!st) st = tli_sink_printf(sink, "\"/>\n");
    }
    if (!st) st = tli_sink_printf(sink, "  </Collection>\n</VTKFile>\n");
    tl_status end = tli_sink_close(sink, !st);
    if (!st) st = end;
    return st ? tl_note(ctx, st, "while writing '%s'", path) : TL_OK;
}
