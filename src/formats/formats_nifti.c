/* NIfTI-1 and -2: a binary header of 348 or 540 bytes, then values, i fastest, all of one volume
 * before the next (nifti.nimh.nih.gov). One file (n+1, n+2) or a pair .hdr, .img (ni1, ni2). Axes
 * past the third become components. Positions are those of the method that the header prefers:
 * sform, then qform, then spacings alone. */
#include "formats/formats_volume.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#define HEAD1_BYTES 348
#define HEAD2_BYTES 540

/* Where the fields of a version stand. */
typedef struct places {
    unsigned dim, dim_bytes, datatype, pixdim, real_bytes, vox_offset, slope, inter, qform, sform,
        quatern, qoffset, srow, magic;
} places;
static const places version1 = {40, 2, 70, 76, 4, 108, 112, 116, 252, 254, 256, 268, 280, 344};
static const places version2 = {16, 8, 12, 104, 8, 168, 176, 184, 344, 348, 352, 376, 400, 4};

typedef struct header {
    const uint8_t *bytes;
    const places *at;
    bool big_endian, version2;
} header;

static double real_at(const header *h, unsigned ofs)
{
    double value;
    tli_widen(h->bytes + ofs, h->at->real_bytes == 4 ? TL_F32 : TL_F64, h->big_endian, 1, &value);
    return value;
}

static int64_t int_at(const header *h, unsigned ofs, unsigned bytes)
{
    double narrow;
    if (bytes > 2) return tli_int_at(h->bytes + ofs, bytes, h->big_endian);
    tli_widen(h->bytes + ofs, TL_I16, h->big_endian, 1, &narrow);
    return (int64_t)narrow;
}

/* Byte order and version by the size of the header, which it begins with. */
static tl_status open_header(tl_ctx *ctx, const tli_map *map, const char *path, header *h)
{
    h->bytes = map->bytes;
    for (int big = 0; map->byte_count >= 4 && big < 2; big++) {
        int64_t size = tli_int_at(map->bytes, 4, big);
        if (size != HEAD1_BYTES && size != HEAD2_BYTES) continue;
        h->big_endian = big;
        h->version2 = size == HEAD2_BYTES;
        h->at = h->version2 ? &version2 : &version1;
        if (map->byte_count < (uint64_t)size) break;
        return TL_OK;
    }
    return tl_fail(ctx, TL_ERR_FORMAT,
                   "'%s': %" PRIu64 " bytes that begin no NIfTI header of %d or %d", path,
                   map->byte_count, HEAD1_BYTES, HEAD2_BYTES);
}

static tl_status read_type(tl_ctx *ctx, const header *h, tli_volume *volume)
{
    int64_t code = int_at(h, h->at->datatype, 2);
    uint64_t parts = 1; /* components of one number */
    switch (code) {
    case 2: volume->scalar = TL_U8; break;
    case 4: volume->scalar = TL_I16; break;
    case 8: volume->scalar = TL_I32; break;
    case 16: volume->scalar = TL_F32; break;
    case 64: volume->scalar = TL_F64; break;
    case 256: volume->scalar = TL_I8; break;
    case 512: volume->scalar = TL_U16; break;
    case 768: volume->scalar = TL_U32; break;
    case 1024: volume->scalar = TL_I64; break;
    case 1280: volume->scalar = TL_U64; break;
    case 128: volume->scalar = TL_U8, parts = 3; break;  /* RGB */
    case 2304: volume->scalar = TL_U8, parts = 4; break; /* RGBA */
    case 32: volume->scalar = TL_F32, parts = 2; break;  /* complex */
    case 1792: volume->scalar = TL_F64, parts = 2; break;
    default:
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': datatype %" PRId64 " of NIfTI", volume->path,
                       code);
    }
    volume->type = volume->scalar;
    if (parts > 1 && volume->components > 1)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "'%s': several volumes of colours or complex numbers", volume->path);
    volume->components *= parts;
    tli_volume_order(volume, parts > 1);
    return TL_OK;
}

