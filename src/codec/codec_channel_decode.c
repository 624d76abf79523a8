/* Bytes to a channel of a patch. */
#include "codec/codec_channel.h"
#include "codec/codec_read.h"

static const char *read_element(tli_stream *stream, const tli_table *table, uint32_t first_row,
                                const tli_elders *elders, uint32_t element, uint32_t components,
                                unsigned flags, tli_scale *scales, int64_t *values)
{
    for (uint32_t c = 0; c < components; c++) {
        int64_t *value = &values[(size_t)element * components + c];
        int64_t previous = element ? values[(size_t)(element - 1) * components + c] : 0;
        uint32_t kind = VALUE_FINITE;
        if (flags & CHANNEL_NONFINITE)
            kind = stream_symbol(stream, model_state_of_channel(c),
                                 codec_row(table, first_row + NUMBER_ROWS));
        if (kind > VALUE_OTHER_COUNT) return "has a value of no kind";
        if (kind != VALUE_FINITE) {
            *value = INT64_MIN + (int64_t)(kind - 1);
            continue;
        }
        tli_expected expected = tli_elders_expect(elders, values, components, c, previous,
                                                  !(flags & CHANNEL_NONFINITE));
        int64_t beside = read_number(stream, model_state_of_channel(c), table, first_row,
                                     &scales[channel_scale(c)], expected.around);
        *value = (int64_t)((uint64_t)expected.value + (uint64_t)beside);
    }
    return NULL;
}

static tl_status read_stream(tl_ctx *ctx, const tl_patch *patch, tli_stream *stream,
                             const tli_table *table, uint32_t first_row, tl_on on,
                             uint32_t components, unsigned flags, int64_t *values,
                             const char **wrong)
{
    uint32_t count = on == TL_ON_VERTEX ? patch->vert_count : patch->tet_count;
    tli_scale scales[CHANNEL_SCALES] = {{0}};
    tli_elders elders;
    tli_kin kin = {0};
    const int64_t(*places)[3] = (const int64_t(*)[3])patch->places;
    tl_status st = on == TL_ON_VERTEX ? tli_kin_open(ctx, patch, &kin) : TL_OK;
    for (uint32_t e = 0; e < count && !st && !*wrong; e++) {
        if (on == TL_ON_VERTEX)
            tli_kin_elders(&kin, places, e, &elders);
        else
            tli_tet_elders(patch, e, &elders);
        *wrong =
            read_element(stream, table, first_row, &elders, e, components, flags, scales, values);
    }
    tli_kin_close(ctx, &kin);
    if (!st && !*wrong && !stream_is_done(stream, false))
        *wrong = "does not end where its values end";
    return st;
}

/* The values of a channel that is the same everywhere. */
static const char *read_constant(const uint8_t *bytes, size_t byte_count, uint32_t count,
                                 uint32_t components, int64_t *values)
{
    if (byte_count != 8 * (size_t)components) return "holds other than one value";
    for (size_t i = 0; i < (size_t)count * components; i++)
        values[i] = read_raw(bytes, i % components, 8);
    return NULL;
}

tl_status tl_channel_decode(tl_ctx *ctx, const tl_codec *codec, unsigned class_,
                            const tl_patch *patch, size_t channel, tl_on on, uint32_t components,
                            const uint8_t *bytes, size_t byte_count, int64_t *values)
{
    uint32_t count = on == TL_ON_VERTEX ? patch->vert_count : patch->tet_count;
    unsigned flags = byte_count > 1 ? bytes[1] : 0;
    bool raw = class_ == TL_CLASS_RAW;
    const char *wrong = NULL;
    tl_status st = TL_OK;
    tli_stream stream;
    if (!raw && (class_ >= TL_CLASS_COUNT || !codec || channel >= codec->channel_count))
        return tl_fail(ctx, TL_ERR_ARG, "there is no class %u of patches or no channel %zu", class_,
                       channel);
    if (byte_count < CHANNEL_HEAD_BYTES)
        wrong = "ends inside its head";
    else if (bytes[0] != (raw ? BLOB_RAW : BLOB_CODED))
        wrong = "is of another kind than its class";
    else if (raw)
        wrong = tli_channel_read_raw(bytes, byte_count, (size_t)count * components, values);
    else if (flags == CHANNEL_CONSTANT)
        wrong = read_constant(bytes + CHANNEL_HEAD_BYTES, byte_count - CHANNEL_HEAD_BYTES, count,
                              components, values);
    else if (flags & ~CHANNEL_NONFINITE)
        wrong = "has unknown flags";
    else if (!stream_begin(&stream, bytes + CHANNEL_HEAD_BYTES, byte_count - CHANNEL_HEAD_BYTES,
                           model_states_of_channel(components)))
        wrong = "ends before its stream begins";
    else
        st = read_stream(ctx, patch, &stream, &codec->tables[class_], codec_channel_row(channel),
                         on, components, flags, values, &wrong);
    if (!st && wrong)
        st =
            tl_fail(ctx, TL_ERR_FORMAT, "channel %zu of %zu bytes for %u elements of %u numbers %s",
                    channel, byte_count, count, components, wrong);
    return st;
}
