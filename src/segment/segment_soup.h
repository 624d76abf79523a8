/* Stage segment, internal: a mesh on disk that grows at its end: what a round of simplification
 * leaves, to be read as a feed by the next one, or to be written to a file. */
#ifndef TETRALOD_SRC_SEGMENT_SOUP_H
#define TETRALOD_SRC_SEGMENT_SOUP_H

#include "formats/formats_feed.h"
#include "segment/segment.h"

typedef struct tli_soup {
    tl_ctx *ctx;
    const tl_segments *like; /* channels and regions are as there; borrowed */
    tli_scratch *verts;      /* [vert_count] xyz, values */
    tli_scratch *tets;       /* [tet_count] u32 [4]; regions and values apart */
    tli_scratch *regions;    /* [tet_count] i32; NULL: none */
    tli_scratch *values;     /* [tet_count][components on tets]; NULL: none */
    uint64_t vert_count, tet_count;
    size_t vert_numbers; /* doubles of a vertex */
    bool *fits;         /* [channels + 1] all values fit the channel's type; last: float32 places */
    bool regions_match; /* the first channel that is named like regions holds them */
    int region_channel; /* that channel, or -1 */
} tli_soup;

tl_status tli_soup_open(tl_ctx *ctx, const tl_segments *like, const char *folder, tli_soup *soup);
void tli_soup_close(tli_soup *soup);

/* Writes vertex records [count][vert_numbers] from vertex first on; vert_count grows as needed. */
tl_status tli_soup_put_verts(tli_soup *soup, uint64_t first, const double *records, size_t count);
/* Appends tets with their regions and values (NULL where there are none). */
tl_status tli_soup_add_tets(tli_soup *soup, const tl_lidx *tets, const int32_t *regions,
                            const double *values, size_t count);

/* Borrows the soup. Gives *feed. */
tl_status tli_soup_feed(const tli_soup *soup, uint64_t memory_bytes, tli_feed **feed);
/* Streams it to a .vtu or .vtk file, as tl_mesh_write would write it. */
tl_status tli_soup_write(const tli_soup *soup, const char *path, const tl_write_opts *opts);

#endif
