/* Damaged VTK XML files: every prefix and a change of every byte of a file of each coding end in a
 * status; counts that the file can't hold are refused before anything is allocated, by name. */
#include "check.h"
#include "make_vtkxml.h"

#include "formats/formats_grid.h"
#include "formats/formats_xml.h"

static tl_ctx *ctx;

static int setup(void **state)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 1;
    opts.budget_bytes = (size_t)64 << 20;
    (void)state;
    return tl_ctx_create(&opts, &ctx) != TL_OK;
}

static int teardown(void **state)
{
    (void)state;
    tl_ctx_destroy(ctx);
    return 0;
}

/* Reads from a block of the exact size, so that a read past the end is seen. */
static tl_status read_exact(const char *bytes, size_t count)
{
    tli_grid grid;
    char *block = malloc(count ? count : 1);
    CHECK(block != NULL);
    if (count) memcpy(block, bytes, count);
    tli_map map = {.bytes = (const uint8_t *)block, .byte_count = count};
    tli_grid_init(ctx, &grid);
    tl_ctx_clear(ctx);
    tl_status st = tli_read_vtk_xml(ctx, &map, "x.vtu", &grid);
    for (uint64_t i = 0; !st && grid.offsets && i < grid.offsets[grid.cell_count]; i++)
        CHECK(grid.connectivity[i] < grid.point_count);
    tli_grid_release(&grid);
    free(block);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    return st;
}

static void damage(const xml_text *t, const char *what)
{
    static const char letters[] = "<9";
    size_t taken = 0, refused = 0;
    CHECK_OK(ctx, read_exact(t->text, t->bytes));
    for (size_t length = 0; length < t->bytes; length++) {
        tl_status st = read_exact(t->text, length);
        CHECK(st == TL_OK || st == TL_ERR_FORMAT || st == TL_ERR_UNSUPPORTED);
        CHECK(st == TL_OK || strstr(tl_ctx_message(ctx), "x.vtu"));
        st ? refused++ : taken++;
    }
    CHECK(refused > t->bytes / 2);
    for (size_t i = 0; i < t->bytes; i++) {
        char old = t->text[i];
        for (size_t change = 0; change < 5; change++) {
            t->text[i] = change < 3 ? (char)(old ^ (1 << (change * 3 + 1))) : letters[change - 3];
            tl_status st = read_exact(t->text, t->bytes);
            CHECK(st == TL_OK || st == TL_ERR_FORMAT || st == TL_ERR_UNSUPPORTED);
            st ? refused++ : taken++;
        }
        t->text[i] = old;
    }
    printf("# %s: %zu bytes, %zu damaged files refused, %zu taken\n", what, t->bytes, refused,
           taken);
}

static void survives_damage(void **state)
{
    static const char *const codings[] = {"ascii", "inline", "appended base64", "appended raw"};
    static const char *const packings[] = {"plain", "zlib", "LZ4", "LZMA"};
    (void)state;
    for (int coding = 0; coding < 4; coding++)
        for (int packing = 0; packing < (coding ? 4 : 1); packing++) {
            char what[64];
            xml_mode mode = {.coding = (xml_coding)coding,
                             .packing = (xml_packing)packing,
                             .wide = packing % 2,
                             .big_endian = coding == 2,
                             .scalar = TL_F32,
                             .block_bytes = packing == 3 ? 1 << 15 : 52};
            xml_text t = xml_make_unstructured(&mode, 1);
            snprintf(what, sizeof what, "%s %s", codings[coding], packings[packing]);
            damage(&t, what);
            free(t.text);
        }
}

static void survives_damage_structured(void **state)
{
    static const char *const types[] = {"ImageData", "RectilinearGrid", "StructuredGrid"};
    (void)state;
    for (size_t type = 0; type < 3; type++) {
        xml_mode mode = {
            .coding = XML_APPENDED_RAW, .packing = XML_LZ4, .scalar = TL_I16, .block_bytes = 32};
        xml_text t = xml_make_structured(&mode, types[type]);
        damage(&t, types[type]);
        free(t.text);
    }
}

/* ---- single faults ---- */

#define GRID(inside)                                                                               \
    "<VTKFile type='UnstructuredGrid'><UnstructuredGrid>" inside "</UnstructuredGrid></VTKFile>"
#define PIECE(points, cells, inside)                                                               \
    GRID("<Piece NumberOfPoints='" points "' NumberOfCells='" cells "'>" inside "</Piece>")
