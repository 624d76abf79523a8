/* The kinds of nodes and their properties: the one table behind JSON, commands, panels, help and
 * docs/SCENE.md. */
#include <float.h>
#include <string.h>

#include "scene/scene.h"

/* Whole numbers that a real holds exactly. */
#define COUNT_MOST 9007199254740992.0
#define ANY -DBL_MAX, DBL_MAX
#define POSITIVE 0, DBL_MAX

#define FLAG(name, preset, help)                                                                   \
    {                                                                                              \
        name, TL_PROP_FLAG, 1, 0, 1, false, NULL, "", preset, help                                 \
    }
#define TEXT(name, preset, help)                                                                   \
    {                                                                                              \
        name, TL_PROP_TEXT, 0, 0, 0, false, NULL, "", preset, help                                 \
    }
#define CHANNEL(name, help)                                                                        \
    {                                                                                              \
        name, TL_PROP_CHANNEL, 0, 0, 0, false, NULL, "", "", help                                  \
    }
#define CHOICE(name, choices, preset, help)                                                        \
    {                                                                                              \
        name, TL_PROP_CHOICE, 1, 0, 0, false, choices, "", preset, help                            \
    }
#define COLOR(name, preset, help)                                                                  \
    {                                                                                              \
        name, TL_PROP_COLOR, 3, 0, 1, false, NULL, "", preset, help                                \
    }
#define OPACITY(name, least, preset, help)                                                         \
    {                                                                                              \
        name, TL_PROP_REAL, 1, least, 1, false, NULL, "", preset, help                             \
    }
#define PIXELS(name, least, preset, help)                                                          \
    {                                                                                              \
        name, TL_PROP_REAL, 1, least, 100, false, NULL, "px", preset, help                         \
    }
#define PLANE(name, help)                                                                          \
    {                                                                                              \
        name, TL_PROP_PLANE, 6, ANY, false, NULL, "mesh units", "", help                           \
    }
#define BOX(name, help)                                                                            \
    {                                                                                              \
        name, TL_PROP_BOX, 6, ANY, false, NULL, "mesh units", "", help                             \
    }
#define VISIBLE FLAG("visible", "on", "whether it is drawn")
#define COLOR_BY CHANNEL("color_by", "the channel that colours it; empty: its own colour")

static const char *const RENDERERS[] = {"auto", "gl", "cpu", NULL};
static const char *const MAPS[] = {"viridis",      "inferno", "magma",         "plasma", "cividis",
                                   "cool-to-warm", "grey",    "blue-to-brown", "phase",  NULL};
static const char *const RANGES[] = {"most", "data", "percent", "values", NULL};
static const char *const SYMMETRY[] = {"auto", "on", "off", NULL};
static const char *const MARKS[] = {"none", "patches", "levels", NULL};
static const char *const METHODS[] = {"auto", "projected", "rays", NULL};
static const char *const SHAPES[] = {"tube", "flat", "ribbon", NULL};

