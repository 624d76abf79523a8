/* Stage live, internal: what the threads of a live view share, all of it under one lock.
 *
 * Four threads besides the shell's, each with a context of its own: the builder opens files and
 * makes contents, the drawer makes frames of them, the clerk answers questions, the maker builds
 * models. What several of them use is counted: scenes and frames go when the last one lets go,
 * contents and sources then wait in a list for the builder, who made them. */
#ifndef TETRALOD_SRC_LIVE_LIVE_H
#define TETRALOD_SRC_LIVE_LIVE_H

#include "base/base.h"
#include "base/base_lock.h"
#include "live/live_pace.h"
#include "tetralod/live.h"

enum {
    TLI_LIVE_EVENTS = 64,   /* kept; the oldest go */
    TLI_LIVE_GIVEN_MAX = 4, /* frames that a shell may hold */
    TLI_LIVE_FRAMES = 8,    /* those, the newest, the one in work, those of questions */
    TLI_LIVE_ANSWERS = 32,  /* histograms that are kept */
    TLI_LIVE_CHANNEL_BYTES = 256,
    TLI_LIVE_NOTE_BYTES = 200,
    TLI_LIVE_SIDE_MAX = 16384
};

/* ---- what is counted ---- */

/* A scene as the shell gave it; immutable, of the shell's context. */
typedef struct tli_live_scene {
    tl_scene *scene;
    uint64_t version;
    uint64_t stamp;        /* of all that contents depend on but the camera */
    uint64_t values_stamp; /* of all that histograms depend on */
    unsigned holds;
} tli_live_scene;

/* What makes contents of a file. What is made for movements has a cut of its own, so that the one
 * of a picture at rest stays where it is meanwhile. */
typedef enum tli_live_cut {
    TLI_LIVE_CUT_FINE = 0,
    TLI_LIVE_CUT_COARSE,
    TLI_LIVE_CUTS
} tli_live_cut;

/* An open file; of the builder's context. */
typedef struct tli_live_source {
    tl_source *source;
    tl_view *views[TLI_LIVE_CUTS];
    unsigned holds;
    struct tli_live_source *next; /* among former ones, or those that can go */
} tli_live_source;

/* Why a content was made. */
typedef enum tli_live_step {
    TLI_LIVE_NOTHING = 0,
    TLI_LIVE_FILE,   /* a file to open, no content */
    TLI_LIVE_FIRST,  /* of a new file: few tets, to see something at once */
    TLI_LIVE_QUICK,  /* a changed scene on the mesh that is there */
    TLI_LIVE_COARSE, /* to move */
    TLI_LIVE_FINE    /* at rest */
} tli_live_step;

/* A content; of the builder's context. */
typedef struct tli_live_content {
    tl_content *content;
    const tl_content_facts *facts;
    uint64_t stamp;   /* of its scene */
    tl_camera camera; /* it was made for */
    tli_live_step step;
    tli_live_cut cut;  /* that it was made of */
    uint64_t tets_max; /* it was allowed; UINT64_MAX: any */
    bool is_stepped;   /* what was to come before all that is asked for is no finer */
    tl_camera asked;   /* the last camera that its errors were asked for, and the answer */
    double asked_px;   /* < 0: none */
    double rest_s;     /* what a picture of all pixels takes, a ray a pixel; 0: ? */
    unsigned too_slow; /* frames in a row, while something moved, that passed the goal */
    unsigned holds;
    struct tli_live_content *next; /* among those that can go */
} tli_live_content;

/* A picture in work. */
typedef enum tli_live_drawing {
    TLI_LIVE_NO_DRAWING = 0,
    TLI_LIVE_DRAWS_MOVING,
    TLI_LIVE_DRAWS_REST,   /* nobody's as soon as something moves */
    TLI_LIVE_DRAWS_SAMPLES /* nobody's as soon as something changes */
} tli_live_drawing;

/* A frame's memory; of the drawer's context. */
typedef struct tli_live_slot {
    tl_frame frame; /* first: the shell gives its address back */
    uint8_t *rgba;
    float *depth;
    size_t pixel_max; /* both have room for */
    tli_live_content *content;
    unsigned holds, given; /* given: of the holds those of the shell */
    char note[TLI_LIVE_NOTE_BYTES];
    char renderer[TLI_LIVE_NOTE_BYTES];
} tli_live_slot;

/* ---- what is asked ---- */

typedef struct tli_live_question {
    char channel[TLI_LIVE_CHANNEL_BYTES];
    uint64_t values_stamp; /* of its scene */
    bool logarithmic;
} tli_live_question;

typedef struct tli_live_answer {
    tli_live_question question;
    tl_live_counts counts;
    tl_status status; /* a failure is kept, too, so that it is not asked again and again */
} tli_live_answer;

/* ---- the view ---- */

/* A thread with its context. */
typedef struct tli_live_worker {
    struct tl_live *live;
    tl_live_job job; /* what it is at; progress is told of it */
    tl_ctx *ctx;
    tli_thread thread;
    tli_bell bell;
    double told_s;    /* when progress was told last, and */
    double started_s; /* when the work began */
} tli_live_worker;

