/* Stage formats, internal: what the readers of images share. An image is values on a lattice, in
 * any order of its axes, which becomes one structured block with one array. */
#ifndef TETRALOD_SRC_FORMATS_VOLUME_H
#define TETRALOD_SRC_FORMATS_VOLUME_H

#include "formats/formats_reader.h"
#include "formats/formats_scan.h"

typedef struct tli_volume {
    const char *path; /* for messages */
    const char *name; /* of the array */
    uint64_t dims[3]; /* points along i, j, k */
    uint64_t components;
    uint64_t strides[4]; /* values from one i, j, k, component to the next */
    double origin[3];    /* of point 0, 0, 0 */
    double steps[3][3];  /* from a point to the next along i, j, k */
    tl_scalar scalar;    /* of the numbers in bytes */
    tl_scalar type;      /* that the array is said to have */
    bool big_endian;
    double slope, inter; /* value = slope * number + inter; 1, 0 changes nothing */
    const uint8_t *bytes;
    uint64_t byte_count;
} tli_volume;

/* One component, i fastest, unit steps, little-endian. */
void tli_volume_init(const char *path, const char *name, tli_volume *volume);
/* Strides for values whose components stand together, or for one component after the other. */
void tli_volume_order(tli_volume *volume, bool components_together);
/* Bytes that the values of a volume need; refuses dimensions or components that are 0, too many
 * points and sizes that overflow. */
tl_status tli_volume_bytes(tl_ctx *ctx, const tli_volume *volume, uint64_t *byte_count);
/* Fills an empty grid. TL_ERR_FORMAT if bytes are too few. */
tl_status tli_volume_to_grid(tl_ctx *ctx, const tli_volume *volume, tli_grid *grid);
/* Reads count numbers of a text as native float64 into a new map, for tli_volume.bytes. */
tl_status tli_volume_text(tli_scan *scan, uint64_t count, tli_map *numbers);

#endif
