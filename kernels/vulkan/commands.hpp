// Records what the device is to do: a swarm's costs, one model's distances, the assignment to several.
#pragma once

#include <map>
#include <tuple>
#include <vector>

#include "kernels/vulkan/cloud.hpp"
#include "kernels/vulkan/pipelines.hpp"
#include "shaders/layout.h"

namespace swarmfit::kernels::vulkan {

/// Buffers, descriptors and recorded commands of one cloud. What was recorded is used again while shapes and buffers stay.
class Commands {
 public:
  Commands(const Device& device, Pipelines& pipelines) : device_(device), pipelines_(pipelines) {}

  /// After the cloud's points have changed.
  void bind(Cloud& cloud, int dimension);
  /// Particles that one submission can take.
  std::size_t swarm_limit() const;
  /// Models that assign can take.
  std::size_t model_limit() const { return device_.traits().storage_range / kModelBytes; }

  /// Room for `models` coefficient rows, mapped: kCoefficientStride floats each.
  std::span<float> coefficients(std::size_t models);

  /// Runs both passes over the coefficients written, so many a model; sums segments in double.
  void costs(ModelKind kind, int coefficients, Loss loss, std::span<float> costs);
  /// The same of a bounded cloud, pruned: rows hold what the slots of shaders/layout.h ask for as well. Returns how many residuals were
  /// computed.
  std::uint64_t pruned_costs(ModelKind kind, int coefficients, Loss loss, std::span<float> costs);
  /// Fills each segment's output, mapped, with floats.
  void distances(ModelKind kind);
  /// Fills each segment's output with 32-bit labels. `kind` is that of all models, or layout::kAnyModel. A negative tolerance: each point
  /// has its own.
  void assign(std::uint32_t kind, std::size_t models, float tolerance);

  static constexpr std::size_t kModelBytes = sizeof(float) * layout::kCoefficientStride;

 private:
  using Key = std::tuple<ModelKind, Loss, std::uint32_t, std::uint32_t, std::size_t>;  // kind, loss, tile, tiles, models pruned

  void make_sets();
  void reserve_particles(std::uint32_t particles);
  void bind_costs();
  void bind_map(bool own_tolerance);
  void bind_set(vk::DescriptorSet set, const Segment& segment, const Buffer& caps, const Buffer& out) const;
  template <class Dispatch>
  void record_each(const vk::raii::CommandBuffer& commands, vk::Pipeline pipeline, std::uint32_t models, Dispatch&& dispatch) const;
  vk::raii::CommandBuffer record_costs(ModelKind kind, Loss loss, const TileShape& shape) const;
  vk::raii::CommandBuffer record_pruned(ModelKind kind, Loss loss, const TileShape& shape, std::size_t models) const;
  /// Runs what is recorded under this, or what `record` records, and adds up the segments' costs.
  template <class Record>
  void run_costs(const Key& key, std::span<float> costs, Record&& record);
  void run_map(const Specialisation& wanted, std::size_t models, float tolerance);
  std::size_t cost_offset(std::size_t segment) const { return segment * cost_stride_; }

  const Device& device_;
  Pipelines& pipelines_;
  Cloud* cloud_ = nullptr;
  int dimension_ = 0;
  Buffer coefficients_;
  std::vector<Buffer> lower_;  // a segment; see shaders/bounds.glsl
  std::vector<Buffer> work_;   // a segment of a bounded cloud; see shaders/layout.h
  Buffer costs_;               // [segment][particle], rows cost_stride_ floats apart
  std::size_t cost_stride_ = 0;
  std::size_t room_ = 0;  // particles that partials and costs have room for
  vk::raii::DescriptorPool pool_{nullptr};
  std::vector<vk::raii::DescriptorSet> cost_sets_, map_sets_;  // one a segment
  std::map<Key, vk::raii::CommandBuffer> recorded_;
  vk::raii::CommandBuffer once_{nullptr};
};

}  // namespace swarmfit::kernels::vulkan
