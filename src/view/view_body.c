/* Bodies: a mesh, and what is computed of it once, however often the scene around it changes:
 * scalars, gradients, neighbours, the volume for rays, edges. */
#include "view/view.h"

#include <math.h>
#include <stdio.h>

#include "extract/extract_edges.h"

/* Number of the one part of the edges. */
enum { PART = 0 };

/* ---- life ---- */

void tli_mesh_box(const tl_mesh *mesh, double b[6], double *diagonal)
{
    const double *xyz = tl_mesh_xyz(mesh);
    bool any = false;
    for (int i = 0; i < 6; i++) b[i] = 0;
    for (size_t v = 0; v < tl_mesh_vert_count(mesh); v++) {
        const double *p = xyz + 3 * v;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) continue;
        for (int k = 0; k < 3; k++) {
            if (!any || p[k] < b[2 * k]) b[2 * k] = p[k];
            if (!any || p[k] > b[2 * k + 1]) b[2 * k + 1] = p[k];
        }
        any = true;
    }
    *diagonal = sqrt((b[1] - b[0]) * (b[1] - b[0]) + (b[3] - b[2]) * (b[3] - b[2]) +
                     (b[5] - b[4]) * (b[5] - b[4]));
}

tl_status tli_body_create(tl_ctx *ctx, tl_mesh *mesh, tli_recipe recipe, tli_body **body)
{
    tl_status st = TL_OK;
    tli_body *b = tl_mem_zalloc(ctx, 1, sizeof *b, &st);
    if (!st) st = tli_lock_create(ctx, &b->locating);
    *body = NULL;
    if (st) {
        tl_mem_free(ctx, b);
        return st;
    }
    b->ctx = ctx;
    b->mesh = mesh;
    b->recipe = recipe;
    atomic_init(&b->uses, 1);
    tli_mesh_box(mesh, b->bounds, &b->diagonal);
    *body = b;
    return TL_OK;
}

static void release_channel(tl_ctx *ctx, tl_channel *channel)
{
    tli_free_const(ctx, channel->name);
    tli_free_const(ctx, channel->unit);
    tli_free_const(ctx, channel->values);
}

/* Frees a mesh that borrows the arrays of another one: what came on top of them. */
static void release_borrowed(tl_mesh *mesh, const tl_mesh *base)
{
    for (size_t c = base->channel_count; c < mesh->channel_count; c++)
        release_channel(mesh->ctx, &mesh->channels[c]);
    tl_mem_free(mesh->ctx, mesh->channels);
    tl_mem_free(mesh->ctx, mesh);
}

tl_status tli_body_borrow(tl_ctx *ctx, tli_body *base, tli_recipe recipe, tli_body **body)
{
    tl_status st = TL_OK;
    const size_t count = base->mesh->channel_count;
    tli_body *b = tl_mem_zalloc(ctx, 1, sizeof *b, &st);
    tl_mesh *mesh = tl_mem_alloc(ctx, 1, sizeof *mesh, &st);
    tl_channel *channels = tl_mem_alloc(ctx, count + 1, sizeof *channels, &st);
    *body = NULL;
    if (st) {
        tl_mem_free(ctx, mesh);
        tl_mem_free(ctx, b);
        return st;
    }
    if (count) memcpy(channels, base->mesh->channels, count * sizeof *channels);
    *mesh = *base->mesh;
    mesh->ctx = ctx;
    mesh->channels = channels;
    b->ctx = ctx;
    b->mesh = mesh;
    b->base = tli_body_use(base);
    b->recipe = recipe;
    atomic_init(&b->uses, 1);
    memcpy(b->bounds, base->bounds, sizeof b->bounds);
    b->diagonal = base->diagonal;
    b->spots = base->spots;
    b->spot_count = base->spot_count;
    *body = b;
    return TL_OK;
}

tli_body *tli_body_use(tli_body *body)
{
    atomic_fetch_add(&body->uses, 1);
    return body;
}

static void release_scalar(tl_ctx *ctx, tli_scalar *scalar)
{
    if (!scalar) return;
    tl_mem_free(ctx, scalar->spread);
    tl_mem_free(ctx, scalar->gradients);
    tl_mem_free(ctx, scalar->own);
    tl_mem_free(ctx, scalar);
}

