/* What is drawn of a mesh, made and handed to the renderer: volume, surfaces, planes, boundary,
 * edges, patches. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_scene.h"

static const double GREY[3] = {0.74, 0.75, 0.77}, INK[3] = {0.15, 0.15, 0.17};
/* Pixels of the final picture: edges and outlines of shapes. */
static const double EDGE_PX = 1.1, SILHOUETTE_PX = 1.8;
/* Opacity of a boundary around other things. */
static const double GLASS = 0.15;
/* Number of the one part of the cache of edges. */
enum { PART = 0 };
static const char MARKS[] = "patch or level of a tet";

/* Colours of patches, easy to tell apart, none too dark. */
static const uint32_t PALETTE[] = {0x8dd3c7, 0xffe08a, 0xbebada, 0xfb8072, 0x80b1d3, 0xfdb462,
                                   0xb3de69, 0xfccde5, 0xcfcfcf, 0xbc80bd, 0x9fd8a4, 0x6fa8dc};
enum { PALETTE_COUNT = sizeof PALETTE / sizeof *PALETTE };

static double pixels(const cli_scene *scene, double px)
{
    return px * scene->samples;
}

static tl_status keep_polydata(cli_scene *scene, tl_polydata *polydata)
{
    return cli_scene_keep(scene, (cli_kept){.polydata = polydata});
}

/* Gradients of a shade's scalar [vert_count][3], kept. */
static tl_status make_gradients(cli_scene *scene, const cli_shade *shade, double **gradients)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = scene->session->ctx;
    *gradients = tl_mem_alloc(ctx, tl_mesh_vert_count(scene->mesh), 3 * sizeof **gradients, &st);
    if (!st)
        st = tl_mesh_gradient(ctx, scene->mesh, tl_mesh_channel(scene->mesh, shade->channel),
                              *gradients);
    if (!st) return cli_scene_keep(scene, (cli_kept){.block = *gradients});
    tl_mem_free(ctx, *gradients);
    return st;
}

/* The look of polydata whose first channel, if any, is that of a shade. */
static tl_look look_of(const cli_shade *shade, const tl_polydata *polydata)
{
    tl_look look = tl_look_defaults();
    memcpy(look.rgb, GREY, sizeof look.rgb);
    if (shade && polydata->channel_count) {
        look.scalar = polydata->channels[0].values;
        look.transfer = shade->transfer;
    }
    return look;
}

/* ---- volume ---- */

/* The length of the longest gradient. */
static double steepest(const tl_mesh *mesh, const double *gradients)
{
    double most = 0;
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
        const double *g = gradients + 3 * v, length = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
        if (isfinite(length)) most = fmax(most, length);
    }
    return most;
}

static tl_status add_volume(cli_scene *scene)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_volume *volume = NULL;
    double *gradients = NULL;
    const cli_shade *shade = scene->volume_shade;
    tl_volume_opts opts = tl_volume_opts_defaults();
    static const tl_volume_method METHODS[] = {TL_VOLUME_AUTOMATIC, TL_VOLUME_PROJECTED,
                                               TL_VOLUME_RAYS};
    opts.method = METHODS[cli_get(scene->session, CLI_VOLUME_METHOD)->choice];
    opts.lit = cli_get(scene->session, CLI_LIT)->given;
    const cli_value *fade = cli_get(scene->session, CLI_GRADIENT_OPACITY);
    tl_status st = tl_volume_create(ctx, scene->mesh, NULL, &volume);
    if (!st) st = cli_scene_keep(scene, (cli_kept){.volume = volume});
    if (!st && (opts.lit || fade->given)) st = make_gradients(scene, shade, &gradients);
    opts.gradients = gradients;
    if (!st && fade->given)
        opts.gradient_opacity = fade->percent        ? fade->real * steepest(scene->mesh, gradients)
                                : shade->logarithmic ? fade->real
                                                     : fade->real * shade->factor;
    return st ? st
              : tl_renderer_add_volume(ctx, scene->renderer, volume, shade->scalar, shade->transfer,
                                       &opts, NULL);
}

