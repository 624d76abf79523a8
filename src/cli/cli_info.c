/* tetralod info: what a file holds, in numbers. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_model.h"
#include "cli_session.h"

/* Regions that are listed one by one. */
#define REGIONS_LISTED 64
/* Named surfaces and times that are listed in text. */
#define LABELS_LISTED 64
#define TIMES_LISTED 16

static const double DEGREES = 57.295779513082323; /* a radian */

typedef struct region_list {
    size_t count; /* of different ids */
    int32_t ids[REGIONS_LISTED];
    size_t tets[REGIONS_LISTED];
} region_list;

static int compare_ids(const void *a, const void *b)
{
    int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

static tl_status count_regions(tl_ctx *ctx, const tl_mesh *mesh, region_list *list)
{
    const int32_t *regions = tl_mesh_regions(mesh);
    size_t tet_count = tl_mesh_tet_count(mesh);
    tl_status st = TL_OK;
    *list = (region_list){0};
    if (!regions || !tet_count) return TL_OK;
    int32_t *sorted = tl_mem_alloc(ctx, tet_count, sizeof *sorted, &st);
    if (st) return st;
    memcpy(sorted, regions, tet_count * sizeof *sorted);
    qsort(sorted, tet_count, sizeof *sorted, compare_ids);
    for (size_t i = 0; i < tet_count; i++) {
        if (i == 0 || sorted[i] != sorted[i - 1]) {
            if (list->count < REGIONS_LISTED) list->ids[list->count] = sorted[i];
            list->count++;
        }
        if (list->count <= REGIONS_LISTED) list->tets[list->count - 1]++;
    }
    tl_mem_free(ctx, sorted);
    return TL_OK;
}

/* ---- JSON ---- */

static void json_channels(json_t *object, const tl_mesh *mesh)
{
    json_t *list = cli_json_list(object, "channels");
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        double range[2];
        size_t nonfinite = 0;
        tl_channel_range(channel, cli_channel_elems(mesh, channel), range, &nonfinite);
        json_t *item = cli_json_item(list);
        cli_json_text(item, "name", channel->name);
        cli_json_count(item, "components", channel->components);
        cli_json_text(item, "on", channel->on == TL_ON_VERTEX ? "vertex" : "tet");
        cli_json_reals(item, "range", range, 2);
        cli_json_text(item, "unit", channel->unit);
        cli_json_count(item, "nonfinite", nonfinite);
    }
}

static void json_regions(json_t *object, const tl_mesh *mesh, const region_list *regions)
{
    size_t listed = regions->count < REGIONS_LISTED ? regions->count : REGIONS_LISTED;
    cli_json_count(object, "region_count", regions->count);
    json_t *list = cli_json_list(object, "regions");
    for (size_t i = 0; i < listed; i++) {
        json_t *item = cli_json_item(list);
        json_object_set_new(item, "id", json_integer(regions->ids[i]));
        cli_json_count(item, "tets", regions->tets[i]);
        const char *name = tl_mesh_region_name(mesh, regions->ids[i]);
        if (name) cli_json_text(item, "name", name);
    }
}

static const char *steps_mesh_name(tl_steps_mesh mesh)
{
    static const char *const names[] = {[TL_STEPS_STATIC] = "static",
                                        [TL_STEPS_MOVING] = "moving",
                                        [TL_STEPS_CHANGING] = "changing"};
    return names[mesh];
}

static void json_steps(json_t *object, const tl_steps *steps)
{
    json_t *item = cli_json_object(object, "steps");
    cli_json_count(item, "count", steps->count);
    cli_json_text(item, "mesh", steps_mesh_name(steps->mesh));
    cli_json_reals(item, "times", steps->times, steps->count);
}

static void json_labels(json_t *object, const tl_mesh *mesh)
{
    json_t *list = cli_json_list(object, "labels");
    for (size_t i = 0; i < tl_mesh_label_count(mesh); i++) {
        const tl_label *label = tl_mesh_label(mesh, i);
        json_t *item = cli_json_item(list);
        cli_json_text(item, "name", label->name);
        json_object_set_new(item, "id", json_integer(label->id));
        cli_json_count(item, "faces", label->face_count);
    }
}

