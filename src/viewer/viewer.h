/* The viewer: a window around a scene (what is shown) and a live view (who draws it). What its
 * parts share. Everything here runs on the thread of the window; pictures are made by the threads
 * of tl_live, so that nothing here waits for one.
 *
 * A part (the panels, the tools in the view, the menus) keeps its state in a struct of its own,
 * which the struct viewer points to. It changes the scene by viewer_do or by calls of scene.h, each
 * change followed by viewer_changed; it hears of changes, by whomever they were made, through
 * viewer_listen, and shows what the scene says then. So undo, scripts and panels never disagree. */
#ifndef TETRALOD_VIEWER_H
#define TETRALOD_VIEWER_H

#include <gtk/gtk.h>

#include "tetralod/live.h"

typedef struct viewer viewer;

/* What the command line asks for. */
typedef struct viewer_words {
    char *file, *scene, *screenshot, *script; /* NULL: not given */
    int width, height;                        /* of the window; 0: as it was last */
    int thread_count;                         /* 0: one a processor */
    int64_t memory_bytes, throttle_bytes_s;   /* 0: as tl_live_opts */
    tl_renderer_kind renderer;
    gboolean stats;
} viewer_words;

/* ---- what parts hear of ---- */

typedef enum viewer_signal {
    VIEWER_SOURCE = 0, /* another file is open: source, path; the scene is another one, too */
    VIEWER_SCENE,      /* nodes or properties, those of the camera left out */
    VIEWER_CAMERA,     /* properties of the camera */
    VIEWER_FRAME,      /* another frame is shown */
    VIEWER_FIGURES,    /* words of viewer_figures.h are others */
    VIEWER_SELECTED,   /* another node is selected */
    VIEWER_LIVE,       /* an event of the live view, in v->event */
    VIEWER_END,        /* the window is about to go: parts free what is theirs */
    VIEWER_SIGNAL_COUNT
} viewer_signal;
typedef void (*viewer_listener)(viewer *v, void *user);
/* Calls listener(v, user) at each signal from now on, in the order of listening. */
void viewer_listen(viewer *v, viewer_signal signal, viewer_listener listener, void *user);

/* ---- the window ---- */

struct viewer {
    const viewer_words *words;
    tl_ctx *ctx;                /* of the window's thread */
    tl_scene *scene;            /* what is shown; never NULL. Another object after VIEWER_SOURCE */
    tl_live *live;              /* never NULL */
    const tl_source *source;    /* what is open; NULL: nothing */
    char *path;                 /* of it */
    const tl_frame *frame;      /* what is on the screen; NULL: nothing yet */
    const tl_live_event *event; /* while VIEWER_LIVE is heard */
    tl_node selected;           /* a node of the scene, 0: none */
    gint64 begun;               /* g_get_monotonic_time when the program began */
    int exit_status;            /* of the program */

    GtkApplication *app;
    GtkWindow *window;
    GtkWidget *picture; /* the view; has the keys */
    GtkWidget *side;    /* a vertical box, empty: the panels fill it */
    GtkWidget *below;   /* a vertical box under the view: the time slider */

    /* the parts' own, each of the file of its name */
    struct viewer_core *core;
    struct viewer_shell *shell; /* viewer_window.c */
    struct viewer_messages *messages;
    struct viewer_figures *figures;
    struct viewer_status *status;
    struct viewer_keys *keys;
    struct viewer_input *input;
    struct viewer_motion *motion;
    struct viewer_files *files;
    struct viewer_models *models;
    struct viewer_save *save;
    struct viewer_session *session;
    struct viewer_script *script;
    struct viewer_panels *panels;
    struct viewer_tools *tools;
};

/* ---- changing the scene ---- */

/* Does one command of tl_scene_do, in the manner of printf, and tells the parts. A failure goes
 * into the window's bar of messages; false then. */
bool viewer_do(viewer *v, const char *format, ...) G_GNUC_PRINTF(2, 3);
/* After calls of scene.h: sends the scene to the live view and tells the parts what has changed,
 * once the loop is idle again. */
void viewer_changed(viewer *v);
/* Says status in the bar of messages, with the context's message; true if it is TL_OK. */
bool viewer_ok(viewer *v, tl_status status);
/* Selects a node; 0: none. */
void viewer_select(viewer *v, tl_node node);
/* A gesture begins and ends (a slider is dragged, a key held): in between pictures are coarse and
 * fast; at its end the step of undo is sealed. Calls nest. */
void viewer_begin_gesture(viewer *v);
void viewer_end_gesture(viewer *v);

