/* What follows from the connectivity alone. */
#include "codec/codec_topology.h"

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
