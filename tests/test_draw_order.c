/* Depth orders against brute force: along every ray each tet stands behind those that the ray meets
 * before it, on meshes with and without gaps, parallel and in perspective; rings are counted. */
#include "check.h"

#include "draw/draw_order.h"

#include "check_ctx.h"
#include "make_mesh.h"
#include "make_scene.h"

enum { SIDE = 24, ON_RAY_MAX = 256 };
/* Pieces of rays shorter than this, mesh units, are rounding. */
static const double SHORT = 1e-6;

typedef struct scene {
    tl_mesh *mesh;
    tl_volume *volume;
    tl_transfer *transfer;
    tli_frame frame;
    tli_vert *verts;
} scene;

static scene open_scene(tl_ctx *ctx, const make_mesh *m, double azimuth, double elevation,
                        bool parallel)
{
    static const tl_color_point white = {0, {1, 1, 1}};
    static const tl_opacity_point fog = {0, 0.5};
    static const double bounds[6] = {0, 1, 0, 1, 0, 1};
    scene s = {.mesh = make_object(ctx, m, make_quarter)};
    tl_image *image = NULL;
    tl_camera camera = tl_camera_fit(bounds, azimuth, elevation, 1.2, SIDE, SIDE);
    camera.parallel_scale = parallel ? 0.7 : 0;
    CHECK_OK(ctx, tl_volume_create(ctx, s.mesh, NULL, &s.volume));
    CHECK_OK(ctx, tl_transfer_create(ctx, &white, 1, &fog, 1, 1, &s.transfer));
    CHECK_OK(ctx, tl_image_create(ctx, SIDE, SIDE, &image));
    CHECK_OK(ctx, tli_frame_set(ctx, &camera, image, &s.frame));
    tl_image_destroy(ctx, image);
    s.verts = malloc((m->vert_count + 1) * sizeof *s.verts);
    if (!s.verts) abort();
    for (size_t v = 0; v < m->vert_count; v++) {
        double at[3];
        tli_frame_place(&s.frame, m->xyz + 3 * v, at);
        s.verts[v] = (tli_vert){(float)at[0], (float)at[1], (float)at[2], 0};
    }
    return s;
}

static tli_order_view view_of(const scene *s)
{
    return (tli_order_view){s->volume, s->transfer, &s->frame, s->verts, SIDE, SIDE};
}

static void close_scene(tl_ctx *ctx, scene *s)
{
    free(s->verts);
    tl_transfer_destroy(ctx, s->transfer);
    tl_volume_destroy(ctx, s->volume);
    tl_mesh_destroy(s->mesh);
}

/* From where to where, in depth, the ray of a pixel is in a tet, from its vertices in space;
 * false: it misses it. */
static bool passes(const scene *s, const make_mesh *m, size_t tet, int column, int row,
                   double depths[2])
{
    const tli_frame *f = &s->frame;
    double px = column + 0.5 - f->middle[0], py = f->middle[1] - row - 0.5, p[4][3];
    depths[0] = -(double)INFINITY;
    depths[1] = (double)INFINITY;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++)
            p[i][k] = m->xyz[3 * (size_t)m->tets[4 * tet + (size_t)i] + (size_t)k];
    double weights[2][4]; /* at depths 1 and 2: linear in between */
    for (int end = 0; end < 2; end++) {
        double z = 1 + end, x[3];
        for (int k = 0; k < 3; k++) {
            double w = f->parallel ? 1 : z;
            x[k] = f->origin[k] + f->unit * (f->forward[k] * z + f->right[k] * px * w / f->scale +
                                             f->up[k] * py * w / f->scale);
        }
        if (!tl_tet_weights((const double(*)[3])p, x, weights[end])) return false;
    }
    for (int i = 0; i < 4; i++) {
        double slope = weights[1][i] - weights[0][i], zero = 1 - weights[0][i] / slope;
        if (slope > 0) depths[0] = fmax(depths[0], zero);
        if (slope < 0) depths[1] = fmin(depths[1], zero);
        if (slope == 0 && weights[0][i] < 0) return false;
    }
    depths[0] = f->parallel ? depths[0] : fmax(depths[0], 0);
    return (depths[1] - depths[0]) * f->unit > SHORT;
}

