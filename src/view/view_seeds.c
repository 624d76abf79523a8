/* Seeds of streamlines as words, and the lines from them. */
#include <errno.h>
#include <math.h>
#include <stdio.h>

#include "formats/formats_number.h"
#include "view/view.h"

/* Cells along the longest side of a grid, seeds around each critical point, seeds of others, if
 * nothing is said. */
enum { GRID_CELLS = 16, CRITICAL_SEEDS = 32, SEEDS = 200, LINE_BYTES = 1024 };
/* Seeds stand around a critical point at this part of the diagonal of the mesh. */
static const double CRITICAL_RADIUS = 0.01;
static const double COUNT_MAX = 16777216;

typedef enum seed_kind { GRID, CRITICAL, BOX, LINE, PLANE, FROM_FILE } seed_kind;

static const struct {
    const char *name;
    size_t number_count;
    size_t count; /* if none is given */
} KINDS[] = {{"grid", 0, GRID_CELLS},
             {"critical", 0, CRITICAL_SEEDS},
             {"box", 6, SEEDS},
             {"line", 6, SEEDS},
             {"plane", 6, SEEDS}};

typedef struct seed_words {
    seed_kind kind;
    double numbers[6]; /* of a box its bounds */
    size_t count;
} seed_words;

/* ---- words ---- */

/* Six numbers with commas between, up to end. */
static bool read_six(const char *text, const char *end, double numbers[6])
{
    for (int i = 0; i < 6; i++) {
        const char *after = tli_number_f64(text, end, &numbers[i]);
        if (!after || !isfinite(numbers[i])) return false;
        if (i < 5 && *after != ',') return false;
        text = after + (i < 5);
    }
    return text == end;
}

/* From two corners to x0, x1, y0, y1, z0, z1. */
static void to_bounds(double numbers[6])
{
    double b[6];
    for (int k = 0; k < 3; k++) {
        b[2 * k] = fmin(numbers[k], numbers[3 + k]);
        b[2 * k + 1] = fmax(numbers[k], numbers[3 + k]);
    }
    memcpy(numbers, b, sizeof b);
}

/* False for words that begin as seeds and go on as none. */
static bool parse(const char *words, seed_words *s)
{
    const size_t length = strcspn(words, ":");
    s->kind = FROM_FILE;
    for (int k = GRID; k < FROM_FILE; k++)
        if (length == strlen(KINDS[k].name) && !strncmp(words, KINDS[k].name, length))
            s->kind = (seed_kind)k;
    if (s->kind == FROM_FILE) return *words != '\0';
    const char *at = words + length;
    s->count = KINDS[s->kind].count;
    if (KINDS[s->kind].number_count) {
        if (*at != ':') return false;
        at++;
        const char *end = at + strcspn(at, ":");
        if (!read_six(at, end, s->numbers)) return false;
        if (s->kind == BOX) to_bounds(s->numbers);
        at = end;
    }
    if (!*at) return true;
    double count = 0;
    const char *end = at + strlen(at);
    if (*at != ':' || tli_number_f64(at + 1, end, &count) != end) return false;
    if (!(count >= 1 && count <= COUNT_MAX) || count != floor(count)) return false;
    s->count = (size_t)count;
    return true;
}

bool tl_seeds_are_words(const char *text)
{
    seed_words s;
    return parse(text, &s);
}

/* ---- seeds of a file ---- */

/* Reads three numbers between spaces, commas and semicolons; false if there are others. */
static bool read_point(const char *line, double x[3])
{
    const char *at = line, *end = line + strlen(line);
    for (int k = 0; k < 3; k++) {
        at = tli_number_f64(at + strspn(at, " \t,;"), end, &x[k]);
        if (!at || !isfinite(x[k])) return false;
    }
    return at[strspn(at, " \t,;\r\n")] == '\0';
}

static tl_status add_point(tl_ctx *ctx, tl_polydata *seeds, size_t *room, const double x[3])
{
    tl_status st = TL_OK;
    if (seeds->vert_count == *room) {
        size_t more = *room ? 2 * *room : 256;
        seeds->xyz = tl_mem_resize(ctx, seeds->xyz, more, 3 * sizeof *seeds->xyz, &st);
        if (st) return st;
        *room = more;
    }
    memcpy(seeds->xyz + 3 * seeds->vert_count, x, 3 * sizeof *x);
    seeds->cell_count = ++seeds->vert_count;
    return st;
}

