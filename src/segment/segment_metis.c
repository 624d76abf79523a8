/* Graphs to parts by METIS (Karypis and Kumar), as Debian builds it: 32-bit indices, and random
 * numbers from rand(), which is one for the whole process. So calls stand behind a lock, and each
 * starts from the same seed. METIS allocates by itself, outside of the budget; it needs about 250
 * bytes a node. While it runs it takes SIGTERM for a failure of its own; the signal waits, for
 * the caller's handler. */
#ifdef TETRALOD_METIS
#include "segment/segment_octree.h"

#include <metis.h>
#include <pthread.h>
#include <signal.h>

#define SEED 20071122
/* Of the largest part over the mean, in thousandths above 1, that METIS accepts. */
#define IMBALANCE 100
/* Up to so many parts, recursive bisection balances better and is fast enough. */
#define RECURSIVE_MAX 8u

_Static_assert(sizeof(idx_t) == sizeof(uint32_t), "METIS with 32-bit indices is expected");

/* The one thing that calls share is rand(); without the lock, results would depend on each other.
 */
static pthread_mutex_t rand_lock = PTHREAD_MUTEX_INITIALIZER;

tl_status tli_graph_partition(tl_ctx *ctx, const tli_graph *graph, uint32_t part_count,
                              uint32_t *parts)
{
    if (part_count < 2) {
        for (uint32_t i = 0; i < graph->node_count; i++) parts[i] = 0;
        return TL_OK;
    }
    uint64_t sum = 0;
    for (uint32_t i = 0; i < graph->node_count; i++) sum += graph->node_weights[i];
    tl_status st = TL_OK;
    /* METIS sums weights in 32 bits */
    unsigned shift = 0;
    while (sum >> shift > INT32_MAX / 2) shift++;
    idx_t *weights = tl_mem_alloc(ctx, graph->node_count, sizeof *weights, &st);
    if (st) return st;
    for (uint32_t i = 0; i < graph->node_count; i++)
        weights[i] = (idx_t)(graph->node_weights[i] >> shift ? graph->node_weights[i] >> shift : 1);

    idx_t options[METIS_NOPTIONS], nodes = (idx_t)graph->node_count, constraints = 1;
    idx_t wanted = (idx_t)part_count, cut = 0;
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = SEED;
    options[METIS_OPTION_UFACTOR] = IMBALANCE;
    idx_t *begins = (idx_t *)graph->begins, *targets = (idx_t *)graph->targets;
    idx_t *edge_weights = (idx_t *)graph->weights, *out = (idx_t *)parts;
    sigset_t term, before;
    sigemptyset(&term);
    sigaddset(&term, SIGTERM);
    pthread_mutex_lock(&rand_lock);
    pthread_sigmask(SIG_BLOCK, &term, &before);
    int done = part_count <= RECURSIVE_MAX
                   ? METIS_PartGraphRecursive(&nodes, &constraints, begins, targets, weights, NULL,
                                              edge_weights, &wanted, NULL, NULL, options, &cut, out)
                   : METIS_PartGraphKway(&nodes, &constraints, begins, targets, weights, NULL,
                                         edge_weights, &wanted, NULL, NULL, options, &cut, out);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_mutex_unlock(&rand_lock);
    tl_mem_free(ctx, weights);
    if (done == METIS_ERROR_MEMORY)
        return tl_fail(ctx, TL_ERR_MEMORY, "METIS: no memory for a graph of %u nodes",
                       graph->node_count);
    if (done != METIS_OK)
        return tl_fail(ctx, TL_ERR_DATA, "METIS: error %d for a graph of %u nodes, %u parts", done,
                       graph->node_count, part_count);
    return TL_OK;
}
#else
/* Without the library segment_bisect.c does it. */
typedef int tli_no_metis;
#endif
