/* tetralod bench: the project's own figures. Each figure stands beside the facts that it depends
 * on, is taken after a warm-up with a monotonic clock, and its result is verified in the same run.
 */
#include "cli_bench.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <unistd.h>

static const cli_option OPTIONS[] = {
    {CLI_DATA, 0, "data", CLI_TYPE_LIST, "FILE", NULL, 0, 0, "bench this file instead of samples"},
    {CLI_SAMPLE, 0, "sample", CLI_TYPE_LIST, "NAME", NULL, 0, 0,
     "bench this sample; without it, all, for lines sphere-flow"},
    {CLI_SIZES, 0, "size", CLI_TYPE_LIST, "N", NULL, 0, 0,
     "size of the samples, as in 'tetralod sample'; without it 64 (1.25 million tets of a grid); "
     "live: pixels, WxH, without it 1280x800"},
    {CLI_CHANNEL, 0, "channel", CLI_TYPE_TEXT, "NAME", NULL, 0, 0,
     "the channel that takes part; without it the first scalar on vertices, of lines the first "
     "vectors"},
    {CLI_RUNS, 0, "runs", CLI_TYPE_COUNT, "N", "3", 1, BENCH_RUNS_MAX,
     "measured runs after a warm-up"},
    {CLI_KEEP, 0, "keep", CLI_TYPE_AMOUNT, "R", "0.1", 1e-6, 1,
     "simplify: part of the tets to keep"},
    {CLI_METHOD, 0, "method", CLI_TYPE_CHOICE, "auto|queue|independent|randomized|blocks", "auto",
     0, 0, "simplify: order of the collapses"},
    {CLI_RENDERER, 0, "renderer", CLI_TYPE_CHOICE, "cpu|gl", "cpu", 0, 0,
     "draw, live: what draws; gl is compared with the processor"},
    {CLI_SECONDS, 0, "seconds", CLI_TYPE_REAL, "S", "4", 0.1, 1e5,
     "live: how long the camera turns, each time"},
    {CLI_THROTTLE, 0, "throttle", CLI_TYPE_REAL, "MB", "0", 0, 1e9,
     "live: reads no more than this in a second, as a slow disk does; 0 reads as it goes"},
};
static const cli_option PEER[] = {
    {CLI_AGAINST_VTK, 0, "against-vtk", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "run VTK on the same data in the same run, with /usr/bin/python3"},
    {CLI_VTK_SCALE, 0, "vtk-scale", CLI_TYPE_REAL, "S", "0", 0, 1e9,
     "factor on the coordinates that VTK gets; 0 takes 1, and 100 where VTK stalls at 1"},
    {CLI_SCRIPT, 0, "script", CLI_TYPE_INPUT, "FILE", NULL, 0, 0, "the script that runs VTK"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};
static const cli_group PEER_GROUP = {"Peer", PEER, sizeof PEER / sizeof *PEER};

/* Vertices along a side of a sample where nothing is said. */
#define DEFAULT_SIZE 64

/* ---- shared helpers ---- */

static int compare_seconds(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double bench_median(const bench_times *times)
{
    bench_times sorted = *times;
    qsort(sorted.seconds, sorted.count, sizeof *sorted.seconds, compare_seconds);
    return sorted.count
               ? (sorted.seconds[(sorted.count - 1) / 2] + sorted.seconds[sorted.count / 2]) / 2
               : 0;
}

double bench_least(const bench_times *times)
{
    double least = times->count ? times->seconds[0] : 0;
    for (size_t i = 1; i < times->count; i++)
        if (times->seconds[i] < least) least = times->seconds[i];
    return least;
}

static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t count)
{
    const unsigned char *at = bytes;
    for (; count >= 8; count -= 8, at += 8) {
        uint64_t word;
        memcpy(&word, at, 8);
        hash = (hash ^ word) * 0x100000001b3u;
        hash ^= hash >> 29;
    }
    for (; count > 0; count--, at++) hash = (hash ^ *at) * 0x100000001b3u;
    return hash;
}

int bench_sizes(bench_state *state, const bench_data *data, bench_size_fn measure,
                const uint32_t *sizes, size_t size_count, void *rows, size_t row_bytes)
{
    tl_read_opts read;
    tl_status st = TL_OK;
    int exit_status = cli_read_opts(state->session, data->path, &read);
    if (exit_status) return exit_status;
    for (size_t i = 0; !st && i < size_count; i++)
        st = measure(state, data, &read, sizes[i], (char *)rows + i * row_bytes);
    cli_progress_clear(&state->session->progress);
    return st ? cli_fail(state->session, state->session->ctx, st) : CLI_DONE;
}

uint64_t bench_hash(const tl_mesh *mesh)
{
    uint64_t hash = 0xcbf29ce484222325u;
    hash = hash_bytes(hash, tl_mesh_xyz(mesh), tl_mesh_vert_count(mesh) * 3 * sizeof(double));
    hash = hash_bytes(hash, tl_mesh_tets(mesh), tl_mesh_tet_count(mesh) * 4 * sizeof(tl_lidx));
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        size_t values = cli_channel_elems(mesh, channel) * channel->components;
        hash = hash_bytes(hash, channel->values, values * sizeof(double));
    }
    return hash;
}

