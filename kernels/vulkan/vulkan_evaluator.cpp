#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "kernels/checks.hpp"
#include "kernels/evaluators.hpp"
#include "kernels/own/own_passes.hpp"
#include "kernels/pruning_pause.hpp"
#include "kernels/vulkan/commands.hpp"
#include "kernels/vulkan/guarded.hpp"
#include "kernels/vulkan/model_rows.hpp"
#include "shaders/layout.h"

namespace swarmfit::kernels {
namespace vulkan {
namespace {

/// Shares of the residuals above which pruning does not pay. Measured on lavapipe; a GPU's is the processor's, for want of one to measure.
constexpr double kPoorInSoftware = 0.6, kPoor = 0.8;

class VulkanEvaluator final : public FitnessEvaluator {
 public:
  VulkanEvaluator(Instance instance, vk::raii::PhysicalDevice physical, const EvaluatorOptions& options)
      : instance_(std::move(instance)),
        physical_(std::move(physical)),
        device_(physical_, options),
        pipelines_(device_, options.pipeline_cache),
        cloud_(device_, options.pruning && !options.own),
        commands_(device_, pipelines_),
        identity_{"vulkan", device_.traits().name},
        poor_(device_.traits().software ? kPoorInSoftware : kPoor) {}

  /// Takes this model in place of those that are built in. Before anything else.
  Result<> adopt(std::shared_ptr<const OwnModel> own);

  const Identity& identity() const noexcept override { return identity_; }
  Support supports(const Workload& workload) const override;
  Result<> set_points(const PointsView& points) override;
  Result<> set_caps(std::span<const float> caps) override;
  Result<> evaluate(const SwarmView& swarm, Loss loss, std::span<const float> cutoffs, std::span<float> costs) override;
  Result<> distances(const ModelView& model, std::span<float> distances) override;
  Result<> assign(std::span<const ModelView> models, std::span<const float> tolerance, std::span<std::uint16_t> labels) override;
  Effort effort() const noexcept override { return effort_; }
  Result<> weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                 std::span<Evidence> evidence) override;
  Result<> claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                 std::span<std::uint16_t> labels, std::span<Evidence> evidence) override;

 private:
  ModelTraits traits_of(ModelKind kind) const noexcept { return own_ ? own_->traits() : traits(kind); }
  void evaluate_slice(const SwarmView& swarm, Loss loss, std::span<const float> cutoffs, std::span<float> costs);
  void write_for_pruning(ModelKind kind, float cutoff, std::span<float> row) const;
  bool write_model(ModelKind kind, const double* parameters, std::span<float> row) const;
  template <class T, class Out>
  void read_output(std::span<Out> out);

