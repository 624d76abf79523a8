/* Prediction of values: a linear function is fitted to what is known around a vertex and followed
 * to its place. Sums and products of doubles have the same bits on every machine here: nothing is
 * contracted or reordered. */
#include "codec/codec_channel.h"

#include <math.h>

/* Relative to the spread of the elders along an axis: below, their gradient is not believed. */
#define FIT_RIDGE 0x1p-8
/* In squared units of the images, below what any two places differ by: keeps 0 from being divided
 * by.
 */
#define FIT_LEAST 0x1p-20
/* Beyond it a prediction is no number of use. */
#define EXPECTED_MAX 0x1p62

/* Solves c x = b by Cramer's rule; c is symmetric and positive definite: xx, xy, xz, yy, yz, zz. */
static void solve(const double c[6], const double b[3], double x[3])
{
    double xx = c[3] * c[5] - c[4] * c[4], xy = c[2] * c[4] - c[1] * c[5];
    double xz = c[1] * c[4] - c[2] * c[3], yy = c[0] * c[5] - c[2] * c[2];
    double yz = c[1] * c[2] - c[0] * c[4], zz = c[0] * c[3] - c[1] * c[1];
    double part = 1 / (c[0] * xx + c[1] * xy + c[2] * xz);
    x[0] = (xx * b[0] + xy * b[1] + xz * b[2]) * part;
    x[1] = (xy * b[0] + yy * b[1] + yz * b[2]) * part;
    x[2] = (xz * b[0] + yz * b[1] + zz * b[2]) * part;
}

/* Sums over the places of elders. */
typedef struct moments {
    double x, y, z, xx, xy, xz, yy, yz, zz;
} moments;

static inline void add_elder(const int64_t (*places)[3], const int64_t at[3], uint32_t element,
                             tli_elders *elders, moments *m)
{
    double *x = elders->x[elders->count];
    elders->element[elders->count++] = element;
    for (int a = 0; a < 3; a++)
        x[a] = (double)(int64_t)((uint64_t)places[element][a] - (uint64_t)at[a]);
    m->x += x[0];
    m->y += x[1];
    m->z += x[2];
    m->xx += x[0] * x[0];
    m->xy += x[0] * x[1];
    m->xz += x[0] * x[2];
    m->yy += x[1] * x[1];
    m->yz += x[1] * x[2];
    m->zz += x[2] * x[2];
}

/* The weights of the value at the origin of a linear function that is fitted there. */
static void fit(const moments *m, tli_elders *elders)
{
    double part = 1.0 / elders->count;
    const double mean[3] = {m->x * part, m->y * part, m->z * part};
    const double c[6] = {fabs(m->xx - m->x * mean[0]) * (1 + FIT_RIDGE) + FIT_LEAST,
                         m->xy - m->x * mean[1],
                         m->xz - m->x * mean[2],
                         fabs(m->yy - m->y * mean[1]) * (1 + FIT_RIDGE) + FIT_LEAST,
                         m->yz - m->y * mean[2],
                         fabs(m->zz - m->z * mean[2]) * (1 + FIT_RIDGE) + FIT_LEAST};
    double *slope = elders->slope;
    solve(c, mean, slope);
    elders->start = part + (mean[0] * slope[0] + mean[1] * slope[1] + mean[2] * slope[2]);
}

void tli_kin_elders(const tli_kin *kin, const int64_t (*places)[3], uint32_t vertex,
                    tli_elders *elders)
{
    moments m = {0};
    const tli_relative *relative = &kin->relatives[kin->begin[vertex]];
    uint32_t left = kin_count(kin, vertex, VALUE_KIN_MAX);
    elders->count = 0;
    if (!left) return;
    for (; left > 0; left--, relative++) {
        /* Where there is no elder, the face's first vertex counts twice: no branch. */
        uint32_t elder = relative->elder == ELDER_NONE ? relative->face[0] : relative->elder;
        for (int c = 0; c < 3; c++)
            add_elder(places, places[vertex], relative->face[c], elders, &m);
        add_elder(places, places[vertex], elder, elders, &m);
    }
    fit(&m, elders);
}

void tli_tet_elders(const tl_patch *patch, uint32_t tet, tli_elders *elders)
{
    elders->count = 0;
    for (uint32_t c = 0; c < 4; c++) {
        uint32_t across = patch->opposite[tet][c];
        if (across == TL_NONE || across >> 2 >= tet) continue;
        for (int a = 0; a < 3; a++) elders->x[elders->count][a] = 0;
        elders->element[elders->count++] = across >> 2;
    }
    for (int a = 0; a < 3; a++) elders->slope[a] = 0;
    elders->start = elders->count ? 1.0 / elders->count : 0;
}

tli_expected tli_elders_expect(const tli_elders *elders, const int64_t *values, uint32_t components,
                               uint32_t component, int64_t previous, bool finite)
{
    tli_expected expected = {previous, 0};
    const double *slope = elders->slope;
    int64_t reference = 0, low = 0, high = 0;
    double sum = 0;
    uint32_t first = 0;
    values += component;
    while (first < elders->count && !finite &&
           channel_value_kind(values[(size_t)elders->element[first] * components]) != VALUE_FINITE)
        first++;
    if (first == elders->count) return expected;
    reference = values[(size_t)elders->element[first] * components];
    for (uint32_t i = first; i < elders->count; i++) {
        const double *x = elders->x[i];
        int64_t value = values[(size_t)elders->element[i] * components], beside;
        if (!finite && channel_value_kind(value) != VALUE_FINITE) continue;
        beside = (int64_t)((uint64_t)value - (uint64_t)reference);
        low = beside < low ? beside : low;
        high = beside > high ? beside : high;
        sum += (elders->start - (x[0] * slope[0] + x[1] * slope[1] + x[2] * slope[2])) *
               (double)beside;
    }
    int64_t step = fabs(sum) < EXPECTED_MAX ? kin_round(sum) : 0;
    expected.value = (int64_t)((uint64_t)reference + (uint64_t)step);
    expected.around = model_length((uint64_t)high - (uint64_t)low);
    return expected;
}