/* null where it is not known */
static void json_size(json_t *object, const char *key, size_t count)
{
    if (count == SIZE_MAX)
        cli_json_real(object, key, (double)NAN);
    else
        cli_json_count(object, key, count);
}

void cli_json_stats(json_t *object, const tl_mesh_stats *stats)
{
    cli_json_reals(object, "bounds", stats->bounds, 6);
    cli_json_real(object, "diagonal", stats->diagonal);
    cli_json_real(object, "volume", stats->volume);
    json_size(object, "boundary_triangles", stats->boundary_triangles);
    cli_json_real(object, "boundary_area", stats->boundary_area);
    json_size(object, "interface_triangles", stats->interface_triangles);
    json_size(object, "components", stats->components);
    json_size(object, "inverted", stats->inverted);
    json_size(object, "degenerate", stats->degenerate);
    json_size(object, "duplicate_vertices", stats->duplicate_verts);
    json_size(object, "nonmanifold_faces", stats->nonmanifold_faces);
    json_size(object, "nonmanifold_edges", stats->nonmanifold_edges);
    json_size(object, "nonmanifold_vertices", stats->nonmanifold_verts);
    cli_json_real(object, "quality_min", stats->quality_min);
    cli_json_real(object, "quality_median", stats->quality_median);
    cli_json_real(object, "dihedral_min", stats->dihedral_min * DEGREES);
    cli_json_real(object, "dihedral_max", stats->dihedral_max * DEGREES);
}

static void print_json(const cli_session *session, const cli_input *input, const tl_steps *steps,
                       const tl_mesh_stats *stats, const region_list *regions)
{
    const tl_mesh *mesh = input->mesh;
    json_t *object = json_object();
    cli_json_text(object, "file", input->path);
    cli_json_count(object, "vertices", tl_mesh_vert_count(mesh));
    cli_json_count(object, "tets", tl_mesh_tet_count(mesh));
    json_t *cells = cli_json_object(object, "cells");
    for (int kind = 0; kind < TL_CELL_KIND_COUNT; kind++)
        if (input->report.cells[kind])
            cli_json_count(cells, tl_cell_kind_name((tl_cell_kind)kind), input->report.cells[kind]);
    cli_json_stats(object, stats);
    cli_json_real(object, "time", tl_mesh_time(mesh));
    json_channels(object, mesh);
    json_regions(object, mesh, regions);
    json_labels(object, mesh);
    json_steps(object, steps);
    cli_json_report(object, input);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

/* ---- text ---- */

static bool any_unit(const tl_mesh *mesh)
{
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++)
        if (*tl_mesh_channel(mesh, i)->unit) return true;
    return false;
}

static tl_status print_channels(tl_ctx *ctx, const tl_mesh *mesh)
{
    size_t count = tl_mesh_channel_count(mesh);
    const bool units = any_unit(mesh);
    cli_table table;
    if (!count) {
        puts("channels    none");
        return TL_OK;
    }
    tl_status st = cli_table_create(ctx, count + 1, units ? 6 : 5, &table);
    if (st) return st;
    cli_table_head(&table, "channel|on|components|range|not finite|unit");
    for (size_t i = 0; i < count; i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        double range[2];
        size_t nonfinite = 0;
        tl_channel_range(channel, cli_channel_elems(mesh, channel), range, &nonfinite);
        cli_table_set(&table, i + 1, 0, cli_name(channel->name));
        cli_table_set(&table, i + 1, 1, cli_name(channel->on == TL_ON_VERTEX ? "vertex" : "tet"));
        cli_table_set(&table, i + 1, 2, cli_count(channel->components));
        cli_table_set(&table, i + 1, 3, cli_range(range));
        cli_table_set(&table, i + 1, 4, cli_count(nonfinite));
        if (units) cli_table_set(&table, i + 1, 5, cli_name(channel->unit));
    }
    putchar('\n');
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    return TL_OK;
}

