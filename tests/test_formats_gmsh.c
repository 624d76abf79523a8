/* Gmsh: one small mesh written here in all versions, as text and in both byte orders, with groups,
 * names, values of two steps at nodes, elements and corners; damaged files; refusals. */
#include "check_source.h"

#define FILE_BYTES 16384

/* A file in the making. */
typedef struct msh {
    uint8_t bytes[FILE_BYTES];
    size_t count;
    int version; /* 22, 40, 41 */
    bool binary, big_endian, groups;
} msh;

static void put(msh *m, const void *bytes, size_t count)
{
    CHECK(m->count + count <= FILE_BYTES);
    memcpy(m->bytes + m->count, bytes, count);
    m->count += count;
}

static void text(msh *m, const char *line)
{
    put(m, line, strlen(line));
}

static void put_bits(msh *m, uint64_t bits, unsigned count)
{
    uint8_t bytes[8];
    for (unsigned i = 0; i < count; i++)
        bytes[i] = (uint8_t)(bits >> 8 * (m->big_endian ? count - 1 - i : i));
    put(m, bytes, count);
}

static void integer(msh *m, unsigned bytes, int64_t value)
{
    char line[32];
    if (m->binary) {
        put_bits(m, (uint64_t)value, bytes);
        return;
    }
    snprintf(line, sizeof line, "%lld ", (long long)value);
    text(m, line);
}

static void integers(msh *m, unsigned bytes, int count, const int64_t *values)
{
    for (int i = 0; i < count; i++) integer(m, bytes, values[i]);
}

static void real(msh *m, double value)
{
    char line[40];
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    if (m->binary) {
        put_bits(m, bits, 8);
        return;
    }
    snprintf(line, sizeof line, "%.17g ", value);
    text(m, line);
}

/* ---- the mesh: two tets on a triangle, a line, one point that nothing uses ---- */

static const int64_t node_tags[6] = {10, 20, 30, 40, 50, 7000};
static const double nodes[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0},
                                   {0, 0, 1}, {1, 1, 1}, {5, 5, 5}};

typedef struct element {
    int64_t type, tag, dimension, entity, group;
    int node_count;
    int64_t nodes[4];
} element;
static const element elements[] = {
    {1, 1, 1, 4, 0, 2, {10, 20}},           {2, 2, 2, 5, 31, 3, {10, 20, 30}},
    {2, 3, 2, 6, 32, 3, {20, 30, 40}},      {4, 900, 3, 1, 7, 4, {10, 20, 30, 40}},
    {4, 901, 3, 2, 8, 4, {20, 30, 40, 50}},
};
#define ELEMENTS (sizeof elements / sizeof *elements)

static void write_entity(msh *m, int64_t dimension, int64_t tag, int64_t group)
{
    integer(m, 4, tag);
    for (int i = 0; i < (dimension == 0 && m->version == 41 ? 3 : 6); i++) real(m, 0.5);
    integer(m, 8, m->groups && group != 0);
    if (m->groups && group != 0) integer(m, 4, dimension == 2 ? -group : group);
    if (dimension > 0) {
        integer(m, 8, 2);
        integer(m, 4, 1);
        integer(m, 4, -2);
    }
    if (!m->binary) text(m, "\n");
}

static void write_entities(msh *m)
{
    static const int64_t counts[4] = {1, 1, 2, 2};
    text(m, "$Entities\n");
    integers(m, 8, 4, counts);
    if (!m->binary) text(m, "\n");
    write_entity(m, 0, 1, 0);
    for (size_t i = 0; i < ELEMENTS; i++)
        write_entity(m, elements[i].dimension, elements[i].entity, elements[i].group);
    text(m, "\n$EndEntities\n");
}

/* Points in two blocks, the second with parameters. */
static void write_nodes(msh *m)
{
    char line[32];
    text(m, "$Nodes\n");
    if (m->version == 22) {
        text(m, "6\n");
        for (int i = 0; i < 6; i++) {
            integer(m, 4, node_tags[i]);
            for (int axis = 0; axis < 3; axis++) real(m, nodes[i][axis]);
            if (!m->binary) text(m, "\n");
        }
    } else {
        const int64_t head[4] = {2, 6, 10, 7000};
        integers(m, 8, m->version == 41 ? 4 : 2, head);
        for (int block = 0; block < 2; block++) {
            const int64_t dimension = block ? 2 : 3, entity = block ? 5 : 1;
            const int first = 4 * block, count = block ? 2 : 4;
            integer(m, 4, m->version == 40 ? entity : dimension);
            integer(m, 4, m->version == 40 ? dimension : entity);
            integer(m, 4, block);
            integer(m, 8, count);
            for (int i = 0; i < count && m->version == 41; i++) integer(m, 8, node_tags[first + i]);
            for (int i = first; i < first + count; i++) {
                if (m->version == 40) integer(m, 4, node_tags[i]);
                for (int axis = 0; axis < 3; axis++) real(m, nodes[i][axis]);
                for (int u = 0; u < 2 * block; u++) real(m, 0.25);
            }
        }
    }
    snprintf(line, sizeof line, "\n$EndNodes\n");
    text(m, line);
}

