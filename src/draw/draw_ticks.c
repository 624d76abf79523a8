/* Round numbers: steps of 1, 2 or 5 times a power of ten (Heckbert 1990, without moving the ends of
 * the axis). */
#include "tetralod/draw.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/base.h"

/* Digits before and behind the point up to which numbers are written without an exponent. */
enum { DIGITS_BEFORE = 6, DIGITS_BEHIND = 4 };
/* Steps closer to 0 than this part of the range are 0: what rounding leaves. */
static const double NEARLY_ZERO = 1e-9;
/* Ratio of values from which a logarithmic axis has powers of ten as its numbers. */
static const double DECADES_LEAST = 30;

/* value * 10^-exponent, where 10^exponent may overflow. */
static double shift(double value, int exponent)
{
    const int half = exponent / 2;
    return value * pow(10, -half) * pow(10, -(exponent - half));
}

static int magnitude(double value)
{
    return value > 0 && isfinite(value) ? (int)floor(log10(value) + NEARLY_ZERO) : 0;
}

/* The least round step that is not below raw. */
static double round_step(double raw)
{
    static const double ROUND[] = {1, 2, 5, 10};
    const int exponent = magnitude(raw);
    const double mantissa = shift(raw, exponent);
    size_t i = 0;
    while (i < 3 && ROUND[i] < mantissa * (1 - NEARLY_ZERO)) i++;
    return shift(ROUND[i], -exponent);
}

static int decimals_of(double step, int exponent)
{
    const int digits = exponent - magnitude(step);
    return digits > 0 ? digits > 17 ? 17 : digits : 0;
}

static int exponent_of(double low, double high, double step)
{
    const int most = magnitude(fmax(fabs(low), fabs(high)));
    const bool reads_well = most < DIGITS_BEFORE && decimals_of(step, 0) <= DIGITS_BEHIND;
    return reads_well ? 0 : most;
}

static size_t one_tick(double value, tl_tick *tick, int *exponent)
{
    const int most = magnitude(fabs(value));
    *exponent = most >= DIGITS_BEFORE || most < -DIGITS_BEHIND ? most : 0;
    *tick = (tl_tick){.value = value, .at = 0.5};
    tli_print(tick->label, sizeof tick->label, "%.6g", shift(value, *exponent));
    return 1;
}

/* Hyphens become minus signs. */
static void write_label(double value, int exponent, int decimals, char label[TL_TICK_BYTES])
{
    char plain[TL_TICK_BYTES];
    tli_print(plain, sizeof plain, "%.*f", decimals, shift(value, exponent));
    snprintf(label, TL_TICK_BYTES, "%s%s", plain[0] == '-' ? "−" : "", plain + (plain[0] == '-'));
}

size_t tl_ticks(double low, double high, size_t most, tl_tick ticks[TL_TICKS_MAX], int *exponent)
{
    const double width = high / 2 - low / 2; /* half of it: the whole may overflow */
    size_t count = 0;
    *exponent = 0;
    if (!(width > 0)) return one_tick(low, ticks, exponent);
    most = most < 2 ? 2 : most > TL_TICKS_MAX ? TL_TICKS_MAX : most;
    double step = 0, first = 0, last = 0;
    for (double parts = (double)most; parts >= 1; parts--) {
        step = round_step(2 * (width / parts));
        first = ceil(low / step - NEARLY_ZERO);
        last = floor(high / step + NEARLY_ZERO);
        if (last - first < (double)most) break;
    }
    if (!(step > 0) || !(last - first < TL_TICKS_MAX)) return one_tick(low, ticks, exponent);
    *exponent = exponent_of(low, high, step);
    const int decimals = decimals_of(step, *exponent);
    for (double i = first; i <= last && count < TL_TICKS_MAX; i++) {
        tl_tick *tick = &ticks[count++];
        tick->value = fmin(fmax(i * step, low), high);
        if (fabs(i) < 0.5) tick->value = 0;
        tick->at = (tick->value / 2 - low / 2) / width;
        write_label(tick->value, *exponent, decimals, tick->label);
    }
    return count ? count : one_tick(low, ticks, exponent);
}

/* ---- logarithmic ---- */

/* Digits as superscripts. */
static void raise_digits(int number, char *text, size_t bytes)
{
    static const char *const RAISED[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    char plain[16];
    size_t at = 0;
    snprintf(plain, sizeof plain, "%d", number);
    for (const char *c = plain; *c && at + 4 < bytes; c++)
        at += (size_t)snprintf(text + at, bytes - at, "%s", *c == '-' ? "⁻" : RAISED[*c - '0']);
}

void tl_exponent_text(int exponent, char text[TL_TICK_BYTES])
{
    char raised[TL_TICK_BYTES - 8] = "";
    text[0] = '\0';
    if (!exponent) return;
    raise_digits(exponent, raised, sizeof raised);
    snprintf(text, TL_TICK_BYTES, "×10%s", raised);
}

static void write_power(int exponent, char label[TL_TICK_BYTES])
{
    char raised[TL_TICK_BYTES - 8] = "";
    if (exponent >= -3 && exponent <= 4) {
        tli_print(label, TL_TICK_BYTES, "%g", pow(10, exponent));
        return;
    }
    raise_digits(exponent, raised, sizeof raised);
    snprintf(label, TL_TICK_BYTES, "10%s", raised);
}

size_t tl_ticks_log(double low, double high, size_t most, tl_tick ticks[TL_TICKS_MAX])
{
    const double from = log10(low), wide = log10(high) - from;
    size_t count = 0;
    int exponent;
    if (!(wide > 0) || high / low < DECADES_LEAST) {
        /* round numbers at their places */
        count = tl_ticks(low, high, most, ticks, &exponent);
        for (size_t i = 0; i < count && wide > 0; i++) {
            ticks[i].at = (log10(ticks[i].value) - from) / wide;
            tli_print(ticks[i].label, sizeof ticks[i].label, "%.4g", ticks[i].value);
        }
        return count;
    }
    const int first = (int)floor(from), last = (int)floor(from + wide + NEARLY_ZERO);
    const int stride = 1 + (int)(wide / (double)(most < 2 ? 2 : most));
    const bool small_ticks = (last - first + 1) * 9 <= TL_TICKS_MAX && stride == 1;
    for (int e = first; e <= last; e++)
        for (int digit = 1; digit <= (small_ticks ? 9 : 1) && count < TL_TICKS_MAX; digit++) {
            const double at = (e + log10(digit) - from) / wide;
            if (at < -NEARLY_ZERO || at > 1 + NEARLY_ZERO || (digit == 1 && e % stride)) continue;
            tl_tick *tick = &ticks[count++];
            *tick = (tl_tick){.value = digit * pow(10, e), .at = fmin(fmax(at, 0), 1)};
            if (digit == 1) write_power(e, tick->label);
        }
    return count;
}
