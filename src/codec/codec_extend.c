/* Tables of a file to which channels are added: those of before, bit by bit, and new ones behind
 * them, so that old blobs decode as they did. */
#include "codec/codec_tables.h"

#include <string.h>

/* Bits of tables that are there, and where the next one goes. */
typedef struct splicer {
    tl_ctx *ctx;
    const uint8_t *bytes;
    size_t bit, bit_count;
    bool overrun;
    tli_bytes *out;
    unsigned used; /* bits of the last byte of out; 0: none */
    tl_status status;
} splicer;

static uint32_t take(splicer *s, unsigned count)
{
    uint32_t value = 0;
    if (count > s->bit_count - s->bit) {
        s->overrun = true;
        return 0;
    }
    for (unsigned i = 0; i < count; i++, s->bit++)
        value |= (uint32_t)(s->bytes[s->bit >> 3] >> (s->bit & 7) & 1) << i;
    return value;
}

static void put(splicer *s, uint32_t value, unsigned count)
{
    for (unsigned i = 0; i < count && !s->status; i++) {
        if (!s->used) s->status = tli_bytes_append(s->out, "", 1);
        if (s->status) return;
        s->out->bytes[s->out->count - 1] |= (uint8_t)((value >> i & 1) << s->used);
        s->used = (s->used + 1) & 7;
    }
}

/* Takes so many bits and puts them if they are wanted. */
static uint32_t move(splicer *s, unsigned count, bool wanted)
{
    uint32_t value = take(s, count);
    if (wanted) put(s, value, count);
    return value;
}

static void move_distribution(splicer *s, bool wanted)
{
    uint32_t mask = move(s, RANS_SYMBOLS, wanted);
    for (uint32_t i = 0; i < RANS_SYMBOLS; i++)
        if (mask >> i & 1) move(s, DISTRIBUTION_BITS, wanted);
}

/* One group of rows: codec_trainer.c writes it. */
static void move_group(splicer *s, uint32_t row_count, bool wanted)
{
    if (!move(s, 1, wanted)) return;
    move_distribution(s, wanted);
    for (uint32_t i = 0; i < row_count && row_count > 1; i++)
        if (move(s, 1, wanted)) move_distribution(s, wanted);
}

static size_t channels_of(const uint8_t *tables)
{
    return (size_t)tables[28] | (size_t)tables[29] << 8;
}

static size_t group_count(size_t channel_count)
{
    tli_row_group group;
    size_t count = 0;
    while (tli_row_group_at(count, channel_count, &group)) count++;
    return count;
}

static splicer open_tables(tl_ctx *ctx, const uint8_t *bytes, size_t byte_count, tli_bytes *out)
{
    const size_t head = TABLES_HEAD_BYTES + channels_of(bytes) * TABLES_CHANNEL_BYTES;
    splicer s = {.ctx = ctx, .bytes = bytes, .bit = 8 * head, .bit_count = 8 * byte_count};
    if (head > byte_count) s.bit_count = s.bit = 0;
    s.out = out;
    return s;
}

tl_status tli_tables_extend(tl_ctx *ctx, const uint8_t *old, size_t old_bytes,
                            const tli_bytes *fresh, tli_bytes *out)
{
    const size_t before = old_bytes < TABLES_HEAD_BYTES ? 0 : channels_of(old);
    const size_t after = channels_of(fresh->bytes);
    const size_t head = TABLES_HEAD_BYTES + after * TABLES_CHANNEL_BYTES;
    if (old_bytes < TABLES_HEAD_BYTES || after < before)
        return tl_fail(ctx, TL_ERR_ARG, "tables of %zu channels can't be extended to %zu", before,
                       after);
    tl_status st = tli_bytes_append(out, fresh->bytes, head);
    splicer a = open_tables(ctx, old, old_bytes, out);
    splicer b = open_tables(ctx, fresh->bytes, fresh->count, out);
    a.status = st;
    const size_t old_groups = group_count(before), groups = group_count(after);
    for (unsigned k = 0; k < TL_CLASS_COUNT; k++)
        for (size_t g = 0; g < groups; g++) {
            tli_row_group group;
            tli_row_group_at(g, after, &group);
            if (g < old_groups) move_group(&a, group.count, true);
            b.used = a.used;
            b.status = a.status;
            move_group(&b, group.count, g >= old_groups);
            a.used = b.used;
            a.status = b.status;
        }
    if (!a.status && (a.overrun || b.overrun))
        return tl_fail(ctx, TL_ERR_FORMAT, "the codec's tables end inside a table");
    return a.status;
}