size_t bench_threads(const bench_state *state, unsigned counts[2])
{
    counts[0] = 1;
    counts[1] = tl_ctx_thread_count(state->session->ctx);
    return counts[1] > 1 ? 2 : 1;
}

int bench_on_mesh(bench_state *state, const bench_data *data, unsigned threads, bench_work_fn work,
                  void *arg)
{
    tl_ctx *ctx = NULL;
    tl_mesh *mesh = NULL;
    tl_status st = cli_context_create(state->session, threads, &ctx);
    if (st) return cli_fail(state->session, NULL, st);
    st = tl_mesh_read(ctx, data->path, NULL, &mesh, NULL);
    if (!st) st = work(state, ctx, mesh, arg);
    int exit_status = st ? cli_fail(state->session, ctx, st) : CLI_DONE;
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
    return exit_status;
}

int bench_each_threads(bench_state *state, const bench_data *data, const bench_steps *steps,
                       void *row, size_t row_bytes)
{
    unsigned threads[2];
    int exit_status = CLI_DONE;
    for (size_t i = 0; i < bench_threads(state, threads) && !exit_status; i++) {
        memset(row, 0, row_bytes);
        exit_status = bench_on_mesh(state, data, threads[i], steps->measure, row);
        if (!exit_status && cli_get(state->session, CLI_AGAINST_VTK)->given)
            exit_status = steps->ask_peer(state, data, row);
        cli_progress_clear(&state->session->progress);
        if (exit_status) break;
        if (!state->rows) {
            steps->print_text(data, row);
            continue;
        }
        json_t *item = cli_json_item(state->rows);
        cli_json_text(item, "data", data->name);
        cli_json_count(item, "tets", data->tet_count);
        steps->add_json(item, data, row);
    }
    return exit_status;
}

/* ---- facts ---- */

/* The text after "key...: " in a file of /proc, or "unknown". */
static cli_text proc_line(const char *path, const char *key)
{
    cli_text text = {"unknown"};
    char line[512];
    FILE *file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file)) {
        const char *colon = strchr(line, ':');
        if (strncmp(line, key, strlen(key)) != 0) continue;
        snprintf(text.s, sizeof text.s, "%.60s", *key && colon ? colon + 2 : line);
        text.s[strcspn(text.s, "\n")] = '\0';
        break;
    }
    if (file) fclose(file);
    return text;
}

#ifdef __clang__
#define COMPILER "clang"
#else
#define COMPILER "gcc"
#endif

static const char *build_text(void)
{
#ifdef __OPTIMIZE__
    return "optimized, " COMPILER " " __VERSION__;
#else
    return "not optimized, " COMPILER " " __VERSION__;
#endif
}

