/* How exact the picture has to be: the control of the level of detail that is always in sight. */
#ifndef TETRALOD_VIEWER_BOUND_H
#define TETRALOD_VIEWER_BOUND_H

#include "viewer.h"

typedef struct viewer_bound viewer_bound;
/* Makes the control, which it lives as long as. */
viewer_bound *viewer_bound_create(viewer *v);
/* The row with slider and entry, and that of the switch which takes the bound away. */
GtkWidget *viewer_bound_widget(viewer_bound *bound);
GtkWidget *viewer_bound_switch(viewer_bound *bound);
/* Shows what the scene says. */
void viewer_bound_refresh(viewer_bound *bound);

#endif