  Instance instance_;
  vk::raii::PhysicalDevice physical_;
  Device device_;
  Pipelines pipelines_;
  Cloud cloud_;
  Commands commands_;
  Identity identity_;
  std::shared_ptr<const OwnModel> own_;
  PruningPause pruning_;
  double poor_;  ///< share of the residuals above which pruning does not pay
  std::vector<char> finite_;  // a model of the swarm: whether its coefficients are finite
  int dimension_ = 0;
  Effort effort_;
};

Result<> VulkanEvaluator::adopt(std::shared_ptr<const OwnModel> own) {
  const auto shaders = compile_own(*own, device_.traits().texels);
  if (!shaders) return tl::unexpected(shaders.error());
  pipelines_.use(*shaders);
  own_ = std::move(own);
  return {};
}

Support VulkanEvaluator::supports(const Workload& workload) const {
  const ModelTraits model = traits_of(workload.kind);
  if (!own_ && !has_shader(workload.kind)) return {false, fmt::format("{} has no shader", model.name)};
  const std::size_t bytes = workload.points * (static_cast<std::size_t>(model.dimension) + 1) * sizeof(float);
  if (bytes > device_.traits().memory) {
    return {false, fmt::format("{} points take {} bytes, {} has {}", workload.points, bytes, identity_.device, device_.traits().memory)};
  }
  return {};
}

Result<> VulkanEvaluator::set_points(const PointsView& points) {
  if (auto ok = check_points(points); !ok) return ok;
  dimension_ = 0;  // until all of it has worked
  pruning_.forget();
  auto done = guarded("set_points", Failure::Kind::device, [&]() -> Result<> {
    Extent extent = measure(points);
    if (own_ && !own_->recentre) std::fill_n(extent.centre, kMaxDimension, 0.0);
    if (auto ok = cloud_.set(points, std::move(extent)); !ok) return ok;
    commands_.bind(cloud_, points.dimension);
    return {};
  });
  if (done) dimension_ = points.dimension;
  effort_ = {};
  return done;
}

Result<> VulkanEvaluator::set_caps(std::span<const float> caps) {
  if (auto ok = check_caps(caps, cloud_.extent().finite); !ok) return ok;
  pruning_.forget();
  return guarded("set_caps", Failure::Kind::device, [&]() -> Result<> {
    cloud_.write_caps(caps);
    return {};
  });
}

Result<> VulkanEvaluator::evaluate(const SwarmView& swarm, Loss loss, std::span<const float> cutoffs, std::span<float> costs) {
  if (auto ok = check_swarm(swarm, dimension_, cutoffs, costs, own_.get()); !ok) return ok;
  auto done = guarded("evaluate", Failure::Kind::device, [&]() -> Result<> {
    const auto width = static_cast<std::size_t>(traits_of(swarm.kind).parameter_count);
    const std::size_t limit = commands_.swarm_limit();
    for (std::size_t j = 0; j < swarm.count; j += limit) {
      const std::size_t count = std::min(limit, swarm.count - j);
      evaluate_slice({swarm.kind, count, swarm.parameters.subspan(j * width, count * width)}, loss,
                     cutoffs.empty() ? cutoffs : cutoffs.subspan(j, count), costs.subspan(j, count));
    }
    return {};
  });
  if (!done) return done;
  effort_.evaluations += swarm.count;
  effort_.point_models += swarm.count * cloud_.extent().finite_count;
  return {};
}

void VulkanEvaluator::evaluate_slice(const SwarmView& swarm, Loss loss, std::span<const float> cutoffs, std::span<float> costs) {
  const ModelTraits model = traits_of(swarm.kind);
  const auto width = static_cast<std::size_t>(model.parameter_count);
  // In software a residual of three multiply-adds costs less than to see whether it is needed.
  const bool worth = model.bounded && !(device_.traits().software && model.affine);
  const bool pruned = cloud_.bounded() && worth && pruning_.now();
  const std::span<float> rows = commands_.coefficients(swarm.count);
  finite_.resize(swarm.count);
  for (std::size_t j = 0; j < swarm.count; ++j) {
    const std::span<float> row = rows.subspan(j * layout::kCoefficientStride, layout::kCoefficientStride);
    finite_[j] = write_model(swarm.kind, swarm.parameters.data() + j * width, row);
    if (pruned) write_for_pruning(swarm.kind, cutoffs.empty() ? std::numeric_limits<float>::infinity() : cutoffs[j], row);
  }
  const std::uint64_t all = std::uint64_t{swarm.count} * cloud_.extent().finite_count;
  if (cloud_.segments().empty()) {
    std::fill(costs.begin(), costs.end(), 0.0F);
  } else if (pruned) {
    const std::uint64_t touched = std::min(all, commands_.pruned_costs(swarm.kind, model.coefficient_count, loss, costs));
    effort_.touched += touched;
    pruning_.note(static_cast<double>(touched) / static_cast<double>(all), poor_);
  } else {
    commands_.costs(swarm.kind, model.coefficient_count, loss, costs);
    effort_.touched += all;
  }
  for (std::size_t j = 0; j < swarm.count; ++j) {
    if (!finite_[j]) costs[j] = std::numeric_limits<float>::infinity();
  }
}

/// Returns false, and writes zeros, if a coefficient is not finite.
bool VulkanEvaluator::write_model(ModelKind kind, const double* parameters, std::span<float> row) const {
  if (!own_) return write_row(kind, parameters, cloud_.extent().centre, row);
  const OwnDistances model(*own_, {parameters, static_cast<std::size_t>(own_->parameter_count)}, cloud_.extent().centre);
  return write_row(kind, model.parameters(), model.usable(), row);
}

void VulkanEvaluator::write_for_pruning(ModelKind kind, float cutoff, std::span<float> row) const {
  row[layout::kSlackSlot] = residual_rounding(kind, row.data(), cloud_.reach().data());
  row[layout::kSteepSlot] = residual_steepness(kind, row.data());
  row[layout::kCutoffSlot] = cutoff;
}

template <class T, class Out>
void VulkanEvaluator::read_output(std::span<Out> out) {
  for (const Segment& segment : cloud_.segments()) {
    const std::span<const T> values = segment.output.as<const T>();
    for (std::size_t i = 0; i < segment.count; ++i) out[cloud_.row(segment.first + i)] = static_cast<Out>(values[i]);
  }
}

Result<> VulkanEvaluator::distances(const ModelView& model, std::span<float> distances) {
  if (auto ok = check_model(model, dimension_, own_.get()); !ok) return ok;
  if (auto ok = check_size("distances.size()", distances.size(), cloud_.extent().finite.size()); !ok) return ok;
  return guarded("distances", Failure::Kind::device, [&]() -> Result<> {
    const bool finite = write_model(model.kind, model.parameters.data(), commands_.coefficients(1));
    if (!cloud_.segments().empty() && finite) commands_.distances(model.kind);
    std::fill(distances.begin(), distances.end(), std::numeric_limits<float>::quiet_NaN());
    if (finite) {
      read_output<float>(distances);
    } else {
      for (std::size_t i = 0; i < distances.size(); ++i) {
        if (cloud_.extent().finite[i]) distances[i] = std::numeric_limits<float>::infinity();
      }
    }
    return {};
  });
}

Result<> VulkanEvaluator::assign(std::span<const ModelView> models, std::span<const float> tolerance, std::span<std::uint16_t> labels) {
  if (auto ok = check_assign(models, dimension_, cloud_.extent().finite.size(), tolerance, labels, own_.get()); !ok) return ok;
  if (models.size() > commands_.model_limit()) {
    return fail(Failure::Kind::invalid,
                fmt::format("models.size() is {}, must be <= {} on {}", models.size(), commands_.model_limit(), identity_.device));
  }
  return guarded("assign", Failure::Kind::device, [&]() -> Result<> {
    std::fill(labels.begin(), labels.end(), std::uint16_t{0});
    if (cloud_.segments().empty() || models.empty()) return {};
    const std::span<float> rows = commands_.coefficients(models.size());
    std::size_t written = 0;
    for (std::size_t m = 0; m < models.size(); ++m) {
      const std::span<float> row = rows.subspan(written * layout::kCoefficientStride, layout::kCoefficientStride);
      if (!write_model(models[m].kind, models[m].parameters.data(), row)) continue;
      row[layout::kNumberSlot] = static_cast<float>(m + 1);
      ++written;
    }
    if (tolerance.size() > 1) cloud_.write_tolerance(tolerance);
    const auto first = models.front().kind;
    const bool alike = std::all_of(models.begin(), models.end(), [&](const ModelView& model) { return model.kind == first; });
    commands_.assign(alike ? static_cast<std::uint32_t>(first) : layout::kAnyModel, written, tolerance.size() > 1 ? -1.0F : tolerance[0]);
    read_output<std::uint32_t>(labels);
    return {};
  });
}

Result<> VulkanEvaluator::weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models,
                                std::span<float> distances, std::span<Evidence> evidence) {
  if (!own_) return FitnessEvaluator::weigh(points, how, models, distances, evidence);
  if (auto ok = check_weigh(points, how, models, distances, evidence, own_.get()); !ok) return ok;
  return guarded("weigh", Failure::Kind::device, [&]() -> Result<> {
    weigh_own(*own_, points, how, models, distances, evidence, Sharing::threads);
    return {};
  });
}