#define POINTS                                                                                     \
    "<Points><DataArray type='Float32' NumberOfComponents='3'>0 0 0 1 0 0 0 1 0 0 0 "              \
    "1</DataArray></Points>"
#define CELLS(connectivity, offsets, types)                                                        \
    "<Cells><DataArray type='Int32' Name='connectivity'>" connectivity                             \
    "</DataArray><DataArray type='Int32' Name='offsets'>" offsets                                  \
    "</DataArray><DataArray type='Int32' Name='types'>" types "</DataArray></Cells>"
#define TET CELLS("0 1 2 3", "4", "10")
#define IMAGE(attributes, extent, inside)                                                          \
    "<VTKFile type='ImageData' " attributes "><ImageData><Piece Extent='" extent "'>" inside       \
    "</Piece></ImageData></VTKFile>"
#define DATA(attributes, text)                                                                     \
    "<PointData><DataArray " attributes ">" text "</DataArray></PointData>"

static const struct {
    const char *text;
    tl_status status;
    const char *message; /* a part of it */
} faults[] = {
    {"", TL_ERR_FORMAT, "expected <VTKFile>"},
    {"\xff\xfe<", TL_ERR_UNSUPPORTED, "UTF-16"},
    {"<!DOCTYPE x [<!ENTITY a 'b'>]><VTKFile/>", TL_ERR_UNSUPPORTED, "document type"},
    {"<VTKFile type='PUnstructuredGrid'/>", TL_ERR_UNSUPPORTED, "'PUnstructuredGrid' is not yet"},
    {"<VTKFile type='vtkMultiBlockDataSet'/>", TL_ERR_UNSUPPORTED, "vtkMultiBlockDataSet"},
    {"<VTKFile/>", TL_ERR_FORMAT, "without 'type'"},
    {"<VTKFile type='ImageData'></VTKFile>", TL_ERR_FORMAT, "without the data set"},
    {"<VTKFile type='ImageData' compressor='vtkZfp'/>", TL_ERR_UNSUPPORTED, "'vtkZfp'"},
    {"<VTKFile type='ImageData' byte_order='Middle'/>", TL_ERR_FORMAT, "byte_order"},
    {"<VTKFile type='ImageData' header_type='UInt16'/>", TL_ERR_FORMAT, "header_type"},
    {"<VTKFile type='ImageData'><ImageData></VTKFile>", TL_ERR_FORMAT, "expected </ImageData>"},
    {GRID("<Piece NumberOfPoints='-1' NumberOfCells='0'/>"), TL_ERR_FORMAT, "NumberOfPoints"},
    {GRID("<Piece NumberOfPoints='1x' NumberOfCells='0'/>"), TL_ERR_FORMAT, "NumberOfPoints"},
    {PIECE("4000000000", "0", POINTS), TL_ERR_FORMAT, "12 values, expected 12000000000"},
    {PIECE("9000000000000000000", "0", POINTS), TL_ERR_UNSUPPORTED, "points"},
    {PIECE("4", "0", ""), TL_ERR_FORMAT, "no <Points>"},
    {PIECE("5", "0", POINTS), TL_ERR_FORMAT, "12 values, expected 15"},
    {PIECE("4", "1", POINTS), TL_ERR_FORMAT, "but no offsets"},
    {PIECE("4", "3000000000", POINTS TET), TL_ERR_FORMAT, "1 values, expected 3000000000"},
    {PIECE("4", "9000000000000000000", POINTS TET), TL_ERR_FORMAT, "can't be"},
    {PIECE("4", "1", POINTS CELLS("0 1 2 4", "4", "10")), TL_ERR_FORMAT, "value 3 is 4"},
    {PIECE("4", "1", POINTS CELLS("0 -1 2 3", "4", "10")), TL_ERR_FORMAT, "value 1 is -1"},
    {PIECE("4", "1", POINTS CELLS("0 1.5 2 3", "4", "10")), TL_ERR_FORMAT, "value 1 is -1"},
    {PIECE("4", "1", POINTS CELLS("0 1 2 3", "5", "10")), TL_ERR_FORMAT, "value 0 is 5"},
    {PIECE("4", "2", POINTS CELLS("0 1 2 3", "4 2", "10 1")), TL_ERR_FORMAT, "value 1 is 2"},
    {PIECE("4", "1", POINTS CELLS("0 1 2 3", "4", "300")), TL_ERR_FORMAT, "value 0 is 300"},
    {PIECE("4", "1", POINTS CELLS("0 1 2 3", "4", "")), TL_ERR_FORMAT, "0 values, expected 1"},
    {PIECE("4", "0", POINTS DATA("type='Float64' Name='p'", "1 2 3")), TL_ERR_FORMAT,
     "array 'p' at byte 207 has 3 values, expected 4"},
    {PIECE("4", "0", POINTS DATA("type='Float64' Name='p'", "1 2 x3 4")), TL_ERR_FORMAT, "'x3'"},
    {PIECE("4", "0", POINTS DATA("type='Float64' Name='p'", "1 2 3,4 5")), TL_ERR_FORMAT, "'3,4'"},
    {PIECE("4", "0", POINTS DATA("type='Float64' NumberOfComponents='5000'", "1")), TL_ERR_FORMAT,
     "NumberOfComponents"},
    {PIECE("4", "0", POINTS DATA("type='Float64' format='hex'", "1")), TL_ERR_FORMAT, "'format'"},
    {PIECE("4", "0", POINTS DATA("type='Int8' format='appended' offset='0'", "")), TL_ERR_FORMAT,
     "no <AppendedData>"},
    {PIECE("4", "0", POINTS DATA("type='Int8'", "1 2<!-- -->3 4")), TL_ERR_FORMAT, "two parts"},
    {PIECE("1", "0",
           "<Points><DataArray type='Int8' NumberOfComponents='2'>1 2</DataArray></Points>"),
     TL_ERR_FORMAT, "2 components, expected 3"},
    {IMAGE("", "0 1 0 1 0", ""), TL_ERR_FORMAT, "'Extent' is not six"},
    {IMAGE("", "0 1 0 1 0 4000000000", ""), TL_ERR_FORMAT, "'Extent' is not six"},
    {IMAGE("", "-2147483648 2147483647 -2147483648 2147483647 0 99", ""), TL_ERR_FORMAT, "2^58"},
    {IMAGE("", "0 99999 0 99999 0 0", ""), TL_ERR_UNSUPPORTED, "more than"},
    {IMAGE("", "0 9999 0 9999 0 9", ""), TL_ERR_FORMAT, "can't be"},
    /* three bytes that promise a lot: 00 00 00 10 is 268435456 */
    {IMAGE("", "0 3 0 0 0 0", DATA("type='Int8' format='binary'", "AAAAEAAA")), TL_ERR_FORMAT,
     "says 268435456 bytes"},
    {IMAGE("", "0 3 0 0 0 0", DATA("type='Int8' format='binary'", "BAAAAA!=")), TL_ERR_FORMAT,
     "behind it"},
    {IMAGE("", "0 3 0 0 0 0", DATA("type='Int8' format='binary'", "BAAAAA!AAAA=")), TL_ERR_FORMAT,
     "not base64"},
    {IMAGE("", "0 3 0 0 0 0", DATA("type='Int16' format='binary'", "AwAAAAECAw==")), TL_ERR_FORMAT,
     "no whole number"},
    {IMAGE("compressor='vtkZLibDataCompressor'", "0 3 0 0 0 0",
           DATA("type='Int8' format='binary'", "AAAAEAAAABAAAAAA")),
     TL_ERR_FORMAT, "more blocks"},
    /* one block of 2^30 bytes out of 4 */
    {IMAGE("compressor='vtkZLibDataCompressor'", "0 3 0 0 0 0",
           DATA("type='Int8' format='binary'", "AQAAAAAAAEAAAAAABAAAAA==AAAAAA==")),
     TL_ERR_FORMAT, "says that 4 bytes unpack to 1073741824"},
    {IMAGE("compressor='vtkZLibDataCompressor'", "0 3 0 0 0 0",
           DATA("type='Int8' format='binary'", "AQAAAAQAAAAAAAAABAAAAA==AAAAAA==")),
     TL_ERR_FORMAT, "block 0: its zlib stream is damaged"},
    {IMAGE("compressor='vtkLZ4DataCompressor'", "0 3 0 0 0 0",
           DATA("type='Int8' format='binary'", "AQAAAAQAAAAAAAAABAAAAA==/////w==")),
     TL_ERR_FORMAT, "LZ4 block is damaged"},
    {"<VTKFile type='ImageData'><ImageData><Piece Extent='0 0 0 0 0 0'/>"
     "<Piece Extent='9 9 9 9 9 9'/></ImageData></VTKFile>",
     TL_ERR_UNSUPPORTED, "span a box of 1000"},
    {"<VTKFile type='ImageData'><ImageData><Piece Extent='0 2 0 2 0 2'/>"
     "<Piece Extent='0 2 0 2 2 2'/></ImageData></VTKFile>",
     TL_ERR_UNSUPPORTED, "flat along axis 2"},
    {"<VTKFile type='RectilinearGrid'><RectilinearGrid><Piece Extent='0 1 0 1 0 1'><Coordinates>"
     "<DataArray type='Int8'>1 2</DataArray></Coordinates></Piece></RectilinearGrid></VTKFile>",
     TL_ERR_FORMAT, "1 arrays of <Coordinates>"},
};

