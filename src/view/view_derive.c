/* What a scene makes of a mesh before it is looked at: channels of expressions, and the part of it
 * that thresholds, regions and planes choose. */

#include <math.h>
#include <stdio.h>

#include "formats/formats_number.h"
#include "view/view.h"

enum { SIDES_MAX = 64, REGIONS_MAX = 256, NAME_BYTES = 512 };

/* ---- what is asked for ---- */

static bool changes_mesh(const tl_scene *scene, tl_node node)
{
    const tl_node_kind kind = tl_scene_kind(scene, node);
    return kind == TL_NODE_DERIVE || ((kind == TL_NODE_CLIP || kind == TL_NODE_THRESHOLD) &&
                                      tl_scene_flag(scene, node, "on"));
}

static const char *regions_of(const tl_scene *scene, bool hide)
{
    return tl_scene_text(scene, TL_NODE_DATA + 1, hide ? "hide_regions" : "regions");
}

bool tli_chooses(const tl_scene *scene)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    for (size_t i = 0; i < count; i++)
        if (tl_scene_kind(scene, nodes[i]) != TL_NODE_DERIVE && changes_mesh(scene, nodes[i]))
            return true;
    return *regions_of(scene, false) || *regions_of(scene, true);
}

static bool has_formulas(const tl_scene *scene)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    for (size_t i = 0; i < count; i++)
        if (tl_scene_kind(scene, nodes[i]) == TL_NODE_DERIVE) return true;
    return false;
}

bool tli_derives(const tl_scene *scene)
{
    return has_formulas(scene) || tli_chooses(scene);
}

/* Of the nodes that derive channels, or those that choose. */
static tli_recipe nodes_recipe(tli_recipe recipe, const tl_scene *scene, bool derive)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    for (size_t i = 0; i < count; i++)
        if (changes_mesh(scene, nodes[i]) &&
            (tl_scene_kind(scene, nodes[i]) == TL_NODE_DERIVE) == derive)
            recipe = tli_recipe_count(recipe, tl_scene_node_version(scene, nodes[i]));
    return recipe;
}

tli_recipe tli_formula_recipe(tli_recipe recipe, const tl_scene *scene)
{
    return nodes_recipe(recipe, scene, true);
}

tli_recipe tli_choice_recipe(tli_recipe recipe, const tl_scene *scene)
{
    if (!tli_chooses(scene)) return recipe;
    for (int hide = 0; hide < 2; hide++)
        recipe = tli_recipe_text(recipe, regions_of(scene, hide != 0));
    return nodes_recipe(recipe, scene, false);
}

tli_recipe tli_derive_recipe(tli_recipe recipe, const tl_scene *scene)
{
    return tli_choice_recipe(tli_formula_recipe(recipe, scene), scene);
}

/* ---- channels ---- */

/* NAME=EXPRESSION, which may have an = of its own. */
static tl_status add_channel(tl_ctx *ctx, const tl_scene *scene, tl_node node, tl_mesh *mesh)
{
    char name[NAME_BYTES];
    const char *text = tl_scene_text(scene, node, "text"), *equals = strchr(text, '=');
    if (!*text) return TL_OK;
    if (!equals || equals == text || (size_t)(equals - text) >= sizeof name)
        return tl_fail(ctx, TL_ERR_ARG, "%s.text: expected NAME=EXPRESSION, not '%s'",
                       tl_scene_name(scene, node), text);
    memcpy(name, text, (size_t)(equals - text));
    name[equals - text] = '\0';
    tl_status st = tl_mesh_derive(ctx, mesh, name, equals + 1);
    if (!st) return TL_OK;
    char said[512];
    snprintf(said, sizeof said, "%s", tl_ctx_message(ctx));
    if (st == TL_ERR_ARG && strstr(said, "no channel")) {
        tli_unknown_channel(ctx, mesh, name);
        char list[2200];
        const char *line = strchr(tl_ctx_message(ctx), '\n');
        snprintf(list, sizeof list, "%s", line ? line + 1 : "");
        tl_fail(ctx, st, "%s", said);
        tl_note(ctx, st, "%s", list);
    }
    return tl_note(ctx, st, "in the derived channel '%s'", name);
}

