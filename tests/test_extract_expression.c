/* Derived channels and expressions: linear fields whose derivatives are exact, formulas against the
 * same in C on random numbers, messages with their columns, failing memory. */
#include "check.h"

#include "tetralod/extract.h"

#include "check_ctx.h"
#include "fail_alloc.h"
#include "make_mesh.h"

enum { VERTS = 1000 }; /* of more than one block */

static double pressure(const double x[3])
{
    return 2 * x[0] - 3 * x[1] + 5 * x[2];
}

/* A grid with channels of random numbers: "p" and "q" scalars, "U" and "V" vectors, "odd.name",
 * "x" on vertices, "c" on tets; and "L", linear, [3]. */
typedef struct scene {
    make_mesh m;
    tl_mesh *mesh;
    double *p, *q, *u, *v, *c, *l;
} scene;

static const double MATRIX[9] = {1, 2, -3, 0.5, -4, 6, 7, -2, 9};

static double *add_random(tl_ctx *ctx, tl_mesh *mesh, const char *name, uint32_t components,
                          tl_on on, uint64_t seed)
{
    size_t count = on == TL_ON_VERTEX ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh);
    double *values = malloc(count * components * sizeof *values);
    for (size_t i = 0; i < count * components; i++) values[i] = 4 * make_uniform(&seed) - 2;
    tl_channel channel = {name, "", components, on, TL_F64, values};
    CHECK_OK(ctx, tl_mesh_add_channel(mesh, &channel));
    return values;
}

static scene make_scene(tl_ctx *ctx)
{
    scene s = {.m = make_grid(10)};
    make_perturb(&s.m, 0.05 / 10, 2);
    make_shuffle(&s.m, 4);
    s.mesh = make_object(ctx, &s.m, pressure);
    s.p = add_random(ctx, s.mesh, "p", 1, TL_ON_VERTEX, 1);
    s.q = add_random(ctx, s.mesh, "q", 1, TL_ON_VERTEX, 2);
    s.u = add_random(ctx, s.mesh, "U", 3, TL_ON_VERTEX, 3);
    s.v = add_random(ctx, s.mesh, "V", 3, TL_ON_VERTEX, 4);
    s.c = add_random(ctx, s.mesh, "c", 1, TL_ON_TET, 5);
    free(add_random(ctx, s.mesh, "odd.\"name", 1, TL_ON_VERTEX, 6));
    free(add_random(ctx, s.mesh, "x", 1, TL_ON_VERTEX, 7));
    s.l = malloc(3 * s.m.vert_count * sizeof *s.l);
    for (size_t v = 0; v < s.m.vert_count; v++)
        for (size_t i = 0; i < 3; i++) {
            s.l[3 * v + i] = (double)i;
            for (size_t k = 0; k < 3; k++) s.l[3 * v + i] += MATRIX[3 * i + k] * s.m.xyz[3 * v + k];
        }
    tl_channel linear = {"L", "m/s", 3, TL_ON_VERTEX, TL_F64, s.l};
    CHECK_OK(ctx, tl_mesh_add_channel(s.mesh, &linear));
    return s;
}

static void release_scene(scene *s)
{
    free(s->p);
    free(s->q);
    free(s->u);
    free(s->v);
    free(s->c);
    free(s->l);
    tl_mesh_destroy(s->mesh);
    make_release(&s->m);
}

/* ---- derived channels ---- */

