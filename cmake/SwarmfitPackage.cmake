# `cpack -G DEB` in the build folder: one package with the library, its headers, the command and what finds them. Best with
# BUILD_SHARED_LIBS: a static library asks its users for all that is inside it.
set(CPACK_PACKAGE_NAME swarmfit)
set(CPACK_PACKAGE_VENDOR "the Swarmfit maintainers")
set(CPACK_PACKAGE_CONTACT "the Swarmfit maintainers <maintainers@swarmfit.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Robust multi-model fitting by particle swarm")
set(CPACK_PACKAGE_DESCRIPTION
"Finds all planes, lines, circles, spheres, cylinders, homographies or fundamental
matrices in data full of outliers, and from there what a robot wants to know:
which surfaces carry things, what stands on them, and what it is called.
A library for C++20, its headers, and the command swarmfit.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL Unspecified)

set(CPACK_GENERATOR DEB)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libeigen3-dev, libexpected-dev")
if(NOT BUILD_SHARED_LIBS)
  string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", libfmt-dev, libhwy-dev, liblzf-dev, libopencv-dev, libspng-dev, libtbb-dev, libturbojpeg0-dev, pkgconf")
  if(SWARMFIT_GLSLANG_TARGETS)
    string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", glslang-dev, spirv-tools")
  endif()
endif()
if(SWARMFIT_VULKAN)
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libvulkan1")
endif()
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBS_POLICY =)
include(CPack)
