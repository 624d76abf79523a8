/* VTK XML files in every coding, packing, header width, byte order and number type give the same
 * grid, exactly; the quirks of real writers are taken. */
#include "check.h"
#include "make_vtkxml.h"

#include "fail_alloc.h"
#include "formats/formats_grid.h"

static tl_ctx *ctx;

/* One thread: thousands of small files would spend their time waking others. */
static int setup(void **state)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 1;
    (void)state;
    return tl_ctx_create(&opts, &ctx) != TL_OK;
}

static int teardown(void **state)
{
    (void)state;
    bool clean = tl_ctx_current_bytes(ctx) == 0;
    tl_ctx_destroy(ctx);
    return !clean;
}

static tl_status read_bytes(tl_ctx *c, const void *bytes, size_t count, tli_grid *grid)
{
    tli_map map = {.bytes = bytes, .byte_count = count};
    tli_grid_init(c, grid);
    tl_status st = tli_read_vtk_xml(c, &map, "test", grid);
    if (st) tli_grid_release(grid);
    return st;
}

static tl_status read_string(const char *text, tli_grid *grid)
{
    return read_bytes(ctx, text, strlen(text), grid);
}

static void check_values(const tli_grid_array *array, const char *name, uint32_t components,
                         tl_scalar scalar, size_t count, size_t period)
{
    assert_string_equal(array->name, name);
    CHECK_EQ(array->components, components);
    CHECK_EQ(array->scalar, scalar);
    CHECK_EQ(array->count, count);
    for (size_t i = 0; i < count * components; i++)
        CHECK_NEAR(array->values[i], xml_value(scalar, i % period), 0);
}

static void check_unstructured(const tli_grid *grid, tl_scalar scalar, size_t piece_count)
{
    CHECK_EQ(grid->point_count, XML_POINTS * piece_count);
    CHECK_EQ(grid->cell_count, XML_CELLS * piece_count);
    CHECK_EQ(grid->block_count, 0);
    CHECK_NEAR(grid->time, 0.625, 0);
    for (size_t i = 0; i < 3 * XML_POINTS * piece_count; i++)
        CHECK_NEAR(grid->xyz[i], xml_points[i % (3 * (size_t)XML_POINTS)], 0);
    CHECK_EQ(grid->offsets[0], 0);
    for (size_t i = 0; i < XML_CELLS * piece_count; i++) {
        CHECK_EQ(grid->types[i], xml_types[i % XML_CELLS]);
        CHECK_EQ(grid->offsets[i + 1],
                 xml_offsets[i % XML_CELLS] + (double)(i / XML_CELLS * XML_CONNECTIVITY));
    }
    for (size_t i = 0; i < XML_CONNECTIVITY * piece_count; i++)
        CHECK_EQ(grid->connectivity[i], xml_connectivity[i % XML_CONNECTIVITY] +
                                            (double)(i / XML_CONNECTIVITY * XML_POINTS));
    CHECK_EQ(grid->point_array_count, 2);
    CHECK_EQ(grid->cell_array_count, 1);
    check_values(&grid->point_arrays[0], "p", 1, scalar, XML_POINTS * piece_count, XML_POINTS);
    check_values(&grid->point_arrays[1], "v", 3, scalar, XML_POINTS * piece_count, 3 * XML_POINTS);
    check_values(&grid->cell_arrays[0], "c", 2, scalar, XML_CELLS * piece_count, 2 * XML_CELLS);
}

static void check_mode(const xml_mode *mode, int piece_count)
{
    tli_grid grid;
    xml_text t = xml_make_unstructured(mode, piece_count);
    CHECK_OK(ctx, read_bytes(ctx, t.text, t.bytes, &grid));
    check_unstructured(&grid, mode->scalar, (size_t)piece_count);
    tli_grid_release(&grid);
    free(t.text);
}

