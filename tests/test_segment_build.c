/* Segments: the same tets, vertices and values as the mesh in memory has, for every kind of input,
 * any number of threads and any memory; links, neighbours and opposites that hold. */
#include "check.h"
#include "check_ctx.h"

#include "check_file.h"
#include "make_mesh.h"

#include "tetralod/segment.h"

static double slope(const double x[3])
{
    return x[0] + 10 * x[1] - 3 * x[2];
}

/* ---- comparing with a mesh in memory ---- */

typedef struct known_tet {
    tl_lidx ids[4];
    size_t index;
} known_tet;

static int compare_known(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(tl_lidx) * 4);
}

/* Every tet of the mesh is in exactly one segment, with its corners in the same order, and with the
 * places and values of vertices and tets. Ids are indices of the mesh, after ids [vert_count] of
 * the source where there are any. */
static void check_same(tl_ctx *ctx, const tl_segments *segments, const tl_mesh *mesh,
                       const uint64_t *ids)
{
    const size_t tets = tl_mesh_tet_count(mesh), verts = tl_mesh_vert_count(mesh);
    known_tet *known = calloc(tets + 1, sizeof *known);
    uint8_t *seen = calloc(tets + 1, 1), *seen_vert = calloc(verts + 1, 1);
    size_t *local_of = calloc((size_t)tl_segments_id_end(segments) + 1, sizeof *local_of);
    for (size_t v = 0; v < verts; v++) local_of[ids ? ids[v] : v] = v;
    for (size_t t = 0; t < tets; t++) {
        memcpy(known[t].ids, tl_mesh_tets(mesh) + 4 * t, sizeof known[t].ids);
        known[t].index = t;
    }
    qsort(known, tets, sizeof *known, compare_known);
    CHECK_EQ(tl_segments_tet_count(segments), tets);
    CHECK_EQ(tl_segments_channel_count(segments), tl_mesh_channel_count(mesh));
    CHECK_EQ(tl_segments_has_regions(segments), tl_mesh_regions(mesh) != NULL);
    size_t owned = 0, used = 0;
    for (uint32_t s = 0; s < tl_segments_count(segments); s++) {
        tl_segment seg;
        CHECK_OK(ctx, tl_segments_load(ctx, segments, s, &seg));
        CHECK(seg.tet_count > 0 && seg.tet_count <= TL_SEGMENT_MAX);
        CHECK(seg.vert_count <= TL_SEGMENT_MAX);
        size_t last = 0;
        for (uint32_t v = 0; v < seg.vert_count; v++) {
            size_t at = local_of[seg.vert_ids[v]];
            CHECK(memcmp(tl_mesh_xyz(mesh) + 3 * at, seg.xyz + 3 * v, 24) == 0);
            owned += !(seg.links[v] & TL_LINK_COPY);
            used += !seen_vert[at];
            seen_vert[at] = 1;
        }
        for (uint32_t t = 0; t < seg.tet_count; t++) {
            known_tet wanted;
            for (int i = 0; i < 4; i++) {
                CHECK(seg.tets[4 * t + i] < seg.vert_count);
                wanted.ids[i] = (tl_lidx)local_of[seg.vert_ids[seg.tets[4 * t + i]]];
            }
            const known_tet *found = bsearch(&wanted, known, tets, sizeof *known, compare_known);
            CHECK(found != NULL);
            CHECK(!seen[found->index]);
            seen[found->index] = 1;
            CHECK(t == 0 || found->index > last);
            last = found->index;
            if (seg.regions) CHECK_EQ(seg.regions[t], tl_mesh_regions(mesh)[last]);
            for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
                const tl_channel *channel = tl_mesh_channel(mesh, c);
                const tl_segment_channel *mine = tl_segments_channel(segments, c);
                CHECK(strcmp(channel->name, mine->name) == 0 && channel->on == mine->on);
                size_t bytes = channel->components * sizeof(double);
                uint32_t stride = tl_segments_components(segments, channel->on);
                if (channel->on == TL_ON_TET)
                    CHECK(memcmp(channel->values + last * channel->components,
                                 seg.tet_values + t * stride + mine->first, bytes) == 0);
                for (int i = 0; channel->on == TL_ON_VERTEX && i < 4; i++)
                    CHECK(memcmp(channel->values + wanted.ids[i] * channel->components,
                                 seg.values + seg.tets[4 * t + i] * stride + mine->first,
                                 bytes) == 0);
            }
        }
        tl_segment_release(ctx, &seg);
    }
    CHECK_EQ(owned, used);
    CHECK_EQ(used, tl_segments_vert_count(segments));
    for (size_t t = 0; t < tets; t++) CHECK(seen[t]);
    free(local_of);
    free(seen_vert);
    free(seen);
    free(known);
}

