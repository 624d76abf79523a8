/* The cut-border of a patch that grows tet by tet (Gumhold, Guthe, Strasser 1999; Sondershaus 2007,
 * 6.3.3), the same for coder and decoder. Where we differ: the border is no mesh of triangles of
 * its own. It is the faces of the tets so far that are open; tets that hang together around an edge
 * are a fan with two end faces, and each end knows the other and the tets in between. So whatever
 * the neighbourhood is, a link across an edge is a fact of the tets and never ambiguous: edges and
 * vertices that are not manifold need no case of their own, and nothing is looked up by hashing.
 *
 * An open face waits at the smallest of its vertices (vertices are numbered as they arrive), and
 * vertices have their turn in ascending order: what is around one vertex is finished before the
 * next, faces in the order in which they came. A face whose turn comes is the gate: its vertices
 * are (p, a, b), p the smallest, seen from the far side counter-clockwise for positive tets, so
 * that a tet beyond it is (p, a, b, d). */
#ifndef TETRALOD_SRC_CODEC_BORDER_H
#define TETRALOD_SRC_CODEC_BORDER_H

#include "codec/codec.h"

/* In opposite: a face whose other side is not known yet. */
#define BORDER_OPEN 0xfffffffeu
/* A slot is an edge of a face of a tet: 16 * tet + 4 * face + the corner of the face that is not on
 * the edge. It fits 23 bits; above them stands how many tets the fan has. */
#define FAN_SLOT_BITS 23
#define FAN_SLOT 0x7fffffu
#define FAN_COUNT_MAX 511u

/* A face that waits: 4 * tet + face, and above these bits the corner of the tet that is its
 * smallest vertex. */
#define WAIT_FACE_BITS 21
#define WAIT_FACE 0x1fffffu

typedef struct tli_border {
    uint32_t vert_count, tet_count;       /* so far */
    uint32_t vert_capacity, tet_capacity; /* of the arrays */
    uint16_t *tets;                       /* [4 * tet] */
    uint32_t *opposite;                   /* [4 * tet] */
    uint32_t *fans;    /* [16 * tet] other end of the fan, for slots of faces that are not glued */
    uint32_t *next;    /* [4 * tet] what waits behind this face */
    uint32_t *head;    /* [vertex] the first that waits, or TL_NONE */
    uint32_t *tail;    /* [vertex] the last, if there is one */
    uint64_t *waiting; /* a bit a vertex: may have faces that wait */
} tli_border;

/* What is known when a face has its turn. Index 0 stands for edge ab (opposite p), 1 for pb, 2 for
 * pa. */
typedef struct tli_gate {
    uint32_t tet, face;
    uint32_t vertex[3]; /* p, a, b */
    uint32_t slot[3];   /* its own */
    uint32_t end[3];    /* the slot of the fan's other end */
    uint32_t fan[3];    /* tets in the fan */
    uint32_t apex[3];   /* the vertex of the end's face that is not on the edge */
    uint32_t open;      /* bit k: the end's face is open */
} tli_gate;

/* Corners of face i of a tet, turned so that its normal points out of a positive tet, by the
 * position of the first: [face][first corner]. */
extern const uint8_t tli_border_corners[4][4][3];

tl_status tli_border_open(tl_ctx *ctx, uint32_t vert_capacity, uint32_t tet_capacity,
                          tli_border *border);
/* Leaves tets and opposite alone: those are the result. */
void tli_border_close(tl_ctx *ctx, tli_border *border);

/* Joins the fans that end in slots a and b, as their faces become one. */
static inline void border_join_fans(tli_border *b, uint32_t slot_a, uint32_t slot_b)
{
    uint32_t *fans = b->fans;
    uint32_t far_a = fans[slot_a], far_b = fans[slot_b];
    uint32_t count = (far_a >> FAN_SLOT_BITS) + (far_b >> FAN_SLOT_BITS);
    count = (count < FAN_COUNT_MAX ? count : FAN_COUNT_MAX) << FAN_SLOT_BITS;
    far_a &= FAN_SLOT;
    far_b &= FAN_SLOT;
    fans[far_a] = far_b | count;
    fans[far_b] = far_a | count;
}

