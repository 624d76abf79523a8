/* Stage formats, internal: the parts of the XDMF reader. The XML is a tree of elements (through
 * expat), arrays stand in the XML, in HDF5 or in files of bytes. */
#ifndef TETRALOD_SRC_FORMATS_XDMF_H
#define TETRALOD_SRC_FORMATS_XDMF_H

#include "formats/formats_cells.h"
#include "formats/formats_reader.h"

typedef struct tli_xd_attribute {
    const char *name, *value;
} tli_xd_attribute;

typedef struct tli_xd_node {
    const char *name; /* without a prefix */
    tli_xd_attribute *attributes;
    size_t attribute_count;
    char *text; /* "" if there is none */
    size_t text_bytes, text_room;
    struct tli_xd_node *parent, *first_child, *last_child, *next;
} tli_xd_node;

typedef struct tli_xdmf {
    tl_ctx *ctx;
    const tli_source *source;
    tli_arena arena;
    tli_xd_node *root;
    /* the file of arrays that is open */
    char *data_path;
    tli_map data_map;
    struct tli_h5 *h5;
} tli_xdmf;

/* Reads the XML. On failure, too, to be closed. formats_xdmf_expat.c */
tl_status tli_xd_open(tl_ctx *ctx, const tli_source *source, tli_xdmf *x);
void tli_xd_close(tli_xdmf *x);

/* First child of that name, or one behind after; names in any case. */
const tli_xd_node *tli_xd_child(const tli_xd_node *node, const char *name,
                                const tli_xd_node *after);
/* Value of an attribute, otherwise if it has none. */
const char *tli_xd_value(const tli_xd_node *node, const char *name, const char *otherwise);
/* Number of an attribute; *value stays where there is none. node: may be NULL. */
tl_status tli_xd_real(const tli_xdmf *x, const tli_xd_node *node, const char *name, double *value);
/* The element that a path such as //Grid[@Name="mesh"]/Grid[1] names; NULL if there is none. */
const tli_xd_node *tli_xd_find(const tli_xdmf *x, const char *path);
bool tli_xd_same(const char *a, const char *b); /* in any case */

/* A DataItem: how many numbers it has and of which type; then the numbers. formats_xdmf_items.c */
tl_status tli_xd_describe(tli_xdmf *x, const tli_xd_node *item, uint64_t *count, tl_scalar *scalar);
tl_status tli_xd_reals(tli_xdmf *x, const tli_xd_node *item, uint64_t count, double *out);
tl_status tli_xd_fail(const tli_xdmf *x, const tli_xd_node *node, const char *what);
void tli_xd_close_data(tli_xdmf *x);

#endif