/* ---- surfaces ---- */

static tl_status add_iso(cli_scene *scene, const cli_iso *iso)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_polydata *triangles = NULL;
    double *gradients = NULL;
    const double value = cli_shade_shown(iso->shade, iso->value);
    tl_slice_opts opts = tl_slice_opts_defaults();
    tl_status st = make_gradients(scene, iso->shade, &gradients);
    opts.values = &value;
    opts.value_count = 1;
    opts.gradients = gradients;
    if (scene->color_shade && !iso->has_color) {
        opts.channels = &scene->color_shade->channel;
        opts.channel_count = 1;
    }
    if (!st) st = tl_slice_mesh(ctx, scene->mesh, iso->shade->scalar, &opts, &triangles);
    if (!st) st = keep_polydata(scene, triangles);
    if (st) return st;
    if (!triangles->cell_count)
        tl_log(ctx, TL_LOG_INFO, "the surface %s = %g is empty", iso->shade->name, iso->value);
    tl_look look = look_of(scene->color_shade, triangles);
    look.opacity = iso->opacity;
    if (iso->has_color)
        memcpy(look.rgb, iso->rgb, sizeof look.rgb);
    else if (!look.scalar) {
        float rgb[3];
        double extinction;
        tl_transfer_at(iso->shade->transfer, value, rgb, &extinction);
        for (int k = 0; k < 3; k++) look.rgb[k] = (double)rgb[k];
    }
    return tl_renderer_add_surface(ctx, scene->renderer, triangles, &look, NULL);
}

/* Planes show values, unlit: a colour on the picture is one of the bar. */
static tl_status add_slice(cli_scene *scene, const double plane[6])
{
    tl_status st = TL_OK;
    tl_ctx *ctx = scene->session->ctx;
    tl_polydata *triangles = NULL;
    const double value = 0;
    double *distance = tl_mem_alloc(ctx, tl_mesh_vert_count(scene->mesh), sizeof *distance, &st);
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = &value;
    opts.value_count = 1;
    if (scene->color_shade) {
        opts.channels = &scene->color_shade->channel;
        opts.channel_count = 1;
    }
    if (!st) st = tl_plane_distance(ctx, scene->mesh, plane, plane + 3, distance);
    if (!st) st = tl_slice_mesh(ctx, scene->mesh, distance, &opts, &triangles);
    tl_mem_free(ctx, distance);
    if (!st) st = keep_polydata(scene, triangles);
    if (st) return st;
    if (!triangles->cell_count) tl_log(ctx, TL_LOG_INFO, "a plane beside the mesh shows nothing");
    tl_look look = look_of(scene->color_shade, triangles);
    look.lit = !look.scalar;
    return tl_renderer_add_surface(ctx, scene->renderer, triangles, &look, NULL);
}

/* Glass without colours where other things lie inside. */
static tl_status add_boundary(cli_scene *scene)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_polydata *triangles = NULL;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    const bool is_glass = scene->volume_shade || scene->iso_count || scene->slice_count ||
                          scene->points_shade || scene->lines.name[0];
    opts.regions = false;
    if (scene->color_shade && !is_glass) {
        opts.channels = &scene->color_shade->channel;
        opts.channel_count = 1;
    }
    tl_status st = tl_boundary_surface(ctx, scene->mesh, NULL, &opts, &triangles);
    if (!st) st = keep_polydata(scene, triangles);
    if (st) return st;
    tl_look look = look_of(scene->color_shade, triangles);
    look.specular = look.scalar ? 0.05 : look.specular;
    if (is_glass) look.opacity = GLASS;
    return tl_renderer_add_surface(ctx, scene->renderer, triangles, &look, NULL);
}

/* ---- edges ---- */

