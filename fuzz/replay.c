/* The main function of a fuzz target that is built without libFuzzer: calls
 * LLVMFuzzerTestOneInput for every file of the folders given, in the order of their names, so that
 * every past crash is looked at by each test run. Each input stands in a block of its exact size,
 * where the address sanitizer sees a read past its end. Prints one line of TAP. */
#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t byte_count);

/* Returns 0 when the file could be read and was handed on. */
static int replay_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    struct stat info;
    uint8_t *bytes = NULL;
    int failed = !file || fstat(fileno(file), &info) != 0;
    if (!failed) {
        size_t byte_count = (size_t)info.st_size;
        bytes = malloc(byte_count ? byte_count : 1);
        failed = !bytes || fread(bytes, 1, byte_count, file) != byte_count;
        if (!failed) {
            printf("# %s\n", path);
            fflush(stdout); /* after a crash the last name is that of the culprit */
            (void)LLVMFuzzerTestOneInput(bytes, byte_count);
        }
    }
    if (failed) fprintf(stderr, "can't read '%s': %s\n", path, strerror(errno));
    free(bytes);
    if (file) fclose(file);
    return failed;
}

static int is_visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static int replay_folder(const char *folder, size_t *file_count)
{
    struct dirent **entries;
    int failed = 0, entry_count = scandir(folder, &entries, is_visible, alphasort);
    if (entry_count < 0) {
        fprintf(stderr, "can't list '%s': %s\n", folder, strerror(errno));
        return 1;
    }
    for (int i = 0; i < entry_count; i++) {
        char path[PATH_MAX];
        int length = snprintf(path, sizeof path, "%s/%s", folder, entries[i]->d_name);
        if (length < 0 || (size_t)length >= sizeof path)
            failed = 1;
        else
            failed |= replay_file(path);
        free(entries[i]);
        (*file_count)++;
    }
    free(entries);
    return failed;
}

int main(int argc, char **argv)
{
    const char *slash = strrchr(argv[0], '/'), *name = slash ? slash + 1 : argv[0];
    size_t file_count = 0;
    int failed = 0;
    for (int i = 1; i < argc; i++) failed |= replay_folder(argv[i], &file_count);
    if (!file_count) {
        fprintf(stderr, "no file to replay\n");
        failed = 1;
    }
    printf("%sok 1 - %s takes %zu files\n", failed ? "not " : "", name, file_count);
    return failed;
}
