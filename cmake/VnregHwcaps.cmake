# The shared library once more for each better instruction set. The system's loader takes the best one
# that the processor has from glibc-hwcaps/LEVEL beside the library itself, which is x86-64-v2.
include(ExternalProject)

if(NOT VNREG_ISA STREQUAL "x86-64-v2" OR NOT VNREG_SHARED)
  message(FATAL_ERROR "VNREG_HWCAPS needs VNREG_SHARED, and VNREG_ISA x86-64-v2 as what all have")
endif()
set(VNREG_SONAME "libvnreg.so.${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")

# Where the library of a level is when it is built.
function(vnreg_hwcaps_library level variable)
  set(${variable} "${PROJECT_BINARY_DIR}/hwcaps/${level}/engine/${VNREG_SONAME}" PARENT_SCOPE)
endfunction()

set(VNREG_HWCAPS_LEVELS x86-64-v3 x86-64-v4)
foreach(level IN LISTS VNREG_HWCAPS_LEVELS)
  vnreg_hwcaps_library(${level} library)
  ExternalProject_Add(vnreg_${level}
    SOURCE_DIR "${PROJECT_SOURCE_DIR}"
    BINARY_DIR "${PROJECT_BINARY_DIR}/hwcaps/${level}"
    PREFIX "${PROJECT_BINARY_DIR}/hwcaps"
    CMAKE_ARGS
      -DVNREG_ISA=${level} -DVNREG_SHARED=ON -DVNREG_STATIC=OFF -DVNREG_INSTALL=OFF
      -DVNREG_BUILD_CLI=OFF -DVNREG_BUILD_TESTS=OFF -DVNREG_WERROR=${VNREG_WERROR}
      -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE} -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
      -DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS}
      -DCMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}
    BUILD_ALWAYS ON  # its own build knows what has changed
    BUILD_BYPRODUCTS "${library}"
    INSTALL_COMMAND ""
    USES_TERMINAL_BUILD ON)
endforeach()

# Installs the levels' libraries under `folder`, stripped.
function(vnreg_install_hwcaps folder component)
  foreach(level IN LISTS VNREG_HWCAPS_LEVELS)
    vnreg_hwcaps_library(${level} library)
    install(CODE "
      file(INSTALL \"${library}\" FOLLOW_SYMLINK_CHAIN
        DESTINATION \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${folder}/glibc-hwcaps/${level}\")"
      COMPONENT ${component})
  endforeach()
endfunction()
