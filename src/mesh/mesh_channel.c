/* Channels: named fields on the vertices or tets of a mesh, and the number types of files. */
#include "mesh/mesh.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Longest number of a name's suffix that is understood: "_123456789". */
#define SUFFIX_DIGITS 9

size_t tl_scalar_bytes(tl_scalar scalar)
{
    static const uint8_t bytes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return bytes[scalar];
}

bool tl_scalar_holds(tl_scalar scalar, double value)
{
    if (scalar == TL_F64) return true;
    if (scalar == TL_F32)
        return !isfinite(value) ||
               (fabs(value) <= (double)FLT_MAX && (double)(float)value == value);
    if (!isfinite(value) || trunc(value) != value || (value == 0 && signbit(value))) return false;
    bool is_signed = scalar == TL_I8 || scalar == TL_I16 || scalar == TL_I32 || scalar == TL_I64;
    int bits = 8 * (int)tl_scalar_bytes(scalar) - (is_signed ? 1 : 0);
    double end = ldexp(1, bits);
    return value < end && value >= (is_signed ? -end : 0);
}

static size_t elem_count(const tl_mesh *mesh, tl_on on)
{
    return on == TL_ON_VERTEX ? mesh->vert_count : mesh->tet_count;
}

/* The number n of a name that reads base_n, 1 for base itself, 0 for any other name. */
static uint32_t suffix_of(const char *name, const char *base, size_t base_length)
{
    if (strncmp(name, base, base_length) != 0) return 0;
    const char *rest = name + base_length;
    if (!*rest) return 1;
    size_t digits = strspn(rest + 1, "0123456789");
    if (*rest != '_' || !digits || digits > SUFFIX_DIGITS || rest[1 + digits]) return 0;
    uint32_t number = 0;
    for (size_t i = 1; i <= digits; i++) number = 10 * number + (uint32_t)(rest[i] - '0');
    return number;
}

/* A name that no channel on the same kind of element has. Gives it. One pass over the channels, so
 * that a file of many equal names costs no more than its square. */
static char *free_name(const tl_mesh *mesh, const tl_channel *channel, tl_status *st)
{
    const char *base = channel->name;
    size_t length = strlen(base);
    uint32_t largest = 0;
    bool taken = false;
    for (size_t i = 0; i < mesh->channel_count; i++) {
        if (mesh->channels[i].on != channel->on) continue;
        uint32_t number = suffix_of(mesh->channels[i].name, base, length);
        taken = taken || number == 1;
        largest = number > largest ? number : largest;
    }
    if (!taken) return tli_strdup(mesh->ctx, base, st);
    char *name = tl_mem_alloc(mesh->ctx, length + SUFFIX_DIGITS + 3, 1, st);
    if (*st) return NULL;
    uint32_t number = largest + 1;
    char digits[SUFFIX_DIGITS + 2];
    size_t digit_count = 0;
    for (; number; number /= 10) digits[digit_count++] = (char)('0' + number % 10);
    memcpy(name, base, length);
    name[length++] = '_';
    while (digit_count) name[length++] = digits[--digit_count];
    name[length] = 0;
    return name;
}

static tl_status check_channel(const tl_mesh *mesh, const tl_channel *channel)
{
    if (!channel->name || channel->components == 0)
        return tl_fail(mesh->ctx, TL_ERR_ARG, "a channel needs a name and at least one component");
    if ((unsigned)channel->on > TL_ON_TET || (unsigned)channel->scalar > TL_F64)
        return tl_fail(mesh->ctx, TL_ERR_ARG, "channel '%s': unknown place %d or number type %d",
                       channel->name, (int)channel->on, (int)channel->scalar);
    if (!channel->values && elem_count(mesh, channel->on))
        return tl_fail(mesh->ctx, TL_ERR_ARG, "channel '%s' has no values", channel->name);
    return TL_OK;
}

