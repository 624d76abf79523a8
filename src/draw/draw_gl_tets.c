/* Projected tetrahedra (Shirley and Tuchman 1990), far ones first. Each tet is drawn as its faces
 * that look away from the camera; what lies before them is worked out at each pixel, with the
 * integrals of the transfer function, so that it is right under perspective (Kraus, Qiao and Ebert
 * 2004) and no table of thicknesses is needed, whose steps would be seen (Sondershaus 2007,
 * chapter 7). Vertices are placed on the processor in double precision, as for rays: fine layers
 * far from the origin survive. */
#include "draw/draw_gl.h"
#include "draw/draw_order.h"
#include "draw/draw_shaders.h"
#include "mesh/mesh.h"

/* Tets of a call, whose indices are the same for each. */
enum { BATCH = 1 << 16, TET_INDICES = 12 };

static tl_status make_corners(tl_ctx *ctx, tli_gl *gl, GLuint *buffer)
{
    tl_status st = TL_OK;
    uint32_t *indices = tl_mem_alloc(ctx, (size_t)BATCH * TET_INDICES, sizeof *indices, &st);
    if (st) return st;
    for (uint32_t t = 0; t < BATCH; t++)
        for (uint32_t i = 0; i < TET_INDICES; i++)
            indices[t * TET_INDICES + i] = 4 * t + tli_tet_faces[i / 3][i % 3];
    glGenBuffers(1, buffer);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, *buffer);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, BATCH * TET_INDICES * (GLsizeiptr)sizeof *indices,
                 indices, GL_STATIC_DRAW);
    gl->bytes += BATCH * TET_INDICES * sizeof *indices;
    tl_mem_free(ctx, indices);
    return TL_OK;
}

tl_status tli_gl_projector_open(tl_ctx *ctx, tli_gl *gl, tli_gl_projector *projector)
{
    *projector = (tli_gl_projector){0};
    const tli_gl_source source = {"tets", tli_shader_tets_vert, "", tli_shader_tets_frag};
    tl_status st = tli_gl_program(ctx, gl, &source, &projector->program);
    if (!st) st = make_corners(ctx, gl, &projector->corners);
    return st;
}

void tli_gl_projector_close(tli_gl *gl, tli_gl_projector *projector)
{
    if (projector->corners) gl->bytes -= BATCH * TET_INDICES * sizeof(uint32_t);
    glDeleteBuffers(1, &projector->corners);
    glDeleteProgram(projector->program);
    *projector = (tli_gl_projector){0};
}

static tl_status add_gradients(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_volume *added)
{
    tl_status st = TL_OK;
    size_t count = tli_volume_has_light(&item->volume_opts) ? item->volume->vert_count : 1;
    float(*gradients)[4] = tl_mem_zalloc(ctx, count, sizeof *gradients, &st);
    if (!st && tli_volume_has_light(&item->volume_opts))
        tli_volume_gradients(&item->volume_opts, count, gradients);
    if (!st) st = tli_gl_table_fill(ctx, gl, &added->gradients, GL_RGBA32F, gradients, count);
    tl_mem_free(ctx, gradients);
    return st;
}

tl_status tli_gl_volume_add(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_volume *added)
{
    const tl_transfer *t = item->transfer;
    *added = (tli_gl_volume){0};
    tl_status st = tli_gl_table_fill(ctx, gl, &added->tets, GL_RGBA32UI, item->volume->mesh->tets,
                                     item->volume->cell_count);
    if (!st)
        st = tli_gl_table_fill(ctx, gl, &added->sums, GL_RGBA32F, t->sums,
                               sizeof t->sums / sizeof *t->sums);
    if (!st)
        st = tli_gl_table_fill(ctx, gl, &added->bases, GL_RGBA32F, t->bases,
                               sizeof t->bases / sizeof *t->bases);
    if (!st) st = add_gradients(ctx, gl, item, added);
    if (st) tli_gl_volume_remove(gl, added);
    return st;
}

