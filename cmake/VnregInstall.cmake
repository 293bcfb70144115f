# What is installed, how other projects find it, and the Debian packages that hold it:
# libvnreg (the shared library), libvnreg-dev (headers, static library, CMake and pkg-config files)
# and vnreg (the program and the models).
include(CMakePackageConfigHelpers)

set(cmake_dir "${CMAKE_INSTALL_LIBDIR}/cmake/vnreg")

foreach(kind shared static)
  if(TARGET vnreg_${kind})
    install(TARGETS vnreg_${kind} EXPORT vnreg_${kind}
      LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
    install(EXPORT vnreg_${kind} FILE vnregTargets-${kind}.cmake NAMESPACE vnreg::
      DESTINATION "${cmake_dir}" COMPONENT development)
  endif()
endforeach()
if(VNREG_HWCAPS)
  vnreg_install_hwcaps(${CMAKE_INSTALL_LIBDIR} runtime)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/engine/include/vnreg TYPE INCLUDE COMPONENT development)

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/vnregConfig.cmake.in vnregConfig.cmake
  INSTALL_DESTINATION "${cmake_dir}")
# Before 1.0 a minor version may change the API.
write_basic_package_version_file(vnregConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/vnregConfig.cmake"
              "${CMAKE_CURRENT_BINARY_DIR}/vnregConfigVersion.cmake"
        DESTINATION "${cmake_dir}" COMPONENT development)

# Relative, so that the installed tree may move.
file(RELATIVE_PATH VNREG_PC_TO_PREFIX
  "/prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/prefix")
configure_file(${CMAKE_CURRENT_LIST_DIR}/vnreg.pc.in vnreg.pc @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/vnreg.pc"
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT development)
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE"
        DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME vnreg)
set(CPACK_PACKAGE_CONTACT "the vnreg authors <vnreg@example.org>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL runtime development)
if(VNREG_BUILD_CLI)
  list(APPEND CPACK_COMPONENTS_ALL program)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# Where the program's own library is found before it is installed.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}/engine")
set(soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME libvnreg${soversion})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "Point cloud registration: the shared library")
# Other packages' dependencies come from these; the name has a digit before the dash.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libvnreg-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libvnreg${soversion} (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Point cloud registration: headers and static library")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME vnreg)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "libvnreg${soversion} (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "Point cloud registration: the program vnreg and its models")
include(CPack)
