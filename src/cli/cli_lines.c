/* tetralod lines: streamlines of a model or a file, as polylines in a file. */
#include <math.h>

#include "cli_flow.h"
#include "cli_polydata.h"

static const cli_option OPTIONS[] = {
    {CLI_OUTPUT, 'o', "output", CLI_TYPE_OUTPUT, "OUT", NULL, 0, 0,
     "the file to write: .vtp or .ply with channels, .glb, .obj; required"},
    {CLI_CHANNEL, 0, "channel", CLI_TYPE_TEXT, "CHANNEL", NULL, 0, 0,
     "the vectors to follow; without it the first on vertices"},
    {CLI_SEEDS, 0, "seeds", CLI_TYPE_INPUT, "SEEDS", "grid", 0, 0,
     "where lines begin: " CLI_SEEDS_WORDS ". grid covers the mesh evenly, N cells along its "
     "longest side"},
    {CLI_ORDER, 0, "order", CLI_TYPE_CHOICE, "2|5", "2", 0, 0,
     "second order with steps of a fixed part of a tet, or fifth order with its error held"},
    {CLI_STRIDE, 0, "stride", CLI_TYPE_REAL, "S", NULL, 1e-6, 64,
     "the step, of order 5 the longest one, in parts of the longest chord of the tet along the "
     "flow; without it 0.5, of order 5 2"},
    {CLI_TOLERANCE, 0, "tolerance", CLI_TYPE_REAL, "E", "1e-7", 1e-16, 1,
     "order 5: error of a step in parts of the diagonal"},
    {CLI_DIRECTION, 0, "direction", CLI_TYPE_CHOICE, "both|forward|backward", "both", 0, 0,
     "from the seeds with the flow, against it, or both"},
    {CLI_LENGTH, 0, "length", CLI_TYPE_AMOUNT, "L[%]", "400%", 1e-300, 1e300,
     "longest way in each direction, in mesh units or percent of the diagonal"},
    {CLI_DURATION, 0, "duration", CLI_TYPE_REAL, "T", NULL, 1e-300, 1e300,
     "longest time in each direction, in lengths by speed"},
    {CLI_STEPS_MAX, 0, "steps-max", CLI_TYPE_COUNT, "N", "10000", 1, 1e9,
     "most steps in each direction"},
    {CLI_SLOWEST, 0, "slowest", CLI_TYPE_AMOUNT, "P[%]", "0.0001%", 0, 1,
     "where lines end and none begin: part of the largest speed"},
    {CLI_BOX, 0, "box", CLI_TYPE_TEXT, "X0,Y0,Z0,X1,Y1,Z1", NULL, 0, 0,
     "mark the lines through a box: channel 'selected' is 1 on them, 0 on others"},
    {CLI_CHANNELS, 0, "channels", CLI_TYPE_LIST, "A,B", NULL, 0, 0,
     "carry these channels along; without it all on vertices"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

static const char *const END_NAMES[TL_STREAM_END_COUNT] = {"boundary", "length", "time", "steps",
                                                           "speed",    "loop",   "value"};

static int check_words(const cli_session *session)
{
    const cli_verb *verb = session->args.verb;
    const char *seeds = cli_get(session, CLI_SEEDS)->text;
    const cli_value *box = cli_get(session, CLI_BOX);
    double bounds[6];
    if (!tl_seeds_are_words(seeds))
        return cli_misuse(verb, "--seeds %s: expected " CLI_SEEDS_WORDS, seeds);
    if (box->given && !cli_parse_box(box->text, bounds))
        return cli_misuse(verb, "--box %s: expected X0,Y0,Z0,X1,Y1,Z1", box->text);
    return cli_polydata_output(session, TL_POLY_LINES, ".vtp, .ply, .glb or .obj");
}

/* ---- lines ---- */

typedef struct outcome {
    const tl_channel *channel;
    size_t *carried;
    tl_polydata *lines;
    tl_stream_report report;
    size_t selected;
    double trace_seconds, write_seconds;
} outcome;

static void set_opts(const cli_session *session, const tl_mesh *mesh, tl_stream_opts *opts)
{
    const cli_value *length = cli_get(session, CLI_LENGTH), *slow = cli_get(session, CLI_SLOWEST);
    *opts = tl_stream_opts_defaults();
    opts->order = cli_get(session, CLI_ORDER)->choice ? 5 : 2;
    if (cli_get(session, CLI_STRIDE)->given) opts->step = cli_get(session, CLI_STRIDE)->real;
    opts->tolerance = cli_get(session, CLI_TOLERANCE)->real;
    opts->direction = cli_get(session, CLI_DIRECTION)->choice == 0   ? TL_STREAM_BOTH
                      : cli_get(session, CLI_DIRECTION)->choice == 1 ? TL_STREAM_FORWARD
                                                                     : TL_STREAM_BACKWARD;
    opts->length_max = length->percent ? length->real * cli_diagonal(mesh) : length->real;
    if (cli_get(session, CLI_DURATION)->given)
        opts->time_max = cli_get(session, CLI_DURATION)->real;
    opts->step_max = cli_get(session, CLI_STEPS_MAX)->count;
    opts->speed_min = fmin(slow->real, 1);
}

/* Marks the lines through --box. */
static tl_status select_lines(cli_session *session, outcome *o)
{
    tl_status st = TL_OK;
    double bounds[6];
    if (!cli_parse_box(cli_get(session, CLI_BOX)->text, bounds)) return TL_OK;
    tl_polydata *lines = o->lines;
    uint8_t *marks = tl_mem_alloc(session->ctx, lines->cell_count, 1, &st);
    double *values = tl_mem_alloc(session->ctx, lines->vert_count, sizeof *values, &st);
    if (!st) o->selected = tl_lines_in_box(lines, bounds, marks);
    for (size_t line = 0; !st && line < lines->cell_count; line++)
        for (size_t i = lines->starts[line]; i < lines->starts[line + 1]; i++)
            values[lines->corners[i]] = marks[line];
    tl_channel channel = {"selected", "", 1, TL_ON_VERTEX, TL_U8, values};
    if (!st) st = tl_polydata_adopt_channel(session->ctx, lines, &channel);
    if (st) tl_mem_free(session->ctx, values);
    tl_mem_free(session->ctx, marks);
    return st;
}

static int trace(cli_session *session, const tl_mesh *mesh, outcome *o)
{
    tl_stream_opts opts;
    set_opts(session, mesh, &opts);
    const char *name = cli_get(session, CLI_CHANNEL)->text;
    int failed = cli_flow_channel(session, mesh, name, &o->channel);
    if (!failed) failed = cli_carried(session, mesh, &o->carried, &opts.channel_count);
    opts.channels = o->carried;
    double start = cli_now();
    if (!failed)
        failed = cli_flow_trace(session, mesh, o->channel, cli_get(session, CLI_SEEDS)->text, &opts,
                                &o->lines, &o->report);
    o->trace_seconds = cli_now() - start;
    if (failed || !cli_get(session, CLI_BOX)->given) return failed;
    tl_status st = select_lines(session, o);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

/* ---- summaries ---- */

static void print_json(const cli_session *session, const cli_volume *volume, const outcome *o)
{
    json_t *object = json_object();
    cli_json_text(object, "file", cli_get(session, CLI_OUTPUT)->text);
    cli_json_text(object, "channel", o->channel->name);
    cli_json_count(object, "lines", o->lines->cell_count);
    cli_json_count(object, "vertices", o->lines->vert_count);
    cli_json_real(object, "length", tl_polydata_size(o->lines));
    cli_json_count(object, "steps", o->report.steps);
    cli_json_count(object, "seeds_outside", o->report.seeds_outside);
    cli_json_count(object, "seeds_covered", o->report.seeds_covered);
    json_t *ends = cli_json_object(object, "ends");
    for (int e = 0; e < TL_STREAM_END_COUNT; e++)
        cli_json_count(ends, END_NAMES[e], o->report.ends[e]);
    if (cli_get(session, CLI_BOX)->given) cli_json_count(object, "selected", o->selected);
    cli_polydata_json(object, session, volume, o->trace_seconds, o->write_seconds);
}

static void print_text(cli_session *session, const cli_volume *volume, const outcome *o)
{
    cli_print_volume(session, volume);
    printf("lines       %s of '%s', %s vertices, length %s (%s)\n",
           cli_count(o->lines->cell_count).s, cli_name(o->channel->name).s,
           cli_count(o->lines->vert_count).s, cli_real(tl_polydata_size(o->lines)).s,
           cli_seconds(o->trace_seconds).s);
    printf("ends       ");
    for (int e = 0; e < TL_STREAM_END_COUNT; e++)
        if (o->report.ends[e]) printf(" %s %s", END_NAMES[e], cli_count(o->report.ends[e]).s);
    printf("; %s seeds outside\n", cli_count(o->report.seeds_outside).s);
    if (cli_get(session, CLI_BOX)->given)
        printf("selected    %s lines through the box\n", cli_count(o->selected).s);
    cli_polydata_print(session, o->write_seconds);
}

/* ---- the verb ---- */

static int write_lines(cli_session *session, const cli_volume *volume, outcome *o)
{
    tl_status st = cli_polydata_save(session, o->lines, &o->write_seconds);
    cli_progress_clear(&session->progress);
    if (st) return cli_fail(session, session->ctx, st);
    if (cli_get(session, CLI_JSON)->given)
        print_json(session, volume, o);
    else if (cli_loud(session))
        print_text(session, volume, o);
    return CLI_DONE;
}

static int run(cli_session *session)
{
    cli_volume volume;
    outcome o = {0};
    int exit_status = check_words(session);
    if (!exit_status) exit_status = cli_volume_open(session, session->args.operands[0], &volume);
    if (exit_status) return exit_status;
    exit_status = trace(session, volume.mesh, &o);
    if (!exit_status) exit_status = write_lines(session, &volume, &o);
    tl_polydata_destroy(session->ctx, o.lines);
    tl_mem_free(session->ctx, o.carried);
    cli_volume_close(session, &volume);
    return exit_status;
}

static const char *const EXAMPLES[] = {
    "tetralod lines flow.tlod -o lines.vtp",
    "Lines of the first vectors that cover the finest mesh evenly, with all channels on them",
    "tetralod lines wing.vtu -o tip.vtp --channel velocity --seeds line:0,0,1,0,2,1:50 --order 5",
    "Fifty lines from a rake, with the error of each step held",
    "tetralod lines flow.tlod -o swirl.ply --seeds critical --length 20% --error 1%",
    "Short lines around the points where nothing flows, from a mesh with an error of 1 %",
    "tetralod lines flow.tlod -o chosen.vtp --seeds grid:30 --box 0,0,0,1,1,1",
    "Lines that cover the mesh; those through a box are marked",
    NULL};

const cli_verb cli_verb_lines = {
    .name = "lines",
    .operands = "IN -o OUT",
    .operand_least = 1,
    .operand_most = 1,
    .about = "streamlines of vectors as polylines",
    .details = "IN is a model or any file that 'tetralod formats' lists. The vertices of a line "
               "follow the flow; 'time' is 0 at its seed. Lines end at the boundary, in loops, and "
               "by the limits below. In JSON seconds is the tracing alone.",
    .groups = {&GROUP, &cli_group_detail, &cli_group_derive, &cli_group_reading, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
