/* The one door in: tells what a source is by its first bytes, then by its name, has its reader fill
 * a grid and turns the grid into tets. Formats that are known but not read here are refused by
 * name.
 */
#include "formats/formats_reader.h"
#include "formats/formats_scan.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* Bytes at either end of a file that are searched for a word that tells its kind. */
#define TAIL_BYTES ((uint64_t)4 << 20)

/* ---- sources ---- */

bool tli_head_begins(const tli_source *source, const char *text)
{
    return strncmp(source->head, text, strlen(text)) == 0;
}

/* Text within count bytes. */
static bool holds(const uint8_t *bytes, uint64_t count, const char *text)
{
    size_t length = strlen(text);
    const uint8_t *at = bytes, *end = bytes + count;
    while ((size_t)(end - at) >= length &&
           (at = memchr(at, text[0], (size_t)(end - at) - length + 1))) {
        if (memcmp(at, text, length) == 0) return true;
        at++;
    }
    return false;
}

bool tli_source_holds(const tli_source *source, const char *text)
{
    uint64_t count = source->map.byte_count, part = count < TAIL_BYTES ? count : TAIL_BYTES;
    if (source->folder) return false;
    return holds(source->map.bytes, part, text) ||
           holds(source->map.bytes + (count - part), part, text);
}

bool tli_ends_in(const char *path, const char *endings)
{
    while (*endings) {
        char ending[16];
        size_t length = strcspn(endings, " ");
        if (length < sizeof ending) {
            memcpy(ending, endings, length);
            ending[length] = '\0';
            if (tli_path_ends(path, ending)) return true;
        }
        endings += length;
        endings += strspn(endings, " ");
    }
    return false;
}

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

/* A file that is packed as a whole is read as what it was before. */
static tl_status unpack(tl_ctx *ctx, tli_source *source)
{
    tli_map packed = source->map;
    tl_status st = tli_inflate(ctx, source->path, packed.bytes, packed.byte_count, UINT64_MAX,
                               false, &source->map);
    tli_map_close(ctx, &packed);
    return st;
}

static tl_status source_open(tl_ctx *ctx, const char *path, unsigned depth, tli_source *source)
{
    *source = (tli_source){.path = path, .depth = depth, .folder = is_folder(path)};
    if (source->folder) return TL_OK;
    tl_status st = tli_map_open(ctx, path, &source->map);
    if (!st && tli_is_gzip(source->map.bytes, source->map.byte_count)) st = unpack(ctx, source);
    if (st) return st;
    const tli_map *map = &source->map;
    source->head_bytes =
        map->byte_count < TLI_HEAD_BYTES ? (size_t)map->byte_count : TLI_HEAD_BYTES;
    for (size_t i = 0; i < source->head_bytes; i++)
        source->head[i] = map->bytes[i] ? (char)map->bytes[i] : ' ';
    return TL_OK;
}

static void source_close(tl_ctx *ctx, tli_source *source)
{
    if (!source->folder) tli_map_close(ctx, &source->map);
}

/* ---- which reader ---- */

static tl_status refuse(tl_ctx *ctx, const char *path, const char *what)
{
    char list[512] = "";
    size_t used = 0;
    for (size_t i = 0; i < tli_reader_count; i++) {
        const tl_format *format = &tli_readers[i].format;
        if (!format->reads) continue;
        int n = snprintf(list + used, sizeof list - used, "%s%s", used ? ", " : "", format->name);
        if (n < 0 || (size_t)n >= sizeof list - used) break;
        used += (size_t)n;
    }
    list[used] = '\0';
    return tl_fail(ctx, TL_ERR_UNSUPPORTED, "'%s': %s; this build reads %s", path, what, list);
}

static const tli_reader *reader_named(const char *name)
{
    for (size_t i = 0; i < tli_reader_count; i++)
        if (strcmp(tli_readers[i].format.name, name) == 0) return &tli_readers[i];
    return NULL;
}

