/* Lines from seeds on the command line. */
#include "cli_flow.h"

int cli_flow_channel(const cli_session *session, const tl_mesh *mesh, const char *name,
                     const tl_channel **channel)
{
    *channel = name ? cli_vertex_channel(mesh, name) : NULL;
    if (name && !*channel) return cli_unknown_channel(session, mesh, name);
    for (size_t c = 0; !*channel && c < tl_mesh_channel_count(mesh); c++) {
        const tl_channel *own = tl_mesh_channel(mesh, c);
        if (own->on == TL_ON_VERTEX && own->components == 3) *channel = own;
    }
    if (*channel && (*channel)->components == 3) return CLI_DONE;
    if (*channel)
        return cli_misuse(session->args.verb, "channel '%s' has %u components, a flow has 3",
                          cli_name(name).s, (*channel)->components);
    fprintf(stderr, "tetralod: there is no channel of vectors on vertices to follow\n");
    return CLI_FAILED;
}

int cli_flow_trace(cli_session *session, const tl_mesh *mesh, const tl_channel *channel,
                   const char *seeds, const tl_stream_opts *opts, tl_polydata **lines,
                   tl_stream_report *report)
{
    tl_status st = tl_seeds_follow(session->ctx, mesh, channel, seeds, opts, lines, report);
    cli_progress_clear(&session->progress);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}
