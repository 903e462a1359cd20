# SWARMFIT_TEST_ENVIRONMENT: properties of every test that may list Vulkan devices.
# The software driver leaks a little. Unloaded, it takes the names of its frames along and tools/lsan.supp knows them no more: keep it in.
set(SWARMFIT_TEST_ENVIRONMENT)
if(SWARMFIT_SANITIZE MATCHES address)
  find_library(SWARMFIT_SOFTWARE_DRIVER vulkan_lvp)
  execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=libasan.so
                  OUTPUT_VARIABLE SWARMFIT_ASAN_RUNTIME OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(SWARMFIT_SOFTWARE_DRIVER)
    set(SWARMFIT_TEST_ENVIRONMENT ENVIRONMENT LD_PRELOAD=${SWARMFIT_ASAN_RUNTIME}:${SWARMFIT_SOFTWARE_DRIVER})
  endif()
endif()
