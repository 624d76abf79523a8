/* The tables and the memory of the cut-border, and what is rare. */
#include "codec/codec_border.h"

#include <string.h>

const uint8_t tli_border_turned[3][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}};
const uint8_t tli_border_back[3][3] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}};

/* Corners of face i of a tet, so that its normal points out of a positive tet, and their positions.
 */
static const uint8_t corners_of[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
static const uint8_t positions_of[4][4] = {{3, 0, 1, 2}, {0, 3, 2, 1}, {0, 1, 3, 2}, {0, 2, 1, 3}};

static void clear_queue(tli_border *b, uint32_t vertex)
{
    *border_head(b, vertex) = TL_NONE;
    b->tail[vertex] = 4 * b->tet_room + vertex;
}

tl_status tli_border_open(tl_ctx *ctx, uint32_t vert_capacity, uint32_t tet_capacity,
                          tli_border *border)
{
    tl_status st = TL_OK;
    size_t words = ((size_t)vert_capacity + 63) / 64;
    *border = (tli_border){.vert_capacity = vert_capacity,
                           .tet_capacity = tet_capacity,
                           .tet_room = tet_capacity,
                           .turn = TL_NONE};
    border->tets = tl_mem_alloc(ctx, tet_capacity, 4 * sizeof *border->tets, &st);
    border->opposite = tl_mem_alloc(ctx, tet_capacity, 4 * sizeof *border->opposite, &st);
    border->links = tl_mem_alloc(ctx, tet_capacity, 16 * sizeof *border->links, &st);
    border->vertices = tl_mem_alloc(ctx, tet_capacity, 16 * sizeof *border->vertices, &st);
    border->next =
        tl_mem_alloc(ctx, 4 * (size_t)tet_capacity + vert_capacity, sizeof *border->next, &st);
    border->tail = tl_mem_alloc(ctx, vert_capacity, sizeof *border->tail, &st);
    border->waiting = tl_mem_zalloc(ctx, words, sizeof *border->waiting, &st);
    border->on_border = tl_mem_zalloc(ctx, vert_capacity, 1, &st);
    if (!st)
        for (uint32_t v = 0; v < vert_capacity; v++) clear_queue(border, v);
    return st;
}

void tli_border_close(tl_ctx *ctx, tli_border *border)
{
    tl_mem_free(ctx, border->links);
    tl_mem_free(ctx, border->vertices);
    tl_mem_free(ctx, border->next);
    tl_mem_free(ctx, border->tail);
    tl_mem_free(ctx, border->waiting);
    tl_mem_free(ctx, border->on_border);
}

/* Lets a face have a place, if its smallest vertex has its turn and there is one, else wait. */
static void wait_somewhere(tli_border *b, uint32_t face)
{
    uint32_t least = b->vertices[4 * (size_t)face];
    if (least == b->turn && b->place_count == PLACE_COUNT) tli_border_move_up(b);
    if (least == b->turn && b->place_count < PLACE_COUNT)
        border_take_place(b, face);
    else
        border_queue(b, least, face);
}

uint32_t tli_border_start(tli_border *b, const uint32_t vertices[4])
{
    uint32_t tet = b->tet_count++, face[4], turn[4];
    for (uint32_t i = 0; i < 4; i++) {
        const uint8_t *c = corners_of[i];
        uint32_t v0 = vertices[c[0]], v1 = vertices[c[1]], v2 = vertices[c[2]];
        b->tets[4 * (size_t)tet + i] = (uint16_t)vertices[i];
        turn[i] = border_least(v0, v1, v2);
        face[i] = border_add_face(b, 4 * tet + i, turn[i], v0, v1, v2, PLACE_NONE);
    }
    /* The edge of face i that does not have corner j is that with face j. */
    for (uint32_t i = 0; i < 4; i++)
        for (uint32_t j = i + 1; j < 4; j++)
            border_link(b, border_slot(face[i], turn[i], positions_of[i][j]),
                        border_slot(face[j], turn[j], positions_of[j][i]), LINK_ONE);
    for (uint32_t i = 0; i < 4; i++) wait_somewhere(b, face[i]);
    return tet;
}

/* Raises the places of the faces at the ends of a fan at p. */
static void raise_ends(tli_border *b, uint32_t slot, uint32_t count)
{
    for (int end = 0; end < 2; end++, slot = b->links[slot] & LINK_SLOT)
        border_raise(b, border_place_bit(b, slot >> 2), (slot & 3) == 1 ? 0 : 1, count);
}

uint32_t tli_border_grow(tli_border *b, const tli_gate *gate, uint32_t mask, uint32_t d)
{
    const uint32_t *v = gate->vertex;
    const uint32_t corners[4] = {v[0], v[1], v[2], d};
    uint32_t tet = border_add_tet(b, gate, d), face[3] = {0}, turn[3] = {0};
    for (uint32_t k = 0; k < 3; k++) {
        const uint8_t *c = corners_of[k];
        uint32_t v0 = corners[c[0]], v1 = corners[c[1]], v2 = corners[c[2]];
        turn[k] = border_least(v0, v1, v2);
        if (mask >> k & 1)
            border_close_face(b, gate_end(gate, k) >> 2, 4 * tet + k);
        else
            face[k] = border_add_face(b, 4 * tet + k, turn[k], v0, v1, v2, PLACE_NONE);
    }
    for (uint32_t k = 0; k < 3; k++) {
        if (mask >> k & 1) continue;
        uint32_t slot = border_slot(face[k], turn[k], positions_of[k][3]);
        uint32_t count = border_count(gate->link[k]) + LINK_ONE;
        border_link(b, slot, gate_end(gate, k), count);
        if (k > 0) raise_ends(b, slot, count);
    }
    /* Around the edge from d to vertex j, between the two faces that are not opposite j. */
    for (uint32_t j = 0; j < 3; j++) {
        uint32_t i = (j + 1) % 3, k = (j + 2) % 3;
        uint32_t left = mask >> i & 1 ? border_beyond(b, gate, i, 2)
                                      : border_slot(face[i], turn[i], positions_of[i][k]);
        uint32_t right = mask >> k & 1 ? border_beyond(b, gate, k, 1)
                                       : border_slot(face[k], turn[k], positions_of[k][i]);
        uint32_t count = border_count(left) + border_count(right) + LINK_ONE;
        border_link(b, left & LINK_SLOT, right & LINK_SLOT, count);
        if (j == 0) raise_ends(b, left & LINK_SLOT, count);
    }
    for (uint32_t k = 0; k < 3; k++)
        if (!(mask >> k & 1)) wait_somewhere(b, face[k]);
    return tet;
}

void tli_border_begin(tli_border *b, uint32_t p)
{
    b->turn = p;
    b->place_count = 0;
    b->open = 0;
    memset(b->full, 0, sizeof b->full);
    memset(b->nearly, 0, sizeof b->nearly);
}

void tli_border_end(tli_border *b)
{
    b->waiting[b->turn >> 6] &= ~((uint64_t)1 << (b->turn & 63));
    b->turn = TL_NONE;
}

void tli_border_move_up(tli_border *b)
{
    uint64_t open = b->open;
    tli_border_begin(b, b->turn);
    for (; open; open &= open - 1) border_take_place(b, b->places[border_lowest_bit(open)]);
}

void tli_border_refill(tli_border *b)
{
    uint32_t p = b->turn;
    tli_border_begin(b, p);
    uint32_t face = *border_head(b, p);
    for (; b->place_count < PLACE_COUNT && face != TL_NONE; face = b->next[face])
        if (*border_state(b, face) & FACE_OPEN) border_take_place(b, face);
    *border_head(b, p) = face;
    if (face == TL_NONE) clear_queue(b, p);
}

static void count_reverse(const tli_border *b, const tli_gate *gate, uint32_t face, uint32_t rank,
                          uint32_t tet_face, tli_reverse *found)
{
    if (!border_is_reverse(b, gate, face)) return;
    if (rank == TL_NONE ? border_tet_face(b, face) == tet_face : found->count == rank) {
        found->rank = found->count;
        found->face = face;
    }
    found->count++;
}

tli_reverse tli_border_reverse(const tli_border *b, const tli_gate *gate, uint32_t rank,
                               uint32_t tet_face)
{
    tli_reverse found = {0, TL_NONE, TL_NONE};
    for (uint64_t open = b->open; open; open &= open - 1)
        count_reverse(b, gate, b->places[border_lowest_bit(open)], rank, tet_face, &found);
    for (uint32_t f = *border_head(b, gate->vertex[0]); f != TL_NONE; f = b->next[f])
        count_reverse(b, gate, f, rank, tet_face, &found);
    return found;
}

void tli_border_glue(tli_border *b, const tli_gate *gate, uint32_t face)
{
    static const uint32_t reversed[3] = {0, 2, 1};
    border_close_face(b, face, border_tet_face(b, gate->face));
    *border_state(b, gate->face) = PLACE_NONE;
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t here = b->links[4 * (size_t)gate->face + k];
        uint32_t there = b->links[4 * (size_t)face + reversed[k]];
        uint32_t count = (here & ~LINK_SLOT) + (there & ~LINK_SLOT);
        border_link(b, here & LINK_SLOT, there & LINK_SLOT, count);
        if (k > 0) raise_ends(b, here & LINK_SLOT, count);
    }
}
