/* Surfaces of random cuts, made patch by patch while the cut moves, against the surface of the
 * welded mesh of the same cut, and against the original vertices. */
#ifndef TETRALOD_TESTS_CHECK_SLICES_H
#define TETRALOD_TESTS_CHECK_SLICES_H

#include "measure/measure.h"
#include "tetralod/extract.h"

#include "check_model.h"

typedef struct slices_case {
    tl_ctx *ctx;
    tl_mesh *original;
    const tl_channel *channel; /* its first on vertices, a scalar */
    tl_store *store;
    const tl_store_head *head;
    uint32_t number; /* of the channel in the model */
    uint64_t seed;
    size_t cuts, closed, sides, outside, distances, wholes; /* what was looked at */
    size_t edges;              /* whole surfaces that needed an original edge beside the promise */
    double tightest, farthest; /* largest distance by its promise, of vertices, of whole surfaces */
    double coding;             /* distance of the finest mesh's surface from the original one */
    double edge;               /* longest in the original tets that the surface passes */
} slices_case;

/* Builds a model of a mesh, which becomes the case's, in the folder of the test. */
static inline void slices_build(slices_case *c, tl_ctx *ctx, tl_mesh *original,
                                const tl_build_opts *opts)
{
    tl_build_result result;
    const char *path = check_model_path("slices");
    *c = (slices_case){.ctx = ctx, .original = original};
    for (size_t i = tl_mesh_channel_count(original); i-- > 0;) {
        const tl_channel *channel = tl_mesh_channel(original, i);
        if (channel->on == TL_ON_VERTEX && channel->components == 1) c->channel = channel;
    }
    CHECK(c->channel != NULL);
    CHECK_OK(ctx, tl_model_build_mesh(ctx, original, path, opts, &result));
    tl_build_release(ctx, &result);
    CHECK_OK(ctx, tl_store_open(ctx, path, &c->store));
    c->head = tl_store_get_head(c->store);
    while (strcmp(c->head->channels[c->number].name, c->channel->name) != 0) c->number++;
    CHECK(c->head->level_count > 2);
}

/* One of small segments, for random cuts. */
static inline void slices_open(slices_case *c, tl_ctx *ctx, tl_mesh *original, uint64_t seed)
{
    const tl_build_opts opts = check_model_opts(2000, 200);
    slices_build(c, ctx, original, &opts);
    c->seed = seed;
}

static inline void slices_close(slices_case *c)
{
    tl_store_close(c->store);
    CHECK_EQ(remove(check_model_path("slices")), 0);
    tl_mesh_destroy(c->original);
}

/* ---- queries ---- */

static inline double slices_between(slices_case *c, double low, double high)
{
    return low + (high - low) * make_uniform(&c->seed);
}

/* A query of one of some kinds; opacity: the bin of the value alone is visible. */
static inline tl_cut_query slices_query(slices_case *c, const float *opacity, tl_camera *camera,
                                        double box[6])
{
    tl_cut_query q = tl_cut_query_defaults();
    const double *b = c->head->stats.bounds, part = pow(10, slices_between(c, -3.5, -0.7));
    q.opacity = opacity;
    switch (make_random(&c->seed) % 6) {
    case 0: q.bounds.classified = part; break;
    case 1: q.bounds.space = 0.3 * part * c->head->stats.diagonal; break;
    case 2:
        q.tets_max = (uint64_t)(slices_between(c, 0.02, 1) * (double)c->head->input_tets);
        break;
    case 3: q.level = (uint32_t)(make_random(&c->seed) % c->head->level_count); break;
    case 4:
        q.bounds.classified = part;
        for (int k = 0; k < 3; k++) {
            double one = slices_between(c, b[2 * k], b[2 * k + 1]);
            double two = slices_between(c, b[2 * k], b[2 * k + 1]);
            box[k] = fmin(one, two);
            box[k + 3] = fmax(one, two);
        }
        q.box = box;
        break;
    default:
        *camera = tl_camera_defaults();
        for (int k = 0; k < 3; k++) {
            camera->position[k] = slices_between(c, b[2 * k], b[2 * k + 1]);
            camera->focal_point[k] = slices_between(c, b[2 * k], b[2 * k + 1]);
        }
        camera->view_up[1] = 0.3;
        camera->view_angle = slices_between(c, 20, 90);
        q.camera = camera;
        q.pixels = slices_between(c, 1, 40);
    }
    return q;
}

