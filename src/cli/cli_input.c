/* Files in and out: reading and writing options, checks that come before long work, and the lines
 * of a summary that say what was read. */
#include "cli_session.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

/* Digits of a side of a raw volume: what has more points along an axis is no volume. */
#define RAW_DIGITS_MAX 7

/* ---- options to structs ---- */

/* "X,Y,Z,TYPE[,be]" */
static bool parse_raw(const char *text, tl_read_opts *opts)
{
    static const char *const TYPES[] = {"i8",  "u8",  "i16", "u16", "i32",
                                        "u32", "i64", "u64", "f32", "f64"};
    static const char *const LONG_TYPES[] = {"int8",   "uint8", "int16",  "uint16",  "int32",
                                             "uint32", "int64", "uint64", "float32", "float64"};
    char type[16] = "";
    int end = 0;
    for (int i = 0; i < 3; i++) {
        size_t digits = strspn(text, "0123456789");
        if (digits == 0 || digits > RAW_DIGITS_MAX || text[digits] != ',') return false;
        opts->raw_dims[i] = (uint32_t)strtoul(text, NULL, 10);
        if (opts->raw_dims[i] == 0) return false;
        text += digits + 1;
    }
    if (sscanf(text, "%15[a-z0-9]%n", type, &end) != 1) return false;
    opts->raw_big_endian = strcmp(text + end, ",be") == 0;
    if (text[end] && !opts->raw_big_endian && strcmp(text + end, ",le") != 0) return false;
    for (size_t i = 0; i < sizeof TYPES / sizeof *TYPES; i++)
        if (strcmp(type, TYPES[i]) == 0 || strcmp(type, LONG_TYPES[i]) == 0) {
            opts->raw_scalar = (tl_scalar)i;
            return true;
        }
    return false;
}

/* True for names whose ending says the kind: .vtk, .vtu, .vti ... */
static bool names_its_kind(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && strlen(dot) == 4 && strncasecmp(dot, ".vt", 3) == 0;
}

int cli_read_opts(const cli_session *session, const char *path, tl_read_opts *opts)
{
    *opts = tl_read_opts_defaults();
    const cli_value *raw = cli_get(session, CLI_RAW);
    if (raw->given && !parse_raw(raw->text, opts))
        return cli_misuse(session->args.verb,
                          "--raw %s: expected X,Y,Z,TYPE such as 64,64,64,u8 or 128,128,64,f32,be",
                          raw->text);
    if (names_its_kind(path)) memset(opts->raw_dims, 0, sizeof opts->raw_dims);
    if (!names_its_kind(path)) opts->solution = cli_get(session, CLI_SOLUTION)->text;
    opts->split = cli_get(session, CLI_SPLIT)->choice ? 6 : 5;
    opts->cell_to_point = cli_get(session, CLI_CELL_TO_POINT)->given;
    opts->has_fill_value = cli_get(session, CLI_FILL_VALUE)->given;
    opts->fill_value = cli_get(session, CLI_FILL_VALUE)->real;
    opts->keep_fill = cli_get(session, CLI_KEEP_FILL)->given;
    opts->region = cli_get(session, CLI_REGION)->text;
    opts->weld = cli_get(session, CLI_WELD)->given;
    opts->weld_distance = cli_get(session, CLI_WELD)->real;
    return cli_step_opts(session, opts);
}

/* ---- reading ---- */

int cli_open(cli_session *session, tl_ctx *ctx, const char *path, cli_input *input)
{
    tl_read_opts opts;
    int failed = cli_read_opts(session, path, &opts);
    *input = (cli_input){.path = path};
    return failed ? failed : cli_open_with(session, ctx, path, &opts, input);
}

int cli_open_with(cli_session *session, tl_ctx *ctx, const char *path, const tl_read_opts *opts,
                  cli_input *input)
{
    *input = (cli_input){.path = path};
    input->notes_begin = session->notes_bytes;
    double start = cli_now();
    tl_status st = tl_mesh_read(ctx, path, opts, &input->mesh, &input->report);
    input->seconds = cli_now() - start;
    input->notes_end = session->notes_bytes;
    cli_progress_clear(&session->progress);
    if (st) return cli_fail(session, ctx, st);
    input->tet_count = tl_mesh_tet_count(input->mesh);
    input->vert_count = tl_mesh_vert_count(input->mesh);
    return CLI_DONE;
}