static void facts(const bench_state *state)
{
    struct utsname system = {0};
    cli_text cpu = proc_line("/proc/cpuinfo", "model name");
    cli_text load = proc_line("/proc/loadavg", "");
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    uname(&system);
    load.s[strcspn(load.s, " ")] = '\0';
    if (!state->rows) {
        printf("machine     %s, %ld processors, %s %s, load %s\n", cpu.s, processors,
               system.sysname, system.release, load.s);
        printf("build       tetralod %s, %s\n", cli_version().s, build_text());
        printf("runs        %llu after a warm-up, monotonic clock\n",
               (unsigned long long)cli_get(state->session, CLI_RUNS)->count);
    }
}

static void json_facts(json_t *object, const bench_state *state)
{
    struct utsname system = {0};
    uname(&system);
    cli_json_text(object, "cpu", proc_line("/proc/cpuinfo", "model name").s);
    cli_json_count(object, "processors", (uint64_t)sysconf(_SC_NPROCESSORS_ONLN));
    cli_json_text(object, "system", system.release);
    cli_json_text(object, "build", build_text());
    cli_json_text(object, "version", cli_version().s);
    cli_json_count(object, "runs", cli_get(state->session, CLI_RUNS)->count);
    cli_json_count(object, "broken", state->broken);
    json_object_set(object, "rows", state->rows);
}

/* ---- data sets ---- */

static const tl_channel *pick_channel(const tl_mesh *mesh, const char *name, uint32_t components)
{
    if (name) return cli_vertex_channel(mesh, name);
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        if (channel->on == TL_ON_VERTEX && channel->components == components) return channel;
    }
    return NULL;
}

