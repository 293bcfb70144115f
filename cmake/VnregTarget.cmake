# What every target of the project shares: warnings and sanitizers (by preset). Eigen is a system
# include, so its own warnings stay quiet. What is compiled with these flags alone runs on every
# processor: the program, the reader of model files, the Python module.
add_library(vnreg_baseline_flags INTERFACE)
# Unique symbols would stay visible in the static library, where nothing but the API may be.
target_compile_options(vnreg_baseline_flags INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -ffp-contract=fast -fno-math-errno
  $<$<CXX_COMPILER_ID:Clang>:-Wno-sign-conversion>  # -Wconversion of GCC does not include it
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:-fno-gnu-unique>
  $<$<BOOL:${VNREG_WERROR}>:-Werror>)
target_compile_definitions(vnreg_baseline_flags INTERFACE EIGEN_DONT_PARALLELIZE EIGEN_MPL2_ONLY)
# Short of registers, GCC 12 moves numbers through those of MMX in code without AVX, and does not give
# them back: from then on a caller's long double is NaN.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  target_compile_options(vnreg_baseline_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-mno-mmx>)
endif()

# With the instruction set, private, so that users of the installed library never inherit it.
add_library(vnreg_build_flags INTERFACE)
target_link_libraries(vnreg_build_flags INTERFACE vnreg_baseline_flags)
target_compile_options(vnreg_build_flags INTERFACE -march=${VNREG_ISA})
# GCC 12 warns about its own headers of AVX-512 (its bug 105593).
if(VNREG_ISA STREQUAL "x86-64-v4")
  target_compile_options(vnreg_build_flags INTERFACE
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()
# Takes the instruction set back, for single files.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(VNREG_BASELINE_OPTION -march=x86-64)
endif()

# For what is compiled with a precompiled header, which ccache keeps only when told so.
set(VNREG_PRECOMPILED_LAUNCHER ${CMAKE_CXX_COMPILER_LAUNCHER})
if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES "ccache")
  set(VNREG_PRECOMPILED_LAUNCHER ${CMAKE_COMMAND} -E env
    CCACHE_SLOPPINESS=pch_defines,time_macros ${CMAKE_CXX_COMPILER_LAUNCHER})
endif()

# Headers of libraries that most files of a target include, compiled once, where sanitizers make a
# build that shares no object with others. The others share theirs by ccache, which a header in the
# folder of one build would prevent.
function(vnreg_precompile target)
  if(NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    return()
  endif()
  target_precompile_headers(${target} PRIVATE ${ARGN})
  set_target_properties(${target} PROPERTIES
    CXX_COMPILER_LAUNCHER "${VNREG_PRECOMPILED_LAUNCHER}")
endfunction()

# The public headers; split from the engine so that kernels and model_format can name vnreg::Error.
add_library(vnreg_api INTERFACE)
target_include_directories(vnreg_api INTERFACE
  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/engine/include>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
