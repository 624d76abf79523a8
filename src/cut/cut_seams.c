/* Neighbours across the borders of patches. A shared vertex is one key (place and twin) whatever
 * patch holds it, a face at a border three of their numbers; a face with two sides joins them. The
 * numbers of vertices are reference counted, so that patches come and go in any order. */
#include <string.h>

#include "cut/cut_keys.h"
#include "tetralod/cut.h"

/* One patch at a face; the others follow. While patches are exchanged there may be more than two.
 */
typedef struct side {
    uint32_t patch; /* index of the entry */
    uint32_t face;
    uint32_t next; /* TL_NONE at the end */
} side;

typedef struct entry {
    uint32_t number;
    const tl_patch *patch; /* NULL: the entry is free */
    uint32_t *faces;       /* [4 * tet_count] numbers of border faces, TL_NONE inside */
    uint32_t *verts;       /* [vert_count] numbers of shared vertices */
} entry;

struct tl_seams {
    tl_ctx *ctx;
    tli_keys verts, faces, numbers;
    uint32_t *first; /* [first_capacity] by number of the face: index of its first side */
    size_t first_capacity;
    side *sides;
    size_t side_count, side_capacity;
    uint32_t free_side; /* chained through next */
    entry *entries;     /* by number in numbers */
    size_t entry_capacity;
};

tl_status tl_seams_create(tl_ctx *ctx, tl_seams **seams)
{
    tl_status st = TL_OK;
    tl_seams *s = tl_mem_zalloc(ctx, 1, sizeof *s, &st);
    *seams = NULL;
    if (st) return st;
    s->ctx = ctx;
    s->free_side = TL_NONE;
    st = tli_keys_open(ctx, 0, &s->verts);
    if (!st) st = tli_keys_open(ctx, 0, &s->faces);
    if (!st) st = tli_keys_open(ctx, 0, &s->numbers);
    if (st)
        tl_seams_destroy(s);
    else
        *seams = s;
    return st;
}

static void drop_entry(tl_seams *s, entry *e)
{
    tl_mem_free(s->ctx, e->verts);
    tl_mem_free(s->ctx, e->faces);
    *e = (entry){0};
}

void tl_seams_destroy(tl_seams *s)
{
    if (!s) return;
    for (size_t i = 0; i < s->entry_capacity; i++) drop_entry(s, &s->entries[i]);
    tl_mem_free(s->ctx, s->entries);
    tl_mem_free(s->ctx, s->sides);
    tl_mem_free(s->ctx, s->first);
    tli_keys_close(&s->numbers);
    tli_keys_close(&s->faces);
    tli_keys_close(&s->verts);
    tl_mem_free(s->ctx, s);
}

static uint32_t index_of(const tl_seams *s, uint32_t number)
{
    const int64_t part[3] = {number};
    return tli_keys_find(&s->numbers, part, 0);
}

/* Room for count items of a growing array, new ones zero. */
static tl_status make_room(tl_ctx *ctx, void **array, size_t *capacity, size_t count, size_t bytes)
{
    tl_status st = TL_OK;
    if (count <= *capacity) return st;
    size_t wanted = 2 * count;
    void *grown = tl_mem_resize(ctx, *array, wanted, bytes, &st);
    if (st) return st;
    memset((char *)grown + *capacity * bytes, 0, (wanted - *capacity) * bytes);
    *array = grown;
    *capacity = wanted;
    return st;
}

static tl_status take_verts(tl_seams *s, entry *e)
{
    tl_status st = TL_OK;
    const tl_patch *p = e->patch;
    for (uint32_t v = 0; v < p->vert_count; v++) e->verts[v] = TL_NONE;
    for (uint32_t v = 0; !st && v < p->vert_count; v++)
        if (p->shared[v])
            st = tli_keys_take(&s->verts, p->places[v], p->twins ? p->twins[v] : 0, &e->verts[v]);
    return st;
}

/* The key of a face, its vertices in rising order; false if one is not shared, or it is none. */
static bool face_key(const entry *e, uint32_t face, int64_t key[3])
{
    const uint16_t *tet = e->patch->tets[face / 4];
    int n = 0;
    for (uint32_t i = 0; i < 4; i++) {
        if (i == face % 4) continue;
        int64_t id = e->verts[tet[i]];
        if (id == TL_NONE) return false;
        int at = n++;
        for (; at && key[at - 1] > id; at--) key[at] = key[at - 1];
        key[at] = id;
    }
    return key[0] != key[1] && key[1] != key[2];
}

