#include "kernels/vulkan/vulkan_batch.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include <fmt/format.h>

#include "kernels/checks.hpp"
#include "kernels/vulkan/guarded.hpp"
#include "kernels/vulkan/model_rows.hpp"

namespace swarmfit::kernels {
namespace vulkan {
namespace {

using Stage = vk::PipelineStageFlagBits;
using Access = vk::AccessFlagBits;

constexpr std::size_t kRowBytes = sizeof(float) * layout::kCoefficientStride;
constexpr std::size_t kSumsLimit = std::size_t{256} << 20;  // bytes of all partial sums
constexpr std::size_t kMostRecorded = 64;
constexpr std::size_t kWord = sizeof(std::uint32_t);
constexpr std::size_t kHeadBytes = 4 * kWord * layout::kBatchHead;
static_assert(layout::kBatchHeads == layout::kBatchHead * layout::kBatchDispatches);

void wait_for(const vk::raii::CommandBuffer& commands, vk::AccessFlags access, vk::PipelineStageFlags stage) {
  commands.pipelineBarrier(Stage::eComputeShader, stage, {}, vk::MemoryBarrier(Access::eShaderWrite, access), {}, {});
}

/// Nothing costs anything, but for a model that is none.
void answer_without_points(const BatchItem& item) {
  constexpr double kAnywhere[kMaxDimension] = {};
  const auto width = static_cast<std::size_t>(traits(item.swarm.kind).parameter_count);
  for (std::size_t j = 0; j < item.swarm.count; ++j) {
    float row[layout::kCoefficientStride];
    const bool finite = write_row(item.swarm.kind, item.swarm.parameters.data() + j * width, kAnywhere, row);
    item.costs[j] = finite ? 0.0F : std::numeric_limits<float>::infinity();
  }
}

}  // namespace

VulkanBatch::VulkanBatch(Opened opened, const EvaluatorOptions& options, std::size_t problems)
    : instance_(std::move(opened.instance)),
      physical_(std::move(opened.physical)),
      device_(physical_, options),
      pipelines_(device_, options.pipeline_cache),
      identity_{"vulkan", device_.traits().name} {
  problems_.reserve(problems);
  for (std::size_t p = 0; p < problems; ++p) problems_.emplace_back(options.pruning);
  const std::array sizes{vk::DescriptorPoolSize(vk::DescriptorType::eStorageBuffer, layout::kStorageBindings),
                         vk::DescriptorPoolSize(vk::DescriptorType::eUniformTexelBuffer, layout::kBindingCount - layout::kStorageBindings)};
  pool_ = vk::raii::DescriptorPool(device_.handle(),
                                   vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, sizes));
  const vk::DescriptorSetLayout layout = pipelines_.set_layout();
  set_ = std::move(vk::raii::DescriptorSets(device_.handle(), vk::DescriptorSetAllocateInfo(*pool_, layout)).front());
}

Support VulkanBatch::supports(const Workload& workload) const {
  const ModelTraits model = traits(workload.kind);
  const DeviceTraits& device = device_.traits();
  const ChunkShape chunk = chunk_shape(device, workload.points, model.dimension);
  const TileShape tile = tile_shape(device, workload.particles, model.coefficient_count);
  const std::size_t chunks = (workload.points + chunk.points() - 1) / chunk.points();
  const auto refuse = [&](const char* what, std::size_t value, std::size_t most) {
    return Support{false, fmt::format("{} of a batch's problem of {} points and {} particles are {}, must be <= {} on {}", what,
                                      workload.points, workload.particles, value, most, identity_.device)};
  };
  if (!has_shader(workload.kind)) return {false, fmt::format("{} has no shader", model.name)};
  const std::size_t groups = chunks * tile.tiles;
  if (groups > device.grid_limit[0]) return refuse("groups", groups, device.grid_limit[0]);
  const std::size_t most = std::min(device.storage_range, device.allocation_limit);
  const std::size_t sums = sizeof(float) * chunks * chunk.sums * workload.particles;
  if (sums > std::min(most, kSumsLimit)) return refuse("bytes of the partial sums", sums, std::min(most, kSumsLimit));
  const std::size_t values = sizeof(float) * chunks * chunk.points() * (static_cast<std::size_t>(model.dimension) + 1);
  if (std::bit_ceil(values) * problems_.size() > most) {
    return refuse("bytes", std::bit_ceil(values), most / problems_.size());
  }
  if (workload.particles * kRowBytes > most) return refuse("bytes of the particles", workload.particles * kRowBytes, most);
  return {};
}

Result<> VulkanBatch::set_points(std::size_t problem, const PointsView& points) {
  if (auto ok = check_problem(problem, problems_.size()); !ok) return ok;
  if (auto ok = check_points(points); !ok) return ok;
  return guarded("set_points", Failure::Kind::device, [&]() -> Result<> {
    problems_[problem].set_points(device_.traits(), points);
    return {};
  });
}

Result<> VulkanBatch::set_caps(std::size_t problem, std::span<const float> caps) {
  if (auto ok = check_problem(problem, problems_.size()); !ok) return ok;
  if (auto ok = check_caps(caps, problems_[problem].points().extent().finite); !ok) return ok;
  if (problems_[problem].dimension() == 0) return fail(Failure::Kind::invalid, "caps are set before points, must be after");
  problems_[problem].set_caps(caps);
  return {};
}

Result<> VulkanBatch::check(std::span<const BatchItem> items) const {
  if (auto ok = check_batch(items, problems_.size()); !ok) return ok;
  for (const BatchItem& item : items) {
    const BatchProblem& problem = problems_[item.problem];
    if (auto ok = check_swarm(item.swarm, problem.dimension(), item.cutoffs, item.costs); !ok) return ok;
    if (const auto support = supports({item.swarm.kind, problem.points().count(), item.swarm.count}); !support) {
      return fail(Failure::Kind::invalid, support.reason);
    }
  }
  return {};
}

Result<> VulkanBatch::evaluate(std::span<const BatchItem> items) {
  return guarded("evaluate", Failure::Kind::device, [&]() -> Result<> {
    if (auto ok = check(items); !ok) return ok;
    sort(items);
    for (std::span<const Asked> rest(asked_); !rest.empty();) {
      const std::size_t count = fitting(rest);
      submit(rest.first(count));
      rest = rest.subspan(count);
    }
    for (const BatchItem& item : items) {
      BatchProblem& problem = problems_[item.problem];
      problem.effort.evaluations += item.swarm.count;
      problem.effort.point_models += item.swarm.count * problem.points().count();
      problem.effort.touched += item.swarm.count * problem.points().count();
    }
    return {};
  });
}

void VulkanBatch::sort(std::span<const BatchItem> items) {
  asked_.clear();
  for (const BatchItem& item : items) {
    const BatchProblem& problem = problems_[item.problem];
    if (problem.chunks() == 0) answer_without_points(item);
    if (problem.chunks() == 0 || item.swarm.count == 0) continue;
    const ChunkShape& chunk = problem.points().shape();
    const TileShape tile = tile_shape(device_.traits(), item.swarm.count, traits(item.swarm.kind).coefficient_count);
    asked_.push_back({{item.swarm.kind, item.loss, chunk.work, tile.tile}, &item, problem.chunks() * chunk.sums * item.swarm.count});
  }
  std::sort(asked_.begin(), asked_.end(), [](const Asked& a, const Asked& b) { return a.order() < b.order(); });
}

std::size_t VulkanBatch::fitting(std::span<const Asked> asked) const {
  const std::size_t most = std::min(device_.traits().storage_range, device_.traits().allocation_limit);
  const std::size_t most_items = std::min<std::size_t>(device_.traits().grid_limit[1], most / (kWord * layout::kItemWords) / 2);
  std::size_t count = 0, rows = 0, sums = 0, dispatches = 0;
  for (; count < asked.size(); ++count) {
    rows += asked[count].item->swarm.count;
    sums += asked[count].sums;
    dispatches += count == 0 || asked[count].like != asked[count - 1].like ? 1 : 0;
    const bool fits = rows * kRowBytes <= most && sums * sizeof(float) <= std::min(most, kSumsLimit) && count < most_items &&
                      dispatches <= layout::kBatchDispatches;
    if (!fits) break;
  }
  return std::max<std::size_t>(count, 1);
}

/// Room for the values of every problem that is asked, in steps of two so that it seldom has to grow.
void VulkanBatch::settle_points(std::span<const Asked> asked) {
  const auto short_of_room = [&](const Asked& one) {
    const BatchProblem& problem = problems_[one.item->problem];
    return problem.floats() > problem.room();
  };
  if (std::any_of(asked.begin(), asked.end(), short_of_room)) {
    std::size_t place = 0;
    for (BatchProblem& problem : problems_) {
      // Whole chunks, so that places are whole quads.
      problem.settle(place, std::max(problem.room(), problem.floats() == 0 ? 0 : std::bit_ceil(problem.floats())));
      place += problem.room();
    }
    if (values_.reserve(device_, sizeof(float) * place, Residence::upload)) recorded_.clear();
  }
  for (const Asked& one : asked) problems_[one.item->problem].write(values_.as<float>());
}

void VulkanBatch::reserve(std::size_t rows, std::size_t sums, std::size_t items) {
  bool grown = rows_.reserve(device_, kRowBytes * rows, Residence::upload);
  grown = costs_.reserve(device_, sizeof(float) * rows, Residence::readback) || grown;
  grown = sums_.reserve(device_, sizeof(float) * std::max<std::size_t>(sums, 4), Residence::device) || grown;
  const std::size_t table = kHeadBytes * layout::kBatchDispatches + kWord * layout::kItemWords * items;
  grown = items_.reserve(device_, table, Residence::upload) || grown;
  if (grown) recorded_.clear();
}

void VulkanBatch::write_rows(std::span<const Asked> asked) {
  const std::span<float> rows = rows_.as<float>();
  std::size_t row = 0;
  for (const Asked& one : asked) {
    const SwarmView& swarm = one.item->swarm;
    const auto width = static_cast<std::size_t>(traits(swarm.kind).parameter_count);
    const double* const centre = problems_[one.item->problem].points().extent().centre;
    for (std::size_t j = 0; j < swarm.count; ++j, ++row) {
      finite_[row] = write_row(swarm.kind, swarm.parameters.data() + j * width, centre,
                               rows.subspan(row * layout::kCoefficientStride, layout::kCoefficientStride));
    }
  }
}

std::vector<VulkanBatch::Likeness> VulkanBatch::write_items(std::span<const Asked> asked) {
  const std::span<std::uint32_t> words = items_.as<std::uint32_t>();
  std::uint32_t* item = words.data() + kHeadBytes / kWord * layout::kBatchDispatches;
  std::uint32_t* head = words.data();
  std::vector<Likeness> dispatches;
  std::uint32_t row = 0, number = 0;
  std::size_t sum = 0;
  for (const Asked& one : asked) {
    const BatchProblem& problem = problems_[one.item->problem];
    const auto models = static_cast<std::uint32_t>(one.item->swarm.count);
    const auto place = static_cast<std::uint32_t>(problem.place() / layout::kQuad), column = problem.stride() / layout::kQuad;
    const std::uint32_t chunks = problem.chunks(), partials = chunks * problem.points().shape().sums;
    const std::uint32_t fields[layout::kItemWords] = {place,  column,   place + column * static_cast<std::uint32_t>(problem.dimension()),
                                                      chunks, partials, static_cast<std::uint32_t>(sum),
                                                      row,    models};
    item = std::copy(std::begin(fields), std::end(fields), item);
    if (dispatches.empty() || dispatches.back() != one.like) {
      head = words.data() + kHeadBytes / kWord * dispatches.size();
      dispatches.push_back(one.like);
      // Groups of costs, the first item, groups of the reduction; both grow below.
      const std::uint32_t empty[2 * 4] = {0, 0, 1, number, 0, 0, 1, 0};
      std::copy(std::begin(empty), std::end(empty), head);
    }
    head[0] = std::max(head[0], chunks * ((models + one.like.tile - 1) / one.like.tile));
    ++head[1];
    head[4] = std::max(head[4], models);
    ++head[5];
    row += models;
    sum += one.sums;
    ++number;
  }
  return dispatches;
}

void VulkanBatch::bind() {
  const auto whole = [](const Buffer& buffer) { return vk::DescriptorBufferInfo(buffer.handle(), 0, VK_WHOLE_SIZE); };
  const std::array buffers{whole(values_), whole(values_), whole(rows_), whole(sums_), whole(costs_)};
  const vk::DescriptorBufferInfo items = whole(items_);
  const auto storage = vk::DescriptorType::eStorageBuffer;
  const std::array<vk::WriteDescriptorSet, 2> writes{
      {{*set_, layout::kBindPoints, 0, storage, {}, buffers}, {*set_, layout::kBindWork, 0, storage, {}, items}}};
  device_.handle().updateDescriptorSets(writes, {});
  if (!device_.traits().texels) return;
  const std::array views{values_.texels(), values_.texels(), rows_.texels(), sums_.texels()};
  device_.handle().updateDescriptorSets(
      vk::WriteDescriptorSet(*set_, layout::kBindPointTexels, 0, vk::DescriptorType::eUniformTexelBuffer, {}, {}, views), {});
}

vk::raii::CommandBuffer VulkanBatch::record(std::span<const Likeness> dispatches) {
  const vk::PipelineLayout layout = pipelines_.layout();
  vk::raii::CommandBuffer commands = device_.allocate_commands();
  commands.begin(vk::CommandBufferBeginInfo());
  commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, layout, 0, *set_, {});
  // How many groups there are changes from one submission to the next, what they run seldom: the table says the first.
  const auto dispatch = [&](std::size_t number, std::size_t offset) {
    const layout::Push push{0, 0, static_cast<std::uint32_t>(number), 0, 0, 0};
    commands.pushConstants<layout::Push>(layout, vk::ShaderStageFlagBits::eCompute, 0, push);
    commands.dispatchIndirect(items_.handle(), kHeadBytes * number + offset);
  };
  for (std::size_t number = 0; number < dispatches.size(); ++number) {
    const Likeness& like = dispatches[number];
    const auto dimension = static_cast<std::uint32_t>(traits(like.kind).dimension);
    const std::uint32_t group = chunk_shape(device_.traits(), 0, traits(like.kind).dimension).group;
    commands.bindPipeline(vk::PipelineBindPoint::eCompute,
                          pipelines_.get({Shader::cost_batch, group, static_cast<std::uint32_t>(like.kind),
                                          static_cast<std::uint32_t>(like.loss), dimension, like.tile, like.work}));
    dispatch(number, 0);
  }
  wait_for(commands, Access::eShaderRead, Stage::eComputeShader);
  commands.bindPipeline(vk::PipelineBindPoint::eCompute,
                        pipelines_.get({.shader = Shader::reduce_batch, .group = reduce_group(device_.traits())}));
  for (std::size_t number = 0; number < dispatches.size(); ++number) dispatch(number, 4 * kWord);
  wait_for(commands, Access::eHostRead, Stage::eHost);
  commands.end();
  return commands;
}