struct tl_live {
    tl_live_opts opts;
    tl_ctx *ctx; /* the shell's side: this block, scenes */
    tli_lock lock;
    tli_bell shell; /* for tl_live_wait */
    tli_live_worker builder, drawer, clerk, maker;
    int bell_count; /* of the workers' bells, those that are there; -1: not the shell's either */
    bool is_ending;
    bool tells; /* the hook is to be called when the lock is given */

    /* what the shell wants */
    tli_live_scene *scene; /* NULL: none yet */
    uint32_t width, height;
    bool moving;
    double changed_s;       /* when scene, size or moving changed last */
    char *open_path;        /* to open; of ctx */
    tli_live_scene *opened; /* to show then; NULL: a first look */
    uint64_t ram_limit;     /* as asked for by opts and scene */
    uint64_t card_limit;    /* UINT64_MAX: none */

    /* what there is; each holds */
    tli_live_source *source; /* NULL: none */
    tli_live_source *former; /* list of those that the shell may still look at; each held once */
    tli_live_content *coarse, *fine; /* the last ones of both cuts, or NULL */
    tli_live_source *old_sources;    /* to be destroyed by the builder */
    tli_live_content *old_contents;

    /* the builder's */
    tli_live_step running; /* what it is at */
    uint64_t running_stamp;
    double running_step; /* of the data, as the scene names it */
    tl_camera running_camera;
    double full_s;                 /* what the last content of all that was asked for took; 0: ? */
    double coarse_s, coarse_end_s; /* what the last coarse one took, and when it ended */
    bool made_room;                /* what is kept was given up for a content without memory */
    unsigned content_count;        /* that were made and not destroyed */
    uint64_t fits_tets;            /* most that memory has room for, as far as known */
    uint64_t card_tets;            /* the same of the card */
    bool has_failed;               /* a content of failed_stamp and failed_camera */
    uint64_t failed_stamp;
    tl_camera failed_camera;

    /* the drawer's */
    tli_pace pace;
    tli_live_slot slots[TLI_LIVE_FRAMES];
    tli_live_slot *newest; /* not given yet; holds */
    tli_live_slot *last;   /* given last; holds: where questions are asked */
    uint64_t frame_count;
    bool is_drawn;          /* what there is is on a frame; else the drawer has work */
    uint32_t drawn_samples; /* of that frame */
    double rays_max;        /* of a picture, that memory has room for, as far as known */
    bool has_said_rays;     /* that there are fewer than asked for */
    tli_live_drawing drawing;
    double rest_s;  /* what a picture of all pixels took last, a ray a pixel; 0: ? */
    double start_s; /* when lines began to move */

    /* the clerk's */
    double probe_px[2];
    tli_live_slot *probe_slot; /* holds */
    tl_probe answered, given;  /* of the clerk's context */
    bool has_answered, has_given;
    tli_live_content *answered_content, *given_content; /* hold: what the answers borrow from */
    bool has_question;
    tli_live_question question;
    tli_live_answer answers[TLI_LIVE_ANSWERS];
    size_t answer_count, next_answer;

    /* the maker's */
    char *make_input, *make_path; /* of ctx; NULL: nothing to make */
    tl_read_opts make_read;
    tl_build_opts make_opts;
    bool has_make_read, has_make_opts, make_all;

    /* events */
    tl_live_event events[TLI_LIVE_EVENTS];
    size_t event_first, event_count;
    tl_live_event progress[TL_LIVE_JOB_COUNT];
    bool has_progress[TL_LIVE_JOB_COUNT];
    char last_failure[TL_LIVE_JOB_COUNT][sizeof((tl_live_event *)0)->text];

    tl_live_stats stats; /* what is counted of it */
};

/* ---- the lock: everything below is called with it, but where it says so ---- */

/* Without it. Giving it calls the hook if there is something to tell. */
void tli_live_lock(tl_live *live);
void tli_live_unlock(tl_live *live);
/* There is something for the shell. */
void tli_live_tell(tl_live *live);
/* With the lock: waits for a bell, at most so many seconds (INFINITY: for ever), or calls the hook
 * first and comes back at once. What the caller knows is old then. */
void tli_live_sleep(tl_live *live, tli_bell *bell, double seconds);

/* NULL is allowed. The last one to drop a scene ends it; contents and sources go to the builder. */
void tli_live_drop_scene(tl_live *live, tli_live_scene *scene);
void tli_live_drop_source(tl_live *live, tli_live_source *source);
/* Those that the shell may have looked at before the one that is open. */
void tli_live_drop_former(tl_live *live);
void tli_live_drop_content(tl_live *live, tli_live_content *content);
void tli_live_drop_slot(tl_live *live, tli_live_slot *slot);
/* The time step that it asks for; -1: it says none. */
double tli_live_data_step(const tli_live_scene *scene);
/* Of the builder: destroys, without the lock, what nobody holds. */
void tli_live_clear_old(tl_live *live);
/* A copy in *copy, held once. */
tl_status tli_live_copy_scene(tl_live *live, const tl_scene *scene, tli_live_scene **copy);
/* Takes over a scene that is held: what is shown from now on. */
void tli_live_show_scene(tl_live *live, tli_live_scene *scene);