static void print_cells(const tl_read_report *report)
{
    const char *label = "cells";
    for (int kind = 0; kind < TL_CELL_KIND_COUNT; kind++)
        if (report->cells[kind]) {
            printf("%-10s  %s %s\n", label, cli_count(report->cells[kind]).s,
                   tl_cell_kind_name((tl_cell_kind)kind));
            label = "";
        }
    if (*label) puts("cells       none");
}

static bool is_known(size_t count)
{
    return count != SIZE_MAX;
}

/* Part of a line of counts. */
typedef struct count_part {
    size_t count;
    const char *gap; /* from the part before */
    const char *what;
} count_part;

static void print_counts(const char *label, const count_part *parts, size_t part_count)
{
    bool any = false;
    for (size_t i = 0; i < part_count; i++) {
        if (!is_known(parts[i].count)) continue;
        if (!any) printf("%-10s  ", label);
        printf("%s%s %s", any ? parts[i].gap : "", cli_count(parts[i].count).s, parts[i].what);
        any = true;
    }
    if (any) putchar('\n');
}

/* A model does not keep all of it. */
void cli_print_shape(const tl_mesh_stats *s, double time, uint64_t tet_count)
{
    const count_part validity[] = {{s->inverted, ", ", "inverted"},
                                   {s->degenerate, ", ", "flat tets"},
                                   {s->duplicate_verts, "; ", "vertices at the place of another"}};
    const count_part manifold[] = {{s->nonmanifold_faces, ", ", "non-manifold faces"},
                                   {s->nonmanifold_edges, ", ", "non-manifold edges"},
                                   {s->nonmanifold_verts, ", ", "non-manifold vertices"}};
    printf("bounds      x %s, y %s, z %s; diagonal %s\n", cli_range(s->bounds).s,
           cli_range(s->bounds + 2).s, cli_range(s->bounds + 4).s, cli_real(s->diagonal).s);
    if (isfinite(time)) printf("time        %s\n", cli_real(time).s);
    if (!tet_count) return;
    printf("volume      %s", cli_real(s->volume).s);
    if (is_known(s->components))
        printf(" in %s component%s", cli_count(s->components).s, s->components == 1 ? "" : "s");
    putchar('\n');
    if (is_known(s->boundary_triangles))
        printf("boundary    %s triangles, area %s\n", cli_count(s->boundary_triangles).s,
               cli_real(s->boundary_area).s);
    if (isfinite(s->quality_min))
        printf("quality     mean ratio: smallest %s, median %s; dihedral angles %.1f .. %.1f "
               "degrees\n",
               cli_real(s->quality_min).s, cli_real(s->quality_median).s, s->dihedral_min * DEGREES,
               s->dihedral_max * DEGREES);
    print_counts("validity", validity, 3);
    if (s->nonmanifold_faces || s->nonmanifold_edges || s->nonmanifold_verts)
        print_counts("", manifold, 3);
}

static void print_regions(const tl_mesh *mesh, const tl_mesh_stats *stats,
                          const region_list *regions)
{
    if (!regions->count) return;
    printf("regions     %s, with %s triangles between them:", cli_count(regions->count).s,
           cli_count(stats->interface_triangles).s);
    for (size_t i = 0; i < regions->count && i < REGIONS_LISTED; i++) {
        const char *name = tl_mesh_region_name(mesh, regions->ids[i]);
        printf("%s %d", i ? "," : "", regions->ids[i]);
        if (name) printf(" '%s'", cli_name(name).s);
        printf(" (%s tets)", cli_count(regions->tets[i]).s);
    }
    puts(regions->count > REGIONS_LISTED ? " ..." : "");
}

static void print_labels(const tl_mesh *mesh)
{
    size_t count = tl_mesh_label_count(mesh);
    for (size_t i = 0; i < count && i < LABELS_LISTED; i++) {
        const tl_label *label = tl_mesh_label(mesh, i);
        printf("%-10s  %d '%s': %s triangles\n", i ? "" : "surfaces", label->id,
               cli_name(label->name).s, cli_count(label->face_count).s);
    }
    if (count > LABELS_LISTED) printf("%-10s  and %zu more\n", "", count - LABELS_LISTED);
}

