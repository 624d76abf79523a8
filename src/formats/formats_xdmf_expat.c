/* XDMF: the XML as a tree, through expat. No entity of another file is ever read. */
#include "formats/formats_xdmf.h"

#include <ctype.h>
#include <expat.h>
#include <stdlib.h>
#include <string.h>

/* Elements and levels at most. */
#define NODES_MAX 4000000
#define DEPTH_MAX 64
/* Bytes handed to expat at once. */
#define PIECE_BYTES ((size_t)1 << 20)

typedef struct parse {
    tli_xdmf *x;
    tli_xd_node *at; /* the element that is open */
    size_t nodes, depth;
    tl_status status;
    XML_Parser parser;
} parse;

static char *copy(parse *p, const char *text)
{
    size_t length = strlen(text) + 1;
    char *own = tli_arena_alloc(&p->x->arena, length, 1, &p->status);
    if (!p->status) memcpy(own, text, length);
    return own;
}

static void stop(parse *p)
{
    if (p->status) XML_StopParser(p->parser, XML_FALSE);
}

static void on_start(void *arg, const char *name, const char **attributes)
{
    parse *p = arg;
    if (p->status) return;
    if (++p->nodes > NODES_MAX || ++p->depth > DEPTH_MAX)
        p->status = tl_fail(p->x->ctx, TL_ERR_FORMAT, "'%s': line %lu: too many elements",
                            p->x->source->path, XML_GetCurrentLineNumber(p->parser));
    tli_xd_node *node = tli_arena_alloc(&p->x->arena, 1, sizeof *node, &p->status);
    if (p->status) {
        stop(p);
        return;
    }
    const char *colon = strchr(name, ':');
    *node = (tli_xd_node){.parent = p->at, .name = copy(p, colon ? colon + 1 : name)};
    while (attributes[2 * node->attribute_count]) node->attribute_count++;
    node->attributes =
        tli_arena_alloc(&p->x->arena, node->attribute_count, sizeof *node->attributes, &p->status);
    for (size_t i = 0; i < node->attribute_count && !p->status; i++) {
        node->attributes[i].name = copy(p, attributes[2 * i]);
        node->attributes[i].value = copy(p, attributes[2 * i + 1]);
    }
    if (!p->at)
        p->x->root = node;
    else if (p->at->last_child)
        p->at->last_child->next = node;
    else
        p->at->first_child = node;
    if (p->at) p->at->last_child = node;
    p->at = node;
    stop(p);
}

static void on_end(void *arg, const char *name)
{
    parse *p = arg;
    (void)name;
    p->depth--;
    if (p->at) p->at = p->at->parent;
}

/* Text grows by doubling in memory of its own: arrays may stand in it. */
static void on_text(void *arg, const char *text, int length)
{
    parse *p = arg;
    tli_xd_node *node = p->at;
    if (p->status || !node) return;
    size_t wanted = node->text_bytes + (size_t)length + 1;
    if (wanted > node->text_room) {
        node->text = tl_mem_resize(p->x->ctx, node->text, 2 * wanted, 1, &p->status);
        if (!p->status) node->text_room = 2 * wanted;
    }
    if (p->status) {
        stop(p);
        return;
    }
    memcpy(node->text + node->text_bytes, text, (size_t)length);
    node->text_bytes += (size_t)length;
    node->text[node->text_bytes] = '\0';
}

static tl_status read_xml(parse *p)
{
    tli_xdmf *x = p->x;
    const tli_map *map = &x->source->map;
    XML_SetUserData(p->parser, p);
    XML_SetElementHandler(p->parser, on_start, on_end);
    XML_SetCharacterDataHandler(p->parser, on_text);
    for (uint64_t done = 0; !p->status;) {
        uint64_t left = map->byte_count - done;
        int piece = (int)(left < PIECE_BYTES ? left : PIECE_BYTES);
        bool last = (uint64_t)piece == left;
        if (XML_Parse(p->parser, (const char *)map->bytes + done, piece, last) != XML_STATUS_OK &&
            !p->status)
            return tl_fail(x->ctx, TL_ERR_FORMAT, "'%s': line %lu: %s", x->source->path,
                           XML_GetCurrentLineNumber(p->parser),
                           XML_ErrorString(XML_GetErrorCode(p->parser)));
        done += (uint64_t)piece;
        if (last) break;
    }
    if (!p->status && (!x->root || !tli_xd_same(x->root->name, "Xdmf")))
        return tl_fail(x->ctx, TL_ERR_FORMAT, "'%s': the outermost element is not Xdmf",
                       x->source->path);
    return p->status;
}