/* ---- thresholds ---- */

static tl_status keep_range(tl_ctx *ctx, const tl_scene *scene, tl_node node, const tl_mesh *mesh,
                            uint8_t *keep)
{
    tl_value low, high;
    const char *name = tl_scene_text(scene, node, "channel");
    const tl_channel *channel = tl_mesh_channel_by_name(mesh, name);
    if (!*name) return TL_OK;
    if (!channel) return tli_unknown_channel(ctx, mesh, name);
    tl_status st = tl_scene_get(ctx, scene, node, "low", &low);
    if (!st) st = tl_scene_get(ctx, scene, node, "high", &high);
    if (st) return st;
    const double least = low.count ? low.reals[0] : -(double)INFINITY;
    const double most = high.count ? high.reals[0] : (double)INFINITY;
    const bool had_any = memchr(keep, 1, tl_mesh_tet_count(mesh)) != NULL;
    st = tl_keep_range(ctx, mesh, channel, least, most, false, keep);
    if (st || !had_any || memchr(keep, 1, tl_mesh_tet_count(mesh))) return st;
    double range[2];
    tli_extremes(mesh, channel, false, range);
    return tl_fail(ctx, TL_ERR_DATA,
                   "nothing is left of the mesh by %s: no tet is within %g and %g, '%s' goes from "
                   "%g to %g",
                   tl_scene_name(scene, node), least, most, name, range[0], range[1]);
}

/* ---- regions ---- */

static bool has_region(const tl_mesh *mesh, int32_t region)
{
    const int32_t *regions = tl_mesh_regions(mesh);
    if (!regions) return region == 0;
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++)
        if (regions[t] == region) return true;
    return false;
}

/* By number, or by the name of one that tets have. */
static bool find_region(const tl_mesh *mesh, const char *text, int32_t *region)
{
    double number = 0;
    const char *end = text + strlen(text);
    const int32_t *regions = tl_mesh_regions(mesh);
    if (tli_number_f64(text, end, &number) == end && number >= INT32_MIN && number <= INT32_MAX &&
        number == floor(number)) {
        *region = (int32_t)number;
        return has_region(mesh, *region);
    }
    int32_t last = 0;
    for (size_t t = 0; regions && t < tl_mesh_tet_count(mesh); t++) {
        if (t && regions[t] == last) continue;
        last = regions[t];
        const char *name = tl_mesh_region_name(mesh, last);
        if (name && strcmp(name, text) == 0) {
            *region = last;
            return true;
        }
    }
    return false;
}

/* Those that tets have, each when it first comes up. */
static tl_status unknown_region(tl_ctx *ctx, const tl_mesh *mesh, const char *name)
{
    enum { LISTED = 64 };
    int32_t seen[LISTED];
    char list[2048] = "";
    size_t count = 0, at = 0;
    const int32_t *regions = tl_mesh_regions(mesh);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh) && count < LISTED && at < sizeof list; t++) {
        const int32_t region = regions ? regions[t] : 0;
        size_t i = 0;
        while (i < count && seen[i] != region) i++;
        if (i < count) continue;
        const char *own = tl_mesh_region_name(mesh, region);
        seen[count++] = region;
        const int n = snprintf(list + at, sizeof list - at, own ? " %d '%s'" : " %d", (int)region,
                               own ? own : "");
        at += n > 0 ? (size_t)n : 0;
    }
    tl_fail(ctx, TL_ERR_ARG, "there is no region '%s'", name);
    return tl_note(ctx, TL_ERR_ARG, "regions:%s%s", list, count == LISTED ? " ..." : "");
}