/* What begins with no known bytes may be PLOT3D, which has none: its sizes tell. */
static tl_status take_unknown(tl_ctx *ctx, const tli_source *source, const tli_reader **reader)
{
    const char *path = source->path, *foreign = tli_foreign_by_name(path);
    if (source->folder)
        return tl_fail(ctx, TL_ERR_IO, "'%s': a folder, and none that a reader knows", path);
    if (source->map.byte_count == 0)
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': an empty file", path);
    if (strstr(source->head, "<VTKFile")) { /* says what is wrong with it */
        *reader = reader_named("VTU");
        return TL_OK;
    }
    if (tli_ends_in(path, ".vtu .vti .vtr .vts .vtk"))
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s': starts with neither %s", path,
                       "'# vtk DataFile Version' nor XML with a VTKFile element");
    if (foreign) return refuse(ctx, path, foreign);
    *reader = reader_named("PLOT3D");
    return TL_OK;
}

static tl_status choose_reader(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                               const tli_reader **reader)
{
    tli_match best = TLI_MATCH_NO;
    *reader = NULL;
    if (!source->folder && (opts->raw_dims[0] || opts->raw_dims[1] || opts->raw_dims[2])) {
        *reader = reader_named("raw volume");
        return TL_OK;
    }
    for (size_t i = 0; i < tli_reader_count; i++) {
        tli_match match = tli_readers[i].match(source);
        if (match > best) *reader = &tli_readers[i];
        if (match > best) best = match;
    }
    const char *foreign = best == TLI_MATCH_BYTES ? NULL : tli_foreign_by_bytes(source);
    if (foreign) return refuse(ctx, source->path, foreign);
    if (!*reader) return take_unknown(ctx, source, reader);
    if ((*reader)->read) return TL_OK;
    return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                   "'%s': %s, which this build can't read: it was made without the library (Debian "
                   "package %s)",
                   source->path, (*reader)->format.name, (*reader)->format.package);
}

bool tli_reader_is(tl_ctx *ctx, const char *path, const tl_read_opts *opts, const char *name)
{
    tli_source source;
    const tli_reader *reader = NULL;
    tl_status st = source_open(ctx, path, 0, &source);
    if (!st) st = choose_reader(ctx, &source, opts, &reader);
    source_close(ctx, &source);
    return !st && reader == reader_named(name);
}

/* ---- reading ---- */

/* Whoever has no steps has step 0. */
static tl_status read_one(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                          tli_grid *grid)
{
    const tli_reader *reader;
    size_t step;
    tl_status st = choose_reader(ctx, source, opts, &reader);
    if (!st && !reader->steps) {
        st = tli_steps_pick(ctx, opts, NULL, 1, &step);
        if (st) return tl_note(ctx, st, "'%s' is no series", source->path);
    }
    if (st) return st;
    st = reader->read(ctx, source, opts, grid);
    if (st && reader->match(source) == TLI_MATCH_NO && reader == reader_named("PLOT3D"))
        tl_note(ctx, st, "'%s': tried as PLOT3D, since no other kind is told", source->path);
    return st;
}

static tl_status list_steps(tl_ctx *ctx, const tli_source *source, const tl_read_opts *opts,
                            tl_steps *steps)
{
    const tli_reader *reader;
    tl_status st = choose_reader(ctx, source, opts, &reader);
    if (!st)
        st = reader->steps ? reader->steps(ctx, source, opts, steps)
                           : tli_steps_alloc(ctx, 1, steps);
    if (st) tl_steps_release(ctx, steps);
    return st;
}

/* A collection that names itself, or others that do, ends here. */
static tl_status check_depth(tl_ctx *ctx, const tli_source *source, const char *path)
{
    if (source->depth < TLI_SOURCE_DEPTH_MAX) return TL_OK;
    return tl_fail(ctx, TL_ERR_FORMAT, "'%s': names '%s', the %dth file in a chain of files",
                   source->path, path, TLI_SOURCE_DEPTH_MAX + 1);
}

