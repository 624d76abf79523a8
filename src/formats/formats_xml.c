/* Pull reader for the XML of mesh files. Not expat: its memory can't be given to a context, it
 * would read inline data of any length a second time, and appended raw data is no XML at all. Of
 * XML 1.0 it takes what data files need; names of end tags are checked by the user, who knows the
 * element. */
#include "formats/formats_xml.h"

#include <string.h>

#include "formats/formats_number.h"

static bool is_space(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

static bool is_name(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == ':' || c == '-' || c == '.' || (unsigned char)c >= 0x80;
}

static bool starts_with(const char *at, const char *end, const char *word)
{
    size_t length = strlen(word);
    return (size_t)(end - at) >= length && memcmp(at, word, length) == 0;
}

static tl_status fail_at(const tli_xml *xml, const char *at, const char *what)
{
    return tl_fail(xml->ctx, TL_ERR_FORMAT, "byte %llu: %s", (unsigned long long)(at - xml->begin),
                   what);
}

tl_status tli_xml_open(tl_ctx *ctx, const void *bytes, uint64_t byte_count, tli_xml *xml)
{
    const char *text = bytes;
    *xml = (tli_xml){.ctx = ctx, .begin = text, .at = text, .end = text + byte_count};
    if (starts_with(xml->at, xml->end, "\xef\xbb\xbf")) xml->at += 3;
    if (starts_with(xml->at, xml->end, "\xff\xfe") || starts_with(xml->at, xml->end, "\xfe\xff"))
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "byte 0: text in UTF-16, expected UTF-8");
    return TL_OK;
}

/* The place after the next occurrence of word, NULL if there is none. */
static const char *find_after(const char *at, const char *end, const char *word)
{
    size_t length = strlen(word);
    while ((size_t)(end - at) >= length) {
        const char *p = memchr(at, word[0], (size_t)(end - at) - length + 1);
        if (!p) return NULL;
        if (memcmp(p, word, length) == 0) return p + length;
        at = p + 1;
    }
    return NULL;
}

/* The '>' of a tag, behind quoted values; NULL if the file ends before or a '<' comes first. */
static const char *find_tag_end(const char *at, const char *end)
{
    for (; at < end && *at != '>'; at++) {
        if (*at == '<') return NULL;
        if (*at == '"' || *at == '\'') {
            at = memchr(at + 1, *at, (size_t)(end - at) - 1);
            if (!at) return NULL;
        }
    }
    return at < end ? at : NULL;
}

/* at stands on '<' of a tag. */
static tl_status read_tag(tli_xml *xml, tli_xml_token *token)
{
    const char *at = xml->at, *p = at + 1;
    bool is_end = p < xml->end && *p == '/';
    if (is_end) p++;
    const char *name = p;
    while (p < xml->end && is_name(*p)) p++;
    if (p == name) return fail_at(xml, at, "'<' without a name after it");
    token->name = (tli_span){name, (size_t)(p - name)};
    const char *close = find_tag_end(p, xml->end);
    if (!close) return fail_at(xml, at, "a tag that does not end, expected '>'");
    bool is_empty = !is_end && close > p && close[-1] == '/';
    token->kind = is_end ? TLI_XML_END : is_empty ? TLI_XML_EMPTY : TLI_XML_START;
    token->attributes = (tli_span){p, (size_t)(close - p) - is_empty};
    token->ofs = (uint64_t)(at - xml->begin);
    xml->at = close + 1;
    return TL_OK;
}

/* at stands on "<!" or "<?". *is_text: it is a character section, which goes into token. */
static tl_status read_markup(tli_xml *xml, tli_xml_token *token, bool *is_text)
{
    const char *at = xml->at, *after;
    *is_text = false;
    if (starts_with(at, xml->end, "<?")) {
        after = find_after(at + 2, xml->end, "?>");
    } else if (starts_with(at, xml->end, "<!--")) {
        after = find_after(at + 4, xml->end, "-->");
    } else if (starts_with(at, xml->end, "<![CDATA[")) {
        after = find_after(at + 9, xml->end, "]]>");
        if (after) {
            *is_text = true;
            token->kind = TLI_XML_TEXT;
            token->text = (tli_span){at + 9, (size_t)(after - at) - 12};
            token->ofs = (uint64_t)(at + 9 - xml->begin);
        }
    } else if (starts_with(at, xml->end, "<!DOCTYPE")) {
        return tl_fail(xml->ctx, TL_ERR_UNSUPPORTED,
                       "byte %llu: a document type declaration; none is taken",
                       (unsigned long long)(at - xml->begin));
    } else {
        return fail_at(xml, at, "'<!' that begins nothing known");
    }
    if (!after) return fail_at(xml, at, "a comment or instruction that does not end");
    xml->at = after;
    return TL_OK;
}

tl_status tli_xml_next(tli_xml *xml, tli_xml_token *token)
{
    for (;;) {
        const char *text = xml->at;
        while (xml->at < xml->end && is_space(*xml->at)) xml->at++;
        if (xml->at == xml->end) {
            *token = (tli_xml_token){.kind = TLI_XML_DONE, .ofs = (uint64_t)(text - xml->begin)};
            return TL_OK;
        }
        if (*xml->at != '<') {
            text = xml->at;
            const char *tag = memchr(text, '<', (size_t)(xml->end - text));
            xml->at = tag ? tag : xml->end;
            *token = (tli_xml_token){.kind = TLI_XML_TEXT,
                                     .text = {text, (size_t)(xml->at - text)},
                                     .ofs = (uint64_t)(text - xml->begin)};
            return TL_OK;
        }
        if (xml->end - xml->at < 2 || (xml->at[1] != '!' && xml->at[1] != '?'))
            return read_tag(xml, token);
        bool is_text;
        tl_status st = read_markup(xml, token, &is_text);
        if (st || is_text) return st;
    }
}