void VulkanBatch::submit(std::span<const Asked> asked) {
  std::size_t rows = 0, sums = 0;
  for (const Asked& one : asked) {
    rows += one.item->swarm.count;
    sums += one.sums;
  }
  finite_.resize(std::max(finite_.size(), rows));
  settle_points(asked);
  reserve(rows, sums, asked.size());
  write_rows(asked);
  std::vector<Likeness> dispatches = write_items(asked);
  if (recorded_.empty()) bind();  // the buffers may be new
  auto commands = recorded_.find(dispatches);
  if (commands == recorded_.end()) {
    if (recorded_.size() >= kMostRecorded) recorded_.clear();
    vk::raii::CommandBuffer made = record(dispatches);
    commands = recorded_.emplace(std::move(dispatches), std::move(made)).first;
  }
  device_.run(*commands->second);
  ++submissions_;
  const float* cost = costs_.as<const float>().data();
  const char* finite = finite_.data();
  for (const Asked& one : asked) {
    for (float& out : one.item->costs) {
      out = *finite++ ? *cost : std::numeric_limits<float>::infinity();
      ++cost;
    }
  }
}

}  // namespace vulkan

Result<std::unique_ptr<BatchEvaluator>> make_vulkan_batch(const EvaluatorOptions& options, std::string_view device, std::size_t problems) {
  return vulkan::guarded("opening a device", Failure::Kind::unavailable, [&]() -> Result<std::unique_ptr<BatchEvaluator>> {
    auto opened = vulkan::open_device(options, device);
    if (!opened) return tl::unexpected(opened.error());
    return std::make_unique<vulkan::VulkanBatch>(std::move(*opened), options, problems);
  });
}

}  // namespace swarmfit::kernels
