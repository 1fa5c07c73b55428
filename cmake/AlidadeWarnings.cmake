# SPDX-License-Identifier: Apache-2.0

# alidade_warnings(TARGET): the warnings every target of this project is built with.
function(alidade_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           -Wno-sign-conversion $<$<BOOL:${ALIDADE_WERROR}>:-Werror>)
endfunction()
