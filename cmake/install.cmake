include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/fcl_fibers)

# install_library(COMPONENT TARGET HEADER...): installs a library as this component of find_package, and
# its headers, which are under include/fcl_fibers of the sources or of the build.
set(components)
function(install_library component target)
  foreach(header ${ARGN})
    set(path ${PROJECT_SOURCE_DIR}/include/fcl_fibers/${header})
    if(NOT EXISTS ${path})
      set(path ${PROJECT_BINARY_DIR}/include/fcl_fibers/${header})
    endif()
    get_filename_component(folder fcl_fibers/${header} DIRECTORY)
    install(FILES ${path} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder})
  endforeach()
  set(export fcl_fibers-${component}-targets)
  install(TARGETS ${target} EXPORT ${export})
  install(EXPORT ${export} NAMESPACE fcl_fibers:: DESTINATION ${package_dir})
  set(components ${components} ${component} PARENT_SCOPE)
endfunction()

install_library(tree fcl_fibers_tree
  contact.h fiber_options.h fiber_polylines.h fiber_questions.h fiber_tree.h live_pairs.h shapes.h
  tree_export.h triangle_mesh.h version.h)
if(FCL_FIBERS_BUILD_MANAGERS)
  install_library(managers fcl_fibers
    contact_collector.h eigen_alignment.h export.h
    fiber_collision_manager.h fiber_manager_options.h fiber_objects.h
    impact_collector.h layered_aabb_tree_collision_manager.h shadow_manager.h
    wrapped_sphere_tree_collision_manager.h)
endif()
if(FCL_FIBERS_BUILD_IO)
  install_library(io fcl_fibers_io
    io/export.h io/export_geometry.h io/fiber_file.h io/mesh_file.h io/sampling.h)
endif()
if(FCL_FIBERS_BUILD_BENCHMARKS)
  install_library(benchmark fcl_fibers_benchmark
    benchmark/export.h benchmark/judge.h benchmark/managers.h benchmark/scenes.h)
endif()
install(FILES ${PROJECT_SOURCE_DIR}/package.xml
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fcl_fibers)
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
# The prefix is relative, so an installed tree may be moved.
file(RELATIVE_PATH prefix_from_pc /prefix/${pc_dir} /prefix)
# install_pc(NAME DESCRIPTION LIBS REQUIRES)
function(install_pc name description libs requires)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/fcl_fibers.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${pc_dir})
endfunction()

set(tree_libs)
set(tree_packages)
set(io_packages fcl_fibers_tree)
# These are not in Requires.private, because pkg-config wants those even for shared libraries.
if(NOT BUILD_SHARED_LIBS)
  set(tree_libs "-pthread")
  set(tree_packages "libhwy tbb")
  string(APPEND io_packages " pugixml zlib")
endif()
install_pc(fcl_fibers_tree "${PROJECT_DESCRIPTION}" "${tree_libs}" "${tree_packages}")
if(FCL_FIBERS_BUILD_MANAGERS)
  # This names FCL's library, not its fcl.pc: Debian's adds -std=c++11, which is too old.
  set(fcl_flags -lfcl)
  get_target_property(fcl_location fcl LOCATION)
  get_filename_component(fcl_dir "${fcl_location}" DIRECTORY)
  if(NOT fcl_dir IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES)
    set(fcl_flags "-L${fcl_dir} -lfcl")
  endif()
  install_pc(fcl_fibers "Managers of FCL's interface for fibers" "${fcl_flags}"
    "fcl_fibers_tree ccd eigen3 octomap")
endif()
if(FCL_FIBERS_BUILD_IO)
  install_pc(fcl_fibers_io "Readers and writers of fiber files" "" "${io_packages}")
endif()

if(FCL_FIBERS_BUILD_BENCHMARKS)
  set(benchmark_packages "fcl_fibers fcl_fibers_io")
  if(NOT BUILD_SHARED_LIBS)
    string(APPEND benchmark_packages " benchmark")
  endif()
  install_pc(fcl_fibers_benchmark "Benchmark of broad phases on scenes of fibers" ""
    "${benchmark_packages}")
endif()

# --- colcon and catkin ---

# colcon knows a plain CMake package by its package.xml; ament also needs a marker.
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
# dpkg-shlibdeps finds what the libraries need. This lists what the headers need, and what programs
# need to link the static libraries.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(depends)
if(FCL_FIBERS_BUILD_MANAGERS)
  list(APPEND depends libfcl-dev libeigen3-dev)
endif()
if(NOT BUILD_SHARED_LIBS)
  list(APPEND depends libhwy-dev libtbb-dev)
  if(FCL_FIBERS_BUILD_IO)
    list(APPEND depends libpugixml-dev zlib1g-dev)
  endif()
  if(FCL_FIBERS_BUILD_BENCHMARKS)
    list(APPEND depends libbenchmark-dev)
  endif()
endif()
list(JOIN depends ", " CPACK_DEBIAN_PACKAGE_DEPENDS)
# Debian wants the licence under this name, in a folder of the package.
configure_file(${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_BINARY_DIR}/debian/copyright COPYONLY)
set(CPACK_INSTALLED_DIRECTORIES
  ${PROJECT_BINARY_DIR}/debian
  ${CPACK_PACKAGING_INSTALL_PREFIX}/share/doc/${CPACK_DEBIAN_PACKAGE_NAME})
include(CPack)
