/* What the files of the shell share, beside viewer.h. */
#ifndef TETRALOD_VIEWER_CORE_H
#define TETRALOD_VIEWER_CORE_H

#include "viewer.h"

/* ---- viewer_core.c ---- */

/* Context, scene and live view; says on stderr why not. destroy also what is there after a failure,
 * when the window is gone. */
bool viewer_core_create(viewer *v);
void viewer_core_destroy(viewer *v);
/* Tells the parts VIEWER_END. What widgets do on their way out (a drag ends, an entry loses the
 * keys) is told to nobody then, and says nothing. */
void viewer_core_end(viewer *v);
bool viewer_core_is_ended(const viewer *v);
void viewer_tell(viewer *v, viewer_signal signal);
/* Does at once what viewer_changed does when the loop is idle. */
void viewer_flush(viewer *v);
/* Takes over another scene for the source that is open. */
void viewer_take_scene(viewer *v, tl_scene *scene);
/* Tells scene and live view the size of the picture. */
void viewer_frame_scene(viewer *v);
/* All that the scene asks for is on the screen, or what went wrong was said. */
bool viewer_settled(viewer *v);

/* ---- viewer_picture.c: the widget that shows frames ---- */

GtkWidget *viewer_picture_create(viewer *v);
/* Shows a frame's pixels, width x height; is_finer: of the same view as the last one, which it is
 * faded over. bytes NULL: nothing. */
void viewer_picture_show(GtkWidget *picture, GBytes *bytes, uint32_t width, uint32_t height,
                         bool is_finer);
/* False while one frame is faded over another. */
bool viewer_picture_is_still(const viewer *v);
/* Laying out and painting the window, all of its widgets, since the last reset. */
typedef struct viewer_paint_stats {
    uint64_t count;
    double cpu_s, longest_s; /* processor time of all, time of the longest one */
} viewer_paint_stats;
viewer_paint_stats viewer_picture_stats(const viewer *v);
void viewer_picture_reset_stats(viewer *v);
/* viewer_tool, from the lowest one on. */
const GArray *viewer_tools_all(const viewer *v);

/* ---- viewer_messages.c ---- */

/* To the window, whose life its own is; end: nothing comes any more. */
void viewer_messages_attach(viewer *v);
void viewer_messages_end(viewer *v);
/* What lies over the picture: messages above, below how far a job is. */
GtkWidget *viewer_messages_bar(viewer *v);
GtkWidget *viewer_messages_progress(viewer *v);
/* A job with its progress and a button that cancels it; text NULL: it has ended. part: 0 to 1,
 * below 0: not known. */
void viewer_window_progress(viewer *v, const char *text, double part, void (*cancel)(viewer *v));
/* The same of an event of progress: "text: stage". */
void viewer_window_job(viewer *v, const char *text, const tl_live_event *event,
                       void (*cancel)(viewer *v));

/* ---- viewer_window.c ---- */

void viewer_window_attach(viewer *v);
void viewer_window_destroy(viewer *v);
/* Title, and what is there instead of a picture. */
void viewer_window_retitle(viewer *v);
/* A picture of the window, to be released; NULL while it is not laid out. */
GdkTexture *viewer_window_texture(viewer *v);
bool viewer_window_is_dark(const viewer *v);

/* ---- viewer_menu.c: models of menus, to be released by g_object_unref ---- */

GMenuModel *viewer_menu_main(viewer *v);
GMenuModel *viewer_menu_views(void);

/* ---- viewer_status.c: the line below ---- */

GtkWidget *viewer_status_create(viewer *v);
void viewer_status_destroy(viewer *v);

/* ---- viewer_keys.c: actions and the page of keys ---- */

void viewer_keys_attach(viewer *v);
void viewer_keys_commands(viewer *v); /* once there are scripts */
void viewer_keys_destroy(viewer *v);
/* Runs the action of a key, "f" or "<Control>z", or of a name; false: there is none. */
bool viewer_keys_run(viewer *v, const char *key);
/* A window in front of the viewer's, without a child, that Escape closes. */
GtkWindow *viewer_dialog_window(viewer *v, const char *title);

/* ---- viewer_input.c: the pointer in the view ---- */

void viewer_input_attach(viewer *v);
void viewer_input_destroy(viewer *v);
/* What gestures do, for scripts: pixels of the widget. */
void viewer_input_press(viewer *v, viewer_pointer *p);
void viewer_input_drag(viewer *v, const viewer_pointer *p);
void viewer_input_release(viewer *v, const viewer_pointer *p);
void viewer_input_scroll(viewer *v, double x, double y, double steps);
bool viewer_input_is_dragging(const viewer *v);
/* One of several single steps, which are a gesture until they rest. */
void viewer_input_keep(viewer *v);

