/* The cut-border of a patch that grows tet by tet (Gumhold, Guthe, Strasser 1999; Sondershaus 2007,
 * 6.3.3), the same for coder and decoder. Where we differ: links across edges are facts of the tets
 * and never ambiguous. Tets that hang together around an edge are a fan; its two end faces know
 * each other and the number of tets in between. So edges and vertices that are not manifold need no
 * case of their own, and nothing is looked up by hashing.
 *
 * An open face waits at the smallest of its vertices (vertices are numbered as they arrive), and
 * vertices have their turn in ascending order: what is around one vertex is finished before the
 * next. Of the faces that wait at the vertex p whose turn it is, those go first whose fans at p
 * have many tets: a full fan is about to close, and what is known then makes the rest easier to
 * tell. The face whose turn comes is the gate: its vertices are (p, a, b), seen from the far side
 * counter-clockwise for positive tets, so that a tet beyond it is (p, a, b, d). */
#ifndef TETRALOD_SRC_CODEC_BORDER_H
#define TETRALOD_SRC_CODEC_BORDER_H

#include "codec/codec.h"

/* What is to be compiled anew for each mask, so that no bit of it is looked at. */
#if defined(__GNUC__)
#define BORDER_INLINE inline __attribute__((always_inline))
#else
#define BORDER_INLINE inline
#endif

/* A slot is an edge of an open face: 4 * face + the position of the vertex that is not on it. A
 * link is the slot at the other end of a fan, and above it the number of tets in between; of 512
 * and more what is left modulo 512. */
#define LINK_SLOT_BITS 23
#define LINK_SLOT 0x7fffffu
#define LINK_ONE (1u << LINK_SLOT_BITS)

/* A face's state: its place, and whether its other side is not known yet. */
#define FACE_PLACE 63u
#define FACE_OPEN 64u

/* Faces of the vertex whose turn it is have places, so that the next one is found by looking at
 * bits. A face without a place has the last one, which is never looked at. */
#define PLACE_COUNT 63u
#define PLACE_NONE 63u

/* Fans of so many tets are full, nearly so, or not. */
#define FAN_FULL 4u
#define FAN_NEARLY 3u

typedef struct tli_border {
    uint32_t vert_count, tet_count, face_count; /* so far */
    uint32_t vert_capacity, tet_capacity;       /* that there may be */
    uint32_t tet_room;                          /* of the arrays */
    uint16_t *tets;                             /* [4 * tet] */
    uint32_t *opposite;                         /* [4 * tet] */
    /* Faces in the order in which they came, 4 at most a tet. The fourth link is the face of a tet
     * that it is, 4 * tet + corner; the fourth vertex is its state. */
    uint32_t *links;    /* [4 * face] */
    uint16_t *vertices; /* [4 * face], the smallest first */
    uint32_t *next;     /* [4 * tets + vertices] what waits behind a face; then the first that waits
                           at a vertex, or TL_NONE */
    uint32_t *tail;     /* [vertex] where in next the one that comes to wait is to stand */
    uint64_t *waiting;  /* a bit a vertex: may have faces that wait */
    uint8_t *on_border; /* [vertex] 1 if it lies on a face without a tet beyond it, else 0 */
    /* The vertex whose turn it is, or TL_NONE, and the places of its faces. */
    uint32_t turn, place_count;
    uint64_t open;      /* a bit a place */
    uint64_t full[2];   /* places whose fans over pb, and over pa, are full */
    uint64_t nearly[2]; /* or nearly so */
    uint32_t places[PLACE_COUNT];
} tli_border;

/* What is known when a face has its turn. Index 0 stands for edge ab (opposite p), 1 for pb, 2 for
 * pa. */
typedef struct tli_gate {
    uint32_t face;
    uint32_t vertex[3]; /* p, a, b */
    uint32_t link[3];   /* of the fan: its other end and its tets */
    uint32_t apex[3];   /* the vertex of the end's face that is not on the edge */
    uint32_t open;      /* bit k: the end's face is open */
} tli_gate;