int cli_open_volume(cli_session *session, tl_ctx *ctx, const char *path, cli_input *input)
{
    int failed = cli_open(session, ctx, path, input);
    return failed ? failed : cli_check_volume(input);
}

int cli_check_volume(cli_input *input)
{
    const char *path = input->path;
    if (tl_mesh_tet_count(input->mesh) > 0) return CLI_DONE;
    const tl_read_report *report = &input->report;
    if (report->blank_cells || report->ghost_cells)
        fprintf(
            stderr,
            "tetralod: '%s' holds no volume cells once %s blank and %s ghost cells are left out\n",
            path, cli_count(report->blank_cells).s, cli_count(report->ghost_cells).s);
    else
        fprintf(
            stderr,
            "tetralod: '%s' holds no volume cells (%s points, %s surface, line and point cells)\n",
            path, cli_count(report->points).s, cli_count(report->surface_cells).s);
    fprintf(stderr, "  'tetralod info' lists what it holds\n");
    cli_close(input);
    return CLI_FAILED;
}

void cli_close(cli_input *input)
{
    tl_mesh_destroy(input->mesh);
    input->mesh = NULL;
}

/* ---- writing ---- */

uint64_t cli_file_bytes(const char *path)
{
    struct stat info;
    return stat(path, &info) ? 0 : (uint64_t)info.st_size;
}

/* True if ending (".vtu") stands in a list of endings, in any case. */
static bool ends_in(const char *ending, const char *endings)
{
    size_t length = strlen(ending);
    for (const char *at = endings; *at; at += strspn(at, " ")) {
        size_t n = strcspn(at, " ");
        if (n == length && strncasecmp(at, ending, n) == 0) return true;
        at += n;
    }
    return false;
}

static bool is_written(const char *ending)
{
    const tl_format *format;
    for (size_t i = 0; (format = tl_format_get(i)); i++)
        if (format->writes && ends_in(ending, format->endings)) return true;
    return false;
}

static int unknown_ending(const cli_session *session, const char *path)
{
    char list[256] = "";
    size_t used = 0;
    const tl_format *format;
    for (size_t i = 0; (format = tl_format_get(i)); i++)
        if (format->writes && used + strlen(format->endings) + 2 < sizeof list)
            used += (size_t)snprintf(list + used, sizeof list - used, " %s", format->endings);
    return cli_misuse(session->args.verb, "'%s': the name must end in one of%s", path, list);
}

int cli_output_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    struct stat info;
    char folder[4096] = ".";
    if (slash) snprintf(folder, sizeof folder, "%.*s", (int)(slash - path) + (slash == path), path);
    if (stat(path, &info) == 0 && S_ISDIR(info.st_mode)) {
        fprintf(stderr, "tetralod: can't write '%s': it is a folder\n", path);
        return CLI_FAILED;
    }
    if (access(folder, W_OK | X_OK) == 0) return CLI_DONE;
    fprintf(stderr, "tetralod: can't write '%s': folder '%s': %s\n", path, folder, strerror(errno));
    return CLI_FAILED;
}

int cli_output_check(cli_session *session, const char *path)
{
    const char *dot = strrchr(path, '.');
    if (!dot || !is_written(dot)) return unknown_ending(session, path);
    if (cli_get(session, CLI_ZLIB)->given &&
        (cli_get(session, CLI_ASCII)->given || strcasecmp(dot, ".vtu") != 0))
        return cli_misuse(session->args.verb, "--zlib: only a binary .vtu can be compressed");
    return cli_output_folder(path);
}

int cli_save(cli_session *session, tl_ctx *ctx, const tl_mesh *mesh, const char *path,
             uint64_t *bytes, double *seconds)
{
    tl_write_opts opts = tl_write_opts_defaults();
    opts.zlib = cli_get(session, CLI_ZLIB)->given;
    opts.ascii = cli_get(session, CLI_ASCII)->given;
    double start = cli_now();
    tl_status st = tl_mesh_write(ctx, mesh, path, &opts);
    *seconds = cli_now() - start;
    *bytes = st ? 0 : cli_file_bytes(path);
    cli_progress_clear(&session->progress);
    return st ? cli_fail(session, ctx, st) : CLI_DONE;
}

/* ---- channels and boxes ---- */