static void reads_all_modes(void **state)
{
    static const size_t blocks[] = {16, 20, 1 << 15}; /* several, cutting numbers in two, one */
    size_t mode_count = 0;
    (void)state;
    for (int bits = 0; bits < 4 * 4 * 2 * 2 * 10 * 3 * 2; bits++) {
        xml_mode mode = {.coding = (xml_coding)(bits % 4),
                         .packing = (xml_packing)(bits / 4 % 4),
                         .wide = bits / 16 % 2,
                         .big_endian = bits / 32 % 2,
                         .scalar = (tl_scalar)(bits / 64 % 10),
                         .block_bytes = blocks[bits / 640 % 3],
                         .wrapped = bits / 1920};
        bool is_base64 = mode.coding == XML_INLINE || mode.coding == XML_APPENDED_BASE64;
        if (mode.coding == XML_ASCII && mode.packing != XML_PLAIN) continue;
        if (mode.packing == XML_PLAIN && mode.block_bytes != blocks[0]) continue;
        if (mode.wrapped && !is_base64) continue;
        /* the encoder of LZMA takes megabytes for each small block */
        if (mode.packing == XML_LZMA && mode.block_bytes < 1 << 15 && mode.scalar % 5) continue;
        check_mode(&mode, 1);
        mode_count++;
    }
    printf("# %zu modes\n", mode_count);
    CHECK_EQ(mode_count, 4 * (10 + (3 + 2) * (10 + 30 + 30 + 14)));
}

static void joins_pieces(void **state)
{
    (void)state;
    for (int coding = 0; coding < 4; coding++)
        for (int packing = 0; packing < (coding ? 4 : 1); packing++) {
            xml_mode mode = {.coding = (xml_coding)coding,
                             .packing = (xml_packing)packing,
                             .scalar = TL_F32,
                             .block_bytes = 64};
            check_mode(&mode, 3);
        }
}

static void reads_structured(void **state)
{
    static const char *const types[] = {"ImageData", "RectilinearGrid", "StructuredGrid"};
    (void)state;
    for (size_t type = 0; type < 3; type++)
        for (int coding = 0; coding < 4; coding++) {
            xml_mode mode = {.coding = (xml_coding)coding,
                             .packing = coding ? XML_ZLIB : XML_PLAIN,
                             .scalar = TL_F32,
                             .block_bytes = 64,
                             .big_endian = coding == 2};
            tli_grid grid;
            xml_text t = xml_make_structured(&mode, types[type]);
            CHECK_OK(ctx, read_bytes(ctx, t.text, t.bytes, &grid));
            CHECK_EQ(grid.point_count, XML_NI * XML_NJ * XML_NK);
            CHECK_EQ(grid.block_count, 1);
            CHECK_EQ(tli_grid_cell_count(&grid), 2);
            CHECK_EQ(grid.blocks[0].dims[0], XML_NI);
            CHECK_EQ(grid.blocks[0].dims[2], XML_NK);
            CHECK(grid.blanks == NULL);
            CHECK(isnan(grid.time));
            for (int i = 0; i < XML_NI * XML_NJ * XML_NK; i++) {
                CHECK_NEAR(grid.xyz[3 * i], 1 + i % XML_NI * 0.5, 0);
                CHECK_NEAR(grid.xyz[3 * i + 1], 2 - i / XML_NI % XML_NJ, 0);
                CHECK_NEAR(grid.xyz[3 * i + 2], i / XML_NI / XML_NJ * 3, 0);
            }
            check_values(&grid.point_arrays[0], "p", 1, TL_F32, 12, 12);
            check_values(&grid.cell_arrays[0], "c", 1, TL_F32, 2, 2);
            tli_grid_release(&grid);
            free(t.text);
        }
}