/* ---- what the surface must be ---- */

static inline void slices_same(const tl_polydata *a, const tl_polydata *b)
{
    CHECK_EQ(a->vert_count, b->vert_count);
    CHECK_EQ(a->cell_count, b->cell_count);
    CHECK_EQ(a->channel_count, b->channel_count);
    CHECK(!memcmp(a->xyz, b->xyz, 3 * a->vert_count * sizeof *a->xyz));
    CHECK(!memcmp(a->normals, b->normals, 3 * a->vert_count * sizeof *a->normals));
    CHECK(!memcmp(a->corners, b->corners, 3 * a->cell_count * sizeof *a->corners));
    for (size_t i = 0; i < a->channel_count; i++)
        CHECK(!memcmp(a->channels[i].values, b->channels[i].values,
                      a->vert_count * a->channels[i].components * sizeof(double)));
}

/* A vertex of the slice of a patch; all bytes count. */
typedef struct slices_vert {
    double xyz[3], value, normal[3];
} slices_vert;

static inline int slices_by_bytes(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(slices_vert));
}

/* Where patches meet, they have the same places, values and normals, to the bit: no more different
 * vertices are there than the whole has. */
static inline void slices_fit(const tl_slices *slices, const tl_cut *cut, const tl_polydata *whole)
{
    size_t patch_count, count = 0, different = 0;
    const uint32_t *patches = tl_cut_patches(cut, &patch_count);
    slices_vert *verts = NULL;
    for (size_t i = 0; i < patch_count; i++) {
        const tl_polydata *p = tl_slices_patch(slices, patches[i]);
        if (!p) continue;
        verts = realloc(verts, (count + p->vert_count + 1) * sizeof *verts);
        for (size_t v = 0; v < p->vert_count; v++, count++) {
            memcpy(verts[count].xyz, p->xyz + 3 * v, sizeof verts[count].xyz);
            for (size_t k = 0; k < 3; k++) verts[count].normal[k] = (double)p->normals[3 * v + k];
            verts[count].value = p->channels[0].values[v];
        }
    }
    if (count) qsort(verts, count, sizeof *verts, slices_by_bytes);
    for (size_t i = 0; i < count; i++)
        different += !i || slices_by_bytes(&verts[i], &verts[i - 1]) != 0;
    CHECK(different <= whole->vert_count); /* several may lie at a vertex of the mesh */
    free(verts);
}

/* What the cut promises where the value is: the field error, codec included. */
static inline double slices_promise(const slices_case *c, const tl_cut *cut, double value)
{
    size_t patch_count;
    const uint32_t *patches = tl_cut_patches(cut, &patch_count);
    const size_t bin =
        c->number * (size_t)TL_BINS + tl_bin_of(c->head->channels[c->number].range, value);
    double error = c->head->levels[0].max_error[c->number];
    for (size_t i = 0; i < patch_count; i++) {
        tl_patch_info patch;
        tl_segment_info segment;
        CHECK_OK(c->ctx, tl_store_patch(c->ctx, c->store, patches[i], &patch));
        if (patch.producer == TL_NONE) continue;
        CHECK_OK(c->ctx, tl_store_segment(c->ctx, c->store, patch.producer, &segment));
        error = fmax(error, (double)segment.field_bins[bin]);
    }
    return error;
}

static inline tl_polydata *slices_of_mesh(const slices_case *c, const tl_mesh *mesh, double value)
{
    tl_polydata *p = NULL;
    tl_slice_opts opts = tl_slice_opts_defaults();
    opts.values = &value;
    opts.value_count = 1;
    CHECK_OK(c->ctx,
             tl_slice_mesh(c->ctx, mesh, tl_mesh_channel_by_name(mesh, c->channel->name)->values,
                           &opts, &p));
    return p;
}

