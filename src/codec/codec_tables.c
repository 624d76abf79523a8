/* Tables out of bytes. */
#include "codec/codec_tables.h"
#include "codec/codec_read.h"

#include <math.h>
#include <string.h>

void tli_distribution_row(const tli_distribution *distribution, int16_t row[RANS_SYMBOLS])
{
    static const uint32_t roots[4] = {1u << 24, 14107901, 11863283, 9975792}; /* 2^(24 - i/4) */
    uint32_t width[RANS_SYMBOLS], widest = 0, rest = RANS_ONE, end = 0;
    uint64_t sum = 0, weight[RANS_SYMBOLS];
    for (uint32_t s = 0; s < RANS_SYMBOLS; s++) {
        uint32_t level = distribution->level[s];
        weight[s] = distribution->mask >> s & 1 ? roots[level & 3] >> (level >> 2) : 0;
        if (!distribution->mask) weight[s] = 1;
        sum += weight[s];
    }
    for (uint32_t s = 0; s < RANS_SYMBOLS; s++) {
        width[s] = 1 + (uint32_t)(weight[s] * (RANS_ONE - RANS_SYMBOLS) / sum);
        rest -= width[s];
        if (width[s] > width[widest]) widest = s;
    }
    width[widest] += rest;
    for (uint32_t s = 0; s < RANS_SYMBOLS; s++) {
        end += width[s];
        row[s] = (int16_t)(end - 1);
    }
}

bool tli_row_group_at(size_t index, size_t channel_count, tli_row_group *group)
{
    static const tli_row_group fixed[] = {{ROW_JOIN, JOIN_ROWS},
                                          {ROW_JOIN + JOIN_ROWS, JOIN_ROWS},
                                          {ROW_START, ROW_SHARED - ROW_START},
                                          {ROW_SHARED, ROW_REGION - ROW_SHARED},
                                          {ROW_REGION, REGION_ROWS},
                                          {ROW_MODE, MODE_ROWS},
                                          {ROW_PLACE, PLACE_GROUPS * NUMBER_ROWS}};
    size_t fixed_count = sizeof fixed / sizeof *fixed;
    if (index < OP_STATES) {
        group->first = ROW_OP + (uint32_t)index * OP_STATE_ROWS;
        group->count = OP_STATE_ROWS;
        return true;
    }
    index -= OP_STATES;
    if (index < fixed_count) {
        *group = fixed[index];
        return true;
    }
    index -= fixed_count;
    if (index / 2 >= channel_count) return false;
    uint32_t first = codec_channel_row(index / 2);
    group->first = index % 2 ? first + NUMBER_ROWS : first;
    group->count = index % 2 ? CHANNEL_ROWS - NUMBER_ROWS : NUMBER_ROWS;
    return true;
}

static const char *find_wrong(const tl_lattice *lattice, const tli_coded_channel *channels,
                              size_t channel_count)
{
    if (lattice->kind > TL_PLACE_FLOAT64) return "places of an unknown kind";
    if (lattice->exponent < -LATTICE_EXPONENT_MAX || lattice->exponent > LATTICE_EXPONENT_MAX)
        return "a lattice with too large an exponent";
    for (int a = 0; a < 3; a++)
        if (lattice->origin[a] < -LATTICE_ORIGIN_MAX || lattice->origin[a] > LATTICE_ORIGIN_MAX)
            return "a lattice with too large an origin";
    if (channel_count > TABLES_CHANNELS_MAX) return "too many channels";
    for (size_t c = 0; c < channel_count; c++) {
        const tl_value_code *code = &channels[c].code;
        if (code->kind > TL_VALUE_INTEGER) return "values of an unknown kind";
        if (code->kind == TL_VALUE_LATTICE && !(code->step > 0 && isfinite(code->step)))
            return "a channel whose step is not positive";
        if (channels[c].on > TL_ON_TET) return "a channel on unknown elements";
        if (channels[c].components == 0) return "a channel without components";
    }
    return NULL;
}

tl_status tli_codec_create(tl_ctx *ctx, const tl_lattice *lattice,
                           const tli_coded_channel *channels, size_t channel_count,
                           tl_codec **codec, const char **wrong)
{
    tl_status st = TL_OK;
    *codec = NULL;
    *wrong = find_wrong(lattice, channels, channel_count);
    if (*wrong) return TL_OK;
    tl_codec *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    made->lattice = *lattice;
    made->channel_count = channel_count;
    made->row_count = codec_channel_row(channel_count);
    made->channels = tl_mem_alloc(ctx, channel_count, sizeof *made->channels, &st);
    for (unsigned k = 0; k < TL_CLASS_COUNT; k++)
        made->tables[k].row_of =
            tl_mem_alloc(ctx, made->row_count, sizeof *made->tables[k].row_of, &st);
    if (!st && channel_count)
        memcpy(made->channels, channels, channel_count * sizeof *made->channels);
    if (st)
        tl_codec_destroy(ctx, made);
    else
        *codec = made;
    return st;
}

void tl_codec_destroy(tl_ctx *ctx, tl_codec *codec)
{
    if (!codec) return;
    for (unsigned k = 0; k < TL_CLASS_COUNT; k++) {
        tl_mem_free(ctx, codec->tables[k].row_of);
        tl_mem_free(ctx, codec->tables[k].rows);
    }
    tl_mem_free(ctx, codec->channels);
    tl_mem_free(ctx, codec);
}

/* ---- reading ---- */

typedef struct bit_reader {
    const uint8_t *bytes;
    size_t bit, bit_count;
    bool overrun;
} bit_reader;