/* (j + i) mod 3 and (j - i) mod 3 for i, j < 3. */
extern const uint8_t tli_border_turned[3][3];
extern const uint8_t tli_border_back[3][3];

tl_status tli_border_open(tl_ctx *ctx, uint32_t vert_capacity, uint32_t tet_capacity,
                          tli_border *border);
/* Leaves tets and opposite alone: those are the result. */
void tli_border_close(tl_ctx *ctx, tli_border *border);
/* Adds the first tet of a component: four faces that wait. Returns its number. */
uint32_t tli_border_start(tli_border *border, const uint32_t vertices[4]);
/* Begins the turn of a vertex; ends it, as no faces wait there any more. */
void tli_border_begin(tli_border *border, uint32_t p);
void tli_border_end(tli_border *border);
/* The places are used up: faces that are open move up, or, if none is, those that wait follow. */
void tli_border_move_up(tli_border *border);
void tli_border_refill(tli_border *border);

/* The face of a tet that an open face is. */
static inline uint32_t border_tet_face(const tli_border *b, uint32_t face)
{
    return b->links[4 * (size_t)face + 3];
}

static inline uint16_t *border_state(const tli_border *b, uint32_t face)
{
    return &b->vertices[4 * (size_t)face + 3];
}

/* A bit for the place of a face. */
static inline uint64_t border_place_bit(const tli_border *b, uint32_t face)
{
    return (uint64_t)1 << (*border_state(b, face) & FACE_PLACE);
}

/* Place bits if a link's fan is full, or nearly so. No branch: half of them are. */
static inline uint64_t border_if_full(uint32_t link, uint64_t places)
{
    return places & (0 - (uint64_t)(link >= FAN_FULL << LINK_SLOT_BITS));
}

static inline uint64_t border_if_nearly(uint32_t link, uint64_t places)
{
    return places & (0 - (uint64_t)(link >= FAN_NEARLY << LINK_SLOT_BITS));
}

/* bits, or, if it is not 0, better. */
static inline uint64_t border_better(uint64_t bits, uint64_t better)
{
    return bits ^ ((bits ^ better) & (0 - (uint64_t)(better != 0)));
}

/* The fan of a link, over the edges of places at position 1 (which 0) or 2, is that long now. */
static inline void border_raise(tli_border *b, uint64_t places, uint32_t which, uint32_t link)
{
    b->full[which] |= border_if_full(link, places);
    b->nearly[which] |= border_if_nearly(link, places);
}

/* Gives the next place to an open face at p. */
static inline void border_take_place(tli_border *b, uint32_t face)
{
    uint64_t bit = (uint64_t)1 << b->place_count;
    *border_state(b, face) = (uint16_t)(FACE_OPEN | b->place_count);
    b->places[b->place_count++] = face;
    b->open |= bit;
    border_raise(b, bit, 0, b->links[4 * (size_t)face + 1]);
    border_raise(b, bit, 1, b->links[4 * (size_t)face + 2]);
}

/* Where in next the first face that waits at a vertex stands. */
static inline uint32_t *border_head(const tli_border *b, uint32_t vertex)
{
    return &b->next[4 * (size_t)b->tet_room + vertex];
}