static tl_status keep_regions(tl_ctx *ctx, const tl_mesh *mesh, const char *text, bool hide,
                              uint8_t *keep)
{
    int32_t regions[REGIONS_MAX];
    size_t count = 0;
    while (*text) {
        char name[NAME_BYTES];
        const char *first = text + strspn(text, " ");
        const size_t length = strcspn(text, ",");
        size_t own = strcspn(first, ","); /* without blanks around it */
        while (own && first[own - 1] == ' ') own--;
        snprintf(name, sizeof name, "%.*s", (int)own, first);
        text += length + (text[length] == ',');
        if (count == REGIONS_MAX)
            return tl_fail(ctx, TL_ERR_ARG, "more than %d regions", REGIONS_MAX);
        if (!find_region(mesh, name, &regions[count++])) return unknown_region(ctx, mesh, name);
    }
    return count ? tl_keep_regions(ctx, mesh, regions, count, hide, keep) : TL_OK;
}

/* ---- all of it ---- */

static bool has_thresholds(const tl_scene *scene)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    for (size_t i = 0; i < count; i++)
        if (tl_scene_kind(scene, nodes[i]) == TL_NODE_THRESHOLD && changes_mesh(scene, nodes[i]))
            return true;
    return *regions_of(scene, false) || *regions_of(scene, true);
}

/* Gives *part; NULL: all of it. */
static tl_status choose_tets(tl_ctx *ctx, const tl_scene *scene, const tl_mesh *mesh,
                             tl_mesh **part)
{
    tl_status st = TL_OK;
    size_t node_count;
    const tl_node *nodes = tl_scene_nodes(scene, &node_count);
    const size_t count = tl_mesh_tet_count(mesh);
    *part = NULL;
    if (!has_thresholds(scene)) return TL_OK;
    uint8_t *keep = tl_mem_alloc(ctx, count, 1, &st);
    if (st) return st;
    memset(keep, 1, count);
    for (int hide = 0; !st && hide < 2; hide++)
        st = keep_regions(ctx, mesh, regions_of(scene, hide != 0), hide != 0, keep);
    for (size_t i = 0; !st && i < node_count; i++)
        if (tl_scene_kind(scene, nodes[i]) == TL_NODE_THRESHOLD && changes_mesh(scene, nodes[i]))
            st = keep_range(ctx, scene, nodes[i], mesh, keep);
    if (!st) st = tl_mesh_subset(ctx, mesh, keep, part);
    tl_mem_free(ctx, keep);
    return st;
}

/* What lies beyond a plane, where its normal looks to, is cut away. Gives *part; NULL: all of it.
 */
static tl_status clip(tl_ctx *ctx, const tl_scene *scene, const tl_mesh *mesh, tl_mesh **part)
{
    tl_half_space sides[SIDES_MAX];
    size_t count = 0, node_count;
    const tl_node *nodes = tl_scene_nodes(scene, &node_count);
    *part = NULL;
    for (size_t i = 0; i < node_count; i++) {
        double plane[6];
        if (tl_scene_kind(scene, nodes[i]) != TL_NODE_CLIP || !changes_mesh(scene, nodes[i]))
            continue;
        if (count == SIDES_MAX)
            return tl_fail(ctx, TL_ERR_ARG, "more than %d planes that clip", SIDES_MAX);
        tl_scene_plane(scene, nodes[i], "plane", plane);
        memcpy(sides[count].normal, plane + 3, sizeof sides[count].normal);
        sides[count++].offset = plane[0] * plane[3] + plane[1] * plane[4] + plane[2] * plane[5];
    }
    return count ? tl_mesh_clip(ctx, mesh, sides, count, part) : TL_OK;
}

/* Gives *part; NULL: all of it. */
static tl_status choose(tl_ctx *ctx, const tl_scene *scene, const tl_mesh *mesh, tl_mesh **part)
{
    tl_mesh *clipped = NULL;
    tl_status st = choose_tets(ctx, scene, mesh, part);
    if (!st) st = clip(ctx, scene, *part ? *part : mesh, &clipped);
    if (clipped) {
        tl_mesh_destroy(*part);
        *part = clipped;
    }
    if (!st && *part && !tl_mesh_tet_count(*part))
        st = tl_fail(ctx, TL_ERR_DATA,
                     "nothing is left of the mesh by thresholds, regions and planes");
    if (st) {
        tl_mesh_destroy(*part);
        *part = NULL;
    }
    return st;
}

