/* How fast the stage mesh is: incidence, adjacency, boundary, point location, with one thread and
 * with more. Data sets are folders with points.f32 ([n][3]) and tets.i32 ([m][4]), raw arrays in
 * the byte order of the machine, or a generated grid. Every result is verified in the run that is
 * timed.
 *
 *     bench_mesh [--runs N] [--threads N] [--grid N] [--shuffle] [--cpu] [FOLDER]... */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "tetralod/tetralod.h"

#define RUNS_MAX 101
#define POINT_COUNT 200000
#define OUTSIDE_COUNT 10000

typedef struct options {
    int runs;
    unsigned threads;
    size_t grid;
    bool shuffle;
} options;

typedef struct raw {
    const char *name;
    double *xyz;
    size_t vert_count;
    tl_lidx *tets;
    size_t tet_count;
} raw;

/* CLOCK_MONOTONIC, or with --cpu the time of all threads together: repeatable on a busy machine. */
static clockid_t bench_clock = CLOCK_MONOTONIC;

static double now_s(void)
{
    struct timespec t;
    clock_gettime(bench_clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void die(const char *what, const char *about)
{
    fprintf(stderr, "bench_mesh: %s: %s\n", what, about);
    exit(1);
}

static void check(bool good, const char *what)
{
    if (!good) die("wrong result", what);
}

static void check_ok(tl_ctx *ctx, tl_status st)
{
    if (st) die(tl_status_name(st), tl_ctx_message(ctx));
}

/* splitmix64 */
static uint64_t random_next(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static double random_unit(uint64_t *state)
{
    return (double)(random_next(state) >> 11) * 0x1p-53;
}

/* ---- input ---- */

static void *read_all(const char *folder, const char *file, size_t *bytes)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, file);
    FILE *in = fopen(path, "rb");
    if (!in) die("can't open", path);
    if (fseeko(in, 0, SEEK_END) != 0) die("can't read", path);
    *bytes = (size_t)ftello(in);
    rewind(in);
    void *block = malloc(*bytes + 1);
    if (!block || fread(block, 1, *bytes, in) != *bytes) die("can't read", path);
    fclose(in);
    return block;
}

static raw read_raw(const char *folder)
{
    raw r = {.name = folder};
    size_t bytes = 0;
    float *points = read_all(folder, "points.f32", &bytes);
    r.vert_count = bytes / 12;
    r.xyz = malloc(bytes * 2 + 1);
    if (!r.xyz) die("no memory", folder);
    for (size_t i = 0; i < 3 * r.vert_count; i++) r.xyz[i] = (double)points[i];
    free(points);
    r.tets = read_all(folder, "tets.i32", &bytes);
    r.tet_count = bytes / 16;
    return r;
}

static raw make_grid(size_t n)
{
    static const unsigned char split[2][5][4] = {
        {{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}},
        {{1, 3, 0, 5}, {2, 0, 3, 6}, {4, 6, 5, 0}, {7, 5, 6, 3}, {0, 5, 3, 6}}};
    raw r = {.name = "grid", .vert_count = n * n * n, .tet_count = 5 * (n - 1) * (n - 1) * (n - 1)};
    r.xyz = malloc(3 * r.vert_count * sizeof *r.xyz);
    r.tets = malloc(4 * r.tet_count * sizeof *r.tets);
    if (!r.xyz || !r.tets) die("no memory", "grid");
    for (size_t v = 0; v < r.vert_count; v++) {
        r.xyz[3 * v] = (double)(v % n);
        r.xyz[3 * v + 1] = (double)(v / n % n);
        r.xyz[3 * v + 2] = (double)(v / n / n);
    }
    tl_lidx *out = r.tets;
    for (size_t k = 0; k + 1 < n; k++)
        for (size_t j = 0; j + 1 < n; j++)
            for (size_t i = 0; i + 1 < n; i++)
                for (size_t c = 0; c < 20; c++) {
                    size_t at = split[(i + j + k) & 1][c / 4][c % 4];
                    *out++ =
                        (tl_lidx)(i + (at & 1) + n * (j + (at >> 1 & 1) + n * (k + (at >> 2))));
                }
    return r;
}

/* Random order of vertices and tets: the worst that a mesh generator hands out. */
static void shuffle(raw *r)
{
    uint64_t seed = 1;
    tl_lidx *place = malloc(r->vert_count * sizeof *place);
    double *xyz = malloc(3 * r->vert_count * sizeof *xyz);
    if (!place || !xyz) die("no memory", "shuffle");
    for (size_t v = 0; v < r->vert_count; v++) place[v] = (tl_lidx)v;
    for (size_t v = r->vert_count; v > 1; v--) {
        size_t other = (size_t)(random_next(&seed) % v);
        tl_lidx kept = place[v - 1];
        place[v - 1] = place[other];
        place[other] = kept;
    }
    for (size_t v = 0; v < r->vert_count; v++)
        memcpy(xyz + 3 * (size_t)place[v], r->xyz + 3 * v, 24);
    free(r->xyz);
    r->xyz = xyz;
    for (size_t i = 0; i < 4 * r->tet_count; i++) r->tets[i] = place[r->tets[i]];
    for (size_t t = r->tet_count; t > 1; t--) {
        tl_lidx kept[4], *a = r->tets + 4 * (t - 1),
                         *b = r->tets + 4 * (size_t)(random_next(&seed) % t);
        memcpy(kept, a, sizeof kept);
        memmove(a, b, sizeof kept);
        memcpy(b, kept, sizeof kept);
    }
    free(place);
}

static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t count)
{
    const unsigned char *p = bytes;
    for (size_t i = 0; i < count; i++) hash = (hash ^ p[i]) * 0x100000001b3u;
    return hash;
}

