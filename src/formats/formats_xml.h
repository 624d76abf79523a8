/* Stage formats, internal: a pull reader for the XML of mesh files. It works in place on the bytes
 * of the file, allocates nothing, takes time linear in what it passes, and stops wherever its user
 * does, so that binary data may follow. */
#ifndef TETRALOD_SRC_FORMATS_XML_H
#define TETRALOD_SRC_FORMATS_XML_H

#include "base/base.h"

/* Characters of the file; not terminated. */
typedef struct tli_span {
    const char *text;
    size_t bytes;
} tli_span;

typedef enum tli_xml_kind {
    TLI_XML_START, /* <name attributes> */
    TLI_XML_EMPTY, /* <name attributes/>; no TLI_XML_END follows */
    TLI_XML_END,   /* </name> */
    TLI_XML_TEXT,  /* characters between tags that are not white space only */
    TLI_XML_DONE   /* the end of the bytes */
} tli_xml_kind;

typedef struct tli_xml_token {
    tli_xml_kind kind;
    tli_span name;       /* of a tag */
    tli_span attributes; /* of a start tag, as they stand */
    tli_span text;       /* of a text */
    uint64_t ofs;        /* where the token begins, from the start of the bytes */
} tli_xml_token;

typedef struct tli_xml {
    tl_ctx *ctx;
    const char *begin, *at, *end;
} tli_xml;

/* Borrows bytes [byte_count]. Another encoding than UTF-8 or one that holds ASCII as it is gives
 * TL_ERR_UNSUPPORTED. */
tl_status tli_xml_open(tl_ctx *ctx, const void *bytes, uint64_t byte_count, tli_xml *xml);

/* The next token. Comments, processing instructions and blank text are passed over. A document type
 * declaration is TL_ERR_UNSUPPORTED: no entity but the five of XML is ever expanded. */
tl_status tli_xml_next(tli_xml *xml, tli_xml_token *token);

/* Passes over the rest of the element whose start tag was read last; nothing to do for
 * TLI_XML_EMPTY. */
tl_status tli_xml_skip(tli_xml *xml, const tli_xml_token *start);

/* Value of an attribute of a start tag as it stands in the file; false if it has none. */
bool tli_xml_attribute(const tli_xml_token *token, const char *name, tli_span *value);

/* Copies a span as UTF-8 into text [text_bytes], always terminated: character references become
 * characters, what is not UTF-8 is read as Latin-1, control characters become spaces, white space
 * at both ends goes, and what does not fit is cut off at a whole character. */
void tli_span_text(tli_span span, char *text, size_t text_bytes);

/* White space is left out of account at both ends, and so is the case of letters. */
bool tli_span_is(tli_span span, const char *word);
/* A whole number, and nothing else but white space. */
bool tli_span_u64(tli_span span, uint64_t *value);
/* count numbers between white space, and nothing else. */
bool tli_span_i64s(tli_span span, int64_t *values, int count);
bool tli_span_f64s(tli_span span, double *values, int count);

#endif
