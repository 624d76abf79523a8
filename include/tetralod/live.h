/* tetralod, stage live: a view that goes on while a shell does. No toolkit.
 *
 * Threads of its own open files, make contents (coarse ones first, finer ones while the camera
 * rests), and draw the newest content with the newest camera into pictures of 8 bits that a window
 * shows as they are. No call here waits for a file, a content or a picture, but those that say so:
 * requests are copied, answers come as frames and events, and the hook tells that there are some.
 * While nothing changes no thread runs.
 *
 * What goes wrong does not end the view: it goes on with what it has, and an event says what
 * happened. Calls belong to one thread, the shell's. */
#ifndef TETRALOD_LIVE_H
#define TETRALOD_LIVE_H

#include "tetralod/model.h"
#include "tetralod/view.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct tl_live tl_live;

/* There is a new frame or event. On any thread, outside of locks; it must return at once and call
 * nothing here: it typically wakes the shell's loop. */
typedef void (*tl_live_notify_fn)(void *user);

typedef struct tl_live_opts {
    size_t struct_bytes;
    unsigned thread_count;     /* of building and of drawing, each; default 0: one a processor */
    tl_renderer_kind renderer; /* default TL_RENDERER_AUTO: what the scene says. Else this one,
                                  whatever the scene says */
    uint64_t ram_bytes;        /* where the scene says 0; default 0: half of the machine's memory */
    bool is_bgra; /* default false; true: frames have blue first, as windows take them */
    uint64_t throttle_bytes_s; /* models are read no faster than this, for tests; default 0 */
    tl_live_notify_fn notify;  /* default NULL */
    void *user;                /* handed to notify */
} tl_live_opts;
TL_API tl_live_opts tl_live_opts_defaults(void);

/* Starts the threads. opts may be NULL; copied. Gives *live. TL_ERR_ARG, TL_ERR_MEMORY,
 * TL_ERR_THREAD. */
TL_API tl_status tl_live_create(const tl_live_opts *opts, tl_live **live);
/* Ends what is under way and waits for it: as long as a piece of work on a thread takes. Frames
 * that are held must have been released. NULL is allowed. */
TL_API void tl_live_destroy(tl_live *live);

/* ---- what is shown ---- */

/* Opens a file that the program reads in place of the one that is open: models at once, others with
 * progress. scene (copied) is shown then, but for what the data lack (tl_view_adapt), which a
 * TL_LIVE_NOTICE tells; NULL: a first look. Another open cancels one that is under way. Events:
 * TL_LIVE_PROGRESS, then TL_LIVE_OPENED or TL_LIVE_FAILED, after which the former file stays.
 * TL_ERR_MEMORY. */
TL_API tl_status tl_live_open(tl_live *live, const char *path, const tl_scene *scene);
/* What is open: NULL before the first TL_LIVE_OPENED. Borrowed until the next TL_LIVE_OPENED is
 * taken by tl_live_next_event; any thread may ask it. */
TL_API const tl_source *tl_live_source(tl_live *live);
/* A copy, of ctx, of the scene that is shown, which is that of a first look after tl_live_open
 * without one. Gives *scene. TL_ERR_ARG while there is none. */
TL_API tl_status tl_live_get_scene(tl_live *live, tl_ctx *ctx, tl_scene **scene);

/* Copies: what is shown from now on, and its camera. Ends the making of a content that it makes
 * useless. Of the file whose TL_LIVE_OPENED was taken last: nothing happens while another one waits
 * to be taken. TL_ERR_MEMORY; the old one stays then. */
TL_API tl_status tl_live_set_scene(tl_live *live, const tl_scene *scene);
/* Pixels of the pictures, 1 to 16,384 each; default 1280 x 800. Out of range: the nearest. */
TL_API void tl_live_set_size(tl_live *live, uint32_t width, uint32_t height);
/* While moving (a drag, a spin, a key that is held down): contents of few tets, or what is there
 * where it is drawn in time, and fewer pixels that are scaled up, so that a frame takes the scene's
 * frame_s at most. Else contents become finer in steps until they are all that the scene asks for:
 * a frame at rest is never coarser, by error_px, than one before it of the same camera and scene,
 * but where that had less than the error asked for, or memory ran out. Default false. */
TL_API void tl_live_set_moving(tl_live *live, bool moving);

/* ---- frames ---- */

/* A picture and what is known of it. Immutable while it is held. */
typedef struct tl_frame {
    uint64_t number;               /* counts from 1 */
    uint32_t width, height;        /* pixels; that of tl_live_set_size when it was begun */
    const uint8_t *rgba;           /* [height][width][4] sRGB times opacity, rows from the top;
                                      with opts.is_bgra blue, green, red, opacity */
    const float *depth;            /* [height][width] as that of tl_image */
    tl_camera camera;              /* its size_px is width, height */
    uint64_t scene_version;        /* tl_scene_version of the scene it was drawn with */
    const tl_content *content;     /* what is drawn; NULL: nothing yet. Any thread */
    const tl_content_facts *facts; /* of content; NULL: nothing yet */
    double error_px;    /* of a model: off by so many pixels of the final picture at most, from this
                           camera; infinite: not bounded, see tl_content_error_px; else 0 */
    uint32_t reduction; /* a pixel of the drawing is so many wide and high here */
    uint32_t samples;   /* or has so many in x and y */
    bool is_complete;   /* all that the scene asks for, or that memory has room for */
    bool is_final;      /* with all of its rays, too: nothing is under way */
    bool is_moving;
    double draw_s;        /* seconds it took: drawing, scaling, words, 8 bits */
    const char *renderer; /* as tl_renderer_name */
    const char *note;     /* why it is coarser than the scene asks for, or not drawn as it asks;
                             "" where it is as asked */
} tl_frame;