static void derivatives_of_linear_fields(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    scene s = make_scene(ctx);
    const tl_channel *l = tl_mesh_channel_by_name(s.mesh, "L");
    double *out = malloc(9 * s.m.vert_count * sizeof *out), q = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            double sum = (MATRIX[3 * i + k] + MATRIX[3 * k + i]) / 2;
            double turn = (MATRIX[3 * i + k] - MATRIX[3 * k + i]) / 2;
            q += (turn * turn - sum * sum) / 2;
        }
    CHECK_OK(ctx, tl_derive(ctx, s.mesh, l, TL_DERIVED_GRADIENT, out));
    for (size_t i = 0; i < 9 * s.m.vert_count; i++) CHECK_NEAR(out[i], MATRIX[i % 9], 1e-11);
    CHECK_OK(ctx, tl_derive(ctx, s.mesh, l, TL_DERIVED_DIVERGENCE, out));
    for (size_t v = 0; v < s.m.vert_count; v++) CHECK_NEAR(out[v], 1 - 4 + 9, 1e-11);
    CHECK_OK(ctx, tl_derive(ctx, s.mesh, l, TL_DERIVED_VORTICITY, out));
    for (size_t v = 0; v < s.m.vert_count; v++) {
        CHECK_NEAR(out[3 * v], -2 - 6, 1e-11);
        CHECK_NEAR(out[3 * v + 1], -3 - 7, 1e-11);
        CHECK_NEAR(out[3 * v + 2], 0.5 - 2, 1e-11);
    }
    CHECK_OK(ctx, tl_derive(ctx, s.mesh, l, TL_DERIVED_Q, out));
    for (size_t v = 0; v < s.m.vert_count; v++) CHECK_NEAR(out[v], q, 1e-9);
    CHECK_OK(ctx, tl_derive(ctx, s.mesh, l, TL_DERIVED_MAGNITUDE, out));
    for (size_t v = 0; v < s.m.vert_count; v++) {
        const double *u = s.l + 3 * v;
        CHECK(out[v] == sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]));
    }
    CHECK_EQ(tl_derived_components(TL_DERIVED_Q, 2), 0);
    CHECK_EQ(tl_derived_components(TL_DERIVED_GRADIENT, 2), 6);
    CHECK_STATUS(tl_derive(ctx, s.mesh, tl_mesh_channel(s.mesh, 0), TL_DERIVED_VORTICITY, out),
                 TL_ERR_ARG);
    CHECK_STATUS(
        tl_derive(ctx, s.mesh, tl_mesh_channel_by_name(s.mesh, "c"), TL_DERIVED_GRADIENT, out),
        TL_ERR_ARG);
    free(out);
    release_scene(&s);
    check_ctx_destroy(ctx);
}

/* ---- formulas against C ---- */

/* The values of one element. */
typedef struct at {
    double p, q, u[3], v[3], x[3], l[3];
} at;

typedef struct formula {
    const char *text;
    uint32_t components;
    void (*c)(const at *a, double *out);
} formula;

#define FORMULA(name, value)                                                                       \
    static void name(const at *a, double *out)                                                     \
    {                                                                                              \
        double p = a->p, q = a->q;                                                                 \
        const double *u = a->u, *v = a->v, *x = a->x;                                              \
        (void)p, (void)q, (void)u, (void)v, (void)x;                                               \
        *out = (value);                                                                            \
    }
#define PI 3.14159265358979323846

FORMULA(f_sums, p + q * 2 - p / q)
FORMULA(f_left, p - q - 1)
FORMULA(f_power, -(p *p))
FORMULA(f_tower, pow(2, pow(3, 2)) + pow(fabs(q), -p))
FORMULA(f_signs, p - -q * -2)
FORMULA(f_functions, sqrt(fabs(p)) + exp(q) + log(q * q + 1) + log10(p * p + 1) + sin(p) * cos(q))
FORMULA(f_angles, tan(p) + atan2(p, q))
FORMULA(f_extremes, fmin(fmin(p, q), 0.5) + fmax(p, q))
FORMULA(f_pick, u[0] + u[1] * u[2] - v[2])
FORMULA(f_dot, u[0] * v[0] + u[1] * v[1] + u[2] * v[2])
FORMULA(f_mag, sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]))
FORMULA(f_if, p < q ? p : u[1])
FORMULA(f_logic, (p > 0 && q > 0) || !(p <= q) ? 1 : 0)
FORMULA(f_equal, (double)(p == p) + (double)(q != q) + (double)(p >= q))
FORMULA(f_place, x[0] * x[0] + x[1] * pow(x[2], 3) + PI)
FORMULA(f_numbers, 1.5e-3 * p + .5 + 2)
FORMULA(f_helicity, u[0] * -8.0 + u[1] * -10.0 + u[2] * -1.5)

