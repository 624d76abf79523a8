/* Text to numbers, exact and fast.
 *
 * A decimal is w * 10^e with w of at most 19 digits. Three ways lead to the nearest double:
 *   1. w and 10^|e| are doubles: one multiplication or division rounds once (Clinger 1990).
 *   2. w * 10^e is enclosed by two 128-bit numbers, a few units of the last place apart; if both
 *      round to the same double, that is the answer. Digits past the 19th widen the interval.
 *   3. Else exactly one midpoint of two doubles lies in the interval, and whole numbers of any
 *      length tell on which side of it the decimal lies.
 * Way 3 is taken by about one number in 10^18 and by real ties. */
#include "formats/formats_number.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

__extension__ typedef unsigned __int128 uint128;

#define DIGITS_FAST 19      /* digits that always fit 64 bits */
#define DIGITS_EXACT 800    /* a midpoint of two doubles has at most 768 significant digits */
#define EXPONENT_MAX 400000 /* written exponents are cut here */
#define POWER_STEP 27       /* 5^27 is the largest power of 5 below 2^64 */
#define POWER_FIRST (-13)   /* the table begins at 10^(-13 * 27) */
#define EXP10_MIN (-343)    /* 19 digits times 10^-344 are below half the smallest double */
#define EXP10_MAX 308
#define F64_INFINITY_BITS 0x7ff0000000000000u

/* A decimal as it stands in the text. */
typedef struct decimal {
    uint64_t w;    /* its first digits */
    int64_t exp10; /* weight of the last digit of w */
    bool negative;
    bool truncated;     /* nonzero digits follow those of w */
    const char *digits; /* first digit or point; read again on way 3 */
    const char *digits_end;
} decimal;

/* A whole number, least significant word first. Way 3 compares numbers of about equal size below
 * 10^800 * 2^1100 or 5^1143 * 2^1200, so 8192 bits are more than enough. */
#define WHOLE_WORDS 256
typedef struct whole {
    uint32_t words[WHOLE_WORDS];
    int count;
} whole;

/* mantissa * 2^exp2 = 10^(27 * q), q = -13 .. 11, mantissa cut off after 128 bits. */
typedef struct power {
    uint64_t high, low;
    int exp2;
} power;
static const power powers[] = {
    {0x8049a4ac0c5811aeu, 0x205b896d777d6278u, -1293}, /* 1e-351 */
    {0xcf42894a5dce35eau, 0x52064cac828675b9u, -1204}, /* 1e-324 */
    {0xa76c582338ed2621u, 0xaf2af2b80af6f24eu, -1114}, /* 1e-297 */
    {0x873e4f75e2224e68u, 0x5a7744a6e804a291u, -1024}, /* 1e-270 */
    {0xda7f5bf590966848u, 0xaf39a475506a899eu, -935},  /* 1e-243 */
    {0xb080392cc4349decu, 0xbd8d794d96aacfb3u, -845},  /* 1e-216 */
    {0x8e938662882af53eu, 0x547eb47b7282ee9cu, -755},  /* 1e-189 */
    {0xe65829b3046b0afau, 0x0cb4a5a3112a5112u, -666},  /* 1e-162 */
    {0xba121a4650e4ddebu, 0x92f34d62616ce413u, -576},  /* 1e-135 */
    {0x964e858c91ba2655u, 0x3a6a07f8d510f86fu, -486},  /* 1e-108 */
    {0xf2d56790ab41c2a2u, 0xfae27299423fb9c3u, -397},  /* 1e-81 */
    {0xc428d05aa4751e4cu, 0xaa97e14c3c26b886u, -307},  /* 1e-54 */
    {0x9e74d1b791e07e48u, 0x775ea264cf55347du, -217},  /* 1e-27 */
    {0x8000000000000000u, 0x0000000000000000u, -127},  /* 1e0 */
    {0xcecb8f27f4200f3au, 0x0000000000000000u, -38},   /* 1e27 */
    {0xa70c3c40a64e6c51u, 0x999090b65f67d924u, 52},    /* 1e54 */
    {0x86f0ac99b4e8dafdu, 0x69a028bb3ded71a3u, 142},   /* 1e81 */
    {0xda01ee641a708de9u, 0xe80e6f4820cc9495u, 231},   /* 1e108 */
    {0xb01ae745b101e9e4u, 0x5ec05dcff72e7f8fu, 321},   /* 1e135 */
    {0x8e41ade9fbebc27du, 0x14588f13be847307u, 411},   /* 1e162 */
    {0xe5d3ef282a242e81u, 0x8f1668c8a86da5fau, 500},   /* 1e189 */
    {0xb9a74a0637ce2ee1u, 0x6d953e2bd7173692u, 590},   /* 1e216 */
    {0x95f83d0a1fb69cd9u, 0x4abdaf101564f98eu, 680},   /* 1e243 */
    {0xf24a01a73cf2dccfu, 0xbc633b39673c8cecu, 769},   /* 1e270 */
    {0xc3b8358109e84f07u, 0x0a862f80ec4700c8u, 859},   /* 1e297 */
};

