/* Rays through tets on a card with compute shaders: the mesh lies in buffers, faces that rays come
 * in by are drawn as boxes and tried at each pixel, then a ray a pixel goes from tet to tet in the
 * steps of the processor (draw_cast.inc.h). No order of tets is needed, and nothing of the mesh
 * crosses the bus when the camera moves. */
#include "draw/draw_gl.h"
#include "draw/draw_shaders.h"
#include "mesh/mesh.h"

enum { PLACE_GROUP = 64, PLACE_GROUPS_MAX = 65535, RAY_GROUP = 8, DOOR_CORNERS = 6 };
/* Rays of a band, about, and bands that are given to a card before the first of them is waited for:
 * enough for all it has to work, while pictures can still be cancelled. */
enum { BAND_RAYS = 1 << 16, BANDS_AHEAD = 16 };
/* A wait for a band that is begun again, nanoseconds. */
static const GLuint64 WAIT_NS = 1000000000;
/* Doors of a call: numbers of vertices are of 31 bits. */
static const size_t DOORS_MAX = (size_t)1 << 28;
/* Bindings of blocks, behind those of lists. */
enum {
    VERTS = 2,
    TETS = 3,
    PLACES = 3,
    DOORS = 4,
    BEHIND = 4,
    LAYER_HEADS = 5,
    LAYER_NODES = 6,
    LAYER_COLORS = 7
};

/* ---- opening ---- */

tl_status tli_gl_caster_open(tl_ctx *ctx, const tli_gl *gl, tli_gl_caster *caster)
{
    static const tli_gl_source PLACER = {
        "vertices of rays", true, {[TLI_GL_COMPUTE] = {tli_shader_rays_place_comp}}};
    static const tli_gl_source ENTRIES = {
        "entries of rays",
        true,
        {{tli_shader_beside, tli_shader_doors_vert},
         {tli_shader_list, tli_shader_beside, tli_shader_doors_frag}}};
    static const tli_gl_source RAYS = {
        "rays",
        true,
        {[TLI_GL_COMPUTE] = {tli_shader_list, tli_shader_beside, tli_shader_integrals,
                             tli_shader_rays_comp}}};
    tl_status st = TL_OK;
    if (!caster->placer) st = tli_gl_program(ctx, gl, &PLACER, &caster->placer);
    if (!st && !caster->doors) st = tli_gl_program(ctx, gl, &ENTRIES, &caster->doors);
    if (!st && !caster->rays) st = tli_gl_program(ctx, gl, &RAYS, &caster->rays);
    return st;
}

void tli_gl_caster_close(tli_gl *gl, tli_gl_caster *caster)
{
    glDeleteProgram(caster->placer);
    glDeleteProgram(caster->doors);
    glDeleteProgram(caster->rays);
    glDeleteProgram(caster->sorter);
    tli_gl_lists_free(gl, &caster->entries);
    tli_gl_lists_free(gl, &caster->layers);
    *caster = (tli_gl_caster){0};
}

/* ---- the mesh ---- */

static tl_status add_behind(tl_ctx *ctx, tli_gl *gl, const tl_volume *volume, tli_gl_web *web)
{
    tl_status st = TL_OK;
    tl_lidx(*behind)[4] = tl_mem_alloc(ctx, volume->cell_count, sizeof *behind, &st);
    for (size_t t = 0; t < volume->cell_count && !st; t++)
        for (int i = 0; i < 4; i++) behind[t][i] = volume->cells[t].behind[i];
    if (!st)
        st = tli_gl_buffer_fill(ctx, gl, &web->behind, behind, volume->cell_count, sizeof *behind);
    tl_mem_free(ctx, behind);
    return st;
}

