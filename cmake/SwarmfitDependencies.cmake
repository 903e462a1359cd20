# What the library is made of; tools/setup.sh installs all of it from Debian. swarmfitConfig.cmake.in asks for the same packages.
set(SWARMFIT_OPENCV_COMPONENTS core imgproc imgcodecs calib3d features2d flann video)

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

list(TRANSFORM SWARMFIT_OPENCV_COMPONENTS PREPEND opencv_ OUTPUT_VARIABLE SWARMFIT_OPENCV_TARGETS)
