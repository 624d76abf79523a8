/* What volumes are drawn with in OpenGL, however their tets get there: the integrals of the
 * transfer function, gradients, light. */
#include <string.h>

#include "draw/draw_gl.h"

static tl_status add_gradients(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_fog *fog)
{
    tl_status st = TL_OK;
    size_t count = tli_volume_has_light(&item->volume_opts) ? item->volume->vert_count : 1;
    float(*gradients)[4] = tl_mem_zalloc(ctx, count, sizeof *gradients, &st);
    if (!st && tli_volume_has_light(&item->volume_opts))
        tli_volume_gradients(&item->volume_opts, count, gradients);
    if (!st) st = tli_gl_table_fill(ctx, gl, &fog->gradients, GL_RGBA32F, gradients, count);
    tl_mem_free(ctx, gradients);
    return st;
}

tl_status tli_gl_fog_add(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_fog *fog)
{
    const tl_transfer *t = item->transfer;
    *fog = (tli_gl_fog){0};
    tl_status st = tli_gl_table_fill(ctx, gl, &fog->sums, GL_RGBA32F, t->sums,
                                     sizeof t->sums / sizeof *t->sums);
    if (!st)
        st = tli_gl_table_fill(ctx, gl, &fog->bases, GL_RGBA32F, t->bases,
                               sizeof t->bases / sizeof *t->bases);
    if (!st) st = add_gradients(ctx, gl, item, fog);
    if (st) tli_gl_fog_remove(gl, fog);
    return st;
}

void tli_gl_fog_remove(tli_gl *gl, tli_gl_fog *fog)
{
    tli_gl_table_free(gl, &fog->sums);
    tli_gl_table_free(gl, &fog->bases);
    tli_gl_table_free(gl, &fog->gradients);
    *fog = (tli_gl_fog){0};
}

void tli_gl_fog_set(GLuint program, const tli_gl_view *view, const tli_item *item,
                    const tli_gl_fog *fog, GLuint first)
{
    float axes[9];
    const tl_volume_opts *o = &item->volume_opts;
    for (int k = 0; k < 3; k++) {
        axes[k] = (float)view->frame->right[k];
        axes[3 + k] = (float)view->frame->up[k];
        axes[6 + k] = (float)view->frame->forward[k];
    }
    tli_gl_set_texture(program, "sums", first, fog->sums.texture);
    tli_gl_set_texture(program, "bases", first + 1, fog->bases.texture);
    tli_gl_set_texture(program, "gradients", first + 2, fog->gradients.texture);
    tli_gl_set_float(program, "step_depth", o->step_depth);
    tli_gl_set_float(program, "opacity_end", o->opacity_end);
    tli_gl_set_int(program, "has_light", tli_volume_has_light(o));
    tli_gl_set_int(program, "dims", o->gradient_opacity > 0);
    glUniformMatrix3fv(glGetUniformLocation(program, "axes"), 1, GL_FALSE, axes);
    glUniform4f(glGetUniformLocation(program, "light"), o->lit ? (float)o->ambient : 1,
                o->lit ? (float)o->diffuse : 0, o->lit ? (float)o->specular : 0,
                (float)o->shininess);
}

bool tli_gl_place_is(tli_gl_place *place, const tli_gl_view *view)
{
    tli_gl_place now;
    memset(&now, 0, sizeof now); /* padding, too */
    now.frame = *view->frame;
    now.width = view->width;
    now.height = view->height;
    bool is_same = memcmp(place, &now, sizeof now) == 0;
    if (!is_same) memcpy(place, &now, sizeof now);
    return is_same;
}