size_t cli_vertex_channel_count(const tl_mesh *mesh)
{
    size_t count = 0;
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++)
        count += tl_mesh_channel(mesh, i)->on == TL_ON_VERTEX;
    return count;
}

const tl_channel *cli_vertex_channel(const tl_mesh *mesh, const char *name)
{
    const tl_channel *channel = tl_mesh_channel_by_name(mesh, name);
    return channel && channel->on == TL_ON_VERTEX ? channel : NULL;
}

int cli_unknown_channel(const cli_session *session, const tl_mesh *mesh, const char *name)
{
    cli_misuse(session->args.verb, "there is no channel '%s' on vertices", name);
    fputs("  channels on vertices:", stderr);
    for (size_t i = 0; i < tl_mesh_channel_count(mesh); i++)
        if (tl_mesh_channel(mesh, i)->on == TL_ON_VERTEX)
            fprintf(stderr, " '%s'", cli_name(tl_mesh_channel(mesh, i)->name).s);
    fputs(cli_vertex_channel_count(mesh) ? "\n" : " none\n", stderr);
    return CLI_WRONG_USE;
}

void cli_lengths(const tl_channel *channel, size_t count, double *lengths)
{
    size_t n = channel->components;
    for (size_t v = 0; v < count; v++) {
        double sum = 0;
        for (size_t k = 0; k < n; k++)
            sum += channel->values[n * v + k] * channel->values[n * v + k];
        lengths[v] = sqrt(sum);
    }
}

size_t cli_channel_elems(const tl_mesh *mesh, const tl_channel *channel)
{
    return channel->on == TL_ON_VERTEX ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh);
}

void cli_bounds(const tl_mesh *mesh, double bounds[6])
{
    const double *xyz = tl_mesh_xyz(mesh);
    size_t vert_count = tl_mesh_vert_count(mesh);
    bool any = false;
    for (int i = 0; i < 6; i++) bounds[i] = 0;
    for (size_t v = 0; v < vert_count; v++) {
        const double *p = xyz + 3 * v;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) continue;
        for (int k = 0; k < 3; k++) {
            if (!any || p[k] < bounds[2 * k]) bounds[2 * k] = p[k];
            if (!any || p[k] > bounds[2 * k + 1]) bounds[2 * k + 1] = p[k];
        }
        any = true;
    }
}

double cli_diagonal(const tl_mesh *mesh)
{
    double b[6];
    cli_bounds(mesh, b);
    return sqrt((b[1] - b[0]) * (b[1] - b[0]) + (b[3] - b[2]) * (b[3] - b[2]) +
                (b[5] - b[4]) * (b[5] - b[4]));
}

void cli_middles(const double range[2], size_t count, double *values)
{
    for (size_t i = 0; i < count; i++)
        values[i] = range[0] + ((double)i + 0.5) / (double)count * (range[1] - range[0]);
}

/* ---- summaries ---- */

void cli_print_input(cli_session *session, const char *label, const cli_input *input)
{
    printf("%-10s  %s: %s tets, %s vertices (%s, %s)\n", label, input->path,
           cli_count(input->tet_count).s, cli_count(input->vert_count).s,
           cli_bytes((double)cli_file_bytes(input->path)).s, cli_seconds(input->seconds).s);
    cli_print_notes_between(session, input->notes_begin, input->notes_end);
}

void cli_json_report(json_t *object, const cli_input *input)
{
    const tl_read_report *report = &input->report;
    json_t *read = cli_json_object(object, "read");
    cli_json_text(read, "file", input->path);
    cli_json_count(read, "bytes", cli_file_bytes(input->path));
    cli_json_real(read, "seconds", input->seconds);
    cli_json_count(read, "points", report->points);
    cli_json_count(read, "ghost_cells", report->ghost_cells);
    cli_json_count(read, "blank_cells", report->blank_cells);
    cli_json_count(read, "surface_cells", report->surface_cells);
    cli_json_count(read, "turned", report->turned);
    cli_json_count(read, "unused_points", report->unused_points);
    cli_json_count(read, "nonfinite_values", report->nonfinite_values);
}

void cli_json_facts(json_t *object, const tl_ctx *ctx)
{
    cli_json_text(object, "version", cli_version().s);
    cli_json_count(object, "threads", tl_ctx_thread_count(ctx));
    cli_json_count(object, "peak_bytes", tl_ctx_peak_bytes(ctx));
}
