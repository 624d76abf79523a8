/* What follows from the connectivity alone. */
#include "codec/codec_topology.h"

#include <string.h>

int32_t tli_region_guess(const tl_patch *patch, uint32_t tet, uint32_t *row)
{
    uint32_t eldest = tet;
    bool agree = true;
    for (int face = 0; face < 4; face++) {
        uint32_t across = patch->opposite[tet][face];
        if (across == TL_NONE || across >> 2 >= tet) continue;
        if (eldest < tet && patch->regions[across >> 2] != patch->regions[eldest]) agree = false;
        if (across >> 2 < eldest) eldest = across >> 2;
    }
    *row = eldest == tet ? 0 : agree ? 1 : 2;
    return eldest < tet ? patch->regions[eldest] : tet > 0 ? patch->regions[tet - 1] : 0;
}

void tli_patch_border(const tl_patch *patch, uint8_t *on_border)
{
    memset(on_border, 0, patch->vert_count);
    for (uint32_t t = 0; t < patch->tet_count; t++) {
        const uint32_t *opposite = patch->opposite[t];
        for (int face = 0; face < 4; face++) {
            if (opposite[face] != TL_NONE) continue;
            for (int c = 1; c < 4; c++) on_border[patch->tets[t][(face + c) & 3]] = 1;
        }
    }
}
