/* What a model will be made like: its channels, their lattices, the scale of costs. */
#include <math.h>
#include <string.h>

#include "model/model.h"

/* Sizes that did best by measurement: docs/notes/2026-11-22-model.md */
enum { SEGMENT_TETS = 65536, PATCH_TETS = 4096 };
/* Vectors whose lengths differ by less than this part of the widest range of a component count as
 * equally long. */
static const double EQUAL_LENGTHS = 1e-3;

tl_build_opts tl_build_opts_defaults(void)
{
    return (tl_build_opts){.struct_bytes = sizeof(tl_build_opts),
                           .channel_error = 1e-4,
                           .position_error = 1e-5,
                           .boundary_error = 0.05,
                           .reduction = 0.5};
}

static tl_status check_opts(tl_ctx *ctx, const tl_build_opts *o)
{
    if (!(o->channel_error >= 0) || !isfinite(o->channel_error))
        return tl_fail(ctx, TL_ERR_ARG, "channel error %g, expected 0 or more", o->channel_error);
    if (!(o->position_error > 0) || !(o->position_error < 1))
        return tl_fail(ctx, TL_ERR_ARG, "position error %g, expected more than 0 and below 1",
                       o->position_error);
    if (!(o->boundary_error >= 0) || !isfinite(o->boundary_error))
        return tl_fail(ctx, TL_ERR_ARG, "boundary error %g, expected 0 or more", o->boundary_error);
    if (!(o->reduction >= 0.25 && o->reduction <= 0.75))
        return tl_fail(ctx, TL_ERR_ARG, "reduction %g, expected 0.25 to 0.75", o->reduction);
    return TL_OK;
}

static void set_bounds(const tl_mesh *mesh, tli_plan *p)
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        p->bounds[2 * k] = (double)INFINITY;
        p->bounds[2 * k + 1] = (double)-INFINITY;
    }
    for (size_t v = 0; v < mesh->vert_count; v++) {
        const double *x = mesh->xyz + 3 * v;
        if (!isfinite(x[0] + x[1] + x[2])) continue;
        for (int k = 0; k < 3; k++) {
            p->bounds[2 * k] = fmin(p->bounds[2 * k], x[k]);
            p->bounds[2 * k + 1] = fmax(p->bounds[2 * k + 1], x[k]);
        }
    }
    for (int k = 0; k < 3; k++) {
        if (p->bounds[2 * k] > p->bounds[2 * k + 1]) p->bounds[2 * k] = p->bounds[2 * k + 1] = 0;
        double side = p->bounds[2 * k + 1] - p->bounds[2 * k];
        square += side * side;
    }
    p->diagonal = sqrt(square);
}

static double channel_width(const tl_channel *c, size_t count, const double range[2])
{
    double widest = 0, width = range[1] - range[0];
    for (uint32_t k = 0; c->components > 1 && k < c->components; k++) {
        double lo = (double)INFINITY, hi = (double)-INFINITY;
        for (size_t v = 0; v < count; v++) {
            double value = c->values[v * c->components + k];
            if (!isfinite(value)) continue;
            lo = fmin(lo, value);
            hi = fmax(hi, value);
        }
        if (hi - lo > widest) widest = hi - lo;
    }
    return width > EQUAL_LENGTHS * widest ? width : widest;
}

/* The bound of the codec; 0: lossless. */
static double codec_bound(const tl_build_opts *o, const tli_field *f)
{
    if (o->lossless) return 0;
    for (size_t i = 0; i < o->error_count; i++) {
        const tl_build_channel *c = &o->errors[i];
        if (strcmp(c->name, f->name) != 0) continue;
        if (c->lossless) return 0;
        return c->relative ? c->error * f->width : c->error;
    }
    return o->channel_error * f->width;
}

/* Half of the bound is left for what moving the vertices to their lattice adds. */
static void set_code(tli_field *f)
{
    double step = f->bound / sqrt(f->components);
    f->code = (tl_value_code){TL_VALUE_LATTICE, step};
    double largest = fmax(fabs(f->range[0]), fabs(f->range[1]));
    bool fits = step > 0 && largest / step < 0x1p52;
    if (fits) return;
    f->code.kind = f->scalar < TL_F32    ? TL_VALUE_INTEGER
                   : f->scalar == TL_F32 ? TL_VALUE_FLOAT32
                                         : TL_VALUE_FLOAT64;
    f->code.step = 1;
}

