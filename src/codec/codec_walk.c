/* The cut-border machine, encoding side. */
#include "codec/codec_walk.h"
#include "codec/codec_border.h"
#include "codec/codec_match.h"
#include "codec/codec_model.h"
#include "mesh/mesh.h"

#include <string.h>

/* A walk under way. Old indices are those of the patch, new ones those of arrival. */
typedef struct walker {
    tl_ctx *ctx;
    const tl_patch *patch;
    tl_lidx *opposite;  /* of old tets, without what the border can't link */
    uint32_t *vert_new; /* [old vertex] or TL_NONE */
    uint32_t *tet_new;  /* [old tet] or TL_NONE */
    tli_border border;
    tli_walk *walk;
    tli_tokens *tokens;
} walker;

static bool has_vertex_twice(const uint16_t tet[4])
{
    return tet[0] == tet[1] || tet[0] == tet[2] || tet[0] == tet[3] || tet[1] == tet[2] ||
           tet[1] == tet[3] || tet[2] == tet[3];
}

/* True if the two tets lie on different sides of their common face. */
static bool turns_alike(const uint16_t a[4], uint32_t face_a, const uint16_t b[4], uint32_t face_b)
{
    const uint8_t *in_a = tli_tet_faces[face_a], *in_b = tli_tet_faces[face_b];
    for (int i = 0; i < 3; i++)
        if (a[in_a[0]] == b[in_b[i]]) return a[in_a[1]] == b[in_b[(i + 2) % 3]];
    return false;
}

/* Opposite faces of the patch; those that the border can't link are taken apart. */
static tl_status match_faces(walker *w)
{
    tl_status st = TL_OK;
    size_t count = w->patch->tet_count;
    tl_lidx *opposite = NULL;
    if (w->patch->opposite) {
        opposite = tl_mem_alloc(w->ctx, count, 4 * sizeof *opposite, &st);
        if (!st) memcpy(opposite, w->patch->opposite, count * 4 * sizeof *opposite);
    } else {
        st = tli_patch_match(w->ctx, w->patch, &opposite);
    }
    if (st) return st;
    for (uint32_t face = 0; face < 4 * count; face++) {
        uint32_t across = opposite[face];
        if (across == TL_NONE || across < face) continue;
        if (turns_alike(w->patch->tets[face >> 2], face & 3, w->patch->tets[across >> 2],
                        across & 3))
            continue;
        opposite[face] = opposite[across] = TL_NONE;
        w->walk->rematch = true;
    }
    w->opposite = opposite;
    return TL_OK;
}

static uint32_t corner_old(const walker *w, uint32_t tet, uint32_t corner)
{
    return w->walk->corners[tet] >> 2 * corner & 3;
}

/* The old face of a new one. */
static uint32_t face_old(const walker *w, uint32_t face)
{
    return 4 * w->walk->tet_old[face >> 2] + corner_old(w, face >> 2, face & 3);
}

static uint32_t open_face_old(const walker *w, uint32_t face)
{
    return face_old(w, border_tet_face(&w->border, face));
}

static void record_tet(walker *w, uint32_t old, uint32_t tet, const uint32_t corners[4])
{
    w->tet_new[old] = tet;
    w->walk->tet_old[tet] = old;
    w->walk->corners[tet] =
        (uint8_t)(corners[0] | corners[1] << 2 | corners[2] << 4 | corners[3] << 6);
}

static uint32_t new_vertex(walker *w, uint32_t old)
{
    w->walk->vert_old[w->border.vert_count] = old;
    return w->vert_new[old] = w->border.vert_count++;
}

/* Begins a component with an old tet: vertices that are there by their numbers. */
static void start(walker *w, uint32_t old)
{
    static const uint32_t straight[4] = {0, 1, 2, 3};
    uint32_t v[4];
    for (uint32_t c = 0; c < 4; c++) {
        uint32_t vertex = w->patch->tets[old][c];
        bool is_new = w->vert_new[vertex] == TL_NONE;
        tokens_symbol(w->tokens, STATE_CONNECTIVITY, ROW_START + c, is_new);
        if (!is_new)
            tokens_plain(w->tokens, w->vert_new[vertex], model_bits_for(w->border.vert_count));
        v[c] = is_new ? new_vertex(w, vertex) : w->vert_new[vertex];
    }
    record_tet(w, old, tli_border_start(&w->border, v), straight);
}