static tl_status read_dims(tl_ctx *ctx, const header *h, tli_volume *volume)
{
    const unsigned bytes = h->at->dim_bytes;
    int64_t axes = int_at(h, h->at->dim, bytes);
    if (axes < 1 || axes > 7)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': dim[0] is %" PRId64 ", expected 1 to 7",
                       volume->path, axes);
    for (int64_t axis = 0; axis < axes; axis++) {
        int64_t size = int_at(h, h->at->dim + (unsigned)(axis + 1) * bytes, bytes);
        if (size < 1 || size > UINT32_MAX)
            return tl_fail(ctx, TL_ERR_FORMAT,
                           "'%s': dim[%" PRId64 "] is %" PRId64 ", expected 1 to %u", volume->path,
                           axis + 1, size, UINT32_MAX);
        if (axis < 3)
            volume->dims[axis] = (uint64_t)size;
        else if (volume->components > UINT32_MAX)
            return tl_fail(ctx, TL_ERR_FORMAT, "'%s': too many components", volume->path);
        else
            volume->components *= (uint64_t)size;
    }
    return TL_OK;
}

/* ---- positions ---- */

static void take_sform(const header *h, tli_volume *volume)
{
    for (unsigned row = 0; row < 3; row++)
        for (unsigned column = 0; column < 4; column++) {
            double value = real_at(h, h->at->srow + (4 * row + column) * h->at->real_bytes);
            if (column < 3)
                volume->steps[column][row] = value;
            else
                volume->origin[row] = value;
        }
}

