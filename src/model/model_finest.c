/* Level 0: the segments of the input with places and values as they will be decoded, cut into
 * patches, with the originals on board. Steps of places are agreed on by all segments first. */
#include <math.h>

#include "base/base_predicates.h"
#include "base/base_sort.h"
#include "model/model.h"
#include "model/model_finest.h"
#include "model/model_turns.h"

/* ---- a segment as a mesh ---- */

static tl_status add_fields(tl_ctx *ctx, const tli_plan *plan, const tl_segment *s, tl_mesh *mesh)
{
    tl_status st = TL_OK;
    for (size_t i = 0; !st && i < plan->field_count; i++) {
        const tli_field *f = &plan->fields[i];
        bool on_vertex = f->on == TL_ON_VERTEX;
        size_t count = on_vertex ? s->vert_count : s->tet_count, k = f->components;
        size_t stride = on_vertex ? plan->source_vert_comps : plan->source_tet_comps;
        const double *from = (on_vertex ? s->values : s->tet_values) + f->source_first;
        double *values = tl_mem_alloc(ctx, count * k, sizeof *values, &st), *to = values;
        for (size_t e = 0; !st && e < count; e++, from += stride)
            for (size_t c = 0; c < k; c++) *to++ = tli_field_round(f, from[c]);
        tl_channel channel = {f->key, f->unit, f->components, f->on, TL_F64, values};
        if (!st) st = tl_mesh_adopt_channel(mesh, &channel);
        if (st) tl_mem_free(ctx, values);
    }
    if (!st && s->regions) st = tl_mesh_set_regions(mesh, s->regions);
    return st;
}

static tl_status make_mesh(tl_ctx *ctx, const tli_finest *f, const tl_segment *s, tl_mesh **mesh)
{
    tl_status st = TL_OK;
    double *xyz = tl_mem_alloc(ctx, s->vert_count, 3 * sizeof *xyz, &st);
    tl_lidx *tets = tl_mem_alloc(ctx, s->tet_count, 4 * sizeof *tets, &st);
    *mesh = NULL;
    int16_t *steps = tl_mem_alloc(ctx, s->vert_count, sizeof *steps, &st);
    if (!st) st = tli_finest_steps(ctx, f, s, steps);
    if (!st) {
        tli_finest_snap(f, s, steps, xyz);
        for (size_t i = 0; i < 4 * (size_t)s->tet_count; i++) tets[i] = s->tets[i];
        st = tl_mesh_adopt(ctx, xyz, s->vert_count, tets, s->tet_count, mesh);
    }
    tl_mem_free(ctx, steps);
    if (st) {
        tl_mem_free(ctx, tets);
        tl_mem_free(ctx, xyz);
        return st;
    }
    return add_fields(ctx, f->model->plan, s, *mesh);
}

/* ---- patches ---- */

typedef struct job {
    tl_ctx *ctx;
    tli_finest *finest;
    const tli_plan *plan;
    tl_segment segment;
    tl_mesh *mesh;
    tl_lidx *opposite, *tet_of, *tet_local;
    tli_star *stars; /* [vert_count][vert_fields] */
    uint8_t *outer;  /* [tet_count] bit f: face f is boundary of the whole */
    uint32_t *part;
    tli_product *product;
    uint64_t *carried; /* [TLI_KINDS] */
} job;