static const uint64_t powers_of_5[POWER_STEP + 1] = {1u,
                                                     5u,
                                                     25u,
                                                     125u,
                                                     625u,
                                                     3125u,
                                                     15625u,
                                                     78125u,
                                                     390625u,
                                                     1953125u,
                                                     9765625u,
                                                     48828125u,
                                                     244140625u,
                                                     1220703125u,
                                                     6103515625u,
                                                     30517578125u,
                                                     152587890625u,
                                                     762939453125u,
                                                     3814697265625u,
                                                     19073486328125u,
                                                     95367431640625u,
                                                     476837158203125u,
                                                     2384185791015625u,
                                                     11920928955078125u,
                                                     59604644775390625u,
                                                     298023223876953125u,
                                                     1490116119384765625u,
                                                     7450580596923828125u};

/* Powers of ten that are doubles. */
static const double exact_powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                      1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                      1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
#define EXACT_POWER_MAX 22

static bool is_digit(char c)
{
    return (unsigned)(c - '0') <= 9u;
}

static bool is_space(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* A character that makes a number next to it no number. */
static bool is_word(char c)
{
    char lower = (char)(c | 0x20);
    return is_digit(c) || (lower >= 'a' && lower <= 'z') || c == '.' || c == '_' || c == '+' ||
           c == '-';
}

/* ---- scanning ---- */

/* Reads the digits again, slowly: more than 19 of them, leading zeros included. */
static void scan_long(decimal *dec)
{
    int taken = 0;
    bool point = false;
    dec->w = 0;
    dec->exp10 = 0;
    for (const char *p = dec->digits; p < dec->digits_end; p++) {
        if (*p == '.') {
            point = true;
            continue;
        }
        unsigned digit = (unsigned)(*p - '0');
        if (taken < DIGITS_FAST) {
            dec->w = dec->w * 10 + digit;
            if (dec->w) taken++;
            if (point) dec->exp10--;
        } else {
            if (digit) dec->truncated = true;
            if (!point) dec->exp10++;
        }
    }
}

/* e or d, sign, digits. Returns at when there is none. */
static const char *scan_exponent(const char *at, const char *end, int64_t *exponent)
{
    const char *p = at;
    *exponent = 0;
    if (p == end || ((*p | 0x20) != 'e' && (*p | 0x20) != 'd')) return at;
    p++;
    bool negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) p++;
    if (p == end || !is_digit(*p)) return at;
    int64_t value = 0;
    for (; p < end && is_digit(*p); p++)
        if (value < EXPONENT_MAX) value = value * 10 + (*p - '0');
    *exponent = negative ? -value : value;
    return p;
}