/* ---- verification ---- */

static void check_incidence(const raw *r, const tl_lidx *offsets, const tl_lidx *ids)
{
    check(offsets[0] == 0 && offsets[r->vert_count] == 4 * r->tet_count, "incidence: ends");
    for (size_t v = 0; v < r->vert_count; v++) {
        for (size_t i = offsets[v]; i < offsets[v + 1]; i++) {
            const tl_lidx *t = r->tets + 4 * (size_t)ids[i];
            check(t[0] == v || t[1] == v || t[2] == v || t[3] == v, "incidence: not at the vertex");
            check(i == offsets[v] || ids[i - 1] < ids[i], "incidence: order");
        }
    }
}

/* A sum over the vertices that is the same for equal faces, and nearly surely for no others. */
static uint64_t face_hash(const raw *r, size_t face)
{
    uint64_t sum = 0;
    for (size_t c = 0; c < 4; c++) {
        uint64_t state = r->tets[face / 4 * 4 + c];
        if (c != face % 4) sum += random_next(&state);
    }
    return sum;
}

static size_t check_adjacency(const raw *r, const tl_lidx *opposite)
{
    size_t open = 0;
    for (size_t f = 0; f < 4 * r->tet_count; f++) {
        open += opposite[f] == TL_NONE;
        if (opposite[f] == TL_NONE) continue;
        check(opposite[opposite[f]] == f, "adjacency: one-sided");
        check(face_hash(r, f) == face_hash(r, opposite[f]), "adjacency: other face");
    }
    return open;
}

/* A closed surface has each directed edge as often as its opposite. */
static void check_boundary(const tl_lidx *triangles, size_t count)
{
    uint64_t sum = 0;
    for (size_t i = 0; i < 3 * count; i++) {
        tl_lidx a = triangles[i], b = triangles[i % 3 == 2 ? i - 2 : i + 1];
        uint64_t state = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
        uint64_t edge = random_next(&state);
        sum += a < b ? edge : -edge;
    }
    check(sum == 0, "boundary: not closed");
}