void tli_gl_volume_remove(tli_gl *gl, tli_gl_volume *volume)
{
    tli_gl_table_free(gl, &volume->tets);
    tli_gl_table_free(gl, &volume->sums);
    tli_gl_table_free(gl, &volume->bases);
    tli_gl_table_free(gl, &volume->gradients);
    tli_gl_table_free(gl, &volume->verts);
    tli_gl_table_free(gl, &volume->order);
    *volume = (tli_gl_volume){0};
}

/* ---- a view ---- */

tl_status tli_gl_volume_place(tl_ctx *ctx, tli_gl *gl, const tli_gl_view *view,
                              const tli_item *item, tli_gl_volume *volume)
{
    tl_status st = TL_OK;
    size_t vert_count = item->volume->vert_count;
    tli_order order = {0};
    tli_vert *verts = tl_mem_alloc(ctx, vert_count, sizeof *verts, &st);
    if (!st) st = tli_volume_place(ctx, item, view->frame, verts);
    tli_order_view seen = {item->volume, item->transfer, view->frame,
                           verts,        view->width,    view->height};
    if (!st)
        st = item->volume_opts.order == TL_ORDER_EXACT ? tli_order_exact(ctx, &seen, &order)
                                                       : tli_order_centroids(ctx, &seen, &order);
    if (!st) st = tli_gl_table_fill(ctx, gl, &volume->verts, GL_RGBA32F, verts, vert_count);
    if (!st) st = tli_gl_table_fill(ctx, gl, &volume->order, GL_R32UI, order.tets, order.count);
    volume->tet_count = order.count;
    if (order.broken)
        tl_log(ctx, TL_LOG_DEBUG, "%zu of %zu tets are out of order: they hide each other in rings",
               order.broken, order.count);
    tl_mem_free(ctx, order.tets);
    tl_mem_free(ctx, verts);
    return st;
}

static void set_light(GLuint program, const tl_volume_opts *o, const tli_frame *frame)
{
    float axes[9];
    for (int k = 0; k < 3; k++) {
        axes[k] = (float)frame->right[k];
        axes[3 + k] = (float)frame->up[k];
        axes[6 + k] = (float)frame->forward[k];
    }
    tli_gl_set_int(program, "has_light", tli_volume_has_light(o));
    tli_gl_set_int(program, "dims", o->gradient_opacity > 0);
    glUniformMatrix3fv(glGetUniformLocation(program, "axes"), 1, GL_FALSE, axes);
    glUniform4f(glGetUniformLocation(program, "light"), o->lit ? (float)o->ambient : 1,
                o->lit ? (float)o->diffuse : 0, o->lit ? (float)o->specular : 0,
                (float)o->shininess);
}

void tli_gl_volume_draw(const tli_gl_projector *projector, const tli_gl_view *view,
                        const tli_item *item, const tli_gl_volume *volume,
                        const tli_gl_target *target, GLuint near_depth, GLuint far_depth)
{
    GLuint program = projector->program;
    const tli_gl_table *const tables[] = {&volume->order, &volume->tets,  &volume->verts,
                                          &volume->sums,  &volume->bases, &volume->gradients};
    static const char *const names[] = {"order", "tets", "verts", "sums", "bases", "gradients"};
    GLuint unit = 0;
    glUseProgram(program);
    for (; unit < sizeof names / sizeof *names; unit++)
        tli_gl_set_texture(program, names[unit], unit, tables[unit]->texture);
    tli_gl_set_texture(program, "near_depth", unit, near_depth);
    tli_gl_set_texture(program, "far_depth", unit + 1, far_depth);
    tli_gl_set_view(program, view);
    tli_gl_set_float(program, "step_depth", item->volume_opts.step_depth);
    tli_gl_set_float(program, "opacity_end", item->volume_opts.opacity_end);
    set_light(program, &item->volume_opts, view->frame);

    tli_gl_target_use(target);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, projector->corners);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_CULL_FACE);
    glFrontFace(GL_CCW);
    glCullFace(GL_FRONT);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    for (size_t first = 0; first < volume->tet_count; first += BATCH) {
        size_t count = volume->tet_count - first < BATCH ? volume->tet_count - first : BATCH;
        tli_gl_set_int(program, "first", (GLint)first);
        glDrawElements(GL_TRIANGLES, (GLsizei)(count * TET_INDICES), GL_UNSIGNED_INT, NULL);
    }
}
