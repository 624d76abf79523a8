/* Random cuts of a model, each proved to fit together. Whether it does is told by the borders of
 * its patches (cut_proof.c), in a fraction of the time that its mesh would take; of some the mesh
 * is made and measured all the same, and held against the original. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/base_random.h"
#include "cut/cut_proof.h"
#include "cut/cut_prover.h"
#include "cut/cut_select.h"

/* The volume is kept within this part, at errors up to that part of a channel's range. */
static const double VOLUME_KEPT = 0.005, VOLUME_ERROR = 0.1;
/* Kinds of cuts that are tried in turn. */
enum { KIND_UNIFORM, KIND_LEVEL, KIND_BOX, KIND_BUDGET, KIND_VIEW, KINDS };
/* Meshes that are made without an original, unless told otherwise. */
#define MESHES 12u
/* Cuts that a thread tries in a row, and rows between two reports. */
#define ROW_CUTS ((size_t)16)
#define REPORT_ROWS ((size_t)16)

tl_cut_check_opts tl_cut_check_opts_defaults(void)
{
    return (tl_cut_check_opts){
        .struct_bytes = sizeof(tl_cut_check_opts), .cuts = 12, .meshes = UINT32_MAX, .seed = 1};
}

/* ---- random cuts ---- */

/* Every cut has dice of its own, so that it does not matter which thread tries it. */
typedef struct dice {
    uint64_t state;
} dice;

/* In [0, 1). */
static double draw(dice *d)
{
    return tli_uniform(&d->state);
}

/* A bound for every channel, the same fraction of the errors of a random level. */
static void draw_bounds(dice *d, const tl_store_head *h, double *bounds)
{
    uint32_t level = (uint32_t)(draw(d) * h->level_count);
    double part = 0.5 + draw(d);
    for (uint32_t c = 0; c < h->channel_count; c++)
        bounds[c] = h->levels[level].max_error[c] * part;
}

static void draw_box(dice *d, const tl_store_head *h, double box[6])
{
    for (int k = 0; k < 3; k++) {
        double lo = h->stats.bounds[2 * k], hi = h->stats.bounds[2 * k + 1];
        double a = lo + draw(d) * (hi - lo), size = (0.1 + 0.4 * draw(d)) * (hi - lo);
        box[k] = a - size / 2;
        box[3 + k] = a + size / 2;
    }
}

/* From a place in or near the data set towards another one in it; of several pixels to thousands
 * of them. */
static double draw_view(dice *d, const tl_store_head *h, tl_camera *camera)
{
    *camera = tl_camera_defaults();
    for (int k = 0; k < 3; k++) {
        double lo = h->stats.bounds[2 * k], width = h->stats.bounds[2 * k + 1] - lo;
        camera->focal_point[k] = lo + width * draw(d);
        camera->position[k] =
            lo + width * (2 * draw(d) - 0.5) + 0.01 * h->stats.diagonal * (1 + draw(d));
    }
    camera->view_up[0] = 0.3;
    camera->view_up[1] = 0.5;
    camera->view_angle = 10 + 80 * draw(d);
    if (draw(d) < 0.25) camera->parallel_scale = h->stats.diagonal * (0.05 + draw(d));
    return pow(10, 4 * draw(d) - 1);
}

/* Moves a cut to the i-th one. bounds [channel_count] is scratch. */
static tl_status move_cut(tl_cut *cut, const tl_store_head *head, uint64_t seed, size_t i,
                          double *bounds)
{
    tl_cut_query query = tl_cut_query_defaults();
    tl_camera camera;
    double box[6];
    dice d = {tli_mix_bits(seed) ^ tli_mix_bits(i + 1)};
    switch (i % KINDS) {
    case KIND_LEVEL: query.level = (uint32_t)(draw(&d) * head->level_count); break;
    case KIND_BUDGET:
        query.tets_max = (uint64_t)((double)head->input_tets * pow(10, -2 * draw(&d)));
        break;
    case KIND_VIEW:
        query.pixels = draw_view(&d, head, &camera);
        query.camera = &camera;
        break;
    default: draw_bounds(&d, head, bounds); query.bounds.channels = bounds;
    }
    if (i % KINDS == KIND_BOX) {
        draw_box(&d, head, box);
        query.box = box;
    }
    return tl_cut_update(cut, &query);
}

static double largest_share(const tl_cut *cut, const tl_store_head *head)
{
    double largest = 0;
    for (size_t c = 0; c < head->channel_count; c++) {
        double width = head->channels[c].range[1] - head->channels[c].range[0];
        if (width > 0) largest = fmax(largest, tl_cut_channel_error(cut, c) / width);
    }
    return largest;
}

/* ---- borders of patches ---- */

