/* Editors of properties: one row each, made from the row of the scene's table. They show what the
 * scene says, and say at the row what a scene refuses. */
#ifndef TETRALOD_VIEWER_FIELD_H
#define TETRALOD_VIEWER_FIELD_H

#include "viewer.h"
#include "viewer_curve.h"
#include "viewer_widgets.h"

/* How a property is put before people. */
typedef struct viewer_field_style {
    const char *prop;
    const char *label; /* NULL: the property's name in words */
    double low, high;  /* ends of the slider; equal: those of the table, if it is finite */
    const char *empty; /* what no value means, or 0 of a number (of an opacity -1): "automatic" */
} viewer_field_style;

typedef struct viewer_field viewer_field;
struct viewer_field {
    viewer *v;
    tl_node node;
    const tl_prop_info *info;
    viewer_field_style style;
    GtkWidget *box;    /* all of it */
    GtkWidget *reset;  /* back to the preset */
    GtkWidget *error;  /* what the scene said */
    GtkWidget *main;   /* what has the value: an entry, a switch, a list to choose from */
    GtkWidget *slider; /* NULL: none */
    GPtrArray *names;  /* of channels that can be chosen */
    bool is_filling;   /* widgets change because the scene has */
    void (*fill)(viewer_field *field);
};

/* A row for a property of a node, with its value. It lives as long as the widget. */
GtkWidget *viewer_field_create(viewer *v, tl_node node, const char *prop);
/* Shows what the scene says now. The node is still there. */
void viewer_field_refresh(GtkWidget *field);
/* Those of all fields that are children of a box. */
void viewer_fields_refresh(GtkWidget *box);

/* ---- for the files that make them ---- */

/* Sets the property as text, or by reals; true if the scene took it. */
bool viewer_field_set_text(viewer_field *field, const char *text);
bool viewer_field_set_reals(viewer_field *field, const double *reals, size_t count);
/* Parts of rows: they add their widgets to row and set main, slider, fill. */
void viewer_field_add_number(viewer_field *field, GtkWidget *row);
void viewer_field_add_channel(viewer_field *field, GtkWidget *row);
void viewer_field_add_place(viewer_field *field, GtkWidget *row);
void viewer_field_add_plane(viewer_field *field, GtkWidget *row);
/* The ends of a slider for a value of the node's channel, or in mesh units; false: not known. */
bool viewer_field_range(const viewer_field *field, double range[2]);

#endif