/* Digits with at most one point, and an exponent. NULL if there is no digit. */
static const char *scan_decimal(const char *at, const char *end, decimal *dec)
{
    const char *p = at;
    uint64_t w = 0;
    dec->digits = at;
    dec->truncated = false;
    for (; p < end && is_digit(*p); p++) w = w * 10 + (unsigned)(*p - '0');
    ptrdiff_t digit_count = p - at, after_point = 0;
    if (p < end && *p == '.') {
        const char *fraction = ++p;
        for (; p < end && is_digit(*p); p++) w = w * 10 + (unsigned)(*p - '0');
        after_point = p - fraction;
        digit_count += after_point;
    }
    if (!digit_count) return NULL;
    dec->digits_end = p;
    dec->w = w;
    dec->exp10 = -(int64_t)after_point;
    if (digit_count > DIGITS_FAST) scan_long(dec);
    int64_t exponent;
    p = scan_exponent(p, end, &exponent);
    dec->exp10 += exponent;
    return p;
}

/* Skips the letters of a lower-case word in any case; at when they do not stand there. */
static const char *skip_word(const char *at, const char *end, const char *word)
{
    const char *p = at;
    for (; *word; word++, p++)
        if (p == end || (*p | 0x20) != *word) return at;
    return p;
}

/* nan, nan(...), inf, infinity. NULL if it is none of them. */
static const char *scan_special(const char *at, const char *end, double *value)
{
    const char *p = skip_word(at, end, "nan");
    if (p != at) {
        *value = (double)NAN;
        if (p == end || *p != '(') return p;
        const char *q = p + 1;
        while (q < end && (is_word(*q))) q++;
        return q < end && *q == ')' ? q + 1 : p;
    }
    p = skip_word(at, end, "inf");
    if (p == at) return NULL;
    *value = (double)INFINITY;
    return skip_word(p, end, "inity");
}

/* ---- way 3: whole numbers ---- */

static void whole_set(whole *number, uint64_t value)
{
    number->words[0] = (uint32_t)value;
    number->words[1] = (uint32_t)(value >> 32);
    number->count = value >> 32 ? 2 : value != 0;
}

/* number = number * factor + addend */
static void whole_mul_add(whole *number, uint32_t factor, uint32_t addend)
{
    uint64_t carry = addend;
    for (int i = 0; i < number->count; i++) {
        carry += (uint64_t)number->words[i] * factor;
        number->words[i] = (uint32_t)carry;
        carry >>= 32;
    }
    if (carry && number->count < WHOLE_WORDS) number->words[number->count++] = (uint32_t)carry;
}

static void whole_mul_power_of_5(whole *number, int64_t exponent)
{
    for (; exponent >= 13; exponent -= 13) whole_mul_add(number, 1220703125u, 0);
    if (exponent > 0) whole_mul_add(number, (uint32_t)powers_of_5[exponent], 0);
}

static void whole_shift_left(whole *number, int64_t bits)
{
    whole_mul_add(number, 1u << (bits % 32), 0);
    int words = (int)(bits / 32);
    if (!words || number->count + words > WHOLE_WORDS) return;
    memmove(number->words + words, number->words, (size_t)number->count * sizeof(uint32_t));
    memset(number->words, 0, (size_t)words * sizeof(uint32_t));
    number->count += words;
}

static int whole_compare(const whole *a, const whole *b)
{
    if (a->count != b->count) return a->count < b->count ? -1 : 1;
    for (int i = a->count; i-- > 0;)
        if (a->words[i] != b->words[i]) return a->words[i] < b->words[i] ? -1 : 1;
    return 0;
}

/* The digits of a decimal as a whole number times 10^*exp10. Returns true if digits that are not 0
 * were left out. */
static bool whole_from_decimal(const decimal *dec, whole *number, int64_t *exp10)
{
    int taken = 0;
    bool rest = false;
    number->count = 0;
    *exp10 = dec->exp10;
    for (const char *p = dec->digits; p < dec->digits_end; p++) {
        if (*p == '.') continue;
        uint32_t digit = (uint32_t)(*p - '0');
        if (taken < DIGITS_EXACT) {
            whole_mul_add(number, 10, digit);
            if (number->count) taken++;
            if (taken > DIGITS_FAST) --*exp10;
        } else if (digit) {
            rest = true;
        }
    }
    return rest;
}

