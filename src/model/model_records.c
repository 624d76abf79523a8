/* Records of carried originals, from patches to patches, without ever being whole in memory. */
#include <math.h>

#include "model/model.h"

/* Records of a window at most, and of each patch that is written; windows in memory for each thread
 * where there are several. */
enum { WINDOW = 512, ROOM = 512, WINDOWS = 8 };

/* ---- a record ---- */

void tli_record_fill(const tli_plan *plan, const tl_segment *s, int kind, size_t element,
                     const tli_star *stars, double *record)
{
    const tl_on on = kind == TLI_POINTS ? TL_ON_VERTEX : TL_ON_TET;
    const double *row = on == TL_ON_VERTEX ? s->values + element * plan->source_vert_comps
                                           : s->tet_values + element * plan->source_tet_comps;
    double *values = record + 3;
    if (on == TL_ON_VERTEX)
        memcpy(record, s->xyz + 3 * element, 3 * sizeof *record);
    else {
        double p[4][3];
        for (size_t c = 0; c < 4; c++)
            memcpy(p[c], s->xyz + 3 * (size_t)s->tets[4 * element + c], sizeof p[c]);
        for (int k = 0; k < 3; k++) record[k] = (p[0][k] + p[1][k] + p[2][k] + p[3][k]) / 4;
        double volume = fabs(tl_tet_volume(TLI_CORNERS(p)));
        *values++ = isfinite(volume) ? volume : 0;
    }
    for (size_t f = 0; f < plan->field_count; f++) {
        const tli_field *field = &plan->fields[f];
        if (field->on == on)
            memcpy(values + field->first, row + field->source_first,
                   field->components * sizeof *values);
    }
    if (on == TL_ON_VERTEX)
        memcpy(values + plan->vert_comps, stars + element * plan->vert_fields,
               plan->vert_fields * sizeof *stars);
}

/* ---- reading ---- */

/* Windows at hand, and where the next ones are. */
typedef struct reader {
    tl_ctx *ctx;
    const tli_model *model;
    tli_depot *from;
    const tli_segment_note *segment;
    const tli_pass *pass;
    int kind;
    size_t doubles;
    tli_record_window *windows; /* [room] */
    uint64_t *places;           /* [room] in the file */
    size_t room, count;
    uint32_t input;
    size_t extent;
    uint64_t at; /* record of the extent */
    bool again;
} reader;

static tl_status open_reader(reader *r)
{
    tl_status st = TL_OK;
    unsigned threads = tl_ctx_thread_count(r->ctx);
    r->room = threads > 1 ? threads * WINDOWS : 1;
    r->places = tl_mem_alloc(r->ctx, r->room, sizeof *r->places, &st);
    r->windows = tl_mem_zalloc(r->ctx, r->room, sizeof *r->windows, &st);
    for (size_t i = 0; !st && i < r->room; i++) {
        tli_record_window *w = &r->windows[i];
        w->records = tl_mem_alloc(r->ctx, WINDOW * r->doubles, sizeof *w->records, &st);
        w->tets = tl_mem_alloc(r->ctx, WINDOW, sizeof *w->tets, &st);
        w->weights = tl_mem_alloc(r->ctx, WINDOW, sizeof *w->weights, &st);
        w->sums = tl_mem_alloc(r->ctx, r->pass->sum_count, sizeof *w->sums, &st);
    }
    return st;
}

static void close_reader(reader *r)
{
    for (size_t i = 0; r->windows && i < r->room; i++) {
        tl_mem_free(r->ctx, r->windows[i].sums);
        tl_mem_free(r->ctx, r->windows[i].weights);
        tl_mem_free(r->ctx, r->windows[i].tets);
        tl_mem_free(r->ctx, r->windows[i].records);
    }
    tl_mem_free(r->ctx, r->windows);
    tl_mem_free(r->ctx, r->places);
}

static void start_window(const reader *r, tli_record_window *w)
{
    w->left = 0;
    for (size_t i = 0; i < r->pass->sum_count; i++) w->sums[i] = 0;
    for (int k = 0; k < 3; k++) {
        w->box[2 * k] = (double)INFINITY;
        w->box[2 * k + 1] = (double)-INFINITY;
    }
}

