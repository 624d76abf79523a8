/* Stage formats, internal: what the writers of points, lines and triangles share. */
#ifndef TETRALOD_SRC_FORMATS_WRITE_POLY_H
#define TETRALOD_SRC_FORMATS_WRITE_POLY_H

#include "base/base_file.h"
#include "tetralod/formats.h"

/* What is written, and where to. */
typedef struct tli_poly_out {
    tl_ctx *ctx;
    tli_sink *sink;
    const tl_polydata *poly;
    double bounds[6];      /* of the finite vertices: x0, x1, y0, y1, z0, z1 */
    double largest;        /* coordinate, without its sign */
    bool float_places;     /* float32 is exact enough for positions */
    uint64_t corner_count; /* numbers in poly->corners */
} tli_poly_out;

/* One file each; the sink is open. */
tl_status tli_write_ply(const tli_poly_out *out);
tl_status tli_write_vtp(const tli_poly_out *out);
tl_status tli_write_stl(const tli_poly_out *out);
tl_status tli_write_obj(const tli_poly_out *out);
tl_status tli_write_glb(const tli_poly_out *out);

/* Numbers as little-endian bytes, one behind the other; each returns the place behind. */
uint8_t *tli_le_f32(uint8_t *to, double value);
uint8_t *tli_le_f64(uint8_t *to, double value);
uint8_t *tli_le_u32(uint8_t *to, uint32_t value);
uint8_t *tli_le_u64(uint8_t *to, uint64_t value);

/* A place, as float32 where out says so, a normal as float32, and the values of a channel at a
 * vertex; likewise. */
uint8_t *tli_put_place(const tli_poly_out *out, size_t vert, uint8_t *to);
uint8_t *tli_put_normal(const tli_poly_out *out, size_t vert, uint8_t *to);
uint8_t *tli_put_values(const tl_channel *channel, bool single, size_t vert, uint8_t *to);

/* True if a channel is written as float32: its file had no more. */
bool tli_is_single(const tl_channel *channel);
/* Writes count items, each made by make into at most item_bytes bytes (it returns the place behind
 * the item), and looks for a cancellation now and then. */
typedef uint8_t *(*tli_make_fn)(const tli_poly_out *out, const void *arg, size_t item, uint8_t *to);
tl_status tli_write_items(const tli_poly_out *out, size_t count, size_t item_bytes,
                          tli_make_fn make, const void *arg);
/* name with all but letters and digits as '_', cut at length - 1 bytes. */
void tli_plain_name(const char *name, char *plain, size_t length);

#endif