/* Opposites are those of the mesh as a whole. */
static void check_opposites(tl_ctx *ctx, const tl_segments *segments, const tl_mesh *mesh)
{
    tl_lidx *opposite = NULL;
    size_t open = 0, open_there = 0;
    CHECK_OK(ctx, tl_mesh_adjacency(ctx, mesh, &opposite, NULL));
    for (size_t i = 0; i < 4 * tl_mesh_tet_count(mesh); i++) open += opposite[i] == TL_NONE;
    for (uint32_t s = 0; s < tl_segments_count(segments); s++) {
        tl_segment seg;
        CHECK_OK(ctx, tl_segments_load(ctx, segments, s, &seg));
        for (size_t i = 0; i < 4 * (size_t)seg.tet_count; i++)
            open_there += seg.opposites[i] == TL_OPPOSITE_NONE;
        tl_segment_release(ctx, &seg);
    }
    CHECK_EQ(open_there, open);
    tl_mem_free(ctx, opposite);
}

/* Each segment is loaded once, and released once when all its neighbours have been loaded. */
static void check_stream(tl_ctx *ctx, const tl_segments *segments)
{
    const uint32_t count = tl_segments_count(segments);
    uint8_t *states = calloc(count, 1);
    uint32_t active = 0, most = 0;
    tl_stream stream;
    CHECK_OK(ctx, tl_segments_stream(ctx, segments, &stream));
    CHECK_EQ(stream.tag_count, 2 * (size_t)count);
    for (size_t i = 0; i < stream.tag_count; i++) {
        bool load = stream.tags[i] >= 0;
        uint32_t s = (uint32_t)(load ? stream.tags[i] : -(stream.tags[i] + 1));
        CHECK(s < count);
        CHECK_EQ(states[s], load ? 0 : 1);
        states[s]++;
        active += load ? 1 : UINT32_MAX;
        if (active > most) most = active;
        tl_segment_summary info = tl_segments_info(segments, s);
        for (uint32_t n = 0; !load && n < info.neighbour_count; n++)
            CHECK(states[info.neighbours[n]] > 0);
    }
    CHECK_EQ(most, stream.max_segments);
    tl_stream_release(ctx, &stream);
    free(states);
}

static tl_segments *build_mesh(tl_ctx *ctx, const make_mesh *m, tl_segment_opts opts)
{
    tl_mesh *mesh = make_object(ctx, m, slope);
    tl_segments *segments = NULL;
    CHECK_OK(ctx, tl_segments_build_mesh(ctx, mesh, &opts, NULL, &segments));
    check_same(ctx, segments, mesh, NULL);
    check_opposites(ctx, segments, mesh);
    CHECK_OK(ctx, tl_segments_check(ctx, segments, TL_CHECK_FULL));
    check_stream(ctx, segments);
    tl_mesh_destroy(mesh);
    return segments;
}

static void test_meshes(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    tl_segment_opts opts = tl_segment_opts_defaults();
    opts.segment_tets = 500;
    make_mesh meshes[] = {make_grid(14), make_grid_cavity(10), make_grid(2), make_room(4, 1)};
    const double corner[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    memcpy(meshes[3].xyz, corner, sizeof corner);
    for (tl_lidx i = 0; i < 4; i++) meshes[3].tets[i] = i;
    make_two_regions(&meshes[0]);
    make_shuffle(&meshes[0], 7);
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
        tl_segments *segments = build_mesh(ctx, &meshes[i], opts);
        printf("%zu tets: %u segments\n", meshes[i].tet_count, tl_segments_count(segments));
        tl_segments_destroy(segments);
        make_release(&meshes[i]);
    }
    tl_ctx_destroy(ctx);
}

/* Faces of three tets and more, over several segments: no opposites, as in the mesh as a whole. */
static void test_soup(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_soup(60, 3000, 5);
    tl_mesh *mesh = make_object(ctx, &m, slope);
    tl_lidx *opposite = NULL;
    size_t nonmanifold = 0;
    CHECK_OK(ctx, tl_mesh_adjacency(ctx, mesh, &opposite, &nonmanifold));
    CHECK(nonmanifold > 100);
    tl_mem_free(ctx, opposite);
    tl_segment_opts opts = tl_segment_opts_defaults();
    opts.segment_tets = 100;
    tl_segments *segments = NULL;
    CHECK_OK(ctx, tl_segments_build_mesh(ctx, mesh, &opts, NULL, &segments));
    CHECK(tl_segments_count(segments) > 3);
    check_opposites(ctx, segments, mesh);
    CHECK_OK(ctx, tl_segments_check(ctx, segments, TL_CHECK_FULL));
    tl_segments_destroy(segments);
    tl_mesh_destroy(mesh);
    make_release(&m);
    tl_ctx_destroy(ctx);
}

