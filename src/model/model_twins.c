/* Vertices at one place, as the two sides of a baffle have them: numbered, so that a place and a
 * number name a vertex. The home of a vertex numbers it, if it holds others of the place, and tells
 * the other segments that hold it. Vertices of a place that no segment holds together are not told
 * of each other. */
#include <string.h>

#include "base/base_sort.h"
#include "base/base_vec.h"
#include "model/model_finest.h"
#include "model/model_mail.h"
#include "model/model_turns.h"

enum { NUMBER_BITS = 8 }; /* a word is a vertex id and its number */

/* What is made for a segment. */
typedef struct twin_look {
    tl_segment segment;
    double *xyz;
    int16_t *steps;
    uint64_t *keys, *words; /* [vert_count] */
    uint32_t *verts;        /* by key */
    uint8_t *numbers;
} twin_look;

static bool same_place(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Numbers from 1 on for those that are not alone, by their ids. */
static tl_status number_equal(tl_ctx *ctx, twin_look *l, size_t begin, size_t end, bool *any)
{
    const tl_segment *s = &l->segment;
    for (size_t a = begin; a < end; a++) {
        unsigned same = 0, before = 0;
        uint32_t v = l->verts[a];
        if (s->links[v] & TL_LINK_COPY) continue;
        for (size_t b = begin; b < end; b++)
            if (same_place(l->xyz + 3 * (size_t)v, l->xyz + 3 * (size_t)l->verts[b])) {
                same++;
                before += s->vert_ids[l->verts[b]] < s->vert_ids[v];
            }
        if (same < 2) continue;
        if (before + 1 > UINT8_MAX)
            return tl_fail(ctx, TL_ERR_UNSUPPORTED, "more than %d vertices at one place",
                           UINT8_MAX);
        l->numbers[v] = (uint8_t)(before + 1);
        *any = true;
    }
    return TL_OK;
}

/* Vertices sorted so that those of one place are neighbours, by keys equal for them. */
static tl_status sort_places(tl_ctx *ctx, const double *xyz, size_t count, uint64_t *keys,
                             uint32_t *verts)
{
    for (size_t v = 0; v < count; v++) {
        keys[v] = vec_hash(xyz + 3 * v);
        verts[v] = (uint32_t)v;
    }
    return tli_sort_u64(ctx, keys, verts, count);
}

static tl_status number(tl_ctx *ctx, twin_look *l, bool *any)
{
    size_t n = l->segment.vert_count;
    tl_status st = sort_places(ctx, l->xyz, n, l->keys, l->verts);
    for (size_t i = 0, end; !st && i < n; i = end) {
        for (end = i + 1; end < n && l->keys[end] == l->keys[i]; end++) {
        }
        if (end - i > 1) st = number_equal(ctx, l, i, end, any);
    }
    return st;
}

tl_status tli_finest_even_twins(tl_ctx *ctx, const tl_segment *s, const int16_t *steps,
                                uint8_t *wanted)
{
    tl_status st = TL_OK;
    size_t n = s->vert_count;
    uint64_t *keys = tl_mem_alloc(ctx, n, sizeof *keys, &st);
    uint32_t *verts = tl_mem_alloc(ctx, n, sizeof *verts, &st);
    if (!st) st = sort_places(ctx, s->xyz, n, keys, verts);
    for (size_t i = 0, end; !st && i < n; i = end) {
        for (end = i + 1; end < n && keys[end] == keys[i]; end++) {
        }
        for (size_t a = i; end - i > 1 && a < end; a++)
            for (size_t b = i; b < end; b++)
                if (steps[verts[b]] < steps[verts[a]] &&
                    same_place(s->xyz + 3 * (size_t)verts[a], s->xyz + 3 * (size_t)verts[b]))
                    wanted[verts[a]] = 1;
    }
    tl_mem_free(ctx, verts);
    tl_mem_free(ctx, keys);
    return st;
}

typedef struct twin_job {
    tli_finest *finest;
    tli_mail *mail;
    const uint32_t *list; /* of segments that listen */
} twin_job;

static tl_status open_look(tl_ctx *ctx, const twin_job *j, uint32_t segment, twin_look *l)
{
    tl_status st = tl_segments_load(ctx, j->finest->segments, segment, &l->segment);
    size_t n = l->segment.vert_count;
    l->xyz = tl_mem_alloc(ctx, n, 3 * sizeof *l->xyz, &st);
    l->steps = tl_mem_alloc(ctx, n, sizeof *l->steps, &st);
    l->keys = tl_mem_alloc(ctx, n, sizeof *l->keys, &st);
    l->words = tl_mem_alloc(ctx, n, sizeof *l->words, &st);
    l->verts = tl_mem_alloc(ctx, n, sizeof *l->verts, &st);
    l->numbers = tl_mem_zalloc(ctx, n, 1, &st);
    return st;
}

static void close_look(tl_ctx *ctx, twin_look *l)
{
    void *blocks[] = {l->numbers, l->verts, l->words, l->keys, l->steps, l->xyz};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    tl_segment_release(ctx, &l->segment);
}

/* Numbers the vertices whose home a segment is, and tells of those that are shared. */
static tl_status number_segment(tl_ctx *ctx, const twin_job *j, twin_look *l)
{
    const tl_segment *s = &l->segment;
    size_t count = 0;
    bool any = false;
    tl_status st = tli_finest_steps(ctx, j->finest, s, l->steps);
    if (st) return st;
    tli_finest_snap(j->finest, s, l->steps, l->xyz);
    st = number(ctx, l, &any);
    if (st || !any) return st;
    for (size_t v = 0; v < s->vert_count; v++)
        if (l->numbers[v] && TL_LINK_SLOT(s->links[v]))
            l->words[count++] = s->vert_ids[v] << NUMBER_BITS | l->numbers[v];
    st = tli_marks_write(ctx, j->finest, &j->finest->twins, s, l->numbers);
    return st ? st : tli_mail_put(ctx, j->mail, s->id, l->words, count);
}

/* Takes over the numbers of vertices whose home is elsewhere. */
static tl_status hear_segment(tl_ctx *ctx, const twin_job *j, twin_look *l)
{
    const tl_segment *s = &l->segment;
    uint64_t *words = NULL;
    size_t count = 0;
    bool any = false;
    tl_status st = tli_mail_gather(ctx, j->mail, s->id, &words, &count);
    if (!st) st = tli_marks_read(ctx, j->finest, &j->finest->twins, s, l->numbers);
    for (size_t v = 0; !st && v < s->vert_count; v++) {
        size_t lo = 0, hi = count;
        if (!(s->links[v] & TL_LINK_COPY)) continue;
        while (lo < hi) {
            size_t mid = lo + (hi - lo) / 2;
            if (words[mid] >> NUMBER_BITS < s->vert_ids[v])
                lo = mid + 1;
            else
                hi = mid;
        }
        if (lo == count || words[lo] >> NUMBER_BITS != s->vert_ids[v]) continue;
        l->numbers[v] = (uint8_t)words[lo];
        any = true;
    }
    tl_mem_free(ctx, words);
    return !st && any ? tli_marks_write(ctx, j->finest, &j->finest->twins, s, l->numbers) : st;
}

static tl_status twin_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    twin_job *j = arg;
    tl_ctx *ctx = NULL, *root = j->finest->model->ctx;
    tl_status st = tli_ctx_fork(root, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++) {
        twin_look l = {0};
        st = open_look(ctx, j, j->list ? j->list[i] : (uint32_t)i, &l);
        if (!st) st = j->list ? hear_segment(ctx, j, &l) : number_segment(ctx, j, &l);
        close_look(ctx, &l);
    }
    return tli_ctx_join(root, ctx, st);
}

tl_status tli_finest_number_twins(tli_finest *f)
{
    tl_status st = TL_OK;
    tl_ctx *ctx = f->model->ctx;
    tli_mail mail;
    size_t count = tl_segments_count(f->segments), listeners = 0;
    uint32_t *list = tl_mem_alloc(ctx, count, sizeof *list, &st);
    uint8_t *marks = tl_mem_alloc(ctx, count, 1, &st);
    twin_job job = {f, &mail, NULL};
    tl_status opened = tli_mail_open(ctx, f->model->plan->opts.folder, f->segments, &mail);
    if (!st) st = opened;
    if (!st) st = tli_marks_open(ctx, f, &f->twins);
    size_t at_once = f->model->plan->at_once;
    if (!st) st = tli_turns(ctx, "twins", count, at_once, twin_range, &job);
    if (!st) listeners = tli_mail_list(&mail, marks, list);
    job.list = list;
    if (!st && listeners) st = tli_turns(ctx, "twins", listeners, at_once, twin_range, &job);
    tli_mail_close(ctx, &mail);
    tl_mem_free(ctx, marks);
    tl_mem_free(ctx, list);
    return st;
}
