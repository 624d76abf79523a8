/* The work folder: what a build was asked, in words, and which stage it reached. */
#include "model/model_work.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "model/model_state.h"

/* ---- what a build was asked ---- */

/* A text that grows. */
typedef struct words {
    tl_ctx *ctx;
    char *text;
    size_t length, room;
    tl_status status;
} words;

TL_PRINTF(2, 3) static void say(words *w, const char *format, ...)
{
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    int n = tli_vprint(NULL, 0, format, args);
    va_end(args);
    if (w->length + (size_t)n + 1 > w->room) {
        size_t room = 2 * w->room + (size_t)n + 256;
        w->text = tl_mem_resize(w->ctx, w->text, room, 1, &w->status);
        if (!w->status) w->room = room;
    }
    if (!w->status)
        w->length += (size_t)tli_vprint(w->text + w->length, w->room - w->length, format, again);
    va_end(again);
}

static tl_status say_input(words *w, const char *what, const char *path)
{
    struct stat info;
    if (!path) return TL_OK;
    if (stat(path, &info)) return tl_fail(w->ctx, TL_ERR_IO, "'%s': %s", path, strerror(errno));
    const char *slash = strrchr(path, '/');
    say(w, "%s: %s\n", what, slash ? slash + 1 : path);
    say(w, "%s bytes: %lld\n%s time: %lld.%09ld\n", what, (long long)info.st_size, what,
        (long long)info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
    return TL_OK;
}

static tl_status say_steps(words *w, const tli_source *from)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < from->step_count; i++) {
        const tl_step *step = &from->steps[i];
        say(w, "step %u: %llu\n", step->number, (unsigned long long)step->step);
        if (!i || strcmp(step->path, step[-1].path) != 0) st = say_input(w, "input", step->path);
    }
    return st;
}

static void say_reading(words *w, const tl_read_opts *r)
{
    say(w, "dimensions: %u %u %u, type %d, %s\n", r->raw_dims[0], r->raw_dims[1], r->raw_dims[2],
        (int)r->raw_scalar, r->raw_big_endian ? "big endian" : "little endian");
    say(w, "split: %d\ncell data to points: %d\n", r->split, r->cell_to_point);
    say(w, "fill value: %d %.17g, kept %d\n", r->has_fill_value, r->fill_value, r->keep_fill);
    say(w, "region: %s\n", r->region ? r->region : "");
    say(w, "step: %llu, time %d %.17g\n", (unsigned long long)r->step, r->has_time, r->time);
    say(w, "weld: %d %.17g\n", r->weld, r->weld_distance);
}

static void say_building(words *w, const tl_build_opts *o)
{
    say(w, "channels:");
    for (size_t i = 0; i < o->channel_count; i++) say(w, " '%s'", o->channels[i]);
    say(w, "%s\n", o->channels ? "" : " all");
    say(w, "channel error: %.17g\n", o->channel_error);
    for (size_t i = 0; i < o->error_count; i++)
        say(w, "error of '%s': %.17g%s%s\n", o->errors[i].name, o->errors[i].error,
            o->errors[i].relative ? " of the range" : "", o->errors[i].lossless ? ", none" : "");
    say(w, "position error: %.17g\nboundary error: %.17g\n", o->position_error, o->boundary_error);
    say(w, "lossless: %d, places %d\nplain numbers: %d\n", o->lossless, o->exact_places, o->raw);
    say(w, "segment tets: %u\npatch tets: %u\nreduction: %.17g\n", o->segment_tets, o->patch_tets,
        o->reduction);
    say(w, "partition: %d\nprune: %d\n", (int)o->partition, o->prune);
    for (size_t i = 0; i < o->steer_count; i++) say(w, "steering step: %u\n", o->steer[i]);
}

static tl_status describe(tl_ctx *ctx, const tli_source *from, const tl_build_opts *opts,
                          char **asked)
{
    words w = {.ctx = ctx};
    tl_read_opts r = tl_read_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_read_opts", from->read, &r, sizeof r);
    if (!st) st = say_input(&w, "input", from->input);
    if (!st) st = say_steps(&w, from);
    if (!st) st = say_input(&w, "solution", r.solution);
    say_reading(&w, &r);
    say_building(&w, opts);
    *asked = w.text;
    return st ? st : w.status;
}

/* Names the first line that differs. */
static tl_status compare(const tli_work *w, const char *before)
{
    const char *a = before, *b = w->asked;
    while (*a && *b) {
        size_t n = strcspn(a, "\n"), m = strcspn(b, "\n");
        if (n != m || memcmp(a, b, n) != 0)
            return tl_fail(w->ctx, TL_ERR_DATA,
                           "'%s' is of another build: there it is \"%.*s\", here \"%.*s\"",
                           w->folder, (int)n, a, (int)m, b);
        a += n + 1;
        b += m + 1;
    }
    if (*a || *b)
        return tl_fail(w->ctx, TL_ERR_DATA, "'%s' is of a build with other options", w->folder);
    return TL_OK;
}

