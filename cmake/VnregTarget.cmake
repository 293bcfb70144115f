# What every target of the project shares: warnings, sanitizers (by preset) and the instruction set.
# Eigen is a system include, so its own warnings stay quiet; the instruction set is private, so
# users of the installed library never inherit it.
add_library(vnreg_build_flags INTERFACE)
# Unique symbols would stay visible in the static library, where nothing but the API may be.
target_compile_options(vnreg_build_flags INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -march=${VNREG_ISA} -ffp-contract=fast -fno-math-errno
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:-fno-gnu-unique>
  $<$<BOOL:${VNREG_WERROR}>:-Werror>)
target_compile_definitions(vnreg_build_flags INTERFACE EIGEN_DONT_PARALLELIZE EIGEN_MPL2_ONLY)
# The public headers; split from the engine so that kernels and model_format can name vnreg::Error.
add_library(vnreg_api INTERFACE)
target_include_directories(vnreg_api INTERFACE
  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/engine/include>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