tl_status tli_xml_skip(tli_xml *xml, const tli_xml_token *start)
{
    uint64_t depth = start->kind == TLI_XML_START;
    while (depth > 0) {
        tli_xml_token token;
        tl_status st = tli_xml_next(xml, &token);
        if (st) return st;
        if (token.kind == TLI_XML_DONE)
            return tl_fail(xml->ctx, TL_ERR_FORMAT,
                           "byte %llu: the file ends inside <%.*s>, which begins at byte %llu",
                           (unsigned long long)token.ofs,
                           (int)(start->name.bytes < 64 ? start->name.bytes : 64), start->name.text,
                           (unsigned long long)start->ofs);
        if (token.kind == TLI_XML_START) depth++;
        if (token.kind == TLI_XML_END) depth--;
    }
    return TL_OK;
}

bool tli_xml_attribute(const tli_xml_token *token, const char *name, tli_span *value)
{
    const char *at = token->attributes.text, *end = at + token->attributes.bytes;
    size_t length = strlen(name);
    while (at < end) {
        while (at < end && !is_name(*at)) at++;
        const char *found = at;
        while (at < end && is_name(*at)) at++;
        size_t found_length = (size_t)(at - found);
        while (at < end && *at != '"' && *at != '\'') at++;
        if (at == end) break;
        const char *close = memchr(at + 1, *at, (size_t)(end - at) - 1);
        if (!close) break;
        if (found_length == length && memcmp(found, name, length) == 0) {
            *value = (tli_span){at + 1, (size_t)(close - at) - 1};
            return true;
        }
        at = close + 1;
    }
    return false;
}

/* ---- spans ---- */

static tli_span trim(tli_span span)
{
    while (span.bytes && is_space(span.text[0])) {
        span.text++;
        span.bytes--;
    }
    while (span.bytes && is_space(span.text[span.bytes - 1])) span.bytes--;
    return span;
}

static size_t utf8_encode(uint32_t code, char out[4])
{
    if (code < 0x80) {
        out[0] = (char)code;
        return 1;
    }
    size_t length = code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
    for (size_t i = length; i-- > 1; code >>= 6) out[i] = (char)(0x80 | (code & 0x3f));
    out[0] = (char)((0xf00u >> length) | code);
    return length;
}

/* A character reference at '&': its code and the place after ';'. NULL if it is none. */
static const char *read_reference(const char *at, const char *end, uint32_t *code)
{
    static const struct {
        const char *word;
        uint32_t code;
    } names[] = {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (starts_with(at, end, names[i].word)) {
            *code = names[i].code;
            return at + strlen(names[i].word);
        }
    if (!starts_with(at, end, "&#")) return NULL;
    const char *p = at + 2;
    bool hex = p < end && *p == 'x';
    p += hex;
    const char *digits = p;
    uint32_t value = 0;
    for (; p < end && *p != ';'; p++) {
        char lower = (char)(*p | 0x20);
        uint32_t digit;
        if (*p >= '0' && *p <= '9')
            digit = (uint32_t)(*p - '0');
        else if (hex && lower >= 'a' && lower <= 'f')
            digit = (uint32_t)(lower - 'a') + 10;
        else
            return NULL;
        value = value * (hex ? 16 : 10) + digit;
        if (value > 0x10ffff) return NULL;
    }
    if (p == end || p == digits || (value >= 0xd800 && value <= 0xdfff)) return NULL;
    *code = value;
    return p + 1;
}

void tli_span_text(tli_span span, char *text, size_t text_bytes)
{
    span = trim(span);
    const char *at = span.text, *end = at + span.bytes;
    size_t used = 0;
    while (at < end) {
        char sequence[4];
        size_t length = 0;
        uint32_t code = (unsigned char)*at;
        const char *after = code == '&' ? read_reference(at, end, &code) : NULL;
        if (!after && code >= 0x80 && (length = tli_utf8_bytes(at, end)) > 0) {
            memcpy(sequence, at, length);
            after = at + length;
        } else {
            length = utf8_encode(code < 0x20 || code == 0x7f ? ' ' : code, sequence);
            if (!after) after = at + 1;
        }
        if (used + length >= text_bytes) break;
        memcpy(text + used, sequence, length);
        used += length;
        at = after;
    }
    text[used] = '\0';
}

bool tli_span_is(tli_span span, const char *word)
{
    span = trim(span);
    if (strlen(word) != span.bytes) return false;
    for (size_t i = 0; i < span.bytes; i++) {
        char a = span.text[i], b = word[i];
        if (a >= 'A' && a <= 'Z') a = (char)(a + 32);
        if (b >= 'A' && b <= 'Z') b = (char)(b + 32);
        if (a != b) return false;
    }
    return true;
}

bool tli_span_u64(tli_span span, uint64_t *value)
{
    int64_t number;
    if (!tli_span_i64s(span, &number, 1) || number < 0) return false;
    *value = (uint64_t)number;
    return true;
}

bool tli_span_i64s(tli_span span, int64_t *values, int count)
{
    const char *at = span.text, *end = at + span.bytes;
    for (int i = 0; i < count; i++) {
        at = tli_number_i64(at, end, &values[i]);
        if (!at) return false;
    }
    return tli_number_skip_space(at, end) == end;
}

bool tli_span_f64s(tli_span span, double *values, int count)
{
    const char *at = span.text, *end = at + span.bytes;
    for (int i = 0; i < count; i++) {
        at = tli_number_f64(at, end, &values[i]);
        if (!at) return false;
    }
    return tli_number_skip_space(at, end) == end;
}