/* What a thread of its own has. */
typedef struct hand {
    tl_ctx *ctx; /* a fork */
    tl_cut *cut;
    uint16_t *counts;
    double *bounds;
    uint32_t *patches; /* [patch count] of the cut in rising order, for sums that do not depend on
                          the cuts before */
    double volume_off;
    size_t failed_at; /* the first cut that failed; SIZE_MAX: none */
    tl_status status;
} hand;

typedef struct trial {
    tl_ctx *ctx;
    tl_store *store;
    const tl_store_head *head;
    const tli_proof *proof;
    uint64_t seed;
    size_t first, count; /* cuts of this round */
    hand *hands;         /* [thread count] */
    unsigned hand_count;
} trial;

static tl_status fail_tets(tl_ctx *ctx, uint64_t tets, uint64_t inverted, uint64_t flat,
                           uint64_t finest_inverted, uint64_t finest_flat)
{
    return tl_fail(ctx, TL_ERR_DATA,
                   "a cut of %llu tets has %llu inverted and %llu flat ones, the finest mesh has "
                   "%llu and %llu",
                   (unsigned long long)tets, (unsigned long long)inverted, (unsigned long long)flat,
                   (unsigned long long)finest_inverted, (unsigned long long)finest_flat);
}

static tl_status keep_volume(tl_ctx *ctx, uint64_t tets, double volume, double finest, double share,
                             double *volume_off)
{
    double off = fabs(volume - finest) / (finest != 0 ? fabs(finest) : 1);
    if (share > VOLUME_ERROR) return TL_OK;
    *volume_off = fmax(*volume_off, off);
    if (off <= VOLUME_KEPT) return TL_OK;
    return tl_fail(ctx, TL_ERR_DATA,
                   "a cut of %llu tets has a volume of %g, the finest mesh has %g",
                   (unsigned long long)tets, volume, finest);
}

static tl_status try_cut(const trial *t, hand *h, size_t i)
{
    tli_proof_sums sums;
    size_t count = 0;
    const tli_proof_sums *finest = &tli_proof_of_level(t->proof, 0)->sums;
    tl_status st = move_cut(h->cut, t->head, t->seed, i, h->bounds);
    const uint32_t *patches = tl_cut_patches(h->cut, &count);
    memcpy(h->patches, patches, count * sizeof *patches);
    tli_ids_sort(h->patches, count);
    if (!st) st = tli_proof_patches(h->ctx, t->proof, h->patches, count, h->counts, &sums);
    if (!st && sums.tets != tl_cut_get_state(h->cut).tets)
        st = tl_fail(h->ctx, TL_ERR_DATA, "a cut has %llu tets, its patches have %llu",
                     (unsigned long long)tl_cut_get_state(h->cut).tets,
                     (unsigned long long)sums.tets);
    if (!st && (sums.inverted > finest->inverted || sums.flat > finest->flat))
        st = fail_tets(h->ctx, sums.tets, sums.inverted, sums.flat, finest->inverted, finest->flat);
    if (!st)
        st = keep_volume(h->ctx, sums.tets, sums.volume, finest->volume,
                         largest_share(h->cut, t->head), &h->volume_off);
    return st ? tl_note(h->ctx, st, "while trying cut %zu", i) : TL_OK;
}

static tl_status try_rows(void *arg, size_t begin, size_t end, unsigned worker)
{
    const trial *t = arg;
    hand *h = &t->hands[worker];
    for (size_t i = t->first + begin; i < t->first + end; i++) {
        tl_status st = try_cut(t, h, i);
        if (!st) continue;
        h->failed_at = i;
        return h->status = st;
    }
    return TL_OK;
}

static tl_status open_hands(trial *t)
{
    tl_status st = TL_OK;
    t->hand_count = tl_ctx_thread_count(t->ctx);
    t->hands = tl_mem_zalloc(t->ctx, t->hand_count, sizeof *t->hands, &st);
    for (unsigned i = 0; !st && i < t->hand_count; i++) {
        hand *h = &t->hands[i];
        h->failed_at = SIZE_MAX;
        st = tli_ctx_fork(t->ctx, &h->ctx);
        if (!st) st = tl_cut_create(h->ctx, t->store, &h->cut);
        if (!st) st = tli_proof_counts(h->ctx, t->proof, &h->counts);
        h->bounds = st ? NULL : tl_mem_alloc(h->ctx, t->head->channel_count, sizeof(double), &st);
        h->patches = st ? NULL : tl_mem_alloc(h->ctx, t->head->patch_count, sizeof(uint32_t), &st);
        if (st) {
            h->failed_at = 0;
            h->status = st;
        }
    }
    return st;
}

