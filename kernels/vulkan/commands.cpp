#include "kernels/vulkan/commands.hpp"

#include <algorithm>
#include <array>

#include "shaders/layout.h"

namespace swarmfit::kernels::vulkan {
namespace {

static_assert(kMaxCoefficients <= static_cast<int>(layout::kKindSlot) && kMaxDimension == static_cast<int>(layout::kMaxColumns));
static_assert(static_cast<std::uint32_t>(Loss::truncated_l1) == layout::kLossL1);
static_assert(static_cast<std::uint32_t>(Loss::truncated_l2) == layout::kLossL2);

using Stage = vk::PipelineStageFlagBits;
using Access = vk::AccessFlagBits;

constexpr std::size_t kPartialsLimit = std::size_t{256} << 20;  // bytes for all partial sums
constexpr std::size_t kRowFloats = 64;  // rows of costs start 256 bytes apart, the largest alignment Vulkan may ask for
constexpr std::size_t kMostRecorded = 64;
constexpr std::size_t kLowerHead = 4;  // words before the lower bounds

/// Words of work that a pruned swarm may leave (shaders/layout.h). Tiles hold four models at least, and spans are whole tiles of four.
std::size_t work_words(std::size_t chunks, std::size_t models) { return layout::kWorkHead + chunks * (models + 2 * (models / 4 + 1)); }
/// Models whose work fits so many bytes.
std::size_t most_open(std::size_t bytes, std::size_t chunks) {
  const std::size_t words = bytes / sizeof(std::uint32_t) / std::max<std::size_t>(chunks, 1);
  constexpr std::size_t kRest = layout::kWorkHead + 2;
  return words > kRest ? (words - kRest) * 2 / 3 : 1;
}

void wait_for(const vk::raii::CommandBuffer& commands, vk::AccessFlags access, vk::PipelineStageFlags stage) {
  const vk::MemoryBarrier written(Access::eShaderWrite, access);
  commands.pipelineBarrier(Stage::eComputeShader, stage, {}, written, {}, {});
}

}  // namespace

void Commands::bind(Cloud& cloud, int dimension) {
  cloud_ = &cloud;
  dimension_ = dimension;
  recorded_.clear();
  room_ = 0;
  cost_sets_.clear();
  map_sets_.clear();
  if (!cloud.segments().empty()) make_sets();
}

void Commands::make_sets() {
  const auto segments = static_cast<std::uint32_t>(cloud_->segments().size());
  const std::array sizes{
      vk::DescriptorPoolSize(vk::DescriptorType::eStorageBuffer, 2 * segments * layout::kStorageBindings),
      vk::DescriptorPoolSize(vk::DescriptorType::eUniformTexelBuffer, 2 * segments * (layout::kBindingCount - layout::kStorageBindings))};
  pool_ = vk::raii::DescriptorPool(device_.handle(),
                                   vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 2 * segments, sizes));
  const std::vector<vk::DescriptorSetLayout> layouts(segments, pipelines_.set_layout());
  cost_sets_ = vk::raii::DescriptorSets(device_.handle(), vk::DescriptorSetAllocateInfo(*pool_, layouts));
  map_sets_ = vk::raii::DescriptorSets(device_.handle(), vk::DescriptorSetAllocateInfo(*pool_, layouts));
}

std::size_t Commands::swarm_limit() const {
  const DeviceTraits& traits = device_.traits();
  std::size_t sums = 0;
  for (const Segment& segment : cloud_->segments()) sums += segment.sums;
  const std::size_t largest = cloud_->segments().empty() ? 1 : cloud_->segments().front().sums;
  std::size_t limit = std::min(traits.storage_range / kModelBytes, traits.storage_range / (sizeof(float) * largest));
  limit = std::min(limit, kPartialsLimit / (sizeof(float) * std::max<std::size_t>(sums, 1)));
  limit = std::min<std::size_t>({limit, traits.grid_limit[0], traits.grid_limit[1]});
  if (cloud_->bounded()) {
    std::uint32_t most = 0;
    for (const Segment& segment : cloud_->segments()) most = std::max(most, segment.chunks);
    limit = std::min(limit, most_open(traits.storage_range, most));
  }
  const std::size_t tile = largest_tile(traits);
  return std::max(limit / tile, std::size_t{1}) * tile;
}

