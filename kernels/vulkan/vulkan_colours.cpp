// The colour cost as a compute shader.
#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <mutex>

#include <fmt/format.h>

#include "kernels/colour_costs.hpp"
#include "kernels/vulkan/buffer.hpp"
#include "kernels/vulkan/guarded.hpp"
#include "kernels/vulkan/instance.hpp"

namespace swarmfit::kernels {
namespace vulkan {
namespace {

#include "embedded/colours.h"

constexpr std::uint32_t kBuffers = 3;  // sample, colours, costs
constexpr std::uint32_t kGroup = 64;
constexpr std::size_t kRounds = 65000;  // llvmpipe ends an invocation's loops after 65535 in all, without a word

struct Push {
  std::uint32_t sample_size, colour_count;
};

/// What all K share.
struct Layout {
  explicit Layout(const Device& device) {
    std::array<vk::DescriptorSetLayoutBinding, kBuffers> bindings;
    for (std::uint32_t i = 0; i < kBuffers; ++i)
      bindings[i] = vk::DescriptorSetLayoutBinding(i, vk::DescriptorType::eStorageBuffer, 1, vk::ShaderStageFlagBits::eCompute);
    sets = vk::raii::DescriptorSetLayout(device.handle(), vk::DescriptorSetLayoutCreateInfo({}, bindings));
    const vk::PushConstantRange push(vk::ShaderStageFlagBits::eCompute, 0, sizeof(Push));
    pipeline = vk::raii::PipelineLayout(device.handle(), vk::PipelineLayoutCreateInfo({}, *sets, push));
    module = vk::raii::ShaderModule(device.handle(), vk::ShaderModuleCreateInfo({}, sizeof colours_spirv, colours_spirv));
    const vk::DescriptorPoolSize size(vk::DescriptorType::eStorageBuffer, kBuffers);
    pool = vk::raii::DescriptorPool(device.handle(),
                                    vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, size));
    set = std::move(vk::raii::DescriptorSets(device.handle(), vk::DescriptorSetAllocateInfo(*pool, *sets)).front());
  }
  vk::raii::DescriptorSetLayout sets{nullptr};
  vk::raii::PipelineLayout pipeline{nullptr};
  vk::raii::ShaderModule module{nullptr};
  vk::raii::DescriptorPool pool{nullptr};
  vk::raii::DescriptorSet set{nullptr};
};

class VulkanColourCosts final : public ColourCosts {
 public:
  VulkanColourCosts(Opened opened, const EvaluatorOptions& options)
      : opened_(std::move(opened)), device_(opened_.physical, options), layout_(device_), identity_{"vulkan", device_.traits().name} {}

  const Identity& identity() const noexcept override { return identity_; }

  Result<> evaluate(const ColoursView& sample, int neighbours, const ColoursView& colours, std::span<float> costs) const override {
    if (auto ok = check_colours(sample, neighbours, colours, costs); !ok) return ok;
    if (sample.size() == 0) std::fill(costs.begin(), costs.end(), 1.0f);
    if (sample.size() == 0 || colours.size() == 0) return {};
    const std::size_t room = device_.traits().storage_range / (3 * sizeof(float));
    const std::size_t most = device_.traits().software ? std::min(room, kRounds / (static_cast<std::size_t>(neighbours) + 1)) : room;
    if (sample.size() > most)
      return fail(Failure::Kind::invalid, fmt::format("sample.size() is {}, must be <= {} on {}", sample.size(), most, identity_.device));
    const std::lock_guard lock(mutex_);
    return guarded("colour costs", Failure::Kind::device, [&]() -> Result<> {
      const auto nearest = static_cast<std::uint32_t>(std::min(sample.size(), static_cast<std::size_t>(neighbours)));
      // No more groups at once than any device takes.
      const std::size_t step = std::min<std::size_t>(room, std::size_t{kGroup} * device_.traits().grid_limit[0]);
      for (std::size_t first = 0; first < colours.size(); first += step) {
        const std::size_t count = std::min(step, colours.size() - first);
        run(sample, nearest,
            {colours.hue.subspan(first, count), colours.lightness.subspan(first, count), colours.saturation.subspan(first, count)},
            costs.subspan(first, count));
      }
      return {};
    });
  }

