# Install rules and what others find the library by: find_package(swarmfit), pkg-config swarmfit, a ROS workspace's package.xml.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/swarmfit)

install(TARGETS swarmfit EXPORT swarmfitTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
if(SWARMFIT_BUILD_CLI)
  install(TARGETS swarmfit_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  if(TARGET swarmfit_terminal_files)
    set(terminal ${PROJECT_BINARY_DIR}/terminal)
    # OPTIONAL: a build of some targets alone may have written none of them.
    install(FILES ${terminal}/swarmfit.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL)
    install(FILES ${terminal}/swarmfit.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME swarmfit OPTIONAL)
    # Zsh looks in the first; Debian's, for what packages bring, in the second.
    install(FILES ${terminal}/_swarmfit DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions OPTIONAL)
    install(FILES ${terminal}/_swarmfit DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions OPTIONAL)
    install(FILES ${terminal}/swarmfit.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d OPTIONAL)
  endif()
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/host/include/swarmfit DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

install(EXPORT swarmfitTargets NAMESPACE swarmfit:: DESTINATION ${package_dir})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/swarmfitConfig.cmake.in ${PROJECT_BINARY_DIR}/swarmfitConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/swarmfitConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/swarmfitConfig.cmake ${PROJECT_BINARY_DIR}/swarmfitConfigVersion.cmake
              ${CMAKE_CURRENT_LIST_DIR}/SwarmfitImageFiles.cmake DESTINATION ${package_dir})

# pkg-config: who links a static library links what is inside it, too.
file(RELATIVE_PATH SWARMFIT_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" SWARMFIT_PC_PREFIX "${SWARMFIT_PC_PREFIX}")
list(TRANSFORM SWARMFIT_OPENCV_TARGETS PREPEND " -l" OUTPUT_VARIABLE inside)
if(SWARMFIT_GLSLANG_TARGETS)
  set(glslang " -lSPIRV -lglslang -lMachineIndependent -lOSDependent -lOGLCompiler -lGenericCodeGen"
              " -lglslang-default-resource-limits -lSPIRV-Tools-opt -lSPIRV-Tools")
endif()
string(JOIN "" inside " -lfmt -ltbb -lhwy -llzf -lspng -lturbojpeg" ${inside} ${glslang} " -ldl -lpthread -lstdc++ -lm")
if(BUILD_SHARED_LIBS)
  set(SWARMFIT_PC_LIBS)
  set(SWARMFIT_PC_LIBS_PRIVATE "${inside}")
else()
  set(SWARMFIT_PC_LIBS "${inside}")
  set(SWARMFIT_PC_LIBS_PRIVATE)
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/swarmfit.pc.in ${PROJECT_BINARY_DIR}/swarmfit.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/swarmfit.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

file(READ ${PROJECT_SOURCE_DIR}/package.xml manifest)
if(NOT manifest MATCHES "<version>${PROJECT_VERSION}</version>")
  message(FATAL_ERROR "package.xml must hold <version>${PROJECT_VERSION}</version>, as version.hpp does")
endif()
install(FILES ${PROJECT_SOURCE_DIR}/package.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/swarmfit)

if(PROJECT_IS_TOP_LEVEL)
  include(SwarmfitPackage)
endif()
