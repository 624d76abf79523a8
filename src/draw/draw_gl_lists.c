/* Lists of what lies at each pixel, filled by fragments in any order and then put in order by depth
 * (Yang et al. 2010): one pass of all that is translucent, whatever lies behind each other. */
#include "draw/draw_gl.h"
#include "draw/draw_shaders.h"

/* Numbers before the heads. */
enum { COUNT, MAX, GIVEN_UP, HEAD_COUNTS = 4 };
enum { NODE_NUMBERS = 3, GROUP = 64, GROUPS_MAX = 65535 };
/* Room at the first picture, nodes a pixel; and how much more than what was missing is made. */
static const double NODES_FIRST = 2, NODES_GROWTH = 1.25;

/* Room for nodes [node_max]; what is in them is lost. */
static tl_status make_room(tl_ctx *ctx, tli_gl *gl, tli_gl_lists *lists, size_t node_max,
                           bool colored)
{
    tl_status st =
        tli_gl_buffer_fill(ctx, gl, &lists->nodes, NULL, node_max, NODE_NUMBERS * sizeof(uint32_t));
    if (!st && colored)
        st = tli_gl_buffer_fill(ctx, gl, &lists->colors, NULL, node_max, 4 * sizeof(float));
    if (!st) lists->node_max = node_max;
    return st;
}

tl_status tli_gl_lists_begin(tl_ctx *ctx, tli_gl *gl, tli_gl_lists *lists, size_t pixel_count,
                             bool colored)
{
    static const GLuint none = TL_NONE;
    tl_status st = tli_gl_buffer_fill(ctx, gl, &lists->heads, NULL, HEAD_COUNTS + pixel_count,
                                      sizeof(uint32_t));
    if (!st && !lists->node_max)
        st =
            make_room(ctx, gl, lists, (size_t)((double)pixel_count * NODES_FIRST) + GROUP, colored);
    if (st) return st;
    const GLuint counts[HEAD_COUNTS] = {[MAX] = (GLuint)lists->node_max};
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, lists->heads.name);
    glClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &none);
    glBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, sizeof counts, counts);
    tli_gl_buffer_bind(&lists->heads, TLI_GL_LIST_HEADS);
    tli_gl_buffer_bind(&lists->nodes, TLI_GL_LIST_NODES);
    if (colored) tli_gl_buffer_bind(&lists->colors, TLI_GL_LIST_COLORS);
    return TL_OK;
}

tl_status tli_gl_lists_sort(tl_ctx *ctx, tli_gl *gl, GLuint *sorter, const tli_gl_lists *lists,
                            size_t pixel_count)
{
    static const tli_gl_source SOURCE = {
        "lists", true, {[TLI_GL_COMPUTE] = {tli_shader_list, tli_shader_sort_comp}}};
    tl_status st = *sorter ? TL_OK : tli_gl_program(ctx, gl, &SOURCE, sorter);
    if (st) return st;
    size_t groups = (pixel_count + GROUP - 1) / GROUP;
    glUseProgram(*sorter);
    glUniform1ui(glGetUniformLocation(*sorter, "pixel_count"), (GLuint)pixel_count);
    tli_gl_buffer_bind(&lists->heads, TLI_GL_LIST_HEADS);
    tli_gl_buffer_bind(&lists->nodes, TLI_GL_LIST_NODES);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glDispatchCompute((GLuint)(groups < GROUPS_MAX ? groups : GROUPS_MAX), 1, 1);
    return TL_OK;
}

tl_status tli_gl_lists_end(tl_ctx *ctx, tli_gl *gl, tli_gl_lists *lists, bool *again,
                           size_t *given_up)
{
    GLuint counts[HEAD_COUNTS] = {0};
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, lists->heads.name);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, sizeof counts, counts);
    *given_up = counts[GIVEN_UP];
    if (counts[COUNT] <= lists->node_max) return TL_OK;
    *again = true;
    return make_room(ctx, gl, lists, (size_t)((double)counts[COUNT] * NODES_GROWTH),
                     lists->colors.name != 0);
}

void tli_gl_lists_free(tli_gl *gl, tli_gl_lists *lists)
{
    tli_gl_buffer_free(gl, &lists->heads);
    tli_gl_buffer_free(gl, &lists->nodes);
    tli_gl_buffer_free(gl, &lists->colors);
    *lists = (tli_gl_lists){0};
}
