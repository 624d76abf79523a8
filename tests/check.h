/* Checks that stay on in every build and print both sides. Include before anything of cmocka. */
#ifndef TETRALOD_TESTS_CHECK_H
#define TETRALOD_TESTS_CHECK_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define CHECK(condition)                                                                           \
    do {                                                                                           \
        if (!(condition)) fail_msg("%s:%d: not true: %s", __FILE__, __LINE__, #condition);         \
    } while (0)

#define CHECK_EQ(actual, expected)                                                                 \
    do {                                                                                           \
        long long check_a = (long long)(actual), check_e = (long long)(expected);                  \
        if (check_a != check_e)                                                                    \
            fail_msg("%s:%d: %s is %lld, expected %lld", __FILE__, __LINE__, #actual, check_a,     \
                     check_e);                                                                     \
    } while (0)

#define CHECK_NEAR(actual, expected, tolerance)                                                    \
    do {                                                                                           \
        double check_a = (actual), check_e = (expected), check_t = (tolerance);                    \
        if (!(fabs(check_a - check_e) <= check_t))                                                 \
            fail_msg("%s:%d: %s is %.17g, expected %.17g within %g", __FILE__, __LINE__, #actual,  \
                     check_a, check_e, check_t);                                                   \
    } while (0)

/* A promise beside what was measured. */
#define CHECK_BOUND(what, measured, promised)                                                      \
    do {                                                                                           \
        double check_m = (measured), check_p = (promised);                                         \
        printf("%s %.6g <= %.6g %s\n", what, check_m, check_p,                                     \
               check_m <= check_p ? "ok" : "BROKEN");                                              \
        if (!(check_m <= check_p)) fail_msg("%s:%d: the bound is broken", __FILE__, __LINE__);     \
    } while (0)

#define CHECK_OK(ctx, call)                                                                        \
    do {                                                                                           \
        tl_status check_s = (call);                                                                \
        if (check_s)                                                                               \
            fail_msg("%s:%d: %s: %s: %s", __FILE__, __LINE__, #call, tl_status_name(check_s),      \
                     tl_ctx_message(ctx));                                                         \
    } while (0)

#define CHECK_STATUS(call, expected)                                                               \
    do {                                                                                           \
        tl_status check_s = (call);                                                                \
        if (check_s != (expected))                                                                 \
            fail_msg("%s:%d: %s gave \"%s\", expected \"%s\"", __FILE__, __LINE__, #call,          \
                     tl_status_name(check_s), tl_status_name(expected));                           \
    } while (0)

/* Ends the running case as skipped. why is a printf format with its arguments; the line is what the
 * summary of a test run shows. */
#define CHECK_SKIP(...)                                                                            \
    do {                                                                                           \
        printf("skipped: %s: ", __func__);                                                         \
        printf(__VA_ARGS__);                                                                       \
        printf("\n");                                                                              \
        skip();                                                                                    \
    } while (0)

#endif