static tl_status set_field(tli_plan *p, const tl_mesh *mesh, const tl_channel *c, tli_field *f)
{
    size_t count = c->on == TL_ON_VERTEX ? mesh->vert_count : mesh->tet_count;
    size_t *comps = c->on == TL_ON_VERTEX ? &p->vert_comps : &p->tet_comps;
    tl_status st = TL_OK;
    *f =
        (tli_field){.components = c->components, .on = c->on, .scalar = c->scalar, .first = *comps};
    f->name = tli_strdup(p->ctx, c->name, &st);
    f->unit = tli_strdup(p->ctx, c->unit ? c->unit : "", &st);
    if (st) return st;
    *comps += c->components;
    size_t nonfinite = 0;
    tl_channel_range(c, count, f->range, &nonfinite);
    f->nonfinite_count = nonfinite;
    f->width = channel_width(c, count, f->range);
    f->bound = codec_bound(&p->opts, f);
    set_code(f);
    f->scale = f->width > 0 && isfinite(1 / f->width) ? 1 / f->width : 0;
    return TL_OK;
}

static bool is_wanted(const tl_build_opts *o, const char *name)
{
    for (size_t i = 0; i < o->channel_count; i++)
        if (strcmp(o->channels[i], name) == 0) return true;
    return !o->channels;
}

static tl_status set_fields(tli_plan *p, const tl_mesh *mesh, size_t **channels)
{
    tl_status st = TL_OK;
    size_t count = tl_mesh_channel_count(mesh);
    for (size_t i = 0; i < p->opts.channel_count; i++)
        if (!tl_mesh_channel_by_name(mesh, p->opts.channels[i]))
            return tl_fail(p->ctx, TL_ERR_DATA, "the mesh has no channel '%s'",
                           p->opts.channels[i]);
    *channels = tl_mem_alloc(p->ctx, count, sizeof **channels, &st);
    p->fields = tl_mem_zalloc(p->ctx, count, sizeof *p->fields, &st);
    p->steering = tl_mem_zalloc(p->ctx, count, sizeof *p->steering, &st);
    p->steering_scales = tl_mem_zalloc(p->ctx, count, sizeof *p->steering_scales, &st);
    for (size_t i = 0; !st && i < count; i++) {
        const tl_channel *c = tl_mesh_channel(mesh, i);
        if (!is_wanted(&p->opts, c->name)) continue;
        (*channels)[p->field_count] = i;
        tli_field *f = &p->fields[p->field_count++];
        st = set_field(p, mesh, c, f);
        if (st || c->on != TL_ON_VERTEX) continue;
        p->steering[p->steering_count] = (tl_simplify_channel){f->name, 1, 0};
        p->steering_scales[p->steering_count++] = f->scale;
    }
    return st;
}

tl_status tli_plan_create(tl_ctx *ctx, const tl_mesh *mesh, const tl_build_opts *opts, tli_plan *p,
                          size_t **channels)
{
    *channels = NULL;
    *p = (tli_plan){.ctx = ctx, .opts = tl_build_opts_defaults()};
    tl_status st = tli_opts_take(ctx, "tl_build_opts", opts, &p->opts, sizeof p->opts);
    if (!st) st = check_opts(ctx, &p->opts);
    if (!st && tl_mesh_tet_count(mesh) == 0) st = tl_fail(ctx, TL_ERR_DATA, "the mesh has no tets");
    if (!st) st = set_fields(p, mesh, channels);
    if (st) {
        tl_mem_free(ctx, *channels);
        *channels = NULL;
        tli_plan_release(p);
        return st;
    }
    if (!p->opts.segment_tets) p->opts.segment_tets = SEGMENT_TETS;
    if (!p->opts.patch_tets) p->opts.patch_tets = PATCH_TETS;
    p->quadric_floats = tli_piece_quadric_floats(p->vert_comps);
    p->has_regions = tl_mesh_regions(mesh) != NULL;
    set_bounds(mesh, p);
    p->boundary_error = p->opts.boundary_error * p->diagonal;
    return TL_OK;
}

void tli_plan_release(tli_plan *p)
{
    for (size_t i = 0; p->fields && i < p->field_count; i++) {
        tl_mem_free(p->ctx, (char *)(uintptr_t)p->fields[i].name);
        tl_mem_free(p->ctx, (char *)(uintptr_t)p->fields[i].unit);
    }
    tl_mem_free(p->ctx, p->steering_scales);
    tl_mem_free(p->ctx, p->steering);
    tl_mem_free(p->ctx, p->fields);
    p->fields = NULL;
}

double tli_field_round(const tli_field *f, double value)
{
    return tl_value_of(&f->code, tl_value_image(&f->code, value));
}