/* Returns the status of the first cut that failed, whose message it takes over. */
static tl_status close_hands(trial *t, double *volume_off)
{
    unsigned first = 0;
    for (unsigned i = 0; t->hands && i < t->hand_count; i++)
        if (t->hands[i].failed_at < t->hands[first].failed_at) first = i;
    tl_status st = t->hands ? t->hands[first].status : TL_OK;
    for (unsigned i = 0; t->hands && i < t->hand_count; i++) {
        hand *h = &t->hands[i];
        *volume_off = fmax(*volume_off, h->volume_off);
        tl_cut_destroy(h->cut);
        if (!h->ctx) continue;
        tl_mem_free(h->ctx, h->patches);
        tl_mem_free(h->ctx, h->bounds);
        tl_mem_free(h->ctx, h->counts);
        if (i != first) tli_ctx_join(t->ctx, h->ctx, TL_OK);
    }
    if (t->hands) tli_ctx_join(t->ctx, t->hands[first].ctx, st);
    tl_mem_free(t->ctx, t->hands);
    return st;
}

/* Levels as wholes, which the cuts are held against. */
static tl_status prove_levels(const trial *t)
{
    const uint64_t least = tli_proof_of_level(t->proof, 0)->odd_sides;
    for (uint32_t l = 1; l < t->head->level_count; l++) {
        const uint64_t odd = tli_proof_of_level(t->proof, l)->odd_sides;
        if (odd > least)
            return tl_fail(t->ctx, TL_ERR_DATA,
                           "level %u does not fit together: %llu sides of faces that are not those "
                           "of one tet or of two, the finest level has %llu",
                           l, (unsigned long long)odd, (unsigned long long)least);
    }
    return TL_OK;
}

/* Proves cuts [0, cuts) by the borders of their patches. */
static tl_status prove_borders(tli_prover *p, const tl_cut_check_opts *o)
{
    tli_proof *proof = NULL;
    trial t = {.ctx = p->ctx, .store = p->store, .head = p->head, .seed = o->seed};
    tl_status st = tli_proof_create(p->ctx, p->store, &proof);
    if (st) return st;
    t.proof = proof;
    st = prove_levels(&t);
    if (!st) st = open_hands(&t);
    while (!st && t.first < o->cuts) {
        size_t left = o->cuts - t.first, round = ROW_CUTS * REPORT_ROWS;
        t.count = left < round ? left : round;
        st = tli_parallel(p->ctx, t.count, ROW_CUTS, try_rows, &t);
        if (!st) t.first += t.count;
        if (!st) st = tl_progress(p->ctx, "cuts", t.first, o->cuts);
    }
    p->result->cuts_tried = (uint32_t)t.first;
    tl_status first = close_hands(&t, &p->result->volume_off);
    tli_proof_destroy(proof);
    return first ? first : st;
}

/* ---- meshes ---- */

static tl_status prove_shape(tli_prover *p, const tl_mesh *mesh, double error_share)
{
    tl_mesh_stats now;
    const tl_mesh_stats *f = &p->finest;
    tl_status st = tl_mesh_measure(p->ctx, mesh, &now);
    if (st) return st;
    uint64_t tets = tl_mesh_tet_count(mesh);
    if (now.nonmanifold_faces > f->nonmanifold_faces ||
        now.nonmanifold_edges > f->nonmanifold_edges)
        return tl_fail(p->ctx, TL_ERR_DATA,
                       "a cut of %llu tets does not fit together: %zu faces of more than two tets "
                       "and %zu open edges, the finest mesh has %zu and %zu",
                       (unsigned long long)tets, now.nonmanifold_faces, now.nonmanifold_edges,
                       f->nonmanifold_faces, f->nonmanifold_edges);
    if (now.inverted > f->inverted || now.degenerate > f->degenerate)
        return fail_tets(p->ctx, tets, now.inverted, now.degenerate, f->inverted, f->degenerate);
    return keep_volume(p->ctx, tets, now.volume, f->volume, error_share, &p->result->volume_off);
}

/* Whether the cut has the patches of one that was measured before, as those of small models often
 * have; if not, it counts from now on. Whatever their order, patches add up to the same number. */
static bool is_known(tli_prover *p, bool uniform)
{
    size_t count;
    const uint32_t *patches = tl_cut_patches(p->cut, &count);
    uint64_t sum = uniform;
    for (size_t i = 0; i < count; i++)
        sum += tli_mix_bits(tli_mix_bits(patches[i] + UINT64_C(1)) + 1);
    for (size_t i = 0; i < p->proved_count; i++)
        if (p->proved[i] == sum) return true;
    p->proved[p->proved_count++] = sum;
    return false;
}

