/* The begin and the end of verbs that write points, lines or triangles. */
#include "cli_polydata.h"

int cli_polydata_output(const cli_session *session, tl_poly_kind kind, const char *endings)
{
    const cli_value *out = cli_get(session, CLI_OUTPUT);
    if (!out->given) return cli_misuse(session->args.verb, "-o OUT is missing");
    if (!tl_polydata_writes(kind, out->text))
        return cli_misuse(session->args.verb, "'%s': the name must end in %s", out->text, endings);
    return cli_output_folder(out->text);
}

tl_status cli_polydata_save(cli_session *session, const tl_polydata *polydata, double *seconds)
{
    double start = cli_now();
    tl_status st = tl_polydata_write(session->ctx, polydata, cli_get(session, CLI_OUTPUT)->text);
    *seconds = cli_now() - start;
    return st;
}

void cli_polydata_print(cli_session *session, double write_seconds)
{
    const char *path = cli_get(session, CLI_OUTPUT)->text;
    cli_print_notes(session);
    printf("wrote       %s (%s, %s)\n", path, cli_bytes((double)cli_file_bytes(path)).s,
           cli_seconds(write_seconds).s);
}

void cli_polydata_json(json_t *object, const cli_session *session, const cli_volume *volume,
                       double seconds, double write_seconds)
{
    cli_json_volume(cli_json_object(object, "volume"), volume);
    cli_json_real(object, "seconds", seconds);
    cli_json_real(object, "read_seconds", volume->seconds);
    cli_json_real(object, "write_seconds", write_seconds);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}