static void names_faults(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        tl_ctx_reset_peak(ctx);
        tl_status st = read_exact(faults[i].text, strlen(faults[i].text));
        if (st != faults[i].status || !strstr(tl_ctx_message(ctx), faults[i].message))
            fail_msg("fault %zu: %s: '%s', expected %s with '%s'", i, tl_status_name(st),
                     tl_ctx_message(ctx), tl_status_name(faults[i].status), faults[i].message);
        CHECK_BOUND("peak bytes", (double)tl_ctx_peak_bytes(ctx), 65536);
    }
}

/* Many arrays that all point to the same bytes. */
static void refuses_shared_bytes(void **state)
{
    (void)state;
    xml_text t = {0};
    char *zeros = calloc(1, 40000);
    CHECK(zeros != NULL);
    xml_printf(&t,
               "<VTKFile type='ImageData'><ImageData><Piece Extent='1 40000 0 0 0 0'><PointData>");
    for (int i = 0; i < 200; i++)
        xml_printf(&t, "<DataArray type='Int8' Name='a%d' format='appended' offset='0'/>", i);
    xml_printf(&t, "</PointData></Piece></ImageData><AppendedData encoding='raw'>_");
    xml_put_ordered(&t, 40000, 4, false);
    xml_put(&t, zeros, 40000);
    CHECK_STATUS(read_exact(t.text, t.bytes), TL_ERR_FORMAT);
    CHECK(strstr(tl_ctx_message(ctx), "many times over") != NULL);
    free(zeros);
    free(t.text);
}