static tl_status prove_mesh(tli_prover *p, uint64_t seed, size_t i, double *bounds)
{
    tl_mesh *mesh = NULL;
    const bool uniform = i % KINDS == KIND_LEVEL;
    tl_status st = move_cut(p->cut, p->head, seed, i, bounds);
    if (!st && is_known(p, uniform)) {
        p->result->meshes_made++;
        return TL_OK;
    }
    if (!st) st = tl_cut_mesh(p->cut, p->channels, p->channel_count, &mesh);
    if (!st) st = prove_shape(p, mesh, largest_share(p->cut, p->head));
    if (!st && p->original) st = tli_prove_promises(p, mesh, uniform);
    if (!st && p->original && p->finest.nonfinite_verts == 0)
        st = tli_prove_boundary(p, mesh, uniform);
    if (!st) p->result->meshes_made++;
    tl_mesh_destroy(mesh);
    return st ? tl_note(p->ctx, st, "while trying cut %zu", i) : TL_OK;
}

/* The finest mesh, which all others are held against. */
static tl_status measure_finest(tli_prover *p)
{
    tl_cut_query query = tl_cut_query_defaults();
    tl_mesh *mesh = NULL;
    query.level = 0;
    tl_status st = tl_cut_update(p->cut, &query);
    if (!st) st = tl_cut_mesh(p->cut, p->channels, p->channel_count, &mesh);
    if (!st) st = tl_mesh_measure(p->ctx, mesh, &p->finest);
    if (!st && p->original && tl_mesh_tet_count(p->original) != p->head->input_tets)
        st = tl_fail(p->ctx, TL_ERR_DATA,
                     "the original has %zu tets, the model was made of %llu: another data set",
                     tl_mesh_tet_count(p->original), (unsigned long long)p->head->input_tets);
    tl_mesh_destroy(mesh);
    return st;
}

/* Makes and measures the meshes of the first cuts. */
static tl_status prove_meshes(tli_prover *p, const tl_cut_check_opts *o)
{
    tl_status st = TL_OK;
    uint32_t count = o->meshes;
    if (count == UINT32_MAX && !p->original) count = MESHES;
    if (count > o->cuts) count = o->cuts;
    if (!count) return TL_OK;
    double *bounds = tl_mem_alloc(p->ctx, p->head->channel_count, sizeof *bounds, &st);
    p->proved = tl_mem_alloc(p->ctx, count, sizeof *p->proved, &st);
    if (!st) st = tl_cut_create(p->ctx, p->store, &p->cut);
    if (!st) st = measure_finest(p);
    for (uint32_t i = 0; !st && i < count; i++) {
        st = prove_mesh(p, o->seed, i, bounds);
        if (!st) st = tl_progress(p->ctx, "meshes", i + 1, count);
    }
    tl_cut_destroy(p->cut);
    tl_mem_free(p->ctx, p->proved);
    tl_mem_free(p->ctx, bounds);
    return st;
}

static tl_status list_channels(tli_prover *p, const tl_cut_check_opts *o)
{
    tl_status st = TL_OK;
    p->channels = tl_mem_alloc(p->ctx, p->head->channel_count, sizeof *p->channels, &st);
    for (size_t c = 0; !st && c < p->head->channel_count; c++) {
        const tl_store_channel *channel = &p->head->channels[c];
        if (!o->has_step || !channel->has_step || channel->step == o->step)
            p->channels[p->channel_count++] = c;
    }
    return st;
}

tl_status tl_cut_check(tl_ctx *ctx, tl_store *store, const tl_mesh *original,
                       const tl_cut_check_opts *opts, tl_cut_check_result *result)
{
    tl_status st = TL_OK;
    tl_cut_check_opts o = tl_cut_check_opts_defaults();
    tl_cut_check_result r = {0};
    tli_prover p = {.ctx = ctx,
                    .store = store,
                    .head = tl_store_get_head(store),
                    .original = original,
                    .result = &r};
    *result = r;
    st = tli_opts_take(ctx, "tl_cut_check_opts", opts, &o, sizeof o);
    if (st) return st;
    r.channels = tl_mem_zalloc(ctx, p.head->channel_count, sizeof *r.channels, &st);
    if (!st) {
        r.channel_count = p.head->channel_count;
        for (size_t c = 0; c < r.channel_count; c++) r.channels[c].name = p.head->channels[c].name;
    }
    if (!st) st = list_channels(&p, &o);
    if (!st && o.cuts) st = prove_borders(&p, &o);
    if (!st) st = prove_meshes(&p, &o);
    tl_mem_free(ctx, p.channels);
    if (st)
        tl_cut_check_release(ctx, &r);
    else
        *result = r;
    return st;
}

void tl_cut_check_release(tl_ctx *ctx, tl_cut_check_result *result)
{
    if (!result) return;
    tl_mem_free(ctx, result->channels);
    *result = (tl_cut_check_result){0};
}
