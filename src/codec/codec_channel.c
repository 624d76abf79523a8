/* Prediction of values: a linear function is fitted to what is known around a vertex and followed
 * to its place. Sums and products of doubles have the same bits on every machine here: nothing is
 * contracted or reordered. */
#include "codec/codec_channel.h"

#include <math.h>
#include <string.h>

/* Relative to the spread of the elders along an axis: below, their gradient is not believed. */
#define FIT_RIDGE 0x1p-8
/* Beyond it a prediction is no number of use. */
#define EXPECTED_MAX 0x1p62

static void add_elder(tli_elders *elders, uint32_t element)
{
    for (uint32_t i = 0; i < elders->count; i++)
        if (elders->element[i] == element) return;
    if (elders->count < ELDERS_MAX) elders->element[elders->count++] = element;
}

static void gather(const tli_kin *kin, uint32_t vertex, tli_elders *elders)
{
    elders->count = 0;
    for (uint32_t t = kin->first[vertex]; t != TL_NONE; t = kin->next[t]) {
        const uint16_t *tet = kin->patch->tets[t];
        for (uint32_t c = 0; c < 4; c++) {
            uint32_t across, elder;
            if (tet[c] != vertex) {
                add_elder(elders, tet[c]);
                continue;
            }
            across = kin->patch->opposite[t][c];
            if (across == TL_NONE) continue;
            elder = kin->patch->tets[across >> 2][across & 3];
            if (elder < vertex) add_elder(elders, elder);
        }
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

/* Weights of the value at the origin of a function that is fitted at x [count]. */
static void fit(const double (*x)[3], uint32_t count, double *weights)
{
    double mean[3] = {0, 0, 0}, spread[3][3] = {{0}}, slope[3];
    for (uint32_t i = 0; i < count; i++)
        for (int a = 0; a < 3; a++) mean[a] += x[i][a];
    for (int a = 0; a < 3; a++) mean[a] /= count;
    for (uint32_t i = 0; i < count; i++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) spread[a][b] += (x[i][a] - mean[a]) * (x[i][b] - mean[b]);
    for (int a = 0; a < 3; a++) {
        spread[a][a] = spread[a][a] * (1 + FIT_RIDGE) + 1e-300;
        slope[a] = mean[a];
    }
    solve(spread, slope);
    for (uint32_t i = 0; i < count; i++) {
        double along = 0;
        for (int a = 0; a < 3; a++) along += (x[i][a] - mean[a]) * slope[a];
        weights[i] = 1.0 / count - along;
    }
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
