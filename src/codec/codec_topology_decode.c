/* Bytes to the topology of a patch. Whatever the bytes are, each step either adds a tet, which the
 * head has counted, or closes a face that waits; so it ends. What can't be is found where it
 * happens or, since the state of the stream must end where the encoder began, at the end. */
#include "codec/codec_border.h"
#include "codec/codec_kin.h"
#include "codec/codec_match.h"
#include "codec/codec_read.h"
#include "codec/codec_topology.h"

#include <string.h>

/* Why a stream is none; NULL while it may be one. */
typedef struct reader {
    tli_stream stream;
    tli_table table;
    tli_border border;
    tl_patch *patch;
    uint32_t odd_count;
    unsigned flags;
    const char *wrong;
} reader;

/* A vertex that is there; others than those of the stream are wrong. */
static uint32_t read_vertex(reader *r, uint32_t count)
{
    uint32_t vertex = (uint32_t)stream_bits(&r->stream, model_bits_for(count));
    if (vertex < count) return vertex;
    r->wrong = "names a vertex that is not there";
    return 0;
}

static uint32_t new_vertex(reader *r)
{
    if (r->border.vert_count == r->border.vert_capacity) {
        r->wrong = "has more vertices than its head says";
        return 0;
    }
    return r->border.vert_count++;
}

static void read_start(reader *r)
{
    uint32_t v[4];
    for (uint32_t c = 0; c < 4; c++) {
        bool is_new =
            stream_symbol(&r->stream, STATE_CONNECTIVITY, codec_row(&r->table, ROW_START + c)) == 1;
        v[c] = is_new ? new_vertex(r) : read_vertex(r, r->border.vert_count);
    }
    if (r->wrong || v[0] == v[1] || v[0] == v[2] || v[0] == v[3] || v[1] == v[2] || v[1] == v[3] ||
        v[2] == v[3]) {
        r->wrong = r->wrong ? r->wrong : "begins with a tet that names a vertex twice";
        return;
    }
    tli_border_start(&r->border, v);
}

static void read_glue(reader *r, const tli_gate *gate)
{
    uint32_t count = tli_border_reverse(&r->border, gate, 0, TL_NONE).count;
    uint32_t rank = (uint32_t)stream_bits(&r->stream, model_bits_for(count));
    if (rank < count)
        tli_border_glue(&r->border, gate, tli_border_reverse(&r->border, gate, rank, TL_NONE).face);
    else
        r->wrong = "glues a face to none";
}

/* The vertex of a tet that is glued to nothing but the gate. */
static uint32_t read_join(reader *r, const tli_gate *gate)
{
    uint32_t k = 0, around[UMBRELLA_MAX], count = border_umbrella(&r->border, gate, 0, around);
    uint32_t symbol = stream_symbol(&r->stream, STATE_CONNECTIVITY,
                                    codec_row(&r->table, model_join_row(0, count)));
    if (symbol == JOIN_NUMBER) return read_vertex(r, r->border.vert_count);
    if (symbol >= JOIN_A) {
        k = symbol == JOIN_A ? 1 : 2;
        count = border_umbrella(&r->border, gate, k, around);
        symbol = stream_symbol(&r->stream, STATE_CONNECTIVITY,
                               codec_row(&r->table, model_join_row(k, count)));
    }
    uint32_t place = model_join_place(symbol, count);
    if (place < count) return around[place];
    r->wrong = "joins a tet to a vertex that is not around";
    return 0;
}

/* Adds a tet if it can be one. */
static BORDER_INLINE void add_tet(reader *r, const tli_gate *gate, uint32_t mask, uint32_t d)
{
    if (d == gate->vertex[0] || d == gate->vertex[1] || d == gate->vertex[2])
        r->wrong = "joins a tet to a vertex that it has";
    if (r->border.tet_count == r->border.tet_capacity)
        r->wrong = "has more tets than its head says";
    if (!r->wrong) border_grow(&r->border, gate, mask, d);
}

