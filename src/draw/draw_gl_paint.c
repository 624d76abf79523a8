/* Surfaces, slices, lines and points in OpenGL. All stays in the card from frame to frame: places
 * relative to an anchor in the middle of the thing, so that float32 holds them; a slice moves by
 * one number, and blocks of tets without that value are passed over. */
#include <math.h>
#include <string.h>

#include "base/base_vec.h"
#include "draw/draw_gl.h"
#include "draw/draw_layers.h"
#include "draw/draw_shaders.h"
#include "extract/extract.h"
#include "mesh/mesh.h"

enum { GRAIN = 8192 };
/* Vertices of a tet of slices, of a triangle, of the rectangle around a segment or a point. */
enum { SLICE_CORNERS = 6, TRIANGLE_CORNERS = 3, MARK_CORNERS = 6 };
/* Of a segment of a line: it is its first, its last one. */
static const uint32_t BEGINS = UINT32_C(1) << 30, ENDS = UINT32_C(1) << 31;

/* Vertex and fragment shaders by the kind of the thing. */
static const struct {
    const char *name, *vertex, *fragment;
} SHADERS[] = {[TLI_ITEM_SURFACE] = {"surfaces", tli_shader_surface_vert, tli_shader_paint_frag},
               [TLI_ITEM_LINES] = {"lines", tli_shader_lines_vert, tli_shader_lines_frag},
               [TLI_ITEM_POINTS] = {"points", tli_shader_points_vert, tli_shader_points_frag},
               [TLI_ITEM_SLICES] = {"slices", tli_shader_slices_vert, tli_shader_paint_frag}};
enum { SHADER_COUNT = sizeof SHADERS / sizeof *SHADERS };

tl_status tli_gl_painter_open(tl_ctx *ctx, const tli_gl *gl, bool lists, tli_gl_painter *painter)
{
    tl_status st = TL_OK;
    painter->lists = lists;
    for (size_t kind = 0; kind < SHADER_COUNT && !st; kind++) {
        const tli_gl_source picture = {
            SHADERS[kind].name,
            false,
            {{SHADERS[kind].vertex},
             {tli_shader_shade, tli_shader_put_picture, SHADERS[kind].fragment}}};
        const tli_gl_source list = {
            SHADERS[kind].name,
            true,
            {{SHADERS[kind].vertex},
             {tli_shader_list, tli_shader_shade, tli_shader_put_list, SHADERS[kind].fragment}}};
        if (SHADERS[kind].name && !painter->programs[kind])
            st = tli_gl_program(ctx, gl, lists ? &list : &picture, &painter->programs[kind]);
    }
    return st;
}

void tli_gl_painter_close(tli_gl_painter *painter)
{
    for (size_t kind = 0; kind < SHADER_COUNT; kind++) glDeleteProgram(painter->programs[kind]);
    *painter = (tli_gl_painter){0};
}

/* ---- adding ---- */

/* What is filled into the tables of vertices. */
typedef struct filling {
    const tli_item *item;
    const tli_gl_thing *thing;
    const tl_lidx *from;     /* the vertex of each entry; NULL: all in order */
    const double *xyz;       /* of vertices */
    const double *fourth;    /* of entries; beside the place, 0 to 1 over the range; may be NULL */
    const double *gradients; /* of vertices, the normals of slices; may be NULL */
    const float *normals;    /* of vertices; may be NULL */
    float (*places)[4], (*carried)[4];
} filling;

