/* The boundary of a model's mesh in the colours of its patches or levels of detail, with the
 * borders between patches as lines. */
#include <math.h>

#include "view/view.h"

/* Pixels of the final picture: borders of patches. */
static const double BORDER_PX = 1.1;
/* Number of the one part of edges. */
enum { PART = 0, LEVELS = 2 };

/* Colours of patches, easy to tell apart, none too dark. */
static const uint32_t PALETTE[] = {0x8dd3c7, 0xffe08a, 0xbebada, 0xfb8072, 0x80b1d3, 0xfdb462,
                                   0xb3de69, 0xfccde5, 0xcfcfcf, 0xbc80bd, 0x9fd8a4, 0x6fa8dc};
enum { PALETTE_COUNT = sizeof PALETTE / sizeof *PALETTE };

/* Of each tet of the body the place of its patch, or its level. Fills of_tet; *most: at least 0,
 * the largest. */
static void mark_tets(const tli_body *body, bool levels, double *of_tet, double *most)
{
    const tl_channel *marks = tl_mesh_channel_by_name(body->mesh, TLI_MARKS);
    const size_t count = tl_mesh_tet_count(body->mesh);
    size_t run = 0, left = body->run_count ? body->runs[0].tets : 0;
    for (size_t t = 0; t < count; t++) {
        if (marks) { /* parts were chosen: tets are no more one after another */
            run = (size_t)marks->values[t];
        } else {
            while (!left && run + 1 < body->run_count) left = body->runs[++run].tets;
            left--;
        }
        of_tet[t] = levels ? (double)body->runs[run].level : (double)run;
        *most = fmax(*most, of_tet[t]);
    }
}

/* The largest mark of the whole cut. */
static double most_of(const tli_body *body, bool levels)
{
    double most = levels || !body->run_count ? 0 : (double)body->run_count - 1;
    for (size_t i = 0; levels && i < body->run_count; i++)
        most = fmax(most, (double)body->runs[i].level);
    return most;
}

/* Levels by a colour map, the finest brightest; patches by turns of the palette. */
static tl_status mark_colors(tl_ctx *ctx, bool levels, double most, tl_transfer **transfer)
{
    tl_color_point colors[2 * PALETTE_COUNT];
    const tl_opacity_point solid = {0, 1};
    const size_t count = levels && most < PALETTE_COUNT ? (size_t)most + 1 : (size_t)PALETTE_COUNT;
    size_t map_count;
    const tl_color_point *map = tl_colormap("plasma", &map_count);
    for (size_t i = 0; i < count; i++) {
        const size_t at = (count - i) * (map_count - 1) / count; /* none as dark as it can be */
        for (size_t side = 0; side < 2; side++) {
            tl_color_point *p = &colors[2 * i + side];
            p->value = (double)i + (double)side - 0.5;
            for (int k = 0; k < 3; k++)
                p->rgb[k] = levels ? map[at].rgb[k] : (PALETTE[i] >> (16 - 8 * k) & 255) / 255.0;
        }
    }
    return tl_transfer_create(ctx, colors, 2 * count, &solid, 1, 1, transfer);
}

/* The borders between patches on the boundary. */
static tl_status make_borders(tli_maker *m, const double *of_tet, tl_polydata **lines)
{
    tl_ctx *ctx = m->ctx;
    tl_lidx *triangles = NULL, *faces = NULL;
    size_t count = 0;
    tl_edges *edges = NULL;
    const tl_lidx *opposite;
    const tl_mesh *mesh = m->body->mesh;
    tl_edges_opts opts = tl_edges_opts_defaults();
    tl_status st = tli_body_opposite(ctx, m->body, &opposite);
    if (!st) st = tl_mesh_boundary(ctx, mesh, opposite, &triangles, &faces, &count);
    int32_t *regions = tl_mem_alloc(ctx, count, sizeof *regions, &st);
    for (size_t i = 0; !st && i < count; i++) regions[i] = (int32_t)of_tet[faces[i] / 4];
    if (!st) st = tl_edges_create(ctx, &edges);
    const tl_edges_part part = {.xyz = tl_mesh_xyz(mesh),
                                .vert_count = tl_mesh_vert_count(mesh),
                                .triangles = triangles,
                                .triangle_count = count,
                                .regions = regions};
    opts.kinds = TL_EDGE_REGION;
    if (!st) st = tl_edges_add(ctx, edges, PART, &part);
    if (!st) st = tl_edges_lines(ctx, edges, &opts, lines);
    tl_edges_destroy(ctx, edges);
    tl_mem_free(ctx, regions);
    tl_mem_free(ctx, faces);
    tl_mem_free(ctx, triangles);
    return st;
}

