/* The driver of a build. */
#include <math.h>
#include <sys/resource.h>
#include <sys/statvfs.h>

#include "model/model_work.h"

/* Part of the memory that the segments of the input are made in. */
enum { SEGMENT_PART = 2 };

/* Errors do not fall from a segment to the consumers of what it made. Segments are in the order of
 * their levels. */
void tli_model_saturate(tli_model *m)
{
    for (size_t s = 0; s < m->segment_count; s++) {
        tli_segment_note *to = &m->segments[s];
        for (uint32_t i = 0; i < to->input_count; i++) {
            uint32_t producer = m->patches[to->inputs[i]].producer;
            if (producer == TL_NONE) continue;
            tli_errors_join(m->plan, &m->segments[producer].errors, &to->errors);
        }
    }
}

static tl_status set_levels(const tli_model *m, tl_build_result *r)
{
    tl_status st = TL_OK;
    r->levels = tl_mem_zalloc(m->ctx, m->level_count, sizeof *r->levels, &st);
    if (st) return st;
    r->level_count = m->level_count;
    r->levels[0].boundary_error = fmax(m->finest_surface, m->leaf_surface);
    for (size_t p = 0; p < m->patch_count; p++) {
        tl_build_level *level = &r->levels[m->patches[p].level];
        level->patches++;
        level->tets += m->patches[p].tet_count;
        level->vertices += m->patches[p].vert_count;
        r->tets_stored += m->patches[p].tet_count;
    }
    for (size_t s = 0; s < m->segment_count; s++) {
        r->levels[m->segments[s].level].segments++;
        tl_build_level *above = &r->levels[m->segments[s].level + 1];
        above->boundary_error = fmax(above->boundary_error, m->segments[s].errors.surface);
    }
    r->patches = m->patch_count;
    r->segments = m->segment_count;
    return TL_OK;
}

static tli_input describe(const tl_segments *segments, const tli_survey *survey, double diagonal)
{
    tli_input input = {.time = tl_segments_time(segments),
                       .tets = tl_segments_tet_count(segments),
                       .verts = tl_segments_vert_count(segments)};
    const size_t unknown = SIZE_MAX;
    const double nan = (double)NAN;
    input.stats = (tl_mesh_stats){.diagonal = diagonal,
                                  .volume = survey->volume,
                                  .inverted = survey->inverted,
                                  .degenerate = survey->degenerate,
                                  .nonfinite_verts = unknown,
                                  .unused_verts = unknown,
                                  .duplicate_verts = unknown,
                                  .boundary_triangles = unknown,
                                  .boundary_area = nan,
                                  .interface_triangles = unknown,
                                  .components = unknown,
                                  .nonmanifold_faces = unknown,
                                  .nonmanifold_edges = unknown,
                                  .nonmanifold_verts = unknown,
                                  .quality_min = nan,
                                  .quality_median = nan,
                                  .dihedral_min = nan,
                                  .dihedral_max = nan};
    memcpy(input.stats.bounds, survey->bounds, sizeof input.stats.bounds);
    return input;
}

/* The finest level, made or as it was noted. */
static tl_status begin(tli_model *model, tli_plan *plan, const tl_segments *segments,
                       const tli_survey *survey)
{
    tli_work *work = model->work;
    if (work->stage >= TLI_STAGE_FINEST) return tli_work_load_model(work, plan, model);
    tl_status st = tli_model_begin(model, plan, segments);
    model->level_count = 1;
    return st ? st : tli_work_save(work, TLI_STAGE_FINEST, survey, model);
}

/* The level that the build was to end after. */
static tl_status view_last(const tli_model *model)
{
    uint32_t level = model->work->stop - TLI_STAGE_FINEST;
    return tli_view_level(model, level < model->level_count ? level : model->level_count - 1);
}

