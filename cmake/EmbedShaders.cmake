# GLSL to SPIR-V to C++ arrays, by glslang. Editing an include rebuilds the shaders that use it.
find_program(SWARMFIT_GLSLANG NAMES glslangValidator glslang REQUIRED DOC "glslang's command-line compiler")

# swarmfit_embed_shaders(target name=source[,definition...]...): target's include folder holds embedded/<name>.h, each defining `<name>_spirv`.
function(swarmfit_embed_shaders target)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/generated)
  file(MAKE_DIRECTORY ${folder}/embedded)
  set(headers)
  foreach(item IN LISTS ARGN)
    string(REPLACE "=" ";" item "${item}")
    list(POP_FRONT item name)
    string(REPLACE "," ";" definitions "${item}")
    list(POP_FRONT definitions shader)
    list(TRANSFORM definitions PREPEND -D)
    set(header ${folder}/embedded/${name}.h)
    add_custom_command(
      OUTPUT ${header}
      COMMAND ${SWARMFIT_GLSLANG} --quiet --target-env vulkan1.1 ${definitions} -I${CMAKE_CURRENT_SOURCE_DIR} -I${folder}
              --depfile ${header}.d --vn ${name}_spirv -o ${header} ${CMAKE_CURRENT_SOURCE_DIR}/${shader}
      DEPENDS ${shader}
      DEPFILE ${header}.d
      COMMENT "Compiling ${shader} to ${name}"
      VERBATIM)
    list(APPEND headers ${header})
  endforeach()
  add_custom_target(${target}_headers DEPENDS ${headers})
  add_library(${target} INTERFACE)
  add_dependencies(${target} ${target}_headers)
  target_include_directories(${target} INTERFACE ${folder})
endfunction()

# Writes models.glsl (the residual of a model by its number) and embedded/shader_models.h (the names, for C++ to check).
function(swarmfit_write_models_glsl folder models)
  set(includes "")
  set(cases "")
  set(names "")
  set(number 0)
  foreach(model IN LISTS models)
    string(APPEND includes "#include \"models/${model}.glsl\"\n")
    string(APPEND cases "    case ${number}: return ${model}(x, k);\n")
    string(APPEND names "\"${model}\", ")
    math(EXPR number "${number} + 1")
  endforeach()
  file(CONFIGURE OUTPUT ${folder}/models.glsl @ONLY CONTENT "// Written by CMake from shaders/CMakeLists.txt.
@includes@
vec4 residuals(uint model, const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {
  switch (model) {
@cases@    default: return vec4(0.0);
  }
}
")
  file(CONFIGURE OUTPUT ${folder}/embedded/shader_models.h @ONLY CONTENT "// Written by CMake from shaders/CMakeLists.txt.
#pragma once
inline constexpr const char* kShaderModels[] = {@names@};
")
endfunction()

# swarmfit_write_glsl_sources(folder file...): embedded/glsl_sources.h, the files' text for a compiler at run time.
function(swarmfit_write_glsl_sources folder)
  set(entries "")
  foreach(file IN LISTS ARGN)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    file(READ ${CMAKE_CURRENT_SOURCE_DIR}/${file} text)
    string(APPEND entries "    {\"${file}\", R\"glsl(${text})glsl\"},\n")
  endforeach()
  file(CONFIGURE OUTPUT ${folder}/embedded/glsl_sources.h @ONLY CONTENT "// Written by CMake from shaders/CMakeLists.txt.
#pragma once
inline constexpr GlslSource kGlslSources[] = {
@entries@};
")
endfunction()