static inline double slices_at(const tl_mesh *mesh, tl_lidx tet, const double weights[4])
{
    double value = 0;
    for (size_t i = 0; i < 4; i++)
        value += weights[i] * tl_mesh_channel(mesh, 0)->values[tl_mesh_tets(mesh)[4 * tet + i]];
    return value;
}

/* Original vertices that are farther from the value than promised lie on their side. */
static inline void slices_sides(slices_case *c, const tl_mesh *mesh, const tl_locator *locator,
                                double value, double promise)
{
    tl_lidx hint = TL_NONE;
    const double *xyz = tl_mesh_xyz(c->original);
    for (size_t v = 0; v < tl_mesh_vert_count(c->original); v++) {
        double weights[4], off = c->channel->values[v] - value;
        if (!(fabs(off) > promise)) continue;
        tl_lidx t = tl_locator_find(locator, xyz + 3 * v, hint, weights);
        c->sides++;
        c->outside += t == TL_NONE;
        if (t == TL_NONE) continue;
        hint = t;
        CHECK((slices_at(mesh, t, weights) - value) * off >= 0);
    }
}

/* Distance of a point from the surface of a value. */
static inline double slices_distance(const slices_case *c, const tl_mesh *mesh, double value,
                                     const double x[3])
{
    tli_surface surface;
    tl_lidx triangle;
    tl_polydata *p = slices_of_mesh(c, mesh, value);
    double distance = (double)INFINITY;
    if (p->cell_count) {
        CHECK_OK(c->ctx, tli_surface_create(c->ctx, p->xyz, p->vert_count, p->corners,
                                            p->cell_count, &surface));
        distance = sqrt(tli_surface_nearest(&surface, x, TL_NONE, &triangle));
        tli_surface_release(&surface);
    }
    tl_polydata_destroy(c->ctx, p);
    return distance;
}

/* Some original vertices with values in the visible bin: the surface of the vertex's own value,
 * give or take what coding adds to values, is not farther from it than promised. */
static inline void slices_space(slices_case *c, const tl_mesh *mesh, const tl_locator *locator,
                                double value, double promise)
{
    const tl_store_channel *channel = &c->head->channels[c->number];
    const double *xyz = tl_mesh_xyz(c->original), coding = channel->codec_error;
    const uint32_t bin = tl_bin_of(channel->range, value);
    size_t count = tl_mesh_vert_count(c->original), left = 8;
    for (size_t i = 0; isfinite(promise) && left && i < count; i++) {
        double weights[4];
        size_t v = (size_t)(make_random(&c->seed) % count);
        double own = c->channel->values[v];
        if (tl_bin_of(channel->range, own) != bin) continue;
        tl_lidx t = tl_locator_find(locator, xyz + 3 * v, TL_NONE, weights);
        if (t == TL_NONE) continue;
        double off = slices_at(mesh, t, weights) - own;
        left--;
        if (fabs(off) <= coding) continue;
        double far = slices_distance(c, mesh, own + copysign(coding, off), xyz + 3 * v);
        CHECK(far <= promise);
        c->distances++;
        c->tightest = fmax(c->tightest, far / promise);
    }
}

/* How far the corners and centroids of the triangles of one surface are from another one. */
static inline double slices_far(tl_ctx *ctx, const tl_polydata *from, const tl_polydata *to)
{
    tli_surface surface;
    double farthest2 = 0;
    CHECK_OK(ctx, tli_surface_create(ctx, to->xyz, to->vert_count, to->corners, to->cell_count,
                                     &surface));
    for (size_t t = 0; t < from->cell_count; t++) {
        double at[4][3] = {{0}};
        tl_lidx hint = TL_NONE;
        for (size_t i = 0; i < 3; i++)
            for (size_t k = 0; k < 3; k++) {
                at[i][k] = from->xyz[3 * (size_t)from->corners[3 * t + i] + k];
                at[3][k] += at[i][k] / 3;
            }
        for (size_t i = 0; i < 4; i++)
            farthest2 = fmax(farthest2, tli_surface_nearest(&surface, at[i], hint, &hint));
    }
    tli_surface_release(&surface);
    return sqrt(farthest2);
}