static void f_cross(const at *a, double *out)
{
    for (int k = 0; k < 3; k++)
        out[k] = a->u[(k + 1) % 3] * a->v[(k + 2) % 3] - a->u[(k + 2) % 3] * a->v[(k + 1) % 3];
}

static void f_scaled(const at *a, double *out)
{
    for (int k = 0; k < 3; k++) out[k] = a->p * a->u[k] + a->v[k] / 2 - 1;
}

static void f_chosen(const at *a, double *out)
{
    for (int k = 0; k < 3; k++) out[k] = a->p > 0 ? a->u[k] : a->q;
}

static void f_other(const at *a, double *out)
{
    for (int k = 0; k < 3; k++) out[k] = a->p > 0 ? a->q : a->v[k];
}

static void f_norm(const at *a, double *out)
{
    double length = sqrt(a->u[0] * a->u[0] + a->u[1] * a->u[1] + a->u[2] * a->u[2]);
    for (int k = 0; k < 3; k++) out[k] = a->u[k] / length;
}

static void f_vec(const at *a, double *out)
{
    out[0] = a->x[1] * 2;
    out[1] = -a->x[0];
}

static void f_gradient(const at *a, double *out)
{
    (void)a;
    for (int i = 0; i < 9; i++) out[i] = 2 * MATRIX[i];
}

static const formula FORMULAS[] = {
    {"p + q * 2 - p / q", 1, f_sums},
    {"p-q-1", 1, f_left},
    {"-p^2", 1, f_power},
    {"2^3^2 + abs(q)^-p", 1, f_tower},
    {"p - -q*-2", 1, f_signs},
    {"sqrt(abs(p)) + exp(q) + log(q*q + 1) + log10(p*p + 1) + sin(p)*cos(q)", 1, f_functions},
    {"tan(p) + atan2(p, q)", 1, f_angles},
    {"min(p, q, .5) + max(p, q)", 1, f_extremes},
    {"U.x + U.y * U[ 2 ] - V.z", 1, f_pick},
    {"dot(U, V)", 1, f_dot},
    {"mag(U)", 1, f_mag},
    {"if(p < q, p, U[1])", 1, f_if},
    {"p > 0 && q > 0 || !(p <= q)", 1, f_logic},
    {"(p == p) + (q != q) + (p >= q)", 1, f_equal},
    {"x^2 + y * z^3 + pi", 1, f_place},
    {" 1.5e-3*p + .5 + 2. ", 1, f_numbers},
    {".15E-2*p+.5+2.", 1, f_numbers},
    {"2^3^2+abs(q)^-p", 1, f_tower},
    {"cross(U, V)", 3, f_cross},
    {"cross(V, U) * -1", 3, f_cross},
    {"p * U + V / 2 - 1", 3, f_scaled},
    {"if(p > 0, U, q)", 3, f_chosen},
    {"if(p > 0, q, V)", 3, f_other},
    {"norm(U)", 3, f_norm},
    {"vec(2 * y, -x)", 2, f_vec},
};
/* through gradients: near, not equal */
static const formula DERIVED[] = {
    {"grad(2 * L + 1)", 9, f_gradient},
    {"vec(1, 0, 0) * 0 + p * grad(f).x * U / 2 + V / 2 - 1", 3, f_scaled},
    {"dot(U, curl(L))", 1, f_helicity},
    {"U.x*div(vec(-8*x, z, x)) + U.y*div(grad(5*x^0 * 1 + 0*f)) - 10*U.y + U.z*-1.5", 1,
     f_helicity},
};

