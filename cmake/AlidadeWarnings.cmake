# SPDX-License-Identifier: Apache-2.0

# alidade_warnings(TARGET): the warnings every target of this project is built with. GCC 12 finds
# overlaps in `"text" + std::string` that are not there (-Wrestrict, GCC bug 105651).
function(alidade_warnings target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
    $<$<BOOL:${ALIDADE_WERROR}>:-Werror>
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>)
endfunction()