std::span<float> Commands::coefficients(std::size_t models) {
  // Rows beyond the swarm pad its last tile.
  const std::size_t rows = models + largest_tile(device_.traits());
  if (coefficients_.reserve(device_, rows * kModelBytes, Residence::upload)) room_ = 0;
  return coefficients_.as<float>();
}

void Commands::reserve_particles(std::uint32_t particles) {
  if (particles <= room_) return;
  recorded_.clear();
  cost_stride_ = (particles + kRowFloats - 1) / kRowFloats * kRowFloats;
  costs_.reserve(device_, sizeof(float) * cost_stride_ * cloud_->segments().size(), Residence::readback);
  for (Segment& segment : cloud_->segments()) {
    segment.partials.reserve(device_, sizeof(float) * particles * segment.sums, Residence::device);
  }
  lower_.resize(cloud_->segments().size());
  for (Buffer& lower : lower_) lower.reserve(device_, sizeof(float) * (kLowerHead + particles), Residence::readback);
  work_.resize(cloud_->bounded() ? cloud_->segments().size() : 0);
  for (std::size_t s = 0; s < work_.size(); ++s) {
    work_[s].reserve(device_, sizeof(std::uint32_t) * work_words(cloud_->segments()[s].chunks, particles), Residence::device);
  }
  room_ = particles;
  bind_costs();
}

void Commands::bind_costs() {
  for (std::size_t s = 0; s < cost_sets_.size(); ++s) {
    const Segment& segment = cloud_->segments()[s];
    bind_set(*cost_sets_[s], segment, segment.caps, segment.partials);
    const vk::DescriptorBufferInfo costs(costs_.handle(), sizeof(float) * cost_offset(s), sizeof(float) * cost_stride_);
    // A cloud without bounds has something in their place, which no shader looks at.
    const Buffer& bounds = cloud_->bounded() ? segment.bounds : lower_[s];
    const Buffer& work = cloud_->bounded() ? work_[s] : lower_[s];
    const std::array<vk::DescriptorBufferInfo, 4> buffers{
        {costs, {bounds.handle(), 0, VK_WHOLE_SIZE}, {lower_[s].handle(), 0, VK_WHOLE_SIZE}, {work.handle(), 0, VK_WHOLE_SIZE}}};
    device_.handle().updateDescriptorSets(
        vk::WriteDescriptorSet(*cost_sets_[s], layout::kBindCosts, 0, vk::DescriptorType::eStorageBuffer, {}, buffers), {});
  }
}

void Commands::bind_map(bool own_tolerance) {
  for (std::size_t s = 0; s < map_sets_.size(); ++s) {
    const Segment& segment = cloud_->segments()[s];
    bind_set(*map_sets_[s], segment, own_tolerance ? segment.tolerance : segment.caps, segment.output);
  }
}

void Commands::bind_set(vk::DescriptorSet set, const Segment& segment, const Buffer& caps, const Buffer& out) const {
  const std::array<vk::DescriptorBufferInfo, 4> buffers{{{segment.points.handle(), 0, VK_WHOLE_SIZE},
                                                         {caps.handle(), 0, VK_WHOLE_SIZE},
                                                         {coefficients_.handle(), 0, VK_WHOLE_SIZE},
                                                         {out.handle(), 0, VK_WHOLE_SIZE}}};
  device_.handle().updateDescriptorSets(
      vk::WriteDescriptorSet(set, layout::kBindPoints, 0, vk::DescriptorType::eStorageBuffer, {}, buffers), {});
  if (!device_.traits().texels) return;
  const std::array views{segment.points.texels(), caps.texels(), coefficients_.texels(), out.texels()};
  device_.handle().updateDescriptorSets(
      vk::WriteDescriptorSet(set, layout::kBindPointTexels, 0, vk::DescriptorType::eUniformTexelBuffer, {}, {}, views), {});
}

