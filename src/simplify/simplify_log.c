/* Collapses as a listener wants to hear them: noted by the worker that makes them, told afterwards
 * on the caller's thread in an order that does not depend on threads. */
#include "simplify/simplify_order.h"

tl_status tli_log_add(tli_log *log, const tli_work *w, tl_lidx kept, tl_lidx gone, double cost)
{
    tl_status st = TL_OK;
    if (log->count == log->capacity) {
        log->capacity = log->capacity ? 2 * log->capacity : 256;
        log->records =
            tl_mem_resize(w->ctx, log->records, log->capacity, sizeof *log->records, &st);
        log->values = tl_mem_resize(w->ctx, log->values, log->capacity * w->components,
                                    sizeof *log->values, &st);
        if (st) return st;
    }
    const tli_vertex *v = &w->verts[kept];
    tl_collapse *r = &log->records[log->count];
    *r = (tl_collapse){.kept = v->origin, .gone = w->verts[gone].origin, .cost = cost};
    memcpy(r->xyz, v->xyz, sizeof r->xyz);
    memcpy(log->values + log->count * w->components, w->values + kept * w->components,
           w->components * sizeof *log->values);
    log->count++;
    return TL_OK;
}

tl_status tli_log_tell(tli_log *log, const tli_work *w)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < log->count; i++) {
        double *values = log->values + i * w->components;
        size_t c = 0;
        for (size_t j = 0; j < w->channel_count; j++)
            for (uint32_t k = 0; k < w->channels[j].components; k++, c++)
                values[c] = w->channels[j].scale > 0 ? values[c] / w->channels[j].scale : values[c];
        log->records[i].values = values;
        st = w->listener(w->listener_user, &log->records[i]);
    }
    log->count = 0;
    return st;
}

void tli_log_release(tl_ctx *ctx, tli_log *log)
{
    tl_mem_free(ctx, log->values);
    tl_mem_free(ctx, log->records);
    *log = (tli_log){0};
}

tl_status tli_held_add(void *user, const tl_collapse *collapse)
{
    tli_held *h = user;
    tl_status st = TL_OK;
    if (h->count == h->capacity) {
        size_t capacity = h->capacity ? 2 * h->capacity : 1024;
        h->records = tl_mem_resize(h->ctx, h->records, capacity, sizeof *h->records, &st);
        h->values =
            tl_mem_resize(h->ctx, h->values, capacity * h->components, sizeof *h->values, &st);
        if (st) return st;
        h->capacity = capacity;
    }
    h->records[h->count] = *collapse;
    memcpy(h->values + h->count * h->components, collapse->values,
           h->components * sizeof *h->values);
    h->count++;
    return TL_OK;
}

tl_status tli_held_tell(tli_held *h, tl_collapse_fn listener, void *user)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < h->count; i++) {
        h->records[i].values = h->values + i * h->components;
        st = listener(user, &h->records[i]);
    }
    return st;
}

void tli_held_release(tli_held *h)
{
    tl_mem_free(h->ctx, h->values);
    tl_mem_free(h->ctx, h->records);
}