/* Puts a side in front of those of a face that has uses of them, this one included. */
static tl_status add_side(tl_seams *s, uint32_t id, uint32_t patch, uint32_t face)
{
    tl_status st =
        make_room(s->ctx, (void **)&s->first, &s->first_capacity, (size_t)id + 1, sizeof *s->first);
    if (!st && s->free_side == TL_NONE)
        st = make_room(s->ctx, (void **)&s->sides, &s->side_capacity, s->side_count + 1,
                       sizeof *s->sides);
    if (st) return st;
    uint32_t at = s->free_side;
    if (at == TL_NONE)
        at = (uint32_t)s->side_count++;
    else
        s->free_side = s->sides[at].next;
    s->sides[at] = (side){patch, face, s->faces.keys[id].uses > 1 ? s->first[id] : TL_NONE};
    s->first[id] = at;
    return TL_OK;
}

static void drop_side(tl_seams *s, uint32_t id, uint32_t patch, uint32_t face)
{
    uint32_t *link = &s->first[id];
    while (s->sides[*link].patch != patch || s->sides[*link].face != face)
        link = &s->sides[*link].next;
    uint32_t at = *link;
    *link = s->sides[at].next;
    s->sides[at].next = s->free_side;
    s->free_side = at;
    tli_keys_drop(&s->faces, id);
}

static tl_status take_faces(tl_seams *s, entry *e, uint32_t index)
{
    tl_status st = TL_OK;
    for (uint32_t f = 0; !st && f < 4 * e->patch->tet_count; f++) {
        int64_t key[3];
        uint32_t id;
        if (e->patch->opposite[f / 4][f % 4] != TL_NONE || !face_key(e, f, key)) continue;
        st = tli_keys_take(&s->faces, key, 0, &id);
        if (st) break;
        st = add_side(s, id, index, f);
        if (st)
            tli_keys_drop(&s->faces, id);
        else
            e->faces[f] = id;
    }
    return st;
}

static void release_faces(tl_seams *s, const entry *e, uint32_t index)
{
    for (uint32_t f = 0; f < 4 * e->patch->tet_count; f++)
        if (e->faces[f] != TL_NONE) drop_side(s, e->faces[f], index, f);
    for (uint32_t v = 0; v < e->patch->vert_count; v++)
        if (e->verts[v] != TL_NONE) tli_keys_drop(&s->verts, e->verts[v]);
}

tl_status tl_seams_add(tl_seams *s, uint32_t number, const tl_patch *patch)
{
    const int64_t part[3] = {number};
    if (index_of(s, number) != TL_NONE)
        return tl_fail(s->ctx, TL_ERR_ARG, "patch %u is there already", number);
    if (!patch->opposite) return tl_fail(s->ctx, TL_ERR_ARG, "patch %u has no adjacency", number);
    uint32_t index;
    tl_status st = tli_keys_take(&s->numbers, part, 0, &index);
    if (st) return st;
    st = make_room(s->ctx, (void **)&s->entries, &s->entry_capacity, (size_t)index + 1,
                   sizeof *s->entries);
    entry e = {.number = number, .patch = patch};
    e.faces = tl_mem_alloc(s->ctx, patch->tet_count, 4 * sizeof *e.faces, &st);
    e.verts = tl_mem_alloc(s->ctx, patch->vert_count, sizeof *e.verts, &st);
    if (!st) {
        for (uint32_t f = 0; f < 4 * patch->tet_count; f++) e.faces[f] = TL_NONE;
        st = take_verts(s, &e);
        if (!st) st = take_faces(s, &e, index);
        if (st) release_faces(s, &e, index);
    }
    if (st) {
        drop_entry(s, &e);
        tli_keys_drop(&s->numbers, index);
        return st;
    }
    s->entries[index] = e;
    return TL_OK;
}

tl_status tl_seams_remove(tl_seams *s, uint32_t number)
{
    uint32_t index = index_of(s, number);
    if (index == TL_NONE) return tl_fail(s->ctx, TL_ERR_ARG, "patch %u is not there", number);
    release_faces(s, &s->entries[index], index);
    drop_entry(s, &s->entries[index]);
    tli_keys_drop(&s->numbers, index);
    return TL_OK;
}

bool tl_seams_behind(const tl_seams *s, uint32_t number, uint32_t face, uint32_t *other_number,
                     uint32_t *other_face)
{
    uint32_t index = index_of(s, number);
    if (index == TL_NONE) return false;
    const entry *e = &s->entries[index];
    if (face / 4 >= e->patch->tet_count) return false;
    uint32_t inside = e->patch->opposite[face / 4][face % 4];
    if (inside != TL_NONE) {
        *other_number = number;
        *other_face = inside;
        return true;
    }
    uint32_t id = e->faces[face];
    if (id == TL_NONE || s->faces.keys[id].uses != 2) return false;
    const side *other = &s->sides[s->first[id]];
    if (other->patch == index && other->face == face) other = &s->sides[other->next];
    *other_number = s->entries[other->patch].number;
    *other_face = other->face;
    return true;
}

const uint32_t *tl_seams_verts(const tl_seams *s, uint32_t number, uint32_t *number_end)
{
    uint32_t index = index_of(s, number);
    *number_end = s->verts.count;
    return index == TL_NONE ? NULL : s->entries[index].verts;
}
