/* Where the vertices of the finest level may lie: a lattice over the whole data set, of which each
 * vertex has a step, a power of two. Steps are as large as the bound on places allows, and finer
 * where a tet would turn or go flat. */
#include <math.h>
#include <string.h>

#include "base/base_predicates.h"
#include "model/model.h"

enum {
    AXIS_BITS = 31,  /* of the places of a data set along an axis */
    PLACE_BITS = 51, /* of a place from 0 */
    FINER = 2,       /* steps of broken tets shrink by 2^FINER at a time */
    GRAIN = 16384
};

static double round_to(double x, int step)
{
    return ldexp(rint(ldexp(x, -step)), step);
}

typedef struct snap_job {
    const tl_mesh *mesh;
    double *xyz;     /* [vert_count][3] snapped */
    int16_t *steps;  /* [vert_count] */
    uint8_t *broken; /* [pieces] */
    uint8_t *finer;  /* [vert_count] wanted: set by several threads to the same value */
} snap_job;

static tl_status snap_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    snap_job *j = arg;
    (void)worker;
    for (size_t v = begin; v < end; v++) {
        const double *x = j->mesh->xyz + 3 * v;
        for (int k = 0; k < 3; k++)
            j->xyz[3 * v + (size_t)k] = isfinite(x[k]) ? round_to(x[k], j->steps[v]) : x[k];
    }
    return TL_OK;
}

static int sign_of(const double *xyz, const tl_lidx *q)
{
    return tli_orient3d(xyz + 3 * (size_t)q[0], xyz + 3 * (size_t)q[1], xyz + 3 * (size_t)q[2],
                        xyz + 3 * (size_t)q[3]);
}

static tl_status check_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    snap_job *j = arg;
    (void)worker;
    for (size_t t = begin; t < end; t++) {
        const tl_lidx *q = j->mesh->tets + 4 * t;
        double sum = 0;
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 3; k++) sum += j->xyz[3 * (size_t)q[i] + (size_t)k];
        if (!isfinite(sum)) continue;
        int after = sign_of(j->xyz, q);
        if (after > 0) continue;
        int before = sign_of(j->mesh->xyz, q);
        if (before == after || (before < 0 && after <= 0)) continue;
        for (int i = 0; i < 4; i++) __atomic_store_n(&j->finer[q[i]], 1, __ATOMIC_RELAXED);
        j->broken[begin / GRAIN] = 1;
    }
    return TL_OK;
}

/* Exponents of the unit and of the largest step. */
static void choose_steps(const tli_plan *plan, int *unit, int *step)
{
    double largest = 0, from_zero = 0;
    for (int k = 0; k < 3; k++) {
        largest = fmax(largest, plan->bounds[2 * k + 1] - plan->bounds[2 * k]);
        from_zero = fmax(from_zero, fmax(fabs(plan->bounds[2 * k]), fabs(plan->bounds[2 * k + 1])));
    }
    if (!(largest > 0)) largest = from_zero > 0 ? from_zero : 1;
    *unit = ilogb(largest) + 1 - AXIS_BITS;
    if (from_zero > 0 && ilogb(from_zero) + 1 - PLACE_BITS > *unit)
        *unit = ilogb(from_zero) + 1 - PLACE_BITS;
    double move = plan->opts.position_error * plan->diagonal;
    *step = move > 0 ? ilogb(2 * move / sqrt(3.0)) : *unit;
    if (*step < *unit) *step = *unit;
}

/* Half of the box's largest side is left around it for vertices that leave it. */
static void set_lattice(tli_plan *plan, int unit, int step)
{
    plan->lattice = (tl_lattice){.kind = TL_PLACE_LATTICE, .exponent = unit};
    plan->position_error = ldexp(sqrt(3.0) / 2, step);
    for (int k = 0; k < 3; k++)
        plan->lattice.origin[k] =
            (int64_t)floor(ldexp(plan->bounds[2 * k], -unit)) - ((int64_t)1 << (AXIS_BITS - 1));
}

static tl_status keep_places(tli_plan *plan, const tl_mesh *mesh, double *xyz, int16_t *steps)
{
    bool narrow = true;
    for (size_t i = 0; narrow && i < 3 * mesh->vert_count; i++)
        narrow = !isfinite(mesh->xyz[i]) || mesh->xyz[i] == (double)(float)mesh->xyz[i];
    plan->lattice.kind = narrow ? TL_PLACE_FLOAT32 : TL_PLACE_FLOAT64;
    plan->position_error = 0;
    memcpy(xyz, mesh->xyz, 3 * mesh->vert_count * sizeof *xyz);
    for (size_t v = 0; v < mesh->vert_count; v++)
        steps[v] = narrow ? TLI_STEP_FLOAT32 : TLI_STEP_ANY;
    return TL_OK;
}

tl_status tli_lattice_snap(tli_plan *plan, const tl_mesh *mesh, double *xyz, int16_t *steps)
{
    int largest, unit;
    tl_status st = TL_OK;
    size_t pieces = mesh->tet_count / GRAIN + 1;
    for (size_t i = 0; i < 3 * mesh->vert_count; i++)
        if (!isfinite(mesh->xyz[i])) return keep_places(plan, mesh, xyz, steps);
    if (plan->opts.lossless) return keep_places(plan, mesh, xyz, steps);
    snap_job j = {.mesh = mesh, .xyz = xyz, .steps = steps};
    choose_steps(plan, &unit, &largest);
    set_lattice(plan, unit, largest);
    j.broken = tl_mem_zalloc(plan->ctx, pieces, 1, &st);
    j.finer = tl_mem_zalloc(plan->ctx, mesh->vert_count, 1, &st);
    for (size_t v = 0; !st && v < mesh->vert_count; v++) steps[v] = (int16_t)largest;
    for (int step = largest; !st; step -= FINER) {
        bool broken = false;
        st = tli_parallel(plan->ctx, mesh->vert_count, GRAIN, snap_range, &j);
        memset(j.broken, 0, pieces);
        if (!st) st = tli_parallel(plan->ctx, mesh->tet_count, GRAIN, check_range, &j);
        for (size_t i = 0; i < pieces; i++) broken |= j.broken[i] != 0;
        if (st || !broken) break;
        if (step == unit) { /* thinner than the lattice can tell */
            st = keep_places(plan, mesh, xyz, steps);
            break;
        }
        if (step - FINER < unit) step = unit + FINER;
        for (size_t v = 0; v < mesh->vert_count; v++)
            if (j.finer[v]) {
                steps[v] = (int16_t)(steps[v] - FINER);
                if (steps[v] < unit) steps[v] = (int16_t)unit;
                j.finer[v] = 0;
            }
    }
    tl_mem_free(plan->ctx, j.finer);
    tl_mem_free(plan->ctx, j.broken);
    return st;
}
