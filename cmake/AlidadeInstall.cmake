# SPDX-License-Identifier: Apache-2.0

# Installs the program, the library, the headers of core and of the shipped models, the plugins,
# and the package that find_package(alidade) reads.
include(CMakePackageConfigHelpers)

# The plugins that `folder` and the folders below it define.
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
    alidade_plugins_of(${subfolder} below)
    list(APPEND plugins ${below})
  endforeach()
  set(${result} ${plugins} PARENT_SCOPE)
endfunction()

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/alidade)
set(plugin_folder ${CMAKE_INSTALL_LIBDIR}/alidade/plugins)

file(RELATIVE_PATH bin_to_lib /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})
set_target_properties(alidade PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
install(TARGETS alidade)
# The component `estimation` is of use alone.
install(TARGETS alidade_model alidade_estimation EXPORT alidadeEstimationTargets
        COMPONENT estimation
        LIBRARY NAMELINK_COMPONENT estimation
        FILE_SET HEADERS COMPONENT estimation)
install(TARGETS alidade_testing EXPORT alidadeTestingTargets
        FILE_SET HEADERS COMPONENT testing)
install(TARGETS alidade_core alidade_tools EXPORT alidadeTargets FILE_SET HEADERS)

foreach(folder IN ITEMS motion_models sensors plugins)
  alidade_plugins_of(${PROJECT_SOURCE_DIR}/${folder} plugins)
  # C++ plugins link the library; both may move together.
  set_target_properties(${plugins} PROPERTIES INSTALL_RPATH "$ORIGIN/../..")
  foreach(plugin IN LISTS plugins)
    get_target_property(beside ${plugin} ALIDADE_FOLDER)
    install(TARGETS ${plugin} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/alidade/${beside})
  endforeach()
endforeach()

foreach(folder IN ITEMS motion_models sensors)
  install(DIRECTORY ${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/alidade/${folder}
          COMPONENT estimation FILES_MATCHING PATTERN "*.h")
endforeach()

install(EXPORT alidadeEstimationTargets NAMESPACE alidade:: DESTINATION ${package_folder}
        COMPONENT estimation)
install(EXPORT alidadeTestingTargets NAMESPACE alidade:: DESTINATION ${package_folder}
        COMPONENT testing)
install(EXPORT alidadeTargets NAMESPACE alidade:: DESTINATION ${package_folder})
configure_package_config_file(cmake/alidadeConfig.cmake.in alidadeConfig.cmake
                              INSTALL_DESTINATION ${package_folder}
                              PATH_VARS plugin_folder)
write_basic_package_version_file(alidadeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/alidadeConfig.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/alidadeConfigVersion.cmake
              cmake/AlidadeAddPlugin.cmake
        DESTINATION ${package_folder} COMPONENT estimation)
install(FILES LICENSE TYPE DOC)