static void check_formula(tl_ctx *ctx, const scene *s, const formula *f, double tolerance)
{
    tl_expression *expression = NULL;
    tl_channel channel;
    CHECK_OK(ctx, tl_expression_parse(ctx, f->text, &expression));
    CHECK_OK(ctx, tl_expression_evaluate(ctx, expression, s->mesh, &channel));
    CHECK_EQ(channel.components, f->components);
    CHECK_EQ(channel.on, TL_ON_VERTEX);
    for (size_t v = 0; v < s->m.vert_count; v++) {
        double out[9];
        at a = {.p = s->p[v], .q = s->q[v]};
        memcpy(a.u, s->u + 3 * v, sizeof a.u);
        memcpy(a.v, s->v + 3 * v, sizeof a.v);
        memcpy(a.x, s->m.xyz + 3 * v, sizeof a.x);
        f->c(&a, out);
        for (size_t k = 0; k < f->components; k++) {
            double is = channel.values[f->components * v + k];
            if (!(fabs(is - out[k]) <= tolerance * (1 + fabs(out[k]))))
                fail_msg("%s: vertex %zu: %.17g, expected %.17g", f->text, v, is, out[k]);
        }
    }
    union {
        const double *in;
        void *out;
    } block = {channel.values};
    tl_mem_free(ctx, block.out);
    tl_expression_destroy(ctx, expression);
}

static void formulas_are_those_of_c(void **state)
{
    (void)state;
    for (unsigned threads = 1; threads <= 2; threads++) {
        tl_ctx *ctx = check_ctx_create(threads);
        scene s = make_scene(ctx);
        CHECK_EQ(s.m.vert_count, VERTS);
        for (size_t i = 0; i < sizeof FORMULAS / sizeof *FORMULAS; i++)
            check_formula(ctx, &s, &FORMULAS[i], 4e-16); /* pow of 2 may differ in the last bit */
        for (size_t i = 0; i < sizeof DERIVED / sizeof *DERIVED; i++)
            check_formula(ctx, &s, &DERIVED[i], 1e-10);
        release_scene(&s);
        check_ctx_destroy(ctx);
    }
}

/* Names in quotes, on tets, that are taken. */
static void names_and_places(void **state)
{
    (void)state;
    tl_ctx *ctx = check_ctx_create(2);
    scene s = make_scene(ctx);
    CHECK_OK(ctx, tl_mesh_derive(ctx, s.mesh, "twice", "2 * 'odd.\"name'"));
    CHECK_OK(ctx, tl_mesh_derive(ctx, s.mesh, "again", "twice - \"odd.\"\"name\" - 'x' + x"));
    CHECK_OK(ctx, tl_mesh_derive(ctx, s.mesh, "on tets", "c + 100 * x"));
    const double *odd = tl_mesh_channel_by_name(s.mesh, "odd.\"name")->values;
    const double *x = tl_mesh_channel_by_name(s.mesh, "x")->values;
    const tl_channel *again = tl_mesh_channel_by_name(s.mesh, "again");
    const tl_channel *tets = tl_mesh_channel_by_name(s.mesh, "on tets");
    for (size_t v = 0; v < s.m.vert_count; v++)
        CHECK(again->values[v] == 2 * odd[v] - odd[v] - x[v] + s.m.xyz[3 * v]);
    CHECK_EQ(tets->on, TL_ON_TET);
    for (size_t t = 0; t < s.m.tet_count; t++) {
        double sum = 0;
        for (size_t i = 0; i < 4; i++) sum += s.m.xyz[3 * (size_t)s.m.tets[4 * t + i]];
        CHECK(tets->values[t] == s.c[t] + 100 * (sum / 4));
    }
    CHECK_STATUS(tl_mesh_derive(ctx, s.mesh, "p", "1"), TL_ERR_ARG);
    CHECK_OK(ctx, tl_mesh_derive(ctx, s.mesh, "one", "1"));
    CHECK_EQ(tl_mesh_channel_by_name(s.mesh, "one")->on, TL_ON_VERTEX);
    release_scene(&s);
    check_ctx_destroy(ctx);
}

/* ---- messages ---- */

