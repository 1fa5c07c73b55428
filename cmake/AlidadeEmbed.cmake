# SPDX-License-Identifier: Apache-2.0

# alidade_embed(TARGET NAME FILE HEADER)
#
# Adds the text of FILE to TARGET as alidade::internal::NAME, which HEADER declares. The first line,
# which contains the licence, is omitted. If FILE changes, CMake configures the project again.
function(alidade_embed target name file header)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  file(READ ${file} text)
  string(FIND "${text}" "\n" end)
  string(SUBSTRING "${text}" ${end} -1 text)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/embedded/${name}.cc)
  file(GENERATE OUTPUT ${source} CONTENT "// Made from ${file}.
#include \"${header}\"
const char* const alidade::internal::${name} = R\"embedded(${text})embedded\";
")
  target_sources(${target} PRIVATE ${source})
endfunction()