/// dispatch(segment's number) with each segment's cost set bound.
template <class Dispatch>
void Commands::record_each(const vk::raii::CommandBuffer& commands, vk::Pipeline pipeline, std::uint32_t models,
                           Dispatch&& dispatch) const {
  const vk::PipelineLayout layout = pipelines_.layout();
  commands.bindPipeline(vk::PipelineBindPoint::eCompute, pipeline);
  for (std::size_t s = 0; s < cost_sets_.size(); ++s) {
    const Segment& segment = cloud_->segments()[s];
    const layout::Push push{segment.stride, segment.sums, models, 0, segment.known.stride(), segment.chunks};
    commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, layout, 0, *cost_sets_[s], {});
    commands.pushConstants<layout::Push>(layout, vk::ShaderStageFlagBits::eCompute, 0, push);
    dispatch(s);
  }
}

vk::raii::CommandBuffer Commands::record_costs(ModelKind kind, Loss loss, const TileShape& shape) const {
  const auto dimension = static_cast<std::uint32_t>(dimension_);
  const ChunkShape& chunk = cloud_->shape();
  const vk::Pipeline cost = pipelines_.get(
      {Shader::cost, chunk.group, static_cast<std::uint32_t>(kind), static_cast<std::uint32_t>(loss), dimension, shape.tile, chunk.work});
  const vk::Pipeline reduce = pipelines_.get({.shader = Shader::reduce, .group = reduce_group(device_.traits())});

  vk::raii::CommandBuffer commands = device_.allocate_commands();
  commands.begin(vk::CommandBufferBeginInfo());
  record_each(commands, cost, 0, [&](std::size_t s) { commands.dispatch(cloud_->segments()[s].chunks, shape.tiles, 1); });
  wait_for(commands, Access::eShaderRead, Stage::eComputeShader);
  record_each(commands, reduce, 0, [&](std::size_t) { commands.dispatch(shape.padded(), 1, 1); });
  wait_for(commands, Access::eHostRead, Stage::eHost);
  commands.end();
  return commands;
}

vk::raii::CommandBuffer Commands::record_pruned(ModelKind kind, Loss loss, const TileShape& shape, std::size_t models) const {
  const ChunkShape& chunk = cloud_->shape();
  const std::uint32_t span = span_shape(models);
  Specialisation wanted{.shader = Shader::bound,
                        .group = reduce_group(device_.traits()),
                        .model = static_cast<std::uint32_t>(kind),
                        .loss = static_cast<std::uint32_t>(loss),
                        .dimension = static_cast<std::uint32_t>(dimension_)};
  const vk::Pipeline bound = pipelines_.get(wanted);
  const vk::Pipeline reduce = pipelines_.get({.shader = Shader::reduce_pruned, .group = reduce_group(device_.traits())});
  wanted.shader = Shader::select;
  wanted.tile = shape.tile;
  wanted.span = span;
  const vk::Pipeline select = pipelines_.get(wanted);
  wanted.shader = Shader::cost_pruned;
  wanted.group = chunk.group;
  wanted.work = chunk.work;
  const vk::Pipeline cost = pipelines_.get(wanted);

  vk::raii::CommandBuffer commands = device_.allocate_commands();
  commands.begin(vk::CommandBufferBeginInfo());
  const auto count = static_cast<std::uint32_t>(models);
  record_each(commands, bound, count, [&](std::size_t) { commands.dispatch(count, 1, 1); });
  wait_for(commands, Access::eShaderRead | Access::eShaderWrite, Stage::eComputeShader);
  record_each(commands, select, count, [&](std::size_t s) {
    commands.dispatch(cloud_->segments()[s].known.stride() / layout::kQuad, (count + span - 1) / span, 1);
  });
  wait_for(commands, Access::eShaderRead | Access::eShaderWrite | Access::eIndirectCommandRead,
           Stage::eComputeShader | Stage::eDrawIndirect);
  record_each(commands, cost, count, [&](std::size_t s) { commands.dispatchIndirect(work_[s].handle(), 0); });
  wait_for(commands, Access::eShaderRead, Stage::eComputeShader);
  record_each(commands, reduce, count, [&](std::size_t) { commands.dispatch(count, 1, 1); });
  wait_for(commands, Access::eHostRead, Stage::eHost);
  commands.end();
  return commands;
}