static tl_status write_patches(job *j)
{
    tl_status st = TL_OK;
    size_t n = j->mesh->vert_count;
    const tl_segment *s = &j->segment;
    tli_product *p = j->product;
    int16_t *steps = tl_mem_alloc(j->ctx, n, sizeof *steps, &st);
    float *surface = tl_mem_alloc(j->ctx, n, sizeof *surface, &st);
    uint8_t *twins = tl_mem_alloc(j->ctx, n, sizeof *twins, &st);
    uint8_t *outside = tl_mem_alloc(j->ctx, n, sizeof *outside, &st);
    j->part = tl_mem_alloc(j->ctx, j->mesh->tet_count, sizeof *j->part, &st);
    j->tet_local = tl_mem_alloc(j->ctx, j->mesh->tet_count, sizeof *j->tet_local, &st);
    if (!st) st = tli_finest_steps(j->ctx, j->finest, s, steps);
    if (!st) st = tli_marks_read(j->ctx, j->finest, &j->finest->twins, s, twins);
    for (size_t v = 0; !st && v < n; v++) {
        surface[v] = nextafterf((float)j->plan->position_error, INFINITY);
        outside[v] = TL_LINK_SLOT(s->links[v]) != 0;
    }
    if (!st)
        st = tli_split(j->ctx, j->mesh->xyz, j->mesh->tets, j->mesh->tet_count,
                       j->plan->opts.patch_tets, j->part, &p->patch_count);
    p->patches = tl_mem_zalloc(j->ctx, p->patch_count, sizeof *p->patches, &st);
    if (st) p->patch_count = 0;
    tli_cut cut = {.mesh = j->mesh,
                   .ids = s->vert_ids,
                   .steps = steps,
                   .surface = surface,
                   .twins = twins,
                   .outside = outside,
                   .outer = j->outer,
                   .part = j->part,
                   .part_count = p->patch_count,
                   .tet_local = j->tet_local};
    if (!st) st = tli_cut_write(j->ctx, j->finest->model, &cut, p->patches, &p->shared);
    tl_mem_free(j->ctx, outside);
    tl_mem_free(j->ctx, twins);
    tl_mem_free(j->ctx, surface);
    tl_mem_free(j->ctx, steps);
    return st;
}

/* Faces of the segment, and which of them are boundary of the whole. */
static tl_status match_faces(job *j)
{
    tl_status st = TL_OK;
    const tl_segment *s = &j->segment;
    j->opposite = tl_mem_alloc(j->ctx, s->tet_count, 4 * sizeof *j->opposite, &st);
    j->outer = tl_mem_zalloc(j->ctx, s->tet_count, 1, &st);
    for (size_t t = 0; !st && t < s->tet_count; t++) {
        const uint16_t *q = s->tets + 4 * t;
        bool faceless = q[0] == q[1] || q[0] == q[2] || q[0] == q[3] || q[1] == q[2] ||
                        q[1] == q[3] || q[2] == q[3];
        for (size_t f = 0; f < 4; f++) {
            uint32_t o = s->opposites[4 * t + f];
            bool here = o != TL_OPPOSITE_NONE && o >> 18 == 0;
            j->opposite[4 * t + f] = here ? o : TL_NONE;
            if (o == TL_OPPOSITE_NONE && !faceless) j->outer[t] |= (uint8_t)(1u << f);
        }
    }
    return st;
}

/* ---- originals ---- */

/* A vertex that is found at the place of another one, as in a flat tet, is measured at itself in a
 * tet that has it: the other one may have any values. */
static void leave_twin(const job *j, size_t vert, tl_lidx *tet, double w[4], double *distance)
{
    const double *place = j->mesh->xyz + 3 * vert, *x = j->segment.xyz + 3 * vert;
    bool twin = false;
    for (size_t i = 0; i < 4; i++) {
        tl_lidx other = j->mesh->tets[4 * (size_t)*tet + i];
        twin = twin || (w[i] > 0 && other != vert &&
                        memcmp(j->mesh->xyz + 3 * (size_t)other, place, 3 * sizeof *place) == 0);
    }
    if (!twin) return;
    double d2 = 0;
    for (int k = 0; k < 3; k++) d2 += (place[k] - x[k]) * (place[k] - x[k]);
    *distance = sqrt(d2);
    *tet = j->tet_of[vert];
    for (size_t i = 0; i < 4; i++) w[i] = j->mesh->tets[4 * (size_t)*tet + i] == vert;
}