/* The tet that is glued over the edges of mask, a constant: their faces are open and meet at d. */
static BORDER_INLINE void add_glued_tet(reader *r, const tli_gate *gate, uint32_t mask)
{
    uint32_t d = gate->apex[mask & 1 ? 0 : mask & 2 ? 1 : 2];
    if ((mask & ~gate->open) || ((mask & 2) && gate->apex[1] != d) ||
        ((mask & 4) && gate->apex[2] != d))
        r->wrong = "glues a tet to faces that are not its own";
    add_tet(r, gate, mask, d);
}

/* What is beyond the gate. A case for each mask, so that none is looked at bit by bit. */
static inline void read_operation(reader *r, const tli_gate *gate)
{
    switch (
        stream_symbol(&r->stream, STATE_CONNECTIVITY, codec_row(&r->table, model_op_row(gate)))) {
    case OP_BORDER: border_shut(&r->border, gate); break;
    case OP_GROW: add_tet(r, gate, 0, new_vertex(r)); break;
    case OP_GROW + 1: add_glued_tet(r, gate, 1); break;
    case OP_GROW + 2: add_glued_tet(r, gate, 2); break;
    case OP_GROW + 3: add_glued_tet(r, gate, 3); break;
    case OP_GROW + 4: add_glued_tet(r, gate, 4); break;
    case OP_GROW + 5: add_glued_tet(r, gate, 5); break;
    case OP_GROW + 6: add_glued_tet(r, gate, 6); break;
    case OP_GROW + 7: add_glued_tet(r, gate, 7); break;
    case OP_JOIN: add_tet(r, gate, 0, read_join(r, gate)); break;
    case OP_GLUE: read_glue(r, gate); break;
    default: r->wrong = "has an operation that is none"; break;
    }
}

static void read_vertex_star(reader *r, uint32_t p)
{
    tli_border *b = &r->border;
    uint32_t face;
    tli_border_begin(b, p);
    while (!r->wrong && (face = border_next(b)) != TL_NONE) {
        tli_gate gate;
        border_look(b, face, &gate);
        read_operation(r, &gate);
    }
    tli_border_end(b);
}

/* Tets with a vertex twice stand last, by their numbers. */
static void read_odd_tets(reader *r)
{
    tl_patch *patch = r->patch;
    for (uint32_t t = patch->tet_count - r->odd_count; t < patch->tet_count && !r->wrong; t++)
        for (int c = 0; c < 4; c++) {
            patch->tets[t][c] = (uint16_t)read_vertex(r, patch->vert_count);
            patch->opposite[t][c] = TL_NONE;
        }
}

/* Pairs the faces that the border could not link, too. */
static tl_status rematch(tl_ctx *ctx, reader *r)
{
    tl_patch *patch = r->patch;
    tl_lidx *opposite = NULL;
    tl_status st = tli_patch_match(ctx, patch, &opposite);
    if (st) return st;
    if (memcmp(opposite, patch->opposite, patch->tet_count * sizeof *patch->opposite) == 0)
        r->wrong = "says that faces are left to be paired, but none are";
    tl_mem_free(ctx, patch->opposite);
    patch->opposite = (uint32_t(*)[4])(void *)opposite;
    return TL_OK;
}

static tl_status read_connectivity(tl_ctx *ctx, reader *r)
{
    tl_patch *patch = r->patch;
    uint32_t plain = patch->tet_count - r->odd_count;
    tl_status st = tli_border_open(ctx, patch->vert_count, patch->tet_count, &r->border);
    patch->tets = (uint16_t(*)[4])(void *)r->border.tets;
    patch->opposite = (uint32_t(*)[4])(void *)r->border.opposite;
    if (!st) {
        r->border.tet_capacity = plain;
        while (r->border.tet_count < plain && !r->wrong) {
            read_start(r);
            for (uint32_t p = 0; !r->wrong && (p = border_turn(&r->border, p)) != TL_NONE;)
                read_vertex_star(r, p);
        }
        if (!r->wrong) read_odd_tets(r);
    }
    if (!st && !r->wrong && (r->flags & TOPOLOGY_REMATCH)) st = rematch(ctx, r);
    return st;
}

