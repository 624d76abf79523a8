/* Volumes: NRRD, MetaImage, NIfTI, SLC, Inrimage, Gaussian cube. Small ones made here, with every
 * type, byte order and coding; damaged ones; and the real ones against what VTK 9.1 reads. */
#include "check_source.h"

#include "formats/formats_scan.h"
#include "formats/formats_volume.h"

#include <zlib.h>

/* A file in memory. */
typedef struct buffer {
    uint8_t bytes[8192];
    size_t count;
} buffer;

static void put_bytes(buffer *b, const void *bytes, size_t count)
{
    CHECK(b->count + count <= sizeof b->bytes);
    memcpy(b->bytes + b->count, bytes, count);
    b->count += count;
}

static void put_text(buffer *b, const char *text)
{
    put_bytes(b, text, strlen(text));
}

/* The bits of a small whole number as a type, in a byte order. */
static void put_number(buffer *b, tl_scalar scalar, bool big_endian, int value)
{
    uint8_t bytes[8];
    put_bytes(b, bytes, grid_number(bytes, scalar, big_endian, value));
}

static void put_values(buffer *b, tl_scalar scalar, bool big_endian, int count)
{
    for (int i = 0; i < count; i++) put_number(b, scalar, big_endian, i);
}

/* Packs what stands from a place on, as gzip (31) or zlib (15) window bits say. */
static void pack_from(buffer *b, size_t from, int window_bits)
{
    uint8_t packed[4096];
    z_stream z = {.next_in = b->bytes + from, .avail_in = (uInt)(b->count - from)};
    CHECK_EQ(deflateInit2(&z, 9, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
    z.next_out = packed;
    z.avail_out = sizeof packed;
    CHECK_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
    b->count = from;
    put_bytes(b, packed, sizeof packed - z.avail_out);
    deflateEnd(&z);
}

static void read_ok(tl_ctx *ctx, source_reader read, const char *path, const buffer *b,
                    tli_grid *grid)
{
    source_case c = {path, read, NULL};
    CHECK_OK(ctx, grid_read(ctx, source_read, &c, b->bytes, b->count, grid));
    grid_check(grid);
}

static void refused(source_reader read, const char *path, const buffer *b, tl_status status,
                    const char *says)
{
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    tli_grid grid;
    source_case c = {path, read, NULL};
    CHECK_STATUS(grid_read(ctx, source_read, &c, b->bytes, b->count, &grid), status);
    check_says(ctx, says);
    check_says(ctx, path);
    tli_grid_release(&grid);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

/* The values 0, 1, 2 ... in the order of the file, one component, and the corner of a lattice. */
static void check_counting(const tli_grid *grid, uint32_t ni, uint32_t nj, uint32_t nk,
                           const double last[3])
{
    const size_t count = (size_t)ni * nj * nk;
    CHECK_EQ(grid->block_count, 1);
    CHECK_EQ(grid->blocks[0].dims[0], ni);
    CHECK_EQ(grid->blocks[0].dims[1], nj);
    CHECK_EQ(grid->blocks[0].dims[2], nk);
    CHECK_EQ(grid->point_array_count, 1);
    for (size_t i = 0; i < count; i++) CHECK(grid->point_arrays[0].values[i] == (double)i);
    for (int axis = 0; axis < 3; axis++)
        CHECK_NEAR(grid->xyz[3 * (count - 1) + (size_t)axis], last[axis], 1e-12);
}

/* ---- NRRD ---- */

static void nrrd_types_and_codings(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        tl_scalar scalar;
    } types[] = {{"signed char", TL_I8}, {"uchar", TL_U8},     {"short", TL_I16},
                 {"uint16", TL_U16},     {"int", TL_I32},      {"unsigned int", TL_U32},
                 {"long long", TL_I64},  {"uint64_t", TL_U64}, {"float", TL_F32},
                 {"double", TL_F64}};
    static const char *const codings[] = {"raw", "gzip", "ascii"};
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int variant = 0; variant < 60; variant++) {
        const int type = variant / 6, coding = variant / 2 % 3;
        const bool big = variant % 2;
        buffer b = {.count = 0};
        tli_grid grid;
        char head[400];
        snprintf(head, sizeof head,
                 "NRRD0004\n# a comment\nkey:=value: with a colon\ntype: %s\ndimension: 3\n"
                 "sizes: 2 3 4\nspacings: 0.5 1 2\naxis mins: 1 2 3\nendian: %s\nencoding: %s\n\n",
                 types[type].name, big ? "big" : "little", codings[coding]);
        put_text(&b, head);
        const size_t from = b.count;
        for (int i = 0; i < 24; i++) {
            snprintf(head, sizeof head, "%d ", i);
            if (coding == 2)
                put_text(&b, head);
            else
                put_number(&b, types[type].scalar, big, i);
        }
        if (coding == 1) pack_from(&b, from, 31);
        read_ok(ctx, tli_read_nrrd, "a.nrrd", &b, &grid);
        CHECK_EQ(grid.point_arrays[0].scalar, types[type].scalar);
        check_counting(&grid, 2, 3, 4, (double[3]){1.5, 4, 9});
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

static void nrrd_detached_with_components(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    buffer b = {.count = 0}, data = {.count = 0};
    tli_grid grid;
    put_text(&b, "NRRD0005\r\ntype: uint8\r\ndimension: 4\r\nspace: left-posterior-superior\r\n"
                 "sizes: 2 2 2 3\r\nspace directions: none (0,2,0) (1,0,0) (0,0,-1)\r\n"
                 "space origin: (10,20,30)\r\nencoding: raw\r\nbyte skip: 5\r\n"
                 "data file: part.raw\r\n");
    put_text(&data, "skip!");
    put_values(&data, TL_U8, false, 24);
    put_file("part.raw", data.bytes, data.count);
    read_ok(ctx, tli_read_nrrd, "b.nhdr", &b, &grid);
    CHECK_EQ(grid.point_count, 12);
    CHECK_EQ(grid.point_arrays[0].components, 2);
    for (int i = 0; i < 24; i++) CHECK(grid.point_arrays[0].values[i] == i);
    CHECK(grid.xyz[33] == 11 && grid.xyz[34] == 22 && grid.xyz[35] == 28);
    tli_grid_release(&grid);
    put_file("part.raw", data.bytes, data.count - 1);
    refused(tli_read_nrrd, "b.nhdr", &b, TL_ERR_FORMAT, "23 bytes of values, expected 24");
    remove("part.raw");
    refused(tli_read_nrrd, "b.nhdr", &b, TL_ERR_IO, "part.raw");
    tl_ctx_destroy(ctx);
}

static void nrrd_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        tl_status status;
        const char *says;
    } cases[] = {
        {"NRRD0001\ntype: block\n", TL_ERR_FORMAT, "line 2: type"},
        {"NRRD0001\nsizes: 2 2\n", TL_ERR_FORMAT, "line 2: sizes: expected 0"},
        {"NRRD0001\ndimension: 17\n", TL_ERR_FORMAT, "expected 1 to 16"},
        {"NRRD0001\ndimension: 2\nsizes: 2 0\n", TL_ERR_FORMAT, "line 3: sizes: 0"},
        {"NRRD0001\nencoding: bzip2\n", TL_ERR_UNSUPPORTED, "raw, ascii and gzip are read"},
        {"NRRD0001\nrubbish\n", TL_ERR_FORMAT, "line 2"},
        {"NRRD0001\ntype: int\ndimension: 1\nsizes: 3\n\n", TL_ERR_FORMAT, "no encoding"},
        {"NRRD0001\ntype: int\ndimension: 1\nsizes: 3\nencoding: raw\n\n", TL_ERR_FORMAT,
         "no endian"},
        {"NRRD0001\ntype: uchar\ndimension: 3\nsizes: 60000 60000 60000\nencoding: raw\n\n",
         TL_ERR_UNSUPPORTED, "60000 x 60000 x 60000"},
        {"NRRD0001\ntype: uchar\ndimension: 3\nsizes: 1000 1000 1000\nencoding: raw\n\nabc",
         TL_ERR_FORMAT, "3 bytes of values, expected 1000000000"},
        {"NRRD0001\ntype: float\ndimension: 3\nsizes: 1000 1000 1000\nencoding: ascii\n\n1 2 3",
         TL_ERR_FORMAT, "1000000000 values need"},
        {"NRRD0001\ntype: uchar\ndimension: 4\nsizes: 2 2 2 2\nkinds: domain vector domain vector\n"
         "encoding: raw\n\n",
         TL_ERR_UNSUPPORTED, "between those of components"},
        {"NRRD0001\ntype: uchar\ndimension: 1\nsizes: 2\nencoding: raw\ndata file: LIST\n",
         TL_ERR_UNSUPPORTED, "several files"},
        {"NRRD0001\ntype: uchar\ndimension: 1\nsizes: 2\nencoding: raw\ndata file: /dev/zero\n",
         TL_ERR_IO, "no regular file"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        buffer b = {.count = 0};
        put_text(&b, cases[i].text);
        refused(tli_read_nrrd, "a.nrrd", &b, cases[i].status, cases[i].says);
    }
}

/* ---- MetaImage ---- */

static void metaimage_codings(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int coding = 0; coding < 4; coding++) { /* raw big, raw little, zlib, text */
        buffer b = {.count = 0};
        tli_grid grid;
        char head[400];
        snprintf(head, sizeof head,
                 "ObjectType = Image\nNDims = 3\nBinaryData = %s\nBinaryDataByteOrderMSB = %s\n"
                 "CompressedData = %s\nTransformMatrix = 0 1 0 1 0 0 0 0 1\nOffset = 1 2 3\n"
                 "ElementSpacing = 2 3 4\nDimSize = 3 2 2\nElementType = MET_SHORT\n"
                 "ElementDataFile = LOCAL\n",
                 coding == 3 ? "False" : "True", coding == 0 ? "True" : "False",
                 coding == 2 ? "True" : "False");
        put_text(&b, head);
        const size_t from = b.count;
        if (coding < 3) put_values(&b, TL_I16, coding == 0, 12);
        if (coding == 2) pack_from(&b, from, 15);
        if (coding == 3) put_text(&b, "0 1 2 3 4 5 6 7 8 9 10 11\n");
        read_ok(ctx, tli_read_metaimage, "a.mha", &b, &grid);
        CHECK_EQ(grid.point_arrays[0].scalar, TL_I16);
        check_counting(&grid, 3, 2, 2, (double[3]){4, 6, 7});
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

static void metaimage_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        tl_status status;
        const char *says;
    } cases[] = {
        {"NDims = 4\n", TL_ERR_UNSUPPORTED, "1 to 3 axes"},
        {"DimSize = 3 0 2\n", TL_ERR_FORMAT, "line 1: DimSize"},
        {"DimSize = 3 1 2\nElementType = MET_STRING\n", TL_ERR_FORMAT, "line 2: ElementType"},
        {"DimSize = 3 1 2\n", TL_ERR_FORMAT, "expected a line ElementDataFile"},
        {"DimSize = 3 1 2\nElementDataFile = LOCAL\n", TL_ERR_FORMAT, "no ElementType"},
        {"DimSize = 3 1 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabc", TL_ERR_FORMAT,
         "3 bytes of values, expected 6"},
        {"DimSize = 900 900 900\nElementType = MET_UCHAR\nCompressedData = True\n"
         "ElementDataFile = LOCAL\nabc",
         TL_ERR_FORMAT, "can't become the 729000000 expected"},
        {"DimSize = 3 1 2\nElementType = MET_UCHAR\nElementDataFile = LIST\n", TL_ERR_UNSUPPORTED,
         "several files"},
        {"DimSize = 3 1 2\nElementType = MET_UCHAR\nElementDataFile = no.raw\n", TL_ERR_IO,
         "no.raw"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        buffer b = {.count = 0};
        put_text(&b, cases[i].text);
        refused(tli_read_metaimage, "a.mhd", &b, cases[i].status, cases[i].says);
    }
}

/* ---- NIfTI ---- */

static void set_i16(buffer *b, size_t ofs, bool big, int value)
{
    buffer number = {.count = 0};
    put_number(&number, TL_I16, big, value);
    memcpy(b->bytes + ofs, number.bytes, 2);
}

static void set_f32(buffer *b, size_t ofs, bool big, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, 4);
    for (size_t i = 0; i < 4; i++) b->bytes[ofs + i] = (uint8_t)(bits >> 8 * (big ? 3 - i : i));
}

static const int nifti_codes[10] = {256, 2, 4, 512, 8, 768, 1024, 1280, 16, 64};

/* A header of 2 x 3 x 4 points and one or more volumes, with the values 0, 1 ... behind it. */
static void make_nifti(buffer *b, tl_scalar scalar, bool big, int volumes, const char *magic)
{
    static const float spacing[4] = {1, 2, 3, 4};
    buffer size = {.count = 0};
    memset(b->bytes, 0, 352);
    b->count = 352;
    put_number(&size, TL_I32, big, 348);
    memcpy(b->bytes, size.bytes, 4);
    static const int dims[3] = {2, 3, 4};
    set_i16(b, 40, big, volumes > 1 ? 4 : 3);
    for (size_t axis = 0; axis < 3; axis++) set_i16(b, 42 + 2 * axis, big, dims[axis]);
    set_i16(b, 48, big, volumes);
    set_i16(b, 70, big, nifti_codes[scalar]);
    for (size_t i = 0; i < 4; i++) set_f32(b, 76 + 4 * i, big, spacing[i]);
    set_f32(b, 108, big, 352);
    memcpy(b->bytes + 344, magic, 4);
    put_values(b, scalar, big, 24 * volumes);
}

static void nifti_types_and_places(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int variant = 0; variant < 20; variant++) {
        buffer b;
        tli_grid grid;
        make_nifti(&b, (tl_scalar)(variant / 2), variant % 2, 1, "n+1");
        read_ok(ctx, tli_read_nifti, "a.nii", &b, &grid);
        CHECK_EQ(grid.point_arrays[0].scalar, variant / 2);
        check_counting(&grid, 2, 3, 4, (double[3]){2, 6, 12});
        tli_grid_release(&grid);
    }
    buffer b;
    tli_grid grid;
    make_nifti(&b, TL_U8, false, 2, "n+1");
    set_i16(&b, 252, false, 1); /* qform: a quarter turn about z, k mirrored */
    set_f32(&b, 76, false, -1);
    set_f32(&b, 264, false, 0.70710678f);
    set_f32(&b, 268, false, 10);
    set_f32(&b, 112, false, 2); /* slope, inter */
    set_f32(&b, 116, false, -1);
    read_ok(ctx, tli_read_nifti, "a.nii", &b, &grid);
    CHECK_EQ(grid.point_arrays[0].components, 2); /* one volume after the other */
    for (size_t i = 0; i < 24; i++) {
        CHECK(grid.point_arrays[0].values[2 * i] == 2.0 * (double)i - 1);
        CHECK(grid.point_arrays[0].values[2 * i + 1] == 2.0 * (double)(i + 24) - 1);
    }
    CHECK_NEAR(grid.xyz[69], 10 - 6, 1e-6);
    CHECK_NEAR(grid.xyz[70], 2, 1e-6);
    CHECK_NEAR(grid.xyz[71], -12, 1e-6);
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

static void nifti_pairs_and_refusals(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    buffer b, bad;
    tli_grid grid;
    make_nifti(&b, TL_I16, true, 1, "ni1");
    set_f32(&b, 108, true, 0);
    put_file("pair.img", b.bytes + 352, b.count - 352);
    b.count = 348;
    read_ok(ctx, tli_read_nifti, "pair.hdr", &b, &grid);
    check_counting(&grid, 2, 3, 4, (double[3]){2, 6, 12});
    tli_grid_release(&grid);
    refused(tli_read_nifti, "pair.nii", &b, TL_ERR_FORMAT, ".hdr");
    remove("pair.img");
    refused(tli_read_nifti, "pair.hdr", &b, TL_ERR_IO, "pair.img");
    make_nifti(&bad, TL_U8, false, 1, "n+1");
    set_i16(&bad, 70, false, 1536);
    refused(tli_read_nifti, "a.nii", &bad, TL_ERR_UNSUPPORTED, "datatype 1536");
    make_nifti(&bad, TL_U8, false, 1, "n+1");
    set_i16(&bad, 42, false, -3);
    refused(tli_read_nifti, "a.nii", &bad, TL_ERR_FORMAT, "dim[1] is -3");
    make_nifti(&bad, TL_U8, false, 1, "n+1");
    set_f32(&bad, 108, false, 1e9f);
    refused(tli_read_nifti, "a.nii", &bad, TL_ERR_FORMAT, "values at byte");
    make_nifti(&bad, TL_F64, false, 1, "n+1");
    bad.count--;
    refused(tli_read_nifti, "a.nii", &bad, TL_ERR_FORMAT, "191 bytes of values, expected 192");
    make_nifti(&bad, TL_F64, false, 1, "abc");
    refused(tli_read_nifti, "a.nii", &bad, TL_ERR_UNSUPPORTED, "ANALYZE");
    tl_ctx_destroy(ctx);
}

/* ---- SLC, Inrimage, cube ---- */

static void make_slc(buffer *b)
{
    static const uint8_t runs[] = {0x83, 0, 1, 2, 0x02, 7, 0x00};
    b->count = 0;
    put_text(b, "11111\n5 1 2 8\n1.5 2 3\n1 6 0 1\n2 1 X");
    put_bytes(b, "icon..", 6);
    for (int k = 0; k < 2; k++) {
        put_text(b, "7 X");
        put_bytes(b, runs, sizeof runs);
    }
}

static void slc_runs(void **state)
{
    (void)state;
    static const double expected[] = {0, 1, 2, 7, 7};
    tl_ctx *ctx = grid_ctx(0, 2);
    buffer b;
    tli_grid grid;
    make_slc(&b);
    read_ok(ctx, tli_read_slc, "a.slc", &b, &grid);
    CHECK_EQ(grid.point_count, 10);
    for (int i = 0; i < 10; i++) CHECK(grid.point_arrays[0].values[i] == expected[i % 5]);
    CHECK(grid.xyz[27] == 6 && grid.xyz[28] == 0 && grid.xyz[29] == 3);
    tli_grid_release(&grid);
    b.bytes[b.count - 3] = 0x04; /* a run that is too long */
    refused(tli_read_slc, "a.slc", &b, TL_ERR_FORMAT, "slice 1");
    b.count = 0;
    put_text(&b, "11111\n60000 60000 1 8\n1 1 1 1 1 0 1 0 0 X9 X123456789");
    refused(tli_read_slc, "a.slc", &b, TL_ERR_FORMAT, "can't become");
    b.count = 0;
    put_text(&b, "11111\n2 2 2 16\n");
    refused(tli_read_slc, "a.slc", &b, TL_ERR_FORMAT, "line 2: expected bits");
    tl_ctx_destroy(ctx);
}

static void make_inrimage(buffer *b, bool big)
{
    b->count = 0;
    put_text(b, "#INRIMAGE-4#{\nXDIM=2\nYDIM=2\nZDIM=3\nVDIM=2\nTYPE=signed fixed\n"
                "PIXSIZE=16 bits\nSCALE=2**-1\nVX=2\nVY=3\nVZ=4\nTX=1\nTY=1\nTZ=1\n");
    put_text(b, big ? "CPU=sun\n" : "CPU=decm\n");
    while (b->count < 252) put_text(b, "\n");
    put_text(b, "##}\n");
    put_values(b, TL_I16, big, 24);
}

static void inrimage_reads(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    buffer b;
    tli_grid grid;
    for (int big = 0; big < 2; big++) {
        make_inrimage(&b, big);
        read_ok(ctx, tli_read_inrimage, "a.inr", &b, &grid);
        CHECK_EQ(grid.point_arrays[0].components, 2);
        for (int i = 0; i < 24; i++) CHECK(grid.point_arrays[0].values[i] == 0.5 * i);
        CHECK(grid.xyz[33] == 3 && grid.xyz[34] == 4 && grid.xyz[35] == 9);
        tli_grid_release(&grid);
    }
    b.count -= 2;
    refused(tli_read_inrimage, "a.inr", &b, TL_ERR_FORMAT, "46 bytes of values, expected 48");
    b.count = 0;
    put_text(&b, "#INRIMAGE-4#{\nXDIM=0\n##}\n");
    refused(tli_read_inrimage, "a.inr", &b, TL_ERR_FORMAT, "line 2: XDIM");
    b.count = 0;
    put_text(&b, "#INRIMAGE-4#{\nTYPE=float\nPIXSIZE=32 bits\n##}\n");
    refused(tli_read_inrimage, "a.inr", &b, TL_ERR_FORMAT, "multiple of 256");
    tl_ctx_destroy(ctx);
}

static void cube_reads(void **state)
{
    (void)state;
    tl_ctx *ctx = grid_ctx(0, 2);
    buffer b = {.count = 0};
    tli_grid grid;
    put_text(&b, "a title\nanother\n -1 1.0 2.0 3.0\n 2 0.5 0 0\n 3 0 1 0\n 2 0 0 2\n"
                 " 6 6.0 0 0 0\n 2 7 8\n");
    for (int i = 0; i < 24; i++) {
        char text[20];
        snprintf(text, sizeof text, "%d.0E0 ", i);
        put_text(&b, text);
    }
    read_ok(ctx, tli_read_cube, "a.cube", &b, &grid);
    CHECK_EQ(grid.point_arrays[0].components, 2);
    for (size_t i = 0; i < 2; i++)
        for (size_t j = 0; j < 3; j++)
            for (size_t k = 0; k < 2; k++) {
                const double *value = grid.point_arrays[0].values + 2 * (i + 2 * (j + 3 * k));
                CHECK(value[0] == (double)(2 * (k + 2 * (j + 3 * i))) && value[1] == value[0] + 1);
            }
    CHECK(grid.xyz[33] == 1.5 && grid.xyz[34] == 4 && grid.xyz[35] == 5);
    tli_grid_release(&grid);
    b.count -= 7;
    refused(tli_read_cube, "a.cube", &b, TL_ERR_FORMAT, "expected a value");
    b.count = 0;
    put_text(&b, "a\nb\n 0 0 0 0\n 1000 1 0 0\n 1000 0 1 0\n 1000 0 0 1\n 1 2 3\n");
    refused(tli_read_cube, "a.cube", &b, TL_ERR_FORMAT, "1000000000 values need 2 bytes");
    tl_ctx_destroy(ctx);
}

/* ---- damage ---- */

static void survive_damage(void **state)
{
    (void)state;
    static const char nrrd_head[] = "NRRD0004\ntype: short\ndimension: 4\nsizes: 2 2 2 2\n"
                                    "kinds: vector domain domain domain\nendian: big\n"
                                    "encoding: gzip\n\n",
                      mha_head[] = "NDims = 3\nCompressedData = True\nDimSize = 2 2 2\n"
                                   "ElementType = MET_SHORT\nElementDataFile = LOCAL\n";
    struct {
        source_case c;
        buffer b;
        size_t step;
    } files[] = {{{"a.nrrd", tli_read_nrrd, NULL}, {.count = 0}, 1},
                 {{"a.mha", tli_read_metaimage, NULL}, {.count = 0}, 1},
                 {{"a.nii", tli_read_nifti, NULL}, {.count = 0}, 1},
                 {{"a.slc", tli_read_slc, NULL}, {.count = 0}, 1},
                 {{"a.inr", tli_read_inrimage, NULL}, {.count = 0}, 1},
                 {{"a.cube", tli_read_cube, NULL}, {.count = 0}, 1}};
    put_text(&files[0].b, nrrd_head);
    put_values(&files[0].b, TL_I16, true, 16);
    pack_from(&files[0].b, sizeof nrrd_head - 1, 31);
    put_text(&files[1].b, mha_head);
    put_values(&files[1].b, TL_I16, false, 8);
    pack_from(&files[1].b, sizeof mha_head - 1, 15);
    make_nifti(&files[2].b, TL_I16, true, 2, "n+1");
    make_slc(&files[3].b);
    make_inrimage(&files[4].b, true);
    put_text(&files[5].b, "a\nb\n 1 0 0 0\n 2 1 0 0\n 2 0 1 0\n 2 0 0 1\n 6 6 0 0 0\n"
                          " 1 2 3 4 5 6 7 8\n");
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        tl_ctx *ctx = grid_ctx((size_t)1 << 22, 1);
        size_t refusals = grid_survives_damage(ctx, source_read, &files[i].c, files[i].b.bytes,
                                               files[i].b.count, files[i].step);
        printf("%s: %zu of %zu damaged files refused\n", files[i].c.path, refusals,
               3 * files[i].b.count);
        CHECK(refusals >= files[i].b.count / 2);
        tl_ctx_destroy(ctx);
        source_survives_budgets(&files[i].c, files[i].b.bytes, files[i].b.count, 997);
    }
}