/* Lets face of tet wait at the smallest of its vertices. */
static inline void border_wait(tli_border *b, uint32_t tet, uint32_t face)
{
    const uint16_t *corners = b->tets + 4 * (size_t)tet;
    uint32_t i = (face + 1) & 3, j = (face + 2) & 3, k = (face + 3) & 3;
    uint32_t first = corners[i] < corners[j] ? i : j;
    first = corners[k] < corners[first] ? k : first;
    uint32_t least = corners[first], waits = 4 * tet + face, *last = &b->head[least];
    b->next[waits] = TL_NONE;
    last = *last == TL_NONE ? last : &b->next[b->tail[least]];
    b->tail[least] = waits;
    *last = waits | first << WAIT_FACE_BITS;
    b->waiting[least >> 6] |= (uint64_t)1 << (least & 63);
}

/* Adds a tet with four open faces, all fans of one tet; its vertices are there or counted by the
 * caller. Returns its number. */
static inline uint32_t border_add_tet(tli_border *b, uint32_t v0, uint32_t v1, uint32_t v2,
                                      uint32_t v3)
{
    uint32_t tet = b->tet_count++, first = 16 * tet | 1u << FAN_SLOT_BITS;
    uint32_t *fans = b->fans + 16 * (size_t)tet;
    uint16_t *corners = b->tets + 4 * (size_t)tet;
    for (uint32_t face = 0; face < 4; face++) {
        b->opposite[4 * tet + face] = BORDER_OPEN;
        for (uint32_t corner = 0; corner < 4; corner++)
            fans[4 * face + corner] = first + 4 * corner + face;
    }
    corners[0] = (uint16_t)v0;
    corners[1] = (uint16_t)v1;
    corners[2] = (uint16_t)v2;
    corners[3] = (uint16_t)v3;
    return tet;
}

/* What is around an open face that waited. */
static inline void border_look(const tli_border *b, uint32_t waits, tli_gate *gate)
{
    uint32_t face = waits & WAIT_FACE;
    const uint16_t *corners = b->tets + (face & ~3u);
    const uint8_t *turn = tli_border_corners[face & 3][waits >> WAIT_FACE_BITS];
    gate->tet = face >> 2;
    gate->face = face & 3;
    gate->open = 0;
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t slot = 4 * face + turn[k], far = b->fans[slot], end = far & FAN_SLOT;
        gate->vertex[k] = corners[turn[k]];
        gate->slot[k] = slot;
        gate->end[k] = end;
        gate->fan[k] = far >> FAN_SLOT_BITS;
        gate->apex[k] = b->tets[(end >> 2 & ~3u) + (end & 3)];
        gate->open |= (uint32_t)(b->opposite[end >> 2] == BORDER_OPEN) << k;
    }
}

/* True if what waits at p is open and has the gate's vertices, seen from the other side. */
static inline bool border_is_reverse(const tli_border *b, const tli_gate *gate, uint32_t waits)
{
    uint32_t face = waits & WAIT_FACE;
    const uint16_t *corners = b->tets + (face & ~3u);
    const uint8_t *turn = tli_border_corners[face & 3][waits >> WAIT_FACE_BITS];
    return b->opposite[face] == BORDER_OPEN && corners[turn[1]] == gate->vertex[2] &&
           corners[turn[2]] == gate->vertex[1];
}

/* The vertices around the gate's vertex k along faces that are not glued, from the face beyond one
 * edge to that beyond the other: what a tet beyond the gate may reach to. Returns how many. */
