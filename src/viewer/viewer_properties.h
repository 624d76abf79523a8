/* The properties of the selected node, out of the scene's table. */
#ifndef TETRALOD_VIEWER_PROPERTIES_H
#define TETRALOD_VIEWER_PROPERTIES_H

#include "viewer.h"

typedef struct viewer_properties viewer_properties;
/* Makes the panel, which it lives as long as. */
viewer_properties *viewer_properties_create(viewer *v);
GtkWidget *viewer_properties_widget(viewer_properties *properties);
/* Shows what the scene says of the selected node. */
void viewer_properties_refresh(viewer_properties *properties);

#endif
