# Takes the C++ of a Markdown file apart, for a program that includes it:
#
#   cmake -DMARKDOWN=docs/files.md -DCOUNT=1 -DOUTPUT=blocks/files -P code_blocks.cmake
#
# writes, of the n-th block ```cpp from 0, its #include lines to files_n_includes.inc and all other
# lines to files_n_code.inc. Compilers give places in the Markdown file. COUNT is how many blocks
# there have to be, so that none is left out.
file(READ ${MARKDOWN} rest)
# CMake takes these apart where it makes lists.
string(REPLACE "[" "@open@" rest "${rest}")
string(REPLACE "]" "@close@" rest "${rest}")
string(REPLACE ";" "@semicolon@" rest "${rest}")
string(REPLACE "\\" "@backslash@" rest "${rest}")
string(REPLACE "\n" ";" lines "${rest}")

set(count 0)
set(number 0)
set(in_block FALSE)
foreach(line IN LISTS lines)
  math(EXPR number "${number} + 1")
  if(in_block AND line STREQUAL "```")
    set(in_block FALSE)
    foreach(part includes code)
      string(REPLACE "@open@" "[" ${part} "${${part}}")
      string(REPLACE "@close@" "]" ${part} "${${part}}")
      string(REPLACE "@semicolon@" ";" ${part} "${${part}}")
      string(REPLACE "@backslash@" "\\" ${part} "${${part}}")
      file(WRITE ${OUTPUT}_${count}_${part}.inc "${${part}}")
    endforeach()
    math(EXPR count "${count} + 1")
  elseif(in_block)
    set(part code)
    if(line MATCHES "^#include")
      set(part includes)
    endif()
    string(APPEND ${part} "#line ${number} \"${MARKDOWN}\"\n${line}\n")
  elseif(line STREQUAL "```cpp")
    set(in_block TRUE)
    set(includes "")
    set(code "")
  endif()
endforeach()
if(NOT count EQUAL COUNT)
  message(FATAL_ERROR "${MARKDOWN} has ${count} blocks of C++, and tests/readme compiles ${COUNT}")
endif()