/* Lets a face wait at a vertex, its smallest, that does not have its turn or no place. */
static inline void border_queue(tli_border *b, uint32_t vertex, uint32_t face)
{
    b->next[face] = TL_NONE;
    b->next[b->tail[vertex]] = face;
    b->tail[vertex] = face;
    b->waiting[vertex >> 6] |= (uint64_t)1 << (vertex & 63);
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

/* The face at p that is next: one with a full fan whose other one is at least nearly full; else
 * one with a full fan; else one with two that are nearly full; else any; of several the first.
 * TL_NONE: all are done. */
static inline uint32_t border_next(tli_border *b)
{
    if (!b->open) tli_border_refill(b);
    if (!b->open) return TL_NONE;
    uint64_t both = b->open & b->nearly[0] & b->nearly[1];
    uint64_t full = b->open & (b->full[0] | b->full[1]);
    uint64_t best = border_better(border_better(border_better(b->open, both), full), full & both);
    uint32_t face = b->places[border_lowest_bit(best)];
    b->open &= ~(best & (0 - best));
    *border_state(b, face) = FACE_OPEN | PLACE_NONE;
    return face;
}

/* What is around an open face. */
static inline void border_look(const tli_border *b, uint32_t face, tli_gate *gate)
{
    gate->face = face;
    gate->open = 0;
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t link = b->links[4 * (size_t)face + k], end = link & LINK_SLOT;
        gate->vertex[k] = b->vertices[4 * (size_t)face + k];
        gate->link[k] = link;
        gate->apex[k] = b->vertices[end];
        gate->open |= (b->vertices[end | 3] & FACE_OPEN) >> (6 - k);
    }
}

static inline uint32_t gate_fan(const tli_gate *gate, uint32_t k)
{
    return gate->link[k] >> LINK_SLOT_BITS;
}

static inline uint32_t gate_end(const tli_gate *gate, uint32_t k)
{
    return gate->link[k] & LINK_SLOT;
}

/* The gate has no tet beyond it. */
static inline void border_shut(tli_border *b, const tli_gate *gate)
{
    *border_state(b, gate->face) = PLACE_NONE;
    b->opposite[border_tet_face(b, gate->face)] = TL_NONE;
    for (uint32_t k = 0; k < 3; k++) b->on_border[gate->vertex[k]] = 1;
}

/* Two slots become the ends of one fan; count stands where a link has it. */
static inline void border_link(tli_border *b, uint32_t left, uint32_t right, uint32_t count)
{
    b->links[left] = right | count;
    b->links[right] = left | count;
}

/* An open face and a face of a tet become the two sides of one. */
static inline void border_close_face(tli_border *b, uint32_t face, uint32_t tet_face)
{
    uint32_t other = border_tet_face(b, face);
    b->open &= ~border_place_bit(b, face);
    *border_state(b, face) = PLACE_NONE;
    b->opposite[other] = tet_face;
    b->opposite[tet_face] = other;
}

/* True if a face is open and has the gate's vertices, seen from the other side. */
static inline bool border_is_reverse(const tli_border *b, const tli_gate *gate, uint32_t face)
{
    const uint16_t *other = b->vertices + 4 * (size_t)face;
    return other[3] & FACE_OPEN && other[0] == gate->vertex[0] && other[1] == gate->vertex[2] &&
           other[2] == gate->vertex[1];
}

/* Of the open faces with the gate's vertices reversed, those with places first: how many there are,
 * and the one of a rank or, if rank is TL_NONE, the one that is tet_face. */
typedef struct tli_reverse {
    uint32_t count, rank, face;
} tli_reverse;
tli_reverse tli_border_reverse(const tli_border *border, const tli_gate *gate, uint32_t rank,
                               uint32_t tet_face);

/* The vertices around the gate's vertex k along faces that are not glued, from the face beyond one
 * edge to that beyond the other: what a tet beyond the gate may reach to. Returns how many. */
#define UMBRELLA_MAX 32u
static inline uint32_t border_umbrella(const tli_border *b, const tli_gate *gate, uint32_t k,
                                       uint32_t vertices[UMBRELLA_MAX])
{
    uint32_t end = gate_end(gate, k == 2 ? 0 : k + 1), count = 0;
    while (end >> 2 != gate->face && count < UMBRELLA_MAX) {
        vertices[count++] = b->vertices[end];
        /* All faces turn alike, so the vertex in the middle lies on the same side of each apex. */
        end = b->links[(end & ~3u) + tli_border_turned[2][end & 3]] & LINK_SLOT;
    }
    return count;
}

/* Makes the gate and an open face with the same vertices reversed the two sides of one. */
void tli_border_glue(tli_border *border, const tli_gate *gate, uint32_t face);