/* As many windows as there is room for; none at the end. */
static void next_windows(reader *r)
{
    for (r->count = 0; r->count < r->room && r->input < r->segment->input_count;) {
        const tli_extents *e = &r->model->patches[r->segment->inputs[r->input]].extents[r->kind];
        if (r->extent == e->count) {
            r->extent = 0;
            r->input++;
            continue;
        }
        uint64_t left = e->items[r->extent].count - r->at;
        tli_record_window *w = &r->windows[r->count];
        w->input = r->input;
        w->count = left < WINDOW ? (size_t)left : WINDOW;
        r->places[r->count++] = e->items[r->extent].ofs + r->at * r->doubles * sizeof *w->records;
        start_window(r, w);
        r->at += w->count;
        if (r->at < e->items[r->extent].count) continue;
        r->at = 0;
        r->extent++;
    }
}

static tl_status work(void *arg, size_t begin, size_t end, unsigned worker)
{
    const reader *r = arg;
    const tli_pass *pass = r->pass;
    tl_status st = TL_OK;
    for (size_t i = begin; !st && i < end; i++) {
        tli_record_window *w = &r->windows[i];
        if (r->again) {
            if (w->left) st = pass->again(pass->user, w, worker);
            continue;
        }
        st = tli_depot_get(r->ctx, r->from, r->places[i], w->records,
                           w->count * r->doubles * sizeof *w->records);
        if (!st && pass->work) st = pass->work(pass->user, w, worker);
    }
    return st;
}

static tl_status pass_windows(reader *r)
{
    const tli_pass *pass = r->pass;
    tl_status st = TL_OK;
    size_t left = 0;
    for (size_t i = 0; pass->before && !st && i < r->count; i++)
        st = pass->before(pass->user, &r->windows[i]);
    r->again = false;
    if (!st) st = tli_parallel(r->ctx, r->count, 1, work, r);
    for (size_t i = 0; !st && i < r->count; i++) left += r->windows[i].left;
    if (!st && left) {
        r->again = true;
        st = pass->look(pass->user);
        if (!st) st = tli_parallel(r->ctx, r->count, 1, work, r);
    }
    for (size_t i = 0; !st && i < r->count; i++) st = pass->after(pass->user, &r->windows[i]);
    return st;
}

tl_status tli_records_read(tl_ctx *ctx, const tli_model *model, tli_depot *from,
                           const tli_segment_note *segment, int kind, const tli_pass *pass)
{
    reader r = {.ctx = ctx,
                .model = model,
                .from = from,
                .segment = segment,
                .pass = pass,
                .kind = kind,
                .doubles = tli_record_doubles(model->plan, kind)};
    tl_status st = open_reader(&r);
    if (!st) next_windows(&r);
    while (!st && r.count) {
        st = pass_windows(&r);
        next_windows(&r);
    }
    close_reader(&r);
    return st;
}

/* ---- dealing ---- */

tl_status tli_dealer_open(tl_ctx *ctx, const tli_model *model, tli_depot *to, tli_patch_note *notes,
                          size_t count, int kind, tli_dealer *dealer)
{
    tl_status st = TL_OK;
    size_t doubles = tli_record_doubles(model->plan, kind);
    *dealer = (tli_dealer){
        .ctx = ctx, .to = to, .notes = notes, .count = count, .doubles = doubles, .kind = kind};
    dealer->rooms = tl_mem_alloc(ctx, count * ROOM, doubles * sizeof *dealer->rooms, &st);
    dealer->filled = tl_mem_zalloc(ctx, count, sizeof *dealer->filled, &st);
    return st;
}

static tl_status flush(tli_dealer *d, size_t patch)
{
    uint64_t ofs;
    tl_status st = tli_depot_put(d->ctx, d->to, d->rooms + patch * ROOM * d->doubles,
                                 d->filled[patch] * d->doubles * sizeof *d->rooms, &ofs);
    if (!st) st = tli_extents_add(d->ctx, &d->notes[patch].extents[d->kind], ofs, d->filled[patch]);
    d->filled[patch] = 0;
    return st;
}

tl_status tli_dealer_add(tli_dealer *d, size_t patch, const double *record, tl_lidx tet)
{
    double *to = d->rooms + (patch * ROOM + d->filled[patch]) * d->doubles;
    memcpy(to, record, d->doubles * sizeof *to);
    tli_record_set_tet(to, d->doubles, tet);
    d->notes[patch].carried += d->kind == TLI_POINTS;
    return ++d->filled[patch] == ROOM ? flush(d, patch) : TL_OK;
}

tl_status tli_dealer_close(tli_dealer *d, tl_status st)
{
    for (size_t p = 0; !st && p < d->count; p++)
        if (d->filled[p]) st = flush(d, p);
    tl_mem_free(d->ctx, d->filled);
    tl_mem_free(d->ctx, d->rooms);
    return st;
}
