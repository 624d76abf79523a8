/* Colours between colours in the spaces of ParaView's colour maps, and opacities with a midpoint
 * and a sharpness. sRGB and CIE Lab with the white of D65; the polar Lab of diverging maps is that
 * of K. Moreland, Diverging Color Maps for Scientific Visualization, 2009. */
#include "scene/scene_colorspace.h"

#include <math.h>
#include <string.h>

/* Rows to CIE XYZ, rows back, and the white of Lab. */
static const double TO_XYZ[3][3] = {
    {0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
static const double FROM_XYZ[3][3] = {
    {3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}};
static const double WHITE[3] = {0.9505, 1, 1.089};
/* Where the straight parts of the curves of sRGB (coded and linear) and of Lab end. */
static const double SRGB_CODED = 0.04045, SRGB_LINEAR = 0.0031308, LAB_LINEAR = 0.008856;

/* Of diverging maps: colours nearer to grey than this angle have no hue of their own, lightness of
 * the white between, hues this much apart are different, slack of lightness, hue of purple. */
static const double GREY_ANGLE = 0.05, WHITE_LEAST = 88, LIGHT_SLACK = 0.1;
#define PI 3.14159265358979323846
static const double HUES_APART = 0.33 * PI, PURPLE = -0.3 * PI;
/* Below these lengths and angles polar coordinates are those of the axis. */
static const double POLAR_LEAST = 0.001;

/* Sharpness from which on a way is a step, and up to which it is straight. */
static const double STEP_FROM = 0.99, STRAIGHT_TO = 0.01;
/* Midpoints stay off the ends of the way by this part of it. */
static const double MIDDLE_LEAST = 1e-5;

static double mix(double a, double b, double t)
{
    return (1 - t) * a + t * b;
}

static double clamp(double x, double low, double high)
{
    return fmin(fmax(x, low), high);
}

/* ---- HSV ---- */

static void to_hsv(const double rgb[3], double hsv[3])
{
    const double most = fmax(rgb[0], fmax(rgb[1], rgb[2]));
    const double span = most - fmin(rgb[0], fmin(rgb[1], rgb[2]));
    double turn = 0; /* sixths of the circle */
    if (span > 0) {
        if (rgb[0] == most)
            turn = (rgb[1] - rgb[2]) / span;
        else if (rgb[1] == most)
            turn = 2 + (rgb[2] - rgb[0]) / span;
        else
            turn = 4 + (rgb[0] - rgb[1]) / span;
    }
    hsv[0] = turn < 0 ? turn / 6 + 1 : turn / 6;
    hsv[1] = most > 0 ? span / most : 0;
    hsv[2] = most;
}

static void from_hsv(const double hsv[3], double rgb[3])
{
    for (int k = 0; k < 3; k++) { /* each channel is full for a third around its hue */
        const double away = fabs(remainder(hsv[0] - k / 3.0, 1)) * 6;
        rgb[k] = hsv[2] * (1 - hsv[1] * clamp(away - 1, 0, 1));
    }
}

static void between_hsv(const double a[3], const double b[3], bool wrap, double t, double rgb[3])
{
    double from[3], to[3], now[3];
    to_hsv(a, from);
    to_hsv(b, to);
    if (wrap && fabs(from[0] - to[0]) > 0.5) (from[0] < to[0] ? from : to)[0] += 1;
    for (int k = 0; k < 3; k++) now[k] = mix(from[k], to[k], t);
    from_hsv(now, rgb);
}

/* ---- Lab ---- */

static void to_lab(const double rgb[3], double lab[3])
{
    double linear[3], curve[3];
    for (int k = 0; k < 3; k++)
        linear[k] = rgb[k] > SRGB_CODED ? pow((rgb[k] + 0.055) / 1.055, 2.4) : rgb[k] / 12.92;
    for (int k = 0; k < 3; k++) {
        double part = 0;
        for (int i = 0; i < 3; i++) part += TO_XYZ[k][i] * linear[i];
        part /= WHITE[k];
        curve[k] = part > LAB_LINEAR ? cbrt(part) : 7.787 * part + 16.0 / 116;
    }
    lab[0] = 116 * curve[1] - 16;
    lab[1] = 500 * (curve[0] - curve[1]);
    lab[2] = 200 * (curve[1] - curve[2]);
}

/* Colours that no screen has are made as dark as need be, then cut off. */
static void from_lab(const double lab[3], double rgb[3])
{
    const double light = (lab[0] + 16) / 116;
    double xyz[3] = {light + lab[1] / 500, light, light - lab[2] / 200}, most = 1;
    for (int k = 0; k < 3; k++) {
        const double cube = xyz[k] * xyz[k] * xyz[k];
        xyz[k] = WHITE[k] * (cube > LAB_LINEAR ? cube : (xyz[k] - 16.0 / 116) / 7.787);
    }
    for (int k = 0; k < 3; k++) {
        double linear = 0;
        for (int i = 0; i < 3; i++) linear += FROM_XYZ[k][i] * xyz[i];
        rgb[k] = linear > SRGB_LINEAR ? 1.055 * pow(linear, 1 / 2.4) - 0.055 : 12.92 * linear;
        most = fmax(most, rgb[k]);
    }
    for (int k = 0; k < 3; k++) rgb[k] = fmax(rgb[k] / most, 0);
}

static void between_lab(const double a[3], const double b[3], double t, double rgb[3])
{
    double from[3], to[3], now[3];
    to_lab(a, from);
    to_lab(b, to);
    for (int k = 0; k < 3; k++) now[k] = mix(from[k], to[k], t);
    from_lab(now, rgb);
}

/* ---- diverging ---- */

/* Lab in polar coordinates: distance from black, angle from the greys, hue. */
typedef struct polar {
    double length, angle, hue;
} polar;

static polar to_polar(const double rgb[3])
{
    double lab[3];
    to_lab(rgb, lab);
    polar p = {sqrt(lab[0] * lab[0] + lab[1] * lab[1] + lab[2] * lab[2]), 0, 0};
    if (p.length > POLAR_LEAST) p.angle = acos(clamp(lab[0] / p.length, -1, 1));
    if (p.angle > POLAR_LEAST) p.hue = atan2(lab[2], lab[1]);
    return p;
}

/* The hue of a grey of that length at the other end of the way from a colour: turned so that the
 * steps of the way look equal, away from purple. */
static double grey_hue(polar color, double length)
{
    if (color.length >= length - LIGHT_SLACK) return color.hue;
    const double turn = color.angle * sqrt(length * length - color.length * color.length) /
                        (color.length * sin(color.angle));
    return color.hue > PURPLE ? color.hue + turn : color.hue - turn;
}

static void between_diverging(const double a[3], const double b[3], double t, double rgb[3])
{
    polar from = to_polar(a), to = to_polar(b);
    if (from.angle > GREY_ANGLE && to.angle > GREY_ANGLE &&
        fabs(remainder(from.hue - to.hue, 2 * PI)) > HUES_APART) {
        const polar white = {fmax(WHITE_LEAST, fmax(from.length, to.length)), 0, 0};
        *(t < 0.5 ? &to : &from) = white;
        t = t < 0.5 ? 2 * t : 2 * t - 1;
    }
    if (from.angle < GREY_ANGLE && to.angle > GREY_ANGLE)
        from.hue = grey_hue(to, from.length);
    else if (to.angle < GREY_ANGLE && from.angle > GREY_ANGLE)
        to.hue = grey_hue(from, to.length);
    const polar now = {mix(from.length, to.length, t), mix(from.angle, to.angle, t),
                       mix(from.hue, to.hue, t)};
    const double chroma = now.length * sin(now.angle);
    const double lab[3] = {now.length * cos(now.angle), chroma * cos(now.hue),
                           chroma * sin(now.hue)};
    from_lab(lab, rgb);
}

/* ---- all ---- */

bool tli_color_space_named(const char *name, tli_color_space *space)
{
    static const struct {
        const char *name;
        tli_color_space space;
    } NAMES[] = {{"RGB", TLI_SPACE_RGB},
                 {"HSV", TLI_SPACE_HSV},
                 {"HSVNoWrap", TLI_SPACE_HSV},
                 {"Lab", TLI_SPACE_LAB},
                 {"CIELAB", TLI_SPACE_LAB},
                 {"LabCIEDE2000", TLI_SPACE_LAB},
                 {"Lab/CIEDE2000", TLI_SPACE_LAB},
                 {"CIEDE2000", TLI_SPACE_LAB},
                 {"Diverging", TLI_SPACE_DIVERGING},
                 {"Step", TLI_SPACE_STEP}};
    for (size_t i = 0; i < sizeof NAMES / sizeof *NAMES; i++)
        if (strcmp(name, NAMES[i].name) == 0) {
            *space = NAMES[i].space;
            return true;
        }
    return false;
}

void tli_color_between(tli_color_space space, const double a[3], const double b[3], double t,
                       double rgb[3])
{
    switch (space) {
    case TLI_SPACE_HSV:
    case TLI_SPACE_HSV_WRAP: between_hsv(a, b, space == TLI_SPACE_HSV_WRAP, t, rgb); break;
    case TLI_SPACE_LAB: between_lab(a, b, t, rgb); break;
    case TLI_SPACE_DIVERGING: between_diverging(a, b, t, rgb); break;
    case TLI_SPACE_STEP: memcpy(rgb, b, 3 * sizeof *rgb); break;
    case TLI_SPACE_RGB:
        for (int k = 0; k < 3; k++) rgb[k] = mix(a[k], b[k], t);
        break;
    }
}

double tli_opacity_between(double a, double b, double middle, double sharpness, double t)
{
    middle = clamp(middle, MIDDLE_LEAST, 1 - MIDDLE_LEAST);
    double s = t < middle ? t / middle / 2 : 0.5 + (t - middle) / (1 - middle) / 2;
    if (sharpness > STEP_FROM) return s < 0.5 ? a : b;
    if (sharpness < STRAIGHT_TO) return mix(a, b, s);
    /* towards the ends by a power, then a cubic that is the flatter there the sharper it is */
    const double power = 1 + 10 * sharpness, slope = (1 - sharpness) * (b - a);
    s = s < 0.5 ? pow(2 * s, power) / 2 : 1 - pow(2 * (1 - s), power) / 2;
    const double done = s * s * (3 - 2 * s);
    const double y = mix(a, b, done) + slope * s * (1 - s) * (1 - 2 * s);
    return clamp(y, fmin(a, b), fmax(a, b));
}