/* ---- all of it ---- */

/* Of each tet the number of its run, as a channel that goes where the tets go. */
static tl_status mark(tl_ctx *ctx, const tli_body *from, tl_mesh *mesh)
{
    tl_status st = TL_OK;
    double *marks = tl_mem_alloc(ctx, tl_mesh_tet_count(mesh), sizeof *marks, &st);
    size_t tet = 0;
    for (size_t i = 0; !st && i < from->run_count; i++)
        for (uint32_t t = 0; t < from->runs[i].tets; t++) marks[tet++] = (double)i;
    const tl_channel channel = {
        .name = TLI_MARKS, .components = 1, .on = TL_ON_TET, .scalar = TL_F64, .values = marks};
    if (!st) st = tl_mesh_adopt_channel(mesh, &channel);
    if (st) tl_mem_free(ctx, marks);
    return st;
}

static tl_status copy_runs(tl_ctx *ctx, const tli_body *from, tli_body *body)
{
    tl_status st = TL_OK;
    const size_t errors = from->run_count * from->error_count;
    body->runs = tl_mem_alloc(ctx, from->run_count, sizeof *body->runs, &st);
    body->run_errors = tl_mem_alloc(ctx, errors, sizeof *body->run_errors, &st);
    if (st) return st;
    if (from->run_count) memcpy(body->runs, from->runs, from->run_count * sizeof *body->runs);
    if (errors) memcpy(body->run_errors, from->run_errors, errors * sizeof *body->run_errors);
    body->run_count = from->run_count;
    body->error_count = from->error_count;
    return TL_OK;
}

tl_status tli_derive_channels(tl_ctx *ctx, const tl_scene *scene, tli_body *from, tli_body **whole)
{
    size_t count;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    tl_status st = tli_body_borrow(ctx, from, tli_formula_recipe(from->recipe, scene), whole);
    if (st) return st;
    for (size_t i = 0; !st && i < count; i++)
        if (tl_scene_kind(scene, nodes[i]) == TL_NODE_DERIVE)
            st = add_channel(ctx, scene, nodes[i], (*whole)->mesh);
    if (!st) st = copy_runs(ctx, from, *whole);
    if (st) {
        tli_body_release(*whole);
        *whole = NULL;
    }
    return st;
}

tl_status tli_choose(tl_ctx *ctx, const tl_scene *scene, tli_body *whole, tli_body **part)
{
    tli_body *marked = NULL;
    tl_mesh *mesh = NULL;
    const tli_recipe recipe = tli_choice_recipe(whole->recipe, scene);
    *part = NULL;
    if (!tli_chooses(scene)) {
        *part = tli_body_use(whole);
        return TL_OK;
    }
    tl_status st = tli_body_borrow(ctx, whole, recipe, &marked);
    if (!st) st = copy_runs(ctx, whole, marked);
    if (!st && whole->run_count) st = mark(ctx, whole, marked->mesh);
    if (!st) st = choose(ctx, scene, marked->mesh, &mesh);
    if (!st && mesh) {
        st = tli_body_create(ctx, mesh, recipe, part);
        if (st)
            tl_mesh_destroy(mesh);
        else
            st = copy_runs(ctx, whole, *part);
    } else if (!st) {
        *part = tli_body_use(marked);
    }
    if (!st) (*part)->whole_tets = tl_mesh_tet_count(whole->mesh);
    tli_body_release(marked);
    if (st) {
        tli_body_release(*part);
        *part = NULL;
    }
    return st;
}

tl_status tli_derive(tl_ctx *ctx, const tl_scene *scene, tli_body *from, tli_body **derived)
{
    tli_body *whole;
    *derived = NULL;
    if (!has_formulas(scene)) return tli_choose(ctx, scene, from, derived);
    tl_status st = tli_derive_channels(ctx, scene, from, &whole);
    if (st) return st;
    st = tli_choose(ctx, scene, whole, derived);
    tli_body_release(whole);
    return st;
}