/* The surface of the original lies within the promise of that of a cut, and seldom an edge more,
 * give or take what coding does to that of the finest mesh. */
static inline void slices_whole(slices_case *c, const tl_mesh *mesh, double value, double promise)
{
    tl_polydata *from = slices_of_mesh(c, c->original, value);
    tl_polydata *to = slices_of_mesh(c, mesh, value);
    const double farthest = slices_far(c->ctx, from, to) - c->coding;
    CHECK(farthest <= promise + c->edge);
    c->edges += farthest > promise;
    if (isfinite(promise) && promise > 0) {
        c->farthest = fmax(c->farthest, farthest / promise);
        c->wholes++;
    }
    tl_polydata_destroy(c->ctx, to);
    tl_polydata_destroy(c->ctx, from);
}

static inline double slices_edge(const slices_case *c, double value)
{
    double longest2 = 0;
    const double *xyz = tl_mesh_xyz(c->original), *values = c->channel->values;
    for (size_t t = 0; t < tl_mesh_tet_count(c->original); t++) {
        const tl_lidx *q = tl_mesh_tets(c->original) + 4 * t;
        bool below = false, above = false;
        double longest_here2 = 0;
        for (int i = 0; i < 16; i++) {
            double d2 = 0;
            for (size_t k = 0; k < 3; k++) {
                double d = xyz[3 * (size_t)q[i / 4] + k] - xyz[3 * (size_t)q[i % 4] + k];
                d2 += d * d;
            }
            longest_here2 = fmax(longest_here2, d2);
            below |= values[q[i % 4]] <= value;
            above |= values[q[i % 4]] >= value;
        }
        if (below && above) longest2 = fmax(longest2, longest_here2);
    }
    return sqrt(longest2);
}

/* What coding does to the surface of a value: of the finest mesh. */
static inline double slices_coding(const slices_case *c, tl_cut *cut, double value)
{
    const size_t channel = c->number;
    tl_cut_query query = tl_cut_query_defaults();
    tl_mesh *finest = NULL;
    query.level = 0;
    CHECK_OK(c->ctx, tl_cut_update(cut, &query));
    CHECK_OK(c->ctx, tl_cut_mesh(cut, &channel, 1, &finest));
    tl_polydata *from = slices_of_mesh(c, c->original, value);
    tl_polydata *to = slices_of_mesh(c, finest, value);
    const double far = slices_far(c->ctx, from, to);
    tl_polydata_destroy(c->ctx, to);
    tl_polydata_destroy(c->ctx, from);
    tl_mesh_destroy(finest);
    return far;
}

/* ---- random cuts ---- */

static inline tl_slices *slices_create(const slices_case *c, tl_ctx *ctx, const double *values,
                                       size_t value_count)
{
    tl_slices *slices = NULL;
    tl_slices_opts opts = tl_slices_opts_defaults();
    opts.channel = c->number;
    opts.values = values;
    opts.value_count = value_count;
    opts.channels = &c->number;
    opts.channel_count = 1;
    CHECK_OK(ctx, tl_slices_create(ctx, c->store, &opts, &slices));
    return slices;
}

