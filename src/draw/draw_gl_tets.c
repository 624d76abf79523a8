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

static tl_status open_projector(tl_ctx *ctx, tli_gl *gl, tli_gl_projector *projector)
{
    static const tli_gl_source ONE = {
        "tets",
        false,
        {{tli_shader_tets_vert},
         {"#define SLABS 1\n", tli_shader_integrals, tli_shader_tets_frag}}};
    static const tli_gl_source ALL = {
        "tets in slabs",
        false,
        {{tli_shader_tets_vert},
         {"#define SLABS 4\n", tli_shader_integrals, tli_shader_tets_frag}}};
    _Static_assert(TLI_GL_SLABS == 4, "as the text of the shader says");
    if (projector->corners) return TL_OK;
    tl_status st = projector->one ? TL_OK : tli_gl_program(ctx, gl, &ONE, &projector->one);
    if (!st && !projector->all) st = tli_gl_program(ctx, gl, &ALL, &projector->all);
    if (!st) st = make_corners(ctx, gl, &projector->corners);
    return st;
}

void tli_gl_projector_close(tli_gl *gl, tli_gl_projector *projector)
{
    if (projector->corners) gl->bytes -= BATCH * TET_INDICES * sizeof(uint32_t);
    glDeleteBuffers(1, &projector->corners);
    glDeleteProgram(projector->one);
    glDeleteProgram(projector->all);
    *projector = (tli_gl_projector){0};
}

void tli_gl_tets_remove(tli_gl *gl, tli_gl_tets *tets)
{
    tli_gl_table_free(gl, &tets->tets);
    tli_gl_table_free(gl, &tets->verts);
    tli_gl_table_free(gl, &tets->order);
    *tets = (tli_gl_tets){0};
}

/* ---- a view ---- */

tl_status tli_gl_tets_place(tl_ctx *ctx, tli_gl *gl, tli_gl_projector *projector,
                            const tli_gl_view *view, const tli_item *item, tli_gl_tets *tets)
{
    size_t vert_count = item->volume->vert_count;
    tli_order order = {0};
    tl_status st = open_projector(ctx, gl, projector);
    if (!st && !tets->tets.texture)
        st = tli_gl_table_fill(ctx, gl, &tets->tets, GL_RGBA32UI, item->volume->mesh->tets,
                               item->volume->cell_count);
    if (st || tli_gl_place_is(&tets->place, view)) return st;
    tli_vert *verts = tl_mem_alloc(ctx, vert_count, sizeof *verts, &st);
    if (!st) st = tli_volume_place(ctx, item, view->frame, verts);
    tli_order_view seen = {item->volume, item->transfer, view->frame,
                           verts,        view->width,    view->height};
    if (!st)
        st = item->volume_opts.order == TL_ORDER_EXACT ? tli_order_exact(ctx, &seen, &order)
                                                       : tli_order_centroids(ctx, &seen, &order);
    if (!st) st = tli_gl_table_fill(ctx, gl, &tets->verts, GL_RGBA32F, verts, vert_count);
    if (!st) st = tli_gl_table_fill(ctx, gl, &tets->order, GL_R32UI, order.tets, order.count);
    tets->tet_count = order.count;
    if (st) tets->place = (tli_gl_place){.width = 0};
    if (order.broken)
        tl_log(ctx, TL_LOG_DEBUG, "%zu of %zu tets are out of order: they hide each other in rings",
               order.broken, order.count);
    tl_mem_free(ctx, order.tets);
    tl_mem_free(ctx, verts);
    return st;
}

void tli_gl_tets_draw(const tli_gl_projector *projector, const tli_gl_view *view,
                      const tli_item *item, const tli_gl_fog *fog, const tli_gl_tets *tets,
                      const GLuint *limits, int slab_count)
{
    static const char *const names[TLI_GL_SLABS + 1] = {"limits[0]", "limits[1]", "limits[2]",
                                                        "limits[3]", "limits[4]"};
    const int slabs = slab_count > 1 ? TLI_GL_SLABS : 1; /* of the program */
    GLuint program = slabs > 1 ? projector->all : projector->one, unit = 0;
    glUseProgram(program);
    tli_gl_set_texture(program, "order", unit++, tets->order.texture);
    tli_gl_set_texture(program, "tets", unit++, tets->tets.texture);
    tli_gl_set_texture(program, "verts", unit++, tets->verts.texture);
    for (int i = 0; i <= slabs; i++) /* slabs that are not asked for are empty */
        tli_gl_set_texture(program, names[i], unit++, limits[i < slab_count ? i : slab_count]);
    tli_gl_fog_set(program, view, item, fog, unit);
    tli_gl_set_view(program, view);

    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, projector->corners);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_CULL_FACE);
    glFrontFace(GL_CCW);
    glCullFace(GL_FRONT);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    for (size_t first = 0; first < tets->tet_count; first += BATCH) {
        size_t count = tets->tet_count - first < BATCH ? tets->tet_count - first : BATCH;
        tli_gl_set_int(program, "first", (GLint)first);
        glDrawElements(GL_TRIANGLES, (GLsizei)(count * TET_INDICES), GL_UNSIGNED_INT, NULL);
    }
}
