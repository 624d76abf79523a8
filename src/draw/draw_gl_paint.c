/* Surfaces and slices in OpenGL. All stays in the card from frame to frame: places relative to an
 * anchor in the middle of the thing, so that float32 holds them; a slice moves by one number, and
 * blocks of tets without that value are passed over. */
#include <math.h>
#include <string.h>

#include "draw/draw_gl.h"
#include "draw/draw_shaders.h"
#include "extract/extract.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192, SLICE_CORNERS = 6 };

tl_status tli_gl_painter_open(tl_ctx *ctx, tli_gl *gl, tli_gl_painter *painter)
{
    *painter = (tli_gl_painter){0};
    tl_status st = tli_gl_program(ctx, gl, "surfaces", tli_shader_surface_vert,
                                  tli_shader_paint_frag, &painter->surface);
    if (!st)
        st = tli_gl_program(ctx, gl, "slices", tli_shader_slices_vert, tli_shader_paint_frag,
                            &painter->slices);
    return st;
}

void tli_gl_painter_close(tli_gl_painter *painter)
{
    glDeleteProgram(painter->surface);
    glDeleteProgram(painter->slices);
    *painter = (tli_gl_painter){0};
}

/* ---- adding ---- */

/* What is filled into the tables of vertices. */
typedef struct filling {
    const tli_item *item;
    const tli_gl_thing *thing;
    const double *xyz, *gradients; /* gradients: of slices */
    const float *normals;          /* of surfaces; may be NULL */
    float (*places)[4], (*carried)[4];
} filling;

static tl_status fill_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const filling *f = arg;
    const tl_look *look = &f->item->look;
    const double *range = f->thing->range;
    for (size_t v = begin; v < end; v++) {
        for (size_t k = 0; k < 3; k++) {
            f->places[v][k] = (float)(f->xyz[3 * v + k] - f->thing->anchor[k]);
            f->carried[v][k] = f->gradients ? (float)f->gradients[3 * v + k]
                               : f->normals ? f->normals[3 * v + k]
                                            : 0;
        }
        f->places[v][3] =
            f->item->scalar ? (float)((f->item->scalar[v] - range[0]) / (range[1] - range[0])) : 0;
        f->carried[v][3] =
            look->scalar
                ? (float)((look->scalar[v] - look->transfer->low) * look->transfer->per_value)
                : 0;
    }
    return TL_OK;
}

/* Anchor and box of all finite places. */
static void set_box(const double *xyz, size_t vert_count, tli_gl_thing *thing)
{
    for (int k = 0; k < 3; k++) {
        thing->low[k] = (double)INFINITY;
        thing->high[k] = -(double)INFINITY;
    }
    for (size_t v = 0; v < vert_count; v++)
        for (size_t k = 0; k < 3; k++) {
            if (!isfinite(xyz[3 * v + k])) continue;
            thing->low[k] = fmin(thing->low[k], xyz[3 * v + k]);
            thing->high[k] = fmax(thing->high[k], xyz[3 * v + k]);
        }
    for (int k = 0; k < 3; k++)
        if (thing->low[k] <= thing->high[k])
            thing->anchor[k] = thing->low[k] / 2 + thing->high[k] / 2;
}

static tl_status add_verts(tl_ctx *ctx, tli_gl *gl, const tli_item *item, const double *gradients,
                           tli_gl_thing *thing)
{
    tl_status st = TL_OK;
    const tl_polydata *p = item->polydata;
    size_t count = p ? p->vert_count : item->mesh->vert_count;
    filling f = {.item = item, .thing = thing, .gradients = gradients};
    f.xyz = p ? p->xyz : item->mesh->xyz;
    f.normals = p ? p->normals : NULL;
    set_box(f.xyz, count, thing);
    f.places = tl_mem_alloc(ctx, count, sizeof *f.places, &st);
    f.carried = tl_mem_alloc(ctx, count, sizeof *f.carried, &st);
    if (!st) st = tli_parallel(ctx, count, GRAIN, fill_verts, &f);
    if (!st) st = tli_gl_table_fill(ctx, gl, &thing->verts, GL_RGBA32F, f.places, count);
    if (!st) st = tli_gl_table_fill(ctx, gl, &thing->normals, GL_RGBA32F, f.carried, count);
    tl_mem_free(ctx, f.carried);
    tl_mem_free(ctx, f.places);
    return st;
}

static tl_status add_colors(tl_ctx *ctx, tli_gl *gl, const tl_look *look, tli_gl_thing *thing)
{
    static const float none[4] = {0};
    const tl_transfer *t = look->transfer;
    return tli_gl_table_fill(ctx, gl, &thing->colors, GL_RGBA32F, t ? t->at[0] : none,
                             t ? sizeof t->at / sizeof *t->at : 1);
}

/* The scalar of slices: its range, that of blocks of tets, and its gradient for normals. */
static tl_status add_scalar(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_thing *thing)
{
    tl_status st = TL_OK;
    const tl_mesh *mesh = item->mesh;
    tl_channel channel = {"", "", 1, TL_ON_VERTEX, TL_F64, item->scalar};
    double *gradients = tl_mem_alloc(ctx, mesh->vert_count, 3 * sizeof *gradients, &st);
    if (!st) st = tl_mesh_gradient(ctx, mesh, &channel, gradients);
    if (!st) st = tl_range_index_create(ctx, mesh, item->scalar, &thing->ranges);
    tl_channel_range(&channel, mesh->vert_count, thing->range, NULL);
    if (thing->range[0] == thing->range[1]) thing->range[1] = thing->range[0] + 1;
    if (!st) st = add_verts(ctx, gl, item, gradients, thing);
    tl_mem_free(ctx, gradients);
    return st;
}

