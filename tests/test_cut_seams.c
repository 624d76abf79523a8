/* Neighbours across patches against the adjacency of the whole mesh, while patches come and go; the
 * table of keys under random use. */
#include "check.h"

#include "cut/cut_keys.h"
#include "tetralod/cut.h"

#include "fail_alloc.h"
#include "make_pieces.h"

/* Number under which a piece is added. */
static uint32_t number_of(uint32_t index)
{
    return 1000 + 7 * index;
}

static void check_neighbours(const pieces *p, const tl_seams *seams, const bool there[PIECES])
{
    for (size_t t = 0; t < p->whole.tet_count; t++) {
        uint32_t own = p->piece_of[t];
        for (uint32_t i = 0; i < 4; i++) {
            uint32_t number = 0, face = 0;
            tl_lidx behind = p->opposite[4 * t + i];
            bool found =
                tl_seams_behind(seams, number_of(own), 4 * p->local[t] + i, &number, &face);
            bool expected = there[own] && behind != TL_NONE && there[p->piece_of[behind / 4]];
            CHECK_EQ(found, expected);
            if (!found) continue;
            CHECK_EQ(number, number_of(p->piece_of[behind / 4]));
            CHECK_EQ(face, 4 * p->local[behind / 4] + behind % 4);
        }
    }
}

/* Vertices have one number in all patches that are there, and no two of them the same. */
static void check_verts(const pieces *p, const tl_seams *seams, const bool there[PIECES])
{
    size_t pairs = 0, patches = 0;
    uint32_t end = 0, other_end = 0;
    for (uint32_t i = 0; i < PIECES; i++) {
        const tl_patch *a = &p->list[i].patch;
        const uint32_t *own = tl_seams_verts(seams, number_of(i), &end);
        CHECK_EQ(own != NULL, there[i]);
        patches += there[i];
        for (uint32_t v = 0; own && v < a->vert_count; v++) {
            CHECK_EQ(own[v] != TL_NONE, a->shared[v]);
            CHECK(own[v] == TL_NONE || own[v] < end);
        }
        for (uint32_t j = 0; own && j < i; j++) {
            const tl_patch *b = &p->list[j].patch;
            const uint32_t *others = tl_seams_verts(seams, number_of(j), &other_end);
            for (uint32_t v = 0; others && v < a->vert_count; v++)
                for (uint32_t w = 0; a->shared[v] && w < b->vert_count; w++) {
                    if (!b->shared[w]) continue;
                    bool same = !memcmp(a->places[v], b->places[w], sizeof a->places[v]);
                    CHECK_EQ(same, own[v] == others[w]);
                    pairs += same;
                }
        }
    }
    CHECK(pairs > 0 || patches < PIECES);
}

static void test_neighbours(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    tl_seams *seams = NULL;
    pieces p;
    bool there[PIECES] = {false};
    uint64_t seed = 4;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    make_pieces(ctx, &p);
    CHECK_OK(ctx, tl_seams_create(ctx, &seams));
    for (int round = 0; round < 60; round++) {
        uint32_t i = (uint32_t)(make_random(&seed) % PIECES);
        if (there[i])
            CHECK_OK(ctx, tl_seams_remove(seams, number_of(i)));
        else
            CHECK_OK(ctx, tl_seams_add(seams, number_of(i), &p.list[i].patch));
        there[i] = !there[i];
        check_neighbours(&p, seams, there);
        if (round % 4 == 0) check_verts(&p, seams, there);
    }
    CHECK_STATUS(tl_seams_remove(seams, 1), TL_ERR_ARG);
    tl_seams_destroy(seams);
    drop_pieces(ctx, &p);
    tl_ctx_destroy(ctx);
}

/* A patch may come before the one it replaces goes: three sides at a face for a while. */
static void test_exchange(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    tl_seams *seams = NULL;
    pieces p;
    bool there[PIECES];
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    make_pieces(ctx, &p);
    CHECK_OK(ctx, tl_seams_create(ctx, &seams));
    CHECK_OK(ctx, tl_seams_add(seams, 5, &p.list[4].patch));
    for (uint32_t i = 0; i < PIECES; i++) {
        there[i] = true;
        CHECK_OK(ctx, tl_seams_add(seams, number_of(i), &p.list[i].patch));
    }
    CHECK_STATUS(tl_seams_add(seams, 5, &p.list[4].patch), TL_ERR_ARG);
    CHECK_OK(ctx, tl_seams_remove(seams, 5));
    check_neighbours(&p, seams, there);
    check_verts(&p, seams, there);
    tl_seams_destroy(seams);
    drop_pieces(ctx, &p);
    tl_ctx_destroy(ctx);
}

static tl_status add_two(tl_ctx *ctx, void *arg)
{
    pieces *p = arg;
    tl_seams *seams = NULL;
    tl_status st = tl_seams_create(ctx, &seams);
    if (!st) st = tl_seams_add(seams, 1, &p->list[0].patch);
    if (!st) st = tl_seams_add(seams, 2, &p->list[1].patch);
    tl_seams_destroy(seams);
    return st;
}

static void test_failing_memory(void **state)
{
    (void)state;
    tl_ctx *ctx = NULL;
    fail_alloc f;
    pieces p;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    make_pieces(ctx, &p);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, add_two, &p) > 10);
    fail_alloc_close(&f);
    drop_pieces(ctx, &p);
    tl_ctx_destroy(ctx);
}

/* Keys taken and dropped at random, against a plain list of counts. */
static void test_keys(void **state)
{
    (void)state;
    enum { KINDS = 300 };
    tl_ctx *ctx = NULL;
    tli_keys keys;
    uint32_t uses[KINDS] = {0}, numbers[KINDS];
    uint64_t seed = 1;
    CHECK_STATUS(tl_ctx_create(NULL, &ctx), TL_OK);
    CHECK_OK(ctx, tli_keys_open(ctx, 0, &keys));
    for (int i = 0; i < 100000; i++) {
        uint32_t k = (uint32_t)(make_random(&seed) % KINDS);
        const int64_t part[3] = {k / 10, -(int64_t)(k % 10), k % 3};
        bool take = make_random(&seed) % 1000 < (i / 10000 % 2 ? 300u : 700u);
        uint32_t found = tli_keys_find(&keys, part, k / 7);
        CHECK_EQ(found != TL_NONE, uses[k] > 0);
        if (found != TL_NONE) CHECK_EQ(found, numbers[k]);
        if (take) {
            CHECK_OK(ctx, tli_keys_take(&keys, part, k / 7, &found));
            if (uses[k]++) CHECK_EQ(found, numbers[k]);
            numbers[k] = found;
        } else if (uses[k]) {
            CHECK_EQ(tli_keys_drop(&keys, numbers[k]), --uses[k] == 0);
        }
    }
    tli_keys_close(&keys);
    CHECK_EQ(tl_ctx_current_bytes(ctx), 0);
    tl_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_neighbours),
        cmocka_unit_test(test_exchange),
        cmocka_unit_test(test_failing_memory),
        cmocka_unit_test(test_keys),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