static const tl_prop_info DATA[] = {
    TEXT("file", "",
         "the data set that the scene was made for; shells open it where none is given"),
    {"step", TL_PROP_COUNT, 1, -1, COUNT_MOST, false, NULL, "", "-1",
     "the time step, the first is 0; -1: the first"},
    TEXT("regions", "", "regions that are taken, numbers or names with commas between; empty: all"),
    TEXT("hide_regions", "", "regions that are left out"),
};
static const tl_prop_info CAMERA[] = {
    {"position", TL_PROP_POINT, 3, ANY, false, NULL, "mesh units", "",
     "where it stands; auto: where all of the data is seen from azimuth 30, elevation 20"},
    {"focal_point", TL_PROP_POINT, 3, ANY, false, NULL, "mesh units", "0 0 0", "what it looks at"},
    {"view_up", TL_PROP_POINT, 3, ANY, false, NULL, "", "0 0 1", "what is up on the picture"},
    {"view_angle", TL_PROP_REAL, 1, 0.001, 179, false, NULL, "degrees", "30",
     "from the lower to the upper edge of the picture"},
    FLAG("parallel", "off", "no perspective: equal lengths are equal wherever they are"),
    {"parallel_scale", TL_PROP_REAL, 1, POSITIVE, true, NULL, "mesh units", "0",
     "half the height of a parallel view; 0: that of the perspective at the focal point"},
};
static const tl_prop_info PICTURE[] = {
    COLOR("background", "white", "behind all things; none: transparent"),
    TEXT("title", "", "a line above"),
    FLAG("bar", "on", "scalar bars"),
    FLAG("axes", "on", "numbers along the edges of the box"),
    FLAG("box", "on", "the outline of what is seen"),
    FLAG("triad", "off", "the directions of x, y and z in a corner"),
    FLAG("note", "on", "a small line below that says the error of the picture"),
    {"samples", TL_PROP_COUNT, 1, 0, 8, false, NULL, "", "0",
     "N x N rays a pixel, for smooth edges; 0: 2, of volumes alone 1"},
    CHOICE("renderer", RENDERERS, "auto",
           "what draws: OpenGL where there is a GPU, or the processor, which is the reference"),
};
static const tl_prop_info DETAIL[] = {
    {"error_px", TL_PROP_REAL, 1, 0, 1000, true, NULL, "px", "1",
     "how far surfaces may be off on the picture; 0: no such bound"},
    {"error", TL_PROP_REAL, 1, POSITIVE, true, NULL, "channel", "0",
     "by how much the values of error_channel may be off; 0: no such bound"},
    CHANNEL("error_channel", "the channel of error; empty: every channel that is shown"),
    TEXT("errors", "",
         "bounds of several channels, E, E%, CHANNEL=E or CHANNEL=E% (of the range), with ; "
         "between"),
    {"space_error", TL_PROP_REAL, 1, POSITIVE, true, NULL, "mesh units", "0",
     "how far isosurfaces may be off; 0: no such bound"},
    {"boundary_error", TL_PROP_REAL, 1, POSITIVE, true, NULL, "mesh units", "0",
     "how far the boundary may be off; 0: no such bound"},
    {"tets", TL_PROP_COUNT, 1, 0, COUNT_MOST, true, NULL, "tets", "0",
     "at most so many at rest; 0: no limit"},
    FLAG("full", "off", "the finest mesh there is, whatever the bounds"),
    {"moving_tets", TL_PROP_COUNT, 1, 0, COUNT_MOST, true, NULL, "tets", "0",
     "at most so many while the view moves; 0: as frame_s allows"},
    {"frame_s", TL_PROP_REAL, 1, 0.001, 10, true, NULL, "s", "0.1",
     "time that a picture may take while the view moves"},
    {"ram_bytes", TL_PROP_COUNT, 1, 0, COUNT_MOST, true, NULL, "bytes", "0",
     "limit of main memory; 0: the program chooses"},
    {"card_bytes", TL_PROP_COUNT, 1, 0, COUNT_MOST, true, NULL, "bytes", "0",
     "limit of a graphics card's memory; 0: the program chooses"},
    FLAG("frozen", "off", "the cut stays as it is while the camera moves"),
    FLAG("focus", "off", "finer in focus_box"),
    BOX("focus_box", "where it is finer; auto: the middle half of the data"),
    {"focus_gain", TL_PROP_REAL, 1, 1, 1000, true, NULL, "", "4",
     "outside of focus_box errors may be so many times as large"},
};
static const tl_prop_info DERIVE[] = {
    TEXT("text", "", "a channel and its formula, as speed=mag(velocity)"),
};
static const tl_prop_info CLIP[] = {
    FLAG("on", "on", "whether it clips"),
    PLANE("plane", "what lies on the side of the normal is cut off; auto: half of the data, by x"),
};
static const tl_prop_info THRESHOLD[] = {
    FLAG("on", "on", "whether tets are left out"),
    CHANNEL("channel", "whose values decide; empty: nothing is left out"),
    {"low", TL_PROP_REAL, 1, ANY, false, NULL, "channel", "",
     "the least value that stays; auto: any"},
    {"high", TL_PROP_REAL, 1, ANY, false, NULL, "channel", "",
     "the largest value that stays; auto: any"},
};
static const tl_prop_info TRANSFER[] = {
    CHANNEL("channel", "whose colours and opacities these are"),
    CHOICE("map", MAPS, "viridis", "a colour map over the range"),
    FLAG("reversed", "off", "the map's other way around"),
    FLAG("logarithmic", "off", "colours by the logarithm; values not above 0 are not seen"),
    CHOICE(
        "range_by", RANGES, "most",
        "the map goes over most values (without rare extremes), all of the data, the values below "
        "which percent of the volume lies, or those of range"),
    {"range", TL_PROP_REAL, 2, ANY, false, NULL, "channel", "0 1",
     "values at the ends of the map, where range_by is values"},
    {"percent", TL_PROP_REAL, 2, 0, 100, false, NULL, "%", "2 98",
     "parts of the volume below the ends of the map, where range_by is percent"},
    CHOICE("symmetric", SYMMETRY, "auto",
           "as far to one side of center as to the other, unless range_by is values or the scale "
           "is logarithmic; auto: of a diverging map, where range_by is most or data and values "
           "lie on both sides"),
    {"center", TL_PROP_REAL, 1, ANY, false, NULL, "channel", "0",
     "the value in the middle of a symmetric range"},
    {"colors", TL_PROP_LIST, 4, 0, 1, false, NULL, "", "",
     "points of value, red, green, blue in place of the map; auto: the map"},
    {"opacities", TL_PROP_LIST, 2, 0, 1, false, NULL, "", "",
     "points of value, opacity; auto: from the histogram"},
    {"unit_distance", TL_PROP_REAL, 1, POSITIVE, true, NULL, "mesh units", "0",
     "thickness of the layer that has the opacities; 0: a fiftieth of the diagonal"},
    COLOR("nan_color", "", "of NaN on surfaces; auto: grey"),
};
static const tl_prop_info VOLUME[] = {
    VISIBLE,
    CHANNEL("channel", "what is seen as a cloud"),
    CHOICE("method", METHODS, "auto", "how OpenGL draws it: tet by tet, or by a ray a pixel"),
    FLAG("lit", "off", "light on it"),
    {"gradient_opacity", TL_PROP_REAL, 1, POSITIVE, true, NULL, "channel by mesh unit", "0",
     "full opacity from this length of the gradient on, less where it is smaller; 0: everywhere"},
    FLAG("gradient_percent", "off", "gradient_opacity is in percent of the largest gradient"),
};
static const tl_prop_info SURFACE[] = {
    VISIBLE,
    CHANNEL("channel", "whose isosurface it is"),
    {"value", TL_PROP_REAL, 1, ANY, false, NULL, "channel", "",
     "where the channel has it; auto: the middle of its range"},
    COLOR_BY,
    COLOR("color", "", "its colour; auto: that of the value in the transfer function"),
    OPACITY("opacity", 0, "1", "1 hides what is behind it"),
};
static const tl_prop_info SLICE[] = {
    VISIBLE,
    PLANE("plane", "where it is; auto: through the middle of the data, across x"),
    COLOR_BY,
    OPACITY("opacity", 0, "1", "1 hides what is behind it"),
};
static const tl_prop_info BOUNDARY[] = {
    VISIBLE,
    COLOR_BY,
    COLOR("color", "", "its colour; auto: grey"),
    OPACITY("opacity", -1, "-1", "-1: as glass around other things, else opaque"),
    FLAG("interfaces", "off", "in its place the surfaces between regions inside"),
    CHOICE("mark", MARKS, "none", "a model's patches, or levels of detail, in colours"),
};
static const tl_prop_info EDGES[] = {
    VISIBLE,
    PIXELS("width_px", 0.1, "1.1", "their width"),
    COLOR("color", "", "their colour; auto: dark"),
};
static const tl_prop_info SILHOUETTES[] = {
    VISIBLE,
    PIXELS("width_px", 0.1, "1.8", "their width"),
    COLOR("color", "", "their colour; auto: dark"),
};
static const tl_prop_info POINTS[] = {
    VISIBLE,
    CHANNEL("channel", "on whose isosurfaces they lie"),
    {"count", TL_PROP_COUNT, 1, 1, 1e8, true, NULL, "", "200000", "about so many"},
    {"shells", TL_PROP_COUNT, 1, 0, 256, false, NULL, "", "10",
     "isosurfaces, evenly over the range; 0: of all values"},
    PIXELS("radius_px", 0.1, "1.1", "their radius"),
    CHANNEL("color_by", "the channel that colours them; empty: their own"),
};
static const tl_prop_info LINES[] = {
    VISIBLE,
    CHANNEL("channel", "the vectors that they follow"),
    TEXT("seeds", "grid", "where they begin, as of tetralod lines --seeds"),
    CHOICE("shape", SHAPES, "tube", "how they are lit"),
    PIXELS("width_px", 0.1, "2", "their width"),
    PIXELS("halo_px", 0, "0", "a gap beside them, which sets them apart from what is behind"),
    {"dash", TL_PROP_REAL, 1, 0, 100, false, NULL, "%", "0",
     "length of dashes and gaps, in percent of the diagonal; 0: none"},
    {"arrows", TL_PROP_REAL, 1, 0, 100, false, NULL, "%", "0",
     "from arrow to arrow, in percent of the diagonal; 0: none"},
    OPACITY("opacity", 0, "1", "of lines that are not ghosts"),
    FLAG("has_box", "off", "lines that do not run through the box are ghosts"),
    BOX("box", "of has_box; auto: the middle half of the data"),
    {"speed", TL_PROP_REAL, 1, -1000, 1000, false, NULL, "1/s", "0",
     "dashes and arrows that pass a place in a second; 0: they stand"},
    CHANNEL("color_by", "the channel that colours them; empty: the length of their vectors"),
};