/* The vertices, yet without places, and the doors between what is seen and what is not. */
static tl_status add_values(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_web *web)
{
    tl_status st = TL_OK;
    const tl_volume *volume = item->volume;
    const float clear[2] = {(float)item->transfer->clear[0], (float)item->transfer->clear[1]};
    tl_lidx *own = NULL;
    tli_vert *verts = tl_mem_zalloc(ctx, volume->vert_count, sizeof *verts, &st);
    for (size_t v = 0; v < volume->vert_count && !st; v++) verts[v].s = tli_volume_step(item, v);
    if (!st)
        st = tli_gl_buffer_fill(ctx, gl, &web->verts, verts, volume->vert_count, sizeof *verts);
    if (!st) st = tli_doors_list(ctx, volume, verts, clear, &own, &web->door_count);
    if (!st && web->door_count > DOORS_MAX)
        st = tl_fail(ctx, TL_ERR_UNSUPPORTED, "%s: rays come in by %zu faces, expected at most %zu",
                     gl->name, web->door_count, DOORS_MAX);
    if (!st)
        st = tli_gl_buffer_fill(ctx, gl, &web->doors, own ? own : volume->doors, web->door_count,
                                sizeof *own);
    tl_mem_free(ctx, own);
    tl_mem_free(ctx, verts);
    return st;
}

tl_status tli_gl_web_add(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_web *web)
{
    const tl_mesh *mesh = item->volume->mesh;
    *web = (tli_gl_web){.vert_count = mesh->vert_count};
    if (!gl->modern)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                       "%s has no compute shaders for rays (OpenGL 4.3); it can project tets",
                       gl->name);
    tl_status st = tli_gl_buffer_fill(ctx, gl, &web->tets, mesh->tets, mesh->tet_count,
                                      4 * sizeof *mesh->tets);
    if (!st) st = add_behind(ctx, gl, item->volume, web);
    if (!st)
        st = tli_gl_buffer_fill(ctx, gl, &web->places, mesh->xyz, mesh->vert_count,
                                3 * sizeof *mesh->xyz);
    if (!st) st = add_values(ctx, gl, item, web);
    if (!st) st = tli_gl_check(ctx, gl);
    if (st) tli_gl_web_remove(gl, web);
    return st;
}

void tli_gl_web_remove(tli_gl *gl, tli_gl_web *web)
{
    tli_gl_buffer_free(gl, &web->tets);
    tli_gl_buffer_free(gl, &web->behind);
    tli_gl_buffer_free(gl, &web->places);
    tli_gl_buffer_free(gl, &web->doors);
    tli_gl_buffer_free(gl, &web->verts);
    *web = (tli_gl_web){0};
}

/* ---- a view ---- */

