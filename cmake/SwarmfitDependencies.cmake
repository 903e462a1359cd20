# What the library is made of; tools/setup.sh installs all of it from Debian. swarmfitConfig.cmake.in asks for the same packages.
set(SWARMFIT_OPENCV_COMPONENTS core imgproc calib3d features2d flann video)

find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(hwy REQUIRED)
find_package(fmt REQUIRED)
find_package(tl-expected REQUIRED)
find_package(OpenCV REQUIRED COMPONENTS ${SWARMFIT_OPENCV_COMPONENTS})
find_package(liblzf REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(nanoflann REQUIRED)
if(SWARMFIT_VULKAN)
  find_package(Vulkan REQUIRED)
endif()

# As a library, for models that users bring along as GLSL at run time.
set(SWARMFIT_GLSLANG_TARGETS)
if(SWARMFIT_VULKAN)
  find_package(glslang CONFIG QUIET)
  if(TARGET glslang::SPIRV AND TARGET glslang::glslang-default-resource-limits)
    find_package(SPIRV-Tools CONFIG QUIET)
    find_package(SPIRV-Tools-opt CONFIG QUIET)
    set(SWARMFIT_GLSLANG_TARGETS glslang::SPIRV glslang::glslang-default-resource-limits)
  else()
    message(STATUS "Models that users bring along will not run on Vulkan: glslang's library was not found (glslang-dev)")
  endif()
endif()

include(SwarmfitImageFiles)

list(TRANSFORM SWARMFIT_OPENCV_COMPONENTS PREPEND opencv_ OUTPUT_VARIABLE SWARMFIT_OPENCV_TARGETS)