static void write_elements_2(msh *m)
{
    text(m, "5\n");
    for (size_t i = 0; i < ELEMENTS; i++) {
        const element *e = &elements[i];
        const int64_t tags[4] = {m->groups ? e->group : 0, e->entity, 1, 1};
        if (m->binary) {
            const int64_t head[3] = {e->type, 1, 4};
            integers(m, 4, 3, head);
            integer(m, 4, e->tag);
        } else {
            integer(m, 4, e->tag);
            integer(m, 4, e->type);
            integer(m, 4, 4);
        }
        integers(m, 4, 4, tags);
        integers(m, 4, e->node_count, e->nodes);
        if (!m->binary) text(m, "\n");
    }
}

static void write_elements(msh *m)
{
    static const int64_t head[4] = {5, 5, 1, 901};
    const unsigned bytes = m->version == 41 ? 8 : 4;
    text(m, "$Elements\n");
    if (m->version == 22) write_elements_2(m);
    if (m->version != 22) integers(m, 8, m->version == 41 ? 4 : 2, head);
    for (size_t i = 0; i < ELEMENTS && m->version != 22; i++) {
        const element *e = &elements[i];
        integer(m, 4, m->version == 40 ? e->entity : e->dimension);
        integer(m, 4, m->version == 40 ? e->dimension : e->entity);
        integer(m, 4, e->type);
        integer(m, 8, 1);
        integer(m, bytes, e->tag);
        integers(m, bytes, e->node_count, e->nodes);
    }
    text(m, "\n$EndElements\n");
}

/* Values at all nodes or at the last two elements: tag / 10 + 100 step + component. */
static void write_data(msh *m, const char *section, const char *name, int step, int components)
{
    char line[200];
    const bool on_nodes = strcmp(section, "NodeData") == 0, corners = section[7] == 'N';
    const int first = on_nodes ? 0 : (int)ELEMENTS - 2, end = on_nodes ? 6 : (int)ELEMENTS;
    snprintf(line, sizeof line, "$%s\n2\n\"%s\"\nscheme\n1\n%g\n3\n%d\n%d\n%d\n", section, name,
             0.5 * step, step, components, end - first);
    text(m, line);
    for (int i = first; i < end; i++) {
        int64_t tag = on_nodes ? node_tags[i] : elements[i].tag;
        integer(m, 4, tag);
        if (corners) integer(m, 4, 4);
        for (int n = 0; n < (corners ? 4 : 1); n++)
            for (int c = 0; c < components; c++) real(m, (double)tag / 10 + 100 * step + c);
        if (!m->binary) text(m, "\n");
    }
    snprintf(line, sizeof line, "%s$End%s\n", m->binary ? "\n" : "", section);
    text(m, line);
}

static void write_all(msh *m)
{
    char line[64];
    m->count = 0;
    snprintf(line, sizeof line, "$MeshFormat\n%s %d 8\n",
             m->version == 22   ? "2.2"
             : m->version == 40 ? "4"
                                : "4.1",
             m->binary);
    text(m, line);
    if (m->binary) put_bits(m, 1, 4);
    text(m, m->binary ? "\n$EndMeshFormat\n" : "$EndMeshFormat\n");
    text(m, "$Comments\nwith a $ sign\n$EndComments\n");
    if (m->groups)
        text(m, "$PhysicalNames\n3\n2 31 \"a wall\"\n3 7 \"solid\"\n3 8 \"fluid \"\n"
                "$EndPhysicalNames\n");
    if (m->version > 22) write_entities(m);
    write_nodes(m);
    write_elements(m);
    write_data(m, "NodeData", "heat", 0, 1);
    write_data(m, "ElementData", "flux", 0, 3);
    write_data(m, "NodeData", "heat", 4, 1);
    write_data(m, "ElementNodeData", "corner", 4, 1);
}