void tli_body_release(tli_body *body)
{
    if (!body || atomic_fetch_sub(&body->uses, 1) > 1) return;
    tl_ctx *ctx = body->ctx;
    tl_edges_destroy(ctx, body->edges);
    tl_volume_destroy(ctx, body->volume);
    tl_mem_free(ctx, body->opposite);
    for (size_t i = 0; i < body->scalar_count; i++) release_scalar(ctx, body->scalars[i]);
    tl_mem_free(ctx, body->scalars);
    for (size_t i = 0; i < body->formula_count; i++) {
        release_channel(ctx, body->formulas[i]);
        tl_mem_free(ctx, body->formulas[i]);
    }
    tl_mem_free(ctx, body->formulas);
    tl_mem_free(ctx, body->run_errors);
    tl_mem_free(ctx, body->runs);
    tl_locator_destroy(body->locator);
    if (!body->base || body->base->spots != body->spots) tl_mem_free(ctx, body->spots);
    if (!body->base) tli_lock_destroy(&body->locating);
    if (body->base)
        release_borrowed(body->mesh, body->base->mesh);
    else
        tl_mesh_destroy(body->mesh);
    tli_body_release(body->base);
    tl_mem_free(ctx, body);
}

/* ---- channels ---- */

tl_status tli_unknown_channel(tl_ctx *ctx, const tl_mesh *mesh, const char *name)
{
    char list[2048] = "";
    size_t at = 0;
    for (size_t i = 0; i < tl_mesh_channel_count(mesh) && at < sizeof list; i++) {
        const tl_channel *channel = tl_mesh_channel(mesh, i);
        if (strcmp(channel->name, TLI_MARKS) == 0) continue;
        const int n = snprintf(list + at, sizeof list - at, " '%s'%s", channel->name,
                               channel->on == TL_ON_TET ? " (on tets)" : "");
        at += n > 0 ? (size_t)n : 0;
    }
    tl_fail(ctx, TL_ERR_ARG, "there is no channel '%s'", name);
    return tl_note(ctx, TL_ERR_ARG, "channels:%s", *list ? list : " none");
}

/* The values of an expression as a channel of its name. */
static tl_status evaluate(tl_ctx *ctx, const tli_body *body, const char *text, tl_channel *channel)
{
    tl_status st = TL_OK;
    tl_expression *expression = NULL;
    *channel = (tl_channel){.name = NULL};
    st = tl_expression_parse(ctx, text, &expression);
    if (!st) st = tl_expression_evaluate(ctx, expression, body->mesh, channel);
    tl_expression_destroy(ctx, expression);
    if (st) return st;
    channel->name = tli_strdup(ctx, text, &st);
    channel->unit = tli_strdup(ctx, "", &st);
    if (st) release_channel(ctx, channel);
    return st;
}

tl_status tli_body_channel(tl_ctx *ctx, tli_body *body, const char *name,
                           const tl_channel **channel)
{
    tl_status st = TL_OK;
    *channel = tl_mesh_channel_by_name(body->mesh, name);
    for (size_t i = 0; !*channel && i < body->formula_count; i++)
        if (strcmp(body->formulas[i]->name, name) == 0) *channel = body->formulas[i];
    if (*channel) return TL_OK;
    tl_channel *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    body->formulas =
        tl_mem_resize(ctx, body->formulas, body->formula_count + 1, sizeof *body->formulas, &st);
    if (!st) st = evaluate(ctx, body, name, made);
    if (st) {
        tl_mem_free(ctx, made);
        return st == TL_ERR_ARG ? tli_unknown_channel(ctx, body->mesh, name) : st;
    }
    *channel = body->formulas[body->formula_count++] = made;
    return TL_OK;
}