static void read_shared(reader *r, const uint8_t *on_border)
{
    uint32_t last[2] = {0, 0};
    for (uint32_t v = 0; v < r->patch->vert_count; v++) {
        uint32_t kind = on_border[v];
        uint32_t shared = stream_symbol(&r->stream, v & (TOPOLOGY_STATES - 1),
                                        codec_row(&r->table, ROW_SHARED + 2 * kind + last[kind]));
        if (shared > 1) r->wrong = "has a shared flag that is neither 0 nor 1";
        last[kind] = shared & 1;
        r->patch->shared[v] = (uint8_t)last[kind];
    }
}

static void read_regions(reader *r)
{
    tli_regions regions = {{0}};
    tl_patch *patch = r->patch;
    for (uint32_t t = 0; t < patch->tet_count; t++) {
        uint32_t row, symbol;
        int32_t guess = tli_region_guess(patch, t, &row);
        symbol = stream_symbol(&r->stream, t & (TOPOLOGY_STATES - 1),
                               codec_row(&r->table, ROW_REGION + row));
        patch->regions[t] = guess;
        if (symbol == 0) continue;
        patch->regions[t] = symbol - 1 < REGION_RECENT
                                ? regions.recent[symbol - 1]
                                : (int32_t)(uint32_t)stream_bits(&r->stream, 32);
        regions_use(&regions, symbol - 1, patch->regions[t]);
    }
}

static void read_places(reader *r, const tl_lattice *lattice, const tli_kin *kin)
{
    tl_patch *patch = r->patch;
    const int64_t(*places)[3] = (const int64_t(*)[3])patch->places;
    tli_scale scales[PLACE_GROUPS][3] = {{{0}}};
    tli_shifts shifts = {{{0}}};
    uint32_t mode_before = 0;
    bool outside = false;
    for (int i = 0; i < 6 && (r->flags & TOPOLOGY_SHIFTED); i++)
        shifts.by[i / 3][i % 3] = (uint8_t)stream_bits(&r->stream, SHIFT_BITS);
    for (int a = 0; a < 3 && patch->vert_count > 0; a++)
        patch->places[0][a] =
            topology_place_of(lattice, stream_bits(&r->stream, topology_place_bits(lattice)));
    for (uint32_t v = 1; v < patch->vert_count && !r->wrong; v++) {
        tli_guess guess;
        uint32_t mode = 0, group;
        tli_kin_place(kin, v, places, &guess);
        if (guess.has_elder) {
            mode = stream_symbol(
                &r->stream, STATE_MODE,
                codec_row(&r->table, topology_mode_row(guess.kin_count, mode_before)));
            mode_before = mode;
            if (mode >= GUESS_MODES) {
                r->wrong = "has a guess of no mode";
                break;
            }
        }
        group = mode ? PLACE_GROUPS - 1 : guess.group;
        for (int a = 0; a < 3; a++) {
            uint32_t shift = shifts.by[patch->shared[v]][a];
            uint64_t base = (uint64_t)places[0][a];
            int64_t expected =
                topology_shifted((int64_t)(kin_guess(&guess, mode, places, a) - base), shift);
            uint32_t around = guess.around[a] > shift ? guess.around[a] - shift : 0;
            int64_t beside =
                read_number(&r->stream, (uint32_t)a, &r->table, ROW_PLACE + group * NUMBER_ROWS,
                            &scales[group][a], around);
            uint64_t place = ((uint64_t)beside + (uint64_t)expected) << shift;
            patch->places[v][a] = (int64_t)(place + base);
            outside |= topology_is_outside(lattice, patch->places[v][a]);
        }
    }
    if (outside && !r->wrong) r->wrong = "has a place outside of the lattice";
}

static tl_status read_rest(tl_ctx *ctx, const tl_lattice *lattice, reader *r)
{
    tl_status st = TL_OK;
    tl_patch *patch = r->patch;
    tli_kin kin = {0};
    patch->shared = tl_mem_alloc(ctx, patch->vert_count, 1, &st);
    patch->places = tl_mem_alloc(ctx, patch->vert_count, sizeof *patch->places, &st);
    if (r->flags & TOPOLOGY_REGIONS)
        patch->regions = tl_mem_alloc(ctx, patch->tet_count, sizeof *patch->regions, &st);
    if (!st) st = tli_kin_open(ctx, patch, &kin);
    if (!st) {
        read_shared(r, r->border.on_border);
        read_places(r, lattice, &kin);
        if (patch->regions) read_regions(r);
    }
    tli_kin_close(ctx, &kin);
    return st;
}