/* ---- files ---- */

static void test_file(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 40, "g.vtu"));
    tl_mesh *mesh = NULL;
    tl_read_report whole, windowed;
    CHECK_OK(ctx, tl_mesh_read(ctx, "g.vtu", NULL, &mesh, &whole));
    tl_segment_opts opts = tl_segment_opts_defaults();
    opts.segment_tets = 4000;
    opts.memory_bytes = TL_SEGMENT_MEMORY_MIN;
    tl_segments *segments = NULL;
    CHECK_OK(ctx, tl_segments_build(ctx, "g.vtu", NULL, &opts, NULL, &segments, &windowed));
    CHECK(memcmp(&whole, &windowed, sizeof whole) == 0);
    check_same(ctx, segments, mesh, NULL);
    check_opposites(ctx, segments, mesh);
    CHECK_OK(ctx, tl_segments_check(ctx, segments, TL_CHECK_FULL));
    check_stream(ctx, segments);
    tl_segments_destroy(segments);
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
}

/* A volume of bytes as a raw file and as image data with cells of two materials, in windows of
 * layers and, with little memory, of rows; points without tets keep their indices. */
static void write_volumes(const uint32_t dims[3])
{
    size_t points = (size_t)dims[0] * dims[1] * dims[2];
    size_t cells = (size_t)(dims[0] - 1) * (dims[1] - 1) * (dims[2] - 1);
    uint8_t *values = malloc(points);
    uint64_t state = 3;
    for (size_t i = 0; i < points; i++) values[i] = (uint8_t)(make_random(&state) % 250 + 5);
    for (size_t i = points / 3; i < points / 3 + 40; i++) values[i] = 0; /* the fill value */
    FILE *raw = fopen("v.raw", "wb"), *vti = fopen("v.vti", "wb");
    fwrite(values, 1, points, raw);
    fclose(raw);
    fprintf(vti,
            "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
            "<ImageData WholeExtent=\"0 %u 0 %u 0 %u\" Origin=\"1 2 3\" Spacing=\"0.5 0.25 1\">"
            "<Piece Extent=\"0 %u 0 %u 0 %u\">\n<PointData><DataArray type=\"UInt8\" "
            "Name=\"density\" format=\"appended\" offset=\"0\"/></PointData><CellData>"
            "<DataArray type=\"UInt8\" Name=\"material\" format=\"appended\" offset=\"%zu\"/>"
            "</CellData></Piece></ImageData><AppendedData encoding=\"raw\">\n_",
            dims[0] - 1, dims[1] - 1, dims[2] - 1, dims[0] - 1, dims[1] - 1, dims[2] - 1,
            points + 8);
    uint64_t bytes = points;
    fwrite(&bytes, 8, 1, vti);
    fwrite(values, 1, points, vti);
    bytes = cells;
    fwrite(&bytes, 8, 1, vti);
    for (size_t i = 0; i < cells; i++) fputc(values[i] % 2, vti);
    fputs("</AppendedData></VTKFile>", vti);
    fclose(vti);
    free(values);
}

/* In-core ids are those of the points that tets use. */
static uint64_t *used_ids(const tl_segments *segments, const tl_mesh *mesh, tl_ctx *ctx)
{
    uint64_t *ids = calloc(tl_mesh_vert_count(mesh) + 1, sizeof *ids);
    uint8_t *seen = calloc((size_t)tl_segments_id_end(segments) + 1, 1);
    for (uint32_t s = 0; s < tl_segments_count(segments); s++) {
        tl_segment seg;
        CHECK_OK(ctx, tl_segments_load(ctx, segments, s, &seg));
        for (uint32_t v = 0; v < seg.vert_count; v++) seen[seg.vert_ids[v]] = 1;
        tl_segment_release(ctx, &seg);
    }
    size_t count = 0;
    for (uint64_t i = 0; i < tl_segments_id_end(segments); i++)
        if (seen[i]) ids[count++] = i;
    CHECK_EQ(count, tl_mesh_vert_count(mesh));
    free(seen);
    return ids;
}

