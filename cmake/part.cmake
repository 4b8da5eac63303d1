# Declares a part of the build as a cache variable: ON, OFF, or AUTO, which is ON if CMake finds all that
# the part needs. Afterwards the variable named by `part` is ON or OFF.
#
#   fcl_fibers_part(PART DOC [DEFAULT VALUE] [WHEN VARIABLE...] [PARTS PART...] [PACKAGES PACKAGE...]
#     [TARGETS TARGET...])
#
# DEFAULT   the value until the user sets one; AUTO if it is not given
# WHEN      variables; AUTO is OFF unless all are true
# PARTS     the parts that it needs, declared before
# PACKAGES  the packages that it needs: a name, or a string of all arguments of find_package
# TARGETS   targets that it needs and that one of these packages may lack
function(fcl_fibers_part part doc)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "DEFAULT" "WHEN;PARTS;PACKAGES;TARGETS")
  if(NOT DEFINED arg_DEFAULT)
    set(arg_DEFAULT AUTO)
  endif()
  set(${part} ${arg_DEFAULT} CACHE STRING "${doc}: ON, OFF, or AUTO, which is ON if CMake finds what it needs")
  set_property(CACHE ${part} PROPERTY STRINGS AUTO ON OFF)
  string(TOUPPER "${${part}}" wanted)
  if(wanted STREQUAL "AUTO")
    foreach(condition ${arg_WHEN})
      if(NOT ${condition})
        set(wanted OFF)
      endif()
    endforeach()
  endif()
  if(NOT wanted)
    set(${part} OFF PARENT_SCOPE)
    return()
  endif()

  set(missing)
  foreach(package ${arg_PACKAGES})
    separate_arguments(package UNIX_COMMAND "${package}")
    find_package(${package} QUIET)
    list(GET package 0 package)
    if(NOT ${package}_FOUND)
      list(APPEND missing ${package})
    endif()
  endforeach()
  foreach(target ${arg_TARGETS})
    string(REGEX REPLACE "::.*" "" package ${target})
    if(NOT TARGET ${target} AND NOT package IN_LIST missing)
      list(APPEND missing ${target})
    endif()
  endforeach()
  foreach(other ${arg_PARTS})
    if(NOT ${other})
      list(APPEND missing ${other})
    endif()
  endforeach()

  set(${part} ON PARENT_SCOPE)
  if(missing)
    list(JOIN missing ", " missing)
    if(NOT wanted STREQUAL "AUTO")
      message(FATAL_ERROR "${part}=${${part}} needs what CMake has not found: ${missing}. Install it, add its "
        "folder to CMAKE_PREFIX_PATH, or set ${part}=OFF")
    endif()
    message(STATUS "${part} is OFF, because CMake has not found ${missing}")
    set(${part} OFF PARENT_SCOPE)
  endif()
endfunction()
