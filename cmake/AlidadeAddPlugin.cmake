# SPDX-License-Identifier: Apache-2.0

# alidade_add_plugin(NAME SOURCES file... [CPP] [FOLDER folder] [LIBRARIES target...])
#
# Builds a plugin that alidade loads at run time. Symbols have hidden visibility, and no
# instruction-set flags are set. A C-ABI plugin, which provides models, needs only the headers. With
# CPP, builds a C++ plugin, which provides sources or estimators. The C++ plugin links
# alidade::core, and only an alidade with the same ABI number loads it. alidade searches only the
# folder `plugins`, which is the default of FOLDER. It loads plugins of other folders on demand.
#
# A plugin without optimisation is many times slower. If neither CMAKE_BUILD_TYPE nor
# CMAKE_CXX_FLAGS sets an optimisation level, the plugin is compiled with -O2.
function(alidade_add_plugin name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "CPP" "FOLDER" "SOURCES;LIBRARIES")
  if(NOT arg_FOLDER)
    set(arg_FOLDER plugins)
  endif()
  add_library(${name} MODULE ${arg_SOURCES})
  set_target_properties(${name} PROPERTIES
    PREFIX "" OUTPUT_NAME "alidade_${name}"
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
    LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/alidade/${arg_FOLDER}
    ALIDADE_FOLDER ${arg_FOLDER})
  if(NOT CMAKE_CXX_FLAGS MATCHES "(^| )-O")
    target_compile_options(${name} PRIVATE $<$<CONFIG:>:-O2>)
  endif()
  if(arg_CPP)
    target_link_libraries(${name} PRIVATE alidade::core ${arg_LIBRARIES})
  else()
    target_link_libraries(${name} PRIVATE alidade::model ${arg_LIBRARIES})
  endif()
endfunction()
