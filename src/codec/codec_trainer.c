/* Tables out of counts, and into bytes. */
#include "codec/codec_tables.h"
#include "codec/codec_tell.h"

#include <math.h>
#include <string.h>

/* How many symbols the common distribution of a group counts for beside a row's own ones. */
#define PRIOR_SYMBOLS 4.0
/* Probabilities below it are those of symbols that do not occur. */
#define LEAST_PROBABILITY (1.5 / RANS_ONE)

struct tli_trainer {
    tl_codec *codec; /* rows unused */
    uint64_t (*counts[TL_CLASS_COUNT])[RANS_SYMBOLS];
};

tl_status tli_trainer_create(tl_ctx *ctx, const tl_lattice *lattice,
                             const tli_coded_channel *channels, size_t channel_count,
                             tli_trainer **trainer)
{
    tl_status st = TL_OK;
    const char *wrong = NULL;
    *trainer = NULL;
    tli_trainer *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    st = tli_codec_create(ctx, lattice, channels, channel_count, &made->codec, &wrong);
    if (!st && wrong) st = tl_fail(ctx, TL_ERR_ARG, "a codec for %s", wrong);
    for (unsigned k = 0; k < TL_CLASS_COUNT && !st; k++)
        made->counts[k] = tl_mem_zalloc(ctx, made->codec->row_count, sizeof *made->counts[k], &st);
    if (st)
        tli_trainer_destroy(ctx, made);
    else
        *trainer = made;
    return st;
}

void tli_trainer_destroy(tl_ctx *ctx, tli_trainer *trainer)
{
    if (!trainer) return;
    for (unsigned k = 0; k < TL_CLASS_COUNT; k++) tl_mem_free(ctx, trainer->counts[k]);
    tl_codec_destroy(ctx, trainer->codec);
    tl_mem_free(ctx, trainer);
}

static tl_status add_channel(tl_ctx *ctx, tli_trainer *trainer, unsigned class_,
                             const tl_patch *patch, size_t channel, const int64_t *values)
{
    const tli_coded_channel *coded = &trainer->codec->channels[channel];
    uint8_t flags;
    tli_tokens tokens;
    tli_tokens_open(ctx, &tokens);
    tl_status st = tli_channel_tell(ctx, patch, codec_channel_row(channel), coded->on,
                                    coded->components, values, &flags, &tokens);
    if (!st) tli_tokens_count(&tokens, trainer->counts[class_]);
    tli_tokens_close(&tokens);
    return st;
}

tl_status tli_trainer_add(tl_ctx *ctx, tli_trainer *trainer, unsigned class_, const tl_patch *patch,
                          const int64_t *const *values)
{
    tli_topology_tokens told;
    if (class_ >= TL_CLASS_COUNT)
        return tl_fail(ctx, TL_ERR_ARG, "there is no class %u of patches", class_);
    tl_status st = tli_topology_tell(ctx, &trainer->codec->lattice, patch, &told);
    if (!st) tli_tokens_count(&told.tokens, trainer->counts[class_]);
    tli_tokens_close(&told.tokens);
    for (size_t c = 0; c < trainer->codec->channel_count && !st; c++)
        if (values[c]) st = add_channel(ctx, trainer, class_, patch, c, values[c]);
    return st;
}

/* ---- distributions ---- */

static double total(const uint64_t counts[RANS_SYMBOLS])
{
    double sum = 0;
    for (int s = 0; s < RANS_SYMBOLS; s++) sum += (double)counts[s];
    return sum;
}

/* Bits of the symbols counted with a row of a table. */
static double cost(const uint64_t counts[RANS_SYMBOLS], const int16_t row[RANS_SYMBOLS])
{
    double bits = 0;
    int before = -1;
    for (int s = 0; s < RANS_SYMBOLS; before = row[s++])
        bits += (double)counts[s] * (RANS_BITS - log2(row[s] - before));
    return bits;
}

/* The distribution of counts, drawn towards that of the row prior (NULL: all symbols alike). */
static tli_distribution distribution_of(const uint64_t counts[RANS_SYMBOLS], const int16_t *prior)
{
    tli_distribution made = {0};
    double sum = total(counts);
    for (int s = 0; s < RANS_SYMBOLS; s++) {
        double before =
            prior ? (prior[s] - (s ? prior[s - 1] : -1)) / (double)RANS_ONE : 1.0 / RANS_SYMBOLS;
        double weight = prior ? PRIOR_SYMBOLS : PRIOR_SYMBOLS / RANS_SYMBOLS;
        double p = ((double)counts[s] + weight * before) / (sum + weight);
        double level = nearbyint(-4 * log2(p));
        if (p < LEAST_PROBABILITY || level > DISTRIBUTION_LAST) continue;
        made.mask |= (uint16_t)(1u << s);
        made.level[s] = (uint8_t)level;
    }
    return made;
}

