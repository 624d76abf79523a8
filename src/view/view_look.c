/* First looks: which channel promises most, and what shows it; histograms. */
#include <math.h>
#include <stdio.h>

#include "view/view.h"

/* Parts whose volume is less than this part of their box, or of a ball with their surface, are
 * solids rather than rooms: a first look shows them from outside. */
static const double FILL_LEAST = 0.3, ROUND_LEAST = 0.35;
/* What a channel has to vary by, relative to its largest value: less is rounding. */
static const double VARIES_LEAST = 1e-9;
/* Tets that a histogram is made of; of larger meshes every n-th one. */
enum { TETS_MOST = 1 << 20 };

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

static double place(double value, bool logarithmic)
{
    return !logarithmic ? value : value > 0 ? log10(value) : (double)NAN;
}

/* The value of a corner, or of the tet. */
static double value_at(const tl_mesh *mesh, const tl_channel *channel, size_t tet, size_t corner)
{
    const bool on_verts = channel->on == TL_ON_VERTEX;
    return tli_length_at(channel, on_verts ? tl_mesh_tets(mesh)[4 * tet + corner] : tet);
}

/* Each corner stands for a quarter of its tet. */
static void fill_bins(const tl_mesh *mesh, const tl_channel *channel, bool logarithmic,
                      const double ends[2], double *bins, size_t bin_count)
{
    const size_t count = tl_mesh_tet_count(mesh), stride = 1 + count / TETS_MOST;
    double total = 0;
    for (size_t i = 0; i < bin_count; i++) bins[i] = 0;
    for (size_t t = 0; t < count; t += stride) {
        const double volume = tli_volume_at(mesh, t) / 4;
        for (size_t i = 0; i < 4; i++) {
            const double at = (place(value_at(mesh, channel, t, i), logarithmic) - ends[0]) /
                              (ends[1] - ends[0]) * (double)bin_count;
            if (!(at >= 0 && at <= (double)bin_count) && ends[0] < ends[1]) continue;
            const size_t bin = !(at < (double)bin_count) ? bin_count - 1 : (size_t)at;
            bins[ends[0] < ends[1] ? bin : 0] += volume;
            total += volume;
        }
    }
    for (size_t i = 0; total > 0 && i < bin_count; i++) bins[i] /= total;
}

tl_status tl_source_histogram(tl_ctx *ctx, tl_source *source, int64_t step, const char *channel,
                              bool logarithmic, double *bins, size_t bin_count, double range[2])
{
    int64_t number;
    double time;
    tli_body *look;
    tl_status st = tli_source_step(ctx, source, step, &number, &time);
    if (!st && !bin_count) st = tl_fail(ctx, TL_ERR_ARG, "a histogram of no bins");
    if (!st) st = tli_source_look(ctx, source, number, &look);
    if (st) return st;
    const tl_channel *found = tl_mesh_channel_by_name(look->mesh, channel);
    if (!found) {
        st = tli_unknown_channel(ctx, look->mesh, channel);
    } else {
        tli_extremes(look->mesh, found, logarithmic, range);
        const double ends[2] = {place(range[0], logarithmic), place(range[1], logarithmic)};
        fill_bins(look->mesh, found, logarithmic, ends, bins, bin_count);
    }
    tli_body_release(look);
    return st;
}