tl_status tli_grid_read(tl_ctx *ctx, const tli_source *source, const char *path,
                        const tl_read_opts *opts, tli_grid *grid)
{
    tli_source child;
    tl_status st = check_depth(ctx, source, path);
    if (!st) st = source_open(ctx, path, source->depth + 1, &child);
    if (st) return tl_note(ctx, st, "named by '%s'", source->path);
    st = read_one(ctx, &child, opts, grid);
    source_close(ctx, &child);
    return st ? tl_note(ctx, st, "named by '%s'", source->path) : TL_OK;
}

tl_status tli_grid_read_steps(tl_ctx *ctx, const tli_source *source, const char *path,
                              const tl_read_opts *opts, tl_steps *steps)
{
    tli_source child;
    *steps = (tl_steps){0};
    tl_status st = check_depth(ctx, source, path);
    if (!st) st = source_open(ctx, path, source->depth + 1, &child);
    if (st) return tl_note(ctx, st, "named by '%s'", source->path);
    st = list_steps(ctx, &child, opts, steps);
    source_close(ctx, &child);
    return st ? tl_note(ctx, st, "named by '%s'", source->path) : TL_OK;
}

char *tli_path_beside(tl_ctx *ctx, const char *base, const char *name, tl_status *status)
{
    const char *slash = strrchr(base, '/');
    size_t folder = slash && name[0] != '/' ? (size_t)(slash - base) + 1 : 0;
    char *path = tl_mem_alloc(ctx, folder + strlen(name) + 1, 1, status);
    if (*status) return NULL;
    memcpy(path, base, folder);
    memcpy(path + folder, name, strlen(name) + 1);
    return path;
}

/* ---- the doors ---- */

static tl_status take_opts(tl_ctx *ctx, const tl_read_opts *given, tl_read_opts *opts)
{
    *opts = tl_read_opts_defaults();
    return tli_opts_take(ctx, "tl_read_opts", given, opts, sizeof *opts);
}

static tl_status weld(tl_ctx *ctx, const tl_read_opts *opts, tli_grid *grid)
{
    uint64_t welded = 0;
    if (!opts->weld) return TL_OK;
    tl_status st = tli_grid_weld(grid, opts->weld_distance, &welded);
    if (!st) tl_log(ctx, TL_LOG_INFO, "%llu points welded to others", (unsigned long long)welded);
    return st;
}

tl_status tl_mesh_read(tl_ctx *ctx, const char *path, const tl_read_opts *opts, tl_mesh **mesh,
                       tl_read_report *report)
{
    tl_read_opts filled;
    tli_source source;
    *mesh = NULL;
    if (report) *report = (tl_read_report){0};
    tl_status st = take_opts(ctx, opts, &filled);
    tli_stamp before = tli_stamp_take(path);
    if (!st) st = source_open(ctx, path, 0, &source);
    if (st) return st;
    tli_grid grid;
    tli_grid_init(ctx, &grid);
    st = read_one(ctx, &source, &filled, &grid);
    source_close(ctx, &source);
    if (!st) st = weld(ctx, &filled, &grid);
    if (!st) {
        st = tli_grid_to_mesh(&grid, &filled, mesh, report);
        if (st) tl_note(ctx, st, "while turning '%s' into tets", path);
    }
    tli_grid_release(&grid);
    st = tli_stamp_check(ctx, path, &before, st);
    if (st) {
        tl_mesh_destroy(*mesh);
        *mesh = NULL;
    }
    return st;
}

tl_status tl_read_steps(tl_ctx *ctx, const char *path, const tl_read_opts *opts, tl_steps *steps)
{
    tl_read_opts filled;
    tli_source source;
    *steps = (tl_steps){0};
    tl_status st = take_opts(ctx, opts, &filled);
    if (!st) st = source_open(ctx, path, 0, &source);
    if (st) return st;
    st = list_steps(ctx, &source, &filled, steps);
    source_close(ctx, &source);
    return st;
}
