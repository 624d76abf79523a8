/* Stage formats, internal: faces with an id each, on their way to the labels of a grid. */
#ifndef TETRALOD_SRC_FORMATS_LABEL_H
#define TETRALOD_SRC_FORMATS_LABEL_H

#include "formats/formats_grid.h"

/* More different ids are no labels that anybody looks at: they are counted and left out. */
#define TLI_LABELS_MAX 4096

typedef struct tli_faces {
    tl_ctx *ctx;
    uint64_t count, capacity;
    int32_t *ids;      /* [count] */
    uint64_t *offsets; /* [count + 1] into points */
    uint32_t *points;
    uint64_t point_capacity;
} tli_faces;

void tli_faces_init(tl_ctx *ctx, tli_faces *faces);
void tli_faces_release(tli_faces *faces);
/* Points [point_count] are ids of the grid, checked by the caller. */
tl_status tli_faces_add(tli_faces *faces, int32_t id, const uint32_t *points, uint32_t point_count);

/* The name of an id, NULL or "" for none; borrowed until the next call. */
typedef const char *(*tli_label_name_fn)(const void *arg, int32_t id);
/* Adds a label an id to the grid, by ascending ids. name may be NULL. */
tl_status tli_faces_to_labels(const tli_faces *faces, tli_grid *grid, tli_label_name_fn name,
                              const void *arg);

#endif