double tli_length_at(const tl_channel *channel, size_t i)
{
    const double *v = channel->values + i * channel->components;
    double scale = 0, sum = 0;
    if (channel->components == 1) return v[0];
    for (uint32_t k = 0; k < channel->components; k++) scale = fmax(scale, fabs(v[k]));
    if (!(scale > 0) || !isfinite(scale)) return scale;
    for (uint32_t k = 0; k < channel->components; k++) sum += v[k] / scale * (v[k] / scale);
    return scale * sqrt(sum);
}

bool tli_extremes(const tl_mesh *mesh, const tl_channel *channel, bool logarithmic, double range[2])
{
    const size_t count =
        channel->on == TL_ON_VERTEX ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh);
    range[0] = (double)INFINITY;
    range[1] = -(double)INFINITY;
    for (size_t i = 0; i < count; i++) {
        const double value = tli_length_at(channel, i);
        if (!isfinite(value) || (logarithmic && !(value > 0))) continue;
        range[0] = fmin(range[0], value);
        range[1] = fmax(range[1], value);
    }
    const bool any = range[0] <= range[1];
    if (!any) range[0] = range[1] = logarithmic ? 1 : 0;
    return any;
}

double tli_volume_at(const tl_mesh *mesh, size_t tet)
{
    double p[4][3];
    const tl_lidx *corners = tl_mesh_tets(mesh) + 4 * tet;
    for (size_t i = 0; i < 4; i++)
        memcpy(p[i], tl_mesh_xyz(mesh) + 3 * (size_t)corners[i], sizeof p[i]);
    const double volume = fabs(tl_tet_volume(TLI_CORNERS(p)));
    return isfinite(volume) ? volume : 0;
}

/* Means of the tets around each vertex, by volume. */
static tl_status mean_of_tets(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                              double *scalar)
{
    tl_status st = TL_OK;
    const size_t count = tl_mesh_vert_count(mesh);
    double *weights = tl_mem_zalloc(ctx, count, sizeof *weights, &st);
    if (st) return st;
    memset(scalar, 0, count * sizeof *scalar);
    for (size_t t = 0; t < tl_mesh_tet_count(mesh); t++) {
        const double volume = tli_volume_at(mesh, t), value = tli_length_at(channel, t);
        for (size_t i = 0; i < 4; i++) {
            const size_t v = tl_mesh_tets(mesh)[4 * t + i];
            /* a running mean: sums of large values do not overflow */
            weights[v] += volume;
            if (weights[v] > 0) scalar[v] += (value - scalar[v]) * (volume / weights[v]);
        }
    }
    for (size_t v = 0; v < count; v++)
        if (!(weights[v] > 0)) scalar[v] = (double)NAN;
    tl_mem_free(ctx, weights);
    return TL_OK;
}

double tli_shown(bool logarithmic, double factor, double value)
{
    if (!logarithmic) return factor * value;
    return value > 0 ? log10(value) : (double)NAN;
}

/* scalar->on: vertices, or what the channel is on. */
static tl_status fill_scalar(tl_ctx *ctx, const tl_mesh *mesh, const tl_channel *channel,
                             bool logarithmic, double factor, tli_scalar *scalar)
{
    tl_status st = TL_OK;
    const bool as_is = channel->on == scalar->on;
    const size_t count =
        scalar->on == TL_ON_VERTEX ? tl_mesh_vert_count(mesh) : tl_mesh_tet_count(mesh);
    if (channel->components == 1 && as_is && !logarithmic && factor == 1) {
        scalar->values = channel->values;
        return TL_OK;
    }
    double *own = scalar->own = tl_mem_alloc(ctx, count, sizeof *own, &st);
    if (!st && !as_is) st = mean_of_tets(ctx, mesh, channel, own);
    for (size_t i = 0; !st && i < count; i++)
        own[i] = tli_shown(logarithmic, factor, as_is ? tli_length_at(channel, i) : own[i]);
    scalar->values = own;
    return st;
}