/* The position of the smallest of three vertices. */
static inline uint32_t border_least(uint32_t v0, uint32_t v1, uint32_t v2)
{
    uint32_t key = 4 * v0, key_1 = 4 * v1 + 1, key_2 = 4 * v2 + 2;
    key = key_1 < key ? key_1 : key;
    key = key_2 < key ? key_2 : key;
    return key & 3;
}

/* Adds an open face of a tet with vertices v0, v1, v2, counter-clockwise seen from outside; turn:
 * the position of the smallest, which becomes the first. */
static inline uint32_t border_add_face(tli_border *b, uint32_t tet_face, uint32_t turn, uint32_t v0,
                                       uint32_t v1, uint32_t v2, uint32_t place)
{
    uint32_t face = b->face_count++;
    uint16_t *vertices = b->vertices + 4 * (size_t)face;
    const uint32_t twice[5] = {v0, v1, v2, v0, v1};
    for (uint32_t i = 0; i < 3; i++) vertices[i] = (uint16_t)twice[turn + i];
    vertices[3] = (uint16_t)(FACE_OPEN | place);
    b->links[4 * (size_t)face + 3] = tet_face;
    return face;
}

/* The slot of an edge whose position was told before the face was turned. */
static inline uint32_t border_slot(uint32_t face, uint32_t turn, uint32_t position)
{
    return 4 * face + tli_border_back[turn][position];
}

/* What lies beyond a glued face over the edge from d to the vertex behind k (step 1) or before k
 * (2). */
static inline uint32_t border_beyond(const tli_border *b, const tli_gate *gate, uint32_t k,
                                     uint32_t step)
{
    uint32_t end = gate_end(gate, k);
    return b->links[(end & ~3u) + tli_border_turned[step][end & 3]];
}

/* The number of tets of a link, where links have it. */
static inline uint32_t border_count(uint32_t link)
{
    return link & ~LINK_SLOT;
}

/* What any tet (p, a, b, d) beyond the gate needs but its faces. */
static inline uint32_t border_add_tet(tli_border *b, const tli_gate *gate, uint32_t d)
{
    uint32_t tet = b->tet_count++, gate_face = border_tet_face(b, gate->face);
    uint16_t *corners = b->tets + 4 * (size_t)tet;
    for (uint32_t k = 0; k < 3; k++) corners[k] = (uint16_t)gate->vertex[k];
    corners[3] = (uint16_t)d;
    b->opposite[4 * (size_t)tet + 3] = gate_face;
    b->opposite[gate_face] = 4 * tet + 3;
    return tet;
}

/* Adds the tet (p, a, b, d) beyond the gate. mask, bit k: its face over edge k is the other side of
 * the face at which that edge's fan ends, which is open and has d for its apex. For d above p, and
 * where two places are left. The open faces, abd, pdb, and pad, are 0 where they are glued. */
