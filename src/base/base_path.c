/* Names of files. */
#include "base/base_file.h"

#include <string.h>

bool tli_path_ends(const char *path, const char *ending)
{
    size_t length = strlen(path), tail = strlen(ending);
    if (length < tail) return false;
    for (size_t i = 0; i < tail; i++) {
        char c = path[length - tail + i];
        if (c >= 'A' && c <= 'Z') c = (char)(c + ('a' - 'A'));
        if (c != ending[i]) return false;
    }
    return true;
}