/* The newest frame that was not given yet; NULL: none. Held until it is released; up to four may be
 * held, and with four held there are no new ones. */
TL_API const tl_frame *tl_live_frame(tl_live *live);
/* On any thread, once for each frame given. NULL is allowed. */
TL_API void tl_live_release(tl_live *live, const tl_frame *frame);
/* Nothing is under way: the newest frame shows all that the scene asks for, or what went wrong was
 * said. Lines that move keep a scene from settling. */
TL_API bool tl_live_settled(tl_live *live);
/* Waits until the view has settled, a newer frame than number is there or there is an event, for
 * shells without a loop; false: the seconds have passed. */
TL_API bool tl_live_wait(tl_live *live, uint64_t number, double seconds);

/* ---- events ---- */

typedef enum tl_live_job {
    TL_LIVE_OPEN = 0,    /* tl_live_open */
    TL_LIVE_CONTENT = 1, /* making contents */
    TL_LIVE_DRAWING = 2,
    TL_LIVE_MODEL = 3,     /* tl_live_build_model */
    TL_LIVE_PROBE = 4,     /* what lies under a pixel */
    TL_LIVE_HISTOGRAM = 5, /* tl_live_histogram */
    TL_LIVE_JOB_COUNT
} tl_live_job;

typedef enum tl_live_event_kind {
    TL_LIVE_PROGRESS = 1, /* of job: stage, done, total */
    TL_LIVE_OPENED = 2,   /* the file is open: tl_live_source, tl_live_get_scene */
    TL_LIVE_DONE = 3,   /* of a model: text is its path; of a probe, a histogram: it can be taken */
    TL_LIVE_FAILED = 4, /* of job: status, text; TL_ERR_CANCELLED where it was asked to end */
    TL_LIVE_NOTICE = 5  /* text: something goes another way: OpenGL failed, the processor draws;
                           what is asked for does not fit in memory */
} tl_live_event_kind;

typedef struct tl_live_event {
    tl_live_event_kind kind;
    tl_live_job job;
    tl_status status;
    uint64_t done, total; /* in units of the stage */
    char stage[40];
    char text[1000]; /* lines as of tl_ctx_message */
} tl_live_event;

/* The oldest event, which is taken; false: none. Of progress the newest of each job is kept, of the
 * others the last 64, those of TL_LIVE_OPENED before all. */
TL_API bool tl_live_next_event(tl_live *live, tl_live_event *event);

/* ---- asking ---- */

/* Asks what lies under a pixel of the newest frame that was given (none yet: nothing happens); a
 * former question that is not answered yet, or its answer if it was not taken, is dropped. Event:
 * TL_LIVE_DONE or TL_LIVE_FAILED of TL_LIVE_PROBE. */
TL_API void tl_live_probe(tl_live *live, double x_px, double y_px);
/* The newest answer; NULL: none that is new. Borrowed until the next one is given. is_inside is
 * false also where nothing is under the pixel, xyz is NaN then. */
TL_API const tl_probe *tl_live_get_probe(tl_live *live);

#define TL_LIVE_BINS 256
/* How much of the volume has which values. */
typedef struct tl_live_counts {
    double range[2];
    double counts[TL_LIVE_BINS]; /* volumes of equal parts of range, or of its logarithm */
} tl_live_counts;
/* True: *counts is that of a channel (as scenes name it), of all of the data at the step and with
 * the channels of the scene that was given last (tl_source_histogram); false: it is being counted,
 * with TL_LIVE_DONE or TL_LIVE_FAILED of TL_LIVE_HISTOGRAM at the end; of several questions that
 * wait the newest is, so that the others are to be asked again then. The last 32 answers are kept
 * as long as the file is open; what failed is not counted again until the data or derive nodes of
 * the scene change. Names of 256 bytes and more, and before there is a scene: false, and nothing
 * happens. */
TL_API bool tl_live_histogram(tl_live *live, const char *channel, bool logarithmic,
                              tl_live_counts *counts);

/* ---- making a model ---- */

/* Builds a model on a thread of its own, as tl_model_build, or with all_steps as
 * tl_model_build_series where input has several (tl_series_find); read and opts are copied but for
 * what they borrow, which must outlive the job. Events of TL_LIVE_MODEL: progress, then
 * TL_LIVE_DONE or TL_LIVE_FAILED. TL_ERR_ARG while another one is being built; TL_ERR_MEMORY. */
TL_API tl_status tl_live_build_model(tl_live *live, const char *input, const tl_read_opts *read,
                                     bool all_steps, const char *path, const tl_build_opts *opts);
/* Asks TL_LIVE_OPEN or TL_LIVE_MODEL to end; an event says that it has. Other jobs: nothing. */
TL_API void tl_live_cancel(tl_live *live, tl_live_job job);

/* ---- figures ---- */

typedef struct tl_live_stats {
    uint64_t frames, moving_frames; /* since the last reset */
    double longest_frame_s;         /* of those while moving: from its begin to its end */
    double longest_wait_s; /* of those: from a change to the end of the frame that shows it */
    double frame_s;        /* while moving, smoothed */
    uint32_t reduction;    /* while moving, now */
    uint64_t moving_tets;  /* most tets while moving, now */
    uint64_t bytes_read;   /* of the open model */
    uint64_t ram_bytes, ram_peak_bytes, card_bytes; /* of all threads together */
    uint64_t ram_limit_bytes;
} tl_live_stats;
TL_API tl_live_stats tl_live_get_stats(tl_live *live);
/* Counts and longest times start anew, the peak at what is taken now. */
TL_API void tl_live_reset_stats(tl_live *live);

#ifdef __cplusplus
}
#endif
#endif
