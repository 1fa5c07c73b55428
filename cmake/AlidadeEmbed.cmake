# SPDX-License-Identifier: Apache-2.0

# alidade_embed(TARGET NAME HEADER FILE...)
#
# Adds the joined texts of the FILEs to TARGET as alidade::internal::NAME, which HEADER declares. The
# first line of each file, which contains the licence, is omitted. If a FILE changes, CMake
# configures the project again.
function(alidade_embed target name header)
  set(joined "")
  foreach(file IN LISTS ARGN)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
                 ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    file(READ ${file} text)
    string(FIND "${text}" "\n" end)
    string(SUBSTRING "${text}" ${end} -1 text)
    string(APPEND joined "${text}")
  endforeach()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/embedded/${name}.cc)
  file(GENERATE OUTPUT ${source} CONTENT "// Made from ${ARGN}.
#include \"${header}\"
const char* const alidade::internal::${name} = R\"embedded(${joined})embedded\";
")
  target_sources(${target} PRIVATE ${source})
endfunction()