/* Two pieces that share a plane become one block; what is in none is blank. */
static void joins_structured_pieces(void **state)
{
    (void)state;
    tli_grid grid;
    const char *head =
        "<VTKFile type='ImageData'><ImageData WholeExtent='0 3 0 1 0 0'>"
        "<Piece Extent='0 1 0 1 0 0'><PointData><DataArray type='Int32' Name='p'>"
        "0 1 10 11</DataArray></PointData><CellData><DataArray type='UInt8' Name='c'>"
        "7</DataArray></CellData></Piece>";
    char text[2048];
    snprintf(text, sizeof text,
             "%s<Piece Extent='1 3 0 1 0 0'><PointData><DataArray type='Float32' Name='p'>"
             "1 2 3 11 12 13</DataArray></PointData><CellData><DataArray type='UInt8' Name='c'>"
             "8 9</DataArray></CellData></Piece></ImageData></VTKFile>",
             head);
    CHECK_OK(ctx, read_string(text, &grid));
    CHECK_EQ(grid.blocks[0].dims[0], 4);
    CHECK_EQ(tli_grid_cell_count(&grid), 3);
    CHECK(grid.blanks == NULL);
    CHECK_EQ(grid.point_arrays[0].scalar, TL_F64); /* what holds both */
    for (int i = 0; i < 8; i++) CHECK_NEAR(grid.point_arrays[0].values[i], i % 4 + i / 4 * 10, 0);
    for (int i = 0; i < 3; i++) CHECK_NEAR(grid.cell_arrays[0].values[i], 7 + i, 0);
    tli_grid_release(&grid);

    snprintf(text, sizeof text,
             "%s<Piece Extent='2 3 0 1 0 0'><PointData><DataArray type='Int32' Name='p'>"
             "2 3 12 13</DataArray></PointData></Piece>"
             "<Piece Extent='2 3 1 2 0 0'><PointData><DataArray type='Int32' Name='p'>"
             "12 13 22 23</DataArray></PointData></Piece></ImageData></VTKFile>",
             head);
    CHECK_OK(ctx, read_string(text, &grid));
    CHECK_EQ(grid.point_count, 12);
    CHECK_EQ(grid.cell_array_count, 0); /* two pieces lack it */
    for (int i = 0; i < 12; i++) {
        bool is_blank = i == 8 || i == 9;
        CHECK_EQ(grid.blanks[i], !is_blank);
        if (is_blank)
            CHECK(isnan(grid.point_arrays[0].values[i]));
        else
            CHECK_NEAR(grid.point_arrays[0].values[i], i % 4 + i / 4 * 10, 0);
    }
    tli_grid_release(&grid);
}

static void turns_images(void **state)
{
    (void)state;
    tli_grid grid;
    CHECK_OK(ctx, read_string("<VTKFile type='ImageData'><ImageData Origin='1 2 3' Spacing='2 3 4' "
                              "Direction='0 -1 0 1 0 0 0 0 1'><Piece Extent='0 1 0 1 5 5'/>"
                              "</ImageData></VTKFile>",
                              &grid));
    static const double expected[] = {1, 2, 23, 1, 4, 23, -2, 2, 23, -2, 4, 23};
    for (int i = 0; i < 12; i++) CHECK_NEAR(grid.xyz[i], expected[i], 0);
    tli_grid_release(&grid);
}

/* Single quotes, comments, character references, no XML declaration, missing attributes, names
 * without, nested keys before and after the text, odd numbers, unknown elements. */
