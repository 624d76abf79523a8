/* First looks: which channel promises most, and what shows it; histograms. */
#include <math.h>
#include <stdio.h>

#include "view/view.h"

/* Parts whose volume is less than this part of their box, or of a ball with their surface, are
 * solids rather than rooms: a first look shows them from outside. */
static const double FILL_LEAST = 0.3, ROUND_LEAST = 0.35;
/* What a channel has to vary by, relative to its largest value: less is rounding. */
static const double VARIES_LEAST = 1e-9;

/* ---- the most promising channel ---- */

/* How much a channel promises to show: 0 nothing (one value), 1 little (numbers of elements,
 * places). */
static int interest(const tl_mesh *mesh, const tl_channel *channel)
{
    static const char *const PLAIN[] = {"id",         "ids",         "material", "region",
                                        "coordinate", "coordinates", "block",    "rank"};
    double range[2];
    size_t nonfinite;
    char name[64] = "";
    const bool on_verts = channel->on == TL_ON_VERTEX;
    const size_t count = on_verts ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh);
    if (strcmp(channel->name, TLI_MARKS) == 0) return -1;
    tl_channel_range(channel, count, range, &nonfinite);
    if (!(range[1] - range[0] > VARIES_LEAST * fmax(fabs(range[0]), fabs(range[1])))) return 0;
    for (size_t i = 0; channel->name[i] && i + 1 < sizeof name; i++)
        name[i] = (char)(channel->name[i] >= 'A' && channel->name[i] <= 'Z' ? channel->name[i] + 32
                                                                            : channel->name[i]);
    for (size_t i = 0; i < sizeof PLAIN / sizeof *PLAIN; i++) {
        const size_t tail = strlen(name) < strlen(PLAIN[i]) ? 0 : strlen(name) - strlen(PLAIN[i]);
        if (strcmp(name, PLAIN[i]) == 0 || (i < 2 && tail && strcmp(name + tail, PLAIN[i]) == 0) ||
            (i == 2 && strncmp(name, "material", 8) == 0))
            return 1;
    }
    return 2 + 2 * on_verts + (channel->components == 1);
}

/* NULL where none promises at least as much as said. */
static const tl_channel *most_interesting(const tl_mesh *mesh, int least)
{
    const tl_channel *found = NULL;
    int most = least - 1;
    for (size_t c = 0; c < tl_mesh_channel_count(mesh); c++) {
        const int now = interest(mesh, tl_mesh_channel(mesh, c));
        if (now <= most) continue;
        most = now;
        found = tl_mesh_channel(mesh, c);
    }
    return found;
}

/* Whether the mesh is a part rather than a room. */
static tl_status is_solid(tl_ctx *ctx, const tl_mesh *mesh, bool *solid)
{
    tl_mesh_stats stats;
    double box = 1;
    const double pi = acos(-1);
    tl_status st = tl_mesh_measure(ctx, mesh, &stats);
    if (st) return st;
    for (int k = 0; k < 3; k++) box *= stats.bounds[2 * k + 1] - stats.bounds[2 * k];
    const double ball = cbrt(pi) * pow(6 * fabs(stats.volume), 2.0 / 3);
    *solid = fabs(stats.volume) < FILL_LEAST * box || ball < ROUND_LEAST * stats.boundary_area;
    return TL_OK;
}

/* The coarse mesh of a scene. */
static tl_status look_at(tl_ctx *ctx, tl_source *source, const tl_scene *scene, tli_body **look)
{
    int64_t step;
    double time;
    tli_body *whole = NULL;
    *look = NULL;
    tl_status st = tli_scene_step(ctx, source, scene, &step, &time);
    if (!st) st = tli_source_look(ctx, source, step, &whole);
    if (!st) st = tli_derive(ctx, scene, whole, look);
    tli_body_release(whole);
    return st;
}

tl_status tl_first_channel(tl_ctx *ctx, tl_source *source, const tl_scene *scene, char *name,
                           size_t bytes)
{
    tli_body *look;
    tl_status st = look_at(ctx, source, scene, &look);
    if (st) return st;
    const tl_channel *channel = most_interesting(look->mesh, 0);
    snprintf(name, bytes, "%s", channel ? channel->name : "");
    tli_body_release(look);
    return TL_OK;
}

static tl_status add_things(tl_ctx *ctx, tl_scene *scene, const tl_channel *channel, bool solid)
{
    tl_node node;
    tl_status st = tl_scene_add(ctx, scene, solid ? TL_NODE_BOUNDARY : TL_NODE_VOLUME, &node);
    if (!st && channel)
        st = tl_scene_set_text(ctx, scene, node, solid ? "color_by" : "channel", channel->name);
    return !st && solid ? tl_scene_add(ctx, scene, TL_NODE_EDGES, NULL) : st;
}

tl_status tl_first_look(tl_ctx *ctx, tl_source *source, tl_scene *scene)
{
    tli_body *look;
    bool solid = true;
    tl_status st = look_at(ctx, source, scene, &look);
    if (st) return st;
    const tl_channel *channel = most_interesting(look->mesh, 1);
    if (channel) st = is_solid(ctx, look->mesh, &solid);
    if (!st) st = tl_scene_begin(ctx, scene, "first look");
    if (!st) {
        st = add_things(ctx, scene, channel, solid);
        tl_status end = tl_scene_end(ctx, scene, !st);
        if (!st) st = end;
    }
    tli_body_release(look);
    return st;
}

/* ---- histograms ---- */

/* Like the colours of a scene, and to the bit; of a body of its own, since a view may add to those
 * that it keeps. */
tl_status tl_source_histogram(tl_ctx *ctx, tl_source *source, const tl_scene *scene,
                              const char *channel, bool logarithmic, double *bins, size_t bin_count,
                              double range[2])
{
    int64_t step;
    double time;
    tli_body *look = NULL, *whole = NULL;
    tli_scalar *scalar;
    tli_survey survey;
    const tl_channel *found;
    if (!bin_count) return tl_fail(ctx, TL_ERR_ARG, "a histogram of no bins");
    tl_status st = tli_scene_step(ctx, source, scene, &step, &time);
    if (!st) st = tli_source_look(ctx, source, step, &look);
    if (!st) st = tli_derive_channels(ctx, scene, look, &whole);
    if (!st) st = tli_body_channel(ctx, whole, channel, &found);
    if (!st) st = tli_survey_begin(ctx, source, scene, step, whole, channel, &survey);
    if (!st) {
        st = tli_survey_extremes(ctx, &survey, channel, logarithmic, range);
        tli_survey_end(&survey);
    }
    if (!st) {
        const double factor = tli_factor(logarithmic, range);
        const double shown[2] = {tli_shown(logarithmic, factor, range[0]),
                                 tli_shown(logarithmic, factor, range[1])};
        st = tli_body_scalar(ctx, whole, channel, logarithmic, factor, &scalar);
        if (!st) st = tli_body_spread(ctx, whole, scalar);
        if (!st) tli_spread_bins(scalar, shown, bins, bin_count);
    }
    tli_body_release(whole);
    tli_body_release(look);
    return st;
}