static tl_status fill_verts(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const filling *f = arg;
    const tl_look *look = &f->item->look;
    const double *range = f->thing->range;
    for (size_t i = begin; i < end; i++) {
        size_t v = f->from ? f->from[i] : i;
        for (size_t k = 0; k < 3; k++) {
            f->places[i][k] = (float)(f->xyz[3 * v + k] - f->thing->anchor[k]);
            f->carried[i][k] = f->gradients ? (float)f->gradients[3 * v + k]
                               : f->normals ? f->normals[3 * v + k]
                                            : 0;
        }
        f->places[i][3] =
            f->fourth ? (float)((f->fourth[i] - range[0]) / (range[1] - range[0])) : 0;
        f->carried[i][3] =
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

/* The tables of vertices; f has what is known before. */
static tl_status add_verts(tl_ctx *ctx, tli_gl *gl, filling *f, size_t entry_count,
                           tli_gl_thing *thing)
{
    tl_status st = TL_OK;
    const tl_polydata *p = f->item->polydata;
    f->thing = thing;
    f->xyz = p ? p->xyz : f->item->mesh->xyz;
    f->normals = p ? p->normals : NULL;
    set_box(f->xyz, p ? p->vert_count : f->item->mesh->vert_count, thing);
    f->places = tl_mem_alloc(ctx, entry_count, sizeof *f->places, &st);
    f->carried = tl_mem_alloc(ctx, entry_count, sizeof *f->carried, &st);
    if (!st) st = tli_parallel(ctx, entry_count, GRAIN, fill_verts, f);
    if (!st) st = tli_gl_table_fill(ctx, gl, &thing->verts, GL_RGBA32F, f->places, entry_count);
    if (!st) st = tli_gl_table_fill(ctx, gl, &thing->normals, GL_RGBA32F, f->carried, entry_count);
    tl_mem_free(ctx, f->carried);
    tl_mem_free(ctx, f->places);
    return st;
}

static tl_status add_colors(tl_ctx *ctx, tli_gl *gl, const tl_look *look, tli_gl_thing *thing)
{
    static const float none[4] = {0};
    const tl_transfer *t = look->transfer;
    return tli_gl_table_fill(ctx, gl, &thing->colors, GL_RGBA32F, t ? t->at[0] : none,
                             t ? sizeof t->at / sizeof *t->at : 1);
}

static tl_status add_surface(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_thing *thing)
{
    const tl_polydata *p = item->polydata;
    filling f = {.item = item};
    thing->count = p->cell_count;
    tl_status st = add_verts(ctx, gl, &f, p->vert_count, thing);
    return st ? st
              : tli_gl_table_fill(ctx, gl, &thing->corners, GL_R32UI, p->corners,
                                  tli_corner_count(p));
}

/* Tets, with the range of the scalar, that of blocks of tets, and its gradient for normals. */
static tl_status add_slices(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_thing *thing)
{
    tl_status st = TL_OK;
    const tl_mesh *mesh = item->mesh;
    tl_channel channel = {"", "", 1, TL_ON_VERTEX, TL_F64, item->scalar};
    double *gradients = tl_mem_alloc(ctx, mesh->vert_count, 3 * sizeof *gradients, &st);
    filling f = {.item = item, .fourth = item->scalar, .gradients = gradients};
    thing->count = mesh->tet_count;
    if (!st) st = tl_mesh_gradient(ctx, mesh, &channel, gradients);
    if (!st) st = tl_range_index_create(ctx, mesh, item->scalar, &thing->ranges);
    tl_channel_range(&channel, mesh->vert_count, thing->range, NULL);
    if (thing->range[0] == thing->range[1]) thing->range[1] = thing->range[0] + 1;
    if (!st) st = add_verts(ctx, gl, &f, mesh->vert_count, thing);
    if (!st)
        st = tli_gl_table_fill(ctx, gl, &thing->corners, GL_RGBA32UI, mesh->tets, mesh->tet_count);
    tl_mem_free(ctx, gradients);
    return st;
}

static tl_status add_points(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_thing *thing)
{
    tl_status st = TL_OK;
    size_t count = item->polydata->vert_count;
    double *dice = tl_mem_alloc(ctx, count, sizeof *dice, &st);
    filling f = {.item = item, .fourth = dice};
    thing->count = count;
    for (size_t i = 0; i < count && !st; i++) dice[i] = tli_point_die(i);
    if (!st) st = add_verts(ctx, gl, &f, count, thing);
    tl_mem_free(ctx, dice);
    return st;
}

/* Ways along the lines, and the segments between places that are finite. Returns their number. */
static size_t list_segments(const tl_polydata *p, double *ways, uint32_t *segments)
{
    size_t count = 0;
    for (size_t line = 0; line < p->cell_count; line++) {
        size_t first = p->starts[line], end = p->starts[line + 1];
        bool goes_on = false; /* the last segment ends where the next one begins */
        if (first < end) ways[first] = 0;
        for (size_t i = first + 1; i < end; i++) {
            double step[3];
            vec_sub(p->xyz + 3 * (size_t)p->corners[i], p->xyz + 3 * (size_t)p->corners[i - 1],
                    step);
            bool whole = vec_is_finite(step);
            ways[i] = ways[i - 1] + (whole ? vec_length(step) : 0);
            if (!whole && goes_on) segments[count - 1] |= ENDS;
            if (whole) segments[count++] = (uint32_t)(i - 1) | (goes_on ? 0 : BEGINS);
            goes_on = whole;
        }
        if (goes_on) segments[count - 1] |= ENDS;
    }
    return count;
}

static tl_status add_lines(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_thing *thing)
{
    tl_status st = TL_OK;
    const tl_polydata *p = item->polydata;
    size_t corner_count = tli_corner_count(p);
    if (corner_count >= BEGINS)
        return tl_fail(ctx, TL_ERR_UNSUPPORTED, "%zu corners of lines, OpenGL draws fewer than %u",
                       corner_count, BEGINS);
    double *ways = tl_mem_alloc(ctx, corner_count, sizeof *ways, &st);
    uint32_t *segments = tl_mem_alloc(ctx, corner_count, sizeof *segments, &st);
    filling f = {.item = item, .from = p->corners, .fourth = ways};
    if (!st) thing->count = list_segments(p, ways, segments);
    if (!st) st = add_verts(ctx, gl, &f, corner_count, thing);
    if (!st) st = tli_gl_table_fill(ctx, gl, &thing->corners, GL_R32UI, segments, thing->count);
    tl_mem_free(ctx, segments);
    tl_mem_free(ctx, ways);
    return st;
}

tl_status tli_gl_thing_add(tl_ctx *ctx, tli_gl *gl, const tli_item *item, tli_gl_thing *thing)
{
    *thing = (tli_gl_thing){.range = {0, 1}};
    tl_status st = add_colors(ctx, gl, &item->look, thing);
    if (!st && item->kind == TLI_ITEM_SURFACE) st = add_surface(ctx, gl, item, thing);
    if (!st && item->kind == TLI_ITEM_SLICES) st = add_slices(ctx, gl, item, thing);
    if (!st && item->kind == TLI_ITEM_LINES) st = add_lines(ctx, gl, item, thing);
    if (!st && item->kind == TLI_ITEM_POINTS) st = add_points(ctx, gl, item, thing);
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
    if (look->transfer)
        glUniform3fv(glGetUniformLocation(program, "nan_rgb"), 1, look->transfer->nan);
    glUniform4f(glGetUniformLocation(program, "light"), (float)look->ambient, (float)look->diffuse,
                (float)look->specular, (float)look->shininess);
}

static bool holds(const double range[2], double value)
{
    return range[0] <= value && value <= range[1];
}

/* Draws vertices, whose triangles have tags from *tag on. */
static void draw_triangles(GLuint program, size_t first, size_t count, GLint *tag)
{
    tli_gl_set_int(program, "first_tag", *tag);
    glDrawArrays(GL_TRIANGLES, (GLint)first, (GLsizei)count);
    *tag += (GLint)(count / TRIANGLE_CORNERS);
}

/* One value: runs of blocks of tets that hold it. */
static void draw_slice(GLuint program, const tli_gl_thing *thing, double value, GLint *tag)
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
        draw_triangles(program, first * SLICE_CORNERS, (last - first) * SLICE_CORNERS, tag);
    }
}

