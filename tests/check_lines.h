/* Lines of polydata, vertex by vertex. */
#ifndef TETRALOD_TESTS_CHECK_LINES_H
#define TETRALOD_TESTS_CHECK_LINES_H

#include "tetralod/mesh.h"

static inline const double *line_vert(const tl_polydata *lines, size_t line, size_t i)
{
    return lines->xyz + 3 * (size_t)lines->corners[lines->starts[line] + i];
}

static inline size_t line_verts(const tl_polydata *lines, size_t line)
{
    return lines->starts[line + 1] - lines->starts[line];
}

#endif