 private:
  void upload(const ColoursView& colours, Buffer& buffer) const {
    buffer.reserve(device_, 3 * colours.size() * sizeof(float), Residence::upload);
    auto out = buffer.as<float>().begin();
    for (const auto& column : {colours.hue, colours.lightness, colours.saturation}) out = std::copy(column.begin(), column.end(), out);
  }

  vk::Pipeline pipeline(std::uint32_t neighbours) const {
    const auto found = pipelines_.find(neighbours);
    if (found != pipelines_.end()) return *found->second;
    const std::array<std::uint32_t, 2> values{kGroup, neighbours};
    const std::array<vk::SpecializationMapEntry, 2> entries{vk::SpecializationMapEntry(0, 0, 4), vk::SpecializationMapEntry(1, 4, 4)};
    const vk::SpecializationInfo constants(static_cast<std::uint32_t>(entries.size()), entries.data(), sizeof values, values.data());
    const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *layout_.module, "main", &constants);
    vk::raii::Pipeline made(device_.handle(), nullptr, vk::ComputePipelineCreateInfo({}, stage, *layout_.pipeline));
    return *pipelines_.emplace(neighbours, std::move(made)).first->second;
  }

  void run(const ColoursView& sample, std::uint32_t neighbours, const ColoursView& colours, std::span<float> costs) const {
    upload(sample, sample_);
    upload(colours, colours_);
    costs_.reserve(device_, costs.size_bytes(), Residence::readback);
    std::array<vk::DescriptorBufferInfo, kBuffers> buffers;
    std::array<vk::WriteDescriptorSet, kBuffers> writes;
    const std::array<const Buffer*, kBuffers> bound{&sample_, &colours_, &costs_};
    for (std::uint32_t i = 0; i < kBuffers; ++i) {
      buffers[i] = vk::DescriptorBufferInfo(bound[i]->handle(), 0, VK_WHOLE_SIZE);
      writes[i] = vk::WriteDescriptorSet(*layout_.set, i, 0, vk::DescriptorType::eStorageBuffer, {}, buffers[i]);
    }
    device_.handle().updateDescriptorSets(writes, {});
    const vk::raii::CommandBuffer commands = device_.allocate_commands();
    commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, pipeline(neighbours));
    commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *layout_.pipeline, 0, *layout_.set, {});
    const Push push{static_cast<std::uint32_t>(sample.size()), static_cast<std::uint32_t>(colours.size())};
    commands.pushConstants<Push>(*layout_.pipeline, vk::ShaderStageFlagBits::eCompute, 0, push);
    commands.dispatch(static_cast<std::uint32_t>((colours.size() + kGroup - 1) / kGroup), 1, 1);
    const vk::MemoryBarrier written(vk::AccessFlagBits::eShaderWrite, vk::AccessFlagBits::eHostRead);
    commands.pipelineBarrier(vk::PipelineStageFlagBits::eComputeShader, vk::PipelineStageFlagBits::eHost, {}, written, {}, {});
    commands.end();
    device_.run(*commands);
    const auto done = costs_.as<const float>();
    std::copy_n(done.begin(), costs.size(), costs.begin());
  }

  Opened opened_;
  Device device_;
  Layout layout_;
  Identity identity_;
  mutable std::mutex mutex_;
  mutable Buffer sample_, colours_, costs_;
  mutable std::map<std::uint32_t, vk::raii::Pipeline> pipelines_;  // by K
};

}  // namespace
}  // namespace vulkan

Result<std::unique_ptr<ColourCosts>> make_vulkan_colour_costs(const EvaluatorOptions& options, std::string_view device) {
  return vulkan::guarded("opening a device", Failure::Kind::unavailable, [&]() -> Result<std::unique_ptr<ColourCosts>> {
    auto opened = vulkan::open_device(options, device);
    if (!opened) return tl::unexpected(opened.error());
    return std::make_unique<vulkan::VulkanColourCosts>(std::move(*opened), options);
  });
}

}  // namespace swarmfit::kernels