static void takes_quirks(void **state)
{
    (void)state;
    static const char text[] =
        "\xef\xbb\xbf<!-- made by hand > --><VTKFile\n type = 'UnstructuredGrid' "
        "><Unknown><X/>7</Unknown>"
        "<UnstructuredGrid TimeValues='2.5 3.5'><Piece NumberOfCells=' 1 ' NumberOfPoints='+4'>"
        "<PointData><DataArray type='Float64' Name='a &lt;b&gt; &#x3b1; \xc3\xa4 \xe4'>"
        "<InformationKey name='k'><Value>9 9</Value></InformationKey> nan -inf 1.5D+2 1.#INF00 "
        "<InformationKey/></DataArray>"
        "<DataArray type='Float32'> 0.1 -NaN +Infinity 1e-46</DataArray>"
        "<DataArray type='Float64' Name='vec'>1 2 3 4 5 6 7 8 9 10 11 12</DataArray>"
        "<DataArray type='Float64' Name='late' TimeStep='1'>1 2 3 4</DataArray>"
        "<DataArray type='UInt64' Name='big'>18446744073709551615 1 2 3.0</DataArray>"
        "<Array type='String' Name='words' format='ascii'>72 105 0</Array></PointData>"
        "<CellData><DataArray type='UInt8' Name='vtkGhostType'>1</DataArray></CellData>"
        "<Points><DataArray type='Float32'>0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>"
        "<Cells><DataArray type='Float64' Name='connectivity'>0 1 2.0 3</DataArray>"
        "<DataArray type='Int32' Name='offsets'>4</DataArray>"
        "<DataArray type='Int64' Name='types'>10</DataArray></Cells>"
        "</Piece><Piece NumberOfPoints='0' NumberOfCells='0'/></UnstructuredGrid></VTKFile>";
    tli_grid grid;
    CHECK_OK(ctx, read_string(text, &grid));
    CHECK_EQ(grid.point_count, 4);
    CHECK_EQ(grid.cell_count, 1);
    CHECK(grid.types == NULL && grid.offsets == NULL); /* tets only */
    CHECK_EQ(grid.connectivity[3], 3);
    CHECK_NEAR(grid.time, 2.5, 0);
    CHECK_EQ(grid.point_array_count, 4);
    const tli_grid_array *a = grid.point_arrays;
    assert_string_equal(a[0].name, "a <b> \xce\xb1 \xc3\xa4 \xc3\xa4");
    CHECK(isnan(a[0].values[0]) && a[0].values[1] < 0 && isinf(a[0].values[1]));
    CHECK_NEAR(a[0].values[2], 150, 0);
    CHECK(isinf(a[0].values[3]) && a[0].values[3] > 0);
    assert_string_equal(a[1].name, "unnamed");
    CHECK_NEAR(a[1].values[0], (double)0.1f, 0);
    CHECK(isnan(a[1].values[1]) && isinf(a[1].values[2]));
    CHECK_NEAR(a[1].values[3], 0, 0);
    CHECK_EQ(a[2].components, 3);
    CHECK_NEAR(a[2].values[11], 12, 0);
    CHECK_NEAR(a[3].values[0], 0x1p64, 0);
    assert_string_equal(grid.cell_arrays[0].name, "vtkGhostType");
    tli_grid_release(&grid);
}

static bool stop_at_once(void *user, const char *stage, uint64_t done, uint64_t total)
{
    (void)user;
    assert_string_equal(stage, "read");
    return done > total;
}

static void can_be_cancelled(void **state)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    xml_mode mode = {.coding = XML_ASCII};
    xml_text t = xml_make_unstructured(&mode, 1);
    tl_ctx *c;
    tli_grid grid;
    (void)state;
    opts.progress = stop_at_once;
    CHECK_STATUS(tl_ctx_create(&opts, &c), TL_OK);
    CHECK_STATUS(read_bytes(c, t.text, t.bytes, &grid), TL_ERR_CANCELLED);
    CHECK_EQ(tl_ctx_current_bytes(c), 0);
    tl_ctx_destroy(c);
    free(t.text);
}

static void collect_log(void *user, tl_log_level level, const char *text)
{
    char *lines = user;
    CHECK(strlen(lines) + strlen(text) < 4000);
    sprintf(lines + strlen(lines), "%d %s\n", (int)level, text);
}