#define ROWS(name, table, help)                                                                    \
    {                                                                                              \
        name, help, table, sizeof table / sizeof *table                                            \
    }
static const struct {
    const char *name, *help;
    const tl_prop_info *props;
    size_t count;
} KINDS[TL_NODE_KIND_COUNT] = {
    [TL_NODE_DATA] = ROWS("data", DATA, "what is taken of the data set"),
    [TL_NODE_CAMERA] = ROWS("camera", CAMERA, "from where it is seen, in the terms of VTK"),
    [TL_NODE_PICTURE] = ROWS("picture", PICTURE, "what is around the data, and what draws"),
    [TL_NODE_DETAIL] = ROWS("detail", DETAIL, "how fine a model is shown"),
    [TL_NODE_DERIVE] = ROWS("derive", DERIVE, "a channel computed from others"),
    [TL_NODE_CLIP] = ROWS("clip", CLIP, "a plane that cuts the mesh"),
    [TL_NODE_THRESHOLD] = ROWS("threshold", THRESHOLD, "tets that are left out by their values"),
    [TL_NODE_TRANSFER] = ROWS("transfer", TRANSFER, "colours and opacities of a channel"),
    [TL_NODE_VOLUME] = ROWS("volume", VOLUME, "a channel as a cloud; one is drawn"),
    [TL_NODE_SURFACE] = ROWS("surface", SURFACE, "where a channel has a value"),
    [TL_NODE_SLICE] = ROWS("slice", SLICE, "the values on a plane"),
    [TL_NODE_BOUNDARY] = ROWS("boundary", BOUNDARY, "the boundary of the mesh"),
    [TL_NODE_EDGES] = ROWS("edges", EDGES, "sharp edges of the boundary, and between regions"),
    [TL_NODE_SILHOUETTES] = ROWS("silhouettes", SILHOUETTES, "the outlines of the boundary"),
    [TL_NODE_POINTS] = ROWS("points", POINTS, "a cloud of points on isosurfaces"),
    [TL_NODE_LINES] = ROWS("lines", LINES, "curves along vectors"),
};