static BORDER_INLINE uint32_t border_grow_here(tli_border *b, const tli_gate *gate, uint32_t mask,
                                               uint32_t d)
{
    const uint32_t p = gate->vertex[0], va = gate->vertex[1], vb = gate->vertex[2];
    const uint32_t glued_0 = mask & 1, glued_1 = mask & 2, glued_2 = mask & 4;
    uint32_t tet = border_add_tet(b, gate, d), place = b->place_count;
    uint32_t turn = border_least(va, vb, d), face_0 = 0, face_1 = 0, face_2 = 0, link;
    uint64_t bit_1 = 0, bit_2 = 0, beyond_1 = 0, beyond_2 = 0;
    for (uint32_t k = 0; k < 3; k++)
        if (mask >> k & 1) border_close_face(b, gate_end(gate, k) >> 2, 4 * tet + k);
    if (!glued_0) face_0 = border_add_face(b, 4 * tet, turn, va, vb, d, PLACE_NONE);
    if (!glued_1) {
        face_1 = border_add_face(b, 4 * tet + 1, 0, p, d, vb, place);
        bit_1 = (uint64_t)1 << place;
        b->places[place++] = face_1;
    }
    if (!glued_2) {
        face_2 = border_add_face(b, 4 * tet + 2, 0, p, va, d, place);
        bit_2 = (uint64_t)1 << place;
        b->places[place++] = face_2;
    }
    b->place_count = place;
    b->open |= bit_1 | bit_2;
    /* Fans over the gate's edges. */
    uint32_t link_pb = border_count(gate->link[1]) + LINK_ONE;
    uint32_t link_pa = border_count(gate->link[2]) + LINK_ONE;
    if (!glued_0)
        border_link(b, border_slot(face_0, turn, 2), gate_end(gate, 0),
                    border_count(gate->link[0]) + LINK_ONE);
    if (!glued_1) {
        border_link(b, 4 * face_1 + 1, gate_end(gate, 1), link_pb);
        beyond_1 = border_place_bit(b, gate_end(gate, 1) >> 2);
    }
    if (!glued_2) {
        border_link(b, 4 * face_2 + 2, gate_end(gate, 2), link_pa);
        beyond_2 = border_place_bit(b, gate_end(gate, 2) >> 2);
    }
    /* Fans around the edges at d. To a: */
    link = glued_2 ? border_beyond(b, gate, 2, 2) : 4 * face_2;
    uint32_t other = glued_0 ? border_beyond(b, gate, 0, 1) : border_slot(face_0, turn, 1);
    uint32_t count = (glued_2 ? border_count(link) : 0) + (glued_0 ? border_count(other) : 0);
    border_link(b, link & LINK_SLOT, other & LINK_SLOT, count + LINK_ONE);
    /* To b: */
    link = glued_1 ? border_beyond(b, gate, 1, 1) : 4 * face_1;
    other = glued_0 ? border_beyond(b, gate, 0, 2) : border_slot(face_0, turn, 0);
    count = (glued_1 ? border_count(link) : 0) + (glued_0 ? border_count(other) : 0);
    border_link(b, link & LINK_SLOT, other & LINK_SLOT, count + LINK_ONE);
    /* To p: */
    link = glued_1 ? border_beyond(b, gate, 1, 2) : 4 * face_1 + 2;
    other = glued_2 ? border_beyond(b, gate, 2, 1) : 4 * face_2 + 1;
    count = (glued_1 ? border_count(link) : 0) + (glued_2 ? border_count(other) : 0) + LINK_ONE;
    border_link(b, link & LINK_SLOT, other & LINK_SLOT, count);
    /* The fans at p: pb has position 1 in face 1 and 2 beyond, pa the other way round; pd, where it
     * is not new, position 2 on the side of face 1. */
    uint64_t left = glued_2 ? border_place_bit(b, (other & LINK_SLOT) >> 2) : bit_2;
    uint64_t right = glued_1 ? border_place_bit(b, (link & LINK_SLOT) >> 2) : bit_1;
    b->full[0] |= border_if_full(link_pb, bit_1) | border_if_full(link_pa, beyond_2);
    b->full[1] |= border_if_full(link_pb, beyond_1) | border_if_full(link_pa, bit_2);
    b->nearly[0] |= border_if_nearly(link_pb, bit_1) | border_if_nearly(link_pa, beyond_2);
    b->nearly[1] |= border_if_nearly(link_pb, beyond_1) | border_if_nearly(link_pa, bit_2);
    if (glued_1 || glued_2) {
        border_raise(b, left, 0, count);
        border_raise(b, right, 1, count);
    }
    if (!glued_0) border_queue(b, b->vertices[4 * (size_t)face_0], face_0);
    return tet;
}

/* The same for any d, and whatever places are left. */
uint32_t tli_border_grow(tli_border *border, const tli_gate *gate, uint32_t mask, uint32_t d);

static BORDER_INLINE void border_grow(tli_border *b, const tli_gate *gate, uint32_t mask,
                                      uint32_t d)
{
    if (d > gate->vertex[0] && b->place_count + 2 <= PLACE_COUNT)
        border_grow_here(b, gate, mask, d);
    else
        tli_border_grow(b, gate, mask, d);
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
