// The CPU back end: fixed tiles of points under TBB, Highway vectors inside (cpu_kernels.hpp). No sum depends on the number of threads
// or on the other models of a swarm.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "kernels/checks.hpp"
#include "kernels/cpu/cpu_kernels.hpp"
#include "kernels/cpu/point_passes.hpp"
#include "kernels/cpu/point_store.hpp"
#include "kernels/cpu/processor.hpp"
#include "kernels/cpu/swarm_costs.hpp"
#include "kernels/cpu/tasks.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit::kernels {
namespace {

using namespace cpu;

std::vector<std::string> kernel_names() {
  std::vector<std::string> names;
  for (const CpuKernels* kernels : available_kernels()) names.emplace_back(kernels->name);
  return names;
}

bool same_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  });
}

/// Without the number of threads: a result is the same bytes on any.
std::string device_name(const CpuKernels& kernels) { return fmt::format("CPU, {}", kernels.name); }

class CpuEvaluator final : public FitnessEvaluator {
 public:
  CpuEvaluator(const CpuKernels& kernels, int threads, bool pruning)
      : kernels_(kernels), crew_(threads), identity_{"cpu", device_name(kernels)}, costs_(kernels, pruning), passes_(kernels) {}

  const Identity& identity() const noexcept override { return identity_; }
  Support supports(const Workload& workload) const override {
    const std::size_t most = std::numeric_limits<std::int32_t>::max();
    if (workload.points <= most) return {};
    return {false, fmt::format("points is {}, must be <= {}", workload.points, most)};
  }

  Result<> set_points(const PointsView& points) override {
    effort_ = {};
    costs_.forget();
    if (auto ok = check_points(points); !ok) return ok;
    return guarded(points.count, [&] { run_in(crew_, worth_sharing(points.count), [&] { store_.assign(points); }); });
  }

  Result<> set_caps(std::span<const float> caps) override {
    if (auto ok = check_size("caps.size()", caps.size(), store_.count()); !ok) return ok;
    if (const auto row = store_.bad_cap(caps)) {
      return fail(Failure::Kind::invalid, fmt::format("caps[{}] is {}, must be finite and >= 0", *row, caps[*row]));
    }
    costs_.forget();
    run_in(crew_, worth_sharing_copy(store_.count()), [&] { store_.set_caps(caps); });
    return {};
  }

  Result<> evaluate(const SwarmView& swarm, Loss loss, std::span<const float> cutoffs, std::span<float> costs) override {
    if (auto ok = check_swarm(swarm, store_.dimension(), cutoffs, costs); !ok) return ok;
    return guarded(store_.count(), [&] {
      centre(swarm);
      const CentredSwarm centred{swarm.kind, swarm.count, coefficients_, finite_, cutoffs};
      const auto work = [&] { effort_.touched += costs_.evaluate(store_, centred, loss, costs); };
      run_in(crew_, worth_sharing(store_.costly(), swarm.count), work);
      effort_.evaluations += swarm.count;
      effort_.point_models += swarm.count * store_.finite();
    });
  }

  Result<> distances(const ModelView& model, std::span<float> distances) override {
    if (auto ok = check_model(model, store_.dimension()); !ok) return ok;
    if (auto ok = check_size("distances.size()", distances.size(), store_.count()); !ok) return ok;
    std::array<float, kMaxCoefficients> k{};
    const bool finite = centre(model, k.data());
    std::fill(distances.begin(), distances.end(), std::numeric_limits<float>::quiet_NaN());
    run_in(crew_, worth_sharing(store_.count()), [&] {
      for_each_task(store_.tiles(), [&](std::size_t tile) {
        alignas(64) std::array<float, kTilePoints> near;
        if (finite) {
          kernels_.distances(model.kind, store_.tile(tile), k.data(), near.data());
        } else {
          near.fill(std::numeric_limits<float>::infinity());
        }
        const std::size_t first = tile * kTilePoints;
        const std::size_t count = std::min(kTilePoints, store_.finite() - first);
        for (std::size_t i = 0; i < count; ++i) distances[store_.input_index(first + i)] = near[i];
      });
    });
    return {};
  }

  Result<> assign(std::span<const ModelView> models, std::span<const float> tolerance, std::span<std::uint16_t> labels) override {
    if (auto ok = check_assign(models, store_.dimension(), store_.count(), tolerance, labels); !ok) return ok;
    return guarded(store_.count(), [&] {
      std::vector<std::array<float, kMaxCoefficients>> coefficients(models.size());
      std::vector<char> usable(models.size());
      for (std::size_t m = 0; m < models.size(); ++m) usable[m] = centre(models[m], coefficients[m].data());
      std::fill(labels.begin(), labels.end(), std::uint16_t{0});
      run_in(crew_, worth_sharing(store_.count()), [&] {
        for_each_task(store_.tiles(), [&](std::size_t tile) { assign_tile(tile, models, coefficients, usable, tolerance, labels); });
      });
    });
  }

  Effort effort() const noexcept override { return effort_; }

  Result<> survey(const PointsView& points, Survey& survey) override {
    if (auto ok = check_points(points); !ok) return ok;
    return guarded(points.count, [&] { run_in(crew_, worth_sharing(points.count), [&] { passes_.survey(points, survey); }); });
  }