static uint32_t take(bit_reader *r, unsigned count)
{
    uint32_t value = 0;
    if (count > r->bit_count - r->bit) {
        r->overrun = true;
        return 0;
    }
    for (unsigned i = 0; i < count; i++, r->bit++)
        value |= (uint32_t)(r->bytes[r->bit >> 3] >> (r->bit & 7) & 1) << i;
    return value;
}

static void take_distribution(bit_reader *r, tli_distribution *distribution)
{
    distribution->mask = (uint16_t)take(r, RANS_SYMBOLS);
    for (uint32_t s = 0; s < RANS_SYMBOLS; s++)
        if (distribution->mask >> s & 1)
            distribution->level[s] = (uint8_t)take(r, DISTRIBUTION_BITS);
}

/* Fills a table, whose rows have room for those of all groups and elements. */
static size_t take_class(bit_reader *r, size_t channel_count, tli_table *table)
{
    tli_row_group group;
    size_t count = 0;
    for (size_t g = 0; tli_row_group_at(g, channel_count, &group); g++) {
        tli_distribution common = {0}, own;
        bool present = take(r, 1);
        size_t common_at = count++;
        if (present) take_distribution(r, &common);
        tli_distribution_row(&common, table->rows[common_at]);
        for (uint32_t i = 0; i < group.count; i++) {
            bool has_own = present && group.count > 1 && take(r, 1);
            table->row_of[group.first + i] = (uint16_t)(has_own ? count : common_at);
            if (!has_own) continue;
            take_distribution(r, &own);
            tli_distribution_row(&own, table->rows[count++]);
        }
    }
    return count;
}

/* All classes; their rows take as much memory as they need. */
static tl_status take_tables(tl_ctx *ctx, bit_reader *r, tl_codec *codec)
{
    tl_status st = TL_OK;
    size_t most = 2 * codec->row_count; /* a group has a row at least */
    for (unsigned k = 0; k < TL_CLASS_COUNT && !st; k++) {
        tli_table *table = &codec->tables[k];
        table->rows = tl_mem_alloc(ctx, most, sizeof *table->rows, &st);
        if (st) break;
        size_t count = take_class(r, codec->channel_count, table);
        table->rows = tl_mem_resize(ctx, table->rows, count, sizeof *table->rows, &st);
    }
    return st;
}

static double step_of(int64_t bits)
{
    double step;
    memcpy(&step, &bits, sizeof step);
    return step;
}

/* The channels behind the head; channels [count]. */
static void read_channels(const uint8_t *bytes, size_t count, tli_coded_channel *channels)
{
    for (size_t c = 0; c < count; c++, bytes += TABLES_CHANNEL_BYTES) {
        channels[c].code.kind = (tl_value_kind)bytes[0];
        channels[c].on = (tl_on)bytes[1];
        channels[c].components = rans_word(bytes + 2);
        channels[c].code.step = step_of(read_raw(bytes + 6, 0, 8));
    }
}

static tl_status read_all(tl_ctx *ctx, const uint8_t *bytes, size_t byte_count, tl_codec **codec,
                          const char **wrong)
{
    tl_status st = TL_OK;
    tl_lattice lattice = {.kind = (tl_place_kind)bytes[1],
                          .exponent = (int)(bytes[2] | (unsigned)bytes[3] << 8) - 32768};
    size_t channel_count = bytes[28] | (size_t)bytes[29] << 8;
    size_t tables_ofs = TABLES_HEAD_BYTES + channel_count * TABLES_CHANNEL_BYTES;
    for (int a = 0; a < 3; a++) lattice.origin[a] = read_raw(bytes + 4, (size_t)a, 8);
    if (byte_count < tables_ofs) {
        *wrong = "end inside their channels";
        return TL_OK;
    }
    tli_coded_channel *channels = tl_mem_alloc(ctx, channel_count, sizeof *channels, &st);
    if (!st) {
        read_channels(bytes + TABLES_HEAD_BYTES, channel_count, channels);
        st = tli_codec_create(ctx, &lattice, channels, channel_count, codec, wrong);
    }
    tl_mem_free(ctx, channels);
    if (st || *wrong) return st;
    bit_reader r = {bytes + tables_ofs, 0, 8 * (byte_count - tables_ofs), false};
    st = take_tables(ctx, &r, *codec);
    if (st) return st;
    if (r.overrun)
        *wrong = "end inside a table";
    else if (r.bit_count - r.bit >= 8 || take(&r, (unsigned)(r.bit_count - r.bit)))
        *wrong = "go on behind the last table";
    return TL_OK;
}

tl_status tl_codec_read(tl_ctx *ctx, const uint8_t *bytes, size_t byte_count, tl_codec **codec)
{
    const char *wrong = NULL;
    tl_status st = TL_OK;
    *codec = NULL;
    if (byte_count < TABLES_HEAD_BYTES)
        wrong = "end inside their head";
    else if (bytes[0] != TABLES_VERSION)
        wrong = "are of an unknown version";
    else
        st = read_all(ctx, bytes, byte_count, codec, &wrong);
    if (!st && wrong)
        st = tl_fail(ctx, TL_ERR_FORMAT, "the codec's tables of %zu bytes: %s", byte_count, wrong);
    if (st) {
        tl_codec_destroy(ctx, *codec);
        *codec = NULL;
    }
    return st;
}

const tl_lattice *tl_codec_lattice(const tl_codec *codec)
{
    return &codec->lattice;
}
