/* Images of places and values: lattices, and the ordered images of floating-point numbers, which
 * lose nothing. */
#include "tetralod/codec.h"

#include <math.h>
#include <string.h>

/* Largest image along an axis of a lattice. */
#define LATTICE_MAX 4294967295.0
/* Largest image of a value of a lattice, or of an integer: float64 is exact up to here. */
#define VALUE_MAX 9007199254740992.0

int64_t tl_image_of_float32(float value)
{
    int32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits < 0 ? bits ^ INT32_MAX : bits;
}

int64_t tl_image_of_float64(double value)
{
    int64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits < 0 ? bits ^ INT64_MAX : bits;
}

float tl_float32_of_image(int64_t image)
{
    uint32_t low = (uint32_t)((uint64_t)image & UINT32_MAX);
    uint32_t bits = image < 0 ? low ^ (uint32_t)INT32_MAX : low;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

double tl_float64_of_image(int64_t image)
{
    int64_t bits = image < 0 ? image ^ INT64_MAX : image;
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

void tl_lattice_xyz(const tl_lattice *lattice, const int64_t k[3], double xyz[3])
{
    for (int a = 0; a < 3; a++) {
        switch (lattice->kind) {
        case TL_PLACE_FLOAT32: xyz[a] = (double)tl_float32_of_image(k[a]); break;
        case TL_PLACE_FLOAT64: xyz[a] = tl_float64_of_image(k[a]); break;
        default: xyz[a] = ldexp((double)(lattice->origin[a] + k[a]), lattice->exponent); break;
        }
    }
}

static int64_t nearest_corner(const tl_lattice *lattice, int axis, double x)
{
    double k = nearbyint(ldexp(x, -lattice->exponent)) - (double)lattice->origin[axis];
    if (!(k > 0)) return 0;
    return k < LATTICE_MAX ? (int64_t)k : (int64_t)LATTICE_MAX;
}

/* The nearest float32, infinite only for what is infinite. */
static float to_float32(double x)
{
    if (isfinite(x) && fabs(x) > 3.4028234663852886e38)
        return x < 0 ? -0x1.fffffep127f : 0x1.fffffep127f;
    return (float)x;
}

void tl_lattice_nearest(const tl_lattice *lattice, const double xyz[3], int64_t k[3])
{
    for (int a = 0; a < 3; a++) {
        double x = isnan(xyz[a]) ? 0 : xyz[a];
        switch (lattice->kind) {
        case TL_PLACE_FLOAT32: k[a] = tl_image_of_float32(to_float32(x)); break;
        case TL_PLACE_FLOAT64: k[a] = tl_image_of_float64(x); break;
        default: k[a] = nearest_corner(lattice, a, x); break;
        }
    }
}

int64_t tl_value_image(const tl_value_code *code, double value)
{
    if (isnan(value)) return TL_IMAGE_NAN;
    if (isinf(value)) return value < 0 ? TL_IMAGE_NINF : TL_IMAGE_PINF;
    if (code->kind == TL_VALUE_FLOAT32) return tl_image_of_float32(to_float32(value));
    if (code->kind == TL_VALUE_FLOAT64) return tl_image_of_float64(value);
    double k = nearbyint(code->kind == TL_VALUE_LATTICE ? value / code->step : value);
    if (fabs(k) > VALUE_MAX) k = copysign(VALUE_MAX, k);
    return (int64_t)k;
}

double tl_value_of(const tl_value_code *code, int64_t image)
{
    if (image == TL_IMAGE_NAN) return (double)NAN;
    if (image == TL_IMAGE_NINF) return -(double)INFINITY;
    if (image == TL_IMAGE_PINF) return (double)INFINITY;
    if (code->kind == TL_VALUE_FLOAT32) return (double)tl_float32_of_image(image);
    if (code->kind == TL_VALUE_FLOAT64) return tl_float64_of_image(image);
    return code->kind == TL_VALUE_LATTICE ? code->step * (double)image : (double)image;
}
