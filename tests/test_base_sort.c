/* Radix sorts against qsort, with any number of threads; Hilbert order on grids, where each step
 * must go to a neighbour, and on points that are no numbers. */
#include "check.h"
#include "check_ctx.h"

#include "check_alloc.h"

#include "base/base_sort.h"

#define COUNT_MAX ((size_t)200000)

static uint64_t random_state = 0x9e3779b97f4a7c15u;

static uint64_t random_u64(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return random_state;
}

static const unsigned thread_counts[] = {1, 2, 5};

typedef enum fill {
    FILL_RANDOM,
    FILL_SMALL,  /* few different keys: stability shows */
    FILL_MIDDLE, /* only bits 13 to 29 differ */
    FILL_ENDS,   /* only the lowest and the highest bit differ */
    FILL_EQUAL,
    FILL_RISING,
    FILL_FALLING,
    FILL_COUNT
} fill;

static uint64_t key_of(fill f, size_t i)
{
    switch (f) {
    case FILL_RANDOM: return random_u64();
    case FILL_SMALL: return random_u64() % 7;
    case FILL_MIDDLE: return (random_u64() & 0x3fffe000) | 0x8000000000001001;
    case FILL_ENDS: return (random_u64() & 0x8000000080000001) | 0x1230;
    case FILL_RISING: return i * 3;
    case FILL_FALLING: return (COUNT_MAX - i) * 5;
    default: return 0x123456789abcdef0;
    }
}

typedef struct pair {
    uint64_t key;
    uint32_t value; /* in the input: the index, so that the order of pairs is total */
} pair;

static int compare_pairs(const void *a, const void *b)
{
    const pair *p = a, *q = b;
    if (p->key != q->key) return p->key < q->key ? -1 : 1;
    return p->value < q->value ? -1 : p->value > q->value;
}

typedef struct arrays {
    pair *expected;
    uint64_t *keys64, *input;
    uint32_t *keys32, *values;
} arrays;

static void check_sort_64(tl_ctx *ctx, arrays *a, size_t count)
{
    for (size_t i = 0; i < count; i++) a->expected[i] = (pair){a->input[i], (uint32_t)i};
    qsort(a->expected, count, sizeof(pair), compare_pairs);
    for (int with_values = 0; with_values < 2; with_values++) {
        for (size_t i = 0; i < count; i++) a->values[i] = (uint32_t)i;
        memcpy(a->keys64, a->input, count * sizeof *a->keys64);
        CHECK_OK(ctx, tli_sort_u64(ctx, a->keys64, with_values ? a->values : NULL, count));
        for (size_t i = 0; i < count; i++) {
            CHECK(a->keys64[i] == a->expected[i].key);
            CHECK_EQ(a->values[i], with_values ? a->expected[i].value : i);
        }
    }
}

static void check_sort_32(tl_ctx *ctx, arrays *a, size_t count)
{
    for (size_t i = 0; i < count; i++) a->expected[i] = (pair){(uint32_t)a->input[i], (uint32_t)i};
    qsort(a->expected, count, sizeof(pair), compare_pairs);
    for (int with_values = 0; with_values < 2; with_values++) {
        for (size_t i = 0; i < count; i++) {
            a->values[i] = (uint32_t)i;
            a->keys32[i] = (uint32_t)a->input[i];
        }
        CHECK_OK(ctx, tli_sort_u32(ctx, a->keys32, with_values ? a->values : NULL, count));
        for (size_t i = 0; i < count; i++) {
            CHECK_EQ(a->keys32[i], a->expected[i].key);
            CHECK_EQ(a->values[i], with_values ? a->expected[i].value : i);
        }
    }
}