/* What is left out is said. */
static void says_what_it_leaves_out(void **state)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    char lines[4096] = "";
    tl_ctx *c;
    tli_grid grid;
    (void)state;
    opts.log = collect_log;
    opts.user = lines;
    CHECK_STATUS(tl_ctx_create(&opts, &c), TL_OK);
    const char *text = "<VTKFile type='UnstructuredGrid'><UnstructuredGrid><FieldData>"
                       "<DataArray type='Int8' Name='f'>1</DataArray></FieldData>"
                       "<Piece NumberOfPoints='2' NumberOfCells='1'><PointData>"
                       "<DataArray type='Int8' Name='long'>1 2 3</DataArray>"
                       "<DataArray type='Int8' Name='alone'>1 2</DataArray>"
                       "<Array type='String' Name='words'/></PointData>"
                       "<Points><DataArray type='Int8'>0 0 0 1 1 1</DataArray></Points>"
                       "<Cells><DataArray type='Int8' Name='connectivity'>0 1 1</DataArray>"
                       "<DataArray type='Int8' Name='offsets'>2</DataArray>"
                       "<DataArray type='Int8' Name='types'>3</DataArray>"
                       "<DataArray type='Int8' Name='faces'>3</DataArray></Cells></Piece>"
                       "<Piece NumberOfPoints='1' NumberOfCells='0'><PointData>"
                       "<DataArray type='Int8' Name='long'>9</DataArray></PointData>"
                       "<Points><DataArray type='Int8'>0 0 0</DataArray></Points></Piece>"
                       "</UnstructuredGrid></VTKFile>";
    CHECK_OK(c, read_bytes(c, text, strlen(text), &grid));
    CHECK_EQ(grid.point_array_count, 1);
    CHECK_NEAR(grid.point_arrays[0].values[2], 9, 0);
    static const char *const parts[] = {
        "2 1 arrays of field data left out",
        "1 array 'long' at byte 174 has 3 values, only the first 2 are read",
        "2 array 'words' at byte 277 left out: it holds no numbers",
        "left out: piece 2 lacks it",
        "1 piece 1: connectivity has 3 values, the cells use the first 2",
        "2 2 pieces; points on their borders stay apart"};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if (!strstr(lines, parts[i])) fail_msg("the log lacks '%s':\n%s", parts[i], lines);
    tli_grid_release(&grid);
    tl_ctx_destroy(c);
}

/* Appended data past 4 GiB, in a file that is mostly a hole. */
static void reads_past_4_gib(void **state)
{
    static const char head[] =
        "<VTKFile type='ImageData' header_type='UInt64'><ImageData><Piece Extent='0 1 0 0 0 0'>"
        "<PointData><DataArray type='UInt16' Name='p' format='appended' offset='5000000000'/>"
        "</PointData></Piece></ImageData><AppendedData encoding='raw'>_";
    static const uint8_t data[] = {4, 0, 0, 0, 0, 0, 0, 0, 0x34, 0x12, 0xff, 0xff};
    tli_map map;
    tli_grid grid;
    (void)state;
    FILE *file = fopen("hole.vti", "wb");
    CHECK(file != NULL);
    CHECK_EQ(fwrite(head, 1, sizeof head - 1, file), sizeof head - 1);
    CHECK_EQ(fseeko(file, 5000000000 + (off_t)sizeof head - 1, SEEK_SET), 0);
    CHECK_EQ(fwrite(data, 1, sizeof data, file), sizeof data);
    CHECK_EQ(fclose(file), 0);
    CHECK_OK(ctx, tli_map_open(ctx, "hole.vti", &map));
    tli_grid_init(ctx, &grid);
    CHECK_OK(ctx, tli_read_vtk_xml(ctx, &map, "hole.vti", &grid));
    CHECK_NEAR(grid.point_arrays[0].values[0], 0x1234, 0);
    CHECK_NEAR(grid.point_arrays[0].values[1], 0xffff, 0);
    tli_grid_release(&grid);
    tli_map_close(ctx, &map);
    CHECK_EQ(remove("hole.vti"), 0);
}

/* A writer that ends the header with '=' before the data begin. */
static void takes_headers_of_their_own(void **state)
{
    (void)state;
    tli_grid grid;
    CHECK_OK(ctx,
             read_string("<VTKFile type='ImageData'><ImageData><Piece Extent='0 2 0 0 0 0'>"
                         "<PointData><DataArray type='UInt8' Name='p' format='binary'>\n"
                         " AwAAAA==BQYH\n</DataArray></PointData></Piece></ImageData></VTKFile>",
                         &grid));
    for (int i = 0; i < 3; i++) CHECK_NEAR(grid.point_arrays[0].values[i], 5 + i, 0);
    tli_grid_release(&grid);
}

