# SPDX-License-Identifier: Apache-2.0

# alidade_unity(TARGET COUNT SANITIZED)
#
# If ALIDADE_UNITY is set, compiles up to COUNT sources of a folder as one translation unit. The
# compiler then reads each header once and instantiates each template once, which saves a quarter to
# a third of the CPU time. If sanitizers are used, SANITIZED replaces COUNT, because each source
# then needs twice the memory. Without sanitizers, GCC may use 1 GiB before it collects garbage,
# which saves a tenth of the time.
function(alidade_unity target count sanitized)
  if(NOT ALIDADE_UNITY)
    return()
  endif()
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    set(count ${sanitized})
  else()
    target_compile_options(${target} PRIVATE
      $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1048576>)
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  set(last "")
  foreach(source IN LISTS sources)
    cmake_path(GET source PARENT_PATH folder)
    if(NOT folder STREQUAL last)
      set(index 0)
    endif()
    set(last ${folder})
    cmake_path(GET folder FILENAME room)
    math(EXPR group "${index} / ${count}")
    math(EXPR index "${index} + 1")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${room}_${group})
  endforeach()
endfunction()

# alidade_add_library(NAME SOURCES file... HEADERS file...)
#
# Adds the shared library libalidade-NAME of this folder, as the target alidade::NAME. The library
# exports only the names in exports.map. HEADERS are the installed headers, relative to the folder.
function(alidade_add_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;HEADERS")
  set(target alidade_${name})
  set(exports ${PROJECT_SOURCE_DIR}/cmake/exports.map)
  add_library(${target} SHARED ${arg_SOURCES})
  add_library(alidade::${name} ALIAS ${target})
  target_sources(${target} PUBLIC
    FILE_SET HEADERS BASE_DIRS ${CMAKE_CURRENT_SOURCE_DIR} FILES ${arg_HEADERS})
  set_target_properties(${target} PROPERTIES
    OUTPUT_NAME alidade-${name} EXPORT_NAME ${name} VERSION ${PROJECT_VERSION} SOVERSION 0
    LINK_DEPENDS ${exports} INSTALL_RPATH "$ORIGIN")
  alidade_warnings(${target})
  alidade_unity(${target} 40 4)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_link_options(${target} PRIVATE -Wl,--version-script=${exports})
  target_compile_definitions(${target} PRIVATE ALIDADE_VERSION="${PROJECT_VERSION}")
endfunction()
