# SPDX-License-Identifier: Apache-2.0

# Installs the components `estimation` and `testing`, for programs that define a filter in C++. The
# components contain the library, the headers of the shipped models, and the package that
# find_package(alidade) reads.
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/alidade)
set(plugin_folder ${CMAKE_INSTALL_LIBDIR}/alidade/plugins)

install(TARGETS alidade_model alidade_estimation EXPORT alidadeEstimationTargets
        COMPONENT estimation
        LIBRARY NAMELINK_COMPONENT estimation
        FILE_SET HEADERS COMPONENT estimation)
install(TARGETS alidade_testing EXPORT alidadeTestingTargets
        FILE_SET HEADERS COMPONENT testing)
foreach(folder IN ITEMS motion_models sensors)
  install(DIRECTORY ${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/alidade/${folder}
          COMPONENT estimation FILES_MATCHING PATTERN "*.h")
endforeach()

install(EXPORT alidadeEstimationTargets NAMESPACE alidade:: DESTINATION ${package_folder}
        COMPONENT estimation)
install(EXPORT alidadeTestingTargets NAMESPACE alidade:: DESTINATION ${package_folder}
        COMPONENT testing)
configure_package_config_file(cmake/alidadeConfig.cmake.in alidadeConfig.cmake
                              INSTALL_DESTINATION ${package_folder}
                              PATH_VARS plugin_folder)
write_basic_package_version_file(alidadeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/alidadeConfig.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/alidadeConfigVersion.cmake
              cmake/AlidadeAddPlugin.cmake
        DESTINATION ${package_folder} COMPONENT estimation)
install(FILES LICENSE TYPE DOC COMPONENT estimation)