static void test_agrees_with_qsort(void **state)
{
    (void)state;
    const size_t counts[] = {0, 1, 2, 3, 24, 25, 100, 16384, 16385, COUNT_MAX};
    arrays a = {malloc(COUNT_MAX * sizeof(pair)), malloc(COUNT_MAX * 8), malloc(COUNT_MAX * 8),
                malloc(COUNT_MAX * 4), malloc(COUNT_MAX * 4)};
    CHECK(a.expected && a.keys64 && a.input && a.keys32 && a.values);
    for (size_t t = 0; t < 3; t++) {
        tl_ctx *ctx = check_ctx_create(thread_counts[t]);
        for (fill f = 0; f < FILL_COUNT; f++)
            for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
                for (size_t i = 0; i < counts[c]; i++) a.input[i] = key_of(f, i);
                check_sort_64(ctx, &a, counts[c]);
                check_sort_32(ctx, &a, counts[c]);
            }
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
    }
    free(a.expected), free(a.keys64), free(a.input), free(a.keys32), free(a.values);
}

/* Each allocation fails once; nothing leaks and the keys are still the same set. */
static void test_without_memory(void **state)
{
    (void)state;
    enum { COUNT = 30000 };
    static double xyz[COUNT][3];
    static uint32_t order[COUNT];
    for (size_t i = 0; i < 3 * COUNT; i++) xyz[i / 3][i % 3] = (double)(random_u64() % 1000);
    tl_status st = TL_ERR_MEMORY;
    unsigned long long n = 0;
    while (st) {
        check_alloc alloc = {0};
        tl_ctx_opts opts = tl_ctx_opts_defaults();
        opts.thread_count = 2;
        opts.resize = check_alloc_resize;
        opts.user = &alloc;
        tl_ctx *ctx = NULL;
        CHECK_STATUS(tl_ctx_create(&opts, &ctx), TL_OK);
        alloc.fail_at = alloc.requests + ++n;
        st = tli_sort_hilbert(ctx, xyz[0], COUNT, order);
        if (st) CHECK_STATUS(st, TL_ERR_MEMORY);
        CHECK(!st || strlen(tl_ctx_message(ctx)) > 0);
        CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
        tl_ctx_destroy(ctx);
        CHECK_EQ(alloc.live_blocks, 0);
    }
    CHECK(n > 5);
}

/* ---- Hilbert order ---- */

static double step_length(const double *p, const double *q)
{
    return fabs(p[0] - q[0]) + fabs(p[1] - q[1]) + fabs(p[2] - q[2]);
}

static void check_permutation(const uint32_t *order, size_t count)
{
    uint8_t *seen = calloc(count ? count : 1, 1);
    for (size_t i = 0; i < count; i++) {
        CHECK(order[i] < count);
        CHECK(!seen[order[i]]);
        seen[order[i]] = 1;
    }
    free(seen);
}

/* Points of a full grid of 2^n a side, shuffled, shifted, scaled: the curve visits neighbours. */
static void test_hilbert_steps_to_neighbours(void **state)
{
    (void)state;
    enum { SIDE = 32, COUNT = SIDE * SIDE * SIDE };
    double(*xyz)[3] = malloc(COUNT * sizeof *xyz);
    uint32_t *order = malloc(COUNT * sizeof *order), *again = malloc(COUNT * sizeof *again);
    const double scales[] = {1, 1e-6, 1e6}, shifts[] = {0, 1e6, -3};
    for (size_t t = 0; t < 3; t++) {
        tl_ctx *ctx = check_ctx_create(thread_counts[t]);
        for (size_t i = 0; i < COUNT; i++) {
            size_t cell = i * 20011 % COUNT; /* odd, so a permutation */
            xyz[i][0] = scales[t] * ((double)(cell % SIDE) + shifts[t]);
            xyz[i][1] = scales[t] * ((double)(cell / SIDE % SIDE) + shifts[t]);
            xyz[i][2] = scales[t] * ((double)(cell / SIDE / SIDE) + shifts[t]);
        }
        CHECK_OK(ctx, tli_sort_hilbert(ctx, xyz[0], COUNT, order));
        check_permutation(order, COUNT);
        double longest = 0;
        for (size_t i = 1; i < COUNT; i++)
            longest = fmax(longest, step_length(xyz[order[i]], xyz[order[i - 1]]));
        CHECK_BOUND("longest step in cells", longest / scales[t], 1.0 + 1e-3);
        tl_ctx_destroy(ctx);

        ctx = check_ctx_create(1);
        CHECK_OK(ctx, tli_sort_hilbert(ctx, xyz[0], COUNT, again));
        CHECK(memcmp(order, again, COUNT * sizeof *order) == 0);
        tl_ctx_destroy(ctx);
    }
    free(again), free(order), free(xyz);
}

