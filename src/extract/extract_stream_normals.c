/* Normals of lines, for ribbons: carried along without twist, by two reflections a step (Wang,
 * Juettler, Zheng & Liu 2008, "Computation of rotation minimizing frames"), then turned about the
 * line as the flow turns: by half of the vorticity along it (Ueng, Sikorski & Ma 1996, "Efficient
 * streamline, streamribbon, and streamtube constructions on unstructured grids"). */
#include <math.h>

#include "base/base_vec.h"
#include "extract/extract_stream.h"

/* The first normal is the z axis across the line, or the x axis where the line runs along z: within
 * this cosine. */
static const double ALONG = 0.95;
enum { LINES_AT_ONCE = 16 };

double tli_stream_spin(const tli_stream_cell *cell, const double v[3])
{
    double curl[3] = {0, 0, 0}, speed = vec_length(v);
    for (int i = 0; i < 4; i++) {
        double own[3];
        vec_cross(cell->slopes[i], cell->vectors[i], own);
        for (int k = 0; k < 3; k++) curl[k] += own[k];
    }
    return speed > 0 ? 0.5 * vec_dot(curl, v) / speed : 0;
}

typedef struct normals {
    const tli_stream_sum *sum;
    size_t width, spin; /* of a row; its column */
    float *out;
} normals;

static const double *row_at(const normals *n, size_t row)
{
    return n->sum->rows + n->width * row;
}

/* The direction of a line at a row, one long; that of the row before where it has none. */
static void take_tangent(const normals *n, size_t row, size_t begin, size_t end, double out[3])
{
    double way[3];
    vec_sub(row_at(n, row + 1 < end ? row + 1 : row), row_at(n, row > begin ? row - 1 : row), way);
    double length = vec_length(way);
    for (int k = 0; k < 3 && length > 0; k++) out[k] = way[k] / length;
}

/* Mirrors a at the plane across a way; ways of no length do nothing. */
static void mirror(const double way[3], double a[3])
{
    const double square = vec_dot(way, way), part = square > 0 ? 2 * vec_dot(way, a) / square : 0;
    for (int k = 0; k < 3; k++) a[k] -= part * way[k];
}

/* Makes a normal one long and leaves what lies across the tangent. */
static void straighten(const double tangent[3], double normal[3])
{
    const double along = vec_dot(tangent, normal);
    for (int k = 0; k < 3; k++) normal[k] -= along * tangent[k];
    const double length = vec_length(normal);
    for (int k = 0; k < 3 && length > 0; k++) normal[k] /= length;
}

static void begin_line(const double tangent[3], double normal[3])
{
    const bool upright = fabs(tangent[2]) > ALONG;
    for (int k = 0; k < 3; k++) normal[k] = k == (upright ? 0 : 2);
    straighten(tangent, normal);
}

/* From one row to the next, without twist. */
static void carry(const normals *n, size_t row, const double before[3], const double after[3],
                  double normal[3])
{
    double way[3], tangent[3] = {before[0], before[1], before[2]}, off[3];
    vec_sub(row_at(n, row), row_at(n, row - 1), way);
    mirror(way, tangent);
    mirror(way, normal);
    vec_sub(after, tangent, off);
    mirror(off, normal);
    straighten(after, normal);
}

/* A normal turned about the tangent. */
static void put_turned(const double tangent[3], const double normal[3], double angle, float *out)
{
    double across[3];
    vec_cross(tangent, normal, across);
    for (int k = 0; k < 3; k++) out[k] = (float)(cos(angle) * normal[k] + sin(angle) * across[k]);
}

static tl_status set_lines(void *arg, size_t first, size_t last, unsigned worker)
{
    (void)worker;
    const normals *n = arg;
    for (size_t line = first; line < last; line++) {
        const size_t begin = n->sum->starts[line];
        const size_t end = line + 1 < n->sum->line_count ? n->sum->starts[line + 1] : n->sum->count;
        double tangent[3] = {0, 0, 1}, normal[3], angle = 0;
        take_tangent(n, begin, begin, end, tangent);
        begin_line(tangent, normal);
        for (size_t row = begin; row < end; row++) {
            if (row > begin) {
                const double *a = row_at(n, row - 1), *b = row_at(n, row);
                const double before[3] = {tangent[0], tangent[1], tangent[2]};
                take_tangent(n, row, begin, end, tangent);
                carry(n, row, before, tangent, normal);
                angle += (b[TLI_ROW_TIME] - a[TLI_ROW_TIME]) * (a[n->spin] + b[n->spin]) / 2;
            }
            put_turned(tangent, normal, isfinite(angle) ? angle : 0, n->out + 3 * row);
        }
    }
    return TL_OK;
}

tl_status tli_stream_normals(const tli_stream_job *job, const tli_stream_sum *sum, float **out)
{
    tl_status st = TL_OK;
    normals n = {.sum = sum, .width = job->row_doubles, .spin = job->row_doubles - 1};
    n.out = tl_mem_alloc(job->ctx, sum->count, 3 * sizeof *n.out, &st);
    if (!st) st = tli_parallel(job->ctx, sum->line_count, LINES_AT_ONCE, set_lines, &n);
    *out = n.out;
    return st;
}
