/* The panel of the level of detail: what is asked for, and what is on the screen. */
#ifndef TETRALOD_VIEWER_DETAIL_H
#define TETRALOD_VIEWER_DETAIL_H

#include "viewer.h"

typedef struct viewer_detail viewer_detail;
/* Makes the panel, which it lives as long as. */
viewer_detail *viewer_detail_create(viewer *v);
GtkWidget *viewer_detail_widget(viewer_detail *detail);
/* Shows what the scene says. */
void viewer_detail_refresh(viewer_detail *detail);

#endif
