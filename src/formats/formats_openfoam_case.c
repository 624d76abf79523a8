/* OpenFOAM: the folders of a case. Times are folders whose names are numbers; a file of the mesh
 * that a time lacks stands in an earlier one, or in constant. */
#include "formats/formats_openfoam.h"

#include "formats/formats_number.h"

#include <dirent.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PATH_BYTES 4096
#define NAMES_MAX 1000000
#define PROCESSORS_MAX 1000000

/* ---- folders ---- */

static int by_name(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

tl_status tli_folder_list(tl_ctx *ctx, const char *folder, char ***names, size_t *count)
{
    tl_status st = TL_OK;
    struct dirent *entry;
    char **list = NULL;
    size_t used = 0;
    DIR *dir = opendir(folder);
    *names = NULL;
    *count = 0;
    if (!dir) return tl_fail(ctx, TL_ERR_IO, "'%s': the folder can't be read", folder);
    while (!st && (entry = readdir(dir)) != NULL) {
        if (entry->d_name[0] == '.') continue;
        if ((used & (used - 1)) == 0)
            list = tl_mem_resize(ctx, list, used ? 2 * used : 1, sizeof *list, &st);
        if (!st && used == NAMES_MAX)
            st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': more than %d names", folder, NAMES_MAX);
        char *name = tli_strdup(ctx, entry->d_name, &st);
        if (!st) list[used++] = name;
    }
    closedir(dir);
    if (st) {
        tli_folder_release(ctx, list, used);
        return st;
    }
    if (used) qsort(list, used, sizeof *list, by_name);
    *names = list;
    *count = used;
    return TL_OK;
}

void tli_folder_release(tl_ctx *ctx, char **names, size_t count)
{
    for (size_t i = 0; i < count; i++) tl_mem_free(ctx, names[i]);
    tl_mem_free(ctx, names);
}

static bool exists(const char *folder, const char *a, const char *b)
{
    char path[PATH_BYTES];
    int length = snprintf(path, sizeof path, "%s/%s/%s", folder, a, b);
    return length > 0 && (size_t)length < sizeof path && tli_file_exists(path);
}

/* ---- the case ---- */

bool tli_foam_case_of(const tli_source *source, char *folder, size_t folder_bytes)
{
    static const char control[] = "system/controlDict";
    size_t length = strlen(source->path);
    if (length >= folder_bytes) return false;
    strcpy(folder, source->path);
    if (source->folder) return true;
    const size_t tail = sizeof control - 1;
    bool is_control = length >= tail && strcmp(source->path + length - tail, control) == 0;
    if (!is_control && !tli_ends_in(source->path, ".foam .openfoam")) return false;
    char *slash = strrchr(folder, '/');
    if (is_control) slash = length > tail ? folder + length - tail - 1 : NULL;
    if (slash)
        slash[slash == folder] = '\0'; /* the root stays */
    else
        strcpy(folder, ".");
    return true;
}

static int by_time(const void *a, const void *b)
{
    const tli_foam_time *x = a, *y = b;
    if (x->value != y->value) return x->value < y->value ? -1 : 1;
    return strcmp(x->name, y->name);
}

/* A folder whose whole name is a number. */
static bool is_time(const char *name, tli_foam_time *time)
{
    const char *end = name + strlen(name);
    if (strlen(name) >= sizeof time->name || tli_number_f64(name, end, &time->value) != end)
        return false;
    if (!((*name >= '0' && *name <= '9') || *name == '-' || *name == '.'))
        return false; /* inf, nan */
    strcpy(time->name, name);
    return true;
}

static tl_status find_times(tli_foam_case *c, const char *root)
{
    char **names = NULL;
    size_t count = 0;
    tl_status st = tli_folder_list(c->ctx, root, &names, &count);
    c->times = tl_mem_alloc(c->ctx, count, sizeof *c->times, &st);
    for (size_t i = 0; !st && i < count; i++)
        if (is_time(names[i], &c->times[c->time_count]) && exists(root, names[i], "."))
            c->time_count++;
    if (!st && c->time_count) qsort(c->times, c->time_count, sizeof *c->times, by_time);
    tli_folder_release(c->ctx, names, count);
    return st;
}

tl_status tli_foam_case_open(tl_ctx *ctx, const tli_source *source, tli_foam_case *c)
{
    char folder[PATH_BYTES], root[PATH_BYTES + 16];
    tl_status st = TL_OK;
    *c = (tli_foam_case){.ctx = ctx};
    if (!tli_foam_case_of(source, folder, sizeof folder))
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': names no OpenFOAM case", source->path);
    c->folder = tli_strdup(ctx, folder, &st);
    snprintf(root, sizeof root, "%s", folder);
    if (!exists(folder, "constant/polyMesh", ".") && exists(folder, "processor0", ".")) {
        char name[32];
        do snprintf(name, sizeof name, "processor%u", ++c->processors);
        while (c->processors < PROCESSORS_MAX && exists(folder, name, "."));
        snprintf(root, sizeof root, "%s/processor0", folder);
    }
    if (!st) st = find_times(c, root);
    if (st) tli_foam_case_close(c);
    return st;
}

void tli_foam_case_close(tli_foam_case *c)
{
    tl_mem_free(c->ctx, c->times);
    tl_mem_free(c->ctx, c->folder);
    *c = (tli_foam_case){.ctx = c->ctx};
}

tl_status tli_foam_find_mesh_file(const tli_foam_case *c, const char *root, size_t step,
                                  const char *name, tli_foam *file, bool *there)
{
    char path[PATH_BYTES];
    tl_status st = TL_OK;
    *there = false;
    for (size_t t = step < c->time_count ? step + 1 : c->time_count; !st && !*there && t-- > 0;) {
        snprintf(path, sizeof path, "%s/%s/polyMesh/%s", root, c->times[t].name, name);
        st = tli_foam_open(c->ctx, path, file, there);
    }
    snprintf(path, sizeof path, "%s/constant/polyMesh/%s", root, name);
    return st || *there ? st : tli_foam_open(c->ctx, path, file, there);
}

tl_status tli_foam_open_mesh_file(const tli_foam_case *c, const char *root, size_t step,
                                  const char *name, tli_foam *file)
{
    bool there;
    tl_status st = tli_foam_find_mesh_file(c, root, step, name, file, &there);
    if (!st && !there)
        st = tl_fail(c->ctx, TL_ERR_IO, "'%s/constant/polyMesh/%s': there is no such file", root,
                     name);
    return st;
}

bool tli_foam_has_mesh_file(const tli_foam_case *c, const char *root, const char *name)
{
    char tail[96];
    for (size_t t = 0; t < c->time_count; t++) {
        snprintf(tail, sizeof tail, "%s/polyMesh", c->times[t].name);
        if (exists(root, tail, name)) return true;
    }
    return false;
}
