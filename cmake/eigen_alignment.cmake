# FCL's objects hold Eigen matrices. Their alignment depends on -march, and so does the alignment of
# memory that Eigen allocates. This finds the value that `macro` has in this build, for a header that
# compares it with the value in the user's build.
function(fcl_fibers_find_eigen_alignment macro result)
  get_target_property(eigen_include Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
  # Conan names the folder for this build type only.
  set(CMAKE_TRY_COMPILE_CONFIGURATION ${CMAKE_BUILD_TYPE})
  # The result is kept for these flags only.
  string(MD5 flags "${CMAKE_CXX_COMPILER} ${CMAKE_CXX_FLAGS}")
  foreach(bytes 16 32 64 128 0)
    set(found fcl_fibers_${macro}_is_${bytes}_${flags})
    file(WRITE ${PROJECT_BINARY_DIR}/eigen_alignment.cpp
      "#include <Eigen/Core>\nstatic_assert(${macro} == ${bytes}, \"\");\nint main() {}\n")
    try_compile(${found} ${PROJECT_BINARY_DIR}/eigen_alignment
      ${PROJECT_BINARY_DIR}/eigen_alignment.cpp
      CMAKE_FLAGS "-DINCLUDE_DIRECTORIES=${eigen_include}"
      CXX_STANDARD 17)
    if(${found})
      set(${result} ${bytes} PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "Eigen's ${macro} is not 0, 16, 32, 64 or 128 with the flags of this build. Check that a "
    "program which includes <Eigen/Core> compiles with them")
endfunction()
