/* Text to numbers: against the C library's strtod and strtof in the C locale, on all bit patterns'
 * neighbourhoods where rounding is hard, and on text that is no number. */
#include "check.h"

#include "formats/formats_number.h"

#include <float.h>

static uint64_t random_state = 0x9e3779b97f4a7c15u;

static uint64_t random_u64(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return random_state;
}

static uint64_t bits_f64(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static uint32_t bits_f32(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* Both readers on one text, which must be a number from end to end. */
static void check_number(const char *text)
{
    size_t length = strlen(text);
    char *copy =
        malloc(length ? length : 1); /* without a zero, so that a sanitizer sees an overrun */
    memcpy(copy, text, length);
    double wide = -1;
    float narrow = -1;
    const char *after_wide = tli_number_f64(copy, copy + length, &wide);
    const char *after_narrow = tli_number_f32(copy, copy + length, &narrow);
    bool ends = after_wide == copy + length && after_narrow == copy + length;
    free(copy);
    if (!ends) fail_msg("'%s' was not read to its end", text);
    double expected = strtod(text, NULL);
    float expected_f32 = strtof(text, NULL);
    if (isnan(expected) ? !isnan(wide) : bits_f64(wide) != bits_f64(expected))
        fail_msg("'%s' is %.17g, expected %.17g", text, wide, expected);
    if (isnan(expected_f32) ? !isnan(narrow) : bits_f32(narrow) != bits_f32(expected_f32))
        fail_msg("'%s' is %.9g, expected %.9g as float", text, (double)narrow,
                 (double)expected_f32);
}

static void reads_plain_numbers(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "0",
        "-0",
        "+0",
        "1",
        "-1",
        "0.1",
        ".5",
        "5.",
        "1e5",
        "1E+5",
        "1e-5",
        "00012.500",
        "123456789012345678",
        "9007199254740992",
        "9007199254740993",
        "9007199254740995",
        "-9007199254740993",
        "1e22",
        "1e23",
        "18446744073709551615",
        "18446744073709551616",
        "99999999999999999999999999",
        "0.000000000000000000000",
        "4.9e-324",
        "2.4703282292062327e-324",
        "2.4703282292062328e-324",
        "2.2250738585072014e-308",
        "2.2250738585072011e-308",
        "1.7976931348623157e308",
        "1.7976931348623158e308",
        "1.7976931348623159e308",
        "1e309",
        "1e999999999999999999999",
        "-1e400",
        "1e-400",
        "-1e-400",
        "0e999999999999",
        "1e-999999999999",
        "3.4028234663852886e38",
        "3.4028235677973366e38",
        "3.4028235677973365e38",
        "1.401298464324817e-45",
        "7.006492321624085e-46",
        "7.006492321624086e-46",
        "1.1754943508222875e-38",
        "nan",
        "NaN",
        "-NAN",
        "inf",
        "-Inf",
        "INFINITY",
        "+infinity",
        "nan(0x12)",
        "179769313486231580793728971405303415079934132710037826936173778980444968292764750946649017"
        "977587207096"
        "330286416692887910946555547851940402630657488671505820681908902000708383676273854845817711"
        "531764475730"
        "270069855571366959622842914819860834936475292719074168444365510704342711559699508093042880"
        "1779041744977"
        "91.999999999999999999999999999999999999999999999999999999999999",
        "0."
        "000000000000000000000000000000000000011754943508222875079687365372222456778186655567720875"
        "215087517"
        "062784172594547271728515625",
        "1.00000017881393432617187499",
        "1.000000178813934326171875",
        "1.00000017881393432617187501",
        "8.5070591730234615865843651857942052864e37"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) check_number(texts[i]);
}

/* Doubles of all sizes, printed with 1 to 25 digits. */
static void agrees_with_strtod(void **state)
{
    (void)state;
    char text[64];
    for (int i = 0; i < 300000; i++) {
        uint64_t bits = random_u64();
        double value;
        memcpy(&value, &bits, sizeof value);
        if (!isfinite(value)) continue;
        if (i % 2) value = ldexp(1 + (double)(bits >> 12) * 0x1p-52, (int)(bits % 80) - 40);
        snprintf(text, sizeof text, "%.*e", (int)(random_u64() % 25), value);
        check_number(text);
        snprintf(text, sizeof text, "%.17g", value);
        check_number(text);
        snprintf(text, sizeof text, "%.9g", (double)(float)value);
        check_number(text);
    }
}

/* The exact decimal expansion of a midpoint, one below and one above in the last place. */
static void rounds_midpoints_to_even(void **state)
{
    (void)state;
    static char text[2000];
    for (int i = 0; i < 3000; i++) {
        uint64_t bits = random_u64() >> 1;
        if (i % 3 == 1) bits &= 0x001fffffffffffffu; /* subnormal and just above */
        bool narrow = i % 3 == 2;
        double value, next;
        memcpy(&value, &bits, sizeof value);
        if (!isfinite(value)) continue;
        long double middle;
        if (narrow) {
            float f = (float)ldexp(1 + (double)(bits >> 12) * 0x1p-52, (int)(bits % 270) - 148);
            middle = ((long double)f + (long double)nextafterf(f, INFINITY)) / 2;
        } else {
            next = nextafter(value, (double)INFINITY);
            middle = ((long double)value + (long double)next) / 2;
        }
        int length = snprintf(text, sizeof text, "%.1100Lf", middle);
        while (text[length - 1] == '0') text[--length] = 0;
        if (text[length - 1] == '.') continue;
        check_number(text);
        text[length - 1]--;
        strcpy(text + length, "99");
        check_number(text);
        text[length - 1]++;
        strcpy(text + length, "0000000001");
        check_number(text);
    }
}

static void refuses_what_is_no_number(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "",     " ",   "-",   "+",  ".",    "-.", "e5",      "1e",  "1e+", "1x",   "1.2.3",
        "0x10", "1_0", "--1", "na", "nanx", "in", "infinit", "1-2", "abc", "\xff", "nan(1"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        double value = 7;
        float narrow = 7;
        const char *end = texts[i] + strlen(texts[i]);
        const char *after = tli_number_f64(texts[i], end, &value);
        /* "nan(1" is a nan and something that follows it */
        if (!strcmp(texts[i], "nan(1")) {
            CHECK_EQ(after - texts[i], 3);
            continue;
        }
        if (after) fail_msg("'%s' was taken as %g", texts[i], value);
        CHECK(value == 7);
        CHECK(!tli_number_f32(texts[i], end, &narrow) && narrow == 7);
    }
}