template <class Record>
void Commands::run_costs(const Key& key, std::span<float> costs, Record&& record) {
  auto commands = recorded_.find(key);
  if (commands == recorded_.end()) {
    if (recorded_.size() >= kMostRecorded) recorded_.clear();
    commands = recorded_.emplace(key, record()).first;
  }
  device_.run(*commands->second);
  const std::span<const float> rows = costs_.as<const float>();
  for (std::size_t j = 0; j < costs.size(); ++j) {
    double sum = 0;
    for (std::size_t s = 0; s < cost_sets_.size(); ++s) sum += static_cast<double>(rows[cost_offset(s) + j]);
    costs[j] = static_cast<float>(sum);
  }
}

void Commands::costs(ModelKind kind, int coefficients, Loss loss, std::span<float> costs) {
  const TileShape shape = tile_shape(device_.traits(), costs.size(), coefficients);
  reserve_particles(shape.padded());
  run_costs({kind, loss, shape.tile, shape.tiles, 0}, costs, [&] { return record_costs(kind, loss, shape); });
}

std::uint64_t Commands::pruned_costs(ModelKind kind, int coefficients, Loss loss, std::span<float> costs) {
  // Full tiles, but for a small swarm: how many particles are open is known on the device alone.
  const TileShape shape = tile_shape(device_.traits(), std::min<std::size_t>(costs.size(), largest_tile(device_.traits())), coefficients);
  reserve_particles(static_cast<std::uint32_t>(costs.size()));
  for (Buffer& lower : lower_) lower.as<std::uint32_t>()[0] = 0;
  run_costs({kind, loss, shape.tile, 0, costs.size()}, costs, [&] { return record_pruned(kind, loss, shape, costs.size()); });
  std::uint64_t pairs = 0;
  for (const Buffer& lower : lower_) pairs += lower.as<const std::uint32_t>()[0];
  return pairs * cloud_->shape().points();
}

void Commands::distances(ModelKind kind) {
  Specialisation wanted{.shader = Shader::distances, .group = cloud_->shape().group, .model = static_cast<std::uint32_t>(kind)};
  wanted.dimension = static_cast<std::uint32_t>(dimension_);
  run_map(wanted, 1, 0);
}

void Commands::assign(std::uint32_t kind, std::size_t models, float tolerance) {
  Specialisation wanted{.shader = Shader::assign, .group = cloud_->shape().group, .model = kind};
  wanted.dimension = static_cast<std::uint32_t>(dimension_);
  run_map(wanted, models, tolerance);
}

void Commands::run_map(const Specialisation& wanted, std::size_t models, float tolerance) {
  for (Segment& segment : cloud_->segments()) segment.output.reserve(device_, sizeof(float) * segment.stride, Residence::readback);
  bind_map(tolerance < 0);
  const vk::PipelineLayout layout = pipelines_.layout();
  if (!*once_) once_ = device_.allocate_commands();
  once_.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
  once_.bindPipeline(vk::PipelineBindPoint::eCompute, pipelines_.get(wanted));
  for (std::size_t s = 0; s < map_sets_.size(); ++s) {
    const Segment& segment = cloud_->segments()[s];
    const layout::Push push{segment.stride, segment.sums, static_cast<std::uint32_t>(models), tolerance, 0, 0};
    once_.bindDescriptorSets(vk::PipelineBindPoint::eCompute, layout, 0, *map_sets_[s], {});
    once_.pushConstants<layout::Push>(layout, vk::ShaderStageFlagBits::eCompute, 0, push);
    once_.dispatch((segment.stride / layout::kQuad + wanted.group - 1) / wanted.group, 1, 1);
  }
  wait_for(once_, Access::eHostRead, Stage::eHost);
  once_.end();
  device_.run(*once_);
}

}  // namespace swarmfit::kernels::vulkan
