/* The list of colour maps. */
#ifndef TETRALOD_VIEWER_MAPS_H
#define TETRALOD_VIEWER_MAPS_H

#include "viewer.h"

/* A list to choose a map from, in the order of the scene's table, and behind them a word for what
 * is none of them. */
GtkWidget *viewer_maps_create(const char *none);

#endif
