/* Widgets that several panels are made of. */
#ifndef TETRALOD_VIEWER_WIDGETS_H
#define TETRALOD_VIEWER_WIDGETS_H

#include "viewer.h"

/* A label on the left of a row, as wide as all of them. */
GtkWidget *viewer_row_label(const char *text);
/* A button of a symbolic icon, without a frame. */
GtkWidget *viewer_icon_button(const char *icon, const char *tooltip);
/* A list to choose from; long words are cut off. words [NULL-terminated] are copied. */
GtkWidget *viewer_drop_create(const char *const *words);
/* A title of bold words above what belongs together. */
GtkWidget *viewer_heading(const char *text);

/* Takes all children out of a box. */
void viewer_clear_box(GtkWidget *box);

/* Between press and release of a widget pictures are fast, and all is one step of undo. */
void viewer_watch_gesture(viewer *v, GtkWidget *widget);

/* An entry that is so many characters wide. commit(user) is called when its text is another one
 * than was put there, and Return is pressed or the keys go elsewhere; it says whether the text was
 * taken. Escape puts the former one back. */
typedef bool (*viewer_commit)(void *user);
GtkWidget *viewer_entry_create(int width_chars, viewer_commit commit, void *user);
/* Puts a text there, unless another one is being written. */
void viewer_entry_show(GtkWidget *entry, const char *text);
void viewer_entry_show_number(GtkWidget *entry, double value);
const char *viewer_entry_text(GtkWidget *entry);
/* The same without blanks around it, with points in its numbers where the user's language has
 * commas there ("0,5"): of each word with one comma alone, as more of them stand between numbers.
 * Gives it. */
char *viewer_entry_numbers(GtkWidget *entry);
/* The number that is written there; false: it is none. */
bool viewer_entry_number(GtkWidget *entry, double *value);

enum { VIEWER_NUMBER_BYTES = 32 };
/* A number to 6 digits. */
void viewer_number_text(double value, char text[VIEWER_NUMBER_BYTES]);

/* A line for what is wrong, which is not seen while all is well. */
GtkWidget *viewer_error_line(void);
/* Says at a widget, in a line below it, what is wrong; NULL: nothing. */
void viewer_mark_wrong(GtkWidget *widget, GtkWidget *line, const char *message);
/* Tells the parts of a change of the scene, or says at the widget why there was none; true: there
 * was one. */
bool viewer_settle(viewer *v, tl_status status, GtkWidget *widget, GtkWidget *line);

#endif
