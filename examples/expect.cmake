# Runs a program that has to say EXPECTED, a regular expression, and to end with CODE, by default 0:
#
#   cmake -DEXPECTED=REGEX [-DCODE=1] -P expect.cmake -- PROGRAM ARGUMENTS...
#
# With a test's PASS_REGULAR_EXPRESSION alone its exit code would not count.
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
execute_process(COMMAND ${command} OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE code)
message("${said}")
# A signal is told by name.
if(NOT "${code}" STREQUAL "${CODE}")
  message(FATAL_ERROR "ends with ${code} instead of ${CODE}")
endif()
if(NOT "${said}" MATCHES "${EXPECTED}")
  message(FATAL_ERROR "does not say ${EXPECTED}")
endif()