/* The tet beyond is there: which of the faces that wait at p with the gate's vertices is it. */
static void glue(walker *w, const tli_gate *gate, uint32_t tet_face)
{
    tli_reverse found = tli_border_reverse(&w->border, gate, TL_NONE, tet_face);
    tokens_symbol(w->tokens, STATE_CONNECTIVITY, model_op_row(gate), OP_GLUE);
    tokens_plain(w->tokens, found.rank, model_bits_for(found.count));
    tli_border_glue(&w->border, gate, found.face);
}

/* Corners of the old tet beyond the gate, as (p, a, b, d). */
static void order_corners(const walker *w, const tli_gate *gate, uint32_t across,
                          uint32_t corners[4])
{
    const uint16_t *tet = w->patch->tets[across >> 2];
    corners[3] = across & 3;
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t vertex = w->walk->vert_old[gate->vertex[k]];
        for (uint32_t c = 0; c < 4; c++)
            if (c != corners[3] && tet[c] == vertex) corners[k] = c;
    }
}

/* Says a vertex that is there: by its place around p, a or b, else by its number. */
static void tell_join(walker *w, const tli_gate *gate, uint32_t d)
{
    static const uint32_t elsewhere[3] = {0, JOIN_A, JOIN_B};
    uint32_t first_row = 0, count[3], place[3], around[UMBRELLA_MAX];
    for (uint32_t k = 0; k < 3; k++) {
        count[k] = border_umbrella(&w->border, gate, k, around);
        for (place[k] = 0; place[k] < count[k] && around[place[k]] != d;) place[k]++;
        if (k == 0) first_row = model_join_row(0, count[0]);
        if (place[k] == count[k] || model_join_symbol(place[k], count[k]) >= JOIN_A) continue;
        if (k > 0) tokens_symbol(w->tokens, STATE_CONNECTIVITY, first_row, elsewhere[k]);
        tokens_symbol(w->tokens, STATE_CONNECTIVITY, model_join_row(k, count[k]),
                      model_join_symbol(place[k], count[k]));
        return;
    }
    tokens_symbol(w->tokens, STATE_CONNECTIVITY, first_row, JOIN_NUMBER);
    tokens_plain(w->tokens, d, model_bits_for(w->border.vert_count));
}

/* Adds the old tet beyond the gate, which is not there yet. */
static void grow(walker *w, const tli_gate *gate, uint32_t across)
{
    uint32_t old = across >> 2, corners[4] = {0}, mask = 0, row = model_op_row(gate);
    order_corners(w, gate, across, corners);
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t beyond = w->opposite[4 * old + corners[k]];
        bool linked = beyond != TL_NONE && (gate->open >> k & 1) &&
                      open_face_old(w, gate_end(gate, k) >> 2) == beyond;
        mask |= (uint32_t)linked << k;
    }
    uint32_t vertex = w->patch->tets[old][corners[3]], d = w->vert_new[vertex];
    if (mask || d == TL_NONE) {
        tokens_symbol(w->tokens, STATE_CONNECTIVITY, row, OP_GROW + mask);
        if (d == TL_NONE) d = new_vertex(w, vertex);
    } else {
        tokens_symbol(w->tokens, STATE_CONNECTIVITY, row, OP_JOIN);
        tell_join(w, gate, d);
    }
    record_tet(w, old, tli_border_grow(&w->border, gate, mask, d), corners);
}

