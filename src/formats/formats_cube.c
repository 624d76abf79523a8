/* Gaussian cube: two lines of text, atoms, then values with k fastest. Lengths stay as they are in
 * the file. A negative number of atoms says that a line with numbers of orbitals follows them,
 * whose values stand together at each point. */
#include "formats/formats_volume.h"

#include "formats/formats_emit.h"

#include <inttypes.h>

#define ATOM_NUMBERS 5 /* number, charge, position */
#define COUNT_MAX 1000000

/* Bytes that a number takes at least, with the blank before it. */
#define NUMBER_BYTES 2

static tl_status read_lattice(tli_scan *scan, int64_t *atoms, int64_t *values_a_point,
                              tli_volume *volume)
{
    tli_span rest;
    tl_status st = tli_scan_int(scan, "the number of atoms", -COUNT_MAX, COUNT_MAX, atoms);
    if (!st) st = tli_scan_reals(scan, "the origin", 3, volume->origin);
    const char *first = scan->at;
    if (!st && tli_scan_line(scan, &rest) && !tli_span_is(rest, "")) {
        scan->at = first; /* values of each point, where the line has one number more */
        st = tli_scan_int(scan, "values of a point", 1, COUNT_MAX, values_a_point);
    }
    for (int axis = 0; !st && axis < 3; axis++) {
        int64_t size = 0;
        st = tli_scan_int(scan, "a number of points", -(int64_t)UINT32_MAX, UINT32_MAX, &size);
        if (!st) st = tli_scan_reals(scan, "a step", 3, volume->steps[axis]);
        volume->dims[axis] = (uint64_t)(size < 0 ? -size : size); /* < 0: lengths in angstrom */
    }
    return st;
}

static tl_status skip_atoms(tli_scan *scan, int64_t atoms, uint64_t *components)
{
    const uint64_t numbers = (uint64_t)(atoms < 0 ? -atoms : atoms) * ATOM_NUMBERS;
    tl_status st = tli_scan_room(scan, "numbers of atoms", numbers, NUMBER_BYTES);
    double ignored;
    int64_t orbitals = 0;
    for (uint64_t i = 0; !st && i < numbers; i++) st = tli_scan_real(scan, "an atom", &ignored);
    if (st || atoms >= 0) return st;
    st = tli_scan_int(scan, "the number of orbitals", 1, COUNT_MAX, &orbitals);
    if (!st) st = tli_scan_room(scan, "orbitals", (uint64_t)orbitals, NUMBER_BYTES);
    for (int64_t i = 0; !st && i < orbitals; i++) st = tli_scan_real(scan, "an orbital", &ignored);
    *components = (uint64_t)orbitals;
    return st;
}

tli_match tli_match_cube(const tli_source *source)
{
    return !source->folder && tli_ends_in(source->path, ".cube .cub") ? TLI_MATCH_NAME
                                                                      : TLI_MATCH_NO;
}

tl_status tli_read_cube(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                        tli_grid *grid)
{
    const char *path = source->path;
    const tli_map *map = &source->map;
    (void)opts;
    tli_scan scan;
    tli_span line;
    int64_t atoms = 0, values_a_point = 1;
    uint64_t needed = 0;
    tli_map numbers = {0};
    tli_volume volume;
    tli_volume_init(path, "value", &volume);
    tli_scan_open(ctx, path, map->bytes, map->byte_count, &scan);
    for (int i = 0; i < 2; i++) tli_scan_line(&scan, &line);
    tl_status st = read_lattice(&scan, &atoms, &values_a_point, &volume);
    volume.components = (uint64_t)values_a_point;
    if (!st) st = skip_atoms(&scan, atoms, &volume.components);
    if (st) return st;
    volume.scalar = TL_F64;
    volume.type = TL_F64;
    volume.big_endian = tli_big_endian_host();
    volume.strides[3] = 1;
    volume.strides[2] = volume.components;
    volume.strides[1] = volume.strides[2] * volume.dims[2];
    volume.strides[0] = volume.strides[1] * volume.dims[1];
    st = tli_volume_bytes(ctx, &volume, &needed);
    if (!st) st = tli_volume_text(&scan, needed / sizeof(double), &numbers);
    volume.bytes = numbers.bytes;
    volume.byte_count = numbers.byte_count;
    if (!st) st = tli_volume_to_grid(ctx, &volume, grid);
    tli_map_close(ctx, &numbers);
    return st;
}