static void print_steps(const tl_steps *steps)
{
    if (steps->count < 2) return;
    const double *times = steps->times;
    printf("steps       %s, 0 to %zu; the mesh is %s\n", cli_count(steps->count).s,
           steps->count - 1, steps_mesh_name(steps->mesh));
    printf("times      ");
    for (size_t i = 0; i < steps->count; i++) {
        if (i == TIMES_LISTED && steps->count > TIMES_LISTED + 1) {
            fputs(" ...", stdout);
            i = steps->count - 1;
        }
        printf(" %s", cli_real(times[i]).s);
    }
    putchar('\n');
}

static tl_status print_text(cli_session *session, const cli_input *input, const tl_steps *steps,
                            const tl_mesh_stats *stats, const region_list *regions)
{
    cli_print_input(session, "read", input);
    print_cells(&input->report);
    cli_print_shape(stats, tl_mesh_time(input->mesh), tl_mesh_tet_count(input->mesh));
    print_steps(steps);
    print_regions(input->mesh, stats, regions);
    print_labels(input->mesh);
    return print_channels(session->ctx, input->mesh);
}

/* ---- the verb ---- */

/* Without tets the box is that of the points. */
static tl_status measure(tl_ctx *ctx, const tl_mesh *mesh, tl_mesh_stats *stats)
{
    memset(stats, 0, sizeof *stats);
    if (tl_mesh_tet_count(mesh)) return tl_mesh_measure(ctx, mesh, stats);
    cli_bounds(mesh, stats->bounds);
    stats->diagonal = cli_diagonal(mesh);
    return TL_OK;
}

static int run(cli_session *session)
{
    cli_input input;
    tl_mesh_stats stats;
    region_list regions;
    tl_read_opts opts;
    tl_steps steps = {0};
    const char *path = session->args.operands[0];
    if (tl_store_is(session->ctx, path)) return cli_info_store(session, path);
    int exit_status = cli_read_opts(session, path, &opts);
    if (!exit_status) exit_status = cli_open_with(session, session->ctx, path, &opts, &input);
    if (exit_status) return exit_status;
    tl_status st = tl_read_steps(session->ctx, path, &opts, &steps);
    if (!st) st = measure(session->ctx, input.mesh, &stats);
    if (!st) st = count_regions(session->ctx, input.mesh, &regions);
    cli_progress_clear(&session->progress);
    if (!st && cli_get(session, CLI_JSON)->given)
        print_json(session, &input, &steps, &stats, &regions);
    else if (!st && cli_loud(session))
        st = print_text(session, &input, &steps, &stats, &regions);
    if (st) exit_status = cli_fail(session, session->ctx, st);
    tl_steps_release(session->ctx, &steps);
    cli_close(&input);
    return exit_status;
}

static const cli_option MODEL[] = {
    {CLI_DETAILS, 0, "details", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "of a model, read the whole index: the RMS error of each level, and what is drawn where the "
     "mesh is finest at one point and as coarse as that allows elsewhere"},
};
static const cli_group MODEL_GROUP = {"Models", MODEL, sizeof MODEL / sizeof *MODEL};

static const char *const EXAMPLES[] = {"tetralod info flow.vtu",
                                       "Cells, box, quality and channels of a file",
                                       "tetralod info neghip.raw --raw 64,64,64,u8",
                                       "The same of a raw volume",
                                       "tetralod info grid.bin --solution q.bin --json",
                                       "PLOT3D, for a script",
                                       "tetralod info flow.tlod",
                                       "Levels, sizes and errors of a model",
                                       NULL};

const cli_verb cli_verb_info = {
    .name = "info",
    .operands = "FILE",
    .operand_least = 1,
    .operand_most = 1,
    .about = "say what a file holds: cells, box, quality, channels with their ranges",
    .details =
        "Bounds are x0 x1 y0 y1 z0 z1. The range of a vector or tensor is that of its norm. A "
        "file without volume cells is listed too; of a model (.tlod) also its levels. In JSON, "
        "dihedral angles are in degrees.",
    .groups = {&MODEL_GROUP, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
