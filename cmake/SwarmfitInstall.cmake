# Install rules and the exported package: find_package(swarmfit) gives swarmfit::swarmfit.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/swarmfit)

install(TARGETS swarmfit EXPORT swarmfitTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
if(SWARMFIT_BUILD_CLI)
  install(TARGETS swarmfit_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/host/include/swarmfit DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

install(EXPORT swarmfitTargets NAMESPACE swarmfit:: DESTINATION ${package_dir})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/swarmfitConfig.cmake.in ${PROJECT_BINARY_DIR}/swarmfitConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/swarmfitConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/swarmfitConfig.cmake ${PROJECT_BINARY_DIR}/swarmfitConfigVersion.cmake DESTINATION ${package_dir})
