/* Prediction of values: a linear function is fitted to what is known around a vertex and followed
 * to its place. Sums and products of doubles have the same bits on every machine here: nothing is
 * contracted or reordered. */
#include "codec/codec_channel.h"

#include <math.h>
#include <string.h>

/* Relative to the spread of the elders along an axis: below, their gradient is not believed. */
#define FIT_RIDGE 0x1p-8
/* In squared units of the images, below what any two places differ by: keeps 0 from being divided
 * by.
 */
#define FIT_LEAST 0x1p-20
/* Beyond it a prediction is no number of use. */
#define EXPECTED_MAX 0x1p62

/* Counts an element once: seen by its vertex. */
static inline void add_elder(tli_elders *elders, uint32_t *seen, uint32_t vertex, uint32_t element)
{
    elders->element[elders->count] = element;
    elders->count += seen[element] != vertex && elders->count < ELDERS_MAX - 1;
    seen[element] = vertex;
}

static void gather(const tli_kin *kin, uint32_t vertex, tli_elders *elders)
{
    elders->count = 0;
    for (uint32_t t = kin->first[vertex]; t != TL_NONE; t = kin->next[t]) {
        const uint16_t *tet = kin->patch->tets[t];
        uint32_t corner = kin_corner(tet, vertex), across = kin->patch->opposite[t][corner], elder;
        for (uint32_t c = 1; c < 4; c++)
            add_elder(elders, kin->seen, vertex, tet[(corner + c) & 3]);
        if (across == TL_NONE) continue;
        elder = kin->patch->tets[across >> 2][across & 3];
        if (elder < vertex) add_elder(elders, kin->seen, vertex, elder);
    }
}

/* Solves the symmetric system c x = b by elimination; c is positive definite. */
static void solve(double c[3][3], double b[3])
{
    for (int i = 0; i < 3; i++)
        for (int j = i + 1; j < 3; j++) {
            double f = c[j][i] / c[i][i];
            for (int k = i; k < 3; k++) c[j][k] -= f * c[i][k];
            b[j] -= f * b[i];
        }
    for (int i = 2; i >= 0; i--) {
        for (int k = i + 1; k < 3; k++) b[i] -= c[i][k] * b[k];
        b[i] /= c[i][i];
    }
}

/* Weights of the value at the origin of a linear function that is fitted at x [count]. */
static void fit(const double (*x)[3], uint32_t count, double *weights)
{
    double sum[3] = {0, 0, 0}, c[3][3] = {{0}}, slope[3], part = 1.0 / count, start = part;
    for (uint32_t i = 0; i < count; i++)
        for (int a = 0; a < 3; a++) {
            sum[a] += x[i][a];
            for (int b = a; b < 3; b++) c[a][b] += x[i][a] * x[i][b];
        }
    for (int a = 0; a < 3; a++) {
        slope[a] = sum[a] * part;
        for (int b = a; b < 3; b++) {
            c[a][b] -= sum[a] * (sum[b] * part);
            c[b][a] = c[a][b];
        }
        c[a][a] = fabs(c[a][a]) * (1 + FIT_RIDGE) + FIT_LEAST;
    }
    solve(c, slope);
    for (int a = 0; a < 3; a++) start += sum[a] * part * slope[a];
    for (uint32_t i = 0; i < count; i++)
        weights[i] = start - (x[i][0] * slope[0] + x[i][1] * slope[1] + x[i][2] * slope[2]);
}

void tli_kin_elders(const tli_kin *kin, uint32_t vertex, tli_elders *elders)
{
    double x[ELDERS_MAX][3];
    const int64_t *at = kin->patch->places[vertex];
    gather(kin, vertex, elders);
    if (!elders->count) return;
    for (uint32_t i = 0; i < elders->count; i++)
        for (int a = 0; a < 3; a++)
            x[i][a] = (double)(int64_t)((uint64_t)kin->patch->places[elders->element[i]][a] -
                                        (uint64_t)at[a]);
    fit((const double(*)[3])x, elders->count, elders->weight);
}

void tli_tet_elders(const tl_patch *patch, uint32_t tet, tli_elders *elders)
{
    elders->count = 0;
    for (uint32_t c = 0; c < 4; c++) {
        uint32_t across = patch->opposite[tet][c];
        if (across != TL_NONE && across >> 2 < tet) elders->element[elders->count++] = across >> 2;
    }
    for (uint32_t i = 0; i < elders->count; i++) elders->weight[i] = 1.0 / elders->count;
}

tli_expected tli_elders_expect(const tli_elders *elders, const int64_t *values, uint32_t components,
                               uint32_t component, int64_t previous)
{
    tli_expected expected = {previous, 0};
    int64_t reference = 0, low = 0, high = 0;
    double sum = 0;
    bool any = false;
    for (uint32_t i = 0; i < elders->count; i++) {
        int64_t value = values[(size_t)elders->element[i] * components + component], beside;
        if (channel_value_kind(value) != VALUE_FINITE) continue;
        if (!any) reference = value;
        any = true;
        beside = (int64_t)((uint64_t)value - (uint64_t)reference);
        low = beside < low ? beside : low;
        high = beside > high ? beside : high;
        sum += elders->weight[i] * (double)beside;
    }
    if (!any) return expected;
    sum = nearbyint(sum);
    int64_t step = fabs(sum) < EXPECTED_MAX ? (int64_t)sum : 0;
    expected.value = (int64_t)((uint64_t)reference + (uint64_t)step);
    expected.around = model_length((uint64_t)high - (uint64_t)low);
    return expected;
}
