/* tetralod probe: values at points and along lines, integrals and statistics, as a table. */
#include <math.h>
#include <string.h>

#include "cli_file.h"
#include "cli_volume.h"

enum { ALONG_DEFAULT = 201, POINTS_MAX = 10000000 };

static const cli_option OPTIONS[] = {
    {CLI_AT, 0, "at", CLI_TYPE_LIST, "X,Y,Z", NULL, 0, 0, "values at a point"},
    {CLI_ALONG, 0, "along", CLI_TYPE_TEXT, "X0,Y0,Z0,X1,Y1,Z1[,N]", NULL, 0, 0,
     "values at N points (201 if not said) from one end of a line to the other"},
    {CLI_INTEGRAL, 0, "integral", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "volume, and integral and mean of each component over it"},
    {CLI_STATISTICS, 0, "statistics", CLI_TYPE_FLAG, NULL, NULL, 0, 0,
     "the same, and smallest and largest value, standard deviation, and the values that parts of "
     "the volume lie below"},
    {CLI_CHANNELS, 0, "channels", CLI_TYPE_LIST, "A,B", NULL, 0, 0, "of these channels alone"},
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "OUT.csv", NULL, 0, 0,
     "write the table there; without it to stdout"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

typedef struct probe {
    cli_session *session;
    cli_volume volume;
    const tl_mesh *mesh;
    double (*points)[3];
    size_t point_count, inside_count;
    bool is_along;
    FILE *out;
    json_t *rows; /* with --json, of integrals and statistics */
} probe;

/* ---- words ---- */

static int take_points(probe *p)
{
    tl_status st = TL_OK;
    double ends[7];
    tl_ctx *ctx = p->session->ctx;
    const cli_verb *verb = p->session->args.verb;
    const cli_value *at = cli_get(p->session, CLI_AT), *along = cli_get(p->session, CLI_ALONG);
    p->is_along = along->given;
    p->point_count = at->item_count;
    if (along->given) {
        ends[6] = ALONG_DEFAULT;
        if (!cli_parse_reals(along->text, ends, 7) && !cli_parse_reals(along->text, ends, 6))
            return cli_misuse(verb, "--along %s: expected X0,Y0,Z0,X1,Y1,Z1[,N]", along->text);
        if (!(ends[6] >= 2 && ends[6] <= POINTS_MAX) || ends[6] != floor(ends[6]))
            return cli_misuse(verb, "--along %s: expected 2 to %d points", along->text, POINTS_MAX);
        p->point_count = (size_t)ends[6];
    }
    p->points = tl_mem_alloc(ctx, p->point_count, sizeof *p->points, &st);
    if (st) return cli_fail(p->session, ctx, st);
    for (size_t i = 0; i < p->point_count; i++) {
        const double t = p->is_along ? (double)i / (double)(p->point_count - 1) : 0;
        for (int k = 0; p->is_along && k < 3; k++)
            p->points[i][k] = ends[k] * (1 - t) + ends[3 + k] * t;
        if (!p->is_along && !cli_parse_reals(at->items[i], p->points[i], 3))
            return cli_misuse(verb, "--at %s: expected X,Y,Z", at->items[i]);
    }
    return CLI_DONE;
}

static int check_words(probe *p)
{
    static const cli_id JOBS[] = {CLI_AT, CLI_ALONG, CLI_INTEGRAL, CLI_STATISTICS};
    const cli_value *out = cli_get(p->session, CLI_OUTPUT);
    int jobs = 0;
    for (size_t i = 0; i < sizeof JOBS / sizeof *JOBS; i++)
        jobs += cli_get(p->session, JOBS[i])->given;
    if (jobs != 1)
        return cli_misuse(p->session->args.verb,
                          "say one of --at, --along, --integral and --statistics");
    int failed = out->given ? cli_output_folder(out->text) : CLI_DONE;
    return failed ? failed : take_points(p);
}

static bool is_wanted(const probe *p, const tl_channel *channel)
{
    const cli_value *list = cli_get(p->session, CLI_CHANNELS);
    return !list->given || cli_list_names(list, channel->name);
}

static bool has_channel(const void *mesh, const char *name)
{
    return tl_mesh_channel_by_name(mesh, name) != NULL;
}

static int check_channels(const probe *p)
{
    char name[CLI_NAME_BYTES];
    const cli_value *list = cli_get(p->session, CLI_CHANNELS);
    return cli_list_unknown(list, has_channel, p->mesh, name)
               ? cli_unknown_channel(p->session, p->mesh, name)
               : CLI_DONE;
}

/* The promised error of a channel; infinite of what was made here, 0 of a file. */
static double promise(const probe *p, const tl_channel *channel)
{
    if (!p->volume.is_model) return 0;
    for (size_t i = 0; i < p->volume.error_count; i++)
        if (strcmp(p->volume.errors[i].channel, channel->name) == 0)
            return p->volume.errors[i].error;
    return (double)INFINITY;
}

/* ---- tables ---- */

/* A name with quotes around it, those in it twice. */
static void put_name(FILE *out, const char *name, const char *suffix)
{
    fputc('"', out);
    for (const char *c = name; *c; c++) {
        if (*c == '"') fputc('"', out);
        fputc((unsigned char)*c < 0x20 ? ' ' : *c, out);
    }
    fprintf(out, "%s\"", suffix);
}

/* Numbers that are none are left empty. */
static void put_real(FILE *out, double value)
{
    if (isfinite(value)) fprintf(out, "%.17g", value);
}

/* "" of a scalar, "_x" ... of vectors, "_3" of others, "_length" behind the last one. */
static const char *suffix_of(uint32_t components, uint32_t k, char text[16])
{
    text[0] = '\0';
    if (components == 1) return text;
    if (k == components) return "_length";
    snprintf(text, 16, components == 3 ? "_%c" : "_%u", components == 3 ? 'x' + k : k);
    return text;
}

static void put_point_head(const probe *p)
{
    fputs(p->is_along ? "x,y,z,distance,tet" : "x,y,z,tet", p->out);
    for (size_t c = 0; c < tl_mesh_channel_count(p->mesh); c++) {
        const tl_channel *channel = tl_mesh_channel(p->mesh, c);
        char text[16];
        if (!is_wanted(p, channel)) continue;
        for (uint32_t k = 0; k < channel->components; k++) {
            fputc(',', p->out);
            put_name(p->out, channel->name, suffix_of(channel->components, k, text));
        }
        if (!p->volume.is_model) continue;
        fputc(',', p->out);
        put_name(p->out, channel->name, "_within");
    }
    fputc('\n', p->out);
}

static void put_point(const probe *p, const tl_probe *here)
{
    double distance = 0;
    for (int k = 0; k < 3; k++) {
        put_real(p->out, here->xyz[k]);
        fputc(',', p->out);
        distance = hypot(distance, here->xyz[k] - p->points[0][k]);
    }
    if (p->is_along) {
        put_real(p->out, distance);
        fputc(',', p->out);
    }
    if (here->is_inside) fprintf(p->out, "%lu", (unsigned long)here->tet);
    for (size_t c = 0; c < here->value_count; c++) {
        const tl_channel *channel = tl_mesh_channel(p->mesh, c);
        if (!is_wanted(p, channel)) continue;
        for (uint32_t k = 0; k < channel->components; k++) {
            fputc(',', p->out);
            if (here->is_inside) put_real(p->out, here->values[c].values[k]);
        }
        if (!p->volume.is_model) continue;
        fputc(',', p->out);
        put_real(p->out, promise(p, channel));
    }
    fputc('\n', p->out);
}

static tl_status put_points(probe *p)
{
    tl_locator *locator = NULL;
    tl_probe here = {0};
    tl_status st = tl_locator_create(p->session->ctx, p->mesh, NULL, &locator);
    if (!st) put_point_head(p);
    for (size_t i = 0; !st && i < p->point_count; i++) {
        st = tl_mesh_probe(p->session->ctx, p->mesh, locator, p->points[i], &here);
        if (!st) put_point(p, &here);
        p->inside_count += here.is_inside;
    }
    tl_probe_release(p->session->ctx, &here);
    tl_locator_destroy(locator);
    return st;
}

static const struct {
    const char *name;
    size_t offset;
    bool with_integral;
} COLUMNS[] = {{"volume", offsetof(tl_statistics, volume), true},
               {"integral", offsetof(tl_statistics, integral), true},
               {"mean", offsetof(tl_statistics, mean), true},
               {"least", offsetof(tl_statistics, least), false},
               {"most", offsetof(tl_statistics, most), false},
               {"deviation", offsetof(tl_statistics, deviation), false},
               {"p1", offsetof(tl_statistics, parts[0]), false},
               {"p5", offsetof(tl_statistics, parts[1]), false},
               {"p25", offsetof(tl_statistics, parts[2]), false},
               {"p50", offsetof(tl_statistics, parts[3]), false},
               {"p75", offsetof(tl_statistics, parts[4]), false},
               {"p95", offsetof(tl_statistics, parts[5]), false},
               {"p99", offsetof(tl_statistics, parts[6]), false}};
enum { COLUMN_COUNT = sizeof COLUMNS / sizeof *COLUMNS };

static void put_row(probe *p, const tl_channel *channel, uint32_t component, const tl_statistics *s)
{
    char text[16], name[CLI_NAME_BYTES + 16];
    const bool all = cli_get(p->session, CLI_STATISTICS)->given;
    const char *suffix = suffix_of(channel->components, component, text);
    snprintf(name, sizeof name, "%s%s", channel->name, suffix);
    json_t *row = cli_json_item(p->rows);
    cli_json_text(row, "channel", name);
    put_name(p->out, channel->name, suffix);
    for (size_t c = 0; c < COLUMN_COUNT; c++) {
        double value;
        if (!all && !COLUMNS[c].with_integral) continue;
        memcpy(&value, (const char *)s + COLUMNS[c].offset, sizeof value);
        fputc(',', p->out);
        put_real(p->out, value);
        cli_json_real(row, COLUMNS[c].name, value);
    }
    fputc(',', p->out);
    put_real(p->out, promise(p, channel));
    cli_json_real(row, "within", promise(p, channel));
    fputc('\n', p->out);
}

static tl_status put_statistics(probe *p)
{
    tl_status st = TL_OK;
    const bool all = cli_get(p->session, CLI_STATISTICS)->given;
    fputs("channel", p->out);
    for (size_t c = 0; c < COLUMN_COUNT; c++)
        if (all || COLUMNS[c].with_integral) fprintf(p->out, ",%s", COLUMNS[c].name);
    fputs(",within\n", p->out);
    for (size_t c = 0; !st && c < tl_mesh_channel_count(p->mesh); c++) {
        const tl_channel *channel = tl_mesh_channel(p->mesh, c);
        const uint32_t rows = channel->components + (channel->components > 1);
        for (uint32_t k = 0; !st && is_wanted(p, channel) && k < rows; k++) {
            tl_statistics s;
            st = tl_channel_statistics(p->session->ctx, p->mesh, channel, k, &s);
            if (!st) put_row(p, channel, k, &s);
        }
    }
    return st;
}

/* ---- the verb ---- */

static void print_json(probe *p, double seconds)
{
    const cli_value *out = cli_get(p->session, CLI_OUTPUT);
    json_t *object = json_object();
    if (out->given) cli_json_text(object, "file", out->text);
    if (p->point_count) {
        cli_json_count(object, "points", p->point_count);
        cli_json_count(object, "inside", p->inside_count);
    } else {
        json_object_set(object, "statistics", p->rows);
    }
    cli_json_volume(cli_json_object(object, "volume"), &p->volume);
    cli_json_real(object, "seconds", seconds);
    cli_json_facts(object, p->session->ctx);
    cli_json_print(object);
}

static void print_text(probe *p, double seconds)
{
    cli_print_volume(p->session, &p->volume);
    if (p->point_count)
        printf("probed      %s points, %s of them in the mesh (%s)\n", cli_count(p->point_count).s,
               cli_count(p->inside_count).s, cli_seconds(seconds).s);
    cli_print_notes(p->session);
    printf("wrote       %s\n", cli_get(p->session, CLI_OUTPUT)->text);
}

/* The table goes to a file, to stdout, or with --json alone nowhere. */
static int open_table(probe *p)
{
    const cli_value *out = cli_get(p->session, CLI_OUTPUT);
    p->out = stdout;
    if (out->given) return cli_file_begin(out->text, &p->out);
    return cli_get(p->session, CLI_JSON)->given ? cli_file_begin("/dev/null", &p->out) : CLI_DONE;
}

static int make_table(probe *p)
{
    const cli_value *out = cli_get(p->session, CLI_OUTPUT);
    const double start = cli_now();
    int failed = open_table(p);
    if (failed) return failed;
    tl_status st = p->point_count ? put_points(p) : put_statistics(p);
    const double seconds = cli_now() - start;
    cli_progress_clear(&p->session->progress);
    if (st) failed = cli_fail(p->session, p->session->ctx, st);
    if (p->out != stdout)
        failed = cli_file_end(out->given ? out->text : "/dev/null", p->out, failed);
    if (!failed && cli_get(p->session, CLI_JSON)->given) print_json(p, seconds);
    if (!failed && out->given && cli_loud(p->session)) print_text(p, seconds);
    return failed;
}

static int run(cli_session *session)
{
    probe p = {.session = session};
    int failed = check_words(&p);
    if (!failed) failed = cli_volume_open(session, session->args.operands[0], &p.volume);
    if (!failed) {
        p.mesh = p.volume.mesh;
        p.rows = json_array();
        failed = check_channels(&p);
        if (!failed) failed = make_table(&p);
        json_decref(p.rows);
        cli_volume_close(session, &p.volume);
    }
    tl_mem_free(session->ctx, p.points);
    return failed;
}

static const char *const EXAMPLES[] = {
    "tetralod probe flow.tlod --along -3,0,0,3,0,0,500 -o line.csv",
    "All channels at 500 points of a line, with the errors that the model promises",
    "tetralod probe flow.vtu --at 0,0,1.5 --at 0,0,2",
    "Two points, on the screen",
    "tetralod probe part.vtu --statistics --channels stress",
    "Smallest, largest and mean stress, its deviation and percentiles by volume",
    NULL};

const cli_verb cli_verb_probe = {
    .name = "probe",
    .operands = "IN (--at X,Y,Z | --along X0,Y0,Z0,X1,Y1,Z1[,N] | --integral | --statistics)",
    .operand_least = 1,
    .operand_most = 1,
    .about = "values at points and along lines, integrals, statistics",
    .details = "IN is a model or any file that 'tetralod formats' lists. Channels are linear in "
               "each tet, those on tets constant; values, integrals, means and deviations are "
               "exact for that but for rounding, percentiles are within a millionth of the range. "
               "Of vectors the length, too, linear between its values at vertices. What lies "
               "outside of the mesh is left empty. within: what a model promises at every original "
               "vertex; 0 of a file.",
    .groups = {&GROUP, &cli_group_detail, &cli_group_derive, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
