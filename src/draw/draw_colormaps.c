/* Colour maps as control points over 0 to 1: five or nine samples of the perceptual maps of
 * matplotlib (van der Walt & Smith; cividis of Nunez et al. 2018), the ends and middle of the
 * diverging map of Moreland 2009. Two are computed in CIELAB (D65): blue-to-brown, with lightness
 * 96 - 72 s at the distance s (0 to 1) from its middle, chroma 38 and 44 times sin(0.8 pi s)^0.9
 * and hues 262 and 52 degrees; phase, with lightness 66, chroma 37 and a hue that goes around. */
#include <string.h>

#include "draw/draw.h"

static const tl_color_point VIRIDIS[] = {
    {0, {0.267, 0.004, 0.329}},     {0.125, {0.278, 0.176, 0.482}}, {0.25, {0.231, 0.322, 0.545}},
    {0.375, {0.173, 0.447, 0.557}}, {0.5, {0.129, 0.565, 0.549}},   {0.625, {0.153, 0.678, 0.506}},
    {0.75, {0.365, 0.784, 0.388}},  {0.875, {0.667, 0.863, 0.196}}, {1, {0.992, 0.906, 0.145}}};
static const tl_color_point INFERNO[] = {
    {0, {0.000, 0.000, 0.016}},     {0.125, {0.129, 0.047, 0.290}}, {0.25, {0.337, 0.063, 0.431}},
    {0.375, {0.537, 0.133, 0.416}}, {0.5, {0.733, 0.216, 0.329}},   {0.625, {0.890, 0.349, 0.200}},
    {0.75, {0.976, 0.549, 0.039}},  {0.875, {0.976, 0.788, 0.196}}, {1, {0.988, 1.000, 0.643}}};
static const tl_color_point MAGMA[] = {{0, {0.000, 0.000, 0.016}},
                                       {0.25, {0.318, 0.071, 0.486}},
                                       {0.5, {0.714, 0.212, 0.475}},
                                       {0.75, {0.984, 0.533, 0.380}},
                                       {1, {0.988, 0.992, 0.749}}};
static const tl_color_point PLASMA[] = {{0, {0.051, 0.031, 0.529}},
                                        {0.25, {0.494, 0.012, 0.659}},
                                        {0.5, {0.800, 0.275, 0.471}},
                                        {0.75, {0.973, 0.580, 0.255}},
                                        {1, {0.941, 0.976, 0.129}}};
static const tl_color_point CIVIDIS[] = {{0, {0.000, 0.125, 0.302}},
                                         {0.25, {0.255, 0.302, 0.420}},
                                         {0.5, {0.486, 0.482, 0.471}},
                                         {0.75, {0.737, 0.686, 0.435}},
                                         {1, {1.000, 0.918, 0.275}}};
static const tl_color_point COOL_TO_WARM[] = {
    {0, {0.230, 0.299, 0.754}}, {0.5, {0.865, 0.865, 0.865}}, {1, {0.706, 0.016, 0.150}}};
static const tl_color_point BLUE_TO_BROWN[] = {
    {0, {0.037, 0.237, 0.360}},     {0.125, {0.000, 0.411, 0.620}}, {0.25, {0.310, 0.590, 0.813}},
    {0.375, {0.625, 0.771, 0.924}}, {0.5, {0.955, 0.955, 0.955}},   {0.625, {0.928, 0.709, 0.604}},
    {0.75, {0.793, 0.493, 0.343}},  {0.875, {0.588, 0.316, 0.177}}, {1, {0.343, 0.181, 0.099}}};
static const tl_color_point PHASE[] = {
    {0, {0.883, 0.531, 0.546}},         {1.0 / 12, {0.844, 0.561, 0.435}},
    {2.0 / 12, {0.753, 0.606, 0.372}},  {0.25, {0.626, 0.648, 0.380}},
    {4.0 / 12, {0.477, 0.679, 0.457}},  {5.0 / 12, {0.304, 0.696, 0.579}},
    {0.5, {0.074, 0.698, 0.713}},       {7.0 / 12, {0.086, 0.685, 0.825}},
    {8.0 / 12, {0.358, 0.655, 0.883}},  {0.75, {0.580, 0.611, 0.873}},
    {10.0 / 12, {0.750, 0.564, 0.798}}, {11.0 / 12, {0.853, 0.531, 0.678}},
    {1, {0.883, 0.531, 0.546}}};
static const tl_color_point GREYS[] = {{0, {0.05, 0.05, 0.05}}, {1, {0.95, 0.95, 0.95}}};

static const struct {
    const char *name;
    const tl_color_point *points;
    size_t count;
    bool is_diverging;
} MAPS[] = {
    {"viridis", VIRIDIS, sizeof VIRIDIS / sizeof *VIRIDIS, false},
    {"inferno", INFERNO, sizeof INFERNO / sizeof *INFERNO, false},
    {"magma", MAGMA, sizeof MAGMA / sizeof *MAGMA, false},
    {"plasma", PLASMA, sizeof PLASMA / sizeof *PLASMA, false},
    {"cividis", CIVIDIS, sizeof CIVIDIS / sizeof *CIVIDIS, false},
    {"cool-to-warm", COOL_TO_WARM, sizeof COOL_TO_WARM / sizeof *COOL_TO_WARM, true},
    {"grey", GREYS, sizeof GREYS / sizeof *GREYS, false},
    {"blue-to-brown", BLUE_TO_BROWN, sizeof BLUE_TO_BROWN / sizeof *BLUE_TO_BROWN, true},
    {"phase", PHASE, sizeof PHASE / sizeof *PHASE, false},
};

const char *tl_colormap_name(size_t index)
{
    return index < sizeof MAPS / sizeof *MAPS ? MAPS[index].name : NULL;
}

const tl_color_point *tl_colormap(const char *name, size_t *count)
{
    for (size_t i = 0; i < sizeof MAPS / sizeof *MAPS; i++)
        if (strcmp(MAPS[i].name, name) == 0) {
            *count = MAPS[i].count;
            return MAPS[i].points;
        }
    return NULL;
}

bool tl_colormap_is_diverging(const char *name)
{
    for (size_t i = 0; i < sizeof MAPS / sizeof *MAPS; i++)
        if (strcmp(MAPS[i].name, name) == 0) return MAPS[i].is_diverging;
    return false;
}