/* ---- viewer_motion.c: the camera ---- */

void viewer_motion_attach(viewer *v);
void viewer_motion_destroy(viewer *v);
/* The camera of the scene for the picture's size. */
tl_camera viewer_camera(const viewer *v);
void viewer_set_camera(viewer *v, const tl_camera *camera);
/* Moves it to another place so that the eye can follow; stop: it stays where it is then. */
void viewer_fly_to(viewer *v, const tl_camera *to);
void viewer_motion_stop(viewer *v);
/* How a drag turns. */
tl_orbit_style viewer_orbit_style(const viewer *v);

/* ---- viewer_files.c ---- */

/* Before the window. */
void viewer_files_create(viewer *v);
void viewer_files_attach(viewer *v);
void viewer_files_destroy(viewer *v);
/* Opens a data set, and shows it as the scene of a file says (NULL: a first look). Without a path
 * that of the scene. */
void viewer_open(viewer *v, const char *path, const char *scene_path);
/* v->source is what was asked for; before the parts hear of it. */
void viewer_opened(viewer *v);
/* The window's style is another one. */
void viewer_files_restyle(viewer *v);
/* Opens another form of what is open, and shows it as that is shown. has_steps: it has its steps.
 */
void viewer_open_as_shown(viewer *v, const char *path, bool has_steps);
/* Nothing is being opened or built; something is being opened. */
bool viewer_files_idle(const viewer *v);
bool viewer_files_opens(const viewer *v);
/* What is written does not take the place of the data that are looked at, under whatever name;
 * false: said. */
bool viewer_may_write(viewer *v, const char *path);
/* Borrowed: files that were open before. */
GMenu *viewer_files_recent_menu(viewer *v);
/* "name" of "dir/name.vtu" and of the folder "dir/name"; and a name for what is written: that of
 * the data, or another one while there are none. To be freed. */
char *viewer_stem(const char *path);
char *viewer_name_like(const viewer *v, const char *other, const char *ending);
/* A dialog for a file; name and folder (NULL: that of the data) are where it begins. */
GtkFileChooserNative *viewer_dialog(viewer *v, const char *title, const char *accept,
                                    GtkFileChooserAction action, const char *name,
                                    const char *folder);
/* The path that was chosen, to be freed; NULL: none. */
char *viewer_dialog_path(GtkNativeDialog *dialog);

/* ---- viewer_models.c: models that are built ---- */

/* Before the window. */
void viewer_models_create(viewer *v);
void viewer_models_attach(viewer *v);
void viewer_models_destroy(viewer *v);
/* No model is being built. */
bool viewer_models_idle(const viewer *v);
/* Asks how a large mesh is to be opened; false: it is none, and nothing was asked. */
bool viewer_models_ask(viewer *v, const char *path);
/* Says text, why a file can't be shown as it is, and offers to build a model of it. */
void viewer_models_offer(viewer *v, const char *path, const char *text);

/* ---- viewer_save.c: pictures of any size ---- */

void viewer_save_attach(viewer *v);
/* Ends a job that goes on; before the live view is destroyed. */
void viewer_save_end(viewer *v);
/* After that. */
void viewer_save_destroy(viewer *v);
/* No picture is being saved. */
bool viewer_save_idle(const viewer *v);

/* ---- viewer_session.c: what is remembered ---- */

void viewer_session_create(viewer *v);
void viewer_session_destroy(viewer *v);
/* Offers the scene of a window that crashed. */
void viewer_session_offer(viewer *v);
/* Paths of recent files, the last one first, to be freed by g_strfreev. */
char **viewer_session_recent(const viewer *v);
void viewer_session_add_recent(viewer *v, const char *path);
/* Size and style that the window had, where they are known. */
void viewer_session_window(const viewer *v, int *width, int *height, bool *dark);

/* ---- viewer_script.c ---- */

void viewer_script_attach(viewer *v);
/* Begins the script and the screenshot that the command line asks for; false, said on stderr: the
 * file can't be read. */
bool viewer_script_begin(viewer *v);
/* True: nothing went wrong. */
bool viewer_script_destroy(viewer *v);
/* A message is in the window's bar. */
void viewer_script_said(viewer *v, viewer_tone tone, const char *text);

/* ---- viewer_main.c ---- */

/* Takes "WIDTHxHEIGHT", each from 100 to 16,384. */
bool viewer_read_size(const char *text, int *width, int *height);

#endif
