// Many small problems on one device: a submission scores a swarm of each. Groups of invocations are of a problem and a tile of its
// particles over a chunk of its points; the sums are those of the problem alone, in the same order.
#pragma once

#include <compare>
#include <map>
#include <vector>

#include "kernels/batch_evaluator.hpp"
#include "kernels/vulkan/batch_problem.hpp"
#include "kernels/vulkan/buffer.hpp"
#include "kernels/vulkan/instance.hpp"
#include "kernels/vulkan/pipelines.hpp"
#include "shaders/layout.h"

namespace swarmfit::kernels::vulkan {

class VulkanBatch final : public BatchEvaluator {
 public:
  /// Throws std::exception.
  VulkanBatch(Opened opened, const EvaluatorOptions& options, std::size_t problems);

  const Identity& identity() const noexcept override { return identity_; }
  std::size_t problems() const noexcept override { return problems_.size(); }
  Support supports(const Workload& workload) const override;
  Result<> set_points(std::size_t problem, const PointsView& points) override;
  Result<> set_caps(std::size_t problem, std::span<const float> caps) override;
  Result<> evaluate(std::span<const BatchItem> items) override;
  Effort effort(std::size_t problem) const noexcept override { return problem < problems_.size() ? problems_[problem].effort : Effort{}; }
  std::uint64_t submissions() const noexcept override { return submissions_; }

 private:
  /// What items of one dispatch have in common.
  struct Likeness {
    ModelKind kind = ModelKind::plane;
    Loss loss = Loss::truncated_l1;
    std::uint32_t work = 1, tile = 4;
    auto operator<=>(const Likeness&) const = default;
  };
  /// An item and what it takes; items that are alike lie together.
  struct Asked {
    Likeness like;
    const BatchItem* item = nullptr;
    std::size_t sums = 0;  ///< partial sums, of all its models together
    auto order() const { return std::pair(like, item->problem); }
  };

  Result<> check(std::span<const BatchItem> items) const;
  void sort(std::span<const BatchItem> items);
  /// How many of these one submission can take, one at least.
  std::size_t fitting(std::span<const Asked> asked) const;
  void submit(std::span<const Asked> asked);
  void settle_points(std::span<const Asked> asked);
  void reserve(std::size_t rows, std::size_t sums, std::size_t items);
  void write_rows(std::span<const Asked> asked);
  /// The table of items and the arguments of the dispatches; returns what these are specialised for.
  std::vector<Likeness> write_items(std::span<const Asked> asked);
  vk::raii::CommandBuffer record(std::span<const Likeness> dispatches);
  void bind();

  Instance instance_;
  vk::raii::PhysicalDevice physical_;
  Device device_;
  Pipelines pipelines_;
  Identity identity_;
  std::vector<BatchProblem> problems_;
  std::vector<Asked> asked_;
  std::vector<char> finite_;  // a row: whether its coefficients are finite
  Buffer values_, rows_, sums_, costs_, items_;
  vk::raii::DescriptorPool pool_{nullptr};
  vk::raii::DescriptorSet set_{nullptr};
  std::map<std::vector<Likeness>, vk::raii::CommandBuffer> recorded_;
  std::uint64_t submissions_ = 0;
};

}  // namespace swarmfit::kernels::vulkan
