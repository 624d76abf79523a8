/* The panel of colours: the transfer function of one channel. */
#ifndef TETRALOD_VIEWER_TRANSFER_H
#define TETRALOD_VIEWER_TRANSFER_H

#include "viewer.h"

typedef struct viewer_transfer viewer_transfer;
/* Makes the panel, which it lives as long as. */
viewer_transfer *viewer_transfer_create(viewer *v);
GtkWidget *viewer_transfer_widget(viewer_transfer *transfer);
/* Shows what the scene says of a channel; "": nothing is seen of the panel. */
void viewer_transfer_show(viewer_transfer *transfer, const char *channel);
/* What menus and keys ask for. */
void viewer_transfer_reset(viewer_transfer *transfer);
void viewer_transfer_import(viewer_transfer *transfer);
void viewer_transfer_export(viewer_transfer *transfer);
void viewer_transfer_reverse(viewer_transfer *transfer);
void viewer_transfer_toggle_counts(viewer_transfer *transfer);

#endif