/* Ends the segments as soon as the finest level has been made of them. */
static tl_status build(tl_ctx *ctx, tl_segments **segments, tli_work *work, const char *path,
                       const tl_build_opts *opts, tl_build_result *r)
{
    bool ended = false;
    tli_plan plan;
    tli_survey survey;
    tli_model *model = NULL;
    if (tl_segments_tet_count(*segments) == 0)
        return tl_fail(ctx, TL_ERR_DATA, "the data set has no tets");
    tl_status st = work->stage >= TLI_STAGE_FINEST
                       ? tli_work_load_survey(work, tl_segments_channel_count(*segments), &survey)
                       : tli_survey_make(ctx, *segments, &survey);
    if (!st) st = tli_plan_create(ctx, *segments, &survey, opts, &plan);
    if (st) goto done;
    tli_input input = describe(*segments, &survey, plan.diagonal);
    for (size_t f = 0; f < plan.field_count; f++)
        if (plan.fields[f].has_step) input.time = (double)NAN; /* that of each channel counts */
    st = tli_model_create(ctx, &plan, work, &model);
    if (!st) st = begin(model, &plan, *segments, &survey);
    tl_segments_destroy(*segments);
    *segments = NULL;
    if (!st) st = tli_model_grow(model, &survey, &ended);
    if (!st && ended) st = view_last(model);
    if (!st) tli_model_saturate(model);
    if (!st && opts->prune && !ended) st = tli_model_prune(model, &plan);
    if (!st) st = set_levels(model, r);
    if (!st && !ended) st = tli_model_write(model, path, &input, &r->bytes);
    r->tets_in = input.tets;
    tli_model_destroy(model);
    tli_plan_release(&plan);
done:
    tli_survey_release(ctx, &survey);
    return st;
}

tl_status tli_build_opts_take(tl_ctx *ctx, const tl_build_opts *given, tl_build_opts *opts,
                              tl_segment_opts *segment)
{
    *opts = tl_build_opts_defaults();
    tl_status st = tli_opts_take(ctx, "tl_build_opts", given, opts, sizeof *opts);
    if (!st) st = tli_build_opts_check(ctx, opts);
    *segment = tl_segment_opts_defaults();
    if (!opts->folder) opts->folder = opts->resume ? opts->resume : opts->keep;
    segment->folder = opts->folder;
    segment->adjacency = true;
    if (opts->memory_bytes) segment->memory_bytes = opts->memory_bytes / SEGMENT_PART;
    if (segment->memory_bytes < TL_SEGMENT_MEMORY_MIN)
        segment->memory_bytes = TL_SEGMENT_MEMORY_MIN;
    /* patches are cut out of these */
    if (opts->segment_tets && opts->segment_tets < segment->segment_tets)
        segment->segment_tets = opts->segment_tets < 64 ? 64 : opts->segment_tets;
    return st;
}

/* The input in segments, made or as they were kept. */
static tl_status open_segments(tl_ctx *ctx, const tli_source *from, const tl_segment_opts *opts,
                               tli_work *work, tl_segments **segments)
{
    tl_status st = TL_OK;
    char *path = tli_work_path(work, "segments.work", &st);
    if (st) return st;
    if (work->stage >= TLI_STAGE_SEGMENT)
        st = tl_segments_open(ctx, path, segments);
    else if (from->mesh)
        st = tl_segments_build_mesh(ctx, from->mesh, opts, path, segments);
    else if (from->step_count)
        st = tl_segments_build_series(ctx, from->steps, from->step_count, from->read, opts, path,
                                      segments, NULL);
    else
        st = tl_segments_build(ctx, from->input, from->read, opts, path, segments, NULL);
    tl_mem_free(ctx, path);
    if (!st && work->stage < TLI_STAGE_SEGMENT)
        st = tli_work_save(work, TLI_STAGE_SEGMENT, NULL, NULL);
    return st;
}

/* The message of a build that lacks memory says how much would do. Where the limit is too small
 * even to look at the input, that takes the least that any build needs. */
static tl_status note_memory(tl_ctx *ctx, tl_status st, const tli_source *from,
                             const tl_build_opts *opts, tli_need need)
{
    enum { LOOK_BYTES = 1 << 20 };
    tli_feed *feed = NULL;
    tl_ctx *spare = NULL;
    const char *input = from->step_count ? from->steps->path : from->input;
    const uint64_t room = tli_need_least(&need);
    if (!need.tets && input && !tli_ctx_spare(ctx, (size_t)room, &spare) &&
        !tli_feed_open(spare, input, from->read, opts->folder, LOOK_BYTES, &feed))
        need = tli_plan_need_of_feed(opts, feed);
    tli_feed_close(feed);
    tl_ctx_destroy(spare);
    if (!need.tets) return st;
    return tl_note(ctx, st, "a limit of %lluM would do",
                   (unsigned long long)(tli_need_least(&need) >> 20));
}