static void messages_name_the_column(void **state)
{
    (void)state;
    static const struct {
        const char *text, *said;
    } wrong[] = {
        {"", "column 1: expected a number, a name or '(', not the end"},
        {"p +", "column 4: expected a number"},
        {"p + )", "column 5: expected a number"},
        {"(p", "column 3: expected an operator or ')', not the end"},
        {"p q", "column 3: expected an operator or the end"},
        {"2e + 1", "column 1: expected a number, and an operator"},
        {"2.5.1", "column 5: expected .x, .y or .z"},
        {". + 1", "column 1: expected a number, and an operator"},
        {"2p", "column 1: expected a number, and an operator"},
        {"p $ 1", "column 3: expected an operator"},
        {"sinus(p)", "column 1: there is no function 'sinus'"},
        {"1 + atan2(p)", "column 5: atan2() takes 2 arguments, not 1"},
        {"min(p)", "column 1: min() takes 2 arguments or more, not 1"},
        {"U.w", "column 3: expected .x, .y or .z"},
        {"U[-1]", "column 3: expected the number of a component"},
        {"U[1", "column 4: expected ']'"},
        {"'p", "column 1: a quote without its end"},
        {"1 < p < 2", "column 7: comparisons of comparisons"},
        {"gr\xc3\xb6\xc3\x9f"
         "e + + ",
         "column 11: expected a number"},
        /* that only a mesh tells */
        {"p + heat", "column 5: there is no channel 'heat'"},
        {"p + c", "column 5: 'c' stands on tets, 'p' on vertices"},
        {"U[3]", "column 2: component 3 of 3"},
        {"p.y", "column 2: component 1 of 1"},
        {"1 + U * grad(L)", "column 7: 3 and 9 components don't fit"},
        {"cross(p, U)", "column 1: cross() takes"},
        {"dot(p, U)", "column 1: dot() takes"},
        {"div(p)", "column 1: takes a vector of 3 components, not of 1"},
        {"grad(c)", "column 1: gradients are taken on vertices"},
        {"if(U, 1, 2)", "column 1: the condition"},
        {"vec(p, U)", "column 1: vec() takes scalars"},
    };
    tl_ctx *ctx = check_ctx_create(1);
    scene s = make_scene(ctx);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        tl_status st = tl_mesh_derive(ctx, s.mesh, "out", wrong[i].text);
        if (st != TL_ERR_ARG || !strstr(tl_ctx_message(ctx), wrong[i].said))
            fail_msg("'%s' gave \"%s\"", wrong[i].text, tl_ctx_message(ctx));
        tl_ctx_clear(ctx);
    }
    char deep[5000];
    memset(deep, '(', sizeof deep);
    deep[1000] = 0;
    CHECK_STATUS(tl_mesh_derive(ctx, s.mesh, "deep", deep), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "within each other"));
    memset(deep, '-', sizeof deep);
    deep[sizeof deep - 1] = 0;
    CHECK_STATUS(tl_mesh_derive(ctx, s.mesh, "long", deep), TL_ERR_ARG);
    CHECK(strstr(tl_ctx_message(ctx), "4999 bytes"));
    release_scene(&s);
    check_ctx_destroy(ctx);
}

static tl_status derive_some(tl_ctx *ctx, void *arg)
{
    tl_expression *expression = NULL;
    tl_channel channel = {.values = NULL};
    tl_status st = tl_expression_parse(
        ctx, "p * curl(U + grad(q * 'p')) + if(p > 0, 1, 2) * qcriterion(V)", &expression);
    if (!st) st = tl_expression_evaluate(ctx, expression, arg, &channel);
    union {
        const double *in;
        void *out;
    } block = {channel.values};
    tl_mem_free(ctx, block.out);
    tl_expression_destroy(ctx, expression);
    return st;
}

static void failing_memory_leaks_nothing(void **state)
{
    (void)state;
    fail_alloc f;
    tl_ctx *ctx = check_ctx_create(1);
    scene s = make_scene(ctx);
    fail_alloc_open(&f, 1);
    CHECK(fail_alloc_each(&f, derive_some, s.mesh) > 30);
    fail_alloc_close(&f);
    release_scene(&s);
    check_ctx_destroy(ctx);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_of_linear_fields),
        cmocka_unit_test(formulas_are_those_of_c),
        cmocka_unit_test(names_and_places),
        cmocka_unit_test(messages_name_the_column),
        cmocka_unit_test(failing_memory_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
