/* Stage formats, internal: the parts of the CGNS reader. A CGNS file is a tree of named, labelled
 * nodes with arrays, kept in ADF (formats_adf.c) or in HDF5 (formats_cgns_hdf5.c); what the nodes
 * mean is the same in both. */
#ifndef TETRALOD_SRC_FORMATS_CGNS_H
#define TETRALOD_SRC_FORMATS_CGNS_H

#include "formats/formats_cells.h"
#include "formats/formats_reader.h"

#define TLI_CG_NAME 33
#define TLI_CG_RANK_MAX 12
/* Nodes and levels of a tree at most: a file whose nodes name one another has no end. */
#define TLI_CG_NODES_MAX 1000000
#define TLI_CG_DEPTH_MAX 64

typedef struct tli_cg_node {
    char name[TLI_CG_NAME], label[TLI_CG_NAME], type[3]; /* type: MT C1 I4 I8 U4 U8 R4 R8 B1 LK */
    uint32_t rank;
    uint64_t dims[TLI_CG_RANK_MAX]; /* first fastest */
    uint64_t count;                 /* of values */
    struct tli_cg_node *parent, *first_child, *last_child, *next;
    const uint8_t *bytes; /* ADF: the values, or NULL */
} tli_cg_node;

typedef struct tli_cg {
    tl_ctx *ctx;
    const char *path; /* borrowed */
    const tli_map *map;
    tli_arena arena; /* nodes, and data that lie in pieces */
    struct tli_h5 *h5;
    bool big_endian;
    uint64_t node_count;
    tli_cg_node *root;
    uint64_t links_left_out;
} tli_cg;

/* Reads the tree, not the arrays. On failure, too, to be closed. */
tl_status tli_cg_open(tl_ctx *ctx, const tli_source *source, tli_cg *cg);
void tli_cg_close(tli_cg *cg);

/* Adds an empty node. */
tli_cg_node *tli_cg_add(tli_cg *cg, tli_cg_node *parent, tl_status *st);
/* Sets count from the dimensions; false if it overflows. */
bool tli_cg_count(tli_cg_node *node);
/* Bytes and number type of a value; 0 for a type that holds none. */
size_t tli_cg_value_bytes(const tli_cg_node *node, tl_scalar *scalar);
tl_status tli_cg_fail(const tli_cg *cg, const tli_cg_node *node, const char *what);
/* "/Base/Zone 1/..." without the root. */
void tli_cg_path(const tli_cg_node *node, char *path, size_t path_bytes);

/* First child of that name; first child, or one behind after, with that label; NULL if none. */
const tli_cg_node *tli_cg_child(const tli_cg_node *node, const char *name);
const tli_cg_node *tli_cg_labelled(const tli_cg_node *node, const char *label,
                                   const tli_cg_node *after);
/* Text of a C1 node; "" if it has none. */
tl_status tli_cg_text(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                      char *text, size_t text_bytes);
/* Values [first, first + count) to out[0], out[stride] ... */
tl_status tli_cg_reals(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                       double *out, size_t stride);
tl_status tli_cg_ints(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                      int64_t *out);

/* The two homes of a tree. */
tl_status tli_adf_open(tli_cg *cg);
tl_status tli_cg_hdf5_open(tli_cg *cg);
void tli_cg_hdf5_close(tli_cg *cg);
tl_status tli_cg_hdf5_reals(tli_cg *cg, const tli_cg_node *node, uint64_t first, uint64_t count,
                            double *out, size_t stride);

/* ---- a zone on its way into a grid ---- */

/* An Elements_t node. */
typedef struct tli_cg_section {
    const tli_cg_node *node;
    unsigned kind;                   /* of CGNS */
    int64_t first, last;             /* numbers of its elements */
    uint64_t first_face;             /* NGON: of the faces of the grid */
    uint64_t *places;                /* several kinds: where each element begins in ids; owned */
    const tli_cg_node *ids, *starts; /* starts: NULL in older files */
} tli_cg_section;

typedef struct tli_cg_zone {
    tli_cg *cg;
    const tli_cg_node *node;
    tli_grid *grid;        /* of the zone */
    const tli_grid *whole; /* what the zones before became */
    bool structured;
    unsigned axes;     /* of the index: 1 where unstructured */
    unsigned cell_dim; /* of the base */
    uint64_t points[3], cells[3];
    size_t step;
    tli_cg_section *sections;
    size_t section_count;
    uint64_t surface_elements; /* of sections that are no cells */
} tli_cg_zone;

/* Layers beyond the zone at both ends of each axis, of coordinates and values. */
tl_status tli_cg_rind(tli_cg_zone *zone, const tli_cg_node *node, uint64_t rind[6]);
/* An array of sizes [3] places without its layers. */
tl_status tli_cg_read_placed(tli_cg_zone *zone, const tli_cg_node *array, const uint64_t sizes[3],
                             const uint64_t rind[6], double *out, size_t stride);
/* Lists and reads the Elements_t nodes. formats_cgns_sections.c */
tl_status tli_cg_read_sections(tli_cg_zone *zone);
/* Corners of element number; 0 if it is none of a surface. room for 256 */
tl_status tli_cg_surface(tli_cg_zone *zone, int64_t number, uint32_t *ids, uint32_t *count);
/* FlowSolution_t nodes of the step. formats_cgns_fields.c */
tl_status tli_cg_read_fields(tli_cg_zone *zone);
/* The node that the step names, such as "GridCoordinates"; text: "" if the file has no steps. */
tl_status tli_cg_step_name(tli_cg_zone *zone, const char *pointers, char name[TLI_CG_NAME]);
/* BC_t nodes become labels. formats_cgns_bc.c */
tl_status tli_cg_read_bcs(tli_cg_zone *zone);

#endif