/* The quaternion (a, b, c, d) with a from the others; qfac = pixdim[0] mirrors k. */
static void take_qform(const header *h, const double *spacing, tli_volume *volume)
{
    const unsigned bytes = h->at->real_bytes;
    double b = real_at(h, h->at->quatern), c = real_at(h, h->at->quatern + bytes),
           d = real_at(h, h->at->quatern + 2 * bytes);
    double rest = 1 - (b * b + c * c + d * d), a = 0;
    if (rest > 0) {
        a = sqrt(rest);
    } else {
        double norm = sqrt(b * b + c * c + d * d); /* a turn of 180 degrees, up to rounding */
        b /= norm, c /= norm, d /= norm;
    }
    const double turn[3][3] = {
        {a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
        {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
        {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c}};
    double mirror = real_at(h, h->at->pixdim) < 0 ? -1 : 1;
    for (unsigned axis = 0; axis < 3; axis++) {
        for (unsigned row = 0; row < 3; row++)
            volume->steps[axis][row] = turn[row][axis] * spacing[axis] * (axis == 2 ? mirror : 1);
        volume->origin[axis] = real_at(h, h->at->qoffset + axis * bytes);
    }
}

static void place_axes(const header *h, tli_volume *volume)
{
    const unsigned code_bytes = h->version2 ? 4 : 2;
    double spacing[3];
    for (unsigned axis = 0; axis < 3; axis++) {
        spacing[axis] = real_at(h, h->at->pixdim + (axis + 1) * h->at->real_bytes);
        if (!isfinite(spacing[axis]) || spacing[axis] == 0) spacing[axis] = 1;
        volume->steps[axis][axis] = spacing[axis];
    }
    if (int_at(h, h->at->sform, code_bytes) > 0)
        take_sform(h, volume);
    else if (int_at(h, h->at->qform, code_bytes) > 0)
        take_qform(h, spacing, volume);
}

/* ---- values ---- */

static tl_status values_offset(tl_ctx *ctx, const header *h, const char *path, bool pair,
                               uint64_t byte_count, uint64_t *ofs)
{
    double offset =
        h->version2 ? (double)int_at(h, h->at->vox_offset, 8) : real_at(h, h->at->vox_offset);
    double least = pair ? 0 : h->version2 ? HEAD2_BYTES : HEAD1_BYTES;
    if (!(offset >= least)) offset = least + (pair ? 0 : 4); /* 0 is found in the wild */
    if (!(offset <= (double)byte_count))
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': values at byte %g of %" PRIu64, path, offset,
                       byte_count);
    *ofs = (uint64_t)offset;
    return TL_OK;
}

static tl_status read_values(tl_ctx *ctx, const header *h, const tli_map *map, bool pair,
                             tli_volume *volume, tli_grid *grid)
{
    uint64_t ofs = 0;
    tl_status st = values_offset(ctx, h, volume->path, pair, map->byte_count, &ofs);
    if (st) return st;
    volume->bytes = map->bytes + ofs;
    volume->byte_count = map->byte_count - ofs;
    return tli_volume_to_grid(ctx, volume, grid);
}

/* The values of a pair stand in the file with the ending .img, or .img.gz. */
static tl_status read_pair(tl_ctx *ctx, const header *h, const char *path, tli_volume *volume,
                           tli_grid *grid)
{
    char *name = NULL;
    tli_map packed = {0}, data = {0};
    size_t ending = tli_path_ends(path, ".hdr.gz") ? 7 : tli_path_ends(path, ".hdr") ? 4 : 0;
    if (ending == 0)
        return tl_fail(
            ctx, TL_ERR_FORMAT,
            "'%s': the header of a pair, whose name ends in .hdr and the other's in .img", path);
    tl_status st = tli_path_with_ending(ctx, path, ending, ending == 4 ? ".img" : ".img.gz", &name);
    if (!st) st = tli_map_open(ctx, name, ending == 4 ? &data : &packed);
    if (!st && ending == 7)
        st = tli_inflate(ctx, name, packed.bytes, packed.byte_count, UINT64_MAX, false, &data);
    if (!st) {
        volume->path = name;
        st = read_values(ctx, h, &data, true, volume, grid);
    }
    tli_map_close(ctx, &data);
    tli_map_close(ctx, &packed);
    tl_mem_free(ctx, name);
    return st ? tl_note(ctx, st, "while reading the values of '%s'", path) : TL_OK;
}

tli_match tli_match_nifti(const tli_source *source)
{
    const uint8_t *bytes = source->map.bytes;
    uint64_t count = source->map.byte_count;
    if (count >= HEAD1_BYTES && bytes[HEAD1_BYTES - 4] == 'n' &&
        (memcmp(bytes + HEAD1_BYTES - 3, "+1", 3) == 0 ||
         memcmp(bytes + HEAD1_BYTES - 3, "i1", 3) == 0))
        return TLI_MATCH_BYTES;
    if (count >= HEAD2_BYTES && bytes[4] == 'n' &&
        (memcmp(bytes + 5, "+2", 3) == 0 || memcmp(bytes + 5, "i2", 3) == 0))
        return TLI_MATCH_BYTES;
    return !source->folder && tli_ends_in(source->path, ".nii .nii.gz") ? TLI_MATCH_NAME
                                                                        : TLI_MATCH_NO;
}

tl_status tli_read_nifti(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                         tli_grid *grid)
{
    const char *path = source->path;
    const tli_map *map = &source->map;
    (void)opts;
    header h = {0};
    tli_volume volume;
    tli_volume_init(path, "value", &volume);
    tl_status st = open_header(ctx, map, path, &h);
    if (!st) st = read_dims(ctx, &h, &volume);
    if (!st) st = read_type(ctx, &h, &volume);
    if (st) return st;
    place_axes(&h, &volume);
    volume.big_endian = h.big_endian;
    double slope = real_at(&h, h.at->slope), inter = real_at(&h, h.at->inter);
    if (isfinite(slope) && slope != 0 && isfinite(inter))
        volume.slope = slope, volume.inter = inter;
    const uint8_t *magic = h.bytes + h.at->magic;
    if (magic[0] == 'n' && magic[1] == '+') return read_values(ctx, &h, map, false, &volume, grid);
    if (magic[0] == 'n' && magic[1] == 'i') return read_pair(ctx, &h, path, &volume, grid);
    return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                   "'%s': no NIfTI magic behind the header (n+1 or ni1), maybe ANALYZE 7.5", path);
}
