/* What every verb needs: the parsed words, a context with its budget, reading and writing with
 * messages, and the way a verb fails. */
#ifndef TETRALOD_CLI_SESSION_H
#define TETRALOD_CLI_SESSION_H

#include "cli_options.h"
#include "cli_print.h"
#include "cli_progress.h"

struct cli_session {
    cli_args args;
    tl_ctx *ctx;
    cli_progress progress;
    char notes[16384]; /* what the library said at level info, a line each */
    size_t notes_bytes, notes_shown;
    char warnings[4096];  /* what it has warned of, a line each: each frame would do so again */
    size_t written_count; /* files that stay when the verb is stopped */
};

/* A mesh that was read, and how. */
typedef struct cli_input {
    const char *path;
    tl_mesh *mesh;
    size_t tet_count, vert_count; /* as they were read */
    tl_read_report report;
    double seconds;
    size_t notes_begin, notes_end; /* in the notes of the session */
} cli_input;

static inline const cli_value *cli_get(const cli_session *session, cli_id id)
{
    return &session->args.values[id];
}

static inline bool cli_loud(const cli_session *session)
{
    return !cli_get(session, CLI_QUIET)->given && !cli_get(session, CLI_JSON)->given;
}

/* A context with the budget, progress and log of the session; thread_count 0: one a processor. */
tl_status cli_context_create(cli_session *session, unsigned thread_count, tl_ctx **ctx);

/* Runs a verb: context, verb, messages. Returns the exit status. */
int cli_session_run(const cli_verb *verb, int argc, char **argv);

/* Prints the message of the context and returns the exit status for status. Of TL_ERR_ARG: wrong
 * use, since what the library was asked came from the command line. */
int cli_fail(cli_session *session, tl_ctx *ctx, tl_status status);

/* Reads a file with the reading options; ctx may be another than the session's. Options that only
 * hold for files without a head are left out where the name ends in .vtk or .vt*. Returns an exit
 * status; the message is out already. The input is released with cli_close. */
int cli_open(cli_session *session, tl_ctx *ctx, const char *path, cli_input *input);
/* The same, and refuses a file without volume cells. */
int cli_open_volume(cli_session *session, tl_ctx *ctx, const char *path, cli_input *input);
/* The parts of both: the options for a file as the words give them; reading with them; refusing,
 * then the input is closed. */
int cli_read_opts(const cli_session *session, const char *path, tl_read_opts *opts);
int cli_open_with(cli_session *session, tl_ctx *ctx, const char *path, const tl_read_opts *opts,
                  cli_input *input);
int cli_check_volume(cli_input *input);
void cli_close(cli_input *input);

/* Series, cli_series.c: the options --step and --time; "all" is refused. */
int cli_step_opts(const cli_session *session, tl_read_opts *opts);
/* True for --step all. */
bool cli_all_steps(const cli_session *session);
/* Forgets both options if the file at path is no series: a copy of one step. */
int cli_step_if_series(cli_session *session, const char *path);
/* The number of the step that opts choose; -1 of a file that is no series. */
int cli_step_number(cli_session *session, const char *path, const tl_read_opts *opts,
                    int64_t *number);
/* Converts all steps of a file to a collection, .pvd, with a .vtu a step beside it. */
int cli_convert_series(cli_session *session, const char *from, const char *to);

/* Simplifies a file in parts, as the words of the verb simplify say. cli_simplify_stream.c */
int cli_simplify_in_parts(cli_session *session);

/* Finds out before the work whether a file can be written there. Returns an exit status. */
int cli_output_folder(const char *path);
/* Finds out before the work whether a mesh can be written there, with the writing options. Returns
 * an exit status. */
int cli_output_check(cli_session *session, const char *path);
/* Writes with the writing options; bytes and seconds receive size of the file and time taken. */
int cli_save(cli_session *session, tl_ctx *ctx, const tl_mesh *mesh, const char *path,
             uint64_t *bytes, double *seconds);
/* Size of a file; 0 if there is none. */
uint64_t cli_file_bytes(const char *path);
/* The folder for work files: that of --tmp, else of TMPDIR; NULL: the library's default. */
const char *cli_work_folder(const cli_session *session);

/* Channels on vertices. */
size_t cli_vertex_channel_count(const tl_mesh *mesh);
/* The channel of that name on vertices, NULL if there is none. */
const tl_channel *cli_vertex_channel(const tl_mesh *mesh, const char *name);
/* Says that there is no such channel and which there are; returns CLI_WRONG_USE. */
int cli_unknown_channel(const cli_session *session, const tl_mesh *mesh, const char *name);
/* lengths [count] of the vectors of a channel. */
void cli_lengths(const tl_channel *channel, size_t count, double *lengths);
size_t cli_channel_elems(const tl_mesh *mesh, const tl_channel *channel);
/* Box of the vertices with finite coordinates (x0, x1, y0, y1, z0, z1), 0 if there are none, and
 * its diagonal. */
void cli_bounds(const tl_mesh *mesh, double bounds[6]);
double cli_diagonal(const tl_mesh *mesh);
/* The middles of count equal parts of a range. */
void cli_middles(const double range[2], size_t count, double *values);

/* Lines that several summaries share: a file with what the library said while it was read, and what
 * it has said since. */
void cli_print_input(cli_session *session, const char *label, const cli_input *input);
void cli_print_notes(cli_session *session);
void cli_drop_notes(cli_session *session);
/* Prints the notes from one byte to another, indented. */
void cli_print_notes_between(cli_session *session, size_t begin, size_t end);
/* Adds "read": what the reader found, dropped and changed. */
void cli_json_report(json_t *object, const cli_input *input);
/* Adds version, threads, time (if any) and peak_bytes. */
void cli_json_facts(json_t *object, const tl_ctx *ctx);
/* Version of the linked library, "0.1.0". */
cli_text cli_version(void);

#endif