static void test_hilbert_odd_input(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    const double odd[][3] = {{(double)NAN, 0, 0},
                             {1e308, 1e308, -1e308},
                             {0, HUGE_VAL, 0},
                             {-1e308, -1e308, 1e308},
                             {0, 0, -HUGE_VAL},
                             {0, 0, 0},
                             {0, 0, 0}};
    uint32_t order[7];
    CHECK_OK(ctx, tli_sort_hilbert(ctx, odd[0], 7, order));
    check_permutation(order, 7);
    CHECK_EQ(order[4], 0);
    CHECK_EQ(order[5], 2);
    CHECK_EQ(order[6], 4);
    for (size_t i = 1; i < 4; i++) /* equal points stand together, by index */
        if (order[i] == 6) CHECK_EQ(order[i - 1], 5);

    const double same[][3] = {{5, 5, 5}, {5, 5, 5}, {5, 5, 5}},
                 tiny[][3] = {{0, 0, 0}, {5e-324, 0, 0}};
    CHECK_OK(ctx, tli_sort_hilbert(ctx, same[0], 3, order));
    for (uint32_t i = 0; i < 3; i++) CHECK_EQ(order[i], i);
    CHECK_OK(ctx, tli_sort_hilbert(ctx, tiny[0], 2, order));
    check_permutation(order, 2);
    CHECK_OK(ctx, tli_sort_hilbert(ctx, odd[0], 1, order)); /* no finite point at all */
    CHECK_EQ(order[0], 0);
    CHECK_OK(ctx, tli_sort_hilbert(ctx, NULL, 0, order));
    tl_ctx_destroy(ctx);
}

static void test_prints_times(void **state)
{
    (void)state;
    enum { COUNT = 1 << 20 };
    tl_ctx *ctx = check_ctx_create(1);
    double(*xyz)[3] = malloc(COUNT * sizeof *xyz);
    uint32_t *order = malloc(COUNT * sizeof *order);
    uint64_t *keys = malloc(COUNT * sizeof *keys);
    double best_order = HUGE_VAL, best_sort = HUGE_VAL;
    for (size_t i = 0; i < COUNT * (size_t)3; i++) xyz[i / 3][i % 3] = (double)random_u64();
    for (int run = 0; run < 4; run++) {
        double start = tli_clock_s();
        CHECK_OK(ctx, tli_sort_hilbert(ctx, xyz[0], COUNT, order));
        best_order = fmin(best_order, tli_clock_s() - start);
        for (size_t i = 0; i < COUNT; i++) keys[i] = random_u64();
        start = tli_clock_s();
        CHECK_OK(ctx, tli_sort_u64(ctx, keys, order, COUNT));
        best_sort = fmin(best_sort, tli_clock_s() - start);
        for (size_t i = 1; i < COUNT; i++) CHECK(keys[i - 1] <= keys[i]);
    }
    printf("1 thread, 2^20 random: Hilbert order %.1f ms, 64-bit keys with values %.1f ms\n",
           1e3 * best_order, 1e3 * best_sort);
    free(keys), free(order), free(xyz);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_agrees_with_qsort),
        cmocka_unit_test(test_without_memory),
        cmocka_unit_test(test_hilbert_steps_to_neighbours),
        cmocka_unit_test(test_hilbert_odd_input),
        cmocka_unit_test(test_prints_times),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
