/* Simplification as a stream algorithm (Sondershaus 2007, 6.1.3, table 6.5). There a segment is
 * simplified while its neighbours are in memory. Here whole clusters of segments are, with the
 * vertices that other clusters hold locked; what stays dense at their borders is inside of the
 * clusters of the next round, which come from an octree that is turned. So every tet is simplified
 * where all around it is free, and each cluster in the order that is best for all its edges. */
#include "base/base_predicates.h"
#include "base/base_sort.h"
#include "mesh/mesh.h"
#include "segment/segment_build.h"
#include "segment/segment_cluster.h"
#include "segment/segment_soup.h"

#include <math.h>
#include <string.h>

/* Part of the memory for a cluster in simplification, and bytes that a tet takes there, without and
 * for each number of a vertex. */
#define CLUSTER_PART 0.75
#define TET_BYTES 110.0
#define TET_BYTES_A_NUMBER 12.0
#define CLUSTER_TETS_MIN 20000u
/* Segments of a cluster, so that its shape can be compact. */
#define SEGMENTS_A_CLUSTER 24u
#define ROUNDS_MAX 6u
/* Tets that the rounds before the last aim at, in targets: what is dense at borders goes later. */
static const double MARGINS[] = {1.6, 1.2};
#define MARGIN_COUNT (sizeof MARGINS / sizeof *MARGINS)
/* Part of the tets at locked vertices that stay. */
static const double BORDER_STAYS = 0.8;
/* Of the diagonal, that the boundary may move where nothing is said, as of tl_mesh_simplify. */
static const double BOUNDARY_PART = 0.001;
/* A round that leaves more than this part of the tets is the last. */
static const double WORTH_A_ROUND = 0.98;

/* Octrees of the rounds are turned by these angles about the axes, in radians. */
static const double ANGLES[][3] = {{0, 0, 0}, {0.6, 0.4, 0.3}, {0.3, 0.8, 0.5}, {0.9, 0.2, 0.7}};
#define ANGLE_COUNT (sizeof ANGLES / sizeof *ANGLES)

typedef struct thinning {
    tl_ctx *ctx;
    tl_simplify_opts opts; /* channels named */
    tl_simplify_channel *channels;
    double *weights; /* [opts.channel_count] as asked; for values of the whole */
    tl_segment_opts cut;
    tl_segments *first, *segments; /* those of the input; of this round: first, or others */
    tli_soup soup;                 /* what the last round left */
    double *widths;                /* [channels of the segments] range over the whole */
    uint64_t target, cluster_tets;
    double boundary_left;
    bool is_bounded; /* errors are */
    unsigned round;
    tl_stream_result result;
} thinning;

/* ---- preparation ---- */

static tl_status name_channels(thinning *t)
{
    tl_status st = TL_OK;
    const tl_segments *s = t->first;
    size_t room = t->opts.channels ? t->opts.channel_count : s->channel_count;
    t->channels = tl_mem_zalloc(t->ctx, room, sizeof *t->channels, &st);
    t->weights = tl_mem_zalloc(t->ctx, room, sizeof *t->weights, &st);
    if (st) return st;
    if (t->opts.channels) {
        memcpy(t->channels, t->opts.channels, room * sizeof *t->channels);
    } else {
        t->opts.channel_count = 0;
        for (size_t c = 0; c < s->channel_count; c++)
            if (s->channels[c].on == TL_ON_VERTEX)
                t->channels[t->opts.channel_count++] =
                    (tl_simplify_channel){s->channels[c].name, 1, 0};
    }
    t->opts.channels = t->channels;
    t->is_bounded = t->opts.error > 0;
    for (size_t i = 0; i < t->opts.channel_count; i++) {
        t->weights[i] = t->channels[i].weight;
        t->is_bounded |= t->channels[i].error > 0;
    }
    return TL_OK;
}

static const tl_segment_channel *find_channel(const thinning *t, const char *name)
{
    for (size_t c = 0; name && c < t->first->channel_count; c++)
        if (t->first->channels[c].on == TL_ON_VERTEX &&
            strcmp(t->first->channels[c].name, name) == 0)
            return &t->first->channels[c];
    return NULL;
}

/* The widest range of a component. */
static double width_of(const double *ranges, const tl_segment_channel *channel)
{
    double width = 0;
    for (uint32_t k = 0; k < channel->components; k++) {
        const double *range = ranges + 2 * ((size_t)channel->first + k);
        if (range[1] - range[0] > width) width = range[1] - range[0];
    }
    return isfinite(width) ? width : 0;
}