/* With the marks as the only channel, by turns of the palette. */
static tl_status make_surface(tli_maker *m, const double *of_tet, tl_polydata **triangles)
{
    tli_dressed dressed;
    const tl_lidx *opposite;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    tl_status st = tli_body_opposite(m->ctx, m->body, &opposite);
    const tli_scalar marks = {.on = TL_ON_TET, .values = of_tet};
    tli_body_dress(m->body, &marks, &dressed);
    opts.channels = &dressed.first;
    opts.channel_count = 1;
    opts.regions = false;
    if (!st) st = tl_boundary_surface(m->ctx, &dressed.mesh, opposite, &opts, triangles);
    if (st) return st;
    double *values = (double *)(uintptr_t)(*triangles)->channels[0].values;
    for (size_t v = 0; v < (*triangles)->vert_count; v++)
        values[v] = fmod(values[v], PALETTE_COUNT);
    return TL_OK;
}

static tl_status make_shape(tli_maker *m, bool levels, tli_recipe recipe, const tli_shape **shape)
{
    tl_status st = TL_OK;
    double most = 0;
    tl_polydata *triangles = NULL, *lines = NULL;
    double *of_tet = tl_mem_alloc(m->ctx, tl_mesh_tet_count(m->body->mesh), sizeof *of_tet, &st);
    if (!st) mark_tets(m->body, levels, of_tet, &most);
    if (!st) st = make_surface(m, of_tet, &triangles);
    if (!st) st = make_borders(m, of_tet, &lines);
    tl_mem_free(m->ctx, of_tet);
    if (!st) return tli_maker_keep(m, recipe, triangles, lines, shape);
    tl_polydata_destroy(m->ctx, triangles);
    return st;
}

tl_status tli_make_marks(tli_maker *maker, const tli_entry *entry)
{
    tl_status st = TL_OK;
    const tl_scene *scene = maker->agenda->scene;
    const bool levels = tl_scene_real(scene, entry->node, "mark") == LEVELS;
    const double opacity = tl_scene_real(scene, entry->node, "opacity");
    if (!maker->body->run_count)
        return tl_fail(maker->ctx, TL_ERR_ARG, "%s.mark: '%s' is no model, it has no patches",
                       tl_scene_name(scene, entry->node),
                       tl_source_get_facts(maker->view->source)->name);
    const tli_recipe recipe = tli_recipe_count(tli_maker_recipe(maker, entry), levels ? 2 : 1);
    const tli_shape *shape = tli_maker_find(maker, recipe, &st);
    if (!st && !shape) st = make_shape(maker, levels, recipe, &shape);
    tl_transfer **colors = &maker->content->marks[levels];
    if (!st && !*colors) st = mark_colors(maker->ctx, levels, most_of(maker->body, levels), colors);
    if (st) return st;
    const tli_recipe version = tli_recipe_count(recipe, tl_scene_node_version(scene, entry->node));
    tli_thing borders = tli_flat_lines(shape->parts[1], tli_ink, BORDER_PX);
    borders.recipe = tli_recipe_count(version, 1);
    st = tli_maker_add(maker, &borders);
    tli_thing surface = {.kind = TLI_THING_TRIANGLES,
                         .recipe = tli_recipe_count(version, 2),
                         .polydata = shape->parts[0],
                         .look = tl_look_defaults()};
    surface.look.scalar = surface.polydata->channels[0].values;
    surface.look.transfer = *colors;
    surface.look.specular = 0;
    if (opacity >= 0) surface.look.opacity = opacity;
    return st ? st : tli_maker_add(maker, &surface);
}