/* ---- real files ---- */

typedef struct real_volume {
    const char *name;
    source_reader read;
    uint64_t dims[3];
    uint32_t components;
    tl_scalar scalar;
    double low, high, sum,
        weighted;             /* weighted: sum of value i times i mod 1000; 0: not compared */
    double first[3], last[3]; /* corners; all 0: not compared */
} real_volume;

/* Ranges and sums are those of VTK 9.1's readers (of mickey.nrrd and of the order of the nine
 * components: of NumPy). */
static const real_volume real_volumes[] = {
    {"volume/neghip.slc",
     tli_read_slc,
     {66, 66, 66},
     1,
     TL_U8,
     0,
     255,
     4824177,
     2408872838.0,
     {0, 0, 0},
     {65, 65, 65}},
    {"volume/nut.slc",
     tli_read_slc,
     {68, 41, 59},
     1,
     TL_U8,
     0,
     255,
     5807640,
     2901526896.0,
     {0, 0, 0},
     {67, 40, 58}},
    {"multimaterial/mickey.nrrd",
     tli_read_nrrd,
     {63, 63, 63},
     1,
     TL_U16,
     1,
     5,
     270613,
     135583103,
     {0, 0, 0},
     {62, 62, 62}},
    {"tensor/roi_evals.nii.gz",
     tli_read_nifti,
     {30, 30, 30},
     3,
     TL_F64,
     5.000068246931515e-10,
     0.010455043661843678,
     58.64209623621535,
     29307.25075562156,
     {-80, -120, -60},
     {-22, -62, -2}},
    {"tensor/roi_evecs.nii.gz",
     tli_read_nifti,
     {30, 30, 30},
     9,
     TL_F64,
     -0.9999921984583241,
     0.9999977195149212,
     23196.295746656015,
     11701440.495103173,
     {-80, -120, -60},
     {-22, -62, -2}},
    {"tensor/small_64D.nii",
     tli_read_nifti,
     {10, 10, 10},
     65,
     TL_I16,
     0,
     1675,
     5967027,
     2983837187.0,
     {0, 0, 0},
     {0, 0, 0}},
    {"tensor/tensors.inr.gz",
     tli_read_inrimage,
     {128, 128, 13},
     6,
     TL_F64,
     0,
     0,
     0,
     0,
     {-117.458, 87.948502, -23.3864},
     {120.667, 326.073502, 108.6136}},
    {"volume/m4_TotalDensity.cube",
     tli_read_cube,
     {25, 22, 31},
     1,
     TL_F64,
     2.03756e-17,
     0.492792,
     219.13916488073858,
     0,
     {-11.492699, -4.616844, -0.903385},
     {0, 0, 0}},
};

