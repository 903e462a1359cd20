#include "kernels/vulkan/own_shaders.hpp"

#include <fmt/format.h>

#ifdef SWARMFIT_HAVE_GLSLANG

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>

namespace swarmfit::kernels::vulkan {
namespace {

struct GlslSource {
  std::string_view name, text;
};

#include "embedded/glsl_sources.h"

std::string_view source(std::string_view name) {
  for (const GlslSource& file : kGlslSources) {
    if (file.name == name) return file.text;
  }
  return {};
}

/// In place of the models.glsl that the build writes: the user's function, and four points of it. What is no number is out of any reach.
std::string models_glsl(const OwnModel& own) {
  const auto point = [&](char lane) {
    std::string columns;
    for (int d = 0; d < own.dimension; ++d) columns += fmt::format("{}x[{}].{}", d > 0 ? ", " : "", d, lane);
    return fmt::format("residual(vec{}({}), p)", own.dimension, columns);
  };
  return fmt::format(
      "{}\n"
      "#line 1 2\n"
      "vec4 residuals(uint model, const vec4 x[kMaxColumns], const float k[kCoefficientStride]) {{\n"
      "  float p[{}];\n"
      "  [[unroll]] for (uint i = 0; i < {}; ++i) p[i] = k[i];\n"
      "  const vec4 four = vec4({}, {}, {}, {});\n"
      "  return uintBitsToFloat(min(floatBitsToUint(four) & 0x7FFFFFFFu, uvec4(kInfinityBits)));\n"
      "}}\n",
      own.glsl, own.parameter_count, own.parameter_count, point('x'), point('y'), point('z'), point('w'));
}

/// Only what is embedded can be included.
class Includer final : public glslang::TShader::Includer {
 public:
  Includer(std::string_view name, std::string models) : name_(name), models_(std::move(models)) {}

  IncludeResult* includeLocal(const char* header, const char*, std::size_t) override {
    const bool own = std::string_view(header) == "models.glsl";
    const std::string_view text = own ? std::string_view(models_) : source(header);
    if (text.data() == nullptr) return nullptr;
    return new IncludeResult(own ? name_ : std::string(header), text.data(), text.size(), nullptr);
  }
  void releaseInclude(IncludeResult* result) override { delete result; }

 private:
  std::string name_, models_;
};

/// glslang's process-wide tables, while one of these lives.
struct Compiler {
  Compiler() { glslang::InitializeProcess(); }
  ~Compiler() { glslang::FinalizeProcess(); }
  Compiler(const Compiler&) = delete;
  Compiler& operator=(const Compiler&) = delete;
};

/// The lines of the log that name an error, in one.
std::string errors_of(const char* log) {
  std::string told;
  for (std::string_view rest(log); !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    constexpr std::string_view kError = "ERROR: ";
    if (!line.starts_with(kError) || line.find("compilation terminated") != line.npos || line.find("compilation errors") != line.npos)
      continue;
    told += (told.empty() ? "" : "; ") + std::string(line.substr(kError.size()));
  }
  while (!told.empty() && told.back() == ' ') told.pop_back();
  return told.empty() ? std::string(log) : told;
}

Result<std::vector<std::uint32_t>> compile(std::string_view file, const OwnModel& own, const std::string& models, bool texels) {
  constexpr int kVulkan = 110, kGlsl = 450;
  glslang::TShader shader(EShLangCompute);
  const std::string_view text = source(file);
  const char* string = text.data();
  const int length = static_cast<int>(text.size());
  const std::string name(file);
  const char* names = name.c_str();
  shader.setStringsWithLengthsAndNames(&string, &length, &names, 1);
  shader.setPreamble(texels ? "#define SWARMFIT_TEXELS 1\n" : "");
  shader.setEnvInput(glslang::EShSourceGlsl, EShLangCompute, glslang::EShClientVulkan, kVulkan);
  shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_1);
  shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_3);
  Includer includer(own.name, models);
  const auto refuse = [&](const char* log) {
    return fail(Failure::Kind::invalid, fmt::format("glsl of the own model {} does not compile: {}", own.name, errors_of(log)));
  };
  constexpr auto kMessages = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);
  if (!shader.parse(GetDefaultResources(), kGlsl, false, kMessages, includer)) return refuse(shader.getInfoLog());
  glslang::TProgram program;
  program.addShader(&shader);
  if (!program.link(kMessages)) return refuse(program.getInfoLog());
  std::vector<std::uint32_t> spirv;
  glslang::GlslangToSpv(*program.getIntermediate(EShLangCompute), spirv);
  return spirv;
}

}  // namespace

Result<OwnShaders> compile_own(const OwnModel& own, bool texels) {
  if (own.glsl.empty()) {
    return fail(Failure::Kind::invalid,
                fmt::format("glsl of the own model {} is empty, must define its residual for backend vulkan", own.name));
  }
  const Compiler compiler;
  const std::string models = models_glsl(own);
  OwnShaders shaders;
  const struct {
    const char* file;
    std::vector<std::uint32_t>& spirv;
  } wanted[] = {{"cost.comp", shaders.cost}, {"distances.comp", shaders.distances}, {"assign.comp", shaders.assign}};
  for (const auto& [file, spirv] : wanted) {
    auto made = compile(file, own, models, texels);
    if (!made) return tl::unexpected(made.error());
    spirv = std::move(*made);
  }
  return shaders;
}

}  // namespace swarmfit::kernels::vulkan

#else

namespace swarmfit::kernels::vulkan {

Result<OwnShaders> compile_own(const OwnModel& own, bool) {
  return fail(
      Failure::Kind::unavailable,
      fmt::format("glsl of the own model {} cannot be compiled: this build has no glslang (glslang-dev); use backend cpu", own.name));
}

}  // namespace swarmfit::kernels::vulkan

#endif