static tl_status fill_edges(cli_scene *scene)
{
    tl_ctx *ctx = scene->session->ctx;
    if (scene->edge_cache) return TL_OK;
    tl_status st = tl_edges_create(ctx, &scene->edge_cache);
    return st ? st : tl_edges_add_mesh(ctx, scene->edge_cache, PART, scene->mesh, NULL);
}

static tl_status add_lines(cli_scene *scene, tl_edges *edges, const tl_edges_opts *opts,
                           double width_px, tl_item *item)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_polydata *lines = NULL;
    tl_line_opts shape = tl_line_opts_defaults();
    tl_look look = tl_look_defaults();
    tl_status st = tl_edges_lines(ctx, edges, opts, &lines);
    if (!st) st = keep_polydata(scene, lines);
    shape.shape = TL_LINE_FLAT;
    shape.width_px = pixels(scene, width_px);
    memcpy(look.rgb, INK, sizeof look.rgb);
    look.lit = false;
    return st ? st : tl_renderer_add_lines(ctx, scene->renderer, lines, &look, &shape, item);
}

static tl_status add_edges(cli_scene *scene)
{
    tl_edges_opts opts = tl_edges_opts_defaults();
    tl_status st = fill_edges(scene);
    return st ? st : add_lines(scene, scene->edge_cache, &opts, EDGE_PX, NULL);
}

tl_status cli_things_silhouettes(cli_scene *scene, const tl_camera *camera)
{
    tl_edges_opts opts = tl_edges_opts_defaults();
    opts.kinds = TL_EDGE_SILHOUETTE;
    opts.camera = camera;
    tl_status st = fill_edges(scene);
    tl_renderer_remove(scene->session->ctx, scene->renderer, scene->silhouette_item);
    scene->silhouette_item = 0;
    return st ? st
              : add_lines(scene, scene->edge_cache, &opts, SILHOUETTE_PX, &scene->silhouette_item);
}

/* ---- patches ---- */

static int by_number(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Of each tet of a cut's mesh the place of its patch, or its level: the mesh has the patches one
 * after another, by number. Adds it as a channel on tets. *most: at least 0, the largest. */
static tl_status mark_tets(cli_scene *scene, tl_mesh *mesh, double *most)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = scene->session->ctx;
    size_t count, tet = 0;
    const uint32_t *drawn = tl_cut_patches(scene->volume.cut, &count);
    uint32_t *numbers = tl_mem_alloc(ctx, count, sizeof *numbers, &st);
    double *of_tet = tl_mem_alloc(ctx, tl_mesh_tet_count(mesh), sizeof *of_tet, &st);
    if (!st) memcpy(numbers, drawn, count * sizeof *numbers);
    if (!st) qsort(numbers, count, sizeof *numbers, by_number);
    for (size_t i = 0; !st && i < count; i++) {
        tl_patch_info info;
        st = tl_store_patch(ctx, scene->volume.store, numbers[i], &info);
        const double mark = scene->levels ? (double)(st ? 0 : info.level) : (double)i;
        *most = fmax(*most, mark);
        for (uint32_t t = 0; !st && t < info.tet_count; t++) of_tet[tet++] = mark;
    }
    const tl_channel marks = {
        .name = MARKS, .components = 1, .on = TL_ON_TET, .scalar = TL_F64, .values = of_tet};
    if (!st) st = tl_mesh_adopt_channel(mesh, &marks);
    if (st) tl_mem_free(ctx, of_tet);
    tl_mem_free(ctx, numbers);
    return st;
}

/* Levels by a colour map, the finest brightest; patches by turns of the palette. */
static tl_status mark_colors(cli_scene *scene, double most, tl_transfer **transfer)
{
    tl_color_point colors[2 * PALETTE_COUNT];
    const tl_opacity_point solid = {0, 1};
    const size_t count =
        scene->levels && most < PALETTE_COUNT ? (size_t)most + 1 : (size_t)PALETTE_COUNT;
    size_t map_count;
    const tl_color_point *map = tl_colormap("plasma", &map_count);
    for (size_t i = 0; i < count; i++) {
        const size_t at = (count - i) * (map_count - 1) / count; /* none as dark as it can be */
        for (size_t side = 0; side < 2; side++) {
            tl_color_point *p = &colors[2 * i + side];
            p->value = (double)i + (double)side - 0.5;
            for (int k = 0; k < 3; k++)
                p->rgb[k] =
                    scene->levels ? map[at].rgb[k] : (PALETTE[i] >> (16 - 8 * k) & 255) / 255.0;
        }
    }
    return tl_transfer_create(scene->session->ctx, colors, 2 * count, &solid, 1, 1, transfer);
}

