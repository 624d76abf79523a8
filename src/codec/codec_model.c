/* The states of a gate: those whose open faces differ, and, where several are open, those that meet
 * at one vertex. Bits of the second index: apexes 0 and 1, 0 and 2, 1 and 2 are one vertex. */
#include "codec/codec_model.h"

const uint8_t tli_op_states[8][8] = {{0, 0, 0, 0, 0, 0, 0, 0}, {1, 1, 1, 1, 1, 1, 1, 1},
                                     {2, 2, 2, 2, 2, 2, 2, 2}, {3, 4, 3, 4, 3, 4, 3, 4},
                                     {5, 5, 5, 5, 5, 5, 5, 5}, {6, 6, 7, 7, 6, 6, 7, 7},
                                     {8, 8, 8, 8, 9, 9, 9, 9}, {10, 11, 12, 13, 14, 13, 13, 13}};
