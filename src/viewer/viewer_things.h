/* The list of what is shown. */
#ifndef TETRALOD_VIEWER_THINGS_H
#define TETRALOD_VIEWER_THINGS_H

#include "viewer.h"

typedef struct viewer_things viewer_things;
/* Makes the list, which it lives as long as. */
viewer_things *viewer_things_create(viewer *v);
GtkWidget *viewer_things_widget(viewer_things *things);
/* Shows what the scene has, and what is selected. */
void viewer_things_refresh(viewer_things *things);

/* ---- what can be done with nodes (viewer_node.c) ---- */

/* "Isosurface". */
const char *viewer_node_title(tl_node_kind kind);
/* The first node of a kind; 0: there is none. */
tl_node viewer_node_of_kind(const viewer *v, tl_node_kind kind);
/* The channel of the data set with a name; NULL: there is none. */
const tl_source_channel *viewer_channel_named(const viewer *v, const char *name);
/* What a row says of a node beside its name: "temperature = 300"; to be freed. */
char *viewer_node_about(const viewer *v, tl_node node);
/* Whether it is one of the list's own, which come and go. */
bool viewer_node_is_thing(tl_node_kind kind);
/* The property that shows and hides it; NULL: it is always on. */
const char *viewer_node_switch(tl_node_kind kind);
/* The channel whose colours a node has; "": none. */
const char *viewer_node_channel(const viewer *v, tl_node node);
/* The channel that one looks at: of the selected node, or of the first that has one. */
const char *viewer_node_channel_shown(const viewer *v);
/* Adds a node that shows something at once, as one step, and selects it. false: it failed, which
 * was said. */
bool viewer_node_add(viewer *v, tl_node_kind kind);
/* Removes the selected node, and selects a neighbour; moves it up or down. */
void viewer_node_remove_selected(viewer *v);
void viewer_node_move_selected(viewer *v, int by);
/* Moves a node to where another one of the list stands, which makes room. */
void viewer_node_move(viewer *v, tl_node node, tl_node other);
void viewer_node_toggle_selected(viewer *v);

#endif