Result<> VulkanEvaluator::claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                                std::span<std::uint16_t> labels, std::span<Evidence> evidence) {
  if (!own_) return FitnessEvaluator::claim(points, tolerance, models, labels, evidence);
  if (auto ok = check_claim(points, tolerance, models, labels, evidence, own_.get()); !ok) return ok;
  return guarded("claim", Failure::Kind::device, [&]() -> Result<> {
    claim_own(*own_, points, tolerance, models, labels, evidence, Sharing::threads);
    return {};
  });
}

Result<std::unique_ptr<FitnessEvaluator>> make(const EvaluatorOptions& options, std::string_view name) {
  auto opened = open_device(options, name);
  if (!opened) return tl::unexpected(opened.error());
  auto evaluator = std::make_unique<VulkanEvaluator>(std::move(opened->instance), std::move(opened->physical), options);
  if (options.own) {
    if (auto done = evaluator->adopt(options.own); !done) return tl::unexpected(done.error());
  }
  return evaluator;
}

}  // namespace
}  // namespace vulkan

Result<std::unique_ptr<FitnessEvaluator>> make_vulkan_evaluator(const EvaluatorOptions& options, std::string_view device) {
  return vulkan::guarded("opening a device", Failure::Kind::unavailable, [&] { return vulkan::make(options, device); });
}

}  // namespace swarmfit::kernels