/* ---- the jobs ---- */

typedef struct job {
    tl_ctx *ctx;
    const raw *r;
    tl_mesh *mesh;
    size_t open;    /* faces without partner, by the adjacency */
    double *points; /* [POINT_COUNT][3] inside the mesh */
    tl_lidx *homes; /* [POINT_COUNT] a tet next to the point's */
    tl_lidx *opposite;
    tl_locator *locator;
} job;

static double run_incidence(job *j)
{
    tl_lidx *offsets, *ids;
    double begin = now_s();
    check_ok(j->ctx, tl_mesh_incidence(j->ctx, j->mesh, &offsets, &ids));
    double seconds = now_s() - begin;
    check_incidence(j->r, offsets, ids);
    tl_mem_free(j->ctx, ids);
    tl_mem_free(j->ctx, offsets);
    return seconds;
}

static double run_adjacency(job *j)
{
    tl_lidx *opposite;
    size_t nonmanifold;
    double begin = now_s();
    check_ok(j->ctx, tl_mesh_adjacency(j->ctx, j->mesh, &opposite, &nonmanifold));
    double seconds = now_s() - begin;
    check(nonmanifold == 0, "adjacency: non-manifold faces");
    j->open = check_adjacency(j->r, opposite);
    tl_mem_free(j->ctx, opposite);
    return seconds;
}

static double run_boundary(job *j)
{
    tl_lidx *triangles;
    size_t count;
    double begin = now_s();
    check_ok(j->ctx, tl_mesh_boundary(j->ctx, j->mesh, NULL, &triangles, NULL, &count));
    double seconds = now_s() - begin;
    check(count == j->open, "boundary: count");
    check_boundary(triangles, count);
    tl_mem_free(j->ctx, triangles);
    return seconds;
}