/* The borders between patches on the boundary. */
static tl_status add_patch_borders(cli_scene *scene, const tl_mesh *mesh, const double *of_tet)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_lidx *triangles = NULL, *faces = NULL;
    size_t count = 0;
    tl_edges *edges = NULL;
    tl_edges_opts opts = tl_edges_opts_defaults();
    tl_status st = tl_mesh_boundary(ctx, mesh, NULL, &triangles, &faces, &count);
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
    if (!st) st = add_lines(scene, edges, &opts, EDGE_PX, NULL);
    tl_edges_destroy(ctx, edges);
    tl_mem_free(ctx, regions);
    tl_mem_free(ctx, faces);
    tl_mem_free(ctx, triangles);
    return st;
}

static tl_status add_marked_surface(cli_scene *scene, const tl_mesh *mesh, size_t channel)
{
    tl_ctx *ctx = scene->session->ctx;
    tl_polydata *triangles = NULL;
    tl_boundary_opts opts = tl_boundary_opts_defaults();
    opts.channels = &channel;
    opts.channel_count = 1;
    opts.regions = false;
    tl_status st = tl_boundary_surface(ctx, mesh, NULL, &opts, &triangles);
    if (!st) st = keep_polydata(scene, triangles);
    if (st) return st;
    double *values = (double *)(uintptr_t)triangles->channels[0].values;
    for (size_t v = 0; v < triangles->vert_count; v++) values[v] = fmod(values[v], PALETTE_COUNT);
    tl_look look = tl_look_defaults();
    look.scalar = values;
    look.transfer = scene->mark_transfer;
    look.specular = 0;
    return tl_renderer_add_surface(ctx, scene->renderer, triangles, &look, NULL);
}

/* The boundary in the colours of patches or levels. Words that choose a part of the mesh choose it
 * after the tets are marked. */
static tl_status add_marks(cli_scene *scene)
{
    tl_mesh *mesh = NULL;
    double most = 0;
    size_t channel = 0;
    tl_status st =
        tl_cut_mesh(scene->volume.cut, scene->volume.channels, scene->volume.channel_count, &mesh);
    if (!st) st = mark_tets(scene, mesh, &most);
    if (!st && cli_derive(scene->session, scene->volume.bounds, &mesh)) st = TL_ERR_ARG;
    if (!st && !scene->mark_transfer) st = mark_colors(scene, most, &scene->mark_transfer);
    while (!st && strcmp(tl_mesh_channel(mesh, channel)->name, MARKS) != 0) channel++;
    if (!st) st = add_patch_borders(scene, mesh, tl_mesh_channel(mesh, channel)->values);
    if (!st) st = add_marked_surface(scene, mesh, channel);
    tl_mesh_destroy(mesh);
    return st;
}

tl_status cli_things_add(cli_scene *scene)
{
    tl_status st = TL_OK;
    if (scene->volume_shade) st = add_volume(scene);
    for (size_t i = 0; !st && i < scene->iso_count; i++) st = add_iso(scene, &scene->isos[i]);
    for (size_t i = 0; !st && i < scene->slice_count; i++) st = add_slice(scene, scene->slices[i]);
    if (!st && (scene->patches || scene->levels)) st = add_marks(scene);
    if (!st && scene->boundary) st = add_boundary(scene);
    if (!st && scene->edges) st = add_edges(scene);
    if (!st && scene->points_shade) st = cli_swarm_add_points(scene);
    return st;
}