#define UMBRELLA_MAX 32u
static inline uint32_t border_umbrella(const tli_border *b, const tli_gate *gate, uint32_t k,
                                       uint32_t vertices[UMBRELLA_MAX])
{
    uint32_t end = gate->end[k == 2 ? 0 : k + 1], count = 0;
    uint32_t start = 4 * gate->tet + gate->face;
    while (end >> 2 != start && count < UMBRELLA_MAX) {
        uint32_t face = end >> 2 & 3, apex = end & 3;
        vertices[count++] = b->tets[(end >> 2 & ~3u) + apex];
        /* All tets turn alike, so the vertex in the middle lies on the same side of each apex. */
        end = b->fans[(end & ~3u) + tli_border_corners[face][apex][2]] & FAN_SLOT;
    }
    return count;
}

/* Makes the gate and what waits, an open face with the same vertices reversed, the two sides of
 * one.
 */
static inline void border_glue(tli_border *b, const tli_gate *gate, uint32_t waits)
{
    uint32_t face = waits & WAIT_FACE;
    const uint8_t *turn = tli_border_corners[face & 3][waits >> WAIT_FACE_BITS];
    border_join_fans(b, gate->slot[0], 4 * face + turn[0]);
    border_join_fans(b, gate->slot[1], 4 * face + turn[2]);
    border_join_fans(b, gate->slot[2], 4 * face + turn[1]);
    b->opposite[4 * gate->tet + gate->face] = face;
    b->opposite[face] = 4 * gate->tet + gate->face;
}

/* Adds the tet (p, a, b, d) beyond the gate. mask, bit k: its face over edge k is the other side of
 * the face at which that edge's fan ends, which is open and has d for its apex. */
static inline uint32_t border_grow(tli_border *b, const tli_gate *gate, uint32_t mask, uint32_t d)
{
    uint32_t tet = border_add_tet(b, gate->vertex[0], gate->vertex[1], gate->vertex[2], d);
    for (uint32_t k = 0; k < 3; k++) border_join_fans(b, gate->slot[k], 16 * tet + 12 + k);
    b->opposite[4 * tet + 3] = 4 * gate->tet + gate->face;
    b->opposite[4 * gate->tet + gate->face] = 4 * tet + 3;
    for (uint32_t k = 0; k < 3; k++) {
        if (!(mask >> k & 1)) continue;
        /* Both faces, turned from d on, which is corner 3 of the new one: one runs against the
         * other. The fan of edge k itself is closed by this and ends nowhere any more. */
        uint32_t end = gate->end[k], face = end >> 2;
        const uint8_t *mine = tli_border_corners[k][3];
        const uint8_t *other = tli_border_corners[face & 3][end & 3];
        border_join_fans(b, 16 * tet + 4 * k + mine[1], 4 * face + other[2]);
        border_join_fans(b, 16 * tet + 4 * k + mine[2], 4 * face + other[1]);
        b->opposite[4 * tet + k] = face;
        b->opposite[face] = 4 * tet + k;
    }
    for (uint32_t k = 0; k < 3; k++)
        if (!(mask >> k & 1)) border_wait(b, tet, k);
    return tet;
}

static inline uint32_t border_lowest_bit(uint64_t bits)
{
#if defined(__GNUC__)
    return (uint32_t)__builtin_ctzll(bits);
#else
    uint32_t bit = 0;
    while (!(bits >> bit & 1)) bit++;
    return bit;
#endif
}

/* The first vertex from one on at which faces may wait, TL_NONE if there is none. */
static inline uint32_t border_find_waiting(const tli_border *b, uint32_t from)
{
    uint32_t words = (b->vert_capacity + 63) / 64, word = from >> 6;
    uint64_t bits;
    if (word >= words) return TL_NONE;
    bits = b->waiting[word] & UINT64_MAX << (from & 63);
    while (!bits) {
        if (++word >= words) return TL_NONE;
        bits = b->waiting[word];
    }
    return 64 * word + border_lowest_bit(bits);
}

/* The vertex that has its turn after p: the next in order, or, where faces wait at one that was
 * done before, that one. TL_NONE when all is done. */
static inline uint32_t border_turn(const tli_border *b, uint32_t p)
{
    uint32_t vertex = border_find_waiting(b, p);
    return vertex == TL_NONE && p > 0 ? border_find_waiting(b, 0) : vertex;
}

#endif