static tl_status get_scalar(tl_ctx *ctx, tli_body *body, const tl_channel *channel, tl_on on,
                            bool logarithmic, double factor, tli_scalar **scalar)
{
    tl_status st = TL_OK;
    tli_recipe recipe = tli_recipe_count(tli_recipe_text(0, channel->name), logarithmic);
    recipe = tli_recipe_count(tli_recipe_real(recipe, factor), on);
    for (size_t i = 0; i < body->scalar_count; i++)
        if (body->scalars[i]->recipe == recipe) *scalar = body->scalars[i];
    if (*scalar) return TL_OK;
    tli_scalar *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    made->recipe = recipe;
    made->on = on;
    st = fill_scalar(ctx, body->mesh, channel, logarithmic, factor, made);
    if (!st)
        body->scalars =
            tl_mem_resize(ctx, body->scalars, body->scalar_count + 1, sizeof *body->scalars, &st);
    if (st) {
        release_scalar(ctx, made);
        return st;
    }
    *scalar = body->scalars[body->scalar_count++] = made;
    return TL_OK;
}

tl_status tli_body_scalar(tl_ctx *ctx, tli_body *body, const char *name, bool logarithmic,
                          double factor, tli_scalar **scalar)
{
    const tl_channel *channel;
    *scalar = NULL;
    tl_status st = tli_body_channel(ctx, body, name, &channel);
    return st ? st : get_scalar(ctx, body, channel, TL_ON_VERTEX, logarithmic, factor, scalar);
}

tl_status tli_body_plain(tl_ctx *ctx, tli_body *body, const char *name, bool logarithmic,
                         double factor, tli_scalar **scalar)
{
    const tl_channel *channel;
    *scalar = NULL;
    tl_status st = tli_body_channel(ctx, body, name, &channel);
    return st ? st : get_scalar(ctx, body, channel, channel->on, logarithmic, factor, scalar);
}

tl_status tli_body_gradients(tl_ctx *ctx, tli_body *body, tli_scalar *scalar)
{
    tl_status st = TL_OK;
    const tl_channel channel = {
        .name = "scalar", .components = 1, .scalar = TL_F64, .values = scalar->values};
    if (scalar->gradients) return TL_OK;
    double *made = tl_mem_alloc(ctx, tl_mesh_vert_count(body->mesh), 3 * sizeof *made, &st);
    if (!st) st = tl_mesh_gradient(ctx, body->mesh, &channel, made);
    if (st)
        tl_mem_free(ctx, made);
    else
        scalar->gradients = made;
    return st;
}

void tli_body_dress(const tli_body *body, const tli_scalar *scalar, tli_dressed *dressed)
{
    *dressed = (tli_dressed){.mesh = *body->mesh};
    dressed->channel = (tl_channel){.name = "shown",
                                    .unit = "",
                                    .components = 1,
                                    .on = scalar ? scalar->on : TL_ON_VERTEX,
                                    .scalar = TL_F64,
                                    .values = scalar ? scalar->values : NULL};
    dressed->mesh.channels = &dressed->channel;
    dressed->mesh.channel_count = scalar ? 1 : 0;
}

/* ---- neighbours, rays, edges ---- */

tl_status tli_body_opposite(tl_ctx *ctx, tli_body *body, const tl_lidx **opposite)
{
    tl_status st = TL_OK;
    if (!body->opposite) st = tl_mesh_adjacency(ctx, body->mesh, &body->opposite, NULL);
    *opposite = body->opposite;
    return st;
}

tl_status tli_body_volume(tl_ctx *ctx, tli_body *body, const tl_volume **volume)
{
    tl_status st = TL_OK;
    const tl_lidx *opposite;
    if (!body->volume) {
        st = tli_body_opposite(ctx, body, &opposite);
        if (!st) st = tl_volume_create(ctx, body->mesh, opposite, &body->volume);
    }
    *volume = body->volume;
    return st;
}

tl_status tli_body_edges(tl_ctx *ctx, tli_body *body)
{
    tl_edges *edges = NULL;
    const tl_lidx *opposite;
    if (body->edges) return TL_OK;
    tl_status st = tli_body_opposite(ctx, body, &opposite);
    if (!st) st = tl_edges_create(ctx, &edges);
    if (!st) st = tl_edges_add_mesh(ctx, edges, PART, body->mesh, opposite);
    if (!st) st = tli_edges_join(ctx, edges);
    if (st)
        tl_edges_destroy(ctx, edges);
    else
        body->edges = edges;
    return st;
}