static void check_values(const real_volume *v, const tli_grid *grid)
{
    const tli_grid_array *array = &grid->point_arrays[0];
    double low = (double)INFINITY, high = -(double)INFINITY, sum = 0, weighted = 0;
    for (size_t i = 0; i < array->count * array->components; i++) {
        low = fmin(low, array->values[i]);
        high = fmax(high, array->values[i]);
        sum += array->values[i];
        weighted += array->values[i] * (double)(i % 1000);
    }
    printf("%s: %.10g to %.10g, sum %.12g\n", v->name, low, high, sum);
    if (v->sum == 0) return;
    CHECK_NEAR(low, v->low, 1e-12 * fabs(v->low));
    CHECK_NEAR(high, v->high, 1e-12 * fabs(v->high));
    CHECK_NEAR(sum, v->sum, 1e-10 * fabs(v->sum));
    if (v->weighted != 0) CHECK_NEAR(weighted, v->weighted, 1e-10 * v->weighted);
}

static void read_real(tl_ctx *ctx, const char *name, source_reader read, tli_grid *grid)
{
    char path[4096];
    tli_map map, unpacked = {0};
    if (!data_path(name, path, sizeof path)) fail_msg("no '%s'", path);
    CHECK_OK(ctx, tli_map_open(ctx, path, &map));
    if (tli_is_gzip(map.bytes, map.byte_count))
        CHECK_OK(ctx,
                 tli_inflate(ctx, path, map.bytes, map.byte_count, UINT64_MAX, false, &unpacked));
    tl_read_opts opts = tl_read_opts_defaults();
    tli_source source;
    source_fill(path, unpacked.owned ? &unpacked : &map, &source);
    tli_grid_init(ctx, grid);
    CHECK_OK(ctx, read(ctx, &source, &opts, grid));
    tli_map_close(ctx, &unpacked);
    tli_map_close(ctx, &map);
}