tl_status tl_mesh_adopt_channel(tl_mesh *mesh, const tl_channel *channel)
{
    tl_status st = check_channel(mesh, channel);
    if (st) return st;
    tl_channel own = *channel;
    char *name = free_name(mesh, channel, &st);
    char *unit = tli_strdup(mesh->ctx, channel->unit ? channel->unit : "", &st);
    mesh->channels = tl_mem_resize(mesh->ctx, mesh->channels, mesh->channel_count + 1,
                                   sizeof *mesh->channels, &st);
    if (st) {
        tl_mem_free(mesh->ctx, unit);
        tl_mem_free(mesh->ctx, name);
        return st;
    }
    own.name = name;
    own.unit = unit;
    mesh->channels[mesh->channel_count++] = own;
    return TL_OK;
}

tl_status tl_mesh_add_channel(tl_mesh *mesh, const tl_channel *channel)
{
    tl_status st = check_channel(mesh, channel);
    if (st) return st;
    size_t count = 0, bytes = 0;
    if (!tli_mul_size(elem_count(mesh, channel->on), channel->components, &count) ||
        !tli_mul_size(count, sizeof(double), &bytes))
        return tl_fail(mesh->ctx, TL_ERR_ARG,
                       "channel '%s': %zu elements of %u components are too many", channel->name,
                       elem_count(mesh, channel->on), channel->components);
    double *values = tl_mem_alloc(mesh->ctx, count, sizeof *values, &st);
    if (st) return st;
    if (count) memcpy(values, channel->values, bytes);
    tl_channel own = *channel;
    own.values = values;
    st = tl_mesh_adopt_channel(mesh, &own);
    if (st) tl_mem_free(mesh->ctx, values);
    return st;
}

void tli_free_const(tl_ctx *ctx, const void *block)
{
    union {
        const void *in;
        void *out;
    } pointer = {block};
    tl_mem_free(ctx, pointer.out);
}

void tl_mesh_destroy(tl_mesh *mesh)
{
    if (!mesh) return;
    tl_ctx *ctx = mesh->ctx;
    for (size_t i = 0; i < mesh->channel_count; i++) {
        tli_free_const(ctx, mesh->channels[i].values);
        tli_free_const(ctx, mesh->channels[i].unit);
        tli_free_const(ctx, mesh->channels[i].name);
    }
    tl_mem_free(ctx, mesh->channels);
    tli_mesh_release_labels(mesh);
    tl_mem_free(ctx, mesh->regions);
    tl_mem_free(ctx, mesh->tets);
    tl_mem_free(ctx, mesh->xyz);
    tl_mem_free(ctx, mesh);
}

size_t tl_mesh_channel_count(const tl_mesh *mesh)
{
    return mesh->channel_count;
}

const tl_channel *tl_mesh_channel(const tl_mesh *mesh, size_t index)
{
    return &mesh->channels[index];
}

const tl_channel *tl_mesh_channel_by_name(const tl_mesh *mesh, const char *name)
{
    for (int on = TL_ON_VERTEX; on <= TL_ON_TET; on++)
        for (size_t i = 0; i < mesh->channel_count; i++)
            if ((int)mesh->channels[i].on == on && strcmp(mesh->channels[i].name, name) == 0)
                return &mesh->channels[i];
    return NULL;
}

/* Euclidean norm; scaled by the largest component where the squares overflow or vanish. */
static double norm(const double *values, uint32_t count)
{
    double sum = 0, largest = 0;
    for (uint32_t i = 0; i < count; i++) {
        sum += values[i] * values[i];
        largest = fmax(largest, fabs(values[i]));
    }
    if ((isfinite(sum) && sum >= DBL_MIN) || !isfinite(largest) || largest == 0) return sqrt(sum);
    sum = 0;
    for (uint32_t i = 0; i < count; i++) sum += (values[i] / largest) * (values[i] / largest);
    return largest * sqrt(sum);
}

void tl_channel_range(const tl_channel *channel, size_t count, double range[2],
                      size_t *nonfinite_count)
{
    uint32_t components = channel->components;
    double low = INFINITY, high = -INFINITY;
    size_t nonfinite = 0;
    for (size_t i = 0; i < count; i++) {
        const double *tuple = channel->values + i * components;
        double value = components == 1 ? tuple[0] : norm(tuple, components);
        if (isfinite(value)) {
            low = value < low ? value : low;
            high = value > high ? value : high;
        } else {
            nonfinite++;
        }
    }
    range[0] = low <= high ? low : 0;
    range[1] = low <= high ? high : 0;
    if (nonfinite_count) *nonfinite_count = nonfinite;
}
