# tetralod_flags: language, warnings and sanitizers of everything that is compiled here.

set(CMAKE_C_STANDARD 17)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

add_library(tetralod_flags INTERFACE)
target_compile_definitions(tetralod_flags INTERFACE _POSIX_C_SOURCE=200809L _FILE_OFFSET_BITS=64)
# Without contraction a*b+c has the same bits on every compiler and machine.
target_compile_options(tetralod_flags INTERFACE
  -ffp-contract=off -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Wmissing-prototypes
  -Wpointer-arith -Wcast-qual -Wwrite-strings -Wundef -Wvla)
if(CMAKE_C_COMPILER_ID MATCHES Clang)
  # `&` of two comparisons is meant where a branch would cost more than both.
  target_compile_options(tetralod_flags INTERFACE -Wno-bitwise-instead-of-logical)
endif()
if(TETRALOD_WERROR)
  target_compile_options(tetralod_flags INTERFACE -Werror)
endif()
target_include_directories(tetralod_flags INTERFACE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)

if(TETRALOD_SANITIZE)
  set(SANITIZE_OPTIONS -fsanitize=${TETRALOD_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  if(TETRALOD_SANITIZE MATCHES undefined)
    # Not part of "undefined", but a conversion out of range is just that.
    list(APPEND SANITIZE_OPTIONS -fsanitize=float-cast-overflow)
  endif()
  add_compile_options(${SANITIZE_OPTIONS})
  add_link_options(${SANITIZE_OPTIONS})
endif()
if(TETRALOD_FUZZ)
  if(NOT CMAKE_C_COMPILER_ID MATCHES Clang)
    message(FATAL_ERROR "TETRALOD_FUZZ needs clang; the compiler is ${CMAKE_C_COMPILER_ID}")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
