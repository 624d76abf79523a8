/* What the picture on the screen promises and costs, as words: one place for the line below the
 * view and for the panel of the level of detail. */
#ifndef TETRALOD_VIEWER_FIGURES_H
#define TETRALOD_VIEWER_FIGURES_H

#include "viewer.h"

typedef enum viewer_figure {
    VIEWER_FIGURE_STATE = 0, /* "at rest", "refining", "moving" */
    VIEWER_FIGURE_ERROR,     /* "error ≤ 0.14 px" */
    VIEWER_FIGURE_TETS,      /* "215 k of 10.2 M tets" */
    VIEWER_FIGURE_PATCHES,
    VIEWER_FIGURE_FRAME,
    VIEWER_FIGURE_MEMORY,
    VIEWER_FIGURE_READ,
    VIEWER_FIGURE_CHANNELS, /* "Density ± 0.001", of each channel shown */
    VIEWER_FIGURE_NOTE,     /* why it is not as asked for */
    VIEWER_FIGURE_COUNT
} viewer_figure;

void viewer_figures_attach(viewer *v);
void viewer_figures_destroy(viewer *v);
/* Words of a figure; "" while it is not known. Borrowed until VIEWER_FIGURES is heard again. */
const char *viewer_figure_text(const viewer *v, viewer_figure figure);
/* They belong to what was asked for before, or to a picture that is still being refined. */
bool viewer_figures_are_passing(const viewer *v);
/* Shows figures [count] that are known in a label, one behind the other, dim while they pass; what
 * they mean is its tip. */
void viewer_figures_show(const viewer *v, const viewer_figure *figures, size_t count,
                         GtkWidget *label);

#endif
