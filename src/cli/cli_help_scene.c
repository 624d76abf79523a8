/* Prints the table of scenes: `tetralod help scene` and docs/SCENE.md. */
#include <ctype.h>
#include <float.h>
#include <stdio.h>

#include "tetralod/scene.h"

#include "cli_options.h"

static const char *const ABOUT =
    "# Scenes\n\n"
    "A scene says what is shown and how: nodes with properties. The viewer changes it, commands do "
    "so\n"
    "line by line, and one JSON file keeps it, of which batch jobs make the same picture.\n"
    "\n"
    "This page is the output of `tetralod help scene`; a test compares them.\n"
    "\n"
    "## Files\n"
    "\n"
    "    {\"tetralod_scene\": 1,\n"
    "     \"camera\": {\"position\": [1, -3, 2], \"focal_point\": [0, 0, 0]},\n"
    "     \"picture\": {\"background\": [1, 1, 1], \"title\": \"Blunt fin\"},\n"
    "     \"things\": [\n"
    "      {\"kind\": \"transfer\", \"channel\": \"density\", \"map\": \"inferno\"},\n"
    "      {\"kind\": \"surface\", \"name\": \"shock\", \"channel\": \"density\", \"value\": "
    "2.5},\n"
    "      {\"kind\": \"edges\"}]}\n"
    "\n"
    "Flags are true or false, colours and places lists of numbers (colours also texts), lists rows "
    "of\n"
    "numbers; what is automatic is null. What is left out has its preset, unknown keys are a "
    "warning,\n"
    "anything else that is wrong is an error that names its place. Of `data`, `camera`, `picture` "
    "and\n"
    "`detail` there is one each, all others are `things`, drawn in their order; a name that is "
    "left\n"
    "out is the kind with a number.\n";

static const char *const WORDS = "\nWords in double quotes keep spaces; `#` before a word begins a "
                                 "comment, unless the word is a\n"
                                 "colour, `#RRGGBB`. Flags are on or off, colours names, `#RRGGBB` "
                                 "or `R,G,B`, planes six numbers (a\n"
                                 "point and a normal) or x, -y=V, z=P%, rows of lists have commas "
                                 "inside and spaces between, as in\n"
                                 "`0,1 2.5,0`; `auto` is what is chosen for the data. Successive "
                                 "changes of one property are one\n"
                                 "step for undo.\n";

/* "0 to 1", "from 0" */
static void print_range(FILE *out, const tl_prop_info *prop)
{
    const bool has_least = prop->least > -DBL_MAX, has_most = prop->most < 1e15;
    if (has_least && has_most)
        fprintf(out, " from %g to %g", prop->least, prop->most);
    else if (has_least)
        fprintf(out, " from %g", prop->least);
}

static void print_values(FILE *out, const tl_prop_info *prop)
{
    switch (prop->type) {
    case TL_PROP_FLAG: fputs("flag", out); return;
    case TL_PROP_COUNT: fputs("whole number", out); break;
    case TL_PROP_REAL: fputs(prop->count == 2 ? "two numbers" : "number", out); break;
    case TL_PROP_CHOICE:
        for (size_t i = 0; prop->choices[i]; i++)
            fprintf(out, "%s%s", i ? ", " : "", prop->choices[i]);
        return;
    case TL_PROP_TEXT: fputs("text", out); return;
    case TL_PROP_CHANNEL: fputs("channel", out); return;
    case TL_PROP_COLOR: fputs("colour", out); return;
    case TL_PROP_POINT: fputs("three numbers", out); break;
    case TL_PROP_BOX: fputs("box: x0 y0 z0 x1 y1 z1", out); break;
    case TL_PROP_PLANE: fputs("plane: point and normal", out); break;
    case TL_PROP_LIST: fprintf(out, "rows of %u numbers", prop->count); return;
    }
    print_range(out, prop);
    if (*prop->unit) fprintf(out, ", %s", prop->unit);
}

static void print_preset(FILE *out, const tl_prop_info *prop)
{
    if (*prop->preset)
        fprintf(out, "`%s`", prop->preset);
    else if (prop->type != TL_PROP_TEXT && prop->type != TL_PROP_CHANNEL)
        fputs("`auto`", out);
}

void cli_help_scene(FILE *out)
{
    const char *help;
    fputs(ABOUT, out);
    fputs("\n## Commands\n\n| command | |\n| --- | --- |\n", out);
    for (size_t i = 0; tl_scene_command(i, &help); i++)
        fprintf(out, "| `%s` | %s |\n", tl_scene_command(i, NULL), help);
    fputs(WORDS, out);
    fputs("\n## Nodes\n", out);
    for (tl_node_kind kind = 0; kind < TL_NODE_KIND_COUNT; kind++) {
        size_t count;
        const tl_prop_info *props = tl_node_props(kind, &count);
        const char *about = tl_node_kind_help(kind);
        fprintf(out, "\n### %s\n\n%c%s.\n\n| property | values | preset | |\n",
                tl_node_kind_name(kind), toupper((unsigned char)*about), about + 1);
        fputs("| --- | --- | --- | --- |\n", out);
        for (size_t i = 0; i < count; i++) {
            fprintf(out, "| `%s` | ", props[i].name);
            print_values(out, &props[i]);
            fputs(" | ", out);
            print_preset(out, &props[i]);
            fprintf(out, " | %s |\n", props[i].help);
        }
    }
}
