/* Values on a histogram: that of an isosurface, or the two ends of a threshold; dragged, or written
 * exactly beside it. */
#ifndef TETRALOD_VIEWER_LEVELS_H
#define TETRALOD_VIEWER_LEVELS_H

#include "viewer.h"

typedef struct viewer_levels viewer_levels;
/* Makes the panel, which it lives as long as. */
viewer_levels *viewer_levels_create(viewer *v);
GtkWidget *viewer_levels_widget(viewer_levels *levels);
/* Whether nodes of a kind have such values. */
bool viewer_levels_has(tl_node_kind kind);
/* Shows the values of a node; of another kind, or 0, nothing is seen. */
void viewer_levels_show(viewer_levels *levels, tl_node node);

#endif
