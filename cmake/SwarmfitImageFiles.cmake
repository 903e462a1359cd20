# PkgConfig::SWARMFIT_IMAGE_FILES: PNG and JPEG. Neither library has a CMake package everywhere, both have a .pc file. Installed, too: who
# links a static libswarmfit finds them in the same way.
if(NOT TARGET PkgConfig::SWARMFIT_IMAGE_FILES)
  find_package(PkgConfig QUIET)
  if(NOT PkgConfig_FOUND)
    message(FATAL_ERROR "swarmfit finds libspng and libturbojpeg by pkg-config, which was not found (Debian: pkgconf)")
  endif()
  pkg_check_modules(SWARMFIT_IMAGE_FILES QUIET IMPORTED_TARGET GLOBAL "spng >= 0.7" "libturbojpeg >= 2.0")
  if(NOT SWARMFIT_IMAGE_FILES_FOUND)
    message(FATAL_ERROR "swarmfit reads and writes images through spng >= 0.7 and libturbojpeg >= 2.0, and pkg-config does not find both "
                        "(Debian: libspng-dev libturbojpeg0-dev)")
  endif()
endif()
