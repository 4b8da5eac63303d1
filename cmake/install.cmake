include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/fcl_fibers)

install(TARGETS fcl_fibers fcl_fibers_scenes EXPORT fcl_fibers-targets)
install(EXPORT fcl_fibers-targets NAMESPACE fcl_fibers:: DESTINATION ${package_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ ${PROJECT_BINARY_DIR}/include/
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES ${PROJECT_SOURCE_DIR}/package.xml ${PROJECT_SOURCE_DIR}/data/loop.csv
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fcl_fibers)

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