/* The same of the disk. Of what the system says of a full one, nothing tells how much is missing.
 */
static tl_status note_disk(tl_ctx *ctx, tl_status st, const tl_build_opts *opts, tli_need need)
{
    struct statvfs disk;
    struct rlimit file;
    const char *folder = opts->folder ? opts->folder : "/tmp";
    uint64_t bytes = tli_need_disk(&need), room = UINT64_MAX;
    if (!need.tets) return st;
    if (!statvfs(folder, &disk)) room = (uint64_t)disk.f_bavail * disk.f_frsize;
    if (!getrlimit(RLIMIT_FSIZE, &file) && file.rlim_cur < room) room = file.rlim_cur;
    if (room >= bytes) return st;
    return tl_note(ctx, st, "the work takes about %llu bytes in '%s', where %llu can be written",
                   (unsigned long long)bytes, folder, (unsigned long long)room);
}

static tl_status build_any(tl_ctx *ctx, const tli_source *from, const char *path,
                           const tl_build_opts *given, tl_build_result *result)
{
    tl_build_opts opts;
    tl_segment_opts segment;
    tl_segments *segments = NULL;
    tli_work work = {0};
    tli_need need = {0};
    tl_build_result r = {0};
    double start = tli_clock_s();
    *result = r;
    tl_ctx_reset_peak(ctx);
    tl_status st = tli_build_opts_take(ctx, given, &opts, &segment);
    if (!st && from->mesh && tl_mesh_tet_count(from->mesh) == 0)
        st = tl_fail(ctx, TL_ERR_DATA, "the mesh has no tets");
    if (!st) st = tli_work_open(ctx, from, &opts, &work);
    if (!st) st = open_segments(ctx, from, &segment, &work, &segments);
    if (!st) need = tli_plan_need(&opts, segments);
    r.tets_in = need.tets;
    if (!st && !tli_work_ends(&work, TLI_STAGE_SEGMENT))
        st = build(ctx, &segments, &work, path, &opts, &r);
    else if (!st)
        st = tli_view_segments(&work, segments);
    tl_segments_destroy(segments);
    tli_work_close(&work);
    if (st == TL_ERR_BUDGET) st = note_memory(ctx, st, from, &opts, need);
    if (st == TL_ERR_IO) st = note_disk(ctx, st, &opts, need);
    r.seconds = tli_clock_s() - start;
    r.peak_bytes = tl_ctx_peak_bytes(ctx);
    if (st) {
        tl_build_release(ctx, &r);
        return tl_note(ctx, st, "while building '%s'", path ? path : "a model");
    }
    *result = r;
    return TL_OK;
}

tl_status tl_model_build_mesh(tl_ctx *ctx, const tl_mesh *mesh, const char *path,
                              const tl_build_opts *opts, tl_build_result *result)
{
    return build_any(ctx, &(tli_source){.mesh = mesh}, path, opts, result);
}

tl_status tl_model_build(tl_ctx *ctx, const char *input, const tl_read_opts *read, const char *path,
                         const tl_build_opts *opts, tl_build_result *result)
{
    return build_any(ctx, &(tli_source){.input = input, .read = read}, path, opts, result);
}

tl_status tl_model_build_series(tl_ctx *ctx, const tl_step *steps, size_t step_count,
                                const tl_read_opts *read, const char *path,
                                const tl_build_opts *opts, tl_build_result *result)
{
    tli_source from = {.steps = steps, .step_count = step_count, .read = read};
    return build_any(ctx, &from, path, opts, result);
}

void tl_build_release(tl_ctx *ctx, tl_build_result *result)
{
    if (!result) return;
    tl_mem_free(ctx, result->levels);
    *result = (tl_build_result){0};
}
