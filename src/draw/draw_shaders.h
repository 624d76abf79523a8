/* Stage draw, internal: the text of the shaders, src/draw/NAME.glsl, put into the library when it
 * is built (cmake/tetralod_shaders.cmake). */
#ifndef TETRALOD_SRC_DRAW_SHADERS_H
#define TETRALOD_SRC_DRAW_SHADERS_H

extern const char tli_shader_tets_vert[], tli_shader_tets_frag[];
extern const char tli_shader_common[], tli_shader_integrals[], tli_shader_shade[];
extern const char tli_shader_put_picture[], tli_shader_put_list[];
extern const char tli_shader_list[], tli_shader_sort_comp[];
extern const char tli_shader_beside[], tli_shader_doors_vert[], tli_shader_doors_frag[];
extern const char tli_shader_rays_place_comp[], tli_shader_rays_comp[];
extern const char tli_shader_surface_vert[], tli_shader_slices_vert[], tli_shader_paint_frag[];
extern const char tli_shader_lines_vert[], tli_shader_lines_frag[];
extern const char tli_shader_points_vert[], tli_shader_points_frag[];
extern const char tli_shader_screen_vert[], tli_shader_layer_frag[];

#endif
