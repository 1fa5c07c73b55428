# SPDX-License-Identifier: Apache-2.0

# Installs everything that AlidadeInstallEstimation does not install: the program, the libraries
# core and tools, and the plugins. Uses the variables package_folder and plugin_folder of that file.

# Sets the variable with the name `result` to the plugin targets that `folder` and its subfolders
# define.
function(alidade_plugins_of folder result)
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  set(plugins)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "MODULE_LIBRARY")
      list(APPEND plugins ${target})
    endif()
  endforeach()
  get_property(subfolders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(subfolder IN LISTS subfolders)
    alidade_plugins_of(${subfolder} subfolder_plugins)
    list(APPEND plugins ${subfolder_plugins})
  endforeach()
  set(${result} ${plugins} PARENT_SCOPE)
endfunction()

file(RELATIVE_PATH bin_to_lib /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})
set_target_properties(alidade PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
install(TARGETS alidade)
install(TARGETS alidade_core alidade_tools EXPORT alidadeTargets FILE_SET HEADERS)

foreach(folder IN ITEMS motion_models sensors plugins)
  alidade_plugins_of(${PROJECT_SOURCE_DIR}/${folder} plugins)
  # C++ plugins link the library. The path to the library is relative, so the library and the
  # plugins can be moved together.
  set_target_properties(${plugins} PROPERTIES INSTALL_RPATH "$ORIGIN/../..")
  foreach(plugin IN LISTS plugins)
    get_target_property(subfolder ${plugin} ALIDADE_FOLDER)
    install(TARGETS ${plugin} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/alidade/${subfolder})
  endforeach()
endforeach()

install(EXPORT alidadeTargets NAMESPACE alidade:: DESTINATION ${package_folder})
