/* What the tools in the view share: handles, probe, rulers, the time slider. */
#ifndef TETRALOD_VIEWER_TOOLS_H
#define TETRALOD_VIEWER_TOOLS_H

#include "viewer.h"

/* What the pointer is for, beside moving the camera. */
typedef enum viewer_mode {
    VIEWER_MODE_NONE = 0,
    VIEWER_MODE_PROBE, /* says what is under it */
    VIEWER_MODE_RULER  /* measures from click to click */
} viewer_mode;

/* What is under a pixel was found: probe, not inside and at no place where there is nothing. */
typedef void (*viewer_answer)(viewer *v, const tl_probe *probe);

struct viewer_tools {
    viewer_mode mode;
    viewer_answer answer;           /* awaited */
    struct viewer_grips *grips;     /* viewer_grips.c */
    struct viewer_inquiry *inquiry; /* viewer_inquiry.c */
    struct viewer_rulers *rulers;   /* viewer_rulers.c */
    struct viewer_times *times;     /* viewer_times.c */
};

/* ---- viewer_tools.c ---- */

void viewer_tools_set_mode(viewer *v, viewer_mode mode);
/* Asks the live view what is under a pixel of the widget; a former question is dropped. */
void viewer_tools_ask(viewer *v, double x, double y, viewer_answer answer);
/* A question is under way. */
bool viewer_tools_asks(const viewer *v);
/* Two or four numbers. */
bool viewer_tools_numbers(const char *text, double *numbers, int count);

/* ---- painting over the picture: viewer_overlay.c ---- */

/* A line with a rim, so that it is seen on anything. */
void viewer_overlay_line(cairo_t *cr, const double x[2], const double y[2], const double rgb[3],
                         double width);
void viewer_overlay_dot(cairo_t *cr, double x, double y, double radius, const double rgb[3],
                        bool is_full);
/* Text in Pango's markup on a card, to the right of a place and below (or above) it, where that is
 * in the picture; \t begins a column. */
void viewer_overlay_card(viewer *v, cairo_t *cr, const char *markup, const double at[2], bool above,
                         double width, double height, bool dark);
extern const double VIEWER_OVERLAY_ACCENT[3], VIEWER_OVERLAY_SECOND[3];

/* ---- the parts ---- */

void viewer_grips_attach(viewer *v);
void viewer_grips_destroy(viewer *v);
/* Prints where the handles are. */
void viewer_grips_print(viewer *v);
void viewer_inquiry_attach(viewer *v);
void viewer_inquiry_destroy(viewer *v);
/* Takes the card away. */
void viewer_inquiry_forget(viewer *v);
/* Prints what the card says, and the rulers. */
void viewer_inquiry_print(const viewer *v);
void viewer_rulers_print(const viewer *v);
void viewer_rulers_attach(viewer *v);
void viewer_rulers_destroy(viewer *v);
void viewer_rulers_forget(viewer *v);
void viewer_times_attach(viewer *v);
void viewer_times_destroy(viewer *v);
/* The data that are open have several steps. */
bool viewer_times_has_steps(const viewer *v);
/* Buttons of the modes in the title bar. viewer_toolbar.c */
void viewer_toolbar_attach(viewer *v);

#endif