static double diagonal_of(const tl_segments *s)
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        double low = (double)INFINITY, high = -(double)INFINITY;
        for (uint32_t i = 0; i < s->count; i++) {
            low = fmin(low, s->entries[i].bounds[2 * k]);
            high = fmax(high, s->entries[i].bounds[2 * k + 1]);
        }
        if (high > low) square += (high - low) * (high - low);
    }
    return sqrt(square);
}

/* Errors that are fractions of a range become absolute: of the whole, not of a cluster. */
static tl_status set_limits(thinning *t, const tli_clusters *clusters)
{
    tl_status st = TL_OK;
    t->widths = tl_mem_zalloc(t->ctx, t->first->channel_count, sizeof *t->widths, &st);
    for (size_t i = 0; !st && i < t->opts.channel_count; i++) {
        const tl_segment_channel *channel = find_channel(t, t->channels[i].name);
        if (!channel)
            return tl_fail(t->ctx, TL_ERR_DATA, "the mesh has no channel '%s' on vertices",
                           t->channels[i].name ? t->channels[i].name : "(null)");
        double width = width_of(clusters->ranges, channel);
        t->widths[channel - t->first->channels] = width;
        double error = t->opts.error * width;
        if (error > 0 && !(t->channels[i].error > 0 && t->channels[i].error < error))
            t->channels[i].error = error;
    }
    t->opts.error = 0;
    if (t->opts.boundary_error < 0) {
        double part = t->opts.boundary_error > -1 ? -t->opts.boundary_error : BOUNDARY_PART;
        t->opts.boundary_error = part * diagonal_of(t->first);
    }
    t->boundary_left = t->opts.boundary_error;
    if (t->opts.target_tets) t->target = t->opts.target_tets;
    if (t->opts.ratio > 0) {
        uint64_t part = (uint64_t)(t->opts.ratio * (double)t->first->tet_count);
        if (!t->target || part < t->target) t->target = part;
    }
    if (t->target < 1 && !t->is_bounded)
        st = tl_fail(t->ctx, TL_ERR_ARG, "simplification needs a target or a bound");
    return st;
}

/* ---- one cluster ---- */

/* Weights that make the scale of a channel, its range in the cluster, that of the whole. */
static void weigh(thinning *t, const tl_mesh *mesh)
{
    for (size_t i = 0; i < t->opts.channel_count; i++) {
        const tl_segment_channel *channel = find_channel(t, t->channels[i].name);
        const tl_channel *here = tl_mesh_channel_by_name(mesh, channel->name);
        double width = 0, whole = t->widths[channel - t->first->channels];
        for (uint32_t k = 0; k < here->components; k++) {
            double low = (double)INFINITY, high = -(double)INFINITY;
            for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
                double value = here->values[v * here->components + k];
                if (!isfinite(value)) continue;
                low = value < low ? value : low;
                high = value > high ? value : high;
            }
            width = high - low > width ? high - low : width;
        }
        double factor = whole > 0 && width > 0 && isfinite(width) ? width / whole : 1;
        t->channels[i].weight = t->weights[i] * factor;
    }
}

/* Tets that a cluster is to keep. */
static size_t cluster_target(const thinning *t, const tli_cluster *cluster, double share)
{
    const double tets = (double)tl_mesh_tet_count(cluster->mesh);
    const double border = (double)cluster->at_border;
    bool is_last = t->round >= MARGIN_COUNT || cluster->locked_count == 0;
    double keep = is_last ? share * tets : share * (tets - border) + BORDER_STAYS * border;
    return keep < 1 ? 1 : (size_t)keep;
}

/* Which vertices of the result are locked ones: numbers [vertices of out] receives the index of
 * the vertex in the cluster, TL_NONE for one that was free. */
static tl_status find_locked(const thinning *t, const tli_cluster *cluster, const tl_mesh *out,
                             tl_lidx *numbers)
{
    const double *index = tl_mesh_channel(out, cluster->index_channel)->values;
    const double *xyz = tl_mesh_xyz(out), *before = tl_mesh_xyz(cluster->mesh);
    const size_t n = tl_mesh_vert_count(cluster->mesh);
    size_t found = 0;
    tl_status st = TL_OK;
    uint8_t *taken = tl_mem_zalloc(t->ctx, n, 1, &st);
    for (size_t v = 0; !st && v < tl_mesh_vert_count(out); v++) {
        numbers[v] = TL_NONE;
        if (!(index[v] >= 0 && index[v] < (double)n) || index[v] != floor(index[v])) continue;
        size_t at = (size_t)index[v];
        if (!cluster->locked[at] || taken[at] ||
            memcmp(xyz + 3 * v, before + 3 * at, 3 * sizeof *xyz) != 0)
            continue;
        numbers[v] = (tl_lidx)at;
        taken[at] = 1;
        found++;
    }
    tl_mem_free(t->ctx, taken);
    TL_ASSERT(st || found == cluster->locked_count); /* locked vertices stay as they are */
    return st;
}