/* Sign of (decimal without its sign) - mantissa * 2^exp2; the two are about equal. */
static int compare_exact(const decimal *dec, uint64_t mantissa, int exp2)
{
    whole left, right;
    int64_t exp10;
    bool rest = whole_from_decimal(dec, &left, &exp10);
    whole_set(&right, mantissa);
    whole_mul_power_of_5(exp10 >= 0 ? &left : &right, exp10 >= 0 ? exp10 : -exp10);
    int64_t shift = exp10 - exp2; /* by which the left side is to be moved more than the right */
    whole_shift_left(shift >= 0 ? &left : &right, shift >= 0 ? shift : -shift);
    int sign = whole_compare(&left, &right);
    return sign ? sign : rest;
}

/* mantissa and exponent of the double with these bits, which is finite and not negative. */
static uint64_t split_bits(uint64_t bits, int *exp2)
{
    int field = (int)(bits >> 52);
    uint64_t fraction = bits & 0xfffffffffffffu;
    *exp2 = (field ? field : 1) - 1075;
    return field ? fraction | 0x10000000000000u : fraction;
}

/* ---- way 2: intervals ---- */

static int leading_zeros(uint128 m)
{
    uint64_t high = (uint64_t)(m >> 64);
    return high ? __builtin_clzll(high) : 64 + __builtin_clzll((uint64_t)m);
}

/* Bits of the double nearest to m * 2^exp2, m > 0, ties to even. */
static uint64_t round_bits(uint128 m, int exp2)
{
    int lead = 127 - leading_zeros(m);
    int exponent = lead + exp2;
    if (exponent > 1023) return F64_INFINITY_BITS;
    int precision = exponent >= -1022 ? 53 : 53 + exponent + 1022;
    if (precision < 0) return 0;
    int drop = lead + 1 - precision;
    uint64_t kept;
    if (drop <= 0) {
        kept = (uint64_t)m << -drop;
    } else {
        uint128 half = (uint128)1 << (drop - 1);
        uint128 rest = drop < 128 ? m & ((half << 1) - 1) : m;
        kept = drop < 128 ? (uint64_t)(m >> drop) : 0;
        if (rest > half || (rest == half && (kept & 1))) kept++;
    }
    /* the leading bit of kept carries into the exponent field, as does rounding up to a power of 2
     */
    return exponent >= -1022 ? ((uint64_t)(exponent + 1022) << 52) + kept : kept;
}

/* The high 128 bits of a * b, rounded down. */
static uint128 multiply_high(uint128 a, uint128 b)
{
    uint64_t a0 = (uint64_t)a, a1 = (uint64_t)(a >> 64), b0 = (uint64_t)b, b1 = (uint64_t)(b >> 64);
    uint128 low = (uint128)a0 * b0, mid0 = (uint128)a0 * b1, mid1 = (uint128)a1 * b0;
    uint128 middle = (low >> 64) + (uint64_t)mid0 + (uint64_t)mid1;
    return (uint128)a1 * b1 + (mid0 >> 64) + (mid1 >> 64) + (middle >> 64);
}

/* w * 10^exp10 lies in [*m, *m + 2] * 2^*exp2. w > 0, exp10 in EXP10_MIN .. EXP10_MAX. */
static void enclose(uint64_t w, int exp10, uint128 *m, int *exp2)
{
    int row = (exp10 - POWER_FIRST * POWER_STEP) / POWER_STEP;
    int rest = exp10 - (row + POWER_FIRST) * POWER_STEP;
    uint128 a = (uint128)w * powers_of_5[rest];
    int zeros = leading_zeros(a);
    const uint128 p = (uint128)powers[row].high << 64 | powers[row].low;
    *m = multiply_high(a << zeros, p);
    *exp2 = powers[row].exp2 + rest - zeros + 128;
}