typedef enum viewer_tone { VIEWER_INFO = 0, VIEWER_WARNING, VIEWER_ERROR } viewer_tone;
/* Puts a message into the bar above the view; it stays until it is closed, infos for some seconds.
 */
void viewer_say(viewer *v, viewer_tone tone, const char *format, ...) G_GNUC_PRINTF(3, 4);
/* Takes an error away that is mended by now. */
void viewer_unsay(viewer *v);

/* The same with a button; fn(v) when it is pressed, refuse(v) (may be NULL) when it is closed. */
void viewer_offer(viewer *v, const char *button, void (*fn)(viewer *v), void (*refuse)(viewer *v),
                  const char *format, ...) G_GNUC_PRINTF(5, 6);

/* ---- places: pixels are those of the widget picture, from its upper left corner ---- */

/* Where a place is on the picture that is shown; false behind the camera, or without a picture. */
bool viewer_project(const viewer *v, const double xyz[3], double *x, double *y);
/* The opaque thing under a pixel; false: there is none. */
bool viewer_depth_at(const viewer *v, double x, double y, double xyz[3]);
/* The pixel of the frame that is shown, as the live view is asked of it; v->frame is not NULL. */
void viewer_frame_px(const viewer *v, double x, double y, double px[2]);

/* ---- tools: what is drawn over the picture and dragged in it ---- */

typedef struct viewer_pointer {
    double x, y;             /* pixels of the widget */
    double from_x, from_y;   /* where the button went down */
    unsigned button;         /* 1 left, 2 middle, 3 right */
    int presses;             /* 2: a double click */
    GdkModifierType pressed; /* modifiers */
} viewer_pointer;

/* Functions may be NULL. Tools added later are asked first, and drawn last. */
typedef struct viewer_tool {
    void *user;
    /* Is there something to take hold of? Name of a cursor ("grab", "crosshair"), NULL: no. */
    const char *(*over)(viewer *v, void *user, double x, double y);
    /* A button went down; true: the gesture is the tool's, up to release. */
    bool (*press)(viewer *v, void *user, const viewer_pointer *p);
    void (*drag)(viewer *v, void *user, const viewer_pointer *p);
    void (*release)(viewer *v, void *user, const viewer_pointer *p);
    /* Draws over the picture, width x height pixels; dark: the picture's background is. */
    void (*draw)(viewer *v, void *user, cairo_t *cr, double width, double height, bool dark);
    /* Is there something to draw now? NULL: never. */
    bool (*shown)(viewer *v, void *user);
    /* A button went down and up at one place, and no tool had taken it; true: it is done with. */
    bool (*click)(viewer *v, void *user, const viewer_pointer *p);
} viewer_tool;
void viewer_add_tool(viewer *v, const viewer_tool *tool);
/* Draws the tools anew. */
void viewer_redraw(viewer *v);

/* ---- actions: menu entries, keys, commands of scripts ---- */

/* Rows of a static table. A row without run says on the page of keys what a gesture does: keys is
 * its name. */
typedef struct viewer_action {
    const char *name;  /* "fit"; the action is "win.fit", and `key` of scripts knows it */
    const char *keys;  /* as of gtk_accelerator_parse, "f <Control>0"; "" none. Keys without a
                          modifier do not reach here while text is being edited */
    const char *group; /* its part of the page of keys: "View" ...; "": it is not there */
    const char *label; /* "Fit all into view" */
    void (*run)(viewer *v);
    bool (*is_on)(const viewer *v); /* of a switch, for its check mark; NULL: it is none */
} viewer_action;
void viewer_add_actions(viewer *v, const viewer_action *actions, size_t action_count);

/* A word that scripts may use beside the commands of scenes; rows of a static table. */
typedef struct viewer_command {
    const char *name, *usage; /* "probe", "probe X Y" */
    /* arguments: what follows the name, without blanks at its ends. False: failed, after
       viewer_say. */
    bool (*run)(viewer *v, const char *arguments);
} viewer_command;
void viewer_add_commands(viewer *v, const viewer_command *commands, size_t command_count);

/* ---- numbers as text, to be freed by g_free ---- */

char *viewer_count_text(double count); /* "1.25 M" */
char *viewer_bytes_text(double bytes); /* "312 MB" */

/* ---- the parts of others: each makes its struct and its widgets, once ---- */

void viewer_panels_attach(viewer *v); /* viewer_panels.c: fills v->side */
void viewer_tools_attach(viewer *v);  /* viewer_tools.c: viewer_add_tool, fills v->below */

#endif
