# SPDX-License-Identifier: Apache-2.0

# alidade_warnings(TARGET)
#
# Sets the warning options of all targets of this project. GCC 12 prints two false warnings. The
# first concerns overlaps in `"text" + std::string` (-Wrestrict, GCC bug 105651). The second
# concerns uninitialised members of std::regex, and occurs only with sanitizers
# (-Wmaybe-uninitialized; see -fsanitize in the manual of GCC).
function(alidade_warnings target)
  set(old_gcc $<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
    $<$<BOOL:${ALIDADE_WERROR}>:-Werror>
    $<${old_gcc}:-Wno-restrict>)
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    target_compile_options(${target} PRIVATE $<${old_gcc}:-Wno-maybe-uninitialized>)
  endif()
endfunction()
