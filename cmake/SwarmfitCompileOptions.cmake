# Warnings, sanitizers: one interface target that every one of our targets links privately.
add_library(swarmfit_compile_options INTERFACE)
target_compile_options(swarmfit_compile_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
  $<$<BOOL:${SWARMFIT_WARNINGS_AS_ERRORS}>:-Werror>
  # GCC 12 sees an overlap in "a" + std::string that is not there (its bug 105651).
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
  # A cost must not depend on what the optimiser felt like contracting.
  -ffp-contract=off)
if(SWARMFIT_SANITIZE)
  target_compile_options(swarmfit_compile_options INTERFACE
    -fsanitize=${SWARMFIT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
    # GCC 12 warns of std::regex under sanitizers, without cause.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_link_options(swarmfit_compile_options INTERFACE -fsanitize=${SWARMFIT_SANITIZE})
  if(SWARMFIT_SANITIZE MATCHES address)
    target_sources(swarmfit_compile_options INTERFACE
      $<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:${PROJECT_SOURCE_DIR}/tests/keep_libraries.cpp>)
  endif()
endif()
