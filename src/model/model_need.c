/* Memory of a build, by measurement (docs/notes/2026-11-22-model.md): what grows with the data set
 * is what is noted of patches and segments. */
#include "model/model_need.h"

/* A segment: bytes a tet, and for each component on vertices and on tets; the largest over the
 * mean. */
enum { TET_BYTES = 190, VERT_COMP_BYTES = 14, TET_COMP_BYTES = 18 };
static const double LARGEST = 1.4;
/* Lists: bytes a patch and a segment, and for each channel; all levels over the finest. */
enum { PATCH_BYTES = 900, PATCH_FIELD_BYTES = 60, NOTE_BYTES = 400, NOTE_FIELD_BYTES = 1100 };
static const double LEVELS = 2.2;
/* What the input takes while it is cut, at least and a tet; what the file takes while it is
 * written. */
enum { CUT_BYTES = 28 << 20, FILE_BYTES = 8 << 20 };
static const double CUT_TET_BYTES = 0.3;
enum { STEP = 1 << 20 };
/* Work files, bytes a tet of the input, and for each component. */
enum { DISK_TET_BYTES = 140, DISK_VERT_COMP_BYTES = 9, DISK_TET_COMP_BYTES = 32 };

uint64_t tli_need_lists(const tli_need *n)
{
    double tets = LEVELS * (double)n->tets, fields = (double)n->fields;
    double patches = tets / n->patch_tets + 64, segments = tets / n->segment_tets + 16;
    return (uint64_t)(patches * (PATCH_BYTES + PATCH_FIELD_BYTES * fields) +
                      segments * (NOTE_BYTES + NOTE_FIELD_BYTES * fields));
}

uint64_t tli_need_segment(const tli_need *n)
{
    uint64_t tet = TET_BYTES + VERT_COMP_BYTES * n->vert_comps + TET_COMP_BYTES * n->tet_comps;
    double most = LARGEST * n->segment_tets;
    if (most > (double)n->tets) most = (double)n->tets;
    return (uint64_t)(most * (double)tet) + STEP;
}

uint64_t tli_need_least(const tli_need *n)
{
    uint64_t cut = CUT_BYTES + (uint64_t)(CUT_TET_BYTES * (double)n->tets);
    uint64_t levels = FILE_BYTES + tli_need_lists(n) + tli_need_segment(n);
    uint64_t least = cut > levels ? cut : levels;
    return (least + STEP - 1) / STEP * STEP;
}

uint64_t tli_need_disk(const tli_need *n)
{
    double tet = DISK_TET_BYTES + (double)n->vert_comps * DISK_VERT_COMP_BYTES +
                 (double)n->tet_comps * DISK_TET_COMP_BYTES;
    return (uint64_t)((double)n->tets * tet);
}

size_t tli_need_at_once(const tli_need *n, uint64_t limit, size_t threads)
{
    uint64_t lists = FILE_BYTES + tli_need_lists(n), left = limit > lists ? limit - lists : 0;
    uint64_t fit = left / tli_need_segment(n);
    if (!limit) return threads;
    return fit < 1 ? 1 : fit < threads ? (size_t)fit : threads;
}