static bool next_variant(int variant, msh *m)
{
    static const int versions[] = {22, 40, 41};
    if (variant == 18) return false;
    m->version = versions[variant % 3];
    m->binary = variant / 3 % 3 > 0;
    m->big_endian = variant / 3 % 3 == 2;
    m->groups = variant >= 9;
    write_all(m);
    return true;
}

/* ---- reading ---- */

static void check_mesh(const tli_grid *grid, const msh *m)
{
    static const uint32_t ids[] = {0, 1, 0, 1, 2, 1, 2, 3, 0, 1, 2, 3, 1, 2, 3, 4};
    static const uint8_t types[ELEMENTS] = {3, 5, 5, 10, 10};
    CHECK_EQ(grid->point_count, 6);
    CHECK(memcmp(grid->xyz, nodes, sizeof nodes) == 0);
    CHECK_EQ(grid->cell_count, ELEMENTS);
    CHECK(memcmp(grid->types, types, sizeof types) == 0);
    CHECK(memcmp(grid->connectivity, ids, sizeof ids) == 0);
    CHECK_EQ(grid->regions[3], m->groups ? 7 : 1);
    CHECK_EQ(grid->regions[4], m->groups ? 8 : 2);
    CHECK_EQ(grid->region_name_count, m->groups ? 2 : 0);
    CHECK_EQ(grid->label_count, 2);
    for (uint32_t i = 0; i < 2; i++) {
        const tli_grid_label *label = &grid->labels[i];
        CHECK_EQ(label->id, m->groups ? elements[1 + i].group : elements[1 + i].entity);
        CHECK_EQ(label->face_count, 1);
        CHECK_EQ(label->offsets[1], 3);
        CHECK(memcmp(label->points, ids + 2 + 3 * i, 12) == 0);
        if (strcmp(label->name, m->groups && i == 0 ? "a wall" : "") != 0)
            fail_msg("label '%s'", label->name);
    }
    if (m->groups) CHECK(strcmp(grid->region_names[0].name, "solid") == 0);
}

static void check_values(const tli_grid *grid, int step)
{
    const double *heat = grid_array(grid, TL_ON_VERTEX, "heat")->values;
    const double *flux = grid_array(grid, TL_ON_TET, "flux")->values;
    const double *corner = grid_array(grid, TL_ON_VERTEX, "corner")->values;
    CHECK_EQ(grid->point_array_count, 2);
    CHECK_EQ(grid->cell_array_count, 1);
    for (int i = 0; i < 6; i++) CHECK(heat[i] == (double)node_tags[i] / 10 + 100 * step);
    for (int c = 0; c < 3; c++) {
        CHECK(isnan(flux[c]) && isnan(flux[6 + c]));
        CHECK(flux[9 + c] == 90 + c && flux[12 + c] == 90.1 + c);
    }
    CHECK(corner[0] == 490 && corner[4] == 490.1 && isnan(corner[5]));
    for (int i = 1; i < 4; i++) CHECK_NEAR(corner[i], 490.05, 1e-12);
    CHECK(grid->time == 0.5 * step);
}