static void test_volumes(void **state)
{
    (void)state;
    /* of the second, a layer is more than the memory below has room for */
    const uint32_t sizes[2][3] = {{30, 21, 17}, {700, 400, 3}};
    tl_ctx *ctx = check_ctx_create(2);
    for (int i = 0; i < 8; i++) {
        const uint32_t *dims = sizes[i / 4];
        const char *path = i % 2 ? "v.vti" : "v.raw";
        tl_read_opts read = tl_read_opts_defaults();
        if (i % 4 == 0) write_volumes(dims);
        if (i % 2 == 0) memcpy(read.raw_dims, dims, sizeof read.raw_dims);
        read.has_fill_value = i % 4 >= 2;
        read.split = i % 4 == 3 ? 6 : 5;
        tl_mesh *mesh = NULL;
        tl_read_report whole, windowed;
        CHECK_OK(ctx, tl_mesh_read(ctx, path, &read, &mesh, &whole));
        tl_segment_opts opts = tl_segment_opts_defaults();
        opts.segment_tets = 8000;
        opts.memory_bytes = TL_SEGMENT_MEMORY_MIN;
        tl_segments *segments = NULL;
        CHECK_OK(ctx, tl_segments_build(ctx, path, &read, &opts, NULL, &segments, &windowed));
        CHECK_EQ(tl_segments_id_end(segments), (uint64_t)dims[0] * dims[1] * dims[2]);
        CHECK(memcmp(&whole, &windowed, sizeof whole) == 0);
        uint64_t *ids = used_ids(segments, mesh, ctx);
        check_same(ctx, segments, mesh, ids);
        free(ids);
        tl_segments_destroy(segments);
        tl_mesh_destroy(mesh);
    }
    tl_ctx_destroy(ctx);
}

/* ---- the same bytes ---- */

/* Any number of threads and any memory, from a file in windows and from the mesh as a whole. */
static void test_same_bytes(void **state)
{
    (void)state;
    char *first = NULL;
    size_t first_bytes = 0;
    for (int i = 0; i < 4; i++) {
        tl_ctx *ctx = check_ctx_create(i == 1 ? 3 : 1);
        if (i == 0) CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 40, "g.vtu"));
        tl_segment_opts opts = tl_segment_opts_defaults();
        opts.segment_tets = 3000;
        opts.memory_bytes = i == 2 ? (uint64_t)1 << 30 : TL_SEGMENT_MEMORY_MIN;
        tl_segments *segments = NULL;
        if (i < 3) {
            CHECK_OK(ctx, tl_segments_build(ctx, "g.vtu", NULL, &opts, "g.seg", &segments, NULL));
        } else {
            tl_mesh *mesh = NULL;
            CHECK_OK(ctx, tl_mesh_read(ctx, "g.vtu", NULL, &mesh, NULL));
            CHECK_OK(ctx, tl_segments_build_mesh(ctx, mesh, &opts, "g.seg", &segments));
            tl_mesh_destroy(mesh);
        }
        size_t bytes;
        char *all = check_file_load("g.seg", &bytes);
        CHECK_EQ(tl_segments_bytes(segments), bytes);
        tl_segments_destroy(segments);
        CHECK_OK(ctx, tl_segments_open(ctx, "g.seg", &segments));
        CHECK(isnan(tl_segments_time(segments)));
        CHECK(tl_segments_has_adjacency(segments));
        if (first) {
            CHECK_EQ(bytes, first_bytes);
            CHECK(memcmp(all, first, bytes) == 0);
            free(all);
        } else {
            first = all;
            first_bytes = bytes;
        }
        tl_segments_destroy(segments);
        tl_ctx_destroy(ctx);
    }
    free(first);
}

/* Table 6.3 of Sondershaus 2007 has 1.39 to 2.1 for the largest segment over the mean. */
static void test_balance(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    CHECK_OK(ctx, tl_sample_write(ctx, "gaussians", 60, "g.vtu"));
    tl_segment_opts opts = tl_segment_opts_defaults();
    tl_segments *segments = NULL;
    CHECK_OK(ctx, tl_segments_build(ctx, "g.vtu", NULL, &opts, NULL, &segments, NULL));
    uint32_t most = 0, count = tl_segments_count(segments);
    for (uint32_t s = 0; s < count; s++) {
        tl_segment_summary info = tl_segments_info(segments, s);
        if (info.tet_count > most) most = info.tet_count;
    }
    double mean = (double)tl_segments_tet_count(segments) / count;
    CHECK_BOUND("largest segment over the mean", most / mean, 1.39);
    tl_segments_destroy(segments);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_meshes),     cmocka_unit_test(test_soup),
        cmocka_unit_test(test_file),       cmocka_unit_test(test_volumes),
        cmocka_unit_test(test_same_bytes), cmocka_unit_test(test_balance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