static void place_verts(GLuint program, const tli_frame *frame, const tli_gl_web *web)
{
    const GLuint count = (GLuint)web->vert_count;
    GLuint groups = (count + PLACE_GROUP - 1) / PLACE_GROUP;
    glUseProgram(program);
    glUniform1ui(glGetUniformLocation(program, "vert_count"), count);
    glUniform3dv(glGetUniformLocation(program, "origin"), 1, frame->origin);
    glUniform3dv(glGetUniformLocation(program, "right"), 1, frame->right);
    glUniform3dv(glGetUniformLocation(program, "up"), 1, frame->up);
    glUniform3dv(glGetUniformLocation(program, "forward"), 1, frame->forward);
    glUniform1d(glGetUniformLocation(program, "frame_unit"), frame->unit);
    glUniform1d(glGetUniformLocation(program, "frame_scale"), frame->scale);
    tli_gl_buffer_bind(&web->verts, VERTS);
    tli_gl_buffer_bind(&web->places, PLACES);
    glDispatchCompute(groups < PLACE_GROUPS_MAX ? groups : PLACE_GROUPS_MAX, 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

tl_status tli_gl_web_enter(tl_ctx *ctx, tli_gl *gl, tli_gl_caster *caster, const tli_gl_view *view,
                           tli_gl_web *web, GLuint limit)
{
    size_t pixel_count = (size_t)view->width * view->height;
    if (!tli_gl_place_is(&web->place, view)) place_verts(caster->placer, view->frame, web);
    tl_status st = tli_gl_lists_begin(ctx, gl, &caster->entries, pixel_count, false);
    if (st) return st;
    glUseProgram(caster->doors);
    tli_gl_set_view(caster->doors, view);
    tli_gl_set_int(caster->doors, "row_pixels", (GLint)view->width);
    tli_gl_set_texture(caster->doors, "far_depth", 0, limit);
    tli_gl_buffer_bind(&web->verts, VERTS);
    tli_gl_buffer_bind(&web->tets, TETS);
    tli_gl_buffer_bind(&web->doors, DOORS);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glDrawArrays(GL_TRIANGLES, 0, (GLsizei)(web->door_count * DOOR_CORNERS));
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    return tli_gl_lists_sort(ctx, gl, &caster->sorter, &caster->entries, pixel_count);
}

/* Until the card has done all that came before the fence, which is deleted. */
static void wait_for(GLsync fence)
{
    while (glClientWaitSync(fence, GL_SYNC_FLUSH_COMMANDS_BIT, WAIT_NS) == GL_TIMEOUT_EXPIRED) {
    }
    glDeleteSync(fence);
}

/* A ray a pixel, a band of rows after the other. A processor in place of a card is done with a band
 * when the call returns; a card has the next ones waiting, so that it never waits for us. */
static tl_status follow_bands(tl_ctx *ctx, GLuint program, const tli_gl_view *view)
{
    const GLuint columns = (view->width + RAY_GROUP - 1) / RAY_GROUP;
    const GLuint rows = (view->height + RAY_GROUP - 1) / RAY_GROUP;
    GLuint band = BAND_RAYS / (RAY_GROUP * RAY_GROUP) / columns;
    GLsync ends[BANDS_AHEAD] = {0};
    tl_status st = TL_OK;
    if (band == 0) band = 1;
    for (GLuint row = 0, i = 0; row < rows; row += band, i = (i + 1) % BANDS_AHEAD) {
        if (ends[i]) wait_for(ends[i]);
        ends[i] = NULL;
        st = tli_gl_go_on(ctx);
        if (st) break;
        tli_gl_set_int(program, "first_row", (GLint)(row * RAY_GROUP));
        glDispatchCompute(columns, rows - row < band ? rows - row : band, 1);
        ends[i] = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    }
    for (int i = 0; i < BANDS_AHEAD; i++) glDeleteSync(ends[i]); /* 0 is passed over */
    return st;
}

tl_status tli_gl_caster_follow(tl_ctx *ctx, const tli_gl_caster *caster, const tli_gl_view *view,
                               const tli_gl_scene *scene, const tli_gl_target *target)
{
    static const tli_item NO_ITEM = {0};
    static const tli_gl_fog NO_FOG = {{0}, {0}, {0}};
    GLuint program = caster->rays;
    const tli_item *item = scene->item ? scene->item : &NO_ITEM;
    glUseProgram(program);
    tli_gl_set_view(program, view);
    tli_gl_fog_set(program, view, item, scene->item ? scene->fog : &NO_FOG, 0);
    tli_gl_set_texture(program, "back_color", TLI_GL_FOG_UNITS, scene->back->color);
    tli_gl_set_texture(program, "back_depth", TLI_GL_FOG_UNITS + 1, scene->back->depth);
    tli_gl_set_int(program, "has_volume", scene->item != NULL);
    tli_gl_set_int(program, "has_layers", scene->has_layers);
    glUniform2i(glGetUniformLocation(program, "size"), (GLint)view->width, (GLint)view->height);
    if (scene->item) {
        tli_gl_set_vec2(program, "clear", item->transfer->clear[0], item->transfer->clear[1]);
        tli_gl_buffer_bind(&scene->web->verts, VERTS);
        tli_gl_buffer_bind(&scene->web->tets, TETS);
        tli_gl_buffer_bind(&scene->web->behind, BEHIND);
    }
    tli_gl_buffer_bind(&caster->entries.heads, TLI_GL_LIST_HEADS);
    tli_gl_buffer_bind(&caster->entries.nodes, TLI_GL_LIST_NODES);
    tli_gl_buffer_bind(&caster->layers.heads, LAYER_HEADS);
    tli_gl_buffer_bind(&caster->layers.nodes, LAYER_NODES);
    tli_gl_buffer_bind(&caster->layers.colors, LAYER_COLORS);
    glBindImageTexture(0, target->color, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
    tli_gl_set_int(program, "picture", 0);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    tl_status st = follow_bands(ctx, program, view);
    glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                    GL_SHADER_STORAGE_BARRIER_BIT);
    return st;
}