static size_t border_index(const tli_clusters *clusters, uint64_t id)
{
    size_t low = 0, high = clusters->border_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (clusters->borders[middle] < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void make_record(const thinning *t, const tl_mesh *out, size_t v, double *record)
{
    memcpy(record, tl_mesh_xyz(out) + 3 * v, 3 * sizeof *record);
    for (size_t c = 0; c < t->first->channel_count; c++) {
        const tl_segment_channel *channel = &t->first->channels[c];
        if (channel->on != TL_ON_VERTEX) continue;
        memcpy(record + 3 + channel->first,
               tl_mesh_channel(out, c)->values + v * channel->components,
               channel->components * sizeof *record);
    }
}

/* Vertices of a result to the soup: locked ones have their places in front of all others. places
 * [vertices of out] receives where each is. */
static tl_status store_vertices(thinning *t, tli_soup *soup, const tli_clusters *clusters,
                                const tli_cluster *cluster, const tl_mesh *out,
                                const tl_lidx *numbers, tl_lidx *places)
{
    enum { STEP = 4096 };
    tl_status st = TL_OK;
    uint64_t next = soup->vert_count;
    size_t waiting = 0;
    double *records = tl_mem_alloc(t->ctx, STEP, soup->vert_numbers * sizeof *records, &st);
    for (size_t v = 0; !st && v < tl_mesh_vert_count(out); v++) {
        if (numbers[v] != TL_NONE) {
            double *record = records + waiting * soup->vert_numbers;
            places[v] = (tl_lidx)border_index(clusters, cluster->ids[numbers[v]]);
            make_record(t, out, v, record);
            st = tli_soup_put_verts(soup, places[v], record, 1);
            continue;
        }
        places[v] = (tl_lidx)(next + waiting);
        make_record(t, out, v, records + waiting++ * soup->vert_numbers);
        if (waiting < STEP - 1) continue;
        st = tli_soup_put_verts(soup, next, records, waiting);
        next += waiting;
        waiting = 0;
    }
    if (!st && waiting) st = tli_soup_put_verts(soup, next, records, waiting);
    tl_mem_free(t->ctx, records);
    if (!st && soup->vert_count > TL_MESH_VERTS_MAX)
        st = tl_fail(t->ctx, TL_ERR_UNSUPPORTED, "more than %u vertices", TL_MESH_VERTS_MAX);
    return st;
}

static tl_status store_tets(thinning *t, tli_soup *soup, const tl_mesh *out, const tl_lidx *places)
{
    enum { STEP = 8192 };
    tl_status st = TL_OK;
    const size_t count = tl_mesh_tet_count(out);
    const uint32_t components = t->first->components[TL_ON_TET];
    const tl_lidx *tets = tl_mesh_tets(out);
    const int32_t *regions = tl_mesh_regions(out);
    tl_lidx *corners = tl_mem_alloc(t->ctx, STEP, 4 * sizeof *corners, &st);
    double *values = tl_mem_alloc(t->ctx, STEP, components * sizeof *values, &st);
    for (size_t first = 0; !st && first < count; first += STEP) {
        size_t part = count - first < STEP ? count - first : STEP;
        for (size_t i = 0; i < 4 * part; i++) corners[i] = places[tets[4 * first + i]];
        for (size_t c = 0; c < t->first->channel_count; c++) {
            const tl_segment_channel *channel = &t->first->channels[c];
            if (channel->on != TL_ON_TET) continue;
            const double *from = tl_mesh_channel(out, c)->values + first * channel->components;
            for (size_t i = 0; i < part; i++, from += channel->components)
                memcpy(values + i * components + channel->first, from,
                       channel->components * sizeof *values);
        }
        st = tli_soup_add_tets(soup, corners, regions ? regions + first : NULL, values, part);
    }
    tl_mem_free(t->ctx, values);
    tl_mem_free(t->ctx, corners);
    return st;
}

static tl_status store_cluster(thinning *t, tli_soup *soup, const tli_clusters *clusters,
                               const tli_cluster *cluster, const tl_mesh *out)
{
    tl_status st = TL_OK;
    const size_t n = tl_mesh_vert_count(out);
    tl_lidx *numbers = tl_mem_alloc(t->ctx, n, sizeof *numbers, &st);
    tl_lidx *places = tl_mem_alloc(t->ctx, n, sizeof *places, &st);
    if (!st) st = find_locked(t, cluster, out, numbers);
    if (!st) st = store_vertices(t, soup, clusters, cluster, out, numbers, places);
    if (!st) st = store_tets(t, soup, out, places);
    tl_mem_free(t->ctx, places);
    tl_mem_free(t->ctx, numbers);
    return st;
}

/* What a result says goes to the result of all. */
static void add_result(thinning *t, const tl_simplify_result *one, double *moved)
{
    t->result.inverted += one->inverted;
    t->result.degenerate += one->degenerate;
    if (one->boundary_error > *moved) *moved = one->boundary_error;
    if (one->peak_bytes > t->result.peak_bytes) t->result.peak_bytes = one->peak_bytes;
}

static tl_status thin_cluster(thinning *t, tli_soup *soup, const tli_clusters *clusters,
                              uint32_t number, double share, double *moved)
{
    tli_cluster cluster;
    tl_mesh *out = NULL;
    tl_simplify_result one = {0};
    tl_simplify_opts opts = t->opts;
    tl_status st = tli_cluster_load(t->ctx, clusters, number, &cluster);
    if (st) return st;
    weigh(t, cluster.mesh);
    opts.ratio = 0;
    opts.target_tets = t->target ? cluster_target(t, &cluster, share) : 0;
    opts.locked = cluster.locked_count ? cluster.locked : NULL;
    /* halves for the rounds to come, as long as there may be any */
    opts.boundary_error =
        clusters->count > 1 && !t->is_bounded ? t->boundary_left / 2 : t->boundary_left;
    st = tl_mesh_simplify(t->ctx, cluster.mesh, &opts, &out, &one);
    if (!st) st = store_cluster(t, soup, clusters, &cluster, out);
    if (!st) add_result(t, &one, moved);
    tl_simplify_release(t->ctx, &one);
    tl_mesh_destroy(out);
    tli_cluster_release(t->ctx, &cluster);
    return st;
}

/* ---- rounds ---- */

static void rotation_of(unsigned round, double m[9])
{
    const double *a = ANGLES[round % ANGLE_COUNT];
    double s[3], c[3];
    for (int k = 0; k < 3; k++) s[k] = sin(a[k]), c[k] = cos(a[k]);
    const double rows[9] = {c[1] * c[2],
                            s[0] * s[1] * c[2] - c[0] * s[2],
                            c[0] * s[1] * c[2] + s[0] * s[2],
                            c[1] * s[2],
                            s[0] * s[1] * s[2] + c[0] * c[2],
                            c[0] * s[1] * s[2] - s[0] * c[2],
                            -s[1],
                            s[0] * c[1],
                            c[0] * c[1]};
    memcpy(m, rows, sizeof rows);
}

/* Segments of what the last round left. */
static tl_status cut_again(thinning *t)
{
    tli_feed *feed = NULL;
    double rotation[9];
    rotation_of(t->round, rotation);
    if (t->segments != t->first) tl_segments_destroy(t->segments);
    t->segments = NULL;
    tl_status st = tli_soup_feed(&t->soup, t->cut.memory_bytes / 2, &feed);
    return st ? st : tli_segments_build_feed(t->ctx, feed, &t->cut, rotation, &t->segments);
}

static tl_status thin_round(thinning *t, const tli_clusters *clusters)
{
    tli_soup soup;
    const double before = (double)t->segments->tet_count;
    double margin = clusters->count > 1 && t->round < MARGIN_COUNT ? MARGINS[t->round] : 1;
    double share = t->target ? margin * (double)t->target / before : 1, moved = 0;
    if (share > 1) share = 1;
    t->result.inverted = t->result.degenerate = 0;
    tl_status st = tli_soup_open(t->ctx, t->first, t->cut.folder, &soup);
    soup.vert_count = clusters->border_count;
    for (uint32_t i = 0; !st && i < clusters->count; i++) {
        st = thin_cluster(t, &soup, clusters, i, share, &moved);
        if (!st) st = tl_progress(t->ctx, "clusters", i + 1, clusters->count);
    }
    t->boundary_left = t->boundary_left > moved ? t->boundary_left - moved : 0;
    t->result.boundary_error += moved;
    tli_soup_close(&t->soup);
    t->soup = soup;
    return st;
}

static tl_status thin(thinning *t)
{
    tl_status st = TL_OK;
    for (t->round = 0; !st && t->round < ROUNDS_MAX; t->round++) {
        tli_clusters clusters;
        if (t->round) st = cut_again(t);
        if (!st) st = tli_clusters_open(t->ctx, t->segments, t->cluster_tets, &clusters);
        if (st) break;
        if (t->round == 0) {
            t->result.clusters = clusters.count;
            st = set_limits(t, &clusters);
        }
        double before = (double)t->segments->tet_count;
        bool is_one = clusters.count == 1;
        if (!st) st = thin_round(t, &clusters);
        tli_clusters_close(&clusters);
        t->result.rounds = t->round + 1;
        t->result.target_reached = t->soup.tet_count <= t->target;
        bool idle = (double)t->soup.tet_count > WORTH_A_ROUND * before && t->round;
        if (is_one || t->is_bounded || t->result.target_reached || idle) break;
    }
    return st;
}

static tl_status check(tl_ctx *ctx, const tl_simplify_opts *simplify, const char *output)
{
    if (!simplify) return tl_fail(ctx, TL_ERR_ARG, "simplification needs options with a target");
    if (simplify->locked || simplify->listener)
        return tl_fail(ctx, TL_ERR_ARG,
                       "locked vertices and listeners are for meshes in memory alone");
    if (!tli_path_ends(output, ".vtu") && !tli_path_ends(output, ".vtk"))
        return tl_fail(ctx, TL_ERR_ARG, "'%s': the ending says as what to write, .vtu or .vtk",
                       output);
    return TL_OK;
}

/* Sizes of clusters and segments that the memory allows. */
static tl_status plan_sizes(thinning *t, const tl_segment_opts *opts)
{
    t->cut = tl_segment_opts_defaults();
    tl_status st = tli_opts_take(t->ctx, "tl_segment_opts", opts, &t->cut, sizeof t->cut);
    t->cut.adjacency = false;
    return st;
}

static void plan_clusters(thinning *t)
{
    const double numbers =
        (double)t->first->components[TL_ON_VERTEX] + 4.0 * (double)t->first->components[TL_ON_TET];
    double tets =
        CLUSTER_PART * (double)t->cut.memory_bytes / (TET_BYTES + TET_BYTES_A_NUMBER * numbers);
    t->cluster_tets = tets > CLUSTER_TETS_MIN ? (uint64_t)tets : CLUSTER_TETS_MIN;
    uint64_t segment = t->cluster_tets / SEGMENTS_A_CLUSTER;
    t->cut.segment_tets = segment > 20000 ? 20000 : segment < 1000 ? 1000 : (uint32_t)segment;
}

tl_status tl_simplify_stream(tl_ctx *ctx, const char *input, const tl_read_opts *read,
                             const tl_simplify_opts *simplify, const tl_segment_opts *opts,
                             const char *output, const tl_write_opts *write,
                             tl_stream_result *result, tl_read_report *report)
{
    thinning t = {.ctx = ctx, .opts = tl_simplify_opts_defaults()};
    if (result) *result = t.result;
    tl_status st = check(ctx, simplify, output);
    if (!st) st = tli_opts_take(ctx, "tl_simplify_opts", simplify, &t.opts, sizeof t.opts);
    if (!st) st = plan_sizes(&t, opts);
    double start = 0;
    tl_ctx_reset_peak(ctx);
    if (!st) st = tl_segments_build(ctx, input, read, &t.cut, NULL, &t.first, report);
    t.segments = t.first;
    if (!st && t.first->tet_count == 0) st = tl_fail(ctx, TL_ERR_DATA, "'%s' has no tets", input);
    start = tli_clock_s();
    if (!st) plan_clusters(&t);
    if (!st) st = name_channels(&t);
    if (!st) st = thin(&t);
    t.result.seconds = tli_clock_s() - start;
    if (!st) st = tli_soup_write(&t.soup, output, write);
    if (!st && result) {
        t.result.tets_in = t.first->tet_count;
        t.result.vertices_in = t.first->vert_count;
        t.result.tets_out = t.soup.tet_count;
        t.result.vertices_out = t.soup.vert_count;
        if (tl_ctx_peak_bytes(ctx) > t.result.peak_bytes)
            t.result.peak_bytes = tl_ctx_peak_bytes(ctx);
        *result = t.result;
    }
    tli_soup_close(&t.soup);
    if (t.segments != t.first) tl_segments_destroy(t.segments);
    tl_segments_destroy(t.first);
    tl_mem_free(ctx, t.widths);
    tl_mem_free(ctx, t.weights);
    tl_mem_free(ctx, t.channels);
    return st ? tl_note(ctx, st, "while simplifying '%s' in parts", input) : TL_OK;
}
