/* Edges that wait between rounds. Costs are computed once when the mesh is new and once more when
 * an end changes, never because a round begins: dealing the edges to the blocks of a round only
 * streams them. */
#include "simplify/simplify_order.h"

void tli_pool_release(tl_ctx *ctx, tli_pool *pool)
{
    for (size_t i = 0; pool->lists && i < pool->list_count; i++)
        tl_mem_free(ctx, pool->lists[i].edges);
    tl_mem_free(ctx, pool->lists);
    *pool = (tli_pool){0};
}

/* In place of a block: an end has changed since. */
enum { OLD = UINT16_MAX };

typedef struct deal_job {
    const tli_work *work;
    tli_pool *pool;
    size_t block_count;
    uint16_t **blocks;  /* [list_count] of each edge */
    size_t *places;     /* [list_count][block_count + 1]: counts, then where to put the next one */
    tli_edges *dealt;   /* [block_count + 1] */
    tli_tally *tallies; /* one a worker */
} deal_job;

/* The block that holds an edge with all its neighbours: 0 if none does, OLD for an old edge. */
static uint16_t block_of(const tli_work *w, tli_edge e)
{
    const tli_vertex *u = &w->verts[e.u], *v = &w->verts[e.v];
    if (e.stamp != (uint16_t)(u->version + v->version)) return OLD;
    return u->border || v->border || u->block != v->block ? 0 : u->block;
}

static tl_status count_edges(void *arg, size_t begin, size_t end, unsigned worker)
{
    deal_job *job = arg;
    tl_status st = TL_OK;
    (void)worker;
    for (size_t l = begin; !st && l < end; l++) {
        const tli_edges *list = &job->pool->lists[l];
        size_t *counts = job->places + l * (job->block_count + 1);
        job->blocks[l] = tl_mem_alloc(job->work->ctx, list->count, sizeof **job->blocks, &st);
        for (size_t i = 0; !st && i < list->count; i++) {
            uint16_t b = job->blocks[l][i] = block_of(job->work, list->edges[i]);
            if (b != OLD) counts[b]++;
        }
    }
    return st;
}

static tl_status place_edges(void *arg, size_t begin, size_t end, unsigned worker)
{
    deal_job *job = arg;
    tli_tally *tally = &job->tallies[worker];
    for (size_t l = begin; l < end; l++) {
        tli_edges *list = &job->pool->lists[l];
        size_t *places = job->places + l * (job->block_count + 1);
        for (size_t i = 0; i < list->count; i++) {
            uint16_t b = job->blocks[l][i], cost = list->edges[i].cost;
            if (b == OLD) continue;
            job->dealt[b].edges[places[b]++] = list->edges[i];
            if (cost & TLI_REFUSED) continue;
            tally->all[cost]++;
            tally->inside[cost] += b != 0;
        }
        tl_mem_free(job->work->ctx, list->edges);
        *list = (tli_edges){0};
    }
    return TL_OK;
}

/* Counts to places in the blocks' lists, which get their memory. */
static tl_status make_room(const deal_job *job)
{
    tl_status st = TL_OK;
    size_t stride = job->block_count + 1;
    for (size_t b = 0; !st && b < stride; b++) {
        size_t sum = 0;
        for (size_t l = 0; l < job->pool->list_count; l++) {
            size_t count = job->places[l * stride + b];
            job->places[l * stride + b] = sum;
            sum += count;
        }
        tli_edges *to = &job->dealt[b];
        to->count = to->capacity = sum;
        to->edges = tl_mem_alloc(job->work->ctx, sum, sizeof *to->edges, &st);
    }
    return st;
}

static void add_tallies(const deal_job *job, tli_tally *sum)
{
    memset(sum, 0, sizeof *sum);
    for (unsigned i = 0; i < job->work->bank_count; i++)
        for (size_t k = 0; k < TLI_QUEUE_COSTS; k++) {
            sum->inside[k] += job->tallies[i].inside[k];
            sum->all[k] += job->tallies[i].all[k];
        }
}

tl_status tli_pool_deal(tli_work *w, tli_pool *pool, size_t block_count, tli_tally *tally)
{
    tl_status st = TL_OK;
    deal_job job = {w, pool, block_count, NULL, NULL, NULL, NULL};
    size_t lists = pool->list_count;
    job.blocks = tl_mem_zalloc(w->ctx, lists, sizeof *job.blocks, &st);
    job.places = tl_mem_zalloc(w->ctx, lists * (block_count + 1), sizeof *job.places, &st);
    job.dealt = tl_mem_zalloc(w->ctx, block_count + 1, sizeof *job.dealt, &st);
    job.tallies = tl_mem_zalloc(w->ctx, w->bank_count, sizeof *job.tallies, &st);
    if (!st) st = tli_parallel(w->ctx, lists, 1, count_edges, &job);
    if (!st) st = make_room(&job);
    if (!st) st = tli_parallel(w->ctx, lists, 1, place_edges, &job);
    if (!st) add_tallies(&job, tally);
    for (size_t l = 0; job.blocks && l < lists; l++) tl_mem_free(w->ctx, job.blocks[l]);
    tl_mem_free(w->ctx, job.tallies);
    tl_mem_free(w->ctx, job.places);
    tl_mem_free(w->ctx, job.blocks);
    tli_pool_release(w->ctx, pool);
    *pool = (tli_pool){job.dealt, job.dealt ? block_count + 1 : 0};
    return st;
}