/* ---- the folder ---- */

char *tli_work_path(const tli_work *w, const char *name, tl_status *st)
{
    if (!w->folder) return NULL;
    size_t bytes = strlen(w->folder) + strlen(name) + 2;
    char *path = tl_mem_alloc(w->ctx, bytes, 1, st);
    if (path) snprintf(path, bytes, "%s/%s", w->folder, name);
    return path;
}

tl_status tli_work_depot(const tli_work *w, const tli_plan *plan, const char *name,
                         tli_depot **depot)
{
    tl_status st = TL_OK;
    if (!w->folder) return tli_depot_create(w->ctx, plan->opts.folder, depot);
    char *path = tli_work_path(w, name, &st);
    if (!st) st = tli_depot_open(w->ctx, path, w->stage < TLI_STAGE_FINEST, depot);
    tl_mem_free(w->ctx, path);
    return st;
}

static tl_status make_folder(const tli_work *w)
{
    struct stat info;
    tl_status st = TL_OK;
    if (mkdir(w->folder, 0777) && errno != EEXIST)
        return tl_fail(w->ctx, TL_ERR_IO, "the folder '%s' can't be made: %s", w->folder,
                       strerror(errno));
    if (stat(w->folder, &info) || !S_ISDIR(info.st_mode))
        return tl_fail(w->ctx, TL_ERR_IO, "'%s' is no folder", w->folder);
    char *path = tli_work_path(w, TLI_STATE_NAME, &st);
    if (!st && stat(path, &info) == 0)
        st = tl_fail(w->ctx, TL_ERR_DATA,
                     "'%s' holds a build already: go on with it (resume), or remove it", w->folder);
    tl_mem_free(w->ctx, path);
    return st;
}

static tl_status open_state(tli_work *w)
{
    tl_status st = TL_OK;
    char *before = NULL, *path = tli_work_path(w, TLI_STATE_NAME, &st);
    if (!st) st = tli_map_open(w->ctx, path, &w->state);
    if (!st) st = tli_state_begin(w, path, &before);
    if (!st) st = compare(w, before);
    tl_mem_free(w->ctx, before);
    tl_mem_free(w->ctx, path);
    return st;
}

/* ---- options ---- */

/* "segment", "finest", "level N" or "levelN"; TL_NONE for others. */
static uint32_t parse_stage(const char *text)
{
    char *end;
    if (strcmp(text, "segment") == 0) return TLI_STAGE_SEGMENT;
    if (strcmp(text, "finest") == 0) return TLI_STAGE_FINEST;
    if (strncmp(text, "level", 5) != 0) return TL_NONE;
    text += 5;
    text += *text == ' ';
    if (*text < '0' || *text > '9') return TL_NONE;
    unsigned long level = strtoul(text, &end, 10);
    return *end || level > 63 ? TL_NONE : TLI_STAGE_FINEST + (uint32_t)level;
}

tl_status tli_work_open(tl_ctx *ctx, const tli_source *from, const tl_build_opts *o, tli_work *w)
{
    *w = (tli_work){.ctx = ctx, .stop = TL_NONE};
    const char *folder = o->resume ? o->resume : o->keep;
    tl_status st = TL_OK;
    if (o->until) {
        w->stop = parse_stage(o->until);
        if (w->stop == TL_NONE)
            return tl_fail(ctx, TL_ERR_ARG, "stop after '%s', expected segment, finest or level N",
                           o->until);
        if (!folder)
            return tl_fail(ctx, TL_ERR_ARG,
                           "to stop after a stage a folder is needed that keeps it");
    }
    if (!folder) return TL_OK;
    if (from->mesh)
        return tl_fail(ctx, TL_ERR_ARG, "the build of a mesh in memory can't be kept or resumed");
    if (o->resume && o->keep && strcmp(o->resume, o->keep) != 0)
        return tl_fail(ctx, TL_ERR_ARG, "a build that is resumed stays in its folder");
    w->folder = tli_strdup(ctx, folder, &st);
    if (!st) st = describe(ctx, from, o, &w->asked);
    if (!st) st = o->resume ? open_state(w) : make_folder(w);
    return st;
}

void tli_work_close(tli_work *w)
{
    if (w->state.bytes) tli_map_close(w->ctx, &w->state);
    tl_mem_free(w->ctx, w->asked);
    tl_mem_free(w->ctx, w->folder);
    *w = (tli_work){0};
}
