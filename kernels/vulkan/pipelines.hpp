// The compute pipelines, made when first asked for.
#pragma once

#include <compare>
#include <cstdint>
#include <map>

#include "kernels/fitness_evaluator.hpp"
#include "kernels/vulkan/own_shaders.hpp"
#include "kernels/vulkan/pipeline_cache.hpp"

namespace swarmfit::kernels::vulkan {

enum class Shader : std::uint32_t { cost, reduce, distances, assign, bound, select, cost_pruned, reduce_pruned, cost_batch, reduce_batch };

/// What a pipeline is specialised for; see shaders/layout.h.
struct Specialisation {
  Shader shader = Shader::cost;
  std::uint32_t group = 1;
  std::uint32_t model = 0;
  std::uint32_t loss = 0;
  std::uint32_t dimension = 3;
  std::uint32_t tile = 4;
  std::uint32_t work = 1;
  std::uint32_t span = 32;
  auto operator<=>(const Specialisation&) const = default;
};

class Pipelines {
 public:
  /// Throws std::exception.
  Pipelines(const Device& device, const std::filesystem::path& cache_folder);
  ~Pipelines();
  Pipelines(const Pipelines&) = delete;
  Pipelines& operator=(const Pipelines&) = delete;

  /// From now on these, in place of the shaders that have the built-in models. Before the first get. Throws std::exception.
  void use(const OwnShaders& own);

  vk::Pipeline get(const Specialisation& wanted);
  vk::PipelineLayout layout() const noexcept { return *layout_; }
  vk::DescriptorSetLayout set_layout() const noexcept { return *set_layout_; }

 private:
  const Device& device_;
  PipelineCache cache_;
  vk::raii::DescriptorSetLayout set_layout_;
  vk::raii::PipelineLayout layout_;
  std::vector<vk::raii::ShaderModule> modules_;
  std::map<Specialisation, vk::raii::Pipeline> pipelines_;
};

/// Whether shaders/CMakeLists.txt lists this built-in kind, at its number.
bool has_shader(ModelKind kind) noexcept;

}  // namespace swarmfit::kernels::vulkan