static void all_variants_are_one_mesh(void **state)
{
    (void)state;
    static msh m;
    tl_ctx *ctx = grid_ctx(0, 2);
    for (int variant = 0; next_variant(variant, &m); variant++) {
        tl_read_opts opts = tl_read_opts_defaults();
        source_case c = {"a.msh", tli_read_gmsh, &opts};
        tli_map map = {.bytes = m.bytes, .byte_count = m.count};
        tli_source source;
        tl_steps steps = {0};
        source_fill("a.msh", &map, &source);
        CHECK_EQ(tli_match_gmsh(&source), TLI_MATCH_BYTES);
        CHECK_OK(ctx, tli_steps_gmsh(ctx, &source, &opts, &steps));
        CHECK_EQ(steps.count, 2);
        CHECK(steps.times[0] == 0 && steps.times[1] == 2);
        tl_steps_release(ctx, &steps);
        for (opts.step = 0; opts.step < 2; opts.step++) {
            tli_grid grid;
            CHECK_OK(ctx, grid_read(ctx, source_read, &c, m.bytes, m.count, &grid));
            grid_check(&grid);
            check_mesh(&grid, &m);
            check_values(&grid, opts.step ? 4 : 0);
            tli_grid_release(&grid);
        }
        tli_grid grid;
        CHECK_STATUS(grid_read(ctx, source_read, &c, m.bytes, m.count, &grid), TL_ERR_ARG);
        tli_grid_release(&grid);
    }
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

static void survives_damage(void **state)
{
    (void)state;
    static msh m;
    source_case c = {"a.msh", tli_read_gmsh, NULL};
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    for (int variant = 9; next_variant(variant, &m); variant++) {
        size_t refused = grid_survives_damage(ctx, source_read, &c, m.bytes, m.count, 1);
        printf("version %d, %s: %zu of %zu damaged files refused\n", m.version,
               m.binary ? "binary" : "text", refused, 3 * m.count);
        CHECK(refused > m.count / 2);
        source_survives_budgets(&c, m.bytes, m.count, 997);
    }
    tl_ctx_destroy(ctx);
}

static void refusals_name_the_place(void **state)
{
    (void)state;
#define HEAD "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
#define HEAD4 "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
#define NODES "$Nodes\n2\n1 0 0 0\n2 1 0 0\n$EndNodes\n"
    static const struct {
        const char *text;
        tl_status status;
        const char *says;
    } cases[] = {
        {"$MeshFormat\n3 0 8\n$EndMeshFormat\n", TL_ERR_UNSUPPORTED, "MSH version 3"},
        {"$MeshFormat\n2.2 2 8\n", TL_ERR_FORMAT, "line 2: expected the kind of file"},
        {"$MeshFormat\n2.2 0 8\n$EndNodes\n", TL_ERR_FORMAT, "expected $EndMeshFormat"},
        {HEAD "$Nodes\n1000000000000\n1 0 0 0\n", TL_ERR_FORMAT,
         "1000000000000 nodes need 8 bytes"},
        {HEAD "$Nodes\n2\n1 0 0 0\n2 1 x 0\n$EndNodes\n", TL_ERR_FORMAT,
         "line 7: expected a coordinate"},
        {HEAD "$Nodes\n2\n1 0 0 0\n2 1 0 0\n", TL_ERR_FORMAT, "expected $EndNodes"},
        {HEAD "$Elements\n0\n$EndElements\n", TL_ERR_FORMAT, "$Elements before $Nodes"},
        {HEAD NODES NODES, TL_ERR_FORMAT, "twice"},
        {HEAD NODES "$Elements\n1\n1 1 0 1 3\n$EndElements\n", TL_ERR_FORMAT,
         "element 1 has node 3, which is not there"},
        {HEAD NODES "$Elements\n1\n1 99 0 1 3\n$EndElements\n", TL_ERR_FORMAT, "type 99"},
        {HEAD NODES "$Elements\n99999999\n1 1 0 1 2\n$EndElements\n", TL_ERR_FORMAT,
         "99999999 elements need"},
        {HEAD NODES "$Whatever\n", TL_ERR_FORMAT, "no $EndWhatever"},
        {HEAD "rubbish\n", TL_ERR_FORMAT, "begins with $"},
        {HEAD, TL_ERR_FORMAT, "no $Nodes"},
        {HEAD4 "$Nodes\n1 2 1 2\n3 1 0 3\n1\n2\n3\n0 0 0\n0 0 0\n0 0 0\n$EndNodes\n", TL_ERR_FORMAT,
         "with 3 nodes after 0 of 2"},
        {HEAD4 "$Nodes\n1 2 1 2\n3 1 0 1\n1\n0 0 0\n$EndNodes\n", TL_ERR_FORMAT,
         "1 nodes in all blocks, expected 2"},
        {HEAD4 "$Entities\n9999999999 0 0 0\n", TL_ERR_FORMAT, "9999999999 entities need"},
        {HEAD NODES "$NodeData\n1\n\"a\"\n1\n0\n3\n0\n0\n2\n1 1\n2 1\n$EndNodeData\n",
         TL_ERR_FORMAT, "0 components"},
        {HEAD NODES "$NodeData\n1\n\"a\"\n1\n0\n3\n0\n1\n900000\n1 1\n$EndNodeData\n",
         TL_ERR_FORMAT, "900000 values need"},
    };
    tl_ctx *ctx = grid_ctx((size_t)1 << 20, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        source_case c = {"a.msh", tli_read_gmsh, NULL};
        tli_grid grid;
        CHECK_STATUS(grid_read(ctx, source_read, &c, cases[i].text, strlen(cases[i].text), &grid),
                     cases[i].status);
        check_says(ctx, cases[i].says);
        check_says(ctx, "a.msh");
        tli_grid_release(&grid);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    }
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_variants_are_one_mesh),
        cmocka_unit_test(survives_damage),
        cmocka_unit_test(refusals_name_the_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
