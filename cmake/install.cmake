include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/fcl_fibers)

set(libraries fcl_fibers)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ ${PROJECT_BINARY_DIR}/include/
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  PATTERN scenes EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/package.xml
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fcl_fibers)
if(FCL_FIBERS_BUILD_SCENES)
  list(APPEND libraries fcl_fibers_scenes)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/fcl_fibers/scenes
    ${PROJECT_BINARY_DIR}/include/fcl_fibers/scenes
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/fcl_fibers)
  install(FILES ${PROJECT_SOURCE_DIR}/data/loop.csv
    DESTINATION ${CMAKE_INSTALL_DATADIR}/fcl_fibers)
endif()
install(TARGETS ${libraries} EXPORT fcl_fibers-targets)
install(EXPORT fcl_fibers-targets NAMESPACE fcl_fibers:: DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/CITATION.cff
  DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(
  ${CMAKE_CURRENT_LIST_DIR}/fcl_fibers-config.cmake.in
  ${PROJECT_BINARY_DIR}/fcl_fibers-config.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/fcl_fibers-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/fcl_fibers-config.cmake
  ${PROJECT_BINARY_DIR}/fcl_fibers-config-version.cmake
  DESTINATION ${package_dir})

# --- pkg-config ---

set(pc_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
# Relative, so that an installed tree may be moved.
file(RELATIVE_PATH prefix_from_pc /prefix/${pc_dir} /prefix)
set(fcl_flags -lfcl)
get_target_property(fcl_location fcl LOCATION)
get_filename_component(fcl_dir "${fcl_location}" DIRECTORY)
if(NOT fcl_dir IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES)
  set(fcl_flags "-L${fcl_dir} -lfcl")
endif()
set(required_packages "ccd eigen3 octomap")
set(required_scenes_packages fcl_fibers)
# Not Requires.private, which pkg-config wants to see installed for shared libraries too.
if(NOT BUILD_SHARED_LIBS)
  string(APPEND fcl_flags " -pthread")
  string(APPEND required_packages " libhwy tbb")
  string(APPEND required_scenes_packages " pugixml zlib")
endif()
foreach(package ${libraries})
  configure_file(${CMAKE_CURRENT_LIST_DIR}/${package}.pc.in ${PROJECT_BINARY_DIR}/${package}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${package}.pc DESTINATION ${pc_dir})
endforeach()

# --- colcon and catkin ---

# A plain CMake package is known by package.xml, and to ament by a marker as well.
file(WRITE ${PROJECT_BINARY_DIR}/ament_marker "")
install(FILES ${PROJECT_BINARY_DIR}/ament_marker RENAME fcl_fibers
  DESTINATION ${CMAKE_INSTALL_DATADIR}/ament_index/resource_index/packages)

# --- Debian ---

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The fcl_fibers authors <maintainers@fcl-fibers.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_NAME libfcl-fibers-dev)
set(CPACK_DEBIAN_PACKAGE_SECTION libdevel)
# What the libraries need is found by dpkg-shlibdeps; this is what the headers need, and what links
# the static libraries.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libfcl-dev, libeigen3-dev")
if(NOT BUILD_SHARED_LIBS)
  string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", libhwy-dev, libtbb-dev")
  if(FCL_FIBERS_BUILD_SCENES)
    string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", libpugixml-dev, zlib1g-dev")
  endif()
endif()
# Debian wants the licence under this name, in a folder of the package's.
configure_file(${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_BINARY_DIR}/debian/copyright COPYONLY)
set(CPACK_INSTALLED_DIRECTORIES
  ${PROJECT_BINARY_DIR}/debian
  ${CPACK_PACKAGING_INSTALL_PREFIX}/share/doc/${CPACK_DEBIAN_PACKAGE_NAME})
include(CPack)
