/* A channel of a patch to bytes. */
#include "codec/codec_channel.h"
#include "codec/codec_raw.h"
#include "codec/codec_tell.h"

#include <string.h>

/* The first element says what all are? Then the channel costs its head alone. */
static unsigned find_flags(const int64_t *values, uint32_t count, uint32_t components)
{
    unsigned flags = count ? CHANNEL_CONSTANT : 0;
    for (size_t i = 0; i < (size_t)count * components; i++) {
        if (channel_value_kind(values[i]) != VALUE_FINITE) flags |= CHANNEL_NONFINITE;
        if (values[i] != values[i % components]) flags &= ~CHANNEL_CONSTANT;
    }
    return flags & CHANNEL_CONSTANT ? CHANNEL_CONSTANT : flags;
}

static void tell_element(tli_tokens *tokens, uint32_t first_row, const tli_elders *elders,
                         uint32_t element, uint32_t components, const int64_t *values,
                         unsigned flags, tli_scale *scales)
{
    for (uint32_t c = 0; c < components; c++) {
        int64_t value = values[(size_t)element * components + c];
        int64_t previous = element ? values[(size_t)(element - 1) * components + c] : 0;
        uint32_t kind = channel_value_kind(value);
        uint32_t state = model_state_of_channel(c);
        if (flags & CHANNEL_NONFINITE) tokens_symbol(tokens, state, first_row + NUMBER_ROWS, kind);
        if (kind != VALUE_FINITE) continue;
        tli_expected expected = tli_elders_expect(elders, values, components, c, previous,
                                                  !(flags & CHANNEL_NONFINITE));
        tokens_number(tokens, state, first_row, &scales[channel_scale(c)], expected.around,
                      (int64_t)((uint64_t)value - (uint64_t)expected.value));
    }
}

tl_status tli_channel_tell(tl_ctx *ctx, const tl_patch *patch, uint32_t first_row, tl_on on,
                           uint32_t components, const int64_t *values, uint8_t *flags,
                           tli_tokens *tokens)
{
    uint32_t count = on == TL_ON_VERTEX ? patch->vert_count : patch->tet_count;
    tli_scale scales[CHANNEL_SCALES] = {{0}};
    tli_elders elders;
    tli_kin kin = {0};
    const int64_t(*places)[3] = (const int64_t(*)[3])patch->places;
    if (!patch->opposite)
        return tl_fail(ctx, TL_ERR_ARG, "a patch without opposite faces: it is not arranged");
    *flags = (uint8_t)find_flags(values, count, components);
    if (*flags & CHANNEL_CONSTANT) return TL_OK;
    tl_status st = on == TL_ON_VERTEX ? tli_kin_open(ctx, patch, &kin) : TL_OK;
    for (uint32_t e = 0; e < count && !st; e++) {
        if (on == TL_ON_VERTEX)
            tli_kin_elders(&kin, places, e, &elders);
        else
            tli_tet_elders(patch, e, &elders);
        tell_element(tokens, first_row, &elders, e, components, values, *flags, scales);
    }
    tli_kin_close(ctx, &kin);
    return st ? st : tokens->status;
}

tl_status tli_channel_encode(tl_ctx *ctx, const tl_codec *codec, unsigned class_,
                             const tl_patch *patch, size_t channel, tl_on on, uint32_t components,
                             const int64_t *values, tli_bytes *out)
{
    uint32_t count = on == TL_ON_VERTEX ? patch->vert_count : patch->tet_count;
    uint8_t head[CHANNEL_HEAD_BYTES] = {BLOB_CODED, 0};
    size_t before = out->count;
    tli_tokens tokens;
    if (class_ == TL_CLASS_RAW) return tli_channel_encode_raw(values, count, components, out);
    if (class_ >= TL_CLASS_COUNT || !codec || channel >= codec->channel_count)
        return tl_fail(ctx, TL_ERR_ARG, "there is no class %u of patches or no channel %zu", class_,
                       channel);
    tli_tokens_open(ctx, &tokens);
    tl_status st = tli_channel_tell(ctx, patch, codec_channel_row(channel), on, components, values,
                                    &head[1], &tokens);
    if (!st) st = tli_bytes_append(out, head, sizeof head);
    if (!st && (head[1] & CHANNEL_CONSTANT))
        st = tli_raw_append(out, values, components, 8);
    else if (!st)
        st = tli_tokens_write(&tokens, &codec->tables[class_], model_states_of_channel(components),
                              0, out);
    if (st) out->count = before;
    tli_tokens_close(&tokens);
    return st;
}