static int by_value(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

static void report(const options *o, job *j, const char *what, size_t count, double (*run)(job *))
{
    double seconds[RUNS_MAX];
    run(j); /* warms up */
    tl_ctx_reset_peak(j->ctx);
    size_t before = tl_ctx_current_bytes(j->ctx);
    for (int i = 0; i < o->runs; i++) seconds[i] = run(j);
    qsort(seconds, (size_t)o->runs, sizeof *seconds, by_value);
    double median = seconds[o->runs / 2];
    printf("%-24s threads %u  runs %d  min %8.3f ms  median %8.3f ms  %7.2f M/s  (min %.2f M/s)  "
           "peak %5.1f B/tet over %.1f\n",
           what, tl_ctx_thread_count(j->ctx), o->runs, 1e3 * seconds[0], 1e3 * median,
           1e-6 * (double)count / median, 1e-6 * (double)count / seconds[0],
           (double)(tl_ctx_peak_bytes(j->ctx) - before) / (double)j->r->tet_count,
           (double)before / (double)j->r->tet_count);
}

/* Points in random tets, and a tet next to each. */
static void make_points(job *j)
{
    const raw *r = j->r;
    uint64_t seed = 2;
    j->points = malloc(3 * POINT_COUNT * sizeof *j->points);
    j->homes = malloc(POINT_COUNT * sizeof *j->homes);
    if (!j->points || !j->homes) die("no memory", "points");
    for (size_t i = 0; i < POINT_COUNT; i++) {
        size_t tet = (size_t)(random_next(&seed) % r->tet_count);
        double w[4], sum = 0;
        for (int c = 0; c < 4; c++) sum += w[c] = random_unit(&seed);
        for (size_t k = 0; k < 3; k++) {
            double *x = &j->points[3 * i + k];
            *x = 0;
            for (size_t c = 0; c < 4; c++)
                *x += w[c] / sum * r->xyz[3 * (size_t)r->tets[4 * tet + c] + k];
        }
        tl_lidx side = j->opposite[4 * tet + i % 4];
        j->homes[i] = side == TL_NONE ? (tl_lidx)tet : side / 4;
    }
}

/* The weights give the point back. */
static void check_point(const raw *r, tl_lidx tet, const double w[4], const double x[3])
{
    check(tet != TL_NONE, "locator: a point of the mesh is not found");
    for (size_t k = 0; k < 3; k++) {
        double y = 0, size = 0;
        for (size_t c = 0; c < 4; c++) {
            double corner = r->xyz[3 * (size_t)r->tets[4 * (size_t)tet + c] + k];
            y += w[c] * corner;
            size = fmax(size, fabs(corner));
        }
        check(w[0] >= 0 && w[1] >= 0 && w[2] >= 0 && w[3] >= 0, "locator: weights");
        check(fabs(y - x[k]) <= 1e-9 * size, "locator: place");
    }
}

static double find_points(job *j, bool with_hint)
{
    double begin = now_s(), seconds = 0;
    for (size_t i = 0; i < POINT_COUNT; i++) {
        double w[4];
        const double *x = j->points + 3 * i;
        tl_lidx tet = tl_locator_find(j->locator, x, with_hint ? j->homes[i] : TL_NONE, w);
        if (i % 64 == 0) {
            seconds += now_s() - begin;
            check_point(j->r, tet, w, x);
            begin = now_s();
        }
    }
    return seconds + now_s() - begin;
}

static double run_find_hint(job *j)
{
    return find_points(j, true);
}

static double run_find_tree(job *j)
{
    return find_points(j, false);
}

/* Points around the mesh, up to half of its size away. */
static double run_nearest(job *j)
{
    uint64_t seed = 3;
    double low[3], high[3], seconds = 0;
    for (size_t i = 0; i < 3 * j->r->vert_count; i++) {
        double x = j->r->xyz[i];
        low[i % 3] = i < 3 ? x : fmin(low[i % 3], x);
        high[i % 3] = i < 3 ? x : fmax(high[i % 3], x);
    }
    for (size_t i = 0; i < OUTSIDE_COUNT; i++) {
        double x[3], w[4], distance = -1;
        for (int k = 0; k < 3; k++)
            x[k] = low[k] + (high[k] - low[k]) * (2 * random_unit(&seed) - 0.5);
        size_t axis = i % 3;
        x[axis] = high[axis] + 0.5 * (high[axis] - low[axis]) * random_unit(&seed);
        double begin = now_s();
        tl_lidx tet = tl_locator_nearest(j->locator, x, TL_NONE, w, &distance);
        seconds += now_s() - begin;
        double square = 0;
        check(tet != TL_NONE && distance >= 0, "nearest: nothing found");
        for (size_t k = 0; k < 3; k++) {
            double y = -x[k];
            for (size_t c = 0; c < 4; c++)
                y += w[c] * j->r->xyz[3 * (size_t)j->r->tets[4 * (size_t)tet + c] + k];
            square += y * y;
        }
        check(fabs(sqrt(square) - distance) <= 1e-9 * (1 + distance), "nearest: distance");
    }
    return seconds;
}

static double run_create_locator(job *j)
{
    tl_locator *locator;
    double begin = now_s();
    check_ok(j->ctx, tl_locator_create(j->ctx, j->mesh, j->opposite, &locator));
    double seconds = now_s() - begin;
    tl_locator_destroy(locator);
    return seconds;
}

static double run_measure(job *j)
{
    tl_mesh_stats stats;
    double begin = now_s();
    check_ok(j->ctx, tl_mesh_measure(j->ctx, j->mesh, &stats));
    double seconds = now_s() - begin;
    check(stats.boundary_triangles == j->open && stats.inverted == 0, "measure: counts");
    return seconds;
}

static void bench(const options *o, const raw *r, unsigned threads)
{
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = threads;
    job j = {.r = r};
    if (tl_ctx_create(&opts, &j.ctx)) die("can't create", "context");
    check_ok(j.ctx, tl_mesh_create(j.ctx, r->xyz, r->vert_count, r->tets, r->tet_count, &j.mesh));
    report(o, &j, "incidence", r->tet_count, run_incidence);
    report(o, &j, "adjacency", r->tet_count, run_adjacency);
    report(o, &j, "boundary", r->tet_count, run_boundary);
    report(o, &j, "measure", r->tet_count, run_measure);
    check_ok(j.ctx, tl_mesh_adjacency(j.ctx, j.mesh, &j.opposite, NULL));
    report(o, &j, "locator create", r->tet_count, run_create_locator);
    if (threads == 1) { /* asking starts no threads */
        make_points(&j);
        check_ok(j.ctx, tl_locator_create(j.ctx, j.mesh, j.opposite, &j.locator));
        report(o, &j, "find, hint next to it", POINT_COUNT, run_find_hint);
        report(o, &j, "find, no hint", POINT_COUNT, run_find_tree);
        report(o, &j, "nearest, outside", OUTSIDE_COUNT, run_nearest);
        tl_locator_destroy(j.locator);
        free(j.points);
        free(j.homes);
    }
    tl_mem_free(j.ctx, j.opposite);
    tl_mesh_destroy(j.mesh);
    tl_ctx_destroy(j.ctx);
}

static void bench_set(const options *o, raw r)
{
    if (o->shuffle) shuffle(&r);
    uint64_t hash = hash_bytes(0xcbf29ce484222325u, r.xyz, 24 * r.vert_count);
    hash = hash_bytes(hash, r.tets, 16 * r.tet_count);
    printf("input %s%s: %zu vertices, %zu tets, hash %016llx\n", r.name,
           o->shuffle ? " shuffled" : "", r.vert_count, r.tet_count, (unsigned long long)hash);
    for (unsigned threads = 1; threads <= o->threads; threads++) bench(o, &r, threads);
    free(r.xyz);
    free(r.tets);
}

static void print_machine(void)
{
    char line[256] = "unknown processor\n";
    FILE *in = fopen("/proc/cpuinfo", "r");
    while (in && fgets(line, sizeof line, in))
        if (strncmp(line, "model name", 10) == 0) break;
    if (in) fclose(in);
    const char *colon = strchr(line, ':');
    printf("machine %ld processors,%s", sysconf(_SC_NPROCESSORS_ONLN), colon ? colon + 1 : line);
#if defined(__VERSION__) && defined(__OPTIMIZE__)
    printf("build tetralod %d, compiler %s, optimized\n", tl_version(), __VERSION__);
#else
    printf("build tetralod %d, not optimized\n", tl_version());
#endif
}

int main(int argc, char **argv)
{
    options o = {.runs = 9, .threads = 2, .grid = 64};
    int sets = 0;
    print_machine();
    for (int i = 1; i < argc; i++) {
        bool more = i + 1 < argc;
        if (strcmp(argv[i], "--shuffle") == 0) {
            o.shuffle = true;
        } else if (strcmp(argv[i], "--cpu") == 0) {
            bench_clock = CLOCK_PROCESS_CPUTIME_ID;
            puts("clock: processor time of all threads");
        } else if (more && strcmp(argv[i], "--runs") == 0) {
            o.runs = atoi(argv[++i]);
        } else if (more && strcmp(argv[i], "--threads") == 0) {
            o.threads = (unsigned)atoi(argv[++i]);
        } else if (more && strcmp(argv[i], "--grid") == 0) {
            o.grid = (size_t)atoi(argv[++i]);
            if (o.grid < 2 || o.grid > 512) die("--grid takes 2 to 512", argv[i]);
            bench_set(&o, make_grid(o.grid));
            sets++;
        } else {
            if (o.runs < 1 || o.runs > RUNS_MAX) die("--runs takes", "1 to 101");
            bench_set(&o, read_raw(argv[i]));
            sets++;
        }
    }
    if (!sets) bench_set(&o, make_grid(o.grid));
    return 0;
}