/* Checks all rays. Returns the number of pairs that were looked at; *wrong: in the wrong order. */
static size_t check_rays(const scene *s, const make_mesh *m, const size_t *place, size_t *wrong)
{
    size_t pairs = 0;
    *wrong = 0;
    for (int pixel = 0; pixel < SIDE * SIDE; pixel++) {
        double at[ON_RAY_MAX][2];
        size_t tets[ON_RAY_MAX], count = 0;
        for (size_t t = 0; t < m->tet_count; t++) {
            CHECK(count < ON_RAY_MAX);
            if (passes(s, m, t, pixel % SIDE, pixel / SIDE, at[count])) tets[count++] = t;
        }
        for (size_t i = 0; i < count; i++)
            for (size_t j = 0; j < count; j++) {
                if (!(at[i][0] + at[i][1] < at[j][0] + at[j][1])) continue;
                pairs++;
                *wrong += place[tets[i]] < place[tets[j]]; /* i is in front */
            }
    }
    return pairs;
}

static size_t *places_of(const tli_order *order, size_t tet_count)
{
    size_t *place = malloc((tet_count + 1) * sizeof *place);
    if (!place) abort();
    memset(place, 0xff, tet_count * sizeof *place);
    for (size_t i = 0; i < order->count; i++) {
        CHECK(order->tets[i] < tet_count && place[order->tets[i]] == SIZE_MAX); /* each once */
        place[order->tets[i]] = i;
    }
    return place;
}

/* Looks at a mesh from all around. Returns the tets that were drawn out of order, summed. */
static size_t look_around(tl_ctx *ctx, const make_mesh *m, bool convex)
{
    size_t pairs = 0, broken = 0;
    for (int look = 0; look < 8; look++) {
        scene s = open_scene(ctx, m, 47 * look + 3, 71 * (look % 3) - 66, look & 1);
        tli_order order;
        tli_order_view view = view_of(&s);
        uint64_t *gaps = NULL;
        size_t gap_count = 0, wrong;
        CHECK_OK(ctx, tli_order_exact(ctx, &view, &order));
        CHECK_OK(ctx, tli_order_gaps(ctx, &view, &gaps, &gap_count));
        CHECK_EQ(gap_count == 0, convex);
        size_t *place = places_of(&order, m->tet_count);
        pairs += check_rays(&s, m, place, &wrong);
        if (order.broken == 0) CHECK_EQ(wrong, 0);
        broken += order.broken;
        free(place);
        tl_mem_free(ctx, gaps);
        tl_mem_free(ctx, order.tets);
        close_scene(ctx, &s);
    }
    printf("%zu pairs of tets on rays in order\n", pairs);
    CHECK(pairs > 1000);
    return broken;
}