/* The head of a blob, checked against its size. */
static const char *read_head(reader *r, const uint8_t *bytes, size_t byte_count)
{
    if (byte_count < TOPOLOGY_HEAD_BYTES) return "ends inside its head";
    r->flags = bytes[1];
    r->patch->vert_count = (uint32_t)bytes[2] | (uint32_t)bytes[3] << 8;
    r->patch->tet_count = (uint32_t)bytes[4] | (uint32_t)bytes[5] << 8 | (uint32_t)bytes[6] << 16;
    r->odd_count = (uint32_t)bytes[7] | (uint32_t)bytes[8] << 8 | (uint32_t)bytes[9] << 16;
    if (r->flags & ~(bytes[0] == BLOB_RAW ? TOPOLOGY_RAW_FLAGS : TOPOLOGY_CODED_FLAGS))
        return "has unknown flags";
    if (r->patch->tet_count > TL_PATCH_TETS_MAX) return "has too many tets";
    if (r->patch->vert_count > TL_PATCH_VERTS_MAX) return "has too many vertices";
    if (r->odd_count > (bytes[0] == BLOB_RAW ? 0 : r->patch->tet_count))
        return "has more odd tets than tets";
    if (byte_count < model_least_bytes(r->patch->tet_count)) return "has more tets than bytes hold";
    return NULL;
}

static tl_status decode_coded(tl_ctx *ctx, const tl_codec *codec, const uint8_t *bytes,
                              size_t byte_count, reader *r)
{
    tl_status st = TL_OK;
    if (!stream_begin(&r->stream, bytes + TOPOLOGY_HEAD_BYTES, byte_count - TOPOLOGY_HEAD_BYTES,
                      TOPOLOGY_STATES)) {
        r->wrong = "ends before its stream begins";
        return TL_OK;
    }
    st = read_connectivity(ctx, r);
    if (!st && !r->wrong && r->border.vert_count > r->patch->vert_count)
        r->wrong = "has more vertices than its head says";
    if (!st && !r->wrong) st = read_rest(ctx, &codec->lattice, r);
    if (!st && !r->wrong &&
        !stream_is_done(&r->stream, byte_count == model_least_bytes(r->patch->tet_count)))
        r->wrong = "does not end where its tets end";
    tli_border_close(ctx, &r->border);
    return st;
}

tl_status tl_topology_decode(tl_ctx *ctx, const tl_codec *codec, unsigned class_,
                             const uint8_t *bytes, size_t byte_count, tl_patch **patch)
{
    tl_status st = TL_OK;
    reader r = {0};
    *patch = NULL;
    if (class_ != TL_CLASS_RAW && (class_ >= TL_CLASS_COUNT || !codec))
        return tl_fail(ctx, TL_ERR_ARG, "there is no class %u of patches", class_);
    r.patch = tl_mem_zalloc(ctx, 1, sizeof *r.patch, &st);
    if (st) return st;
    r.wrong = read_head(&r, bytes, byte_count);
    if (!r.wrong && bytes[0] != (class_ == TL_CLASS_RAW ? BLOB_RAW : BLOB_CODED))
        r.wrong = "is of another kind than its class";
    if (!r.wrong && class_ == TL_CLASS_RAW) {
        st = tli_topology_read_raw(ctx, bytes, byte_count, r.flags, r.patch, &r.wrong);
    } else if (!r.wrong) {
        r.table = codec->tables[class_];
        st = decode_coded(ctx, codec, bytes, byte_count, &r);
    }
    if (!st && r.wrong)
        st = tl_fail(ctx, TL_ERR_FORMAT, "a topology of %zu bytes, %u vertices and %u tets %s",
                     byte_count, r.patch->vert_count, r.patch->tet_count, r.wrong);
    if (st)
        tl_patch_destroy(ctx, r.patch);
    else
        *patch = r.patch;
    return st;
}