/* Writes mesh with one of its channels alone to data->path. */
static int write_one_channel(bench_state *state, const tl_mesh *mesh, bench_data *data)
{
    cli_session *session = state->session;
    const char *name = cli_get(session, CLI_CHANNEL)->text;
    const tl_channel *channel = pick_channel(mesh, name, state->components);
    tl_mesh *slim = NULL;
    if (!channel) {
        if (name) return cli_unknown_channel(session, mesh, name);
        fprintf(stderr, "tetralod: '%s' holds no %s on vertices to bench with\n", data->name,
                state->components == 1 ? "scalar" : "vectors");
        return CLI_FAILED;
    }
    tl_status st = tl_mesh_create(session->ctx, tl_mesh_xyz(mesh), tl_mesh_vert_count(mesh),
                                  tl_mesh_tets(mesh), tl_mesh_tet_count(mesh), &slim);
    if (!st) st = tl_mesh_add_channel(slim, channel);
    if (!st) st = tl_mesh_write(session->ctx, slim, data->path, NULL);
    data->tet_count = tl_mesh_tet_count(mesh);
    data->vert_count = tl_mesh_vert_count(mesh);
    if (!st) data->hash = bench_hash(slim);
    tl_mesh_destroy(slim);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* A bench that takes files as they are, whatever their size. */
static int bench_plain_file(bench_state *state, bench_fn bench, const char *name, const char *path)
{
    bench_data data = {0};
    snprintf(data.name, sizeof data.name, "%s", name);
    snprintf(data.path, sizeof data.path, "%s", path);
    int exit_status = bench(state, &data);
    cli_progress_clear(&state->session->progress);
    cli_drop_notes(state->session); /* each run says the same */
    return exit_status;
}

/* Reads a file with the reading options, benches it, and takes the copy away. */
static int bench_file(bench_state *state, bench_fn bench, const char *name, const char *path)
{
    cli_input input;
    bench_data data = {0};
    if (bench == bench_segment || bench == bench_build)
        return bench_plain_file(state, bench, name, path);
    int exit_status = cli_open_volume(state->session, state->session->ctx, path, &input);
    if (exit_status) return exit_status;
    snprintf(data.name, sizeof data.name, "%s", name);
    snprintf(data.path, sizeof data.path, "%.4000s/input.vtu", state->folder);
    exit_status = write_one_channel(state, input.mesh, &data);
    cli_close(&input);
    cli_print_notes(state->session);
    if (!exit_status && !state->rows)
        printf("\ninput       %s: %s tets, %s vertices, hash %016llx\n", data.name,
               cli_count(data.tet_count).s, cli_count(data.vert_count).s,
               (unsigned long long)data.hash);
    if (!exit_status) exit_status = bench(state, &data);
    cli_progress_clear(&state->session->progress);
    cli_drop_notes(state->session); /* of the copy: they say the same again */
    remove(data.path);
    return exit_status;
}

static int bench_sample(bench_state *state, bench_fn bench, const char *sample, const char *size)
{
    char path[BENCH_PATH_BYTES], name[80];
    char *end = NULL;
    unsigned long count = strtoul(size, &end, 10);
    if (*end || count < 2 || count > 100000)
        return cli_misuse(state->session->args.verb, "--size %s: expected a number from 2 on",
                          size);
    snprintf(name, sizeof name, "%.40s %lu", sample, count);
    snprintf(path, sizeof path, "%.4000s/sample.vtu", state->folder);
    tl_status st = tl_sample_write(state->session->ctx, sample, (uint32_t)count, path);
    cli_progress_clear(&state->session->progress);
    int exit_status = st ? cli_fail(state->session, state->session->ctx, st)
                         : bench_file(state, bench, name, path);
    remove(path);
    return exit_status;
}

static int bench_samples(bench_state *state, bench_fn bench)
{
    const cli_value *samples = cli_get(state->session, CLI_SAMPLE);
    const cli_value *sizes = cli_get(state->session, CLI_SIZES);
    char default_size[16];
    int exit_status = CLI_DONE;
    snprintf(default_size, sizeof default_size, "%d", DEFAULT_SIZE);
    for (size_t i = 0; !exit_status; i++) {
        const char *sample = samples->given  ? (i < samples->item_count ? samples->items[i] : NULL)
                             : state->sample ? (i ? NULL : state->sample)
                                             : tl_sample_name(i);
        if (!sample) break;
        for (size_t s = 0; s < (sizes->given ? sizes->item_count : 1) && !exit_status; s++)
            exit_status =
                bench_sample(state, bench, sample, sizes->given ? sizes->items[s] : default_size);
    }
    return exit_status;
}

static int bench_all(bench_state *state, bench_fn bench)
{
    const cli_value *files = cli_get(state->session, CLI_DATA);
    int exit_status = CLI_DONE;
    for (size_t i = 0; i < files->item_count && !exit_status; i++)
        exit_status = bench_file(state, bench, files->items[i], files->items[i]);
    if (!exit_status && (!files->given || cli_get(state->session, CLI_SAMPLE)->given))
        exit_status = bench_samples(state, bench);
    return exit_status;
}

static int bench_models(bench_state *state, bench_fn bench)
{
    const cli_value *files = cli_get(state->session, CLI_DATA);
    int exit_status = CLI_DONE;
    if (!files->given)
        return cli_misuse(state->session->args.verb, "--data M.tlod is missing: which model?");
    for (size_t i = 0; i < files->item_count && !exit_status; i++) {
        bench_data data = {0};
        snprintf(data.name, sizeof data.name, "%s", files->items[i]);
        snprintf(data.path, sizeof data.path, "%s", files->items[i]);
        if (!state->rows) printf("\ninput       %s\n", data.path);
        exit_status = bench(state, &data);
    }
    return exit_status;
}

/* ---- the verb ---- */

/* The benches, a row each. */
static const struct {
    const char *name, *about;
    bench_fn bench;
    bool models; /* takes models instead of meshes */
} BENCHES[] = {
    {"mesh", "adjacency, incidence, boundary, quality, point location", bench_mesh, false},
    {"simplify", "simplification: speed on one and on all threads, errors, memory, validity",
     bench_simplify, false},
    {"segment", "cutting into segments out of core: balance, speed, memory, the stream",
     bench_segment, false},
    {"codec", "bits and CPU time of the codec, one thread, by size of the patches", bench_codec,
     false},
    {"build", "models: speed, memory and size, by size of the segments", bench_build, false},
    {"surface", "isosurfaces at 40 % of the range: with and without a range index", bench_surface,
     false},
    {"lines", "streamlines of second order from a thousand seeds", bench_lines, false},
    {"draw", "volume rendering by the processor or OpenGL, 512 x 512 pixels", bench_draw, false},
    {"cut", "a model: opening it, moving its cut, extracting meshes", bench_cut, true},
    {"view", "a model: the first picture, off by a pixel and at full resolution", bench_view, true},
    {"live", "a model: frames a second while the camera turns, waiting at rest", bench_live, true},
};
enum { BENCH_COUNT = sizeof BENCHES / sizeof *BENCHES };

static const char *word(size_t index)
{
    return index < BENCH_COUNT ? BENCHES[index].name : NULL;
}

static size_t find_bench(const char *name)
{
    size_t i = 0;
    while (i < BENCH_COUNT && strcmp(BENCHES[i].name, name) != 0) i++;
    return i;
}

static const char *word_about(const char *name)
{
    return BENCHES[find_bench(name)].about;
}

static int make_folder(bench_state *state)
{
    const char *parent = getenv("TMPDIR");
    snprintf(state->folder, sizeof state->folder, "%.4000s/tetralod-bench-XXXXXX",
             parent && *parent ? parent : "/tmp");
    if (mkdtemp(state->folder)) return CLI_DONE;
    fprintf(stderr, "tetralod: can't make the folder '%s': %s\n", state->folder, strerror(errno));
    return CLI_FAILED;
}

static int run(cli_session *session)
{
    const char *name = session->args.operands[0];
    bench_state state = {.session = session};
    size_t bench = find_bench(name);
    if (bench == BENCH_COUNT) return cli_misuse(session->args.verb, "there is no bench '%s'", name);
    int exit_status = make_folder(&state);
    if (exit_status) return exit_status;
    if (cli_get(session, CLI_JSON)->given) state.rows = json_array();
    state.components = BENCHES[bench].bench == bench_lines ? 3 : 1;
    state.sample = BENCHES[bench].bench == bench_lines ? "sphere-flow" : NULL;
    facts(&state);
    exit_status = BENCHES[bench].models ? bench_models(&state, BENCHES[bench].bench)
                                        : bench_all(&state, BENCHES[bench].bench);
    if (state.rows && !exit_status) {
        json_t *object = json_object();
        json_facts(object, &state);
        cli_json_print(object);
    }
    json_decref(state.rows);
    rmdir(state.folder);
    if (!exit_status && state.broken) {
        fprintf(stderr, "tetralod: %zu results failed their verification\n", state.broken);
        exit_status = CLI_FAILED;
    }
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod bench mesh",
    "Adjacency, boundary, location on all samples of 1.25 million tets",
    "tetralod bench simplify --against-vtk",
    "Speed and errors beside those of VTK",
    "tetralod bench simplify --sample gaussians --size 28 --size 64 --size 128",
    "How the cost grows: 0.1, 1.25 and 10 million tets",
    "tetralod bench segment --data large.vtu --memory 256M",
    "How balanced the segments of a file are, and how fast they are made in that memory",
    NULL};

const cli_verb cli_verb_bench = {
    .name = "bench",
    .operands = "NAME",
    .operand_least = 1,
    .operand_most = 1,
    .about = "measure speed, errors and memory, side by side with VTK",
    .details = "Each result is verified in the same run; a broken one ends in exit status 1.",
    .groups = {&GROUP, &PEER_GROUP, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run,
    .word = word,
    .word_about = word_about};
