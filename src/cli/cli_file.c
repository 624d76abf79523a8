/* Small files: written beside their place, then renamed. */
#include "cli_file.h"

#include <errno.h>
#include <stdbool.h>
#include <string.h>
#include <sys/stat.h>

#include "cli_options.h"

enum { NAME_BYTES = 4096 };

static bool is_device(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode);
}

/* false if there is no room for it. */
static bool name_beside(const char *path, char name[NAME_BYTES])
{
    const int n = snprintf(name, NAME_BYTES, "%s%s", path, is_device(path) ? "" : ".part");
    return n > 0 && n < NAME_BYTES;
}

static int wrong(const char *path, const char *why)
{
    fprintf(stderr, "tetralod: can't write '%s': %s\n", path, why);
    return CLI_FAILED;
}

int cli_file_begin(const char *path, FILE **file)
{
    char name[NAME_BYTES];
    *file = NULL;
    if (!name_beside(path, name)) return wrong(path, "the name is too long");
    *file = fopen(name, "wb");
    return *file ? CLI_DONE : wrong(path, strerror(errno));
}

int cli_file_end(const char *path, FILE *file, int failed)
{
    char name[NAME_BYTES];
    const bool lost = ferror(file) != 0;
    if ((fclose(file) || lost) && !failed) failed = wrong(path, strerror(errno));
    if (!name_beside(path, name) || is_device(path)) return failed;
    if (!failed && rename(name, path)) failed = wrong(path, strerror(errno));
    if (failed) remove(name);
    return failed;
}
