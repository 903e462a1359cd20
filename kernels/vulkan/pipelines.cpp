#include "kernels/vulkan/pipelines.hpp"

#include <array>
#include <iterator>
#include <span>
#include <string_view>

#include "shaders/layout.h"

namespace swarmfit::kernels::vulkan {
namespace {

#include "embedded/assign.h"
#include "embedded/assign_texels.h"
#include "embedded/bound.h"
#include "embedded/bound_texels.h"
#include "embedded/cost.h"
#include "embedded/cost_batch.h"
#include "embedded/cost_batch_texels.h"
#include "embedded/cost_pruned.h"
#include "embedded/cost_pruned_texels.h"
#include "embedded/cost_texels.h"
#include "embedded/distances.h"
#include "embedded/distances_texels.h"
#include "embedded/reduce.h"
#include "embedded/reduce_batch.h"
#include "embedded/reduce_batch_texels.h"
#include "embedded/reduce_pruned.h"
#include "embedded/reduce_pruned_texels.h"
#include "embedded/reduce_texels.h"
#include "embedded/select.h"
#include "embedded/select_texels.h"
#include "embedded/shader_models.h"

using Spirv = std::span<const std::uint32_t>;

Spirv spirv(Shader shader, bool texels) {
  switch (shader) {
    case Shader::cost: return texels ? Spirv(cost_texels_spirv) : Spirv(cost_spirv);
    case Shader::reduce: return texels ? Spirv(reduce_texels_spirv) : Spirv(reduce_spirv);
    case Shader::distances: return texels ? Spirv(distances_texels_spirv) : Spirv(distances_spirv);
    case Shader::bound: return texels ? Spirv(bound_texels_spirv) : Spirv(bound_spirv);
    case Shader::select: return texels ? Spirv(select_texels_spirv) : Spirv(select_spirv);
    case Shader::cost_pruned: return texels ? Spirv(cost_pruned_texels_spirv) : Spirv(cost_pruned_spirv);
    case Shader::reduce_pruned: return texels ? Spirv(reduce_pruned_texels_spirv) : Spirv(reduce_pruned_spirv);
    case Shader::cost_batch: return texels ? Spirv(cost_batch_texels_spirv) : Spirv(cost_batch_spirv);
    case Shader::reduce_batch: return texels ? Spirv(reduce_batch_texels_spirv) : Spirv(reduce_batch_spirv);
    case Shader::assign: break;
  }
  return texels ? Spirv(assign_texels_spirv) : Spirv(assign_spirv);
}

vk::raii::DescriptorSetLayout make_set_layout(const Device& device) {
  std::array<vk::DescriptorSetLayoutBinding, layout::kBindingCount> bindings;
  for (std::uint32_t i = 0; i < bindings.size(); ++i) {
    const auto type = i < layout::kStorageBindings ? vk::DescriptorType::eStorageBuffer : vk::DescriptorType::eUniformTexelBuffer;
    bindings[i] = vk::DescriptorSetLayoutBinding(i, type, 1, vk::ShaderStageFlagBits::eCompute);
  }
  return vk::raii::DescriptorSetLayout(device.handle(), vk::DescriptorSetLayoutCreateInfo({}, bindings));
}

vk::raii::PipelineLayout make_layout(const Device& device, vk::DescriptorSetLayout sets) {
  const vk::PushConstantRange push(vk::ShaderStageFlagBits::eCompute, 0, sizeof(layout::Push));
  return vk::raii::PipelineLayout(device.handle(), vk::PipelineLayoutCreateInfo({}, sets, push));
}

}  // namespace

bool has_shader(ModelKind kind) noexcept {
  const auto number = static_cast<std::size_t>(kind);
  return number < std::size(kShaderModels) && traits(kind).name == kShaderModels[number];
}

Pipelines::Pipelines(const Device& device, const std::filesystem::path& cache_folder)
    : device_(device), cache_(device, cache_folder), set_layout_(make_set_layout(device)), layout_(make_layout(device, *set_layout_)) {
  for (const Shader shader : {Shader::cost, Shader::reduce, Shader::distances, Shader::assign, Shader::bound, Shader::select,
                              Shader::cost_pruned, Shader::reduce_pruned, Shader::cost_batch, Shader::reduce_batch}) {
    const Spirv code = spirv(shader, device.traits().texels);
    modules_.emplace_back(device.handle(), vk::ShaderModuleCreateInfo({}, code.size_bytes(), code.data()));
  }
}

Pipelines::~Pipelines() {
  if (!pipelines_.empty()) cache_.save();
}

void Pipelines::use(const OwnShaders& own) {
  const auto replace = [&](Shader shader, Spirv code) {
    modules_[static_cast<std::size_t>(shader)] =
        vk::raii::ShaderModule(device_.handle(), vk::ShaderModuleCreateInfo({}, code.size_bytes(), code.data()));
  };
  replace(Shader::cost, own.cost);
  replace(Shader::distances, own.distances);
  replace(Shader::assign, own.assign);
}

vk::Pipeline Pipelines::get(const Specialisation& wanted) {
  const auto found = pipelines_.find(wanted);
  if (found != pipelines_.end()) return *found->second;

  std::array<std::uint32_t, layout::kSpecCount> values{};
  values[layout::kSpecGroup] = wanted.group;
  values[layout::kSpecModel] = wanted.model;
  values[layout::kSpecLoss] = wanted.loss;
  values[layout::kSpecDimension] = wanted.dimension;
  values[layout::kSpecTile] = wanted.tile;
  values[layout::kSpecWork] = wanted.work;
  values[layout::kSpecSpan] = wanted.span;
  std::array<vk::SpecializationMapEntry, layout::kSpecCount> entries;
  for (std::uint32_t i = 0; i < entries.size(); ++i) entries[i] = vk::SpecializationMapEntry(i, i * 4, 4);
  const vk::SpecializationInfo constants(static_cast<std::uint32_t>(entries.size()), entries.data(), sizeof values, values.data());
  const vk::raii::ShaderModule& module = modules_[static_cast<std::size_t>(wanted.shader)];
  const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module, "main", &constants);
  vk::raii::Pipeline made(device_.handle(), cache_.handle(), vk::ComputePipelineCreateInfo({}, stage, *layout_));
  return *pipelines_.emplace(wanted, std::move(made)).first->second;
}

}  // namespace swarmfit::kernels::vulkan