static void reads_one_after_the_other(void **state)
{
    (void)state;
    const char text[] = "  1.5\t-2e1\r\n 3d2,4";
    const char *end = text + sizeof text - 1, *at = text;
    double values[4];
    for (int i = 0; i < 3; i++) {
        at = tli_number_f64(at, end, &values[i]);
        CHECK(at != NULL);
    }
    CHECK(values[0] == 1.5 && values[1] == -20 && values[2] == 300);
    CHECK_EQ(*at, ',');
    CHECK(tli_number_f64(at, end, &values[3]) == NULL);
    CHECK(tli_number_f64(at + 1, end, &values[3]) == end);
}

static void reads_integers(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int64_t value;
        bool ok;
    } cases[] = {{"0", 0, true},
                 {"-0", 0, true},
                 {"+12", 12, true},
                 {" \n42", 42, true},
                 {"9223372036854775807", INT64_MAX, true},
                 {"-9223372036854775808", INT64_MIN, true},
                 {"9223372036854775808", 0, false},
                 {"-9223372036854775809", 0, false},
                 {"99999999999999999999", 0, false},
                 {"00000000000000000000000000017", 17, true},
                 {"", 0, false},
                 {"-", 0, false},
                 {"1.5", 0, false},
                 {"1e3", 0, false},
                 {"12x", 0, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        int64_t value = 0;
        const char *end = cases[i].text + strlen(cases[i].text);
        const char *after = tli_number_i64(cases[i].text, end, &value);
        if ((after == end && *cases[i].text) != cases[i].ok || value != cases[i].value)
            fail_msg("'%s' is %lld", cases[i].text, (long long)value);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_plain_numbers),       cmocka_unit_test(agrees_with_strtod),
        cmocka_unit_test(rounds_midpoints_to_even),  cmocka_unit_test(refuses_what_is_no_number),
        cmocka_unit_test(reads_one_after_the_other), cmocka_unit_test(reads_integers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