static void set_lines(GLuint program, const tli_item *item, const tli_frame *frame)
{
    const tl_line_opts *o = &item->line_opts;
    tli_gl_set_int(program, "is_tube", o->shape == TL_LINE_TUBE);
    tli_gl_set_int(program, "has_normals",
                   o->shape == TL_LINE_RIBBON && item->polydata->normals != NULL);
    tli_gl_set_float(program, "width_px", o->width_px);
    tli_gl_set_float(program, "width", o->width / frame->unit);
    tli_gl_set_float(program, "halo_px", item->look.opacity < 1 ? 0 : o->halo_px);
    tli_gl_set_float(program, "head", o->arrow_spacing > 0 ? TLI_ARROW_WIDTH : 1);
    tli_gl_set_float(program, "dash", o->dash);
    tli_gl_set_float(program, "gap", o->gap);
    tli_gl_set_float(program, "phase", o->phase);
    tli_gl_set_float(program, "arrow_spacing", o->arrow_spacing);
}

/* Depth of the nearest point before the camera, 0 where there is none. */
static double nearest_of(const tl_polydata *points, const tli_frame *frame)
{
    double nearest = (double)INFINITY;
    for (size_t v = 0; v < points->vert_count; v++) {
        double at[3];
        tli_frame_place(frame, points->xyz + 3 * v, at);
        if (at[2] > 0 && at[2] < nearest) nearest = at[2];
    }
    return nearest < (double)INFINITY ? nearest : 0;
}

static void set_points(GLuint program, const tli_item *item, const tli_frame *frame)
{
    const tl_point_opts *o = &item->point_opts;
    bool thin = o->scale_depth && !frame->parallel;
    tli_gl_set_float(program, "radius_px", o->radius_px);
    tli_gl_set_float(program, "radius", o->radius / frame->unit);
    tli_gl_set_float(program, "nearest", thin ? nearest_of(item->polydata, frame) : 0);
}

void tli_gl_thing_draw(const tli_gl_painter *painter, const tli_gl_view *view, const tli_item *item,
                       const tli_gl_thing *thing, bool translucent, GLuint limit, GLint *tag)
{
    GLuint program = painter->programs[item->kind];
    size_t corners = item->kind == TLI_ITEM_SURFACE ? TRIANGLE_CORNERS : MARK_CORNERS;
    glUseProgram(program);
    tli_gl_set_texture(program, "corners", 0, thing->corners.texture);
    tli_gl_set_texture(program, "verts", 1, thing->verts.texture);
    tli_gl_set_texture(program, "normals", 2, thing->normals.texture);
    tli_gl_set_texture(program, "colors", 3, thing->colors.texture);
    tli_gl_set_texture(program, "limit", 4, limit);
    tli_gl_set_view(program, view);
    set_place(program, view->frame, thing->anchor);
    set_look(program, &item->look);
    tli_gl_set_int(program, "translucent", translucent);
    tli_gl_set_int(program, "row_pixels", (GLint)view->width);
    tli_gl_set_int(program, "has_normals", item->polydata && item->polydata->normals);
    if (item->kind == TLI_ITEM_LINES) set_lines(program, item, view->frame);
    if (item->kind == TLI_ITEM_POINTS) set_points(program, item, view->frame);
    if (item->kind != TLI_ITEM_SLICES) draw_triangles(program, 0, thing->count * corners, tag);
    for (size_t i = 0; item->kind == TLI_ITEM_SLICES && i < item->value_count; i++)
        draw_slice(program, thing, item->values[i], tag);
}