static bool is_kind(tl_node_kind kind)
{
    return (unsigned)kind < TL_NODE_KIND_COUNT;
}

const char *tl_node_kind_name(tl_node_kind kind)
{
    return is_kind(kind) ? KINDS[kind].name : NULL;
}

const char *tl_node_kind_help(tl_node_kind kind)
{
    return is_kind(kind) ? KINDS[kind].help : NULL;
}

tl_node_kind tl_node_kind_named(const char *name)
{
    tl_node_kind kind = TL_NODE_DATA;
    while (kind < TL_NODE_KIND_COUNT && strcmp(KINDS[kind].name, name) != 0) kind++;
    return kind;
}

const tl_prop_info *tl_node_props(tl_node_kind kind, size_t *count)
{
    *count = is_kind(kind) ? KINDS[kind].count : 0;
    return is_kind(kind) ? KINDS[kind].props : NULL;
}

const tl_prop_info *tl_node_prop(tl_node_kind kind, const char *name)
{
    size_t count;
    const tl_prop_info *props = tl_node_props(kind, &count);
    for (size_t i = 0; i < count; i++)
        if (strcmp(props[i].name, name) == 0) return &props[i];
    return NULL;
}

bool tli_prop_may_be_empty(const tl_prop_info *info)
{
    switch (info->type) {
    case TL_PROP_FLAG:
    case TL_PROP_COUNT:
    case TL_PROP_CHOICE: return false;
    case TL_PROP_TEXT:
    case TL_PROP_CHANNEL:
    case TL_PROP_COLOR:
    case TL_PROP_LIST: return true;
    case TL_PROP_REAL:
    case TL_PROP_POINT:
    case TL_PROP_BOX:
    case TL_PROP_PLANE: break;
    }
    return !*info->preset;
}