/* The camera of the scene for the pictures; false without a scene. */
bool tli_live_camera(const tl_live *live, tl_camera *camera);
bool tli_live_same_camera(const tl_camera *a, const tl_camera *b);
/* Pixels by which a content is off at most from a camera; infinite: not bounded. */
double tli_live_off_px(const tl_live *live, tli_live_content *content, const tl_camera *camera);
/* A content shows less than another one from the camera of the scene. */
bool tli_live_is_coarser(const tl_live *live, tli_live_content *content, tli_live_content *other);
/* The content to draw now; NULL: none. At rest the finest one for the camera, while something moves
 * the finest one that is drawn in time. */
tli_live_content *tli_live_best(const tl_live *live);
/* A content that is drawn in time while something moves. */
bool tli_live_is_light(const tl_live *live, const tli_live_content *content);
/* Most tets that memory and card have room for, as far as known. */
uint64_t tli_live_room(const tl_live *live);
/* It is all that the scene asks for, for this camera, or all that memory has room for. */
bool tli_live_is_final(const tl_live *live, const tli_live_content *content);
/* Something that the builder is at, or will be. */
bool tli_live_builds(const tl_live *live);
/* Ends what the builder or drawer is at if nobody waits for it any more, and wakes all that have
 * work. */
void tli_live_changed(tl_live *live);

/* Of job: text of a context's last failure. A failure that was told last time is not told again. */
void tli_live_failed(tl_live *live, tl_live_job job, tl_status status, const char *text);
void tli_live_event(tl_live *live, tl_live_event_kind kind, tl_live_job job, const char *text);
/* What was to be told of job, and nobody has asked for, is not told. */
void tli_live_forget(tl_live *live, tl_live_job job);
/* Another file is open and the shell does not know yet: scenes that it sets are of the former. */
bool tli_live_has_gone_over(tl_live *live);
/* Takes the lock itself: for contexts. */
bool tli_live_progress(void *worker, const char *stage, uint64_t done, uint64_t total);

/* ---- threads ---- */

void tli_live_build(void *worker);
void tli_live_draw(void *worker);
void tli_live_answer_all(void *worker);
void tli_live_make(void *worker);
/* When its thread has ended: frees what is of its context. */
void tli_live_build_end(tl_live *live);
void tli_live_draw_end(tl_live *live);
void tli_live_answer_end(tl_live *live);

/* What the builder has to do next. */
typedef struct tli_live_task {
    tli_live_step step;
    tli_live_cut cut; /* to be moved, or to be made of as it is */
    tl_camera camera;
    double error_px; /* at most so fine; 0: any */
    uint64_t tets_max;
} tli_live_task;
/* *wait_s: when nothing is to be done now but later, seconds till then; else infinity. */
tli_live_task tli_live_next(const tl_live *live, double now_s, double *wait_s);

/* ---- memory: live_room.c ---- */

/* What a thread may take of the limit, bytes. */
size_t tli_live_builder_room(const tl_live *live);
size_t tli_live_drawer_room(const tl_live *live);
static inline bool tli_live_lacks_memory(tl_status status)
{
    return status == TL_ERR_MEMORY || status == TL_ERR_BUDGET;
}
/* After the builder failed for lack of memory: what is tried next is smaller, or finds more room.
 * False: there is no less. May give the lock meanwhile. */
bool tli_live_shrink(tl_live *live, const tli_live_task *task);
/* After the drawer did with a content: fewer rays, then fewer tets, come next. False: no less. */
bool tli_live_shrink_drawn(tl_live *live, const tli_live_content *content, uint32_t samples,
                           uint32_t reduction);
/* Rays a pixel and part of the pixels that there is room for. */
void tli_live_fit_rays(const tl_live *live, uint32_t *samples, uint32_t *reduction);
/* Rays a pixel and side at rest, as far as there is room for them. */
uint32_t tli_live_samples(const tl_live *live, const tli_live_content *content);
/* Why a job of a context failed; for lack of memory: which limit will do. source may be NULL. */
void tli_live_why(const tl_live *live, const tl_ctx *ctx, const tl_source *source, tl_live_job job,
                  tl_status status, char *text, size_t bytes);

/* ---- pictures; without the lock, on the pool ---- */

/* Scales a picture up to the size of another one: colours linearly between middles of pixels,
 * depths of the nearest. Pixels are squares of the same size in x and y; the middles of both
 * pictures are at one place. */
tl_status tli_live_enlarge(tl_ctx *ctx, const tl_image *small, tl_image *large);
/* 8 bits of a picture in front of a background (sRGB; NULL: none), red or blue first. */
tl_status tli_live_bytes(tl_ctx *ctx, const tl_image *image, const double *background, bool is_bgra,
                         uint8_t *bytes);

#endif