tl_status tli_xd_open(tl_ctx *ctx, const tli_source *source, tli_xdmf *x)
{
    *x = (tli_xdmf){.ctx = ctx, .source = source};
    parse p = {.x = x, .parser = XML_ParserCreate(NULL)};
    tli_arena_open(ctx, &x->arena);
    if (!p.parser) return tl_fail(ctx, TL_ERR_MEMORY, "expat has no memory for a parser");
    tl_status st = read_xml(&p);
    XML_ParserFree(p.parser);
    return st;
}

static tli_xd_node *next_node(tli_xd_node *node)
{
    if (node->first_child) return node->first_child;
    while (node && !node->next) node = node->parent;
    return node ? node->next : NULL;
}

void tli_xd_close(tli_xdmf *x)
{
    tli_xd_close_data(x);
    for (tli_xd_node *node = x->root; node; node = next_node(node)) tl_mem_free(x->ctx, node->text);
    tli_arena_close(&x->arena);
}

/* ---- looking up ---- */

bool tli_xd_same(const char *a, const char *b)
{
    while (*a && tolower((unsigned char)*a) == tolower((unsigned char)*b)) a++, b++;
    return *a == '\0' && *b == '\0';
}

const tli_xd_node *tli_xd_child(const tli_xd_node *node, const char *name, const tli_xd_node *after)
{
    const tli_xd_node *child = after ? after->next : node->first_child;
    while (child && !tli_xd_same(child->name, name)) child = child->next;
    return child;
}

const char *tli_xd_value(const tli_xd_node *node, const char *name, const char *otherwise)
{
    for (size_t i = 0; i < node->attribute_count; i++)
        if (tli_xd_same(node->attributes[i].name, name)) return node->attributes[i].value;
    return otherwise;
}

/* One step of a path: a name, and in brackets a number or @Attribute="value". */
typedef struct step {
    char name[64], attribute[64], value[256];
    unsigned long number; /* 0: none */
} step;

static void copy_until(const char **at, const char *ends, char *text, size_t text_bytes)
{
    size_t length = strcspn(*at, ends), kept = length < text_bytes - 1 ? length : text_bytes - 1;
    memcpy(text, *at, kept);
    text[kept] = '\0';
    *at += length;
}

static bool take_step(const char **at, step *s)
{
    *s = (step){.name = ""};
    copy_until(at, "/[", s->name, sizeof s->name);
    if (**at == '[') {
        ++*at;
        if (**at == '@') {
            ++*at;
            copy_until(at, "=]", s->attribute, sizeof s->attribute);
            *at += strspn(*at, "= ");
            char quote[2] = {**at, '\0'};
            if (*quote == '"' || *quote == '\'') {
                ++*at;
                copy_until(at, quote, s->value, sizeof s->value);
            }
        } else {
            s->number = strtoul(*at, NULL, 10);
        }
        *at += strcspn(*at, "]");
        if (**at == ']') ++*at;
    }
    return *s->name != '\0';
}

static bool fits(const tli_xd_node *node, const step *s)
{
    if (!tli_xd_same(node->name, s->name)) return false;
    return !*s->attribute || strcmp(tli_xd_value(node, s->attribute, ""), s->value) == 0;
}

const tli_xd_node *tli_xd_find(const tli_xdmf *x, const char *path)
{
    step s;
    tli_xd_node *node = x->root;
    bool anywhere = strncmp(path, "//", 2) == 0;
    path += strspn(path, "/");
    if (!node || !take_step(&path, &s)) return NULL;
    if (anywhere)
        while (node && !fits(node, &s)) node = next_node(node);
    else if (!fits(node, &s))
        return NULL;
    while (node && *path == '/') {
        path += strspn(path, "/");
        if (*path == '*' || !take_step(&path, &s)) break;
        unsigned long number = s.number ? s.number : 1;
        tli_xd_node *child = node->first_child;
        for (; child; child = child->next)
            if (fits(child, &s) && --number == 0) break;
        node = child;
    }
    return node;
}