  Result<> weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
                 std::span<Evidence> evidence) override {
    if (auto ok = check_weigh(points, how, models, distances, evidence); !ok) return ok;
    return guarded(points.count,
                   [&] { run_in(crew_, worth_sharing(points.count), [&] { passes_.weigh(points, how, models, distances, evidence); }); });
  }

  Result<> claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                 std::span<std::uint16_t> labels, std::span<Evidence> evidence) override {
    if (auto ok = check_claim(points, tolerance, models, labels, evidence); !ok) return ok;
    return guarded(points.count, [&] {
      run_in(crew_, worth_sharing(points.count), [&] { passes_.claim(points, tolerance, models, labels, evidence); });
    });
  }

  bool shares(std::size_t models) const noexcept override { return crew_.threads() > 1 && worth_sharing(store_.finite(), models); }

  void share_out(std::size_t tasks, const std::function<void(std::size_t)>& body) override {
    run_in(crew_, true, [&] { for_each_task(tasks, body); });
  }

 private:
  /// Coefficients in the frame of the stored points; false if one is not finite.
  bool centre(const ModelView& model, float* k) const {
    char finite = 0;
    centred_coefficients(model.kind, 1, model.parameters.data(), store_.centre(), k, &finite);
    return finite != 0;
  }

  void centre(const SwarmView& swarm) {
    coefficients_.resize(swarm.count * static_cast<std::size_t>(traits(swarm.kind).coefficient_count));
    finite_.resize(swarm.count);
    centred_coefficients(swarm.kind, swarm.count, swarm.parameters.data(), store_.centre(), coefficients_.data(), finite_.data());
  }

  void assign_tile(std::size_t tile, std::span<const ModelView> models,
                   const std::vector<std::array<float, kMaxCoefficients>>& coefficients, const std::vector<char>& usable,
                   std::span<const float> tolerance, std::span<std::uint16_t> labels) const {
    alignas(64) std::array<float, kTilePoints> near, nearest, allowed;
    std::array<std::uint16_t, kTilePoints> label;
    const std::size_t first = tile * kTilePoints;
    const std::size_t count = std::min(kTilePoints, store_.finite() - first);
    nearest.fill(std::numeric_limits<float>::infinity());
    label.fill(0);
    for (std::size_t i = 0; i < count; ++i) allowed[i] = tolerance[tolerance.size() == 1 ? 0 : store_.input_index(first + i)];
    for (std::size_t m = 0; m < models.size(); ++m) {
      if (!usable[m]) continue;
      kernels_.distances(models[m].kind, store_.tile(tile), coefficients[m].data(), near.data());
      kernels_.keep_nearest(near.data(), allowed.data(), count, static_cast<std::uint16_t>(m + 1), nearest.data(), label.data());
    }
    for (std::size_t i = 0; i < count; ++i) labels[store_.input_index(first + i)] = label[i];
  }

  const CpuKernels& kernels_;
  Crew crew_;
  Identity identity_;
  PointStore store_;
  std::vector<float> coefficients_;
  std::vector<char> finite_;  ///< a model: whether its coefficients are finite
  SwarmCosts costs_;
  PointPasses passes_;
  Effort effort_;
};

/// What a back end that leaves them to the processor makes of the passes over the caller's points.
template <class Pass>
Result<> pass_on_cpu(std::size_t points, Pass&& pass) {
  return guarded(points, [&] {
    PointPasses passes(*available_kernels().front());
    pass(passes);
  });
}

}  // namespace

Result<> FitnessEvaluator::survey(const PointsView& points, Survey& survey) {
  if (auto ok = check_points(points); !ok) return ok;
  return pass_on_cpu(points.count, [&](PointPasses& passes) { passes.survey(points, survey); });
}

Result<> FitnessEvaluator::weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models,
                                 std::span<float> distances, std::span<Evidence> evidence) {
  if (auto ok = check_weigh(points, how, models, distances, evidence); !ok) return ok;
  return pass_on_cpu(points.count, [&](PointPasses& passes) { passes.weigh(points, how, models, distances, evidence); });
}

Result<> FitnessEvaluator::claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                                 std::span<std::uint16_t> labels, std::span<Evidence> evidence) {
  if (auto ok = check_claim(points, tolerance, models, labels, evidence); !ok) return ok;
  return pass_on_cpu(points.count, [&](PointPasses& passes) { passes.claim(points, tolerance, models, labels, evidence); });
}

bool FitnessEvaluator::shares(std::size_t) const noexcept { return false; }

void FitnessEvaluator::share_out(std::size_t tasks, const std::function<void(std::size_t)>& body) { for_each_task(tasks, body); }

Result<std::unique_ptr<FitnessEvaluator>> make_cpu_evaluator(const EvaluatorOptions& options) {
  const auto threads = choose_threads(options.threads);
  if (!threads) return tl::unexpected(threads.error());
  for (const CpuKernels* kernels : available_kernels()) {
    if (options.simd.empty() || same_ignoring_case(options.simd, kernels->name))
      return std::make_unique<CpuEvaluator>(*kernels, *threads, options.pruning);
  }
  return fail(Failure::Kind::unavailable,
              fmt::format("simd is '{}', must be one of what this processor has: {}", options.simd, fmt::join(kernel_names(), ", ")));
}

std::vector<DeviceDescription> cpu_devices() {
  const int threads = processors();
  DeviceDescription device{"cpu", device_name(*available_kernels().front()), "cpu", true, "always there", {}};
  device.limits.emplace_back("instruction sets", fmt::format("{}", fmt::join(kernel_names(), ", ")));
  device.limits.emplace_back("threads", fmt::format("{}", threads));
  device.limits.emplace_back("points", fmt::format("{}", std::numeric_limits<std::int32_t>::max()));
  return {device};
}

}  // namespace swarmfit::kernels