static tl_status read_points(tl_ctx *ctx, FILE *file, const char *path, tl_polydata *seeds)
{
    char line[LINE_BYTES];
    tl_status st = TL_OK;
    size_t number = 0, room = 0;
    while (!st && fgets(line, sizeof line, file)) {
        double x[3];
        number++;
        if (!strchr(line, '\n') && !feof(file))
            return tl_fail(ctx, TL_ERR_FORMAT, "'%s': line %zu is no text of less than %d bytes",
                           path, number, LINE_BYTES);
        if ((double)seeds->vert_count > COUNT_MAX)
            return tl_fail(ctx, TL_ERR_FORMAT, "'%s': more than %.0f seeds", path, COUNT_MAX);
        line[strcspn(line, "#")] = '\0';
        if (line[strspn(line, " \t\r\n")] == '\0') continue;
        if (read_point(line, x))
            st = add_point(ctx, seeds, &room, x);
        else if (number > 1) /* the first may name the columns */
            st =
                tl_fail(ctx, TL_ERR_FORMAT, "'%s': line %zu: expected three numbers", path, number);
    }
    if (!st && ferror(file)) st = tl_fail(ctx, TL_ERR_IO, "'%s': can't read", path);
    if (!st && !seeds->vert_count)
        st = tl_fail(ctx, TL_ERR_FORMAT, "'%s': no line of three numbers", path);
    return st;
}

static tl_status read_file(tl_ctx *ctx, const char *path, tl_polydata **seeds)
{
    tl_status st = TL_OK;
    FILE *file = fopen(path, "r");
    if (!file)
        return tl_fail(ctx, TL_ERR_IO, "seeds '%s' are no words of --seeds and no file: %s", path,
                       strerror(errno));
    *seeds = tl_mem_zalloc(ctx, 1, sizeof **seeds, &st);
    if (!st) {
        (*seeds)->kind = TL_POLY_POINTS;
        st = read_points(ctx, file, path, *seeds);
    }
    fclose(file);
    return st;
}

/* ---- lines ---- */

static tl_status make_seeds(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                            const seed_words *s, const char *words, tl_polydata **seeds)
{
    double bounds[6], diagonal;
    tl_polydata *points = NULL;
    tl_status st;
    tli_mesh_box(mesh, bounds, &diagonal);
    switch (s->kind) {
    case CRITICAL:
        st = tl_critical_points(ctx, mesh, channel->values, &points);
        if (!st && !points->vert_count)
            st = tl_fail(ctx, TL_ERR_DATA, "'%s' has no critical points", channel->name);
        if (!st) st = tl_seeds_around(ctx, points, CRITICAL_RADIUS * diagonal, s->count, seeds);
        tl_polydata_destroy(ctx, points);
        return st;
    case BOX: return tl_seeds_box(ctx, s->numbers, s->count, seeds);
    case LINE: return tl_seeds_line(ctx, s->numbers, s->numbers + 3, s->count, seeds);
    case PLANE: return tl_seeds_plane(ctx, s->numbers, s->numbers + 3, bounds, s->count, seeds);
    default: return read_file(ctx, words, seeds);
    }
}

tl_status tli_flow_check(tl_ctx *ctx, const tl_channel *channel)
{
    const bool on_verts = channel->on == TL_ON_VERTEX;
    if (on_verts && channel->components == 3) return TL_OK;
    return tl_fail(ctx, TL_ERR_ARG,
                   "channel '%s' has %u components on %s, a flow has 3 on vertices", channel->name,
                   channel->components, on_verts ? "vertices" : "tets");
}

tl_status tli_seeds_follow(tl_ctx *ctx, const tl_mesh *mesh, const tl_lidx *opposite,
                           const tl_channel *channel, const char *seeds, const tl_stream_opts *opts,
                           tl_polydata **lines, tl_stream_report *report)
{
    seed_words s;
    tl_status st;
    tl_polydata *points = NULL;
    *lines = NULL;
    st = tli_flow_check(ctx, channel);
    if (st) return st;
    if (!parse(seeds, &s))
        return tl_fail(ctx, TL_ERR_ARG,
                       "seeds '%s': expected grid[:N], critical[:N], "
                       "box:X0,Y0,Z0,X1,Y1,Z1[:N], line:X0,Y0,Z0,X1,Y1,Z1[:N], "
                       "plane:X,Y,Z,NX,NY,NZ[:N], or a file",
                       seeds);
    if (s.kind == GRID)
        return tl_streamlines_cover(ctx, mesh, opposite, NULL, channel->values, NULL,
                                    (uint32_t)s.count, opts, lines, report);
    st = make_seeds(ctx, mesh, channel, &s, seeds, &points);
    if (!st)
        st = tl_streamlines(ctx, mesh, opposite, NULL, channel->values, points->xyz,
                            points->vert_count, opts, lines, report);
    tl_polydata_destroy(ctx, points);
    return st;
}

tl_status tl_seeds_follow(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                          const char *seeds, const tl_stream_opts *opts, tl_polydata **lines,
                          tl_stream_report *report)
{
    return tli_seeds_follow(ctx, mesh, NULL, channel, seeds, opts, lines, report);
}