tl_status tli_gl_thing_add(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_thing *thing)
{
    const tl_polydata *p = item->polydata;
    *thing = (tli_gl_thing){.count = p ? p->cell_count : item->mesh->tet_count};
    tl_status st = add_colors(ctx, gl, &item->look, thing);
    if (!st && p) st = add_verts(ctx, gl, item, NULL, thing);
    if (!st && !p) st = add_scalar(ctx, gl, item, thing);
    if (!st && p)
        st = tli_gl_table_fill(ctx, gl, &thing->corners, GL_R32UI, p->corners, 3 * p->cell_count);
    if (!st && !p)
        st = tli_gl_table_fill(ctx, gl, &thing->corners, GL_RGBA32UI, item->mesh->tets,
                               item->mesh->tet_count);
    if (st) tli_gl_thing_remove(ctx, gl, thing);
    return st;
}

void tli_gl_thing_remove(tl_ctx *ctx, tli_gl *gl, tli_gl_thing *thing)
{
    tli_gl_table_free(gl, &thing->verts);
    tli_gl_table_free(gl, &thing->normals);
    tli_gl_table_free(gl, &thing->corners);
    tli_gl_table_free(gl, &thing->colors);
    tl_range_index_destroy(ctx, thing->ranges);
    *thing = (tli_gl_thing){0};
}

/* ---- drawing ---- */

static void set_place(GLuint program, const tli_frame *frame, const double anchor[3])
{
    float turn[9], offset[3];
    const double *const axes[] = {frame->right, frame->up, frame->forward};
    for (int row = 0; row < 3; row++) {
        double sum = 0;
        for (int k = 0; k < 3; k++) {
            turn[3 * k + row] = (float)(axes[row][k] / frame->unit);
            sum += axes[row][k] * ((anchor[k] - frame->origin[k]) / frame->unit);
        }
        offset[row] = (float)sum;
    }
    glUniformMatrix3fv(glGetUniformLocation(program, "turn"), 1, GL_FALSE, turn);
    glUniform3fv(glGetUniformLocation(program, "offset"), 1, offset);
}

static void set_look(GLuint program, const tl_look *look)
{
    tli_gl_set_int(program, "has_values", look->scalar != NULL);
    tli_gl_set_int(program, "lit", look->lit);
    tli_gl_set_float(program, "opacity", look->opacity);
    glUniform3f(glGetUniformLocation(program, "rgb"), (float)look->rgb[0], (float)look->rgb[1],
                (float)look->rgb[2]);
    glUniform4f(glGetUniformLocation(program, "light"), (float)look->ambient, (float)look->diffuse,
                (float)look->specular, (float)look->shininess);
}

static bool holds(const double range[2], double value)
{
    return range[0] <= value && value <= range[1];
}

/* One value: runs of blocks of tets that hold it. */
static void draw_slice(GLuint program, const tli_gl_thing *thing, double value)
{
    const tl_range_index *r = thing->ranges;
    size_t blocks = (thing->count + TLI_RANGE_TETS - 1) / TLI_RANGE_TETS;
    tli_gl_set_float(program, "level",
                     (value - thing->range[0]) / (thing->range[1] - thing->range[0]));
    for (size_t i = 0, end; i < blocks; i = end) {
        end = i + 1;
        if (!holds(r->ranges[i], value)) continue;
        while (end < blocks && holds(r->ranges[end], value)) end++;
        size_t first = i * TLI_RANGE_TETS, last = end * TLI_RANGE_TETS;
        last = last < thing->count ? last : thing->count;
        glDrawArrays(GL_TRIANGLES, (GLint)(first * SLICE_CORNERS),
                     (GLsizei)((last - first) * SLICE_CORNERS));
    }
}

void tli_gl_thing_draw(const tli_gl_painter *painter, const tli_gl_view *view, const tli_item *item,
                       const tli_gl_thing *thing, GLuint limit)
{
    GLuint program = item->polydata ? painter->surface : painter->slices;
    glUseProgram(program);
    tli_gl_set_texture(program, "corners", 0, thing->corners.texture);
    tli_gl_set_texture(program, "verts", 1, thing->verts.texture);
    tli_gl_set_texture(program, "normals", 2, thing->normals.texture);
    tli_gl_set_texture(program, "colors", 3, thing->colors.texture);
    tli_gl_set_texture(program, "limit", 4, limit);
    tli_gl_set_view(program, view);
    set_place(program, view->frame, thing->anchor);
    set_look(program, &item->look);
    if (item->polydata) {
        tli_gl_set_int(program, "has_normals", item->polydata->normals != NULL);
        glDrawArrays(GL_TRIANGLES, 0, (GLsizei)(3 * thing->count));
    }
    for (size_t i = 0; !item->polydata && i < item->value_count; i++)
        draw_slice(program, thing, item->values[i]);
}