/* Larger than all chunks, grains and blocks: any number of threads gives the same bytes. */
static void same_with_any_threads(void **state)
{
    enum { COUNT = 300007 };
    (void)state;
    double *values = malloc(COUNT * sizeof *values);
    CHECK(values != NULL);
    for (size_t i = 0; i < COUNT; i++) values[i] = (double)i / 1024 - 100;
    for (int coding = 0; coding < 4; coding++) {
        xml_mode mode = {.coding = (xml_coding)coding,
                         .packing = coding ? XML_ZLIB : XML_PLAIN,
                         .block_bytes = 1 << 15};
        for (int plain = 0; plain < (coding ? 2 : 1); plain++) {
            if (plain) mode.packing = XML_PLAIN;
            xml_text t = {0}, appended = {0};
            xml_begin(&t, &mode, "ImageData");
            xml_printf(&t, "<ImageData><Piece Extent='1 %d 0 0 0 0'><PointData>", COUNT);
            xml_put_array(&t, &appended, &mode, TL_F64, "Name='p'", values, COUNT);
            xml_printf(&t, "</PointData></Piece></ImageData>");
            xml_end(&t, &appended, &mode);
            for (unsigned threads = 1; threads <= 3; threads++) {
                tl_ctx_opts opts = tl_ctx_opts_defaults();
                opts.thread_count = threads;
                tl_ctx *c;
                tli_grid grid;
                CHECK_STATUS(tl_ctx_create(&opts, &c), TL_OK);
                CHECK_OK(c, read_bytes(c, t.text, t.bytes, &grid));
                CHECK(memcmp(grid.point_arrays[0].values, values, COUNT * sizeof *values) == 0);
                tli_grid_release(&grid);
                CHECK_EQ(tl_ctx_current_bytes(c), 0);
                tl_ctx_destroy(c);
            }
            free(t.text);
        }
    }
    free(values);
}

static void widens_all_types(void **state)
{
    (void)state;
    for (int scalar = 0; scalar < 10; scalar++)
        for (int big = 0; big < 2; big++) {
            xml_text t = {0};
            double values[37];
            xml_put(&t, "x", 1); /* so that nothing is aligned */
            for (size_t i = 0; i < 37; i++)
                xml_put_number(&t, (tl_scalar)scalar, xml_value((tl_scalar)scalar, i), big);
            tli_widen(t.text + 1, (tl_scalar)scalar, big, 37, values);
            for (size_t i = 0; i < 37; i++)
                CHECK_NEAR(values[i], xml_value((tl_scalar)scalar, i), 0);
            free(t.text);
        }
}

static tl_status read_for_fail(tl_ctx *c, void *arg)
{
    const xml_text *t = arg;
    tli_grid grid;
    tl_status st = read_bytes(c, t->text, t->bytes, &grid);
    if (!st) tli_grid_release(&grid);
    return st;
}

static void survives_failed_allocations(void **state)
{
    (void)state;
    for (int packing = 0; packing < 4; packing++) {
        xml_mode mode = {.coding = XML_INLINE,
                         .packing = (xml_packing)packing,
                         .block_bytes = 20,
                         .scalar = TL_F32,
                         .wrapped = true};
        xml_text t = xml_make_unstructured(&mode, 2);
        fail_alloc f;
        fail_alloc_open(&f, 2);
        printf("# packing %d: %ld allocations\n", packing,
               fail_alloc_each(&f, read_for_fail, &t) - 1);
        fail_alloc_close(&f);
        free(t.text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(widens_all_types, setup, teardown),
        cmocka_unit_test_setup_teardown(reads_all_modes, setup, teardown),
        cmocka_unit_test_setup_teardown(joins_pieces, setup, teardown),
        cmocka_unit_test_setup_teardown(reads_structured, setup, teardown),
        cmocka_unit_test_setup_teardown(joins_structured_pieces, setup, teardown),
        cmocka_unit_test_setup_teardown(turns_images, setup, teardown),
        cmocka_unit_test_setup_teardown(takes_quirks, setup, teardown),
        cmocka_unit_test_setup_teardown(takes_headers_of_their_own, setup, teardown),
        cmocka_unit_test_setup_teardown(same_with_any_threads, setup, teardown),
        cmocka_unit_test_setup_teardown(reads_past_4_gib, setup, teardown),
        cmocka_unit_test(says_what_it_leaves_out),
        cmocka_unit_test(can_be_cancelled),
        cmocka_unit_test(survives_failed_allocations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
