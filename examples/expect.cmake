# Runs a program whose output, both streams together, has to be that of a file, and which has to end
# with CODE, by default 0:
#
#   cmake -DOUTPUT=FILE [-DCODE=1] -P expect.cmake -- PROGRAM ARGUMENTS...
#
# In the file, <number> stands for a number that varies. With -DEXPECTED=REGEX in place of a file,
# the output has to match that.
if(NOT DEFINED CODE)
  set(CODE 0)
endif()
set(command)
set(is_command FALSE)
math(EXPR last "${CMAKE_ARGC} - 1")
foreach(i RANGE ${last})
  if(is_command)
    list(APPEND command "${CMAKE_ARGV${i}}")
  elseif("${CMAKE_ARGV${i}}" STREQUAL "--")
    set(is_command TRUE)
  endif()
endforeach()
if(DEFINED OUTPUT)
  file(READ "${OUTPUT}" EXPECTED)
  string(REGEX REPLACE "([][+.*?()|^$\\\\])" "\\\\\\1" EXPECTED "${EXPECTED}")
  string(REPLACE "<number>" "-?[0-9.]+" EXPECTED "^${EXPECTED}$")
endif()

execute_process(COMMAND ${command} OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE code)
message("${said}")
# A signal is told by name.
if(NOT "${code}" STREQUAL "${CODE}")
  message(FATAL_ERROR "ends with ${code} instead of ${CODE}")
endif()
if(NOT "${said}" MATCHES "${EXPECTED}")
  message(FATAL_ERROR "the output is not that of ${OUTPUT}, or does not match ${EXPECTED}")
endif()
