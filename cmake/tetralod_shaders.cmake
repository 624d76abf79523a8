# Makes SHADER_SOURCE, a C file with the text of each src/draw/NAME.glsl as tli_shader_NAME, which
# src/draw/draw_shaders.h declares.

file(GLOB SHADERS CONFIGURE_DEPENDS src/draw/*.glsl)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${SHADERS})
set(SHADER_SOURCE ${PROJECT_BINARY_DIR}/draw_gl_shaders.c)
set(shader_text "#include \"draw/draw_shaders.h\"\n")
foreach(shader ${SHADERS})
  get_filename_component(name ${shader} NAME_WE)
  file(READ ${shader} bytes HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  string(APPEND shader_text "const char tli_shader_${name}[] = {${bytes}0};\n")
endforeach()
file(CONFIGURE OUTPUT ${SHADER_SOURCE} CONTENT "${shader_text}")
