# Writes files into a program: cmake -DOUTPUT=... -DFILES=a;b -P embed.cmake makes OUTPUT.h and
# OUTPUT.cpp, with `embeddedFiles`, their bytes by name.
set(type "const std::map<std::string_view, std::string_view>")
file(WRITE ${OUTPUT}.h "#pragma once\n\n#include <map>\n#include <string_view>\n\n"
  "namespace fcl_fibers::tools {\n\nextern ${type} embeddedFiles;\n\n}\n")
set(entries "")
set(source "#include \"embedded.h\"\n\nnamespace fcl_fibers::tools {\n\n")
foreach(file ${FILES})
  get_filename_component(name ${file} NAME)
  string(MAKE_C_IDENTIFIER ${name} constant)
  file(READ ${file} bytes HEX)
  string(REGEX REPLACE "(..)" "'\\\\x\\1'," bytes "${bytes}")
  string(APPEND source "static const char ${constant}[] = {${bytes}};\n")
  string(APPEND entries "  {\"${name}\", {${constant}, sizeof ${constant}}},\n")
endforeach()
file(WRITE ${OUTPUT}.cpp "${source}\n${type} embeddedFiles = {\n${entries}};\n\n}\n")