static unsigned distribution_bits(const tli_distribution *distribution)
{
    unsigned bits = RANS_SYMBOLS;
    for (int s = 0; s < RANS_SYMBOLS; s++)
        bits += (distribution->mask >> s & 1) * DISTRIBUTION_BITS;
    return bits;
}

/* ---- bytes ---- */

typedef struct bit_writer {
    tli_bytes *out;
    unsigned used; /* bits of the last byte; 0: none */
    tl_status status;
} bit_writer;

static void put(bit_writer *w, uint32_t value, unsigned count)
{
    for (unsigned i = 0; i < count && !w->status; i++) {
        if (!w->used) w->status = tli_bytes_append(w->out, "", 1);
        if (w->status) return;
        w->out->bytes[w->out->count - 1] |= (uint8_t)((value >> i & 1) << w->used);
        w->used = (w->used + 1) & 7;
    }
}

static void put_distribution(bit_writer *w, const tli_distribution *distribution)
{
    put(w, distribution->mask, RANS_SYMBOLS);
    for (int s = 0; s < RANS_SYMBOLS; s++)
        if (distribution->mask >> s & 1) put(w, distribution->level[s], DISTRIBUTION_BITS);
}

static void put_group(bit_writer *w, const uint64_t (*counts)[RANS_SYMBOLS], uint32_t row_count)
{
    uint64_t sums[RANS_SYMBOLS] = {0};
    int16_t common_row[RANS_SYMBOLS], own_row[RANS_SYMBOLS];
    for (uint32_t i = 0; i < row_count; i++)
        for (int s = 0; s < RANS_SYMBOLS; s++) sums[s] += counts[i][s];
    put(w, total(sums) > 0, 1);
    if (!(total(sums) > 0)) return;
    tli_distribution common = distribution_of(sums, NULL);
    put_distribution(w, &common);
    tli_distribution_row(&common, common_row);
    for (uint32_t i = 0; i < row_count && row_count > 1; i++) {
        tli_distribution own = distribution_of(counts[i], common_row);
        tli_distribution_row(&own, own_row);
        double gain = cost(counts[i], common_row) - cost(counts[i], own_row);
        bool pays = gain > distribution_bits(&own);
        put(w, pays, 1);
        if (pays) put_distribution(w, &own);
    }
}

static tl_status put_head(const tl_codec *codec, tli_bytes *out)
{
    const tl_lattice *lattice = &codec->lattice;
    uint8_t head[TABLES_HEAD_BYTES] = {TABLES_VERSION, (uint8_t)lattice->kind};
    unsigned exponent = (unsigned)(lattice->exponent + 32768);
    for (int i = 0; i < 2; i++) {
        head[2 + i] = (uint8_t)(exponent >> 8 * i);
        head[28 + i] = (uint8_t)(codec->channel_count >> 8 * i);
    }
    for (int i = 0; i < 24; i++)
        head[4 + i] = (uint8_t)((uint64_t)lattice->origin[i / 8] >> 8 * (i % 8));
    tl_status st = tli_bytes_append(out, head, sizeof head);
    for (size_t c = 0; c < codec->channel_count && !st; c++) {
        const tli_coded_channel *channel = &codec->channels[c];
        uint8_t bytes[TABLES_CHANNEL_BYTES] = {(uint8_t)channel->code.kind, (uint8_t)channel->on};
        uint64_t step;
        memcpy(&step, &channel->code.step, sizeof step);
        for (int i = 0; i < 4; i++) bytes[2 + i] = (uint8_t)(channel->components >> 8 * i);
        for (int i = 0; i < 8; i++) bytes[6 + i] = (uint8_t)(step >> 8 * i);
        st = tli_bytes_append(out, bytes, sizeof bytes);
    }
    return st;
}

tl_status tli_trainer_write(const tli_trainer *trainer, tli_bytes *out)
{
    tl_status st = put_head(trainer->codec, out);
    bit_writer w = {out, 0, st};
    for (unsigned k = 0; k < TL_CLASS_COUNT; k++) {
        const uint64_t(*counts)[RANS_SYMBOLS] = (const uint64_t(*)[RANS_SYMBOLS])trainer->counts[k];
        tli_row_group group;
        for (size_t g = 0; tli_row_group_at(g, trainer->codec->channel_count, &group); g++)
            put_group(&w, counts + group.first, group.count);
    }
    return w.status;
}