/* A vertex is carried by the segment that is its home. */
static tl_status carry(job *j, int kind)
{
    tl_status st = TL_OK;
    const tl_segment *s = &j->segment;
    tli_model *model = j->finest->model;
    bool is_point = kind == TLI_POINTS;
    size_t count = is_point ? s->vert_count : s->tet_count;
    tli_carrier carrier = {.ctx = j->ctx,
                           .plan = j->plan,
                           .mesh = j->mesh,
                           .opposite = j->opposite,
                           .errors = &j->product->errors};
    tli_dealer dealer = {0};
    if (!is_point && !j->plan->tet_comps) return TL_OK;
    double *record = tl_mem_alloc(j->ctx, tli_record_doubles(j->plan, kind), sizeof *record, &st);
    if (!st)
        st = tli_dealer_open(j->ctx, model, model->carried[0], j->product->patches,
                             j->product->patch_count, kind, &dealer);
    for (size_t i = 0; !st && i < count; i++) {
        double w[4], distance;
        tl_lidx tet = is_point ? j->tet_of[i] : (tl_lidx)i;
        if (is_point && (s->links[i] & TL_LINK_COPY)) continue;
        if (tet == TL_NONE) continue;
        tli_record_fill(j->plan, s, kind, i, j->stars, record);
        if (!isfinite(record[0] + record[1] + record[2])) continue;
        st = tli_carrier_locate(&carrier, record, tet, &tet, w, &distance);
        if (st) break;
        if (is_point) leave_twin(j, i, &tet, w, &distance);
        /* outside it goes with its own vertex: what is nearest may be the other side of a gap */
        tl_lidx holder = is_point && distance > 0 ? j->tet_of[i] : tet;
        uint32_t part = j->part[holder];
        tli_carrier_measure(&carrier, kind, record, tet, w, distance,
                            j->product->patches[part].squares);
        st = tli_dealer_add(&dealer, part, record, j->tet_local[holder]);
        j->carried[kind]++;
    }
    st = tli_dealer_close(&dealer, st);
    tl_locator_destroy(carrier.locator);
    tl_mem_free(j->ctx, record);
    return st;
}

/* The triangles of the original boundary, and how far the mesh's own is from them: a point of a
 * triangle moves no farther than the corners do. */
static tl_status carry_boundary(job *j)
{
    const tl_segment *s = &j->segment;
    tli_model *model = j->finest->model;
    tli_dealer dealer = {0};
    double farthest = 0;
    tl_status st = tli_dealer_open(j->ctx, model, model->carried[0], j->product->patches,
                                   j->product->patch_count, TLI_FACES, &dealer);
    for (size_t t = 0; !st && t < s->tet_count; t++)
        for (unsigned f = 0; !st && j->outer[t] && f < 4; f++) {
            double record[TLI_FACE_DOUBLES] = {0};
            if (!(j->outer[t] >> f & 1)) continue;
            for (size_t i = 0; i < 3; i++) {
                size_t v = s->tets[4 * t + tli_tet_faces[f][i]];
                double d2 = 0;
                memcpy(record + 3 * i, s->xyz + 3 * v, 3 * sizeof *record);
                for (size_t k = 0; k < 3; k++) {
                    double d = j->mesh->xyz[3 * v + k] - s->xyz[3 * v + k];
                    d2 += d * d;
                }
                farthest = fmax(farthest, sqrt(d2));
            }
            st = tli_dealer_add(&dealer, j->part[t], record, 0);
        }
    j->product->errors.surface = fmax(j->product->errors.surface, farthest);
    return tli_dealer_close(&dealer, st);
}

/* ---- all segments ---- */

