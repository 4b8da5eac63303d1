# Writes files into a program as constants: cmake -DOUTPUT=... -DFILES=a;b -P embed.cmake makes
# OUTPUT.h and OUTPUT.cpp, in which `viewer.js` is `embedded::viewer_js`.
set(header "#pragma once\n\n#include <string_view>\n\nnamespace fcl_fibers::tools::embedded {\n\n")
set(source "#include \"embedded.h\"\n\nnamespace fcl_fibers::tools::embedded {\n\n")
foreach(file ${FILES})
  get_filename_component(name ${file} NAME)
  string(MAKE_C_IDENTIFIER ${name} name)
  file(READ ${file} bytes HEX)
  string(REGEX REPLACE "(..)" "'\\\\x\\1'," bytes "${bytes}")
  string(APPEND header "extern const std::string_view ${name};\n")
  string(APPEND source "static const char ${name}_bytes[] = {${bytes}};\n"
    "const std::string_view ${name}(${name}_bytes, sizeof ${name}_bytes);\n\n")
endforeach()
file(WRITE ${OUTPUT}.h "${header}\n}\n")
file(WRITE ${OUTPUT}.cpp "${source}}\n")