/* Bits of the double nearest to a decimal without its sign. */
static uint64_t decimal_bits(const decimal *dec)
{
    if (!dec->w || dec->exp10 < EXP10_MIN) return 0;
    if (dec->exp10 > EXP10_MAX) return F64_INFINITY_BITS;
    uint128 m;
    int exp2;
    enclose(dec->w, (int)dec->exp10, &m, &exp2);
    uint64_t low = round_bits(m, exp2);
    if (dec->truncated) enclose(dec->w + 1, (int)dec->exp10, &m, &exp2);
    uint64_t high = round_bits(m + 2, exp2);
    if (low == high) return low;
    uint64_t mantissa = split_bits(low, &exp2);
    int sign = compare_exact(dec, 2 * mantissa + 1, exp2 - 1);
    if (!sign) return low & 1 ? high : low;
    return sign < 0 ? low : high;
}

static double decimal_f64(const decimal *dec)
{
    double value;
    if (dec->w <= (uint64_t)1 << 53 && !dec->truncated && dec->exp10 >= -EXACT_POWER_MAX &&
        dec->exp10 <= EXACT_POWER_MAX) {
        value = (double)dec->w;
        value =
            dec->exp10 < 0 ? value / exact_powers[-dec->exp10] : value * exact_powers[dec->exp10];
    } else {
        uint64_t bits = decimal_bits(dec);
        memcpy(&value, &bits, sizeof value);
    }
    return value;
}

/* True if a finite value >= 0 lies exactly between two neighbouring floats. */
static bool is_f32_midpoint(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    if (value >= 0x1p-126) return (bits & 0x1fffffffu) == 0x10000000u;
    double units = value * 0x1p149; /* of the smallest float; exact */
    return units - floor(units) == 0.5;
}

/* ---- public ---- */

const char *tli_number_skip_space(const char *at, const char *end)
{
    while (at < end && is_space(*at)) at++;
    return at;
}

/* Sign and body of a number. Returns the place after it, NULL if there is none; special: *value is
 * set, else *dec. */
static const char *scan_number(const char *at, const char *end, decimal *dec, bool *special,
                               double *value)
{
    const char *p = tli_number_skip_space(at, end);
    dec->negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) p++;
    const char *after = scan_decimal(p, end, dec);
    *special = !after;
    if (!after) after = scan_special(p, end, value);
    return after && after < end && is_word(*after) ? NULL : after;
}

const char *tli_number_f64(const char *at, const char *end, double *value)
{
    decimal dec;
    bool special;
    double result;
    const char *after = scan_number(at, end, &dec, &special, &result);
    if (!after) return NULL;
    if (!special) result = decimal_f64(&dec);
    *value = dec.negative ? -result : result;
    return after;
}

const char *tli_number_f32(const char *at, const char *end, float *value)
{
    decimal dec;
    bool special;
    double result;
    const char *after = scan_number(at, end, &dec, &special, &result);
    if (!after) return NULL;
    if (!special) {
        result = decimal_f64(&dec);
        /* A double that was rounded onto a midpoint of two floats no longer says which is nearer.
         */
        if (isfinite(result) && is_f32_midpoint(result)) {
            uint64_t bits;
            int exp2;
            memcpy(&bits, &result, sizeof bits);
            uint64_t mantissa = split_bits(bits, &exp2);
            int sign = compare_exact(&dec, mantissa, exp2);
            if (sign) result = nextafter(result, sign > 0 ? (double)INFINITY : 0.0);
        }
    }
    *value = (float)(dec.negative ? -result : result);
    return after;
}

const char *tli_number_i64(const char *at, const char *end, int64_t *value)
{
    const char *p = tli_number_skip_space(at, end);
    bool negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) p++;
    const uint64_t limit = negative ? (uint64_t)1 << 63 : INT64_MAX;
    const char *digits = p;
    uint64_t w = 0;
    for (; p < end && is_digit(*p); p++) {
        unsigned digit = (unsigned)(*p - '0');
        if (w > (limit - digit) / 10) return NULL;
        w = w * 10 + digit;
    }
    if (p == digits || (p < end && is_word(*p))) return NULL;
    *value = negative ? (int64_t)(0 - w) : (int64_t)w;
    return p;
}