static tl_status process(tl_ctx *ctx, tli_finest *f, uint32_t segment, tli_product *product,
                         uint64_t carried[TLI_KINDS])
{
    job j = {
        .ctx = ctx, .finest = f, .plan = f->model->plan, .product = product, .carried = carried};
    *product = (tli_product){0};
    tl_status st = tl_segments_load(ctx, f->segments, segment, &j.segment);
    if (st) return st;
    st = tli_errors_create(ctx, j.plan, &product->errors);
    if (!st) st = make_mesh(ctx, f, &j.segment, &j.mesh);
    if (!st) st = match_faces(&j);
    if (!st) st = write_patches(&j);
    if (!st) st = tli_seam_put(ctx, f->model->seam_files[0], &product->shared, &product->seam);
    j.tet_of = tl_mem_alloc(ctx, j.segment.vert_count, sizeof *j.tet_of, &st);
    for (size_t v = 0; !st && v < j.segment.vert_count; v++) j.tet_of[v] = TL_NONE;
    for (size_t i = 0; !st && i < 4 * (size_t)j.segment.tet_count; i++)
        j.tet_of[j.segment.tets[i]] = (tl_lidx)(i / 4);
    if (!st) st = tli_stars_create(ctx, &f->stars, &j.segment, &j.stars);
    for (int kind = 0; !st && kind <= TLI_CELLS; kind++) st = carry(&j, kind);
    if (!st) st = carry_boundary(&j);
    void *blocks[] = {j.stars, j.part, j.tet_local, j.tet_of, j.opposite, j.outer};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) tl_mem_free(ctx, blocks[i]);
    tl_mesh_destroy(j.mesh);
    tl_segment_release(ctx, &j.segment);
    if (st) tli_product_release(ctx, product);
    return st;
}

typedef struct all_job {
    tli_finest *finest;
    tli_product *products;          /* [count] */
    uint64_t (*carried)[TLI_KINDS]; /* [count] */
} all_job;

static tl_status process_range(void *arg, size_t begin, size_t end, unsigned worker)
{
    all_job *a = arg;
    tl_ctx *ctx = NULL, *root = a->finest->model->ctx;
    tl_status st = tli_ctx_fork(root, &ctx);
    (void)worker;
    for (size_t i = begin; !st && i < end; i++)
        st = process(ctx, a->finest, (uint32_t)i, &a->products[i], a->carried[i]);
    return tli_ctx_join(root, ctx, st);
}

/* Takes over the patches of a segment. */
static tl_status note(tli_model *m, tli_plan *plan, tli_product *p)
{
    size_t first;
    tl_status st = tli_model_add_patches(m, p->patch_count, &first);
    if (!st) st = tli_seams_add(m->ctx, &m->seams, p->seam, first);
    if (st) return st;
    for (size_t i = 0; i < p->patch_count; i++) {
        m->patches[first + i] = p->patches[i];
        m->patches[first + i].producer = m->patches[first + i].consumer = TL_NONE;
        m->patches[first + i].cell = TL_NONE;
    }
    for (size_t i = 0; i < plan->field_count; i++)
        plan->fields[i].leaf_error = fmax(plan->fields[i].leaf_error, p->errors.max[i]);
    m->finest_surface = fmax(m->finest_surface, p->errors.surface);
    p->patch_count = 0; /* what hangs on the patches went along */
    tli_product_release(m->ctx, p);
    return TL_OK;
}

tl_status tli_model_begin(tli_model *model, tli_plan *plan, const tl_segments *segments)
{
    tli_finest f = {.model = model, .segments = segments};
    size_t count = tl_segments_count(segments);
    all_job all = {.finest = &f};
    tl_status st = tli_finest_agree(&f, plan);
    if (!st) st = tli_stars_open(model->ctx, plan, segments, &f.stars);
    all.products = tl_mem_zalloc(model->ctx, count, sizeof *all.products, &st);
    all.carried = tl_mem_zalloc(model->ctx, count, sizeof *all.carried, &st);
    if (!st) st = tli_turns(model->ctx, "finest", count, plan->at_once, process_range, &all);
    for (size_t i = 0; !st && i < count; i++) {
        model->point_count += all.carried[i][TLI_POINTS];
        model->cell_count += all.carried[i][TLI_CELLS];
        st = note(model, plan, &all.products[i]);
    }
    for (size_t i = 0; all.products && i < count; i++)
        tli_product_release(model->ctx, &all.products[i]);
    tl_mem_free(model->ctx, all.carried);
    tl_mem_free(model->ctx, all.products);
    tli_finest_release(&f);
    return st;
}