static void real_volumes_are_what_vtk_reads(void **state)
{
    (void)state;
    char path[4096];
    if (!data_path(real_volumes[0].name, path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx(0, 2);
    for (size_t i = 0; i < sizeof real_volumes / sizeof *real_volumes; i++) {
        const real_volume *v = &real_volumes[i];
        tli_grid grid;
        read_real(ctx, v->name, v->read, &grid);
        for (int axis = 0; axis < 3; axis++) {
            const double *first = grid.xyz, *last = grid.xyz + 3 * (grid.point_count - 1);
            CHECK_EQ(grid.blocks[0].dims[axis], v->dims[axis]);
            if (v->first[0] != 0 || v->last[0] != 0) CHECK_NEAR(first[axis], v->first[axis], 1e-4);
            if (v->last[0] != 0) CHECK_NEAR(last[axis], v->last[axis], 1e-3);
        }
        CHECK_EQ(grid.point_arrays[0].components, v->components);
        CHECK_EQ(grid.point_arrays[0].scalar, v->scalar);
        check_values(v, &grid);
        tli_grid_release(&grid);
    }
    tl_ctx_destroy(ctx);
}

/* The SLC file is the raw one with a border. */
static void neghip_is_itself(void **state)
{
    (void)state;
    char path[4096];
    if (!data_path("volume/neghip_64x64x64_uint8.raw", path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx(0, 2);
    tli_grid grid;
    tli_map raw;
    read_real(ctx, "volume/neghip.slc", tli_read_slc, &grid);
    CHECK_OK(ctx, tli_map_open(ctx, path, &raw));
    size_t different = 0;
    for (size_t k = 0; k < 64; k++)
        for (size_t j = 0; j < 64; j++)
            for (size_t i = 0; i < 64; i++) {
                size_t point = i + 1 + 66 * (j + 1 + 66 * (k + 1));
                different +=
                    grid.point_arrays[0].values[point] != (double)raw.bytes[i + 64 * (j + 64 * k)];
            }
    printf("%zu of 262144 values differ\n", different);
    CHECK_EQ(different, 0);
    tli_map_close(ctx, &raw);
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

/* Order xx xy yy xz yz zz: then all tensors that are not zero are positive definite. */
static void inrimage_tensors_are_positive(void **state)
{
    (void)state;
    char path[4096];
    if (!data_path("tensor/tensors.inr.gz", path, sizeof path))
        CHECK_SKIP("no '%s': set TETRALOD_DATA to the folder of data sets", path);
    tl_ctx *ctx = grid_ctx(0, 2);
    tli_grid grid;
    size_t filled = 0;
    read_real(ctx, "tensor/tensors.inr.gz", tli_read_inrimage, &grid);
    for (size_t i = 0; i < grid.point_count; i++) {
        const double *t = grid.point_arrays[0].values + 6 * i;
        if (t[0] == 0 && t[2] == 0 && t[5] == 0) continue;
        double minor = t[0] * t[2] - t[1] * t[1];
        double det =
            t[5] * minor - t[4] * (t[0] * t[4] - t[1] * t[3]) + t[3] * (t[1] * t[4] - t[2] * t[3]);
        CHECK(t[0] > 0 && minor > 0 && det > 0);
        filled++;
    }
    printf("%zu of %llu voxels hold tensors\n", filled, (unsigned long long)grid.point_count);
    CHECK_NEAR((double)filled / (double)grid.point_count, 0.33, 0.01);
    tli_grid_release(&grid);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nrrd_types_and_codings),
        cmocka_unit_test(nrrd_detached_with_components),
        cmocka_unit_test(nrrd_refusals),
        cmocka_unit_test(metaimage_codings),
        cmocka_unit_test(metaimage_refusals),
        cmocka_unit_test(nifti_types_and_places),
        cmocka_unit_test(nifti_pairs_and_refusals),
        cmocka_unit_test(slc_runs),
        cmocka_unit_test(inrimage_reads),
        cmocka_unit_test(cube_reads),
        cmocka_unit_test(survive_damage),
        cmocka_unit_test(real_volumes_are_what_vtk_reads),
        cmocka_unit_test(neghip_is_itself),
        cmocka_unit_test(inrimage_tensors_are_positive),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
