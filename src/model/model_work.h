/* Stage model, internal: the work folder of a build that can be gone on with. It holds
 *
 *   segments.work            the input in segments
 *   meshes.work, carried0.work, carried1.work, seams0.work, seams1.work    the depots of the model
 *   state.work               what the build was asked, how far it got, the lists of the model
 *   segments.vtu, level_N.vtu    the stage it was to end after, for other programs
 *
 * state.work is replaced after each stage, once all it speaks of is on the disk; what a later stage
 * left behind in the others is not looked at. Numbers are as the processor has them. */
#ifndef TETRALOD_SRC_MODEL_WORK_H
#define TETRALOD_SRC_MODEL_WORK_H

#include "base/base_file.h"
#include "model/model.h"

/* How far a build got; a level N above the finest is TLI_STAGE_FINEST + N. */
enum { TLI_STAGE_NONE = 0, TLI_STAGE_SEGMENT = 1, TLI_STAGE_FINEST = 2 };

typedef struct tli_work {
    tl_ctx *ctx;
    char *folder;    /* NULL: nothing is kept */
    char *asked;     /* what the build was asked, a line each */
    uint32_t stage;  /* that was reached */
    tli_map state;   /* of the build that is gone on with */
    size_t state_at; /* where reading it goes on */
    uint32_t stop;   /* behind this stage; TL_NONE: at the end */
} tli_work;

/* What a model is made of: a mesh, or steps, or a file. */
typedef struct tli_source {
    const tl_mesh *mesh;
    const tl_step *steps; /* [step_count] */
    size_t step_count;
    const char *input;
    const tl_read_opts *read;
} tli_source;

/* Looks at the options keep, resume and until. TL_ERR_ARG for options that don't fit together,
 * TL_ERR_DATA for a folder of another build or of a changed input. To be closed also after a
 * failure. */
tl_status tli_work_open(tl_ctx *ctx, const tli_source *from, const tl_build_opts *opts,
                        tli_work *work);
void tli_work_close(tli_work *work);

/* Path of a file in the folder. Gives it; NULL without a folder. */
char *tli_work_path(const tli_work *work, const char *name, tl_status *status);
/* A depot of the model: in the folder under that name, or without one. */
tl_status tli_work_depot(const tli_work *work, const tli_plan *plan, const char *name,
                         tli_depot **depot);

/* Notes that a stage was reached, if there is a folder. survey and model are NULL where they are
 * not made yet. */
tl_status tli_work_save(tli_work *work, uint32_t stage, const tli_survey *survey,
                        const tli_model *model);
/* What was noted, in this order. The model is as it was created. */
tl_status tli_work_load_survey(tli_work *work, size_t channel_count, tli_survey *survey);
tl_status tli_work_load_model(tli_work *work, tli_plan *plan, tli_model *model);

/* ---- model_view.c: what a stage made, for other programs ---- */
/* Writes segments.vtu, level_N.vtu into the folder. */
tl_status tli_view_segments(const tli_work *work, const tl_segments *segments);
tl_status tli_view_level(const tli_model *model, uint32_t level);

static inline bool tli_work_ends(const tli_work *work, uint32_t stage)
{
    return stage >= work->stop;
}

#endif
