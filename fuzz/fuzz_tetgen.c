/* The reader of TetGen files. What stands before the first zero byte, or everything, is the file of
 * the points; the rest that of the cells, which is named. */
#include "fuzz_source.h"

#include <string.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count)
{
    static const uint8_t nothing[1];
    const uint8_t *zero = byte_count ? memchr(bytes, 0, byte_count) : NULL;
    size_t node_count = zero ? (size_t)(zero - bytes) : byte_count;
    char path[64];
    if (!zero) {
        fuzz_read(tli_read_tetgen, "input.node", byte_count ? bytes : nothing, byte_count);
        return 0;
    }
    snprintf(path, sizeof path, "fuzz_tetgen_%ld.node", (long)getpid());
    FILE *file = fopen(path, "wb");
    FUZZ_CHECK(file && fwrite(bytes, 1, node_count, file) == node_count && fclose(file) == 0);
    char cells[64];
    snprintf(cells, sizeof cells, "fuzz_tetgen_%ld.ele", (long)getpid());
    fuzz_read(tli_read_tetgen, cells, zero + 1, byte_count - node_count - 1);
    remove(path);
    return 0;
}
