# FCL's objects hold Eigen matrices whose alignment depends on -march. Finds the alignment that this
# build has, for a header that compares it with the user's.
function(fcl_fibers_find_eigen_alignment result)
  get_target_property(eigen_include Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
  # What was found is kept for these flags only.
  string(MD5 flags "${CMAKE_CXX_COMPILER} ${CMAKE_CXX_FLAGS}")
  foreach(bytes 0 16 32 64)
    file(WRITE ${PROJECT_BINARY_DIR}/eigen_alignment.cpp
      "#include <Eigen/Core>\nstatic_assert(EIGEN_MAX_STATIC_ALIGN_BYTES == ${bytes}, \"\");\n"
      "int main() {}\n")
    try_compile(fcl_fibers_eigen_alignment_is_${bytes}_${flags} ${PROJECT_BINARY_DIR}/eigen_alignment
      ${PROJECT_BINARY_DIR}/eigen_alignment.cpp
      CMAKE_FLAGS "-DINCLUDE_DIRECTORIES=${eigen_include}"
      CXX_STANDARD 17)
    if(fcl_fibers_eigen_alignment_is_${bytes}_${flags})
      set(${result} ${bytes} PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "Eigen's alignment is none of 0, 16, 32 and 64 bytes")
endfunction()
