# SPDX-License-Identifier: Apache-2.0

# alidade_warnings(TARGET): the warnings every target of this project is built with. GCC 12 finds
# overlaps in `"text" + std::string` that are not there (-Wrestrict, GCC bug 105651), and under the
# sanitizers uninitialised members of std::regex (-Wmaybe-uninitialized; -fsanitize in its manual).
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