/* All that is around vertex p. */
static void finish_vertex(walker *w, uint32_t p)
{
    tli_border *b = &w->border;
    uint32_t face;
    tli_border_begin(b, p);
    while ((face = border_next(b)) != TL_NONE) {
        tli_gate gate;
        border_look(b, face, &gate);
        uint32_t across = w->opposite[open_face_old(w, face)];
        if (across == TL_NONE) {
            tokens_symbol(w->tokens, STATE_CONNECTIVITY, model_op_row(&gate), OP_BORDER);
            border_shut(b, &gate);
        } else if (w->tet_new[across >> 2] == TL_NONE) {
            grow(w, &gate, across);
        } else {
            uint32_t tet = w->tet_new[across >> 2], k = 0;
            while (corner_old(w, tet, k) != (across & 3)) k++;
            glue(w, &gate, 4 * tet + k);
        }
    }
    tli_border_end(b);
}

static void walk_all(walker *w)
{
    uint32_t odd_at = w->patch->tet_count;
    for (uint32_t t = w->patch->tet_count; t-- > 0;)
        if (has_vertex_twice(w->patch->tets[t])) {
            static const uint32_t straight[4] = {0, 1, 2, 3};
            record_tet(w, t, --odd_at, straight);
            for (uint32_t face = 0; face < 4; face++)
                w->border.opposite[4 * odd_at + face] = TL_NONE;
            w->walk->odd_count++;
        }
    for (uint32_t t = 0; t < w->patch->tet_count; t++) {
        if (w->tet_new[t] != TL_NONE) continue;
        start(w, t);
        for (uint32_t p = 0; (p = border_turn(&w->border, p)) != TL_NONE;) finish_vertex(w, p);
    }
    for (uint32_t v = 0; v < w->patch->vert_count; v++)
        if (w->vert_new[v] == TL_NONE) new_vertex(w, v);
}

static tl_status open_walker(walker *w)
{
    tl_status st = TL_OK;
    tli_walk *walk = w->walk;
    size_t vert_count = w->patch->vert_count, tet_count = w->patch->tet_count;
    walk->vert_old = tl_mem_alloc(w->ctx, vert_count, sizeof *walk->vert_old, &st);
    walk->tet_old = tl_mem_alloc(w->ctx, tet_count, sizeof *walk->tet_old, &st);
    walk->corners = tl_mem_alloc(w->ctx, tet_count, 1, &st);
    w->vert_new = tl_mem_alloc(w->ctx, vert_count, sizeof *w->vert_new, &st);
    w->tet_new = tl_mem_alloc(w->ctx, tet_count, sizeof *w->tet_new, &st);
    if (!st) st = tli_border_open(w->ctx, (uint32_t)vert_count, (uint32_t)tet_count, &w->border);
    if (st) return st;
    for (size_t v = 0; v < vert_count; v++) w->vert_new[v] = TL_NONE;
    for (size_t t = 0; t < tet_count; t++) w->tet_new[t] = TL_NONE;
    return match_faces(w);
}

tl_status tli_walk_open(tl_ctx *ctx, const tl_patch *patch, tli_walk *walk, tli_tokens *tokens)
{
    walker w = {.ctx = ctx, .patch = patch, .walk = walk, .tokens = tokens};
    *walk = (tli_walk){0};
    tl_status st = open_walker(&w);
    if (!st) {
        walk_all(&w);
        st = tokens->status;
    }
    walk->opposite = (uint32_t(*)[4])(void *)w.border.opposite;
    walk->on_border = w.border.on_border;
    w.border.on_border = NULL;
    tl_mem_free(ctx, w.opposite);
    tl_mem_free(ctx, w.border.tets);
    tli_border_close(ctx, &w.border);
    tl_mem_free(ctx, w.vert_new);
    tl_mem_free(ctx, w.tet_new);
    return st;
}

void tli_walk_close(tl_ctx *ctx, tli_walk *walk)
{
    tl_mem_free(ctx, walk->vert_old);
    tl_mem_free(ctx, walk->tet_old);
    tl_mem_free(ctx, walk->corners);
    tl_mem_free(ctx, walk->opposite);
    tl_mem_free(ctx, walk->on_border);
}