static void grids_are_in_order(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(6);
    make_shuffle(&m, 7);
    CHECK_EQ(look_around(ctx, &m, true), 0);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void gaps_are_in_order(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid_cavity(7);
    make_perturb(&m, 0.01, 3);
    make_shuffle(&m, 5);
    CHECK_EQ(look_around(ctx, &m, false), 0);
    make_release(&m);
    /* a third of the tets, here and there */
    m = make_grid(6);
    make_shuffle(&m, 11);
    m.tet_count /= 3;
    look_around(ctx, &m, false);
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Three sticks, each over the next one. */
static make_mesh make_ring(void)
{
    static const double turn = 2.0943951023931953, thin = 0.15;
    make_mesh m = make_room(12, 3);
    for (int i = 0; i < 3; i++) {
        double c = cos(i * turn), s = sin(i * turn);
        double sticks[4][3] = {{0.4, -0.12 - thin, 0.3},
                               {0.4, -0.12 + thin, 0.3},
                               {-0.4, -0.12, -0.3 - thin},
                               {-0.4, -0.12, -0.3 + thin}};
        for (int v = 0; v < 4; v++) {
            double *x = m.xyz + 3 * (4 * i + v);
            x[0] = 0.5 + c * sticks[v][0] - s * sticks[v][1];
            x[1] = 0.5 + s * sticks[v][0] + c * sticks[v][1];
            x[2] = 0.5 + sticks[v][2];
            m.tets[4 * i + v] = (tl_lidx)(4 * i + v);
        }
        double p[4][3];
        memcpy(p, m.xyz + 12 * i, sizeof p);
        if (tl_tet_volume((const double(*)[3])p) < 0) {
            m.tets[4 * i] = (tl_lidx)(4 * i + 1);
            m.tets[4 * i + 1] = (tl_lidx)(4 * i);
        }
    }
    return m;
}

static void rings_are_counted(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_ring();
    scene s = open_scene(ctx, &m, 0, 89, true);
    tli_order order;
    tli_order_view view = view_of(&s);
    CHECK_OK(ctx, tli_order_exact(ctx, &view, &order));
    CHECK_EQ(order.count, 3);
    CHECK_EQ(order.broken, 1);
    free(places_of(&order, 3));
    tl_mem_free(ctx, order.tets);
    close_scene(ctx, &s);
    make_release(&m);
    check_ctx_destroy(ctx);
}

static void centroids_fall(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    make_mesh m = make_grid(6);
    make_shuffle(&m, 2);
    for (int parallel = 0; parallel < 2; parallel++) {
        scene s = open_scene(ctx, &m, 20, 30, parallel);
        tli_order order;
        tli_order_view view = view_of(&s);
        double last = (double)INFINITY;
        CHECK_OK(ctx, tli_order_centroids(ctx, &view, &order));
        CHECK_EQ(order.count, m.tet_count);
        for (size_t i = 0; i < order.count; i++) {
            double at[3] = {0}, far = 0;
            for (size_t k = 0; k < 12; k++)
                at[k % 3] += m.xyz[3 * (size_t)m.tets[4 * order.tets[i] + k / 3] + k % 3] / 4;
            for (int k = 0; k < 3; k++) {
                double d = at[k] - s.frame.origin[k];
                far += parallel ? d * s.frame.forward[k] : d * d;
            }
            CHECK(far <= last * (1 + 1e-5));
            last = far;
        }
        tl_mem_free(ctx, order.tets);
        close_scene(ctx, &s);
    }
    make_release(&m);
    check_ctx_destroy(ctx);
}

/* Neither tets beside the picture and behind the camera nor those that show nothing. */
static void unseen_tets_are_left_out(void **state)
{
    (void)state;
    static const tl_color_point white = {0, {1, 1, 1}};
    static const tl_opacity_point above[3] = {{0.65, 0}, {0.7, 0.5}, {1, 0.5}};
    tl_ctx *ctx = check_ctx_create(1);
    make_mesh m = make_grid(6);
    scene s = open_scene(ctx, &m, 20, 30, false);
    tli_order order;
    tli_order_view view = view_of(&s);
    tl_transfer *t = NULL;
    CHECK_OK(ctx, tl_transfer_create(ctx, &white, 1, above, 3, 1, &t));
    view.transfer = t;
    for (size_t v = 0; v < m.vert_count; v++) /* below 0.65 nothing is seen */
        s.verts[v].s = (float)((m.xyz[3 * v + 2] - t->low) * t->per_value);
    CHECK_OK(ctx, tli_order_exact(ctx, &view, &order));
    for (size_t i = 0; i < order.count; i++) {
        double high = 0;
        for (int k = 0; k < 4; k++)
            high = fmax(high, m.xyz[3 * (size_t)m.tets[4 * order.tets[i] + (size_t)k] + 2]);
        CHECK(high > 0.7);
    }
    CHECK_EQ(order.count, m.tet_count / 5 * 2); /* two of five layers */
    tl_mem_free(ctx, order.tets);
    for (size_t v = 0; v < m.vert_count; v++) s.verts[v].z = -1;
    CHECK_OK(ctx, tli_order_exact(ctx, &view, &order));
    CHECK_EQ(order.count, 0);
    tl_mem_free(ctx, order.tets);
    tl_transfer_destroy(ctx, t);
    close_scene(ctx, &s);
    make_release(&m);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grids_are_in_order),       cmocka_unit_test(gaps_are_in_order),
        cmocka_unit_test(rings_are_counted),        cmocka_unit_test(centroids_fall),
        cmocka_unit_test(unseen_tets_are_left_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