static inline void slices_of_cut(slices_case *c, tl_slices *slices, tl_cut *cut, double value,
                                 double gap, bool has_view)
{
    bool closed = false, plain_closed = false;
    size_t patch_count, channel = c->number;
    tl_mesh *mesh = NULL;
    tl_locator *locator = NULL;
    tl_polydata *moved = NULL, *fresh = NULL;
    const uint32_t *patches = tl_cut_patches(cut, &patch_count);
    tl_slices *other = slices_create(c, c->ctx, &value, 1);
    CHECK_OK(c->ctx, tl_slices_update(slices, patches, patch_count));
    CHECK_OK(c->ctx, tl_slices_update(other, patches, patch_count));
    CHECK_OK(c->ctx, tl_slices_join(slices, &moved));
    CHECK_OK(c->ctx, tl_slices_join(other, &fresh));
    slices_same(moved, fresh);
    slices_fit(slices, cut, moved);
    CHECK_OK(c->ctx, tl_cut_mesh(cut, &channel, 1, &mesh));
    tl_polydata *plain = slices_of_mesh(c, mesh, value);
    CHECK_EQ(moved->cell_count, plain->cell_count);
    CHECK_EQ(moved->vert_count, plain->vert_count);
    CHECK_NEAR(tl_polydata_size(moved), tl_polydata_size(plain), 1e-9 * tl_polydata_size(plain));
    double promise = slices_promise(c, cut, value);
    CHECK_OK(c->ctx, tl_polydata_closed(c->ctx, moved, &closed));
    CHECK_OK(c->ctx, tl_polydata_closed(c->ctx, plain, &plain_closed));
    CHECK_EQ(closed, plain_closed);
    if (promise < gap) CHECK(closed);
    c->closed += closed;
    CHECK_OK(c->ctx, tl_locator_create(c->ctx, mesh, NULL, &locator));
    slices_sides(c, mesh, locator, value, promise);
    if (!has_view) { /* which promises what is in view alone */
        double space = tl_cut_get_state(cut).space_error + 2 * c->head->position_error;
        slices_space(c, mesh, locator, value, space);
        slices_whole(c, mesh, value, space);
    }
    tl_locator_destroy(locator);
    tl_polydata_destroy(c->ctx, plain);
    tl_polydata_destroy(c->ctx, fresh);
    tl_polydata_destroy(c->ctx, moved);
    tl_mesh_destroy(mesh);
    tl_slices_destroy(other);
    c->cuts++;
}

/* How far values at the boundary are from a value if they are all on one side of it: a surface
 * whose error is smaller is closed. Else 0. */
static inline double slices_gap(const slices_case *c, double value)
{
    tl_lidx *triangles = NULL;
    size_t count = 0;
    double low = (double)INFINITY, high = -(double)INFINITY;
    CHECK_OK(c->ctx, tl_mesh_boundary(c->ctx, c->original, NULL, &triangles, NULL, &count));
    for (size_t i = 0; i < 3 * count; i++) {
        low = fmin(low, c->channel->values[triangles[i]]);
        high = fmax(high, c->channel->values[triangles[i]]);
    }
    tl_mem_free(c->ctx, triangles);
    return fmax(fmax(low - value, value - high), 0);
}

/* Some cuts of the case at one value of the range. */
static inline void slices_check(slices_case *c, size_t cuts, double part)
{
    const double *range = c->head->channels[c->number].range;
    const double value = range[0] + part * (range[1] - range[0]);
    float *opacity = calloc((size_t)c->head->channel_count * TL_BINS, sizeof *opacity);
    tl_cut *cut = NULL;
    tl_slices *slices = slices_create(c, c->ctx, &value, 1);
    const double gap = slices_gap(c, value);
    opacity[c->number * (size_t)TL_BINS + tl_bin_of(range, value)] = 1;
    CHECK_OK(c->ctx, tl_cut_create(c->ctx, c->store, &cut));
    c->coding = slices_coding(c, cut, value);
    c->edge = slices_edge(c, value);
    for (size_t i = 0; i < cuts; i++) {
        tl_camera camera;
        double box[6];
        tl_cut_query query = slices_query(c, opacity, &camera, box);
        CHECK_OK(c->ctx, tl_cut_update(cut, &query));
        slices_of_cut(c, slices, cut, value, gap, query.camera != NULL);
    }
    tl_cut_destroy(cut);
    tl_slices_destroy(slices);
    free(opacity);
}

static inline void slices_say(const slices_case *c)
{
    printf("%zu cuts, %zu closed: %zu vertices on their side, %zu of them outside; %zu distances, "
           "at most %.3f of the promise; %zu whole surfaces, %zu farther than it, at most %.3f of "
           "it ok\n",
           c->cuts, c->closed, c->sides, c->outside, c->distances, c->tightest, c->wholes, c->edges,
           c->farthest);
    CHECK(30 * c->edges <= c->wholes);
}

#endif
