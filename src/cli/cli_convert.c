/* tetralod convert: any file in, tets out. */
#include "cli_session.h"

static void print_json(const cli_session *session, const cli_input *input, const char *path,
                       uint64_t bytes, double seconds)
{
    json_t *object = json_object();
    cli_json_text(object, "file", path);
    cli_json_count(object, "vertices", tl_mesh_vert_count(input->mesh));
    cli_json_count(object, "tets", tl_mesh_tet_count(input->mesh));
    cli_json_count(object, "channels", tl_mesh_channel_count(input->mesh));
    cli_json_count(object, "inverted", input->report.inverted);
    cli_json_count(object, "degenerate", input->report.degenerate);
    cli_json_count(object, "bytes", bytes);
    cli_json_real(object, "seconds", seconds);
    cli_json_report(object, input);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

static int run(cli_session *session)
{
    const char *path = session->args.operands[1];
    cli_input input;
    uint64_t bytes = 0;
    double seconds = 0;
    if (cli_all_steps(session)) return cli_convert_series(session, session->args.operands[0], path);
    int exit_status = cli_output_check(session, path);
    if (!exit_status)
        exit_status = cli_open_volume(session, session->ctx, session->args.operands[0], &input);
    if (exit_status) return exit_status;
    exit_status = cli_save(session, session->ctx, input.mesh, path, &bytes, &seconds);
    if (!exit_status && cli_get(session, CLI_JSON)->given) {
        print_json(session, &input, path, bytes, seconds);
    } else if (!exit_status && cli_loud(session)) {
        cli_print_input(session, "read", &input);
        printf("%-10s  %s: %zu channel%s (%s, %s)\n", "wrote", path,
               tl_mesh_channel_count(input.mesh), tl_mesh_channel_count(input.mesh) == 1 ? "" : "s",
               cli_bytes((double)bytes).s, cli_seconds(seconds).s);
    }
    cli_close(&input);
    return exit_status;
}

static const char *const EXAMPLES[] = {"tetralod convert grid.vts tets.vtu --zlib",
                                       "A structured grid as compressed tets",
                                       "tetralod convert xyz.bin flow.vtu --solution q.bin",
                                       "PLOT3D grid and solution",
                                       "tetralod convert ocean.vtu sea.vtu --fill-value -9999",
                                       "Cut away what holds no data",
                                       "tetralod convert crash.e crash.pvd --step all",
                                       "Every step as a .vtu, and a .pvd that names them",
                                       NULL};

const cli_verb cli_verb_convert = {
    .name = "convert",
    .operands = "IN OUT",
    .operand_least = 2,
    .operand_most = 2,
    .operand_output = 2,
    .may_replace = true,
    .about = "read any known file as tets and write them as another",
    .details =
        "OUT appears under its name only when it is complete, so it may be IN; its ending says as "
        "what it is written (see 'tetralod formats'). All that is dropped or changed on the "
        "way is said, with counts.",
    .groups = {&cli_group_reading, &cli_group_writing, &cli_group_common},
    .examples = EXAMPLES,
    .run = run};