/* Time that grows with the square of the length would show: a megabyte of one character. */
static void stays_linear(void **state)
{
    static const char *const heads[] = {
        "", "<", "<!--", "<a b='", "<a ", "<![CDATA[", "<VTKFile type='ImageData'>", "&"};
    static const char fillers[] = "<>-\"' /&=]a";
    (void)state;
    for (size_t head = 0; head < sizeof heads / sizeof *heads; head++)
        for (size_t f = 0; f + 1 < sizeof fillers; f++) {
            size_t length = strlen(heads[head]), bytes = (size_t)1 << 20;
            char *text = malloc(length + bytes);
            CHECK(text != NULL);
            memcpy(text, heads[head], length);
            memset(text + length, fillers[f], bytes);
            double start = tli_clock_s();
            CHECK(read_exact(text, length + bytes) != TL_OK);
            CHECK(tli_clock_s() - start < 5);
            free(text);
        }
}

static void reads_spans(void **state)
{
    (void)state;
    static const struct {
        const char *in, *out;
        size_t room;
    } texts[] = {{"  a b ", "a b", 16},
                 {"&lt;&amp;&#65;&#x42;", "<&AB", 16},
                 {"&nbsp;&#xd800;&#;&#x110000;", "&nbsp;&#xd800;&#;&#x110000;", 64},
                 {"&#x10ffff;|&#x20ac;", "\xf4\x8f\xbf\xbf|\xe2\x82\xac", 16},
                 {"\xe2\x82", "\xc3\xa2\xc2\x82", 16},
                 {"\xed\xa0\x80", "\xc3\xad\xc2\xa0\xc2\x80", 16},
                 {"a\tb\x01&#10;c", "a b  c", 16},
                 {"abc\xc3\xa4", "abc", 5}};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        char out[64];
        tli_span_text((tli_span){texts[i].in, strlen(texts[i].in)}, out, texts[i].room);
        assert_string_equal(out, texts[i].out);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(names_faults, setup, teardown),
        cmocka_unit_test_setup_teardown(refuses_shared_bytes, setup, teardown),
        cmocka_unit_test_setup_teardown(stays_linear, setup, teardown),
        cmocka_unit_test_setup_teardown(reads_spans, setup, teardown),
        cmocka_unit_test_setup_teardown(survives_damage, setup, teardown),
        cmocka_unit_test_setup_teardown(survives_damage_structured, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
